//! The linear element: three nodes, the vertices.

use super::{Barycentric, Element};
use crate::mesh::TriangleShape;

/// The linear triangle with 3 nodes.
///
/// # Example
///
/// The entry of an edge is minus half the cotangent of the angle opposite: none for a right one.
///
/// ```
/// use planish_core::fem::element::{Element, P1};
/// use planish_core::mesh::TriangleShape;
///
/// // The right angle is at node 0, opposite the edge from node 1 to node 2.
/// let shape = TriangleShape::of([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
/// let k = P1::stiffness(&shape);
/// assert!(k[1][2].abs() < 1e-15 && (k[0][1] + 0.5).abs() < 1e-15);
/// // Constants have no energy: rows sum to zero.
/// assert!(k.iter().all(|row| row.iter().sum::<f64>().abs() < 1e-15));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct P1;

impl Element<3> for P1 {
    const ORDER: u32 = 1;

    const NODES: [Barycentric; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn basis(l: Barycentric) -> [f64; 3] {
        l
    }

    fn gradients(_l: Barycentric) -> [[f64; 2]; 3] {
        [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]
    }

    /// The cotangent matrix (Pinkall and Polthier 1993, doi 10.1080/10586458.1993.10504266).
    fn stiffness(shape: &TriangleShape) -> [[f64; 3]; 3] {
        let c = shape.half_cotangents();
        [[c[0] + c[2], -c[0], -c[2]], [-c[0], c[0] + c[1], -c[1]], [-c[2], -c[1], c[1] + c[2]]]
    }
}
