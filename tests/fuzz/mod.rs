//! Every reader, fed with files that are nearly right: no panic, no hang, no memory out of proportion.
//!
//! The seeds are the files of the matrix: one small surface in every format and encoding that VTK, meshio and Gmsh write.
//! CI does some ten thousand mutations for each reader; `PLANISH_FUZZ=1000000 cargo test --release fuzz -- --nocapture`
//! does a million.

mod mutate;

use crate::interop::matrix;
use mutate::mutations;
use planish::formats::{Format, Kind, kind, read_alone};
use planish::outcome::Code;
use std::collections::BTreeMap;
use std::panic::catch_unwind;
use std::time::{Duration, Instant};

/// Mutations for each reader, where nothing else is said.
const ROUNDS: u64 = 30_000;

/// Memory that the process may take at most beyond what it had, in KiB.
const MEMORY: u64 = 1 << 20;

/// What became of the mutations of one reader.
#[derive(Default)]
struct Tally {
    inputs: u64,
    read: u64,
    codes: BTreeMap<String, u64>,
    slowest: Duration,
}

/// Small files of every format, by their readers.
fn seeds() -> BTreeMap<String, (Format, Vec<Vec<u8>>)> {
    let mut seeds: BTreeMap<String, (Format, Vec<Vec<u8>>)> = BTreeMap::new();
    let mut add = |name: &str, bytes: Vec<u8>| {
        if let Kind::Mesh(format) = kind(name.as_ref()) {
            seeds.entry(format!("{format:?}")).or_insert((format, vec![])).1.push(bytes);
        }
    };
    matrix::files().into_iter().for_each(|(name, bytes)| add(&name, bytes));
    seeds
}

fn rounds() -> u64 {
    std::env::var("PLANISH_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(ROUNDS)
}

/// The most memory that the process ever had, in KiB.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or("0");
    line.trim().trim_end_matches(" kB").parse().unwrap_or(0)
}

fn feed(format: Format, files: &[Vec<u8>], rounds: u64) -> Tally {
    let mut tally = Tally::default();
    for (i, seed) in files.iter().enumerate() {
        let whole = read_alone(format, seed);
        assert!(whole.is_ok(), "{format:?}, seed {i}: {whole:?}");
    }
    let each = rounds.div_ceil(files.len() as u64);
    for bytes in files.iter().flat_map(|seed| mutations(seed, each)) {
        let began = Instant::now();
        let read = catch_unwind(|| read_alone(format, &bytes).map(drop).map_err(|e| e.reason()));
        tally.slowest = tally.slowest.max(began.elapsed());
        tally.inputs += 1;
        match read {
            Ok(Ok(())) => tally.read += 1,
            Ok(Err(reason)) => {
                assert!(!reason.message.is_empty() && reason.code != Code::Internal, "{reason:?}");
                *tally.codes.entry(reason.code.name()).or_insert(0) += 1;
            }
            Err(_) => {
                let path = std::env::temp_dir().join("planish-fuzz-crash");
                std::fs::write(&path, &bytes).expect("written");
                panic!("{format:?}: the reader broke down; its input is in {}", path.display());
            }
        }
    }
    tally
}

#[test]
fn readers_survive_files_that_are_nearly_right() {
    let before = peak();
    let seeds = seeds();
    assert!(seeds.len() >= 7, "{:?}", seeds.keys());
    for (name, (format, files)) in &seeds {
        let Tally { inputs, read, codes, slowest } = feed(*format, files, rounds());
        eprintln!("{name}: {inputs} inputs from {} seeds, {read} read, {codes:?}, slowest {slowest:?}", files.len());
        assert!(50 * read > inputs, "{name}: {read} of {inputs} are read: the mutations have lost their sense");
    }
    assert!(peak() < before + MEMORY, "{before} KiB before, {} KiB after", peak());
}
