//! The text format of MEDIT, `.mesh` (Frey 2001, <https://inria.hal.science/inria-00069921>; today that of libMeshb).
//!
//! `MeshVersionFormatted`, `Dimension`, then sections in any order: a keyword, the number of records, and the records.
//! Vertices count from 1, and each record ends with a reference. Triangles and quadrilaterals are the surface; those of
//! second order are taken by their corners, and their references are labels. Edges and elements of volumes are counted,
//! all other sections are passed over, whatever they hold. In two dimensions z is 0. `#` begins a comment.

mod made;
mod references;
mod sections;
mod write;

pub use made::made;
pub use write::{MeditMesh, solution};

use super::finish::{self, BadPoints};
use super::location::{Location, escape};
use super::words::{Uncommented, Words, float, integer, no_number};
use super::{Content, Limits, Notes, ReadError, Source, TooMany, polygon};
use crate::outcome::Code;
use planish_core::vec3::Vec3;
use references::References;
use sections::{Kind, Section};

/// Why bytes are no file of MEDIT.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum MeditError {
    /// It begins with something else.
    #[error(
        "the file begins with \"{begins}\", not with \"MeshVersionFormatted\": it is no mesh of MEDIT (other programs use .mesh, too); convert it to one of the formats that planish reads"
    )]
    NotMedit {
        /// What it begins with.
        begins: String,
    },
    /// There are fewer bytes than the declared records take.
    #[error(
        "line {line}: section {section} declares {count} records ({needed} bytes at least), but only {left} bytes follow; the file was cut off or the number is wrong: copy or save it again"
    )]
    Count {
        /// The section.
        section: String,
        /// Records declared.
        count: u64,
        /// Bytes they need at least.
        needed: u64,
        /// Bytes there are.
        left: u64,
        /// The line of the number.
        line: usize,
    },
    /// There are more than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// The file ends in the middle.
    #[error(
        "line {line}: the file ends in section {section}; it was cut off or a number in it is wrong: copy or save it again"
    )]
    Truncated {
        /// The section.
        section: String,
        /// The last line.
        line: usize,
    },
    /// A section ends in the middle.
    #[error(
        "line {line}: \"{found}\" stands where section {section} should go on; correct its number of records, or save the file again"
    )]
    Short {
        /// The section.
        section: String,
        /// What stands there.
        found: String,
        /// The line.
        line: usize,
    },
    /// A value is not what it should be.
    #[error("line {line}: {problem}, in section {section}; correct it or save the file again")]
    Value {
        /// The section.
        section: String,
        /// What is wrong.
        problem: String,
        /// The line.
        line: usize,
    },
    /// A section goes on behind its records, or there is no keyword.
    #[error(
        "line {line}: \"{found}\" stands where a keyword should, behind section {section}; correct its number of records, or save the file again"
    )]
    NoKeyword {
        /// The section before.
        section: String,
        /// What stands there.
        found: String,
        /// The line.
        line: usize,
    },
    /// A section is missing, or comes too late.
    #[error("there is no section {0}{1}; save the file again")]
    NoSection(&'static str, &'static str),
    /// There are two sections where there may be one.
    #[error("line {line}: there is another section Vertices; split the file, one mesh in each")]
    SecondSection {
        /// The line.
        line: usize,
    },
}

impl MeditError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Count { .. } | Self::Truncated { .. } => Code::CountMismatch,
            Self::Short { .. } | Self::NoKeyword { .. } => Code::CountMismatch,
            Self::TooMany(_) => Code::TooLarge,
            _ => Code::Malformed,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        let line = match self {
            Self::NotMedit { .. } => 1,
            Self::TooMany(_) | Self::NoSection(..) => return None,
            Self::Count { line, .. }
            | Self::Truncated { line, .. }
            | Self::Short { line, .. }
            | Self::Value { line, .. }
            | Self::NoKeyword { line, .. }
            | Self::SecondSection { line } => *line,
        };
        Some(Location::Line(line).to_string())
    }
}

/// Reads a file of MEDIT.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let mut words = Words::new(source.bytes, 1).without_comments();
    let first = words.next().unwrap_or_default();
    if !first.eq_ignore_ascii_case(b"MeshVersionFormatted") {
        return Err(MeditError::NotMedit { begins: escape(first) }.into());
    }
    let mut file = File::new(source);
    let mut values = Values { words, section: escape(first) };
    values.count()?;
    file.sections(&mut values)?;
    if file.dimension.is_none() {
        return Err(MeditError::NoSection("Dimension", "").into());
    }
    if !file.has_vertices {
        return Err(MeditError::NoSection("Vertices", "").into());
    }
    for (mut values, section) in std::mem::take(&mut file.waiting) {
        file.faces(&mut values, section)?;
    }
    let mut notes = file.notes;
    notes.mid_nodes = file.mid_nodes.iter().filter(|mid| **mid).count();
    let labels = file.references.labels(&mut notes)?;
    finish::content(file.points, file.triangles, labels, notes, &file.bad)
}

/// The words of a section.
#[derive(Clone)]
struct Values<'a> {
    words: Uncommented<'a>,
    section: String,
}

impl<'a> Values<'a> {
    fn line(&self) -> usize {
        self.words.line()
    }

    fn word(&mut self) -> Result<&'a [u8], MeditError> {
        self.words.next().ok_or_else(|| MeditError::Truncated { section: self.section.clone(), line: self.line() })
    }

    /// That a word is not what it should be.
    fn wrong(&self, word: &[u8], problem: impl FnOnce() -> String) -> MeditError {
        let (section, line) = (self.section.clone(), self.line());
        if is_keyword(word) {
            return MeditError::Short { section, found: escape(word), line };
        }
        MeditError::Value { section, problem: problem(), line }
    }

    fn float(&mut self) -> Result<f64, MeditError> {
        let word = self.word()?;
        float(word).ok_or_else(|| self.wrong(word, || no_number(word)))
    }

    /// A whole number that is not negative.
    fn count(&mut self) -> Result<u64, MeditError> {
        let word = self.word()?;
        let number = integer(word).and_then(|n| u64::try_from(n).ok());
        number.ok_or_else(|| self.wrong(word, || format!("\"{}\" is no number that can stand here", escape(word))))
    }

    /// A vertex, of so many, which are counted from 1.
    fn vertex(&mut self, vertices: usize) -> Result<u32, MeditError> {
        let word = self.word()?;
        let number =
            integer(word).and_then(|n| u32::try_from(n).ok()).filter(|n| (1..=vertices).contains(&(*n as usize)));
        let problem = || format!("\"{}\" is no vertex: there are {vertices}, counted from 1", escape(word));
        Ok(number.ok_or_else(|| self.wrong(word, problem))? - 1)
    }

    /// A reference, or whatever ends a record.
    fn reference(&mut self) -> Result<&'a [u8], MeditError> {
        let word = self.word()?;
        if is_keyword(word) { Err(self.wrong(word, String::new)) } else { Ok(word) }
    }

    /// The number of records, of so many numbers each, for which there must be room.
    fn records(&mut self, numbers: u64) -> Result<u64, MeditError> {
        let count = self.count()?;
        // A digit and a blank.
        let (needed, left) = (count.saturating_mul(2 * numbers), self.words.rest().len() as u64);
        if needed > left {
            return Err(MeditError::Count { section: self.section.clone(), count, needed, left, line: self.line() });
        }
        Ok(count)
    }
}

/// Whether a word is a keyword: it begins with a letter, and is none of the numbers that do.
fn is_keyword(word: &[u8]) -> bool {
    word.first().is_some_and(u8::is_ascii_alphabetic) && float(word).is_none()
}

/// A file on its way.
struct File<'a> {
    limits: &'a Limits,
    notes: Notes,
    dimension: Option<u64>,
    has_vertices: bool,
    points: Vec<Vec3>,
    bad: BadPoints,
    triangles: Vec<[u32; 3]>,
    references: References,
    /// The points that lie on edges; none where there are no curved faces.
    mid_nodes: Vec<bool>,
    /// Faces that came before the vertices.
    waiting: Vec<(Values<'a>, Section)>,
}

impl<'a> File<'a> {
    fn new(source: &Source<'a>) -> Self {
        Self {
            limits: source.limits,
            notes: Notes::new("MEDIT, ASCII"),
            dimension: None,
            has_vertices: false,
            points: Vec::new(),
            bad: BadPoints::default(),
            triangles: Vec::new(),
            references: References::new(source.labels),
            mid_nodes: Vec::new(),
            waiting: Vec::new(),
        }
    }

    /// Reads all sections, up to the end of the file or the keyword `End`.
    fn sections(&mut self, values: &mut Values<'a>) -> Result<(), MeditError> {
        while let Some(word) = values.words.next() {
            if !is_keyword(word) {
                let (section, line) = (values.section.clone(), values.line());
                return Err(MeditError::NoKeyword { section, found: escape(word), line });
            }
            values.section = escape(word);
            match Section::of(word) {
                _ if word.eq_ignore_ascii_case(b"End") => break,
                _ if word.eq_ignore_ascii_case(b"Dimension") => self.dimension(values)?,
                Some(section) => self.section(values, section)?,
                None => pass_over(&mut values.words),
            }
        }
        Ok(())
    }

    fn dimension(&mut self, values: &mut Values) -> Result<(), MeditError> {
        let dimension = values.count()?;
        if ![2, 3].contains(&dimension) {
            let (section, line) = (values.section.clone(), values.line());
            return Err(MeditError::Value { section, problem: format!("{dimension} is neither 2 nor 3"), line });
        }
        self.dimension = Some(dimension);
        Ok(())
    }

    fn section(&mut self, values: &mut Values<'a>, section: Section) -> Result<(), MeditError> {
        match section.kind {
            Kind::Vertices => self.vertices(values),
            Kind::Faces(_) if self.has_vertices => self.faces(values, section),
            Kind::Faces(_) => {
                self.waiting.push((values.clone(), section));
                pass_over(&mut values.words);
                Ok(())
            }
            Kind::Other(kind) => {
                let count = values.records(section.nodes + 1)?;
                for _ in 0..count * (section.nodes + 1) {
                    values.reference()?;
                }
                self.notes.skip(kind, usize::try_from(count).unwrap_or(usize::MAX));
                Ok(())
            }
        }
    }

    fn vertices(&mut self, values: &mut Values) -> Result<(), MeditError> {
        if std::mem::replace(&mut self.has_vertices, true) {
            return Err(MeditError::SecondSection { line: values.line() });
        }
        let dimension = self.dimension.ok_or(MeditError::NoSection("Dimension", " before Vertices"))?;
        let count = values.records(dimension + 1)?;
        TooMany::check("vertices", count, self.limits.elements)?;
        self.points.reserve_exact(usize::try_from(count).unwrap_or(0));
        for _ in 0..count {
            let mut point = [0.0; 3];
            for c in point.iter_mut().take(dimension as usize) {
                *c = values.float()?;
            }
            self.bad.check(self.points.len(), &point, || Location::Line(values.line()));
            self.points.push(point);
            values.reference()?;
        }
        Ok(())
    }

    fn faces(&mut self, values: &mut Values, section: Section) -> Result<(), MeditError> {
        let Kind::Faces(corners) = section.kind else { return Ok(()) };
        let count = values.records(section.nodes + 1)?;
        let mut nodes = Vec::with_capacity(section.nodes as usize);
        for _ in 0..count {
            nodes.clear();
            for _ in 0..section.nodes {
                nodes.push(values.vertex(self.points.len())?);
            }
            let reference = values.reference()?;
            self.face(&nodes, corners);
            self.references.add(reference, self.triangles.len(), values.line());
            TooMany::check("triangles", self.triangles.len() as u64, self.limits.elements)?;
        }
        Ok(())
    }

    fn face(&mut self, nodes: &[u32], corners: usize) {
        let (corners, others) = nodes.split_at(corners);
        if !others.is_empty() {
            self.mid_nodes.resize(self.points.len(), false);
            others.iter().for_each(|mid| self.mid_nodes[*mid as usize] = true);
        }
        let is_doubtful = polygon::add(corners, &self.points, &mut self.triangles);
        if corners.len() > 3 {
            self.notes.polygon(is_doubtful);
        }
    }
}

/// Passes over what is no keyword; what stands between quotes is none.
fn pass_over(words: &mut Uncommented) {
    let mut ahead = *words;
    let mut is_quoted = false;
    while let Some(word) = ahead.next() {
        if is_keyword(word) && !is_quoted {
            return;
        }
        is_quoted ^= word.iter().filter(|b| **b == b'"').count() % 2 == 1;
        *words = ahead;
    }
}

#[cfg(test)]
mod tests;
