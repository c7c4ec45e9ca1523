//! Scalar penalties that keep a quantity positive: value, slope and curvature.

/// A convex, falling function of one coefficient.
#[derive(Clone, Copy, Debug)]
pub(super) enum Penalty {
    /// -weight ln((c - floor) / scale): infinite at the floor. For points that are valid.
    Barrier,
    /// weight / chi(d), d = (c - floor) / scale, chi(d) = (d + sqrt(d^2 + eps^2)) / 2: finite everywhere, steep
    /// where d is negative (Garanzha and co-workers 2021, doi 10.1145/3450626.3459847). For points that are not.
    Regularised {
        /// Width of the transition, > 0.
        eps: f64,
    },
}

/// A penalty at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Value {
    pub value: f64,
    /// Minus the slope, >= 0.
    pub neg_derivative: f64,
    /// The multiplier that the curvature of the coefficient is weighted with, >= 0: the slope, or its dual estimate.
    pub multiplier: f64,
    /// The curvature, >= 0, or its dual estimate.
    pub second_derivative: f64,
}

/// The numbers that belong to one constrained coefficient.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    /// A typical size of the coefficient, > 0.
    pub scale: f64,
    /// What it must stay above.
    pub floor: f64,
    /// How much the penalty counts.
    pub weight: f64,
    /// The dual variable of the barrier: an estimate of weight / gap; none before the first step.
    pub dual: Option<f64>,
}

/// How far a dual variable may be from what it estimates, as a factor. (Far charts need it small: with 1e3 and more
/// the barrier is crossed too boldly, and steps are cut short.)
const DUAL_RANGE: f64 = 4.0;

impl Bound {
    /// Updates the dual variable after a Newton step that changes the coefficient `from` by `change`, to first order,
    /// and in fact to `to`: the linearised complementarity, kept within a range of weight / gap (as in Waechter and
    /// Biegler 2006, doi 10.1007/s10107-004-0559-y, equations 14 and 16).
    pub fn update_dual(&mut self, from: f64, change: f64, to: f64) {
        let (gap, new_gap) = (from - self.floor, to - self.floor);
        let dual = self.dual.unwrap_or(self.weight / gap);
        let stepped = (self.weight - dual * change) / gap;
        let centre = self.weight / new_gap;
        self.dual = Some(stepped.clamp(centre / DUAL_RANGE, centre * DUAL_RANGE));
    }
}

impl Penalty {
    /// The penalty of the coefficient `c`; a value of infinity outside the barrier.
    pub fn at(self, c: f64, bound: &Bound) -> Value {
        let gap = c - bound.floor;
        let w = bound.weight;
        match self {
            Self::Barrier if gap > 0.0 => {
                let dual = bound.dual.unwrap_or(w / gap);
                Value {
                    value: -w * (gap / bound.scale).ln(),
                    neg_derivative: w / gap,
                    multiplier: dual,
                    second_derivative: dual / gap,
                }
            }
            Self::Barrier => {
                Value { value: f64::INFINITY, neg_derivative: 0.0, multiplier: 0.0, second_derivative: 0.0 }
            }
            Self::Regularised { eps } => {
                let d = gap / bound.scale;
                let root = d.hypot(eps);
                // 1 / chi without cancellation on either side of zero.
                let inverse = if d > 0.0 { 2.0 / (d + root) } else { 2.0 * (root - d) / (eps * eps) };
                let slope = inverse / root / bound.scale;
                let second_derivative = 2.0 / (root * root * root) / (bound.scale * bound.scale);
                Value {
                    value: w * inverse,
                    neg_derivative: w * slope,
                    multiplier: w * slope,
                    second_derivative: w * second_derivative,
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_and_curvatures_are_derivatives() {
        let bound = Bound { scale: 0.7, floor: 0.01, weight: 1.3, dual: None };
        let h = 1e-5;
        for penalty in [Penalty::Barrier, Penalty::Regularised { eps: 0.1 }] {
            for c in [0.05, 0.4, 2.0] {
                let [low, mid, high] = [c - h, c, c + h].map(|c| penalty.at(c, &bound));
                assert!(((high.value - low.value) / (2.0 * h) + mid.neg_derivative).abs() < 1e-5 * mid.neg_derivative);
                assert!(
                    ((low.neg_derivative - high.neg_derivative) / (2.0 * h) - mid.second_derivative).abs()
                        < 1e-5 * mid.second_derivative
                );
            }
        }
    }

    #[test]
    fn a_dual_variable_follows_the_linearised_complementarity_within_its_range() {
        let mut bound = Bound { scale: 1.0, floor: 0.0, weight: 1.0, dual: None };
        // At rest the dual is weight / gap.
        bound.update_dual(2.0, 0.0, 2.0);
        assert_eq!(bound.dual, Some(0.5));
        // A small step: (weight - dual change) / gap.
        bound.update_dual(2.0, 0.4, 2.4);
        assert_eq!(bound.dual, Some((1.0 - 0.5 * 0.4) / 2.0));
        // A step that would make it negative, or far too large, is kept in range.
        bound.update_dual(2.0, 10.0, 2.0);
        assert_eq!(bound.dual, Some(0.5 / DUAL_RANGE));
        bound.update_dual(0.01, -0.1, 2.0);
        assert_eq!(bound.dual, Some(0.5 * DUAL_RANGE));
    }

    #[test]
    fn the_regularised_penalty_is_smooth_and_falling_through_zero() {
        let bound = Bound { scale: 1.0, floor: 0.0, weight: 1.0, dual: None };
        let penalty = Penalty::Regularised { eps: 1e-3 };
        let values: Vec<_> = (-50..50).map(|i| penalty.at(f64::from(i) * 1e-4, &bound)).collect();
        assert!(values.windows(2).all(|w| w[0].value > w[1].value && w[0].neg_derivative > w[1].neg_derivative));
        assert_eq!(Penalty::Barrier.at(0.0, &bound).value, f64::INFINITY);
    }
}
