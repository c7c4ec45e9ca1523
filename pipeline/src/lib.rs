//! The core of planish: from a soup of triangles to quadratic maps that are proven to be one-to-one.
//!
//! The story, in stage order:
//!
//! 1. [`repair()`] turns a soup into a [`mesh::SurfaceMesh`]: welded, oriented, with mollified edge lengths.
//! 2. [`decompose()`] cuts the surface into [`atlas::Chart`]s: parts that a disk, perhaps with holes, can carry.
//! 3. [`map_chart`] makes the [`linear`](map::linear) map, which does not fold, and the harmonic [`quadratic`](map::quadratic) map, whose curved
//!    triangles may be invalid.
//! 4. [`finish_chart`] makes them valid ([`mod@untangle`]) while keeping the Dirichlet energy as low as it can be, and
//!    proves the result one-to-one ([`certify`]). Charts whose maps stretch too much are split, before it
//!    ([`map_or_split`]; there charts that no mesher could follow are cut, too) or, where only the result shows it, after
//!    it ([`finish_or_split`]).
//! 5. [`measure`] tells what came out; [`seams`] finds the curves between charts.
//! 6. [`mod@subdivide`] makes linear triangulations of certified maps, for meshers.
//!
//! # What is promised
//!
//! A [`certify::CertifiedMap`] is one-to-one: decided in exact integer arithmetic on the numbers that it holds,
//! not up to a tolerance. Whatever survives decomposition gets one, unless its map needs triangles below the
//! resolution of doubles; then the error says so. Results depend on nothing but the arguments: there is no clock,
//! no thread, no random number and no file in this crate.
//!
//! # Cancelling, taking turns, and memory
//!
//! Whatever can take long asks a [`monitor::Monitor`] many times a second whether to go on, and reserves memory from it before
//! it factorises. [`monitor::NoMonitor`] always goes on.
//!
//! # What is not
//!
//! The map is a local minimiser of the energy, within the maps whose jacobians have positive Bernstein coefficients.
//!
//! The method is that of *Surface reparametrization using quadratic finite elements* (Beaufort and co-workers),
//! with an optimiser and a certificate of its own.
//!
//! # Example
//!
//! ```
//! use planish_core::monitor::NoMonitor;
//! use planish_core::{Order, decompose, finish_chart, map_chart, repair, shapes};
//!
//! let soup = shapes::disk(8);
//! let surface = repair(&soup, &Default::default())?.mesh;
//! let atlas = decompose(&surface, &Default::default(), &NoMonitor)?;
//! for chart in atlas.charts() {
//!     let done = finish_chart(map_chart(chart, Order::Quadratic)?);
//!     let certificate = done.certified.certificate();
//!     assert_eq!(certificate.by_bounds + certificate.by_exact, chart.triangles().len());
//!     assert!(certificate.det_lower_bound > 0.0);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod atlas;
pub mod certify;
mod chart_map;
pub mod decompose;
pub mod evaluate;
pub mod fem;
pub mod grid;
pub mod map;
pub mod measure;
pub mod mesh;
pub mod monitor;
pub mod repair;
pub mod seams;
pub mod shapes;
pub mod soundness;
pub mod subdivide;
pub mod topology;
pub mod untangle;
pub mod vec3;

pub use chart_map::{
    CertifiedChart, Harmonic, MapError, MappedChart, Order, SplitError, finish_chart, finish_or_split, map_chart,
    map_or_split, map_within,
};
pub use decompose::decompose;
pub use repair::repair;
pub use subdivide::subdivide;
