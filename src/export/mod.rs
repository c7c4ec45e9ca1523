//! What a mesher gets of a certified atlas: sizes, names, parts. How that is encoded is a matter of [`crate::formats`].

mod gmsh;
mod narrow;

pub use gmsh::{Export, gmsh};
