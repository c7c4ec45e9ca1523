//! `planish watch --check-config`: would the daemon start?
//!
//! All that a start looks at is looked at, and the programs of commands are looked for; nothing is written or made. So it
//! is only asked whether folders may be written, and not tried: a disk that is full, or a file system without the
//! permissions that planish needs, shows at the start.

use super::watch::{destinations, no_inbox, refuse_metrics, refuse_nested, takes_inputs_out};
use super::{Exit, eprint_line, escape, say};
use crate::output::publish::STAGING;
use crate::settings::{Hook, Settings};
use rustix::fs::{Access, access};
use std::path::{Path, PathBuf};

/// Says all that is wrong.
pub fn check_config(inbox: &Path, out: &Path, settings: &Settings) -> Exit {
    let problems = problems(inbox, out, settings);
    problems.iter().for_each(|problem| eprint_line(problem));
    if !problems.is_empty() {
        return Exit::Usage;
    }
    if !settings.quiet {
        say("settings, commands and folders are good");
    }
    Exit::Success
}

/// What would keep the daemon from starting, or from doing what the settings say.
fn problems(inbox: &Path, out: &Path, settings: &Settings) -> Vec<String> {
    let mut problems = Vec::new();
    match std::fs::read_dir(inbox) {
        Err(error) => problems.push(no_inbox(inbox, &error)),
        Ok(_) if takes_inputs_out(settings) && !may_be_written(inbox) => {
            problems.push(format!("inputs cannot leave the inbox {}: it may not be written", escape(inbox)));
        }
        Ok(_) => {}
    }
    problems.extend(refuse_nested(inbox, out, settings).err().map(|error| error.to_string()));
    problems.extend(refuse_metrics(settings).err());
    let folders = [("output folder", out)].into_iter().chain(destinations(settings));
    problems.extend(folders.filter_map(|(role, folder)| unwritable(role, folder)));
    problems.extend(no_staging(out));
    problems.extend(settings.on_certified.iter().chain(&settings.on_refused).filter_map(missing_program));
    problems
}

fn may_be_written(folder: &Path) -> bool {
    folder.is_dir() && access(folder, Access::WRITE_OK | Access::EXEC_OK).is_ok()
}

/// Why a folder cannot be written, or made where it is not there.
fn unwritable(role: &str, folder: &Path) -> Option<String> {
    let absolute = std::path::absolute(folder).ok()?;
    // What a link leads to that leads nowhere cannot be made, either.
    let there = absolute.ancestors().find(|path| path.symlink_metadata().is_ok())?;
    if may_be_written(there) {
        return None;
    }
    let why = if there.is_dir() { "may not be written" } else { "is no folder" };
    Some(format!("the {role} {} cannot be used: {} {why}", escape(folder), escape(there)))
}

/// Why planish cannot keep what it needs in the output folder.
fn no_staging(out: &Path) -> Option<String> {
    let staging = out.join(STAGING);
    let there = staging.symlink_metadata().ok()?;
    let is_good = there.is_dir() && may_be_written(&staging);
    (!is_good).then(|| format!("{} is no folder that planish may write", escape(&staging)))
}

/// What is said of a command whose program is not to be found. One that depends on the result is not looked for.
fn missing_program(command: &Hook) -> Option<String> {
    let program = command.configured().command.first().filter(|program| !program.contains(['{', '}']))?;
    (!is_found(Path::new(program))).then(|| format!("a command cannot run: there is no program {program}"))
}

/// Whether there is such a program, on the PATH where only its name is given.
fn is_found(program: &Path) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders = std::env::split_paths(&path).chain([PathBuf::from("/")]);
    let mut candidates = folders.map(|folder| folder.join(program));
    candidates.any(|file| file.is_file() && access(&file, Access::EXEC_OK).is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::RawSettings;
    use std::fs;

    struct Place {
        folder: tempfile::TempDir,
    }

    impl Place {
        fn at(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        /// What is wrong with this file of settings, in which @ stands for this folder.
        fn problems(&self, out: &str, toml: &str) -> Vec<String> {
            let toml = toml.replace('@', self.folder.path().to_str().expect("UTF-8"));
            let settings = toml::from_str::<RawSettings>(&toml).expect("well-formed").check().expect("in range");
            problems(&self.at("in"), &self.at(out), &settings)
        }
    }

    #[test]
    fn everything_that_a_start_needs_is_looked_at_and_nothing_is_made() {
        let place = Place { folder: tempfile::tempdir().expect("a folder") };
        assert!(place.problems("out", "")[0].contains("make the folder first"));
        fs::create_dir(place.at("in")).and_then(|()| fs::write(place.at("file"), "")).expect("made");
        fs::create_dir(place.at("linked")).expect("made");
        std::os::unix::fs::symlink("/", place.at("linked/.planish")).expect("linked");
        let good = "inputs = \"move:@/new/done\"\nmetrics = \"@/a.prom\"\n\
                    [[on_certified]]\ncommand = [\"sh\"]\n[[on_refused]]\ncommand = [\"{folder}/x\"]";
        for (out, toml) in [("out", ""), ("new/out", good)] {
            assert_eq!(place.problems(out, toml), [""; 0], "{toml}");
        }
        for (out, toml, expected) in [
            ("in/out", "", "lie in each other"),
            ("file", "", "is no folder"),
            ("file/out", "", "is no folder"),
            ("linked", "", ".planish is no folder that planish may write"),
            ("out", "refused = \"move:@/file/done\"", "the folder for refused inputs"),
            ("out", "metrics = \"@/in/a.prom\"", "the file of metrics"),
            ("out", "metrics = \"@/missing/a.prom\"", "a file in a folder that is there"),
            ("out", "[[on_certified]]\ncommand = [\"no-such-program\"]", "there is no program no-such-program"),
            ("out", "[[on_refused]]\ncommand = [\"@/file\"]", "there is no program"),
        ] {
            let problems = place.problems(out, toml);
            assert!(problems.iter().any(|p| p.contains(expected)), "{out} {toml}: {problems:?}");
        }
        let left: Vec<_> = fs::read_dir(place.folder.path()).expect("there").collect();
        assert_eq!(left.len(), 3);
    }
}
