//! How something comes to its place: made under a name that nobody has, filled, brought to disk, renamed. This is the one
//! place where files are written so; whole results are put in place by [`crate::output::staging`], which stands on it.

use super::{File as _, Folder, OPEN_FILE, Rename, is_unsupported};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::hash::{BuildHasher, RandomState};
use std::io::{self, ErrorKind};

/// How the names of files begin that are not complete: hidden, as the desk may be a folder of somebody else's.
const FRESH: &str = ".planish-fresh-";

/// Names that are tried to find a free one.
const ATTEMPTS: u32 = 100;

/// A name that others cannot guess.
pub fn unique_name(prefix: &str) -> OsString {
    OsString::from(format!("{prefix}{:016x}", RandomState::new().hash_one(())))
}

/// Makes something under a new name, which begins like this.
///
/// ```
/// use planish::system::disk::make_unique;
///
/// # fn main() -> std::io::Result<()> {
/// let folder = tempfile::tempdir()?;
/// let (name, ()) = make_unique("run-", |name| std::fs::create_dir(folder.path().join(name)))?;
/// assert!(name.to_string_lossy().starts_with("run-"));
/// assert!(folder.path().join(&name).is_dir());
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Those of `make`.
pub fn make_unique<T>(prefix: &str, make: impl Fn(&OsStr) -> io::Result<T>) -> io::Result<(OsString, T)> {
    for _ in 0..ATTEMPTS {
        let name = unique_name(prefix);
        match make(&name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return Ok((name, made?)),
        }
    }
    Err(Errno::EXIST.into())
}

/// Makes a folder under a new name, which begins like this.
///
/// # Errors
/// Those of the system.
pub fn make_unique_folder<F: Folder>(folder: &F, prefix: &str, mode: u32) -> io::Result<(OsString, F)> {
    let (name, ()) = make_unique(prefix, |name| folder.make_folder(name, mode))?;
    let made = folder.open_folder(&name)?;
    Ok((name, made))
}

/// Gives a file in `folder` this content at once: it is complete, on disk, or as it was. It is written on the `desk`, a
/// folder on the same file system.
///
/// # Errors
/// Those of the system.
pub fn replace_file<F: Folder>(desk: &F, folder: &F, name: impl AsRef<OsStr>, content: &[u8]) -> io::Result<()> {
    replace_with(desk, folder, name, |file| file.append(content).and_then(|()| file.sync()))?;
    folder.sync()
}

/// As [`replace_file`], of a file that `write` writes to: nothing waits for the disk, unless that does.
///
/// # Errors
/// Those of the system, and of `write`.
pub fn replace_with<F: Folder>(
    desk: &F,
    folder: &F,
    name: impl AsRef<OsStr>,
    write: impl Fn(&F::File) -> io::Result<()>,
) -> io::Result<()> {
    let (fresh, file) = make_unique(FRESH, |fresh| desk.make_file(fresh, OPEN_FILE))?;
    let placed = write(&file).and_then(|()| desk.rename(&fresh, folder, name, Rename::Over));
    if placed.is_err() {
        let _ = desk.unlink(&fresh);
    }
    placed
}

/// Moves a file or link to another folder, where its name must be free.
///
/// # Errors
/// Those of the system.
pub fn rename_to_free<F: Folder>(from: &F, name: &OsStr, to: &F, to_name: &OsStr) -> io::Result<()> {
    match from.rename(name, to, to_name, Rename::ToFree) {
        Err(error) if is_unsupported(&error) => {}
        ended => return ended,
    }
    from.link(name, to, to_name)?;
    from.unlink(name)
}
