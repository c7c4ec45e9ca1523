//! PLY 1.0, ASCII and binary.
//!
//! Points are the element `vertex` with `x`, `y`, `z`; faces are the element `face` or `tristrips` with the list
//! `vertex_indices` or `vertex_index`. All types are read everywhere, elements may come in any order, and other
//! elements and properties are passed over, but for the one property of faces that labels them. Polygons are cut into
//! triangles; the triangles of a strip turn alternately, and -1 begins another strip.

mod binary;
mod body;
mod face_labels;
mod header;
mod values;

use super::finish;
use super::location::Location;
use super::words::Words;
use super::{Content, Notes, ReadError, Source, TooMany};
use crate::outcome::Code;
use binary::Binary;
use body::Body;
use face_labels::FaceLabels;
use header::{Encoding, Header};
use values::Text;

/// Why bytes are no PLY file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum PlyError {
    /// The first line is another.
    #[error("the file begins with \"{begins}\", not with a line \"ply\": it is no PLY file; export it again")]
    NotPly {
        /// What it begins with.
        begins: String,
    },
    /// A line of the header makes no sense.
    #[error("line {line}: {problem}; correct the header or export the file again")]
    Header {
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// The header does not end.
    #[error(
        "there is no line \"end_header\" up to line {line} (headers of up to {most} bytes are read); the file was cut off: copy or export it again"
    )]
    HeaderEnds {
        /// The last line.
        line: usize,
        /// Bytes of a header, at most.
        most: usize,
    },
    /// There are no points.
    #[error("the header declares no element \"vertex\"; export the file again, as a mesh")]
    NoElement,
    /// An element lacks what it is for.
    #[error("line {line}: element {element} has no property \"{property}\"; export the file again, as a mesh")]
    NoProperty {
        /// The element.
        element: String,
        /// What it lacks.
        property: &'static str,
        /// The line that declares the element.
        line: usize,
    },
    /// There are fewer bytes than the declared elements take.
    #[error(
        "line {line}: the header declares {count} of element {element} ({needed} bytes at least), but {left} bytes are left for them; the file was cut off or its header is wrong: copy or export it again"
    )]
    Count {
        /// The element.
        element: String,
        /// How many are declared.
        count: u64,
        /// Bytes they need at least.
        needed: u64,
        /// Bytes there are, behind those that the elements before need.
        left: u64,
        /// The line of the declaration.
        line: usize,
    },
    /// There are more than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// The file ends in the middle.
    #[error(
        "{location}: the file ends in {element} {number} (from 0) of {count} that its header declares; it was cut off or its header is wrong: copy or export it again"
    )]
    Truncated {
        /// The element.
        element: String,
        /// Its number, from 0.
        number: u64,
        /// How many are declared.
        count: u64,
        /// Where the file ends.
        location: Location,
    },
    /// A value is not what it should be.
    #[error("{location}: {problem}, in {element} {number} (from 0); correct the header or export the file again")]
    Value {
        /// The element.
        element: String,
        /// Its number, from 0.
        number: u64,
        /// What is wrong.
        problem: String,
        /// Where.
        location: Location,
    },
    /// There is more than the header declares.
    #[error(
        "{location}: {bytes} bytes (\"{begins}\") follow all that the header declares; correct its counts, cut the file off there, or export it again"
    )]
    Trailing {
        /// How many bytes.
        bytes: usize,
        /// What they begin with.
        begins: String,
        /// Where the last record ends.
        location: Location,
    },
}

impl PlyError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::NotPly { .. } | Self::Header { .. } | Self::HeaderEnds { .. } => Code::Malformed,
            Self::NoElement | Self::NoProperty { .. } | Self::Value { .. } => Code::Malformed,
            Self::Count { .. } | Self::Truncated { .. } | Self::Trailing { .. } => Code::CountMismatch,
            Self::TooMany(_) => Code::TooLarge,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        match self {
            Self::NotPly { .. } => Some(Location::Line(1).to_string()),
            Self::NoElement | Self::TooMany(_) => None,
            Self::Header { line, .. }
            | Self::HeaderEnds { line, .. }
            | Self::NoProperty { line, .. }
            | Self::Count { line, .. } => Some(Location::Line(*line).to_string()),
            Self::Truncated { location, .. } | Self::Value { location, .. } | Self::Trailing { location, .. } => {
                Some(location.to_string())
            }
        }
    }
}

/// Reads a PLY file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let header = Header::read(source.bytes)?;
    let mut notes = Notes::new(match header.encoding {
        Encoding::Ascii => "PLY, ASCII",
        Encoding::Little => "PLY, binary, little-endian",
        Encoding::Big => "PLY, binary, big-endian",
    });
    let labels = FaceLabels::new(&header, source.labels)?;
    let body = match header.encoding {
        Encoding::Ascii => {
            let text = Text(Words::new(&source.bytes[header.end..], header.lines + 1));
            Body::read(&header, text, source.limits, &mut notes, labels)?
        }
        encoding => {
            let binary = Binary::new(source.bytes, header.end, encoding == Encoding::Big);
            Body::read(&header, binary, source.limits, &mut notes, labels)?
        }
    };
    let (points, triangles, bad) = (body.points, body.triangles, body.bad);
    let labels = body.labels.finish(&mut notes)?;
    finish::content(points, triangles, labels, notes, &bad)
}

#[cfg(test)]
mod tests;
