//! The real Gmsh remeshes through the maps that planish hands it.

use super::{PYTHON, assert_vtk_agrees, run, script};
use crate::support::{Ended, Out, fixture, planish, root};
use planish::report::{Input, Report};
use planish::settings::{RawSettings, Settings};
use planish::stages;
use planish_core::decompose::assemble;
use planish_core::mesh::TriangleSoup;
use planish_core::{repair, shapes};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// `gmsh remesh.geo -2` makes a mesh of each result that has its topology and lies on it; `planish check --mesh`, which
/// shares no code with what looks at the mesh here, finds it faithful.
pub fn assert_gmsh_remeshes(folders: &[PathBuf], extra: &[&str]) {
    let mut verify = script("verify_remesh.py");
    let printed = run(verify.arg("--keep").args(extra).args(folders), "Gmsh does not remesh as it should");
    assert_eq!(printed.lines().filter(|l| l.starts_with("ok ")).count(), folders.len(), "{printed}");
    for folder in folders {
        let judged = check_mesh(folder, &["--min-gamma", "0"]);
        assert_eq!(judged.code, Some(0), "{}{}", judged.out, judged.err);
        assert!(judged.out.contains("judged chart by chart"), "{}", judged.out);
    }
}

/// `planish check FOLDER --mesh FOLDER/remesh.msh`.
fn check_mesh(folder: &Path, extra: &[&str]) -> Ended {
    let mesh = folder.join("remesh.msh");
    let fixed = ["check".as_ref(), folder.as_os_str(), "--mesh".as_ref(), mesh.as_os_str()];
    planish(fixed.into_iter().chain(extra.iter().map(std::ffi::OsStr::new)))
}

/// Gmsh's mesh of a result, by a script that was changed.
fn gmsh(folder: &Path, change: impl Fn(String) -> String) {
    let changed = folder.join("changed.geo");
    let text = std::fs::read_to_string(folder.join("remesh.geo")).expect("there");
    std::fs::write(&changed, change(text)).expect("written");
    let gmsh = PYTHON.with_file_name("gmsh");
    let output = folder.join("remesh.msh");
    run(
        std::process::Command::new(&*PYTHON).arg(gmsh).arg(changed).args(["-2", "-v", "2", "-o"]).arg(output),
        "Gmsh fails",
    );
}

fn settings(size: Option<f64>) -> Settings {
    RawSettings { size, ..RawSettings::default() }.check().expect("valid")
}

/// Writes the result of a surface with one chart per label; a triangle is labelled by its centre.
fn write_labelled(
    folder: &Path,
    soup: &TriangleSoup,
    settings: &Settings,
    label: impl Fn([f64; 3]) -> u32,
) -> (PathBuf, Report) {
    let found = repair(soup, &settings.core().repair).expect("a surface");
    let centre = |f: usize| {
        let [a, b, c] = found.mesh.corners(f);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    };
    let labels: Vec<u32> = (0..found.mesh.triangles().len()).map(|f| label(centre(f))).collect();
    let atlas = assemble(&found.mesh, &labels).expect("legal");
    let input = Input { name: "labelled".to_owned(), bytes: None, blake3: None, beside: vec![] };
    let (report, files) = stages::finish(input, found, atlas, settings).expect("mapped");
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
    let names = ["disk.stl", "disk_with_holes.stl", "cracked_patch.obj", "finger.obj", "folding_six.obj"];
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
    // The plate is as thin as an element is long: of ten sizes from 0.03 to 0.07 elements at its rim cut through each other with
    // five (0.035, 0.038, 0.042, 0.048, 0.055), which is no matter of the maps, and one size fits all that the test is for.
    let settings = settings(Some(0.06));
    let (folder, report) = write_labelled(out.path(), &soup, &settings, |p| u32::from(p[2] > 0.0));
    assert_eq!((report.seams.curves, report.seams.corners, report.charts[0].loops), (10, 0, 10));
    assert!(report.hand_off.is_some_and(|h| h.warning.is_none()));
    assert_vtk_agrees(std::slice::from_ref(&folder));
    assert_gmsh_remeshes(&[folder], &[]);
}

#[test]
fn exactly_flat_triangles_do_not_stop_gmsh() {
    let out = tempfile::tempdir().expect("a folder");
    // With a tolerance repair would have removed them.
    let settings = Settings { weld: 0.0, ..settings(None) };
    let (folder, report) = write_labelled(out.path(), &disk_with_flat_triangles(), &settings, |_| 0);
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
fn charts_that_touch_themselves_are_split_and_remeshed() {
    let out = tempfile::tempdir().expect("a folder");
    let fin = |p: [f64; 3]| u32::from(p[0].hypot(p[1]) > 1.0);
    let (folder, report) = write_labelled(out.path(), &cut_cylinder(), &settings(None), fin);
    assert_eq!(report.hand_off.and_then(|h| h.failure), None);
    assert_eq!((report.charts.len(), report.decomposition.map(|d| d.charts_by_splitting)), (3, Some(1)));
    assert_gmsh_remeshes(&[folder], &[]);
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
    let hand_off = report.hand_off.expect("a hand-off");
    let warning = hand_off.warning.expect("a warning");
    assert!(warning.contains("--size 3.9") && hand_off.narrow_curves == 2, "{warning}");
    // Both charts are narrower than an edge: elements are smaller there, and all is well.
    assert_gmsh_remeshes(std::slice::from_ref(&coarse), &["--any-size"]);
    // The twin without that comes to lie on itself, and both judges see it.
    let script_file = coarse.join("remesh.geo");
    let text = std::fs::read_to_string(&script_file).expect("there").replace("Background Field", "// Background Field");
    std::fs::write(script_file, text).expect("written");
    let output = script("verify_remesh.py").args(["--keep", "--any-size"]).arg(&coarse).output().expect("runs");
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(!output.status.success() && printed.contains("two triangles on the same nodes"), "{printed}");
    gmsh(&coarse, |text| text);
    let judged = check_mesh(&coarse, &[]);
    assert!(judged.code == Some(1) && judged.err.contains("copies of others"), "{}{}", judged.out, judged.err);
}

/// A disk that is bent and shaken until its map is at the end of double precision: Gmsh cannot mesh it, whatever the
/// algorithm, and does not say so.
#[test]
fn what_gmsh_loses_without_a_word_is_told() {
    let out = Out::new();
    let name = "bent_disk.stl";
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--boundary", "circle"]).code, Some(0));
    let folder = out.of(name);
    gmsh(&folder, |text| text);
    let judged = check_mesh(&folder, &[]);
    assert!(judged.code == Some(1) && judged.out.contains("NOT FAITHFUL"), "{}{}", judged.out, judged.err);
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

/// The parts of real files that Gmsh's own chain, or Frontal-Delaunay through our maps, loses or doubles.
#[test]
fn real_parts_come_out_whole_and_with_good_elements() {
    let meshes = root().join("../shared/meshes");
    let names = [
        "airplane_netgen.stl",
        "cad_gmsh_t13.stl",
        "cad_coupling_g9.msh",
        "cad_component8_p2.msh",
        "cad_featuretype_cracked.stl",
        "progressive_embedding_62415.obj",
    ];
    if !meshes.is_dir() {
        println!("skipped: there is no {}", meshes.display());
        return;
    }
    let out = Out::new();
    let paths: Vec<PathBuf> = names.iter().map(|n| meshes.join(n)).collect();
    let inputs: Vec<&Path> = paths.iter().map(PathBuf::as_path).collect();
    assert_eq!(out.run(&inputs, &["-q"]).code, Some(0));
    for name in names {
        gmsh(&out.of(name), |text| text);
        let judged = check_mesh(&out.of(name), &[]);
        assert_eq!(judged.code, Some(0), "{name}: {}{}", judged.out, judged.err);
        assert!(judged.out.contains("faithful and fine; judged chart by chart"), "{name}: {}", judged.out);
    }
}

/// The mesh by a result's own script is faithful and fine.
fn assert_meshed_whole(folder: &Path) {
    gmsh(folder, |text| text);
    let whole = check_mesh(folder, &[]);
    assert_eq!(whole.code, Some(0), "{}{}", whole.out, whole.err);
}

/// The mesh by a result's own script is faithful and fine; what is said of the one by the script that was changed, which is not.
fn whole_but_by(folder: &Path, change: impl Fn(String) -> String) -> Ended {
    assert_meshed_whole(folder);
    gmsh(folder, change);
    let lost = check_mesh(folder, &[]);
    assert_eq!(lost.code, Some(1), "{}", lost.out);
    lost
}

/// Long facets: a pill and a needle that Frontal-Delaunay loses a third and half of.
#[test]
fn rows_of_long_facets_are_whole() {
    let out = Out::new();
    let (pill, folder) = (pill(64, 6), out.of("pill.obj"));
    // Natural maps do not stretch them.
    let (ended, report) = out.run_bytes_with("pill.obj", pill.as_bytes(), &["-q", "--feature-angle", "off"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(report.charts.iter().all(|c| c.distortion.conformal_p99 < 2.0), "as they are");
    assert_meshed_whole(&folder);
    // Those onto the disk do.
    let on_disk = ["-q", "--feature-angle", "off", "--boundary", "circle", "--force"];
    let (ended, report) = out.run_bytes_with("pill.obj", pill.as_bytes(), &on_disk);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(report.hand_off.is_some_and(|h| !h.adapted_charts.is_empty()), "maps stretch");
    // The known-bad twin: the algorithm that loses parts of such surfaces.
    let lost = whole_but_by(&folder, |text| {
        text.lines().filter(|l| !l.starts_with("MeshAlgorithm")).map(|l| l.to_owned() + "\n").collect()
    });
    assert!(lost.out.contains("NOT FAITHFUL") && lost.out.contains("lost"), "{}", lost.out);
}

/// A square plate whose round hole nearly touches its outline: elements are small there, and there only.
#[test]
fn where_a_hole_nearly_touches_the_outline_elements_are_small() {
    let out = Out::new();
    let plate = plate_with_a_hole_near_its_side(96, 0.06);
    let (ended, report) = out.run_bytes_with("plate.obj", plate.as_bytes(), &["-q", "--size", "1"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(report.hand_off.is_some_and(|h| (1..=16).contains(&h.narrow_places)), "a few places");
    let folder = out.of("plate.obj");
    // The known-bad twin: edges of the same length everywhere.
    let bad = whole_but_by(&folder, |text| text.replace("Background Field", "// Background Field"));
    assert!(bad.out.contains("faithful, not fine"), "{}", bad.out);
}

/// A square of side 10 with a hole of radius 1 so near to one of its sides, in `n` rays, as OBJ.
fn plate_with_a_hole_near_its_side(n: u32, gap: f64) -> String {
    let centre = [0.0, gap + 1.0 - 5.0];
    let mut text = String::new();
    for j in 0..n {
        let (sin, cos) = (TAU * f64::from(j) / f64::from(n)).sin_cos();
        text += &format!("v {} {} 0\n", centre[0] + cos, centre[1] + sin);
        // As far along the ray as the square reaches.
        let reach =
            |at: f64, along: f64| if along == 0.0 { f64::INFINITY } else { (5.0 * along.signum() - at) / along };
        let far = reach(centre[0], cos).min(reach(centre[1], sin));
        text += &format!("v {} {} 0\n", centre[0] + far * cos, centre[1] + far * sin);
    }
    for j in 0..n {
        let (a, b) = (2 * j + 1, 2 * ((j + 1) % n) + 1);
        text += &format!("f {a} {} {}\nf {a} {} {b}\n", a + 1, b + 1, b + 1);
    }
    text
}

/// The tip of a needle, around which no edge goes, is meshed all the same.
#[test]
fn the_tip_of_a_needle_is_kept() {
    let out = Out::new();
    let (ended, report) = out.run_bytes_with("needle.obj", needle(40, 16.0).as_bytes(), &["-q"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let folder = out.of("needle.obj");
    assert_eq!(report.hand_off.map(|h| h.spikes), Some(3), "one for each halving");
    // The known-bad twin: edges of the same length everywhere.
    let lost = whole_but_by(&folder, |text| text.replace("Background Field", "// Background Field"));
    assert!(lost.out.contains("a part of the surface is lost") && lost.out.contains("16.0"), "{}", lost.out);
}

/// A closed cone of `n` facets over a circle of radius 1, as OBJ.
fn needle(n: u32, height: f64) -> String {
    let angle = |i: u32| TAU * f64::from(i) / f64::from(n);
    let mut text = format!("v 0 0 0\nv 0 0 {height}\n");
    (0..n).for_each(|i| text += &format!("v {} {} 0\n", angle(i).cos(), angle(i).sin()));
    for i in 0..n {
        let (a, b) = (i + 3, (i + 1) % n + 3);
        text += &format!("f 1 {b} {a}\nf 2 {a} {b}\n");
    }
    text
}

/// A cylinder of radius 1 and height 8 whose wall is one row of `n` facets, with round caps of `rows` rows, as OBJ.
fn pill(n: u32, rows: u32) -> String {
    let angle = |i: u32| TAU * f64::from(i) / f64::from(n);
    let lift = |j: u32| TAU / 4.0 * f64::from(j) / f64::from(rows);
    let (mut text, count) = (String::new(), 2 * rows);
    let mut ring = |r: f64, z: f64| {
        (0..n).for_each(|i| text += &format!("v {} {} {z}\n", r * angle(i).cos(), r * angle(i).sin()));
    };
    (0..rows).rev().for_each(|j| ring(lift(j).cos(), -4.0 - lift(j).sin()));
    (0..rows).for_each(|j| ring(lift(j).cos(), 4.0 + lift(j).sin()));
    text += "v 0 0 -5\nv 0 0 5\n";
    let at = |row: u32, i: u32| row * n + i % n + 1;
    for i in 0..n {
        for row in 0..count - 1 {
            let [a, b, c, d] = [at(row, i), at(row, i + 1), at(row + 1, i + 1), at(row + 1, i)];
            text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
        }
        let (bottom, top) = (count * n + 1, count * n + 2);
        text += &format!(
            "f {bottom} {} {}\nf {top} {} {}\n",
            at(0, i + 1),
            at(0, i),
            at(count - 1, i),
            at(count - 1, i + 1)
        );
    }
    text
}

/// Elements of six nodes, as remesh.geo recommends them, are valid; without its second option some are inverted.
#[test]
fn curved_elements_are_unfolded() {
    let path = root().join("../shared/meshes/rocker_arm_g1.obj");
    if !path.exists() {
        println!("skipped: there is no {}", path.display());
        return;
    }
    let out = Out::new();
    assert_eq!(out.run(&[&path], &["-q", "--size", "0.03"]).code, Some(0));
    let folder = out.of("rocker_arm_g1.obj");
    let curved = |text: String| text.replace("// Mesh.ElementOrder", "Mesh.ElementOrder");
    gmsh(&folder, |text| curved(text).replace("// Mesh.HighOrderOptimize", "Mesh.HighOrderOptimize"));
    let unfolded = check_mesh(&folder, &["--min-gamma", "0"]);
    assert!(unfolded.out.contains("of six nodes") && unfolded.code == Some(0), "{}{}", unfolded.out, unfolded.err);
    gmsh(&folder, curved);
    let folded = check_mesh(&folder, &["--min-gamma", "0"]);
    assert_eq!(folded.code, Some(1), "{}", folded.out);
    assert!(folded.out.contains("elements of six nodes are inverted"), "{}", folded.out);
}
