//! `--boundary`: which boundary charts have in the plane, that it is told, and that it is proven again.

use crate::support::{Out, fixture, planish};
use planish::report::{BoundaryShape, ChartReport, Report};
use planish::settings::Boundary;
use planish_core::mesh::TriangleSoup;
use planish_core::shapes;

/// A surface as the text of an OBJ.
pub fn obj(soup: &TriangleSoup) -> Vec<u8> {
    let points = soup.points().iter().map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let faces = soup.triangles().iter().map(|t| {
        let [a, b, c] = t.map(|v| v + 1);
        format!("f {a} {b} {c}\n")
    });
    points.chain(faces).collect::<String>().into_bytes()
}

fn is_proven_again(out: &Out, name: &str) {
    let ended = planish(["check".as_ref(), out.of(name).as_os_str()]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// The only chart, and how its boundary was proven.
fn only_chart(report: &Report) -> (&ChartReport, &str) {
    let [chart] = &report.charts[..] else { panic!("{} charts", report.charts.len()) };
    (chart, &chart.certificate.boundary.argument)
}

#[test]
fn a_plate_keeps_its_shape_by_default_and_is_mapped_to_the_disk_on_demand() {
    let name = "disk_with_holes.stl";
    let out = Out::new();
    assert_eq!(out.run(&[&fixture(name)], &["-q"]).code, Some(0));
    let report = out.report(name);
    let (chart, argument) = only_chart(&report);
    assert_eq!((report.settings.boundary, chart.boundary.shape), (Some(Boundary::Natural), BoundaryShape::Natural));
    assert_eq!((argument, chart.certificate.boundary.holes, chart.loops), ("simple", 3, 4));
    assert_eq!((chart.linear.method.as_str(), &chart.boundary.reason), ("harmonic", &None));
    is_proven_again(&out, name);

    // Another boundary is another result.
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--boundary", "circle"]).code, Some(0));
    let on_disk = out.report(name);
    let (disk, argument) = only_chart(&on_disk);
    assert_eq!(
        (on_disk.settings.boundary, disk.boundary.shape, argument),
        (Some(Boundary::Circle), BoundaryShape::Circle, "star_shaped")
    );
    assert_eq!(disk.boundary.reason, None, "nobody asked for another");
    assert!(chart.distortion.conformal_p99 < disk.distortion.conformal_p99);
    is_proven_again(&out, name);
}

#[test]
fn a_ramp_that_would_cover_itself_is_freed_from_the_disk_and_says_why() {
    let out = Out::new();
    // Features off, so that its turns are one chart.
    let (ended, report) = out.run_bytes_with("ramp.obj", &obj(&shapes::ramp(24, 48)), &["--feature-angle", "off"]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    let (chart, argument) = only_chart(&report);
    assert_eq!((chart.boundary.shape, argument), (BoundaryShape::Freed, "simple"));
    assert_eq!(chart.linear.method, "isometric");
    assert_eq!(chart.boundary.reason.as_deref(), Some("crossing"));
    assert!(chart.boundary.message.as_ref().is_some_and(|m| m.contains("crosses or touches")));
    is_proven_again(&out, "ramp.obj");
}

#[test]
fn the_wall_of_a_cylinder_is_unrolled_in_two_strips() {
    let out = Out::new();
    let (ended, report) = out.run_bytes("wall.obj", &obj(&shapes::tube(36, 1, 5.0)));
    assert_eq!((ended.code, report.charts.len()), (Some(0), 2), "{}", ended.err);
    for chart in &report.charts {
        assert_eq!((chart.boundary.shape, chart.loops), (BoundaryShape::Natural, 1));
        let distortion = &chart.distortion;
        assert!(distortion.conformal_p99 < 1.001 && distortion.area_ratio < 1.001, "{distortion:?}");
        assert_eq!(chart.quadratic.as_ref().map(|q| q.invalid), Some(0));
    }
    is_proven_again(&out, "wall.obj");
    // One that is hardly high is a ring as it is.
    let (_, low) = out.run_bytes("low.obj", &obj(&shapes::tube(36, 2, 0.4)));
    assert_eq!(only_chart(&low).0.loops, 2);
}
