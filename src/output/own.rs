//! Folders and lock files of our own, in places where others may write.
//!
//! Whoever may write to an output folder may have put there, under our names, a link to what must not be touched, a
//! pipe that would never open, or a folder with work. So nothing is opened by following a link, nothing is emptied, and
//! only what is a real folder or a regular file is taken for ours. And whoever may read a file may lock it: lock files
//! are readable by their owner only, and nobody waits for a lock for ever.

use crate::system::disk::{self, Disk, File, Folder, OPEN_FOLDER};
use crate::system::safe_open;
use rustix::fs::CWD;
use rustix::io::Errno;
use std::ffi::OsStr;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::time::{Duration, Instant};

/// Others may neither read nor write.
const PRIVATE: u32 = 0o600;

/// How long the lock of an output folder is waited for. Whoever holds one does so for milliseconds mostly; but disks may
/// be slow, and what people put into a result may have to be copied.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// The longest pause between two looks at a lock.
const PAUSE: Duration = Duration::from_millis(50);

/// Opens the folder at `path`; makes it, and those above it, unless a real one is there.
///
/// # Errors
/// The system refuses, or something else is there: a link, too.
pub fn folder<D: Disk>(disk: &D, path: &Path) -> io::Result<D::Folder> {
    let above = disk::make_all(disk, path.parent().unwrap_or(path))?;
    let name = path.file_name().unwrap_or_default();
    let opened = match above.open_folder(name) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            made_or_there(above.make_folder(name, OPEN_FOLDER))?;
            above.sync()?;
            above.open_folder(name)
        }
        opened => opened,
    };
    opened.map_err(|error| {
        let told = "it is no folder, or a link to one; remove it, or use another output folder";
        if disk::is_no_folder(&error) { io::Error::other(told) } else { error }
    })
}

/// Somebody else may make the same folder in the same moment.
fn made_or_there(made: io::Result<()>) -> io::Result<()> {
    match made {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        made => made,
    }
}

/// As [`open_lock`], in the folder at a path.
///
/// # Errors
/// As [`open_lock`].
pub fn lock_file(folder: &Path, name: &str) -> io::Result<std::fs::File> {
    open_lock(&safe_open::folder_in(CWD, folder.as_os_str())?, name.as_ref())
}

/// Opens the lock file `name` in `folder`; makes it where it is missing. Nothing in it changes, and only its owner may
/// read it afterwards.
///
/// # Errors
/// The system refuses, or it is no regular file.
pub fn open_lock<F: Folder>(folder: &F, name: &OsStr) -> io::Result<F::File> {
    checked(folder.open_private(name, true))
}

/// As [`open_lock`], of a file that is there.
///
/// # Errors
/// As [`open_lock`].
pub fn open_lock_there<F: Folder>(folder: &F, name: &OsStr) -> io::Result<F::File> {
    checked(folder.open_private(name, false))
}

fn checked<F: File>(opened: io::Result<F>) -> io::Result<F> {
    let file = opened.map_err(|error| match Errno::from_io_error(&error) {
        Some(Errno::LOOP) => io::Error::other("it is a link, which is not followed; remove it"),
        _ => error,
    })?;
    let found = file.stat()?;
    if !found.is_file() {
        return Err(io::Error::other("it is no regular file; remove it"));
    }
    if found.mode != PRIVATE {
        // Of an older version, or of somebody else, whose permissions are not ours to change.
        let _ = file.set_mode(PRIVATE);
    }
    Ok(file)
}

/// Locks a file with this path if that is possible within `patience`, and as long as it is `wanted`; whether it is locked.
/// That it takes long is told once. Ends: the time runs out.
///
/// # Errors
/// The system refuses.
pub fn lock(file: &impl File, path: &Path, patience: Duration, wanted: impl Fn() -> bool) -> io::Result<bool> {
    let began = Instant::now();
    let (mut pause, mut is_told) = (Duration::from_millis(1), false);
    loop {
        if file.lock_now()? {
            return Ok(true);
        }
        if !wanted() || began.elapsed() >= patience {
            return Ok(false);
        }
        if began.elapsed() > Duration::from_secs(1) && !std::mem::replace(&mut is_told, true) {
            tracing::warn!(lock = crate::system::escape::escape(path), "waits for a lock that another process holds");
        }
        std::thread::sleep(pause);
        pause = PAUSE.min(2 * pause);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::disk::System;
    use rustix::fs::{FileType, Mode, mknodat};
    use std::fs;
    use std::os::unix::fs::{PermissionsExt, symlink};

    #[test]
    fn a_lock_file_is_private_keeps_its_content_and_is_no_link_and_no_pipe() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("old"), "content").expect("written");
        lock_file(folder.path(), "old").expect("opens");
        assert_eq!(fs::read_to_string(at("old")).expect("there"), "content");
        lock_file(folder.path(), "new").expect("made");
        for name in ["old", "new"] {
            assert_eq!(fs::metadata(at(name)).expect("there").permissions().mode() & 0o777, 0o600, "{name}");
        }
        symlink("old", at("link")).expect("linked");
        mknodat(CWD, at("pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
        for name in ["link", "pipe", "."] {
            assert!(lock_file(folder.path(), name).is_err(), "{name}");
        }
        let opened = System.open(folder.path()).expect("there");
        assert!(open_lock_there(&opened, "missing".as_ref()).is_err() && !at("missing").exists());
        symlink(".", at("folder")).expect("linked");
        assert!(lock_file(&at("folder"), "old").is_err(), "nor through a link");
    }

    #[test]
    fn a_folder_is_made_and_a_link_is_none() {
        let place = tempfile::tempdir().expect("a folder");
        let at = |name: &str| place.path().join(name);
        (0..2).for_each(|_| drop(folder(&System, &at("a/b")).expect("made, and there")));
        symlink("a", at("link")).expect("linked");
        fs::write(at("file"), "").expect("written");
        assert!(folder(&System, &at("link")).is_err() && folder(&System, &at("file")).is_err());
    }

    #[test]
    fn waiting_for_a_lock_ends() {
        let folder = tempfile::tempdir().expect("a folder");
        let [held, other] = [(); 2].map(|()| lock_file(folder.path(), "lock").expect("opens"));
        assert!(lock(&held, folder.path(), PATIENCE, || true).expect("free"));
        let patience = Duration::from_millis(30);
        assert!(!lock(&other, folder.path(), patience, || true).expect("in vain"));
        assert!(!lock(&other, folder.path(), PATIENCE, || false).expect("nobody waits"));
        drop(held);
        assert!(lock(&other, folder.path(), PATIENCE, || true).expect("free again"));
    }
}
