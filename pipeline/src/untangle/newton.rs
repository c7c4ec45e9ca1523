//! Newton's method with a line search that never leaves the region where the objective is finite.

use super::penalty::Penalty;
use super::problem::{Places, Problem, newton_step};
use crate::fem::sparse::{Analysis, Error, Pattern};

/// The share of the way to the nearest floor that one step may go.
const SAFE: f64 = 0.95;

/// The share of the predicted decrease that a step must bring (Armijo).
const DECREASE: f64 = 1e-4;

/// How often a step is halved at most.
const HALVINGS: u32 = 30;

/// How Newton's method ended.
#[derive(Clone, Copy, Debug)]
pub(super) struct Outcome {
    pub iterations: usize,
    /// The decrease of the objective that the last quadratic model promised, relative to the objective.
    pub decrement: f64,
}

/// At most `most` steps, fewer where the promised decrease falls below `tolerance` (relative), or where rounding
/// hides any decrease.
pub(super) fn minimise(
    problem: &mut Problem,
    (pattern, analysis): (&Pattern, &Analysis),
    x: &mut Places,
    penalty: Penalty,
    (most, tolerance): (usize, f64),
) -> Result<Outcome, Error> {
    let mut objective = problem.objective(x, penalty);
    let mut outcome = Outcome { iterations: 0, decrement: 0.0 };
    while outcome.iterations < most {
        problem.checkpoint()?;
        let mut model = problem.model(x, penalty, pattern);
        let step = newton_step(problem, (pattern, analysis), &mut model)?;
        let slope: f64 = step.iter().zip(&model.gradient).map(|(s, g)| s * g).sum();
        outcome.decrement = -0.5 * slope / objective.abs().max(f64::MIN_POSITIVE);
        if outcome.decrement.is_nan() || outcome.decrement <= tolerance {
            break;
        }
        let direction = problem.direction(&step);
        let from = matches!(penalty, Penalty::Barrier).then(|| x.clone());
        let Some(lower) = search(problem, x, &direction, penalty, objective, slope) else { break };
        if let Some(from) = from {
            problem.update_duals(&from, &direction, x);
        }
        objective = lower;
        outcome.iterations += 1;
    }
    Ok(outcome)
}

/// Moves `x` along `direction` as far as the objective falls as promised; the new objective, or `None` where no
/// step brings a decrease.
fn search(
    problem: &Problem,
    x: &mut Places,
    direction: &Places,
    penalty: Penalty,
    objective: f64,
    slope: f64,
) -> Option<f64> {
    let limit = match penalty {
        Penalty::Barrier => SAFE * problem.longest_step(x, direction),
        Penalty::Regularised { .. } => f64::INFINITY,
    };
    let start: Vec<[f64; 2]> = problem.free().iter().map(|n| x[*n as usize]).collect();
    let mut t = limit.min(1.0);
    for _ in (0..HALVINGS).take_while(|_| problem.checkpoint().is_ok()) {
        for (p, n) in start.iter().zip(problem.free()) {
            let d = direction[*n as usize];
            x[*n as usize] = [p[0] + t * d[0], p[1] + t * d[1]];
        }
        let reached = problem.objective(x, penalty);
        if reached <= objective + DECREASE * t * slope && reached < objective {
            return Some(reached);
        }
        t *= 0.5;
    }
    problem.free().iter().zip(start).for_each(|(n, p)| x[*n as usize] = p);
    None
}
