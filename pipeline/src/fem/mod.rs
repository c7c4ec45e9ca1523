//! Finite elements: elements and quadrature on triangles, the jacobian of the 6-node one, and the systems that
//! elements make.

pub mod assembly;
pub mod bernstein;
pub mod dofs;
pub mod element;
pub(crate) mod elimination;
pub mod geometry;
pub(crate) mod jacobian;
pub(crate) mod laplace;
pub mod quadrature;
pub mod sparse;
pub mod stiffness;
