use super::*;

use crate::formats::{LabelSource, Limits};
use planish_core::mesh::TriangleSoup;

fn read(bytes: &[u8]) -> Result<TriangleSoup, ReadError> {
    limited(bytes, &Limits::default())
}

fn limited(bytes: &[u8], limits: &Limits) -> Result<TriangleSoup, ReadError> {
    super::read(&Source::alone(bytes, limits)).map(|content| content.soup)
}

fn facet(x: &str) -> String {
    format!("facet normal 0 0 1\nouter loop\nvertex {x} 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n")
}

fn binary_file(header: &[u8], declared: u32, triangles: &[[f32; 9]]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes[..header.len()].copy_from_slice(header);
    bytes.extend(declared.to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        t.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

fn error(bytes: &[u8]) -> StlError {
    match read(bytes) {
        Err(ReadError::Stl(e)) => e,
        other => panic!("{other:?}"),
    }
}

#[test]
fn all_solids_are_read_in_any_case_and_after_blanks() {
    let file = format!("  \n\tSOLID one\n{}ENDSOLID one\nsolid two\n{}endsolid", facet("0").to_uppercase(), facet("2"));
    let soup = read(file.as_bytes()).expect("two solids");
    assert_eq!((soup.triangles().len(), soup.points()[3]), (2, [2.0, 0.0, 0.0]));
    type Layout = fn(&str) -> String;
    let layouts: [(&str, Layout); 4] = [
        ("on one line", |f| f.replace('\n', " ")),
        ("with carriage returns", |f| f.replace('\n', "\r")),
        ("with a byte order mark", |f| format!("\u{feff}{f}")),
        ("with colours", |f| f.replace("outer", "color 0.5 0.5 1\nouter")),
    ];
    for (how, layout) in layouts {
        let file = layout(&format!("solid part of facets\n{0}{0}endsolid part\n", facet("0")));
        let soup = read(file.as_bytes()).unwrap_or_else(|e| panic!("{how}: {e}"));
        assert_eq!(soup.triangles().len(), 2, "{how}");
    }
    let windows = format!("solid\r\n{}endsolid\r\n", facet("0").replace('\n', "\r\n"));
    assert_eq!(read(windows.as_bytes()).expect("line ends").triangles().len(), 1);
}

#[test]
fn binary_files_may_begin_with_solid() {
    for header in [&b""[..], b"solid but binary", b"solid\nfacet normal"] {
        let soup = read(&binary_file(header, 2, &[TRIANGLE; 2])).expect("binary");
        assert_eq!((soup.triangles().len(), soup.points()[1]), (2, [1.0, 0.0, 0.0]));
    }
}

#[test]
fn count_and_size_must_agree() {
    let file = binary_file(b"", 3, &[TRIANGLE; 2]);
    assert_eq!(error(&file), StlError::Count { declared: 3, needed: 234, size: 184, room: 2 });
    assert!(matches!(error(&file[..100]), StlError::Count { room: 0, .. }));
    let none = [binary_file(b"", 0, &[]), vec![0; 50]].concat();
    assert_eq!(error(&none), StlError::Excess { declared: 0, needed: 84, size: 134, room: 1 });
    let named = binary_file(b"solid part", 3, &[TRIANGLE; 2]);
    assert!(matches!(error(&named), StlError::Count { .. }), "binary, though it begins with solid");
    assert_eq!(error(b"abc"), StlError::Short { size: 3 });
}

fn remarks(bytes: &[u8]) -> (usize, Vec<String>) {
    let content = super::read(&Source::alone(bytes, &Limits::default())).expect("read");
    (content.soup.triangles().len(), content.notes.remarks)
}

#[test]
fn what_follows_all_triangles_of_a_binary_file_is_told() {
    for header in [&b"binary"[..], b"solid but binary"] {
        for (rest, told) in [(vec![0; 7], "7 bytes follow the 2 triangles"), (vec![1; 123], "room for 2 more")] {
            let (triangles, remarks) = remarks(&[binary_file(header, 2, &[TRIANGLE; 2]), rest].concat());
            assert!(triangles == 2 && remarks.len() == 1 && remarks[0].contains(told), "{remarks:?}");
        }
    }
    assert_eq!(remarks(&binary_file(b"", 2, &[TRIANGLE; 2])), (2, vec![]));
}

#[test]
fn a_missing_end_after_a_facet_is_told() {
    let two = format!("solid a\n{}endsolid a\nsolid b\n{}", facet("0"), facet("1"));
    for text in [&two[..], two.trim_end(), &two[two.find("solid b").expect("there")..]] {
        let (_, remarks) = remarks(text.as_bytes());
        assert!(
            remarks.len() == 1 && remarks[0].contains("without \"endsolid\", after a complete facet"),
            "{remarks:?}"
        );
    }
    assert_eq!(remarks(format!("{two}endsolid").as_bytes()), (2, vec![]));
    for cut in ["solid\n", &two[..two.find("facet normal 0 0 1\nouter loop\nvertex 1").expect("there")]] {
        assert!(matches!(error(cut.as_bytes()), StlError::Truncated { .. }), "{cut}");
    }
}

#[test]
fn too_many_triangles_are_refused_by_the_name_of_the_setting() {
    let limits = Limits { elements: 2, ..Limits::default() };
    let text = |facets: usize| format!("solid\n{}endsolid", facet("0").repeat(facets)).into_bytes();
    for (fits, more) in [(binary_file(b"", 2, &[TRIANGLE; 2]), binary_file(b"", 3, &[TRIANGLE; 3])), (text(2), text(3))]
    {
        assert!(limited(&fits, &limits).is_ok());
        let reason = limited(&more, &limits).expect_err("three triangles").reason();
        assert!(reason.code == Code::TooLarge && reason.message.contains("3 triangles"), "{reason:?}");
        assert!(reason.message.contains("`elements` in the table [limits] of planish.toml"), "{reason:?}");
    }
}

#[test]
fn broken_numbers_are_named_with_their_place() {
    let mut bad = TRIANGLE;
    bad[4] = f32::NAN;
    let refused = |bytes: &[u8]| read(bytes).expect_err("a corner").reason();
    let reason = refused(&binary_file(b"", 3, &[TRIANGLE, bad, bad]));
    assert_eq!((reason.code, reason.location.as_deref()), (Code::NotFinite, Some("byte 134")));
    assert!(reason.message.contains("y of point 4 (from 0) is NaN, and triangle 1 has a corner there"), "{reason:?}");
    assert!(reason.message.contains("2 corners are of this sort") && reason.message.contains("in 2 triangles"));
    let reason = refused(format!("solid\n{}endsolid", facet("inf")).as_bytes());
    assert_eq!((reason.code, reason.location.as_deref()), (Code::NotFinite, Some("line 4")));
    let ascii = |x| error(format!("solid\n{}endsolid", facet(x)).as_bytes());
    for (word, told) in [("1,5", "decimal comma"), ("1.5D+00", "Fortran exponent"), ("x", "\"x\" is no number;")] {
        assert!(ascii(word).to_string().contains(told), "{}", ascii(word));
    }
    let normal = format!("solid\n{}endsolid", facet("0").replace("0 0 1", "0,0 0,0 1,0"));
    assert!(error(normal.as_bytes()).to_string().contains("decimal comma"));
    assert!(matches!(ascii("1,5"), StlError::Syntax { line: 4, .. }));
    assert!(matches!(ascii("1 2"), StlError::Syntax { line: 4, .. }));
}

#[test]
fn numbers_that_are_none_are_passed_over_in_normals_only() {
    for broken in ["nan", "-nan", "-nan(ind)", "-1.#IND", "1.#QNAN00e+000", "1.#INF"] {
        let normal = format!("normal {broken} {broken} {broken}");
        let file = |facet: String| format!("solid\n{facet}endsolid").into_bytes();
        assert!(read(&file(facet("0").replace("normal 0 0 1", &normal))).is_ok(), "{broken}");
        let found = read(&file(facet(broken))).expect_err(broken).reason();
        assert_eq!((found.code, found.location.as_deref()), (Code::NotFinite, Some("line 4")), "{broken}");
    }
    assert!(read(b"solid\nfacet normal a b c").is_err());
}

#[test]
fn zeros_may_fill_the_end_of_text() {
    for facets in [1, 30] {
        let text = format!("solid\n{}endsolid\n", facet("0").repeat(facets)).into_bytes();
        for filling in [&[0; 40][..], &[0x1a], b"\x1a\0\0"] {
            let soup = read(&[&text, filling].concat()).expect("filled up");
            assert_eq!(soup.triangles().len(), facets);
        }
    }
}

#[test]
fn text_of_another_kind_is_told() {
    let found = error(format!("# by hand\nsolid\n{}endsolid\n", facet("0")).as_bytes());
    let StlError::NoSolid { begins } = &found else { panic!("{found}") };
    assert!(begins.starts_with("# by hand"));
    assert_eq!((found.code(), found.location().as_deref()), (Code::Malformed, Some("line 1")));
}

#[test]
fn cut_off_and_garbled_files_are_refused() {
    let whole = format!("solid\n{}endsolid", facet("0"));
    let facet_ends = whole.len() - "\nendsolid".len();
    for end in (6..facet_ends).chain(facet_ends + 2..whole.len()) {
        assert!(read(&whole.as_bytes()[..end]).is_err(), "cut at {end}");
    }
    assert!(matches!(error(b"solid\nvertex 0 0 0\nendsolid"), StlError::Syntax { line: 2, .. }));
    assert!(matches!(error(b"\n\nsolid\n\nfacet normal 0 0 1 nonsense"), StlError::Syntax { line: 5, .. }));
    assert!(matches!(read(b"solid\nendsolid"), Err(ReadError::Soup { .. })), "no triangles");
    assert!(matches!(read(&binary_file(b"", 0, &[])), Err(ReadError::Soup { .. })), "no triangles");
}

#[test]
fn solids_name_their_triangles() {
    let names = |text: &str, labels: &LabelSource| {
        let limits = Limits::default();
        let content = super::read(&Source { labels, ..Source::alone(text.as_bytes(), &limits) })?;
        let name = |label: &u32| content.notes.labels[*label as usize].name.clone();
        Ok::<Vec<String>, ReadError>(content.soup.labels().iter().map(name).collect())
    };
    let usual = |text: &str| names(text, &LabelSource::Usual).expect("solids");
    let [one, two] = [facet("0"), facet("1")];
    let file = format!(
        "solid heated wall\n{one}{two}endsolid\nsolid empty\nendsolid\nsolid b\n{one}endsolid b\nsolid heated wall\n{two}endsolid"
    );
    assert_eq!(usual(&file), ["heated wall", "heated wall", "b", "heated wall"]);
    let nameless = format!("solid\n{one}endsolid\nsolid\n{two}endsolid");
    assert_eq!(usual(&nameless), ["solid_1", "solid_2"]);
    assert_eq!(usual(&format!("solid\n{one}endsolid")), [""; 0]);
    assert_eq!(names(&file, &LabelSource::Ignored).expect("solids"), [""; 0]);
    assert_eq!(names(&file, &LabelSource::Array("solid".to_owned())).expect("solids").len(), 4);
    let missing = names(&file, &LabelSource::Array("region".to_owned())).expect_err("no region");
    assert_eq!(missing.reason().code, Code::NoLabels);
}
