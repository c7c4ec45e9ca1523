//! Sparse linear systems. The only file that names `faer`.
//!
//! Symmetric positive definite systems are assembled from small dense element matrices into the lower triangle
//! (compressed columns) and solved by a supernodal Cholesky factorisation (one thread, as faer's threaded solve costs
//! several times the work). Unknowns are eliminated in an order of minimum degree (AMD: Amestoy, Davis and Duff 1996,
//! doi 10.1137/S0895479894278952), or as they are numbered. General systems are solved by LU.

use crate::monitor::{Interrupted, Monitor, Reserved};
use crate::topology::csr::Csr;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::PermRef;
use faer::prelude::Solve;
use faer::reborrow::Reborrow;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::linalg::solvers::{Lu, SymbolicLu};
use faer::sparse::{SparseColMat, SparseColMatRef, SymbolicSparseColMatRef, Triplet};
use faer::{Conj, MatMut, Par, Side};

/// Stands for a degree of freedom that is prescribed: its row and column are not part of the system.
pub const PRESCRIBED: u32 = u32::MAX;

/// Factors larger than this (bytes) are not made. A fixed number, so that results do not depend on the machine.
const MAX_FACTOR_BYTES: usize = 8 << 30;

/// Factors with no more entries are made in about a millisecond, and take half a megabyte: they are no safe points, and nothing is
/// reserved for them, as they come by the thousand.
const MAX_SMALL_ENTRIES: usize = 50_000;

/// So many times the bytes of a general matrix (12 per entry) are reserved to solve it, as the size of its factors is
/// not known before. Surfaces of 20 000 to 400 000 triangles took 15 to 42 times as much, the more the larger.
const GROWTH: usize = 40;

/// Why a system cannot be solved.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unsolvable {
    /// The matrix is not positive definite, or not invertible, in double precision.
    #[error("the system of {unknowns} unknowns is singular in double precision")]
    Singular {
        /// The order of the matrix.
        unknowns: usize,
    },
    /// The factor is larger than 8 GiB, or does not fit memory or 32-bit indices.
    #[error("the system of {unknowns} unknowns is too large to be factorised")]
    TooLarge {
        /// The order of the matrix.
        unknowns: usize,
    },
}

/// Why a system was not solved.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// It cannot be.
    #[error(transparent)]
    Unsolvable(#[from] Unsolvable),
    /// The solution was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// The pattern of a symmetric matrix that is the sum of dense element matrices, and where each entry of each
/// element goes.
///
/// Made once, analysed once, factorised for every matrix, solved for every right-hand side.
///
/// # Example
///
/// A chain of two springs that hangs from the ceiling, pulled at its lower end, and then in the middle.
///
/// ```
/// use planish_core::fem::sparse::{PRESCRIBED, Pattern, Unsolvable};
/// use planish_core::monitor::NoMonitor;
///
/// let spring = [[1.0, -1.0], [-1.0, 1.0]];
/// let pattern = Pattern::new(2, &[[PRESCRIBED, 0], [0, 1]]);
/// let mut matrix = pattern.zeros();
/// pattern.add(&mut matrix, 0, &spring);
/// pattern.add(&mut matrix, 1, &spring);
/// let analysis = pattern.analyse()?;
/// let factor = analysis.factorise(&matrix, &NoMonitor)?;
/// // Two right-hand sides, one after another, and the displacements in their place.
/// let mut forces = [0.0, 1.0, 1.0, 0.0];
/// factor.solve(&mut forces, 2);
/// assert!(forces.iter().zip([1.0, 2.0, 1.0, 1.0]).all(|(got, want)| (got - want).abs() < 1e-14));
///
/// // Without the upper spring nothing holds the chain.
/// let mut loose = pattern.zeros();
/// pattern.add(&mut loose, 1, &spring);
/// let refused = analysis.factorise(&loose, &NoMonitor).err();
/// assert_eq!(refused, Some(Unsolvable::Singular { unknowns: 2 }.into()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Pattern {
    unknowns: usize,
    /// Compressed columns of the lower triangle: where each column begins in `rows`, and where the last one ends.
    starts: Vec<u32>,
    /// The row of each entry, ascending in each column; the diagonal comes first.
    rows: Vec<u32>,
    /// Per element its lower triangle row by row: which entry of the matrix each of its own goes to, or [`PRESCRIBED`].
    slots: Vec<u32>,
}

impl Pattern {
    /// The pattern for elements that join the given unknowns ([`PRESCRIBED`] ones are left out).
    pub fn new<const N: usize>(unknowns: usize, elements: &[[u32; N]]) -> Self {
        let all = || elements.iter().flat_map(entries);
        let of_columns = || all().zip(0_u32..).filter(|(e, _)| e.0 != PRESCRIBED);
        let mut columns = Csr::sorted(unknowns, || of_columns().map(|((row, column), i)| (column, (row, i))));
        let slots = vec![PRESCRIBED; elements.len() * N * (N + 1) / 2];
        let mut pattern = Self { unknowns, starts: vec![0], rows: Vec::new(), slots };
        for j in 0..unknowns {
            let column = columns.row_mut(j);
            column.sort_unstable();
            // Entries of several elements in one place are one entry of the matrix.
            for run in column.chunk_by(|a, b| a.0 == b.0) {
                let slot = pattern.rows.len() as u32;
                for (_, i) in run {
                    pattern.slots[*i as usize] = slot;
                }
                pattern.rows.push(run[0].0);
            }
            pattern.starts.push(pattern.rows.len() as u32);
        }
        pattern
    }

    /// A matrix of zeros.
    pub fn zeros(&self) -> Vec<f64> {
        vec![0.0; self.rows.len()]
    }

    /// Adds the dense symmetric matrix of element `element` to `values`.
    pub fn add<const N: usize>(&self, values: &mut [f64], element: usize, matrix: &[[f64; N]; N]) {
        let per_element = N * (N + 1) / 2;
        let slots = &self.slots[element * per_element..(element + 1) * per_element];
        let lower = (0..N).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for (slot, (i, j)) in slots.iter().zip(lower) {
            if *slot != PRESCRIBED {
                values[*slot as usize] += matrix[i][j];
            }
        }
    }

    /// The rows of the entries of a column of the lower triangle, that of the diagonal first, and their places.
    pub(crate) fn column(&self, j: usize) -> (&[u32], std::ops::Range<usize>) {
        let places = self.starts[j] as usize..self.starts[j + 1] as usize;
        (&self.rows[places.clone()], places)
    }

    /// The places of the diagonal entries among the values of a matrix: the first of each column.
    pub fn diagonal(&self) -> impl Iterator<Item = usize> {
        self.starts[..self.unknowns].iter().map(|s| *s as usize)
    }

    /// Analyses the matrix for elimination in an order of minimum degree; the result serves every matrix of this
    /// pattern.
    ///
    /// # Errors
    /// [`Unsolvable::TooLarge`].
    pub fn analyse(&self) -> Result<Analysis<'_>, Unsolvable> {
        self.analyse_in(SymmetricOrdering::Amd)
    }

    /// As [`Self::analyse`], for unknowns that are numbered in the order in which to eliminate them.
    ///
    /// # Errors
    /// [`Unsolvable::TooLarge`].
    pub fn analyse_as_numbered(&self) -> Result<Analysis<'_>, Unsolvable> {
        // Not `SymmetricOrdering::Identity`, which takes the triangle below the diagonal for the one above it.
        let identity: Vec<u32> = (0..self.unknowns as u32).collect();
        self.analyse_in(SymmetricOrdering::Custom(PermRef::new_checked(&identity, &identity, self.unknowns)))
    }

    fn analyse_in(&self, order: SymmetricOrdering<u32>) -> Result<Analysis<'_>, Unsolvable> {
        let too_large = Unsolvable::TooLarge { unknowns: self.unknowns };
        // It fails where memory is short, or where the factor has more entries than 32 bits count.
        let symbolic = factorize_symbolic_cholesky(self.view(), Side::Lower, order, Default::default());
        let Ok(symbolic) = symbolic else { return Err(too_large) };
        if symbolic.len_val() > MAX_FACTOR_BYTES / size_of::<f64>() {
            return Err(too_large);
        }
        Ok(Analysis { pattern: self, symbolic })
    }

    /// The unknowns in an order of minimum degree; as they are numbered, where memory is short.
    pub fn minimum_degree(&self) -> Vec<u32> {
        let as_numbered = || -> Vec<u32> { (0..self.unknowns as u32).collect() };
        // The order, and its inverse: per unknown, when its turn is.
        let mut order = as_numbered();
        let mut places = as_numbered();
        let scratch = amd::order_maybe_unsorted_scratch::<u32>(self.unknowns, self.rows.len());
        let Ok(mut memory) = MemBuffer::try_new(scratch) else { return order };
        let stack = MemStack::new(&mut memory);
        let ordered = amd::order_maybe_unsorted(&mut order, &mut places, self.view(), Default::default(), stack);
        if ordered.is_ok() { order } else { as_numbered() }
    }

    fn view(&self) -> SymbolicSparseColMatRef<'_, u32> {
        SymbolicSparseColMatRef::new_checked(self.unknowns, self.unknowns, &self.starts, None, &self.rows)
    }
}

/// The entries (row, column), row >= column, of an element in the lower triangle; `PRESCRIBED` where there is none.
fn entries<const N: usize>(unknowns: &[u32; N]) -> impl Iterator<Item = (u32, u32)> {
    let lower = (0..N).flat_map(|i| (0..=i).map(move |j| (i, j)));
    lower.map(|(i, j)| {
        let (a, b) = (unknowns[i], unknowns[j]);
        if a == PRESCRIBED || b == PRESCRIBED { (PRESCRIBED, PRESCRIBED) } else { (a.max(b), a.min(b)) }
    })
}

/// An ordered and analysed pattern.
pub struct Analysis<'a> {
    pattern: &'a Pattern,
    symbolic: SymbolicCholesky<u32>,
}

impl Analysis<'_> {
    /// What was analysed.
    pub fn pattern(&self) -> &Pattern {
        self.pattern
    }

    /// How many numbers a factor holds.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.len_val()
    }

    /// Factorises the matrix with these `values`. Unless it is small it is a safe point, and the memory of the factor and of
    /// making it is reserved until the factor is dropped.
    ///
    /// # Errors
    /// [`Unsolvable::Singular`] when a pivot is not positive, [`Unsolvable::TooLarge`] when memory is short; or
    /// [`Interrupted`].
    pub fn factorise<'a>(&'a self, values: &[f64], monitor: &'a dyn Monitor) -> Result<Factor<'a>, Error> {
        let is_small = self.factor_entries() <= MAX_SMALL_ENTRIES;
        if !is_small && !monitor.should_continue() {
            return Err(Interrupted.into());
        }
        let unknowns = self.pattern.unknowns;
        let too_large = Unsolvable::TooLarge { unknowns };
        let scratch = self.symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let bytes = size_of::<f64>() * self.factor_entries() + scratch.unaligned_bytes_required();
        // Before what it stands for, and so dropped after that.
        let reserved = (!is_small).then(|| Reserved::new(monitor, bytes as u64));
        let mut factor = Vec::new();
        factor.try_reserve_exact(self.symbolic.len_val()).map_err(|_| too_large.clone())?;
        factor.resize(self.symbolic.len_val(), 0.0);
        let mut memory = MemBuffer::try_new(scratch).map_err(|_| too_large)?;
        let matrix = SparseColMatRef::new(self.pattern.view(), values);
        let stack = MemStack::new(&mut memory);
        let side = Side::Lower;
        self.symbolic
            .factorize_numeric_llt(&mut factor, matrix, side, Default::default(), Par::Seq, stack, Default::default())
            .map_err(|_| Unsolvable::Singular { unknowns })?;
        Ok(Factor { symbolic: &self.symbolic, values: factor, _reserved: reserved })
    }
}

/// A Cholesky factor.
pub struct Factor<'a> {
    symbolic: &'a SymbolicCholesky<u32>,
    values: Vec<f64>,
    /// Given back after the values: fields are dropped in this order.
    _reserved: Option<Reserved<'a>>,
}

impl Factor<'_> {
    /// Solves for `columns` right-hand sides, one after another in `rhs`, in place.
    pub fn solve(&self, rhs: &mut [f64], columns: usize) {
        let scratch = self.symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq);
        let mut memory = MemBuffer::new(scratch);
        let rows = self.symbolic.nrows();
        let rhs = MatMut::from_column_major_slice_mut(rhs, rows, columns);
        let factor = LltRef::<u32, f64>::new(self.symbolic, &self.values);
        factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut memory));
    }
}

/// Solves a general square system, given by its entries (row, column, value; equal places add up), for `columns`
/// right-hand sides in place. An estimate of the memory that it takes is reserved.
///
/// # Errors
/// [`Error`]. A safe point.
///
/// # Example
///
/// ```
/// use planish_core::fem::sparse::solve_general;
/// use planish_core::monitor::NoMonitor;
///
/// // 2 x + y = 5 and -x + 3 y = 8.
/// let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, -1.0), (1, 1, 3.0)];
/// let mut rhs = [5.0, 8.0];
/// solve_general(2, &entries, &mut rhs, 1, &NoMonitor)?;
/// assert!((rhs[0] - 1.0).abs() < 1e-14 && (rhs[1] - 3.0).abs() < 1e-14);
/// # Ok::<(), planish_core::fem::sparse::Error>(())
/// ```
pub fn solve_general(
    unknowns: usize,
    entries: &[(u32, u32, f64)],
    rhs: &mut [f64],
    columns: usize,
    monitor: &dyn Monitor,
) -> Result<(), Error> {
    if !monitor.should_continue() {
        return Err(Interrupted.into());
    }
    let bytes = GROWTH * entries.len() * (size_of::<u32>() + size_of::<f64>());
    let _reserved = Reserved::new(monitor, bytes as u64);
    let (singular, too_large) = (Unsolvable::Singular { unknowns }, Unsolvable::TooLarge { unknowns });
    let triplets: Vec<_> = entries.iter().map(|(r, c, v)| Triplet::new(*r, *c, *v)).collect();
    let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(unknowns, unknowns, &triplets);
    let Ok(matrix) = matrix else { return Err(too_large.into()) };
    let Ok(symbolic) = SymbolicLu::try_new(matrix.symbolic()) else { return Err(too_large.into()) };
    let Ok(factor) = Lu::try_new_with_symbolic(symbolic, matrix.rb()) else { return Err(singular.into()) };
    factor.solve_in_place(MatMut::from_column_major_slice_mut(rhs, unknowns, columns));
    // What was divided by a pivot of zero is not finite.
    if rhs.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(singular.into()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::NoMonitor;

    /// A chain of springs between unknowns 0..n, the first one fastened.
    fn chain(n: u32) -> (Vec<[u32; 2]>, [[f64; 2]; 2]) {
        let elements = (0..n).map(|i| [if i == 0 { PRESCRIBED } else { i - 1 }, i]).collect();
        (elements, [[1.0, -1.0], [-1.0, 1.0]])
    }

    #[test]
    fn a_chain_of_springs_stretches_linearly() {
        let (elements, matrix) = chain(50);
        let pattern = Pattern::new(50, &elements);
        let mut values = pattern.zeros();
        (0..elements.len()).for_each(|e| pattern.add(&mut values, e, &matrix));
        let analysis = pattern.analyse().expect("small");
        let factor = analysis.factorise(&values, &NoMonitor).expect("positive definite");
        let mut pull = vec![0.0; 100];
        pull[49] = 1.0;
        pull[99] = 2.0;
        factor.solve(&mut pull, 2);
        for i in 0..50 {
            let stretched = (i + 1) as f64;
            assert!((pull[i] - stretched).abs() < 1e-12 && (pull[50 + i] - 2.0 * stretched).abs() < 1e-12);
        }
    }

    #[test]
    fn a_loose_chain_is_singular() {
        let pattern = Pattern::new(2, &[[0, 1]]);
        let mut values = pattern.zeros();
        pattern.add(&mut values, 0, &[[1.0, -1.0], [-1.0, 1.0]]);
        let analysis = pattern.analyse().expect("small");
        assert_eq!(analysis.factorise(&values, &NoMonitor).err(), Some(Unsolvable::Singular { unknowns: 2 }.into()));
    }

    #[test]
    fn a_general_system_is_solved() {
        let entries = [(0, 0, 2.0), (0, 1, 1.0), (1, 0, -1.0), (1, 1, 3.0)];
        let mut rhs = [5.0, 8.0];
        solve_general(2, &entries, &mut rhs, 1, &NoMonitor).expect("regular");
        assert!((rhs[0] - 1.0).abs() < 1e-14 && (rhs[1] - 3.0).abs() < 1e-14);
        let singular = [(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0)];
        assert!(solve_general(2, &singular, &mut [1.0, 2.0], 1, &NoMonitor).is_err());
    }
}
