//! Charts: parts of a surface that a disk can carry.

use crate::mesh::TriangleShape;
use crate::topology::EdgeTable;
use crate::topology::{ChartId, FaceId, HalfEdgeId, VertexId};

/// A connected, oriented part of a surface of genus 0 whose boundary loops are simple and share no vertex.
/// Made by [`crate::decompose()`].
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
}

impl Chart {
    /// The number of this chart in its atlas.
    pub fn id(&self) -> ChartId {
        self.id
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

    /// The mollified area of a triangle in the unit of the input, squared.
    pub fn area(&self, face: usize) -> f64 {
        self.shapes[face].area() / self.scale / self.scale
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

    /// Numbers charts (those of an atlas, some of them split) in the order given.
    pub fn renumber<'a>(charts: impl IntoIterator<Item = &'a mut Chart>) {
        charts.into_iter().enumerate().for_each(|(i, chart)| chart.id = ChartId::at(i));
    }
}
