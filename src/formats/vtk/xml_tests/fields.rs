//! Fields, from the arrays of points and cells.

use super::files::{labelled_polydata, sized_grid};
use super::*;
use crate::formats::Fields;
use crate::formats::fields::{Field, Values};

fn fields(bytes: &[u8]) -> (Fields, Vec<String>) {
    let content = read_alone(Format::Vtu, bytes).expect("a surface");
    (content.fields, content.notes.remarks)
}

fn field<'f>(fields: &'f [Field], name: &str) -> &'f Field {
    fields.iter().find(|field| field.name == name).unwrap_or_else(|| panic!("{name} among {fields:?}"))
}

/// Equal numbers, where what is none equals what is none.
fn assert_floats(values: &Values, expected: &[f64]) {
    let Values::Floats(values) = values else { panic!("{values:?}") };
    let are_alike = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
    assert!(values.len() == expected.len() && values.iter().zip(expected).all(are_alike), "{values:?} {expected:?}");
}

/// Arrays that a piece lacks are no numbers there.
#[test]
fn arrays_of_points_are_kept_in_every_encoding() {
    let rest = [f64::NAN; 5];
    for style in styles() {
        let (found, remarks) = fields(&sized_grid(style));
        assert!(remarks.is_empty() && found.points.len() == 12 && found.cells.is_empty(), "{style:?}: {remarks:?}");
        for name in ["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32"] {
            assert_floats(&field(&found.points, name).values, &[&[3.0, 1.0, 4.0, 0.0], &rest[..]].concat());
        }
        let everywhere = [3.0, 1.0, 4.0, 0.0, 5.0, 6.0, 7.0, 8.0, -9.0];
        assert_floats(&field(&found.points, "Float64").values, &everywhere);
        assert_floats(&field(&found.points, "a < b").values, &[&[0.5, 0.25, f64::NAN, -1.0], &rest[..]].concat());
        let vector = field(&found.points, "Vector");
        assert_eq!((vector.components, vector.values.len()), (3, 27));
        let Values::Floats(values) = &vector.values else { panic!("floats") };
        assert!(values[..4] == [0.0, 0.0, 0.25, 1.0] && values[12..].iter().all(|value| value.is_nan()));
    }
}

/// Cells are counted in the order of their arrays: vertices, lines, polygons, strips.
#[test]
fn arrays_of_cells_are_kept_by_triangle_in_every_encoding() {
    for style in styles() {
        let content = read_alone(Format::Vtu, &labelled_polydata(style)).expect("a surface");
        let found = content.fields;
        assert_eq!(found.cells.len(), 10, "{style:?}");
        for name in ["Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Float32"] {
            let field = field(&found.cells, name);
            assert_floats(&field.values, &[3.0, 3.0, 1.0, 2.0, 2.0, f64::NAN]);
        }
        assert_eq!((field(&found.cells, "Vector").components, field(&found.cells, "Vector").values.len()), (3, 18));
        // The strip is the last cell of the first piece, the quadrilateral the one before it.
        assert_eq!(found.cell, [4, 4, 2, 3, 3, 5]);
        assert_eq!(content.notes.skipped["arrays without values to keep"], 1);
    }
}

/// A grid in text, of a triangle and a quadrilateral in one piece, with these arrays of points and cells.
fn text(points: &str, cells: &str) -> Vec<u8> {
    format!(
        "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">
         <PointData>{points}</PointData><CellData>{cells}</CellData>
         <Points><DataArray type=\"Float64\" NumberOfComponents=\"3\">0 0 0 1 0 0 1 1 0 0 1 0 2 0 0</DataArray></Points>
         <Cells><DataArray type=\"Int32\" Name=\"connectivity\">0 1 0 1 2 3 1 4 2</DataArray>
         <DataArray type=\"Int32\" Name=\"offsets\">2 6 9</DataArray>
         <DataArray type=\"UInt8\" Name=\"types\">3 9 5</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"
    )
    .into_bytes()
}

fn array(kind: &str, name: &str, components: usize, values: &str) -> String {
    format!("<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\">{values}</DataArray>")
}

#[test]
fn whole_numbers_stay_whole_and_all_components_are_kept() {
    let tensor: Vec<String> = (0..27).map(|k| k.to_string()).collect();
    let cells = array("Int64", "id", 1, "7 -8 9223372036854775807")
        + &array("Float32", "tensor", 9, &tensor.join(" "))
        + &array("UInt64", "large", 1, "0 18446744073709551615 1")
        + &array("UInt8", "label", 1, "1 2 3");
    let points = array("UInt8", "rgb", 3, &"0 128 255 ".repeat(5));
    let (found, remarks) = fields(&text(&points, &cells));
    assert!(remarks.is_empty(), "{remarks:?}");
    assert_eq!(field(&found.points, "rgb").values, Values::Integers([0, 128, 255].repeat(5)));
    assert_eq!(field(&found.cells, "id").values, Values::Integers(vec![-8, -8, i64::MAX]));
    // Larger than any of them.
    assert_eq!(field(&found.cells, "large").values, Values::Floats(vec![u64::MAX as f64, u64::MAX as f64, 1.0]));
    let tensor = field(&found.cells, "tensor");
    let expected = [9..18, 9..18, 18..27].into_iter().flatten().map(f64::from).collect();
    assert_eq!((tensor.components, &tensor.values), (9, &Values::Floats(expected)));
    let label = field(&found.cells, "input_label");
    assert_eq!((label.input_name.as_deref(), &label.values), (Some("label"), &Values::Integers(vec![2, 2, 3])));
    assert_eq!(found.cell, [1, 1, 2]);
}

#[test]
fn what_is_wrong_with_an_array_is_told_and_the_others_are_kept() {
    let good = array("Float64", "good", 1, "1 2 3 4 5");
    let cases = [
        (
            array("Float64", "a", 1, "1 2 3 4"),
            "the array \"a\" of points is not kept: line 2: values of \"a\" should have 5",
        ),
        (array("Float64", "a", 2, "1 2 3 4 5"), "should have 10 values"),
        (array("Float64", "a", 1, "1 2 x 4 5"), "\"x\" is no value of values of \"a\""),
        (array("Int8", "a", 1, "1 2 2.5 4 5"), "\"2.5\" is no value"),
        (array("Float64", "a", usize::MAX / 8, "1"), "more than 100 times as large as the file"),
        (good.replace("good", "a").replace("type", "format=\"hex\" type"), "\"hex\" is no format"),
    ];
    for (bad, told) in cases {
        let limits = Limits { elements: u64::MAX, ..Limits::default() };
        let bytes = text(&(bad.clone() + &good), "");
        let content = crate::formats::read(Format::Vtu, &Source::alone(&bytes, &limits)).expect("a surface");
        let [remark] = &content.notes.remarks[..] else { panic!("{bad}: {:?}", content.notes.remarks) };
        assert!(remark.contains(told), "{remark}");
        assert_eq!(content.fields.points.len(), 1);
        assert_floats(&content.fields.points[0].values, &[1.0, 2.0, 3.0, 4.0, 5.0]);
        let without = Source { keeps_fields: false, ..Source::alone(&bytes, &limits) };
        let without = crate::formats::read(Format::Vtu, &without).expect("a surface");
        assert!(without.fields.are_none() && without.notes.remarks.is_empty() && without.soup == content.soup);
    }
    let (hidden, _) = fields(&text(&good, &array("UInt8", "vtkGhostType", 1, "0 0 1")));
    assert!(hidden.cells.is_empty() && hidden.cell.is_empty());
}

#[test]
fn too_many_values_are_refused() {
    let bytes = text(&array("Float64", "v", 3, &"1 2 3 ".repeat(5)), "");
    let refused = |elements| {
        let limits = Limits { elements, ..Limits::default() };
        crate::formats::read(Format::Vtu, &Source::alone(&bytes, &limits)).map(|_| ()).map_err(|e| e.reason())
    };
    assert_eq!(refused(15), Ok(()));
    let reason = refused(14).expect_err("too many");
    assert_eq!(reason.code, Code::TooLarge);
    assert!(reason.message.starts_with("15 values of arrays exceed the limit of 14; split the file"), "{reason:?}");
}

#[test]
fn mutated_files_do_no_harm() {
    let mut kept = 0;
    for style in styles().into_iter().filter(|style| style.block == 16) {
        for file in [sized_grid(style), labelled_polydata(style)] {
            for bytes in crate::formats::mutate::mutations(&file, 50) {
                kept += read_alone(Format::Vtu, &bytes).map_or(0, |content| content.fields.points.len().min(1));
            }
        }
    }
    assert!(kept > 500, "{kept}");
}
