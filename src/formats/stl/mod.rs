//! STL, ASCII and binary.
//!
//! A file is binary when its size is that of its declared triangles (84 + 50 n bytes), whatever its header says:
//! some binary files begin with "solid". Otherwise it is ASCII when its first word is "solid", in any case and
//! after any blanks, and text follows. ASCII files may hold several solids; all of them are read. Words count, not
//! lines: a facet may stand on one line. What is neither, is no text, and longer than its declared triangles, is binary
//! with something appended, which is told and not read. Text that ends after a facet, without `endsolid`, is read, and that
//! is told; text that ends in a facet is refused.

mod write;

pub use write::made;

use super::finish::{self, BadPoints};
use super::labels::{self, Labels};
use super::location::{Location, escape};
use super::words::{float, foreign_number, no_number};
use super::{Content, Notes, ReadError, Source, TooMany};
use crate::outcome::Code;
use planish_core::vec3::Vec3;

/// Bytes before the triangles of a binary file, and per triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Why bytes are no STL file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum StlError {
    /// Too short to hold a header, and not ASCII.
    #[error(
        "{size} bytes are too few for a binary STL (84 at least), and the file does not begin with \"solid\"; export it again"
    )]
    Short {
        /// Size of the file.
        size: usize,
    },
    /// Text, but not that of STL.
    #[error(
        "the file is text that begins with \"{begins}\", not with \"solid\": it is no STL file, or its first line is missing; export it again"
    )]
    NoSolid {
        /// What it begins with.
        begins: String,
    },
    /// There are fewer bytes than the declared number of triangles takes.
    #[error(
        "the header declares {declared} triangles ({needed} bytes), but the file has {size} bytes, room for {room}; it was cut off or is no STL: copy or export it again"
    )]
    Count {
        /// Triangles declared.
        declared: u32,
        /// Bytes they need.
        needed: u64,
        /// Bytes there are.
        size: usize,
        /// Whole triangles that fit.
        room: usize,
    },
    /// No triangles are declared, but bytes follow.
    #[error(
        "the header declares {declared} triangles ({needed} bytes), but the file has {size} bytes, room for {room}; correct the count at byte 80, or export it again"
    )]
    Excess {
        /// Triangles declared.
        declared: u32,
        /// Bytes they need.
        needed: u64,
        /// Bytes there are.
        size: usize,
        /// Whole triangles that fit.
        room: usize,
    },
    /// There are more triangles than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// A line of an ASCII file makes no sense.
    #[error("line {line}: {problem}; correct it or export the file again, as binary STL if you can")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// An ASCII file ends in the middle.
    #[error("the file ends at line {line} without \"endsolid\": it was cut off; copy or export it again")]
    Truncated {
        /// The last line.
        line: usize,
    },
}

impl StlError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Count { .. } | Self::Excess { .. } => Code::CountMismatch,
            Self::TooMany(_) => Code::TooLarge,
            Self::Short { .. } | Self::NoSolid { .. } => Code::Malformed,
            Self::Syntax { .. } | Self::Truncated { .. } => Code::Malformed,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        Some(match self {
            Self::Short { size } => format!("byte {size}"),
            Self::NoSolid { .. } => "line 1".to_owned(),
            Self::Count { .. } | Self::Excess { .. } => "byte 80".to_owned(),
            Self::TooMany(_) => return None,
            Self::Syntax { line, .. } | Self::Truncated { line } => format!("line {line}"),
        })
    }
}

/// Reads an STL file. The limit of elements holds for its triangles: it has no other points than their corners.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let (bytes, limit) = (source.bytes, source.limits.elements);
    let size = bytes.len() as u64;
    labels::asked(["solid"].into_iter(), source.labels)?;
    let mut labels = Labels::new(source.labels);
    let (facets, notes) = match declared(bytes) {
        Some(declared) if needed(declared) == size => binary_file(bytes, declared, limit)?,
        _ if begins_with_solid(unfilled(bytes)) => {
            let mut notes = Notes::new("STL, ASCII");
            (ascii(unfilled(bytes), limit, &mut notes, &mut labels)?, notes)
        }
        // Some programs append their own data. (Four letters of text would be a count of 7 GB and more.)
        Some(declared @ 1..) if needed(declared) < size => binary_file(bytes, declared, limit)?,
        declared => return Err(mismatch(declared, bytes).into()),
    };
    let triangles = (0..facets.corners.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    finish::content(facets.corners, triangles, labels, notes, &facets.bad)
}

/// The corners of all triangles, three each.
#[derive(Default)]
struct Facets {
    corners: Vec<Vec3>,
    bad: BadPoints,
}

/// Reads the declared triangles of a binary file; what follows them is told.
fn binary_file(bytes: &[u8], declared: u32, limit: u64) -> Result<(Facets, Notes), StlError> {
    TooMany::check("triangles", declared.into(), limit)?;
    let mut notes = Notes::new("STL, binary");
    let (records, rest) = bytes[HEADER..].split_at(needed(declared) as usize - HEADER);
    if !rest.is_empty() {
        let room = rest.len() / RECORD;
        notes.remark(format!(
            "{} bytes follow the {declared} triangles that the header declares (room for {room} more), and were not \
             read; if a part of the surface is missing, correct the count at byte 80, or export the file again",
            rest.len()
        ));
    }
    Ok((binary(records), notes))
}

fn declared(bytes: &[u8]) -> Option<u32> {
    bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes)
}

fn needed(triangles: u32) -> u64 {
    HEADER as u64 + RECORD as u64 * u64::from(triangles)
}

fn mismatch(declared: Option<u32>, bytes: &[u8]) -> StlError {
    let size = bytes.len();
    match declared {
        None => StlError::Short { size },
        // What it would be as a count are four letters.
        Some(_) if is_text(bytes) => StlError::NoSolid { begins: escape(text(bytes)) },
        Some(declared) => {
            let (needed, room) = (needed(declared), (size - HEADER) / RECORD);
            if needed > size as u64 {
                StlError::Count { declared, needed, size, room }
            } else {
                StlError::Excess { declared, needed, size, room }
            }
        }
    }
}

/// Whether a file begins with text.
fn is_text(bytes: &[u8]) -> bool {
    bytes.iter().take(1024).all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace())
}

/// Whether the first word is "solid" and what follows is text: a binary header may begin with the word, too.
fn begins_with_solid(bytes: &[u8]) -> bool {
    let text = text(bytes);
    let word = text.get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
    word && !text.iter().take(1024).any(|b| *b == 0)
}

/// The bytes without what fills the last block of some text files: zeros, or the end of a text of old systems.
fn unfilled(bytes: &[u8]) -> &[u8] {
    let end = bytes.iter().rposition(|b| ![0, 0x1a].contains(b)).map_or(0, |last| last + 1);
    &bytes[..end]
}

/// The bytes without a byte order mark and leading blanks.
fn text(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).trim_ascii_start()
}

/// The corners of all triangles: three vectors of three little-endian floats after each normal.
fn binary(records: &[u8]) -> Facets {
    let mut facets = Facets { corners: Vec::with_capacity(records.len() / RECORD * 3), bad: BadPoints::default() };
    for (triangle, record) in records.chunks_exact(RECORD).enumerate() {
        for corner in record[12..48].chunks_exact(12) {
            let coordinate =
                |k: usize| f32::from_le_bytes([corner[4 * k], corner[4 * k + 1], corner[4 * k + 2], corner[4 * k + 3]]);
            let point = [0, 1, 2].map(|k| f64::from(coordinate(k)));
            facets.bad.check(facets.corners.len(), &point, || Location::Byte(HEADER + RECORD * triangle));
            facets.corners.push(point);
        }
    }
    facets
}

/// The words of a file, each with its line (from 1). Lines end with a line feed, a carriage return, or both.
struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes, line: 1 }
    }

    /// Passes over blanks, counting lines; whether a line ended there.
    fn blanks(&mut self) -> bool {
        let before = self.line;
        while let Some((first, rest)) = self.rest.split_first().filter(|(b, _)| b.is_ascii_whitespace()) {
            let pair = *first == b'\r' && rest.first() == Some(&b'\n');
            self.line += usize::from(*first == b'\n' || (*first == b'\r' && !pair));
            self.rest = rest;
        }
        self.line != before
    }

    /// The next word, in lower case, and whether it begins a line.
    fn next(&mut self) -> Option<(&'a [u8], bool)> {
        let new_line = self.blanks();
        let end = self.rest.iter().position(u8::is_ascii_whitespace).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some((word, new_line))
    }

    /// Passes over the name of a solid: the rest of the line, or what stands before a facet on the same line.
    fn name(&mut self) {
        loop {
            let (rest, line) = (self.rest, self.line);
            let Some((word, new_line)) = self.next() else { return };
            let mut ahead = Self { rest: self.rest, line };
            let facet = is(word, "facet") && ahead.next().is_some_and(|(next, _)| is(next, "normal"));
            if new_line || facet || is(word, "endsolid") {
                (self.rest, self.line) = (rest, line);
                return;
            }
        }
    }
}

fn is(word: &[u8], keyword: &str) -> bool {
    word.eq_ignore_ascii_case(keyword.as_bytes())
}

/// The corners of all triangles of all solids, which are labels.
fn ascii(bytes: &[u8], limit: u64, notes: &mut Notes, labels: &mut Labels) -> Result<Facets, StlError> {
    let mut facets = Facets::default();
    let mut solids = Solids::default();
    let mut words = Words::new(text(bytes));
    words.line += bytes[..bytes.len() - text(bytes).len()].iter().filter(|b| **b == b'\n').count();
    let mut in_solid = false;
    // Corners of the facet at hand; none outside of facets.
    let mut corners: Option<usize> = None;
    let mut ends_with_facet = false;
    while let Some((word, _)) = words.next() {
        let line = words.line;
        let problem = |problem: &str| StlError::Syntax { line, problem: problem.to_owned() };
        match (word.to_ascii_lowercase().as_slice(), corners) {
            (b"solid", None) => {
                (in_solid, ends_with_facet) = (true, false);
                let rest = words.rest;
                words.name();
                let name = String::from_utf8_lossy(&rest[..rest.len() - words.rest.len()]);
                notes.name(&name);
                solids.begin(&name, facets.corners.len() / 3);
            }
            (b"endsolid", None) => {
                in_solid = false;
                words.name();
            }
            (b"facet", None) if in_solid => {
                TooMany::check("triangles", facets.corners.len() as u64 / 3 + 1, limit)?;
                corners = Some(0);
            }
            (b"vertex", Some(n)) if n < 3 => {
                let point = vertex(&mut words)?;
                facets.bad.check(facets.corners.len(), &point, || Location::Line(words.line));
                facets.corners.push(point);
                corners = Some(n + 1);
            }
            (b"vertex", Some(_)) => return Err(problem("a facet has more than three vertices")),
            (b"endfacet", Some(3)) => (corners, ends_with_facet) = (None, true),
            (b"endfacet", Some(n)) => return Err(problem(&format!("a facet ends after {n} vertices"))),
            (b"solid" | b"endsolid" | b"facet", Some(n)) => {
                return Err(problem(&format!("\"{}\" in the middle of a facet ({n} vertices so far)", escape(word))));
            }
            // The normal, "outer loop", "endloop": they say nothing that the corners do not.
            (b"normal" | b"outer" | b"loop" | b"endloop", Some(_)) => {}
            (_, Some(_)) if float(word).is_some() => {}
            (_, Some(_)) if foreign_number(word).is_some() => return Err(problem(&no_number(word))),
            (b"color", _) => words.name(),
            _ => return Err(problem(&format!("unexpected \"{}\"", escape(word)))),
        }
    }
    solids.label(facets.corners.len() / 3, labels);
    let line = words.line;
    if in_solid && !(ends_with_facet && corners.is_none()) {
        return Err(StlError::Truncated { line });
    }
    if in_solid {
        notes.remark(format!(
            "the file ends at line {line} without \"endsolid\", after a complete facet; if a part of the surface is \
             missing, it was cut off: copy or export it again"
        ));
    }
    Ok(facets)
}

/// The solids of a file: their names, and their first triangles.
#[derive(Default)]
struct Solids(Vec<(String, usize)>);

impl Solids {
    fn begin(&mut self, name: &str, triangle: usize) {
        self.0.push((name.trim().to_owned(), triangle));
    }

    /// Labels the triangles, which are so many. Of several solids those without a name are told by their number.
    fn label(self, triangles: usize, labels: &mut Labels) {
        let ends: Vec<usize> = self.0.iter().skip(1).map(|solid| solid.1).chain([triangles]).collect();
        let filled = self.0.iter().zip(&ends).filter(|((_, begin), end)| begin < *end).count();
        for (i, ((name, _), end)) in self.0.iter().zip(ends).enumerate() {
            let label = match name.as_str() {
                "" if filled > 1 => labels.named(&format!("solid_{}", i + 1)),
                name => labels.named(name),
            };
            labels.fill(end, label);
        }
    }
}

/// The three numbers of a vertex; a fourth one is an error.
fn vertex(words: &mut Words) -> Result<[f64; 3], StlError> {
    let mut point = [0.0; 3];
    for c in &mut point {
        let syntax = |line, problem| StlError::Syntax { line, problem };
        let Some((word, _)) = words.next() else {
            return Err(syntax(words.line, "a vertex needs three numbers".to_owned()));
        };
        *c = float(word).ok_or_else(|| syntax(words.line, no_number(word)))?;
    }
    let mut ahead = Words { rest: words.rest, line: words.line };
    match ahead.next() {
        Some((word, _)) if float(word).is_some() => {
            let problem = format!("\"{}\" follows the three numbers of a vertex", escape(word));
            Err(StlError::Syntax { line: ahead.line, problem })
        }
        _ => Ok(point),
    }
}

#[cfg(test)]
mod tests;
