//! A quantity that must stay above a floor, with its slack and multiplier in a primal-dual interior-point method.

/// What is known of one constraint c - floor = slack > 0.
///
/// The slack stays positive; c itself need not be above its floor before the end, and its distance from the slack is brought
/// down like everything else. So steps are not cut where c curves towards its floor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bound {
    /// A typical size of the quantity, > 0.
    pub scale: f64,
    /// What it must stay above.
    pub floor: f64,
    /// How much the barrier counts: it is -weight ln slack.
    pub weight: f64,
    /// The slack, > 0.
    pub slack: f64,
    /// The multiplier, > 0: weight / slack at rest.
    pub dual: f64,
    /// What a unit of c - floor - slack costs where steps are compared; no less than any multiplier so far.
    pub cost: f64,
}

/// The share of its typical size that a slack has at least to begin with: less, and the first steps only make room.
const LEAST_SLACK: f64 = 1e-2;

/// How far a multiplier may be from weight / slack, as a factor (Waechter and Biegler 2006, doi 10.1007/s10107-004-0559-y,
/// equation 16, with less than their 1e10: larger ones hardly ever occur, and only spoil the matrix).
const DUAL_RANGE: f64 = 1e6;

/// The same where slacks are what there is. With 1e3 and more the barrier is crossed too boldly, and steps are cut short.
const DUAL_RANGE_INSIDE: f64 = 4.0;

/// How much more than the largest multiplier a unit of distance costs: any more makes the sum exact.
const COST: f64 = 1.5;

/// What a constraint adds to the condensed system of a Newton step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Condensed {
    /// Minus the slope in c.
    pub pull: f64,
    /// The curvature along the gradient of c.
    pub stiffness: f64,
}

/// The change of slack and multiplier that goes with a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Change {
    pub slack: f64,
    pub dual: f64,
}

impl Bound {
    /// A constraint of which nothing is known yet but what is typical and how much it counts.
    pub fn new(scale: f64, weight: f64) -> Self {
        Self { scale, floor: 0.0, weight, slack: scale, dual: weight / scale, cost: 0.0 }
    }

    /// Sets slack and multiplier for the quantity `c`.
    pub fn begin(&mut self, c: f64) {
        self.begin_with((c - self.floor).max(LEAST_SLACK * self.scale));
    }

    /// Sets slack and multiplier for a quantity that has this slack.
    pub fn begin_with(&mut self, slack: f64) {
        (self.slack, self.dual, self.cost) = (slack, self.weight / slack, 0.0);
    }

    /// How far the quantity `c` is from its slack.
    pub fn residual(&self, c: f64) -> f64 {
        c - self.floor - self.slack
    }

    /// What the constraint adds to the system, beside the curvature of c times its multiplier; eliminated as in Nocedal and Wright 2006, *Numerical Optimization*, equation
    /// 19.14.
    pub fn condensed(&self, c: f64) -> Condensed {
        let stiffness = self.dual / self.slack;
        Condensed { pull: self.weight / self.slack - stiffness * self.residual(c), stiffness }
    }

    /// The change that goes with one of `c` by `change`, to first order.
    pub fn change(&self, c: f64, change: f64) -> Change {
        let slack = change + self.residual(c);
        Change { slack, dual: (self.weight - self.dual * slack) / self.slack - self.dual }
    }

    /// Lets a unit of distance cost more than the multipliers before and behind a change.
    pub fn raise_cost(&mut self, change: &Change) {
        self.cost = self.cost.max(COST * self.dual.max(self.dual + change.dual));
    }

    /// What the constraint adds to the merit of a point: its barrier, and the distance from the slack.
    pub fn merit(&self, c: f64) -> f64 {
        -self.weight * (self.slack / self.scale).ln() + self.cost * self.residual(c).abs()
    }

    /// The slope of that merit along a change, where the distance shrinks.
    pub fn slope(&self, c: f64, change: &Change) -> f64 {
        -self.weight * change.slack / self.slack - self.cost * self.residual(c).abs()
    }

    /// The constraint after a share of a change that brought the quantity to `c`. A slack below what is there is raised: that
    /// lowers both parts of the merit.
    pub fn moved(&self, c: f64, change: &Change, share: f64, of_dual: f64) -> Self {
        let slack = (self.slack + share * change.slack).max(c - self.floor);
        self.with(slack, self.dual + of_dual * change.dual, DUAL_RANGE)
    }

    /// The same where the slack is what there is; none where that is nothing.
    pub fn moved_inside(&self, c: f64, change: &Change, of_dual: f64) -> Option<Self> {
        let slack = c - self.floor;
        (slack > 0.0).then(|| self.with(slack, self.dual + of_dual * change.dual, DUAL_RANGE_INSIDE))
    }

    fn with(&self, slack: f64, dual: f64, range: f64) -> Self {
        let centre = self.weight / slack;
        Self { slack, dual: dual.clamp(centre / range, centre * range), ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_rest_nothing_changes() {
        let mut bound = Bound::new(1.0, 0.5);
        bound.begin(2.0);
        assert_eq!((bound.residual(2.0), bound.condensed(2.0).pull), (0.0, 0.25));
        assert_eq!(bound.change(2.0, 0.0), Change { slack: 0.0, dual: 0.0 });
    }

    #[test]
    fn a_quantity_below_its_floor_has_a_slack_all_the_same_and_is_pulled_up() {
        let mut bound = Bound::new(1.0, 0.5);
        bound.begin(-3.0);
        assert_eq!(bound.slack, LEAST_SLACK);
        // Its change leads the slack to where the quantity is then.
        let change = bound.change(-3.0, 3.5);
        assert!((bound.slack + change.slack - 0.5).abs() < 1e-15 && bound.condensed(-3.0).pull > 0.0);
    }

    #[test]
    fn the_slope_is_that_of_the_merit() {
        let mut bound = Bound { floor: 0.1, ..Bound::new(0.7, 1.3) };
        for (c, dc) in [(0.9, -0.2), (-0.4, 0.3), (0.05, 0.6)] {
            bound.begin(c + 0.3);
            let change = bound.change(c, dc);
            bound.raise_cost(&change);
            let at = |t: f64| Bound { slack: bound.slack + t * change.slack, ..bound }.merit(c + t * dc);
            let h = 1e-7;
            let measured = (at(h) - at(0.0)) / h;
            assert!((measured - bound.slope(c, &change)).abs() < 1e-4 * measured.abs().max(1.0), "{measured}");
        }
    }

    #[test]
    fn a_multiplier_follows_and_stays_in_its_range() {
        let mut bound = Bound::new(1.0, 1.0);
        bound.begin(2.0);
        let change = bound.change(2.0, 0.4);
        assert!((bound.moved(2.4, &change, 1.0, 1.0).dual - (0.5 - 0.1)).abs() < 1e-15);
        let huge = Change { slack: 0.0, dual: 1e12 };
        assert_eq!(bound.moved(2.0, &huge, 1.0, 1.0).dual, 0.5 * DUAL_RANGE);
        // What is there is slack.
        assert_eq!(bound.moved(5.0, &change, 1.0, 1.0).slack, 5.0);
    }
}
