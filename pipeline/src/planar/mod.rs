//! Planar: meshes of the planes of charts, for a mesher that works there (mmg2d), whose work is to be lifted back.
//!
//! A mesher of the plane cannot know of the neighbours of a chart. So the curves between charts are parted once, in space, by
//! the sizes that are asked for ([`spacing`](self)), and both sides get the same nodes, which their mesher must keep. What is inside
//! a chart's polygon is triangulated (constrained Delaunay), so that holes stay holes; and at every node there is the metric that
//! makes edges as long in space as they shall be,
//!
//! M = J^T J / h^2, J = dx/du,
//!
//! the first fundamental form over the square of the size h there. At nodes with several triangles it is their log-Euclidean mean
//! (Arsigny et al. 2006, *Log-Euclidean metrics for fast and simple calculus on diffusion tensors*, doi 10.1002/mrm.20965).
//!
//! Chords of a curve may cross others where its arcs do not. They are halved until the polygon of every chart is simple and
//! rightly nested, decided exactly. Arcs of certified maps are, so that this ends, but for boundaries that come as close as the
//! grid: then there is an error.

mod lattice;
mod metric;
mod simple;
mod spacing;
mod triangulate;

pub use metric::Metric;

use crate::certified::{CertifiedAtlas, CertifiedChart};
use crate::evaluate::CurvedMap;
use crate::monitor::{Interrupted, Monitor};
use crate::topology::{ChartId, CurveId};
use crate::vec3::Vec3;
use spacing::Chains;

/// What is asked of the meshes.
pub trait Sizing {
    /// The length of edges at a point, in the unit of the input; positive.
    fn size_at(&self, x: Vec3) -> f64;

    /// Whether the nodes of the input along a curve are kept, and no others made.
    fn keeps(&self, curve: CurveId) -> bool;
}

/// A triangulation of the plane of a chart, whose boundary its neighbours share.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneMesh {
    /// The chart.
    pub chart: ChartId,
    /// Where the nodes are; first those of the boundary, loop after loop. On the grid of mid nodes.
    pub uv: Vec<[f64; 2]>,
    /// The metric at each node.
    pub metric: Vec<Metric>,
    /// The triangles, all turning left.
    pub triangles: Vec<[u32; 3]>,
    /// The sides of the polygon, the chart on their left.
    pub sides: Vec<PolygonSide>,
    /// Per node of the boundary, its number among the nodes of all curves: the same in all charts there.
    pub shared: Vec<u32>,
}

/// A side of the polygon of a chart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PolygonSide {
    /// Its nodes.
    pub ends: [u32; 2],
    /// The curve that it is a chord of.
    pub curve: CurveId,
}

/// Why a chart has no mesh of its plane.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Chords cross, however short.
    #[error(
        "the boundary of chart {chart} in the plane comes closer to itself along curve {curve} than chords can follow"
    )]
    Close {
        /// The chart.
        chart: ChartId,
        /// The curve.
        curve: CurveId,
    },
    /// A polygon cannot be triangulated: its nodes are closer than doubles can tell apart.
    #[error("the boundary of chart {chart} in the plane cannot be triangulated")]
    Untriangulated {
        /// The chart.
        chart: ChartId,
    },
    /// A chart lies on both sides of a curve.
    #[error("chart {chart} lies on both sides of curve {curve}")]
    MeetsItself {
        /// The chart.
        chart: ChartId,
        /// The curve.
        curve: CurveId,
    },
    /// The result is no longer wanted.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

/// Meshes of the planes of `charts`, ascending: nodes of curves are shared among all charts of the atlas.
///
/// ```
/// use planish_core::monitor::NoMonitor;
/// use planish_core::planar::{Sizing, plane_meshes};
/// use planish_core::topology::{ChartId, CurveId};
/// use planish_core::vec3::Vec3;
/// use planish_core::{Settings, parametrize, shapes};
///
/// struct Uniform;
///
/// impl Sizing for Uniform {
///     fn size_at(&self, _: Vec3) -> f64 {
///         0.2
///     }
///     fn keeps(&self, _: CurveId) -> bool {
///         false
///     }
/// }
///
/// let atlas = parametrize(&shapes::sphere(8), &Settings::default(), &NoMonitor)?;
/// let charts: Vec<ChartId> = (0..atlas.charts().len()).map(ChartId::at).collect();
/// let meshes = plane_meshes(&atlas, &charts, &Uniform, &NoMonitor)?;
/// // Two halves, whose boundary is one curve: it has as many nodes on both sides.
/// assert_eq!((meshes.len(), meshes[0].sides.len()), (2, meshes[1].sides.len()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`].
pub fn plane_meshes(
    atlas: &CertifiedAtlas,
    charts: &[ChartId],
    sizing: &dyn Sizing,
    monitor: &dyn Monitor,
) -> Result<Vec<PlaneMesh>, Error> {
    let maps: Vec<CurvedMap> = charts.iter().map(|id| curved_map(&atlas.charts()[id.index()])).collect();
    let chains = Chains::spaced(atlas, sizing);
    let chains = simple::simple(atlas, charts, chains, monitor)?;
    let mut meshes = Vec::with_capacity(charts.len());
    for (id, map) in charts.iter().zip(&maps) {
        interrupted_unless(monitor)?;
        let boundary = chains.boundary(atlas, *id)?;
        let field = metric::Field::new(&atlas.charts()[id.index()], map, sizing);
        meshes.push(triangulate::plane_mesh(*id, boundary, &field)?);
    }
    Ok(meshes)
}

/// The certified map of a chart, as one that is searched.
fn curved_map(certified: &CertifiedChart) -> CurvedMap {
    let chart = certified.chart();
    let uv = certified.map().map().nodes.iter().map(|node| node.uv()).collect();
    CurvedMap::new(chart.points().to_vec(), uv, chart.cells().collect())
}

/// # Errors
/// [`Interrupted`], where the result is no longer wanted.
fn interrupted_unless(monitor: &dyn Monitor) -> Result<(), Interrupted> {
    if monitor.should_continue() { Ok(()) } else { Err(Interrupted) }
}
