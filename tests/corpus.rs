//! Real files, where they are at hand: scans, terrains, CAD exports, and files that are broken. They lie beside the
//! repository (`../shared`), are under licences of their own, and are no part of it; without them these tests say
//! so and pass.

use crate::interop::assert_vtk_agrees;
use crate::interop::remesh::assert_gmsh_remeshes;
use crate::legality::assert_legal;
use crate::support::{Out, planish, root};
use planish::formats::{Kind, kind};
use planish::outcome::{Code, Status};
use planish::report::Report;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A folder of real files.
pub fn shared(folder: &str) -> Option<PathBuf> {
    let path = root().parent()?.join("shared").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    eprintln!("skipped: {} is not at hand", path.display());
    None
}

/// The rows of a manifest: file, and its columns by name.
pub fn manifest(folder: &Path) -> Vec<BTreeMap<String, String>> {
    let text = std::fs::read_to_string(folder.join("MANIFEST.tsv")).expect("a manifest");
    let mut lines = text.lines().map(|l| l.split('\t').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().expect("a header");
    lines.map(|row| names.iter().cloned().zip(row).collect()).collect()
}

fn run_all(inputs: &[PathBuf], extra: &[&str]) -> (Out, Vec<(String, Report)>) {
    let out = Out::new();
    let paths: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
    out.run(&paths, &[&["-q"], extra].concat());
    let name = |p: &PathBuf| p.file_name().expect("a name").to_string_lossy().into_owned();
    let reports = inputs.iter().map(name).map(|n| (n.clone(), out.report(&n))).collect();
    (out, reports)
}

/// Runs inputs without features; all must be certified, proven again, legal, and within the bound of the area ratio.
fn certified(inputs: &[PathBuf], extra: &[&str]) -> (Out, Vec<(String, Report)>) {
    let (out, reports) = run_all(inputs, &[&["--feature-angle", "off"], extra].concat());
    for (name, report) in &reports {
        assert_eq!(report.status, Status::Certified, "{name}: {:?}", report.reason);
        let checked = planish(["check".as_ref(), out.of(name).as_os_str()]);
        assert_eq!(checked.code, Some(0), "{name}: {}", checked.err);
        assert_legal(&out.of(name));
        for chart in &report.charts {
            let within = chart.distortion.area_ratio <= 1e6 || chart.triangles == 1;
            assert!(within, "{name}: {:?}", chart.distortion);
        }
    }
    (out, reports)
}

#[test]
fn real_disks_are_one_chart_close_to_harmonic_and_opened_by_vtk() {
    let (Some(meshes), Some(anchors)) = (shared("meshes"), shared("anchors/stl")) else { return };
    let mut inputs: Vec<PathBuf> =
        ["face_bff.obj", "mountain.obj", "terrain_gmsh.stl", "beetle_11_holes.obj"].map(|n| meshes.join(n)).to_vec();
    inputs.extend(["patch_10k.stl", "patch_10ks.stl", "patch_100k.stl", "patch_100ks.stl"].map(|n| anchors.join(n)));
    let (out, reports) = certified(&inputs, &[]);
    for (name, report) in &reports {
        let [chart] = &report.charts[..] else { panic!("{name}: {} charts", report.charts.len()) };
        let repaired = &report.surface.as_ref().expect("a surface").repaired.counts;
        let ears = report.decomposition.expect("told").ears_split;
        assert_eq!((chart.triangles, chart.loops), (repaired.triangles + 2 * ears, repaired.boundary_loops), "{name}");
        // The harmonic energy is a lower bound of the certified map's, which stays close to it.
        let untangle = chart.untangle.as_ref().expect("quadratic");
        let few = ["none", "patch"].contains(&untangle.method.as_str());
        assert!(few, "{name}: few are invalid, few move: {untangle:?}");
        assert!((-1e-12..1e-3).contains(&untangle.energy_excess), "{name}: {}", untangle.energy_excess);
    }
    let folders: Vec<PathBuf> = reports.iter().map(|(name, _)| out.of(name)).collect();
    assert_vtk_agrees(&folders);
    assert_gmsh_remeshes(&["terrain_gmsh.stl", "patch_10k.stl"].map(|n| out.of(n)), &[]);
}

/// The counts follow the shape: raw or cleaned, coarse or fine.
#[test]
fn few_charts_carry_each_shape_and_gmsh_remeshes_through_them() {
    let (Some(meshes), Some(anchors)) = (shared("meshes"), shared("anchors/stl")) else { return };
    let kinds = ["10k", "10ks", "100k", "100ks"];
    let mut inputs: Vec<PathBuf> =
        ["bump", "plate9"].iter().flat_map(|s| kinds.map(|k| anchors.join(format!("{s}_{k}.stl")))).collect();
    let scans = [
        ("max_planck_decimated.obj", 2),
        ("aorta_open_vmtk.stl", 2),
        ("rocker_arm_g1.obj", 2),
        ("cad_gmsh_t13.stl", 4),
        ("aneurysm_gmsh.stl", 2),
        ("bunny_stanford.stl", 2),
        ("airplane_27_holes.obj", 13),
        ("punctured_torus.obj", 3),
    ];
    inputs.extend(scans.map(|s| meshes.join(s.0)));
    let (out, reports) = certified(&inputs, &[]);
    let charts = |name: &str| reports.iter().find(|r| r.0 == name).expect("run").1.charts.len();
    for (shape, most) in [("bump", 2), ("plate9", 4)] {
        let counts = kinds.map(|k| charts(&format!("{shape}_{k}.stl")));
        let (least, largest) = (counts.iter().min().expect("four"), counts.iter().max().expect("four"));
        assert!(*largest <= most && largest - least <= 1, "{shape}: {counts:?}");
    }
    for (name, most) in scans {
        assert!(charts(name) <= most, "{name}: {} charts", charts(name));
    }
    let remeshed = ["rocker_arm_g1.obj", "aneurysm_gmsh.stl", "plate9_10k.stl", "bump_10k.stl", "cad_gmsh_t13.stl"];
    assert_gmsh_remeshes(&remeshed.map(|n| out.of(n)), &[]);
    assert_vtk_agrees(&["plate9_10k.stl", "aneurysm_gmsh.stl"].map(|n| out.of(n)));
}

#[test]
fn strict_disks_of_a_plate_with_nine_holes_are_few() {
    let Some(anchors) = shared("anchors/stl") else { return };
    let (_, reports) = certified(&["plate9_10k.stl", "plate9_10ks.stl"].map(|n| anchors.join(n)), &["--strict-disks"]);
    for (name, report) in reports {
        assert!(report.charts.len() <= 7 && report.charts.iter().all(|c| c.loops == 1), "{name}");
    }
}

#[test]
fn parts_of_many_holes_and_needles_are_certified() {
    let Some(meshes) = shared("meshes") else { return };
    let smooth = ["soccerball_g31.obj", "cad_rear_case.stl"].map(|n| meshes.join(n));
    certified(&smooth, &[]);
    let sharp = ["cad_gmsh_t13.stl", "cad_fixture_vtk.stl", "cad_box_multi.stl", "cad_imu_adis16480.stl"];
    let (out, reports) = run_all(&sharp.map(|n| meshes.join(n)), &[]);
    for (name, report) in reports {
        assert_eq!(report.status, Status::Certified, "{name}: {:?}", report.reason);
        assert_eq!(planish(["check".as_ref(), out.of(&name).as_os_str()]).code, Some(0), "{name}");
        assert_legal(&out.of(&name));
        assert!(report.decomposition.is_some_and(|d| d.feature_edges > 100), "{name}");
    }
}

#[test]
fn a_cracked_part_is_closed_to_its_true_genus() {
    let Some(meshes) = shared("meshes") else { return };
    let path = meshes.join("cad_featuretype_cracked.stl");
    let answer: serde_json::Value =
        serde_json::from_str(&planish(["info".as_ref(), "--json".as_ref(), path.as_os_str()]).out).expect("JSON");
    let repaired = &answer["surface"]["repaired"];
    assert_eq!((&repaired["genus"], &repaired["boundary_loops"]), (&9.into(), &0.into()));
}

/// What is said of the files that are at hand: format, place and trouble, in the words of the file's format.
const MALFORMED: [(&str, Code, &str); 13] = [
    ("glb_truncated_chunk.glb", Code::Malformed, "glTF, byte 8: the header declares 48 bytes, but there are 47"),
    ("gltf_external_uri.gltf", Code::ForeignFile, "glTF, buffers[0].uri is \"http://example.com/buffer.bin\""),
    ("gltf_missing_external_bin.gltf", Code::MissingFile, "glTF, buffers[0] lies in another file: BoxTextured0.bin"),
    ("msh_empty.msh", Code::NoTriangles, "MSH: the file holds no triangle"),
    ("msh_truncated_derived.msh", Code::CountMismatch, "MSH, line 3179: the file ends in section $Nodes"),
    ("obj_index_out_of_range.obj", Code::Malformed, "OBJ, line 20: a face uses vertex 8, but the file has 6"),
    ("obj_inf_nan.obj", Code::NotFinite, "OBJ, line 1: x of point 0 (from 0) is inf, and triangle 0"),
    ("obj_zero_bytes.obj", Code::EmptyFile, "the file is empty (0 bytes)"),
    ("ply_truncated.ply", Code::CountMismatch, "PLY, line 46: the header declares 12 of element vertex"),
    ("ply_wrong_face_count.ply", Code::CountMismatch, "PLY, byte 2160: the file ends in face 20 (from 0) of 22"),
    ("stl_empty_binary.stl", Code::NoTriangles, "STL: the file holds no triangle"),
    ("stl_wrong_triangle_count.stl", Code::CountMismatch, "STL: the header declares 22 triangles (1184 bytes)"),
    ("vtk_lines_only.vtk", Code::NoTriangles, "VTK: the file holds no surface, only 78 lines"),
];

#[test]
fn broken_files_do_what_the_manifest_says() {
    let Some(malformed) = shared("malformed") else { return };
    for row in manifest(&malformed) {
        let name = &row["file"];
        let readable = matches!(kind(Path::new(name)), Kind::Mesh(_));
        let (_, reports) = run_all(&[malformed.join(name)], &[]);
        let report = &reports[0].1;
        let reason = report.reason.as_ref();
        if let Some((_, code, words)) = MALFORMED.iter().find(|(file, ..)| file == name) {
            let reason = reason.unwrap_or_else(|| panic!("{name} is not refused"));
            assert!(reason.code == *code && reason.message.contains(words), "{name}: {reason:?}");
        }
        if row["kind"].contains("reject") {
            let reason = reason.expect("a refusal");
            let read = [Code::NeedsSplit, Code::Internal].contains(&reason.code);
            assert!(report.status == Status::Refused && !read, "{name}: {reason:?}");
        } else if readable {
            assert!(report.surface.is_some(), "{name} can be read: {reason:?}");
        }
    }
}
