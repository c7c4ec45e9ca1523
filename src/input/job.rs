//! One input as it travels: which file, under which name, and whether it is still wanted.

use crate::system::fingerprint::Fingerprint;
use crate::system::safe_open::{self, OpenError};
use blake3::Hash;
use parking_lot::Mutex;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// An input with the name of its result.
#[derive(Debug)]
pub struct Job {
    /// The file.
    pub path: PathBuf,
    /// Where its result goes, below the output folder: its whole name, perhaps behind that of a sub-folder.
    pub name: PathBuf,
    /// Its size as it was seen, for the order among jobs.
    pub bytes: u64,
    /// What the file must look like; nothing where it could not be looked at.
    pub look: Option<Fingerprint>,
    /// Since when it looks like that, where it lies in an inbox.
    pub since: Option<Instant>,
    /// The folder out of which no link may lead; none where the user named the file itself.
    pub within: Option<PathBuf>,
    /// The hash of its content when it was done: the job is to see whether it still is that.
    pub doubted: Option<Hash>,
    unwanted: AtomicBool,
    beside: Mutex<Vec<String>>,
}

impl Job {
    /// The job for a file whose result goes to `name`.
    pub fn new(path: PathBuf, name: PathBuf, bytes: u64) -> Self {
        let (unwanted, beside) = (AtomicBool::new(false), Mutex::default());
        Self { path, name, bytes, look: None, since: None, within: None, doubted: None, unwanted, beside }
    }

    /// The job for a file that is named: its result has its name.
    pub fn of_file(path: PathBuf) -> Self {
        let name = path.file_name().map(PathBuf::from).unwrap_or_default();
        let look = Fingerprint::at(&path).ok().flatten();
        Self { look, ..Self::new(path, name, look.map_or(0, |look| look.bytes)) }
    }

    /// The job for a file in a folder that is named.
    pub fn of_folder(folder: &Path, path: PathBuf) -> Self {
        Self { within: Some(folder.to_owned()), ..Self::of_file(path) }
    }

    /// The job for a file that was seen in the folder `inbox` under the relative path `name`, and has not changed `since`.
    pub fn of_inbox(inbox: &Path, name: &Path, look: Fingerprint, since: Instant) -> Self {
        let (path, look, since, within) = (inbox.join(name), Some(look), Some(since), Some(inbox.to_owned()));
        Self { since, within, look, ..Self::new(path, name.to_owned(), look.map_or(0, |look| look.bytes)) }
    }

    /// This job, if it is only to see whether the file still has the content with this hash.
    pub fn doubting(self, hash: Hash) -> Self {
        Self { doubted: Some(hash), ..self }
    }

    /// Opens the file.
    ///
    /// # Errors
    /// Where it is none, or must not be opened.
    pub fn open(&self) -> Result<File, OpenError> {
        match &self.within {
            Some(folder) => safe_open::open_inside(folder, &self.path),
            None => safe_open::open(&self.path),
        }
    }

    /// Nobody wants the result any more: work ends at the next safe point, and nothing is published.
    pub fn cancel(&self) {
        self.unwanted.store(true, Ordering::Relaxed);
    }

    /// Whether the result is still wanted.
    pub fn is_wanted(&self) -> bool {
        !self.unwanted.load(Ordering::Relaxed)
    }

    /// The names of the files beside it that it asked for when it was read.
    pub fn beside(&self) -> Vec<String> {
        self.beside.lock().clone()
    }

    /// Tells which files beside it it asked for.
    pub fn set_beside(&self, names: Vec<String>) {
        *self.beside.lock() = names;
    }

    /// Whether the file still is what was seen; always, where nothing was.
    pub fn is_unchanged(&self) -> bool {
        self.look.is_none_or(|seen| Fingerprint::at(&self.path).is_ok_and(|now| now == Some(seen)))
    }
}
