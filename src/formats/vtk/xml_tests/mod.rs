//! XML files in every encoding, written by a small writer, whole, cut off, and lying.

mod fields;
mod files;
mod labels;
mod sizes;

use super::error::{PackedError, VtkError};
use crate::formats::{Content, Format, Limits, ReadError, Source, read_alone};
use crate::outcome::Code;
use files::{Encoding, PLAIN, Style, compress, grid, polydata, styles, xz};

fn error(bytes: &[u8]) -> VtkError {
    match read_alone(Format::Vtu, bytes) {
        Err(ReadError::Vtk(e)) => e,
        other => panic!("{other:?}"),
    }
}

fn limited(bytes: &[u8], limits: Limits) -> Result<Content, ReadError> {
    crate::formats::read(Format::Vtu, &Source::alone(bytes, &limits))
}

#[test]
fn grids_are_read_in_every_encoding() {
    for style in styles() {
        let content = read_alone(Format::Vtu, &grid(style)).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        let (soup, notes) = (content.soup, content.notes);
        assert_eq!((soup.points().len(), soup.points()[3], soup.points()[7]), (8, [0.0, 1.0, 0.5], [0.0, 1.0, 0.5]));
        assert_eq!((soup.triangles().len(), soup.triangles()[0], soup.triangles()[3]), (4, [0, 1, 2], [4, 5, 6]));
        assert_eq!((notes.polygons, notes.mid_nodes, notes.skipped.len()), (1, 1, 2), "{:?}", notes.skipped);
        assert!(notes.format.starts_with("VTU, "), "{}", notes.format);
    }
    let told = |style| read_alone(Format::Vtp, &polydata(style)).expect("read").notes.format;
    assert_eq!(told(PLAIN), "VTP, appended raw");
    let lz4 = Style { compressor: Some("LZ4"), big: true, encoding: Encoding::AppendedBase64, ..PLAIN };
    assert_eq!(told(lz4), "VTP, appended base64, lz4, big-endian");
    assert_eq!(told(Style { encoding: Encoding::Ascii, compressor: Some("ZLib"), ..PLAIN }), "VTP, ASCII");
}

#[test]
fn names_may_be_in_another_encoding_if_the_file_says_so() {
    for style in styles().into_iter().filter(|s| s.block == 100) {
        let plain = read_alone(Format::Vtu, &grid(style)).expect("plain");
        let comment = b"<!-- temp\xe9rature -->";
        let latin = [b"<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?>", &comment[..], &grid(style)].concat();
        assert_eq!(read_alone(Format::Vtu, &latin).unwrap_or_else(|e| panic!("{style:?}: {e}")), plain);
        let untold = [b"<?xml version=\"1.0\"?>", &comment[..], &grid(style)].concat();
        assert!(matches!(error(&untold), VtkError::Syntax { .. }));
    }
}

#[test]
fn polygons_are_read_in_every_encoding() {
    for style in styles() {
        let content = read_alone(Format::Vtp, &polydata(style)).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(content.soup.triangles()[..3], [[0, 1, 3], [1, 2, 3], [0, 1, 2]], "{style:?}");
        let notes = content.notes;
        assert_eq!((notes.polygons, notes.skipped["vertices"], notes.skipped["lines"]), (1, 1, 1));
    }
}

#[test]
fn a_file_that_is_cut_off_gives_an_error_or_the_same_surface() {
    for style in styles().into_iter().filter(|s| s.block == 100 && s.wide != s.big) {
        for whole in [grid(style), polydata(style)] {
            let full = read_alone(Format::Vtu, &whole).expect("whole").soup;
            for end in 0..whole.len() {
                if let Ok(content) = read_alone(Format::Vtu, &whole[..end]) {
                    assert_eq!(content.soup, full, "{style:?}, cut at {end}");
                    assert!(end + 60 > whole.len(), "{style:?}, cut at {end} of {}", whole.len());
                }
            }
        }
    }
}

#[test]
fn files_with_another_byte_anywhere_never_panic() {
    for style in styles().into_iter().filter(|s| s.block == 100 && s.wide && !s.big) {
        let whole = grid(style);
        for at in 0..whole.len() {
            for other in [b'9', 0xff, whole[at] ^ 1] {
                let mut bytes = whole.clone();
                bytes[at] = other;
                let _ = read_alone(Format::Vtu, &bytes);
            }
        }
    }
}

/// A file with these words replaced.
fn changed(style: Style, from: &str, to: &str) -> Vec<u8> {
    let whole = String::from_utf8(polydata(Style { encoding: Encoding::Ascii, ..style })).expect("text");
    assert!(whole.contains(from), "{from}");
    whole.replacen(from, to, 1).into_bytes()
}

#[test]
fn wrong_words_and_counts_are_named_with_their_place() {
    let cases = [
        ("UInt64", "UInt16", "line 2: \"UInt16\" is no header_type"),
        (
            "header_type",
            "compressor=\"vtkBrotliDataCompressor\" header_type",
            "\"vtkBrotliDataCompressor\" is not known",
        ),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"four\"", "NumberOfPoints is no number: \"four\""),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"5\"", "Points should have 15 values, but there are only 12"),
        ("NumberOfPolys=\"2\"", "NumberOfPolys=\"3\"", "offsets of Polys should have 3 values, but there are only 2"),
        ("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"", "Points have 2 components instead of 3"),
        ("NumberOfPoints=\"4\"", "NumberOfPoints=\"3\"", "cell 0 of Strips uses point 3, but there are only 3"),
        ("<Points>", "<Pints>", "this is no XML"),
        ("Name='Points'", "Name='Points'><b>1</b>2<i/", "interrupted"),
        ("format=\"ascii\" NumberOfComponents", "format=\"hex\" NumberOfComponents", "\"hex\" is no format"),
        (
            "format=\"ascii\" NumberOfComponents",
            "format=\"appended\" offset=\"0\" NumberOfComponents",
            "no <AppendedData>",
        ),
        ("type=\"Float32\" Name='Points'", "type=\"String\" Name='Points'", "\"String\" is no type of Points"),
        ("3 7", "3 2", "the offset of cell 0 of Polys is wrong: it ends at 3 of 2"),
        ("<?xml version=\"1.0\"?>", "<?xml version=\"1.0\"?><!DOCTYPE a [<!ENTITY b \"c\">]>", "document type"),
        ("0 1 3 2", "0 1 3 -2", "\"-2\" is no whole number of connectivity of Strips"),
    ];
    for (from, to, expected) in cases {
        let message = error(&changed(PLAIN, from, to)).to_string();
        assert!(message.contains(expected), "{to}: {message}");
    }
    assert!(error(b"<?xml version=\"1.0\"?>\n").to_string().contains("no <VTKFile>"));
    assert!(error(b"<VTKFile type=\"PolyData\"><PolyData/></VTKFile>").to_string().contains("no <Piece>"));
    let empty =
        b"<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"0\"><Points/></Piece></PolyData></VTKFile>";
    assert_eq!(read_alone(Format::Vtp, empty).expect_err("empty").reason().code, Code::NoTriangles);
    let bom = [b"\xef\xbb\xbf\n", &polydata(PLAIN)[..]].concat();
    assert!(read_alone(Format::Vtp, &bom).is_ok(), "a byte order mark");
}

#[test]
fn files_that_hold_no_surface_are_refused_with_a_remedy() {
    let cases = [
        ("ImageData", "Extract Surface"),
        ("StructuredGrid", "Extract Surface"),
        ("RectilinearGrid", "Extract Surface"),
        ("vtkMultiBlockDataSet", "open its pieces"),
        ("PUnstructuredGrid", "open its pieces"),
        ("PPolyData", "open its pieces"),
        ("Table", "save a surface"),
    ];
    for (kind, remedy) in cases {
        let file = format!("<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"0.1\"><{kind}/></VTKFile>");
        let reason = read_alone(Format::Vtu, file.as_bytes()).expect_err("refused").reason();
        assert_eq!((reason.code, reason.location.as_deref()), (Code::UnsupportedFormat, Some("line 2")));
        assert!(reason.message.contains(kind) && reason.message.contains(remedy), "{reason:?}");
    }
}

/// A file whose points are these appended bytes.
fn appended(compressor: &str, points: u64, data: &[u8]) -> Vec<u8> {
    let head = format!(
        "<VTKFile type=\"PolyData\" compressor=\"{compressor}\" header_type=\"UInt64\"><PolyData><Piece \
         NumberOfPoints=\"{points}\"><Points><DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/></Points>\
         </Piece></PolyData><AppendedData encoding=\"raw\">_"
    );
    [head.as_bytes(), data, b"</AppendedData></VTKFile>"].concat()
}

fn words(words: &[u64]) -> Vec<u8> {
    words.iter().flat_map(|w| w.to_le_bytes()).collect()
}

#[test]
fn sizes_that_lie_take_no_memory() {
    for compressor in ["", "vtkZLibDataCompressor", "vtkLZ4DataCompressor", "vtkLZMADataCompressor"] {
        for large in [1 << 40, u64::MAX, u64::MAX / 8 + 1] {
            for lie in [[large, 32, 0, 8], [1, large, 0, 8], [1, 32, large, 8], [1, 32, 0, large], [4, large, 1, 8]] {
                let data = [words(&lie), vec![1; 64]].concat();
                let error = error(&appended(compressor, 1, &data));
                let known = matches!(error, VtkError::Packed { .. } | VtkError::Count { .. });
                assert!(known, "{compressor} {lie:?}: {error}");
            }
            assert!(matches!(error(&appended(compressor, large, &words(&[1, 8, 0, 8]))), VtkError::TooLarge { .. }));
        }
    }
    let inline = "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Int8\" \
                  format=\"binary\">////fwAA!AAA</DataArray></Points></Piece></PolyData></VTKFile>";
    assert!(matches!(error(inline.as_bytes()), VtkError::Packed { problem: PackedError::Short { .. }, .. }));
    let wrong = inline.replace("////fwAA!AAA", "DAAAAAAA!AAAAAAAAAAAAA");
    let wrong = error(wrong.as_bytes()).to_string();
    assert!(wrong.contains("\"!AAA") && wrong.contains("no base64"), "{wrong}");
}

#[test]
fn bombs_are_refused() {
    let bomb = vec![0; 3 << 20];
    for (name, packed) in
        [("vtkZLibDataCompressor", compress("ZLib", &bomb)), ("vtkLZ4DataCompressor", lz4_flex::block::compress(&bomb))]
    {
        let file = appended(name, 1 << 18, &[words(&[1, 3 << 20, 0, packed.len() as u64]), packed.clone()].concat());
        assert!(
            matches!(limited(&file, Limits::default()), Err(ReadError::Soup { .. })),
            "{name}: points and no triangles"
        );
        let refused = limited(&file, Limits { expansion: 2, ..Limits::default() }).expect_err("a bomb").reason();
        assert_eq!(refused.code, Code::TooLarge, "{name}: {refused:?}");
        assert!(refused.message.contains("raise the limit of expansion"), "{refused:?}");
        // Sizes that are too small do not help, and neither do sizes that are too large.
        for size in [1 << 20, (3 << 20) + 1] {
            let file = appended(name, 1, &[words(&[1, size, 0, packed.len() as u64]), packed.clone()].concat());
            assert!(matches!(error(&file), VtkError::Packed { problem: PackedError::Block { .. }, .. }), "{name}");
        }
    }
    // A dictionary of 3 GiB.
    let packed = xz(&[0; 12], 39);
    let file = appended("vtkLZMADataCompressor", 1, &[words(&[1, 12, 0, packed.len() as u64]), packed].concat());
    assert!(matches!(error(&file), VtkError::Packed { problem: PackedError::Block { .. }, .. }));
}

#[test]
fn many_arrays_of_the_same_bytes_are_refused() {
    let piece = "<Piece NumberOfPoints=\"1000\"><Points><DataArray type=\"Int8\" format=\"appended\" offset=\"0\"/>\
                 </Points></Piece>";
    let data = [&3000_u32.to_le_bytes()[..], &[0; 3000]].concat();
    let file =
        format!("<VTKFile type=\"PolyData\"><PolyData>{}</PolyData><AppendedData encoding=\"raw\">_", piece.repeat(60));
    let file = [file.as_bytes(), &data, b"</AppendedData>"].concat();
    assert!(matches!(error(&file), VtkError::Packed { problem: PackedError::Overlap, .. }));
}

#[test]
fn nesting_is_limited_and_very_many_attributes_and_pieces_are_read_in_time() {
    let deep = format!("<VTKFile type=\"PolyData\"><PolyData>{}", "<a>".repeat(100_000));
    assert!(error(deep.as_bytes()).to_string().contains("nested more than 256 deep"));
    let attributes: String = (0..200_000).map(|i| format!(" a{i}=\"\"")).collect();
    let wide = changed(PLAIN, "<Points>", &format!("<Points{attributes}>"));
    assert!(read_alone(Format::Vtp, &wide).is_ok());
    let pieces = "<Piece NumberOfPoints=\"0\"></Piece>".repeat(200_000);
    let many = changed(PLAIN, "<Piece ", &format!("{pieces}<Piece "));
    assert!(read_alone(Format::Vtp, &many).is_ok());
    let piece = "<Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Int8\">1 2 3</DataArray></Points></Piece>";
    let many = changed(PLAIN, "<Piece ", &format!("{}<Piece ", piece.repeat(100_000)));
    let content = read_alone(Format::Vtp, &many).expect("read");
    assert_eq!((content.soup.points().len(), content.soup.triangles()[0]), (100_004, [100_000, 100_001, 100_003]));
}
