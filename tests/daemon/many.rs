//! Many files at once.

use super::Watched;
use planish::outcome::Status;
use std::fs;

const FILES: usize = 2000;

/// Four triangles, of which no two files have the same.
fn small(i: usize) -> String {
    let height = 1.0 + i as f64 / FILES as f64;
    let corners = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
    format!("{corners}v 0.1 0.2 {height}\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n")
}

/// Resident memory in KiB.
pub fn memory(pid: u32) -> f64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("it runs");
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:")).expect("a size");
    line.trim().trim_end_matches(" kB").parse().expect("a number")
}

#[test]
fn two_thousand_files_are_done_and_memory_stays_what_it_is() {
    let mut w = Watched::new(&["--jobs", "2", "-q"]);
    // Blocks of some size are given back when they are free: what glibc keeps of them else differs from run to run.
    w.start_with(|command| command.env("MALLOC_ARENA_MAX", "1").env("MALLOC_MMAP_THRESHOLD_", "65536"));
    let name = |i: usize| format!("{i:04}.obj");
    (0..FILES).for_each(|i| fs::write(w.inbox().join(name(i)), small(i)).expect("written"));
    let done = |w: &Watched| w.status()["ended"]["certified"].as_u64().unwrap_or_default() as usize;
    w.wait_until("half of them are done", |w| done(w) >= FILES / 2);
    let half = memory(w.pid());
    w.wait_until("all are done", |w| done(w) >= FILES);
    let end = memory(w.pid());
    eprintln!("{half} KiB resident at half-way, {end} KiB at the end");
    assert!(end < 1.05 * half, "{half} KiB at half-way, {end} KiB at the end");
    w.stop();
    let names: Vec<String> = (0..FILES).map(name).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    names.iter().for_each(|name| w.assert_complete(name, Status::Certified));
    w.assert_tidy(&names);
}

/// Small files do not wait for a large one that came before them.
#[test]
fn a_large_file_does_not_starve_small_ones() {
    let mut w = Watched::new(&["--jobs", "1"]);
    w.drop_in("large.stl", &super::disk(220, 0.0));
    w.start();
    w.wait_until("the large one is on its way", |w| w.is_running("large.stl"));
    let inputs: Vec<(String, String)> = (0..20).map(|i| (format!("{i}.obj"), small(i))).collect();
    inputs.iter().for_each(|(name, text)| w.drop_in(name, text.as_bytes()));
    for (name, text) in &inputs {
        w.wait_for(&[(name, text.as_bytes())]);
    }
    assert!(!w.out.of("large.stl").exists(), "the large one still runs: else the test has lost its sense");
    w.wait_until("the large one is done, too", |w| w.out.of("large.stl").exists());
    w.stop();
}
