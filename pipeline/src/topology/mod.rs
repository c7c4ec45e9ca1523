//! Connectivity without positions: which triangles meet where.
//!
//! Nothing in here knows a coordinate or a length, so that every statement holds for flat and curved, good and bad
//! triangulations alike: typed ids, the edges of a triangulation, the stars of its vertices, sheets and counts, and the
//! containers that such walks need.

pub(crate) mod csr;
pub(crate) mod dijkstra;
mod edges;
mod id;
pub(crate) mod loops;
pub(crate) mod partition;
mod stars;
mod summary;
pub(crate) mod union_find;
mod visits;

pub use edges::EdgeTable;
pub use id::{ChartId, CurveId, EdgeId, FaceId, HalfEdgeId, VertexId};
pub use stars::Stars;
pub use summary::{TopologySummary, VertexFans};
pub(crate) use summary::{count_components, orientation};
pub(crate) use visits::VisitStamps;
