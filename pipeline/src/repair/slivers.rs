//! Slivers: triangles that are narrower than the tolerance by which the surface is known.
//!
//! *Needles* have an edge below the tolerance: it is collapsed, one end moves to the other. *Caps* have none, and a corner that
//! lies on the edge across, within the tolerance: that edge is flipped, so that it runs through the corner. Both only where the
//! surface stays what it is: the link condition holds (Dey, Edelsbrunner, Guha and Nekhayev 1999, *Topology preserving edge
//! contraction*), no triangle turns over, no open edge, no edge of three or more triangles and no border between labels moves, and nothing moves farther
//! than the tolerance, all steps together. What is left is mollified, as before.
//!
//! *It ends.* A collapse leaves fewer triangles; a flip leaves as many, and replaces an edge by a shorter one.

use super::{Measure, MeshBuilder};
use crate::mesh::TriangleShape;
use crate::topology::{EdgeTable, VertexId};
use crate::vec3::{Vec3, cross, distance, dot, norm, sub};
use std::collections::VecDeque;

/// What was removed.
#[derive(Debug, Default)]
pub(super) struct Removed {
    /// Triangles with an edge that was collapsed, by their position in the input.
    pub needles: Vec<u32>,
    /// Triangles of which the longest edge was flipped.
    pub caps: Vec<u32>,
    /// The farthest that any point of the surface moved, in the unit of the measure.
    pub deviation: f64,
}

impl Removed {
    pub fn is_empty(&self) -> bool {
        self.needles.is_empty() && self.caps.is_empty()
    }
}

/// Removes slivers from `builder`, whose edges are `edges`.
pub(super) fn remove(builder: &mut MeshBuilder, edges: &EdgeTable, measure: &Measure) -> Removed {
    let mut removed = Removed::default();
    let mut slivers = VecDeque::from(Shapes { builder, measure }.slivers());
    if slivers.is_empty() {
        return removed;
    }
    let mut work = Work::new(builder, edges, measure);
    // Behind every step the triangles beside it are looked at once more.
    while let Some(face) = slivers.pop_front() {
        if !work.is_kept[face] || !work.shapes().is_sliver(face) {
            continue;
        }
        let source = work.builder.source[face];
        let changed = match work.step(face) {
            None => continue,
            Some(Step::Collapse { kept, gone, moved }) => {
                removed.needles.push(source);
                removed.deviation = removed.deviation.max(moved);
                work.collapse(kept, gone, moved)
            }
            Some(Step::Flip { longest, beyond, moved }) => {
                removed.caps.push(source);
                removed.deviation = removed.deviation.max(moved);
                work.flip(face, longest, beyond, moved)
            }
        };
        let shapes = work.shapes();
        slivers.extend(changed.into_iter().filter(|f| shapes.is_sliver(*f)));
    }
    let keep = work.is_kept;
    builder.keep_only(&keep);
    removed
}

/// How a sliver can be removed.
#[derive(Clone, Copy)]
enum Step {
    /// A vertex moves to another one, so far.
    Collapse { kept: VertexId, gone: VertexId, moved: f64 },
    /// The longest side of the sliver is flipped, beyond which lies a triangle; so far the surface has moved then.
    Flip { longest: usize, beyond: usize, moved: f64 },
}

/// The triangles as they are, in the unit of the measure.
#[derive(Clone, Copy)]
struct Shapes<'a> {
    builder: &'a MeshBuilder,
    measure: &'a Measure,
}

impl Shapes<'_> {
    fn at(&self, v: VertexId) -> Vec3 {
        self.measure.points[v.index()]
    }

    fn corners(&self, face: usize) -> [Vec3; 3] {
        self.builder.triangles[face].map(|v| self.at(v))
    }

    /// Whether a triangle is lower than the tolerance.
    fn is_low(&self, corners: [Vec3; 3]) -> bool {
        norm(normal(corners)) < self.measure.tolerance * TriangleShape::of(corners).longest()
    }

    fn is_sliver(&self, face: usize) -> bool {
        self.is_low(self.corners(face))
    }

    fn slivers(&self) -> Vec<usize> {
        (0..self.builder.triangles.len()).filter(|f| self.is_sliver(*f)).collect()
    }

    /// Whether a triangle does not turn over: where it is no sliver, it becomes none, and its normal keeps its side.
    fn keeps_side(&self, before: [Vec3; 3], after: [Vec3; 3]) -> bool {
        self.is_low(before) || (!self.is_low(after) && dot(normal(before), normal(after)) > 0.0)
    }
}

struct Work<'a> {
    builder: &'a mut MeshBuilder,
    measure: &'a Measure,
    /// Per vertex, the triangles at it.
    stars: Vec<Vec<usize>>,
    /// Per vertex, whether all edges at it have two sides that run in opposite directions, with triangles of one label.
    is_inside: Vec<bool>,
    /// Per triangle, whether it is there still.
    is_kept: Vec<bool>,
    /// Per vertex and per triangle, how far what is in it now has moved.
    moved_vertex: Vec<f64>,
    moved_face: Vec<f64>,
}

impl<'a> Work<'a> {
    fn new(builder: &'a mut MeshBuilder, edges: &EdgeTable, measure: &'a Measure) -> Self {
        let (vertices, faces) = (measure.points.len(), builder.triangles.len());
        let mut stars = vec![Vec::new(); vertices];
        for (face, triangle) in builder.triangles.iter().enumerate() {
            triangle.iter().for_each(|v| stars[v.index()].push(face));
        }
        let mut is_inside = vec![true; vertices];
        for (_, sides) in edges.iter() {
            let ends = |i: usize| [sides[i], sides[i].next()].map(|h| builder.triangles[h.face().index()][h.side()]);
            let is_manifold = sides.len() == 2 && ends(0)[0] == ends(1)[1] && ends(0)[1] == ends(1)[0];
            let is_border = || builder.label(sides[0].face().index()) != builder.label(sides[1].face().index());
            if !is_manifold || is_border() {
                ends(0).iter().for_each(|v| is_inside[v.index()] = false);
            }
        }
        let (moved_vertex, moved_face) = (vec![0.0; vertices], vec![0.0; faces]);
        Self { builder, measure, stars, is_inside, is_kept: vec![true; faces], moved_vertex, moved_face }
    }

    fn shapes(&self) -> Shapes<'_> {
        Shapes { builder: self.builder, measure: self.measure }
    }

    /// The triangle beyond a side, if there is exactly one, and it runs along it in the opposite direction; and its side.
    fn beyond(&self, face: usize, side: usize) -> Option<(usize, usize)> {
        let [from, to] = [side, (side + 1) % 3].map(|k| self.builder.triangles[face][k]);
        let others = self.stars[from.index()].iter().filter(|f| **f != face);
        let mut others = others.filter(|f| self.builder.triangles[**f].contains(&to));
        let beyond = *others.next()?;
        let triangle = self.builder.triangles[beyond];
        let side = (0..3).find(|k| triangle[*k] == to && triangle[(k + 1) % 3] == from)?;
        others.next().is_none().then_some((beyond, side))
    }

    /// How a sliver can be removed; none where it cannot.
    fn step(&self, face: usize) -> Option<Step> {
        let TriangleShape { lengths } = TriangleShape::of(self.shapes().corners(face));
        let by_length = |a: &usize, b: &usize| lengths[*a].total_cmp(&lengths[*b]);
        let (shortest, longest) = ((0..3).min_by(by_length)?, (0..3).max_by(by_length)?);
        if lengths[shortest] < self.measure.tolerance {
            let [a, b] = [shortest, (shortest + 1) % 3].map(|k| self.builder.triangles[face][k]);
            let (low, high) = (a.min(b), a.max(b));
            let (beyond, _) = self.beyond(face, shortest)?;
            return self.collapse_of(face, beyond, low, high).or_else(|| self.collapse_of(face, beyond, high, low));
        }
        self.flip_of(face, longest)
    }

    fn collapse_of(&self, face: usize, beyond: usize, kept: VertexId, gone: VertexId) -> Option<Step> {
        let shapes = self.shapes();
        let moved = self.moved_vertex[gone.index()] + distance(shapes.at(kept), shapes.at(gone));
        if !self.is_inside[gone.index()] || moved >= self.measure.tolerance {
            return None;
        }
        // The link condition: the ends have no neighbours in common but the two across the edge.
        let neighbours = |v: VertexId| {
            let mut all: Vec<VertexId> =
                self.stars[v.index()].iter().flat_map(|f| self.builder.triangles[*f]).collect();
            all.sort_unstable();
            all.dedup();
            all
        };
        let of_kept = neighbours(kept);
        let is_common = |v: &VertexId| *v != kept && *v != gone && of_kept.binary_search(v).is_ok();
        if neighbours(gone).iter().filter(|v| is_common(v)).count() != 2 {
            return None;
        }
        let mut others = self.stars[gone.index()].iter().filter(|f| **f != face && **f != beyond);
        let keeps_side = |f: &usize| {
            let after = self.builder.triangles[*f].map(|v| shapes.at(if v == gone { kept } else { v }));
            shapes.keeps_side(shapes.corners(*f), after)
        };
        others.all(keeps_side).then_some(Step::Collapse { kept, gone, moved })
    }

    fn flip_of(&self, face: usize, longest: usize) -> Option<Step> {
        let shapes = self.shapes();
        let (beyond, side) = self.beyond(face, longest)?;
        // The parts of the triangle beyond would have its label: that of the sliver would lose its area.
        if self.builder.label(face) != self.builder.label(beyond) {
            return None;
        }
        let [p, q, r] = [0, 1, 2].map(|k| self.builder.triangles[face][(longest + k) % 3]);
        let s = self.builder.triangles[beyond][(side + 2) % 3];
        let length = distance(shapes.at(p), shapes.at(q));
        let height = norm(normal(shapes.corners(face))) / length;
        let moved = self.moved_face[face].max(self.moved_face[beyond]) + height;
        let is_shorter = distance(shapes.at(r), shapes.at(s)) < length;
        let are_neighbours = self.stars[r.index()].iter().any(|f| self.builder.triangles[*f].contains(&s));
        if moved >= self.measure.tolerance || !is_shorter || r == s || are_neighbours {
            return None;
        }
        let before = shapes.corners(beyond);
        let keep_side = [[r, p, s], [s, q, r]].iter().all(|t| shapes.keeps_side(before, t.map(|v| shapes.at(v))));
        keep_side.then_some(Step::Flip { longest, beyond, moved })
    }

    /// Collapses an edge; returns the triangles at what is left of it.
    fn collapse(&mut self, kept: VertexId, gone: VertexId, moved: f64) -> Vec<usize> {
        let kept_moved = &mut self.moved_vertex[kept.index()];
        *kept_moved = kept_moved.max(moved);
        for f in std::mem::take(&mut self.stars[gone.index()]) {
            if self.builder.triangles[f].contains(&kept) {
                self.is_kept[f] = false;
                self.builder.triangles[f].iter().for_each(|v| self.stars[v.index()].retain(|g| *g != f));
            } else {
                self.builder.triangles[f] = self.builder.triangles[f].map(|v| if v == gone { kept } else { v });
                self.stars[kept.index()].push(f);
            }
        }
        self.stars[kept.index()].clone()
    }

    /// Flips the longest side of a sliver; returns both triangles.
    fn flip(&mut self, face: usize, longest: usize, beyond: usize, moved: f64) -> Vec<usize> {
        let [p, q, r] = [0, 1, 2].map(|k| self.builder.triangles[face][(longest + k) % 3]);
        let of_beyond = self.builder.triangles[beyond];
        let s = of_beyond.into_iter().find(|v| *v != p && *v != q).unwrap_or(r);
        (self.builder.triangles[face], self.builder.triangles[beyond]) = ([r, p, s], [s, q, r]);
        // Both are parts of the triangle beyond the edge.
        self.builder.source[face] = self.builder.source[beyond];
        self.stars[q.index()].retain(|f| *f != face);
        self.stars[p.index()].retain(|f| *f != beyond);
        self.stars[s.index()].push(face);
        self.stars[r.index()].push(beyond);
        for f in [face, beyond] {
            self.moved_face[f] = moved;
        }
        // What lies beside them may be flipped now where it could not be before.
        let mut around: Vec<usize> = (0..3).filter_map(|k| Some(self.beyond(face, k)?.0)).collect();
        around.extend((0..3).filter_map(|k| Some(self.beyond(beyond, k)?.0)));
        around.extend([face, beyond]);
        around.sort_unstable();
        around.dedup();
        around
    }
}

/// Twice the area of a triangle, as a vector along its normal.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    cross(sub(b, a), sub(c, a))
}

#[cfg(test)]
mod tests {
    use crate::mesh::TriangleSoup;
    use crate::repair::{Repaired, Settings, repair};
    use crate::shapes;
    use crate::vec3::Vec3;

    fn repaired(points: &[Vec3], triangles: &[[u32; 3]]) -> Repaired {
        let soup = TriangleSoup::new(points.to_vec(), triangles.to_vec()).expect("sound");
        let repaired = repair(&soup, &Settings::default()).expect("a surface");
        repaired.mesh.assert_sound();
        repaired
    }

    /// A square of two triangles, and a vertex at `height` above the middle of the diagonal, which the first one has as a cap.
    fn with_cap(height: f64) -> Repaired {
        let h = height / 2.0_f64.sqrt();
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5 - h, 0.5 + h, 0.0]];
        repaired(&points, &[[0, 1, 2], [0, 2, 4], [0, 4, 3], [4, 2, 3]])
    }

    #[test]
    fn a_cap_below_the_tolerance_is_flipped_and_a_higher_one_stays() {
        let low = with_cap(5e-7);
        assert_eq!((low.report.caps_flipped.first.clone(), low.report.needles_collapsed.count), (vec![1], 0));
        assert!((low.report.slivers_moved_by - 5e-7).abs() < 1e-9);
        assert_eq!(low.mesh.topology_summary().triangles, 4);
        assert!(low.mesh.metric().shapes.iter().all(|shape| shape.area() > 0.1 * low.mesh.metric().scale.powi(2)));
        assert!((low.mesh.area() - 1.0).abs() < 1e-12 && low.report.mollified_by == 0.0);
        let high = with_cap(1e-5);
        assert_eq!((high.report.caps_flipped.count, high.report.slivers_moved_by), (0, 0.0));
    }

    /// A square of which the middle is two vertices, so far apart.
    fn with_needles(apart: f64) -> Repaired {
        let points =
            [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.5 + apart, 0.0]];
        repaired(&points, &[[0, 1, 4], [1, 2, 4], [2, 5, 4], [2, 3, 5], [3, 0, 5], [0, 4, 5]])
    }

    #[test]
    fn needles_below_the_tolerance_are_collapsed_and_wider_ones_stay() {
        let narrow = with_needles(5e-7);
        assert_eq!((narrow.report.needles_collapsed.count, narrow.mesh.topology_summary().triangles), (1, 4));
        assert!(narrow.mesh.topology_summary().is_one_chart() && narrow.report.slivers_moved_by <= 5e-7);
        assert_eq!(with_needles(1e-5).report.needles_collapsed.count, 0);
    }

    #[test]
    fn no_open_edge_moves_and_without_a_tolerance_nothing_does() {
        // The same cap at the rim: its longest edge is open.
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 5e-7, 0.0], [0.5, 1.0, 0.0]];
        let at_rim = repaired(&points, &[[0, 1, 2], [0, 2, 3], [2, 1, 3]]);
        assert_eq!((at_rim.report.caps_flipped.count, at_rim.mesh.topology_summary().triangles), (0, 3));
        let sound = repair(&shapes::sphere(8), &Settings::default()).expect("a surface").report;
        assert_eq!((sound.caps_flipped.count, sound.needles_collapsed.count), (0, 0));
    }
}
