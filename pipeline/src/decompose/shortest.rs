//! Shortest paths along the edges of a surface.

use super::dual::Dual;
use super::network::Network;
use crate::monitor::Interrupted;
use crate::topology::HalfEdgeId;
use crate::topology::dijkstra::{Settled, ShortestPaths};
use crate::vec3::distance;

/// An edge along a feature is as long as this share of it: seams go four times as far to run along features. Half and twice
/// as much gave the same number of charts on 15 of 18 meshes; cad_box_multi fell into 143 and 161 instead of 135, but cad_imu
/// into 121 and 128 instead of 142.
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
    path.iter().rev().filter_map(|h| dual.twin(*h)).collect()
}

/// A tree of shortest paths, of vertices that were reached.
pub(super) struct Tree {
    from: usize,
    /// Every vertex has for a label the half-edge along which it was reached.
    paths: ShortestPaths<HalfEdgeId>,
    /// The straight distance times this never exceeds the length of a path.
    floor: f64,
    /// The vertices in the order in which they were settled.
    pub settled: Vec<usize>,
}

/// What paths are sought for.
#[derive(Clone, Copy)]
pub(super) enum Goal<'a> {
    /// This vertex.
    Vertex(usize),
    /// The nearest vertex of the open loop through this one.
    OpenLoop(usize),
    /// The place where the paths from the root and from two more vertices meet, whose trees may have been grown already.
    Meeting([(usize, Option<&'a Tree>); 2]),
}

/// Where paths may go.
#[derive(Clone, Copy)]
pub(super) struct Bounds<'a> {
    pub goal: Goal<'a>,
    /// Through the inside of these charts, touching no seam.
    pub labels: &'a [u32],
    /// No further than this (where three paths meet: all of them together).
    pub length: f64,
    /// Through these vertices.
    pub band: &'a [bool],
    /// Not along these edges.
    pub barred: &'a [bool],
}

impl Tree {
    pub(super) fn new(dual: &Dual) -> Self {
        Self {
            from: 0,
            paths: ShortestPaths::new(dual.mesh.points().len(), HalfEdgeId(0)),
            floor: if dual.sharpness.iter().any(|s| *s > 0.0) { FEATURE } else { 1.0 },
            settled: Vec::new(),
        }
    }

    /// The distance of a vertex, if it was reached.
    pub(super) fn distance(&self, vertex: usize) -> Option<f64> {
        self.paths.distance(vertex)
    }

    /// The path from the root to a vertex; none where that was not reached.
    pub(super) fn path(&self, dual: &Dual, vertex: usize) -> Option<Vec<HalfEdgeId>> {
        let mut path = Vec::new();
        let mut at = vertex;
        while at != self.from {
            let via = self.paths.label(at)?;
            path.push(via);
            at = dual.from(via);
        }
        path.reverse();
        Some(path)
    }

    /// Grows the tree from `from`, on the way to one vertex by A*.
    ///
    /// # Errors
    /// [`Interrupted`]: the tree is none then.
    pub(super) fn grow(&mut self, network: &Network, from: usize, bounds: &Bounds) -> Result<(), Interrupted> {
        let floor = self.floor;
        let ahead = |vertex: usize| match bounds.goal {
            Goal::Vertex(_) => bounds.left(network.dual, floor, vertex),
            Goal::OpenLoop(_) | Goal::Meeting(_) => 0.0,
        };
        self.from = from;
        self.settled.clear();
        self.paths.clear();
        self.paths.start(from, HalfEdgeId(0));
        let mut limit = bounds.length;
        while let Some(node) = self.paths.settle_towards(ahead) {
            network.dual.checkpoint.after(1)?;
            self.settled.push(node.index);
            if node.index != from && bounds.goal.is_at(network, node.index) {
                break;
            }
            if node.index == from || !network.is_open(node.index) {
                limit = limit.min(bounds.goal.total(node.index, node.distance));
                self.spread(network, &node, &Bounds { length: limit, ..*bounds }, ahead);
            }
        }
        Ok(())
    }

    /// Reaches the neighbours of a vertex.
    fn spread(&mut self, network: &Network, node: &Settled<HalfEdgeId>, bounds: &Bounds, ahead: impl Fn(usize) -> f64) {
        let dual = network.dual;
        let (from, floor) = (self.from, self.floor);
        let has_no_features = floor == 1.0;
        let paths = &mut self.paths;
        network.each_out(node.index, |h| {
            let to = dual.to(h);
            let step = if has_no_features { dual.length(h) } else { weight(dual, h) };
            let distance = node.distance + step;
            let is_near = paths.distance(to).is_some_and(|known| known <= distance);
            if is_near || !bounds.admit(network, h, to, node.index == from) {
                return;
            }
            if distance + bounds.left(dual, floor, to) <= bounds.length {
                paths.reach_towards(to, distance, h, ahead(to));
            }
        });
    }
}

/// The length of the shortest lines that join the corners of a triangle with these sides: from its Fermat point, or
/// the two shorter sides where the angle between them is 120 degrees or more.
fn joined(mut sides: [f64; 3]) -> f64 {
    sides.sort_unstable_by(f64::total_cmp);
    let [a, b, c] = sides;
    let [aa, bb, cc] = [a * a, b * b, c * c];
    if cc >= aa + bb + a * b {
        return a + b;
    }
    let doubled_area = 0.5 * (4.0 * aa * bb - (aa + bb - cc).powi(2)).max(0.0).sqrt();
    (0.5 * (aa + bb + cc) + 3.0_f64.sqrt() * doubled_area).sqrt()
}

impl Goal<'_> {
    fn is_at(&self, network: &Network, vertex: usize) -> bool {
        match self {
            Goal::Vertex(v) => vertex == *v,
            Goal::OpenLoop(v) => network.on_one_loop(vertex, *v),
            Goal::Meeting(_) => false,
        }
    }

    /// The three ways to `vertex` together, where all are known; else infinite.
    fn total(&self, vertex: usize, own: f64) -> f64 {
        let Goal::Meeting([(a, Some(to_a)), (b, Some(to_b))]) = self else { return f64::INFINITY };
        let ways = to_a.distance(vertex).zip(to_b.distance(vertex)).filter(|_| vertex != *a && vertex != *b);
        ways.map_or(f64::INFINITY, |(a, b)| own + a + b)
    }
}

impl Bounds<'_> {
    /// What a path through `vertex` still needs at least, where `floor` times a straight distance never exceeds the length of
    /// a path. Three points are not joined by less than straight lines from their Fermat point, nor by less than half the
    /// circumference of their triangle, along paths that are known.
    fn left(&self, dual: &Dual, floor: f64, vertex: usize) -> f64 {
        let straight = |a: usize, b: usize| floor * distance(dual.point(a), dual.point(b));
        match self.goal {
            Goal::Vertex(v) => straight(vertex, v),
            Goal::OpenLoop(_) => 0.0,
            Goal::Meeting([(a, to_a), (b, to_b)]) => {
                let [va, vb, ab] = [straight(vertex, a), straight(vertex, b), straight(a, b)];
                let known = |tree: Option<&Tree>, way: f64| tree.and_then(|t| t.distance(vertex)).unwrap_or(way);
                joined([va, vb, ab]).max(0.5 * (known(to_a, va) + known(to_b, vb) + ab))
            }
        }
    }

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
            && !self.barred[network.dual.mesh.edges().edge(h).index()]
            && (!at_root || inside(h) && network.dual.twin(h).is_some_and(inside))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decompose;
    use crate::decompose::merge::Limits;
    use crate::monitor::NoMonitor;
    use crate::repair::{Settings, repair};
    use crate::shapes::{self, Random};

    #[test]
    fn three_points_are_joined_from_their_fermat_point() {
        assert!((joined([1.0; 3]) - 3.0_f64.sqrt()).abs() < 1e-15);
        assert_eq!(joined([1.9, 1.0, 1.0]), 2.0);
        assert_eq!(joined([0.0, 3.0, 3.0]), 3.0);
        let right = joined([1.0, 2.0_f64.sqrt(), 1.0]);
        assert!((right - (2.0 + 3.0_f64.sqrt()).sqrt()).abs() < 1e-15);
    }

    /// The least sum of the ways from three vertices, whose trees are bounded by `length`.
    fn meeting(network: &Network, ends: [usize; 3], length: f64) -> f64 {
        let band = vec![true; network.dual.mesh.points().len()];
        let [mut first, mut second, mut third] = [0; 3].map(|_| Tree::new(network.dual));
        let barred = vec![false; network.dual.mesh.edges().len()];
        let bounds = |a, b| Bounds { goal: Goal::Meeting([a, b]), labels: &[0], length, band: &band, barred: &barred };
        first.grow(network, ends[0], &bounds((ends[1], None), (ends[2], None))).expect("nobody interrupts");
        second.grow(network, ends[1], &bounds((ends[0], Some(&first)), (ends[2], None))).expect("nobody interrupts");
        third
            .grow(network, ends[2], &bounds((ends[0], Some(&first)), (ends[1], Some(&second))))
            .expect("nobody interrupts");
        let sum = |v: &usize| Some(first.distance(*v)? + second.distance(*v)? + third.distance(*v)?);
        let inner = third.settled.iter().filter(|v| !ends.contains(v));
        inner.filter_map(sum).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn bounds_do_not_hide_the_shortest_ways() {
        let mesh = repair(&shapes::bent_disk(16, 0.3, 0.2), &Settings::default()).expect("a surface is left").mesh;
        let dual = Dual::new(&mesh, &NoMonitor);
        let limits = Limits::new(&decompose::Settings::default());
        let network = Network::new(&dual, vec![0; mesh.triangles().len()], limits);
        let inner: Vec<usize> = (0..mesh.points().len()).filter(|v| !network.is_open(*v)).collect();
        let mut random = Random(3);
        for _ in 0..40 {
            let ends = [0; 3].map(|_| inner[random.below(inner.len())]);
            let free = meeting(&network, ends, 1e9);
            let bounded = meeting(&network, ends, 1.000001 * free);
            assert!((free - bounded).abs() < 1e-12, "{free} {bounded}");
        }
    }

    #[test]
    fn a_star_finds_what_dijkstra_finds() {
        let mesh = repair(&shapes::bent_disk(16, 0.3, 0.2), &Settings::default()).expect("a surface is left").mesh;
        let dual = Dual::new(&mesh, &NoMonitor);
        let limits = Limits::new(&decompose::Settings::default());
        let network = Network::new(&dual, vec![0; mesh.triangles().len()], limits);
        let band = vec![true; mesh.points().len()];
        let (mut all, mut one) = (Tree::new(&dual), Tree::new(&dual));
        let barred = vec![false; dual.mesh.edges().len()];
        let bounds = |goal| Bounds { goal, labels: &[0], length: f64::INFINITY, band: &band, barred: &barred };
        let inner: Vec<usize> = (0..mesh.points().len()).filter(|v| !network.is_open(*v)).collect();
        all.grow(&network, inner[0], &bounds(Goal::Meeting([(inner[0], None); 2]))).expect("nobody interrupts");
        for target in inner.iter().skip(1).step_by(7) {
            one.grow(&network, inner[0], &bounds(Goal::Vertex(*target))).expect("nobody interrupts");
            let path = one.path(&dual, *target).expect("reached");
            assert!((length(&dual, &path) - one.distance(*target).expect("reached")).abs() < 1e-12);
            assert!((one.distance(*target).expect("reached") - all.distance(*target).expect("reached")).abs() < 1e-12);
        }
    }
}
