//! The search for few charts: growing them several ways, and keeping the best of each component.
//!
//! Growing is greedy, and what is cheap early may bar the way later. It costs little on the graph of cells: so it is
//! done from several numbers of regions and with several weights. Fewer charts win; then short seams and a small area
//! ratio. A component that can be one chart is left whole.

use super::complex::{Complex, NONE};
use super::merge::{Limits, Merge, Weights};
use super::predict::{CellGraph, area_ratio};
use super::regions::{Outline, Region, Regions};
use super::voronoi::{Cells, bisect_until, farthest_first};

const BALANCED: Weights = Weights { ratio: 1.0, roundness: 0.6, spread: 0.5, shared: 0.0 };
const COMPACT: Weights = Weights { ratio: 0.5, roundness: 0.6, spread: 0.5, shared: 1.0 };

/// Regions per component to begin with, and weights. (Of fifteen ways that were tried on 25 surfaces, these found the
/// fewest charts between them.)
const WAYS: [(usize, Weights); 6] =
    [(96, BALANCED), (128, BALANCED), (160, BALANCED), (240, BALANCED), (96, COMPACT), (240, COMPACT)];

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
}

/// A component is left whole up to this share of the largest area ratio: it has no seams that would change it.
const WHOLE: f64 = 0.5;

/// What became of the component in one of the ways; less is better.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
struct Score {
    charts: usize,
    beauty: f64,
}

impl Search<'_> {
    /// Per cell its chart.
    pub(super) fn run(&self) -> Cells {
        let components = farthest_first(self.graph, |_| 1);
        let whole = Regions::new(self.complex, components.of.clone(), components.count);
        let whole = self.fine(whole, WHOLE * self.bound);
        let mut best: Vec<(Score, usize)> = whole.iter().map(|w| (Score::of_whole(*w), 0)).collect();
        let mut ways = vec![components.of.clone()];
        for (count, weights) in WAYS.iter().filter(|_| whole.contains(&false)) {
            let (of, scores) = self.way(*count, *weights, &components, &whole);
            for (best, score) in best.iter_mut().zip(scores) {
                if score < best.0 {
                    *best = (score, ways.len());
                }
            }
            ways.push(of);
        }
        // Charts of different ways have different numbers.
        let span = self.complex.cells.len() as u32;
        let chosen = |cell: usize| best[components.of[cell] as usize].1;
        let of = (0..self.complex.cells.len()).map(|c| chosen(c) as u32 * span + ways[chosen(c)][c]).collect();
        Cells::renumbered(of)
    }

    /// Per region, whether it may be a chart with at most this area ratio.
    fn fine(&self, mut regions: Regions, largest: f64) -> Vec<bool> {
        let outlines: Vec<_> = (0..regions.all.len() as u32).map(|r| regions.outline_of(r)).collect();
        let judge = |(region, outline): (&Region, &Outline)| {
            let ratio = || area_ratio(self.complex, self.graph, &region.cells, &outline.loops).0;
            self.limits.allow(&regions.shape(region, outline)) && (region.cells.len() == 1 || ratio() <= largest)
        };
        regions.all.iter().zip(&outlines).map(judge).collect()
    }

    /// Grows charts one way: per cell its chart, and the score of every component.
    fn way(&self, count: usize, weights: Weights, components: &Cells, whole: &[bool]) -> (Vec<u32>, Vec<Score>) {
        let is_whole = |cell: usize| whole[components.of[cell] as usize];
        let groups = farthest_first(self.graph, |part| if is_whole(part[0]) { 1 } else { count });
        let groups = bisect_until(self.graph, groups, |groups| {
            self.fine(Regions::new(self.complex, groups.of.clone(), groups.count), self.limits.area_ratio)
        });
        let mut regions = Regions::new(self.complex, groups.of, groups.count);
        let ratios = vec![1.0; groups.count];
        let mut merge = Merge { regions: &mut regions, graph: self.graph, limits: self.limits, weights, ratios };
        merge.run();
        let ratios = merge.ratios;
        let mut sums = vec![(0, 0.0, 0.0, 1.0_f64); components.count];
        for (region, ratio) in regions.all.iter().zip(&ratios).filter(|(r, _)| !r.cells.is_empty()) {
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
        (regions.of_cell, sums.into_iter().map(score).collect())
    }
}

impl Score {
    /// The score of a component that is left whole: nothing beats a chart, anything beats what is none.
    fn of_whole(is_chart: bool) -> Self {
        Self { charts: if is_chart { 0 } else { usize::MAX }, beauty: 0.0 }
    }
}
