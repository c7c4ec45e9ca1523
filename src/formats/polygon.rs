//! Cutting polygons into triangles so that concave ones do not fold, at a cost that is bounded.
//!
//! Where all corners can be seen from the last one, as in convex polygons, a fan is enough. Other polygons lose their
//! ears: corners in which they turn left and whose triangles hold no other corner. Only corners in which they do not
//! turn left can lie in there; these are sorted along the longer side of the polygon, so that few of them are looked
//! at. Neighbours of an ear wait for the next round, which keeps the triangles small.
//!
//! A polygon of n corners costs [`LOOKS`] n looks at corners at most: about three seconds for a million corners, where
//! they zigzag as wildly as can be. When the looks are used up, what is left is cut up unseen, and may fold; so may polygons
//! that cross themselves. Of both it is told that they are doubtful.

use pipeline::space::{Vec3, cross, dot, sub};

/// Corners that are looked at per corner of a polygon, at most.
const LOOKS: usize = 1000;

/// Cuts the polygon with these corner indices, all of which must be in range, into triangles. Where there is no ear, a
/// corner is cut off all the same, so that n corners always give n - 2 triangles. Whether they are doubtful.
pub(super) fn add(corners: &[u32], points: &[Vec3], triangles: &mut Vec<[u32; 3]>) -> bool {
    match corners {
        [] | [_] | [_, _] => false,
        [a, b, c] => {
            triangles.push([*a, *b, *c]);
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

/// Twice the vector area (Newell).
fn normal(corners: &[u32], points: &[Vec3]) -> Vec3 {
    let relative = |i: u32| sub(points[i as usize], points[corners[0] as usize]);
    let areas = corners[1..].windows(2).map(|edge| cross(relative(edge[0]), relative(edge[1])));
    areas.fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
}

/// Whether the fan does not fold: each of its triangles turns left, and none lies beyond the line of the first edge,
/// so that they cannot wind around the last corner.
fn is_seen_from_last(corners: &[u32], points: &[Vec3], normal: Vec3) -> bool {
    let place = |i: usize| points[corners[i] as usize];
    let last = place(corners.len() - 1);
    let turn = |p: Vec3, q: Vec3| dot(cross(sub(p, last), sub(q, last)), normal);
    (1..corners.len() - 1).all(|i| turn(place(i - 1), place(i)) > 0.0 && turn(place(0), place(i)) > 0.0)
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
    /// Corners in which the polygon does not turn left, by their first coordinate.
    reflex: Vec<(Flat, u32)>,
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
            reflex: Vec::new(),
            looks: LOOKS.saturating_mul(corners.len()),
            triangles: Vec::with_capacity(corners.len() - 2),
            is_doubtful: false,
        };
        ears.reflex = (0..n).filter(|i| ears.turn(*i) <= 0.0).map(|i| (ears.flat[i as usize], i)).collect();
        ears.reflex.sort_unstable_by(|a, b| a.0[0].total_cmp(&b.0[0]).then(a.1.cmp(&b.1)));
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
        let after = |i: &u32| Some(self.next[*i as usize]);
        std::iter::successors(Some(self.one), after).take(self.left).collect()
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

    fn is_left(&self, i: u32) -> bool {
        self.next[self.previous[i as usize] as usize] == i
    }

    fn turn(&self, i: u32) -> f64 {
        let [p, q, r] = self.around(i).map(|k| self.flat[k as usize]);
        turn(p, q, r)
    }

    /// Leaves out corners that were cut off or have come to turn left.
    fn forget_reflex(&mut self) {
        let mut reflex = std::mem::take(&mut self.reflex);
        reflex.retain(|(_, i)| self.is_left(*i) && self.turn(*i) <= 0.0);
        self.reflex = reflex;
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
            let (held, looks) = self.holds_none(a, b, c);
            self.is_doubtful |= looks > self.looks;
            self.looks = self.looks.saturating_sub(looks);
            return held;
        }
        false
    }

    /// Whether no corner lies in a triangle, beside its own, and how many were looked at.
    fn holds_none(&self, a: Flat, b: Flat, c: Flat) -> (bool, usize) {
        let (low, high) = (a[0].min(b[0]).min(c[0]), a[0].max(b[0]).max(c[0]));
        let first = self.reflex.partition_point(|(p, _)| p[0] < low);
        let mut looks = 0;
        for (p, i) in &self.reflex[first..] {
            looks += 1;
            let inside = turn(a, b, *p) >= 0.0 && turn(b, c, *p) >= 0.0 && turn(c, a, *p) >= 0.0;
            if inside && ![a, b, c].contains(p) && self.is_left(*i) {
                return (false, looks);
            }
            if p[0] > high || looks > self.looks {
                break;
            }
        }
        (true, looks)
    }
}

/// The corners as seen along the axis that is closest to the normal, longer than high, turning left on the whole.
fn flat(corners: &[u32], points: &[Vec3], normal: Vec3) -> Vec<Flat> {
    let size = normal.map(f64::abs);
    let axis = (0..3).fold(0, |best, k| if size[k] > size[best] { k } else { best });
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (u, v) = (v, u);
    }
    let mut flat: Vec<Flat> = corners.iter().map(|c| points[*c as usize]).map(|p| [p[u], p[v]]).collect();
    let extent = |k: usize| {
        let (low, high) =
            flat.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| (low.min(p[k]), high.max(p[k])));
        high - low
    };
    if extent(1) > extent(0) {
        flat.iter_mut().for_each(|p| *p = [p[1], -p[0]]);
    }
    flat
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    fn areas(triangles: &[[u32; 3]], points: &[Vec3]) -> Vec<f64> {
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[i as usize]);
            cross(sub(b, a), sub(c, a))[2] / 2.0
        };
        triangles.iter().map(area).collect()
    }

    fn triangulate(corners: &[u32], points: &[Vec3]) -> Vec<[u32; 3]> {
        let mut triangles = Vec::new();
        add(corners, points, &mut triangles);
        triangles
    }

    fn is_doubtful(points: &[Vec3]) -> bool {
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        add(&corners, points, &mut Vec::new())
    }

    #[test]
    fn a_concave_polygon_does_not_fold() {
        // An arrow head: fanning from corner 0 would fold.
        let points = [[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.5, 0.0, 0.0], [2.0, 1.0, 0.0]];
        for start in 0..4 {
            let corners: Vec<u32> = (0..4).map(|k| (start + k) % 4).collect();
            let areas = areas(&triangulate(&corners, &points), &points);
            assert!(areas.len() == 2 && areas.iter().all(|a| *a > 0.0), "start {start}");
            assert!((areas.iter().sum::<f64>() - 0.5).abs() < 1e-12, "start {start}");
        }
    }

    #[test]
    fn degenerate_polygons_still_give_their_triangles() {
        let points = [[0.0; 3]; 5];
        assert_eq!(triangulate(&[0, 1, 2, 3, 4], &points).len(), 3);
        assert!(triangulate(&[0, 1], &points).is_empty());
        let odd = [[f64::NAN; 3], [f64::INFINITY; 3], [1e300; 3], [-1e300, 1e300, 0.0], [0.0; 3]];
        assert_eq!(triangulate(&[0, 1, 2, 3, 4, 2], &odd).len(), 4);
    }

    #[test]
    fn a_star_that_winds_twice_is_not_fanned() {
        let corner = |k: u32| {
            let (sin, cos) = (f64::from(k) * 0.8 * std::f64::consts::PI).sin_cos();
            [cos, sin, 0.0]
        };
        let points: Vec<Vec3> = (0..5).map(corner).collect();
        assert!(!is_seen_from_last(&[0, 1, 2, 3, 4], &points, [0.0, 0.0, 1.0]));
        assert!(is_doubtful(&points));
    }

    #[test]
    fn doubts_are_told_where_there_are_any() {
        let bow = [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]];
        assert!(is_doubtful(&bow));
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.5, 0.0]];
        assert!(!is_doubtful(&flat) && !is_doubtful(&flat[..3]) && !is_doubtful(&[[0.0; 3]; 6]));
    }

    /// Polygons around the origin, by the radius at each of their corners.
    fn around(n: u32, radius: impl Fn(u32) -> f64) -> Vec<Vec3> {
        let corner = |k: u32| {
            let (sin, cos) = (f64::from(k) / f64::from(n) * std::f64::consts::TAU).sin_cos();
            [radius(k) * cos, radius(k) * sin, 0.0]
        };
        (0..n).map(corner).collect()
    }

    fn comb(n: u32) -> Vec<Vec3> {
        let teeth = (0..n - 2).map(|k| [f64::from(n - k), if k % 2 == 0 { 1.0 } else { 1000.0 }, 0.0]);
        [[0.0; 3], [f64::from(n) + 1.0, 0.0, 0.0]].into_iter().chain(teeth).collect()
    }

    /// Teeth that all lie in each other's strip.
    fn deep_comb(n: u32) -> Vec<Vec3> {
        comb(n).into_iter().map(|p| [p[0], p[1] * 1000.0 * f64::from(n), 0.0]).collect()
    }

    fn whole(points: &[Vec3]) -> bool {
        let corners: Vec<u32> = (0..points.len() as u32).collect();
        let areas = areas(&triangulate(&corners, points), points);
        let expected = normal(&corners, points)[2] / 2.0;
        let sum: f64 = areas.iter().sum();
        areas.len() + 2 == points.len()
            && areas.iter().all(|a| *a >= 0.0)
            && (sum - expected).abs() <= 1e-9 * expected.abs()
            && !is_doubtful(points)
    }

    #[test]
    fn polygons_of_many_corners_are_covered_once() {
        for n in [5, 6, 7, 100, 2000] {
            assert!(whole(&around(n, |_| 2.0)), "disk of {n}");
            assert!(whole(&around(2 * n, |k| 2.0 + f64::from(k % 2))), "star of {n}");
            assert!(whole(&around(2 * n, |k| 2.0 + f64::from(k * k % 17))), "ragged, of {n}");
            assert!(whole(&comb(n)), "comb of {n}");
            assert!(whole(&deep_comb(n)), "deep comb of {n}");
        }
    }

    /// The looks do not suffice for wild polygons of so many corners: that is told, whether they fold or not.
    #[test]
    fn many_corners_take_a_time_in_proportion() {
        let n = 50_000;
        let shapes = [
            ("disk", false, around(n, |_| 2.0)),
            ("star", true, around(n, |k| 2.0 + f64::from(k % 2))),
            ("ragged", true, around(n, |k| 2.0 + f64::from(k.wrapping_mul(k) % 17))),
            ("comb", true, comb(n)),
            ("deep comb", true, deep_comb(n)),
            ("point", false, vec![[0.0; 3]; n as usize]),
            ("noise", true, (0..n).map(|k| [0.7123, 0.3791, 0.0].map(|s| (f64::from(k) * s).fract())).collect()),
        ];
        for (shape, doubtful, points) in shapes {
            let corners: Vec<u32> = (0..n).collect();
            let start = Instant::now();
            let mut triangles = Vec::new();
            let is_doubtful = add(&corners, &points, &mut triangles);
            assert_eq!((triangles.len(), is_doubtful), (n as usize - 2, doubtful), "{shape}");
            assert!(is_doubtful || areas(&triangles, &points).iter().all(|a| *a >= 0.0), "{shape}");
            assert!(start.elapsed().as_secs() < 30, "{shape}: {:?}", start.elapsed());
        }
    }
}
