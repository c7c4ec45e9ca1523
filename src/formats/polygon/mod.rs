//! Cutting polygons into triangles so that concave ones do not fold, at a cost that is bounded.
//!
//! Where all corners can be seen from the last one, as in convex polygons, a fan is enough. Other polygons lose their
//! ears: corners in which they turn left and whose triangles hold no other corner. Only corners in which they do not
//! turn left can lie in there; these stand in a [`Tree`], so that few of them are looked at. Neighbours of an ear wait for
//! the next round, which keeps the triangles small.
//!
//! A polygon of n corners costs [`LOOKS`] n looks at most: some seconds for a million corners. When the looks
//! are used up, what is left is cut up unseen, and may fold; so may polygons that cross themselves. Of both it is told
//! that they are doubtful.

mod tree;

use planish_core::vec3::{Vec3, cross, dot, sub};
use tree::Tree;

/// Looks per corner of a polygon, at most. It bounds the time that a file made for that can take; with fewer, more
/// intricate polygons would be cut up unseen.
const LOOKS: usize = 150;

/// Cuts the polygon with these corner indices, all of which must be in range, into triangles. Where there is no ear, a
/// corner is cut off all the same, so that n corners always give n - 2 triangles. Whether they are doubtful.
pub(super) fn add(corners: &[u32], points: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> bool {
    match corners {
        [] | [_] | [_, _] => false,
        [a, b, c] => {
            triangles.push([*a, *b, *c]);
            false
        }
        // Most polygons are of this sort: it is worth a path of its own.
        [a, b, c, d] if is_convex([a, b, c, d].map(|i| points[*i as usize])) => {
            triangles.extend([[*d, *a, *b], [*d, *b, *c]]);
            false
        }
        [others @ .., last] => {
            let normal = normal(corners, points);
            if is_seen_from_last(corners, points, normal) {
                triangles.extend(others.windows(2).map(|edge| [*last, edge[0], edge[1]]));
                false
            } else {
                let ears = Ears::new(corners, points, normal).cut();
                triangles.extend(&ears.triangles);
                ears.is_doubtful
            }
        }
    }
}

/// Whether a quadrilateral is seen from its last corner: [`is_seen_from_last`], with the same sums in the same order.
#[inline]
fn is_convex([a, b, c, d]: [Vec3; 4]) -> bool {
    let [ab, ac, ad] = [b, c, d].map(|p| sub(p, a));
    let areas = [cross(ab, ac), cross(ac, ad)];
    let normal = [0, 1, 2].map(|k| areas[0][k] + areas[1][k]);
    let [da, db, dc] = [a, b, c].map(|p| sub(p, d));
    let turn = |p: Vec3, q: Vec3| dot(cross(p, q), normal);
    turn(da, db) > 0.0 && turn(db, dc) > 0.0 && turn(da, dc) > 0.0
}

/// Twice the vector area (Newell).
fn normal(corners: &[u32], points: &[Vec3]) -> Vec3 {
    // From the first corner, not from the origin, which may be far away: then the sum would be rounding alone.
    let origin = points[corners[0] as usize];
    let mut sum = [0.0; 3];
    for edge in corners[1..].windows(2) {
        let [p, q] = [edge[0], edge[1]].map(|corner| sub(points[corner as usize], origin));
        let area = cross(p, q);
        sum = [sum[0] + area[0], sum[1] + area[1], sum[2] + area[2]];
    }
    sum
}

/// Whether the fan does not fold: each of its triangles turns left, and none lies beyond the line of the first edge,
/// so that they cannot wind around the last corner.
fn is_seen_from_last(corners: &[u32], points: &[Vec3], normal: Vec3) -> bool {
    let at = |i: usize| points[corners[i] as usize];
    let last = at(corners.len() - 1);
    // Positive where the triangle from the last corner over p to q turns left, as the whole polygon does.
    let turn = |p: Vec3, q: Vec3| dot(cross(sub(p, last), sub(q, last)), normal);
    (1..corners.len() - 1).all(|i| turn(at(i - 1), at(i)) > 0.0 && turn(at(0), at(i)) > 0.0)
}

/// A corner in the plane.
type Flat = [f64; 2];

/// Twice the signed area of a triangle: positive where it turns left.
fn turn(p: Flat, q: Flat, r: Flat) -> f64 {
    (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
}

/// A polygon that loses its ears.
struct Ears<'a> {
    /// The corners of the whole polygon, and where they are in the plane. All else is by position in here.
    corners: &'a [u32],
    flat: Vec<Flat>,
    /// The ring of the corners that are left, one of them, and how many they are.
    next: Vec<u32>,
    previous: Vec<u32>,
    one: u32,
    left: usize,
    /// Corners in which the polygon does not turn left.
    reflex: Tree,
    /// Looks that are left.
    looks: usize,
    triangles: Vec<[u32; 3]>,
    /// Whether a corner was cut off that may be no ear.
    is_doubtful: bool,
}

impl<'a> Ears<'a> {
    fn new(corners: &'a [u32], points: &[Vec3], normal: Vec3) -> Self {
        let n = corners.len() as u32;
        let mut ears = Self {
            corners,
            flat: flat(corners, points, normal),
            next: (1..n).chain([0]).collect(),
            previous: [n - 1].into_iter().chain(0..n - 1).collect(),
            one: 0,
            left: corners.len(),
            reflex: Tree::default(),
            looks: LOOKS.saturating_mul(corners.len()),
            triangles: Vec::with_capacity(corners.len() - 2),
            is_doubtful: false,
        };
        ears.reflex = Tree::new((0..n).filter(|i| ears.turn(*i) <= 0.0).map(|i| (ears.flat[i as usize], i)).collect());
        ears
    }

    /// Cuts all. All corners are tried in a first round, and in each later one those whose neighbours changed.
    fn cut(mut self) -> Self {
        let mut tried = self.ring();
        let mut tried_all = true;
        let mut halved = self.left / 2;
        while self.left > 3 {
            let changed = self.round(&tried, |ears, i| ears.is_ear(i));
            (tried, tried_all) = match (changed.is_empty(), tried_all) {
                (false, _) => (changed, false),
                (true, false) => (self.ring(), true),
                (true, true) => (self.without_ears(), false),
            };
            if self.left < halved {
                halved = self.left / 2;
                self.forget_reflex();
            }
        }
        if self.left == 3 {
            self.is_doubtful |= self.turn(self.one) < 0.0;
            self.take(self.one);
        }
        self
    }

    /// Where there is no ear, rounding is at fault, or the polygon meets itself: what is flat goes, which folds nothing,
    /// or else one corner. Gives those that lost a neighbour.
    fn without_ears(&mut self) -> Vec<u32> {
        let changed = self.round(&self.ring(), |ears, i| ears.turn(i) == 0.0);
        if !changed.is_empty() {
            return changed;
        }
        self.is_doubtful = true;
        self.take(self.one).to_vec()
    }

    /// Cuts off some corners that `go` of those that are tried, no two of them neighbours. Gives those that lost one.
    fn round(&mut self, tried: &[u32], go: impl Fn(&mut Self, u32) -> bool) -> Vec<u32> {
        let mut changed: Vec<u32> = Vec::new();
        for i in tried.iter().copied() {
            // Its neighbour has just been cut off: it waits for the next round.
            let waits = changed.last() == Some(&i);
            if self.left > 3 && !waits && self.is_left(i) && go(self, i) {
                let [before, after] = self.take(i);
                if changed.last() != Some(&before) {
                    changed.push(before);
                }
                changed.push(after);
            }
        }
        changed
    }

    /// The corners that are left.
    fn ring(&self) -> Vec<u32> {
        let mut ring = Vec::with_capacity(self.left);
        let mut corner = self.one;
        for _ in 0..self.left {
            ring.push(corner);
            corner = self.next[corner as usize];
        }
        ring
    }

    fn around(&self, i: u32) -> [u32; 3] {
        [self.previous[i as usize], i, self.next[i as usize]]
    }

    /// Cuts off a corner; gives its neighbours.
    fn take(&mut self, i: u32) -> [u32; 2] {
        let [before, _, after] = self.around(i);
        self.triangles.push([before, i, after].map(|k| self.corners[k as usize]));
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
        self.one = after;
        self.left -= 1;
        [before, after]
    }

    /// Whether a corner was not cut off: then the one before it still leads to it.
    fn is_left(&self, i: u32) -> bool {
        self.next[self.previous[i as usize] as usize] == i
    }

    fn turn(&self, i: u32) -> f64 {
        let [p, q, r] = self.around(i).map(|k| self.flat[k as usize]);
        turn(p, q, r)
    }

    /// Leaves out corners that were cut off or have come to turn left.
    fn forget_reflex(&mut self) {
        let mut reflex = std::mem::take(&mut self.reflex).into_points();
        reflex.retain(|(_, i)| self.is_left(*i) && self.turn(*i) <= 0.0);
        self.reflex = Tree::new(reflex);
    }

    /// Whether a corner is an ear, or nobody can tell any more.
    fn is_ear(&mut self, i: u32) -> bool {
        self.looks = self.looks.saturating_sub(1);
        if self.looks == 0 {
            self.is_doubtful = true;
            return true;
        }
        let [a, b, c] = self.around(i).map(|k| self.flat[k as usize]);
        if turn(a, b, c) > 0.0 {
            let (held, looks) = self.holds_none([a, b, c]);
            self.is_doubtful |= looks > self.looks;
            self.looks = self.looks.saturating_sub(looks);
            return held;
        }
        false
    }

    /// Whether no corner lies in a triangle, beside its own, and how many looks that took.
    fn holds_none(&self, triangle: [Flat; 3]) -> (bool, usize) {
        let (found, looks) =
            self.reflex.find_in(triangle, self.looks, |p, i| !triangle.contains(&p) && self.is_left(i));
        (!found, looks)
    }
}

/// The corners as seen along the axis that is closest to the normal, turning left on the whole.
fn flat(corners: &[u32], points: &[Vec3], normal: Vec3) -> Vec<Flat> {
    let size = normal.map(f64::abs);
    let mut axis = 0;
    for k in 1..3 {
        if size[k] > size[axis] {
            axis = k;
        }
    }
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        // Seen from the other side.
        (u, v) = (v, u);
    }
    let mut flat = Vec::with_capacity(corners.len());
    for corner in corners {
        let point = points[*corner as usize];
        flat.push([point[u], point[v]]);
    }
    flat
}

#[cfg(test)]
mod tests;
