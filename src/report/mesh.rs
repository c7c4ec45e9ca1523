//! mesh.json: what `planish check --mesh` found. The schema is in docs/mesh.schema.json; within version 1 it only grows.

use super::Output;
use planish_core::soundness::{Defect, Deviation, Farthest, Findings};
use planish_core::vec3::Vec3;
use serde::{Deserialize, Serialize};

/// The version of the schema.
pub const SCHEMA: u32 = 1;

/// So many places are told: the worst.
pub const PLACES: usize = 5;

/// What was found of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshReport {
    /// Version of the schema.
    pub schema: u32,
    /// Version of planish.
    pub planish: String,
    /// The mesh.
    pub mesh: Output,
    /// The surface that it is held against: surface.vtu of the result.
    pub surface: Output,
    /// The edge length that was asked for, in the unit of the surface.
    pub size: f64,
    /// The least gamma of a fine element.
    pub min_gamma: f64,
    /// Whether the mesh represents the surface.
    pub faithful: bool,
    /// Whether no element is below the least gamma.
    pub fine: bool,
    /// Whether the mesh was looked at chart by chart; if not, by the surface alone.
    pub by_charts: bool,
    /// Why it is not faithful.
    pub defects: Vec<MeshDefect>,
    /// The number of elements; quadrangles count as two triangles.
    pub elements: usize,
    /// Those of six nodes.
    pub curved_elements: usize,
    /// The area relative to that of the surface.
    pub area_ratio: f64,
    /// The node that is farthest from the surface.
    pub mesh_to_surface: Distance,
    /// The point of the surface that is farthest from the mesh.
    pub surface_to_mesh: Distance,
    /// How far both are from each other everywhere; null where that was not asked for.
    #[serde(default)]
    pub deviation: Option<DeviationReport>,
    /// Pairs of elements that cross as those of the surface do.
    pub crossings_of_surface: usize,
    /// The shapes of elements.
    pub gamma: Gamma,
    /// Lengths of edges relative to the size.
    pub edges: Edges,
    /// The worst places.
    pub places: Vec<Place>,
}

/// Why a mesh does not represent the surface.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeshDefect {
    /// What it is, in one word for scripts.
    pub kind: String,
    /// The same for people, with numbers.
    pub message: String,
    /// Where, if it is somewhere.
    pub at: Option<Vec3>,
}

/// A distance and where it was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distance {
    /// In the unit of the surface.
    pub distance: f64,
    /// The point.
    pub at: Vec3,
}

/// How far mesh and surface are from each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviationReport {
    /// What may be, in the unit of the surface.
    pub limit: f64,
    /// The point of the mesh that is farthest from the surface, inside elements, too.
    pub mesh_to_surface: Distance,
    /// The point of the surface that is farthest from the mesh.
    pub surface_to_mesh: Distance,
    /// At how many elements more is found than may be.
    pub elements: usize,
    /// The worst of these places.
    pub places: Vec<Distance>,
    /// The places at which elements would have to be smaller than the least edge length allows; where smaller ones were asked for.
    pub held: Vec<Distance>,
}

/// Twice the radius of the inscribed circle over that of the circumscribed one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gamma {
    /// The least.
    pub min: f64,
    /// The mean.
    pub mean: f64,
    /// Elements below the least one asked for, but for those in tips.
    pub below: usize,
    /// Their share.
    pub share_below: f64,
    /// Elements below it in tips of the surface, which do not count.
    pub below_at_tips: usize,
}

/// Lengths of edges relative to the size.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edges {
    /// The shortest.
    pub min: f64,
    /// The median.
    pub median: f64,
    /// The longest.
    pub max: f64,
    /// The share between half and twice the size.
    pub near_size: f64,
}

/// A place that deserves a look.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// What is there.
    pub what: String,
    /// Coordinates.
    pub at: Vec3,
}

impl MeshReport {
    /// The report of what was found, for a mesh of `size` held against a surface.
    pub fn new(mesh: Output, surface: Output, size: f64, min_gamma: f64, found: &Findings) -> Self {
        let defect = |d: &Defect| MeshDefect { kind: kind(d).to_owned(), message: d.to_string(), at: d.at() };
        let distance = |d: &Farthest| Distance { distance: d.distance, at: d.at };
        let (edges, below) = (found.edges, found.bad.len());
        Self {
            schema: SCHEMA,
            planish: env!("CARGO_PKG_VERSION").to_owned(),
            mesh,
            surface,
            size,
            min_gamma,
            faithful: found.is_faithful(),
            fine: found.is_fine(),
            by_charts: found.by_charts,
            defects: found.defects.iter().map(defect).collect(),
            elements: found.elements,
            curved_elements: found.curved_elements,
            area_ratio: found.area_ratio,
            mesh_to_surface: distance(&found.mesh_to_surface),
            surface_to_mesh: distance(&found.surface_to_mesh),
            deviation: found.deviation.as_ref().map(deviation),
            crossings_of_surface: found.crossings_of_surface,
            gamma: Gamma {
                min: found.gamma_min,
                mean: found.gamma_mean,
                below,
                share_below: below as f64 / found.elements.max(1) as f64,
                below_at_tips: found.bad_at_tips,
            },
            edges: Edges { min: edges.min, median: edges.median, max: edges.max, near_size: edges.near_size },
            places: places(found),
        }
    }
}

/// How far mesh and surface are from each other, with the worst places.
fn deviation(found: &Deviation) -> DeviationReport {
    let distance = |d: &Farthest| Distance { distance: d.distance, at: d.at };
    let mut worst: Vec<_> = found.too_far.iter().collect();
    worst.sort_by(|a, b| b.distance.total_cmp(&a.distance).then(a.triangle.cmp(&b.triangle)));
    DeviationReport {
        limit: found.limit,
        mesh_to_surface: distance(&found.mesh_to_surface),
        surface_to_mesh: distance(&found.surface_to_mesh),
        elements: found.too_far.len(),
        places: worst.iter().take(PLACES).map(|t| Distance { distance: t.distance, at: t.at }).collect(),
        held: Vec::new(),
    }
}

/// The worst places: where the mesh is not faithful first, then the worst elements.
fn places(found: &Findings) -> Vec<Place> {
    let defects = found.defects.iter().filter_map(|d| Some(Place { what: d.to_string(), at: d.at()? }));
    let bad = |b: &planish_core::soundness::BadElement| Place { what: format!("gamma {:.4}", b.gamma), at: b.at };
    defects.chain(found.bad.iter().map(bad)).take(PLACES).collect()
}

/// The word for a defect. A stable list: docs/mesh.md.
fn kind(defect: &Defect) -> &'static str {
    match defect {
        Defect::Empty { .. } => "empty_chart",
        Defect::NoChart { .. } => "no_chart",
        Defect::Folded { .. } => "folded",
        Defect::InsideOut { .. } => "inside_out",
        Defect::CurveEnd { .. } => "curve_end",
        Defect::CurveBroken { .. } => "curve_broken",
        Defect::StrayBoundary { .. } => "stray_boundary",
        Defect::BoundaryPinched { .. } => "boundary_pinched",
        Defect::BoundaryCrosses { .. } => "boundary_crosses",
        Defect::BoundaryNested { .. } => "boundary_nested",
        Defect::Topology { .. } => "topology",
        Defect::OffSurface { .. } => "off_surface",
        Defect::Lost { .. } => "lost",
        Defect::Deviates { .. } => "deviates",
        Defect::Area { .. } => "area",
        Defect::ChartArea { .. } => "chart_area",
        Defect::Crossing { .. } => "crossing",
        Defect::Inverted { .. } => "inverted",
        Defect::Degenerate { .. } => "degenerate",
    }
}
