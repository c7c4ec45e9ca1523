//! From labels to charts: every set of equally labelled triangles becomes a chart, if it can be one.

use super::legality::{self, Illegal};
use crate::atlas::{Atlas, Chart};
use crate::id::{ChartId, FaceId, HalfEdgeId, VertexId};
use crate::mesh::{EdgeTable, SurfaceMesh};

/// The atlas in which the triangles of equal label form a chart. Charts are numbered in the order of their first
/// triangles, whatever the labels.
///
/// # Errors
/// [`Illegal`], for the first chart that is no disk with or without holes.
pub fn assemble(mesh: &SurfaceMesh, labels: &[u32]) -> Result<Atlas, Illegal> {
    let sets = by_label(labels);
    let charts = sets.into_iter().zip(0..).map(|(faces, id)| chart(mesh, ChartId(id), faces));
    Ok(Atlas { charts: charts.collect::<Result<_, _>>()?, feature_edges: 0 })
}

/// The faces of each label, ascending; labels in the order of their first faces.
pub(super) fn by_label(labels: &[u32]) -> Vec<Vec<FaceId>> {
    let highest = labels.iter().max().map_or(0, |l| *l as usize + 1);
    let mut number = vec![u32::MAX; highest];
    let mut sets: Vec<Vec<FaceId>> = Vec::new();
    for (face, label) in labels.iter().enumerate() {
        let slot = &mut number[*label as usize];
        if *slot == u32::MAX {
            *slot = sets.len() as u32;
            sets.push(Vec::new());
        }
        sets[*slot as usize].push(FaceId::at(face));
    }
    sets
}

/// The chart of `faces`, ascending.
///
/// # Errors
/// [`Illegal`] where they form none.
pub(super) fn chart(mesh: &SurfaceMesh, id: ChartId, faces: Vec<FaceId>) -> Result<Chart, Illegal> {
    let mut vertices: Vec<VertexId> = faces.iter().flat_map(|f| mesh.triangles()[f.index()]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let local = |v: VertexId| VertexId::at(vertices.partition_point(|u| *u < v));
    let triangles: Vec<_> = faces.iter().map(|f| mesh.triangles()[f.index()].map(local)).collect();
    let edges = EdgeTable::new(&triangles);
    legality::verify(id, &triangles, &edges, vertices.len())?;
    let shapes = faces.iter().map(|f| mesh.metric().shapes[f.index()]).collect();
    let flagged = faces.iter().map(|f| mesh.metric().flagged[f.index()]).collect();
    let mut loops = boundary_loops(&triangles, &edges, vertices.len());
    let scale = mesh.metric().scale;
    let mut chart =
        Chart { id, vertices, faces, triangles, shapes, flagged, scale, edges, outer: vec![], holes: vec![] };
    let length = |l: &[HalfEdgeId]| l.iter().map(|h| chart.length(*h)).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(|l| length(l)).collect();
    let longest = (0..loops.len()).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
    chart.outer = loops.remove(longest);
    chart.holes = loops;
    Ok(chart)
}

/// The boundary loops, each from its least half-edge on, in the order of these. Every boundary vertex has one
/// boundary half-edge out and one in, so following them returns to the start.
fn boundary_loops(triangles: &[[VertexId; 3]], edges: &EdgeTable, vertices: usize) -> Vec<Vec<HalfEdgeId>> {
    let from = |h: HalfEdgeId| triangles[h.face().index()][h.side()];
    let to = |h: HalfEdgeId| triangles[h.face().index()][h.next().side()];
    let boundary: Vec<HalfEdgeId> =
        (0..3 * triangles.len()).map(HalfEdgeId::at).filter(|h| edges.is_boundary(*h)).collect();
    let mut out: Vec<Option<HalfEdgeId>> = vec![None; vertices];
    boundary.iter().for_each(|h| out[from(*h).index()] = Some(*h));
    let mut loops = Vec::new();
    for start in boundary {
        let mut turn = Vec::new();
        let mut at = from(start);
        // Taking the half-edge away ends the walk: each is visited once.
        while let Some(h) = out[at.index()].take() {
            turn.push(h);
            at = to(h);
        }
        if !turn.is_empty() {
            loops.push(turn);
        }
    }
    loops
}
