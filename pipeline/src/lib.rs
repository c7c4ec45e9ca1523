//! The core of planish: from a soup of triangles to quadratic maps that are proven to be one-to-one.
//!
//! A poor surface triangulation (a scan, a segmentation, a terrain, a CAD export) is cut into charts, and each chart is
//! mapped to the plane by quadratic finite elements. What comes out is a [`CertifiedAtlas`]: its maps are
//! one-to-one, proven in exact integer arithmetic on the numbers that it holds.
//!
//! ```
//! use planish_core::monitor::NoMonitor;
//! use planish_core::{Settings, parametrize, shapes};
//!
//! let soup = shapes::ring_torus(24, 12);
//! let atlas = parametrize(&soup, &Settings::default(), &NoMonitor)?;
//! for certified in atlas.charts() {
//!     let proof = certified.map().certificate();
//!     assert_eq!(proof.by_bounds + proof.by_exact, certified.chart().triangles().len());
//!     assert!(proof.det_lower_bound > 0.0 && certified.distortion().area_ratio <= 1e6);
//! }
//! assert!(atlas.seams().curves().len() >= 2, "a torus is no disk: its charts meet along curves");
//! # Ok::<(), planish_core::Error>(())
//! ```
//!
//! # The story
//!
//! [`parametrize()`] goes all the way; each step can be taken on its own.
//!
//! 1. [`repair()`] turns a [`TriangleSoup`](mesh::TriangleSoup) into a [`SurfaceMesh`](mesh::SurfaceMesh): welded, oriented,
//!    with mollified edge lengths; [`Repaired::accepted`](repair::Repaired::accepted) leaves out what no atlas can be made of.
//! 2. [`Plan::new`] cuts the surface into [`Chart`](atlas::Chart)s ([`decompose()`]): parts that a disk, perhaps with holes,
//!    can carry. Each becomes a [`ChartJob`], which needs nothing but itself.
//! 3. [`ChartJob::map`] chooses the boundary in the plane ([natural](map::natural), or the [circle](map::boundary)), and makes
//!    the [`linear`](map::linear) map, which does not fold, and the harmonic [`quadratic`](map::quadratic) map, whose curved
//!    triangles may be invalid. Charts that one map does not suit are split.
//! 4. [`MappedChart::untangle`] makes the triangles valid ([`mod@untangle`]) while keeping the Dirichlet energy as low as it can
//!    be, and proves the result one-to-one ([`certify`]): a [`CertifiedChart`].
//! 5. [`CertifiedAtlas::gather`] puts the charts together, and finds the [curves](seams) between them.
//! 6. [`mod@subdivide`] makes linear triangulations of an atlas, for meshers that know of charts, [`planar`] meshes of their planes
//!    for those that do not, whose work is [lifted](mod@lift) back; [`evaluate`] goes from space to the plane and back;
//!    [`soundness`] tells whether a mesh that was made through them is any good, and [`transfer`] which parts of the surface its
//!    elements stand for.
//!
//! # What is promised
//!
//! * A [`CertifiedMap`](certify::CertifiedMap) is one-to-one: decided exactly, not up to a tolerance. Only
//!   [`certify::prove`] makes one, and nothing else reaches a [`CertifiedChart`].
//! * Whatever survives decomposition gets a map, unless a single triangle needs more than the resolution of doubles; then
//!   the error says so.
//! * Results depend on nothing but the arguments: there is no clock, no thread, no random number and no file in this crate.
//! * What takes longest (cutting, mapping, untangling) asks a [`Monitor`](monitor::Monitor) again and again whether to
//!   continue, and reserves memory from it before it factorises. What was interrupted has no value. A single factorisation
//!   or proof of a chart is one step; repair, gathering and subdividing, which are linear or nearly so, are not asked.
//!
//! # What is not
//!
//! * The map is a local minimiser of the energy, within the maps whose jacobians have positive Bernstein coefficients: a
//!   better one may exist.
//! * Triangles of the input are flat in space, so far. Not every chart has a natural boundary that is one-to-one and even;
//!   the others have one that is freed from the circle, or that, and say why ([`certified::BoundaryFound`]).
//!
//! # Source
//!
//! The method is that of *Surface reparametrization using quadratic finite elements* (Beaufort and co-workers), with an
//! optimiser and a certificate of its own.

pub mod atlas;
pub mod certified;
pub mod certify;
pub mod decompose;
pub mod evaluate;
pub mod fem;
pub mod grid;
pub mod lift;
pub mod map;
pub mod measure;
pub mod mesh;
pub mod monitor;
pub mod parametrize;
pub mod planar;
mod refine;
pub mod repair;
pub mod seams;
mod settings;
pub mod shapes;
pub mod soundness;
pub mod subdivide;
pub mod topology;
pub mod transfer;
pub mod untangle;
pub mod vec3;

pub use certified::{CertifiedAtlas, CertifiedChart};
pub use decompose::decompose;
pub use parametrize::{
    ChartError, ChartJob, Error, MapError, MappedChart, Plan, Refinement, Surveyed, parametrize, parametrize_surface,
    refine,
};
pub use repair::repair;
pub use settings::{BoundaryShape, ChartSettings, Order, OutOfRange, Settings};
pub use subdivide::subdivide;
