//! Premises (c) and (d): loops of quadratic arcs that are star-shaped about a point.

use super::incidence::ArcNodeIds;
use crate::grid::{GridPoint, GridVector, bezier_control};

/// A quadratic arc of the boundary: first end, middle node, second end. The ends lie on the grid of vertices.
///
/// # Example
///
/// An arc runs around a point, to the left, where all three products are positive.
///
/// ```
/// use planish_core::certify::Arc;
/// use planish_core::grid::GridPoint;
///
/// let (from, to) = (GridPoint::vertex([0.5, 0.0]), GridPoint::vertex([0.0, 0.5]));
/// let arc = Arc { from, mid: GridPoint::mid([0.35, 0.35]), to };
/// assert!(arc.products(GridPoint::default()).iter().all(|p| *p > 0));
/// // From beyond the arc it is seen to turn right, and from its own end not at all.
/// assert!(arc.products(GridPoint::vertex([0.9, 0.9])).iter().all(|p| *p < 0));
/// assert_eq!(arc.products(from)[..2], [0, 0]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Arc {
    /// First end.
    pub from: GridPoint,
    /// The node half-way along.
    pub mid: GridPoint,
    /// Second end.
    pub to: GridPoint,
}

impl Arc {
    /// With the Bezier points p0, c, p1 relative to `centre`: p0 x c, p0 x p1, c x p1, exactly, in grid units squared.
    pub fn products(&self, centre: GridPoint) -> [i128; 3] {
        let c = bezier_control(self.from, self.mid, self.to, self.from);
        let (p, q) = (self.from.from_origin(centre), self.to.from_origin(centre));
        // The control point is found relative to the first end, where halving is exact, and then moved.
        let control = GridVector { x: c.x + p.x, y: c.y + p.y };
        [p.cross(control), p.cross(q), control.cross(q)]
    }
}

pub(super) fn arc_of(arc: &ArcNodeIds, nodes: &[GridPoint]) -> Arc {
    let [from, mid, to] = arc.map(|n| nodes[n as usize]);
    Arc { from, mid, to }
}

/// Whether a loop is star-shaped about `centre` and winds around it once in the direction `sign` (+1 to the left,
/// -1 to the right), exactly.
pub(super) fn winds_once(arcs: &[Arc], centre: GridPoint, sign: i128) -> bool {
    for arc in arcs {
        if arc.products(centre).iter().any(|p| p * sign <= 0) {
            return false;
        }
    }
    // As every arc turns by less than half a turn, one way, turns are counted by the arcs that cross the ray
    // from the centre to the right: one end strictly below it, the other not.
    let is_below = |p: GridPoint| p.y < centre.y;
    let comes_from_below = sign > 0;
    let mut turns = 0;
    for arc in arcs {
        if is_below(arc.from) == comes_from_below && is_below(arc.to) != comes_from_below {
            turns += 1;
        }
    }
    turns == 1
}
