//! What becomes of an older result whose place a newer one takes.
//!
//! A folder is a result if its report.json is one of planish's. What the report names in it is planish's, and goes; what
//! commands wrote there, or people put there, is not ours, and moves on into the newer result.

use crate::report;
use crate::{hooks, regular, verbs};
use rustix::fs::CWD;
use serde::Deserialize;
use std::collections::BTreeSet;
use std::ffi::OsString;
use std::fs;
use std::io::{self, ErrorKind};
use std::os::unix::fs::{DirBuilderExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

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
pub fn own_files(folder: &Path) -> Option<BTreeSet<OsString>> {
    let file = regular::open_itself(&folder.join(report::FILE)).ok()?;
    let report: Known = serde_json::from_slice(&regular::read(&file, LONGEST).ok()?).ok()?;
    let beside = [report::FILE, verbs::check_mesh::FILE, hooks::FILE].map(str::to_owned);
    Some(report.outputs.into_iter().map(|o| o.file).chain(beside).map(OsString::from).collect())
}

/// Why what is not planish's cannot be kept.
#[derive(Debug)]
pub enum NotKept {
    /// It is neither a file, nor a folder, nor a link, or the newer result has something else of that name.
    Stands(PathBuf),
    /// The system refuses.
    Io(PathBuf, io::Error),
}

/// Gives second names in `fresh` to what lies in `older` and is not `own`; where a file system has no second names,
/// copies. What has one already is passed over if `again`. How many files, folders and links these are.
///
/// # Errors
/// [`NotKept`]; `older` is untouched in any case.
pub fn keep_foreign(older: &Path, own: &BTreeSet<OsString>, fresh: &Path, again: bool) -> Result<usize, NotKept> {
    let is_foreign = |e: &walkdir::DirEntry| e.depth() != 1 || !own.contains(e.file_name());
    let (mut kept, mut folders) = (0, Vec::new());
    // No link is followed, not even one that has taken the place of the folder itself.
    let all = WalkDir::new(older).follow_root_links(false).min_depth(1);
    for entry in all.into_iter().filter_entry(is_foreign) {
        let entry = entry.map_err(|e| NotKept::Io(older.to_owned(), e.into()))?;
        let from = entry.path();
        let to = fresh.join(from.strip_prefix(older).unwrap_or(from));
        let kind = entry.file_type();
        let made = if kind.is_dir() {
            // For nobody else as long as it is not complete.
            let made = fs::DirBuilder::new().mode(0o700).create(&to);
            made.inspect(|()| folders.push((from.to_owned(), to.clone())))
        } else if kind.is_symlink() {
            fs::read_link(from).and_then(|target| std::os::unix::fs::symlink(target, &to))
        } else if kind.is_file() {
            second_name(from, &to)
        } else {
            return Err(NotKept::Stands(from.to_owned()));
        };
        match made {
            Ok(()) => kept += 1,
            Err(e) if e.kind() == ErrorKind::AlreadyExists && again && is_second(from, &to) => {}
            Err(e) if e.kind() == ErrorKind::AlreadyExists => return Err(NotKept::Stands(from.to_owned())),
            Err(e) => return Err(NotKept::Io(from.to_owned(), e)),
        }
    }
    for (from, to) in folders.iter().rev() {
        complete(from, to).map_err(|e| NotKept::Io(from.clone(), e))?;
    }
    Ok(kept)
}

/// Whether what stands at `to` is what is kept there of `from`.
fn is_second(from: &Path, to: &Path) -> bool {
    let [Ok(a), Ok(b)] = [from, to].map(fs::symlink_metadata) else { return false };
    // Copies have another number, and size and time of their original.
    let same_file = || a.ino() == b.ino() || (a.len(), a.mtime()) == (b.len(), b.mtime());
    a.file_type() == b.file_type() && (a.is_dir() || same_file())
}

/// Gives a folder the permissions of the one that it was made after, and brings it to disk.
fn complete(from: &Path, to: &Path) -> io::Result<()> {
    let folder = regular::folder_in(CWD, to.as_os_str())?;
    folder.set_permissions(regular::permissions_of_copy(&fs::symlink_metadata(from)?))?;
    folder.sync_all()
}

fn second_name(from: &Path, to: &Path) -> io::Result<()> {
    match fs::hard_link(from, to) {
        Err(e) if e.kind() != ErrorKind::AlreadyExists => {
            let mut file = regular::open_itself(from).map_err(io::Error::other)?;
            let metadata = file.metadata()?;
            let mut copy = fs::File::options().write(true).create_new(true).mode(0o600).open(to)?;
            io::copy(&mut file, &mut copy)?;
            copy.set_modified(metadata.modified()?)?;
            copy.set_permissions(regular::permissions_of_copy(&metadata))?;
            copy.sync_all()
        }
        linked => linked,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::fs::{FileType, Mode, mknodat};
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_result_is_known_by_its_report_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |text: &str| fs::write(folder.path().join(report::FILE), text).expect("written");
        assert!(own_files(folder.path()).is_none());
        for text in [
            "",
            "{}",
            r#"{"status": "certified"}"#,
            r#"{"schema": 1, "planish": "1", "status": "fine", "outputs": []}"#,
        ] {
            write(text);
            assert!(own_files(folder.path()).is_none(), "{text}");
        }
        let output = r#"{"file": "surface.vtu", "bytes": 1, "blake3": "00"}"#;
        write(&format!(
            r#"{{"schema": 9, "planish": "7.1", "status": "certified", "outputs": [{output}], "more": 1}}"#
        ));
        let names: Vec<_> = own_files(folder.path()).expect("a result").into_iter().collect();
        assert_eq!(names, ["hooks.json", "mesh.json", "report.json", "surface.vtu"]);
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
        let own = BTreeSet::from(["ours.vtu".into()]);
        assert_eq!(keep_foreign(&older, &own, &fresh, false).expect("kept"), 5);
        assert_eq!(fs::read_to_string(fresh.join("notes/deep/a.txt")).expect("there"), "notes/deep/a.txt");
        assert_eq!(fs::read_link(fresh.join("link")).expect("a link"), Path::new("/etc"));
        assert_eq!(fs::metadata(fresh.join("notes")).expect("there").permissions().mode() & 0o777, 0o750);
        assert!(!fresh.join("ours.vtu").exists() && older.join("mine.txt").exists());
        assert!(matches!(keep_foreign(&older, &own, &fresh, false), Err(NotKept::Stands(_))), "they are there already");
        fs::write(older.join("late.txt"), "late").expect("written");
        assert_eq!(keep_foreign(&older, &own, &fresh, true).expect("kept"), 1);
        // An editor has saved it under its name meanwhile.
        fs::remove_file(older.join("mine.txt"))
            .and_then(|()| fs::write(older.join("mine.txt"), "newer"))
            .expect("written");
        assert!(matches!(keep_foreign(&older, &own, &fresh, true), Err(NotKept::Stands(_))), "it is not dropped");
        let link = place.path().join("linked");
        std::os::unix::fs::symlink(&older, &link).expect("linked");
        assert_eq!(
            keep_foreign(&link, &own, &place.path().join("fresh"), true).ok(),
            Some(0),
            "nor is a link followed"
        );
        fs::remove_file(older.join("mine.txt")).expect("removed");
        mknodat(CWD, older.join("pipe"), FileType::Fifo, Mode::RUSR, 0).expect("made");
        assert!(matches!(keep_foreign(&older, &own, &fresh, true), Err(NotKept::Stands(_))));
    }
}
