//! Sizes at points, from the arrays of points.

use super::*;
use crate::formats::mutate::mutations;

/// What asks for nothing.
const NONE: f64 = f64::INFINITY;

fn sized(bytes: &[u8], array: &str) -> Result<Content, ReadError> {
    crate::formats::read(Format::Vtk, &Source { sizes: Some(array), ..Source::alone(bytes, &Limits::default()) })
}

/// Two triangles of a square of four points and a line, with arrays of points and of cells.
fn square(version: &str, binary: bool) -> File {
    let five = five(version);
    let whole = [3, 1, 0, 4];
    File::new(version, binary, "POLYDATA")
        .square()
        .cells("LINES", five, &[&[0, 1]])
        .cells("POLYGONS", five, &[&[0, 1, 2, 3]])
        .text("CELL_DATA 2\nSCALARS h double\nLOOKUP_TABLE default\n")
        .doubles(&[9.0, 9.0])
        .text("POINT_DATA 4\nSCALARS size double 1\nLOOKUP_TABLE default\n")
        .doubles(&[0.5, 0.25, f64::NAN, -1.0])
        .text(METADATA)
        .text("VECTORS velocity double\n")
        .doubles(&[0.5; 12])
        .text("SCALARS pair double 2\nLOOKUP_TABLE default\n")
        .doubles(&[0.5; 8])
        .text("FIELD FieldData 7\nbyte 1 4 unsigned_char\n")
        .array(&[3, 1, 0, 4], |b: u8| [b])
        .text("int 1 4 int\n")
        .ints(&whole)
        .text("long 1 4 vtktypeint64\n")
        .longs(&whole.map(i64::from))
        .text("float 1 4 float\n")
        .array(&whole.map(|n| n as f32), f32::to_be_bytes)
        .text("edge%20length 1 4 double\n")
        .doubles(&whole.map(f64::from))
        .text("words 1 4 string\n")
        .strings(&["a", "b", "c", "d"])
        .text("short 1 2 int\n")
        .ints(&[1, 2])
}

#[test]
fn arrays_of_points_tell_sizes_in_every_layout() {
    for (version, binary) in WAYS {
        let bytes = square(version, binary).bytes;
        let plain = read(&bytes).expect("a surface").soup;
        let found = |array: &str| {
            let found = sized(&bytes, array).unwrap_or_else(|e| panic!("{version} {binary} {array}: {e}"));
            assert_eq!((found.soup.points(), found.soup.triangles()), (plain.points(), plain.triangles()));
            (found.soup.sizes().to_vec(), found.notes.remarks)
        };
        let (sizes, remarks) = found("size");
        assert_eq!(sizes, [0.5, 0.25, NONE, NONE], "{version} {binary}");
        assert!(remarks[0].starts_with("at 2 of the 4 corners"), "{remarks:?}");
        for array in ["byte", "int", "long", "float", "edge length"] {
            assert_eq!(found(array).0, [3.0, 1.0, NONE, 4.0], "{version} {binary} {array}");
        }
        assert!(plain.sizes().is_empty());
        for (array, told) in [
            ("h", "there are size, byte, int, long, float, edge length, short;"),
            ("words", "there are size, byte"),
            ("velocity", "velocity has 3 numbers at every point"),
            ("pair", "pair has 2 numbers at every point"),
        ] {
            let refused = sized(&bytes, array).expect_err(array).reason();
            assert!(refused.code == Code::NoSizes && refused.message.contains(told), "{refused:?}");
        }
        let short = sized(&bytes, "short").expect_err("two for four").reason();
        assert!(short.message.contains("the array \"short\" has 2 values for 4 points"), "{short:?}");
        assert!(short.location.is_some());
    }
}

#[test]
fn damaged_arrays_are_refused_with_their_place() {
    let file = |rest: &str| {
        let file = File::new("3.0", false, "POLYDATA").square().cells("POLYGONS", false, &[&[0, 1, 2], &[0, 2, 3]]);
        file.text(rest).bytes
    };
    let cases = [
        ("POINT_DATA four\n", "line 9: \"four\" is no number of points"),
        ("POINT_DATA 4\nSPLINES a int\n1 2\n", "line 10: unexpected \"SPLINES\""),
        ("POINT_DATA 4\nSCALARS h real 1\n1 2 3 4\n", "\"real\" is no type of an array"),
        ("POINT_DATA 4\nSCALARS h double\n1 2 3 4,5\n", "\"4,5\" is no value of \"h\""),
        ("POINT_DATA 4\nSCALARS h double\n1 2\n", "should have 4 values, but there are only 2"),
        ("POINT_DATA 3\nSCALARS h double\n1 2 3\n", "the array \"h\" has 3 values for 4 points"),
        ("POINT_DATA 18446744073709551615\nSCALARS h int\n1\n", "values, but there are only"),
    ];
    for (rest, expected) in cases {
        let bytes = file(rest);
        let refused = sized(&bytes, "h").expect_err(rest);
        assert!(matches!(refused, ReadError::Vtk(_)), "{rest}: {refused:?}");
        let refused = refused.reason();
        assert!(refused.message.contains(expected) && refused.location.is_some(), "{rest}: {refused:?}");
        assert!(read(&bytes).is_ok(), "{rest}");
    }
    // What stands before the damage counts.
    let found = sized(&file("POINT_DATA 4\nSCALARS h double\n1 2 3 4\nSPLINES\n"), "h").expect("sizes");
    assert_eq!(found.soup.sizes(), [1.0, 2.0, 3.0, 4.0]);
    let none = sized(&file(""), "h").expect_err("no array").reason();
    assert!(none.code == Code::NoSizes && none.message.contains("has no arrays of points"), "{none:?}");
}

#[test]
fn mutated_files_do_no_harm() {
    let mut accepted = 0;
    for (version, binary) in WAYS {
        let file = square(version, binary);
        accepted += mutations(&file.bytes, 2_000).filter(|bytes| sized(bytes, "edge length").is_ok()).count();
    }
    assert!(accepted > 1_000, "{accepted}");
}
