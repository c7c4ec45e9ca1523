//! Why bytes are no VTK file.

use crate::formats::TooMany;
pub(super) use crate::formats::location::{Location, escape};
use crate::outcome::Code;

/// Why bytes are no VTK file, or none with a surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum VtkError {
    /// Neither a legacy nor an XML file.
    #[error(
        "the file begins with \"{found}\", neither with \"# vtk DataFile Version\" nor with <VTKFile>; save it again from ParaView as .vtp, .vtu or legacy .vtk"
    )]
    NoVtk {
        /// How it begins.
        found: String,
    },
    /// Another kind of data set.
    #[error("{location}: the file holds {dataset}, {what}; {remedy}")]
    Dataset {
        /// Where it is said.
        location: Location,
        /// VTK's name.
        dataset: String,
        /// What that is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Fewer values than declared.
    #[error(
        "{location}: {what} should have {declared} values, but there are only {there}; the file was cut off or its counts are wrong: copy or save it again"
    )]
    Count {
        /// Where they are declared, or begin.
        location: Location,
        /// Of what.
        what: String,
        /// How many are declared.
        declared: u64,
        /// How many there are, or have room.
        there: u64,
    },
    /// More elements than the limit.
    #[error("{location}: {declared} {what} exceed the limit of {limit}; split or decimate the surface")]
    TooLarge {
        /// Where they are declared.
        location: Location,
        /// Of what.
        what: &'static str,
        /// How many are declared.
        declared: u64,
        /// How many are allowed.
        limit: u64,
    },
    /// More values than the limit.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// Something that VTK would not write.
    #[error("{location}: {problem}; correct it or save the file again")]
    Syntax {
        /// Where.
        location: Location,
        /// What is wrong.
        problem: String,
    },
    /// An array cannot be decoded.
    #[error("{location}: {what} cannot be decoded: {problem}")]
    Packed {
        /// Where the array begins.
        location: Location,
        /// Which array.
        what: String,
        /// What is wrong, and what to do.
        problem: PackedError,
    },
    /// A cell names a point that does not exist.
    #[error(
        "cell {cell} of {section} uses point {index}, but there are only {points} points; the file was cut off or its numbering is wrong: save it again"
    )]
    OutOfRange {
        /// The cell, from 0.
        cell: usize,
        /// Where cells are counted.
        section: &'static str,
        /// The point, from 0.
        index: u32,
        /// How many there are.
        points: usize,
    },
    /// A cell has a wrong number of corners.
    #[error("cell {cell} of {section} is a {kind} of {corners} points; it is damaged: save the file again")]
    Corners {
        /// The cell, from 0.
        cell: usize,
        /// Where cells are counted.
        section: &'static str,
        /// VTK's name of its type.
        kind: &'static str,
        /// How many points it has.
        corners: usize,
    },
    /// The offsets of cells do not rise, or lead beyond the connectivity.
    #[error("the offset of cell {cell} of {section} is wrong: it ends at {end} of {length}; save the file again")]
    Offset {
        /// The cell, from 0.
        cell: usize,
        /// Where cells are counted.
        section: &'static str,
        /// Where it ends.
        end: u32,
        /// Length of the connectivity.
        length: usize,
    },
}

/// Why an array cannot be decoded.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PackedError {
    /// There are fewer bytes than its header says.
    #[error("{needed} bytes are needed, but only {there} are there; the file was cut off: copy or save it again")]
    Short {
        /// Bytes that are needed.
        needed: u64,
        /// Bytes that are there.
        there: u64,
    },
    /// Not base64.
    #[error("{0} is no base64; save the file again")]
    Base64(String),
    /// A compressed block does not unpack to what its header says.
    #[error("block {block} of {size} bytes does not unpack to {unpacked} bytes; the file is damaged: save it again")]
    Block {
        /// The block, from 0.
        block: usize,
        /// Its compressed size.
        size: usize,
        /// Its size as declared.
        unpacked: u64,
    },
    /// It unpacks to more than is allowed.
    #[error(
        "it unpacks to {unpacked} bytes, more than the {left} that are left for a file of this size; raise the limit of expansion, or save the file without compression"
    )]
    Expansion {
        /// Bytes after unpacking.
        unpacked: u64,
        /// Bytes that are left.
        left: u64,
    },
    /// The arrays of the file overlap.
    #[error("the arrays of the file overlap many times; save it again")]
    Overlap,
}

impl VtkError {
    pub(in crate::formats) fn code(&self) -> Code {
        match self {
            Self::Dataset { .. } => Code::UnsupportedFormat,
            Self::Count { .. } | Self::Packed { problem: PackedError::Short { .. }, .. } => Code::CountMismatch,
            Self::TooMany(_) | Self::TooLarge { .. } | Self::Packed { problem: PackedError::Expansion { .. }, .. } => {
                Code::TooLarge
            }
            _ => Code::Malformed,
        }
    }

    pub(in crate::formats) fn location(&self) -> Option<String> {
        match self {
            Self::NoVtk { .. } => Some("byte 0".to_owned()),
            Self::TooMany(_) => None,
            Self::Dataset { location, .. }
            | Self::Count { location, .. }
            | Self::TooLarge { location, .. }
            | Self::Syntax { location, .. }
            | Self::Packed { location, .. } => Some(location.to_string()),
            Self::OutOfRange { cell, section, .. }
            | Self::Corners { cell, section, .. }
            | Self::Offset { cell, section, .. } => Some(format!("{section}, cell {cell}")),
        }
    }
}
