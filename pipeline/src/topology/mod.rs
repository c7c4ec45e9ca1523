//! Connectivity without positions: which triangles meet where.
//!
//! Nothing in here knows a coordinate, so that every statement holds for flat and curved, good and bad triangulations alike.
//! (The lengths that shortest paths are made of come from whoever walks.) What walks over surfaces need is here once: typed
//! ids; the edges of a triangulation, and the stars of its vertices; compressed rows, disjoint sets and stamps of visits;
//! loops, partitions by labels, and shortest paths; and the numbers that tell what a surface is.

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
pub(crate) use summary::{components, count_components, orientation};
pub(crate) use visits::VisitStamps;
