//! Repair: soup -> surface mesh.
//!
//! 1. Vertices with bit-equal coordinates are merged (the sign of zero does not count).
//! 2. Triangles with two equal vertices, and copies of a triangle, are dropped.
//! 3. T-junctions are closed: triangles are split where vertices of another side lie on their open edges. Then cracks are:
//!    open edges that run side by side within a tolerance (see [`Settings::weld`]).
//! 4. Every orientable component is oriented like the majority of its triangles.
//! 5. Triangles lower than that tolerance are removed where the surface stays what it is: an edge is collapsed or flipped.
//! 6. The surface is split along non-manifold edges, and where sheets only touch in a vertex: every sheet gets
//!    vertices of its own.
//! 7. Edge lengths are mollified where triangles are degenerate ([`crate::mesh::Metric`]).
//!
//! Everything that was found and done is counted, with the first few ids. The summary of the result still counts
//! the non-manifold edges that were split, and the vertices at which a sheet touches others away from its
//! boundary: both have to become seams. What cannot be a surface at all (no triangle is left) is refused, and what nobody
//! wants charts of ([`Repaired::accepted`]).

mod cracks;
mod near;
mod sheets;
mod slivers;
mod t_junctions;
pub(crate) mod weld;

use crate::mesh::{Metric, Sheets, SurfaceMesh, SurfaceParts, TriangleSoup, WeldedEnds, push_mean, welded_ends};
use crate::topology::{EdgeTable, TopologySummary, VertexFans};
use crate::topology::{FaceId, HalfEdgeId, VertexId};
use crate::vec3::{BoundingBox, Vec3, midpoint, unit_scale};
pub use sheets::{Accepted, RefusedComponent};
use sheets::{MAX_SHEETS, MAX_TINY_SHEETS, TINY_SHEET};
use std::sync::Arc;
use t_junctions::Boundary;
pub use weld::first_points;

/// What repair may do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Open edges closer than this, relative to the diagonal of the bounding box, are joined, and split at vertices of
    /// others that are no farther from them; triangles lower than this are removed. In `[0, 0.01]`; 0 joins and removes none,
    /// and splits at vertices that lie on edges within the rounding of doubles. Default 1e-6.
    pub weld: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { weld: 1e-6 }
    }
}

/// A number of things found, and the first few of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Sample {
    /// How many.
    pub count: usize,
    /// The first ids, at most eight: positions in the input file.
    pub first: Vec<u32>,
}

impl Sample {
    const SHOWN: usize = 8;

    fn push(&mut self, id: u32) {
        self.count += 1;
        if self.first.len() < Self::SHOWN {
            self.first.push(id);
        }
    }

    fn of(ids: impl IntoIterator<Item = u32>) -> Self {
        let mut found = Self::default();
        ids.into_iter().for_each(|id| found.push(id));
        found
    }
}

/// What repair found and did.
///
/// ```
/// use planish_core::{mesh::TriangleSoup, repair};
///
/// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// // The second triangle is turned over, the third a copy of the first, and the last one has two equal corners.
/// let soup = TriangleSoup::new(points, vec![[0, 1, 2], [0, 3, 2], [1, 2, 0], [3, 3, 0]])?;
/// let report = repair(&soup, &repair::Settings::default())?.report;
/// assert_eq!(report.flipped_triangles.first, [1]);
/// assert_eq!(report.duplicate_triangles.first, [2]);
/// assert_eq!(report.degenerate_triangles.first, [3]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Points merged into a bit-equal one.
    pub welded: usize,
    /// Points that no triangle uses.
    pub unreferenced_points: usize,
    /// Vertices (after welding) that lay on open edges of other triangles, which were split there.
    pub t_junctions_closed: Sample,
    /// Vertices (after welding) on the boundary that lie on an open edge still.
    pub t_junctions_left: Sample,
    /// Triangles of the surface beyond one for each of the input: parts of those that were split.
    pub triangles_added: usize,
    /// Pairs of open edges joined.
    pub cracks_closed: usize,
    /// Copies of a triangle, removed.
    pub duplicate_triangles: Sample,
    /// Triangles with two equal vertices, removed.
    pub degenerate_triangles: Sample,
    /// Triangles turned over.
    pub flipped_triangles: Sample,
    /// Triangles with an edge below the tolerance that was collapsed.
    pub needles_collapsed: Sample,
    /// Triangles lower than the tolerance whose longest edge was flipped.
    pub caps_flipped: Sample,
    /// The farthest that a point of the surface moved with these, in the unit of the input; below the tolerance.
    pub slivers_moved_by: f64,
    /// Single edges along which sheets meet inside a sheet, halved so that they can be seams.
    pub slits_opened: usize,
    /// Vertices (after welding) that were given to several sheets.
    pub split_vertices: Sample,
    /// What was added to every intrinsic edge length, in the unit of the input.
    pub mollified_by: f64,
    /// Triangles whose area mollification changed by more than 1 %.
    pub mollified_triangles: Sample,
}

/// A repaired surface with the account of its repair.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The surface.
    pub mesh: SurfaceMesh,
    /// The counts before repair: bit-equal vertices merged, triangles with two equal vertices left out.
    pub raw: TopologySummary,
    /// What was done.
    pub report: Report,
}

/// Why a soup is no surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Every triangle has two equal vertices.
    #[error(
        "all {triangles} triangles are degenerate (two corners coincide); check the unit and precision of the export"
    )]
    OnlyDegenerate {
        /// How many triangles there were.
        triangles: usize,
    },
    /// Non-manifold edges cut the surface into more sheets than anybody wants charts.
    #[error(
        "{nonmanifold_edges} edges of three or more triangles cut {triangles} triangles into {sheets} sheets, as the faces \
         of volume elements (tetrahedra, hexahedra) do; export the boundary of the volume only (at most {MAX_SHEETS} sheets, \
         or {MAX_TINY_SHEETS} of fewer than {TINY_SHEET} triangles on average)"
    )]
    VolumeElements {
        /// How many sheets there are beyond the parts of the input.
        sheets: usize,
        /// How many triangles there are.
        triangles: usize,
        /// Edges of three or more triangles.
        nonmanifold_edges: usize,
        /// The first vertices (after welding) at which sheets meet.
        vertices: Vec<u32>,
    },
    /// All components together have more sheets than anybody wants charts, and this one has the smallest.
    #[error(
        "it has {sheets} sheets more than one in {triangles} triangles, and with the other components there are {in_all} (at \
         most {MAX_SHEETS} in all, or {MAX_TINY_SHEETS} of fewer than {TINY_SHEET} triangles on average); export the boundaries \
         of volumes only, or fewer parts at once"
    )]
    SheetsTogether {
        /// How many sheets this component has beyond one.
        sheets: usize,
        /// How many triangles it has.
        triangles: usize,
        /// How many sheets all components have beyond one each.
        in_all: usize,
        /// The first vertices (after welding) at which its sheets meet.
        vertices: Vec<u32>,
    },
}

/// Triangles on their way through repair: each with its position in the input.
struct MeshBuilder {
    points: Vec<Vec3>,
    triangles: Vec<[VertexId; 3]>,
    source: Vec<u32>,
    /// Per triangle of the input, its label; empty where there are none.
    labels: Arc<[u32]>,
    /// Per point, the size that is asked for there, infinite for none; empty where there are none.
    sizes: Vec<f64>,
    /// Per point that is not of the input, those half-way between which it lies.
    middles: Vec<WeldedEnds>,
}

/// The points of a builder in a unit in which distances neither overflow nor underflow, and the tolerance in that unit.
struct Measure {
    points: Vec<Vec3>,
    tolerance: f64,
    /// What lengths in the unit of the input are multiplied with.
    scale: f64,
}

/// Repairs `soup`. The result depends on the order of the input only through its numbering.
///
/// # Errors
/// [`Error::OnlyDegenerate`] when nothing is left.
///
/// ```
/// use planish_core::repair::{Settings, repair};
/// use planish_core::shapes;
///
/// // A plate cut along its middle, as exporters leave it: the two sides of the cut differ in their last digits.
/// let soup = shapes::cracked_patch();
/// let repaired = repair(&soup, &Settings::default())?;
/// assert_eq!((repaired.raw.components, repaired.mesh.topology_summary().components), (2, 1));
/// assert_eq!(repaired.report.cracks_closed, 8);
/// // Without a tolerance nothing is joined.
/// let apart = repair(&soup, &Settings { weld: 0.0 })?;
/// assert_eq!(apart.mesh.topology_summary().components, 2);
/// # Ok::<(), planish_core::repair::Error>(())
/// ```
pub fn repair(soup: &TriangleSoup, settings: &Settings) -> Result<Repaired, Error> {
    let (mut builder, welded) = weld::weld(soup);
    let mut report = Report { welded, ..Report::default() };
    let used = builder.count_used();
    report.degenerate_triangles = builder.drop_degenerate();
    if builder.triangles.is_empty() {
        return Err(Error::OnlyDegenerate { triangles: soup.triangles().len() });
    }
    let mut edges = EdgeTable::new(&builder.triangles);
    let raw = TopologySummary::new(&builder.triangles, &edges);
    report.unreferenced_points = builder.points.len() - used;
    report.duplicate_triangles = builder.drop_duplicates();
    edges = renewed(edges, report.duplicate_triangles.count > 0, &builder.triangles);
    let measure = builder.measure(settings.weld);
    report.t_junctions_closed = builder.close_t_junctions(&edges, &measure);
    let split = report.t_junctions_closed.count > 0;
    edges = renewed(edges, split, &builder.triangles);
    let copies = report.duplicate_triangles.count;
    builder.close_cracks(&edges, &measure, &mut report);
    let changed = report.cracks_closed > 0 || report.duplicate_triangles.count > copies;
    edges = renewed(edges, changed, &builder.triangles);
    report.t_junctions_left = builder.t_junctions_left(&edges, &measure);
    // A surface that was counted without inconsistent edges, and has not changed, is oriented as it is.
    let as_counted = report.duplicate_triangles.count == 0 && report.cracks_closed == 0 && !split;
    if !as_counted || raw.inconsistent_edges > 0 {
        report.flipped_triangles = builder.orient(&edges);
        edges = renewed(edges, report.flipped_triangles.count > 0, &builder.triangles);
    }
    let slivers = slivers::remove(&mut builder, &edges, &measure);
    report.needles_collapsed = Sample::of(slivers.needles.iter().copied());
    report.caps_flipped = Sample::of(slivers.caps.iter().copied());
    report.slivers_moved_by = slivers.deviation / measure.scale;
    let had_slivers = !slivers.is_empty();
    edges = renewed(edges, had_slivers, &builder.triangles);
    drop(measure);
    let input_points = builder.points.len();
    report.slits_opened = builder.open_slits(&edges);
    let opened = report.slits_opened > 0;
    edges = renewed(edges, opened, &builder.triangles);
    report.triangles_added = if split || had_slivers || opened { builder.count_added() } else { 0 };
    // Where the triangles are those that were counted, their counts still hold.
    let known = Some(&raw).filter(|_| as_counted && report.flipped_triangles.count == 0 && !had_slivers && !opened);
    let mesh = builder.into_mesh(edges, input_points, known, &mut report);
    // As read: vertices of degenerate triangles count, though these do not.
    Ok(Repaired { mesh, raw: TopologySummary { vertices: used, ..raw }, report })
}

/// The edges of `triangles`: found again only where the triangles `changed`.
fn renewed(edges: EdgeTable, changed: bool, triangles: &[[VertexId; 3]]) -> EdgeTable {
    if changed { EdgeTable::new(triangles) } else { edges }
}

impl MeshBuilder {
    /// The label of a triangle; none where there are no labels.
    fn label(&self, face: usize) -> Option<u32> {
        self.labels.get(self.source[face] as usize).copied()
    }

    /// The number of points that triangles use.
    fn count_used(&self) -> usize {
        let mut used = vec![false; self.points.len()];
        self.triangles.iter().flatten().for_each(|v| used[v.index()] = true);
        used.iter().filter(|u| **u).count()
    }

    /// The number of triangles beyond one for each of the input.
    fn count_added(&self) -> usize {
        let mut sources = self.source.clone();
        sources.sort_unstable();
        sources.dedup();
        self.triangles.len() - sources.len()
    }

    /// Removes triangles with two equal vertices.
    fn drop_degenerate(&mut self) -> Sample {
        let whole = |t: &[VertexId; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
        let keep: Vec<bool> = self.triangles.iter().map(whole).collect();
        self.keep_only(&keep)
    }

    /// Removes all but the first of the triangles with the same three vertices.
    fn drop_duplicates(&mut self) -> Sample {
        let mut keyed: Vec<([VertexId; 3], usize)> = self.triangles.iter().copied().zip(0..).collect();
        keyed.iter_mut().for_each(|(t, _)| t.sort_unstable());
        keyed.sort_unstable();
        let mut keep = vec![true; keyed.len()];
        for copies in keyed.chunk_by(|a, b| a.0 == b.0) {
            copies[1..].iter().for_each(|c| keep[c.1] = false);
        }
        self.keep_only(&keep)
    }

    fn keep_only(&mut self, keep: &[bool]) -> Sample {
        let dropped = Sample::of(self.source.iter().zip(keep).filter(|(_, keep)| !**keep).map(|(s, _)| *s));
        let mut flags = keep.iter();
        self.triangles.retain(|_| flags.next() == Some(&true));
        let mut flags = keep.iter();
        self.source.retain(|_| flags.next() == Some(&true));
        dropped
    }

    /// Makes distances comparable with `weld` of the diagonal.
    fn measure(&self, weld: f64) -> Measure {
        let diagonal = BoundingBox::of(self.used_points()).map_or(0.0, |b| b.diagonal());
        // Powers of two change no digit.
        let scale = unit_scale(diagonal);
        let points = self.points.iter().map(|p| p.map(|c| c * scale)).collect();
        Measure { points, tolerance: weld * diagonal * scale, scale }
    }

    /// Splits triangles where vertices of others lie on their open edges; returns these vertices.
    fn close_t_junctions(&mut self, edges: &EdgeTable, measure: &Measure) -> Sample {
        let splits = Boundary::new(&measure.points, &self.triangles, edges, measure.tolerance).splits();
        let mut closed: Vec<VertexId> = splits.iter().flat_map(|s| s.1.iter().copied()).collect();
        closed.sort_unstable();
        closed.dedup();
        for of_face in splits.chunk_by(|g, h| g.0.face() == h.0.face()) {
            let mut on_sides = [const { Vec::new() }; 3];
            of_face.iter().for_each(|(h, vertices)| on_sides[h.side()].clone_from(vertices));
            self.split(of_face[0].0.face().index(), &on_sides);
        }
        Sample::of(closed.into_iter().map(|v| v.0))
    }

    /// Halves the non-manifold edges along which two triangles would stay neighbours after the split; returns how many.
    ///
    /// Where a single edge of a sheet meets others, both its ends lie inside the sheet, and the split would leave two edges
    /// between the same two vertices: one edge again. With a vertex in its middle, which the two sides have one each of,
    /// there are four, and the slit is a seam as it must be.
    fn open_slits(&mut self, edges: &EdgeTable) -> usize {
        let meets = |sides: &[HalfEdgeId]| sides.len() > 2;
        if !edges.iter().any(|(_, sides)| meets(sides)) {
            return 0;
        }
        let fans = VertexFans::new(&self.triangles, edges);
        let mut cut: Vec<(HalfEdgeId, VertexId)> = Vec::new();
        let mut opened = 0;
        for (_, sides) in edges.iter().filter(|(_, sides)| meets(sides) && are_rejoined(sides, &fans)) {
            let t = self.triangles[sides[0].face().index()];
            let [a, b] = [t[sides[0].side()], t[(sides[0].side() + 1) % 3]];
            let middle = VertexId::at(self.points.len());
            self.points.push(midpoint(self.points[a.index()], self.points[b.index()]));
            push_mean(&mut self.sizes, [a, b]);
            self.middles.push(welded_ends([a.0, b.0]));
            cut.extend(sides.iter().map(|h| (*h, middle)));
            opened += 1;
        }
        cut.sort_unstable();
        for of_face in cut.chunk_by(|g, h| g.0.face() == h.0.face()) {
            let mut on_sides = [const { Vec::new() }; 3];
            of_face.iter().for_each(|(h, middle)| on_sides[h.side()].push(*middle));
            self.split(of_face[0].0.face().index(), &on_sides);
        }
        opened
    }

    /// Puts the parts of a triangle at its place and at the end.
    fn split(&mut self, face: usize, on_sides: &[Vec<VertexId>; 3]) {
        let parts = t_junctions::parts(self.triangles[face], on_sides);
        self.triangles[face] = parts[0];
        self.source.extend(vec![self.source[face]; parts.len() - 1]);
        self.triangles.extend_from_slice(&parts[1..]);
    }

    /// The boundary vertices that lie on a boundary edge.
    fn t_junctions_left(&self, edges: &EdgeTable, measure: &Measure) -> Sample {
        let left = Boundary::new(&measure.points, &self.triangles, edges, measure.tolerance).vertices_on_edges();
        Sample::of(left.into_iter().map(|v| v.0))
    }

    /// Joins open edges within the tolerance of each other, then drops what became a copy.
    fn close_cracks(&mut self, edges: &EdgeTable, measure: &Measure, report: &mut Report) {
        let closed = cracks::find(&measure.points, &self.triangles, edges, measure.tolerance);
        report.cracks_closed = closed.pairs;
        if closed.pairs > 0 {
            self.triangles.iter_mut().for_each(|t| *t = t.map(|v| closed.target[v.index()]));
            self.sizes = weld::least(&self.sizes, &closed.target, self.sizes.len());
        } else if report.t_junctions_closed.count == 0 {
            return;
        }
        let copies = self.drop_duplicates();
        report.duplicate_triangles.count += copies.count;
        report.duplicate_triangles.first.extend(copies.first);
        report.duplicate_triangles.first.truncate(Sample::SHOWN);
    }

    fn used_points(&self) -> impl Iterator<Item = Vec3> {
        self.triangles.iter().flatten().map(|v| self.points[v.index()])
    }

    /// Orients each orientable component like the majority of its triangles (the first one, in a tie).
    fn orient(&mut self, edges: &EdgeTable) -> Sample {
        let found = crate::topology::orientation(&self.triangles, edges);
        let mut balance = vec![0_i64; found.orientable.len()];
        for (c, flip) in found.component.iter().zip(&found.flip) {
            balance[*c as usize] += if *flip { -1 } else { 1 };
        }
        let mut flipped = Sample::default();
        for (face, component) in found.component.iter().enumerate() {
            let component = *component as usize;
            // `flip` is relative to the first triangle: where most would have to be flipped, the others are.
            let is_minority = found.flip[face] != (balance[component] < 0);
            if found.orientable[component] && is_minority {
                self.triangles[face].swap(1, 2);
                flipped.push(self.source[face]);
            }
        }
        flipped
    }

    /// Gives every fan a vertex of its own, drops unused points, and measures. The triangles may have been counted
    /// before. Points from `input_points` on are not of the input.
    fn into_mesh(
        self,
        edges: EdgeTable,
        input_points: usize,
        known: Option<&TopologySummary>,
        report: &mut Report,
    ) -> SurfaceMesh {
        let fans = VertexFans::new(&self.triangles, &edges);
        let (triangles, copied) = fans.numbered(&self.triangles);
        for copies in copied.chunk_by(|a, b| a == b).filter(|copies| copies.len() > 1) {
            report.split_vertices.push(copies[0].0);
        }
        let welded: Vec<u32> = copied.into_iter().map(|v| v.0).collect();
        let points: Vec<Vec3> = welded.iter().map(|w| self.points[*w as usize]).collect();
        let corners: Vec<_> = triangles.iter().map(|t| t.map(|v: VertexId| points[v.index()])).collect();
        let diagonal = BoundingBox::of(points.iter().copied()).map_or(0.0, |b| b.diagonal());
        let metric = Metric::new(&corners, unit_scale(diagonal));
        report.mollified_by = metric.mollified_by / metric.scale;
        report.mollified_triangles =
            Sample::of((0..corners.len()).filter(|f| metric.flagged[*f]).map(|f| self.source[f]));
        // Splitting makes every sheet manifold; what was split is still told, as it must become a seam.
        let nonmanifold_edges = edges.iter().filter(|(_, sides)| sides.len() > 2).count();
        let edges = renewed(edges, report.split_vertices.count > 0, &triangles);
        let nonmanifold_vertices = pinned_vertices(&welded, &triangles, &edges);
        let counted = known.filter(|_| report.split_vertices.count == 0).cloned();
        let added_from = welded.partition_point(|w| (*w as usize) < input_points);
        let sizes = welded.iter().filter_map(|w| self.sizes.get(*w as usize).copied()).collect();
        let middles = welded[added_from..].iter().map(|w| self.middles[*w as usize - input_points]).collect();
        let (source, labels) = (self.source, self.labels);
        let parts =
            SurfaceParts { points, triangles, source, labels, sizes, welded, added_from, middles, edges, metric };
        SurfaceMesh::new(parts, Sheets { nonmanifold_edges, nonmanifold_vertices }, counted)
    }
}

/// Whether two of these half-edges run between the same two fans: they are one edge again when every fan has a vertex of
/// its own.
fn are_rejoined(sides: &[HalfEdgeId], fans: &VertexFans) -> bool {
    let mut ends = Vec::with_capacity(sides.len());
    for h in sides {
        let [a, b] = [h.index(), h.next().index()].map(|corner| fans.of_corner[corner]);
        ends.push([a.min(b), a.max(b)]);
    }
    ends.sort_unstable();
    ends.windows(2).any(|pair| pair[0] == pair[1])
}

/// Vertices at which sheets touch, one of them not at its boundary: no boundary loop passes through them there.
fn pinned_vertices(welded: &[u32], triangles: &[[VertexId; 3]], edges: &EdgeTable) -> usize {
    let mut on_boundary = vec![false; welded.len()];
    for h in open_half_edges(edges, triangles.len()) {
        on_boundary[triangles[h.face().index()][h.side()].index()] = true;
        on_boundary[triangles[h.face().index()][h.next().side()].index()] = true;
    }
    let vertices: Vec<(u32, bool)> = welded.iter().copied().zip(on_boundary).collect();
    let mut pinned = 0;
    // Copies of a vertex follow each other.
    for copies in vertices.chunk_by(|a, b| a.0 == b.0) {
        let touches_inside = copies.iter().any(|(_, on_boundary)| !on_boundary);
        pinned += usize::from(copies.len() > 1 && touches_inside);
    }
    pinned
}

/// The half-edges along open edges, ascending.
fn open_half_edges(edges: &EdgeTable, faces: usize) -> Vec<HalfEdgeId> {
    let all = (0..faces).flat_map(|f| (0..3).map(move |k| HalfEdgeId::side_of(FaceId::at(f), k)));
    all.filter(|h| edges.is_boundary(*h)).collect()
}

#[cfg(test)]
mod tests;
