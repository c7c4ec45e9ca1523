//! The metric in the plane that makes edges as long in space as they shall be.

use super::Sizing;
use crate::certified::CertifiedChart;
use crate::evaluate::CurvedMap;
use crate::topology::{EdgeId, FaceId, HalfEdgeId, VertexId};
use crate::vec3::{Vec3, cross, dot, norm};

/// Edges in the plane are no longer than this, where a map is hardly stretched at all: charts lie within the circle of radius 1.
const LONGEST: f64 = 2.0;

/// And no shorter: the grid has 2^-53.
const SHORTEST: f64 = 1e-13;

/// A symmetric positive definite matrix: a vector v has length 1 where v M v = 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metric {
    /// M11.
    pub uu: f64,
    /// M12.
    pub uv: f64,
    /// M22.
    pub vv: f64,
}

impl Metric {
    /// That in which vectors are as long as `derivative` (dx/du, dx/dv) makes them in space, in units of `size`. Where it is
    /// nearly singular, its eigenvalues are held within what the plane has room for.
    ///
    /// ```
    /// use planish_core::planar::Metric;
    ///
    /// // Twice as long along u, three times along v; edges of half a unit.
    /// let m = Metric::pulled_back([[2.0, 0.0, 0.0], [0.0, 0.0, 3.0]], 0.5);
    /// assert!((m.uu - 16.0).abs() < 1e-12 && m.uv.abs() < 1e-12 && (m.vv - 36.0).abs() < 1e-12);
    /// assert!((m.length([0.25, 0.0]) - 1.0).abs() < 1e-12);
    /// ```
    pub fn pulled_back([along_u, along_v]: [Vec3; 2], size: f64) -> Self {
        let [uu, uv, vv] = [dot(along_u, along_u), dot(along_u, along_v), dot(along_v, along_v)];
        // The smaller eigenvalue is the determinant over the larger one: their difference would cancel.
        let (half, apart) = (0.5 * (uu + vv), (0.5 * (uu - vv)).hypot(uv));
        let largest = half + apart;
        if !largest.is_finite() {
            // The map is beyond doubles there: nothing is known.
            let m = 1.0 / (LONGEST * LONGEST);
            return Self { uu: m, uv: 0.0, vv: m };
        }
        let area = norm(cross(along_u, along_v));
        let least = if largest > 0.0 { area / largest * area } else { 0.0 };
        let held = |eigenvalue: f64| {
            let length = (size / eigenvalue.sqrt()).clamp(SHORTEST, LONGEST);
            1.0 / (length * length)
        };
        Eigen { values: [held(largest), held(least)], direction: direction(uu, uv, vv) }.into_metric()
    }

    /// The length of a vector.
    pub fn length(&self, [u, v]: [f64; 2]) -> f64 {
        (u * u * self.uu + 2.0 * u * v * self.uv + v * v * self.vv).sqrt()
    }

    /// The log-Euclidean mean of some metrics, at least one.
    pub(super) fn mean(metrics: &[Self]) -> Self {
        let logs = metrics.iter().map(Self::log);
        let sum = logs.fold([0.0; 3], |sum, log| [0, 1, 2].map(|k| sum[k] + log[k]));
        let [uu, uv, vv] = sum.map(|c| c / metrics.len() as f64);
        let (half, apart) = (0.5 * (uu + vv), (0.5 * (uu - vv)).hypot(uv));
        let values = [half + apart, half - apart].map(f64::exp);
        Eigen { values, direction: direction(uu, uv, vv) }.into_metric()
    }

    /// How far two metrics are from each other: the norm of the difference of their logarithms; twice that of sizes where they
    /// differ by a factor.
    pub(super) fn apart(&self, other: &Self) -> f64 {
        let (a, b) = (self.log(), other.log());
        let [uu, uv, vv] = [0, 1, 2].map(|k| a[k] - b[k]);
        (uu * uu + 2.0 * uv * uv + vv * vv).sqrt()
    }

    fn log(&self) -> [f64; 3] {
        let Self { uu, uv, vv } = *self;
        let (half, apart) = (0.5 * (uu + vv), (0.5 * (uu - vv)).hypot(uv));
        let largest = half + apart;
        // It was held away from 0; products may cancel to less than nothing all the same.
        let floor = 1.0 / (LONGEST * LONGEST);
        let least = ((uu * vv - uv * uv) / largest).max(floor.min(largest));
        let log = Eigen { values: [largest.ln(), least.ln()], direction: direction(uu, uv, vv) }.into_metric();
        [log.uu, log.uv, log.vv]
    }
}

/// A symmetric matrix by its eigenvalues, and the direction of the first.
struct Eigen {
    values: [f64; 2],
    direction: [f64; 2],
}

impl Eigen {
    fn into_metric(self) -> Metric {
        let ([a, b], [c, s]) = (self.values, self.direction);
        Metric { uu: a * c * c + b * s * s, uv: (a - b) * c * s, vv: a * s * s + b * c * c }
    }
}

/// The direction of the larger eigenvalue.
fn direction(uu: f64, uv: f64, vv: f64) -> [f64; 2] {
    let angle = 0.5 * f64::atan2(2.0 * uv, uu - vv);
    [angle.cos(), angle.sin()]
}

/// The metric over a chart.
pub(super) struct Field<'a> {
    pub certified: &'a CertifiedChart,
    pub map: &'a CurvedMap,
    sizing: &'a dyn Sizing,
    /// The triangles around each vertex of the chart.
    around: Vec<Vec<u32>>,
}

impl<'a> Field<'a> {
    pub fn new(certified: &'a CertifiedChart, map: &'a CurvedMap, sizing: &'a dyn Sizing) -> Self {
        let chart = certified.chart();
        let mut around = vec![Vec::new(); chart.vertices().len()];
        for (face, triangle) in (0..).zip(chart.triangles()) {
            triangle.iter().for_each(|v| around[v.index()].push(face));
        }
        Self { certified, map, sizing, around }
    }

    /// The length of edges that is asked for at a point of space.
    pub fn size_at(&self, x: Vec3) -> f64 {
        self.sizing.size_at(x)
    }

    /// The metric in a triangle, at the point with these weights.
    pub fn inside(&self, face: u32, weights: [f64; 3]) -> Metric {
        let corners = self.certified.chart().corners(face as usize);
        let x = [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
        Metric::pulled_back(self.map.derivative(face, weights), self.sizing.size_at(x))
    }

    /// The mean of those of the triangles around a vertex.
    pub fn at_vertex(&self, v: VertexId) -> Metric {
        let triangles = self.certified.chart().triangles();
        let at = |face: &u32| self.inside(*face, triangles[*face as usize].map(|w| f64::from(u8::from(w == v))));
        Metric::mean(&self.around[v.index()].iter().map(at).collect::<Vec<_>>())
    }

    /// The mean of those of the triangles beside an edge, at t from the begin of its first side.
    pub fn on_edge(&self, edge: EdgeId, t: f64) -> Metric {
        let chart = self.certified.chart();
        let sides = chart.edges().sides(edge);
        let begin = chart.from(sides[0]);
        let at =
            |h: &HalfEdgeId| self.inside(h.face().0, on_side(*h, if chart.from(*h) == begin { t } else { 1.0 - t }));
        Metric::mean(&sides.iter().map(at).collect::<Vec<_>>())
    }

    /// The faces of the chart.
    pub fn faces(&self) -> impl Iterator<Item = FaceId> + use<> {
        (0..self.certified.chart().triangles().len()).map(FaceId::at)
    }
}

/// The weights of a point of a side of its triangle.
pub(super) fn on_side(h: HalfEdgeId, t: f64) -> [f64; 3] {
    let mut weights = [0.0; 3];
    weights[h.side()] = 1.0 - t;
    weights[(h.side() + 1) % 3] = t;
    weights
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: Metric, b: Metric) -> bool {
        let scale = a.uu + a.vv;
        [a.uu - b.uu, a.uv - b.uv, a.vv - b.vv].iter().all(|d| d.abs() <= 1e-12 * scale)
    }

    #[test]
    fn means_are_of_logarithms() {
        let [a, b] = [1.0, 16.0].map(|m| Metric { uu: m, uv: 0.0, vv: 100.0 });
        assert!(close(Metric::mean(&[a, b]), Metric { uu: 4.0, uv: 0.0, vv: 100.0 }), "a geometric mean");
        let turned = Metric { uu: 5.0, uv: 2.0, vv: 3.0 };
        assert!(close(Metric::mean(&[turned; 3]), turned));
        assert!((a.apart(&b) - 16.0_f64.ln()).abs() < 1e-12 && turned.apart(&turned) < 1e-12);
    }

    #[test]
    fn what_is_singular_is_held() {
        for derivative in
            [[[0.0; 3]; 2], [[1.0, 0.0, 0.0]; 2], [[f64::NAN; 3]; 2], [[1e-300, 0.0, 0.0], [0.0, 1e300, 0.0]]]
        {
            let m = Metric::pulled_back(derivative, 0.1);
            assert!(m.uu > 0.0 && m.vv > 0.0 && m.uu.is_finite() && m.vv.is_finite() && m.uv.is_finite(), "{m:?}");
        }
    }
}
