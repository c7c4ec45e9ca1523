//! Labels of triangles, from the arrays of cells.

use super::*;
use crate::formats::LabelSource;
use crate::formats::mutate::mutations;

fn labelled(bytes: &[u8], source: &LabelSource) -> Result<Content, ReadError> {
    crate::formats::read(
        Format::Vtk,
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

fn message(result: Result<Content, ReadError>) -> String {
    result.expect_err("refused").reason().message
}

impl File {
    /// An array of numbers of a field.
    fn numbers<T: Copy + ToString, const N: usize>(
        self,
        name: &str,
        kind: &str,
        numbers: &[T],
        bytes: fn(T) -> [u8; N],
    ) -> Self {
        self.text(&format!("{name} 1 {} {kind}\n", numbers.len())).array(numbers, bytes)
    }

    /// Everything that VTK writes behind the geometry, of five points or cells or so.
    fn attributes(self, count: usize) -> Self {
        let binary = self.binary;
        let floats = |components: usize| vec![0.5; components * count];
        let colours = |file: Self, number: usize| match binary {
            true => file.array(&vec![255; number], |b: u8| [b]),
            false => file.array(&vec![1.0; number], f64::to_be_bytes),
        };
        let file = self.text("SCALARS temperature double 2\nLOOKUP_TABLE jet\n").doubles(&floats(2));
        let file = colours(file.text("LOOKUP_TABLE jet 3\n"), 12).text(METADATA);
        let file = colours(file.text("COLOR_SCALARS paint 3\n"), 3 * count);
        let file = file.text("VECTORS v double\n").doubles(&floats(3)).text("NORMALS n double\n").doubles(&floats(3));
        let file = file.text("TEXTURE_COORDINATES t 2 double\n").doubles(&floats(2));
        let file = file.text("TENSORS s double\n").doubles(&floats(9)).text("TENSORS6 s6 double\n").doubles(&floats(6));
        let ids: Vec<i32> = (0..count as i32).collect();
        let file = file.text("GLOBAL_IDS ids vtkIdType\n").ints(&ids).text("PEDIGREE_IDS pedigree string\n");
        let file = file.strings(&vec!["label"; count]).text("SCALARS plain int\n").ints(&ids);
        file.text("FIELD FieldData 2\nNULL_ARRAY\nother 2 1 int\n").ints(&[1, 2])
    }

    /// Numbers of cells in every type, and strings.
    fn parts(self, values: &[u8]) -> Self {
        let words: Vec<String> = values.iter().map(|value| format!("part {value}, 5%")).collect();
        let encoded =
            |word: &String| if self.binary { word.clone() } else { word.replace('%', "%25").replace(' ', "%20") };
        let words: Vec<String> = words.iter().map(encoded).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let bits: Vec<u8> = match self.binary {
            true => {
                values.chunks(8).map(|eight| eight.iter().zip(0..).map(|(v, i)| (v % 2) << (7 - i)).sum()).collect()
            }
            false => values.iter().map(|value| value % 2).collect(),
        };
        self.text(&format!("CELL_DATA {}\n", values.len()))
            .attributes(values.len())
            .text("FIELD FieldData 12\n")
            .numbers("char", "char", &cast::<i8>(values), i8::to_be_bytes)
            .numbers("uchar", "unsigned_char", values, u8::to_be_bytes)
            .numbers("short", "short", &cast::<i16>(values), i16::to_be_bytes)
            .numbers("ushort", "unsigned_short", &cast::<u16>(values), u16::to_be_bytes)
            .numbers("int", "int", &cast::<i32>(values), i32::to_be_bytes)
            .numbers("uint", "unsigned_int", &cast::<u32>(values), u32::to_be_bytes)
            .numbers("long", "vtktypeint64", &cast::<i64>(values), i64::to_be_bytes)
            .numbers("ulong", "vtktypeuint64", &cast::<u64>(values), u64::to_be_bytes)
            .text(METADATA)
            .numbers("float", "float", &cast::<f32>(values), f32::to_be_bytes)
            .text(&format!("the%20parts 1 {} string\n", values.len()))
            .strings(&words)
            .text(&format!("bit 1 {} bit\n", values.len()))
            .array(&bits, |b| [b])
            .numbers("Region", "int", &cast::<i32>(values), i32::to_be_bytes)
    }
}

fn cast<T: TryFrom<u8>>(values: &[u8]) -> Vec<T> {
    values.iter().map(|value| T::try_from(*value).ok().expect("small")).collect()
}

/// The arrays of [`File::parts`], and what a value becomes in each.
type Named = fn(u8) -> String;
const ARRAYS: [(&str, Named); 12] = [
    ("char", |v| format!("char_{v}")),
    ("uchar", |v| format!("uchar_{v}")),
    ("short", |v| format!("short_{v}")),
    ("ushort", |v| format!("ushort_{v}")),
    ("int", |v| format!("int_{v}")),
    ("uint", |v| format!("uint_{v}")),
    ("long", |v| format!("long_{v}")),
    ("ulong", |v| format!("ulong_{v}")),
    ("float", |v| format!("float_{v}")),
    ("the parts", |v| format!("part {v}, 5%")),
    ("bit", |v| format!("bit_{}", v % 2)),
    ("Region", |v| format!("Region_{v}")),
];

/// Polygons and strips, the sections in another order than that in which their cells are counted: vertices 90 and 91, a
/// line 92, polygons 1 and 2, a strip 3.
fn labelled_polydata(version: &str, binary: bool) -> File {
    let five = five(version);
    File::new(version, binary, "POLYDATA")
        .square()
        .cells("TRIANGLE_STRIPS", five, &[&[0, 1, 3, 2]])
        .cells("LINES", five, &[&[0, 1, 2]])
        .cells("POLYGONS", five, &[&[0, 1, 2], &[0, 1, 2, 3]])
        .cells("VERTICES", five, &[&[0], &[1]])
        .text("POINT_DATA 4\n")
        .attributes(4)
        .text("FIELD FieldData 1\n")
        .numbers("label", "int", &[9, 9, 9, 9], i32::to_be_bytes)
        .parts(&[90, 91, 92, 1, 2, 3])
}

/// A grid of a quadratic triangle 1, a line 90, a quad 2, a pixel 3 and a triangle 1.
fn labelled_grid(version: &str, binary: bool) -> File {
    let mut file = File::new(version, binary, "UNSTRUCTURED_GRID");
    file.bytes = grid(version, binary);
    file.parts(&[1, 90, 2, 3, 1])
}

#[test]
fn arrays_of_cells_label_triangles_in_every_layout() {
    for (version, binary) in WAYS {
        let files = [
            (labelled_polydata(version, binary).bytes, vec![3, 3, 1, 2, 2]),
            (labelled_grid(version, binary).bytes, vec![1, 2, 2, 3, 3, 1]),
        ];
        for (bytes, values) in files {
            for (array, name) in ARRAYS {
                let found =
                    labelled(&bytes, &asked(array)).unwrap_or_else(|e| panic!("{version} {binary} {array}: {e}"));
                let expected: Vec<String> = values.iter().map(|value| name(*value)).collect();
                assert_eq!(names(&found), expected, "{version} {binary} {array}");
            }
            let usual = labelled(&bytes, &LabelSource::Usual).expect("labels");
            assert_eq!(labelled(&bytes, &asked("Region")), Ok(usual.clone()));
            let ignored = labelled(&bytes, &LabelSource::Ignored).expect("a surface").soup;
            assert!(ignored.labels().is_empty() && ignored.triangles() == usual.soup.triangles());
            for array in ["v", "other", "temperature", "paint", "label"] {
                let missing = message(labelled(&bytes, &asked(array)));
                assert!(missing.contains("plain, char, uchar") && !missing.contains("float,"), "{missing}");
            }
        }
    }
}

#[test]
fn measured_values_are_labels_if_they_are_asked_for_and_whole() {
    for binary in [false, true] {
        let with = |values: &[f64]| {
            let file = File::new("3.0", binary, "POLYDATA").square().cells("VERTICES", false, &[&[0]]);
            let file = file.cells("POLYGONS", false, &[&[0, 1, 2, 3], &[0, 1, 2]]);
            file.text("CELL_DATA 3\nSCALARS label double 1\nLOOKUP_TABLE default\n").doubles(values).bytes
        };
        let whole = with(&[0.5, 7.0, -2.0]);
        assert_eq!(names(&labelled(&whole, &asked("label")).expect("whole")), ["label_7", "label_7", "label_-2"]);
        assert!(labelled(&whole, &LabelSource::Usual).expect("read").soup.labels().is_empty());
        let refused = labelled(&with(&[1.0, 7.0, 2.25]), &asked("label")).expect_err("no whole number").reason();
        assert_eq!(refused.code, Code::NoLabels);
        assert!(refused.message.contains("label holds 2.25 for triangle 2"), "{refused:?}");
    }
}

/// As long as its geometry is whole, a file is read, whatever is missing behind; what is asked for is refused unless it is
/// whole.
#[test]
fn arrays_that_are_cut_off_change_no_triangle() {
    for (version, binary) in WAYS {
        for file in [labelled_polydata(version, binary), labelled_grid(version, binary)] {
            let whole = file.bytes;
            let full = labelled(&whole, &LabelSource::Usual).expect("whole");
            let place = whole.windows(10).rposition(|word| word == b"CELL_DATA ").expect("it is there");
            for end in place..whole.len() {
                let cut = labelled(&whole[..end], &LabelSource::Usual).expect("a surface");
                assert_eq!((cut.soup.triangles(), cut.soup.points()), (full.soup.triangles(), full.soup.points()));
                // A digit less is another number.
                let is_same = cut.notes.labels == full.notes.labels || !binary && end + 2 >= whole.len();
                assert!(is_same || cut.soup.labels().is_empty() || end + 4 > whole.len(), "{version} {binary} {end}");
                match labelled(&whole[..end], &asked("the parts")) {
                    Ok(content) => assert_eq!(names(&content).len(), full.soup.triangles().len()),
                    Err(ReadError::Vtk(_) | ReadError::Label(_)) => {}
                    Err(other) => panic!("{version} {binary} {end}: {other}"),
                }
            }
        }
    }
}

#[test]
fn damaged_arrays_are_told_and_refused_only_where_they_are_asked_for() {
    let file = |rest: &str| {
        let file = File::new("3.0", false, "POLYDATA").square().cells("POLYGONS", false, &[&[0, 1, 2], &[0, 2, 3]]);
        file.text(rest).bytes
    };
    let cases = [
        ("CELL_DATA two\n", "line 9: \"two\" is no number of cells"),
        ("CELL_DATA 2\nSPLINES a int\n1 2\n", "line 10: unexpected \"SPLINES\""),
        ("CELL_DATA 2\nSCALARS label int x\n1 2\n", "\"x\" is no number of components"),
        ("CELL_DATA 2\nSCALARS label integer 1\n1 2\n", "\"integer\" is no type of an array"),
        ("CELL_DATA 2\nSCALARS label string\na\nb\n", "SCALARS are no numbers"),
        ("CELL_DATA 3\nSCALARS label int\n1 2 3\n", "the array \"label\" has 3 values for 2 cells"),
        ("CELL_DATA 2\nSCALARS label int\n1 2.5\n", "\"2.5\" is no value of \"label\""),
        ("CELL_DATA 2\nSCALARS label int\n1\n", "should have 2 values"),
        ("CELL_DATA 2\nFIELD f 1\nlabel 1 2 string\na", "the file ends before"),
        ("CELL_DATA 18446744073709551615\nSCALARS label int 18446744073709551615\n1\n", "values, but there are only"),
        ("CELL_DATA 2\nFIELD f 18446744073709551615\nlabel 1 18446744073709551615 string\na", "the file ends before"),
    ];
    for (rest, expected) in cases {
        let bytes = file(rest);
        let usual = labelled(&bytes, &LabelSource::Usual).unwrap_or_else(|e| panic!("{rest}: {e}"));
        assert_eq!((usual.soup.triangles().len(), usual.soup.labels().len()), (2, 0), "{rest}");
        let [remark] = &usual.notes.remarks[..] else { panic!("{rest}: {:?}", usual.notes.remarks) };
        assert!(remark.contains(expected), "{rest}: {remark}");
        let refused = labelled(&bytes, &asked("label"));
        assert!(matches!(refused, Err(ReadError::Vtk(_))) && message(refused).contains(expected), "{rest}");
        let ignored = labelled(&bytes, &LabelSource::Ignored).expect(rest);
        assert!(ignored.notes.remarks.is_empty() && ignored.soup == usual.soup, "{rest}");
    }
    // What stands before the damage counts.
    let bytes = file("CELL_DATA 2\nSCALARS label int\n1 2\nSPLINES\n");
    let usual = labelled(&bytes, &LabelSource::Usual).expect("read");
    assert_eq!((names(&usual), usual.notes.remarks.len()), (vec!["label_1", "label_2"], 1));
    assert_eq!(labelled(&bytes, &asked("label")).expect("whole").soup, usual.soup);
}

#[test]
fn mutated_files_do_no_harm() {
    let mut accepted = 0;
    for (version, binary) in WAYS {
        for file in [labelled_polydata(version, binary), labelled_grid(version, binary)] {
            for bytes in mutations(&file.bytes, 2_000) {
                accepted += usize::from(labelled(&bytes, &LabelSource::Usual).is_ok());
                accepted += usize::from(labelled(&bytes, &asked("the parts")).is_ok());
            }
        }
    }
    assert!(accepted > 10_000, "{accepted}");
}
