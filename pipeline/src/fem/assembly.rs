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
/// assert!((temperatures[1][0] - 2.0).abs() < 1e-14);
/// assert_eq!([temperatures[0], temperatures[2]], [[0.0], [3.0]]);
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

    /// Adds to the right-hand sides at a node; at prescribed nodes there are none.
    pub fn add_load(&mut self, node: usize, load: [f64; C]) {
        if let Some(row) = self.dofs.unknown(node) {
            for (k, value) in load.into_iter().enumerate() {
                self.rhs[k * self.dofs.count() + row] += value;
            }
        }
    }

    /// The entries of the matrix, in the places of the pattern, and the right-hand sides, one column for each field.
    pub(crate) fn system(&self) -> (&[f64], &[f64]) {
        (&self.matrix, &self.rhs)
    }

    /// The values of the fields at all nodes, with the `solution` of the system at those that are free.
    pub(crate) fn with_solution(mut self, solution: &[f64]) -> Vec<[f64; C]> {
        self.dofs.scatter(solution, &mut self.values);
        self.values
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

    const SHAPE: TriangleShape = TriangleShape { lengths: [3.0, 5.0, 4.0] };

    /// Solves on one triangle with the nodes `free`, and what is `prescribed` at the others.
    fn solved<E: Element<N>, const N: usize>(free: Vec<u32>, prescribed: [[f64; 2]; N]) -> Vec<[f64; 2]> {
        let nodes: [usize; N] = std::array::from_fn(|n| n);
        let mut values = prescribed.to_vec();
        // Nobody looks there.
        free.iter().for_each(|n| values[*n as usize] = [f64::NAN; 2]);
        let dofs = Dofs::new(N, free);
        let pattern = dofs.pattern([nodes]);
        let mut system = Assembly::new(&dofs, &pattern, values);
        system.add(0, &nodes, &E::stiffness(&SHAPE));
        system.solve(&pattern.analyse().expect("small"), &NoMonitor).expect("positive definite")
    }

    fn check<E: Element<N>, const N: usize>(free: Vec<u32>) {
        let prescribed: [[f64; 2]; N] = std::array::from_fn(|n| [(n * n) as f64, 7.0 - n as f64]);
        let found = solved::<E, N>(free.clone(), prescribed);
        let k = E::stiffness(&SHAPE);
        for n in 0..N {
            if !free.contains(&(n as u32)) {
                assert_eq!(found[n], prescribed[n], "what is prescribed stays");
                continue;
            }
            for c in 0..2 {
                let residual: f64 = (0..N).map(|j| k[n][j] * found[j][c]).sum();
                assert!(residual.abs() < 1e-12, "free nodes satisfy their equation: {found:?}");
            }
        }
    }

    #[test]
    fn free_nodes_satisfy_their_equations_and_prescribed_ones_stay() {
        check::<P1, 3>(vec![]);
        check::<P1, 3>(vec![0]);
        check::<P2, 6>(vec![]);
        check::<P2, 6>(vec![3, 5, 4]);
        check::<P2, 6>(vec![4, 0]);
    }
}
