//! A job between the stages: what it has taken and must give back, whatever becomes of it.

use super::budget::Account;
use super::completion::{Completion, End};
use super::grants::Grants;
use super::progress::Progress;
use super::queue::{Queue, Turn, Waiting, lane};
use super::stage::Stage;
use super::writing::Sink;
use crate::formats::{self, Kind};
use crate::input::{self, job::Job};
use crate::outcome::Abort;
use crate::output::begun::{Begun, Entry, Suspect};
use crate::settings::Settings;
use crate::stages::guard;
use crate::system::escape::escape;
use crate::system::vitals;
use crossbeam_channel::Sender;
use parking_lot::{Mutex, RwLock};
use planish_core::monitor::{Monitor, Task, one_by_one};
use std::collections::{BTreeMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use tracing::Span;

/// What all threads share.
pub(super) struct Shared {
    /// Those of inputs that are taken up from now on.
    pub settings: RwLock<Arc<Settings>>,
    pub sink: Sink,
    /// None in the process of a single job: its parent marks it.
    pub begun: Option<Begun>,
    /// Whether results are kept that cannot be written now.
    pub is_patient: bool,
    pub queue: Queue,
    pub grants: Arc<dyn Grants>,
    pub progress: Progress,
    pub ended: Sender<Completion>,
    /// Steps that work has taken: a sign of life.
    pub steps: AtomicU64,
    /// Processes that died of inputs.
    pub deaths: AtomicU64,
}

impl Shared {
    /// The settings as they are now.
    pub fn settings(&self) -> Arc<Settings> {
        self.settings.read().clone()
    }

    /// Work has taken a step.
    pub fn step(&self) {
        self.steps.fetch_add(1, Ordering::Relaxed);
    }
}

/// A job on its way. When the last stage lets go of it, its memory is given back and its end is told: exactly once,
/// even where a stage breaks down.
pub(super) struct InFlight {
    pub shared: Arc<Shared>,
    pub job: Arc<Job>,
    pub number: u64,
    /// The settings that were in force when it was taken up.
    pub settings: Arc<Settings>,
    /// Its place in the order of jobs.
    pub turn: Turn,
    suspect: Mutex<Option<Suspect>>,
    /// What was predicted that it takes, in bytes.
    predicted: u64,
    memory: AtomicU64,
    span: Span,
    seconds: Mutex<BTreeMap<&'static str, f64>>,
    end: Mutex<Option<End>>,
}

/// What an input takes from reading to writing, by its size and format. What is no mesh is only looked at.
fn memory(job: &Job) -> u64 {
    match formats::kind(&job.path) {
        Kind::Mesh(format) => (job.bytes / format.bytes_per_triangle()).saturating_mul(input::MEMORY_PER_TRIANGLE),
        Kind::OtherMesh(_) | Kind::NoMesh | Kind::Unknown(_) => job.bytes,
    }
}

impl InFlight {
    /// Takes a job up, once there is memory for its data.
    pub fn begin(shared: &Arc<Shared>, Waiting { job, turn }: Waiting) -> Arc<Self> {
        // Seen from outside before it waits for memory.
        let number = shared.progress.add(&job);
        let is_to_be_done = job.is_wanted() && job.doubted.is_none();
        let predicted = if is_to_be_done { memory(&job) } else { 0 };
        shared.grants.take(Account::Input(lane(job.bytes)), predicted, turn);
        let span = tracing::info_span!("job", input = escape(&job.name));
        let suspect = Mutex::new(span.in_scope(|| begin(shared, &job)));
        Arc::new(Self {
            shared: shared.clone(),
            job,
            number,
            // After the wait: those that are in force when work begins.
            settings: shared.settings(),
            turn,
            suspect,
            predicted,
            memory: AtomicU64::new(predicted),
            span,
            seconds: Mutex::default(),
            end: Mutex::new(None),
        })
    }

    /// What it takes from reading to writing, factors apart, as it was predicted by its size: in bytes.
    pub fn predicted(&self) -> u64 {
        self.predicted
    }

    /// How often a process has died while it was on its way.
    pub fn deaths(&self) -> u32 {
        self.suspect.lock().as_ref().map_or(0, Suspect::deaths)
    }

    /// Marks it as on its way in this process.
    pub fn mark(&self) {
        let marked = self.suspect.lock().as_mut().map_or(Ok(()), Suspect::begin);
        if let Err(error) = marked {
            self.span.in_scope(|| tracing::debug!("that it is on its way cannot be noted down: {error}"));
        }
    }

    /// The mark for a process of its own: where, and what it says.
    pub fn mark_apart(&self) -> Option<(PathBuf, Entry)> {
        let suspect = self.suspect.lock();
        let (path, entry) = suspect.as_ref()?.mark();
        Some((path.to_owned(), entry.clone()))
    }

    /// One more process has died of it; how many that are.
    pub fn count_death(&self) -> u32 {
        self.shared.deaths.fetch_add(1, Ordering::Relaxed);
        let mut suspect = self.suspect.lock();
        // Only a process of its own has none, and that starts no other.
        let Some(suspect) = suspect.as_mut() else { return u32::MAX };
        if let Err(error) = suspect.count_death() {
            self.span.in_scope(|| tracing::warn!("that a process died of it cannot be noted down: {error}"));
        }
        suspect.deaths()
    }

    /// It has come to its end, and nothing died of it.
    pub fn acquit(&self) {
        if let Some(suspect) = self.suspect.lock().as_mut().filter(|suspect| suspect.deaths() > 0) {
            suspect.acquit();
        }
    }

    /// Does the work of a stage: in its turn, its processor time booked. A panic is a failure of the job; what comes
    /// out for a job that nobody wants any more is dropped.
    pub fn compute<T>(&self, stage: Stage, work: impl FnOnce(&dyn Monitor) -> Result<T, Abort>) -> Result<T, Abort> {
        self.reached(stage);
        let result = self
            .inside(stage, |permit| if self.job.is_wanted() { guard(|| work(permit)) } else { Err(Abort::Unwanted) });
        // It may have been cancelled meanwhile: then nothing goes on, whatever came out.
        if self.job.is_wanted() { result } else { Err(Abort::Unwanted) }
    }

    /// Does work of a stage once there is a place for it, its processor time booked.
    fn inside<T>(&self, stage: Stage, work: impl FnOnce(&Permit) -> T) -> T {
        let permit = Permit::take(self, stage);
        let _in_stage = self.in_stage(stage);
        let started = vitals::processor_of_this_thread();
        let result = work(&permit);
        let taken = vitals::processor_of_this_thread() - started;
        *self.seconds.lock().entry(stage.name()).or_insert(0.0) += taken.as_secs_f64();
        result
    }

    /// Log messages until the end of what is returned are those of this job and stage.
    pub fn in_stage(&self, stage: Stage) -> impl Drop {
        self.span.in_scope(|| tracing::info_span!("stage", stage = stage.name())).entered()
    }

    /// Tells that the job has come so far.
    pub fn reached(&self, stage: Stage) {
        self.shared.step();
        self.shared.progress.update(self.number, |job| job.stage = job.stage.max(stage));
    }

    /// Tells how far a process of its own has come with it.
    pub fn is_at(&self, stage: Stage, charts_done: usize, charts: usize) {
        self.shared.progress.update(self.number, |job| {
            job.stage = job.stage.max(stage);
            (job.charts_done, job.charts) = (charts_done, charts);
        });
    }

    /// Tells what keeps it from going on.
    pub fn is_in_trouble(&self, trouble: Option<String>) {
        self.shared.progress.update(self.number, |job| job.trouble = trouble);
    }

    /// The processor time of all stages so far. Milliseconds are enough, and read well.
    pub fn timing(&self) -> BTreeMap<String, f64> {
        let mut timing = BTreeMap::new();
        for (stage, seconds) in self.seconds.lock().iter() {
            timing.insert((*stage).to_owned(), (seconds * 1e3).round() / 1e3);
        }
        timing
    }

    /// The data of the input is gone: others may take its memory.
    pub fn give_memory_back(&self) {
        // Once only, whoever comes first: the last stage, or the end of the job.
        let bytes = self.memory.swap(0, Ordering::Relaxed);
        self.shared.grants.give_back(Account::Input(lane(self.job.bytes)), bytes);
    }

    /// How the job ended.
    pub fn end(&self, end: End) {
        *self.end.lock() = Some(end);
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        self.give_memory_back();
        self.shared.progress.remove(self.number);
        self.shared.step();
        self.shared.queue.ended(&self.job);
        // Nobody told how it ended: a stage broke down.
        let end = self.end.get_mut().take().unwrap_or(End::Lost);
        // Fails only where nobody asks any more.
        let _ = self.shared.ended.send(Completion { job: self.job.clone(), end });
    }
}

/// Tells that a job begins; what is known of its input.
fn begin(shared: &Shared, job: &Job) -> Option<Suspect> {
    // The parent of a process of its own has done both.
    let begun = shared.begun.as_ref().filter(|_| job.doubted.is_none())?;
    tracing::info!("begins");
    let staging = shared.sink.publisher()?.staging();
    let staging = staging.inspect_err(|error| tracing::debug!("it cannot be marked as on its way: {error}")).ok()?;
    Some(begun.about(&job.name, job.look, &staging))
}

/// A place inside the semaphore.
struct Permit<'a> {
    in_flight: &'a InFlight,
    stage: Stage,
}

impl<'a> Permit<'a> {
    fn take(in_flight: &'a InFlight, stage: Stage) -> Self {
        in_flight.shared.grants.enter(in_flight.turn);
        Self { in_flight, stage }
    }
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        self.in_flight.shared.grants.leave();
    }
}

impl Monitor for Permit<'_> {
    fn should_continue(&self) -> bool {
        let InFlight { shared, turn, job, .. } = self.in_flight;
        shared.step();
        if job.is_wanted() {
            shared.grants.yield_to(*turn);
        }
        job.is_wanted()
    }

    fn reserve(&self, bytes: u64) {
        let InFlight { shared, turn, job, .. } = self.in_flight;
        if !job.is_wanted() {
            // It ends at its next safe point, and must not wait until then.
            shared.grants.overdraw(Account::Factor, bytes);
        } else if !shared.grants.try_take(Account::Factor, bytes) {
            tracing::debug!(bytes, "waits for memory");
            // Nobody waits while it holds a place to compute: those inside may be the ones who give memory back.
            shared.grants.leave();
            shared.grants.take(Account::Factor, bytes, *turn);
            shared.grants.enter(*turn);
        }
    }

    fn release(&self, bytes: u64) {
        self.in_flight.shared.grants.give_back(Account::Factor, bytes);
    }

    /// Other threads help as soon as there are places for them. They end when no task is left; a panic of theirs is one of this thread.
    fn together(&self, tasks: Vec<Task<'_>>) {
        let Self { in_flight, stage } = *self;
        let InFlight { shared, turn, settings, .. } = in_flight;
        let helpers = settings.jobs.min(tasks.len()).saturating_sub(1);
        if helpers == 0 {
            return one_by_one(tasks, self);
        }
        let tasks = Mutex::new(VecDeque::from(tasks));
        let next = || tasks.lock().pop_front();
        let work = |permit: &Permit| {
            while let Some(task) = next() {
                task(permit);
            }
        };
        let helped = std::thread::scope(|scope| {
            let help = || in_flight.inside(stage, work);
            let named = || std::thread::Builder::new().name(stage.name().to_owned());
            // Where the system has no thread, nobody helps.
            let helpers: Vec<_> = (0..helpers).filter_map(|_| named().spawn_scoped(scope, help).ok()).collect();
            let own = catch_unwind(AssertUnwindSafe(|| work(self)));
            // Nobody waits for others while it holds a place.
            shared.grants.leave();
            let of_helpers: Vec<_> = helpers.into_iter().map(|helper| helper.join()).collect();
            shared.grants.enter(*turn);
            of_helpers.into_iter().fold(own, Result::and)
        });
        if let Err(panic) = helped {
            resume_unwind(panic);
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::conveyor::grants::Own;
    use crate::outcome::Code;
    use crate::output::publish::Publisher;
    use crate::settings::RawSettings;
    use crossbeam_channel::{Receiver, bounded};

    /// What threads share, with an output folder that goes with it.
    pub fn shared(memory: u64) -> (Arc<Shared>, Receiver<Completion>, tempfile::TempDir) {
        shared_by(1, memory)
    }

    /// The same with so many places to compute.
    fn shared_by(jobs: usize, memory: u64) -> (Arc<Shared>, Receiver<Completion>, tempfile::TempDir) {
        let settings = RawSettings { jobs: Some(jobs), ..RawSettings::default() };
        let out = tempfile::tempdir().expect("a folder");
        let (ended, to_tell) = bounded(8);
        let shared = Shared {
            settings: RwLock::new(Arc::new(settings.check().expect("in range"))),
            sink: Sink::Out(Arc::new(Publisher::open(out.path()).expect("opens"))),
            begun: None,
            is_patient: false,
            queue: Queue::default(),
            grants: Arc::new(Own::new(jobs, memory)),
            progress: Progress::default(),
            ended,
            steps: AtomicU64::new(0),
            deaths: AtomicU64::new(0),
        };
        (Arc::new(shared), to_tell, out)
    }

    pub fn begin(shared: &Arc<Shared>) -> Arc<InFlight> {
        let job = Arc::new(Job::new("a.stl".into(), "a.stl".into(), 100));
        InFlight::begin(shared, Waiting { job, turn: 1 })
    }

    #[test]
    fn memory_goes_by_the_triangles_that_a_file_can_hold() {
        let memory = |name: &str| memory(&Job::new(name.into(), name.into(), 1_000_000));
        assert_eq!(["a.stl", "a.PLY", "a.txt"].map(memory), [30_000_000, 107_142_000, 1_000_000]);
    }

    #[test]
    fn a_panic_is_a_failure_of_its_job_and_what_it_held_is_given_back() {
        let (shared, ended, _out) = shared(1 << 20);
        let in_flight = begin(&shared);
        assert_eq!(shared.progress.running().len(), 1);
        let stopped = in_flight.compute(Stage::Map, |monitor| -> Result<(), Abort> {
            let _held = planish_core::monitor::Reserved::new(monitor, 1 << 19);
            panic!("a fault, for the test");
        });
        assert!(matches!(stopped, Err(Abort::For(reason)) if reason.code == Code::Internal));
        // Place and memory are free again; and nobody told how the job ended.
        assert_eq!(in_flight.compute(Stage::Map, |_| Ok(7)), Ok(7));
        assert!(shared.grants.try_take(Account::Factor, 1 << 19));
        drop(in_flight);
        assert!(matches!(ended.try_recv().expect("told").end, End::Lost));
        assert!(ended.try_recv().is_err() && shared.progress.running().is_empty());
        shared.grants.give_back(Account::Factor, 1 << 19);
        assert!(shared.grants.try_take(Account::Input(0), 1 << 20), "the memory for its data, too");
    }

    #[test]
    fn what_nobody_wants_is_not_computed_or_dropped() {
        let (shared, ended, _out) = shared(1 << 20);
        let in_flight = begin(&shared);
        let stopped = in_flight.compute(Stage::Map, |monitor| {
            assert!(monitor.should_continue());
            in_flight.job.cancel();
            assert!(!monitor.should_continue());
            Ok(())
        });
        assert_eq!(stopped, Err(Abort::Unwanted));
        assert_eq!(in_flight.compute(Stage::Map, |_| -> Result<(), _> { unreachable!() }), Err(Abort::Unwanted));
        in_flight.end(End::Unwanted);
        drop(in_flight);
        assert!(matches!(ended.try_recv().expect("told").end, End::Unwanted));
    }

    /// A job that waits for memory has left the semaphore: who holds the memory can go on.
    #[test]
    fn who_waits_for_memory_does_not_keep_others_from_computing() {
        let (shared, _ended, _out) = shared(1 << 20);
        let travels = [begin(&shared), begin(&shared)];
        let rounds = |in_flight: &Arc<InFlight>| {
            for _ in 0..200 {
                let done = in_flight.compute(Stage::Map, |monitor| {
                    let _held = planish_core::monitor::Reserved::new(monitor, 3 << 18);
                    monitor.should_continue();
                    Ok(())
                });
                assert_eq!(done, Ok(()));
            }
        };
        std::thread::scope(|s| travels.each_ref().map(|t| s.spawn(|| rounds(t))).map(|t| t.join().expect("ends")));
    }

    #[test]
    fn tasks_are_done_at_the_same_time_where_there_are_places_and_a_panic_in_one_fails_the_job() {
        let (shared, _ended, _out) = shared_by(2, 1 << 20);
        let in_flight = begin(&shared);
        let both = std::sync::Barrier::new(2);
        let meet = || -> Task<'_> {
            Box::new(|monitor| {
                assert!(monitor.should_continue());
                both.wait();
            })
        };
        let together = |tasks: Vec<Task<'_>>| {
            in_flight.compute(Stage::Map, |monitor| {
                monitor.together(tasks);
                Ok(())
            })
        };
        // They wait for each other.
        assert_eq!(together(vec![meet(), meet()]), Ok(()));
        let broken = together(vec![Box::new(|_| ()), Box::new(|_| panic!("a fault, for the test")), Box::new(|_| ())]);
        assert!(matches!(broken, Err(Abort::For(reason)) if reason.code == Code::Internal));
        // Nobody is left who holds a place.
        assert_eq!(together(vec![meet(), meet()]), Ok(()));
    }

    #[test]
    fn with_one_place_tasks_are_done_by_who_has_it_in_their_order() {
        let (shared, _ended, _out) = shared(1 << 20);
        let in_flight = begin(&shared);
        let done = Mutex::new(Vec::new());
        let task = |number: usize| -> Task<'_> {
            let done = &done;
            Box::new(move |_| done.lock().push((number, std::thread::current().id())))
        };
        let all = in_flight.compute(Stage::Map, |monitor| {
            monitor.together((0..9).map(task).collect());
            Ok(())
        });
        assert_eq!(all, Ok(()));
        let here = std::thread::current().id();
        assert_eq!(done.into_inner(), (0..9).map(|number| (number, here)).collect::<Vec<_>>());
    }
}
