//! Where the map of a chart with a natural boundary begins.
//!
//! Only the *boundary* is taken from the conformal map: its vertices, and the chords between them. Edges of the boundary
//! are straight in space, and so are their images in every triangle of a map that is conformal there, so that chords lose
//! nothing, and a boundary of chords is a polygon. What lies inside is found anew by quadratic elements, which need not be
//! valid; so a start is asked for that is: the conformal map itself, its degree elevated, or, where that folds inside a
//! boundary that is simple, a linear map with this boundary.

use super::projection::projected;
use super::{EVEN, STEEP, conformal_by_corners, fitted_to_size};
use crate::atlas::Chart;
use crate::certify::{self, CertifiedMap, PlanarMap, prove};
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::boundary::Boundary;
use crate::map::filled::FilledChart;
use crate::map::linear::{self, LinearMap, Method, linear_map};
use crate::measure::distortion;
use crate::monitor::{Interrupted, Monitor};

/// A chart with open holes, its natural boundary, and a valid map inside it.
#[derive(Clone, Debug)]
pub struct NaturalStart {
    /// The chart.
    pub filled: FilledChart,
    /// Its boundary: chords.
    pub boundary: Boundary,
    /// The linear map.
    pub linear: LinearMap,
    /// The same by quadratic elements.
    pub nodes: Vec<GridPoint>,
    /// The same, proven.
    pub certified: CertifiedMap,
    /// The conformal distortion that 99 % of the area do not exceed.
    pub conformal_p99: f64,
    /// The area ratio.
    pub area_ratio: f64,
}

/// Why a chart has no map with a natural boundary.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoNatural {
    /// The conformal map folds, and so does every linear map that was tried inside its boundary.
    #[error("{triangles} triangles fold inside the natural boundary")]
    Folded {
        /// How many triangles the conformal map folds.
        triangles: usize,
    },
    /// The natural boundary crosses or touches itself: the chart, laid out flat, covers itself.
    #[error("the natural boundary crosses or touches itself")]
    Crossing,
    /// Areas are scaled too unevenly.
    #[error("the natural map has the area ratio {ratio:.2e}")]
    Uneven {
        /// The area ratio.
        ratio: f64,
    },
    /// The map stretches more than that of the disk: an annulus of needles is no ring.
    #[error("the natural map has a conformal distortion of {conformal_p99:.3e}, more than that of the disk")]
    Stretched {
        /// What 99 % of the area do not exceed.
        conformal_p99: f64,
    },
    /// The conformal map's system is too large, or singular in doubles.
    #[error("the system of the conformal map cannot be solved")]
    Unsolvable,
}

/// Finds the natural boundary of `chart`, and a valid map inside it: by the conformal map, or, for what is nearly a plane
/// and where that fails, by the projection. None of them scales areas by more than 100, or `max_area_ratio` where that is
/// less.
///
/// # Errors
/// [`Interrupted`].
///
/// # Example
///
/// A bent sheet with a hole is unrolled; a cup as deep as this one is not, as its bottom would shrink.
///
/// ```
/// use planish_core::map::natural::{NoNatural, natural_start};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let one_chart = |soup| {
///     let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
///     decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0)
/// };
/// let plate = natural_start(&one_chart(shapes::disk_with_holes(13, 2)), 1e6, &NoMonitor)?.expect("nearly flat");
/// assert_eq!(plate.certified.certificate().holes, 2);
/// let cup = natural_start(&one_chart(shapes::finger(12, 4)), 1e6, &NoMonitor)?;
/// assert!(matches!(cup, Err(NoNatural::Uneven { .. })));
/// # Ok::<(), planish_core::monitor::Interrupted>(())
/// ```
pub fn natural_start(
    chart: &Chart,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Result<NaturalStart, NoNatural>, Interrupted> {
    let most = EVEN.min(max_area_ratio);
    let filled = FilledChart::open(chart);
    let conformal = match conformal_by_corners(chart, monitor) {
        Ok(uv) => within(chart, &filled, uv, Method::Conformal, most, monitor)?,
        Err(sparse::Error::Interrupted(interrupted)) => return Err(interrupted),
        Err(sparse::Error::Unsolvable(_)) => Err(NoNatural::Unsolvable),
    };
    let why = match conformal {
        Ok(start) => return Ok(Ok(start)),
        Err(why) => why,
    };
    // What is told is why the better of both failed.
    let Some(uv) = projected(chart, STEEP) else { return Ok(Err(why)) };
    Ok(within(chart, &filled, uv, Method::Projection, most, monitor)?.map_err(|_| why))
}

/// The start with its boundary vertices at these of `uv`.
fn within(
    chart: &Chart,
    filled: &FilledChart,
    uv: Vec<[f64; 2]>,
    method: Method,
    most: f64,
    monitor: &dyn Monitor,
) -> Result<Result<NaturalStart, NoNatural>, Interrupted> {
    let Some(fitted) = fitted_to_size(chart, uv) else { return Ok(Err(NoNatural::Unsolvable)) };
    let vertices: Vec<GridPoint> = fitted.into_iter().map(GridPoint::vertex).collect();
    let boundary = Boundary::chords(filled, |v| vertices[v.index()]);
    let linear = match LinearMap::through(filled, vertices, method) {
        Ok(map) => map,
        Err(linear::Error::Folded { folded, .. }) => match linear_map(filled, &boundary, monitor) {
            Ok(map) => map,
            Err(linear::Error::Interrupted(interrupted)) => return Err(interrupted),
            Err(_) => return Ok(Err(NoNatural::Folded { triangles: folded })),
        },
        Err(_) => return Ok(Err(NoNatural::Unsolvable)),
    };
    let nodes = linear.degree_elevated(filled, &boundary);
    let cells = chart.cells().collect();
    let certified = match prove(PlanarMap { cells, nodes: nodes.clone(), hole_centres: vec![] }) {
        Ok(certified) => certified,
        Err(certify::Error::InvalidTriangles { count, .. }) => return Ok(Err(NoNatural::Folded { triangles: count })),
        Err(_) => return Ok(Err(NoNatural::Crossing)),
    };
    let ratio = distortion::area_ratio(chart, &certified);
    if ratio > most {
        return Ok(Err(NoNatural::Uneven { ratio }));
    }
    let conformal_p99 = distortion::conformal_p99_of_nodes(chart, |f| filled.nodes(f).map(|n| nodes[n]));
    let filled = filled.clone();
    Ok(Ok(NaturalStart { filled, boundary, linear, nodes, certified, conformal_p99, area_ratio: ratio }))
}
