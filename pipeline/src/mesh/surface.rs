//! A repaired surface.

use super::Metric;
use crate::atlas::Chart;
use crate::topology::VertexId;
use crate::topology::{Census, EdgeTable};
use crate::vec3::{BoundingBox, Vec3, triangle_area};

/// A triangulated surface after repair: no triangle repeats a vertex or another triangle, orientable components
/// are oriented, and every sheet that met others at non-manifold edges or vertices has vertices of its own. Made by
/// [`crate::repair()`].
#[derive(Clone, Debug)]
pub struct SurfaceMesh {
    pub(crate) points: Vec<Vec3>,
    pub(crate) triangles: Vec<[VertexId; 3]>,
    pub(crate) source: Vec<u32>,
    pub(crate) welded: Vec<u32>,
    /// Vertices from this one on are not of the input.
    pub(crate) added_from: usize,
    pub(crate) edges: EdgeTable,
    pub(crate) census: Census,
    pub(crate) metric: Metric,
}

impl SurfaceMesh {
    /// The positions of the vertices, in the unit of the input.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// The position in the input file of triangle `face`.
    pub fn source_triangle(&self, face: usize) -> u32 {
        self.source[face]
    }

    /// The welded vertex that `vertex` is a copy of: vertices of the input, bit-equal ones merged, in the
    /// order of their first appearance.
    pub fn welded_vertex(&self, vertex: VertexId) -> u32 {
        self.welded[vertex.index()]
    }

    /// The welded vertex, unless `vertex` was added: then it has a number there that no vertex of the input has.
    pub fn input_vertex(&self, vertex: VertexId) -> Option<u32> {
        (vertex.index() < self.added_from).then(|| self.welded[vertex.index()])
    }

    /// The edges.
    pub fn edges(&self) -> &EdgeTable {
        &self.edges
    }

    /// The counts after splitting; but `nonmanifold_edges` are those that were split, and `nonmanifold_vertices`
    /// those at which a sheet touches others away from its boundary.
    pub fn census(&self) -> &Census {
        &self.census
    }

    /// The intrinsic metric.
    pub fn metric(&self) -> &Metric {
        &self.metric
    }

    /// The corners of a triangle in space.
    pub fn corners(&self, face: usize) -> [Vec3; 3] {
        self.triangles[face].map(|v| self.points[v.index()])
    }

    /// The part of the surface that a chart covers, as a surface of its own: vertices and triangles are numbered as in
    /// the chart.
    pub(crate) fn part(&self, chart: &Chart) -> Self {
        let vertex = |v: &VertexId| v.index();
        let (triangles, edges) = (chart.triangles().to_vec(), chart.edges().clone());
        Self {
            points: chart.vertices().iter().map(|v| self.points[vertex(v)]).collect(),
            welded: chart.vertices().iter().map(|v| self.welded[vertex(v)]).collect(),
            source: chart.faces().iter().map(|f| self.source[f.index()]).collect(),
            added_from: chart.vertices().partition_point(|v| v.index() < self.added_from),
            census: Census::new(&triangles, &edges),
            metric: Metric {
                shapes: chart.shapes().to_vec(),
                flagged: chart.flagged().to_vec(),
                mollified_by: self.metric.mollified_by,
                scale: self.metric.scale,
            },
            triangles,
            edges,
        }
    }

    /// The total true area, in the unit of the input, squared.
    pub fn area(&self) -> f64 {
        // Products of coordinates may overflow or underflow where the area itself does not.
        let scale = self.metric.scale;
        let scaled = |f: usize| triangle_area(self.corners(f).map(|p| p.map(|c| c * scale)));
        (0..self.triangles.len()).map(scaled).sum::<f64>() / scale / scale
    }

    /// The smallest box around the surface.
    pub fn bounding_box(&self) -> BoundingBox {
        let origin = BoundingBox { min: [0.0; 3], max: [0.0; 3] };
        BoundingBox::of(self.points.iter().copied()).unwrap_or(origin)
    }
}
