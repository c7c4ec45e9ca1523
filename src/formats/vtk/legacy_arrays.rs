//! The arrays of a legacy file: numbers in text, or big-endian.

use super::error::{Location, VtkError, escape};
use super::scalar::{Order, Scalar};
use super::text::Text;
use planish_core::vec3::Vec3;

/// Corners of cells one after the other, and where each ends.
type CornersAndEnds = (Vec<u32>, Vec<u32>);

/// A legacy file, read from its front.
pub(super) struct Arrays<'a> {
    pub text: Text<'a>,
    /// Whether arrays are binary.
    pub binary: bool,
}

/// The type of an array of data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Number(Scalar),
    /// Eight to a byte.
    Bit,
    /// Each after its length in binary files, on a line of its own in others.
    String,
    /// Always on a line of its own.
    Variant,
}

impl<'a> Arrays<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { text: Text { bytes, at: 0 }, binary: false }
    }

    /// Where the file is read.
    pub fn location(&self) -> Location {
        self.place_at(self.text.at)
    }

    /// The place of a byte. Binary arrays hold bytes that look like ends of lines.
    pub fn place_at(&self, at: usize) -> Location {
        if self.binary { Location::Byte(at) } else { Location::line_of(self.text.bytes, at) }
    }

    /// The next keyword, in upper case, after what is told about the array before it.
    pub fn keyword(&mut self) -> Option<Vec<u8>> {
        self.name().map(<[u8]>::to_ascii_uppercase)
    }

    /// The next word, after what is told about the array before it.
    pub fn name(&mut self) -> Option<&'a [u8]> {
        while let Some(word) = self.text.word() {
            if !word.eq_ignore_ascii_case(b"METADATA") {
                return Some(word);
            }
            // It ends with an empty line.
            self.text.line();
            while self.text.line().is_some_and(|line| !line.trim_ascii().is_empty()) {}
        }
        None
    }

    /// The error that the file ends before this.
    pub fn ends(&self, before: &str) -> VtkError {
        self.syntax(format!("the file ends before {before}: it was cut off"))
    }

    /// The error that another keyword is expected here.
    pub fn unexpected(&self, word: &[u8], expected: &str) -> VtkError {
        self.syntax(format!("unexpected \"{}\" where {expected} may stand", escape(word)))
    }

    /// The error that something makes no sense here.
    pub fn syntax(&self, problem: String) -> VtkError {
        VtkError::Syntax { location: self.location(), problem }
    }

    /// A number of elements.
    pub fn count(&mut self, what: &str) -> Result<u64, VtkError> {
        let Some(word) = self.text.word() else { return Err(self.ends(&format!("the number of {what}"))) };
        let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        number.ok_or_else(|| self.syntax(format!("\"{}\" is no number of {what}", escape(word))))
    }

    /// A type, and the rest of its line.
    pub fn kind(&mut self, what: &str) -> Result<Kind, VtkError> {
        let kind = self.kind_in_line(what)?;
        self.end_of_line();
        Ok(kind)
    }

    /// A type, which may not be the last word of its line.
    pub fn kind_in_line(&mut self, what: &str) -> Result<Kind, VtkError> {
        let Some(word) = self.text.word() else { return Err(self.ends(&format!("the type of {what}"))) };
        let kind = match word.to_ascii_lowercase().as_slice() {
            b"bit" => Some(Kind::Bit),
            b"string" | b"utf8_string" => Some(Kind::String),
            b"variant" => Some(Kind::Variant),
            other => Scalar::legacy(other).map(Kind::Number),
        };
        kind.ok_or_else(|| self.syntax(format!("\"{}\" is no type of {what}", escape(word))))
    }

    fn number_kind(&mut self, what: &str) -> Result<Scalar, VtkError> {
        match self.kind(what)? {
            Kind::Number(scalar) => Ok(scalar),
            _ => Err(self.syntax(format!("{what} are no numbers"))),
        }
    }

    /// Binary numbers begin after the end of the line.
    pub fn end_of_line(&mut self) {
        if self.binary {
            self.text.line();
        }
    }

    /// The bytes of so many elements of a size.
    pub fn bytes(&mut self, what: &str, count: u64, size: u64) -> Result<&'a [u8], VtkError> {
        let rest = self.text.rest();
        let there = rest.len() as u64 / size;
        if count > there {
            return Err(VtkError::Count { location: self.location(), what: what.to_owned(), declared: count, there });
        }
        let taken = &rest[..(count * size) as usize];
        self.text.at += taken.len();
        Ok(taken)
    }

    /// Points: their number, of at most `most`, type and coordinates.
    pub fn points(&mut self, most: u64) -> Result<Vec<Vec3>, VtkError> {
        let at = self.text.at;
        let count = self.count("points")?;
        let scalar = self.number_kind("coordinates")?;
        if count > most {
            return Err(VtkError::TooLarge {
                location: self.place_at(at),
                what: "points",
                declared: count,
                limit: most,
            });
        }
        if !self.binary {
            return self.text.points("POINTS", count);
        }
        let bytes = self.bytes("POINTS", count.saturating_mul(3), scalar.bytes())?;
        Ok(scalar.points(bytes, Order::Big))
    }

    fn ids(&mut self, what: &str, count: u64, scalar: Scalar) -> Result<Vec<u32>, VtkError> {
        if !self.binary {
            return self.text.ids(what, count);
        }
        let start = self.text.at;
        let bytes = self.bytes(what, count, scalar.bytes())?;
        scalar.ids(bytes, Order::Big).map_err(|bad| {
            let location = Location::Byte(start + bad.entry * scalar.size());
            VtkError::Syntax { location, problem: format!("{what} hold the number {}, which is no id", bad.value) }
        })
    }

    /// The types of cells: their number, and the type of each.
    pub fn types(&mut self) -> Result<Vec<u8>, VtkError> {
        let count = self.count("cells")?;
        self.end_of_line();
        let types = self.ids("CELL_TYPES", count, Scalar::I32)?;
        // What does not fit is no type that VTK has; neither is 255.
        Ok(types.into_iter().map(|t| u8::try_from(t).unwrap_or(u8::MAX)).collect())
    }

    /// Cells: the corners of one after the other, and where each ends.
    pub fn cells(&mut self, section: &str) -> Result<CornersAndEnds, VtkError> {
        let at = self.text.at;
        let (count, size) = (self.count("cells")?, self.count("corners")?);
        self.end_of_line();
        if !self.binary {
            self.text.blanks();
        }
        // From version 5 on. In the older layout the first number is a count of corners, never this word.
        if self.text.rest().get(..7).is_some_and(|word| word.eq_ignore_ascii_case(b"OFFSETS")) {
            return self.with_offsets(section, count, size);
        }
        let list = self.ids(section, size, Scalar::I32)?;
        split(&list, count).ok_or_else(|| {
            let problem = format!("{section}: {size} numbers are not those of {count} cells with the count of each");
            VtkError::Syntax { location: self.place_at(at), problem }
        })
    }

    /// Cells of the layout from version 5 on.
    fn with_offsets(&mut self, section: &str, offsets: u64, corners: u64) -> Result<CornersAndEnds, VtkError> {
        let starts = self.named("OFFSETS", section, offsets)?;
        let corners = self.named("CONNECTIVITY", section, corners)?;
        let ends = starts.get(1..).unwrap_or_default();
        let last = ends.last().copied().unwrap_or_default() as usize;
        if starts.first().is_some_and(|first| *first != 0) || last != corners.len() {
            let problem =
                format!("the offsets of {section} do not lead from 0 to {}, the number of corners", corners.len());
            return Err(self.syntax(problem));
        }
        Ok((corners, ends.to_vec()))
    }

    fn named(&mut self, name: &str, section: &str, count: u64) -> Result<Vec<u32>, VtkError> {
        match self.keyword() {
            Some(word) if word == name.as_bytes() => {}
            Some(other) => return Err(self.unexpected(&other, name)),
            None => return Err(self.ends(name)),
        }
        let what = format!("{name} of {section}");
        let scalar = self.number_kind(&what)?;
        self.ids(&what, count, scalar)
    }

    /// Passes over a field, and tells its arrays.
    pub fn field(&mut self, mut tell: impl FnMut(Stored<'a>)) -> Result<(), VtkError> {
        self.text.word();
        let arrays = self.count("arrays")?;
        for _ in 0..arrays {
            let Some(name) = self.name() else { return Err(self.ends("an array of FIELD")) };
            if name.eq_ignore_ascii_case(b"NULL_ARRAY") {
                continue;
            }
            let (components, tuples) = (self.count("components")?, self.count("tuples")?);
            let kind = self.kind("an array of FIELD")?;
            let array = Stored { name, kind, components, tuples, at: self.text.at, is_colour: false };
            self.skip(&array, "FIELD")?;
            tell(array);
        }
        Ok(())
    }

    /// Passes over the values of an array, of a section.
    pub fn skip(&mut self, array: &Stored, section: &str) -> Result<(), VtkError> {
        let what = &format!("an array of {section}");
        let end = format!("the end of {section}");
        let count = array.components.saturating_mul(array.tuples);
        match array.kind {
            Kind::Number(scalar) if self.binary => self.bytes(what, count, scalar.bytes()).map(|_| ()),
            Kind::Bit if self.binary => self.bytes(what, count.div_ceil(8), 1).map(|_| ()),
            Kind::Number(_) | Kind::Bit => {
                self.text.expect(what, count)?;
                (0..count).try_for_each(|_| self.text.word().map(|_| ()).ok_or_else(|| self.ends(&end)))
            }
            Kind::String | Kind::Variant => {
                self.begin_strings();
                (0..count).try_for_each(|_| self.string(array.kind, section).map(|_| ()))
            }
        }
    }

    /// Strings of text begin on the line behind their type.
    pub fn begin_strings(&mut self) {
        if !self.binary {
            self.text.line();
        }
    }

    /// The next string, or variant.
    pub fn string(&mut self, kind: Kind, section: &str) -> Result<&'a [u8], VtkError> {
        if self.binary && kind == Kind::String {
            return self.binary_string(section);
        }
        self.text.line().ok_or_else(|| self.ends(&format!("the end of {section}")))
    }

    /// A binary string begins with its length, whose first two bits tell how many bytes the length has.
    fn binary_string(&mut self, section: &str) -> Result<&'a [u8], VtkError> {
        let what = &format!("a string of {section}");
        let first = self.text.rest().first().copied().ok_or_else(|| self.ends(what))?;
        let size = 8 >> (first >> 6);
        let length = self.bytes(what, 1, size)?.iter().fold(0_u64, |n, b| n << 8 | u64::from(*b));
        // Without the first two bits.
        let mask = u64::MAX >> (64 - 8 * size + 2);
        self.bytes(what, length & mask, 1)
    }
}

/// An array of data, as it is declared, and where its values begin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stored<'a> {
    /// As it is written.
    pub name: &'a [u8],
    pub kind: Kind,
    pub components: u64,
    pub tuples: u64,
    /// Behind the type.
    pub at: usize,
    /// Whether it holds colours: in text these are parts of one, whatever their type.
    pub is_colour: bool,
}

/// The layout before version 5: the number of corners of each cell before them.
fn split(list: &[u32], cells: u64) -> Option<CornersAndEnds> {
    let cells = usize::try_from(cells).ok().filter(|n| *n <= list.len())?;
    let (mut corners, mut ends) = (Vec::with_capacity(list.len() - cells), Vec::with_capacity(cells));
    let mut rest = list;
    for _ in 0..cells {
        let (count, others) = rest.split_first()?;
        let (cell, others) = others.split_at_checked(*count as usize)?;
        match cell {
            // Known lengths are copied faster.
            [a, b, c] => corners.extend([*a, *b, *c]),
            [a, b, c, d] => corners.extend([*a, *b, *c, *d]),
            _ => corners.extend_from_slice(cell),
        }
        ends.push(u32::try_from(corners.len()).ok()?);
        rest = others;
    }
    rest.is_empty().then_some((corners, ends))
}
