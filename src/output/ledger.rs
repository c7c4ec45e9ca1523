//! The ledger: which inputs are done. There is no other one than the published reports.

use crate::input::{Folder as Siblings, read_file};
use crate::outcome::{Code, Reason, Status};
use crate::output::listed;
use crate::report::{Input, Output, RefusedComponent, Report, SCHEMA, VERSION};
use crate::result_files;
use crate::settings::Settings;
use crate::system::disk::{Disk, File, Folder, System};
use crate::system::safe_open::{self, OpenError};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use walkdir::{DirEntry, WalkDir};

/// The report published in `folder`, if it is that of this version, of an `input` of the same content with the same
/// `settings`, and of the files `beside` it, and its files are there, unharmed. A failure is none: another version may do
/// better, or another day; but planish does not die twice of the same. Nor is a refusal for a limit, which may have been
/// raised since.
pub fn up_to_date(folder: &Path, input: &Input, settings: &Settings, beside: &Siblings) -> Option<Report> {
    up_to_date_in(&System.open(folder).ok()?, input, settings, beside)
}

/// As [`up_to_date`], in an open folder.
pub fn up_to_date_in<F: Folder>(folder: &F, input: &Input, settings: &Settings, beside: &Siblings) -> Option<Report> {
    let file = folder.follow_file(result_files::REPORT).ok()?;
    let text = safe_open::read(&file, u64::MAX).ok()?;
    let older: Report = serde_json::from_slice(&text).ok()?;
    let is_of_same_input = is_of(&older, input, beside);
    let is_of_same_settings = older.settings == settings.into();
    let is_of_this_version = (older.schema, older.planish.as_str()) == (SCHEMA, VERSION);
    // What is certified has files beside its report, and nothing else has.
    let is_complete = (older.status == Status::Certified) != older.outputs.is_empty();
    let may_stand = is_of_same_input && is_of_same_settings && is_of_this_version && is_final(&older) && is_complete;
    // Last, as all files are read for it.
    let is_unharmed = may_stand && older.outputs.iter().all(|output| holds_in(folder, output).unwrap_or(false));
    is_unharmed.then_some(older)
}

/// Whether a report is of an input of this known content, and of the files that lie beside it now.
fn is_of(older: &Report, input: &Input, beside: &Siblings) -> bool {
    // The same content names the same files beside it: what it named then is compared with what they are now.
    Input { beside: vec![], ..older.input.clone() } == *input
        && input.blake3.is_some()
        && older.input.beside.iter().all(|read| beside.still_has(read))
}

/// Whether doing the same input again would be in vain, as far as is known.
pub fn is_final(report: &Report) -> bool {
    match report.reason.as_ref().map(|reason| reason.code) {
        Some(Code::Crashed) => true,
        Some(Code::TooLarge | Code::JobMemory | Code::JobTime) => false,
        _ => report.status != Status::Failed,
    }
}

/// Whether `folder` holds this file as it was published. One of another size is not read.
///
/// # Errors
/// Why it cannot be read.
pub fn holds(folder: &Path, output: &Output) -> Result<bool, OpenError> {
    holds_in(&System.open(folder)?, output)
}

fn holds_in<F: Folder>(folder: &F, output: &Output) -> Result<bool, OpenError> {
    let file = listed::open_file(folder, &output.file)?;
    if file.stat()?.bytes != output.bytes {
        return Ok(false);
    }
    match safe_open::read(&file, output.bytes) {
        Ok(content) => Ok(Output::of(&output.file, &content) == *output),
        Err(OpenError::TooLarge { .. }) => Ok(false),
        Err(error) => Err(error),
    }
}

/// What a report says, in short.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Entry {
    /// How the input ended.
    pub status: Status,
    /// Why, where it is not certified.
    pub reason: Option<Reason>,
    /// Components that are not in the result, where it is.
    #[serde(default)]
    pub refused_components: Vec<RefusedComponent>,
}

/// All results in the output folder `out`: their names and what their reports say, in the order of names.
pub fn entries(out: &Path) -> impl Iterator<Item = (PathBuf, Entry)> {
    let is_hidden = |e: &DirEntry| e.depth() > 0 && e.file_name().to_string_lossy().starts_with('.');
    let mut folders = WalkDir::new(out).sort_by_file_name().into_iter();
    let out = out.to_owned();
    std::iter::from_fn(move || {
        // Ends where the folder does.
        loop {
            // What cannot be looked at is passed over.
            let Ok(found) = folders.next()? else { continue };
            if is_hidden(&found) && found.file_type().is_dir() {
                folders.skip_current_dir();
            } else if found.file_name() == result_files::REPORT && found.file_type().is_file() {
                folders.skip_current_dir();
                let entry = read_file(found.path()).ok().and_then(|text| serde_json::from_slice(&text).ok());
                let name = found.path().parent().and_then(|p| p.strip_prefix(&out).ok()).map(Path::to_owned);
                if let Some(pair) = name.zip(entry) {
                    return Some(pair);
                }
            }
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_has_grown_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder");
        let output = Output::of("a.vtu", b"content");
        assert!(holds(folder.path(), &output).is_err(), "it is missing");
        std::fs::write(folder.path().join("a.vtu"), "content").expect("written");
        assert!(holds(folder.path(), &output).expect("there"));
        // No memory holds this.
        let grown = std::fs::File::create(folder.path().join("a.vtu")).expect("made");
        grown.set_len(1 << 42).expect("sparse");
        assert!(!holds(folder.path(), &output).expect("there"));
    }

    #[test]
    fn all_results_are_found_and_nothing_else() {
        let out = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| {
            let folder = out.path().join(name);
            std::fs::create_dir_all(&folder).expect("made");
            std::fs::write(folder.join(result_files::REPORT), text).expect("written");
        };
        write("b.stl", r#"{"status": "certified", "reason": null, "more": [1]}"#);
        let reason = r#"{"code": "empty_file", "message": "m", "where": null}"#;
        write("a/c.stl", &format!(r#"{{"status": "refused", "reason": {reason}}}"#));
        write(".planish/run-1/d.stl", r#"{"status": "certified", "reason": null}"#);
        write("broken.stl", "{");
        #[cfg(unix)]
        {
            use rustix::fs::{CWD, FileType, Mode, mknodat};
            let pipe = out.path().join("pipe.stl");
            std::fs::create_dir(&pipe).expect("made");
            mknodat(CWD, pipe.join(result_files::REPORT), FileType::Fifo, Mode::RUSR, 0).expect("made");
        }
        let found: Vec<_> = entries(out.path()).map(|(name, e)| (name.display().to_string(), e.status)).collect();
        assert_eq!(found, [("a/c.stl".to_owned(), Status::Refused), ("b.stl".to_owned(), Status::Certified)]);
    }
}
