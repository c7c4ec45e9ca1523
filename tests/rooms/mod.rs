//! Who may import whom: every path in the code stays within the tables of docs/architecture.md, and the tables lead in no
//! circle. So the picture that the document draws is that of the code.
//!
//! A **room** is a folder or a file directly below `src/` or `pipeline/src/`. Code behind `#[cfg(test)]` is passed over:
//! tests may look at everything.

mod source;

use source::Source;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Which rooms a room may import.
type Table = BTreeMap<String, BTreeSet<String>>;

/// Code of one crate, by file.
struct Code {
    files: Vec<(PathBuf, Source)>,
}

impl Code {
    /// All files in a folder.
    fn of_folder(top: &Path) -> Self {
        let below = walkdir::WalkDir::new(top).sort_by_file_name().into_iter().flatten();
        let paths = below.map(walkdir::DirEntry::into_path).filter(|path| path.extension().is_some_and(|e| e == "rs"));
        let named = paths.map(|path| {
            let text = std::fs::read_to_string(&path).expect("readable");
            (path.strip_prefix(top).expect("inside").to_owned(), text)
        });
        Self::new(named)
    }

    fn new(files: impl Iterator<Item = (PathBuf, String)>) -> Self {
        let all: Vec<_> = files.map(|(path, text)| (path, Source::new(&text))).collect();
        let of_tests: Vec<PathBuf> = all.iter().flat_map(|(path, source)| source.test_files(path)).collect();
        let is_of_tests = |path: &Path| of_tests.iter().any(|test| path.starts_with(test));
        Self { files: all.into_iter().filter(|(path, _)| !is_of_tests(path)).collect() }
    }

    /// The names of all rooms.
    fn rooms(&self) -> BTreeSet<String> {
        let rooms = self.files.iter().map(|(path, _)| room(path));
        rooms.filter(|room| !["lib", "main"].contains(&room.as_str())).collect()
    }

    /// In which room a name is that the crate's root makes its own by `pub use`.
    fn exported(&self) -> BTreeMap<String, String> {
        let root = self.files.iter().find(|(path, _)| path == Path::new("lib.rs"));
        root.map(|(_, source)| source.exports()).unwrap_or_default()
    }

    /// All imports of one room by another: the file, the room that it is in, and the room that it imports.
    fn imports(&self) -> Vec<(&Path, String, String)> {
        let (rooms, exported) = (self.rooms(), self.exported());
        let mut found = Vec::new();
        for (path, source) in &self.files {
            let from = room(path);
            let named = source.paths_of("crate").into_iter().chain(source.paths_out_of(path));
            for name in named {
                let to = exported.get(&name).filter(|_| !rooms.contains(&name)).unwrap_or(&name).clone();
                if to != from && (rooms.contains(&to) || to == "*") {
                    found.push((path.as_path(), from.clone(), to));
                }
            }
            if source.names("planish_core") {
                found.push((path.as_path(), from, "core".to_owned()));
            }
        }
        found
    }
}

/// The room of a file.
fn room(path: &Path) -> String {
    let first = path.components().next().expect("a name").as_os_str().to_string_lossy().into_owned();
    first.trim_end_matches(".rs").to_owned()
}

/// The table behind a line that begins like this: its first two columns.
fn table(document: &str, header: &str) -> Vec<(String, Vec<String>)> {
    let rows = document.lines().skip_while(|line| !line.starts_with(header)).skip(2);
    let cells = |line: &str| line.trim_matches('|').split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let found: Vec<_> = rows
        .take_while(|line| line.starts_with('|'))
        .map(cells)
        .map(|cells| (words(&cells[0]).concat(), words(&cells[1])))
        .collect();
    assert!(!found.is_empty(), "docs/architecture.md has no table that begins with {header}");
    found
}

/// The words of a cell, without their marks as code.
fn words(cell: &str) -> Vec<String> {
    let words = cell.split(',').map(|word| word.trim().trim_matches('`').to_owned());
    words.filter(|word| !word.is_empty() && word != "—").collect()
}

fn allowed(rows: Vec<(String, Vec<String>)>) -> Table {
    rows.into_iter().map(|(room, others)| (room, others.into_iter().collect())).collect()
}

/// What is wrong with a table as such, and with the code that it is about.
fn violations(table: &Table, code: &Code) -> Vec<String> {
    let mut wrong: Vec<String> = cycle(table).into_iter().collect();
    let rooms = code.rooms();
    wrong.extend(
        rooms.iter().filter(|room| !table.contains_key(*room)).map(|room| format!("{room} is not in the table")),
    );
    let named = table.iter().flat_map(|(room, others)| std::iter::once(room).chain(others));
    let unknown: BTreeSet<_> = named.filter(|room| !rooms.contains(*room) && *room != "core").collect();
    wrong.extend(unknown.into_iter().map(|room| format!("{room} is in the table, and not in the code")));
    for (path, from, to) in code.imports() {
        if ["lib", "main"].contains(&from.as_str()) {
            continue;
        }
        if !table.get(&from).is_some_and(|others| others.contains(&to)) {
            wrong.push(format!("{}: {from} may not import {to}", path.display()));
        }
    }
    let used: BTreeSet<_> = code.imports().into_iter().map(|(_, from, to)| (from, to)).collect();
    for (room, others) in table {
        let idle = others.iter().filter(|to| !used.contains(&(room.clone(), (*to).clone())));
        wrong.extend(idle.map(|to| format!("{room} may import {to}, and never does")));
    }
    wrong
}

/// A circle of rooms that may import each other.
fn cycle(table: &Table) -> Option<String> {
    let mut left = table.clone();
    loop {
        let remaining: BTreeSet<String> = left.keys().cloned().collect();
        let leaf = left.iter().find(|(_, others)| others.is_disjoint(&remaining)).map(|(room, _)| room.clone());
        match leaf {
            Some(room) => drop(left.remove(&room)),
            None if left.is_empty() => return None,
            None => return Some(format!("these rooms import each other in a circle: {remaining:?}")),
        }
    }
}

fn document() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/architecture.md")).expect("there")
}

fn code_of(folder: &str) -> Code {
    Code::of_folder(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder))
}

#[test]
fn the_shell_stays_within_its_table() {
    let table = allowed(table(&document(), "| room of the shell | may import |"));
    assert_eq!(violations(&table, &code_of("src")), [""; 0]);
}

#[test]
fn the_core_stays_within_its_table() {
    let table = allowed(table(&document(), "| room of the core | may import |"));
    assert_eq!(violations(&table, &code_of("pipeline/src")), [""; 0]);
}

/// The files that name a crate, and where the table says that they may.
fn misplaced(name: &str, places: &[String], code: &[(&str, &Code)]) -> Vec<String> {
    let mut wrong = Vec::new();
    let mut is_used = false;
    for (top, code) in code {
        for (path, _) in code.files.iter().filter(|(_, source)| source.names(name)) {
            let path = Path::new(top).join(path);
            let is_allowed = places.iter().any(|place| path.starts_with(place));
            is_used |= is_allowed;
            if !is_allowed {
                wrong.push(format!("{} names {name}", path.display()));
            }
        }
    }
    if !is_used {
        wrong.push(format!("nothing names {name}"));
    }
    wrong
}

#[test]
fn crates_that_steer_threads_and_solve_systems_are_named_where_the_table_says() {
    let (shell, core) = (code_of("src"), code_of("pipeline/src"));
    let code = [("src", &shell), ("pipeline/src", &core)];
    let rows = table(&document(), "| crate | named in |");
    assert!(["notify", "crossbeam_channel", "faer"].iter().all(|name| rows.iter().any(|(row, _)| row == name)));
    let wrong: Vec<_> = rows.iter().flat_map(|(name, places)| misplaced(name, places, &code)).collect();
    assert_eq!(wrong, [""; 0]);
}

/// Values in, values out: these rooms touch neither disk nor threads.
#[test]
fn rooms_of_values_touch_no_disk_and_start_no_thread() {
    let shell = code_of("src");
    for room in table(&document(), "| room of values | why |").into_iter().map(|(room, _)| room) {
        let files: Vec<_> = shell.files.iter().filter(|(path, _)| self::room(path) == room).collect();
        assert!(!files.is_empty(), "there is no room {room}");
        for (path, source) in files {
            for name in ["std::fs", "std::thread", "rustix"] {
                assert!(!source.holds_path(name), "{} names {name}", path.display());
            }
        }
    }
}

/// Code that is small enough to be seen through.
fn small(files: &[(&str, &str)]) -> Code {
    Code::new(files.iter().map(|(path, text)| (PathBuf::from(path), (*text).to_owned())))
}

const SMALL: &str = "\
| room of the shell | may import |
|---|---|
| `floor` | — |
| `middle` | `floor` |
| `top` | `floor`, `middle` |
";

fn small_table() -> Table {
    allowed(table(SMALL, "| room of the shell"))
}

const GOOD: [(&str, &str); 4] = [
    ("lib.rs", "pub mod floor; pub mod middle; pub mod top; pub use middle::Thing;"),
    ("floor/mod.rs", "mod below; use self::below::x;\n#[cfg(test)]\nmod tests { use crate::top::all; }"),
    (
        "middle.rs",
        "// crate::top is not named here, nor in \"crate::top\"\nuse crate::floor::{x, y}; pub struct Thing;",
    ),
    ("top/mod.rs", "use crate::{Thing, floor::x};\n#[cfg(test)]\nmod scenes;"),
];

#[test]
fn code_within_its_table_is_passed() {
    assert_eq!(violations(&small_table(), &small(&GOOD)), [""; 0]);
}

#[test]
fn every_way_out_of_the_table_is_found() {
    let broken = |path: &'static str, text: &'static str| {
        let mut files: Vec<_> = GOOD.iter().copied().filter(|(name, _)| *name != path).collect();
        files.push((path, text));
        violations(&small_table(), &small(&files)).join("\n")
    };
    for text in [
        "use crate::top::all;",
        "fn f() { crate::top::all() }",
        "use crate::{\n    floor::{x, y},\n    top::{self},\n};",
        "use super::top;",
        "mod inner { use super::super::top::x; }",
        "const C: char = '\"'; use crate::top::x; const D: char = '\"';",
        "#[cfg(test)]\nmod tests { fn f() { '{' } } use crate::top::x;",
    ] {
        let text: &str = format!("use crate::floor::x; {text}").leak();
        assert!(broken("middle.rs", text).contains("middle.rs: middle may not import top"), "{text}");
    }
    assert!(broken("floor/mod.rs", "use crate::Thing;").contains("floor may not import middle"), "by way of the root");
    assert!(broken("floor/deep/er.rs", "use super::super::super::top;").contains("floor may not import top"));
    assert!(broken("floor/mod.rs", "use crate::*;").contains("floor may not import *"));
    assert!(broken("floor/mod.rs", "use planish_core::x;").contains("floor may not import core"));
    assert!(broken("cellar.rs", "").contains("cellar is not in the table"));
    assert!(broken("top/mod.rs", "use crate::floor::x;").contains("top may import middle, and never does"));
    assert_eq!(broken("top/scenes.rs", "use crate::middle::x;"), "", "what only tests see is passed over");
}

#[test]
fn a_circle_and_a_room_that_is_gone_are_found_in_the_table() {
    let circle = SMALL.replace("| `floor` | — |", "| `floor` | `top` |");
    assert!(cycle(&allowed(table(&circle, "| room of the shell"))).expect("a circle").contains("floor"));
    assert_eq!(cycle(&small_table()), None);
    let gone = format!("{SMALL}| `attic` | `floor` |\n");
    let wrong = violations(&allowed(table(&gone, "| room of the shell")), &small(&GOOD));
    assert!(wrong.contains(&"attic is in the table, and not in the code".to_owned()), "{wrong:?}");
}

#[test]
fn a_crate_in_another_place_is_found() {
    let code = small(&[("watch/mod.rs", "use notify::Watcher;"), ("top.rs", "fn f() { notify::x(); sd_notify::y() }")]);
    let wrong = misplaced("notify", &["src/watch".to_owned()], &[("src", &code)]);
    assert_eq!(wrong, ["src/top.rs names notify"]);
    assert_eq!(misplaced("faer", &[], &[("src", &code)]), ["nothing names faer"]);
}
