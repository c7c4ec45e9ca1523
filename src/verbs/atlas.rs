//! A result as the verbs find it on disk that go on with its maps.

use super::check::{folder, read_report};
use crate::formats::Label;
use crate::formats::vtu::{self, Grid};
use crate::input::read_file_into;
use crate::outcome::Reason;
use crate::report::{FieldReport, Output, Report};
use crate::result_files;
use crate::system::escape::escape;
use planish_core::lift::ChartedSurface;
use std::path::Path;

/// Why a result cannot be used.
#[derive(Debug, thiserror::Error)]
pub(super) enum Unusable {
    #[error("{0}")]
    Told(String),
    #[error("{0}: its content is not what was published; run planish again, or planish check to see what is wrong")]
    Changed(String),
}

/// A result, read back.
pub(super) struct AtlasOnDisk {
    pub surface: ChartedSurface,
    /// What surface.vtu holds.
    pub grid: Grid,
    /// The parts that have names.
    pub labels: Vec<Label>,
    /// Per chart, the position of its part among these.
    pub part_of_chart: Vec<Option<usize>>,
    /// The fields of the input that it holds.
    pub fields: Vec<FieldReport>,
    /// The bytes of surface.vtu.
    pub bytes: Vec<u8>,
}

impl AtlasOnDisk {
    /// Reads the result in a folder, or beside a report.json. Its surface must be what was published.
    pub fn read(result: &Path) -> Result<Self, Unusable> {
        let told = |problem: String| Unusable::Told(problem);
        let folder = folder(result)
            .ok_or_else(|| told(format!("{} is neither a result folder nor a report.json", escape(result))))?;
        let report = read_report(folder).map_err(|finding| told(finding.to_string()))?;
        let mut bytes = Vec::new();
        published(folder, &report, result_files::SURFACE, &mut bytes)?
            .ok_or_else(|| Unusable::Changed(result_files::SURFACE.to_owned()))?;
        let broken = |problem: String| told(format!("{}: {problem}", result_files::SURFACE));
        let grid = vtu::read(&bytes).map_err(|e| broken(e.to_string()))?;
        let tags = vtu::read_labels(&bytes).map_err(|e| broken(e.to_string()))?;
        let charts: Vec<u32> = grid.chart.iter().map(|chart| u32::try_from(*chart).unwrap_or(u32::MAX)).collect();
        let surface =
            ChartedSurface::new(&grid.points, &grid.uv, &grid.cells, &charts).map_err(|e| broken(e.to_string()))?;
        let labels: Vec<Label> = report.labels.iter().map(|label| label.label.clone()).collect();
        let mut part_of_chart = vec![None; surface.charts()];
        for (chart, tag) in charts.iter().zip(tags.iter().flatten()) {
            part_of_chart[*chart as usize] = labels.iter().position(|label| label.tag == *tag);
        }
        Ok(Self { surface, grid, labels, part_of_chart, fields: report.fields, bytes })
    }
}

/// Reads a file of the result into `bytes`; none where it has no such file.
pub(super) fn published(
    folder: &Path,
    report: &Report,
    name: &str,
    bytes: &mut Vec<u8>,
) -> Result<Option<Output>, Unusable> {
    let Some(listed) = report.outputs.iter().find(|o| o.file == name) else { return Ok(None) };
    let told = |reason: Reason| Unusable::Told(format!("{name}: {}", reason.message));
    read_file_into(&folder.join(name), bytes).map_err(told)?;
    let found = Output::of(name, bytes);
    if found == *listed { Ok(Some(found)) } else { Err(Unusable::Changed(name.to_owned())) }
}
