//! Fields from the arrays of points and cells of an XML file.
//!
//! Pieces are joined: where a piece lacks an array that others have, its entries are no numbers.

use super::cell_fields::cut_cells;
use super::cell_labels::PieceCells;
use super::error::VtkError;
use super::scalar::{Order, Scalar};
use super::text::{Text, whole};
use super::xml::Arrays;
use super::xml_parts::{Data, Named, Outline, Role};
use crate::formats::TooMany;
use crate::formats::fields::{Keeping, On, Values};
use crate::formats::words::float;
use std::collections::HashMap;

/// Keeps the arrays of a file, the pieces of which have these cells.
///
/// # Errors
/// They have too many values. What else is wrong with an array is told.
pub(super) fn keep<'a>(
    arrays: &mut Arrays<'a>,
    file: &Outline<'a>,
    cells: &[PieceCells],
    keeping: &mut Keeping,
) -> Result<(), TooMany> {
    let words = file.of_cells.iter().filter(|named| named.is_strings).count();
    keeping.pass_over(file.passed_over + words);
    let points: Vec<u64> = file.pieces.iter().map(|piece| piece.points).collect();
    for name in by_name(&file.of_points) {
        name.keep(arrays, On::Points, &points, keeping, |_, values, _| values)?;
    }
    let counts: Vec<u64> = cells.iter().map(PieceCells::count).collect();
    for name in by_name(&file.of_cells) {
        let of_triangles = |piece: usize, values: Values, components| match cells.get(piece) {
            Some(cells) => values.entries(components, cells.of_triangles()),
            None => values,
        };
        name.keep(arrays, On::Cells, &counts, keeping, of_triangles)?;
    }
    if keeping.has_cells() {
        keeping.set_cell(cut_cells(cells));
    }
    Ok(())
}

/// The arrays of one name, in the order of their pieces.
struct OneName<'n, 'a> {
    name: &'n str,
    parts: Vec<&'n Named<'a>>,
}

/// Arrays of numbers, by their names, in the order in which these come.
fn by_name<'n, 'a>(all: &'n [Named<'a>]) -> Vec<OneName<'n, 'a>> {
    let mut places = HashMap::new();
    let mut names: Vec<OneName> = Vec::new();
    for named in all.iter().filter(|named| !named.is_strings) {
        let place = *places.entry(named.name.as_str()).or_insert(names.len());
        if place == names.len() {
            names.push(OneName { name: &named.name, parts: Vec::new() });
        }
        let parts = &mut names[place].parts;
        // Of several in one piece (steps of time) the first one counts.
        if parts.last().is_none_or(|last: &&Named| last.owner.piece() != named.owner.piece()) {
            parts.push(named);
        }
    }
    names
}

impl<'a> OneName<'_, 'a> {
    /// Keeps the array, whose pieces have so many entries. `shaped` makes entries of triangles of those of cells.
    fn keep(
        &self,
        arrays: &mut Arrays<'a>,
        on: On,
        pieces: &[u64],
        keeping: &mut Keeping,
        shaped: impl Fn(usize, Values, usize) -> Values,
    ) -> Result<(), TooMany> {
        let components = self.parts[0].components();
        let entries = pieces.iter().fold(0, |sum: u64, count| sum.saturating_add(*count));
        if !keeping.admits(on, self.name, components, entries)? {
            return Ok(());
        }
        match self.joined(arrays, pieces, components as usize, shaped) {
            Ok(values) => keeping.add(on, self.name, components as usize, values),
            Err(error) => keeping.leave_out(on, self.name, error),
        }
        Ok(())
    }

    /// The entries of all pieces.
    fn joined(
        &self,
        arrays: &mut Arrays<'a>,
        pieces: &[u64],
        components: usize,
        shaped: impl Fn(usize, Values, usize) -> Values,
    ) -> Result<Values, VtkError> {
        let mut all = Values::Integers(Vec::new());
        let mut parts = self.parts.iter().peekable();
        for (number, entries) in pieces.iter().enumerate() {
            // The numbers of all pieces together were admitted.
            let count = (*entries as usize).saturating_mul(components);
            let values = match parts.next_if(|part| part.owner.piece() == Some(number)) {
                Some(part) => numbers(arrays, part, components, count)?,
                None => Values::Floats(vec![f64::NAN; count]),
            };
            all = all.followed_by(shaped(number, values, components));
        }
        Ok(all)
    }
}

/// So many numbers of an array, which must have these components.
fn numbers<'a>(
    arrays: &mut Arrays<'a>,
    named: &Named<'a>,
    components: usize,
    count: usize,
) -> Result<Values, VtkError> {
    let array = named.array.as_ref().map_err(Clone::clone)?;
    let name = Role::values_of(&named.name);
    if named.components() != components as u64 {
        let problem = format!("{name} are {} at a time, and {components} in another piece", named.components());
        return Err(VtkError::Syntax { location: arrays.location(array), problem });
    }
    if let Data::Ascii(bytes, at) = array.data {
        return of_text(&mut Text { bytes, at }, array.scalar, &name, count as u64);
    }
    let bytes = arrays.bytes_of(array, &name)?;
    let bytes = arrays.first(array, &name, count as u64, &bytes)?;
    Ok(of_bytes(bytes, array.scalar, arrays.order()))
}

/// So many numbers of a text.
pub(super) fn of_text(text: &mut Text, scalar: Scalar, name: &str, count: u64) -> Result<Values, VtkError> {
    if !scalar.is_float() {
        let begin = text.at;
        let mut are_all = true;
        let integers = text.values(name, count, |word| Some(narrowed(whole(word)?, &mut are_all)))?;
        if are_all {
            return Ok(Values::Integers(integers));
        }
        text.at = begin;
    }
    text.values(name, count, float).map(Values::Floats)
}

/// All numbers of bytes.
pub(super) fn of_bytes(bytes: &[u8], scalar: Scalar, order: Order) -> Values {
    if !scalar.is_float() {
        let mut are_all = true;
        let integers = scalar.whole(bytes, order, |number| narrowed(number, &mut are_all));
        if are_all {
            return Values::Integers(integers);
        }
    }
    Values::Floats(scalar.numbers(bytes, order))
}

/// A whole number of 64 bits; of unsigned ones not all are.
fn narrowed(number: i128, are_all: &mut bool) -> i64 {
    i64::try_from(number).unwrap_or_else(|_| {
        *are_all = false;
        0
    })
}
