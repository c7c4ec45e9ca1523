//! `planish check`: prove a result again, from the files on disk.
//!
//! The maps are read from surface.vtu and proven by [`pipeline::certify::prove`], which knows nothing of how they
//! were made. The only thing taken from the report is a point in each hole, which the proof tests. Checksums are a
//! second, separate test: a map that is broken fails the first one even if all checksums were made anew.

use super::Exit;
use crate::formats::vtu::{self, Grid};
use crate::outcome::Status;
use crate::report::{self, ChartReport, Report, chart_checksum};
use pipeline::certify::{self, PlanarMap, prove};
use pipeline::grid::GridPoint;
use std::path::{Path, PathBuf};

/// The files that every certified result has.
const REQUIRED: [&str; 2] = ["surface.vtu", "param.vtu"];

/// What can be wrong with a result.
#[derive(Debug, thiserror::Error)]
enum Finding {
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

/// Proves all results again; prints one line per chart.
pub fn check(results: &[PathBuf], quiet: bool) -> Exit {
    let mut exit = Exit::Success;
    for path in results {
        let folder = if path.is_dir() { path.as_path() } else { path.parent().unwrap_or(Path::new(".")) };
        let (proven, findings) = check_one(folder);
        let name = folder.display();
        if !quiet {
            proven.iter().for_each(|line| println!("{name}: {line}"));
        }
        for finding in &findings {
            eprintln!("planish: {name}: not proven: {finding}");
            exit = Exit::Refused;
        }
    }
    exit
}

/// A line for each proven chart, and everything that is wrong.
fn check_one(folder: &Path) -> (Vec<String>, Vec<Finding>) {
    let report = match read_report(folder) {
        Ok(report) => report,
        Err(finding) => return (vec![], vec![finding]),
    };
    let mut findings = check_outputs(folder, &report);
    let grid = match read_grid(folder, "surface.vtu") {
        Ok(grid) => grid,
        Err(finding) => {
            findings.push(finding);
            return (vec![], findings);
        }
    };
    let mut proven = Vec::new();
    let accounted: usize = report.charts.iter().map(|c| c.triangles).sum();
    if accounted != grid.cells.len() || report.charts.is_empty() {
        let problem = format!("{} triangles, but the report's charts have {accounted}", grid.cells.len());
        findings.push(file("surface.vtu", problem));
    }
    for (index, chart) in report.charts.iter().enumerate() {
        match check_chart(&grid, index, chart) {
            Ok(line) => proven.push(line),
            Err(finding) => findings.push(finding),
        }
    }
    findings.extend(check_param(folder, &grid, report.charts.len()).err());
    (proven, findings)
}

fn read_report(folder: &Path) -> Result<Report, Finding> {
    let bytes = std::fs::read(folder.join(report::FILE)).map_err(|e| file(report::FILE, e))?;
    let report: Report = serde_json::from_slice(&bytes).map_err(|e| file(report::FILE, e))?;
    if report.schema != report::SCHEMA {
        return Err(file(
            report::FILE,
            format!("schema {} is not {}, which this version checks", report.schema, report::SCHEMA),
        ));
    }
    if report.status == Status::Certified { Ok(report) } else { Err(Finding::NotCertified(report.status)) }
}

/// Sizes and hashes of all files.
fn check_outputs(folder: &Path, report: &Report) -> Vec<Finding> {
    let unlisted = |name: &&&str| !report.outputs.iter().any(|o| o.file == **name);
    let missing = REQUIRED.iter().filter(unlisted).map(|name| file(name, "is not listed in the report's outputs"));
    let damaged = report.outputs.iter().filter_map(|output| {
        // Names come from the report: only plain ones are opened.
        if Path::new(&output.file).file_name() != Some(output.file.as_ref()) {
            return Some(file(&output.file, "is no plain file name"));
        }
        let bytes = match std::fs::read(folder.join(&output.file)) {
            Ok(bytes) => bytes,
            Err(e) => return Some(file(&output.file, e)),
        };
        let same = blake3::hash(&bytes).to_hex().as_str() == output.blake3 && bytes.len() as u64 == output.bytes;
        (!same).then(|| file(&output.file, "its content is not what was published (size or blake3 differs)"))
    });
    missing.chain(damaged).collect()
}

fn read_grid(folder: &Path, name: &str) -> Result<Grid, Finding> {
    let bytes = std::fs::read(folder.join(name)).map_err(|e| file(name, e))?;
    vtu::read(&bytes).map_err(|e| file(name, e))
}

/// Proves one chart; the line that says so.
fn check_chart(grid: &Grid, index: usize, chart: &ChartReport) -> Result<String, Finding> {
    let id = chart.id;
    let wrong = |problem: String| Finding::Chart { chart: id, problem };
    let cells: Vec<usize> = (0..grid.cells.len()).filter(|c| grid.chart[*c] == index as i32).collect();
    if cells.len() != chart.triangles {
        return Err(wrong(format!("the file has {} triangles, the report {}", cells.len(), chart.triangles)));
    }
    let map = planar_map(grid, &cells, chart).map_err(wrong)?;
    let checksum = chart_checksum(&map);
    let proof = prove(map).map_err(|e| unproven(grid, &cells, id, e))?;
    if checksum != chart.certificate.checksum {
        return Err(wrong("the map is one-to-one, but not the one that was certified (checksum differs)".to_owned()));
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
            let id = |f: &pipeline::id::FaceId| grid.triangle[cells[f.index()]].to_string();
            let mut triangles = all.iter().take(16).map(id).collect::<Vec<_>>().join(", ");
            if all.len() > 16 {
                triangles += &format!(", ... ({} in all)", all.len());
            }
            Finding::Triangles { chart, triangles }
        }
        other => Finding::Chart { chart, problem: other.to_string() },
    }
}

/// param.vtu must show the same map: same cells, same uv, points at uv plus the shift of their chart.
fn check_param(folder: &Path, surface: &Grid, charts: usize) -> Result<(), Finding> {
    let param = read_grid(folder, "param.vtu")?;
    if param.cells != surface.cells || param.uv != surface.uv || param.chart != surface.chart {
        return Err(file("param.vtu", "its cells, charts or uv differ from those of surface.vtu"));
    }
    for (cell, chart) in param.cells.iter().zip(&param.chart) {
        let [x, y] = vtu::shift(usize::try_from(*chart).unwrap_or(0), charts);
        let off = |n: &&u32| {
            let (p, uv) = (param.points[**n as usize], param.uv[**n as usize]);
            p != [uv[0] + x, uv[1] + y, 0.0]
        };
        if let Some(node) = cell.iter().find(off) {
            return Err(file("param.vtu", format!("point {node} does not lie at its uv")));
        }
    }
    Ok(())
}
