//! Growing charts: starting from a few dozen compact regions, the best pair of neighbours is united again and
//! again, as long as unions are legal and not too distorted.

use super::BoundaryShape;
use super::predict::{CellGraph, Predictions, WORK_PER_CELL};
use super::regions::{Regions, Shape, Union};
use crate::monitor::{Checkpoint, Interrupted};
use crate::vec3::norm;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::PI;

/// What unions must respect.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    pub area_ratio: f64,
    /// What their maps must not exceed.
    pub largest_ratio: f64,
    pub triangles: usize,
    pub strict_disks: bool,
    /// Which maps are predicted.
    pub boundary: BoundaryShape,
}

impl Limits {
    /// Whether a region may be a chart, its distortion apart.
    pub(super) fn allow(&self, shape: &Shape) -> bool {
        shape.is_chart() && shape.faces <= self.triangles && (!self.strict_disks || shape.seam_loops <= 1)
    }
}

/// What makes a union cheap. All terms are pure numbers of about the same size.
#[derive(Clone, Copy, Debug)]
pub(super) struct Weights {
    /// Per decade of the area ratio.
    pub ratio: f64,
    /// Per unit of isoperimetric excess (0: a round disk).
    pub roundness: f64,
    /// Per unit of spread of the normals (0: a plane, 1: a closed surface).
    pub spread: f64,
    /// For the share of the smaller outline that vanishes.
    pub shared: f64,
}

/// A union that may be made: the greatest is the cheapest.
#[derive(Clone, Copy, PartialEq)]
struct Candidate {
    cost: f64,
    pair: (u32, u32),
    versions: (u32, u32),
    /// The area ratio of the union; before it is known, none: the cost is then an estimate from below.
    ratio: Option<f64>,
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

/// Regions while they are united.
pub(super) struct Merge<'a, 'b> {
    pub regions: &'b mut Regions<'a>,
    pub graph: &'b CellGraph,
    pub predictions: &'b mut Predictions,
    pub limits: Limits,
    pub weights: Weights,
    /// Per region its area ratio, as far as it is known, else 1.
    pub ratios: &'b mut [f64],
    /// Per region its group: only regions of the same group are united.
    pub groups: Vec<u32>,
    /// Features block unions, but not that of a region around which there is no more of them, weighed by sharpness.
    pub min_outline: f64,
    pub checkpoint: &'b Checkpoint<'b>,
}

impl Merge<'_, '_> {
    /// Unites neighbours until no union is allowed, group by group: one knows nothing of the others, and is left in the processor's
    /// caches while it is at work (167 spheres in one file took seven times as long as 42 when all waited in one heap).
    pub(super) fn run(&mut self) -> Result<(), Interrupted> {
        let mut version = vec![0_u32; self.regions.all.len()];
        let mut members: Vec<u32> = (0..version.len() as u32).collect();
        let group = |a: &u32| self.groups[*a as usize];
        members.sort_by_key(group);
        let groups: Vec<&[u32]> = members.chunk_by(|a, b| group(a) == group(b)).collect();
        for members in groups {
            self.run_group(members, &mut version)?;
        }
        Ok(())
    }

    /// The same for the regions of one group, ascending. Ends because every union leaves one region less, and every candidate is
    /// judged once.
    fn run_group(&mut self, members: &[u32], version: &mut [u32]) -> Result<(), Interrupted> {
        let mut heap = BinaryHeap::new();
        for a in members.iter().copied() {
            self.checkpoint.after(self.regions.all[a as usize].boundary.len())?;
            for b in self.regions.neighbours(a).into_iter().filter(|b| a < *b) {
                heap.extend(self.candidate((a, b), version));
            }
        }
        while let Some(best) = heap.pop() {
            let (a, b) = best.pair;
            // One of the regions has grown since: that union has a candidate of its own.
            if best.versions != (version[a as usize], version[b as usize]) {
                continue;
            }
            // The estimate was from below: with its own ratio the union waits again, and is made if it is the cheapest still.
            let Some(ratio) = best.ratio else {
                heap.extend(self.evaluated(best));
                let cells = [a, b].map(|r| self.regions.all[r as usize].cells.len());
                self.checkpoint.after(WORK_PER_CELL * (cells[0] + cells[1]))?;
                continue;
            };
            let Some(union) = self.regions.union(a, b) else { continue };
            self.regions.merge(a, b, union);
            self.ratios[a as usize] = ratio;
            version[a as usize] += 1;
            version[b as usize] += 1;
            for c in self.regions.neighbours(a).into_iter().filter(|c| *c != a) {
                heap.extend(self.candidate((a.min(c), a.max(c)), version));
            }
        }
        Ok(())
    }

    /// A legal union. Its ratio is not known yet: it is taken to be that of its parts, as solving for it costs most,
    /// and many candidates are overtaken before.
    fn candidate(&mut self, (a, b): (u32, u32), version: &[u32]) -> Option<Candidate> {
        if self.groups[a as usize] != self.groups[b as usize] || self.are_faces_apart((a, b)) {
            return None;
        }
        let union =
            self.regions.union(a, b).filter(|u| self.limits.allow(&self.regions.shape(&u.region, &u.outline)))?;
        let ratio = self.ratios[a as usize].max(self.ratios[b as usize]);
        let versions = (version[a as usize], version[b as usize]);
        Some(Candidate { cost: self.cost((a, b), &union, ratio), pair: (a, b), versions, ratio: None })
    }

    /// The candidate with its own area ratio; none where that is too large.
    fn evaluated(&mut self, candidate: Candidate) -> Option<Candidate> {
        let (a, b) = candidate.pair;
        let union = self.regions.union(a, b)?;
        let cells_of = |r: u32| self.regions.all[r as usize].cells.iter().copied();
        let cells: Vec<u32> = cells_of(a).chain(cells_of(b)).collect();
        let loops = &union.outline.loops;
        let ratio = self.predictions.area_ratio(self.regions.complex, self.graph, &cells, loops);
        let evaluated = Candidate { cost: self.cost((a, b), &union, ratio), ratio: Some(ratio), ..candidate };
        (ratio <= self.limits.area_ratio).then_some(evaluated)
    }

    /// Whether two regions meet in a feature, and are faces. That costs no more than the smaller of them: a plate with n holes has n
    /// neighbours, and n times as much around it.
    fn are_faces_apart(&self, (a, b): (u32, u32)) -> bool {
        let (shared, feature) = self.regions.shared(a, b);
        2.0 * feature > shared && self.is_face(a) && self.is_face(b)
    }

    /// Whether features keep a region apart: what has little of them around it is no face of its own, unless it is flat.
    fn is_face(&self, region: u32) -> bool {
        let is_kept = |c: &u32| self.regions.complex.cells[*c as usize].is_kept;
        self.is_sharp(region) || self.regions.all[region as usize].cells.iter().any(is_kept)
    }

    /// Whether the features around a region, weighed by their sharpness, are long enough.
    fn is_sharp(&self, region: u32) -> bool {
        let mut sum = 0.0;
        // As far as that takes: most regions have many more.
        self.min_outline <= 0.0
            || self.regions.all[region as usize].boundary.iter().any(|arc| {
                sum += self.regions.complex.arcs[*arc as usize].sharp;
                sum >= self.min_outline
            })
    }

    fn cost(&self, (a, b): (u32, u32), union: &Union, ratio: f64) -> f64 {
        let outline = |r: u32| self.regions.all[r as usize].length;
        let region = &union.region;
        // Against the circumference of a round disk of the same area.
        let excess = region.length / (4.0 * PI * region.area).sqrt() - 1.0;
        // Area vectors are twice as long as areas are large: those of a plane add up to that, those of a sphere to nothing.
        let spread = 1.0 - norm(region.normal) / (2.0 * region.area);
        let smaller_outline = outline(a).min(outline(b));
        let w = &self.weights;
        w.ratio * ratio.log10() + w.roundness * excess.max(0.0) + w.spread * spread
            - w.shared * union.shared / smaller_outline
    }
}
