//! The real Gmsh remeshes through the maps that planish hands it.

use super::{assert_vtk_agrees, run, script};
use crate::support::{Out, fixture, planish};
use pipeline::decompose::assemble;
use pipeline::mesh::TriangleSoup;
use pipeline::{repair, shapes};
use planish::report::{Input, Report};
use planish::settings::{Said, Settings};
use planish::stages;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// `gmsh remesh.geo -2` makes a mesh of each result that has its topology and lies on it.
pub fn assert_gmsh_remeshes(folders: &[PathBuf], extra: &[&str]) {
    let printed = run(script("verify_remesh.py").args(extra).args(folders), "Gmsh does not remesh as it should");
    assert_eq!(printed.lines().filter(|l| l.starts_with("ok ")).count(), folders.len(), "{printed}");
}

fn settings(size: Option<f64>) -> Settings {
    Said { size, ..Said::default() }.check().expect("valid")
}

/// Writes the result of a surface with one chart per label; a triangle is labelled by its centre.
fn write_labelled(
    folder: &Path,
    soup: &TriangleSoup,
    settings: &Settings,
    label: impl Fn([f64; 3]) -> u32,
) -> (PathBuf, Report) {
    let found = repair(soup, &Default::default()).expect("a surface");
    let centre = |f: usize| {
        let [a, b, c] = found.mesh.corners(f);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    };
    let labels: Vec<u32> = (0..found.mesh.triangles().len()).map(|f| label(centre(f))).collect();
    let atlas = assemble(&found.mesh, &labels).expect("legal");
    let input = Input { name: "labelled".to_owned(), bytes: None, blake3: None, beside: vec![] };
    let mut report = Report::new(input, settings);
    let files = stages::finish(&found, atlas, settings, &mut report).expect("mapped");
    std::fs::create_dir_all(folder).expect("made");
    files.iter().for_each(|(name, content)| std::fs::write(folder.join(name), content).expect("written"));
    std::fs::write(folder.join("report.json"), report.to_json().expect("JSON")).expect("written");
    (folder.to_owned(), report)
}

fn sector(p: [f64; 3], count: u32) -> u32 {
    ((p[1].atan2(p[0]) / TAU).rem_euclid(1.0) * f64::from(count)) as u32
}

fn page(p: [f64; 3]) -> u32 {
    let turn = p[1].atan2(p[0]) - 0.4 * p[0].hypot(p[1]);
    ((turn / TAU * 3.0).rem_euclid(3.0).round() as u32) % 3
}

fn scaled(soup: &TriangleSoup, scale: f64, shift: f64) -> TriangleSoup {
    let points = soup.points().iter().map(|p| p.map(|c| c * scale + shift)).collect();
    TriangleSoup::new(points, soup.triangles().to_vec()).expect("sound")
}

/// A sphere with a membrane in its equator: three charts share one closed curve.
fn sphere_with_membrane(n: u32) -> TriangleSoup {
    let sphere = shapes::sphere(n);
    let equator = 2 + (n / 2 - 1) * 2 * n;
    let centre = sphere.points().len() as u32;
    let points = sphere.points().iter().copied().chain([[0.0, 0.0, 0.3]]).collect();
    let fan = (0..2 * n).map(|j| [equator + j, equator + (j + 1) % (2 * n), centre]);
    TriangleSoup::new(points, sphere.triangles().iter().copied().chain(fan).collect()).expect("sound")
}

#[test]
fn gmsh_remeshes_the_fixtures_through_their_maps() {
    let out = Out::new();
    let names =
        ["disk.stl", "disk_with_holes.stl", "bent_disk.stl", "cracked_patch.obj", "finger.obj", "folding_six.obj"];
    let paths: Vec<PathBuf> = names.iter().map(|n| fixture(n)).collect();
    let inputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    assert_eq!(out.run(&inputs, &["-q"]).code, Some(0));
    let folders: Vec<PathBuf> = names.iter().map(|n| out.of(n)).collect();
    assert_gmsh_remeshes(&folders, &[]);
}

#[test]
fn charts_that_share_seams_are_remeshed_conformingly() {
    let out = tempfile::tempdir().expect("a folder");
    let at = |name: &str| out.path().join(name);
    let above = |p: [f64; 3]| u32::from(p[2] > 0.0);
    let membrane = |p: [f64; 3]| if p[0].hypot(p[1]).hypot(p[2]) < 0.9 { 2 } else { u32::from(p[2] > 0.0) };
    let finer = settings(Some(0.08));
    let folders = [
        write_labelled(&at("halves"), &shapes::sphere(16), &settings(None), above),
        write_labelled(&at("sectors"), &shapes::sphere(16), &finer, |p| sector(p, 3)),
        write_labelled(&at("annuli"), &shapes::ring_torus(24, 12), &finer, |p| sector(p, 2)),
        write_labelled(&at("pieces"), &shapes::ring_torus(24, 12), &finer, |p| {
            2 * sector(p, 3) + u32::from(p[2] > 0.0)
        }),
        write_labelled(&at("book"), &shapes::book(3, 8), &finer, page),
        write_labelled(&at("membrane"), &sphere_with_membrane(16), &finer, membrane),
        write_labelled(&at("cut"), &shapes::disk(10), &finer, |p| sector(p, 4)),
        write_labelled(&at("holes"), &shapes::disk_with_holes(17, 3), &finer, |p| u32::from(p[0] > 0.05)),
    ];
    assert!(folders.iter().all(|(_, report)| report.hand_off.as_ref().is_some_and(|h| h.failure.is_none())));
    let folders = folders.map(|(folder, _)| folder);
    assert_vtk_agrees(&folders);
    assert_gmsh_remeshes(&folders, &[]);
}

/// A disk whose ring of triangles around the centre is cut in the middles of its spokes on one side only: the gaps
/// are filled by exactly flat triangles, as CAD exporters leave them.
fn disk_with_flat_triangles() -> TriangleSoup {
    let disk = shapes::disk(8);
    let mut points = disk.points().to_vec();
    let mut triangles = Vec::new();
    for t in disk.triangles() {
        let Some(k) = t.iter().position(|v| *v == 0) else {
            triangles.push(*t);
            continue;
        };
        let [centre, a, b] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
        let middle = points.len() as u32;
        points.push([0, 1, 2].map(|i| 0.5 * points[centre as usize][i] + 0.5 * points[a as usize][i]));
        triangles.extend([[middle, a, b], [centre, middle, b], [centre, a, middle]]);
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_plate_of_genus_9_is_remeshed_from_two_halves() {
    let out = tempfile::tempdir().expect("a folder");
    let bytes = std::fs::read(fixture("plate_genus9.stl")).expect("a fixture");
    let soup = planish::formats::read_alone(planish::formats::Format::Stl, &bytes).expect("readable").soup;
    let (folder, report) = write_labelled(out.path(), &soup, &settings(None), |p| u32::from(p[2] > 0.0));
    assert_eq!((report.seams.curves, report.seams.corners, report.charts[0].loops), (10, 0, 10));
    assert!(report.hand_off.is_some_and(|h| h.warning.is_none()));
    assert_vtk_agrees(std::slice::from_ref(&folder));
    assert_gmsh_remeshes(&[folder], &[]);
}

#[test]
fn exactly_flat_triangles_do_not_stop_gmsh() {
    let out = tempfile::tempdir().expect("a folder");
    let (folder, report) = write_labelled(out.path(), &disk_with_flat_triangles(), &settings(None), |_| 0);
    assert!(report.hand_off.is_some_and(|h| h.moved_vertices >= 6));
    assert_gmsh_remeshes(&[folder], &[]);
}

/// A cylinder with a fin along one ruling: repair cuts it open there, and its two ends lie on each other.
fn cut_cylinder() -> TriangleSoup {
    let (n, m) = (12, 4);
    let point = |i: u32, j: u32| {
        let angle = TAU * f64::from(i) / f64::from(n);
        [angle.cos(), angle.sin(), 0.5 * f64::from(j)]
    };
    let tube = (0..n).flat_map(|i| (0..=m).map(move |j| (i, j))).map(|(i, j)| point(i, j));
    let points = tube.chain((0..=m).map(|j| [2.0, 0.0, 0.5 * f64::from(j)])).collect();
    let at = |i: u32, j: u32| if i > n { n * (m + 1) + j } else { i % n * (m + 1) + j };
    let quad = |i: u32, k: u32, j: u32| [[at(i, j), at(k, j), at(k, j + 1)], [at(i, j), at(k, j + 1), at(i, j + 1)]];
    let sides = (0..n).map(|i| (i, i + 1)).chain([(0, n + 1)]);
    let triangles = sides.flat_map(|(i, k)| (0..m).flat_map(move |j| quad(i, k, j))).collect();
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_hand_off_that_fails_is_told_and_the_maps_are_certified_all_the_same() {
    let out = tempfile::tempdir().expect("a folder");
    let fin = |p: [f64; 3]| u32::from(p[0].hypot(p[1]) > 1.0);
    let (folder, report) = write_labelled(out.path(), &cut_cylinder(), &settings(None), fin);
    let failure = report.hand_off.and_then(|h| h.failure).expect("a failure");
    assert!(failure.contains("lies on both sides of curve"), "{failure}");
    assert!(!folder.join("atlas.msh").exists() && folder.join("seams.vtp").exists());
    let checked = planish(["check".as_ref(), folder.as_os_str()]);
    assert_eq!(checked.code, Some(0), "{}", checked.err);
}

#[test]
fn units_and_places_do_not_matter() {
    let out = tempfile::tempdir().expect("a folder");
    let folders = [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e4)].map(|(scale, shift)| {
        let torus = scaled(&shapes::ring_torus(24, 12), scale, shift);
        let label = |p: [f64; 3]| sector(p.map(|c| (c - shift) / scale), 2);
        write_labelled(&out.path().join(format!("{scale:e}{shift}")), &torus, &settings(Some(0.08 * scale)), label).0
    });
    assert_gmsh_remeshes(&folders, &[]);
}

#[test]
fn seams_closer_than_the_edges_are_long_are_warned_of_and_what_comes_of_them_is_found() {
    let out = tempfile::tempdir().expect("a folder");
    // Upper and lower half of a flat ring share their outer and their inner rim.
    let ring = shapes::ring_torus(24, 12);
    let flat = ring.points().iter().map(|[x, y, z]| [*x, *y, 0.2 * z]).collect();
    let ring = TriangleSoup::new(flat, ring.triangles().to_vec()).expect("sound");
    let above = |p: [f64; 3]| u32::from(p[2] > 0.0);
    let (fine, report) = write_labelled(&out.path().join("fine"), &ring, &settings(Some(0.2)), above);
    let hand_off = report.hand_off.expect("a hand-off");
    let width = hand_off.shortest_seam_distance.expect("two seams");
    assert!((0.75..0.8).contains(&width) && hand_off.warning.is_none(), "{hand_off:?}");
    assert_gmsh_remeshes(&[fine], &[]);
    let (coarse, report) = write_labelled(&out.path().join("coarse"), &ring, &settings(Some(1.2)), above);
    let warning = report.hand_off.expect("a hand-off").warning.expect("a warning");
    assert!(warning.contains("--size 3.9"), "{warning}");
    let output = script("verify_remesh.py").arg(coarse).output().expect("runs");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!output.status.success() && printed.contains("two triangles on the same nodes"), "{printed}");
}

#[test]
fn another_size_than_the_reported_one_is_found() {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture("disk.stl")], &["-q", "--size", "0.1"]).code, Some(0));
    let script_file = out.of("disk.stl").join("remesh.geo");
    let text = std::fs::read_to_string(&script_file).expect("there").replace("{0.1,", "{0.3,");
    std::fs::write(script_file, text).expect("written");
    let output = script("verify_remesh.py").arg(out.of("disk.stl")).output().expect("runs");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!output.status.success() && printed.contains("median length"), "{printed}");
}
