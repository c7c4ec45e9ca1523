//! The outline of an XML file: what it is, and where its arrays are.
//!
//! Only tags are looked at, one after the other. Appended data end the search: raw ones are no XML.

use super::error::{Location, VtkError, escape};
use super::packed::{Compressor, Packing};
use super::scalar::{Order, Scalar};
use super::unsupported;
use super::xml_parts::{Appended, Array, Data, Field, Named, Outline, Owner, Piece, Role, Section, Wanted};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

/// The elements that matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tag {
    File,
    DataSet,
    Piece,
    Points,
    PointData,
    CellData,
    FieldData,
    Section(Section),
    Array,
    /// An array that has a name of its own.
    Named,
    Other,
}

/// Finds what is in a file: the surface, and what else is wanted.
pub(super) fn outline(bytes: &[u8], depth: usize, wanted: Wanted) -> Result<Outline<'_>, VtkError> {
    let mut search = Search::new(bytes, depth, wanted);
    while search.step()? {}
    search.finish()
}

/// A file as it is searched.
struct Search<'a> {
    bytes: &'a [u8],
    depth: usize,
    wanted: Wanted,
    reader: Reader<&'a [u8]>,
    /// The elements around the place at hand, from the outermost.
    path: Vec<Tag>,
    /// The name of the element that holds pieces, and of the kind of file; none before the first tag.
    kind: Option<(&'static str, &'static str)>,
    packing: Packing,
    pieces: Vec<Piece<'a>>,
    named: Vec<Named<'a>>,
    /// Arrays of points or cells that are none of these.
    passed_over: usize,
    /// Whether there was a piece with nothing in it.
    has_empty: bool,
    appended: Option<Appended<'a>>,
}

impl<'a> Search<'a> {
    fn new(bytes: &'a [u8], depth: usize, wanted: Wanted) -> Self {
        let mut reader = Reader::from_reader(bytes);
        reader.config_mut().expand_empty_elements = true;
        Self {
            bytes,
            depth,
            wanted,
            reader,
            path: Vec::new(),
            kind: None,
            packing: Packing { order: Order::Little, wide: false, compressor: None },
            pieces: Vec::new(),
            named: Vec::new(),
            passed_over: 0,
            has_empty: false,
            appended: None,
        }
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
            ([Tag::File, Tag::DataSet], "FieldData") => Tag::FieldData,
            ([.., Tag::Piece], name) => part(name),
            ([.., parent], "DataArray") => match (role(*parent, tag, self.wanted.fields()), self.wanted) {
                (Some(role), _) => self.array(tag, role)?,
                (None, _) => self.named(tag, *parent),
            },
            // Strings.
            ([.., parent], "Array") => self.named(tag, *parent),
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
        let array = self.stored(tag, scalar, &role.name())?;
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

    /// An array as its tag says that it is stored.
    fn stored(&self, tag: &BytesStart, scalar: Scalar, name: &str) -> Result<Array<'a>, VtkError> {
        let data = match attribute(tag, "format").unwrap_or("ascii") {
            "ascii" => Data::Ascii(&self.bytes[..self.at()], self.at()),
            "binary" => Data::Inline(&[]),
            "appended" => match self.number(tag, "offset")? {
                Some(offset) => Data::Appended(offset),
                None => return Err(self.syntax(format!("{name} have no offset"))),
            },
            other => return Err(self.syntax(format!("\"{}\" is no format of an array", escape(other.as_bytes())))),
        };
        let components = self.number(tag, "NumberOfComponents")?;
        Ok(Array { at: self.at(), scalar, components, data })
    }

    /// What an array in this element belongs to; none where arrays of that sort are not wanted.
    fn owner(&self, parent: Tag) -> Option<Owner> {
        let Wanted::Arrays { of_cells, of_points } = self.wanted else { return None };
        let piece = self.pieces.len().checked_sub(1);
        match parent {
            Tag::FieldData if of_cells => Some(Owner::File),
            Tag::CellData if of_cells => piece.map(Owner::Cells),
            Tag::PointData if of_points => piece.map(Owner::Points),
            _ => None,
        }
    }

    /// An array of cells or points, or one that could name labels. What is wrong with it matters where it is chosen only.
    fn named(&mut self, tag: &BytesStart, parent: Tag) -> Tag {
        let Some(owner) = self.owner(parent) else { return Tag::Other };
        let is_of_points = matches!(owner, Owner::Points(_));
        let name = attribute(tag, "Name").unwrap_or_default();
        let name = quick_xml::escape::unescape(name).unwrap_or(name.into()).into_owned();
        let kind = attribute(tag, "type").unwrap_or_default();
        let is_strings = kind == "String";
        let scalar = if is_strings { Some(Scalar::U8) } else { Scalar::xml(kind) };
        let Some(scalar) = scalar.filter(|_| !(is_strings && is_of_points)) else {
            self.passed_over += usize::from(owner != Owner::File);
            return Tag::Other;
        };
        let array = self.stored(tag, scalar, &Role::values_of(&name));
        self.named.push(Named { name, owner, is_strings, array });
        Tag::Named
    }

    /// Text from this byte on: the numbers of an array, perhaps.
    fn text(&mut self, from: usize) -> Result<(), VtkError> {
        let end = self.at();
        if self.bytes[from..end].trim_ascii().is_empty() {
            return Ok(());
        }
        let array = match self.path.last() {
            Some(Tag::Array) => self.pieces.last_mut().and_then(|piece| Some(&mut piece.arrays.last_mut()?.1)),
            Some(Tag::Named) => self.named.last_mut().and_then(|named| named.array.as_mut().ok()),
            _ => None,
        };
        if array.is_none_or(|array| array.data.hold(self.bytes, from, end)) {
            return Ok(());
        }
        let interrupted = self.syntax("the numbers of an array are interrupted");
        match self.named.last_mut() {
            Some(named) if self.path.last() == Some(&Tag::Named) => named.array = Err(interrupted),
            _ => return Err(interrupted),
        }
        Ok(())
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
            let piece = Some(self.pieces.len());
            while self.named.last().is_some_and(|named| named.owner.piece() == piece) {
                self.named.pop();
            }
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
        let (packing, pieces, appended, passed_over) = (self.packing, self.pieces, self.appended, self.passed_over);
        let [mut of_cells, mut of_file, mut of_points] = [const { Vec::new() }; 3];
        for named in self.named {
            match named.owner {
                Owner::File => of_file.push(named),
                Owner::Cells(_) => of_cells.push(named),
                Owner::Points(_) => of_points.push(named),
            }
        }
        Ok(Outline { kind, packing, pieces, of_cells, of_file, of_points, passed_over, appended })
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
