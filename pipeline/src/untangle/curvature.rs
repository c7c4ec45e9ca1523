//! The part of the curvature of penalised coefficients that is kept in the Hessian.

use super::objective::SCALARS;
use crate::fem::jacobian::{AT_CORNERS, PAIRS};
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
        // Half of sqrt(2 area): df/dz is half of df/dx - i df/dy.
        let half = 0.5 * (length * y).sqrt();
        // The gradients of the basis in the plane of the triangle.
        let gradients = |corner: usize| -> [[f64; 2]; 6] {
            AT_CORNERS[corner].map(|[xi, eta]| {
                let first = xi / length;
                [half * first, half * (eta - x * first) / y]
            })
        };
        let at_corners = [0, 1, 2].map(gradients);
        Self { z: at_corners.map(|g| form(g, -1.0)), conj_z: at_corners.map(|g| form(g, 1.0)) }
    }
}

/// The form whose coefficients are the first components, and `sign` times i times the second ones.
fn form(gradients: [[f64; 2]; 6], sign: f64) -> ComplexForm {
    ComplexForm { re: gradients.map(|g| g[0]), im: gradients.map(|g| sign * g[1]) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::jacobian::CornerDerivatives;
    use crate::fem::jacobian::samples::{X, Y};

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
}
