//! What takes too long for every change: `run.sh` beside this file runs it, and all real files.
//!
//! Each of these says on standard error what it has run and seen, in a line that begins with `full:`. What there is stands
//! in [`HEAVY`]; a test that is ignored and does not stand there fails the quick ones, so that none is forgotten.

mod load;

use crate::daemon::killing;
use std::path::Path;

/// A test that takes long.
struct Heavy {
    name: &'static str,
    takes: &'static str,
}

/// All of them, with how long they take. What they run:
///
/// * publishing and putting away, killed, cut off from power, failing and disturbed at every operation of the disk;
/// * 300 kills of the real daemon, and one clean run;
/// * small and large inputs, refusals, changes and removals without a pause (PLANISH_FULL_SECONDS: for so long).
const HEAVY: [Heavy; 3] = [
    Heavy { name: "full_kills_failures_and_others_at_every_operation", takes: "minutes" },
    Heavy { name: "full_three_hundred_kills_leave_every_result_whole_and_nothing_else", takes: "ten minutes" },
    Heavy { name: "full_an_hour_of_mixed_load_takes_no_more_memory_handles_or_threads", takes: "an hour" },
];

#[test]
#[ignore = "takes ten minutes"]
fn full_three_hundred_kills_leave_every_result_whole_and_nothing_else() {
    killing::kill_and_look(300);
    eprintln!("full: 300 kills, every result whole, nothing else");
}

/// The tests in a text that are ignored, with the reasons.
fn ignored(text: &str) -> Vec<(String, String)> {
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let mut found = Vec::new();
    for (at, line) in lines.iter().enumerate() {
        let Some(reason) = line.strip_prefix("#[ignore") else { continue };
        let reason = reason.trim_matches([' ', '=', '"', ']']).to_owned();
        let name = lines[at..].iter().find_map(|line| line.strip_prefix("fn ")).unwrap_or_default();
        found.push((name.split('(').next().unwrap_or_default().to_owned(), reason));
    }
    found
}

#[test]
fn every_heavy_test_is_listed_and_no_other_is_ignored() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    for folder in ["src", "tests", "pipeline/src"] {
        let files = walkdir::WalkDir::new(top.join(folder)).into_iter().flatten();
        for file in files.filter(|file| file.path().extension().is_some_and(|e| e == "rs")) {
            found.extend(ignored(&std::fs::read_to_string(file.path()).expect("readable")));
        }
    }
    found.sort();
    let mut listed = HEAVY.map(|heavy| (heavy.name.to_owned(), format!("takes {}", heavy.takes)));
    listed.sort();
    assert_eq!(found, listed);
    let forgotten = ("forgotten".to_owned(), "slow".to_owned());
    assert_eq!(ignored("#[test]\n#[ignore = \"slow\"]\nfn forgotten() {}\n"), [forgotten]);
}
