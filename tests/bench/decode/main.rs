//! How fast binary files are decoded, and how much memory that takes.
//!
//! ```text
//! cargo run --release --example decode -- [--cut] [WORD...]
//! ```
//!
//! A surface of a million triangles is written in every binary format (those whose names hold one of the words, if there
//! are any). Each file is read by a process of its own, which tells the processor time of decoding, best of several, and
//! its largest memory: after decoding, and after the repair that makes a surface of the triangles. Points and triangles
//! are counted. With `--cut` the surface is also cut into charts, which takes longer, and more memory. Compressed files and base64 are there for information: the bound is one on plain binary data.

mod gltf;
mod msh;
mod ply;
mod stl;
mod surface;
mod text;
mod vtk;
mod xml;

use planish::formats::{self, Kind};
use planish_core::mesh::TriangleSoup;
use planish_core::monitor::NoMonitor;
use rustix::time::{ClockId, clock_gettime};
use std::error::Error;
use std::path::Path;
use std::process::Command;
use surface::Surface;

/// Decoding is repeated so often; the best time counts.
const TIMES: usize = 5;

/// Bytes per second of processor time that plain binary files must reach.
const BOUND: f64 = 400e6;

/// Seconds of processor time that a binary STL file of a million triangles may take, read and welded.
const WELDED: f64 = 1.0;

/// A file to be read.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    extension: &'static str,
    /// Whether the bound holds for it.
    plain: bool,
    encode: fn(&Surface) -> Vec<u8>,
    /// Points that it should give.
    points: fn(&Surface) -> usize,
}

impl Case {
    /// A plain binary file, in which each point is there once.
    const fn new(name: &'static str, extension: &'static str, encode: fn(&Surface) -> Vec<u8>) -> Self {
        Self { name, extension, plain: true, encode, points: |surface| surface.points.len() }
    }

    /// A file for information.
    const fn packed(self) -> Self {
        Self { plain: false, ..self }
    }

    /// A file with other points.
    const fn with_points(self, points: fn(&Surface) -> usize) -> Self {
        Self { points, ..self }
    }
}

/// What a process of its own found.
struct Measured {
    points: usize,
    triangles: usize,
    /// Seconds of processor time.
    decoding: f64,
    repair: f64,
    /// Bytes of memory at most, the file's own included.
    decoded: f64,
    repaired: f64,
    /// After the surface was cut; 0 if it was not.
    cut: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let is = |flag| words.first().is_some_and(|word| word == flag);
    let (read, cut) = (is("--read"), is("--cut"));
    if read {
        return measure(Path::new(&words[1]), words.len() > 2);
    }
    words.drain(..usize::from(cut));
    let cases = [stl::CASES, ply::CASES, gltf::CASES, msh::CASES, vtk::CASES, xml::CASES, text::CASES].concat();
    let named = |case: &&Case| words.is_empty() || words.iter().any(|w| case.name.contains(w.as_str()));
    let last = if cut { "cut*" } else { "" };
    println!("{:34} {:>9} {:>7} {:>7} {:>9} {:>9} {last:>7}", "", "MB", "CPU ms", "MB/s", "decoded*", "repaired*");
    let surface = Surface::new(708);
    let mut slow = Vec::new();
    for case in cases.iter().filter(named) {
        slow.extend((!run(case, &surface, cut)?).then_some(case.name));
    }
    println!("* bytes of memory at the peak per byte of the file\n");
    if slow.is_empty() { Ok(()) } else { Err(format!("too slow: {}", slow.join(", ")).into()) }
}

/// Measures a case and prints it; whether it is fast enough.
fn run(case: &Case, surface: &Surface, cut: bool) -> Result<bool, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let path = folder.path().join("surface").with_extension(case.extension);
    let bytes = (case.encode)(surface);
    std::fs::write(&path, &bytes)?;
    let measured = read_elsewhere(&path, cut)?;
    assert_eq!(measured.points, (case.points)(surface), "points of {}", case.name);
    assert_eq!(measured.triangles, surface.triangles.len(), "triangles of {}", case.name);
    let (size, speed) = (bytes.len() as f64, bytes.len() as f64 / measured.decoding);
    let note = if case.plain { "" } else { "  (for information)" };
    let [decoded, repaired, whole] = [measured.decoded, measured.repaired, measured.cut].map(|bytes| bytes / size);
    let whole = if cut { format!("{whole:.1}") } else { String::new() };
    let (ms, mb) = (1e3 * measured.decoding, size / 1e6);
    println!("{:34} {mb:9.1} {ms:7.1} {:7.0} {decoded:9.1} {repaired:9.1} {whole:>7}{note}", case.name, speed / 1e6);
    if case.extension != "stl" || !case.plain {
        return Ok(!case.plain || speed >= BOUND);
    }
    let both = measured.decoding + measured.repair;
    println!("{:34} {:17.1}", "  read, welded and repaired", 1e3 * both);
    Ok(speed >= BOUND && both < WELDED)
}

/// Has a file read by another process.
fn read_elsewhere(path: &Path, cut: bool) -> Result<Measured, Box<dyn Error>> {
    let mut command = Command::new(std::env::current_exe()?);
    let output = command.arg("--read").arg(path).args(cut.then_some("--cut")).output()?;
    let text = String::from_utf8(output.stdout)?;
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>()?;
    let [points, triangles, decoding, repair, decoded, repaired, cut] = numbers[..] else {
        return Err(format!("{}: {}", path.display(), String::from_utf8_lossy(&output.stderr)).into());
    };
    Ok(Measured { points: points as usize, triangles: triangles as usize, decoding, repair, decoded, repaired, cut })
}

/// Reads a file and tells what that takes.
fn measure(path: &Path, cut: bool) -> Result<(), Box<dyn Error>> {
    let Kind::Mesh(format) = formats::kind(path) else { return Err("no mesh".into()) };
    let decode = |bytes: &[u8]| formats::read_alone(format, bytes).map(|content| content.soup);
    let repair = |soup: &TriangleSoup| planish_core::repair(soup, &Default::default()).map(|repaired| repaired.mesh);
    // As it is in a job: the file is gone when repair begins, and the soup when the surface is cut.
    let before = peak()?;
    let bytes = std::fs::read(path)?;
    let (decoding, soup) = timed(|| decode(&bytes));
    let (soup, decoded) = (soup?, peak()? - before);
    drop(bytes);
    let (repairing, mesh) = timed(|| repair(&soup));
    let (mesh, repaired) = (mesh?, peak()? - before);
    let (points, triangles) = (soup.points().len(), soup.triangles().len());
    drop(soup);
    let mut whole = 0.0;
    if cut {
        planish_core::decompose(&mesh, &Default::default(), &NoMonitor)?;
        whole = peak()? - before;
    }
    drop(mesh);
    let bytes = std::fs::read(path)?;
    let decoding = (1..TIMES).map(|_| timed(|| decode(&bytes)).0).fold(decoding, f64::min);
    let soup = decode(&bytes)?;
    let repairing = (1..TIMES).map(|_| timed(|| repair(&soup)).0).fold(repairing, f64::min);
    println!("{points} {triangles} {decoding} {repairing} {decoded} {repaired} {whole}");
    Ok(())
}

/// Does something; seconds of processor time that it took, too.
fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let now = || {
        let t = clock_gettime(ClockId::ThreadCPUTime);
        t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
    };
    let begin = now();
    let done = work();
    (now() - begin, done)
}

/// The largest memory of this process so far, in bytes.
fn peak() -> Result<f64, Box<dyn Error>> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).ok_or("no VmHWM")?;
    Ok(1024.0 * line.trim().trim_end_matches(" kB").parse::<f64>()?)
}
