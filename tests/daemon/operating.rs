//! What an operator has: the supervisor's messages, metrics, health, room, retention, settings that change, and retries.

use super::isolating::{children, kill_child};
use super::{Watched, disk, gltf_naming, names};
use crate::interop;
use crate::support::planish;
use planish::outcome::{Code, Status};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::ffi::OsStr;
use std::fs;
use std::os::unix::net::UnixDatagram;
use std::path::Path;
use std::time::{Duration, Instant, SystemTime};

/// What the daemon is told of its watchdog.
const WATCHDOG: Duration = Duration::from_secs(2);

const DAY: Duration = Duration::from_secs(86_400);

/// One that listens as systemd does.
struct Supervisor(UnixDatagram);

impl Supervisor {
    /// Starts the daemon, and listens.
    fn of(w: &mut Watched) -> Self {
        let path = w.beside("notify");
        let socket = UnixDatagram::bind(&path).expect("a socket");
        w.start_with(|command| {
            command.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", WATCHDOG.as_micros().to_string())
        });
        Self(socket)
    }

    /// The next message; none: none came within that time.
    fn hears(&self, patience: Duration) -> Option<String> {
        self.0.set_read_timeout(Some(patience)).expect("set");
        let mut bytes = [0; 4096];
        let length = self.0.recv(&mut bytes).ok()?;
        Some(String::from_utf8_lossy(&bytes[..length]).into_owned())
    }

    /// Waits for a message with this in it.
    fn awaits(&self, what: &str) -> String {
        let since = Instant::now();
        loop {
            assert!(since.elapsed() < super::PATIENCE, "{what} was never told");
            if let Some(message) = self.hears(Duration::from_millis(100)).filter(|message| message.contains(what)) {
                return message;
            }
        }
    }

    /// Waits until no sign of life was heard for as long as the watchdog waits.
    fn hears_no_life(&self) {
        let (since, mut last) = (Instant::now(), Instant::now());
        while last.elapsed() < WATCHDOG {
            assert!(since.elapsed() < super::PATIENCE, "it lives");
            if self.hears(Duration::from_millis(100)).is_some_and(|message| message.contains("WATCHDOG=1")) {
                last = Instant::now();
            }
        }
    }
}

#[test]
fn the_supervisor_hears_of_start_life_reload_and_end() {
    let mut w = Watched::configured("order = 1\n", &[]);
    let heard = Supervisor::of(&mut w);
    assert!(heard.hears(super::PATIENCE).expect("told").contains("READY=1"), "first of all");
    assert!(heard.awaits("STATUS=").contains("0 run, 0 wait"));
    heard.awaits("WATCHDOG=1");
    w.signal(Signal::STOP);
    heard.hears_no_life();
    w.signal(Signal::CONT);
    heard.awaits("WATCHDOG=1");
    w.signal(Signal::HUP);
    assert!(heard.awaits("RELOADING=1").contains("MONOTONIC_USEC="));
    heard.awaits("READY=1");
    w.signal(Signal::TERM);
    heard.awaits("STOPPING=1");
    assert_eq!(w.wait().code(), Some(0), "{}", w.log());
}

#[test]
fn a_supervisor_that_does_not_listen_holds_up_neither_work_nor_end() {
    let mut w = Watched::new(&[]);
    let bytes = disk(4, 0.0);
    let path = w.beside("notify");
    let _deaf = UnixDatagram::bind(&path).expect("a socket");
    // A socket that nobody reads is full after some ten or some hundred messages.
    w.start_with(|command| command.env("NOTIFY_SOCKET", &path).env("WATCHDOG_USEC", "20000"));
    std::thread::sleep(Duration::from_secs(5));
    w.drop_in("a.stl", &bytes);
    w.wait_for(&[("a.stl", &bytes)]);
    let since = Instant::now();
    w.stop();
    assert!(since.elapsed() < Duration::from_secs(8), "{:?}", since.elapsed());
}

/// The daemon itself goes on: only what it has on its way stands still.
#[test]
fn the_watchdog_hears_of_work_and_not_of_a_loop_that_turns() {
    let mut w = Watched::new(&["--jobs", "1"]);
    let large = disk(150, 0.0);
    w.drop_in("large.stl", &large);
    let heard = Supervisor::of(&mut w);
    w.wait_until("it is on its way", |w| w.is_running("large.stl") && !children(w.pid()).is_empty());
    let child = Pid::from_raw(children(w.pid())[0] as i32).expect("not 0");
    kill_process(child, Signal::STOP).expect("it lives");
    heard.hears_no_life();
    assert!(w.log().contains("nothing moves of what is on its way"), "{}", w.log());
    kill_process(child, Signal::CONT).expect("it lives");
    heard.awaits("WATCHDOG=1");
    w.wait_for(&[("large.stl", &large)]);
    w.stop();
    w.assert_complete("large.stl", Status::Certified);
}

#[test]
fn prometheus_reads_what_the_daemon_does() {
    let place = tempfile::tempdir().expect("a folder");
    let path = place.path().join("planish.prom");
    let mut w = Watched::new(&["--metrics", path.to_str().expect("UTF-8")]);
    w.start();
    w.wait_until("there are metrics", |_| path.exists());
    w.drop_in("good.stl", &disk(4, 0.0));
    w.drop_in("bad.stl", b"");
    let told = |what: &str| fs::read_to_string(&path).expect("whole").lines().any(|line| line == what);
    w.wait_until("both are counted", |_| {
        told("planish_results_total{status=\"certified\"} 1") && told("planish_results_total{status=\"refused\"} 1")
    });
    w.stop();
    let samples = interop::samples(&path);
    let value = |name: &str| -> f64 {
        let line =
            samples.lines().find_map(|line| line.strip_prefix(name)).unwrap_or_else(|| panic!("{name}: {samples}"));
        line.trim().parse().expect("a number")
    };
    assert_eq!(value("counter planish_results_total{status=certified}"), 1.0);
    assert_eq!(value("gauge planish_inputs_notable{state=aside}"), 0.0);
    assert!(value("gauge planish_last_publication_timestamp_seconds{}") > 1e9);
    assert!(value("gauge planish_free_bytes{}") > 0.0 && value("counter planish_processor_seconds_total{}") > 0.0);
    assert_eq!(names(place.path()).len(), 1, "nothing half is left");
    let inside = w.inbox().join("planish.prom");
    let refused = planish([
        "watch".as_ref(),
        w.inbox().as_os_str(),
        "--out".as_ref(),
        w.out.path().as_os_str(),
        "--metrics".as_ref(),
        inside.as_os_str(),
    ]);
    assert!(refused.code == Some(2) && refused.err.contains("the file of metrics"), "{}", refused.err);
}

/// How `planish status --health` ends, and what it says.
fn health(w: &Watched, more: &[&str]) -> (Option<i32>, String) {
    let head = ["status".as_ref(), "--health".as_ref(), "--out".as_ref(), w.out.path().as_os_str()];
    let ended = planish(head.into_iter().chain(more.iter().map(OsStr::new)));
    (ended.code, ended.out + &ended.err)
}

#[test]
fn health_is_an_exit_code_with_its_reasons() {
    let mut w = Watched::new(&[]);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    let (code, told) = health(&w, &[]);
    assert_eq!((code, told.lines().filter(|line| line.starts_with("good ")).count()), (Some(0), 8), "{told}");
    w.drop_in("waits.gltf", gltf_naming("a.bin").as_bytes());
    w.wait_until("it waits", |w| w.status()["notable"][0]["state"] == "waits");
    assert_eq!(health(&w, &[]).0, Some(0));
    let (code, told) = health(&w, &["--max-age", "0"]);
    assert!(code == Some(1) && told.contains("BAD   oldest"), "{told}");
    let (code, json) = health(&w, &["--max-age", "0", "--json"]);
    let json: Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((code, &json["health"]["healthy"], &json["running"]), (Some(1), &false.into(), &true.into()));
    w.stop();
    let (code, told) = health(&w, &[]);
    assert!(code == Some(1) && told.contains("BAD   daemon       none runs"), "{told}");
}

/// No disk has so much room; where less is asked for, all goes on by itself.
#[test]
fn without_room_no_input_is_taken_up_and_the_daemon_ends_at_once() {
    let mut w = Watched::configured("min-free = \"9999PiB\"\ndrain = true\n", &[]);
    let bytes = disk(4, 0.0);
    w.drop_in("a.stl", &bytes);
    w.start();
    w.wait_until("it waits", |w| w.status()["waiting"] == 1);
    let paused = w.status()["paused"].as_str().expect("why").to_owned();
    assert!(paused.contains("less than") && w.status()["bytes_free"].as_u64() > Some(0), "{paused}");
    let (code, told) = health(&w, &[]);
    assert!(code == Some(1) && told.contains("BAD   room"), "{told}");
    assert_eq!(w.log().matches("make room, or lower min-free").count(), 1, "told once: {}", w.log());
    let since = Instant::now();
    w.stop();
    assert!(since.elapsed() < Duration::from_secs(5) && !w.out.of("a.stl").exists());
    w.start();
    w.wait_until("it waits again", |w| w.status()["waiting"] == 1);
    fs::write(w.beside("planish.toml"), "min-free = 0\n").expect("written");
    w.signal(Signal::HUP);
    w.wait_for(&[("a.stl", &bytes)]);
    w.wait_until("that is told", |w| w.status()["paused"].is_null());
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
}

/// Makes a report older.
fn age(w: &Watched, name: &str, age: Duration) {
    let report = fs::File::options().write(true).open(w.out.of(name).join("report.json")).expect("there");
    report.set_modified(SystemTime::now() - age).expect("set");
}

#[test]
fn results_whose_time_is_over_go_when_their_input_has_gone() {
    let mut w = Watched::new(&[]);
    let bytes = disk(3, 0.0);
    let all = ["mixed.stl", "old.stl", "there.stl", "young.stl"];
    all.iter().for_each(|name| w.drop_in(name, &bytes));
    w.start();
    all.iter().for_each(|name| w.wait_for(&[(name, &bytes)]));
    w.stop();
    fs::write(w.out.of("mixed.stl").join("notes.txt"), "mine").expect("written");
    ["mixed.stl", "old.stl", "there.stl"].iter().for_each(|name| age(&w, name, 3 * DAY));
    ["mixed.stl", "old.stl", "young.stl"].iter().for_each(|name| fs::remove_file(w.inbox().join(name)).expect("there"));
    // Nothing goes that was not asked for.
    w.start();
    w.wait_until("it has looked", |w| w.logged("there.stl", "is up to date") == 1);
    w.stop();
    w.assert_tidy(&all);
    w.args.extend(["--keep-results", "2"].map(str::to_owned));
    w.start();
    w.wait_until("the old one is gone", |w| !w.out.of("old.stl").exists());
    w.wait_until("so is the other", |w| !w.out.of("mixed.stl").join("report.json").exists());
    w.wait_until("it has looked", |w| w.logged("there.stl", "is up to date") == 2);
    w.stop();
    assert_eq!(names(&w.out.of("mixed.stl")).len(), 1);
    assert!(w.log().contains("what others put there stays"), "{}", w.log());
    w.assert_tidy(&["mixed.stl", "there.stl", "young.stl"]);
}

/// The order with which a result was made.
fn order(w: &Watched, name: &str) -> Value {
    let report = fs::read(w.out.of(name).join("report.json")).unwrap_or_default();
    serde_json::from_slice::<Value>(&report).map(|report| report["settings"]["order"].clone()).unwrap_or_default()
}

#[test]
fn settings_that_change_are_taken_up_and_mistakes_are_not() {
    let mut w = Watched::configured("order = 2\n", &["--jobs", "1", "--weld", "0"]);
    let (small, large) = (disk(4, 0.0), disk(110, 0.0));
    let says = |w: &Watched, toml: &str| {
        fs::write(w.beside("planish.toml"), toml).expect("written");
        w.signal(Signal::HUP);
    };
    w.drop_in("a.stl", &small);
    w.start();
    w.wait_for(&[("a.stl", &small)]);
    w.drop_in("large.stl", &large);
    w.wait_until("one is on its way", |w| w.is_running("large.stl"));
    // What is on its way ends with the settings with which it began, and is done again.
    says(&w, "order = 1\nweld = 1e-4\nmemory = \"1GiB\"\n");
    w.wait_until("both are done again", |w| order(w, "a.stl") == 1 && order(w, "large.stl") == 1);
    // A result is in its place before that is logged.
    w.wait_until("both ends of the large one are told", |w| w.logged("large.stl", "ends") == 2);
    assert_eq!(w.out.timeless("a.stl")["settings"]["weld"], 0.0, "the command line wins");
    let waits = w.log().lines().any(|l| l.contains("wait for a new start") && l.contains("\"later\":\"memory\""));
    assert!(waits, "{}", w.log());
    for wrong in ["order = 3\n", "oder = 2\n"] {
        let before = w.log().matches("those in force stay").count();
        says(&w, wrong);
        w.wait_until("that is told", |w| w.log().matches("those in force stay").count() > before);
    }
    w.drop_in("b.stl", &small);
    w.wait_for(&[("b.stl", &small)]);
    assert_eq!((order(&w, "a.stl"), order(&w, "b.stl")), (1.into(), 1.into()));
    assert!(w.status()["last_error"]["message"].as_str().is_some_and(|m| m.contains("oder")), "{}", w.status());
    w.stop();
    ["a.stl", "b.stl", "large.stl"].iter().for_each(|name| w.assert_complete(name, Status::Certified));
}

/// As under `nohup`, which is stronger than what SIGHUP is for.
#[test]
fn a_hangup_that_is_ignored_reads_nothing() {
    let mut w = Watched::configured("order = 2\n", &[]);
    let bytes = disk(3, 0.0);
    let mut command = std::process::Command::new("sh");
    command.args(["-c", "trap '' HUP; exec \"$0\" \"$@\""]).arg(env!("CARGO_BIN_EXE_planish"));
    command.args(w.arguments()).stderr(w.log_file());
    w.start_as(&mut command);
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    fs::write(w.beside("planish.toml"), "order = 1\n").expect("written");
    w.signal(Signal::HUP);
    w.drop_in("a.stl", &bytes);
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    assert_eq!(order(&w, "a.stl"), 2);
}

#[test]
fn settings_are_checked_without_a_start() {
    let w = Watched::configured("order = 2\n", &["--check-config"]);
    let check = || planish(w.arguments());
    let good = check();
    assert!(good.code == Some(0) && good.out.contains("are good"), "{good:?}");
    assert!(names(w.out.path()).is_empty() && names(&w.inbox()).is_empty(), "nothing is written");
    for (toml, expected) in [
        ("order = 3\n", "order is 3"),
        ("[[on_certified]]\ncommand = [\"no-such-program\"]\n", "there is no program no-such-program"),
    ] {
        fs::write(w.beside("planish.toml"), toml).expect("written");
        let wrong = check();
        assert!(wrong.code == Some(2) && wrong.err.contains(expected), "{wrong:?}");
    }
    assert!(names(w.out.path()).is_empty());
}

fn retry(w: &Watched, name: &str) -> crate::support::Ended {
    planish(["retry".as_ref(), Path::new(name).as_os_str(), "--out".as_ref(), w.out.path().as_os_str()])
}

#[test]
fn a_crashed_input_is_done_again_when_somebody_asks_for_it() {
    let mut w = Watched::new(&["--jobs", "2"]);
    let large = disk(150, 0.0);
    w.drop_in("large.stl", &large);
    w.start();
    let first = kill_child(&w, None);
    kill_child(&w, Some(first));
    w.wait_for(&[("large.stl", &large)]);
    let reason = w.out.report("large.stl").reason.expect("a reason");
    assert!(reason.code == Code::Crashed && reason.message.contains("planish retry"), "{reason:?}");
    let asked = retry(&w, "large.stl");
    assert!(asked.code == Some(0) && asked.out.contains("the daemon does it again"), "{asked:?}");
    w.wait_for(&[("large.stl", &large)]);
    w.assert_complete("large.stl", Status::Certified);
    let certified = retry(&w, "large.stl");
    assert!(certified.code == Some(1) && certified.err.contains("planish run --force"), "{certified:?}");
    w.stop();
    w.assert_complete("large.stl", Status::Certified);
    w.assert_tidy(&["large.stl"]);
}

#[test]
fn only_results_of_planish_are_retried() {
    let w = Watched::new(&[]);
    w.out.try_bytes("bad.stl", b"", &[]);
    fs::write(w.out.of("bad.stl").join("notes.txt"), "mine").expect("written");
    fs::create_dir(w.out.of("foreign.stl")).expect("made");
    for (name, expected) in [
        ("bad.stl", "move them away first"),
        ("foreign.stl", "no such result"),
        ("missing.stl", "no such result"),
        ("../out", "no such result"),
    ] {
        let refused = retry(&w, name);
        assert!(refused.code == Some(1) && refused.err.contains(expected), "{refused:?}");
    }
    assert!(w.out.of("bad.stl").join("report.json").exists());
    fs::remove_file(w.out.of("bad.stl").join("notes.txt")).expect("there");
    let asked = retry(&w, "bad.stl");
    assert!(asked.code == Some(0) && asked.out.contains("the next daemon"), "{asked:?}");
    assert!(!w.out.of("bad.stl").exists());
}
