//! Hidden folders in which files of an inbox are held while they are looked at for the last time.
//!
//! Whoever may drop files into an inbox may also rename, remove and make folders there. So a holding folder is used
//! through a handle, whatever becomes of its name, and only where nobody but this user can look or reach into it. At
//! the next start only such folders are taken for ones that a killed program has left ([`recover`]): what others made
//! under such a name is left alone, never read, and told.
//!
//! Deliberately absent: any copy. What is held goes in and comes back by a rename, so nothing of it is opened, be it a
//! link, a pipe or a device.

use crate::regular::{self, OpenError};
use crate::shown::shown;
use rustix::fd::{AsFd, BorrowedFd, OwnedFd};
use rustix::fs::{AtFlags, Dir, FileType, Mode, linkat, mkdirat, renameat, statat, unlinkat};
use rustix::io::Errno;
use rustix::process::geteuid;
use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata};
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// How the names of hidden folders and files begin.
pub(crate) const HOLDING: &str = ".planish-taken-";

/// Names that are tried to find a free one; others cannot guess them.
const ATTEMPTS: u32 = 100;

/// Why inputs cannot be taken out of an inbox.
#[derive(Debug, thiserror::Error)]
#[error(
    "inputs cannot be put away, as nothing can be taken out of the inbox {}: {error}; let the user that planish runs \
     as write to this folder, or leave inputs where they are (`--inputs keep`)", shown(.inbox)
)]
pub struct InboxError {
    /// The inbox.
    inbox: PathBuf,
    /// Why.
    error: io::Error,
}

/// A holding folder.
pub(crate) struct Holding<'a> {
    folder: BorrowedFd<'a>,
    name: OsString,
    handle: File,
}

impl<'a> Holding<'a> {
    /// Makes one in an open folder.
    pub(crate) fn make(folder: BorrowedFd<'a>) -> io::Result<Self> {
        for _ in 0..ATTEMPTS {
            let name = OsString::from(format!("{HOLDING}{:016x}", RandomState::new().hash_one(())));
            match mkdirat(folder, &name, Mode::RWXU) {
                Err(Errno::EXIST) => {}
                Err(error) => return Err(error.into()),
                Ok(()) => return Self::just_made(folder, &name),
            }
        }
        Err(Errno::EXIST.into())
    }

    /// Opens one that should be as it was made.
    fn just_made(folder: BorrowedFd<'a>, name: &OsStr) -> io::Result<Self> {
        let made = Self::open(folder, name)?.filter(Self::is_empty);
        if made.is_none() {
            // Fails where something else has taken its place, and then shall.
            let _ = unlinkat(folder, name, AtFlags::REMOVEDIR);
        }
        made.ok_or_else(not_private)
    }

    /// Opens one. None: it is no folder that only this user can have made and filled.
    fn open(folder: BorrowedFd<'a>, name: &OsStr) -> io::Result<Option<Self>> {
        let handle = match regular::folder_in(folder, name) {
            // What a link is told to be where none is followed differs from system to system.
            Err(error) if is_no_folder(&error) => return Ok(None),
            opened => opened?,
        };
        let is_ours = is_private(&handle.metadata()?);
        Ok(is_ours.then(|| Self { folder, name: name.to_owned(), handle }))
    }

    fn is_empty(&self) -> bool {
        self.names().is_ok_and(|names| names.is_empty())
    }

    /// What is in it.
    fn names(&self) -> io::Result<Vec<OsString>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(&self.handle)? {
            let entry = entry?;
            let name = OsStr::from_bytes(entry.file_name().to_bytes());
            if name != "." && name != ".." {
                names.push(name.to_owned());
            }
        }
        Ok(names)
    }

    /// Takes what has this name in the folder.
    pub(crate) fn take(&self, name: &OsStr) -> io::Result<()> {
        Ok(renameat(self.folder, name, &self.handle, name)?)
    }

    /// Opens what is held under this name.
    pub(crate) fn open_held(&self, name: &OsStr) -> Result<File, OpenError> {
        regular::open_in(&self.handle, name)
    }

    /// Whether something of this name is held, or in the folder.
    pub(crate) fn is_there(&self, name: &OsStr) -> bool {
        [self.handle.as_fd(), self.folder].iter().any(|at| statat(at, name, AtFlags::SYMLINK_NOFOLLOW).is_ok())
    }

    /// Deletes what is held under this name. That it is gone already is no failure: another daemon, starting, may have
    /// given it back.
    pub(crate) fn delete(&self, name: &OsStr) -> io::Result<()> {
        match unlinkat(&self.handle, name, AtFlags::empty()) {
            Ok(()) | Err(Errno::NOENT) => Ok(()),
            Err(error) => Err(error.into()),
        }
    }

    /// Gives back what is held under this name, unless something newer has its name: then it goes, if it is a file.
    pub(crate) fn give_back(&self, name: &OsStr) -> io::Result<()> {
        match rename_to_free(self.handle.as_fd(), name, self.folder) {
            Err(Errno::EXIST) if self.holds_file(name)? => self.delete(name),
            ended => Ok(ended?),
        }
    }

    fn holds_file(&self, name: &OsStr) -> io::Result<bool> {
        is_file(self.handle.as_fd(), name)
    }

    /// Gives back all files, and removes the folder; whether nothing else was in it.
    fn give_all_back(&self) -> io::Result<bool> {
        for name in self.names()? {
            if self.holds_file(&name)? {
                self.give_back(&name)?;
            }
        }
        let is_empty = self.names()?.is_empty();
        if is_empty {
            self.remove();
        }
        Ok(is_empty)
    }

    /// Removes the folder. Where somebody gave its name to something else, or something is left in it, that stays.
    pub(crate) fn remove(&self) {
        if let Err(error) = unlinkat(self.folder, &self.name, AtFlags::REMOVEDIR) {
            tracing::debug!(folder = shown(self.name.as_ref()), %error, "a holding folder is left to the next start");
        }
    }
}

fn not_private() -> io::Error {
    io::Error::other(
        "a folder made there is not for its owner alone (does its file system keep owners and permissions?)",
    )
}

/// Whether what was opened is no folder, or a link.
fn is_no_folder(error: &io::Error) -> bool {
    let codes = [Errno::NOTDIR, Errno::LOOP, Errno::MLINK].map(Errno::raw_os_error);
    error.raw_os_error().is_some_and(|code| codes.contains(&code))
}

/// Whether something belongs to this user, and nobody else may do anything with it.
fn is_private(metadata: &Metadata) -> bool {
    metadata.uid() == geteuid().as_raw() && metadata.mode() & 0o077 == 0
}

/// Whether this name is that of a regular file.
fn is_file(folder: BorrowedFd, name: &OsStr) -> io::Result<bool> {
    let found = statat(folder, name, AtFlags::SYMLINK_NOFOLLOW)?;
    Ok(FileType::from_raw_mode(found.st_mode) == FileType::RegularFile)
}

/// Moves something to another folder, where its name must be free.
fn rename_to_free(from: BorrowedFd, name: &OsStr, to: BorrowedFd) -> Result<(), Errno> {
    #[cfg(target_os = "linux")]
    match rustix::fs::renameat_with(from, name, to, name, rustix::fs::RenameFlags::NOREPLACE) {
        // Not every file system can do that.
        Err(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP) => {}
        ended => return ended,
    }
    linkat(from, name, to, name, AtFlags::empty())?;
    unlinkat(from, name, AtFlags::empty())
}

/// Tries whether inputs can be taken out of an inbox.
///
/// # Errors
/// [`InboxError`]: why not, and what to do.
pub fn try_out(inbox: &Path) -> Result<(), InboxError> {
    let failed = |error| InboxError { inbox: inbox.to_owned(), error };
    let folder = regular::folder_below(inbox, Path::new("")).map_err(|e| failed(e.into_io()))?;
    Holding::make(folder.as_fd()).map(|holding| holding.remove()).map_err(failed)
}

/// Gives back what was held when the program was killed, in `inbox` and, if asked, in its sub-folders. What is not ours
/// under such a name is left alone, and told.
pub fn recover(inbox: &Path, recursive: bool) {
    for_all_left(inbox, recursive, restore);
}

/// Clears what was being copied to `destination`, and if asked to its sub-folders, when the program was killed. What
/// was held there, as in an inbox, is given back; what is not ours is left alone, and told.
pub fn clear(destination: &Path, recursive: bool) {
    for_all_left(destination, recursive, |folder, name| {
        if is_file(folder, name)? { remove_copy(folder, name) } else { restore(folder, name) }
    });
}

/// Does `work` on everything in `top` that is named as what a killed program leaves: its folder, and its name there.
fn for_all_left(top: &Path, recursive: bool, work: impl Fn(BorrowedFd, &OsStr) -> io::Result<bool>) {
    for path in all_left(top, recursive) {
        match work_on(top, &path, &work) {
            Ok(true) => {}
            Ok(false) => tracing::warn!(
                path = shown(&top.join(path)),
                "left alone: it is named as what planish holds, but is not, or not only, what this user has held; look \
                 into it, and remove it"
            ),
            Err(error) => tracing::warn!(
                path = shown(&top.join(path)),
                "cannot give back or clear what was being put away: {error}; look into it"
            ),
        }
    }
}

fn work_on(top: &Path, path: &Path, work: impl Fn(BorrowedFd, &OsStr) -> io::Result<bool>) -> io::Result<bool> {
    let (Some(above), Some(name)) = (path.parent(), path.file_name()) else { return Ok(false) };
    let folder: OwnedFd = regular::folder_below(top, above).map_err(OpenError::into_io)?;
    work(folder.as_fd(), name)
}

/// The paths, below `top`, of all that is named as what a killed program leaves.
fn all_left(top: &Path, recursive: bool) -> Vec<PathBuf> {
    let is_left = |name: &OsStr| name.as_bytes().starts_with(HOLDING.as_bytes());
    let depth = if recursive { usize::MAX } else { 1 };
    let mut left = Vec::new();
    for entry in WalkDir::new(top).min_depth(1).max_depth(depth).into_iter().filter_map(Result::ok) {
        let Ok(path) = entry.path().strip_prefix(top) else { continue };
        // What is in such a folder is a matter of the folder.
        let is_inside = path.parent().is_some_and(|above| above.iter().any(is_left));
        if is_left(entry.file_name()) && !is_inside {
            left.push(path.to_owned());
        }
    }
    left
}

/// Gives back what a folder holds; whether that was all there is.
fn restore(folder: BorrowedFd, name: &OsStr) -> io::Result<bool> {
    Holding::open(folder, name)?.map_or(Ok(false), |holding| holding.give_all_back())
}

/// Removes a copy that was not completed, if it is ours; whether it was.
fn remove_copy(folder: BorrowedFd, name: &OsStr) -> io::Result<bool> {
    let is_ours = match regular::open_in(folder, name) {
        Ok(file) => is_private(&file.metadata()?),
        Err(_) => false,
    };
    if is_ours {
        unlinkat(folder, name, AtFlags::empty())?;
    }
    Ok(is_ours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{CWD, mknodat};
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{PermissionsExt, symlink};

    /// A folder with an inbox `in` in it.
    fn place() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        fs::create_dir(folder.path().join("in")).expect("made");
        folder
    }

    fn held(folder: &Path, mode: u32) {
        fs::create_dir_all(folder).expect("made");
        fs::set_permissions(folder, Permissions::from_mode(mode)).expect("set");
    }

    fn write(path: &Path, text: &str, mode: u32) {
        fs::write(path, text).expect("written");
        fs::set_permissions(path, Permissions::from_mode(mode)).expect("set");
    }

    /// All paths in a folder.
    pub fn all(folder: &Path) -> Vec<String> {
        let inside = WalkDir::new(folder).min_depth(1).sort_by_file_name().into_iter().flatten();
        inside.map(|e| e.path().strip_prefix(folder).expect("inside").display().to_string()).collect()
    }

    #[test]
    fn what_a_killed_program_held_comes_back_unless_something_newer_is_there() {
        let place = place();
        let inbox = place.path().join("in");
        for (holding, name) in [("sub/.planish-taken-1", "a.stl"), ("sub/.planish-taken-2", "b.stl")] {
            held(&inbox.join(holding), 0o700);
            write(&inbox.join(holding).join(name), "held", 0o644);
        }
        write(&inbox.join("sub/b.stl"), "newer", 0o644);
        recover(&inbox, false);
        assert!(!inbox.join("sub/a.stl").exists(), "not asked for");
        recover(&inbox, true);
        assert_eq!(all(&inbox), ["sub", "sub/a.stl", "sub/b.stl"]);
        assert_eq!(fs::read_to_string(inbox.join("sub/a.stl")).expect("there"), "held");
        assert_eq!(fs::read_to_string(inbox.join("sub/b.stl")).expect("there"), "newer");
    }

    #[test]
    fn folders_that_others_may_have_made_or_filled_are_left_alone() {
        let place = place();
        let inbox = place.path().join("in");
        held(&inbox.join(".planish-taken-open"), 0o755);
        held(&place.path().join("private"), 0o700);
        symlink(place.path().join("private"), inbox.join(".planish-taken-link")).expect("linked");
        write(&inbox.join(".planish-taken-open/a.stl"), "a", 0o644);
        write(&place.path().join("private/b.stl"), "b", 0o600);
        write(&inbox.join(".planish-taken-file"), "c", 0o600);
        let before = all(place.path());
        recover(&inbox, true);
        assert_eq!(all(place.path()), before);
    }

    #[test]
    fn folders_of_other_users_are_left_alone() {
        let place = place();
        let inbox = place.path().join("in");
        let theirs = inbox.join(".planish-taken-1");
        held(&theirs, 0o700);
        write(&theirs.join("a.stl"), "a", 0o600);
        if std::os::unix::fs::chown(&theirs, Some(65534), None).is_err() {
            eprintln!("skipped: only root can give files away");
            return;
        }
        recover(&inbox, true);
        assert_eq!(all(&inbox), [".planish-taken-1", ".planish-taken-1/a.stl"]);
    }

    /// What is held is never opened, so no link leads anywhere and no pipe blocks.
    #[test]
    fn links_and_pipes_in_a_folder_of_ours_stay_there() {
        let place = place();
        let inbox = place.path().join("in");
        let ours = inbox.join(".planish-taken-1");
        held(&ours, 0o700);
        write(&place.path().join("secret"), "secret", 0o600);
        symlink("../../secret", ours.join("link.stl")).expect("linked");
        mknodat(CWD, ours.join("pipe.stl"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
        write(&ours.join("a.stl"), "a", 0o644);
        recover(&inbox, true);
        let left = ["", "/link.stl", "/pipe.stl"].map(|name| format!(".planish-taken-1{name}"));
        assert_eq!(all(&inbox), [&left[..], &["a.stl".to_owned()]].concat());
    }

    #[test]
    fn unfinished_copies_of_ours_are_cleared_and_nothing_else() {
        let place = place();
        let done = place.path().join("in");
        fs::create_dir(done.join("sub")).expect("made");
        for name in [".planish-taken-1", "sub/.planish-taken-2"] {
            write(&done.join(name), "half", 0o600);
        }
        write(&done.join(".planish-taken-open"), "for all", 0o644);
        write(&done.join("a.stl"), "a", 0o600);
        symlink("a.stl", done.join(".planish-taken-link")).expect("linked");
        held(&done.join(".planish-taken-3"), 0o700);
        held(&done.join(".planish-taken-4"), 0o755);
        write(&done.join(".planish-taken-3/b.stl"), "b", 0o644);
        clear(&done, false);
        assert!(done.join("sub/.planish-taken-2").exists(), "not asked for");
        clear(&done, true);
        let left = [".planish-taken-4", ".planish-taken-link", ".planish-taken-open", "a.stl", "b.stl", "sub"];
        assert_eq!(all(&done), left);
    }

    #[test]
    fn a_holding_folder_is_for_its_owner_alone_and_known_by_its_handle() {
        let place = place();
        let inbox = place.path().join("in");
        let folder = regular::folder_below(&inbox, Path::new("")).expect("there");
        let holding = Holding::make(folder.as_fd()).expect("made");
        let path = inbox.join(&holding.name);
        assert_eq!(fs::metadata(&path).expect("there").mode() & 0o777, 0o700);
        write(&inbox.join("a.stl"), "a", 0o644);
        // Somebody puts a folder with other files in its place.
        fs::rename(&path, inbox.join("aside")).expect("renamed");
        held(&path, 0o755);
        write(&path.join("a.stl"), "theirs", 0o644);
        holding.take("a.stl".as_ref()).expect("taken");
        assert!(inbox.join("aside/a.stl").exists());
        holding.delete("a.stl".as_ref()).expect("deleted");
        holding.remove();
        assert_eq!(fs::read_to_string(path.join("a.stl")).expect("there"), "theirs");
        assert_eq!(all(&inbox.join("aside")), Vec::<String>::new());
    }

    #[test]
    fn an_inbox_is_tried_out_without_a_trace() {
        let place = place();
        try_out(&place.path().join("in")).expect("it can be written");
        assert_eq!(all(place.path()), ["in"]);
        let told = try_out(&place.path().join("gone")).expect_err("not there").to_string();
        assert!(told.contains("gone") && told.contains("--inputs keep"), "{told}");
    }
}
