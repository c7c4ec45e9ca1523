//! Hidden folders in which files of an inbox are held while they are looked at for the last time.
//!
//! Whoever may drop files into an inbox may also rename, remove and make folders there. So a holding folder is used
//! through a handle, whatever becomes of its name, and only where nobody but this user can look or reach into it. At
//! the next start only such folders are taken for ones that a killed program has left ([`recover`]): what others made
//! under such a name is left alone, never read, and told.
//!
//! Deliberately absent: any copy. What is held goes in and comes back by a rename, so nothing of it is opened, be it a
//! link, a pipe or a device.

use crate::system::disk::{self, Disk, File, Folder, Stat};
use crate::system::escape::escape;
use crate::system::safe_open::OpenError;
use rustix::process::geteuid;
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

/// How the names of hidden folders and files begin.
pub(crate) const HOLDING: &str = ".planish-taken-";

/// What only its owner may do anything with.
const PRIVATE: u32 = 0o700;

/// Why inputs cannot be taken out of an inbox.
#[derive(Debug, thiserror::Error)]
#[error(
    "inputs cannot be put away, as nothing can be taken out of the inbox {}: {error}; let the user that planish runs \
     as write to this folder, or leave inputs where they are (`--inputs keep`)", escape(.inbox)
)]
pub struct InboxError {
    /// The inbox.
    inbox: PathBuf,
    /// Why.
    error: io::Error,
}

/// A holding folder.
pub(crate) struct Holding<'a, F> {
    folder: &'a F,
    name: OsString,
    handle: F,
}

impl<'a, F: Folder> Holding<'a, F> {
    /// Makes one in an open folder.
    pub(crate) fn make(folder: &'a F) -> io::Result<Self> {
        let (name, ()) = disk::make_unique(HOLDING, |name| folder.make_folder(name, PRIVATE))?;
        Self::just_made(folder, &name)
    }

    /// Opens one that should be as it was made.
    fn just_made(folder: &'a F, name: &OsStr) -> io::Result<Self> {
        let made = match Self::open(folder, name) {
            Ok(made) => made.filter(Self::is_empty).ok_or_else(not_private),
            Err(error) => Err(error),
        };
        if made.is_err() {
            // Fails where something else has taken its place, and then shall.
            let _ = folder.remove_folder(name);
        }
        made
    }

    /// Opens one. None: it is no folder that only this user can have made and filled.
    fn open(folder: &'a F, name: &OsStr) -> io::Result<Option<Self>> {
        let handle = match folder.open_folder(name) {
            Err(error) if disk::is_no_folder(&error) => return Ok(None),
            opened => opened?,
        };
        let is_ours = is_private(&handle.stat()?);
        Ok(is_ours.then(|| Self { folder, name: name.to_owned(), handle }))
    }

    fn is_empty(&self) -> bool {
        self.handle.list().is_ok_and(|names| names.is_empty())
    }

    /// Takes what has this name in the folder.
    pub(crate) fn take(&self, name: &OsStr) -> io::Result<()> {
        self.folder.rename(name, &self.handle, name, disk::Rename::Over)
    }

    /// Opens what is held under this name.
    pub(crate) fn open_held(&self, name: &OsStr) -> Result<F::File, OpenError> {
        self.handle.open_file(name)
    }

    /// Whether something of this name is held, or in the folder.
    pub(crate) fn is_there(&self, name: &OsStr) -> bool {
        [&self.handle, self.folder].iter().any(|at| at.stat_of(name).is_ok())
    }

    /// Deletes what is held under this name. That it is gone already is no failure: another daemon, starting, may have
    /// given it back.
    pub(crate) fn delete(&self, name: &OsStr) -> io::Result<()> {
        match self.handle.unlink(name) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error),
            Ok(()) | Err(_) => Ok(()),
        }
    }

    /// Gives back what is held under this name, unless something newer has its name: then it goes, if it is a file.
    pub(crate) fn give_back(&self, name: &OsStr) -> io::Result<()> {
        match disk::rename_to_free(&self.handle, name, self.folder, name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && self.holds_file(name)? => self.delete(name),
            ended => ended,
        }
    }

    fn holds_file(&self, name: &OsStr) -> io::Result<bool> {
        Ok(self.handle.stat_of(name)?.is_file())
    }

    /// Gives back all files, and removes the folder; whether nothing else was in it.
    fn give_all_back(&self) -> io::Result<bool> {
        for name in self.handle.list()? {
            if self.holds_file(&name)? {
                self.give_back(&name)?;
            }
        }
        let is_empty = self.handle.list()?.is_empty();
        if is_empty {
            self.remove();
        }
        Ok(is_empty)
    }

    /// Removes the folder. Where somebody gave its name to something else, or something is left in it, that stays.
    pub(crate) fn remove(&self) {
        if let Err(error) = self.folder.remove_folder(&self.name) {
            tracing::debug!(folder = escape(self.name.as_ref()), %error, "a holding folder is left to the next start");
        }
    }
}

fn not_private() -> io::Error {
    io::Error::other(
        "a folder made there is not for its owner alone (does its file system keep owners and permissions?)",
    )
}

/// Whether something belongs to this user, and nobody else may do anything with it.
fn is_private(found: &Stat) -> bool {
    found.owner == geteuid().as_raw() && found.mode & 0o077 == 0
}

/// Tries whether inputs can be taken out of an inbox.
///
/// # Errors
/// [`InboxError`]: why not, and what to do.
pub fn try_out(disk: &impl Disk, inbox: &Path) -> Result<(), InboxError> {
    let failed = |error| InboxError { inbox: inbox.to_owned(), error };
    let folder = disk.open(inbox).map_err(failed)?;
    Holding::make(&folder).map(|holding| holding.remove()).map_err(failed)
}

/// Gives back what was held when the program was killed, in `inbox` and, if asked, in its sub-folders. What is not ours
/// under such a name is left alone, and told.
pub fn recover(disk: &impl Disk, inbox: &Path, recursive: bool) {
    for_all_left(disk, inbox, recursive, restore);
}

/// Clears what was being copied to `destination`, and if asked to its sub-folders, when the program was killed. What
/// was held there, as in an inbox, is given back; what is not ours is left alone, and told.
pub fn clear(disk: &impl Disk, destination: &Path, recursive: bool) {
    for_all_left(disk, destination, recursive, |folder, name| {
        if folder.stat_of(name)?.is_file() { remove_copy(folder, name) } else { restore(folder, name) }
    });
}

/// Does `work` on everything in `top` that is named as what a killed program leaves: its folder, and its name there.
fn for_all_left<D: Disk>(disk: &D, top: &Path, recursive: bool, work: impl Fn(&D::Folder, &OsStr) -> io::Result<bool>) {
    let mut left = Vec::new();
    add_left(disk, top, Path::new(""), recursive, &mut left);
    for path in left {
        match work_on(disk, top, &path, &work) {
            Ok(true) => {}
            Ok(false) => tracing::warn!(
                path = escape(&top.join(path)),
                "left alone: it is named as what planish holds, but is not, or not only, what this user has held; look \
                 into it, and remove it"
            ),
            Err(error) => tracing::warn!(
                path = escape(&top.join(path)),
                "cannot give back or clear what was being put away: {error}; look into it"
            ),
        }
    }
}

fn work_on<D: Disk>(
    disk: &D,
    top: &Path,
    path: &Path,
    work: impl Fn(&D::Folder, &OsStr) -> io::Result<bool>,
) -> io::Result<bool> {
    let (Some(above), Some(name)) = (path.parent(), path.file_name()) else { return Ok(false) };
    let folder = disk::below(disk.open(top)?, above).map_err(OpenError::into_io)?;
    work(&folder, name)
}

/// Adds the paths, below `top`, of all in the folder `at` that is named as what a killed program leaves. What is in such
/// a folder is a matter of the folder. A folder that cannot be read is passed over.
fn add_left<D: Disk>(disk: &D, top: &Path, at: &Path, recursive: bool, left: &mut Vec<PathBuf>) {
    // Each is opened anew from the top, so that deep trees need no more handles than flat ones.
    let opened = disk.open(top).map_err(OpenError::Io).and_then(|top| disk::below(top, at));
    let Ok(folder) = opened else { return };
    let mut folders = Vec::new();
    for name in folder.list().unwrap_or_default() {
        if name.as_bytes().starts_with(HOLDING.as_bytes()) {
            left.push(at.join(name));
        } else if recursive && folder.stat_of(&name).is_ok_and(|found| found.is_folder()) {
            folders.push(at.join(name));
        }
    }
    drop(folder);
    folders.iter().for_each(|below| add_left(disk, top, below, recursive, left));
}

/// Gives back what a folder holds; whether that was all there is.
fn restore<F: Folder>(folder: &F, name: &OsStr) -> io::Result<bool> {
    Holding::open(folder, name)?.map_or(Ok(false), |holding| holding.give_all_back())
}

/// Removes a copy that was not completed, if it is ours; whether it was.
fn remove_copy<F: Folder>(folder: &F, name: &OsStr) -> io::Result<bool> {
    let is_ours = match folder.open_file(name) {
        Ok(file) => is_private(&file.stat()?),
        Err(_) => false,
    };
    if is_ours {
        folder.unlink(name)?;
    }
    Ok(is_ours)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::disk::System;
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    use std::fs::{self, Permissions};
    use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
    use walkdir::WalkDir;

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
        recover(&System, &inbox, false);
        assert!(!inbox.join("sub/a.stl").exists(), "not asked for");
        recover(&System, &inbox, true);
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
        recover(&System, &inbox, true);
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
        recover(&System, &inbox, true);
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
        recover(&System, &inbox, true);
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
        clear(&System, &done, false);
        assert!(done.join("sub/.planish-taken-2").exists(), "not asked for");
        clear(&System, &done, true);
        let left = [".planish-taken-4", ".planish-taken-link", ".planish-taken-open", "a.stl", "b.stl", "sub"];
        assert_eq!(all(&done), left);
    }

    #[test]
    fn a_holding_folder_is_for_its_owner_alone_and_known_by_its_handle() {
        let place = place();
        let inbox = place.path().join("in");
        let folder = System.open(&inbox).expect("there");
        let holding = Holding::make(&folder).expect("made");
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
        try_out(&System, &place.path().join("in")).expect("it can be written");
        assert_eq!(all(place.path()), ["in"]);
        let told = try_out(&System, &place.path().join("gone")).expect_err("not there").to_string();
        assert!(told.contains("gone") && told.contains("--inputs keep"), "{told}");
    }
}
