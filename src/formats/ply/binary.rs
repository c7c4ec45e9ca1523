//! Binary values of a PLY file.

use super::face_labels::Place;
use super::header::{Element, Property, Scalar};
use super::values::{Values, whole};
use crate::formats::location::Location;
use crate::formats::value_error::ValueError;

/// Bytes of values.
#[derive(Clone, Copy)]
pub struct Binary<'a> {
    rest: &'a [u8],
    /// Where they end in the file.
    end: usize,
    big: bool,
}

impl<'a> Binary<'a> {
    /// The values of a file from a byte on.
    pub fn new(file: &'a [u8], begin: usize, big: bool) -> Self {
        Self { rest: &file[begin..], end: file.len(), big }
    }

    fn take(&mut self, bytes: u64) -> Result<&'a [u8], ValueError> {
        let count = usize::try_from(bytes).map_err(|_| ValueError::End)?;
        let (taken, rest) = self.rest.split_at_checked(count).ok_or(ValueError::End)?;
        self.rest = rest;
        Ok(taken)
    }

    /// The next bytes, the lowest first.
    #[inline]
    fn array<const N: usize>(&mut self) -> Result<[u8; N], ValueError> {
        let (array, rest) = self.rest.split_first_chunk().ok_or(ValueError::End)?;
        self.rest = rest;
        Ok(ordered(*array, self.big))
    }

    /// All records of an element without lists.
    pub fn table(&mut self, element: &Element) -> Option<Table<'a>> {
        let stride = element.stride().filter(|s| *s > 0)?;
        let begin = self.end - self.rest.len();
        let bytes = self.take(element.count.checked_mul(stride as u64)?).ok()?;
        Some(Table { bytes, stride, begin, big: self.big })
    }

    /// Gives the corners, and the label at a place, of as many faces as are plain, of at most so many; how many they are.
    pub fn faces(
        &mut self,
        plain: Plain,
        most: u64,
        label: Option<Place>,
        give: impl FnMut(&[u32], Option<f64>),
    ) -> u64 {
        match plain.count {
            1 => self.lists::<1>(plain, most, label, give),
            _ => self.lists::<4>(plain, most, label, give),
        }
    }

    /// The same, for lists after a number of `N` bytes.
    fn lists<const N: usize>(
        &mut self,
        plain: Plain,
        most: u64,
        label: Option<Place>,
        mut give: impl FnMut(&[u32], Option<f64>),
    ) -> u64 {
        let mut found = 0;
        while found < most {
            let record = self.rest;
            let Some(list) = record.get(plain.before..) else { break };
            let Some((count, list)) = list.split_first_chunk::<N>() else { break };
            // The other bytes of a small number are zero.
            let count = ordered(*count, self.big);
            let big = self.big;
            let mut give = |corners: &[u32], behind: &[u8]| {
                let value = |place: Place| value_at(if place.is_behind { behind } else { record }, place, big);
                give(corners, label.map(value));
            };
            let rest = match (count[0], count[1..].iter().all(|b| *b == 0)) {
                (3, true) => plain.corners::<3>(list, big, &mut give),
                (4, true) => plain.corners::<4>(list, big, &mut give),
                _ => None,
            };
            let Some(rest) = rest else { break };
            self.rest = rest;
            found += 1;
        }
        found
    }
}

/// The value at a place of a record that is whole.
#[inline]
fn value_at(bytes: &[u8], place: Place, big: bool) -> f64 {
    let rest = bytes.get(place.offset..).unwrap_or_default();
    Binary { rest, end: 0, big }.float(place.scalar).unwrap_or(f64::NAN)
}

/// Faces with one list of 32-bit indices after a number of one byte or four, and nothing else of unknown size. They are
/// plain if they have three or four corners, all in range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plain {
    before: usize,
    after: usize,
    /// Bytes of the number.
    count: usize,
    /// Points that there are: indices are below.
    points: u32,
}

impl Plain {
    /// Whether the faces of an element can be plain, with their list in a property.
    pub fn new(element: &Element, list: usize, points: usize) -> Option<Self> {
        let property = &element.properties[list];
        let before = size_without_lists(&element.properties[..list])?;
        let after = size_without_lists(&element.properties[list + 1..])?;
        let count = property.count.map(Scalar::size).filter(|size| [1, 4].contains(size))?;
        if ![Scalar::I32, Scalar::U32].contains(&property.scalar) {
            return None;
        }
        // Indices below 2^31 are the same in both types.
        let points = u32::try_from(points.min(i32::MAX as usize)).ok()?;
        Some(Self { before, after, count, points })
    }

    /// Gives the corners at the front of a list, and what stands behind them, if they are in range and the record is whole:
    /// what follows the record.
    #[inline]
    fn corners<'a, const C: usize>(
        self,
        list: &'a [u8],
        big: bool,
        give: &mut impl FnMut(&[u32], &[u8]),
    ) -> Option<&'a [u8]> {
        let (bytes, behind) = list.split_at_checked(4 * C)?;
        let rest = behind.get(self.after..)?;
        let mut corners = [0; C];
        for (corner, bytes) in corners.iter_mut().zip(bytes.as_chunks().0) {
            *corner = u32::from_le_bytes(ordered(*bytes, big));
        }
        if corners.iter().any(|corner| *corner >= self.points) {
            return None;
        }
        give(&corners, behind);
        Some(rest)
    }
}

/// The bytes that these properties take in each record; none where one of them is a list.
pub fn size_without_lists(properties: &[Property]) -> Option<usize> {
    let mut size = 0;
    for property in properties {
        if property.count.is_some() {
            return None;
        }
        size += property.scalar.size();
    }
    Some(size)
}

/// Records of equal size.
pub struct Table<'a> {
    bytes: &'a [u8],
    stride: usize,
    begin: usize,
    big: bool,
}

impl Table<'_> {
    /// Where a record begins in the file.
    pub fn location(&self, record: usize) -> Location {
        Location::Byte(self.begin + record * self.stride)
    }

    /// Three values of each record, at these bytes of it.
    pub fn vectors(&self, columns: [(usize, Scalar); 3]) -> Vec<[f64; 3]> {
        let at = columns.map(|c| c.0);
        match columns.map(|c| c.1) {
            [Scalar::F32, Scalar::F32, Scalar::F32] => self.decode(at, |b| f64::from(f32::from_le_bytes(b))),
            [Scalar::F64, Scalar::F64, Scalar::F64] => self.decode(at, f64::from_le_bytes),
            // Any others, and mixtures: rare, so they may take longer.
            _ => {
                let records = self.bytes.chunks_exact(self.stride);
                records.map(|record| columns.map(|(at, scalar)| self.value(&record[at..], scalar))).collect()
            }
        }
    }

    /// The value at the front of what is left of a record.
    fn value(&self, rest: &[u8], scalar: Scalar) -> f64 {
        let mut value = Binary { rest, end: 0, big: self.big };
        // The record is whole, so there is a value.
        value.float(scalar).unwrap_or(f64::NAN)
    }

    fn decode<const N: usize>(&self, at: [usize; 3], value: impl Fn([u8; N]) -> f64) -> Vec<[f64; 3]> {
        let array = |record: &[u8], at: usize| std::array::from_fn(|i| record[at + i]);
        let records = self.bytes.chunks_exact(self.stride);
        // The order is asked for once, not at every number.
        if self.big {
            records.map(|record| at.map(|at| value(ordered(array(record, at), true)))).collect()
        } else {
            records.map(|record| at.map(|at| value(array(record, at)))).collect()
        }
    }
}

/// Bytes with the lowest first.
#[inline]
fn ordered<const N: usize>(mut bytes: [u8; N], big: bool) -> [u8; N] {
    if big {
        bytes.reverse();
    }
    bytes
}

impl<'a> Values<'a> for Binary<'a> {
    fn location(&self) -> Location {
        Location::Byte(self.end - self.rest.len())
    }

    fn rest(&self) -> &'a [u8] {
        self.rest
    }

    #[inline]
    fn float(&mut self, scalar: Scalar) -> Result<f64, ValueError> {
        match scalar {
            Scalar::F32 => self.array().map(|b| f64::from(f32::from_le_bytes(b))),
            Scalar::F64 => self.array().map(f64::from_le_bytes),
            _ => self.integer(scalar).map(|i| i as f64),
        }
    }

    #[inline]
    fn integer(&mut self, scalar: Scalar) -> Result<i64, ValueError> {
        match scalar {
            Scalar::I8 => self.array().map(|b| i64::from(i8::from_le_bytes(b))),
            Scalar::U8 => self.array().map(|b| i64::from(u8::from_le_bytes(b))),
            Scalar::I16 => self.array().map(|b| i64::from(i16::from_le_bytes(b))),
            Scalar::U16 => self.array().map(|b| i64::from(u16::from_le_bytes(b))),
            Scalar::I32 => self.array().map(|b| i64::from(i32::from_le_bytes(b))),
            Scalar::U32 => self.array().map(|b| i64::from(u32::from_le_bytes(b))),
            Scalar::I64 => self.array().map(i64::from_le_bytes),
            Scalar::U64 => {
                let number = u64::from_le_bytes(self.array()?);
                i64::try_from(number).map_err(|_| ValueError::Value(format!("{number} is too large")))
            }
            Scalar::F32 | Scalar::F64 => self.float(scalar).and_then(whole),
        }
    }

    #[inline]
    fn skip(&mut self, scalar: Scalar, count: u64) -> Result<(), ValueError> {
        let bytes = count.checked_mul(scalar.size() as u64).ok_or(ValueError::End)?;
        self.take(bytes).map(|_| ())
    }

    fn end_record(&mut self) -> Result<(), ValueError> {
        Ok(())
    }

    fn binary(&mut self) -> Option<&mut Binary<'a>> {
        Some(self)
    }
}
