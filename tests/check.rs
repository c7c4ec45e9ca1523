//! `planish check`: it proves what is right and finds what was tampered with, even behind new checksums.

use crate::boundaries::obj;
use crate::support::{Ended, Out, fixture, planish};
use planish::formats::vtu;
use planish::report::{Output, Report, chart_checksum};
use planish_core::certify::PlanarMap;
use planish_core::grid::GridPoint;
use vtkio::model::{Attribute, DataSet, IOBuffer, Piece, UnstructuredGridPiece, Vtk};
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

/// Rewrites a file of a result with its grid changed.
fn rewrite(out: &Out, name: &str, file: &str, change: impl Fn(&mut UnstructuredGridPiece)) {
    let mut vtk = Vtk::parse_xml(&out.read(name, file)[..]).expect("readable");
    let DataSet::UnstructuredGrid { pieces, .. } = &mut vtk.data else { panic!("a grid") };
    let Piece::Inline(piece) = &mut pieces[0] else { panic!("inline") };
    change(piece);
    let mut bytes = Vec::new();
    vtk.try_into_xml_format(Compressor::ZLib, 1).expect("writable").write(&mut bytes).expect("written");
    std::fs::write(out.of(name).join(file), bytes).expect("written");
}

fn doubles<'a>(attributes: &'a mut [Attribute], wanted: &str) -> &'a mut Vec<f64> {
    attributes
        .iter_mut()
        .find_map(|a| match a {
            Attribute::DataArray(d) if d.name == wanted => match &mut d.data {
                IOBuffer::F64(v) => Some(v),
                _ => None,
            },
            _ => None,
        })
        .expect("the field")
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
        let change = |piece: &mut UnstructuredGridPiece| {
            let uv = doubles(&mut piece.data.point, "uv");
            let (from, to) = (cell[5] as usize, cell[3] as usize);
            uv.copy_within(2 * from..2 * from + 2, 2 * to);
        };
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
    let crack = |piece: &mut UnstructuredGridPiece| {
        let vtkio::model::VertexNumbers::XML { connectivity, .. } = &mut piece.cells.cell_verts else { panic!() };
        // One triangle turns round: its edges no longer run against those of its neighbours.
        connectivity.swap(6 * 100 + 1, 6 * 100 + 2);
        connectivity.swap(6 * 100 + 3, 6 * 100 + 5);
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
        let change = |piece: &mut UnstructuredGridPiece| {
            let IOBuffer::F64(points) = &piece.points else { panic!("doubles") };
            let drawn_out = |p: &[f64]| {
                let turn = p[1].atan2(p[0]).rem_euclid(std::f64::consts::TAU);
                let (sin, cos) = (times * turn).sin_cos();
                let radius = 0.45 * p[0].hypot(p[1]);
                GridPoint::vertex([radius * cos, radius * sin]).uv()
            };
            let uv: Vec<f64> = points.chunks(3).flat_map(drawn_out).collect();
            *doubles(&mut piece.data.point, "uv") = uv;
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
    type Change = fn(&mut UnstructuredGridPiece);
    let changes: [(&str, Change); 4] = [
        ("not finite", |piece| {
            let IOBuffer::F64(points) = &mut piece.points else { panic!("doubles") };
            points[5] = f64::NAN;
        }),
        ("cannot be", |piece| doubles(&mut piece.data.cell, "det_min")[3] = -7.0),
        ("cannot be", |piece| doubles(&mut piece.data.cell, "conformal_distortion")[3] = f64::NAN),
        ("twice", |piece| {
            let again = piece.data.point[0].clone();
            piece.data.point.push(again);
        }),
    ];
    for (said, change) in changes {
        let out = certified(name);
        rewrite(&out, name, "surface.vtu", change);
        if said != "twice" {
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
    rewrite(&out, name, "param.vtu", |piece| {
        let IOBuffer::F64(points) = &mut piece.points else { panic!("doubles") };
        points[3 * 40] += 1e-3;
    });
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
        rewrite(&out, name, "param.vtu", |piece| {
            let uv = doubles(&mut piece.data.point, "uv").clone();
            let IOBuffer::F64(points) = &mut piece.points else { panic!("doubles") };
            let components = 3 * uv.len() / points.len();
            for (point, uv) in points.chunks_exact_mut(3).zip(uv.chunks_exact(components)) {
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
