//! Publishing: files are complete in the output folder, or not there.
//!
//! The files of an input are written to a staging folder (`OUT/.planish/...`), brought to disk, and renamed into
//! place in one step; an older result stays until then, and what is not planish's in it moves on ([`crate::replace`]).
//! Each process has a staging folder of its own, held by a lock; folders whose process is gone are cleared at the next
//! start. What is published is the ledger of what was done: see [`crate::ledger`].

use crate::begun;
use crate::own;
use crate::replace::{self, NotKept};
use crate::shown::shown;
use parking_lot::Mutex;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

/// The hidden folder for what is not complete yet.
pub const STAGING: &str = ".planish";

/// The file whose lock tells that a staging folder is in use.
const LOCK: &str = "lock";

/// How the names of staging folders begin.
const RUN: &str = "run-";

/// The file whose lock a process holds while it makes its staging folder.
const GATE: &str = "opening";

/// Publishes results in one output folder.
#[derive(Debug)]
pub struct Publisher {
    out: PathBuf,
    staging: tempfile::TempDir,
    /// Whether results may still be put in place; held while one is.
    open: Mutex<bool>,
    _lock: File,
}

/// The folder of a result on its way into place; what is in it goes with this.
#[derive(Debug)]
pub struct Staged {
    parent: tempfile::TempDir,
    fresh: PathBuf,
}

impl Staged {
    /// Where its files go.
    pub fn folder(&self) -> &Path {
        &self.fresh
    }
}

/// Why nothing could be published.
#[derive(Debug, thiserror::Error)]
pub enum PublishError {
    /// The system refuses.
    #[error("cannot write {}: {error}; check that the disk has room and the folder may be written", shown(.path))]
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
        shown(.0)
    )]
    Foreign(PathBuf),
    /// Something in an older result is not planish's, and cannot be kept.
    #[error(
        "{} lies in an older result, is not of planish, and cannot be kept in the newer one: the older result was left \
         alone; move that away", shown(.0)
    )]
    Stands(PathBuf),
    /// Another process holds a lock.
    #[error(
        "{} has been locked by another process for {} s: find it with `fuser -v` and end it, or use another output \
         folder", shown(.0), own::PATIENCE.as_secs()
    )]
    Busy(PathBuf),
    /// A folder on the way is itself a result.
    #[error("{} is the result of an input: another result cannot lie in it; rename the folder in the inbox", shown(.0))]
    Nested(PathBuf),
}

impl PublishError {
    /// Whether it stays as long as nobody changes something.
    pub fn is_lasting(&self) -> bool {
        matches!(self, Self::Foreign(_) | Self::Nested(_) | Self::Stands(_))
    }
}

/// Attaches the path to an I/O error.
fn at(path: &Path) -> impl FnOnce(io::Error) -> PublishError {
    let path = path.to_owned();
    move |error| PublishError::Io { path, error }
}

impl Publisher {
    /// Opens (and makes) the output folder, and clears what dead processes left behind.
    ///
    /// # Errors
    /// [`PublishError`] where the folder cannot be written.
    pub fn open(out: &Path) -> Result<Self, PublishError> {
        let staging = out.join(STAGING);
        own::folder(&staging).map_err(at(&staging))?;
        // One process at a time, so that a folder is never seen between being made and being locked.
        let _opening = pass_gate(out, || true)?.ok_or_else(|| PublishError::Busy(staging.join(GATE)))?;
        clear_stale(&staging);
        let own = tempfile::Builder::new().prefix(RUN).tempdir_in(&staging).map_err(at(&staging))?;
        let path = own.path().join(LOCK);
        // It is new, and nobody else's.
        let lock = own::lock_file(own.path(), LOCK).and_then(|f| f.lock().map(|()| f)).map_err(at(&path))?;
        Ok(Self { out: out.to_owned(), staging: own, open: Mutex::new(true), _lock: lock })
    }

    /// The output folder.
    pub fn out(&self) -> &Path {
        &self.out
    }

    /// Where the result of the input with this name is published.
    pub fn target(&self, name: &Path) -> PathBuf {
        self.out.join(name)
    }

    /// A folder for files on their way into a result. It goes when the process ends.
    pub fn staging(&self) -> &Path {
        self.staging.path()
    }

    /// Publishes `files` as the result of the input `name`, all at once, if it is still `wanted` when they are ready to
    /// be put in place. Whether they were.
    ///
    /// # Errors
    /// [`PublishError`]; then an older result is untouched.
    pub fn publish(
        &self,
        name: &Path,
        files: &[(String, Vec<u8>)],
        wanted: impl Fn() -> bool,
    ) -> Result<bool, PublishError> {
        self.admits(name)?;
        let staged = self.room(name)?;
        write_all(staged.folder(), files)?;
        self.put(name, &staged, wanted)
    }

    /// Room for the files of the result of the input `name`, where they are not seen yet.
    ///
    /// # Errors
    /// [`PublishError`] where it cannot be made.
    pub fn room(&self, name: &Path) -> Result<Staged, PublishError> {
        let parent = tempfile::tempdir_in(self.staging()).map_err(at(self.staging()))?;
        let fresh = parent.path().join(name.file_name().unwrap_or_default());
        fs::create_dir(&fresh).map_err(at(&fresh))?;
        Ok(Staged { parent, fresh })
    }

    /// Puts files that are complete and on disk in the place of the result `name`, all at once, if it is still `wanted`
    /// then. Whether they were.
    ///
    /// # Errors
    /// [`PublishError`]; then an older result is untouched.
    pub fn put(&self, name: &Path, staged: &Staged, wanted: impl Fn() -> bool) -> Result<bool, PublishError> {
        let Staged { parent, fresh } = staged;
        let target = self.target(name);
        // One at a time, of all processes, so that what is no longer wanted never takes the place of what came after it.
        // Nobody who closes is kept waiting by a lock.
        let is_wanted = || *self.open.lock() && wanted();
        let Some(_alone) = pass_gate(&self.out, is_wanted)? else {
            return if is_wanted() { Err(PublishError::Busy(self.out.join(STAGING).join(GATE))) } else { Ok(false) };
        };
        let open = self.open.lock();
        if !*open || !wanted() {
            return Ok(false);
        }
        // Writing took its time: somebody may have put something there.
        let own = self.admits(name)?;
        let folder = self.folder_for(name)?;
        if keep_foreign(&target, &own, fresh, false)? > 0 {
            sync_folder(fresh).map_err(at(fresh))?;
        }
        if let Some(older) = put_in_place(fresh, &target, parent.path()).map_err(at(&target))? {
            // Nothing is lost of what was put there in this moment, either: where it cannot be kept, the older comes back.
            let late = match fs::symlink_metadata(&older) {
                Ok(m) if !m.is_dir() => Err(PublishError::Foreign(target.clone())),
                _ => keep_foreign(&older, &own, &target, true),
            };
            if let Err(error) = late {
                put_back(&older, &target, parent.path()).map_err(at(&older))?;
                return Err(error);
            }
        }
        sync_folder(&folder).map_err(at(&folder)).map(|()| true)
    }

    /// Whether a result may be put in the place of `name`; and the names of what planish itself has written there.
    ///
    /// # Errors
    /// [`PublishError`]: what stands there.
    pub fn admits(&self, name: &Path) -> Result<BTreeSet<OsString>, PublishError> {
        let target = self.target(name);
        let parents = name.ancestors().skip(1).filter(|p| !p.as_os_str().is_empty()).map(|p| self.out.join(p));
        if let Some(result) = parents.into_iter().find(|p| replace::own_files(p).is_some()) {
            return Err(PublishError::Nested(result));
        }
        let own = if is_plain(name) { replaceable(&target) } else { None };
        own.ok_or(PublishError::Foreign(target))
    }

    /// Nothing is put in place any more, and the staging folder goes. Whoever still writes to it hears of an error.
    pub fn close(&self) {
        *self.open.lock() = false;
        if let Err(error) = fs::remove_dir_all(self.staging()) {
            tracing::debug!(%error, "the staging folder is left to the next start");
        }
    }

    /// The folder in which the result `name` lies; made where it is missing.
    fn folder_for(&self, name: &Path) -> Result<PathBuf, PublishError> {
        let mut folder = self.out.clone();
        for part in name.parent().into_iter().flat_map(Path::components) {
            let above = folder.clone();
            folder.push(part);
            match fs::create_dir(&folder) {
                Ok(()) => sync_folder(&above).map_err(at(&above))?,
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(at(&folder)(e)),
            }
        }
        Ok(folder)
    }
}

/// Whether a path leads down only.
fn is_plain(name: &Path) -> bool {
    name.components().all(|part| matches!(part, Component::Normal(_))) && name.file_name().is_some()
}

/// The names of what planish has written to `target`: none of them where nothing is there, or an empty folder. None where
/// it is neither that nor an older result (a folder with a report of planish).
fn replaceable(target: &Path) -> Option<BTreeSet<OsString>> {
    let nothing = Some(BTreeSet::new());
    match fs::symlink_metadata(target) {
        Err(e) => nothing.filter(|_| e.kind() == io::ErrorKind::NotFound),
        Ok(m) if !m.is_dir() => None,
        Ok(_) => replace::own_files(target)
            .or_else(|| nothing.filter(|_| fs::read_dir(target).is_ok_and(|mut d| d.next().is_none()))),
    }
}

/// What lies in the folder `older`, if that is there, and is not planish's own, gets a place in `fresh`, too; how much
/// that is.
fn keep_foreign(older: &Path, own: &BTreeSet<OsString>, fresh: &Path, again: bool) -> Result<usize, PublishError> {
    if !fs::symlink_metadata(older).is_ok_and(|m| m.is_dir()) {
        return Ok(0);
    }
    let kept = replace::keep_foreign(older, own, fresh, again).map_err(|e| match e {
        NotKept::Stands(path) => PublishError::Stands(path),
        NotKept::Io(path, error) => PublishError::Io { path, error },
    })?;
    if kept > 0 {
        tracing::info!(result = shown(fresh), kept, "files that planish did not write stay in the result");
    }
    Ok(kept)
}

/// Opens and locks the gate of an output folder, as long as that is `wanted`; none where another process holds it for
/// too long.
fn pass_gate(out: &Path, wanted: impl Fn() -> bool) -> Result<Option<File>, PublishError> {
    let folder = out.join(STAGING);
    let path = folder.join(GATE);
    let gate = own::lock_file(&folder, GATE).map_err(at(&path))?;
    Ok(own::lock(&gate, &path, own::PATIENCE, wanted).map_err(at(&path))?.then_some(gate))
}

/// Writes the files of a result to `folder`, and brings them to disk.
///
/// # Errors
/// [`PublishError`].
pub fn write_all(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), PublishError> {
    for (file, bytes) in files {
        let path = folder.join(file);
        write_synced(&path, bytes).map_err(at(&path))?;
    }
    sync_folder(folder).map_err(at(folder))
}

fn write_synced(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

fn sync_folder(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// Renames `fresh` to `target` in one step. Where there is an older result the two change places, and the older one
/// goes with the staging folder; where that lies now. Another process may put one there, or take it away, at any
/// moment: then the other way is tried, a few times.
#[cfg(target_os = "linux")]
fn put_in_place(fresh: &Path, target: &Path, staging: &Path) -> io::Result<Option<PathBuf>> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    use rustix::io::Errno;
    for _ in 0..16 {
        match renameat_with(CWD, fresh, CWD, target, RenameFlags::NOREPLACE) {
            Err(Errno::EXIST | Errno::NOTEMPTY) => {}
            Err(Errno::INVAL | Errno::NOSYS) => break,
            ended => return Ok(ended.map(|()| None)?),
        }
        match renameat_with(CWD, fresh, CWD, target, RenameFlags::EXCHANGE) {
            Err(Errno::NOENT) => {}
            Err(Errno::INVAL | Errno::NOSYS) => break,
            ended => return Ok(ended.map(|()| Some(fresh.to_owned()))?),
        }
    }
    put_in_place_in_two_steps(fresh, target, staging)
}

/// Where the system cannot exchange two folders, the older one is moved away first.
#[cfg(not(target_os = "linux"))]
fn put_in_place(fresh: &Path, target: &Path, staging: &Path) -> io::Result<Option<PathBuf>> {
    put_in_place_in_two_steps(fresh, target, staging)
}

fn put_in_place_in_two_steps(fresh: &Path, target: &Path, staging: &Path) -> io::Result<Option<PathBuf>> {
    let older = staging.join("older");
    let moved = match fs::rename(target, &older) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
        moved => moved.is_ok(),
    };
    match fs::rename(fresh, target) {
        Ok(()) => Ok(moved.then_some(older)),
        Err(error) => {
            if moved {
                fs::rename(&older, target)?;
            }
            Err(error)
        }
    }
}

/// The older result comes back to its place; the newer one goes with the staging folder.
fn put_back(older: &Path, target: &Path, staging: &Path) -> io::Result<()> {
    fs::rename(target, staging.join("withdrawn"))?;
    fs::rename(older, target)
}

/// Removes staging folders that are ours and whose lock nobody holds, and those that were made and never locked, which
/// are empty. All else that lies there stays.
fn clear_stale(staging: &Path) {
    let Ok(entries) = fs::read_dir(staging) else { return };
    let is_run =
        |e: &fs::DirEntry| e.file_type().is_ok_and(|t| t.is_dir()) && e.file_name().to_string_lossy().starts_with(RUN);
    for folder in entries.flatten().filter(is_run).map(|e| e.path()) {
        let removed = match own::lock_file_there(&folder, LOCK).map(|lock| lock.try_lock().is_ok()) {
            Ok(true) => {
                begun::take_over(staging, &folder);
                crate::hooks::end_those_of(&folder);
                fs::remove_dir_all(&folder)
            }
            Ok(false) => Ok(()),
            // Fails where something is in it.
            Err(_) => fs::remove_dir(&folder),
        };
        if let Err(error) = removed {
            tracing::warn!(folder = shown(&folder), "an abandoned staging folder is left alone: {error}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A report of planish that names these files, and the files.
    fn result(of: &[(&str, &str)]) -> Vec<(String, Vec<u8>)> {
        let files = || of.iter().map(|(name, text)| ((*name).to_owned(), text.as_bytes().to_vec()));
        let outputs: Vec<_> = files().map(|(name, text)| crate::report::Output::of(&name, &text)).collect();
        let report = serde_json::json!({"schema": 1, "planish": "1", "status": "certified", "outputs": outputs});
        files().chain([(crate::report::FILE.to_owned(), report.to_string().into_bytes())]).collect()
    }

    fn files(text: &str) -> Vec<(String, Vec<u8>)> {
        result(&[("b.txt", text)])
    }

    #[test]
    fn a_newer_result_takes_the_place_of_an_older_one_whole() {
        let out = tempfile::tempdir().expect("a folder");
        let publisher = Publisher::open(out.path()).expect("opens");
        let name = Path::new("part.stl");
        let old = result(&[("b.txt", "old"), ("only-old.txt", "")]);
        publisher.publish(name, &old, || true).expect("published");
        publisher.publish(name, &files("new"), || true).expect("published");
        let target = publisher.target(name);
        assert_eq!(fs::read_to_string(target.join("b.txt")).expect("there"), "new");
        assert!(!target.join("only-old.txt").exists());
        drop(publisher);
        let visible = fs::read_dir(out.path()).expect("there").flatten().filter(|e| e.file_name() != STAGING);
        assert_eq!(visible.count(), 1);
        let hidden = fs::read_dir(out.path().join(STAGING)).expect("there").flatten().map(|e| e.file_name());
        assert_eq!(hidden.collect::<Vec<_>>(), [GATE], "nothing else is left behind");
    }

    #[test]
    fn a_failed_publication_leaves_the_older_result() {
        let out = tempfile::tempdir().expect("a folder");
        let publisher = Publisher::open(out.path()).expect("opens");
        let name = Path::new("part.stl");
        publisher.publish(name, &files("old"), || true).expect("published");
        let broken = vec![("b.txt".to_owned(), vec![]), ("no/such/folder.txt".to_owned(), vec![])];
        assert!(publisher.publish(name, &broken, || true).is_err());
        assert_eq!(fs::read_to_string(publisher.target(name).join("b.txt")).expect("there"), "old");
    }

    #[test]
    fn systems_that_cannot_exchange_folders_are_served_in_two_steps() {
        let folder = tempfile::tempdir().expect("a folder");
        let [fresh, target, staging] = ["fresh", "target", "staging"].map(|n| folder.path().join(n));
        for text in ["first", "second"] {
            fs::create_dir(&fresh).expect("made");
            fs::write(fresh.join("a.txt"), text).expect("written");
            let _ = fs::remove_dir_all(&staging);
            fs::create_dir(&staging).expect("made");
            put_in_place_in_two_steps(&fresh, &target, &staging).expect("placed");
            assert_eq!(fs::read_to_string(target.join("a.txt")).expect("there"), text);
        }
    }

    #[test]
    fn an_older_result_comes_back_where_the_newer_one_cannot_stay() {
        let folder = tempfile::tempdir().expect("a folder");
        let [fresh, target, staging] = ["fresh", "target", "staging"].map(|n| folder.path().join(n));
        [&target, &staging].iter().for_each(|path| fs::create_dir(path).expect("made"));
        fs::write(target.join("a.txt"), "old").expect("written");
        let is_old = || fs::read_to_string(target.join("a.txt")).is_ok_and(|text| text == "old");
        assert!(put_in_place_in_two_steps(&fresh, &target, &staging).is_err() && is_old(), "there is no newer one");
        fs::create_dir(&fresh).expect("made");
        let older = put_in_place(&fresh, &target, &staging).expect("placed").expect("one was there");
        assert!(!is_old());
        put_back(&older, &target, &staging).expect("put back");
        assert!(is_old());
    }

    #[test]
    fn many_writers_of_one_name_all_succeed() {
        let out = tempfile::tempdir().expect("a folder");
        let write = || {
            let publisher = Publisher::open(out.path()).expect("opens");
            for _ in 0..20 {
                publisher.publish(Path::new("part.stl"), &files("new"), || true).expect("published");
            }
        };
        std::thread::scope(|s| (0..4).for_each(|_| drop(s.spawn(write))));
        assert_eq!(fs::read_to_string(out.path().join("part.stl/b.txt")).expect("there"), "new");
    }

    #[test]
    fn what_is_no_result_is_never_replaced() {
        let out = tempfile::tempdir().expect("a folder");
        let publisher = Publisher::open(out.path()).expect("opens");
        fs::write(out.path().join("part.stl"), "an input").expect("written");
        fs::create_dir(out.path().join("folder.stl")).expect("made");
        fs::write(out.path().join("folder.stl/precious.txt"), "work").expect("written");
        for name in ["part.stl", "folder.stl", "", STAGING, "../part.stl", "/part.stl", "a/../b.stl"] {
            let refused = publisher.publish(Path::new(name), &files("new"), || true);
            assert!(matches!(refused, Err(PublishError::Foreign(_))), "{name}: {refused:?}");
        }
        assert_eq!(fs::read_to_string(out.path().join("part.stl")).expect("there"), "an input");
        assert!(out.path().join("folder.stl/precious.txt").exists());
        fs::create_dir(out.path().join("empty.stl")).expect("made");
        assert!(publisher.publish(Path::new("empty.stl"), &files("new"), || true).is_ok());
        let late = out.path().join("late.stl");
        let put_there = || {
            fs::create_dir(&late).and_then(|()| fs::write(late.join("precious.txt"), "work")).expect("written");
            true
        };
        let refused = publisher.publish(Path::new("late.stl"), &files("new"), put_there);
        assert!(matches!(refused, Err(PublishError::Foreign(_))), "{refused:?}");
        assert!(late.join("precious.txt").exists());
    }

    #[test]
    fn results_of_sub_folders_lie_in_sub_folders_but_not_in_results() {
        let out = tempfile::tempdir().expect("a folder");
        let publisher = Publisher::open(out.path()).expect("opens");
        assert!(publisher.publish(Path::new("a/b/part.stl"), &files("new"), || true).expect("published"));
        assert!(out.path().join("a/b/part.stl/b.txt").exists());
        let nested = publisher.publish(Path::new("a/b/part.stl/c.stl"), &files("new"), || true);
        assert!(matches!(nested, Err(PublishError::Nested(_))), "{nested:?}");
        fs::create_dir(out.path().join("other")).expect("made");
        fs::write(out.path().join("other").join(crate::report::FILE), "{}").expect("written");
        assert!(publisher.publish(Path::new("other/c.stl"), &files("new"), || true).is_ok(), "that is no result");
    }

    #[test]
    fn what_is_not_wanted_any_more_is_not_put_in_place() {
        let out = tempfile::tempdir().expect("a folder");
        let publisher = Publisher::open(out.path()).expect("opens");
        let name = Path::new("part.stl");
        assert!(!publisher.publish(name, &files("new"), || false).expect("no error"));
        assert_eq!(fs::read_dir(publisher.staging()).expect("there").count(), 1, "the lock only");
        publisher.close();
        assert!(publisher.publish(name, &files("new"), || true).is_err(), "there is no place for it any more");
        assert!(!publisher.target(name).exists());
        assert!(!publisher.staging().exists());
    }

    #[test]
    fn abandoned_staging_is_cleared_and_staging_in_use_is_not() {
        let out = tempfile::tempdir().expect("a folder");
        let abandoned = out.path().join(STAGING).join("run-dead");
        fs::create_dir_all(&abandoned).expect("made");
        fs::write(abandoned.join(LOCK), "").expect("written");
        let first = Publisher::open(out.path()).expect("opens");
        assert!(!abandoned.exists());
        let second = Publisher::open(out.path()).expect("opens beside the first");
        assert!(first.staging.path().exists());
        second.publish(Path::new("b.stl"), &files("b"), || true).expect("published");
        first.publish(Path::new("a.stl"), &files("a"), || true).expect("published");
    }
}
