//! What follows where an input is refused: commands, and where it goes.

use super::chaining::account;
use super::{Watched, disk, names};
use crate::support::planish;
use planish::outcome::Status;
use std::collections::BTreeSet;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// A command that tells of each run in the file `runs`, and fails for inputs named so.
fn tells(runs: &Path) -> String {
    let script = "echo \"$1 $2\" >> \"$3\"; echo \"$1 $2\"; test \"$2\" != fails.stl";
    let runs = runs.to_str().expect("UTF-8");
    format!(
        "[[on_refused]]\ncommand = [\"sh\", \"-c\", '''{script}''', \"sh\", \"{{code}}\", \"{{name}}\", \"{runs}\"]\n\
         [[on_certified]]\ncommand = [\"sh\", \"-c\", \"echo certified\"]\n[limits]\nfile = \"1MiB\"\n"
    )
}

fn runs(path: &Path) -> BTreeSet<String> {
    let told = fs::read_to_string(path).unwrap_or_default();
    let count = told.lines().count();
    let told: BTreeSet<String> = told.lines().map(str::to_owned).collect();
    assert_eq!(told.len(), count, "none has run twice: {told:?}");
    told
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(ToString::to_string).collect()
}

#[test]
fn refused_inputs_are_moved_when_their_commands_have_succeeded_and_only_then() {
    let place = tempfile::tempdir().expect("a folder");
    let (bad, told) = (place.path().join("bad"), place.path().join("runs"));
    let refused = format!("move:{}", bad.display());
    let mut w = Watched::configured(&tells(&told), &["--recursive", "--refused", &refused]);
    fs::create_dir(w.inbox().join("sub")).expect("made");
    fs::create_dir(&bad).expect("made");
    fs::write(bad.join("a.stl"), "another").expect("written");
    fs::write(bad.join(".planish-taken-1"), "half").expect("written");
    fs::set_permissions(bad.join(".planish-taken-1"), fs::Permissions::from_mode(0o600)).expect("set");
    let foreign = br#"{"asset": {"version": "2.0"}, "buffers": [{"byteLength": 3, "uri": "../a.bin"}],
        "bufferViews": [{"buffer": 0, "byteLength": 3}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}], "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}"#;
    let (good, large) = (disk(4, 0.0), vec![b'x'; 2 << 20]);
    let inputs: [(&str, &[u8]); 7] = [
        ("a.stl", b"garbage"),
        ("sub/b.stl", b""),
        ("c.obj", b"v 0 0 0\n"),
        ("fails.stl", b"garbage"),
        ("foreign.gltf", foreign),
        ("large.stl", &large),
        ("good.stl", &good),
    ];
    inputs.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    w.start();
    let gone = ["a.stl", "sub/b.stl", "c.obj"];
    w.wait_until("they are moved", |w| gone.iter().all(|name| !w.inbox().join(name).exists()));
    w.wait_until("all have an account", |w| inputs.iter().all(|(name, _)| account(w, name).is_some()));
    let left = set(&["fails.stl", "foreign.gltf", "good.stl", "large.stl", "sub"]);
    assert_eq!(names(&w.inbox()), left);
    assert_eq!(names(&bad), set(&["a.stl", "a.2.stl", "c.obj", "sub"]), "nothing half is left");
    assert_eq!(fs::read(bad.join("a.2.stl")).expect("moved"), b"garbage");
    assert_eq!(fs::read(bad.join("sub/b.stl")).expect("moved"), b"");
    // The results stay, with what their commands said.
    for (name, _) in &inputs {
        let (report, account) = (w.out.report(name), account(&w, name).expect("there"));
        let said = account["commands"][0]["stdout"].as_str().expect("text").trim_end().to_owned();
        let expected = match &report.reason {
            None => "certified".to_owned(),
            Some(reason) => format!("{} {}", reason.code.name(), name.rsplit('/').next().expect("a name")),
        };
        assert_eq!(said, expected, "{name}");
        assert_eq!(report.status == Status::Certified, *name == "good.stl", "{name}: {:?}", report.reason);
        assert_eq!(account["commands"][0]["outcome"] == "failed", *name == "fails.stl", "{account}");
    }
    let ran = runs(&told);
    assert_eq!(ran.len(), 6, "{ran:?}");
    w.stop();
    // Done is done. Whatever was not read is looked at again; its report may be another one.
    w.start();
    w.wait_until("it is looked at", |w| w.logged("fails.stl", "is up to date") == 1);
    w.stop();
    assert_eq!(fs::read_to_string(&told).expect("there").matches(" fails.stl").count(), 1);
    assert!(w.inbox().join("fails.stl").exists());
}

#[test]
fn refused_inputs_stay_where_nothing_is_said_and_their_commands_run_all_the_same() {
    let place = tempfile::tempdir().expect("a folder");
    let told = place.path().join("runs");
    let mut w = Watched::configured(&tells(&told), &["--inputs", "delete"]);
    w.drop_in("a.stl", b"garbage");
    w.drop_in("good.stl", &disk(4, 0.0));
    w.start();
    w.wait_until("the good one is deleted", |w| !w.inbox().join("good.stl").exists());
    w.wait_until("the other has an account", |w| account(w, "a.stl").is_some());
    w.stop();
    assert_eq!((runs(&told).len(), names(&w.inbox())), (1, set(&["a.stl"])));
}

/// Who repairs a file is not to find it gone.
#[test]
fn a_refused_input_that_is_mended_is_not_moved() {
    let place = tempfile::tempdir().expect("a folder");
    let mut w = Watched::new(&["--refused", &format!("move:{}", place.path().join("bad").display())]);
    w.start();
    w.drop_in("a.stl", b"garbage");
    w.wait_for(&[("a.stl", b"garbage")]);
    std::thread::sleep(std::time::Duration::from_secs(3));
    assert!(w.inbox().join("a.stl").exists(), "it has not been quiet for long");
    let good = disk(4, 0.0);
    w.drop_in("a.stl", &good);
    w.wait_for(&[("a.stl", &good)]);
    std::thread::sleep(std::time::Duration::from_secs(12));
    assert_eq!(names(&w.inbox()), set(&["a.stl"]));
    assert!(!place.path().join("bad").exists());
    w.stop();
}

#[test]
fn what_makes_no_sense_for_refused_inputs_is_wrong_usage() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    fs::create_dir(path("in")).expect("made");
    let watch = |args: &[&str]| {
        let ended = planish(["watch", &path("in"), "--out", &path("out")].iter().chain(args));
        assert_eq!(ended.code, Some(2), "{args:?}: {}", ended.err);
        ended.err
    };
    assert!(watch(&["--refused", "delete"]).contains("none of keep and move:DIR"));
    assert!(watch(&["--refused", &format!("move:{}", path("in/bad"))]).contains("folder for refused inputs"));
    assert!(watch(&["--refused", &format!("move:{}", path("out/bad"))]).contains("folder for refused inputs"));
    let same = format!("move:{}", path("done"));
    assert!(watch(&["--refused", &same, "--inputs", &same]).contains("lie in each other"));
    for placeholder in ["surface", "param", "seams", "atlas", "remesh"] {
        let config = format!("[[on_refused]]\ncommand = [\"cat\", \"{{{placeholder}}}\"]\n");
        fs::write(path("planish.toml"), config).expect("written");
        let told = watch(&["--config", &path("planish.toml")]);
        assert!(told.contains("stands for nothing in [[on_refused]]"), "{told}");
    }
}
