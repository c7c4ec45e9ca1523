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

/// A tree of shortest paths, of vertices that were reached.
pub(super) struct Tree {
    from: usize,
    now: u32,
    stamp: Vec<u32>,
    distance: Vec<f64>,
    via: Vec<HalfEdgeId>,
    pub reached: Vec<usize>,
}

/// Where paths may go.
#[derive(Clone, Copy)]
pub(super) struct Bounds<'a> {
    /// Through the inside of these charts, touching no seam.
    pub labels: &'a [u32],
    /// No further than this.
    pub length: f64,
    /// To this vertex, if to one; else everywhere.
    pub target: Option<usize>,
    /// Whether paths may end at the open boundary.
    pub to_open: bool,
    /// Through these vertices.
    pub band: &'a [bool],
}

impl Tree {
    pub(super) fn new(vertices: usize) -> Self {
        Self {
            from: 0,
            now: 0,
            stamp: vec![0; vertices],
            distance: vec![0.0; vertices],
            via: vec![HalfEdgeId(0); vertices],
            reached: Vec::new(),
        }
    }

    /// The distance of a vertex, if it was reached.
    pub(super) fn distance(&self, vertex: usize) -> Option<f64> {
        (self.stamp[vertex] == self.now).then(|| self.distance[vertex])
    }

    /// The path from the root to a vertex that was reached.
    pub(super) fn path(&self, dual: &Dual, vertex: usize) -> Vec<HalfEdgeId> {
        let mut path = Vec::new();
        let mut at = vertex;
        while at != self.from {
            path.push(self.via[at]);
            at = dual.from(self.via[at]);
        }
        path.reverse();
        path
    }

    /// Grows the tree from `from`: Dijkstra, with the straight distance to the target as what is left (A*: Hart,
    /// Nilsson and Raphael 1968, doi 10.1109/TSSC.1968.300136). Ends because distances only fall.
    pub(super) fn grow(&mut self, network: &Network, from: usize, bounds: &Bounds) {
        let dual = network.dual;
        self.now += 1;
        self.from = from;
        self.reached.clear();
        let left = |v: usize| bounds.target.map_or(0.0, |t| FEATURE_FLOOR * distance(dual.point(v), dual.point(t)));
        let mut heap = BinaryHeap::from([At { distance: left(from), node: from as u32 }]);
        (self.stamp[from], self.distance[from]) = (self.now, 0.0);
        while let Some(At { distance: sum, node }) = heap.pop() {
            let node = node as usize;
            let so_far = self.distance[node];
            if sum > so_far + left(node) {
                continue;
            }
            self.reached.push(node);
            if bounds.target == Some(node) {
                return;
            }
            if node != from && network.is_open(node) {
                continue;
            }
            network.each_out(node, |h| {
                let to = dual.to(h);
                let length = so_far + weight(dual, h);
                let known = self.stamp[to] == self.now && self.distance[to] <= length;
                if known || length + left(to) > bounds.length || !bounds.admit(network, h, to) {
                    return;
                }
                (self.stamp[to], self.distance[to], self.via[to]) = (self.now, length, h);
                heap.push(At { distance: length + left(to), node: to as u32 });
            });
        }
    }
}

/// The straight distance times this never exceeds the length of a path.
const FEATURE_FLOOR: f64 = FEATURE;

impl Bounds<'_> {
    /// Whether a path may go along `h` to the vertex `to`.
    fn admit(&self, network: &Network, h: HalfEdgeId, to: usize) -> bool {
        let inside = |h: HalfEdgeId| self.labels.contains(&network.label(h));
        let free = network.degree(to) == 0 && (self.to_open || !network.is_open(to));
        (free && self.band[to] || self.target == Some(to))
            && !network.is_seam(h)
            && inside(h)
            && network.dual.across(h).is_some_and(inside)
    }
}
