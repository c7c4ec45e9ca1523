//! Surfaces: from a soup of triangles to a mesh with edges, orientation and intrinsic lengths.

mod census;
mod edges;
mod intrinsic;
mod outlier;
mod soup;
mod stars;
mod steps;
mod surface;

pub use census::{Census, Umbrellas};
pub(crate) use census::{count_components, orientation};
pub use edges::EdgeTable;
pub use intrinsic::{Metric, TriangleShape};
pub use outlier::ValueApart;
pub use soup::{SoupError, TriangleSoup};
pub use stars::Stars;
pub use steps::{CoordinateSteps, FEW_STEPS};
pub use surface::SurfaceMesh;
