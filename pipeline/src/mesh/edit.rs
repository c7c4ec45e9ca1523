//! Editing a surface: the only place where triangles of a [`SurfaceMesh`] change, and what it knows of itself with them.

use super::{SurfaceMesh, TriangleShape, push_mean};
use crate::topology::{EdgeTable, FaceId, HalfEdgeId, VertexId};
use crate::vec3::midpoint;

/// A surface while edges are split. What it knows of itself is true again when that is finished.
pub(crate) struct MeshEditor {
    mesh: SurfaceMesh,
    /// The vertices before.
    vertices: usize,
    /// The number of the next vertex among the welded ones.
    next_welded: u32,
    /// Per triangle, whether it was split.
    is_split: Vec<bool>,
}

/// A triangle with its shape.
type Part = ([VertexId; 3], TriangleShape);

impl MeshEditor {
    /// Begins to edit a surface.
    pub(crate) fn new(mesh: SurfaceMesh) -> Self {
        let next_welded = mesh.welded.iter().max().map_or(0, |welded| welded + 1);
        let (vertices, is_split) = (mesh.points.len(), vec![false; mesh.triangles.len()]);
        Self { mesh, vertices, next_welded, is_split }
    }

    /// The surface half way: its triangles are those of now, its edges those from before. The sides of triangles that were
    /// split are numbered anew, and not along these edges any more.
    pub(crate) fn unfinished(&self) -> &SurfaceMesh {
        &self.mesh
    }

    /// Splits an edge, given by its two half-edges, in the middle, and the triangles at its sides: each keeps the part at the
    /// begin of its half-edge, and the part at its end is the next triangle of the surface. The surface does not change, nor
    /// does its metric. Returns the new triangles, or nothing where a part would have no area: then all stays.
    ///
    /// # Panics
    /// If a triangle was split before, as its half-edges are not those of the surface any more; if the half-edges do not run
    /// along one edge in opposite directions.
    pub(crate) fn split_edge(&mut self, sides: [HalfEdgeId; 2]) -> Option<[FaceId; 2]> {
        assert!(sides.iter().all(|h| !self.is_split[h.face().index()]), "a triangle is split twice");
        let ends = sides.map(|h| [self.from(h), self.from(h.next())]);
        assert!(ends[0][0] == ends[1][1] && ends[0][1] == ends[1][0], "{sides:?} are the sides of no edge");
        let middle = VertexId::at(self.mesh.points.len());
        let parts = sides.map(|side| self.halves(side, middle));
        if parts.iter().flatten().any(|(_, shape)| shape.area() == 0.0) {
            return None;
        }
        push_mean(&mut self.mesh.sizes, ends[0]);
        self.mesh.middles.push(self.mesh.welded_ends(ends[0]));
        let [p, q] = ends[0].map(|v| self.mesh.points[v.index()]);
        self.mesh.points.push(midpoint(p, q));
        self.mesh.welded.push(self.next_welded);
        self.next_welded += 1;
        let added = [0, 1].map(|side| self.replace(sides[side].face(), parts[side]));
        let counts = &mut self.mesh.summary;
        counts.vertices += 1;
        counts.edges += 3;
        counts.triangles += 2;
        Some(added)
    }

    /// The surface, with its edges.
    pub(crate) fn finish(self) -> SurfaceMesh {
        if self.mesh.points.len() == self.vertices {
            return self.mesh;
        }
        let edges = EdgeTable::new(&self.mesh.triangles);
        SurfaceMesh { edges, ..self.mesh }
    }

    /// Puts the parts of a triangle at its place and at the end; returns the latter.
    fn replace(&mut self, face: FaceId, [first, second]: [Part; 2]) -> FaceId {
        let (mesh, face) = (&mut self.mesh, face.index());
        let added = FaceId::at(mesh.triangles.len());
        (mesh.triangles[face], mesh.metric.shapes[face]) = first;
        mesh.triangles.push(second.0);
        mesh.metric.shapes.push(second.1);
        mesh.metric.flagged.push(mesh.metric.flagged[face]);
        mesh.source.push(mesh.source[face]);
        self.is_split[face] = true;
        self.is_split.push(true);
        added
    }

    /// The two parts of the triangle at `h` when `middle` halves that side.
    fn halves(&self, h: HalfEdgeId, middle: VertexId) -> [Part; 2] {
        let corners = self.mesh.triangles[h.face().index()];
        let [k, l, m] = [h.side(), h.next().side(), h.prev().side()];
        let [p, q, r] = [corners[k], corners[l], corners[m]];
        let [first, second] = self.mesh.metric.shapes[h.face().index()].halves(k);
        [([p, middle, r], first), ([middle, q, r], second)]
    }

    fn from(&self, h: HalfEdgeId) -> VertexId {
        self.mesh.triangles[h.face().index()][h.side()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{repair, shapes};

    #[test]
    fn what_a_surface_knows_of_itself_stays_true() {
        for soup in [shapes::disk_with_holes(17, 3), shapes::ring_torus(9, 6), shapes::bow_tie(), shapes::sphere(5)] {
            let before = repair(&soup, &Default::default()).expect("a surface").mesh;
            let mut free = vec![true; before.triangles().len()];
            let mut editor = MeshEditor::new(before.clone());
            let mut split = 0;
            for (_, sides) in before.edges().iter() {
                let [g, h] = *sides else { continue };
                if free[g.face().index()] && free[h.face().index()] {
                    (free[g.face().index()], free[h.face().index()]) = (false, false);
                    let count = before.triangles().len() + 2 * split;
                    assert_eq!(editor.split_edge([g, h]), Some([FaceId::at(count), FaceId::at(count + 1)]));
                    split += 1;
                }
            }
            let after = editor.finish();
            after.assert_sound();
            let (old, new) = (before.topology_summary(), after.topology_summary());
            assert_eq!((new.triangles, new.vertices), (old.triangles + 2 * split, old.vertices + split));
            assert_eq!((new.euler, new.genus, new.boundary_loops), (old.euler, old.genus, old.boundary_loops));
            assert!((after.area() / before.area() - 1.0).abs() < 1e-13);
            let added: Vec<VertexId> = (before.points().len()..after.points().len()).map(VertexId::at).collect();
            assert!(added.len() == split && added.iter().all(|v| after.input_vertex(*v).is_none()));
        }
    }

    #[test]
    fn parts_without_area_are_not_made() {
        let points = vec![[0.0; 3], [1e-200, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]];
        let soup = crate::mesh::TriangleSoup::new(points, vec![[0, 1, 2], [1, 0, 3]]).expect("sound");
        let mut mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
        // As no mollification would leave it.
        mesh.metric.shapes[0].lengths[0] = 0.0;
        let mut editor = MeshEditor::new(mesh.clone());
        assert_eq!(editor.split_edge([HalfEdgeId(0), HalfEdgeId(3)]), None);
        let after = editor.finish();
        assert_eq!((after.topology_summary(), after.points().len()), (mesh.topology_summary(), 4));
        after.assert_sound();
    }

    #[test]
    #[should_panic(expected = "split twice")]
    fn a_triangle_that_was_split_has_other_half_edges() {
        let mesh = repair(&shapes::disk(3), &Default::default()).expect("a surface").mesh;
        let sides = mesh.edges().iter().map(|(_, sides)| sides);
        let inner: Vec<[HalfEdgeId; 2]> = sides.filter_map(|sides| sides.try_into().ok()).collect();
        let first = inner[0];
        let beside = inner[1..].iter().copied().find(|[g, _]| g.face() == first[0].face()).expect("another one");
        let mut editor = MeshEditor::new(mesh);
        editor.split_edge(first);
        editor.split_edge(beside);
    }
}
