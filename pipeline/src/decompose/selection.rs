//! Which of the strategies that the search found is taken: the one with the fewest charts when its seams are straight.
//!
//! Charts that reach around each other in fingers can hold their area ratios down with few charts. But the seams
//! between them are crooked, and when they are pulled straight the fingers vanish and the ratios rise, until the charts
//! must be split. So a strategy counts as many charts as there will be then.

use super::dual::Dual;
use super::evaluate::{Prediction, evaluate};
use super::merge::Limits;
use super::network::Network;
use super::search::{Ranked, SearchResult};
use super::straighten::{RELAXED, relax};
use super::voronoi::Cells;
use crate::monitor::Interrupted;

/// A chart is taken to become this many at most: an infinite ratio, of which no map was found, must not decide alone.
const MAX_PARTS: f64 = 9.0;

/// The surface on which charts are counted.
pub(super) struct Selection<'a> {
    pub dual: &'a Dual<'a>,
    pub cells: &'a Cells,
    pub limits: Limits,
}

impl Selection<'_> {
    /// Per cell its chart.
    pub(super) fn charts(&self, found: &SearchResult) -> Result<Cells, Interrupted> {
        let first = |ranked: &Vec<Ranked>| ranked.first().map_or(0, |best| best.strategy);
        let mut best: Vec<usize> = found.ranked.iter().map(first).collect();
        let mut needed = vec![usize::MAX; best.len()];
        // Strategies are ranked by their charts, which are never more than those needed: the rest cannot be better then.
        let strategies = found.ranked.iter().map(Vec::len).max().unwrap_or(0);
        for rank in 0..strategies {
            let next = |component: usize| found.ranked[component].get(rank);
            let is_open =
                |c: usize| found.ranked[c].len() > 1 && next(c).is_some_and(|ranked| ranked.score.charts < needed[c]);
            let open: Vec<bool> = (0..best.len()).map(is_open).collect();
            if !open.contains(&true) {
                break;
            }
            let strategy = |c: usize| next(c).filter(|_| open[c]).map_or(best[c], |ranked| ranked.strategy);
            let tried: Vec<usize> = (0..best.len()).map(strategy).collect();
            let counts = self.needed(found, &tried, &open)?;
            for c in (0..best.len()).filter(|c| open[*c]) {
                if counts[c] < needed[c] {
                    (needed[c], best[c]) = (counts[c], tried[c]);
                }
            }
        }
        Ok(found.charts(&best))
    }

    /// Per component that is `open`, the charts of the strategies that are `tried`, once their seams are straight and the
    /// charts that are too distorted then are split.
    fn needed(&self, found: &SearchResult, tried: &[usize], open: &[bool]) -> Result<Vec<usize>, Interrupted> {
        let charts = found.charts(tried);
        let mut component = vec![0; charts.len];
        for (chart, c) in charts.labels.iter().zip(&found.components.labels) {
            component[*chart as usize] = *c as usize;
        }
        let labels = self.cells.labels.iter().map(|c| charts.labels[*c as usize]).collect();
        let mut network = Network::new(self.dual, labels, self.limits).keeping(RELAXED);
        self.dual.checkpoint()?;
        // Pulled straight without regard to area ratios: these tell below what had to be split for that.
        relax(&mut network, 1.0, |label| open[component[label as usize]])?;
        let mut counts = vec![0; tried.len()];
        let wanted: Vec<bool> = component.iter().map(|c| open[*c]).collect();
        let predictions = evaluate(&network, self.cells, &wanted)?;
        for (component, prediction) in component.into_iter().zip(predictions) {
            counts[component] += self.parts(prediction);
        }
        Ok(counts)
    }

    /// How many charts one with this prediction becomes: the ratio of each part is the largest one.
    fn parts(&self, prediction: Option<Prediction>) -> usize {
        let ratio = prediction.map_or(1.0, |v| v.ratio);
        (ratio.ln() / self.limits.largest_ratio.ln()).ceil().clamp(1.0, MAX_PARTS) as usize
    }
}
