//! The 6-node triangle: three vertices, then the middles of the edges 01, 12, 20 (the order of VTK and Gmsh).

use crate::mesh::TriangleShape;

/// Barycentric coordinates of the six nodes.
pub const NODES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]];

/// The six basis functions at barycentric coordinates `l`.
pub fn basis(l: [f64; 3]) -> [f64; 6] {
    let vertex = l.map(|v| v * (2.0 * v - 1.0));
    [vertex[0], vertex[1], vertex[2], 4.0 * l[0] * l[1], 4.0 * l[1] * l[2], 4.0 * l[2] * l[0]]
}

/// The derivatives of the six basis functions along xi = l1 and eta = l2 at barycentric coordinates `l`.
pub fn gradients(l: [f64; 3]) -> [[f64; 2]; 6] {
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

/// The stiffness matrix of the Laplacian on a flat triangle. With c_k half the cotangent of the angle opposite
/// edge k, its entries are sums of c_k with constant factors (integrate the products of the gradients exactly).
pub fn stiffness(shape: &TriangleShape) -> [[f64; 6]; 6] {
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

/// The Dirichlet energy 1/2 int |grad u|^2 + |grad v|^2 over a triangle with this stiffness matrix and these
/// nodal values. Works on differences to the first node, so that small triangles lose no digits.
pub fn energy(stiffness: &[[f64; 6]; 6], x: &[[f64; 2]; 6]) -> f64 {
    let d = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    let row = |i: usize| (0..6).map(|j| stiffness[i][j] * (d[i][0] * d[j][0] + d[i][1] * d[j][1])).sum::<f64>();
    0.5 * (1..6).map(row).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_basis_is_one_at_its_node_and_sums_to_one() {
        for (i, node) in NODES.iter().enumerate() {
            let values = basis(*node);
            assert!((0..6).all(|j| values[j] == f64::from(u8::from(i == j))));
        }
        let l = [0.2, 0.3, 0.5];
        assert!((basis(l).iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!((0..2).all(|d| gradients(l).iter().map(|g| g[d]).sum::<f64>().abs() < 1e-15));
    }

    #[test]
    fn gradients_are_the_derivatives_of_the_basis() {
        let (l, h) = ([0.2, 0.3, 0.5], 1e-6);
        let at = |dx: f64, dy: f64| basis([l[0] - dx - dy, l[1] + dx, l[2] + dy]);
        for (n, g) in gradients(l).iter().enumerate() {
            assert!((g[0] - (at(h, 0.0)[n] - at(-h, 0.0)[n]) / (2.0 * h)).abs() < 1e-9);
            assert!((g[1] - (at(0.0, h)[n] - at(0.0, -h)[n]) / (2.0 * h)).abs() < 1e-9);
        }
    }

    /// The stiffness by quadrature: gradients are linear, so the rule at the edge middles is exact.
    fn by_quadrature(shape: &TriangleShape) -> [[f64; 6]; 6] {
        let p = shape.in_plane();
        let jacobian = [[p[1][0], p[2][0]], [p[1][1], p[2][1]]];
        let det = jacobian[0][0] * jacobian[1][1] - jacobian[0][1] * jacobian[1][0];
        let mut k = [[0.0; 6]; 6];
        for l in &NODES[3..] {
            // Rows of the inverse jacobian turn reference gradients into physical ones.
            let physical = gradients(*l).map(|g| {
                let along_x = (g[0] * jacobian[1][1] - g[1] * jacobian[1][0]) / det;
                let along_y = (g[1] * jacobian[0][0] - g[0] * jacobian[0][1]) / det;
                [along_x, along_y]
            });
            for i in 0..6 {
                for j in 0..6 {
                    k[i][j] += det / 6.0 * (physical[i][0] * physical[j][0] + physical[i][1] * physical[j][1]);
                }
            }
        }
        k
    }

    #[test]
    fn the_stiffness_agrees_with_quadrature() {
        for lengths in [[3.0, 5.0, 4.0], [1.0, 1.0, 1.0], [1.0, 0.2, 0.9]] {
            let shape = TriangleShape { lengths };
            let (exact, numeric) = (stiffness(&shape), by_quadrature(&shape));
            for i in 0..6 {
                assert!(exact[i].iter().sum::<f64>().abs() < 1e-13);
                assert!((0..6).all(|j| (exact[i][j] - numeric[i][j]).abs() < 1e-13), "{exact:?} {numeric:?}");
            }
        }
    }

    #[test]
    fn the_identity_has_the_area_as_energy() {
        let shape = TriangleShape { lengths: [3.0, 5.0, 4.0] };
        let p = shape.in_plane();
        let mid = |a: usize, b: usize| [0.5 * (p[a][0] + p[b][0]), 0.5 * (p[a][1] + p[b][1])];
        let x = [p[0], p[1], p[2], mid(0, 1), mid(1, 2), mid(2, 0)];
        assert!((energy(&stiffness(&shape), &x) - 6.0).abs() < 1e-13);
    }
}
