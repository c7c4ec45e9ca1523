//! Closing cracks: open edges that should be one edge.
//!
//! Open edges whose ends lie within the tolerance of each other, pair by pair, form a bundle. A bundle in which no
//! two triangles face each other becomes one edge, whether two sheets meet there or more, so that noise cannot
//! decide who is joined with whom. Facing sheets (the walls of a thin gap, one upon the other) are never joined; in
//! a bundle that holds some, each edge is joined with the nearest one that it does not face. No two vertices of
//! one triangle are ever joined. Edges shorter than the tolerance have no direction of their own: they are zipped up
//! from ends that are joined already.

use super::open_half_edges;
use crate::topology::EdgeTable;
use crate::topology::union_find::UnionFind;
use crate::topology::{HalfEdgeId, VertexId};
use crate::vec3::{Vec3, distance, dot, midpoint, norm, sub};

/// Triangles on the same side of an edge within this angle (10 degrees) face each other: the cosine. By experience: a smaller
/// angle joins the walls of gaps that are not quite even, a larger one leaves cracks along the edges of blades open.
pub(super) const FACING: f64 = 0.985;

/// Tolerances below this share of the largest coordinate are rounding: nothing is joined.
const ROUNDING: f64 = 1e-15;

/// What is to be joined.
pub(super) struct Closed {
    /// Per vertex, the vertex that takes its place.
    pub target: Vec<VertexId>,
    /// How many open edges were joined to another one.
    pub pairs: usize,
}

/// Two open edges that may be joined, the ends in the order in which they meet.
struct Candidate {
    gap: f64,
    /// Positions among the open edges.
    edges: [usize; 2],
    ends: [[VertexId; 2]; 2],
    facing: bool,
}

/// Finds the cracks no wider than `tolerance`.
pub(super) fn find(points: &[Vec3], triangles: &[[VertexId; 3]], edges: &EdgeTable, tolerance: f64) -> Closed {
    let open = open_half_edges(edges, triangles.len());
    let rim = Rim { points, triangles, tolerance, open };
    let mut joiner = Joiner::new(&rim);
    let largest = points.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    let mut pairs = 0;
    if tolerance > ROUNDING * largest {
        let mut candidates = rim.candidates();
        candidates.sort_by(|a, b| a.gap.total_cmp(&b.gap).then(a.edges.cmp(&b.edges)));
        pairs = join_bundles(&rim, &candidates, &mut joiner) + zip_short_edges(&rim, &mut joiner);
    }
    let target = (0..points.len()).map(|v| VertexId::at(joiner.sets.find(v))).collect();
    Closed { target, pairs }
}

/// Joins bundle by bundle; how many edges were joined to another one.
fn join_bundles(rim: &Rim, candidates: &[Candidate], joiner: &mut Joiner) -> usize {
    let mut bundles = UnionFind::new(rim.open.len());
    for c in candidates {
        bundles.merge(c.edges[0], c.edges[1]);
    }
    // Per bundle (at its representative), whether two of its triangles face each other.
    let mut has_facing = vec![false; rim.open.len()];
    for c in candidates.iter().filter(|c| c.facing) {
        has_facing[bundles.find(c.edges[0])] = true;
    }
    // Candidates come in the order of their gaps: in a bundle with facing triangles an edge takes the nearest partner, and
    // that one only.
    let mut joined = UnionFind::new(rim.open.len());
    let mut taken = vec![false; rim.open.len()];
    let mut pairs = 0;
    for c in candidates.iter().filter(|c| !c.facing) {
        let [g, h] = c.edges;
        let single = has_facing[bundles.find(g)];
        if single && (taken[g] || taken[h]) {
            continue;
        }
        let are_apart = joined.find(g) != joined.find(h);
        if are_apart && joiner.join(c.ends) {
            joined.merge(g, h);
            (taken[g], taken[h]) = (true, true);
            pairs += 1;
        }
    }
    pairs
}

/// Joins open edges below the tolerance that begin at the same (joined) vertex, run the same way and end within the
/// tolerance of each other; how many were. Every round but the last joins vertices, so the rounds end.
fn zip_short_edges(rim: &Rim, joiner: &mut Joiner) -> usize {
    let short: Vec<[VertexId; 2]> = rim.open.iter().filter(|h| !rim.is_long(**h)).map(|h| rim.ends(*h)).collect();
    let mut pairs = 0;
    loop {
        let mut arms = Vec::with_capacity(2 * short.len());
        for [a, b] in short.iter().copied() {
            arms.push(Arm { joined: joiner.sets.find(a.index()), vertex: a, far: b });
            arms.push(Arm { joined: joiner.sets.find(b.index()), vertex: b, far: a });
        }
        // Arms at one joined vertex come to stand side by side.
        arms.sort_unstable();
        let before = pairs;
        for pair in arms.windows(2).filter(|w| w[0].joined == w[1].joined && rim.run_alike(w)) {
            let (a, b) = (pair[0].far, pair[1].far);
            let apart = joiner.sets.find(a.index()) != joiner.sets.find(b.index());
            if apart && rim.gap(a, b) <= rim.tolerance && joiner.join([[a, b], [a, b]]) {
                pairs += 1;
            }
        }
        if pairs == before {
            return pairs;
        }
    }
}

/// A short open edge, seen from one of its ends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Arm {
    /// The vertex that stands for all that this end is joined with so far.
    joined: usize,
    /// This end.
    vertex: VertexId,
    /// The other end.
    far: VertexId,
}

/// The open edges of a builder.
struct Rim<'a> {
    points: &'a [Vec3],
    triangles: &'a [[VertexId; 3]],
    tolerance: f64,
    open: Vec<HalfEdgeId>,
}

impl Rim<'_> {
    fn ends(&self, h: HalfEdgeId) -> [VertexId; 2] {
        let t = self.triangles[h.face().index()];
        [t[h.side()], t[(h.side() + 1) % 3]]
    }

    fn position(&self, v: VertexId) -> Vec3 {
        self.points[v.index()]
    }

    fn gap(&self, a: VertexId, b: VertexId) -> f64 {
        distance(self.position(a), self.position(b))
    }

    /// Whether two arms leave the joined vertex in the same direction, rather than being neighbours along one rim.
    fn run_alike(&self, arms: &[Arm]) -> bool {
        let [u, v] = [0, 1].map(|k| sub(self.position(arms[k].far), self.position(arms[k].vertex)));
        dot(u, v) > 0.0
    }

    fn is_long(&self, h: HalfEdgeId) -> bool {
        let [a, b] = self.ends(h);
        self.gap(a, b) > self.tolerance
    }

    /// All pairs of long open edges within the tolerance: their middles are, then, too.
    fn candidates(&self) -> Vec<Candidate> {
        let long = (0..self.open.len()).filter(|i| self.is_long(self.open[*i]));
        let mut cells: Vec<([i64; 3], usize)> = long.map(|i| (self.cell(i), i)).collect();
        cells.sort_unstable();
        let mut found = Vec::new();
        for &([x, y, z], g) in &cells {
            // The 27 cells around: sorted by x, y, z, the three above each other in z are one run.
            for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
                let (low, high) = ([x + i, y + j, z - 1], [x + i, y + j, z + 1]);
                let start = cells.partition_point(|(cell, _)| *cell < low);
                let near = cells[start..].iter().take_while(|(cell, _)| *cell <= high).map(|(_, h)| *h);
                found.extend(near.filter(|h| *h > g).filter_map(|h| self.candidate(g, h)));
            }
        }
        found
    }

    /// The cell in which the middle of an open edge lies: cubes with sides of the tolerance.
    fn cell(&self, i: usize) -> [i64; 3] {
        let [a, b] = self.ends(self.open[i]).map(|v| self.position(v));
        midpoint(a, b).map(|c| (c / self.tolerance).floor() as i64)
    }

    /// The pair of the open edges `g`, `h`, where their ends meet.
    fn candidate(&self, g: usize, h: usize) -> Option<Candidate> {
        let edges = [self.open[g], self.open[h]];
        let [[a, b], [c, d]] = edges.map(|e| self.ends(e));
        // Against each other, as the sides of one edge of an oriented surface run, or alongside.
        let against = [[a, d], [b, c]];
        let alongside = [[a, c], [b, d]];
        // A crack is as wide as it is at its wider end.
        let width = |[[p, q], [r, s]]: [[VertexId; 2]; 2]| self.gap(p, q).max(self.gap(r, s));
        let (width_against, width_alongside) = (width(against), width(alongside));
        let (ends, gap) =
            if width_alongside < width_against { (alongside, width_alongside) } else { (against, width_against) };
        // Two sides of one triangle are no crack: joined, they would leave it without area.
        let of_one_triangle = edges[0].face() == edges[1].face();
        let fits = gap <= self.tolerance && !of_one_triangle;
        if !fits {
            return None;
        }
        let facing = self.facing(edges[0], edges[1]);
        Some(Candidate { gap, edges: [g, h], ends, facing })
    }

    /// Whether the triangles at `g` and `h` lie on the same side of the edge, one upon the other.
    fn facing(&self, g: HalfEdgeId, h: HalfEdgeId) -> bool {
        let (u, v) = (self.inward(g), self.inward(h));
        dot(u, v) > FACING * norm(u) * norm(v)
    }

    /// The direction from the edge `h` into its triangle, at right angles to the edge.
    fn inward(&self, h: HalfEdgeId) -> Vec3 {
        let [a, b] = self.ends(h).map(|v| self.position(v));
        let tip = self.position(self.triangles[h.face().index()][h.prev().side()]);
        let (along, up) = (sub(b, a), sub(tip, a));
        let share = dot(up, along) / dot(along, along);
        [0, 1, 2].map(|k| up[k] - share * along[k])
    }
}

/// Unites vertices, as long as no triangle gets two equal ones.
struct Joiner<'a> {
    sets: UnionFind,
    triangles: &'a [[VertexId; 3]],
    /// Per set (at its representative), the faces around its members; filled for vertices at open edges.
    faces: Vec<Vec<u32>>,
}

impl<'a> Joiner<'a> {
    fn new(rim: &Rim<'a>) -> Self {
        let mut at_rim = vec![false; rim.points.len()];
        for v in rim.open.iter().flat_map(|h| rim.ends(*h)) {
            at_rim[v.index()] = true;
        }
        // Only vertices at open edges are ever joined: the faces around all others would be kept for nothing.
        let mut faces = vec![Vec::new(); rim.points.len()];
        for (f, triangle) in rim.triangles.iter().enumerate() {
            for v in triangle.iter().filter(|v| at_rim[v.index()]) {
                faces[v.index()].push(f as u32);
            }
        }
        Self { sets: UnionFind::new(rim.points.len()), triangles: rim.triangles, faces }
    }

    /// Unites both pairs of ends, or none of them.
    fn join(&mut self, ends: [[VertexId; 2]; 2]) -> bool {
        let allowed = ends.iter().all(|[a, b]| self.may_unite(a.index(), b.index()));
        if allowed {
            ends.iter().for_each(|[a, b]| self.merge(a.index(), b.index()));
        }
        allowed
    }

    /// Whether no triangle has a corner in the set of `a` and another in the set of `b`.
    fn may_unite(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        let (few, other) = if self.faces[a].len() <= self.faces[b].len() { (a, b) } else { (b, a) };
        // Taken out while the sets are asked, which are told anew of what they find; put back below.
        let faces = std::mem::take(&mut self.faces[few]);
        let clash =
            faces.iter().any(|f| self.triangles[*f as usize].iter().any(|v| self.sets.find(v.index()) == other));
        self.faces[few] = faces;
        a == b || !clash
    }

    fn merge(&mut self, a: usize, b: usize) {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        if a != b {
            let (kept, gone) = (a.min(b), a.max(b));
            let mut moved = std::mem::take(&mut self.faces[gone]);
            self.faces[kept].append(&mut moved);
            self.sets.merge(a, b);
        }
    }
}
