//! The boundary that a chart has when it is flattened conformally, and every edge of its outer loop keeps its length.
//!
//! Boundary first flattening (Sawhney and Crane 2017, *Boundary first flattening*, doi 10.1145/3132705) with scale factors of
//! one on the outer loop, which of all conformal maps distorts areas least. One Poisson problem gives the curvature that the
//! boundary has in the plane; angles and lengths then are those of a polygon, which is closed by the least change of lengths
//! (their equations 8 to 11 and section 4.4). Unlike least squares conformal maps it depends on no choice of vertices, and
//! has a limit under refinement.
//!
//! Theirs is for disks. Along a hole the logarithm of the scale is taken to be a constant here, such that the hole's loop turns
//! by a full turn in the plane: one equation for each hole, whose coefficients are those of harmonic functions with the same
//! matrix. So the loop of each hole has its shape, too; [`placed`] tells where it lies.

use super::laplace::Laplacian;
use super::placement::placed;
use crate::atlas::Chart;
use crate::fem::sparse;
use crate::map::filled::FilledChart;
use crate::measure::quantiles::{Weighted, extreme_ratio};
use crate::monitor::{Checkpoint, Monitor};
use crate::topology::HalfEdgeId;
use std::f64::consts::{PI, TAU};

/// The places of the vertices of a loop, in its order.
pub(super) type Polygon = Vec<[f64; 2]>;

/// A chart as it is laid out.
pub(super) struct Flattened {
    /// Per vertex its place, harmonic inside the loops; none where lengths would not stay positive. Loops need not be simple, and
    /// what is inside may fold.
    pub uv: Option<Vec<[f64; 2]>>,
    /// The area ratio of the conformal map, as far as the scale tells it.
    pub area_ratio: f64,
}

/// Charts with more holes are not laid out: each takes three solutions.
const MOST_HOLES: usize = 100;

/// Lays `chart` out; none where it has too many holes.
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub(super) fn boundary_first(
    chart: &Chart,
    filled: &FilledChart,
    monitor: &dyn Monitor,
) -> Result<Option<Flattened>, sparse::Error> {
    if chart.holes().len() > MOST_HOLES {
        return Ok(None);
    }
    let checkpoint = Checkpoint::new(monitor);
    let laplacian = Laplacian::new(chart, filled.elimination().iter().map(|v| v.0).collect());
    let matrix = laplacian.matrix();
    let analysis = if laplacian.is_rigid() { None } else { Some(laplacian.pattern().analyse_as_numbered()?) };
    checkpoint.end()?;
    let factor = match &analysis {
        Some(analysis) => Some(analysis.factorise(&matrix, monitor)?),
        None => None,
    };
    // Nobody is asked while the factor is held: its memory is reserved.
    let flat = FlatMetric::new(chart, &laplacian, &factor);
    let loops = flat.as_ref().and_then(|flat| flat.polygons(chart));
    let placed = loops.and_then(|loops| placed(chart, &laplacian, &factor, loops));
    drop(factor);
    checkpoint.end()?;
    Ok(flat.map(|flat| Flattened { uv: placed, area_ratio: flat.area_ratio(chart) }))
}

/// The metric of the plane on a chart.
struct FlatMetric {
    /// Per vertex the logarithm of the scale of lengths.
    log_scale: Vec<f64>,
    /// Per vertex of the boundary, by how much the boundary turns there in the plane (of others nothing is said).
    turning: Vec<f64>,
}

impl FlatMetric {
    /// None where the holes' equations are singular in doubles.
    fn new(chart: &Chart, laplacian: &Laplacian, factor: &Option<sparse::Factor>) -> Option<Self> {
        let vertices = chart.vertices().len();
        let angles = angle_sums(chart);
        // Inside, nothing is left of the angle defect: the Laplacian of the logarithm of the scale is the curvature.
        let load: Vec<f64> = angles.iter().map(|angle| angle - TAU).collect();
        let none = vec![0.0; vertices];
        let mut log_scale = laplacian.solve(factor, &load, none.clone());
        // The boundary turns by its own curvature, and by the derivative of that logarithm across it.
        let of_scale = laplacian.apply(&log_scale);
        let mut turning: Vec<f64> = angles.iter().zip(of_scale).map(|(angle, flux)| PI - angle + flux).collect();
        // Per hole the function that is one along it, and its derivative across the boundary.
        let mut scaled = Vec::with_capacity(chart.holes().len());
        for hole in chart.holes() {
            let mut one = none.clone();
            hole.iter().for_each(|h| one[chart.from(*h).index()] = 1.0);
            let function = laplacian.solve(factor, &none, one);
            let flux = laplacian.apply(&function);
            scaled.push((function, flux));
        }
        let along =
            |hole: &[HalfEdgeId], values: &[f64]| hole.iter().map(|h| values[chart.from(*h).index()]).sum::<f64>();
        let mut equations = Vec::with_capacity(chart.holes().len());
        for hole in chart.holes() {
            let mut equation: Vec<f64> = scaled.iter().map(|(_, flux)| along(hole, flux)).collect();
            // With the chart on its left it turns to the right.
            equation.push(-TAU - along(hole, &turning));
            equations.push(equation);
        }
        let factors = super::dense::solve(equations)?;
        for ((function, flux), factor) in scaled.iter().zip(factors) {
            for v in 0..vertices {
                log_scale[v] += factor * function[v];
                turning[v] += factor * flux[v];
            }
        }
        Some(Self { log_scale, turning })
    }

    /// The ratio of the extreme quantiles of the area scale.
    fn area_ratio(&self, chart: &Chart) -> f64 {
        let scale = |t: &[crate::topology::VertexId; 3]| {
            let mean = t.iter().map(|v| self.log_scale[v.index()]).sum::<f64>() / 3.0;
            (2.0 * mean).exp()
        };
        let weighted = chart.triangles().iter().zip(chart.shapes());
        let mut scales: Vec<Weighted> =
            weighted.map(|(t, shape)| Weighted { value: scale(t), weight: shape.area() }).collect();
        extreme_ratio(&mut scales)
    }

    /// The loops, each in a place of its own.
    fn polygons(&self, chart: &Chart) -> Option<Vec<Polygon>> {
        chart.loops().map(|boundary_loop| self.polygon(chart, boundary_loop)).collect()
    }

    fn polygon(&self, chart: &Chart, boundary_loop: &[HalfEdgeId]) -> Option<Polygon> {
        let mut direction = 0.0_f64;
        let (mut lengths, mut tangents) = (Vec::new(), Vec::new());
        for h in boundary_loop {
            let from = chart.from(*h).index();
            direction += self.turning[from];
            let (sin, cos) = direction.sin_cos();
            tangents.push([cos, sin]);
            // Along a loop the scale is one and the same.
            lengths.push(chart.length(*h) * self.log_scale[from].exp());
        }
        let lengths = closed(&lengths, &tangents)?;
        Some(laid_out(&lengths, &tangents))
    }
}

/// Per vertex the sum of the angles of its triangles.
fn angle_sums(chart: &Chart) -> Vec<f64> {
    let mut angles = vec![0.0; chart.vertices().len()];
    for (t, shape) in chart.triangles().iter().zip(chart.shapes()) {
        for (v, angle) in t.iter().zip(shape.angles()) {
            angles[v.index()] += angle;
        }
    }
    angles
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

    /// The places of the vertices of all loops, in their order.
    fn along_loops(chart: &Chart, flat: Flattened) -> Vec<[f64; 2]> {
        let uv = flat.uv.expect("closes");
        chart.boundary().map(|h| uv[chart.from(h).index()]).collect()
    }

    fn polygon_of(soup: &crate::mesh::TriangleSoup) -> (Chart, Vec<[f64; 2]>) {
        let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk");
        let chart = atlas.into_charts().remove(0);
        let flat = boundary_first(&chart, &FilledChart::open(&chart), &NoMonitor).expect("solves").expect("few holes");
        let polygon = along_loops(&chart, flat);
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

    #[test]
    fn holes_of_a_flat_plate_stay_where_they_are_and_what_is_rolled_up_is_unrolled() {
        let plate = shapes::disk_with_holes(13, 2);
        let moved = |to: &dyn Fn([f64; 3]) -> [f64; 3]| {
            let points = plate.points().iter().map(|p| to(*p)).collect();
            crate::mesh::TriangleSoup::new(points, plate.triangles().to_vec()).expect("sound")
        };
        let soups =
            [moved(&|[x, y, _]| [x, y, 0.0]), moved(&|[x, y, _]| [0.5 * (2.0 * x).sin(), y, 0.5 * (2.0 * x).cos()])];
        let [flat, rolled] = soups.map(|soup| {
            let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
            let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk");
            let chart = atlas.into_charts().remove(0);
            let flat =
                boundary_first(&chart, &FilledChart::open(&chart), &NoMonitor).expect("solves").expect("few holes");
            let area_ratio = flat.area_ratio;
            let at: Vec<[f64; 2]> = along_loops(&chart, flat).iter().map(|p| p.map(|c| c / chart.scale())).collect();
            let points: Vec<_> = chart.boundary().map(|h| chart.points()[chart.from(h).index()]).collect();
            (at, points, area_ratio)
        });
        assert!(flat.2 < 1.0 + 1e-9 && rolled.2 < 1.02, "{} {}", flat.2, rolled.2);
        for i in 0..flat.0.len() {
            for j in 0..i {
                let [p, q] = [i, j].map(|k| [flat.1[k][0], flat.1[k][1]]);
                let wanted = distance(p, q);
                assert!((distance(flat.0[i], flat.0[j]) - wanted).abs() < 1e-9, "{i} {j}");
                // Chords of an arc of two radians are shorter than it.
                assert!((distance(rolled.0[i], rolled.0[j]) - wanted).abs() < 0.03 * wanted.max(0.3), "{i} {j}");
            }
        }
    }
}
