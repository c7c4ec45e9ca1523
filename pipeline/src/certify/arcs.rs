//! Premises (c) and (d): loops of quadratic arcs that are star-shaped about a point.

use super::incidence::ArcNodes;
use crate::grid::{GridPoint, GridVector, bezier_control};

/// A quadratic arc of the boundary: first end, middle node, second end. The ends lie on the grid of vertices.
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
    /// With the Bezier points p0, c, p1 relative to `centre`: p0 x c, p0 x p1, c x p1, exactly.
    pub fn products(&self, centre: GridPoint) -> [i128; 3] {
        let c = bezier_control(self.from, self.mid, self.to, self.from);
        let (p, q) = (self.from.from_origin(centre), self.to.from_origin(centre));
        // The control point is found relative to the first end, where halving is exact, and then moved.
        let control = GridVector { x: c.x + p.x, y: c.y + p.y };
        [p.cross(control), p.cross(q), control.cross(q)]
    }
}

pub(super) fn arc_of(arc: &ArcNodes, nodes: &[GridPoint]) -> Arc {
    let [from, mid, to] = arc.map(|n| nodes[n as usize]);
    Arc { from, mid, to }
}

/// Whether a loop is star-shaped about `centre` and winds around it once in the direction `sign` (+1 to the left,
/// -1 to the right), exactly.
pub(super) fn winds_once(arcs: &[Arc], centre: GridPoint, sign: i128) -> bool {
    let turns = |a: &Arc| a.products(centre).iter().all(|p| p * sign > 0);
    // As every arc turns by less than half a turn, one way, turns are counted by the arcs that cross the ray
    // from the centre to the right: one end strictly below it, the other not.
    let below = |p: GridPoint| p.y < centre.y;
    let (first, second) = if sign > 0 { (true, false) } else { (false, true) };
    let crosses = |a: &&Arc| below(a.from) == first && below(a.to) == second;
    arcs.iter().all(turns) && arcs.iter().filter(crosses).count() == 1
}
