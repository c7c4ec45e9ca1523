//! Nodes by their tags.

use super::MshError;
use super::sparse::Sparse;
use crate::formats::finish::BadPoints;
use planish_core::vec3::Vec3;

/// A table by tag may have so many places per node.
const PLACES: u64 = 4;

/// The nodes of a file: where they are, and which is meant by a tag.
#[derive(Debug)]
pub struct Nodes {
    pub points: Vec<Vec3>,
    pub bad: BadPoints,
    numbering: Numbering,
}

/// The positions of tags. Tags may be any numbers, and memory is taken for as many as there are only.
#[derive(Debug, PartialEq, Eq)]
enum Numbering {
    /// One follows the other, from this one on.
    Run(u64),
    /// From this one on, with gaps.
    Table(u64, Vec<u32>),
    /// Far apart.
    Sparse(Sparse),
}

/// No node.
pub const NONE: u32 = u32::MAX;

impl Nodes {
    /// Nodes, each with its tag.
    pub fn new(points: Vec<Vec3>, tags: Vec<u64>, bad: BadPoints) -> Result<Self, MshError> {
        Ok(Self { points, bad, numbering: Numbering::new(tags)? })
    }

    /// The position of the node with this tag.
    #[inline]
    pub fn find(&self, tag: u64) -> Option<u32> {
        match &self.numbering {
            Numbering::Run(first) => {
                let at = tag.checked_sub(*first).filter(|at| *at < self.points.len() as u64);
                at.map(|at| at as u32)
            }
            Numbering::Table(first, table) => {
                let at = usize::try_from(tag.checked_sub(*first)?).ok()?;
                table.get(at).copied().filter(|node| *node != NONE)
            }
            Numbering::Sparse(sparse) => sparse.find(tag),
        }
    }

    /// The positions of the nodes with these tags, [`NONE`] where there is none.
    pub fn find_all(&self, tags: &[u64], found: &mut Vec<u32>) {
        found.clear();
        match &self.numbering {
            Numbering::Sparse(sparse) => sparse.find_all(tags, found),
            _ => found.extend(tags.iter().map(|tag| self.find(*tag).unwrap_or(NONE))),
        }
    }
}

impl Numbering {
    fn new(tags: Vec<u64>) -> Result<Self, MshError> {
        let first = tags.iter().copied().min().unwrap_or(0);
        let span = tags.iter().copied().max().unwrap_or(0) - first;
        if tags.iter().zip(0..).all(|(tag, i)| tag - first == i) {
            Ok(Self::Run(first))
        } else if span < PLACES * tags.len() as u64 {
            Self::table(&tags, first, span as usize + 1)
        } else {
            Sparse::new(tags).map(Self::Sparse)
        }
    }

    fn table(tags: &[u64], first: u64, places: usize) -> Result<Self, MshError> {
        let mut table = vec![NONE; places];
        for (node, tag) in tags.iter().enumerate() {
            let slot = &mut table[(tag - first) as usize];
            if *slot != NONE {
                return Err(MshError::SameNode { node: *tag });
            }
            *slot = node as u32;
        }
        Ok(Self::Table(first, table))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_of_all_sorts_are_found() {
        let rows: [&[u64]; 7] = [
            &[],
            &[7],
            &[5, 6, 7, 8],
            &[8, 6, 5, 7],
            &[10, 3, 5, 7],
            &[1, u64::MAX, 1 << 40, 0],
            &[u64::MAX - 1, 9, 1 << 40],
        ];
        for tags in rows {
            let points = vec![[0.0; 3]; tags.len()];
            let nodes = Nodes::new(points, tags.to_vec(), BadPoints::default()).expect("distinct tags");
            for tag in [0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 1 << 40, u64::MAX - 1, u64::MAX] {
                let expected = tags.iter().position(|t| *t == tag).map(|at| at as u32);
                assert_eq!(nodes.find(tag), expected, "{tag} among {tags:?}");
                let mut found = vec![7];
                nodes.find_all(&[tag], &mut found);
                assert_eq!(found, [expected.unwrap_or(NONE)], "{tag} among {tags:?}");
            }
        }
    }

    #[test]
    fn equal_tags_are_refused() {
        for tags in [[1, 2, 2], [5, 5, 5], [1, u64::MAX, 1]] {
            let twice = Nodes::new(vec![[0.0; 3]; 3], tags.to_vec(), BadPoints::default()).map(|nodes| nodes.points);
            assert!(matches!(twice, Err(MshError::SameNode { .. })), "{tags:?}");
        }
    }
}
