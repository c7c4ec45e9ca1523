//! The hand-off to Gmsh: `atlas.msh` and `remesh.geo`, with the edge length that the script asks for.

use super::groups::groups;
use super::sizes::{Seams, Varying, varying};
use super::{Sizes, Wanted};
use crate::formats::gmsh;
use crate::report::{ExportReport, HeldPlace};
use crate::result_files;
use planish_core::atlas::Chart;
use planish_core::certified::BoundaryFound;
use planish_core::evaluate::Plane;
use planish_core::map::natural::{Natural, natural};
use planish_core::measure::distortion::Summary;
use planish_core::measure::sizes::SizedPlace;
use planish_core::monitor::{Interrupted, Monitor};
use planish_core::subdivide::{self, LinearAtlas, subdivide};
use planish_core::topology::{ChartId, FaceId};
use planish_core::untangle;
use planish_core::vec3::unit_scale;
use planish_core::{CertifiedAtlas, CertifiedChart};

/// Maps whose conformal distortion exceeds this on a hundredth of their area are left to MeshAdapt: the other algorithms
/// of Gmsh measure lengths by the map at one point, and miss whole parts of a surface where that changes from triangle to
/// triangle. Of the charts of sixteen files that had elements below gamma 0.1 by Frontal-Delaunay, all but one (of
/// cad_fixture, at 5.5) were above 10; gebco_seabed, at 9.3, has none, and MeshAdapt cuts one of its hills off.
const STRETCHED: f64 = 10.0;

/// The same for charts that are quickly done, and whose area is scaled evenly: there MeshAdapt makes the better elements (least
/// gamma of cad_gmsh_t13, at 2.6, by Frontal-Delaunay 0.09, by MeshAdapt 0.50; of patch_10ks, at 7.1, 0.11 and 0.35).
const BENT: f64 = 2.0;

/// The same for such charts whose boundary is freed, or natural with the map that untangling starts from: their maps are linear
/// on triangles, and change from one to the next. Least gamma by Frontal-Delaunay and by MeshAdapt: of airplane_netgen, at
/// 6.3, 0.08 and 0.50; of gebco_seabed, at 3.2, 0.05 and 0.26; of the shell of cad_rear_case, at 2.3, 0.1 and 0.02.
const OPENED: f64 = 2.5;

/// A chart of less than so many squares of the size has a few dozen elements, nearly all with nodes on its boundary, and MeshAdapt
/// moves what little is inside: of one of foot_bones, of four squares, at 4.7, it left an element at gamma 0.02, where
/// Frontal-Delaunay leaves none below 0.1.
const TINY: f64 = 8.0;

/// A chart of less than so many squares of the size is quickly done: that is 10,000 elements, a few seconds.
const QUICK: f64 = 4_500.0;

/// The largest area ratio of such a chart: MeshAdapt cuts off what a map shrinks (gebco_seabed, at 5e4).
const EVEN: f64 = 100.0;

/// MeshAdapt of Gmsh looks for closest points among all triangles within this distance, in whatever unit.
const SEARCHED: f64 = 0.1;

/// The files of a hand-off, and the account of it.
#[derive(Debug)]
pub struct Export {
    /// Names and contents; none where the hand-off failed.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the report says.
    pub report: ExportReport,
}

/// Hands an atlas to Gmsh, for a mesh as it is wanted. Warns where Gmsh would do badly; a hand-off that fails
/// is told and leaves the maps as they are.
///
/// # Errors
/// [`Interrupted`].
pub fn gmsh(atlas: &CertifiedAtlas, wanted: &Wanted, monitor: &dyn Monitor) -> Result<Export, Interrupted> {
    let size = wanted.sizes.size;
    let (mesh, charts, network) = (atlas.mesh(), atlas.charts(), atlas.seams());
    let shortest_seam_distance = network.shortest_distance(mesh);
    let mut report = ExportReport { size, shortest_seam_distance, ..ExportReport::default() };
    report.warning = shortest_seam_distance.filter(|d| size > 0.5 * d).map(|d| too_coarse(size, d));
    let natural = natural_maps(charts, monitor)?;
    let straight: Vec<_> = natural.iter().map(|found| found.as_ref().map(|n| &n.map)).collect();
    let linear = match subdivide(atlas, &straight) {
        Ok(linear) => linear,
        Err(error) => {
            let failure = failure(&error, charts);
            tracing::warn!("no hand-off to Gmsh: {failure}");
            return Ok(Export { files: vec![], report: ExportReport { failure: Some(failure), ..report } });
        }
    };
    let distortions = distortions_of_written(charts, &natural, &linear);
    let algorithms = algorithms(charts, &linear, &distortions, size);
    let varying = varying(atlas, linear.curvatures(), Seams::Kept { adapted: &algorithms.adapted }, wanted);
    let mut report = counted(report, &linear, &algorithms, &varying);
    if let Some(held) = varying.held.first() {
        report.warning.get_or_insert_with(|| held_up(&wanted.sizes, &varying, held));
    }
    if let Some(warning) = &report.warning {
        tracing::warn!("hand-off to Gmsh: {warning}");
    }
    let (surfaces, curves) = (linear.charts().len(), linear.curves().len());
    let script = gmsh::Script {
        size,
        least: varying.least,
        area: mesh.area(),
        surfaces,
        curves,
        algorithms,
        order: wanted.order,
        has_array: !varying.array.is_empty(),
        heeds_finer: wanted.sizes.deviation.is_some(),
    };
    let files = files(atlas, &linear, &groups(atlas, wanted), &varying, &script);
    Ok(Export { files, report })
}

/// Maps with a boundary of their own for the charts whose maps stretch, where these do less; one entry per chart.
fn natural_maps(charts: &[CertifiedChart], monitor: &dyn Monitor) -> Result<Vec<Option<Natural>>, Interrupted> {
    let mut maps = Vec::with_capacity(charts.len());
    for certified in charts {
        let p99 = certified.distortion().conformal_p99;
        maps.push(if p99 > BENT { natural(certified.chart(), p99, monitor)? } else { None });
    }
    Ok(maps)
}

/// The distortion of each chart's map as it is written: the natural one where the subdivision took that, else the
/// certified one.
fn distortions_of_written(
    charts: &[CertifiedChart],
    natural: &[Option<Natural>],
    linear: &LinearAtlas,
) -> Vec<Summary> {
    let mut distortions: Vec<Summary> = charts.iter().map(|chart| *chart.distortion()).collect();
    for chart in linear.straight_charts() {
        if let Some(natural) = &natural[chart.index()] {
            distortions[chart.index()] = natural.distortion;
        }
    }
    distortions
}

/// The area of a chart.
pub(super) fn area_of(chart: &Chart) -> f64 {
    (0..chart.triangles().len()).map(|f| chart.area(f)).sum()
}

/// MeshAdapt where maps stretch, in a unit in which it searches little more than a tenth of an edge around a point.
fn algorithms(charts: &[CertifiedChart], linear: &LinearAtlas, distortions: &[Summary], size: f64) -> gmsh::Algorithms {
    let mut adapted = Vec::new();
    for (c, distortion) in distortions.iter().enumerate() {
        if stretches(&charts[c], linear, distortion, size) && !is_flat(linear, c) {
            adapted.push(c);
        }
    }
    let is_enlarged = !adapted.is_empty() && size < 10.0 * SEARCHED;
    gmsh::Algorithms { adapted, enlarged: if is_enlarged { 2.0 * unit_scale(size) } else { 1.0 } }
}

/// Whether the map of a chart stretches too much for the other algorithms.
fn stretches(certified: &CertifiedChart, linear: &LinearAtlas, distortion: &Summary, size: f64) -> bool {
    let chart = certified.chart();
    // What is handed over is the linear map; the distortion is that of the certified one.
    if linear.linear_charts().binary_search(&chart.id()).is_ok() {
        return true;
    }
    let squares = area_of(chart) / (size * size);
    let is_quick = (TINY..QUICK).contains(&squares) && distortion.area_ratio < EVEN;
    let is_straight = linear.straight_charts().binary_search(&chart.id()).is_ok();
    let is_harmonic = |method| !matches!(method, untangle::Method::Start | untangle::Method::Isometric);
    let is_harmonic = certified.provenance().untangle.as_ref().is_none_or(|u| is_harmonic(u.method));
    let most = match certified.provenance().boundary {
        _ if is_straight || !is_quick => STRETCHED,
        BoundaryFound::Natural if is_harmonic => STRETCHED,
        BoundaryFound::Natural | BoundaryFound::Freed { .. } => OPENED,
        BoundaryFound::Circle { .. } => BENT,
    };
    distortion.conformal_p99 > most
}

/// Whether a chart lies in a plane, which Gmsh then takes for its map.
fn is_flat(linear: &LinearAtlas, chart: usize) -> bool {
    let chart = &linear.charts()[chart];
    let points: Vec<_> = chart.nodes().iter().map(|n| linear.points()[*n as usize]).collect();
    Plane::of(&points, chart.triangles()).is_some()
}

fn files(
    atlas: &CertifiedAtlas,
    linear: &LinearAtlas,
    groups: &[gmsh::Group],
    sizes: &Varying,
    script: &gmsh::Script,
) -> Vec<(String, Vec<u8>)> {
    let mut files = vec![
        (result_files::ATLAS_MSH.to_owned(), gmsh::atlas(atlas, linear, groups)),
        (result_files::REMESH.to_owned(), gmsh::remesh(script)),
    ];
    let factor = script.algorithms.enlarged;
    if script.least.is_some() {
        files.push((result_files::SIZES.to_owned(), gmsh::on_cubes(&sizes.cubes, factor)));
    }
    if script.has_array {
        files.push((result_files::SIZES_OF_ARRAY.to_owned(), gmsh::on_triangles(&sizes.array, factor)));
    }
    if factor != 1.0 {
        files.push((result_files::ENLARGED_MSH.to_owned(), gmsh::enlarged(linear, atlas.seams(), groups, factor)));
    }
    files
}

fn counted(
    report: ExportReport,
    linear: &LinearAtlas,
    algorithms: &gmsh::Algorithms,
    varying: &Varying,
) -> ExportReport {
    ExportReport {
        narrow_curves: varying.narrow_curves,
        narrow_places: varying.narrow_places,
        spikes: varying.spikes,
        least_size: varying.least,
        floor: varying.floor,
        held_places: varying.held_places,
        held: varying.held.iter().map(|place| HeldPlace { at: place.at, size: place.size }).collect(),
        adapted_charts: algorithms.adapted.iter().map(|c| *c as u32).collect(),
        enlarged: algorithms.enlarged,
        sub_triangles: linear.triangle_count(),
        refined: linear.refined(),
        natural_charts: linear.straight_charts().iter().map(|c| c.0).collect(),
        linear_charts: linear.linear_charts().iter().map(|c| c.0).collect(),
        moved_vertices: linear.moved(),
        ..report
    }
}

/// What may go wrong, and what helps: an edge length only where it is one that `--size` takes.
fn too_coarse(size: f64, distance: f64) -> String {
    let fine = 0.499 * distance;
    let remedy = if fine.is_normal() {
        format!("give --size {fine:.4e} or less")
    } else {
        "no edge length helps where seams touch; see the warnings about the surface, and repair it there".to_owned()
    };
    format!(
        "the edge length {size:.4e} is more than half the shortest distance between two seams of a chart \
         ({distance:.4e}): triangles of neighbouring charts may come to lie on each other; {remedy}"
    )
}

/// What may go wrong where smaller sizes are needed than may be.
fn held_up(sizes: &Sizes, varying: &Varying, first: &SizedPlace) -> String {
    let [x, y, z] = first.at;
    let (least, advice) = match varying.floor {
        Some(floor) => {
            (floor, "they would take millions of elements; mesh the part of the surface that has them by itself")
        }
        None => (sizes.min, "give a smaller --size-min"),
    };
    format!(
        "at {} places elements of less than the least edge length {least:.4e} are needed, the first at ({x:.4e}, {y:.4e}, \
         {z:.4e}), of {:.4e}: elements may be bad there, or parts lost; {advice}",
        varying.held_places, first.size
    )
}

/// Why there is no hand-off, with a triangle by its number in the input.
fn failure(error: &subdivide::Error, charts: &[CertifiedChart]) -> String {
    let location = match error {
        subdivide::Error::Inverted(inverted) => source(charts, inverted.chart, inverted.face),
        subdivide::Error::NoNormal { chart, face } => source(charts, *chart, *face) + "; use a larger unit of length",
        subdivide::Error::MeetsItself { .. } | subdivide::Error::Pinched { .. } | subdivide::Error::Touches { .. } => {
            String::new()
        }
    };
    format!("{error}{location}")
}

/// Names a face of a chart by its number in the input; empty where the chart has no such face.
fn source(charts: &[CertifiedChart], chart: ChartId, face: FaceId) -> String {
    match charts.get(chart.index()).map(CertifiedChart::chart) {
        Some(chart) if face.index() < chart.triangles().len() => {
            format!(" (triangle {} of the input)", chart.source_triangle(face.index()))
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RawSettings;

    #[test]
    fn an_edge_length_is_advised_only_where_it_is_taken() {
        for distance in [3.7, 1e-9, 4.5e-308, 1e-320, 0.0] {
            let message = too_coarse(10.0, distance);
            let advised = message.split_once("--size ").and_then(|(_, rest)| rest.split(' ').next());
            let size: Option<f64> = advised.map(|a| a.parse().expect("a number"));
            assert!(size.is_none_or(|s| s < 0.5 * distance), "{message}");
            assert!(RawSettings { size, ..RawSettings::default() }.check().is_ok(), "{message}");
            assert_eq!(size.is_some(), distance > 1e-310, "{message}");
        }
    }
}
