//! The real Mmg: mmgs on the surface, and mmg2d on the planes of charts, whose work is lifted.

use super::recipe::ran;
use super::{run, tools};
use crate::support::{Out, fixture, planish, root};
use planish::after::hooks::{Outcome, Target};
use planish::report::mesh::MeshReport;
use planish::settings::{Hook, Occasion, RawCommand};
use std::path::{Path, PathBuf};
use std::process::Command;

fn judged(folder: &Path, mesh: &Path, extra: &[&str]) -> MeshReport {
    let mut args: Vec<&std::ffi::OsStr> =
        vec!["check".as_ref(), folder.as_os_str(), "--mesh".as_ref(), mesh.as_os_str()];
    args.extend(["--json"].iter().chain(extra).map(std::ffi::OsStr::new));
    let ended = planish(args);
    serde_json::from_str(&ended.out).unwrap_or_else(|e| panic!("{e}: {}{}", ended.out, ended.err))
}

/// Meshes all charts of a result by mmg2d, and lifts them.
fn lifted(folder: &Path, charts: usize) -> PathBuf {
    let mut meshes = Vec::new();
    for chart in 0..charts {
        let [mesh, made] = ["mesh", "o.mesh"].map(|end| folder.join(format!("mmg/chart-{chart:03}.{end}")));
        let mut mmg2d = Command::new("mmg2d");
        mmg2d.env("PATH", tools()).args(["-v", "0", "-nosizreq", "-hgrad", "-1"]).arg(mesh).arg(&made);
        run(&mut mmg2d, "mmg2d failed");
        meshes.push(made);
    }
    let to = folder.join("lifted.msh");
    let mut args: Vec<&std::ffi::OsStr> = vec!["lift".as_ref()];
    args.extend(meshes.iter().map(|mesh| mesh.as_os_str()));
    args.extend(["--atlas".as_ref(), folder.as_os_str(), "-o".as_ref(), to.as_os_str()]);
    let ended = planish(args);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
    to
}

/// Faithful, fine, and edges as long as they were asked to be: on fixtures, and on real files where they are at hand.
#[test]
fn charts_meshed_by_mmg2d_fit_together_on_the_surface() {
    let out = Out::new();
    let mut inputs = vec![fixture("plate_genus9.stl"), fixture("disk_with_holes.stl"), fixture("moebius.obj")];
    let shared = root().join("../shared");
    let real = [
        "meshes/aneurysm_gmsh.stl",
        "meshes/rocker_arm_g1.obj",
        "meshes/max_planck_decimated.obj",
        "anchors/stl/plate9_10ks.stl",
    ];
    if shared.join(real[0]).exists() {
        inputs.extend(real.map(|file| shared.join(file)));
    } else {
        eprintln!("skipped: {} real files, as ../shared is not there", real.len());
    }
    let mut checked = 0;
    for input in inputs {
        let name = input.file_name().expect("a name").to_str().expect("UTF-8").to_owned();
        let size: &[&str] = if input.starts_with(root().join("fixtures")) { &["--size", "0.1"] } else { &[] };
        let extra = [&["-q", "--hand-off", "gmsh,mmg"], size].concat();
        assert_eq!(out.run(&[&input], &extra).code, Some(0), "{name}");
        let charts = out.report(&name).mmg.expect("a hand-off").charts;
        let mesh = lifted(&out.of(&name), charts);
        let found = judged(&out.of(&name), &mesh, &[]);
        assert!(found.faithful && found.fine && found.by_charts, "{name}: {:?} {:?}", found.defects, found.gamma);
        let told = run(
            super::script("verify_lengths.py").arg(&mesh).arg(found.size.to_string()),
            "an independent program disagrees",
        );
        let share: f64 = told.trim().parse().expect("a number");
        // Narrow charts have shorter edges.
        let is_uniform = out.report(&name).hand_off.is_some_and(|gmsh| gmsh.least_size.is_none());
        assert!(share >= 0.95 || !is_uniform, "{name}: {share} of the edges within [0.707, 1.414]");
        checked += usize::from(is_uniform);
    }
    assert!(checked > 0, "some have edges of one length");
}

/// What docs/mmg.md says of mmgs, as commands of a watched folder.
#[test]
fn mmgs_remeshes_what_was_dropped() {
    let (name, out) = ("plate_genus9.stl", Out::new());
    assert_eq!(out.run(&[&fixture(name)], &["-q", "--hand-off", "mmg"]).code, Some(0));
    let target = Target::new(&fixture(name), &out.of(name)).expect("paths");
    let mmg = out.report(name).mmg.expect("a hand-off");
    assert!(!mmg.detects_ridges && mmg.failure.is_none());
    let hausdorff = mmg.hausdorff.to_string();
    let path = format!("PATH={}", tools().to_str().expect("UTF-8"));
    let command = [
        "env",
        &path,
        "mmgs",
        "-v",
        "0",
        "-nr",
        "-hausd",
        &hausdorff,
        "{folder}/mmg/surface.mesh",
        "{folder}/mmgs.mesh",
    ];
    let hook = RawCommand { command: command.map(str::to_owned).to_vec(), time_limit: 300.0 };
    let account = ran(&[Hook::new(hook, Occasion::Certified).expect("valid")], &target, &out);
    assert!(account.commands.iter().all(|command| command.outcome == Outcome::Succeeded), "{account:?}");
    let off = (mmg.hausdorff / 2.0).to_string();
    let found = judged(&out.of(name), &out.of(name).join("mmgs.mesh"), &["--off", &off]);
    assert!(found.faithful && found.gamma.share_below < 1e-3, "{:?} {:?}", found.defects, found.gamma);
    // The result is as proven as it was.
    let proven = planish(["check".as_ref(), out.of(name).as_os_str()]);
    assert_eq!(proven.code, Some(0), "{}", proven.err);
}
