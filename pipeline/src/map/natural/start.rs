//! Where the map of a chart with a natural boundary begins.
//!
//! Only the *boundary* is taken from a conformal map: its vertices, and the chords between them. Edges of the boundary
//! are straight in space, and so are their images in every triangle of a map that is conformal there, so that chords lose
//! nothing, and a boundary of chords is a polygon. What lies inside is found anew by quadratic elements, which need not be
//! valid; so a start is asked for that is: a linear map with this boundary, or the conformal map itself, its degree elevated.

use super::boundary_first::{Polygon, boundary_first};
use super::clearance::Clearance;
use super::freed::freed;
use super::placement::doubled_area;
use super::projection::projected;
use super::unfolded::unfolded;
use super::{EVEN, STEEP, conformal_by_corners, fitted_to_size, spectral_conformal, summary};
use crate::atlas::Chart;
use crate::certify::{self, CertifiedMap, PlanarMap, polygons, prove};
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::boundary::Boundary;
use crate::map::filled::FilledChart;
use crate::map::linear::{self, LinearMap, Method, harmonic_uv, linear_map};
use crate::measure::distortion;
use crate::monitor::{Checkpoint, Interrupted, Monitor};
use crate::topology::VertexId;

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
}

/// Why a chart has no map with a natural boundary.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum NoNatural {
    /// The conformal map folds, and so does every linear map that was tried inside its boundary, which does not cross itself.
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
    /// Another boundary stretches less: that of the disk (an annulus of needles is no ring), or one that is freed.
    #[error("the natural map has a conformal distortion of {conformal_p99:.3e}, and another boundary stretches less")]
    Stretched {
        /// What 99 % of the area do not exceed.
        conformal_p99: f64,
    },
    /// The conformal map's system is too large, or singular in doubles.
    #[error("the system of the conformal map cannot be solved")]
    Unsolvable,
}

/// Finds the natural boundary of `chart`, and a valid map inside it: by boundary first flattening;
/// where that fails, by the spectral and the least squares conformal map of its vertices; else, for what is nearly a
/// plane, by the projection. None of them scales areas by more than `max_area_ratio`, and only the first
/// by more than 100.
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
    let search = Search { chart, filled: FilledChart::open(chart), most: max_area_ratio, monitor };
    let mut why = NoNatural::Unsolvable;
    // What is told is why the best one failed; that maps fold inside of loops that are simple, where there are such loops.
    for (rank, candidate) in Candidate::ALL.into_iter().enumerate() {
        Checkpoint::new(monitor).end()?;
        match search.by(candidate)? {
            Ok(start) => return Ok(Ok(start)),
            Err(Some(reason)) if rank == 0 || why == NoNatural::Unsolvable => why = reason,
            Err(Some(reason @ NoNatural::Folded { .. })) if why == NoNatural::Crossing => why = reason,
            Err(_) => {}
        }
        // What a conformal map shrinks by Liouville's equation every other shrinks, too.
        if let (Candidate::BoundaryFirst, NoNatural::Uneven { .. }) = (candidate, why) {
            break;
        }
    }
    Ok(Err(why))
}

/// As [`natural_start`], by boundary first flattening alone.
///
/// # Errors
/// [`Interrupted`].
pub(crate) fn boundary_first_start(
    chart: &Chart,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Option<NaturalStart>, Interrupted> {
    let search = Search { chart, filled: FilledChart::open(chart), most: max_area_ratio, monitor };
    Ok(search.by(Candidate::BoundaryFirst)?.ok())
}

/// The map whose vertices lie at `uv`, with a boundary of chords, or the linear one in that boundary, where it stretches less;
/// none where neither is one-to-one. How evenly they scale areas is not asked.
///
/// # Errors
/// [`Interrupted`].
pub(crate) fn start_through(
    chart: &Chart,
    uv: Vec<GridPoint>,
    method: Method,
    monitor: &dyn Monitor,
) -> Result<Option<NaturalStart>, Interrupted> {
    let search = Search { chart, filled: FilledChart::open(chart), most: f64::INFINITY, monitor };
    let boundary = Boundary::chords(&search.filled, |v| uv[v.index()]);
    let through = match LinearMap::through(&search.filled, uv, method) {
        Ok(through) => search.one_to_one(boundary.clone(), through)?.ok(),
        Err(_) => None,
    };
    let anew = match linear_map(&search.filled, &boundary, monitor) {
        Ok(anew) => search.one_to_one(boundary, anew)?.ok(),
        Err(linear::Error::Interrupted(interrupted)) => return Err(interrupted),
        Err(_) => None,
    };
    let less = |a: &NaturalStart, b: &NaturalStart| a.conformal_p99.total_cmp(&b.conformal_p99);
    Ok([anew, through].into_iter().flatten().min_by(less))
}

/// Finds a natural boundary of `chart` that is simple, and unfolds a map inside it, where [`natural_start`] found linear ones
/// only that fold; none where there is none, or its areas are scaled too unevenly, as there.
///
/// # Errors
/// [`Interrupted`].
pub fn unfolded_start(
    chart: &Chart,
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Option<NaturalStart>, Interrupted> {
    let search = Search { chart, filled: FilledChart::open(chart), most: max_area_ratio, monitor };
    for candidate in Candidate::ALL {
        Checkpoint::new(monitor).end()?;
        if let Some(start) = search.unfolded(candidate)? {
            return Ok(Some(start));
        }
    }
    Ok(None)
}

/// Frees the boundary of `chart` from the disk: the map nearest to an isometry that is found from `on_disk`, the uv of its
/// vertices in a one-to-one map by straight triangles; none where there is none that scales areas as evenly as
/// [`natural_start`] asks for.
///
/// # Errors
/// [`Interrupted`].
///
/// # Example
///
/// A ramp of two turns would cover itself when it is laid out flat. Its boundary is freed from the disk, and it is bent open.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::linear_map;
/// use planish_core::map::natural::{NoNatural, freed_start, natural_start};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::ramp(24, 48), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = &atlas.charts()[0];
/// assert_eq!(natural_start(chart, 1e6, &NoMonitor)?.err(), Some(NoNatural::Crossing));
/// let filled = FilledChart::new(chart);
/// let on_disk = linear_map(&filled, &Boundary::circle(&filled, Mids::Chord), &NoMonitor)?;
/// let freed = freed_start(chart, on_disk.uv(), 1e6, &NoMonitor)?.expect("one-to-one");
/// assert!(freed.conformal_p99 < 10.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn freed_start(
    chart: &Chart,
    on_disk: &[GridPoint],
    max_area_ratio: f64,
    monitor: &dyn Monitor,
) -> Result<Option<NaturalStart>, Interrupted> {
    let uv = on_disk[..chart.vertices().len()].iter().map(|p| p.uv()).collect();
    let Some(uv) = solved(freed(chart, uv, monitor))? else { return Ok(None) };
    let Some(uv) = Places::All(uv, Method::Isometric).fitted(chart).map(Places::into_uv) else { return Ok(None) };
    let search = Search { chart, filled: FilledChart::open(chart), most: max_area_ratio, monitor };
    let vertices: Vec<GridPoint> = uv.into_iter().map(GridPoint::vertex).collect();
    let boundary = Boundary::chords(&search.filled, |v| vertices[v.index()]);
    match LinearMap::through(&search.filled, vertices, Method::Isometric) {
        Ok(linear) => Ok(search.proven(boundary, linear, false)?.ok()),
        Err(_) => Ok(None),
    }
}

/// What a system gives; none where it cannot be solved.
fn solved<T>(found: Result<Option<T>, sparse::Error>) -> Result<Option<T>, Interrupted> {
    match found {
        Ok(found) => Ok(found),
        Err(sparse::Error::Interrupted(interrupted)) => Err(interrupted),
        Err(sparse::Error::Unsolvable(_)) => Ok(None),
    }
}

/// Where a boundary may come from, in the order in which they are tried.
#[derive(Clone, Copy)]
enum Candidate {
    /// Boundary first flattening.
    BoundaryFirst,
    /// The spectral conformal map of the vertices.
    Spectral,
    /// The least squares conformal map of the vertices, two of them held. Of curved charts with holes it may be one-to-one
    /// where the other is not: beetle_11_holes.
    LeastSquares,
    /// The projection along the mean of the normals.
    Projection,
}

impl Candidate {
    const ALL: [Self; 4] = [Self::BoundaryFirst, Self::Spectral, Self::LeastSquares, Self::Projection];
}

/// A chart with holes whose map stretches a hundredth of its area more than this is a ring of long triangles, and is judged like
/// other maps ([`EVEN`]): one of cad_rear_case, two radii long in one row, at 961.
const STRETCHED: f64 = 5.0;

/// Where the scale tells an area ratio that is too large by this factor, no map is made. It is a linear one's, of stars, that
/// counts: of charts of bunny, face and camel_head it was 0.5 to 0.7 of what the scale tells.
const HOPELESS: f64 = 10.0;

/// A start, or why there is none by some candidate; nothing where that does not apply.
type Found = Result<NaturalStart, Option<NoNatural>>;

struct Search<'a> {
    chart: &'a Chart,
    filled: FilledChart,
    /// The largest area ratio.
    most: f64,
    monitor: &'a dyn Monitor,
}

impl Search<'_> {
    fn by(&self, candidate: Candidate) -> Result<Found, Interrupted> {
        match self.places(candidate)? {
            Ok(places) => self.within(places),
            Err(why) => Ok(Err(why)),
        }
    }

    /// Where a candidate has the boundary, or all vertices: turned, moved and scaled so that they fit.
    fn places(&self, candidate: Candidate) -> Result<Result<Places, Option<NoNatural>>, Interrupted> {
        let Self { chart, filled, monitor, .. } = self;
        let places = match candidate {
            Candidate::BoundaryFirst => match boundary_first(chart, filled, *monitor) {
                Ok(Some(flat)) if flat.area_ratio > HOPELESS * self.most => {
                    return Ok(Err(Some(NoNatural::Uneven { ratio: flat.area_ratio })));
                }
                Ok(flat) => Ok(flat.and_then(|flat| flat.uv).map(Places::Flattened)),
                Err(error) => Err(error),
            },
            Candidate::Spectral => {
                spectral_conformal(chart, *monitor).map(|uv| Some(Places::All(uv, Method::Conformal)))
            }
            Candidate::LeastSquares => {
                conformal_by_corners(chart, *monitor).map(|uv| Some(Places::All(uv, Method::Conformal)))
            }
            Candidate::Projection => Ok(projected(chart, STEEP).map(|uv| Places::All(uv, Method::Projection))),
        };
        match places {
            Ok(Some(places)) => {
                let checkpoint = Checkpoint::new(*monitor);
                let fitted = places.fitted(chart);
                checkpoint.end()?;
                Ok(fitted.ok_or(Some(NoNatural::Unsolvable)))
            }
            Ok(None) => Ok(Err(None)),
            Err(sparse::Error::Interrupted(interrupted)) => Err(interrupted),
            Err(sparse::Error::Unsolvable(_)) => Ok(Err(Some(NoNatural::Unsolvable))),
        }
    }

    /// The start with the boundary at these places.
    fn within(&self, places: Places) -> Result<Found, Interrupted> {
        let Self { chart, filled, monitor, .. } = self;
        let is_flattened = matches!(places, Places::Flattened(_));
        let method = places.method();
        let vertices: Vec<GridPoint> = places.into_uv().into_iter().map(GridPoint::vertex).collect();
        let boundary = Boundary::chords(filled, |v| vertices[v.index()]);
        let polygons = along_loops(chart, &vertices);
        // Inside such loops no map is one-to-one, and it takes long to try all weights.
        if polygons::check(&polygons).is_some() {
            return Ok(Err(Some(NoNatural::Crossing)));
        }
        Checkpoint::new(*monitor).end()?;
        let linear = match LinearMap::through(filled, vertices, method) {
            Err(linear::Error::Folded { .. }) => linear_map(filled, &boundary, *monitor),
            found => found,
        };
        match linear {
            Ok(linear) => self.proven(boundary, linear, is_flattened),
            Err(linear::Error::Interrupted(interrupted)) => Err(interrupted),
            Err(linear::Error::Folded { folded, .. }) => Ok(Err(Some(NoNatural::Folded { triangles: folded }))),
            Err(linear::Error::Solver(_)) => Ok(Err(Some(NoNatural::Unsolvable))),
        }
    }

    /// The start by a linear map, if it is one-to-one and scales areas evenly. Whether the boundary is flattened first decides
    /// how evenly.
    fn proven(&self, boundary: Boundary, linear: LinearMap, is_flattened: bool) -> Result<Found, Interrupted> {
        let Self { chart, most, monitor, .. } = self;
        let start = match self.one_to_one(boundary, linear)? {
            Ok(start) => start,
            Err(why) => return Ok(Err(Some(why))),
        };
        Checkpoint::new(*monitor).end()?;
        let ratio = self.area_ratio(&start.certified, is_flattened);
        let is_smooth = is_flattened && (chart.holes().is_empty() || start.conformal_p99 <= STRETCHED);
        let most = if is_smooth { *most } else { most.min(EVEN) };
        if ratio > most {
            return Ok(Err(Some(NoNatural::Uneven { ratio })));
        }
        Ok(Ok(start))
    }

    /// The start by a linear map, if it is one-to-one.
    fn one_to_one(
        &self,
        boundary: Boundary,
        linear: LinearMap,
    ) -> Result<Result<NaturalStart, NoNatural>, Interrupted> {
        let Self { chart, filled, monitor, .. } = self;
        Checkpoint::new(*monitor).end()?;
        let nodes = linear.degree_elevated(filled, &boundary);
        let cells = chart.cells().collect();
        let certified = match prove(PlanarMap { cells, nodes: nodes.clone(), hole_centres: vec![] }) {
            Ok(certified) => certified,
            Err(certify::Error::InvalidTriangles { count, .. }) => {
                return Ok(Err(NoNatural::Folded { triangles: count }));
            }
            Err(_) => return Ok(Err(NoNatural::Crossing)),
        };
        let conformal_p99 = distortion::conformal_p99_of_nodes(chart, |f| filled.nodes(f).map(|n| nodes[n]));
        let filled = filled.clone();
        Ok(Ok(NaturalStart { filled, boundary, linear, nodes, certified, conformal_p99 }))
    }

    /// How unevenly a start scales areas: that of stars, as of every map; else than flattened boundary first also that of
    /// single triangles. A projection shrinks steep walls to nothing, and a star reaches from these to what is flat: of half
    /// of pins_instanced a wall of 0.4 % of the area, and a mesher had 57 elements below gamma 0.1 there.
    fn area_ratio(&self, certified: &CertifiedMap, is_flattened: bool) -> f64 {
        let of_stars = distortion::area_ratio(self.chart, certified);
        if is_flattened { of_stars } else { of_stars.max(summary(self.chart, certified.map()).area_ratio) }
    }

    /// The start inside the boundary of a candidate, if that is simple, from a linear map that folds.
    fn unfolded(&self, candidate: Candidate) -> Result<Option<NaturalStart>, Interrupted> {
        let Self { chart, filled, monitor, .. } = self;
        let Ok(places) = self.places(candidate)? else { return Ok(None) };
        let is_flattened = matches!(places, Places::Flattened(_));
        let at = places.into_uv();
        let boundary = Boundary::chords(filled, |v| GridPoint::vertex(at[v.index()]));
        let mut uv = match harmonic_uv(filled, &boundary, *monitor) {
            Ok(uv) => uv,
            Err(linear::Error::Interrupted(interrupted)) => return Err(interrupted),
            Err(_) => return Ok(None),
        };
        let points: Vec<[f64; 2]> = uv.iter().map(|p| p.uv()).collect();
        if !Clearance::of(chart).is_kept(&points) {
            return Ok(None);
        }
        let Some(found) = solved(unfolded(chart, points, *monitor))? else { return Ok(None) };
        for v in filled.elimination() {
            uv[v.index()] = GridPoint::vertex(found[v.index()]);
        }
        match LinearMap::through(filled, uv, Method::Unfolded) {
            Ok(linear) => Ok(self.proven(boundary, linear, is_flattened)?.ok()),
            Err(_) => Ok(None),
        }
    }
}

/// What is given for each vertex, along each loop of a chart.
fn along_loops<T: Copy>(chart: &Chart, of_vertices: &[T]) -> Vec<Vec<T>> {
    chart.loops().map(|l| l.iter().map(|h| of_vertices[chart.from(*h).index()]).collect()).collect()
}

/// Places of the vertices in the plane.
enum Places {
    /// Flattened boundary first, harmonic inside.
    Flattened(Vec<[f64; 2]>),
    /// By another method.
    All(Vec<[f64; 2]>, Method),
}

impl Places {
    fn method(&self) -> Method {
        match self {
            Self::Flattened(_) => Method::Harmonic,
            Self::All(_, method) => *method,
        }
    }

    fn into_uv(self) -> Vec<[f64; 2]> {
        match self {
            Self::Flattened(uv) | Self::All(uv, _) => uv,
        }
    }

    /// Turned, moved and scaled so that they fit.
    fn fitted(self, chart: &Chart) -> Option<Self> {
        Some(match self {
            // The area inside the outer polygon and outside the others is that of all triangles. What is harmonic inside may fold,
            // and go beyond.
            Self::Flattened(uv) => {
                let polygons: Vec<Polygon> = along_loops(chart, &uv);
                let area = 0.5 * polygons.iter().map(|polygon| doubled_area(polygon)).sum::<f64>();
                Self::Flattened(fitted_to_size(chart, area, polygons.concat(), uv)?)
            }
            Self::All(uv, method) => {
                let doubled = |t: &[VertexId; 3]| {
                    let [a, b, c] = t.map(|v| uv[v.index()]);
                    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
                };
                let area = 0.5 * chart.triangles().iter().map(doubled).sum::<f64>();
                Self::All(fitted_to_size(chart, area, uv.clone(), uv)?, method)
            }
        })
    }
}
