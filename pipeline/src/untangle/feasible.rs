//! The feasible path: a log-barrier method from the raised linear map.

use super::newton::minimise;
use super::penalty::{Bound, Penalty};
use super::problem::{ArcCell, Cell, Problem};
use super::{Effort, on_grid, places, region};
use crate::closed::ClosedChart;
use crate::grid::GridPoint;
use crate::sparse::Error;

/// The weights of the barrier, relative to the energy of each triangle.
const WEIGHTS: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// Newton steps per weight, on large and on small charts, and the triangles times steps that decide between.
const STEPS: [usize; 2] = [12, 60];
const WORK: usize = 120_000;

/// A weight is left when the promised decrease falls below this share of the energy.
const TOLERANCE: f64 = 1e-9;

/// The share of its value in the start that every coefficient keeps.
const KEPT: f64 = 1e-3;

/// Descends from `start`; `None` where the systems are too large or cannot be factorised.
pub(super) fn untangle(chart: &ClosedChart, start: &[GridPoint], effort: &mut Effort) -> Option<Vec<GridPoint>> {
    let centres: Vec<GridPoint> = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
    let mut x = places(start, &centres);
    let mut problem = problem(chart);
    let energy = problem.objective(&x, Penalty::Barrier) / chart.own_triangles() as f64;
    let energies = region::energies(chart, &x);
    for cell in &mut problem.cells {
        let weight = energies[cell.face as usize].max(1e-6 * energy);
        cell.bounds = ((cell.face as usize) < chart.own_triangles()).then(|| [unset(weight); 6]);
    }
    problem.arcs = region::arc_cells(chart, |_| true, unset(energy));
    problem
        .for_each_bound(&x, |c, bound| *bound = Bound { scale: c, floor: KEPT * c, weight: bound.weight, dual: None });
    descend(&mut problem, &mut x, effort).ok()?;
    Some(on_grid(chart, &x))
}

fn unset(weight: f64) -> Bound {
    Bound { scale: 1.0, floor: 0.0, weight, dual: None }
}

/// All triangles, without penalties yet; every node may move but those of the outer loop.
fn problem(chart: &ClosedChart) -> Problem<'_> {
    let cells = (0..chart.triangles().len() as u32).map(|face| Cell { face, bounds: None }).collect();
    let mut fixed = vec![false; chart.node_count() + chart.loops().len()];
    for h in chart.outer() {
        fixed[chart.vertex_node(chart.ends(*h)[0])] = true;
        fixed[chart.mid_node(*h)] = true;
    }
    let free = (0..fixed.len() as u32).filter(|n| !fixed[*n as usize]).collect();
    Problem::new(chart, cells, Vec::<ArcCell>::new(), free)
}

/// Minimises with falling weights.
fn descend(problem: &mut Problem, x: &mut super::Places, effort: &mut Effort) -> Result<(), Error> {
    if problem.unknowns() == 0 {
        return Ok(());
    }
    let pattern = problem.pattern();
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
