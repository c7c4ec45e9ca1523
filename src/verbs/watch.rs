//! `planish watch`: the daemon.

use super::{Exit, check_config, escape};
use crate::after::holding;
use crate::cli;
use crate::conveyor::Conveyor;
use crate::operating::status::Lock;
use crate::output::publish::Publisher;
use crate::settings::{Inputs, Settings, SettingsError};
use crate::system::disk::System;
use crate::system::folder_checks::{self, FolderError, FolderRole};
use crate::system::orphans;
use crate::watch::daemon::{Daemon, Source};
use crate::watch::signals::{self, Hangup};
use std::path::Path;
use std::sync::Arc;

/// Watches a folder until it is told to stop. The settings, which `read` finds again, may change meanwhile, if they are
/// in a file.
///
/// # Errors
/// What makes the call as a whole impossible: wrong usage, a second daemon.
pub fn watch(
    asked: &cli::Watch,
    settings: &Settings,
    read: &dyn Fn() -> Result<Settings, SettingsError>,
) -> Result<Exit, Box<dyn std::error::Error>> {
    let inbox = &asked.inbox;
    let out = settings.out.as_deref().ok_or(super::NO_OUT)?;
    if asked.check_config {
        return Ok(check_config::check_config(inbox, out, settings));
    }
    std::fs::read_dir(inbox).map_err(|e| no_inbox(inbox, &e))?;
    refuse_nested(inbox, out, settings)?;
    refuse_metrics(settings)?;
    if takes_inputs_out(settings) {
        holding::try_out(&System, inbox)?;
    }
    // First: who asks to stop while all this begins is heard, too.
    let hangup = if asked.common.config.is_some() { Hangup::Reload } else { Hangup::Stop };
    let stop = signals::listen(hangup, settings.drain)?;
    let publisher = Arc::new(Publisher::open(out)?);
    let mut lock = Lock::take(out)?;
    holding::recover(&System, inbox, settings.recursive);
    for (_, folder) in destinations(settings) {
        holding::clear(&System, folder, settings.recursive);
    }
    let conveyor = Conveyor::start(settings, publisher.clone(), true).map_err(|e| super::no_threads(&e))?;
    tracing::info!(inbox = escape(inbox), out = escape(out), "watches");
    let source = Source { read, is_possible: &|settings| can_go(inbox, out, settings) };
    let ended = Daemon::new(inbox, (settings, source), &conveyor, (&mut lock, &publisher)).run(&stop)?;
    // Whoever has not reached a safe point by now is left behind: nothing of it can be published any more, and no command
    // runs on.
    if let Ok(staging) = publisher.staging() {
        orphans::end_those_of(&staging);
    }
    publisher.close();
    tracing::info!(certified = ended.certified, refused = ended.refused, failed = ended.failed, "stopped");
    Ok(Exit::Success)
}

/// What is said of an inbox that cannot be read.
pub(super) fn no_inbox(inbox: &Path, error: &std::io::Error) -> String {
    format!("cannot watch {}: {error}; make the folder first", escape(inbox))
}

/// Refuses folders of which one lies in another, and a file of metrics in the inbox.
pub(super) fn refuse_nested(inbox: &Path, out: &Path, settings: &Settings) -> Result<(), FolderError> {
    let watched = FolderRole::new("inbox", inbox);
    let mut all = vec![watched, FolderRole::new("output folder", out)];
    for (role, folder) in destinations(settings) {
        all.push(FolderRole::new(role, folder));
    }
    folder_checks::refuse_nested(&all)?;
    // It may lie in the other folders: only what appears in the inbox is taken for an input.
    let mut with_metrics = vec![watched];
    with_metrics.extend(settings.metrics.iter().map(|file| FolderRole::new("file of metrics", file)));
    folder_checks::refuse_nested(&with_metrics)
}

/// Refuses a file of metrics for which there is no folder.
pub(super) fn refuse_metrics(settings: &Settings) -> Result<(), String> {
    let Some(file) = &settings.metrics else { return Ok(()) };
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if folder.is_dir() && !file.is_dir() {
        return Ok(());
    }
    Err(format!("the metrics cannot be written to {}: it must be a file in a folder that is there", escape(file)))
}

/// Whether inputs leave the inbox.
pub(super) fn takes_inputs_out(settings: &Settings) -> bool {
    settings.inputs != Inputs::Keep || settings.refused != Inputs::Keep
}

/// Whether inputs can go where settings say that were read while the daemon runs: to folders that are there.
fn can_go(inbox: &Path, out: &Path, settings: &Settings) -> bool {
    if !destinations(settings).all(|(_, folder)| folder.is_dir()) {
        return false;
    }
    if refuse_nested(inbox, out, settings).is_err() {
        return false;
    }
    // Last, as that makes a folder in the inbox and removes it.
    !takes_inputs_out(settings) || holding::try_out(&System, inbox).is_ok()
}

/// The folders to which inputs are moved, with what they are for.
pub(super) fn destinations(settings: &Settings) -> impl Iterator<Item = (&'static str, &Path)> {
    let all = [("folder for inputs", &settings.inputs), ("folder for refused inputs", &settings.refused)];
    all.into_iter().filter_map(|(role, inputs)| match inputs {
        Inputs::Move(folder) => Some((role, folder.as_path())),
        Inputs::Keep | Inputs::Delete => None,
    })
}
