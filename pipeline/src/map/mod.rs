//! Maps of charts to the plane: linear, quadratic, and those with a boundary of their own.

pub mod boundary;
mod elimination;
pub mod filled;
pub mod harmonic;
pub mod linear;
pub mod natural;
pub mod nodes;
pub mod quadratic;
mod weights;
