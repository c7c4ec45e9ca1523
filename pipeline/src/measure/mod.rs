//! Measures: how maps distort, and how surfaces bend.

pub mod bends;
pub mod curvature;
pub mod distortion;
pub(crate) mod quantiles;
pub mod scale;
pub mod sizes;
pub mod spikes;
