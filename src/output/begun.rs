//! Which inputs are on their way, so that a death of the program is known as theirs.
//!
//! An input that is decoded leaves a mark in the staging folder of its process, and takes it away when it ends. The marks of
//! a process that died are found at the next start: each is a death that its input may have caused. It is done in a process
//! of its own from then on ([`crate::conveyor`]), and where that dies, too, it was the input: it is put aside, with a
//! report. So no input ends the service, and none is put aside for what another one did.
//!
//! A child process makes its mark itself, and holds its lock. Where it sees that its parent has died, it removes the mark:
//! its input did nothing. So killing planish, however often, puts nothing aside; but where the system kills both at once,
//! as containers do that are short of memory, that counts. The end of the machine does not: marks that were made before it
//! was started the last time are forgotten.
//!
//! Nothing here is brought to disk: marks are for deaths of processes, which the memory of the system survives.

use crate::output::own;
use crate::output::publish::STAGING;
use crate::system::disk::{self, Disk, File as _, System};
use crate::system::fingerprint::Fingerprint;
use crate::system::safe_open;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// So many deaths are no accident. One may be the fault of whatever else ran; each more costs all other inputs a start.
pub const MOST_DEATHS: u32 = 2;

/// How the names of marks begin.
const MARK: &str = "begun-";

/// The folder in which deaths are counted.
const DEATHS: &str = "deaths";

/// A child whose parent has died ends at once: so long it is waited for.
const ORPHAN: Duration = Duration::from_secs(5);

/// A longer mark is none.
const LONGEST: u64 = 64 << 10;

/// How the names of marks begin that are not complete.
const FRESH: &str = "fresh-";

/// What is known of an input that was on its way when a process died.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// Its name, for people.
    name: String,
    /// What it looked like: newer content has done nothing yet.
    look: Option<Fingerprint>,
    /// The version of planish: another one may not die.
    planish: String,
    /// Since when the machine runs, in the system's words.
    boot: String,
    /// How often a process died.
    deaths: u32,
}

impl Entry {
    fn of(name: &Path, look: Option<Fingerprint>) -> Self {
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Self { name: name.to_string_lossy().into_owned(), look, planish: version, boot: boot(), deaths: 0 }
    }

    fn is_about(&self, other: &Self) -> bool {
        (&self.name, self.look, &self.planish) == (&other.name, other.look, &other.planish)
    }
}

/// What the system calls the time since it was started; the same for ever where it does not tell.
fn boot() -> String {
    fs::read_to_string("/proc/sys/kernel/random/boot_id").unwrap_or_default().trim().to_owned()
}

/// The marks of a process, and the deaths of those before it.
#[derive(Debug)]
pub struct Begun {
    deaths: PathBuf,
}

/// An input, and how often processes have died of it. Its mark goes when this is dropped.
#[derive(Debug)]
pub struct Suspect {
    mark: PathBuf,
    is_marked: bool,
    record: PathBuf,
    entry: Entry,
}

impl Begun {
    /// Those of a process that writes to the output folder `out`.
    pub fn new(out: &Path) -> Self {
        Self { deaths: out.join(STAGING).join(DEATHS) }
    }

    /// What is known of an input; its mark will be in the folder `staging` of this process.
    pub fn about(&self, name: &Path, look: Option<Fingerprint>, staging: &Path) -> Suspect {
        let mut entry = Entry::of(name, look);
        let record = self.deaths.join(file(name));
        match read(&record) {
            Some(older) if older.is_about(&entry) => entry.deaths = older.deaths,
            // Of content, or a version, that is gone.
            Some(_) => drop(forget(&record)),
            None => {}
        }
        let mark = staging.join(format!("{MARK}{}", file(name)));
        Suspect { mark, is_marked: false, record, entry }
    }
}

impl Suspect {
    /// How often a process has died while this input was on its way.
    pub fn deaths(&self) -> u32 {
        self.entry.deaths
    }

    /// Where its mark is, or would be; and what that says.
    pub fn mark(&self) -> (&Path, &Entry) {
        (&self.mark, &self.entry)
    }

    /// Marks it as on its way in this process.
    ///
    /// # Errors
    /// The mark cannot be written.
    pub fn begin(&mut self) -> io::Result<()> {
        self.is_marked = true;
        make(&self.mark, &self.entry).map(drop)
    }

    /// One more process has died of this input.
    ///
    /// # Errors
    /// That cannot be written; it is counted all the same, as long as this process lives.
    pub fn count_death(&mut self) -> io::Result<()> {
        self.entry.deaths += 1;
        write(&self.record, &self.entry)
    }

    /// No process dies of this input: it has come to its end.
    pub fn acquit(&mut self) {
        self.entry.deaths = 0;
        forget(&self.record);
    }
}

impl Drop for Suspect {
    fn drop(&mut self) {
        if self.is_marked {
            // It goes with its folder at the latest.
            let _ = fs::remove_file(&self.mark);
        }
    }
}

/// Marks the input of this process, which does nothing else, and holds the lock of the mark until what is returned goes.
///
/// # Errors
/// The mark cannot be written.
pub fn begin_apart(mark: &Path, entry: &Entry) -> io::Result<File> {
    let name = mark.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let fresh = mark.with_file_name(format!("{FRESH}{name}"));
    let file = make(&fresh, entry)?;
    file.try_lock()?;
    fs::rename(fresh, mark)?;
    Ok(file)
}

/// Makes a mark; what has its name, whatever that is, goes.
fn make(path: &Path, entry: &Entry) -> io::Result<File> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
        Ok(()) | Err(_) => {}
    }
    let mut file = File::options().read(true).write(true).create_new(true).open(path)?;
    file.write_all(&serde_json::to_vec(entry)?)?;
    Ok(file)
}

/// Removes the mark of the input of this process: it has ended, or the parent has died, which was not its fault.
pub fn end_apart(mark: &Path) {
    let _ = fs::remove_file(mark);
}

/// Forgets how often processes have died while the input `name` was on its way; whether any had.
pub fn forgive(out: &Path, name: &Path) -> bool {
    forget(&out.join(STAGING).join(DEATHS).join(file(name)))
}

/// Counts the deaths of which the marks in the staging folder of a dead process tell.
pub fn take_over(dead: &Path) {
    let Some(staging) = dead.parent() else { return };
    let Ok(entries) = fs::read_dir(dead) else { return };
    let is_mark = |e: &fs::DirEntry| e.file_name().as_bytes().starts_with(MARK.as_bytes());
    for path in entries.flatten().filter(is_mark).map(|e| e.path()) {
        if let Err(error) = take_over_one(staging, &path)
            && error.kind() != ErrorKind::NotFound
        {
            tracing::warn!("which input was on its way when the last planish died is not known: {error}");
        }
    }
}

fn take_over_one(staging: &Path, path: &Path) -> io::Result<()> {
    let Some(name) = path.file_name().and_then(|n| n.to_str()) else { return Ok(()) };
    let folder = System.open(path.parent().unwrap_or(path))?;
    let lock = own::open_lock_there(&folder, name.as_ref())?;
    if !own::lock(&lock, path, ORPHAN, || true)? {
        // It lives still.
        return Ok(());
    }
    let (Some(mut entry), Some(file)) = (read(path), name.strip_prefix(MARK)) else { return Ok(()) };
    if entry.boot != boot() {
        return Ok(());
    }
    entry.deaths += 1;
    tracing::warn!(
        input = crate::system::escape::escape(entry.name.as_ref()),
        deaths = entry.deaths,
        "was on its way when the last planish died: it is done in a process of its own"
    );
    write(&staging.join(DEATHS).join(file), &entry)
}

/// The name of the file about an input.
fn file(name: &Path) -> String {
    blake3::hash(name.as_os_str().as_bytes()).to_hex()[..32].to_owned()
}

fn read(path: &Path) -> Option<Entry> {
    safe_open::read_json(safe_open::open_itself(path), LONGEST)
}

/// Puts a record in its place at once.
fn write(record: &Path, entry: &Entry) -> io::Result<()> {
    let folder = own::folder(&System, record.parent().unwrap_or(record))?;
    let told = serde_json::to_vec(entry)?;
    disk::replace_with(&folder, &folder, record.file_name().unwrap_or_default(), |file| file.append(&told))
}

/// Removes a record, and the folder of records with the last one; whether it was there.
fn forget(record: &Path) -> bool {
    let was_there = fs::remove_file(record).is_ok();
    if was_there && let Some(folder) = record.parent() {
        // Fails where others are in it.
        let _ = fs::remove_dir(folder);
    }
    was_there
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Place {
        out: tempfile::TempDir,
    }

    impl Place {
        fn new() -> Self {
            let out = tempfile::tempdir().expect("a folder");
            fs::create_dir(out.path().join(STAGING)).expect("made");
            Self { out }
        }

        fn staging(&self) -> PathBuf {
            self.out.path().join(STAGING)
        }

        /// What a process knows of an input, which will perhaps die of it.
        fn about(&self, run: &str, name: &str, look: Option<Fingerprint>) -> Suspect {
            let folder = self.staging().join(run);
            fs::create_dir_all(&folder).expect("made");
            Begun::new(self.out.path()).about(name.as_ref(), look, &folder)
        }

        /// A process dies while it has an input on its way.
        fn die(&self, run: &str, name: &str) {
            let mut suspect = self.about(run, name, None);
            suspect.begin().expect("marked");
            std::mem::forget(suspect);
            take_over(&self.staging().join(run));
        }

        fn deaths(&self, name: &str) -> u32 {
            self.about("run-9", name, None).deaths()
        }
    }

    #[test]
    fn deaths_are_counted_by_input_and_forgotten_when_it_ends_well() {
        let place = Place::new();
        place.die("run-1", "a.stl");
        assert_eq!((place.deaths("a.stl"), place.deaths("b.stl")), (1, 0));
        place.die("run-2", "a.stl");
        assert_eq!(place.deaths("a.stl"), MOST_DEATHS);
        place.about("run-9", "a.stl", None).acquit();
        assert_eq!(place.deaths("a.stl"), 0);
        assert!(!place.staging().join(DEATHS).exists(), "nothing is left");
    }

    #[test]
    fn an_input_that_has_ended_leaves_no_mark() {
        let place = Place::new();
        place.about("run-1", "a.stl", None).begin().expect("marked");
        assert_eq!(fs::read_dir(place.staging().join("run-1")).expect("a folder").count(), 0);
    }

    #[test]
    fn newer_content_has_done_nothing() {
        let place = Place::new();
        place.die("run-1", "a.stl");
        let file = place.out.path().join("a.stl");
        fs::write(&file, "newer").expect("written");
        let look = Fingerprint::at(&file).expect("there");
        assert_eq!(place.about("run-2", "a.stl", look).deaths(), 0);
        assert!(!place.staging().join(DEATHS).exists(), "nor does anything tell of the older one");
    }

    /// A child that outlives its parent sees that this is gone, and ends; one that is killed with it does not.
    #[test]
    fn orphans_accuse_nobody_and_children_that_died_with_their_parents_do() {
        for outlives in [true, false] {
            let place = Place::new();
            let suspect = place.about("run-1", "a.stl", None);
            let (mark, entry) = suspect.mark();
            let child = begin_apart(mark, entry).expect("marked");
            let mark = mark.to_owned();
            let orphan = std::thread::spawn(move || {
                std::thread::sleep(Duration::from_millis(100));
                if outlives {
                    end_apart(&mark);
                }
                drop(child);
            });
            take_over(&place.staging().join("run-1"));
            orphan.join().expect("ends");
            assert_eq!(place.deaths("a.stl"), u32::from(!outlives));
        }
    }

    #[test]
    fn a_machine_that_was_switched_off_accuses_nobody() {
        let place = Place::new();
        let mut suspect = place.about("run-1", "a.stl", None);
        suspect.entry.boot = "another".to_owned();
        suspect.begin().expect("marked");
        take_over(&place.staging().join("run-1"));
        assert_eq!(place.deaths("a.stl"), 0);
    }

    #[test]
    fn what_was_forgiven_may_try_again() {
        let place = Place::new();
        place.die("run-1", "a.stl");
        assert!(forgive(place.out.path(), "a.stl".as_ref()));
        assert!(!forgive(place.out.path(), "a.stl".as_ref()), "once");
    }
}
