//! Sizes from an array of points of a legacy file.

use super::attributes::Attributes;
use super::error::{VtkError, escape};
use super::legacy_arrays::{Arrays, Kind, Stored};
use super::scalar::Order;
use crate::formats::ReadError;
use crate::formats::point_sizes::{self, PointSizes, SizeError};
use crate::formats::words::float;

/// The values of the array that is asked for, of so many points.
///
/// # Errors
/// It is not there, or cannot be read.
pub(super) fn sizes(
    file: &mut Arrays,
    attributes: &Attributes,
    asked: &str,
    points: u64,
) -> Result<PointSizes, ReadError> {
    let Some((_, array)) = attributes.sizes().find(|(name, _)| name == asked) else {
        // It may stand behind the damage.
        let broken = attributes.broken.clone().map(ReadError::from);
        return Err(broken.unwrap_or_else(|| missing(attributes, asked).into()));
    };
    point_sizes::expect_one_component(asked, array.components)?;
    Ok(PointSizes { array: asked.to_owned(), values: values(file, array, points)? })
}

/// The refusal of an array that is not there.
fn missing(attributes: &Attributes, asked: &str) -> SizeError {
    let usable = attributes.sizes().filter(|(_, array)| array.components == 1);
    SizeError::missing(usable.map(|(name, _)| name.as_str()), asked)
}

/// The values of an array of numbers.
fn values(file: &mut Arrays, array: &Stored, points: u64) -> Result<Vec<f64>, VtkError> {
    file.text.at = array.at;
    let what = &format!("\"{}\"", escape(array.name));
    if array.tuples != points {
        return Err(file.syntax(format!("the array {what} has {} values for {points} points", array.tuples)));
    }
    match array.kind {
        Kind::Number(scalar) if file.binary => {
            let bytes = file.bytes(what, points, scalar.bytes())?;
            Ok(scalar.numbers(bytes, Order::Big))
        }
        _ => file.text.values(what, points, float),
    }
}
