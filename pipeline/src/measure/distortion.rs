//! How a certified map distorts the surface, triangle by triangle and for a chart as a whole.
//!
//! Distortion is measured against the triangles in space, with their mollified shapes. All numbers are finite.

use crate::atlas::Chart;
use crate::certify::{CertifiedMap, PlanarMap};
use crate::fem::bernstein::{self, JacobianBezier};
use crate::fem::element::{Barycentric, Element, P2, P2Nodes};
use crate::grid::GridPoint;
use crate::measure::quantiles::{Weighted, extreme_ratio, quantiles};
use crate::topology::{Stars, VertexId, VisitStamps};

/// The fields of one triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellFields {
    /// Least jacobian determinant, per unit of mollified area.
    pub det_min: f64,
    /// Largest jacobian determinant, per unit of mollified area.
    pub det_max: f64,
    /// `det_min / det_max`, in (0, 1].
    pub jacobian_ratio: f64,
    /// The largest sigma1 / sigma2 at the six nodes, at least 1.
    pub conformal_distortion: f64,
    /// Area in the plane per area in space.
    pub area_scale: f64,
}

/// The distortion of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// The conformal distortion that half of the area does not exceed.
    pub conformal_median: f64,
    /// The conformal distortion that 99 % of the area does not exceed.
    pub conformal_p99: f64,
    /// The area scale, summed over stars of two rings: its 99.9 % over its 0.1 % quantile, weighted by area.
    pub area_ratio: f64,
}

/// The fields of every triangle of `chart` under `map`, in the order of the chart.
///
/// # Example
///
/// What [`CertifiedChart::fields`](crate::CertifiedChart::fields) and `distortion` hold is made here.
///
/// ```
/// use planish_core::measure::distortion::{area_ratio, fields, summary};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{BoundaryShape, Settings, decompose, parametrize, shapes};
///
/// let settings = Settings { decompose: decompose::Settings::of(BoundaryShape::Circle), ..Settings::default() };
/// let atlas = parametrize(&shapes::disk(6), &settings, &NoMonitor)?;
/// let (chart, map) = (atlas.charts()[0].chart(), atlas.charts()[0].map());
/// let fields = fields(chart, map);
/// // Area scales are areas in the plane per area in space: together they give the area of the disk.
/// let image: f64 = fields.iter().enumerate().map(|(f, of)| of.area_scale * chart.area(f)).sum();
/// assert!((image / std::f64::consts::PI - 1.0).abs() < 1e-3);
/// // A hill as low as this is hardly stretched: 1 is conformal, and 1 is an even scale.
/// let summary = summary(chart, &fields, area_ratio(chart, map));
/// assert!(summary.conformal_p99 < 1.5 && summary.area_ratio < 2.0, "{summary:?}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fields(chart: &Chart, map: &CertifiedMap) -> Vec<CellFields> {
    (0..chart.triangles().len()).map(|f| cell_fields(chart, map, f)).collect()
}

fn cell_fields(chart: &Chart, map: &CertifiedMap, face: usize) -> CellFields {
    let nodes = map.map().cells[face].map(|n| map.map().nodes[n as usize]);
    let coefficients = JacobianBezier::new(nodes).coefficients();
    let det = bernstein::range(coefficients);
    // Determinants are taken on the reference triangle, of area 1/2.
    let doubled_area = 2.0 * chart.area(face);
    CellFields {
        det_min: finite(det.min / doubled_area),
        det_max: finite(det.max / doubled_area),
        jacobian_ratio: (det.min / det.max).clamp(f64::MIN_POSITIVE, 1.0),
        conformal_distortion: conformal_distortion(chart, face, nodes.map(|n| n.uv())),
        area_scale: finite(area_in_plane(&coefficients) / chart.area(face)),
    }
}

/// The integral of a quadratic over the reference triangle is the mean of its coefficients times the area 1/2.
fn area_in_plane(coefficients: &[f64; 6]) -> f64 {
    coefficients.iter().sum::<f64>() / 12.0
}

/// Brings a positive quantity that overflowed or underflowed back into the range of normal doubles.
fn finite(x: f64) -> f64 {
    x.clamp(f64::MIN_POSITIVE, f64::MAX)
}

/// The largest ratio of singular values of the map from the triangle in space, at the six nodes.
fn conformal_distortion(chart: &Chart, face: usize, x: [[f64; 2]; 6]) -> f64 {
    let corners = chart.shapes()[face].in_plane();
    let from_first = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    let mut largest: f64 = 1.0;
    for l in P2::NODES {
        let ratio = stretch_at(corners, &from_first, l);
        // Where the map is invalid, or beyond doubles, it stretches without bound.
        let is_sound = ratio.is_finite() && ratio > 0.0;
        largest = if is_sound { largest.max(ratio) } else { f64::MAX };
    }
    largest.clamp(1.0, f64::MAX)
}

/// The ratio of singular values at `l` of the map from a triangle of the plane, with one corner at the origin and one on
/// the axis, to nodal values `x` of which the first is zero.
fn stretch_at(corners: [[f64; 2]; 3], x: &P2Nodes, l: Barycentric) -> f64 {
    let [_, [length, _], [shift, height]] = corners;
    let gradients = P2::gradients(l);
    let along =
        |direction: usize| -> [f64; 2] { [0, 1].map(|k| (1..6).map(|n| gradients[n][direction] * x[n][k]).sum()) };
    let [along_xi, along_eta] = [along(0), along(1)];
    let det = (along_xi[0] * along_eta[1] - along_xi[1] * along_eta[0]) / (length * height);
    // From xi and eta to the axes of the plane: x = length xi + shift eta, y = height eta.
    let first = along_xi.map(|v| v / length);
    let second = [0, 1].map(|k| (along_eta[k] - shift * first[k]) / height);
    singular_ratio(first, second, det)
}

/// The ratio of the singular values of a matrix, by its columns and its determinant.
pub(crate) fn singular_ratio(first: [f64; 2], second: [f64; 2], det: f64) -> f64 {
    // |f_z| + |f_conj z| is the larger singular value, and the determinant the product of both.
    let length = |x: f64, y: f64| (x * x + y * y).sqrt();
    let doubled_f_z = length(first[0] + second[1], first[1] - second[0]);
    let doubled_f_conj_z = length(first[0] - second[1], first[1] + second[0]);
    let largest = 0.5 * (doubled_f_z + doubled_f_conj_z);
    largest * largest / det
}

/// Sums up the fields of a chart. Triangles whose shape mollification changed by more than 1 % are left out of the
/// conformal quantiles (unless all are). `area_ratio` is that of the chart (see [`area_ratio()`]).
pub fn summary(chart: &Chart, fields: &[CellFields], area_ratio: f64) -> Summary {
    let [conformal_median, conformal_p99] = conformal_quantiles(chart, |f| fields[f].conformal_distortion, [0.5, 0.99]);
    Summary { conformal_median, conformal_p99, area_ratio }
}

/// The conformal distortion that 99 % of the area does not exceed, of a map that may be invalid here and there, by the
/// nodes of each triangle of the chart: invalid triangles count as stretched without bound.
pub(crate) fn conformal_p99_of_nodes(chart: &Chart, nodes: impl Fn(usize) -> [GridPoint; 6]) -> f64 {
    let distortion = |f: usize| conformal_distortion(chart, f, nodes(f).map(|n| n.uv()));
    let [p99] = conformal_quantiles(chart, distortion, [0.99]);
    p99
}

/// Quantiles of what `distortion` tells of each triangle of a chart, by area, without those whose shape mollification
/// changed.
fn conformal_quantiles<const N: usize>(chart: &Chart, distortion: impl Fn(usize) -> f64, shares: [f64; N]) -> [f64; N] {
    let all_flagged = chart.flagged().iter().all(|f| *f);
    let counted = (0..chart.triangles().len()).filter(|f| all_flagged || !chart.flagged()[*f]);
    let weighted = |f: usize| Weighted { value: distortion(f), weight: chart.shapes()[f].area() };
    let mut weighted: Vec<Weighted> = counted.map(weighted).collect();
    quantiles(&mut weighted, shares)
}

/// Sums areas over stars of two rings.
struct TwoRings<'a> {
    chart: &'a Chart,
    stars: Stars,
    /// Per triangle its area in the plane, and in space.
    plane: &'a [f64],
    space: Vec<f64>,
    seen_faces: VisitStamps,
    seen_vertices: VisitStamps,
}

impl<'a> TwoRings<'a> {
    fn new(chart: &'a Chart, plane: &'a [f64]) -> Self {
        let space: Vec<f64> = chart.shapes().iter().map(|s| s.area()).collect();
        let vertices = chart.vertices().len();
        Self {
            chart,
            stars: Stars::new(chart.triangles(), vertices),
            plane,
            seen_faces: VisitStamps::new(space.len()),
            space,
            seen_vertices: VisitStamps::new(vertices),
        }
    }

    /// The area scale of the two rings around `v`, with the area of its own star as weight.
    fn scale(&mut self, v: usize) -> Weighted {
        self.seen_faces.clear();
        self.seen_vertices.clear();
        let (mut in_plane, mut in_space) = (0.0, 0.0);
        // The stars of all vertices of the star of `v`, each vertex and each triangle once.
        for first_ring in self.stars.around(v) {
            for u in self.chart.triangles()[*first_ring as usize] {
                if !self.seen_vertices.visit(u.index()) {
                    continue;
                }
                for f in self.stars.around(u.index()) {
                    let f = *f as usize;
                    if self.seen_faces.visit(f) {
                        in_plane += self.plane[f];
                        in_space += self.space[f];
                    }
                }
            }
        }
        let own_star = self.stars.around(v).iter().map(|f| self.space[*f as usize]);
        Weighted { value: in_plane / in_space, weight: own_star.sum() }
    }
}

/// Per vertex, the area scale of its star of two rings, with the area of its own star as weight; `plane` are the areas
/// of the triangles in the plane.
fn star_scales(chart: &Chart, plane: &[f64]) -> Vec<Weighted> {
    let mut rings = TwoRings::new(chart, plane);
    (0..chart.vertices().len()).map(|v| rings.scale(v)).collect()
}

/// Per triangle, the logarithm of the area scale around it: the mean over its corners, each with its two rings.
pub(crate) fn log_scales(chart: &Chart, map: &CertifiedMap) -> Vec<f64> {
    let scales = star_scales(chart, &plane_areas(map));
    let logs: Vec<f64> = scales.iter().map(|scale| finite(scale.value).ln()).collect();
    let mean = |t: &[VertexId; 3]| t.iter().map(|v| logs[v.index()]).sum::<f64>() / 3.0;
    chart.triangles().iter().map(mean).collect()
}

/// The area ratio of a chart (see [`Summary::area_ratio`]).
pub fn area_ratio(chart: &Chart, map: &CertifiedMap) -> f64 {
    ratio(star_scales(chart, &plane_areas(map)))
}

/// The area ratio of a map that may be invalid here and there, by the nodes of each triangle of the chart: stars whose
/// area is not positive do not count.
pub(crate) fn area_ratio_of_nodes(chart: &Chart, nodes: impl Fn(usize) -> [GridPoint; 6]) -> f64 {
    let area = |f: usize| area_in_plane(&JacobianBezier::new(nodes(f)).coefficients());
    let plane: Vec<f64> = (0..chart.triangles().len()).map(area).collect();
    let mut scales = star_scales(chart, &plane);
    scales.retain(|s| s.value > 0.0);
    ratio(scales)
}

/// The 99.9 % over the 0.1 % quantile, by area.
fn ratio(mut scales: Vec<Weighted>) -> f64 {
    finite(extreme_ratio(&mut scales))
}

/// Per triangle of a map its area in the plane.
fn plane_areas(map: &CertifiedMap) -> Vec<f64> {
    let PlanarMap { cells, nodes, .. } = map.map();
    let area = |cell: &[u32; 6]| {
        let det = JacobianBezier::new(cell.map(|n| nodes[n as usize]));
        area_in_plane(&det.coefficients())
    };
    cells.iter().map(area).collect()
}

#[cfg(test)]
mod tests {
    use crate::parametrize::parametrize_chart;
    use crate::{Order, decompose, repair, shapes};

    #[test]
    fn every_field_is_finite_and_in_its_range() {
        for (soup, scale) in [(shapes::disk(6), 1.0), (shapes::sliver_strip(10), 1.0), (shapes::disk(6), 1e-90)] {
            let points = soup.points().iter().map(|p| p.map(|c| c * scale)).collect();
            let soup = crate::mesh::TriangleSoup::new(points, soup.triangles().to_vec()).expect("sound");
            let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
            let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
            let chart = atlas.into_charts().remove(0);
            let done = parametrize_chart(chart, Order::Quadratic).expect("maps");
            for f in done.fields() {
                assert!(f.det_min > 0.0 && f.det_min <= f.det_max && f.det_max.is_finite(), "{f:?}");
                assert!(f.jacobian_ratio > 0.0 && f.jacobian_ratio <= 1.0);
                assert!(f.conformal_distortion >= 1.0 && f.conformal_distortion.is_finite());
                assert!(f.area_scale > 0.0 && f.area_scale.is_finite());
            }
            let s = done.distortion();
            assert!(s.conformal_median <= s.conformal_p99 && s.area_ratio >= 1.0 && s.area_ratio.is_finite());
        }
    }
}
