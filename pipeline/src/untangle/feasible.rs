//! The feasible path: a log-barrier method from the raised linear map.

use super::newton::minimise;
use super::penalty::{Bound, Penalty};
use super::problem::{Cell, Problem};
use super::{Effort, on_grid, places, region};
use crate::fem::sparse::Error;
use crate::grid::GridPoint;
use crate::map::closed::ClosedChart;
use crate::map::quadratic::energies;
use crate::monitor::Checkpoint;

/// The weights of the barrier, relative to the energy of each triangle.
const WEIGHTS: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Newton steps per weight, on large and on small charts, and the triangles times steps that decide between.
const STEPS: [usize; 2] = [12, 60];
const WORK: usize = 120_000;

/// A weight is left when the promised decrease falls below this share of the energy.
const TOLERANCE: f64 = 1e-9;

/// The share of its value in the start that every coefficient keeps.
const KEPT: f64 = 1e-3;

/// Descends from `start`; `None` where the systems are too large or cannot be factorised, or nobody waits any more.
pub(super) fn untangle(
    chart: &ClosedChart,
    start: &[GridPoint],
    effort: &mut Effort,
    checkpoint: &Checkpoint,
) -> Option<Vec<GridPoint>> {
    checkpoint.after(chart.triangles().len()).ok()?;
    let centres: Vec<GridPoint> = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
    let mut all = places(start, &centres);
    let energies: Vec<f64> = energies(chart, &all).collect();
    let mean = energies.iter().sum::<f64>() / chart.own_triangles() as f64;
    let mut problem = problem(chart, &energies, mean, checkpoint);
    let mut x = problem.gather(&all);
    problem
        .for_each_bound(&x, |c, bound| *bound = Bound { scale: c, floor: KEPT * c, weight: bound.weight, dual: None });
    descend(&mut problem, &mut x, effort).ok()?;
    problem.moved(&x).for_each(|(n, p)| all[n] = *p);
    Some(on_grid(chart, &all))
}

fn unset(weight: f64) -> Bound {
    Bound { scale: 1.0, floor: 0.0, weight, dual: None }
}

/// All triangles, with weights proportional to their energies but bounds still unset; every node may move but those
/// of the outer loop.
fn problem<'a>(chart: &'a ClosedChart, energies: &[f64], mean: f64, checkpoint: &'a Checkpoint) -> Problem<'a> {
    let own = chart.own_triangles() as u32;
    let bounds = |face: u32| (face < own).then(|| [unset(energies[face as usize].max(1e-6 * mean)); 6]);
    let cells = (0..chart.triangles().len() as u32).map(|face| Cell { face, bounds: bounds(face) }).collect();
    let fixed = chart.outer_nodes();
    let centres = chart.node_count()..chart.node_count() + chart.loops().len();
    let free: Vec<u32> = (0..fixed.len()).filter(|n| !fixed[*n]).chain(centres).map(|n| n as u32).collect();
    Problem::new(chart, cells, region::arc_cells(chart, |_| true, unset(mean)), &free, checkpoint)
}

/// Minimises with falling weights.
fn descend(problem: &mut Problem, x: &mut super::Places, effort: &mut Effort) -> Result<(), Error> {
    if problem.unknowns() == 0 {
        return Ok(());
    }
    let pattern = problem.pattern();
    problem.checkpoint()?;
    let analysis = pattern.analyse()?;
    let steps = (WORK / problem.cells.len()).clamp(STEPS[0], STEPS[1]);
    let mut last = 1.0;
    for weight in WEIGHTS {
        problem.scale_weights(weight / last);
        last = weight;
        effort.add(minimise(problem, (&pattern, &analysis), x, Penalty::Barrier, (steps, TOLERANCE))?);
    }
    Ok(())
}
