//! A chart with its holes filled by virtual fans, or left open, and the nodes of its quadratic elements.
//!
//! Every hole gets a virtual vertex, joined to the loop by isosceles triangles with legs r = max(P / 2 pi,
//! l_max / sqrt 3) (P the perimeter, l_max the longest edge), so that every triangle inequality holds. The fans
//! take part in the linear and quadratic solves, which keeps holes round and most triangles valid; they are no
//! part of the result.

use super::elimination;
use super::nodes::Nodes;
use crate::atlas::Chart;
use crate::fem::element::{Barycentric, Element, P2};
use crate::fem::geometry::FirstForm;
use crate::fem::quadrature::Rule;
use crate::fem::stiffness::{Triangles, stiffness_by_quadrature};
use crate::mesh::TriangleShape;
use crate::topology::EdgeTable;
use crate::topology::{HalfEdgeId, VertexId};
use crate::vec3::Vec3;
use std::f64::consts::TAU;

/// A chart whose holes are filled ([`Self::new`]), or left open: its own triangles first, then the fans.
///
/// Vertices: those of the chart, then one centre per hole. Nodes of the quadratic elements: vertices of the chart
/// `0..V`, mid-edge nodes of the chart `V..N`, centres, mid-edge nodes of the spokes.
///
/// # Example
///
/// A plate with two square holes: each gets a fan of four triangles around a centre.
///
/// ```
/// use planish_core::map::filled::FilledChart;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::disk_with_holes(13, 2), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// assert_eq!(chart.loops().len(), 2);
/// assert_eq!(chart.triangles().len() - chart.chart_triangles(), 2 * 4);
/// // Two centres, and four spokes to each: no node of these is part of the result.
/// assert_eq!(chart.node_count() - chart.chart_nodes(), 2 + 2 * 4);
/// assert_eq!(chart.centre_node(0), chart.chart_nodes());
/// // The nodes of a triangle: vertices, then the middles of its edges.
/// assert!(chart.nodes(0)[..3].iter().all(|n| *n < chart.chart_vertices()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct FilledChart {
    triangles: Vec<[VertexId; 3]>,
    shapes: Vec<TriangleShape>,
    edges: EdgeTable,
    chart_triangles: usize,
    chart_vertices: usize,
    chart_edges: usize,
    holes: usize,
    outer: Vec<HalfEdgeId>,
    loops: Vec<Vec<HalfEdgeId>>,
    elimination: Vec<VertexId>,
    /// The nodes in space of the chart's triangles, where these are curved; empty where they are flat.
    curved: Vec<[Vec3; 6]>,
}

impl FilledChart {
    /// Fills the holes of `chart`.
    pub fn new(chart: &Chart) -> Self {
        let chart_vertices = chart.vertices().len();
        let mut triangles = chart.triangles().to_vec();
        let mut shapes = chart.shapes().to_vec();
        for (k, hole) in chart.holes().iter().enumerate() {
            let centre = VertexId::at(chart_vertices + k);
            let lengths: Vec<f64> = hole.iter().map(|h| chart.length(*h)).collect();
            let longest = lengths.iter().fold(0.0_f64, |m, l| m.max(*l));
            let perimeter = lengths.iter().sum::<f64>();
            // The radius of a circle of this perimeter. Legs are longer than half of the longest side by a margin.
            let leg = (perimeter / TAU).max(longest / 3.0_f64.sqrt());
            for (h, length) in hole.iter().zip(&lengths) {
                // The other way round: the fan lies on the other side of the loop.
                let [from, to] = ends(&triangles, *h);
                triangles.push([to, from, centre]);
                shapes.push(TriangleShape { lengths: [*length, leg, leg] });
            }
        }
        let vertices = chart_vertices + chart.holes().len();
        Self {
            elimination: elimination::of_vertices(&triangles, vertices, chart.outer()),
            edges: if chart.holes().is_empty() { chart.edges().clone() } else { EdgeTable::new(&triangles) },
            triangles,
            shapes,
            chart_triangles: chart.triangles().len(),
            chart_vertices,
            chart_edges: chart.edges().len(),
            holes: chart.holes().len(),
            outer: chart.outer().to_vec(),
            loops: chart.holes().to_vec(),
            curved: Vec::new(),
        }
    }

    /// The chart as it is: holes stay open, and what is prescribed is prescribed along all loops, that of the outer one
    /// first.
    pub fn open(chart: &Chart) -> Self {
        let outer: Vec<HalfEdgeId> = chart.boundary().collect();
        let chart_vertices = chart.vertices().len();
        Self {
            elimination: elimination::of_vertices(chart.triangles(), chart_vertices, &outer),
            edges: chart.edges().clone(),
            triangles: chart.triangles().to_vec(),
            shapes: chart.shapes().to_vec(),
            chart_triangles: chart.triangles().len(),
            chart_vertices,
            chart_edges: chart.edges().len(),
            holes: 0,
            outer,
            loops: vec![],
            curved: Vec::new(),
        }
    }

    /// The same with the triangles of the chart curved through six nodes each (as [`P2`] orders them), in the unit of the
    /// shapes: what energies see of the surface. Fans stay flat; the flat shapes of the corners still decide where the
    /// boundary goes, and how the linear map weighs its edges.
    ///
    /// # Panics
    /// If there are not as many as triangles of the chart.
    pub fn with_curved_triangles(mut self, nodes: Vec<[Vec3; 6]>) -> Self {
        assert_eq!(nodes.len(), self.chart_triangles, "the nodes of every triangle");
        self.curved = nodes;
        self
    }

    /// All triangles, those of the fans last.
    pub fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// The shape of every triangle.
    pub fn shapes(&self) -> &[TriangleShape] {
        &self.shapes
    }

    /// All edges; those of the chart have the numbers they have there.
    pub fn edges(&self) -> &EdgeTable {
        &self.edges
    }

    /// How many of the triangles belong to the chart.
    pub fn chart_triangles(&self) -> usize {
        self.chart_triangles
    }

    /// How many of the vertices belong to the chart.
    pub fn chart_vertices(&self) -> usize {
        self.chart_vertices
    }

    /// How many of the edges belong to the chart.
    pub fn chart_edges(&self) -> usize {
        self.chart_edges
    }

    /// The nodes of quadratic elements.
    pub(crate) fn quadratic_nodes(&self) -> Nodes<'_, P2, 6> {
        Nodes::on(self)
    }

    /// How many of the nodes belong to the chart: its vertices and its edges.
    pub fn chart_nodes(&self) -> usize {
        self.quadratic_nodes().of_chart()
    }

    /// The number of vertices, centres of fans included.
    pub fn vertex_count(&self) -> usize {
        self.chart_vertices + self.holes
    }

    /// The number of nodes, those of the fans included.
    pub fn node_count(&self) -> usize {
        self.quadratic_nodes().count()
    }

    /// The half-edges along which the map is prescribed, with the chart on their left: the outer loop, and those of holes
    /// that are open.
    pub fn outer(&self) -> &[HalfEdgeId] {
        &self.outer
    }

    /// The loops around the holes that are filled, with the chart on their left.
    pub fn loops(&self) -> &[Vec<HalfEdgeId>] {
        &self.loops
    }

    /// The vertices that are not on the outer loop, in an order in which to eliminate them from a system: one that
    /// keeps its factor small.
    pub fn elimination(&self) -> &[VertexId] {
        &self.elimination
    }

    /// The node at a vertex.
    pub fn vertex_node(&self, v: VertexId) -> usize {
        self.quadratic_nodes().at_vertex(v)
    }

    /// Per node, whether it lies on the outer loop, where nothing moves.
    pub fn outer_nodes(&self) -> Vec<bool> {
        self.quadratic_nodes().is_outer()
    }

    /// The node at the centre of hole `k`.
    pub fn centre_node(&self, k: usize) -> usize {
        self.chart_nodes() + k
    }

    /// The node in the middle of the edge along `h`.
    pub fn mid_node(&self, h: HalfEdgeId) -> usize {
        self.quadratic_nodes().along(h, 0)
    }

    /// The six nodes of a triangle: vertices, then the middles of the edges 01, 12, 20.
    pub fn nodes(&self, face: usize) -> [usize; 6] {
        self.quadratic_nodes().of(face)
    }

    /// The vertices at both ends of `h`.
    pub fn ends(&self, h: HalfEdgeId) -> [VertexId; 2] {
        ends(&self.triangles, h)
    }
}

/// The degree of the rule by which curved triangles are integrated: the integrand is rational there. For P2 it is 6, by
/// which the entries of a triangle of the unit cylinder, 0.8 long, are off by less than 1e-5.
fn degree_on_curved(order: u32) -> u32 {
    2 * order + 2
}

impl Triangles for FilledChart {
    fn stiffness<E: Element<N>, const N: usize>(&self, face: usize) -> [[f64; N]; N] {
        match self.curved.get(face) {
            None => E::stiffness(&self.shapes[face]),
            Some(_) => {
                let metric = |l| self.metric(face, l);
                stiffness_by_quadrature::<E, N>(metric, Rule::of_degree(degree_on_curved(E::ORDER)))
            }
        }
    }

    fn metric(&self, face: usize, l: Barycentric) -> FirstForm {
        match self.curved.get(face) {
            None => FirstForm::flat(&self.shapes[face]),
            Some(nodes) => FirstForm::of_nodes::<P2, 6>(nodes, l),
        }
    }
}

fn ends(triangles: &[[VertexId; 3]], h: HalfEdgeId) -> [VertexId; 2] {
    let t = triangles[h.face().index()];
    [t[h.side()], t[(h.side() + 1) % 3]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decompose, repair, shapes};

    #[test]
    fn fans_close_every_hole_and_nodes_are_numbered_once() {
        let mesh = repair(&shapes::disk_with_holes(13, 2), &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
        let chart = &atlas.charts()[0];
        let closed = FilledChart::new(chart);
        let chi = closed.vertex_count() as i64 - closed.edges().len() as i64 + closed.triangles().len() as i64;
        assert_eq!(chi, 1, "a disk");
        let mut seen = vec![false; closed.node_count()];
        for f in 0..closed.triangles().len() {
            closed.nodes(f).into_iter().for_each(|n| seen[n] = true);
            let own = f < closed.chart_triangles();
            assert!(!own || closed.nodes(f).iter().all(|n| *n < closed.chart_nodes()));
        }
        assert!(seen.iter().all(|s| *s));
        for h in (0..3 * closed.chart_triangles()).map(HalfEdgeId::at) {
            assert_eq!(closed.edges().edge(h), chart.edges().edge(h));
        }
        assert!(closed.shapes().iter().all(|s| s.slack() > 0.0));
    }
}
