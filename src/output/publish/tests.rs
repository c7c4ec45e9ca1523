use super::*;
use crate::output::staging::LOCK;
use crate::system::disk::simulated::{Abilities, Plan, Simulated};
use std::fs;

/// A report of planish that names these files, and the files.
fn result(of: &[(&str, &str)]) -> Vec<(String, Vec<u8>)> {
    let files = || of.iter().map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec()));
    let outputs: Vec<_> = files().map(|(name, text)| crate::report::Output::of(&name, &text)).collect();
    let report = serde_json::json!({"schema": 1, "planish": "1", "status": "certified", "outputs": outputs});
    files().chain([(crate::result_files::REPORT.to_owned(), report.to_string().into_bytes())]).collect()
}

fn files(text: &str) -> Vec<(String, Vec<u8>)> {
    result(&[("b.txt", text)])
}

#[test]
fn a_newer_result_takes_the_place_of_an_older_one_whole() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    let name = Path::new("part.stl");
    let old = result(&[("b.txt", "old"), ("only-old.txt", "")]);
    publisher.publish(name, &old, || true).expect("published");
    publisher.publish(name, &files("new"), || true).expect("published");
    let target = publisher.target(name);
    assert_eq!(fs::read_to_string(target.join("b.txt")).expect("there"), "new");
    assert!(!target.join("only-old.txt").exists());
    drop(publisher);
    let visible = fs::read_dir(out.path()).expect("there").flatten().filter(|e| e.file_name() != STAGING);
    assert_eq!(visible.count(), 1);
    let hidden = fs::read_dir(out.path().join(STAGING)).expect("there").flatten().map(|e| e.file_name());
    assert_eq!(hidden.collect::<Vec<_>>(), [GATE], "nothing else is left behind");
}

#[test]
fn a_failed_publication_leaves_the_older_result() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    let name = Path::new("part.stl");
    publisher.publish(name, &files("old"), || true).expect("published");
    let broken = vec![("b.txt".to_owned(), vec![]), ("no/such/folder.txt".to_owned(), vec![])];
    assert!(publisher.publish(name, &broken, || true).is_err());
    assert_eq!(fs::read_to_string(publisher.target(name).join("b.txt")).expect("there"), "old");
}

#[test]
fn many_writers_of_one_name_all_succeed() {
    let out = tempfile::tempdir().expect("a folder");
    let write = || {
        let publisher = Publisher::open(out.path()).expect("opens");
        for _ in 0..20 {
            publisher.publish(Path::new("part.stl"), &files("new"), || true).expect("published");
        }
    };
    std::thread::scope(|s| (0..4).for_each(|_| drop(s.spawn(write))));
    assert_eq!(fs::read_to_string(out.path().join("part.stl/b.txt")).expect("there"), "new");
}

#[test]
fn what_is_no_result_is_never_replaced() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    fs::write(out.path().join("part.stl"), "an input").expect("written");
    fs::create_dir(out.path().join("folder.stl")).expect("made");
    fs::write(out.path().join("folder.stl/precious.txt"), "work").expect("written");
    for name in ["part.stl", "folder.stl", "", STAGING, "../part.stl", "/part.stl", "a/../b.stl"] {
        let refused = publisher.publish(Path::new(name), &files("new"), || true);
        assert!(matches!(refused, Err(PublishError::Foreign(_))), "{name}: {refused:?}");
    }
    assert_eq!(fs::read_to_string(out.path().join("part.stl")).expect("there"), "an input");
    assert!(out.path().join("folder.stl/precious.txt").exists());
    fs::create_dir(out.path().join("empty.stl")).expect("made");
    assert!(publisher.publish(Path::new("empty.stl"), &files("new"), || true).is_ok());
    let late = out.path().join("late.stl");
    let put_there = || {
        fs::create_dir(&late).and_then(|()| fs::write(late.join("precious.txt"), "work")).expect("written");
        true
    };
    let refused = publisher.publish(Path::new("late.stl"), &files("new"), put_there);
    assert!(matches!(refused, Err(PublishError::Foreign(_))), "{refused:?}");
    assert!(late.join("precious.txt").exists());
}

#[test]
fn results_of_sub_folders_lie_in_sub_folders_but_not_in_results() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    assert!(publisher.publish(Path::new("a/b/part.stl"), &files("new"), || true).expect("published"));
    assert!(out.path().join("a/b/part.stl/b.txt").exists());
    let nested = publisher.publish(Path::new("a/b/part.stl/c.stl"), &files("new"), || true);
    assert!(matches!(nested, Err(PublishError::Nested(_))), "{nested:?}");
    fs::create_dir(out.path().join("other")).expect("made");
    fs::write(out.path().join("other").join(crate::result_files::REPORT), "{}").expect("written");
    assert!(publisher.publish(Path::new("other/c.stl"), &files("new"), || true).is_ok(), "that is no result");
}

#[test]
fn what_is_not_wanted_any_more_is_not_put_in_place() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    let (name, staging) = (Path::new("part.stl"), publisher.staging().expect("there"));
    assert!(!publisher.publish(name, &files("new"), || false).expect("no error"));
    assert_eq!(fs::read_dir(&staging).expect("there").count(), 1, "the lock only");
    publisher.close();
    assert!(publisher.publish(name, &files("new"), || true).is_err(), "there is no place for it any more");
    assert!(!publisher.target(name).exists());
    assert!(!staging.exists() && publisher.staging().is_err());
}

#[test]
fn staging_that_somebody_removes_is_made_anew() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    let before = publisher.staging().expect("there");
    for removed in [before.clone(), out.path().join(STAGING)] {
        fs::remove_dir_all(&removed).expect("removed");
        assert!(publisher.publish(Path::new("part.stl"), &files("new"), || true).expect("published"));
        let staging = publisher.staging().expect("there");
        assert!(staging.is_dir() && staging != before);
        Publisher::open(out.path()).expect("opens beside the first");
        assert!(staging.join(LOCK).exists(), "it is locked: nobody takes it for abandoned");
    }
    drop(publisher);
    let hidden = fs::read_dir(out.path().join(STAGING)).expect("there").flatten().map(|e| e.file_name());
    assert_eq!(hidden.collect::<Vec<_>>(), [GATE]);
}

/// Whatever fails once: what is on its desk is put in place the next time, with all that others have put there.
#[test]
fn a_result_that_could_not_be_put_in_place_is_put_there_later() {
    let (out, name) = (Path::new("/out"), Path::new("part.stl"));
    let mut tried_again = 0;
    for failing in 0.. {
        let disk = Simulated::new(Abilities::ALL);
        let older = Publisher::open_on(disk.clone(), out).expect("opens");
        older.publish(name, &files("older"), || true).expect("published");
        disk.put("/out/part.stl/notes.txt", b"mine");
        drop(older);
        let faulty = disk.process(1, Plan { fail: Some((failing, Errno::IO)), ..Plan::default() });
        let Ok(publisher) = Publisher::open_on(faulty.clone(), out) else { continue };
        let Ok(staged) = publisher.room() else { continue };
        let half = staged.desk.half().and_then(|half| listed::write_all(&half, &files("newer")));
        if half.is_err() {
            continue;
        }
        let put = publisher.put(name, &staged, || true);
        if put.is_err() && staged.is_there() {
            tried_again += 1;
            assert!(publisher.put(name, &staged, || true).expect("put in place"), "operation {failing}");
        }
        if put.is_ok() || staged.is_there() {
            assert_eq!(disk.file("/out/part.stl/b.txt").as_deref(), Some(&b"newer"[..]), "operation {failing}");
        }
        assert_eq!(disk.file("/out/part.stl/notes.txt").as_deref(), Some(&b"mine"[..]), "operation {failing}");
        if faulty.counts().0 <= failing {
            break;
        }
    }
    assert!(tried_again > 10, "only {tried_again}: the test has lost its sense");
}

#[test]
fn places_on_other_disks_are_told_as_such() {
    for (mounted, name) in [("/out/a", "a/part.stl"), ("/out/part.stl", "part.stl")] {
        let disk = Simulated::new(Abilities::ALL);
        disk.mount(mounted);
        let publisher = Publisher::open_on(disk.clone(), Path::new("/out")).expect("opens");
        let refused = publisher.publish(Path::new(name), &files("new"), || true).expect_err("another disk");
        assert!(matches!(refused, PublishError::Elsewhere(_)) && refused.is_lasting(), "{refused:?}");
        assert!(refused.to_string().contains("unmount"), "{refused}");
        drop(publisher);
        assert!(!disk.all().keys().any(|path| path.contains("run-")), "nothing is left");
    }
}

#[test]
fn what_lasts_is_told_from_what_passes() {
    let out = tempfile::tempdir().expect("a folder");
    let publisher = Publisher::open(out.path()).expect("opens");
    fs::write(out.path().join("file"), "words").expect("written");
    let refused = |name: &str| publisher.publish(Path::new(name), &files("new"), || true).expect_err("refused");
    let below_file = refused("file/deep/part.stl");
    assert!(matches!(&below_file, PublishError::Foreign(path) if path.ends_with("file")), "{below_file:?}");
    let too_long = refused(&"n".repeat(300));
    assert!(too_long.is_lasting() && too_long.to_string().contains("shorter"), "{too_long}");
    for (errno, is_lasting) in [(Errno::NOSPC, false), (Errno::ACCESS, false), (Errno::NOTDIR, true)] {
        assert_eq!(at(out.path())(errno.into()).is_lasting(), is_lasting, "{errno}");
    }
}

#[test]
fn abandoned_staging_is_cleared_and_staging_in_use_is_not() {
    let out = tempfile::tempdir().expect("a folder");
    let abandoned = out.path().join(STAGING).join("run-dead");
    fs::create_dir_all(&abandoned).expect("made");
    fs::write(abandoned.join(LOCK), "").expect("written");
    let first = Publisher::open(out.path()).expect("opens");
    assert!(!abandoned.exists());
    let second = Publisher::open(out.path()).expect("opens beside the first");
    assert!(first.staging().expect("there").exists());
    second.publish(Path::new("b.stl"), &files("b"), || true).expect("published");
    first.publish(Path::new("a.stl"), &files("a"), || true).expect("published");
}
