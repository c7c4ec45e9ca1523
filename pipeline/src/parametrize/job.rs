//! One chart through the stages: linear map, quadratic map, untangling, certificate.

use super::cut::{Attempt, Cutter, Mapped};
use super::divided::{Piece, divided, each};
use super::join::joined;
use crate::atlas::Chart;
use crate::certified::{BoundaryFound, CertifiedChart, Harmonic, LinearSummary, Provenance};
use crate::certify::{self, CertifiedMap, PlanarMap, prove};
use crate::decompose;
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::boundary::{Boundary, Mids};
use crate::map::filled::FilledChart;
use crate::map::linear::{self, LinearMap, flatten_ear_arcs, linear_map};
use crate::map::natural::{
    EVEN, NaturalStart, NoNatural, boundary_first_start, freed_start, natural_start, start_through, unfolded_start,
};
use crate::map::quadratic::{QuadraticMap, min_det, quadratic_map};
use crate::measure::distortion;
use crate::mesh::TriangleShape;
use crate::monitor::{Checkpoint, Interrupted, Monitor, NoMonitor};
use crate::refine;
use crate::settings::{BoundaryShape, ChartSettings, Order, OutOfRange};
use crate::topology::FaceId;
use crate::untangle::{self, Dirichlet, FromIsometry, Isometric, Objective, Untangled, descend, untangle};
use std::cell::LazyCell;
use std::sync::OnceLock;

/// A chart that is to be mapped, and what its map depends on: a value of its own, which needs neither the surface nor the
/// other charts, and so can be done anywhere.
///
/// ```
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{Plan, Settings, repair, shapes};
///
/// let settings = Settings::default();
/// let mesh = repair(&shapes::finger(12, 22), &settings.repair)?.mesh;
/// let mut plan = Plan::new(mesh, &settings, &NoMonitor)?;
/// let job = plan.jobs.remove(0);
/// let triangles = job.chart.triangles().len();
/// // A chart may fall into several, where one map would stretch it too much; together they are the chart.
/// let certified = job.run(&NoMonitor)?;
/// assert_eq!(certified.iter().map(|c| c.chart().triangles().len()).sum::<usize>(), triangles);
/// assert!(certified.iter().all(|c| c.distortion().area_ratio <= settings.decompose.max_area_ratio));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct ChartJob {
    /// The chart.
    pub chart: Chart,
    /// What its map depends on.
    pub settings: ChartSettings,
    begun: Begun,
}

/// How far the maps of a chart are.
#[derive(Clone, Debug)]
enum Begun {
    /// Not at all.
    Not,
    /// The chart was refined, and this is a map of it.
    Refined(Box<Inherited>),
    /// They are made.
    Done(Box<Maps>),
}

/// A chart with a linear map and, for quadratic elements, the harmonic map. The feasible start is certified
/// already, so that there is always something to publish.
#[derive(Clone, Debug)]
pub struct MappedChart {
    pub(super) chart: Chart,
    pub(super) settings: ChartSettings,
    pub(super) maps: Maps,
}

/// The maps of a chart before untangling.
#[derive(Clone, Debug)]
pub(super) struct Maps {
    filled: FilledChart,
    linear: LinearMap,
    start: Vec<GridPoint>,
    pub(super) certified_start: CertifiedMap,
    harmonic: Option<Result<QuadraticMap, sparse::Unsolvable>>,
    pub(super) boundary: BoundaryFound,
    p99: Quantiles,
}

/// Conformal distortions that 99 % of the area do not exceed, once they were asked for.
#[derive(Clone, Debug)]
struct Quantiles {
    of_start: OnceLock<f64>,
    of_harmonic: OnceLock<f64>,
}

impl Maps {
    /// The conformal distortion that 99 % of the area does not exceed: for charts with holes in the harmonic map, where
    /// there is one (untangling changes it little, and takes long where it is large), for others in the linear map, its degree
    /// elevated. Noise makes many triangles of harmonic maps invalid, and such a chart is not the better for being cut.
    pub(super) fn conformal_p99(&self, chart: &Chart) -> f64 {
        match &self.harmonic {
            Some(Ok(map)) if !chart.holes().is_empty() && !self.boundary.is_own() => self.p99_of_harmonic(chart, map),
            _ => self.p99_of_start(chart),
        }
    }

    /// The same, as it is to be expected when the map is untangled, with holes or without: that of the harmonic map, and where
    /// that is invalid on a hundredth of the area, more than that of the linear map.
    pub(super) fn expected_p99(&self, chart: &Chart) -> f64 {
        match &self.harmonic {
            Some(Ok(map)) => {
                let of_harmonic = self.p99_of_harmonic(chart, map);
                if of_harmonic < f64::MAX { of_harmonic } else { UNTANGLED * self.p99_of_start(chart) }
            }
            Some(Err(_)) | None => self.p99_of_start(chart),
        }
    }

    fn p99_of_start(&self, chart: &Chart) -> f64 {
        *self.p99.of_start.get_or_init(|| self.p99_of_nodes(chart, &self.start))
    }

    fn p99_of_harmonic(&self, chart: &Chart, map: &QuadraticMap) -> f64 {
        *self.p99.of_harmonic.get_or_init(|| self.p99_of_nodes(chart, map.nodes()))
    }

    fn p99_of_nodes(&self, chart: &Chart, nodes: &[GridPoint]) -> f64 {
        distortion::conformal_p99_of_nodes(chart, |f| self.filled.nodes(f).map(|n| nodes[n]))
    }

    /// Per triangle of the chart, the share of energy that a bisection would save; nothing where there is no harmonic map.
    pub(super) fn shares_saved(&self) -> Vec<f64> {
        match &self.harmonic {
            Some(Ok(map)) => refine::shares_saved(&self.filled, map.uv()),
            _ => vec![],
        }
    }

    /// What the map of a finer chart inherits, whose vertices lie at `uv` in the linear map.
    pub(super) fn inherited(&self, chart: &Chart, uv: impl FnOnce(&[GridPoint]) -> Vec<GridPoint>) -> Inherited {
        let conformal_p99 = self.p99_of_start(chart);
        let uv = self.boundary.is_own().then(|| uv(&self.linear.uv()[..self.filled.chart_vertices()]));
        Inherited { boundary: self.boundary, uv, method: self.linear.method(), conformal_p99 }
    }

    /// Per triangle of the chart, its longest edge.
    pub(super) fn longest_edges(&self) -> Vec<f64> {
        self.filled.shapes()[..self.filled.chart_triangles()].iter().map(|shape| shape.longest()).collect()
    }

    /// How many of the chart's triangles are invalid in its harmonic map; 0 where there is none.
    pub(super) fn invalid(&self) -> usize {
        match &self.harmonic {
            Some(Ok(map)) => map.invalid().len(),
            _ => 0,
        }
    }

    /// Their share.
    pub(super) fn invalid_share(&self, chart: &Chart) -> f64 {
        self.invalid() as f64 / chart.triangles().len() as f64
    }
}

/// How much more than linear maps those stretch at least that are untangled where a hundredth of the area of the harmonic one is
/// invalid. By experience: 2.8 times in gebco_seabed_55cl, 250 and more in milk_truck and lucy_100k.
const UNTANGLED: f64 = 2.0;

/// Why a chart cannot be mapped as a whole. All but the last mean: split it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MapError {
    /// No linear map.
    #[error(transparent)]
    Linear(linear::Error),
    /// The linear map, its degree elevated, is not one-to-one in double precision.
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
    pub(super) fn log_scales(&self) -> Option<&[f64]> {
        if let Self::Stretched { log_scales, .. } = self { Some(log_scales) } else { None }
    }
}

impl ChartJob {
    /// The job to map `chart`.
    pub fn new(chart: Chart, settings: ChartSettings) -> Self {
        Self { chart, settings, begun: Begun::Not }
    }

    /// The job to map `chart`, which was refined: at worst by the map `inherited`.
    pub(super) fn refined(chart: Chart, settings: ChartSettings, inherited: Inherited) -> Self {
        Self { chart, settings, begun: Begun::Refined(Box::new(inherited)) }
    }

    /// Maps the chart, and splits it where it touches itself in space, cannot be mapped, would be more distorted than the
    /// settings allow, or where neither the disk nor the plane suits it but its parts, until every part is right. Ends
    /// because parts are smaller, and single triangles map.
    ///
    /// # Errors
    /// [`ChartError`].
    pub fn map(self, monitor: &dyn Monitor) -> Result<Vec<MappedChart>, ChartError> {
        let Self { chart, settings, begun } = self;
        settings.check()?;
        let parts = match begun {
            Begun::Not => Self::new(chart, settings).mapped_parts(monitor)?,
            Begun::Done(maps) => return Ok(vec![MappedChart { chart, settings, maps: *maps }]),
            Begun::Refined(inherited) => match finer_maps(&chart, &settings, *inherited, monitor) {
                Ok(maps) => vec![(chart, maps)],
                Err(MapError::Interrupted(interrupted)) => return Err(interrupted.into()),
                // As if it were a new one.
                Err(_) => Self::new(chart, settings).mapped_parts(monitor)?,
            },
        };
        let freed = |(chart, maps): Mapped, monitor: &dyn Monitor| freed_or_cut(chart, &settings, maps, monitor);
        let found = each(parts, monitor, freed)?;
        let mapped = |(chart, maps)| MappedChart { chart, settings, maps };
        Ok(found.into_iter().flatten().map(mapped).collect())
    }

    /// The chart with its maps, or its parts with theirs, before any of them is freed from the disk.
    pub(super) fn mapped_parts(self, monitor: &dyn Monitor) -> Result<Vec<Mapped>, ChartError> {
        let settings = self.settings;
        settings.check()?;
        let cutter = Cutter { settings: &settings, monitor };
        let parts = match cutter.attempt(&self.chart)? {
            Attempt::Mapped(maps) => return cutter.whole_or_parts(self.chart, *maps),
            Attempt::Single => return cutter.single(self.chart),
            Attempt::Split(parts) => parts,
        };
        let look = |part: Chart, monitor: &dyn Monitor| {
            let cutter = Cutter { monitor, ..cutter };
            Ok::<_, ChartError>(match cutter.attempt(&part)? {
                Attempt::Mapped(maps) => Piece::Done(cutter.whole_or_parts(part, *maps)?),
                Attempt::Single => Piece::Done(cutter.single(part)?),
                Attempt::Split(parts) => Piece::Divided(parts),
            })
        };
        let mapped = divided(parts, monitor, |_| Ok(()), look)?.into_iter().flatten().collect();
        // Joined parts have natural boundaries.
        match settings.decompose.boundary {
            BoundaryShape::Natural => joined(&cutter, &self.chart, mapped),
            BoundaryShape::Circle => Ok(mapped),
        }
    }

    /// Maps, untangles and certifies the chart, split where it must be: [`Self::map`], and [`MappedChart::untangle`] for
    /// each part.
    ///
    /// # Errors
    /// [`ChartError`].
    pub fn run(self, monitor: &dyn Monitor) -> Result<Vec<CertifiedChart>, ChartError> {
        let mut certified = Vec::new();
        for mapped in self.map(monitor)? {
            certified.extend(mapped.untangle(monitor)?);
        }
        Ok(certified)
    }
}

impl MappedChart {
    /// The job whose maps these are: nothing is left to be mapped.
    pub(super) fn into_job(self) -> ChartJob {
        ChartJob { chart: self.chart, settings: self.settings, begun: Begun::Done(Box::new(self.maps)) }
    }

    /// The chart.
    pub fn chart(&self) -> &Chart {
        &self.chart
    }

    /// Untangles the harmonic map and certifies the result; where that cannot be proven, the result is the feasible
    /// start. A chart whose certified map is more distorted than the settings allow is split, and its parts are mapped
    /// again: untangling changes areas. Ends because parts are smaller; a single triangle's map is what it is.
    ///
    /// # Errors
    /// [`ChartError`].
    pub fn untangle(self, monitor: &dyn Monitor) -> Result<Vec<CertifiedChart>, ChartError> {
        let settings = self.settings;
        let largest = settings.decompose.max_area_ratio;
        let mut certified = Vec::new();
        let mut waiting = vec![self];
        while let Some(MappedChart { chart, maps, .. }) = waiting.pop() {
            let proven = untangle_and_certify(&chart, maps, largest, monitor)?;
            let ratio = distortion::area_ratio(&chart, &proven.map);
            let parts = if ratio > largest {
                let scales = distortion::log_scales(&chart, &proven.map);
                decompose::split(&chart, Some(&scales), &settings.decompose, monitor)?
            } else {
                None
            };
            let Some(parts) = parts else {
                certified.push(proven.of(chart, ratio));
                continue;
            };
            for chart in parts.into_iter().rev() {
                waiting.extend(ChartJob::new(chart, settings).map(monitor)?.into_iter().rev());
            }
        }
        Ok(certified)
    }
}

/// Maps, untangles and certifies a chart as it is, with its boundary on the circle, however much that distorts it.
///
/// # Errors
/// [`MapError`]: the chart must be split, as [`ChartJob::run`] does.
pub fn parametrize_chart(chart: Chart, order: Order) -> Result<CertifiedChart, MapError> {
    let maps = map_whole(&chart, order, BoundaryShape::Circle, f64::INFINITY, &NoMonitor)?;
    let proven = untangle_and_certify(&chart, maps, f64::INFINITY, &NoMonitor)?;
    let ratio = distortion::area_ratio(&chart, &proven.map);
    Ok(proven.of(chart, ratio))
}

/// Why a chart has no map, split or not.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChartError {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
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

impl From<MapError> for ChartError {
    fn from(error: MapError) -> Self {
        match error {
            MapError::Interrupted(interrupted) => interrupted.into(),
            error => Self::Map(error),
        }
    }
}

impl From<decompose::Error> for ChartError {
    fn from(error: decompose::Error) -> Self {
        match error {
            decompose::Error::Interrupted(interrupted) => interrupted.into(),
            error => Self::Split(error),
        }
    }
}

/// Maps the whole of `chart` linearly and, for quadratic elements, harmonically. One whose certified map would exceed
/// `max_area_ratio` need not be mapped.
///
/// # Errors
/// [`MapError`]: the chart must be split, or nobody waits for the map any more.
pub(super) fn map_whole(
    chart: &Chart,
    order: Order,
    shape: BoundaryShape,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Maps, MapError> {
    if shape == BoundaryShape::Circle {
        return map_to_disk(chart, order, None, max_area_ratio, monitor);
    }
    let start = match natural_start(chart, max_area_ratio, monitor)? {
        Ok(start) => start,
        Err(why) => return map_to_disk(chart, order, Some(why), max_area_ratio, monitor),
    };
    let conformal_p99 = start.conformal_p99;
    if conformal_p99 > STRETCHED {
        // The disk may be better, where it has a map at all.
        match map_to_disk(chart, order, Some(NoNatural::Stretched { conformal_p99 }), max_area_ratio, monitor) {
            Ok(maps) if maps.conformal_p99(chart) < conformal_p99 => return Ok(maps),
            Err(MapError::Interrupted(interrupted)) => return Err(interrupted.into()),
            Ok(_) | Err(_) => {}
        }
    }
    FeasibleStart::off_circle(start, BoundaryFound::Natural).mapped(order, monitor)
}

/// Where a natural map stretches a hundredth of the area more than this, that of the disk is looked at, too: rings of
/// needles in cad_rear_case have natural maps at 1,000 to 90,000, all of whose triangles are invalid. By experience: the
/// disk stretches less than this only what is round already.
const STRETCHED: f64 = 5.0;

/// A map of a refined chart that comes from one of it before.
#[derive(Clone, Debug)]
pub(super) struct Inherited {
    /// The boundary before.
    pub boundary: BoundaryFound,
    /// The uv of all vertices in the linear map before; none where its boundary was the circle, which arcs must follow anew.
    pub uv: Option<Vec<GridPoint>>,
    /// How that was found.
    pub method: linear::Method,
    /// The conformal distortion that 99 % of the area do not exceed in it.
    pub conformal_p99: f64,
}

/// The maps of a chart with the natural boundary that is found at once; none where that is not found, or scales areas by more
/// than [`EVEN`].
pub(super) fn natural_maps(chart: &Chart, order: Order, monitor: &dyn Monitor) -> Result<Option<Maps>, MapError> {
    match boundary_first_start(chart, EVEN, monitor)? {
        Some(start) => FeasibleStart::off_circle(start, BoundaryFound::Natural).mapped(order, monitor).map(Some),
        None => Ok(None),
    }
}

/// The maps of a refined chart: with its natural boundary, where that is found at once and stretches no more than the boundary
/// before; else with that, and a map inside that is known to be one-to-one.
pub(super) fn finer_maps(
    chart: &Chart,
    settings: &ChartSettings,
    inherited: Inherited,
    monitor: &dyn Monitor,
) -> Result<Maps, MapError> {
    let ChartSettings { order, ref decompose, .. } = *settings;
    let most = decompose.max_area_ratio;
    if decompose.boundary == BoundaryShape::Natural
        && let Some(start) = boundary_first_start(chart, most, monitor)?
        && start.conformal_p99 <= inherited.conformal_p99
    {
        return FeasibleStart::off_circle(start, BoundaryFound::Natural).mapped(order, monitor);
    }
    let Inherited { boundary, uv, method, .. } = inherited;
    if let Some(uv) = uv
        && let Some(start) = start_through(chart, uv, method, monitor)?
    {
        return FeasibleStart::off_circle(start, boundary).mapped(order, monitor);
    }
    let why_none = if let BoundaryFound::Circle { why_none } = boundary { why_none } else { None };
    map_to_disk(chart, order, why_none, most, monitor)
}

/// The chart with the best map that is found for it ([`freed_where_stretched`]), or its parts with theirs, where it has many
/// triangles and all maps stretch it.
pub(super) fn freed_or_cut(
    chart: Chart,
    settings: &ChartSettings,
    maps: Maps,
    monitor: &dyn Monitor,
) -> Result<Vec<(Chart, Maps)>, ChartError> {
    let maps = freed_where_stretched(&chart, settings, maps, monitor)?;
    let Some(parts) = (Cutter { settings, monitor }).parts_of_large(&chart, &maps)? else {
        return Ok(vec![(chart, maps)]);
    };
    let freed = |(chart, maps): Mapped, monitor: &dyn Monitor| {
        let maps = freed_where_stretched(&chart, settings, maps, monitor)?;
        Ok((chart, maps))
    };
    each(parts, monitor, freed)
}

/// The maps of a chart with another boundary, where that stretches less. Those on the circle for want of a natural one get a
/// natural one inside which a linear map was unfolded, or one that is freed from the disk; those whose natural map is
/// stretched all the same, as long triangles cannot follow it (of a menger sponge 290 of 3,200 above 100, of milk_truck one
/// at 58,000, and Gmsh doubled a triangle there), one that is freed from that. This comes after cutting: parts with natural
/// boundaries are better still.
fn freed_where_stretched(
    chart: &Chart,
    settings: &ChartSettings,
    maps: Maps,
    monitor: &dyn Monitor,
) -> Result<Maps, ChartError> {
    if chart.triangles().len() > FREED {
        return Ok(maps);
    }
    let before = maps.expected_p99(chart);
    let (why_none, bearable, gain) = match maps.boundary {
        BoundaryFound::Circle { why_none: Some(why_none) } => (why_none, ROUND, 1.0),
        BoundaryFound::Natural => (NoNatural::Stretched { conformal_p99: before }, UNFOLLOWED, HALVED),
        _ => return Ok(maps),
    };
    if before <= bearable {
        return Ok(maps);
    }
    let largest = settings.decompose.max_area_ratio;
    let is_better = |start: &NaturalStart| start.conformal_p99 < gain * before;
    if let NoNatural::Folded { .. } = why_none
        && let Some(start) = unfolded_start(chart, largest, monitor)?.filter(is_better)
    {
        return Ok(FeasibleStart::off_circle(start, BoundaryFound::Natural).mapped(settings.order, monitor)?);
    }
    match freed_start(chart, maps.linear.uv(), largest, monitor)?.filter(is_better) {
        Some(start) => {
            let freed = FeasibleStart::off_circle(start, BoundaryFound::Freed { why_none });
            Ok(freed.mapped(settings.order, monitor)?)
        }
        None => Ok(maps),
    }
}

/// Charts that the disk stretches no more than this on all but a hundredth of their area stay there. By experience: what is as
/// round (rings of CAD parts at 1.1, halves of rocker_arm_g1 at 1.5) is stretched more by a map near an isometry.
const ROUND: f64 = 2.0;

/// Natural maps that stretch no more than this on all but a hundredth of their area stay: small charts of foot_bones, at 5 to 9,
/// have worse elements when they are freed; rear_case's shell, at 13, and all worse ones that were looked at have better ones.
const UNFOLLOWED: f64 = 10.0;

/// So do those of which freeing leaves more than this share of the stretch. By experience, as above.
const HALVED: f64 = 0.5;

/// Charts with more triangles are not freed: of 10,000 it takes a second or two. By experience, as larger ones are rare.
const FREED: usize = 20_000;

/// As [`map_whole`], with the boundary on the circle. `why_none` is the reason, where the natural one was asked for.
fn map_to_disk(
    chart: &Chart,
    order: Order,
    why_none: Option<NoNatural>,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Maps, MapError> {
    let checkpoint = Checkpoint::new(monitor);
    let start = FeasibleStart::on_disk(chart, order, why_none, monitor, &checkpoint)?;
    let of_start = distortion::area_ratio(chart, &start.certified);
    if order == Order::Linear {
        start.refuse_above(max_area_ratio, of_start, chart)?;
        checkpoint.end()?;
        return Ok(start.with_harmonic(None));
    }
    start.refuse_above(HOPELESS * max_area_ratio, of_start, chart)?;
    let harmonic = start.harmonic(monitor)?;
    if let Ok(map) = &harmonic {
        let nodes = |f: usize| start.filled.nodes(f).map(|n| map.nodes()[n]);
        let of_harmonic = distortion::area_ratio_of_nodes(chart, nodes);
        // What untangling will make of it lies between both.
        start.refuse_above(max_area_ratio, of_start.sqrt() * of_harmonic.sqrt(), chart)?;
    }
    checkpoint.end()?;
    Ok(start.with_harmonic(Some(harmonic)))
}

/// The linear map of a chart, of degree elevated and proven: where untangling begins, and what is published where nothing
/// better is found.
struct FeasibleStart {
    filled: FilledChart,
    boundary: Boundary,
    linear: LinearMap,
    nodes: Vec<GridPoint>,
    certified: CertifiedMap,
    found: BoundaryFound,
    p99: OnceLock<f64>,
}

impl FeasibleStart {
    /// A start with a boundary that is not on the circle.
    fn off_circle(start: NaturalStart, found: BoundaryFound) -> Self {
        let NaturalStart { filled, boundary, linear, nodes, certified, conformal_p99 } = start;
        Self { filled, boundary, linear, nodes, certified, found, p99: conformal_p99.into() }
    }

    /// All maps with this boundary, however they scale areas: that was looked at when it was chosen.
    fn mapped(self, order: Order, monitor: &dyn Monitor) -> Result<Maps, MapError> {
        let harmonic = match order {
            Order::Linear => None,
            Order::Quadratic => Some(self.harmonic(monitor)?),
        };
        Checkpoint::new(monitor).end()?;
        Ok(self.with_harmonic(harmonic))
    }

    /// The harmonic map with this boundary; where its system cannot be solved, there is the start.
    fn harmonic(&self, monitor: &dyn Monitor) -> Result<Result<QuadraticMap, sparse::Unsolvable>, Interrupted> {
        match quadratic_map(&self.filled, &self.boundary, monitor) {
            Ok(map) => Ok(Ok(map)),
            Err(sparse::Error::Unsolvable(unsolvable)) => Ok(Err(unsolvable)),
            Err(sparse::Error::Interrupted(interrupted)) => Err(interrupted),
        }
    }

    /// `why_none`: why the boundary is not a natural one, where that was asked for.
    fn on_disk(
        chart: &Chart,
        order: Order,
        why_none: Option<NoNatural>,
        monitor: &dyn Monitor,
        checkpoint: &Checkpoint,
    ) -> Result<Self, MapError> {
        let triangles = chart.triangles().len();
        let filled = FilledChart::new(chart);
        checkpoint.after(triangles)?;
        // Linear elements have straight edges along the boundary, too.
        let mids = if order == Order::Linear { Mids::Chord } else { Mids::Arc };
        let mut boundary = Boundary::circle(&filled, mids);
        let linear = linear_map(&filled, &boundary, monitor)?;
        checkpoint.end()?;
        // The boundary is final from here on: harmonic map, start and result share it.
        flatten_ear_arcs(&filled, &linear, &mut boundary);
        let nodes = linear.degree_elevated(&filled, &boundary);
        let hole_centres = (0..filled.loops().len()).map(|k| nodes[filled.centre_node(k)]).collect();
        let certified = prove(planar(&filled, &nodes, hole_centres)).map_err(MapError::Start)?;
        checkpoint.after(triangles)?;
        let found = BoundaryFound::Circle { why_none };
        Ok(Self { filled, boundary, linear, nodes, certified, found, p99: OnceLock::new() })
    }

    /// Refuses a chart whose area `ratio` is above `bound`, with the scales that show where to split it.
    fn refuse_above(&self, bound: f64, ratio: f64, chart: &Chart) -> Result<(), MapError> {
        if ratio > bound {
            return Err(MapError::Stretched { ratio, log_scales: distortion::log_scales(chart, &self.certified) });
        }
        Ok(())
    }

    fn with_harmonic(self, harmonic: Option<Result<QuadraticMap, sparse::Unsolvable>>) -> Maps {
        let Self { filled, linear, nodes, certified, found, p99, .. } = self;
        let p99 = Quantiles { of_start: p99, of_harmonic: OnceLock::new() };
        Maps { filled, linear, start: nodes, certified_start: certified, harmonic, boundary: found, p99 }
    }
}

/// A chart whose linear map is above the largest area ratio by this factor is split at once. Below it the harmonic map
/// is asked, too, as slivers stretch linear maps more: a ratio is predicted, halfway between those of both. That is
/// right within a decade mostly, and saves untangling; what decides is the certified map.
const HOPELESS: f64 = 10.0;

/// A certified map, and how it was found.
struct ProvenMap {
    map: CertifiedMap,
    start: CertifiedMap,
    provenance: Provenance,
}

impl ProvenMap {
    /// The map as that of `chart`; `area_ratio` is its own.
    fn of(self, chart: Chart, area_ratio: f64) -> CertifiedChart {
        CertifiedChart::new(chart, self.map, self.start, self.provenance, area_ratio)
    }
}

/// Untangles the harmonic map, if there is one, and certifies the result; where that cannot be proven, it is the feasible start.
/// Where the boundary is freed, and where it is natural and the result stretches far more than the start, the harmonic map is
/// wanted only if it is valid and as near an isometry as the start. Else the result is a map inside the same boundary that is nearer to
/// one. That may be more stretched than the start by angles, and meshers follow it better all the same: areas count as much.
fn untangle_and_certify(
    chart: &Chart,
    maps: Maps,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<ProvenMap, Interrupted> {
    let Maps { filled, linear, start, certified_start, harmonic, boundary, p99: known } = maps;
    let linear =
        LinearSummary { folded: linear.folded(), edges_changed: linear.edges_changed(), method: linear.method() };
    let (harmonic, unsolved) = match harmonic {
        None => (None, None),
        Some(Err(unsolved)) => (None, Some(unsolved)),
        Some(Ok(map)) => (Some(map), None),
    };
    let Some(map) = harmonic else {
        let provenance = Provenance { boundary, linear, harmonic: None, untangle: None, unsolved };
        return Ok(ProvenMap { map: certified_start.clone(), start: certified_start, provenance });
    };
    let mut invalid = vec![false; filled.chart_triangles()];
    map.invalid().iter().for_each(|f| invalid[f.index()] = true);
    let harmonic = Some(Harmonic { invalid, det_min: min_det(&filled, &map) });
    let proven = |nodes: &[GridPoint], centres: Vec<GridPoint>| prove(planar(&filled, nodes, centres)).ok();
    let p99 = |map: &CertifiedMap| distortion::conformal_p99_of_nodes(chart, |f| nodes_of(map, f));
    let measure = LazyCell::new(|| IsometryMeasure::new(&filled, &start));
    let is_wanted = |map: &CertifiedMap| match boundary {
        BoundaryFound::Circle { .. } => true,
        BoundaryFound::Freed { .. } => measure.of(map) <= measure.of(&certified_start),
        // Of a boss whose wall is one row of facets, 2 radii high, the start has 2.5 and the untangled map 97.
        BoundaryFound::Natural => {
            let untangled = p99(map);
            untangled <= UNFOLLOWED || p99(&certified_start) > HALVED * untangled
        }
    };
    // That of the harmonic map is known, as a rule, where that is valid.
    let is_followed = |report: &untangle::Report| {
        report.method == untangle::Method::Harmonic
            && boundary == BoundaryFound::Natural
            && known.of_harmonic.get().is_some_and(|p99| *p99 <= UNFOLLOWED)
    };
    let energy = Dirichlet::new(&filled);
    let mut steps = 0;
    // What is near an isometry is not near the harmonic map: of 40 freed charts of nine files none that was untangled stretched less
    // than its start.
    if !matches!(boundary, BoundaryFound::Freed { .. }) || map.invalid().is_empty() {
        let Untangled { nodes, hole_centres, report } = untangle(&filled, &energy, &start, &map, monitor)?;
        Checkpoint::new(monitor).end()?;
        if let Some(certified) = proven(&nodes, hole_centres).filter(|map| is_followed(&report) || is_wanted(map)) {
            let provenance = Provenance { boundary, linear, harmonic, untangle: Some(report), unsolved };
            return Ok(ProvenMap { map: certified, start: certified_start, provenance });
        }
        steps = report.iterations;
    }
    let mut certified = certified_start.clone();
    let (mut from_isometry, mut descended) = (None, None);
    // Such distances know nothing of fans.
    if !matches!(boundary, BoundaryFound::Circle { .. }) {
        let of_start = measure.of(&certified_start);
        let mut least = of_start;
        if of_start > NEAR {
            let found = descend(&filled, &measure.objective, &start, monitor)?;
            Checkpoint::new(monitor).end()?;
            steps += found.iterations;
            let is_even = |map: &CertifiedMap| distortion::area_ratio(chart, map) <= EVEN.min(max_area_ratio);
            if let Some(nearer) = proven(&found.nodes, found.hole_centres.clone()).filter(is_even) {
                least = found.energy / measure.least;
                certified = nearer;
                descended = Some(found);
            }
        }
        from_isometry = Some(FromIsometry { start: of_start, least });
    }
    let report = untangle::Report {
        iterations: steps,
        from_isometry,
        ..untangle::Report::of_other(&filled, &energy, &start, &map, descended.as_ref())
    };
    let provenance = Provenance { boundary, linear, harmonic, untangle: Some(report), unsolved };
    Ok(ProvenMap { map: certified, start: certified_start, provenance })
}

/// How far maps inside a boundary are from an isometry.
struct IsometryMeasure<'a> {
    objective: Isometric<'a, FilledChart>,
    /// The energy of an isometry.
    least: f64,
}

impl<'a> IsometryMeasure<'a> {
    /// At the scale of a one-to-one map of a chart without fans.
    fn new(filled: &'a FilledChart, start: &[GridPoint]) -> Self {
        let triangles = 0..filled.chart_triangles();
        let nodes: Vec<_> = triangles.map(|f| filled.nodes(f).map(|n| start[n].uv())).collect();
        let objective = Isometric::near(filled, &nodes);
        let least = objective.of_isometry(filled.shapes().iter().map(TriangleShape::area).sum());
        Self { objective, least }
    }

    /// The symmetric Dirichlet energy of a map, over that of an isometry.
    fn of(&self, map: &CertifiedMap) -> f64 {
        let of_face = |f: usize| self.objective.value(FaceId::at(f), &nodes_of(map, f).map(|n| n.uv()));
        (0..map.map().cells.len()).map(of_face).sum::<f64>() / self.least
    }
}

/// Linear maps whose symmetric Dirichlet energy is no more than this, over that of an isometry, stay: what there is to be gained
/// no mesher sees. By experience: of six charts of cad_box_multi below 1.02 it takes a second, and elements are the same; those of
/// milk_truck that begin at 2.2 to 4.7 had elements of 0.02.
const NEAR: f64 = 1.1;

/// The nodes of a triangle of a map.
fn nodes_of(map: &CertifiedMap, face: usize) -> [GridPoint; 6] {
    map.map().cells[face].map(|n| map.map().nodes[n as usize])
}

/// The part of a map that is published: the chart without its fans.
fn planar(filled: &FilledChart, nodes: &[GridPoint], hole_centres: Vec<GridPoint>) -> PlanarMap {
    let cells = (0..filled.chart_triangles()).map(|f| filled.nodes(f).map(|n| n as u32)).collect();
    PlanarMap { cells, nodes: nodes[..filled.chart_nodes()].to_vec(), hole_centres }
}
