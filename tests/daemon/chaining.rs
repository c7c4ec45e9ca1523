//! What follows certification: commands, and where the inputs go.

use super::{Watched, disk, names};
use crate::interop;
use crate::support::{fixture, planish};
use planish::outcome::Status;
use serde_json::Value;
use std::fs;
use std::io::Write;

/// What the commands on an input did, if that is told.
pub fn account(w: &Watched, name: &str) -> Option<Value> {
    serde_json::from_slice(&fs::read(w.out.of(name).join("hooks.json")).ok()?).ok()
}

/// The README's recipe, word for word, with the real Gmsh.
#[test]
fn a_dropped_file_becomes_a_mesh_of_gmsh() {
    let mut w = Watched::configured(&interop::recipe::settings_file(), &[]);
    w.start_with(|command| command.env("PATH", interop::tools()));
    w.drop_in("part.stl", &fs::read(fixture("disk_with_holes.stl")).expect("a fixture"));
    w.wait_until("the mesh is there", |w| account(w, "part.stl").is_some());
    let told = account(&w, "part.stl").expect("there");
    assert_eq!(told["commands"][0]["outcome"], "succeeded", "{told}");
    let mesh = fs::read_to_string(w.out.of("part.stl").join("remeshed.msh")).expect("text");
    assert!(mesh.starts_with("$MeshFormat\n4.1 ") && mesh.contains("\n$Elements\n"), "no mesh of Gmsh's");
    assert_eq!(planish(["check".as_ref(), w.out.of("part.stl").as_os_str()]).code, Some(0));
    w.stop();
    // Done is done, for the commands, too.
    let written = fs::metadata(w.out.of("part.stl").join("remeshed.msh")).and_then(|m| m.modified()).expect("a time");
    w.start_with(|command| command.env("PATH", interop::tools()));
    w.wait_until("it is looked at", |w| w.logged("part.stl", "is up to date") == 1);
    w.stop();
    let again = fs::metadata(w.out.of("part.stl").join("remeshed.msh")).and_then(|m| m.modified()).expect("a time");
    assert_eq!(written, again);
}

#[test]
fn commands_that_were_broken_off_run_again_and_ends_of_commands_are_told() {
    let mut w = Watched::configured(
        "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"echo run >> runs; test -e {folder}/go || sleep 600\"]\n\
         [[on_certified]]\ncommand = [\"sh\", \"-c\", \"echo {name}; exit 3\"]\n",
        &[],
    );
    let bytes = disk(4, 0.0);
    w.drop_in("a.stl", &bytes);
    let runs = |w: &Watched| fs::read_to_string(w.out.of("a.stl").join("runs")).unwrap_or_default().lines().count();
    w.start();
    w.wait_until("the first command runs", |w| runs(w) == 1);
    w.stop();
    assert!(account(&w, "a.stl").is_none(), "broken off: nothing is told");
    w.start();
    w.wait_until("it runs again", |w| runs(w) == 2);
    w.kill();
    fs::write(w.out.of("a.stl").join("go"), "").expect("written");
    w.start();
    w.wait_until("both have run", |w| account(w, "a.stl").is_some());
    let told = account(&w, "a.stl").expect("there");
    let of = |i: usize, key: &str| told["commands"][i][key].clone();
    assert_eq!(
        (of(0, "outcome"), of(1, "outcome"), of(1, "exit_code")),
        ("succeeded".into(), "failed".into(), 3.into())
    );
    assert_eq!((runs(&w), of(1, "stdout")), (3, "a.stl\n".into()));
    w.stop();
}

/// Memory is for inputs on their way: one on which a command runs has arrived.
#[test]
fn a_command_that_takes_long_keeps_no_memory_from_other_inputs() {
    let sleeps = "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"test {name} != large.stl || sleep 600\"]\n";
    let mut w = Watched::configured(sleeps, &["--memory", "16MiB", "--jobs", "2"]);
    let (large, small) = (disk(60, 0.0), disk(4, 0.0));
    w.drop_in("large.stl", &large);
    w.start();
    w.wait_until("the command runs", |w| w.status()["running"][0]["stage"] == "chain");
    w.drop_in("small.stl", &small);
    w.wait_until("the small one is done", |w| account(w, "small.stl").is_some());
    assert!(account(&w, "large.stl").is_none(), "its command still runs: else the test has lost its sense");
    w.stop();
}

/// Newer content while a command runs on the older one.
#[test]
fn commands_on_a_superseded_result_are_broken_off() {
    let mut w =
        Watched::configured("[[on_certified]]\ncommand = [\"sh\", \"-c\", \"test -e {input}.go || sleep 600\"]\n", &[]);
    let (old, new) = (disk(4, 0.0), disk(4, 1.0));
    w.start();
    w.drop_in("a.stl", &old);
    w.wait_until("the command runs", |w| w.status()["running"][0]["stage"] == "chain");
    fs::write(w.inbox().join("a.stl.go"), "").expect("written");
    w.drop_in("a.stl", &new);
    w.wait_until("it has run on the newer one", |w| w.is_done("a.stl", &new) && account(w, "a.stl").is_some());
    w.stop();
}

#[test]
fn inputs_are_put_away_when_they_are_done_with_and_only_then() {
    let done = tempfile::tempdir().expect("a folder");
    let moved = format!("move:{}", done.path().display());
    let fails = "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"test {name} != fails.stl\"]\n";
    for inputs in ["delete", &moved] {
        let mut w = Watched::configured(fails, &["--recursive", "--inputs", inputs]);
        let bytes = disk(4, 0.0);
        fs::create_dir(w.inbox().join("sub")).expect("made");
        ["a.stl", "sub/b.stl", "fails.stl"].iter().for_each(|name| w.drop_in(name, &bytes));
        w.drop_in("garbage.stl", b"garbage");
        w.start();
        w.wait_until("they are put away", |w| {
            names(&w.inbox()).len() == 3
                && names(&w.inbox().join("sub")).is_empty()
                && account(w, "fails.stl").is_some()
        });
        w.wait_for(&[("garbage.stl", b"garbage")]);
        w.stop();
        assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), ["fails.stl", "garbage.stl", "sub"]);
        assert_eq!(w.out.report("sub/b.stl").status, Status::Certified);
    }
    assert_eq!(fs::read(done.path().join("a.stl")).expect("moved"), disk(4, 0.0));
    assert_eq!(fs::read(done.path().join("sub/b.stl")).expect("moved"), disk(4, 0.0));
    assert_eq!(names(done.path()).len(), 2);
}

/// Half of a file is a surface, too; but the file is not put away before it has been quiet for long.
#[test]
fn what_is_written_after_a_pause_is_not_lost_with_the_input() {
    let mut w = Watched::new(&["--inputs", "delete"]);
    w.start();
    let [first, second] = ["v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n", "v 0 1 0\nf 1 3 4\n"];
    let mut file = fs::File::create(w.inbox().join("a.obj")).expect("made");
    file.write_all(first.as_bytes()).expect("written");
    w.wait_for(&[("a.obj", first.as_bytes())]);
    file.write_all(second.as_bytes()).expect("written");
    drop(file);
    w.wait_for(&[("a.obj", [first, second].concat().as_bytes())]);
    w.wait_until("it is put away", |w| names(&w.inbox()).is_empty());
    assert_eq!(w.out.report("a.obj").surface.expect("a surface").repaired.counts.triangles, 2);
    w.stop();
}
