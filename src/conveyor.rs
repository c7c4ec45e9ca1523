//! The stages, on threads of their own, and the bounded channels between them:
//! **read -> decompose -> map -> untangle -> write**, and behind them the commands that run on results.
//!
//! What travels before mapping and after it is a chart, not a file: the charts of one large input keep all processors
//! busy, and so do many small inputs. Rules that keep it moving:
//!
//! * There are three such belts, for small, middling and large inputs, so that no small input waits in a channel behind
//!   the charts of a large one. Among themselves inputs wait in a fair order ([`queue`]).
//! * No more computations run at once than `--jobs` says, over all belts ([`turnstile`]). Nobody waits for a channel,
//!   memory or a disk while it holds a place; and channels lead forward only. So somebody always moves.
//! * Inputs take memory before they are read, charts before they are factorised ([`budget`]).
//! * A panic is caught where it happens and is a failure of its job. A job's end is told exactly once.
//! * What comes out does not depend on any of this: charts are put together in their order.
//!
//! When no more inputs come, the stages end front to back, as each closes the channel to the next.

pub mod board;
pub mod budget;
pub mod queue;
mod surface;
mod travel;
pub mod turnstile;

use crate::chain::{self, Followed};
use crate::formats::{Content, Notes};
use crate::job::{Done, End, Job, Stage, Stopped};
use crate::ledger;
use crate::outcome::{Code, Reason, Status};
use crate::publish::{PublishError, Publisher};
use crate::report::{self, Input, Report};
use crate::settings::Settings;
use crate::stages::{self, Files};
use board::Running;
use budget::Budget;
use crossbeam_channel::{Receiver, Sender, bounded};
use pipeline::MappedChart;
use pipeline::atlas::Chart;
use pipeline::host::Host;
use pipeline::mesh::TriangleSoup;
use queue::Queue;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use surface::{Place, Surface};
pub use travel::Ended;
use travel::{Shared, Travel};
use turnstile::Turnstile;

/// Ended jobs that nobody has asked for yet, at most.
const ENDED: usize = 64;

/// Results that wait for their commands, at most: they hold no memory to speak of.
const CHAINED: usize = 1024;

/// Results that are written at once, per belt: writing waits for the disk.
const WRITERS: usize = 4;

/// The running stages.
pub struct Conveyor {
    shared: Arc<Shared>,
    ended: Receiver<Ended>,
    threads: Vec<JoinHandle<()>>,
}

impl Conveyor {
    /// Starts the stages.
    ///
    /// # Errors
    /// Where the system has no more threads.
    pub fn start(settings: &Settings, publisher: Arc<Publisher>) -> std::io::Result<Self> {
        let (ended, to_tell) = bounded(ENDED);
        let shared = Arc::new(Shared {
            settings: settings.clone(),
            publisher,
            queue: Queue::default(),
            turnstile: Turnstile::new(settings.jobs),
            budget: Budget::new(settings.memory),
            board: board::Board::default(),
            ended,
        });
        let mut conveyor = Self { shared, ended: to_tell, threads: Vec::new() };
        let (chain, chained) = bounded(CHAINED);
        for belt in 0..queue::BELTS {
            conveyor.belt(belt, &chain)?;
        }
        conveyor.stage("chain", settings.commands, chained, follow_up)?;
        Ok(conveyor)
    }

    /// Starts the stages of one belt.
    fn belt(&mut self, belt: usize, chain: &Sender<Chained>) -> std::io::Result<()> {
        let jobs = self.shared.settings.jobs;
        let (soups, to_cut) = bounded(1);
        let (charts, to_map) = bounded(jobs);
        let (mapped, to_untangle) = bounded(jobs);
        let (finished, to_write) = bounded(jobs);
        let (shared, refused, checked) = (self.shared.clone(), finished.clone(), chain.clone());
        self.thread("read", move || {
            while let Some(waiting) = shared.queue.pop(belt) {
                survive(|| read(Travel::begin(&shared, waiting), &soups, &refused, &checked));
            }
        })?;
        let refused = finished.clone();
        self.stage("decompose", jobs, to_cut, move |soup| cut(soup, &charts, &refused))?;
        let refused = finished.clone();
        self.stage("map", jobs, to_map, move |chart| map(chart, &mapped, &refused))?;
        self.stage("untangle", jobs, to_untangle, move |mapped| untangle(mapped, &finished))?;
        let chain = chain.clone();
        self.stage("write", jobs.max(WRITERS), to_write, move |finished| write(finished, &chain))
    }

    /// Starts `count` threads that do `work` on everything that comes, until no more can come.
    fn stage<T: Send + 'static>(
        &mut self,
        name: &str,
        count: usize,
        input: Receiver<T>,
        work: impl Fn(T) + Clone + Send + 'static,
    ) -> std::io::Result<()> {
        for _ in 0..count {
            let (input, work) = (input.clone(), work.clone());
            self.thread(name, move || input.iter().for_each(|item| survive(|| work(item))))?;
        }
        Ok(())
    }

    fn thread(&mut self, name: &str, body: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
        self.threads.push(std::thread::Builder::new().name(name.to_owned()).spawn(body)?);
        Ok(())
    }

    /// Puts a job in the queue.
    pub fn submit(&self, job: Arc<Job>) {
        self.shared.queue.push(job);
    }

    /// No more jobs come: those that wait are still done, then the stages end.
    pub fn close(&self) {
        self.shared.queue.close();
    }

    /// Jobs as they end: each exactly once.
    pub fn ended(&self) -> &Receiver<Ended> {
        &self.ended
    }

    /// The next job that ends; none: none did within `patience`.
    pub fn next(&self, patience: Duration) -> Option<Ended> {
        self.ended.recv_timeout(patience).ok()
    }

    /// The jobs that wait, in their order.
    pub fn waiting(&self) -> Vec<Arc<Job>> {
        self.shared.queue.waiting()
    }

    /// The jobs on their way.
    pub fn running(&self) -> Vec<Running> {
        self.shared.board.running()
    }

    /// Waits until all stages have ended, after [`Self::close`]; what ends meanwhile is not told any more.
    pub fn join(self) {
        for thread in self.threads {
            while !thread.is_finished() {
                let _ = self.ended.recv_timeout(Duration::from_millis(5));
            }
            // A stage that broke down told so when it did.
            let _ = thread.join();
        }
    }
}

/// Does `work`. A panic in it, outside of what is computed for a job, drops what the stage holds, so that the job is told
/// to be lost; the stage goes on.
fn survive(work: impl FnOnce()) {
    if catch_unwind(AssertUnwindSafe(work)).is_err() {
        tracing::error!(
            "a stage broke down: that is a fault of planish; please report it, with what was logged at -vv"
        );
    }
}

/// What decomposition gets.
struct Soup {
    travel: Arc<Travel>,
    report: Report,
    soup: TriangleSoup,
}

/// What mapping gets.
struct Cut {
    surface: Arc<Surface>,
    place: Place,
    chart: Chart,
}

/// What untangling gets.
struct Mapped {
    surface: Arc<Surface>,
    place: Place,
    mapped: (Chart, MappedChart),
}

/// What writing gets.
enum Finished {
    /// All charts are in, or one stopped the job.
    Surface(Arc<Surface>),
    /// There are no charts.
    Stopped(Arc<Travel>, Box<Report>, Stopped),
}

/// What the commands get: a result.
struct Chained {
    travel: Arc<Travel>,
    done: Done,
}

/// Hands something on. That fails only where the next stage is gone, which then told so; the item is dropped, and with
/// it its job ends as lost.
fn hand_on<T>(to: &Sender<T>, item: T) {
    let _ = to.send(item);
}

fn read(travel: Arc<Travel>, soups: &Sender<Soup>, finished: &Sender<Finished>, chain: &Sender<Chained>) {
    if !travel.job.is_wanted() {
        return travel.end(End::Unwanted);
    }
    if !travel.job.is_unchanged() {
        return travel.end(End::Changed);
    }
    if let Err(error) = travel.shared.publisher.admits(&travel.job.name) {
        let _in_stage = travel.in_stage(Stage::Read);
        return unwritten(&travel, error);
    }
    let content = stages::read_input(&travel.job, &travel.shared.settings);
    if !travel.job.is_unchanged() {
        return travel.end(End::Changed);
    }
    let Shared { settings, publisher, .. } = &*travel.shared;
    let mut report = Report::new(input(&travel.job, content.as_deref().ok()), settings);
    let folder = stages::Folder::of_job(&travel.job);
    let decoded = travel.compute(Stage::Read, |_| {
        let bytes = content?;
        report.input.blake3 = Some(blake3::hash(&bytes).to_hex().to_string());
        let older = if settings.force {
            None
        } else {
            ledger::up_to_date(&publisher.target(&travel.job.name), &report, &folder)
        };
        Ok(match older {
            Some(older) => Err(older),
            None => {
                let content = stages::decode(&travel.job.path, &bytes, settings, &folder);
                Ok(content.map_err(|refusal| {
                    report.content = refusal.notes.map(|notes| *notes);
                    refusal.reason
                })?)
            }
        })
    });
    travel.job.set_beside(folder.asked());
    report.input.beside = folder.read();
    match decoded {
        Ok(Ok(Content { soup, notes })) => {
            warn_of_doubts(&travel, &notes);
            report.content = Some(notes);
            hand_on(soups, Soup { travel, report, soup });
        }
        Ok(Err(older)) => {
            travel.job.set_beside(older.input.beside.iter().map(|o| o.file.clone()).collect());
            let _in_stage = travel.in_stage(Stage::Read);
            tracing::info!(status = %older.status, "is up to date");
            published(travel.clone(), Done { report: older, up_to_date: true }, chain);
        }
        Err(Stopped::For(reason)) if reason.code == Code::MissingFile && travel.job.since.is_some() => {
            travel.end(End::Waiting(reason));
        }
        Err(why) => hand_on(finished, Finished::Stopped(travel, Box::new(report), why)),
    }
}

/// Tells where a file leaves open what its surface is.
fn warn_of_doubts(travel: &Travel, notes: &Notes) {
    if notes.polygons_doubtful > 0 {
        let _in_stage = travel.in_stage(Stage::Read);
        tracing::warn!(
            polygons = notes.polygons_doubtful,
            "polygons cross themselves, or are too intricate: the triangles they were cut into may fold; export the \
             surface as triangles"
        );
    }
    for remark in &notes.remarks {
        let _in_stage = travel.in_stage(Stage::Read);
        tracing::warn!("{remark}");
    }
}

fn input(job: &Job, content: Option<&[u8]>) -> Input {
    Input {
        name: job.name.to_string_lossy().into_owned(),
        bytes: content.map(|c| c.len() as u64),
        blake3: None,
        beside: vec![],
    }
}

fn cut(Soup { travel, mut report, soup }: Soup, charts: &Sender<Cut>, finished: &Sender<Finished>) {
    let settings = &travel.shared.settings;
    match travel.compute(Stage::Decompose, |host| stages::cut(soup, settings, &mut report, host)) {
        Err(why) => hand_on(finished, Finished::Stopped(travel, Box::new(report), why)),
        Ok((mesh, parts)) => {
            let surface = Surface::new(travel, mesh, parts.len(), report);
            for (i, chart) in parts.into_iter().enumerate() {
                hand_on(charts, Cut { surface: surface.clone(), place: (i, 0), chart });
            }
        }
    }
}

fn map(Cut { surface, place, chart }: Cut, untangle: &Sender<Mapped>, finished: &Sender<Finished>) {
    let travel = &surface.travel;
    let work = |host: &dyn Host| stages::map(&surface.mesh, chart, &travel.shared.settings, host);
    let parts = if surface.is_due(place) { travel.compute(Stage::Map, work) } else { Err(Stopped::Unwanted) };
    match parts {
        Err(why) => deposit(surface, place, Err(why), finished),
        Ok(parts) => {
            surface.expect(parts.len() - 1);
            for (k, mapped) in parts.into_iter().enumerate() {
                hand_on(untangle, Mapped { surface: surface.clone(), place: (place.0, k), mapped });
            }
        }
    }
}

fn untangle(Mapped { surface, place, mapped }: Mapped, finished: &Sender<Finished>) {
    let travel = &surface.travel;
    let work = |host: &dyn Host| stages::untangle(&surface.mesh, mapped, &travel.shared.settings, host);
    let part = if surface.is_due(place) { travel.compute(Stage::Untangle, work) } else { Err(Stopped::Unwanted) };
    deposit(surface, place, part, finished);
}

fn deposit(
    surface: Arc<Surface>,
    place: Place,
    part: Result<Vec<(Chart, pipeline::CertifiedChart)>, Stopped>,
    finished: &Sender<Finished>,
) {
    if surface.deposit(place, part) {
        hand_on(finished, Finished::Surface(surface));
    }
}

fn write(finished: Finished, chain: &Sender<Chained>) {
    let (travel, mut report, files) = match finished {
        Finished::Stopped(travel, report, why) => (travel, *report, Err(why)),
        Finished::Surface(surface) => {
            let (mut report, done) = surface.collect();
            let settings = &surface.travel.shared.settings;
            let assembled = surface.travel.compute(Stage::Write, |_| {
                Ok(stages::assemble(&surface.mesh, done?, surface.whole, settings, &mut report)?)
            });
            (surface.travel.clone(), report, assembled)
        }
    };
    let _in_stage = travel.in_stage(Stage::Write);
    let files = match files {
        Ok(files) => files,
        Err(Stopped::Unwanted) => return travel.end(End::Unwanted),
        Err(Stopped::For(reason)) => {
            refuse(&mut report, reason);
            Files::new()
        }
    };
    report.timing = travel.timing();
    match publish(&travel, &report, files) {
        Ok(true) => {
            log(&report);
            published(travel.clone(), Done { report, up_to_date: false }, chain);
        }
        Ok(false) => travel.end(if travel.job.is_wanted() { End::Changed } else { End::Unwanted }),
        Err(error) => unwritten(&travel, error),
    }
}

/// The report of an input that is refused, or failed.
fn refuse(report: &mut Report, reason: Reason) {
    report.status = reason.status();
    if reason.code == Code::Internal {
        // What a stage that broke down left in it is not to be trusted.
        report.charts.clear();
        report.outputs.clear();
    }
    report.reason = Some(reason);
}

fn unwritten(travel: &Travel, error: PublishError) {
    tracing::error!("the result is not written: {error}");
    travel.end(End::Unwritten(error));
}

fn publish(travel: &Travel, report: &Report, mut files: Files) -> Result<bool, PublishError> {
    files.push((report::FILE.to_owned(), report.to_json().map_err(PublishError::Report)?));
    travel.shared.publisher.publish(&travel.job.name, &files, || travel.job.is_wanted() && travel.job.is_unchanged())
}

fn log(report: &Report) {
    match &report.reason {
        None => tracing::info!(status = %report.status, charts = report.charts.len(), "ends"),
        Some(r) if report.status == Status::Refused => tracing::warn!(code = r.code.name(), "refused: {}", r.message),
        Some(r) => tracing::error!(code = r.code.name(), "failed: {}", r.message),
    }
}

/// A result stands: it goes to the commands, where there are any for such a one. These may take hours, and memory of their
/// own.
fn published(travel: Arc<Travel>, done: Done, chain: &Sender<Chained>) {
    travel.give_memory_back();
    if chain::is_asked_for(&travel.shared.settings, done.report.status) {
        hand_on(chain, Chained { travel, done });
    } else {
        travel.end(End::Done(done));
    }
}

/// Runs the commands on a result, and puts its input away.
fn follow_up(Chained { travel, done }: Chained) {
    travel.reached(Stage::Chain);
    let _in_stage = travel.in_stage(Stage::Chain);
    let Shared { settings, publisher, .. } = &*travel.shared;
    travel.end(match chain::run(&travel.job, &done.report, settings, publisher) {
        Ok(Followed::Whole) => End::Done(done),
        Ok(Followed::BrokenOff) => End::Unwanted,
        Ok(Followed::Until(then)) => End::Later(done, then),
        Ok(Followed::Changed) => {
            tracing::info!(
                "changed since it was read, whether its size and times show it or not: it is processed again"
            );
            End::Outdated(done)
        }
        Ok(Followed::Taken(command)) => {
            let error = taken(command);
            tracing::error!("{error}");
            End::Taken(done, error)
        }
        Err(error) => {
            tracing::error!("{error}");
            End::Unchained(done, error.to_string())
        }
    });
}

/// What to do about a command that takes the result away.
fn taken(command: usize) -> String {
    format!(
        "command {command} on the result, or somebody while it ran, has moved or removed the result or its report.json: \
         its input is not processed again before it changes or planish is started anew; let commands copy what they \
         need, and to clear the inbox use `--inputs move:DIR`"
    )
}
