//! What can be predicted of charts whose seams do not follow the cells any more: the area ratio of each, and which of
//! its loops had better be the outer one.
//!
//! A tube that is open at both ends can be mapped from either; but where three tubes meet, or a tube widens, the choice
//! decides. The cells are cut along the seams for this.

use super::complex::Complex;
use super::network::Network;
use super::predict::{CellGraph, WORK_PER_CELL, predict};
use super::regions::Regions;
use super::voronoi::Cells;
use crate::atlas::Atlas;
use crate::monitor::Interrupted;
use crate::topology::HalfEdgeId;

/// The prediction for a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Prediction {
    pub ratio: f64,
    /// A half-edge of the loop that had better be the outer one.
    pub outer: HalfEdgeId,
}

/// The prediction for every label that is `wanted`; none for others, and for labels without triangles.
///
/// # Errors
/// [`Interrupted`].
pub(super) fn evaluate(
    network: &Network,
    cells: &Cells,
    wanted: &[bool],
) -> Result<Vec<Option<Prediction>>, Interrupted> {
    network.dual.checkpoint()?;
    let mut predictions = vec![None; network.label_count()];
    let labels: Vec<u32> = (0..network.label_count() as u32).filter(|label| wanted[*label as usize]).collect();
    if labels.is_empty() {
        return Ok(predictions);
    }
    let Cut { cells: cut, labels: of_pieces } = cut(network, cells, &network.with_neighbours(wanted));
    let complex = Complex::new(network.dual, &cut);
    let graph = CellGraph::new(&complex, network.limits.boundary);
    let mut regions = Regions::new(&complex, of_pieces, network.label_count() + 1);
    for label in labels {
        network.dual.checkpoint.after(WORK_PER_CELL * regions.all[label as usize].cells.len())?;
        let outline = regions.outline_of(label);
        let map = predict(&complex, &graph, &regions.all[label as usize].cells, &outline.loops);
        let first_arc = outline.loops.get(map.outer).and_then(|l| l.first());
        let outer = first_arc.map(|arc| complex.arcs[*arc as usize].first);
        predictions[label as usize] = outer.map(|outer| Prediction { ratio: map.area_ratio, outer });
    }
    Ok(predictions)
}

/// The pieces into which labels cut the cells, and the label of each.
struct Cut {
    cells: Cells,
    labels: Vec<u32>,
}

/// Cells are cut by labels; whatever has one that `is_cut` tells not to is one piece, of a label that there is not: it costs no more
/// than its boundary.
fn cut(network: &Network, cells: &Cells, is_cut: &[bool]) -> Cut {
    let mut labels = vec![network.label_count() as u32];
    // Per cell its labels with their pieces: mostly one, and hardly ever more than three.
    let mut known: Vec<Vec<(u32, u32)>> = vec![Vec::new(); cells.len];
    let mut piece = |(cell, label): (&u32, &u32)| {
        if !is_cut[*label as usize] {
            return 0;
        }
        let known = &mut known[*cell as usize];
        if let Some((_, piece)) = known.iter().find(|k| k.0 == *label) {
            return *piece;
        }
        labels.push(*label);
        known.push((*label, labels.len() as u32 - 1));
        labels.len() as u32 - 1
    };
    let of = cells.labels.iter().zip(&network.labels).map(&mut piece).collect();
    Cut { cells: Cells { labels: of, len: labels.len() }, labels }
}

/// Makes the predicted loops the outer ones.
pub(super) fn choose_outer(atlas: &mut Atlas, predictions: &[Option<Prediction>]) {
    let mut outer: Vec<HalfEdgeId> = predictions.iter().flatten().map(|v| v.outer).collect();
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
