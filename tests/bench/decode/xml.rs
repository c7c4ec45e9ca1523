//! VTK XML files: appended raw, and packed in other ways for information.

use crate::Case;
use crate::surface::{Surface, put};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use std::io::Write;

pub const CASES: &[Case] = &[
    Case::new("VTU raw", "vtu", |s| file(s, &Layout { grid: true, ..RAW })),
    Case::new("VTU raw, quads", "vtu", |s| file(s, &Layout { grid: true, quads: true, ..RAW })),
    Case::new("VTP raw", "vtp", |s| file(s, &RAW)),
    Case::new("VTP raw, quads", "vtp", |s| file(s, &Layout { quads: true, ..RAW })),
    Case::new("VTU raw, doubles, Int32", "vtu", |s| file(s, &Layout { grid: true, double: true, short: true, ..RAW })),
    Case::new("VTU inline base64", "vtu", |s| file(s, &Layout { grid: true, way: Way::Inline, ..RAW })).packed(),
    Case::new("VTU raw, zlib", "vtu", |s| file(s, &Layout { grid: true, way: Way::Zlib, ..RAW })).packed(),
    Case::new("VTU raw, lz4", "vtu", |s| file(s, &Layout { grid: true, way: Way::Lz4, ..RAW })).packed(),
    Case::new("VTP raw, zlib", "vtp", |s| file(s, &Layout { way: Way::Zlib, ..RAW })).packed(),
];

/// How arrays are stored.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    Raw,
    Inline,
    Zlib,
    Lz4,
}

/// How a file is laid out.
#[derive(Clone, Copy)]
struct Layout {
    way: Way,
    /// An unstructured grid; polygons where not.
    grid: bool,
    quads: bool,
    double: bool,
    /// Ids of 32 bits.
    short: bool,
}

const RAW: Layout = Layout { way: Way::Raw, grid: false, quads: false, double: false, short: false };

/// Bytes of a block before compression: what VTK writes.
const BLOCK: usize = 1 << 15;

fn file(surface: &Surface, layout: &Layout) -> Vec<u8> {
    let faces = if layout.quads { surface.quads.len() } else { surface.triangles.len() };
    let (kind, section) = if layout.grid { ("UnstructuredGrid", "Cells") } else { ("PolyData", "Polys") };
    let counts = if layout.grid { "NumberOfCells" } else { "NumberOfPolys" };
    let compressor = match layout.way {
        Way::Zlib => " compressor=\"vtkZLibDataCompressor\"",
        Way::Lz4 => " compressor=\"vtkLZ4DataCompressor\"",
        Way::Raw | Way::Inline => "",
    };
    let mut writer = Writer { way: layout.way, text: String::new(), data: Vec::new() };
    writer.text += &format!(
        "<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\"{compressor}>\n\
         <{kind}><Piece NumberOfPoints=\"{}\" {counts}=\"{faces}\">\n<Points>\n",
        surface.points.len()
    );
    writer.points(surface, layout);
    writer.text += &format!("</Points>\n<{section}>\n");
    writer.cells(surface, layout);
    writer.text += &format!("</{section}>\n</Piece></{kind}>\n");
    writer.finish()
}

/// The outline of a file, and its appended data.
struct Writer {
    way: Way,
    text: String,
    data: Vec<u8>,
}

impl Writer {
    fn points(&mut self, surface: &Surface, layout: &Layout) {
        let mut bytes = Vec::new();
        let all = surface.points.iter().flatten().copied();
        if layout.double {
            put(&mut bytes, false, all);
        } else {
            put(&mut bytes, false, all.map(|c| c as f32));
        }
        let kind = if layout.double { "Float64" } else { "Float32" };
        self.array(kind, "Points\" NumberOfComponents=\"3", &bytes);
    }

    fn cells(&mut self, surface: &Surface, layout: &Layout) {
        let (corners, size): (Vec<u32>, u32) = match layout.quads {
            true => (surface.quads.iter().flatten().copied().collect(), 4),
            false => (surface.triangles.iter().flatten().copied().collect(), 3),
        };
        let ends: Vec<u32> = (1..=corners.len() as u32 / size).map(|i| size * i).collect();
        for (name, ids) in [("connectivity", &corners), ("offsets", &ends)] {
            let mut bytes = Vec::new();
            if layout.short {
                put(&mut bytes, false, ids.iter().map(|i| *i as i32));
            } else {
                put(&mut bytes, false, ids.iter().map(|i| i64::from(*i)));
            }
            self.array(if layout.short { "Int32" } else { "Int64" }, name, &bytes);
        }
        if layout.grid {
            self.array("UInt8", "types", &vec![if layout.quads { 9 } else { 5 }; ends.len()]);
        }
    }

    fn array(&mut self, kind: &str, name: &str, bytes: &[u8]) {
        let head = format!("<DataArray type=\"{kind}\" Name=\"{name}\"");
        if self.way == Way::Inline {
            let sized = [&(bytes.len() as u64).to_le_bytes()[..], bytes].concat();
            self.text += &format!("{head} format=\"binary\">{}</DataArray>\n", BASE64_STANDARD.encode(sized));
            return;
        }
        self.text += &format!("{head} format=\"appended\" offset=\"{}\"/>\n", self.data.len());
        match self.way {
            Way::Raw | Way::Inline => {
                put(&mut self.data, false, [bytes.len() as u64]);
                self.data.extend(bytes);
            }
            Way::Zlib => self.blocks(bytes, zlib),
            Way::Lz4 => self.blocks(bytes, lz4_flex::block::compress),
        }
    }

    /// Compressed blocks after their sizes.
    fn blocks(&mut self, bytes: &[u8], compress: fn(&[u8]) -> Vec<u8>) {
        let blocks: Vec<Vec<u8>> = bytes.chunks(BLOCK).map(compress).collect();
        put(&mut self.data, false, [blocks.len(), BLOCK, bytes.len() % BLOCK].map(|n| n as u64));
        put(&mut self.data, false, blocks.iter().map(|b| b.len() as u64));
        self.data.extend(blocks.concat());
    }

    fn finish(self) -> Vec<u8> {
        let mut bytes = self.text.into_bytes();
        if self.way != Way::Inline {
            bytes.extend(b"<AppendedData encoding=\"raw\">\n_");
            bytes.extend(self.data);
            bytes.extend(b"\n</AppendedData>\n");
        }
        bytes.extend(b"</VTKFile>\n");
        bytes
    }
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    // Writing to memory does not fail.
    let _ = encoder.write_all(bytes);
    encoder.finish().unwrap_or_default()
}
