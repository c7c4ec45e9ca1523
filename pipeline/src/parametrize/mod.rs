//! The driver: from a soup of triangles to an atlas of charts with maps that are proven to be one-to-one.
//!
//! [`parametrize`] is the whole way. Its pieces are there for those who do them elsewhere, at the same time, or one by one:
//!
//! 1. [`crate::repair()`] makes a surface, and [`Repaired::accepted`](repair::Repaired::accepted) leaves out what is none;
//! 2. [`Plan::new`] cuts it into charts, and makes a [`ChartJob`] of each;
//! 3. [`ChartJob::map`] makes the linear and the harmonic map, and splits charts that one map does not suit;
//! 4. [`MappedChart::untangle`] makes the harmonic map valid, and proves it one-to-one;
//! 5. [`CertifiedAtlas::gather`] puts the charts together, and finds the curves between them.

mod cut;
mod divided;
mod job;
mod join;
mod survey;

use crate::certified::{CertifiedAtlas, GatherError};
use crate::decompose::{self, Illegal, decompose, split_ears};
use crate::mesh::{SurfaceMesh, TriangleSoup};
use crate::monitor::{Interrupted, Monitor};
use crate::repair::{self, Accepted, repair};
use crate::settings::{OutOfRange, Settings};
pub use job::{ChartError, ChartJob, MapError, MappedChart, parametrize_chart};
pub use survey::{Refinement, Surveyed, refine};

/// Repairs a soup, cuts it into charts, and maps these; each map is proven to be one-to-one. Components that cannot be
/// processed are left out, and named ([`CertifiedAtlas::refused`]).
///
/// ```
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{Settings, parametrize, shapes};
///
/// let atlas = parametrize(&shapes::sphere(8), &Settings::default(), &NoMonitor)?;
/// assert!(atlas.charts().len() >= 2, "a closed surface is no disk");
/// # Ok::<(), planish_core::Error>(())
/// ```
///
/// # Errors
/// [`Error`].
pub fn parametrize(soup: &TriangleSoup, settings: &Settings, monitor: &dyn Monitor) -> Result<CertifiedAtlas, Error> {
    settings.check()?;
    let Accepted { mesh, refused } = repair(soup, &settings.repair)?.accepted()?;
    Ok(parametrize_surface(mesh, settings, monitor)?.beside(refused))
}

/// As [`parametrize`], for a surface that is repaired already.
///
/// # Errors
/// As [`parametrize`].
pub fn parametrize_surface(
    mesh: SurfaceMesh,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<CertifiedAtlas, Error> {
    let Plan { mesh, jobs, .. } = Plan::new(mesh, settings, monitor)?;
    let mut surveyed = Vec::with_capacity(jobs.len());
    for job in jobs {
        surveyed.push(job.survey(monitor)?);
    }
    let (mesh, jobs, _) = refine(mesh, surveyed)?;
    let mut certified = Vec::with_capacity(jobs.len());
    for job in jobs {
        certified.extend(job.run(monitor)?);
    }
    Ok(CertifiedAtlas::gather(mesh, certified, settings.size)?)
}

/// Why there is no atlas of a soup.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// A setting is out of its range.
    #[error(transparent)]
    Setting(#[from] OutOfRange),
    /// There is no surface.
    #[error(transparent)]
    Repair(#[from] repair::Error),
    /// It was not cut into charts: a fault of planish.
    #[error(transparent)]
    Illegal(#[from] Illegal),
    /// A chart has no map.
    #[error(transparent)]
    Chart(ChartError),
    /// The charts make no atlas: a fault of planish.
    #[error(transparent)]
    Gather(#[from] GatherError),
    /// The atlas was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl From<decompose::Error> for Error {
    fn from(error: decompose::Error) -> Self {
        match error {
            decompose::Error::Illegal(illegal) => illegal.into(),
            decompose::Error::Interrupted(interrupted) => interrupted.into(),
        }
    }
}

impl From<ChartError> for Error {
    fn from(error: ChartError) -> Self {
        match error {
            ChartError::Interrupted(interrupted) => interrupted.into(),
            ChartError::Setting(setting) => setting.into(),
            error => Self::Chart(error),
        }
    }
}

/// A surface that is cut into charts, and the jobs to map these: they need each other for nothing, and can be done in any
/// order, at the same time, and elsewhere.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The surface, cut open between labels ([`TriangleSoup::with_labels`]). Where ears of charts were split (see
    /// [`split_ears`]), it has more triangles than the one that was given.
    pub mesh: SurfaceMesh,
    /// A job for every chart.
    pub jobs: Vec<ChartJob>,
    /// The feature edges that were found.
    pub feature_edges: usize,
    /// The ears that were split.
    pub ears_split: usize,
}

impl Plan {
    /// Cuts a surface into charts.
    ///
    /// # Errors
    /// [`Error::Setting`], [`Error::Illegal`], [`Error::Interrupted`].
    pub fn new(mesh: SurfaceMesh, settings: &Settings, monitor: &dyn Monitor) -> Result<Self, Error> {
        settings.check()?;
        let mesh = mesh.cut_between_labels();
        let atlas = decompose(&mesh, &settings.decompose, monitor)?;
        let without_ears = split_ears(&mesh, &atlas, settings.decompose.max_triangles)?;
        let (mesh, atlas, ears_split) = match without_ears {
            Some(without) => (without.mesh, without.atlas, without.split),
            None => (mesh, atlas, 0),
        };
        let feature_edges = atlas.feature_edges();
        let settings = settings.of_charts();
        let jobs = atlas.into_charts().into_iter().map(|chart| ChartJob::new(chart, settings)).collect();
        Ok(Self { mesh, jobs, feature_edges, ears_split })
    }
}

#[cfg(test)]
mod tests;
