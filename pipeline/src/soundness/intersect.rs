//! Triangles that cut through each other.
//!
//! Two triangles that share no node cross where a side of one passes through the inside of the other; two that share one
//! node, where the side opposite it does. What only touches does not count, nor what is so close to it that rounding could
//! decide: every sign is that of a volume beyond its rounding error (Shewchuk 1997, doi 10.1007/PL00009321, the
//! filter of `orient3d`). Triangles that share a side, and those that lie in one plane, are not looked at here: in a chart
//! the plane of its map shows them.

use super::reference::Triangulation;
use crate::evaluate::{Bvh, box_around, larger, on_triangle};
use crate::seams::segment_distance;
use crate::vec3::{BoundingBox, Vec3, cross, dot, sub};

/// The error of the volume of a tetrahedron, relative to the sum of the absolute values of its terms: (7 + 56 e) e with
/// e = 2^-53, rounded up (Shewchuk, as above).
const ROUNDING: f64 = 8e-16;

/// So many pairs of triangles of the surface are looked at in all. Where a mesh crosses itself more often than that lets be
/// explained, it is the mesh that is suspect. It suffices for the 8,103 crossings of pins_instanced, where pins fill their
/// holes; cad_imu, with 139,000, is beyond it.
const LOOKS: usize = 20_000_000;

/// Crossings of a mesh that its surface does not have.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crossings {
    /// Pairs of triangles, the first of them by their numbers, and how many there are.
    pub pairs: Vec<[u32; 2]>,
    /// Pairs that the surface has, too.
    pub in_surface: usize,
}

/// Finds the pairs of triangles of `mesh` that cross where no triangles of `surface` cross or come closer than `contact`:
/// where parts of an assembly touch, flat elements of both sides cross however small they are.
/// `tree` has the triangles of the mesh.
pub fn crossings(mesh: &Triangulation, tree: &Bvh, surface: &Triangulation, contact: f64) -> Crossings {
    let mut pairs = Vec::new();
    tree.pairs(|a, b| {
        if cross_each_other(mesh, a, b) {
            pairs.push([a, b]);
        }
    });
    pairs.sort_unstable();
    let mut found = Crossings::default();
    if pairs.is_empty() {
        return found;
    }
    let mut near = NearSurface::new(surface, contact);
    for pair in pairs {
        if near.crosses(pair.map(|t| mesh.corners(t as usize))) {
            found.in_surface += 1;
        } else {
            found.pairs.push(pair);
        }
    }
    found
}

/// The surface, to be searched for triangles that cross or touch.
struct NearSurface<'a> {
    surface: &'a Triangulation,
    tree: Bvh,
    boxes: Vec<BoundingBox>,
    /// So close to each other triangles touch.
    contact: f64,
    /// Looks that are left.
    looks: usize,
}

impl<'a> NearSurface<'a> {
    fn new(surface: &'a Triangulation, contact: f64) -> Self {
        let boxes: Vec<BoundingBox> = (0..surface.triangles.len()).map(|t| box_around(surface.corners(t))).collect();
        Self { surface, tree: Bvh::new(boxes.iter().copied()), boxes, contact, looks: LOOKS }
    }

    /// Whether triangles of the surface cross or touch within the boxes of two crossing triangles of the mesh, as far as
    /// the looks that are left can tell.
    fn crosses(&mut self, pair: [[Vec3; 3]; 2]) -> bool {
        let near = pair.map(|corners| {
            let mut near = Vec::new();
            self.tree.overlapping(&box_around(corners), |s| near.push(s));
            near
        });
        for s in &near[0] {
            for t in &near[1] {
                let Some(left) = self.looks.checked_sub(1) else { return false };
                self.looks = left;
                if s != t && self.cross_or_touch(*s, *t) {
                    return true;
                }
            }
        }
        false
    }

    fn cross_or_touch(&self, s: u32, t: u32) -> bool {
        // What is farther apart than rounding can make of the contact does neither.
        let apart = gap_between(&self.boxes[s as usize], &self.boxes[t as usize]);
        apart <= 2.0 * self.contact && (cross_each_other(self.surface, s, t) || touch(self.surface, s, t, self.contact))
    }
}

/// How far two boxes are apart along the axis where they are farthest apart; 0 at most where they meet.
fn gap_between(a: &BoundingBox, b: &BoundingBox) -> f64 {
    let along = |k: usize| larger(a.min[k] - b.max[k], b.min[k] - a.max[k]);
    larger(larger(along(0), along(1)), along(2))
}

/// Whether two triangles that share no vertex have corners or sides that are closer than `contact` to each other.
fn touch(surface: &Triangulation, a: u32, b: u32, contact: f64) -> bool {
    let [s, t] = [a, b].map(|i| surface.triangles[i as usize]);
    if s.iter().any(|v| t.contains(v)) {
        return false;
    }
    let [p, q] = [a, b].map(|i| surface.corners(i as usize));
    let limit = contact * contact;
    let corner = |p: [Vec3; 3], q: [Vec3; 3]| p.iter().any(|x| on_triangle(*x, q).squared <= limit);
    let sides = || (0..9).any(|k| segment_distance(side(p, k / 3), side(q, k % 3)) <= limit);
    corner(p, q) || corner(q, p) || sides()
}

/// Whether two triangles cross.
fn cross_each_other(mesh: &Triangulation, a: u32, b: u32) -> bool {
    let (s, t) = (&mesh.triangles[a as usize], &mesh.triangles[b as usize]);
    if s.iter().filter(|v| t.contains(v)).count() > 1 {
        return false;
    }
    let (p, q) = (mesh.corners(a as usize), mesh.corners(b as usize));
    // Where all corners of one triangle lie on one side of the other, but for a shared one, no side of either passes
    // through the other.
    let Some(of_p) = sides_taken(p, q, |k| t.contains(&s[k])) else { return false };
    let Some(of_q) = sides_taken(q, p, |k| s.contains(&t[k])) else { return false };
    for k in 0..3 {
        if is_parted(of_p, k) && passes_by_inside(side(p, k), q) {
            return true;
        }
        if is_parted(of_q, k) && passes_by_inside(side(q, k), p) {
            return true;
        }
    }
    false
}

/// Side `k` of a triangle.
#[inline]
fn side(p: [Vec3; 3], k: usize) -> [Vec3; 2] {
    [p[k], p[(k + 1) % 3]]
}

/// Whether the ends of side `k` lie on either side of the plane of the other triangle.
#[inline]
fn is_parted(taken: [i8; 3], k: usize) -> bool {
    taken[k] * taken[(k + 1) % 3] < 0
}

/// On which side of the plane of `t` the corners of `p` lie, 0 for those that it shares or that rounding could have put
/// there. None where the corners that it does not share lie on one side, beyond doubt.
#[inline]
fn sides_taken(p: [Vec3; 3], t: [Vec3; 3], is_shared: impl Fn(usize) -> bool) -> Option<[i8; 3]> {
    let mut taken = [0; 3];
    let mut all = [true; 2];
    for k in (0..3).filter(|k| !is_shared(*k)) {
        taken[k] = volume(t[0], t[1], t[2], p[k]);
        all = [all[0] && taken[k] > 0, all[1] && taken[k] < 0];
    }
    if all[0] || all[1] { None } else { Some(taken) }
}

/// Whether the line of a segment passes a triangle on the inside of all its sides, beyond doubt.
fn passes_by_inside([a, b]: [Vec3; 2], t: [Vec3; 3]) -> bool {
    let sides = [0, 1, 2].map(|k| volume(a, b, t[k], t[(k + 1) % 3]));
    sides == [1, 1, 1] || sides == [-1, -1, -1]
}

/// The sign of the volume of a tetrahedron; 0 where rounding could have made it.
#[inline]
fn volume(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> i8 {
    let (u, v, w) = (sub(a, d), sub(b, d), sub(c, d));
    let found = dot(u, cross(v, w));
    let minor = |i: usize, j: usize| (v[i] * w[j]).abs() + (v[j] * w[i]).abs();
    let terms = u[0].abs() * minor(1, 2) + u[1].abs() * minor(2, 0) + u[2].abs() * minor(0, 1);
    if found.abs() <= ROUNDING * terms { 0 } else { found.signum() as i8 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh(triangles: &[[Vec3; 3]]) -> Triangulation {
        let points: Vec<Vec3> = triangles.iter().flatten().copied().collect();
        Triangulation::welded(&points, (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]))
    }

    fn found(mesh: &Triangulation, surface: &Triangulation, contact: f64) -> Crossings {
        crossings(mesh, &mesh.bvh(), surface, contact)
    }

    const FLAT: [Vec3; 3] = [[0.0; 3], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]];

    #[test]
    fn what_passes_through_crosses_and_what_touches_does_not() {
        let none = mesh(&[]);
        let count = |other: [Vec3; 3]| found(&mesh(&[FLAT, other]), &none, 0.0).pairs.len();
        assert_eq!(count([[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [5.0, 5.0, 0.0]]), 1);
        assert_eq!(count([[0.0; 3], [0.9, 0.6, -1.0], [0.6, 0.9, 1.0]]), 1, "through a shared node");
        assert_eq!(count([[0.0; 3], [-0.5, -0.5, -1.0], [-0.6, -0.9, 1.0]]), 0);
        assert_eq!(count([[0.5, 0.5, 0.0], [0.5, 0.5, 1.0], [5.0, 5.0, 1.0]]), 0, "a corner on it");
        assert_eq!(count([[0.5, 0.5, 1e-9], [0.5, 0.5, 1.0], [5.0, 5.0, 1.0]]), 0);
        assert_eq!(count([FLAT[0], FLAT[1], [1.0, 1.0, 0.1]]), 0, "a shared side");
    }

    #[test]
    fn what_the_surface_has_is_not_held_against_the_mesh() {
        let through = [[0.5, 0.5, -1.0], [0.5, 0.5, 1.0], [5.0, 5.0, 0.0]];
        let both = mesh(&[FLAT, through]);
        let itself = found(&both, &both, 0.0);
        assert_eq!((itself.pairs.len(), itself.in_surface), (0, 1));
        // Parts that touch: a corner on a triangle.
        let touching = mesh(&[FLAT, [[0.5, 0.5, 0.0], [0.5, 0.6, 1.0], [5.0, 5.0, 0.5]]]);
        assert_eq!(found(&both, &touching, 1e-9).pairs.len(), 0);
        let apart = mesh(&[FLAT, [[0.5, 0.5, 0.1], [0.5, 0.6, 1.0], [5.0, 5.0, 0.5]]]);
        assert_eq!(found(&both, &apart, 1e-9).pairs.len(), 1);
    }
}
