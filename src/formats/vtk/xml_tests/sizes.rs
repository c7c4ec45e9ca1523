//! Sizes at points, from the arrays of points.

use super::files::sized_grid;
use super::*;

/// What asks for nothing.
const NONE: f64 = f64::INFINITY;

fn sized(bytes: &[u8], array: &str) -> Result<Content, ReadError> {
    crate::formats::read(Format::Vtu, &Source { sizes: Some(array), ..Source::alone(bytes, &Limits::default()) })
}

#[test]
fn arrays_of_points_tell_sizes_in_every_encoding() {
    let numbers = ["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32"];
    for style in styles() {
        let bytes = sized_grid(style);
        let plain = read_alone(Format::Vtu, &bytes).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        let found = |array: &str| {
            let found = sized(&bytes, array).unwrap_or_else(|e| panic!("{style:?} {array}: {e}"));
            assert_eq!((found.soup.points(), found.soup.triangles()), (plain.soup.points(), plain.soup.triangles()));
            let [remark] = &found.notes.remarks[..] else { panic!("{array}: {:?}", found.notes.remarks) };
            (found.soup.sizes().to_vec(), remark.clone())
        };
        // The second piece has none of these.
        let rest = [NONE; 5];
        for array in numbers {
            let (sizes, remark) = found(array);
            assert_eq!(sizes, [&[3.0, 1.0, 4.0, NONE], &rest[..]].concat(), "{style:?} {array}");
            assert!(remark.starts_with("at 5 of the 8 corners"), "{remark}");
        }
        let (sizes, remark) = found("Float64");
        assert_eq!(sizes, [3.0, 1.0, 4.0, NONE, 5.0, 6.0, 7.0, 8.0, NONE], "{style:?}");
        assert!(remark.starts_with("at 1 of the 8 corners"), "{remark}");
        assert_eq!(found("a < b").0, [&[0.5, 0.25, NONE, NONE], &rest[..]].concat(), "{style:?}");
        for (array, told) in [("words", "there are Int8, UInt8"), ("float64", "Float64, a < b;")] {
            let missing = sized(&bytes, array).expect_err("missing").reason();
            assert_eq!(missing.code, Code::NoSizes);
            assert!(missing.message.contains(told) && !missing.message.contains("Vector"), "{missing:?}");
        }
        let vector = sized(&bytes, "Vector").expect_err("a vector").reason();
        assert_eq!(vector.code, Code::NoSizes);
        assert!(vector.message.contains("Vector has 3 numbers at every point"), "{vector:?}");
        assert!(plain.soup.sizes().is_empty() && plain.notes.remarks.is_empty());
    }
}

/// A text file with these words replaced.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let whole = String::from_utf8(sized_grid(Style { encoding: Encoding::Ascii, ..PLAIN })).expect("text");
    assert!(whole.contains(from), "{from}");
    whole.replacen(from, to, 1).into_bytes()
}

#[test]
fn damaged_arrays_are_refused_with_their_place() {
    let array = "format=\"ascii\"  type=\"Float64\" Name='a &lt; b'";
    let cases = [
        (array, "format=\"hex\" type=\"Float64\" Name='a &lt; b'", "\"hex\" is no format"),
        (array, "format=\"appended\" type=\"Float64\" Name='a &lt; b'", "values of \"a < b\" have no offset"),
        (array, "format=\"appended\" offset=\"0\" type=\"Float64\" Name='a &lt; b'", "there is no <AppendedData>"),
        (array, "format=\"binary\" type=\"Float64\" Name='a &lt; b'", "cannot be decoded"),
        ("0.5 0.25 NaN -1 <", "0.5 0.25 NaN <", "values of \"a < b\" should have 4 values"),
        ("0.5 0.25 NaN -1 <", "0.5 0,25 NaN -1 <", "\"0,25\" is no value of values of \"a < b\""),
        ("0.5 0.25 NaN -1 <", "0.5 <b/> 0.25 NaN -1 <", "interrupted"),
    ];
    for (from, to, expected) in cases {
        let bytes = changed(from, to);
        let refused = sized(&bytes, "a < b").expect_err(to);
        assert!(matches!(refused, ReadError::Vtk(_)), "{to}: {refused:?}");
        let refused = refused.reason();
        assert!(refused.message.contains(expected) && refused.location.is_some(), "{to}: {refused:?}");
        // Nobody else is bothered by it.
        assert!(sized(&bytes, "Float64").is_ok() && read_alone(Format::Vtu, &bytes).is_ok(), "{to}");
    }
}

#[test]
fn cut_and_changed_files_give_an_error_or_the_same_surface() {
    for style in styles().into_iter().filter(|s| s.block == 100 && s.wide && !s.big) {
        let whole = sized_grid(style);
        let full = sized(&whole, "Float64").expect("sizes");
        for end in 0..whole.len() {
            if let Ok(content) = sized(&whole[..end], "Float64") {
                assert_eq!(content.soup, full.soup, "{style:?}, cut at {end}");
            }
        }
        for at in 0..whole.len() {
            for other in [b'9', 0xff, whole[at] ^ 1] {
                let mut bytes = whole.clone();
                bytes[at] = other;
                let _ = sized(&bytes, "Float64");
            }
        }
    }
}

/// What compressed arrays become is limited for those, too.
#[test]
fn sizes_take_what_is_left_of_the_budget_only() {
    let packed = compress("ZLib", &vec![0; 3 << 20]);
    let data = [&[1, 3 << 20, 0, packed.len() as u64].map(u64::to_le_bytes).concat()[..], &packed].concat();
    let ids =
        |name: &str, ids: &str| format!("<DataArray type=\"Int8\" Name=\"{name}\" format=\"ascii\">{ids}</DataArray>");
    let head = format!(
        "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\" header_type=\"UInt64\"><PolyData><Piece \
         NumberOfPoints=\"3\" NumberOfPolys=\"1\"><PointData><DataArray Name=\"h\" type=\"Int8\" format=\"appended\" \
         offset=\"0\"/></PointData><Points>{}</Points><Polys>{}{}</Polys></Piece></PolyData><AppendedData encoding=\"raw\">_",
        ids("Points", "0 0 0 1 0 0 0 1 0"),
        ids("connectivity", "0 1 2"),
        ids("offsets", "3")
    );
    let bytes = [head.as_bytes(), &data, b"</AppendedData></VTKFile>"].concat();
    let limits = Limits { expansion: 2, ..Limits::default() };
    let refused = crate::formats::read(Format::Vtp, &Source { sizes: Some("h"), ..Source::alone(&bytes, &limits) });
    assert_eq!(refused.expect_err("a bomb").reason().code, Code::TooLarge);
    assert!(limited(&bytes, limits).is_ok(), "nobody asked for it");
}
