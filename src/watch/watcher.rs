//! Seeing files: what is dropped into the inbox. The only file that names `notify`.
//!
//! What the system tells of a folder is a **hint**: it may come late, twice, or not at all (its queue overflows; links,
//! network folders and folders that are made again tell little or nothing). The truth is a **scan** of the folder: at
//! the start, soon after a hint, when a file may have settled, and every few seconds anyway. So nothing that a hint says
//! is used but that it came.
//!
//! Deliberately absent: paths of events, a queue of events, and any memory of what was done but the published reports.

use super::inbox::{Seen, Snapshot};
use super::stop::Stop;
use crate::conveyor::Conveyor;
use crate::conveyor::completion::Completion;
use crate::formats::{self, Kind};
use crate::system::escape::escape;
use crate::system::fingerprint::{Fingerprint, Identity};
use crate::system::passing;
use crossbeam_channel::{Receiver, Sender, after, bounded, select};
use notify::event::{AccessKind, AccessMode, EventKind};
use notify::{Config, RecommendedWatcher, RecursiveMode, Watcher};
use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};
use walkdir::{DirEntry, WalkDir};

/// The folder is scanned this often, hints or not, as hints are lost. By experience: each scan asks for every file, and who has
/// lost one waits no longer than that.
const SCAN: Duration = Duration::from_secs(5);

/// And this often where there are no hints.
const POLL: Duration = Duration::from_secs(1);

/// There is no scan so soon after another one, whatever happens; and none within ten times what the last one took.
const REST: Duration = Duration::from_millis(100);

/// What wakes the daemon.
#[derive(Debug)]
pub enum Event {
    /// Something happened in the inbox.
    Hint,
    /// A job has ended.
    Completion(Box<Completion>),
    /// The daemon is asked to stop.
    Stop,
    /// The daemon is asked to read its settings again.
    Reload,
    /// It is time.
    Tick,
}

/// Looks at the inbox, and hears when something happens in it.
pub struct InboxWatcher {
    inbox: PathBuf,
    recursive: bool,
    hints: Receiver<()>,
    /// Kept, so that the channel never closes: a closed one would be heard all the time.
    _tell: Sender<()>,
    notifier: Option<RecommendedWatcher>,
    /// The folder that is watched: another one may take its name.
    watched: Option<(Identity, Option<SystemTime>)>,
    is_missing: bool,
    passed_over: BTreeSet<PathBuf>,
    /// Files that ask for others beside them, with the names of these.
    beside: BTreeMap<PathBuf, Vec<String>>,
    next_scan: Instant,
}

impl InboxWatcher {
    /// A watcher of the folder `inbox` (and, if asked, its sub-folders); without hints, if `poll`.
    pub fn new(inbox: &Path, recursive: bool, poll: bool) -> Self {
        let (tell, hints) = bounded(1);
        let notifier = if poll { None } else { notifier(tell.clone()) };
        Self {
            inbox: inbox.to_owned(),
            recursive,
            hints,
            _tell: tell,
            notifier,
            watched: None,
            is_missing: false,
            passed_over: BTreeSet::new(),
            beside: BTreeMap::new(),
            next_scan: Instant::now(),
        }
    }

    /// The folder.
    pub fn inbox(&self) -> &Path {
        &self.inbox
    }

    /// From now on these files beside the file `name` are part of what is seen of it.
    pub fn look_beside(&mut self, name: &Path, beside: Vec<String>) {
        if beside.is_empty() {
            self.beside.remove(name);
        } else {
            self.beside.insert(name.to_owned(), beside);
        }
    }

    /// How often to look even though nothing is heard.
    pub fn period(&self) -> Duration {
        if self.notifier.is_some() && self.watched.is_some() { SCAN } else { POLL }
    }

    /// Whether the folder was there at the last look.
    pub fn is_there(&self) -> bool {
        !self.is_missing
    }

    /// The earliest moment for the next look.
    pub fn next_scan(&self) -> Instant {
        self.next_scan
    }

    /// Waits until something happens, at most until `wake`.
    pub fn wait(&self, conveyor: &Conveyor, stop: &Stop, wake: Instant) -> Event {
        select! {
            recv(self.hints) -> _ => Event::Hint,
            recv(conveyor.ended()) -> ended => ended.map_or(Event::Tick, |e| Event::Completion(Box::new(e))),
            recv(stop.heard) -> _ => Event::Stop,
            recv(stop.to_reload) -> _ => Event::Reload,
            recv(after(wake.saturating_duration_since(Instant::now()))) -> _ => Event::Tick,
        }
    }

    /// Looks at the folder: all files that may hold a mesh. None: it cannot be read at the moment; that it is gone
    /// means that there are no files.
    pub fn look(&mut self) -> Option<Snapshot> {
        let began = Instant::now();
        let seen = std::fs::metadata(&self.inbox).and_then(|metadata| {
            self.watch_again((Identity::of(&metadata), metadata.created().ok()));
            self.scan()
        });
        let snapshot = match seen {
            Ok(snapshot) => {
                if std::mem::take(&mut self.is_missing) {
                    tracing::info!(inbox = escape(&self.inbox), "the inbox is back");
                }
                Some(snapshot)
            }
            Err(error) => self.not_there(&error),
        };
        let now = Instant::now();
        self.next_scan = now + REST.max(10 * now.saturating_duration_since(began));
        snapshot
    }

    fn not_there(&mut self, error: &io::Error) -> Option<Snapshot> {
        if !std::mem::replace(&mut self.is_missing, true) {
            tracing::warn!(
                inbox = escape(&self.inbox),
                "cannot see the inbox: {error}; make it again, mount it, or let it be read"
            );
        }
        let is_gone = error.kind() == ErrorKind::NotFound;
        if is_gone {
            self.watched = None;
        }
        is_gone.then(Snapshot::new)
    }

    /// Asks for hints of the folder that has the name of the inbox now.
    fn watch_again(&mut self, identity: (Identity, Option<SystemTime>)) {
        let Some(notifier) = &mut self.notifier else { return };
        if self.watched == Some(identity) {
            return;
        }
        // It fails where the folder that was watched is gone.
        let _ = notifier.unwatch(&self.inbox);
        let mode = if self.recursive { RecursiveMode::Recursive } else { RecursiveMode::NonRecursive };
        match notifier.watch(&self.inbox, mode) {
            Ok(()) => self.watched = Some(identity),
            Err(error) => {
                tracing::warn!(
                    "the system tells nothing of the inbox ({error}), which is scanned every second instead; where its \
                     limit is reached, raise fs.inotify.max_user_watches, or say --poll"
                );
                self.notifier = None;
            }
        }
    }

    /// Scans the folder.
    fn scan(&mut self) -> io::Result<Snapshot> {
        let mut snapshot = Snapshot::new();
        let depth = if self.recursive { usize::MAX } else { 1 };
        let is_open = |e: &DirEntry| e.depth() == 0 || !e.file_name().to_string_lossy().starts_with('.');
        let inbox = self.inbox.clone();
        for entry in WalkDir::new(&inbox).max_depth(depth).into_iter().filter_entry(is_open) {
            match entry {
                Ok(entry) => match self.see(&entry) {
                    Ok(Some((name, look))) => drop(snapshot.insert(name, look)),
                    Ok(None) => {}
                    // What cannot be seen at the moment has not gone.
                    Err(error) if passing::passes(&error) => return Err(error),
                    Err(error) => tracing::debug!("passed over: {error}"),
                },
                Err(error) => {
                    let is_whole = error.depth() == 0;
                    let error = of_the_system(error);
                    // Files may go at any moment; where the system is in trouble, nothing is known.
                    if is_whole || passing::passes(&error) {
                        return Err(error);
                    }
                    tracing::debug!("passed over: {error}");
                }
            }
        }
        Ok(snapshot)
    }

    /// A file that may hold a mesh, by its path below the inbox.
    fn see(&mut self, entry: &DirEntry) -> io::Result<Option<(PathBuf, Seen)>> {
        let Ok(name) = entry.path().strip_prefix(&self.inbox) else { return Ok(None) };
        if !matches!(formats::kind(name), Kind::Mesh(_) | Kind::OtherMesh(_)) {
            return Ok(None);
        }
        let kind = entry.file_type();
        let look = if kind.is_file() {
            Some(Fingerprint::of(&entry.metadata().map_err(of_the_system)?))
        } else if kind.is_symlink() && self.leads_inside(entry.path()) {
            Fingerprint::at(entry.path())?
        } else {
            if !kind.is_dir() && self.passed_over.insert(name.to_owned()) {
                tracing::warn!(input = escape(name), "passed over: no regular file of the inbox; copy the file itself");
            }
            None
        };
        let asked = self.beside.get(name).into_iter().flatten();
        let beside = asked.map(|file| Fingerprint::at(&entry.path().with_file_name(file)).ok().flatten());
        Ok(look.map(|look| (name.to_owned(), Seen { look, beside: beside.collect() })))
    }

    /// Whether a symbolic link leads to something in the inbox. Others are not followed: whoever may drop files must not
    /// have others read.
    fn leads_inside(&self, link: &Path) -> bool {
        let target = self.inbox.canonicalize().and_then(|inbox| Ok(link.canonicalize()?.starts_with(inbox)));
        target.unwrap_or(false)
    }
}

/// The error of the system itself: as it is wrapped, its number cannot be told.
fn of_the_system(error: walkdir::Error) -> io::Error {
    error.into_io_error().unwrap_or_else(|| io::Error::other("links lead in circles"))
}

/// What asks the system for hints, and passes each on as a bare sign that something happened.
fn notifier(tell: Sender<()>) -> Option<RecommendedWatcher> {
    let hint = move |event: notify::Result<notify::Event>| {
        if event.is_ok_and(|e| !is_news(&e.kind)) {
            return;
        }
        // Full: a scan is to come anyway. An error or an overflow is a reason to scan, too.
        let _ = tell.try_send(());
    };
    // Else whoever may drop files has all folders watched to which a link of theirs leads.
    let made = RecommendedWatcher::new(hint, Config::default().with_follow_symlinks(false));
    made.inspect_err(|error| {
        tracing::warn!("the system tells nothing of files ({error}): the inbox is scanned every second");
    })
    .ok()
}

/// Whether files may have changed: that something was opened or read, as scans and jobs do it, is no news.
fn is_news(kind: &EventKind) -> bool {
    !matches!(kind, EventKind::Access(access) if *access != AccessKind::Close(AccessMode::Write))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(snapshot: Option<Snapshot>) -> Vec<String> {
        snapshot.expect("readable").into_keys().map(|n| n.display().to_string()).collect()
    }

    #[test]
    fn meshes_are_seen_and_what_is_beside_them_is_not() {
        let folder = tempfile::tempdir().expect("a folder");
        let inbox = folder.path().join("in");
        std::fs::create_dir_all(inbox.join("sub/.hidden")).expect("made");
        for name in ["a.stl", "b.mtl", ".c.stl", "d.stl.part", "e.xyz", "sub/f.obj", "sub/.hidden/g.stl", "h.ply"] {
            std::fs::write(inbox.join(name), name).expect("written");
        }
        std::fs::create_dir(inbox.join("folder.stl")).expect("made");
        assert_eq!(names(InboxWatcher::new(&inbox, false, true).look()), ["a.stl", "h.ply"]);
        assert_eq!(names(InboxWatcher::new(&inbox, true, true).look()), ["a.stl", "h.ply", "sub/f.obj"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_inside_the_inbox_only_and_devices_never() {
        use std::os::unix::fs::symlink;
        let folder = tempfile::tempdir().expect("a folder");
        let inbox = folder.path().join("in");
        std::fs::create_dir(&inbox).expect("made");
        std::fs::write(folder.path().join("outside.stl"), "secret").expect("written");
        std::fs::write(inbox.join("a.stl"), "a").expect("written");
        symlink("a.stl", inbox.join("inside.stl")).expect("linked");
        symlink("../outside.stl", inbox.join("outside.stl")).expect("linked");
        symlink("/dev/zero", inbox.join("zero.stl")).expect("linked");
        symlink("loop.stl", inbox.join("loop.stl")).expect("linked");
        std::fs::hard_link(inbox.join("a.stl"), inbox.join("hard.stl")).expect("linked");
        rustix::fs::mknodat(
            rustix::fs::CWD,
            inbox.join("fifo.stl"),
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::RUSR,
            0,
        )
        .expect("made");
        assert_eq!(names(InboxWatcher::new(&inbox, false, true).look()), ["a.stl", "hard.stl", "inside.stl"]);
    }

    #[test]
    fn where_no_hints_come_none_are_heard() {
        let folder = tempfile::tempdir().expect("a folder");
        let mut watcher = InboxWatcher::new(folder.path(), false, true);
        assert!(watcher.hints.try_recv().is_err_and(|e| e.is_empty()), "closed");
        watcher.notifier = notifier(watcher._tell.clone());
        watcher.notifier = None;
        assert!(watcher.hints.try_recv().is_err_and(|e| e.is_empty()), "closed");
    }

    #[test]
    fn a_folder_that_is_gone_has_no_files_and_hints_come_from_the_one_that_is_made_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let inbox = folder.path().join("in");
        std::fs::create_dir(&inbox).expect("made");
        let mut watcher = InboxWatcher::new(&inbox, false, false);
        for _ in 0..2 {
            assert!(names(watcher.look()).is_empty());
            while watcher.hints.try_recv().is_ok() {}
            std::fs::write(inbox.join("a.stl"), "a").expect("written");
            watcher.hints.recv_timeout(Duration::from_secs(20)).expect("a hint");
            assert_eq!(names(watcher.look()), ["a.stl"]);
            std::fs::remove_dir_all(&inbox).expect("removed");
            assert!(names(watcher.look()).is_empty());
            std::fs::create_dir(&inbox).expect("made again");
        }
    }
}
