//! Which of the ways that the search found is taken: the one with the fewest charts when its seams are straight.
//!
//! Charts that reach around each other in fingers can hold their area ratios down with few charts. But the seams
//! between them are crooked, and when they are pulled straight the fingers vanish and the ratios rise, until the charts
//! must be split. So a way counts as many charts as there will be then.

use super::dual::Dual;
use super::judge::{Verdict, judge};
use super::merge::Limits;
use super::network::Network;
use super::search::Found;
use super::straighten::{RELAXED, relax};
use super::voronoi::Cells;
use crate::monitor::Interrupted;

/// A chart is taken to need at most this many more.
const MOST: f64 = 9.0;

/// The surface on which charts are counted.
pub(super) struct Choice<'a> {
    pub dual: &'a Dual<'a>,
    pub cells: &'a Cells,
    pub limits: Limits,
    /// The largest area ratio.
    pub bound: f64,
}

impl Choice<'_> {
    /// Per cell its chart.
    pub(super) fn of(&self, found: &Found) -> Result<Cells, Interrupted> {
        let mut best: Vec<usize> =
            found.ranked.iter().map(|ways| ways.first().map_or(0, |ranked| ranked.way)).collect();
        let mut needed = vec![usize::MAX; best.len()];
        // Ways are ranked by their charts, which are never more than those needed: the rest cannot be better then.
        let ways = found.ranked.iter().map(Vec::len).max().unwrap_or(0);
        for rank in 0..ways {
            let next = |component: usize| found.ranked[component].get(rank);
            let is_open = |c: usize| found.ranked[c].len() > 1 && next(c).is_some_and(|w| w.score.charts < needed[c]);
            let open: Vec<bool> = (0..best.len()).map(is_open).collect();
            if !open.contains(&true) {
                break;
            }
            let way = |c: usize| next(c).filter(|_| open[c]).map_or(best[c], |ranked| ranked.way);
            let tried: Vec<usize> = (0..best.len()).map(way).collect();
            let counts = self.needed(found, &tried, &open)?;
            for c in (0..best.len()).filter(|c| open[*c]) {
                if counts[c] < needed[c] {
                    (needed[c], best[c]) = (counts[c], tried[c]);
                }
            }
        }
        Ok(found.charts(&best))
    }

    /// Per component that is `open`, the charts of the ways that are `tried`, once their seams are straight and the
    /// charts that are too distorted then are split.
    fn needed(&self, found: &Found, tried: &[usize], open: &[bool]) -> Result<Vec<usize>, Interrupted> {
        let charts = found.charts(tried);
        let mut component = vec![0; charts.count];
        charts.of.iter().zip(&found.components.of).for_each(|(chart, c)| component[*chart as usize] = *c as usize);
        let labels = self.cells.of.iter().map(|c| charts.of[*c as usize]).collect();
        let mut network = Network::new(self.dual, labels, self.limits).keeping(RELAXED);
        self.dual.checkpoint()?;
        relax(&mut network, 1.0, |label| open[component[label as usize]])?;
        let mut counts = vec![0; tried.len()];
        for (component, verdict) in component.into_iter().zip(judge(&network, self.cells)?) {
            counts[component] += self.parts(verdict);
        }
        Ok(counts)
    }

    /// How many charts one with this verdict becomes: the ratio of each part is the largest one.
    fn parts(&self, verdict: Option<Verdict>) -> usize {
        let ratio = verdict.map_or(1.0, |v| v.ratio);
        (ratio.ln() / self.bound.ln()).ceil().clamp(1.0, MOST) as usize
    }
}
