//! Sizes that fit: by curvature, and by what mesh and surface may be apart.

use super::{PYTHON, run, script};
use crate::support::{Out, planish};
use planish::report::mesh::MeshReport;
use planish_core::mesh::TriangleSoup;
use planish_core::shapes;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn write(folder: &Path, name: &str, soup: &TriangleSoup) -> PathBuf {
    let mut text = String::new();
    for [x, y, z] in soup.points() {
        let _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in soup.triangles().iter().map(|t| t.map(|v| v + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    let path = folder.join(name);
    fs::write(&path, text).expect("written");
    path
}

/// Of a sphere and a tube of radius 1 the largest curvature is 1 everywhere.
#[test]
fn a_full_turn_has_as_many_edges_as_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let [sphere, tube] = [("sphere.obj", shapes::sphere(24)), ("tube.obj", shapes::tube(80, 60, 6.0))]
        .map(|(name, soup)| write(folder.path(), name, &soup));
    let out = Out::new();
    assert_eq!(out.run(&[&sphere, &tube], &["-q", "--size", "10", "--size-curvature", "20"]).code, Some(0));
    for name in ["sphere.obj", "tube.obj"] {
        let mut verify = script("verify_fit.py");
        run(verify.arg("curvature").arg(out.of(name)).args(["1", "20"]), "edges are not as long as asked for");
    }
    // Without it all edges are as long as the size: the check would tell.
    assert_eq!(out.run(&[&sphere], &["-q", "--size", "0.1"]).code, Some(0));
    let uniform = script("verify_fit.py").arg("curvature").arg(out.of("sphere.obj")).args(["1", "20"]).output();
    assert!(!uniform.expect("runs").status.success());
}

fn gmsh(folder: &Path) -> PathBuf {
    let mesh = folder.join("part.msh");
    let program = PYTHON.with_file_name("gmsh");
    let mut gmsh = Command::new(&*PYTHON);
    gmsh.arg(program).arg(folder.join("remesh.geo")).args(["-2", "-v", "2", "-o"]).arg(&mesh);
    run(&mut gmsh, "Gmsh fails");
    mesh
}

/// The loop of the documents: mesh, check, shorter edges where it is too far, three times at most.
#[test]
fn the_deviation_holds_after_a_few_rounds() {
    let files = tempfile::tempdir().expect("a folder");
    let sphere = write(files.path(), "sphere.obj", &shapes::sphere(24));
    let out = Out::new();
    // The sizes would do at once: what is asked of the mesh is less than what they were made for.
    assert_eq!(out.run(&[&sphere], &["-q", "--size", "1", "--deviation", "0.02"]).code, Some(0));
    let folder = out.of("sphere.obj");
    let limit = "0.006";
    let check = |mesh: &Path| {
        let fixed = ["check".as_ref(), folder.as_os_str(), "--mesh".as_ref(), mesh.as_os_str()];
        planish(fixed.into_iter().chain(["--deviation", limit, "--finer"].map(std::ffi::OsStr::new)))
    };
    let mut rounds = 0;
    let mesh = loop {
        let mesh = gmsh(&folder);
        let checked = check(&mesh);
        let found = fs::read(folder.join("mesh.json")).expect("there");
        let found: MeshReport = serde_json::from_slice(&found).expect("a report");
        let deviation = found.deviation.expect("asked for");
        if deviation.elements == 0 {
            break mesh;
        }
        assert!(checked.code == Some(1) && found.defects.iter().any(|d| d.kind == "deviates"), "{}", checked.err);
        rounds += 1;
        assert!(rounds <= 3, "{}{}", checked.out, checked.err);
    };
    assert!((1..=3).contains(&rounds), "nothing had to be done");
    let mut verify = script("verify_fit.py");
    run(verify.arg("deviation").arg(&folder).arg(&mesh).arg(limit), "another program finds more");
    let less = script("verify_fit.py").arg("deviation").arg(&folder).arg(&mesh).arg("0.00004").output();
    assert!(!less.expect("runs").status.success(), "a limit that nothing meets was met");
}
