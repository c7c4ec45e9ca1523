//! What follows when a result is certified: the commands run on it, and its input is put away.

use crate::hooks::{self, HookError, Target};
use crate::job::Job;
use crate::publish::Publisher;
use crate::put_away::{PutAwayError, Way, put_away};
use crate::report::Report;
use crate::settings::{Inputs, Settings};

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

/// Whether anything follows.
pub fn is_asked_for(settings: &Settings) -> bool {
    !settings.on_certified.is_empty() || settings.inputs != Inputs::Keep
}

/// Runs the commands that are due on the certified result of `job`. Where all of them have succeeded, and no part of the
/// input was refused, puts the input away. False: the job was no longer wanted before that was done.
///
/// # Errors
/// [`ChainError`] where the system fails; a command that fails is told in hooks.json.
pub fn run(job: &Job, report: &Report, settings: &Settings, publisher: &Publisher) -> Result<bool, ChainError> {
    let target = Target::new(&job.path, &publisher.target(&job.name))?;
    let hooks = &settings.on_certified;
    if hooks::are_due(hooks, &target) {
        tracing::info!(commands = hooks.len(), "runs commands");
        let Some(account) = hooks::run(hooks, &target, publisher.staging(), &|| job.is_wanted())? else {
            return Ok(false);
        };
        if account.failure().is_none() {
            tracing::info!("commands have succeeded");
        }
    }
    let all_succeeded = hooks.is_empty() || hooks::account(&target).is_some_and(|a| a.failure().is_none());
    // With files beside it, an input would lose its sense elsewhere; and they may belong to others, too.
    let is_alone = report.input.beside.is_empty();
    if all_succeeded && is_alone && report.refused_components.is_empty() {
        done_with(job, settings)?;
    }
    Ok(true)
}

/// Puts the input away, as the settings say.
fn done_with(job: &Job, settings: &Settings) -> Result<(), PutAwayError> {
    let Some(seen) = &job.look else { return Ok(()) };
    match &settings.inputs {
        Inputs::Keep => Ok(()),
        Inputs::Delete => put_away(&job.path, seen, Way::Nowhere),
        Inputs::Move(folder) => put_away(&job.path, seen, Way::To(&folder.join(&job.name))),
    }
}
