//! Are loops of quadratic arcs simple, and apart from each other? Decided exactly, or not at all.
//!
//! Every arc lies in the hull of its three Bezier points. Where two hulls are apart, so are the arcs; where arcs follow each
//! other, it is enough that the cones in which the hulls lie, seen from the node between, have only their apex in common.
//! Else both are halved, to a fixed depth. Arcs that touch or cross are never told apart that way, so that what is said to
//! be apart is; some that are apart are left undecided: those that run along each other closer than their bend, and cusps.
//! No arc meets itself: where the jacobian is positive it has a direction everywhere, and a parabola crosses itself nowhere.
//!
//! *Widths.* Bezier points are below 2^56 in units of the grid. Each halving multiplies by 4, so that after [`DEPTH`] of
//! them coordinates are below 2^112, their differences below 2^113, and products of these below 2^227: integers of any width
//! where `i128` does not hold them.

use super::arcs::Arc;
use super::polygons::Wrong;
use super::sides::{Joint, first_found, only_left, sides_of};
use crate::grid::bezier_control;
use crate::vec3::BoundingBox;
use num_bigint::BigInt;
use std::cmp::Ordering;

/// How often arcs are halved. Two arcs with a bend of the size of the plane that come as near as one unit of the grid at one
/// point are told apart after 27.
const DEPTH: u32 = 28;

/// How many pairs of pieces are looked at for one pair of arcs. Two arcs that are near at one point take some ten pairs a
/// halving; those that run along each other would take twice as many at each.
const PAIRS: usize = 4096;

/// How many pairs of arcs with boxes that meet are looked at for all loops together: more in proportion to the arcs than real
/// boundaries have (a few each), and as many as a comb of 3,000 slanted teeth has (7 s with all of them).
const ARCS_PAIRED: usize = 1_000_000;
const PAIRS_PER_ARC: usize = 64;

/// A point in units of the grid, times 4 for every halving.
type Point = [i128; 2];

/// A piece of an arc by its Bezier points: first end, control point, second end.
#[derive(Clone, Copy)]
struct Piece([Point; 3]);

/// What is known of two arcs.
enum Verdict {
    Apart,
    Meet,
    Undecided,
}

/// Looks at closed loops of arcs, each with what it bounds on its left, of a map whose jacobian is positive: the number of
/// the outer loop, where they are those of a disk with holes.
///
/// One loop that turns left is all that is asked for of how they lie. The number of preimages of a point is the sum over the
/// loops around it, +1 for each that turns left and -1 for each that turns right, and never negative. So no loop that turns
/// right lies outside the one that turns left, nor inside another.
///
/// # Errors
/// [`Wrong`].
pub(super) fn outer_of(loops: &[Vec<Arc>]) -> Result<usize, Wrong> {
    if let Some(wrong) = clash(loops) {
        return Err(wrong);
    }
    only_left(loops.len(), |i| turns_left(&loops[i]))
}

/// Whether the area that a loop bounds, on its left, is positive.
fn turns_left(arcs: &[Arc]) -> bool {
    let Some(origin) = arcs.first().map(|arc| arc.from) else { return false };
    // Six times the area: three times that of the polygon of chords, doubled, and four thirds of the triangles between
    // chords and control points, likewise.
    let mut sum = BigInt::from(0);
    for arc in arcs {
        let (from, to) = (arc.from.from_origin(origin), arc.to.from_origin(origin));
        let (control, chord) = (bezier_control(arc.from, arc.mid, arc.to, arc.from), arc.to.from_origin(arc.from));
        sum += BigInt::from(3) * from.cross(to) + BigInt::from(2) * control.cross(chord);
    }
    sum > BigInt::from(0)
}

/// The first two arcs that meet elsewhere than at a node between neighbours, or may do so.
fn clash(loops: &[Vec<Arc>]) -> Option<Wrong> {
    let sides = sides_of(loops);
    let pieces: Vec<Piece> = sides.iter().map(|(l, i)| Piece::of(&loops[*l][*i])).collect();
    let most = ARCS_PAIRED + PAIRS_PER_ARC * pieces.len();
    first_found(pieces.iter().map(Piece::around), |pair, before| {
        let [s, t] = pair.map(|side| sides[side as usize]);
        if before >= most {
            return Some(Wrong::Undecided([s, t]));
        }
        let [a, b] = pair.map(|side| pieces[side as usize]);
        match compare(a, b, Joint::between(loops, s, t)) {
            Verdict::Apart => None,
            Verdict::Meet => Some(Wrong::Crossing([s, t])),
            Verdict::Undecided => Some(Wrong::Undecided([s, t])),
        }
    })
}

/// Whether two arcs have a point in common, the nodes at joints not counted. Ends after [`PAIRS`] pairs of pieces.
fn compare(a: Piece, b: Piece, joint: Joint) -> Verdict {
    if a.is_straight() && b.is_straight() && !(joint.forward && joint.backward) {
        // For segments the first look decides.
        return if are_apart(&a, &b, joint) { Verdict::Apart } else { Verdict::Meet };
    }
    let mut waiting = vec![(a, b, joint, 0)];
    let mut looked_at = 0;
    while let Some((a, b, joint, depth)) = waiting.pop() {
        looked_at += 1;
        if looked_at > PAIRS {
            return Verdict::Undecided;
        }
        if are_apart(&a, &b, joint) {
            continue;
        }
        if depth == DEPTH {
            return Verdict::Undecided;
        }
        let ([a0, a1], [b0, b1]) = (a.halves(), b.halves());
        let none = Joint::default();
        waiting.push((a0, b0, none, depth + 1));
        waiting.push((a1, b1, none, depth + 1));
        waiting.push((a1, b0, Joint { forward: joint.forward, ..none }, depth + 1));
        waiting.push((a0, b1, Joint { backward: joint.backward, ..none }, depth + 1));
    }
    Verdict::Apart
}

/// Whether two pieces have no point in common, nodes at joints not counted; false where it cannot be seen from hulls.
fn are_apart(a: &Piece, b: &Piece, joint: Joint) -> bool {
    match (joint.forward, joint.backward) {
        (false, false) => a.is_separated_from(b),
        (true, false) => cones_are_apart(&a.reversed(), b),
        (false, true) => cones_are_apart(a, &b.reversed()),
        (true, true) => false,
    }
}

impl Piece {
    /// The whole of an arc.
    fn of(arc: &Arc) -> Self {
        let control = bezier_control(arc.from, arc.mid, arc.to, arc.from);
        let wide = |x: i64, y: i64| [i128::from(x), i128::from(y)];
        Self([
            wide(arc.from.x, arc.from.y),
            wide(control.x + arc.from.x, control.y + arc.from.y),
            wide(arc.to.x, arc.to.y),
        ])
    }

    /// Both halves, by de Casteljau's construction, times 4.
    fn halves(&self) -> [Self; 2] {
        let [p, c, q] = self.0;
        let combine = |f: i128, g: i128, h: i128| [0, 1].map(|k| f * p[k] + g * c[k] + h * q[k]);
        let middle = combine(1, 2, 1);
        [Self([combine(4, 0, 0), combine(2, 2, 0), middle]), Self([middle, combine(0, 2, 2), combine(0, 0, 4)])]
    }

    fn reversed(&self) -> Self {
        let [p, c, q] = self.0;
        Self([q, c, p])
    }

    /// Whether the arc is the segment between its ends.
    fn is_straight(&self) -> bool {
        let [p, c, q] = self.0;
        let is_between = |k: usize| p[k].min(q[k]) <= c[k] && c[k] <= p[k].max(q[k]);
        turn(p, c, q) == Ordering::Equal && is_between(0) && is_between(1)
    }

    /// Whether a line separates the hulls strictly.
    fn is_separated_from(&self, other: &Self) -> bool {
        let range = |points: &[Point; 3], k: usize| {
            let [a, b, c] = points.map(|p| p[k]);
            [a.min(b).min(c), a.max(b).max(c)]
        };
        for k in 0..2 {
            let ([low, high], [other_low, other_high]) = (range(&self.0, k), range(&other.0, k));
            if high < other_low || other_high < low {
                return true;
            }
        }
        self.has_side_before(other) || other.has_side_before(self)
    }

    /// Whether `other` lies strictly on one side of a side of this hull, and this hull on the other.
    fn has_side_before(&self, other: &Self) -> bool {
        let is_wall = |k: usize| {
            let (from, to, third) = (self.0[k], self.0[(k + 1) % 3], self.0[(k + 2) % 3]);
            let own = turn(from, to, third);
            let [first, second, last] = other.0.map(|p| turn(from, to, p));
            first != Ordering::Equal && first == second && second == last && own != first
        };
        (0..3).any(is_wall)
    }

    /// A box around the hull, a little larger: doubles of these integers may be off by some units.
    fn around(&self) -> BoundingBox {
        let mut around = BoundingBox { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for p in self.0 {
            for k in 0..2 {
                around.min[k] = around.min[k].min(p[k] as f64 - 16.0);
                around.max[k] = around.max[k].max(p[k] as f64 + 16.0);
            }
        }
        around.min[2] = 0.0;
        around.max[2] = 0.0;
        around
    }
}

/// Whether the cones from the common first end of two pieces, around their hulls, have only that point in common.
fn cones_are_apart(a: &Piece, b: &Piece) -> bool {
    let apex = a.0[0];
    let rays = |piece: &Piece| [1, 2].map(|k| minus(piece.0[k], apex));
    let ([a1, a2], [b1, b2]) = (rays(a), rays(b));
    let is_none = |ray: Point| ray == [0, 0];
    // A piece of no length at the apex: nothing is said of it.
    if [a1, a2, b1, b2].into_iter().any(is_none) {
        return false;
    }
    // Convex cones have more than the apex in common only where a side of one lies in the other.
    ![b1, b2].into_iter().any(|ray| is_in_cone(ray, a1, a2)) && ![a1, a2].into_iter().any(|ray| is_in_cone(ray, b1, b2))
}

/// Whether a ray lies in the closed cone between two others; true where these are opposite, and span none.
fn is_in_cone(ray: Point, u: Point, v: Point) -> bool {
    let side = cross(u, v);
    match side {
        Ordering::Equal if dot(u, v) == Ordering::Greater => {
            cross(u, ray) == Ordering::Equal && dot(u, ray) == Ordering::Greater
        }
        Ordering::Equal => true,
        _ => [cross(u, ray), cross(ray, v)].into_iter().all(|s| s == side || s == Ordering::Equal),
    }
}

/// On which side of the line from `a` to `b` the point `c` lies: greater to the left.
fn turn(a: Point, b: Point, c: Point) -> Ordering {
    cross(minus(b, a), minus(c, a))
}

fn minus(p: Point, q: Point) -> Point {
    [p[0] - q[0], p[1] - q[1]]
}

/// The sign of u x v.
fn cross(u: Point, v: Point) -> Ordering {
    compare_products([u[0], v[1]], [u[1], v[0]])
}

/// The sign of u . v.
fn dot(u: Point, v: Point) -> Ordering {
    compare_products([u[0], v[0]], [-u[1], v[1]])
}

/// Compares the products of two pairs.
fn compare_products([a, b]: [i128; 2], [c, d]: [i128; 2]) -> Ordering {
    match (a.checked_mul(b), c.checked_mul(d)) {
        (Some(first), Some(second)) => first.cmp(&second),
        _ => (BigInt::from(a) * b).cmp(&(BigInt::from(c) * d)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{GridPoint, UNITS};

    /// An arc by its ends and its middle; ends are on the grid of vertices.
    fn arc(from: [f64; 2], mid: [f64; 2], to: [f64; 2]) -> Arc {
        Arc { from: GridPoint::vertex(from), mid: GridPoint::mid(mid), to: GridPoint::vertex(to) }
    }

    fn verdict(a: Arc, b: Arc) -> &'static str {
        match compare(Piece::of(&a), Piece::of(&b), Joint::default()) {
            Verdict::Apart => "apart",
            Verdict::Meet => "meet",
            Verdict::Undecided => "undecided",
        }
    }

    /// The arc moved up by so many units of the grid, an even number.
    fn raised(arc: Arc, units: i64) -> Arc {
        let up = |p: GridPoint| GridPoint { y: p.y + units, ..p };
        Arc { from: up(arc.from), mid: up(arc.mid), to: up(arc.to) }
    }

    #[test]
    fn two_units_of_the_grid_decide_at_one_point() {
        // A bow that bends down to the top of one that bends up.
        let lower = arc([-0.5, -0.5], [0.0, 0.0], [0.5, -0.5]);
        let upper = arc([-0.5, 0.5], [0.0, 0.0], [0.5, 0.5]);
        assert_eq!(verdict(lower, upper), "undecided", "they touch");
        assert_eq!(verdict(lower, raised(upper, -2)), "undecided", "they cross");
        assert_eq!(verdict(lower, raised(upper, 2)), "apart");
        // Straight ones are decided either way.
        let flat = arc([-0.5, 0.0], [0.0, 0.0], [0.5, 0.0]);
        let steep = arc([0.0, 0.0], [0.1, 0.25], [0.2, 0.5]);
        assert_eq!(verdict(flat, steep), "meet", "they touch");
        assert_eq!(verdict(raised(flat, 2), steep), "meet");
        assert_eq!(verdict(raised(flat, -2), steep), "apart");
    }

    #[test]
    fn what_runs_along_a_unit_apart_is_proven_where_it_is_straight_and_given_up_where_it_is_bent() {
        let straight = arc([-0.5, 0.25], [0.0, 0.0], [0.5, -0.25]);
        assert_eq!(verdict(straight, raised(straight, 2)), "apart");
        let bent = arc([-0.5, 0.0], [0.0, 0.3], [0.5, 0.0]);
        assert_eq!(verdict(bent, raised(bent, 2)), "undecided");
        assert_eq!(verdict(bent, raised(bent, (0.01 * UNITS) as i64 & !1)), "apart");
    }

    /// A loop through these nodes, vertices and middles in turn.
    fn around(nodes: &[[f64; 2]]) -> Vec<Arc> {
        let n = nodes.len();
        (0..n / 2).map(|k| arc(nodes[2 * k], nodes[2 * k + 1], nodes[(2 * k + 2) % n])).collect()
    }

    fn reversed(arcs: &[Arc]) -> Vec<Arc> {
        arcs.iter().rev().map(|a| Arc { from: a.to, mid: a.mid, to: a.from }).collect()
    }

    /// A lens of two arcs around a point.
    fn lens(x: f64, half: f64) -> Vec<Arc> {
        around(&[[x - half, 0.0], [x, -half], [x + half, 0.0], [x, half]])
    }

    #[test]
    fn a_bent_band_with_holes_is_right_and_its_broken_twins_are_not() {
        // Not star-shaped about any point: a half ring, its ends straight.
        let bow = |r: f64| {
            let at = |turn: f64| {
                let (sin, cos) = (std::f64::consts::PI * turn).sin_cos();
                [r * cos, r * sin]
            };
            [0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0].map(at)
        };
        let (outside, mut inside) = (bow(0.9), bow(0.3));
        inside.reverse();
        let band = |gap: f64| {
            let mut nodes = outside.to_vec();
            nodes.push([-0.6, gap]);
            nodes.extend(inside);
            nodes.push([0.6, 0.0]);
            around(&nodes)
        };
        assert_eq!(outer_of(&[band(0.0)]), Ok(0));
        let hole = reversed(&lens(0.0, 0.1)).iter().map(|a| raised(*a, (0.6 * UNITS) as i64 & !1)).collect::<Vec<_>>();
        assert_eq!(outer_of(&[hole.clone(), band(0.0)]), Ok(1));
        assert_eq!(outer_of(&[reversed(&band(0.0))]), Err(Wrong::Outer(0)));
        assert_eq!(outer_of(&[band(0.0), lens(0.0, 0.1)]), Err(Wrong::Outer(1)));
        // An end that bends through the outside, and a hole that does.
        assert!(outer_of(&[band(0.9)]).is_err());
        let far = hole.iter().map(|a| raised(*a, (0.25 * UNITS) as i64 & !1)).collect::<Vec<_>>();
        assert!(matches!(outer_of(&[band(0.0), far]), Err(Wrong::Undecided(_))));
    }

    #[test]
    fn arcs_that_follow_each_other_meet_at_their_node_only() {
        // Two arcs with both ends in common, a corner of no angle, and one of a hair.
        assert_eq!(outer_of(&[lens(0.0, 0.5)]), Ok(0));
        let corner = |height: f64| {
            around(&[[0.0, 0.0], [0.25, 0.0], [0.5, 0.0], [0.25, height], [0.0, 2.0 * height], [0.0, height]])
        };
        assert!(matches!(outer_of(&[corner(0.0)]), Err(Wrong::Crossing(_))));
        assert_eq!(outer_of(&[corner(2.0 / UNITS)]), Ok(0));
        // A cusp, where both leave the node in one direction, is left undecided; a hair makes it a corner.
        let horn = |lift: f64| {
            around(&[[0.0, 0.0], [0.25, 0.0625], [0.5, 0.25], [0.375, 0.375], [0.25, 0.5], [0.125, 0.125 + lift]])
        };
        assert!(matches!(outer_of(&[horn(0.0)]), Err(Wrong::Undecided([(0, 0), (0, 2)]))));
        assert_eq!(outer_of(&[horn(1e-9)]), Ok(0));
    }
}
