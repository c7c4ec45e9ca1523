//! A repaired surface.

use super::Metric;
use crate::topology::{EdgeTable, FaceId, TopologySummary, VertexId};
use crate::vec3::{BoundingBox, Vec3, triangle_area};
use std::sync::Arc;

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
    /// Per triangle of the input, its label; empty where there are none.
    pub(super) labels: Arc<[u32]>,
    /// Per vertex, the size that is asked for there, infinite for none; empty where there are none.
    pub(super) sizes: Vec<f64>,
    pub(super) welded: Vec<u32>,
    /// Vertices from this one on are not of the input.
    pub(super) added_from: usize,
    /// Per vertex from there on, the welded vertices half-way between which it lies.
    pub(super) middles: Vec<WeldedEnds>,
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
    pub labels: Arc<[u32]>,
    pub sizes: Vec<f64>,
    pub welded: Vec<u32>,
    pub added_from: usize,
    pub middles: Vec<WeldedEnds>,
    pub edges: EdgeTable,
    pub metric: Metric,
}

/// The ends of an edge as welded vertices, the smaller first: the same for all copies of the edge.
pub(crate) type WeldedEnds = [u32; 2];

/// The ends of an edge, in their order.
pub(crate) fn welded_ends([a, b]: [u32; 2]) -> WeldedEnds {
    [a.min(b), a.max(b)]
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
    /// Per vertex from there on, the welded vertices half-way between which it lies.
    pub middles: Vec<WeldedEnds>,
    /// What mollification added to the lengths of the surface.
    pub mollified_by: f64,
}

/// Adds the size in the middle between two vertices, where there are sizes.
pub(crate) fn push_mean(sizes: &mut Vec<f64>, ends: [VertexId; 2]) {
    if !sizes.is_empty() {
        let [a, b] = ends.map(|v| sizes[v.index()]);
        sizes.push(0.5 * a + 0.5 * b);
    }
}

impl SurfaceMesh {
    /// A surface of these parts, counted, unless its triangles are `counted` already.
    pub(crate) fn new(parts: SurfaceParts, sheets: Sheets, counted: Option<TopologySummary>) -> Self {
        let SurfaceParts { points, triangles, source, labels, sizes, welded, added_from, middles, edges, metric } =
            parts;
        let counted = counted.unwrap_or_else(|| TopologySummary::new(&triangles, &edges));
        let Sheets { nonmanifold_edges, nonmanifold_vertices } = sheets;
        let summary = TopologySummary { nonmanifold_edges, nonmanifold_vertices, ..counted };
        let by_refinement = 0;
        Self {
            points,
            triangles,
            source,
            labels,
            sizes,
            welded,
            added_from,
            middles,
            by_refinement,
            edges,
            summary,
            metric,
        }
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
        assert!(self.sizes.is_empty() || self.sizes.len() == self.points.len(), "sizes");
        assert_eq!(self.added_from + self.middles.len(), self.points.len(), "middles");
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

    /// The label of triangle `face`; none where the input has no labels.
    pub fn label(&self, face: usize) -> Option<u32> {
        self.labels.get(self.source[face] as usize).copied()
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

    /// Of a vertex that was added, the two welded vertices half-way between which it lies, the smaller first; none of one of
    /// the input. Vertices that stand for them come before it, so that what is known at the points of the input
    /// ([`crate::repair::first_points`]) can be carried to all vertices in their order.
    ///
    /// ```
    /// use planish_core::monitor::NoMonitor;
    /// use planish_core::topology::VertexId;
    /// use planish_core::{Plan, Settings, mesh::TriangleSoup, repair};
    ///
    /// // A square of two triangles, each of which is an ear: their common edge is split.
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let soup = TriangleSoup::new(points, vec![[0, 1, 2], [0, 2, 3]])?;
    /// let settings = Settings::default();
    /// let mesh = repair(&soup, &settings.repair)?.accepted()?.mesh;
    /// let mesh = Plan::new(mesh, &settings, &NoMonitor)?.mesh;
    /// assert_eq!((mesh.middle_of(VertexId(0)), mesh.middle_of(VertexId(4))), (None, Some([0, 2])));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn middle_of(&self, vertex: VertexId) -> Option<[u32; 2]> {
        vertex.index().checked_sub(self.added_from).map(|added| self.middles[added])
    }

    /// The welded vertices at the ends of an edge.
    pub(super) fn welded_ends(&self, ends: [VertexId; 2]) -> WeldedEnds {
        welded_ends(ends.map(|v| self.welded[v.index()]))
    }

    /// The length of edges that the input asks for at `vertex` ([`crate::mesh::TriangleSoup::with_sizes`]): of points that became
    /// one, the least; at a vertex that was added in the middle of an edge, the mean of its ends. None where it asks for nothing.
    pub fn given_size(&self, vertex: VertexId) -> Option<f64> {
        self.sizes.get(vertex.index()).copied().filter(|size| size.is_finite())
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
        let added_from = vertices.partition_point(|v| v.index() < self.added_from);
        Patch {
            points: vertices.iter().map(|v| self.points[v.index()]).collect(),
            welded: vertices.iter().map(|v| self.welded[v.index()]).collect(),
            source: faces.iter().map(|f| self.source[f.index()]).collect(),
            added_from,
            middles: vertices[added_from..].iter().filter_map(|v| self.middle_of(*v)).collect(),
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
        // What it costs depends on the part alone.
        let vertices = vertices_of(&self.triangles, faces);
        let number = |v: VertexId| VertexId::at(vertices.partition_point(|w| *w < v));
        let triangles = faces.iter().map(|f| self.triangles[f.index()].map(number)).collect();
        let local = |f: FaceId| faces.binary_search(&f).ok().map(FaceId::at);
        let metric = Metric {
            shapes: faces.iter().map(|f| self.metric.shapes[f.index()]).collect(),
            flagged: faces.iter().map(|f| self.metric.flagged[f.index()]).collect(),
            mollified_by: self.metric.mollified_by,
            scale: self.metric.scale,
        };
        let part = Self::of_patch(triangles, self.edges.part(faces, local), metric, self.patch(&vertices, faces));
        let sizes = vertices.iter().filter_map(|v| self.sizes.get(v.index()).copied()).collect();
        Self { labels: self.labels.clone(), sizes, ..part }
    }

    /// A part as a surface of its own.
    pub(crate) fn of_patch(triangles: Vec<[VertexId; 3]>, edges: EdgeTable, metric: Metric, patch: Patch) -> Self {
        let Patch { points, welded, source, added_from, middles, .. } = patch;
        let summary = TopologySummary::new(&triangles, &edges);
        let (labels, sizes, by_refinement) = (Arc::default(), Vec::new(), 0);
        Self {
            points,
            triangles,
            source,
            labels,
            sizes,
            welded,
            added_from,
            middles,
            by_refinement,
            edges,
            summary,
            metric,
        }
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

    /// The largest of the lengths of edges that the input asks for; none where it asks for none.
    fn largest_given_size(&self) -> Option<f64> {
        self.sizes.iter().copied().filter(|size| size.is_finite()).reduce(f64::max)
    }

    /// The length of edges of a mesh of this surface, in the unit of the input: the largest that the input asks for. Where it asks
    /// for none, that of as many equilateral triangles of the same area, but at most a fiftieth of the diagonal of the bounding
    /// box. What refinement added does not count.
    pub fn default_size(&self) -> f64 {
        if let Some(largest) = self.largest_given_size() {
            return largest;
        }
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

/// The vertices of some triangles, ascending.
pub(crate) fn vertices_of(triangles: &[[VertexId; 3]], faces: &[FaceId]) -> Vec<VertexId> {
    let mut vertices: Vec<VertexId> = faces.iter().flat_map(|f| triangles[f.index()]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::mesh::bisect::halve;
    use crate::mesh::edit::MeshEditor;
    use crate::topology::{EdgeId, HalfEdgeId};
    use crate::{repair, shapes};

    /// A size that is linear in space, so that means in the middle of edges are its values there.
    fn linear([x, y, z]: Vec3) -> f64 {
        10.0 + x + 2.0 * y + 3.0 * z
    }

    fn sized(soup: &TriangleSoup) -> TriangleSoup {
        soup.clone().with_sizes(soup.points().iter().map(|p| linear(*p)).collect())
    }

    fn assert_linear(mesh: &SurfaceMesh) {
        assert_eq!(mesh.sizes.len(), mesh.points.len());
        for (v, point) in mesh.points().iter().enumerate() {
            let (given, expected) = (mesh.given_size(VertexId::at(v)).expect("a size"), linear(*point));
            // Where cracks are closed, points move by less than a millionth.
            assert!((given - expected).abs() <= 1e-6 * expected, "{given} for {expected} at {point:?}");
        }
    }

    /// Values at the points of the input, carried to all vertices in their order: those of a linear function stay its values.
    fn assert_carried(soup: &TriangleSoup, mesh: &SurfaceMesh) {
        let first = repair::first_points(soup.points());
        let highest = mesh.welded.iter().max().map_or(0, |welded| *welded as usize);
        let mut values = vec![f64::NAN; highest + 1];
        for (v, point) in mesh.points().iter().enumerate().map(|(v, point)| (VertexId::at(v), point)) {
            let welded = mesh.welded_vertex(v);
            values[welded as usize] = match mesh.middle_of(v) {
                Some(ends) => ends.into_iter().map(|end| 0.5 * values[end as usize]).sum(),
                None => linear(soup.points()[first[welded as usize] as usize]),
            };
            let (carried, expected) = (values[welded as usize], linear(*point));
            assert!((carried - expected).abs() <= 1e-12 * expected, "{carried} for {expected} at {point:?}");
            assert_eq!(mesh.middle_of(v).is_none(), mesh.input_vertex(v).is_some());
        }
    }

    /// Edges are split thrice over, also those of two sheets, and those along which sheets meet inside a sheet.
    #[test]
    fn what_is_known_at_points_can_be_carried_to_all_vertices() {
        let mut added = 0;
        for soup in [shapes::book(3, 4), shapes::cracked_patch(), shapes::sphere(5), shapes::bow_tie(), fin()] {
            let labels = (0..soup.triangles().len() as u32).map(|t| t % 3).collect();
            let mesh = repair(&soup.clone().with_labels(labels), &Default::default()).expect("a surface").mesh;
            let mut mesh = mesh.cut_between_labels();
            for _ in 0..3 {
                let some: Vec<Vec<EdgeId>> = mesh.edges().iter().step_by(3).map(|(edge, _)| vec![edge]).collect();
                mesh = halve(mesh, &some).mesh;
            }
            assert_eq!(mesh.added_from + mesh.middles.len(), mesh.points().len());
            assert_carried(&soup, &mesh);
            let all: Vec<FaceId> = (0..mesh.triangles().len()).map(FaceId::at).collect();
            let part = mesh.restricted(&all);
            assert_eq!(part.middles, mesh.middles);
            assert_carried(&soup, &part);
            added += mesh.middles.len();
        }
        assert!(added > 100, "{added}");
    }

    /// A triangle on the middle of a square: it meets the sheet along a single edge inside that, which is halved.
    fn fin() -> TriangleSoup {
        let rim = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [3.0, 3.0, 0.0], [0.0, 3.0, 0.0]];
        let points = [&rim[..], &[[1.0, 1.5, 0.0], [2.0, 1.5, 0.0], [1.5, 1.5, 1.0]]].concat();
        let triangles = vec![[0, 1, 4], [1, 5, 4], [1, 2, 5], [2, 3, 5], [3, 4, 5], [3, 0, 4], [4, 5, 6]];
        TriangleSoup::new(points, triangles).expect("a soup")
    }

    /// Whatever becomes of vertices: sheets, borders of labels, parts, halved edges.
    #[test]
    fn sizes_follow_the_vertices() {
        for soup in [shapes::book(3, 4), shapes::cracked_patch(), shapes::sphere(5), shapes::bow_tie()] {
            let mesh = repair(&sized(&soup), &Default::default()).expect("a surface").mesh;
            assert_linear(&mesh);
            let labels = (0..soup.triangles().len() as u32).map(|t| t % 3).collect();
            let labelled = repair(&sized(&soup).with_labels(labels), &Default::default()).expect("a surface").mesh;
            assert_linear(&labelled.cut_between_labels());
            let inner = mesh.edges().iter().find_map(|(_, sides)| <[HalfEdgeId; 2]>::try_from(sides).ok());
            let mut editor = MeshEditor::new(mesh.clone());
            if let Some(edge) = inner {
                editor.split_edge(edge).expect("parts with area");
            }
            assert_linear(&editor.finish());
            let half: Vec<Vec<EdgeId>> = mesh.edges().iter().step_by(2).map(|(edge, _)| vec![edge]).collect();
            assert_linear(&halve(mesh.clone(), &half).mesh);
            let all: Vec<FaceId> = (0..mesh.triangles().len()).map(FaceId::at).collect();
            assert_linear(&mesh.restricted(&all));
        }
    }

    /// Points that no triangle uses do not count, and what is asked for nowhere is none.
    #[test]
    fn points_that_are_merged_have_the_least_of_their_sizes() {
        let points = vec![[0.0; 3], [9.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-0.0; 3], [0.0, -1.0, 0.0]];
        let soup = TriangleSoup::new(points, vec![[0, 2, 3], [4, 5, 2]]).expect("a soup");
        let given = |sizes: [f64; 6]| {
            let mesh = repair(&soup.clone().with_sizes(sizes.to_vec()), &Default::default()).expect("a surface").mesh;
            ([0, 1, 2, 3].map(|v| mesh.given_size(VertexId(v))), mesh.default_size())
        };
        let (found, largest) = given([0.5, 99.0, 2.0, 3.0, 0.25, f64::NAN]);
        assert_eq!((found, largest), ([Some(0.25), Some(2.0), Some(3.0), None], 3.0));
        let (found, usual) = given([-1.0, 99.0, 0.0, f64::INFINITY, 5e-324, f64::NAN]);
        let without = repair(&soup, &Default::default()).expect("a surface").mesh;
        assert_eq!((found, usual), ([None; 4], without.default_size()));
    }
}
