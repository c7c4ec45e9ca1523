use super::*;
use crate::formats::mutate::mutations;
use crate::formats::{Format, read_alone};
use crate::settings::LabelSource;
use planish_core::mesh::SoupError;

fn content(text: &str) -> Result<Content, ReadError> {
    read_alone(Format::Medit, text.as_bytes())
}

const SQUARE: &str = "MeshVersionFormatted 2\n\nDimension 3\n\nVertices\n4\n0 0 0 1\n1 0 0 1\n1 1 0.5 1\n0 1 0 2\n\n";
const TWO: &str = "Triangles\n2\n1 2 3 7\n1 3 4 7\n\n";

fn square(sections: &str) -> String {
    format!("{SQUARE}{sections}End\n")
}

#[test]
fn faces_of_all_sorts_are_read() {
    let sections = "Quadrilaterals\n1\n1 2 3 4 0\nTrianglesP2\n1\n1 2 3 4 4 4 0\nTriangles 1 1 3 4 0\n";
    let found = content(&square(sections)).expect("a square");
    assert_eq!(found.soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.5], [0.0, 1.0, 0.0]]);
    assert_eq!(found.soup.triangles(), [[3, 0, 1], [3, 1, 2], [0, 1, 2], [0, 2, 3]]);
    assert_eq!((found.notes.polygons, found.notes.mid_nodes), (1, 1));
}

#[test]
fn what_exporters_write_besides_does_no_harm() {
    let plain = square(TWO);
    let expected = content(&plain).expect("a square").soup;
    let more = "RequiredVertices\n1\n1\nNormals 2 0 0 nan\n0 inf 1\nIdentifier \"Triangles and Vertices\"\nGeometry\n\
                \"a.mesh\"\nSubDomainFromMesh\n1\n3 1 1 1\n";
    let layouts = [
        plain.replace("Dimension 3", " Dimension\n 3"),
        plain.replace("MeshVersionFormatted 2", "# by hand\n MeshVersionFormatted\n1"),
        plain.replace("Dimension", "DIMENSION").replace("End\n", "end"),
        plain.replace("End\n", ""),
        plain.replace("End\n", "End\nbehind the end\n"),
        square(&format!("{more}{TWO}{more}")),
        format!("MeshVersionFormatted 1\n{TWO}{}", &SQUARE[23..]),
        plain.replace("1 0 0 1\n", "1 0 # y\n0\n1 # reference\n"),
        plain.replace('\n', "\r\n"),
        square("Triangles\n1\n1 2 3 0\nTriangles\n1\n1 3 4 0\n"),
    ];
    for layout in layouts {
        assert_eq!(content(&layout).unwrap_or_else(|e| panic!("{layout}: {e}")).soup, expected, "{layout}");
    }
    let flat = content("MeshVersionFormatted 2 Dimension 2 Vertices 3 0 0 1 1 0 1 0 1 1 Triangles 1 1 2 3 1 End");
    assert_eq!(flat.expect("in the plane").soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
}

#[test]
fn other_elements_are_counted_and_alone_they_are_refused() {
    let volumes = "Tetrahedra\n2\n1 2 3 4 0\n1 2 4 3 0\nHexaedra 1 1 1 1 1 1 1 1 1 0\nEdges\n1\n1 2 0\n";
    let found = content(&square(&format!("{volumes}{TWO}"))).expect("a surface, too");
    let skipped: Vec<(&str, usize)> = found.notes.skipped.iter().map(|(k, n)| (k.as_str(), *n)).collect();
    assert_eq!(skipped, [("edge", 1), ("hexahedron", 1), ("tetrahedron", 2)]);
    let reason = content(&square(volumes)).expect_err("no surface").reason();
    assert_eq!(reason.code, Code::NoTriangles);
    assert!(reason.message.contains("only 1 edge, 1 hexahedron, 2 tetrahedra"), "{reason:?}");
}

#[test]
fn broken_files_are_refused_with_code_and_place() {
    let good = square(TWO);
    let rows = [
        (good.replace("MeshVersion", "Mesh"), Code::Malformed, Some("line 1"), "no mesh of MEDIT"),
        (good.replace("Formatted 2", "Formatted x"), Code::CountMismatch, Some("line 1"), "\"x\" stands where"),
        (good.replace("Dimension 3", "Dimension 4"), Code::Malformed, Some("line 3"), "4 is neither 2 nor 3"),
        (good.replace("Dimension 3", ""), Code::Malformed, None, "Dimension before Vertices"),
        (good.replace("Vertices", "Points"), Code::Malformed, None, "no section Vertices"),
        (good.replace("Vertices\n4", "Vertices\n-4"), Code::Malformed, Some("line 6"), "\"-4\" is no number"),
        (
            good.replace("Vertices\n4", "Vertices\n4000000000"),
            Code::CountMismatch,
            Some("line 6"),
            "4000000000 records",
        ),
        (good.replace("Vertices\n4", "Vertices\n9223372036854775807"), Code::CountMismatch, Some("line 6"), "cut off"),
        (
            good.replace("Vertices\n4", "Vertices\n5"),
            Code::CountMismatch,
            Some("line 12"),
            "\"Triangles\" stands where",
        ),
        (
            good.replace("Vertices\n4", "Vertices\n3"),
            Code::CountMismatch,
            Some("line 10"),
            "\"0\" stands where a keyword",
        ),
        (good.replace("1 1 0.5 1", "1 1 x 1"), Code::CountMismatch, Some("line 9"), "\"x\" stands where"),
        (good.replace("1 1 0.5 1", "1 1 0,5 1"), Code::Malformed, Some("line 9"), "decimal comma"),
        (good.replace("1 1 0.5 1", "1 1 5.D-1 1"), Code::Malformed, Some("line 9"), "Fortran exponent"),
        (good.replace("1 1 0.5 1", "1 1 nan 1"), Code::NotFinite, Some("line 9"), "in 2 triangles"),
        (good.replace("1 3 4 7", "1 3 5 7"), Code::Malformed, Some("line 15"), "\"5\" is no vertex: there are 4"),
        (good.replace("1 3 4 7", "0 3 4 7"), Code::Malformed, Some("line 15"), "in section Triangles"),
        (good.replace("Triangles\n2", "Triangles\n3"), Code::CountMismatch, Some("line 13"), "cut off"),
        (
            square("Triangles\n2\n1 2 3 7\nCorners\n2\n1\n2\n"),
            Code::CountMismatch,
            Some("line 15"),
            "\"Corners\" stands",
        ),
        (good.replace("Triangles\n2", "Triangles\n1"), Code::CountMismatch, Some("line 15"), "a keyword should"),
        (square(&format!("{TWO}Vertices\n0\n")), Code::Malformed, Some("line 17"), "another section Vertices"),
        (format!("{SQUARE}Triangles\n2\n1 2 3 7\n1 3      4"), Code::CountMismatch, Some("line 15"), "ends in section"),
    ];
    for (text, code, location, word) in rows {
        let reason = content(&text).expect_err(&text).reason();
        assert_eq!((reason.code, reason.location.as_deref()), (code, location), "{reason:?}\n{text}");
        assert!(reason.message.contains(word), "{reason:?}");
    }
    let cloud = content(&square(""));
    assert!(matches!(cloud, Err(ReadError::Soup { error: SoupError::NoTriangles { points: 4 }, .. })), "{cloud:?}");
    assert!(content(&square("Triangles\n1\n1 2 4 0\n").replace("1 1 0.5", "nan inf 1e300")).is_ok(), "no corner");
}

#[test]
fn limits_are_kept() {
    let limits = Limits { elements: 4, ..Limits::default() };
    let with = |text: String| read(&Source::alone(text.as_bytes(), &limits));
    assert!(with(square(&TWO.repeat(2))).is_ok());
    for many in [square(&TWO.repeat(3)), square(&"Quadrilaterals\n1\n1 2 3 4 0\n".repeat(3))] {
        assert_eq!(with(many).expect_err("too many").reason().code, Code::TooLarge);
    }
}

#[test]
fn mutated_files_do_no_harm() {
    let sections =
        "Quadrilaterals\n1\n1 2 3 4 0\nTrianglesP2\n1\n1 2 3 4 4 4 0\nCorners\n1\n1\nTetrahedra\n1\n1 2 3 4 0\n";
    let seed = square(&format!("{TWO}{sections}"));
    let accepted = mutations(seed.as_bytes(), 20_000).filter(|b| read_alone(Format::Medit, b).is_ok()).count();
    assert!(accepted > 500, "{accepted}");
}

fn labelled(text: &str, source: &LabelSource) -> Result<Content, ReadError> {
    read(&Source { labels: source, ..Source::alone(text.as_bytes(), &Limits::default()) })
}

/// The names of the labels of the triangles, one after the other.
fn names(content: &Content) -> Vec<&str> {
    content.soup.labels().iter().map(|label| content.notes.labels[*label as usize].name.as_str()).collect()
}

#[test]
fn references_that_differ_are_labels() {
    let asked = |name: &str| LabelSource::Array(name.to_owned());
    let sections = "Quadrilaterals\n1\n1 2 3 4 -5\nTrianglesP2\n1\n1 2 3 4 4 4 12\nTriangles 1 1 3 4 12.0\n";
    // Faces may come before the points.
    let late = format!("MeshVersionFormatted 1\n{sections}{}", &SQUARE[23..]);
    for text in [square(sections), late] {
        let found = labelled(&text, &LabelSource::Usual).expect("labels");
        assert_eq!(names(&found), ["ref_-5", "ref_-5", "ref_12", "ref_12"]);
        assert_eq!(labelled(&text, &asked("ref")), Ok(found));
        assert!(labelled(&text, &LabelSource::Ignored).expect("a square").notes.labels.is_empty());
    }
    // One alone tells no parts apart.
    let one = labelled(&square(TWO), &LabelSource::Usual).expect("a square");
    assert!(one.notes.labels.is_empty() && one.soup.labels().is_empty() && one.notes.remarks.is_empty());
    assert_eq!(names(&labelled(&square(TWO), &asked("ref")).expect("a label")), ["ref_7", "ref_7"]);
    let missing = labelled(&square(TWO), &asked("reference")).expect_err("another name").reason();
    assert!(missing.code == Code::NoLabels && missing.message.contains("there are ref"), "{missing:?}");
}

#[test]
fn references_that_are_no_whole_numbers_are_told_or_refused() {
    for bad in ["0.5", "nan", "x7", "1e300"] {
        let broken = square(TWO).replace("3 4 7", &format!("3 4 {bad}"));
        if bad == "x7" {
            assert!(content(&broken).is_err(), "a keyword");
            continue;
        }
        let found = content(&broken).expect("a square");
        assert_eq!(found.soup, content(&square(TWO)).expect("a square").soup);
        assert!(found.notes.remarks[0].contains(&format!("line 15: the reference \"{bad}\"")), "{:?}", found.notes);
        let refused = labelled(&broken, &LabelSource::Array("ref".to_owned())).expect_err(bad).reason();
        assert!(refused.message.contains(&format!("ref holds {bad} for triangle 1")), "{refused:?}");
    }
}
