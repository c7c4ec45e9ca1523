//! Which files of an inbox are to be processed, from one look at the folder after another. No disk and no clock here:
//! [`crate::watch::watcher`] has these.
//!
//! A file is *settled*, and becomes a job, when two looks at least [`SETTLE`] apart, and all between, show the same. A
//! file that changes or goes while its job waits or runs withdraws the job; when it has settled again, it becomes a new
//! one. Every state of a file becomes at most one job.

use crate::system::fingerprint::Fingerprint;
use crate::system::passing;
use blake3::Hash;
use std::collections::BTreeMap;
use std::ops::Bound;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a file must stay as it is. Copies over slow networks pause for less, and nobody waits long.
pub const SETTLE: Duration = Duration::from_millis(1000);

/// What a look at the folder shows: relative paths of all files that may hold a mesh.
pub type Snapshot = BTreeMap<PathBuf, Seen>;

/// What is seen of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The file itself.
    pub look: Fingerprint,
    /// The files beside it that it is known to ask for; none where one is missing.
    pub beside: Vec<Option<Fingerprint>>,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// A file has settled: it becomes a job. It is as it is since then.
    Settled(PathBuf, Fingerprint, Instant),
    /// The job of a file has lost its sense: the file changed, or is gone.
    Withdrawn(PathBuf),
    /// A file that is done with is to be read once more: somebody may have written to it without a trace.
    Doubted(PathBuf, Fingerprint, Hash),
}

/// What became of a file that is done with, until it changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Rest {
    /// Its result stands.
    Published,
    /// Its result was there, and was taken away on purpose.
    Delivered,
    /// It waits for files beside it, which are part of what is seen of it.
    Waits(String),
    /// Its result cannot be put in its place.
    Aside(String),
}

/// When the content of a file that is done with is to be looked at once more, and its hash.
pub type Doubt = (Instant, Hash);

/// The files of an inbox.
#[derive(Debug, Default)]
pub struct Inbox {
    files: BTreeMap<PathBuf, File>,
    /// Behind this name the next results are looked for.
    looked_for: PathBuf,
}

#[derive(Debug)]
struct File {
    seen: Seen,
    since: Instant,
    /// Since when it has been on its way to a result, with all changes.
    restless: Instant,
    /// How often in a row it could not be done for reasons that pass.
    failures: u32,
    state: State,
    is_warned_of: bool,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum State {
    /// As it is since then.
    Changing(Instant),
    /// To be a job, not before then.
    Later(Instant, String),
    /// A job.
    Submitted,
    /// Done with; if it is to be doubted, not before then.
    Done(Rest, Option<Doubt>),
}

/// The states of files that are not done with, or not as they should be, in a word.
pub const STATES: [&str; 4] = [UNSETTLED, LATER, WAITS, ASIDE];

/// It changes still.
pub const UNSETTLED: &str = "unsettled";

/// It is tried again later.
const LATER: &str = "later";

/// It waits for files beside it.
const WAITS: &str = "waits";

/// Its result cannot be put in its place.
const ASIDE: &str = "aside";

/// A file that is not done with, or not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notable<'a> {
    /// Its path below the inbox.
    pub name: &'a Path,
    /// One of [`STATES`].
    pub state: &'static str,
    /// Why.
    pub reason: &'a str,
    /// Since when.
    pub since: Instant,
}

impl File {
    fn new(seen: Seen, now: Instant) -> Self {
        let state = State::Changing(now);
        Self { seen, since: now, restless: now, failures: 0, state, is_warned_of: false }
    }

    /// The same file with newer content.
    fn changed(&self, seen: Seen, now: Instant) -> Self {
        let is_restless = !matches!(self.state, State::Done(Rest::Published | Rest::Delivered, _));
        let restless = if is_restless { self.restless } else { now };
        Self { restless, is_warned_of: self.is_warned_of && is_restless, ..Self::new(seen, now) }
    }

    /// When something is to be done about it, if nothing changes.
    fn due(&self) -> Option<Instant> {
        match &self.state {
            State::Changing(since) => Some(*since + SETTLE),
            State::Later(then, _) => Some(*then),
            State::Done(_, doubt) => doubt.map(|(then, _)| then),
            State::Submitted => None,
        }
    }

    fn notable<'a>(&'a self, name: &'a Path) -> Option<Notable<'a>> {
        let (state, reason) = match &self.state {
            State::Changing(_) => (UNSETTLED, "it changes still"),
            State::Later(_, reason) => (LATER, &reason[..]),
            State::Done(Rest::Waits(reason), _) => (WAITS, &reason[..]),
            State::Done(Rest::Aside(reason), _) => (ASIDE, &reason[..]),
            State::Submitted | State::Done(Rest::Published | Rest::Delivered, _) => return None,
        };
        Some(Notable { name, state, reason, since: self.restless })
    }
}

impl Inbox {
    /// Takes in what a look at `now` shows; tells what is to be done.
    ///
    /// ```
    /// use planish::system::fingerprint::Fingerprint;
    /// use planish::watch::inbox::{Change, Inbox, SETTLE, Seen, Snapshot};
    /// use std::time::Instant;
    ///
    /// # fn main() -> std::io::Result<()> {
    /// # let file = tempfile::NamedTempFile::new()?;
    /// let look = Fingerprint::at(file.path())?.expect("a regular file");
    /// let snapshot = Snapshot::from([("part.stl".into(), Seen { look, beside: vec![] })]);
    /// let (mut inbox, begin) = (Inbox::default(), Instant::now());
    /// assert_eq!(inbox.look(&snapshot, begin), []);
    /// let settled = Change::Settled("part.stl".into(), look, begin);
    /// assert_eq!(inbox.look(&snapshot, begin + SETTLE), [settled]);
    /// // It goes while its job waits or runs.
    /// assert_eq!(inbox.look(&Snapshot::new(), begin + SETTLE), [Change::Withdrawn("part.stl".into())]);
    /// # Ok(())
    /// # }
    /// ```
    pub fn look(&mut self, snapshot: &Snapshot, now: Instant) -> Vec<Change> {
        let mut changes = Vec::new();
        self.files.retain(|name, file| {
            let there = snapshot.contains_key(name);
            if !there && file.state == State::Submitted {
                changes.push(Change::Withdrawn(name.clone()));
            }
            there
        });
        for (name, seen) in snapshot {
            let file = self.files.entry(name.clone()).or_insert_with(|| File::new(seen.clone(), now));
            if file.seen != *seen {
                if file.state == State::Submitted {
                    changes.push(Change::Withdrawn(name.clone()));
                }
                *file = file.changed(seen.clone(), now);
            } else if file.due().is_some_and(|due| now >= due) {
                changes.push(match std::mem::replace(&mut file.state, State::Submitted) {
                    State::Done(_, Some((_, hash))) => Change::Doubted(name.clone(), seen.look, hash),
                    _ => Change::Settled(name.clone(), seen.look, file.since),
                });
            }
        }
        changes
    }

    /// The job for this state of a file has ended, and the file is done with; it is doubted once, not before `doubt`.
    pub fn done(&mut self, name: &Path, look: &Fingerprint, rest: Rest, doubt: Option<Doubt>) {
        if let Some(file) = self.submitted(name, look) {
            file.state = State::Done(rest, doubt);
            file.failures = 0;
        }
    }

    /// The job for this state of a file has ended, but is to be done again, not before `then`.
    pub fn again(&mut self, name: &Path, look: &Fingerprint, then: Instant, why: &str) {
        if let Some(file) = self.submitted(name, look) {
            file.state = State::Later(then, why.to_owned());
        }
    }

    /// The job for this state of a file could not be done, for a reason that passes: it is done again, the later, the more
    /// often that happened in a row; how often that was.
    pub fn failed(&mut self, name: &Path, look: &Fingerprint, now: Instant, why: &str) -> u32 {
        let Some(file) = self.submitted(name, look) else { return 0 };
        file.failures = file.failures.saturating_add(1);
        file.state = State::Later(now + passing::pause(file.failures), why.to_owned());
        file.failures
    }

    /// The file, if the job for this state of it is the one that is on its way.
    fn submitted(&mut self, name: &Path, look: &Fingerprint) -> Option<&mut File> {
        // Where the file has changed since, its older job says nothing about it.
        self.files.get_mut(name).filter(|file| file.seen.look == *look && file.state == State::Submitted)
    }

    /// The next `count` files whose results should stand, after those that were named the last time.
    pub fn published(&mut self, count: usize) -> Vec<PathBuf> {
        let behind = (Bound::Excluded(self.looked_for.clone()), Bound::Unbounded);
        let mut next = Vec::new();
        for (name, file) in self.files.range(behind) {
            if next.len() == count {
                break;
            }
            if matches!(file.state, State::Done(Rest::Published, _)) {
                next.push(name.clone());
            }
        }
        // Fewer than asked for: that was the last of them, and it begins again before the first name.
        let is_at_end = next.len() < count;
        self.looked_for = if is_at_end { PathBuf::new() } else { next.last().cloned().unwrap_or_default() };
        next
    }

    /// The result of a file is gone: the file is done again.
    pub fn forget(&mut self, name: &Path, now: Instant) {
        if let Some(file) = self.files.get_mut(name).filter(|file| matches!(file.state, State::Done(..))) {
            *file = File::new(file.seen.clone(), now);
        }
    }

    /// All files are looked at anew, as if they had just come: what is up to date is found to be so. What was delivered is
    /// not: its result was taken away on purpose.
    pub fn forget_all(&mut self, now: Instant) {
        for file in self.files.values_mut() {
            // A job that runs tells by itself what became of its file.
            if !matches!(file.state, State::Submitted | State::Done(Rest::Delivered, _)) {
                *file = File::new(file.seen.clone(), now);
            }
        }
    }

    /// When something is to be done next, if nothing changes.
    pub fn due(&self) -> Option<Instant> {
        self.files.values().filter_map(File::due).min()
    }

    /// The files that are not done with and no jobs, and those that are not as they should be, in the order of names.
    pub fn notable(&self) -> impl Iterator<Item = Notable<'_>> {
        self.files.iter().filter_map(|(name, file)| file.notable(name))
    }

    /// Since when the file has waited that has waited the longest for its result, jobs included.
    pub fn oldest(&self) -> Option<Instant> {
        let on_their_way =
            self.files.values().filter(|file| !matches!(file.state, State::Done(Rest::Published | Rest::Delivered, _)));
        on_their_way.map(|file| file.restless).min()
    }

    /// The files that have been notable for as long as this, each once.
    pub fn overdue(&mut self, now: Instant, patience: Duration) -> Vec<Notable<'_>> {
        let mut overdue = Vec::new();
        for (name, file) in &mut self.files {
            let is_late = !file.is_warned_of && now.saturating_duration_since(file.restless) >= patience;
            if is_late && file.notable(name).is_some() {
                file.is_warned_of = true;
                overdue.extend(file.notable(name));
            }
        }
        overdue
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks at files of these sizes, made for the test.
    fn snapshot(files: &[(&str, usize)]) -> Snapshot {
        let folder = tempfile::tempdir().expect("a folder");
        let look = |(name, size): &(&str, usize)| {
            let path = folder.path().join(name);
            std::fs::write(&path, vec![b'x'; *size]).expect("written");
            let look = Fingerprint::at(&path).expect("there").expect("a file");
            (PathBuf::from(name), Seen { look, beside: vec![] })
        };
        files.iter().map(look).collect()
    }

    fn settled(changes: &[Change]) -> Vec<&str> {
        let name = |c: &Change| match c {
            Change::Settled(name, ..) => Some(name.to_str().expect("UTF-8").to_owned().leak() as &str),
            Change::Withdrawn(_) | Change::Doubted(..) => None,
        };
        changes.iter().filter_map(name).collect()
    }

    #[test]
    fn a_file_becomes_a_job_once_when_it_has_settled() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let files = snapshot(&[("a.stl", 1), ("b.stl", 2)]);
        assert!(inbox.look(&files, start).is_empty());
        assert!(inbox.look(&files, start + SETTLE / 2).is_empty());
        assert_eq!(inbox.due(), Some(start + SETTLE));
        assert_eq!(settled(&inbox.look(&files, start + SETTLE)), ["a.stl", "b.stl"]);
        assert!(inbox.look(&files, start + 2 * SETTLE).is_empty());
        let a = files[Path::new("a.stl")].look;
        inbox.done(Path::new("a.stl"), &a, Rest::Published, None);
        assert!(inbox.look(&files, start + 9 * SETTLE).is_empty());
        assert_eq!(inbox.due(), None);
    }

    #[test]
    fn a_slow_copy_settles_only_at_its_end() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        for step in 0..10 {
            let changes = inbox.look(&snapshot(&[("a.stl", step)]), start + SETTLE * step as u32);
            assert!(changes.is_empty(), "{changes:?}");
        }
    }

    #[test]
    fn change_and_removal_withdraw_a_job_and_newer_content_becomes_a_new_one() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let (old, new) = (snapshot(&[("a.stl", 1)]), snapshot(&[("a.stl", 2)]));
        inbox.look(&old, start);
        inbox.look(&old, start + SETTLE);
        let withdrawn = [Change::Withdrawn("a.stl".into())];
        assert_eq!(inbox.look(&new, start + 2 * SETTLE), withdrawn);
        // The end of the withdrawn job says nothing about the newer content.
        inbox.done(Path::new("a.stl"), &old[Path::new("a.stl")].look, Rest::Published, None);
        assert_eq!(settled(&inbox.look(&new, start + 3 * SETTLE)), ["a.stl"]);
        assert_eq!(inbox.look(&Snapshot::new(), start + 4 * SETTLE), withdrawn);
        assert_eq!(inbox.notable().count(), 0);
        inbox.look(&new, start + 5 * SETTLE);
        assert_eq!(settled(&inbox.look(&new, start + 6 * SETTLE)), ["a.stl"], "it came back");
    }

    #[test]
    fn what_is_to_be_done_again_waits() {
        let (mut inbox, start) = (Inbox::default(), Instant::now() + 10 * SETTLE);
        let files = snapshot(&[("a.stl", 1)]);
        inbox.look(&files, start);
        inbox.look(&files, start + SETTLE);
        inbox.again(Path::new("a.stl"), &files[Path::new("a.stl")].look, start + 5 * SETTLE, "for the test");
        assert!(inbox.look(&files, start + 4 * SETTLE).is_empty());
        assert_eq!(settled(&inbox.look(&files, start + 5 * SETTLE)), ["a.stl"]);
    }

    /// A file that is done, in an inbox of its own.
    fn done(rest: Rest, doubt: Option<Doubt>) -> (Inbox, Snapshot, Instant) {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let files = snapshot(&[("a.stl", 1)]);
        inbox.look(&files, start);
        inbox.look(&files, start + SETTLE);
        inbox.done(Path::new("a.stl"), &files[Path::new("a.stl")].look, rest, doubt);
        (inbox, files, start + SETTLE)
    }

    #[test]
    fn a_file_is_doubted_once() {
        let doubt = Instant::now() + 10 * SETTLE;
        let (mut inbox, files, now) = done(Rest::Published, Some((doubt, blake3::hash(b"x"))));
        assert_eq!((inbox.look(&files, now + SETTLE), inbox.due()), (vec![], Some(doubt)));
        assert!(matches!(&inbox.look(&files, doubt)[..], [Change::Doubted(..)]));
        inbox.done(Path::new("a.stl"), &files[Path::new("a.stl")].look, Rest::Published, None);
        assert_eq!((inbox.look(&files, doubt + 99 * SETTLE), inbox.due()), (vec![], None));
    }

    #[test]
    fn a_file_whose_result_is_gone_is_done_again_and_one_that_was_delivered_is_not() {
        let (mut inbox, files, now) = done(Rest::Published, None);
        let name = PathBuf::from("a.stl");
        assert_eq!(
            [inbox.published(1), inbox.published(1), inbox.published(1)],
            [vec![name.clone()], vec![], vec![name.clone()]]
        );
        inbox.forget(&name, now);
        assert_eq!(settled(&inbox.look(&files, now + SETTLE)), ["a.stl"]);
        let (mut delivered, files, now) = done(Rest::Delivered, None);
        assert!(delivered.published(1).is_empty());
        delivered.forget_all(now);
        assert!(delivered.look(&files, now + 9 * SETTLE).is_empty(), "nor with other settings");
    }

    #[test]
    fn failures_in_a_row_are_tried_again_later_and_later() {
        let (mut inbox, start) = (Inbox::default(), Instant::now());
        let files = snapshot(&[("a.stl", 1)]);
        let (name, look) = (Path::new("a.stl"), files[Path::new("a.stl")].look);
        inbox.look(&files, start);
        let mut now = start + SETTLE;
        for seconds in [1, 2, 4, 8] {
            assert_eq!(settled(&inbox.look(&files, now)), ["a.stl"]);
            inbox.failed(name, &look, now, "for the test");
            assert_eq!(inbox.due(), Some(now + Duration::from_secs(seconds)));
            now += Duration::from_secs(seconds);
        }
        inbox.look(&files, now);
        inbox.done(name, &look, Rest::Published, None);
        assert_eq!(inbox.files[name].failures, 0);
    }

    #[test]
    fn what_is_not_done_for_long_is_named_once_with_its_reason() {
        let (mut inbox, files, now) = done(Rest::Waits("for a.bin".to_owned()), None);
        let late = now + 100 * SETTLE;
        let told: Vec<_> = inbox.overdue(late, 50 * SETTLE).iter().map(|n| (n.state, n.reason.to_owned())).collect();
        assert_eq!(told, [("waits", "for a.bin".to_owned())]);
        assert!(inbox.overdue(late + SETTLE, 50 * SETTLE).is_empty(), "once");
        assert_eq!(inbox.notable().count(), 1);
        // A file that changes all the time is restless since it came.
        let mut restless = Inbox::default();
        for step in 0..9 {
            restless.look(&snapshot(&[("a.stl", step)]), now + SETTLE * step as u32 / 2);
        }
        assert_eq!(restless.overdue(now + 5 * SETTLE, 5 * SETTLE).len(), 1);
        let (mut good, _, _) = done(Rest::Published, None);
        assert!(good.overdue(late, SETTLE).is_empty() && good.oldest().is_none());
        assert_eq!(files.len(), 1);
    }
}
