//! Asked to stop, politely or not.

use super::{Watched, disk};
use planish::outcome::Status;
use rustix::process::Signal;
use std::time::{Duration, Instant};

#[test]
fn the_daemon_ends_within_seconds_wherever_its_jobs_are() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let large = [0.0, 1.0, 2.0].map(|twist| disk(220, twist));
    for (i, bytes) in large.iter().enumerate() {
        w.drop_in(&format!("large-{i}.stl"), bytes);
    }
    for (round, signal) in
        [Signal::TERM, Signal::INT, Signal::TERM, Signal::HUP, Signal::TERM, Signal::TERM].into_iter().enumerate()
    {
        w.start();
        w.wait_until("a job is on its way", |w| (0..3).any(|i| w.is_running(&format!("large-{i}.stl"))));
        std::thread::sleep(Duration::from_millis(300 * round as u64));
        let since = Instant::now();
        w.signal(signal);
        assert_eq!(w.wait().code(), Some(0), "{}", w.log());
        eprintln!("{signal:?} under load: {:?}", since.elapsed());
        // The promise itself: the one place where a test looks at the clock.
        assert!(since.elapsed() < Duration::from_secs(5), "{signal:?}: {:?}", since.elapsed());
        let done: Vec<String> = (0..3).map(|i| format!("large-{i}.stl")).filter(|n| w.out.of(n).exists()).collect();
        let done: Vec<&str> = done.iter().map(String::as_str).collect();
        done.iter().for_each(|name| w.assert_complete(name, Status::Certified));
        w.assert_tidy(&done);
        if done.len() == 3 {
            break;
        }
    }
}

#[test]
fn what_waits_is_finished_first_when_asked_for() {
    let mut w = Watched::new(&["--drain", "--jobs", "1"]);
    let inputs: Vec<(String, Vec<u8>)> =
        (0..8).map(|i| (format!("{i}.stl"), disk(if i == 0 { 120 } else { 12 }, f64::from(i)))).collect();
    inputs.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    w.start();
    w.wait_until("the first is on its way", |w| w.is_running("0.stl"));
    w.stop();
    let names: Vec<&str> = inputs.iter().map(|(name, _)| name.as_str()).collect();
    names.iter().for_each(|name| w.assert_complete(name, Status::Certified));
    w.assert_tidy(&names);
    // Asked twice, it does not finish.
    w.drop_in("0.stl", &disk(220, 9.0));
    w.start();
    w.wait_until("it is on its way", |w| w.is_running("0.stl"));
    w.signal(Signal::TERM);
    w.wait_until("it drains", |w| w.status()["draining"] == true);
    let since = Instant::now();
    w.stop();
    assert!(since.elapsed() < Duration::from_secs(5));
    w.assert_complete("0.stl", Status::Certified);
    assert!(w.is_done("0.stl", &inputs[0].1), "the older result stays");
}

/// `planish run` is interrupted the same way.
#[test]
fn a_run_that_is_interrupted_publishes_nothing_half() {
    let w = Watched::new(&[]);
    let paths: Vec<_> = (0..2).map(|i| w.inbox().join(format!("{i}.stl"))).collect();
    paths.iter().zip([6, 250]).for_each(|(path, n)| std::fs::write(path, disk(n, 0.0)).expect("written"));
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_planish"));
    command.arg("run").args(&paths).arg("--out").arg(w.out.path()).stdout(std::process::Stdio::piped());
    let run = command.spawn().expect("starts");
    w.wait_until("the small one is done", |w| w.out.of("0.stl").exists());
    super::send(&run, Signal::TERM);
    let output = run.wait_with_output().expect("ends");
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.code() == Some(1) && said.contains("interrupted"), "{said}");
    w.assert_complete("0.stl", Status::Certified);
    assert_eq!(super::names(w.out.path()).len(), 2, "the other result is not there");
    assert_eq!(super::names(&w.out.path().join(".planish")).len(), 1, "nor anything on its way");
}

/// A run does not put the result of what it has read in the place of that of newer content.
#[test]
fn a_run_whose_input_changes_meanwhile_publishes_nothing() {
    let w = Watched::new(&[]);
    let path = w.inbox().join("a.stl");
    std::fs::write(&path, disk(150, 0.0)).expect("written");
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_planish"));
    command.args(["run", "-v"]).arg(&path).arg("--out").arg(w.out.path());
    let log = std::fs::File::create(w.beside("log")).expect("a log");
    let mut run = command.stderr(log).stdout(std::process::Stdio::null()).spawn().expect("starts");
    w.wait_until("it has begun", |w| w.log().contains("begins"));
    std::thread::sleep(Duration::from_millis(500));
    w.drop_in("a.stl", &disk(4, 1.0));
    assert_eq!(run.wait().expect("ends").code(), Some(1));
    assert!(w.log().contains("it changed while") && !w.out.of("a.stl").exists(), "{}", w.log());
}

#[test]
fn an_output_folder_that_is_removed_ends_the_daemon() {
    let mut w = Watched::new(&[]);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    std::fs::remove_dir_all(w.out.path()).expect("removed");
    assert_eq!(w.wait().code(), Some(2));
    assert!(w.log().contains("the output folder was removed"), "{}", w.log());
}

/// Nor does a command go on for whose result there is no place.
#[test]
fn commands_end_with_a_daemon_whose_output_folder_is_gone() {
    let mut w = Watched::configured(
        "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"echo $$ > {input}.pid; exec sleep 1000\"]\n",
        &[],
    );
    w.drop_in("a.stl", &disk(4, 0.0));
    w.start();
    let pid = w.inbox().join("a.stl.pid");
    w.wait_until("the command runs", |w| w.status()["running"][0]["stage"] == "chain" && pid.exists());
    let id = std::fs::read_to_string(&pid).expect("a number");
    std::fs::remove_dir_all(w.out.path()).expect("removed");
    assert_eq!(w.wait().code(), Some(2));
    assert!(!super::runs(id.trim()), "it goes on");
}

/// As under `nohup`: what was ignored when the daemon was started stays ignored.
#[test]
fn a_hangup_that_is_ignored_at_the_start_ends_nothing() {
    let mut w = Watched::new(&[]);
    let real = env!("CARGO_BIN_EXE_planish");
    let script = format!("trap '' HUP; exec {real} watch {} --out {}", w.inbox().display(), w.out.path().display());
    w.start_as(std::process::Command::new("sh").args(["-c", &script]));
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    w.signal(Signal::HUP);
    let bytes = disk(3, 0.0);
    w.drop_in("a.stl", &bytes);
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
}

#[test]
fn a_reader_of_the_log_that_stands_still_holds_up_neither_work_nor_end() {
    let mut w = Watched::new(&["-vvv"]);
    let inputs: Vec<(String, Vec<u8>)> = (0..300).map(|i| (format!("{i}.stl"), disk(2, f64::from(i)))).collect();
    inputs.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    // A pipe that nobody reads is full after some hundred lines.
    w.start_with(|command| command.stderr(std::process::Stdio::piped()));
    w.wait_for(&inputs.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])).collect::<Vec<_>>());
    let since = Instant::now();
    w.signal(Signal::TERM);
    assert_eq!(w.wait().code(), Some(0));
    assert!(since.elapsed() < Duration::from_secs(8), "{:?}", since.elapsed());
}
