//! The dual graph of a surface: triangles, joined where they share an edge along which both run consistently.

use super::voronoi::Graph;
use crate::mesh::SurfaceMesh;
use crate::monitor::{Checkpoint, Interrupted, Monitor};
use crate::topology::partition::Twins;
use crate::topology::union_find::UnionFind;
use crate::topology::{FaceId, HalfEdgeId, VertexId};
use crate::vec3::{Vec3, cross, distance, midpoint, sub};
use std::collections::BTreeMap;

const NONE: HalfEdgeId = HalfEdgeId(u32::MAX);

/// A half-edge: what searches ask for, side by side.
#[derive(Clone, Copy)]
struct Side {
    /// The half-edge on the other side, or [`NONE`].
    twin: HalfEdgeId,
    from: VertexId,
    /// The true length.
    length: f64,
}

/// A surface as decomposition sees it. Lengths are in the unit of the metric.
pub(super) struct Dual<'a> {
    pub mesh: &'a SurfaceMesh,
    /// The monitor of what is computed on the surface.
    pub checkpoint: Checkpoint<'a>,
    sides: Vec<Side>,
    /// Per edge 1 minus the cosine of its dihedral angle, at most 1, if it is a feature: no cell crosses it; else 0.
    pub sharpness: Vec<f64>,
    /// Per triangle, whether features keep apart what it lies in however small that is.
    pub is_kept: Vec<bool>,
    points: Vec<Vec3>,
    centroids: Vec<Vec3>,
    areas: Vec<f64>,
    /// The triangles that lie at the same place beyond an open half-edge: where triangles disagree about the
    /// orientation, and where repair took sheets apart. No chart has both.
    coincident_faces: BTreeMap<HalfEdgeId, Vec<FaceId>>,
    /// Per half-edge the distance of the centroids at its sides by way of its middle.
    steps: Vec<f64>,
    /// Per half-edge the angle of its triangle where it begins, by mollified lengths.
    angles: Vec<f64>,
}

/// The features of a surface: the fields of [`Dual`] of these names.
pub(super) struct Features {
    sharpness: Vec<f64>,
    is_kept: Vec<bool>,
}

impl<'a> Dual<'a> {
    pub(super) fn new(mesh: &'a SurfaceMesh, monitor: &'a dyn Monitor) -> Self {
        let scale = mesh.metric().scale;
        let points: Vec<Vec3> = mesh.points().iter().map(|p| p.map(|c| c * scale)).collect();
        let triangles = mesh.triangles();
        let from = |h: HalfEdgeId| triangles[h.face().index()][h.side()];
        // Two half-edges from the same vertex run the same way: their triangles disagree about the orientation.
        let twin = |h: HalfEdgeId| mesh.edges().twin(h).filter(|t| from(*t) != from(h)).unwrap_or(NONE);
        let length = |h: HalfEdgeId| distance(points[from(h).index()], points[from(h.next()).index()]);
        let side = |h| Side { twin: twin(h), from: from(h), length: length(h) };
        let centroid = |t: &[VertexId; 3]| {
            let [a, b, c] = t.map(|v| points[v.index()]);
            [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
        };
        let mut made = Self {
            sides: (0..3 * triangles.len()).map(|h| side(HalfEdgeId::at(h))).collect(),
            sharpness: vec![0.0; mesh.edges().len()],
            is_kept: vec![false; triangles.len()],
            centroids: triangles.iter().map(centroid).collect(),
            areas: mesh.metric().shapes.iter().map(|s| s.area()).collect(),
            steps: Vec::new(),
            angles: mesh.metric().shapes.iter().flat_map(|s| s.angles()).collect(),
            coincident_faces: BTreeMap::new(),
            mesh,
            checkpoint: Checkpoint::new(monitor),
            points,
        };
        made.coincident_faces = made.find_coincident_faces();
        made.steps = made.half_edges().map(|h| made.step(h)).collect();
        made
    }

    /// The features that were marked.
    pub(super) fn into_features(self) -> Features {
        let Self { sharpness, is_kept, .. } = self;
        Features { sharpness, is_kept }
    }

    /// A part of the surface `whole`, which consists of these faces of it, with the features that were marked there.
    pub(super) fn of_part(
        part: &'a SurfaceMesh,
        faces: &[FaceId],
        whole: &SurfaceMesh,
        features: &Features,
        monitor: &'a dyn Monitor,
    ) -> Self {
        let mut made = Self::new(part, monitor);
        for (local, face) in faces.iter().enumerate() {
            made.is_kept[local] = features.is_kept[face.index()];
            for (h, there) in FaceId::at(local).sides().into_iter().zip(face.sides()) {
                made.set_sharpness(h, features.sharpness[whole.edges().edge(there).index()]);
            }
        }
        made
    }

    /// A safe point, after all triangles were looked at.
    pub(super) fn checkpoint(&self) -> Result<(), Interrupted> {
        self.checkpoint.after(self.areas.len())
    }

    fn find_coincident_faces(&self) -> BTreeMap<HalfEdgeId, Vec<FaceId>> {
        let mut open: Vec<([u32; 2], HalfEdgeId)> = Vec::new();
        for h in self.half_edges().filter(|h| self.twin(*h).is_none()) {
            // Sheets that repair took apart have vertices of their own, and may run either way along the edge.
            let mut ends = [self.from(h), self.to(h)].map(|v| self.mesh.welded_vertex(VertexId::at(v)));
            ends.sort_unstable();
            open.push((ends, h));
        }
        open.sort_unstable();
        // Open half-edges between the same two welded vertices lie at one place; most are alone there.
        let mut coincident = BTreeMap::new();
        for at_one_place in open.chunk_by(|g, h| g.0 == h.0).filter(|all| all.len() > 1) {
            for (_, h) in at_one_place {
                let others = at_one_place.iter().filter(|(_, g)| g != h);
                coincident.insert(*h, others.map(|(_, g)| g.face()).collect());
            }
        }
        coincident
    }

    /// The triangles that lie beyond `h` without being joined to it.
    pub(super) fn coincident_faces(&self, h: HalfEdgeId) -> &[FaceId] {
        self.coincident_faces.get(&h).map_or(&[], Vec::as_slice)
    }

    /// All half-edges with such triangles.
    pub(super) fn coincidences(&self) -> impl Iterator<Item = (HalfEdgeId, &[FaceId])> {
        self.coincident_faces.iter().map(|(h, faces)| (*h, faces.as_slice()))
    }

    fn step(&self, h: HalfEdgeId) -> f64 {
        let m = self.middle(h);
        let reach = |f: FaceId| distance(self.centroids[f.index()], m);
        reach(h.face()) + self.twin(h).map_or(0.0, |t| reach(t.face()))
    }

    /// The half-edge on the other side, running the other way; none at the boundary, and where the triangles
    /// disagree about the orientation.
    pub(super) fn twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId> {
        Some(self.sides[h.index()].twin).filter(|t| *t != NONE)
    }

    /// Whether the edge along `h` is a feature.
    pub(super) fn is_feature(&self, h: HalfEdgeId) -> bool {
        self.sharpness(h) > 0.0
    }

    /// See the field of this name.
    pub(super) fn sharpness(&self, h: HalfEdgeId) -> f64 {
        self.sharpness[self.mesh.edges().edge(h).index()]
    }

    /// Makes the edge along `h` a feature that is so sharp, or none.
    pub(super) fn set_sharpness(&mut self, h: HalfEdgeId, sharpness: f64) {
        self.sharpness[self.mesh.edges().edge(h).index()] = sharpness;
    }

    /// The vertex at which `h` begins.
    pub(super) fn from(&self, h: HalfEdgeId) -> usize {
        self.sides[h.index()].from.index()
    }

    /// The vertex at which `h` ends.
    pub(super) fn to(&self, h: HalfEdgeId) -> usize {
        self.from(h.next())
    }

    /// Whether a path along half-edges, which is not empty, ends where it began.
    pub(super) fn is_closed(&self, path: &[HalfEdgeId]) -> bool {
        self.from(path[0]) == self.to(path[path.len() - 1])
    }

    pub(super) fn point(&self, vertex: usize) -> Vec3 {
        self.points[vertex]
    }

    pub(super) fn centroid(&self, face: usize) -> Vec3 {
        self.centroids[face]
    }

    /// The mollified area of all triangles.
    pub(super) fn total_area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// The mollified area.
    pub(super) fn area(&self, face: usize) -> f64 {
        self.areas[face]
    }

    /// The angle of the triangle of `h` at the vertex where `h` begins, in radians.
    pub(super) fn angle(&self, h: HalfEdgeId) -> f64 {
        self.angles[h.index()]
    }

    /// The normal times the doubled true area.
    pub(super) fn area_vector(&self, face: usize) -> Vec3 {
        let [a, b, c] = self.mesh.triangles()[face].map(|v| self.points[v.index()]);
        cross(sub(b, a), sub(c, a))
    }

    /// The true length of the edge along `h`.
    pub(super) fn length(&self, h: HalfEdgeId) -> f64 {
        self.sides[h.index()].length
    }

    /// The middle of the edge along `h`.
    pub(super) fn middle(&self, h: HalfEdgeId) -> Vec3 {
        midpoint(self.points[self.from(h)], self.points[self.to(h)])
    }

    /// The triangles, united with those neighbours with which they are `together`: told of the half-edge between them
    /// and its other side.
    pub(super) fn united(&self, together: impl Fn(HalfEdgeId, HalfEdgeId) -> bool) -> UnionFind {
        let mut sets = UnionFind::new(self.centroids.len());
        for h in self.half_edges() {
            if let Some(twin) = self.twin(h).filter(|twin| together(h, *twin)) {
                sets.merge(h.face().index(), twin.face().index());
            }
        }
        sets
    }

    pub(super) fn half_edges(&self) -> impl Iterator<Item = HalfEdgeId> + use<> {
        (0..self.sides.len() as u32).map(HalfEdgeId)
    }
}

impl Twins for Dual<'_> {
    fn twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId> {
        self.twin(h)
    }
}

impl Graph for Dual<'_> {
    fn len(&self) -> usize {
        self.centroids.len()
    }

    /// Neighbours across edges that are no features, at the distance of the centroids by way of the edge's middle.
    fn each_neighbour(&self, face: usize, mut visit: impl FnMut(usize, f64)) {
        for h in (0..3).map(|k| HalfEdgeId::side_of(FaceId::at(face), k)) {
            let Some(other) = self.twin(h).filter(|_| !self.is_feature(h)) else { continue };
            visit(other.face().index(), self.steps[h.index()]);
        }
    }
}
