//! Reads back the surface.vtu and param.vtu of a result. They may have been changed by anyone since planish wrote them, so
//! they are read as an input is, and nothing is taken for granted.

use super::cell;
use super::scalar::Scalar;
use super::vtu::{Grid, VtuError};
use super::xml::Arrays;
use super::xml_outline::{Field, Piece, Role, Section, outline};
use crate::formats::{Limits, Nothing, Source};
use pipeline::distortion::CellFields;

/// How every file of planish's begins; compressors came and went.
const HEAD: &str =
    "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"";

/// The fields that `planish check` looks at.
const FIELDS: [Field; 9] = [
    Field::OfPoints("uv"),
    Field::OfPoints("vertex"),
    Field::OfCells("chart"),
    Field::OfCells("triangle"),
    Field::OfCells("det_min"),
    Field::OfCells("det_max"),
    Field::OfCells("jacobian_ratio"),
    Field::OfCells("conformal_distortion"),
    Field::OfCells("area_scale"),
];

/// Reads a file that planish wrote.
///
/// # Errors
/// [`VtuError`], if anyone changed the file into one that planish would not write.
pub fn read(bytes: &[u8]) -> Result<Grid, VtuError> {
    if !bytes.starts_with(HEAD.as_bytes()) {
        return Err(VtuError::Content("the header"));
    }
    let limits = Limits::default();
    let source = Source { bytes, limits: &limits, beside: &Nothing };
    let file = outline(bytes, limits.depth, &FIELDS)?;
    let [piece] = &file.pieces[..] else { return Err(VtuError::Content("Piece")) };
    if piece.twice.is_some() {
        return Err(VtuError::Content("an array"));
    }
    Columns { arrays: Arrays::new(&source, &file), piece }.grid()
}

/// The arrays of the only piece of a file.
struct Columns<'a, 'p> {
    arrays: Arrays<'a>,
    piece: &'p Piece<'a>,
}

impl Columns<'_, '_> {
    fn grid(mut self) -> Result<Grid, VtuError> {
        let (n, m) = (self.piece.points, self.piece.cells[0]);
        let points = self.doubles::<3>(Role::Points, "Points", n)?;
        let uv = self.doubles::<2>(Role::Field(Field::OfPoints("uv")), "uv", n)?;
        let vertex = self.integers(Field::OfPoints("vertex"), "vertex", n)?;
        let chart = self.integers(Field::OfCells("chart"), "chart", m)?;
        let triangle = self.integers(Field::OfCells("triangle"), "triangle", m)?;
        let fields = self.fields(m)?;
        Ok(Grid { cells: self.cells(n, m)?, points, uv, vertex, chart, triangle, fields })
    }

    /// The nodes of the cells, all of which must be 6-node triangles of existing points.
    fn cells(&mut self, points: u64, count: u64) -> Result<Vec<[u32; 6]>, VtuError> {
        let wrong = || VtuError::Content("Cells");
        let types = self.numbers::<1>(Role::Types, "Cells", Scalar::U8, count)?;
        let ends = self.numbers::<8>(Role::Offsets(Section::Cells), "Cells", Scalar::U64, count)?;
        let all = count.checked_mul(6).ok_or_else(wrong)?;
        let nodes = self.numbers::<8>(Role::Connectivity(Section::Cells), "Cells", Scalar::U64, all)?;
        let sixes = ends.into_iter().zip(1..).all(|(end, i)| u64::from_le_bytes(end) == 6 * i);
        let in_range = |node: [u8; 8]| u32::try_from(u64::from_le_bytes(node)).ok();
        let nodes: Option<Vec<u32>> = nodes.into_iter().map(in_range).collect();
        let nodes = nodes.filter(|nodes| nodes.iter().all(|node| u64::from(*node) < points)).ok_or_else(wrong)?;
        let quadratic = types.iter().all(|[t]| *t == cell::QUADRATIC_TRIANGLE);
        if sixes && quadratic { Ok(nodes.as_chunks().0.to_vec()) } else { Err(wrong()) }
    }

    fn fields(&mut self, count: u64) -> Result<Vec<CellFields>, VtuError> {
        let mut field = |name| self.doubles::<1>(Role::Field(Field::OfCells(name)), name, count);
        let (min, max, ratio) = (field("det_min")?, field("det_max")?, field("jacobian_ratio")?);
        let (distortion, scale) = (field("conformal_distortion")?, field("area_scale")?);
        let all = (0..min.len()).map(|i| CellFields {
            det_min: min[i][0],
            det_max: max[i][0],
            jacobian_ratio: ratio[i][0],
            conformal_distortion: distortion[i][0],
            area_scale: scale[i][0],
        });
        Ok(all.collect())
    }

    fn doubles<const N: usize>(
        &mut self,
        role: Role,
        name: &'static str,
        count: u64,
    ) -> Result<Vec<[f64; N]>, VtuError> {
        let numbers = count.checked_mul(N as u64).ok_or(VtuError::Content(name))?;
        let numbers: Vec<[u8; 8]> = self.numbers(role, name, Scalar::F64, numbers)?;
        Ok(numbers.as_chunks().0.iter().map(|group| group.map(f64::from_le_bytes)).collect())
    }

    fn integers(&mut self, field: Field, name: &'static str, count: u64) -> Result<Vec<i32>, VtuError> {
        let numbers: Vec<[u8; 4]> = self.numbers(Role::Field(field), name, Scalar::I32, count)?;
        Ok(numbers.into_iter().map(i32::from_le_bytes).collect())
    }

    /// The bytes of exactly so many numbers of a type.
    fn numbers<const SIZE: usize>(
        &mut self,
        role: Role,
        name: &'static str,
        scalar: Scalar,
        count: u64,
    ) -> Result<Vec<[u8; SIZE]>, VtuError> {
        let array = self.piece.array(role).filter(|array| array.scalar == scalar).ok_or(VtuError::Content(name))?;
        let bytes = self.arrays.bytes_of(&array, name)?;
        let (numbers, rest) = bytes.as_chunks::<SIZE>();
        let complete = rest.is_empty() && numbers.len() as u64 == count;
        if complete { Ok(numbers.to_vec()) } else { Err(VtuError::Content(name)) }
    }
}
