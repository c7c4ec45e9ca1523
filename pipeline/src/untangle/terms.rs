//! The constrained quantities, their gradients, and the part of their curvature that is kept.

use super::objective::SCALARS;
use crate::fem::jacobian::{AT_CORNERS, PAIRS, cross};
use crate::mesh::TriangleShape;

/// A complex-linear form in the six nodal values w = u + i v, sum over n of (re_n + i im_n) w_n.
#[derive(Clone, Copy)]
struct ComplexForm {
    re: [f64; 6],
    im: [f64; 6],
}

impl ComplexForm {
    /// `self` + `sign` `other`.
    fn plus(&self, sign: f64, other: &Self) -> Self {
        let combine = |a: &[f64; 6], b: &[f64; 6]| std::array::from_fn(|n| a[n] + sign * b[n]);
        Self { re: combine(&self.re, &other.re), im: combine(&self.im, &other.im) }
    }

    /// Adds `weight` times the square of its absolute value, as a matrix over (u0, v0, u1, ...). Only the lower
    /// triangle counts.
    fn add_square(&self, weight: f64, hessian: &mut [[f64; SCALARS]; SCALARS]) {
        let (r, s) = (&self.re, &self.im);
        for m in 0..6 {
            for n in 0..=m {
                let re = weight * (r[m] * r[n] + s[m] * s[n]);
                let im = weight * (r[m] * s[n] - s[m] * r[n]);
                hessian[2 * m][2 * n] += re;
                hessian[2 * m + 1][2 * n + 1] += re;
                hessian[2 * m][2 * n + 1] -= im;
                hessian[2 * m + 1][2 * n] += im;
            }
        }
    }
}

/// Adds the curvature of penalties with the slopes `-multipliers` in the six coefficients.
///
/// In an orthonormal frame of the triangle in space, each coefficient is a difference of squares: with the
/// complex derivatives P (along z) and N (along the conjugate of z) at the corners, M_ii = |P_i|^2 - |N_i|^2
/// and M_ij = Re(P_i conj P_j) - Re(N_i conj N_j). A falling penalty curves upwards along the negative
/// squares and downwards along the positive ones; the former are kept, exactly, the latter dropped. So the
/// matrix stays positive, whatever the rounding, and no eigenvalues are needed.
pub(super) fn add_curvature(hessian: &mut [[f64; SCALARS]; SCALARS], shape: &TriangleShape, multipliers: &[f64; 6]) {
    let Wirtinger { z: p, conj_z: n } = Wirtinger::at_corners(shape);
    for (k, (i, j)) in PAIRS.into_iter().enumerate() {
        if i == j {
            n[i].add_square(2.0 * multipliers[k], hessian);
        } else {
            // Re(P_i conj P_j) = |P_i + P_j|^2 / 4 - |P_i - P_j|^2 / 4, and so for N.
            p[i].plus(-1.0, &p[j]).add_square(0.5 * multipliers[k], hessian);
            n[i].plus(1.0, &n[j]).add_square(0.5 * multipliers[k], hessian);
        }
    }
}

/// The complex derivatives of a map at the corners of a triangle, times sqrt(2 area): df/dz and df/d conj z.
struct Wirtinger {
    z: [ComplexForm; 3],
    conj_z: [ComplexForm; 3],
}

impl Wirtinger {
    fn at_corners(shape: &TriangleShape) -> Self {
        let [_, [length, _], [x, y]] = shape.in_plane();
        let half = 0.5 * (length * y).sqrt();
        // The gradients of the basis in the plane of the triangle.
        let gradients = |corner: usize| -> [[f64; 2]; 6] {
            AT_CORNERS[corner].map(|[xi, eta]| {
                let first = xi / length;
                [half * first, half * (eta - x * first) / y]
            })
        };
        let form = |corner: usize, sign: f64| {
            let g = gradients(corner);
            ComplexForm { re: g.map(|g| g[0]), im: g.map(|g| sign * g[1]) }
        };
        Self { z: [0, 1, 2].map(|k| form(k, -1.0)), conj_z: [0, 1, 2].map(|k| form(k, 1.0)) }
    }
}

/// The three products of an arc of a hole's loop about a centre, with the sign that makes them positive on a
/// star-shaped loop: nodes are first end, middle, second end, centre.
pub(super) type ArcNodes = [[f64; 2]; 4];

/// The pairs of (p0, c, p1) behind the three products.
const ARC_PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// p0, c and p1 relative to the centre, as combinations of the four nodes.
const ARC_POINTS: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, -1.0], [-0.5, 2.0, -0.5, -1.0], [0.0, 0.0, 1.0, -1.0]];

fn arc_points(x: &ArcNodes) -> [[f64; 2]; 3] {
    let d = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    ARC_POINTS.map(|c| [0, 1].map(|k| (0..4).map(|n| c[n] * d[n][k]).sum()))
}

/// The products, positive where the loop is star-shaped (traversed with the chart on its left).
pub(super) fn arc_products(x: &ArcNodes) -> [f64; 3] {
    let p = arc_points(x);
    ARC_PAIRS.map(|(i, j)| -cross(p[i], p[j]))
}

/// What is linear in t in the products of `x + t y`.
pub(super) fn arc_polarization(x: &ArcNodes, y: &ArcNodes) -> [f64; 3] {
    let (p, q) = (arc_points(x), arc_points(y));
    ARC_PAIRS.map(|(i, j)| -cross(p[i], q[j]) - cross(q[i], p[j]))
}

/// The gradient of product `k` with respect to the eight nodal values.
pub(super) fn arc_gradient(x: &ArcNodes, k: usize) -> [f64; 8] {
    let p = arc_points(x);
    let (i, j) = ARC_PAIRS[k];
    let mut g = [0.0; 8];
    for n in 0..4 {
        let (ga, gb) = (ARC_POINTS[i][n], ARC_POINTS[j][n]);
        g[2 * n] = -(ga * p[j][1] - gb * p[i][1]);
        g[2 * n + 1] = -(gb * p[i][0] - ga * p[j][0]);
    }
    g
}

/// The least t > 0 at which c0 + c1 t + c2 t^2 falls to zero, where c0 > 0; infinity where it never does.
pub(super) fn first_zero(c0: f64, c1: f64, c2: f64) -> f64 {
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    if c2 > 0.0 && (c1 >= 0.0 || discriminant < 0.0) {
        return f64::INFINITY;
    }
    // The form of the root that does not cancel where c1 < 0.
    let root = discriminant.max(0.0).sqrt();
    let t = if c1 <= 0.0 { 2.0 * c0 / (root - c1) } else { -(c1 + root) / (2.0 * c2) };
    if t > 0.0 { t } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::jacobian::samples::{X, Y, moved};
    use crate::fem::jacobian::{CornerDerivatives, P2Nodes};

    #[test]
    fn arcs_along_a_line_are_quadratic() {
        let arc_uv = |s: &P2Nodes| -> ArcNodes { [s[0], s[3], s[1], s[5]] };
        let (x, y) = (arc_uv(&X), arc_uv(&Y));
        for k in 0..3 {
            let quadratic = arc_products(&x)[k] + 0.7 * arc_polarization(&x, &y)[k] + 0.49 * arc_products(&y)[k];
            assert!((arc_products(&arc_uv(&moved(0.7)))[k] - quadratic).abs() < 1e-14);
            let slope: f64 = (0..8).map(|i| arc_gradient(&x, k)[i] * y[i / 2][i % 2]).sum();
            assert!((slope - arc_polarization(&x, &y)[k]).abs() < 1e-14);
        }
    }

    #[test]
    fn the_kept_curvature_is_positive_and_above_the_true_one() {
        // -d^2/dt^2 of each coefficient along a direction is at most the kept form: what is dropped is negative.
        let shape = TriangleShape { lengths: [1.0, 0.7, 0.9] };
        for k in 0..6 {
            let mut multipliers = [0.0; 6];
            multipliers[k] = 1.0;
            let mut h = [[0.0; SCALARS]; SCALARS];
            add_curvature(&mut h, &shape, &multipliers);
            let entry = |i: usize, j: usize| h[i.max(j)][i.min(j)];
            for (direction, sign) in [(&X, 1.0), (&Y, -1.0)] {
                let d: Vec<f64> = direction.iter().flatten().map(|c| c * sign).collect();
                let kept: f64 = (0..12).map(|i| (0..12).map(|j| d[i] * entry(i, j) * d[j]).sum::<f64>()).sum();
                let curvature = -2.0 * CornerDerivatives::new(direction).dets()[k];
                assert!(kept >= 0.0 && kept >= curvature - 1e-12, "{k}: {kept} {curvature}");
            }
        }
    }

    #[test]
    fn zeros_are_found_on_both_branches() {
        assert_eq!(first_zero(1.0, -1.0, 0.0), 1.0);
        assert_eq!(first_zero(2.0, -3.0, 1.0), 1.0);
        assert_eq!(first_zero(2.0, 1.0, -1.0), 2.0);
        assert_eq!(first_zero(1.0, -1.0, 1.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 1.0, 1.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 1.0, 0.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 0.0, -4.0), 0.5);
    }
}
