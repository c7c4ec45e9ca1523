//! Disjoint sets with path halving (Tarjan and van Leeuwen 1984, doi 10.1145/62.2160).

/// A partition of `0..n`; the representative of a set is always its least member, so results do not depend on
/// the order of the unions.
#[derive(Clone, Debug)]
pub struct UnionFind {
    parent: Vec<u32>,
}

impl UnionFind {
    /// `n` sets of one element each.
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n).map(|i| i as u32).collect() }
    }

    /// The least member of the set of `i`. Ends because every step moves to a strictly smaller element.
    pub fn find(&mut self, i: usize) -> usize {
        let mut i = i;
        while self.parent[i] as usize != i {
            self.parent[i] = self.parent[self.parent[i] as usize];
            i = self.parent[i] as usize;
        }
        i
    }

    /// Unites the sets of `a` and `b`; whether they were apart.
    pub fn merge(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.find(a), self.find(b));
        let (low, high) = (a.min(b), a.max(b));
        // If both are in one set already, low is high, and nothing changes.
        self.parent[high] = low as u32;
        a != b
    }

    /// Numbers the sets 0, 1, ... in the order of their least members; returns the label of each element and
    /// the number of sets.
    pub fn labels(&mut self) -> (Vec<u32>, usize) {
        let mut labels = vec![0; self.parent.len()];
        let mut sets = 0;
        for i in 0..labels.len() {
            let root = self.find(i);
            labels[i] = if root == i {
                sets += 1;
                sets - 1
            } else {
                labels[root]
            };
        }
        (labels, sets as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_follow_least_members() {
        let mut sets = UnionFind::new(6);
        assert!(sets.merge(5, 1));
        assert!(sets.merge(4, 5));
        assert!(!sets.merge(1, 4));
        assert_eq!(sets.labels(), (vec![0, 1, 2, 3, 1, 1], 4));
    }
}
