//! What planish does to a disk where something must not be lost: a few operations on open folders and files.
//!
//! Publishing, the ledger, staging, holding and putting away go through [`Disk`], and through nothing else. So they run
//! on the system's disks ([`System`]) as they do on one in memory that loses power, is killed and fails at every single
//! operation; the tests prove there what is promised of the other one.
//!
//! Everything is named relative to an open folder, by one plain name: whatever becomes of the folder's own name, or of a
//! folder above it, work goes on where it began. No operation follows a link, waits for another end, or opens what is no
//! regular file, but for the two that say so. What is written is on disk after [`File::sync`], its name after
//! [`Folder::sync`] of the folder that it is in.
//!
//! Deliberately absent: writing to a file that has a name in a result or an inbox already. What is replaced is replaced
//! by a rename.

mod placing;
#[cfg(test)]
pub(crate) mod simulated;
mod system;

use crate::system::fingerprint::Identity;
use crate::system::safe_open::OpenError;
pub use placing::{make_unique, make_unique_folder, rename_to_free, replace_file, replace_with, unique_name};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::fmt::Debug;
use std::io::{self, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};
pub use system::System;

/// The permissions of folders and files that are for all whom the user's mask lets in.
pub const OPEN_FOLDER: u32 = 0o777;

/// As [`OPEN_FOLDER`], of files.
pub const OPEN_FILE: u32 = 0o666;

/// Where paths lead to folders.
pub trait Disk: Clone + Debug + Send + Sync + 'static {
    /// An open folder.
    type Folder: Folder;

    /// Opens the folder that a path leads to, through links, too.
    ///
    /// # Errors
    /// Those of the system.
    fn open(&self, path: &Path) -> io::Result<Self::Folder>;
}

/// An open folder. Names are plain; errors are those of the system, except where others are told.
#[expect(clippy::missing_errors_doc, reason = "all of them fail as the system does")]
pub trait Folder: Sized + Debug + Send + Sync + 'static {
    /// An open file.
    type File: File;

    /// What the folder looks like.
    fn stat(&self) -> io::Result<Stat>;

    /// What something in the folder looks like; a link itself.
    fn stat_of(&self, name: impl AsRef<OsStr>) -> io::Result<Stat>;

    /// The names in it, in any order.
    fn list(&self) -> io::Result<Vec<OsString>>;

    /// Opens a folder, no link to one.
    fn open_folder(&self, name: impl AsRef<OsStr>) -> io::Result<Self>;

    /// Opens a regular file to read it, no link to one.
    fn open_file(&self, name: impl AsRef<OsStr>) -> Result<Self::File, OpenError>;

    /// Opens the regular file that a link, perhaps, leads to.
    fn follow_file(&self, name: impl AsRef<OsStr>) -> Result<Self::File, OpenError>;

    /// Opens a file to read and write it, no link to one; if asked, makes it for its owner alone where it is missing. It
    /// may be something else than a regular file: whoever opens it looks.
    fn open_private(&self, name: impl AsRef<OsStr>, make: bool) -> io::Result<Self::File>;

    /// Where a link leads.
    fn read_link(&self, name: impl AsRef<OsStr>) -> io::Result<OsString>;

    /// Makes a folder.
    fn make_folder(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<()>;

    /// Makes an empty file, to write it.
    fn make_file(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<Self::File>;

    /// Makes a link that leads to `target`.
    fn make_link(&self, target: &OsStr, name: impl AsRef<OsStr>) -> io::Result<()>;

    /// Gives a file a second name, in another folder; a link itself.
    fn link(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>) -> io::Result<()>;

    /// Moves something to a name in another folder.
    fn rename(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>, how: Rename) -> io::Result<()>;

    /// Takes the name of a file or link away.
    fn unlink(&self, name: impl AsRef<OsStr>) -> io::Result<()>;

    /// Removes an empty folder.
    fn remove_folder(&self, name: impl AsRef<OsStr>) -> io::Result<()>;

    /// Sets the permissions of the folder.
    fn set_mode(&self, mode: u32) -> io::Result<()>;

    /// Brings the names in it to disk.
    fn sync(&self) -> io::Result<()>;
}

/// An open file. Errors are those of the system.
#[expect(clippy::missing_errors_doc, reason = "all of them fail as the system does")]
pub trait File: Sized + Debug + Send + Sync + 'static {
    /// What it looks like.
    fn stat(&self) -> io::Result<Stat>;

    /// Its content, from the beginning.
    fn content(&self) -> io::Result<impl Read + '_>;

    /// Writes behind what was written to it before.
    fn append(&self, bytes: &[u8]) -> io::Result<()>;

    /// Sets its permissions.
    fn set_mode(&self, mode: u32) -> io::Result<()>;

    /// Sets the time of its last change.
    fn set_time(&self, time: Time) -> io::Result<()>;

    /// Brings its content, permissions and time to disk.
    fn sync(&self) -> io::Result<()>;

    /// Locks it for this handle, if nobody else has; whether it is locked.
    fn lock_now(&self) -> io::Result<bool>;

    /// Whether somebody has it open to write to it. None: the system cannot tell.
    fn has_writer(&self) -> io::Result<Option<bool>>;
}

/// What becomes of something that has the new name already.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rename {
    /// A file goes, a folder only if it is empty.
    Over,
    /// It stays: the rename fails. Not every file system can do that.
    ToFree,
    /// The two change places; it fails where there is nothing. Not every file system can do that.
    Exchange,
}

/// Seconds since 1970, and nanoseconds.
pub type Time = (i64, i64);

/// What something looks like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stat {
    /// What it is.
    pub kind: Kind,
    /// Its size.
    pub bytes: u64,
    /// Which one it is, whatever its name.
    pub identity: Identity,
    /// When its content was last changed.
    pub modified: Time,
    /// When anything of it was last changed.
    pub changed: Time,
    /// The number of its user.
    pub owner: u32,
    /// Its permissions.
    pub mode: u32,
}

impl Stat {
    /// Whether it is a folder.
    pub fn is_folder(&self) -> bool {
        self.kind == Kind::Folder
    }

    /// Whether it is a regular file.
    pub fn is_file(&self) -> bool {
        self.kind == Kind::File
    }

    /// What a copy gets of its permissions: to run as its owner is not among it, as a copy belongs to somebody else.
    pub fn mode_of_copy(&self) -> u32 {
        self.mode & 0o777
    }
}

/// What lies in folders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// A pipe, a device.
    Other,
}

/// Opens the folder `path`, and makes it, and those above it, where they are missing: on disk, too.
///
/// # Errors
/// Those of the system.
pub fn make_all<D: Disk>(disk: &D, path: &Path) -> io::Result<D::Folder> {
    // The empty path is where the program was started.
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    let (missing, above, name) = match (disk.open(path), path.parent(), path.file_name()) {
        (Err(error), Some(above), Some(name)) if error.kind() == ErrorKind::NotFound => (error, above, name),
        (opened, ..) => return opened,
    };
    let above = make_all(disk, above)?;
    match above.make_folder(name, OPEN_FOLDER) {
        Ok(()) => above.sync()?,
        // A link that leads nowhere.
        Err(error) if error.kind() == ErrorKind::AlreadyExists && disk.open(path).is_err() => return Err(missing),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
        Err(error) => return Err(error),
    }
    disk.open(path)
}

/// Brings to disk the names in `top`, and in every folder on the way from there to `top/below`, and in that.
///
/// # Errors
/// Where, and those of the system.
pub fn sync_down<D: Disk>(disk: &D, top: &Path, below: &Path) -> Result<(), (PathBuf, io::Error)> {
    for part in below.ancestors() {
        let path = top.join(part);
        disk.open(&path).and_then(|folder| folder.sync()).map_err(|error| (path, error))?;
    }
    Ok(())
}

/// Brings to disk the name of the folder `path` itself, where the folder above it may be read.
///
/// # Errors
/// Those of the system.
pub fn sync_name<D: Disk>(disk: &D, path: &Path) -> io::Result<()> {
    let Some(above) = path.parent() else { return Ok(()) };
    let above = if above.as_os_str().is_empty() { Path::new(".") } else { above };
    match disk.open(above) {
        Err(error) if error.kind() == ErrorKind::PermissionDenied => Ok(()),
        opened => opened?.sync(),
    }
}

/// Opens the folder `name` below `top` (or that itself, where `name` is empty), where there is no link on the way from
/// there on.
///
/// # Errors
/// [`OpenError`].
pub fn below<F: Folder>(top: F, name: &Path) -> Result<F, OpenError> {
    let mut at = top;
    for part in name.components() {
        let Component::Normal(part) = part else { return Err(OpenError::NotRegular) };
        at = at.open_folder(part)?;
    }
    Ok(at)
}

/// Removes what has this name, and all that is in it. Nothing is followed; that it is gone already is no failure.
///
/// # Errors
/// Those of the system; the rest stays.
pub fn remove_all<F: Folder>(folder: &F, name: &OsStr) -> io::Result<()> {
    let removed = match folder.stat_of(name) {
        Ok(found) if found.is_folder() => remove_folder(folder, name),
        Ok(_) => folder.unlink(name),
        Err(error) => Err(error),
    };
    match removed {
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(()),
        removed => removed,
    }
}

fn remove_folder<F: Folder>(folder: &F, name: &OsStr) -> io::Result<()> {
    let inside = folder.open_folder(name)?;
    for each in inside.list()? {
        remove_all(&inside, &each)?;
    }
    folder.remove_folder(name)
}

/// Whether a folder was not removed as there is something in it.
pub fn is_full(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::DirectoryNotEmpty | io::ErrorKind::AlreadyExists)
}

/// Whether a file system tells that it cannot do this at all.
pub fn is_unsupported(error: &io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::INVAL | Errno::NOSYS | Errno::OPNOTSUPP))
}

/// Whether what was to be opened as a folder is none, or a link. What a link is told to be differs from system to system.
pub fn is_no_folder(error: &io::Error) -> bool {
    matches!(Errno::from_io_error(error), Some(Errno::NOTDIR | Errno::LOOP | Errno::MLINK))
}
