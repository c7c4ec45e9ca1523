//! The arcs of holes: what keeps a loop star-shaped about its centre, and its derivatives.

use crate::fem::jacobian::cross;

/// The three products of an arc of a hole's loop about a centre, with the sign that makes them positive on a
/// star-shaped loop: nodes are first end, middle, second end, centre.
pub(super) type ArcNodes = [[f64; 2]; 4];

/// The pairs of (p0, c, p1) behind the three products.
const PAIRS: [(usize, usize); 3] = [(0, 1), (0, 2), (1, 2)];

/// p0, c and p1 relative to the centre, as combinations of the four nodes.
const POINTS: [[f64; 4]; 3] = [[1.0, 0.0, 0.0, -1.0], [-0.5, 2.0, -0.5, -1.0], [0.0, 0.0, 1.0, -1.0]];

/// The Bezier points p0, c, p1 of the arc relative to its centre.
fn points(x: &ArcNodes) -> [[f64; 2]; 3] {
    // Differences to the first node, so that small holes lose no digits: the weights of each point sum to zero.
    let from_first = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    POINTS.map(|weights| combination(&weights, &from_first))
}

fn combination(weights: &[f64; 4], x: &ArcNodes) -> [f64; 2] {
    [0, 1].map(|component| (0..4).map(|n| weights[n] * x[n][component]).sum())
}

/// The products, positive where the loop is star-shaped (traversed with the chart on its left).
pub(super) fn products(x: &ArcNodes) -> [f64; 3] {
    let p = points(x);
    PAIRS.map(|(i, j)| -cross(p[i], p[j]))
}

/// What is linear in t in the products of `x + t y`.
pub(super) fn polarization(x: &ArcNodes, y: &ArcNodes) -> [f64; 3] {
    let (p, q) = (points(x), points(y));
    PAIRS.map(|(i, j)| -cross(p[i], q[j]) - cross(q[i], p[j]))
}

/// The gradient of product `k` with respect to the eight nodal values.
pub(super) fn gradient(x: &ArcNodes, k: usize) -> [f64; 8] {
    let p = points(x);
    let (i, j) = PAIRS[k];
    let mut g = [0.0; 8];
    for n in 0..4 {
        // Node n moves point i by the first of these, and point j by the second.
        let in_first = POINTS[i][n];
        let in_second = POINTS[j][n];
        g[2 * n] = -(in_first * p[j][1] - in_second * p[i][1]);
        g[2 * n + 1] = -(in_second * p[i][0] - in_first * p[j][0]);
    }
    g
}

/// The second derivatives of the products, each times its weight, by u of one node and v of another. Those by two u, or
/// two v, are zero.
pub(super) fn mixed(weights: &[f64; 3]) -> [[f64; 4]; 4] {
    let mut mixed = [[0.0; 4]; 4];
    for ((i, j), weight) in PAIRS.into_iter().zip(weights) {
        for (n, row) in mixed.iter_mut().enumerate() {
            for (m, entry) in row.iter_mut().enumerate() {
                *entry -= weight * (POINTS[i][n] * POINTS[j][m] - POINTS[j][n] * POINTS[i][m]);
            }
        }
    }
    mixed
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::P2Nodes;
    use crate::fem::jacobian::samples::{X, Y, moved};

    #[test]
    fn arcs_along_a_line_are_quadratic() {
        let arc_uv = |s: &P2Nodes| -> ArcNodes { [s[0], s[3], s[1], s[5]] };
        let (x, y) = (arc_uv(&X), arc_uv(&Y));
        for k in 0..3 {
            let quadratic = products(&x)[k] + 0.7 * polarization(&x, &y)[k] + 0.49 * products(&y)[k];
            assert!((products(&arc_uv(&moved(0.7)))[k] - quadratic).abs() < 1e-14);
            let slope: f64 = (0..8).map(|i| gradient(&x, k)[i] * y[i / 2][i % 2]).sum();
            assert!((slope - polarization(&x, &y)[k]).abs() < 1e-14);
            // Half of the second derivative along y is what is quadratic.
            let of_k = mixed(&std::array::from_fn(|l| f64::from(u8::from(l == k))));
            let second: f64 = (0..16).map(|i| y[i / 4][0] * of_k[i / 4][i % 4] * y[i % 4][1]).sum();
            assert!((second - products(&y)[k]).abs() < 1e-14);
        }
    }
}
