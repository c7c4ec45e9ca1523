//! How strongly a harmonic map of a union of cells would stretch: the area ratio, predicted on the graph of cells.
//!
//! Cells are finite volumes: a conductance l/d joins two of them (l the length of their common edge, d the distance
//! of their centroids), and the outer loop is prescribed on the unit circle by arc length, as for the map itself.
//! Inner loops are closed by one node each, as by a fan. Where a map is nearly conformal, its area scale is half the
//! density of its Dirichlet energy; the ratio is that of the extreme quantiles of this density over stars of cells.

use super::complex::{Complex, NONE};
use super::graph_laplacian::GraphLaplacian;
use super::voronoi::Graph;
use crate::fem::dofs::Dofs;
use crate::measure::quantiles::{Weighted, quantiles};
use crate::topology::csr::Csr;
use crate::vec3::{Vec3, distance};
use std::f64::consts::TAU;

/// The graph of cells.
#[derive(Clone, Debug)]
pub(super) struct CellGraph {
    centroids: Vec<Vec3>,
    areas: Vec<f64>,
    /// Per cell the cells beside it, ascending.
    links: Csr<Link>,
    /// Per cell its place in an order that is good to eliminate cells in.
    rank: Vec<u32>,
}

/// A cell beside another one.
#[derive(Clone, Copy, Debug, Default)]
struct Link {
    to: u32,
    conductance: f64,
    distance: f64,
    /// Whether more than half of the common edge is a feature.
    feature: bool,
}

/// A half-arc between two cells.
#[derive(Clone, Copy)]
struct Contact {
    /// Its own cell, and the one beyond.
    cells: (u32, u32),
    length: f64,
    /// How much of the length is a feature.
    feature: f64,
}

impl CellGraph {
    pub(super) fn new(complex: &Complex) -> Self {
        let centroids: Vec<Vec3> = complex.cells.iter().map(|c| c.centroid).collect();
        let areas = complex.cells.iter().map(|c| c.area).collect();
        let count = complex.cells.len();
        let mut graph = Self { centroids, areas, links: Csr::default(), rank: Vec::new() };
        let inner = complex.arcs.iter().filter(|a| a.twin != NONE);
        let mut contacts = Vec::with_capacity(complex.arcs.len());
        for arc in inner {
            let beyond = complex.arcs[arc.twin as usize].cell;
            contacts.push(Contact { cells: (arc.cell, beyond), length: arc.length, feature: arc.feature });
        }
        // By lengths, too, so that sums do not depend on the numbering of the arcs.
        contacts.sort_unstable_by(|x, y| x.cells.cmp(&y.cells).then(x.length.total_cmp(&y.length)));
        let mut links: Vec<(u32, Link)> = Vec::new();
        for run in contacts.chunk_by(|x, y| x.cells == y.cells) {
            let (from, to) = run[0].cells;
            let length: f64 = run.iter().map(|contact| contact.length).sum();
            let sharp: f64 = run.iter().map(|contact| contact.feature).sum();
            let distance = graph.spacing(from, to);
            // As of a strip as wide as the common edge is long, from one centroid to the other.
            let conductance = length / distance;
            links.push((from, Link { to, conductance, distance, feature: 2.0 * sharp > length }));
        }
        graph.links = Csr::sorted(count, || links.iter().copied());
        graph.rank = graph.dissected();
        graph
    }

    /// Nested dissection (George 1973, doi 10.1137/0710032): first one half, then the other, then the cells of the
    /// first one that touch the other; and so on in the halves. Ends as halves are smaller.
    fn dissected(&self) -> Vec<u32> {
        let count = self.areas.len();
        let mut rank = vec![0; count];
        let mut half = vec![usize::MAX; count];
        // Parts yet to be ranked, with the rank after their last one.
        let mut parts = vec![((0..count as u32).collect::<Vec<u32>>(), count as u32)];
        let mut made = 0;
        while let Some((mut part, end)) = parts.pop() {
            if part.len() <= FEW {
                part.iter().zip((0..end).rev()).for_each(|(c, r)| rank[*c as usize] = r);
                continue;
            }
            self.sort_along_widest(&mut part);
            let second = part.split_off(part.len() / 2);
            made += 1;
            second.iter().for_each(|c| half[*c as usize] = made);
            let touches = |c: &u32| self.links(*c).iter().any(|l| half[l.to as usize] == made);
            let (between, first): (Vec<u32>, Vec<u32>) = part.into_iter().partition(touches);
            between.iter().zip((0..end).rev()).for_each(|(c, r)| rank[*c as usize] = r);
            let end = end - between.len() as u32;
            parts.push((first, end - second.len() as u32));
            parts.push((second, end));
        }
        rank
    }

    /// Sorts cells along the axis in which their centroids spread most.
    fn sort_along_widest(&self, part: &mut [u32]) {
        let along = |c: u32, k: usize| self.centroids[c as usize][k];
        let width = |k: usize| {
            let range = part.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), c| {
                (low.min(along(*c, k)), high.max(along(*c, k)))
            });
            range.1 - range.0
        };
        let axis = (1..3).fold(0, |best, k| if width(k) > width(best) { k } else { best });
        part.sort_unstable_by(|a, b| along(*a, axis).total_cmp(&along(*b, axis)).then(a.cmp(b)));
    }

    /// The distance of two centroids; never below a small share of the cells' size, as those of cells that are folded or
    /// reach around each other may fall together: their conductance would be infinite.
    fn spacing(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (a as usize, b as usize);
        let size = (self.areas[a] + self.areas[b]).sqrt();
        distance(self.centroids[a], self.centroids[b]).max(0.1 * size)
    }

    fn links(&self, cell: u32) -> &[Link] {
        self.links.row(cell as usize)
    }

    pub(super) fn area(&self, cell: u32) -> f64 {
        self.areas[cell as usize]
    }
}

/// Without the links across features.
impl Graph for CellGraph {
    fn len(&self) -> usize {
        self.areas.len()
    }

    fn each_neighbour(&self, node: usize, mut visit: impl FnMut(usize, f64)) {
        let smooth = self.links(node as u32).iter().filter(|l| !l.feature);
        smooth.for_each(|l| visit(l.to as usize, l.distance));
    }
}

/// The work of predicting a ratio, per cell: as long as so many triangles are looked at.
pub(super) const WORK_PER_CELL: usize = 20;

/// Parts of this many cells are not dissected. By experience: the factor of so few is nearly full in any order.
const FEW: usize = 6;

/// A run of half-arcs of one cell along a loop.
struct Run {
    cell: u32,
    length: f64,
    middle: Vec3,
    /// Where its middle is, as a share of the loop.
    at: f64,
}

/// The runs of a loop.
fn runs(complex: &Complex, boundary_loop: &[u32]) -> Vec<Run> {
    let arc = |a: &u32| &complex.arcs[*a as usize];
    let total: f64 = boundary_loop.iter().map(|a| arc(a).length).sum();
    let mut travelled = 0.0;
    let mut runs = Vec::new();
    for run in boundary_loop.chunk_by(|a, b| arc(a).cell == arc(b).cell) {
        let length: f64 = run.iter().map(|a| arc(a).length).sum();
        // The half-arc on which the first half of the length ends; rounding may leave none.
        let mut left = 0.5 * length;
        let half_way = run.iter().find(|a| {
            left -= arc(a).length;
            left <= 0.0
        });
        let at = (travelled + 0.5 * length) / total;
        travelled += length;
        let middle = arc(half_way.unwrap_or(&run[0])).middle;
        runs.push(Run { cell: arc(&run[0]).cell, length, middle, at });
    }
    runs
}

/// The system of one union.
struct System<'a> {
    graph: &'a CellGraph,
    /// The unknowns of the union's cells, out of those of the graph.
    dofs: &'a Dofs,
    /// Those of the cells, then those of the nodes that close inner loops.
    unknowns: usize,
    links: Vec<([u32; 2], f64)>,
    /// Unknown, conductance, place on the circle.
    rim: Vec<(u32, f64, [f64; 2])>,
}

/// Loops shorter than this share of the longest are never the outer one. Each that may be costs a map. By experience: as a
/// rule the map is stretched more where a small hole is blown up to the circle.
const LONG: f64 = 0.5;

/// What a harmonic map of some cells would be like.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PredictedMap {
    /// Its area ratio: at least 1, infinite where there is no map in doubles.
    pub area_ratio: f64,
    /// The loop that is the outer one.
    pub outer: usize,
}

/// The harmonic map of `cells`, whose union has these loops of half-arcs, with the outer one among the long ones that gives
/// the least area ratio. The ratio of a single cell, of which nothing can be told, is 1.
pub(super) fn predict(complex: &Complex, graph: &CellGraph, cells: &[u32], loops: &[Vec<u32>]) -> PredictedMap {
    let length = |l: &Vec<u32>| l.iter().map(|a| complex.arcs[*a as usize].length).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(length).collect();
    let longest = lengths.iter().fold(0.0, |m, l| f64::max(m, *l));
    let mut cells = cells.to_vec();
    cells.sort_unstable_by_key(|c| graph.rank[*c as usize]);
    let dofs = Dofs::new(graph.areas.len(), cells);
    let runs: Vec<Vec<Run>> = loops.iter().map(|l| runs(complex, l)).collect();
    let with_outer = |outer: usize| {
        let mut system = System::new(graph, &dofs);
        for (i, runs) in runs.iter().enumerate() {
            if i == outer { system.prescribe(runs) } else { system.close(runs, lengths[i] / TAU) }
        }
        system.solve().map_or(f64::INFINITY, |uv| system.ratio(&uv))
    };
    let mut long = (0..loops.len()).filter(|i| lengths[*i] >= LONG * longest);
    if dofs.count() == 1 {
        return PredictedMap { area_ratio: 1.0, outer: long.next().unwrap_or(0) };
    }
    let mut best = PredictedMap { area_ratio: f64::INFINITY, outer: long.clone().next().unwrap_or(0) };
    for outer in long {
        let area_ratio = with_outer(outer);
        // Of loops that are as good, the first one.
        if area_ratio.total_cmp(&best.area_ratio).is_lt() {
            best = PredictedMap { area_ratio, outer };
        }
    }
    best
}

impl<'a> System<'a> {
    fn new(graph: &'a CellGraph, dofs: &'a Dofs) -> Self {
        let mut links = Vec::new();
        for (i, c) in dofs.free().iter().enumerate() {
            for link in graph.links(*c) {
                match dofs.unknown(link.to as usize) {
                    Some(j) if i < j => links.push(([i as u32, j as u32], link.conductance)),
                    _ => {}
                }
            }
        }
        Self { graph, dofs, unknowns: dofs.count(), links, rim: Vec::new() }
    }

    /// The unknown of a cell of the union.
    fn unknown(&self, cell: u32) -> u32 {
        self.dofs.element(&[cell as usize])[0]
    }

    /// From the middle of a run to the centroid of its cell.
    fn reach(&self, run: &Run) -> f64 {
        let cell = run.cell as usize;
        distance(self.graph.centroids[cell], run.middle).max(0.1 * self.graph.areas[cell].sqrt())
    }

    /// Holds the outer loop on the circle.
    fn prescribe(&mut self, runs: &[Run]) {
        for run in runs {
            let (sin, cos) = (TAU * run.at).sin_cos();
            self.rim.push((self.unknown(run.cell), run.length / self.reach(run), [cos, sin]));
        }
    }

    /// Closes an inner loop by a node at this distance from it.
    fn close(&mut self, runs: &[Run], radius: f64) {
        let centre = self.unknowns as u32;
        self.unknowns += 1;
        for run in runs {
            let conductance = run.length / (self.reach(run) + radius);
            self.links.push(([self.unknown(run.cell), centre], conductance));
        }
    }

    fn solve(&self) -> Option<Vec<[f64; 2]>> {
        let mut laplacian = GraphLaplacian::new(self.unknowns);
        self.links.iter().for_each(|(pair, w)| laplacian.add_edge(*pair, *w));
        self.rim.iter().for_each(|(i, w, uv)| laplacian.add_dirichlet(*i, *w, *uv));
        laplacian.solve()
    }

    /// The ratio of the quantiles of the energy density.
    fn ratio(&self, uv: &[[f64; 2]]) -> f64 {
        let squared = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
        let mut energy = vec![0.0; self.unknowns];
        for ([i, j], w) in &self.links {
            let half = 0.5 * w * squared(uv[*i as usize], uv[*j as usize]);
            energy[*i as usize] += half;
            energy[*j as usize] += half;
        }
        for (i, w, p) in &self.rim {
            energy[*i as usize] += w * squared(uv[*i as usize], *p);
        }
        let mut densities: Vec<Weighted> = (0..self.dofs.count()).map(|i| self.density(i, &energy)).collect();
        let [low, high] = quantiles(&mut densities, [QUANTILE, 1.0 - QUANTILE]);
        if low > 0.0 { (high / low).max(1.0) } else { f64::INFINITY }
    }

    /// The energy density of a star of cells, and the area of its middle one.
    fn density(&self, i: usize, energy: &[f64]) -> Weighted {
        let area = self.graph.area(self.dofs.free()[i]);
        Weighted { value: energy[i] / area, weight: area }
    }
}

/// The share of the area that is left out at either end: as in the area ratio of a map, which is what is predicted.
const QUANTILE: f64 = 0.001;
