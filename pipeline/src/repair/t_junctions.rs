//! Closing T-junctions: boundary vertices of one side that lie on a boundary edge of another side.
//!
//! Exporters of solids cut the two sides of an edge differently. The triangle at the long edge is split at the vertices
//! that lie on it, so that both sides have the same edges: those with the same ends are one, those whose ends lie
//! within the tolerance of each other are joined as cracks are. The surface moves by no more than the tolerance.
//!
//! A vertex lies on an edge where its foot on the edge's line is farther than the tolerance from both ends, and itself no
//! farther than the tolerance from the foot. It is put there where a boundary edge at it runs along the long one, farther
//! than the tolerance, and their triangles do not face each other (see [`super::cracks`]). Where others along the long
//! edge do, or long edges on which the vertex lies (walls of a thin gap), only vertices that lie on it within rounding are
//! put there, so that no walls are joined. Corners of the triangle
//! itself are not, nor vertices that would turn over a part of the triangle or leave it without area; of those within
//! the tolerance of each other along the edge, the first one is: the others are joined with it as cracks are.
//!
//! The tolerance is at least [`ROUNDING`] of the largest coordinate: a point on an edge, rounded to doubles, is at most
//! one unit in the last place off in every coordinate, and computing the distance costs a few more. So vertices that lie
//! on edges exactly are found with `weld` 0, too.
//!
//! It ends: all edges are looked at once, and vertices are put on edges of the input only, not on their parts, each on
//! [`CROWD`] at most. The cost is that of sorting, and at most [`LOOKS`] per boundary edge and vertex on average: edges
//! beyond are left as they are, as edges may be chosen so that each has all vertices near it.

use super::cracks::FACING;
use super::near::PointTree;
use super::open_half_edges;
use crate::topology::EdgeTable;
use crate::topology::csr::Csr;
use crate::topology::{HalfEdgeId, VertexId};
use crate::vec3::{Vec3, cross, dot, norm, sub};

/// The least tolerance, as a share of the largest coordinate: four units in the last place.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Boxes, points and edges that are looked at, per boundary edge and vertex on average. By experience: a way down the tree
/// takes about 2 log2 n, 40 of a million; it bounds the time that a file made for that can take.
const LOOKS: usize = 100;

/// Edges that run along one place of a long edge, and long edges on which a vertex lies, at most; where there are more, it
/// is as if some faced each other. By experience: all pairs of them are compared.
const CROWD: usize = 8;

/// The boundary of a triangulation, and how near is near.
pub(super) struct Boundary<'a> {
    points: &'a [Vec3],
    triangles: &'a [[VertexId; 3]],
    open: Vec<HalfEdgeId>,
    tolerance: f64,
    rounding: f64,
}

/// A vertex on an edge.
#[derive(Clone, Copy)]
struct OnEdge {
    vertex: VertexId,
    edge: HalfEdgeId,
    /// How far from the first end its foot is.
    along: f64,
    /// How far it is from its foot.
    off: f64,
}

/// A boundary edge that runs along another one: from where to where, and into which direction its triangle lies.
struct Beside {
    span: [f64; 2],
    inward: Vec3,
}

/// A segment with its length and direction.
struct Line {
    from: Vec3,
    direction: Vec3,
    length: f64,
}

impl Line {
    fn new([from, to]: [Vec3; 2]) -> Self {
        let along = sub(to, from);
        let length = norm(along);
        Self { from, direction: along.map(|c| c / length), length }
    }

    /// How far along the line the foot of a point is, and how far the point is from it.
    fn foot(&self, p: Vec3) -> (f64, f64) {
        let up = sub(p, self.from);
        let along = dot(up, self.direction);
        (along, norm(self.across(up)))
    }

    /// The part of a vector that is at right angles to the line.
    fn across(&self, v: Vec3) -> Vec3 {
        let along = dot(v, self.direction);
        [0, 1, 2].map(|k| v[k] - along * self.direction[k])
    }
}

/// Per boundary edge that has some, in their order along it, the vertices at which its triangle is to be split.
pub(super) type Splits = Vec<(HalfEdgeId, Vec<VertexId>)>;

impl<'a> Boundary<'a> {
    /// The boundary of `triangles`; the tolerance is that for cracks.
    pub(super) fn new(points: &'a [Vec3], triangles: &'a [[VertexId; 3]], edges: &EdgeTable, tolerance: f64) -> Self {
        let open = open_half_edges(edges, triangles.len());
        let of_open = open.iter().flat_map(|h| triangles[h.face().index()]).flat_map(|v| points[v.index()]);
        let rounding = ROUNDING * of_open.fold(0.0_f64, |m, c| m.max(c.abs()));
        Self { points, triangles, open, tolerance: tolerance.max(rounding), rounding }
    }

    /// The vertices at which boundary edges are to be split.
    pub(super) fn splits(&self) -> Splits {
        let mut placed = self.placed();
        // First vertex by vertex: on which edges it may be put is decided for all of them together.
        placed.sort_unstable_by_key(|v| (v.vertex, v.edge));
        let mut kept: Vec<OnEdge> = Vec::new();
        for of_vertex in placed.chunk_by(|v, w| v.vertex == w.vertex) {
            kept.extend(self.undisputed(of_vertex));
        }
        // Then edge by edge, in the order along it: each vertex cuts a part off what the one before left.
        kept.sort_unstable_by(|v, w| {
            v.edge.cmp(&w.edge).then(v.along.total_cmp(&w.along)).then(v.vertex.cmp(&w.vertex))
        });
        let mut splits = Splits::new();
        for of_edge in kept.chunk_by(|v, w| v.edge == w.edge) {
            let vertices = self.sound_ones(of_edge);
            if !vertices.is_empty() {
                splits.push((of_edge[0].edge, vertices));
            }
        }
        splits
    }

    /// The vertices on edges along which they run, without facing them; at most so many times each.
    fn placed(&self) -> Vec<OnEdge> {
        if self.open.is_empty() {
            return Vec::new();
        }
        let mut edges_at = self.edges_at_vertices();
        let mut times = vec![0; self.points.len()];
        let mut placed = Vec::new();
        self.each_edge_with_vertices(|h, on_edge, looks| {
            let line = self.line(h);
            let (beside, runs_along) = self.beside(h, &line, &on_edge, &mut edges_at, looks);
            let limit = if self.is_crowded(h, &line, beside) { self.rounding } else { self.tolerance };
            for (v, _) in on_edge.iter().zip(runs_along).filter(|(v, runs)| *runs && v.off <= limit) {
                times[v.vertex.index()] += 1;
                if times[v.vertex.index()] <= CROWD {
                    placed.push(*v);
                }
            }
        });
        placed
    }

    /// Where a vertex is to be put: on the edges on which it lies, unless they face each other, or are too many to tell;
    /// then on those on which it lies within rounding.
    fn undisputed(&self, of_vertex: &[OnEdge]) -> impl Iterator<Item = OnEdge> {
        let inward: Vec<Vec3> = of_vertex.iter().map(|v| self.inward(v.edge)).collect();
        // There are no more than `CROWD` of them: pairs are few.
        let faces_earlier = |i: usize| inward[..i].iter().any(|v| faces(inward[i], *v));
        let facing = (0..inward.len()).any(faces_earlier);
        let disputed = facing || of_vertex.len() >= CROWD;
        let limit = if disputed { self.rounding } else { self.tolerance };
        of_vertex.iter().copied().filter(move |v| v.off <= limit)
    }

    /// The boundary vertices that lie on a boundary edge, ascending.
    pub(super) fn vertices_on_edges(&self) -> Vec<VertexId> {
        let mut found = Vec::new();
        self.each_edge_with_vertices(|_, on_edge, _| found.extend(on_edge.iter().map(|v| v.vertex)));
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Hands every boundary edge on which vertices lie to `visit`, with these in their order along it.
    fn each_edge_with_vertices(&self, mut visit: impl FnMut(HalfEdgeId, Vec<OnEdge>, &mut usize)) {
        let mut vertices: Vec<u32> = self.open.iter().flat_map(|h| self.ends(*h)).map(|v| v.0).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut looks = LOOKS * (self.open.len() + vertices.len());
        let tree = PointTree::new(self.points, vertices);
        for h in self.open.iter().copied() {
            let line = self.line(h);
            if line.length <= 2.0 * self.tolerance {
                continue;
            }
            let mut on_edge = Vec::new();
            let reach = 2.0 * self.tolerance;
            tree.near(self.ends(h).map(|v| self.point(v)), reach, &mut looks, |v| {
                on_edge.extend(self.on_edge(h, &line, VertexId(v)));
            });
            if !on_edge.is_empty() {
                on_edge.sort_unstable_by(|v, w| v.along.total_cmp(&w.along).then(v.vertex.cmp(&w.vertex)));
                visit(h, on_edge, &mut looks);
            }
        }
    }

    fn on_edge(&self, h: HalfEdgeId, line: &Line, vertex: VertexId) -> Option<OnEdge> {
        let (along, off) = line.foot(self.point(vertex));
        let inside = along > self.tolerance && along < line.length - self.tolerance && off <= self.tolerance;
        (inside && !self.triangles[h.face().index()].contains(&vertex)).then_some(OnEdge {
            vertex,
            edge: h,
            along,
            off,
        })
    }

    /// Per vertex the numbers of the boundary edges at it.
    fn edges_at_vertices(&self) -> Csr<u32> {
        let at_ends = || self.open.iter().flat_map(|h| self.ends(*h).map(|v| (v.0, h.0)));
        Csr::sorted(self.points.len(), at_ends)
    }

    /// The boundary edges that run along the edge `h`, out of those at the vertices on it; and for each of these vertices
    /// whether it has one whose triangle does not face that of `h`.
    fn beside(
        &self,
        h: HalfEdgeId,
        line: &Line,
        on_edge: &[OnEdge],
        edges_at: &mut Csr<u32>,
        looks: &mut usize,
    ) -> (Vec<Beside>, Vec<bool>) {
        let inward = self.inward(h);
        let (mut beside, mut runs_along) = (Vec::new(), Vec::new());
        for v in on_edge {
            let edges = edges_at.row_mut(v.vertex.index());
            *looks = looks.saturating_sub(edges.len());
            let affordable = if *looks == 0 { &mut [] } else { edges };
            let found: Vec<Beside> =
                affordable.iter().filter_map(|g| self.runs_along(HalfEdgeId(*g), v, line)).collect();
            runs_along.push(found.iter().any(|b| !faces(b.inward, inward)));
            beside.extend(found);
        }
        (beside, runs_along)
    }

    /// Where the boundary edge `g` at a vertex on a line runs along it, farther than the tolerance.
    fn runs_along(&self, g: HalfEdgeId, v: &OnEdge, line: &Line) -> Option<Beside> {
        let other = self.ends(g).into_iter().find(|w| *w != v.vertex)?;
        let (along, off) = line.foot(self.point(other));
        // Beyond the end of the line, the end must lie on the edge, not the edge's end on the line.
        let end = along.clamp(0.0, line.length);
        // The edge leaves the line at the vertex: how far off it is grows with the way from there.
        let off = if end == along { off } else { off * (end - v.along) / (along - v.along) };
        let span = [v.along.min(end), v.along.max(end)];
        let is_on_line = off <= self.tolerance;
        // What runs along no farther than the tolerance may as well run across.
        let is_long = span[1] - span[0] > self.tolerance;
        (is_on_line && is_long).then(|| Beside { span, inward: self.inward(g) })
    }

    /// Whether edges along the edge `h` face it or each other, or are too many to tell.
    fn is_crowded(&self, h: HalfEdgeId, line: &Line, mut beside: Vec<Beside>) -> bool {
        // The edge itself runs along all of it.
        beside.push(Beside { span: [0.0, line.length], inward: self.inward(h) });
        beside.sort_by(|a, b| a.span[0].total_cmp(&b.span[0]));
        // A sweep along the edge: these have begun, and end farther on.
        let mut here: Vec<&Beside> = Vec::new();
        for b in &beside {
            here.retain(|a| a.span[1] - b.span[0] > self.tolerance);
            // The same edge is seen from both its ends.
            if here.iter().any(|a| a.span == b.span && a.inward == b.inward) {
                continue;
            }
            if here.len() >= CROWD || here.iter().any(|a| faces(a.inward, b.inward)) {
                return true;
            }
            here.push(b);
        }
        false
    }

    /// Those of the vertices on an edge that leave no part of its triangle turned over or without area, and are
    /// farther than the tolerance from the one before along the edge.
    fn sound_ones(&self, on_edge: &[OnEdge]) -> Vec<VertexId> {
        let h = on_edge[0].edge;
        let [a, b] = self.ends(h).map(|v| self.point(v));
        let tip = self.point(self.triangles[h.face().index()][h.prev().side()]);
        let normal = cross(sub(b, a), sub(tip, a));
        // The part over the piece from p to q turns the way of the whole triangle.
        let is_sound = |p: Vec3, q: Vec3| dot(cross(sub(q, p), sub(tip, p)), normal) > 0.0;
        let (mut last, mut reached, mut kept) = (a, 0.0, Vec::new());
        for v in on_edge {
            let p = self.point(v.vertex);
            if v.along - reached > self.tolerance && is_sound(last, p) && is_sound(p, b) {
                (last, reached) = (p, v.along);
                kept.push(v.vertex);
            }
        }
        kept
    }

    fn line(&self, h: HalfEdgeId) -> Line {
        Line::new(self.ends(h).map(|v| self.point(v)))
    }

    /// The direction from the edge `h` into its triangle, at right angles to the edge.
    fn inward(&self, h: HalfEdgeId) -> Vec3 {
        let line = self.line(h);
        line.across(sub(self.point(self.triangles[h.face().index()][h.prev().side()]), line.from))
    }

    fn ends(&self, h: HalfEdgeId) -> [VertexId; 2] {
        let t = self.triangles[h.face().index()];
        [t[h.side()], t[(h.side() + 1) % 3]]
    }

    fn point(&self, v: VertexId) -> Vec3 {
        self.points[v.index()]
    }
}

/// Whether two triangles that lie in these directions from an edge are one upon the other.
fn faces(u: Vec3, v: Vec3) -> bool {
    dot(u, v) > FACING * norm(u) * norm(v)
}

/// A triangle split at the vertices on its sides 01, 12, 20, in their order along them: the part at a side becomes a fan
/// over it, one side after the other.
pub(super) fn parts(triangle: [VertexId; 3], on_sides: &[Vec<VertexId>; 3]) -> Vec<[VertexId; 3]> {
    let mut parts = vec![triangle];
    for (k, inner) in on_sides.iter().enumerate() {
        if inner.is_empty() {
            continue;
        }
        // The fans over the sides before have left this side whole: it belongs to one part.
        let ends = [triangle[k], triangle[(k + 1) % 3]];
        let side_of = |t: &[VertexId; 3]| (0..3).find(|i| [t[*i], t[(i + 1) % 3]] == ends);
        let at = parts.iter().enumerate().find_map(|(i, t)| Some((i, side_of(t)?)));
        let Some((part, side)) = at else { continue };
        let apex = parts.remove(part)[(side + 2) % 3];
        let chain: Vec<VertexId> = [&ends[..1], inner, &ends[1..]].concat();
        for piece in chain.windows(2) {
            parts.push([piece[0], piece[1], apex]);
        }
    }
    parts
}
