//! The least squares conformal map of a chart, with a free boundary.
//!
//! Dirichlet energy minus area in the plane, 1/2 sum (|grad u|^2 + |grad v|^2) - A(u, v), is zero for conformal maps and
//! positive for all others; with two vertices held it has one minimiser. Linear elements, on the four parts of each triangle:
//! least squares in quadratic ones folds, as z^2 is among them. Holes stay open.

use super::{Natural, certified};
use crate::atlas::Chart;
use crate::certify::parts;
use crate::fem::assembly::Assembly;
use crate::fem::dofs::Dofs;
use crate::fem::sparse;
use crate::mesh::TriangleShape;
use crate::monitor::{Checkpoint, Monitor};
use crate::vec3::{Vec3, cross, dot, norm, sub};

/// The least squares conformal map of `chart`; none where it is not one-to-one.
///
/// # Errors
/// The system cannot be solved, or interrupted.
///
/// # Example
///
/// A quarter of a tube is flat when it is unrolled: nothing is stretched.
///
/// ```
/// use planish_core::map::natural::conformal;
/// use planish_core::mesh::TriangleSoup;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let tube = shapes::tube(24, 4, 1.0);
/// let quarter = tube.triangles().iter().filter(|t| t.iter().all(|v| v % 24 <= 6)).copied().collect();
/// let mesh = repair(&TriangleSoup::new(tube.points().to_vec(), quarter)?, &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let unrolled = conformal(&atlas.charts()[0], &NoMonitor)?.expect("one-to-one");
/// assert!((unrolled.distortion.conformal_p99 - 1.0).abs() < 1e-6);
/// assert!((unrolled.distortion.area_ratio - 1.0).abs() < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn conformal(chart: &Chart, monitor: &dyn Monitor) -> Result<Option<Natural>, sparse::Error> {
    let nodes = chart.vertices().len() + chart.edges().len();
    // The four parts of a triangle have its shape, and so its matrix.
    let uv = least_squares(chart, nodes, chart.cells().flat_map(similar), 4, monitor)?;
    Ok(certified(chart, &uv))
}

/// As [`conformal`], of the triangles of `chart` as they are: the uv of its vertices, one-to-one or not.
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub fn conformal_by_corners(chart: &Chart, monitor: &dyn Monitor) -> Result<Vec<[f64; 2]>, sparse::Error> {
    let triangles = chart.triangles().iter().map(|t| t.map(|v| v.index()));
    least_squares(chart, chart.vertices().len(), triangles, 1, monitor)
}

/// The least squares conformal map of triangles between `nodes` nodes, `per_triangle` of them for each of the chart's and
/// similar to it, corner by corner.
fn least_squares(
    chart: &Chart,
    nodes: usize,
    triangles: impl Iterator<Item = [usize; 3]>,
    per_triangle: usize,
    monitor: &dyn Monitor,
) -> Result<Vec<[f64; 2]>, sparse::Error> {
    let held = far_apart(chart);
    // u and v of each node are scalars of their own, side by side; those of the two nodes that are held are prescribed.
    let free = (0..nodes).filter(|n| !held.contains(n)).flat_map(scalars);
    let dofs = Dofs::new(2 * nodes, free.map(|s| s as u32).collect());
    let parts: Vec<[usize; 6]> = triangles.map(part_scalars).collect();
    let pattern = dofs.pattern(parts.iter().copied());
    // One node is held at the origin, the other at (1, 0).
    let mut prescribed = vec![[0.0]; 2 * nodes];
    prescribed[scalars(held[1])[0]] = [1.0];
    let mut system = Assembly::new(&dofs, &pattern, prescribed);
    for (i, part) in parts.iter().enumerate() {
        system.add(i, part, &element(&chart.shapes()[i / per_triangle]));
    }
    let solution = system.solve(&pattern.analyse()?, monitor)?;
    Ok((0..nodes).map(|n| scalars(n).map(|s| solution[s][0])).collect())
}

/// The spectral conformal map of the triangles of `chart` as they are: the uv of its vertices. Of all maps whose boundary is
/// spread as far (in the mean square along it) it has the least energy, so that no vertices need be held (Mullen, Tong, Alliez
/// and Desbrun 2008, doi 10.1111/j.1467-8659.2008.01289.x): it is an eigenvector, found by inverse iteration. It need not be
/// one-to-one: coarse needles fold. It takes a fraction of the time of [`conformal`].
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub fn spectral_conformal(chart: &Chart, monitor: &dyn Monitor) -> Result<Vec<[f64; 2]>, sparse::Error> {
    let vertices = chart.vertices().len();
    let dofs = Dofs::new(2 * vertices, (0..2 * vertices as u32).collect());
    let triangles = chart.triangles().iter().map(|t| part_scalars(t.map(|v| v.index())));
    let pattern = dofs.pattern(triangles);
    let mass = boundary_mass(chart);
    let mut matrix = pattern.zeros();
    for (f, shape) in chart.shapes().iter().enumerate() {
        pattern.add(&mut matrix, f, &element(shape));
    }
    for (scalar, at) in pattern.diagonal().enumerate() {
        matrix[at] += SHIFT * mass[scalar / 2];
    }
    let checkpoint = Checkpoint::new(monitor);
    let analysis = pattern.analyse()?;
    checkpoint.end()?;
    let factor = analysis.factorise(&matrix, monitor)?;
    let mut x = first_guess(chart);
    for _ in 0..ITERATIONS {
        x = (0..2 * vertices).map(|scalar| mass[scalar / 2] * x[scalar]).collect();
        factor.solve(&mut x, 1);
        centred_and_scaled(&mut x, &mass);
    }
    // Nobody is asked while the factor is held: its memory is reserved.
    drop(factor);
    checkpoint.end()?;
    Ok((0..vertices).map(|v| scalars(v).map(|s| x[s])).collect())
}

/// How much of the boundary's mass is added to the matrix, which is singular without: moving a map costs no energy, nor does
/// turning it where the chart is developable. Small beside the energies that are told apart, and large enough that
/// rounding does not decide.
const SHIFT: f64 = 1e-6;

/// Steps of inverse iteration. Each brings the map nearer by the ratio of the two least energies, one half or less mostly.
const ITERATIONS: usize = 24;

/// Per vertex, its share of the length of all loops.
fn boundary_mass(chart: &Chart) -> Vec<f64> {
    let length: f64 = chart.boundary().map(|h| chart.length(h)).sum();
    let mut mass = vec![0.0; chart.vertices().len()];
    for h in chart.boundary() {
        for end in [h, h.next()] {
            mass[chart.from(end).index()] += 0.5 * chart.length(h) / length;
        }
    }
    mass
}

/// Where inverse iteration begins: the vertices seen along the mean normal, the extremes of the boundary one beside the other.
/// (Any guess would do that is not at right angles to the answer.)
fn first_guess(chart: &Chart) -> Vec<f64> {
    let [first, second] = extremes(chart).map(|v| chart.points()[v]);
    let along = sub(second, first);
    let mut normal = [0.0; 3];
    for f in 0..chart.triangles().len() {
        let [a, b, c] = chart.corners(f);
        let of_face = cross(sub(b, a), sub(c, a));
        normal = [0, 1, 2].map(|k| normal[k] + of_face[k]);
    }
    let across = cross(normal, along);
    // Of comparable size, whatever the unit; zero for a boundary that is seen from no side, and then the other serves.
    let unit = |v: Vec3| v.map(|c| c / norm(v).max(f64::MIN_POSITIVE));
    let (along, across) = (unit(along), unit(across));
    chart.points().iter().flat_map(|p| [dot(sub(*p, first), along), dot(sub(*p, first), across)]).collect()
}

/// Moves a map so that the mean of its boundary is the origin, and scales it so that the mean square there is one.
fn centred_and_scaled(x: &mut [f64], mass: &[f64]) {
    let mean = [0, 1].map(|k| mass.iter().enumerate().map(|(v, m)| m * x[2 * v + k]).sum::<f64>());
    x.iter_mut().enumerate().for_each(|(scalar, c)| *c -= mean[scalar % 2]);
    let square: f64 = x.iter().enumerate().map(|(scalar, c)| mass[scalar / 2] * c * c).sum();
    let scale = square.sqrt().recip();
    x.iter_mut().for_each(|c| *c *= scale);
}

/// The numbers of u and v at a node.
fn scalars(node: usize) -> [usize; 2] {
    [2 * node, 2 * node + 1]
}

/// The scalars of three nodes: u of each, then v of each.
fn part_scalars(nodes: [usize; 3]) -> [usize; 6] {
    std::array::from_fn(|i| scalars(nodes[i % 3])[i / 3])
}

/// The four parts of a triangle, each with its corners in the order in which they have the angles of the triangle's.
fn similar(cell: [u32; 6]) -> [[usize; 3]; 4] {
    let [a, b, c, [ab, bc, ca]] = parts(cell.map(|n| n as usize));
    [a, b, c, [bc, ca, ab]]
}

/// Two vertices of the outer loop, half of its length apart: the first one, and the one opposite.
fn far_apart(chart: &Chart) -> [usize; 2] {
    let lengths: Vec<f64> = chart.outer().iter().map(|h| chart.length(*h)).collect();
    let mut left = 0.5 * lengths.iter().sum::<f64>();
    let mut opposite = 0;
    for (i, length) in lengths.iter().enumerate() {
        left -= length;
        if left <= 0.0 {
            opposite = i;
            break;
        }
    }
    // Two vertices, even where one edge is half of the loop or more.
    let opposite = opposite.max(1);
    [0, opposite].map(|i| chart.from(chart.outer()[i]).index())
}

/// Two vertices of the outer loop that are far apart in space, whatever vertex the loop begins at: the farthest from the mean
/// of all, and the farthest from that one.
fn extremes(chart: &Chart) -> [usize; 2] {
    let on_loop: Vec<usize> = chart.outer().iter().map(|h| chart.from(*h).index()).collect();
    let mean = [0, 1, 2].map(|k| on_loop.iter().map(|v| chart.points()[*v][k]).sum::<f64>() / on_loop.len() as f64);
    let farthest_from = |p: Vec3, but: Option<usize>| {
        let others = on_loop.iter().filter(|v| Some(**v) != but);
        let distance = |v: usize| norm(sub(chart.points()[v], p));
        others.fold(None, |best: Option<(f64, usize)>, v| {
            let here = distance(*v);
            if best.is_some_and(|(most, _)| most >= here) { best } else { Some((here, *v)) }
        })
    };
    // A loop has three vertices or more.
    let first = farthest_from(mean, None).map_or(on_loop[0], |(_, v)| v);
    let second = farthest_from(chart.points()[first], Some(first)).map_or(on_loop[1], |(_, v)| v);
    [first, second]
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
