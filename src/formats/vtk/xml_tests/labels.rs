//! Labels of triangles, from the arrays of cells.

use super::files::{labelled_grid, labelled_polydata};
use super::*;
use crate::formats::LabelSource;

fn labelled(bytes: &[u8], source: &LabelSource) -> Result<Content, ReadError> {
    crate::formats::read(
        Format::Vtu,
        &Source { labels: source, keeps_fields: false, ..Source::alone(bytes, &Limits::default()) },
    )
}

fn asked(name: &str) -> LabelSource {
    LabelSource::Array(name.to_owned())
}

/// The names of the labels of the triangles, one after the other.
fn names(content: &Content) -> Vec<&str> {
    content.soup.labels().iter().map(|label| content.notes.labels[*label as usize].name.as_str()).collect()
}

#[test]
fn arrays_of_cells_label_triangles_in_every_encoding() {
    let numbers = ["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32"];
    for style in styles() {
        let bytes = labelled_polydata(style);
        for array in numbers {
            let found = labelled(&bytes, &asked(array)).unwrap_or_else(|e| panic!("{style:?} {array}: {e}"));
            let [one, two, three] = [1, 2, 3].map(|value| format!("{array}_{value}"));
            assert_eq!(names(&found), [&three, &three, &one, &two, &two, "unnamed"], "{style:?} {array}");
        }
        let strings = labelled(&bytes, &asked("a < \"b\"")).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(names(&strings), ["part 3 é", "part 3 é", "part 1 é", "part 2 é", "part 2 é", "unnamed"]);
        let ignored = labelled(&bytes, &LabelSource::Ignored).expect("a surface");
        assert_eq!(ignored.soup.triangles(), strings.soup.triangles());
        // None of them has a usual name, but that of the piece in which nothing is.
        assert_eq!(labelled(&bytes, &LabelSource::Usual), Ok(ignored), "{style:?}");
        for array in ["Vector", "label", "connectivity"] {
            let missing = labelled(&bytes, &asked(array)).expect_err("missing").reason();
            assert_eq!(missing.code, Code::NoLabels);
            assert!(missing.message.contains("Int8, UInt8") && !missing.message.contains("Float32"), "{missing:?}");
        }
    }
}

#[test]
fn numbers_of_planish_have_names() {
    for style in styles() {
        let found = labelled(&labelled_grid(style), &LabelSource::Usual).unwrap_or_else(|e| panic!("{style:?}: {e}"));
        assert_eq!(names(&found), ["the wall", "the wall", "label_9"], "{style:?}");
        assert_eq!(found.notes.labels.iter().map(|label| label.tag).collect::<Vec<_>>(), [7, 9]);
        assert_eq!(labelled(&labelled_grid(style), &asked("label")), Ok(found));
    }
}

/// A text file with these words replaced.
fn changed(from: &str, to: &str) -> Vec<u8> {
    let whole = String::from_utf8(labelled_grid(Style { encoding: Encoding::Ascii, ..PLAIN })).expect("text");
    assert!(whole.contains(from), "{from}");
    whole.replacen(from, to, 1).into_bytes()
}

#[test]
fn damaged_arrays_are_told_and_refused_only_where_they_are_asked_for() {
    let label = "format=\"ascii\"  type=\"Int32\" Name='label'";
    let cases = [
        (label, "format=\"hex\" type=\"Int32\" Name='label'", "\"hex\" is no format"),
        (label, "format=\"appended\" type=\"Int32\" Name='label'", "values of \"label\" have no offset"),
        (label, "format=\"appended\" offset=\"0\" type=\"Int32\" Name='label'", "there is no <AppendedData>"),
        (label, "format=\"binary\" type=\"Int32\" Name='label'", "cannot be decoded"),
        ("90 7 <", "90 <", "values of \"label\" should have 2 values"),
        ("90 7 <", "90 7.5 <", "\"7.5\" is no value of values of \"label\""),
        ("90 7 <", "90 <b/> 7 <", "interrupted"),
        ("7 2 <", "7 x <", "\"x\" is no value of values of \"the wall\""),
    ];
    let full = labelled(&changed("", ""), &LabelSource::Ignored).expect("whole");
    for (from, to, expected) in cases {
        let bytes = changed(from, to);
        let usual = labelled(&bytes, &LabelSource::Usual).unwrap_or_else(|e| panic!("{to}: {e}"));
        assert_eq!(usual.soup, full.soup, "{to}");
        let [remark] = &usual.notes.remarks[..] else { panic!("{to}: {:?}", usual.notes.remarks) };
        assert!(remark.contains(expected), "{to}: {remark}");
        let refused = labelled(&bytes, &asked("label"));
        assert!(matches!(refused, Err(ReadError::Vtk(_))), "{to}: {refused:?}");
        assert_eq!(labelled(&bytes, &LabelSource::Ignored), Ok(full.clone()), "{to}");
    }
    let not_whole = changed(label, "format=\"ascii\" type=\"Float64\" Name='label'");
    let not_whole = String::from_utf8(not_whole).expect("text").replace("90 7 <", "0.5 7.5 <");
    let refused = labelled(not_whole.as_bytes(), &asked("label")).expect_err("not whole").reason();
    assert!(refused.message.contains("label holds 7.5 for triangle 0"), "{refused:?}");
}

#[test]
fn labels_take_what_is_left_of_the_budget_only() {
    let bomb = vec![0; 3 << 20];
    let packed = compress("ZLib", &bomb);
    let data = [words(&[1, 3 << 20, 0, packed.len() as u64]), packed].concat();
    let file = |cells: &str| {
        let ids = |name: &str, ids: &str| {
            format!("<DataArray type=\"Int8\" Name=\"{name}\" format=\"ascii\">{ids}</DataArray>")
        };
        let head = format!(
            "<VTKFile type=\"PolyData\" compressor=\"vtkZLibDataCompressor\" header_type=\"UInt64\"><PolyData><Piece \
             NumberOfPoints=\"3\" NumberOfPolys=\"1\">{cells}<Points>{}</Points><Polys>{}{}</Polys></Piece></PolyData>\
             <AppendedData encoding=\"raw\">_",
            ids("Points", "0 0 0 1 0 0 0 1 0"),
            ids("connectivity", "0 1 2"),
            ids("offsets", "3")
        );
        [head.as_bytes(), &data, b"</AppendedData></VTKFile>"].concat()
    };
    let array = |kind: &str, name: &str| {
        format!("<CellData><{kind} Name=\"label\" type=\"{name}\" format=\"appended\" offset=\"0\"/></CellData>")
    };
    for cells in [array("DataArray", "Int8"), array("Array", "String")] {
        let bytes = file(&cells);
        let limits = Limits { expansion: 2, ..Limits::default() };
        let found = limited(&bytes, limits).expect("a triangle");
        assert!(found.notes.remarks[0].contains("raise the limit of expansion"), "{:?}", found.notes.remarks);
        let by_name = asked("label");
        let refused = crate::formats::read(Format::Vtp, &Source { labels: &by_name, ..Source::alone(&bytes, &limits) });
        assert_eq!(refused.expect_err("a bomb").reason().code, Code::TooLarge);
    }
}

#[test]
fn cut_and_changed_files_give_an_error_or_the_same_surface() {
    for style in styles().into_iter().filter(|s| s.block == 100 && s.wide && !s.big) {
        for whole in [labelled_grid(style), labelled_polydata(style)] {
            let full = labelled(&whole, &asked("label")).or_else(|_| labelled(&whole, &asked("Int8"))).expect("labels");
            for end in 0..whole.len() {
                if let Ok(content) = labelled(&whole[..end], &LabelSource::Usual) {
                    assert_eq!(content.soup.triangles(), full.soup.triangles(), "{style:?}, cut at {end}");
                }
            }
            for at in 0..whole.len() {
                for other in [b'9', 0xff, whole[at] ^ 1] {
                    let mut bytes = whole.clone();
                    bytes[at] = other;
                    let _ = labelled(&bytes, &LabelSource::Usual);
                }
            }
        }
    }
}

/// Very many pieces, each with an array, take no longer than they are.
#[test]
fn very_many_arrays_are_read_in_time() {
    let array = "<DataArray type=\"Int32\" Name=\"label\" format=\"ascii\">7</DataArray>";
    let others: String = (0..100_000).map(|i| array.replace("label", &format!("a{i}"))).collect();
    let ids =
        |name: &str, ids: &str| format!("<DataArray type=\"Int8\" Name=\"{name}\" format=\"ascii\">{ids}</DataArray>");
    let piece = |arrays: &str| {
        format!(
            "<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><CellData>{arrays}</CellData><Points>{}</Points><Polys>{}{}\
             </Polys></Piece>",
            ids("Points", "0 0 0 1 0 0 0 1 0"),
            ids("connectivity", "0 1 2"),
            ids("offsets", "3")
        )
    };
    let pieces = piece(array).repeat(50_000);
    let file = format!("<VTKFile type=\"PolyData\"><PolyData>{}{pieces}</PolyData></VTKFile>", piece(&others));
    let found = labelled(file.as_bytes(), &LabelSource::Usual).expect("read");
    assert_eq!((names(&found)[0], names(&found)[50_000], found.notes.labels.len()), ("unnamed", "label_7", 2));
}
