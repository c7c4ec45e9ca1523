//! The real VTK and meshio open what planish writes, an independent program proves the triangles valid again, and the
//! real Gmsh remeshes through the maps.
//!
//! The Python environment is made beside the sources (`.venv`, not under version control) when a test first needs
//! it, with the packages of requirements.txt.

mod also;
mod growth;
pub mod matrix;
mod mmg;
pub mod naming;
pub mod recipe;
pub mod remesh;
mod sizes;
pub mod sizing;

use crate::support::{Out, fixture, root};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

/// The interpreter of the environment.
static PYTHON: LazyLock<PathBuf> = LazyLock::new(|| {
    let venv = root().join(".venv");
    let python = venv.join("bin/python");
    let wanted = std::fs::read_to_string(root().join("tests/interop/requirements.txt")).expect("committed");
    let stamp = venv.join("planish-requirements");
    if std::fs::read_to_string(&stamp).is_ok_and(|made| made == wanted) {
        return python;
    }
    let remedy = "python3 with its venv module is needed: apt-get install python3 python3-venv";
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&venv), remedy);
    let mut pip = Command::new(&python);
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "-r"]);
    run(
        pip.arg(root().join("tests/interop/requirements.txt")),
        "the packages could not be installed: is PyPI reachable?",
    );
    std::fs::write(stamp, wanted).expect("written");
    python
});

/// Runs a command that must succeed; what it printed.
fn run(command: &mut Command, remedy: &str) -> String {
    let Output { status, stdout, stderr } = command.output().unwrap_or_else(|e| panic!("{command:?}: {e}\n{remedy}"));
    let (out, err) = (String::from_utf8_lossy(&stdout), String::from_utf8_lossy(&stderr));
    assert!(status.success(), "{command:?} failed\n{out}{err}\n{remedy}");
    format!("{out}{err}")
}

fn script(name: &str) -> Command {
    let mut command = Command::new(&*PYTHON);
    command.arg(root().join("tests/interop").join(name));
    command
}

/// The PATH on which the programs of the environment (`gmsh`, `python`) and planish are found first.
pub fn tools() -> OsString {
    let own = PYTHON.parent().expect("a folder").to_owned();
    let inherited = std::env::var_os("PATH").unwrap_or_default();
    let program = Path::new(env!("CARGO_BIN_EXE_planish")).parent().expect("a folder").to_owned();
    let folders = [own, program].into_iter().chain(std::env::split_paths(&inherited));
    std::env::join_paths(folders).expect("no folder has a colon in its name")
}

/// The samples of a file of metrics, a line each, as Prometheus' own client for Python reads them.
pub fn samples(metrics: &Path) -> String {
    run(script("verify_metrics.py").arg(metrics), "Prometheus does not read the metrics")
}

/// VTK opens both files of a result without a word, finds every field, and every triangle is valid.
pub fn assert_vtk_agrees(folders: &[PathBuf]) {
    let printed = run(script("verify_vtu.py").args(folders), "VTK or the independent proof disagrees");
    assert_eq!(printed.lines().filter(|l| l.starts_with("ok ")).count(), folders.len(), "{printed}");
}

#[test]
fn vtk_opens_both_files_and_an_independent_proof_agrees() {
    let out = Out::new();
    let names =
        ["disk.stl", "disk_with_holes.stl", "bent_disk.stl", "folding_three.obj", "sliver_strip.obj", "finger.obj"];
    let paths: Vec<PathBuf> = names.iter().map(|n| fixture(n)).collect();
    // Sizes at which arrays fill compression blocks exactly, and one below and above.
    let squares = tempfile::tempdir().expect("a folder");
    let blocks: Vec<PathBuf> = [63, 64, 65].iter().map(|n| square_grid(squares.path(), *n)).collect();
    let inputs: Vec<&Path> = paths.iter().chain(&blocks).map(PathBuf::as_path).collect();
    assert_eq!(out.run(&inputs, &["-q"]).code, Some(0));
    let folders: Vec<PathBuf> = inputs.iter().map(|p| out.path().join(p.file_name().expect("a name"))).collect();
    assert_vtk_agrees(&folders);
}

/// A bumpy grid of n x n squares as an OBJ file.
fn square_grid(folder: &Path, n: u32) -> PathBuf {
    let mut text = String::new();
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        text += &format!("v {i} {j} {}\n", f64::from((i * 7 + j * 3) % 5) * 0.1);
    }
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let a = i * (n + 1) + j + 1;
        text += &format!("f {} {} {} {}\n", a, a + n + 1, a + n + 2, a + 1);
    }
    let path = folder.join(format!("grid{n}.obj"));
    std::fs::write(&path, text).expect("written");
    path
}

#[test]
fn a_broken_twin_is_found_by_the_independent_proof() {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture("disk.stl")], &["-q"]).code, Some(0));
    let output = script("verify_vtu.py").arg("--break").arg(out.of("disk.stl")).output().expect("runs");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!output.status.success() && printed.contains("invalid triangle"), "{printed}");
}

#[test]
fn every_report_follows_the_published_schema() {
    let out = Out::new();
    let refused = out.path().join("inputs");
    std::fs::create_dir(&refused).expect("made");
    std::fs::write(refused.join("empty.stl"), "").expect("written");
    std::fs::write(refused.join("flat.obj"), "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n").expect("written");
    out.run(&[&root().join("fixtures"), &refused], &["-q"]);
    out.run(&[&fixture("disk.stl")], &["-q", "--order", "1"]);
    let reports = std::fs::read_dir(out.path()).expect("a folder").flatten().map(|e| e.path().join("report.json"));
    let reports: Vec<PathBuf> = reports.filter(|p| p.exists()).collect();
    assert_eq!(reports.len(), 15);
    let schema = root().join("docs/report.schema.json");
    run(script("validate_schema.py").arg(schema).args(reports), "a report breaks the schema");
}

/// Surfaces with nothing in common but the file.
fn several(folder: &Path) -> PathBuf {
    let parts =
        [planish_core::shapes::disk(4), planish_core::shapes::sphere(6), planish_core::shapes::ring_torus(9, 6)];
    let (mut text, mut base) = (String::new(), 1);
    for (part, soup) in (0..).zip(&parts) {
        soup.points().iter().for_each(|[x, y, z]| text += &format!("v {} {y} {z}\n", x + 5.0 * f64::from(part)));
        soup.triangles().iter().for_each(|[a, b, c]| text += &format!("f {} {} {}\n", a + base, b + base, c + base));
        base += soup.points().len() as u32;
    }
    let path = folder.join("several.obj");
    std::fs::write(&path, text).expect("written");
    path
}

/// As simulation codes in Python do, which go through meshio.
#[test]
fn meshio_reads_what_vtk_and_gmsh_read() {
    let (out, inputs) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let paths = [fixture("disk.stl"), fixture("plate_genus9.stl"), several(inputs.path())];
    let paths: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    assert_eq!(out.run(&paths, &["-q"]).code, Some(0));
    assert_eq!(out.report("several.obj").surface.expect("a surface").repaired.counts.components, 3);
    let folders = ["disk.stl", "plate_genus9.stl", "several.obj"].map(|name| out.of(name));
    assert_vtk_agrees(&folders);
    let printed = run(script("verify_meshio.py").args(&folders), "meshio reads something else than VTK or Gmsh");
    let said: Vec<&str> = printed.lines().collect();
    assert!(said.len() == folders.len() && said.iter().all(|line| line.starts_with("ok ")), "{printed}");
}
