//! What an XML file is made of: pieces, and the arrays that they hold.

use super::cell;
use super::error::{VtkError, escape};
use super::packed::Packing;
use super::scalar::Scalar;

/// What an XML file is made of.
pub(super) struct Outline<'a> {
    /// `VTU` or `VTP`.
    pub kind: &'static str,
    pub packing: Packing,
    pub pieces: Vec<Piece<'a>>,
    /// Arrays of cells, of any number of components, piece by piece, where they are wanted.
    pub of_cells: Vec<Named<'a>>,
    /// Arrays of the whole file that name labels, where they are wanted.
    pub of_file: Vec<Named<'a>>,
    /// Arrays of points, of any number of components, piece by piece, where they are wanted.
    pub of_points: Vec<Named<'a>>,
    /// How many arrays of points or cells there are beside these: of strings, or of types that are not known.
    pub passed_over: usize,
    pub appended: Option<Appended<'a>>,
}

/// What is looked for beside the surface.
#[derive(Clone, Copy)]
pub(super) enum Wanted {
    /// These fields, and nothing else.
    Fields(&'static [Field]),
    /// All arrays of these sorts.
    Arrays {
        /// Of cells, and what names labels.
        of_cells: bool,
        /// Of points.
        of_points: bool,
    },
}

impl Wanted {
    /// The fields that are looked for.
    pub fn fields(self) -> &'static [Field] {
        match self {
            Self::Fields(fields) => fields,
            Self::Arrays { .. } => &[],
        }
    }
}

/// What an array belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Owner {
    /// The whole file.
    File,
    /// The cells of a piece, from 0.
    Cells(usize),
    /// The points of a piece, from 0.
    Points(usize),
}

impl Owner {
    /// The piece, from 0; none where it is the whole file.
    pub fn piece(self) -> Option<usize> {
        match self {
            Self::File => None,
            Self::Cells(piece) | Self::Points(piece) => Some(piece),
        }
    }
}

/// An array of cells or points, or one that names labels.
pub(super) struct Named<'a> {
    pub name: String,
    pub owner: Owner,
    /// Whether it holds strings: bytes, each string with a zero behind it.
    pub is_strings: bool,
    /// The array, or what is wrong with it.
    pub array: Result<Array<'a>, VtkError>,
}

impl Named<'_> {
    /// How many numbers make an entry; one where that is not told.
    pub fn components(&self) -> u64 {
        self.array.as_ref().ok().and_then(|array| array.components).unwrap_or(1).max(1)
    }
}

/// Points and cells that belong together.
#[derive(Default)]
pub(super) struct Piece<'a> {
    /// The byte after its tag.
    pub at: usize,
    pub points: u64,
    /// How many cells each section has, in the order of [`Section::ALL`].
    pub cells: [u64; 5],
    pub arrays: Vec<(Role, Array<'a>)>,
    /// What there is more than one array for, if anything: the first one counts.
    pub twice: Option<Role>,
}

impl<'a> Piece<'a> {
    /// The array for this.
    pub fn array(&self, role: Role) -> Option<Array<'a>> {
        self.arrays.iter().find(|(r, _)| *r == role).map(|(_, array)| *array)
    }
}

/// Where cells are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Cells,
    Verts,
    Lines,
    Strips,
    Polys,
}

impl Section {
    pub const ALL: [Self; 5] = [Self::Cells, Self::Verts, Self::Lines, Self::Strips, Self::Polys];

    /// The name of its element, and of the attribute of a piece that counts it.
    pub fn names(self) -> (&'static str, &'static str) {
        match self {
            Self::Cells => ("Cells", "NumberOfCells"),
            Self::Verts => ("Verts", "NumberOfVerts"),
            Self::Lines => ("Lines", "NumberOfLines"),
            Self::Strips => ("Strips", "NumberOfStrips"),
            Self::Polys => ("Polys", "NumberOfPolys"),
        }
    }

    pub fn name(self) -> &'static str {
        self.names().0
    }

    /// The type of all its cells, where they have one and belong to a surface.
    pub fn cell_type(self) -> Option<u8> {
        match self {
            Self::Strips => Some(cell::STRIP),
            Self::Polys => Some(cell::POLYGON),
            Self::Cells | Self::Verts | Self::Lines => None,
        }
    }
}

/// What an array is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Points,
    Connectivity(Section),
    Offsets(Section),
    Types,
    Field(Field),
}

/// Values at points or cells, by their name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Field {
    OfPoints(&'static str),
    OfCells(&'static str),
}

impl Role {
    pub fn name(self) -> String {
        match self {
            Self::Points => "Points".to_owned(),
            Self::Connectivity(section) => format!("connectivity of {}", section.name()),
            Self::Offsets(section) => format!("offsets of {}", section.name()),
            Self::Types => "types of Cells".to_owned(),
            Self::Field(Field::OfPoints(name) | Field::OfCells(name)) => Self::values_of(name),
        }
    }

    /// The values of an array by its name in the file.
    pub fn values_of(name: &str) -> String {
        format!("values of \"{}\"", escape(name.as_bytes()))
    }
}

/// An array as it stands in the file.
#[derive(Clone, Copy)]
pub(super) struct Array<'a> {
    /// The byte after its tag.
    pub at: usize,
    pub scalar: Scalar,
    /// How many numbers make an entry, if it is told.
    pub components: Option<u64>,
    pub data: Data<'a>,
}

/// Where the numbers of an array are.
#[derive(Clone, Copy)]
pub(super) enum Data<'a> {
    /// As text in the element: the file up to the end of it, and where it begins.
    Ascii(&'a [u8], usize),
    /// As base64 in the element.
    Inline(&'a [u8]),
    /// From this byte of the appended data on.
    Appended(u64),
}

impl<'a> Data<'a> {
    /// The numbers are the text between these bytes of a file, if they stand in the element; whether they are the first.
    pub fn hold(&mut self, file: &'a [u8], from: usize, end: usize) -> bool {
        match self {
            Data::Ascii(until, at) => {
                let is_fresh = until.len() == *at;
                (*until, *at) = (&file[..end], from);
                is_fresh
            }
            Data::Inline(data) => std::mem::replace(data, &file[from..end]).is_empty(),
            Data::Appended(_) => true,
        }
    }
}

/// The data behind the `_` of `AppendedData`.
#[derive(Clone, Copy)]
pub(super) struct Appended<'a> {
    /// Where they begin in the file.
    pub at: usize,
    pub bytes: &'a [u8],
    pub base64: bool,
}
