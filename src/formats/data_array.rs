//! The data arrays of VTK's XML files: blocks of 32 KiB packed by LZ4, as base64 within the element.
//!
//! `vtkio` reads them, and would write the same bytes, but copies every array five times on the way. This makes the
//! text of an array once, for all files that hold it. Layout: <https://vtk.org/Wiki/VTK_XML_Formats>.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

/// The size of a block before it is packed, in bytes.
const BLOCK: usize = 32768;

/// A number that an array may hold.
pub trait Number: Copy {
    /// What VTK calls its type.
    const TYPE: &str;

    /// Appends its bytes, the lowest one first.
    fn write(self, bytes: &mut Vec<u8>);

    /// As the range of the array tells it.
    fn as_double(self) -> f64;
}

macro_rules! number {
    ($type:ty, $name:literal) => {
        impl Number for $type {
            const TYPE: &str = $name;

            fn write(self, bytes: &mut Vec<u8>) {
                bytes.extend(self.to_le_bytes());
            }

            fn as_double(self) -> f64 {
                self as f64
            }
        }
    };
}

number!(u8, "UInt8");
number!(i32, "Int32");
number!(u64, "UInt64");
number!(f64, "Float64");

/// Appends the `DataArray` element of `values`, so many of which make one entry.
pub fn write<T: Number>(text: &mut String, name: &str, components: usize, values: impl IntoIterator<Item = T>) {
    let mut bytes = Vec::new();
    let mut range: Option<(f64, f64)> = None;
    for value in values {
        value.write(&mut bytes);
        let v = value.as_double();
        range = Some(range.map_or((v, v), |(low, high)| (low.min(v), high.max(v))));
    }
    *text += &format!("<DataArray type=\"{}\" Name=\"{name}\"", T::TYPE);
    if components > 1 {
        *text += &format!(" NumberOfComponents=\"{components}\"");
    }
    *text += " format=\"binary\"";
    if let Some((low, high)) = range {
        *text += &format!(" RangeMin=\"{low}\" RangeMax=\"{high}\"");
    }
    *text += ">";
    pack(text, &bytes);
    *text += "</DataArray>";
}

/// Appends the packed bytes: number of blocks, their size, that of the last one, and the packed size of each; then the
/// blocks. The last block is shorter than the others, perhaps empty.
fn pack(text: &mut String, bytes: &[u8]) {
    let (whole, last) = bytes.as_chunks::<BLOCK>();
    let mut header = vec![whole.len() + 1, BLOCK, last.len()];
    let mut packed = Vec::with_capacity(bytes.len());
    for block in whole.iter().map(|b| &b[..]).chain([last]) {
        let one = lz4_flex::block::compress(block);
        header.push(one.len());
        packed.extend(one);
    }
    let header: Vec<u8> = header.iter().flat_map(|n| (*n as u64).to_le_bytes()).collect();
    BASE64_STANDARD.encode_string(header, text);
    BASE64_STANDARD.encode_string(packed, text);
}

#[cfg(test)]
mod tests {
    use super::*;
    use vtkio::model::{Attribute, Attributes, ByteOrder, DataArray, DataSet, IOBuffer, PolyDataPiece, Version, Vtk};
    use vtkio::xml::Compressor;

    /// The element that `vtkio` makes of the same values.
    fn by_vtkio(components: u32, values: impl Into<IOBuffer>) -> String {
        let array = Attribute::DataArray(DataArray::new("values", components).with_data(values));
        let data = Attributes { point: vec![array], cell: vec![] };
        let piece = PolyDataPiece { points: Vec::<f64>::new().into(), data, ..PolyDataPiece::default() };
        let vtk = Vtk {
            version: Version::new_xml(1, 0),
            byte_order: ByteOrder::LittleEndian,
            title: String::new(),
            file_path: None,
            data: DataSet::inline(piece),
        };
        let mut bytes = Vec::new();
        vtk.try_into_xml_format(Compressor::LZ4, 1).expect("sound").write(&mut bytes).expect("written");
        let text = String::from_utf8(bytes).expect("text");
        let from = text.find("<DataArray").expect("an array");
        let to = text.find("</DataArray>").expect("its end");
        text[from..to].to_owned() + "</DataArray>"
    }

    fn ours<T: Number>(components: usize, values: &[T]) -> String {
        let mut text = String::new();
        write(&mut text, "values", components, values.iter().copied());
        text
    }

    #[test]
    fn arrays_are_those_of_vtkio() {
        for count in [0, 1, 4095, 4096, 4098, 20000] {
            let doubles: Vec<f64> = (0..count).map(|i| (f64::from(i) - 7.5).powi(3) * 1e-3).collect();
            assert_eq!(ours(2, &doubles), by_vtkio(2, doubles.clone()), "{count} doubles");
            let whole: Vec<i32> = (0..count).map(|i| i % 1000 - 3).collect();
            assert_eq!(ours(1, &whole), by_vtkio(1, whole.clone()), "{count} integers");
            let small: Vec<u8> = (0..count).map(|i| (i * i % 251) as u8).collect();
            assert_eq!(ours(1, &small), by_vtkio(1, small.clone()), "{count} bytes");
        }
        let large = vec![1e300, -1e-300, 0.1 + 0.2];
        assert_eq!(ours(3, &large), by_vtkio(3, large.clone()));
    }
}
