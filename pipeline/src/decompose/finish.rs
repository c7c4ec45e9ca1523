//! From labels to an atlas: straight seams, as far as the predicted area ratio allows, and well chosen outer loops.

use super::assemble::assemble;
use super::clearance::{Gaps, gaps};
use super::dual::Dual;
use super::evaluate::{Prediction, choose_outer, evaluate};
use super::merge::Limits;
use super::network::{MIN_SHARE, Network};
use super::shortest::length;
use super::straighten::{RELAXED, relax, round_off, straighten};
use super::voronoi::Cells;
use super::{Error, Settings};
use crate::atlas::Atlas;
use crate::monitor::Interrupted;
use crate::topology::{EdgeId, HalfEdgeId};
use std::collections::{BTreeMap, BTreeSet};

/// How far seams may be straightened, in sizes of a cell: shortest loops would slide off at the end of a tube, and
/// seams along a tube come together. So the area ratio is predicted again after every step, and the last good one kept.
/// The last, widest step came with the aorta, whose seams it makes rings. How far the steps go decides little: half and
/// twice as far gave 777 and 772 charts instead of 773 on 18 meshes of up to 19,000 triangles, and seams as long within 1 %
/// on average.
const BANDS: [f64; 4] = [0.5, 1.0, 2.0, 4.0];

/// How far seams may be straightened, as a share of the narrowest gap beside them: below a half, so that two seams that move
/// towards each other do not meet. They leave 0.4 of the gap in one step; more would make necks, less straightens little
/// where charts are narrow.
const SHARE: f64 = 0.3;

/// A seam is bent if it is so many times as long as it must be. By experience: smaller gives up the area ratio for seams
/// that nobody would call crooked, larger leaves them so.
const BENT: f64 = 1.15;

/// The parts of seams that are tried one after the other where not all can be straightened at once. More parts find a neck
/// more closely, and each costs a prediction for the whole surface. By experience.
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
    let bands = Bands { size: &size, largest: settings.max_area_ratio };
    let network = Network::new(dual, labels, limits);
    let straight = if network.seams().next().is_none() {
        Evaluated::new(network, cells)?
    } else if let Some(straight) = bands.all(&network, cells)? {
        straight
    } else {
        bands.step_by_step(Evaluated::new(network, cells)?, cells)?
    };
    let Evaluated { network, predictions, .. } = straight.unbent(cells)?;
    let mut atlas = assemble(dual.mesh, &network.labels)?;
    choose_outer(&mut atlas, &predictions);
    Ok(atlas)
}

/// How far seams may be straightened.
struct Bands<'s, S> {
    /// The size of the cell at a half-edge.
    size: &'s S,
    /// The largest area ratio.
    largest: f64,
}

impl<S: Fn(HalfEdgeId) -> f64> Bands<'_, S> {
    /// How far the seam may move at each half-edge, in one of the [`BANDS`].
    fn breadth<'b>(&'b self, dual: &'b Dual, gaps: &'b Gaps, band: f64) -> impl Fn(HalfEdgeId) -> f64 + 'b {
        move |h| {
            let clear = gaps.clearance[dual.from(h)].min(gaps.clearance[dual.to(h)]);
            (SHARE * clear).min(band * (self.size)(h))
        }
    }

    /// All steps, with one prediction at the end, which is the half of what each costs: none where that is a chart's that is too
    /// distorted, where one is no chart on the way, or where seams are closed, which may be held.
    fn all<'a>(&self, network: &Network<'a>, cells: &Cells) -> Result<Option<Evaluated<'a>>, Interrupted> {
        if network.curves().iter().any(|curve| network.dual.is_closed(curve)) {
            return Ok(None);
        }
        let mut straight = network.clone();
        for band in BANDS {
            network.dual.checkpoint()?;
            let gaps = gaps(&straight)?;
            let breadth = self.breadth(network.dual, &gaps, band);
            straight = straight.keeping(MIN_SHARE);
            straighten(&mut straight, &gaps.crossing, |h| Some(breadth(h)))?;
            if !straight.is_sound() {
                return Ok(None);
            }
        }
        let straight = Evaluated::new(straight, cells)?;
        let is_kept = straight.predictions.iter().flatten().all(|prediction| prediction.ratio <= self.largest);
        Ok(is_kept.then_some(straight))
    }

    /// One step after another, and each for what it is: what would be too distorted stays.
    fn step_by_step<'a>(&self, mut best: Evaluated<'a>, cells: &Cells) -> Result<Evaluated<'a>, Interrupted> {
        let dual = best.network.dual;
        for (round, band) in BANDS.into_iter().enumerate() {
            dual.checkpoint()?;
            let gaps = gaps(&best.network)?;
            let breadth = self.breadth(dual, &gaps, band);
            let step = Step { cells, largest: self.largest, gaps: &gaps, shrink: round == 0 };
            let StepOutcome::Undone { distorted } = best.step(&step, |h| Some(breadth(h)))? else { continue };
            // The seams of the charts that it would distort too much, part by part: a neck is in one of them.
            for part in [None].into_iter().chain((0..PARTS).map(Some)) {
                let part_of = best.parts(&distorted);
                let in_part = |h: HalfEdgeId| (part_of(h) == part).then(|| breadth(h));
                best.step(&step, in_part)?;
            }
        }
        Ok(best)
    }
}

/// What holds for a step of straightening.
struct Step<'a> {
    cells: &'a Cells,
    /// The largest area ratio.
    largest: f64,
    gaps: &'a Gaps,
    /// Whether closed seams may shrink at the cost of the ratio.
    shrink: bool,
}

/// What became of a step of straightening.
enum StepOutcome {
    /// The seams are straighter.
    Made,
    /// The seams are what they were: the charts of these labels would have been too distorted, or one was no chart.
    Undone { distorted: Vec<u32> },
}

/// Per pair of charts the half-edges of all closed seams between them.
type Loops = BTreeMap<[u32; 2], Vec<HalfEdgeId>>;

/// Seams with what is predicted of their charts.
struct Evaluated<'a> {
    network: Network<'a>,
    predictions: Vec<Option<Prediction>>,
    /// The pairs of charts between which closed seams stay where they are.
    held: BTreeSet<[u32; 2]>,
}

impl<'a> Evaluated<'a> {
    fn new(network: Network<'a>, cells: &Cells) -> Result<Self, Interrupted> {
        let predictions = evaluate(&network, cells, &vec![true; network.label_count()])?;
        Ok(Self { network, predictions, held: BTreeSet::new() })
    }

    /// The same surface with other labels: only charts that changed are predicted anew, and their neighbours: what is predicted of a
    /// chart depends on what is around it.
    fn changed(&self, network: Network<'a>, cells: &Cells) -> Result<Self, Interrupted> {
        let mut is_changed = vec![false; network.label_count()];
        for (old, new) in self.network.labels.iter().zip(&network.labels).filter(|(old, new)| old != new) {
            (is_changed[*old as usize], is_changed[*new as usize]) = (true, true);
        }
        let is_new = network.with_neighbours(&is_changed);
        let mut predictions = evaluate(&network, cells, &is_new)?;
        for (label, known) in self.predictions.iter().enumerate().filter(|(label, _)| !is_new[*label]) {
            predictions[label] = *known;
        }
        Ok(Self { network, predictions, held: BTreeSet::new() })
    }

    /// Straightens the seams as far as `breadth` allows, if no chart's ratio rises above the largest one by that;
    /// otherwise all stays.
    fn step(&mut self, step: &Step, breadth: impl Fn(HalfEdgeId) -> Option<f64>) -> Result<StepOutcome, Interrupted> {
        let loops = self.loops();
        let mut straight = self.straightened(step, &loops, &breadth)?;
        let known = self.held.len();
        if !step.shrink {
            self.held.extend(self.dearer(&loops, &straight));
        }
        if self.held.len() > known {
            straight = self.straightened(step, &loops, &breadth)?;
        }
        let ratio = |v: &Option<Prediction>| v.map_or(1.0, |v| v.ratio);
        let worse = |(new, old): (&Option<Prediction>, &Option<Prediction>)| ratio(new) > step.largest.max(ratio(old));
        let pairs = straight.predictions.iter().zip(&self.predictions);
        let distorted: Vec<u32> = pairs.zip(0..).filter(|(pair, _)| worse(*pair)).map(|(_, label)| label).collect();
        if !distorted.is_empty() || !straight.network.is_sound() {
            return Ok(StepOutcome::Undone { distorted });
        }
        *self = Self { held: std::mem::take(&mut self.held), ..straight };
        Ok(StepOutcome::Made)
    }

    fn straightened(
        &self,
        step: &Step,
        loops: &Loops,
        breadth: impl Fn(HalfEdgeId) -> Option<f64>,
    ) -> Result<Self, Interrupted> {
        let edges = self.network.dual.mesh.edges();
        let held = loops.iter().filter(|l| self.held.contains(l.0)).flat_map(|l| l.1);
        let held: BTreeSet<EdgeId> = held.map(|h| edges.edge(*h)).collect();
        let mut network = self.network.clone().keeping(MIN_SHARE);
        let free = |h: HalfEdgeId| if held.contains(&edges.edge(h)) { Some(0.0) } else { breadth(h) };
        straighten(&mut network, &step.gaps.crossing, free)?;
        self.changed(network, step.cells)
    }

    /// The pairs of charts for which the closed seams between them, `before`, became dearer: on a sphere, a loop only
    /// becomes shorter by shrinking to a point, and the chart around it is the more distorted for it.
    fn dearer(&self, before: &Loops, straight: &Self) -> Vec<[u32; 2]> {
        let after = straight.loops();
        let mut dearer = Vec::new();
        for (pair, path) in before {
            // Where the loops of a pair are gone they have shrunk to nothing.
            let is_dearer = after.get(pair).is_none_or(|now| straight.cost(*pair, now) > self.cost(*pair, path));
            if is_dearer {
                dearer.push(*pair);
            }
        }
        dearer
    }

    /// What the closed seams `path` between two charts cost: a decade of the area ratio counts as much as a length like the
    /// size of both charts together.
    fn cost(&self, pair: [u32; 2], path: &[HalfEdgeId]) -> f64 {
        let [left, right] = pair.map(|label| self.predictions[label as usize].map_or(1.0, |p| p.ratio));
        let area: f64 = pair.iter().map(|label| self.network.areas[*label as usize]).sum();
        let relative_length = length(self.network.dual, path) / area.sqrt();
        relative_length + left.max(right).log10()
    }

    /// The half-edges of all closed seams between two charts, by their labels.
    fn loops(&self) -> Loops {
        let mut loops = Loops::new();
        let dual = self.network.dual;
        for curve in self.network.curves() {
            let Some(beyond) = dual.twin(curve[0]).filter(|_| dual.is_closed(&curve)) else { continue };
            let mut pair = [curve[0], beyond].map(|h| self.network.label(h));
            pair.sort_unstable();
            loops.entry(pair).or_default().extend(curve);
        }
        loops
    }

    /// The same charts without bent seams, whatever becomes of the ratios: a chart that holds its ratio down by reaching
    /// around others in fingers had better be split across them.
    fn unbent(self, cells: &Cells) -> Result<Self, Interrupted> {
        let mut network = self.network.clone().keeping(RELAXED);
        let is_relaxed = relax(&mut network, BENT, |_| true)?;
        let is_rounded = round_off(&mut network)?;
        let changed = is_relaxed || is_rounded;
        if changed && network.is_sound() { self.changed(network, cells) } else { Ok(self) }
    }

    /// Per half-edge on a seam of the charts `labels` its part, counted along the seam; none elsewhere.
    fn parts(&self, labels: &[u32]) -> impl Fn(HalfEdgeId) -> Option<usize> + use<'a> {
        let edges = self.network.dual.mesh.edges();
        let mut part = vec![None; edges.len()];
        for curve in self.network.curves() {
            let length = curve.len();
            for (i, h) in curve.into_iter().enumerate() {
                let sides = [Some(h), self.network.dual.twin(h)];
                let concerned = sides.into_iter().flatten().any(|s| labels.contains(&self.network.label(s)));
                part[edges.edge(h).index()] = concerned.then_some(i * PARTS / length);
            }
        }
        move |h| part[edges.edge(h).index()]
    }
}
