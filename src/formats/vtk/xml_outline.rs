//! The outline of an XML file: what it is, and where its arrays are.
//!
//! Only tags are looked at, one after the other. Appended data end the search: raw ones are no XML.

use super::cell;
use super::error::{Location, VtkError, escape};
use super::packed::{Compressor, Packing};
use super::scalar::{Order, Scalar};
use super::unsupported;
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// What an XML file is made of.
pub(super) struct Outline<'a> {
    /// `VTU` or `VTP`.
    pub kind: &'static str,
    pub packing: Packing,
    pub pieces: Vec<Piece<'a>>,
    pub appended: Option<Appended<'a>>,
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
    fn names(self) -> (&'static str, &'static str) {
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
            Self::Field(Field::OfPoints(name) | Field::OfCells(name)) => format!("values of \"{name}\""),
        }
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

/// The data behind the `_` of `AppendedData`.
#[derive(Clone, Copy)]
pub(super) struct Appended<'a> {
    /// Where they begin in the file.
    pub at: usize,
    pub bytes: &'a [u8],
    pub base64: bool,
}

/// The elements that matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tag {
    File,
    DataSet,
    Piece,
    Points,
    PointData,
    CellData,
    Section(Section),
    Array,
    Other,
}

/// Finds what is in a file: the surface, and these fields.
pub(super) fn outline<'a>(bytes: &'a [u8], depth: usize, fields: &'static [Field]) -> Result<Outline<'a>, VtkError> {
    let mut search = Search::new(bytes, depth, fields);
    while search.step()? {}
    search.finish()
}

/// A file as it is searched.
struct Search<'a> {
    bytes: &'a [u8],
    depth: usize,
    fields: &'static [Field],
    reader: Reader<&'a [u8]>,
    /// The elements around the place at hand, from the outermost.
    path: Vec<Tag>,
    /// The name of the element that holds pieces, and of the kind of file; none before the first tag.
    kind: Option<(&'static str, &'static str)>,
    packing: Packing,
    pieces: Vec<Piece<'a>>,
    /// Whether there was a piece with nothing in it.
    has_empty: bool,
    appended: Option<Appended<'a>>,
}

impl<'a> Search<'a> {
    fn new(bytes: &'a [u8], depth: usize, fields: &'static [Field]) -> Self {
        let mut reader = Reader::from_reader(bytes);
        reader.config_mut().expand_empty_elements = true;
        let packing = Packing { order: Order::Little, wide: false, compressor: None };
        let (path, pieces) = (Vec::new(), Vec::new());
        Self { bytes, depth, fields, reader, path, kind: None, packing, pieces, has_empty: false, appended: None }
    }

    /// The byte after what was read last.
    fn at(&self) -> usize {
        self.reader.buffer_position() as usize
    }

    fn location(&self) -> Location {
        Location::line_of(self.bytes, self.at())
    }

    fn syntax(&self, problem: impl Into<String>) -> VtkError {
        VtkError::Syntax { location: self.location(), problem: problem.into() }
    }

    fn count(&self, what: String, declared: u64) -> VtkError {
        VtkError::Count { location: self.location(), what, declared, there: 0 }
    }

    /// Looks at the next tag or text; whether more may follow.
    fn step(&mut self) -> Result<bool, VtkError> {
        let before = self.at();
        match self.reader.read_event() {
            Ok(Event::Start(tag)) => return self.start(&tag),
            Ok(Event::End(_)) => self.end()?,
            Ok(Event::Text(_)) => self.text(before)?,
            Ok(Event::DocType(_)) => {
                return Err(self.syntax("a document type declaration, which VTK never writes, is not read"));
            }
            Ok(Event::Eof) if self.path.is_empty() => return Ok(false),
            Ok(Event::Eof) => return Err(self.syntax("the file ends before </VTKFile>: it was cut off")),
            Ok(_) => {}
            Err(error) => {
                let location = Location::line_of(self.bytes, self.reader.error_position() as usize);
                return Err(VtkError::Syntax { location, problem: format!("this is no XML ({error})") });
            }
        }
        Ok(true)
    }

    /// A tag opens; whether more may follow.
    fn start(&mut self, tag: &BytesStart) -> Result<bool, VtkError> {
        if self.path.len() >= self.depth {
            return Err(self.syntax(format!("elements are nested more than {} deep", self.depth)));
        }
        let name = tag.name();
        let opened = match (self.path.as_slice(), name.as_ref()) {
            ([], "VTKFile") => {
                self.file(tag)?;
                Tag::File
            }
            ([Tag::File], "AppendedData") => {
                self.appended(tag)?;
                return Ok(false);
            }
            ([Tag::File], name) if self.kind.is_some_and(|(element, _)| element == name) => Tag::DataSet,
            ([Tag::File, Tag::DataSet], "Piece") => {
                self.piece(tag)?;
                Tag::Piece
            }
            ([.., Tag::Piece], name) => part(name),
            ([.., parent], "DataArray") => match role(*parent, tag, self.fields) {
                Some(role) => self.array(tag, role)?,
                None => Tag::Other,
            },
            _ => Tag::Other,
        };
        self.path.push(opened);
        Ok(true)
    }

    /// The kind of file and how its arrays are packed.
    fn file(&mut self, tag: &BytesStart) -> Result<(), VtkError> {
        self.kind = Some(match attribute(tag, "type") {
            Some("UnstructuredGrid") => ("UnstructuredGrid", "VTU"),
            Some("PolyData") => ("PolyData", "VTP"),
            None => return Err(self.syntax("<VTKFile> has no type")),
            Some(other) => return Err(unsupported(self.location(), &escape(other.as_bytes()))),
        });
        self.packing.order = match attribute(tag, "byte_order") {
            Some("BigEndian") => Order::Big,
            _ => Order::Little,
        };
        self.packing.wide = match attribute(tag, "header_type") {
            None | Some("UInt32") => false,
            Some("UInt64") => true,
            Some(other) => return Err(self.syntax(format!("\"{}\" is no header_type", escape(other.as_bytes())))),
        };
        self.packing.compressor = match attribute(tag, "compressor") {
            None | Some("") => None,
            Some("vtkZLibDataCompressor") => Some(Compressor::Zlib),
            Some("vtkLZ4DataCompressor") => Some(Compressor::Lz4),
            Some("vtkLZMADataCompressor") => Some(Compressor::Lzma),
            Some(other) => {
                let problem = format!("the compressor \"{}\" is not known; save without it", escape(other.as_bytes()));
                return Err(self.syntax(problem));
            }
        };
        Ok(())
    }

    /// A piece begins.
    fn piece(&mut self, tag: &BytesStart) -> Result<(), VtkError> {
        let mut piece = Piece { at: self.at(), ..Piece::default() };
        piece.points = self.number(tag, "NumberOfPoints")?.unwrap_or_default();
        for (count, section) in piece.cells.iter_mut().zip(Section::ALL) {
            *count = self.number(tag, section.names().1)?.unwrap_or_default();
        }
        self.pieces.push(piece);
        Ok(())
    }

    fn number(&self, tag: &BytesStart, name: &str) -> Result<Option<u64>, VtkError> {
        let Some(text) = attribute(tag, name) else { return Ok(None) };
        let number = text.trim().parse().ok();
        number.map(Some).ok_or_else(|| self.syntax(format!("{name} is no number: \"{}\"", escape(text.as_bytes()))))
    }

    /// An array of the piece at hand. Where there are several of the same name (steps of time), the first one counts.
    fn array(&mut self, tag: &BytesStart, role: Role) -> Result<Tag, VtkError> {
        let scalar = attribute(tag, "type").unwrap_or_default();
        let Some(scalar) = Scalar::xml(scalar) else {
            return Err(self.syntax(format!("\"{}\" is no type of {}", escape(scalar.as_bytes()), role.name())));
        };
        let data = match attribute(tag, "format").unwrap_or("ascii") {
            "ascii" => Data::Ascii(&self.bytes[..self.at()], self.at()),
            "binary" => Data::Inline(&[]),
            "appended" => match self.number(tag, "offset")? {
                Some(offset) => Data::Appended(offset),
                None => return Err(self.syntax(format!("{} have no offset", role.name()))),
            },
            other => return Err(self.syntax(format!("\"{}\" is no format of an array", escape(other.as_bytes())))),
        };
        let components = self.number(tag, "NumberOfComponents")?;
        let array = Array { at: self.at(), scalar, components, data };
        match self.pieces.last_mut() {
            Some(piece) if piece.array(role).is_none() => piece.arrays.push((role, array)),
            Some(piece) => {
                piece.twice = Some(role);
                return Ok(Tag::Other);
            }
            None => return Ok(Tag::Other),
        }
        Ok(Tag::Array)
    }

    /// Text from this byte on: the numbers of an array, perhaps.
    fn text(&mut self, from: usize) -> Result<(), VtkError> {
        let text = &self.bytes[from..self.at()];
        if self.path.last() != Some(&Tag::Array) || text.trim_ascii().is_empty() {
            return Ok(());
        }
        let (bytes, end) = (self.bytes, self.at());
        let Some((_, array)) = self.pieces.last_mut().and_then(|p| p.arrays.last_mut()) else { return Ok(()) };
        let fresh = match &mut array.data {
            Data::Ascii(until, at) => {
                let fresh = until.len() == *at;
                (*until, *at) = (&bytes[..end], from);
                fresh
            }
            Data::Inline(data) => std::mem::replace(data, text).is_empty(),
            Data::Appended(_) => true,
        };
        if fresh { Ok(()) } else { Err(self.syntax("the numbers of an array are interrupted")) }
    }

    /// An element ends.
    fn end(&mut self) -> Result<(), VtkError> {
        if self.path.pop() != Some(Tag::Piece) {
            return Ok(());
        }
        let Some(piece) = self.pieces.last() else { return Ok(()) };
        if piece.points == 0 && piece.cells.iter().all(|count| *count == 0) {
            // Nothing is in it; many of them should take no memory.
            self.pieces.pop();
            self.has_empty = true;
        } else if piece.points > 0 && piece.array(Role::Points).is_none() {
            return Err(self.count("Points of this piece".to_owned(), piece.points));
        }
        Ok(())
    }

    /// The appended data begin after their tag with an underscore, and end where the file does.
    fn appended(&mut self, tag: &BytesStart) -> Result<(), VtkError> {
        let base64 = match attribute(tag, "encoding") {
            Some("raw") => false,
            Some("base64") | None => true,
            Some(other) => return Err(self.syntax(format!("\"{}\" is no encoding", escape(other.as_bytes())))),
        };
        let rest = &self.bytes[self.at()..];
        let Some(data) = rest.trim_ascii_start().strip_prefix(b"_") else {
            return Err(self.syntax("the appended data do not begin with \"_\""));
        };
        const END: &[u8] = b"</AppendedData";
        let Some(end) = data.windows(END.len()).rposition(|w| w == END) else {
            return Err(self.syntax("the file ends before </AppendedData>: it was cut off"));
        };
        let at = self.bytes.len() - data.len();
        self.appended = Some(Appended { at, bytes: &data[..end], base64 });
        Ok(())
    }

    fn finish(self) -> Result<Outline<'a>, VtkError> {
        let Some((_, kind)) = self.kind else { return Err(self.syntax("there is no <VTKFile> in the file")) };
        if self.pieces.is_empty() && !self.has_empty {
            return Err(self.syntax("there is no <Piece> in the file"));
        }
        Ok(Outline { kind, packing: self.packing, pieces: self.pieces, appended: self.appended })
    }
}

impl<'a> Piece<'a> {
    /// The array for this.
    pub fn array(&self, role: Role) -> Option<Array<'a>> {
        self.arrays.iter().find(|(r, _)| *r == role).map(|(_, array)| *array)
    }
}

/// The part of a piece that an element of this name is.
fn part(name: &str) -> Tag {
    match name {
        "Points" => Tag::Points,
        "PointData" => Tag::PointData,
        "CellData" => Tag::CellData,
        _ => Section::ALL.into_iter().find(|s| s.name() == name).map_or(Tag::Other, Tag::Section),
    }
}

/// What an array in this element is for.
fn role(parent: Tag, tag: &BytesStart, fields: &[Field]) -> Option<Role> {
    let name = attribute(tag, "Name").unwrap_or_default();
    let field = |field: &&Field| match **field {
        Field::OfPoints(wanted) => parent == Tag::PointData && wanted == name,
        Field::OfCells(wanted) => parent == Tag::CellData && wanted == name,
    };
    match (parent, name) {
        (Tag::Points, _) => Some(Role::Points),
        (Tag::Section(section), "connectivity") => Some(Role::Connectivity(section)),
        (Tag::Section(section), "offsets") => Some(Role::Offsets(section)),
        (Tag::Section(Section::Cells), "types") => Some(Role::Types),
        _ => fields.iter().find(field).map(|f| Role::Field(*f)),
    }
}

/// The value of an attribute. Twins are not looked for: among very many attributes that would take very long.
fn attribute<'t>(tag: &'t BytesStart, name: &str) -> Option<&'t str> {
    let mut all = tag.attributes();
    all.with_checks(false);
    let found = all.flatten().find(|a| a.key.as_ref() == name)?;
    match found.value {
        std::borrow::Cow::Borrowed(value) => Some(value),
        std::borrow::Cow::Owned(_) => None,
    }
}
