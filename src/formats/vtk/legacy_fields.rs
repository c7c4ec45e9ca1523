//! Fields from the arrays of points and cells of a legacy file.

use super::attributes::{Attributes, bit};
use super::cell_fields::cut_cells;
use super::cell_labels::PieceCells;
use super::error::{VtkError, escape};
use super::legacy_arrays::{Arrays, Kind, Stored};
use super::scalar::Order;
use super::xml_fields::{of_bytes, of_text};
use crate::formats::TooMany;
use crate::formats::fields::{Keeping, On, Values};
use crate::formats::words::float;

/// Keeps the arrays of a file of so many points, and of these cells.
///
/// # Errors
/// They have too many values. What else is wrong with an array is told.
pub(super) fn keep(
    file: &mut Arrays,
    attributes: &Attributes,
    points: u64,
    cells: &PieceCells,
    keeping: &mut Keeping,
) -> Result<(), TooMany> {
    for (name, array) in &attributes.of_points {
        if admits(On::Points, name, array, points, keeping)? {
            match values(file, array, points) {
                Ok(values) => keeping.add(On::Points, name, array.components as usize, values),
                Err(error) => keeping.leave_out(On::Points, name, error),
            }
        }
    }
    for (name, array) in &attributes.of_cells {
        if admits(On::Cells, name, array, cells.count(), keeping)? {
            let components = array.components as usize;
            match values(file, array, cells.count()) {
                Ok(values) => {
                    keeping.add(On::Cells, name, components, values.entries(components, cells.of_triangles()));
                }
                Err(error) => keeping.leave_out(On::Cells, name, error),
            }
        }
    }
    if keeping.has_cells() {
        keeping.set_cell(cut_cells(std::slice::from_ref(cells)));
    }
    if let Some(broken) = &attributes.broken {
        keeping.remark(format!("arrays behind the damage are not kept: {broken}"));
    }
    Ok(())
}

/// Whether an array is to be kept: it holds numbers.
fn admits(on: On, name: &str, array: &Stored, entries: u64, keeping: &mut Keeping) -> Result<bool, TooMany> {
    if let Kind::String | Kind::Variant = array.kind {
        keeping.pass_over(1);
        return Ok(false);
    }
    keeping.admits(on, name, array.components, entries)
}

/// The values of an array of numbers, of so many entries.
fn values(file: &mut Arrays, array: &Stored, entries: u64) -> Result<Values, VtkError> {
    file.text.at = array.at;
    let what = &format!("\"{}\"", escape(array.name));
    if array.tuples != entries {
        return Err(file.syntax(format!("it has {} entries for {entries} of them", array.tuples)));
    }
    // It was admitted: so many there may be.
    let count = entries.saturating_mul(array.components);
    match array.kind {
        Kind::Number(scalar) if file.binary => {
            Ok(of_bytes(file.bytes(what, count, scalar.bytes())?, scalar, Order::Big))
        }
        Kind::Number(scalar) if !array.is_colour => of_text(&mut file.text, scalar, what, count),
        Kind::Bit if file.binary => {
            let bytes = file.bytes(what, count.div_ceil(8), 1)?;
            Ok(Values::Integers((0..count as usize).map(|at| bit(bytes, at) as i64).collect()))
        }
        // Colours are parts of one in text.
        Kind::Number(_) => file.text.values(what, count, float).map(Values::Floats),
        _ => of_text(&mut file.text, super::scalar::Scalar::I8, what, count),
    }
}
