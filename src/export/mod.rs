//! What a mesher gets of a certified atlas: sizes, names, parts. How that is encoded is a matter of [`crate::formats`].

mod gmsh;
mod groups;
mod mmg;
mod narrow;
mod sizes;

use crate::formats::Label;
pub use gmsh::{Export, gmsh};
pub use mmg::{MmgExport, mmg};

/// What a mesher shall be asked for.
#[derive(Clone, Copy, Debug)]
pub struct Wanted<'a> {
    /// The length of edges.
    pub sizes: Sizes,
    /// The parts of the surface that have names, in the order of the surface's labels.
    pub labels: &'a [Label],
    /// The dihedral angle of features, in degrees, where curves along these are to have a name.
    pub features: Option<f64>,
    /// The dihedral angle of ridges, in degrees, where a mesher is told of these.
    pub ridges: Option<f64>,
    /// The order of the elements: 1 or 2.
    pub order: u8,
}

/// How long edges shall be, in the unit of the input. What the input itself asks for, its surface tells.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// The largest length, and that of all edges where nothing asks for less.
    pub size: f64,
    /// The least length; 0 where any may be.
    pub min: f64,
    /// How many edges make a full turn around a bend.
    pub per_turn: Option<f64>,
    /// How far mesh and surface may be from each other.
    pub deviation: Option<f64>,
    /// How much longer edges may become over a distance.
    pub gradation: f64,
}
