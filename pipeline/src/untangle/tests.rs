use super::*;
use crate::fem::element::P2Nodes;
use crate::map::boundary::{Boundary, Mids};
use crate::map::linear::{flatten_ear_arcs, linear_map};
use crate::map::quadratic::{energy, quadratic_map};
use crate::mesh::TriangleSoup;
use crate::monitor::{NoMonitor, Task, one_by_one};
use crate::{decompose, repair, shapes};

/// A chart with its feasible start and its harmonic map.
fn prepared(soup: &TriangleSoup) -> (FilledChart, Vec<GridPoint>, QuadraticMap) {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let chart =
        FilledChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0]);
    let mut boundary = Boundary::circle(&chart, Mids::Arc);
    let linear = linear_map(&chart, &boundary, &NoMonitor).expect("maps");
    flatten_ear_arcs(&chart, &linear, &mut boundary);
    let harmonic = quadratic_map(&chart, &boundary, &NoMonitor).expect("solves");
    let start = linear.degree_elevated(&chart, &boundary);
    (chart, start, harmonic)
}

fn untangled(chart: &FilledChart, start: &[GridPoint], harmonic: &QuadraticMap) -> Untangled {
    untangle(chart, &Dirichlet::new(chart), start, harmonic, &NoMonitor).expect("nobody interrupts")
}

fn check(chart: &FilledChart, untangled: &Untangled) {
    assert!(valid(chart, &untangled.nodes).is_some());
    let report = &untangled.report;
    assert!(report.energy >= report.energy_unconstrained * (1.0 - 1e-12), "{report:?}");
    assert!(report.energy <= report.energy_start * (1.0 + 1e-12), "{report:?}");
}

#[test]
fn a_valid_harmonic_map_is_left_alone() {
    let (chart, start, harmonic) = prepared(&shapes::disk(8));
    assert!(harmonic.invalid().is_empty());
    let got = untangled(&chart, &start, &harmonic);
    assert_eq!((got.report.method, got.report.nodes_moved), (Method::Harmonic, 0));
}

#[test]
fn the_small_examples_are_untangled() {
    for soup in [shapes::folding_three(), shapes::folding_six()] {
        let (chart, start, harmonic) = prepared(&soup);
        assert!(!harmonic.invalid().is_empty());
        let got = untangled(&chart, &start, &harmonic);
        assert_eq!(got.report.method, Method::Feasible, "a third of the triangles is invalid");
        check(&chart, &got);
    }
}

#[test]
fn a_bent_disk_is_untangled_close_to_the_harmonic_map_on_both_paths() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(32, 0.45, 1.0));
    assert!(harmonic.invalid().len() > 150, "{} invalid", harmonic.invalid().len());
    let got = untangled(&chart, &start, &harmonic);
    assert_eq!(got.report.method, Method::Patch);
    check(&chart, &got);
    let mut stats = Stats::default();
    let nodes = {
        let energy = Dirichlet::new(&chart);
        feasible::untangle(&chart, &energy, &start, NEAREST, &mut stats, &Checkpoint::new(&NoMonitor)).expect("small")
    };
    assert!(valid(&chart, &nodes).is_some());
    // Patches alone come as close to the lower bound as the whole chart does.
    for energy in [got.report.energy, energy(&chart, &nodes)] {
        assert!((1.0..1.0001).contains(&(energy / harmonic.energy())), "{energy} {}", harmonic.energy());
    }
}

#[test]
fn the_harmonic_energy_is_a_lower_bound_even_where_the_map_leaves_the_disk_far_behind() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(8, 0.45, 10.0));
    let farthest = harmonic.uv().iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    assert!(farthest > 2.0, "beyond the grid: {farthest}");
    check(&chart, &untangled(&chart, &start, &harmonic));
}

/// Half the squared distance of the nodes of each triangle to those of a given map.
struct Distance<'a> {
    chart: &'a FilledChart,
    target: Vec<[f64; 2]>,
}

impl Distance<'_> {
    fn offsets(&self, face: FaceId, x: &P2Nodes) -> [f64; objective::SCALARS] {
        let target = self.chart.nodes(face.index()).map(|n| self.target[n]);
        std::array::from_fn(|i| x[i / 2][i % 2] - target[i / 2][i % 2])
    }
}

impl Objective for Distance<'_> {
    fn value(&self, face: FaceId, x: &P2Nodes) -> f64 {
        0.5 * self.offsets(face, x).iter().map(|d| d * d).sum::<f64>()
    }

    fn model(&self, face: FaceId, x: &P2Nodes) -> LocalModel {
        let mut hessian = [[0.0; objective::SCALARS]; objective::SCALARS];
        (0..objective::SCALARS).for_each(|i| hessian[i][i] = 1.0);
        LocalModel { gradient: self.offsets(face, x), hessian }
    }

    fn typical(&self, area: f64) -> f64 {
        area
    }
}

#[test]
fn the_distance_to_a_map_is_a_model_of_itself() {
    let (chart, start, _) = prepared(&shapes::disk(3));
    assert!(objective::tests::check_derivatives(&Distance { chart: &chart, target: uv_of(&start, &[]) }) >= 0.0);
}

#[test]
fn another_objective_finds_the_closest_valid_map() {
    let (chart, start, harmonic) = prepared(&shapes::folding_six());
    assert!(!harmonic.invalid().is_empty(), "the target is beyond the valid maps");
    let distance = Distance { chart: &chart, target: harmonic.uv().to_vec() };
    let got = untangle(&chart, &distance, &start, &harmonic, &NoMonitor).expect("nobody interrupts");
    assert!(valid(&chart, &got.nodes).is_some());
    assert_eq!((got.report.method, got.report.energy_unconstrained), (Method::Feasible, 0.0));
    assert!(0.0 < got.report.energy && got.report.energy < 0.5 * got.report.energy_start, "{:?}", got.report);
    // No valid map within reach of one moved node is closer by more than the barrier's weight.
    let is_outer = chart.outer_nodes();
    let step = 1e-4;
    for node in (0..chart.node_count()).filter(|n| !is_outer[*n]) {
        for direction in [[step, 0.0], [-step, 0.0], [0.0, step], [0.0, -step]] {
            let mut moved = uv_of(&got.nodes, &[]);
            (0..2).for_each(|k| moved[node][k] += direction[k]);
            let on_grid = on_grid(&chart, &moved);
            let closer = got.report.energy - total(&chart, &distance, &moved);
            assert!(closer < 1e-5 || valid(&chart, &on_grid).is_none(), "node {node}: closer by {closer}");
        }
    }
}

#[test]
fn a_valid_target_is_reached() {
    let (chart, start, harmonic) = prepared(&shapes::disk(4));
    assert!(harmonic.invalid().is_empty());
    let distance = Distance { chart: &chart, target: harmonic.uv().to_vec() };
    let (mut stats, checkpoint) = (Stats::default(), Checkpoint::new(&NoMonitor));
    let nodes = feasible::untangle(&chart, &distance, &start, NEAREST, &mut stats, &checkpoint).expect("small");
    let [before, after] = [&start, &nodes].map(|n| total_on_grid(&chart, &distance, n));
    assert!(after < 1e-9 * before, "{before} {after}");
}

/// The objective is the one that is given: its minimiser is the result where that is valid, whatever the harmonic map is.
#[test]
fn a_valid_minimiser_of_another_objective_is_the_result() {
    let (chart, start, harmonic) = prepared(&shapes::disk(6));
    let target = uv_of(&start, &[]);
    assert!(target != harmonic.uv(), "they differ");
    let distance = Distance { chart: &chart, target: target.clone() };
    let minimiser = QuadraticMap::of(&chart, target, 0.0);
    let got = untangle(&chart, &distance, &start, &minimiser, &NoMonitor).expect("nobody interrupts");
    assert_eq!((got.report.method, got.report.energy, got.nodes), (Method::Harmonic, 0.0, start));
}

/// Begun at the linear map, what is found is as near to an isometry as where the method comes to rest, up to what nobody sees; there
/// no move of a few nodes brings it nearer.
#[test]
fn the_isometric_objective_comes_to_rest_inside_the_valid_maps() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(8, 0.45, 1.0));
    assert!(!harmonic.invalid().is_empty());
    let nodes_of = |nodes: &[GridPoint]| -> Vec<P2Nodes> {
        (0..chart.triangles().len()).map(|f| chart.nodes(f).map(|n| nodes[n].uv())).collect()
    };
    let objective = Isometric::near(&chart, &nodes_of(&start));
    let got = descend(&chart, &objective, &start, &NoMonitor).expect("nobody interrupts");
    assert!(valid(&chart, &got.nodes).is_some());
    assert_eq!(got.energy_start, total_on_grid(&chart, &objective, &start));
    assert_eq!(got.energy, total_on_grid(&chart, &objective, &got.nodes));
    let least = objective.of_isometry(chart.shapes().iter().map(|s| s.area()).sum());
    assert!(least < got.energy && got.energy < 0.9 * got.energy_start, "{least} {} {}", got.energy, got.energy_start);
    let (mut stats, checkpoint) = (Stats::default(), Checkpoint::new(&NoMonitor));
    let patient = interior::Wanted { idle: None, ..NEAR };
    let rest = feasible::untangle(&chart, &objective, &start, patient, &mut stats, &checkpoint).expect("small");
    let at_rest = total_on_grid(&chart, &objective, &rest);
    assert!(got.energy < (1.0 + 2e-3) * at_rest && got.iterations < 40, "{} {at_rest}", got.energy);
    assert!(stats.decrement.sqrt() <= 1e-5 && stats.iterations < 80, "{stats:?}");
    let is_outer = chart.outer_nodes();
    let mut random = shapes::Random(11);
    for _ in 0..50 {
        let mut moved = uv_of(&rest, &[]);
        for (p, _) in moved.iter_mut().zip(&is_outer).filter(|(_, is_outer)| !**is_outer) {
            *p = p.map(|c| c + 1e-5 * random.symmetric());
        }
        let gained = at_rest - total(&chart, &objective, &moved);
        assert!(gained < 1e-5 * at_rest, "{gained}");
    }
}

#[test]
fn interrupted_at_any_time_there_is_no_result() {
    let (chart, start, harmonic) = prepared(&shapes::bent_disk(16, 0.45, 1.0));
    let energy = Dirichlet::new(&chart);
    let patient = CountDown::new(usize::MAX);
    untangle(&chart, &energy, &start, &harmonic, &patient).expect("nobody interrupts");
    let asked = usize::MAX - patient.left.into_inner();
    assert!(asked > 3, "{asked}");
    for patience in [0, 1, asked / 2, asked - 1] {
        let got = untangle(&chart, &energy, &start, &harmonic, &CountDown::new(patience));
        assert!(got.is_err(), "after {patience} of {asked} answers");
    }
}

/// A monitor that says yes so many times.
struct CountDown {
    left: std::sync::atomic::AtomicUsize,
}

impl CountDown {
    fn new(patience: usize) -> Self {
        Self { left: patience.into() }
    }
}

impl Monitor for CountDown {
    fn should_continue(&self) -> bool {
        use std::sync::atomic::Ordering::Relaxed;
        self.left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_ok()
    }

    fn reserve(&self, _bytes: u64) {}

    fn release(&self, _bytes: u64) {}

    fn together(&self, tasks: Vec<Task<'_>>) {
        one_by_one(tasks, self);
    }
}
