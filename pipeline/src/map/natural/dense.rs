//! Small dense systems.

/// The solution of the equations, each of which is its coefficients and its right-hand side, by elimination with partial
/// pivoting; none where they are singular in doubles.
pub(super) fn solve(mut equations: Vec<Vec<f64>>) -> Option<Vec<f64>> {
    let count = equations.len();
    for k in 0..count {
        let pivot = (k..count).max_by(|i, j| equations[*i][k].abs().total_cmp(&equations[*j][k].abs()))?;
        equations.swap(k, pivot);
        let (done, rest) = equations.split_at_mut(k + 1);
        let row = &done[k];
        for other in rest {
            let factor = other[k] / row[k];
            (k..=count).for_each(|j| other[j] -= factor * row[j]);
        }
    }
    let mut solution = vec![0.0; count];
    for k in (0..count).rev() {
        let row = &equations[k];
        let known: f64 = (k + 1..count).map(|j| row[j] * solution[j]).sum();
        solution[k] = (row[count] - known) / row[k];
    }
    solution.iter().all(|x| x.is_finite()).then_some(solution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved_and_singular_ones_are_not() {
        // x + 2 y = 4, and 3 y + 0 x = 3 first, so that rows must be swapped.
        let solution = solve(vec![vec![0.0, 3.0, 3.0], vec![1.0, 2.0, 4.0]]).expect("regular");
        assert!((solution[0] - 2.0).abs() < 1e-15 && (solution[1] - 1.0).abs() < 1e-15);
        assert!(solve(vec![vec![1.0, 2.0, 4.0], vec![2.0, 4.0, 1.0]]).is_none());
        assert_eq!(solve(vec![]), Some(vec![]));
    }
}
