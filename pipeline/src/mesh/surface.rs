//! A repaired surface.

use super::Metric;
use crate::topology::{EdgeTable, FaceId, TopologySummary, VertexId};
use crate::vec3::{BoundingBox, Vec3, triangle_area};

/// A mesh gets at least this many edges along the diagonal of the bounding box, unless another size is asked for: CAD parts
/// of a dozen facets would keep theirs otherwise.
const EDGES_PER_DIAGONAL: f64 = 50.0;

/// A triangulated surface after repair: no triangle repeats a vertex or another triangle, orientable components
/// are oriented, and every sheet that met others at non-manifold edges or vertices has vertices of its own. Made by
/// [`crate::repair()`].
///
/// ```
/// use planish_core::topology::VertexId;
/// use planish_core::{repair, shapes};
///
/// let soup = shapes::book(3, 4);
/// let mesh = repair(&soup, &repair::Settings::default())?.mesh;
/// // Each of the three pages has a spine of its own, 5 vertices long. That they were one is still told.
/// assert_eq!(mesh.points().len(), soup.points().len() + 2 * 5);
/// assert_eq!(mesh.welded_vertex(VertexId(0)), mesh.welded_vertex(VertexId(1)));
/// let summary = mesh.topology_summary();
/// assert_eq!((summary.components, summary.nonmanifold_edges), (3, 4));
/// # Ok::<(), repair::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct SurfaceMesh {
    pub(super) points: Vec<Vec3>,
    pub(super) triangles: Vec<[VertexId; 3]>,
    pub(super) source: Vec<u32>,
    pub(super) welded: Vec<u32>,
    /// Vertices from this one on are not of the input.
    pub(super) added_from: usize,
    /// How many triangles refinement added.
    pub(super) by_refinement: usize,
    pub(super) edges: EdgeTable,
    pub(super) summary: TopologySummary,
    pub(super) metric: Metric,
}

/// What a surface is made of. See [`SurfaceMesh`] for what must hold, and its methods for what each of these is.
pub(crate) struct SurfaceParts {
    pub points: Vec<Vec3>,
    pub triangles: Vec<[VertexId; 3]>,
    pub source: Vec<u32>,
    pub welded: Vec<u32>,
    pub added_from: usize,
    pub edges: EdgeTable,
    pub metric: Metric,
}

/// Where the sheets of a surface met before each was given vertices of its own: that is to become seams, and is counted for
/// the surface still.
#[derive(Clone, Copy)]
pub(crate) struct Sheets {
    /// Edges at which three or more triangles met.
    pub nonmanifold_edges: usize,
    /// Vertices at which a sheet touches others away from its boundary.
    pub nonmanifold_vertices: usize,
}

/// What is known of a part of a surface beside its connectivity and its lengths.
#[derive(Clone, Debug)]
pub(crate) struct Patch {
    /// Per vertex, its position.
    pub points: Vec<Vec3>,
    /// Per vertex, the welded vertex that it is a copy of.
    pub welded: Vec<u32>,
    /// Per triangle, its position in the input.
    pub source: Vec<u32>,
    /// Vertices from this one on are not of the input.
    pub added_from: usize,
    /// What mollification added to the lengths of the surface.
    pub mollified_by: f64,
}

impl SurfaceMesh {
    /// A surface of these parts, counted, unless its triangles are `counted` already.
    pub(crate) fn new(parts: SurfaceParts, sheets: Sheets, counted: Option<TopologySummary>) -> Self {
        let SurfaceParts { points, triangles, source, welded, added_from, edges, metric } = parts;
        let counted = counted.unwrap_or_else(|| TopologySummary::new(&triangles, &edges));
        let Sheets { nonmanifold_edges, nonmanifold_vertices } = sheets;
        let summary = TopologySummary { nonmanifold_edges, nonmanifold_vertices, ..counted };
        Self { points, triangles, source, welded, added_from, by_refinement: 0, edges, summary, metric }
    }

    /// Checks what the surface knows of itself against what its triangles tell.
    #[cfg(test)]
    pub(crate) fn assert_sound(&self) {
        let edges = EdgeTable::new(&self.triangles);
        assert!(self.edges.iter().eq(edges.iter()), "edges");
        let TopologySummary { nonmanifold_edges, nonmanifold_vertices, .. } = self.summary;
        let anew = TopologySummary {
            nonmanifold_edges,
            nonmanifold_vertices,
            ..TopologySummary::new(&self.triangles, &edges)
        };
        assert_eq!(self.summary, anew);
        let faces = self.triangles.len();
        assert_eq!((self.source.len(), self.metric.shapes.len(), self.metric.flagged.len()), (faces, faces, faces));
        assert_eq!((self.welded.len(), self.summary.vertices), (self.points.len(), self.points.len()));
    }

    /// The positions of the vertices, in the unit of the input.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[VertexId; 3]] {
        &self.triangles
    }

    /// The position in the input file of triangle `face`.
    pub fn source_triangle(&self, face: usize) -> u32 {
        self.source[face]
    }

    /// The welded vertex that `vertex` is a copy of: vertices of the input, bit-equal ones merged, in the
    /// order of their first appearance.
    pub fn welded_vertex(&self, vertex: VertexId) -> u32 {
        self.welded[vertex.index()]
    }

    /// The welded vertex, unless `vertex` was added: then it has a number there that no vertex of the input has.
    pub fn input_vertex(&self, vertex: VertexId) -> Option<u32> {
        (vertex.index() < self.added_from).then(|| self.welded[vertex.index()])
    }

    /// The edges.
    pub fn edges(&self) -> &EdgeTable {
        &self.edges
    }

    /// The counts after splitting; but `nonmanifold_edges` are those that were split, and `nonmanifold_vertices`
    /// those at which a sheet touches others away from its boundary.
    pub fn topology_summary(&self) -> &TopologySummary {
        &self.summary
    }

    /// The intrinsic metric.
    pub fn metric(&self) -> &Metric {
        &self.metric
    }

    /// The corners of a triangle in space.
    pub fn corners(&self, face: usize) -> [Vec3; 3] {
        self.triangles[face].map(|v| self.points[v.index()])
    }

    /// The part with these vertices and faces, both ascending.
    pub(crate) fn patch(&self, vertices: &[VertexId], faces: &[FaceId]) -> Patch {
        Patch {
            points: vertices.iter().map(|v| self.points[v.index()]).collect(),
            welded: vertices.iter().map(|v| self.welded[v.index()]).collect(),
            source: faces.iter().map(|f| self.source[f.index()]).collect(),
            added_from: vertices.partition_point(|v| v.index() < self.added_from),
            mollified_by: self.metric.mollified_by,
        }
    }

    /// The same surface, whose sheets met so often.
    pub(crate) fn of_sheets(mut self, sheets: Sheets) -> Self {
        self.summary.nonmanifold_edges = sheets.nonmanifold_edges;
        self.summary.nonmanifold_vertices = sheets.nonmanifold_vertices;
        self
    }

    /// Per vertex, the welded vertex that it is a copy of.
    pub(crate) fn welded(&self) -> &[u32] {
        &self.welded
    }

    /// The surface of some faces, ascending, which hold all triangles around each of their edges. Where its sheets met is
    /// still to be counted ([`Self::of_sheets`]).
    pub(crate) fn restricted(&self, faces: &[FaceId]) -> Self {
        let mut is_used = vec![false; self.points.len()];
        faces.iter().flat_map(|f| self.triangles[f.index()]).for_each(|v| is_used[v.index()] = true);
        let vertices: Vec<VertexId> = (0..is_used.len()).filter(|v| is_used[*v]).map(VertexId::at).collect();
        let mut number = vec![VertexId(u32::MAX); self.points.len()];
        vertices.iter().zip(0..).for_each(|(v, n)| number[v.index()] = VertexId(n));
        let triangles = faces.iter().map(|f| self.triangles[f.index()].map(|v| number[v.index()])).collect();
        let local = |f: FaceId| faces.binary_search(&f).ok().map(FaceId::at);
        let metric = Metric {
            shapes: faces.iter().map(|f| self.metric.shapes[f.index()]).collect(),
            flagged: faces.iter().map(|f| self.metric.flagged[f.index()]).collect(),
            mollified_by: self.metric.mollified_by,
            scale: self.metric.scale,
        };
        Self::of_patch(triangles, self.edges.part(faces, local), metric, self.patch(&vertices, faces))
    }

    /// A part as a surface of its own.
    pub(crate) fn of_patch(triangles: Vec<[VertexId; 3]>, edges: EdgeTable, metric: Metric, patch: Patch) -> Self {
        let Patch { points, welded, source, added_from, .. } = patch;
        let summary = TopologySummary::new(&triangles, &edges);
        Self { points, triangles, source, welded, added_from, by_refinement: 0, edges, summary, metric }
    }

    /// The total true area, in the unit of the input, squared.
    pub fn area(&self) -> f64 {
        // Products of coordinates may overflow or underflow where the area itself does not.
        let scale = self.metric.scale;
        let scaled = |f: usize| triangle_area(self.corners(f).map(|p| p.map(|c| c * scale)));
        (0..self.triangles.len()).map(scaled).sum::<f64>() / scale / scale
    }

    /// The same surface, to which refinement added so many of its triangles.
    pub(crate) fn refined_by(self, triangles: usize) -> Self {
        Self { by_refinement: triangles, ..self }
    }

    /// The length of edges of a mesh like this one, in the unit of the input: that of as many equilateral triangles of the
    /// same area, but at most a fiftieth of the diagonal of the bounding box. What refinement added does not count.
    pub fn default_size(&self) -> f64 {
        let coarsest = self.bounding_box().diagonal() / EDGES_PER_DIAGONAL;
        let share = self.area() / (self.triangles.len() - self.by_refinement) as f64;
        let edge = (share * 4.0 / 3.0_f64.sqrt()).sqrt();
        if edge > 0.0 { edge.min(coarsest) } else { coarsest }
    }

    /// The smallest box around the surface.
    pub fn bounding_box(&self) -> BoundingBox {
        let origin = BoundingBox { min: [0.0; 3], max: [0.0; 3] };
        BoundingBox::of(self.points.iter().copied()).unwrap_or(origin)
    }
}
