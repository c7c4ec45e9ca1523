use super::header::{Property, Scalar};
use super::*;
use crate::formats::Limits;
use crate::formats::mutate::mutations;
use crate::settings::LabelSource;
use planish_core::mesh::SoupError;

fn content(bytes: &[u8]) -> Result<Content, ReadError> {
    read(&Source::alone(bytes, &Limits::default()))
}

fn error(bytes: &[u8]) -> PlyError {
    match content(bytes) {
        Err(ReadError::Ply(e)) => e,
        other => panic!("{other:?}"),
    }
}

const XYZ: &str = "property float x\nproperty float y\nproperty float z\n";
const LIST: &str = "property list uchar int vertex_indices\n";
const SQUARE: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

/// An ASCII file of a square with these faces.
fn square(faces: &[&str]) -> String {
    let head = format!("ply\nformat ascii 1.0\nelement vertex 4\n{XYZ}element face {}\n{LIST}", faces.len());
    format!("{head}end_header\n{SQUARE}{}\n", faces.join("\n"))
}

/// A word as binary value.
fn value(word: &str, scalar: Scalar, big: bool) -> Vec<u8> {
    let number: f64 = word.parse().expect("a number");
    let mut bytes = match scalar {
        Scalar::I8 | Scalar::U8 => vec![number as i64 as u8],
        Scalar::I16 | Scalar::U16 => (number as i64 as u16).to_le_bytes().to_vec(),
        Scalar::I32 | Scalar::U32 => (number as i64 as u32).to_le_bytes().to_vec(),
        Scalar::I64 | Scalar::U64 => (number as i64).to_le_bytes().to_vec(),
        Scalar::F32 => (number as f32).to_le_bytes().to_vec(),
        Scalar::F64 => number.to_le_bytes().to_vec(),
    };
    if big {
        bytes.reverse();
    }
    bytes
}

/// The same file, binary.
fn binary(ascii: &str, big: bool) -> Vec<u8> {
    let header = Header::read(ascii.as_bytes()).expect("a header");
    let mut words = ascii[header.end..].split_whitespace();
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let mut bytes = ascii[..header.end].replace("format ascii", &format!("format {name}")).into_bytes();
    for element in &header.elements {
        for property in (0..element.count).flat_map(|_| &element.properties) {
            let Property { scalar, count, .. } = property;
            let mut length = 1;
            if let Some(count) = count {
                let word = words.next().expect("a length");
                length = word.parse().expect("a length");
                bytes.extend(value(word, *count, big));
            }
            (0..length).for_each(|_| bytes.extend(value(words.next().expect("a value"), *scalar, big)));
        }
    }
    bytes
}

/// What a file gives in all encodings, which must be the same.
fn in_all_encodings(ascii: &str) -> Content {
    let first = content(ascii.as_bytes()).unwrap_or_else(|e| panic!("{e}\n{ascii}"));
    for big in [false, true] {
        let other = content(&binary(ascii, big)).unwrap_or_else(|e| panic!("{big}: {e}\n{ascii}"));
        assert_eq!((&other.soup, &other.notes.skipped), (&first.soup, &first.notes.skipped), "{ascii}");
    }
    first
}

#[test]
fn triangles_quads_and_polygons_are_read() {
    let found = in_all_encodings(&square(&["3 0 1 2", "4 0 1 2 3", "3 0 2 3", "2 0 1"]));
    assert_eq!(found.soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(found.soup.triangles(), [[0, 1, 2], [3, 0, 1], [3, 1, 2], [0, 2, 3]]);
    assert_eq!((found.notes.polygons, found.notes.format.as_str()), (1, "PLY, ASCII"));
    assert_eq!(found.notes.skipped["face with fewer than three corners"], 1);
    let formats = [false, true].map(|big| content(&binary(&square(&["3 0 1 2"]), big)).expect("read").notes.format);
    assert_eq!(formats, ["PLY, binary, little-endian", "PLY, binary, big-endian"]);
}

#[test]
fn other_elements_and_properties_are_passed_over() {
    let file = format!(
        "ply\nformat ascii 1.0\ncomment made by hand\nobj_info none\n\
         element edge 2\nproperty int vertex1\nproperty list ushort double weights\nelement empty 7\n\
         element face 2\nproperty uchar red\nproperty list short float texcoord\n{LIST}property double area\n\
         element vertex 4\nproperty double z\nproperty list uint uchar tags\nproperty char x\nproperty ushort y\n\
         element edges 1\nproperty float a\nend_header\n\
         7 2 0.5 0.25\n8 0\n\
         255 2 0.5 1 3 0 1 2 0.5\n0 0 3 0 2 3 0.5\n\
         2.5 1 9 0 0\n2.5 0 1 0\n2.5 0 1 1\n2.5 0 0 1\n1.5\n"
    );
    let found = in_all_encodings(&file);
    assert_eq!(found.soup.points(), [[0.0, 0.0, 2.5], [1.0, 0.0, 2.5], [1.0, 1.0, 2.5], [0.0, 1.0, 2.5]]);
    assert_eq!(found.soup.triangles(), [[0, 1, 2], [0, 2, 3]]);
    let skipped: Vec<(&str, usize)> = found.notes.skipped.iter().map(|(k, n)| (k.as_str(), *n)).collect();
    assert_eq!(skipped, [("edge", 2), ("edges", 1), ("empty", 7)]);
}

#[test]
fn values_of_all_types_are_read() {
    let types = ["char", "uint8", "short", "uint16", "int32", "uint", "long", "uint64", "float32", "double"];
    for (i, scalar) in types.into_iter().enumerate() {
        let count = types[i.min(7)];
        let list = format!("property list {count} {scalar} vertex_index\n");
        let file = square(&["3 0 1 2", "4 0 1 2 3"]).replace("float ", &format!("{scalar} ")).replace(LIST, &list);
        let found = in_all_encodings(&file);
        assert_eq!((found.soup.triangles().len(), found.soup.points()[2]), (3, [1.0, 1.0, 0.0]), "{scalar}");
    }
    let negative = square(&["3 0 1 2"]).replace("float x", "short x").replace("1 1 0", "-300 1 0");
    assert_eq!(in_all_encodings(&negative).soup.points()[2], [-300.0, 1.0, 0.0]);
}

#[test]
fn triangles_of_strips_turn_alike() {
    let strips = |list: &str| {
        let head = format!("ply\nformat ascii 1.0\nelement vertex 6\n{XYZ}element tristrips 1\n");
        let points = "0 0 0\n0 1 0\n1 0 0\n1 1 0\n2 0 0\n2 1 0\n";
        let length = list.split(' ').count();
        format!("{head}property list int int vertex_indices\nend_header\n{points}{length} {list}\n")
    };
    let triangles = |list: &str| in_all_encodings(&strips(list)).soup.triangles().to_vec();
    assert_eq!(triangles("0 1 2 3 4 5"), [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]);
    assert_eq!(triangles("0 1 2 3 -1 2 3 4 5 -1"), [[0, 1, 2], [2, 1, 3], [2, 3, 4], [4, 3, 5]]);
    assert_eq!(triangles("-1 -1 0 1 -1 0 1 2 2 3 4"), [[0, 1, 2], [3, 2, 4]]);
    assert!(matches!(error(strips("0 1 -2").as_bytes()), PlyError::Value { .. }));
}

#[test]
fn blanks_and_line_ends_do_no_harm() {
    let file = square(&["3 0 1 2", "3 0 2 3"]);
    let plain = content(file.as_bytes()).expect("a square").soup;
    let layouts = [
        file.replace('\n', "\r\n"),
        file.replace('\n', "\r"),
        file.trim_end().to_owned(),
        format!("{file}\n\n  "),
        file.replace("1 0 0\n", "\n  1\t0\n 0 \n"),
        file.replace("0 1 0\n", "+0.0 1.0e0 -0 \n"),
    ];
    for layout in layouts {
        assert_eq!(content(layout.as_bytes()).unwrap_or_else(|e| panic!("{layout:?}: {e}")).soup, plain);
    }
    let crlf = [b"ply\r\nformat".as_slice(), &binary(&file.replace('\n', "\r\n"), true)[11..]].concat();
    assert_eq!(content(&crlf).expect("line ends in the header").soup, plain);
    assert_eq!(content(&[&crlf[..], b"\n"].concat()).expect("a line feed at the end").soup, plain);
}

#[test]
fn broken_files_are_refused_with_code_and_place() {
    let good = square(&["3 0 1 2", "3 0 2 3"]);
    let rows = [
        (good.replace("ply", "obj"), Code::Malformed, Some("line 1"), "no PLY"),
        (good.replace("end_header", "end"), Code::Malformed, Some("line 9"), "\"end\""),
        (good.replace("element vertex 4", "element points 4"), Code::Malformed, None, "\"vertex\""),
        (good.replace("float z", "float w"), Code::Malformed, Some("line 3"), "\"z\""),
        (good.replace("list uchar int vertex_indices", "int i"), Code::Malformed, Some("line 7"), "vertex_indices"),
        (good.replace("vertex 4", "vertex 400"), Code::CountMismatch, Some("line 3"), "400"),
        (good.replace("vertex 4", "vertex 18446744073709551615"), Code::CountMismatch, Some("line 3"), "cut off"),
        (good.replace("face 2", "face 3"), Code::CountMismatch, Some("line 16"), "face 2 (from 0) of 3"),
        (good.replace("face 2", "face 1"), Code::CountMismatch, Some("line 14"), "3 0 2 3"),
        (good.replace("0 2 3", "0 2 4"), Code::Malformed, Some("line 15"), "vertex 4"),
        (good.replace("0 2 3", "0 2 -1"), Code::Malformed, Some("line 15"), "vertex -1"),
        (good.replace("0 2 3", "0 2 1.5"), Code::Malformed, Some("line 15"), "1.5"),
        (good.replace("0 2 3", "0 2 x"), Code::Malformed, Some("line 15"), "\"x\" is no number"),
        (good.replace("3 0 2 3", "-3 0 2 3"), Code::Malformed, Some("line 15"), "length -3"),
        (good.replace("3 0 2 3", "2 0 2 3"), Code::Malformed, Some("line 15"), "\"3\" follows"),
        (good.replace("1 1 0", "1 1 0 7"), Code::Malformed, Some("line 12"), "\"7\" follows"),
        (good.replace("1 1 0", "1 nan 0"), Code::NotFinite, Some("line 12"), "NaN"),
        (good.replace("1 1 0", "1 1 1e999"), Code::NotFinite, Some("line 12"), "inf"),
        (good.replace("1 1 0", "-1.#IND 1 0"), Code::NotFinite, Some("line 12"), "in 2 triangles"),
        (good.replace("1 1 0", "1 0,5 0"), Code::Malformed, Some("line 12"), "decimal comma"),
        (good.replace("1 1 0", "1 1.0D+00 0"), Code::Malformed, Some("line 12"), "Fortran exponent"),
    ];
    for (text, code, location, word) in rows {
        let reason = content(text.as_bytes()).expect_err(&text).reason();
        assert_eq!((reason.code, reason.location.as_deref()), (code, location), "{reason:?}\n{text}");
        assert!(reason.message.contains(word), "{reason:?}");
    }
    let cloud = square(&[]);
    assert!(matches!(
        content(cloud.as_bytes()),
        Err(ReadError::Soup { error: SoupError::NoTriangles { points: 4 }, .. })
    ));
}

/// No triangle uses point 3: whatever its coordinates are, the others stay what they are.
#[test]
fn points_without_triangles_may_have_any_coordinates() {
    let good = square(&["3 0 1 2"]);
    let expected = in_all_encodings(&good).soup;
    for bad in ["nan nan nan", "0 inf 0", "-1e30 -inf nan"] {
        let found = in_all_encodings(&good.replace("0 1 0\n3", &format!("{bad}\n3"))).soup;
        assert_eq!((found.triangles(), &found.points()[..3]), (expected.triangles(), &expected.points()[..3]), "{bad}");
    }
}

#[test]
fn broken_binary_files_are_refused_with_their_byte() {
    let ascii = square(&["3 0 1 2", "4 0 1 2 3"]);
    let header = Header::read(ascii.as_bytes()).expect("a header").end + "binary_big_endian".len() - "ascii".len();
    let good = binary(&ascii, true);
    let with = |at: usize, new: &[u8]| {
        let mut bytes = good.clone();
        bytes[header + at..header + at + new.len()].copy_from_slice(new);
        error(&bytes)
    };
    let mut nan = good.clone();
    nan[header + 16..header + 20].copy_from_slice(&f32::NAN.to_be_bytes());
    let nan = content(&nan).expect_err("a corner").reason();
    assert_eq!((nan.code, nan.location), (Code::NotFinite, Some(format!("byte {}", header + 12))), "{}", nan.message);
    assert!(nan.message.contains("y of point 1 (from 0) is NaN"), "{}", nan.message);
    let range = with(48 + 1, &4u32.to_be_bytes());
    assert!(matches!(&range, PlyError::Value { number: 0, location: Location::Byte(_), .. }), "{range:?}");
    let length = with(48 + 13, &[200]);
    assert!(matches!(&length, PlyError::Value { number: 1, .. } | PlyError::Truncated { number: 1, .. }), "{length:?}");
    let longer = error(&[&good[..], b"\0"].concat());
    assert_eq!(longer, PlyError::Trailing { bytes: 1, begins: "\\0".into(), location: Location::Byte(good.len()) });
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    // The last number is one digit, so that each cut takes something away.
    let ascii = square(&["3 0 1 2", "4 0 1 2 3"]);
    let ascii = ascii.trim_end();
    for file in [ascii.as_bytes().to_vec(), binary(ascii, false), binary(ascii, true)] {
        assert!(content(&file).is_ok());
        for end in 0..file.len() {
            let error = content(&file[..end]).expect_err("cut off");
            assert!(end == 0 || matches!(error, ReadError::Ply(_)), "{end}: {error:?}");
        }
    }
}

#[test]
fn limits_are_kept() {
    let limits = Limits { elements: 4, ..Limits::default() };
    let with = |bytes: &[u8]| read(&Source::alone(bytes, &limits));
    assert!(with(square(&["3 0 1 2"; 4]).as_bytes()).is_ok());
    let error = |bytes: &[u8]| with(bytes).expect_err("too many").reason().code;
    assert_eq!(error(square(&["3 0 1 2"; 5]).as_bytes()), Code::TooLarge);
    assert_eq!(error(square(&["4 0 1 2 3"; 3]).as_bytes()), Code::TooLarge);
    assert_eq!(error(&binary(&square(&["4 0 1 2 3"; 3]), false)), Code::TooLarge);
}

#[test]
fn mutated_files_do_no_harm() {
    let ascii = format!(
        "ply\nformat ascii 1.0\nelement edge 1\nproperty list char short a\nelement face 2\n{LIST}property uchar red\n\
         element vertex 4\n{XYZ}property double q\nelement tristrips 1\n{LIST}end_header\n\
         2 5 6\n3 0 1 2 9\n4 0 1 2 3 9\n0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 1\n5 0 1 2 -1 3\n"
    );
    let mut accepted = 0;
    for file in [ascii.as_bytes().to_vec(), binary(&ascii, false), binary(&ascii, true)] {
        accepted += mutations(&file, 20_000).filter(|bytes| content(bytes).is_ok()).count();
    }
    assert!(accepted > 1000, "{accepted}");
}

fn labelled(bytes: &[u8], source: &LabelSource) -> Result<Content, ReadError> {
    read(&Source { labels: source, ..Source::alone(bytes, &Limits::default()) })
}

fn asked(name: &str) -> LabelSource {
    LabelSource::Array(name.to_owned())
}

/// The names of the labels of the triangles, one after the other.
fn names(content: &Content) -> Vec<&str> {
    content.soup.labels().iter().map(|label| content.notes.labels[*label as usize].name.as_str()).collect()
}

/// Faces and strips, with properties before and behind the list, of these types.
fn parts(before: &str, behind: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement face 3\nproperty uchar red\nproperty {before} region\n{LIST}property float area\n\
         property {behind} other\nelement vertex 4\n{XYZ}element tristrips 1\nproperty {before} region\n\
         property list int int vertex_indices\nend_header\n\
         1 7 3 0 1 2 0.5 7\n2 9 4 0 1 2 3 0.5 9\n3 7 2 0 1 0.5 7\n{SQUARE}7 4 0 1 3 2\n"
    )
}

#[test]
fn properties_of_faces_label_their_triangles_in_all_encodings() {
    for scalar in ["char", "uchar", "short", "ushort", "int", "uint", "int64", "uint64"] {
        let ascii = parts(scalar, scalar);
        for bytes in [ascii.clone().into_bytes(), binary(&ascii, false), binary(&ascii, true)] {
            let usual = labelled(&bytes, &LabelSource::Usual).expect("labels");
            assert_eq!(names(&usual), ["region_7", "region_7", "region_7", "region_9", "region_9"], "{scalar}");
            assert_eq!(usual.notes.labels.iter().map(|label| label.tag).collect::<Vec<_>>(), [7, 9]);
            // Faces that come before the points are read last, and the strip has no such property.
            let other = labelled(&bytes, &asked("other")).expect("labels");
            assert_eq!(names(&other), ["unnamed", "unnamed", "other_7", "other_9", "other_9"], "{scalar}");
            let ignored = labelled(&bytes, &LabelSource::Ignored).expect("read");
            assert!(ignored.soup.labels().is_empty() && ignored.soup.triangles() == usual.soup.triangles());
            let missing = labelled(&bytes, &asked("label")).expect_err("missing").reason();
            assert_eq!(missing.code, Code::NoLabels, "{missing:?}");
            assert!(missing.message.contains("there are red, region, other, region;"), "{missing:?}");
        }
    }
}

#[test]
fn measured_values_are_labels_if_they_are_asked_for_and_whole() {
    let ascii = parts("double", "int");
    let broken = ascii.replace("2 9 4 0", "2 9.5 4 0");
    let at_no_triangle = ascii.replace("3 7 2 0", "3 0.5 2 0");
    for encode in [|text: &str| text.as_bytes().to_vec(), |text: &str| binary(text, false), |t: &str| binary(t, true)] {
        assert!(labelled(&encode(&ascii), &LabelSource::Usual).expect("read").soup.labels().is_empty());
        for whole in [&ascii, &at_no_triangle] {
            let found = labelled(&encode(whole), &asked("region")).expect("whole");
            assert_eq!(names(&found), ["region_7", "region_7", "region_7", "region_9", "region_9"]);
        }
        let refused = labelled(&encode(&broken), &asked("region")).expect_err("not whole").reason();
        assert_eq!(refused.code, Code::NoLabels);
        assert!(refused.message.contains("region holds 9.5 for triangle 3"), "{refused:?}");
        assert!(labelled(&encode(&ascii), &asked("vertex_indices")).is_err(), "a list");
    }
    let word = parts("int", "int").replace("2 9 4 0", "2 nine 4 0");
    let found = labelled(word.as_bytes(), &LabelSource::Usual).expect("read without labels");
    assert!(found.soup.labels().is_empty() && found.notes.remarks[0].contains("for triangle 3"), "{:?}", found.notes);
}
