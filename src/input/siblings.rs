//! The files beside an input, which its format names: those that were asked for, and what was read of them.

use super::job::Job;
use crate::formats::SiblingFiles;
use crate::report::Output;
use crate::system::safe_open;
use std::cell::RefCell;
use std::path::Path;

/// The folder of a file, and what was asked for in it.
pub struct Folder<'a> {
    of: &'a Path,
    within: Option<&'a Path>,
    asked: RefCell<Vec<(String, Option<Output>)>>,
}

impl<'a> Folder<'a> {
    /// The folder of the file at this path.
    pub fn of(path: &'a Path) -> Self {
        Self { of: path, within: None, asked: RefCell::default() }
    }

    /// The folder of an input.
    pub fn of_job(job: &'a Job) -> Self {
        Self { within: job.within.as_deref(), ..Self::of(&job.path) }
    }

    /// The names of the files that were asked for, there or not.
    pub fn asked(&self) -> Vec<String> {
        self.asked.borrow().iter().map(|(name, _)| name.clone()).collect()
    }

    /// The files that were read.
    pub fn read(&self) -> Vec<Output> {
        self.asked.borrow().iter().filter_map(|(_, read)| read.clone()).collect()
    }

    /// Whether a file still is what was read once.
    pub fn still_has(&self, read: &Output) -> bool {
        self.bytes(&read.file, read.bytes).is_ok_and(|bytes| Output::of(&read.file, &bytes) == *read)
    }

    /// The bytes of a regular file, no link, of at most `most` bytes; or why there are none, for people.
    fn bytes(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let path = self.of.with_file_name(name);
        if path.file_name() != Some(name.as_ref()) {
            return Err(format!("{name} is no plain name"));
        }
        let opened = match self.within.and_then(|folder| Some((folder, path.strip_prefix(folder).ok()?))) {
            Some((folder, name)) => safe_open::open_below(folder, name),
            None => safe_open::open_itself(&path),
        };
        opened.and_then(|file| safe_open::read(&file, most)).map_err(|error| format!("{name}: {error}"))
    }
}

impl SiblingFiles for Folder<'_> {
    fn read(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let bytes = self.bytes(name, most);
        let read = bytes.as_ref().ok().map(|bytes| Output::of(name, bytes));
        self.asked.borrow_mut().push((name.to_owned(), read));
        bytes
    }
}
