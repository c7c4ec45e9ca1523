//! The search for few charts: growing them several ways, and ranking these for each component.
//!
//! Growing is greedy, and what is cheap early may bar the way later. It costs little on the graph of cells: so it is
//! done from several numbers of regions, with several weights, and from the two sides of the shape. Fewer charts win;
//! then short seams and a small area ratio. A component that can be one chart is left whole.

use super::complex::{Complex, NONE};
use super::merge::{Limits, Merge, Weights};
use super::predict::{CellGraph, WORK_PER_CELL, predict};
use super::regions::{Region, Regions};
use super::sides::{Axes, axes, faces};
use super::voronoi::{Cells, bisect_until, farthest_first};
use crate::monitor::{Checkpoint, Interrupted};

const BALANCED: Weights = Weights { ratio: 1.0, roundness: 0.6, spread: 0.5, shared: 0.0 };
const COMPACT: Weights = Weights { ratio: 0.5, roundness: 0.6, spread: 0.5, shared: 1.0 };

/// One way of growing charts.
struct Way {
    /// Regions per component to begin with.
    regions: usize,
    weights: Weights,
    /// The axis (see [`axes`]) on either side of which charts grow before they may cross over.
    axis: Option<usize>,
}

const fn way(regions: usize, weights: Weights, axis: Option<usize>) -> Way {
    Way { regions, weights, axis }
}

/// (Of fifteen ways without sides that were tried on 25 surfaces, these found the fewest charts between them.)
const WAYS: [Way; 9] = [
    way(96, BALANCED, None),
    way(128, BALANCED, None),
    way(160, BALANCED, None),
    way(240, BALANCED, None),
    way(96, COMPACT, None),
    way(240, COMPACT, None),
    way(160, BALANCED, Some(0)),
    way(160, BALANCED, Some(1)),
    way(160, BALANCED, Some(2)),
];

/// What seams as long as the square root of the area count, against a decade of the worst area ratio. (They will be a
/// third shorter when they are straight.)
const SEAMS: f64 = 0.65;

/// The surface as the search sees it.
pub(super) struct Search<'a> {
    pub complex: &'a Complex,
    pub graph: &'a CellGraph,
    pub limits: Limits,
    /// The largest area ratio of a chart.
    pub bound: f64,
    pub checkpoint: &'a Checkpoint<'a>,
}

/// A component is left whole up to this share of the largest area ratio: it has no seams that would change it.
const WHOLE: f64 = 0.5;

/// What became of the component in one of the ways; less is better.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Score {
    pub charts: usize,
    beauty: f64,
}

/// A way in which a component was grown, and what became of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranked {
    pub score: Score,
    /// Which way: its place among the results.
    pub way: usize,
}

/// What the search found.
pub(super) struct Found {
    /// The components of the cells.
    pub components: Cells,
    /// Per component the ways that lead to charts, the best first.
    pub ranked: Vec<Vec<Ranked>>,
    /// Per way, for each cell its chart.
    ways: Vec<Vec<u32>>,
}

impl Found {
    /// Per cell its chart, each component grown in the way that is `chosen` for it.
    pub(super) fn charts(&self, chosen: &[usize]) -> Cells {
        // Charts of different ways have different numbers.
        let span = self.components.of.len();
        let chart = |(cell, component): (usize, &u32)| {
            let way = chosen[*component as usize];
            (way * span + self.ways[way][cell] as usize) as u32
        };
        Cells::renumbered(self.components.of.iter().enumerate().map(chart).collect())
    }
}

impl Search<'_> {
    pub(super) fn run(&self) -> Result<Found, Interrupted> {
        let components = farthest_first(self.graph, |_| 1);
        let whole = Regions::new(self.complex, components.of.clone(), components.count);
        let whole = self.fine(whole, WHOLE * self.bound)?;
        let mut ways = vec![components.of.clone()];
        let left_whole =
            |w: &bool| if *w { vec![Ranked { score: Score { charts: 1, beauty: 0.0 }, way: 0 }] } else { vec![] };
        let mut ranked: Vec<Vec<Ranked>> = whole.iter().map(left_whole).collect();
        let axes = axes(self.complex, &components);
        for way in WAYS.iter().filter(|_| whole.contains(&false)) {
            let (of, scores) = self.grow(way, &components, &axes, &whole)?;
            for (component, score) in scores.into_iter().enumerate() {
                if !whole[component] {
                    ranked[component].push(Ranked { score, way: ways.len() });
                }
            }
            ways.push(of);
        }
        let order = |a: &Ranked, b: &Ranked| {
            let by_charts = a.score.charts.cmp(&b.score.charts);
            by_charts.then(a.score.beauty.total_cmp(&b.score.beauty)).then(a.way.cmp(&b.way))
        };
        ranked.iter_mut().for_each(|r| r.sort_by(order));
        Ok(Found { components, ranked, ways })
    }

    /// Per region, whether it may be a chart with at most this area ratio.
    fn fine(&self, mut regions: Regions, largest: f64) -> Result<Vec<bool>, Interrupted> {
        let mut fine = Vec::with_capacity(regions.all.len());
        for label in 0..regions.all.len() {
            let outline = regions.outline_of(label as u32);
            let region = &regions.all[label];
            self.checkpoint.after(WORK_PER_CELL * region.cells.len())?;
            let is_allowed = self.limits.allow(&regions.shape(region, &outline));
            let ratio = || predict(self.complex, self.graph, &region.cells, &outline.loops).area_ratio;
            fine.push(is_allowed && ratio() <= largest);
        }
        Ok(fine)
    }

    /// Grows charts one way: per cell its chart, and the score of every component.
    fn grow(
        &self,
        way: &Way,
        components: &Cells,
        axes: &[Axes],
        whole: &[bool],
    ) -> Result<(Vec<u32>, Vec<Score>), Interrupted> {
        let is_whole = |cell: usize| whole[components.of[cell] as usize];
        let groups = farthest_first(self.graph, |part| if is_whole(part[0]) { 1 } else { way.regions });
        let groups = bisect_until(self.graph, groups, |groups| {
            self.fine(Regions::new(self.complex, groups.of.clone(), groups.count), self.limits.area_ratio)
        })?;
        let mut regions = Regions::new(self.complex, groups.of, groups.count);
        let component = |r: &Region| r.cells.first().map_or(0, |c| components.of[*c as usize]);
        let side = |axis: usize| {
            let is_front = |r: &Region| faces(r, axes[component(r) as usize][axis]);
            regions.all.iter().map(|r| 2 * component(r) + u32::from(is_front(r))).collect::<Vec<u32>>()
        };
        let wholes = regions.all.iter().map(component).collect();
        let rounds: Vec<Vec<u32>> = way.axis.map(side).into_iter().chain([wholes]).collect();
        let mut ratios = vec![1.0; groups.count];
        for groups in rounds {
            self.merge(&mut regions, &mut ratios, groups, way.weights, 0.0)?;
        }
        let scores = self.scores(&regions, &ratios, components);
        Ok((regions.of_cell, scores))
    }

    /// Unites charts across features wherever these are not sharp and long enough to part them, whatever their
    /// component.
    pub(super) fn absorb(&self, charts: Cells, least_outline: f64) -> Result<Cells, Interrupted> {
        let count = charts.count;
        let mut regions = Regions::new(self.complex, charts.of, count);
        self.merge(&mut regions, &mut vec![1.0; count], vec![0; count], BALANCED, least_outline)?;
        Ok(Cells::renumbered(regions.of_cell))
    }

    fn merge(
        &self,
        regions: &mut Regions,
        ratios: &mut [f64],
        groups: Vec<u32>,
        weights: Weights,
        least_outline: f64,
    ) -> Result<(), Interrupted> {
        let (graph, limits, checkpoint) = (self.graph, self.limits, self.checkpoint);
        Merge { regions, graph, limits, weights, ratios, groups, least_outline, checkpoint }.run()
    }

    /// The score of every component.
    fn scores(&self, regions: &Regions, ratios: &[f64], components: &Cells) -> Vec<Score> {
        let mut sums = vec![(0, 0.0, 0.0, 1.0_f64); components.count];
        for (region, ratio) in regions.all.iter().zip(ratios).filter(|(r, _)| !r.cells.is_empty()) {
            let (charts, seams, area, worst) = &mut sums[components.of[region.cells[0] as usize] as usize];
            let seam = region.boundary.iter().map(|a| &self.complex.arcs[*a as usize]).filter(|a| a.twin != NONE);
            *charts += 1;
            *seams += 0.5 * seam.map(|a| a.length).sum::<f64>();
            *area += region.area;
            *worst = worst.max(*ratio);
        }
        let score = |(charts, seams, area, worst): (usize, f64, f64, f64)| Score {
            charts,
            beauty: SEAMS * seams / area.sqrt() + worst.log10(),
        };
        sums.into_iter().map(score).collect()
    }
}
