//! The values of a PLY file, as text or binary.

use super::binary::Binary;
use super::header::Scalar;
use crate::formats::location::{Location, escape};
use crate::formats::value_error::ValueError;
use crate::formats::words::{Words, float, integer, no_number};

/// Values, one after the other.
pub trait Values<'a>: Copy {
    /// Where the next one is, or the last one.
    fn location(&self) -> Location;

    /// What is left.
    fn rest(&self) -> &'a [u8];

    /// The next value.
    fn float(&mut self, scalar: Scalar) -> Result<f64, ValueError>;

    /// The next value, which must be a whole number, of whatever type.
    fn integer(&mut self, scalar: Scalar) -> Result<i64, ValueError>;

    /// Passes over values.
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), ValueError>;

    /// Ends a record.
    fn end_record(&mut self) -> Result<(), ValueError>;

    /// The same, if it is binary, for what can be done at once then.
    fn binary(&mut self) -> Option<&mut Binary<'a>> {
        None
    }
}

/// A whole number among the floats.
pub fn whole(number: f64) -> Result<i64, ValueError> {
    // Above 2^53 floats do not tell whole numbers apart.
    let fits = number.fract() == 0.0 && number.abs() < 9e15;
    if fits { Ok(number as i64) } else { Err(ValueError::broken(number)) }
}

/// Values as text. A record may go on in the next line, but ends with a line.
#[derive(Clone, Copy)]
pub struct Text<'a>(pub Words<'a>);

impl<'a> Text<'a> {
    #[inline]
    fn word(&mut self) -> Result<&'a [u8], ValueError> {
        self.0.next().ok_or(ValueError::End)
    }
}

fn not_a_number(word: &[u8]) -> ValueError {
    ValueError::Value(no_number(word))
}

impl<'a> Values<'a> for Text<'a> {
    fn location(&self) -> Location {
        Location::Line(self.0.line())
    }

    fn rest(&self) -> &'a [u8] {
        self.0.rest()
    }

    #[inline]
    fn float(&mut self, _: Scalar) -> Result<f64, ValueError> {
        let word = self.word()?;
        float(word).ok_or_else(|| not_a_number(word))
    }

    #[inline]
    fn integer(&mut self, _: Scalar) -> Result<i64, ValueError> {
        let word = self.word()?;
        integer(word).map_or_else(|| whole(float(word).ok_or_else(|| not_a_number(word))?), Ok)
    }

    fn skip(&mut self, _: Scalar, count: u64) -> Result<(), ValueError> {
        (0..count).try_for_each(|_| self.word().map(|_| ()))
    }

    fn end_record(&mut self) -> Result<(), ValueError> {
        match self.0.next_in_line() {
            None => Ok(()),
            Some(word) => Err(ValueError::Value(format!("\"{}\" follows the last of its values", escape(word)))),
        }
    }
}
