//! Asking the daemon, or a run, to stop; and the daemon to read its settings again.

use crossbeam_channel::{Receiver, Sender, bounded};

/// Asks the daemon to stop: once politely, twice at once. Or to read its settings again.
#[derive(Clone, Debug)]
pub struct Stop {
    asked: Sender<()>,
    pub(super) heard: Receiver<()>,
    reload: Sender<()>,
    pub(super) to_reload: Receiver<()>,
}

impl Default for Stop {
    fn default() -> Self {
        let (asked, heard) = bounded(8);
        // However often it is asked meanwhile, the settings are read once.
        let (reload, to_reload) = bounded(1);
        Self { asked, heard, reload, to_reload }
    }
}

impl Stop {
    /// Asks.
    pub fn ask(&self) {
        // Full: it was asked often enough.
        let _ = self.asked.try_send(());
    }

    /// Asks to read the settings again.
    pub fn ask_to_reload(&self) {
        // Full: that is to come anyway.
        let _ = self.reload.try_send(());
    }

    /// Whether it was asked since the last call.
    pub fn is_asked(&self) -> bool {
        self.heard.try_recv().is_ok()
    }
}
