//! Names of parts go all the way: into what ParaView shows, through atlas.msh, into every file that Gmsh writes.

use super::{run, script};
use crate::support::{Out, planish};
use planish::report::Report;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

type Triangle = [[f64; 3]; 3];

/// The two triangles of a quadrilateral.
fn quad([a, b, c, d]: [[f64; 3]; 4]) -> [Triangle; 2] {
    [[a, b, c], [a, c, d]]
}

/// A cube of side 1: its bottom is red, its walls are gray, its top is blue.
fn cube() -> Vec<(&'static str, Vec<Triangle>)> {
    let squares = 5;
    let mut parts = vec![("red", vec![]), ("gray", vec![]), ("blue", vec![])];
    // A side by the axis that it is normal to, and whether it is the far one.
    for (axis, far) in (0..3).flat_map(|axis| [(axis, false), (axis, true)]) {
        let point = |i: u32, j: u32| {
            let [s, t] = [i, j].map(|k| f64::from(k) / f64::from(squares));
            let mut p = [0.0; 3];
            p[axis] = f64::from(far);
            // The normal of a side with these axes in this order points outwards.
            let [first, second] = if far { [1, 2] } else { [2, 1] };
            (p[(axis + first) % 3], p[(axis + second) % 3]) = (s, t);
            p
        };
        let part = if axis < 2 { 1 } else { 2 * usize::from(far) };
        for (i, j) in (0..squares).flat_map(|i| (0..squares).map(move |j| (i, j))) {
            parts[part].1.extend(quad([point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]));
        }
    }
    parts
}

/// An open pipe, of which the middle is heated: no edge of the shape parts it from the rest.
fn pipe() -> Vec<(&'static str, Vec<Triangle>)> {
    let (around, along) = (24, 18);
    let point = |i: u32, j: u32| {
        let angle = TAU * f64::from(i % around) / f64::from(around);
        [angle.cos(), angle.sin(), f64::from(j) / 4.0]
    };
    let mut parts = vec![("cold wall", vec![]), ("heated", vec![])];
    for (i, j) in (0..around).flat_map(|i| (0..along).map(move |j| (i, j))) {
        let is_middle = usize::from((6..12).contains(&j));
        parts[is_middle].1.extend(quad([point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]));
    }
    parts
}

fn as_stl(parts: &[(&str, Vec<Triangle>)]) -> String {
    let mut text = String::new();
    for (name, triangles) in parts {
        let _ = writeln!(text, "solid {name}");
        for triangle in triangles {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in triangle {
                let _ = writeln!(text, "vertex {x} {y} {z}");
            }
            text += "endloop\nendfacet\n";
        }
        let _ = writeln!(text, "endsolid {name}");
    }
    text
}

/// A legacy VTK file, with the position of its part among all as the `region` of a cell, from 7 on.
fn as_vtk(parts: &[(&str, Vec<Triangle>)]) -> String {
    let triangles: Vec<&Triangle> = parts.iter().flat_map(|(_, triangles)| triangles).collect();
    let (cells, points) = (triangles.len(), 3 * triangles.len());
    let mut text = format!("# vtk DataFile Version 3.0\nparts\nASCII\nDATASET POLYDATA\nPOINTS {points} double\n");
    for [x, y, z] in triangles.iter().flat_map(|t| t.iter()) {
        let _ = writeln!(text, "{x} {y} {z}");
    }
    let _ = writeln!(text, "POLYGONS {cells} {}", 4 * cells);
    for cell in 0..cells {
        let _ = writeln!(text, "3 {} {} {}", 3 * cell, 3 * cell + 1, 3 * cell + 2);
    }
    let _ = writeln!(text, "CELL_DATA {cells}\nSCALARS region int 1\nLOOKUP_TABLE default");
    for (region, (_, triangles)) in (7..).zip(parts) {
        triangles.iter().for_each(|_| {
            let _ = writeln!(text, "{region}");
        });
    }
    text
}

fn inputs(folder: &Path) -> [PathBuf; 3] {
    let files = [("cube.stl", as_stl(&cube())), ("pipe.stl", as_stl(&pipe())), ("pipe.vtk", as_vtk(&pipe()))];
    files.map(|(name, text)| {
        let path = folder.join(name);
        fs::write(&path, text).expect("written");
        path
    })
}

fn report(out: &Out, name: &str) -> Report {
    serde_json::from_slice(&fs::read(out.of(name).join("report.json")).expect("there")).expect("a report")
}

#[test]
fn names_reach_every_file_that_gmsh_writes() {
    let folder = tempfile::tempdir().expect("a folder");
    let inputs = inputs(folder.path());
    let out = Out::new();
    assert_eq!(out.run(&inputs.each_ref().map(PathBuf::as_path), &["-q"]).code, Some(0));
    for input in &inputs {
        let name = input.file_name().and_then(|n| n.to_str()).expect("a name");
        let mut verify = script("verify_names.py");
        let printed = run(verify.arg(input).arg(out.of(name)), "a name got lost");
        assert!(printed.lines().any(|line| line.starts_with("ok ")), "{printed}");
        let broken = script("verify_names.py").arg("--break").arg(input).arg(out.of(name)).output().expect("runs");
        assert!(!broken.status.success(), "a part with the name of another was not found");
        let checked = planish(["check".as_ref(), out.of(name).as_os_str()]);
        assert_eq!(checked.code, Some(0), "{}{}", checked.out, checked.err);
    }
    // Of the closed cube no line is in a group; those at the ends of the pipe are. So CalculiX finds trusses there only.
    let lines = |name: &str| fs::read_to_string(out.of(name).join("exports/out.inp")).expect("text").contains("T3D2");
    assert!(!lines("cube.stl") && lines("pipe.stl"));
    let pipe = report(&out, "pipe.stl");
    assert!(pipe.charts.len() >= 3 && pipe.labels.len() == 2, "{} charts", pipe.charts.len());
    // The border of a name is no end of the surface.
    let repaired = &pipe.surface.expect("a surface").repaired.counts;
    assert_eq!((repaired.components, repaired.boundary_loops), (1, 2));
    let tags: Vec<i32> = report(&out, "pipe.vtk").labels.iter().map(|label| label.label.tag).collect();
    assert_eq!(tags, [7, 8], "numbers of the file are tags");
}

#[test]
fn names_count_for_nothing_where_they_are_ignored_or_others_are_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let [_, pipe, grid] = inputs(folder.path());
    let out = Out::new();
    assert_eq!(out.run(&[&pipe, &grid], &["-q", "--ignore-labels"]).code, Some(0));
    assert!(["pipe.stl", "pipe.vtk"].iter().all(|name| report(&out, name).labels.is_empty()));
    // Another setting: the older result is out of date.
    assert_eq!(out.run(&[&grid], &["-q", "--label", "region"]).code, Some(0));
    assert_eq!(report(&out, "pipe.vtk").labels.len(), 2);
    let refused = out.run(&[&grid], &["--label", "zone"]);
    assert_eq!(refused.code, Some(1));
    assert!(refused.err.contains("nothing called zone") && refused.err.contains("region"), "{}", refused.err);
    let both = out.run(&[&grid], &["--label", "region", "--ignore-labels"]);
    assert_eq!(both.code, Some(2));
}
