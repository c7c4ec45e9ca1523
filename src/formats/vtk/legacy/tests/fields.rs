//! Fields, from the arrays of points and cells.

use super::*;
use crate::formats::fields::{Field, Fields, Values};
use crate::formats::mutate::mutations;

fn field<'f>(fields: &'f [Field], name: &str) -> &'f Field {
    fields.iter().find(|field| field.name == name).unwrap_or_else(|| panic!("{name} among {fields:?}"))
}

/// Cells in an order that is not that of their arrays: a strip of two triangles, a line, and two polygons, one of which is cut.
fn cells_and_points(version: &str, binary: bool) -> Vec<u8> {
    let five = five(version);
    let bits = if binary { vec![0b1010_0000] } else { vec![1, 0, 1, 0] };
    let colours = if binary { vec![0, 255, 51, 0] } else { vec![0, 1, 1, 0] };
    File::new(version, binary, "POLYDATA")
        .square()
        .cells("TRIANGLE_STRIPS", five, &[&[0, 1, 3, 2]])
        .cells("LINES", five, &[&[0, 1]])
        .cells("POLYGONS", five, &[&[0, 1, 2], &[0, 1, 2, 3]])
        .text("CELL_DATA 4\nSCALARS flux%20in double\nLOOKUP_TABLE default\n")
        .doubles(&[9.0, 0.5, f64::NAN, 2.5])
        .text("FIELD FieldData 2\nlabel 1 4 int\n")
        .ints(&[9, 7, 8, 7])
        .text("words 1 4 string\n")
        .strings(&["a", "b", "c", "d"])
        .text(METADATA)
        .text("TENSORS t double\n")
        .doubles(&(0..36).map(f64::from).collect::<Vec<f64>>())
        .text("POINT_DATA 4\nVECTORS uv double\n")
        .doubles(&(0..12).map(f64::from).collect::<Vec<f64>>())
        .text("SCALARS flag bit\nLOOKUP_TABLE default\n")
        .array(&bits, |b: u8| [b])
        .text("COLOR_SCALARS c 1\n")
        .array(&colours, |b: u8| [b])
        .text("FIELD FieldData 2\nshort 1 2 int\n")
        .ints(&[1, 2])
        .text("vtkGhostType 1 4 unsigned_char\n")
        .array(&[0, 0, 1, 0], |b: u8| [b])
        .bytes
}

fn kept(bytes: &[u8]) -> (Fields, Vec<String>) {
    let content = read(bytes).expect("a surface");
    (content.fields, content.notes.remarks)
}

#[test]
fn arrays_are_kept_in_every_layout() {
    for (version, binary) in WAYS {
        let (found, remarks) = kept(&cells_and_points(version, binary));
        // Triangles of the strip come first in the file.
        assert_eq!(found.cell, [3, 3, 1, 2, 2], "{version} {binary}");
        let Values::Floats(flux) = &field(&found.cells, "flux in").values else { panic!("floats") };
        assert!(flux[..3] == [2.5, 2.5, 0.5] && flux[3].is_nan() && flux[4].is_nan(), "{flux:?}");
        let label = field(&found.cells, "input_label");
        assert_eq!(
            (label.input_name.as_deref(), &label.values),
            (Some("label"), &Values::Integers(vec![7, 7, 7, 8, 8]))
        );
        let tensor = field(&found.cells, "t");
        let expected = [27..36, 27..36, 9..18, 18..27, 18..27].into_iter().flatten().map(f64::from).collect();
        assert_eq!((tensor.components, &tensor.values), (9, &Values::Floats(expected)));
        let vector = field(&found.points, "input_uv");
        assert_eq!((vector.components, &vector.values), (3, &Values::Floats((0..12).map(f64::from).collect())));
        assert_eq!(field(&found.points, "flag").values, Values::Integers(vec![1, 0, 1, 0]));
        let colours = match binary {
            true => Values::Integers(vec![0, 255, 51, 0]),
            false => Values::Floats(vec![0.0, 1.0, 1.0, 0.0]),
        };
        assert_eq!(field(&found.points, "c").values, colours);
        assert_eq!((found.points.len(), found.cells.len(), remarks.len()), (3, 3, 1));
        assert!(remarks[0].starts_with("the array \"short\" of points is not kept: "), "{remarks:?}");
        assert!(remarks[0].contains("it has 2 entries for 4 of them"), "{remarks:?}");
    }
}

#[test]
fn what_stands_before_damage_is_kept() {
    let file = |rest: &str| {
        let file = File::new("3.0", false, "POLYDATA").square().cells("POLYGONS", false, &[&[0, 1, 2], &[0, 2, 3]]);
        file.text("CELL_DATA 2\nSCALARS p int\n1 2\n").text(rest).bytes
    };
    for (rest, told, remarks) in [
        ("SPLINES a int\n1 2\n", "arrays behind the damage are not kept: line 12: unexpected \"SPLINES\"", 2),
        ("SCALARS q int\n1 2.5\n", "the array \"q\" of cells is not kept: line 13: \"2.5\" is no value of \"q\"", 1),
        ("SCALARS q int 3\n1 2\n", "an array of POINT_DATA and CELL_DATA should have", 2),
        ("SCALARS p float\n1 2\n", "the array \"p\" of cells is not kept: another one before it has the same name", 1),
    ] {
        let (found, told_of) = kept(&file(rest));
        assert_eq!((found.cells.len(), &found.cells[0].values), (1, &Values::Integers(vec![1, 2])), "{rest}");
        assert!(told_of.len() == remarks && told_of[remarks - 1].contains(told), "{rest}: {told_of:?}");
    }
}

#[test]
fn mutated_files_do_no_harm() {
    let mut fields = 0;
    for (version, binary) in WAYS {
        for bytes in mutations(&cells_and_points(version, binary), 1_000) {
            fields += read(&bytes).map_or(0, |content| content.fields.points.len());
        }
    }
    assert!(fields > 2_000, "{fields}");
}
