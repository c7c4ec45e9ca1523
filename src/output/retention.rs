//! Removing results whose time is over.
//!
//! A result goes when its report is older than the settings say, and its input is not in the inbox, nor on its way. Only
//! what planish wrote goes ([`crate::output::withdraw`]). The output folder is gone through bit by bit, so that nothing else waits
//! for that; once an hour. Whoever puts an input back into the inbox in the very moment in which its result is removed has
//! it done again.
//!
//! Nothing is removed while the inbox is not there: that it is unmounted says nothing about inputs. Where an empty folder
//! takes its place then, nobody can know that: `RequiresMountsFor=` of the service is for that.

use crate::output::begun;
use crate::output::withdraw::Standing;
use crate::result_files;
use crate::system::escape::escape;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
use walkdir::{DirEntry, FilterEntry, IntoIter, WalkDir};

/// How often the output folder is gone through. Ages are told in days: nobody notices an hour.
const PERIOD: Duration = Duration::from_secs(3600);

/// So many files and folders at most are looked at in one go: the daemon's own thread does it, and hears nothing meanwhile.
const STEP: usize = 500;

type Walk = FilterEntry<IntoIter, fn(&DirEntry) -> bool>;

/// Goes through an output folder.
#[derive(Debug)]
pub struct Retention {
    out: PathBuf,
    walk: Option<Walk>,
    next: Instant,
}

impl Retention {
    /// Of the results in `out`. The first round begins at once.
    pub fn new(out: &Path) -> Self {
        Self { out: out.to_owned(), walk: None, next: Instant::now() }
    }

    /// Goes on by a step, and removes what is older than `kept`, unless its input lies in `inbox` or is on its way.
    pub fn step(&mut self, now: Instant, kept: Duration, inbox: &Path, is_on_its_way: impl Fn(&Path) -> bool) {
        if self.walk.is_none() && now < self.next {
            return;
        }
        let walk = self.walk.get_or_insert_with(|| results(&self.out));
        let found: Vec<_> = walk.by_ref().take(STEP).collect();
        if found.len() < STEP {
            self.walk = None;
            self.next = now + PERIOD;
        }
        for entry in found.into_iter().flatten().filter(|entry| entry.file_name() == result_files::REPORT) {
            let name = entry.path().parent().and_then(|folder| folder.strip_prefix(&self.out).ok());
            if let Some(name) = name.filter(|_| is_old(&entry, kept))
                && !is_on_its_way(name)
                && is_gone(&inbox.join(name))
            {
                remove(&self.out, name);
            }
        }
    }
}

/// All that lies in an output folder and is not hidden. No link is followed.
fn results(out: &Path) -> Walk {
    let is_open: fn(&DirEntry) -> bool = |e| e.depth() == 0 || !e.file_name().to_string_lossy().starts_with('.');
    WalkDir::new(out).into_iter().filter_entry(is_open)
}

/// Whether a report is older than this. One from the future is not.
fn is_old(report: &DirEntry, kept: Duration) -> bool {
    let metadata = report.metadata().ok().filter(|metadata| metadata.is_file());
    let modified = metadata.and_then(|metadata| metadata.modified().ok());
    modified.and_then(|then| SystemTime::now().duration_since(then).ok()).is_some_and(|age| age > kept)
}

/// Whether nothing is there, for sure.
fn is_gone(path: &Path) -> bool {
    path.symlink_metadata().is_err_and(|error| error.kind() == ErrorKind::NotFound)
}

fn remove(out: &Path, name: &Path) {
    let Ok(standing) = Standing::find(out, name) else { return };
    let result = escape(name);
    match standing.remove() {
        Ok(true) => {
            // Who comes back is innocent.
            begun::forgive(out, name);
            tracing::info!(result, "removed: its time is over, and its input has left the inbox");
        }
        Ok(false) => tracing::warn!(
            result,
            "its time is over, and its input has left the inbox: what planish wrote is removed, and what others put \
             there stays"
        ),
        Err(error) => tracing::warn!(result, "its time is over, but it cannot be removed: {error}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    const DAY: Duration = Duration::from_secs(86_400);

    struct Place {
        folder: tempfile::TempDir,
    }

    impl Place {
        fn new() -> Self {
            let folder = tempfile::tempdir().expect("a folder");
            ["in", "out"].iter().for_each(|name| fs::create_dir(folder.path().join(name)).expect("made"));
            Self { folder }
        }

        fn at(&self, name: &str) -> PathBuf {
            self.folder.path().join(name)
        }

        /// A result that is so old.
        fn result(&self, name: &str, age: Duration) {
            let folder = self.at("out").join(name);
            fs::create_dir_all(&folder).expect("made");
            let report = r#"{"schema": 1, "planish": "1", "status": "refused", "outputs": []}"#;
            fs::write(folder.join(result_files::REPORT), report).expect("written");
            let file = fs::File::options().write(true).open(folder.join(result_files::REPORT)).expect("there");
            file.set_modified(SystemTime::now() - age).expect("set");
        }

        fn left(&self, kept: Duration, on_its_way: &str) -> Vec<String> {
            let mut retention = Retention::new(&self.at("out"));
            retention.step(Instant::now(), kept, &self.at("in"), |name| name == Path::new(on_its_way));
            assert!(retention.walk.is_none(), "one step is enough here");
            let names = fs::read_dir(self.at("out")).expect("there").flatten();
            let mut names: Vec<_> = names.map(|e| e.file_name().display().to_string()).collect();
            names.sort();
            names
        }
    }

    #[test]
    fn old_results_go_and_those_whose_input_is_there_or_on_its_way_stay() {
        let place = Place::new();
        let all = [("old.stl", 3), ("young.stl", 1), ("there.stl", 9), ("running.stl", 9), (".hidden", 9)];
        all.iter().for_each(|(name, days)| place.result(name, *days * DAY));
        fs::write(place.at("in/there.stl"), "").expect("written");
        assert_eq!(place.left(10 * DAY, "running.stl").len(), 5, "none is as old as that");
        assert_eq!(place.left(2 * DAY, "running.stl"), [".hidden", "running.stl", "there.stl", "young.stl"]);
    }

    #[test]
    fn what_others_wrote_stays_and_links_are_not_followed() {
        let place = Place::new();
        place.result("mixed.stl", 9 * DAY);
        fs::write(place.at("out/mixed.stl/notes.txt"), "mine").expect("written");
        fs::create_dir(place.at("out/foreign.stl")).expect("made");
        fs::write(place.at("out/foreign.stl/report.json"), "{}").expect("written");
        place.result("elsewhere.stl", 9 * DAY);
        fs::rename(place.at("out/elsewhere.stl"), place.at("elsewhere.stl")).expect("moved");
        std::os::unix::fs::symlink(place.at("elsewhere.stl"), place.at("out/elsewhere.stl")).expect("linked");
        assert_eq!(place.left(Duration::ZERO, ""), ["elsewhere.stl", "foreign.stl", "mixed.stl"]);
        assert!(place.at("elsewhere.stl/report.json").exists() && place.at("out/mixed.stl/notes.txt").exists());
        assert!(!place.at("out/mixed.stl/report.json").exists());
    }
}
