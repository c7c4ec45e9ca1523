//! The stages, on threads of their own, and the bounded channels between them:
//! **read -> decompose -> map -> untangle -> write**, and behind them the commands that run on results.
//!
//! What travels before mapping and after it is a chart, not a file: the charts of one large input keep all processors
//! busy, and so do many small inputs. Rules that keep it moving:
//!
//! * There are three such belts, for small, middling and large inputs, so that no small input waits in a channel behind
//!   the charts of a large one. Among themselves inputs wait in a fair order ([`queue`]).
//! * What is large is done by a process of its own ([`apart`]), which has the same stages, so that what it dies of is its
//!   own affair.
//! * No more computations run at once than `--jobs` says, over all belts and processes ([`semaphore`]). Nobody waits for a
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

use crate::after::post_process::{self, Followed};
use crate::input::job::Job;
use crate::outcome::{Status, Stopped};
use crate::output::begun::Begun;
use crate::output::publish::{PublishError, Publisher};
use crate::report::{Facts, Report, SurfaceFacts};
use crate::settings::Settings;
use crate::stages;
use apart::parent::Parent;
use apart::stage::do_apart;
use completion::{Done, End, Ended};
use crossbeam_channel::{Receiver, Sender, bounded};
use grants::{Grants, Own};
use in_flight::{Shared, Travel};
use parking_lot::RwLock;
use planish_core::MappedChart;
use planish_core::atlas::Chart;
use planish_core::mesh::TriangleSoup;
use planish_core::monitor::Monitor;
use progress::Running;
use queue::Queue;
use reading::Next;
use stage::Stage;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::thread::JoinHandle;
use std::time::Duration;
use surface::{Place, Surface};
use writing::{After, Sink};

/// Ended jobs that nobody has asked for yet, at most.
const ENDED: usize = 64;

/// Results that wait for their commands, or to be put in place, at most: the former hold no memory to speak of, the latter
/// what the budget gives them.
pub const CHAINED: usize = 1024;

/// Results that are written at once, per belt: writing waits for the disk.
const WRITERS: usize = 4;

/// The running stages.
pub struct Conveyor {
    shared: Arc<Shared>,
    ended: Receiver<Ended>,
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
        for belt in 0..queue::BELTS {
            conveyor.belt(belt, &after)?;
        }
        let chain = after.chain.clone();
        conveyor.thread("parked", move || writing::look_after(to_look_after, &chain))?;
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
        conveyor.belt(queue::belt(bytes), &Arc::new(After { chain: chain.clone(), parked }))?;
        conveyor.thread("parked", move || writing::look_after(to_look_after, &chain))?;
        Ok(conveyor)
    }

    fn idle(settings: &Settings, sink: Sink, grants: Arc<dyn Grants>, begun: Option<Begun>, is_patient: bool) -> Self {
        let (ended, to_tell) = bounded(ENDED);
        let settings = RwLock::new(Arc::new(settings.clone()));
        let (queue, board) = (Queue::default(), progress::Board::default());
        let (steps, deaths) = Default::default();
        let shared = Arc::new(Shared { settings, sink, begun, is_patient, queue, grants, board, ended, steps, deaths });
        Self { shared, ended: to_tell, threads: Vec::new() }
    }

    /// Starts the stages of one belt.
    fn belt(&mut self, belt: usize, after: &Arc<After>) -> std::io::Result<()> {
        let jobs = self.shared.settings().jobs;
        let (soups, to_cut) = bounded(1);
        let (apart, to_do_apart) = bounded(1);
        let (charts, to_map) = bounded(jobs);
        let (mapped, to_untangle) = bounded(jobs);
        let (finished, to_write) = bounded(jobs);
        let shared = self.shared.clone();
        let next = Next { soups, apart, finished: finished.clone(), chain: after.chain.clone() };
        self.thread("read", move || {
            while let Some(waiting) = shared.queue.pop(belt) {
                survive(|| reading::read(Travel::begin(&shared, waiting), &next));
            }
        })?;
        if self.shared.sink.publisher().is_some() {
            let (refused, after) = (finished.clone(), after.clone());
            self.stage("apart", jobs, to_do_apart, move |one| do_apart(one, &refused, &after))?;
        }
        let refused = finished.clone();
        self.stage("decompose", jobs, to_cut, move |soup| cut(soup, &charts, &refused))?;
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
    facts: Facts,
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
    Stopped(Arc<Travel>, Box<Facts>, Stopped),
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

fn cut(Soup { travel, mut facts, soup }: Soup, charts: &Sender<Cut>, finished: &Sender<Finished>) {
    let cut = travel.compute(Stage::Decompose, |monitor| {
        let found = stages::repaired(&soup, &travel.settings)?;
        // The surface is all that is needed from here on.
        drop(soup);
        let surface = facts.surface.insert(SurfaceFacts::of(&found));
        surface.warnings.iter().for_each(|warning| tracing::warn!("{}", warning.message));
        let cut = stages::cut(found, &travel.settings, monitor)?;
        surface.decomposition = Some(cut.decomposition);
        Ok(cut)
    });
    match cut {
        Err(why) => hand_on(finished, Finished::Stopped(travel, Box::new(facts), why)),
        Ok(stages::Cut { mesh, charts: parts, .. }) => {
            let surface = Surface::new(travel, mesh, parts.len(), facts);
            for (i, chart) in parts.into_iter().enumerate() {
                hand_on(charts, Cut { surface: surface.clone(), place: (i, 0), chart });
            }
        }
    }
}

fn map(Cut { surface, place, chart }: Cut, untangle: &Sender<Mapped>, finished: &Sender<Finished>) {
    let travel = &surface.travel;
    let work = |monitor: &dyn Monitor| stages::map(&surface.mesh, chart, &travel.settings, monitor);
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
    let work = |monitor: &dyn Monitor| stages::untangle(&surface.mesh, mapped, &travel.settings, monitor);
    let part = if surface.is_due(place) { travel.compute(Stage::Untangle, work) } else { Err(Stopped::Unwanted) };
    deposit(surface, place, part, finished);
}

fn deposit(
    surface: Arc<Surface>,
    place: Place,
    part: Result<Vec<(Chart, planish_core::CertifiedChart)>, Stopped>,
    finished: &Sender<Finished>,
) {
    if surface.deposit(place, part) {
        hand_on(finished, Finished::Surface(surface));
    }
}

fn unwritten(travel: &Travel, error: PublishError) {
    tracing::error!("the result is not written: {error}");
    travel.end(End::Unwritten(error));
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
    if post_process::is_asked_for(&travel.settings, done.report.status) {
        // It may wait for the commands of others: that is no work that stands still.
        travel.reached(Stage::Chain);
        hand_on(chain, Chained { travel, done });
    } else {
        travel.end(End::Done(done));
    }
}

/// Runs the commands on a result, and puts its input away.
fn follow_up(Chained { travel, done }: Chained) {
    let _in_stage = travel.in_stage(Stage::Chain);
    let Some(publisher) = travel.shared.sink.publisher() else { return };
    travel.end(match post_process::run(&travel.job, &done.report, &travel.settings, publisher) {
        Ok(Followed::Whole) => End::Done(done),
        Ok(Followed::BrokenOff) => End::Unwanted,
        Ok(Followed::Until(then)) => End::Later(done, then),
        Ok(Followed::Busy) => End::Held(done, "somebody has it open for writing: it is put away when it is closed"),
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
