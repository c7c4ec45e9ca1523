//! Staging: where results are made before they are put in place, and what a killed program left there.
//!
//! Each process has a folder `OUT/.planish/run-*` of its own, held by a lock. In it, each publication has a [`Desk`]:
//!
//! * `half`: the result, as long as it is written;
//! * `whole`: the result when it is complete and on disk; after it has changed places with an older one, that;
//! * `older`: the older one, where the file system cannot exchange two folders;
//! * `place`: a link that is never followed and tells which result it is, as long as anything on the desk may be wanted.
//!
//! What lies at `older`, or at `whole` and is not the result that was made there, may hold what is not planish's: it is
//! **settled** before a desk is cleared ([`Desk::settle`]), by the one who published, or at the next start.

use crate::output::listed::Listed;
use crate::output::own;
use crate::output::publish::{PublishError, STAGING, at};
use crate::output::replace::{self, NotKept};
use crate::result_files;
use crate::system::disk::{self, Disk, File as _, Folder, OPEN_FOLDER, Rename};
use crate::system::escape::escape;
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind};
use std::os::unix::ffi::{OsStrExt, OsStringExt};
use std::path::{Component, Path, PathBuf};

/// The file whose lock tells that a staging folder is in use.
pub(crate) const LOCK: &str = "lock";

/// How the names of staging folders begin.
pub(crate) const RUN: &str = "run-";

/// The file whose lock a process holds while it makes its staging folder, or puts a result in place.
pub(crate) const GATE: &str = "opening";

/// The result, as long as it is written.
const HALF: &str = "half";

/// The complete result; after an exchange, the older one.
const WHOLE: &str = "whole";

/// The older result, where two folders cannot be exchanged.
const OLDER: &str = "older";

/// The newer result, where the older one came back in two steps: nobody wants it.
const WITHDRAWN: &str = "withdrawn";

/// The link that tells which result is made here.
const PLACE: &str = "place";

/// How often the lock of an output folder is looked for that was removed while somebody waited for it. Each time
/// somebody must have removed it just then; after so many, they do it all the time, and it is told.
const GATES: usize = 8;

/// How often a result is put in its place while others put something there, or take it away, at the same time.
const EXCHANGES: usize = 16;

/// Nobody else has anything to do in a staging folder.
const PRIVATE_FOLDER: u32 = 0o700;

/// What is done about a process that died, before its staging folder is cleared.
pub type Bury = fn(&Path);

/// The staging folder of this process.
#[derive(Debug)]
pub struct Run<F: Folder> {
    /// Its path.
    pub path: PathBuf,
    /// The folder.
    pub folder: F,
    name: OsString,
    _lock: F::File,
}

/// Opens the folder for what is not complete yet; makes it where it is missing.
fn root<D: Disk>(disk: &D, out: &Path) -> Result<D::Folder, PublishError> {
    let path = out.join(STAGING);
    own::folder(disk, &path).map_err(at(&path))
}

impl<F: Folder> Run<F> {
    /// Makes one, in an output folder that is made where it is missing, and clears what dead processes left behind. Others
    /// are waited for as long as it is `wanted`.
    ///
    /// # Errors
    /// [`PublishError`] where the folder cannot be written.
    pub fn make<D: Disk<Folder = F>>(
        disk: &D,
        out: &Path,
        bury: Bury,
        wanted: impl Fn() -> bool,
    ) -> Result<Self, PublishError> {
        let path = out.join(STAGING);
        root(disk, out)?;
        // One process at a time, so that a folder is never seen between being made and being locked.
        let _opening = pass_gate(disk, out, wanted)?.ok_or_else(|| PublishError::Busy(path.join(GATE)))?;
        let root = root(disk, out)?;
        clear_stale(disk, out, &root, bury);
        let (name, folder) = disk::make_unique_folder(&root, RUN, PRIVATE_FOLDER).map_err(at(&path))?;
        let path = path.join(&name);
        // It is new, and nobody else's.
        let lock = own::open_lock(&folder, LOCK.as_ref()).map_err(at(&path))?;
        lock.lock_now().map_err(at(&path))?;
        folder.sync().and_then(|()| root.sync()).map_err(at(&path))?;
        Ok(Self { path, folder, name, _lock: lock })
    }

    /// Whether it still is where it was made.
    ///
    /// # Errors
    /// Those of the system.
    pub fn is_there<D: Disk<Folder = F>>(&self, disk: &D) -> io::Result<bool> {
        let Some(root) = self.path.parent() else { return Ok(false) };
        let found = disk.open(root).and_then(|root| root.stat_of(&self.name));
        match found {
            Ok(found) => Ok(found.identity == self.folder.stat()?.identity),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    /// Removes it, but for what is not settled, and cannot be now: that is left to the next start.
    ///
    /// # Errors
    /// [`PublishError`].
    pub fn remove<D: Disk<Folder = F>>(&self, disk: &D, out: &Path) -> Result<(), PublishError> {
        if !promised(&self.folder).map_err(at(&self.path))?.is_empty() {
            // Nobody who closes is kept waiting by a lock.
            let gate = pass_gate(disk, out, || false)?;
            let _alone = gate.ok_or_else(|| PublishError::Busy(out.join(STAGING).join(GATE)))?;
            settle_all(disk, out, &self.folder)?;
        }
        let root = disk.open(&out.join(STAGING)).map_err(at(&self.path))?;
        clear(&root, &self.name, &self.folder).map_err(at(&self.path))
    }
}

/// Opens and locks the gate of an output folder, as long as that is `wanted`; none where another process holds it for
/// too long.
///
/// # Errors
/// [`PublishError`].
pub fn pass_gate<D: Disk>(
    disk: &D,
    out: &Path,
    wanted: impl Fn() -> bool,
) -> Result<Option<<D::Folder as Folder>::File>, PublishError> {
    let path = out.join(STAGING).join(GATE);
    for _ in 0..GATES {
        let gate = own::open_lock(&root(disk, out)?, GATE.as_ref()).map_err(at(&path))?;
        if !own::lock(&gate, &path, own::PATIENCE, &wanted).map_err(at(&path))? {
            return Ok(None);
        }
        // Somebody may have removed it meanwhile: whoever comes next makes another one, and waits for nobody.
        let held = gate.stat().map_err(at(&path))?.identity;
        match root(disk, out)?.stat_of(GATE) {
            Ok(found) if found.identity == held => return Ok(Some(gate)),
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(at(&path)(error)),
            Ok(_) | Err(_) => {}
        }
    }
    Err(PublishError::Busy(path))
}

/// Removes staging folders that are ours and whose lock nobody holds, and those that were made and never locked, which
/// are empty. All else that lies there stays.
fn clear_stale<D: Disk>(disk: &D, out: &Path, root: &D::Folder, bury: Bury) {
    let Ok(names) = root.list() else { return };
    for name in names {
        let is_run = name.as_bytes().starts_with(RUN.as_bytes()) && root.stat_of(&name).is_ok_and(|s| s.is_folder());
        if is_run && let Err(error) = clear_one(disk, out, root, &name, bury) {
            let folder = out.join(STAGING).join(&name);
            tracing::warn!(folder = escape(&folder), "an abandoned staging folder is left alone: {error}");
        }
    }
}

fn clear_one<D: Disk>(disk: &D, out: &Path, root: &D::Folder, name: &OsStr, bury: Bury) -> Result<(), PublishError> {
    let path = out.join(STAGING).join(name);
    let run = root.open_folder(name).map_err(at(&path))?;
    let lock = match own::open_lock_there(&run, LOCK.as_ref()) {
        Ok(lock) => lock,
        // Fails where something is in it.
        Err(_) => return root.remove_folder(name).map_err(at(&path)),
    };
    if !lock.lock_now().map_err(at(&path))? {
        return Ok(());
    }
    bury(&path);
    settle_all(disk, out, &run)?;
    clear(root, name, &run).map_err(at(&path))
}

/// Removes a staging folder in which everything is settled. The lock goes last: what is not removed is found to be ours
/// again.
fn clear<F: Folder>(root: &F, name: &OsStr, run: &F) -> io::Result<()> {
    for name in run.list()?.into_iter().filter(|inside| inside != LOCK) {
        if run.stat_of(&name)?.is_folder() {
            Desk { folder: run.open_folder(&name)?, name }.clear(run)?;
        } else {
            disk::remove_all(run, &name)?;
        }
    }
    disk::remove_all(root, name)
}

/// The desks on which something may be wanted, and what that is.
fn promised<F: Folder>(run: &F) -> io::Result<Vec<(Desk<F>, Promise)>> {
    let mut found = Vec::new();
    for name in run.list()? {
        if !run.stat_of(&name)?.is_folder() {
            continue;
        }
        let desk = Desk { folder: run.open_folder(&name)?, name };
        if let Some(promise) = desk.promise()? {
            found.push((desk, promise));
        }
    }
    Ok(found)
}

fn settle_all<D: Disk>(disk: &D, out: &Path, run: &D::Folder) -> Result<(), PublishError> {
    let path = out.join(STAGING);
    for (desk, promise) in promised(run).map_err(at(&path))? {
        if let Settled::Older(error) = desk.settle(disk, out, &promise, None)? {
            tracing::warn!("an older result is kept: {error}");
        }
    }
    Ok(())
}

/// Which result is made on a desk.
#[derive(Debug)]
pub struct Promise {
    /// The number of its folder.
    number: u64,
    /// Its name.
    name: PathBuf,
}

/// How a publication ended.
#[derive(Debug)]
pub enum Settled {
    /// The newer result is in place, or nothing was changed.
    Newer,
    /// The older one is in its place again, for this reason.
    Older(PublishError),
}

/// Where one result is made.
#[derive(Debug)]
pub struct Desk<F> {
    folder: F,
    name: OsString,
}

impl<F: Folder> Desk<F> {
    /// Makes one.
    ///
    /// # Errors
    /// Those of the system.
    pub fn make(run: &Run<F>) -> io::Result<Self> {
        let (name, folder) = disk::make_unique_folder(&run.folder, "", OPEN_FOLDER)?;
        Ok(Self { folder, name })
    }

    /// Makes the folder for a result that is not complete.
    ///
    /// # Errors
    /// Those of the system.
    pub fn make_half(&self) -> io::Result<F> {
        self.folder.make_folder(HALF, OPEN_FOLDER)?;
        self.half()
    }

    /// The folder for a result that is not complete.
    ///
    /// # Errors
    /// Those of the system; it is gone.
    pub fn half(&self) -> io::Result<F> {
        self.folder.open_folder(HALF)
    }

    /// The path of that folder, on the desk of this process.
    pub fn path_of_half(&self, run: &Run<F>) -> PathBuf {
        run.path.join(&self.name).join(HALF)
    }

    /// What lies in the folder `older`, and is not planish's own, gets a place in `fresh`, too, on disk.
    ///
    /// # Errors
    /// [`PublishError`].
    pub fn keep_foreign(
        &self,
        older: &F,
        target: &Path,
        own: &Listed,
        fresh: &F,
        again: bool,
    ) -> Result<(), PublishError> {
        let kept = replace::keep_foreign(older, target, own, (fresh, &self.folder), again).map_err(|e| match e {
            NotKept::Stands(path) => PublishError::Stands(path),
            NotKept::Io(path, error) => PublishError::Io { path, error },
        })?;
        if kept > 0 {
            tracing::info!(result = escape(target), kept, "files that planish did not write stay in the result");
            fresh.sync().map_err(at(target))?;
        }
        Ok(())
    }

    /// The result is complete: from now on, something on the desk may be wanted.
    ///
    /// # Errors
    /// Those of the system.
    pub fn complete(&self, half: &F, name: &Path) -> io::Result<Promise> {
        let promise = Promise { number: half.stat()?.identity.number(), name: name.to_owned() };
        let mut text = format!("{}/", promise.number).into_bytes();
        text.extend(name.as_os_str().as_bytes());
        let text = OsString::from_vec(text);
        match self.folder.make_link(&text, PLACE) {
            // Of an attempt that failed after that.
            Err(error) if error.kind() == ErrorKind::AlreadyExists && self.folder.read_link(PLACE)? == text => {}
            made => made?,
        }
        self.folder.rename(HALF, &self.folder, WHOLE, Rename::Over)?;
        Ok(promise)
    }

    /// A complete result that has not got its place is taken back, so that this may be tried again; nothing on the desk may
    /// be wanted now.
    ///
    /// # Errors
    /// Those of the system; then it cannot be tried again.
    pub fn take_back(&self, promise: &Promise) -> io::Result<()> {
        if self.holds_older(WHOLE, promise)? {
            return Err(ErrorKind::NotFound.into());
        }
        self.folder.rename(WHOLE, &self.folder, HALF, Rename::Over)
    }

    /// What may be wanted of what is on the desk.
    fn promise(&self) -> io::Result<Option<Promise>> {
        let text = match self.folder.read_link(PLACE) {
            // None is there, or it is no link: it is not planish's.
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::InvalidInput) => return Ok(None),
            text => PathBuf::from(text?),
        };
        // As `complete` writes it: the number of the folder, then the name of the result.
        let mut parts = text.components();
        let number = parts.next().and_then(|part| part.as_os_str().to_str()?.parse().ok());
        let name = parts.as_path().to_owned();
        let is_plain = parts.clone().all(|part| matches!(part, Component::Normal(_))) && name.file_name().is_some();
        Ok(number.filter(|_| is_plain).map(|number| Promise { number, name }))
    }

    /// Gives the complete result its place in `folder`, in one step. Where there is an older result the two change places.
    /// Another process may put one there, or take it away, at any moment: then the other way is tried, a few times.
    ///
    /// # Errors
    /// Those of the system; [`Self::settle`] tells what came of it.
    pub fn put_in_place(&self, folder: &F, name: &OsStr) -> io::Result<()> {
        for _ in 0..EXCHANGES {
            match self.folder.rename(WHOLE, folder, name, Rename::ToFree) {
                Err(error) if disk::is_unsupported(&error) => break,
                Err(error) if is_taken(&error) => {}
                ended => return ended,
            }
            match self.folder.rename(WHOLE, folder, name, Rename::Exchange) {
                Err(error) if disk::is_unsupported(&error) => break,
                Err(error) if error.kind() == ErrorKind::NotFound => {}
                ended => return ended,
            }
        }
        self.put_in_place_in_two_steps(folder, name)
    }

    /// Where the file system cannot exchange two folders, the older one is moved away first.
    fn put_in_place_in_two_steps(&self, folder: &F, name: &OsStr) -> io::Result<()> {
        match folder.rename(name, &self.folder, OLDER, Rename::Over) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            Ok(()) | Err(_) => {}
        }
        self.folder.rename(WHOLE, folder, name, Rename::Over)
    }

    /// Sees to it that nothing on the desk is wanted any more: what is not planish's in an older result goes to the newer
    /// one, or the older one goes back to its place; and all of that is on disk. `own` are the names of planish's files in
    /// the older one, where they are known.
    ///
    /// # Errors
    /// [`PublishError`]; then the desk must stay.
    pub fn settle<D: Disk<Folder = F>>(
        &self,
        disk: &D,
        out: &Path,
        promise: &Promise,
        own: Option<&Listed>,
    ) -> Result<Settled, PublishError> {
        let above = promise.name.parent().unwrap_or(Path::new(""));
        let mut settled = Settled::Newer;
        // Either may hold an older result: which, tells whether the file system could exchange the two.
        for aside in [OLDER, WHOLE] {
            if self.holds_older(aside, promise).map_err(at(&out.join(&promise.name)))? {
                let folder = disk::make_all(disk, &out.join(above)).map_err(at(&out.join(above)))?;
                settled = self.settle_older(aside, &folder, promise, &out.join(&promise.name), own)?;
            }
        }
        match disk::sync_down(disk, out, above) {
            // Somebody has removed the folder.
            Err((_, error)) if error.kind() == ErrorKind::NotFound => {}
            synced => synced.map_err(|(path, error)| at(&path)(error))?,
        }
        // Last: as long as the link is there, the next start settles all this again.
        let is_settled = self.folder.unlink(PLACE);
        is_settled.map_err(at(&out.join(&promise.name)))?;
        Ok(settled)
    }

    /// Whether something lies there that was in the place of the result.
    fn holds_older(&self, aside: &str, promise: &Promise) -> io::Result<bool> {
        match self.folder.stat_of(aside) {
            Ok(found) => Ok(found.identity.number() != promise.number),
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
            Err(error) => Err(error),
        }
    }

    fn settle_older(
        &self,
        aside: &str,
        folder: &F,
        promise: &Promise,
        target: &Path,
        own: Option<&Listed>,
    ) -> Result<Settled, PublishError> {
        let name = target.file_name().unwrap_or_default();
        let found = match folder.stat_of(name) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return self.bring_back(aside, folder, name).map(|()| Settled::Newer).map_err(at(target));
            }
            found => found.map_err(at(target))?,
        };
        let is_ours = found.identity.number() == promise.number;
        // Nothing is lost of what was put there in the last moment, either: where it cannot be kept, the older comes back.
        match self.keep_late(aside, folder, target, own) {
            Ok(()) => Ok(Settled::Newer),
            Err(error @ (PublishError::Foreign(_) | PublishError::Stands(_)))
                if is_ours && (own.is_some() || holds_only_own(folder, name).map_err(at(target))?) =>
            {
                self.put_back(aside, folder, name).map_err(at(target))?;
                Ok(Settled::Older(error))
            }
            // At the next start, somebody may have come to rely on what is there by now.
            Err(error) => Err(error),
        }
    }

    /// What was put into the older result since its foreign files were kept goes to the newer one, too.
    fn keep_late(&self, aside: &str, folder: &F, target: &Path, own: Option<&Listed>) -> Result<(), PublishError> {
        let foreign = || PublishError::Foreign(target.to_owned());
        let name = target.file_name().unwrap_or_default();
        let open = |folder: &F, name: &OsStr| match folder.open_folder(name) {
            Err(error) if disk::is_no_folder(&error) => Err(foreign()),
            opened => opened.map_err(at(target)),
        };
        let (older, newer) = (open(&self.folder, aside.as_ref())?, open(folder, name)?);
        replace::own_files(&newer).map_err(at(target))?.ok_or_else(foreign)?;
        let known = match own {
            Some(own) => own.clone(),
            None => replace::own_files(&older).map_err(at(target))?.unwrap_or_default(),
        };
        self.keep_foreign(&older, target, &known, &newer, true)
    }

    /// The older result comes back to its place; the newer one goes with the desk.
    fn put_back(&self, aside: &str, folder: &F, name: &OsStr) -> io::Result<()> {
        match self.folder.rename(aside, folder, name, Rename::Exchange) {
            Err(error) if disk::is_unsupported(&error) => {}
            ended => return ended,
        }
        folder.rename(name, &self.folder, WITHDRAWN, Rename::Over)?;
        self.bring_back(aside, folder, name)
    }

    /// What was in the place of the result goes back there, where nothing is by now.
    fn bring_back(&self, aside: &str, folder: &F, name: &OsStr) -> io::Result<()> {
        if !self.folder.stat_of(aside)?.is_folder() {
            return disk::rename_to_free(&self.folder, aside.as_ref(), folder, name);
        }
        match self.folder.rename(aside, folder, name, Rename::ToFree) {
            Err(error) if disk::is_unsupported(&error) => self.folder.rename(aside, folder, name, Rename::Over),
            ended => ended,
        }
    }

    /// Clears the desk, if nothing on it may be wanted.
    pub fn remove(&self, run: &Run<F>) {
        let removed = match self.promise() {
            Ok(None) => self.clear(&run.folder),
            Ok(Some(_)) => return,
            Err(error) => Err(error),
        };
        if let Err(error) = removed {
            tracing::debug!(%error, "what was staged is left to the end of the program");
        }
    }

    /// Removes the desk. A loss of power may bring it back, settled or not: so results lose their reports last, by which
    /// it is known what in them is planish's.
    fn clear(&self, run: &F) -> io::Result<()> {
        for name in self.folder.list()? {
            if self.folder.stat_of(&name)?.is_folder() {
                let result = self.folder.open_folder(&name)?;
                for name in result.list()?.iter().filter(|name| *name != result_files::REPORT) {
                    disk::remove_all(&result, name)?;
                }
            }
        }
        disk::remove_all(run, &self.name)
    }
}

/// Whether a result holds nothing but what planish wrote.
fn holds_only_own<F: Folder>(folder: &F, name: &OsStr) -> io::Result<bool> {
    let result = folder.open_folder(name)?;
    let own = replace::own_files(&result)?.unwrap_or_default();
    own.is_all_of(&result)
}

fn is_taken(error: &io::Error) -> bool {
    matches!(error.kind(), ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty)
}
