//! The disks of the system.

use super::{Disk, File, Folder, Kind, Rename, Stat, Time};
use crate::system::fingerprint::Identity;
use crate::system::lease;
use crate::system::safe_open::{self, FLAGS, OpenError};
use rustix::fd::OwnedFd;
use rustix::fs::{self, AtFlags, CWD, Dir, FileType, Mode, OFlags, Timespec, Timestamps, UTIME_OMIT};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::fs::TryLockError;
use std::io::{self, Read, Seek, Write};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::Path;

/// The disks of the system.
#[derive(Clone, Copy, Debug, Default)]
pub struct System;

impl Disk for System {
    type Folder = OwnedFd;

    fn open(&self, path: &Path) -> io::Result<OwnedFd> {
        Ok(fs::openat(CWD, path, FLAGS | OFlags::DIRECTORY, Mode::empty())?)
    }
}

impl Folder for OwnedFd {
    type File = std::fs::File;

    fn stat(&self) -> io::Result<Stat> {
        Ok(Stat::from(fs::fstat(self)?))
    }

    fn stat_of(&self, name: impl AsRef<OsStr>) -> io::Result<Stat> {
        Ok(Stat::from(fs::statat(self, name.as_ref(), AtFlags::SYMLINK_NOFOLLOW)?))
    }

    fn list(&self) -> io::Result<Vec<OsString>> {
        let mut names = Vec::new();
        for entry in Dir::read_from(self)? {
            let entry = entry?;
            let name = OsStr::from_bytes(entry.file_name().to_bytes());
            if name != "." && name != ".." {
                names.push(name.to_owned());
            }
        }
        Ok(names)
    }

    fn open_folder(&self, name: impl AsRef<OsStr>) -> io::Result<Self> {
        safe_open::folder_in(self, name.as_ref())
    }

    fn open_file(&self, name: impl AsRef<OsStr>) -> Result<std::fs::File, OpenError> {
        safe_open::open_in(self, name.as_ref())
    }

    fn follow_file(&self, name: impl AsRef<OsStr>) -> Result<std::fs::File, OpenError> {
        safe_open::follow_in(self, name.as_ref())
    }

    fn open_private(&self, name: impl AsRef<OsStr>, make: bool) -> io::Result<std::fs::File> {
        // To read and to write: so a pipe opens at once.
        let flags = FLAGS | OFlags::NOFOLLOW | OFlags::RDWR;
        let flags = if make { flags | OFlags::CREATE } else { flags };
        Ok(fs::openat(self, name.as_ref(), flags, Mode::RUSR | Mode::WUSR)?.into())
    }

    fn read_link(&self, name: impl AsRef<OsStr>) -> io::Result<OsString> {
        Ok(OsString::from_vec(fs::readlinkat(self, name.as_ref(), Vec::new())?.into_bytes()))
    }

    fn make_folder(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<()> {
        Ok(fs::mkdirat(self, name.as_ref(), Mode::from_raw_mode(mode as _))?)
    }

    fn make_file(&self, name: impl AsRef<OsStr>, mode: u32) -> io::Result<std::fs::File> {
        let flags = FLAGS | OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL;
        Ok(fs::openat(self, name.as_ref(), flags, Mode::from_raw_mode(mode as _))?.into())
    }

    fn make_link(&self, target: &OsStr, name: impl AsRef<OsStr>) -> io::Result<()> {
        Ok(fs::symlinkat(target, self, name.as_ref())?)
    }

    fn link(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>) -> io::Result<()> {
        Ok(fs::linkat(self, name.as_ref(), to, to_name.as_ref(), AtFlags::empty())?)
    }

    fn rename(&self, name: impl AsRef<OsStr>, to: &Self, to_name: impl AsRef<OsStr>, how: Rename) -> io::Result<()> {
        let done = match how {
            Rename::Over => fs::renameat(self, name.as_ref(), to, to_name.as_ref()),
            Rename::ToFree | Rename::Exchange => rename_with(self, name.as_ref(), to, to_name.as_ref(), how),
        };
        Ok(done?)
    }

    fn unlink(&self, name: impl AsRef<OsStr>) -> io::Result<()> {
        Ok(fs::unlinkat(self, name.as_ref(), AtFlags::empty())?)
    }

    fn remove_folder(&self, name: impl AsRef<OsStr>) -> io::Result<()> {
        Ok(fs::unlinkat(self, name.as_ref(), AtFlags::REMOVEDIR)?)
    }

    fn set_mode(&self, mode: u32) -> io::Result<()> {
        Ok(fs::fchmod(self, Mode::from_raw_mode(mode as _))?)
    }

    fn sync(&self) -> io::Result<()> {
        Ok(fs::fsync(self)?)
    }
}

#[cfg(target_os = "linux")]
fn rename_with(from: &OwnedFd, name: &OsStr, to: &OwnedFd, to_name: &OsStr, how: Rename) -> Result<(), Errno> {
    use rustix::fs::RenameFlags;
    let flag = if how == Rename::Exchange { RenameFlags::EXCHANGE } else { RenameFlags::NOREPLACE };
    fs::renameat_with(from, name, to, to_name, flag)
}

#[cfg(not(target_os = "linux"))]
fn rename_with(_: &OwnedFd, _: &OsStr, _: &OwnedFd, _: &OsStr, _: Rename) -> Result<(), Errno> {
    Err(Errno::NOSYS)
}

impl File for std::fs::File {
    fn stat(&self) -> io::Result<Stat> {
        Ok(Stat::from(fs::fstat(self)?))
    }

    fn content(&self) -> io::Result<impl Read + '_> {
        let mut file = self;
        file.rewind()?;
        Ok(file)
    }

    fn append(&self, bytes: &[u8]) -> io::Result<()> {
        let mut file = self;
        file.write_all(bytes)
    }

    fn set_mode(&self, mode: u32) -> io::Result<()> {
        Ok(fs::fchmod(self, Mode::from_raw_mode(mode as _))?)
    }

    fn set_time(&self, (tv_sec, tv_nsec): Time) -> io::Result<()> {
        let last_access = Timespec { tv_sec: 0, tv_nsec: UTIME_OMIT };
        let last_modification = Timespec { tv_sec, tv_nsec: tv_nsec as _ };
        Ok(fs::futimens(self, &Timestamps { last_access, last_modification })?)
    }

    fn sync(&self) -> io::Result<()> {
        self.sync_all()
    }

    fn lock_now(&self) -> io::Result<bool> {
        match self.try_lock() {
            Ok(()) => Ok(true),
            Err(TryLockError::WouldBlock) => Ok(false),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    fn has_writer(&self) -> io::Result<Option<bool>> {
        lease::has_writer(self)
    }
}

impl From<fs::Stat> for Stat {
    fn from(stat: fs::Stat) -> Self {
        let kind = match FileType::from_raw_mode(stat.st_mode) {
            FileType::RegularFile => Kind::File,
            FileType::Directory => Kind::Folder,
            FileType::Symlink => Kind::Link,
            _ => Kind::Other,
        };
        Self {
            kind,
            bytes: stat.st_size as _,
            identity: Identity::new(stat.st_dev as _, stat.st_ino as _),
            modified: (stat.st_mtime as _, stat.st_mtime_nsec as _),
            changed: (stat.st_ctime as _, stat.st_ctime_nsec as _),
            owner: stat.st_uid,
            mode: (stat.st_mode & 0o7777) as _,
        }
    }
}
