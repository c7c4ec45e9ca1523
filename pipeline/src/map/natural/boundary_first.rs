//! The boundary that a disk has when it is flattened conformally, and every edge of the boundary keeps its length.
//!
//! Boundary first flattening (Sawhney and Crane 2017, *Boundary first flattening*, doi 10.1145/3132705) with scale factors of
//! one on the boundary, which of all conformal maps distorts areas least. One Poisson problem gives the curvature that the
//! boundary has in the plane; angles and lengths then are those of a polygon, which is closed by the least change of lengths
//! (their equations 8 to 11 and section 4.4). Unlike least squares conformal maps it depends on no choice of vertices, and
//! has a limit under refinement.

use crate::atlas::Chart;
use crate::fem::assembly::Assembly;
use crate::fem::dofs::Dofs;
use crate::fem::element::{Element, P1};
use crate::fem::sparse;
use crate::map::filled::FilledChart;
use crate::mesh::TriangleShape;
use crate::monitor::Monitor;
use std::f64::consts::{PI, TAU};

/// The places of the vertices of the outer loop of `chart`, which has no holes, in its order; none where lengths would not
/// stay positive. The polygon need not be simple.
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub(super) fn boundary_first(
    chart: &Chart,
    filled: &FilledChart,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<[f64; 2]>>, sparse::Error> {
    let curvature = curvature_in_plane(chart, filled, monitor)?;
    let lengths: Vec<f64> = chart.outer().iter().map(|h| chart.length(*h)).collect();
    let mut direction = 0.0_f64;
    let mut tangents = Vec::with_capacity(lengths.len());
    for h in chart.outer() {
        direction += curvature[chart.from(*h).index()];
        let (sin, cos) = direction.sin_cos();
        tangents.push([cos, sin]);
    }
    Ok(closed(&lengths, &tangents).map(|lengths| laid_out(&lengths, &tangents)))
}

/// Per vertex of the boundary, by how much the boundary turns there in the plane (of others nothing is said).
fn curvature_in_plane(chart: &Chart, filled: &FilledChart, monitor: &dyn Monitor) -> Result<Vec<f64>, sparse::Error> {
    let vertices = chart.vertices().len();
    let inside: Vec<u32> = filled.elimination().iter().map(|v| v.0).collect();
    let mut angles = vec![0.0; vertices];
    for (t, shape) in chart.triangles().iter().zip(chart.shapes()) {
        for (v, angle) in t.iter().zip(corner_angles(shape)) {
            angles[v.index()] += angle;
        }
    }
    let dofs = Dofs::new(vertices, inside);
    let triangle = |f: usize| chart.triangles()[f].map(|v| v.index());
    let faces = chart.triangles().len();
    let pattern = dofs.pattern((0..faces).map(triangle));
    // On the boundary nothing is scaled.
    let mut system = Assembly::new(&dofs, &pattern, vec![[0.0]; vertices]);
    for f in 0..faces {
        system.add(f, &triangle(f), &P1::stiffness(&chart.shapes()[f]));
    }
    // Inside, what is left of the angle defect is to be none: the Laplacian of the logarithm of the scale is the curvature.
    for v in dofs.free() {
        system.add_load(*v as usize, [-(TAU - angles[*v as usize])]);
    }
    let log_scale = system.solve(&pattern.analyse_as_numbered()?, monitor)?;
    // The boundary turns by its own curvature, and by the derivative of that logarithm across it.
    let mut curvature: Vec<f64> = angles.iter().map(|angle| PI - angle).collect();
    for f in 0..faces {
        let (nodes, stiffness) = (triangle(f), P1::stiffness(&chart.shapes()[f]));
        for i in 0..3 {
            curvature[nodes[i]] += (0..3).map(|j| stiffness[i][j] * log_scale[nodes[j]][0]).sum::<f64>();
        }
    }
    Ok(curvature)
}

/// The angles at the corners of a triangle.
fn corner_angles(shape: &TriangleShape) -> [f64; 3] {
    let half = shape.half_cotangents();
    // Edge k + 1 lies across from corner k.
    [0, 1, 2].map(|k| 1.0_f64.atan2(2.0 * half[(k + 1) % 3]))
}

/// The lengths changed as little as possible, long ones more than short ones, so that the polygon is closed; none where one
/// of them would not stay positive.
fn closed(lengths: &[f64], tangents: &[[f64; 2]]) -> Option<Vec<f64>> {
    let (mut gap, mut matrix) = ([0.0; 2], [0.0; 3]);
    for (length, [x, y]) in lengths.iter().zip(tangents) {
        gap[0] += length * x;
        gap[1] += length * y;
        matrix[0] += length * x * x;
        matrix[1] += length * x * y;
        matrix[2] += length * y * y;
    }
    let [xx, xy, yy] = matrix;
    let det = xx * yy - xy * xy;
    let [a, b] = [(yy * gap[0] - xy * gap[1]) / det, (xx * gap[1] - xy * gap[0]) / det];
    let changed = |(length, [x, y]): (&f64, &[f64; 2])| length * (1.0 - (a * x + b * y));
    let lengths: Vec<f64> = lengths.iter().zip(tangents).map(changed).collect();
    lengths.iter().all(|length| length.is_finite() && *length > 0.0).then_some(lengths)
}

/// The corners of the polygon with these sides.
fn laid_out(lengths: &[f64], tangents: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut at = [0.0; 2];
    let mut corners = Vec::with_capacity(lengths.len());
    for (length, tangent) in lengths.iter().zip(tangents) {
        corners.push(at);
        at = [0, 1].map(|k| at[k] + length * tangent[k]);
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::NoMonitor;
    use crate::{decompose, repair, shapes};

    fn polygon_of(soup: &crate::mesh::TriangleSoup) -> (Chart, Vec<[f64; 2]>) {
        let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk");
        let chart = atlas.into_charts().remove(0);
        let polygon = boundary_first(&chart, &FilledChart::open(&chart), &NoMonitor).expect("solves").expect("closes");
        (chart, polygon)
    }

    fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
        (p[0] - q[0]).hypot(p[1] - q[1])
    }

    #[test]
    fn a_flat_disk_keeps_its_boundary_and_a_cap_of_a_sphere_has_a_round_one_of_the_same_length() {
        let (chart, polygon) = polygon_of(&shapes::flat_disk(5));
        let corners: Vec<_> = chart.outer().iter().map(|h| chart.points()[chart.from(*h).index()]).collect();
        for i in 0..corners.len() {
            for j in 0..i {
                let [p, q] = [i, j].map(|k| [corners[k][0], corners[k][1]]);
                assert!(
                    (distance(polygon[i], polygon[j]) - distance(p, q) * chart.scale()).abs() < 1e-12 * chart.scale()
                );
            }
        }
        // Half of a sphere, by triangles of an equal shape around the pole: its equator becomes a circle.
        let flat = shapes::flat_disk(8);
        let lift = |[x, y, _]: [f64; 3]| {
            let s = 1.0 + x * x + y * y;
            [2.0 * x / s, 2.0 * y / s, (s - 2.0) / s]
        };
        let points = flat.points().iter().map(|p| lift(*p)).collect();
        let cap = crate::mesh::TriangleSoup::new(points, flat.triangles().to_vec()).expect("sound");
        let (chart, polygon) = polygon_of(&cap);
        let count = polygon.len() as f64;
        let centre = [0, 1].map(|k| polygon.iter().map(|p| p[k]).sum::<f64>() / count);
        for p in &polygon {
            assert!((distance(*p, centre) / chart.scale() - 1.0).abs() < 0.01, "{p:?}");
        }
    }
}
