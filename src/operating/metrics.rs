//! What the daemon does, for Prometheus: a text file that node_exporter's textfile collector reads.
//!
//! The file is always whole: it is written beside its place and renamed. Anybody may read it, as the collector runs as
//! another user; no name of an input is in it.

use crate::operating::status::{Counts, Status};
use crate::system::disk::{self, Disk, File as _, System};
use prometheus::{CounterVec, GaugeVec, Opts, Registry, TextEncoder};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// It is written at least so often.
const PERIOD: Duration = Duration::from_secs(15);

/// And at most so often, where inputs end one after another.
const REST: Duration = Duration::from_secs(1);

/// Everybody may read it, whatever the user's mask says.
const FOR_ALL: u32 = 0o644;

/// What is not in the status.
#[derive(Clone, Copy, Debug, Default)]
pub struct More {
    /// Processor time of planish and its children.
    pub processor: Duration,
    /// Processes that died of inputs since the start.
    pub deaths: u64,
}

/// Writes the file.
#[derive(Debug)]
pub struct Metrics {
    path: PathBuf,
    next: Instant,
    earliest: Instant,
    /// Whether it could be written the last time.
    is_written: bool,
}

impl Metrics {
    /// To this file.
    pub fn new(path: &Path) -> Self {
        let now = Instant::now();
        Self { path: path.to_owned(), next: now, earliest: now, is_written: true }
    }

    /// Something has ended: the file is written soon.
    pub fn soon(&mut self) {
        self.next = self.next.min(self.earliest);
    }

    /// When the file is written next.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// Writes the file.
    pub fn write(&mut self, status: &Status, more: More) {
        let now = Instant::now();
        (self.next, self.earliest) = (now + PERIOD, now + REST);
        let text = text(status, more).map_err(io::Error::other);
        let written = text.and_then(|text| put(&self.path, text.as_bytes()));
        // Told once, not every time, until it can be written again.
        if let Err(error) = &written
            && self.is_written
        {
            tracing::warn!(file = crate::system::escape::escape(&self.path), "the metrics cannot be written: {error}");
        }
        self.is_written = written.is_ok();
    }
}

/// Puts the file in its place at once.
fn put(path: &Path, text: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let folder = System.open(folder)?;
    let name = path.file_name().unwrap_or_default();
    disk::replace_with(&folder, &folder, name, |file| {
        file.append(text)?;
        file.set_mode(FOR_ALL)
    })
}

/// Whether what is counted only grows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Counter,
    Gauge,
}
use Kind::{Counter, Gauge};

/// The metrics as they are collected.
struct Page(Registry);

impl Page {
    /// A metric without labels.
    fn one(&self, kind: Kind, name: &str, help: &str, value: f64) -> prometheus::Result<()> {
        self.all(kind, name, help, &[], &[("", value)])
    }

    /// A metric that is told apart by a label (one, or none).
    fn all(
        &self,
        kind: Kind,
        name: &str,
        help: &str,
        label: &[&str],
        values: &[(&str, f64)],
    ) -> prometheus::Result<()> {
        let options = Opts::new(name, help).namespace("planish");
        // One of the two is filled and registered, the other is dropped.
        let counters = CounterVec::new(options.clone(), label)?;
        let gauges = GaugeVec::new(options, label)?;
        for (value_of_label, value) in values {
            let labels = if label.is_empty() { &[][..] } else { &[*value_of_label][..] };
            match kind {
                Counter => counters.get_metric_with_label_values(labels)?.inc_by(*value),
                Gauge => gauges.get_metric_with_label_values(labels)?.set(*value),
            }
        }
        match kind {
            Counter => self.0.register(Box::new(counters)),
            Gauge => self.0.register(Box::new(gauges)),
        }
    }

    fn text(&self) -> prometheus::Result<String> {
        TextEncoder::new().encode_to_string(&self.0.gather())
    }
}

/// The text of the file.
///
/// # Errors
/// Two metrics have the same name: a fault of planish.
pub fn text(status: &Status, more: More) -> prometheus::Result<String> {
    let page = Page(Registry::new());
    inputs(&page, status)?;
    let published = status.last_published.unwrap_or(0) as f64;
    let error = status.last_error.as_ref().map_or(0, |error| error.when) as f64;
    let paused = f64::from(u8::from(status.paused.is_some()));
    let processor = more.processor.as_secs_f64();
    page.one(Gauge, "start_timestamp_seconds", "When the daemon began.", status.since as f64)?;
    page.one(Gauge, "told_timestamp_seconds", "When this was told.", status.told as f64)?;
    page.one(Gauge, "last_publication_timestamp_seconds", "The last result; 0: none since the start.", published)?;
    page.one(Gauge, "last_error_timestamp_seconds", "The last error; 0: none since the start.", error)?;
    if let Some(free) = status.bytes_free {
        page.one(Gauge, "free_bytes", "Room on the disk of the results.", free as f64)?;
    }
    page.one(Gauge, "paused", "Whether no input is taken up, for want of room.", paused)?;
    page.one(Counter, "log_lines_lost_total", "Log messages that nobody took.", status.log_lines_lost as f64)?;
    page.one(Counter, "processor_seconds_total", "Processor time of planish and its children.", processor)?;
    page.one(Counter, "deaths_total", "Processes that died of inputs.", more.deaths as f64)?;
    page.text()
}

/// What is told of inputs.
fn inputs(page: &Page, status: &Status) -> prometheus::Result<()> {
    let Counts { certified, refused, failed } = status.ended;
    let results = [("certified", certified as f64), ("refused", refused as f64), ("failed", failed as f64)];
    page.all(Counter, "results_total", "Results since the start.", &["status"], &results)?;
    let (waiting, running) = (status.waiting as f64, status.running.len() as f64);
    page.one(Gauge, "inputs_waiting", "Inputs that wait for their turn.", waiting)?;
    page.one(Gauge, "inputs_running", "Inputs on their way.", running)?;
    page.one(Gauge, "inputs_unsettled", "Inputs that change still.", status.unsettled as f64)?;
    let states: Vec<_> = status.notable_states.iter().map(|(state, count)| (&state[..], *count as f64)).collect();
    let help = "Inputs that are neither jobs nor done with, or not as they should be.";
    page.all(Gauge, "inputs_notable", help, &["state"], &states)?;
    let oldest = status.oldest.unwrap_or(0.0);
    page.one(Gauge, "oldest_input_seconds", "How long the first input has waited; 0: none waits.", oldest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operating::status::Trouble;
    use std::fs;
    use std::os::unix::fs::PermissionsExt;

    /// A value by the name of its metric, labels included.
    fn value(text: &str, name: &str) -> Option<f64> {
        text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.parse().ok())
    }

    #[test]
    fn everything_is_told_with_its_kind() {
        let status = Status {
            ended: Counts { certified: 3, refused: 2, failed: 1 },
            waiting: 7,
            oldest: Some(12.5),
            notable_states: [("aside".to_owned(), 2), ("later".to_owned(), 0)].into(),
            last_error: Some(Trouble { when: 1_700_000_000, message: "a name\nand \"quotes\"".to_owned() }),
            bytes_free: Some(1 << 40),
            ..Status::default()
        };
        let text = text(&status, More { processor: Duration::from_millis(1500), deaths: 4 }).expect("text");
        for (name, expected) in [
            ("planish_results_total{status=\"refused\"}", 2.0),
            ("planish_inputs_waiting", 7.0),
            ("planish_inputs_notable{state=\"aside\"}", 2.0),
            ("planish_oldest_input_seconds", 12.5),
            ("planish_last_error_timestamp_seconds", 1_700_000_000.0),
            ("planish_free_bytes", (1_u64 << 40) as f64),
            ("planish_paused", 0.0),
            ("planish_processor_seconds_total", 1.5),
            ("planish_deaths_total", 4.0),
        ] {
            assert_eq!(value(&text, name), Some(expected), "{name}\n{text}");
        }
        assert!(text.contains("# TYPE planish_results_total counter\n") && !text.contains("quotes"));
    }

    #[test]
    fn the_file_is_whole_and_for_all_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("planish.prom");
        let mut metrics = Metrics::new(&path);
        for waiting in [1, 2] {
            metrics.write(&Status { waiting, ..Status::default() }, More::default());
            let text = fs::read_to_string(&path).expect("there");
            assert_eq!(value(&text, "planish_inputs_waiting"), Some(waiting as f64));
        }
        assert_eq!(fs::metadata(&path).expect("there").permissions().mode() & 0o777, 0o644);
        assert_eq!(fs::read_dir(folder.path()).expect("there").count(), 1);
    }
}
