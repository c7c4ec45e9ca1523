//! Finite elements.
//!
//! * [`element`]: what an element is, and the two there are; [`quadrature`] and the [`geometry`] of a triangle in space
//!   make its [`stiffness`] where there is no closed form.
//! * [`dofs`]: which node has which unknown; [`assembly`]: systems of elements; [`sparse`]: how they are solved.
//! * [`bernstein`]: whether a quadratic triangle in the plane is valid, exactly.
//!
//! Another element is one more file beside [`element::P2`], and triangles that are curved in space are others of
//! [`stiffness::Triangles`]: systems, maps and energies take them as they are. What decides validity, and all that is built on
//! it (constraints of the untangler, cells of the certifier), is made for quadratic triangles; see docs/architecture.md.

pub mod assembly;
pub mod bernstein;
pub mod dofs;
pub mod element;
pub mod geometry;
pub(crate) mod isotropic;
pub(crate) mod jacobian;
pub(crate) mod laplace;
pub mod quadrature;
pub mod sparse;
pub mod stiffness;
pub(crate) mod two_level;
