//! Finite elements: the 6-node triangle, its jacobian, and the systems that elements make.

pub mod bernstein;
pub mod element;
pub(crate) mod elimination;
pub(crate) mod jacobian;
pub mod sparse;
