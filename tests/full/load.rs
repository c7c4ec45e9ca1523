//! An hour of everything at once: memory, handles and threads stay what they are.

use crate::daemon::many::memory;
use crate::daemon::{Watched, disk};
use planish::outcome::Status;
use std::fs;
use std::time::{Duration, Instant};

/// How long, in seconds, where the environment does not say otherwise.
const AN_HOUR: u64 = 3600;

/// Inputs of each kind that there are at once: their names come again and again, with other content.
const KINDS: usize = 10;

/// What a daemon has while nothing is to be done.
#[derive(Clone, Copy, Debug)]
struct Sample {
    kib: f64,
    handles: usize,
    threads: usize,
}

fn sample(w: &Watched) -> Sample {
    let count = |what: &str| fs::read_dir(format!("/proc/{}/{what}", w.pid())).expect("it runs").count();
    Sample { kib: memory(w.pid()), handles: count("fd"), threads: count("task") }
}

fn is_idle(w: &Watched) -> bool {
    let status = w.status();
    let none = |key: &str| status[key].as_u64() == Some(0);
    let runs = status["running"].as_array().is_none_or(|jobs| !jobs.is_empty());
    none("waiting") && none("notables") && !runs
}

/// One round: small inputs and a middling one, what is refused, what changes while it is processed, what is taken away
/// again, and now and then one that gets a process of its own.
fn round(w: &Watched, number: usize) {
    let kind = number % KINDS;
    let twist = number as f64 / 7.0;
    let all: Vec<(String, Vec<u8>)> = vec![
        (format!("small-{kind}.stl"), disk(4 + kind as u32, twist)),
        (format!("other-{kind}.stl"), disk(6, twist + 0.5)),
        (format!("middling-{kind}.stl"), disk(40, twist)),
        (format!("garbage-{kind}.stl"), format!("garbage {number}").into_bytes()),
    ];
    all.iter().for_each(|(name, bytes)| w.drop_in(name, bytes));
    if kind == 0 {
        w.drop_in("large.stl", &disk(90, twist));
    }
    // Newer content for what is on its way, and no content for what was.
    let newer = disk(7, twist + 0.25);
    w.drop_in("changes.stl", &disk(30, twist));
    std::thread::sleep(Duration::from_millis(1200));
    w.drop_in("changes.stl", &newer);
    let _ = fs::remove_file(w.inbox().join(format!("other-{}.stl", (number + 1) % KINDS)));
    let known: Vec<(&str, &[u8])> = all.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])).collect();
    w.wait_for(&known);
    w.wait_for(&[("changes.stl", &newer)]);
    w.wait_until("nothing is to be done", is_idle);
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

#[test]
#[ignore = "takes an hour"]
fn full_an_hour_of_mixed_load_takes_no_more_memory_handles_or_threads() {
    let seconds = std::env::var("PLANISH_FULL_SECONDS").ok().and_then(|s| s.parse().ok()).unwrap_or(AN_HOUR);
    let mut w = Watched::configured("[[on_certified]]\ncommand = [\"true\"]\n", &["--jobs", "2", "-q"]);
    w.start_with(|command| command.env("MALLOC_ARENA_MAX", "1").env("MALLOC_MMAP_THRESHOLD_", "65536"));
    let began = Instant::now();
    let mut samples = Vec::new();
    while began.elapsed() < Duration::from_secs(seconds) {
        round(&w, samples.len());
        samples.push(sample(&w));
        if samples.len() % 50 == 0 {
            eprintln!("after {:.0?} and {} rounds: {:?}", began.elapsed(), samples.len(), samples.last());
        }
    }
    // All names have come by then, and all threads and buffers are there.
    let settled = &samples[samples.len() / 5..];
    let third = settled.len() / 3;
    let [first, last] = [&settled[..third], &settled[settled.len() - third..]];
    let memory = [first, last].map(|part| median(part.iter().map(|s| s.kib).collect()));
    eprintln!("{} rounds; resident memory of the first and last third: {memory:?} KiB", samples.len());
    assert!(memory[1] < 1.05 * memory[0], "{memory:?}");
    let most = |of: fn(&Sample) -> usize, part: &[Sample]| part.iter().map(of).max().expect("some");
    for of in [|s: &Sample| s.handles, |s: &Sample| s.threads] {
        assert_eq!(most(of, first), most(of, last));
    }
    w.stop();
    for name in ["small-3.stl", "middling-3.stl", "large.stl", "changes.stl"] {
        assert_eq!(w.out.report(name).status, Status::Certified, "{name}");
    }
    eprintln!("full: {} rounds of mixed load in {:.0?}, memory {memory:?} KiB", samples.len(), began.elapsed());
}
