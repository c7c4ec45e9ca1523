//! VTK legacy files, 2.0 to 5.1: `# vtk DataFile Version`, a title, `ASCII` or `BINARY`, and a data set.
//!
//! The geometry is read, and what follows it (`POINT_DATA`, `CELL_DATA`): the one array that labels cells, the one of points that
//! tells sizes, and all fields. What stands before or in between (`FIELD`, `METADATA`) is passed over.

use super::attributes::Attributes;
use super::cell;
use super::cell_labels::Rank;
use super::error::{VtkError, escape};
use super::legacy_arrays::Arrays;
use super::legacy_fields;
use super::legacy_sizes;
use super::surface::{Cells, Surface, Types};
use super::unsupported;
use crate::formats::fields::Keeping;
use crate::formats::labels::Labels;
use crate::formats::point_sizes;
use crate::formats::{Content, LabelSource, ReadError, Source};

/// How a legacy file begins.
pub(super) const HEAD: &[u8] = b"# vtk DataFile Version";

/// Reads a legacy file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let mut file = Arrays::new(source.bytes);
    let format = header(&mut file)?;
    let is_labelled = *source.labels != LabelSource::Ignored;
    let mut surface = Surface::new(source.limits, format, is_labelled || source.keeps_fields);
    let location = file.location();
    match file.keyword().as_deref() {
        Some(b"POLYDATA") => polydata(&mut file, &mut surface)?,
        Some(b"UNSTRUCTURED_GRID") => unstructured_grid(&mut file, &mut surface)?,
        Some(other) => return Err(unsupported(location, &escape(other)).into()),
        None => return Err(file.ends("the kind of the data set").into()),
    }
    let cells = surface.take_cells().unwrap_or_default();
    let is_asked = is_labelled || source.keeps_fields || source.sizes.is_some();
    let attributes = if is_asked { Attributes::of(&mut file) } else { Attributes::default() };
    let labels = match is_labelled {
        true => attributes.labels(&mut file, &cells, source.labels, surface.notes())?,
        false => Labels::new(source.labels),
    };
    let points = surface.points();
    let content = surface.finish(labels)?;
    let sizes = source.sizes.map(|asked| legacy_sizes::sizes(&mut file, &attributes, asked, points)).transpose()?;
    let mut content = point_sizes::give(content, sizes);
    if source.keeps_fields {
        let mut keeping = Keeping::new(source.limits, source.bytes.len());
        legacy_fields::keep(&mut file, &attributes, points, &cells, &mut keeping).map_err(VtkError::from)?;
        content.fields = keeping.finish(&mut content.notes);
    }
    Ok(content)
}

/// The first lines, up to `DATASET`; the version and encoding.
fn header(file: &mut Arrays) -> Result<String, VtkError> {
    let first = file.text.line().unwrap_or_default();
    let version = escape(first.get(HEAD.len()..).unwrap_or_default().trim_ascii());
    file.text.line();
    let location = file.location();
    let encoding = match file.keyword().as_deref() {
        Some(b"ASCII") => "ASCII",
        Some(b"BINARY") => "binary",
        Some(other) => {
            let problem = format!("\"{}\" stands where ASCII or BINARY is expected", escape(other));
            return Err(VtkError::Syntax { location, problem });
        }
        None => return Err(file.ends("ASCII or BINARY")),
    };
    file.binary = encoding == "binary";
    match file.keyword().as_deref() {
        Some(b"DATASET") => {}
        Some(other) => return Err(file.unexpected(other, "DATASET")),
        None => return Err(file.ends("DATASET")),
    }
    Ok(format!("VTK legacy {version}, {encoding}"))
}

/// What the cells of a section give.
enum Give {
    /// Triangles: all cells are of this type.
    Triangles(u8),
    Nothing(Rank),
}

/// The polygons and strips of a data set of polygons.
fn polydata(file: &mut Arrays, surface: &mut Surface) -> Result<(), VtkError> {
    let mut has_points = false;
    loop {
        let at = file.text.at;
        let keyword = file.keyword();
        let (section, give) = match keyword.as_deref() {
            Some(b"POINTS") if !has_points => {
                points(file, surface)?;
                has_points = true;
                continue;
            }
            Some(b"VERTICES") => ("vertices", Give::Nothing(Rank::First)),
            Some(b"LINES") => ("lines", Give::Nothing(Rank::Lines)),
            Some(b"POLYGONS") if has_points => ("POLYGONS", Give::Triangles(cell::POLYGON)),
            Some(b"TRIANGLE_STRIPS") if has_points => ("TRIANGLE_STRIPS", Give::Triangles(cell::STRIP)),
            Some(b"FIELD") => {
                file.field(|_| ())?;
                continue;
            }
            None | Some(b"POINT_DATA" | b"CELL_DATA") if has_points => {
                file.text.at = at;
                return Ok(());
            }
            Some(other) => return Err(file.unexpected(other, "POINTS, POLYGONS or TRIANGLE_STRIPS")),
            None => return Err(file.ends("POINTS")),
        };
        let (corners, ends) = file.cells(section)?;
        match give {
            Give::Triangles(one) => {
                let cells = Cells { section, types: Types::All(one), corners: &corners, ends: &ends };
                surface.add_cells(&cells, || file.place_at(at))?;
            }
            Give::Nothing(rank) => surface.skip(rank, ends.len()),
        }
    }
}

/// `POINTS`, their number, type, and coordinates.
fn points(file: &mut Arrays, surface: &mut Surface) -> Result<(), VtkError> {
    let at = file.text.at;
    let points = file.points(surface.room_for_points())?;
    surface.add_points(points, || file.place_at(at))
}

/// The cells of an unstructured grid that make a surface.
fn unstructured_grid(file: &mut Arrays, surface: &mut Surface) -> Result<(), VtkError> {
    let (mut has_points, mut cells, mut types) = (false, None, None);
    let mut at = file.text.at;
    while !(has_points && cells.is_some() && types.is_some()) {
        let here = file.text.at;
        match file.keyword().as_deref() {
            Some(b"POINTS") if !has_points => {
                points(file, surface)?;
                has_points = true;
            }
            Some(b"CELLS") if cells.is_none() => {
                at = here;
                cells = Some(file.cells("CELLS")?);
            }
            Some(b"CELL_TYPES") if types.is_none() => types = Some(file.types()?),
            Some(b"FIELD") => file.field(|_| ())?,
            // So VTK writes a grid without cells.
            None | Some(b"POINT_DATA" | b"CELL_DATA") if has_points && cells.is_none() && types.is_none() => {
                file.text.at = here;
                return Ok(());
            }
            Some(other) => return Err(file.unexpected(other, "POINTS, CELLS or CELL_TYPES")),
            None => return Err(file.ends("POINTS, CELLS and CELL_TYPES")),
        }
    }
    let ((corners, ends), types) = (cells.unwrap_or_default(), types.unwrap_or_default());
    let location = || file.place_at(at);
    if types.len() != ends.len() {
        let (declared, there) = (ends.len() as u64, types.len() as u64);
        return Err(VtkError::Count { location: location(), what: "CELL_TYPES".to_owned(), declared, there });
    }
    let types = Types::Each(&types);
    surface.add_cells(&Cells { section: "CELLS", types, corners: &corners, ends: &ends }, location)
}

#[cfg(test)]
mod tests;
