//! The quadratic element: six nodes, the vertices and the middles of the edges 01, 12, 20.

use super::{Barycentric, Element};
use crate::mesh::TriangleShape;

/// Points of the plane at the six nodes.
pub type P2Nodes = [[f64; 2]; 6];

/// The quadratic triangle with 6 nodes.
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
            let others = 3 + (e + 1) % 3;
            let entries = [(i, j, c[e] / 3.0), (i, mid, -4.0 / 3.0 * c[e]), (j, mid, -4.0 / 3.0 * c[e])];
            // Edges e and e + 1 meet at vertex j; the edge between their other ends is e + 2.
            for (a, b, value) in entries.into_iter().chain([(mid, others, -8.0 / 3.0 * c[(e + 2) % 3])]) {
                k[a][b] = value;
                k[b][a] = value;
            }
        }
        k
    }
}
