use super::*;
use crate::map::boundary::{Boundary, Mids};
use crate::map::linear::{linear_map, lower_ears};
use crate::map::quadratic::quadratic_map;
use crate::mesh::TriangleSoup;
use crate::monitor::NoMonitor;
use crate::{decompose, repair, shapes};

/// A chart with its feasible start and its harmonic map.
fn prepared(soup: &TriangleSoup) -> (ClosedChart, Vec<GridPoint>, QuadraticMap) {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let chart =
        ClosedChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0]);
    let mut boundary = Boundary::circle(&chart, Mids::Arc);
    let linear = linear_map(&chart, &boundary, &NoMonitor).expect("maps");
    lower_ears(&chart, &linear, &mut boundary);
    let harmonic = quadratic_map(&chart, &boundary, &NoMonitor).expect("solves");
    let start = linear.raised(&chart, &boundary);
    (chart, start, harmonic)
}

fn check(chart: &ClosedChart, untangled: &Untangled) {
    assert!(valid(chart, &untangled.nodes).is_some());
    let report = &untangled.report;
    assert!(report.energy >= report.energy_harmonic * (1.0 - 1e-12), "{report:?}");
    assert!(report.energy <= report.energy_start * (1.0 + 1e-12), "{report:?}");
}

#[test]
fn a_valid_harmonic_map_is_left_alone() {
    let (chart, start, harmonic) = prepared(&shapes::disk(8));
    assert!(harmonic.invalid().is_empty());
    let got = untangle(&chart, &start, &harmonic, &NoMonitor);
    assert_eq!((got.report.method, got.report.nodes_moved), (Method::Harmonic, 0));
}

#[test]
fn the_small_examples_are_untangled() {
    for soup in [shapes::folding_three(), shapes::folding_six()] {
        let (chart, start, harmonic) = prepared(&soup);
        assert!(!harmonic.invalid().is_empty());
        let got = untangle(&chart, &start, &harmonic, &NoMonitor);
        assert_eq!(got.report.method, Method::Feasible, "a third of the triangles is invalid");
        check(&chart, &got);
    }
}

#[test]
fn a_bent_disk_is_untangled_close_to_the_harmonic_map_on_both_paths() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(32, 0.45, 1.0));
    assert!(harmonic.invalid().len() > 150, "{} invalid", harmonic.invalid().len());
    let got = untangle(&chart, &start, &harmonic, &NoMonitor);
    assert_eq!(got.report.method, Method::Patch);
    check(&chart, &got);
    let mut effort = Effort::default();
    let nodes = feasible::untangle(&chart, &start, &mut effort, &Checkpoint::new(&NoMonitor)).expect("small");
    assert!(valid(&chart, &nodes).is_some());
    // Patches alone come as close to the lower bound as the whole chart does.
    for energy in [got.report.energy, energy(&chart, &nodes)] {
        assert!((1.0..1.0001).contains(&(energy / harmonic.energy())), "{energy} {}", harmonic.energy());
    }
}

#[test]
fn the_harmonic_energy_is_a_lower_bound_even_where_the_map_leaves_the_disk_far_behind() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(8, 0.45, 10.0));
    let farthest = harmonic.places().iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    assert!(farthest > 2.0, "beyond the grid: {farthest}");
    check(&chart, &untangle(&chart, &start, &harmonic, &NoMonitor));
}
