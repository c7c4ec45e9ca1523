//! The fixtures: what they are, and what becomes of them.

use crate::legality::assert_legal;
use crate::support::{Out, fixture, planish, root};
use planish::outcome::{Code, Status};

#[path = "../fixtures/generate.rs"]
pub mod generate;

/// Per fixture: name, components, loops, genus, whether it is certified.
pub const ALL: [(&str, usize, usize, Option<u64>, bool); 13] = [
    ("disk.stl", 1, 1, Some(0), true),
    ("disk_with_holes.stl", 1, 4, Some(0), true),
    ("bent_disk.stl", 1, 1, Some(0), true),
    ("floater_five.obj", 1, 1, Some(0), true),
    ("folding_three.obj", 1, 1, Some(0), true),
    ("folding_six.obj", 1, 1, Some(0), true),
    ("sliver_strip.obj", 1, 1, Some(0), true),
    ("cracked_patch.obj", 1, 1, Some(0), true),
    ("finger.obj", 1, 1, Some(0), true),
    ("bow_tie.stl", 2, 2, Some(0), false),
    ("moebius.obj", 1, 1, None, false),
    ("sphere.stl", 1, 0, Some(0), false),
    ("plate_genus9.stl", 1, 0, Some(9), false),
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
    let ended = out.run(&[&root().join("fixtures")], &[]);
    assert_eq!(ended.code, Some(1), "four are refused: {}", ended.err);
    for (name, components, loops, genus, certified) in ALL {
        let report = out.report(name);
        let surface = report.surface.expect("a surface").repaired.counts;
        assert_eq!((surface.components, surface.boundary_loops, surface.genus), (components, loops, genus), "{name}");
        let checked = planish(["check".as_ref(), out.of(name).as_os_str()]);
        if certified {
            assert_eq!((report.status, report.reason), (Status::Certified, None), "{name}");
            assert_eq!(checked.code, Some(0), "{name}: {}", checked.err);
            assert!(checked.out.contains("proven one-to-one"), "{}", checked.out);
            assert_legal(&out.of(name));
        } else {
            let reason = report.reason.expect("a reason");
            assert_eq!((report.status, reason.code), (Status::Refused, Code::NeedsDecomposition), "{name}");
            assert!(reason.message.contains(&format!("{components} components")), "{}", reason.message);
            assert_eq!(checked.code, Some(1), "{name}: nothing to prove");
            assert!(ended.err.contains(&format!("{name}: refused")), "{}", ended.err);
        }
    }
}

#[test]
fn the_bent_disk_has_hundreds_of_invalid_triangles_and_ends_close_to_harmonic() {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture("bent_disk.stl")], &[]).code, Some(0));
    let report = out.report("bent_disk.stl");
    let chart = &report.charts[0];
    assert!(chart.quadratic.as_ref().is_some_and(|q| q.invalid > 150 && q.det_min < 0.0), "{chart:?}");
    let untangle = chart.untangle.as_ref().expect("untangled");
    assert!(
        untangle.det_min > 0.0 && untangle.energy_harmonic < untangle.energy && untangle.energy < untangle.energy_start
    );
    assert!(untangle.energy_excess < 1e-3, "{untangle:?}");
}
