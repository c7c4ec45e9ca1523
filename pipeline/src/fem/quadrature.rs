//! Quadrature on triangles: symmetric rules with positive weights and points inside.
//!
//! A rule is a list of orbits, sets of points that the symmetries of the triangle carry into each other. The points
//! are those of Hammer, Marlowe and Stroud (1956, doi 10.1090/S0025-5718-1956-0086389-6; degrees 1 and 2), Radon (1948,
//! doi 10.1007/BF01525334; degree 5), and Dunavant (1985, doi 10.1002/nme.1620210612; degrees 4, 6 and 8), those of the last
//! computed anew to the precision of doubles by Newton's method on the moments.

use super::element::Barycentric;

/// Points that the symmetries of the triangle carry into each other, with the weight of each of them.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Orbit {
    /// The centroid.
    Centroid { weight: f64 },
    /// Three points on the medians, with two coordinates equal to `a`.
    Medians { a: f64, weight: f64 },
    /// Six points, with coordinates `a`, `b`, and what is left.
    General { a: f64, b: f64, weight: f64 },
}

/// A quadrature rule: sum of weight times value approximates the mean over the triangle. Weights sum to 1.
///
/// # Example
///
/// The integral of xi^2 eta over the reference triangle (of area 1/2) is 1/60.
///
/// ```
/// use planish_core::fem::quadrature::Rule;
///
/// let rule = Rule::of_degree(3);
/// let mean = rule.mean(|[_, xi, eta]| xi * xi * eta);
/// assert!((0.5 * mean - 1.0 / 60.0).abs() < 1e-16);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    degree: u32,
    orbits: &'static [Orbit],
}

/// The rules, by rising degree.
static RULES: [Rule; 6] = [
    Rule { degree: 1, orbits: &[Orbit::Centroid { weight: 1.0 }] },
    Rule { degree: 2, orbits: &[Orbit::Medians { a: 1.0 / 6.0, weight: 1.0 / 3.0 }] },
    Rule {
        degree: 4,
        orbits: &[
            Orbit::Medians { a: 0.445_948_490_915_964_9, weight: 0.223_381_589_678_011_47 },
            Orbit::Medians { a: 0.091_576_213_509_770_74, weight: 0.109_951_743_655_321_87 },
        ],
    },
    Rule {
        degree: 5,
        orbits: &[
            Orbit::Centroid { weight: 0.225 },
            // (6 -+ sqrt 15) / 21 and (155 -+ sqrt 15) / 1200.
            Orbit::Medians { a: 0.101_286_507_323_456_34, weight: 0.125_939_180_544_827_15 },
            Orbit::Medians { a: 0.470_142_064_105_115_1, weight: 0.132_394_152_788_506_2 },
        ],
    },
    Rule {
        degree: 6,
        orbits: &[
            Orbit::Medians { a: 0.249_286_745_170_910_42, weight: 0.116_786_275_726_379_37 },
            Orbit::Medians { a: 0.063_089_014_491_502_23, weight: 0.050_844_906_370_206_82 },
            Orbit::General {
                a: 0.053_145_049_844_816_945,
                b: 0.310_352_451_033_784_4,
                weight: 0.082_851_075_618_373_57,
            },
        ],
    },
    Rule {
        degree: 8,
        orbits: &[
            Orbit::Centroid { weight: 0.144_315_607_677_787_17 },
            Orbit::Medians { a: 0.459_292_588_292_723_1, weight: 0.095_091_634_267_284_62 },
            Orbit::Medians { a: 0.170_569_307_751_760_2, weight: 0.103_217_370_534_718_25 },
            Orbit::Medians { a: 0.050_547_228_317_030_98, weight: 0.032_458_497_623_198_08 },
            Orbit::General {
                a: 0.008_394_777_409_957_605,
                b: 0.263_112_829_634_638_1,
                weight: 0.027_230_314_174_434_994,
            },
        ],
    },
];

impl Rule {
    /// The highest degree that a rule has.
    pub const MAX_DEGREE: u32 = 8;

    /// The smallest rule that integrates all polynomials up to `degree` exactly. There is not one for every degree.
    ///
    /// ```
    /// use planish_core::fem::quadrature::Rule;
    ///
    /// assert_eq!(Rule::of_degree(3).degree(), 4);
    /// let mut points = 0;
    /// Rule::of_degree(3).for_each(|_, _| points += 1);
    /// assert_eq!(points, 6);
    /// ```
    ///
    /// # Panics
    /// Where `degree` is above [`Self::MAX_DEGREE`]: there is no such rule.
    pub fn of_degree(degree: u32) -> &'static Self {
        let found = RULES.iter().find(|rule| rule.degree >= degree);
        found.unwrap_or_else(|| panic!("no quadrature rule of degree {degree}: the highest is {}", Self::MAX_DEGREE))
    }

    /// Polynomials up to this degree are integrated exactly.
    pub fn degree(&self) -> u32 {
        self.degree
    }

    /// Visits every point with its weight.
    pub fn for_each(&self, mut visit: impl FnMut(Barycentric, f64)) {
        for orbit in self.orbits {
            match *orbit {
                Orbit::Centroid { weight } => visit([1.0 / 3.0; 3], weight),
                Orbit::Medians { a, weight } => {
                    let b = 1.0 - 2.0 * a;
                    for l in [[b, a, a], [a, b, a], [a, a, b]] {
                        visit(l, weight);
                    }
                }
                Orbit::General { a, b, weight } => {
                    let c = 1.0 - a - b;
                    for l in [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]] {
                        visit(l, weight);
                    }
                }
            }
        }
    }

    /// The mean of `f` over the triangle; times the area it is the integral, where the area element is constant.
    pub fn mean(&self, f: impl Fn(Barycentric) -> f64) -> f64 {
        let mut sum = 0.0;
        self.for_each(|l, weight| sum += weight * f(l));
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean of l1^i l2^j over the triangle: 2 i! j! / (i + j + 2)!.
    fn mean_of_monomial(i: u32, j: u32) -> f64 {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        2.0 * factorial(i) * factorial(j) / factorial(i + j + 2)
    }

    /// How far `rule` is off at l1^i l2^j.
    fn error(rule: &Rule, i: u32, j: u32) -> f64 {
        (rule.mean(|l| l[1].powi(i as i32) * l[2].powi(j as i32)) - mean_of_monomial(i, j)).abs()
    }

    #[test]
    fn every_rule_is_exact_up_to_its_degree_and_not_beyond() {
        for rule in &RULES {
            for i in 0..=rule.degree {
                for j in 0..=rule.degree - i {
                    assert!(error(rule, i, j) < 1e-15, "degree {}: {i} {j}", rule.degree);
                }
            }
            let beyond = rule.degree + 1;
            assert!((0..=beyond).any(|i| error(rule, i, beyond - i) > 1e-9), "degree {} is understated", rule.degree);
        }
    }

    #[test]
    fn points_lie_inside_and_weights_are_positive() {
        for rule in &RULES {
            rule.for_each(|l, weight| {
                assert!(weight > 0.0 && l.iter().all(|c| *c > 0.0));
                assert!((l.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            });
        }
    }

    #[test]
    fn the_smallest_rule_that_suffices_is_found() {
        for (wanted, got) in [(0, 1), (1, 1), (2, 2), (3, 4), (4, 4), (5, 5), (6, 6), (7, 8), (8, 8)] {
            assert_eq!(Rule::of_degree(wanted).degree(), got);
        }
        assert_eq!(RULES[5].degree, Rule::MAX_DEGREE);
    }
}
