//! Removing results: the opposite of publishing.
//!
//! What the report names goes, and the report itself last: whoever is killed in between leaves a result of which something
//! is missing, and which is therefore made or removed again, but nothing that nobody knows. What planish did not write
//! stays, and with it the folder. All is done in folders that are open, with no link on the way: so nothing outside the
//! output folder goes, and nothing of a newer result that takes the place of this one meanwhile.

use crate::output::listed::Listed;
use crate::output::replace;
use crate::result_files;
use crate::system::disk::{self, Disk, Folder, System};
use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Why a result is not removed.
#[derive(Debug, thiserror::Error)]
pub enum WithdrawError {
    /// There is none.
    #[error("it is no result of planish")]
    NoResult,
    /// The system refuses.
    #[error("cannot remove it: {0}")]
    Io(#[from] io::Error),
}

/// A result that is there.
#[derive(Debug)]
pub struct Standing<F: Folder = <System as Disk>::Folder> {
    /// The folder in which it lies.
    above: F,
    /// The name of its folder there.
    name: OsString,
    folder: F,
    own: Listed,
}

impl Standing {
    /// The result `name` in the output folder `out`.
    ///
    /// # Errors
    /// [`WithdrawError`].
    pub fn find(out: &Path, name: &Path) -> Result<Self, WithdrawError> {
        Self::find_on(&System, out, name)
    }
}

impl<F: Folder> Standing<F> {
    /// As [`Standing::find`], on this disk.
    ///
    /// # Errors
    /// [`WithdrawError`].
    pub fn find_on<D: Disk<Folder = F>>(disk: &D, out: &Path, name: &Path) -> Result<Self, WithdrawError> {
        let last = name.file_name().ok_or(WithdrawError::NoResult)?.to_owned();
        let above = name.parent().unwrap_or(Path::new(""));
        let above = disk::below(disk.open(out)?, above).map_err(|_| WithdrawError::NoResult)?;
        let folder = above.open_folder(&last).map_err(|_| WithdrawError::NoResult)?;
        let own = replace::own_files(&folder)?.ok_or(WithdrawError::NoResult)?;
        Ok(Self { above, name: last, folder, own })
    }

    /// Whether there is anything in it that planish did not write.
    ///
    /// # Errors
    /// The folder cannot be read.
    pub fn holds_foreign(&self) -> io::Result<bool> {
        Ok(!self.own.is_all_of(&self.folder)?)
    }

    /// Removes what planish has written; whether nothing else was there, so that the folder is gone, too.
    ///
    /// # Errors
    /// The system refuses; some of it may be gone then, but not the report.
    pub fn remove(self) -> io::Result<bool> {
        self.own.remove(&self.folder, result_files::REPORT)?;
        self.folder.unlink(result_files::REPORT)?;
        match self.above.remove_folder(&self.name) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(true),
            Err(error) if disk::is_full(&error) => Ok(false),
            removed => removed.map(|()| true),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::listed;
    use std::fs;
    use std::os::unix::fs::symlink;

    /// A result with these files in an output folder.
    fn result(out: &Path, name: &str, files: &[&str]) {
        let folder = out.join(name);
        fs::create_dir_all(&folder).expect("made");
        let output = |file: &&str| format!(r#"{{"file": "{file}", "bytes": 1, "blake3": "00"}}"#);
        let outputs: Vec<String> = files.iter().map(output).collect();
        let report = r#"{"schema": 1, "planish": "1", "status": "certified", "outputs": ["#.to_owned();
        fs::write(folder.join(result_files::REPORT), report + &outputs.join(",") + "]}").expect("written");
        for file in files.iter().filter(|file| listed::place(file).is_some_and(|(folder, _)| folder.is_none())) {
            fs::write(folder.join(file), "x").expect("written");
        }
    }

    fn names(folder: &Path) -> Vec<String> {
        let mut all: Vec<String> =
            fs::read_dir(folder).expect("there").flatten().map(|e| e.file_name().display().to_string()).collect();
        all.sort();
        all
    }

    #[test]
    fn a_result_goes_with_its_folder_and_what_is_not_of_planish_stays() {
        let out = tempfile::tempdir().expect("a folder");
        result(out.path(), "sub/a.stl", &["surface.vtu"]);
        let a = Standing::find(out.path(), "sub/a.stl".as_ref()).expect("a result");
        assert!(!a.holds_foreign().expect("read") && a.remove().expect("removed"));
        assert_eq!(names(&out.path().join("sub")), [""; 0]);
        result(out.path(), "b.stl", &["surface.vtu", "param.vtu"]);
        let b = out.path().join("b.stl");
        fs::write(b.join("notes.txt"), "mine").and_then(|()| fs::write(b.join("hooks.json"), "")).expect("written");
        fs::remove_file(b.join("param.vtu")).and_then(|()| fs::create_dir(b.join("param.vtu"))).expect("made");
        let b = Standing::find(out.path(), "b.stl".as_ref()).expect("a result");
        assert!(b.holds_foreign().expect("read") && !b.remove().expect("removed"));
        assert_eq!(names(&out.path().join("b.stl")), ["notes.txt", "param.vtu"]);
    }

    #[test]
    fn no_link_is_followed_and_no_report_leads_elsewhere() {
        let place = tempfile::tempdir().expect("a folder");
        let [out, other] = ["out", "other"].map(|name| place.path().join(name));
        result(&other, "a.stl", &["surface.vtu"]);
        fs::create_dir(&out).expect("made");
        symlink(other.join("a.stl"), out.join("a.stl")).expect("linked");
        symlink(&other, out.join("sub")).expect("linked");
        for name in ["a.stl", "sub/a.stl", "../other/a.stl", "", "missing.stl"] {
            assert!(matches!(Standing::find(&out, name.as_ref()), Err(WithdrawError::NoResult)), "{name}");
        }
        result(&out, "b.stl", &["../../other/a.stl/surface.vtu", "/etc/none", "linked.vtu"]);
        fs::remove_file(out.join("b.stl/linked.vtu")).expect("removed");
        symlink(other.join("a.stl/surface.vtu"), out.join("b.stl/linked.vtu")).expect("linked");
        assert!(Standing::find(&out, "b.stl".as_ref()).expect("a result").remove().expect("removed"));
        assert_eq!(names(&other.join("a.stl")), ["report.json", "surface.vtu"]);
    }

    /// A newer result that takes the place of an older one while that is removed is left alone.
    #[test]
    fn a_newer_result_is_left_alone() {
        let out = tempfile::tempdir().expect("a folder");
        result(out.path(), "a.stl", &["surface.vtu"]);
        let older = Standing::find(out.path(), "a.stl".as_ref()).expect("a result");
        fs::rename(out.path().join("a.stl"), out.path().join("older")).expect("moved");
        result(out.path(), "a.stl", &["surface.vtu"]);
        assert!(!older.remove().expect("removed"));
        assert_eq!(names(&out.path().join("a.stl")), ["report.json", "surface.vtu"]);
    }
}
