//! Maps by straight triangles, whatever the shape of their boundary.
//!
//! The nodes of a quadratic triangle, taken for the corners of four straight ones. The theorem of [`crate::certify`] with (c)
//! and (d) replaced by: the loops are simple polygons, one around all others, and none of these inside another. Then the
//! winding number about them is 1 inside the outer one and outside the others, and 0 elsewhere, and the same argument holds.

use super::polygons::{self, Wrong};
use super::{Error, IncidenceError, PlanarMap, incidence, refuse_inexact};
use crate::grid::{GridPoint, orientation};
use crate::topology::FaceId;

/// A map by straight triangles, four between the six nodes of each cell, that is proven to be one-to-one. Made by
/// [`prove_straight`] only.
#[derive(Clone, Debug)]
pub struct StraightMap {
    map: PlanarMap,
}

impl StraightMap {
    /// The map.
    pub fn map(&self) -> &PlanarMap {
        &self.map
    }
}

/// The four triangles between the nodes of a cell: at its corners, and in the middle.
pub fn parts<T: Copy>([a, b, c, ab, bc, ca]: [T; 6]) -> [[T; 3]; 4] {
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Why a map by straight triangles is not proven.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum StraightError {
    /// The cells are no surface with boundary.
    #[error(transparent)]
    Incidence(#[from] IncidenceError),
    /// A node is no double.
    #[error(transparent)]
    Node(Error),
    /// Triangles are folded, or have no area.
    #[error("parts of {count} triangles do not turn left (first: {first})")]
    Folded {
        /// Of how many cells.
        count: usize,
        /// The first of them.
        first: FaceId,
    },
    /// The boundary crosses or touches itself, or its loops do not lie as those of a disk with holes.
    #[error("the boundary is not that of a disk with holes: {0}")]
    Boundary(Wrong),
}

/// Proves that a map by straight triangles is one-to-one.
///
/// # Errors
/// The first premise that fails, with its evidence.
///
/// # Example
///
/// Here middles of edges are corners like any other.
///
/// ```
/// use planish_core::certify::{PlanarMap, StraightError, prove_straight};
/// use planish_core::grid::GridPoint;
///
/// let uv = [[0.1, 0.1], [0.9, 0.1], [0.1, 0.9], [0.5, 0.2], [0.5, 0.5], [0.1, 0.5]];
/// let nodes = uv.map(GridPoint::vertex).to_vec();
/// let map = PlanarMap { cells: vec![[0, 1, 2, 3, 4, 5]], nodes, hole_centres: vec![] };
/// assert!(prove_straight(map.clone()).is_ok());
///
/// let mut folded = map;
/// folded.nodes[3] = GridPoint::vertex([0.5, 0.6]);
/// assert!(matches!(prove_straight(folded), Err(StraightError::Folded { count: 1, .. })));
/// ```
pub fn prove_straight(map: PlanarMap) -> Result<StraightMap, StraightError> {
    let loops = incidence::boundary_loops(&map.cells, map.nodes.len())?;
    refuse_inexact(&map).map_err(StraightError::Node)?;
    let mut folded = (0..map.cells.len()).filter(|f| !turns_left(&map, *f));
    if let Some(first) = folded.next() {
        return Err(StraightError::Folded { count: 1 + folded.count(), first: FaceId::at(first) });
    }
    let polygons: Vec<Vec<GridPoint>> = loops.iter().map(|l| polygon(&map, l)).collect();
    match polygons::check(&polygons) {
        Some(wrong) => Err(StraightError::Boundary(wrong)),
        None => Ok(StraightMap { map }),
    }
}

/// Whether all four parts of a cell turn left.
fn turns_left(map: &PlanarMap, cell: usize) -> bool {
    let nodes = map.cells[cell].map(|n| map.nodes[n as usize]);
    parts(nodes).iter().all(|[a, b, c]| orientation(*a, *b, *c) > 0)
}

/// A loop of the boundary by its corners: vertices and middles of edges in turn.
fn polygon(map: &PlanarMap, boundary_loop: &[incidence::ArcNodeIds]) -> Vec<GridPoint> {
    let mut corners = Vec::with_capacity(2 * boundary_loop.len());
    for [from, mid, _] in boundary_loop {
        corners.push(map.nodes[*from as usize]);
        corners.push(map.nodes[*mid as usize]);
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The map with the corners of triangles at these uv.
    fn map(corners: &[[f64; 2]], triangles: &[[usize; 3]]) -> PlanarMap {
        let mut nodes: Vec<GridPoint> = corners.iter().map(|p| GridPoint::vertex(*p)).collect();
        let mut edges: Vec<[usize; 2]> = Vec::new();
        let mut cells = Vec::new();
        for t in triangles {
            let mids = [0, 1, 2].map(|k| {
                let (from, to) = (t[k], t[(k + 1) % 3]);
                let edge = [from.min(to), from.max(to)];
                let known = edges.iter().position(|e| *e == edge);
                corners.len()
                    + known.unwrap_or_else(|| {
                        edges.push(edge);
                        nodes.push(nodes[from].midpoint(nodes[to]));
                        edges.len() - 1
                    })
            });
            cells.push([t[0], t[1], t[2], mids[0], mids[1], mids[2]].map(|n| n as u32));
        }
        PlanarMap { cells, nodes, hole_centres: vec![] }
    }

    /// An L of two squares, each of two triangles, with the corners at these uv.
    fn bent_strip(corners: [[f64; 2]; 6]) -> PlanarMap {
        map(&corners, &[[0, 1, 2], [0, 2, 3], [3, 2, 4], [3, 4, 5]])
    }

    const BENT: [[f64; 2]; 6] = [[0.0, 0.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [0.25, 0.75], [-0.5, 0.5]];

    #[test]
    fn an_l_is_proven_although_it_is_not_convex_and_its_broken_twins_are_not() {
        assert!(prove_straight(bent_strip(BENT)).is_ok());
        let mut folded = BENT;
        folded[4] = [0.25, 0.25];
        assert_eq!(
            prove_straight(bent_strip(folded)).err(),
            Some(StraightError::Folded { count: 2, first: FaceId(2) })
        );
        // Middles that lie elsewhere are corners of parts like any other.
        let mut bent = bent_strip(BENT);
        bent.nodes[6].y -= 1 << 50;
        assert!(prove_straight(bent.clone()).is_ok());
        bent.nodes[6].y += 1 << 52;
        assert_eq!(prove_straight(bent).err(), Some(StraightError::Folded { count: 1, first: FaceId(0) }));
        let mut far = bent_strip(BENT);
        far.nodes[1].y = i64::MAX / 2;
        assert_eq!(prove_straight(far).err(), Some(StraightError::Node(Error::Inexact { node: 1 })));
    }

    #[test]
    fn a_spiral_that_covers_itself_is_not_proven_although_nothing_is_folded() {
        // A strip of squares that goes around a square hole, and on over its own beginning.
        let ring = |k: usize| [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]][k % 4];
        for (turns, is_proven) in [(3, true), (4, false), (5, false)] {
            let corners: Vec<[f64; 2]> =
                (0..=turns).flat_map(|k| [0.25, 0.75].map(|r| ring(k).map(|c: f64| c * r))).collect();
            let halves = |k: usize| [[2 * k, 2 * k + 1, 2 * k + 3], [2 * k, 2 * k + 3, 2 * k + 2]];
            let proven = prove_straight(map(&corners, &(0..turns).flat_map(halves).collect::<Vec<_>>()));
            assert_eq!(proven.is_ok(), is_proven, "{turns}: {:?}", proven.err());
            assert!(is_proven || matches!(proven, Err(StraightError::Boundary(Wrong::Crossing(_)))));
        }
    }
}
