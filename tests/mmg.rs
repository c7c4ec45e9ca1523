//! The hand-off to Mmg, and what carries a mesh back: lift, project, transfer. The meshers themselves are in tests/interop/mmg.rs;
//! here the start meshes that planish writes are lifted as they are.

use crate::support::{Ended, Out, fixture, planish};
use planish::formats::fields::{Field, Values};
use planish::formats::{Content, Format, read_alone};
use planish::report::mesh::MeshReport;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A result with files for both meshers.
fn handed_over(name: &str) -> Out {
    let out = Out::new();
    let ended = out.run(&[&fixture(name)], &["-q", "--hand-off", "gmsh,mmg"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    out
}

/// The start meshes of a result.
fn start_meshes(out: &Out, name: &str) -> Vec<PathBuf> {
    let charts = out.report(name).mmg.expect("a hand-off to Mmg").charts;
    (0..charts).map(|chart| out.of(name).join(format!("mmg/chart-{chart:03}.mesh"))).collect()
}

fn lift(out: &Out, name: &str, meshes: &[PathBuf], to: &str, extra: &[&str]) -> Ended {
    let (atlas, output) = (out.of(name), out.of(name).join(to));
    let mut args: Vec<&std::ffi::OsStr> = vec!["lift".as_ref()];
    args.extend(meshes.iter().map(|mesh| mesh.as_os_str()));
    args.extend(["--atlas".as_ref(), atlas.as_os_str(), "-o".as_ref(), output.as_os_str()]);
    args.extend(extra.iter().map(|a| std::ffi::OsStr::new(*a)));
    planish(args)
}

fn judged(out: &Out, name: &str, mesh: &str) -> MeshReport {
    let (folder, mesh) = (out.of(name), out.of(name).join(mesh));
    let mut args: Vec<&std::ffi::OsStr> =
        vec!["check".as_ref(), folder.as_os_str(), "--mesh".as_ref(), mesh.as_os_str()];
    args.extend(["--min-gamma", "0", "--json"].map(std::ffi::OsStr::new));
    let ended = planish(args);
    serde_json::from_str(&ended.out).unwrap_or_else(|e| panic!("{e}: {}{}", ended.out, ended.err))
}

/// How many triangles each edge has.
fn edges(content: &Content) -> BTreeMap<[u32; 2], usize> {
    let mut edges = BTreeMap::new();
    for [a, b, c] in content.soup.triangles() {
        for [p, q] in [[a, b], [b, c], [c, a]] {
            *edges.entry([*p.min(q), *p.max(q)]).or_default() += 1;
        }
    }
    edges
}

/// Charts are meshed by themselves, and fit together: closed where the surface is, faithful chart by chart.
#[test]
fn planes_are_lifted_and_joined() {
    for (name, is_closed) in
        [("sphere.stl", true), ("plate_genus9.stl", true), ("disk_with_holes.stl", false), ("moebius.obj", false)]
    {
        let out = handed_over(name);
        let meshes = start_meshes(&out, name);
        let report = out.report(name);
        assert_eq!(meshes.len(), report.charts.len());
        for to in ["lifted.msh", "lifted.vtu", "lifted.obj", "lifted.mesh"] {
            let ended = lift(&out, name, &meshes, to, &["-q"]);
            assert_eq!((ended.code, ended.out.as_str()), (Some(0), ""), "{name}: {}", ended.err);
        }
        let format = [
            ("lifted.msh", Format::Msh),
            ("lifted.vtu", Format::Vtu),
            ("lifted.obj", Format::Obj),
            ("lifted.mesh", Format::Medit),
        ];
        for (file, format) in format {
            let content = read_alone(format, &out.read(name, file)).expect("read");
            let open = edges(&content).values().filter(|count| **count != 2).count();
            assert_eq!(open == 0, is_closed, "{name} {file}: {open} edges");
        }
        let found = judged(&out, name, "lifted.msh");
        assert!(found.by_charts && found.mesh_to_surface.distance < 1e-12, "{name}: {found:?}");
        // A start mesh has needles beside the boundary, some of which a chart that bends turns over.
        assert!(found.faithful || name == "plate_genus9.stl", "{name}: {found:?}");
        // With nodes in the middle of sides, too.
        assert_eq!(lift(&out, name, &meshes, "curved.msh", &["-q", "--mesh-order", "2"]).code, Some(0));
        let curved = judged(&out, name, "curved.msh");
        assert_eq!(curved.curved_elements, curved.elements);
        assert!(curved.mesh_to_surface.distance < 1e-12 && curved.area_ratio > 0.9, "{name}: {curved:?}");
    }
}

/// The files for Mmg are proven like all others, and a result that has lost one is none.
#[test]
fn files_in_folders_belong_to_the_result() {
    let (name, out) = ("sphere.stl", handed_over("sphere.stl"));
    let check = || planish(["check".as_ref(), out.of(name).as_os_str()]);
    assert_eq!(check().code, Some(0), "{}", check().err);
    let again = out.run(&[&fixture(name)], &["--hand-off", "mmg,gmsh"]);
    assert!(again.code == Some(0) && again.out.contains("up to date"), "{}{}", again.out, again.err);
    // What a user puts there moves on into the next result.
    std::fs::write(out.of(name).join("mmg/mine.mesh"), "mine").expect("written");
    std::fs::remove_file(out.of(name).join("mmg/chart-001.sol")).expect("there");
    let lost = check();
    assert!(lost.code == Some(1) && lost.err.contains("mmg/chart-001.sol"), "{}{}", lost.out, lost.err);
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--hand-off", "gmsh,mmg"]).code, Some(0));
    assert_eq!(check().code, Some(0), "{}", check().err);
    assert_eq!(out.read(name, "mmg/mine.mesh"), b"mine");
    // A result without them keeps it, too.
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--hand-off", "gmsh"]).code, Some(0));
    assert!(!out.of(name).join("mmg/surface.mesh").exists());
    assert_eq!(out.read(name, "mmg/mine.mesh"), b"mine");
}

/// The vertices of a text of MEDIT, changed.
fn with_vertices(mesh: &Path, change: impl Fn(usize, [f64; 2]) -> [f64; 2]) -> String {
    let text = std::fs::read_to_string(mesh).expect("written");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let first = lines.iter().position(|line| line == "Vertices").expect("a section") + 2;
    let count: usize = lines[first - 1].parse().expect("a number");
    for number in 0..count {
        let words: Vec<&str> = lines[first + number].split_whitespace().collect();
        let [u, v] = change(number, [words[0], words[1]].map(|w| w.parse().expect("a number")));
        lines[first + number] = format!("{u:?} {v:?} {}", words[2]);
    }
    lines.join("\n")
}

/// Whatever does not fit together is refused, with the place, and nothing is written.
#[test]
fn what_does_not_fit_is_refused() {
    let (name, out) = ("sphere.stl", handed_over("sphere.stl"));
    let meshes = start_meshes(&out, name);
    let refused = |meshes: &[PathBuf], expected: &str| {
        let ended = lift(&out, name, meshes, "refused.msh", &[]);
        assert!(ended.code == Some(1) && ended.err.contains(expected), "{expected}: {}{}", ended.out, ended.err);
        assert!(!out.of(name).join("refused.msh").exists());
    };
    refused(&meshes[1..], "of the charts have no mesh, chart 0 is the first");
    refused(&[meshes[0].clone(), meshes[0].clone()], "chart 0 has two meshes");
    let changed = out.path().join("chart-000.mesh");
    let with = |text: String| {
        std::fs::write(&changed, text).expect("written");
        [std::slice::from_ref(&changed), &meshes[1..]].concat()
    };
    // A node of the boundary moved outwards.
    let moved = with(with_vertices(&meshes[0], |n, uv| if n == 3 { uv.map(|c| 1.05 * c) } else { uv }));
    refused(&moved, "1 nodes on the boundary of the mesh of chart 0 are not on that of the chart");
    // One inside moved far away.
    let last = std::fs::read_to_string(&meshes[0])
        .expect("there")
        .lines()
        .skip_while(|l| *l != "Vertices")
        .nth(1)
        .map(|n| n.parse::<usize>().expect("a number") - 1);
    let folded = with(with_vertices(&meshes[0], |n, uv| if Some(n) == last { [3.0, 3.0] } else { uv }));
    refused(&folded, "of the triangles of chart 0 are folded over in the plane");
    // The plane of another chart under this one's number.
    let renumbered = std::fs::read_to_string(&meshes[0]).expect("there").replace(" 1\n", " 9\n");
    refused(&with(renumbered), "there is no chart 8: the atlas has 2, from 0");
    // A seam that was parted in another way.
    let coarse = Out::new();
    assert_eq!(coarse.run(&[&fixture(name)], &["-q", "--hand-off", "mmg", "--size", "0.5"]).code, Some(0));
    let other = with(std::fs::read_to_string(coarse.of(name).join("mmg/chart-000.mesh")).expect("there"));
    refused(&other, "on seams have no counterpart in its neighbours");
    // Wrong usage.
    let usage = lift(&out, name, &meshes, "lifted.ply", &[]);
    assert!(usage.code == Some(2) && usage.err.contains("the name tells no format"), "{}", usage.err);
    let order = lift(&out, name, &meshes, "lifted.stl", &["--mesh-order", "2"]);
    assert!(order.code == Some(2) && order.err.contains("to .msh and .vtu only"), "{}", order.err);
}

#[test]
fn a_table_is_lifted_point_by_point() {
    let (name, out) = ("disk_with_holes.stl", handed_over("disk_with_holes.stl"));
    let content = read_alone(Format::Vtu, &out.read(name, "surface.vtu")).expect("read");
    let Values::Floats(uv) = &field(&content.fields.points, "uv").values else { panic!("floats") };
    let rows: String = uv.as_chunks().0.iter().map(|[u, v]: &[f64; 2]| format!("0,{u:?},{v:?}\n")).collect();
    let table = out.path().join("points.csv");
    std::fs::write(&table, format!("chart,u,v\n{rows}0,5.0,5.0\n")).expect("written");
    let ended = lift(&out, name, std::slice::from_ref(&table), "points.csv", &[]);
    assert!(ended.code == Some(0) && ended.out.contains("points"), "{}", ended.err);
    let lifted = String::from_utf8(out.read(name, "points.csv")).expect("text");
    let lines: Vec<&str> = lifted.lines().skip(1).collect();
    for (line, expected) in lines.iter().zip(content.soup.points()) {
        let numbers: Vec<f64> = line.split(',').map(|n| n.parse().expect("a number")).collect();
        assert!(
            (0..3).all(|k| (numbers[k] - expected[k]).abs() < 1e-9) && numbers[4] < 1e-9,
            "{line} for {expected:?}"
        );
    }
    let outside: Vec<f64> = lines[lines.len() - 1].split(',').map(|n| n.parse().expect("a number")).collect();
    assert!(outside[4] > 4.0, "it tells how far off it is: {outside:?}");
    std::fs::write(&table, "chart,u,v\n0,0.0\n").expect("written");
    let broken = lift(&out, name, std::slice::from_ref(&table), "points.csv", &[]);
    assert!(broken.code == Some(1) && broken.err.contains("line 2: not three cells"), "{}", broken.err);
    std::fs::write(&table, "7,0.0,0.0\n").expect("written");
    let broken = lift(&out, name, std::slice::from_ref(&table), "points.csv", &[]);
    assert!(broken.code == Some(1) && broken.err.contains("there is no chart 7"), "{}", broken.err);
}

fn field<'f>(fields: &'f [Field], name: &str) -> &'f Field {
    let is_it = |field: &&Field| field.name == name || field.input_name.as_deref() == Some(name);
    fields.iter().find(is_it).unwrap_or_else(|| panic!("no {name}"))
}

fn numbers(field: &Field) -> Vec<f64> {
    (0..field.values.len()).map(|at| field.number(at)).collect()
}

/// A bumpy square with fields, as a legacy file.
fn bumpy_square() -> String {
    let side = 14;
    let at = |i: usize, j: usize| {
        let [x, y] = [i, j].map(|n| n as f64 / side as f64);
        [x, y, 0.1 * (7.0 * x).sin() * (5.0 * y).cos()]
    };
    let points: Vec<[f64; 3]> = (0..=side).flat_map(|j| (0..=side).map(move |i| at(i, j))).collect();
    let corner = |i: usize, j: usize| j * (side + 1) + i;
    let mut triangles = Vec::new();
    for (i, j) in (0..side).flat_map(|j| (0..side).map(move |i| (i, j))) {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let words = |numbers: Vec<f64>| numbers.iter().map(|n| format!("{n:?}\n")).collect::<String>();
    let (n, m) = (points.len(), triangles.len());
    let cells: String = triangles.iter().map(|[a, b, c]| format!("3 {a} {b} {c}\n")).collect();
    [
        format!("# vtk DataFile Version 3.0\nbumps\nASCII\nDATASET POLYDATA\nPOINTS {n} double\n"),
        words(points.concat()),
        format!("POLYGONS {m} {}\n{cells}CELL_DATA {m}\nSCALARS density double\nLOOKUP_TABLE default\n", 4 * m),
        words((0..m).map(|t| 1.0 + (t * 7 % 11) as f64).collect()),
        "SCALARS charge double\nLOOKUP_TABLE default\n".to_owned(),
        words((0..m).map(|t| (t * 5 % 13) as f64).collect()),
        "SCALARS kind int\nLOOKUP_TABLE default\n".to_owned(),
        (0..m).map(|t| format!("{}\n", 3 + t % 2)).collect(),
        format!("POINT_DATA {n}\nSCALARS linear double\nLOOKUP_TABLE default\n"),
        words(points.iter().map(|[x, y, z]| x + 2.0 * y - 3.0 * z).collect()),
    ]
    .concat()
}

fn area(content: &Content) -> Vec<f64> {
    let points = content.soup.points();
    let of = |t: &[u32; 3]| planish_core::vec3::triangle_area(t.map(|n| points[n as usize]));
    content.soup.triangles().iter().map(of).collect()
}

/// Point fields are those of the surface where nodes are, and sums over cells are kept, whatever the mesh.
#[test]
fn fields_go_to_a_new_mesh() {
    let (name, out, text) = ("bumps.vtk", Out::new(), bumpy_square());
    let extra = ["-q", "--hand-off", "gmsh,mmg", "--size", "0.11"];
    assert_eq!(out.run_bytes_with(name, text.as_bytes(), &extra).0.code, Some(0));
    let input = read_alone(Format::Vtk, text.as_bytes()).expect("read");
    let of_input = |name: &str| numbers(field(&input.fields.cells, name));
    let mass: f64 = of_input("density").iter().zip(area(&input)).map(|(d, a)| d * a).sum();
    let charge: f64 = of_input("charge").iter().sum();
    assert_eq!(lift(&out, name, &start_meshes(&out, name), "new.msh", &["-q", "--mesh-order", "2"]).code, Some(0));
    let atlas = out.of(name);
    // A mesh that does not know the surface: coarser, its nodes off it.
    let coarse = "v 0 0 0\nv 1 0 0\nv 1 1 0.02\nv 0 1 0\nv 0.5 0.5 0\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
    std::fs::write(atlas.join("coarse.obj"), coarse).expect("written");
    for (mesh, to, is_exact) in
        [("new.msh", "fields.vtu", true), ("new.msh", "fields.msh", true), ("coarse.obj", "fields.vtu", false)]
    {
        let (mesh, output) = (atlas.join(mesh), atlas.join(to));
        let ended = planish([
            "transfer".as_ref(),
            "--atlas".as_ref(),
            atlas.as_os_str(),
            mesh.as_os_str(),
            "-o".as_ref(),
            output.as_os_str(),
            "--extensive".as_ref(),
            "charge".as_ref(),
        ]);
        assert!(
            ended.code == Some(0) && ended.out.contains("1 fields of points, 3 of cells"),
            "{}{}",
            ended.out,
            ended.err
        );
        let format = if to.ends_with("msh") { Format::Msh } else { Format::Vtu };
        let made = read_alone(format, &out.read(name, to)).expect("read");
        let of_cells = |name: &str| numbers(field(&made.fields.cells, name));
        let densities = of_cells("density");
        let found: f64 = densities.iter().zip(of_cells("source_area")).map(|(d, a)| d * a).sum();
        assert!((found / mass - 1.0).abs() < 1e-12, "{to}: {found} for {mass}");
        let found: f64 = of_cells("charge").iter().sum();
        assert!((found / charge - 1.0).abs() < 1e-12, "{to}: {found} for {charge}");
        assert!(densities.iter().all(|d| (1.0..=11.0).contains(d)), "means are no larger than what they are of");
        assert!(of_cells("kind").iter().all(|kind| [3.0, 4.0].contains(kind)), "names are not mixed");
        if is_exact {
            let linear = numbers(field(&made.fields.points, "linear"));
            for ([x, y, z], value) in made.soup.points().iter().zip(linear) {
                assert!((value - (x + 2.0 * y - 3.0 * z)).abs() < 1e-12, "{value} at {x} {y} {z}");
            }
        }
    }
    let unknown = planish([
        "transfer".as_ref(),
        "--atlas".as_ref(),
        atlas.as_os_str(),
        atlas.join("coarse.obj").as_os_str(),
        "-o".as_ref(),
        atlas.join("x.vtu").as_os_str(),
        "--extensive".as_ref(),
        "colour".as_ref(),
    ]);
    assert!(
        unknown.code == Some(1) && unknown.err.contains("no field of cells called colour: density, charge, kind"),
        "{}",
        unknown.err
    );
}

/// A mesh in space is brought to the surface, with nodes in the middle of sides on it.
#[test]
fn a_mesh_in_space_is_projected() {
    let (name, out) = ("sphere.stl", handed_over("sphere.stl"));
    let input = read_alone(Format::Stl, &std::fs::read(fixture(name)).expect("there")).expect("read");
    // Nodes a thousandth off.
    let points: String = input
        .soup
        .points()
        .iter()
        .map(|p| {
            let [x, y, z] = p.map(|c| 1.001 * c);
            format!("v {x:?} {y:?} {z:?}\n")
        })
        .collect();
    let faces: String = input
        .soup
        .triangles()
        .iter()
        .map(|t| {
            let [a, b, c] = t.map(|n| n + 1);
            format!("f {a} {b} {c}\n")
        })
        .collect();
    let mesh = out.path().join("off.obj");
    std::fs::write(&mesh, points + &faces).expect("written");
    let ended = lift(&out, name, std::slice::from_ref(&mesh), "on.msh", &["--project", "--mesh-order", "2"]);
    assert!(ended.code == Some(0) && ended.out.contains("nodes were off the surface by"), "{}{}", ended.out, ended.err);
    let found = judged(&out, name, "on.msh");
    assert!(found.mesh_to_surface.distance < 1e-12 && found.curved_elements == found.elements, "{found:?}");
}
