//! What follows when a result is certified: the commands run on it, and its input is put away.

use crate::hooks::{self, Chain, HookError, Target};
use crate::job::Job;
use crate::publish::Publisher;
use crate::put_away::{Fate, Processed, PutAwayError, Way, put_away};
use crate::report::Report;
use crate::settings::{Inputs, Settings};
use blake3::Hash;
use std::time::{Duration, Instant};

/// Why what should follow did not.
#[derive(Debug, thiserror::Error)]
pub enum ChainError {
    /// The commands could not be run.
    #[error(transparent)]
    Hook(#[from] HookError),
    /// The input could not be put away.
    #[error(transparent)]
    PutAway(#[from] PutAwayError),
}

/// How long a file must have been as it is before it is put away. A writer that pauses for longer loses what it writes
/// later; one that pauses for less is waited for.
const QUIET: Duration = Duration::from_secs(10);

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
    /// The result was moved or removed while this command ran (1 is the first). To process the input again would only
    /// have it taken again.
    Taken(usize),
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
        match hooks::run(hooks, &target, publisher.staging(), &|| job.is_wanted())? {
            Chain::BrokenOff => return Ok(Followed::BrokenOff),
            Chain::Taken(command) => return Ok(Followed::Taken(command)),
            Chain::Over(account) if account.failure().is_none() => tracing::info!("commands have succeeded"),
            Chain::Over(_) => {}
        }
    }
    let all_succeeded = hooks.is_empty() || hooks::account(&target).is_some_and(|a| a.failure().is_none());
    // With files beside it, an input would lose its sense elsewhere; and they may belong to others, too.
    let is_alone = report.input.beside.is_empty();
    if all_succeeded && is_alone && report.refused_components.is_empty() {
        return Ok(done_with(job, report, settings)?);
    }
    Ok(Followed::Whole)
}

/// Puts the input away, as the settings say; inputs of an inbox only.
fn done_with(job: &Job, report: &Report, settings: &Settings) -> Result<Followed, PutAwayError> {
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
    Ok(match put_away(&Processed { inbox, name: &job.name, look, hash }, way)? {
        Fate::Away | Fate::Nothing => Followed::Whole,
        Fate::Changed => Followed::Changed,
    })
}
