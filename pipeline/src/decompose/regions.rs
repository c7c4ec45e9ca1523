//! Regions: unions of cells on their way to charts, and what they would be if two of them were united.
//!
//! A region is known by its boundary half-arcs and its Euler number; everything that decides whether it is a chart
//! follows from these: walking along the boundary counts its loops and the corners it visits twice. So a union is
//! judged at the cost of its boundary, not of its area, and whatever the number of triangles.

use super::complex::{Complex, NONE};
use crate::topology::VisitStamps;
use crate::topology::loops::{next_on_boundary, walk_loops};
use crate::vec3::Vec3;

/// What is known of a region.
#[derive(Clone, Debug, Default)]
pub(super) struct Region {
    /// The cells in it; none: the region was united with another one.
    pub cells: Vec<u32>,
    /// The half-arcs around it, and their length.
    pub boundary: Vec<u32>,
    pub length: f64,
    pub faces: usize,
    /// The Euler number of the region, opened where it only touches itself.
    pub euler: i64,
    pub area: f64,
    /// The sum of the area vectors.
    pub normal: Vec3,
}

/// The boundary of a region, walked.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    pub loops: Vec<Vec<u32>>,
    /// How often it visits a vertex again.
    pub pinches: usize,
    /// Whether the region lies on both sides of an edge of its boundary: see [`super::dual::Dual::coincident_faces`].
    pub meets_itself: bool,
}

/// What decides whether a region is a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    pub faces: usize,
    pub euler: i64,
    pub loops: usize,
    /// Loops with a seam.
    pub seam_loops: usize,
    pub pinches: usize,
    pub meets_itself: bool,
}

/// A union that was looked at.
#[derive(Clone, Debug)]
pub(super) struct Union {
    pub region: Region,
    pub outline: Outline,
    /// Length of the boundary that vanishes.
    pub shared: f64,
}

/// A partition of the cells into regions.
pub(super) struct Regions<'a> {
    pub complex: &'a Complex,
    /// Per cell its region.
    pub of_cell: Vec<u32>,
    pub all: Vec<Region>,
    /// The half-arcs and the corners that the walk at hand has visited.
    seen_arcs: VisitStamps,
    seen_corners: VisitStamps,
}

impl<'a> Regions<'a> {
    /// One region per group of cells: `of_cell` tells the group of each cell, of `count` groups.
    pub(super) fn new(complex: &'a Complex, of_cell: Vec<u32>, count: usize) -> Self {
        let mut made = Self {
            complex,
            of_cell,
            all: vec![Region::default(); count],
            seen_arcs: VisitStamps::new(complex.arcs.len()),
            seen_corners: VisitStamps::new(complex.corners.len()),
        };
        for (c, cell) in complex.cells.iter().enumerate() {
            let region = &mut made.all[made.of_cell[c] as usize];
            region.cells.push(c as u32);
            region.faces += cell.faces;
            region.euler += cell.euler;
            region.area += cell.area;
            (0..3).for_each(|k| region.normal[k] += cell.normal[k]);
        }
        made.bound();
        made
    }

    /// Finds the boundaries; arcs and corners inside count for the Euler numbers.
    fn bound(&mut self) {
        let mut counted = vec![false; self.complex.corners.len()];
        let all = 0..self.complex.arcs.len() as u32;
        let (outer, inner): (Vec<u32>, Vec<u32>) = all.partition(|a| self.beyond(*a) != Some(self.of(*a)));
        for arc in outer {
            let region = self.of(arc) as usize;
            counted[self.complex.arcs[arc as usize].from as usize] = true;
            self.all[region].length += self.complex.arcs[arc as usize].length;
            self.all[region].boundary.push(arc);
        }
        // The Euler number of a union is that of its cells, less the arcs along which they are glued, plus the corners that come
        // to lie inside: each corner is counted once, and an arc by its lesser half.
        for arc in inner {
            let half = &self.complex.arcs[arc as usize];
            let closed = !std::mem::replace(&mut counted[half.from as usize], true);
            let region = self.of(arc) as usize;
            self.all[region].euler += i64::from(closed) - i64::from(arc < half.twin);
        }
    }

    /// The region of a half-arc.
    fn of(&self, arc: u32) -> u32 {
        self.of_cell[self.complex.arcs[arc as usize].cell as usize]
    }

    /// The region on the other side of a half-arc.
    fn beyond(&self, arc: u32) -> Option<u32> {
        self.twin(arc).map(|t| self.of(t))
    }

    fn twin(&self, arc: u32) -> Option<u32> {
        Some(self.complex.arcs[arc as usize].twin).filter(|t| *t != NONE)
    }

    /// The regions beside `region`, ascending.
    pub(super) fn neighbours(&self, region: u32) -> Vec<u32> {
        let mut all: Vec<u32> = self.all[region as usize].boundary.iter().filter_map(|a| self.beyond(*a)).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Walks along the boundary of the union of `a` and `b`, whose boundary half-arcs are given.
    fn outline(&mut self, a: u32, b: u32, boundary: &[u32]) -> Outline {
        self.seen_arcs.clear();
        self.seen_corners.clear();
        let mut outline = Outline::default();
        let union = CellsOf { complex: self.complex, of_cell: &self.of_cell, regions: [a, b] };
        let seen_corners = &mut self.seen_corners;
        let starts = boundary.iter().copied();
        walk_loops(
            starts,
            &mut self.seen_arcs,
            |arc| arc as usize,
            |arc| union.next(arc),
            |arc, begins| {
                let half = &union.complex.arcs[arc as usize];
                outline.pinches += usize::from(!seen_corners.visit(half.from as usize));
                outline.meets_itself |= half.coincident_cells.iter().any(|cell| union.has(*cell));
                match outline.loops.last_mut() {
                    Some(open) if !begins => open.push(arc),
                    _ => outline.loops.push(vec![arc]),
                }
            },
        );
        outline
    }

    /// Whether the end of `arc`, which runs between `a` and `b`, comes to lie inside the union, and `arc` is the least
    /// half-arc of `a` that runs to it along `b`.
    fn closes_corner(&self, a: u32, b: u32, arc: u32) -> bool {
        let union = CellsOf { complex: self.complex, of_cell: &self.of_cell, regions: [a, b] };
        let first = self.complex.arcs[arc as usize].next;
        let mut e = first;
        loop {
            let Some(t) = union.inner_twin(e) else { return false };
            // t runs to the corner.
            if self.of(t) == a && self.of(e) == b && t < arc {
                return false;
            }
            e = self.complex.arcs[t as usize].next;
            if e == first {
                return true;
            }
        }
    }

    /// The length of the arcs between two regions, and how much of it is a feature.
    pub(super) fn shared(&self, a: u32, b: u32) -> (f64, f64) {
        // From the side on which there is less to look at. Lengths are the same from either.
        let count = |region: u32| self.all[region as usize].boundary.len();
        let (fewer, other) = if count(a) <= count(b) { (a, b) } else { (b, a) };
        let between = self.all[fewer as usize].boundary.iter().filter(|h| self.beyond(**h) == Some(other));
        let arcs = between.map(|h| &self.complex.arcs[*h as usize]);
        arcs.fold((0.0, 0.0), |(length, feature), arc| (length + arc.length, feature + arc.feature))
    }

    /// What the union of `a` and `b` would be; none where they share no arc.
    pub(super) fn union(&mut self, a: u32, b: u32) -> Option<Union> {
        let (ra, rb) = (&self.all[a as usize], &self.all[b as usize]);
        let (gone, mut boundary): (Vec<u32>, Vec<u32>) = ra.boundary.iter().partition(|h| self.beyond(**h) == Some(b));
        if gone.is_empty() {
            return None;
        }
        boundary.extend(rb.boundary.iter().filter(|h| self.beyond(**h) != Some(a)));
        let closed = gone.iter().filter(|h| self.closes_corner(a, b, **h)).count();
        let shared = gone.iter().map(|h| self.complex.arcs[*h as usize].length).sum();
        let mut region = Region {
            cells: vec![],
            length: ra.length + rb.length - 2.0 * shared,
            faces: ra.faces + rb.faces,
            euler: ra.euler + rb.euler - gone.len() as i64 + closed as i64,
            area: ra.area + rb.area,
            normal: [0, 1, 2].map(|k| ra.normal[k] + rb.normal[k]),
            boundary: vec![],
        };
        let outline = self.outline(a, b, &boundary);
        region.boundary = boundary;
        Some(Union { region, outline, shared })
    }

    /// Makes the union of `a` and `b`, which becomes region `a`.
    pub(super) fn merge(&mut self, a: u32, b: u32, union: Union) {
        let cells = std::mem::take(&mut self.all[b as usize]).cells;
        cells.iter().for_each(|c| self.of_cell[*c as usize] = a);
        let mut all = std::mem::take(&mut self.all[a as usize].cells);
        all.extend(cells);
        self.all[a as usize] = Region { cells: all, ..union.region };
    }

    /// The outline of a region.
    pub(super) fn outline_of(&mut self, region: u32) -> Outline {
        let boundary = std::mem::take(&mut self.all[region as usize].boundary);
        let outline = self.outline(region, region, &boundary);
        self.all[region as usize].boundary = boundary;
        outline
    }

    /// What decides whether a region with this outline is a chart.
    pub(super) fn shape(&self, region: &Region, outline: &Outline) -> Shape {
        let seam = |l: &&Vec<u32>| l.iter().any(|a| self.twin(*a).is_some());
        Shape {
            faces: region.faces,
            euler: region.euler,
            loops: outline.loops.len(),
            seam_loops: outline.loops.iter().filter(seam).count(),
            pinches: outline.pinches,
            meets_itself: outline.meets_itself,
        }
    }
}

/// The cells of two regions, or of one that is named twice.
struct CellsOf<'a> {
    complex: &'a Complex,
    of_cell: &'a [u32],
    regions: [u32; 2],
}

impl CellsOf<'_> {
    fn has(&self, cell: u32) -> bool {
        self.regions.contains(&self.of_cell[cell as usize])
    }

    /// The other side of a half-arc, if it belongs to the regions.
    fn inner_twin(&self, arc: u32) -> Option<u32> {
        let twin = Some(self.complex.arcs[arc as usize].twin).filter(|twin| *twin != NONE);
        twin.filter(|twin| self.has(self.complex.arcs[*twin as usize].cell))
    }

    /// The boundary half-arc that follows the one given.
    fn next(&self, arc: u32) -> u32 {
        next_on_boundary(arc, |side| self.complex.arcs[side as usize].next, |side| self.inner_twin(side))
    }
}

impl Shape {
    /// Whether it is a disk with or without holes, whose boundary visits no vertex twice.
    pub(super) fn is_chart(&self) -> bool {
        self.pinches == 0 && self.loops > 0 && self.euler + self.loops as i64 == 2 && !self.meets_itself
    }
}
