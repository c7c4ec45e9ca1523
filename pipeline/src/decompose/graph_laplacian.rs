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
    /// How many unknowns are in a good order; those behind them were added.
    ordered: usize,
    diagonal: Vec<f64>,
    off_diagonal: Vec<(u32, u32, f64)>,
    rhs: Vec<[f64; 2]>,
}

impl GraphLaplacian {
    /// So many unknowns in a good order, and so many that are added to them: nodes that close holes.
    pub(super) fn new(ordered: usize, added: usize) -> Self {
        let unknowns = ordered + added;
        let (diagonal, rhs) = (vec![0.0; unknowns], vec![[0.0; 2]; unknowns]);
        Self { ordered, diagonal, off_diagonal: Vec::new(), rhs }
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
    pub(super) fn solve(mut self) -> Option<Vec<[f64; 2]>> {
        if self.ordered == self.diagonal.len() {
            return self.solve_as_numbered();
        }
        let places = self.places();
        self.renumber(&places);
        let solution = self.solve_as_numbered()?;
        Some(places.into_iter().map(|place| solution[place as usize]).collect())
    }

    /// Eliminates the unknowns in the order of their numbers.
    fn solve_as_numbered(self) -> Option<Vec<[f64; 2]>> {
        let by_row = || self.off_diagonal.iter().map(|(i, j, value)| (*i, (*j, *value)));
        let rows = Csr::sorted(self.diagonal.len(), by_row);
        let mut factor = Factor::shaped(&rows);
        let is_definite = factor.fill(&rows, &self.diagonal);
        is_definite.then(|| factor.solve(self.rhs))
    }

    /// Per unknown its place in the order of elimination: each that was added comes right after the last of those that it is joined
    /// with. So it fills in no more than a separator would; all of them last, a plate with n holes took n^3.
    fn places(&self) -> Vec<u32> {
        let count = self.diagonal.len();
        // Per added unknown, the last of its neighbours that were not.
        let mut last = vec![0; count - self.ordered];
        for (i, j, _) in &self.off_diagonal {
            let (i, j) = (*i as usize, *j);
            if i >= self.ordered && (j as usize) < self.ordered {
                last[i - self.ordered] = last[i - self.ordered].max(j);
            }
        }
        let ordered = (0..self.ordered as u32).map(|i| (i, 0));
        let added = last.into_iter().zip(1_u32..);
        let mut keyed: Vec<((u32, u32), u32)> = ordered.chain(added).zip(0..).collect();
        keyed.sort_unstable();
        let mut places = vec![0; count];
        keyed.iter().zip(0..).for_each(|((_, unknown), place)| places[*unknown as usize] = place);
        places
    }

    /// Numbers the unknowns by their places.
    fn renumber(&mut self, places: &[u32]) {
        let (mut diagonal, mut rhs) = (self.diagonal.clone(), self.rhs.clone());
        for (unknown, place) in places.iter().enumerate() {
            (diagonal[*place as usize], rhs[*place as usize]) = (self.diagonal[unknown], self.rhs[unknown]);
        }
        (self.diagonal, self.rhs) = (diagonal, rhs);
        for (i, j, _) in &mut self.off_diagonal {
            let [a, b] = [*i, *j].map(|unknown| places[unknown as usize]);
            (*i, *j) = (a.max(b), a.min(b));
        }
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
        let mut chain = GraphLaplacian::new(50, 0);
        chain.add_dirichlet(0, 1.0, [0.0, 7.0]);
        chain.add_dirichlet(49, 1.0, [51.0, 7.0]);
        // A star order fills in: every second unknown first.
        let place = |i: u32| if i.is_multiple_of(2) { i / 2 } else { 25 + i / 2 };
        let mut shuffled = GraphLaplacian::new(50, 0);
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
        let mut loose = GraphLaplacian::new(2, 0);
        loose.add_edge([0, 1], 1.0);
        assert!(loose.solve().is_none());
    }

    /// A ring of rings, each closed by a node: what is added fills in hardly, and the solution is the same in any order.
    #[test]
    fn nodes_that_close_holes_fill_in_hardly() {
        let (holes, around) = (200, 8);
        let cells = holes * around;
        let made = |added: u32| {
            let mut laplacian = GraphLaplacian::new((cells + holes - added) as usize, added as usize);
            laplacian.add_dirichlet(0, 1.0, [1.0, -2.0]);
            for i in 0..cells {
                laplacian.add_edge([i, (i + 1) % cells], 1.0);
                laplacian.add_edge([i, cells + i / around], 0.5);
                laplacian.add_load(i, [f64::from(i % 7), 1.0]);
            }
            laplacian
        };
        let entries = |laplacian: &GraphLaplacian| {
            let mut copy = made((laplacian.diagonal.len() - laplacian.ordered) as u32);
            copy.renumber(&laplacian.places());
            let rows = Csr::sorted(copy.diagonal.len(), || copy.off_diagonal.iter().map(|(i, j, v)| (*i, (*j, *v))));
            let factor = Factor::shaped(&rows);
            (0..rows.len()).map(|i| factor.columns.row(i).len()).sum::<usize>()
        };
        let (last, placed) = (made(0), made(holes));
        // A few for each cell; all holes last, the square of their number.
        assert!(entries(&placed) < 10 * cells as usize, "{}", entries(&placed));
        assert!(entries(&last) > entries(&placed), "the twin fills in more");
        let (rest, again) = (last.solve().expect("held"), placed.solve().expect("held"));
        for (a, b) in rest.iter().zip(&again) {
            assert!((0..2).all(|k| (a[k] - b[k]).abs() <= 1e-9 * a[k].abs().max(1.0)), "{a:?} {b:?}");
        }
    }
}
