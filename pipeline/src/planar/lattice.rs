//! Where inside a chart the metric is told: at its vertices, and on a lattice of those triangles in which it changes.

use super::metric::{Field, Metric};
use crate::topology::{EdgeId, HalfEdgeId, VertexId};
use crate::vec3::distance;

/// A triangle is halved for every change of the metric by this, in the norm of logarithms: of sizes by a tenth.
const CHANGE: f64 = 0.2;

/// And no more often than so many times: the lattice of a triangle has sixteen steps.
const FINEST: u32 = 4;

/// So many steps of a lattice are as long as an edge that is asked for, at most: finer ones tell a mesher nothing.
const STEPS_PER_EDGE: f64 = 2.0;

/// A node inside a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    pub uv: [f64; 2],
    pub metric: Metric,
}

/// The nodes of all triangles, but those on the boundary of the chart.
pub(super) fn nodes(field: &Field) -> Vec<Node> {
    let chart = field.certified.chart();
    let mut is_inner = vec![true; chart.vertices().len()];
    chart.boundary().for_each(|h| is_inner[chart.from(h).index()] = false);
    let mut nodes = Vec::new();
    let uv = &field.certified.map().map().nodes;
    for v in (0..is_inner.len()).filter(|v| is_inner[*v]) {
        nodes.push(Node { uv: uv[v].uv(), metric: field.at_vertex(VertexId::at(v)) });
    }
    let steps: Vec<u32> = field.faces().map(|face| steps(field, face.0)).collect();
    for (edge, sides) in chart.edges().iter() {
        let most = sides.iter().map(|h| steps[h.face().index()]).max().unwrap_or(1);
        if sides.len() == 2 && most > 1 {
            on_edge(field, edge, sides[0], most, &mut nodes);
        }
    }
    for (face, steps) in (0..).zip(steps) {
        in_face(field, face, steps, &mut nodes);
    }
    nodes
}

/// In how many steps the lattice of a triangle goes along its sides: a power of two.
fn steps(field: &Field, face: u32) -> u32 {
    let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|l| field.inside(face, l));
    let middles = [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]].map(|l| field.inside(face, l));
    let mut change = 0.0_f64;
    for k in 0..3 {
        let next = (k + 1) % 3;
        let around =
            [middles[k].apart(&corners[k]), middles[k].apart(&corners[next]), middles[k].apart(&middles[next])];
        change = around.into_iter().fold(change, f64::max);
    }
    // Over half of a side; and no finer than edges will be.
    let halvings = (2.0 * change / CHANGE).min(STEPS_PER_EDGE * longest(field, face)).max(1.0).log2().ceil();
    1 << halvings.min(f64::from(FINEST)) as u32
}

/// The longest side of a triangle in space, in sizes at its corners.
fn longest(field: &Field, face: u32) -> f64 {
    let corners = field.certified.chart().corners(face as usize);
    let in_sizes = |k: usize| distance(corners[k], corners[(k + 1) % 3]) / field.size_at(corners[k]);
    (0..3).map(in_sizes).fold(0.0, f64::max)
}

fn on_edge(field: &Field, edge: EdgeId, h: HalfEdgeId, steps: u32, nodes: &mut Vec<Node>) {
    for step in 1..steps {
        let t = f64::from(step) / f64::from(steps);
        let weights = super::metric::on_side(h, t);
        nodes.push(Node { uv: field.map.uv_of(h.face().0, weights), metric: field.on_edge(edge, t) });
    }
}

fn in_face(field: &Field, face: u32, steps: u32, nodes: &mut Vec<Node>) {
    for i in 1..steps {
        for j in 1..steps - i {
            let weights = [i, j, steps - i - j].map(|k| f64::from(k) / f64::from(steps));
            nodes.push(Node { uv: field.map.uv_of(face, weights), metric: field.inside(face, weights) });
        }
    }
}
