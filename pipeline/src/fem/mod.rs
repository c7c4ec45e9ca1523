//! Finite elements.
//!
//! * [`element`]: what an element is, and the two there are; [`quadrature`] and the [`geometry`] of a triangle in space
//!   make its [`stiffness`] where there is no closed form.
//! * [`dofs`]: which node has which unknown; [`assembly`]: systems of elements; [`sparse`]: how they are solved.
//! * [`bernstein`]: whether a quadratic triangle in the plane is valid, exactly.
//!
//! Another element is one more file beside [`element::P2`], and a triangle that is curved in space another
//! [`geometry::FirstForm`]; only what decides validity, and so the untangler, is made for quadratic triangles.

pub mod assembly;
pub mod bernstein;
pub mod dofs;
pub mod element;
pub mod geometry;
pub(crate) mod jacobian;
pub(crate) mod laplace;
pub mod quadrature;
pub mod sparse;
pub mod stiffness;
