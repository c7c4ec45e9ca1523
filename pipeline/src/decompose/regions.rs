//! Regions: unions of cells on their way to charts, and what they would be if two of them were united.
//!
//! A region is known by its boundary half-edges and the number of vertices in its inside; everything that decides
//! whether it is a chart follows from these: walking along the boundary counts its loops and the vertices it visits
//! twice, and with I inner vertices, B boundary half-edges and F triangles the Euler number (of the region opened
//! where it only touches itself) is I + (B - F)/2. So a union is judged at the cost of its boundary, not of its area.

use super::dual::Dual;
use crate::id::{FaceId, HalfEdgeId};
use crate::space::Vec3;

/// What is known of a region.
#[derive(Clone, Debug, Default)]
pub(super) struct Region {
    /// The cells in it; none: the region was united with another one.
    pub cells: Vec<u32>,
    pub boundary: Vec<HalfEdgeId>,
    pub faces: usize,
    /// Vertices that the boundary does not visit.
    pub inside: usize,
    pub area: f64,
    /// The sum of the area vectors.
    pub normal: Vec3,
}

/// The boundary of a region, walked.
#[derive(Clone, Debug, Default)]
pub(super) struct Outline {
    pub loops: Vec<Vec<HalfEdgeId>>,
    /// How often it visits a vertex again.
    pub pinches: usize,
    /// Whether the region lies on both sides of an edge of its boundary: a surface that cannot be oriented there.
    pub meets_itself: bool,
}

/// A union that was looked at.
#[derive(Clone, Debug)]
pub(super) struct Union {
    pub region: Region,
    pub outline: Outline,
    /// Length of the boundary that vanishes, and of that part of it that is a feature.
    pub shared: f64,
    pub shared_feature: f64,
}

/// A partition of the triangles into regions.
pub(super) struct Regions<'a> {
    pub dual: &'a Dual<'a>,
    pub cell_of: &'a [u32],
    /// Per cell its region.
    pub of_cell: Vec<u32>,
    pub all: Vec<Region>,
    stamps: Stamps,
}

/// Marks that are cleared by counting on.
struct Stamps {
    now: u32,
    half_edges: Vec<u32>,
    vertices: Vec<u32>,
}

impl Stamps {
    fn clear(&mut self) {
        self.now += 1;
    }
}

impl<'a> Regions<'a> {
    /// One region per group of cells: `of_cell` tells the group of each cell, of `count` groups.
    pub(super) fn new(dual: &'a Dual<'a>, cell_of: &'a [u32], of_cell: Vec<u32>, count: usize) -> Self {
        let stamps =
            Stamps { now: 0, half_edges: vec![0; 3 * cell_of.len()], vertices: vec![0; dual.mesh.points().len()] };
        let mut made = Self { dual, cell_of, of_cell, all: vec![Region::default(); count], stamps };
        for cell in 0..made.of_cell.len() {
            made.all[made.of_cell[cell] as usize].cells.push(cell as u32);
        }
        let mut on_boundary = vec![false; dual.mesh.points().len()];
        for h in dual.half_edges() {
            let region = made.of(h.face());
            if dual.across(h).is_none_or(|t| made.of(t.face()) != region) {
                made.all[region as usize].boundary.push(h);
                on_boundary[dual.from(h)] = true;
                on_boundary[dual.to(h)] = true;
            }
        }
        made.measure(&on_boundary);
        made
    }

    fn measure(&mut self, on_boundary: &[bool]) {
        let mut counted = on_boundary.to_vec();
        for (f, t) in self.dual.mesh.triangles().iter().enumerate() {
            let region = self.of(FaceId::at(f)) as usize;
            let (area, normal) = (self.dual.area(f), self.dual.area_vector(f));
            let fresh = t.iter().filter(|v| !std::mem::replace(&mut counted[v.index()], true)).count();
            let region = &mut self.all[region];
            region.faces += 1;
            region.area += area;
            region.inside += fresh;
            (0..3).for_each(|k| region.normal[k] += normal[k]);
        }
    }

    /// The region of a face.
    pub(super) fn of(&self, face: FaceId) -> u32 {
        self.of_cell[self.cell_of[face.index()] as usize]
    }

    /// The regions beside `region`, ascending.
    pub(super) fn neighbours(&self, region: u32) -> Vec<u32> {
        let beside = |h: &HalfEdgeId| self.dual.across(*h).map(|t| self.of(t.face()));
        let mut all: Vec<u32> = self.all[region as usize].boundary.iter().filter_map(beside).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Walks along the boundary of the union of `a` and `b`, whose boundary half-edges are given.
    fn outline(&mut self, a: u32, b: u32, boundary: &[HalfEdgeId]) -> Outline {
        self.stamps.clear();
        let now = self.stamps.now;
        let mut outline = Outline::default();
        for start in boundary {
            if self.stamps.half_edges[start.index()] == now {
                continue;
            }
            let mut turn = Vec::new();
            let mut h = *start;
            // The next boundary half-edge is unique, and so is the one before: the walk closes where it began.
            while std::mem::replace(&mut self.stamps.half_edges[h.index()], now) != now {
                turn.push(h);
                let again = std::mem::replace(&mut self.stamps.vertices[self.dual.from(h)], now) == now;
                outline.pinches += usize::from(again);
                outline.meets_itself |= self.faces_itself(a, b, h);
                h = self.next(a, b, h);
            }
            outline.loops.push(turn);
        }
        outline
    }

    /// Whether the triangle on the other side of a boundary half-edge belongs to the union all the same.
    fn faces_itself(&self, a: u32, b: u32, h: HalfEdgeId) -> bool {
        let twin = self.dual.mesh.edges().twin(h).filter(|_| self.dual.across(h).is_none());
        twin.is_some_and(|t| self.is_in(a, b, t))
    }

    fn is_in(&self, a: u32, b: u32, h: HalfEdgeId) -> bool {
        let region = self.of(h.face());
        region == a || region == b
    }

    /// The boundary half-edge of the union of `a` and `b` after `h`: turns around the end of `h` until the union ends.
    /// It does end, at the latest at `h` itself.
    fn next(&self, a: u32, b: u32, h: HalfEdgeId) -> HalfEdgeId {
        let mut e = h.next();
        while let Some(t) = self.dual.across(e).filter(|t| self.is_in(a, b, *t)) {
            e = t.next();
        }
        e
    }

    /// Whether the end of `h`, which runs between `a` and `b`, comes to lie inside the union, and `h` is the least
    /// half-edge of `a` that runs to it along `b`.
    fn closes_vertex(&self, a: u32, b: u32, h: HalfEdgeId) -> bool {
        let first = h.next();
        let mut e = first;
        loop {
            let Some(t) = self.dual.across(e).filter(|t| self.is_in(a, b, *t)) else { return false };
            // t runs to the vertex.
            if self.of(t.face()) == a && self.of(e.face()) == b && t < h {
                return false;
            }
            e = t.next();
            if e == first {
                return true;
            }
        }
    }

    /// What the union of `a` and `b` would be; none where they share no edge.
    pub(super) fn union(&mut self, a: u32, b: u32) -> Option<Union> {
        let (ra, rb) = (&self.all[a as usize], &self.all[b as usize]);
        let to = |h: &HalfEdgeId, other: u32| self.dual.across(*h).is_some_and(|t| self.of(t.face()) == other);
        let (gone, mut boundary): (Vec<HalfEdgeId>, Vec<HalfEdgeId>) = ra.boundary.iter().partition(|h| to(h, b));
        if gone.is_empty() {
            return None;
        }
        boundary.extend(rb.boundary.iter().filter(|h| !to(h, a)));
        let closed = gone.iter().filter(|h| self.closes_vertex(a, b, **h)).count();
        let mut region = Region {
            cells: vec![],
            faces: ra.faces + rb.faces,
            inside: ra.inside + rb.inside + closed,
            area: ra.area + rb.area,
            normal: [0, 1, 2].map(|k| ra.normal[k] + rb.normal[k]),
            boundary: vec![],
        };
        let shared = gone.iter().map(|h| self.dual.length(*h)).sum();
        let shared_feature = gone.iter().filter(|h| self.dual.is_feature(**h)).map(|h| self.dual.length(*h)).sum();
        let outline = self.outline(a, b, &boundary);
        region.boundary = boundary;
        Some(Union { region, outline, shared, shared_feature })
    }

    /// Makes the union of `a` and `b`, which becomes region `a`.
    pub(super) fn unite(&mut self, a: u32, b: u32, union: Union) {
        let cells = std::mem::take(&mut self.all[b as usize]).cells;
        cells.iter().for_each(|c| self.of_cell[*c as usize] = a);
        let mut all = std::mem::take(&mut self.all[a as usize].cells);
        all.extend(cells);
        self.all[a as usize] = Region { cells: all, ..union.region };
    }

    /// The outline of a region.
    pub(super) fn outline_of(&mut self, region: u32) -> Outline {
        let boundary = self.all[region as usize].boundary.clone();
        self.outline(region, region, &boundary)
    }
}

impl Region {
    /// Whether the region is a disk with or without holes, whose boundary visits no vertex twice.
    pub(super) fn is_chart(&self, outline: &Outline) -> bool {
        let euler = self.inside as i64 + (self.boundary.len() as i64 - self.faces as i64) / 2;
        outline.pinches == 0
            && !outline.loops.is_empty()
            && euler + outline.loops.len() as i64 == 2
            && !outline.meets_itself
    }
}
