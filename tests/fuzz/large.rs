//! Files that are large in one way only: what takes time or memory faster than it grows shows here.

use super::{clock, read};
use planish::formats::{Format, Limits};
use serde_json::{Value, json};
use std::fmt::Write;

/// Repetitions, which make files of some megabytes.
const MANY: usize = 100_000;

/// CPU seconds for such a file at most. In proportion it takes a tenth of one; with the square of its size it takes minutes.
const SECONDS: f64 = 10.0;

/// Memory that may be taken for each byte of the file, and for each byte that it may become.
const PER_BYTE: u64 = 200;
const PER_UNPACKED: u64 = 4;

/// The text of each number from 0 on.
fn many(count: usize, mut each: impl FnMut(usize) -> String) -> String {
    (0..count).fold(String::new(), |mut all, i| {
        all.push_str(&each(i));
        all
    })
}

/// Points on a star, whose polygon is far from convex.
fn star(corners: usize) -> impl Iterator<Item = [f64; 3]> {
    (0..corners).map(move |i| {
        let (angle, r) = (i as f64 * std::f64::consts::TAU / corners as f64, [1.0, 0.999][i % 2]);
        [r * angle.cos(), r * angle.sin(), 0.0]
    })
}

fn stl() -> Vec<(&'static str, String)> {
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    vec![
        ("solids", many(MANY / 4, |i| format!("solid s{i}\n{facet}endsolid s{i}\n"))),
        ("blanks", format!("solid {}\n{facet}{}endsolid", " x".repeat(10 * MANY), "\n \t".repeat(10 * MANY))),
        ("no solid", format!("solid\n{}", "facet ".repeat(10 * MANY))),
    ]
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

fn obj() -> Vec<(&'static str, String)> {
    let points: String = star(MANY).fold(String::new(), |mut s, [x, y, z]| {
        let _ = writeln!(s, "v {x} {y} {z}");
        s
    });
    let all = many(MANY, |i| format!(" {}", i + 1));
    vec![
        ("a polygon", format!("{points}f{all}\n")),
        (
            "polygons",
            format!(
                "{points}{}",
                many(MANY / 50, |i| format!("f{}\n", many(100, |j| format!(" {}", 1 + (i * 50 + j) % MANY))))
            ),
        ),
        ("the same corner", format!("{SQUARE}f{}\n", " 1 2".repeat(5 * MANY))),
        ("groups", format!("{SQUARE}{}", many(MANY, |i| format!("g a{i}\nf 1 2 3\n")))),
        ("continued lines", format!("{SQUARE}f {}1\n", "1 2 3 \\\n".repeat(5 * MANY))),
        ("comments", format!("{SQUARE}{}f 1 2 3\n", "#\n\n".repeat(10 * MANY))),
        ("slashes", format!("{SQUARE}f 1{} 2 3\n", "/".repeat(20 * MANY))),
    ]
}

fn ply() -> Vec<(&'static str, String)> {
    let begin = "ply\nformat ascii 1.0\n";
    let list = "property list uint int vertex_indices\n";
    let vertex = "element vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
    let points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let file = |head: String, body: String| format!("{begin}{head}end_header\n{body}");
    vec![
        (
            "properties",
            file(
                format!(
                    "element a 1\n{}{vertex}element face 1\n{list}",
                    many(MANY, |i| format!("property char p{i}\n"))
                ),
                format!("{}\n{points}3 0 1 2\n", "1 ".repeat(MANY)),
            ),
        ),
        (
            "elements",
            file(
                format!(
                    "{}{vertex}element face 1\n{list}",
                    many(MANY, |i| format!("element e{i} 0\nproperty char a\n"))
                ),
                format!("{points}3 0 1 2\n"),
            ),
        ),
        (
            "nothing very often",
            file(format!("element a 1000000000000\n{vertex}element face 1\n{list}"), format!("{points}3 0 1 2\n")),
        ),
        (
            "a polygon",
            file(
                format!("{vertex}element face 1\n{list}"),
                format!("{points}{}{}\n", 8 * MANY, " 0 1 2 3".repeat(2 * MANY)),
            ),
        ),
        (
            "a strip",
            file(
                format!("{vertex}element tristrips 1\n{list}"),
                format!("{points}{}{}\n", 8 * MANY, " 0 1 2 -1".repeat(2 * MANY)),
            ),
        ),
        (
            "empty faces",
            file(format!("{vertex}element face {}\n{list}", 10 * MANY), format!("{points}{}", "0\n".repeat(10 * MANY))),
        ),
        (
            "comments",
            file(
                format!("{}{vertex}element face 1\n{list}", "comment a\n".repeat(5 * MANY)),
                format!("{points}3 0 1 2\n"),
            ),
        ),
    ]
}

/// A document of a square, and what is changed in it.
fn document(change: impl Fn(&mut Value)) -> String {
    let uri = "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAA";
    let mut document = json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": uri}]
    });
    change(&mut document);
    document.to_string()
}

/// So many copies of the first entry under a name.
fn repeated(document: &mut Value, place: &str, count: usize) {
    let entries = document.pointer_mut(place).and_then(Value::as_array_mut).expect("a list");
    let again = entries[0].clone();
    entries.resize(count, again);
}

fn gltf() -> Vec<(&'static str, String)> {
    let nodes = |each: fn(usize) -> Value| document(|d| d["nodes"] = (0..MANY).map(each).collect());
    vec![
        ("a chain", nodes(|i| json!({"mesh": 0, "children": [i + 1]}))),
        ("twins", nodes(|i| json!({"mesh": 0, "children": [i + 1, i + 1]}))),
        ("a ring", nodes(|i| json!({"mesh": 0, "children": [(i + 1) % 1000]}))),
        ("names", nodes(|i| json!({"mesh": 0, "name": format!("n{i}")}))),
        ("instances", document(|d| d["scenes"][0]["nodes"] = vec![0; 10 * MANY].into())),
        ("primitives", document(|d| repeated(d, "/meshes/0/primitives", MANY))),
        ("accessors", document(|d| repeated(d, "/accessors", MANY))),
        ("views", document(|d| repeated(d, "/bufferViews", MANY))),
        ("buffers", document(|d| repeated(d, "/buffers", MANY))),
        ("very many elements", document(|d| d["accessors"][0]["count"] = json!(u32::MAX))),
        (
            "elements of nothing",
            document(|d| {
                d["accessors"] = json!([{"componentType": 5126, "count": 200_000_000, "type": "VEC3"}]);
            }),
        ),
        ("nested", document(|d| d["asset"]["extras"] = json!("@")).replace("\"@\"", &"[".repeat(20 * MANY))),
    ]
}

const LEGACY: &str = "# vtk DataFile Version 4.2\nx\nASCII\nDATASET POLYDATA\n";

fn legacy_vtk() -> Vec<(&'static str, String)> {
    let begin = format!("{LEGACY}POINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n");
    let triangle = "POLYGONS 1 4\n3 0 1 2\n";
    vec![
        ("fields", format!("{begin}{triangle}FIELD a {MANY}\n{}", many(MANY, |i| format!("f{i} 1 0 int\n")))),
        ("blocks of fields", format!("{begin}{triangle}{}", "FIELD a 1\nb 1 1 int\n1\n".repeat(MANY))),
        ("metadata", format!("{begin}{triangle}{}", "METADATA\nINFORMATION 0\n\n".repeat(MANY))),
        ("a polygon", format!("{begin}POLYGONS 1 {}\n{}{}\n", 1 + 8 * MANY, 8 * MANY, " 0 1 2 3".repeat(2 * MANY))),
        (
            "a strip",
            format!("{begin}TRIANGLE_STRIPS 1 {}\n{}{}\n", 1 + 8 * MANY, 8 * MANY, " 0 1 2 3".repeat(2 * MANY)),
        ),
        ("sections", format!("{begin}{}", "LINES 1 3\n2 0 1\n".repeat(MANY))),
        ("nothing very often", format!("{begin}{triangle}FIELD a 1000000000000\n")),
    ]
}

fn xml(kind: &str, pieces: &str, rest: &str) -> String {
    format!("<VTKFile type=\"{kind}\" header_type=\"UInt64\"><{kind}>{pieces}</{kind}>{rest}</VTKFile>")
}

fn vtp() -> Vec<(&'static str, String)> {
    let points = "<Points><DataArray type=\"Float32\" NumberOfComponents=\"3\">0 0 0 1 0 0 0 1 0</DataArray></Points>";
    let cells = "<Polys><DataArray type=\"Int32\" Name=\"connectivity\">0 1 2</DataArray>\
                 <DataArray type=\"Int32\" Name=\"offsets\">3</DataArray></Polys>";
    let piece = |inside: &str| format!("<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\">{inside}</Piece>");
    let one = piece(&format!("{points}{cells}"));
    let shared = format!("{cells}<Points><DataArray type=\"Float32\" format=\"appended\" offset=\"0\"/></Points>");
    let data = format!("<AppendedData encoding=\"base64\">_{}</AppendedData>", "JAAAAAAAAAAA".repeat(5 * MANY));
    let file = |pieces: &str| xml("PolyData", pieces, "");
    vec![
        ("pieces", file(&one.repeat(MANY / 10))),
        ("empty pieces", file(&format!("{}{one}", "<Piece/>".repeat(5 * MANY)))),
        ("pieces of the same data", xml("PolyData", &piece(&shared).repeat(MANY / 10), &data)),
        ("arrays", file(&piece(&format!("<PointData>{}</PointData>{points}{cells}", "<DataArray/>".repeat(5 * MANY))))),
        ("attributes", file(&one.replace("<Points>", &format!("<Points {}>", many(MANY, |i| format!("a{i}=\"1\" ")))))),
        ("nested", file(&"<a>".repeat(10 * MANY))),
        ("comments", file(&format!("{}{one}", "<!-- -->".repeat(5 * MANY)))),
        ("entities", file(&format!("{}{one}", "&amp;".repeat(5 * MANY)))),
    ]
}

fn vtu() -> Vec<(&'static str, String)> {
    let numbers =
        |name: &str, numbers: &str| format!("<DataArray type=\"Int64\" Name=\"{name}\">{numbers}</DataArray>");
    let points = "<Points><DataArray type=\"Float32\">0 0 0 1 0 0 0 1 0</DataArray></Points>";
    let file = |count: usize, connectivity: &str, offsets: &str, types: &str| {
        let cells =
            [numbers("connectivity", connectivity), numbers("offsets", offsets), numbers("types", types)].concat();
        let begin = format!("<Piece NumberOfPoints=\"3\" NumberOfCells=\"{count}\">");
        xml("UnstructuredGrid", &format!("{begin}{points}<Cells>{cells}</Cells></Piece>"), "")
    };
    let [ends, corners] = [many(MANY, |i| format!("{} ", 3 * i + 3)), "0 1 2 ".repeat(2 * MANY)];
    vec![
        ("triangles", file(MANY, &corners, &ends, &"5 ".repeat(MANY))),
        ("empty cells", file(5 * MANY, "", &"0 ".repeat(5 * MANY), &"7 ".repeat(5 * MANY))),
        ("a polygon", file(1, &corners, &(6 * MANY).to_string(), "7")),
        ("a triangle of very high order", file(1, &corners, &(6 * MANY).to_string(), "69")),
        ("unknown cells", file(5 * MANY, "", &"0 ".repeat(5 * MANY), &"200 ".repeat(5 * MANY))),
    ]
}

fn msh() -> Vec<(&'static str, String)> {
    let begin = |version: &str| format!("$MeshFormat\n{version} 0 8\n$EndMeshFormat\n");
    let nodes = "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n";
    let elements = "$Elements\n1\n1 2 2 0 1 1 2 3\n$EndElements\n";
    let two = |inside: &str| format!("{}{inside}{nodes}{elements}", begin("2.2"));
    let sparse = many(MANY, |i| format!("{} {i} 0 0\n", (i as u64 + 1) << 30));
    vec![
        ("sections", two(&"$A\n$EndA\n".repeat(5 * MANY))),
        ("sections of many names", two(&many(MANY, |i| format!("$A{i}\n$EndA{i}\n")))),
        (
            "names",
            two(&format!("$PhysicalNames\n{MANY}\n{}$EndPhysicalNames\n", many(MANY, |i| format!("2 {i} \"n{i}\"\n")))),
        ),
        ("a section without end", two(&"$A\n".repeat(10 * MANY))),
        ("comments", two(&"nothing\n".repeat(5 * MANY))),
        ("sparse tags", format!("{}$Nodes\n{MANY}\n{sparse}$EndNodes\n{elements}", begin("2.2"))),
        (
            "tags of elements",
            format!(
                "{}{nodes}$Elements\n1\n1 2 {}{} 1 2 3\n$EndElements\n",
                begin("2.2"),
                5 * MANY,
                " 0".repeat(5 * MANY)
            ),
        ),
        (
            "empty blocks",
            format!(
                "{}$Nodes\n{MANY} 3 1 3\n{}2 1 0 3\n1\n2\n3\n0 0 0\n1 0 0\n0 1 0\n$EndNodes\n",
                begin("4.1"),
                "2 1 0 0\n".repeat(MANY - 1)
            ),
        ),
        ("very many blocks", format!("{}$Nodes\n1000000000000 3 1 3\n", begin("4.1"))),
    ]
}

fn off() -> Vec<(&'static str, String)> {
    let points = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
    let nan = "nan 0 0\n".repeat(5 * MANY);
    let star: String = star(MANY).map(|[x, y, z]| format!("{x} {y} {z}\n")).collect();
    vec![
        ("a polygon", format!("OFF {MANY} 1 0\n{star}{MANY}{}\n", many(MANY, |i| format!(" {i}")))),
        ("points that are none", format!("OFF {} 1 0\n{nan}3 0 1 2\n", 5 * MANY)),
        ("unused points that are none", format!("OFF {} 1 0\n{points}{nan}3 0 1 2\n", 5 * MANY + 4)),
        ("comments", format!("OFF\n{}4 1 0\n{points}3 0 1 2\n", "# a comment\n".repeat(5 * MANY))),
        ("a long line", format!("OFF 4 1 0\n{points}3 0 1 2{}\n", " 1".repeat(10 * MANY))),
        ("empty faces", format!("OFF 4 {} 0\n{points}{}", 5 * MANY, "0\n".repeat(5 * MANY))),
    ]
}

fn medit() -> Vec<(&'static str, String)> {
    let begin = "MeshVersionFormatted 2 Dimension 3 ";
    let points = "Vertices 3 0 0 0 1 1 0 0 1 0 1 0 1 ";
    let triangle = "Triangles 1 1 2 3 0 ";
    vec![
        ("sections", format!("{begin}{points}{}", triangle.repeat(MANY))),
        ("sections before their vertices", format!("{begin}{}{points}", triangle.repeat(MANY))),
        ("empty sections that wait", format!("{begin}{}{points}", "Triangles ".repeat(MANY))),
        ("keywords", format!("{begin}{points}{triangle}{}", "A ".repeat(10 * MANY))),
        ("quotes", format!("{begin}{points}{triangle}Identifier {}", "\"a b\" ".repeat(5 * MANY))),
        ("curved", format!("{begin}{points}TrianglesP2 {MANY} {}", "1 2 3 1 2 3 0 ".repeat(MANY))),
        ("volumes", format!("{begin}{points}Tetrahedra {MANY} {}", "1 2 3 1 0 ".repeat(MANY))),
    ]
}

/// Reads it, well or not; what is wrong with that.
fn problem(format: Format, text: &str) -> Option<String> {
    let began = clock();
    let mut result = Ok(());
    let memory = allocation_counter::measure(|| result = read(format, text.as_bytes())).bytes_max;
    let seconds = clock() - began;
    let may_grow = if matches!(format, Format::Gltf | Format::Vtu | Format::Vtp) { PER_UNPACKED } else { 0 };
    let most = PER_BYTE * text.len() as u64 + may_grow * Limits::default().unpacked(text.len());
    let told = match &result {
        Ok(()) => "read".to_owned(),
        Err(reason) => format!("{}: {}", reason.code.name(), reason.message.chars().take(100).collect::<String>()),
    };
    let figures = format!(
        "{} bytes, {seconds:.2} s, {:.0} bytes per byte; {told}",
        text.len(),
        memory as f64 / text.len() as f64
    );
    eprintln!("{format:?}: {figures}");
    (seconds > SECONDS || memory > most).then_some(figures)
}

#[test]
fn time_and_memory_grow_with_the_file_and_no_faster() {
    let formats = [
        (Format::Stl, stl()),
        (Format::Obj, obj()),
        (Format::Ply, ply()),
        (Format::Gltf, gltf()),
        (Format::Vtk, legacy_vtk()),
        (Format::Vtp, vtp()),
        (Format::Vtu, vtu()),
        (Format::Msh, msh()),
        (Format::Off, off()),
        (Format::Medit, medit()),
    ];
    let all = formats.into_iter().flat_map(|(format, files)| files.into_iter().map(move |file| (format, file)));
    let problems = all.filter_map(|(format, (name, text))| {
        eprint!("{name}: ");
        problem(format, &text).map(|p| format!("{format:?}, {name}: {p}"))
    });
    let problems: Vec<String> = problems.collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
