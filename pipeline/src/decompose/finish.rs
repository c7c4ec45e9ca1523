//! From labels to an atlas: straight seams, as far as the predicted area ratio allows, and well chosen outer loops.

use super::assemble::assemble;
use super::clearance::{Gaps, gaps};
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
const BANDS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// How far seams may be straightened, as a share of the narrowest gap beside them.
const SHARE: f64 = 0.3;

/// The parts of seams that are tried one after the other where not all can be straightened at once.
const PARTS: usize = 8;

/// Straightens the seams between labels and makes the charts. `size` tells that of a cell.
pub(super) fn finish(
    dual: &Dual,
    labels: Vec<u32>,
    limits: Limits,
    settings: &Settings,
    cells: &Cells,
    size: impl Fn(HalfEdgeId) -> f64,
) -> Result<Atlas, Error> {
    let mut best = Judged::new(Network::new(dual, labels, limits), cells);
    let bands = if best.network.seams().next().is_some() { &BANDS[..] } else { &[] };
    for band in bands {
        let gaps = gaps(&best.network);
        let clear = |h: HalfEdgeId| SHARE * gaps.clearance[dual.from(h)].min(gaps.clearance[dual.to(h)]);
        let breadth = |h: HalfEdgeId| clear(h).min(band * size(h));
        let Err(bad) = best.step(cells, settings.max_area_ratio, &gaps, breadth) else { continue };
        // The seams of the charts that it would distort too much, part by part: a neck is in one of them.
        for part in 0..PARTS {
            let part_of = best.parts(&bad);
            let in_part = |h: HalfEdgeId| if part_of(h).is_none_or(|p| p == part) { breadth(h) } else { 0.0 };
            let _kept_or_left = best.step(cells, settings.max_area_ratio, &gaps, in_part);
        }
    }
    let Judged { network, verdicts } = best;
    let mut atlas = assemble(dual.mesh, &network.labels)?;
    choose_outer(&mut atlas, &verdicts);
    Ok(atlas)
}

/// Seams with what is foretold of their charts.
struct Judged<'a> {
    network: Network<'a>,
    verdicts: Vec<Option<Verdict>>,
}

impl<'a> Judged<'a> {
    fn new(network: Network<'a>, cells: &Cells) -> Self {
        let verdicts = judge(&network, cells);
        Self { network, verdicts }
    }

    /// Straightens the seams as far as `breadth` allows, if no chart's ratio rises above `largest` by that; otherwise
    /// all stays, and these charts are returned.
    fn step(
        &mut self,
        cells: &Cells,
        largest: f64,
        gaps: &Gaps,
        breadth: impl Fn(HalfEdgeId) -> f64,
    ) -> Result<(), Vec<u32>> {
        let mut network = self.network.begun_anew();
        straighten(&mut network, &gaps.crossing, breadth);
        let straight = Self::new(network, cells);
        let ratio = |v: &Option<Verdict>| v.map_or(1.0, |v| v.ratio);
        let worse = |(new, old): (&Option<Verdict>, &Option<Verdict>)| ratio(new) > largest.max(ratio(old));
        let pairs = straight.verdicts.iter().zip(&self.verdicts);
        let bad: Vec<u32> = pairs.zip(0..).filter(|(pair, _)| worse(*pair)).map(|(_, label)| label).collect();
        if bad.is_empty() && straight.network.is_sound() {
            *self = straight;
            return Ok(());
        }
        Err(bad)
    }

    /// Per half-edge on a seam of the charts `labels` its part, counted along the seam; none elsewhere.
    fn parts(&self, labels: &[u32]) -> impl Fn(HalfEdgeId) -> Option<usize> + use<'a> {
        let edges = self.network.dual.mesh.edges();
        let mut part = vec![None; edges.len()];
        for curve in self.network.curves() {
            let length = curve.len();
            for (i, h) in curve.into_iter().enumerate() {
                let sides = [Some(h), self.network.dual.across(h)];
                let concerned = sides.into_iter().flatten().any(|s| labels.contains(&self.network.label(s)));
                part[edges.edge(h).index()] = concerned.then_some(i * PARTS / length);
            }
        }
        move |h| part[edges.edge(h).index()]
    }
}
