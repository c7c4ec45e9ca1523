//! Are the boundary loops of a map by straight triangles simple and rightly nested? Decided exactly, on the grid.
//!
//! With every triangle positive, such loops are all that the theorem of [`crate::certify`] asks for: the number of
//! preimages of a point is its winding number about the loops, which is 1 inside the outer one and outside the holes,
//! and 0 elsewhere.

use super::sides::{Joint, Side, first_found, only_left, sides_of};
use crate::evaluate::Bvh;
use crate::grid::{GridPoint, orientation};
use crate::vec3::BoundingBox;
use num_bigint::BigInt;

/// What is wrong with loops.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Wrong {
    /// Two sides cross or touch, each given by its loop and its position there.
    #[error("{} and {} cross or touch", Place(&.0[0]), Place(&.0[1]))]
    Crossing([(usize, usize); 2]),
    /// Two sides that are curved, each given by its loop and its position there, come so close along each other that it is
    /// not decided whether they meet.
    #[error("it is not decided whether {} and {}, which are curved, cross or touch", Place(&.0[0]), Place(&.0[1]))]
    Undecided([(usize, usize); 2]),
    /// Not exactly one loop turns left; this one is given as evidence.
    #[error("not exactly one loop turns left (see loop {0})")]
    Outer(usize),
    /// A loop lies outside the outer one, or inside another.
    #[error("loop {0} lies outside the outer one, or inside another")]
    Nesting(usize),
}

impl Wrong {
    /// The loop that is wrong, or the first of two.
    pub fn first_loop(self) -> usize {
        match self {
            Self::Crossing([(number, _), _]) | Self::Undecided([(number, _), _]) => number,
            Self::Outer(number) | Self::Nesting(number) => number,
        }
    }
}

/// A side, told by its loop and its position there.
struct Place<'a>(&'a (usize, usize));

impl std::fmt::Display for Place<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self((number, side)) = self;
        write!(f, "side {side} of loop {number}")
    }
}

/// Looks at closed polygons, each with what it bounds on its left.
pub fn check(loops: &[Vec<GridPoint>]) -> Option<Wrong> {
    if let Some(pair) = crossing(loops) {
        return Some(Wrong::Crossing(pair));
    }
    let outer = match only_left(loops.len(), |i| doubled_area(&loops[i]) > BigInt::from(0)) {
        Ok(outer) => outer,
        Err(wrong) => return Some(wrong),
    };
    let mut holes = (0..loops.len()).filter(|i| *i != outer);
    holes.find(|hole| is_misplaced(loops, outer, *hole)).map(Wrong::Nesting)
}

/// All pairs of sides that share a point other than the end that neighbours have in common.
pub(crate) fn crossings(loops: &[Vec<GridPoint>]) -> Vec<[Side; 2]> {
    let sides = sides_of(loops);
    let mut found = Vec::new();
    Bvh::new(sides.iter().map(|s| around(ends(loops, *s)))).pairs(|s, t| {
        let [s, t] = [s, t].map(|side| sides[side as usize]);
        if clash(ends(loops, s), ends(loops, t), Joint::between(loops, s, t)) {
            found.push([s, t]);
        }
    });
    found
}

/// Whether a hole lies outside the outer loop, or inside another hole. As no loops cross or touch, one point of the hole
/// tells for all of it.
fn is_misplaced(loops: &[Vec<GridPoint>], outer: usize, hole: usize) -> bool {
    let point = loops[hole][0];
    if !is_inside(point, &loops[outer]) {
        return true;
    }
    let mut others = (0..loops.len()).filter(|i| *i != outer && *i != hole);
    others.any(|other| is_inside(point, &loops[other]))
}

/// Twice the signed area in grid units squared, exactly.
fn doubled_area(polygon: &[GridPoint]) -> BigInt {
    let origin = polygon.first().copied().unwrap_or_default();
    let next = polygon.iter().cycle().skip(1);
    polygon.iter().zip(next).map(|(p, q)| BigInt::from(orientation(origin, *p, *q))).sum()
}

/// The first two sides that share a point other than the end that neighbours have in common.
fn crossing(loops: &[Vec<GridPoint>]) -> Option<[Side; 2]> {
    let sides = sides_of(loops);
    first_found(sides.iter().map(|s| around(ends(loops, *s))), |pair, _| {
        let [s, t] = pair.map(|side| sides[side as usize]);
        clash(ends(loops, s), ends(loops, t), Joint::between(loops, s, t)).then_some([s, t])
    })
}

/// The points at which a side begins and ends.
fn ends(loops: &[Vec<GridPoint>], (l, i): Side) -> [GridPoint; 2] {
    let polygon = &loops[l];
    [polygon[i], polygon[(i + 1) % polygon.len()]]
}

/// Whether two sides share a point other than the end that neighbours have in common.
fn clash([a, b]: [GridPoint; 2], [c, d]: [GridPoint; 2], joint: Joint) -> bool {
    match (joint.forward, joint.backward) {
        // There and back along one side.
        (true, true) => true,
        (true, false) => turns_back(a, b, d),
        (false, true) => turns_back(c, d, b),
        (false, false) => meet([a, b], [c, d]),
    }
}

/// Whether the path from `a` over `b` to `c` runs back on itself.
fn turns_back(a: GridPoint, b: GridPoint, c: GridPoint) -> bool {
    let (u, v) = (b.from_origin(a), c.from_origin(b));
    let along = i128::from(u.x) * i128::from(v.x) + i128::from(u.y) * i128::from(v.y);
    u.cross(v) == 0 && along <= 0
}

/// Whether two segments have a point in common.
fn meet([a, b]: [GridPoint; 2], [c, d]: [GridPoint; 2]) -> bool {
    let sign = |p, q, r| orientation(p, q, r).signum();
    // On which sides of the one the ends of the other lie.
    let of_second = [sign(a, b, c), sign(a, b, d)];
    let of_first = [sign(c, d, a), sign(c, d, b)];
    if of_second == [0, 0] && of_first == [0, 0] {
        // On one line: their boxes met already, and so do they.
        return true;
    }
    of_second[0] * of_second[1] <= 0 && of_first[0] * of_first[1] <= 0
}

/// Whether a point lies inside a polygon that does not pass through it: crossings of a ray to the right.
fn is_inside(p: GridPoint, polygon: &[GridPoint]) -> bool {
    let mut is_inside = false;
    let next = polygon.iter().cycle().skip(1);
    for (a, b) in polygon.iter().zip(next) {
        // Half-open: a corner on the ray counts for the sides that go up from it, or come down to it.
        let upward = a.y <= p.y && p.y < b.y;
        let downward = b.y <= p.y && p.y < a.y;
        let side = orientation(*a, *b, p);
        if (upward && side > 0) || (downward && side < 0) {
            is_inside = !is_inside;
        }
    }
    is_inside
}

/// A box that contains a side.
fn around(ends: [GridPoint; 2]) -> BoundingBox {
    // Doubles of 64-bit integers may be off by a unit in the last place: boxes are a little larger.
    let slack = |c: i64, way: f64| c as f64 + way * 2.0;
    let [a, b] = ends;
    BoundingBox {
        min: [slack(a.x.min(b.x), -1.0), slack(a.y.min(b.y), -1.0), 0.0],
        max: [slack(a.x.max(b.x), 1.0), slack(a.y.max(b.y), 1.0), 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn polygon(points: &[[f64; 2]]) -> Vec<GridPoint> {
        points.iter().map(|p| GridPoint::mid(*p)).collect()
    }

    fn square(centre: [f64; 2], half: f64) -> Vec<GridPoint> {
        let at = |x: f64, y: f64| [centre[0] + x * half, centre[1] + y * half];
        polygon(&[at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)])
    }

    fn hole(centre: [f64; 2], half: f64) -> Vec<GridPoint> {
        square(centre, half).into_iter().rev().collect()
    }

    #[test]
    fn a_square_with_two_holes_is_right_and_its_broken_twins_are_not() {
        let outer = square([0.0; 2], 0.9);
        let (left, right) = (hole([-0.4, 0.0], 0.2), hole([0.4, 0.0], 0.2));
        assert_eq!(check(&[outer.clone(), left.clone(), right.clone()]), None);
        assert_eq!(check(&[left.clone(), outer.clone()]), None);
        assert_eq!(check(&[outer.clone(), square([0.4, 0.0], 0.2)]), Some(Wrong::Outer(1)));
        assert_eq!(check(&[left.clone(), right.clone()]), Some(Wrong::Outer(0)));
        assert_eq!(check(&[outer.clone(), left.clone(), hole([-0.4, 0.0], 0.1)]), Some(Wrong::Nesting(2)));
        assert_eq!(check(&[square([0.0; 2], 0.3), hole([0.7, 0.0], 0.2)]), Some(Wrong::Nesting(1)));
        assert!(matches!(check(&[outer.clone(), hole([0.8, 0.0], 0.2)]), Some(Wrong::Crossing(_))));
        // Holes that share a side, a corner on a side, and a path that runs back.
        assert!(matches!(check(&[outer.clone(), left.clone(), hole([0.0, 0.0], 0.2)]), Some(Wrong::Crossing(_))));
        let spike = polygon(&[[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [0.9, 0.0], [-0.9, 0.9]]);
        assert!(matches!(check(&[spike]), Some(Wrong::Crossing(_))));
        let bow = polygon(&[[-0.5, -0.5], [0.5, 0.5], [0.5, -0.5], [-0.5, 0.5]]);
        assert!(matches!(check(&[bow]), Some(Wrong::Crossing(_))));
    }

    #[test]
    fn straight_on_is_no_crossing() {
        let corners = [[-0.5, -0.5], [0.0, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        assert_eq!(check(&[polygon(&corners)]), None);
    }
}
