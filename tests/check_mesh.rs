//! `planish check DIR --mesh FILE`: verdicts on meshes that are right, and on their broken twins.

use crate::support::{Ended, Out, fixture, planish};
use planish::report::mesh::MeshReport;
use std::path::Path;

fn check_mesh(out: &Out, name: &str, mesh: &Path, extra: &[&str]) -> Ended {
    let folder = out.of(name);
    let mut args: Vec<&std::ffi::OsStr> = vec!["check".as_ref(), folder.as_os_str()];
    args.extend(["--mesh".as_ref(), mesh.as_os_str()]);
    args.extend(extra.iter().map(|a| std::ffi::OsStr::new(*a)));
    planish(args)
}

fn kept(out: &Out, name: &str) -> MeshReport {
    serde_json::from_slice(&out.read(name, "mesh.json")).expect("a report")
}

fn certified(name: &str) -> Out {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture(name)], &["-q"]).code, Some(0));
    out
}

#[test]
fn the_triangles_of_the_input_are_a_mesh_of_it() {
    for name in ["disk_with_holes.stl", "disk.stl", "moebius.obj"] {
        let out = certified(name);
        // atlas.msh holds them chart by chart.
        let by_charts = check_mesh(&out, name, &out.of(name).join("atlas.msh"), &["--min-gamma", "0"]);
        assert_eq!(by_charts.code, Some(0), "{name}: {}{}", by_charts.out, by_charts.err);
        assert!(by_charts.out.contains("faithful and fine; judged chart by chart"), "{}", by_charts.out);
        let report = kept(&out, name);
        assert!(report.faithful && report.by_charts && report.defects.is_empty());
        assert!((report.area_ratio - 1.0).abs() < 1e-9);
        let alone = check_mesh(&out, name, &fixture(name), &["--min-gamma", "0"]);
        assert_eq!(alone.code, Some(0), "{name}: {}{}", alone.out, alone.err);
        assert!(alone.out.contains("by the surface alone: the file tells no charts"), "{}", alone.out);
        // What is kept is none of the files that are proven.
        let proven = planish(["check".as_ref(), out.of(name).as_os_str()]);
        assert_eq!(proven.code, Some(0), "{}", proven.err);
    }
}

#[test]
fn what_is_printed_as_json_is_what_is_kept() {
    let name = "disk_with_holes.stl";
    let out = certified(name);
    let told = check_mesh(&out, name, &fixture(name), &["--json", "--size", "0.5", "--min-gamma", "0.01"]);
    let printed: MeshReport = serde_json::from_str(&told.out).expect("JSON");
    assert_eq!(printed, kept(&out, name));
    assert_eq!((printed.size, printed.min_gamma, printed.mesh.file.as_str()), (0.5, 0.01, name));
}

/// A mesh as an OBJ file.
fn write(path: &Path, points: &[[f64; 3]], triangles: &[[u32; 3]]) {
    let mut text: String = points.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    text.extend(triangles.iter().map(|t| format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1)));
    std::fs::write(path, text).expect("written");
}

#[test]
fn bad_meshes_are_refused_with_places_and_kept_reports() {
    let inputs = tempfile::tempdir().expect("a folder");
    let sphere = planish_core::shapes::sphere(10);
    let (points, triangles) = (sphere.points().to_vec(), sphere.triangles().to_vec());
    let at = |name: &str| inputs.path().join(name);
    write(&at("sphere.obj"), &points, &triangles);
    let out = Out::new();
    assert_eq!(out.run(&[&at("sphere.obj")], &["-q"]).code, Some(0));
    let judged = |mesh: &str, extra: &[&str]| {
        let ended = check_mesh(&out, "sphere.obj", &at(mesh), extra);
        (ended, kept(&out, "sphere.obj"))
    };
    let (ended, report) = judged("sphere.obj", &[]);
    assert_eq!((ended.code, report.faithful, report.fine), (Some(0), true, true), "{}{}", ended.out, ended.err);

    write(&at("torn.obj"), &points, &triangles[1..]);
    let (ended, report) = judged("torn.obj", &[]);
    assert_eq!((ended.code, report.faithful, report.fine), (Some(1), false, true));
    assert!(
        ended.out.contains("NOT FAITHFUL") && ended.err.contains("not faithful: the Euler number is 1"),
        "{ended:?}"
    );
    assert!(report.defects.iter().all(|d| d.kind == "topology"), "{:?}", report.defects);

    let mut off = points.clone();
    off[7][2] += 0.01;
    write(&at("off.obj"), &off, &triangles);
    let (ended, report) = judged("off.obj", &[]);
    assert_eq!((ended.code, report.defects.len(), report.defects[0].kind.as_str()), (Some(1), 1, "off_surface"));
    let place = report.places[0].at;
    assert!((0..3).all(|k| (place[k] - off[7][k]).abs() < 1e-12), "{place:?}");

    // Faithful, with elements that are not as good as was asked.
    let (ended, report) = judged("sphere.obj", &["--min-gamma", "0.9"]);
    assert_eq!((ended.code, report.faithful, report.fine), (Some(1), true, false));
    assert!(report.gamma.below > 0 && report.places.len() == 5 && ended.err.is_empty(), "{}", ended.err);
}

#[test]
fn what_cannot_be_judged_is_told() {
    let name = "disk_with_holes.stl";
    let out = certified(name);
    let mesh = fixture(name);
    let folder = out.of(name);
    let two = planish(["check".as_ref(), folder.as_os_str(), folder.as_os_str(), "--mesh".as_ref(), mesh.as_os_str()]);
    assert!(two.code == Some(2) && two.err.contains("one result"), "{two:?}");
    for (wrong, word) in [("--size=0", "--size"), ("--size=-1", "--size"), ("--min-gamma=2", "--min-gamma")] {
        let ended = check_mesh(&out, name, &mesh, &[wrong]);
        assert!(ended.code == Some(2) && ended.err.contains(word), "{wrong:?} {ended:?}");
    }
    let alone = planish(["check".as_ref(), folder.as_os_str(), "--size".as_ref(), "1".as_ref()]);
    assert_eq!(alone.code, Some(2), "--size without a mesh asks nothing");
    let missing = check_mesh(&out, name, &folder.join("remesh.msh"), &[]);
    assert!(missing.code == Some(1) && missing.err.contains("not judged: cannot read"), "{missing:?}");
    let other = check_mesh(&out, name, &folder.join("remesh.geo"), &[]);
    assert!(other.code == Some(1) && other.err.contains(".stl"), "{other:?}");
    // An atlas that is not the one that was published proves nothing.
    let atlas = folder.join("atlas.msh");
    let copy = tempfile::tempdir().expect("a folder");
    std::fs::copy(&atlas, copy.path().join("mesh.msh")).expect("copied");
    let mut bytes = std::fs::read(&atlas).expect("there");
    let last = bytes.len() - 40;
    bytes[last] ^= 1;
    std::fs::write(&atlas, bytes).expect("written");
    let changed = check_mesh(&out, name, &copy.path().join("mesh.msh"), &[]);
    assert!(
        changed.code == Some(1) && changed.err.contains("atlas.msh: its content is not what was published"),
        "{changed:?}"
    );
    assert!(!folder.join("mesh.json").exists(), "no verdict is kept");
}

#[test]
fn a_result_without_a_hand_off_needs_a_size() {
    let name = "disk_with_holes.stl";
    let out = Out::new();
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--hand-off", "none"]).code, Some(0));
    let without = check_mesh(&out, name, &fixture(name), &["--min-gamma", "0"]);
    assert!(without.code == Some(1) && without.err.contains("give --size H"), "{without:?}");
    let with = check_mesh(&out, name, &fixture(name), &["--min-gamma", "0", "--size", "0.5"]);
    assert_eq!(with.code, Some(0), "{with:?}");
}
