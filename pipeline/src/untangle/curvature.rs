//! The exact curvature of penalised quantities, and what is kept of a Hessian that is not positive.
//!
//! Jacobian coefficients and the products of arcs are differences of products: their Hessians do not depend on the map, and
//! are indefinite. With them Newton's method is of second order near a minimum. Elsewhere the Hessian of a triangle may
//! be indefinite: then its positive part is taken, the nearest positive semidefinite matrix in the Frobenius norm (as in
//! Teran and co-workers 2005, doi 10.1145/1073368.1073394), so that every step descends. To leave the concave
//! part of the coefficients out in any case costs ten times as many steps: at a constrained minimum it balances half of the energy's
//! own curvature.

use super::objective::SCALARS;
use crate::fem::jacobian::{AT_CORNERS, PAIRS};
use std::sync::LazyLock;

/// A symmetric matrix over the scalar unknowns of a triangle, of which only the lower triangle counts.
pub(super) type LocalHessian = [[f64; SCALARS]; SCALARS];

/// Per coefficient the second derivatives by u of one node and v of another. Those by two u, or two v, are zero.
static OF_COEFFICIENTS: LazyLock<[[[f64; 6]; 6]; 6]> = LazyLock::new(|| {
    PAIRS.map(|(i, j)| {
        let mut mixed = [[0.0; 6]; 6];
        for (n, row) in mixed.iter_mut().enumerate() {
            for (m, entry) in row.iter_mut().enumerate() {
                // The coefficient is half the sum of a_p x b_q over both orders of its corners.
                for (p, q) in [(i, j), (j, i)] {
                    let [[in_a_n, _], [in_a_m, _]] = [AT_CORNERS[p][n], AT_CORNERS[p][m]];
                    let [[_, in_b_n], [_, in_b_m]] = [AT_CORNERS[q][n], AT_CORNERS[q][m]];
                    *entry += 0.5 * (in_a_n * in_b_m - in_b_n * in_a_m);
                }
            }
        }
        mixed
    })
});

/// Adds the curvature of penalties with the slopes `-multipliers` in the six coefficients.
pub(super) fn add_curvature(hessian: &mut LocalHessian, multipliers: &[f64; 6]) {
    let mut mixed = [[0.0; 6]; 6];
    for (of_coefficient, multiplier) in OF_COEFFICIENTS.iter().zip(multipliers) {
        for (sum, row) in mixed.iter_mut().zip(of_coefficient) {
            for (sum, entry) in sum.iter_mut().zip(row) {
                *sum -= multiplier * entry;
            }
        }
    }
    add_mixed(hessian, &mixed);
}

/// Adds second derivatives by u of one node and v of another.
pub(super) fn add_mixed<const N: usize>(hessian: &mut LocalHessian, mixed: &[[f64; N]; N]) {
    for n in 0..N {
        for m in 0..N {
            let (u, v) = (2 * n, 2 * m + 1);
            hessian[u.max(v)][u.min(v)] += mixed[n][m];
        }
    }
}

/// Takes the positive part of a Hessian that is invariant under translation; it stays as it is where it has no other.
pub(super) fn keep_positive(hessian: &mut LocalHessian) {
    if is_positive(hessian) {
        return;
    }
    let (values, vectors) = eigen(hessian);
    *hessian = [[0.0; SCALARS]; SCALARS];
    for (k, value) in values.iter().enumerate().filter(|(_, value)| **value > 0.0) {
        for i in 0..SCALARS {
            let scaled = value * vectors[i][k];
            (0..=i).for_each(|j| hessian[i][j] += scaled * vectors[j][k]);
        }
    }
}

/// What rounding may take from a pivot, as a share of the diagonal: triangles without a height have energies that know no more
/// digits.
const ROUNDING: f64 = 1e-10;

/// Whether a matrix is positive or singular, up to translations and rounding: by Cholesky's factor over all nodes but the first,
/// which translations do not leave in place.
fn is_positive(hessian: &LocalHessian) -> bool {
    const LESS: usize = SCALARS - 2;
    let mut factor = [[0.0; LESS]; LESS];
    for i in 0..LESS {
        let diagonal = hessian[i + 2][i + 2];
        for j in 0..i {
            let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let (pivot, rest) = (factor[j][j], hessian[i + 2][j + 2] - known);
            if pivot > 0.0 {
                factor[i][j] = rest / pivot;
            } else if rest * rest > ROUNDING * (diagonal * hessian[j + 2][j + 2]).abs() {
                return false;
            }
        }
        let rest = diagonal - (0..i).map(|k| factor[i][k] * factor[i][k]).sum::<f64>();
        if rest < -ROUNDING * diagonal.abs() {
            return false;
        }
        factor[i][i] = if rest > ROUNDING * diagonal { rest.sqrt() } else { 0.0 };
    }
    true
}

/// Eigenvalues and, in the columns of the matrix, eigenvectors of a symmetric matrix: by Householder's reduction and implicit
/// QL steps (Golub and Van Loan 2013, *Matrix Computations*, sections 8.3.1 and 8.3.3).
fn eigen(hessian: &LocalHessian) -> ([f64; SCALARS], LocalHessian) {
    let (mut diagonal, mut below, mut vectors) = tridiagonal(hessian);
    for l in 0..SCALARS {
        for _ in 0..STEPS {
            let is_split = |m: &usize| {
                *m + 1 == SCALARS || below[*m].abs() <= f64::EPSILON * (diagonal[*m].abs() + diagonal[*m + 1].abs())
            };
            let m = (l..SCALARS).find(is_split).unwrap_or(SCALARS - 1);
            if m == l {
                break;
            }
            implicit_step(&mut diagonal, &mut below, &mut vectors, l, m);
        }
    }
    (diagonal, vectors)
}

/// QL steps for an eigenvalue at most: they converge cubically, and two are usual.
const STEPS: usize = 30;

/// A tridiagonal matrix, its diagonal and what is below that, with the same eigenvalues, and the rotation to it, in columns.
fn tridiagonal(hessian: &LocalHessian) -> ([f64; SCALARS], [f64; SCALARS], LocalHessian) {
    let mut a = *hessian;
    for i in 0..SCALARS {
        for j in 0..i {
            a[j][i] = a[i][j];
        }
    }
    let mut q = [[0.0; SCALARS]; SCALARS];
    (0..SCALARS).for_each(|i| q[i][i] = 1.0);
    for k in 0..SCALARS - 2 {
        let mut v = [0.0; SCALARS];
        (k + 1..SCALARS).for_each(|i| v[i] = a[i][k]);
        let norm = v.iter().map(|x| x * x).sum::<f64>().sqrt();
        if norm == 0.0 {
            continue;
        }
        v[k + 1] += norm.copysign(v[k + 1]);
        let square: f64 = v.iter().map(|x| x * x).sum();
        // a <- (1 - 2 v v^T / v.v) a (1 - 2 v v^T / v.v), and q after it.
        let mut w = [0.0; SCALARS];
        for i in 0..SCALARS {
            w[i] = 2.0 / square * (k + 1..SCALARS).map(|j| a[i][j] * v[j]).sum::<f64>();
        }
        let along = (0..SCALARS).map(|i| v[i] * w[i]).sum::<f64>() / square;
        for i in 0..SCALARS {
            w[i] -= along * v[i];
        }
        for i in 0..SCALARS {
            for j in 0..SCALARS {
                a[i][j] -= v[i] * w[j] + w[i] * v[j];
            }
        }
        for row in &mut q {
            let along = 2.0 / square * (k + 1..SCALARS).map(|j| row[j] * v[j]).sum::<f64>();
            (k + 1..SCALARS).for_each(|j| row[j] -= along * v[j]);
        }
    }
    let below = std::array::from_fn(|i| if i + 1 < SCALARS { a[i + 1][i] } else { 0.0 });
    (std::array::from_fn(|i| a[i][i]), below, q)
}

/// One implicit QL step with Wilkinson's shift on rows `l` to `m`.
fn implicit_step(
    diagonal: &mut [f64; SCALARS],
    below: &mut [f64; SCALARS],
    vectors: &mut LocalHessian,
    l: usize,
    m: usize,
) {
    let half = (diagonal[l + 1] - diagonal[l]) / (2.0 * below[l]);
    let mut g = diagonal[m] - diagonal[l] + below[l] / (half + half.hypot(1.0).copysign(half));
    let (mut sine, mut cosine, mut shift) = (1.0, 1.0, 0.0);
    for i in (l..m).rev() {
        let (f, b) = (sine * below[i], cosine * below[i]);
        let r = f.hypot(g);
        below[i + 1] = r;
        if r == 0.0 {
            // The matrix falls apart here.
            diagonal[i + 1] -= shift;
            below[m] = 0.0;
            return;
        }
        (sine, cosine) = (f / r, g / r);
        g = diagonal[i + 1] - shift;
        let turned = (diagonal[i] - g) * sine + 2.0 * cosine * b;
        shift = sine * turned;
        diagonal[i + 1] = g + shift;
        g = cosine * turned - b;
        for row in vectors.iter_mut() {
            let (x, y) = (row[i], row[i + 1]);
            (row[i + 1], row[i]) = (sine * x + cosine * y, cosine * x - sine * y);
        }
    }
    diagonal[l] -= shift;
    below[l] = g;
    below[m] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::jacobian::CornerDerivatives;
    use crate::fem::jacobian::samples::{X, Y};

    fn form(h: &LocalHessian, d: &[f64]) -> f64 {
        let entry = |i: usize, j: usize| h[i.max(j)][i.min(j)];
        (0..SCALARS).map(|i| (0..SCALARS).map(|j| d[i] * entry(i, j) * d[j]).sum::<f64>()).sum()
    }

    #[test]
    fn the_curvature_of_coefficients_is_exact() {
        for k in 0..6 {
            let mut multipliers = [0.0; 6];
            multipliers[k] = 1.0;
            let mut h = [[0.0; SCALARS]; SCALARS];
            add_curvature(&mut h, &multipliers);
            for direction in [&X, &Y] {
                let curvature = -2.0 * CornerDerivatives::new(direction).dets()[k];
                assert!((form(&h, direction.as_flattened()) - curvature).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn the_positive_part_is_positive_and_no_more_than_what_it_must_be() {
        let mut h = [[0.0; SCALARS]; SCALARS];
        add_curvature(&mut h, &[1.0, 0.3, 0.2, 2.0, 0.1, 0.7]);
        let before = h;
        keep_positive(&mut h);
        let (values, vectors) = eigen(&before);
        assert!(values.iter().any(|v| *v < -0.1) && values.iter().any(|v| *v > 0.1));
        for (k, value) in values.iter().enumerate() {
            let vector = vectors.map(|row| row[k]);
            assert!((form(&before, &vector) - value).abs() < 1e-12, "{value}");
            assert!((form(&h, &vector) - value.max(0.0)).abs() < 1e-12, "{value}");
        }
        // What is positive stays, to the last digit.
        let mut twice = [[0.0; SCALARS]; SCALARS];
        (0..SCALARS).for_each(|i| twice[i][i] = 2.0);
        let kept = twice;
        keep_positive(&mut twice);
        assert_eq!(twice, kept);
    }
}
