//! Finding a point from which all of a loop can be seen: the kernel of a star-shaped polygon.

use super::arcs::{Arc, winds_once};
use crate::grid::GridPoint;

/// A point about which the loop around a hole (traversed with the chart on its left) is star-shaped and winds -1:
/// `guess` if it serves, else a point in the middle of the kernel. `None` where there is none.
///
/// The kernel is the square around the loop, cut by one half-plane per piece of every arc's control polygon; the
/// cuts are made in doubles, and the point found is tested exactly.
///
/// # Example
///
/// A hole in the shape of an arrowhead is seen from its tip, not from its mean.
///
/// ```
/// use planish_core::certify::{Arc, star_centre};
/// use planish_core::grid::GridPoint;
///
/// // With the chart on its left, a loop around a hole turns right.
/// let corners = [[0.5, 0.0], [-0.5, -0.5], [0.25, 0.0], [-0.5, 0.5]].map(GridPoint::vertex);
/// let arrowhead = [0, 1, 2, 3].map(|k| {
///     let (from, to) = (corners[k], corners[(k + 1) % 4]);
///     Arc { from, mid: from.midpoint(to), to }
/// });
/// let centre = star_centre(&arrowhead, GridPoint::default()).expect("the tip sees all");
/// assert!(centre.uv()[0] > 0.25);
/// // A loop that turns left is around no hole.
/// let mut reversed = arrowhead.map(|Arc { from, mid, to }| Arc { from: to, mid, to: from });
/// reversed.reverse();
/// assert_eq!(star_centre(&reversed, GridPoint::default()), None);
/// ```
pub fn star_centre(arcs: &[Arc], guess: GridPoint) -> Option<GridPoint> {
    if winds_once(arcs, guess, -1) {
        return Some(guess);
    }
    let mut kernel = square_around(arcs);
    for arc in arcs {
        let (p, m, q) = (arc.from.uv(), arc.mid.uv(), arc.to.uv());
        let control = [0, 1].map(|k| 2.0 * m[k] - 0.5 * (p[k] + q[k]));
        // The three lines behind the three products of an arc.
        for (a, b) in [(p, control), (p, q), (control, q)] {
            kernel = cut(&kernel, a, b);
        }
    }
    if kernel.is_empty() {
        return None;
    }
    let found = GridPoint::vertex(mean(&kernel));
    winds_once(arcs, found, -1).then_some(found)
}

/// The mean of the corners of a polygon: inside, where that is convex.
fn mean(polygon: &[[f64; 2]]) -> [f64; 2] {
    let n = polygon.len() as f64;
    [0, 1].map(|k| polygon.iter().map(|p| p[k]).sum::<f64>() / n)
}

/// The corners of the box around the vertices of a loop, turning left.
fn square_around(arcs: &[Arc]) -> Vec<[f64; 2]> {
    let mut min = arcs[0].from.uv();
    let mut max = min;
    for arc in arcs {
        let p = arc.from.uv();
        for k in 0..2 {
            min[k] = min[k].min(p[k]);
            max[k] = max[k].max(p[k]);
        }
    }
    vec![min, [max[0], min[1]], max, [min[0], max[1]]]
}

/// The part of a convex polygon to the right of the line from `a` to `b` (where the hole lies).
fn cut(polygon: &[[f64; 2]], a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    let side = |p: [f64; 2]| (p[0] - a[0]) * (b[1] - a[1]) - (p[1] - a[1]) * (b[0] - a[0]);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (side_of_p, side_of_q) = (side(p), side(q));
        if side_of_p >= 0.0 {
            kept.push(p);
        }
        // A side that the line crosses, and not only touches, gets a corner there.
        let is_crossed = (side_of_p > 0.0 && side_of_q < 0.0) || (side_of_p < 0.0 && side_of_q > 0.0);
        if is_crossed {
            let t = side_of_p / (side_of_p - side_of_q);
            kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    kept
}
