//! What an input takes or dies of is its own affair.

use super::{PATIENCE, Watched, disk, limit_handles, runs};
use crate::support::{Out, planish};
use planish::outcome::{Code, Status};
use planish::report::Report;
use rustix::process::{Pid, Signal, kill_process};
use std::fs;
use std::process::Command;
use std::time::Instant;

/// The processes that another one has started: of planish, one for each large input.
pub fn children(of: u32) -> Vec<u32> {
    let tasks = fs::read_dir(format!("/proc/{of}/task")).into_iter().flatten().flatten();
    let read = |task: fs::DirEntry| fs::read_to_string(task.path().join("children")).unwrap_or_default();
    tasks
        .map(read)
        .flat_map(|ids| ids.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<_>>())
        .collect()
}

/// Kills the process of the large input.
pub fn kill_child(w: &Watched, not: Option<u32>) -> u32 {
    let since = Instant::now();
    loop {
        if let Some(child) = children(w.pid()).into_iter().find(|child| Some(*child) != not) {
            kill_process(Pid::from_raw(child as i32).expect("not 0"), Signal::KILL).expect("it lives");
            return child;
        }
        assert!(since.elapsed() < PATIENCE, "no process was started\n{}", w.log());
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
}

fn code(report: &Report) -> Option<Code> {
    report.reason.as_ref().map(|reason| reason.code)
}

#[test]
fn an_input_of_which_planish_dies_twice_is_put_aside_and_all_else_is_done() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let (large, small) = (disk(220, 0.0), disk(5, 0.0));
    w.drop_in("large.stl", &large);
    w.start();
    let first = kill_child(&w, None);
    kill_child(&w, Some(first));
    w.drop_in("small.stl", &small);
    w.wait_for(&[("large.stl", &large), ("small.stl", &small)]);
    w.assert_complete("small.stl", Status::Certified);
    w.assert_complete("large.stl", Status::Failed);
    let report = w.out.report("large.stl");
    let reason = report.reason.expect("a reason");
    assert!(reason.code == Code::Crashed && reason.message.contains("signal: 9"), "{reason:?}");
    w.stop();
    // Nor is it tried again by the next one, as long as it is what it was.
    w.start();
    w.wait_until("it is looked at", |w| w.logged("large.stl", "is up to date") == 1);
    w.stop();
    w.start();
    let newer = disk(120, 1.0);
    w.drop_in("large.stl", &newer);
    w.wait_for(&[("large.stl", &newer)]);
    w.assert_complete("large.stl", Status::Certified);
    w.stop();
    w.assert_tidy(&["large.stl", "small.stl"]);
}

/// Others wait for memory that such a process has.
#[test]
fn a_process_that_dies_gives_back_what_it_held() {
    let mut w = Watched::new(&["--jobs", "2", "--memory", "16MiB"]);
    let inputs: Vec<(String, Vec<u8>)> = (0..4)
        .map(|i| (format!("{i}.stl"), disk(110, f64::from(i))))
        .chain([("small.stl".to_owned(), disk(5, 0.0))])
        .collect();
    inputs.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    w.start();
    let mut last = None;
    for _ in 0..4 {
        last = Some(kill_child(&w, last));
        std::thread::sleep(std::time::Duration::from_millis(700));
    }
    w.wait_for(&inputs.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])).collect::<Vec<_>>());
    w.stop();
    w.assert_complete("small.stl", Status::Certified);
}

/// A disk that has no room: the process of the input keeps its result, and people are told.
#[test]
fn what_the_process_of_an_input_cannot_write_is_not_computed_again() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let large = disk(110, 0.0);
    w.drop_in("large.stl", &large);
    w.start();
    w.wait_until("it has a process", |w| !children(w.pid()).is_empty());
    w.wait_until("it is computed", |w| w.is_running("large.stl"));
    let child = children(w.pid())[0];
    limit_handles(child, 3);
    let is_held_up = |w: &Watched| w.status()["running"][0]["trouble"].as_str().is_some();
    w.wait_until("its result cannot be written", is_held_up);
    let health = || planish(["status".as_ref(), "--health".as_ref(), "--out".as_ref(), w.out.path().as_os_str()]);
    let told = health();
    assert!(told.code == Some(1) && told.out.contains("held up"), "{}", told.out);
    limit_handles(child, 1 << 10);
    w.wait_for(&[("large.stl", &large)]);
    assert_eq!(w.logged("large.stl", "begins"), 1, "{}", w.log());
    w.stop();
    w.assert_complete("large.stl", Status::Certified);
}

/// As hardened services are run: only processes are shown below /proc.
#[test]
fn what_the_system_does_not_tell_refuses_nothing() {
    let out = Out::new();
    let script = "mount -t proc -o subset=pid proc /proc && exec \"$0\" \"$@\"";
    let mut command = Command::new("unshare");
    command.args(["--mount", "--pid", "--fork", "sh", "-c", script, env!("CARGO_BIN_EXE_planish"), "run"]);
    command.arg(crate::support::fixture("disk.stl")).arg("--out").arg(out.path());
    let ran = command.output();
    match ran {
        Ok(ran) if ran.status.success() => assert_eq!(out.report("disk.stl").status, Status::Certified),
        Ok(ran) if out.of("disk.stl").exists() => panic!("{ran:?}"),
        _ => eprintln!("skipped: no file systems can be mounted here"),
    }
}

#[test]
fn one_death_is_an_accident() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let large = disk(150, 0.0);
    w.drop_in("large.stl", &large);
    w.start();
    kill_child(&w, None);
    w.wait_for(&[("large.stl", &large)]);
    w.stop();
    w.assert_complete("large.stl", Status::Certified);
    w.assert_tidy(&["large.stl"]);
}

/// Whoever kills planish, however often, accuses no input; and no process is left without its parent.
#[test]
fn processes_of_inputs_end_with_the_daemon() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let large = disk(220, 0.0);
    w.drop_in("large.stl", &large);
    for _ in 0..4 {
        w.start();
        w.wait_until("it is on its way", |w| !children(w.pid()).is_empty());
        let orphans = children(w.pid());
        w.kill();
        w.wait_until("the process of the input has ended", |_| !orphans.iter().any(runs));
    }
    w.start();
    w.wait_for(&[("large.stl", &large)]);
    w.stop();
    w.assert_complete("large.stl", Status::Certified);
    w.assert_tidy(&["large.stl"]);
}

#[test]
fn limits_of_time_and_memory_are_those_of_single_inputs() {
    let small = disk(5, 0.0);
    for (limit, what, large) in [
        (["--job-time", "0.3"], Code::JobTime, disk(220, 0.0)),
        // It is foretold that this takes too much,
        (["--job-memory", "64MiB"], Code::JobMemory, disk(120, 0.0)),
        // and this takes as much although it is not.
        (["--job-memory", "64MiB"], Code::JobMemory, disk(80, 0.0)),
    ] {
        let mut w = Watched::new(&[&limit[..], &["--jobs", "2"]].concat());
        w.drop_in("large.stl", &large);
        w.drop_in("small.stl", &small);
        w.start();
        w.wait_for(&[("large.stl", &large), ("small.stl", &small)]);
        w.assert_complete("small.stl", Status::Certified);
        assert_eq!(code(&w.out.report("large.stl")), Some(what), "{:?}", w.out.report("large.stl").reason);
        // Who was ended for a limit has not died of anything, whatever becomes of the daemon.
        w.kill();
        w.start();
        w.wait_until("it watches again", |w| w.log().matches("\"watches\"").count() == 2);
        w.stop();
        assert!(!w.log().contains("when the last planish died"), "{}", w.log());
        w.assert_tidy(&["large.stl", "small.stl"]);
    }
}

/// With as much memory as a small container has: once, that was five starts and five deaths.
#[test]
fn an_input_that_takes_more_memory_than_there_is_ends_nothing_but_itself() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let (large, small) = (disk(130, 0.0), disk(5, 0.0));
    w.drop_in("large.stl", &large);
    w.drop_in("small.stl", &small);
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -d 150000 && exec \"$0\" \"$@\""]).arg(env!("CARGO_BIN_EXE_planish"));
    command.args(w.arguments()).stderr(w.log_file());
    w.start_as(&mut command);
    w.wait_for(&[("large.stl", &large), ("small.stl", &small)]);
    w.stop();
    w.assert_complete("small.stl", Status::Certified);
    let reason = w.out.report("large.stl").reason.expect("a reason");
    assert!(reason.code == Code::Crashed && reason.message.contains("memory allocation"), "{reason:?}");
}

/// What comes out of a process of its own is, byte for byte, what comes out without one.
#[test]
fn results_do_not_depend_on_processes() {
    let [here, apart] = [&[][..], &["--job-time", "1000"]].map(|extra| {
        let out = Out::new();
        let inputs = ["sphere.stl", "moebius.obj", "plate_genus9.stl"].map(crate::support::fixture);
        let ended = out.run(&inputs.each_ref().map(AsRef::as_ref), extra);
        assert_eq!(ended.code, Some(0), "{}", ended.err);
        out
    });
    for name in ["sphere.stl", "moebius.obj", "plate_genus9.stl"] {
        assert_eq!(here.timeless(name), apart.timeless(name));
        for output in here.report(name).outputs {
            assert_eq!(here.read(name, &output.file), apart.read(name, &output.file), "{name}: {}", output.file);
        }
    }
}

/// It is for planish alone to start the process of an input.
#[test]
fn nobody_else_starts_such_a_process() {
    let w = Watched::new(&[]);
    let ended = planish(["job", "--name", "a", "--into", "b", "a.stl"].map(std::ffi::OsStr::new));
    assert_eq!(ended.code, Some(2), "{}", ended.err);
    drop(w);
}
