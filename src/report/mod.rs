//! report.json: what was found, done and proven. The schema is in docs/report.schema.json; within version 1 it only
//! grows.

mod build;
mod facts;
pub mod mesh;
mod warnings;

use crate::formats::{Label, Notes};
use crate::outcome::{Reason, Status};
use crate::settings::{self, LabelSource, Settings};
use crate::system::escape::printable_json;
pub use build::{certificate, chart_checksum, charts, fields, labels, repairs, seams, surface};
pub use facts::{CertifiedFacts, Facts, SurfaceFacts};
use planish_core::Order;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
pub use warnings::{Doubt, Warning, warnings};

/// The version of the schema.
pub const SCHEMA: u32 = 1;

/// The version of planish, as reports tell it.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");

/// The whole report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Version of the schema.
    pub schema: u32,
    /// Version of planish.
    pub planish: String,
    /// The input file.
    pub input: Input,
    /// The settings that decide the result.
    pub settings: ResultSettings,
    /// How it ended.
    pub status: Status,
    /// Why it was refused or failed.
    pub reason: Option<Reason>,
    /// What the file holds beside its triangles; null where it was not read.
    pub content: Option<Notes>,
    /// The surface, as far as it was read.
    pub surface: Option<Surface>,
    /// Components that were refused while others were certified.
    pub refused_components: Vec<RefusedComponent>,
    /// What repair did.
    pub repairs: Option<Repairs>,
    /// What the surface may suffer from all the same.
    #[serde(default)]
    pub warnings: Vec<Warning>,
    /// How the surface was cut into charts.
    pub decomposition: Option<Decomposition>,
    /// What was refined; null where no map was tried.
    #[serde(default)]
    pub refinement: Option<Refinement>,
    /// The parts of the surface that have names.
    #[serde(default)]
    pub labels: Vec<LabelReport>,
    /// The arrays of the input in surface.vtu.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fields: Vec<FieldReport>,
    /// The charts.
    pub charts: Vec<ChartReport>,
    /// The curves between charts.
    pub seams: Seams,
    /// The hand-off to a mesher; null where there was none to be made.
    pub hand_off: Option<ExportReport>,
    /// The hand-off to Mmg; none where it was not asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mmg: Option<MmgReport>,
    /// The other files of the result.
    pub outputs: Vec<Output>,
    /// CPU seconds per stage: the only part that differs from run to run.
    pub timing: BTreeMap<String, f64>,
}

/// The input file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Input {
    /// Its name.
    pub name: String,
    /// Its size; null where it could not be read.
    pub bytes: Option<u64>,
    /// The hash of its content.
    pub blake3: Option<String>,
    /// The files beside it that were read, too.
    #[serde(default)]
    pub beside: Vec<Output>,
}

/// The settings that decide the result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResultSettings {
    /// Order of the elements.
    pub order: u8,
    /// Boundary of charts in the plane; none in results of older versions, which are out of date.
    #[serde(default)]
    pub boundary: Option<settings::Boundary>,
    /// How many times as many triangles a chart may get; null: none are bisected. 0 in results of older versions, which are out
    /// of date.
    #[serde(default = "older")]
    pub refine: Option<u32>,
    /// Tolerance for cracks.
    pub weld: f64,
    /// Dihedral angle of feature edges, in degrees; null: off.
    pub feature_angle: Option<f64>,
    /// Whether holes of charts are holes of the surface.
    pub strict_disks: bool,
    /// Largest area ratio of a chart.
    pub max_area_ratio: f64,
    /// Largest number of triangles of a chart; null: any.
    pub max_triangles: Option<usize>,
    /// Meshers to which the result is handed.
    pub hand_off: settings::ExportTargets,
    /// Files for other programs, beside those of every result.
    #[serde(default)]
    pub also: Vec<settings::Also>,
    /// Edge length that was asked for; null for the default.
    pub size: Option<f64>,
    /// Edges per full turn that were asked for; null: none.
    #[serde(default)]
    pub size_curvature: Option<f64>,
    /// Least edge length; null: none.
    #[serde(default)]
    pub size_min: Option<f64>,
    /// The array of points that tells edge lengths; null: none.
    #[serde(default)]
    pub size_from: Option<String>,
    /// How much longer edges may become over a distance; null in results of older versions.
    #[serde(default)]
    pub gradation: Option<f64>,
    /// How far mesh and surface may be from each other; null: not asked for.
    #[serde(default)]
    pub deviation: Option<f64>,
    /// Order of the elements of the mesh to be made.
    #[serde(default = "linear")]
    pub mesh_order: u8,
    /// What names parts of the surface, where it was asked for.
    #[serde(default)]
    pub label: Option<String>,
    /// Whether names of parts count for nothing.
    #[serde(default)]
    pub ignore_labels: bool,
    /// Whether curves along features have a group in files for meshers.
    #[serde(default)]
    pub names_features: bool,
}

/// What meshes had before another order could be asked for.
fn linear() -> u8 {
    1
}

/// What no settings say.
fn older() -> Option<u32> {
    Some(0)
}

impl From<&Settings> for ResultSettings {
    fn from(settings: &Settings) -> Self {
        Self {
            order: if settings.order == Order::Linear { 1 } else { 2 },
            boundary: Some(settings.boundary),
            refine: settings.refine,
            weld: settings.weld,
            feature_angle: settings.feature_angle,
            strict_disks: settings.strict_disks,
            max_area_ratio: settings.max_area_ratio,
            max_triangles: settings.max_triangles,
            hand_off: settings.hand_off,
            also: settings.also.clone(),
            size: settings.size,
            size_curvature: settings.size_curvature,
            size_min: settings.size_min,
            size_from: settings.size_from.clone(),
            gradation: Some(settings.gradation),
            deviation: settings.deviation,
            mesh_order: settings.mesh_order,
            label: match &settings.labels {
                LabelSource::Array(label) => Some(label.clone()),
                LabelSource::Usual | LabelSource::Ignored => None,
            },
            ignore_labels: settings.labels == LabelSource::Ignored,
            names_features: settings.names_features,
        }
    }
}

impl ResultSettings {
    /// These, and all others as they are in `settings`.
    pub fn applied_to(&self, settings: Settings) -> Settings {
        Settings {
            order: if self.order == 1 { Order::Linear } else { Order::Quadratic },
            boundary: self.boundary.unwrap_or(settings.boundary),
            refine: self.refine,
            weld: self.weld,
            feature_angle: self.feature_angle,
            strict_disks: self.strict_disks,
            max_area_ratio: self.max_area_ratio,
            max_triangles: self.max_triangles,
            hand_off: self.hand_off,
            also: self.also.clone(),
            size: self.size,
            size_curvature: self.size_curvature,
            size_min: self.size_min,
            size_from: self.size_from.clone(),
            gradation: self.gradation.unwrap_or(settings.gradation),
            deviation: self.deviation,
            mesh_order: self.mesh_order,
            labels: match &self.label {
                Some(label) => LabelSource::Array(label.clone()),
                None if self.ignore_labels => LabelSource::Ignored,
                None => LabelSource::Usual,
            },
            names_features: self.names_features,
            ..settings
        }
    }
}

/// A part of the surface that has a name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LabelReport {
    /// Its tag, name and group.
    #[serde(flatten)]
    pub label: Label,
    /// How many charts it is made of.
    pub charts: usize,
    /// How many triangles, after refinement.
    pub triangles: usize,
    /// Its area, in the unit of the input, squared.
    pub area: f64,
}

/// An array of the input in surface.vtu.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldReport {
    /// Its name there.
    pub name: String,
    /// Its name in the input, where that is another.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input_name: Option<String>,
    /// What it has entries for.
    pub on: FieldOwner,
    /// How many numbers make an entry.
    pub components: usize,
    /// Whether they are whole ones.
    pub integer: bool,
}

/// What a field has entries for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FieldOwner {
    /// For points.
    Points,
    /// For cells.
    Cells,
}

/// A surface before and after repair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Surface {
    /// As read: bit-equal vertices merged.
    pub raw: Counts,
    /// As processed.
    pub repaired: RepairedSurface,
}

/// The counts of a surface.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Vertices in use.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Parts connected through edges.
    pub components: usize,
    /// Closed boundary curves.
    pub boundary_loops: usize,
    /// Euler number.
    pub euler: i64,
    /// Handles; null where the surface is not orientable or not manifold.
    pub genus: Option<u64>,
    /// Whether it can be oriented.
    pub orientable: bool,
    /// Edges of three or more triangles.
    pub nonmanifold_edges: usize,
    /// Vertices where sheets touch that share no edge there, once for each sheet beyond the first.
    pub nonmanifold_vertices: usize,
    /// Edges whose triangles disagree about the direction.
    pub inconsistent_edges: usize,
}

/// The surface after repair.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RepairedSurface {
    /// The counts.
    #[serde(flatten)]
    pub counts: Counts,
    /// Area in the unit of the input, squared.
    pub area: f64,
    /// Least and largest coordinates.
    pub bbox: [[f64; 3]; 2],
}

/// A number of things and the first few of them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Found {
    /// How many.
    pub count: usize,
    /// The first ids: input triangles, or vertices after welding.
    pub first: Vec<u32>,
}

/// What repair found and did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Repairs {
    /// Points merged into a bit-equal one.
    pub welded: usize,
    /// Points that no triangle uses.
    pub unreferenced_points: usize,
    /// Vertices that lay on open edges of other triangles, which were split there.
    #[serde(default)]
    pub t_junctions_closed: usize,
    /// Vertices on the boundary that lie on an open edge still.
    #[serde(default)]
    pub t_junctions_left: usize,
    /// Triangles of the surface beyond one for each of the input: parts of those that were split.
    #[serde(default)]
    pub triangles_added: usize,
    /// Single edges along which sheets meet inside a sheet, halved so that they can be seams.
    #[serde(default)]
    pub slits_opened: usize,
    /// Pairs of open edges joined.
    pub cracks_closed: usize,
    /// Copies of a triangle, removed.
    pub duplicate_triangles: usize,
    /// Triangles with two equal vertices, removed.
    pub degenerate_triangles: usize,
    /// Triangles turned over.
    pub flipped_triangles: usize,
    /// Triangles narrower than the tolerance, removed: an edge was collapsed.
    #[serde(default)]
    pub needles_collapsed: usize,
    /// Triangles narrower than the tolerance, removed: the longest edge was flipped.
    #[serde(default)]
    pub caps_flipped: usize,
    /// The farthest that a point of the surface moved with these, in the unit of the input.
    #[serde(default)]
    pub slivers_moved_by: f64,
    /// Vertices given to several sheets.
    pub split_vertices: usize,
    /// Triangles whose area mollification changed by more than 1 %.
    pub mollified_triangles: usize,
    /// What was added to every edge length, in the unit of the input.
    pub mollified_by: f64,
    /// The first ids behind these counts.
    pub first: BTreeMap<String, Vec<u32>>,
}

/// How the surface was cut into charts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Decomposition {
    /// Edges along features.
    pub feature_edges: usize,
    /// Triangles with two edges at the boundary of their chart, whose inner edge was split.
    pub ears_split: usize,
    /// How many of the charts came from splitting others that were too distorted or could not be mapped.
    pub charts_by_splitting: usize,
}

/// Which triangles were bisected, because the quadratic map was too poor there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Refinement {
    /// Charts of which triangles were bisected because their maps ask for it.
    pub charts: usize,
    /// Triangles before.
    pub triangles_before: usize,
    /// Triangles after.
    pub triangles_after: usize,
    /// How many of those that were added no map asked for: they are there so that no node hangs.
    pub by_closure: usize,
    /// The first few triangles for which maps ask for it.
    pub places: Vec<RefinedPlace>,
}

/// A triangle that was bisected.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RefinedPlace {
    /// Its position in the input.
    pub triangle: u32,
    /// The centroid of a part of it.
    pub at: [f64; 3],
}

impl From<planish_core::Refinement> for Refinement {
    fn from(done: planish_core::Refinement) -> Self {
        let planish_core::Refinement { charts, triangles_before, triangles_after, by_closure, places } = done;
        let places = places.into_iter().map(|(triangle, at)| RefinedPlace { triangle, at }).collect();
        Self { charts, triangles_before, triangles_after, by_closure, places }
    }
}

/// A component that was refused.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RefusedComponent {
    /// Its number: components are what is connected through edges, also those of three and more triangles, in the order of
    /// their first triangles.
    pub component: usize,
    /// Its triangles.
    pub triangles: usize,
    /// The position in the input of the first of them.
    pub first_triangle: u32,
    /// Why.
    pub reason: Reason,
}

impl RefusedComponent {
    /// Which triangles it has, for people.
    pub fn extent(&self) -> String {
        format!("{} triangles from triangle {} on", self.triangles, self.first_triangle)
    }
}

/// A chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChartReport {
    /// Its number.
    pub id: u32,
    /// Its triangles.
    pub triangles: usize,
    /// Its boundary loops, the outer one included.
    pub loops: usize,
    /// A small number that differs from that of every neighbour.
    pub colour: u32,
    /// Numbers of the seams around it.
    pub seams: Vec<u32>,
    /// Charts beside it.
    pub neighbours: Vec<u32>,
    /// Its boundary in the plane.
    #[serde(default)]
    pub boundary: ChartBoundary,
    /// The linear map.
    pub linear: Linear,
    /// The harmonic quadratic map; null for order 1, or where its system could not be solved.
    pub quadratic: Option<Quadratic>,
    /// Untangling; null where there was no quadratic map.
    pub untangle: Option<Untangle>,
    /// The proof.
    pub certificate: Certificate,
    /// The distortion.
    pub distortion: Distortion,
    /// A power of two: uv times it have the size of the chart in space, in the unit of the input.
    #[serde(default = "one")]
    pub uv_scale: f64,
    /// Where the chart lies in param.vtu: uv times `uv_scale`, moved by this.
    #[serde(default)]
    pub shift: [f64; 2],
}

fn one() -> f64 {
    1.0
}

/// Which boundary a chart has in the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BoundaryShape {
    /// That of a map with a free boundary that is conformal.
    Natural,
    /// Freed from the disk, so that the map is near an isometry.
    Freed,
    /// The unit circle.
    Circle,
}

impl BoundaryShape {
    /// Whether it consists of chords.
    pub fn is_in_chords(self) -> bool {
        match self {
            Self::Natural | Self::Freed => true,
            Self::Circle => false,
        }
    }
}

/// The boundary of a chart in the plane. Results that say nothing have the circle.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChartBoundary {
    /// Which one it is.
    pub shape: BoundaryShape,
    /// Why it is freed, or the circle, although the natural one was asked for: `folded`, `crossing`, `uneven`, `stretched`,
    /// `unsolvable`; else null.
    pub reason: Option<String>,
    /// The same in words.
    pub message: Option<String>,
}

impl Default for ChartBoundary {
    fn default() -> Self {
        Self { shape: BoundaryShape::Circle, reason: None, message: None }
    }
}

/// The linear map of a chart.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Linear {
    /// Triangles that the harmonic map folds.
    pub folded: usize,
    /// Edges whose weight was changed.
    pub edges_changed: usize,
    /// `harmonic`, `m_matrix` or `mean_value`; with a natural boundary `conformal`, `projection` or `unfolded`,
    /// too; with a freed one `isometric`.
    pub method: String,
}

/// The harmonic quadratic map of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Quadratic {
    /// Invalid triangles.
    pub invalid: usize,
    /// Least jacobian determinant per unit of mollified area.
    pub det_min: f64,
}

/// The untangling of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Untangle {
    /// `none` (the harmonic map was valid), `patch`, `feasible`, `isometric` or `start`.
    pub method: String,
    /// Newton steps.
    pub iterations: usize,
    /// Nodes whose place differs from the harmonic one.
    pub nodes_moved: usize,
    /// Dirichlet energy of the harmonic map: a lower bound.
    pub energy_harmonic: f64,
    /// Dirichlet energy of the raised linear map.
    pub energy_start: f64,
    /// Dirichlet energy of the result.
    pub energy: f64,
    /// (energy - energy_harmonic) / energy_harmonic.
    pub energy_excess: f64,
    /// Norm of the last barrier problem's gradient, in its inverse Hessian, relative to the root of twice the energy.
    pub gradient_norm: f64,
    /// How far maps inside the boundary are from an isometry, where the harmonic map was not wanted.
    pub from_isometry: Option<FromIsometry>,
    /// Least jacobian determinant per unit of mollified area, of the result.
    pub det_min: f64,
}

/// Symmetric Dirichlet energies over that of an isometry.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FromIsometry {
    /// Of the raised linear map.
    pub start: f64,
    /// The least that was found with that boundary.
    pub least: f64,
}

/// The proof of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Always true in a published map.
    pub proven: bool,
    /// Triangles proven by the signs of their Bernstein coefficients.
    pub by_bounds: usize,
    /// Triangles proven by strict copositivity.
    pub by_exact: usize,
    /// Depth of subdivision behind the lower bound.
    pub depth: u32,
    /// Lower bound of the jacobian determinant on the reference triangle.
    pub det_lower_bound: f64,
    /// How the boundary was proven.
    pub boundary: Boundary,
    /// A point in each hole from which its loop can be seen, where all loops are star-shaped; else none.
    pub hole_centres: Vec<[f64; 2]>,
    /// blake3 over connectivity and uv, see docs/report.md.
    pub checksum: String,
}

/// The boundary argument of a proof.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Boundary {
    /// `star_shaped`: each loop can be seen from a point inside. `simple`: the loops neither cross nor touch, and one turns
    /// left.
    pub argument: String,
    /// Arcs of the outer loop.
    pub outer_arcs: usize,
    /// Holes.
    pub holes: usize,
}

/// The distortion of a chart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Distortion {
    /// Median of sigma1 / sigma2, by area.
    pub conformal_median: f64,
    /// 99 % quantile of sigma1 / sigma2, by area.
    pub conformal_p99: f64,
    /// 99.9 % over 0.1 % quantile of the area scale of two-ring stars, by area.
    pub area_ratio: f64,
}

/// The curves between charts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seams {
    /// How many.
    pub curves: usize,
    /// Points where they meet.
    pub corners: usize,
    /// Their total length.
    pub length_total: f64,
    /// The longest one.
    pub length_max: f64,
    /// Each of them; `id` is the number of the curve in seams.vtp.
    pub list: Vec<Seam>,
}

/// A curve between charts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Seam {
    /// Its number among all curves, those of the open boundary included.
    pub id: u32,
    /// The charts beside it.
    pub charts: Vec<u32>,
    /// Its length.
    pub length: f64,
    /// Its edges.
    pub edges: usize,
    /// Whether it ends where it begins.
    pub closed: bool,
}

/// The hand-off to a mesher.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ExportReport {
    /// The edge length that it asks for.
    pub size: f64,
    /// Triangles of the linear triangulation.
    pub sub_triangles: usize,
    /// Curved triangles that were split into more than four.
    pub refined: usize,
    /// Charts that are handed over by a map with a boundary of its own.
    #[serde(default)]
    pub natural_charts: Vec<u32>,
    /// Charts that are handed over by their linear map.
    pub linear_charts: Vec<u32>,
    /// Charts that Gmsh's MeshAdapt is asked to mesh, as their maps stretch.
    #[serde(default)]
    pub adapted_charts: Vec<u32>,
    /// Curves along narrow places, where remesh.geo asks for smaller elements.
    #[serde(default)]
    pub narrow_curves: usize,
    /// Places where the boundary of a chart passes close to itself, around which remesh.geo asks for smaller elements.
    #[serde(default)]
    pub narrow_places: usize,
    /// Spikes and pits, where remesh.geo asks for smaller elements.
    #[serde(default)]
    pub spikes: usize,
    /// The least edge length that it asks for; null where all are alike.
    #[serde(default)]
    pub least_size: Option<f64>,
    /// Narrow places and spikes get no smaller elements than this, as those would be too many; null where they get what they need.
    #[serde(default)]
    pub floor: Option<f64>,
    /// Places where smaller elements are needed than the least edge length allows.
    #[serde(default)]
    pub held_places: usize,
    /// The first of them.
    #[serde(default)]
    pub held: Vec<HeldPlace>,
    /// By how much lengths are multiplied in the atlas that remesh.geo merges; 1: that is atlas.msh.
    #[serde(default = "unchanged")]
    pub enlarged: f64,
    /// Nodes that were moved so that every triangle has a normal.
    pub moved_vertices: usize,
    /// Shortest distance between two seams of a chart that share no end; null where there are no two.
    pub shortest_seam_distance: Option<f64>,
    /// What may go wrong with this edge length.
    pub warning: Option<String>,
    /// Why there is no hand-off.
    pub failure: Option<String>,
}

/// What was handed to Mmg.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MmgReport {
    /// The edge length that it is asked for, in the unit of the input.
    pub size: f64,
    /// What `-hausd` of mmgs should be, in the unit of the input.
    pub hausdorff: f64,
    /// The least edge length that mmgs is asked for; null where all are alike.
    pub least_size: Option<f64>,
    /// Whether mmgs should look for ridges itself; if not, give it `-nr`.
    pub detects_ridges: bool,
    /// Edges that it is told of as ridges.
    pub ridges: usize,
    /// Vertices at which these end, meet or turn.
    pub corners: usize,
    /// The references of named parts; empty where there are none.
    pub references: Vec<Reference>,
    /// The charts that are handed to mmg2d: all, or none.
    pub charts: usize,
    /// Why there are no charts for mmg2d.
    pub failure: Option<String>,
}

/// The reference of triangles of a named part.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reference {
    /// The number.
    pub reference: i32,
    /// The name of the part.
    pub name: String,
}

/// A place where smaller elements are needed than may be.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HeldPlace {
    /// Where, in the unit of the input.
    pub at: [f64; 3],
    /// The edge length that is needed.
    pub size: f64,
}

/// What earlier versions did to lengths.
fn unchanged() -> f64 {
    1.0
}

/// A file of the result.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Output {
    /// Its name.
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// The hash of its content.
    pub blake3: String,
}

impl Output {
    /// The entry for a file with this content.
    pub fn of(file: &str, content: &[u8]) -> Self {
        Self { file: file.to_owned(), bytes: content.len() as u64, blake3: blake3::hash(content).to_hex().to_string() }
    }
}

impl Report {
    /// Whether all of the input is certified: no component was refused.
    pub fn is_whole(&self) -> bool {
        self.status == Status::Certified && self.refused_components.is_empty()
    }

    /// The report of an input about which nothing is known yet.
    pub fn new(input: Input, settings: &Settings) -> Self {
        Self {
            schema: SCHEMA,
            planish: VERSION.to_owned(),
            input,
            settings: settings.into(),
            status: Status::Failed,
            reason: None,
            content: None,
            surface: None,
            refused_components: vec![],
            repairs: None,
            warnings: vec![],
            decomposition: None,
            refinement: None,
            labels: vec![],
            fields: vec![],
            charts: vec![],
            seams: Seams::default(),
            hand_off: None,
            mmg: None,
            outputs: vec![],
            timing: BTreeMap::new(),
        }
    }

    /// The report as it is written.
    ///
    /// # Errors
    /// Never for reports of planish's own; the signature is that of the library.
    pub fn to_json(&self) -> serde_json::Result<Vec<u8>> {
        Ok((printable_json(&serde_json::to_string_pretty(self)?) + "\n").into_bytes())
    }
}
