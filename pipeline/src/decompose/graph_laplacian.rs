//! Small symmetric positive definite systems whose unknowns come in a good order already.
//!
//! Row by row, each along its paths in the elimination tree (Davis 2005, doi 10.1145/1114268.1114277). The systems of
//! the search have a few hundred unknowns, come by the hundred, and are parts of one graph, so that one order serves
//! them all: ordering and analysing each anew would cost several times its factorisation.

use crate::topology::csr::Csr;

const NONE: u32 = u32::MAX;

/// The strict lower triangle of a matrix by rows: columns and values, of which those in one place add up.
type LowerRows = Csr<(u32, f64)>;

/// The Laplacian of a weighted graph, put together from edges between unknowns, and between an unknown and a node of which
/// the uv are given.
pub(super) struct GraphLaplacian {
    diagonal: Vec<f64>,
    off_diagonal: Vec<(u32, u32, f64)>,
    rhs: Vec<[f64; 2]>,
}

impl GraphLaplacian {
    pub(super) fn new(unknowns: usize) -> Self {
        Self { diagonal: vec![0.0; unknowns], off_diagonal: Vec::new(), rhs: vec![[0.0; 2]; unknowns] }
    }

    /// Adds an edge between two different unknowns.
    pub(super) fn add_edge(&mut self, [i, j]: [u32; 2], weight: f64) {
        self.diagonal[i as usize] += weight;
        self.diagonal[j as usize] += weight;
        self.off_diagonal.push((i.max(j), i.min(j), -weight));
    }

    /// Adds an edge between an unknown and a node with these uv.
    pub(super) fn add_dirichlet(&mut self, i: u32, weight: f64, uv: [f64; 2]) {
        self.diagonal[i as usize] += weight;
        (0..2).for_each(|k| self.rhs[i as usize][k] += weight * uv[k]);
    }

    /// Adds a load to one of the two right-hand sides.
    pub(super) fn add_load(&mut self, i: u32, load: [f64; 2]) {
        (0..2).for_each(|k| self.rhs[i as usize][k] += load[k]);
    }

    /// The uv of the unknowns for which the sum of all weights times squared lengths is least; none where the matrix is not
    /// positive definite in doubles.
    pub(super) fn solve(self) -> Option<Vec<[f64; 2]>> {
        let by_row = || self.off_diagonal.iter().map(|(i, j, value)| (*i, (*j, *value)));
        let rows = Csr::sorted(self.diagonal.len(), by_row);
        let mut factor = Factor::shaped(&rows);
        let is_definite = factor.fill(&rows, &self.diagonal);
        is_definite.then(|| factor.solve(self.rhs))
    }
}

/// The factor L of a matrix L D L^T, by columns, and the diagonal D.
struct Factor {
    /// The elimination tree.
    parents: Vec<u32>,
    /// Per column, row and value of each entry; the columns are filled row by row.
    columns: Csr<(u32, f64)>,
    diagonal: Vec<f64>,
}

impl Factor {
    /// The tree, and room for every column.
    fn shaped(rows: &LowerRows) -> Self {
        let n = rows.len();
        let (mut parents, mut flags, mut lengths) = (vec![NONE; n], vec![NONE; n], vec![0_u32; n]);
        for k in 0..n {
            flags[k] = k as u32;
            for (i, _) in rows.row(k) {
                let mut i = *i as usize;
                // Parents come after their children, and k is flagged: the climb ends there at the latest.
                while flags[i] != k as u32 {
                    flags[i] = k as u32;
                    lengths[i] += 1;
                    if parents[i] == NONE {
                        parents[i] = k as u32;
                    }
                    i = parents[i] as usize;
                }
            }
        }
        Self { parents, columns: Csr::of_lengths(&lengths), diagonal: Vec::with_capacity(n) }
    }

    /// The unknowns before `k` on which row `k` of the factor depends, each after those that it depends on itself.
    fn reach(&self, rows: &LowerRows, k: usize, flags: &mut [u32], reach: &mut Vec<u32>) {
        reach.clear();
        flags[k] = k as u32;
        for (i, _) in rows.row(k).iter().rev() {
            let from = reach.len();
            let mut i = *i;
            while flags[i as usize] != k as u32 {
                flags[i as usize] = k as u32;
                reach.push(i);
                i = self.parents[i as usize];
            }
            reach[from..].reverse();
        }
        reach.reverse();
    }

    /// Computes all rows; whether all pivots are positive: where one is not, the rows after it are not computed.
    fn fill(&mut self, rows: &LowerRows, diagonal: &[f64]) -> bool {
        let n = rows.len();
        let (mut flags, mut reach) = (vec![NONE; n], Vec::new());
        // Per column, how many of its entries are known.
        let mut known = vec![0; n];
        let mut work = vec![0.0; n];
        for k in 0..n {
            self.reach(rows, k, &mut flags, &mut reach);
            rows.row(k).iter().for_each(|(i, value)| work[*i as usize] += value);
            let mut pivot = diagonal[k];
            for i in reach.iter().map(|i| *i as usize) {
                let y = std::mem::take(&mut work[i]);
                let column = self.columns.row_mut(i);
                column[..known[i]].iter().for_each(|(j, l)| work[*j as usize] -= l * y);
                let l = y / self.diagonal[i];
                pivot -= l * y;
                column[known[i]] = (k as u32, l);
                known[i] += 1;
            }
            if pivot.is_nan() || pivot <= 0.0 {
                return false;
            }
            self.diagonal.push(pivot);
        }
        true
    }

    fn solve(&self, mut x: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
        // L y = x, column by column; then, from the last unknown back, D L^T x = y.
        for i in 0..x.len() {
            let y = x[i];
            self.columns.row(i).iter().for_each(|(j, l)| (0..2).for_each(|k| x[*j as usize][k] -= l * y[k]));
        }
        for i in (0..x.len()).rev() {
            let mut y = x[i].map(|y| y / self.diagonal[i]);
            self.columns.row(i).iter().for_each(|(j, l)| (0..2).for_each(|k| y[k] -= l * x[*j as usize][k]));
            x[i] = y;
        }
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chain_of_springs_stretches_linearly() {
        let mut chain = GraphLaplacian::new(50);
        chain.add_dirichlet(0, 1.0, [0.0, 7.0]);
        chain.add_dirichlet(49, 1.0, [51.0, 7.0]);
        // A star order fills in: every second unknown first.
        let place = |i: u32| if i.is_multiple_of(2) { i / 2 } else { 25 + i / 2 };
        let mut shuffled = GraphLaplacian::new(50);
        shuffled.add_dirichlet(place(0), 1.0, [0.0, 7.0]);
        shuffled.add_dirichlet(place(49), 1.0, [51.0, 7.0]);
        for i in 0..49 {
            chain.add_edge([i, i + 1], 1.0);
            shuffled.add_edge([place(i + 1), place(i)], 0.5);
            shuffled.add_edge([place(i), place(i + 1)], 0.5);
        }
        let (rest, again) = (chain.solve().expect("held"), shuffled.solve().expect("held"));
        for i in 0..50 {
            let wanted = [f64::from(i + 1), 7.0];
            for found in [rest[i as usize], again[place(i) as usize]] {
                assert!((0..2).all(|k| (found[k] - wanted[k]).abs() < 1e-11), "{i}: {found:?}");
            }
        }
    }

    #[test]
    fn what_nothing_holds_does_not_come_to_rest() {
        let mut loose = GraphLaplacian::new(2);
        loose.add_edge([0, 1], 1.0);
        assert!(loose.solve().is_none());
    }
}
