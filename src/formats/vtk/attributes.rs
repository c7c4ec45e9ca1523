//! What follows the geometry in a legacy file: `POINT_DATA` and `CELL_DATA`, of which one array of cells labels triangles, one
//! of points tells sizes, if it is asked for, and all that hold numbers are fields.
//!
//! All arrays are passed over first: what is wrong behind them matters to those only that stand there.

use super::cell_labels::{self, Candidate, CellLabels, PieceCells, Values};
use super::error::{VtkError, escape};
use super::legacy_arrays::{Arrays, Kind, Stored};
use super::scalar::{Order, Scalar};
use super::text::whole;
use crate::formats::labels::Labels;
use crate::formats::words::float;
use crate::formats::{LabelSource, Notes, ReadError};
use std::collections::HashMap;

/// Arrays of numbers and words, with their names, as they stand in a file.
type Named<'a> = Vec<(String, Stored<'a>)>;

/// The arrays behind the geometry of a file, up to its end, or to what cannot be read.
#[derive(Default)]
pub(super) struct Attributes<'a> {
    /// Those of cells.
    pub of_cells: Named<'a>,
    /// Those of points.
    pub of_points: Named<'a>,
    /// Why what follows cannot be read.
    pub broken: Option<VtkError>,
}

impl<'a> Attributes<'a> {
    /// Passes over all that is left of a file.
    pub fn of(file: &mut Arrays<'a>) -> Self {
        let mut scan = Scan { file, of: None, found: Self::default() };
        let broken = scan.all().err();
        Self { broken, ..scan.found }
    }

    /// The labels of the triangles of these cells.
    ///
    /// # Errors
    /// What is asked for is not there, or cannot be read.
    pub fn labels(
        &self,
        file: &mut Arrays,
        cells: &PieceCells,
        source: &LabelSource,
        notes: &mut Notes,
    ) -> Result<Labels, ReadError> {
        match self.found(file, cells, source, notes) {
            Ok(labels) => Ok(labels),
            Err(error @ ReadError::Label(_)) => Err(error),
            Err(error) => cell_labels::damaged(error, source, notes).map(|()| Labels::new(source)),
        }
    }

    fn found(
        &self,
        file: &mut Arrays,
        cells: &PieceCells,
        source: &LabelSource,
        notes: &mut Notes,
    ) -> Result<Labels, ReadError> {
        let arrays = || self.of_cells.iter().filter(|(_, array)| is_label(array));
        let candidates = arrays().map(|(name, array)| Candidate { name, is_float: is_float(array.kind) });
        let chosen = cell_labels::chosen(candidates, source);
        // What stands before the damage can be relied on.
        let chosen = match (&self.broken, chosen) {
            (None, chosen) => chosen?,
            (Some(_), Ok(Some(array))) if *source != LabelSource::Usual => Some(array),
            (Some(broken), chosen) => {
                cell_labels::damaged(broken.clone().into(), source, notes)?;
                chosen.unwrap_or_default()
            }
        };
        let Some((name, array)) = arrays().find(|(name, _)| Some(name.as_str()) == chosen) else {
            return Ok(Labels::new(source));
        };
        let mut labels = CellLabels::new(source, name, HashMap::new());
        let values = values(file, name, array, cells.count(), &mut labels)?;
        labels.piece(cells, Some(&values))?;
        Ok(labels.finish())
    }

    /// Those of points that could tell sizes: numbers, of any number of components.
    pub fn sizes(&self) -> impl Iterator<Item = &(String, Stored<'a>)> {
        self.of_points.iter().filter(|(_, array)| matches!(array.kind, Kind::Number(_)) && !array.is_colour)
    }

    /// Keeps an array of points or cells.
    fn keep(&mut self, of: Option<Owner>, array: Stored<'a>) {
        let Some(of) = of else { return };
        let arrays = if of.is_cells { &mut self.of_cells } else { &mut self.of_points };
        arrays.push((decoded(array.name), array));
    }
}

/// Whether an array of cells could label them.
fn is_label(array: &Stored) -> bool {
    array.components == 1 && array.kind != Kind::Variant && !array.is_colour
}

fn is_float(kind: Kind) -> bool {
    matches!(kind, Kind::Number(scalar) if scalar.is_float())
}

/// The attributes of a file, as they come.
struct Scan<'f, 'a> {
    file: &'f mut Arrays<'a>,
    /// What the arrays at hand belong to, and how many of these there are.
    of: Option<Owner>,
    found: Attributes<'a>,
}

/// What arrays belong to.
#[derive(Clone, Copy)]
struct Owner {
    is_cells: bool,
    count: u64,
}

impl<'a> Scan<'_, 'a> {
    /// Passes over all that is left of the file.
    fn all(&mut self) -> Result<(), VtkError> {
        while let Some(keyword) = self.file.keyword() {
            match keyword.as_slice() {
                b"POINT_DATA" => self.of = Some(Owner { is_cells: false, count: self.file.count("points")? }),
                b"CELL_DATA" => self.of = Some(Owner { is_cells: true, count: self.file.count("cells")? }),
                b"FIELD" => self.field()?,
                b"LOOKUP_TABLE" => self.colours(4)?,
                other => self.attribute(other)?,
            }
        }
        Ok(())
    }

    fn field(&mut self) -> Result<(), VtkError> {
        let (found, of) = (&mut self.found, self.of);
        self.file.field(|array| found.keep(of, array))
    }

    /// How many values an array has: as many as there are points or cells.
    fn tuples(&self) -> Result<u64, VtkError> {
        let before = || self.file.syntax("an array stands before POINT_DATA and CELL_DATA".to_owned());
        self.of.map(|of| of.count).ok_or_else(before)
    }

    /// The next word, of an attribute.
    fn word(&mut self) -> Result<&'a [u8], VtkError> {
        self.file.text.word().ok_or_else(|| self.file.ends("the name of an array"))
    }

    /// An attribute of a keyword.
    fn attribute(&mut self, keyword: &[u8]) -> Result<(), VtkError> {
        let components = match keyword {
            b"SCALARS" => return self.scalars(),
            b"COLOR_SCALARS" => {
                self.tuples()?;
                return self.colours(1);
            }
            b"VECTORS" | b"NORMALS" => Some(3),
            b"TENSORS" => Some(9),
            b"TENSORS6" => Some(6),
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => Some(1),
            b"TEXTURE_COORDINATES" => None,
            other => return Err(self.file.unexpected(other, "an array of points or cells")),
        };
        let name = self.word()?;
        let components = components.map_or_else(|| self.file.count("coordinates"), Ok)?;
        let kind = self.file.kind("an array")?;
        self.values(name, kind, components)
    }

    /// `SCALARS`, their name, type, and number of components, if it is another than one; then the table that colours them.
    fn scalars(&mut self) -> Result<(), VtkError> {
        let name = self.word()?;
        let kind = self.file.kind_in_line("an array")?;
        if [Kind::String, Kind::Variant].contains(&kind) {
            return Err(self.file.syntax("SCALARS are no numbers".to_owned()));
        }
        let rest = self.file.text.line().unwrap_or_default().trim_ascii();
        let number = std::str::from_utf8(rest).ok().and_then(|rest| rest.parse().ok());
        let components = if rest.is_empty() { Some(1) } else { number };
        let bad = || self.file.syntax(format!("\"{}\" is no number of components", escape(rest)));
        let components = components.ok_or_else(bad)?;
        if !self.file.binary {
            self.file.text.blanks();
        }
        const TABLE: &[u8] = b"LOOKUP_TABLE";
        if self.file.text.rest().get(..TABLE.len()).is_some_and(|word| word.eq_ignore_ascii_case(TABLE)) {
            self.file.text.line();
        }
        self.values(name, kind, components)
    }

    /// Passes over the values of an array.
    fn values(&mut self, name: &'a [u8], kind: Kind, components: u64) -> Result<(), VtkError> {
        let (tuples, at) = (self.tuples()?, self.file.text.at);
        let array = Stored { name, kind, components, tuples, at, is_colour: false };
        self.file.skip(&array, "POINT_DATA and CELL_DATA")?;
        self.found.keep(self.of, array);
        Ok(())
    }

    /// Colours: bytes, or numbers in text. Those of a table are as many as it says, others as many as points or cells.
    fn colours(&mut self, of_table: u64) -> Result<(), VtkError> {
        let name = self.word()?;
        let number = self.file.count("colours")?;
        self.file.end_of_line();
        let is_table = of_table > 1;
        let tuples = if is_table { of_table } else { self.tuples()? };
        let kind = Kind::Number(Scalar::U8);
        let array = Stored { name, kind, components: number, tuples, at: self.file.text.at, is_colour: true };
        self.file.skip(&array, "colours")?;
        if !is_table {
            self.found.keep(self.of, array);
        }
        Ok(())
    }
}

/// The values of an array of so many cells.
fn values(
    file: &mut Arrays,
    name: &str,
    array: &Stored,
    cells: u64,
    labels: &mut CellLabels,
) -> Result<Values, VtkError> {
    file.text.at = array.at;
    let what = &format!("\"{}\"", escape(name.as_bytes()));
    if array.tuples != cells {
        return Err(file.syntax(format!("the array {what} has {} values for {cells} cells", array.tuples)));
    }
    match array.kind {
        Kind::Number(scalar) if file.binary => {
            let bytes = file.bytes(what, cells, scalar.bytes())?;
            Ok(match scalar.is_float() {
                true => Values::Floats(scalar.floats(bytes, Order::Big)),
                false => Values::Labels(scalar.whole(bytes, Order::Big, |number| labels.number(number))),
            })
        }
        Kind::Bit if file.binary => {
            let bytes = file.bytes(what, cells.div_ceil(8), 1)?;
            Ok(Values::Labels((0..cells as usize).map(|cell| labels.number(bit(bytes, cell))).collect()))
        }
        Kind::Number(scalar) if scalar.is_float() => file.text.values(what, cells, float).map(Values::Floats),
        Kind::Number(_) | Kind::Bit => {
            file.text.values(what, cells, |word| whole(word).map(|number| labels.number(number))).map(Values::Labels)
        }
        Kind::String | Kind::Variant => strings(file, array.kind, cells, labels).map(Values::Labels),
    }
}

/// The highest bit of a byte is its first.
pub(super) fn bit(bytes: &[u8], at: usize) -> i128 {
    i128::from(bytes[at / 8] >> (7 - at % 8) & 1)
}

fn strings(file: &mut Arrays, kind: Kind, count: u64, labels: &mut CellLabels) -> Result<Vec<u32>, VtkError> {
    file.begin_strings();
    // Each takes a byte at least.
    let mut all = Vec::new();
    for _ in 0..count {
        let string = file.string(kind, "CELL_DATA")?;
        all.push(if file.binary { labels.word(string) } else { labels.word(decoded(string).as_bytes()) });
    }
    Ok(all)
}

/// A name or string as it was before VTK wrote it into text: blanks and other signs are `%` and two hexadecimal digits.
fn decoded(word: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(word.len());
    let mut rest = word;
    while let Some((first, others)) = rest.split_first() {
        let digits = others.get(..2).filter(|_| *first == b'%').and_then(|digits| std::str::from_utf8(digits).ok());
        match digits.and_then(|digits| u8::from_str_radix(digits, 16).ok()) {
            Some(byte) => {
                bytes.push(byte);
                rest = &others[2..];
            }
            None => {
                bytes.push(*first);
                rest = others;
            }
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
