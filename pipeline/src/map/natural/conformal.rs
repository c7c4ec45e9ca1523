//! The least squares conformal map of a chart, with a free boundary.
//!
//! Dirichlet energy minus area in the plane, 1/2 sum (|grad u|^2 + |grad v|^2) - A(u, v), is zero for conformal maps and
//! positive for all others; with two vertices held it has one minimiser. Linear elements, on the four parts of each triangle:
//! least squares in quadratic ones folds, as z^2 is among them. Holes stay open.

use super::{Natural, certified};
use crate::atlas::Chart;
use crate::certify::parts;
use crate::fem::sparse::{self, PRESCRIBED, Pattern};
use crate::mesh::TriangleShape;
use crate::monitor::Monitor;

/// The least squares conformal map of `chart`; none where it is not one-to-one.
///
/// # Errors
/// The system cannot be solved.
pub fn conformal(chart: &Chart, monitor: &dyn Monitor) -> Result<Option<Natural>, sparse::Error> {
    let held = far_apart(chart);
    let numbers = Numbers::new(chart.vertices().len() + chart.edges().len(), held);
    let nodes: Vec<[usize; 3]> = chart.cells().flat_map(similar).collect();
    let elements: Vec<[u32; 6]> = nodes.iter().map(|part| numbers.unknowns(*part)).collect();
    let pattern = Pattern::new(numbers.count(), &elements);
    let mut values = pattern.zeros();
    let mut rhs = vec![0.0; numbers.count()];
    for (f, unknowns) in elements.iter().enumerate() {
        // The four parts of a triangle have its shape, and so its matrix.
        let matrix = element(&chart.shapes()[f / 4]);
        pattern.add(&mut values, f, &matrix);
        // One node is held at the origin, the other at (1, 0).
        if let Some(k) = nodes[f].iter().position(|n| *n == held[1]) {
            let entries = unknowns.iter().zip(&matrix).filter(|(row, _)| **row != PRESCRIBED);
            entries.for_each(|(row, entries)| rhs[*row as usize] -= entries[k]);
        }
    }
    pattern.analyse()?.factorise(&values, monitor)?.solve(&mut rhs, 1);
    Ok(certified(chart, &numbers.places(&rhs)))
}

/// The four parts of a triangle, each with its corners in the order in which they have the angles of the triangle's.
fn similar(cell: [u32; 6]) -> [[usize; 3]; 4] {
    let [a, b, c, [ab, bc, ca]] = parts(cell.map(|n| n as usize));
    [a, b, c, [bc, ca, ab]]
}

/// The numbers of the unknowns: u and v of every node but the two that are held.
struct Numbers {
    of_node: Vec<u32>,
    held: [usize; 2],
}

impl Numbers {
    fn new(nodes: usize, held: [usize; 2]) -> Self {
        let mut next = 0;
        let number = |n: usize| {
            if held.contains(&n) {
                return PRESCRIBED;
            }
            next += 2;
            next - 2
        };
        Self { of_node: (0..nodes).map(number).collect(), held }
    }

    fn count(&self) -> usize {
        2 * (self.of_node.len() - 2)
    }

    /// Those of three nodes: u of each, then v of each.
    fn unknowns(&self, nodes: [usize; 3]) -> [u32; 6] {
        let v = |u: u32| if u == PRESCRIBED { PRESCRIBED } else { u + 1 };
        let [a, b, c] = nodes.map(|n| self.of_node[n]);
        [a, b, c, v(a), v(b), v(c)]
    }

    /// Where the nodes lie, by the unknowns.
    fn places(&self, solution: &[f64]) -> Vec<[f64; 2]> {
        let place = |(node, number): (usize, &u32)| match *number {
            PRESCRIBED => [if node == self.held[1] { 1.0 } else { 0.0 }, 0.0],
            u => [solution[u as usize], solution[u as usize + 1]],
        };
        self.of_node.iter().enumerate().map(place).collect()
    }
}

/// Two vertices of the outer loop, half of its length apart: the first one, and the one opposite.
fn far_apart(chart: &Chart) -> [usize; 2] {
    let lengths: Vec<f64> = chart.outer().iter().map(|h| chart.length(*h)).collect();
    let mut left = 0.5 * lengths.iter().sum::<f64>();
    let opposite = lengths.iter().position(|l| {
        left -= l;
        left <= 0.0
    });
    let opposite = opposite.unwrap_or(0).max(1);
    [0, opposite].map(|i| chart.from(chart.outer()[i]).index())
}

/// The matrix of the energy of a triangle, for its corners' u and then their v.
fn element(shape: &TriangleShape) -> [[f64; 6]; 6] {
    let half = shape.half_cotangents();
    let mut matrix = [[0.0; 6]; 6];
    for k in 0..3 {
        let (i, j) = (k, (k + 1) % 3);
        for shift in [0, 3] {
            matrix[i + shift][i + shift] += half[k];
            matrix[j + shift][j + shift] += half[k];
            matrix[i + shift][j + shift] -= half[k];
            matrix[j + shift][i + shift] -= half[k];
        }
        // The area is the sum of (u_i v_j - u_j v_i) / 2 over the sides.
        for (u, v, entry) in [(i, j, -0.5), (j, i, 0.5)] {
            matrix[u][v + 3] += entry;
            matrix[v + 3][u] += entry;
        }
    }
    matrix
}
