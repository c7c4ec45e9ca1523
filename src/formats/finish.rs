//! How every reader ends: points, triangles and notes become what a file holds, or its refusal.

use super::fields::Fields;
use super::labels::Labels;
use super::location::Location;
use super::{Content, Notes, ReadError};
use planish_core::mesh::{SoupError, TriangleSoup};
use planish_core::vec3::Vec3;

/// Where points are that can be no corners ([`TriangleSoup::may_hold`]), by their numbers, which ascend. Whether a triangle
/// has them for corners shows at the end only.
#[derive(Debug, Default)]
pub(super) struct BadPoints(pub Vec<(usize, Location)>);

impl BadPoints {
    /// Keeps the place of a point, if it can be no corner.
    #[inline]
    pub fn check(&mut self, number: usize, point: &Vec3, location: impl FnOnce() -> Location) {
        if !TriangleSoup::may_hold(point) {
            self.0.push((number, location()));
        }
    }

    fn location(&self, number: usize) -> Option<Location> {
        self.0.binary_search_by_key(&number, |bad| bad.0).ok().map(|i| self.0[i].1)
    }
}

/// What a file holds.
///
/// # Errors
/// It holds no surface, or a broken one: [`ReadError::NoSurface`], [`ReadError::Soup`].
pub(super) fn content(
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    labels: Labels,
    mut notes: Notes,
    bad: &BadPoints,
) -> Result<Content, ReadError> {
    let mut found = Vec::new();
    let mut has_volumes = false;
    for (kind, count) in &notes.skipped {
        if is_cell(kind) {
            found.push(counted(kind, *count));
            has_volumes |= is_volume(kind);
        }
    }
    // A file without any cell is told of as a soup without triangles.
    if triangles.is_empty() && !found.is_empty() {
        let remedy = if has_volumes { OF_VOLUMES } else { OF_LINES };
        return Err(ReadError::NoSurface { found: found.join(", "), remedy, notes: Box::new(notes) });
    }
    let error = match TriangleSoup::new(points, triangles) {
        Ok(soup) => {
            let soup = labels.apply(soup, &mut notes);
            return Ok(Content { soup, fields: Fields::default(), notes });
        }
        Err(error) => error,
    };
    let location = match error {
        SoupError::NotFinite { point, .. } => bad.location(point),
        _ => None,
    };
    Err(ReadError::Soup { error, location, notes: Box::new(notes) })
}

/// What to do where there are volumes only.
const OF_VOLUMES: &str = "their surface must be saved: in ParaView apply the filter Extract Surface and save the result as \
                          .vtp or .stl; in Gmsh put the surfaces into a physical group, or set Mesh.SaveAll = 1, and save \
                          again";

/// What to do where there is less than a surface.
const OF_LINES: &str =
    "points and lines make no surface: export the surface itself, as triangles, quadrilaterals or polygons";

/// Elements of volumes, by a part of their names in VTK, Gmsh and MEDIT.
const VOLUMES: [&str; 9] =
    ["tetra", "hexahedr", "voxel", "wedge", "prism", "pyramid", "polyhedron", "convex_point_set", "hex_region"];

/// Other elements, by their whole names.
const CELLS: [&str; 7] = ["vertices", "lines", "line", "edge", "point", "vertex", "cells of unknown type"];

fn is_volume(kind: &str) -> bool {
    let kind = kind.to_ascii_lowercase();
    VOLUMES.iter().any(|part| kind.contains(part))
}

/// Whether what was left out is an element of a mesh. (Elements of PLY may be anything.)
fn is_cell(kind: &str) -> bool {
    kind.starts_with("VTK_") || CELLS.contains(&kind) || is_volume(kind)
}

/// As people say it: `11,000 quadratic tetrahedra` for 11000 of `VTK_QUADRATIC_TETRA`.
fn counted(kind: &str, count: usize) -> String {
    let name = kind.trim_start_matches("VTK_").replace('_', " ");
    let name = if name == kind { name } else { name.to_lowercase() };
    let name = if name.ends_with("tetra") { name + "hedron" } else { name };
    let name = if count == 1 { name } else { plural(name) };
    format!("{} {name}", grouped(count))
}

/// A number with a comma before each group of three digits: `11,000`.
fn grouped(number: usize) -> String {
    let digits = number.to_string();
    let mut grouped = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// The plural of the name of an element.
fn plural(name: String) -> String {
    if let Some(stem) = name.strip_suffix("hedron") {
        return format!("{stem}hedra");
    }
    if let Some(stem) = name.strip_suffix("vertex") {
        return format!("{stem}vertices");
    }
    let is_plural = ["s", "vertices", "type"].iter().any(|end| name.ends_with(end));
    if is_plural { name } else { format!("{name}s") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::LabelSource;

    #[test]
    fn elements_are_counted_in_words() {
        let cases = [
            ("VTK_TETRA", 1, "1 tetrahedron"),
            ("VTK_QUADRATIC_TETRA", 11_000, "11,000 quadratic tetrahedra"),
            ("hexahedron", 1_234_567, "1,234,567 hexahedra"),
            ("VTK_VOXEL", 100, "100 voxels"),
            ("VTK_VERTEX", 2, "2 vertices"),
            ("lines", 20, "20 lines"),
            ("cells of unknown type", 2, "2 cells of unknown type"),
            ("VTK_LAGRANGE_WEDGE", 2, "2 lagrange wedges"),
        ];
        for (kind, count, told) in cases {
            assert_eq!(counted(kind, count), told);
        }
    }

    /// A file of these elements is refused with its notes and a remedy that helps; with a triangle it is read.
    #[test]
    fn what_holds_no_surface_is_told_what_it_holds() {
        let with = |kind: &str, triangles: Vec<[u32; 3]>| {
            let mut notes = Notes::new("a format");
            notes.skip(kind, 11_000);
            let labels = Labels::new(&LabelSource::Usual);
            content(vec![[0.0; 3]; 3], triangles, labels, notes, &BadPoints::default())
        };
        let kinds = [
            ("tetrahedron", "only 11,000 tetrahedra; their surface", true),
            ("VTK_QUADRATIC_HEXAHEDRON", "only 11,000 quadratic hexahedra; their surface", true),
            ("line", "only 11,000 lines; points and lines", true),
            ("camera", "holds no triangle (3 points)", false),
        ];
        for (kind, told, is_cell) in kinds {
            let error = with(kind, vec![]).expect_err(kind);
            assert!(error.to_string().contains(told), "{error}");
            assert_eq!(matches!(error, ReadError::NoSurface { .. }), is_cell);
            assert_eq!(error.notes().map(|notes| notes.skipped[kind]), Some(11_000));
            assert!(with(kind, vec![[0, 1, 2]]).is_ok());
        }
    }
}
