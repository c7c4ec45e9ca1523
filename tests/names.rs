//! Names of files and names in files, chosen by somebody who means no good: they stay data. Nothing is written outside of
//! the result folder, every result parses, and no terminal sees a control character.

use crate::daemon::{Watched, disk};
use crate::support::{Ended, Out, planish};
use planish::outcome::{Code, Status};
use planish::report::Report;
use serde_json::Value;
use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;
use std::process::Command;

/// Names without their extension. Two differ in what is no UTF-8 only, two in how an accent is written.
const STEMS: [&[u8]; 34] = [
    b"new\nline",
    b"planish: b.stl: certified\r",
    b"tab\t",
    b"\x1b[31mred\x1b[0m",
    b"\x1b]0;title\x07",
    b"delete\x7f\x08",
    b"\xc2\x9b31mc1",
    b"right\xe2\x80\xaeto left",
    b"separator\xe2\x80\xa8\xe2\x80\x8b",
    b"not utf-8 \xff",
    b"not utf-8 \xfe",
    b"half a letter \xe2\x82",
    b"e\xcc\x81",
    b"\xc3\xa9",
    b"\xf0\x9f\x98\x80",
    b"-",
    b"--out",
    b"a b",
    b"%2e%2e%2f",
    b"<script>alert(1)<script>",
    b"&\"'<>",
    b"]]>",
    b"--><!--",
    b"{\"a\": 1}",
    b"{name}{{",
    b"$(touch pwned)",
    b"`touch pwned`; touch pwned",
    b"*?[a-z]",
    b"up\\..\\..",
    b"CON",
    b"report.json",
    b"surface.vtu",
    b"~",
    &[b'n'; 251],
];

/// The names of files, half of which hold a disk and the others a message.
fn odd_names() -> Vec<(OsString, Vec<u8>)> {
    let contents = [disk(3, 0.0), b"solid a\nfacet\nnormal \x1b[2J\xff\xe2\x80\xae\n".to_vec()];
    let named = |(i, stem): (usize, &&[u8])| {
        (OsStr::from_bytes(&[stem, &b".stl"[..]].concat()).to_owned(), contents[i % 2].clone())
    };
    STEMS.iter().enumerate().map(named).collect()
}

/// A command that shows which name it was given, on every result.
const HOOK: &str =
    "[[on_certified]]\ncommand = [\"sh\", \"-c\", \"printf %s \\\"$1\\\" > given\", \"sh\", \"{name}\"]\n";

fn assert_harmless(text: &str) {
    let harmful =
        |c: char| (c.is_control() && c != '\n') || matches!(c, '\u{200b}'..='\u{200f}' | '\u{2028}'..='\u{202e}');
    let line = text.lines().find(|line| line.contains(harmful));
    assert!(line.is_none(), "{line:?}");
}

/// What is said is harmless, and every line on standard error is planish's own.
fn assert_tame(ended: &Ended) {
    assert_harmless(&ended.out);
    assert_harmless(&ended.err);
    let own =
        |line: &str| line.starts_with("planish: in") || line.starts_with("20") || line.starts_with("planish: out");
    assert!(ended.err.lines().all(own), "{}", ended.err);
    assert!(!ended.out.lines().any(|line| line.starts_with("planish: b.stl")), "{}", ended.out);
}

fn names(folder: &Path) -> BTreeSet<OsString> {
    fs::read_dir(folder).expect("a folder").flatten().map(|e| e.file_name()).collect()
}

/// The results of the odd names in `out`: each has its folder, and nothing of the name is in any file but the report.
fn assert_results(out: &Path, more: &[&str]) {
    let expected = odd_names().into_iter().map(|(name, _)| name).chain(more.iter().map(OsString::from));
    assert_eq!(names(out), expected.chain([".planish".into()]).collect());
    let (_, plain) = Out::new().run_bytes("plain.stl", &disk(3, 0.0));
    for (i, (name, _)) in odd_names().into_iter().enumerate() {
        let text = fs::read_to_string(out.join(&name).join("report.json")).expect("UTF-8");
        assert_harmless(&text);
        let report: Report = serde_json::from_str(&text).expect("JSON");
        assert_eq!(report.input.name, name.to_string_lossy());
        if i % 2 == 0 {
            assert_eq!((report.status, &report.outputs), (Status::Certified, &plain.outputs), "{name:?}");
            assert_eq!(fs::read(out.join(&name).join("given")).expect("the command ran"), name.as_bytes());
            let hooks = fs::read_to_string(out.join(&name).join("hooks.json")).expect("UTF-8");
            let hooks: Value = serde_json::from_str(&hooks).expect("JSON");
            assert_eq!(hooks["commands"][0]["command"][4], *name.to_string_lossy());
        } else {
            let reason = report.reason.expect("a reason");
            assert_eq!((reason.code, reason.location.as_deref()), (Code::Malformed, Some("line 3")), "{name:?}");
            assert_eq!(names(&out.join(&name)).len(), 1);
        }
    }
}

#[test]
fn odd_names_are_data_for_every_verb() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir(folder.path().join("in")).expect("made");
    fs::write(folder.path().join("planish.toml"), HOOK).expect("written");
    odd_names()
        .iter()
        .for_each(|(name, bytes)| fs::write(folder.path().join("in").join(name), bytes).expect("written"));
    let call = |at: &str, args: &[&OsStr]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_planish"));
        let ended = command.current_dir(folder.path().join(at)).args(args).output().expect("starts");
        let text = |bytes| String::from_utf8(bytes).expect("UTF-8");
        Ended { code: ended.status.code(), out: text(ended.stdout), err: text(ended.stderr) }
    };
    let words = |text: &'static str| text.split(' ').map(OsStr::new).collect::<Vec<_>>();
    let ended = call("", &words("run in -v --out out --config planish.toml"));
    assert_eq!(ended.code, Some(1), "{}", ended.err);
    assert_tame(&ended);
    for name in [r"new\nline.stl", r"not utf-8 \xff.stl", r"not utf-8 \xfe.stl", r"right\u{202e}to left.stl"] {
        assert!(ended.out.contains(name), "{}", ended.out);
    }
    assert_results(&folder.path().join("out"), &[]);
    for text in ["status --out out", "status --json --out out", "info in", "info --json in", "run in --out out -vvv"] {
        let ended = call("", &words(text));
        assert_eq!(ended.code, Some(1), "{text}");
        assert_harmless(&ended.out);
        assert_harmless(&ended.err);
        if text.contains("json") {
            let objects = ended.out.lines().filter(|l| serde_json::from_str::<Value>(l).is_ok_and(|v| v.is_object()));
            assert_eq!(objects.count(), ended.out.lines().count(), "{text}");
        }
    }
    let results: Vec<OsString> =
        names(&folder.path().join("out")).into_iter().map(|n| Path::new("out").join(n).into()).collect();
    let check: Vec<&OsStr> = std::iter::once("check".as_ref()).chain(results.iter().map(|r| r.as_os_str())).collect();
    let ended = call("", &check);
    assert_tame(&ended);
    assert_eq!(ended.out.lines().filter(|l| l.contains("proven one-to-one")).count(), STEMS.len() / 2, "{}", ended.err);
    // By their names alone, beside names that planish itself uses.
    let own = ["..stl", ".planish", ".planish.stl", "report.json", "lock"];
    own.iter().for_each(|name| fs::write(folder.path().join("in").join(name), "x").expect("written"));
    let named = names(&folder.path().join("in"));
    let mut args = words("run --out ../out2 --config ../planish.toml --");
    args.extend(named.iter().map(|name| name.as_os_str()));
    let ended = call("in", &args);
    assert_eq!(ended.code, Some(1), "{}", ended.err);
    assert_harmless(&ended.err);
    assert!(ended.err.contains("planish: .planish: ../out2/.planish is there already"), "{}", ended.err);
    assert_results(&folder.path().join("out2"), &["..stl", ".planish.stl", "report.json", "lock"]);
    assert_eq!(names(folder.path()), ["in", "out", "out2", "planish.toml"].map(OsString::from).into());
    assert_eq!(names(&folder.path().join("in")), named, "nothing was written there");
}

#[test]
fn odd_names_may_be_dropped_also_into_odd_folders() {
    let mut w = Watched::configured(HOOK, &["--recursive"]);
    let folders = ["sub\n\u{1b}[31m", "sub\n\u{1b}[31m/report.json", "x.stl"];
    folders.iter().for_each(|folder| fs::create_dir(w.inbox().join(folder)).expect("made"));
    let deep = folders.map(|folder| Path::new(folder).join("a.stl"));
    odd_names().iter().for_each(|(name, bytes)| fs::write(w.inbox().join(name), bytes).expect("written"));
    deep.iter().for_each(|name| fs::write(w.inbox().join(name), disk(3, 0.0)).expect("written"));
    w.start();
    let has_result = |w: &Watched, name: &Path| w.out.path().join(name).join("report.json").is_file();
    w.wait_until("all are done", |w| {
        odd_names().iter().all(|(name, _)| has_result(w, name.as_ref())) && deep.iter().all(|name| has_result(w, name))
    });
    w.wait_until("all commands have run", |w| {
        let all = odd_names().into_iter().step_by(2).map(|(name, _)| name.into()).chain(deep.clone());
        all.into_iter().all(|name: std::path::PathBuf| w.out.path().join(name).join("hooks.json").is_file())
    });
    let status = planish(["status".as_ref(), "--out".as_ref(), w.out.path().as_os_str()]);
    assert_harmless(&status.out);
    assert!(status.out.contains(&format!("results: {} certified", STEMS.len() / 2 + deep.len())), "{}", status.out);
    w.stop();
    assert!(
        w.log().lines().all(|line| serde_json::from_str::<Value>(line).is_ok_and(|v| v.is_object())),
        "{}",
        w.log()
    );
    assert_results(w.out.path(), &[folders[0], folders[2]]);
    assert_eq!(names(&w.inbox()).len(), STEMS.len() + 2);
}

/// A name that a file may hold, as it stands in JSON, too.
const INSIDE: &str = "\u{1b}[31m<b>&\"'\\]]>\u{202e}\u{9b}2J";

#[test]
fn names_in_files_come_through_and_harm_nothing() {
    let json = serde_json::to_string(INSIDE).expect("JSON");
    let node = format!("{{\"name\": {json}, \"mesh\": 0}}");
    let document = |buffer: &str| {
        format!(
            "{{\"asset\": {{\"version\": \"2.0\"}}, \"scenes\": [{{\"name\": {json}, \"nodes\": [0]}}], \"nodes\": [{node}],
              \"meshes\": [{{\"name\": {json}, \"primitives\": [{{\"attributes\": {{\"POSITION\": 0}}}}]}}],
              \"accessors\": [{{\"bufferView\": 0, \"componentType\": 5126, \"count\": 3, \"type\": \"VEC3\"}}],
              \"bufferViews\": [{{\"buffer\": 0, \"byteLength\": 36}}], \"buffers\": [{{\"byteLength\": 36, {buffer}}}]}}"
        )
    };
    // The corners 0 0 0, 1 0 0, 0 1 0 as floats.
    let data = "\"uri\": \"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"";
    let facet = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let msh = "$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n$Elements\n1\n1 2 2 1 1 1 2 3\n$EndElements\n";
    let ply = |element: &str| {
        format!(
            "ply\nformat ascii 1.0\ncomment {INSIDE}\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             element face 1\nproperty list uchar int vertex_indices\n{element}end_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"
        )
    };
    let vtk = |arrays: &str| {
        format!(
            "# vtk DataFile Version 3.0\n{INSIDE}\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n\
             POLYGONS 1 4\n3 0 1 2\n{arrays}"
        )
    };
    let good = [
        ("a.stl", format!("solid {INSIDE}\n{facet}endsolid {INSIDE}\n")),
        ("a.obj", format!("o {INSIDE}\nv 0 0 0\nv 1 0 0\nv 0 1 0\ng {INSIDE}\nf 1 2 3\nusemtl {INSIDE}\n")),
        ("a.gltf", document(data)),
        (
            "a.msh",
            format!(
                "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 1 \"{INSIDE}\"\n$EndPhysicalNames\n{msh}"
            ),
        ),
        ("a.ply", ply("")),
        ("a.vtk", vtk("POINT_DATA 3\nSCALARS \u{1b}[31m float\nLOOKUP_TABLE default\n1 2 3\n")),
    ];
    for (name, text) in good {
        let out = Out::new();
        let (ended, report) = out.run_bytes_with(name, text.as_bytes(), &["-vvv"]);
        assert_eq!(ended.code, Some(0), "{name}: {}", ended.err);
        assert_harmless(&ended.err);
        assert_harmless(&String::from_utf8(out.read(name, "report.json")).expect("UTF-8"));
        let names = report.content.expect("read").names;
        assert!(
            names.iter().all(|n| n == INSIDE) && (!names.is_empty() || ["a.ply", "a.vtk"].contains(&name)),
            "{names:?}"
        );
    }
    let long = format!("\"{}\u{9b}", "\\u001b[31m".repeat(10_000));
    let bad = [
        ("b.stl", format!("solid {INSIDE}\nfacet normal 0 0 1\n{INSIDE}\nvertex\n")),
        ("b.obj", format!("v 0 0 {INSIDE}\n")),
        ("b.gltf", document("\"uri\": \"right\u{202e}\u{200b}to left.bin\"")),
        ("c.gltf", document(&format!("\"uri\": {json}"))),
        ("d.gltf", document(data).replace("\"count\": 3", &format!("\"count\": {long}\""))),
        ("e.gltf", document(data).replace("\"asset\"", &format!("\"extensionsRequired\": [{json}], \"asset\""))),
        ("b.msh", format!("$MeshFormat\n{INSIDE} 0 8\n$EndMeshFormat\n")),
        ("c.msh", format!("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n${INSIDE}\n")),
        ("b.ply", ply(&format!("element {INSIDE} 1\nproperty {INSIDE} x\n"))),
        ("c.ply", ply("element \u{1b}[31m 7\nproperty float \u{9b}x\n")),
        ("b.vtk", vtk("").replace("POLYDATA", "\u{1b}[31m\u{202e}")),
        ("c.vtk", vtk("").replace("POINTS", "\u{9b}2J")),
        ("b.vtu", format!("<VTKFile type=\"UnstructuredGrid\"><\u{202e}{INSIDE}></VTKFile>")),
        ("b.vtp", "<VTKFile type=\"PolyData\" \u{1b}=\"\u{9b}\"><PolyData></\u{202e}></VTKFile>".to_owned()),
    ];
    for (name, text) in bad {
        let (ended, report) = Out::new().run_bytes_with(name, text.as_bytes(), &["-vvv"]);
        assert_eq!((ended.code, report.status), (Some(1), Status::Refused), "{name}: {}", ended.err);
        let reason = report.reason.expect("a reason");
        assert_ne!(reason.code, Code::Internal, "{name}");
        assert!(reason.message.chars().count() < 2100, "{name}");
        assert_harmless(&reason.message);
        assert_harmless(&ended.err);
        assert_eq!(ended.err.lines().filter(|l| l.starts_with("planish: ")).count(), 1, "{name}: {}", ended.err);
    }
}
