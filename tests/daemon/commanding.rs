//! Commands that take results away, hang, outlive the daemon, or cannot be started.

use super::chaining::account;
use super::putting_away::{NOBODY, can_be_nobody, open_for_nobody};
use super::{Watched, disk, names, runs};
use crate::support::Out;
use rustix::process::{Pid, Signal, geteuid, kill_process};
use std::fs;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Duration;

fn lines(path: &Path) -> usize {
    fs::read_to_string(path).unwrap_or_default().lines().count()
}

/// Settings with one command: this script, which gets the arguments behind it.
fn script(script: &str, arguments: &[&str]) -> String {
    let arguments: Vec<String> = arguments.iter().map(|a| format!("\"{a}\"")).collect();
    format!("[[on_certified]]\ncommand = [\"sh\", \"-c\", '''{script}''', \"sh\", {}]\n", arguments.join(", "))
}

/// What is done again comes again after half a minute.
#[test]
fn a_command_that_takes_the_result_is_told_once_and_not_fed_again() {
    let place = tempfile::tempdir().expect("a folder");
    let runs = |name: &str| lines(&place.path().join(name).join("runs"));
    ["moves.stl", "removes.stl", "copies.stl"].iter().for_each(|name| {
        fs::create_dir(place.path().join(name)).expect("made");
    });
    let takes = "cd \"$3/$2\"; echo run >> runs
        case $2 in
        moves.stl) rm -rf taken; mv \"$1\" taken;;
        removes.stl) rm \"$1/report.json\";;
        copies.stl) cp -r \"$1\" copy;;
        esac";
    let takes = script(takes, &["{folder}", "{name}", place.path().to_str().expect("UTF-8")]);
    let mut w = Watched::configured(&takes, &[]);
    let (old, new) = (disk(4, 0.0), disk(4, 1.0));
    ["moves.stl", "removes.stl", "copies.stl"].iter().for_each(|name| w.drop_in(name, &old));
    w.start();
    let told = |w: &Watched, name: &str| w.logged(name, "command 1 on the result");
    w.wait_until("all are done with", |w| {
        told(w, "moves.stl") == 1 && told(w, "removes.stl") == 1 && account(w, "copies.stl").is_some()
    });
    std::thread::sleep(Duration::from_secs(34));
    for name in ["moves.stl", "removes.stl"] {
        assert_eq!((runs(name), told(&w, name)), (1, 1), "{name}: {}", w.log());
    }
    assert_eq!((runs("copies.stl"), told(&w, "copies.stl")), (1, 0));
    assert!(w.log().contains("--inputs move:DIR"));
    assert_eq!(names(&w.inbox()).len(), 3, "inputs stay");
    // It is a new one when it changes, and when the daemon is started anew.
    w.drop_in("moves.stl", &new);
    w.wait_until("the newer one is done", |w| told(w, "moves.stl") == 2);
    w.stop();
    w.start();
    w.wait_until("it is done again", |w| told(w, "moves.stl") == 3);
    w.stop();
    assert_eq!(runs("moves.stl"), 3);
}

#[test]
fn a_run_whose_command_takes_the_result_says_so() {
    let folder = tempfile::tempdir().expect("a folder");
    let config = folder.path().join("planish.toml");
    fs::write(&config, script("mv \"$1\" \"$1.taken\"", &["{folder}"])).expect("written");
    let out = Out::new();
    let config = config.to_str().expect("UTF-8");
    let ended = out.try_bytes("a.stl", &disk(4, 0.0), &["--config", config]);
    assert_eq!(ended.code, Some(1));
    assert!(ended.err.contains("certified, but command 1 on the result"), "{}", ended.err);
    assert!(out.of("a.stl.taken").join("surface.vtu").exists());
}

#[test]
fn commands_that_hang_do_not_hold_up_all_others() {
    for jobs in ["1", "2"] {
        let hangs = script("case $1 in hangs*) sleep 600;; esac", &["{name}"]);
        let mut w = Watched::configured(&hangs, &["--jobs", jobs]);
        let bytes = disk(4, 0.0);
        w.start();
        ["hangs-0.stl", "hangs-1.stl"].iter().for_each(|name| w.drop_in(name, &bytes));
        w.wait_until("both hang", |w| {
            let running = w.status()["running"].as_array().cloned().unwrap_or_default();
            running.iter().filter(|job| job["stage"] == "chain").count() == 2
        });
        let others = ["a.stl", "b.stl", "c.stl", "d.stl"];
        others.iter().for_each(|name| w.drop_in(name, &bytes));
        w.wait_until("the others are done", |w| others.iter().all(|name| account(w, name).is_some()));
        assert!(account(&w, "hangs-0.stl").is_none() && account(&w, "hangs-1.stl").is_none());
        w.stop();
    }
}

#[test]
fn as_many_commands_run_at_once_as_is_said() {
    let place = tempfile::tempdir().expect("a folder");
    let counts = "cd \"$1\"; touch $$; ls | grep -c '[0-9]' >> counts; sleep 1; rm $$";
    let counts = script(counts, &[place.path().to_str().expect("UTF-8")]);
    for (commands, most) in [("1", 1), ("3", 3)] {
        let mut w = Watched::configured(&counts, &["--jobs", "1", "--commands", commands]);
        let inputs: Vec<String> = (0..6).map(|i| format!("{i}.stl")).collect();
        inputs.iter().for_each(|name| w.drop_in(name, &disk(4, 0.0)));
        w.start();
        w.wait_until("all are done", |w| inputs.iter().all(|name| account(w, name).is_some()));
        w.stop();
        let counted = fs::read_to_string(place.path().join("counts")).expect("written");
        let counted = counted.lines().map(|line| line.parse::<usize>().expect("a number")).max();
        assert_eq!(counted, Some(most));
    }
}

/// A command that tells where it runs beside itself, and leaves a process behind that is meant to live on.
const EXCLUSIVE: &str = "
    cd \"$1\"
    exec 9>> lock
    flock -n 9 || echo overlap >> overlaps
    setsid sh -c 'echo $$ >> survivors; exec sleep 120' 9>&- > survivors.log 2>&1 &
    until test -s survivors; do sleep 0.01; done
    echo run >> runs
    sleep 600 &
    wait";

/// Waits until a command runs that writes its number to `begun`; that number.
fn begun(w: &Watched) -> String {
    let begun = w.out.of("a.stl").join("begun");
    w.wait_until("the command runs", |_| fs::read_to_string(&begun).is_ok_and(|id| !id.is_empty()));
    fs::read_to_string(&begun).expect("written").trim().to_owned()
}

#[test]
fn a_command_that_outlives_planish_ends_before_it_runs_again() {
    if !cfg!(target_os = "linux") || Command::new("flock").arg("--version").output().is_err() {
        eprintln!("skipped: there is no flock (util-linux), or no /proc");
        return;
    }
    for (stubborn, begins_with_run) in [("", false), ("trap '' TERM", false), ("", true)] {
        let place = tempfile::tempdir().expect("a folder");
        let command = script(&format!("{stubborn}{EXCLUSIVE}"), &[place.path().to_str().expect("UTF-8")]);
        let mut w = Watched::configured(&command, &[]);
        w.drop_in("a.stl", &disk(4, 0.0));
        let begun = place.path().join("runs");
        if begins_with_run {
            let (input, config) = (w.inbox().join("a.stl"), w.beside("planish.toml"));
            let mut run = Command::new(env!("CARGO_BIN_EXE_planish"));
            run.arg("run").arg(input).arg("--out").arg(w.out.path()).arg("--config").arg(config);
            w.start_as(run.stdout(Stdio::null()).stderr(Stdio::null()));
        } else {
            w.start();
        }
        w.wait_until("the command runs", |_| lines(&begun) == 1);
        w.kill();
        w.start();
        w.wait_until("it runs again", |_| lines(&begun) == 2);
        let overlaps = lines(&place.path().join("overlaps"));
        let survivors = fs::read_to_string(place.path().join("survivors")).expect("written");
        let alive = survivors.lines().filter(|id| runs(id)).count();
        w.stop();
        for id in survivors.lines().filter_map(|id| Pid::from_raw(id.parse().ok()?)) {
            let _ = kill_process(id, Signal::KILL);
        }
        assert_eq!((overlaps, alive), (0, survivors.lines().count()), "{}", w.log());
        assert!(w.log().contains("a command that planish has left running is ended"), "{}", w.log());
    }
}

/// The daemon waits for no child that has left its group, and what that prints fills no disk.
#[test]
fn what_an_escaped_child_prints_goes_nowhere() {
    let escapes = "setsid sh -c 'echo $$ > child; while :; do echo x; done' & until test -s child; do sleep 0.01; done";
    let mut w = Watched::configured(&script(&format!("cd \"$1\"; {escapes}"), &["{folder}"]), &[]);
    w.drop_in("a.stl", &disk(4, 0.0));
    w.start();
    w.wait_until("the command has ended", |w| account(w, "a.stl").is_some());
    assert_eq!(account(&w, "a.stl").expect("there")["commands"][0]["outcome"], "succeeded");
    let child = fs::read_to_string(w.out.of("a.stl").join("child")).expect("written");
    let ends = (0..500).any(|_| {
        std::thread::sleep(Duration::from_millis(20));
        !runs(child.trim())
    });
    if !ends {
        let _ = kill_process(Pid::from_raw(child.trim().parse().expect("a number")).expect("not 0"), Signal::KILL);
    }
    assert!(ends, "it prints on");
    w.stop();
}

/// Who asks twice does not want to wait; but nothing is left behind for that.
#[test]
fn a_stubborn_command_does_not_outlive_a_daemon_that_is_told_twice_to_stop() {
    let stubborn = script("trap '' TERM; echo $$ > begun; while :; do sleep 1; done", &["{folder}"]);
    let mut w = Watched::configured(&stubborn, &[]);
    w.drop_in("a.stl", &disk(4, 0.0));
    w.start();
    let command = begun(&w);
    w.signal(Signal::TERM);
    std::thread::sleep(Duration::from_millis(300));
    w.stop();
    assert!(!runs(&command), "{}", w.log());
    w.assert_tidy(&["a.stl"]);
}

/// A planish that lives ends its commands itself.
#[test]
fn commands_of_another_process_that_lives_are_left_alone() {
    let waits = script("echo $$ > begun; until test -e go; do sleep 0.02; done", &["{folder}"]);
    let mut w = Watched::configured(&waits, &[]);
    w.drop_in("a.stl", &disk(4, 0.0));
    w.start();
    let command = begun(&w);
    w.out.try_bytes("b.stl", &disk(4, 1.0), &[]);
    assert!(runs(&command));
    fs::write(w.out.of("a.stl").join("go"), "").expect("written");
    w.wait_until("it has ended", |w| account(w, "a.stl").is_some());
    assert_eq!(account(&w, "a.stl").expect("there")["commands"][0]["outcome"], "succeeded");
    w.stop();
}

/// As a user who is not root: that one has no such limit.
fn as_other(command: &mut Command) -> &mut Command {
    if geteuid().is_root() { command.uid(NOBODY).gid(NOBODY) } else { command }
}

/// Sets the limit of processes of a running program; the hard limit stays.
fn limit_processes(id: u32, most: &str) -> bool {
    let mut command = Command::new("prlimit");
    command.args(["--pid", &id.to_string(), &format!("--nproc={most}:")]).stderr(Stdio::null());
    as_other(&mut command).status().is_ok_and(|status| status.success())
}

#[test]
fn where_no_process_can_be_started_now_commands_run_later() {
    if geteuid().is_root() && !can_be_nobody() {
        eprintln!("skipped: root may start any number, and the program cannot be run as another user");
        return;
    }
    let mut w = Watched::configured(&script("echo done", &[""]), &[]);
    if geteuid().is_root() {
        open_for_nobody(&w);
    }
    w.start_with(as_other);
    w.wait_until("it watches", |w| w.log().contains("\"watches\""));
    if !limit_processes(w.pid(), "1") {
        eprintln!("skipped: there is no prlimit (util-linux)");
        return;
    }
    w.drop_in("a.stl", &disk(4, 0.0));
    w.wait_until("the command is tried", |w| account(w, "a.stl").is_some() || w.logged("a.stl", "command") > 0);
    assert!(account(&w, "a.stl").is_none(), "no fault of the command: {}", w.log());
    assert_eq!(w.logged("a.stl", "command sh cannot be started now"), 1, "{}", w.log());
    assert!(limit_processes(w.pid(), "1000"));
    w.wait_until("it has run", |w| account(w, "a.stl").is_some());
    assert_eq!(account(&w, "a.stl").expect("there")["commands"][0]["outcome"], "succeeded");
    w.stop();
}
