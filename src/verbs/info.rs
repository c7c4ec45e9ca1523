//! `planish info`: what is this surface?

use super::Exit;
use crate::inputs;
use crate::job::{Job, read_file};
use crate::outcome::Reason;
use crate::report::{self, Counts, Repairs, Surface};
use crate::settings::Settings;
use pipeline::repair;
use serde::Serialize;
use std::path::PathBuf;

/// What `--json` prints for an input.
#[derive(Serialize)]
struct Answer {
    input: String,
    surface: Option<Surface>,
    repairs: Option<Repairs>,
    reason: Option<Reason>,
}

/// Prints the counts of all inputs.
///
/// # Errors
/// Wrong usage.
pub fn info(paths: &[PathBuf], json: bool, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let mut exit = Exit::Success;
    for job in inputs::collect(paths)? {
        let answer = answer(&job, settings);
        if answer.reason.is_some() {
            exit = Exit::Refused;
        }
        if json {
            println!("{}", serde_json::to_string(&answer)?);
        } else {
            print(&answer);
        }
    }
    Ok(exit)
}

fn answer(job: &Job, settings: &Settings) -> Answer {
    let input = job.path.to_string_lossy().into_owned();
    let refused = |reason| Answer { input: input.clone(), surface: None, repairs: None, reason: Some(reason) };
    let soup = match read_file(&job.path).and_then(|bytes| job.read(&bytes)) {
        Ok(soup) => soup,
        Err(reason) => return refused(reason),
    };
    match repair(&soup, &pipeline::repair::Settings { weld: settings.weld }) {
        Ok(found) => Answer {
            surface: Some(report::surface(&found)),
            repairs: Some(report::repairs(&found.report)),
            input,
            reason: None,
        },
        Err(e) => refused(Reason::new(crate::outcome::Code::OnlyDegenerate, e)),
    }
}

fn print(answer: &Answer) {
    println!("{}", answer.input.escape_debug());
    if let Some(reason) = &answer.reason {
        println!("  refused: {} [{}]", reason.message, reason.code.name());
    }
    if let Some(surface) = &answer.surface {
        counts("raw     ", &surface.raw);
        counts("repaired", &surface.repaired.counts);
        let [min, max] = surface.repaired.bbox;
        println!("  area {:.6e}, box {min:?} to {max:?}", surface.repaired.area);
    }
    if let Some(repairs) = &answer.repairs {
        print_repairs(repairs);
    }
}

fn counts(title: &str, c: &Counts) {
    let genus = c.genus.map_or("no".to_owned(), |g| g.to_string());
    println!(
        "  {title} {} vertices, {} triangles, {} components, {} boundary loops, genus {genus}, Euler number {}, {}",
        c.vertices,
        c.triangles,
        c.components,
        c.boundary_loops,
        c.euler,
        if c.orientable { "orientable" } else { "not orientable" },
    );
    if c.nonmanifold_edges + c.nonmanifold_vertices + c.inconsistent_edges > 0 {
        println!(
            "           {} non-manifold edges, {} non-manifold vertices, {} inconsistently oriented edges",
            c.nonmanifold_edges, c.nonmanifold_vertices, c.inconsistent_edges
        );
    }
}

fn print_repairs(r: &Repairs) {
    let done = [
        (r.welded, "points welded"),
        (r.unreferenced_points, "points without triangles"),
        (r.cracks_closed, "cracks closed"),
        (r.duplicate_triangles, "duplicate triangles removed"),
        (r.degenerate_triangles, "degenerate triangles removed"),
        (r.flipped_triangles, "triangles flipped"),
        (r.split_vertices, "vertices split"),
        (r.mollified_triangles, "triangles mollified"),
    ];
    let said: Vec<String> = done.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!("{n} {what}")).collect();
    println!("  repairs  {}", if said.is_empty() { "none".to_owned() } else { said.join(", ") });
    for (what, ids) in &r.first {
        println!("           {what}: {ids:?} ...");
    }
}
