//! The stages, on threads of their own, and the bounded channels between them:
//! **read -> decompose -> refine -> map -> untangle -> write**, and behind them the commands that run on results.
//!
//! What travels before mapping and after it is a chart, not a file: the charts of one large input keep all processors
//! busy, and so do many small inputs. Rules that keep it moving:
//!
//! * There are three such lanes, for small, middling and large inputs, so that no small input waits in a channel behind
//!   the charts of a large one. Among themselves inputs wait in a fair order ([`queue`]).
//! * What is large is done by a process of its own ([`apart`]), which has the same stages, so that what it dies of is its
//!   own affair.
//! * No more computations run at once than `--jobs` says, over all lanes and processes ([`semaphore`]). Nobody waits for a
//!   channel, memory or a disk while it holds a place; and channels lead forward only. So somebody always moves.
//! * Inputs take memory before they are read, charts before they are factorised ([`budget`]).
//! * A panic is caught where it happens and is a failure of its job. A job's end is told exactly once.
//! * What comes out does not depend on any of this: charts are put together in their order.
//!
//! When no more inputs come, the stages end front to back, as each closes the channel to the next.

pub mod apart;
pub mod budget;
pub mod completion;
mod grants;
mod in_flight;
pub mod progress;
pub mod queue;
mod reading;
pub mod semaphore;
pub mod stage;
mod surface;
mod sync;
mod writing;

use crate::after::post_process::{self, PostStatus};
use crate::input::job::Job;
use crate::outcome::{Abort, Status};
use crate::output::begun::Begun;
use crate::output::publish::{PublishError, Publisher};
use crate::report::{Decomposition, Facts, Report, SurfaceFacts};
use crate::settings::Settings;
use crate::stages;
use apart::parent::Parent;
use apart::stage::do_apart;
use completion::{Completion, Done, End};
use crossbeam_channel::{Receiver, Sender, bounded};
use grants::{Grants, Own};
use in_flight::{InFlight, Shared};
use parking_lot::RwLock;
use planish_core::mesh::TriangleSoup;
use planish_core::monitor::{Monitor, batches};
use planish_core::{CertifiedChart, ChartJob, MappedChart, Plan, Surveyed};
use progress::{Progress, Running};
use queue::Queue;
use reading::Next;
use stage::Stage;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use surface::{PartIndex, Surface};
use writing::{After, Sink};

/// Ended jobs that nobody has asked for yet, at most. By experience: with fewer, the stages would wait while a daemon
/// looks at its inbox; with more, more reports are in memory.
const ENDED: usize = 64;

/// Results that wait for their commands, or to be put in place, at most: the former hold no memory to speak of, the latter
/// what the budget gives them.
pub const CHAINED: usize = 1024;

/// Results that are written at once, per lane, where `--jobs` is less: writing waits for the disk, not for a processor.
/// By experience: more wait for the same disk, and each has a result in memory.
const WRITERS: usize = 4;

/// The running stages.
pub struct Conveyor {
    shared: Arc<Shared>,
    ended: Receiver<Completion>,
    threads: Vec<JoinHandle<()>>,
}

impl Conveyor {
    /// Starts the stages. One that is `patient` keeps results that cannot be written until they can.
    ///
    /// # Errors
    /// Where the system has no more threads.
    pub fn start(settings: &Settings, publisher: Arc<Publisher>, is_patient: bool) -> std::io::Result<Self> {
        let begun = Begun::new(publisher.out());
        let grants = Arc::new(Own::new(settings.jobs, settings.memory));
        let mut conveyor = Self::idle(settings, Sink::Out(publisher), grants, Some(begun), is_patient);
        let (chain, chained) = bounded(CHAINED);
        let (parked, to_look_after) = bounded(CHAINED);
        let after = Arc::new(After { chain, parked });
        for lane in 0..queue::LANES {
            conveyor.lane(lane, &after)?;
        }
        let chain = after.chain.clone();
        conveyor.thread("parked", move || writing::look_after(to_look_after, &chain))?;
        // Each lane has its own: the stages behind end when the last lane lets go of its senders.
        drop(after);
        conveyor.stage("chain", settings.commands, chained, follow_up)?;
        Ok(conveyor)
    }

    /// Starts the stages for a single input of `bytes`, whose files go to `folder`; its `parent` has places and memory.
    ///
    /// # Errors
    /// Where the system has no more threads.
    pub fn start_apart(settings: &Settings, folder: &Path, bytes: u64, parent: Arc<Parent>) -> std::io::Result<Self> {
        let mut conveyor = Self::idle(settings, Sink::Folder(folder.to_owned()), parent, None, true);
        // Nothing follows in this process.
        let (chain, _) = bounded(1);
        let (parked, to_look_after) = bounded(1);
        conveyor.lane(queue::lane(bytes), &Arc::new(After { chain: chain.clone(), parked }))?;
        conveyor.thread("parked", move || writing::look_after(to_look_after, &chain))?;
        Ok(conveyor)
    }

    /// A conveyor without threads.
    fn idle(settings: &Settings, sink: Sink, grants: Arc<dyn Grants>, begun: Option<Begun>, is_patient: bool) -> Self {
        let (ended, to_tell) = bounded(ENDED);
        let shared = Shared {
            settings: RwLock::new(Arc::new(settings.clone())),
            sink,
            begun,
            is_patient,
            queue: Queue::default(),
            grants,
            progress: Progress::default(),
            ended,
            steps: AtomicU64::new(0),
            deaths: AtomicU64::new(0),
        };
        Self { shared: Arc::new(shared), ended: to_tell, threads: Vec::new() }
    }

    /// Starts the stages of one lane.
    fn lane(&mut self, lane: usize, after: &Arc<After>) -> std::io::Result<()> {
        let jobs = self.shared.settings().jobs;
        // What is large waits before it is read, not behind that: one soup, and `--jobs` charts, per lane.
        let (soups, to_cut) = bounded(1);
        let (apart, to_do_apart) = bounded(1);
        let (cut_out, to_survey) = bounded(jobs);
        let (charts, to_map) = bounded(jobs);
        let (mapped, to_untangle) = bounded(jobs);
        let (finished, to_write) = bounded(jobs);
        let shared = self.shared.clone();
        let next = Next { soups, apart, finished: finished.clone(), chain: after.chain.clone() };
        self.thread("read", move || {
            while let Some(waiting) = shared.queue.pop(lane) {
                survive(|| reading::read(InFlight::begin(&shared, waiting), &next));
            }
        })?;
        if self.shared.sink.publisher().is_some() {
            let (refused, after) = (finished.clone(), after.clone());
            self.stage("apart", jobs, to_do_apart, move |one| do_apart(one, &refused, &after))?;
        }
        let refused = finished.clone();
        self.stage("decompose", jobs, to_cut, move |soup| cut(soup, &cut_out, &refused))?;
        let refused = finished.clone();
        self.stage("refine", jobs, to_survey, move |chart| survey(chart, &charts, &refused))?;
        let refused = finished.clone();
        self.stage("map", jobs, to_map, move |chart| map(chart, &mapped, &refused))?;
        self.stage("untangle", jobs, to_untangle, move |mapped| untangle(mapped, &finished))?;
        let after = after.clone();
        self.stage("write", jobs.max(WRITERS), to_write, move |finished| writing::write(finished, &after))
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

    /// Inputs that are taken up from now on are done with these settings. How many threads there are, and where results
    /// go, does not change.
    pub fn set_settings(&self, settings: Arc<Settings>) {
        *self.shared.settings.write() = settings;
    }

    /// Takes no job up, or takes them up again. After [`Self::close`] they are taken up in any case.
    pub fn pause(&self, is_paused: bool) {
        self.shared.queue.pause(is_paused);
    }

    /// How many steps work has taken: where it stands still, so does this number.
    pub fn steps(&self) -> u64 {
        self.shared.steps.load(Ordering::Relaxed)
    }

    /// How many processes have died of inputs.
    pub fn deaths(&self) -> u64 {
        self.shared.deaths.load(Ordering::Relaxed)
    }

    /// Jobs as they end: each exactly once.
    pub fn ended(&self) -> &Receiver<Completion> {
        &self.ended
    }

    /// The next job that ends; none: none did within `patience`.
    pub fn next(&self, patience: Duration) -> Option<Completion> {
        self.ended.recv_timeout(patience).ok()
    }

    /// The jobs that wait, in their order.
    pub fn waiting(&self) -> Vec<Arc<Job>> {
        self.shared.queue.waiting()
    }

    /// The jobs on their way.
    pub fn running(&self) -> Vec<Running> {
        self.shared.progress.running()
    }

    /// Waits until all stages have ended, after [`Self::close`]; what ends meanwhile is not told any more.
    pub fn join(self) {
        for thread in self.threads {
            // A full channel of ends would keep the last stage from ending.
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
    in_flight: Arc<InFlight>,
    facts: Facts,
    soup: TriangleSoup,
}

/// Charts that travel together: one large one, or small ones until they have [`TOGETHER`] triangles.
struct Charts<T, R> {
    surface: Arc<Surface<R>>,
    charts: Vec<(PartIndex, T)>,
}

/// What refinement gets.
type Uncharted = Charts<ChartJob, Surveyed>;

/// What mapping gets.
type Cut = Charts<ChartJob, Vec<CertifiedChart>>;

/// What untangling gets.
type Mapped = Charts<MappedChart, Vec<CertifiedChart>>;

/// Each chart by itself would wait for a place to compute, three times: menger_sponge3 has 7,000 of nine triangles each.
const TOGETHER: usize = 1_000;

impl<T, R> Charts<T, R> {
    /// Hands charts of a surface on, each with its place among them.
    fn hand_on(
        surface: &Arc<Surface<R>>,
        charts: impl IntoIterator<Item = (PartIndex, T)>,
        triangles: impl Fn(&T) -> usize,
        to: &Sender<Self>,
    ) {
        for charts in batches(charts, |(_, chart)| triangles(chart), TOGETHER) {
            hand_on(to, Self { surface: surface.clone(), charts });
        }
    }

    /// Does the work of a stage on each of them that is still wanted.
    fn compute<S>(
        self,
        stage: Stage,
        work: impl Fn(T, &dyn Monitor) -> Result<S, Abort>,
    ) -> Vec<(PartIndex, Result<S, Abort>)> {
        let Self { surface, charts } = self;
        let part_indices: Vec<PartIndex> = charts.iter().map(|(part_index, _)| *part_index).collect();
        let found = surface.in_flight.compute(stage, |monitor| {
            let of_chart = |(part_index, chart)| {
                let is_pending = surface.is_pending(part_index);
                (part_index, if is_pending { work(chart, monitor) } else { Err(Abort::Unwanted) })
            };
            Ok(charts.into_iter().map(of_chart).collect())
        });
        found.unwrap_or_else(|why| part_indices.into_iter().map(|index| (index, Err(why.clone()))).collect())
    }
}

/// What writing gets.
enum Finished {
    /// All charts are in, or one stopped the job.
    Surface(Arc<Surface<Vec<CertifiedChart>>>),
    /// There are no charts.
    Abort(Arc<InFlight>, Box<Facts>, Abort),
}

/// What the commands get: a result.
struct Chained {
    in_flight: Arc<InFlight>,
    done: Done,
}

/// Hands something on. That fails only where the next stage is gone, which then told so; the item is dropped, and with
/// it its job ends as lost.
fn hand_on<T>(to: &Sender<T>, item: T) {
    let _ = to.send(item);
}

fn cut(Soup { in_flight, mut facts, soup }: Soup, charts: &Sender<Uncharted>, finished: &Sender<Finished>) {
    let cut = in_flight.compute(Stage::Decompose, |monitor| {
        let found = stages::repaired(&soup, &in_flight.settings)?;
        // The surface is all that is needed from here on.
        drop(soup);
        let surface = facts.surface.insert(SurfaceFacts::of(&found));
        surface.warnings.iter().for_each(|warning| tracing::warn!("{}", warning.message));
        let (plan, refused) = stages::plan(found, &in_flight.settings, monitor)?;
        surface.refused = refused;
        surface.decomposition = Some(Decomposition {
            feature_edges: plan.feature_edges,
            ears_split: plan.ears_split,
            ..Decomposition::default()
        });
        Ok(plan)
    });
    match cut {
        Err(why) => hand_on(finished, Finished::Abort(in_flight, Box::new(facts), why)),
        Ok(Plan { mesh, jobs, .. }) => {
            let surface = Surface::new(in_flight, mesh, jobs.len(), jobs.len(), facts);
            // The stages behind work on the first charts while the last ones wait here for room in the channel.
            Charts::hand_on(&surface, numbered(jobs), triangles_of_job, charts);
        }
    }
}

/// Charts with their places.
fn numbered(jobs: Vec<ChartJob>) -> impl Iterator<Item = (PartIndex, ChartJob)> {
    jobs.into_iter().enumerate().map(|(number, job)| ((number, 0), job))
}

fn triangles_of_job(job: &ChartJob) -> usize {
    job.chart.triangles().len()
}

/// Looks at charts; behind the last one of a surface, refines that, and sends its charts on.
fn survey(uncharted: Uncharted, charts: &Sender<Cut>, finished: &Sender<Finished>) {
    let surface = uncharted.surface.clone();
    let found = uncharted.compute(Stage::Map, stages::survey);
    if !surface.complete_parts(found) {
        return;
    }
    let in_flight = surface.in_flight.clone();
    let (mut facts, surveyed) = surface.collect();
    let refined = surveyed.and_then(|(mesh, surveyed)| {
        in_flight.compute(Stage::Refine, |_| {
            let (mesh, jobs, done) = stages::refine(mesh, surveyed)?;
            if let Some(surface) = &mut facts.surface {
                surface.refinement = Some(done);
            }
            Ok((mesh, jobs))
        })
    });
    match refined {
        Err(why) => hand_on(finished, Finished::Abort(in_flight, Box::new(facts), why)),
        Ok((mesh, jobs)) => {
            let surface = Surface::new(in_flight, mesh, surface.whole, jobs.len(), facts);
            Charts::hand_on(&surface, numbered(jobs), triangles_of_job, charts);
        }
    }
}

fn map(cut: Cut, untangle: &Sender<Mapped>, finished: &Sender<Finished>) {
    let surface = cut.surface.clone();
    let (mut mapped, mut stopped, mut charts) = (Vec::new(), Vec::new(), 0);
    for (part_index, parts) in cut.compute(Stage::Map, stages::map) {
        match parts {
            Err(why) => stopped.push((part_index, Err(why))),
            Ok(parts) => {
                charts += 1;
                mapped.extend(parts.into_iter().enumerate().map(|(k, part)| ((part_index.0, k), part)));
            }
        }
    }
    // Before the first of them travels on: the surface must not be taken for complete.
    surface.expect(mapped.len() - charts);
    complete_parts(&surface, stopped, finished);
    Charts::hand_on(&surface, mapped, |mapped| mapped.chart().triangles().len(), untangle);
}

fn untangle(mapped: Mapped, finished: &Sender<Finished>) {
    let surface = mapped.surface.clone();
    let parts = mapped.compute(Stage::Untangle, stages::untangle);
    complete_parts(&surface, parts, finished);
}

fn complete_parts(
    surface: &Arc<Surface<Vec<CertifiedChart>>>,
    parts: Vec<(PartIndex, Result<Vec<CertifiedChart>, Abort>)>,
    finished: &Sender<Finished>,
) {
    let in_flight = &surface.in_flight;
    in_flight.shared.progress.update(in_flight.number, |job| job.charts_done += parts.len());
    if surface.complete_parts(parts) {
        hand_on(finished, Finished::Surface(surface.clone()));
    }
}

fn unwritten(in_flight: &InFlight, error: PublishError) {
    tracing::error!("the result is not written: {error}");
    in_flight.end(End::Unwritten(error));
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
fn published(in_flight: Arc<InFlight>, done: Done, chain: &Sender<Chained>) {
    in_flight.give_memory_back();
    if post_process::is_asked_for(&in_flight.settings, done.report.status) {
        // It may wait for the commands of others: that is no work that stands still.
        in_flight.reached(Stage::Chain);
        hand_on(chain, Chained { in_flight, done });
    } else {
        in_flight.end(End::Done(done));
    }
}

/// Runs the commands on a result, and puts its input away.
fn follow_up(Chained { in_flight, done }: Chained) {
    let _in_stage = in_flight.in_stage(Stage::Chain);
    let Some(publisher) = in_flight.shared.sink.publisher() else { return };
    in_flight.end(match post_process::run(&in_flight.job, &done.report, &in_flight.settings, publisher) {
        Ok(PostStatus::Whole) => End::Done(done),
        Ok(PostStatus::BrokenOff) => End::Unwanted,
        Ok(PostStatus::Until(then)) => End::Later(done, then),
        Ok(PostStatus::Busy) => End::Held(done, "somebody has it open for writing: it is put away when it is closed"),
        Ok(PostStatus::Changed) => {
            tracing::info!(
                "changed since it was read, whether its size and times show it or not: it is processed again"
            );
            End::Outdated(done)
        }
        Ok(PostStatus::Taken(command)) => {
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
