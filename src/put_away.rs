//! What becomes of an input that is done with: it is moved to another folder, or deleted.
//!
//! The file is kept at its new place first, and then moved into a hidden folder beside it ([`crate::holding`]), and
//! looked at and read there once more: so what is removed is what was processed, even where something else takes its
//! name at the same moment, or somebody writes to it without a trace (through shared memory, neither size nor time
//! change). What is not is given back. Nothing is followed on the way, and what was kept goes again where it fails.
//!
//! Guarantee: an input that is removed has the content that was processed, and where it is to be moved, a file with
//! this content is at its new place. Not covered: what somebody writes through shared memory after that last reading.

use crate::holding::{HOLDING, Holding};
use crate::look::Look;
use crate::regular::{self, OpenError};
use crate::shown::shown;
use blake3::{Hash, Hasher};
use rustix::fd::{AsFd, BorrowedFd};
use rustix::fs::{AtFlags, CWD, linkat};
use rustix::io::Errno;
use rustix::process::geteuid;
use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// Numbers that are tried to find a free name.
const MOST_COPIES: u32 = 10_000;

/// Stems longer than this (bytes) are cut where a number is added; a character has at most four.
const LONGEST_STEM: usize = 200;

/// An input, as it was processed.
#[derive(Clone, Copy, Debug)]
pub struct Processed<'a> {
    /// The inbox.
    pub inbox: &'a Path,
    /// Its path below the inbox.
    pub name: &'a Path,
    /// What the file looked like.
    pub look: &'a Look,
    /// The hash of its content.
    pub hash: Hash,
}

/// What is to become of the file.
#[derive(Clone, Copy, Debug)]
pub enum Way<'a> {
    /// Moved to this path, or, where something else is there already, to one like it with a number.
    To(&'a Path),
    /// Deleted.
    Nowhere,
}

/// What became of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It is away.
    Away,
    /// There is nothing to put away: it is gone, or a link. Links stay, as what they point to is not ours.
    Nothing,
    /// It stays: it is not what was processed.
    Changed,
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

/// Where a file with the content of the input is now.
enum Kept {
    /// It was put there.
    Made(PathBuf),
    /// It was there before.
    Found,
}

/// Puts an input away, if it still is what was processed.
///
/// # Errors
/// [`PutAwayError`]; then the file is where it was, untouched where its folder cannot be written or it has no place to
/// go to; and nothing is left of the attempt.
pub fn put_away(input: &Processed, way: Way) -> Result<Fate, PutAwayError> {
    try_to_put_away(input, way).map_err(|error| PutAwayError { path: input.inbox.join(input.name), error })
}

fn try_to_put_away(input: &Processed, way: Way) -> io::Result<Fate> {
    let (Some(above), Some(name)) = (input.name.parent(), input.name.file_name()) else { return Ok(Fate::Nothing) };
    let folder = match regular::folder_below(input.inbox, above) {
        Err(error) if error.is_missing() => return Ok(Fate::Nothing),
        opened => opened.map_err(OpenError::into_io)?,
    };
    let file = match regular::open_in(&folder, name) {
        Err(OpenError::NotRegular) => return Ok(Fate::Nothing),
        Err(error) if error.is_missing() => return Ok(Fate::Nothing),
        opened => opened.map_err(OpenError::into_io)?,
    };
    if Look::of(&file.metadata()?) != *input.look {
        return Ok(Fate::Changed);
    }
    // Made before anything is kept: where it cannot be, the file is not touched.
    let holding = Holding::make(folder.as_fd())?;
    let fate = keep_and_remove(input, way, &Source { folder: folder.as_fd(), name, file }, &holding);
    holding.remove();
    fate
}

/// The file in its inbox, opened.
struct Source<'a> {
    folder: BorrowedFd<'a>,
    name: &'a OsStr,
    file: File,
}

fn keep_and_remove(input: &Processed, way: Way, source: &Source, holding: &Holding) -> io::Result<Fate> {
    let kept = match way {
        Way::Nowhere => Kept::Found,
        Way::To(place) => match keep_at(input, source, place)? {
            Some(kept) => kept,
            None => return Ok(Fate::Changed),
        },
    };
    let fate = remove(input, source.name, holding);
    let stays = match fate {
        Ok(Fate::Away) => false,
        Ok(Fate::Changed | Fate::Nothing) => true,
        // Where nobody knows where it is, what was kept may be all there is of it.
        Err(_) => holding.is_there(source.name),
    };
    match kept {
        Kept::Made(place) if stays => fs::remove_file(place).and(fate),
        Kept::Made(_) | Kept::Found => fate,
    }
}

/// Removes the file, if it is what was processed. It is away only where its removal has succeeded.
fn remove(input: &Processed, name: &OsStr, holding: &Holding) -> io::Result<Fate> {
    holding.take(name)?;
    let removed = match is_processed(input, holding.open_held(name)) {
        Ok(true) => holding.delete(name).map(|()| Fate::Away),
        Ok(false) => Ok(Fate::Changed),
        Err(error) => Err(error),
    };
    if matches!(removed, Ok(Fate::Away)) {
        return removed;
    }
    holding.give_back(name).and(removed)
}

/// Whether this is the file that was processed, with the same content.
fn is_processed(input: &Processed, opened: Result<File, OpenError>) -> io::Result<bool> {
    let file = match opened {
        Err(OpenError::NotRegular) => return Ok(false),
        opened => opened.map_err(OpenError::into_io)?,
    };
    let before = Look::of(&file.metadata()?);
    if !before.is_renamed(input.look) || copy(&file, input, &mut io::sink())? != input.hash {
        return Ok(false);
    }
    Ok(Look::of(&file.metadata()?) == before)
}

/// Copies a file, a little more than the input has at most; the hash of what was copied.
fn copy(file: &File, input: &Processed, to: &mut impl Write) -> io::Result<Hash> {
    let mut from = file;
    from.rewind()?;
    let (mut hasher, mut rest) = (Hasher::new(), from.take(input.look.bytes.saturating_add(1)));
    let mut buffer = vec![0; 1 << 16];
    loop {
        match rest.read(&mut buffer) {
            Ok(0) => return Ok(hasher.finalize()),
            Ok(read) => {
                hasher.update(&buffer[..read]);
                to.write_all(&buffer[..read])?;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Keeps a file at `place`, or at the first place like it that is free or has the same content already. None: it is not
/// what was processed.
fn keep_at(input: &Processed, source: &Source, place: &Path) -> io::Result<Option<Kept>> {
    let folder = place.parent().unwrap_or(place);
    fs::create_dir_all(folder)?;
    for number in 1..MOST_COPIES {
        let place = if number == 1 { place.to_owned() } else { numbered(place, number) };
        let is_it = match put_in_free_place(input, source, &place, folder) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                if has_content(input, source, &place)? {
                    return Ok(Some(Kept::Found));
                }
                continue;
            }
            ended => ended?,
        };
        if !is_it {
            return Ok(None);
        }
        // The original is removed next.
        let synced = File::open(folder).and_then(|folder| folder.sync_all());
        kept_or_removed(&place, synced.map(|()| true))?;
        return Ok(Some(Kept::Made(place)));
    }
    Err(io::Error::new(ErrorKind::AlreadyExists, format!("{} and {MOST_COPIES} numbered names exist", shown(place))))
}

/// Puts a second name of the file, or where that cannot be a copy, at `place`, if nothing is there; whether it is what
/// was processed: else, nothing is left there.
fn put_in_free_place(input: &Processed, source: &Source, place: &Path, folder: &Path) -> io::Result<bool> {
    match linkat(source.folder, source.name, CWD, place, AtFlags::empty()) {
        Ok(()) => {
            let is_it = |m: fs::Metadata| m.is_file() && Look::of(&m).is_renamed(input.look);
            kept_or_removed(place, fs::symlink_metadata(place).map(is_it))
        }
        Err(Errno::EXIST) => Err(Errno::EXIST.into()),
        Err(_) => copy_to_free_place(input, &source.file, place, folder),
    }
}

/// Copies what was opened, wherever its name leads by now.
fn copy_to_free_place(input: &Processed, from: &File, place: &Path, folder: &Path) -> io::Result<bool> {
    let mut kept = tempfile::Builder::new().prefix(HOLDING).tempfile_in(folder)?;
    let metadata = from.metadata()?;
    if !Look::of(&metadata).is_renamed(input.look) || copy(from, input, &mut kept)? != input.hash {
        return Ok(false);
    }
    kept.as_file().set_modified(metadata.modified()?)?;
    kept.as_file().sync_all()?;
    let kept = kept.persist_noclobber(place).map_err(|e| e.error)?;
    // Under the name that it had until now, it is known by these (see `holding::clear`).
    let set = kept.set_permissions(regular::permissions_of_copy(&metadata)).and_then(|()| kept.sync_all());
    kept_or_removed(place, set.map(|()| true))
}

/// Removes what was just put at `place`, unless all is well with it.
fn kept_or_removed(place: &Path, is_well: io::Result<bool>) -> io::Result<bool> {
    if !matches!(is_well, Ok(true)) {
        fs::remove_file(place)?;
    }
    is_well
}

/// Whether a regular file with the content of the input is at `place`, perhaps from an earlier attempt; then it is on
/// disk. One of another user does not count, who could change it later.
fn has_content(input: &Processed, source: &Source, place: &Path) -> io::Result<bool> {
    let Ok(file) = regular::open_itself(place) else { return Ok(false) };
    let (found, owner) = (file.metadata()?, source.file.metadata()?.uid());
    let is_alike = found.len() == input.look.bytes && [owner, geteuid().as_raw()].contains(&found.uid());
    if !is_alike || copy(&file, input, &mut io::sink())? != input.hash {
        return Ok(false);
    }
    file.sync_all().map(|()| true)
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::Permissions;
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

        fn write(&self, name: &str, text: &str) -> Look {
            fs::write(self.path(name), text).expect("written");
            self.look(name)
        }

        fn look(&self, name: &str) -> Look {
            Look::at(&self.path(name)).expect("there").expect("a file")
        }

        /// Puts a file away that looked like this when `text` was read from it.
        fn put(&self, name: &str, look: &Look, text: &str, way: Way) -> Result<Fate, PutAwayError> {
            let (inbox, name, hash) = (self.folder.path(), Path::new(name), blake3::hash(text.as_bytes()));
            put_away(&Processed { inbox, name, look, hash }, way)
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
        place.put("a.stl", &place.look("a.stl"), "one", Way::To(&moved)).expect("moved");
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
}
