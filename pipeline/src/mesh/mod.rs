//! Surfaces: from a soup of triangles to a mesh with edges, orientation and intrinsic lengths.

mod bisect;
mod edit;
mod intrinsic;
mod labels;
mod outlier;
mod soup;
mod steps;
mod surface;

pub(crate) use bisect::{Halved, Ranks, falls_to_nothing, halve};
pub(crate) use edit::MeshEditor;
pub use intrinsic::{Metric, TriangleShape};
pub use outlier::ValueApart;
pub use soup::{SoupError, TriangleSoup};
pub use steps::{CoordinateSteps, FEW_STEPS};
pub(crate) use surface::Patch;
pub use surface::SurfaceMesh;
pub(crate) use surface::{Sheets, SurfaceParts, WeldedEnds, push_mean, vertices_of, welded_ends};
