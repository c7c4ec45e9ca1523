//! The search for few charts: growing them by several strategies, and ranking these for each component.
//!
//! Growing is greedy, and what is cheap early may bar the way later. It costs little on the graph of cells: so it is
//! done from several numbers of regions, with several weights, and from the two sides of the shape. Fewer charts win;
//! then short seams and a small area ratio. A component that can be one chart is left whole.

use super::complex::{Complex, NONE};
use super::merge::{Limits, Merge, Weights};
use super::predict::{CellGraph, Predictions, WORK_PER_CELL};
use super::principal_axes::{Axes, faces_along, principal_axes};
use super::regions::{Region, Regions};
use super::voronoi::{Cells, bisect_until, farthest_first};
use crate::monitor::{Checkpoint, Interrupted};

/// By experience. More roundness makes charts compact, more spread keeps them to one face of the shape, and both are paid
/// for by the area ratio. Half and twice as much of either gave the same number of charts on 15 or 16 of 18 meshes of up to
/// 19,000 triangles, but cad_imu fell into 150 to 166 charts instead of 142. Seams became 1.4 to 2.4 times as long on
/// gebco_seabed and retinal_miq, and 6 to 26 % shorter on max_planck and punctured_torus.
const BALANCED: Weights = Weights { ratio: 1.0, roundness: 0.6, spread: 0.5, shared: 0.0 };

/// The same, where outlines that vanish count and the area ratio counts half: regions that lie deep in each other unite
/// early.
const COMPACT: Weights = Weights { ratio: 0.5, roundness: 0.6, spread: 0.5, shared: 1.0 };

/// A strategy of growing charts.
struct Strategy {
    /// Regions per component to begin with.
    regions: usize,
    weights: Weights,
    /// The axis (see [`principal_axes`]) on either side of which charts grow before they may cross over.
    axis: Option<usize>,
}

const fn strategy(regions: usize, weights: Weights, axis: Option<usize>) -> Strategy {
    Strategy { regions, weights, axis }
}

/// (Of fifteen strategies without sides that were tried on 25 surfaces, these found the fewest charts between them.)
const STRATEGIES: [Strategy; 9] = [
    strategy(96, BALANCED, None),
    strategy(128, BALANCED, None),
    strategy(160, BALANCED, None),
    strategy(240, BALANCED, None),
    strategy(96, COMPACT, None),
    strategy(240, COMPACT, None),
    strategy(160, BALANCED, Some(0)),
    strategy(160, BALANCED, Some(1)),
    strategy(160, BALANCED, Some(2)),
];

/// Their order for simple shapes ([`is_simple`]): those first that find the best two charts of twelve smooth surfaces.
const SIMPLE_FIRST: [usize; 9] = [5, 3, 4, 0, 2, 1, 6, 7, 8];

/// What cannot be left whole falls into two charts at least. Where so many strategies have found two for a simple shape, at such a cost
/// at most, no others are asked: growing took a third of the time for 10,000 triangles. With any cost bunny_stanford (4.7 and more)
/// falls into four charts instead of two, when its ears are mapped.
const ENOUGH: usize = 3;
const EASY: Score = Score { charts: 2, cost: 4.5 };

/// A shape with fewer cells takes little time in any case.
const MANY_CELLS: usize = 400;

/// What seams as long as the square root of the area count, against a decade of the worst area ratio. (They will be a
/// third shorter when they are straight.) By experience; it only decides among strategies with the same number of charts.
const SEAMS: f64 = 0.65;

/// The surface as the search sees it.
pub(super) struct Search<'a> {
    pub complex: &'a Complex,
    pub graph: &'a CellGraph,
    pub predictions: Predictions,
    pub limits: Limits,
    pub checkpoint: &'a Checkpoint<'a>,
}

/// A component is left whole up to this share of the largest area ratio: it has no seams that would change it. The factor of
/// two that is left is for the error of the prediction. That may be larger, up to ten in the tests: then it is split later.
const WHOLE: f64 = 0.5;

/// What became of a component by one of the strategies; less is better.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Score {
    pub charts: usize,
    cost: f64,
}

/// A strategy by which a component was grown, and what became of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    pub score: Score,
    /// Which strategy: its place among the results.
    pub strategy: usize,
}

/// What the search found.
pub(super) struct SearchResult {
    /// The components of the cells.
    pub components: Cells,
    /// Per component the strategies that lead to charts, the best first.
    pub ranked: Vec<Vec<Ranked>>,
    /// By strategy, for each cell its chart.
    strategies: Vec<Vec<u32>>,
}

impl SearchResult {
    /// Per cell its chart, each component grown by the strategy that is `chosen` for it.
    pub(super) fn charts(&self, chosen: &[usize]) -> Cells {
        // Charts of different strategies have different numbers.
        let span = self.components.labels.len();
        let chart = |(cell, component): (usize, &u32)| {
            let strategy = chosen[*component as usize];
            (strategy * span + self.strategies[strategy][cell] as usize) as u32
        };
        Cells::renumbered(self.components.labels.iter().enumerate().map(chart).collect())
    }
}

/// What is added up over the charts of a component.
#[derive(Clone)]
struct Sums {
    charts: usize,
    /// The length of the seams.
    seams: f64,
    area: f64,
    /// The largest area ratio.
    worst: f64,
}

impl Sums {
    fn score(&self) -> Score {
        let cost = SEAMS * self.seams / self.area.sqrt() + self.worst.log10();
        Score { charts: self.charts, cost }
    }
}

/// Whether the components are one of many cells, with a handle at most.
fn is_simple(components: &mut Regions) -> bool {
    let outline = components.outline_of(0);
    let [component] = &components.all[..] else { return false };
    let shape = components.shape(component, &outline);
    // Euler number = 2 - 2 genus - loops.
    component.cells.len() >= MANY_CELLS && shape.euler + shape.loops as i64 >= 0
}

impl Search<'_> {
    /// Grows charts by every strategy, for the components that cannot be left whole.
    pub(super) fn run(&mut self) -> Result<SearchResult, Interrupted> {
        let components = farthest_first(self.graph, |_| 1);
        let mut whole = Regions::new(self.complex, components.labels.clone(), components.len);
        let is_simple = is_simple(&mut whole);
        let whole = self.fine(whole, WHOLE * self.limits.largest_ratio)?;
        let mut strategies = vec![components.labels.clone()];
        // The first strategy, of one chart for each component, is open to those that can be left whole, and to them alone.
        let as_one = Ranked { score: Score { charts: 1, cost: 0.0 }, strategy: 0 };
        let mut ranked: Vec<Vec<Ranked>> = Vec::with_capacity(whole.len());
        for is_whole in &whole {
            ranked.push(if *is_whole { vec![as_one] } else { vec![] });
        }
        let axes = principal_axes(self.complex, &components);
        let order = if is_simple { SIMPLE_FIRST } else { std::array::from_fn(|number| number) };
        for number in order.into_iter().filter(|_| whole.contains(&false)) {
            if is_simple && ranked[0].iter().filter(|found| found.score <= EASY).count() >= ENOUGH {
                break;
            }
            let strategy = &STRATEGIES[number];
            let (of, scores) = self.grow(strategy, &components, &axes, &whole)?;
            for (component, score) in scores.into_iter().enumerate() {
                if !whole[component] {
                    ranked[component].push(Ranked { score, strategy: strategies.len() });
                }
            }
            strategies.push(of);
        }
        let by_score = |a: &Ranked, b: &Ranked| {
            let by_charts = a.score.charts.cmp(&b.score.charts);
            by_charts.then(a.score.cost.total_cmp(&b.score.cost)).then(a.strategy.cmp(&b.strategy))
        };
        ranked.iter_mut().for_each(|r| r.sort_by(by_score));
        Ok(SearchResult { components, ranked, strategies })
    }

    /// Per region, whether it may be a chart with at most this area ratio.
    fn fine(&mut self, mut regions: Regions, largest: f64) -> Result<Vec<bool>, Interrupted> {
        let mut fine = Vec::with_capacity(regions.all.len());
        for label in 0..regions.all.len() {
            let outline = regions.outline_of(label as u32);
            let region = &regions.all[label];
            self.checkpoint.after(WORK_PER_CELL * region.cells.len())?;
            let is_allowed = self.limits.allow(&regions.shape(region, &outline));
            let predictions = &mut self.predictions;
            let mut ratio = || predictions.area_ratio(self.complex, self.graph, &region.cells, &outline.loops);
            fine.push(is_allowed && ratio() <= largest);
        }
        Ok(fine)
    }

    /// Grows charts by one strategy: per cell its chart, and the score of every component.
    fn grow(
        &mut self,
        strategy: &Strategy,
        components: &Cells,
        axes: &[Axes],
        whole: &[bool],
    ) -> Result<(Vec<u32>, Vec<Score>), Interrupted> {
        let is_whole = |cell: usize| whole[components.labels[cell] as usize];
        let groups = farthest_first(self.graph, |part| if is_whole(part[0]) { 1 } else { strategy.regions });
        let groups = bisect_until(self.graph, groups, |groups| {
            self.fine(Regions::new(self.complex, groups.labels.clone(), groups.len), self.limits.area_ratio)
        })?;
        let mut regions = Regions::new(self.complex, groups.labels, groups.len);
        let component = |r: &Region| r.cells.first().map_or(0, |c| components.labels[*c as usize]);
        let side = |axis: usize| {
            let is_front = |r: &Region| faces_along(r, axes[component(r) as usize][axis]);
            regions.all.iter().map(|r| 2 * component(r) + u32::from(is_front(r))).collect::<Vec<u32>>()
        };
        let wholes = regions.all.iter().map(component).collect();
        // First on either side of the axis, then across.
        let rounds: Vec<Vec<u32>> = strategy.axis.map(side).into_iter().chain([wholes]).collect();
        let mut ratios = vec![1.0; groups.len];
        for groups in rounds {
            self.merge(&mut regions, &mut ratios, groups, strategy.weights, 0.0)?;
        }
        let scores = self.scores(&regions, &ratios, components);
        Ok((regions.of_cell, scores))
    }

    /// Unites charts across features wherever these are not sharp and long enough to part them, whatever their
    /// component.
    pub(super) fn absorb(&mut self, charts: Cells, min_outline: f64) -> Result<Cells, Interrupted> {
        let count = charts.len;
        let mut regions = Regions::new(self.complex, charts.labels, count);
        self.merge(&mut regions, &mut vec![1.0; count], vec![0; count], BALANCED, min_outline)?;
        Ok(Cells::renumbered(regions.of_cell))
    }

    fn merge(
        &mut self,
        regions: &mut Regions,
        ratios: &mut [f64],
        groups: Vec<u32>,
        weights: Weights,
        min_outline: f64,
    ) -> Result<(), Interrupted> {
        let (graph, limits, checkpoint) = (self.graph, self.limits, self.checkpoint);
        let predictions = &mut self.predictions;
        Merge { regions, graph, predictions, limits, weights, ratios, groups, min_outline, checkpoint }.run()
    }

    /// The score of every component.
    fn scores(&self, regions: &Regions, ratios: &[f64], components: &Cells) -> Vec<Score> {
        let mut sums = vec![Sums { charts: 0, seams: 0.0, area: 0.0, worst: 1.0 }; components.len];
        for (region, ratio) in regions.all.iter().zip(ratios).filter(|(r, _)| !r.cells.is_empty()) {
            let sums = &mut sums[components.labels[region.cells[0] as usize] as usize];
            let arcs = region.boundary.iter().map(|arc| &self.complex.arcs[*arc as usize]);
            let seam: f64 = arcs.filter(|arc| arc.twin != NONE).map(|arc| arc.length).sum();
            sums.charts += 1;
            // The region on the other side counts the other half.
            sums.seams += 0.5 * seam;
            sums.area += region.area;
            sums.worst = sums.worst.max(*ratio);
        }
        sums.into_iter().map(|sums| sums.score()).collect()
    }
}
