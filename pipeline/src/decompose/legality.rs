//! What a chart must be: connected, oriented, of genus 0, with simple boundary loops that share no vertex.

use crate::topology::loops::boundary_loops;
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

/// Decides whether `triangles` of `vertices` vertices, all of them in use, form a chart. Returns its boundary loops, each
/// from its least half-edge on, in the order of these.
///
/// # Errors
/// [`Illegal`], with the evidence.
pub fn verify(
    chart: ChartId,
    triangles: &[[VertexId; 3]],
    edges: &EdgeTable,
    vertices: usize,
) -> Result<Vec<Vec<HalfEdgeId>>, Illegal> {
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
    let pinched = |vertex: VertexId| Illegal::Pinched { chart, vertex };
    let boundary_loops = boundary_loops(triangles, edges, vertices).map_err(pinched)?;
    if let Some(vertex) = touched(triangles, edges, vertices) {
        return Err(pinched(vertex));
    }
    let loops = boundary_loops.len();
    let euler = vertices as i64 - edges.len() as i64 + triangles.len() as i64;
    // Euler number = 2 - 2 genus - loops.
    if loops == 0 || euler + loops as i64 != 2 {
        return Err(Illegal::Topology { chart, loops, euler });
    }
    Ok(boundary_loops)
}

/// A vertex at which sheets touch that share no edge there: more fans than the boundary half-edges out of it
/// account for.
fn touched(triangles: &[[VertexId; 3]], edges: &EdgeTable, vertices: usize) -> Option<VertexId> {
    let fans = crate::topology::VertexFans::new(triangles, edges);
    let mut seen = vec![false; vertices];
    fans.vertices(triangles).into_iter().find(|v| std::mem::replace(&mut seen[v.index()], true))
}
