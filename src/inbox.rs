//! Which files of an inbox are to be processed, from one look at the folder after another. No disk and no clock here:
//! [`crate::watch`] has these.
//!
//! A file is *settled*, and becomes a job, when two looks at least [`SETTLE`] apart, and all between, show the same. A
//! file that changes or goes while its job waits or runs withdraws the job; when it has settled again, it becomes a new
//! one. Every state of a file becomes at most one job.

use crate::look::Look;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a file must stay as it is. Copies over slow networks pause for less, and nobody waits long.
pub const SETTLE: Duration = Duration::from_millis(1000);

/// What a look at the folder shows: relative paths of all files that may hold a mesh.
pub type Listing = BTreeMap<PathBuf, Seen>;

/// What is seen of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The file itself.
    pub look: Look,
    /// The files beside it that it is known to ask for; none where one is missing.
    pub beside: Vec<Option<Look>>,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A file has settled: it becomes a job. It is as it is since then.
    Settled(PathBuf, Look, Instant),
    /// The job of a file has lost its sense: the file changed, or is gone.
    Withdrawn(PathBuf),
}

/// The files of an inbox.
#[derive(Debug, Default)]
pub struct Inbox {
    files: BTreeMap<PathBuf, File>,
}

#[derive(Debug)]
struct File {
    seen: Seen,
    since: Instant,
    state: State,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// As it is since then.
    Changing(Instant),
    /// A job.
    Submitted,
    /// Done with.
    Done,
}

impl Inbox {
    /// Takes in what a look at `now` shows; tells what is to be done.
    pub fn look(&mut self, listing: &Listing, now: Instant) -> Vec<Change> {
        let mut changes = Vec::new();
        self.files.retain(|name, file| {
            let there = listing.contains_key(name);
            if !there && file.state == State::Submitted {
                changes.push(Change::Withdrawn(name.clone()));
            }
            there
        });
        for (name, seen) in listing {
            let changing = || File { seen: seen.clone(), since: now, state: State::Changing(now) };
            let file = self.files.entry(name.clone()).or_insert_with(changing);
            if file.seen != *seen {
                if file.state == State::Submitted {
                    changes.push(Change::Withdrawn(name.clone()));
                }
                *file = changing();
            } else if let State::Changing(since) = file.state
                && now.saturating_duration_since(since) >= SETTLE
            {
                file.state = State::Submitted;
                changes.push(Change::Settled(name.clone(), seen.look, file.since));
            }
        }
        changes
    }

    /// The job for this state of a file has ended, and the file is done with.
    pub fn done(&mut self, name: &Path, look: &Look) {
        if let Some(file) = self.submitted(name, look) {
            file.state = State::Done;
        }
    }

    /// The job for this state of a file has ended, but is to be done again, not before `then`.
    pub fn again(&mut self, name: &Path, look: &Look, then: Instant) {
        if let Some(file) = self.submitted(name, look) {
            file.state = State::Changing(then.checked_sub(SETTLE).unwrap_or(then));
        }
    }

    fn submitted(&mut self, name: &Path, look: &Look) -> Option<&mut File> {
        self.files.get_mut(name).filter(|file| file.seen.look == *look && file.state == State::Submitted)
    }

    /// When the next file may have settled.
    pub fn due(&self) -> Option<Instant> {
        let since = |file: &File| if let State::Changing(since) = file.state { Some(since + SETTLE) } else { None };
        self.files.values().filter_map(since).min()
    }

    /// How many files have not settled yet.
    pub fn unsettled(&self) -> usize {
        self.files.values().filter(|file| matches!(file.state, State::Changing(_))).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at files of these sizes, made for the test.
    fn listing(files: &[(&str, usize)]) -> Listing {
        let folder = tempfile::tempdir().expect("a folder");
        let look = |(name, size): &(&str, usize)| {
            let path = folder.path().join(name);
            std::fs::write(&path, vec![b'x'; *size]).expect("written");
            let look = Look::at(&path).expect("there").expect("a file");
            (PathBuf::from(name), Seen { look, beside: vec![] })
        };
        files.iter().map(look).collect()
    }

    fn settled(changes: &[Change]) -> Vec<&str> {
        let name = |c: &Change| match c {
            Change::Settled(name, ..) => Some(name.to_str().expect("UTF-8").to_owned().leak() as &str),
            Change::Withdrawn(_) => None,
        };
        changes.iter().filter_map(name).collect()
    }

    #[test]
    fn a_file_becomes_a_job_once_when_it_has_settled() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let files = listing(&[("a.stl", 1), ("b.stl", 2)]);
        assert!(inbox.look(&files, start).is_empty());
        assert!(inbox.look(&files, start + SETTLE / 2).is_empty());
        assert_eq!(inbox.due(), Some(start + SETTLE));
        assert_eq!(settled(&inbox.look(&files, start + SETTLE)), ["a.stl", "b.stl"]);
        assert!(inbox.look(&files, start + 2 * SETTLE).is_empty());
        let a = files[Path::new("a.stl")].look;
        inbox.done(Path::new("a.stl"), &a);
        assert!(inbox.look(&files, start + 9 * SETTLE).is_empty());
        assert_eq!(inbox.due(), None);
    }

    #[test]
    fn a_slow_copy_settles_only_at_its_end() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        for step in 0..10 {
            let changes = inbox.look(&listing(&[("a.stl", step)]), start + SETTLE * step as u32);
            assert!(changes.is_empty(), "{changes:?}");
        }
    }

    #[test]
    fn change_and_removal_withdraw_a_job_and_newer_content_becomes_a_new_one() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let (old, new) = (listing(&[("a.stl", 1)]), listing(&[("a.stl", 2)]));
        inbox.look(&old, start);
        inbox.look(&old, start + SETTLE);
        let withdrawn = [Change::Withdrawn("a.stl".into())];
        assert_eq!(inbox.look(&new, start + 2 * SETTLE), withdrawn);
        // The end of the withdrawn job says nothing about the newer content.
        inbox.done(Path::new("a.stl"), &old[Path::new("a.stl")].look);
        assert_eq!(settled(&inbox.look(&new, start + 3 * SETTLE)), ["a.stl"]);
        assert_eq!(inbox.look(&Listing::new(), start + 4 * SETTLE), withdrawn);
        assert_eq!(inbox.unsettled(), 0);
        inbox.look(&new, start + 5 * SETTLE);
        assert_eq!(settled(&inbox.look(&new, start + 6 * SETTLE)), ["a.stl"], "it came back");
    }

    #[test]
    fn what_is_to_be_done_again_waits() {
        let (mut inbox, start) = (Inbox::default(), Instant::now() + 10 * SETTLE);
        let files = listing(&[("a.stl", 1)]);
        inbox.look(&files, start);
        inbox.look(&files, start + SETTLE);
        inbox.again(Path::new("a.stl"), &files[Path::new("a.stl")].look, start + 5 * SETTLE);
        assert!(inbox.look(&files, start + 4 * SETTLE).is_empty());
        assert_eq!(settled(&inbox.look(&files, start + 5 * SETTLE)), ["a.stl"]);
    }
}
