//! `planish watch`: the daemon.

use super::{Exit, shown};
use crate::conveyor::Conveyor;
use crate::daemon::Daemon;
use crate::disk::System;
use crate::holding;
use crate::hooks;
use crate::places::{self, Place};
use crate::publish::Publisher;
use crate::settings::{Inputs, Settings};
use crate::signals;
use crate::status::Lock;
use std::path::Path;
use std::sync::Arc;

/// Watches the folder `inbox` until it is told to stop.
///
/// # Errors
/// What makes the call as a whole impossible: wrong usage, a second daemon.
pub fn watch(inbox: &Path, settings: &Settings) -> Result<Exit, Box<dyn std::error::Error>> {
    let out = settings.out.as_deref().ok_or(super::NO_OUT)?;
    std::fs::read_dir(inbox).map_err(|e| format!("cannot watch {}: {e}; make the folder first", shown(inbox)))?;
    places::refuse_nested(&places(inbox, out, settings))?;
    if settings.inputs != Inputs::Keep || settings.refused != Inputs::Keep {
        holding::try_out(&System, inbox)?;
    }
    let publisher = Arc::new(Publisher::open(out)?);
    let mut lock = Lock::take(out)?;
    holding::recover(&System, inbox, settings.recursive);
    destinations(settings).for_each(|(_, folder)| holding::clear(&System, folder, settings.recursive));
    let stop = signals::listen()?;
    let conveyor = Conveyor::start(settings, publisher.clone(), true).map_err(|e| super::no_threads(&e))?;
    tracing::info!(inbox = shown(inbox), out = shown(out), "watches");
    let ended = Daemon::new(inbox, settings, &conveyor, (&mut lock, &publisher)).run(&stop)?;
    // Whoever has not reached a safe point by now is left behind: nothing of it can be published any more, and no command
    // runs on.
    if let Ok(staging) = publisher.staging() {
        hooks::end_those_of(&staging);
    }
    publisher.close();
    tracing::info!(certified = ended.certified, refused = ended.refused, failed = ended.failed, "stopped");
    Ok(Exit::Success)
}

/// The folders that must not lie in each other.
fn places<'a>(inbox: &'a Path, out: &'a Path, settings: &'a Settings) -> Vec<Place<'a>> {
    let mut all = vec![Place::new("inbox", inbox), Place::new("output folder", out)];
    all.extend(destinations(settings).map(|(role, folder)| Place::new(role, folder)));
    all
}

/// The folders to which inputs are moved, with what they are for.
fn destinations(settings: &Settings) -> impl Iterator<Item = (&'static str, &Path)> {
    let all = [("folder for inputs", &settings.inputs), ("folder for refused inputs", &settings.refused)];
    all.into_iter().filter_map(|(role, inputs)| match inputs {
        Inputs::Move(folder) => Some((role, folder.as_path())),
        Inputs::Keep | Inputs::Delete => None,
    })
}
