//! Weighted quantiles.

/// A value and how much it counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weighted {
    pub value: f64,
    pub weight: f64,
}

/// The values at the given shares of the total weight: sorted, the first at which so much weight is passed. 1 where
/// there is no value.
pub(crate) fn quantiles<const N: usize>(weighted: &mut [Weighted], shares: [f64; N]) -> [f64; N] {
    weighted.sort_unstable_by(|a, b| a.value.total_cmp(&b.value));
    let total: f64 = weighted.iter().map(|w| w.weight).sum();
    shares.map(|share| value_at(weighted, share * total))
}

/// The 99.9 % over the 0.1 % quantile: how unevenly a map scales areas. Infinite where the latter is not positive.
pub(crate) fn extreme_ratio(scales: &mut [Weighted]) -> f64 {
    let [low, high] = quantiles(scales, [0.001, 0.999]);
    if low > 0.0 { high / low } else { f64::INFINITY }
}

/// The value at which `weight` is passed.
fn value_at(sorted: &[Weighted], weight: f64) -> f64 {
    let mut left = weight;
    for w in sorted {
        left -= w.weight;
        if left <= 0.0 {
            return w.value;
        }
    }
    sorted.last().map_or(1.0, |w| w.value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_follow_the_weights() {
        let weighted = |(value, weight)| Weighted { value, weight };
        let mut values = [(3.0, 1.0), (1.0, 1.0), (2.0, 8.0)].map(weighted);
        assert_eq!(quantiles(&mut values, [0.05, 0.5, 0.95]), [1.0, 2.0, 3.0]);
        assert_eq!(quantiles(&mut [], [0.5]), [1.0]);
    }
}
