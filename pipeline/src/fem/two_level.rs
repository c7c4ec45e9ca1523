//! Conjugate gradients for systems of quadratic elements that are too large to be factorised cheaply, preconditioned on two
//! levels: by symmetric Gauss-Seidel on the quadratic elements, and by an exact solution on the linear ones of the same
//! triangulation (p-multigrid; Ronquist and Patera 1987, *Spectral element multigrid I*, doi 10.1007/BF01061297).
//!
//! Linear functions on a triangle are quadratic ones, whose values in the middles of sides are the means of those at their
//! ends. So the system of the linear elements is the Galerkin product of that of the quadratic ones, triangle by triangle, and
//! its factor a tenth as large. How many steps it takes does not depend on the number of triangles, only on their shape.

use super::dofs::Dofs;
use super::sparse::{Error, Factor, PRESCRIBED, Pattern};
use crate::monitor::Checkpoint;

/// Steps at most. Good triangulations take 10 to 20, slivers 40 to 100.
const STEPS: usize = 120;

/// After so many steps no more than this share of the squared error may be left: else a factor is sooner there, as of st_helens_dem,
/// which would take 94 steps. (srtm_white_mountains_sw takes 12, and has 1e-9 by then.)
const LOOK: usize = 6;
const LEFT: f64 = 1e-5;

/// The error that is left, in the norm of the energy, relative to that of the solution: as small as the grid of certified maps is
/// fine is of no use to anyone, and a tenth less is another step.
const TOLERANCE: f64 = 1e-11;

/// Two values at every unknown.
type Field = Vec<[f64; 2]>;

/// A system of quadratic elements for two fields.
pub(crate) struct TwoLevel<'a> {
    pub pattern: &'a Pattern,
    /// The entries of the matrix, in the places of the pattern.
    pub matrix: &'a [f64],
    /// The factorised system of the linear elements.
    pub coarse: &'a Factor<'a>,
    pub prolongation: &'a Prolongation,
    /// Whether it goes on however slow it is: the system is too large to be factorised.
    pub last_resort: bool,
}

/// Quadratic functions from linear ones.
pub(crate) struct Prolongation {
    /// Per unknown of the quadratic elements two of the linear ones, of which it is the mean; at vertices the same twice.
    /// [`PRESCRIBED`] for those that are held at zero.
    of: Vec<[u32; 2]>,
    coarse: usize,
}

impl Prolongation {
    /// From the linear elements with the unknowns `coarse` to the quadratic ones with the unknowns `fine`; both number the same
    /// nodes.
    pub fn new(fine: &Dofs, coarse: &Dofs, elements: impl Iterator<Item = [usize; 6]>) -> Self {
        let mut of = vec![[PRESCRIBED; 2]; fine.count()];
        for nodes in elements {
            let corners = [nodes[0], nodes[1], nodes[2]].map(|n| coarse.element(&[n])[0]);
            for k in 0..3 {
                if let Some(vertex) = fine.unknown(nodes[k]) {
                    of[vertex] = [corners[k]; 2];
                }
                if let Some(middle) = fine.unknown(nodes[3 + k]) {
                    of[middle] = [corners[k], corners[(k + 1) % 3]];
                }
            }
        }
        Self { of, coarse: coarse.count() }
    }

    /// The matrix of linear elements on a triangle, from that of quadratic ones.
    pub fn galerkin(matrix: &[[f64; 6]; 6]) -> [[f64; 3]; 3] {
        // Per corner, its share of each node.
        let shares = [[1.0, 0.0, 0.0, 0.5, 0.0, 0.5], [0.0, 1.0, 0.0, 0.5, 0.5, 0.0], [0.0, 0.0, 1.0, 0.0, 0.5, 0.5]];
        let product = |i: usize, j: usize| -> f64 {
            let row = |n: usize| (0..6).map(|m| matrix[n][m] * shares[j][m]).sum::<f64>();
            (0..6).map(|n| shares[i][n] * row(n)).sum()
        };
        std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)))
    }

    /// What is left at the unknowns of the quadratic elements, weighed by linear functions; one column for each field.
    fn restrict(&self, fine: &Field) -> Vec<f64> {
        let mut coarse = vec![0.0; 2 * self.coarse];
        for (value, of) in fine.iter().zip(&self.of) {
            for unknown in of.iter().filter(|u| **u != PRESCRIBED) {
                (0..2).for_each(|k| coarse[k * self.coarse + *unknown as usize] += 0.5 * value[k]);
            }
        }
        coarse
    }

    /// The linear functions with these values.
    fn prolong(&self, coarse: &[f64], fine: &mut Field) {
        let at = |unknown: u32, k: usize| match unknown {
            PRESCRIBED => 0.0,
            unknown => coarse[k * self.coarse + unknown as usize],
        };
        for (value, [a, b]) in fine.iter_mut().zip(&self.of) {
            *value = [0, 1].map(|k| 0.5 * (at(*a, k) + at(*b, k)));
        }
    }
}

impl TwoLevel<'_> {
    /// The solution for right-hand sides with one column for each field; none where it does not come to rest.
    ///
    /// # Errors
    /// Interrupted.
    pub fn solve(&self, rhs: &[f64], checkpoint: &Checkpoint) -> Result<Option<Vec<f64>>, Error> {
        let unknowns = rhs.len() / 2;
        let mut residual: Field = (0..unknowns).map(|i| [rhs[i], rhs[unknowns + i]]).collect();
        let mut x: Field = vec![[0.0; 2]; unknowns];
        let mut scratch = Scratch::new(unknowns);
        let mut z = vec![[0.0; 2]; unknowns];
        self.precondition(&residual, &mut z, &mut scratch);
        let mut along = z.clone();
        let mut image = vec![[0.0; 2]; unknowns];
        let first = product(&residual, &z);
        let mut rest = first;
        for number in 0..STEPS {
            checkpoint.after(unknowns)?;
            if number == LOOK && !self.last_resort && (0..2).any(|k| rest[k] > LEFT * first[k]) {
                break;
            }
            let is_at_rest = |k: usize| rest[k] <= TOLERANCE * TOLERANCE * first[k];
            if is_at_rest(0) && is_at_rest(1) {
                let solution = (0..2).flat_map(|k| x.iter().map(move |value| value[k]));
                return Ok(Some(solution.collect()));
            }
            self.apply(&along, &mut image);
            let curvature = product(&along, &image);
            // A field that is at rest, or was nothing from the beginning, stays.
            let step = [0, 1].map(|k| if is_at_rest(k) { 0.0 } else { rest[k] / curvature[k] });
            for i in 0..unknowns {
                for k in 0..2 {
                    x[i][k] += step[k] * along[i][k];
                    residual[i][k] -= step[k] * image[i][k];
                }
            }
            self.precondition(&residual, &mut z, &mut scratch);
            let next = product(&residual, &z);
            let kept = [0, 1].map(|k| if is_at_rest(k) { 0.0 } else { next[k] / rest[k] });
            for (along, z) in along.iter_mut().zip(&z) {
                (0..2).for_each(|k| along[k] = z[k] + kept[k] * along[k]);
            }
            rest = [0, 1].map(|k| if is_at_rest(k) { rest[k] } else { next[k] });
            if !rest.iter().all(|r| r.is_finite()) {
                break;
            }
        }
        Ok(None)
    }

    /// One cycle on two levels, from nothing: forwards, on the linear elements, backwards. It is symmetric.
    fn precondition(&self, residual: &Field, z: &mut Field, scratch: &mut Scratch) {
        let Scratch { left, correction } = scratch;
        let unknowns = residual.len();
        left.copy_from_slice(residual);
        for j in 0..unknowns {
            let (diagonal, below) = self.column(j);
            z[j] = left[j].map(|r| r / diagonal);
            for (i, a) in below {
                (0..2).for_each(|k| left[i][k] -= a * z[j][k]);
            }
        }
        // What is left are the products with the entries above the diagonal.
        for j in 0..unknowns {
            let (_, below) = self.column(j);
            let mut sum = [0.0; 2];
            for (i, a) in below {
                (0..2).for_each(|k| sum[k] -= a * z[i][k]);
            }
            left[j] = sum;
        }
        let mut coarse = self.prolongation.restrict(left);
        self.coarse.solve(&mut coarse, 2);
        self.prolongation.prolong(&coarse, correction);
        for j in 0..unknowns {
            let (diagonal, below) = self.column(j);
            let c = correction[j];
            let mut sum = c.map(|c| diagonal * c);
            for (i, a) in below {
                for k in 0..2 {
                    sum[k] += a * correction[i][k];
                    left[i][k] -= a * c[k];
                }
            }
            for k in 0..2 {
                left[j][k] -= sum[k];
                z[j][k] += c[k];
            }
        }
        // From the last unknown back; `left` holds the correction behind the one at hand.
        for j in (0..unknowns).rev() {
            let (diagonal, below) = self.column(j);
            let mut sum = left[j];
            for (i, a) in below {
                (0..2).for_each(|k| sum[k] -= a * left[i][k]);
            }
            left[j] = sum.map(|s| s / diagonal);
            (0..2).for_each(|k| z[j][k] += left[j][k]);
        }
    }

    /// The product of the matrix and two fields.
    fn apply(&self, x: &Field, image: &mut Field) {
        image.fill([0.0; 2]);
        for j in 0..x.len() {
            let (diagonal, below) = self.column(j);
            let mut sum = x[j].map(|x| diagonal * x);
            for (i, a) in below {
                for k in 0..2 {
                    sum[k] += a * x[i][k];
                    image[i][k] += a * x[j][k];
                }
            }
            (0..2).for_each(|k| image[j][k] += sum[k]);
        }
    }

    /// An entry of the diagonal, and those below it, with their rows.
    fn column(&self, j: usize) -> (f64, impl Iterator<Item = (usize, f64)>) {
        let (rows, places) = self.pattern.column(j);
        let entries = &self.matrix[places];
        (entries[0], rows[1..].iter().zip(&entries[1..]).map(|(i, a)| (*i as usize, *a)))
    }
}

/// Room for a cycle.
struct Scratch {
    left: Field,
    correction: Field,
}

impl Scratch {
    fn new(unknowns: usize) -> Self {
        Self { left: vec![[0.0; 2]; unknowns], correction: vec![[0.0; 2]; unknowns] }
    }
}

/// The scalar products of two pairs of fields.
fn product(a: &Field, b: &Field) -> [f64; 2] {
    a.iter().zip(b).fold([0.0; 2], |sum, (a, b)| [sum[0] + a[0] * b[0], sum[1] + a[1] * b[1]])
}
