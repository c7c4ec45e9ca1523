//! Moving seams: some of their edges are replaced by other paths, and the triangles between the old and the new ones
//! change their labels. The operation is undone where a chart would not be legal any more.

use super::network::Network;
use super::regions::Shape;
use crate::topology::loops::walk_loops;
use crate::topology::partition::Partition;
use crate::topology::{FaceId, HalfEdgeId};

/// A path along edges: half-edges from end to end, with the label that shall lie on its left and on its right.
#[derive(Clone, Debug)]
pub(super) struct Path {
    pub half_edges: Vec<HalfEdgeId>,
    pub left: u32,
    pub right: u32,
}

impl Network<'_> {
    /// Takes the seam along a path away, so that another one can be laid.
    pub(super) fn remove_seam(&mut self, path: &[HalfEdgeId]) {
        path.iter().for_each(|h| self.set_seam(*h, false));
    }

    /// Puts a removed seam back.
    pub(super) fn restore_seam(&mut self, path: &[HalfEdgeId]) {
        path.iter().for_each(|h| self.set_seam(*h, true));
    }

    /// Lays seams in the place of `removed` ones: the triangles up to the other seams change their labels. Undone, with
    /// the removed seams put back (and `false`), where one of the charts `labels` would be illegal or too large, or
    /// smaller than half of what it was at first.
    pub(super) fn reroute(&mut self, removed: &[HalfEdgeId], paths: &[Path], labels: &[u32]) -> bool {
        self.claimed.clear();
        let added: Vec<HalfEdgeId> = paths.iter().flat_map(|p| p.half_edges.iter().copied()).collect();
        self.restore_seam(&added);
        let mut changed = Vec::new();
        let fits = self.flood(paths, labels, &mut changed)
            && labels.iter().all(|l| self.areas[*l as usize] >= self.min_areas[*l as usize])
            && {
                self.renew_boundaries(labels, &added, &changed);
                labels.iter().all(|l| self.is_legal(*l))
            };
        if !fits {
            for (face, label) in changed.iter().rev() {
                self.relabel(*face, *label);
            }
            self.remove_seam(&added);
            self.restore_seam(removed);
            self.renew_boundaries(labels, removed, &changed);
        }
        fits
    }

    fn relabel(&mut self, face: FaceId, label: u32) -> u32 {
        // An inner vertex counts for the label of one of its triangles: it changes sides with that, and with no other.
        let vertices = self.dual.mesh.triangles()[face.index()].map(|v| v.index());
        let owned: Vec<usize> = vertices.into_iter().filter(|v| self.out[*v].face() == face).collect();
        for v in &owned {
            self.count_inside(*v, -1);
        }
        let old = std::mem::replace(&mut self.labels[face.index()], label);
        for v in &owned {
            self.count_inside(*v, 1);
        }
        self.sizes[old as usize] -= 1;
        self.sizes[label as usize] += 1;
        let area = self.dual.area(face.index());
        self.areas[old as usize] -= area;
        self.areas[label as usize] += area;
        old
    }

    /// Gives the triangles beside `new` the labels that they shall have, and from there all others up to the seams.
    /// Whether no triangle was claimed by two labels. Ends because a triangle is claimed once.
    fn flood(&mut self, new: &[Path], labels: &[u32], changed: &mut Vec<(FaceId, u32)>) -> bool {
        let mut stack: Vec<FaceId> = Vec::new();
        for path in new {
            for h in &path.half_edges {
                let beyond = self.dual.twin(*h).map(|t| (t.face(), path.right));
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
                let Some(t) = self.dual.twin(h) else { continue };
                if self.is_seam(h) == (self.label(t) != label) {
                    continue;
                }
                if self.is_seam(h) {
                    // The chart would reach both sides of another seam.
                    return false;
                }
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
        let is_first = self.claimed.visit(face.index());
        if had != label {
            if !is_first || !labels.contains(&had) {
                return false;
            }
            changed.push((face, self.relabel(face, label)));
            stack.push(face);
        }
        true
    }

    /// Whether the triangles of a label form a chart within the limits, judged by its boundary as in
    /// [`super::regions`]. (A label that falls apart and gets a handle at once would pass: see [`Self::is_sound`].)
    fn is_legal(&mut self, label: u32) -> bool {
        let boundary = std::mem::take(&mut self.boundaries[label as usize]);
        let shape = self.shape(label, &boundary);
        self.boundaries[label as usize] = boundary;
        self.limits.allow(&shape)
    }

    /// Brings the boundaries of charts up to date: what is none any more goes, what was laid comes.
    fn renew_boundaries(&mut self, labels: &[u32], laid: &[HalfEdgeId], changed: &[(FaceId, u32)]) {
        for label in labels {
            let mut boundary = std::mem::take(&mut self.boundaries[*label as usize]);
            boundary.retain(|h| self.bounds(*h, *label));
            let around = |(face, _): &(FaceId, u32)| [0, 1, 2].map(|k| HalfEdgeId::side_of(*face, k));
            let near = laid.iter().copied().chain(changed.iter().flat_map(around));
            let sides = near.flat_map(|h| [Some(h), self.dual.twin(h)]).flatten();
            boundary.extend(sides.filter(|h| self.bounds(*h, *label)));
            boundary.sort_unstable();
            boundary.dedup();
            self.boundaries[*label as usize] = boundary;
        }
    }

    /// Walks along the boundary of a label. With I inner vertices, B boundary half-edges and F triangles the Euler
    /// number (of the label opened where it only touches itself) is I + (B - F)/2.
    fn shape(&mut self, label: u32, boundary: &[HalfEdgeId]) -> Shape {
        self.seen_half_edges.clear();
        self.seen_vertices.clear();
        let (faces, inside) = (self.sizes[label as usize], self.inside[label as usize]);
        let euler = inside as i64 + (boundary.len() as i64 - faces as i64) / 2;
        let mut shape = Shape { faces, euler, loops: 0, seam_loops: 0, pinches: 0, meets_itself: false };
        let (dual, labels) = (self.dual, &self.labels);
        let partition = Partition::new(dual, labels);
        let seen_vertices = &mut self.seen_vertices;
        // Whether a seam was met on the loop at hand.
        let mut has_seam = false;
        let starts = boundary.iter().copied();
        let next = |h| partition.next(h);
        walk_loops(starts, &mut self.seen_half_edges, HalfEdgeId::index, next, |h, begins| {
            has_seam &= !begins;
            let meets_seam = !has_seam && dual.twin(h).is_some();
            has_seam |= meets_seam;
            shape.loops += usize::from(begins);
            shape.seam_loops += usize::from(meets_seam);
            shape.pinches += usize::from(!seen_vertices.visit(dual.from(h)));
            shape.meets_itself |= dual.coincident_faces(h).iter().any(|f| labels[f.index()] == label);
        });
        shape
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decompose;
    use crate::decompose::dual::Dual;
    use crate::decompose::merge::Limits;
    use crate::decompose::patches::compact_cells;
    use crate::decompose::shortest::{Bounds, Goal, Tree};
    use crate::monitor::NoMonitor;
    use crate::repair::{Settings, repair};
    use crate::shapes::{self, Random};

    /// Compares a network with one that is made anew of its labels.
    fn compare(network: &Network) {
        let anew = Network::new(network.dual, network.labels.clone(), network.limits);
        assert_eq!((&network.sizes, &network.inside), (&anew.sizes, &anew.inside));
        assert_eq!(network.boundaries, anew.boundaries);
        assert!(network.areas.iter().zip(&anew.areas).all(|(a, b)| (a - b).abs() < 1e-9));
        assert!(network.dual.half_edges().all(|h| network.is_seam(h) == anew.is_seam(h)));
        assert!((0..network.dual.mesh.points().len()).all(|v| network.degree(v) == anew.degree(v)));
    }

    /// Lays a seam, or a part of one, along a shortest path through vertices that are chosen at random.
    fn reroute_some(network: &mut Network, random: &mut Random) -> Option<bool> {
        let curves = network.curves();
        let curve = &curves[random.below(curves.len())];
        let from = random.below(curve.len());
        let path = &curve[from..from + 1 + random.below(curve.len() - from)];
        let (first, last) = (path[0], path[path.len() - 1]);
        let (left, right) = (network.label(first), network.label(network.dual.twin(first)?));
        let (root, target) = (network.dual.from(first), network.dual.to(last));
        let band: Vec<bool> = (0..network.dual.mesh.points().len()).map(|_| random.below(4) > 0).collect();
        network.remove_seam(path);
        let labels = [left, right];
        let barred = vec![false; network.dual.mesh.edges().len()];
        let bounds =
            Bounds { goal: Goal::Vertex(target), labels: &labels, length: f64::INFINITY, band: &band, barred: &barred };
        let mut tree = Tree::new(network.dual);
        tree.grow(network, root, &bounds).expect("nobody interrupts");
        let Some(half_edges) = tree.path(network.dual, target).filter(|path| !path.is_empty()) else {
            network.restore_seam(path);
            return None;
        };
        Some(network.reroute(path, &[Path { half_edges, left, right }], &labels))
    }

    #[test]
    fn a_network_stays_what_its_labels_make_it() {
        for (soup, charts) in
            [(shapes::sphere(16), 6), (shapes::disk_with_holes(25, 3), 5), (shapes::ring_torus(24, 16), 9)]
        {
            let mesh = repair(&soup, &Settings::default()).expect("a surface is left").mesh;
            let dual = Dual::new(&mesh, &NoMonitor);
            let cells = compact_cells(&dual, |_| charts, &dual.checkpoint).expect("nobody cancels");
            let largest = 11 * mesh.triangles().len() / charts / 10;
            let limits = Limits::new(&decompose::Settings { max_triangles: largest, ..Default::default() });
            let mut network = Network::new(&dual, cells.labels, limits);
            let mut random = Random(7);
            let (mut laid, mut undone) = (0, 0);
            for _ in 0..200 {
                let before = network.labels.clone();
                match reroute_some(&mut network, &mut random) {
                    Some(true) => laid += 1,
                    other => {
                        undone += usize::from(other.is_some());
                        assert_eq!(network.labels, before);
                    }
                }
                compare(&network);
            }
            assert!(laid > 10 && undone > 10, "{laid} laid, {undone} undone");
        }
    }
}
