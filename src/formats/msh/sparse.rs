//! Nodes by tags that are far apart.
//!
//! Tags are put into buckets, about one in each, by their distance from the first: tags that follow each other in a file
//! then lie side by side in memory. Where they come in clumps, so that a bucket is crowded, all are scattered by a
//! multiplication instead (Knuth, The Art of Computer Programming 3, 6.4). In a bucket, tags are sorted and found by
//! halving: no choice of tags takes more than a sort.

use super::MshError;

/// More tags in one bucket are a crowd.
const CROWD: u32 = 16;

/// The golden ratio, of 2^64: scatters what lies close together.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

/// Tags and positions, by bucket.
#[derive(Debug, PartialEq, Eq)]
pub struct Sparse {
    scatter: Scatter,
    /// Where each bucket begins, and the end of the last one.
    starts: Vec<u32>,
    tags: Vec<(u64, u32)>,
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
        tags.iter().for_each(|tag| counts[self.bucket(*tag)] += 1);
        counts
    }
}

impl Sparse {
    /// Finds the positions of tags, each of which may be there once.
    pub fn new(tags: &[u64]) -> Result<Self, MshError> {
        let first = tags.iter().copied().min().unwrap_or(0);
        let span = tags.iter().copied().max().unwrap_or(0) - first;
        let bits = tags.len().max(2).next_power_of_two().ilog2();
        let mut scatter = Scatter { first, factor: 1, shift: (u64::BITS - span.leading_zeros()).saturating_sub(bits) };
        let mut counts = scatter.counts(tags, 1 << bits);
        if counts.iter().any(|count| *count > CROWD) {
            scatter = Scatter { first, factor: GOLDEN, shift: u64::BITS - bits };
            counts = scatter.counts(tags, 1 << bits);
        }
        let mut sparse = Self { scatter, starts: counts, tags: vec![(0, 0); tags.len()] };
        sparse.fill(tags);
        sparse.sort()?;
        Ok(sparse)
    }

    /// Puts tags into their buckets, whose sizes are known.
    fn fill(&mut self, tags: &[u64]) {
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.starts.push(end);
        // Each bucket is filled from its end: what is left of the ends are the starts.
        for (node, tag) in tags.iter().enumerate().rev() {
            let start = &mut self.starts[self.scatter.bucket(*tag)];
            *start -= 1;
            self.tags[*start as usize] = (*tag, node as u32);
        }
    }

    /// Sorts each bucket; an error if a tag is there twice.
    fn sort(&mut self) -> Result<(), MshError> {
        for bucket in self.starts.windows(2).filter(|bucket| bucket[1] - bucket[0] > 1) {
            let tags = &mut self.tags[bucket[0] as usize..bucket[1] as usize];
            tags.sort_unstable();
            if let Some(pair) = tags.windows(2).find(|pair| pair[0].0 == pair[1].0) {
                return Err(MshError::SameNode { node: pair[0].0 });
            }
        }
        Ok(())
    }

    /// The position of a tag.
    #[inline]
    pub fn find(&self, tag: u64) -> Option<u32> {
        let bucket = self.scatter.bucket(tag);
        let [start, end] = *self.starts.get(bucket..)?.first_chunk()?;
        let tags = &self.tags[start as usize..end as usize];
        let at = tags.binary_search_by_key(&tag, |(tag, _)| *tag).ok()?;
        Some(tags[at].1)
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
            ("in clumps", |i| (i / 100) << 50 | i % 100),
            ("one far away", |i| if i == 5 { u64::MAX } else { i }),
            ("powers", |i| (1 << (i % 60)) + (i / 60) * 3),
            ("random", |i| (i + 1).wrapping_mul(GOLDEN)),
        ];
        for (sort, tag) in sorts {
            let tags: Vec<u64> = (0..600).map(tag).collect();
            let sparse = Sparse::new(&tags).unwrap_or_else(|e| panic!("{sort}: {e}"));
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
        assert_eq!(Sparse::new(&tags), Err(MshError::SameNode { node: 0 }));
    }
}
