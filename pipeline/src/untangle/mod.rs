//! Untangle: towards the harmonic map, inside the certified ones.
//!
//! Minimises an [`Objective`], the [`Dirichlet`] energy (on the surface: distortion is measured against the triangles in
//! space), under the constraint that every jacobian is positive, with the outer boundary fixed.
//!
//! * **Nothing to do** where the harmonic map is valid and every hole can be seen from a point inside.
//! * **The patch path**, where few triangles are invalid: only a few rings around them move. Patches that do not yield grow.
//! * **The feasible path**: the linear map, degree-elevated, is valid, and the method descends from it. All nodes inside
//!   move, and a star centre for each hole.
//! * **The start itself**, if the result of the feasible path is not valid, does not survive rounding to the grid, or its
//!   systems are too large.
//!
//! Both paths use the same primal-dual interior-point method (`interior.rs`): the six Bernstein coefficients of each
//! jacobian (sufficient for validity) stay above a thousandth of their typical size, by a barrier whose weight falls from a
//! tenth to a millionth of the energy. Steps are Newton's, with exact curvature. Every loop has a fixed limit. As harmonic
//! map, start and result all include the
//! energy of the virtual fans (with free nodes), the harmonic energy is a lower bound of the result's. Where holes are open
//! (natural boundaries) their loops are as fixed as the outer one, and need no point that sees them.

mod arcs;
mod bound;
mod curvature;
mod feasible;
mod interior;
mod objective;
mod patch;
mod problem;
mod region;

use crate::certify::{Arc, star_centre};
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::filled::FilledChart;
use crate::map::quadratic::{self, QuadraticMap, invalid_triangles};
use crate::monitor::{Checkpoint, Interrupted, Monitor};
use crate::topology::FaceId;
use interior::{NEAR, NEAREST};
pub use objective::{Dirichlet, Isometric, LocalModel, Objective};
use patch::Stuck;

/// Above this share of invalid triangles the feasible path is taken at once: patches would grow together. Patches were
/// enough at 55 of 1,076 and not always at 221 of 6,189 (3.6 %); trying costs little beside the other path.
const FEW: f64 = 0.1;

/// How the result was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// The harmonic map was valid.
    Harmonic,
    /// Patches around invalid triangles moved.
    Patch,
    /// A barrier method from the degree-elevated linear map.
    Feasible,
    /// From the degree-elevated linear map on, the symmetric Dirichlet energy was lowered ([`Isometric`]).
    Isometric,
    /// The degree-elevated linear map itself.
    Start,
}

/// Symmetric Dirichlet energies over that of an isometry: 1 at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FromIsometry {
    /// Of the start.
    pub start: f64,
    /// Of the map that minimises that energy inside the boundary.
    pub least: f64,
}

/// What untangling did.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// How the result was found.
    pub method: Method,
    /// Newton steps, over all patches and attempts.
    pub iterations: usize,
    /// Nodes of the chart whose uv differ from those in the unconstrained minimiser.
    pub nodes_moved: usize,
    /// The objective at its unconstrained minimiser, which may be invalid: a lower bound. For the Dirichlet energy that
    /// is the harmonic map.
    pub energy_unconstrained: f64,
    /// The objective at the start, the degree-elevated linear map.
    pub energy_start: f64,
    /// The objective at the result.
    pub energy: f64,
    /// The gradient of the last barrier problem in the norm of its inverse Hessian, relative to the root of twice
    /// the energy; the largest over all patches. Zero where nothing was minimised.
    pub gradient_norm: f64,
    /// How far maps are from an isometry, where that was looked at: it is where the harmonic map is not what is wanted.
    pub from_isometry: Option<FromIsometry>,
}

impl Report {
    /// Of what [`descend`] found with another objective, if it is the result, or else of the start; energies are those of
    /// `objective`.
    pub(crate) fn of_other<O: Objective>(
        chart: &FilledChart,
        objective: &O,
        start: &[GridPoint],
        minimiser: &QuadraticMap,
        descended: Option<&Descended>,
    ) -> Self {
        let nodes = descended.map_or(start, |descended| &descended.nodes);
        Self {
            method: if descended.is_some() { Method::Isometric } else { Method::Start },
            iterations: descended.map_or(0, |descended| descended.iterations),
            nodes_moved: nodes_moved(chart, nodes, minimiser),
            energy_unconstrained: total(chart, objective, minimiser.uv()),
            energy_start: total_on_grid(chart, objective, start),
            energy: total_on_grid(chart, objective, nodes),
            gradient_norm: descended.map_or(0.0, |descended| descended.gradient_norm),
            from_isometry: None,
        }
    }
}

fn nodes_moved(chart: &FilledChart, nodes: &[GridPoint], minimiser: &QuadraticMap) -> usize {
    (0..chart.chart_nodes()).filter(|n| nodes[*n] != minimiser.nodes()[*n]).count()
}

/// A map with a point in each hole, believed to be valid: [`crate::certify`] decides.
#[derive(Clone, Debug)]
pub struct Untangled {
    /// The uv of all nodes of the filled chart.
    pub nodes: Vec<GridPoint>,
    /// Per hole, a point from which its loop can be seen.
    pub hole_centres: Vec<GridPoint>,
    /// What was done.
    pub report: Report,
}

/// Steps and accuracy of one attempt.
#[derive(Clone, Copy, Debug, Default)]
struct Stats {
    iterations: usize,
    decrement: f64,
}

impl Stats {
    fn add(&mut self, outcome: interior::Outcome) {
        self.iterations += outcome.iterations;
        self.decrement = outcome.decrement;
    }
}

/// Finds a valid map of `chart` whose `objective` is as small as it can be near by.
///
/// `minimiser` is the map that minimises `objective` with this boundary, valid or not: where it is valid, it is the result.
/// For [`Dirichlet`] that is the harmonic map ([`crate::map::quadratic::quadratic_map`]); for another objective make it with
/// [`QuadraticMap::of`]. `start` is a valid map with the same boundary, as the degree-elevated linear map is, and is the
/// result itself where nothing better is found. The objective is evaluated at invalid maps, too: it must be finite there.
///
/// # Errors
/// [`Interrupted`].
///
/// # Example
///
/// The energy of the result lies between that of the harmonic map, which folds, and that of the start.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::{flatten_ear_arcs, linear_map};
/// use planish_core::map::quadratic::quadratic_map;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::untangle::{Dirichlet, untangle};
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::bent_disk(12, 0.45, 1.0), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// // The boundary is chosen before all three maps, and is the same for all of them.
/// let mut boundary = Boundary::circle(&chart, Mids::Arc);
/// let linear = linear_map(&chart, &boundary, &NoMonitor)?;
/// flatten_ear_arcs(&chart, &linear, &mut boundary);
/// let start = linear.degree_elevated(&chart, &boundary);
/// let harmonic = quadratic_map(&chart, &boundary, &NoMonitor)?;
/// assert!(!harmonic.invalid().is_empty());
/// let objective = Dirichlet::new(&chart);
/// let report = untangle(&chart, &objective, &start, &harmonic, &NoMonitor)?.report;
/// assert!(report.energy_unconstrained < report.energy && report.energy < report.energy_start);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn untangle<O: Objective>(
    chart: &FilledChart,
    objective: &O,
    start: &[GridPoint],
    minimiser: &QuadraticMap,
    monitor: &dyn Monitor,
) -> Result<Untangled, Interrupted> {
    let mut stats = Stats::default();
    let found = best(chart, objective, start, minimiser, &mut stats, &Checkpoint::new(monitor))?;
    let report = Report {
        method: found.method,
        iterations: stats.iterations,
        nodes_moved: nodes_moved(chart, &found.nodes, minimiser),
        energy_unconstrained: total(chart, objective, minimiser.uv()),
        energy_start: total_on_grid(chart, objective, start),
        energy: total_on_grid(chart, objective, &found.nodes),
        gradient_norm: stats.decrement.max(0.0).sqrt(),
        from_isometry: None,
    };
    Ok(Untangled { nodes: found.nodes, hole_centres: found.hole_centres, report })
}

/// What [`descend`] found.
#[derive(Clone, Debug)]
pub struct Descended {
    /// The uv of all nodes of the filled chart.
    pub nodes: Vec<GridPoint>,
    /// Per hole, a point from which its loop can be seen.
    pub hole_centres: Vec<GridPoint>,
    /// Newton steps.
    pub iterations: usize,
    /// The objective at the start.
    pub energy_start: f64,
    /// The objective at the result, no larger.
    pub energy: f64,
    /// As [`Report::gradient_norm`].
    pub gradient_norm: f64,
}

/// Lowers `objective` from `start` on, a valid map, with its boundary fixed: by the feasible path of [`untangle`], for objectives
/// that nothing but validity keeps from falling without end, or that have no value at invalid maps, as [`Isometric`]. The result
/// is the start itself where nothing lower is found that is valid.
///
/// # Errors
/// [`Interrupted`].
///
/// # Example
///
/// The inside of a chart, nearer to an isometry than the linear map, with the boundary where it is.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::linear_map;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::untangle::{Isometric, descend};
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::disk(6), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// let boundary = Boundary::circle(&chart, Mids::Chord);
/// let start = linear_map(&chart, &boundary, &NoMonitor)?.degree_elevated(&chart, &boundary);
/// let nodes: Vec<_> = (0..chart.triangles().len()).map(|f| chart.nodes(f).map(|n| start[n].uv())).collect();
/// let objective = Isometric::near(&chart, &nodes);
/// let descended = descend(&chart, &objective, &start, &NoMonitor)?;
/// assert!(descended.energy < descended.energy_start);
/// // An isometry has the energy of its area.
/// assert!(descended.energy > 0.99 * std::f64::consts::PI);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn descend<O: Objective>(
    chart: &FilledChart,
    objective: &O,
    start: &[GridPoint],
    monitor: &dyn Monitor,
) -> Result<Descended, Interrupted> {
    let mut stats = Stats::default();
    let energy_start = total_on_grid(chart, objective, start);
    let lower = match feasible::untangle(chart, objective, start, NEAR, &mut stats, &Checkpoint::new(monitor)) {
        Ok(nodes) => {
            let energy = total_on_grid(chart, objective, &nodes);
            valid(chart, &nodes).filter(|_| energy < energy_start).map(|centres| (nodes, centres, energy))
        }
        Err(sparse::Error::Interrupted(interrupted)) => return Err(interrupted),
        Err(sparse::Error::Unsolvable(_)) => None,
    };
    let iterations = stats.iterations;
    Ok(match lower {
        Some((nodes, hole_centres, energy)) => {
            let gradient_norm = stats.decrement.max(0.0).sqrt();
            Descended { nodes, hole_centres, iterations, energy_start, energy, gradient_norm }
        }
        None => {
            let hole_centres = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
            let nodes = start.to_vec();
            Descended { nodes, hole_centres, iterations, energy_start, energy: energy_start, gradient_norm: 0.0 }
        }
    })
}

/// The objective over all triangles, those of the fans included.
fn total<O: Objective>(chart: &FilledChart, objective: &O, x: &[[f64; 2]]) -> f64 {
    let of_face = |f: usize| objective.value(FaceId::at(f), &chart.nodes(f).map(|n| x[n]));
    (0..chart.triangles().len()).map(of_face).sum()
}

fn total_on_grid<O: Objective>(chart: &FilledChart, objective: &O, nodes: &[GridPoint]) -> f64 {
    total(chart, objective, &uv_of(nodes, &[]))
}

/// A valid map, with the way to it.
struct Found {
    method: Method,
    nodes: Vec<GridPoint>,
    hole_centres: Vec<GridPoint>,
}

/// The first of the paths that leads to a valid map.
fn best<O: Objective>(
    chart: &FilledChart,
    objective: &O,
    start: &[GridPoint],
    minimiser: &QuadraticMap,
    stats: &mut Stats,
    checkpoint: &Checkpoint,
) -> Result<Found, Interrupted> {
    // Each path is believed only as far as its result is valid on the grid.
    let found_if_valid = |method: Method, nodes: Vec<GridPoint>| {
        let hole_centres = valid(chart, &nodes)?;
        Some(Found { method, nodes, hole_centres })
    };
    if let Some(found) = found_if_valid(Method::Harmonic, minimiser.nodes().to_vec()) {
        return Ok(found);
    }
    let are_few_invalid = minimiser.invalid().len() as f64 <= FEW * chart.chart_triangles() as f64;
    if are_few_invalid {
        match patch::untangle(chart, objective, start, minimiser, stats, checkpoint) {
            Ok(nodes) => {
                if let Some(found) = found_if_valid(Method::Patch, nodes) {
                    return Ok(found);
                }
            }
            Err(Stuck::Interrupted(interrupted)) => return Err(interrupted),
            // Then the whole chart moves.
            Err(_) => {}
        }
    }
    // Steps are counted over all paths, but accuracy is that of the path that is taken.
    stats.decrement = 0.0;
    match feasible::untangle(chart, objective, start, NEAREST, stats, checkpoint) {
        Ok(nodes) => {
            if let Some(found) = found_if_valid(Method::Feasible, nodes) {
                return Ok(found);
            }
        }
        Err(sparse::Error::Interrupted(interrupted)) => return Err(interrupted),
        // Then the start is what there is.
        Err(sparse::Error::Unsolvable(_)) => {}
    }
    stats.decrement = 0.0;
    let hole_centres = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
    Ok(Found { method: Method::Start, nodes: start.to_vec(), hole_centres })
}

/// If the map is valid and every hole can be seen from a point, these points.
fn valid(chart: &FilledChart, nodes: &[GridPoint]) -> Option<Vec<GridPoint>> {
    let holes = 0..chart.loops().len();
    let centres = holes.map(|k| centre_of_hole(chart, nodes, k)).collect::<Option<Vec<_>>>()?;
    invalid_triangles(chart, nodes).is_empty().then_some(centres)
}

/// A point from which all of the loop around hole `k` can be seen.
fn centre_of_hole(chart: &FilledChart, nodes: &[GridPoint], k: usize) -> Option<GridPoint> {
    let arcs: Vec<Arc> = chart.loops()[k].iter().map(|h| arc(chart, nodes, *h)).collect();
    star_centre(&arcs, nodes[chart.centre_node(k)])
}

fn arc(chart: &FilledChart, nodes: &[GridPoint], h: crate::topology::HalfEdgeId) -> Arc {
    let [from, to] = chart.ends(h).map(|v| nodes[chart.vertex_node(v)]);
    Arc { from, mid: nodes[chart.mid_node(h)], to }
}

/// Places of all nodes as doubles, followed by the star centres.
fn uv_of(nodes: &[GridPoint], centres: &[GridPoint]) -> Vec<[f64; 2]> {
    nodes.iter().chain(centres).map(|p| p.uv()).collect()
}

/// The nodes of `x` on the grid.
fn on_grid(chart: &FilledChart, x: &[[f64; 2]]) -> Vec<GridPoint> {
    quadratic::to_grid(chart, &x[..chart.node_count()])
}

#[cfg(test)]
mod tests;
