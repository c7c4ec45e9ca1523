//! What lies in an output folder and is not planish's stays as it is, whatever its name; and nothing there hangs anybody.

use crate::daemon::{Watched, disk};
use crate::support::{Ended, Out, planish};
use planish::outcome::Status;
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::Signal;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::time::{Duration, Instant};

const STAGING: &str = ".planish";

/// Runs a small mesh as `part.stl`; each `twist` is another surface.
fn run(out: &Out, twist: f64) -> Ended {
    out.try_bytes("part.stl", &disk(3, twist), &[])
}

fn write(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().expect("a folder")).and_then(|()| fs::write(path, text)).expect("written");
}

fn holds(path: &Path, text: &str) -> bool {
    fs::read_to_string(path).is_ok_and(|found| found == text)
}

fn pipe(path: &Path) {
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
}

#[test]
fn a_folder_with_the_report_of_another_program_is_no_result() {
    let out = Out::new();
    for report in ["{}", "results of June", r#"{"status": "certified", "outputs": []}"#] {
        write(&out.of("part.stl/report.json"), report);
        write(&out.of("part.stl/precious.txt"), "work");
        let ended = run(&out, 0.0);
        assert_eq!(ended.code, Some(1), "{}", ended.err);
        assert!(ended.err.contains("is no result of planish"), "{}", ended.err);
        assert!(holds(&out.of("part.stl/report.json"), report) && holds(&out.of("part.stl/precious.txt"), "work"));
    }
}

#[test]
fn what_others_put_into_a_result_moves_on_into_the_newer_one() {
    let out = Out::new();
    assert_eq!(run(&out, 0.0).code, Some(0));
    write(&out.of("part.stl/remeshed.msh"), "a mesh");
    write(&out.of("part.stl/notes/june.txt"), "notes");
    symlink("/etc", out.of("part.stl/link")).expect("linked");
    let older = out.report("part.stl").input.blake3;
    for twist in [1.0, 2.0] {
        assert_eq!(run(&out, twist).code, Some(0));
        assert_ne!(out.report("part.stl").input.blake3, older, "it is a newer result");
        assert!(
            holds(&out.of("part.stl/remeshed.msh"), "a mesh") && holds(&out.of("part.stl/notes/june.txt"), "notes")
        );
        assert_eq!(fs::read_link(out.of("part.stl/link")).expect("a link"), Path::new("/etc"));
    }
    let newest = out.report("part.stl").input.blake3;
    pipe(&out.of("part.stl/pipe"));
    let refused = run(&out, 3.0);
    assert!(refused.code == Some(1) && refused.err.contains("cannot be kept"), "{refused:?}");
    assert_eq!(out.report("part.stl").input.blake3, newest, "the older result is whole");
    assert!(planish(["check".as_ref(), out.of("part.stl").as_os_str()]).code == Some(0));
}

#[test]
fn links_in_the_place_of_staging_are_not_followed() {
    for linked in [STAGING, ".planish/opening", ".planish/watch.lock"] {
        let (out, elsewhere) = (Out::new(), tempfile::tempdir().expect("a folder"));
        let precious = elsewhere.path().join("run-1/precious.txt");
        write(&precious, "work");
        write(&elsewhere.path().join("opening"), "words");
        if linked == STAGING {
            symlink(elsewhere.path(), out.of(linked)).expect("linked");
        } else {
            fs::create_dir(out.of(STAGING)).expect("made");
            symlink(elsewhere.path().join("opening"), out.of(linked)).expect("linked");
        }
        let verbs: &[&str] = if linked.ends_with("watch.lock") { &["watch"] } else { &["run", "watch"] };
        for verb in verbs {
            let inputs = tempfile::tempdir().expect("a folder");
            fs::write(inputs.path().join("a.stl"), disk(3, 0.0)).expect("written");
            let args = [verb.as_ref(), inputs.path().as_os_str(), "--out".as_ref(), out.path().as_os_str()];
            let ended = planish(args);
            assert_eq!(ended.code, Some(2), "{linked}, {verb}: {}", ended.err);
            assert!(ended.err.contains("link"), "{linked}, {verb}: {}", ended.err);
        }
        assert!(holds(&precious, "work") && holds(&elsewhere.path().join("opening"), "words"), "{linked}");
        assert_eq!(fs::read_dir(elsewhere.path()).expect("there").count(), 2, "{linked}: nothing was made there");
    }
}

#[test]
fn only_abandoned_staging_of_planish_is_cleared() {
    let (out, elsewhere) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let staging = |name: &str| out.of(STAGING).join(name);
    write(&staging("run-dead/lock"), "");
    write(&staging("run-dead/half/surface.vtu"), "half");
    fs::create_dir(staging("run-never-locked")).expect("made");
    let kept = [staging("archive/work.txt"), staging("run-without-lock/work.txt"), elsewhere.path().join("work.txt")];
    kept.iter().for_each(|path| write(path, "work"));
    write(&elsewhere.path().join("lock"), "");
    symlink(elsewhere.path(), staging("run-link")).expect("linked");
    write(&staging("run-pipe/work.txt"), "work");
    pipe(&staging("run-pipe/lock"));
    assert_eq!(run(&out, 0.0).code, Some(0));
    assert!(kept.iter().all(|path| holds(path, "work")) && holds(&staging("run-pipe/work.txt"), "work"));
    assert!(!staging("run-dead").exists() && !staging("run-never-locked").exists());
}

#[test]
fn pipes_in_the_place_of_locks_and_status_hang_nobody() {
    for name in ["opening", "watch.lock", "status.json"] {
        let out = Out::new();
        fs::create_dir(out.of(STAGING)).expect("made");
        pipe(&out.of(STAGING).join(name));
        let ran = run(&out, 0.0);
        assert_eq!(ran.code, Some(if name == "opening" { 2 } else { 0 }), "{name}: {}", ran.err);
        let status = planish(["status".as_ref(), "--out".as_ref(), out.path().as_os_str()]);
        assert!(status.code.is_some(), "{name}: {status:?}");
    }
}

/// Whoever may read a file may lock it. What is locked is for the owner's eyes only; and where the lock is held anyway, as
/// by another process of the owner, nobody waits for ever, and what was asked to stop stops.
#[test]
fn a_lock_that_others_hold_delays_no_end_and_loses_nothing() {
    use std::os::unix::fs::PermissionsExt;
    let mut w = Watched::new(&[]);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    let gate = w.out.path().join(".planish/opening");
    for lock in ["opening", "watch.lock"] {
        let mode = fs::metadata(gate.with_file_name(lock)).expect("there").permissions().mode();
        assert_eq!(mode & 0o077, 0, "{lock} may be read, and so locked, by others");
    }
    let held = fs::File::open(&gate).expect("opens");
    held.lock().expect("free");
    let bytes = disk(3, 0.0);
    w.drop_in("a.stl", &bytes);
    w.wait_until("it waits for the lock", |w| w.log().contains("waits for a lock"));
    let since = Instant::now();
    w.signal(Signal::TERM);
    assert_eq!(w.wait().code(), Some(0), "{}", w.log());
    assert!(since.elapsed() < Duration::from_secs(5), "{:?}", since.elapsed());
    assert!(!w.out.of("a.stl").exists() && w.inbox().join("a.stl").exists());
    drop(held);
    w.start();
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
}
