//! What a chart must be: connected, oriented, of genus 0, with simple boundary loops that share no vertex.

use crate::topology::{ChartId, EdgeId, HalfEdgeId, VertexId};
use crate::topology::{EdgeTable, count_components};

/// Why a set of triangles is no chart.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Illegal {
    /// It falls apart (or is empty).
    #[error("chart {chart} has {parts} parts")]
    Apart {
        /// The chart.
        chart: ChartId,
        /// Its parts, connected through edges.
        parts: usize,
    },
    /// An edge with three or more triangles, or with two that disagree about its direction.
    #[error("chart {chart} is not an oriented surface at edge {edge}")]
    Edge {
        /// The chart.
        chart: ChartId,
        /// The edge, numbered within the chart.
        edge: EdgeId,
    },
    /// A vertex that the boundary visits twice.
    #[error("the boundary of chart {chart} meets itself at vertex {vertex}")]
    Pinched {
        /// The chart.
        chart: ChartId,
        /// The vertex, numbered within the chart.
        vertex: VertexId,
    },
    /// No disk, with or without holes.
    #[error("chart {chart} has {loops} boundary loops and Euler number {euler}: it is no disk with or without holes")]
    Topology {
        /// The chart.
        chart: ChartId,
        /// Its boundary loops.
        loops: usize,
        /// vertices - edges + triangles.
        euler: i64,
    },
}

/// Decides whether `triangles` of `vertices` vertices, all of them in use, form a chart.
///
/// # Errors
/// [`Illegal`], with the evidence.
pub fn verify(chart: ChartId, triangles: &[[VertexId; 3]], edges: &EdgeTable, vertices: usize) -> Result<(), Illegal> {
    let from = |h: HalfEdgeId| triangles[h.face().index()][h.side()];
    let to = |h: HalfEdgeId| triangles[h.face().index()][h.next().side()];
    let sound = |sides: &[HalfEdgeId]| match *sides {
        [_] => true,
        [g, h] => from(g) == to(h),
        _ => false,
    };
    if let Some((edge, _)) = edges.iter().find(|(_, sides)| !sound(sides)) {
        return Err(Illegal::Edge { chart, edge });
    }
    let parts = count_components(triangles.len(), edges);
    if parts != 1 {
        return Err(Illegal::Apart { chart, parts });
    }
    let mut next: Vec<Option<VertexId>> = vec![None; vertices];
    for h in edges.iter().filter(|(_, sides)| sides.len() == 1).map(|(_, sides)| sides[0]) {
        if next[from(h).index()].replace(to(h)).is_some() {
            return Err(Illegal::Pinched { chart, vertex: from(h) });
        }
    }
    if let Some(vertex) = touched(triangles, edges, vertices) {
        return Err(Illegal::Pinched { chart, vertex });
    }
    let loops = cycles(&next);
    let euler = vertices as i64 - edges.len() as i64 + triangles.len() as i64;
    if loops == 0 || euler + loops as i64 != 2 {
        return Err(Illegal::Topology { chart, loops, euler });
    }
    Ok(())
}

/// A vertex at which sheets touch that share no edge there: more umbrellas than the boundary half-edges out of it
/// account for.
fn touched(triangles: &[[VertexId; 3]], edges: &EdgeTable, vertices: usize) -> Option<VertexId> {
    let umbrellas = crate::topology::Umbrellas::new(triangles, edges);
    let mut seen = vec![false; vertices];
    umbrellas.vertices(triangles).into_iter().find(|v| std::mem::replace(&mut seen[v.index()], true))
}

/// The number of cycles of the boundary. Every step takes a vertex away, so it ends.
fn cycles(next: &[Option<VertexId>]) -> usize {
    let mut left = next.to_vec();
    let mut count = 0;
    for start in 0..left.len() {
        let mut at = left[start].take();
        count += usize::from(at.is_some());
        while let Some(v) = at {
            at = left[v.index()].take();
        }
    }
    count
}
