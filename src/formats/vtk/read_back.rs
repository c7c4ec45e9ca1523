//! Reads back the surface.vtu and param.vtu of a result. They may have been changed by anyone since planish wrote them, so
//! they are read as an input is, and nothing is taken for granted.

use super::cell;
use super::scalar::{Order, Scalar};
use super::vtu::{Grid, Shape, VtuError};
use super::xml::Arrays;
use super::xml_outline::outline;
use super::xml_parts::{Field, Piece, Role, Section, Wanted};
use crate::formats::{Limits, Source};
use planish_core::measure::distortion::CellFields;

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

/// The types of indices: of 32 bits where these suffice; unsigned in files of earlier versions. What is negative is too large
/// for an index, read as unsigned.
const INDICES: [Scalar; 3] = [Scalar::I32, Scalar::I64, Scalar::U64];

/// The field that tells the charts of a surface.
const CHART: [Field; 1] = [Field::OfCells("chart")];

/// The field that tells labels.
const LABEL: [Field; 1] = [Field::OfCells("label")];

/// Reads a file that planish wrote.
///
/// # Errors
/// [`VtuError`], if anyone changed the file into one that planish would not write.
pub fn read(bytes: &[u8]) -> Result<Grid, VtuError> {
    columns(bytes, &FIELDS, |columns| columns.grid())
}

/// Reads the surface of a file that planish wrote, and leaves its other fields packed.
///
/// # Errors
/// As [`read`].
pub fn read_shape(bytes: &[u8]) -> Result<Shape, VtuError> {
    columns(bytes, &CHART, |columns| columns.shape())
}

/// The tag of the label of each cell of a file that planish wrote; none where the surface has no labels.
///
/// # Errors
/// As [`read`].
pub fn read_labels(bytes: &[u8]) -> Result<Option<Vec<i32>>, VtuError> {
    columns(bytes, &LABEL, |columns| columns.labels())
}

fn columns<T>(
    bytes: &[u8],
    fields: &'static [Field],
    take: impl FnOnce(&mut Columns) -> Result<T, VtuError>,
) -> Result<T, VtuError> {
    if !bytes.starts_with(HEAD.as_bytes()) {
        return Err(VtuError::Content("the header"));
    }
    let limits = Limits::default();
    let source = Source::alone(bytes, &limits);
    let file = outline(bytes, limits.depth, Wanted::Fields(fields))?;
    let [piece] = &file.pieces[..] else { return Err(VtuError::Content("Piece")) };
    if piece.twice.is_some() {
        return Err(VtuError::Content("an array"));
    }
    take(&mut Columns { arrays: Arrays::new(&source, &file), piece })
}

/// The arrays of the only piece of a file.
struct Columns<'a, 'p> {
    arrays: Arrays<'a>,
    piece: &'p Piece<'a>,
}

impl Columns<'_, '_> {
    fn labels(&mut self) -> Result<Option<Vec<i32>>, VtuError> {
        let field = LABEL[0];
        if self.piece.array(Role::Field(field)).is_none() {
            return Ok(None);
        }
        self.integers(field, "label", self.piece.cells[0]).map(Some)
    }

    fn grid(&mut self) -> Result<Grid, VtuError> {
        let (n, m) = (self.piece.points, self.piece.cells[0]);
        let Shape { points, cells, chart } = self.shape()?;
        let uv = self.doubles::<2>(Role::Field(Field::OfPoints("uv")), "uv", n)?;
        let vertex = self.integers(Field::OfPoints("vertex"), "vertex", n)?;
        let triangle = self.integers(Field::OfCells("triangle"), "triangle", m)?;
        Ok(Grid { points, cells, uv, vertex, chart, triangle, fields: self.fields(m)? })
    }

    fn shape(&mut self) -> Result<Shape, VtuError> {
        let (n, m) = (self.piece.points, self.piece.cells[0]);
        let points = self.doubles::<3>(Role::Points, "Points", n)?;
        let chart = self.integers(Field::OfCells("chart"), "chart", m)?;
        Ok(Shape { points, cells: self.cells(n, m)?, chart })
    }

    /// The nodes of the cells, all of which must be 6-node triangles of existing points.
    fn cells(&mut self, points: u64, count: u64) -> Result<Vec<[u32; 6]>, VtuError> {
        let types = self.numbers(Role::Types, "Cells", &[Scalar::U8], count, |bytes| bytes[0])?;
        let ends = self.numbers(Role::Offsets(Section::Cells), "Cells", &INDICES, count, whole)?;
        let are_sixes = ends.into_iter().zip(1..).all(|(end, i)| end == 6 * i);
        let are_quadratic = types.into_iter().all(|kind| kind == cell::QUADRATIC_TRIANGLE);
        let Some(all) = count.checked_mul(6).filter(|_| are_sixes && are_quadratic) else {
            return Err(VtuError::Content("Cells"));
        };
        let nodes = self.numbers(Role::Connectivity(Section::Cells), "Cells", &INDICES, all, |n| node(whole(n)))?;
        if nodes.iter().any(|node| u64::from(*node) >= points) {
            return Err(VtuError::Content("Cells"));
        }
        Ok(nodes.as_chunks().0.to_vec())
    }

    fn fields(&mut self, count: u64) -> Result<Vec<CellFields>, VtuError> {
        let mut field = |name| {
            let floats = [Scalar::F32, Scalar::F64];
            self.numbers(Role::Field(Field::OfCells(name)), name, &floats, count, float)
        };
        let min = field("det_min")?;
        let max = field("det_max")?;
        let ratio = field("jacobian_ratio")?;
        let distortion = field("conformal_distortion")?;
        let scale = field("area_scale")?;
        // Each has `count` numbers: `numbers` gives no other count.
        let mut fields = Vec::with_capacity(min.len());
        for i in 0..min.len() {
            fields.push(CellFields {
                det_min: min[i],
                det_max: max[i],
                jacobian_ratio: ratio[i],
                conformal_distortion: distortion[i],
                area_scale: scale[i],
            });
        }
        Ok(fields)
    }

    fn doubles<const N: usize>(
        &mut self,
        role: Role,
        name: &'static str,
        count: u64,
    ) -> Result<Vec<[f64; N]>, VtuError> {
        let numbers = count.checked_mul(N as u64).ok_or(VtuError::Content(name))?;
        let numbers = self.numbers(role, name, &[Scalar::F64], numbers, float)?;
        Ok(numbers.as_chunks().0.to_vec())
    }

    fn integers(&mut self, field: Field, name: &'static str, count: u64) -> Result<Vec<i32>, VtuError> {
        self.numbers(Role::Field(field), name, &[Scalar::I32], count, |bytes| whole(bytes) as i32)
    }

    /// Exactly so many numbers of one of these types, each made of its bytes by `number`.
    fn numbers<T>(
        &mut self,
        role: Role,
        name: &'static str,
        scalars: &[Scalar],
        count: u64,
        number: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, VtuError> {
        let array =
            self.piece.array(role).filter(|array| scalars.contains(&array.scalar)).ok_or(VtuError::Content(name))?;
        let bytes = self.arrays.bytes_of(&array, name)?;
        let numbers = bytes.chunks_exact(array.scalar.size());
        if !numbers.remainder().is_empty() || numbers.len() as u64 != count {
            return Err(VtuError::Content(name));
        }
        Ok(numbers.map(number).collect())
    }
}

/// A whole number, as unsigned.
fn whole(bytes: &[u8]) -> u64 {
    Order::Little.whole(bytes)
}

/// A float or a double.
fn float(bytes: &[u8]) -> f64 {
    match bytes.len() {
        4 => f64::from(f32::from_bits(whole(bytes) as u32)),
        _ => f64::from_bits(whole(bytes)),
    }
}

/// What is no node is the largest number: a file has fewer points.
fn node(number: u64) -> u32 {
    u32::try_from(number).unwrap_or(u32::MAX)
}
