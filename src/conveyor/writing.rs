//! Putting results in their place, and trying again where the system gets in the way for a while.

use super::completion::{Done, End};
use super::in_flight::InFlight;
use super::stage::Stage;
use super::{Chained, Finished, log, published, unwritten};
use crate::outcome::{Abort, Code, Reason};
use crate::output::publish::{self, PublishError, Publisher, Staged};
use crate::report::{Facts, Report};
use crate::result_files;
use crate::stages::{self, Encoded, Files, Told};
use crate::system::passing;
use bytesize::ByteSize;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};
use planish_core::CertifiedChart;
use planish_core::mesh::SurfaceMesh;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::ScopedJoinHandle;
use std::time::{Duration, Instant};

/// Results that could not be written are looked after this often.
const LOOK: Duration = Duration::from_millis(100);

/// Where results go.
pub(super) enum Sink {
    /// To the output folder.
    Out(Arc<Publisher>),
    /// To a folder, for a parent that puts them in place.
    Folder(PathBuf),
}

impl Sink {
    /// What publishes, in a process that does.
    pub fn publisher(&self) -> Option<&Publisher> {
        if let Self::Out(publisher) = self { Some(publisher) } else { None }
    }
}

/// A result, ready to be put in place.
pub(super) struct Ready {
    pub in_flight: Arc<InFlight>,
    pub report: Report,
    pub content: Made,
}

impl Ready {
    /// Whether its files are still there: somebody may have removed those on disk.
    fn is_there(&self) -> bool {
        match &self.content {
            Made::Files(_) => true,
            Made::Staged(staged) => staged.is_there(),
        }
    }
}

/// The files of a result.
pub(super) enum Made {
    /// In memory.
    Files(Files),
    /// On disk.
    Staged(Staged),
}

/// Where a result goes that is written, and one that is not.
pub(super) struct After {
    pub chain: Sender<Chained>,
    pub parked: Sender<Ready>,
}

/// Puts the charts of a surface together, and puts its result in place.
pub(super) fn write(finished: Finished, after: &After) {
    let (in_flight, facts, files) = match finished {
        Finished::Abort(in_flight, facts, why) => (in_flight, *facts, Err(why)),
        Finished::Surface(surface) => {
            let (facts, done) = surface.collect();
            let in_flight = surface.in_flight.clone();
            let whole = surface.whole;
            let assembled = assembled(&in_flight, &facts, done, whole);
            (in_flight, facts, assembled)
        }
    };
    let (mut report, mut files) = match files {
        Ok(made) => made,
        Err(Abort::Unwanted) => return in_flight.end(End::Unwanted),
        Err(Abort::For(reason)) => (facts.stopped(&in_flight.settings, reason), Files::new()),
    };
    report.timing = in_flight.timing();
    match report.to_json() {
        Ok(text) => {
            files.push((result_files::REPORT.to_owned(), text));
            put(Ready { in_flight, report, content: Made::Files(files) }, after);
        }
        Err(error) => {
            let _in_stage = in_flight.in_stage(Stage::Write);
            unwritten(&in_flight, PublishError::Report(error));
        }
    }
}

/// The report of a surface of these charts, and its files.
///
/// These are encoded at the same time, on threads of their own, each of which has a place to compute; this one has none while it
/// waits for them.
fn assembled(
    in_flight: &InFlight,
    facts: &Facts,
    done: Result<(SurfaceMesh, Vec<Vec<CertifiedChart>>), Abort>,
    whole: usize,
) -> Result<(Report, Files), Abort> {
    let settings = &in_flight.settings;
    let labels = facts.content.as_ref().map_or(&[][..], |content| &content.labels);
    let told = Told { labels, fields: &facts.fields };
    let atlas = in_flight.compute(Stage::Write, |_| {
        let (mesh, charts) = done?;
        stages::gather(mesh, charts.into_iter().flatten().collect(), settings)
    })?;
    let encoding = |one| in_flight.compute(Stage::Write, |m| stages::encode(one, &atlas, told, settings, m));
    let encoded: Result<Vec<Encoded>, Abort> = std::thread::scope(|scope| {
        let encoding = &encoding;
        let start = |one| {
            (one, std::thread::Builder::new().name("encode".to_owned()).spawn_scoped(scope, move || encoding(one)))
        };
        let threads: Vec<_> = stages::encodings(settings).into_iter().map(start).collect();
        // Where the system gives no thread, this one does it; a panic was caught where it happened.
        let end = |(one, thread): (_, std::io::Result<ScopedJoinHandle<_>>)| match thread.map(ScopedJoinHandle::join) {
            Ok(Ok(encoded)) => encoded,
            Ok(Err(_)) | Err(_) => encoding(one),
        };
        threads.into_iter().map(end).collect()
    });
    let encoded = encoded?;
    in_flight.compute(Stage::Write, |_| {
        let (certified, files) = stages::assemble(&atlas, whole, told, encoded);
        Ok((facts.clone().certified(settings, certified), not_too_large(files, in_flight)?))
    })
}

/// The files, unless they are too large together.
fn not_too_large(files: Files, in_flight: &InFlight) -> Result<Files, Reason> {
    let bytes: u64 = files.iter().map(|(_, content)| content.len() as u64).sum();
    let most = in_flight.settings.limits.result;
    if bytes <= most {
        return Ok(files);
    }
    let [bytes, most] = [bytes, most].map(ByteSize::b);
    Err(Reason::new(
        Code::TooLarge,
        format!(
            "its result has {bytes}, more than {most}: decimate it, or raise `result` in the table [limits] of \
             planish.toml"
        ),
    ))
}

/// Puts a result in place, or keeps it for later.
pub(super) fn put(mut ready: Ready, after: &After) {
    let in_flight = ready.in_flight.clone();
    let _in_stage = in_flight.in_stage(Stage::Write);
    match try_to_put(&mut ready) {
        Err(error) if in_flight.shared.is_patient && ready.is_there() && !error.is_lasting() => {
            tracing::error!("the result is kept, and put in place as soon as that can be: {error}");
            in_flight.is_in_trouble(Some(error.to_string()));
            super::hand_on(&after.parked, ready);
        }
        ended => end(ready, ended, &after.chain),
    }
}

fn end(ready: Ready, ended: Result<bool, PublishError>, chain: &Sender<Chained>) {
    let Ready { in_flight, report, .. } = ready;
    match ended {
        Ok(true) => {
            if in_flight.shared.sink.publisher().is_some() {
                log(&report);
            }
            published(in_flight, Done { report, up_to_date: false }, chain);
        }
        Ok(false) => in_flight.end(if in_flight.job.is_wanted() { End::Changed } else { End::Unwanted }),
        Err(error) => unwritten(&in_flight, error),
    }
}

fn try_to_put(ready: &mut Ready) -> Result<bool, PublishError> {
    let Ready { in_flight, content, .. } = ready;
    let wanted = || in_flight.job.is_wanted() && in_flight.job.is_unchanged();
    let publisher = match &in_flight.shared.sink {
        Sink::Out(publisher) => publisher,
        Sink::Folder(folder) => {
            let Made::Files(files) = content else { return Ok(false) };
            return publish::write_to(folder, files).map(|()| true);
        }
    };
    match content {
        Made::Files(files) => publisher.publish(&in_flight.job.name, files, wanted),
        Made::Staged(staged) => publisher.put(&in_flight.job.name, staged, wanted),
    }
}

/// A result that could not be put in place, for a reason that passes.
struct Parked {
    ready: Ready,
    /// How often that was tried in vain.
    failures: u32,
    /// When it is tried again.
    then: Instant,
}

impl Parked {
    /// One that has failed so often, just now.
    fn new(ready: Ready, failures: u32) -> Self {
        Self { ready, failures, then: Instant::now() + passing::pause(failures) }
    }
}

/// Tries again to put results in place, in steps that grow, until nobody wants them or no more come.
pub(super) fn look_after(parked: Receiver<Ready>, chain: &Sender<Chained>) {
    let mut waiting: Vec<Parked> = Vec::new();
    loop {
        match parked.recv_timeout(LOOK) {
            Ok(ready) => waiting.push(Parked::new(ready, 1)),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) if waiting.is_empty() => return,
            // No more come, so nothing keeps this loop from spinning but a pause.
            Err(RecvTimeoutError::Disconnected) => std::thread::sleep(LOOK),
        }
        let mut still_waiting = Vec::new();
        for one in waiting {
            still_waiting.extend(look_at(one, chain));
        }
        waiting = still_waiting;
    }
}

/// Looks at a result that waits; it, where it still waits after that.
fn look_at(Parked { mut ready, failures, then }: Parked, chain: &Sender<Chained>) -> Option<Parked> {
    let in_flight = ready.in_flight.clone();
    let is_wanted = in_flight.job.is_wanted();
    if is_wanted && Instant::now() < then {
        return Some(Parked { ready, failures, then });
    }
    let _in_stage = in_flight.in_stage(Stage::Write);
    match try_to_put(&mut ready) {
        Err(error) if is_wanted && ready.is_there() && !error.is_lasting() => {
            tracing::debug!(failures, "the result is still not written: {error}");
            in_flight.is_in_trouble(Some(error.to_string()));
            Some(Parked::new(ready, failures + 1))
        }
        ended => {
            in_flight.is_in_trouble(None);
            end(ready, ended, chain);
            None
        }
    }
}
