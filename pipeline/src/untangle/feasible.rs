//! The feasible path: a log-barrier method from the degree-elevated linear map.

use super::bound::Bound;
use super::interior::{Wanted, minimise};
use super::objective::Objective;

use super::problem::{Cell, Problem};
use super::{Stats, on_grid, region, uv_of};
use crate::fem::sparse::Error;
use crate::grid::GridPoint;
use crate::map::filled::FilledChart;
use crate::monitor::Checkpoint;
use crate::topology::FaceId;

/// The share of its value in the start that every coefficient keeps. By experience: larger bars more of the valid maps,
/// smaller leaves less to what rounding to the grid takes.
const KEPT: f64 = 1e-3;

/// What triangles weigh at least, relative to the mean: where the objective is nothing a barrier is wanted all the same.
const MIN_WEIGHT: f64 = 1e-6;

/// Descends from `start`.
///
/// # Errors
/// [`Error`]: the systems are too large or cannot be factorised, or interrupted.
pub(super) fn untangle<O: Objective>(
    chart: &FilledChart,
    objective: &O,
    start: &[GridPoint],
    wanted: Wanted,
    stats: &mut Stats,
    checkpoint: &Checkpoint,
) -> Result<Vec<GridPoint>, Error> {
    checkpoint.after(chart.triangles().len())?;
    let centres: Vec<GridPoint> = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
    let mut all = uv_of(start, &centres);
    let weights = weights(chart, objective, &all);
    let mut problem = problem(chart, objective, &weights, checkpoint);
    let mut x = problem.gather(&all);
    problem.for_each_bound(&x, |coefficient, bound| {
        bound.scale = coefficient;
        bound.floor = KEPT * coefficient;
    });
    descend(&mut problem, &mut x, wanted, stats)?;
    for moved in problem.moved(&x) {
        all[moved.node] = moved.uv;
    }
    Ok(on_grid(chart, &all))
}

/// How much the penalties count, before they are scaled.
struct Weights {
    /// Per triangle: its share of the objective.
    of_faces: Vec<f64>,
    /// The mean share.
    mean: f64,
}

/// The weights by the objective at `x`.
fn weights<O: Objective>(chart: &FilledChart, objective: &O, x: &[[f64; 2]]) -> Weights {
    let mut values = Vec::with_capacity(chart.triangles().len());
    for f in 0..chart.triangles().len() {
        let nodes = chart.nodes(f).map(|n| x[n]);
        values.push(objective.value(FaceId::at(f), &nodes));
    }
    // Per triangle with a penalty: fans add to the objective, and have none.
    let mean = values.iter().sum::<f64>() / chart.chart_triangles() as f64;
    let least = MIN_WEIGHT * mean;
    let of_faces = values.into_iter().map(|value| value.max(least)).collect();
    Weights { of_faces, mean }
}

/// All triangles, with their weights but bounds still unset; every node may move but those of the outer loop.
fn problem<'a, O: Objective>(
    chart: &'a FilledChart,
    objective: &'a O,
    weights: &Weights,
    checkpoint: &'a Checkpoint,
) -> Problem<'a, O> {
    let unset = |weight: f64| Bound::new(1.0, weight);
    let mut cells = Vec::with_capacity(chart.triangles().len());
    for f in 0..chart.triangles().len() {
        // Fans have energy, and may fold.
        let is_of_chart = f < chart.chart_triangles();
        let bounds = is_of_chart.then(|| [unset(weights.of_faces[f]); 6]);
        cells.push(Cell { face: FaceId::at(f), bounds });
    }
    let is_outer = chart.outer_nodes();
    let inside = (0..is_outer.len()).filter(|n| !is_outer[*n]);
    let holes: Vec<usize> = (0..chart.loops().len()).collect();
    let star_centres = holes.iter().map(|k| region::star_centre(chart, *k));
    let free: Vec<u32> = inside.map(|n| n as u32).chain(star_centres).collect();
    let arcs = region::arc_cells(chart, &holes, unset(weights.mean));
    Problem::new(chart, objective, cells, arcs, &free, checkpoint)
}

/// Minimises from the start.
fn descend<O: Objective>(
    problem: &mut Problem<O>,
    x: &mut [[f64; 2]],
    wanted: Wanted,
    stats: &mut Stats,
) -> Result<(), Error> {
    if problem.unknowns() == 0 {
        return Ok(());
    }
    let pattern = problem.pattern();
    problem.checkpoint()?;
    let analysis = pattern.analyse()?;
    stats.add(minimise(problem, &analysis, x, wanted)?);
    Ok(())
}
