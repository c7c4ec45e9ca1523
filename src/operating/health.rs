//! Whether an operator must act: what `planish status --health` answers, from what the daemon told.
//!
//! Every fact is judged by itself; the daemon is healthy where all are good. Deliberately absent: the disk and the clock,
//! so that each fact is tested with its twin.

use crate::operating::status::Status;
use crate::system::escape::escape;
use bytesize::ByteSize;
use serde::Serialize;
use std::path::Path;

/// A daemon that has told nothing for so long hangs: it tells every ten seconds. In seconds.
const SILENCE: u64 = 60;

/// Messages that were lost longer ago than this are history: in seconds.
const LOST: u64 = 3600;

/// One thing that is known.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Fact {
    /// What it is about, in a word.
    pub about: &'static str,
    /// Whether it is as it should be.
    pub good: bool,
    /// What is known, for people.
    pub message: String,
}

impl std::fmt::Display for Fact {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let verdict = if self.good { "good" } else { "BAD" };
        write!(f, "{verdict:5} {:12} {}", self.about, escape(self.message.as_ref()))
    }
}

/// All facts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Health {
    /// Whether all is good.
    pub healthy: bool,
    /// What is known.
    pub facts: Vec<Fact>,
}

/// What is judged.
#[derive(Clone, Copy, Debug)]
pub struct Seen<'a> {
    /// Whether a daemon runs.
    pub running: bool,
    /// What it told last.
    pub told: Option<&'a Status>,
    /// The time: seconds since 1970.
    pub now: u64,
    /// An input may wait so long for its result, in seconds.
    pub max_age: f64,
    /// The room on the disk of the results, in bytes; none where the system does not tell.
    pub free: Option<u64>,
    /// The room that there should be.
    pub min_free: u64,
}

impl Health {
    /// Judges what is seen.
    pub fn of(seen: &Seen) -> Self {
        let mut facts = vec![runs(seen)];
        if let Some(told) = seen.told {
            facts.extend([
                tells(seen, told),
                publishes(seen, told),
                errs(seen, told),
                goes_on(told),
                is_in_time(seen, told),
                is_heard(seen, told),
            ]);
        }
        facts.push(has_room(seen));
        Self { healthy: facts.iter().all(|fact| fact.good), facts }
    }
}

fn fact(about: &'static str, good: bool, message: impl Into<String>) -> Fact {
    Fact { about, good, message: message.into() }
}

/// How long ago that was, for people.
fn ago(seen: &Seen, when: u64) -> String {
    format!("{} s ago", seen.now.saturating_sub(when))
}

fn runs(seen: &Seen) -> Fact {
    match (seen.running, seen.told) {
        (true, Some(told)) => fact("daemon", true, format!("process {} runs", told.pid)),
        // It is about to begin; where it stays so, the supervisor of the service hears nothing of it.
        (true, None) => fact("daemon", false, "one is about to begin"),
        (false, _) => fact("daemon", false, "none runs"),
    }
}

fn tells(seen: &Seen, told: &Status) -> Fact {
    let is_heard = seen.now.saturating_sub(told.told) <= SILENCE;
    fact("told", is_heard, format!("its status was told {}", ago(seen, told.told)))
}

fn publishes(seen: &Seen, told: &Status) -> Fact {
    let message = told.last_published.map_or_else(|| "none since the start".to_owned(), |when| ago(seen, when));
    fact("publication", true, message)
}

fn errs(seen: &Seen, told: &Status) -> Fact {
    let Some(error) = &told.last_error else { return fact("error", true, "none since the start") };
    let is_over = told.last_published.is_some_and(|published| published >= error.when);
    let what = if is_over { ", and results were put in place since" } else { "" };
    fact("error", is_over, format!("{}{what}: {}", ago(seen, error.when), error.message))
}

fn goes_on(told: &Status) -> Fact {
    let held_up: Vec<_> = told.running.iter().filter_map(|job| Some((&job.name, job.trouble.as_ref()?))).collect();
    match held_up.first() {
        None => fact("work", true, "nothing that is on its way is held up"),
        Some((name, trouble)) => fact("work", false, format!("{} held up; {name}: {trouble}", held_up.len())),
    }
}

fn is_in_time(seen: &Seen, told: &Status) -> Fact {
    let Some(oldest) = told.oldest else { return fact("oldest", true, "no input waits for its result") };
    // It was that old when it was told.
    let age = oldest + seen.now.saturating_sub(told.told) as f64;
    let is_in_time = age <= seen.max_age;
    fact("oldest", is_in_time, format!("an input has waited for {age:.0} s; {} s are allowed", seen.max_age))
}

fn is_heard(seen: &Seen, told: &Status) -> Fact {
    let message = match (told.log_lines_lost, told.last_lost) {
        (0, _) => "no message was lost".to_owned(),
        (lost, when) => format!("{lost} messages were lost, the last {}", ago(seen, when.unwrap_or(told.since))),
    };
    let is_heard = told.last_lost.is_none_or(|when| seen.now.saturating_sub(when) > LOST);
    fact("log", is_heard, message)
}

fn has_room(seen: &Seen) -> Fact {
    if let Some(paused) = seen.told.filter(|_| seen.running).and_then(|told| told.paused.as_ref()) {
        return fact("room", false, paused);
    }
    let Some(free) = seen.free else { return fact("room", true, "the system does not tell") };
    let [left, least] = [free, seen.min_free].map(ByteSize::b);
    fact("room", free >= seen.min_free, format!("the disk of the results has {left}; {least} are needed"))
}

/// The facts of the results in `out`, as they are now.
pub fn now(out: &Path, running: bool, told: Option<&Status>, max_age: f64, min_free: u64) -> Health {
    // The daemon knows its own threshold; where none runs, that of the caller counts.
    let min_free = told.and_then(|told| told.min_free).unwrap_or(min_free);
    let free = crate::output::free_space::free(out);
    Health::of(&Seen { running, told, now: crate::operating::status::now(), max_age, free, min_free })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operating::status::Trouble;

    const NOW: u64 = 1_000_000;

    /// A daemon in whose status this was changed, and what is bad about it.
    fn bad(change: impl FnOnce(&mut Status)) -> Vec<&'static str> {
        let mut told = Status { pid: 7, since: NOW - 5000, told: NOW - 3, ..Status::default() };
        change(&mut told);
        bad_of(&Seen { told: Some(&told), ..seen() })
    }

    fn bad_of(seen: &Seen) -> Vec<&'static str> {
        let health = Health::of(seen);
        let bad: Vec<_> = health.facts.iter().filter(|fact| !fact.good).map(|fact| fact.about).collect();
        assert_eq!(health.healthy, bad.is_empty());
        bad
    }

    fn seen() -> Seen<'static> {
        Seen { running: true, told: None, now: NOW, max_age: 3600.0, free: Some(1 << 30), min_free: 1 << 26 }
    }

    fn error(when: u64) -> Option<Trouble> {
        Some(Trouble { when, message: "the disk is full".to_owned() })
    }

    #[test]
    fn a_daemon_that_does_what_it_should_is_healthy() {
        assert_eq!(bad(|_| ()), [""; 0]);
    }

    #[test]
    fn every_fact_has_a_twin() {
        let none = [""; 0];
        assert_eq!((bad(|s| s.told = NOW - 60), bad(|s| s.told = NOW - 61)), (none.to_vec(), vec!["told"]));
        let errs = |published| bad(|s| (s.last_error, s.last_published) = (error(NOW - 50), published));
        assert_eq!((errs(Some(NOW - 50)), errs(Some(NOW - 51))), (none.to_vec(), vec!["error"]));
        assert_eq!(errs(None), ["error"]);
        let waits = |seconds| bad(|s| s.oldest = Some(seconds));
        assert_eq!((waits(3597.0), waits(3597.5)), (none.to_vec(), vec!["oldest"]));
        let lost = |when| bad(|s| (s.log_lines_lost, s.last_lost) = (9, Some(when)));
        assert_eq!((lost(NOW - 3601), lost(NOW - 3600)), (none.to_vec(), vec!["log"]));
        assert_eq!(bad(|s| s.paused = Some("no room".to_owned())), ["room"]);
    }

    #[test]
    fn without_a_daemon_nothing_is_healthy_and_room_is_a_fact_all_the_same() {
        assert_eq!(bad_of(&Seen { running: false, ..seen() }), ["daemon"]);
        assert_eq!(bad_of(&seen()), ["daemon"], "it is only about to begin");
        let full = Seen { free: Some((1 << 26) - 1), running: false, ..seen() };
        assert_eq!(bad_of(&full), ["daemon", "room"]);
        assert_eq!(bad_of(&Seen { free: None, running: false, ..seen() }), ["daemon"]);
    }
}
