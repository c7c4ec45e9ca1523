//! The two sides of a shape, as seen from afar: where it faces the eye, and where it turns away.
//!
//! A branching tube falls into two long strips in this way, a plate with holes into its upper and its lower face: the
//! seams run from one opening to the next, or around the rim, and are as straight as the shape is; and neither half
//! is stretched, however long the tube. No merging of neighbours by their cost finds such halves reliably.

use super::complex::Complex;
use super::regions::Region;
use super::voronoi::Cells;
use crate::vec3::{Vec3, dot};

/// Three axes at right angles, the one along which normals are spread most first.
pub(super) type Axes = [Vec3; 3];

/// Sweeps of Jacobi rotations; they converge quadratically, and a 3x3 matrix needs no more than five.
const SWEEPS: usize = 8;

/// The principal axes of the normals of every component: the eigenvectors of the sum of a n n^T over its cells, by
/// Jacobi's rotations (Golub and Van Loan, Matrix Computations, 8.5).
pub(super) fn principal_axes(complex: &Complex, components: &Cells) -> Vec<Axes> {
    let mut spread = vec![[[0.0; 3]; 3]; components.len];
    for (cell, component) in complex.cells.iter().zip(&components.labels) {
        let spread = &mut spread[*component as usize];
        // Each factor n grows with the area of the cell: over the area, a cell counts by that once.
        let area = cell.area.max(f64::MIN_POSITIVE);
        for (i, j) in (0..9).map(|k| (k / 3, k % 3)) {
            spread[i][j] += cell.normal[i] * cell.normal[j] / area;
        }
    }
    spread.into_iter().map(eigenvectors).collect()
}

/// The eigenvectors of a symmetric matrix, that of the largest eigenvalue first.
fn eigenvectors(mut a: [Vec3; 3]) -> Axes {
    let mut vectors = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for (p, q) in [(0, 1), (0, 2), (1, 2)].repeat(SWEEPS) {
        // The rotation in the plane of the axes p and q by the angle that makes a[p][q] zero.
        let angle = 0.5 * f64::atan2(2.0 * a[p][q], a[q][q] - a[p][p]);
        let (sin, cos) = angle.sin_cos();
        let turn = |x: f64, y: f64| (cos * x - sin * y, sin * x + cos * y);
        for row in &mut a {
            (row[p], row[q]) = turn(row[p], row[q]);
        }
        for k in 0..3 {
            (a[p][k], a[q][k]) = turn(a[p][k], a[q][k]);
            (vectors[p][k], vectors[q][k]) = turn(vectors[p][k], vectors[q][k]);
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|i, j| a[*j][*j].total_cmp(&a[*i][*i]));
    order.map(|i| vectors[i])
}

/// Whether a region faces along this axis, rather than against it.
pub(super) fn faces_along(region: &Region, axis: Vec3) -> bool {
    dot(region.normal, axis) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_diagonalise() {
        // The last one has a double eigenvalue.
        let matrices = [
            [[2.0, -1.0, 0.5], [-1.0, 3.0, 0.25], [0.5, 0.25, 1.0]],
            [[1.0, 0.0, 0.0], [0.0, 5.0, 0.0], [0.0, 0.0, 3.0]],
            [[2.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 2.0]],
        ];
        for a in matrices {
            let v = eigenvectors(a);
            let form = |i: usize, j: usize| dot(v[i], [0, 1, 2].map(|k| dot(a[k], v[j])));
            for (i, j) in (0..9).map(|k| (k / 3, k % 3)).filter(|(i, j)| i != j) {
                assert!(form(i, j).abs() < 1e-14 && dot(v[i], v[j]).abs() < 1e-14, "{v:?}");
            }
            assert!(form(0, 0) >= form(1, 1) && form(1, 1) >= form(2, 2));
        }
    }
}
