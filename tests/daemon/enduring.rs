//! What gets in the way for a while, what somebody else does to the output folder, and what is told of all that.

use super::{Watched, disk, gltf_naming, limit_handles};
use planish::outcome::Status;
use serde_json::Value;
use std::fs;
use std::time::Duration;

/// The number of the next handle that the daemon gets, when it does nothing else.
fn lowest_free_handle(w: &Watched) -> u64 {
    let lowest = || {
        let handles = fs::read_dir(format!("/proc/{}/fd", w.pid())).expect("it runs").flatten();
        let open: Vec<u64> = handles.filter_map(|e| e.file_name().to_str()?.parse().ok()).collect();
        std::thread::sleep(Duration::from_millis(10));
        (0..).find(|number| !open.contains(number)).expect("there are more")
    };
    (0..30).map(|_| lowest()).min().expect("some")
}

/// What is told of an input that is not done.
fn notable(w: &Watched, name: &str) -> Option<Value> {
    w.status()["notable"].as_array()?.iter().find(|input| input["name"] == name).cloned()
}

fn is_notable(w: &Watched, name: &str, state: &str, reason: &str) -> bool {
    notable(w, name).is_some_and(|n| n["state"] == state && n["reason"].as_str().is_some_and(|r| r.contains(reason)))
}

#[test]
fn a_lack_of_handles_refuses_nothing_and_what_is_computed_is_not_computed_again() {
    let mut w = Watched::new(&["--jobs", "1"]);
    let (first, second) = (disk(55, 0.0), disk(5, 0.0));
    w.start();
    w.wait_until("it watches", |w| w.log().contains("watches"));
    w.drop_in("first.stl", &first);
    w.wait_until("it is on its way", |w| w.logged("first.stl", "begins") == 1);
    std::thread::sleep(Duration::from_millis(50));
    limit_handles(w.pid(), 3);
    w.wait_until("its result cannot be written", |w| w.logged("first.stl", "the result is kept") == 1);
    // The inbox cannot be seen, either; once it can be, for a moment, this one cannot be opened.
    w.drop_in("second.stl", &second);
    std::thread::sleep(Duration::from_secs(3));
    assert!(!w.out.of("first.stl").exists());
    limit_handles(w.pid(), 1 << 10);
    w.wait_for(&[("first.stl", &first), ("second.stl", &second)]);
    w.stop();
    assert_eq!(w.logged("first.stl", "begins"), 1, "{}", w.log());
    ["first.stl", "second.stl"].iter().for_each(|name| w.assert_complete(name, Status::Certified));
    w.assert_tidy(&["first.stl", "second.stl"]);
}

/// Inputs that cannot be read for a passing reason are no refused ones.
#[test]
fn what_cannot_be_opened_now_is_read_later() {
    let mut w = Watched::new(&["--jobs", "1"]);
    let bytes = disk(5, 0.0);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    // Enough to look at the inbox, which takes one more, but not to open a file in the folder that was opened.
    limit_handles(w.pid(), lowest_free_handle(&w) + 1);
    w.drop_in("a.stl", &bytes);
    // The status has no room for its handles, either.
    w.wait_until("it is tried again", |w| w.logged("a.stl", "cannot read the file: Too many open files") > 0);
    assert!(!w.out.of("a.stl").exists());
    limit_handles(w.pid(), 1 << 10);
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
}

/// What cannot be seen for a moment is not gone.
#[test]
fn a_folder_that_cannot_be_read_now_cancels_nothing() {
    let mut w = Watched::new(&["--jobs", "1", "--recursive"]);
    fs::create_dir(w.inbox().join("sub")).expect("made");
    let bytes = disk(120, 0.0);
    w.drop_in("sub/a.stl", &bytes);
    w.start();
    w.wait_until("it is on its way", |w| w.is_running("sub/a.stl"));
    // Enough for the inbox, but not for what is in it.
    limit_handles(w.pid(), lowest_free_handle(&w) + 1);
    fs::write(w.inbox().join("hint.stl~"), "").expect("written");
    std::thread::sleep(Duration::from_secs(2));
    limit_handles(w.pid(), 1 << 10);
    w.wait_for(&[("sub/a.stl", &bytes)]);
    w.stop();
    assert_eq!(w.logged("sub/a.stl", "begins"), 1, "{}", w.log());
    assert!(!w.log().contains("the job is cancelled"), "{}", w.log());
}

#[test]
fn a_result_that_is_removed_is_made_again() {
    let mut w = Watched::new(&[]);
    let bytes = disk(5, 0.0);
    w.drop_in("a.stl", &bytes);
    w.start();
    w.wait_for(&[("a.stl", &bytes)]);
    fs::remove_dir_all(w.out.of("a.stl")).expect("removed");
    w.wait_until("it is made again", |w| w.out.of("a.stl").exists());
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
    assert_eq!(w.logged("a.stl", "ends"), 2);
}

/// Somebody tidies up, and removes what they do not know.
#[test]
fn a_hidden_folder_that_is_removed_is_made_again() {
    let mut w = Watched::new(&[]);
    let bytes = disk(5, 0.0);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    fs::remove_dir_all(w.out.path().join(".planish")).expect("removed");
    w.drop_in("a.stl", &bytes);
    w.wait_for(&[("a.stl", &bytes)]);
    let second = crate::support::planish(w.arguments());
    assert!(second.code == Some(2) && second.err.contains("another planish watch"), "{}", second.err);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
    w.assert_tidy(&["a.stl"]);
}

/// What was written through shared memory after it was processed shows in nothing but the content.
#[test]
fn what_stays_is_looked_at_once_more() {
    let mut w = Watched::new(&[]);
    let [older, newer] = [0.0, 1.0].map(|twist| disk(5, twist));
    w.drop_in("a.stl", &older);
    let path = w.inbox().join("a.stl");
    w.start();
    w.wait_for(&[("a.stl", &older)]);
    let mut map = std::process::Command::new("python3");
    map.args(["-c", WRITE_THROUGH_MEMORY]).arg(&path).arg(w.beside("newer"));
    fs::write(w.beside("newer"), &newer).expect("written");
    assert!(map.status().expect("python3").success());
    w.wait_for(&[("a.stl", &newer)]);
    w.stop();
    w.assert_complete("a.stl", Status::Certified);
}

/// Writes a file's content over another one's of the same size.
const WRITE_THROUGH_MEMORY: &str = "
import mmap, sys
with open(sys.argv[1], 'r+b') as f, open(sys.argv[2], 'rb') as newer:
    m = mmap.mmap(f.fileno(), 0)
    m[:] = newer.read()
";

#[test]
fn every_input_that_is_not_done_is_named_with_its_reason() {
    let mut w = Watched::new(&[]);
    fs::create_dir(w.out.of("foreign.stl")).expect("made");
    fs::write(w.out.of("foreign.stl").join("work.txt"), "work").expect("written");
    w.drop_in("waits.gltf", gltf_naming("data.bin").as_bytes());
    w.drop_in("foreign.stl", &disk(4, 0.0));
    w.start();
    w.wait_until("it waits for its data", |w| is_notable(w, "waits.gltf", "waits", "data.bin"));
    w.wait_until("its result has no place", |w| is_notable(w, "foreign.stl", "aside", "is no result of planish"));
    let changing = w.inbox().join("changing.stl");
    let mut size = 0;
    w.wait_until("it is seen changing", |w| {
        size += 1;
        fs::write(&changing, vec![b' '; size]).expect("written");
        is_notable(w, "changing.stl", "unsettled", "changes")
    });
    w.wait_until("people are told, too", |w| {
        let args = ["status".as_ref(), "--out".as_ref(), w.out.path().as_os_str()];
        let text = crate::support::planish(args).out;
        text.contains("waits        waits.gltf: ")
            && text.contains("data.bin")
            && text.contains("aside        foreign.stl")
    });
    assert_eq!(w.logged("foreign.stl", "the result is not written"), 1, "{}", w.log());
    assert!(w.status()["oldest"].as_f64().is_some_and(|seconds| seconds > 0.0));
    w.stop();
}
