//! Where the nodes of an element are on a chart, and how they are numbered.

use super::filled::FilledChart;
use crate::fem::element::{Barycentric, Element};
use crate::topology::{HalfEdgeId, VertexId};
use std::marker::PhantomData;

/// The nodes of element `E` on a filled chart: one at each vertex, and, from order 2 on, those along each edge and inside
/// each triangle.
///
/// First the nodes of the chart: its vertices, those along its edges, those inside its triangles. Then those of the fans:
/// their centres, those along the spokes, those inside.
///
/// # Example
///
/// ```
/// use planish_core::fem::element::{P1, P2};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::nodes::Nodes;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::flat_disk(1), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// // Seven vertices, twelve edges.
/// assert_eq!(Nodes::<P1, 3>::on(&chart).count(), 7);
/// assert_eq!(Nodes::<P2, 6>::on(&chart).count(), 7 + 12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Nodes<'a, E, const N: usize> {
    chart: &'a FilledChart,
    element: PhantomData<E>,
}

impl<'a, E: Element<N>, const N: usize> Nodes<'a, E, N> {
    /// Along each edge, its ends not counted.
    pub const PER_EDGE: usize = E::ORDER as usize - 1;

    /// Inside each triangle.
    pub const PER_TRIANGLE: usize = N - 3 - 3 * Self::PER_EDGE;

    /// The nodes on `chart`.
    pub fn on(chart: &'a FilledChart) -> Self {
        Self { chart, element: PhantomData }
    }

    /// How many belong to the chart, and not to the fans.
    pub fn of_chart(&self) -> usize {
        let chart = self.chart;
        let inside = chart.chart_triangles() * Self::PER_TRIANGLE;
        chart.chart_vertices() + chart.chart_edges() * Self::PER_EDGE + inside
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        let chart = self.chart;
        let inside = chart.triangles().len() * Self::PER_TRIANGLE;
        chart.vertex_count() + chart.edges().len() * Self::PER_EDGE + inside
    }

    /// The node at a vertex.
    pub fn at_vertex(&self, v: VertexId) -> usize {
        let chart_vertices = self.chart.chart_vertices();
        if v.index() < chart_vertices { v.index() } else { v.index() - chart_vertices + self.of_chart() }
    }

    /// Node `k` along `h`, counted from where `h` begins.
    pub fn along(&self, h: HalfEdgeId, k: usize) -> usize {
        let chart = self.chart;
        let edge = chart.edges().edge(h);
        // Both sides of an edge meet the same nodes, one of them the other way round.
        let is_reversed = Self::PER_EDGE > 1 && chart.edges().sides(edge)[0] != h;
        let k = if is_reversed { Self::PER_EDGE - 1 - k } else { k };
        let edges_before = edge.index();
        if edges_before < chart.chart_edges() {
            chart.chart_vertices() + edges_before * Self::PER_EDGE + k
        } else {
            let centres = chart.vertex_count() - chart.chart_vertices();
            self.of_chart() + centres + (edges_before - chart.chart_edges()) * Self::PER_EDGE + k
        }
    }

    /// Node `k` inside a triangle.
    pub fn inside(&self, face: usize, k: usize) -> usize {
        let chart = self.chart;
        if face < chart.chart_triangles() {
            let edges = chart.chart_edges() * Self::PER_EDGE;
            chart.chart_vertices() + edges + face * Self::PER_TRIANGLE + k
        } else {
            self.count() - (chart.triangles().len() - face) * Self::PER_TRIANGLE + k
        }
    }

    /// The nodes of a triangle, in the order of [`Element::NODES`].
    pub fn of(&self, face: usize) -> [usize; N] {
        let corners = self.chart.triangles()[face];
        std::array::from_fn(|n| match n {
            0..3 => self.at_vertex(corners[n]),
            _ if n < 3 + 3 * Self::PER_EDGE => {
                let side = (n - 3) / Self::PER_EDGE;
                self.along(HalfEdgeId::at(3 * face + side), (n - 3) % Self::PER_EDGE)
            }
            _ => self.inside(face, n - 3 - 3 * Self::PER_EDGE),
        })
    }

    /// The nodes of edge `i` of the outer loop, each with its share of the way along: the vertex it begins at, which has
    /// 0, then those on it.
    pub fn on_outer(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let h = self.chart.outer()[i];
        let [from, _] = self.chart.ends(h);
        // The nodes after the corners are those of edge 01, along which the second coordinate grows.
        let share = |k: usize| -> f64 {
            let l: Barycentric = E::NODES[3 + k];
            l[1]
        };
        let inner = (0..Self::PER_EDGE).map(move |k| (self.along(h, k), share(k)));
        std::iter::once((self.at_vertex(from), 0.0)).chain(inner)
    }

    /// Per node, whether it lies on the outer loop, where nothing moves.
    pub fn is_outer(&self) -> Vec<bool> {
        let mut is_outer = vec![false; self.count()];
        for i in 0..self.chart.outer().len() {
            self.on_outer(i).for_each(|(node, _)| is_outer[node] = true);
        }
        is_outer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::element::cubic::Cubic;
    use crate::fem::element::{P1, P2};
    use crate::{decompose, repair, shapes};

    /// That every node is met, by all triangles that have it in the same place, and which ones are the chart's.
    fn check<E: Element<N>, const N: usize>() {
        let mesh = repair(&shapes::disk_with_holes(13, 2), &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
        let chart = FilledChart::new(&atlas.charts()[0]);
        let nodes = Nodes::<E, N>::on(&chart);
        // A place for each vertex, so that nodes of edges have one, too. Those of the fans need not lie in the holes.
        let place = |v: VertexId| -> [f64; 2] {
            let v = v.index() as f64;
            [(1.7 * v).sin(), (2.3 * v).cos()]
        };
        let mut places: Vec<Option<[f64; 2]>> = vec![None; nodes.count()];
        for (f, corners) in chart.triangles().iter().enumerate() {
            let corners = corners.map(place);
            for (node, l) in nodes.of(f).into_iter().zip(E::NODES) {
                assert!(f >= chart.chart_triangles() || node < nodes.of_chart());
                let here = P1::interpolate(&corners, l);
                let before = *places[node].get_or_insert(here);
                assert!((before[0] - here[0]).hypot(before[1] - here[1]) < 1e-14, "node {node} lies in one place");
            }
        }
        assert!(places.iter().all(Option::is_some), "every number is used");
        let outer: usize = nodes.is_outer().iter().map(|outer| usize::from(*outer)).sum();
        assert_eq!(outer, E::ORDER as usize * chart.outer().len());
    }

    #[test]
    fn triangles_share_nodes_whatever_the_order() {
        check::<P1, 3>();
        check::<P2, 6>();
        check::<Cubic, 10>();
    }
}
