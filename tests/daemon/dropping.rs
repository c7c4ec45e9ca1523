//! What is dropped, replaced, removed, copied slowly, linked, moved: and what comes of it.

use super::{Watched, disk, names, write_slowly};
use crate::support::{fixture, planish};
use planish::outcome::Status;
use rustix::process::Signal;
use std::fs;
use std::time::Duration;

/// The scene: all at once.
#[test]
fn every_file_ends_as_its_last_content_deserves() {
    let mut w = Watched::new(&["--jobs", "2"]);
    w.start();
    let three = ["disk.stl", "sphere.stl", "moebius.obj"].map(|n| (n, fs::read(fixture(n)).expect("a fixture")));
    three.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    let [old, new, removed, slow] = [(150, 0.0), (20, 1.0), (150, 2.0), (30, 3.0)].map(|(n, twist)| disk(n, twist));
    w.drop_in("replaced.stl", &old);
    w.drop_in("removed.stl", &removed);
    w.drop_in("garbage.stl", b"garbage");
    let path = w.inbox().join("slow.stl");
    let copy = {
        let slow = slow.clone();
        std::thread::spawn(move || write_slowly(&path, &slow, 20, Duration::from_millis(200)))
    };
    w.wait_until("replaced.stl is processed", |w| w.is_running("replaced.stl"));
    w.drop_in("replaced.stl", &new);
    w.wait_until("removed.stl is processed", |w| w.is_running("removed.stl"));
    fs::remove_file(w.inbox().join("removed.stl")).expect("removed");
    copy.join().expect("copied");
    w.wait_for(&three.each_ref().map(|(name, bytes)| (*name, &bytes[..])));
    w.wait_for(&[("replaced.stl", &new), ("slow.stl", &slow), ("garbage.stl", b"garbage")]);
    let certified = ["disk.stl", "sphere.stl", "moebius.obj", "replaced.stl", "slow.stl"];
    certified.iter().for_each(|name| w.wait_until(&format!("{name} ends"), |w| w.logged(name, "ends") > 0));
    w.stop();
    for name in certified {
        w.assert_complete(name, Status::Certified);
        assert_eq!(w.logged(name, "ends"), 1, "{name}: once\n{}", w.log());
    }
    w.assert_complete("garbage.stl", Status::Refused);
    assert_eq!((w.logged("garbage.stl", "refused"), w.logged("removed.stl", "ends")), (1, 0));
    w.assert_tidy(&[&certified[..], &["garbage.stl"]].concat());
}

#[test]
fn what_is_done_is_not_done_again_until_it_changes() {
    let mut w = Watched::new(&[]);
    let (first, second) = (disk(6, 0.0), disk(6, 1.0));
    w.drop_in("a.stl", &first);
    w.drop_in("garbage.stl", b"garbage");
    w.start();
    w.wait_for(&[("a.stl", &first), ("garbage.stl", b"garbage")]);
    w.stop();
    w.start();
    w.wait_until("both are looked at", |w| {
        w.logged("a.stl", "is up to date") == 1 && w.logged("garbage.stl", "is up to date") == 1
    });
    // The same content under a new time, as an editor saves it; then other content.
    w.drop_in("a.stl", &first);
    w.wait_until("it is looked at again", |w| w.logged("a.stl", "is up to date") == 2);
    w.drop_in("a.stl", &second);
    w.wait_for(&[("a.stl", &second)]);
    w.wait_until("it is done twice", |w| w.logged("a.stl", "ends") == 2);
    // What was harmed is made again at the next start.
    w.stop();
    fs::remove_file(w.out.of("a.stl").join("param.vtu")).expect("removed");
    w.start();
    w.wait_until("it is made again", |w| w.out.of("a.stl").join("param.vtu").exists());
    w.assert_complete("a.stl", Status::Certified);
    w.stop();
    w.assert_tidy(&["a.stl", "garbage.stl"]);
}

#[test]
fn an_inbox_that_is_removed_and_made_again_is_watched_again() {
    for args in [&[][..], &["--poll"]] {
        let mut w = Watched::new(args);
        w.start();
        let [a, b] = [0.0, 1.0].map(|twist| disk(5, twist));
        w.drop_in("a.stl", &a);
        w.wait_for(&[("a.stl", &a)]);
        fs::remove_dir_all(w.inbox()).expect("removed");
        w.wait_until("that is seen", |w| w.log().contains("cannot see the inbox"));
        fs::create_dir(w.inbox()).expect("made again");
        w.drop_in("b.stl", &b);
        w.wait_for(&[("b.stl", &b)]);
        w.stop();
        w.assert_tidy(&["a.stl", "b.stl"]);
    }
}

#[test]
fn sub_folders_are_watched_when_asked_for_and_sidecars_never() {
    for (args, deep) in [(&[][..], false), (&["--recursive"], true)] {
        let mut w = Watched::new(args);
        w.start();
        let bytes = disk(5, 0.0);
        fs::create_dir_all(w.inbox().join("sub/deeper")).expect("made");
        for name in ["top.stl", "top.mtl", ".hidden.stl", "top.stl.part", "notes.xyz", "sub/deeper/down.stl"] {
            w.drop_in(name, &bytes);
        }
        fs::hard_link(w.inbox().join("top.stl"), w.inbox().join("link.stl")).expect("linked");
        w.wait_for(&[("top.stl", &bytes), ("link.stl", &bytes)]);
        if deep {
            w.wait_for(&[("sub/deeper/down.stl", &bytes)]);
            w.assert_complete("sub/deeper/down.stl", Status::Certified);
            assert_eq!(w.out.report("sub/deeper/down.stl").input.name, "sub/deeper/down.stl");
        }
        w.stop();
        w.assert_tidy(if deep { &["top.stl", "link.stl", "sub"] } else { &["top.stl", "link.stl"] });
    }
}

/// Nobody reads what is said: the disk of the log is full, say.
#[cfg(target_os = "linux")]
#[test]
fn a_log_that_cannot_be_written_stops_nothing() {
    let mut w = Watched::new(&[]);
    let bytes = disk(5, 0.0);
    w.drop_in("a.stl", &bytes);
    w.drop_in("garbage.stl", b"garbage");
    let full = || fs::File::options().write(true).open("/dev/full").expect("a device");
    w.start_with(|command| command.stderr(full()));
    w.wait_for(&[("a.stl", &bytes), ("garbage.stl", b"garbage")]);
    w.stop();
    let mut run = std::process::Command::new(env!("CARGO_BIN_EXE_planish"));
    run.arg("run").arg(w.inbox()).arg("--out").arg(w.out.path()).stdout(full()).stderr(full());
    assert_eq!(run.status().expect("runs").code(), Some(1), "one is refused");
}

#[test]
fn folders_in_each_other_and_second_daemons_are_refused() {
    let mut w = Watched::new(&[]);
    let inbox = w.inbox();
    let refused = |args: &[&std::ffi::OsStr]| {
        let ended = planish(args);
        assert_eq!(ended.code, Some(2), "{}", ended.err);
        ended.err
    };
    let inside = inbox.join("out");
    let said = refused(&["watch".as_ref(), inbox.as_ref(), "--out".as_ref(), inside.as_ref()]);
    assert!(said.contains("lie in each other") && !inside.exists(), "{said}");
    refused(&["watch".as_ref(), inside.as_ref(), "--out".as_ref(), inbox.as_ref()]);
    let moved = format!("move:{}", inbox.join("done").display());
    let out = w.out.path().to_owned();
    let base: [&std::ffi::OsStr; 4] = ["watch".as_ref(), inbox.as_ref(), "--out".as_ref(), out.as_ref()];
    refused(&[&base[..], &["--inputs".as_ref(), moved.as_ref()]].concat());
    refused(&["watch".as_ref(), w.beside("none").as_ref(), "--out".as_ref(), out.as_ref()]);
    assert!(names(&out).is_empty(), "nothing was written");
    w.start();
    w.wait_until("it watches", |w| w.log().contains("watches"));
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    let said = refused(&base);
    assert!(said.contains(&format!("process {}", w.pid())), "{said}");
    w.stop();
}

#[test]
fn the_status_tells_what_is_done_and_what_runs() {
    let mut w = Watched::new(&["--jobs", "1"]);
    let out = w.out.path().to_owned();
    let status = |json: bool| {
        let mut args: Vec<&std::ffi::OsStr> = vec!["status".as_ref(), "--out".as_ref(), out.as_ref()];
        args.extend(json.then_some(std::ffi::OsStr::new("--json")));
        planish(args)
    };
    let idle = status(false);
    assert!(idle.code == Some(1) && idle.out.starts_with("no daemon runs"), "{}", idle.out);
    let small = disk(5, 0.0);
    w.drop_in("small.stl", &small);
    w.drop_in("garbage.stl", b"garbage");
    (0..4).for_each(|i| w.drop_in(&format!("large-{i}.stl"), &disk(150, f64::from(i))));
    w.start();
    w.wait_for(&[("small.stl", &small), ("garbage.stl", b"garbage")]);
    w.wait_until("a large one is on its way", |w| (0..4).any(|i| w.is_running(&format!("large-{i}.stl"))));
    let told = status(true);
    let json: serde_json::Value = serde_json::from_str(&told.out).expect("JSON");
    assert_eq!((told.code, &json["running"], &json["daemon"]["pid"]), (Some(0), &true.into(), &w.pid().into()));
    assert_eq!(json["refusals"][0]["code"], "malformed");
    assert!(json["daemon"]["running"][0]["name"].as_str().is_some_and(|n| n.starts_with("large-")), "{}", told.out);
    let text = status(false).out;
    assert!(text.contains("large-") && text.contains("garbage.stl: ") && text.contains("1 refused"), "{text}");
    w.kill();
    let text = status(false);
    assert!(text.code == Some(1) && text.out.contains("was killed while it did this"), "{}", text.out);
}

/// A document and its data: a disk in glTF.
fn gltf(n: u32, twist: f64) -> (String, Vec<u8>) {
    let soup = planish_core::shapes::disk(n);
    let coordinates = soup.points().iter().flatten().map(|x| (x * (1.0 + 1e-3 * twist)) as f32);
    let mut data: Vec<u8> = coordinates.flat_map(f32::to_le_bytes).collect();
    let (points, corners) = (soup.points().len(), 3 * soup.triangles().len());
    data.extend(soup.triangles().iter().flatten().flat_map(|i| i.to_le_bytes()));
    let document = serde_json::json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": points, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": corners, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 12 * points},
            {"buffer": 0, "byteOffset": 12 * points, "byteLength": 4 * corners}
        ],
        "buffers": [{"byteLength": data.len(), "uri": "a%20disk.bin"}]
    });
    (document.to_string(), data)
}

#[test]
fn a_document_waits_for_the_data_that_it_names_and_follows_their_changes() {
    let mut w = Watched::new(&["--inputs", "delete"]);
    w.start();
    let (document, data) = gltf(6, 0.0);
    w.drop_in("a.gltf", document.as_bytes());
    w.wait_until("it waits", |w| w.log().contains("waits: "));
    assert!(!w.out.of("a.gltf").exists());
    write_slowly(&w.inbox().join("a disk.bin"), &data, 8, Duration::from_millis(200));
    w.wait_for(&[("a.gltf", document.as_bytes())]);
    w.assert_complete("a.gltf", Status::Certified);
    let beside = |w: &Watched| w.out.report("a.gltf").input.beside[0].blake3.clone();
    assert_eq!(beside(&w), blake3::hash(&data).to_hex().as_str());
    let (_, newer) = gltf(6, 1.0);
    w.drop_in("a disk.bin", &newer);
    w.wait_until("newer data are processed", |w| beside(w) == blake3::hash(&newer).to_hex().as_str());
    w.assert_complete("a.gltf", Status::Certified);
    w.stop();
    assert!(w.inbox().join("a.gltf").exists() && w.inbox().join("a disk.bin").exists(), "both stay, together");
    w.start();
    w.wait_until("it is up to date", |w| w.logged("a.gltf", "is up to date") > 0);
    w.stop();
    w.assert_tidy(&["a.gltf"]);
}

/// The system's queue of events overflows while the daemon cannot listen.
#[test]
fn a_flood_of_events_hides_no_file() {
    let mut w = Watched::new(&["-q"]);
    w.start();
    w.wait_until("it tells", |w| w.status()["pid"] == w.pid());
    w.signal(Signal::STOP);
    for i in 0..20_000 {
        let path = w.inbox().join(format!("{i}.tmp"));
        fs::write(&path, "").expect("written");
        fs::remove_file(path).expect("removed");
    }
    let bytes = disk(4, 0.0);
    w.drop_in("a.stl", &bytes);
    w.signal(Signal::CONT);
    w.wait_for(&[("a.stl", &bytes)]);
    w.stop();
    w.assert_tidy(&["a.stl"]);
}
