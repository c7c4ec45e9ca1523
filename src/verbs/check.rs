//! `planish check`: prove a result again, from the files on disk.
//!
//! The maps are read from surface.vtu and proven by [`planish_core::certify::prove`], which knows nothing of how they
//! were made. The only thing taken from the report is a point in each hole, which the proof tests; what the report
//! claims beyond that must agree with what is found. Checksums are a second, separate test: a map that is broken
//! fails the first one even if all checksums were made anew.

use super::{Exit, eprint_line, escape, say};
use crate::formats::layout::Placement;
use crate::formats::vtu::{self, Grid};
use crate::input::read_file;
use crate::outcome::{Reason, Status};
use crate::output::{ledger, listed};
use crate::report::{self, ChartReport, Output, Report, certificate, chart_checksum};
use crate::result_files;
use crate::settings::ExportTarget;
use crate::stages::{self, guard};
use planish_core::certify::{self, PlanarMap, prove};
use planish_core::grid::GridPoint;
use planish_core::measure::distortion::CellFields;
use planish_core::mesh::TriangleShape;
use std::path::{Path, PathBuf};

/// The files that every certified result has.
const REQUIRED: [&str; 4] = [result_files::SURFACE, result_files::PARAM, result_files::SEAMS, result_files::ATLAS_VTM];

/// The files of a hand-off to Gmsh.
const HANDED_OFF: [&str; 2] = [result_files::ATLAS_MSH, result_files::REMESH];

/// Triangles of a chart that are named, at most: they stand in one line.
const NAMED: usize = 16;

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

impl Findings {
    /// Nothing proven, and one thing wrong.
    fn only(finding: Finding) -> Self {
        Self { proven: Vec::new(), wrong: vec![finding] }
    }
}

/// Proves all results again; prints one line per chart.
pub fn check(results: &[PathBuf], quiet: bool) -> Exit {
    let mut exit = Exit::Success;
    for path in results {
        let name = escape(path);
        let found = match folder(path) {
            Some(folder) => check_guarded(folder),
            None => Findings::only(file(&name, "is neither a result folder nor a report.json")),
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

/// As [`check_one`]; a panic, which a forged file may provoke, is a finding.
fn check_guarded(folder: &Path) -> Findings {
    let checked: Result<Findings, Reason> = guard(|| Ok(check_one(folder)));
    checked.unwrap_or_else(|broken| Findings::only(file(result_files::REPORT, broken.message)))
}

/// All that can be found out about a result: where a part is wrong, the others are checked all the same.
fn check_one(folder: &Path) -> Findings {
    let report = match read_report(folder) {
        Ok(report) => report,
        Err(finding) => return Findings::only(finding),
    };
    let mut found = Findings::default();
    if report.settings.boundary.is_none() {
        let older = "an older planish made it, which says nothing of boundaries: run it again";
        return Findings::only(file(result_files::REPORT, older));
    }
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
            let mollified_by = report.repairs.as_ref().map_or(0.0, |r| r.mollified_by);
            found.wrong.extend(check_scales(&grid, &report.charts, mollified_by));
            found.wrong.extend(check_param(folder, &grid, &report.charts).err());
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
    let mut found = Vec::new();
    for name in expected_files(report) {
        if !report.outputs.iter().any(|output| output.file == name) {
            found.push(file(&name, "is not listed in the report's outputs"));
        }
    }
    for output in &report.outputs {
        found.extend(check_output(folder, output).err());
    }
    found
}

/// The files that a result with this report has.
fn expected_files(report: &Report) -> Vec<String> {
    let mut expected: Vec<String> = expected_of_atlas(report).into_iter().map(str::to_owned).collect();
    if let Some(mmg) = &report.mmg {
        expected.extend([result_files::MMG_SURFACE, result_files::MMG_SURFACE_SIZES].map(str::to_owned));
        expected.extend((0..mmg.charts).flat_map(result_files::mmg_chart));
    } else if report.settings.hand_off.has(ExportTarget::Mmg) {
        expected.push(result_files::MMG_SURFACE.to_owned());
    }
    expected
}

/// Those that show the atlas, and the hand-off to Gmsh.
fn expected_of_atlas(report: &Report) -> Vec<&'static str> {
    let mut expected = REQUIRED.to_vec();
    expected.extend(report.settings.also.iter().map(|also| stages::also_file(*also)));
    let is_asked_for = report.settings.hand_off.has(ExportTarget::Gmsh);
    let has_failed = report.hand_off.as_ref().is_some_and(|hand_off| hand_off.failure.is_some());
    if is_asked_for && !has_failed {
        expected.extend(HANDED_OFF);
        if report.hand_off.as_ref().is_some_and(|hand_off| hand_off.enlarged != 1.0) {
            expected.push(result_files::ENLARGED_MSH);
        }
        if report.hand_off.as_ref().is_some_and(|hand_off| hand_off.least_size.is_some()) {
            expected.push(result_files::SIZES);
        }
    }
    expected
}

/// Size and hash of one file.
fn check_output(folder: &Path, output: &Output) -> Result<(), Finding> {
    // Names come from the report: only those of files in the result are opened.
    if listed::place(&output.file).is_none() {
        return Err(file(&output.file, "is no name of a file in the result"));
    }
    match ledger::holds(folder, output) {
        Ok(true) => Ok(()),
        Ok(false) => Err(file(&output.file, "its content is not what was published (size or blake3 differs)")),
        Err(error) => Err(file(&output.file, format!("cannot read the file: {error}"))),
    }
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
    if let Some(cell) = grid.fields.iter().position(|fields| !are_possible(fields)) {
        let (triangle, fields) = (grid.triangle[cell], grid.fields[cell]);
        found.push(wrong(format!("the fields of triangle {triangle} cannot be: {fields:?}")));
    }
    found
}

/// Whether the fields of a cell can be those of any valid map. (A ratio and a distortion are bounded by 1, an area scale is
/// positive; ranges refuse what is not a number, too.)
fn are_possible(fields: &CellFields) -> bool {
    fields.det_min > 0.0
        && fields.det_min <= fields.det_max
        && (f64::MIN_POSITIVE..=1.0).contains(&fields.jacobian_ratio)
        && (1.0..=f64::MAX).contains(&fields.conformal_distortion)
        && (f64::MIN_POSITIVE..=f64::MAX).contains(&fields.area_scale)
        && fields.det_max.is_finite()
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
    if chart.boundary.shape.is_in_chords() && !proof.map().boundary_is_in_chords() {
        return Err(wrong("its boundary does not consist of chords, as natural and freed ones do"));
    }
    if checksum != chart.certificate.checksum {
        return Err(wrong("the map is one-to-one, but not the one that was certified (checksum differs)"));
    }
    if certificate(&proof) != chart.certificate || chart.loops != 1 + chart.certificate.boundary.holes {
        return Err(wrong("the map is one-to-one, but the report's certificate says something else than the proof"));
    }
    let c = proof.certificate();
    Ok(format!(
        "chart c{id} proven one-to-one: {} triangles ({} by bounds, {} exactly), det >= {:.3e}, {} holes, checksum {}",
        cells.len(),
        c.by_bounds,
        c.by_exact,
        c.det_lower_bound,
        c.holes,
        &checksum[..16],
    ))
}

/// The map of the given cells, with its points numbered from the first one on.
fn planar_map(grid: &Grid, cells: &[usize], chart: &ChartReport) -> Result<PlanarMap, String> {
    // planish writes the nodes of one chart after those of the other: what is between the first and the last is its own.
    let nodes = || cells.iter().flat_map(|cell| grid.cells[*cell]);
    let (Some(first), Some(last)) = (nodes().min(), nodes().max()) else {
        return Err("it has no triangles".to_owned());
    };
    let mut nodes = Vec::new();
    for node in first..=last {
        nodes.push(exact(grid.uv[node as usize])?);
    }
    let mut hole_centres = Vec::new();
    for centre in &chart.certificate.hole_centres {
        hole_centres.push(exact(*centre)?);
    }
    let cells = cells.iter().map(|cell| grid.cells[*cell].map(|node| node - first)).collect();
    Ok(PlanarMap { cells, nodes, hole_centres })
}

/// A parameter on the grid, on which the proof is exact: planish writes no others.
fn exact(uv: [f64; 2]) -> Result<GridPoint, String> {
    GridPoint::exact(uv).ok_or_else(|| format!("uv {uv:?} does not lie on the grid of multiples of 2^-53"))
}

/// Names triangles by their number in the input.
fn unproven(grid: &Grid, cells: &[usize], chart: u32, error: certify::Error) -> Finding {
    match error {
        certify::Error::InvalidTriangles { all, .. } => {
            let mut named = Vec::new();
            for face in all.iter().take(NAMED) {
                named.push(grid.triangle[cells[face.index()]].to_string());
            }
            let mut triangles = named.join(", ");
            if all.len() > NAMED {
                triangles += &format!(", ... ({} in all)", all.len());
            }
            Finding::Triangles { chart, triangles }
        }
        other => Finding::Chart { chart, problem: other.to_string() },
    }
}

/// How far the area of a chart in param.vtu may be from that in space: `uv_scale` is the nearest power of two, and areas that
/// are summed in another order differ in their last places.
const OFF_BY: f64 = 2.02;

/// Every `uv_scale` must be the power of two that gives its chart its own size.
fn check_scales(grid: &Grid, charts: &[ChartReport], mollified_by: f64) -> Vec<Finding> {
    // A power of two in which squares of lengths neither vanish nor overflow.
    let largest = grid.points.iter().flatten().fold(f64::MIN_POSITIVE, |most, c| most.max(c.abs()));
    let unit = largest.log2().floor().exp2();
    let mut sizes = vec![Sizes::default(); charts.len()];
    for (cell, chart) in grid.cells.iter().zip(&grid.chart) {
        if let Some(sizes) = usize::try_from(*chart).ok().and_then(|c| sizes.get_mut(c)) {
            sizes.add(cell, grid, unit, mollified_by / unit);
        }
    }
    let mut found = Vec::new();
    for (chart, sizes) in charts.iter().zip(sizes) {
        if !sizes.allow(chart.uv_scale / unit) {
            let scale = chart.uv_scale;
            let problem = format!("uv_scale {scale:e} is not the power of two that gives it the size it has in space");
            found.push(Finding::Chart { chart: chart.id, problem });
        }
    }
    found
}

/// Areas of a chart.
#[derive(Clone, Default)]
struct Sizes {
    in_plane: f64,
    in_space: f64,
    /// By edges that are longer by what was added to all of the surface.
    mollified: f64,
}

impl Sizes {
    fn add(&mut self, cell: &[u32; 6], grid: &Grid, unit: f64, added: f64) {
        let corners = [cell[0], cell[1], cell[2]].map(|n| n as usize);
        let [a, b, c] = corners.map(|n| grid.uv[n]);
        self.in_plane += 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        let shape = TriangleShape::of(corners.map(|n| grid.points[n].map(|x| x / unit)));
        self.in_space += shape.area();
        self.mollified += TriangleShape { lengths: shape.lengths.map(|l| l + added) }.area();
    }

    fn allow(&self, scale: f64) -> bool {
        let area = self.in_plane * scale * scale;
        let is_power_of_two = scale.is_normal() && scale.log2().floor().exp2() == scale;
        is_power_of_two && self.in_space / OFF_BY <= area && area <= self.mollified * OFF_BY
    }
}

/// param.vtu must show the same map: same cells, fields and uv, points at uv plus the shift of their chart.
fn check_param(folder: &Path, surface: &Grid, charts: &[ChartReport]) -> Result<(), Finding> {
    let param = read_grid(folder, result_files::PARAM)?;
    let same = param.cells == surface.cells
        && param.uv == surface.uv
        && (&param.chart, &param.triangle, &param.vertex) == (&surface.chart, &surface.triangle, &surface.vertex)
        && param.fields == surface.fields;
    if !same {
        return Err(file(result_files::PARAM, "its cells, fields or uv differ from those of surface.vtu"));
    }
    for (cell, chart) in param.cells.iter().zip(&param.chart) {
        let Some(chart) = usize::try_from(*chart).ok().and_then(|c| charts.get(c)) else {
            return Err(file(result_files::PARAM, format!("it has a chart {chart}, and the report has none")));
        };
        let place = Placement { scale: chart.uv_scale, shift: chart.shift };
        for node in cell {
            // The same sums as when it was written: exactly the same numbers.
            if param.points[*node as usize] != place.of(param.uv[*node as usize]) {
                return Err(file(result_files::PARAM, format!("point {node} does not lie at its uv")));
            }
        }
    }
    Ok(())
}
