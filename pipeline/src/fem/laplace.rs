//! The Laplace problem: harmonic functions with prescribed values, by finite elements.

use super::assembly::Assembly;
use super::dofs::Dofs;
use super::sparse::Error;
use crate::monitor::Checkpoint;

/// The harmonic functions, `C` at a time, that have the given values at all nodes that `dofs` does not number: they
/// minimise the Dirichlet energy. Unknowns are eliminated as they are numbered.
///
/// Elements are told by their nodes and their stiffness matrices, so that their order, and whether they are flat or
/// curved, is the caller's.
///
/// # Errors
/// [`Error`] when the system cannot be factorised, or the computation is interrupted.
pub(crate) fn harmonic<const N: usize, const C: usize>(
    dofs: &Dofs,
    elements: usize,
    nodes: impl Fn(usize) -> [usize; N],
    stiffness: impl Fn(usize) -> [[f64; N]; N],
    prescribed: Vec<[f64; C]>,
    checkpoint: &Checkpoint,
) -> Result<Vec<[f64; C]>, Error> {
    checkpoint.after(elements)?;
    let pattern = dofs.pattern((0..elements).map(&nodes));
    let mut system = Assembly::new(dofs, &pattern, prescribed);
    for element in 0..elements {
        system.add(element, &nodes(element), &stiffness(element));
    }
    checkpoint.after(elements)?;
    system.solve(&pattern.analyse_as_numbered()?, checkpoint.monitor)
}
