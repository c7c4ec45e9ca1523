//! What becomes of an older result whose place a newer one takes.
//!
//! A folder is a result if its report.json is one of planish's. What the report names in it is planish's, and goes; what
//! commands wrote there, or people put there, is not ours, and moves on into the newer result.

use super::listed::Listed;
use crate::report;
use crate::result_files;
use crate::system::disk::{self, File, Folder, Kind, Rename, Stat};
use crate::system::passing;
use crate::system::safe_open::{self, OpenError};
use serde::Deserialize;
use std::ffi::{OsStr, OsString};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A longer report is none of planish's: one of a million charts has half of this.
const LONGEST: u64 = 1 << 30;

/// The parts of a report by which it is known as planish's, whatever its version.
#[derive(Deserialize)]
struct Known {
    #[serde(rename = "schema")]
    _schema: u32,
    #[serde(rename = "planish")]
    _version: String,
    #[serde(rename = "status")]
    _status: crate::outcome::Status,
    outputs: Vec<report::Output>,
}

/// The names of what planish wrote to the result in `folder`; none where it is no result of planish.
///
/// # Errors
/// A system in trouble, which says nothing about the folder.
pub fn own_files<F: Folder>(folder: &F) -> io::Result<Option<Listed>> {
    let text = folder.open_file(result_files::REPORT).and_then(|file| safe_open::read(&file, LONGEST));
    let text = match text {
        Err(OpenError::Io(error)) if passing::passes(&error) => return Err(error),
        text => text.ok(),
    };
    let report: Option<Known> = text.and_then(|text| serde_json::from_slice(&text).ok());
    Ok(report.map(|report| Listed::of(report.outputs)))
}

/// Why what is not planish's cannot be kept.
#[derive(Debug)]
pub enum NotKept {
    /// It is neither a file, nor a folder, nor a link, or the newer result has something else of that name.
    Stands(PathBuf),
    /// The system refuses.
    Io(PathBuf, io::Error),
}

/// Gives second names in `fresh` to what lies in `older`, which is the folder `at`, and is not `own`; where a file system
/// has no second names, copies, which are made on the `desk`, a folder on the same file system: so none is ever seen half.
/// What has one already is passed over if `again`. How many files, folders and links these are.
///
/// # Errors
/// [`NotKept`]; `older` is untouched in any case.
pub fn keep_foreign<F: Folder>(
    older: &F,
    at: &Path,
    own: &Listed,
    (fresh, desk): (&F, &F),
    again: bool,
) -> Result<usize, NotKept> {
    let mut kept = 0;
    for name in names(older, at)? {
        match own.folder(&name) {
            Some(inside) if is_folder(older, at, &name)? => {
                kept += keep_in_own(older, at, &name, &inside, (fresh, desk), again)?;
            }
            _ if own.has(&name) => {}
            _ => kept += keep(older, at, &name, (fresh, desk), again)?,
        }
    }
    Ok(kept)
}

fn is_folder<F: Folder>(folder: &F, at: &Path, name: &OsStr) -> Result<bool, NotKept> {
    folder.stat_of(name).map(|found| found.is_folder()).map_err(|e| NotKept::Io(at.join(name), e))
}

/// As [`keep_foreign`], in a folder of planish's, which the newer result need not have.
fn keep_in_own<F: Folder>(
    older: &F,
    at: &Path,
    name: &OsStr,
    own: &Listed,
    (fresh, desk): (&F, &F),
    again: bool,
) -> Result<usize, NotKept> {
    let path = at.join(name);
    let failed = |error| NotKept::Io(path.clone(), error);
    let from = older.open_folder(name).map_err(failed)?;
    if own.is_all_of(&from).map_err(failed)? {
        return Ok(0);
    }
    match fresh.make_folder(name, disk::OPEN_FOLDER) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(failed(error)),
        Err(_) if !is_folder(fresh, at, name)? => return Err(NotKept::Stands(path)),
        Ok(()) | Err(_) => {}
    }
    let to = fresh.open_folder(name).map_err(failed)?;
    let kept = keep_foreign(&from, &path, own, (&to, desk), again)?;
    to.sync().map_err(failed)?;
    Ok(kept)
}

/// The names in a folder, in their order.
fn names<F: Folder>(folder: &F, at: &Path) -> Result<Vec<OsString>, NotKept> {
    let mut names = folder.list().map_err(|e| NotKept::Io(at.to_owned(), e))?;
    names.sort_unstable();
    Ok(names)
}

/// Keeps what has this name, with all that is in it.
fn keep<F: Folder>(older: &F, at: &Path, name: &OsStr, (fresh, desk): (&F, &F), again: bool) -> Result<usize, NotKept> {
    let path = at.join(name);
    let failed = |error| NotKept::Io(path.clone(), error);
    let found = older.stat_of(name).map_err(failed)?;
    let made = match found.kind {
        // For nobody else as long as it is not complete.
        Kind::Folder => fresh.make_folder(name, 0o700),
        Kind::Link => older.read_link(name).and_then(|target| fresh.make_link(&target, name)),
        Kind::File => second_name(older, name, fresh, desk),
        Kind::Other => return Err(NotKept::Stands(path)),
    };
    let is_new = match made {
        Ok(()) => true,
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(failed(error)),
        Err(_) if again && is_second(older, name, &found, fresh).map_err(failed)? => false,
        Err(_) => return Err(NotKept::Stands(path)),
    };
    let mut kept = usize::from(is_new);
    if found.is_folder() {
        let from = older.open_folder(name).map_err(failed)?;
        let to = fresh.open_folder(name).map_err(failed)?;
        // Nothing in there is planish's.
        let inside = keep_foreign(&from, &path, &Listed::default(), (&to, desk), again)?;
        let is_complete = to.stat().map_err(failed)?.mode == found.mode_of_copy();
        if is_new || inside > 0 || !is_complete {
            complete(&found, &to).map_err(failed)?;
        }
        kept += inside;
    }
    Ok(kept)
}

/// Whether what has this name in `fresh` is what is kept there of the one that was `found` in `older`.
fn is_second<F: Folder>(older: &F, name: &OsStr, found: &Stat, fresh: &F) -> io::Result<bool> {
    let second = fresh.stat_of(name)?;
    if found.kind != second.kind {
        return Ok(false);
    }
    match found.kind {
        Kind::Folder => Ok(true),
        Kind::Link => Ok(older.read_link(name)? == fresh.read_link(name)?),
        Kind::File | Kind::Other => {
            let is_same = found.identity == second.identity;
            // Copies have another number, and size and time of their original.
            let is_copy = (found.bytes, found.modified) == (second.bytes, second.modified);
            Ok(is_same || is_copy)
        }
    }
}

/// Gives a folder the permissions of the one that it was made after, and brings it to disk.
fn complete<F: Folder>(from: &Stat, to: &F) -> io::Result<()> {
    to.set_mode(from.mode_of_copy())?;
    to.sync()
}

/// Gives a file a second name in another folder, or makes a copy of it there.
fn second_name<F: Folder>(from: &F, name: &OsStr, to: &F, desk: &F) -> io::Result<()> {
    match from.link(name, to, name) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => copy(from, name, to, desk),
        linked => linked,
    }
}

/// Copies a file: on the desk, and into place when it is whole.
fn copy<F: Folder>(from: &F, name: &OsStr, to: &F, desk: &F) -> io::Result<()> {
    let file = from.open_file(name).map_err(OpenError::into_io)?;
    let (hidden, copy) = disk::make_unique("copy-", |hidden| desk.make_file(hidden, 0o600))?;
    let filled = fill(&file, &copy).and_then(|()| move_to_free(desk, &hidden, to, name));
    if filled.is_err() {
        let _ = desk.unlink(&hidden);
    }
    filled
}

/// Writes to a copy what is in the file, with its time and permissions, and brings it to disk.
fn fill<F: File>(file: &F, copy: &F) -> io::Result<()> {
    let original = file.stat()?;
    io::copy(&mut file.content()?, &mut Appending(copy))?;
    copy.set_time(original.modified)?;
    copy.set_mode(original.mode_of_copy())?;
    copy.sync()
}

/// As [`disk::rename_to_free`], also where there are no second names: then somebody may take the name in between.
fn move_to_free<F: Folder>(from: &F, name: &OsStr, to: &F, to_name: &OsStr) -> io::Result<()> {
    match from.rename(name, to, to_name, Rename::ToFree) {
        Err(error) if disk::is_unsupported(&error) => {}
        ended => return ended,
    }
    if to.stat_of(to_name).is_ok() {
        return Err(ErrorKind::AlreadyExists.into());
    }
    from.rename(name, to, to_name, Rename::Over)
}

/// Writes to a file.
struct Appending<'a, F>(&'a F);

impl<F: File> io::Write for Appending<'_, F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.append(bytes).map(|()| bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::disk::{Disk, System};
    use rustix::fs::{CWD, FileType, Mode, mknodat};
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_result_is_known_by_its_report_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |text: &str| fs::write(folder.path().join(result_files::REPORT), text).expect("written");
        let own_files = || own_files(&System.open(folder.path()).expect("there")).expect("no trouble");
        assert!(own_files().is_none());
        for text in [
            "",
            "{}",
            r#"{"status": "certified"}"#,
            r#"{"schema": 1, "planish": "1", "status": "fine", "outputs": []}"#,
        ] {
            write(text);
            assert!(own_files().is_none(), "{text}");
        }
        let output = r#"{"file": "surface.vtu", "bytes": 1, "blake3": "00"}"#;
        write(&format!(
            r#"{{"schema": 9, "planish": "7.1", "status": "certified", "outputs": [{output}], "more": 1}}"#
        ));
        let names: Vec<_> = own_files().expect("a result").files().cloned().collect();
        let finer = result_files::FINER;
        assert_eq!(names, [&finer[..], &["hooks.json", "mesh.json", "report.json", "surface.vtu"]].concat());
    }

    #[test]
    fn files_folders_and_links_are_kept_and_others_refused() {
        let place = tempfile::tempdir().expect("a folder");
        let [older, fresh] = ["older", "fresh"].map(|n| place.path().join(n));
        fs::create_dir_all(older.join("notes/deep")).expect("made");
        fs::create_dir(&fresh).expect("made");
        for name in ["mine.txt", "ours.vtu", "notes/deep/a.txt"] {
            fs::write(older.join(name), name).expect("written");
        }
        std::os::unix::fs::symlink("/etc", older.join("link")).expect("linked");
        fs::set_permissions(older.join("notes"), fs::Permissions::from_mode(0o2750)).expect("set");
        let own = Listed::of(vec![report::Output::of("ours.vtu", b"")]);
        let keep_foreign = |again| {
            let [from, to, desk] =
                [older.as_path(), &fresh, place.path()].map(|path| System.open(path).expect("there"));
            keep_foreign(&from, &older, &own, (&to, &desk), again)
        };
        assert_eq!(keep_foreign(false).expect("kept"), 5);
        assert_eq!(fs::read_to_string(fresh.join("notes/deep/a.txt")).expect("there"), "notes/deep/a.txt");
        assert_eq!(fs::read_link(fresh.join("link")).expect("a link"), Path::new("/etc"));
        assert_eq!(fs::metadata(fresh.join("notes")).expect("there").permissions().mode() & 0o777, 0o750);
        assert!(!fresh.join("ours.vtu").exists() && older.join("mine.txt").exists());
        assert!(matches!(keep_foreign(false), Err(NotKept::Stands(_))), "they are there already");
        fs::write(older.join("late.txt"), "late").expect("written");
        assert_eq!(keep_foreign(true).expect("kept"), 1);
        // An editor has saved it under its name meanwhile.
        fs::remove_file(older.join("mine.txt"))
            .and_then(|()| fs::write(older.join("mine.txt"), "newer"))
            .expect("written");
        assert!(matches!(keep_foreign(true), Err(NotKept::Stands(_))), "it is not dropped");
        fs::remove_file(older.join("mine.txt")).expect("removed");
        mknodat(CWD, older.join("pipe"), FileType::Fifo, Mode::RUSR, 0).expect("made");
        assert!(matches!(keep_foreign(true), Err(NotKept::Stands(_))));
    }
}
