//! Sizes at the points of a file go all the way: into the mesh that Gmsh makes.

use super::{run, script};
use crate::support::{Out, fixture};
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

/// Squares along a side of a flat square of side 1.
const SIDE: u32 = 20;

/// Its points, and the corners of its triangles.
fn square() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let all = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| [i, j, 0]));
    let points = all.map(|p| p.map(|c| f64::from(c) / f64::from(SIDE))).collect();
    let corner = |i: u32, j: u32| j * (SIDE + 1) + i;
    let mut triangles = Vec::new();
    for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
        let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    (points, triangles)
}

/// The size at a point: 0.01 at x = 0, 0.1 at x = 1. (With twice as much some bands have ten edges, of which medians scatter.)
fn size([x, ..]: [f64; 3]) -> f64 {
    0.01 + 0.09 * x
}

/// A legacy VTK file with the array `edge`, and another one.
fn as_vtk() -> String {
    let (points, triangles) = square();
    let count = points.len();
    let mut text = format!("# vtk DataFile Version 3.0\na square\nASCII\nDATASET POLYDATA\nPOINTS {count} double\n");
    for [x, y, z] in &points {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    let _ = writeln!(text, "POLYGONS {} {}", triangles.len(), 4 * triangles.len());
    for [a, b, c] in triangles {
        let _ = writeln!(text, "3 {a} {b} {c}");
    }
    let _ = writeln!(text, "POINT_DATA {count}\nSCALARS uniform float 1\nLOOKUP_TABLE default");
    text += &"0.05\n".repeat(count);
    text += "SCALARS edge double 1\nLOOKUP_TABLE default\n";
    for point in points {
        let _ = writeln!(text, "{}", size(point));
    }
    text
}

/// An MSH file with the view `edge`.
fn as_msh() -> String {
    let (points, triangles) = square();
    let mut text = format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", points.len());
    for ([x, y, z], tag) in points.iter().zip(1..) {
        let _ = writeln!(text, "{tag} {x} {y} {z}");
    }
    let _ = writeln!(text, "$EndNodes\n$Elements\n{}", triangles.len());
    for ([a, b, c], tag) in triangles.into_iter().zip(1..) {
        let _ = writeln!(text, "{tag} 2 2 0 1 {} {} {}", a + 1, b + 1, c + 1);
    }
    let count = points.len();
    let _ = writeln!(text, "$EndElements\n$NodeData\n1\n\"edge\"\n1\n0\n3\n0\n1\n{count}");
    for (point, tag) in points.into_iter().zip(1..) {
        let _ = writeln!(text, "{tag} {}", size(point));
    }
    text + "$EndNodeData\n"
}

fn inputs(folder: &Path) -> [PathBuf; 2] {
    [("square.vtk", as_vtk()), ("square.msh", as_msh())].map(|(name, text)| {
        let path = folder.join(name);
        fs::write(&path, text).expect("written");
        path
    })
}

#[test]
fn edges_of_the_mesh_are_as_long_as_an_array_asks_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let inputs = inputs(folder.path());
    let out = Out::new();
    let args = ["-q", "--size-from", "edge"];
    assert_eq!(out.run(&inputs.each_ref().map(PathBuf::as_path), &args).code, Some(0));
    for name in ["square.vtk", "square.msh"] {
        let report = out.report(name);
        assert_eq!(report.settings.size_from.as_deref(), Some("edge"));
        let hand_off = report.hand_off.expect("a hand-off");
        assert_eq!((hand_off.size, hand_off.least_size), (size([1.0; 3]), Some(size([0.0; 3]))));
        let printed = run(script("verify_sizes.py").arg(out.of(name)), "edges have other lengths");
        assert!(printed.lines().any(|line| line.starts_with("ok ")), "{printed}");
        let broken = script("verify_sizes.py").arg("--break").arg(out.of(name)).output().expect("runs");
        assert!(!broken.status.success(), "sizes without a slope were not found");
    }
}

#[test]
fn arrays_that_cannot_tell_sizes_are_refused_and_another_one_makes_another_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let [grid, view] = inputs(folder.path());
    let out = Out::new();
    let refused = out.run(&[&grid, &view, &fixture("disk.stl")], &["--size-from", "length"]);
    assert_eq!(refused.code, Some(1));
    for name in ["square.vtk", "square.msh", "disk.stl"] {
        let reason = out.report(name).reason.expect("refused");
        assert_eq!(reason.code.name(), "no_sizes");
        let there =
            [("square.vtk", "uniform, edge"), ("square.msh", "there are edge"), ("disk.stl", "no arrays of points")];
        let (_, told) = there.into_iter().find(|(of, _)| *of == name).expect("one of them");
        assert!(reason.message.contains("called length") && reason.message.contains(told), "{}", reason.message);
    }
    for array in ["uniform", "edge"] {
        assert_eq!(out.run(&[&grid], &["-q", "--hand-off", "gmsh", "--size-from", array]).code, Some(0));
        let report = out.report("square.vtk");
        assert_eq!(report.settings.size_from.as_deref(), Some(array), "the older result was out of date");
        // Of one length everywhere there is nothing to tell place by place.
        let expected = if array == "edge" { (size([1.0; 3]), Some(size([0.0; 3]))) } else { (0.05, None) };
        assert_eq!(report.hand_off.map(|to| (to.size, to.least_size)), Some(expected));
    }
}
