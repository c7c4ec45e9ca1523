//! How strongly a harmonic map of a union of cells would stretch: the area ratio, foretold on the graph of cells.
//!
//! Cells are finite volumes: a conductance l/d joins two of them (l the length of their common edge, d the distance
//! of their centroids), and the outer loop is prescribed on the unit circle by arc length, as for the map itself.
//! Inner loops are closed by one node each, as by a fan. Where a map is nearly conformal, its area scale is half the
//! density of its Dirichlet energy; the ratio is that of the extreme quantiles of this density over stars of cells.

use super::dual::Dual;
use super::voronoi::{Cells, Graph};
use crate::id::HalfEdgeId;
use crate::space::{Vec3, distance};
use crate::sparse::{PRESCRIBED, Pattern};
use std::f64::consts::TAU;

/// The graph of cells.
#[derive(Clone, Debug)]
pub(super) struct CellGraph {
    centroids: Vec<Vec3>,
    areas: Vec<f64>,
    starts: Vec<u32>,
    links: Vec<Link>,
}

/// A cell beside another one.
#[derive(Clone, Copy, Debug)]
struct Link {
    to: u32,
    conductance: f64,
    distance: f64,
    /// Whether more than half of the common edge is a feature.
    feature: bool,
}

impl CellGraph {
    pub(super) fn new(dual: &Dual, cells: &Cells) -> Self {
        let (mut centroids, mut areas) = (vec![[0.0; 3]; cells.count], vec![0.0; cells.count]);
        for (f, cell) in cells.of.iter().enumerate() {
            let (area, centroid) = (dual.area(f), dual.centroid(f));
            areas[*cell as usize] += area;
            (0..3).for_each(|k| centroids[*cell as usize][k] += area * centroid[k]);
        }
        centroids.iter_mut().zip(&areas).for_each(|(c, a)| *c = c.map(|x| x / a));
        let cell = |h: HalfEdgeId| cells.of[h.face().index()];
        let pairs = dual.half_edges().filter_map(|h| Some((cell(h), cell(dual.across(h)?), h)));
        let mut pairs: Vec<_> = pairs.filter(|(a, b, _)| a != b).collect();
        pairs.sort_unstable();
        let mut graph = Self { centroids, areas, starts: vec![0; cells.count + 1], links: Vec::new() };
        for run in pairs.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
            let (a, b, _) = run[0];
            let length: f64 = run.iter().map(|(_, _, h)| dual.length(*h)).sum();
            let sharp: f64 = run.iter().filter(|(_, _, h)| dual.is_feature(*h)).map(|(_, _, h)| dual.length(*h)).sum();
            let distance = graph.spacing(a, b);
            let feature = 2.0 * sharp > length;
            graph.links.push(Link { to: b, conductance: length / distance, distance, feature });
            graph.starts[a as usize + 1] += 1;
        }
        (0..cells.count).for_each(|c| graph.starts[c + 1] += graph.starts[c]);
        graph
    }

    /// The distance of two centroids; never below a small share of the cells' size (folded cells).
    fn spacing(&self, a: u32, b: u32) -> f64 {
        let (a, b) = (a as usize, b as usize);
        let size = (self.areas[a] + self.areas[b]).sqrt();
        distance(self.centroids[a], self.centroids[b]).max(0.1 * size)
    }

    fn links(&self, cell: u32) -> &[Link] {
        &self.links[self.starts[cell as usize] as usize..self.starts[cell as usize + 1] as usize]
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

/// A run of boundary half-edges of one cell.
struct Arc {
    cell: u32,
    length: f64,
    middle: Vec3,
    /// Where its middle is, as a share of the loop.
    at: f64,
}

/// The runs of a loop.
fn arcs(dual: &Dual, cell_of: &[u32], turn: &[HalfEdgeId]) -> Vec<Arc> {
    let cell = |h: &HalfEdgeId| cell_of[h.face().index()];
    let total: f64 = turn.iter().map(|h| dual.length(*h)).sum();
    let mut travelled = 0.0;
    let arc = |run: &[HalfEdgeId]| {
        let length: f64 = run.iter().map(|h| dual.length(*h)).sum();
        let at = (travelled + 0.5 * length) / total;
        travelled += length;
        Arc { cell: cell(&run[0]), length, middle: dual.middle(run[run.len() / 2]), at }
    };
    turn.chunk_by(|g, h| cell(g) == cell(h)).map(arc).collect()
}

/// The system of one union.
struct System<'a> {
    graph: &'a CellGraph,
    cells: &'a [u32],
    /// Per cell of the graph its unknown, or [`PRESCRIBED`].
    number: Vec<u32>,
    unknowns: usize,
    links: Vec<([u32; 2], f64)>,
    /// Unknown, conductance, place on the circle.
    rim: Vec<(u32, f64, [f64; 2])>,
}

/// Loops shorter than this share of the longest are never the outer one.
const LONG: f64 = 0.5;

/// The area ratio of a harmonic map of `cells`, whose union has these loops, and the best choice of the outer one
/// among the long ones. At least 1, infinite where there is no map in doubles.
pub(super) fn area_ratio(
    dual: &Dual,
    cell_of: &[u32],
    graph: &CellGraph,
    cells: &[u32],
    loops: &[Vec<HalfEdgeId>],
) -> (f64, usize) {
    let length = |l: &Vec<HalfEdgeId>| l.iter().map(|h| dual.length(*h)).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(length).collect();
    let longest = lengths.iter().fold(0.0, |m, l| f64::max(m, *l));
    let arcs: Vec<Vec<Arc>> = loops.iter().map(|l| arcs(dual, cell_of, l)).collect();
    let with_outer = |outer: usize| {
        let mut system = System::new(graph, cells);
        for (i, arcs) in arcs.iter().enumerate() {
            if i == outer { system.prescribe(arcs) } else { system.close(arcs, lengths[i] / TAU) }
        }
        system.solve().map_or(f64::INFINITY, |places| system.ratio(&places))
    };
    let long = (0..loops.len()).filter(|i| lengths[*i] >= LONG * longest);
    let all = long.map(|outer| (with_outer(outer), outer));
    all.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))).unwrap_or((f64::INFINITY, 0))
}

impl<'a> System<'a> {
    fn new(graph: &'a CellGraph, cells: &'a [u32]) -> Self {
        let mut number = vec![PRESCRIBED; graph.areas.len()];
        cells.iter().zip(0..).for_each(|(c, i)| number[*c as usize] = i);
        let mut links = Vec::new();
        for (c, i) in cells.iter().zip(0..) {
            for link in graph.links(*c) {
                let j = number[link.to as usize];
                if j != PRESCRIBED && i < j {
                    links.push(([i, j], link.conductance));
                }
            }
        }
        Self { graph, cells, number, unknowns: cells.len(), links, rim: Vec::new() }
    }

    /// From the middle of an arc to the centroid of its cell.
    fn reach(&self, arc: &Arc) -> f64 {
        let cell = arc.cell as usize;
        distance(self.graph.centroids[cell], arc.middle).max(0.1 * self.graph.areas[cell].sqrt())
    }

    /// Holds the outer loop on the circle.
    fn prescribe(&mut self, arcs: &[Arc]) {
        for arc in arcs {
            let (sin, cos) = (TAU * arc.at).sin_cos();
            self.rim.push((self.number[arc.cell as usize], arc.length / self.reach(arc), [cos, sin]));
        }
    }

    /// Closes an inner loop by a node at this distance from it.
    fn close(&mut self, arcs: &[Arc], radius: f64) {
        let centre = self.unknowns as u32;
        self.unknowns += 1;
        for arc in arcs {
            let conductance = arc.length / (self.reach(arc) + radius);
            self.links.push(([self.number[arc.cell as usize], centre], conductance));
        }
    }

    fn solve(&self) -> Option<Vec<f64>> {
        let n = self.unknowns;
        let elements: Vec<[u32; 2]> = self.links.iter().map(|l| l.0).chain((0..n as u32).map(|i| [i, i])).collect();
        let pattern = Pattern::new(n, &elements);
        let mut values = pattern.zeros();
        for (e, (_, w)) in self.links.iter().enumerate() {
            pattern.add(&mut values, e, &[[*w, -w], [-w, *w]]);
        }
        let diagonal: Vec<usize> = pattern.diagonal().collect();
        let mut rhs = vec![0.0; 2 * n];
        for (i, w, place) in &self.rim {
            values[diagonal[*i as usize]] += w;
            rhs[*i as usize] += w * place[0];
            rhs[n + *i as usize] += w * place[1];
        }
        pattern.analyse().ok()?.factorise(&values).ok()?.solve(&mut rhs, 2);
        Some(rhs)
    }

    /// The ratio of the quantiles of the energy density.
    fn ratio(&self, places: &[f64]) -> f64 {
        let n = self.unknowns;
        let place = |i: u32| [places[i as usize], places[n + i as usize]];
        let squared = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
        let mut energy = vec![0.0; n];
        for ([i, j], w) in &self.links {
            let half = 0.5 * w * squared(place(*i), place(*j));
            energy[*i as usize] += half;
            energy[*j as usize] += half;
        }
        for (i, w, p) in &self.rim {
            energy[*i as usize] += w * squared(place(*i), *p);
        }
        let mut densities: Vec<(f64, f64)> = (0..self.cells.len()).map(|i| self.density(i, &energy)).collect();
        densities.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let (low, high) = (quantile(&densities, QUANTILE), quantile(&densities, 1.0 - QUANTILE));
        if low > 0.0 { (high / low).max(1.0) } else { f64::INFINITY }
    }

    /// The energy density of a star of cells, and the area of its middle one.
    fn density(&self, i: usize, energy: &[f64]) -> (f64, f64) {
        let area = self.graph.area(self.cells[i]);
        (energy[i] / area, area)
    }
}

/// The share of the area that is left out at either end.
const QUANTILE: f64 = 0.001;

/// The first value that this share of the total weight does not exceed.
fn quantile(sorted: &[(f64, f64)], share: f64) -> f64 {
    let mut left = share * sorted.iter().map(|d| d.1).sum::<f64>();
    let reached = sorted.iter().find(|d| {
        left -= d.1;
        left <= 0.0
    });
    reached.or(sorted.last()).map_or(1.0, |d| d.0)
}
