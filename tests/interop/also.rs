//! `--also obj,glb,welded`: trimesh, VTK and meshio read the files, and find in them what the report tells.

use super::{run, script};
use crate::support::{Out, fixture, planish};
use planish::settings::Also;
use std::path::Path;

/// A cube in ASCII STL whose sides are solids with names.
fn cube_of_named_sides() -> String {
    let corner = |i: u32| [0, 1, 2].map(|k| i >> k & 1);
    let sides = [
        ("bottom wall", [0, 2, 3, 1]),
        ("lid", [4, 5, 7, 6]),
        ("inlet", [0, 1, 5, 4]),
        ("outlet", [2, 6, 7, 3]),
        ("left", [0, 4, 6, 2]),
        ("right", [1, 3, 7, 5]),
    ];
    let mut text = String::new();
    for (name, [a, b, c, d]) in sides {
        text += &format!("solid {name}\n");
        for triangle in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0\nouter loop\n";
            triangle.map(corner).iter().for_each(|[x, y, z]| text += &format!("vertex {x} {y} {z}\n"));
            text += "endloop\nendfacet\n";
        }
        text += &format!("endsolid {name}\n");
    }
    text
}

/// A torus, and the cube, with all three files.
fn results() -> Out {
    let (out, inputs) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let cube = inputs.path().join("cube.stl");
    std::fs::write(&cube, cube_of_named_sides()).expect("written");
    let torus = inputs.path().join("torus.obj");
    std::fs::write(&torus, torus_far_away()).expect("written");
    let fixtures = ["plate_genus9.stl", "bent_disk.stl", "bow_tie.stl"].map(fixture);
    let all: Vec<&Path> = [&cube, &torus].into_iter().chain(&fixtures).map(|path| path.as_path()).collect();
    let ended = out.run(&all, &["-q", "--also", "welded,obj,glb", "--hand-off", "none"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    out
}

/// So far from the origin that 32 bits hold no more than steps of a quarter there.
fn torus_far_away() -> String {
    let soup = planish_core::shapes::ring_torus(24, 12);
    let mut text = String::new();
    soup.points().iter().for_each(|[x, y, z]| text += &format!("v {} {} {z}\n", x + 500_000.0, y + 4_000_000.0));
    soup.triangles().iter().for_each(|[a, b, c]| text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    text
}

#[test]
fn trimesh_vtk_and_meshio_read_what_is_also_written() {
    let out = results();
    let names = ["cube.stl", "torus.obj", "plate_genus9.stl", "bent_disk.stl", "bow_tie.stl"];
    let folders = names.map(|name| out.of(name));
    let printed = run(script("verify_also.py").args(&folders), "another program reads something else");
    assert_eq!(printed.lines().filter(|l| l.starts_with("ok ")).count(), folders.len(), "{printed}");
    for name in names {
        let report = out.report(name);
        let listed = |file: &str| report.outputs.iter().any(|output| output.file == file);
        assert!(["surface.obj", "surface.glb", "welded.vtu"].into_iter().all(listed), "{name}");
        assert_eq!(report.settings.also, [Also::Obj, Also::Glb, Also::Welded]);
        assert_eq!(planish(["check".as_ref(), out.of(name).as_os_str()]).code, Some(0), "{name}");
    }
    let cube = out.report("cube.stl");
    assert_eq!(cube.content.expect("read").labels.len(), 6, "sides have names");
    broken_twins_are_found(&out);
}

fn broken_twins_are_found(out: &Out) {
    for (what, told) in [
        ("open", "open edges"),
        ("flip", "texture coordinates of"),
        ("names", "something else"),
        ("fold", "turned over"),
    ] {
        let output = script("verify_also.py").args(["--break", what]).arg(out.of("torus.obj")).output().expect("runs");
        let printed = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success() && printed.contains(told), "{what}: {printed}");
    }
}
