//! Every reader, fed with files that are nearly right: no panic, no hang, no memory out of proportion.
//!
//! The seeds are one small surface in every format and encoding that VTK, meshio and Gmsh write, and some files that hold
//! what these do not write. CI does 300,000 mutations for each reader, which takes a minute;
//! `PLANISH_FUZZ=1000000 cargo test --release fuzz -- --nocapture` does a million. A file that breaks a reader is kept: made
//! as small as it can be, it becomes a test of that reader. `guided/` looks for more where there is a nightly toolchain.

mod large;
mod mutate;
mod seeds;

use mutate::{head, mutation};
use planish::formats::{Format, Limits, ReadError, read_alone};
use planish::outcome::{Code, Reason};
use rustix::time::{ClockId, clock_gettime};
use std::collections::BTreeMap;
use std::panic::catch_unwind;

/// Mutations for each reader, where nothing else is said.
const ROUNDS: u64 = 300_000;

/// Of a hundred mutations so many must get past the head of the file at least.
const PAST_THE_HEAD: u64 = 30;

/// Memory that a reader may take at most: this, and so much for each byte of the file, and for each byte that compressed or
/// repeated data may become.
const MEMORY: u64 = 1 << 20;
const PER_BYTE: u64 = 200;
const PER_UNPACKED: u64 = 4;

/// CPU seconds that a reader may take for a file of some kilobytes.
const SECONDS: f64 = 10.0;

/// What became of the mutations of one reader.
#[derive(Default)]
struct Tally {
    inputs: u64,
    past_the_head: u64,
    read: u64,
    codes: BTreeMap<String, u64>,
    /// CPU seconds of the slowest one, and its size.
    slowest: (f64, usize),
    /// Bytes of memory of the one that took the most, and its size.
    largest: (u64, usize),
}

fn rounds() -> u64 {
    std::env::var("PLANISH_FUZZ").ok().and_then(|n| n.parse().ok()).unwrap_or(ROUNDS)
}

/// The CPU seconds of this thread.
fn clock() -> f64 {
    let t = clock_gettime(ClockId::ThreadCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}

/// Reads a file, which must end well or with a refusal.
fn read(format: Format, bytes: &[u8]) -> Result<(), Reason> {
    let result = catch_unwind(|| read_alone(format, bytes).map(drop).map_err(|e: ReadError| e.reason()));
    result.unwrap_or_else(|_| keep(format, bytes, "the reader broke down"))
}

/// Keeps the input that did harm.
fn keep(format: Format, bytes: &[u8], problem: &str) -> ! {
    let path = std::env::temp_dir().join(format!("planish-fuzz-{format:?}").to_lowercase());
    std::fs::write(&path, bytes).expect("written");
    panic!("{format:?}: {problem}; the input is in {}", path.display());
}

/// Whether a refusal is about something behind the head of the file.
fn is_past_the_head(bytes: &[u8], reason: &Reason) -> bool {
    let Some(place) = &reason.location else {
        return matches!(reason.code, Code::NoTriangles | Code::TooLarge | Code::NotFinite);
    };
    if reason.code == Code::EmptyFile {
        return false;
    }
    let number = |word: &str| place.strip_prefix(word).and_then(|n| n.trim().parse::<usize>().ok());
    let offset = match (number("byte"), number("line")) {
        (Some(byte), _) => byte,
        (_, Some(line)) => bytes.split_inclusive(|b| *b == b'\n').take(line - 1).map(<[u8]>::len).sum(),
        // Parts of the document are named where it could be understood.
        _ => return !["asset.version", "extensionsRequired"].contains(&place.as_str()),
    };
    offset >= head::end(bytes)
}

impl Tally {
    fn feed(&mut self, format: Format, bytes: &[u8]) {
        let (began, mut result) = (clock(), Ok(()));
        let memory = allocation_counter::measure(|| result = read(format, bytes)).bytes_max;
        let took = clock() - began;
        let most = Limits::default().unpacked(bytes.len());
        let may_grow = matches!(format, Format::Gltf | Format::Vtu | Format::Vtp);
        let allowed = MEMORY + PER_BYTE * bytes.len() as u64 + if may_grow { PER_UNPACKED * most } else { 0 };
        if memory > allowed {
            keep(format, bytes, &format!("{memory} bytes of memory for {} bytes of file", bytes.len()));
        }
        if took > SECONDS {
            keep(format, bytes, &format!("{took} s"));
        }
        self.slowest = if took > self.slowest.0 { (took, bytes.len()) } else { self.slowest };
        self.largest = self.largest.max((memory, bytes.len()));
        self.count(bytes, result);
    }

    fn count(&mut self, bytes: &[u8], result: Result<(), Reason>) {
        self.inputs += 1;
        match result {
            Ok(()) => {
                self.read += 1;
                self.past_the_head += 1;
            }
            Err(reason) => {
                assert!(!reason.message.is_empty() && reason.code != Code::Internal, "{reason:?}");
                self.past_the_head += u64::from(is_past_the_head(bytes, &reason));
                *self.codes.entry(reason.code.name()).or_insert(0) += 1;
            }
        }
    }
}

/// Feeds one reader.
fn survives(format: Format) {
    let seeds = seeds::of(format);
    assert!(seeds.len() >= 4, "{format:?}: {} seeds", seeds.len());
    let mut tally = Tally::default();
    for (name, seed) in &seeds {
        let whole = read_alone(format, seed);
        assert!(whole.is_ok(), "{name}: {whole:?}");
        let each = rounds().div_ceil(seeds.len() as u64);
        (0..each).for_each(|round| tally.feed(format, &mutation(seed, round)));
    }
    let Tally { inputs, past_the_head, read, codes, slowest, largest } = tally;
    eprintln!(
        "{format:?}: {inputs} inputs from {} seeds, {past_the_head} past the head, {read} read; slowest {:.1} ms \
         ({} bytes), most memory {} KiB ({} bytes); {codes:?}",
        seeds.len(),
        1e3 * slowest.0,
        slowest.1,
        largest.0 / 1024,
        largest.1,
    );
    assert!(100 * past_the_head >= PAST_THE_HEAD * inputs, "{format:?}: the mutations have lost their sense");
    assert!(100 * read >= inputs && read < inputs, "{format:?}: {read} of {inputs} are read");
}

/// Every format that is read.
const FORMATS: [Format; 10] = [
    Format::Stl,
    Format::Obj,
    Format::Gltf,
    Format::Ply,
    Format::Msh,
    Format::Vtk,
    Format::Vtu,
    Format::Vtp,
    Format::Off,
    Format::Medit,
];

#[test]
fn readers_survive_files_that_are_nearly_right() {
    std::thread::scope(|threads| {
        let readers = FORMATS.map(|format| (format, threads.spawn(move || survives(format))));
        let broken = readers.map(|(format, reader)| reader.join().is_err().then_some(format));
        assert_eq!(broken, [None; 10], "see above");
    });
}
