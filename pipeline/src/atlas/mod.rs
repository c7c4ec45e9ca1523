//! Atlases: the charts of a surface, before they are mapped and after it was proven that their maps are one-to-one.
//!
//! A [`Chart`] is a part of a surface that a disk, perhaps with holes, can carry, and a value of its own: it has its
//! points, its triangles and its lengths, so that it can be mapped where the surface is not. A [`CertifiedChart`] owns a
//! chart, its certified map, how that was found, and how it distorts. A [`CertifiedAtlas`] owns the surface, its certified
//! charts, and the curves between them.

mod certified;
mod chart;

pub use certified::{CertifiedAtlas, CertifiedChart, GatherError, Harmonic, LinearSummary, NARROW, Provenance};
pub use chart::{Atlas, Chart};
