//! Symmetric systems put together from element matrices, with some nodes prescribed (Dirichlet conditions).

use super::dofs::Dofs;
use super::sparse::{Analysis, Error, Pattern};
use crate::monitor::Monitor;

/// A symmetric system for `C` fields at the nodes: one matrix, and for each field a right-hand side, made by its
/// prescribed values.
///
/// # Example
///
/// The temperature of a rod of two pieces, of which the second conducts twice as well, between 0 and 3.
///
/// ```
/// use planish_core::fem::assembly::Assembly;
/// use planish_core::fem::dofs::Dofs;
/// use planish_core::monitor::NoMonitor;
///
/// let dofs = Dofs::new(3, vec![1]);
/// let pieces = [[0, 1], [1, 2]];
/// let pattern = dofs.pattern(pieces);
/// let mut system = Assembly::new(&dofs, &pattern, vec![[0.0], [0.0], [3.0]]);
/// for (piece, conductance) in [1.0, 2.0].into_iter().enumerate() {
///     system.add(piece, &pieces[piece], &[[conductance, -conductance], [-conductance, conductance]]);
/// }
/// let temperatures = system.solve(&pattern.analyse()?, &NoMonitor)?;
/// assert_eq!(temperatures, [[0.0], [2.0], [3.0]]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Assembly<'a, const C: usize> {
    dofs: &'a Dofs,
    pattern: &'a Pattern,
    values: Vec<[f64; C]>,
    matrix: Vec<f64>,
    rhs: Vec<f64>,
}

impl<'a, const C: usize> Assembly<'a, C> {
    /// A system of zeros. `pattern` is that of all elements that will be added, `values` hold the prescribed values of
    /// the nodes (those of free nodes do not count).
    pub fn new(dofs: &'a Dofs, pattern: &'a Pattern, values: Vec<[f64; C]>) -> Self {
        Self { dofs, pattern, values, matrix: pattern.zeros(), rhs: vec![0.0; C * dofs.count()] }
    }

    /// Adds the dense symmetric `matrix` of an element, by its number in the pattern and its nodes.
    pub fn add<const N: usize>(&mut self, element: usize, nodes: &[usize; N], matrix: &[[f64; N]; N]) {
        self.pattern.add(&mut self.matrix, element, matrix);
        for i in 0..N {
            let Some(row) = self.dofs.unknown(nodes[i]) else { continue };
            for j in 0..N {
                if self.dofs.unknown(nodes[j]).is_none() {
                    self.dofs.add_prescribed(&mut self.rhs, row, nodes[j], -matrix[i][j], &self.values);
                }
            }
        }
    }

    /// The values of the fields at all nodes. `analysis` is that of the pattern.
    ///
    /// # Errors
    /// Those of [`Analysis::factorise`].
    pub fn solve(mut self, analysis: &Analysis, monitor: &dyn Monitor) -> Result<Vec<[f64; C]>, Error> {
        if self.dofs.count() > 0 {
            analysis.factorise(&self.matrix, monitor)?.solve(&mut self.rhs, C);
            self.dofs.scatter(&self.rhs, &mut self.values);
        }
        Ok(self.values)
    }
}

#[cfg(test)]
mod tests {
    use super::super::element::{Element, P1, P2};
    use super::*;
    use crate::mesh::TriangleShape;
    use crate::monitor::NoMonitor;

    /// Solves for free nodes of one triangle, all others prescribed as `exact` has them: the largest error.
    fn error_on_a_triangle<E: Element<N>, const N: usize>(free: Vec<u32>, exact: impl Fn([f64; 2]) -> f64) -> f64 {
        let shape = TriangleShape { lengths: [3.0, 5.0, 4.0] };
        let corners = shape.in_plane();
        let wanted = E::NODES.map(|l| [exact(P1::interpolate(&corners, l))]);
        let nodes: [usize; N] = std::array::from_fn(|n| n);
        let mut values = wanted.to_vec();
        free.iter().for_each(|n| values[*n as usize] = [f64::NAN]);
        let dofs = Dofs::new(N, free);
        let pattern = dofs.pattern([nodes]);
        let mut system = Assembly::new(&dofs, &pattern, values);
        system.add(0, &nodes, &E::stiffness(&shape));
        let found = system.solve(&pattern.analyse().expect("small"), &NoMonitor).expect("positive definite");
        found.iter().zip(&wanted).map(|(f, w)| (f[0] - w[0]).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn what_is_prescribed_stays_whether_or_not_anything_is_free() {
        assert_eq!(error_on_a_triangle::<P2, 6>(vec![], |[x, y]| x * x - y * y), 0.0);
    }

    #[test]
    fn linear_functions_are_found_again_from_the_vertices() {
        // NaN at free nodes before the solution shows that nobody looks there.
        assert!(error_on_a_triangle::<P2, 6>(vec![3, 5, 4], |[x, y]| 1.0 + 2.0 * x - y) < 1e-14);
    }

    #[test]
    fn the_minimiser_between_prescribed_nodes_satisfies_its_equation() {
        // One free node of a linear triangle: u minimises the energy, sum of w (u - u_j)^2 over both edges.
        let shape = TriangleShape { lengths: [3.0, 5.0, 4.0] };
        let k = P1::stiffness(&shape);
        let dofs = Dofs::new(3, vec![0]);
        let pattern = dofs.pattern([[0, 1, 2]]);
        let mut system = Assembly::new(&dofs, &pattern, vec![[0.0; 2], [2.0, -1.0], [5.0, 7.0]]);
        system.add(0, &[0, 1, 2], &k);
        let found = system.solve(&pattern.analyse().expect("small"), &NoMonitor).expect("positive definite");
        for c in 0..2 {
            let residual: f64 = (0..3).map(|j| k[0][j] * found[j][c]).sum();
            assert!(residual.abs() < 1e-13, "{found:?}");
        }
    }
}
