//! Premise (a): which triangles meet where, from the cells alone.

use crate::topology::FaceId;
use crate::topology::csr::Csr;
use crate::topology::loops::closed_loops;

/// An arc of the boundary by its nodes: first vertex, middle, second vertex, with its triangle on the left.
pub(super) type ArcNodeIds = [u32; 3];

/// Why cells are no oriented surface with simple, disjoint boundary loops.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IncidenceError {
    /// There is no cell.
    #[error("there is no triangle")]
    Empty,
    /// A cell names a node that does not exist, or one twice.
    #[error("triangle {cell} has a node that is out of range or repeated")]
    Nodes {
        /// The cell.
        cell: FaceId,
    },
    /// A node is used both as a vertex and as the middle of an edge, or in the middle of two edges.
    #[error("node {node} (triangle {cell}) has several roles: vertex and middle, or middle of two edges")]
    Role {
        /// The node.
        node: u32,
        /// A cell that uses it.
        cell: FaceId,
    },
    /// More than two triangles at an edge, two in the same direction, or with different middles.
    #[error(
        "the edge between nodes {from} and {to} (triangle {cell}) is not shared as an edge of an oriented surface is"
    )]
    Edge {
        /// First end.
        from: u32,
        /// Second end.
        to: u32,
        /// A cell beside it.
        cell: FaceId,
    },
    /// The boundary passes several times through a vertex.
    #[error("the boundary passes more than once through node {node}")]
    Pinched {
        /// The node.
        node: u32,
    },
}

/// A directed side of a cell: ends in ascending order, then whether it runs that way, its middle, its cell.
#[derive(Clone, Copy, Default)]
struct Side {
    ends: [u32; 2],
    forward: bool,
    mid: u32,
    cell: u32,
}

/// Checks the incidences; returns the boundary loops, each from its least node on, the chart on its left.
pub(super) fn boundary_loops(cells: &[[u32; 6]], nodes: usize) -> Result<Vec<Vec<ArcNodeIds>>, IncidenceError> {
    if cells.is_empty() {
        return Err(IncidenceError::Empty);
    }
    check_nodes(cells, nodes)?;
    let sides = all_sides(cells, nodes);
    // Per vertex, the arc of the boundary that begins there: its middle and where it ends.
    let mut out: Vec<Option<[u32; 2]>> = vec![None; nodes];
    // Per node, the ends of the edge that it is the middle of.
    let mut middle_of: Vec<Option<[u32; 2]>> = vec![None; nodes];
    for edge in sides.chunk_by(|a, b| a.ends == b.ends) {
        let Side { ends: [from, to], mid, cell, .. } = edge[0];
        let cell = FaceId(cell);
        if middle_of[mid as usize].replace([from, to]).is_some() {
            return Err(IncidenceError::Role { node: mid, cell });
        }
        match edge {
            // One side alone is an arc of the boundary.
            [one] => {
                let [a, b] = if one.forward { [from, to] } else { [to, from] };
                if out[a as usize].replace([one.mid, b]).is_some() {
                    return Err(IncidenceError::Pinched { node: a });
                }
            }
            // Two sides agree on the middle, and run in opposite directions.
            [one, two] if one.mid == two.mid && one.forward != two.forward => {}
            _ => return Err(IncidenceError::Edge { from, to, cell }),
        }
    }
    check_roles(cells, &middle_of)?;
    loops_of(out)
}

/// Every node exists, and no cell has one twice.
fn check_nodes(cells: &[[u32; 6]], nodes: usize) -> Result<(), IncidenceError> {
    for (i, cell) in cells.iter().enumerate() {
        let mut sorted = *cell;
        sorted.sort_unstable();
        if sorted[5] as usize >= nodes || sorted.windows(2).any(|w| w[0] == w[1]) {
            return Err(IncidenceError::Nodes { cell: FaceId::at(i) });
        }
    }
    Ok(())
}

/// No vertex may be the middle of an edge.
fn check_roles(cells: &[[u32; 6]], middle_of: &[Option<[u32; 2]>]) -> Result<(), IncidenceError> {
    for (i, cell) in cells.iter().enumerate() {
        if let Some(node) = cell[..3].iter().find(|n| middle_of[**n as usize].is_some()) {
            return Err(IncidenceError::Role { node: *node, cell: FaceId::at(i) });
        }
    }
    Ok(())
}

/// The sides of all cells, sorted: by their ends, their middle, their direction, their cell.
fn all_sides(cells: &[[u32; 6]], nodes: usize) -> Vec<Side> {
    let side = |i: u32, cell: &[u32; 6], k: usize| {
        let (a, b) = (cell[k], cell[(k + 1) % 3]);
        let side = Side { ends: [a.min(b), a.max(b)], forward: a < b, mid: cell[3 + k], cell: i };
        (side.ends[0], side)
    };
    let unsorted = || (0..).zip(cells).flat_map(|(i, c)| [0, 1, 2].map(|k| side(i, c, k)));
    // By lower ends first: the few sides at each are sorted much faster than all together.
    let mut at_lower_end = Csr::sorted(nodes, unsorted);
    let mut sides = Vec::with_capacity(3 * cells.len());
    for node in 0..nodes {
        let around = at_lower_end.row_mut(node);
        around.sort_unstable_by_key(|s| (s.ends[1], s.mid, s.forward, s.cell));
        sides.extend_from_slice(around);
    }
    sides
}

/// Strings the boundary arcs together, from the least node of each loop on. Each vertex has at most one arc out; the
/// boundary of oriented triangles also has as many in, so every walk returns to its start.
///
/// (The walk itself is the one that makers of charts use; what it walks over is found here, from the cells alone, and a
/// walk that did not close would be an error.)
fn loops_of(mut out: Vec<Option<[u32; 2]>>) -> Result<Vec<Vec<ArcNodeIds>>, IncidenceError> {
    let nodes = 0..out.len() as u32;
    let loops = closed_loops(nodes, |from| {
        let [mid, to] = out[from as usize].take()?;
        Some(([from, mid, to], to))
    });
    loops.map_err(|node| IncidenceError::Pinched { node })
}
