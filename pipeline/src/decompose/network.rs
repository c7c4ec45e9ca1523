//! Charts as labels of triangles, and the seams between them: edges whose triangles bear different labels.
//!
//! Seams are moved by one operation: some of their edges are replaced by other paths, and the triangles between the
//! old and the new ones change their labels. The operation is undone where a chart would not be legal any more.

use super::dual::Dual;
use super::merge::Limits;
use super::regions::{Outline, Region};
use crate::id::{FaceId, HalfEdgeId};

/// A path along edges: half-edges from end to end, with the label that shall lie on its left and on its right.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub half_edges: Vec<HalfEdgeId>,
    pub left: u32,
    pub right: u32,
}

/// Labels and seams.
pub(super) struct Network<'a> {
    pub dual: &'a Dual<'a>,
    pub labels: Vec<u32>,
    limits: Limits,
    sizes: Vec<usize>,
    /// Per edge, whether it is a seam.
    seam: Vec<bool>,
    /// Per vertex, the number of seam edges at it.
    degree: Vec<u32>,
    /// Per vertex, whether the surface ends there.
    open: Vec<bool>,
    /// Per vertex, one half-edge that begins there.
    out: Vec<HalfEdgeId>,
    marks: Marks,
}

/// Marks that are cleared by counting on.
struct Marks {
    now: u32,
    faces: Vec<u32>,
    vertices: Vec<u32>,
    half_edges: Vec<u32>,
}

impl<'a> Network<'a> {
    pub(super) fn new(dual: &'a Dual<'a>, labels: Vec<u32>, limits: Limits) -> Self {
        let (edges, vertices) = (dual.mesh.edges().len(), dual.mesh.points().len());
        let count = labels.iter().max().map_or(0, |l| *l as usize + 1);
        let faces = labels.len();
        let mut made = Self {
            dual,
            limits,
            sizes: vec![0; count],
            seam: vec![false; edges],
            degree: vec![0; vertices],
            open: vec![false; vertices],
            out: vec![HalfEdgeId(0); vertices],
            marks: Marks { now: 0, faces: vec![0; faces], vertices: vec![0; vertices], half_edges: vec![0; 3 * faces] },
            labels,
        };
        made.labels.iter().for_each(|l| made.sizes[*l as usize] += 1);
        for h in dual.half_edges() {
            made.out[dual.from(h)] = h;
            match dual.across(h) {
                None => [dual.from(h), dual.to(h)].into_iter().for_each(|v| made.open[v] = true),
                Some(t) if made.label(t) != made.label(h) && h < t => made.set_seam(h, true),
                Some(_) => {}
            }
        }
        made
    }

    fn set_seam(&mut self, h: HalfEdgeId, seam: bool) {
        let edge = self.dual.mesh.edges().edge(h).index();
        if std::mem::replace(&mut self.seam[edge], seam) != seam {
            for v in [self.dual.from(h), self.dual.to(h)] {
                self.degree[v] = if seam { self.degree[v] + 1 } else { self.degree[v] - 1 };
            }
        }
    }

    /// The label of the triangle that `h` bounds.
    pub(super) fn label(&self, h: HalfEdgeId) -> u32 {
        self.labels[h.face().index()]
    }

    /// Whether a seam runs along `h`.
    pub(super) fn is_seam(&self, h: HalfEdgeId) -> bool {
        self.seam[self.dual.mesh.edges().edge(h).index()]
    }

    /// Seam edges at a vertex.
    pub(super) fn degree(&self, vertex: usize) -> u32 {
        self.degree[vertex]
    }

    /// Whether the surface ends at a vertex.
    pub(super) fn is_open(&self, vertex: usize) -> bool {
        self.open[vertex]
    }

    /// Whether seams meet or end at a vertex.
    pub(super) fn is_corner(&self, vertex: usize) -> bool {
        self.degree[vertex] > 0 && (self.degree[vertex] != 2 || self.open[vertex])
    }

    /// Calls `visit` for every half-edge that begins at `vertex` and has one on its other side. A fan that is open on
    /// one side is turned through from there to either end.
    pub(super) fn each_out(&self, vertex: usize, mut visit: impl FnMut(HalfEdgeId)) {
        let first = self.out[vertex];
        let mut e = first;
        loop {
            if self.dual.across(e).is_some() {
                visit(e);
            }
            match self.dual.across(e.prev()) {
                Some(next) if next != first => e = next,
                Some(_) => return,
                None => break,
            }
        }
        let mut e = first;
        while let Some(t) = self.dual.across(e) {
            e = t.next();
            if self.dual.across(e).is_some() {
                visit(e);
            }
        }
    }

    /// The seam half-edges that begin at a vertex.
    pub(super) fn seams_at(&self, vertex: usize) -> Vec<HalfEdgeId> {
        let mut all = Vec::new();
        self.each_out(vertex, |h| {
            if self.is_seam(h) {
                all.push(h);
            }
        });
        all
    }

    /// Follows the seam that begins with `h` until it reaches a corner, returns, or is as long as `limit`.
    pub(super) fn follow(&self, h: HalfEdgeId, limit: f64) -> Vec<HalfEdgeId> {
        let start = self.dual.from(h);
        let mut path = vec![h];
        let mut length = self.dual.length(h);
        // Every vertex on the way has two seam edges: no edge comes twice before the start.
        loop {
            let last = path[path.len() - 1];
            let at = self.dual.to(last);
            if at == start || self.is_corner(at) || length >= limit {
                return path;
            }
            let back = self.dual.across(last);
            let Some(next) = self.seams_at(at).into_iter().find(|s| Some(*s) != back) else { return path };
            length += self.dual.length(next);
            path.push(next);
        }
    }

    /// The number of charts.
    pub(super) fn charts(&self) -> usize {
        self.sizes.iter().filter(|s| **s > 0).count()
    }

    /// All seams: those between corners, then the closed ones.
    pub(super) fn curves(&self) -> Vec<Vec<HalfEdgeId>> {
        let mut seen = vec![false; self.dual.mesh.edges().len()];
        let edge = |h: HalfEdgeId| self.dual.mesh.edges().edge(h).index();
        let starts: Vec<HalfEdgeId> = self.dual.half_edges().filter(|h| self.is_seam(*h)).collect();
        let (at_corners, elsewhere): (Vec<_>, Vec<_>) =
            starts.into_iter().partition(|h| self.is_corner(self.dual.from(*h)));
        let mut curves = Vec::new();
        for h in at_corners.into_iter().chain(elsewhere) {
            if !seen[edge(h)] {
                let curve = self.follow(h, f64::INFINITY);
                curve.iter().for_each(|g| seen[edge(*g)] = true);
                curves.push(curve);
            }
        }
        curves
    }

    /// Takes the seam along a path away, so that another one can be laid.
    pub(super) fn lift(&mut self, path: &[HalfEdgeId]) {
        path.iter().for_each(|h| self.set_seam(*h, false));
    }

    /// Puts a lifted seam back.
    pub(super) fn put_back(&mut self, path: &[HalfEdgeId]) {
        path.iter().for_each(|h| self.set_seam(*h, true));
    }

    /// Lays seams in the place of lifted ones: the triangles up to the other seams change their labels. Undone (and
    /// `false`) where one of the charts `labels` would be illegal or too large, or lose or gain half of itself.
    pub(super) fn lay(&mut self, paths: &[Path], labels: &[u32]) -> bool {
        self.marks.now += 1;
        let added: Vec<HalfEdgeId> = paths.iter().flat_map(|p| p.half_edges.iter().copied()).collect();
        self.put_back(&added);
        let most = labels.iter().map(|l| self.sizes[*l as usize] / 2 + 1).min().unwrap_or(0);
        let mut changed = Vec::new();
        let fits = self.flood(paths, labels, &mut changed)
            && changed.len() <= most
            && labels.iter().all(|l| self.is_legal(*l));
        if !fits {
            for (face, label) in changed.into_iter().rev() {
                self.relabel(face, label);
            }
            self.lift(&added);
        }
        fits
    }

    fn relabel(&mut self, face: FaceId, label: u32) -> u32 {
        let old = std::mem::replace(&mut self.labels[face.index()], label);
        self.sizes[old as usize] -= 1;
        self.sizes[label as usize] += 1;
        old
    }

    /// Gives the triangles beside `new` the labels that they shall have, and from there all others up to the seams.
    /// Whether no triangle was claimed by two labels. Ends because a triangle is claimed once.
    fn flood(&mut self, new: &[Path], labels: &[u32], changed: &mut Vec<(FaceId, u32)>) -> bool {
        let mut stack: Vec<FaceId> = Vec::new();
        for path in new {
            for h in &path.half_edges {
                let beyond = self.dual.across(*h).map(|t| (t.face(), path.right));
                for (face, label) in [Some((h.face(), path.left)), beyond].into_iter().flatten() {
                    if !self.claim(face, label, labels, changed, &mut stack) {
                        return false;
                    }
                }
            }
        }
        while let Some(face) = stack.pop() {
            let label = self.labels[face.index()];
            for h in (0..3).map(|k| HalfEdgeId::side_of(face, k)) {
                let beyond = self.dual.across(h).filter(|t| !self.is_seam(h) && self.label(*t) != label);
                let Some(t) = beyond else { continue };
                if !self.claim(t.face(), label, labels, changed, &mut stack) {
                    return false;
                }
            }
        }
        true
    }

    /// Gives a triangle a label; fails where it has been given another one, or belongs to a chart that is not among
    /// `labels`.
    fn claim(
        &mut self,
        face: FaceId,
        label: u32,
        labels: &[u32],
        changed: &mut Vec<(FaceId, u32)>,
        stack: &mut Vec<FaceId>,
    ) -> bool {
        let had = self.labels[face.index()];
        let claimed = std::mem::replace(&mut self.marks.faces[face.index()], self.marks.now) == self.marks.now;
        if had != label {
            if claimed || !labels.contains(&had) {
                return false;
            }
            changed.push((face, self.relabel(face, label)));
            stack.push(face);
        }
        true
    }

    /// Whether the triangles of a label form a chart within the limits. Costs their number.
    fn is_legal(&mut self, label: u32) -> bool {
        self.marks.now += 1;
        let now = self.marks.now;
        let Some(seed) = self.labels.iter().position(|l| *l == label) else { return false };
        let mut region = Region::default();
        let mut vertices = 0;
        let mut stack = vec![FaceId::at(seed)];
        self.marks.faces[seed] = now;
        while let Some(face) = stack.pop() {
            region.faces += 1;
            for h in (0..3).map(|k| HalfEdgeId::side_of(face, k)) {
                vertices += usize::from(std::mem::replace(&mut self.marks.vertices[self.dual.from(h)], now) != now);
                match self.dual.across(h).filter(|t| self.label(*t) == label) {
                    None => region.boundary.push(h),
                    Some(t) => {
                        if std::mem::replace(&mut self.marks.faces[t.face().index()], now) != now {
                            stack.push(t.face());
                        }
                    }
                }
            }
        }
        let outline = self.outline(label, &region.boundary);
        region.inside = vertices.saturating_sub(region.boundary.len());
        region.faces == self.sizes[label as usize] && self.limits.allow(self.dual, &region, &outline)
    }

    /// Walks along the boundary of a label. See [`super::regions`].
    fn outline(&mut self, label: u32, boundary: &[HalfEdgeId]) -> Outline {
        self.marks.now += 1;
        let now = self.marks.now;
        let mut outline = Outline::default();
        for start in boundary {
            let mut turn = Vec::new();
            let mut h = *start;
            while std::mem::replace(&mut self.marks.half_edges[h.index()], now) != now {
                turn.push(h);
                let again = std::mem::replace(&mut self.marks.vertices[self.dual.from(h)], now) == now;
                outline.pinches += usize::from(again);
                let beyond = self.dual.mesh.edges().twin(h).filter(|_| self.dual.across(h).is_none());
                outline.meets_itself |= beyond.is_some_and(|t| self.label(t) == label);
                let mut e = h.next();
                while let Some(t) = self.dual.across(e).filter(|t| self.label(*t) == label) {
                    e = t.next();
                }
                h = e;
            }
            if !turn.is_empty() {
                outline.loops.push(turn);
            }
        }
        outline
    }
}
