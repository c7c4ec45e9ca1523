//! Sizes from an array of points of an XML file.

use super::error::VtkError;
use super::text::Text;
use super::xml::Arrays;
use super::xml_parts::{Data, Named, Outline, Role};
use crate::formats::ReadError;
use crate::formats::point_sizes::{self, PointSizes, SizeError};
use crate::formats::words::float;

/// The values of the array that is asked for, piece by piece; those of a piece without it are no numbers.
///
/// # Errors
/// It is not there, or cannot be read.
pub(super) fn sizes<'a>(arrays: &mut Arrays<'a>, file: &Outline<'a>, asked: &str) -> Result<PointSizes, ReadError> {
    if !file.of_points.iter().any(|named| named.name == asked) {
        let usable = file.of_points.iter().filter(|named| named.components() == 1);
        return Err(SizeError::missing(usable.map(|named| named.name.as_str()), asked).into());
    }
    let mut all = Vec::new();
    // Arrays stand in the order of pieces.
    let mut rest = file.of_points.as_slice();
    for (number, piece) in file.pieces.iter().enumerate() {
        let (of_piece, others) = rest.split_at(rest.partition_point(|named| named.owner.piece() <= Some(number)));
        rest = others;
        match of_piece.iter().find(|named| named.name == asked) {
            Some(named) => all.extend(values(arrays, named, piece.points)?),
            None => all.resize(all.len() + piece.points as usize, f64::NAN),
        }
    }
    Ok(PointSizes { array: asked.to_owned(), values: all })
}

/// The values of an array at so many points.
fn values<'a>(arrays: &mut Arrays<'a>, named: &Named<'a>, points: u64) -> Result<Vec<f64>, ReadError> {
    point_sizes::expect_one_component(&named.name, named.components())?;
    Ok(numbers(arrays, named, points)?)
}

fn numbers<'a>(arrays: &mut Arrays<'a>, named: &Named<'a>, count: u64) -> Result<Vec<f64>, VtkError> {
    let array = named.array.as_ref().map_err(Clone::clone)?;
    let name = Role::values_of(&named.name);
    if let Data::Ascii(bytes, at) = array.data {
        return Text { bytes, at }.values(&name, count, float);
    }
    let bytes = arrays.bytes_of(array, &name)?;
    let bytes = arrays.first(array, &name, count, &bytes)?;
    Ok(array.scalar.numbers(bytes, arrays.order()))
}
