//! Connectivity without positions: which triangles meet where.
//!
//! Nothing in here knows a coordinate or a length, so that every statement holds for flat and curved, good and bad
//! triangulations alike: typed ids, the edges of a triangulation, the stars of its vertices, sheets and counts, and the
//! containers that such walks need.

mod census;
pub(crate) mod csr;
mod edges;
mod id;
mod stars;
pub(crate) mod union_find;
mod visits;

pub use census::{Census, Umbrellas};
pub(crate) use census::{count_components, orientation};
pub use edges::EdgeTable;
pub use id::{ChartId, CurveId, EdgeId, FaceId, HalfEdgeId, VertexId};
pub use stars::Stars;
pub(crate) use visits::VisitStamps;
