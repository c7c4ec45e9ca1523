//! Which loop of a chart becomes the circle.
//!
//! A tube that is open at both ends can be mapped from either, and its area ratio is the same; but where three tubes
//! meet, or a tube widens, the choice decides. It is made by the predicted area ratio, on cells of the chart itself.

use super::dual::Dual;
use super::predict::{CellGraph, area_ratio};
use super::voronoi::Cells;
use crate::atlas::{Atlas, Chart};
use crate::id::HalfEdgeId;

/// Chooses the outer loop of every chart; `cells` are those of the surface, cut here along the seams.
pub(super) fn choose_outer(atlas: &mut Atlas, dual: &Dual, cells: &Cells) {
    if atlas.charts.iter().all(|c| c.holes.is_empty()) {
        return;
    }
    let mut of: Vec<u32> = vec![0; cells.of.len()];
    let charts = atlas.charts.len() as u64;
    let mut pieces: Vec<u64> = vec![0; cells.of.len()];
    for chart in &atlas.charts {
        for face in &chart.faces {
            pieces[face.index()] = u64::from(cells.of[face.index()]) * charts + chart.id.0 as u64;
        }
    }
    let mut sorted = pieces.clone();
    sorted.sort_unstable();
    sorted.dedup();
    of.iter_mut().zip(&pieces).for_each(|(o, p)| *o = sorted.partition_point(|q| q < p) as u32);
    let pieces = Cells { of, count: sorted.len() };
    let graph = CellGraph::new(dual, &pieces);
    for chart in atlas.charts.iter_mut().filter(|c| !c.holes.is_empty()) {
        let own: Vec<u32> =
            (0..sorted.len()).filter(|p| sorted[*p] % charts == chart.id.0 as u64).map(|p| p as u32).collect();
        choose(chart, dual, &pieces, &graph, &own);
    }
}

fn choose(chart: &mut Chart, dual: &Dual, pieces: &Cells, graph: &CellGraph, own: &[u32]) {
    let on_surface = |h: &HalfEdgeId| HalfEdgeId::side_of(chart.faces[h.face().index()], h.side());
    let all = std::iter::once(&chart.outer).chain(&chart.holes);
    let loops: Vec<Vec<HalfEdgeId>> = all.map(|l| l.iter().map(on_surface).collect()).collect();
    let (_, best) = area_ratio(dual, &pieces.of, graph, own, &loops);
    if best > 0 {
        std::mem::swap(&mut chart.outer, &mut chart.holes[best - 1]);
    }
}
