//! VTK XML files: `.vtu` and `.vtp`, in every encoding.

use super::cell_labels::{PieceCells, Rank};
use super::error::{Location, VtkError};
use super::packed::{Budget, Compressor, Packing, Stream, unpack};
use super::scalar::Order;
use super::surface::{Cells, Surface, Types};
use super::text::Text;
use super::xml_fields;
use super::xml_labels;
use super::xml_outline::outline;
use super::xml_parts::{Appended, Array, Data, Outline, Piece, Role, Section, Wanted};
use super::xml_sizes;
use crate::formats::fields::Keeping;
use crate::formats::labels::Labels;
use crate::formats::point_sizes;
use crate::formats::{Content, LabelSource, ReadError, Source};
use planish_core::vec3::Vec3;
use std::borrow::Cow;

/// Reads an XML file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let readable = readable(source.bytes);
    let source = &Source { bytes: &readable, ..*source };
    let is_labelled = *source.labels != LabelSource::Ignored;
    let keeps = source.keeps_fields;
    let wanted = Wanted::Arrays { of_cells: is_labelled || keeps, of_points: source.sizes.is_some() || keeps };
    let file = outline(source.bytes, source.limits.depth, wanted)?;
    let needs_cells = is_labelled || !file.of_cells.is_empty();
    let mut surface = Surface::new(source.limits, format(&file), needs_cells);
    let mut arrays = Arrays::new(source, &file);
    let mut cells: Vec<PieceCells> = Vec::new();
    for piece in &file.pieces {
        arrays.piece(piece, &mut surface)?;
        cells.extend(surface.take_cells());
    }
    // After the geometry: what labels take of the budget is not missing there.
    let labels = match is_labelled {
        true => xml_labels::labels(&mut arrays, &file, &cells, source.labels, surface.notes())?,
        false => Labels::new(source.labels),
    };
    let content = surface.finish(labels)?;
    let sizes = source.sizes.map(|asked| xml_sizes::sizes(&mut arrays, &file, asked)).transpose()?;
    let mut content = point_sizes::give(content, sizes);
    // Last: nothing else is missing for what they take of the budget.
    if keeps {
        let mut keeping = Keeping::new(source.limits, source.bytes.len());
        xml_fields::keep(&mut arrays, &file, &cells, &mut keeping).map_err(VtkError::from)?;
        content.fields = keeping.finish(&mut content.notes);
    }
    Ok(content)
}

/// A file that says to be in an encoding of one byte per letter, with another letter for each that is not ASCII: only
/// names hold such, which do not matter here, and the library knows UTF-8 only. Appended data stay as they are.
fn readable(bytes: &[u8]) -> Cow<'_, [u8]> {
    const APPENDED: &[u8] = b"<AppendedData";
    /// How the names of encodings of one byte per letter begin.
    const ONE_BYTE: [&[u8]; 3] = [b"iso-8859-", b"windows-125", b"latin1"];
    let head = &bytes[..bytes.len().min(200)];
    // Up to the end of the first tag, which is the prolog if there is one.
    let prolog = head.split(|byte| *byte == b'>').next().unwrap_or_default().to_ascii_lowercase();
    if !ONE_BYTE.iter().any(|encoding| prolog.windows(encoding.len()).any(|word| word == *encoding)) {
        return Cow::Borrowed(bytes);
    }
    let end = bytes.windows(APPENDED.len()).position(|word| word == APPENDED).unwrap_or(bytes.len());
    let mut readable = bytes.to_vec();
    for byte in &mut readable[..end] {
        if !byte.is_ascii() {
            *byte = b'?';
        }
    }
    Cow::Owned(readable)
}

/// The format as it is told.
fn format(file: &Outline) -> String {
    let appended_base64 = file.appended.is_some_and(|a| a.base64);
    let points = file.pieces.iter().find_map(|p| p.array(Role::Points));
    let encoding = match points.map(|p| p.data) {
        Some(Data::Ascii(..)) | None => return format!("{}, ASCII", file.kind),
        Some(Data::Inline(_)) => "inline base64",
        Some(Data::Appended(_)) if appended_base64 => "appended base64",
        Some(Data::Appended(_)) => "appended raw",
    };
    let compressor = match file.packing.compressor {
        None => "",
        Some(Compressor::Zlib) => ", zlib",
        Some(Compressor::Lz4) => ", lz4",
        Some(Compressor::Lzma) => ", lzma",
    };
    let order = if file.packing.order == Order::Big { ", big-endian" } else { "" };
    format!("{}, {encoding}{compressor}{order}", file.kind)
}

/// Decodes the arrays of a file.
pub(super) struct Arrays<'a> {
    bytes: &'a [u8],
    packing: Packing,
    appended: Option<Appended<'a>>,
    budget: Budget,
}

impl<'a> Arrays<'a> {
    /// The arrays of a file of this outline.
    pub fn new(source: &Source<'a>, file: &Outline<'a>) -> Self {
        let budget = Budget::new(source.bytes.len(), source.limits.unpacked(source.bytes.len()));
        Self { bytes: source.bytes, packing: file.packing, appended: file.appended, budget }
    }

    /// Adds the surface of a piece.
    fn piece(&mut self, piece: &Piece<'a>, surface: &mut Surface) -> Result<(), VtkError> {
        let bytes = self.bytes;
        let location = || Location::line_of(bytes, piece.at);
        if piece.points > surface.room_for_points() {
            let limit = surface.room_for_points();
            return Err(VtkError::TooLarge { location: location(), what: "points", declared: piece.points, limit });
        }
        let points = match piece.array(Role::Points) {
            Some(array) => self.points(&array, piece.points)?,
            None => Vec::new(),
        };
        surface.add_points(points, location)?;
        for (section, count) in Section::ALL.into_iter().zip(piece.cells) {
            match section {
                _ if count == 0 => {}
                Section::Verts => surface.skip(Rank::First, count as usize),
                Section::Lines => surface.skip(Rank::Lines, count as usize),
                Section::Cells | Section::Strips | Section::Polys => self.cells(piece, section, count, surface)?,
            }
        }
        Ok(())
    }

    /// Adds the cells of a section.
    fn cells(
        &mut self,
        piece: &Piece<'a>,
        section: Section,
        count: u64,
        surface: &mut Surface,
    ) -> Result<(), VtkError> {
        let ends = self.ids(piece, Role::Offsets(section), count)?;
        // The end of the last cell tells how many corners there are.
        let needed = ends.last().copied().unwrap_or_default();
        let corners = self.ids(piece, Role::Connectivity(section), u64::from(needed))?;
        let own_types: Vec<u8>;
        let types = match section.cell_type() {
            Some(one) => Types::All(one),
            None => {
                let types = self.ids(piece, Role::Types, count)?;
                // What does not fit is no type that VTK has; neither is 255.
                own_types = types.into_iter().map(|t| u8::try_from(t).unwrap_or(u8::MAX)).collect();
                Types::Each(&own_types)
            }
        };
        let cells = Cells { section: section.name(), types, corners: &corners, ends: &ends };
        surface.add_cells(&cells, || Location::line_of(self.bytes, piece.at))
    }

    /// The first `count` points of an array.
    fn points(&mut self, array: &Array<'a>, count: u64) -> Result<Vec<Vec3>, VtkError> {
        let name = Role::Points.name();
        if let Some(components) = array.components.filter(|c| *c != 3) {
            let problem = format!("Points have {components} components instead of 3");
            return Err(VtkError::Syntax { location: Location::line_of(self.bytes, array.at), problem });
        }
        if let Data::Ascii(bytes, at) = array.data {
            return Text { bytes, at }.points(&name, count);
        }
        let bytes = self.bytes_of(array, &name)?;
        let bytes = self.first(array, &name, count.saturating_mul(3), &bytes)?;
        Ok(array.scalar.points(bytes, self.packing.order))
    }

    /// The first `count` numbers of an array.
    fn ids(&mut self, piece: &Piece<'a>, role: Role, count: u64) -> Result<Vec<u32>, VtkError> {
        let name = role.name();
        let Some(array) = piece.array(role) else {
            let location = Location::line_of(self.bytes, piece.at);
            return Err(VtkError::Count { location, what: name, declared: count, there: 0 });
        };
        if let Data::Ascii(bytes, at) = array.data {
            return Text { bytes, at }.ids(&name, count);
        }
        let bytes = self.bytes_of(&array, &name)?;
        let bytes = self.first(&array, &name, count, &bytes)?;
        array.scalar.ids(bytes, self.packing.order).map_err(|bad| {
            let problem = format!("number {} of {name} is {}, which is no id", bad.entry, bad.value);
            VtkError::Syntax { location: self.location(&array), problem }
        })
    }

    /// The bytes of the first numbers of an array, as many as are `declared`.
    pub fn first<'b>(&self, array: &Array, name: &str, declared: u64, bytes: &'b [u8]) -> Result<&'b [u8], VtkError> {
        let there = bytes.len() as u64 / array.scalar.bytes();
        if declared > there {
            return Err(VtkError::Count { location: self.location(array), what: name.to_owned(), declared, there });
        }
        // No more than there are: nothing overflows.
        Ok(&bytes[..(declared * array.scalar.bytes()) as usize])
    }

    /// In which order the bytes of numbers stand.
    pub fn order(&self) -> Order {
        self.packing.order
    }

    /// Where the numbers of an array begin.
    pub fn location(&self, array: &Array) -> Location {
        match (array.data, self.appended) {
            (Data::Appended(offset), Some(appended)) => Location::Byte(appended.at.saturating_add(offset as usize)),
            _ => Location::line_of(self.bytes, array.at),
        }
    }

    /// The appended data from a byte on; where they end, their own header tells.
    fn appended(&self, array: &Array, name: &str, offset: u64, appended: Appended<'a>) -> Result<Stream<'a>, VtkError> {
        let data = usize::try_from(offset).ok().and_then(|offset| appended.bytes.get(offset..));
        match data {
            Some(data) if appended.base64 => Ok(Stream::base64(data)),
            Some(data) => Ok(Stream::Raw(data)),
            None => {
                let problem = format!("{name} begin at byte {offset} of {} appended bytes", appended.bytes.len());
                Err(VtkError::Syntax { location: Location::line_of(self.bytes, array.at), problem })
            }
        }
    }

    /// The bytes of an array that is no text.
    pub fn bytes_of(&mut self, array: &Array<'a>, name: &str) -> Result<Cow<'a, [u8]>, VtkError> {
        let stream = match (array.data, self.appended) {
            (Data::Appended(offset), Some(appended)) => self.appended(array, name, offset, appended)?,
            (Data::Appended(_), None) => {
                let problem = format!("{name} are appended, but there is no <AppendedData>: the file was cut off");
                return Err(VtkError::Syntax { location: Location::line_of(self.bytes, array.at), problem });
            }
            (Data::Inline(text), _) => Stream::base64_with_blanks(text),
            (Data::Ascii(..), _) => Stream::Raw(&[]),
        };
        unpack(stream, self.packing, &mut self.budget).map_err(|problem| {
            let (location, what) = (self.location(array), name.to_owned());
            VtkError::Packed { location, what, problem }
        })
    }
}
