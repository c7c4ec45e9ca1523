//! Straight seams: shortest paths between corners, shortest loops, and corners where seams are shortest.
//!
//! Each seam is replaced by the shortest path along edges inside the two charts at its sides; a closed one third by
//! third. Each corner of three seams moves to where the sum of the three ways is least, and a seam that ends at the
//! open boundary slides along it. A change is kept if it is shorter and all charts stay legal: so the total length
//! falls with every change, and the number of rounds is fixed.

use super::dual::Dual;
use super::network::Network;
use super::reroute::Path;
use super::shortest::{Bounds, Goal, Tree, length, reversed, weight};
use crate::monitor::Interrupted;
use crate::topology::HalfEdgeId;
use crate::topology::dijkstra::ShortestPaths;
use std::collections::BTreeSet;

/// Rounds over all seams and corners, and the share of the length that makes another one worth while. By experience: the
/// wider bands that follow are more rounds.
const ROUNDS: usize = 2;
const MIN_GAIN: f64 = 5e-3;

/// Pieces of fewer edges are not looked at: there is hardly another path between their ends.
const FEW: usize = 4;

/// A change must be shorter by this share, so that rounding makes none.
const GAIN: f64 = 1e-6;

/// How far from a corner its seams are laid anew, in parts of the size of a chart (the square root of its area). By
/// experience: farther finds shorter seams, and every corner is a search of that radius.
const REACH: f64 = 0.25;

/// Seams while they are straightened.
struct Straightening<'n, 'a> {
    network: &'n mut Network<'a>,
    dual: &'a Dual<'a>,
    trees: [Tree; 3],
    reach: f64,
    /// Where seams may lie.
    band: Band,
    /// Per edge, whether no seam may move along it.
    barred: &'n [bool],
    /// A change is made where the length falls to this share.
    share: f64,
    /// The seams, and the corners with their seams, that were tried in vain: they are not tried again before they
    /// have changed.
    vain: BTreeSet<Tried>,
}

/// What was to be shortened.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Tried {
    /// A seam.
    Seam(Vec<HalfEdgeId>),
    /// A corner, with its seams as far as they are laid anew with it.
    Corner(usize, Vec<HalfEdgeId>),
}

/// What became of a seam that was to be replaced by the shortest path.
enum Shortened {
    /// This path is in its place.
    To(Vec<HalfEdgeId>),
    /// It stays: no path is shorter.
    Straight,
    /// It stays: with the shorter path in its place a chart would be illegal.
    Illegal,
}

/// Straightens seams of `network`. None moves farther than `breadth` tells at one of its half-edges, nor along a `barred` edge; where it
/// tells nothing, the seam stays as it is.
///
/// # Errors
/// [`Interrupted`]: the network is half way between two states then, and no use any more.
pub(super) fn straighten(
    network: &mut Network,
    barred: &[bool],
    breadth: impl Fn(HalfEdgeId) -> Option<f64>,
) -> Result<(), Interrupted> {
    let dual = network.dual;
    let reach = REACH * (dual.total_area() / network.charts().max(1) as f64).sqrt();
    let band = Band::around(network, breadth)?;
    let mut work = Straightening::new(network, reach, band, barred);
    let mut before = work.total();
    for _ in 0..ROUNDS {
        work.seams()?;
        work.corners()?;
        let after = work.total();
        if after >= (1.0 - MIN_GAIN) * before {
            break;
        }
        before = after;
    }
    Ok(())
}

/// Pulls straight the seams of charts that are `wanted`, and parts of them, that are more than `bent` times as long as
/// they must be, as far as the others let it, and whatever becomes of the charts, as long as they are legal. Corners stay
/// where they are, and closed seams are held at [`PINS`] of their vertices. Whether anything changed.
///
/// # Errors
/// As [`straighten`].
pub(super) fn relax(network: &mut Network, bent: f64, wanted: impl Fn(u32) -> bool) -> Result<bool, Interrupted> {
    let everywhere = Band::everywhere(network.dual);
    let barred = vec![false; network.dual.mesh.edges().len()];
    let mut work = Straightening { share: 1.0 / bent, ..Straightening::new(network, 0.0, everywhere, &barred) };
    let mut changed = false;
    for round in 0..ROUNDS {
        for path in work.network.curves() {
            if !wanted(work.network.label(path[0])) {
                continue;
            }
            let closed = work.dual.is_closed(&path);
            // The vertices that hold a closed one are not known any more in the next round.
            let pieces = if closed { PINS } else { 1 };
            for part in path.chunks(path.len().div_ceil(pieces)).filter(|_| !closed || round == 0) {
                changed |= work.shorten_all(part.to_vec())?;
            }
        }
    }
    Ok(changed)
}

/// Takes the corners out of closed seams, at little cost of the area inside. Whether anything changed.
///
/// # Errors
/// As [`straighten`].
pub(super) fn round_off(network: &mut Network) -> Result<bool, Interrupted> {
    let everywhere = Band::everywhere(network.dual);
    let barred = vec![false; network.dual.mesh.edges().len()];
    let mut work = Straightening::new(network, 0.0, everywhere, &barred);
    let mut changed = false;
    for path in work.network.curves() {
        changed |= work.dual.is_closed(&path) && work.shorten_loop(path, EIGHTHS, 2 * EIGHTHS)?;
    }
    Ok(changed)
}

/// A closed seam is rounded off in so many parts: between these, a circle loses a tenth of its area.
const EIGHTHS: usize = 8;

/// A chart whose seams are relaxed had better keep this share of its area: two seams may come to lie side by side.
pub(super) const RELAXED: f64 = 0.1;

/// Vertices that hold a closed seam: on a sphere it would shrink to a point.
const PINS: usize = 4;

impl<'n, 'a> Straightening<'n, 'a> {
    fn new(network: &'n mut Network<'a>, reach: f64, band: Band, barred: &'n [bool]) -> Self {
        let dual = network.dual;
        let trees = [(); 3].map(|()| Tree::new(dual));
        Self { network, dual, trees, reach, band, barred, share: 1.0 - GAIN, vain: BTreeSet::new() }
    }

    fn total(&self) -> f64 {
        0.5 * self.network.seams().map(|h| weight(self.dual, h)).sum::<f64>()
    }

    /// One pass over all seams.
    fn seams(&mut self) -> Result<(), Interrupted> {
        for path in self.network.curves() {
            if !self.band.lets_move(self.dual, &path) {
                continue;
            }
            let closed = self.dual.is_closed(&path);
            let tried = Tried::Seam(path.clone());
            if self.vain.contains(&tried) {
                continue;
            }
            // Thirds, four times around: the shortest path that replaces more than half of a loop may go round the other way.
            let shorter = if closed { self.shorten_loop(path, 3, 12)? } else { self.shorten_all(path)? };
            if !shorter {
                self.vain.insert(tried);
            }
        }
        Ok(())
    }

    /// A seam as a whole; where that fails, by overlapping pieces, then by pieces half as long, down to a few edges.
    /// Whether it became shorter.
    fn shorten_all(&mut self, mut path: Vec<HalfEdgeId>) -> Result<bool, Interrupted> {
        let (mut pieces, mut shorter, mut done) = (1, false, false);
        while !done && path.len() / pieces >= FEW {
            done = true;
            for half in 0..2 * pieces - 1 {
                let n = path.len();
                let range = half * n / (2 * pieces)..(half + 2) * n / (2 * pieces);
                match self.shorten(&path[range.clone()])? {
                    Shortened::To(piece) => {
                        drop(path.splice(range, piece));
                        shorter = true;
                    }
                    Shortened::Straight => {}
                    // Parts of it may be shortened all the same.
                    Shortened::Illegal => done = false,
                }
            }
            pieces *= 2;
        }
        Ok(shorter)
    }

    /// Puts the shortest path in the place of a seam, or of a part of one.
    fn shorten(&mut self, path: &[HalfEdgeId]) -> Result<Shortened, Interrupted> {
        let (Some(first), Some(last)) = (path.first().copied(), path.last().copied()) else {
            return Ok(Shortened::Straight);
        };
        let Some(beyond) = self.dual.twin(first) else { return Ok(Shortened::Straight) };
        let (left, right) = (self.network.label(first), self.network.label(beyond));
        let (from, to) = (self.dual.from(first), self.dual.to(last));
        let labels = [left, right];
        let before = length(self.dual, path);
        self.network.remove_seam(path);
        let bounds = Bounds {
            goal: Goal::Vertex(to),
            labels: &labels,
            length: self.share * before,
            band: &self.band.vertices,
            barred: self.barred,
        };
        self.trees[0].grow(self.network, from, &bounds)?;
        let Some(half_edges) = self.trees[0].path(self.dual, to) else {
            self.network.restore_seam(path);
            return Ok(Shortened::Straight);
        };
        let laid = self.network.reroute(path, &[Path { half_edges: half_edges.clone(), left, right }], &labels);
        Ok(if laid { Shortened::To(half_edges) } else { Shortened::Illegal })
    }

    /// A closed seam: its parts, then those that begin in the middle of these. Whether it became shorter.
    fn shorten_loop(&mut self, mut path: Vec<HalfEdgeId>, parts: usize, turns: usize) -> Result<bool, Interrupted> {
        let mut shorter = false;
        for turn in 0..turns {
            let part = path.len() / parts;
            if part < 2 {
                break;
            }
            if let Shortened::To(piece) = self.shorten(&path[..part])? {
                path.splice(..part, piece);
                shorter = true;
            }
            let step = if turn % parts == parts - 1 { part / 2 } else { part };
            path.rotate_left(step);
        }
        Ok(shorter)
    }

    /// One pass over all corners.
    fn corners(&mut self) -> Result<(), Interrupted> {
        for vertex in 0..self.dual.mesh.points().len() {
            let seams = match (self.network.is_open(vertex), self.network.degree(vertex)) {
                (false, 3) | (true, 1) => self.network.seams_at(vertex),
                _ => continue,
            };
            let arms: Vec<_> = seams.iter().map(|h| self.network.follow(*h, self.reach)).collect();
            if !arms.iter().any(|arm| self.band.lets_move(self.dual, arm)) {
                continue;
            }
            let tried = Tried::Corner(vertex, arms.concat());
            if self.vain.contains(&tried) {
                continue;
            }
            let moved = match &arms[..] {
                [arm] => self.slide(vertex, arm)?,
                [_, _, _] => self.move_corner(vertex, &arms)?,
                _ => false,
            };
            if !moved {
                self.vain.insert(tried);
            }
        }
        Ok(())
    }

    /// Moves a corner of three seams to where they are shortest; whether there was such a place.
    fn move_corner(&mut self, corner: usize, arms: &[Vec<HalfEdgeId>]) -> Result<bool, Interrupted> {
        let ends: Vec<usize> = arms.iter().map(|arm| self.dual.to(arm[arm.len() - 1])).collect();
        // Each of three charts lies on the left of one arm.
        let labels: Vec<u32> = arms.iter().map(|arm| self.network.label(arm[0])).collect();
        let are_distinct = labels[0] != labels[1] && labels[1] != labels[2] && labels[2] != labels[0];
        // An arm that ends in the corner itself is a loop: it has no end to hold it.
        if !are_distinct || ends.contains(&corner) {
            return Ok(false);
        }
        let before: f64 = arms.iter().map(|arm| length(self.dual, arm)).sum();
        // Per arm the charts on its left and on its right: the new way will have the same ones.
        let mut sides: Vec<(u32, u32)> = Vec::with_capacity(arms.len());
        for arm in arms {
            let Some(twin) = self.dual.twin(arm[0]) else { continue };
            sides.push((self.network.label(arm[0]), self.network.label(twin)));
        }
        // Out of the way: new ways may run where the old ones did.
        for arm in arms {
            self.network.remove_seam(arm);
        }
        let Some(ways) = self.meeting(&ends, &labels, before)? else {
            for arm in arms {
                self.network.restore_seam(arm);
            }
            return Ok(false);
        };
        let mut paths = Vec::with_capacity(ways.len());
        for (half_edges, (left, right)) in ways.into_iter().zip(sides) {
            paths.push(Path { half_edges, left, right });
        }
        Ok(self.network.reroute(&arms.concat(), &paths, &labels))
    }

    /// The ways from the vertex where the sum of the distances to three `ends` is least, if it is less than `before`.
    fn meeting(
        &mut self,
        ends: &[usize],
        labels: &[u32],
        before: f64,
    ) -> Result<Option<Vec<Vec<HalfEdgeId>>>, Interrupted> {
        let length = self.share * before;
        let [first, second, third] = &mut self.trees;
        let meeting = |a, b| Bounds {
            goal: Goal::Meeting([a, b]),
            labels,
            length,
            band: &self.band.vertices,
            barred: self.barred,
        };
        // Each tree knows the distances that those before it have found, and so looks at less.
        first.grow(self.network, ends[0], &meeting((ends[1], None), (ends[2], None)))?;
        second.grow(self.network, ends[1], &meeting((ends[0], Some(first)), (ends[2], None)))?;
        third.grow(self.network, ends[2], &meeting((ends[0], Some(first)), (ends[1], Some(second))))?;
        let [first, second, third] = &self.trees;
        let sum = |v: usize| Some(first.distance(v)? + second.distance(v)? + third.distance(v)?);
        // A corner at an end would leave one of the seams without an edge.
        let inner = third.settled.iter().copied().filter(|v| !ends.contains(v));
        let known = inner.filter_map(|v| Some((sum(v)?, v)));
        let nearest = known.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let Some((least, vertex)) = nearest else { return Ok(None) };
        let paths = self.trees.iter().filter_map(|tree| tree.path(self.dual, vertex));
        let ways: Vec<Vec<HalfEdgeId>> = paths.map(|path| reversed(self.dual, &path)).collect();
        // The ways may share nothing but their begin.
        let mut on_way: Vec<usize> = ways.iter().flatten().map(|h| self.dual.to(*h)).collect();
        let all = on_way.len();
        on_way.sort_unstable();
        on_way.dedup();
        Ok((least < self.share * before && on_way.len() == all).then_some(ways))
    }

    /// Moves the end of a seam along the open boundary to where the seam is shortest; whether there was such a place.
    fn slide(&mut self, end: usize, arm: &[HalfEdgeId]) -> Result<bool, Interrupted> {
        let start = arm[0];
        let root = self.dual.to(arm[arm.len() - 1]);
        let Some(beyond) = self.dual.twin(start) else { return Ok(false) };
        let (left, right) = (self.network.label(start), self.network.label(beyond));
        let labels = [left, right];
        let before = length(self.dual, arm);
        self.network.remove_seam(arm);
        let bounds = Bounds {
            goal: Goal::OpenLoop(end),
            labels: &labels,
            length: self.share * before,
            band: &self.band.vertices,
            barred: self.barred,
        };
        let tree = &mut self.trees[0];
        tree.grow(self.network, root, &bounds)?;
        let open = tree.settled.last().copied().filter(|v| *v != root && self.network.on_one_loop(*v, end));
        let Some(path) = open.and_then(|vertex| tree.path(self.dual, vertex)) else {
            self.network.restore_seam(arm);
            return Ok(false);
        };
        let half_edges = reversed(self.dual, &path);
        Ok(self.network.reroute(arm, &[Path { half_edges, left, right }], &labels))
    }
}

/// Where seams may lie.
struct Band {
    /// Per vertex, whether it lies on a seam, or near enough to the first seams.
    vertices: Vec<bool>,
    /// Per vertex, whether it lies on one of the first seams that may move, or near enough to it.
    is_free: Vec<bool>,
}

impl Band {
    fn everywhere(dual: &Dual) -> Self {
        let vertices = vec![true; dual.mesh.points().len()];
        Self { is_free: vertices.clone(), vertices }
    }

    /// The vertices on seams, and those no farther from one than `breadth` at one of its half-edges, if it is told.
    fn around(network: &Network, breadth: impl Fn(HalfEdgeId) -> Option<f64>) -> Result<Self, Interrupted> {
        let dual = network.dual;
        let vertices = dual.mesh.points().len();
        // Every vertex of a seam begins as far ahead of 0 as the band is broad there: what is reached before 0 lies in it.
        let mut paths = ShortestPaths::new(vertices, ());
        let mut is_free = vec![false; vertices];
        for h in network.seams() {
            let Some(breadth) = breadth(h) else { continue };
            is_free[dual.from(h)] = true;
            if breadth > 0.0 {
                paths.reach(dual.from(h), -breadth, ());
            }
        }
        while let Some(node) = paths.settle() {
            dual.checkpoint.after(1)?;
            network.each_out(node.index, |h| {
                let distance = node.distance + dual.length(h);
                if distance < 0.0 {
                    paths.reach(dual.to(h), distance, ());
                }
            });
        }
        (0..vertices).for_each(|v| is_free[v] |= paths.distance(v).is_some());
        let vertices = (0..vertices).map(|v| is_free[v] || network.degree(v) > 0).collect();
        Ok(Self { vertices, is_free })
    }

    /// Whether a seam may move anywhere. Where seams are straightened part by part most may not, and need not be tried.
    fn lets_move(&self, dual: &Dual, path: &[HalfEdgeId]) -> bool {
        path.iter().any(|h| self.is_free[dual.from(*h)] || self.is_free[dual.to(*h)])
    }
}
