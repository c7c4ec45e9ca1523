//! `planish check`: it proves what is right and finds what was tampered with, even behind new checksums.

use crate::boundaries::obj;
use crate::support::{Ended, Out, fixture, planish};
use planish::formats::vtu::{self, Grid};
use planish::report::{Output, Report, chart_checksum};
use planish_core::certify::PlanarMap;
use planish_core::grid::GridPoint;
use planish_core::measure::distortion::CellFields;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

fn certified(name: &str) -> Out {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture(name)], &["-q"]).code, Some(0));
    out
}

/// A result whose charts are on the disk.
fn certified_on_disk(name: &str) -> Out {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--boundary", "circle"]).code, Some(0));
    out
}

fn check(out: &Out, name: &str) -> Ended {
    planish(["check".as_ref(), out.of(name).as_os_str()])
}

/// Rewrites a file of a result with its grid changed, by other code and in another form than planish writes.
fn rewrite(out: &Out, name: &str, file: &str, change: impl Fn(&mut Grid)) {
    let mut grid = vtu::read(&out.read(name, file)).expect("readable");
    change(&mut grid);
    let cells = grid.cells.len();
    let connectivity = grid.cells.iter().flatten().map(|n| u64::from(*n)).collect();
    let offsets = (1..=cells as u64).map(|i| 6 * i).collect();
    let uv: Vec<f64> = grid.uv.concat();
    let field =
        |name: &str, get: fn(&CellFields) -> f64| array(name, 1, grid.fields.iter().map(get).collect::<Vec<f64>>());
    let cell = vec![
        array("chart", 1, grid.chart.clone()),
        array("triangle", 1, grid.triangle.clone()),
        field("det_min", |f| f.det_min),
        field("det_max", |f| f.det_max),
        field("jacobian_ratio", |f| f.jacobian_ratio),
        field("conformal_distortion", |f| f.conformal_distortion),
        field("area_scale", |f| f.area_scale),
    ];
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        byte_order: ByteOrder::LittleEndian,
        title: String::new(),
        file_path: None,
        data: DataSet::inline(UnstructuredGridPiece {
            points: grid.points.concat().into(),
            cells: Cells {
                cell_verts: VertexNumbers::XML { connectivity, offsets },
                types: vec![CellType::QuadraticTriangle; cells],
            },
            data: Attributes { point: vec![array("uv", 2, uv), array("vertex", 1, grid.vertex.clone())], cell },
        }),
    };
    let mut bytes = Vec::new();
    vtk.try_into_xml_format(Compressor::ZLib, 1).expect("writable").write(&mut bytes).expect("written");
    std::fs::write(out.of(name).join(file), bytes).expect("written");
}

fn array(name: &str, components: u32, data: impl Into<IOBuffer>) -> Attribute {
    Attribute::DataArray(DataArray::new(name, components).with_data(data))
}

/// Makes every checksum of a result anew, as a careful forger would.
fn forge_checksums(out: &Out, name: &str) {
    let mut report: Report = out.report(name);
    let grid = vtu::read(&out.read(name, "surface.vtu")).expect("readable");
    let nodes = grid.uv.iter().map(|uv| GridPoint::exact(*uv).unwrap_or_default()).collect();
    let map = PlanarMap { cells: grid.cells, nodes, hole_centres: vec![] };
    report.charts[0].certificate.checksum = chart_checksum(&map);
    for output in &mut report.outputs {
        *output = Output::of(&output.file, &out.read(name, &output.file));
    }
    std::fs::write(out.of(name).join("report.json"), report.to_json().expect("JSON")).expect("written");
}

#[test]
fn a_folded_triangle_is_named_even_behind_new_checksums() {
    let name = "disk_with_holes.stl";
    for fold in [17, 300, 571] {
        let out = certified(name);
        let cell = vtu::read(&out.read(name, "surface.vtu")).expect("readable").cells[fold];
        // The middle of edge 01 moves onto that of edge 20: the triangle folds.
        let change = |grid: &mut Grid| grid.uv[cell[3] as usize] = grid.uv[cell[5] as usize];
        rewrite(&out, name, "surface.vtu", change);
        rewrite(&out, name, "param.vtu", change);
        forge_checksums(&out, name);
        let ended = check(&out, name);
        assert_eq!(ended.code, Some(1));
        let named = ended.err.lines().find(|l| l.contains("are invalid")).expect("triangles are named");
        let ids: Vec<&str> = named.split([' ', ',', ':']).collect();
        assert!(ids.contains(&fold.to_string().as_str()), "{fold}: {named}");
        assert!(!ended.err.contains("blake3"), "the checksums were made anew: {}", ended.err);
    }
}

#[test]
fn a_moved_point_of_a_hole_or_a_crack_is_found_behind_new_checksums() {
    let name = "disk_with_holes.stl";
    let out = certified_on_disk(name);
    let mut report = out.report(name);
    report.charts[0].certificate.hole_centres[1] = [0.9, 0.0];
    std::fs::write(out.of(name).join("report.json"), report.to_json().expect("JSON")).expect("written");
    let ended = check(&out, name);
    // The map is one-to-one all the same, by its simple loops: but that is not what was certified.
    assert!(ended.code == Some(1) && ended.err.contains("something else than the proof"), "{}", ended.err);

    let out = certified(name);
    let crack = |grid: &mut Grid| {
        // One triangle turns round: its edges no longer run against those of its neighbours.
        grid.cells[100].swap(1, 2);
        grid.cells[100].swap(3, 5);
    };
    rewrite(&out, name, "surface.vtu", crack);
    rewrite(&out, name, "param.vtu", crack);
    forge_checksums(&out, name);
    let ended = check(&out, name);
    assert!(ended.code == Some(1) && ended.err.contains("oriented surface"), "{}", ended.err);
}

#[test]
fn a_boundary_that_covers_itself_is_found_although_every_jacobian_is_positive() {
    let (name, out) = ("ramp.obj", Out::new());
    let ramp = obj(&planish_core::shapes::ramp(24, 20));
    let (ended, report) = out.run_bytes_with(name, &ramp, &["--feature-angle", "off"]);
    assert_eq!((ended.code, report.charts.len()), (Some(0), 1), "{}", ended.err);
    assert_eq!(check(&out, name).code, Some(0));
    // Five sixths of a turn are drawn out to five quarters, or to what is still one turn.
    for (times, is_proven) in [(1.1, true), (1.5, false)] {
        let change = |grid: &mut Grid| {
            let drawn_out = |p: &[f64; 3]| {
                let turn = p[1].atan2(p[0]).rem_euclid(std::f64::consts::TAU);
                let (sin, cos) = (times * turn).sin_cos();
                let radius = 0.45 * p[0].hypot(p[1]);
                GridPoint::vertex([radius * cos, radius * sin]).uv()
            };
            grid.uv = grid.points.iter().map(drawn_out).collect();
        };
        rewrite(&out, name, "surface.vtu", change);
        forge_checksums(&out, name);
        let ended = check(&out, name);
        let is_refused = ended.err.contains("is not shown to be that of a disk with holes");
        assert!(
            ended.code == Some(1) && is_refused != is_proven && !ended.err.contains("are invalid"),
            "{}",
            ended.err
        );
    }
}

#[test]
fn another_argument_than_that_of_the_proof_is_found() {
    let name = "disk_with_holes.stl";
    let out = certified(name);
    reword(&out, name, "\"argument\": \"simple\"", "\"argument\": \"star_shaped\"");
    let ended = check(&out, name);
    assert!(ended.code == Some(1) && ended.err.contains("something else than the proof"), "{}", ended.err);
}

#[test]
fn arcs_that_are_called_a_natural_boundary_are_found() {
    let name = "disk_with_holes.stl";
    let out = certified_on_disk(name);
    reword(&out, name, "\"shape\": \"circle\"", "\"shape\": \"natural\"");
    let ended = check(&out, name);
    assert!(ended.code == Some(1) && ended.err.contains("does not consist of chords"), "{}", ended.err);
}

#[test]
fn what_an_older_planish_made_is_told_and_made_again() {
    let name = "disk.stl";
    let out = certified(name);
    reword(&out, name, "    \"boundary\": \"natural\",\n", "");
    let ended = check(&out, name);
    assert!(ended.code == Some(1) && ended.err.contains("an older planish made it"), "{}", ended.err);
    let again = out.run(&[&fixture(name)], &[]);
    assert!(again.code == Some(0) && !again.out.contains("up to date"), "{}", again.out);
    assert_eq!(check(&out, name).code, Some(0));
}

#[test]
fn a_result_that_cannot_be_handed_to_a_mesher_is_proven_all_the_same() {
    // So small that triangles have no normal in doubles.
    let small = planish_core::shapes::disk(4);
    let points = small.points().iter().map(|p| p.map(|c| c * 1e-120)).collect();
    let small = planish_core::mesh::TriangleSoup::new(points, small.triangles().to_vec()).expect("sound");
    let (name, out) = ("small.obj", Out::new());
    let (ended, report) = out.run_bytes(name, &obj(&small));
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    assert!(report.hand_off.is_some_and(|h| h.failure.is_some()), "the test has lost its sense");
    let ended = check(&out, name);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// Changes the report of a result as text.
fn reword(out: &Out, name: &str, from: &str, to: &str) {
    let text = String::from_utf8(out.read(name, "report.json")).expect("UTF-8");
    assert!(text.contains(from), "{from}");
    std::fs::write(out.of(name).join("report.json"), text.replace(from, to)).expect("written");
}

#[test]
fn what_the_report_claims_must_agree_with_the_proof() {
    let name = "disk_with_holes.stl";
    let lies = [
        ("\"by_exact\": 0", "\"by_exact\": 7"),
        ("\"proven\": true", "\"proven\": false"),
        ("\"outer_arcs\": 68", "\"outer_arcs\": 67"),
        ("\"loops\": 4", "\"loops\": 5"),
        ("\"id\": 0", "\"id\": 3"),
        ("\"det_lower_bound\": 0.", "\"det_lower_bound\": 1."),
        ("\"reason\": null", "\"reason\": {\"code\": \"malformed\", \"message\": \"\", \"where\": null}"),
        ("\"triangles\": 572", "\"triangles\": 18446744073709551615"),
        ("\"schema\": 1", "\"schema\": 2"),
    ];
    for (from, to) in lies {
        let out = certified(name);
        reword(&out, name, from, to);
        let ended = check(&out, name);
        assert!(ended.code == Some(1) && ended.err.contains("not proven"), "{to}: {}", ended.err);
    }
}

#[test]
fn fields_and_positions_that_cannot_be_are_found_behind_new_checksums() {
    let name = "disk.stl";
    type Change = fn(&mut Grid);
    let changes: [(&str, Change); 4] = [
        ("not finite", |grid| grid.points[1][2] = f64::NAN),
        ("cannot be", |grid| grid.fields[3].det_min = -7.0),
        ("cannot be", |grid| grid.fields[3].conformal_distortion = f64::NAN),
        ("twice", |_| {}),
    ];
    for (said, change) in changes {
        let out = certified(name);
        if said == "twice" {
            // Behind the outline stand the arrays as they were.
            let whole = out.read(name, "surface.vtu");
            let (from, to) = (b"\"area_scale\"", b"\"det_min\"   ");
            let at = whole.windows(from.len()).position(|word| word == from).expect("there");
            std::fs::write(out.of(name).join("surface.vtu"), [&whole[..at], to, &whole[at + from.len()..]].concat())
                .expect("written");
        } else {
            rewrite(&out, name, "surface.vtu", change);
            forge_checksums(&out, name);
        }
        let ended = check(&out, name);
        assert!(ended.code == Some(1) && ended.err.contains(said), "{said}: {}", ended.err);
    }
}

#[test]
fn param_must_show_the_same_map() {
    let name = "disk.stl";
    let out = certified(name);
    rewrite(&out, name, "param.vtu", |grid| grid.points[40][0] += 1e-3);
    forge_checksums(&out, name);
    let ended = check(&out, name);
    assert!(ended.code == Some(1) && ended.err.contains("param.vtu"), "{}", ended.err);
}

/// A chart that param.vtu shows in another size, as the report says.
#[test]
fn a_chart_in_another_size_than_its_own_is_found() {
    let name = "disk.stl";
    for factor in [4.0, 0.25, 1.5] {
        let out = certified(name);
        let mut report = out.report(name);
        report.charts[0].uv_scale *= factor;
        let (scale, shift) = (report.charts[0].uv_scale, report.charts[0].shift);
        std::fs::write(out.of(name).join("report.json"), report.to_json().expect("JSON")).expect("written");
        rewrite(&out, name, "param.vtu", |grid| {
            for (point, uv) in grid.points.iter_mut().zip(&grid.uv) {
                (point[0], point[1]) = (uv[0] * scale + shift[0], uv[1] * scale + shift[1]);
            }
        });
        forge_checksums(&out, name);
        let ended = check(&out, name);
        assert!(ended.code == Some(1) && ended.err.contains("uv_scale"), "{factor}: {}", ended.err);
    }
}

#[test]
fn any_changed_byte_is_found_with_the_name_of_its_file() {
    let name = "floater_five.obj";
    let out = certified(name);
    for output in out.report(name).outputs {
        let path = out.of(name).join(&output.file);
        let whole = std::fs::read(&path).expect("there");
        // Every 37th byte (and the last one), by one bit, and the file cut short.
        let places = (0..whole.len()).step_by(37).chain([whole.len() - 1]);
        let broken = places.map(|i| {
            let mut bytes = whole.clone();
            bytes[i] ^= 1 << (i % 8);
            bytes
        });
        for bytes in broken.chain([whole[..whole.len() / 2].to_vec(), vec![]]) {
            std::fs::write(&path, bytes).expect("written");
            let ended = check(&out, name);
            assert!(ended.code == Some(1) && ended.err.contains(&output.file), "{}: {}", output.file, ended.err);
        }
        std::fs::write(&path, whole).expect("written");
    }
    assert_eq!(check(&out, name).code, Some(0), "restored");
}

#[test]
fn several_results_are_checked_in_one_call() {
    let out = certified("disk.stl");
    out.run(&[&fixture("floater_five.obj")], &["-q"]);
    let report = out.of("disk.stl").join("report.json");
    let ended = planish(["check".as_ref(), report.as_os_str(), out.of("floater_five.obj").as_os_str()]);
    assert_eq!((ended.code, ended.out.lines().count()), (Some(0), 2), "{}", ended.err);
    std::fs::remove_file(out.of("disk.stl").join("surface.vtu")).expect("removed");
    let ended = planish(["check".as_ref(), report.as_os_str(), out.of("floater_five.obj").as_os_str()]);
    assert!(ended.code == Some(1) && ended.err.contains("surface.vtu"), "{}", ended.err);
    assert!(ended.out.contains("floater_five.obj"), "the other one is proven: {}", ended.out);
    // Only a result folder or its report is a result.
    for other in ["no/such/folder", "floater_five.obj/param.vtu", "floater_five.obj/typo.json"] {
        let ended = planish(["check".as_ref(), out.path().join(other).as_os_str()]);
        assert!(ended.code == Some(1) && ended.out.is_empty(), "{other}: {}", ended.out);
    }
}
