//! `planish run` and `planish info`: exit codes, settings, what is skipped, what is refused.

use crate::support::{Out, fixture, planish};
use planish::outcome::{Code, Status};
use planish::report::Report;
use std::path::Path;

/// The files of a certified result, in their order.
const ALL_FILES: [&str; 6] = ["surface.vtu", "param.vtu", "seams.vtp", "atlas.vtm", "atlas.msh", "remesh.geo"];

/// A refused input has its report; its place and remedy are told.
#[test]
fn refusals_say_where_and_what_to_do() {
    let binary = std::fs::read(fixture("disk.stl")).expect("a fixture");
    let mut nan = binary.clone();
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut empty = binary[..84].to_vec();
    empty[80..].fill(0);
    let cases: [(&str, &[u8], Code, Option<&str>); 12] = [
        ("empty.stl", b"", Code::EmptyFile, Some("byte 0")),
        ("zero.stl", &empty, Code::NoTriangles, None),
        ("cut.stl", &binary[..1000], Code::CountMismatch, Some("byte 80")),
        ("nan.stl", &nan, Code::NotFinite, Some("byte 134")),
        ("inf.obj", b"v 0 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", Code::NotFinite, Some("line 2")),
        ("index.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", Code::Malformed, Some("line 4")),
        ("word.stl", b"solid\nfacet normal 0 0 1\nouter loop\nvertex a 0 0\n", Code::Malformed, Some("line 4")),
        ("flat.obj", b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", Code::OnlyDegenerate, None),
        ("part.xyz", b"1 2 3", Code::UnknownExtension, Some("file name")),
        ("part.meshb", b"MESH", Code::UnsupportedFormat, Some("file name")),
        ("part.off", b"OFF BINARY\n", Code::UnsupportedFormat, Some("line 1")),
        ("part.mtl", b"newmtl a\n", Code::NotAMesh, Some("file name")),
    ];
    for (name, bytes, code, place) in cases {
        let out = Out::new();
        let (ended, report) = out.run_bytes(name, bytes);
        let reason = report.reason.expect("a reason");
        assert_eq!((ended.code, report.status, reason.code), (Some(1), Status::Refused, code), "{name}");
        assert_eq!(reason.location.as_deref(), place, "{name}: {}", reason.message);
        assert!(ended.err.contains(&reason.message) && ended.err.contains(name), "{}", ended.err);
        assert_eq!(std::fs::read_dir(out.of(name)).expect("a folder").count(), 1, "nothing but the report");
        assert!(report.outputs.is_empty());
    }
}

/// What is not as it should be, but read all the same, is told on the terminal and in the report; of volumes alone it is
/// told what they are.
#[test]
fn remarks_and_contents_reach_terminal_and_report() {
    let mut appended = std::fs::read(fixture("disk.stl")).expect("a fixture");
    appended.extend(b"some program's own data");
    let (ended, report) = Out::new().run_bytes("appended.stl", &appended);
    let remarks = report.content.expect("read").remarks;
    assert_eq!((ended.code, report.status, remarks.len()), (Some(0), Status::Certified, 1));
    assert!(remarks[0].starts_with("23 bytes follow") && ended.err.contains(&remarks[0]), "{}", ended.err);
    let tetrahedron = b"MeshVersionFormatted 2\nDimension 3\nVertices\n4\n0 0 0 1\n1 0 0 1\n0 1 0 1\n0 0 1 1\n\
                        Tetrahedra\n1\n1 2 3 4 1\nEnd\n";
    let (ended, report) = Out::new().run_bytes("volume.mesh", tetrahedron);
    assert_eq!(report.reason.expect("a reason").code, Code::NoTriangles);
    assert_eq!(report.content.expect("it was read to its end").skipped["tetrahedron"], 1);
    assert!(ended.err.contains("only 1 tetrahedron; their surface must be saved"), "{}", ended.err);
}

/// A scanner's invalid points do no harm where no triangle has them.
#[test]
fn points_without_triangles_are_counted_whatever_their_coordinates_are() {
    let file = "v nan nan nan\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 inf\nv nan nan nan\nf 2 3 4\n";
    let (ended, report) = Out::new().run_bytes("scan.obj", file.as_bytes());
    assert_eq!((ended.code, report.status), (Some(0), Status::Certified), "{}", ended.err);
    let repairs = report.repairs.expect("repaired");
    assert_eq!((repairs.unreferenced_points, repairs.welded), (3, 0));
}

/// As one chart, the area ratio of this finger would be e^88.
#[test]
fn a_chart_beyond_double_precision_is_split_until_it_maps() {
    let finger = planish_core::shapes::finger(12, 22);
    let mut text: String = finger.points().iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    text.extend(finger.triangles().iter().rev().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)));
    for limit in ["1e6", "100"] {
        let (ended, report) = Out::new().run_bytes_with("finger.obj", text.as_bytes(), &["--max-area-ratio", limit]);
        assert_eq!((ended.code, report.status), (Some(0), Status::Certified), "{}", ended.err);
        let limit: f64 = limit.parse().expect("a number");
        assert!(report.charts.len() > 2 && report.charts.iter().all(|c| c.distortion.area_ratio <= limit));
    }
}

/// A polygon that crosses itself is cut somehow, which may fold; a concave one is cut as it should be.
#[test]
fn polygons_that_may_fold_are_counted_and_told() {
    let corners = "v 0 0 0\nv 2 1 0\nv 2 0 0\nv 0 1.5 0\nv 1 3 1\n";
    let faces = [("f 1 2 3 4\nf 3 4 5\n", 1), ("f 1 3 2 4\nf 4 2 5\n", 0)];
    for (faces, doubtful) in faces {
        let text = [corners, faces].concat();
        let (ended, report) = Out::new().run_bytes_with("a.obj", text.as_bytes(), &["-v"]);
        let notes = report.content.expect("read");
        assert_eq!((notes.polygons, notes.polygons_doubtful), (1, doubtful));
        assert_eq!(ended.err.matches("may fold; export the surface as triangles").count(), doubtful, "{}", ended.err);
    }
}

#[test]
fn limits_of_charts_are_kept_and_told() {
    let out = Out::new();
    let args = ["--feature-angle", "off", "--strict-disks", "--max-triangles", "200"];
    assert_eq!(out.run(&[&fixture("sphere.stl")], &args).code, Some(0));
    let report = out.report("sphere.stl");
    assert!(report.charts.len() >= 3 && report.charts.iter().all(|c| c.triangles <= 200 && c.loops == 1));
    let settings = &report.settings;
    assert_eq!((settings.feature_angle, settings.strict_disks, settings.max_triangles), (None, true, Some(200)));
    for wrong in
        [["--feature-angle", "180"], ["--max-area-ratio", "1"], ["--max-triangles", "0"], ["--feature-angle", "x"]]
    {
        assert_eq!(out.run(&[&fixture("sphere.stl")], &wrong).code, Some(2), "{wrong:?}");
    }
}

#[test]
fn one_bad_input_does_not_keep_the_others() {
    let out = Out::new();
    let ended = out.run(&[Path::new("no/such/file.stl"), &fixture("disk.stl")], &[]);
    assert_eq!(ended.code, Some(1));
    assert_eq!(out.report("file.stl").reason.expect("a reason").code, Code::Unreadable);
    assert_eq!(out.report("disk.stl").status, Status::Certified);
    assert!(ended.out.contains("disk.stl") && ended.out.contains("certified"), "{}", ended.out);
}

#[test]
fn wrong_usage_is_exit_code_2_and_does_nothing() {
    let out = Out::new();
    let disk = fixture("disk.stl");
    let twin = tempfile::tempdir().expect("a folder");
    let copy = twin.path().join("disk.stl");
    std::fs::copy(&disk, &copy).expect("copied");
    assert_eq!(out.run(&[&disk, &copy], &[]).code, Some(2), "two inputs of the same name");
    let wrong = [
        ["--order", "3"],
        ["--weld", "0.5"],
        ["--weld", "nan"],
        ["--size", "0"],
        ["--hand-off", "netgen"],
        ["--hand-off", "gmsh,"],
        ["--also", "stl"],
        ["--config", "no/such.toml"],
        ["--jobs", "0"],
        ["--memory", "1MiB"],
        ["--memory", "much"],
    ];
    for extra in wrong {
        assert_eq!(out.run(&[&disk], &extra).code, Some(2), "{extra:?}");
    }
    assert_eq!(out.run(&[&disk], &["--no-such-option"]).code, Some(2));
    assert_eq!(planish(["run".as_ref(), disk.as_os_str()]).code, Some(2), "no output folder");
    assert_eq!(planish(["run", "--out", "x"]).code, Some(2), "no input");
    assert_eq!(planish(["run", "no/such/..", "--out", "x"]).code, Some(2), "no name");
    let beside = [copy.as_os_str(), "--out".as_ref(), twin.path().as_os_str()];
    let ended = planish(["run".as_ref()].into_iter().chain(beside));
    assert!(ended.code == Some(2) && copy.is_file(), "the input lies in the output folder: {}", ended.err);
    let empty = tempfile::tempdir().expect("a folder");
    assert_eq!(out.run(&[empty.path()], &[]).code, Some(2), "a folder without meshes");
    assert_eq!(std::fs::read_dir(out.path()).expect("a folder").count(), 0, "nothing was written");
}

#[test]
fn what_is_up_to_date_is_skipped_unless_forced_or_changed() {
    let out = Out::new();
    let disk = fixture("disk.stl");
    assert_eq!(out.run(&[&disk], &[]).code, Some(0));
    let report = out.of("disk.stl").join("report.json");
    let written = || std::fs::metadata(&report).and_then(|m| m.modified()).expect("a time");
    let first = written();
    let again = out.run(&[&disk], &[]);
    assert_eq!((again.code, written()), (Some(0), first));
    assert!(again.out.contains("up to date"), "{}", again.out);
    out.run(&[&disk], &["--force"]);
    let forced = written();
    assert!(forced > first);
    out.run(&[&disk], &["--order", "1"]);
    let linear = written();
    assert!(linear > forced, "other settings");
    std::fs::remove_file(out.of("disk.stl").join("param.vtu")).expect("removed");
    out.run(&[&disk], &["--order", "1"]);
    assert!(written() > linear, "a file is missing");
    // A refusal is remembered, too, with its exit code.
    let flat = tempfile::tempdir().expect("a folder");
    let flat = flat.path().join("flat.obj");
    std::fs::write(&flat, "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n").expect("written");
    assert_eq!(out.run(&[&flat], &[]).code, Some(1));
    let again = out.run(&[&flat], &[]);
    assert_eq!(again.code, Some(1));
    assert!(again.out.contains("refused (up to date)"), "{}", again.out);
}

#[test]
fn results_are_the_same_bytes_every_time() {
    let (first, second) = (Out::new(), Out::new());
    for name in ["bent_disk.stl", "disk_with_holes.stl", "sphere.stl"] {
        first.run(&[&fixture(name)], &[]);
        second.run(&[&fixture(name)], &["-vv", "--log", "json", "--force"]);
        assert_eq!(first.timeless(name), second.timeless(name));
        for output in first.report(name).outputs {
            assert!(first.read(name, &output.file) == second.read(name, &output.file), "{name}/{}", output.file);
        }
    }
}

/// Threads, turns and budgets decide when something is done, never what comes out.
#[test]
fn jobs_and_memory_do_not_change_a_byte() {
    let outs = [(1, "16MiB"), (5, "16MiB"), (3, "4GiB")].map(|(jobs, memory)| {
        let out = Out::new();
        let names = ["bent_disk.stl", "plate_genus9.stl", "sphere.stl", "finger.obj"];
        let inputs = names.map(fixture);
        let inputs: Vec<&Path> = inputs.iter().map(|p| p.as_path()).collect();
        let extra = ["--jobs", &jobs.to_string(), "--memory", memory, "--max-triangles", "900"];
        assert_eq!(out.run(&inputs, &extra).code, Some(0));
        names.map(|name| {
            let report = out.report(name);
            let hashes: Vec<String> = report.outputs.iter().map(|o| o.blake3.clone()).collect();
            assert!(name != "bent_disk.stl" || report.charts.len() > 7, "many charts on their way at once");
            (out.timeless(name), hashes)
        })
    });
    assert!(outs[0] == outs[1] && outs[0] == outs[2]);
}

#[test]
fn order_1_writes_the_same_files_with_straight_triangles() {
    let out = Out::new();
    let inputs = ["disk_with_holes.stl", "finger.obj"].map(fixture);
    assert_eq!(
        out.run(&inputs.each_ref().map(|p| p.as_path()), &["--order", "1", "--boundary", "circle"]).code,
        Some(0)
    );
    let files = |report: &Report| report.outputs.iter().map(|o| o.file.clone()).collect::<Vec<_>>();
    // A map stretches, none better is found, and edges are shorter than 1: Gmsh gets the atlas in a larger unit, too.
    let finger = out.report("finger.obj");
    let expected = [&ALL_FILES[..], &["atlas-enlarged.msh"]].concat();
    assert_eq!((files(&finger), finger.settings.order), (expected.iter().map(|f| f.to_string()).collect(), 1));
    assert!(finger.hand_off.is_some_and(|h| h.enlarged > 1.0 && h.adapted_charts == [2]));
    // What is nearly a plane is its own map, and needs none of that.
    let report = out.report("disk_with_holes.stl");
    assert_eq!((files(&report), report.settings.order), (ALL_FILES.map(str::to_owned).to_vec(), 1));
    assert!(report.hand_off.is_some_and(|h| h.enlarged == 1.0 && h.natural_charts == [0]));
    let chart = &report.charts[0];
    assert_eq!((&chart.quadratic, &chart.untangle, chart.certificate.by_exact), (&None, &None, 0));
    let grid = planish::formats::vtu::read(&out.read("disk_with_holes.stl", "surface.vtu")).expect("readable");
    for cell in &grid.cells {
        for k in 0..3 {
            let [a, m, b] = [cell[k], cell[3 + k], cell[(k + 1) % 3]].map(|n| grid.uv[n as usize]);
            assert_eq!([2.0 * m[0], 2.0 * m[1]], [a[0] + b[0], a[1] + b[1]], "mid nodes lie on chords, exactly");
        }
    }
    assert_eq!(planish(["check".as_ref(), out.of("disk_with_holes.stl").as_os_str()]).code, Some(0));
}

#[test]
fn the_hand_off_can_be_left_out_and_its_size_chosen() {
    let (out, disk) = (Out::new(), fixture("disk.stl"));
    assert_eq!(out.run(&[&disk], &["--hand-off", "none"]).code, Some(0));
    let report = out.report("disk.stl");
    let files: Vec<_> = report.outputs.iter().map(|o| o.file.as_str()).collect();
    assert_eq!((files, report.hand_off), (ALL_FILES[..4].to_vec(), None));
    assert_eq!(planish(["check".as_ref(), out.of("disk.stl").as_os_str()]).code, Some(0));
    out.run(&[&disk], &[]);
    let default = out.report("disk.stl").hand_off.expect("a hand-off");
    assert_eq!((default.sub_triangles, default.refined, default.failure), (4 * 384, 0, None));
    let diagonal = 0.02 * (8.0_f64 + 0.3).sqrt();
    assert!(default.size > 0.9 * diagonal && default.size < 1.1 * diagonal, "{}", default.size);
    out.run(&[&disk], &["--size", "0.25"]);
    assert_eq!(out.report("disk.stl").hand_off.expect("a hand-off").size, 0.25);
    let script = String::from_utf8(out.read("disk.stl", "remesh.geo")).expect("UTF-8");
    assert!(script.contains("size = {0.25,"), "{script}");
    // A result without its hand-off is not complete.
    std::fs::remove_file(out.of("disk.stl").join("remesh.geo")).expect("removed");
    let ended = planish(["check".as_ref(), out.of("disk.stl").as_os_str()]);
    assert!(ended.code == Some(1) && ended.err.contains("remesh.geo"), "{}", ended.err);
    // Nor is one whose script merges a file that is not listed.
    out.run(&[&disk], &["--force"]);
    let mut report = out.report("disk.stl");
    report.hand_off.iter_mut().for_each(|h| h.enlarged = 8.0);
    std::fs::write(out.of("disk.stl").join("report.json"), report.to_json().expect("JSON")).expect("written");
    let ended = planish(["check".as_ref(), out.of("disk.stl").as_os_str()]);
    assert!(ended.code == Some(1) && ended.err.contains("atlas-enlarged.msh: is not listed"), "{}", ended.err);
}

/// What is asked for in addition is part of what decides a result.
#[test]
fn files_for_other_programs_are_written_when_they_are_asked_for() {
    let (out, disk) = (Out::new(), fixture("disk.stl"));
    let files = || out.report("disk.stl").outputs.into_iter().map(|o| o.file).collect::<Vec<_>>();
    out.run(&[&disk], &["--hand-off", "none"]);
    assert_eq!(files(), ALL_FILES[..4]);
    assert_eq!(out.run(&[&disk], &["--hand-off", "none", "--also", "glb,obj,welded"]).code, Some(0));
    assert_eq!(files(), [&ALL_FILES[..4], &["surface.obj", "surface.glb", "welded.vtu"]].concat());
    let again = out.run(&[&disk], &["--hand-off", "none", "--also", "welded,obj,glb"]);
    assert!(again.out.contains("up to date"), "their order means nothing: {}", again.out);
    let before = out.read("disk.stl", "surface.glb");
    out.run(&[&disk], &["--hand-off", "none", "--also", "obj,glb,welded", "--force"]);
    assert!(before == out.read("disk.stl", "surface.glb"), "the same bytes every time");
    // Each of them belongs to the result.
    std::fs::write(out.of("disk.stl").join("surface.obj"), "v 0 0 0\n").expect("written");
    let ended = planish(["check".as_ref(), out.of("disk.stl").as_os_str()]);
    assert!(ended.code == Some(1) && ended.err.contains("surface.obj"), "{}", ended.err);
    // One that is not asked for any more goes.
    out.run(&[&disk], &["--hand-off", "none", "--also", "obj"]);
    assert!(!out.of("disk.stl").join("welded.vtu").exists() && out.of("disk.stl").join("surface.obj").exists());
}

#[test]
fn the_settings_file_is_read_and_options_win() {
    let (out, folder) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let config = folder.path().join("planish.toml");
    let text = format!("out = {:?}\norder = 1\nquiet = true\n", out.path());
    std::fs::write(&config, text).expect("written");
    let disk = fixture("disk.stl");
    let args = |extra: &[&str]| {
        let mut all =
            vec!["run".to_owned(), disk.display().to_string(), "--config".to_owned(), config.display().to_string()];
        all.extend(extra.iter().map(ToString::to_string));
        all
    };
    let ended = planish(args(&[]));
    assert_eq!((ended.code, ended.out.as_str(), ended.err.as_str()), (Some(0), "", ""), "quiet");
    assert_eq!(out.report("disk.stl").settings.order, 1);
    assert_eq!(planish(args(&["--order", "2"])).code, Some(0));
    assert_eq!(out.report("disk.stl").settings.order, 2);
    std::fs::write(&config, "ordre = 1\n").expect("written");
    let ended = planish(args(&[]));
    assert!(ended.code == Some(2) && ended.err.contains("ordre"), "{}", ended.err);
}

#[test]
fn weld_decides_about_cracks() {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture("cracked_patch.obj")], &[]).code, Some(0));
    assert_eq!(out.report("cracked_patch.obj").repairs.expect("repairs").cracks_closed, 8);
    assert_eq!(out.report("cracked_patch.obj").charts.len(), 1);
    assert_eq!(out.run(&[&fixture("cracked_patch.obj")], &["--weld", "0"]).code, Some(0));
    assert_eq!(out.report("cracked_patch.obj").charts.len(), 2);
    let surface = out.report("cracked_patch.obj").surface.expect("a surface");
    assert_eq!(surface.repaired.counts.components, 2);
}

#[test]
fn logs_are_lines_of_json_when_asked_for() {
    let out = Out::new();
    let ended = out.run(&[&fixture("disk.stl")], &["-v", "--log", "json"]);
    let lines: Vec<serde_json::Value> =
        ended.err.lines().map(|l| serde_json::from_str(l).expect("a JSON object per line")).collect();
    let spans = |what: &str| {
        let line = lines.iter().find(|l| l["fields"]["message"] == what);
        let spans = line.and_then(|l| l["spans"].as_array()).cloned().unwrap_or_default();
        spans.iter().map(|s| s["input"].as_str().or(s["stage"].as_str()).unwrap_or("?").to_owned()).collect::<Vec<_>>()
    };
    assert_eq!(
        (spans("begins"), spans("ends")),
        (vec!["disk.stl".to_owned()], vec!["disk.stl".to_owned(), "write".to_owned()])
    );
    assert_eq!(out.run(&[&fixture("disk.stl")], &["--force"]).err, "", "silent without -v");
}

#[test]
fn info_tells_raw_and_repaired_counts() {
    let ended = planish(["info".as_ref(), "--json".as_ref(), fixture("cracked_patch.obj").as_os_str()]);
    let answer: serde_json::Value = serde_json::from_str(&ended.out).expect("JSON");
    assert_eq!(answer["surface"]["raw"]["components"], 2);
    assert_eq!(answer["surface"]["repaired"]["components"], 1);
    assert_eq!(answer["repairs"]["cracks_closed"], 8);
    let text = planish(["info".as_ref(), fixture("plate_genus9.stl").as_os_str()]);
    assert!(text.code == Some(0) && text.out.contains("genus 9"), "{}", text.out);
    let refused = planish(["info", "no/such/file.stl"]);
    assert!(refused.code == Some(1) && refused.out.contains("unreadable"), "{}", refused.out);
}

#[test]
fn an_extension_that_lies_is_seen_through() {
    let out = Out::new();
    for (from, name, format) in [
        ("disk.stl", "a.obj", "STL, binary"),
        ("floater_five.obj", "b.stl", "OBJ"),
        ("floater_five.obj", "c.vtu", "OBJ"),
        ("disk.stl", "d.msh", "STL, binary"),
    ] {
        let bytes = std::fs::read(fixture(from)).expect("a fixture");
        let (ended, report) = out.run_bytes(name, &bytes);
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.err);
        assert_eq!(report.content.expect("it was read").format, format, "{name}");
    }
}

/// A cup as CAD exports it: its wall is one row of facets, closed by a cone.
fn cup() -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let around = 36;
    let circle = |z: f64| {
        (0..around).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            [angle.cos(), angle.sin(), z]
        })
    };
    let points = circle(0.0).chain(circle(2.5)).chain([[0.0, 0.0, 3.2]]).collect();
    let facets = (0..around).flat_map(|k| {
        let next = (k + 1) % around;
        [[k, next, around + next], [k, around + next, around + k], [around + k, around + next, 2 * around]]
    });
    (points, facets.collect())
}

/// Where maps need more triangles they get some, the report tells how many, and from the files alone the input's triangles are
/// found again.
#[test]
fn refined_triangles_tell_whose_parts_they_are() {
    use std::fmt::Write;
    let (points, facets) = cup();
    let mut text = String::new();
    points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").expect("in memory"));
    facets.iter().for_each(|[a, b, c]| writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).expect("in memory"));
    let out = Out::new();
    let off = ["--feature-angle", "off"];
    let (_, coarse) = out.run_bytes_with("cup.obj", text.as_bytes(), &[&off[..], &["--refine", "off"]].concat());
    let (_, fine) = out.run_bytes_with("cup.obj", text.as_bytes(), &off);
    let told = [&coarse, &fine].map(|report| report.refinement.clone().expect("told"));
    assert_eq!((coarse.settings.refine, fine.settings.refine), (None, Some(4)));
    assert_eq!((told[0].charts, told[0].triangles_after, told[0].places.len()), (0, 108, 0));
    assert!(told[1].charts == 1 && told[1].triangles_after > 200 && !told[1].places.is_empty());
    let asked = told[1].triangles_after - told[1].triangles_before - told[1].by_closure;
    assert!(told[1].triangles_before + asked <= 4 * told[1].triangles_before);
    let invalid =
        |report: &Report| report.charts.iter().filter_map(|c| c.quadratic.as_ref()).map(|q| q.invalid).sum::<usize>();
    assert!(invalid(&coarse) > 36 && invalid(&fine) == 0);

    let grid = planish::formats::vtu::read(&std::fs::read(out.of("cup.obj").join("surface.vtu")).expect("written"));
    let grid = grid.expect("readable");
    assert_eq!(grid.cells.len(), told[1].triangles_after);
    for (number, facet) in facets.iter().enumerate() {
        let mut corners = Vec::new();
        let mut area = [0.0; 3];
        for (cell, _) in grid.cells.iter().zip(&grid.triangle).filter(|(_, source)| **source as usize == number) {
            corners.extend(cell[..3].iter().map(|n| grid.vertex[*n as usize]).filter(|v| *v >= 0));
            let [p, q, r] = [0, 1, 2].map(|k| grid.points[cell[k] as usize]);
            let (a, b) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
            (0..3).for_each(|k| area[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
        }
        corners.sort_unstable();
        corners.dedup();
        let mut expected = facet.map(|v| v as i32);
        expected.sort_unstable();
        assert_eq!(corners, expected, "triangle {number}");
        let [p, q, r] = facet.map(|v| points[v as usize]);
        let (a, b) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
        let whole = [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
        assert!((0..3).all(|k| (area[k] - whole[k]).abs() < 1e-12), "triangle {number}: {area:?} {whole:?}");
    }
    for wrong in ["0", "1001", "x", "-1"] {
        assert_eq!(out.run(&[&fixture("sphere.stl")], &[&format!("--refine={wrong}")]).code, Some(2), "{wrong}");
    }
}
