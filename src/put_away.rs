//! What becomes of an input that is done with: it is moved to another folder, or deleted.
//!
//! The file is first moved into a hidden folder beside it, and looked at there: so what is put away is what was
//! processed, even where something else takes its name at the same moment. What is left in such a folder when the
//! program is killed goes back to its place at the next start ([`recover`]).

use crate::look::Look;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// How the names of the hidden folders begin.
const HOLDING: &str = ".planish-";

/// Numbers that are tried to find a free name.
const MOST_COPIES: u32 = 10_000;

/// What is to become of the file.
#[derive(Clone, Copy, Debug)]
pub enum Way<'a> {
    /// Moved to this path, or, where something is there already, to one like it with a number.
    To(&'a Path),
    /// Deleted.
    Nowhere,
}

/// Why an input is not put away.
#[derive(Debug, thiserror::Error)]
#[error("cannot put the input {path} away: {error}; check the permissions of its folder and of the one it goes to")]
pub struct PutAwayError {
    /// The file.
    path: PathBuf,
    /// Why.
    error: io::Error,
}

/// Puts the file at `path` away, if it still looks like `seen`. Links stay: what they point to is not ours.
///
/// # Errors
/// [`PutAwayError`]; then the file is where it was.
pub fn put_away(path: &Path, seen: &Look, way: Way) -> Result<(), PutAwayError> {
    let failed = |error| PutAwayError { path: path.to_owned(), error };
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return Ok(()) };
    if !fs::symlink_metadata(path).is_ok_and(|m| m.is_file() && Look::of(&m) == *seen) {
        return Ok(());
    }
    // Not removed with what is in it when something goes wrong.
    let holding = tempfile::Builder::new().prefix(HOLDING).tempdir_in(folder).map_err(failed)?.keep();
    let held = holding.join(name);
    let done = fs::rename(path, &held).and_then(|()| match Look::at(&held)? {
        Some(found) if found.is_renamed(seen) => away(&held, way),
        _ => Ok(()),
    });
    let back = give_back(&holding, folder);
    done.and(back).map_err(failed)
}

fn away(held: &Path, way: Way) -> io::Result<()> {
    match way {
        Way::Nowhere => fs::remove_file(held),
        Way::To(place) => move_to(held, place),
    }
}

/// Moves a file to `place`, or to the first place like it that is free.
fn move_to(file: &Path, place: &Path) -> io::Result<()> {
    let folder = place.parent().unwrap_or(place);
    fs::create_dir_all(folder)?;
    for copy in 1..MOST_COPIES {
        let place = if copy == 1 { place.to_owned() } else { numbered(place, copy) };
        match put_in_free_place(file, &place, folder) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            ended => return ended.and_then(|()| fs::remove_file(file)),
        }
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{} and {MOST_COPIES} numbered names exist", place.display())))
}

/// Puts a second name of `file`, or where that cannot be a copy, at `place`, if nothing is there.
fn put_in_free_place(file: &Path, place: &Path, folder: &Path) -> io::Result<()> {
    match fs::hard_link(file, place) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => {
            let mut copy = tempfile::Builder::new().prefix(HOLDING).tempfile_in(folder)?;
            let mut from = fs::File::open(file)?;
            let metadata = from.metadata()?;
            io::copy(&mut from, &mut copy)?;
            copy.as_file().set_permissions(metadata.permissions())?;
            copy.as_file().set_modified(metadata.modified()?)?;
            copy.as_file().sync_all()?;
            copy.persist_noclobber(place).map_err(|e| e.error)?;
            // The original is removed next.
            fs::File::open(folder)?.sync_all()
        }
        ended => ended,
    }
}

/// `part.stl` becomes `part.2.stl`.
fn numbered(place: &Path, number: u32) -> PathBuf {
    let mut name = place.file_stem().unwrap_or_default().to_owned();
    name.push(format!(".{number}"));
    if let Some(extension) = place.extension() {
        name.push(".");
        name.push(extension);
    }
    place.with_file_name(name)
}

/// Gives what is left in a hidden folder back to the folder it came from, unless something newer has taken its name;
/// and removes the hidden folder.
fn give_back(holding: &Path, folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(holding)? {
        let entry = entry?;
        match put_in_free_place(&entry.path(), &folder.join(entry.file_name()), folder) {
            Err(e) if e.kind() != ErrorKind::AlreadyExists => return Err(e),
            _ => fs::remove_file(entry.path())?,
        }
    }
    fs::remove_dir(holding)
}

/// Gives back what was being put away when the program was killed, in all folders of `inbox`.
///
/// # Errors
/// The first folder that cannot be cleared.
pub fn recover(inbox: &Path) -> io::Result<()> {
    let is_holding =
        |e: &walkdir::DirEntry| e.file_type().is_dir() && e.file_name().to_string_lossy().starts_with(HOLDING);
    let all = WalkDir::new(inbox).min_depth(1).into_iter().filter_map(Result::ok).filter(is_holding);
    for holding in all {
        let path = holding.path();
        path.parent().map_or(Ok(()), |folder| give_back(path, folder))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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

        fn write(&self, name: &str, text: &str) -> Look {
            fs::write(self.path(name), text).expect("written");
            Look::at(&self.path(name)).expect("there").expect("a file")
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
        put_away(&place.path("a.stl"), &seen, Way::Nowhere).expect("deleted");
        assert!(place.all().is_empty(), "{:?}", place.all());
        for text in ["one", "two", "three"] {
            let seen = place.write("a.stl", text);
            put_away(&place.path("a.stl"), &seen, Way::To(&place.path("done/a.stl"))).expect("moved");
        }
        assert_eq!(place.all(), ["done/a.2.stl", "done/a.3.stl", "done/a.stl"]);
        assert_eq!(fs::read_to_string(place.path("done/a.2.stl")).expect("there"), "two");
    }

    /// Memory is another file system than the disk.
    #[cfg(target_os = "linux")]
    #[test]
    fn copies_on_other_file_systems_keep_time_and_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let (place, elsewhere) = (Place::new(), tempfile::tempdir_in("/dev/shm").expect("a folder"));
        place.write("a.stl", "one");
        let time = std::time::UNIX_EPOCH + std::time::Duration::from_secs(1_000_000_000);
        let file = fs::File::options().append(true).open(place.path("a.stl")).expect("there");
        file.set_modified(time).and_then(|()| file.set_permissions(fs::Permissions::from_mode(0o644))).expect("set");
        let seen = Look::at(&place.path("a.stl")).expect("there").expect("a file");
        let moved = elsewhere.path().join("done/a.stl");
        put_away(&place.path("a.stl"), &seen, Way::To(&moved)).expect("moved");
        let metadata = fs::metadata(&moved).expect("there");
        assert_eq!((metadata.modified().expect("a time"), metadata.permissions().mode() & 0o777), (time, 0o644));
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
        put_away(&place.path("a.stl"), &seen, Way::Nowhere).expect("left alone");
        assert_eq!(fs::read_to_string(place.path("a.stl")).expect("there"), "newer");
        put_away(&place.path("gone.stl"), &seen, Way::Nowhere).expect("nothing to do");
        assert_eq!(place.all(), ["a.stl"]);
    }

    #[test]
    fn a_file_that_cannot_be_moved_goes_back() {
        let place = Place::new();
        let seen = place.write("a.stl", "one");
        place.write("done", "a file where a folder should be");
        let failed = put_away(&place.path("a.stl"), &seen, Way::To(&place.path("done/a.stl"))).expect_err("no folder");
        assert!(failed.to_string().contains("a.stl"));
        assert_eq!(place.all(), ["a.stl", "done"]);
    }

    #[test]
    fn what_a_killed_program_held_comes_back_unless_something_newer_is_there() {
        let place = Place::new();
        for (holding, name) in [("sub/.planish-1", "a.stl"), ("sub/.planish-2", "b.stl")] {
            fs::create_dir_all(place.path(holding)).expect("made");
            place.write(&format!("{holding}/{name}"), "held");
        }
        place.write("sub/b.stl", "newer");
        recover(place.folder.path()).expect("recovered");
        assert_eq!(place.all(), ["sub", "sub/a.stl", "sub/b.stl"]);
        assert_eq!(fs::read_to_string(place.path("sub/a.stl")).expect("there"), "held");
        assert_eq!(fs::read_to_string(place.path("sub/b.stl")).expect("there"), "newer");
    }
}
