//! Charts as labels of triangles, and the seams between them: edges whose triangles bear different labels.
//!
//! Seams are moved by one operation: see [`super::reroute`].

use super::boundaries::Boundaries;
use super::dual::Dual;
use super::merge::Limits;
use crate::topology::partition::Partition;
use crate::topology::union_find::UnionFind;
use crate::topology::{HalfEdgeId, VisitStamps};

/// A chart keeps at least this share of its area in a step of straightening. On a sphere the shortest loops are points: with
/// much less a chart could shrink away in a few steps. By experience; more would bar what straightens small charts.
pub(super) const MIN_SHARE: f64 = 0.5;

/// Marks vertices where the surface does not end.
const INNER: u32 = u32::MAX;

/// Labels and seams.
#[derive(Clone)]
pub(super) struct Network<'a> {
    pub dual: &'a Dual<'a>,
    pub labels: Vec<u32>,
    pub limits: Limits,
    /// Per label the area that it keeps at least, and the one that it has.
    pub min_areas: Vec<f64>,
    pub areas: Vec<f64>,
    /// Per label, its triangles, the vertices inside it, and the half-edges at which it lies beside itself in space.
    pub sizes: Vec<usize>,
    pub inside: Vec<usize>,
    pub meetings: Vec<usize>,
    pub boundaries: Boundaries,
    /// Per edge, whether it is a seam.
    seam: Vec<bool>,
    /// Per vertex, the number of seam edges at it.
    degree: Vec<u32>,
    /// Per vertex, the open loop of the surface through it, or [`INNER`].
    open: Vec<u32>,
    /// Per vertex, one half-edge that begins there.
    pub out: Vec<HalfEdgeId>,
    /// The triangles that were given a label by the seams that are being laid.
    pub claimed: VisitStamps,
}

impl<'a> Network<'a> {
    pub(super) fn new(dual: &'a Dual<'a>, labels: Vec<u32>, limits: Limits) -> Self {
        let (edges, vertices) = (dual.mesh.edges().len(), dual.mesh.points().len());
        let count = labels.iter().max().map_or(0, |l| *l as usize + 1);
        let faces = labels.len();
        let mut made = Self {
            dual,
            limits,
            min_areas: vec![0.0; count],
            areas: vec![0.0; count],
            sizes: vec![0; count],
            inside: vec![0; count],
            meetings: vec![0; count],
            boundaries: Boundaries::new(dual, &Partition::new(dual, &labels), count),
            seam: vec![false; edges],
            degree: vec![0; vertices],
            open: open_loops(dual),
            out: vec![HalfEdgeId(0); vertices],
            claimed: VisitStamps::new(faces),
            labels,
        };
        for (f, label) in made.labels.iter().enumerate() {
            made.sizes[*label as usize] += 1;
            made.areas[*label as usize] += dual.area(f);
        }
        for h in dual.half_edges() {
            made.out[dual.from(h)] = h;
            if made.partition().is_seam(h) {
                made.mark_seam(h, true);
            }
        }
        for (h, beyond) in dual.coincidences() {
            let label = made.label(h);
            made.meetings[label as usize] += usize::from(beyond.iter().any(|f| made.labels[f.index()] == label));
        }
        for v in 0..vertices {
            made.count_inside(v, 1);
        }
        made.keeping(MIN_SHARE)
    }

    /// The same charts, which keep at least this share of the areas that they have now.
    pub(super) fn keeping(self, share: f64) -> Self {
        Self { min_areas: self.areas.iter().map(|a| share * a).collect(), ..self }
    }

    /// Makes the edge along `h` a seam or none.
    fn mark_seam(&mut self, h: HalfEdgeId, seam: bool) {
        let edge = self.dual.mesh.edges().edge(h).index();
        if std::mem::replace(&mut self.seam[edge], seam) != seam {
            for v in [self.dual.from(h), self.dual.to(h)] {
                self.degree[v] = if seam { self.degree[v] + 1 } else { self.degree[v] - 1 };
            }
        }
    }

    /// As [`Self::mark_seam`], with the count of inner vertices.
    pub(super) fn set_seam(&mut self, h: HalfEdgeId, seam: bool) {
        let ends = [self.dual.from(h), self.dual.to(h)];
        ends.iter().for_each(|v| self.count_inside(*v, -1));
        self.mark_seam(h, seam);
        ends.iter().for_each(|v| self.count_inside(*v, 1));
    }

    /// Counts a vertex (or no more) if it lies inside a chart: that of the triangle of its half-edge [`Self::out`].
    pub(super) fn count_inside(&mut self, vertex: usize, by: isize) {
        if self.degree[vertex] == 0 && !self.is_open(vertex) {
            let count = &mut self.inside[self.labels[self.out[vertex].face().index()] as usize];
            *count = count.wrapping_add_signed(by);
        }
    }

    /// The charts as they are now.
    pub(super) fn partition(&self) -> Partition<'_, Dual<'a>> {
        Partition::new(self.dual, &self.labels)
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
        self.open[vertex] != INNER
    }

    /// Whether two vertices lie on the same open loop of the surface.
    pub(super) fn on_one_loop(&self, a: usize, b: usize) -> bool {
        self.is_open(a) && self.open[a] == self.open[b]
    }

    /// Whether seams meet or end at a vertex.
    pub(super) fn is_corner(&self, vertex: usize) -> bool {
        self.degree[vertex] > 0 && (self.degree[vertex] != 2 || self.is_open(vertex))
    }

    /// Calls `visit` for every half-edge that begins at `vertex` and has one on its other side. A fan that is open on
    /// one side is turned through from there to either end.
    pub(super) fn each_out(&self, vertex: usize, mut visit: impl FnMut(HalfEdgeId)) {
        let first = self.out[vertex];
        let mut e = first;
        loop {
            if self.dual.twin(e).is_some() {
                visit(e);
            }
            match self.dual.twin(e.prev()) {
                Some(next) if next != first => e = next,
                Some(_) => return,
                None => break,
            }
        }
        let mut e = first;
        while let Some(t) = self.dual.twin(e) {
            e = t.next();
            if self.dual.twin(e).is_some() {
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
            // Two seam edges meet here: the second one is what follows around the chart on the left.
            let next = self.partition().next(last);
            length += self.dual.length(next);
            path.push(next);
        }
    }

    /// The half-edges of all seams, on both sides, chart by chart.
    pub(super) fn seams(&self) -> impl Iterator<Item = HalfEdgeId> {
        let charts = 0..self.label_count() as u32;
        charts.flat_map(|label| self.boundaries.around(label)).filter(|h| self.is_seam(*h))
    }

    /// The number of charts.
    pub(super) fn charts(&self) -> usize {
        self.sizes.iter().filter(|s| **s > 0).count()
    }

    /// One more than the highest label.
    pub(super) fn label_count(&self) -> usize {
        self.sizes.len()
    }

    /// All seams: those between corners, then the closed ones.
    pub(super) fn curves(&self) -> Vec<Vec<HalfEdgeId>> {
        let mut seen = vec![false; self.dual.mesh.edges().len()];
        let edge = |h: HalfEdgeId| self.dual.mesh.edges().edge(h).index();
        let (at_corners, elsewhere): (Vec<_>, Vec<_>) = self.seams().partition(|h| self.is_corner(self.dual.from(*h)));
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

    /// Per label, whether its chart is one of these, or has a vertex or a coincident edge in common with one.
    pub(super) fn with_neighbours(&self, labels: &[bool]) -> Vec<bool> {
        let triangles = self.dual.mesh.triangles();
        let mut is_touched = vec![false; self.dual.mesh.points().len()];
        for (t, _) in triangles.iter().zip(&self.labels).filter(|(_, label)| labels[**label as usize]) {
            t.iter().for_each(|v| is_touched[v.index()] = true);
        }
        let mut found = labels.to_vec();
        for (t, label) in triangles.iter().zip(&self.labels) {
            found[*label as usize] |= t.iter().any(|v| is_touched[v.index()]);
        }
        for (_, beyond) in self.dual.coincidences().filter(|(h, _)| labels[self.label(*h) as usize]) {
            beyond.iter().for_each(|f| found[self.labels[f.index()] as usize] = true);
        }
        found
    }

    /// Whether every chart is connected: the one thing that [`Self::reroute`] takes on trust.
    pub(super) fn is_sound(&self) -> bool {
        let mut parts = self.dual.united(|h, twin| self.label(twin) == self.label(h));
        parts.labels().1 == self.charts()
    }
}

/// Per vertex, the open loop through it (its least vertex), or [`INNER`].
fn open_loops(dual: &Dual) -> Vec<u32> {
    let vertices = dual.mesh.points().len();
    let mut sets = UnionFind::new(vertices);
    let mut open = vec![false; vertices];
    for h in dual.half_edges().filter(|h| dual.twin(*h).is_none()) {
        sets.merge(dual.from(h), dual.to(h));
        (open[dual.from(h)], open[dual.to(h)]) = (true, true);
    }
    (0..vertices).map(|v| if open[v] { sets.find(v) as u32 } else { INNER }).collect()
}
