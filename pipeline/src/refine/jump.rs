//! What a bisection would save: the estimator of refinement.
//!
//! A quadratic map is harmonic among the quadratic ones. Where one triangle is too long for it, a finer triangulation
//! has a map of much less energy; how much, a single bisection tells already. An edge and the triangles at its sides
//! are halved, and the new nodes (two on the edge, one on each median) go where the energy is least while all others
//! stay: a system of at most four unknowns. That is the estimator of hierarchical bases (Deuflhard, Leinen and
//! Yserentant 1989, doi 10.1016/0899-8248(89)90018-9), with a bisection in place of a higher degree, so that it
//! counts just what is done about it.

use crate::fem::element::{Element, P2, P2Nodes, energy};
use crate::mesh::TriangleShape;

/// A triangle at a side that is to be halved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Side {
    /// Its shape.
    pub shape: TriangleShape,
    /// The uv of its six nodes.
    pub nodes: P2Nodes,
    /// Which side is halved: 0, 1, 2 for the edges 01, 12, 20.
    pub side: usize,
}

/// The new nodes at a halved edge: in the middle of its two parts, and of the medians of up to two triangles.
const NEW: usize = 4;

/// The energies at an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jump {
    /// The Dirichlet energy of the triangles at its sides.
    pub energy: f64,
    /// What it falls by when the edge is halved.
    pub saved: f64,
}

/// What halving an edge saves, given the triangles at its sides (one, at the boundary, whose nodes are prescribed; or two,
/// which see the edge in opposite directions).
pub(super) fn jump(sides: &[Side]) -> Jump {
    let mut matrix = [[0.0; NEW]; NEW];
    let mut slope = [[0.0; 2]; NEW];
    let mut before = 0.0;
    for (k, side) in sides.iter().enumerate() {
        before += energy(&P2::stiffness(&side.shape), &side.nodes);
        // The second triangle sees the parts of the edge in the other order.
        let [first, second] = if k == 0 { [0, 1] } else { [1, 0] };
        let [lower, upper] = halves(side);
        add(&mut matrix, &mut slope, &lower, [first, 2 + k]);
        add(&mut matrix, &mut slope, &upper, [second, 2 + k]);
    }
    let is_free: &[usize] = if sides.len() == 2 { &[0, 1, 2, 3] } else { &[2] };
    Jump { energy: before, saved: saved(&matrix, &slope, is_free) }
}

/// A half of a triangle: the nodes in the middle of its part of the edge and of the median are new.
struct Half {
    stiffness: [[f64; 6]; 6],
    nodes: P2Nodes,
    /// The new ones among its six: that on the edge, that on the median.
    new: [usize; 2],
}

/// The two parts of a triangle, that at the begin of the side first.
fn halves(side: &Side) -> [Half; 2] {
    let Side { shape, nodes, side: k } = side;
    let at = |i: usize| (k + i) % 3;
    // In a numbering that begins at the side: corners p, q, r and the middles of pq, qr, rp.
    let [p, q, r] = [0, 1, 2].map(|i| nodes[at(i)]);
    let [pq, qr, rp] = [0, 1, 2].map(|i| nodes[3 + at(i)]);
    let [of_lower, of_upper] = shape.halves(*k);
    let turned: P2Nodes = [p, q, r, pq, qr, rp];
    let inside = |l| P2::interpolate(&turned, l);
    let [on_p, on_q, on_median] = [inside([0.75, 0.25, 0.0]), inside([0.25, 0.75, 0.0]), inside([0.25, 0.25, 0.5])];
    [
        // p, the middle, r.
        Half { stiffness: P2::stiffness(&of_lower), nodes: [p, pq, r, on_p, on_median, rp], new: [3, 4] },
        // The middle, q, r.
        Half { stiffness: P2::stiffness(&of_upper), nodes: [pq, q, r, on_q, qr, on_median], new: [3, 5] },
    ]
}

/// Adds a half to matrix and slope of the new nodes, whose numbers are `number`.
fn add(matrix: &mut [[f64; NEW]; NEW], slope: &mut [[f64; 2]; NEW], half: &Half, number: [usize; 2]) {
    let Half { stiffness, nodes, new } = half;
    // Differences, so that small triangles lose no digits.
    let d = nodes.map(|x| [x[0] - nodes[0][0], x[1] - nodes[0][1]]);
    for (local, row) in new.iter().zip(number) {
        for (n, d) in d.iter().enumerate() {
            slope[row][0] += stiffness[*local][n] * d[0];
            slope[row][1] += stiffness[*local][n] * d[1];
        }
        for (other, column) in new.iter().zip(number) {
            matrix[row][column] += stiffness[*local][*other];
        }
    }
}

/// Half of slope times inverse matrix times slope, over the unknowns in `free`: by Cholesky's factors. Zero where rounding leaves
/// no positive matrix, as in triangles without a height.
fn saved(matrix: &[[f64; NEW]; NEW], slope: &[[f64; 2]; NEW], free: &[usize]) -> f64 {
    let mut factor = [[0.0; NEW]; NEW];
    let mut solved = [[0.0; 2]; NEW];
    let mut sum = 0.0;
    for (i, row) in free.iter().enumerate() {
        for (j, column) in free.iter().enumerate().take(i + 1) {
            let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
            let rest = matrix[*row][*column] - known;
            if i > j {
                factor[i][j] = rest / factor[j][j];
            } else if rest > 0.0 {
                factor[i][i] = rest.sqrt();
            } else {
                return 0.0;
            }
        }
        for c in 0..2 {
            let known: f64 = (0..i).map(|k| factor[i][k] * solved[k][c]).sum();
            solved[i][c] = (slope[*row][c] - known) / factor[i][i];
            sum += solved[i][c] * solved[i][c];
        }
    }
    0.5 * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPE: TriangleShape = TriangleShape { lengths: [1.0, 0.8, 0.7] };

    /// A triangle, mirrored in the side that is halved, with the values of `f` at its nodes.
    fn pair(f: impl Fn([f64; 2]) -> [f64; 2]) -> [Side; 2] {
        let [a, b, c] = SHAPE.in_plane();
        let mirrored = [c[0], -c[1]];
        let of = |corners: [[f64; 2]; 3]| {
            P2::NODES.map(|l| f([0, 1].map(|k| (0..3).map(|i| l[i] * corners[i][k]).sum::<f64>())))
        };
        let below = TriangleShape { lengths: [1.0, SHAPE.lengths[2], SHAPE.lengths[1]] };
        [
            Side { shape: SHAPE, nodes: of([a, b, c]), side: 0 },
            Side { shape: below, nodes: of([b, a, mirrored]), side: 0 },
        ]
    }

    #[test]
    fn harmonic_quadratics_save_nothing_and_cubics_do() {
        // Squares and cubes of z = x + i y.
        let square = |[x, y]: [f64; 2]| [x * x - y * y, 2.0 * x * y];
        let found = jump(&pair(square));
        assert!(found.energy > 0.1 && found.saved < 1e-14 * found.energy, "{found:?}");
        let cube = |[x, y]: [f64; 2]| [x * x * x - 3.0 * x * y * y, 3.0 * x * x * y - y * y * y];
        let found = jump(&pair(cube));
        assert!(found.saved > 1e-4 * found.energy && found.saved < found.energy, "{found:?}");
    }

    #[test]
    fn what_is_saved_is_what_the_refined_elements_have_less() {
        let wild = |[x, y]: [f64; 2]| [(3.0 * x).sin() + y, (2.0 * x - y).exp()];
        let sides = pair(wild);
        let found = jump(&sides);
        // Any other place for a new node has more energy: the four are moved along one of them.
        let [lower, upper] = halves(&sides[0]);
        let [other_lower, other_upper] = halves(&sides[1]);
        let mut matrix = [[0.0; NEW]; NEW];
        let mut slope = [[0.0; 2]; NEW];
        for (half, number) in [(lower, [0, 2]), (upper, [1, 2]), (other_lower, [1, 3]), (other_upper, [0, 3])] {
            add(&mut matrix, &mut slope, &half, number);
        }
        for i in 0..NEW {
            let best: f64 = (0..2).map(|c| 0.5 * slope[i][c] * slope[i][c] / matrix[i][i]).sum();
            assert!(best > 0.0 && best <= found.saved * (1.0 + 1e-12), "{i}: {best} {found:?}");
        }
    }

    #[test]
    fn at_the_boundary_only_the_median_moves() {
        let wild = |[x, y]: [f64; 2]| [(3.0 * x).sin() + y, (2.0 * x - y).exp()];
        let [one, _] = pair(wild);
        let found = jump(&[one]);
        assert!(found.saved > 0.0 && found.saved < jump(&pair(wild)).saved);
    }
}
