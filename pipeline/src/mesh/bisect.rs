//! Halving edges of a surface, and the triangles at them with them.

use super::{SurfaceMesh, TriangleShape, push_mean};
use crate::topology::{EdgeId, EdgeTable, FaceId, HalfEdgeId, VertexId};
use crate::vec3::midpoint;

/// A surface of which edges were halved. It is the same surface, with the same metric.
pub(crate) struct Halved {
    /// The surface: its triangles keep their numbers, and are the first of their parts; all others come behind.
    pub mesh: SurfaceMesh,
    /// Per triangle that was added, that of which it is a part.
    pub parents: Vec<FaceId>,
    /// Per vertex that was added, the ends of its edge.
    pub ends: Vec<[VertexId; 2]>,
}

/// Which edges are to be halved, in which order: per edge its rank, and nothing for those that stay.
pub(crate) struct Ranks(Vec<u32>);

/// The rank of an edge that stays.
const STAYS: u32 = u32::MAX;

impl Ranks {
    /// Of the edges in `groups`, those of the last group first. The edges of a group are copies of one.
    pub(crate) fn new(mesh: &SurfaceMesh, groups: &[Vec<EdgeId>]) -> Self {
        let mut ranks = vec![STAYS; mesh.edges.len()];
        for (group, rank) in groups.iter().zip(0..) {
            group.iter().for_each(|edge| ranks[edge.index()] = rank);
        }
        Self(ranks)
    }

    fn of(&self, edge: EdgeId) -> Option<u32> {
        Some(self.0[edge.index()]).filter(|rank| *rank != STAYS)
    }
}

/// A triangle with its shape, and per side, where it is to be halved: the rank, and the vertex in its middle.
#[derive(Clone, Copy)]
struct Piece {
    corners: [VertexId; 3],
    shape: TriangleShape,
    sides: [Option<(u32, VertexId)>; 3],
}

impl Piece {
    /// Its parts when the side of the highest rank is halved; none where it stays whole.
    fn halves(&self) -> Option<[Self; 2]> {
        let rank = |k: usize| self.sides[k].map(|(rank, _)| rank);
        let k = (0..3).max_by_key(|k| rank(*k)).filter(|k| rank(*k).is_some())?;
        let (l, m) = ((k + 1) % 3, (k + 2) % 3);
        let (_, middle) = self.sides[k]?;
        let [p, q, r] = [k, l, m].map(|i| self.corners[i]);
        let [first, second] = self.shape.halves(k);
        Some([
            Self { corners: [p, middle, r], shape: first, sides: [None, None, self.sides[m]] },
            Self { corners: [middle, q, r], shape: second, sides: [None, self.sides[l], None] },
        ])
    }

    /// All its parts. There are at most four: each side is halved once.
    fn parts(self) -> Vec<Self> {
        let mut parts = Vec::with_capacity(4);
        let mut waiting = vec![self];
        while let Some(piece) = waiting.pop() {
            match piece.halves() {
                Some([first, second]) => waiting.extend([second, first]),
                None => parts.push(piece),
            }
        }
        parts
    }
}

/// Whether a triangle has a part without area when these edges are halved.
pub(crate) fn falls_to_nothing(mesh: &SurfaceMesh, face: FaceId, ranks: &Ranks) -> bool {
    // Where new vertices would be does not matter.
    let piece = piece(mesh, face, ranks, |_| VertexId(0));
    piece.parts().iter().any(|part| part.shape.area() == 0.0)
}

fn piece(mesh: &SurfaceMesh, face: FaceId, ranks: &Ranks, middle: impl Fn(EdgeId) -> VertexId) -> Piece {
    let sides = face.sides().map(|h| {
        let edge = mesh.edges.edge(h);
        ranks.of(edge).map(|rank| (rank, middle(edge)))
    });
    Piece { corners: mesh.triangles[face.index()], shape: mesh.metric.shapes[face.index()], sides }
}

/// Halves the edges in `groups`, each a list of the copies that sheets have of one edge: their new vertices are copies of one,
/// too. Triangles are bisected from those sides on that come last.
pub(crate) fn halve(mut mesh: SurfaceMesh, groups: &[Vec<EdgeId>]) -> Halved {
    let ranks = Ranks::new(&mesh, groups);
    let mut middles = vec![VertexId(u32::MAX); mesh.edges.len()];
    let mut ends = Vec::new();
    let mut faces = Vec::new();
    let next_welded = mesh.welded.iter().max().map_or(0, |welded| welded + 1);
    for (group, welded) in groups.iter().zip(next_welded..) {
        for edge in group {
            let sides = mesh.edges.sides(*edge);
            let begin = |h: HalfEdgeId| mesh.triangles[h.face().index()][h.side()];
            let [from, to] = [sides[0], sides[0].next()].map(begin);
            mesh.summary.inconsistent_edges += usize::from(sides[1..].iter().any(|h| begin(*h) == from));
            middles[edge.index()] = VertexId::at(mesh.points.len());
            mesh.points.push(midpoint(mesh.points[from.index()], mesh.points[to.index()]));
            push_mean(&mut mesh.sizes, [from, to]);
            mesh.middles.push(mesh.welded_ends([from, to]));
            mesh.welded.push(welded);
            ends.push([from, to]);
            faces.extend(sides.iter().map(|h| h.face()));
        }
    }
    faces.sort_unstable();
    faces.dedup();
    let mut parents = Vec::new();
    for face in faces {
        let parts = piece(&mesh, face, &ranks, |edge| middles[edge.index()]).parts();
        let f = face.index();
        for (k, part) in parts.into_iter().enumerate() {
            if k == 0 {
                (mesh.triangles[f], mesh.metric.shapes[f]) = (part.corners, part.shape);
                continue;
            }
            mesh.triangles.push(part.corners);
            mesh.metric.shapes.push(part.shape);
            mesh.metric.flagged.push(mesh.metric.flagged[f]);
            mesh.source.push(mesh.source[f]);
            parents.push(face);
        }
    }
    let edges = EdgeTable::new(&mesh.triangles);
    mesh.summary.vertices += ends.len();
    mesh.summary.triangles += parents.len();
    mesh.summary.edges = edges.len();
    Halved { mesh: SurfaceMesh { edges, ..mesh }, parents, ends }
}
