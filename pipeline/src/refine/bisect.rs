//! Bisection: triangles are halved across their longest edges until each is as short as it is asked to be.
//!
//! *Longest edges* (Rivara 1984, doi 10.1002/nme.1620200412): a triangle with an edge that is halved has its longest edge
//! halved, too, and that first. So triangles do not become flatter than they are, and the closure (no node hangs) ends: at
//! worst all edges are halved once. Edges count as one where sheets have copies of them, so that all
//! sheets see the same nodes.

use crate::mesh::{Halved, Ranks, SurfaceMesh, falls_to_nothing, halve};
use crate::topology::union_find::UnionFind;
use crate::topology::{EdgeId, FaceId, HalfEdgeId, VertexId};
use std::collections::BTreeMap;

/// How often longest edges are halved, one after another, at most: an edge is then of 2^12 parts and more.
const ROUNDS: usize = 24;

/// How much longer than it is asked to be a longest edge may stay: what rounding adds.
const SLACK: f64 = 1.0 + 1e-6;

/// A surface while it is refined.
#[derive(Clone, Debug)]
pub(crate) struct Refined {
    /// The surface.
    pub mesh: SurfaceMesh,
    /// Per triangle, that of the surface before in which it lies.
    pub parents: Vec<FaceId>,
    /// Where the vertices lie that were added.
    pub ends: Ends,
    /// What was halved, step by step.
    pub steps: Vec<Step>,
    /// How many triangles were added for the sake of lengths, not so that no node hangs.
    pub asked: usize,
}

/// Per vertex that was added to a surface, those in the middle of which it lies.
#[derive(Clone, Debug)]
pub(crate) struct Ends {
    /// The vertices before.
    before: usize,
    ends: Vec<[VertexId; 2]>,
}

impl Ends {
    /// Those of `vertex`.
    ///
    /// # Panics
    /// If it was there before.
    pub fn of(&self, vertex: VertexId) -> [VertexId; 2] {
        self.ends[vertex.index() - self.before]
    }
}

/// The edges that are halved at once, ascending: with them, no node hangs.
pub(crate) type Step = Vec<Segment>;

impl Refined {
    /// A surface that is not refined yet.
    pub fn new(mesh: SurfaceMesh) -> Self {
        let parents = (0..mesh.triangles().len()).map(FaceId::at).collect();
        let ends = Ends { before: mesh.points().len(), ends: vec![] };
        Self { mesh, parents, ends, steps: vec![], asked: 0 }
    }

    /// Halves edges until the longest one of each triangle is no longer than `wanted` says of the triangle in which it lies
    /// now, in the unit of the shapes, or `room` triangles were added; those that are longest beside what is wanted come
    /// first. Triangles beside them are halved as far as that takes.
    pub fn shortened(mut self, wanted: &[f64], room: usize) -> Self {
        let most = self.asked + room;
        let mut wanted = wanted.to_vec();
        for _ in 0..ROUNDS {
            let shapes = &self.mesh.metric().shapes;
            let excess = |f: usize| shapes[f].longest() / wanted[f];
            let mut faces: Vec<usize> = (0..wanted.len()).filter(|f| excess(*f) > SLACK).collect();
            faces.sort_by(|f, g| excess(*g).total_cmp(&excess(*f)));
            let (longest, added) = self.longest_edges(&faces, most.saturating_sub(self.asked));
            if longest.is_empty() {
                break;
            }
            self.asked += added;
            let before = self.parents.len();
            let parents;
            (self, parents) = self.halved(longest);
            if self.parents.len() == before {
                break;
            }
            wanted.extend(parents.iter().map(|f| wanted[f.index()]).collect::<Vec<_>>());
        }
        self
    }

    /// The longest edges of these triangles, in their order, as long as the triangles at them are no more than `room`, and how many
    /// these are.
    fn longest_edges(&self, faces: &[usize], room: usize) -> (Vec<EdgeId>, usize) {
        let mut is_taken = vec![false; self.mesh.edges().len()];
        let (mut taken, mut added) = (Vec::new(), 0);
        for face in faces {
            let edge = longest_edge(&self.mesh, FaceId::at(*face));
            if std::mem::replace(&mut is_taken[edge.index()], true) {
                continue;
            }
            let sides = self.mesh.edges().sides(edge).len();
            if added + sides > room {
                break;
            }
            added += sides;
            taken.push(edge);
        }
        (taken, added)
    }

    /// Halves the edges of steps that were made on parts of the surface, as far as they are there.
    pub fn repeated<'a>(self, parts: impl Iterator<Item = &'a Step>) -> Self {
        let mut wanted: Step = parts.flatten().copied().collect();
        wanted.sort_unstable();
        let is_wanted = |sides: &[HalfEdgeId]| wanted.binary_search(&Segment::along(&self.mesh, sides[0])).is_ok();
        let there = self.mesh.edges().iter().filter(|(_, sides)| is_wanted(sides)).map(|(edge, _)| edge);
        let there = there.collect();
        self.halved(there).0
    }

    /// Halves these edges, and the longest edges of all triangles that are bisected; but none, and none for the sake of which it
    /// would be, of which a triangle would fall to nothing. Per triangle that was added, that of which it is a part.
    fn halved(mut self, edges: Vec<EdgeId>) -> (Self, Vec<FaceId>) {
        let groups = closure(&self.mesh, edges);
        let mut ranked: Vec<(Segment, Vec<EdgeId>)> = Vec::with_capacity(groups.len());
        for group in groups {
            ranked.push((Segment::along(&self.mesh, self.mesh.edges().sides(group[0])[0]), group));
        }
        ranked.sort_unstable();
        let (step, groups): (Step, Vec<_>) = ranked.into_iter().unzip();
        let Halved { mesh, parents, ends } = halve(self.mesh, &groups);
        self.parents.extend(parents.iter().map(|f| self.parents[f.index()]).collect::<Vec<_>>());
        self.ends.ends.extend(ends);
        self.steps.push(step);
        (Self { mesh, ..self }, parents)
    }
}

/// An edge, whatever sheets have copies of it, by its ends in space. In this order longer ones come last; those that are as
/// long are told apart by their ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Segment {
    length: f64,
    ends: [[u64; 3]; 2],
}

impl Eq for Segment {}

impl Ord for Segment {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.length.total_cmp(&other.length).then_with(|| self.ends.cmp(&other.ends))
    }
}

impl PartialOrd for Segment {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Segment {
    /// The edge along `h`. Its length is the same number for all sides and copies: half of halves of one length of the input,
    /// or a median, which both parts of a triangle have from that.
    fn along(mesh: &SurfaceMesh, h: HalfEdgeId) -> Self {
        let corners = mesh.corners(h.face().index());
        let [from, to] = [h, h.next()].map(|h| corners[h.side()].map(f64::to_bits));
        let length = mesh.metric().shapes[h.face().index()].lengths[h.side()];
        Self { length, ends: [from.min(to), from.max(to)] }
    }
}

/// The longest edge of a triangle; of those that are as long the same one in whatever surface the triangle lies.
fn longest_edge(mesh: &SurfaceMesh, face: FaceId) -> EdgeId {
    let [a, b, c] = face.sides();
    let longer = |g: HalfEdgeId, h: HalfEdgeId| if Segment::along(mesh, g) < Segment::along(mesh, h) { h } else { g };
    mesh.edges().edge(longer(longer(a, b), c))
}

/// The copies of edges that sheets have.
struct Copies {
    /// Of edges that have some: which group of them they are in.
    group: BTreeMap<EdgeId, usize>,
    groups: Vec<Vec<EdgeId>>,
}

impl Copies {
    fn new(mesh: &SurfaceMesh) -> Self {
        let highest = (0..mesh.points().len()).map(|v| mesh.welded_vertex(VertexId::at(v))).max().map_or(0, |w| w + 1);
        let mut count = vec![0_u8; highest as usize];
        for v in 0..mesh.points().len() {
            let count = &mut count[mesh.welded_vertex(VertexId::at(v)) as usize];
            *count = count.saturating_add(1);
        }
        let is_copied = |h: HalfEdgeId| {
            let v = mesh.triangles()[h.face().index()][h.side()];
            count[mesh.welded_vertex(v) as usize] > 1
        };
        let may_have_copies = |h: HalfEdgeId| is_copied(h) && is_copied(h.next());
        let edges = mesh.edges().iter().filter(|(_, sides)| may_have_copies(sides[0]));
        let mut all: Vec<(Segment, EdgeId)> =
            edges.map(|(edge, sides)| (Segment::along(mesh, sides[0]), edge)).collect();
        all.sort_unstable();
        let mut copies = Self { group: BTreeMap::new(), groups: vec![] };
        for group in all.chunk_by(|a, b| a.0 == b.0).filter(|group| group.len() > 1) {
            copies.group.extend(group.iter().map(|(_, edge)| (*edge, copies.groups.len())));
            copies.groups.push(group.iter().map(|(_, edge)| *edge).collect());
        }
        copies
    }

    /// An edge with all its copies.
    fn of(&self, edge: EdgeId) -> Vec<EdgeId> {
        self.group.get(&edge).map_or_else(|| vec![edge], |group| self.groups[*group].clone())
    }
}

/// These edges, and the longest edges of all triangles at an edge that is to be halved, with their copies; those left out for the
/// sake of which a triangle would fall to nothing. Each edge is looked at once, and each round leaves edges out: it ends.
fn closure(mesh: &SurfaceMesh, mut fresh: Vec<EdgeId>) -> Vec<Vec<EdgeId>> {
    let copies = Copies::new(mesh);
    // What is halved for the sake of each other.
    let mut together = UnionFind::new(mesh.edges().len());
    let mut is_marked = vec![false; mesh.edges().len()];
    let mut groups = Vec::new();
    while let Some(edge) = fresh.pop() {
        if is_marked[edge.index()] {
            continue;
        }
        let group = copies.of(edge);
        for copy in &group {
            is_marked[copy.index()] = true;
            together.merge(edge.index(), copy.index());
            for h in mesh.edges().sides(*copy) {
                let longest = longest_edge(mesh, h.face());
                together.merge(edge.index(), longest.index());
                fresh.push(longest);
            }
        }
        groups.push(group);
    }
    groups.sort_unstable();
    let ranks = Ranks::new(mesh, &groups);
    let mut is_barred = vec![false; mesh.edges().len()];
    for edge in groups.iter().flatten() {
        let mut faces = mesh.edges().sides(*edge).iter().map(|h| h.face());
        if faces.any(|face| falls_to_nothing(mesh, face, &ranks)) {
            is_barred[together.find(edge.index())] = true;
        }
    }
    groups.retain(|group| !is_barred[together.find(group[0].index())]);
    groups
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{repair, shapes};

    fn surface(soup: &crate::mesh::TriangleSoup) -> SurfaceMesh {
        repair(soup, &Default::default()).expect("a surface").mesh
    }

    #[test]
    fn edges_become_as_short_as_they_are_asked_to_be_and_the_surface_stays() {
        for soup in [shapes::tube(12, 1, 5.0), shapes::ring_torus(9, 6), shapes::moebius(8), shapes::book(3, 2)] {
            let mesh = surface(&soup);
            let asked: Vec<f64> = mesh.metric().shapes.iter().map(|shape| 0.4 * shape.longest()).collect();
            let refined = Refined::new(mesh.clone()).shortened(&asked, usize::MAX / 2);
            refined.mesh.assert_sound();
            for (shape, parent) in refined.mesh.metric().shapes.iter().zip(&refined.parents) {
                assert!(shape.longest() <= SLACK * asked[parent.index()]);
            }
            let (old, new) = (mesh.topology_summary(), refined.mesh.topology_summary());
            assert_eq!((new.euler, new.genus, new.boundary_loops), (old.euler, old.genus, old.boundary_loops));
            assert!((refined.mesh.area() / mesh.area() - 1.0).abs() < 1e-12);
            // Parts lie in the triangle whose they are, and fill it.
            let mut areas = vec![0.0; asked.len()];
            for (face, parent) in refined.parents.iter().enumerate() {
                areas[parent.index()] += refined.mesh.metric().shapes[face].area();
                assert_eq!(refined.mesh.source_triangle(face), mesh.source_triangle(parent.index()));
            }
            for (area, shape) in areas.iter().zip(&mesh.metric().shapes) {
                assert!((area / shape.area() - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn sheets_see_the_same_nodes_along_the_edge_where_they_meet() {
        let mesh = surface(&shapes::book(3, 2));
        // One page is refined; the others follow along the spine only.
        let asked = (0..mesh.triangles().len()).map(|f| if f < 8 { 0.3 } else { f64::INFINITY });
        let asked: Vec<f64> = asked.zip(&mesh.metric().shapes).map(|(share, shape)| share * shape.longest()).collect();
        let refined = Refined::new(mesh).shortened(&asked, usize::MAX / 2).mesh;
        let on_spine = |v: usize| refined.points()[v][0] == 0.0 && refined.points()[v][1] == 0.0;
        let mut copies = std::collections::BTreeMap::new();
        for v in (0..refined.points().len()).filter(|v| on_spine(*v)) {
            *copies.entry(refined.welded_vertex(VertexId::at(v))).or_insert(0) += 1;
        }
        assert!(copies.len() > 3 && copies.values().all(|count| *count == 3), "{copies:?}");
    }

    #[test]
    fn no_more_triangles_are_added_than_there_is_room_for_but_for_those_of_the_closure() {
        let mesh = surface(&shapes::disk(6));
        let asked = vec![0.0; mesh.triangles().len()];
        let refined = Refined::new(mesh.clone()).shortened(&asked, 20);
        assert!(refined.asked <= 20 && refined.asked >= 19, "{}", refined.asked);
        assert!(refined.parents.len() - mesh.triangles().len() >= refined.asked);
    }

    #[test]
    fn what_was_done_to_a_part_is_repeated_on_the_whole() {
        let mesh = surface(&shapes::tube(12, 1, 5.0));
        let asked: Vec<f64> = mesh.metric().shapes.iter().map(|shape| 0.3 * shape.longest()).collect();
        let part = Refined::new(mesh.clone()).shortened(&asked, usize::MAX / 2);
        let mut whole = Refined::new(mesh);
        for step in &part.steps {
            whole = whole.repeated(std::iter::once(step));
        }
        assert_eq!((whole.mesh.triangles(), whole.mesh.points()), (part.mesh.triangles(), part.mesh.points()));
    }
}
