//! Polygons that are simple: chords are halved where they cross.

use super::spacing::{BoundaryNode, Chains};
use super::{Error, interrupted_unless};
use crate::certified::CertifiedAtlas;
use crate::certify::{Wrong, polygons};
use crate::grid::GridPoint;
use crate::monitor::Monitor;
use crate::topology::{ChartId, CurveId};
use std::collections::{BTreeMap, BTreeSet};

/// Chords are halved so often at most. A chord has some segments of its curve, and is no shorter than a millionth of one: that
/// is at most so often.
const ROUNDS: usize = 64;

/// Halves chords until the polygon of every chart is simple and rightly nested.
///
/// # Errors
/// [`Error::Close`], where chords may be no shorter; [`Error::MeetsItself`].
pub(super) fn simple(
    atlas: &CertifiedAtlas,
    charts: &[ChartId],
    mut chains: Chains,
    monitor: &dyn Monitor,
) -> Result<Chains, Error> {
    let mut changed: BTreeSet<ChartId> = charts.iter().copied().collect();
    let mut closest = None;
    for _ in 0..ROUNDS {
        let mut crossed: BTreeMap<CurveId, BTreeSet<usize>> = BTreeMap::new();
        closest = None;
        for chart in changed {
            interrupted_unless(monitor)?;
            for (curve, chord) in crossing(&chains.boundary(atlas, chart)?.loops) {
                crossed.entry(curve).or_default().insert(chord);
                closest.get_or_insert((chart, curve));
            }
        }
        if crossed.is_empty() {
            return Ok(chains);
        }
        let mut halved = 0;
        changed = BTreeSet::new();
        for (curve, chords) in &crossed {
            halved += chains.halve(*curve, chords);
            let beside = atlas.seams().curves()[curve.index()].sides().iter().map(|side| side.chart);
            changed.extend(beside.filter(|chart| charts.binary_search(chart).is_ok()));
        }
        if halved == 0 {
            break;
        }
    }
    match closest {
        Some((chart, curve)) => Err(Error::Close { chart, curve }),
        None => Ok(chains),
    }
}

/// The chords of a polygon that keep it from being simple and rightly nested.
fn crossing(loops: &[Vec<BoundaryNode>]) -> Vec<(CurveId, usize)> {
    let polygons: Vec<Vec<GridPoint>> = loops.iter().map(|nodes| nodes.iter().map(|n| n.uv).collect()).collect();
    let chord = |(l, side): (usize, usize)| loops[l][side].chord;
    let crossings = polygons::crossings(&polygons);
    if !crossings.is_empty() {
        return crossings.into_iter().flatten().map(chord).collect();
    }
    match polygons::check(&polygons) {
        None => vec![],
        // A loop of few chords may be turned, or lie elsewhere than its arcs do.
        Some(Wrong::Outer(l) | Wrong::Nesting(l)) => loops[l].iter().map(|node| node.chord).collect(),
        Some(Wrong::Crossing(pair) | Wrong::Undecided(pair)) => pair.map(chord).to_vec(),
    }
}
