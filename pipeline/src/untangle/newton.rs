//! Newton's method with a line search that never leaves the region where the objective is finite.

use super::objective::Objective;
use super::penalty::Penalty;
use super::problem::Problem;
use crate::fem::sparse::{Analysis, Error};
use crate::monitor::Interrupted;

/// The share of the way to the nearest floor that one step may go. By experience: closer to 1 steps are longer, and end
/// where the barrier is so steep that the next ones are short.
const SAFE: f64 = 0.95;

/// The share of the predicted decrease that a step must bring (Armijo), as is usual (Nocedal and Wright 2006, *Numerical
/// Optimization*, section 3.1): it refuses steps that bring next to nothing, and no others.
const DECREASE: f64 = 1e-4;

/// How often a step is halved at most: to 1e-9 of it, where rounding hides what it brings.
const HALVINGS: u32 = 30;

/// When Newton's method ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Steps at most.
    pub steps: usize,
    /// The promised decrease, relative to the objective, below which no step is made.
    pub tolerance: f64,
}

/// How Newton's method ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    pub iterations: usize,
    /// The decrease of the objective that the last quadratic model promised, relative to the objective.
    pub decrement: f64,
}

/// Descends from `x` within `limits`; fewer steps where rounding hides any decrease.
///
/// # Errors
/// [`Error`] of a system that cannot be factorised, or interrupted.
pub(super) fn minimise<O: Objective>(
    problem: &mut Problem<O>,
    analysis: &Analysis,
    x: &mut [[f64; 2]],
    penalty: Penalty,
    limits: Limits,
) -> Result<Outcome, Error> {
    let mut value = problem.value(x, penalty);
    let mut outcome = Outcome { iterations: 0, decrement: 0.0 };
    while outcome.iterations < limits.steps {
        problem.checkpoint()?;
        let mut model = problem.model(x, penalty, analysis.pattern());
        let step = problem.newton_step(analysis, &mut model)?;
        let slope: f64 = step.iter().zip(&model.gradient).map(|(s, g)| s * g).sum();
        outcome.decrement = -0.5 * slope / value.abs().max(f64::MIN_POSITIVE);
        if outcome.decrement.is_nan() || outcome.decrement <= limits.tolerance {
            break;
        }
        let direction = problem.direction(&step);
        // Only the barrier has dual variables, which follow each step from where it began.
        let before = matches!(penalty, Penalty::Barrier).then(|| x.to_vec());
        let descent = Descent { direction: &direction, value, slope };
        let Some(lower) = search(problem, x, &descent, penalty)? else { break };
        if let Some(before) = before {
            problem.update_duals(&before, &direction, x);
        }
        value = lower;
        outcome.iterations += 1;
    }
    Ok(outcome)
}

/// A direction of descent, the value where it begins, and the slope along it.
struct Descent<'a> {
    direction: &'a [[f64; 2]],
    value: f64,
    slope: f64,
}

/// Moves `x` along a direction as far as the value falls as promised; the new value, or `None` where no step brings a
/// decrease and `x` stays.
fn search<O: Objective>(
    problem: &Problem<O>,
    x: &mut [[f64; 2]],
    descent: &Descent,
    penalty: Penalty,
) -> Result<Option<f64>, Interrupted> {
    let limit = match penalty {
        Penalty::Barrier => SAFE * problem.longest_step(x, descent.direction),
        Penalty::Regularised { .. } => f64::INFINITY,
    };
    let start: Vec<[f64; 2]> = problem.free().iter().map(|n| x[*n as usize]).collect();
    let mut t = limit.min(1.0);
    for _ in 0..HALVINGS {
        problem.checkpoint()?;
        for (p, n) in start.iter().zip(problem.free()) {
            let d = descent.direction[*n as usize];
            x[*n as usize] = [p[0] + t * d[0], p[1] + t * d[1]];
        }
        let reached = problem.value(x, penalty);
        // Where the promise is below rounding the first alone would take a step that brings nothing.
        let brings_enough = reached <= descent.value + DECREASE * t * descent.slope;
        if brings_enough && reached < descent.value {
            return Ok(Some(reached));
        }
        t *= 0.5;
    }
    for (n, p) in problem.free().iter().zip(start) {
        x[*n as usize] = p;
    }
    Ok(None)
}
