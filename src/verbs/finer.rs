//! Shorter edges where a mesh is too far from the surface: `finer-1.pos`, `finer-2.pos`, `finer-3.pos`, a file for each time that
//! `planish check --mesh MESH --deviation D --finer` finds such places. remesh.geo heeds all that are there.

use crate::formats::gmsh;
use crate::report::Report;
use crate::report::mesh::Distance;
use crate::result_files::FINER;
use crate::settings::USUAL_GRADATION;
use crate::system::disk::{self, Disk, System};
use planish_core::measure::sizes::{SizeField, SizedPlace, TOLD_UP_TO};
use planish_core::soundness::{BARELY, Deviation, TooFar, Triangulation};
use std::path::Path;

/// How far shorter edges reach around an element that is too far from the surface, in its longest edge: the next mesh has other
/// elements there. Of max_planck_decimated at a thousandth of its diagonal, 13 were left after three times with 1.
const REACH: f64 = 2.0;

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
    let place =
        |found: &TooFar, size: f64| SizedPlace { at: found.at, size: size.max(least), reach: REACH * found.longest };
    let (mut places, mut held) = (Vec::new(), Vec::new());
    for found in &deviation.too_far {
        let size = 0.5 * found.longest;
        if size < least {
            held.push(Distance { distance: found.distance, at: found.at });
        }
        places.push(place(found, size));
    }
    // Across the edges of facets the error falls with the length of edges: where the limit is kept barely, they shall keep it with
    // room to spare.
    let barely = deviation.barely.iter();
    places.extend(barely.map(|found| place(found, found.longest * BARELY * deviation.limit / found.distance)));
    let gradation = report.settings.gradation.unwrap_or(USUAL_GRADATION);
    let field = SizeField::new(places, gradation);
    let triangles: Vec<_> = (0..surface.triangles.len()).map(|t| surface.corners(t)).collect();
    let cubes = field.told(&triangles, TOLD_UP_TO * hand_off.size, usize::MAX).unwrap_or_default();
    let bytes = gmsh::on_cubes(&cubes, hand_off.enlarged);
    let written = System.open(folder).and_then(|folder| disk::replace_file(&folder, &folder, name, &bytes));
    written.map_err(|error| format!("{name} cannot be written: {error}"))?;
    Ok(held)
}
