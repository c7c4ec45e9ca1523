//! Counting: what kind of surface is this?

use super::EdgeTable;
use crate::topology::union_find::UnionFind;
use crate::topology::{FaceId, HalfEdgeId, VertexId};

/// The numbers that tell what a triangulated surface is.
///
/// ```
/// use planish_core::topology::{EdgeTable, TopologySummary, VertexId};
///
/// // A tetrahedron without one of its faces.
/// let open = [[0, 2, 1], [0, 1, 3], [1, 2, 3]].map(|t| t.map(VertexId));
/// let summary = TopologySummary::new(&open, &EdgeTable::new(&open));
/// assert_eq!((summary.vertices, summary.edges, summary.triangles), (4, 6, 3));
/// assert_eq!((summary.euler, summary.boundary_loops, summary.genus), (1, 1, Some(0)));
/// assert!(summary.is_one_chart(), "it is a disk");
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TopologySummary {
    /// Vertices that a triangle uses.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Edges.
    pub edges: usize,
    /// Parts connected through edges.
    pub components: usize,
    /// Closed curves of boundary edges; curves that meet at the end of a non-manifold edge are one.
    pub boundary_loops: usize,
    /// Euler number: vertices - edges + triangles.
    pub euler: i64,
    /// Total genus (handles); `None` where the surface is not orientable or has non-manifold edges.
    pub genus: Option<u64>,
    /// Whether every component can be oriented.
    pub orientable: bool,
    /// Edges at which three or more triangles meet.
    pub nonmanifold_edges: usize,
    /// Vertices at which sheets touch that share no edge there: once for each sheet beyond the first.
    pub nonmanifold_vertices: usize,
    /// Edges whose two triangles disagree about the direction.
    pub inconsistent_edges: usize,
}

/// The sheets around each vertex: corners of triangles, grouped where two triangles share an edge at the vertex.
///
/// ```
/// use planish_core::topology::{EdgeTable, VertexFans, VertexId};
///
/// // Two triangles that share vertex 0 and no edge: vertex 0 has two fans, the others one each.
/// let bow_tie = [[0, 1, 2], [0, 3, 4]].map(|t| t.map(VertexId));
/// let fans = VertexFans::new(&bow_tie, &EdgeTable::new(&bow_tie));
/// assert_eq!(fans.count, 6);
/// assert_ne!(fans.of_corner[0], fans.of_corner[3], "corner 0 of either triangle");
/// assert_eq!(fans.vertices(&bow_tie)[fans.of_corner[3] as usize], VertexId(0));
/// ```
#[derive(Clone, Debug)]
pub struct VertexFans {
    /// Per corner (`3 * face + corner`), the fan it belongs to; numbered in the order of first corners.
    pub of_corner: Vec<u32>,
    /// How many there are.
    pub count: usize,
}

impl VertexFans {
    /// Groups the corners of `triangles`; edges of three or more of them part sheets.
    pub fn new(triangles: &[[VertexId; 3]], edges: &EdgeTable) -> Self {
        Self::through(triangles, edges, 2)
    }

    /// Groups the corners of `triangles` through edges of at most so many of them.
    fn through(triangles: &[[VertexId; 3]], edges: &EdgeTable, most: usize) -> Self {
        Self::across(triangles, edges, |sides| sides.len() <= most)
    }

    /// Groups the corners of `triangles` through the edges that join, told by their sides.
    pub(crate) fn across(
        triangles: &[[VertexId; 3]],
        edges: &EdgeTable,
        joins: impl Fn(&[HalfEdgeId]) -> bool,
    ) -> Self {
        let mut sets = UnionFind::new(3 * triangles.len());
        for (_, sides) in edges.iter().filter(|(_, sides)| joins(sides)) {
            for (a, b) in sides.windows(2).flat_map(|pair| matching_corners(triangles, pair[0], pair[1])) {
                sets.merge(a, b);
            }
        }
        let (of_corner, count) = sets.labels();
        Self { of_corner, count }
    }

    /// A vertex for every fan, in ascending order of the vertices that they come from: those of the triangles' corners, and per
    /// vertex the one that it is a copy of. Copies of a vertex follow each other.
    pub(crate) fn numbered(&self, triangles: &[[VertexId; 3]]) -> (Vec<[VertexId; 3]>, Vec<VertexId>) {
        let mut order: Vec<(VertexId, usize)> = self.vertices(triangles).into_iter().zip(0..).collect();
        order.sort_unstable();
        let mut of_fan = vec![VertexId(0); order.len()];
        for (number, (_, fan)) in order.iter().enumerate() {
            of_fan[*fan] = VertexId::at(number);
        }
        let renamed = |face: usize| [0, 1, 2].map(|k| of_fan[self.of_corner[3 * face + k] as usize]);
        ((0..triangles.len()).map(renamed).collect(), order.into_iter().map(|(v, _)| v).collect())
    }

    /// The vertex of each fan.
    pub fn vertices(&self, triangles: &[[VertexId; 3]]) -> Vec<VertexId> {
        let mut vertices = vec![VertexId(0); self.count];
        for (corner, &fan) in self.of_corner.iter().enumerate() {
            vertices[fan as usize] = triangles[corner / 3][corner % 3];
        }
        vertices
    }
}

/// The two pairs of corners that two half-edges along one edge share.
fn matching_corners(triangles: &[[VertexId; 3]], g: HalfEdgeId, h: HalfEdgeId) -> [(usize, usize); 2] {
    let corner = |e: HalfEdgeId| triangles[e.face().index()][e.side()];
    let (from_g, to_g) = (g.index(), g.next().index());
    let (from_h, to_h) = (h.index(), h.next().index());
    if corner(g) == corner(h) { [(from_g, from_h), (to_g, to_h)] } else { [(from_g, to_h), (to_g, from_h)] }
}

/// Whether two half-edges along one edge run in opposite directions, as they do on an oriented surface.
pub(crate) fn opposed(triangles: &[[VertexId; 3]], g: HalfEdgeId, h: HalfEdgeId) -> bool {
    triangles[g.face().index()][g.side()] != triangles[h.face().index()][h.side()]
}

/// Per face, whether it must be flipped for its component to be oriented, relative to the component's first
/// face; and per face its component through two-sided edges. Ends because each face is entered once.
pub(crate) struct Orientation {
    pub flip: Vec<bool>,
    pub component: Vec<u32>,
    /// Per component, whether it can be oriented at all.
    pub orientable: Vec<bool>,
}

pub(crate) fn orientation(triangles: &[[VertexId; 3]], edges: &EdgeTable) -> Orientation {
    let unseen = u32::MAX;
    let mut found = Orientation {
        flip: vec![false; triangles.len()],
        component: vec![unseen; triangles.len()],
        orientable: vec![],
    };
    let mut stack = Vec::new();
    for seed in 0..triangles.len() {
        if found.component[seed] != unseen {
            continue;
        }
        let component = found.orientable.len() as u32;
        found.component[seed] = component;
        found.orientable.push(true);
        stack.push(FaceId::at(seed));
        while let Some(face) = stack.pop() {
            for h in (0..3).map(|k| HalfEdgeId::side_of(face, k)) {
                let Some(twin) = edges.twin(h) else { continue };
                let flip = found.flip[face.index()] ^ !opposed(triangles, h, twin);
                let other = twin.face().index();
                if found.component[other] == unseen {
                    found.component[other] = component;
                    found.flip[other] = flip;
                    stack.push(twin.face());
                } else {
                    found.orientable[component as usize] &= found.flip[other] == flip;
                }
            }
        }
    }
    found
}

impl TopologySummary {
    /// Counts everything about `triangles`, whose corners are distinct.
    pub fn new(triangles: &[[VertexId; 3]], edges: &EdgeTable) -> Self {
        // What touches along a non-manifold edge touches in its ends, too: that is no defect of its own.
        let fans = VertexFans::through(triangles, edges, usize::MAX);
        let (vertices, nonmanifold_vertices) = count_vertices(&fans.vertices(triangles));
        let orientable = orientation(triangles, edges).orientable.iter().all(|o| *o);
        let nonmanifold_edges = edges.iter().filter(|(_, s)| s.len() > 2).count();
        let inconsistent = |s: &[HalfEdgeId]| matches!(*s, [g, h] if !opposed(triangles, g, h));
        let components = count_components(triangles.len(), edges);
        let boundary_loops = count_loops(edges, &fans);
        let cells = triangles.len() as i64 - edges.len() as i64;
        // Sheets that only touch in a vertex are apart: the genus counts a vertex once per fan.
        // Euler number = 2 components - 2 genus - loops: this is twice the genus.
        let handles = 2 * components as i64 - boundary_loops as i64 - (fans.count as i64 + cells);
        let closed_up = orientable && nonmanifold_edges == 0;
        Self {
            vertices,
            triangles: triangles.len(),
            edges: edges.len(),
            components,
            boundary_loops,
            euler: vertices as i64 + cells,
            genus: if closed_up { u64::try_from(handles / 2).ok() } else { None },
            orientable,
            nonmanifold_edges,
            nonmanifold_vertices,
            inconsistent_edges: edges.iter().filter(|(_, s)| inconsistent(s)).count(),
        }
    }

    /// Whether the surface is a disk, or a disk with holes: what one chart can carry.
    pub fn is_one_chart(&self) -> bool {
        let manifold = self.nonmanifold_edges == 0 && self.nonmanifold_vertices == 0;
        manifold && self.components == 1 && self.genus == Some(0) && self.boundary_loops > 0
    }
}

/// The number of vertices, and how many fans there are beyond one for each.
fn count_vertices(fan_vertices: &[VertexId]) -> (usize, usize) {
    let mut vertices = fan_vertices.to_vec();
    vertices.sort_unstable();
    vertices.dedup();
    (vertices.len(), fan_vertices.len() - vertices.len())
}

/// The number of parts connected through edges.
pub(crate) fn count_components(faces: usize, edges: &EdgeTable) -> usize {
    connected(faces, edges).labels().1
}

/// The faces of each part connected through edges, ascending; parts in the order of their first faces.
pub(crate) fn components(faces: usize, edges: &EdgeTable) -> Vec<Vec<FaceId>> {
    let (labels, count) = connected(faces, edges).labels();
    let mut components = vec![Vec::new(); count];
    for (face, label) in labels.into_iter().enumerate() {
        components[label as usize].push(FaceId::at(face));
    }
    components
}

fn connected(faces: usize, edges: &EdgeTable) -> UnionFind {
    let mut sets = UnionFind::new(faces);
    for (_, sides) in edges.iter() {
        for pair in sides.windows(2) {
            sets.merge(pair[0].face().index(), pair[1].face().index());
        }
    }
    sets
}

/// Boundary edges that end in the same fan belong to the same loop.
fn count_loops(edges: &EdgeTable, fans: &VertexFans) -> usize {
    let boundary: Vec<HalfEdgeId> = edges.iter().filter(|(_, s)| s.len() == 1).map(|(_, s)| s[0]).collect();
    let mut sets = UnionFind::new(boundary.len());
    let mut seen = vec![u32::MAX; fans.count];
    for (i, h) in boundary.iter().enumerate() {
        for corner in [h.index(), h.next().index()] {
            let last = &mut seen[fans.of_corner[corner] as usize];
            if *last != u32::MAX {
                sets.merge(i, *last as usize);
            }
            *last = i as u32;
        }
    }
    sets.labels().1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary(triangles: &[[u32; 3]]) -> TopologySummary {
        let triangles: Vec<_> = triangles.iter().map(|t| t.map(VertexId)).collect();
        TopologySummary::new(&triangles, &EdgeTable::new(&triangles))
    }

    #[test]
    fn a_tetrahedron_is_a_sphere_and_without_a_face_a_disk() {
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let sphere = summary(&tetrahedron);
        assert_eq!((sphere.euler, sphere.genus, sphere.boundary_loops), (2, Some(0), 0));
        assert!(!sphere.is_one_chart());
        assert!(summary(&tetrahedron[..3]).is_one_chart());
    }

    #[test]
    fn sheets_that_touch_in_a_vertex_are_two_components() {
        let bow_tie = summary(&[[0, 1, 2], [0, 3, 4]]);
        assert_eq!((bow_tie.components, bow_tie.boundary_loops, bow_tie.nonmanifold_vertices), (2, 2, 1));
        assert_eq!((bow_tie.euler, bow_tie.genus), (1, Some(0)));
    }

    #[test]
    fn a_book_of_three_pages_is_not_manifold() {
        let book = summary(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        assert_eq!((book.nonmanifold_edges, book.genus, book.components), (1, None, 1));
        assert_eq!((book.nonmanifold_vertices, book.boundary_loops), (0, 1));
    }

    #[test]
    fn a_moebius_strip_cannot_be_oriented() {
        let strip: Vec<_> = (0..5).map(|i| [i, (i + 1) % 5, (i + 2) % 5]).collect();
        let moebius = summary(&strip);
        assert!(!moebius.orientable);
        assert_eq!((moebius.boundary_loops, moebius.euler, moebius.genus), (1, 0, None));
    }

    #[test]
    fn a_flipped_triangle_is_counted_as_inconsistent() {
        let square = summary(&[[0, 1, 2], [0, 3, 2]]);
        assert_eq!((square.inconsistent_edges, square.orientable), (1, true));
        assert_eq!(summary(&[[0, 1, 2], [2, 3, 0]]).inconsistent_edges, 0);
        assert_eq!(summary(&[[0, 1, 2], [0, 2, 3]]).inconsistent_edges, 0);
    }
}
