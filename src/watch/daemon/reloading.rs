//! Taking up settings that have changed while the daemon runs.

use super::{Daemon, Phase};
use crate::operating::reload::{Reloaded, take_up};
use crate::settings::{Settings, SettingsError};
use std::sync::Arc;
use std::time::Instant;

/// Where the daemon finds its settings again.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// Reads and checks what was said on the command line and in the file.
    pub read: &'a dyn Fn() -> Result<Settings, SettingsError>,
    /// Whether inputs can go where these settings say.
    pub is_possible: &'a dyn Fn(&Settings) -> bool,
}

impl Daemon<'_> {
    /// Reads the settings again. A mistake in them changes nothing.
    pub(super) fn reload(&mut self) {
        if self.phase != Phase::Watching {
            return;
        }
        self.supervisor.reloading();
        match (self.source.read)() {
            Ok(fresh) => self.take_up(fresh),
            Err(error) => {
                self.must_be_seen_to(format!("the settings were read again, and those in force stay: {error}"));
            }
        }
        self.supervisor.ready();
    }

    fn take_up(&mut self, fresh: Settings) {
        let Reloaded { settings, later } = take_up(&self.settings, fresh, self.source.is_possible);
        if !later.is_empty() {
            let later = later.join(", ");
            tracing::warn!(later, "these settings have changed, and wait for a new start of the daemon");
        }
        if settings == *self.settings {
            tracing::info!("the settings were read again: nothing changes");
            return;
        }
        tracing::info!("the settings were read again: all inputs are looked at anew");
        self.settings = Arc::new(settings);
        self.conveyor.set_settings(self.settings.clone());
        // What is on its way ends as it began, and is looked at then.
        self.outdated = self.jobs.keys().cloned().collect();
        let now = Instant::now();
        self.inbox.forget_all(now);
        self.next_look = now;
    }
}
