//! `planish check`: prove a result again, from the files on disk.
//!
//! The maps are read from surface.vtu and proven by [`planish_core::certify::prove`], which knows nothing of how they
//! were made. The only thing taken from the report is a point in each hole, which the proof tests; what the report
//! claims beyond that must agree with what is found. Checksums are a second, separate test: a map that is broken
//! fails the first one even if all checksums were made anew.

use super::{Exit, eprint_line, escape, say};
use crate::formats::vtu::{self, Grid};
use crate::input::read_file;
use crate::outcome::{Reason, Status};
use crate::output::ledger;
use crate::report::{self, ChartReport, Report, certificate, chart_checksum};
use crate::result_files;
use crate::settings::ExportTarget;
use crate::stages::guard;
use planish_core::certify::{self, PlanarMap, prove};
use planish_core::grid::GridPoint;
use std::path::{Path, PathBuf};

/// The files that every certified result has.
const REQUIRED: [&str; 4] = [result_files::SURFACE, result_files::PARAM, result_files::SEAMS, result_files::ATLAS_VTM];

/// The files of a hand-off to Gmsh.
const HANDED_OFF: [&str; 2] = [result_files::ATLAS_MSH, result_files::REMESH];

/// What can be wrong with a result.
#[derive(Debug, thiserror::Error)]
pub(super) enum Finding {
    #[error("{file}: {problem}")]
    File { file: String, problem: String },
    #[error("the input was not certified ({0}): there is nothing to prove")]
    NotCertified(Status),
    #[error("chart c{chart}: triangles {triangles} are invalid: their jacobian is not positive everywhere")]
    Triangles { chart: u32, triangles: String },
    #[error("chart c{chart}: {problem}")]
    Chart { chart: u32, problem: String },
}

fn file(file: &str, problem: impl ToString) -> Finding {
    Finding::File { file: file.to_owned(), problem: problem.to_string() }
}

/// What a check found: a line for each proven chart, and everything that is wrong.
#[derive(Default)]
struct Findings {
    proven: Vec<String>,
    wrong: Vec<Finding>,
}

/// Proves all results again; prints one line per chart.
pub fn check(results: &[PathBuf], quiet: bool) -> Exit {
    let mut exit = Exit::Success;
    for path in results {
        let name = escape(path);
        let found = match folder(path) {
            Some(folder) => guard(|| Ok(check_one(folder))).unwrap_or_else(|broken: Reason| Findings {
                wrong: vec![file(result_files::REPORT, broken.message)],
                ..Findings::default()
            }),
            None => Findings {
                wrong: vec![file(&name, "is neither a result folder nor a report.json")],
                ..Findings::default()
            },
        };
        if !quiet {
            found.proven.iter().for_each(|line| say(&format!("{name}: {line}")));
        }
        for finding in &found.wrong {
            eprint_line(&format!("{name}: not proven: {finding}"));
            exit = Exit::Refused;
        }
    }
    exit
}

/// The result folder that a path names.
pub(super) fn folder(path: &Path) -> Option<&Path> {
    if path.is_dir() {
        return Some(path);
    }
    let named = path.is_file() && path.file_name() == Some(result_files::REPORT.as_ref());
    let parent = path.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p });
    parent.filter(|_| named)
}

fn check_one(folder: &Path) -> Findings {
    let mut found = Findings::default();
    let report = match read_report(folder) {
        Ok(report) => report,
        Err(finding) => {
            found.wrong.push(finding);
            return found;
        }
    };
    found.wrong.extend(check_outputs(folder, &report));
    match read_grid(folder, result_files::SURFACE) {
        Ok(grid) => {
            found.wrong.extend(check_surface(&grid, &report));
            for (index, chart) in report.charts.iter().enumerate() {
                match check_chart(&grid, index, chart) {
                    Ok(line) => found.proven.push(line),
                    Err(finding) => found.wrong.push(finding),
                }
            }
            found.wrong.extend(check_param(folder, &grid, report.charts.len()).err());
        }
        Err(finding) => found.wrong.push(finding),
    }
    found
}

pub(super) fn read(folder: &Path, name: &str) -> Result<Vec<u8>, Finding> {
    read_file(&folder.join(name)).map_err(|reason| file(name, reason.message))
}

pub(super) fn read_report(folder: &Path) -> Result<Report, Finding> {
    let bytes = read(folder, result_files::REPORT)?;
    let report: Report = serde_json::from_slice(&bytes).map_err(|e| file(result_files::REPORT, e))?;
    if report.schema != report::SCHEMA {
        let problem = format!("schema {} is not {}, which this version checks", report.schema, report::SCHEMA);
        return Err(file(result_files::REPORT, problem));
    }
    match (report.status, &report.reason) {
        (Status::Certified, None) => Ok(report),
        (Status::Certified, Some(_)) => Err(file(result_files::REPORT, "it is certified and has a reason against it")),
        (status, _) => Err(Finding::NotCertified(status)),
    }
}

/// Sizes and hashes of all files.
fn check_outputs(folder: &Path, report: &Report) -> Vec<Finding> {
    let unlisted = |name: &&&str| !report.outputs.iter().any(|o| o.file == **name);
    let asked_for = report.settings.hand_off == ExportTarget::Gmsh;
    let failed = report.hand_off.as_ref().is_some_and(|h| h.failure.is_some());
    let handed_off = HANDED_OFF.iter().filter(|_| asked_for && !failed);
    let is_enlarged = report.hand_off.as_ref().is_some_and(|h| h.enlarged != 1.0);
    let enlarged = [result_files::ENLARGED_MSH];
    let missing = REQUIRED
        .iter()
        .chain(handed_off)
        .chain(enlarged.iter().filter(|_| is_enlarged))
        .filter(unlisted)
        .map(|name| file(name, "is not listed in the report's outputs"));
    let damaged = report.outputs.iter().filter_map(|output| {
        // Names come from the report: only plain ones are opened.
        if Path::new(&output.file).file_name() != Some(output.file.as_ref()) {
            return Some(file(&output.file, "is no plain file name"));
        }
        match ledger::holds(folder, output) {
            Ok(true) => None,
            Ok(false) => Some(file(&output.file, "its content is not what was published (size or blake3 differs)")),
            Err(error) => Some(file(&output.file, format!("cannot read the file: {error}"))),
        }
    });
    missing.chain(damaged).collect()
}

fn read_grid(folder: &Path, name: &str) -> Result<Grid, Finding> {
    vtu::read(&read(folder, name)?).map_err(|e| file(name, e))
}

/// Every triangle of the surface must be in a chart, positions and fields must be numbers that can be.
fn check_surface(grid: &Grid, report: &Report) -> Vec<Finding> {
    let wrong = |problem: String| file(result_files::SURFACE, problem);
    let mut found = Vec::new();
    let accounted = report.charts.iter().map(|c| c.triangles).try_fold(0_usize, usize::checked_add);
    if accounted != Some(grid.cells.len()) || report.charts.is_empty() {
        found.push(wrong(format!("{} triangles are not what the report's charts add up to", grid.cells.len())));
    }
    let mut ids = grid.triangle.clone();
    ids.sort_unstable();
    ids.dedup();
    // Those that were cut at T-junctions are there several times.
    let added = report.repairs.as_ref().map_or(0, |r| r.triangles_added);
    let refused: usize = report.refused_components.iter().map(|c| c.triangles).sum();
    let of_surface = report.surface.as_ref().map(|s| s.repaired.counts.triangles);
    let expected = of_surface.and_then(|all| all.checked_sub(refused));
    // Where components were refused it is not known which of them were cut.
    let is_right = |all: usize| {
        if refused == 0 { ids.len() + added == all } else { (ids.len()..=ids.len() + added).contains(&all) }
    };
    if !expected.is_some_and(is_right) {
        found.push(wrong(format!("{} triangles of the surface are there, the report has {expected:?}", ids.len())));
    }
    if let Some(point) = grid.points.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
        found.push(wrong(format!("point {point} is not finite")));
    }
    let possible = |f: &planish_core::measure::distortion::CellFields| {
        f.det_min > 0.0
            && f.det_min <= f.det_max
            && (f64::MIN_POSITIVE..=1.0).contains(&f.jacobian_ratio)
            && (1.0..=f64::MAX).contains(&f.conformal_distortion)
            && (f64::MIN_POSITIVE..=f64::MAX).contains(&f.area_scale)
            && f.det_max.is_finite()
    };
    if let Some(cell) = grid.fields.iter().position(|f| !possible(f)) {
        found.push(wrong(format!("the fields of triangle {} cannot be: {:?}", grid.triangle[cell], grid.fields[cell])));
    }
    found
}

/// Proves one chart; the line that says so.
fn check_chart(grid: &Grid, index: usize, chart: &ChartReport) -> Result<String, Finding> {
    let id = chart.id;
    let wrong = |problem: &str| Finding::Chart { chart: id, problem: problem.to_owned() };
    let cells: Vec<usize> = (0..grid.cells.len()).filter(|c| grid.chart[*c] == index as i32).collect();
    if cells.len() != chart.triangles || id as usize != index {
        return Err(wrong("its number, or that of its triangles, is not that of the report"));
    }
    let map = planar_map(grid, &cells, chart).map_err(|problem| wrong(&problem))?;
    let checksum = chart_checksum(&map);
    let proof = prove(map).map_err(|e| unproven(grid, &cells, id, e))?;
    if checksum != chart.certificate.checksum {
        return Err(wrong("the map is one-to-one, but not the one that was certified (checksum differs)"));
    }
    if certificate(&proof) != chart.certificate || chart.loops != 1 + chart.certificate.hole_centres.len() {
        return Err(wrong("the map is one-to-one, but the report's certificate says something else than the proof"));
    }
    let c = proof.certificate();
    Ok(format!(
        "chart c{id} proven one-to-one: {} triangles ({} by bounds, {} exactly), det >= {:.3e}, {} holes, checksum {}",
        cells.len(),
        c.by_bounds,
        c.by_exact,
        c.det_lower_bound,
        c.hole_centres.len(),
        &checksum[..16],
    ))
}

/// The map of the given cells, with its points numbered from the first one on.
fn planar_map(grid: &Grid, cells: &[usize], chart: &ChartReport) -> Result<PlanarMap, String> {
    let nodes = || cells.iter().flat_map(|c| grid.cells[*c]);
    let (Some(first), Some(last)) = (nodes().min(), nodes().max()) else {
        return Err("it has no triangles".to_owned());
    };
    let exact =
        |uv: [f64; 2]| GridPoint::exact(uv).ok_or(format!("uv {uv:?} does not lie on the grid of multiples of 2^-53"));
    let places: Result<Vec<_>, _> = (first..=last).map(|n| exact(grid.uv[n as usize])).collect();
    let centres: Result<Vec<_>, _> = chart.certificate.hole_centres.iter().map(|c| exact(*c)).collect();
    let local = |c: &usize| grid.cells[*c].map(|n| n - first);
    Ok(PlanarMap { cells: cells.iter().map(local).collect(), nodes: places?, hole_centres: centres? })
}

/// Names triangles by their number in the input.
fn unproven(grid: &Grid, cells: &[usize], chart: u32, error: certify::Error) -> Finding {
    match error {
        certify::Error::InvalidTriangles { all, .. } => {
            let id = |f: &planish_core::topology::FaceId| grid.triangle[cells[f.index()]].to_string();
            let mut triangles = all.iter().take(16).map(id).collect::<Vec<_>>().join(", ");
            if all.len() > 16 {
                triangles += &format!(", ... ({} in all)", all.len());
            }
            Finding::Triangles { chart, triangles }
        }
        other => Finding::Chart { chart, problem: other.to_string() },
    }
}

/// param.vtu must show the same map: same cells, fields and uv, points at uv plus the shift of their chart.
fn check_param(folder: &Path, surface: &Grid, charts: usize) -> Result<(), Finding> {
    let param = read_grid(folder, result_files::PARAM)?;
    let same = param.cells == surface.cells
        && param.uv == surface.uv
        && (&param.chart, &param.triangle, &param.vertex) == (&surface.chart, &surface.triangle, &surface.vertex)
        && param.fields == surface.fields;
    if !same {
        return Err(file(result_files::PARAM, "its cells, fields or uv differ from those of surface.vtu"));
    }
    for (cell, chart) in param.cells.iter().zip(&param.chart) {
        let [x, y] = vtu::shift(usize::try_from(*chart).unwrap_or(0), charts);
        let off = |n: &&u32| {
            let (p, uv) = (param.points[**n as usize], param.uv[**n as usize]);
            p != [uv[0] + x, uv[1] + y, 0.0]
        };
        if let Some(node) = cell.iter().find(off) {
            return Err(file(result_files::PARAM, format!("point {node} does not lie at its uv")));
        }
    }
    Ok(())
}
