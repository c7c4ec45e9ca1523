//! Log messages, on standard error.

use crate::settings::{Log, Settings};
use std::io::IsTerminal;
use tracing::level_filters::LevelFilter;

/// Starts logging; a daemon informs without being asked. A panic becomes a log message too: it is caught per job, and told there.
pub fn start(settings: &Settings, is_daemon: bool) {
    let level = match (settings.quiet, settings.verbose.saturating_add(u8::from(is_daemon))) {
        (true, _) => LevelFilter::ERROR,
        // What is refused is told by the summary already.
        (false, 0) => LevelFilter::ERROR,
        (false, 1) => LevelFilter::INFO,
        (false, 2) => LevelFilter::DEBUG,
        (false, _) => LevelFilter::TRACE,
    };
    let builder = tracing_subscriber::fmt().with_max_level(level).with_writer(std::io::stderr).with_target(false);
    // That a message is lost (a full disk, a closed pipe) is no reason to break down, as its complaint about that would.
    let builder = builder.with_ansi(std::io::stderr().is_terminal()).log_internal_errors(false);
    // A second call, as tests make it, keeps the first subscriber.
    let _ = match settings.log {
        Log::Text => tracing::subscriber::set_global_default(builder.finish()),
        Log::Json => tracing::subscriber::set_global_default(builder.json().finish()),
    };
    std::panic::set_hook(Box::new(|panic| {
        tracing::debug!(place = %panic.location().map(ToString::to_string).unwrap_or_default(), "panic: {panic}");
    }));
}
