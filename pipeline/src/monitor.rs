//! What watches over a computation: whether its result is still wanted, whose turn it is, how much memory it may take, and whether
//! some of it can be done at the same time.
//!
//! The core knows no thread and no clock. It asks a [`Monitor`] at safe points, many times a second, and waits there as
//! long as the monitor lets it: so a computation can be interrupted, or let others pass. What it computes does not depend
//! on the answers, except that an interrupted computation has no result but [`Interrupted`]: whatever can be interrupted
//! returns that as an error, and nobody sees a value that was not computed.
//!
//! Memory is reserved before a sparse system is factorised that is not small, which takes more of it than all else together. **A
//! computation holds at most one reservation at a time, and is at no safe point while it holds one**: each is made and
//! given back within one solution of a system ([`crate::fem::sparse`]). So whoever waits for memory waits for computations
//! that wait for nothing, and budgets cannot deadlock. What is done at the same time ([`Monitor::together`]) are computations of
//! their own in this.

use std::cell::Cell;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A part of a computation that needs none of its other parts; it is given the monitor that it must ask.
pub type Task<'a> = Box<dyn FnOnce(&dyn Monitor) + Send + 'a>;

/// What watches over a computation. It may be asked by many of them at once; where some are to be interrupted and others
/// not, each has a monitor of its own.
pub trait Monitor: Sync {
    /// A safe point: whether the result is still wanted. May block for a while, when it is the turn of others. Once the
    /// answer is no it must stay so.
    fn should_continue(&self) -> bool;

    /// Waits until `bytes` of memory may be taken. One request may be larger than any budget: then it should be granted
    /// when nothing else is reserved. Where the result is not wanted any more it should be granted at once.
    fn reserve(&self, bytes: u64);

    /// Gives reserved memory back: as much as was reserved, also when a computation fails or panics.
    fn release(&self, bytes: u64);

    /// Does all `tasks`, and returns when the last one is done. They are begun in their order; whoever has processors to spare does
    /// some of them at the same time, and whoever has not does [`one_by_one`]. Nothing is reserved meanwhile by whoever calls it.
    fn together(&self, tasks: Vec<Task<'_>>);
}

/// Does `tasks` one after another, under one monitor: how [`Monitor::together`] is done where there is one processor.
pub fn one_by_one(tasks: Vec<Task<'_>>, monitor: &dyn Monitor) {
    tasks.into_iter().for_each(|task| task(monitor));
}

/// Work on so many triangles is done by whoever has it: to hand half of it to another thread, and to wait for that, takes as long as
/// a hundred.
const LITTLE: usize = 2_000;

/// `items` in their order, neighbours together as long as they have no more than `most` triangles: what is small is not worth a task, or
/// a journey, of its own.
pub fn batches<T>(items: impl IntoIterator<Item = T>, triangles: impl Fn(&T) -> usize, most: usize) -> Vec<Vec<T>> {
    let mut batches: Vec<Vec<T>> = Vec::new();
    let mut room = 0;
    for item in items {
        let count = triangles(&item);
        match batches.last_mut().filter(|_| room >= count) {
            Some(batch) => batch.push(item),
            None => {
                batches.push(vec![item]);
                room = most;
            }
        }
        room = room.saturating_sub(count);
    }
    batches
}

/// What `work` makes of each of `items`, which have so many `triangles` in all, in their order; some at the same time, where the
/// monitor has processors to spare. Behind a failure no more are begun.
///
/// # Errors
/// That of the first item for which `work` fails.
pub(crate) fn try_each<T: Send, R: Send, E: Send>(
    monitor: &dyn Monitor,
    items: Vec<T>,
    triangles: usize,
    work: impl Fn(T, &dyn Monitor) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    if items.len() < 2 || triangles < LITTLE {
        return items.into_iter().map(|item| work(item, monitor)).collect();
    }
    let mut done: Vec<Option<Result<R, E>>> = items.iter().map(|_| None).collect();
    let (work, failed) = (&work, &AtomicUsize::new(usize::MAX));
    let mut tasks: Vec<Task<'_>> = Vec::with_capacity(items.len());
    for (number, (item, done)) in items.into_iter().zip(&mut done).enumerate() {
        tasks.push(Box::new(move |monitor| {
            // One before a failure is done in any case, whoever was faster: it may fail, too, and be the first.
            if number < failed.load(Ordering::Relaxed) {
                let result = work(item, monitor);
                if result.is_err() {
                    failed.fetch_min(number, Ordering::Relaxed);
                }
                *done = Some(result);
            }
        }));
    }
    monitor.together(tasks);
    done.into_iter().flatten().collect()
}

/// Nobody waits, nothing is limited.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoMonitor;

impl Monitor for NoMonitor {
    fn should_continue(&self) -> bool {
        true
    }

    fn reserve(&self, _bytes: u64) {}

    fn release(&self, _bytes: u64) {}

    fn together(&self, tasks: Vec<Task<'_>>) {
        one_by_one(tasks, self);
    }
}

/// The result was not wanted any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the computation was interrupted")]
pub struct Interrupted;

/// Reserved memory, given back when this is dropped.
pub struct Reserved<'a> {
    monitor: &'a dyn Monitor,
    bytes: u64,
}

impl<'a> Reserved<'a> {
    /// Waits for the memory.
    pub fn new(monitor: &'a dyn Monitor, bytes: u64) -> Self {
        monitor.reserve(bytes);
        Self { monitor, bytes }
    }
}

impl Drop for Reserved<'_> {
    fn drop(&mut self) {
        self.monitor.release(self.bytes);
    }
}

/// How much work is done between two questions: so many triangles looked at, which take a few milliseconds.
const WORK: usize = 20_000;

/// A monitor as the loops of a computation see it: they tell of every bit of work, and it is asked once in a while.
pub(crate) struct Checkpoint<'a> {
    pub monitor: &'a dyn Monitor,
    done: Cell<usize>,
}

impl<'a> Checkpoint<'a> {
    pub(crate) fn new(monitor: &'a dyn Monitor) -> Self {
        Self { monitor, done: Cell::new(0) }
    }

    /// Goes on after `work`, in triangles looked at, unless the result is not wanted any more.
    pub(crate) fn after(&self, work: usize) -> Result<(), Interrupted> {
        self.done.set(self.done.get() + work);
        if self.done.get() < WORK {
            return Ok(());
        }
        if !self.monitor.should_continue() {
            // Whoever went on all the same would be told so at once.
            return Err(Interrupted);
        }
        self.done.set(0);
        Ok(())
    }

    /// Asks at once: before a result is returned.
    pub(crate) fn end(&self) -> Result<(), Interrupted> {
        self.after(WORK)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::certify::PlanarMap;
    use crate::fem::sparse::{self, Pattern, solve_general};
    use crate::map::boundary::{Boundary, Mids};
    use crate::map::filled::FilledChart;
    use crate::map::linear::mean_value_map;
    use crate::mesh::{SurfaceMesh, TriangleSoup};
    use crate::topology::FaceId;
    use crate::{Error, Settings, decompose, parametrize_surface, repair, shapes};
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};

    /// Says yes so many times, and keeps account of the memory.
    struct Watchful {
        patience: usize,
        asked: AtomicUsize,
        reserved: AtomicU64,
        most: AtomicU64,
    }

    impl Watchful {
        fn new(patience: usize) -> Self {
            Self { patience, asked: AtomicUsize::new(0), reserved: AtomicU64::new(0), most: AtomicU64::new(0) }
        }

        /// How much was reserved at most; nothing must be left.
        fn most(&self) -> usize {
            assert_eq!(self.reserved.load(Relaxed), 0, "everything is given back");
            self.most.load(Relaxed) as usize
        }
    }

    impl Monitor for Watchful {
        fn should_continue(&self) -> bool {
            assert_eq!(self.reserved.load(Relaxed), 0, "no safe point while memory is reserved");
            self.asked.fetch_add(1, Relaxed) < self.patience
        }

        fn reserve(&self, bytes: u64) {
            assert!(bytes > 0);
            assert_eq!(self.reserved.swap(bytes, Relaxed), 0, "one reservation at a time");
            self.most.fetch_max(bytes, Relaxed);
        }

        fn release(&self, bytes: u64) {
            assert_eq!(self.reserved.swap(0, Relaxed), bytes);
        }

        fn together(&self, tasks: Vec<Task<'_>>) {
            assert_eq!(self.reserved.load(Relaxed), 0, "tasks reserve for themselves");
            one_by_one(tasks, self);
        }
    }

    fn surface(soup: &TriangleSoup) -> SurfaceMesh {
        repair(soup, &Default::default()).expect("a surface").mesh
    }

    fn whole(mesh: &SurfaceMesh) -> FilledChart {
        let labels = vec![0; mesh.triangles().len()];
        FilledChart::new(&decompose::assemble(mesh, &labels).expect("one chart").charts()[0])
    }

    /// Per chart its triangles and its map.
    type Maps = Vec<(Vec<FaceId>, PlanarMap)>;

    /// The whole story.
    fn maps(mesh: &SurfaceMesh, settings: &Settings, monitor: &dyn Monitor) -> Result<Maps, Error> {
        let atlas = parametrize_surface(mesh.clone(), settings, monitor)?;
        Ok(atlas.charts().iter().map(|c| (c.chart().faces().to_vec(), c.map().map().clone())).collect())
    }

    #[test]
    fn whatever_is_interrupted_ends_as_that_and_whatever_is_not_does_not_depend_on_the_monitor() {
        let of_charts = |decompose| Settings { decompose, ..Settings::default() };
        let ratio = |max_area_ratio: f64| {
            of_charts(decompose::Settings { max_area_ratio, feature_angle: None, ..Default::default() })
        };
        let disks = decompose::Settings { strict_disks: true, ..ratio(30.0).decompose };
        let mut reserved = 0;
        for (soup, settings) in [
            (shapes::ring_torus(30, 16), ratio(1e6)),
            (shapes::sphere(20), of_charts(disks)),
            // Split and untangled; at the higher ratio split after that.
            (shapes::bent_disk(20, 0.45, 1.0), ratio(1e3)),
            (shapes::bent_disk(32, 0.45, 1.0), ratio(5e5)),
            // With factors that are no small ones.
            (shapes::disk_with_holes(49, 3), Settings::default()),
            // The feasible path.
            (shapes::folding_six(), ratio(1e6)),
        ] {
            let mesh = surface(&soup);
            let patient = Watchful::new(usize::MAX);
            let wanted = maps(&mesh, &settings, &NoMonitor).expect("maps");
            assert!(maps(&mesh, &settings, &patient).expect("maps") == wanted);
            reserved += usize::from(patient.most() > 0);
            let asked = patient.asked.into_inner();
            for patience in (0..asked).step_by(asked.div_ceil(6)).chain([asked - 1]) {
                let monitor = Watchful::new(patience);
                let got = maps(&mesh, &settings, &monitor);
                assert!(matches!(got, Err(Error::Interrupted(_))), "after {patience} of {asked} answers");
                monitor.most();
            }
            assert!(maps(&mesh, &settings, &Watchful::new(asked)).expect("maps") == wanted);
        }
        assert!(reserved > 0, "small factors are not reserved");
    }

    /// Says yes so many times, then no; whoever asks again went on after it was interrupted.
    struct Once {
        patience: usize,
        asked: AtomicUsize,
    }

    impl Once {
        fn new(patience: usize) -> Self {
            Self { patience, asked: AtomicUsize::new(0) }
        }
    }

    impl Monitor for Once {
        fn should_continue(&self) -> bool {
            let before = self.asked.fetch_add(1, Relaxed);
            assert!(before <= self.patience, "asked again after the answer was no");
            before < self.patience
        }

        fn reserve(&self, _bytes: u64) {}

        fn release(&self, _bytes: u64) {}

        fn together(&self, tasks: Vec<Task<'_>>) {
            one_by_one(tasks, self);
        }
    }

    #[test]
    fn decomposition_does_nothing_more_once_it_is_interrupted() {
        type Job<'a> = Box<dyn Fn(&dyn Monitor) -> Result<usize, decompose::Error> + 'a>;
        let smooth = decompose::Settings { feature_angle: None, ..Default::default() };
        let featured = decompose::Settings { max_area_ratio: 30.0, ..Default::default() };
        let torus = surface(&shapes::ring_torus(60, 32));
        let tube = surface(&shapes::tube(24, 80, 20.0));
        let disk = surface(&shapes::bent_disk(40, 0.45, 1.0));
        let chart =
            decompose::assemble(&disk, &vec![0; disk.triangles().len()]).expect("one chart").into_charts().remove(0);
        let scales: Vec<f64> = (0..disk.triangles().len()).map(|f| disk.corners(f)[0][0]).collect();
        let is_left: Vec<bool> = scales.iter().map(|x| *x > 0.0).collect();
        let split = |scales: Option<&[f64]>, monitor: &dyn Monitor| {
            Ok(decompose::split(&chart, scales, &smooth, monitor)?.map_or(0, |parts| parts.len()))
        };
        let jobs: [Job; 5] = [
            Box::new(|monitor| Ok(decompose(&torus, &smooth, monitor)?.charts().len())),
            Box::new(|monitor| Ok(decompose(&tube, &featured, monitor)?.charts().len())),
            Box::new(|monitor| split(Some(&scales), monitor)),
            Box::new(|monitor| split(None, monitor)),
            Box::new(|monitor| Ok(decompose::halve(&chart, &is_left, &smooth, monitor)?.len())),
        ];
        for (number, job) in jobs.iter().enumerate() {
            let patient = Once::new(usize::MAX);
            let wanted = job(&patient).expect("nobody interrupts");
            let asked = patient.asked.into_inner();
            assert!(asked > 3, "job {number} asks {asked} times");
            for patience in (0..asked).step_by(asked.div_ceil(12)).chain([asked - 1]) {
                let got = job(&Once::new(patience));
                assert_eq!(got, Err(Interrupted.into()), "job {number} after {patience} of {asked} answers");
            }
            assert_eq!(job(&Once::new(asked)), Ok(wanted));
        }
    }

    /// Does tasks from the last to the first.
    struct Backwards;

    impl Monitor for Backwards {
        fn should_continue(&self) -> bool {
            true
        }

        fn reserve(&self, _bytes: u64) {}

        fn release(&self, _bytes: u64) {}

        fn together(&self, tasks: Vec<Task<'_>>) {
            one_by_one(tasks.into_iter().rev().collect(), self);
        }
    }

    #[test]
    fn what_comes_out_does_not_depend_on_the_order_in_which_tasks_are_done() {
        let apart =
            |soup: &TriangleSoup, by: f64| soup.points().iter().map(|p| [p[0] + by, p[1], p[2]]).collect::<Vec<_>>();
        // Two components; and one chart that falls into many parts.
        let torus = shapes::ring_torus(60, 32);
        let beyond = torus.triangles().iter().map(|t| t.map(|v| v + torus.points().len() as u32));
        let triangles = torus.triangles().iter().copied().chain(beyond).collect();
        let tori = TriangleSoup::new([apart(&torus, 0.0), apart(&torus, 100.0)].concat(), triangles).expect("sound");
        let fine = decompose::Settings { max_area_ratio: 30.0, feature_angle: None, ..Default::default() };
        let split = Settings { decompose: fine, ..Settings::default() };
        for (soup, settings) in [(tori, Settings::default()), (shapes::bent_disk(40, 0.45, 1.0), split)] {
            let mesh = surface(&soup);
            let forwards = maps(&mesh, &settings, &NoMonitor).expect("maps");
            assert!(forwards.len() > 2 && forwards == maps(&mesh, &settings, &Backwards).expect("maps"));
        }
    }

    #[test]
    fn the_first_failure_is_told_and_nothing_is_begun_behind_it() {
        let begun = AtomicUsize::new(0);
        let work = |number: usize, _: &dyn Monitor| {
            begun.fetch_add(1, Relaxed);
            if number % 3 == 2 { Err(number) } else { Ok(10 * number) }
        };
        assert_eq!(try_each(&NoMonitor, vec![0, 1, 3, 4], LITTLE, work), Ok(vec![0, 10, 30, 40]));
        assert_eq!(try_each(&NoMonitor, (0..9).collect(), LITTLE, work), Err(2));
        assert_eq!(begun.into_inner(), 4 + 3);
        // Whoever is faster.
        let work = |number: usize, _: &dyn Monitor| if number % 3 == 2 { Err(number) } else { Ok(number) };
        assert_eq!(try_each(&Backwards, (0..9).collect(), LITTLE, work), Err(2));
    }

    #[test]
    fn small_neighbours_are_one_batch() {
        let of = |items: &[usize]| batches(items.iter().copied(), |count| *count, 10);
        assert_eq!(of(&[3, 3, 4, 1, 20, 2, 9, 1]), [vec![3, 3, 4], vec![1], vec![20], vec![2], vec![9, 1]]);
        assert!(of(&[]).is_empty());
    }

    #[test]
    fn a_factor_holds_its_memory_until_it_is_dropped() {
        let spring = [[1.0, -1.0], [-1.0, 1.0]];
        let chain = |from: u32| {
            (from..60_000).map(|i| [i, if i == 0 { sparse::PRESCRIBED } else { i - 1 }]).collect::<Vec<_>>()
        };
        for (elements, unknowns) in [(chain(0), 60_000), (chain(1), 60_000)] {
            let pattern = Pattern::new(unknowns, &elements);
            let mut values = pattern.zeros();
            (0..elements.len()).for_each(|e| pattern.add(&mut values, e, &spring));
            let analysis = pattern.analyse().expect("small");
            let monitor = Watchful::new(usize::MAX);
            match analysis.factorise(&values, &monitor) {
                Ok(factor) => {
                    assert!(monitor.reserved.load(Relaxed) as usize >= 8 * analysis.factor_entries());
                    drop(factor);
                }
                Err(error) => assert_eq!(error, sparse::Unsolvable::Singular { unknowns }.into()),
            }
            assert!(monitor.most() >= 8 * analysis.factor_entries());
            let broken = catch_unwind(AssertUnwindSafe(|| {
                let _factor = analysis.factorise(&values, &monitor);
                panic!("while it is held");
            }));
            assert!(broken.is_err());
            monitor.most();
        }
    }

    #[test]
    fn general_systems_reserve_an_estimate() {
        let monitor = Watchful::new(usize::MAX);
        let chart = whole(&surface(&shapes::disk(8)));
        mean_value_map(&chart, &Boundary::circle(&chart, Mids::Arc), &monitor).expect("maps");
        assert!(monitor.most() > 0);
        let singular = [(0, 0, 1.0), (0, 1, 1.0), (1, 0, 1.0), (1, 1, 1.0)];
        assert!(solve_general(2, &singular, &mut [1.0, 2.0], 1, &monitor).is_err());
        monitor.most();
    }
}
