//! The values of an MSH file, as text or binary. The names of sections are text in both.

use super::MshError;
use crate::formats::location::{Location, escape};
use crate::formats::words::{Words, float, remedy};

/// What is wrong in a section.
#[derive(Debug, PartialEq, Eq)]
pub enum SectionError {
    /// The file ends.
    End,
    /// The section ends.
    Short,
    /// A value is not what it should be.
    Value(String),
    /// All is known.
    Told(Box<MshError>),
}

impl From<MshError> for SectionError {
    fn from(error: MshError) -> Self {
        Self::Told(Box::new(error))
    }
}

/// Values, one after the other.
pub trait Values<'a>: Clone {
    /// Bytes that values take at least: of the types int, size_t and double.
    const INT: u64;
    const SIZE: u64;
    const DOUBLE: u64;

    /// Whether they are binary.
    const BINARY: bool;

    /// Where the next value is, or the last one.
    fn location(&self) -> Location;

    /// The place of a record that was read from here on: its line, or its first byte.
    fn location_since(&self, begin: Location) -> Location {
        if Self::BINARY { begin } else { self.location() }
    }

    /// Bytes that are left.
    fn left(&self) -> u64;

    /// The next word of text.
    fn word(&mut self) -> Option<&'a [u8]>;

    /// The next text, which stands between quotes in one line, or is a word.
    fn text(&mut self) -> Option<&'a [u8]>;

    /// Ends a line of text, after which binary values begin.
    fn end_line(&mut self);

    /// The bytes up to the end of a section, which is passed over.
    fn until_end(&mut self, section: &[u8]) -> Option<&'a [u8]>;

    /// The values up to the end of a section, which is passed over.
    fn section(&mut self, section: &[u8]) -> Option<Self>;

    fn int(&mut self) -> Result<i64, SectionError>;

    fn size(&mut self) -> Result<u64, SectionError>;

    fn double(&mut self) -> Result<f64, SectionError>;

    /// Passes over so many values of so many bytes.
    fn skip(&mut self, count: u64, bytes: u64) -> Result<(), SectionError>;

    /// The same, if it is binary, for what can be done at once then.
    fn binary(&mut self) -> Option<&mut Binary<'a>> {
        None
    }

    /// An int that is not negative.
    fn natural(&mut self) -> Result<u64, SectionError> {
        let int = self.int()?;
        u64::try_from(int).map_err(|_| SectionError::Value(format!("{int} is negative")))
    }
}

/// The number that a word of text is.
pub fn number<T: std::str::FromStr>(word: Option<&[u8]>) -> Result<T, SectionError> {
    let word = word.ok_or(SectionError::End)?;
    let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
    number.ok_or_else(|| no_number(word))
}

/// The number that a word of a few digits is, as nearly all are: it fits all types of numbers.
#[inline]
fn digits(word: &[u8]) -> Option<u64> {
    let digit = |sum: u64, byte: &u8| byte.is_ascii_digit().then(|| 10 * sum + u64::from(byte - b'0'));
    if (1..=18).contains(&word.len()) { word.iter().try_fold(0, digit) } else { None }
}

fn no_number(word: &[u8]) -> SectionError {
    if word.starts_with(b"$") {
        return SectionError::Short;
    }
    SectionError::Value(format!("\"{}\" is no number that can stand here{}", escape(word), remedy(word)))
}

/// Where the word that ends a section begins, and where it ends. Some writers of binary files (PyMesh, fTetWild) end no line
/// before it: then it may follow any byte.
fn end_of(rest: &[u8], section: &[u8], is_binary: bool) -> Option<(usize, usize)> {
    let name = [b"$End", section].concat();
    let blank = |at: usize| rest.get(at).is_none_or(u8::is_ascii_whitespace);
    let stands = |at: &usize| {
        rest[*at..].starts_with(&name) && (is_binary || *at == 0 || blank(at - 1)) && blank(at + name.len())
    };
    let at = memchr::memchr_iter(b'$', rest).find(stands)?;
    Some((at, at + name.len()))
}

/// The next text, between quotes in one line or a word, and where it ends.
fn quoted(rest: &[u8]) -> Option<(&[u8], usize)> {
    let begin = rest.iter().position(|byte| !byte.is_ascii_whitespace())?;
    let text = &rest[begin..];
    match text.strip_prefix(b"\"") {
        Some(quoted) => {
            let end = memchr::memchr2(b'"', b'\n', quoted).filter(|end| quoted[*end] == b'"')?;
            Some((&quoted[..end], begin + end + 2))
        }
        None => {
            let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
            Some((&text[..end], begin + end))
        }
    }
}

/// Values as text. Their lines do not matter.
#[derive(Clone)]
pub struct Text<'a>(pub Words<'a>);

impl<'a> Values<'a> for Text<'a> {
    // A digit and a blank.
    const INT: u64 = 2;
    const SIZE: u64 = 2;
    const DOUBLE: u64 = 2;
    const BINARY: bool = false;

    fn location(&self) -> Location {
        Location::Line(self.0.line())
    }

    fn left(&self) -> u64 {
        self.0.rest().len() as u64
    }

    #[inline]
    fn word(&mut self) -> Option<&'a [u8]> {
        self.0.next()
    }

    fn text(&mut self) -> Option<&'a [u8]> {
        let (text, end) = quoted(self.0.rest())?;
        self.0.advance(end);
        Some(text)
    }

    fn end_line(&mut self) {}

    fn until_end(&mut self, section: &[u8]) -> Option<&'a [u8]> {
        let rest = self.0.rest();
        let (at, end) = end_of(rest, section, false)?;
        self.0.advance(end);
        Some(&rest[..at])
    }

    fn section(&mut self, section: &[u8]) -> Option<Self> {
        let line = self.0.line();
        self.until_end(section).map(|text| Self(Words::new(text, line)))
    }

    #[inline]
    fn int(&mut self) -> Result<i64, SectionError> {
        let word = self.word();
        word.and_then(digits).map_or_else(|| number(word), |value| Ok(value as i64))
    }

    #[inline]
    fn size(&mut self) -> Result<u64, SectionError> {
        let word = self.word();
        word.and_then(digits).map_or_else(|| number(word), Ok)
    }

    #[inline]
    fn double(&mut self) -> Result<f64, SectionError> {
        let word = self.word().ok_or(SectionError::End)?;
        float(word).ok_or_else(|| no_number(word))
    }

    fn skip(&mut self, count: u64, _bytes: u64) -> Result<(), SectionError> {
        (0..count).try_for_each(|_| match self.word() {
            Some(word) if word.starts_with(b"$") => Err(SectionError::Short),
            word => word.map(|_| ()).ok_or(SectionError::End),
        })
    }
}

/// Binary values.
#[derive(Clone)]
pub struct Binary<'a> {
    pub file: &'a [u8],
    /// Where the next value is.
    pub at: usize,
    pub big: bool,
}

impl<'a> Binary<'a> {
    fn rest(&self) -> &'a [u8] {
        &self.file[self.at..]
    }

    #[inline]
    fn array<const N: usize>(&mut self) -> Result<[u8; N], SectionError> {
        let mut array: [u8; N] = *self.rest().first_chunk().ok_or(SectionError::End)?;
        self.at += N;
        if self.big {
            array.reverse();
        }
        Ok(array)
    }
}

impl<'a> Values<'a> for Binary<'a> {
    const INT: u64 = 4;
    const SIZE: u64 = 8;
    const DOUBLE: u64 = 8;
    const BINARY: bool = true;

    fn location(&self) -> Location {
        Location::Byte(self.at)
    }

    fn left(&self) -> u64 {
        self.rest().len() as u64
    }

    fn word(&mut self) -> Option<&'a [u8]> {
        let mut words = Words::new(self.rest(), 1);
        let word = words.next();
        self.at = self.file.len() - words.rest().len();
        word
    }

    fn text(&mut self) -> Option<&'a [u8]> {
        let (text, end) = quoted(&self.file[self.at..])?;
        self.at += end;
        Some(text)
    }

    fn end_line(&mut self) {
        let rest = self.rest();
        let end = [&b"\r\n"[..], b"\n"].into_iter().find(|end| rest.starts_with(end));
        self.at += end.map_or(0, <[u8]>::len);
    }

    fn until_end(&mut self, section: &[u8]) -> Option<&'a [u8]> {
        let rest = self.rest();
        let (at, end) = end_of(rest, section, true)?;
        self.at += end;
        Some(&rest[..at])
    }

    fn section(&mut self, section: &[u8]) -> Option<Self> {
        let begin = self.at;
        let bytes = self.until_end(section)?;
        Some(Self { file: &self.file[..begin + bytes.len()], at: begin, big: self.big })
    }

    #[inline]
    fn int(&mut self) -> Result<i64, SectionError> {
        self.array().map(|b| i64::from(i32::from_le_bytes(b)))
    }

    #[inline]
    fn size(&mut self) -> Result<u64, SectionError> {
        self.array().map(u64::from_le_bytes)
    }

    #[inline]
    fn double(&mut self) -> Result<f64, SectionError> {
        self.array().map(f64::from_le_bytes)
    }

    fn binary(&mut self) -> Option<&mut Binary<'a>> {
        Some(self)
    }

    fn skip(&mut self, count: u64, bytes: u64) -> Result<(), SectionError> {
        let size = count.checked_mul(bytes).filter(|size| *size <= self.left()).ok_or(SectionError::End)?;
        // It is no more than what is left of the file.
        self.at += size as usize;
        Ok(())
    }
}
