//! The jacobian determinant of a 6-node triangle in doubles: its Bernstein coefficients and their derivatives. What is
//! decided is decided by [`crate::fem::bernstein`], exactly; this serves optimisation and figures.

use crate::fem::element::{Element, P2, P2Nodes};
use std::sync::LazyLock;

/// The derivatives of the basis along xi and eta at the three corners.
pub(crate) static AT_CORNERS: LazyLock<[[[f64; 2]; 6]; 3]> =
    LazyLock::new(|| [0, 1, 2].map(|k| P2::gradients(P2::NODES[k])));

/// The pairs of corners behind the six Bernstein coefficients M_00, M_11, M_22, M_01, M_12, M_20.
pub(crate) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)];

/// The determinant of two vectors of the plane.
pub(crate) fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The derivatives of a map at the three corners: along xi (a) and eta (b).
pub(crate) struct CornerDerivatives {
    a: [[f64; 2]; 3],
    b: [[f64; 2]; 3],
}

impl CornerDerivatives {
    /// Of nodal values `x`, taken relative to the first so that small triangles lose no digits.
    pub fn new(x: &P2Nodes) -> Self {
        let from_first = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
        Self {
            a: [0, 1, 2].map(|corner| derivative(&from_first, corner, 0)),
            b: [0, 1, 2].map(|corner| derivative(&from_first, corner, 1)),
        }
    }

    /// The six Bernstein coefficients of the jacobian determinant.
    pub fn dets(&self) -> [f64; 6] {
        PAIRS.map(|(i, j)| 0.5 * (cross(self.a[i], self.b[j]) + cross(self.a[j], self.b[i])))
    }

    /// What is linear in t in the coefficients of `self + t other`.
    pub fn polarization(&self, other: &Self) -> [f64; 6] {
        let mut linear = [0.0; 6];
        for (k, (i, j)) in PAIRS.into_iter().enumerate() {
            // The product rule, on the two products that make a coefficient (see `dets`).
            let first = cross(self.a[i], other.b[j]) + cross(other.a[i], self.b[j]);
            let second = [cross(self.a[j], other.b[i]), cross(other.a[j], self.b[i])];
            linear[k] = 0.5 * (first + second[0] + second[1]);
        }
        linear
    }

    /// The gradient of coefficient `k` with respect to the twelve nodal values (u0, v0, u1, ...).
    pub fn gradient(&self, k: usize) -> [f64; 12] {
        let (i, j) = PAIRS[k];
        let mut g = [0.0; 12];
        for n in 0..6 {
            // The derivatives of a_p x b_q / 2: node n moves a_p by its first weight and b_q by its second.
            for (p, q) in [(i, j), (j, i)] {
                let in_a = 0.5 * AT_CORNERS[p][n][0];
                let in_b = 0.5 * AT_CORNERS[q][n][1];
                g[2 * n] += in_a * self.b[q][1] - in_b * self.a[p][1];
                g[2 * n + 1] += in_b * self.a[p][0] - in_a * self.b[q][0];
            }
        }
        g
    }
}

/// The derivative at a corner along xi (`direction` 0) or eta (1) of nodal values of which the first is zero.
fn derivative(x: &P2Nodes, corner: usize, direction: usize) -> [f64; 2] {
    let weights = &AT_CORNERS[corner];
    [0, 1].map(|component| (1..6).map(|n| weights[n][direction] * x[n][component]).sum())
}

/// A curved triangle, a direction, and the triangle moved along it.
#[cfg(test)]
pub(crate) mod samples {
    use crate::fem::element::P2Nodes;

    pub(crate) const X: P2Nodes = [[0.0, 0.1], [1.0, 0.0], [0.2, 0.9], [0.5, -0.1], [0.7, 0.5], [0.1, 0.6]];
    pub(crate) const Y: P2Nodes = [[0.3, 0.0], [-0.2, 0.1], [0.0, 0.4], [0.1, 0.2], [-0.3, 0.1], [0.2, -0.5]];

    pub(crate) fn moved(t: f64) -> P2Nodes {
        std::array::from_fn(|n| [X[n][0] + t * Y[n][0], X[n][1] + t * Y[n][1]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use samples::{X, Y, moved};

    #[test]
    fn coefficients_are_those_of_the_exact_ones() {
        use crate::grid::GridPoint;
        let vertex = |n: usize| if n < 3 { GridPoint::vertex(X[n]) } else { GridPoint::mid(X[n]) };
        let exact = crate::fem::bernstein::JacobianBezier::new(std::array::from_fn(vertex)).coefficients();
        for (a, b) in CornerDerivatives::new(&X).dets().into_iter().zip(exact) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
    }

    #[test]
    fn coefficients_along_a_line_are_quadratic() {
        let (x, y) = (CornerDerivatives::new(&X), CornerDerivatives::new(&Y));
        for k in 0..6 {
            let at = |t: f64| CornerDerivatives::new(&moved(t)).dets()[k];
            let quadratic = |t: f64| x.dets()[k] + t * x.polarization(&y)[k] + t * t * y.dets()[k];
            assert!((at(0.7) - quadratic(0.7)).abs() < 1e-14);
            let slope: f64 = (0..12).map(|i| x.gradient(k)[i] * Y[i / 2][i % 2]).sum();
            assert!((slope - x.polarization(&y)[k]).abs() < 1e-14);
        }
    }
}
