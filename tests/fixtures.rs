//! The fixtures: what they are, and what becomes of them.

use crate::legality::assert_legal;
use crate::support::{Out, fixture, planish, root};
use planish::outcome::Status;

#[path = "../fixtures/generate.rs"]
pub mod generate;

/// A fixture: name, components, loops, genus, charts without features.
type Fixture = (&'static str, usize, usize, Option<u64>, std::ops::RangeInclusive<usize>);

/// All fixtures.
pub const ALL: [Fixture; 13] = [
    ("disk.stl", 1, 1, Some(0), 1..=1),
    ("disk_with_holes.stl", 1, 4, Some(0), 1..=1),
    ("bent_disk.stl", 1, 1, Some(0), 1..=2),
    ("floater_five.obj", 1, 1, Some(0), 1..=1),
    ("folding_three.obj", 1, 1, Some(0), 1..=1),
    ("folding_six.obj", 1, 1, Some(0), 1..=1),
    ("sliver_strip.obj", 1, 1, Some(0), 1..=1),
    ("cracked_patch.obj", 1, 1, Some(0), 1..=1),
    ("finger.obj", 1, 1, Some(0), 1..=2),
    ("bow_tie.stl", 2, 2, Some(0), 2..=2),
    ("moebius.obj", 1, 1, None, 2..=2),
    ("sphere.stl", 1, 0, Some(0), 2..=2),
    ("plate_genus9.stl", 1, 0, Some(9), 2..=6),
];

#[test]
fn the_files_are_what_the_generator_makes() {
    let made = generate::all();
    assert_eq!(made.len(), ALL.len());
    for (name, content) in made {
        assert!(std::fs::read(fixture(name)).expect("committed") == content, "{name} differs: run the generator");
    }
}

#[test]
fn every_fixture_ends_as_it_should_and_is_proven_again() {
    let out = Out::new();
    let ended = out.run(&[&root().join("fixtures")], &["--feature-angle", "off"]);
    assert_eq!(ended.code, Some(0), "all are certified: {}", ended.err);
    for (name, components, loops, genus, charts) in ALL {
        let report = out.report(name);
        let surface = report.surface.expect("a surface").repaired.counts;
        assert_eq!((surface.components, surface.boundary_loops, surface.genus), (components, loops, genus), "{name}");
        assert_eq!((report.status, report.reason), (Status::Certified, None), "{name}");
        assert!(charts.contains(&report.charts.len()), "{name}: {} charts", report.charts.len());
        let checked = planish(["check".as_ref(), out.of(name).as_os_str()]);
        assert_eq!(checked.code, Some(0), "{name}: {}", checked.err);
        assert!(checked.out.contains("proven one-to-one"), "{}", checked.out);
        assert_legal(&out.of(name));
        for chart in &report.charts {
            let other = |c: &u32| report.charts[*c as usize].colour != chart.colour;
            assert!(chart.neighbours.iter().all(other), "{name}: neighbours differ in colour");
            let within = chart.distortion.area_ratio <= 1e6 || chart.triangles == 1;
            assert!(within, "{name}: {:?}", chart.distortion);
        }
    }
}

#[test]
fn the_bent_disk_has_hundreds_of_invalid_triangles_and_ends_close_to_harmonic() {
    let out = Out::new();
    // Its area ratio is just above the default bound: this keeps it whole.
    let whole = ["--feature-angle", "off", "--boundary", "circle", "--max-area-ratio", "1e7"];
    assert_eq!(out.run(&[&fixture("bent_disk.stl")], &whole).code, Some(0));
    let report = out.report("bent_disk.stl");
    let [chart] = &report.charts[..] else { panic!("{} charts", report.charts.len()) };
    assert!(chart.quadratic.as_ref().is_some_and(|q| q.invalid > 150 && q.det_min < 0.0), "{chart:?}");
    let untangle = chart.untangle.as_ref().expect("untangled");
    assert!(
        untangle.det_min > 0.0 && untangle.energy_harmonic < untangle.energy && untangle.energy < untangle.energy_start
    );
    assert!(untangle.energy_excess < 1e-3, "{untangle:?}");
}
