//! Labels from the arrays of cells of an XML file.

use super::cell_labels::{self, Candidate, CellLabels, PieceCells, Values};
use super::error::{VtkError, escape};
use super::text::{Text, whole};
use super::xml::Arrays;
use super::xml_parts::{Array, Data, Named, Outline, Role};
use crate::formats::labels::Labels;
use crate::formats::words::float;
use crate::formats::{LabelSource, Notes, ReadError};
use std::collections::{HashMap, HashSet};

/// The array of planish's own files, the numbers of which may have names.
const OWN: &str = "label";

/// The dimension of what labels name.
const SURFACE: i64 = 2;

/// The labels of the triangles of these pieces.
///
/// # Errors
/// What is asked for is not there, or cannot be read.
pub(super) fn labels<'a>(
    arrays: &mut Arrays<'a>,
    file: &Outline<'a>,
    pieces: &[PieceCells],
    source: &LabelSource,
    notes: &mut Notes,
) -> Result<Labels, ReadError> {
    let mut met = HashSet::new();
    let could_be = file.of_cells.iter().filter(|named| named.components() == 1);
    let names: Vec<&Named> = could_be.filter(|named| met.insert(named.name.as_str())).collect();
    let is_float = |named: &Named| named.array.as_ref().is_ok_and(|array| array.scalar.is_float());
    let candidates = names.iter().map(|named| Candidate { name: &named.name, is_float: is_float(named) });
    let Some(name) = cell_labels::chosen(candidates, source)? else { return Ok(Labels::new(source)) };
    match of_pieces(arrays, file, pieces, source, name) {
        Ok(labels) => Ok(labels),
        Err(error) => cell_labels::damaged(error, source, notes).map(|()| Labels::new(source)),
    }
}

/// The labels by the array of a name, piece by piece.
fn of_pieces<'a>(
    arrays: &mut Arrays<'a>,
    file: &Outline<'a>,
    pieces: &[PieceCells],
    source: &LabelSource,
    name: &str,
) -> Result<Labels, ReadError> {
    let names = if name == OWN { names(arrays, file)? } else { HashMap::new() };
    let mut labels = CellLabels::new(source, name, names);
    // Arrays stand in the order of pieces.
    let mut rest = file.of_cells.as_slice();
    for (number, piece) in pieces.iter().enumerate() {
        let (of_piece, others) = rest.split_at(rest.partition_point(|named| named.owner.piece() <= Some(number)));
        rest = others;
        let is_chosen = |named: &&Named| named.name == name && named.components() == 1;
        let values = match of_piece.iter().find(is_chosen) {
            Some(named) => Some(values(arrays, named, piece.count(), &mut labels)?),
            None => None,
        };
        labels.piece(piece, values.as_ref())?;
    }
    Ok(labels.finish())
}

/// The values of an array of so many cells.
fn values<'a>(
    arrays: &mut Arrays<'a>,
    named: &Named<'a>,
    cells: u64,
    labels: &mut CellLabels,
) -> Result<Values, VtkError> {
    let array = named.array.as_ref().map_err(Clone::clone)?;
    let name = Role::values_of(&named.name);
    if named.is_strings {
        return strings(arrays, array, &name, cells, |string| labels.word(string)).map(Values::Labels);
    }
    if let Data::Ascii(bytes, at) = array.data {
        let mut text = Text { bytes, at };
        return match array.scalar.is_float() {
            true => text.values(&name, cells, float).map(Values::Floats),
            false => text.values(&name, cells, |word| Some(labels.number(whole(word)?))).map(Values::Labels),
        };
    }
    let bytes = arrays.bytes_of(array, &name)?;
    let bytes = arrays.first(array, &name, cells, &bytes)?;
    Ok(match array.scalar.is_float() {
        true => Values::Floats(array.scalar.floats(bytes, arrays.order())),
        false => Values::Labels(array.scalar.whole(bytes, arrays.order(), |number| labels.number(number))),
    })
}

/// What `each` makes of the first `count` strings of an array: of bytes up to a zero, which are numbers in text.
fn strings<'a, T>(
    arrays: &mut Arrays<'a>,
    array: &Array<'a>,
    name: &str,
    count: u64,
    each: impl FnMut(&[u8]) -> T,
) -> Result<Vec<T>, VtkError> {
    let bytes = match array.data {
        Data::Ascii(bytes, at) => letters(Text { bytes, at }, name)?.into(),
        _ => arrays.bytes_of(array, name)?,
    };
    let ended = bytes.strip_suffix(b"\0").unwrap_or(&bytes);
    // Of no bytes at all there is no string.
    let all = ended.split(|byte| *byte == 0).take(if bytes.is_empty() { 0 } else { usize::MAX });
    let found: Vec<T> = all.take(usize::try_from(count).unwrap_or(usize::MAX)).map(each).collect();
    if (found.len() as u64) < count {
        let (location, there) = (arrays.location(array), found.len() as u64);
        return Err(VtkError::Count { location, what: name.to_owned(), declared: count, there });
    }
    Ok(found)
}

/// The letters that the numbers of a text are.
fn letters(mut text: Text, name: &str) -> Result<Vec<u8>, VtkError> {
    let mut letters = Vec::new();
    while let Some(word) = text.word() {
        // Some writers take them for signed numbers.
        let letter = whole(word).filter(|number| (-128..256).contains(number));
        letters.push(letter.ok_or_else(|| text.syntax(format!("\"{}\" is no letter of {name}", escape(word))))? as u8);
    }
    Ok(letters)
}

/// The names of numbers in planish's own files: arrays of the whole file, each called like a label, with its tag and the
/// dimension of a surface.
fn names<'a>(arrays: &mut Arrays<'a>, file: &Outline<'a>) -> Result<HashMap<i64, String>, VtkError> {
    let mut names = HashMap::new();
    let is_whole = |named: &&Named| named.array.as_ref().is_ok_and(|array| !array.scalar.is_float());
    let could_be = file.of_file.iter().filter(|named| !named.is_strings && named.components() == 1);
    for named in could_be.filter(is_whole) {
        if let [tag, SURFACE] = tags(arrays, named)?[..] {
            names.insert(tag, named.name.clone());
        }
    }
    Ok(names)
}

/// All numbers of an array.
fn tags<'a>(arrays: &mut Arrays<'a>, named: &Named<'a>) -> Result<Vec<i64>, VtkError> {
    let array = named.array.as_ref().map_err(Clone::clone)?;
    let name = Role::values_of(&named.name);
    // What is too large for a tag has no name.
    let tag = |number: i128| i64::try_from(number).unwrap_or(i64::MAX);
    if let Data::Ascii(bytes, at) = array.data {
        let count = (Text { bytes, at }).words();
        return Text { bytes, at }.values(&name, count, |word| whole(word).map(tag));
    }
    let bytes = arrays.bytes_of(array, &name)?;
    Ok(array.scalar.whole(&bytes, arrays.order(), tag))
}
