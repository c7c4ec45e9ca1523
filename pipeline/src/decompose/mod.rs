//! Decomposition: surface -> atlas of charts.
//!
//! A chart is connected, oriented, of genus 0, with at least one boundary loop; its loops are simple and share no
//! vertex. Any surface is cut into charts: closed ones, of any genus, of several components, with holes; one that
//! cannot be oriented is cut where its triangles disagree. A component that can be one chart is left whole.
//!
//! 1. Feature edges are found ([`Settings::feature_angle`]): creases that part one face from another. From here on each component
//!    is a task of its own ([`Monitor::together`]).
//! 2. The triangles are gathered into some hundred compact cells, by geodesic distance: what follows depends on the
//!    shape, not on the triangulation.
//! 3. Charts grow from a few dozen groups of cells: the cheapest pair of neighbours is united again and again, as
//!    long as the union is legal (its Euler number, its loops) and its area ratio, predicted by a harmonic map of the
//!    graph of cells, is small enough. This is done several ways, some of them from the two sides of the shape; the
//!    one is taken that has the fewest charts once its seams are straight.
//! 4. Seams are straightened on the triangulation itself, a little at a time, while the predicted ratio allows it; and
//!    those that are crooked even so are pulled straight, whatever the ratio.
//! 5. The outer loop of every chart is the one that is predicted to distort it least.
//!
//! What the maps themselves show too distorted is [`split()`]; ears are split by [`split_ears`]. The cost is that of
//! sorting, but for a fixed number of cells; every loop has its reason to end beside it.

mod assemble;
mod boundaries;
mod boundary_shape;
mod clearance;
mod complex;
mod contacts;
mod dual;
mod ears;
mod evaluate;
mod features;
mod finish;
mod graph_laplacian;
mod legality;
mod merge;
mod network;
mod patches;
mod predict;
mod principal_axes;
mod regions;
mod reroute;
mod search;
mod selection;
mod shortest;
mod split;
mod straighten;
mod voronoi;

use crate::atlas::{Atlas, Chart};
use crate::mesh::{SurfaceMesh, vertices_of};
use crate::monitor::{Interrupted, Monitor, batches, try_each};
use crate::topology::{ChartId, FaceId, HalfEdgeId, components};
pub use assemble::assemble;
pub(crate) use assemble::with_outer;
pub use boundary_shape::BoundaryShape;
use complex::Complex;
pub(crate) use contacts::touches_itself;
use contacts::without_contacts;
use dual::Dual;
pub use ears::{WithoutEars, split_ears};
pub use features::ridges;
use features::{min_outline, with_features};
use finish::finish;
pub use legality::Illegal;
use merge::Limits;
use patches::compact_cells;
use predict::{CellGraph, Predictions};
use search::Search;
use selection::Selection;
use split::legal;
pub(crate) use split::part_of;
pub use split::{halve, separate, split};
use voronoi::{Cells, bisect_until};

/// Why a surface has no atlas. Every surface has one.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A chart came out that is none: a fault of planish.
    #[error(transparent)]
    Illegal(#[from] Illegal),
    /// The atlas was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// What charts must respect.
///
/// ```
/// use planish_core::decompose::{Settings, decompose};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{repair, shapes};
///
/// // A square duct: a disk with a hole, but with four sharp edges along it.
/// let mesh = repair(&shapes::tube(4, 6, 3.0), &repair::Settings::default())?.mesh;
/// let charts = |settings: Settings| decompose(&mesh, &settings, &NoMonitor).map(|a| a.charts().len());
/// assert_eq!(charts(Settings::default())?, 4);
/// assert_eq!(charts(Settings { feature_angle: None, ..Settings::default() })?, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The largest area ratio of a chart (see [`crate::measure::distortion::Summary::area_ratio`]). At least 10; default 1e6.
    pub max_area_ratio: f64,
    /// The largest number of triangles of a chart; default none.
    pub max_triangles: usize,
    /// Whether all inner loops of a chart must be holes of the surface.
    pub strict_disks: bool,
    /// The dihedral angle, in degrees, above which an edge is a feature: seams follow features, and charts do not
    /// cross those that separate them. In (0, 180); default 40; none: there are no features.
    pub feature_angle: Option<f64>,
    /// The boundary that charts will have in the plane: it is their maps that are predicted.
    pub boundary: BoundaryShape,
}

impl Settings {
    /// What charts with such a boundary must respect by default.
    pub fn of(boundary: BoundaryShape) -> Self {
        Self {
            // With 3,000, bunny_stanford falls into 5 charts instead of 2, and airplane_27_holes into 28 instead of 13.
            max_area_ratio: 1e6,
            max_triangles: usize::MAX,
            strict_disks: false,
            feature_angle: Some(40.0),
            boundary,
        }
    }
}

impl Default for Settings {
    fn default() -> Self {
        Self::of(BoundaryShape::default())
    }
}

/// Cuts `mesh` into charts.
///
/// # Errors
/// [`Error`].
///
/// ```
/// use planish_core::decompose::{Settings, decompose};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{repair, shapes};
///
/// let mesh = repair(&shapes::sphere(8), &repair::Settings::default())?.mesh;
/// let atlas = decompose(&mesh, &Settings::default(), &NoMonitor)?;
/// assert_eq!(atlas.charts().len(), 2, "a closed surface is no disk");
/// let triangles: usize = atlas.charts().iter().map(|c| c.triangles().len()).sum();
/// assert_eq!(triangles, mesh.triangles().len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn decompose(mesh: &SurfaceMesh, settings: &Settings, monitor: &dyn Monitor) -> Result<Atlas, Error> {
    let (dual, feature_edges) = with_features(mesh, settings, monitor)?;
    let least = min_outline(&dual);
    let components = components(mesh.triangles().len(), mesh.edges());
    if components.len() < 2 {
        return Ok(Atlas { feature_edges, ..component(&dual, least, settings)? });
    }
    // Less is in memory while components are cut.
    let features = dual.into_features();
    let of_component = |faces: &Vec<FaceId>, monitor: &dyn Monitor| {
        let part = mesh.restricted(faces);
        let atlas = component(&Dual::of_part(&part, faces, mesh, &features, monitor), least, settings)?;
        let vertices = vertices_of(mesh.triangles(), faces);
        // They are numbered when all are there.
        let on_surface = |chart: Chart| chart.on_surface(ChartId(0), &vertices, faces);
        Ok::<Vec<Chart>, Error>(atlas.into_charts().into_iter().map(on_surface).collect())
    };
    let of_batch = |batch: Vec<Vec<FaceId>>, monitor: &dyn Monitor| {
        let mut charts = Vec::new();
        for faces in &batch {
            charts.extend(of_component(faces, monitor)?);
        }
        Ok::<_, Error>(charts)
    };
    let batches = batches(components, Vec::len, BATCH);
    let charts = try_each(monitor, batches, mesh.triangles().len(), of_batch)?;
    let mut charts: Vec<Chart> = charts.into_iter().flatten().collect();
    charts.sort_by_key(|chart| chart.faces[0]);
    for (chart, id) in charts.iter_mut().zip(0..) {
        chart.id = ChartId(id);
    }
    Ok(Atlas { charts, feature_edges })
}

/// Small components are one task until they have so many triangles: of mri_brain_iso 1,400 have a dozen each.
const BATCH: usize = 4_000;

/// Cuts a connected surface, whose features are marked, into charts. Patches between features with an outline below `least` are no
/// faces.
fn component(dual: &Dual, least: f64, settings: &Settings) -> Result<Atlas, Error> {
    let limits = Limits::new(settings);
    let (cells, complex) = cells(dual, &limits)?;
    let graph = CellGraph::new(&complex, settings.boundary);
    let mut search = Search {
        complex: &complex,
        graph: &graph,
        predictions: Predictions::default(),
        limits,
        checkpoint: &dual.checkpoint,
    };
    let selection = Selection { dual, cells: &cells, limits };
    let charts = selection.charts(&search.run()?)?;
    let charts = search.absorb(charts, least)?;
    let labels: Vec<u32> = cells.labels.iter().map(|c| charts.labels[*c as usize]).collect();
    let labels = without_contacts(dual, Cells { labels, len: charts.len }, &limits)?.labels;
    let size = |h: HalfEdgeId| graph.area(cells.labels[h.face().index()]).sqrt();
    let atlas = finish(dual, labels, limits, settings, &cells, size)?;
    dual.checkpoint.end()?;
    Ok(atlas)
}

impl Limits {
    fn new(settings: &Settings) -> Self {
        Self {
            area_ratio: settings.max_area_ratio.powf(MARGIN),
            largest_ratio: settings.max_area_ratio,
            triangles: settings.max_triangles,
            strict_disks: settings.strict_disks,
            boundary: settings.boundary,
        }
    }
}

/// Legal cells of about the same size, and their complex.
fn cells(dual: &Dual, limits: &Limits) -> Result<(Cells, Complex), Interrupted> {
    // Of eight triangles at least: smaller ones would be as jagged as the triangulation.
    let cells = compact_cells(dual, |size| (size / 8).min(CELLS), &dual.checkpoint)?;
    dual.checkpoint()?;
    let mut complex = Complex::default();
    let cells = bisect_until(dual, cells, |cells| {
        complex = Complex::new(dual, cells);
        legal(dual, &complex, limits)
    })?;
    Ok((cells, complex))
}

/// Charts grow up to this share of the decades of the largest area ratio: the prediction is not exact, and straight
/// seams change it. Larger leads to charts that must be split once they are mapped: with all of the decades, airplane_netgen
/// falls into 20 charts, 16 of them by splitting, instead of 7, and cad_rear_case into 94 instead of 53. Smaller leads to
/// more charts on smooth shapes, and to fewer, but worse ones on CAD parts: with half as much, gebco_seabed falls into 9
/// instead of 6, aorta_open into 3 instead of 2, and untangling takes twice as long on 18 meshes.
const MARGIN: f64 = 0.85;

/// Cells per component, at most. More follow the shape more closely, and every prediction costs more. With half as many,
/// cad_rear_case falls into 81 charts instead of 53, and gebco_seabed into 10 instead of 6; twice as many saved 17 charts of
/// 773 on 18 meshes of up to 19,000 triangles, and took 30 % longer to decompose them.
const CELLS: usize = 800;

#[cfg(test)]
mod tests;
