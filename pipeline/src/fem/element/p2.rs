//! The quadratic element: six nodes, the vertices and the middles of the edges 01, 12, 20.

use super::{Barycentric, Element};
use crate::mesh::TriangleShape;

/// Points of the plane at the six nodes.
pub type P2Nodes = [[f64; 2]; 6];

/// The quadratic triangle with 6 nodes.
///
/// # Example
///
/// Basis functions of vertices are negative in the middle. So the values of a quadratic function are no means of its
/// nodal values, and harmonic maps by this element may leave the disk, and fold.
///
/// ```
/// use planish_core::fem::element::{Element, P2};
///
/// let [at_vertex, .., at_edge] = P2::basis([1.0 / 3.0; 3]);
/// assert!((at_vertex + 1.0 / 9.0).abs() < 1e-15 && (at_edge - 4.0 / 9.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct P2;

impl Element<6> for P2 {
    const ORDER: u32 = 2;

    const NODES: [Barycentric; 6] =
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];

    fn basis(l: Barycentric) -> [f64; 6] {
        let vertex = l.map(|v| v * (2.0 * v - 1.0));
        [vertex[0], vertex[1], vertex[2], 4.0 * l[0] * l[1], 4.0 * l[1] * l[2], 4.0 * l[2] * l[0]]
    }

    fn gradients(l: Barycentric) -> [[f64; 2]; 6] {
        let first = 1.0 - 4.0 * l[0];
        [
            [first, first],
            [4.0 * l[1] - 1.0, 0.0],
            [0.0, 4.0 * l[2] - 1.0],
            [4.0 * (l[0] - l[1]), -4.0 * l[1]],
            [4.0 * l[2], 4.0 * l[1]],
            [-4.0 * l[2], 4.0 * (l[0] - l[2])],
        ]
    }

    /// With c_k half the cotangent of the angle opposite edge k, the entries are sums of c_k with constant factors
    /// (integrate the products of the gradients exactly).
    fn stiffness(shape: &TriangleShape) -> [[f64; 6]; 6] {
        let c = shape.half_cotangents();
        let total = c[0] + c[1] + c[2];
        let mut k = [[0.0; 6]; 6];
        for e in 0..3 {
            // Edge e joins vertices e and e + 1; its mid node is 3 + e.
            let (i, j, mid) = (e, (e + 1) % 3, 3 + e);
            // Vertex i lies on edges e and e + 2.
            k[i][i] = c[e] + c[(e + 2) % 3];
            k[mid][mid] = 8.0 / 3.0 * total;
            // Edges e and e + 1 meet at vertex j; the edge between their other ends is e + 2.
            let next_mid = 3 + (e + 1) % 3;
            set_both(&mut k, i, j, c[e] / 3.0);
            set_both(&mut k, i, mid, -4.0 / 3.0 * c[e]);
            set_both(&mut k, j, mid, -4.0 / 3.0 * c[e]);
            set_both(&mut k, mid, next_mid, -8.0 / 3.0 * c[(e + 2) % 3]);
        }
        k
    }
}

/// Sets an entry of a symmetric matrix, and its mirror image.
fn set_both(k: &mut [[f64; 6]; 6], row: usize, column: usize, value: f64) {
    k[row][column] = value;
    k[column][row] = value;
}
