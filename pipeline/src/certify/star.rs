//! Finding a point from which all of a loop can be seen: the kernel of a star-shaped polygon.

use super::arcs::{Arc, winds_once};
use crate::grid::GridPoint;

/// A point about which the loop around a hole (traversed with the chart on its left) is star-shaped and winds -1:
/// `guess` if it serves, else a point in the middle of the kernel. `None` where there is none.
///
/// The kernel is the square around the loop, cut by one half-plane per piece of every arc's control polygon; the
/// cuts are made in doubles, and the point found is tested exactly.
pub fn star_centre(arcs: &[Arc], guess: GridPoint) -> Option<GridPoint> {
    if winds_once(arcs, guess, -1) {
        return Some(guess);
    }
    let mut kernel = square_around(arcs);
    for arc in arcs {
        let (p, m, q) = (arc.from.uv(), arc.mid.uv(), arc.to.uv());
        let control = [0, 1].map(|k| 2.0 * m[k] - 0.5 * (p[k] + q[k]));
        for (a, b) in [(p, control), (p, q), (control, q)] {
            kernel = cut(&kernel, a, b);
        }
    }
    let n = kernel.len().max(1) as f64;
    let middle = [0, 1].map(|k| kernel.iter().map(|p| p[k]).sum::<f64>() / n);
    let found = GridPoint::vertex(middle);
    (!kernel.is_empty() && winds_once(arcs, found, -1)).then_some(found)
}

fn square_around(arcs: &[Arc]) -> Vec<[f64; 2]> {
    let fold = |f: fn(f64, f64) -> f64, k: usize| arcs.iter().map(|a| a.from.uv()[k]).fold(arcs[0].from.uv()[k], f);
    let [x0, y0, x1, y1] = [fold(f64::min, 0), fold(f64::min, 1), fold(f64::max, 0), fold(f64::max, 1)];
    vec![[x0, y0], [x1, y0], [x1, y1], [x0, y1]]
}

/// The part of a convex polygon to the right of the line from `a` to `b` (where the hole lies).
fn cut(polygon: &[[f64; 2]], a: [f64; 2], b: [f64; 2]) -> Vec<[f64; 2]> {
    let side = |p: [f64; 2]| (p[0] - a[0]) * (b[1] - a[1]) - (p[1] - a[1]) * (b[0] - a[0]);
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (sp, sq) = (side(p), side(q));
        if sp >= 0.0 {
            kept.push(p);
        }
        if (sp > 0.0 && sq < 0.0) || (sp < 0.0 && sq > 0.0) {
            let t = sp / (sp - sq);
            kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    kept
}
