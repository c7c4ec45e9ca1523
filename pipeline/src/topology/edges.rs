//! Which triangles meet along which edge. The table never sees positions, and takes any triangulation:
//! non-manifold and inconsistently oriented ones too.

use crate::topology::csr::Csr;
use crate::topology::{EdgeId, FaceId, HalfEdgeId, VertexId};

/// The edges of a triangulation, each with the half-edges that run along it in either direction.
///
/// Edges are numbered in the order in which the half-edges 0, 1, 2, ... first meet them.
///
/// ```
/// use planish_core::topology::{EdgeTable, HalfEdgeId, VertexId};
///
/// // A square: half-edges 0 to 2 run around its first triangle, 3 to 5 around its second one.
/// let triangles = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(VertexId));
/// let edges = EdgeTable::new(&triangles);
/// assert_eq!(edges.len(), 5);
/// // From 2 to 0, and from 0 to 2.
/// assert_eq!(edges.twin(HalfEdgeId(2)), Some(HalfEdgeId(3)));
/// assert_eq!(edges.sides(edges.edge(HalfEdgeId(2))), [HalfEdgeId(2), HalfEdgeId(3)]);
/// assert!(edges.is_boundary(HalfEdgeId(0)) && edges.twin(HalfEdgeId(0)).is_none());
/// ```
#[derive(Clone, Debug)]
pub struct EdgeTable {
    edge_of: Vec<EdgeId>,
    sides: Csr<HalfEdgeId>,
}

/// The ends of an edge, the lesser one first.
fn ordered(t: &[VertexId; 3], side: usize) -> (u32, u32) {
    let (from, to) = (t[side].0, t[(side + 1) % 3].0);
    (from.min(to), from.max(to))
}

impl EdgeTable {
    /// Finds the edges of `triangles`, whose corners are distinct.
    pub fn new(triangles: &[[VertexId; 3]]) -> Self {
        let ends = triangles.iter().flat_map(|t| [0, 1, 2].map(|side| ordered(t, side)));
        let by_lower_end = || ends.clone().zip(0_u32..).map(|((low, high), h)| (low, (high, h)));
        let vertices = triangles.iter().flatten().map(|v| v.index() + 1).max().unwrap_or(0);
        // A counting sort by the lower end, then a sort of the few edges around each vertex: half-edges are never
        // sorted all at once.
        let mut at_lower_end = Csr::sorted(vertices, by_lower_end);
        let mut groups: Csr<HalfEdgeId> = Csr::with_capacity(3 * triangles.len());
        let mut group_of = vec![0_u32; 3 * triangles.len()];
        for v in 0..vertices {
            let around = at_lower_end.row_mut(v);
            around.sort_unstable();
            for same_edge in around.chunk_by(|a, b| a.0 == b.0) {
                for &(_, h) in same_edge {
                    group_of[h as usize] = groups.len() as u32;
                }
                groups.push_row(same_edge.iter().map(|(_, h)| HalfEdgeId(*h)));
            }
        }
        Self::numbered(&groups, &group_of)
    }

    /// Numbers groups of half-edges along one edge by their first half-edge.
    fn numbered(groups: &Csr<HalfEdgeId>, group_of: &[u32]) -> Self {
        let unseen = EdgeId(u32::MAX);
        let mut number = vec![unseen; groups.len()];
        let mut table = Self::with_capacity(group_of.len());
        for &group in group_of {
            let number = &mut number[group as usize];
            if *number == unseen {
                *number = EdgeId::at(table.sides.len());
                table.sides.push_row(groups.row(group as usize).iter().copied());
            }
            table.edge_of.push(*number);
        }
        table
    }

    fn with_capacity(half_edges: usize) -> Self {
        Self { edge_of: Vec::with_capacity(half_edges), sides: Csr::with_capacity(half_edges) }
    }

    /// The table of a part of the triangulation: of `faces`, ascending, of which `local` tells the place in the part.
    /// It is the table that [`Self::new`] would find, without the sort.
    pub(crate) fn part(&self, faces: &[FaceId], local: impl Fn(FaceId) -> Option<FaceId>) -> Self {
        let mut table = Self::with_capacity(3 * faces.len());
        let inside = |h: &HalfEdgeId| Some(HalfEdgeId::side_of(local(h.face())?, h.side()));
        for h in faces.iter().flat_map(|f| f.sides()) {
            let mut sides = self.sides(self.edge(h)).iter().filter_map(inside).peekable();
            // Sides ascend: the first one meets the edge first.
            let edge = match sides.peek().and_then(|first| table.edge_of.get(first.index())) {
                Some(known) => *known,
                None => {
                    table.sides.push_row(sides);
                    EdgeId::at(table.sides.len() - 1)
                }
            };
            table.edge_of.push(edge);
        }
        table
    }

    /// The number of edges.
    pub fn len(&self) -> usize {
        self.sides.len()
    }

    /// Whether there is no edge.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The edge that `h` runs along.
    pub fn edge(&self, h: HalfEdgeId) -> EdgeId {
        self.edge_of[h.index()]
    }

    /// All half-edges along `edge`, ascending: one at the boundary, two inside, more where sheets meet.
    pub fn sides(&self, edge: EdgeId) -> &[HalfEdgeId] {
        self.sides.row(edge.index())
    }

    /// The half-edge on the other side, where exactly two triangles meet.
    pub fn twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId> {
        match *self.sides(self.edge(h)) {
            [a, b] => Some(if a == h { b } else { a }),
            _ => None,
        }
    }

    /// Whether `h` bounds the only triangle at its edge.
    pub fn is_boundary(&self, h: HalfEdgeId) -> bool {
        self.sides(self.edge(h)).len() == 1
    }

    /// All edges with their sides.
    pub fn iter(&self) -> impl Iterator<Item = (EdgeId, &[HalfEdgeId])> {
        (0..self.len()).map(EdgeId::at).map(|e| (e, self.sides(e)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ids(t: [u32; 3]) -> [VertexId; 3] {
        t.map(VertexId)
    }

    #[test]
    fn an_edge_knows_its_sides() {
        let table = EdgeTable::new(&[ids([0, 1, 2]), ids([0, 2, 3]), ids([2, 0, 4])]);
        assert_eq!(table.len(), 7);
        let shared = table.edge(HalfEdgeId(2));
        assert_eq!(table.sides(shared), [HalfEdgeId(2), HalfEdgeId(3), HalfEdgeId(6)]);
        assert_eq!(table.twin(HalfEdgeId(2)), None);
        assert!(table.is_boundary(HalfEdgeId(0)));
    }

    #[test]
    fn the_table_of_a_part_is_found_anew() {
        let all = [[0, 1, 2], [0, 2, 3], [2, 0, 4], [4, 0, 1], [4, 3, 2], [1, 2, 4]].map(ids);
        let table = EdgeTable::new(&all);
        for chosen in 0..64_usize {
            let faces: Vec<FaceId> = (0..6).filter(|f| chosen >> f & 1 == 1).map(FaceId::at).collect();
            let triangles: Vec<_> = faces.iter().map(|f| all[f.index()]).collect();
            let part = table.part(&faces, |f| faces.binary_search(&f).ok().map(FaceId::at));
            let anew = EdgeTable::new(&triangles);
            assert_eq!((part.edge_of, part.sides), (anew.edge_of, anew.sides));
        }
    }

    #[test]
    fn twins_are_mutual_and_edges_are_numbered_by_first_half_edge() {
        let table = EdgeTable::new(&[ids([7, 1, 2]), ids([2, 1, 3]), ids([7, 2, 9])]);
        for h in (0..9).map(HalfEdgeId) {
            if let Some(twin) = table.twin(h) {
                assert_eq!(table.twin(twin), Some(h));
                assert_ne!(twin.face(), h.face());
            }
        }
        let firsts: Vec<_> = table.iter().map(|(_, sides)| sides[0]).collect();
        assert!(firsts.is_sorted());
    }
}
