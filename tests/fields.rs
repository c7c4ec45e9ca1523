//! Fields of the input: what a file has at its points and cells comes out on surface.vtu, by every way through the program.

use crate::support::{Out, planish};
use planish::formats::fields::{Field, Fields, Values};
use planish::formats::{Content, Format, read_alone};
use planish::outcome::Code;
use planish::report::{FieldOwner, FieldReport};
use serde_json::Value;

/// Quadrilaterals along a side.
const SIDE: usize = 12;

/// A square of quadrilaterals in two parts, with a field that is linear, names that are planish's own, and numbers of cells.
fn square() -> Vec<u8> {
    let points: Vec<[f64; 3]> = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| [i as f64, j as f64, 0.0])).collect();
    let corner = |i: usize, j: usize| j * (SIDE + 1) + i;
    let quads = (0..SIDE)
        .flat_map(|j| (0..SIDE).map(move |i| [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)]));
    let words = |numbers: Vec<f64>| numbers.iter().map(|n| format!("{n}\n")).collect::<String>();
    let count = SIDE * SIDE;
    let lines = [
        format!("# vtk DataFile Version 3.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS {} double\n", points.len()),
        words(points.concat()),
        format!("POLYGONS {count} {}\n", 5 * count),
        quads.map(|[a, b, c, d]| format!("4 {a} {b} {c} {d}\n")).collect(),
        format!("CELL_DATA {count}\nSCALARS label int\nLOOKUP_TABLE default\n"),
        (0..count).map(|cell| format!("{}\n", 1 + cell / (count / 2))).collect(),
        format!("FIELD FieldData 2\nchart 1 {count} double\n"),
        words((0..count).map(|cell| cell as f64 + 0.5).collect()),
        format!("words 1 {count} string\n{}", "a\n".repeat(count)),
        format!("POINT_DATA {}\nSCALARS linear double\nLOOKUP_TABLE default\n", points.len()),
        words(points.iter().map(|[x, y, _]| x + 2.0 * y).collect()),
        "VECTORS uv double\n".to_owned(),
        words(points.concat()),
    ];
    lines.concat().into_bytes()
}

fn field<'f>(fields: &'f [Field], name: &str) -> &'f Field {
    fields.iter().find(|field| field.name == name).unwrap_or_else(|| panic!("no {name}"))
}

fn floats<'f>(fields: &'f [Field], name: &str) -> &'f [f64] {
    match &field(fields, name).values {
        Values::Floats(values) => values,
        Values::Integers(_) => panic!("{name} is of whole numbers"),
    }
}

fn integers<'f>(fields: &'f [Field], name: &str) -> &'f [i64] {
    match &field(fields, name).values {
        Values::Integers(values) => values,
        Values::Floats(_) => panic!("{name} is of floats"),
    }
}

/// What a file of the result holds, as a reader that knows nothing of planish finds it. (Names of planish's own arrays get a prefix
/// when they are read, and those that have it keep them.)
fn read(out: &Out, file: &str) -> Content {
    read_alone(Format::Vtu, &out.read("square.vtk", file)).expect("a surface")
}

fn assert_carried(Content { soup, fields: Fields { points, cells, .. }, .. }: &Content) {
    for (point, value) in soup.points().iter().zip(floats(points, "linear")) {
        assert!((value - point[0] - 2.0 * point[1]).abs() <= 4e-11, "{value} at {point:?}");
    }
    assert_eq!(field(points, "input_uv").components, 3);
    // Both triangles of a quadrilateral, and all of their parts.
    let numbers = integers(cells, "input_cell").iter().zip(floats(cells, "input_chart"));
    assert!(numbers.clone().count() >= 20 && numbers.clone().all(|(cell, value)| *cell as f64 + 0.5 == *value));
    let halves = integers(cells, "input_triangle").iter().zip(integers(cells, "input_cell"));
    assert!(halves.clone().all(|(triangle, cell)| triangle / 2 == *cell));
}

#[test]
fn fields_come_out_on_the_surface_and_its_parts() {
    let out = Out::new();
    let (ended, report) = out.run_bytes("square.vtk", &square());
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let told = |name: &str, input_name: Option<&str>, on, components, integer| FieldReport {
        name: name.to_owned(),
        input_name: input_name.map(str::to_owned),
        on,
        components,
        integer,
    };
    let expected = [
        told("linear", None, FieldOwner::Points, 1, false),
        told("input_uv", Some("uv"), FieldOwner::Points, 3, false),
        told("input_label", Some("label"), FieldOwner::Cells, 1, true),
        told("input_chart", Some("chart"), FieldOwner::Cells, 1, false),
    ];
    assert_eq!(report.fields, expected);
    assert_eq!(report.content.expect("read").skipped["arrays without values to keep"], 1);
    assert_eq!(report.labels.len(), 2);
    let whole = read(&out, "surface.vtu");
    assert_carried(&whole);
    let labels = integers(&whole.fields.cells, "input_input_label").iter();
    assert!(
        labels.zip(integers(&whole.fields.cells, "input_label")).all(|(of_file, of_planish)| of_file == of_planish)
    );
    for part in ["surface-label_1.vtu", "surface-label_2.vtu"] {
        let part = read(&out, part);
        assert_carried(&part);
        assert!(part.soup.triangles().len() * 2 <= whole.soup.triangles().len() + 2);
    }
    let param = read(&out, "param.vtu").fields;
    assert!(param.points.iter().chain(&param.cells).all(|field| !field.name.starts_with("input_input_")));
    let checked = planish(["check".as_ref(), out.of("square.vtk").as_os_str()]);
    assert!(checked.code == Some(0) && checked.out.contains("proven one-to-one"), "{checked:?}");
}

/// In a process of its own, and where names of parts count for nothing.
#[test]
fn fields_come_through_by_other_ways() {
    let (here, apart, ignoring) = (Out::new(), Out::new(), Out::new());
    here.run_bytes("square.vtk", &square());
    let (ended, report) = apart.run_bytes_with("square.vtk", &square(), &["--job-time", "600"]);
    assert_eq!((ended.code, report.fields.len()), (Some(0), 4), "{}", ended.err);
    assert_eq!(here.read("square.vtk", "surface.vtu"), apart.read("square.vtk", "surface.vtu"));
    let (ended, report) = ignoring.run_bytes_with("square.vtk", &square(), &["--ignore-labels"]);
    assert_eq!((ended.code, report.fields.len(), report.labels.len()), (Some(0), 4, 0), "{}", ended.err);
    assert_carried(&read(&ignoring, "surface.vtu"));
}

/// Nothing is said of what is not there; values beyond the limit refuse the file.
#[test]
fn files_without_fields_are_as_ever_and_too_many_values_are_refused() {
    let plain: Vec<u8> = {
        let text = String::from_utf8(square()).expect("text");
        text.split_inclusive("CELL_DATA").next().expect("geometry").replace("CELL_DATA", "").into_bytes()
    };
    let out = Out::new();
    let (ended, report) = out.run_bytes("square.vtk", &plain);
    assert_eq!((ended.code, report.fields.len()), (Some(0), 0), "{}", ended.err);
    let text: Value = serde_json::from_slice(&out.read("square.vtk", "report.json")).expect("JSON");
    assert!(text.get("fields").is_none());
    let own = read(&out, "surface.vtu").fields;
    assert!(own.points.len() == 2 && own.cells.len() == 9, "{own:?}");
    let settings = tempfile::NamedTempFile::new().expect("a file");
    std::fs::write(settings.path(), "[limits]\nelements = 400\n").expect("written");
    let config = settings.path().to_str().expect("UTF-8");
    let (ended, report) = Out::new().run_bytes_with("square.vtk", &square(), &["--config", config]);
    let reason = report.reason.expect("a reason");
    assert_eq!((ended.code, reason.code), (Some(1), Code::TooLarge));
    assert!(reason.message.contains("values of arrays exceed the limit of 400"), "{}", reason.message);
}
