//! The feasible path: a log-barrier method from the degree-elevated linear map.

use super::newton::{Limits, minimise};
use super::objective::Objective;
use super::penalty::{Bound, Penalty};
use super::problem::{Cell, Problem};
use super::{Stats, on_grid, region, uv_of};
use crate::fem::sparse::Error;
use crate::grid::GridPoint;
use crate::map::filled::FilledChart;
use crate::monitor::Checkpoint;
use crate::topology::FaceId;

/// The weights of the barrier, relative to the objective of each triangle. The last one decides how close the result
/// comes: with 55 invalid triangles of 1,076 the energy was 7.7009, 7.4736, 7.4626 and 7.4622 at weights of 1e-4 to 1e-7,
/// that of the harmonic map 7.4603.
const WEIGHTS: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Newton steps per weight, on large and on small charts, and the triangles times steps that decide between: charts of
/// CAD parts mostly end at this budget, 0.5 to 38 % above the harmonic energy.
const STEPS: [usize; 2] = [12, 60];
const WORK: usize = 120_000;

/// A weight is left when the promised decrease falls below this share of the energy. Far below what the smallest weight
/// costs.
const TOLERANCE: f64 = 1e-9;

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
    descend(&mut problem, &mut x, stats)?;
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
    let unset = |weight: f64| Bound { scale: 1.0, floor: 0.0, weight, dual: None };
    let mut cells = Vec::with_capacity(chart.triangles().len());
    for f in 0..chart.triangles().len() {
        // Fans have energy, and may fold.
        let is_of_chart = f < chart.chart_triangles();
        let bounds = is_of_chart.then(|| [unset(weights.of_faces[f]); 6]);
        cells.push(Cell { face: FaceId::at(f), bounds });
    }
    let is_outer = chart.outer_nodes();
    let inside = (0..is_outer.len()).filter(|n| !is_outer[*n]);
    let star_centres = chart.node_count()..chart.node_count() + chart.loops().len();
    let free: Vec<u32> = inside.chain(star_centres).map(|n| n as u32).collect();
    let arcs = region::arc_cells(chart, |_| true, unset(weights.mean));
    Problem::new(chart, objective, cells, arcs, &free, checkpoint)
}

/// Minimises with falling weights.
fn descend<O: Objective>(problem: &mut Problem<O>, x: &mut [[f64; 2]], stats: &mut Stats) -> Result<(), Error> {
    if problem.unknowns() == 0 {
        return Ok(());
    }
    let pattern = problem.pattern();
    problem.checkpoint()?;
    let analysis = pattern.analyse()?;
    let steps = (WORK / problem.cells.len()).clamp(STEPS[0], STEPS[1]);
    let limits = Limits { steps, tolerance: TOLERANCE };
    // Weights are shares of what `weights` found: they are scaled from one to the next.
    let mut last = 1.0;
    for weight in WEIGHTS {
        problem.scale_weights(weight / last);
        last = weight;
        stats.add(minimise(problem, &analysis, x, Penalty::Barrier, limits)?);
    }
    Ok(())
}
