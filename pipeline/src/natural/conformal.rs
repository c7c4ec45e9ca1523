//! The least squares conformal map of a chart, with a free boundary.
//!
//! Dirichlet energy minus area in the plane, 1/2 sum (|grad u|^2 + |grad v|^2) - A(u, v), is zero for conformal maps and
//! positive for all others; with two vertices held it has one minimiser. Linear elements: least squares in quadratic ones
//! folds, as z^2 is among them. Holes stay open.

use super::{Natural, certified};
use crate::atlas::Chart;
use crate::host::Host;
use crate::mesh::TriangleShape;
use crate::sparse::{self, PRESCRIBED, Pattern};

/// The least squares conformal map of `chart`; none where it is not one-to-one.
///
/// # Errors
/// The system cannot be solved.
pub fn conformal(chart: &Chart, host: &dyn Host) -> Result<Option<Natural>, sparse::Error> {
    let held = far_apart(chart);
    let vertices = chart.vertices().len();
    let mut number = vec![PRESCRIBED; vertices];
    let mut free = 0;
    for (v, number) in number.iter_mut().enumerate().filter(|(v, _)| !held.contains(v)) {
        debug_assert!(v < vertices);
        *number = free;
        free += 1;
    }
    let unknown = |v: usize, k: u32| if number[v] == PRESCRIBED { PRESCRIBED } else { 2 * number[v] + k };
    let of_triangle = |t: &[crate::id::VertexId; 3]| {
        let [a, b, c] = t.map(|v| v.index());
        [unknown(a, 0), unknown(b, 0), unknown(c, 0), unknown(a, 1), unknown(b, 1), unknown(c, 1)]
    };
    let elements: Vec<[u32; 6]> = chart.triangles().iter().map(of_triangle).collect();
    let pattern = Pattern::new(2 * free as usize, &elements);
    let mut values = pattern.zeros();
    let mut rhs = vec![0.0; 2 * free as usize];
    // One vertex is held at the origin, the other at (1, 0).
    let one = held[1];
    for (f, shape) in chart.shapes().iter().enumerate() {
        let matrix = element(shape);
        pattern.add(&mut values, f, &matrix);
        if let Some(k) = chart.triangles()[f].iter().position(|v| v.index() == one) {
            let entries = elements[f].iter().zip(&matrix).filter(|(row, _)| **row != PRESCRIBED);
            entries.for_each(|(row, entries)| rhs[*row as usize] -= entries[k]);
        }
    }
    pattern.analyse()?.factorise(&values, host)?.solve(&mut rhs, 1);
    let place = |v: usize| match number[v] {
        PRESCRIBED => [if v == one { 1.0 } else { 0.0 }, 0.0],
        n => [rhs[2 * n as usize], rhs[2 * n as usize + 1]],
    };
    Ok(certified(chart, &(0..vertices).map(place).collect::<Vec<_>>()))
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
