//! Nodes by tags that are far apart.
//!
//! Tags are put into buckets, about one in each, by their distance from the first: tags that follow each other in a file
//! then lie side by side in memory. Where they come in clumps, so that a bucket is crowded, all are scattered by a
//! multiplication instead (Knuth, The Art of Computer Programming 3, 6.4). In a bucket, tags are sorted and found by
//! halving: no choice of tags takes more than a sort.

use super::MshError;
use super::nodes::NONE;

/// More tags in one bucket are a crowd. By experience: with fewer, harmless clumps would be scattered over memory; with more,
/// finding a tag takes more steps.
const CROWD: u32 = 16;

/// The golden ratio, of 2^64: scatters what lies close together.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// Nodes by bucket.
#[derive(Debug, PartialEq, Eq)]
pub struct Sparse {
    scatter: Scatter,
    /// Where each bucket begins, and the end of the last one.
    starts: Vec<u32>,
    /// Positions, by bucket; and two more, so that two can be looked at wherever a bucket begins.
    nodes: Vec<u32>,
    /// The tag of each node.
    tags: Vec<u64>,
}

/// Which bucket a tag belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Scatter {
    first: u64,
    factor: u64,
    shift: u32,
}

impl Scatter {
    #[inline]
    fn bucket(self, tag: u64) -> usize {
        (tag.wrapping_sub(self.first).wrapping_mul(self.factor) >> self.shift) as usize
    }

    /// How many tags each bucket gets.
    fn counts(self, tags: &[u64], buckets: usize) -> Vec<u32> {
        let mut counts = vec![0; buckets];
        for tag in tags {
            counts[self.bucket(*tag)] += 1;
        }
        counts
    }
}

impl Sparse {
    /// Finds the nodes with these tags, each of which may be there once.
    pub fn new(tags: Vec<u64>) -> Result<Self, MshError> {
        let first = tags.iter().copied().min().unwrap_or(0);
        let span = tags.iter().copied().max().unwrap_or(0) - first;
        let bits = tags.len().max(2).next_power_of_two().ilog2();
        // The highest bits of the distance from the first tag tell the bucket.
        let shift = (u64::BITS - span.leading_zeros()).saturating_sub(bits);
        let mut scatter = Scatter { first, factor: 1, shift };
        let mut counts = scatter.counts(&tags, 1 << bits);
        if counts.iter().any(|count| *count > CROWD) {
            scatter = Scatter { first, factor: GOLDEN, shift: u64::BITS - bits };
            counts = scatter.counts(&tags, 1 << bits);
        }
        let mut sparse = Self { scatter, starts: counts, nodes: vec![0; tags.len() + 2], tags };
        sparse.fill();
        sparse.sort()?;
        Ok(sparse)
    }

    /// Puts nodes into their buckets, whose sizes are known.
    fn fill(&mut self) {
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.starts.push(end);
        // Each bucket is filled from its end: what is left of the ends are the starts.
        for (node, tag) in self.tags.iter().enumerate().rev() {
            let start = &mut self.starts[self.scatter.bucket(*tag)];
            *start -= 1;
            self.nodes[*start as usize] = node as u32;
        }
    }

    /// Sorts each bucket by tags; an error if a tag is there twice.
    fn sort(&mut self) -> Result<(), MshError> {
        let tag = |node: &u32| self.tags[*node as usize];
        for bucket in self.starts.windows(2).filter(|bucket| bucket[1] - bucket[0] > 1) {
            let nodes = &mut self.nodes[bucket[0] as usize..bucket[1] as usize];
            nodes.sort_unstable_by_key(tag);
            if let Some(pair) = nodes.windows(2).find(|pair| tag(&pair[0]) == tag(&pair[1])) {
                return Err(MshError::SameNode { node: tag(&pair[0]) });
            }
        }
        Ok(())
    }

    /// The position of a tag.
    #[inline]
    pub fn find(&self, tag: u64) -> Option<u32> {
        let bucket = self.scatter.bucket(tag);
        let [start, end] = *self.starts.get(bucket..)?.first_chunk()?;
        let nodes = &self.nodes[start as usize..end as usize];
        let at = nodes.binary_search_by_key(&tag, |node| self.tags[*node as usize]).ok()?;
        Some(nodes[at])
    }

    /// Adds the positions of tags, [`NONE`] for those that are not there. Memory is slow to reach, so all is asked for
    /// before anything is looked at; and most buckets have one node or two.
    pub fn find_all(&self, tags: &[u64], found: &mut Vec<u32>) {
        // A tag far beyond the last one has no bucket: it is looked for in the first, in vain.
        let start = |tag: &u64| self.starts.get(self.scatter.bucket(*tag)).map_or(0, |start| *start as usize);
        let starts: Vec<usize> = tags.iter().map(start).collect();
        let near: Vec<[u32; 2]> = starts.iter().map(|at| [self.nodes[*at], self.nodes[*at + 1]]).collect();
        for (tag, near) in tags.iter().zip(near) {
            let node = near.into_iter().find(|node| self.tags[*node as usize] == *tag);
            found.push(node.or_else(|| self.find(*tag)).unwrap_or(NONE));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_of_all_sorts_are_found() {
        type Tag = fn(u64) -> u64;
        let sorts: [(&str, Tag); 6] = [
            ("rising", |i| 1000 * i + 7),
            ("falling", |i| u64::MAX - 1000 * i),
            ("in clumps", |i| ((i / 100) << 50) + i % 100),
            ("one far away", |i| if i == 5 { u64::MAX } else { i }),
            ("powers", |i| (1 << (10 + i % 50)) + i / 50),
            ("random", |i| (i + 1).wrapping_mul(GOLDEN)),
        ];
        for (sort, tag) in sorts {
            let tags: Vec<u64> = (0..600).map(tag).collect();
            let sparse = Sparse::new(tags.clone()).unwrap_or_else(|e| panic!("{sort}: {e}"));
            let mut found = Vec::new();
            sparse.find_all(&tags, &mut found);
            assert_eq!(found, (0..600).collect::<Vec<u32>>(), "{sort}");
            for (node, tag) in tags.iter().enumerate() {
                assert_eq!(sparse.find(*tag), Some(node as u32), "{sort}");
                let next = tag.wrapping_add(1);
                assert_eq!(sparse.find(next), tags.iter().position(|t| *t == next).map(|at| at as u32), "{sort}");
            }
        }
    }

    #[test]
    fn equal_tags_are_refused() {
        let tags: Vec<u64> = (0..100).map(|i| (i % 99) << 40).collect();
        assert_eq!(Sparse::new(tags), Err(MshError::SameNode { node: 0 }));
    }
}
