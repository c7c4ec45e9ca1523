use super::*;
use crate::formats::{Format, Limits, read_alone};
use crate::outcome::Code;

/// A file as it is written: text, and arrays as text or binary.
struct File {
    bytes: Vec<u8>,
    binary: bool,
}

impl File {
    fn new(version: &str, binary: bool, dataset: &str) -> Self {
        let encoding = if binary { "BINARY" } else { "ASCII" };
        let head =
            format!("# vtk DataFile Version {version}\na title: POINTS 5 float\n{encoding}\nDATASET {dataset}\n");
        Self { bytes: head.into_bytes(), binary }
    }

    fn text(mut self, text: &str) -> Self {
        self.bytes.extend(text.as_bytes());
        self
    }

    fn array<T: Copy + ToString, const N: usize>(mut self, numbers: &[T], bytes: fn(T) -> [u8; N]) -> Self {
        for number in numbers {
            if self.binary {
                self.bytes.extend(bytes(*number));
            } else {
                self.bytes.extend(format!("{} ", number.to_string()).into_bytes());
            }
        }
        self.text("\n")
    }

    fn doubles(self, numbers: &[f64]) -> Self {
        self.array(numbers, f64::to_be_bytes)
    }

    fn ints(self, numbers: &[i32]) -> Self {
        self.array(numbers, i32::to_be_bytes)
    }

    fn longs(self, numbers: &[i64]) -> Self {
        self.array(numbers, i64::to_be_bytes)
    }

    /// Strings: after their lengths, or on lines of their own.
    fn strings(mut self, strings: &[&str]) -> Self {
        for string in strings {
            if self.binary {
                self.bytes.push(0xc0 | string.len() as u8);
            }
            let end = if self.binary { "" } else { "\n" };
            self = self.text(string).text(end);
        }
        self.text("\n")
    }

    /// Cells in the layout of the version.
    fn cells(self, keyword: &str, five: bool, cells: &[&[i32]]) -> Self {
        let corners = cells.concat();
        if five {
            let mut offsets = vec![0_i64];
            cells.iter().for_each(|c| offsets.push(offsets[offsets.len() - 1] + c.len() as i64));
            let connectivity: Vec<i64> = corners.iter().map(|c| i64::from(*c)).collect();
            let head = format!("{keyword} {} {}\nOFFSETS vtktypeint64\n", offsets.len(), corners.len());
            return self.text(&head).longs(&offsets).text("CONNECTIVITY vtktypeint64\n").longs(&connectivity);
        }
        let list: Vec<i32> = cells.iter().flat_map(|c| [&[c.len() as i32], *c].concat()).collect();
        self.text(&format!("{keyword} {} {}\n", cells.len(), list.len())).ints(&list)
    }

    fn square(self) -> Self {
        self.text("POINTS 4 double\n").doubles(&[0.0, 0.0, 0.25, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.5])
    }
}

/// Every way to write a data set: version and whether binary.
const WAYS: [(&str, bool); 6] =
    [("2.0", false), ("3.0", true), ("4.2", false), ("4.2", true), ("5.1", false), ("5.1", true)];

const METADATA: &str = "METADATA\nINFORMATION 1\nNAME L2_NORM_RANGE LOCATION vtkDataArray\nDATA 2 0.5 0.5 \n\n";

fn five(version: &str) -> bool {
    version == "5.1"
}

fn polydata(version: &str, binary: bool) -> Vec<u8> {
    let five = five(version);
    File::new(version, binary, "POLYDATA")
        .text("FIELD FieldData 3\nTIME 1 1 double\n")
        .doubles(&[0.5])
        .text("Flags 1 9 bit\n")
        .array(&if binary { vec![0; 2] } else { vec![0; 9] }, |b: u8| [b])
        .text("Names 1 2 string\n")
        .strings(&["POINTS 1", "X"])
        .text(METADATA)
        .square()
        .text(METADATA)
        .cells("VERTICES", five, &[&[0], &[1]])
        .cells("LINES", five, &[&[0, 1, 2]])
        .cells("POLYGONS", five, &[&[0, 1, 2], &[0, 1, 2, 3]])
        .text(METADATA)
        .cells("TRIANGLE_STRIPS", five, &[&[0, 1, 3, 2]])
        .text("POINT_DATA 4\nSCALARS anything float\n")
        .bytes
}

fn grid(version: &str, binary: bool) -> Vec<u8> {
    let five = five(version);
    File::new(version, binary, "UNSTRUCTURED_GRID")
        .square()
        .cells("CELLS", five, &[&[0, 1, 2, 3, 3, 3], &[0, 1], &[0, 1, 2, 3], &[0, 1, 3, 2], &[0, 1, 2]])
        .text("CELL_TYPES 5\n")
        .ints(&[22, 3, 9, 8, 5])
        .bytes
}

fn read(bytes: &[u8]) -> Result<Content, ReadError> {
    read_alone(Format::Vtk, bytes)
}

fn error(bytes: &[u8]) -> VtkError {
    match read(bytes) {
        Err(ReadError::Vtk(e)) => e,
        other => panic!("{other:?}"),
    }
}

#[test]
fn polygons_and_strips_are_read_in_every_layout() {
    for (version, binary) in WAYS {
        let content = read(&polydata(version, binary)).unwrap_or_else(|e| panic!("{version} {binary}: {e}"));
        let (soup, notes) = (content.soup, content.notes);
        assert_eq!(soup.points()[3], [0.0, 1.0, 0.5]);
        assert_eq!((soup.triangles()[0], soup.triangles().len()), ([0, 1, 2], 5), "{version}");
        assert_eq!(soup.triangles()[3..], [[0, 1, 3], [1, 2, 3]]);
        assert_eq!((notes.polygons, notes.skipped["vertices"], notes.skipped["lines"]), (1, 2, 1));
        assert_eq!(notes.format, format!("VTK legacy {version}, {}", if binary { "binary" } else { "ASCII" }));
    }
}

#[test]
fn cells_of_a_grid_are_read_in_every_layout() {
    for (version, binary) in WAYS {
        let content = read(&grid(version, binary)).unwrap_or_else(|e| panic!("{version} {binary}: {e}"));
        assert_eq!(content.soup.triangles().len(), 6, "{version}");
        let notes = content.notes;
        assert_eq!((notes.polygons, notes.mid_nodes, notes.skipped["VTK_LINE"]), (2, 1, 1));
    }
}

#[test]
fn points_of_every_type_and_words_in_any_case_are_read() {
    type Write = fn(File) -> File;
    let types: [(&str, Write); 6] = [
        ("float", |f| f.array(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0], f32::to_be_bytes)),
        ("unsigned_char", |f| f.array(&[0, 0, 0, 1, 0, 0, 0, 1, 0], u8::to_be_bytes)),
        ("short", |f| f.array(&[0, 0, 0, 1, 0, 0, 0, 1, 0], i16::to_be_bytes)),
        ("int", |f| f.array(&[0, 0, 0, 1, 0, 0, 0, 1, 0], i32::to_be_bytes)),
        ("vtktypeint64", |f| f.array(&[0, 0, 0, 1, 0, 0, 0, 1, 0], i64::to_be_bytes)),
        ("Unsigned_Long", |f| f.array(&[0, 0, 0, 1, 0, 0, 0, 1, 0], u64::to_be_bytes)),
    ];
    for (name, write) in types {
        for binary in [false, true] {
            let file = write(File::new("3.0", binary, "polydata").text(&format!("points 3 {name}\r\n")));
            let soup = read(&file.cells("Polygons", false, &[&[0, 1, 2]]).bytes).expect(name).soup;
            assert_eq!(soup.points()[1], [1.0, 0.0, 0.0], "{name} {binary}");
        }
    }
}

#[test]
fn a_file_that_is_cut_off_gives_an_error_or_the_same_surface() {
    for (version, binary) in WAYS {
        for (whole, sections) in [(polydata(version, binary), 2), (grid(version, binary), 1)] {
            let full = read(&whole).expect("whole").soup;
            let mut seen = 0;
            for end in 0..whole.len() {
                if let Ok(content) = read(&whole[..end]) {
                    let triangles = content.soup.triangles();
                    // Without its last section, a file looks like one that never had it.
                    let without_strips = sections == 2 && triangles == &full.triangles()[..3];
                    assert!(triangles == full.triangles() || without_strips, "{version} {binary}, cut at {end}");
                    seen += 1;
                }
            }
            assert!(seen < 120, "{version} {binary}: {seen} cuts pass");
        }
    }
}

#[test]
fn wrong_words_and_counts_are_named_with_their_place() {
    let ascii = |rest: &str| error(&File::new("3.0", false, "POLYDATA").text(rest).bytes).to_string();
    let cases = [
        ("POINTS x float\n", "line 5: \"x\" is no number of points"),
        ("POINTS 1 floating\n", "line 5: \"floating\" is no type of coordinates"),
        ("POINTS 1 string\n", "coordinates are no numbers"),
        ("POINTS 2 float\n0 0 0\n0 0 \n", "line 8: POINTS should have 6 values, but there are only 5"),
        ("POINTS 2 float\n0 0 0\n0 0 a", "line 7: \"a\" is no coordinate of POINTS"),
        ("POINTS 2 float\n0 0 0\n0 0 0,5", "\"0,5\" is no coordinate of POINTS, it has a decimal comma"),
        ("POINTS 2 float\n0 0 0\n0 0 1D3", "\"1D3\" is no coordinate of POINTS, it has a Fortran exponent"),
        ("POLYGONS 1 4\n3 0 1 2\n", "unexpected \"POLYGONS\""),
        ("POINTS 1 float\n0 0 0\nPOINTS 1 float\n0 0 0\n", "line 7: unexpected \"POINTS\""),
        ("POINTS 1 float\n0 0 0\nPOLYGONS 1 4\n3 0 0 -1\n", "line 8: \"-1\" is no whole number"),
        ("POINTS 1 float\n0 0 0\nPOLYGONS 2 4\n3 0 0 0\n", "line 7: POLYGONS: 4 numbers are not those of 2 cells"),
        ("POINTS 1 float\n0 0 0\nPOLYGONS 1 4\n3 0 0 1\n", "cell 0 of POLYGONS uses point 1"),
        ("POINTS 1 float\n0 0 0\nPOLYGONS 2 3\nOFFSETS int\n0 2\nCONNECTIVITY int\n0 0 0\n", "lead from 0 to 3"),
        ("POINTS 1 float\n0 0 0\nPOLYGONS 2 3\nOFFSETS int\n0 3\nPOLYGONS\n", "unexpected \"POLYGONS\""),
        ("FIELD data 1\nx 1 1\n", "the file ends before the type of an array of FIELD"),
    ];
    for (rest, expected) in cases {
        assert!(ascii(rest).contains(expected), "{rest}\n{}", ascii(rest));
    }
    let encoding = error(b"# vtk DataFile Version 3.0\ntitle\nUTF8\nDATASET POLYDATA\n");
    assert!(encoding.to_string().contains("\"UTF8\" stands where ASCII or BINARY"), "{encoding}");
    let negative = File::new("3.0", true, "POLYDATA").square().cells("POLYGONS", false, &[&[0, 1, -7]]);
    assert!(error(&negative.bytes).to_string().contains("the number -7, which is no id"));
    let types = File::new("3.0", true, "UNSTRUCTURED_GRID").square().cells("CELLS", true, &[&[0, 1, 2]]);
    let types = error(&types.text("CELL_TYPES 2\n").ints(&[5, 5]).bytes);
    assert!(matches!(types, VtkError::Count { declared: 1, there: 2, .. }), "{types}");
}

#[test]
fn grids_without_a_surface_are_refused_with_a_remedy() {
    for dataset in ["STRUCTURED_GRID", "STRUCTURED_POINTS", "RECTILINEAR_GRID"] {
        let refused = error(&File::new("3.0", false, dataset).text("DIMENSIONS 1 1 1\n").bytes);
        let reason = ReadError::from(refused).reason();
        assert_eq!((reason.code, reason.location.as_deref()), (Code::UnsupportedFormat, Some("line 4")));
        assert!(reason.message.contains(dataset) && reason.message.contains("Extract Surface"), "{reason:?}");
    }
    let volume = File::new("3.0", true, "UNSTRUCTURED_GRID").square().cells("CELLS", false, &[&[0, 1, 2, 3]]);
    let volume = read(&volume.text("CELL_TYPES 1\n").ints(&[10]).bytes).expect_err("a volume").reason();
    assert_eq!(volume.code, Code::NoTriangles);
    assert!(volume.message.contains("only 1 tetrahedron; their surface must be saved"), "{volume:?}");
}

#[test]
fn grids_without_cells_hold_no_triangle() {
    for rest in ["", "POINT_DATA 1\nSCALARS a int 1\n", "CELLS 0 0\nCELL_TYPES 0\n"] {
        let file = format!(
            "{} 3.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 1 float\n0 0 0\n{rest}",
            "# vtk DataFile Version"
        );
        let reason = read(file.as_bytes()).expect_err("no cells").reason();
        assert_eq!(reason.code, crate::outcome::Code::NoTriangles, "{}", reason.message);
    }
}

#[test]
fn counts_that_lie_take_no_memory() {
    for count in ["4000000000", "18446744073709551615", "6148914691236517206"] {
        let lies = [
            format!("POINTS {count} double\n0 0 0\n"),
            format!("FIELD data {count}\nx 1 1 int\n0\n"),
            format!("FIELD data 1\nx {count} {count} int\n0\n"),
            format!("FIELD data 1\nx {count} 1 string\n"),
            format!("POINTS 1 float\n000000000000\nPOLYGONS {count} 4\n"),
            format!("POINTS 1 float\n000000000000\nPOLYGONS 1 {count}\n"),
            format!("POINTS 1 float\n000000000000\nPOLYGONS {count} {count}\nOFFSETS vtktypeint64\n0\n"),
        ];
        for (binary, lie) in lies.iter().flat_map(|lie| [(false, lie), (true, lie)]) {
            error(&File::new("5.1", binary, "POLYDATA").text(lie).bytes);
        }
    }
    let bytes = polydata("4.2", true);
    let limits = Limits { elements: 3, ..Limits::default() };
    let few = crate::formats::read(Format::Vtk, &Source::alone(&bytes, &limits));
    let few = few.expect_err("four points").reason();
    assert_eq!(few.code, Code::TooLarge, "{few:?}");
}

#[test]
fn other_files_are_named() {
    let reason = read(b"solid part\n").expect_err("STL").reason();
    assert!(reason.message.contains("begins with \"solid part") && reason.code == Code::Malformed, "{reason:?}");
}

mod fields;
mod labels;
mod sizes;
