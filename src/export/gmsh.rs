//! The hand-off to Gmsh: `atlas.msh` and `remesh.geo`, with the edge length that the script asks for.

use crate::formats::gmsh;
use crate::report::ExportReport;
use crate::result_files;
use planish_core::atlas::Chart;
use planish_core::certified::BoundaryFound;
use planish_core::certified::NARROW;
use planish_core::evaluate::Plane;
use planish_core::map::natural::{Natural, natural};
use planish_core::measure::distortion::Summary;
use planish_core::measure::spikes::spikes;
use planish_core::monitor::{Interrupted, Monitor};
use planish_core::seams::{Curve, Passage, SeamNetwork};
use planish_core::subdivide::{self, LinearAtlas, subdivide};
use planish_core::topology::{ChartId, FaceId};
use planish_core::vec3::unit_scale;
use planish_core::{CertifiedAtlas, CertifiedChart};
use std::collections::BTreeMap;

/// Maps whose conformal distortion exceeds this on a hundredth of their area are left to MeshAdapt: the other algorithms
/// of Gmsh measure lengths by the map at one point, and miss whole parts of a surface where that changes from triangle to
/// triangle. Of the charts of sixteen files that had elements below gamma 0.1 by Frontal-Delaunay, all but one (of
/// cad_fixture, at 5.5) were above 10; gebco_seabed, at 9.3, has none, and MeshAdapt cuts one of its hills off.
const STRETCHED: f64 = 10.0;

/// The same for charts that are quickly done, and whose area is scaled evenly: there MeshAdapt makes the better elements (least
/// gamma of cad_gmsh_t13, at 2.6, by Frontal-Delaunay 0.09, by MeshAdapt 0.50; of patch_10ks, at 7.1, 0.11 and 0.35).
const BENT: f64 = 2.0;

/// The same for such charts whose boundary is freed: their maps change from triangle to triangle. Least gamma by
/// Frontal-Delaunay and by MeshAdapt: of airplane_netgen, at 6.3, 0.08 and 0.50; of gebco_seabed, at 6.9, 0.005 and 0.27; of
/// cad_box_multi chart 97, at 1.6 when it was untangled, 0.06 and 0.15.
const OPENED: f64 = 1.5;

/// A chart of less than so many squares of the size is quickly done: that is 10,000 elements, a few seconds.
const QUICK: f64 = 4_500.0;

/// The largest area ratio of such a chart: MeshAdapt cuts off what a map shrinks (gebco_seabed, at 5e4).
const EVEN: f64 = 100.0;

/// Every loop of a chart gets at least so many edges: an octagon has 0.90 of the area of its circle, a hexagon 0.83.
const EDGES_PER_LOOP: f64 = 8.0;

/// A chart is so many elements wide at least, unless it is as wide as an edge is long. By experience: more makes
/// many elements in strips that one row would fill.
const ELEMENTS_ACROSS: f64 = 1.5;

/// The same for charts that share two curves without a common end, as the two sides of a thin strip do: an edge across such a
/// chart, from curve to curve, may be one of the other chart, too (two of truck_nonmanifold).
const ACROSS_SHEETS: f64 = 3.0;

/// Charts of less than so many squares of the size get elements small enough for their whole boundary, inside, too, and half
/// of the size where MeshAdapt makes them: it measures edges at their middles, and cuts off what sticks out (a third of a
/// chart of lucy_100k of 21 squares).
const SMALL: f64 = 60.0;

/// And every curve along a narrow place at most about so many: a chart as long as the part and a thousandth as wide would
/// have as many elements as all others together.
const MOST_EDGES: f64 = 200.0;

/// Gmsh asks every size field at every step: so many balls around spikes take it no longer than the mesh itself.
const MOST_SPIKES: usize = 1_000;

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

/// Hands an atlas to Gmsh, for triangles with edges of length `size`. Warns where Gmsh would do badly; a hand-off that fails
/// is told and leaves the maps as they are.
///
/// # Errors
/// [`Interrupted`].
pub fn gmsh(atlas: &CertifiedAtlas, size: f64, monitor: &dyn Monitor) -> Result<Export, Interrupted> {
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
    let narrow = narrow(charts, network, &algorithms.adapted, size);
    let mut spikes = spikes(mesh, charts, linear.curvatures(), size);
    let narrow_curves = narrow.iter().map(|n| n.curves.len()).sum();
    let mut report = ExportReport { narrow_curves, spikes: spikes.len(), ..counted(report, &linear, &algorithms) };
    if spikes.len() > MOST_SPIKES {
        report.warning.get_or_insert_with(|| too_coarse_for_spikes(size, spikes.len()));
        spikes.truncate(MOST_SPIKES);
    }
    if let Some(warning) = &report.warning {
        tracing::warn!("hand-off to Gmsh: {warning}");
    }
    let (surfaces, curves) = (linear.charts().len(), linear.curves().len());
    let script = gmsh::Script { size, area: mesh.area(), surfaces, curves, algorithms, narrow, spikes };
    Ok(Export { files: files(atlas, &linear, &script), report })
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

/// The curves along narrow places and the small charts, by the size of elements there: half of `size`, a quarter, and so on.
/// `adapted` are the charts that MeshAdapt makes, ascending.
fn narrow(charts: &[CertifiedChart], network: &SeamNetwork, adapted: &[usize], size: f64) -> Vec<gmsh::Narrow> {
    let mut found = Vec::new();
    for halvings in 1..=gmsh::Narrow::HALVINGS {
        found.push(gmsh::Narrow { size: size * 0.5_f64.powi(halvings as i32), ..gmsh::Narrow::default() });
    }
    for (curve, wanted) in network.curves().iter().zip(wanted_sizes(charts, network)) {
        // However narrow the place, no smaller than gives that many edges.
        if let Some(class) = size_class(size, wanted.max(curve.length() / MOST_EDGES)) {
            found[class].curves.push(curve.id().index());
            found[class].longest = found[class].longest.max(curve.length());
        }
    }
    for chart in charts.iter().map(CertifiedChart::chart) {
        let Extent { area, perimeter } = Extent::of(chart, network);
        // Larger ones have smaller elements along their curves only.
        if area > SMALL * size * size {
            continue;
        }
        let is_adapted = adapted.binary_search(&chart.id().index()).is_ok();
        let inside = if is_adapted { 0.5 * size } else { size };
        if let Some(class) = size_class(size, inside.min(perimeter / EDGES_PER_LOOP)) {
            found[class].surfaces.push(chart.id().index());
        }
    }
    found.retain(|n| !n.curves.is_empty() || !n.surfaces.is_empty());
    found
}

/// The class for elements of the `wanted` size: 0 for half of `size`, 1 for a quarter, and so on; none where `size` itself
/// will do.
fn size_class(size: f64, wanted: f64) -> Option<usize> {
    if wanted < NARROW * size {
        let halvings = (size / wanted).log2().round();
        Some(halvings.clamp(1.0, f64::from(gmsh::Narrow::HALVINGS)) as usize - 1)
    } else {
        None
    }
}

/// The area of a chart.
fn area_of(chart: &Chart) -> f64 {
    (0..chart.triangles().len()).map(|f| chart.area(f)).sum()
}

/// The length of a loop.
fn length_of(turn: &[Passage], network: &SeamNetwork) -> f64 {
    turn.iter().map(|p| network.curves()[p.curve.index()].length()).sum()
}

/// How large a chart is, in the unit of the input.
struct Extent {
    area: f64,
    perimeter: f64,
}

impl Extent {
    fn of(chart: &Chart, network: &SeamNetwork) -> Self {
        let loops = network.loops(chart.id());
        Self { area: area_of(chart), perimeter: loops.iter().map(|turn| length_of(turn, network)).sum() }
    }

    /// The width of a strip of any length, the radius of a disk.
    fn width(&self) -> f64 {
        2.0 * self.area / self.perimeter
    }
}

/// The largest size of elements along each curve that its charts can do with.
///
/// Loops need a few edges each: Gmsh leaves charts with two nodes on their boundary out, and two charts with the same three
/// nodes become the same triangle. A chart needs elements as small as it is wide, and a curve one edge.
fn wanted_sizes(charts: &[CertifiedChart], network: &SeamNetwork) -> Vec<f64> {
    let mut wanted: Vec<f64> = network.curves().iter().map(Curve::length).collect();
    let sheets = sheets(charts.len(), network);
    for chart in charts.iter().map(CertifiedChart::chart) {
        let across = if sheets[chart.id().index()] { ACROSS_SHEETS } else { ELEMENTS_ACROSS };
        let width = Extent::of(chart, network).width() / across;
        for turn in network.loops(chart.id()) {
            let size = width.min(length_of(turn, network) / EDGES_PER_LOOP);
            for passage in turn {
                let known = &mut wanted[passage.curve.index()];
                *known = known.min(size);
            }
        }
    }
    wanted
}

/// Per chart, whether it shares two curves without a common end with another.
fn sheets(charts: usize, network: &SeamNetwork) -> Vec<bool> {
    // The ends of the curves that each pair of charts has been found to share.
    let mut shared: BTreeMap<[usize; 2], Vec<[usize; 2]>> = BTreeMap::new();
    let mut are_sheets = vec![false; charts];
    for curve in network.curves() {
        for [a, b] in pairs_beside(curve) {
            let others = shared.entry([a, b]).or_default();
            if others.iter().any(|other| are_disjoint(*other, curve.ends())) {
                are_sheets[a] = true;
                are_sheets[b] = true;
            }
            others.push(curve.ends());
        }
    }
    are_sheets
}

/// The pairs of charts that meet along a curve, each with the smaller number first. A curve may have more than two sides.
fn pairs_beside(curve: &Curve) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    for first in curve.sides() {
        for second in curve.sides() {
            let pair = [first.chart.index(), second.chart.index()];
            if pair[0] < pair[1] {
                pairs.push(pair);
            }
        }
    }
    pairs
}

/// Whether two curves with these ends have no end in common.
fn are_disjoint(ends: [usize; 2], others: [usize; 2]) -> bool {
    ends.iter().all(|end| !others.contains(end))
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
    let is_quick = area_of(chart) < QUICK * size * size && distortion.area_ratio < EVEN;
    let is_straight = linear.straight_charts().binary_search(&chart.id()).is_ok();
    let most = match certified.provenance().boundary {
        _ if is_straight || !is_quick => STRETCHED,
        BoundaryFound::Natural => STRETCHED,
        BoundaryFound::Freed { .. } => OPENED,
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

fn files(atlas: &CertifiedAtlas, linear: &LinearAtlas, script: &gmsh::Script) -> Vec<(String, Vec<u8>)> {
    let mut files = vec![
        (result_files::ATLAS_MSH.to_owned(), gmsh::atlas(atlas, linear)),
        (result_files::REMESH.to_owned(), gmsh::remesh(script)),
    ];
    let factor = script.algorithms.enlarged;
    if factor != 1.0 {
        files.push((result_files::ENLARGED_MSH.to_owned(), gmsh::enlarged(linear, atlas.seams(), factor)));
    }
    files
}

fn counted(report: ExportReport, linear: &LinearAtlas, algorithms: &gmsh::Algorithms) -> ExportReport {
    ExportReport {
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

fn too_coarse_for_spikes(size: f64, spikes: usize) -> String {
    format!(
        "the edge length {size:.4e} is too long for {spikes} places in spikes and pits, of which remesh.geo looks after \
         {MOST_SPIKES}: others may be cut off; give --size {:.4e} or less",
        0.5 * size
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
