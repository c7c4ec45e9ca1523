//! Growing charts: starting from a few dozen compact regions, the best pair of neighbours is united again and
//! again, as long as unions are legal and not too distorted.

use super::predict::{CellGraph, area_ratio};
use super::regions::{Regions, Union};
use crate::space::norm;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// What unions must respect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub area_ratio: f64,
    pub triangles: usize,
    pub strict_disks: bool,
}

/// How much a round outline counts against a small area ratio (per unit of isoperimetric excess).
const ROUNDNESS: f64 = 0.6;

/// How much the spread of normals counts (0: a plane, 1: a closed surface).
const SPREAD: f64 = 0.5;

/// A union that may be made: the greatest is the cheapest.
#[derive(Clone, Copy, PartialEq)]
struct Candidate {
    cost: f64,
    pair: (u32, u32),
    versions: (u32, u32),
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost.total_cmp(&self.cost).then(other.pair.cmp(&self.pair))
    }
}

/// Unites neighbours until no union is allowed. Ends because every union leaves one region less.
pub(super) fn merge(regions: &mut Regions, graph: &CellGraph, limits: &Limits) {
    let mut version = vec![0_u32; regions.all.len()];
    let mut heap = BinaryHeap::new();
    for a in 0..regions.all.len() as u32 {
        for b in regions.neighbours(a).into_iter().filter(|b| a < *b) {
            heap.extend(candidate(regions, graph, limits, (a, b), &version));
        }
    }
    while let Some(best) = heap.pop() {
        let (a, b) = best.pair;
        if best.versions != (version[a as usize], version[b as usize]) {
            continue;
        }
        let Some(union) = regions.union(a, b) else { continue };
        regions.unite(a, b, union);
        version[a as usize] += 1;
        version[b as usize] += 1;
        for c in regions.neighbours(a).into_iter().filter(|c| *c != a) {
            heap.extend(candidate(regions, graph, limits, (a.min(c), a.max(c)), &version));
        }
    }
}

fn candidate(
    regions: &mut Regions,
    graph: &CellGraph,
    limits: &Limits,
    (a, b): (u32, u32),
    version: &[u32],
) -> Option<Candidate> {
    let union = regions.union(a, b)?;
    let cost = allowed(regions, limits, &union).then(|| cost(regions, graph, limits, (a, b), &union))??;
    Some(Candidate { cost, pair: (a, b), versions: (version[a as usize], version[b as usize]) })
}

/// Whether the union may be a chart.
fn allowed(regions: &Regions, limits: &Limits, union: &Union) -> bool {
    let seams = |l: &&Vec<_>| l.iter().any(|h| regions.dual.across(*h).is_some());
    union.region.is_chart(&union.outline)
        && union.region.faces <= limits.triangles
        && (!limits.strict_disks || union.outline.loops.iter().filter(seams).count() <= 1)
        && 2.0 * union.shared_feature <= union.shared
}

/// The cost of a union; none where it would be too distorted.
fn cost(regions: &Regions, graph: &CellGraph, limits: &Limits, (a, b): (u32, u32), union: &Union) -> Option<f64> {
    let cells: Vec<u32> = [a, b].iter().flat_map(|r| regions.all[*r as usize].cells.iter().copied()).collect();
    let ratio = area_ratio(regions.dual, regions.cell_of, graph, &cells, &union.outline);
    if ratio > limits.area_ratio {
        return None;
    }
    let region = &union.region;
    let perimeter: f64 = region.boundary.iter().map(|h| regions.dual.length(*h)).sum();
    let excess = perimeter / (4.0 * PI * region.area).sqrt() - 1.0;
    let spread = 1.0 - norm(region.normal) / (2.0 * region.area);
    Some(ratio.log10() + ROUNDNESS * excess.max(0.0) + SPREAD * spread)
}
