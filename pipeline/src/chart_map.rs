//! One chart through the stages: linear map, quadratic map, untangling, certificate.

mod cut;

use crate::atlas::Chart;
use crate::certify::{self, CertifiedMap, PlanarMap, prove};
use crate::decompose;
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::boundary::{Boundary, Mids};
use crate::map::filled::FilledChart;
use crate::map::linear::{self, LinearMap, flatten_ear_arcs, linear_map};
use crate::map::quadratic::{QuadraticMap, min_det, quadratic_map};
use crate::measure::distortion;
use crate::mesh::SurfaceMesh;
use crate::monitor::{Checkpoint, Interrupted, Monitor, NoMonitor};
use crate::untangle::{self, Dirichlet, Untangled, untangle};
use cut::{Attempt, Cutter};

/// The order of the finite elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Order {
    /// Linear: mid-edge nodes stay in the middle of straight edges.
    Linear,
    /// Quadratic: curved triangles.
    #[default]
    Quadratic,
}

/// A chart with a linear map and, for quadratic elements, the harmonic map. The feasible start is certified
/// already, so that there is always something to publish.
#[derive(Clone, Debug)]
pub struct MappedChart {
    closed: FilledChart,
    linear: LinearMap,
    start: Vec<GridPoint>,
    certified_start: CertifiedMap,
    harmonic: Option<Result<QuadraticMap, sparse::Unsolvable>>,
}

impl MappedChart {
    /// The conformal distortion that 99 % of the area does not exceed: for charts with holes in the harmonic map, where
    /// there is one (untangling changes it little, and takes long where it is large), for others in the raised linear
    /// map. Noise makes many triangles of harmonic maps invalid, and such a chart is not the better for being cut.
    fn conformal_p99(&self, chart: &Chart) -> f64 {
        let nodes = match &self.harmonic {
            Some(Ok(map)) if !chart.holes().is_empty() => map.nodes(),
            _ => &self.start,
        };
        distortion::conformal_p99_of_nodes(chart, |f| self.closed.nodes(f).map(|n| nodes[n]))
    }
}

/// Why a chart cannot be mapped as a whole. All but the last mean: split it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// No linear map.
    #[error(transparent)]
    Linear(linear::Error),
    /// The raised linear map is not one-to-one in double precision.
    #[error("the chart is too distorted for one map: {0}; it must be split")]
    Start(certify::Error),
    /// The map stretches too much.
    #[error("the area ratio {ratio:.2e} of the chart is above the largest one allowed; it must be split")]
    Stretched {
        /// The area ratio.
        ratio: f64,
        /// Per triangle, the logarithm of the area scale around it.
        log_scales: Vec<f64>,
    },
    /// The map was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl From<linear::Error> for MapError {
    fn from(error: linear::Error) -> Self {
        match error {
            linear::Error::Interrupted(interrupted) => Self::Interrupted(interrupted),
            error => Self::Linear(error),
        }
    }
}

impl MapError {
    /// Per triangle, the logarithm of the area scale around it, where the chart has a map.
    fn log_scales(&self) -> Option<&[f64]> {
        if let Self::Stretched { log_scales, .. } = self { Some(log_scales) } else { None }
    }
}

/// A chart with its certified map and the account of how it was found.
#[derive(Clone, Debug)]
pub struct CertifiedChart {
    /// The map. Nodes: the vertices of the chart, then its edges, in its numbering.
    pub certified: CertifiedMap,
    /// The raised linear map, from which untangling starts: its triangles inside are straight.
    pub start: CertifiedMap,
    /// The linear map.
    pub linear: LinearMap,
    /// The harmonic map, where it was asked for and could be computed.
    pub harmonic: Option<Harmonic>,
    /// What untangling did, where there was a harmonic map.
    pub untangle: Option<untangle::Report>,
    /// Why there is no harmonic map although it was asked for: the map is the raised linear one then.
    pub unsolved: Option<sparse::Unsolvable>,
}

/// The harmonic map in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonic {
    /// Per triangle of the chart, whether it is invalid in the harmonic map.
    pub invalid: Vec<bool>,
    /// The least jacobian determinant, per unit of mollified area of the triangle in space, in the unit of the
    /// shapes.
    pub det_min: f64,
}

/// Maps `chart` linearly and, for quadratic elements, harmonically.
///
/// # Errors
/// [`MapError`]: the chart must be split.
pub fn map_chart(chart: &Chart, order: Order) -> Result<MappedChart, MapError> {
    map_within(chart, order, f64::INFINITY, &NoMonitor)
}

/// As [`map_chart`], where a chart whose certified map would exceed `max_area_ratio` need not be mapped.
///
/// # Errors
/// [`MapError`]: the chart must be split, or nobody waits for the map any more.
pub fn map_within(
    chart: &Chart,
    order: Order,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<MappedChart, MapError> {
    let checkpoint = Checkpoint::new(monitor);
    let size = chart.triangles().len();
    let closed = FilledChart::new(chart);
    checkpoint.after(size)?;
    let mids = if order == Order::Linear { Mids::Chord } else { Mids::Arc };
    let mut boundary = Boundary::circle(&closed, mids);
    let linear = linear_map(&closed, &boundary, monitor)?;
    checkpoint.end()?;
    flatten_ear_arcs(&closed, &linear, &mut boundary);
    let start = linear.degree_elevated(&closed, &boundary);
    let centres = (0..closed.loops().len()).map(|k| start[closed.centre_node(k)]).collect();
    let certified_start = prove(planar(&closed, &start, centres)).map_err(MapError::Start)?;
    checkpoint.after(size)?;
    let ratio = distortion::area_ratio(chart, &certified_start);
    let within = |ratio: f64, bound: f64| {
        let stretched = || MapError::Stretched { ratio, log_scales: distortion::log_scales(chart, &certified_start) };
        if ratio > bound { Err(stretched()) } else { Ok(()) }
    };
    within(ratio, if order == Order::Linear { max_area_ratio } else { HOPELESS * max_area_ratio })?;
    let harmonic = match (order == Order::Quadratic).then(|| quadratic_map(&closed, &boundary, monitor)) {
        None => None,
        Some(Ok(map)) => Some(Ok(map)),
        Some(Err(sparse::Error::Unsolvable(unsolvable))) => Some(Err(unsolvable)),
        Some(Err(sparse::Error::Interrupted(interrupted))) => return Err(interrupted.into()),
    };
    if let Some(Ok(map)) = &harmonic {
        let of_harmonic = distortion::area_ratio_of_nodes(chart, |f| closed.nodes(f).map(|n| map.nodes()[n]));
        within(ratio.sqrt() * of_harmonic.sqrt(), max_area_ratio)?;
    }
    checkpoint.end()?;
    Ok(MappedChart { closed, linear, start, certified_start, harmonic })
}

/// A chart whose linear map is above the largest area ratio by this factor is split at once. Below it the harmonic map
/// is asked, too, as slivers stretch linear maps more: a ratio is foretold, halfway between those of both. That is
/// right within a decade mostly, and saves untangling; what decides is the certified map.
const HOPELESS: f64 = 10.0;

/// Maps `chart`, a part of `mesh`, and splits it where it touches itself in space, cannot be mapped, would be more
/// distorted than `settings` allow, or where neither the disk nor the plane suits it but its parts, until every part is
/// right. Ends because parts are smaller, and single triangles map.
///
/// # Errors
/// [`SplitError`].
pub fn map_or_split(
    mesh: &SurfaceMesh,
    chart: Chart,
    order: Order,
    settings: &decompose::Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<(Chart, MappedChart)>, SplitError> {
    let cutter = Cutter { mesh, order, settings, monitor };
    let mut mapped = Vec::new();
    let mut waiting = vec![chart];
    while let Some(chart) = waiting.pop() {
        match cutter.attempt(&chart)? {
            Attempt::Mapped(map) => match cutter.parts(&chart, &map)? {
                Some(parts) => mapped.extend(parts),
                None => mapped.push((chart, *map)),
            },
            Attempt::Split(parts) => waiting.extend(parts.into_iter().rev()),
            // Its map is what it is.
            Attempt::Single => {
                let map = map_within(&chart, order, f64::INFINITY, monitor)?;
                mapped.push((chart, map));
            }
        }
    }
    Ok(mapped)
}

/// Why a chart has no map, split or not.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SplitError {
    /// A single triangle does not map.
    #[error(transparent)]
    Map(MapError),
    /// A part is no chart: a fault of planish.
    #[error(transparent)]
    Split(decompose::Error),
    /// The map was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl From<MapError> for SplitError {
    fn from(error: MapError) -> Self {
        match error {
            MapError::Interrupted(interrupted) => interrupted.into(),
            error => Self::Map(error),
        }
    }
}

impl From<decompose::Error> for SplitError {
    fn from(error: decompose::Error) -> Self {
        match error {
            decompose::Error::Interrupted(interrupted) => interrupted.into(),
            error => Self::Split(error),
        }
    }
}

/// Untangles the harmonic map of a chart and certifies the result; where that cannot be proven, the result is the
/// feasible start.
pub fn finish_chart(mapped: MappedChart) -> CertifiedChart {
    finish(mapped, &NoMonitor).expect("nobody interrupts")
}

/// As [`finish_chart`].
///
/// # Errors
/// [`Interrupted`].
fn finish(mapped: MappedChart, monitor: &dyn Monitor) -> Result<CertifiedChart, Interrupted> {
    let MappedChart { closed, linear, start, certified_start, harmonic } = mapped;
    let of_start = |start: CertifiedMap, linear, unsolved| CertifiedChart {
        certified: start.clone(),
        start,
        linear,
        harmonic: None,
        untangle: None,
        unsolved,
    };
    let map = match harmonic {
        None => return Ok(of_start(certified_start, linear, None)),
        Some(Err(unsolved)) => return Ok(of_start(certified_start, linear, Some(unsolved))),
        Some(Ok(map)) => map,
    };
    let mut invalid = vec![false; closed.chart_triangles()];
    map.invalid().iter().for_each(|f| invalid[f.index()] = true);
    let found = Harmonic { invalid, det_min: min_det(&closed, &map) };
    let energy = Dirichlet::new(closed.shapes());
    let Untangled { nodes, hole_centres, mut report } = untangle(&closed, &energy, &start, &map, monitor)?;
    let certified = match prove(planar(&closed, &nodes, hole_centres)) {
        Ok(certified) => certified,
        Err(_) => {
            report = report.of_start(&closed, &start, &map);
            certified_start.clone()
        }
    };
    let (harmonic, untangle) = (Some(found), Some(report));
    Ok(CertifiedChart { certified, start: certified_start, linear, harmonic, untangle, unsolved: None })
}

/// As [`finish_chart`], where `chart`, a part of `mesh`, is split and mapped again if its certified map is more distorted
/// than `settings` allow: untangling changes areas. Ends because parts are smaller; a single triangle's map is what it
/// is.
///
/// # Errors
/// [`SplitError`].
pub fn finish_or_split(
    mesh: &SurfaceMesh,
    chart: Chart,
    mapped: MappedChart,
    order: Order,
    settings: &decompose::Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<(Chart, CertifiedChart)>, SplitError> {
    let checkpoint = Checkpoint::new(monitor);
    let mut finished = Vec::new();
    let mut waiting = vec![(chart, mapped)];
    while let Some((chart, mapped)) = waiting.pop() {
        let done = finish(mapped, monitor)?;
        checkpoint.end()?;
        match split_if_stretched(mesh, &chart, &done.certified, settings, monitor)? {
            None => finished.push((chart, done)),
            Some(parts) => {
                for part in parts.into_iter().rev() {
                    waiting.extend(map_or_split(mesh, part, order, settings, monitor)?.into_iter().rev());
                }
            }
        }
    }
    Ok(finished)
}

/// The parts of a chart whose map is above the largest area ratio, unless it is a single triangle.
fn split_if_stretched(
    mesh: &SurfaceMesh,
    chart: &Chart,
    map: &CertifiedMap,
    settings: &decompose::Settings,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<Chart>>, decompose::Error> {
    if distortion::area_ratio(chart, map) <= settings.max_area_ratio {
        return Ok(None);
    }
    decompose::split(mesh, chart, Some(&distortion::log_scales(chart, map)), settings, monitor)
}

/// The part of a map that is published: the chart without its fans.
fn planar(closed: &FilledChart, nodes: &[GridPoint], hole_centres: Vec<GridPoint>) -> PlanarMap {
    let cells = (0..closed.chart_triangles()).map(|f| closed.nodes(f).map(|n| n as u32)).collect();
    PlanarMap { cells, nodes: nodes[..closed.chart_nodes()].to_vec(), hole_centres }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::{repair, shapes};

    fn parts(soup: &TriangleSoup) -> (SurfaceMesh, Vec<Chart>) {
        let mesh = repair(soup, &Default::default()).expect("repairs").mesh;
        let whole = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").into_charts();
        let settings = decompose::Settings { feature_angle: None, ..Default::default() };
        let cut = |chart| map_or_split(&mesh, chart, Order::Quadratic, &settings, &NoMonitor).expect("maps");
        let charts = whole.into_iter().flat_map(cut).map(|(chart, _)| chart).collect();
        (mesh, charts)
    }

    #[test]
    fn a_tube_of_long_facets_becomes_strips_that_unroll_and_a_fine_one_stays_whole() {
        let (mesh, strips) = parts(&shapes::tube(36, 1, 200.0));
        assert!(strips.len() >= 2, "{}", strips.len());
        for strip in &strips {
            assert!(strip.holes().is_empty());
            let natural = crate::map::natural::natural(&mesh, strip, f64::MAX, &NoMonitor)
                .expect("not interrupted")
                .expect("it unrolls");
            assert!(natural.distortion.conformal_p99 < 4.0, "{:?}", natural.distortion);
        }
        let (_, whole) = parts(&shapes::tube(36, 6, 3.0));
        assert_eq!(whole.len(), 1, "nothing stretches there");
    }

    /// Four walls of two facets each, and a lid: its corners keep it from being unrolled in one part.
    fn open_box(height: f64) -> TriangleSoup {
        let corner = |k: u32| [f64::from(k & 1), f64::from(k >> 1 & 1), height * f64::from(k >> 2)];
        let quads: [[u32; 4]; 5] = [[0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6], [4, 5, 7, 6]];
        let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
        TriangleSoup::new((0..8).map(corner).collect(), halves.collect()).expect("sound")
    }

    #[test]
    fn a_tall_box_falls_into_parts_that_unroll_and_a_low_one_stays_whole() {
        let (mesh, walls) = parts(&open_box(100.0));
        assert!((2..=3).contains(&walls.len()), "{}", walls.len());
        let unrolls =
            |part| crate::map::natural::natural(&mesh, part, f64::MAX, &NoMonitor).expect("not interrupted").is_some();
        assert!(walls.iter().all(unrolls));
        let (_, whole) = parts(&open_box(12.0));
        assert_eq!(whole.len(), 1, "it stretches, but no more than others");
    }

    #[test]
    fn what_untangling_stretches_too_much_is_split() {
        let mesh = repair(&shapes::bent_disk(32, 0.45, 1.0), &Default::default()).expect("a surface").mesh;
        let settings = decompose::Settings { max_area_ratio: 5e5, feature_angle: None, ..Default::default() };
        let disk =
            decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0);
        let parts = map_or_split(&mesh, disk, Order::Quadratic, &settings, &NoMonitor).expect("maps");
        let [(chart, mapped)] = &parts[..] else { panic!("{} parts", parts.len()) };
        let ratio = |(chart, done): &(Chart, CertifiedChart)| distortion::area_ratio(chart, &done.certified);
        let whole = (chart.clone(), finish_chart(mapped.clone()));
        assert!(ratio(&whole) > settings.max_area_ratio, "neither linear nor harmonic map foretell it");
        let finished = finish_or_split(&mesh, chart.clone(), mapped.clone(), Order::Quadratic, &settings, &NoMonitor)
            .expect("maps");
        assert!(finished.len() > 1 && finished.iter().all(|f| ratio(f) <= settings.max_area_ratio));
        assert_eq!(finished.iter().map(|f| f.0.triangles().len()).sum::<usize>(), mesh.triangles().len());
    }
}
