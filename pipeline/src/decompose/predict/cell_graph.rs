//! The graph of cells: finite volumes, and the conductances between them.

use super::super::BoundaryShape;
use super::super::complex::{Complex, NONE};
use super::super::voronoi::Graph;
use crate::topology::csr::Csr;
use crate::vec3::{Vec3, distance};

/// The graph of cells.
#[derive(Clone, Debug)]
pub(in super::super) struct CellGraph {
    centroids: Vec<Vec3>,
    areas: Vec<f64>,
    /// Per cell the cells beside it, ascending.
    links: Csr<Link>,
    /// Per cell its place in an order that is good to eliminate cells in.
    rank: Vec<u32>,
    /// Per cell its first half-arc, and the number of all.
    first_arcs: Vec<u32>,
    /// Which maps are predicted.
    boundary: BoundaryShape,
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
    pub(in super::super) fn new(complex: &Complex, boundary: BoundaryShape) -> Self {
        let centroids: Vec<Vec3> = complex.cells.iter().map(|c| c.centroid).collect();
        let areas = complex.cells.iter().map(|c| c.area).collect();
        let count = complex.cells.len();
        let first_arcs = (0..=count as u32).map(|c| complex.arcs.partition_point(|a| a.cell < c) as u32).collect();
        let mut graph = Self { centroids, areas, links: Csr::default(), rank: Vec::new(), first_arcs, boundary };
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

    pub(super) fn cells(&self) -> usize {
        self.areas.len()
    }

    pub(super) fn boundary(&self) -> BoundaryShape {
        self.boundary
    }

    pub(super) fn rank(&self, cell: u32) -> u32 {
        self.rank[cell as usize]
    }

    /// The half-arcs around a cell.
    pub(super) fn arcs(&self, cell: u32) -> std::ops::Range<u32> {
        self.first_arcs[cell as usize]..self.first_arcs[cell as usize + 1]
    }

    /// The cells beside a cell, and the conductances between.
    pub(super) fn conductances(&self, cell: u32) -> impl Iterator<Item = (u32, f64)> {
        self.links(cell).iter().map(|link| (link.to, link.conductance))
    }

    pub(super) fn centroid(&self, cell: u32) -> Vec3 {
        self.centroids[cell as usize]
    }

    pub(in super::super) fn area(&self, cell: u32) -> f64 {
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

/// Parts of this many cells are not dissected. By experience: the factor of so few is nearly full in any order.
const FEW: usize = 6;
