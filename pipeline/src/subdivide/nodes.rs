//! The nodes that the charts of a surface share: vertices, middles of edges, and middles of parts of these.

use crate::atlas::Chart;
use crate::certified::CertifiedAtlas;
use crate::measure::curvature::{self, Principal};
use crate::mesh::SurfaceMesh;
use crate::seams::Curve;
use crate::topology::{EdgeId, HalfEdgeId, VertexId};
use crate::vec3::{Vec3, midpoint};
use std::collections::BTreeMap;

/// Nodes are numbered: vertices of the surface, middles of its edges, middles of parts of edges. Copies of a vertex
/// or an edge in several sheets have the number of the first one.
pub(super) struct Nodes {
    /// Per vertex of the surface, the first copy of it.
    vertex: Vec<u32>,
    /// Per edge of the surface, the first copy of it.
    edge: Vec<u32>,
    /// Per node that is no vertex, the nodes that it lies between.
    parents: Vec<[u32; 2]>,
    /// Per edge of the surface, by the first copy: whether its middle is a node of the triangulations.
    is_split: Vec<bool>,
    /// How many of these there are.
    split: usize,
    /// The nodes in the middle of halved parts of edges.
    halved: BTreeMap<(u32, u32), u32>,
    /// Per curve its edges, by the numbers of the first copies.
    curve_edges: Vec<Vec<u32>>,
}

/// The half-edge of the surface that a half-edge of a chart is: triangles begin at the same corner in both.
pub(super) fn on_surface(chart: &Chart, h: HalfEdgeId) -> HalfEdgeId {
    HalfEdgeId::side_of(chart.faces()[h.face().index()], h.side())
}

impl Nodes {
    pub(super) fn new(atlas: &CertifiedAtlas) -> Self {
        let mesh = atlas.mesh();
        let vertex = first_copies(mesh);
        let mut edge: Vec<u32> = (0..mesh.edges().len() as u32).collect();
        let mut curve_edges = Vec::new();
        for curve in atlas.seams().curves() {
            let beside = |i: usize| {
                let side =
                    |s: &crate::seams::CurveSide| on_surface(atlas.charts()[s.chart.index()].chart(), s.half_edges[i]);
                curve.sides().iter().map(|s| mesh.edges().edge(side(s)).0).collect::<Vec<u32>>()
            };
            let mut along = Vec::with_capacity(curve.segments());
            for copies in (0..curve.segments()).map(beside) {
                let first = copies.iter().fold(u32::MAX, |m, e| m.min(*e));
                copies.iter().for_each(|e| edge[*e as usize] = first);
                along.push(first);
            }
            curve_edges.push(along);
        }
        let ends = |e: usize| {
            let h = mesh.edges().sides(EdgeId::at(e))[0];
            let t = mesh.triangles()[h.face().index()];
            [t[h.side()], t[(h.side() + 1) % 3]].map(|v| vertex[v.index()])
        };
        let parents = (0..edge.len()).map(ends).collect();
        let is_split = vec![false; edge.len()];
        Self { vertex, edge, parents, is_split, split: 0, halved: BTreeMap::new(), curve_edges }
    }

    /// The node of a vertex of the surface.
    fn at_vertex(&self, v: VertexId) -> u32 {
        self.vertex[v.index()]
    }

    /// The node in the middle of the edge along a half-edge of the surface.
    pub(super) fn at_middle(&self, mesh: &SurfaceMesh, h: HalfEdgeId) -> u32 {
        self.middle_of(self.edge[mesh.edges().edge(h).index()])
    }

    /// The node in the middle of an edge, which is told by its first copy.
    fn middle_of(&self, edge: u32) -> u32 {
        self.vertex.len() as u32 + edge
    }

    /// The nodes of a chart: its vertices, then the middles of its edges.
    pub(super) fn of_chart(&self, mesh: &SurfaceMesh, chart: &Chart) -> Vec<u32> {
        let vertices = chart.vertices().iter().map(|v| self.at_vertex(*v));
        let middles = chart.edges().iter().map(|(_, sides)| self.at_middle(mesh, on_surface(chart, sides[0])));
        vertices.chain(middles).collect()
    }

    /// Makes the middle of an edge of the surface a node of the triangulations.
    pub(super) fn split(&mut self, mesh: &SurfaceMesh, h: HalfEdgeId) {
        let edge = self.edge[mesh.edges().edge(h).index()] as usize;
        self.split += usize::from(!std::mem::replace(&mut self.is_split[edge], true));
    }

    /// The node in the middle of an edge of the surface, where that is one of the triangulations.
    pub(super) fn split_at(&self, mesh: &SurfaceMesh, h: HalfEdgeId) -> Option<u32> {
        let edge = self.edge[mesh.edges().edge(h).index()];
        self.is_split[edge as usize].then_some(self.middle_of(edge))
    }

    /// How many edges and parts of edges were halved.
    pub(super) fn halved(&self) -> usize {
        self.split + self.halved.len()
    }

    /// Whether each edge of a curve is exactly its two halves.
    pub(super) fn is_in_halves(&self, curve: &Curve) -> bool {
        let edges = &self.curve_edges[curve.id().index()];
        edges.iter().all(|edge| self.is_split[*edge as usize]) && !self.is_cut(curve)
    }

    /// Whether a half of an edge of a curve was halved.
    pub(super) fn is_cut(&self, curve: &Curve) -> bool {
        let edges = &self.curve_edges[curve.id().index()];
        curve.vertices().windows(2).zip(edges).any(|(ends, edge)| {
            let middle = self.middle_of(*edge);
            ends.iter().any(|v| self.middle(self.at_vertex(*v), middle).is_some())
        })
    }

    /// The node in the middle of the part of an edge between two nodes, where it was halved.
    pub(super) fn middle(&self, a: u32, b: u32) -> Option<u32> {
        self.halved.get(&(a.min(b), a.max(b))).copied()
    }

    /// Halves the part of an edge between two nodes.
    pub(super) fn halve(&mut self, a: u32, b: u32) -> u32 {
        let ends = (a.min(b), a.max(b));
        let next = (self.vertex.len() + self.parents.len()) as u32;
        let node = *self.halved.entry(ends).or_insert(next);
        if node == next {
            self.parents.push([ends.0, ends.1]);
        }
        node
    }

    /// Where every node lies; those in between in the middle, so that all of an edge's lie on it.
    pub(super) fn positions(&self, mesh: &SurfaceMesh) -> Vec<Vec3> {
        let mut points: Vec<Vec3> = self.vertex.iter().map(|v| mesh.points()[*v as usize]).collect();
        for [a, b] in &self.parents {
            points.push(midpoint(points[*a as usize], points[*b as usize]));
        }
        points
    }

    /// The principal curvatures at every node.
    pub(super) fn curvatures(&self, mesh: &SurfaceMesh) -> Vec<Principal> {
        let mut all = curvature::measure(mesh, &self.vertex, self.vertex.len());
        for [a, b] in &self.parents {
            all.push(all[*a as usize].between(&all[*b as usize]));
        }
        let scale = mesh.metric().scale;
        all.iter().map(|c| c.principal(scale)).collect()
    }

    /// The nodes along a curve, from its begin to its end.
    pub(super) fn along(&self, curve: &Curve) -> Vec<u32> {
        let mut nodes = vec![self.at_vertex(curve.vertices()[0])];
        for (w, edge) in curve.vertices().windows(2).zip(&self.curve_edges[curve.id().index()]) {
            let [a, b] = [w[0], w[1]].map(|v| self.at_vertex(v));
            if self.is_split[*edge as usize] {
                let middle = self.middle_of(*edge);
                self.push_inside(a, middle, &mut nodes);
                nodes.push(middle);
                self.push_inside(middle, b, &mut nodes);
            }
            nodes.push(b);
        }
        nodes
    }

    /// The nodes strictly between two nodes of an edge, in order. As deep as parts were halved: see
    /// [`super::refine`].
    fn push_inside(&self, a: u32, b: u32, nodes: &mut Vec<u32>) {
        if let Some(middle) = self.middle(a, b) {
            self.push_inside(a, middle, nodes);
            nodes.push(middle);
            self.push_inside(middle, b, nodes);
        }
    }
}

/// Per vertex of the surface, the first one that is a copy of the same welded vertex.
fn first_copies(mesh: &SurfaceMesh) -> Vec<u32> {
    let welded = |v: usize| mesh.welded_vertex(VertexId::at(v));
    let count = mesh.points().len();
    let highest = (0..count).map(welded).max().map_or(0, |w| w as usize + 1);
    let mut first = vec![u32::MAX; highest];
    for v in 0..count {
        let slot = &mut first[welded(v) as usize];
        *slot = (*slot).min(v as u32);
    }
    (0..count).map(|v| first[welded(v) as usize]).collect()
}
