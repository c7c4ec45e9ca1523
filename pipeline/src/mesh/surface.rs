//! A repaired surface.

use super::Metric;
use crate::atlas::Chart;
use crate::topology::VertexId;
use crate::topology::{EdgeTable, TopologySummary};
use crate::vec3::{BoundingBox, Vec3, triangle_area};

/// A triangulated surface after repair: no triangle repeats a vertex or another triangle, orientable components
/// are oriented, and every sheet that met others at non-manifold edges or vertices has vertices of its own. Made by
/// [`crate::repair()`].
#[derive(Clone, Debug)]
pub struct SurfaceMesh {
    pub(super) points: Vec<Vec3>,
    pub(super) triangles: Vec<[VertexId; 3]>,
    pub(super) source: Vec<u32>,
    pub(super) welded: Vec<u32>,
    /// Vertices from this one on are not of the input.
    pub(super) added_from: usize,
    pub(super) edges: EdgeTable,
    pub(super) summary: TopologySummary,
    pub(super) metric: Metric,
}

/// What a surface is made of. See [`SurfaceMesh`] for what must hold, and its methods for what each of these is.
pub(crate) struct SurfaceParts {
    pub points: Vec<Vec3>,
    pub triangles: Vec<[VertexId; 3]>,
    pub source: Vec<u32>,
    pub welded: Vec<u32>,
    pub added_from: usize,
    pub edges: EdgeTable,
    pub metric: Metric,
}

/// Where the sheets of a surface met before each was given vertices of its own: that is to become seams, and is counted for
/// the surface still.
#[derive(Clone, Copy)]
pub(crate) struct Sheets {
    /// Edges at which three or more triangles met.
    pub nonmanifold_edges: usize,
    /// Vertices at which a sheet touches others away from its boundary.
    pub nonmanifold_vertices: usize,
}

impl SurfaceMesh {
    /// A surface of these parts, counted, unless its triangles are `counted` already.
    pub(crate) fn new(parts: SurfaceParts, sheets: Sheets, counted: Option<TopologySummary>) -> Self {
        let SurfaceParts { points, triangles, source, welded, added_from, edges, metric } = parts;
        let counted = counted.unwrap_or_else(|| TopologySummary::new(&triangles, &edges));
        let Sheets { nonmanifold_edges, nonmanifold_vertices } = sheets;
        let summary = TopologySummary { nonmanifold_edges, nonmanifold_vertices, ..counted };
        Self { points, triangles, source, welded, added_from, edges, summary, metric }
    }

    /// Checks what the surface knows of itself against what its triangles tell.
    #[cfg(test)]
    pub(crate) fn assert_sound(&self) {
        let edges = EdgeTable::new(&self.triangles);
        assert!(self.edges.iter().eq(edges.iter()), "edges");
        let TopologySummary { nonmanifold_edges, nonmanifold_vertices, .. } = self.summary;
        let anew = TopologySummary {
            nonmanifold_edges,
            nonmanifold_vertices,
            ..TopologySummary::new(&self.triangles, &edges)
        };
        assert_eq!(self.summary, anew);
        let faces = self.triangles.len();
        assert_eq!((self.source.len(), self.metric.shapes.len(), self.metric.flagged.len()), (faces, faces, faces));
        assert_eq!((self.welded.len(), self.summary.vertices), (self.points.len(), self.points.len()));
    }

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
    pub fn topology_summary(&self) -> &TopologySummary {
        &self.summary
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
            summary: TopologySummary::new(&triangles, &edges),
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
