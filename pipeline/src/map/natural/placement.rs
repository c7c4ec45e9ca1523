//! Where the holes of a chart lie in the plane, whose shapes are known.
//!
//! Of all maps in which the outer loop is where it is, and the loop of each hole is similar to its polygon p, the one nearest to a
//! conformal one: it minimises the conformal energy (Mullen, Tong, Alliez and Desbrun 2008, doi
//! 10.1111/j.1467-8659.2008.01289.x), the Dirichlet energy less the area of the image. With complex numbers such a map is
//!
//! z = z0 + sum_k (a_k P_k + b_k H_k),
//!
//! where z0 is harmonic with the outer loop at its place and all others at zero, P_k is harmonic with p_k along hole k, H_k with 1;
//! a_k turns and scales the hole, b_k moves it. The area is that of the outer polygon less |a_k|^2 times those of the p_k. So
//! there are two complex equations for each hole.

use super::boundary_first::Polygon;
use super::dense;
use super::laplace::Laplacian;
use crate::atlas::Chart;
use crate::fem::sparse::Factor;
use crate::topology::HalfEdgeId;

/// A harmonic function with complex values, and the derivative across the boundary of each of its parts.
struct Harmonic {
    values: [Vec<f64>; 2],
    fluxes: [Vec<f64>; 2],
}

/// That map, per vertex: the first loop lies where it is to lie, the others are turned, scaled and moved to their places, and
/// what is inside is harmonic. None where the equations are singular in doubles.
pub(super) fn placed(
    chart: &Chart,
    laplacian: &Laplacian,
    factor: &Option<Factor>,
    mut polygons: Vec<Polygon>,
) -> Option<Vec<[f64; 2]>> {
    let extended = |boundary_loop: &[HalfEdgeId], at: &dyn Fn(usize) -> [f64; 2]| {
        let values = [0, 1].map(|part| {
            let mut values = vec![0.0; chart.vertices().len()];
            for (i, h) in boundary_loop.iter().enumerate() {
                values[chart.from(*h).index()] = at(i)[part];
            }
            laplacian.solve(factor, &vec![0.0; values.len()], values)
        });
        let fluxes = [0, 1].map(|part| laplacian.apply(&values[part]));
        Harmonic { values, fluxes }
    };
    for polygon in polygons.iter_mut().skip(1) {
        centre(polygon);
    }
    let outer = extended(chart.outer(), &|i| polygons[0][i]);
    let mut functions = Vec::with_capacity(2 * chart.holes().len());
    for (hole, polygon) in chart.holes().iter().zip(&polygons[1..]) {
        functions.push(extended(hole, &|i| polygon[i]));
        functions.push(extended(hole, &|_| [1.0, 0.0]));
    }
    // Functions are harmonic inside: their products are those along the boundary.
    let boundary: Vec<usize> = chart.boundary().map(|h| chart.from(h).index()).collect();
    let count = functions.len();
    let mut equations = vec![vec![0.0; 2 * count + 1]; 2 * count];
    for (m, row) in functions.iter().enumerate() {
        for (n, column) in functions.iter().enumerate() {
            let [re, im] = product(row, column, &boundary);
            equations[2 * m][2 * n] += re;
            equations[2 * m][2 * n + 1] -= im;
            equations[2 * m + 1][2 * n] += im;
            equations[2 * m + 1][2 * n + 1] += re;
        }
        let [re, im] = product(row, &outer, &boundary);
        equations[2 * m][2 * count] = -re;
        equations[2 * m + 1][2 * count] = -im;
        if m % 2 == 0 {
            let area = doubled_area(&polygons[1 + m / 2]).abs();
            equations[2 * m][2 * m] += area;
            equations[2 * m + 1][2 * m + 1] += area;
        }
    }
    let found = dense::solve(equations)?;
    let [x, y] = &outer.values;
    let mut uv: Vec<[f64; 2]> = x.iter().zip(y).map(|(x, y)| [*x, *y]).collect();
    for (function, by) in functions.iter().zip(found.chunks_exact(2)) {
        let [x, y] = &function.values;
        for (p, (x, y)) in uv.iter_mut().zip(x.iter().zip(y)) {
            *p = [p[0] + by[0] * x - by[1] * y, p[1] + by[1] * x + by[0] * y];
        }
    }
    Some(uv)
}

/// The integral of grad of the conjugate of f times grad g.
fn product(f: &Harmonic, g: &Harmonic, boundary: &[usize]) -> [f64; 2] {
    let of = |a: &[f64], b: &[f64]| boundary.iter().map(|v| a[*v] * b[*v]).sum::<f64>();
    let [fx, fy] = &f.values;
    let [gx, gy] = &g.fluxes;
    [of(fx, gx) + of(fy, gy), of(fx, gy) - of(fy, gx)]
}

/// Moves a polygon so that the mean of its corners is the origin.
fn centre(polygon: &mut Polygon) {
    let count = polygon.len() as f64;
    let mean = [0, 1].map(|k| polygon.iter().map(|p| p[k]).sum::<f64>() / count);
    polygon.iter_mut().for_each(|p| *p = [p[0] - mean[0], p[1] - mean[1]]);
}

/// Twice the area that a polygon surrounds.
pub(super) fn doubled_area(polygon: &[[f64; 2]]) -> f64 {
    let following = polygon.iter().cycle().skip(1);
    polygon.iter().zip(following).map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum()
}
