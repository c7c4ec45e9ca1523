//! What becomes of an input that is done with: it is moved to another folder, or deleted.
//!
//! The file is kept at its new place first, and then moved into a hidden folder beside it, and looked at there: so what
//! is removed is what was processed, even where something else takes its name at the same moment. What is left in such a
//! folder when the program is killed goes back to its place at the next start ([`recover`]).

use crate::look::Look;
use crate::shown::shown;
use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// How the names of the hidden folders begin.
const HOLDING: &str = ".planish-taken-";

/// Numbers that are tried to find a free name.
const MOST_COPIES: u32 = 10_000;

/// Stems longer than this (bytes) are cut where a number is added; a character has at most four.
const LONGEST_STEM: usize = 200;

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
#[error("cannot put the input {} away: {error}; check the permissions of its folder and of the one it goes to", shown(.path))]
pub struct PutAwayError {
    /// The file.
    path: PathBuf,
    /// Why.
    error: io::Error,
}

/// Puts the file at `path` away, if it still looks like `seen`. Links stay: what they point to is not ours.
///
/// # Errors
/// [`PutAwayError`]; then the file is where it was, untouched where it has no place to go to.
pub fn put_away(path: &Path, seen: &Look, way: Way) -> Result<(), PutAwayError> {
    let failed = |error| PutAwayError { path: path.to_owned(), error };
    if !fs::symlink_metadata(path).is_ok_and(|m| m.is_file() && Look::of(&m) == *seen) {
        return Ok(());
    }
    let kept = match way {
        Way::Nowhere => None,
        Way::To(place) => Some(keep_at(path, place).map_err(failed)?),
    };
    let is_gone = take(path, seen).map_err(failed)?;
    match kept.filter(|_| !is_gone) {
        // What was kept is not what was processed: that is still in the inbox.
        Some(kept) => fs::remove_file(kept).map_err(failed),
        None => Ok(()),
    }
}

/// Removes the file at `path`, if it is the one that was seen; whether it was.
fn take(path: &Path, seen: &Look) -> io::Result<bool> {
    let (Some(folder), Some(name)) = (path.parent(), path.file_name()) else { return Ok(false) };
    // Not removed with what is in it when something goes wrong.
    let holding = tempfile::Builder::new().prefix(HOLDING).tempdir_in(folder)?.keep();
    let held = holding.join(name);
    let taken = fs::rename(path, &held).and_then(|()| {
        let is_it = Look::at(&held)?.is_some_and(|found| found.is_renamed(seen));
        if is_it { fs::remove_file(&held).map(|()| true) } else { Ok(false) }
    });
    give_back(&holding, folder).and(taken)
}

/// Keeps a file at `place`, or at the first place like it that is free; where that is.
fn keep_at(file: &Path, place: &Path) -> io::Result<PathBuf> {
    let folder = place.parent().unwrap_or(place);
    fs::create_dir_all(folder)?;
    for copy in 1..MOST_COPIES {
        let place = if copy == 1 { place.to_owned() } else { numbered(place, copy) };
        match put_in_free_place(file, &place, folder) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {}
            ended => return ended.map(|()| place),
        }
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{} and {MOST_COPIES} numbered names exist", shown(place))))
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

/// `part.stl` becomes `part.2.stl`; a name too long for that is cut.
fn numbered(place: &Path, number: u32) -> PathBuf {
    let mut name = place.file_stem().unwrap_or_default().to_owned();
    if name.len() > LONGEST_STEM {
        name = name.to_string_lossy().chars().take(LONGEST_STEM / 4).collect::<String>().into();
    }
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

/// Gives back what was being put away when the program was killed, in `inbox` and, if asked, in its sub-folders. What
/// cannot be given back is told.
pub fn recover(inbox: &Path, recursive: bool) {
    let depth = if recursive { usize::MAX } else { 1 };
    let is_holding =
        |e: &walkdir::DirEntry| e.file_type().is_dir() && e.file_name().to_string_lossy().starts_with(HOLDING);
    let all = WalkDir::new(inbox).min_depth(1).max_depth(depth).into_iter().filter_map(Result::ok).filter(is_holding);
    for holding in all {
        let path = holding.path();
        if let Err(error) = path.parent().map_or(Ok(()), |folder| give_back(path, folder)) {
            tracing::warn!(folder = shown(path), "cannot give back what was being put away: {error}; look into it");
        }
    }
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
    fn long_names_are_cut_where_a_number_is_added() {
        let place = Place::new();
        let name = format!("{}.stl", "n".repeat(251));
        for text in ["one", "two"] {
            let seen = place.write(&name, text);
            put_away(&place.path(&name), &seen, Way::To(&place.path("done").join(&name))).expect("moved");
        }
        assert_eq!(place.all().len(), 2);
    }

    #[test]
    fn a_file_that_cannot_be_moved_stays_untouched() {
        let place = Place::new();
        let seen = place.write("a.stl", "one");
        place.write("done", "a file where a folder should be");
        let failed = put_away(&place.path("a.stl"), &seen, Way::To(&place.path("done/a.stl"))).expect_err("no folder");
        assert!(failed.to_string().contains("a.stl"));
        assert_eq!(place.all(), ["a.stl", "done"]);
        assert_eq!(Look::at(&place.path("a.stl")).expect("there"), Some(seen), "nothing to be seen of the attempt");
    }

    #[test]
    fn what_a_killed_program_held_comes_back_unless_something_newer_is_there() {
        let place = Place::new();
        for (holding, name) in [("sub/.planish-taken-1", "a.stl"), ("sub/.planish-taken-2", "b.stl")] {
            fs::create_dir_all(place.path(holding)).expect("made");
            place.write(&format!("{holding}/{name}"), "held");
        }
        place.write("sub/b.stl", "newer");
        recover(place.folder.path(), false);
        assert!(!place.path("sub/a.stl").exists(), "not asked for");
        recover(place.folder.path(), true);
        assert_eq!(place.all(), ["sub", "sub/a.stl", "sub/b.stl"]);
        assert_eq!(fs::read_to_string(place.path("sub/a.stl")).expect("there"), "held");
        assert_eq!(fs::read_to_string(place.path("sub/b.stl")).expect("there"), "newer");
    }
}
