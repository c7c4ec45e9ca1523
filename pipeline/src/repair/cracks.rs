//! Closing cracks: open edges that should be one edge.
//!
//! Two open edges are joined when both pairs of ends lie within the tolerance, and their triangles continue each
//! other. Facing sheets (the walls of a thin gap, folded onto each other) are never joined, nor two vertices of
//! one triangle, so that welding cannot change what the surface is.

use super::open_half_edges;
use crate::id::{HalfEdgeId, VertexId};
use crate::mesh::EdgeTable;
use crate::space::{Vec3, distance, dot, norm, sub};
use crate::union_find::UnionFind;

/// Triangles on the same side of an edge within this angle (10 degrees) face each other: the cosine.
const FACING: f64 = 0.985;

/// What is to be joined.
pub(super) struct Closed {
    /// Per vertex, the vertex that takes its place.
    pub target: Vec<VertexId>,
    /// How many pairs of open edges become one.
    pub pairs: usize,
}

/// Two open edges that may be joined, the ends in the order in which they meet.
struct Candidate {
    gap: f64,
    edges: [HalfEdgeId; 2],
    ends: [[VertexId; 2]; 2],
}

/// Finds the cracks no wider than `tolerance`, nearest pairs first; each edge is joined at most once.
pub(super) fn find(points: &[Vec3], triangles: &[[VertexId; 3]], edges: &EdgeTable, tolerance: f64) -> Closed {
    let rim = Rim { points, triangles, tolerance, open: open_half_edges(edges, triangles.len()) };
    let mut candidates = rim.candidates();
    candidates.sort_by(|a, b| a.gap.total_cmp(&b.gap).then(a.edges.cmp(&b.edges)));
    let mut joiner = Joiner::new(&rim);
    let mut taken = vec![false; 3 * triangles.len()];
    let mut pairs = 0;
    for c in &candidates {
        let free = !c.edges.iter().any(|h| taken[h.index()]);
        if free && joiner.join(c.ends) {
            c.edges.iter().for_each(|h| taken[h.index()] = true);
            pairs += 1;
        }
    }
    let target = (0..points.len()).map(|v| VertexId::at(joiner.sets.find(v))).collect();
    Closed { target, pairs }
}

/// The open edges of a draft.
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

    /// All pairs of open edges within the tolerance. An edge no longer than the tolerance has no direction of
    /// its own: it follows its neighbours.
    fn candidates(&self) -> Vec<Candidate> {
        let long = |h: &HalfEdgeId| {
            let [a, b] = self.ends(*h);
            distance(self.position(a), self.position(b)) > self.tolerance
        };
        let open: Vec<HalfEdgeId> = self.open.iter().copied().filter(long).collect();
        let by_cell = self.sorted_by_cell(&open);
        let mut found = Vec::new();
        if self.tolerance > 0.0 {
            for &g in &open {
                let near = self.near(&by_cell, self.ends(g)[0]);
                found.extend(near.filter(|h| *h > g).filter_map(|h| self.candidate(g, h)));
            }
        }
        found
    }

    /// The cell of a vertex: cubes with sides of the tolerance.
    fn cell(&self, v: VertexId) -> [i64; 3] {
        self.position(v).map(|c| (c / self.tolerance).floor() as i64)
    }

    /// Every end of every open edge, sorted by the cell it lies in.
    fn sorted_by_cell(&self, open: &[HalfEdgeId]) -> Vec<([i64; 3], HalfEdgeId)> {
        let mut cells: Vec<_> = open.iter().flat_map(|h| self.ends(*h).map(|v| (self.cell(v), *h))).collect();
        cells.sort_unstable();
        cells
    }

    /// The open edges with an end in a cell at or beside that of `v`, each once.
    fn near(&self, by_cell: &[([i64; 3], HalfEdgeId)], v: VertexId) -> impl Iterator<Item = HalfEdgeId> {
        let [x, y, z] = self.cell(v);
        let mut found = Vec::new();
        for (i, j) in (-1..=1).flat_map(|i| (-1..=1).map(move |j| (i, j))) {
            let column = [x.saturating_add(i), y.saturating_add(j)];
            let (low, high) =
                ([column[0], column[1], z.saturating_sub(1)], [column[0], column[1], z.saturating_add(1)]);
            let start = by_cell.partition_point(|(cell, _)| *cell < low);
            found.extend(by_cell[start..].iter().take_while(|(cell, _)| *cell <= high).map(|(_, h)| *h));
        }
        found.sort_unstable();
        found.dedup();
        found.into_iter()
    }

    /// The pair `g`, `h`, where it is a crack.
    fn candidate(&self, g: HalfEdgeId, h: HalfEdgeId) -> Option<Candidate> {
        let ([a, b], [c, d]) = (self.ends(g), self.ends(h));
        let gap = |p, q| distance(self.position(p), self.position(q));
        let ways = [[[a, d], [b, c]], [[a, c], [b, d]]];
        let widths = ways.map(|w| gap(w[0][0], w[0][1]).max(gap(w[1][0], w[1][1])));
        let best = usize::from(widths[1] < widths[0]);
        let fits = widths[best] <= self.tolerance && g.face() != h.face() && !self.facing(g, h);
        fits.then(|| Candidate { gap: widths[best], edges: [g, h], ends: ways[best] })
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
        rim.open.iter().flat_map(|h| rim.ends(*h)).for_each(|v| at_rim[v.index()] = true);
        let mut faces = vec![Vec::new(); rim.points.len()];
        for (f, t) in rim.triangles.iter().enumerate() {
            t.iter().filter(|v| at_rim[v.index()]).for_each(|v| faces[v.index()].push(f as u32));
        }
        Self { sets: UnionFind::new(rim.points.len()), triangles: rim.triangles, faces }
    }

    /// Unites both pairs of ends, or none of them.
    fn join(&mut self, ends: [[VertexId; 2]; 2]) -> bool {
        let allowed = ends.iter().all(|[a, b]| self.may_unite(a.index(), b.index()));
        if allowed {
            ends.iter().for_each(|[a, b]| self.unite(a.index(), b.index()));
        }
        allowed
    }

    /// Whether no triangle has a corner in the set of `a` and another in the set of `b`.
    fn may_unite(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        let (few, other) = if self.faces[a].len() <= self.faces[b].len() { (a, b) } else { (b, a) };
        let faces = std::mem::take(&mut self.faces[few]);
        let clash =
            faces.iter().any(|f| self.triangles[*f as usize].iter().any(|v| self.sets.find(v.index()) == other));
        self.faces[few] = faces;
        a == b || !clash
    }

    fn unite(&mut self, a: usize, b: usize) {
        let (a, b) = (self.sets.find(a), self.sets.find(b));
        if a != b {
            let (kept, gone) = (a.min(b), a.max(b));
            let mut moved = std::mem::take(&mut self.faces[gone]);
            self.faces[kept].append(&mut moved);
            self.sets.unite(a, b);
        }
    }
}
