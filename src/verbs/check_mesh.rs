//! `planish check DIR --mesh FILE`: does a mesh represent the surface of a result, and are its elements good?
//!
//! The surface is read from surface.vtu, the maps that the mesher used from atlas.msh: both must be what was published.
//! What is found is told, and kept as mesh.json beside the report.

use super::check::{folder, read_report};
use super::finer;
use super::{Exit, eprint_line, escape, say, say_json};
use crate::cli;
use crate::formats::gmsh;
use crate::formats::vtu::{self, Shape};
use crate::formats::{self, Kind, Patches, READ, Source};
use crate::input::read_file_into;
use crate::outcome::Reason;
use crate::report::mesh::DeviationReport;
use crate::report::mesh::{MeshReport, PLACES};
use crate::report::{Output, Report};
use crate::result_files;
use crate::settings::Settings;
use crate::stages::guard;
use crate::system::disk::{self, Disk, System};
use planish_core::soundness::{self, HandedOverAtlas, Mesh, Triangulation};
use std::path::{Path, PathBuf};

/// What is asked of a mesh.
#[derive(Clone, Debug)]
pub struct Question {
    /// The mesh.
    pub mesh: PathBuf,
    /// The edge length that was asked for; that of the hand-off where none is given.
    pub size: Option<f64>,
    /// How far nodes may be off the surface, relative to its diagonal: single precision rounds by a tenth of 1e-6.
    pub off_surface: f64,
    /// The least gamma of a fine element.
    pub min_gamma: f64,
    /// How far mesh and surface may be from each other, where that is asked.
    pub deviation: Option<f64>,
    /// Whether to ask for shorter edges where it is more.
    pub finer: bool,
    /// Whether to print JSON.
    pub json: bool,
}

impl Question {
    /// What is asked of a mesh, if one is given.
    pub fn of(asked: &cli::Check) -> Option<Self> {
        let cli::Check { size, off, min_gamma, deviation, finer, json, .. } = *asked;
        Some(Self { mesh: asked.mesh.clone()?, size, off_surface: off, min_gamma, deviation, finer, json })
    }
}

/// Why a mesh cannot be judged.
#[derive(Debug, thiserror::Error)]
enum Unjudged {
    #[error("{0}")]
    Told(String),
    #[error("{0}: its content is not what was published; run planish again, or planish check to see what is wrong")]
    Changed(&'static str),
    #[error("the result has no hand-off to tell the edge length: give --size H, in the unit of the input")]
    NoSize,
}

/// Judges one mesh against one result.
///
/// # Errors
/// Wrong usage.
pub fn check_mesh(
    results: &[PathBuf],
    question: &Question,
    settings: &Settings,
) -> Result<Exit, Box<dyn std::error::Error>> {
    let [result] = results else {
        return Err("--mesh judges one mesh: name the one result that it was made from".into());
    };
    if question.size.is_some_and(|s| !(s.is_finite() && s > 0.0)) {
        return Err("--size must be a positive number: the edge length that the mesher was asked for".into());
    }
    if !(question.off_surface.is_finite() && question.off_surface >= 0.0) {
        return Err("--off must be a number from 0 on: a share of the diagonal of the surface".into());
    }
    if !(0.0..=1.0).contains(&question.min_gamma) {
        return Err("--min-gamma must lie between 0 and 1".into());
    }
    if question.deviation.is_some_and(|d| !(d.is_finite() && d > 0.0)) {
        return Err("--deviation must be a positive number: a distance in the unit of the input".into());
    }
    let name = escape(&question.mesh);
    let (folder, report) = match judge_guarded(result, question, settings) {
        Ok(judged) => judged,
        Err(unjudged) => {
            eprint_line(&format!("{name}: not judged: {unjudged}"));
            return Ok(Exit::Refused);
        }
    };
    if question.json {
        say_json(&report)?;
    } else if !settings.quiet {
        say(&text(&name, &report));
    }
    if let Err(error) = keep(folder, &report) {
        eprint_line(&format!("{}: cannot be written: {error}", escape(&folder.join(result_files::MESH))));
        return Ok(Exit::Refused);
    }
    if !report.faithful {
        eprint_line(&format!("{name}: not faithful: {}", report.defects[0].message));
    }
    Ok(if report.faithful && report.fine { Exit::Success } else { Exit::Refused })
}

/// The folder of a result, and what is found; a panic is a reason not to judge.
fn judge_guarded<'r>(
    result: &'r Path,
    question: &Question,
    settings: &Settings,
) -> Result<(&'r Path, MeshReport), Unjudged> {
    let Some(folder) = folder(result) else {
        return Err(Unjudged::Told(format!("{} is neither a result folder nor a report.json", escape(result))));
    };
    let judged: Result<_, Reason> = guard(|| Ok(judge(folder, question, settings)));
    let report = judged.map_err(|broken| Unjudged::Told(broken.message))??;
    Ok((folder, report))
}

/// What is found about a mesh, against the result in `folder`.
fn judge(folder: &Path, question: &Question, settings: &Settings) -> Result<MeshReport, Unjudged> {
    let report = read_report(folder).map_err(|finding| Unjudged::Told(finding.to_string()))?;
    // Files are large, and one is done with before the next: they share their memory.
    let mut bytes = Vec::new();
    let (surface_file, surface, charts) = surface(folder, &report, &mut bytes)?;
    let size = question.size.or(size_asked_for(&report)).ok_or(Unjudged::NoSize)?;
    read_file_into(&question.mesh, &mut bytes).map_err(|reason| Unjudged::Told(reason.message))?;
    let patches = decode(&question.mesh, &bytes, settings).map_err(|reason| Unjudged::Told(reason.message))?;
    let name = question.mesh.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mesh_file = Output::of(&name, &bytes);
    let atlas = if patches.surfaces().is_some() { atlas(folder, &report, &mut bytes)? } else { None };
    drop(bytes);
    let &Question { off_surface, min_gamma, deviation, .. } = question;
    let asked = soundness::Settings { size, min_gamma, off_surface, deviation };
    let found = soundness::examine(&mesh(&patches), &surface, &charts, atlas.as_ref(), &asked);
    let mut judged = MeshReport::new(mesh_file, surface_file, size, min_gamma, &found);
    if let (true, Some(deviation), Some(told)) = (question.finer, &found.deviation, &mut judged.deviation) {
        told.held = finer::ask(folder, &report, &surface, deviation).map_err(Unjudged::Told)?;
    }
    Ok(judged)
}

/// The edge length that meshers are asked for.
fn size_asked_for(report: &Report) -> Option<f64> {
    report.hand_off.as_ref().map(|gmsh| gmsh.size).or(report.mmg.as_ref().map(|mmg| mmg.size))
}

/// The surface of a result, as it was published, and the chart of each triangle.
fn surface(folder: &Path, report: &Report, bytes: &mut Vec<u8>) -> Result<(Output, Triangulation, Vec<u32>), Unjudged> {
    let file =
        published(folder, report, result_files::SURFACE, bytes)?.ok_or(Unjudged::Changed(result_files::SURFACE))?;
    let shape = vtu::read_shape(bytes).map_err(|e| Unjudged::Told(format!("surface.vtu: {e}")))?;
    let charts = shape.chart.iter().map(|c| u32::try_from(*c).unwrap_or(u32::MAX)).collect();
    Ok((file, corners_of(&shape), charts))
}

/// The triangles of a surface by their corners, without the nodes in the middle of sides.
fn corners_of(shape: &Shape) -> Triangulation {
    let corners = || shape.cells.iter().map(|[a, b, c, ..]| [*a, *b, *c]);
    let mut is_corner = vec![false; shape.points.len()];
    for node in corners().flatten() {
        is_corner[node as usize] = true;
    }
    // The corners alone, numbered anew in the same order.
    let mut points = Vec::new();
    let mut number = vec![u32::MAX; shape.points.len()];
    for (node, point) in shape.points.iter().enumerate() {
        if is_corner[node] {
            number[node] = points.len() as u32;
            points.push(*point);
        }
    }
    Triangulation::welded(&points, corners().map(|corners| corners.map(|node| number[node as usize])))
}

/// The maps that the mesher used, if the result has any.
fn atlas(folder: &Path, report: &Report, bytes: &mut Vec<u8>) -> Result<Option<HandedOverAtlas>, Unjudged> {
    let Some(_) = published(folder, report, result_files::ATLAS_MSH, bytes)? else { return Ok(None) };
    let atlas = gmsh::read_atlas(bytes).map_err(|e| Unjudged::Told(format!("{}: {e}", result_files::ATLAS_MSH)))?;
    Ok(Some(atlas))
}

/// Reads a file of the result into `bytes`; none where it has no such file.
fn published(
    folder: &Path,
    report: &Report,
    name: &'static str,
    bytes: &mut Vec<u8>,
) -> Result<Option<Output>, Unjudged> {
    let Some(listed) = report.outputs.iter().find(|o| o.file == name) else { return Ok(None) };
    let told = |reason: Reason| Unjudged::Told(format!("{name}: {}", reason.message));
    read_file_into(&folder.join(name), bytes).map_err(told)?;
    let found = Output::of(name, bytes);
    if found == *listed { Ok(Some(found)) } else { Err(Unjudged::Changed(name)) }
}

fn decode(path: &Path, bytes: &[u8], settings: &Settings) -> Result<Patches, Reason> {
    let Kind::Mesh(format) = formats::kind(path) else {
        let message = format!("the file name tells no mesh; name one of {READ}");
        return Err(Reason::new(crate::outcome::Code::UnknownExtension, message));
    };
    let source = Source::alone(bytes, &settings.limits);
    formats::read_patches(format, &source).map_err(|e| e.reason())
}

/// The mesh in the terms of the core. Nodes of MSH files that lie on each other are made one, as in other formats.
fn mesh(patches: &Patches) -> Mesh {
    let corners = patches.triangles().iter().copied();
    // Where an element has no nodes in the middle, three zeros hold its place.
    let flat = patches.mids().iter().map(|mids| mids.unwrap_or_default());
    // Corners and nodes in the middle are welded alike: as triangles of one list, and taken apart again.
    let welded = Triangulation::welded(patches.points(), corners.chain(flat));
    let (triangles, welded_mids) = welded.triangles.split_at(patches.triangles().len());
    let mids = patches.mids().iter().zip(welded_mids).map(|(mids, welded)| mids.map(|_| *welded)).collect();
    Mesh {
        triangulation: Triangulation { triangles: triangles.to_vec(), points: welded.points },
        mids,
        charts: patches.surfaces().map(|tags| tags.iter().map(chart_of_tag).collect()),
    }
}

/// The chart of an entity: tags begin with 1. What can be no chart becomes a number that none has.
fn chart_of_tag(tag: &i64) -> u32 {
    tag.checked_sub(1).and_then(|chart| u32::try_from(chart).ok()).unwrap_or(u32::MAX)
}

/// Puts the report beside that of the result, whole or not at all.
fn keep(folder: &Path, report: &MeshReport) -> std::io::Result<()> {
    let mut text = serde_json::to_string_pretty(report)?;
    text.push('\n');
    let folder = System.open(folder)?;
    disk::replace_file(&folder, &folder, result_files::MESH, text.as_bytes())
}

/// What was found, for people.
fn text(name: &str, report: &MeshReport) -> String {
    let verdict = match (report.faithful, report.fine) {
        (true, true) => "faithful and fine",
        (true, false) => "faithful, not fine",
        (false, true) => "NOT FAITHFUL (its elements are fine)",
        (false, false) => "NOT FAITHFUL, and not fine",
    };
    let by = if report.by_charts {
        "chart by chart, through its maps"
    } else {
        "by the surface alone: the file tells no charts"
    };
    let mut lines = vec![format!("{name}: {verdict}; judged {by}")];
    lines.extend(report.defects.iter().map(|d| format!("  {}{}", d.message, located(d.at))));
    let (gamma, edges) = (report.gamma, report.edges);
    let curved = match report.curved_elements {
        0 => String::new(),
        count => format!(", {count} of six nodes"),
    };
    lines.push(format!("  elements  {}{curved}; area {:.4} of the surface's", report.elements, report.area_ratio));
    lines.push(format!(
        "  distance  nodes off the surface by {:.2e} at most; surface off the mesh by {:.3} edge lengths at most",
        report.mesh_to_surface.distance,
        report.surface_to_mesh.distance / report.size
    ));
    lines.extend(report.deviation.iter().flat_map(deviation));
    let tips = match gamma.below_at_tips {
        0 => String::new(),
        n => format!(", and {n} in tips of the surface, which do not count"),
    };
    lines.push(format!(
        "  gamma     {:.4} at least, {:.3} on average; {} below {}{tips}",
        gamma.min, gamma.mean, gamma.below, report.min_gamma
    ));
    lines.push(format!(
        "  edges     {:.3} to {:.3} of the size {:.4e}, median {:.3}; {:.1} % within half and twice",
        edges.min,
        edges.max,
        report.size,
        edges.median,
        100.0 * edges.near_size
    ));
    if report.crossings_of_surface > 0 {
        lines.push(format!("  {} pairs of elements cross as those of the surface do", report.crossings_of_surface));
    }
    if !report.places.is_empty() {
        lines.push(format!("  worst places (at most {PLACES}):"));
        lines.extend(report.places.iter().map(|p| format!("   {} {}", located(Some(p.at)), p.what)));
    }
    lines.join("\n")
}

/// How far mesh and surface are from each other.
fn deviation(found: &DeviationReport) -> Vec<String> {
    let [to, from] = [found.mesh_to_surface, found.surface_to_mesh].map(|side| side.distance);
    let mut lines = vec![format!(
        "  deviation {to:.3e} from mesh to surface, {from:.3e} from surface to mesh; at {} elements more than {:.3e}",
        found.elements, found.limit
    )];
    if let Some(first) = found.held.first() {
        let at = located(Some(first.at));
        lines.push(format!("  {} places need edges shorter than --size-min allows, the first{at}", found.held.len()));
    }
    lines
}

fn located(at: Option<[f64; 3]>) -> String {
    at.map_or(String::new(), |[x, y, z]| format!(" at ({x:.6}, {y:.6}, {z:.6})"))
}
