//! `planish info`: what is this surface?

use super::{Exit, escape, say, say_json};
use crate::formats::{Content, Notes};
use crate::input::job::Job;
use crate::input::{self, Folder, decode, read_input};
use crate::outcome::Reason;
use crate::report::RefusedComponent;
use crate::report::{self, Counts, Repairs, Surface, Warning};
use crate::settings::Settings;
use crate::stages::{guard, refused, repaired};
use crate::system::escape::printable;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What `--json` prints for an input.
#[derive(Serialize)]
struct Answer {
    input: String,
    content: Option<Notes>,
    surface: Option<Surface>,
    repairs: Option<Repairs>,
    warnings: Vec<Warning>,
    refused_components: Vec<RefusedComponent>,
    reason: Option<Reason>,
}

/// Prints the counts of all inputs.
///
/// # Errors
/// Wrong usage.
pub fn info(paths: &[PathBuf], json: bool, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let mut exit = Exit::Success;
    for job in input::collect(paths)? {
        let answer = answer(&job, settings);
        if answer.reason.is_some() || !answer.refused_components.is_empty() {
            exit = Exit::Refused;
        }
        if json {
            say_json(&answer)?;
        } else {
            say(&text(&answer, &job.path));
        }
    }
    Ok(exit)
}

fn answer(job: &Job, settings: &Settings) -> Answer {
    let input = job.path.to_string_lossy().into_owned();
    let mut content = None;
    let found = guard(|| {
        let found = decode(
            &job.path,
            &read_input(job, settings).map_err(|unread| unread.reason)?,
            settings,
            &Folder::of_job(job),
        );
        let Content { soup, notes, .. } = found.map_err(|refusal| {
            content = refusal.notes.map(|notes| *notes);
            refusal.reason
        })?;
        content = Some(notes);
        repaired(&soup, settings)
    });
    match found {
        Ok(found) => {
            let (refused_components, reason) = match refused(&found) {
                Ok(components) => (components, None),
                Err(reason) => (vec![], Some(reason)),
            };
            Answer {
                surface: Some(report::surface(&found)),
                repairs: Some(report::repairs(&found.report)),
                warnings: report::warnings(&found),
                input,
                content,
                refused_components,
                reason,
            }
        }
        Err(reason) => Answer {
            input,
            content,
            surface: None,
            repairs: None,
            warnings: vec![],
            refused_components: vec![],
            reason: Some(reason),
        },
    }
}

/// The answer for people.
fn text(answer: &Answer, input: &Path) -> String {
    let mut lines = vec![escape(input)];
    if let Some(reason) = &answer.reason {
        lines.push(format!("  refused: {} [{}]", reason.message, reason.code.name()));
    }
    if let Some(surface) = &answer.surface {
        lines.push(counts("raw     ", &surface.raw));
        lines.push(counts("repaired", &surface.repaired.counts));
        let [min, max] = surface.repaired.bbox;
        lines.push(format!("  area {:.6e}, box {min:?} to {max:?}", surface.repaired.area));
    }
    lines.extend(answer.content.iter().filter(|notes| !notes.labels.is_empty()).map(labels));
    lines.extend(answer.refused_components.iter().map(refused_component));
    lines.extend(answer.repairs.iter().flat_map(repairs));
    lines.extend(answer.warnings.iter().map(|w| format!("  warning  {}", w.message)));
    lines.extend(answer.content.iter().flat_map(|notes| &notes.remarks).map(|remark| format!("  {remark}")));
    lines.join("\n")
}

/// Of many labels so many are listed.
const LISTED: usize = 20;

/// The names of the parts of the surface.
fn labels(notes: &Notes) -> String {
    let names = notes.labels.iter().take(LISTED).map(|label| printable(&label.name));
    let more = if notes.labels.len() > LISTED { ", ..." } else { "" };
    format!("  labels   {}: {}{more}", notes.labels.len(), names.collect::<Vec<_>>().join(", "))
}

fn refused_component(refused: &RefusedComponent) -> String {
    let RefusedComponent { component, reason, .. } = refused;
    format!("  refused  component {component} of {}: {} [{}]", refused.extent(), reason.message, reason.code.name())
}

fn counts(title: &str, c: &Counts) -> String {
    let genus = c.genus.map_or("no".to_owned(), |g| g.to_string());
    let kind = if c.orientable { "orientable" } else { "not orientable" };
    let mut line = format!(
        "  {title} {} vertices, {} triangles, {} components, {} boundary loops, genus {genus}, Euler number {}, {kind}",
        c.vertices, c.triangles, c.components, c.boundary_loops, c.euler,
    );
    if c.nonmanifold_edges + c.nonmanifold_vertices + c.inconsistent_edges > 0 {
        line += &format!(
            "\n           {} non-manifold edges, {} non-manifold vertices, {} inconsistently oriented edges",
            c.nonmanifold_edges, c.nonmanifold_vertices, c.inconsistent_edges
        );
    }
    line
}

fn repairs(r: &Repairs) -> Vec<String> {
    let done = [
        (r.welded, "points welded"),
        (r.unreferenced_points, "points without triangles"),
        (r.t_junctions_closed, "T-junctions closed"),
        (r.t_junctions_left, "T-junctions left open"),
        (r.cracks_closed, "cracks closed"),
        (r.duplicate_triangles, "duplicate triangles removed"),
        (r.degenerate_triangles, "degenerate triangles removed"),
        (r.flipped_triangles, "triangles flipped"),
        (r.needles_collapsed, "needles collapsed"),
        (r.caps_flipped, "caps flipped"),
        (r.split_vertices, "vertices split"),
        (r.mollified_triangles, "triangles mollified"),
    ];
    let said: Vec<String> = done.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    let said = if said.is_empty() { "none".to_owned() } else { said.join(", ") };
    let first = r.first.iter().map(|(what, ids)| format!("           {what}: {ids:?} ..."));
    std::iter::once(format!("  repairs  {said}")).chain(first).collect()
}
