//! What packagers get works: the unit, and the example of a settings file.

use crate::support::{Out, fixture, root};
use planish::settings::{RawSettings, Settings};
use std::process::{Command, Output};

fn packaged(name: &str) -> String {
    std::fs::read_to_string(root().join("packaging").join(name)).expect("committed")
}

/// The example with everything switched on that can be.
fn all_switched_on() -> String {
    let on = |line: &str| match line.strip_prefix('#') {
        Some(setting) if !setting.is_empty() && !setting.starts_with(' ') => setting.to_owned(),
        _ => line.to_owned(),
    };
    packaged("planish.toml").lines().map(on).collect::<Vec<_>>().join("\n")
}

fn read(text: &str) -> RawSettings {
    toml::from_str(text).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn the_example_names_every_setting() {
    let unknown = toml::from_str::<RawSettings>("no-such-setting = 1").expect_err("unknown").to_string();
    let (_, list) = unknown.split_once("expected one of ").expect("a list of settings");
    let settings: Vec<&str> = list.split('`').skip(1).step_by(2).collect();
    assert!(settings.contains(&"order") && settings.contains(&"on_certified"), "{unknown}");
    let example: toml::Table = toml::from_str(&all_switched_on()).expect("valid");
    for setting in settings {
        assert!(example.contains_key(setting), "packaging/planish.toml does not show {setting}");
    }
}

#[test]
fn the_example_works_as_it_is_and_switched_on_and_shows_the_defaults() {
    let defaults = RawSettings::default().check().expect("in range");
    let as_it_is = read(&packaged("planish.toml")).check().expect("in range");
    assert_eq!(as_it_is, defaults);
    let all = read(&all_switched_on()).check().expect("in range");
    let without_default = Settings {
        out: all.out.clone(),
        log: all.log,
        max_triangles: all.max_triangles,
        size: all.size,
        size_curvature: all.size_curvature,
        size_min: all.size_min,
        size_from: all.size_from.clone(),
        deviation: all.deviation,
        labels: all.labels.clone(),
        names_features: all.names_features,
        jobs: all.jobs,
        commands: all.commands,
        memory: all.memory,
        job_memory: all.job_memory,
        job_time: all.job_time,
        metrics: all.metrics.clone(),
        keep_results: all.keep_results,
        on_certified: all.on_certified.clone(),
        on_refused: all.on_refused.clone(),
        ..as_it_is
    };
    assert_eq!(all, without_default);
    assert_eq!((all.on_certified.len(), all.on_refused.len()), (2, 1));
    let out = Out::new();
    let config = root().join("packaging/planish.toml");
    let ended = out.run(&[&fixture("disk.stl")], &["--config", config.to_str().expect("UTF-8")]);
    assert_eq!(ended.code, Some(0), "{}", ended.err);
}

/// Whether there is a program that judges units; it is said where there is none.
fn can_analyze() -> bool {
    let is_there = Command::new("systemd-analyze").arg("--version").output().is_ok();
    if !is_there {
        eprintln!("skipped: no systemd-analyze (apt-get install systemd)");
    }
    is_there
}

/// What systemd-analyze says of a unit with this text.
fn analyze(unit: &str, args: &[&str]) -> Output {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("planish.service");
    std::fs::write(&path, unit).expect("written");
    Command::new("systemd-analyze").args(args).arg(path).output().expect("runs")
}

#[test]
fn systemd_has_nothing_against_the_unit() {
    if !can_analyze() {
        return;
    }
    let verify = |unit: &str| {
        let output = analyze(unit, &["verify", "--man=no", "--recursive-errors=no"]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        let about_it: Vec<&str> = told.lines().filter(|l| l.contains("planish")).collect();
        (output.status.success(), about_it.join("\n"))
    };
    // The program must be there: the one of this build is.
    let unit = packaged("planish.service").replace("/usr/local/bin/planish", env!("CARGO_BIN_EXE_planish"));
    let unit = if systemd() < 254 { without_steps(&unit) } else { unit };
    assert!(unit.contains(&format!("ExecStart={} watch ", env!("CARGO_BIN_EXE_planish"))));
    assert_eq!(verify(&unit), (true, String::new()));
    let (good, told) = verify(&unit.replace("KillMode=mixed", "KillMode=mixd"));
    assert!(!good || told.contains("KillMode"), "a broken twin is found: {told}");
}

/// The version of systemd.
fn systemd() -> u32 {
    let output = Command::new("systemd-analyze").arg("--version").output().expect("runs");
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    told.split_whitespace().find_map(|word| word.parse().ok()).expect("a number")
}

/// Before 254, systemd knows no steps between restarts, warns of them, and stays with the first pause.
fn without_steps(unit: &str) -> String {
    let is_known = |line: &&str| !line.starts_with("RestartSteps=") && !line.starts_with("RestartMaxDelaySec=");
    unit.lines().filter(is_known).collect::<Vec<_>>().join("\n")
}

/// 0 is a service that can do nothing, 10 one that can do all.
#[test]
fn the_unit_lets_the_service_do_little() {
    if !can_analyze() {
        return;
    }
    // Whether the exposure is 1.0 at the most.
    let is_little = |unit: &str| {
        let output = analyze(unit, &["security", "--offline=true", "--no-pager", "--threshold=10"]);
        let told = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(told.contains("Overall exposure level"), "{told}{}", String::from_utf8_lossy(&output.stderr));
        output.status.success()
    };
    let unit = packaged("planish.service");
    assert!(is_little(&unit));
    assert!(!is_little(&unit.replace("PrivateNetwork=yes", "PrivateNetwork=no").replace("CapabilityBoundingSet=", "")));
}
