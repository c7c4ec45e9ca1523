//! `planish status`: what a running daemon does.

use super::{Exit, escape, say, say_json};
use crate::cli;
use crate::operating::health::{self, Health};
use crate::operating::status::{self, Counts, Noted, Progress, Refusal, Status};
use crate::outcome::Status as Outcome;
use crate::output::ledger;
use crate::report::RefusedComponent;
use crate::settings::Settings;
use serde::Serialize;
use std::path::Path;

/// Refusals that are named for people; `--json` names all.
const NAMED: usize = 10;

/// What `--json` prints.
#[derive(Serialize)]
struct Answer {
    /// Whether a daemon runs.
    running: bool,
    /// What it told last; also what one told that was killed.
    daemon: Option<Status>,
    /// All results in the output folder.
    results: Counts,
    /// Those that are not certified, and the components that are not in a result.
    refusals: Vec<Refusal>,
    /// Whether an operator must act.
    health: Health,
}

/// Tells what the daemon does that writes to the output folder, and what results there are.
///
/// # Errors
/// Wrong usage.
pub fn status(asked: &cli::Status, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let out = settings.out.as_deref().ok_or(super::NO_OUT)?;
    std::fs::read_dir(out).map_err(|e| format!("cannot read the output folder {}: {e}", escape(out)))?;
    let (running, daemon) = (status::is_running(out), status::told(out));
    let health = health::now(out, running, daemon.as_ref(), asked.max_age, settings.min_free);
    let is_good = if asked.health { health.healthy } else { running };
    if asked.json {
        say_json(&answer(out, running, daemon, health))?;
    } else if asked.health {
        for fact in &health.facts {
            say(&fact.to_string());
        }
    } else {
        say(&text(&answer(out, running, daemon, health)));
    }
    Ok(if is_good { Exit::Success } else { Exit::Refused })
}

fn answer(out: &Path, running: bool, daemon: Option<Status>, health: Health) -> Answer {
    let mut results = Counts::default();
    let mut refusals = Vec::new();
    for (name, entry) in ledger::entries(out) {
        results.count(entry.status);
        refusals.extend(entry.refused_components.iter().map(|refused| not_in_result(&name, refused)));
        if entry.status != Outcome::Certified {
            let (code, message) = match entry.reason {
                Some(reason) => (Some(reason.code), reason.message),
                None => (None, String::new()),
            };
            let name = name.to_string_lossy().into_owned();
            refusals.push(Refusal { name, status: entry.status, code, message });
        }
    }
    Answer { running, daemon, results, refusals, health }
}

fn not_in_result(name: &Path, refused: &RefusedComponent) -> Refusal {
    let RefusedComponent { component, reason, .. } = refused;
    Refusal {
        name: name.to_string_lossy().into_owned(),
        status: Outcome::Certified,
        code: Some(reason.code),
        message: format!("without component {component}, of {}: {}", refused.extent(), reason.message),
    }
}

/// The answer for people.
fn text(answer: &Answer) -> String {
    let mut lines = vec![headline(answer)];
    if let Some(daemon) = &answer.daemon {
        lines.extend(doings(daemon));
    }
    let Counts { certified, refused, failed } = answer.results;
    lines.push(format!("results: {certified} certified, {refused} refused, {failed} failed"));
    lines.extend(answer.refusals.iter().take(NAMED).map(refusal));
    if answer.refusals.len() > NAMED {
        lines.push(format!("  and {} more; --json lists all", answer.refusals.len() - NAMED));
    }
    lines.join("\n")
}

/// What a daemon does, one thing a line.
fn doings(daemon: &Status) -> Vec<String> {
    let (waiting, running, unsettled) = (daemon.waiting, daemon.running.len(), daemon.unsettled);
    let mut lines = vec![format!("{waiting} wait, {running} run, {unsettled} have not settled")];
    if let Some(paused) = &daemon.paused {
        lines.push(format!("  {:12} {}", "paused", plain(paused)));
    }
    lines.extend(daemon.running.iter().map(progress));
    for name in daemon.next.iter().take(NAMED) {
        lines.push(format!("  {:12} {}", "waits", plain(name)));
    }
    if waiting > NAMED {
        lines.push(format!("  and {} more", waiting - NAMED));
    }
    lines.extend(daemon.notable.iter().take(NAMED).map(noted));
    if daemon.notables > NAMED {
        lines.push(format!("  and {} more that are not done", daemon.notables - NAMED));
    }
    lines
}

/// Whether a daemon runs, and where.
fn headline(answer: &Answer) -> String {
    match (&answer.daemon, answer.running) {
        (Some(daemon), true) => {
            let doing = if daemon.draining { "finishes what waits, from" } else { "watches" };
            format!("a daemon (process {}) {doing} {}", daemon.pid, plain(&daemon.inbox))
        }
        (None, true) => "a daemon is about to begin".to_owned(),
        (Some(daemon), false) => {
            format!("no daemon runs: the last one (process {}) was killed while it did this:", daemon.pid)
        }
        (None, false) => "no daemon runs".to_owned(),
    }
}

fn progress(job: &Progress) -> String {
    let charts = if job.charts > 0 { format!("{} of {} charts, ", job.charts_done, job.charts) } else { String::new() };
    let trouble = job.trouble.as_ref().map_or(String::new(), |trouble| format!(": {}", plain(trouble)));
    format!("  {:12} {}: {charts}{:.1} s{trouble}", job.stage, plain(&job.name), job.seconds)
}

fn noted(input: &Noted) -> String {
    format!("  {:12} {}: {} ({:.0} s)", input.state, plain(&input.name), plain(&input.reason), input.seconds)
}

fn refusal(refusal: &Refusal) -> String {
    let code = refusal.code.map_or(String::new(), |code| format!(" [{}]", code.name()));
    format!("  {:12} {}: {}{code}", refusal.status, plain(&refusal.name), refusal.message)
}

/// A name on one line, whatever its characters.
fn plain(name: &str) -> String {
    escape(name.as_ref())
}
