//! Regions of a chart: rings around triangles, and what may move inside.

use super::penalty::Bound;
use super::problem::ArcCell;
use crate::map::filled::FilledChart;
use crate::topology::union_find::UnionFind;
use crate::topology::{FaceId, HalfEdgeId, Stars, VertexId};

/// Triangles around seeds, grouped into parts that share no vertex.
pub(super) struct Patches {
    /// The triangles of each part, ascending.
    pub parts: Vec<Vec<FaceId>>,
    /// Per vertex of the chart, how many rings away from the seeds it lies; the number of rings at the rim and beyond.
    pub distance: Vec<u32>,
}

/// The triangles within `rings` rings of the seeds. Rings grow through vertices of the chart, not through the
/// centres of fans.
pub(super) fn patches(chart: &FilledChart, stars: &Stars, seeds: &[FaceId], rings: usize) -> Patches {
    let mut inside = vec![false; chart.triangles().len()];
    let mut distance = vec![rings as u32; chart.chart_vertices()];
    let mut front: Vec<FaceId> = seeds.to_vec();
    seeds.iter().for_each(|f| inside[f.index()] = true);
    let mut all = front.clone();
    let own = chart.chart_vertices();
    for ring in 0..rings as u32 {
        let mut next = Vec::new();
        let vertices = front.iter().flat_map(|f| chart.triangles()[f.index()]).filter(|v| v.index() < own);
        for v in vertices {
            if distance[v.index()] == rings as u32 {
                distance[v.index()] = ring;
                let new = faces_around(stars, v).filter(|f| !std::mem::replace(&mut inside[f.index()], true));
                next.extend(new);
            }
        }
        all.extend(&next);
        front = next;
    }
    all.sort_unstable();
    all.dedup();
    Patches { parts: components(chart, all), distance }
}

/// The triangles at a vertex.
fn faces_around(stars: &Stars, v: VertexId) -> impl Iterator<Item = FaceId> {
    stars.around(v.index()).iter().map(|f| FaceId(*f))
}

/// Triangles grouped into parts that share no vertex.
fn components(chart: &FilledChart, faces: Vec<FaceId>) -> Vec<Vec<FaceId>> {
    let mut sets = UnionFind::new(chart.vertex_count());
    for f in &faces {
        let [a, b, c] = chart.triangles()[f.index()].map(|v| v.index());
        sets.merge(a, b);
        sets.merge(b, c);
    }
    let mut keyed: Vec<(usize, FaceId)> =
        faces.iter().map(|f| (sets.find(chart.triangles()[f.index()][0].index()), *f)).collect();
    keyed.sort_unstable();
    keyed.chunk_by(|a, b| a.0 == b.0).map(|part| part.iter().map(|k| k.1).collect()).collect()
}

/// The nodes that may move when only `faces` (ascending) may change: all of their triangles are among them, and
/// they are not `fixed`.
pub(super) fn free_nodes(chart: &FilledChart, stars: &Stars, fixed: &[bool], faces: &[FaceId]) -> Vec<u32> {
    let among = |f: FaceId| faces.binary_search(&f).is_ok();
    let mut free = Vec::new();
    for &f in faces {
        let nodes = chart.nodes(f.index());
        for (k, v) in chart.triangles()[f.index()].iter().enumerate() {
            let h = HalfEdgeId::side_of(f, k);
            let sides = chart.edges().sides(chart.edges().edge(h));
            if !fixed[nodes[3 + k]] && sides.iter().all(|s| among(s.face())) {
                free.push(nodes[3 + k] as u32);
            }
            if !fixed[nodes[k]] && faces_around(stars, *v).all(among) {
                free.push(nodes[k] as u32);
            }
        }
    }
    free.sort_unstable();
    free.dedup();
    free
}

/// The arcs of all holes whose half-edges `wanted` picks, with their star centres, all with the bound `unset`.
pub(super) fn arc_cells(chart: &FilledChart, wanted: impl Fn(HalfEdgeId) -> bool, unset: Bound) -> Vec<ArcCell> {
    let cell = |k: usize, h: HalfEdgeId| {
        let [from, to] = chart.ends(h).map(|v| chart.vertex_node(v) as u32);
        let centre = (chart.node_count() + k) as u32;
        ArcCell { nodes: [from, chart.mid_node(h) as u32, to, centre], bounds: [unset; 3] }
    };
    let holes = chart.loops().iter().enumerate();
    holes
        .flat_map(|(k, l)| l.iter().map(move |h| (k, *h)))
        .filter(|(_, h)| wanted(*h))
        .map(|(k, h)| cell(k, h))
        .collect()
}
