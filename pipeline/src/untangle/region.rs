//! Regions of a chart: rings around triangles, and what may move inside.

use super::bound::Bound;
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
    let rings = rings as u32;
    let is_of_chart = |v: &VertexId| v.index() < chart.chart_vertices();
    let mut is_inside = vec![false; chart.triangles().len()];
    for f in seeds {
        is_inside[f.index()] = true;
    }
    // So it stays where no ring comes: at the rim and beyond.
    let mut distance = vec![rings; chart.chart_vertices()];
    let mut front: Vec<FaceId> = seeds.to_vec();
    let mut all = front.clone();
    for ring in 0..rings {
        let mut next = Vec::new();
        for v in front.iter().flat_map(|f| chart.triangles()[f.index()]).filter(is_of_chart) {
            if distance[v.index()] < rings {
                continue;
            }
            distance[v.index()] = ring;
            for f in faces_around(stars, v) {
                if !is_inside[f.index()] {
                    is_inside[f.index()] = true;
                    next.push(f);
                }
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
    let mut part_of = |f: FaceId| sets.find(chart.triangles()[f.index()][0].index());
    let mut keyed: Vec<(usize, FaceId)> = faces.iter().map(|f| (part_of(*f), *f)).collect();
    keyed.sort_unstable();
    let parts = keyed.chunk_by(|a, b| a.0 == b.0);
    parts.map(|part| part.iter().map(|(_, face)| *face).collect()).collect()
}

/// The nodes that may move when only `faces` (ascending) may change: all of their triangles are among them, and
/// they are not `fixed`.
pub(super) fn free_nodes(chart: &FilledChart, stars: &Stars, fixed: &[bool], faces: &[FaceId]) -> Vec<u32> {
    let is_among = |f: FaceId| faces.binary_search(&f).is_ok();
    let mut free = Vec::new();
    for &f in faces {
        let nodes = chart.nodes(f.index());
        for (k, v) in chart.triangles()[f.index()].iter().enumerate() {
            let (at_vertex, at_middle) = (nodes[k], nodes[3 + k]);
            let h = HalfEdgeId::side_of(f, k);
            let sides = chart.edges().sides(chart.edges().edge(h));
            if !fixed[at_middle] && sides.iter().all(|s| is_among(s.face())) {
                free.push(at_middle as u32);
            }
            if !fixed[at_vertex] && faces_around(stars, *v).all(is_among) {
                free.push(at_vertex as u32);
            }
        }
    }
    // Triangles share their nodes.
    free.sort_unstable();
    free.dedup();
    free
}

/// The node at the star centre of a hole: these are numbered after all nodes of the chart.
pub(super) fn star_centre(chart: &FilledChart, hole: usize) -> u32 {
    (chart.node_count() + hole) as u32
}

/// All arcs of `holes`, with their star centres, all with the bound `unset`.
pub(super) fn arc_cells(chart: &FilledChart, holes: &[usize], unset: Bound) -> Vec<ArcCell> {
    let mut cells = Vec::new();
    for k in holes {
        let centre = star_centre(chart, *k);
        for h in chart.loops()[*k].iter().copied() {
            let [from, to] = chart.ends(h).map(|v| chart.vertex_node(v) as u32);
            let nodes = [from, chart.mid_node(h) as u32, to, centre];
            cells.push(ArcCell { nodes, bounds: [unset; 3] });
        }
    }
    cells
}
