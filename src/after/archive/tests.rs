use super::*;
use crate::system::disk::System;
use std::fs::{self, File, Permissions};
use std::os::unix::fs::{PermissionsExt, symlink};
use walkdir::WalkDir;

struct Place {
    folder: tempfile::TempDir,
}

impl Place {
    fn new() -> Self {
        Self { folder: tempfile::tempdir().expect("a folder") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).expect("there")
    }

    fn write(&self, name: &str, text: &str) -> Fingerprint {
        fs::write(self.path(name), text).expect("written");
        self.look(name)
    }

    fn look(&self, name: &str) -> Fingerprint {
        Fingerprint::at(&self.path(name)).expect("there").expect("a file")
    }

    /// Puts a file away that looked like this when `text` was read from it.
    fn put(&self, name: &str, look: &Fingerprint, text: &str, way: Way) -> Result<Fate, ArchiveError> {
        let (inbox, name, hash) = (self.folder.path(), Path::new(name), blake3::hash(text.as_bytes()));
        archive(&System, &Processed { inbox, name, look, hash }, way)
    }

    fn all(&self) -> Vec<String> {
        let inside = WalkDir::new(self.folder.path()).min_depth(1).sort_by_file_name();
        let files = inside.into_iter().flatten().filter(|e| !e.file_type().is_dir() || e.file_name() != "done");
        files.map(|e| e.path().strip_prefix(self.folder.path()).expect("inside").display().to_string()).collect()
    }
}

#[test]
fn files_are_deleted_or_moved_and_nothing_is_overwritten() {
    let place = Place::new();
    let seen = place.write("a.stl", "one");
    assert_eq!(place.put("a.stl", &seen, "one", Way::Nowhere).expect("deleted"), Fate::Away);
    assert!(place.all().is_empty(), "{:?}", place.all());
    for text in ["one", "two", "three"] {
        let seen = place.write("a.stl", text);
        let way = Way::To(&place.path("done/a.stl"));
        assert_eq!(place.put("a.stl", &seen, text, way).expect("moved"), Fate::Away);
    }
    assert_eq!(place.all(), ["done/a.2.stl", "done/a.3.stl", "done/a.stl"]);
    assert_eq!(place.read("done/a.2.stl"), "two");
}

/// Memory is another file system than the disk.
#[cfg(target_os = "linux")]
fn elsewhere() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir_in("/dev/shm").expect("a folder");
    let moved = folder.path().join("done/a.stl");
    (folder, moved)
}

/// A copy belongs to this user: it must not run as that, whoever starts it.
#[cfg(target_os = "linux")]
#[test]
fn copies_on_other_file_systems_keep_time_and_permissions_but_no_powers() {
    let (place, (_elsewhere, moved)) = (Place::new(), elsewhere());
    place.write("a.stl", "one");
    let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000_000);
    let file = File::options().append(true).open(place.path("a.stl")).expect("there");
    file.set_modified(time).and_then(|()| file.set_permissions(Permissions::from_mode(0o4754))).expect("set");
    let seen = place.look("a.stl");
    let put = || place.put("a.stl", &seen, "one", Way::To(&moved)).expect("no failure");
    assert_eq!(put(), Fate::Busy, "it is open for writing");
    drop(file);
    assert_eq!(put(), Fate::Away);
    let metadata = fs::metadata(&moved).expect("there");
    assert_eq!((metadata.modified().expect("a time"), metadata.permissions().mode() & 0o7777), (time, 0o754));
    assert!(place.all().is_empty() && names(moved.parent().expect("a folder")) == ["a.stl"]);
}

fn names(folder: &Path) -> Vec<std::ffi::OsString> {
    fs::read_dir(folder).expect("there").flatten().map(|e| e.file_name()).collect()
}

#[test]
fn what_has_changed_stays() {
    let place = Place::new();
    let seen = place.write("a.stl", "one");
    place.write("a.stl", "newer");
    assert_eq!(place.put("a.stl", &seen, "one", Way::Nowhere).expect("left alone"), Fate::Changed);
    assert_eq!(place.read("a.stl"), "newer");
    assert_eq!(place.put("gone.stl", &seen, "one", Way::Nowhere).expect("nothing to do"), Fate::Nothing);
    assert_eq!(place.put("gone/a.stl", &seen, "one", Way::Nowhere).expect("nothing to do"), Fate::Nothing);
    assert_eq!(place.all(), ["a.stl"]);
}

/// As where somebody writes through shared memory: nothing shows but the content.
#[cfg(target_os = "linux")]
#[test]
fn what_has_changed_without_a_trace_is_given_back_and_told() {
    let (place, (_elsewhere, copied)) = (Place::new(), elsewhere());
    let seen = place.write("a.stl", "two");
    for way in [Way::Nowhere, Way::To(&place.path("done/a.stl")), Way::To(&copied)] {
        let seen = place.look("a.stl");
        assert_eq!(place.put("a.stl", &seen, "one", way).expect("looked at"), Fate::Changed, "{way:?}");
        assert_eq!((place.all(), place.read("a.stl").as_str()), (vec!["a.stl".to_owned()], "two"), "{way:?}");
    }
    assert!(names(copied.parent().expect("a folder")).is_empty());
    assert!(seen.is_renamed(&place.look("a.stl")));
}

/// From an attempt that went wrong later, or was killed.
#[test]
fn a_copy_that_is_there_is_not_made_again_and_never_removed() {
    let place = Place::new();
    fs::create_dir(place.path("done")).expect("made");
    place.write("done/a.stl", "another");
    place.write("done/a.2.stl", "one");
    let way = Way::To(&place.path("done/a.stl"));
    let changed = place.write("a.stl", "two");
    assert_eq!(place.put("a.stl", &changed, "one", way).expect("looked at"), Fate::Changed);
    let seen = place.write("a.stl", "one");
    assert_eq!(place.put("a.stl", &seen, "one", way).expect("moved"), Fate::Away);
    assert_eq!(place.all(), ["done/a.2.stl", "done/a.stl"]);
    assert_eq!((place.read("done/a.stl"), place.read("done/a.2.stl")), ("another".into(), "one".into()));
}

#[test]
fn an_identical_file_of_another_user_is_not_relied_on() {
    let place = Place::new();
    fs::create_dir(place.path("done")).expect("made");
    place.write("done/a.stl", "one");
    if std::os::unix::fs::chown(place.path("done/a.stl"), Some(65534), None).is_err() {
        eprintln!("skipped: only root can give files away");
        return;
    }
    let seen = place.write("a.stl", "one");
    place.put("a.stl", &seen, "one", Way::To(&place.path("done/a.stl"))).expect("moved");
    assert_eq!(place.all(), ["done/a.2.stl", "done/a.stl"]);
}

#[test]
fn links_stay_and_lead_nowhere() {
    let place = Place::new();
    fs::create_dir(place.path("sub")).expect("made");
    let seen = place.write("sub/a.stl", "one");
    symlink("sub/a.stl", place.path("link.stl")).expect("linked");
    symlink("sub", place.path("other")).expect("linked");
    for way in [Way::Nowhere, Way::To(&place.path("done/a.stl"))] {
        assert_eq!(place.put("link.stl", &seen, "one", way).expect("nothing to do"), Fate::Nothing);
        place.put("other/a.stl", &seen, "one", way).expect_err("no folder of the inbox");
    }
    assert_eq!(place.all(), ["link.stl", "other", "sub", "sub/a.stl"]);
    assert_eq!(place.look("sub/a.stl"), seen);
}

#[test]
fn long_names_are_cut_where_a_number_is_added() {
    let place = Place::new();
    let name = format!("{}.stl", "n".repeat(251));
    for text in ["one", "two"] {
        let seen = place.write(&name, text);
        place.put(&name, &seen, text, Way::To(&place.path("done").join(&name))).expect("moved");
    }
    assert_eq!(place.all().len(), 2);
}

#[test]
fn a_file_that_cannot_be_moved_stays_untouched() {
    let place = Place::new();
    let seen = place.write("a.stl", "one");
    place.write("done", "a file where a folder should be");
    let failed = place.put("a.stl", &seen, "one", Way::To(&place.path("done/a.stl"))).expect_err("no folder");
    assert!(failed.to_string().contains("a.stl"));
    assert_eq!(place.all(), ["a.stl", "done"]);
    assert_eq!(place.look("a.stl"), seen, "nothing to be seen of the attempt");
}
