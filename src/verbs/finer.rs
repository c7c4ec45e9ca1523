//! Shorter edges where a mesh is too far from the surface: `finer-1.pos`, `finer-2.pos`, `finer-3.pos`, a file for each time that
//! `planish check --mesh MESH --deviation D --finer` finds such places. remesh.geo heeds all that are there.

use crate::formats::gmsh;
use crate::report::Report;
use crate::report::mesh::Distance;
use crate::result_files::FINER;
use crate::settings::USUAL_GRADATION;
use crate::system::disk::{self, Disk, System};
use planish_core::measure::sizes::{SizeField, SizedPlace, SizedTriangle, TOLD_UP_TO};
use planish_core::soundness::{BARELY, Deviation, Triangulation};
use std::path::Path;

/// Asks for edges half as long at all elements that are too far from the surface; returns the places where they would be shorter
/// than may be.
///
/// # Errors
/// For people: nothing was asked for when the result was made, it was asked for often enough, or the file cannot be written.
pub(super) fn ask(
    folder: &Path,
    report: &Report,
    surface: &Triangulation,
    deviation: &Deviation,
) -> Result<Vec<Distance>, String> {
    if report.settings.deviation.is_none() {
        return Err("remesh.geo heeds no shorter edges: run planish again with --deviation D, and Gmsh".to_owned());
    }
    if deviation.too_far.is_empty() {
        return Ok(Vec::new());
    }
    let hand_off = report.hand_off.as_ref().ok_or("the result has no hand-off to Gmsh")?;
    let Some(name) = FINER.into_iter().find(|name| !folder.join(name).exists()) else {
        let problem = "shorter edges were asked for three times, and mesh and surface are too far apart still";
        return Err(format!("{problem}: give a larger --deviation, or a smaller --size or --size-min"));
    };
    let least = report.settings.size_min.unwrap_or(0.0);
    let (mut places, mut held) = (Vec::new(), Vec::new());
    for found in &deviation.too_far {
        let size = 0.5 * found.longest;
        if size < least {
            held.push(Distance { distance: found.distance, at: found.at });
        }
        places.push(SizedPlace { at: found.at, size: size.max(least), reach: found.longest });
    }
    // The chord error falls with the square of edges: where the limit is kept barely, they shall keep it with room to spare.
    for found in &deviation.barely {
        let size = found.longest * (BARELY * deviation.limit / found.distance).sqrt();
        places.push(SizedPlace { at: found.at, size: size.max(least), reach: found.longest });
    }
    let gradation = report.settings.gradation.unwrap_or(USUAL_GRADATION);
    let field = SizeField::new(places, gradation);
    let anything = [f64::INFINITY; 3];
    let triangles =
        (0..surface.triangles.len()).map(|t| SizedTriangle { corners: surface.corners(t), sizes: anything });
    let bytes = gmsh::sizes(&field.sampled(triangles, TOLD_UP_TO * hand_off.size), hand_off.enlarged);
    let written = System.open(folder).and_then(|folder| disk::replace_file(&folder, &folder, name, &bytes));
    written.map_err(|error| format!("{name} cannot be written: {error}"))?;
    Ok(held)
}
