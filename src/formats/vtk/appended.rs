//! Writes `.vtu` files: one piece, whose arrays stand behind the outline as raw bytes, in compressed blocks. That is the form in
//! which ParaView itself writes, and the smallest that all readers know.
//!
//! (`vtkio` 0.7 writes arrays inline in base64, which is a third more, and compresses with the general deflate, which takes
//! twice the time. It writes seams.vtp, which is small.)

use libdeflater::{CompressionLvl, Compressor};
use quick_xml::escape::escape;
use std::fmt::Write;

/// Bytes of a block before compression. VTK unpacks a block at a time; smaller ones compress worse.
const BLOCK: usize = 1 << 18;

/// The level of libdeflate. By measurement on both files of a result of 100,000 triangles: level 1 is as quick and 5 % larger,
/// level 6 half as quick and no smaller.
const LEVEL: i32 = 2;

/// An array, packed as it stands in a file.
pub(super) struct Array {
    name: String,
    components: usize,
    kind: &'static str,
    packed: Vec<u8>,
}

impl Array {
    fn new(name: &str, components: usize, kind: &'static str, bytes: &[u8]) -> Self {
        Self { name: name.to_owned(), components, kind, packed: packed(bytes) }
    }

    /// Doubles.
    pub fn doubles(name: &str, components: usize, values: impl Iterator<Item = f64>) -> Self {
        let bytes: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
        Self::new(name, components, "Float64", &bytes)
    }

    /// Numbers that are read by people and shown as colours: floats, where these hold all of them with seven digits, else doubles.
    pub fn field(name: &str, values: impl Iterator<Item = f64> + Clone) -> Self {
        let is_float = |v: f64| v == 0.0 || (v as f32).is_normal();
        if !values.clone().all(is_float) {
            return Self::doubles(name, 1, values);
        }
        let bytes: Vec<u8> = values.flat_map(|v| (v as f32).to_le_bytes()).collect();
        Self::new(name, 1, "Float32", &bytes)
    }

    /// Whole numbers, signed, as VTK's are: of unsigned ones meshio makes floating-point numbers, with which numpy takes no
    /// points.
    pub fn integers(name: &str, values: impl Iterator<Item = i32>) -> Self {
        let bytes: Vec<u8> = values.flat_map(i32::to_le_bytes).collect();
        Self::new(name, 1, "Int32", &bytes)
    }

    /// Whole numbers of any size.
    pub fn whole(name: &str, components: usize, values: impl Iterator<Item = i64>) -> Self {
        let bytes: Vec<u8> = values.flat_map(i64::to_le_bytes).collect();
        Self::new(name, components, "Int64", &bytes)
    }

    /// Numbers of points or of their places, up to `most`.
    fn ids(name: &str, most: u64, values: impl Iterator<Item = u64>) -> Self {
        match i32::try_from(most) {
            Ok(_) => Self::integers(name, values.map(|v| v as i32)),
            Err(_) => Self::whole(name, 1, values.map(|v| v as i64)),
        }
    }

    /// Bytes.
    pub fn bytes(name: &str, bytes: &[u8]) -> Self {
        Self::new(name, 1, "UInt8", bytes)
    }

    /// The element of the outline, for data that stand at `offset`.
    fn element(&self, offset: usize) -> String {
        let Self { name, components, kind, .. } = self;
        let name = escape(name.as_str());
        let components = if *components == 1 { String::new() } else { format!(" NumberOfComponents=\"{components}\"") };
        format!("<DataArray type=\"{kind}\" Name=\"{name}\"{components} format=\"appended\" offset=\"{offset}\"/>")
    }
}

/// Triangles of three or six nodes, with what is known of nodes and cells.
pub(super) struct Grid {
    /// How many nodes there are.
    pub count: usize,
    /// Their positions.
    pub points: Array,
    /// The nodes of one cell after the other.
    pub cells: Vec<u32>,
    /// Three or six.
    pub nodes_per_cell: usize,
    pub of_points: Vec<Array>,
    pub of_cells: Vec<Array>,
    /// The element `FieldData`, if there is any.
    pub field_data: String,
}

impl Grid {
    /// The bytes of a file.
    pub fn into_bytes(self) -> Vec<u8> {
        let per_cell = self.nodes_per_cell;
        let cells = self.cells.len() / per_cell;
        let kind = if per_cell == 3 { super::cell::TRIANGLE } else { super::cell::QUADRATIC_TRIANGLE };
        let nodes = self.cells.iter().map(|n| u64::from(*n));
        let topology = [
            Array::ids("connectivity", self.count as u64, nodes),
            Array::ids("offsets", self.cells.len() as u64, (1..=cells as u64).map(|i| per_cell as u64 * i)),
            Array::bytes("types", &vec![kind; cells]),
        ];
        drop(self.cells);
        let sections: [(&str, Vec<Array>); 4] = [
            ("Points", vec![self.points]),
            ("Cells", topology.into()),
            ("PointData", self.of_points),
            ("CellData", self.of_cells),
        ];
        // Writing to a string cannot fail.
        let mut outline = String::from(
            "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
             compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>",
        );
        let _ = writeln!(outline, "{}", self.field_data);
        let _ = writeln!(outline, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">", self.count);
        let mut offset = 0;
        for (section, arrays) in &sections {
            let _ = writeln!(outline, "<{section}>");
            for array in arrays {
                let _ = writeln!(outline, "{}", array.element(offset));
                offset += array.packed.len();
            }
            let _ = writeln!(outline, "</{section}>");
        }
        outline.push_str("</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
        let mut bytes = outline.into_bytes();
        let end = b"\n</AppendedData>\n</VTKFile>\n";
        bytes.reserve_exact(offset + end.len());
        for (_, arrays) in sections {
            for array in arrays {
                bytes.extend(array.packed);
            }
        }
        bytes.extend(end);
        bytes
    }
}

/// Bytes in compressed blocks, behind a header: how many blocks, the size of one and of the last before compression (0 where
/// that is full), and the size of each after it.
fn packed(bytes: &[u8]) -> Vec<u8> {
    let blocks = bytes.chunks(BLOCK);
    let header = 3 + blocks.len();
    let mut numbers = vec![blocks.len(), BLOCK, bytes.len() % BLOCK];
    let mut packed = vec![0; 8 * header];
    let mut compressor = Compressor::new(CompressionLvl::new(LEVEL).unwrap_or_default());
    for block in blocks {
        let at = packed.len();
        packed.resize(at + compressor.zlib_compress_bound(block.len()), 0);
        let size =
            compressor.zlib_compress(block, &mut packed[at..]).expect("within the bound there is room for any block");
        packed.truncate(at + size);
        numbers.push(size);
    }
    for (place, number) in packed.chunks_exact_mut(8).zip(&numbers) {
        place.copy_from_slice(&(*number as u64).to_le_bytes());
    }
    packed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_of_floats_where_these_hold_it() {
        let kind = |values: &[f64]| Array::field("f", values.iter().copied()).kind;
        assert_eq!(kind(&[]), "Float32");
        assert_eq!(kind(&[0.0, 1.0, -3.4e38, 1e-37]), "Float32");
        for beyond in [1e-39, 1e39, f64::MIN_POSITIVE] {
            assert_eq!(kind(&[1.0, beyond]), "Float64", "{beyond}");
        }
    }

    #[test]
    fn ids_are_wide_where_they_must_be() {
        let kind = |most: u64| Array::ids("i", most, std::iter::once(most)).kind;
        assert_eq!((kind(i32::MAX as u64), kind(i32::MAX as u64 + 1)), ("Int32", "Int64"));
    }
}
