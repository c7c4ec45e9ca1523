//! What surfaces of many parts cost: holes and handles, components, charts. `tests/bench/families.py` makes them of any size.

use super::{PYTHON, run};
use crate::support::{Out, root};
use std::path::Path;
use std::process::Command;

/// CPU time may grow as this power of the triangles. docs/performance.md tells what it does: 0.8 to 1.2. One loop over all pairs of
/// parts shows here: with three of them plates with holes grew as the power of 2.4. The rest is room for noise.
const MOST: f64 = 1.5;

#[test]
fn many_holes_components_and_charts_cost_what_their_triangles_do() {
    let inputs = tempfile::tempdir().expect("a folder");
    for family in ["plate", "spheres", "stairs"] {
        let [small, large] = [10_000, 40_000].map(|wanted| {
            let file = inputs.path().join(format!("{family}_{wanted}.stl"));
            let triangles = made(family, wanted, &file);
            // The less disturbed one of two runs.
            let cpu = [(); 2].map(|()| cpu_seconds(&file)).into_iter().fold(f64::INFINITY, f64::min);
            (triangles, cpu)
        });
        let exponent = (large.1 / small.1).ln() / (large.0 / small.0).ln();
        println!("{family}: {small:?} to {large:?}, exponent {exponent:.2}");
        assert!(exponent <= MOST, "{family}: {small:?} to {large:?} is a growth of n^{exponent:.2}");
    }
}

/// Makes a surface of about so many triangles; how many it has.
fn made(family: &str, triangles: usize, file: &Path) -> f64 {
    let mut command = Command::new(&*PYTHON);
    command.arg(root().join("tests/bench/families.py")).args([family, &triangles.to_string()]).arg(file);
    let printed = run(&mut command, "numpy is needed");
    printed.trim().parse().expect("a number of triangles")
}

/// The CPU time of all stages of a run.
fn cpu_seconds(file: &Path) -> f64 {
    let out = Out::new();
    assert_eq!(out.run(&[file], &["-q", "--jobs", "1"]).code, Some(0), "{file:?}");
    let report = out.report(file.file_name().and_then(|name| name.to_str()).expect("a name"));
    report.timing.values().sum()
}
