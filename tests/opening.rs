//! Files that are none, that are too large, or that change while they are read: named, in a folder, or beside a document.

use crate::support::{Out, fixture};
use planish::outcome::{Code, Status};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use std::fs::{self, File};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// More than `limits.file`, none of it on disk.
const HUGE: u64 = 3 << 30;

fn pipe(path: &Path) {
    mknodat(CWD, path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("made");
}

fn sparse(path: &Path) {
    File::create(path).and_then(|file| file.set_len(HUGE)).expect("made");
}

/// A folder `in` of oddities; what is beside it is not meant for everybody.
fn oddities() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join("in").join(name);
    fs::create_dir_all(at("sub")).expect("made");
    fs::copy(fixture("disk.stl"), folder.path().join("outside.stl")).expect("copied");
    fs::copy(fixture("disk.stl"), at("sub/below.stl")).expect("copied");
    let links = [
        ("/dev/zero", "device.stl"),
        ("loop.stl", "loop.stl"),
        ("nowhere", "dangling.stl"),
        ("../outside.stl", "outer.stl"),
        ("sub/below.stl", "inner.stl"),
    ];
    links.iter().for_each(|(target, name)| symlink(target, at(name)).expect("linked"));
    pipe(&at("pipe.stl"));
    std::os::unix::net::UnixListener::bind(at("socket.stl")).expect("bound");
    sparse(&at("huge.stl"));
    fs::create_dir(at("folder.stl")).expect("made");
    folder
}

/// A name, what it is refused for (nothing where it is certified), and whether it leads out of its folder.
type End = (&'static str, Option<(Code, &'static str)>, bool);

/// A link that the user names is followed, one in a folder only where it stays in it.
const ENDS: [End; 8] = [
    ("device.stl", Some((Code::Unreadable, "it is no regular file")), true),
    ("loop.stl", Some((Code::Unreadable, "Too many levels of symbolic links")), false),
    ("dangling.stl", Some((Code::Unreadable, "No such file")), false),
    ("outer.stl", None, true),
    ("inner.stl", None, false),
    ("pipe.stl", Some((Code::Unreadable, "it is no regular file")), false),
    ("socket.stl", Some((Code::Unreadable, "it is no regular file")), false),
    ("huge.stl", Some((Code::TooLarge, "the file has 3221225472 bytes, more than 2147483648")), false),
];

#[test]
fn what_is_no_regular_file_is_refused_without_being_read() {
    let folder = oddities();
    let inbox = folder.path().join("in");
    let named: Vec<_> = ENDS.iter().map(|(name, ..)| inbox.join(name)).collect();
    let named: Vec<&Path> = named.iter().map(|path| path.as_path()).collect();
    for (inputs, in_folder) in [(&named[..], false), (&[&*inbox], true)] {
        let out = Out::new();
        let ended = out.run(inputs, &[]);
        assert_eq!(ended.code, Some(1), "{}", ended.err);
        for (name, end, leads_out) in ENDS {
            let end = if in_folder && leads_out { Some((Code::Unreadable, "leads out of the folder")) } else { end };
            let reason = out.report(name).reason;
            let Some((code, words)) = end else {
                assert_eq!((reason, out.report(name).status), (None, Status::Certified), "{name}");
                continue;
            };
            let reason = reason.expect(name);
            assert!(reason.code == code && reason.message.contains(words), "{name}: {reason:?}");
            assert!(out.report(name).input.blake3.is_none(), "{name}: not read");
        }
        let results = fs::read_dir(out.path()).expect("a folder").count();
        assert_eq!(results, ENDS.len() + 1, "no folder is taken for a file");
    }
}

#[test]
fn what_may_not_be_read_is_refused() {
    let inputs = tempfile::tempdir().expect("a folder");
    let path = inputs.path().join("a.stl");
    fs::copy(fixture("disk.stl"), &path).expect("copied");
    fs::set_permissions(&path, fs::Permissions::from_mode(0o0)).expect("set");
    // Nothing is forbidden to root.
    if File::open(&path).is_err() {
        let out = Out::new();
        assert_eq!(out.run(&[&path], &[]).code, Some(1));
        let reason = out.report("a.stl").reason.expect("a reason");
        assert!(reason.code == Code::Unreadable && reason.message.contains("Permission denied"), "{reason:?}");
    }
}

/// A triangle whose corners are in another file.
fn document(uri: &str) -> String {
    serde_json::json!({
        "asset": {"version": "2.0"},
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "buffers": [{"byteLength": 36, "uri": uri}]
    })
    .to_string()
}

#[test]
fn a_document_gets_regular_files_beside_it_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    let inbox = folder.path().join("in");
    let at = |name: &str| inbox.join(name);
    fs::create_dir_all(at("folder.bin")).expect("made");
    let data: Vec<u8> =
        [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|x| x.to_le_bytes()).collect();
    fs::write(at("right.bin"), &data).expect("written");
    fs::write(folder.path().join("secret.bin"), &data).expect("written");
    symlink("../secret.bin", at("outer.bin")).expect("linked");
    symlink("right.bin", at("inner.bin")).expect("linked");
    symlink("/dev/zero", at("device.bin")).expect("linked");
    pipe(&at("pipe.bin"));
    sparse(&at("huge.bin"));
    let [no_file, no_name] = ["is no regular file", "nothing is opened but files beside the document"];
    let ends = [
        ("right.bin", None),
        ("outer.bin", Some((Code::MissingFile, no_file))),
        ("inner.bin", Some((Code::MissingFile, no_file))),
        ("device.bin", Some((Code::MissingFile, no_file))),
        ("pipe.bin", Some((Code::MissingFile, no_file))),
        ("folder.bin", Some((Code::MissingFile, no_file))),
        ("huge.bin", Some((Code::MissingFile, "it has 3221225472 bytes, more than 2147483648"))),
        ("missing.bin", Some((Code::MissingFile, "No such file"))),
        ("../secret.bin", Some((Code::ForeignFile, no_name))),
        ("%2e%2e%2fsecret.bin", Some((Code::ForeignFile, no_name))),
        ("file:///dev/zero", Some((Code::ForeignFile, no_name))),
    ];
    for (i, (uri, _)) in ends.iter().enumerate() {
        fs::write(at(&format!("{i}.gltf")), document(uri)).expect("written");
    }
    let named: Vec<_> = (0..ends.len()).map(|i| at(&format!("{i}.gltf"))).collect();
    let named: Vec<&Path> = named.iter().map(|path| path.as_path()).collect();
    for inputs in [&named[..], &[&*inbox]] {
        let out = Out::new();
        assert_eq!(out.run(inputs, &[]).code, Some(1));
        for (i, (uri, end)) in ends.iter().enumerate() {
            let reason = out.report(&format!("{i}.gltf")).reason;
            let told = reason.as_ref().map(|reason| (reason.code, reason.message.as_str()));
            let as_expected = match (told, end) {
                (None, None) => true,
                (Some((code, message)), Some((expected, words))) => {
                    code == *expected && message.contains(words) && message.contains(uri)
                }
                _ => false,
            };
            assert!(as_expected, "{uri}: {reason:?}");
        }
    }
}

/// Whatever is caught of a file that grows and shrinks all the time, it is told; and it is not read for ever.
#[test]
fn a_file_that_changes_while_it_is_read_is_told() {
    let inputs = tempfile::tempdir().expect("a folder");
    let path = inputs.path().join("a.stl");
    let bytes = crate::daemon::disk(100, 0.0);
    fs::write(&path, &bytes).expect("written");
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let file = File::options().write(true).open(&path).expect("there");
            for size in (0..bytes.len() as u64).rev().step_by(997).cycle() {
                let size = size.max(84);
                file.set_len(bytes.len() as u64 + size * 50).and_then(|()| file.set_len(size)).expect("set");
                if is_over.load(Ordering::Relaxed) {
                    break;
                }
            }
        });
        for _ in 0..5 {
            let out = Out::new();
            let ended = out.run(&[&path], &[]);
            // The writer may sleep all the while: then there is too little of the file, or too much.
            let told = ["it changed while it was read; try again", "changed when it was opened", "[count_mismatch]"];
            assert!(ended.code == Some(1) && told.iter().any(|t| ended.err.contains(t)), "{}", ended.err);
        }
        is_over.store(true, Ordering::Relaxed);
    });
}
