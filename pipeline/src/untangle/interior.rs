//! A primal-dual interior-point method (Waechter and Biegler 2006, doi 10.1007/s10107-004-0559-y; Nocedal and Wright 2006,
//! *Numerical Optimization*, section 19.3) for an objective under penalised quantities that must be positive.
//!
//! Quantities have slacks, which stay positive, and need not agree with them before the end. A barrier of the
//! quantities themselves jams: they are quadratic, and where some curve towards zero all steps end there. With slacks, steps
//! are cut by their linear change only, and what disagrees costs more than it brings (an exact sum of distances decides how
//! far a step goes). So any map may be the beginning, valid or not.
//!
//! Steps are Newton's, with the exact curvature of objective and quantities, made positive triangle by triangle.

use super::objective::Objective;
use super::problem::{Of, Problem};
use crate::fem::sparse::{Analysis, Error};

/// The share of its slack that one step may take. As is usual.
const SAFE: f64 = 0.99;

/// The share of the predicted decrease that a step must bring (Armijo), as is usual: it refuses steps that bring next to
/// nothing, and no others.
const DECREASE: f64 = 1e-4;

/// How often a step is halved at most: to 1e-6 of it, where rounding hides what it brings.
const HALVINGS: u32 = 20;

/// The barrier's weights: shares of what [`super::bound::Bound::weight`] is to begin with. The last one decides how close the
/// result comes: with 55 invalid triangles of 1,076 the energy was 7.7009, 7.4736, 7.4626 and 7.4622 at 1e-4 to 1e-7, that of
/// the harmonic map 7.4603.
const WEIGHTS: [f64; 6] = [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

/// A weight but the last is left when what is promised falls below this share of the objective for each unit of it: the next one
/// asks for more.
const LOOSE: f64 = 0.1;

/// The last one is left below this share of the objective. Its root is the norm of the gradient in the report: 1e-5.
const TOLERANCE: f64 = 1e-10;

/// Steps at most, all weights together. None of the charts that were looked at needs half as many; it ends the loop where
/// rounding keeps it from coming to rest.
const STEPS: usize = 100;

/// What is asked of a minimum.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// The barrier's weights, one after the other.
    pub weights: &'static [f64],
    /// A weight is left when so many steps together lower the objective by less than this share of it.
    pub idle: Option<(usize, f64)>,
}

/// As near as the last weight allows.
pub(super) const NEAREST: Wanted = Wanted { weights: &WEIGHTS, idle: None };

/// The same for objectives that keep maps valid themselves, but for what lies between the points of a quadrature. Larger weights
/// only lead away from where the objective is least: with all six the charts of cad_box_multi took twice as long. And near is
/// enough: two charts of brain_ch2 come within a thousandth in 25 steps, and creep for 70 more, of which each takes 0.1 s.
pub(super) const NEAR: Wanted = Wanted { weights: &[1e-4, 1e-6], idle: Some((5, 1e-3)) };

/// How the method ended.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcome {
    /// Newton steps.
    pub iterations: usize,
    /// The decrease that the last quadratic model promised, relative to the objective.
    pub decrement: f64,
    /// The objective before the last step.
    energy: f64,
}

/// Minimises from `x`, whose weights are those of a barrier that counts as much as the objective, by these shares of them in turn. The penalised quantities of the
/// result are positive where there is a solution near by; whoever asks looks.
///
/// # Errors
/// [`Error`] of a system that cannot be factorised, or interrupted.
pub(super) fn minimise<O: Objective>(
    problem: &mut Problem<O>,
    analysis: &Analysis,
    x: &mut [[f64; 2]],
    wanted: Wanted,
) -> Result<Outcome, Error> {
    let mut outcome = Outcome::default();
    let mut last = 1.0;
    for weight in wanted.weights {
        problem.scale_weights(*weight / last);
        if last == 1.0 {
            problem.begin(x);
        }
        last = *weight;
        let is_last = Some(weight) == wanted.weights.last();
        let tolerance = if is_last { TOLERANCE } else { LOOSE * weight };
        let mut energies = Vec::new();
        while outcome.iterations < STEPS && step(problem, analysis, x, tolerance, &mut outcome)? {
            energies.push(outcome.energy);
            if wanted.idle.is_some_and(|idle| is_idle(&energies, idle)) {
                break;
            }
        }
    }
    Ok(outcome)
}

/// Whether the last `steps` lowered an objective, which had these values before each, by less than a `share` of it.
fn is_idle(energies: &[f64], (steps, share): (usize, f64)) -> bool {
    let Some(from) = energies.len().checked_sub(steps + 1) else { return false };
    energies[from] - energies[energies.len() - 1] < share * energies[from].abs()
}

/// One Newton step; false where none is to be made.
fn step<O: Objective>(
    problem: &mut Problem<O>,
    analysis: &Analysis,
    x: &mut [[f64; 2]],
    tolerance: f64,
    outcome: &mut Outcome,
) -> Result<bool, Error> {
    problem.checkpoint()?;
    let mut model = problem.model(x, analysis.pattern());
    let along = problem.newton_step(analysis, &mut model)?;
    let direction = problem.direction(&along);
    let quantities = problem.quantities(x);
    let course = problem.course(x, &quantities, &direction);
    let energy_slope: f64 = along.iter().zip(&model.energy_gradient).map(|(s, g)| s * g).sum();
    let promised: f64 = -0.5 * along.iter().zip(&model.gradient).map(|(s, g)| s * g).sum::<f64>();
    let merit = problem.merit(x, &quantities);
    let size = merit.energy.abs().max(f64::MIN_POSITIVE);
    outcome.decrement = promised.max(0.0) / size;
    outcome.energy = merit.energy;
    if promised.is_nan() || (outcome.decrement <= tolerance && merit.distance <= tolerance * size) {
        return Ok(false);
    }
    let slope = energy_slope + course.slope;
    let start: Vec<[f64; 2]> = problem.free().iter().map(|n| x[*n as usize]).collect();
    let mut share = course.longest(SAFE, Of::Slacks);
    let of_dual = course.longest(SAFE, Of::Multipliers);
    for _ in 0..HALVINGS {
        problem.checkpoint()?;
        for (p, n) in start.iter().zip(problem.free()) {
            let d = direction[*n as usize];
            x[*n as usize] = [p[0] + share * d[0], p[1] + share * d[1]];
        }
        let quantities = problem.quantities(x);
        if let Some(bounds) = problem.moved_bounds(&quantities, &course, share, of_dual) {
            let reached = problem.merit_with(&bounds, x, &quantities).total;
            if reached <= merit.total + DECREASE * share * slope && reached < merit.total {
                problem.set_bounds(bounds);
                outcome.iterations += 1;
                return Ok(true);
            }
        }
        share *= 0.5;
    }
    for (n, p) in problem.free().iter().zip(start) {
        x[*n as usize] = p;
    }
    Ok(false)
}
