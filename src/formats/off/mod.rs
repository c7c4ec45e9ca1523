//! OFF, the text format of Geomview (`OFF(5)`; <http://www.geomview.org/docs/html/OFF.html>).
//!
//! A keyword, the numbers of vertices, faces and edges, then a line for each vertex and each face. The keyword tells what
//! follows the coordinates of a vertex (`ST` texture, `C` colour, `N` normal), and colours may follow the corners of a
//! face; as files do not keep to it, whatever follows in the line is passed over. Some files have the numbers right behind
//! the keyword (`OFF490 518 0`, in ModelNet), some have no keyword. `#` begins a comment. Homogeneous coordinates (`4OFF`)
//! and other dimensions (`nOFF`) are refused, and so is the binary variant.

use super::finish::{self, BadPoints};
use super::labels::{self, Labels};
use super::location::{Location, escape};
use super::value_error::ValueError;
use super::words::{Uncommented, Words, float, integer, no_number};
use super::{Content, Limits, Notes, ReadError, Source, TooMany, polygon};
use crate::outcome::Code;
use planish_core::vec3::Vec3;

/// Why bytes are no OFF file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum OffError {
    /// It begins with something else.
    #[error(
        "the file begins with \"{begins}\", neither with \"OFF\" nor with numbers: it is no OFF file; export it again"
    )]
    NotOff {
        /// What it begins with.
        begins: String,
    },
    /// A variant that is not read.
    #[error("line {line}: the file is {what}, which planish does not read; {remedy}")]
    Variant {
        /// What it is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
        /// The line, from 1.
        line: usize,
    },
    /// There are fewer bytes than the declared elements take.
    #[error(
        "line {line}: {vertices} vertices and {faces} faces are declared ({needed} bytes at least), but only {left} bytes follow; the file was cut off or the numbers are wrong: copy or export it again"
    )]
    Count {
        /// Vertices declared.
        vertices: u64,
        /// Faces declared.
        faces: u64,
        /// Bytes they need at least.
        needed: u64,
        /// Bytes there are.
        left: u64,
        /// The line of the numbers.
        line: usize,
    },
    /// There are more than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// The file ends in the middle.
    #[error(
        "line {line}: the file ends in {element} {number} (from 0) of {count}; it was cut off or its numbers are wrong (each vertex and each face has a line of its own): copy or export it again"
    )]
    Truncated {
        /// `vertex` or `face`.
        element: &'static str,
        /// Its number, from 0.
        number: u64,
        /// How many are declared.
        count: u64,
        /// The last line.
        line: usize,
    },
    /// A value is not what it should be.
    #[error("line {line}: {problem}, in {element}; correct it or export the file again")]
    Value {
        /// The element, with its number.
        element: String,
        /// What is wrong.
        problem: String,
        /// The line, from 1.
        line: usize,
    },
    /// There is more than was declared.
    #[error(
        "line {line}: \"{begins}\" follows all that is declared; correct the numbers of vertices and faces, or export the file again"
    )]
    Trailing {
        /// What it begins with.
        begins: String,
        /// The line, from 1.
        line: usize,
    },
}

impl OffError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Variant { .. } => Code::UnsupportedFormat,
            Self::Count { .. } | Self::Truncated { .. } | Self::Trailing { .. } => Code::CountMismatch,
            Self::TooMany(_) => Code::TooLarge,
            Self::NotOff { .. } | Self::Value { .. } => Code::Malformed,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        let line = match self {
            Self::NotOff { .. } => 1,
            Self::TooMany(_) => return None,
            Self::Variant { line, .. }
            | Self::Count { line, .. }
            | Self::Truncated { line, .. }
            | Self::Value { line, .. }
            | Self::Trailing { line, .. } => *line,
        };
        Some(Location::Line(line).to_string())
    }
}

/// Whether a word is a keyword of OFF, of a variant that is read or not.
pub(super) fn is_keyword(word: &[u8]) -> bool {
    prefix(word).is_some_and(|(_, rest)| rest.is_empty())
}

/// What stands in a keyword before `OFF`, and what stands behind it in the word.
fn prefix(word: &[u8]) -> Option<(&[u8], &[u8])> {
    // ST, C, N, 4 and n stand before it at most.
    let off = (0..=6).find(|at| word.get(*at..at + 3).is_some_and(|w| w.eq_ignore_ascii_case(b"OFF")))?;
    let rest = &word[off + 3..];
    let mut left = &word[..off];
    for part in [&b"ST"[..], b"C", b"N", b"4", b"n"] {
        left = left.strip_prefix(part).unwrap_or(left);
    }
    (left.is_empty() && rest.iter().all(u8::is_ascii_digit)).then_some((&word[..off], rest))
}

/// How many vertices and faces are declared.
struct Counts {
    vertices: u64,
    faces: u64,
}

/// Reads an OFF file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    // Nothing names parts of the surface.
    labels::asked([].into_iter(), source.labels)?;
    let mut words = Words::new(source.bytes, 1).without_comments();
    let mut notes = Notes::new("OFF");
    let counts = head(&mut words, source.limits)?;
    let mut file = File { words, points: Vec::new(), bad: BadPoints::default(), triangles: Vec::new() };
    file.vertices(counts.vertices)?;
    file.faces(counts.faces, source.limits, &mut notes)?;
    if let Some(word) = file.words.next() {
        return Err(OffError::Trailing { begins: escape(word), line: file.words.line() }.into());
    }
    finish::content(file.points, file.triangles, Labels::new(source.labels), notes, &file.bad)
}

/// Reads the keyword and the numbers of elements.
fn head(words: &mut Uncommented, limits: &Limits) -> Result<Counts, OffError> {
    let begin = *words;
    let first = words.next().unwrap_or_default();
    let counts = match prefix(first) {
        Some((kind, behind)) => {
            refuse_variant(kind, words)?;
            (!behind.is_empty()).then_some(behind)
        }
        None if integer(first).is_some() => {
            *words = begin;
            None
        }
        None => return Err(OffError::NotOff { begins: escape(first) }),
    };
    let vertices = number(counts.or_else(|| words.next()), words)?;
    let faces = number(words.next(), words)?;
    // The number of edges, which may be missing.
    words.skip_line();
    let (left, line) = (words.rest().len() as u64, words.line());
    // Three digits with a blank each; a digit and a blank.
    let needed = vertices.saturating_mul(6).saturating_add(faces.saturating_mul(2)).saturating_sub(1);
    if needed > left {
        return Err(OffError::Count { vertices, faces, needed, left, line });
    }
    TooMany::check("vertices", vertices, limits.elements)?;
    TooMany::check("faces", faces, limits.elements)?;
    Ok(Counts { vertices, faces })
}

fn refuse_variant(kind: &[u8], words: &Uncommented) -> Result<(), OffError> {
    let mut ahead = *words;
    let (what, remedy) = match kind.last() {
        Some(b'4') => ("of four coordinates a vertex (4OFF)", "export it with three"),
        Some(b'n') => ("of another dimension than 3 (nOFF)", "export it with three coordinates a vertex"),
        _ if ahead.next() == Some(b"BINARY") => ("a binary OFF file", "export it as text, or as PLY"),
        _ => return Ok(()),
    };
    Err(OffError::Variant { what, remedy, line: words.line() })
}

/// A number of elements.
fn number(word: Option<&[u8]>, words: &Uncommented) -> Result<u64, OffError> {
    let number = word.and_then(integer).and_then(|n| u64::try_from(n).ok());
    number.ok_or_else(|| {
        let problem = format!("\"{}\" is no number of elements", escape(word.unwrap_or_default()));
        OffError::Value { element: "the numbers of vertices and faces".to_owned(), problem, line: words.line() }
    })
}

/// A file on its way.
struct File<'a> {
    words: Uncommented<'a>,
    points: Vec<Vec3>,
    bad: BadPoints,
    triangles: Vec<[u32; 3]>,
}

/// The refusal of a record in which a value is wrong.
fn refused(error: ValueError, element: &'static str, number: u64, count: u64, line: usize) -> OffError {
    match error {
        ValueError::End => OffError::Truncated { element, number, count, line },
        ValueError::Value(problem) => {
            OffError::Value { element: format!("{element} {number} (from 0)"), problem, line }
        }
    }
}

impl File<'_> {
    fn vertices(&mut self, count: u64) -> Result<(), OffError> {
        // Each takes some bytes, which were counted.
        self.points.reserve_exact(usize::try_from(count).unwrap_or(0));
        for number in 0..count {
            let point = self.vertex().map_err(|fault| refused(fault, "vertex", number, count, self.words.line()))?;
            self.bad.check(self.points.len(), &point, || Location::Line(self.words.line()));
            self.points.push(point);
            self.words.skip_line();
        }
        Ok(())
    }

    fn vertex(&mut self) -> Result<Vec3, ValueError> {
        let mut point = [0.0; 3];
        for c in &mut point {
            let word = self.words.next().ok_or(ValueError::End)?;
            *c = float(word).ok_or_else(|| ValueError::Value(no_number(word)))?;
        }
        Ok(point)
    }

    fn faces(&mut self, count: u64, limits: &Limits, notes: &mut Notes) -> Result<(), OffError> {
        let mut corners = Vec::new();
        for number in 0..count {
            self.corners(&mut corners).map_err(|fault| refused(fault, "face", number, count, self.words.line()))?;
            self.words.skip_line();
            if corners.len() < 3 {
                notes.skip("face with fewer than three corners", 1);
                continue;
            }
            let is_doubtful = polygon::add(&corners, &self.points, &mut self.triangles);
            if corners.len() > 3 {
                notes.polygon(is_doubtful);
            }
            TooMany::check("triangles", self.triangles.len() as u64, limits.elements)?;
        }
        Ok(())
    }

    /// Reads the corners of a face, which are told after their number.
    fn corners(&mut self, corners: &mut Vec<u32>) -> Result<(), ValueError> {
        corners.clear();
        let word = self.words.next().ok_or(ValueError::End)?;
        let count = integer(word).filter(|n| *n >= 0);
        let count = count.ok_or_else(|| ValueError::Value(format!("\"{}\" is no number of corners", escape(word))))?;
        for _ in 0..count {
            let word = self.words.next().ok_or(ValueError::End)?;
            let corner =
                integer(word).and_then(|i| u32::try_from(i).ok()).filter(|i| (*i as usize) < self.points.len());
            corners.push(corner.ok_or_else(|| {
                let points = self.points.len();
                ValueError::Value(format!("\"{}\" is no vertex: there are {points}, counted from 0", escape(word)))
            })?);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
