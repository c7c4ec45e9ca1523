//! How strongly a map of a union of cells would stretch: the area ratio, predicted on the graph of cells.
//!
//! Cells are finite volumes: a conductance l/d joins two of them (l the length of their common edge, d the distance
//! of their centroids). What is predicted is the map that the union will have as a chart: the one with a [`natural`]
//! boundary, where that does not cover itself, else the one onto the [`disk`].

mod cell_graph;
mod disk;
mod natural;
mod runs;

use super::BoundaryShape;
use super::complex::{Complex, NONE};
use crate::fem::dofs::Dofs;
use crate::measure::quantiles::{Weighted, extreme_ratio};
use crate::vec3::distance;
pub(super) use cell_graph::CellGraph;
use natural::NaturalMap;
use runs::{Run, runs};
use std::collections::BTreeMap;

/// The work of predicting a ratio, per cell: as long as so many triangles are looked at.
pub(super) const WORK_PER_CELL: usize = 20;

/// Loops shorter than this share of the longest are never the outer one. Each that may be costs a map. By experience: as a
/// rule the map is stretched more where a small hole is blown up to the circle.
const LONG: f64 = 0.5;

/// What a map of some cells would be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PredictedMap {
    /// Its area ratio: at least 1, infinite where there is no map in doubles.
    pub area_ratio: f64,
    /// The loop that is the outer one.
    pub outer: usize,
}

/// The map of `cells`, whose union has these loops of half-arcs, with the outer one among the long ones that gives
/// the least area ratio. The ratio of a single cell, of which nothing can be told, is 1.
pub(super) fn predict(complex: &Complex, graph: &CellGraph, cells: &[u32], loops: &[Vec<u32>]) -> PredictedMap {
    let length = |l: &Vec<u32>| l.iter().map(|a| complex.arcs[*a as usize].length).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(length).collect();
    let longest = lengths.iter().fold(0.0, |m, l| f64::max(m, *l));
    let long: Vec<usize> = (0..loops.len()).filter(|i| lengths[*i] >= LONG * longest).collect();
    let first = long.first().copied().unwrap_or(0);
    if cells.len() == 1 {
        return PredictedMap { area_ratio: 1.0, outer: first };
    }
    let mut cells = cells.to_vec();
    cells.sort_unstable_by_key(|c| graph.rank(*c));
    let dofs = Dofs::new(graph.cells(), cells);
    let union = CellUnion::new(complex, graph, &dofs, loops, lengths);
    // Of loops that are as good, the first one is taken.
    if graph.boundary() == BoundaryShape::Natural {
        let maps = long.iter().filter_map(|outer| NaturalMap::new(&union, *outer));
        let best = maps.min_by(|a, b| a.area_ratio.total_cmp(&b.area_ratio));
        if let Some(best) = best.filter(|map| map.lies_flat(&union)) {
            return best.predicted();
        }
    }
    let on_disk = |outer: &usize| PredictedMap { area_ratio: disk::area_ratio(&union, *outer), outer: *outer };
    let best = long.iter().map(on_disk).min_by(|a, b| a.area_ratio.total_cmp(&b.area_ratio));
    best.unwrap_or(PredictedMap { area_ratio: f64::INFINITY, outer: first })
}

/// Area ratios of maps that were predicted: several strategies come by the same unions, and of many components, each by its own,
/// all do (of fracture_network_dfn2, 80,000 predictions of 26,000 unions).
#[derive(Debug, Default)]
pub(super) struct Predictions {
    /// By the cells of the union, ascending.
    ratios: BTreeMap<Box<[u32]>, f64>,
}

impl Predictions {
    /// The area ratio of [`predict`].
    pub(super) fn area_ratio(
        &mut self,
        complex: &Complex,
        graph: &CellGraph,
        cells: &[u32],
        loops: &[Vec<u32>],
    ) -> f64 {
        let mut key: Box<[u32]> = cells.into();
        key.sort_unstable();
        if let Some(ratio) = self.ratios.get(&key) {
            return *ratio;
        }
        let ratio = predict(complex, graph, cells, loops).area_ratio;
        self.ratios.insert(key, ratio);
        ratio
    }
}

/// Some cells, their loops, and what all systems have in common.
struct CellUnion<'a> {
    complex: &'a Complex,
    graph: &'a CellGraph,
    /// The unknowns of the union's cells, out of those of the graph.
    dofs: &'a Dofs,
    loops: &'a [Vec<u32>],
    lengths: Vec<f64>,
    runs: Vec<Vec<Run>>,
    /// Pairs of unknowns, and their conductances.
    links: Vec<([u32; 2], f64)>,
}

impl<'a> CellUnion<'a> {
    fn new(
        complex: &'a Complex,
        graph: &'a CellGraph,
        dofs: &'a Dofs,
        loops: &'a [Vec<u32>],
        lengths: Vec<f64>,
    ) -> Self {
        let mut links = Vec::new();
        for (i, c) in dofs.free().iter().enumerate() {
            for (other, conductance) in graph.conductances(*c) {
                match dofs.unknown(other as usize) {
                    Some(j) if i < j => links.push(([i as u32, j as u32], conductance)),
                    _ => {}
                }
            }
        }
        let runs = loops.iter().map(|l| runs(complex, l)).collect();
        Self { complex, graph, dofs, loops, lengths, runs, links }
    }

    /// The number of cells.
    fn cells(&self) -> usize {
        self.dofs.count()
    }

    /// The unknown of a cell of the union.
    fn unknown(&self, cell: u32) -> u32 {
        self.dofs.element(&[cell as usize])[0]
    }

    /// From the middle of a run to the centroid of its cell.
    fn reach(&self, run: &Run) -> f64 {
        distance(self.graph.centroid(run.cell), run.middle).max(0.1 * self.graph.area(run.cell).sqrt())
    }

    /// The other side of a half-arc, where that belongs to the union.
    fn inner_twin(&self, arc: u32) -> Option<u32> {
        let twin = Some(self.complex.arcs[arc as usize].twin).filter(|twin| *twin != NONE)?;
        let cell = self.complex.arcs[twin as usize].cell;
        self.dofs.unknown(cell as usize).map(|_| twin)
    }

    /// The ratio of the extreme quantiles of what the scale of areas is in each cell; infinite where one of them is not
    /// positive.
    fn ratio(&self, scale: impl Fn(usize, f64) -> f64) -> f64 {
        let weighted = |(i, cell): (usize, &u32)| {
            let area = self.graph.area(*cell);
            Weighted { value: scale(i, area), weight: area }
        };
        let mut scales: Vec<Weighted> = self.dofs.free().iter().enumerate().map(weighted).collect();
        extreme_ratio(&mut scales).max(1.0)
    }
}
