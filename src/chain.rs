//! What follows when a result is certified: the commands run on it, and its input is put away.

use crate::disk::System;
use crate::hooks::{self, HookError, Target};
use crate::job::Job;
use crate::publish::{PublishError, Publisher};
use crate::put_away::{Fate, Processed, PutAwayError, Way, put_away};
use crate::report::Report;
use crate::settings::{Inputs, Settings};
use blake3::Hash;
use parking_lot::Mutex;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Why what should follow did not.
#[derive(Debug, thiserror::Error)]
pub enum ChainError {
    /// The commands could not be run.
    #[error(transparent)]
    Hook(#[from] HookError),
    /// The result could not be brought to disk, or there is no place for what commands print.
    #[error(transparent)]
    Publish(#[from] PublishError),
    /// The input could not be put away.
    #[error(transparent)]
    PutAway(#[from] PutAwayError),
}

/// How long a file must have been as it is before it is put away. A writer that pauses for longer loses what it writes
/// later; one that pauses for less is waited for.
const QUIET: Duration = Duration::from_secs(10);

/// Inputs that somebody had open for writing when they were to be put away, as was told.
static BUSY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// What became of what follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Followed {
    /// All is done.
    Whole,
    /// The job was no longer wanted.
    BrokenOff,
    /// All is done but that the input is put away: it is too early for that.
    Until(Instant),
    /// All is done but that the input is put away: its content is no longer what was processed, whether that shows or
    /// not. It is to be processed again.
    Changed,
}

/// Whether anything follows.
pub fn is_asked_for(settings: &Settings) -> bool {
    !settings.on_certified.is_empty() || settings.inputs != Inputs::Keep
}

/// Runs the commands that are due on the certified result of `job`. Where all of them have succeeded, and no part of the
/// input was refused, puts the input away.
///
/// # Errors
/// [`ChainError`] where the system fails; a command that fails is told in hooks.json.
pub fn run(job: &Job, report: &Report, settings: &Settings, publisher: &Publisher) -> Result<Followed, ChainError> {
    let target = Target::new(&job.path, &publisher.target(&job.name))?;
    let hooks = &settings.on_certified;
    if hooks::are_due(hooks, &target) {
        tracing::info!(commands = hooks.len(), "runs commands");
        let Some(account) = hooks::run(hooks, &target, &publisher.staging()?, &|| job.is_wanted())? else {
            return Ok(Followed::BrokenOff);
        };
        if account.failure().is_none() {
            tracing::info!("commands have succeeded");
        }
    }
    let all_succeeded = hooks.is_empty() || hooks::account(&target).is_some_and(|a| a.failure().is_none());
    // With files beside it, an input would lose its sense elsewhere; and they may belong to others, too.
    let is_alone = report.input.beside.is_empty();
    if all_succeeded && is_alone && report.refused_components.is_empty() {
        return done_with(job, report, settings, publisher);
    }
    Ok(Followed::Whole)
}

/// Puts the input away, as the settings say; inputs of an inbox only.
fn done_with(job: &Job, report: &Report, settings: &Settings, publisher: &Publisher) -> Result<Followed, ChainError> {
    let (Some(look), Some(since), Some(inbox)) = (&job.look, job.since, &job.within) else {
        return Ok(Followed::Whole);
    };
    let target;
    let way = match &settings.inputs {
        Inputs::Keep => return Ok(Followed::Whole),
        Inputs::Delete => Way::Nowhere,
        Inputs::Move(folder) => {
            target = folder.join(&job.name);
            Way::To(&target)
        }
    };
    // What was certified was read: there is a hash.
    let hash = report.input.blake3.as_ref().and_then(|hash| Hash::from_hex(hash).ok());
    let Some(hash) = hash else { return Ok(Followed::Whole) };
    if since.elapsed() < QUIET {
        return Ok(Followed::Until(since + QUIET));
    }
    // The input is all that the result could be made from again.
    publisher.secure(&job.name)?;
    Ok(match put_away(&System, &Processed { inbox, name: &job.name, look, hash }, way)? {
        Fate::Busy => {
            tell_once(&job.path);
            Followed::Until(Instant::now() + QUIET)
        }
        ended => {
            BUSY.lock().remove(&job.path);
            if ended == Fate::Changed { Followed::Changed } else { Followed::Whole }
        }
    })
}

/// Tells that an input waits for somebody who writes to it, the first time.
fn tell_once(path: &Path) {
    if BUSY.lock().insert(path.to_owned()) {
        tracing::info!("somebody has it open for writing: it is put away when it is closed");
    }
}
