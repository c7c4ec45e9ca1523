//! From labels to an atlas: straight seams, as far as the predicted area ratio allows, and well chosen outer loops.

use super::assemble::assemble;
use super::dual::Dual;
use super::judge::{Verdict, choose_outer, judge};
use super::merge::Limits;
use super::network::Network;
use super::straighten::straighten;
use super::voronoi::Cells;
use super::{Error, Settings};
use crate::atlas::Atlas;
use crate::id::HalfEdgeId;

/// How far seams may be straightened, in sizes of a cell: shortest loops would slide off at the end of a tube, and
/// seams along a tube come together. So the area ratio is foretold again after every step, and the last good one kept.
const BANDS: [f64; 4] = [0.5, 1.0, 1.5, 2.0];

/// How often a step is tried again with the seams held around the charts that it would distort too much.
const TRIES: usize = 3;

/// Straightens the seams between labels and makes the charts. `size` tells that of a cell.
pub(super) fn finish(
    dual: &Dual,
    labels: Vec<u32>,
    limits: Limits,
    settings: &Settings,
    cells: &Cells,
    size: impl Fn(HalfEdgeId) -> f64,
) -> Result<Atlas, Error> {
    let mut network = Network::new(dual, labels, limits);
    let mut verdicts = judge(&network, cells);
    for band in BANDS {
        let mut held = vec![false; network.label_count()];
        for _ in 0..TRIES {
            let mut straight = Network::new(dual, network.labels.clone(), limits);
            let holds = |h: HalfEdgeId| held[network.labels[h.face().index()] as usize];
            let free = |h: HalfEdgeId| !holds(h) && !dual.across(h).is_some_and(holds);
            straighten(&mut straight, |h| if free(h) { band * size(h) } else { 0.0 });
            let found = judge(&straight, cells);
            let ratio = |v: &Option<Verdict>| v.map_or(1.0, |v| v.ratio);
            let worse = |label: usize| ratio(&found[label]) > settings.max_area_ratio.max(ratio(&verdicts[label]));
            let bad: Vec<usize> = (0..held.len()).filter(|l| worse(*l)).collect();
            if bad.is_empty() && straight.is_sound() {
                (network, verdicts) = (straight, found);
                break;
            }
            bad.into_iter().for_each(|label| held[label] = true);
        }
    }
    let mut atlas = assemble(dual.mesh, &network.labels)?;
    choose_outer(&mut atlas, &verdicts);
    Ok(atlas)
}
