//! Soundness: does a mesh that was made through the maps represent the certified surface, and are its elements good?
//!
//! *Faithful*: nothing is lost, doubled, folded or torn. Where the file tells in which chart each triangle was made, this
//! is shown chart by chart, in the map that the mesher used: every triangle is positive (`covering`), the open edges
//! of the chart's mesh run along its curves, each of them whole (`curves`), and the loops that they form are simple
//! and rightly nested, so that the chart is covered once. Whether the file tells charts or not, the mesh has
//! the invariants of the surface (`topology`), its nodes lie on the surface, no part of the surface is farther from it
//! than little more than an edge, its area is that of the surface but for what flat elements cut off, and no two triangles
//! cross that do not in the surface (`intersect`). Elements of six nodes are valid.
//!
//! *Fine*: no element has a gamma below the least one asked for, but for those in tips of the surface (`elements`).
//!
//! What is decided exactly is decided on the grid, from uv that are found in doubles: the finding is one on the mesh
//! with its nodes moved by rounding. Distances are measured at nodes and at points of a lattice. Nothing is assumed of
//! how the mesh was made.

mod covering;
mod curves;
mod deviation;
mod distance;
mod elements;
mod intersect;
mod open;
mod reference;
mod topology;

pub use deviation::{BARELY, Deviation, TooFar};
pub use distance::Farthest;
pub use elements::{EdgeLengths, gamma};
pub use reference::{HandedOverAtlas, HandedOverChart, Mesh, Triangulation};
pub use topology::Invariants;

use crate::topology::EdgeTable;
use crate::topology::csr::Csr;
use crate::topology::{ChartId, CurveId, VertexId};
use crate::vec3::Vec3;
use covering::InPlane;
use distance::{SurfaceDistance, uncovered};

/// A part of the surface is lost if it is so many sizes away from the mesh. Flat elements of edges up to 1.4 sizes cut off
/// 0.8 (a tip of an equilateral element) at most; the nostril of a scanned face was cut off at 1.4.
const LOST: f64 = 1.2;

/// The area of a mesh relative to that of the surface: flat elements cut bulges off, and bridge dents. A sound mesh of
/// bump_10k has 0.985; one of half a cylinder whose elements lay on each other had 1.011.
const AREA: [f64; 2] = [0.95, 1.005];

/// The same for a chart of more than [`LARGE`] squares of the size. Wider by experience: what one chart loses of a bulge no
/// other one makes up for.
const CHART_AREA: [f64; 2] = [0.85, 1.02];

/// Smaller charts have too few elements for their areas to tell: 46 of the size, at 0.43 of its square each. By experience.
const LARGE: f64 = 20.0;

/// Nodes lie on a curve if they are nearer than this, relative to the diagonal. By experience: far above the rounding of
/// doubles, far below any edge.
const ON_CURVE: f64 = 1e-9;

/// What a mesh is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The edge length that the mesher was asked for, in the unit of the surface. Positive.
    pub size: f64,
    /// The least gamma of a fine element, in [0, 1].
    pub min_gamma: f64,
    /// How far nodes may be off the surface, relative to the diagonal of its bounding box. Single precision needs 1e-6.
    pub off_surface: f64,
    /// How far mesh and surface may be from each other anywhere, in the unit of the surface; none: that is not looked at.
    pub deviation: Option<f64>,
}

/// Why a mesh does not represent the surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Defect {
    /// A chart without triangles.
    #[error("chart {chart} has no triangles")]
    Empty {
        /// The chart.
        chart: ChartId,
    },
    /// Triangles of a surface that is no chart.
    #[error("{triangles} triangles belong to surface {label} of the file, and the atlas has {charts} charts")]
    NoChart {
        /// The tag of the surface.
        label: u32,
        /// How many charts there are.
        charts: usize,
        /// How many triangles it has.
        triangles: usize,
        /// Where one is.
        at: Vec3,
    },
    /// Triangles that are not positive in the map.
    #[error("{triangles} triangles of chart {chart} are folded over, or have no area, in its map")]
    Folded {
        /// The chart.
        chart: ChartId,
        /// How many.
        triangles: usize,
        /// The first one.
        at: Vec3,
    },
    /// All triangles of a chart are turned: Gmsh takes the side of one element for that of a whole surface, and where the
    /// surface bends sharply within an element that may be the wrong one.
    #[error(
        "the mesh of chart {chart} is inside out: all its {triangles} triangles are turned; turn them, or mesh with another \
         size"
    )]
    InsideOut {
        /// The chart.
        chart: ChartId,
        /// How many.
        triangles: usize,
        /// The first one.
        at: Vec3,
    },
    /// Begin or end of a curve is no node.
    #[error("an end of curve {curve} is no node of the mesh")]
    CurveEnd {
        /// The curve.
        curve: CurveId,
        /// Its end.
        at: Vec3,
    },
    /// Nodes that follow each other on a curve are not joined.
    #[error("curve {curve} is not whole beside chart {chart}: {edges} edges along it are missing")]
    CurveBroken {
        /// The chart.
        chart: ChartId,
        /// The curve.
        curve: CurveId,
        /// How many edges; 0 where there is no node of the chart on it.
        edges: usize,
        /// The middle of the first one; no number where there is no node.
        at: Vec3,
    },
    /// Open edges elsewhere than along curves.
    #[error("the mesh of chart {chart} has {edges} open edges that do not run along its curves")]
    StrayBoundary {
        /// The chart.
        chart: ChartId,
        /// How many.
        edges: usize,
        /// The middle of the first one.
        at: Vec3,
    },
    /// The boundary of a chart's mesh passes a node twice.
    #[error("the boundary of the mesh of chart {chart} touches itself in a node")]
    BoundaryPinched {
        /// The chart.
        chart: ChartId,
        /// The node.
        at: Vec3,
    },
    /// The boundary of a chart's mesh crosses itself in the plane.
    #[error("the boundary of the mesh of chart {chart} crosses itself in its map")]
    BoundaryCrosses {
        /// The chart.
        chart: ChartId,
        /// Where.
        at: Vec3,
    },
    /// Loops that do not enclose one region.
    #[error("the boundary loops of the mesh of chart {chart} are not one around all others in its map")]
    BoundaryNested {
        /// The chart.
        chart: ChartId,
        /// A node of the loop.
        at: Vec3,
    },
    /// A number that remeshing must not change.
    #[error("the {what} is {found}, that of the surface {expected}")]
    Topology {
        /// Which one.
        what: &'static str,
        /// That of the surface.
        expected: i64,
        /// That of the mesh.
        found: i64,
    },
    /// Nodes off the surface.
    #[error("{nodes} nodes are off the surface, by up to {distance:.3e} (allowed: {limit:.3e})")]
    OffSurface {
        /// How many.
        nodes: usize,
        /// The largest distance.
        distance: f64,
        /// The largest one allowed.
        limit: f64,
        /// The node there.
        at: Vec3,
    },
    /// Parts of the surface without a mesh nearby.
    #[error("a part of the surface is lost: it is up to {distance:.3e} away from the mesh (allowed: {limit:.3e})")]
    Lost {
        /// The largest distance.
        distance: f64,
        /// The largest one allowed.
        limit: f64,
        /// The point there.
        at: Vec3,
    },
    /// Elements at which mesh and surface are too far apart.
    #[error(
        "mesh and surface are up to {distance:.3e} apart, at {elements} elements by more than the deviation {limit:.3e}"
    )]
    Deviates {
        /// How many elements.
        elements: usize,
        /// The largest distance.
        distance: f64,
        /// The largest one allowed.
        limit: f64,
        /// The element there.
        at: Vec3,
    },
    /// Another area.
    #[error("the area is {ratio:.4} times that of the surface (allowed: {low} to {high}): parts are lost or doubled")]
    Area {
        /// The ratio.
        ratio: f64,
        /// The least one allowed.
        low: f64,
        /// The largest one allowed.
        high: f64,
    },
    /// Another area of a chart.
    #[error(
        "the area of chart {chart} is {ratio:.4} times what it was (allowed: {low} to {high}): parts are lost or doubled"
    )]
    ChartArea {
        /// The chart.
        chart: ChartId,
        /// The ratio.
        ratio: f64,
        /// The least one allowed.
        low: f64,
        /// The largest one allowed.
        high: f64,
    },
    /// Triangles that cross.
    #[error("{pairs} pairs of triangles cut through each other, and the surface does not do so there")]
    Crossing {
        /// How many.
        pairs: usize,
        /// The first pair.
        at: Vec3,
    },
    /// Elements of six nodes that are not valid.
    #[error("{elements} elements of six nodes are inverted somewhere")]
    Inverted {
        /// How many.
        elements: usize,
        /// The first one.
        at: Vec3,
    },
    /// Triangles with two equal nodes, or on the same nodes as others.
    #[error("{triangles} triangles name a node twice, or are copies of others")]
    Degenerate {
        /// How many.
        triangles: usize,
        /// The first one.
        at: Vec3,
    },
}

impl Defect {
    /// Where it is, if it is somewhere.
    pub fn at(&self) -> Option<Vec3> {
        match self {
            Self::Empty { .. } | Self::Topology { .. } | Self::Area { .. } | Self::ChartArea { .. } => None,
            Self::NoChart { at, .. }
            | Self::Folded { at, .. }
            | Self::InsideOut { at, .. }
            | Self::CurveEnd { at, .. }
            | Self::CurveBroken { at, .. }
            | Self::StrayBoundary { at, .. }
            | Self::BoundaryPinched { at, .. }
            | Self::BoundaryCrosses { at, .. }
            | Self::BoundaryNested { at, .. }
            | Self::OffSurface { at, .. }
            | Self::Lost { at, .. }
            | Self::Deviates { at, .. }
            | Self::Crossing { at, .. }
            | Self::Inverted { at, .. }
            | Self::Degenerate { at, .. } => Some(*at).filter(|at| at.iter().all(|c| c.is_finite())),
        }
    }
}

/// A bad element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BadElement {
    /// Its number in the mesh.
    pub triangle: u32,
    /// Its gamma.
    pub gamma: f64,
    /// Its centroid.
    pub at: Vec3,
}

/// Everything that was found of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Findings {
    /// Why the mesh is not faithful; nothing where it is.
    pub defects: Vec<Defect>,
    /// Whether the mesh was looked at chart by chart.
    pub by_charts: bool,
    /// The number of elements.
    pub elements: usize,
    /// Those of six nodes.
    pub curved_elements: usize,
    /// The area relative to that of the surface.
    pub area_ratio: f64,
    /// The largest distance of a node to the surface, in its unit.
    pub mesh_to_surface: Farthest,
    /// The largest distance of a point of the surface to the mesh.
    pub surface_to_mesh: Farthest,
    /// How far both are from each other everywhere, where that was asked for.
    pub deviation: Option<Deviation>,
    /// Pairs of triangles that cross where those of the surface cross or touch.
    pub crossings_of_surface: usize,
    /// The least gamma.
    pub gamma_min: f64,
    /// The mean gamma.
    pub gamma_mean: f64,
    /// Elements below the least gamma that was asked for, the worst first.
    pub bad: Vec<BadElement>,
    /// Elements below it in tips of the surface, which do not count.
    pub bad_at_tips: usize,
    /// Lengths of edges relative to the size.
    pub edges: EdgeLengths,
}

impl Findings {
    /// Whether the mesh represents the surface.
    pub fn is_faithful(&self) -> bool {
        self.defects.is_empty()
    }

    /// Whether its elements are good.
    pub fn is_fine(&self) -> bool {
        self.bad.is_empty()
    }
}

/// Holds `mesh` against `surface`, whose triangles belong to `charts`, and, where the mesh tells charts, against the atlas
/// that the mesher was handed.
///
/// # Panics
/// Where triangles name points that do not exist, or lists have other lengths than those that they belong to.
///
/// ```
/// use planish_core::shapes;
/// use planish_core::soundness::{Mesh, Settings, Triangulation, examine};
///
/// let soup = shapes::disk(8);
/// let surface = Triangulation::welded(soup.points(), soup.triangles().iter().copied());
/// let (charts, mids) = (vec![0; surface.triangles.len()], vec![None; surface.triangles.len()]);
/// let settings = Settings { size: 0.15, min_gamma: 0.1, off_surface: 1e-6, deviation: None };
/// // The surface is a mesh of itself. With one triangle less it has a hole.
/// let mut mesh = Mesh { triangulation: surface.clone(), mids, charts: None };
/// let found = examine(&mesh, &surface, &charts, None, &settings);
/// assert!(found.is_faithful() && found.is_fine() && found.area_ratio == 1.0);
/// mesh.triangulation.triangles.remove(0);
/// mesh.mids.remove(0);
/// let torn = examine(&mesh, &surface, &charts, None, &settings);
/// assert_eq!(torn.defects[0].to_string(), "the Euler number is 0, that of the surface 1");
/// ```
pub fn examine(
    mesh: &Mesh,
    surface: &Triangulation,
    charts: &[u32],
    atlas: Option<&HandedOverAtlas>,
    settings: &Settings,
) -> Findings {
    let triangulation = &mesh.triangulation;
    let diagonal = surface.diagonal();
    let mut defects: Vec<Defect> = degenerate(triangulation).into_iter().collect();
    if defects.is_empty() {
        let edges = EdgeTable::new(&triangulation.triangles);
        let expected = Invariants::of(&surface.triangles, &EdgeTable::new(&surface.triangles));
        defects.extend(expected.compared(&Invariants::of(&triangulation.triangles, &edges)));
    }
    let atlas = atlas.zip(mesh.charts.as_ref());
    let distance = match atlas {
        Some((atlas, labels)) => by_charts(mesh, labels, atlas, diagonal, &mut defects),
        None => SurfaceDistance::measure(triangulation, surface, &surface.bvh()),
    };
    let limit = settings.off_surface * diagonal;
    let (mesh_to_surface, nodes) = distance.farthest(&triangulation.points, limit);
    if nodes > 0 {
        let Farthest { distance, at } = mesh_to_surface;
        defects.push(Defect::OffSurface { nodes, distance, limit, at });
    }
    let limit = LOST * settings.size;
    let tree = triangulation.bvh();
    let (surface_to_mesh, lost) = uncovered(surface, triangulation, &tree, settings.size, limit);
    if lost > 0 {
        let Farthest { distance, at } = surface_to_mesh;
        defects.push(Defect::Lost { distance, limit, at });
    }
    let deviation = settings.deviation.map(|limit| deviation::measure(mesh, surface, limit));
    defects.extend(deviation.as_ref().and_then(deviates));
    let area_ratio = triangulation.area() / surface.area();
    defects.extend(area_defects(mesh, surface, charts, area_ratio, settings.size));
    let crossings = intersect::crossings(triangulation, &tree, surface, settings.off_surface * diagonal);
    let at = |t: u32| centroid(triangulation.corners(t as usize));
    defects.extend(crossings.pairs.first().map(|p| Defect::Crossing { pairs: crossings.pairs.len(), at: at(p[0]) }));
    let inverted = elements::invalid_curved(mesh);
    defects.extend(inverted.first().map(|t| Defect::Inverted { elements: inverted.len(), at: at(*t) }));
    let shapes = elements::shapes(triangulation, surface, settings.min_gamma);
    let bad = |(triangle, gamma): &(u32, f64)| BadElement { triangle: *triangle, gamma: *gamma, at: at(*triangle) };
    Findings {
        by_charts: atlas.is_some(),
        elements: triangulation.triangles.len(),
        curved_elements: mesh.mids.iter().flatten().count(),
        area_ratio,
        mesh_to_surface,
        surface_to_mesh,
        deviation,
        crossings_of_surface: crossings.in_surface,
        gamma_min: shapes.min,
        gamma_mean: shapes.mean,
        bad: shapes.below.iter().map(bad).collect(),
        bad_at_tips: shapes.at_tips,
        edges: elements::edge_lengths(triangulation, settings.size),
        defects,
    }
}

/// The defect that elements are too far from the surface, if any is.
fn deviates(deviation: &Deviation) -> Option<Defect> {
    let worst = deviation.too_far.iter().max_by(|a, b| a.distance.total_cmp(&b.distance))?;
    let (elements, limit) = (deviation.too_far.len(), deviation.limit);
    Some(Defect::Deviates { elements, distance: worst.distance, limit, at: worst.at })
}

/// Looks at every chart; how far the nodes are from the charts that they belong to.
fn by_charts(
    mesh: &Mesh,
    labels: &[u32],
    atlas: &HandedOverAtlas,
    diagonal: f64,
    defects: &mut Vec<Defect>,
) -> SurfaceDistance {
    let count = atlas.charts.len();
    let mut per_chart: Vec<Vec<u32>> = vec![Vec::new(); count];
    // Triangles with labels that no chart has.
    let mut strays: Vec<u32> = Vec::new();
    for (t, label) in labels.iter().enumerate() {
        per_chart.get_mut(*label as usize).unwrap_or(&mut strays).push(t as u32);
    }
    if let Some(first) = strays.first() {
        let at = centroid(mesh.triangulation.corners(*first as usize));
        let label = labels[*first as usize].wrapping_add(1);
        defects.push(Defect::NoChart { label, charts: count, triangles: strays.len(), at });
    }
    let boundaries = curves::boundaries(mesh, &per_chart, atlas, ON_CURVE * diagonal);
    let nodes = mesh.triangulation.points.len();
    let (mut distance, mut in_plane) = (SurfaceDistance::new(nodes), InPlane::new(nodes));
    for (id, triangles) in per_chart.iter().enumerate().map(|(c, t)| (ChartId::at(c), t)) {
        if triangles.is_empty() {
            defects.push(Defect::Empty { chart: id });
            continue;
        }
        defects.extend(covering::check(mesh, triangles, atlas, id, &boundaries, &mut in_plane, &mut distance));
        note_mids(mesh, triangles, &atlas.charts[id.index()], &mut distance);
    }
    defects.extend(boundaries.defects);
    distance
}

/// How far the nodes in the middle of sides are from a chart.
fn note_mids(mesh: &Mesh, triangles: &[u32], chart: &HandedOverChart, distance: &mut SurfaceDistance) {
    for v in triangles.iter().filter_map(|t| mesh.mids[*t as usize]).flatten() {
        let located = chart.map.to_plane(mesh.triangulation.points[v.index()]);
        distance.note(v, located.map_or(f64::INFINITY, |l| l.distance));
    }
}

/// Triangles that name a node twice, and copies of others.
fn degenerate(mesh: &Triangulation) -> Option<Defect> {
    let sorted = |t: &[VertexId; 3]| {
        let mut t = t.map(|v| v.0);
        t.sort_unstable();
        t
    };
    let all = || mesh.triangles.iter().map(sorted).zip(0_u32..).map(|([a, b, c], t)| (a, ([b, c], t)));
    let named_twice = all().filter(|(a, ([b, c], _))| a == b || b == c).map(|(_, (_, t))| t);
    let mut bad: Vec<u32> = named_twice.collect();
    let mut by_least = Csr::sorted(mesh.points.len(), all);
    for node in 0..mesh.points.len() {
        let around = by_least.row_mut(node);
        around.sort_unstable();
        bad.extend(around.chunk_by(|a, b| a.0 == b.0).flat_map(|same| &same[1..]).map(|copy| copy.1));
    }
    bad.sort_unstable();
    bad.dedup();
    let first = *bad.first()?;
    Some(Defect::Degenerate { triangles: bad.len(), at: centroid(mesh.corners(first as usize)) })
}

/// Areas that are not what they were.
fn area_defects(mesh: &Mesh, surface: &Triangulation, charts: &[u32], ratio: f64, size: f64) -> Vec<Defect> {
    let within = |ratio: f64, [low, high]: [f64; 2]| (low..=high).contains(&ratio);
    let mut defects = Vec::new();
    if !within(ratio, AREA) {
        defects.push(Defect::Area { ratio, low: AREA[0], high: AREA[1] });
    }
    let Some(labels) = &mesh.charts else { return defects };
    let count = charts.iter().max().map_or(0, |c| *c as usize + 1);
    let sums = |of: &Triangulation, labels: &[u32]| {
        let mut sums = vec![0.0; count];
        for (t, label) in labels.iter().enumerate() {
            sums.get_mut(*label as usize).into_iter().for_each(|s| *s += of.area_of(t));
        }
        sums
    };
    let (before, after) = (sums(surface, charts), sums(&mesh.triangulation, labels));
    for (chart, (before, after)) in before.iter().zip(&after).enumerate() {
        let ratio = after / before;
        if *before > LARGE * size * size && !within(ratio, CHART_AREA) {
            let [low, high] = CHART_AREA;
            defects.push(Defect::ChartArea { chart: ChartId::at(chart), ratio, low, high });
        }
    }
    defects
}

/// The mean of the corners.
fn centroid(p: [Vec3; 3]) -> Vec3 {
    [0, 1, 2].map(|k| (p[0][k] + p[1][k] + p[2][k]) / 3.0)
}

#[cfg(test)]
mod tests;
