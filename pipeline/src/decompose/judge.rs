//! What can be foretold of charts whose seams do not follow the cells any more: the area ratio of each, and which of
//! its loops had better be the outer one.
//!
//! A tube that is open at both ends can be mapped from either; but where three tubes meet, or a tube widens, the choice
//! decides. The cells are cut along the seams for this.

use super::network::Network;
use super::predict::{CellGraph, area_ratio};
use super::voronoi::Cells;
use crate::atlas::Atlas;
use crate::id::HalfEdgeId;

/// The prediction for a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdict {
    pub ratio: f64,
    /// A half-edge of the loop that had better be the outer one.
    pub outer: HalfEdgeId,
}

/// The prediction for every label (none for labels without triangles).
pub(super) fn judge(network: &mut Network, cells: &Cells) -> Vec<Option<Verdict>> {
    let charts = network.label_count();
    let key = |f: usize| u64::from(network.labels[f]) << 32 | u64::from(cells.of[f]);
    let mut pieces: Vec<u64> = (0..cells.of.len()).map(key).collect();
    pieces.sort_unstable();
    pieces.dedup();
    let of = (0..cells.of.len()).map(|f| pieces.partition_point(|p| *p < key(f)) as u32).collect();
    let cut = Cells { of, count: pieces.len() };
    let graph = CellGraph::new(network.dual, &cut);
    let dual = network.dual;
    let verdict = |label: usize| {
        let first = pieces.partition_point(|p| (*p >> 32) < label as u64) as u32;
        let last = pieces.partition_point(|p| (*p >> 32) <= label as u64) as u32;
        let own: Vec<u32> = (first..last).collect();
        let loops = network.loops(label as u32);
        let (ratio, outer) = area_ratio(dual, &cut.of, &graph, &own, &loops);
        Some(Verdict { ratio, outer: *loops.get(outer)?.first()? })
    };
    (0..charts).map(verdict).collect()
}

/// Makes the predicted loops the outer ones.
pub(super) fn choose_outer(atlas: &mut Atlas, verdicts: &[Option<Verdict>]) {
    let mut outer: Vec<HalfEdgeId> = verdicts.iter().flatten().map(|v| v.outer).collect();
    outer.sort_unstable();
    for chart in atlas.charts.iter_mut() {
        let faces = &chart.faces;
        let chosen =
            |h: &HalfEdgeId| outer.binary_search(&HalfEdgeId::side_of(faces[h.face().index()], h.side())).is_ok();
        if let Some(hole) = chart.holes.iter().position(|l| l.iter().any(chosen)) {
            std::mem::swap(&mut chart.outer, &mut chart.holes[hole]);
        }
    }
}
