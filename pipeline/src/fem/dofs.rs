//! Degrees of freedom: which node has which unknown of a system, and which nodes are prescribed.
//!
//! The one numbering that everything with unknowns uses: linear and quadratic maps, orders of elimination, the
//! untangler, conformal maps, and the predictions of decomposition.

use super::sparse::{PRESCRIBED, Pattern};

/// The unknowns of a system, each at a node; all other nodes are prescribed.
///
/// # Example
///
/// Of four nodes the middle ones are free, the last of them first.
///
/// ```
/// use planish_core::fem::dofs::Dofs;
///
/// let dofs = Dofs::new(4, vec![2, 1]);
/// assert_eq!(dofs.unknown(2), Some(0));
/// assert_eq!(dofs.unknown(0), None);
/// // Nodal values: the prescribed ones are there, the solution is filled in.
/// let mut values = [[5.0], [0.0], [0.0], [8.0]];
/// dofs.scatter(&[7.0, 6.0], &mut values);
/// assert_eq!(values, [[5.0], [6.0], [7.0], [8.0]]);
/// ```
#[derive(Clone, Debug)]
pub struct Dofs {
    /// Per node its unknown, or [`PRESCRIBED`].
    unknown_of: Vec<u32>,
    /// Per unknown its node.
    free: Vec<u32>,
}

impl Dofs {
    /// Unknowns at the nodes `free` out of `nodes`, numbered in this order.
    ///
    /// # Panics
    /// If a node is named twice, or does not exist.
    pub fn new(nodes: usize, free: Vec<u32>) -> Self {
        let mut unknown_of = vec![PRESCRIBED; nodes];
        for (node, unknown) in free.iter().zip(0..) {
            let before = std::mem::replace(&mut unknown_of[*node as usize], unknown);
            assert_eq!(before, PRESCRIBED, "node {node} has one unknown");
        }
        Self { unknown_of, free }
    }

    /// How many unknowns there are.
    pub fn count(&self) -> usize {
        self.free.len()
    }

    /// How many nodes there are, prescribed ones included.
    pub fn nodes(&self) -> usize {
        self.unknown_of.len()
    }

    /// The nodes with an unknown, in the order of these.
    pub fn free(&self) -> &[u32] {
        &self.free
    }

    /// The unknown of a node, unless it is prescribed.
    pub fn unknown(&self, node: usize) -> Option<usize> {
        let unknown = self.unknown_of[node];
        (unknown != PRESCRIBED).then_some(unknown as usize)
    }

    /// The unknowns of an element's nodes, [`PRESCRIBED`] where there are none: what a [`Pattern`] is made from.
    pub fn element<const N: usize>(&self, nodes: &[usize; N]) -> [u32; N] {
        nodes.map(|n| self.unknown_of[n])
    }

    /// Component `k`, 0 or 1, of the unknown vector at a node of a vector field, whose unknowns alternate; or
    /// [`PRESCRIBED`].
    pub fn component(&self, node: usize, k: usize) -> u32 {
        match self.unknown_of[node] {
            PRESCRIBED => PRESCRIBED,
            unknown => 2 * unknown + k as u32,
        }
    }

    /// The pattern of a system of elements with these nodes.
    pub fn pattern<const N: usize>(&self, elements: impl IntoIterator<Item = [usize; N]>) -> Pattern {
        let elements: Vec<[u32; N]> = elements.into_iter().map(|nodes| self.element(&nodes)).collect();
        Pattern::new(self.count(), &elements)
    }

    /// The right-hand side of `C` columns, one after another, that the prescribed `values` make through an entry
    /// -`weight` of the matrix in the row of `unknown` and the column of a prescribed `node`.
    pub fn add_prescribed<const C: usize>(
        &self,
        rhs: &mut [f64],
        unknown: usize,
        node: usize,
        weight: f64,
        values: &[[f64; C]],
    ) {
        for k in 0..C {
            rhs[k * self.count() + unknown] += weight * values[node][k];
        }
    }

    /// Fills in the values at free nodes, from a solution of `C` columns, one after another.
    pub fn scatter<const C: usize>(&self, solution: &[f64], values: &mut [[f64; C]]) {
        for (unknown, node) in self.free.iter().enumerate() {
            values[*node as usize] = std::array::from_fn(|k| solution[k * self.count() + unknown]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn five() -> Dofs {
        Dofs::new(5, vec![4, 0, 2])
    }

    #[test]
    fn unknowns_are_numbered_in_the_order_given() {
        let dofs = five();
        assert_eq!((dofs.count(), dofs.nodes(), dofs.free()), (3, 5, &[4, 0, 2][..]));
        assert_eq!([0, 1, 2, 3, 4].map(|n| dofs.unknown(n)), [Some(1), None, Some(2), None, Some(0)]);
        assert_eq!(dofs.element(&[3, 4, 2]), [PRESCRIBED, 0, 2]);
        assert_eq!([dofs.component(2, 0), dofs.component(2, 1), dofs.component(1, 1)], [4, 5, PRESCRIBED]);
    }

    #[test]
    fn scattering_fills_in_free_nodes_only() {
        let dofs = five();
        let mut values = [[9.0, -9.0]; 5];
        let solution = [1.0, 2.0, 3.0, -1.0, -2.0, -3.0];
        dofs.scatter(&solution, &mut values);
        assert_eq!(values, [[2.0, -2.0], [9.0, -9.0], [3.0, -3.0], [9.0, -9.0], [1.0, -1.0]]);
    }
}
