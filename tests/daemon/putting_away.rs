//! What becomes of inputs that are done with, where others may do anything in the inbox.

use super::{Watched, disk, names};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::geteuid;
use std::fs::{self, Permissions};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};

/// The user that has no rights.
pub const NOBODY: u32 = 65534;

fn set_mode(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("set");
}

/// Whether the program can be run as another user.
pub fn can_be_nobody() -> bool {
    let mut command = Command::new(env!("CARGO_BIN_EXE_planish"));
    command.arg("--version").stdout(Stdio::null()).uid(NOBODY).gid(NOBODY);
    geteuid().is_root() && command.status().is_ok_and(|status| status.success())
}

/// Lets another user reach the inbox, and write results.
pub fn open_for_nobody(w: &Watched) {
    set_mode(&w.beside(""), 0o755);
    chown(w.out.path(), Some(NOBODY), Some(NOBODY)).expect("given away");
}

fn starts(w: &Watched) -> bool {
    w.log().contains("\"watches\"")
}

/// Whoever may drop files may not have others read or moved.
#[test]
fn folders_that_others_made_in_the_inbox_are_left_alone_and_told_once() {
    let mut w = Watched::new(&[]);
    let evil = w.inbox().join(".planish-taken-evil");
    fs::create_dir(&evil).expect("made");
    set_mode(&evil, 0o755);
    fs::write(w.beside("secret"), disk(2, 0.0)).expect("written");
    fs::write(evil.join("a.stl"), disk(2, 0.0)).expect("written");
    symlink(w.beside("secret"), evil.join("secret.stl")).expect("linked");
    mknodat(CWD, evil.join("pipe.stl"), FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
    symlink(w.beside(""), w.inbox().join(".planish-taken-link")).expect("linked");
    w.start();
    w.wait_until("it watches", starts);
    let left: Vec<String> = names(&w.inbox()).into_iter().collect();
    assert_eq!(left, [".planish-taken-evil", ".planish-taken-link"]);
    assert_eq!(names(&evil).into_iter().collect::<Vec<_>>(), ["a.stl", "pipe.stl", "secret.stl"]);
    for name in left {
        let told = w.log().lines().filter(|l| l.contains("left alone") && l.contains(&name)).count();
        assert_eq!(told, 1, "{name}: {}", w.log());
    }
    w.stop();
}

/// Where links to what is not theirs cannot be made, or moved, files must not be copied through them instead.
#[test]
fn nothing_is_copied_for_those_who_may_not_read_it() {
    if !can_be_nobody() {
        eprintln!("skipped: only root can make files of one user and run the program as another");
        return;
    }
    let mut w = Watched::new(&[]);
    open_for_nobody(&w);
    let (secret, evil) = (w.beside("secret"), w.inbox().join(".planish-taken-evil"));
    fs::write(&secret, "secret").expect("written");
    set_mode(&secret, 0o600);
    chown(&secret, Some(NOBODY), Some(NOBODY)).expect("given away");
    fs::create_dir(&evil).expect("made");
    symlink(&secret, evil.join("a.txt")).expect("linked");
    [&evil, &w.inbox()].iter().for_each(|folder| set_mode(folder, 0o777));
    w.start_with(|command| command.uid(NOBODY).gid(NOBODY));
    w.wait_until("it watches", starts);
    assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), [".planish-taken-evil"]);
    assert_eq!(fs::read_link(evil.join("a.txt")).expect("a link"), secret);
    w.stop();
}

#[test]
fn what_a_kill_left_behind_is_given_back_or_cleared_at_the_next_start() {
    let done = tempfile::tempdir().expect("a folder");
    let mut w = Watched::new(&["--inputs", &format!("move:{}", done.path().display())]);
    let held = w.inbox().join(".planish-taken-1");
    fs::create_dir(&held).expect("made");
    set_mode(&held, 0o700);
    fs::write(held.join("a.stl"), disk(2, 0.0)).expect("written");
    for (name, mode) in [(".planish-taken-2", 0o600), (".planish-taken-3", 0o644), ("b.stl", 0o600)] {
        fs::write(done.path().join(name), "half").expect("written");
        set_mode(&done.path().join(name), mode);
    }
    w.start();
    w.wait_until("it watches", starts);
    assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), ["a.stl"]);
    assert_eq!(names(done.path()).into_iter().collect::<Vec<_>>(), [".planish-taken-3", "b.stl"]);
    w.stop();
}

#[test]
fn an_inbox_that_cannot_be_written_is_told_at_the_start() {
    let mut w = Watched::new(&["--inputs", "delete"]);
    if geteuid().is_root() && !can_be_nobody() {
        eprintln!("skipped: root may write everything, and the program cannot be run as another user");
        return;
    }
    if geteuid().is_root() {
        open_for_nobody(&w);
    }
    set_mode(&w.inbox(), 0o555);
    w.start_with(|command| if geteuid().is_root() { command.uid(NOBODY).gid(NOBODY) } else { command });
    w.wait_until("it has ended or watches", |w| starts(w) || w.log().contains("inbox"));
    assert!(!starts(&w), "{}", w.log());
    assert_eq!(w.wait().code(), Some(2), "{}", w.log());
    let told = w.log();
    assert!(told.contains("nothing can be taken out of the inbox") && told.contains("--inputs keep"), "{told}");
    // Nothing is to be taken out.
    set_mode(&w.inbox(), 0o755);
}

/// In a folder as /tmp is, others may make folders, but not rename what is not theirs.
#[test]
fn what_was_moved_goes_again_where_the_input_cannot_be_removed() {
    if !can_be_nobody() {
        eprintln!("skipped: only root can make files of one user and run the program as another");
        return;
    }
    let done = tempfile::tempdir().expect("a folder");
    chown(done.path(), Some(NOBODY), Some(NOBODY)).expect("given away");
    let mut w = Watched::new(&["--inputs", &format!("move:{}", done.path().display())]);
    open_for_nobody(&w);
    set_mode(&w.inbox(), 0o1777);
    w.drop_in("a.stl", &disk(4, 0.0));
    w.start_with(|command| command.uid(NOBODY).gid(NOBODY));
    w.wait_until("it cannot be put away", |w| w.logged("a.stl", "cannot put the input") == 1);
    assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), ["a.stl"]);
    assert!(names(done.path()).is_empty(), "{:?}", names(done.path()));
    w.stop();
}

/// Writes the letter that it is told next into the first byte of a file, through memory that it shares with it.
const WRITER: &str = "
import mmap, sys
with open(sys.argv[1], 'r+b') as file:
    shared = mmap.mmap(file.fileno(), 0)
    for line in sys.stdin:
        shared[0] = ord(line[0])
        print('written', flush=True)
";

/// Once a page is written to, later writes through shared memory change neither size nor times until it is on disk; in
/// memory file systems, they never do.
#[test]
fn what_is_written_through_shared_memory_is_not_lost_with_the_input() {
    let inbox = tempfile::tempdir_in("/dev/shm").expect("a folder");
    let path = inbox.path().join("a.stl");
    let content = |letter: u8| {
        let mut bytes = disk(4, 0.0);
        bytes[0] = letter;
        bytes
    };
    fs::write(&path, content(b'a')).expect("written");
    let mut command = Command::new("python3");
    command.args(["-c", WRITER]).arg(&path).stdin(Stdio::piped()).stdout(Stdio::piped());
    let Ok(mut writer) = command.spawn() else {
        eprintln!("skipped: there is no python3");
        return;
    };
    let mut tell = writer.stdin.take().expect("piped");
    let mut hear = BufReader::new(writer.stdout.take().expect("piped"));
    let mut write = |letter: char| {
        writeln!(tell, "{letter}").expect("told");
        let mut answer = String::new();
        hear.read_line(&mut answer).expect("heard");
        assert_eq!(answer, "written\n");
    };
    write('b');
    // What waits to be quiet is read again after that; so the command takes as long.
    let slow = "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"test $(head -c 1 {input}) = c || sleep 11\"]\n";
    let mut w = Watched::configured(slow, &["--inputs", "delete"]);
    fs::remove_dir(w.inbox()).expect("removed");
    symlink(inbox.path(), w.inbox()).expect("linked");
    w.start();
    w.wait_until("the command runs", |w| w.status()["running"][0]["stage"] == "chain");
    assert!(w.is_done("a.stl", &content(b'b')), "{}", w.log());
    let before = fs::metadata(&path).expect("there");
    write('c');
    let after = fs::metadata(&path).expect("there");
    assert_eq!(before.modified().expect("a time"), after.modified().expect("a time"), "the test has lost its sense");
    writer.kill().and_then(|()| writer.wait()).expect("ended");
    w.wait_until("it is put away", |_| names(inbox.path()).is_empty());
    assert!(w.is_done("a.stl", &content(b'c')), "{}", w.log());
    w.stop();
}

/// As many systems do, Linux tells whether somebody has a file open for writing; to the owner of the file, at least.
#[cfg(target_os = "linux")]
#[test]
fn what_somebody_has_open_for_writing_stays_until_it_is_closed() {
    let mut w = Watched::new(&["--inputs", "delete"]);
    for name in ["open.stl", "read.stl"] {
        w.drop_in(name, &disk(4, 0.0));
    }
    let writer = fs::File::options().append(true).open(w.inbox().join("open.stl")).expect("there");
    let _reader = fs::File::open(w.inbox().join("read.stl")).expect("there");
    w.start();
    w.wait_until("it waits for the writer", |w| w.logged("open.stl", "somebody has it open") > 0);
    w.wait_until("the other one is put away", |w| !w.inbox().join("read.stl").exists());
    // It is looked at again after ten seconds.
    std::thread::sleep(std::time::Duration::from_secs(12));
    assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), ["open.stl"]);
    assert_eq!(w.logged("open.stl", "somebody has it open"), 1, "{}", w.log());
    drop(writer);
    w.wait_until("it is put away", |w| names(&w.inbox()).is_empty());
    w.stop();
}

#[test]
fn an_input_of_which_a_component_was_refused_stays() {
    let done = tempfile::tempdir().expect("a folder");
    let mut w = Watched::new(&["--inputs", &format!("move:{}", done.path().display())]);
    let (bytes, ..) = crate::doubts::terrain_beside_a_volume();
    w.drop_in("mixed.stl", &bytes);
    w.drop_in("whole.stl", &disk(4, 0.0));
    w.start();
    w.wait_for(&[("mixed.stl", &bytes)]);
    w.wait_until("the other one is put away", |_| names(done.path()).contains("whole.stl"));
    w.stop();
    assert_eq!(names(&w.inbox()).into_iter().collect::<Vec<_>>(), ["mixed.stl"], "its result is not all of it");
    assert_eq!(w.logged("mixed.stl", "component 1 is refused"), 1, "{}", w.log());
}
