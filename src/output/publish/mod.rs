//! Publishing: files are complete in the output folder, or not there.
//!
//! The files of an input are written to a staging folder (`OUT/.planish/...`), brought to disk, and renamed into
//! place in one step; an older result stays until then, and what is not planish's in it moves on ([`crate::output::replace`]).
//! Each process has a staging folder of its own, held by a lock; folders whose process is gone are cleared at the next
//! start ([`crate::output::staging`]), and one that somebody removes is made anew. What is published is the ledger of what was
//! done: see [`crate::output::ledger`].
//!
//! A result that is published is on disk: neither a kill nor a loss of power leaves half of one, or loses what is not
//! planish's. Deliberately absent: any promise about disks that tell that they have written what they have not.

use crate::output::begun;
use crate::output::listed::{self, Listed};
use crate::output::own;
use crate::output::replace;
use crate::output::staging::{self, Bury, Desk, GATE, Run, Settled};
use crate::system::disk::{self, Disk, Folder, System};
use crate::system::escape::escape;
use crate::system::orphans;
use crate::system::passing;
use parking_lot::Mutex;
use rustix::io::Errno;
use std::ffi::OsStr;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// The hidden folder for what is not complete yet.
pub const STAGING: &str = ".planish";

/// The name and the content of a file.
pub type Content = (String, Vec<u8>);

/// Publishes results in one output folder.
#[derive(Debug)]
pub struct Publisher<D: Disk = System> {
    disk: D,
    out: PathBuf,
    bury: Bury,
    run: Mutex<Arc<Run<D::Folder>>>,
    /// Whether results may still be put in place; held while one is.
    open: Mutex<bool>,
}

/// A result on its way into place. It goes with this.
#[derive(Debug)]
pub struct Staged<D: Disk = System> {
    run: Arc<Run<D::Folder>>,
    desk: Desk<D::Folder>,
    /// Whether it was tried to put it in place before.
    is_tried: AtomicBool,
}

impl<D: Disk> Staged<D> {
    /// Where its files go.
    pub fn folder(&self) -> PathBuf {
        self.desk.path_of_half(&self.run)
    }

    /// Whether it is still there: somebody may have removed it.
    pub fn is_there(&self) -> bool {
        self.desk.half().is_ok()
    }
}

impl<D: Disk> Drop for Staged<D> {
    fn drop(&mut self) {
        self.desk.remove(&self.run);
    }
}

/// Sees to it that what a dead process was about is known, and that nothing of it lives on.
fn bury(staging: &Path) {
    orphans::end_those_of(staging);
    begun::take_over(staging);
}

/// Writes the files of a result to a folder, for another process that puts it in place. What an attempt before has left there
/// goes.
///
/// # Errors
/// [`PublishError`].
pub fn write_to(folder: &Path, files: &[Content]) -> Result<(), PublishError> {
    let half = System.open(folder).map_err(at(folder))?;
    for name in half.list().map_err(at(folder))? {
        disk::remove_all(&half, &name).map_err(at(folder))?;
    }
    listed::write_all(&half, files).map_err(at(folder))
}

/// Why nothing could be published.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// The system refuses.
    #[error("cannot write {}: {error}; {}", escape(.path), remedy(.error))]
    Io {
        /// Where.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// The report does not become JSON.
    #[error("the report cannot be written as JSON: {0}; that is a fault of planish")]
    Report(serde_json::Error),
    /// Something stands where the result belongs.
    #[error(
        "{} is there already and is no result of planish: it was left alone; move it away or use another output folder",
        escape(.0)
    )]
    Foreign(PathBuf),
    /// Something in an older result is not planish's, and cannot be kept.
    #[error(
        "{} lies in an older result, is not of planish, and cannot be kept in the newer one: the older result was left \
         alone; move that away", escape(.0)
    )]
    Stands(PathBuf),
    /// Another process holds a lock.
    #[error(
        "{} has been locked by another process for {} s: find it with `fuser -v` and end it, or use another output \
         folder", escape(.0), own::PATIENCE.as_secs()
    )]
    Busy(PathBuf),
    /// A folder on the way is itself a result.
    #[error("{} is the result of an input: another result cannot lie in it; rename the folder in the inbox", escape(.0))]
    Nested(PathBuf),
    /// The place of the result is another file system's.
    #[error(
        "{} is on another file system (a mount point?) than {STAGING} in the output folder: results are put in place by \
         renaming; unmount it, or use another output folder", escape(.0)
    )]
    Elsewhere(PathBuf),
    /// The process of the input told this.
    #[error("{message}")]
    Told {
        /// What is wrong and what to do.
        message: String,
        /// Whether it stays as long as nobody changes something.
        lasts: bool,
    },
    /// The program is ending.
    #[error("nothing is published any more, as planish ends; start it again")]
    Closed,
}

impl PublishError {
    /// Whether it stays as long as nobody changes something.
    pub fn is_lasting(&self) -> bool {
        match self {
            Self::Foreign(_) | Self::Nested(_) | Self::Stands(_) | Self::Elsewhere(_) => true,
            Self::Io { error, .. } => passing::lasts(error),
            Self::Told { lasts, .. } => *lasts,
            Self::Report(_) | Self::Busy(_) | Self::Closed => false,
        }
    }
}

/// What to do about an error of the system.
fn remedy(error: &io::Error) -> &'static str {
    match Errno::from_io_error(error) {
        Some(Errno::NOTDIR) => "something on the way there is no folder: move it away, or use another output folder",
        Some(Errno::NAMETOOLONG) => "the name is too long for that file system: give the input a shorter one",
        Some(Errno::LOOP) => "links on the way there lead in circles, or where none is followed: remove them",
        Some(Errno::ROFS) => "the file system may only be read: mount it for writing, or use another output folder",
        Some(Errno::FBIG) => "a file is too large for that file system or for the limits of this process",
        _ => "check that the disk has room and the folder may be written",
    }
}

/// Attaches the path to an I/O error.
pub(crate) fn at(path: &Path) -> impl FnOnce(io::Error) -> PublishError {
    let path = path.to_owned();
    move |error| PublishError::Io { path, error }
}

impl Publisher {
    /// Opens (and makes) the output folder, and clears what dead processes left behind.
    ///
    /// # Errors
    /// [`PublishError`] where the folder cannot be written.
    pub fn open(out: &Path) -> Result<Self, PublishError> {
        Self::open_with(System, out, bury)
    }
}

impl<D: Disk> Publisher<D> {
    /// As [`Publisher::open`], on this disk, where no process has done anything else than publish.
    ///
    /// # Errors
    /// As [`Publisher::open`].
    pub fn open_on(disk: D, out: &Path) -> Result<Self, PublishError> {
        Self::open_with(disk, out, |_| {})
    }

    fn open_with(disk: D, out: &Path, bury: Bury) -> Result<Self, PublishError> {
        let run = Mutex::new(Arc::new(Run::make(&disk, out, bury, || true)?));
        // A program that was killed may have made it, and not brought its name to disk.
        disk::sync_name(&disk, out).map_err(at(out))?;
        Ok(Self { disk, out: out.to_owned(), bury, run, open: Mutex::new(true) })
    }

    /// The output folder.
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// Where the result of the input with this name is published.
    pub fn target(&self, name: &Path) -> PathBuf {
        self.out.join(name)
    }

    /// A folder for files on their way into a result. It goes when the process ends; where somebody has removed it, it is
    /// made anew.
    ///
    /// # Errors
    /// [`PublishError`] where it is gone and cannot be made.
    pub fn staging(&self) -> Result<PathBuf, PublishError> {
        Ok(self.run()?.path.clone())
    }

    fn run(&self) -> Result<Arc<Run<D::Folder>>, PublishError> {
        let mut run = self.run.lock();
        if !run.is_there(&self.disk).map_err(at(&run.path))? {
            let is_open = || *self.open.lock();
            if !is_open() {
                return Err(PublishError::Closed);
            }
            tracing::warn!(folder = escape(&run.path), "the staging folder was removed: another one is made");
            *run = Arc::new(Run::make(&self.disk, &self.out, self.bury, is_open)?);
        }
        Ok(run.clone())
    }

    /// Publishes `files` as the result of the input `name`, all at once, if it is still `wanted` when they are ready to
    /// be put in place. Whether they were.
    ///
    /// # Errors
    /// [`PublishError`]; then an older result is untouched.
    pub fn publish(&self, name: &Path, files: &[Content], wanted: impl Fn() -> bool) -> Result<bool, PublishError> {
        self.admits(name)?;
        let staged = self.room()?;
        let half = staged.desk.half().map_err(at(&staged.run.path))?;
        listed::write_all(&half, files).map_err(at(&self.target(name)))?;
        self.put(name, &staged, wanted)
    }

    /// Room for the files of a result, where they are not seen yet.
    ///
    /// # Errors
    /// [`PublishError`] where it cannot be made.
    pub fn room(&self) -> Result<Staged<D>, PublishError> {
        let run = self.run()?;
        let desk = Desk::make(&run).map_err(at(&run.path))?;
        let staged = Staged { run, desk, is_tried: AtomicBool::new(false) };
        staged.desk.make_half().map_err(at(&staged.run.path))?;
        Ok(staged)
    }

    /// Puts files that are complete and on disk in the place of the result `name`, all at once, if it is still `wanted`
    /// then. Whether they were. What was not put in place for a reason that passes may be tried again.
    ///
    /// # Errors
    /// [`PublishError`]; then an older result is untouched.
    pub fn put(&self, name: &Path, staged: &Staged<D>, wanted: impl Fn() -> bool) -> Result<bool, PublishError> {
        let Staged { run, desk, is_tried } = staged;
        let target = self.target(name);
        let half = desk.half().map_err(at(&target))?;
        // One at a time, of all processes, so that what is no longer wanted never takes the place of what came after it.
        // Nobody who closes is kept waiting by a lock.
        let is_wanted = || *self.open.lock() && wanted();
        let Some(_alone) = staging::pass_gate(&self.disk, &self.out, is_wanted)? else {
            if is_wanted() {
                return Err(PublishError::Busy(self.out.join(STAGING).join(GATE)));
            }
            return Ok(false);
        };
        // Held to the end: who closes waits for what is being put in place.
        let open = self.open.lock();
        if !*open || !wanted() {
            return Ok(false);
        }
        // Writing took its time: somebody may have put something there.
        let own = self.admits(name)?;
        let above = target.parent().unwrap_or(&self.out);
        let folder = disk::make_all(&self.disk, above).map_err(at(above))?;
        let last = name.file_name().unwrap_or_default();
        match folder.open_folder(last) {
            Ok(older) => {
                let again = is_tried.swap(true, Ordering::Relaxed);
                desk.keep_foreign(&older, &target, &own, &half, again)?;
                // It comes to lie on the desk, which must be found there.
                run.folder.sync().map_err(at(&run.path))?;
            }
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(at(&target)(error)),
        }
        // From here on a loss of power finds the promise, and settles it at the next start. So it is settled here, too,
        // whether the result got its place or not.
        let promise = desk.complete(&half, name).map_err(at(&target))?;
        let put = desk.put_in_place(&folder, last);
        let settled = desk.settle(&self.disk, &self.out, &promise, Some(&own));
        if put.is_err() && settled.is_ok() {
            // Where that fails, it is not there any more, and is made again.
            let _ = desk.take_back(&promise);
        }
        put.map_err(|error| not_put(error, &folder, &target))?;
        match settled? {
            Settled::Newer => Ok(true),
            Settled::Older(error) => Err(error),
        }
    }

    /// Whether a result may be put in the place of `name`; and the names of what planish itself has written there.
    ///
    /// # Errors
    /// [`PublishError`]: what stands there.
    pub fn admits(&self, name: &Path) -> Result<Listed, PublishError> {
        let target = self.target(name);
        if !is_plain(name) {
            return Err(PublishError::Foreign(target));
        }
        let mut folder = self.disk.open(&self.out).map_err(at(&self.out))?;
        for part in folders_above(name) {
            let path = self.out.join(part);
            folder = match self.disk.open(&path) {
                Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Listed::default()),
                Err(error) if disk::is_no_folder(&error) => return Err(PublishError::Foreign(path)),
                opened => opened.map_err(at(&path))?,
            };
            if replace::own_files(&folder).map_err(at(&path))?.is_some() {
                return Err(PublishError::Nested(path));
            }
        }
        let own = replaceable(&folder, name.file_name().unwrap_or_default()).map_err(at(&target))?;
        own.ok_or(PublishError::Foreign(target))
    }

    /// Sees to it that a result that stands is on disk, though whoever published it may have been killed at once.
    ///
    /// # Errors
    /// [`PublishError`] where the system refuses.
    pub fn secure(&self, name: &Path) -> Result<(), PublishError> {
        let above = name.parent().unwrap_or(Path::new(""));
        disk::sync_down(&self.disk, &self.out, above).map_err(|(path, error)| at(&path)(error))
    }

    /// Nothing is put in place any more, and the staging folder goes. Whoever still writes to it hears of an error.
    pub fn close(&self) {
        *self.open.lock() = false;
        if let Err(error) = self.run.lock().remove(&self.disk, &self.out) {
            tracing::debug!(%error, "the staging folder is left to the next start");
        }
    }
}

impl<D: Disk> Drop for Publisher<D> {
    fn drop(&mut self) {
        self.close();
    }
}

/// Whether a path leads down only.
fn is_plain(name: &Path) -> bool {
    name.components().all(|part| matches!(part, Component::Normal(_))) && name.file_name().is_some()
}

/// The folders on the way from the output folder down to a result: of `a/b/x.stl`, `a` and `a/b`.
fn folders_above(name: &Path) -> Vec<&Path> {
    // From the name up: itself, the folders, and the empty path.
    let mut above: Vec<&Path> = name.ancestors().skip(1).filter(|part| !part.as_os_str().is_empty()).collect();
    above.reverse();
    above
}

/// The names of what planish has written there: none of them where nothing is there, or an empty folder. None where it is
/// neither that nor an older result (a folder with a report of planish).
fn replaceable<F: Folder>(folder: &F, name: &OsStr) -> io::Result<Option<Listed>> {
    let found = match folder.stat_of(name) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(Some(Listed::default())),
        found => found?,
    };
    if !found.is_folder() {
        return Ok(None);
    }
    let result = folder.open_folder(name)?;
    if let Some(own) = replace::own_files(&result)? {
        return Ok(Some(own));
    }
    Ok(result.list()?.is_empty().then(Listed::default))
}

/// Why a result was not put in place.
fn not_put<F: Folder>(error: io::Error, folder: &F, target: &Path) -> PublishError {
    // The root of another file system has another device than the folder it is in.
    let device = |stat: io::Result<disk::Stat>| stat.ok().map(|stat| stat.identity.device());
    let is_mount_point = || device(folder.stat()) != device(folder.stat_of(target.file_name().unwrap_or_default()));
    match Errno::from_io_error(&error) {
        Some(Errno::XDEV) => PublishError::Elsewhere(target.to_owned()),
        Some(Errno::BUSY) if is_mount_point() => PublishError::Elsewhere(target.to_owned()),
        _ => at(target)(error),
    }
}

#[cfg(test)]
mod tests;
