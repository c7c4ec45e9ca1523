use super::*;
use crate::formats::mutate::mutations;
use crate::formats::{Format, read_alone};
use planish_core::mesh::SoupError;

fn content(text: &str) -> Result<Content, ReadError> {
    read_alone(Format::Off, text.as_bytes())
}

/// A square of these faces, under a keyword.
fn square(keyword: &str, faces: &[&str]) -> String {
    format!("{keyword}\n4 {} 5\n0 0 0\n1 0 0\n1 1 0.5\n0 1 0\n{}\n", faces.len(), faces.join("\n"))
}

#[test]
fn faces_of_all_sorts_are_read() {
    let found = content(&square("OFF", &["3 0 1 2", "4 0 1 2 3", "2 0 1", "1 3"])).expect("a square");
    assert_eq!(found.soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]]);
    assert_eq!(found.soup.triangles(), [[0, 1, 2], [3, 0, 1], [3, 1, 2]]);
    assert_eq!((found.notes.polygons, found.notes.format.as_str()), (1, "OFF"));
    assert_eq!(found.notes.skipped["face with fewer than three corners"], 2);
}

#[test]
fn what_exporters_write_besides_does_no_harm() {
    let plain = square("OFF", &["3 0 1 2", "3 0 2 3"]);
    let expected = content(&plain).expect("a square").soup;
    let layouts = [
        square("OFF", &["3 0 1 2 255 0 0", "3 0 2 3 0.5 0.5 0.5 1"]),
        square("OFF", &["3  0  1  2  # red", "# a comment\n\n3 0 2 3 7"]),
        plain.replace(" 0\n", " 0 0.1 0.2 0.3 1\n").replace("OFF", "COFF"),
        plain.replace(" 0\n", " 0 255 0 0\n"),
        plain.replace(" 0\n", " 0 0 0 1 0.5 0.5\n").replace("OFF", "STNOFF"),
        plain.replace("OFF\n4 2 5", "# before\noff 4 2"),
        plain.replace("OFF\n4 2 5", "OFF4 2 5"),
        plain.replace("OFF\n", ""),
        plain.replace("1 0 0\n", "1\n0 # y\n0\n"),
        plain.replace('\n', "\r\n"),
        plain.replace('\n', "\r"),
        plain.trim_end().to_owned(),
    ];
    for layout in layouts {
        assert_eq!(content(&layout).unwrap_or_else(|e| panic!("{layout}: {e}")).soup, expected, "{layout}");
    }
}

#[test]
fn broken_files_are_refused_with_code_and_place() {
    let good = square("OFF", &["3 0 1 2", "3 0 2 3"]);
    let rows = [
        (good.replace("OFF", "solid"), Code::Malformed, "line 1", "no OFF file"),
        (good.replace("OFF", "OFFER"), Code::Malformed, "line 1", "no OFF file"),
        (good.replace("OFF", "OFF BINARY"), Code::UnsupportedFormat, "line 1", "a binary OFF file"),
        (good.replace("OFF", "4OFF"), Code::UnsupportedFormat, "line 1", "4OFF"),
        (good.replace("OFF", "CnOFF\n3"), Code::UnsupportedFormat, "line 1", "nOFF"),
        (good.replace("4 2 5", "4 x 5"), Code::Malformed, "line 2", "\"x\" is no number of elements"),
        (good.replace("4 2 5", "-4 2 5"), Code::Malformed, "line 2", "\"-4\" is no number of elements"),
        (good.replace("4 2 5", "4000000000 2 5"), Code::CountMismatch, "line 2", "4000000000 vertices"),
        (good.replace("4 2 5", "18446744073709551615 2 5"), Code::Malformed, "line 2", "no number of elements"),
        (good.replace("4 2 5", "4 9223372036854775807 5"), Code::CountMismatch, "line 2", "cut off"),
        (good.replace("4 2 5", "4 3 5"), Code::CountMismatch, "line 9", "face 2 (from 0) of 3"),
        (good.replace("4 2 5", "4 1 5"), Code::CountMismatch, "line 8", "\"3\" follows"),
        (good.replace("4 2 5", "3 2 5"), Code::CountMismatch, "line 8", "\"3\" follows"),
        (good.replace("0 2 3", "0 2 4"), Code::Malformed, "line 8", "\"4\" is no vertex: there are 4"),
        (good.replace("0 2 3", "0 2 -1"), Code::Malformed, "line 8", "in face 1 (from 0)"),
        (good.replace("3 0 2 3", "-3 0 2 3"), Code::Malformed, "line 8", "\"-3\" is no number of corners"),
        (good.replace("1 1 0.5", "1 x 0.5"), Code::Malformed, "line 5", "\"x\" is no number"),
        (good.replace("1 1 0.5", "1 1 0,5"), Code::Malformed, "line 5", "decimal comma"),
        (good.replace("1 1 0.5", "1 1 5.0D-01"), Code::Malformed, "line 5", "Fortran exponent"),
        (good.replace("1 1 0.5", "1 1 nan"), Code::NotFinite, "line 5", "1 corner is of this sort"),
    ];
    for (text, code, location, word) in rows {
        let reason = content(&text).expect_err(&text).reason();
        assert_eq!((reason.code, reason.location.as_deref()), (code, Some(location)), "{reason:?}\n{text}");
        assert!(reason.message.contains(word), "{reason:?}");
    }
    let cloud = content(&square("OFF", &[]));
    assert!(matches!(cloud, Err(ReadError::Soup { error: SoupError::NoTriangles { points: 4 }, .. })), "{cloud:?}");
    assert!(content(&square("OFF", &["3 0 1 3"]).replace("1 1 0.5", "nan inf 1e300")).is_ok(), "no corner");
}

#[test]
fn limits_are_kept() {
    let limits = Limits { elements: 4, ..Limits::default() };
    let with = |text: String| read(&Source::alone(text.as_bytes(), &limits));
    assert!(with(square("OFF", &["3 0 1 2"; 4])).is_ok());
    for many in [square("OFF", &["3 0 1 2"; 5]), square("OFF", &["4 0 1 2 3"; 3])] {
        assert_eq!(with(many).expect_err("too many").reason().code, Code::TooLarge);
    }
}

#[test]
fn mutated_files_do_no_harm() {
    let seed =
        square("COFF", &["3 0 1 2", "5 0 1 2 3 1 0.5 0.5 0.5", "# a comment", "2 0 1"]).replace("4 4 5", "4 3 5");
    let accepted = mutations(seed.as_bytes(), 20_000).filter(|b| read_alone(Format::Off, b).is_ok()).count();
    assert!(accepted > 500, "{accepted}");
}
