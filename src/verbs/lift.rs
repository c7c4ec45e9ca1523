//! `planish lift MESH... --atlas DIR -o FILE`: from the planes of charts to the surface.

use super::atlas::{AtlasOnDisk, Unusable};
use super::planar_input::{self, Table};
use super::{Exit, eprint_line, escape, say};
use crate::cli;
use crate::formats::{MadeFormat, MadeMesh, encode_made};
use crate::outcome::Reason;
use crate::settings::Settings;
use crate::stages::guard;
use crate::system::disk::{self, Disk, System};
use planish_core::lift::{self, Elements, Lifted, Nearest};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Why nothing is lifted.
#[derive(Debug, thiserror::Error)]
pub(super) enum NotLifted {
    #[error(transparent)]
    Atlas(#[from] Unusable),
    #[error(transparent)]
    Lift(#[from] lift::Error),
    #[error("{}: {problem}", escape(.mesh))]
    Mesh { mesh: PathBuf, problem: String },
    #[error("{}: cannot be written: {error}", escape(.file))]
    Unwritten { file: PathBuf, error: std::io::Error },
    #[error("{0}")]
    Broken(String),
}

impl From<Reason> for NotLifted {
    fn from(broken: Reason) -> Self {
        Self::Broken(broken.message)
    }
}

/// What is made.
enum Made {
    Mesh(MadeFormat),
    Table,
}

/// Carries meshes or a table to the surface.
///
/// # Errors
/// Wrong usage.
pub fn lift(asked: &cli::Lift, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let made = made(asked)?;
    let lifted = guard(|| match made {
        Made::Table => lift_table(asked),
        Made::Mesh(format) => lift_meshes(asked, format, settings),
    });
    Ok(answer(lifted, settings))
}

/// Says what was written, or why nothing was.
pub(super) fn answer(done: Result<String, NotLifted>, settings: &Settings) -> Exit {
    match done {
        Ok(told) => {
            if !settings.quiet {
                say(&told);
            }
            Exit::Success
        }
        Err(error) => {
            eprint_line(&format!("nothing is written: {error}"));
            Exit::Refused
        }
    }
}

/// What is to be made, by the names of the files.
fn made(asked: &cli::Lift) -> Result<Made, String> {
    let tables = asked.meshes.iter().filter(|mesh| planar_input::is_table(mesh)).count();
    if planar_input::is_table(&asked.output) || tables > 0 {
        let is_one = planar_input::is_table(&asked.output) && tables == 1 && asked.meshes.len() == 1;
        let is_plain = !asked.project && asked.mesh_order.is_none();
        return match (is_one, is_plain) {
            (true, true) => Ok(Made::Table),
            (false, _) => Err("a table (.csv) becomes a table: name one, and a .csv file for --output".to_owned()),
            (true, false) => Err("--project and --mesh-order are for meshes: a table has none".to_owned()),
        };
    }
    let format = MadeFormat::of(&asked.output).ok_or_else(|| {
        format!("{}: the name tells no format; end it with .msh, .vtu, .stl, .mesh or .obj", escape(&asked.output))
    })?;
    if asked.mesh_order == Some(2) && !format.has_middles() {
        return Err("elements of order 2 are written to .msh and .vtu only: the other formats have none".to_owned());
    }
    if asked.project && asked.meshes.len() > 1 {
        return Err("--project takes one mesh".to_owned());
    }
    Ok(Made::Mesh(format))
}

fn lift_meshes(asked: &cli::Lift, format: MadeFormat, settings: &Settings) -> Result<String, NotLifted> {
    let atlas = AtlasOnDisk::read(&asked.atlas)?;
    let elements = if asked.mesh_order == Some(2) { Elements::Quadratic } else { Elements::Linear };
    let (lifted, farthest) = if asked.project {
        projected(&asked.meshes[0], &atlas, elements, settings)?
    } else {
        (joined(&asked.meshes, &atlas, elements, settings)?, None)
    };
    let (triangles, nodes) = (lifted.triangles.len(), lifted.points.len());
    let mesh = MadeMesh {
        points: lifted.points,
        triangles: lifted.triangles,
        middles: lifted.middles,
        charts: lifted.charts,
        parts: atlas.labels,
        part_of_chart: atlas.part_of_chart,
        ..MadeMesh::default()
    };
    write(&asked.output, &encode_made(format, &mesh))?;
    let off = farthest.map_or(String::new(), |off: f64| format!("; nodes were off the surface by {off:.2e} at most"));
    Ok(format!("{}: {triangles} triangles, {nodes} nodes on the surface{off}", escape(&asked.output)))
}

/// Meshes of planes, lifted and joined.
fn joined(
    meshes: &[PathBuf],
    atlas: &AtlasOnDisk,
    elements: Elements,
    settings: &Settings,
) -> Result<Lifted, NotLifted> {
    let mut parts = Vec::new();
    for mesh in meshes {
        let found = planar_input::read(mesh, settings);
        parts.extend(found.map_err(|problem| NotLifted::Mesh { mesh: mesh.clone(), problem })?);
    }
    let lifted = lift::lift(&atlas.surface, &parts, elements)?;
    let given: Vec<usize> = parts.iter().map(|part| part.chart).collect();
    let missing: Vec<usize> = (0..atlas.surface.charts()).filter(|chart| !given.contains(chart)).collect();
    if missing.is_empty() { Ok(lifted) } else { Err(lift::Error::Missing { charts: missing }.into()) }
}

/// A mesh in space, its nodes moved to the nearest places; and how far the farthest was off.
fn projected(
    mesh: &Path,
    atlas: &AtlasOnDisk,
    elements: Elements,
    settings: &Settings,
) -> Result<(Lifted, Option<f64>), NotLifted> {
    let found = planar_input::read_in_space(mesh, settings);
    let (points, triangles, charts) = found.map_err(|problem| NotLifted::Mesh { mesh: mesh.to_owned(), problem })?;
    let nearest = Nearest::new(&atlas.surface);
    let (lifted, farthest) = lift::project(&nearest, &points, &triangles, charts.as_deref(), elements);
    Ok((lifted, Some(farthest)))
}

fn lift_table(asked: &cli::Lift) -> Result<String, NotLifted> {
    let atlas = AtlasOnDisk::read(&asked.atlas)?;
    let name = &asked.meshes[0];
    let broken = |problem: String| NotLifted::Mesh { mesh: name.clone(), problem };
    let Table { rows } = planar_input::read_table(name).map_err(broken)?;
    let mut text = String::with_capacity(100 * rows.len());
    text.push_str("x,y,z,triangle,off\n");
    let mut shortest = zmij::Buffer::new();
    for (line, (chart, uv)) in rows.iter().enumerate() {
        let Some(found) = atlas.surface.locate(*chart, *uv) else {
            let charts = atlas.surface.charts();
            return Err(broken(format!("row {}: there is no chart {chart}: the atlas has {charts}, from 0", line + 1)));
        };
        for x in found.point {
            text.push_str(shortest.format(x));
            text.push(',');
        }
        // Writing to a string cannot fail.
        let _ = write!(text, "{},", atlas.grid.triangle[found.place.cell as usize]);
        text.push_str(shortest.format(found.off));
        text.push('\n');
    }
    write(&asked.output, text.as_bytes())?;
    Ok(format!("{}: {} points", escape(&asked.output), rows.len()))
}

/// Puts a file in its place, whole or not at all.
pub(super) fn write(file: &Path, bytes: &[u8]) -> Result<(), NotLifted> {
    let above = file.parent().filter(|above| !above.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let written = System
        .open(above)
        .and_then(|folder| disk::replace_file(&folder, &folder, file.file_name().unwrap_or_default(), bytes));
    written.map_err(|error| NotLifted::Unwritten { file: file.to_owned(), error })
}
