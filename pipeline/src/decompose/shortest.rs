//! Shortest paths along the edges of a surface.

use super::dual::Dual;
use super::network::Network;
use super::voronoi::At;
use crate::id::HalfEdgeId;
use crate::space::distance;
use std::collections::BinaryHeap;

/// An edge along a feature is as long as this share of it.
const FEATURE: f64 = 0.25;

/// The length of an edge as far as paths are concerned.
pub(super) fn weight(dual: &Dual, h: HalfEdgeId) -> f64 {
    dual.length(h) * if dual.is_feature(h) { FEATURE } else { 1.0 }
}

/// The length of a path.
pub(super) fn length(dual: &Dual, path: &[HalfEdgeId]) -> f64 {
    path.iter().map(|h| weight(dual, *h)).sum()
}

/// A path with its reverse.
pub(super) fn reversed(dual: &Dual, path: &[HalfEdgeId]) -> Vec<HalfEdgeId> {
    path.iter().rev().filter_map(|h| dual.across(*h)).collect()
}

/// What the search knows of a vertex.
#[derive(Clone, Copy)]
struct Reached {
    stamp: u32,
    via: HalfEdgeId,
    distance: f64,
}

/// A tree of shortest paths, of vertices that were reached.
pub(super) struct Tree {
    from: usize,
    now: u32,
    known: Vec<Reached>,
    heap: BinaryHeap<At>,
    /// The straight distance times this never exceeds the length of a path.
    floor: f64,
    /// The vertices in the order in which they were settled.
    pub settled: Vec<usize>,
}

/// What paths are sought for.
#[derive(Clone, Copy)]
pub(super) enum Goal {
    /// This vertex.
    Vertex(usize),
    /// The nearest vertex of the open loop through this one.
    OpenLoop(usize),
    /// The place where the paths from the root and from two more vertices meet; none is known before all are grown.
    Meeting([usize; 2]),
}

/// Where paths may go.
#[derive(Clone, Copy)]
pub(super) struct Bounds<'a> {
    pub goal: Goal,
    /// Through the inside of these charts, touching no seam.
    pub labels: &'a [u32],
    /// No further than this (where three paths meet: all of them together).
    pub length: f64,
    /// Through these vertices.
    pub band: &'a [bool],
}

impl Tree {
    pub(super) fn new(dual: &Dual) -> Self {
        let unknown = Reached { stamp: 0, via: HalfEdgeId(0), distance: 0.0 };
        Self {
            from: 0,
            now: 0,
            known: vec![unknown; dual.mesh.points().len()],
            heap: BinaryHeap::new(),
            floor: if dual.feature.contains(&true) { FEATURE } else { 1.0 },
            settled: Vec::new(),
        }
    }

    /// The distance of a vertex, if it was reached.
    pub(super) fn distance(&self, vertex: usize) -> Option<f64> {
        let known = &self.known[vertex];
        (known.stamp == self.now).then_some(known.distance)
    }

    /// The path from the root to a vertex that was reached.
    pub(super) fn path(&self, dual: &Dual, vertex: usize) -> Vec<HalfEdgeId> {
        let mut path = Vec::new();
        let mut at = vertex;
        while at != self.from {
            path.push(self.known[at].via);
            at = dual.from(self.known[at].via);
        }
        path.reverse();
        path
    }

    /// Grows the tree from `from`: Dijkstra, ordered by the distance with a bound for what is left (A*: Hart, Nilsson
    /// and Raphael 1968, doi 10.1109/TSSC.1968.300136). Ends because distances only fall.
    pub(super) fn grow(&mut self, network: &Network, from: usize, bounds: &Bounds) {
        let dual = network.dual;
        let mut heap = std::mem::take(&mut self.heap);
        let plain = self.floor == 1.0;
        self.now += 1;
        self.from = from;
        self.settled.clear();
        heap.clear();
        heap.push(At { distance: self.left(dual, bounds, from), node: from as u32 });
        self.known[from] = Reached { stamp: self.now, via: HalfEdgeId(0), distance: 0.0 };
        while let Some(At { distance: sum, node }) = heap.pop() {
            let node = node as usize;
            let so_far = self.known[node].distance;
            if sum > so_far + self.left(dual, bounds, node) {
                continue;
            }
            self.settled.push(node);
            if node != from && (bounds.goal.is_at(network, node) || network.is_open(node)) {
                if bounds.goal.is_at(network, node) {
                    break;
                }
                continue;
            }
            network.each_out(node, |h| {
                let to = dual.to(h);
                let distance = so_far + if plain { dual.length(h) } else { weight(dual, h) };
                let known = &self.known[to];
                if known.stamp == self.now && known.distance <= distance || !bounds.admit(network, h, to, node == from)
                {
                    return;
                }
                let sum = distance + self.left(dual, bounds, to);
                if sum <= bounds.length {
                    self.known[to] = Reached { stamp: self.now, via: h, distance };
                    heap.push(At { distance: sum, node: to as u32 });
                }
            });
        }
        self.heap = heap;
    }

    /// What a path through `vertex` still needs at least. It never falls by more than the length of an edge, so that
    /// vertices are settled at their distances. Three points are not joined by less than half of their triangle.
    fn left(&self, dual: &Dual, bounds: &Bounds, vertex: usize) -> f64 {
        let apart = |a: usize, b: usize| distance(dual.point(a), dual.point(b));
        self.floor
            * match bounds.goal {
                Goal::Vertex(v) => apart(vertex, v),
                Goal::OpenLoop(_) => 0.0,
                Goal::Meeting([a, b]) => 0.5 * (apart(vertex, a) + apart(vertex, b) + apart(a, b)),
            }
    }
}

impl Goal {
    fn is_at(&self, network: &Network, vertex: usize) -> bool {
        match self {
            Goal::Vertex(v) => vertex == *v,
            Goal::OpenLoop(v) => network.on_one_loop(vertex, *v),
            Goal::Meeting(_) => false,
        }
    }
}

impl Bounds<'_> {
    /// Whether a path may go along `h` to the vertex `to`. Around a vertex that no seam touches nothing but the given
    /// charts is found: so labels are only asked for at the root.
    fn admit(&self, network: &Network, h: HalfEdgeId, to: usize, at_root: bool) -> bool {
        let inside = |h: HalfEdgeId| self.labels.contains(&network.label(h));
        let may_end = |v: usize| match self.goal {
            Goal::Vertex(target) => v == target,
            Goal::OpenLoop(_) => network.degree(v) == 0 && self.band[v],
            Goal::Meeting(_) => false,
        };
        let free = network.degree(to) == 0 && self.band[to] && !network.is_open(to);
        (free || may_end(to) && !network.is_seam(h))
            && (!at_root || inside(h) && network.dual.across(h).is_some_and(inside))
    }
}
