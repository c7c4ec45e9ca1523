//! Opening regular files, and nothing else. Anybody may have put there what a path leads to: a pipe or a device could
//! block for ever, a link could lead to what is not meant for everybody.
//!
//! What is opened is looked at once more after it is opened, and that is what is read: so it does not matter what
//! takes the place of a file, or of a folder on the way to it, after somebody has looked.

use crate::system::disk::{self, Disk, System};
use crate::system::escape::escape;
use blake3::{Hash, Hasher};
use rustix::fd::{AsFd, OwnedFd};
use rustix::fs::{AtFlags, CWD, FileType, Mode, OFlags, openat, statat};
use serde::de::DeserializeOwned;
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The system refuses.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It is a folder, a pipe, a device, or a link where none is followed.
    #[error("it is no regular file")]
    NotRegular,
    /// It is a link that leads somewhere else.
    #[error("it is a link that leads out of the folder {}: name the link itself, or copy the file", escape(.0))]
    LeadsOut(PathBuf),
    /// It is too large.
    #[error("it has {size} bytes, more than {most}")]
    TooLarge {
        /// Its bytes, as far as they were counted.
        size: u64,
        /// How many it may have.
        most: u64,
    },
}

impl OpenError {
    /// Whether nothing is there.
    pub fn is_missing(&self) -> bool {
        matches!(self, Self::Io(error) if error.kind() == io::ErrorKind::NotFound)
    }

    /// As an error of the system.
    pub fn into_io(self) -> io::Error {
        if let Self::Io(error) = self { error } else { io::Error::other(self.to_string()) }
    }
}

/// Nothing waits for another end (pipes), and no terminal takes control.
pub(crate) const FLAGS: OFlags = OFlags::CLOEXEC.union(OFlags::NONBLOCK).union(OFlags::NOCTTY);

/// Opens the regular file that a path leads to.
///
/// # Errors
/// [`OpenError`].
pub fn open(path: &Path) -> Result<File, OpenError> {
    open_at(CWD, path, false)
}

/// As [`open`], where the last part of the path is no link.
///
/// # Errors
/// [`OpenError`].
pub fn open_itself(path: &Path) -> Result<File, OpenError> {
    open_at(CWD, path, true)
}

/// As [`open`], where what the path leads to lies in `folder`, itself or in folders below.
///
/// ```
/// use planish::system::safe_open::{OpenError, open, open_inside};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let top = tempfile::tempdir()?;
/// let (inbox, secret) = (top.path().join("inbox"), top.path().join("secret.stl"));
/// std::fs::create_dir(&inbox)?;
/// std::fs::write(&secret, "solid")?;
/// let link = inbox.join("part.stl");
/// std::os::unix::fs::symlink(&secret, &link)?;
/// assert!(open(&link).is_ok());
/// assert!(matches!(open_inside(&inbox, &link), Err(OpenError::LeadsOut(_))));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`OpenError`].
pub fn open_inside(folder: &Path, path: &Path) -> Result<File, OpenError> {
    let (real, target) = (folder.canonicalize()?, path.canonicalize()?);
    // Where a link is put on the way after this, it is not followed.
    let name = target.strip_prefix(&real).map_err(|_| OpenError::LeadsOut(folder.to_owned()))?;
    open_below(&real, name)
}

/// Opens the regular file `name` below `folder`, where there is no link on the way from there on.
///
/// # Errors
/// [`OpenError`].
pub fn open_below(folder: &Path, name: &Path) -> Result<File, OpenError> {
    let at = disk::below(System.open(folder)?, name.parent().unwrap_or(Path::new("")))?;
    open_in(&at, Path::new(name.file_name().ok_or(OpenError::NotRegular)?))
}

/// Opens the folder `name` in an open folder; it is no link.
///
/// # Errors
/// Where it is none, or must not be opened.
pub fn folder_in(folder: impl AsFd, name: &OsStr) -> io::Result<OwnedFd> {
    Ok(openat(folder, name, FLAGS | OFlags::DIRECTORY | OFlags::NOFOLLOW, Mode::empty())?)
}

/// Opens the regular file `name` in an open folder; it is no link.
///
/// # Errors
/// [`OpenError`].
pub fn open_in(folder: impl AsFd, name: impl AsRef<Path>) -> Result<File, OpenError> {
    open_at(folder, name.as_ref(), true)
}

/// As [`open_in`], where a link is followed.
///
/// # Errors
/// [`OpenError`].
pub fn follow_in(folder: impl AsFd, name: impl AsRef<Path>) -> Result<File, OpenError> {
    open_at(folder, name.as_ref(), false)
}

/// Opens a regular file by its name in a folder; `itself`: the name must be no link.
fn open_at(folder: impl AsFd, name: &Path, itself: bool) -> Result<File, OpenError> {
    let mut look = AtFlags::empty();
    let mut flags = FLAGS;
    if itself {
        look |= AtFlags::SYMLINK_NOFOLLOW;
        flags |= OFlags::NOFOLLOW;
    }
    // Devices may act when they are opened: so this comes first.
    let seen = statat(&folder, name, look).map_err(io::Error::from)?;
    if FileType::from_raw_mode(seen.st_mode) != FileType::RegularFile {
        return Err(OpenError::NotRegular);
    }
    let file = File::from(patiently(|| openat(&folder, name, flags, Mode::empty()))?);
    // Something else may have taken its name in between: what was opened counts.
    if file.metadata()?.is_file() { Ok(file) } else { Err(OpenError::NotRegular) }
}

/// How often a file that is lent to others is asked for. By experience: five seconds are enough for a client that is there to
/// give it back; more would hold up a stage for one that is gone.
const CALLS: u32 = 50;

/// The pause between two of these.
const BETWEEN_CALLS: Duration = Duration::from_millis(100);

/// File servers lend files to others, and call them back when somebody else opens them.
fn patiently(open: impl Fn() -> rustix::io::Result<OwnedFd>) -> io::Result<OwnedFd> {
    for _ in 0..CALLS {
        match open() {
            Err(rustix::io::Errno::WOULDBLOCK) => std::thread::sleep(BETWEEN_CALLS),
            opened => return Ok(opened?),
        }
    }
    Ok(open()?)
}

/// The bytes of a file, `most` of them at most; whatever is added meanwhile.
///
/// ```
/// use planish::system::safe_open::{OpenError, open, read};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("part.stl");
/// std::fs::write(&path, "solid")?;
/// assert_eq!(read(&open(&path)?, 5)?, b"solid");
/// assert!(matches!(read(&open(&path)?, 4), Err(OpenError::TooLarge { size: 5, most: 4 })));
/// assert!(matches!(open(folder.path()), Err(OpenError::NotRegular)));
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`OpenError`]. What is too large at first sight is not read.
pub fn read(file: &impl disk::File, most: u64) -> Result<Vec<u8>, OpenError> {
    let mut bytes = Vec::new();
    read_into(file, most, &mut bytes)?;
    Ok(bytes)
}

/// What a JSON file of at most `most` bytes says; none where it is not opened, or says something else.
pub fn read_json<T: DeserializeOwned>(file: Result<impl disk::File, OpenError>, most: u64) -> Option<T> {
    let text = read(&file.ok()?, most).ok()?;
    serde_json::from_slice(&text).ok()
}

/// The hash of a file of at most `most` bytes, and how many these are; as [`read`], but nothing is kept.
///
/// # Errors
/// As [`read`].
pub fn hash(file: &impl disk::File, most: u64) -> Result<(Hash, u64), OpenError> {
    refuse_large(file.stat()?.bytes, most)?;
    let mut hasher = Hasher::new();
    hasher.update_reader(file.content()?.take(most.saturating_add(1)))?;
    refuse_large(hasher.count(), most)?;
    Ok((hasher.finalize(), hasher.count()))
}

/// As [`read`], in the place of what `bytes` hold: memory that is there is used again.
///
/// # Errors
/// As [`read`].
pub fn read_into(file: &impl disk::File, most: u64, bytes: &mut Vec<u8>) -> Result<(), OpenError> {
    bytes.clear();
    let size = file.stat()?.bytes;
    refuse_large(size, most)?;
    bytes.try_reserve_exact(usize::try_from(size).unwrap_or(usize::MAX)).map_err(io::Error::other)?;
    // One byte more than may be shows that it has grown too large since.
    file.content()?.take(most.saturating_add(1)).read_to_end(bytes)?;
    refuse_large(bytes.len() as u64, most)
}

fn refuse_large(size: u64, most: u64) -> Result<(), OpenError> {
    if size > most { Err(OpenError::TooLarge { size, most }) } else { Ok(()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    /// A folder `in` with files, links, a pipe and a device that is there on every machine.
    fn place() -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        std::fs::create_dir_all(at("in/sub")).expect("made");
        for name in ["secret", "in/a", "in/sub/b"] {
            std::fs::write(at(name), name).expect("written");
        }
        let links = [
            ("sub/b", "in/inner"),
            ("../secret", "in/outer"),
            ("/dev/zero", "in/zero"),
            ("nowhere", "in/none"),
            ("loop", "in/loop"),
            ("..", "in/up"),
        ];
        links.iter().for_each(|(target, name)| symlink(target, at(name)).expect("linked"));
        rustix::fs::mknodat(CWD, at("in/pipe"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
        folder
    }

    fn text(file: Result<File, OpenError>) -> Option<String> {
        String::from_utf8(read(&file.ok()?, 100).expect("read")).ok()
    }

    #[test]
    fn regular_files_are_opened_and_nothing_else() {
        let place = place();
        let folder = place.path().join("in");
        let texts = |open: &dyn Fn(&str) -> Result<File, OpenError>| {
            let names = ["a", "sub/b", "inner", "outer", "up/secret", "zero", "none", "loop", "pipe", "sub", "up"];
            names.map(|name| text(open(name))).map(|text| text.is_some())
        };
        let [yes, no] = [true, false];
        let followed = texts(&|name| open(&folder.join(name)));
        assert_eq!(followed, [yes, yes, yes, yes, yes, no, no, no, no, no, no]);
        let itself = texts(&|name| open_itself(&folder.join(name)));
        assert_eq!(itself, [yes, yes, no, no, yes, no, no, no, no, no, no]);
        let inside = texts(&|name| open_inside(&folder, &folder.join(name)));
        assert_eq!(inside, [yes, yes, yes, no, no, no, no, no, no, no, no]);
        let below = texts(&|name| open_below(&folder, name.as_ref()));
        assert_eq!(below, [yes, yes, no, no, no, no, no, no, no, no, no]);
        assert!(matches!(open_inside(&folder, &folder.join("outer")), Err(OpenError::LeadsOut(_))));
        for name in ["../secret", "", "sub/../../secret"] {
            assert!(open_below(&folder, name.as_ref()).is_err(), "{name}");
        }
    }

    #[test]
    fn what_is_too_large_is_not_read_and_what_grows_not_to_its_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("sparse");
        let sparse = File::create(&path).expect("made");
        sparse.set_len(1 << 40).expect("long");
        let too_large = read(&open(&path).expect("opened"), 1 << 30);
        assert!(matches!(too_large, Err(OpenError::TooLarge { size, .. }) if size == 1 << 40));
        // What the system makes up as it is read has no size before.
        #[cfg(target_os = "linux")]
        {
            let made_up = read(&open("/proc/self/maps".as_ref()).expect("opened"), 100);
            assert!(matches!(made_up, Err(OpenError::TooLarge { size: 101, most: 100 })), "{made_up:?}");
        }
    }
}
