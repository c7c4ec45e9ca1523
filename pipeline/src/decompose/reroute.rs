//! Moving seams: some of their edges are replaced by other paths, and the triangles between the old and the new ones
//! change their labels. The operation is undone where a chart would not be legal any more.

use super::boundaries::Change;
use super::network::Network;
use super::regions::Shape;
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
            && labels.iter().all(|l| self.areas[*l as usize] >= self.min_areas[*l as usize]);
        let changes = if fits { self.legal_changes(labels, &[removed, &added].concat(), &changed) } else { None };
        let Some((boundaries, meetings)) = changes else {
            for (face, label) in changed.iter().rev() {
                self.relabel(*face, *label);
            }
            self.remove_seam(&added);
            self.restore_seam(removed);
            return false;
        };
        for change in boundaries {
            self.boundaries.make(self.dual, change);
        }
        for (label, count) in labels.iter().zip(meetings) {
            self.meetings[*label as usize] = count;
        }
        true
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

    /// What becomes of the boundaries of charts, and in how many half-edges each meets itself, where all are legal. `touched` are
    /// the half-edges along which seams were laid or taken away, `changed` the triangles with the labels that they had.
    ///
    /// (A label that falls apart and gets a handle at once would pass: see [`Self::is_sound`].)
    fn legal_changes(
        &mut self,
        labels: &[u32],
        touched: &[HalfEdgeId],
        changed: &[(FaceId, u32)],
    ) -> Option<(Vec<Change>, Vec<usize>)> {
        let of_changed = changed.iter().flat_map(|(face, _)| face.sides());
        let near = touched.iter().copied().chain(of_changed).flat_map(|h| [Some(h), self.dual.twin(h)]);
        let mut near: Vec<HalfEdgeId> = near.flatten().collect();
        near.sort_unstable();
        near.dedup();
        let meetings = self.meetings_after(labels, changed);
        let mut changes = Vec::with_capacity(labels.len());
        for (label, meetings) in labels.iter().zip(&meetings) {
            let partition = Partition::new(self.dual, &self.labels);
            let change = self.boundaries.change(self.dual, &partition, *label, &near)?;
            if !self.limits.allow(&self.shape(*label, &change, *meetings)) {
                return None;
            }
            changes.push(change);
        }
        Some((changes, meetings))
    }

    /// In how many half-edges each chart lies beside itself in space, once triangles have other labels than they had.
    fn meetings_after(&self, labels: &[u32], changed: &[(FaceId, u32)]) -> Vec<usize> {
        let mut meetings: Vec<usize> = labels.iter().map(|l| self.meetings[*l as usize]).collect();
        let mut near: Vec<HalfEdgeId> = Vec::new();
        for h in changed.iter().flat_map(|(face, _)| face.sides()) {
            let beyond = self.dual.coincident_faces(h);
            near.extend((!beyond.is_empty()).then_some(h));
            let sides = beyond.iter().flat_map(|f| f.sides());
            near.extend(sides.filter(|g| self.dual.coincident_faces(*g).contains(&h.face())));
        }
        if near.is_empty() {
            return meetings;
        }
        near.sort_unstable();
        near.dedup();
        let mut had: Vec<(FaceId, u32)> = changed.to_vec();
        had.sort_unstable();
        let now = |f: FaceId| self.labels[f.index()];
        let before = |f: FaceId| had.binary_search_by_key(&f, |(face, _)| *face).map_or_else(|_| now(f), |k| had[k].1);
        let meets = |h: HalfEdgeId, label: u32, of: &dyn Fn(FaceId) -> u32| {
            of(h.face()) == label && self.dual.coincident_faces(h).iter().any(|f| of(*f) == label)
        };
        for (label, count) in labels.iter().zip(&mut meetings) {
            for h in &near {
                *count += usize::from(meets(*h, *label, &now));
                *count -= usize::from(meets(*h, *label, &before));
            }
        }
        meetings
    }

    /// The shape of a chart with its boundary as it is after a change. With I inner vertices, B boundary half-edges and F triangles the
    /// Euler number (of the label opened where it only touches itself) is I + (B - F)/2.
    fn shape(&self, label: u32, boundary: &Change, meetings: usize) -> Shape {
        let Change { loops, seam_loops, pinches, .. } = *boundary;
        let (faces, inside) = (self.sizes[label as usize], self.inside[label as usize]);
        let euler = inside as i64 + (boundary.length as i64 - faces as i64) / 2;
        Shape { faces, euler, loops, seam_loops, pinches, meets_itself: meetings > 0 }
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
    use crate::decompose::tests::figure_eight;
    use crate::monitor::NoMonitor;
    use crate::repair::{Settings, repair};
    use crate::shapes::{self, Random};

    /// Compares a network with one that is made anew of its labels.
    fn compare(network: &Network) {
        let anew = Network::new(network.dual, network.labels.clone(), network.limits);
        assert_eq!((&network.sizes, &network.inside), (&anew.sizes, &anew.inside));
        assert_eq!(network.meetings, anew.meetings);
        for label in 0..network.label_count() as u32 {
            assert_eq!(network.boundaries.told(label), anew.boundaries.told(label));
        }
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
        let surfaces = [
            (shapes::sphere(16), 6),
            (shapes::disk_with_holes(25, 3), 5),
            (shapes::ring_torus(24, 16), 9),
            (figure_eight(24, 12), 9),
        ];
        for (soup, charts) in surfaces {
            let mesh = repair(&soup, &Settings::default()).expect("a surface is left").mesh;
            let dual = Dual::new(&mesh, &NoMonitor);
            let cells = compact_cells(&dual, |_| charts, &dual.checkpoint).expect("nobody cancels");
            let largest = 11 * mesh.triangles().len() / cells.len / 10;
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
