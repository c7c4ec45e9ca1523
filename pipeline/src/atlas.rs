//! Charts, and the atlas that they make.
//!
//! A [`Chart`] is a part of a surface that a disk, perhaps with holes, can carry, and a value of its own: it has its
//! points, its triangles and its lengths, so that it can be mapped where the surface is not.

use crate::mesh::{Metric, Patch, SurfaceMesh, TriangleShape};
use crate::topology::{ChartId, EdgeTable, FaceId, HalfEdgeId, VertexId};
use crate::vec3::{Vec3, triangle_area};

/// A connected, oriented part of a surface of genus 0 whose boundary loops are simple and share no vertex.
/// Made by [`crate::decompose()`].
///
/// A chart knows which vertices and triangles of the surface are its own, but needs the surface for nothing: it has all
/// that is known of them.
#[derive(Clone, Debug)]
pub struct Chart {
    pub(crate) id: ChartId,
    pub(crate) vertices: Vec<VertexId>,
    pub(crate) faces: Vec<FaceId>,
    pub(crate) triangles: Vec<[VertexId; 3]>,
    pub(crate) shapes: Vec<TriangleShape>,
    pub(crate) flagged: Vec<bool>,
    pub(crate) scale: f64,
    pub(crate) edges: EdgeTable,
    pub(crate) outer: Vec<HalfEdgeId>,
    pub(crate) holes: Vec<Vec<HalfEdgeId>>,
    pub(crate) patch: Patch,
}

impl Chart {
    /// The number of this chart in its atlas.
    pub fn id(&self) -> ChartId {
        self.id
    }

    /// The same chart, which was cut from a part of a surface, on that surface: there it is `id`, and the part has these `vertices`
    /// and `faces`, ascending.
    pub(crate) fn on_surface(self, id: ChartId, vertices: &[VertexId], faces: &[FaceId]) -> Self {
        Self {
            id,
            vertices: self.vertices.iter().map(|v| vertices[v.index()]).collect(),
            faces: self.faces.iter().map(|f| faces[f.index()]).collect(),
            ..self
        }
    }

    /// Per vertex of the chart, the vertex of the surface.
    pub fn vertices(&self) -> &[VertexId] {
        &self.vertices
    }

    /// Per triangle of the chart, the triangle of the surface.
    pub fn faces(&self) -> &[FaceId] {
        &self.faces
    }

    /// The triangles, by vertices of the chart.
    pub fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// The mollified shape of each triangle, in a unit that is a power of two times that of the input.
    pub fn shapes(&self) -> &[TriangleShape] {
        &self.shapes
    }

    /// Per triangle, whether mollification changed its area by more than 1 %.
    pub fn flagged(&self) -> &[bool] {
        &self.flagged
    }

    /// The positions of the vertices, in the unit of the input.
    pub fn points(&self) -> &[Vec3] {
        &self.patch.points
    }

    /// The corners of a triangle in space.
    pub fn corners(&self, face: usize) -> [Vec3; 3] {
        self.triangles[face].map(|v| self.patch.points[v.index()])
    }

    /// The position in the input file of triangle `face`.
    pub fn source_triangle(&self, face: usize) -> u32 {
        self.patch.source[face]
    }

    /// The welded vertex that a vertex is a copy of (see [`SurfaceMesh::welded_vertex`]).
    pub fn welded_vertex(&self, vertex: VertexId) -> u32 {
        self.patch.welded[vertex.index()]
    }

    /// The welded vertex, unless `vertex` was added (see [`SurfaceMesh::input_vertex`]).
    pub fn input_vertex(&self, vertex: VertexId) -> Option<u32> {
        (vertex.index() < self.patch.added_from).then(|| self.welded_vertex(vertex))
    }

    /// The mollified area of a triangle in the unit of the input, squared.
    pub fn area(&self, face: usize) -> f64 {
        self.shapes[face].area() / self.scale / self.scale
    }

    /// The area of all triangles in space, before mollification, in the unit of the input, squared.
    pub fn true_area(&self) -> f64 {
        // Products of coordinates may overflow or underflow where the area itself does not.
        let scaled = |face: usize| triangle_area(self.corners(face).map(|p| p.map(|c| c * self.scale)));
        (0..self.triangles.len()).map(scaled).sum::<f64>() / self.scale / self.scale
    }

    /// The power of two by which lengths in the unit of the input become those of the shapes.
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// The edges, numbered within the chart.
    pub fn edges(&self) -> &EdgeTable {
        &self.edges
    }

    /// The outer boundary loop, with the chart on its left.
    pub fn outer(&self) -> &[HalfEdgeId] {
        &self.outer
    }

    /// The loops around holes, each with the chart on its left.
    pub fn holes(&self) -> &[Vec<HalfEdgeId>] {
        &self.holes
    }

    /// All loops: the outer one, then those around holes.
    pub fn loops(&self) -> impl Iterator<Item = &[HalfEdgeId]> {
        std::iter::once(&self.outer).chain(&self.holes).map(Vec::as_slice)
    }

    /// The half-edges of all loops, in that order.
    pub fn boundary(&self) -> impl Iterator<Item = HalfEdgeId> {
        self.loops().flatten().copied()
    }

    /// The vertex at which `h` begins.
    pub fn from(&self, h: HalfEdgeId) -> VertexId {
        self.triangles[h.face().index()][h.side()]
    }

    /// Per triangle its six nodes: vertices, then the middles of the edges 01, 12, 20. Nodes are numbered as in the maps of
    /// the chart: its vertices, then its edges.
    pub fn cells(&self) -> impl Iterator<Item = [u32; 6]> {
        let middle = |h| (self.vertices.len() + self.edges.edge(h).index()) as u32;
        let cell = move |(f, t): (usize, &[VertexId; 3])| {
            let [ab, bc, ca] = [0, 1, 2].map(|side| middle(HalfEdgeId::side_of(FaceId::at(f), side)));
            [t[0].0, t[1].0, t[2].0, ab, bc, ca]
        };
        self.triangles.iter().enumerate().map(cell)
    }

    /// The length of the edge along `h`, mollified.
    pub fn length(&self, h: HalfEdgeId) -> f64 {
        self.shapes[h.face().index()].lengths[h.side()]
    }

    /// The chart as a surface of its own, vertices and triangles numbered as in the chart.
    pub(crate) fn to_surface(&self) -> SurfaceMesh {
        let metric = Metric {
            shapes: self.shapes.clone(),
            flagged: self.flagged.clone(),
            mollified_by: self.patch.mollified_by,
            scale: self.scale,
        };
        SurfaceMesh::of_patch(self.triangles.clone(), self.edges.clone(), metric, self.patch.clone())
    }
}

impl AsRef<Chart> for Chart {
    fn as_ref(&self) -> &Self {
        self
    }
}

/// The charts of a surface; together they hold every triangle once.
#[derive(Clone, Debug)]
pub struct Atlas {
    pub(crate) charts: Vec<Chart>,
    pub(crate) feature_edges: usize,
}

impl Atlas {
    /// The charts, in the order of their ids.
    pub fn charts(&self) -> &[Chart] {
        &self.charts
    }

    /// The feature edges that were found.
    pub fn feature_edges(&self) -> usize {
        self.feature_edges
    }

    /// The charts, one by one.
    pub fn into_charts(self) -> Vec<Chart> {
        self.charts
    }
}
