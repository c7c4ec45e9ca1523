//! A small writer of XML files in every encoding.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// Where the numbers of arrays stand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    Ascii,
    Inline,
    /// As inline, the sizes apart from the data also where nothing is compressed, and the lines broken.
    Apart,
    AppendedBase64,
    AppendedRaw,
}

/// How a file is written.
#[derive(Clone, Copy, Debug)]
pub(super) struct Style {
    pub encoding: Encoding,
    pub compressor: Option<&'static str>,
    pub wide: bool,
    pub big: bool,
    /// Bytes of a block.
    pub block: usize,
}

pub(super) const PLAIN: Style =
    Style { encoding: Encoding::AppendedRaw, compressor: None, wide: true, big: false, block: 100 };

/// Every combination.
pub(super) fn styles() -> Vec<Style> {
    let mut all = Vec::new();
    use Encoding::*;
    for encoding in [Ascii, Inline, Apart, AppendedBase64, AppendedRaw] {
        for compressor in [None, Some("ZLib"), Some("LZ4"), Some("LZMA")] {
            for (wide, big) in [(false, false), (false, true), (true, false), (true, true)] {
                // Blocks that fit, and blocks that do not.
                for block in [16, 100] {
                    all.push(Style { encoding, compressor, wide, big, block });
                }
            }
        }
    }
    all
}

impl Style {
    fn word(self, n: u64) -> Vec<u8> {
        match (self.wide, self.big) {
            (true, true) => n.to_be_bytes().to_vec(),
            (true, false) => n.to_le_bytes().to_vec(),
            (false, true) => (n as u32).to_be_bytes().to_vec(),
            (false, false) => (n as u32).to_le_bytes().to_vec(),
        }
    }

    /// The sizes and the data of an array.
    fn pack(self, bytes: &[u8]) -> (Vec<u8>, Vec<u8>) {
        let Some(compressor) = self.compressor else { return (self.word(bytes.len() as u64), bytes.to_vec()) };
        let blocks: Vec<Vec<u8>> = bytes.chunks(self.block).map(|b| compress(compressor, b)).collect();
        let mut sizes = [blocks.len(), self.block, bytes.len() % self.block].map(|n| self.word(n as u64)).concat();
        blocks.iter().for_each(|b| sizes.extend(self.word(b.len() as u64)));
        (sizes, blocks.concat())
    }

    /// An array as it stands in the file, or in the appended data.
    fn encode(self, bytes: &[u8]) -> Vec<u8> {
        let (sizes, data) = self.pack(bytes);
        let apart = self.compressor.is_some() || self.encoding == Encoding::Apart;
        match self.encoding {
            Encoding::AppendedRaw => [sizes, data].concat(),
            _ if apart => (BASE64_STANDARD.encode(sizes) + &BASE64_STANDARD.encode(data)).into_bytes(),
            _ => BASE64_STANDARD.encode([sizes, data].concat()).into_bytes(),
        }
    }
}

pub(super) fn compress(compressor: &str, bytes: &[u8]) -> Vec<u8> {
    use std::io::Write;
    match compressor {
        "ZLib" => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
            encoder.write_all(bytes).expect("written");
            encoder.finish().expect("finished")
        }
        "LZ4" => lz4_flex::block::compress(bytes),
        _ => xz(bytes, 12),
    }
}

fn crc32(bytes: &[u8]) -> [u8; 4] {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum().to_le_bytes()
}

/// An xz file of one block that holds a short array as it is; `dictionary` tells the size of the dictionary.
pub(super) fn xz(bytes: &[u8], dictionary: u8) -> Vec<u8> {
    let with_crc = |part: &[u8]| [part, &crc32(part)].concat();
    let padded = |mut part: Vec<u8>| {
        part.resize(part.len().next_multiple_of(4), 0);
        part
    };
    assert!((1..100).contains(&bytes.len()), "sizes fit one byte");
    let data = [&[1, 0, bytes.len() as u8 - 1], bytes, &[0]].concat();
    let unpadded = (12 + data.len() + 4) as u8;
    let index = with_crc(&padded(vec![0, 1, unpadded, bytes.len() as u8]));
    let footer = [&[(index.len() / 4 - 1) as u8, 0, 0, 0][..], &[0, 1]].concat();
    [
        b"\xfd7zXZ\0".to_vec(),
        with_crc(&[0, 1]),
        with_crc(&[2, 0, 0x21, 1, dictionary, 0, 0, 0]),
        padded(data),
        crc32(bytes).to_vec(),
        index,
        [&crc32(&footer)[..], &footer, b"YZ"].concat(),
    ]
    .concat()
}

/// A file as it is written.
struct File {
    style: Style,
    xml: String,
    appended: Vec<u8>,
    kind: &'static str,
}

impl File {
    fn new(style: Style, kind: &'static str) -> Self {
        let mut xml = format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\"");
        xml += if style.big { " byte_order=\"BigEndian\"" } else { " byte_order=\"LittleEndian\"" };
        // Without one it is narrow.
        xml += if style.wide { " header_type=\"UInt64\"" } else { "" };
        xml += &style.compressor.map_or(String::new(), |c| format!(" compressor=\"vtk{c}DataCompressor\""));
        xml += &format!(">\n<{kind}>\n<FieldData>\n");
        let file = Self { style, xml, appended: Vec::new(), kind };
        file.array("Float64", "TIME", "", &[0.5], f64::to_be_bytes).text("</FieldData>\n")
    }

    fn text(mut self, text: &str) -> Self {
        self.xml += text;
        self
    }

    fn array<T: Copy + ToString, const N: usize>(
        mut self,
        kind: &str,
        name: &str,
        more: &str,
        numbers: &[T],
        bytes: fn(T) -> [u8; N],
    ) -> Self {
        let turned = |n: &T| {
            let mut bytes = bytes(*n);
            if !self.style.big {
                bytes.reverse();
            }
            bytes
        };
        let bytes: Vec<u8> = numbers.iter().flat_map(turned).collect();
        let text = match self.style.encoding {
            Encoding::Ascii => numbers.iter().map(|n| format!("{} ", n.to_string())).collect(),
            _ => String::from_utf8(self.style.encode(&bytes)).unwrap_or_default(),
        };
        let (format, text) = match self.style.encoding {
            Encoding::Ascii => ("ascii".to_owned(), text),
            Encoding::Inline => ("binary".to_owned(), format!("{INFORMATION}\n{text}\n")),
            Encoding::Apart => ("binary".to_owned(), format!("{}\n{}\n", &text[..10], &text[10..])),
            Encoding::AppendedBase64 | Encoding::AppendedRaw => {
                let offset = self.appended.len();
                self.appended.extend(self.style.encode(&bytes));
                (format!("appended\" offset=\"{offset}"), INFORMATION.to_owned())
            }
        };
        self.text(&format!("<DataArray format=\"{format}\" {more} type=\"{kind}\" Name='{name}'>{text}</DataArray>\n"))
    }

    /// An array of strings.
    fn strings(self, name: &str, strings: &[&str]) -> Self {
        let bytes: Vec<u8> = strings.iter().flat_map(|string| [string.as_bytes(), b"\0"].concat()).collect();
        let before = self.xml.len();
        let mut file = self.array("String", name, "", &bytes, u8::to_be_bytes);
        let array = file.xml.split_off(before).replace("DataArray", "Array");
        file.text(&array)
    }

    /// Arrays of cells with these values, as numbers of every type, and as strings.
    fn cell_data(self, values: &[u8]) -> Self {
        let words: Vec<String> = values.iter().map(|value| format!("part {value} é")).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let components = "NumberOfComponents=\"1\"";
        self.text("<CellData>\n")
            .array("Int8", "Int8", components, &cast::<i8>(values), i8::to_be_bytes)
            .array("UInt8", "UInt8", "", values, u8::to_be_bytes)
            .array("Int16", "Int16", "", &cast::<i16>(values), i16::to_be_bytes)
            .array("UInt16", "UInt16", "", &cast::<u16>(values), u16::to_be_bytes)
            .array("Int32", "Int32", "", &cast::<i32>(values), i32::to_be_bytes)
            .array("UInt32", "UInt32", "", &cast::<u32>(values), u32::to_be_bytes)
            .array("Int64", "Int64", "", &cast::<i64>(values), i64::to_be_bytes)
            .array("UInt64", "UInt64", "", &cast::<u64>(values), u64::to_be_bytes)
            .array("Float32", "Float32", "", &cast::<f32>(values), f32::to_be_bytes)
            .strings("a &lt; &quot;b&quot;", &words)
            .array("Int32", "Vector", THREE, &[0; 18], i32::to_be_bytes)
            .text("</CellData>\n")
    }

    /// An array of cells as planish writes it.
    fn label(self, values: &[i32]) -> Self {
        self.text("<CellData>\n").array("Int32", "label", "", values, i32::to_be_bytes).text("</CellData>\n")
    }

    /// Cells of a section, and their types.
    fn cells(self, section: &str, cells: &[&[i64]], types: &[u8]) -> Self {
        let ends = cells.iter().scan(0, |end, c| {
            *end += c.len() as i32;
            Some(*end)
        });
        let file = self.text(&format!("<{section}>\n"));
        let file = file.array("Int32", "offsets", "", &ends.collect::<Vec<_>>(), i32::to_be_bytes);
        let file = file.array("Int64", "connectivity", "", &cells.concat(), i64::to_be_bytes);
        let file = if types.is_empty() { file } else { file.array("UInt8", "types", "", types, u8::to_be_bytes) };
        file.text(&format!("</{section}>\n"))
    }

    fn points(self, numbers: &[f32]) -> Self {
        let file = self.text("<PointData Scalars=\"connectivity\">\n");
        let file =
            file.array("Float32", "connectivity", "", &[1.0, 2.0, 3.0, 4.0], f32::to_be_bytes).text("</PointData>\n");
        let file = file.text("<Points>\n").array("Float32", "Points", THREE, numbers, f32::to_be_bytes);
        file.text("</Points>\n")
    }

    fn finish(self) -> Vec<u8> {
        let mut bytes = format!("{}</{}>\n", self.xml, self.kind).into_bytes();
        if !self.appended.is_empty() {
            let raw = self.style.encoding == Encoding::AppendedRaw;
            let encoding = if raw { "raw" } else { "base64" };
            bytes.extend(format!("<AppendedData encoding=\"{encoding}\">\n  _").into_bytes());
            bytes.extend(self.appended);
            bytes.extend(b"\n</AppendedData>\n");
        }
        bytes.extend(b"</VTKFile>\n");
        bytes
    }
}

const INFORMATION: &str = "<InformationKey name=\"L2\"><Value index=\"0\">1</Value></InformationKey>";
const THREE: &str = "NumberOfComponents=\"3\"";
const SQUARE: [f32; 12] = [0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.5];

fn cast<T: TryFrom<u8>>(values: &[u8]) -> Vec<T> {
    values.iter().map(|value| T::try_from(*value).ok().expect("small")).collect()
}

/// Polygons with arrays of cells, which are counted in the order vertices, lines, polygons, strips, whatever the order of
/// sections: 90, 91, 1 and 2, 3. In a second piece there are no such arrays.
pub(super) fn labelled_polydata(style: Style) -> Vec<u8> {
    File::new(style, "PolyData")
        .text("<Piece NumberOfPoints=\"0\"><CellData>")
        .array("Int32", "label", "", &[1], i32::to_be_bytes)
        .text("</CellData></Piece>\n")
        .text("<Piece NumberOfPoints=\"4\" NumberOfVerts=\"1\" NumberOfLines=\"1\" NumberOfStrips=\"1\" NumberOfPolys=\"2\">\n")
        .points(&SQUARE)
        .cells("Strips", &[&[0, 1, 3, 2]], &[])
        .cell_data(&[90, 91, 1, 2, 3])
        .cells("Polys", &[&[0, 1, 2], &[0, 1, 2, 3]], &[])
        .cells("Lines", &[&[0, 1]], &[])
        .cells("Verts", &[&[0]], &[])
        .text("</Piece>\n<Piece NumberOfPoints=\"4\" NumberOfPolys=\"1\">\n")
        .points(&SQUARE)
        .cells("Polys", &[&[0, 1, 2]], &[])
        .text("</Piece>\n")
        .finish()
}

/// A grid of two pieces, in each of which a cell is left out, with an array and names for two of its numbers.
pub(super) fn labelled_grid(style: Style) -> Vec<u8> {
    let piece = "<Piece NumberOfPoints=\"4\" NumberOfCells=\"2\">\n";
    File::new(style, "UnstructuredGrid")
        .text("<FieldData>\n")
        .array("Int32", "the wall", "NumberOfTuples=\"2\"", &[7, 2], i32::to_be_bytes)
        .array("Int32", "nothing of a surface", "NumberOfTuples=\"2\"", &[9, 1], i32::to_be_bytes)
        .text(&format!("</FieldData>\n{piece}"))
        .points(&SQUARE)
        .label(&[90, 7])
        .cells("Cells", &[&[0, 1], &[0, 1, 2, 3]], &[3, 9])
        .text(&format!("</Piece>\n{piece}"))
        .points(&SQUARE)
        .label(&[9, 90])
        .cells("Cells", &[&[0, 1, 2], &[0, 1, 2, 3]], &[5, 10])
        .text("</Piece>\n")
        .finish()
}

/// Two pieces and an empty one, with arrays of points of every type; in the last piece there is only one of them. Point 8 belongs
/// to no triangle.
pub(super) fn sized_grid(style: Style) -> Vec<u8> {
    let piece = |points| format!("<Piece NumberOfPoints=\"{points}\" NumberOfCells=\"1\">\n");
    let values = [3, 1, 4, 0];
    let empty = "<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"><PointData>";
    File::new(style, "UnstructuredGrid")
        .text(empty)
        .array("Float64", "Float64", "", &[7.0], f64::to_be_bytes)
        .text(&format!("</PointData></Piece>\n{}<PointData>\n", piece(4)))
        .array("Int8", "Int8", "NumberOfComponents=\"1\"", &cast::<i8>(&values), i8::to_be_bytes)
        .array("UInt8", "UInt8", "", &values, u8::to_be_bytes)
        .array("Int16", "Int16", "", &cast::<i16>(&values), i16::to_be_bytes)
        .array("UInt16", "UInt16", "", &cast::<u16>(&values), u16::to_be_bytes)
        .array("Int32", "Int32", "", &cast::<i32>(&values), i32::to_be_bytes)
        .array("UInt32", "UInt32", "", &cast::<u32>(&values), u32::to_be_bytes)
        .array("Int64", "Int64", "", &cast::<i64>(&values), i64::to_be_bytes)
        .array("UInt64", "UInt64", "", &cast::<u64>(&values), u64::to_be_bytes)
        .array("Float32", "Float32", "", &cast::<f32>(&values), f32::to_be_bytes)
        .array("Float64", "Float64", "", &cast::<f64>(&values), f64::to_be_bytes)
        .array("Float64", "a &lt; b", "", &[0.5, 0.25, f64::NAN, -1.0], f64::to_be_bytes)
        .strings("words", &["a", "b", "c", "d"])
        .array("Float32", "Vector", THREE, &SQUARE, f32::to_be_bytes)
        .text("</PointData>\n<Points>\n")
        .array("Float32", "Points", THREE, &SQUARE, f32::to_be_bytes)
        .text("</Points>\n")
        .cells("Cells", &[&[0, 1, 2, 3]], &[9])
        .text(&format!("</Piece>\n{}<PointData>\n", piece(5)))
        .array("Float64", "Float64", "", &[5.0, 6.0, 7.0, 8.0, -9.0], f64::to_be_bytes)
        .text("</PointData>\n<Points>\n")
        .array("Float32", "Points", THREE, &[&SQUARE[..], &[9.0; 3]].concat(), f32::to_be_bytes)
        .text("</Points>\n")
        .cells("Cells", &[&[0, 1, 2, 3]], &[9])
        .text("</Piece>\n")
        .finish()
}

/// Two pieces and an empty one.
pub(super) fn grid(style: Style) -> Vec<u8> {
    let piece = "<Piece NumberOfPoints=\"4\" NumberOfCells=\"";
    File::new(style, "UnstructuredGrid")
        .text(&format!("{piece}2\">\n"))
        .points(&SQUARE)
        .cells("Cells", &[&[0, 1, 2], &[0, 1, 2, 3]], &[5, 9])
        .text("</Piece>\n<Piece NumberOfPoints=\"0\" NumberOfCells=\"0\"/>\n")
        .text(&format!("{piece}3\">\n"))
        .points(&SQUARE)
        .cells("Cells", &[&[0, 1, 2, 3, 3, 3], &[0, 1, 2, 3], &[0, 1]], &[22, 10, 3])
        .text("</Piece>\n")
        .finish()
}

pub(super) fn polydata(style: Style) -> Vec<u8> {
    File::new(style, "PolyData")
        .text("<Piece NumberOfPoints=\"4\" NumberOfVerts=\"1\" NumberOfLines=\"1\" NumberOfStrips=\"1\" NumberOfPolys=\"2\">\n")
        .points(&SQUARE)
        .cells("Verts", &[&[0]], &[])
        .cells("Lines", &[&[0, 1]], &[])
        .cells("Strips", &[&[0, 1, 3, 2]], &[])
        .cells("Polys", &[&[0, 1, 2], &[0, 1, 2, 3]], &[])
        .text("</Piece>\n")
        .finish()
}
