//! What the daemon opens while hostile things lie in its inbox, as the system sees it: `strace` writes down each file that is
//! opened, linked or moved, by any thread or process of it, with the path that it had.

use super::putting_away::NOBODY;
use super::{Watched, disk, gltf_naming, names};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::geteuid;
use std::collections::BTreeMap;
use std::fs::{self, Permissions};
use std::os::unix::fs::{PermissionsExt, chown, symlink};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};

/// What a program may read of the system: libraries, and what is told of itself and its container.
const OF_THE_SYSTEM: [&str; 6] = ["/lib", "/usr/lib", "/etc/ld.so", "/proc/", "/sys/", "/dev/null"];

/// Calls that open, link or move.
const CALLS: &str =
    "open,openat,openat2,creat,link,linkat,symlinkat,rename,renameat,renameat2,unlinkat,truncate,execve";

fn can_trace_nobody() -> bool {
    let mut strace = Command::new("strace");
    strace.args(["-o", "/dev/null"]).arg(env!("CARGO_BIN_EXE_planish")).arg("--version");
    strace.stdout(Stdio::null()).stderr(Stdio::null()).uid(NOBODY).gid(NOBODY);
    geteuid().is_root() && strace.status().is_ok_and(|status| status.success())
}

/// A group inbox: members may drop what they like, and remove what is theirs.
fn group_inbox(w: &Watched) {
    fs::set_permissions(w.beside(""), Permissions::from_mode(0o755)).expect("set");
    for folder in [w.inbox(), w.out.path().to_owned(), w.beside("done")] {
        fs::create_dir_all(&folder).expect("made");
        chown(&folder, Some(NOBODY), Some(NOBODY)).expect("given away");
    }
    fs::set_permissions(w.inbox(), Permissions::from_mode(0o3770)).expect("set");
}

/// All that somebody who may drop files could put there.
fn hostile(w: &Watched) {
    let (inbox, outside) = (w.inbox(), w.beside("outside"));
    fs::create_dir(&outside).expect("made");
    let secret = outside.join("secret.stl");
    fs::write(&secret, disk(3, 0.5)).expect("written");
    fs::write(outside.join("secret.bin"), [0; 36]).expect("written");
    // Even what the daemon's own user may read is not to be read.
    [&outside, &secret, &outside.join("secret.bin")]
        .into_iter()
        .for_each(|path| chown(path, Some(NOBODY), Some(NOBODY)).expect("given away"));
    for (target, name) in [
        ("../outside/secret.stl", "link.stl"),
        ("/etc/shadow", "shadow.stl"),
        ("/dev/zero", "zero.stl"),
        ("../outside", "folder"),
        ("../outside", ".planish-taken-link"),
        ("/proc/self/environ", "environ.ply"),
        ("../outside/secret.bin", "data.bin"),
        ("loop.stl", "loop.stl"),
    ] {
        symlink(target, inbox.join(name)).expect("linked");
    }
    for (name, kind, mode) in [("pipe.stl", FileType::Fifo, 0o666), ("device.stl", FileType::CharacterDevice, 0o666)] {
        let device = rustix::fs::makedev(1, 5);
        // Devices cannot be made everywhere.
        let _ = mknodat(CWD, inbox.join(name), kind, Mode::from_raw_mode(mode), device);
    }
    let taken = inbox.join(".planish-taken-1");
    fs::create_dir(&taken).expect("made");
    symlink("../../outside/secret.stl", taken.join("a.stl")).expect("linked");
    fs::set_permissions(&taken, Permissions::from_mode(0o777)).expect("set");
    for (name, uri) in [("near.gltf", "data.bin"), ("far.gltf", "../outside/secret.bin"), ("full.gltf", "/etc/passwd")]
    {
        fs::write(inbox.join(name), gltf_naming(uri)).expect("written");
    }
    fs::write(inbox.join("materials.obj"), "mtllib ../outside/secret.stl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
        .expect("written");
    let other = Path::new("sub");
    fs::create_dir(inbox.join(other)).expect("made");
    fs::set_permissions(inbox.join(other), Permissions::from_mode(0o777)).expect("set");
    symlink("../../outside/secret.stl", inbox.join("sub/deep.stl")).expect("linked");
}

/// The paths of what was opened, and of what was linked, moved or removed, according to a line of strace.
fn reached(line: &str) -> Vec<String> {
    let Some((call, result)) = line.rsplit_once(" = ") else { return vec![] };
    if result.starts_with('-') || result.starts_with('?') {
        return vec![];
    }
    // What was opened, as the system names it: links are followed there.
    let opened = result.split_once('<').and_then(|(_, path)| path.rsplit_once('>')).map(|(path, _)| path.to_owned());
    let mut paths = opened.map_or_else(|| operands(call), |path| vec![path]);
    if call.contains("execve(") {
        // The program; its arguments are no paths.
        paths.truncate(1);
    } else if call.contains("symlinkat(") {
        // The link; what it says is followed by nobody (see `staging`), or was said by somebody else.
        paths.drain(..1);
    }
    paths
}

/// The lines of a trace; a call during which another thread made one stands on two lines there, and on one here.
fn whole_calls(trace: &str) -> Vec<String> {
    const BEGINS: &str = " <unfinished ...>";
    let mut begun: BTreeMap<&str, &str> = BTreeMap::new();
    let mut whole = Vec::new();
    for line in trace.lines() {
        let thread = line.split(' ').next().unwrap_or_default();
        if let Some(beginning) = line.strip_suffix(BEGINS) {
            begun.insert(thread, beginning);
        } else if let Some((_, end)) = line.split_once(" resumed>") {
            whole.push(format!("{}{end}", begun.remove(thread).unwrap_or_default()));
        } else {
            whole.push(line.to_owned());
        }
    }
    whole
}

/// The paths that a call names: `3</a>, "b"` is `/a/b`.
fn operands(call: &str) -> Vec<String> {
    let parts: Vec<&str> = call.split('"').collect();
    let names = parts.iter().enumerate().filter(|(i, _)| i % 2 == 1);
    let path = |(i, name): (usize, &&str)| {
        let before = parts[i - 1];
        let folder = before.rfind('<').and_then(|at| before[at + 1..].split('>').next()).unwrap_or("");
        if name.starts_with('/') { (*name).to_owned() } else { format!("{folder}/{name}") }
    };
    names.map(path).collect()
}

#[test]
fn nothing_outside_of_its_folders_is_ever_opened_whatever_lies_in_the_inbox() {
    if !can_trace_nobody() {
        eprintln!("skipped: only root can run strace as another user (apt-get install strace)");
        return;
    }
    let mut w = Watched::new(&["--recursive", "--jobs", "2", "--inputs"]);
    let done = w.beside("done");
    w.add_argument(&format!("move:{}", done.display()));
    group_inbox(&w);
    hostile(&w);
    w.drop_in("good.stl", &disk(5, 0.0));
    // This one gets a process of its own.
    w.drop_in("sub/large.stl", &disk(80, 0.0));
    let trace = w.beside("trace");
    fs::write(&trace, "").and_then(|()| chown(&trace, Some(NOBODY), Some(NOBODY))).expect("given away");
    let mut command = Command::new("strace");
    command.args(["-f", "-y", "-qq", "-s", "4096", "-e", "signal=none", "-e", &format!("trace={CALLS}")]);
    command.arg("-o").arg(&trace).arg(env!("CARGO_BIN_EXE_planish")).args(w.arguments());
    command.stderr(w.log_file()).uid(NOBODY).gid(NOBODY).current_dir("/");
    w.start_as(&mut command);
    w.wait_until("the good ones are put away", |_| {
        done.join("good.stl").exists() && done.join("sub/large.stl").exists()
    });
    w.wait_until("the others are looked at", |w| w.out.of("far.gltf").exists() && w.status()["notables"] == 1);
    let traced = fs::read_to_string(&trace).expect("text");
    w.end_traced();
    let allowed = [w.inbox(), w.out.path().to_owned(), done.clone()];
    let mut seen = 0;
    for line in whole_calls(&traced) {
        for path in reached(&line) {
            let of_the_system = OF_THE_SYSTEM.iter().any(|prefix| path.starts_with(prefix));
            let own = allowed.iter().any(|folder| Path::new(&path).starts_with(folder));
            // Folders above its own are opened, to go down from there and to bring names to disk, but nothing in them.
            let above = line.contains("O_DIRECTORY") && allowed.iter().any(|folder| folder.starts_with(&path));
            let program = path == env!("CARGO_BIN_EXE_planish");
            assert!(of_the_system || own || above || program, "{path}: {line}");
            assert!(!path.starts_with("/proc/self/environ"), "{line}");
            seen += usize::from(own);
        }
    }
    assert!(seen > 100, "only {seen} calls were seen: the test has lost its sense");
    assert!(traced.contains("good.stl") && traced.contains("large.stl"));
    assert_eq!(names(&w.beside("outside")).len(), 2, "nor was anything changed there");
}

#[test]
fn a_line_of_strace_is_understood() {
    let line = r#"7 openat(3</tmp/in>, "a.stl", O_RDONLY|O_CLOEXEC) = 4</tmp/outside/b.stl>"#;
    assert_eq!(reached(line), ["/tmp/outside/b.stl"]);
    let line = r#"7 renameat2(3</tmp/in>, "a", 5</tmp/in/.h>, "b", RENAME_NOREPLACE) = 0"#;
    assert_eq!(reached(line), ["/tmp/in/a", "/tmp/in/.h/b"]);
    let line = r#"7 openat(AT_FDCWD</>, "/etc/shadow", O_RDONLY) = -1 EACCES (Permission denied)"#;
    assert!(reached(line).is_empty());
    let line = r#"7 unlinkat(AT_FDCWD</work>, "x/y", 0) = 0"#;
    assert_eq!(reached(line), ["/work/x/y"]);
    let interrupted = "7  openat(3</in>, \"a\", O_RDONLY|O_DIRECTORY <unfinished ...>\n\
                       8  unlinkat(4</in>, \"b\", 0 <unfinished ...>\n\
                       7  <... openat resumed>)             = 20</in/a>\n\
                       8  <... unlinkat resumed>)           = 0";
    let calls = whole_calls(interrupted);
    assert!(calls[0].contains("O_DIRECTORY") && calls.len() == 2, "{calls:?}");
    assert_eq!((reached(&calls[0]), reached(&calls[1])), (vec!["/in/a".to_owned()], vec!["/in/b".to_owned()]));
}
