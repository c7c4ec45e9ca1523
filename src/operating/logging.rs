//! Log messages, on standard error.

use crate::settings::{Log, Settings};
use std::fs::File;
use std::io::IsTerminal;
use std::os::fd::AsFd;
use std::sync::OnceLock;
use std::sync::mpsc;
use std::time::Duration;
use tracing::level_filters::LevelFilter;
use tracing_appender::non_blocking::{ErrorCounter, NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::fmt::writer::BoxMakeWriter;

/// So many messages of a daemon wait for standard error at most: a megabyte or two.
const WAITING: usize = 10_000;

/// How long what still waits may take to be written at the end.
const LAST_WORDS: Duration = Duration::from_secs(2);

/// Counts what was lost.
static LOST: OnceLock<ErrorCounter> = OnceLock::new();

/// How many messages were lost since the start, because nobody took them off standard error.
pub fn lost() -> usize {
    LOST.get().map_or(0, ErrorCounter::dropped_lines)
}

/// Starts logging; a daemon informs without being asked. A panic becomes a log message too: it is caught per job, and told
/// there.
///
/// What a daemon says never holds up what it does: a reader of standard error that stands still costs messages, which are
/// counted ([`lost`]). What still waits is written when [`LastWords`] go.
#[must_use]
pub fn start(settings: &Settings, is_daemon: bool) -> LastWords {
    let level = match (settings.quiet, settings.verbose.saturating_add(u8::from(is_daemon))) {
        (true, _) => LevelFilter::ERROR,
        // What is refused is told by the summary already.
        (false, 0) => LevelFilter::ERROR,
        (false, 1) => LevelFilter::INFO,
        (false, 2) => LevelFilter::DEBUG,
        (false, _) => LevelFilter::TRACE,
    };
    let (writer, guard) = if is_daemon { aside() } else { (BoxMakeWriter::new(std::io::stderr), None) };
    let builder = tracing_subscriber::fmt().with_max_level(level).with_writer(writer).with_target(false);
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
    LastWords(guard)
}

/// Writes what still waits when it goes, if somebody takes it within two seconds.
pub struct LastWords(Option<WorkerGuard>);

impl Drop for LastWords {
    fn drop(&mut self) {
        let Some(guard) = self.0.take() else { return };
        // It waits, and complains on standard output, where nobody takes messages: not here.
        let (written, wait) = mpsc::channel();
        let flushed = std::thread::Builder::new().name("last words".to_owned()).spawn(move || {
            drop(guard);
            let _ = written.send(());
        });
        if flushed.is_ok() {
            let _ = wait.recv_timeout(LAST_WORDS);
        }
    }
}

/// A writer that hands messages to a thread, or counts them as lost.
fn aside() -> (BoxMakeWriter, Option<WorkerGuard>) {
    let builder = NonBlockingBuilder::default().lossy(true).buffered_lines_limit(WAITING).thread_name("log");
    // A handle of its own: who complains on standard error at the end does not wait for the lock of a writer that stands.
    let own = std::io::stderr().as_fd().try_clone_to_owned().map(File::from);
    let (writer, guard) = match own {
        Ok(file) => builder.finish(file),
        Err(_) => builder.finish(std::io::stderr()),
    };
    let _ = LOST.set(writer.error_counter());
    (BoxMakeWriter::new(writer), Some(guard))
}
