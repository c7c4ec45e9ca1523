//! A surface whose charts are on their way through a stage: they come together again when the last one is in.

use super::in_flight::InFlight;
use crate::outcome::Abort;
use crate::report::Facts;
use parking_lot::Mutex;
use planish_core::mesh::SurfaceMesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The place of a part among the others: that of its chart, and which part of it.
pub(super) type PartIndex = (usize, usize);

/// A surface that was cut into charts, of each of which something becomes.
pub(super) struct Surface<T> {
    pub in_flight: Arc<InFlight>,
    /// How many charts decomposition made.
    pub whole: usize,
    parts: Mutex<Parts<T>>,
}

struct Parts<T> {
    mesh: Option<SurfaceMesh>,
    facts: Facts,
    missing: usize,
    done: BTreeMap<PartIndex, T>,
    stopped: Option<(PartIndex, Abort)>,
}

impl<T> Surface<T> {
    /// A surface of which no chart is done yet; `missing` of them are on their way, of which decomposition made `whole`.
    pub fn new(in_flight: Arc<InFlight>, mesh: SurfaceMesh, whole: usize, missing: usize, facts: Facts) -> Arc<Self> {
        in_flight.shared.progress.update(in_flight.number, |job| job.charts = missing);
        let parts = Parts { mesh: Some(mesh), facts, missing, done: BTreeMap::new(), stopped: None };
        Arc::new(Self { in_flight, whole, parts: Mutex::new(parts) })
    }

    /// Whether the part at `part_index` is still to be done. Where one of several parts stops the job, it is always the first
    /// of those that would: so parts before it are done, and parts behind it are not.
    pub fn is_pending(&self, part_index: PartIndex) -> bool {
        self.parts.lock().stopped.as_ref().is_none_or(|(stopped, _)| part_index < *stopped)
    }

    /// A chart came as several parts instead of one.
    pub fn expect(&self, more: usize) {
        self.parts.lock().missing += more;
        self.in_flight.shared.progress.update(self.in_flight.number, |job| job.charts += more);
    }

    /// Parts are done, or stopped. Whether the last one is among them.
    pub fn complete_parts(&self, completed: Vec<(PartIndex, Result<T, Abort>)>) -> bool {
        let mut parts = self.parts.lock();
        let any = !completed.is_empty();
        parts.missing -= completed.len();
        for (part_index, part) in completed {
            match part {
                Ok(done) => drop(parts.done.insert(part_index, done)),
                Err(why) if parts.stopped.as_ref().is_none_or(|(stopped, _)| part_index < *stopped) => {
                    parts.stopped = Some((part_index, why));
                }
                Err(_) => {}
            }
        }
        any && parts.missing == 0
    }

    /// What is known so far, and the surface with what became of all charts in order, or why there are not all. Once: nothing
    /// is left here.
    pub fn collect(&self) -> (Facts, Result<(SurfaceMesh, Vec<T>), Abort>) {
        let mut parts = self.parts.lock();
        let done = std::mem::take(&mut parts.done).into_values().collect();
        let collected = match (parts.stopped.take(), parts.mesh.take()) {
            (None, Some(mesh)) => Ok((mesh, done)),
            (Some((_, why)), _) => Err(why),
            (None, None) => Err(Abort::Unwanted),
        };
        (parts.facts.clone(), collected)
    }
}

#[cfg(test)]
mod tests {
    use super::super::in_flight::tests::{begin, shared};
    use super::*;
    use crate::outcome::{Code, Reason};
    use crate::report::Input;
    use planish_core::{repair, shapes};

    /// Which part stops a job does not depend on which thread was first.
    #[test]
    fn the_first_part_that_stops_a_job_is_the_reason_in_any_order() {
        let (shared, _ended, _out) = shared(1 << 20);
        let refusal = |part_index: PartIndex| Abort::For(Reason::new(Code::NeedsSplit, format!("{part_index:?}")));
        let part_indices = [(2, 0), (0, 1), (1, 0)];
        for turn in 0..3 {
            let mesh = repair(&shapes::disk(2), &Default::default()).expect("a surface").mesh;
            let input = Input { name: "a.stl".to_owned(), bytes: None, blake3: None, beside: vec![] };
            let surface = Surface::new(begin(&shared), mesh, 3, 3, Facts::new(input));
            surface.expect(1);
            let mut order = part_indices;
            order.rotate_left(turn);
            assert!(!surface.complete_parts(vec![((0, 0), Ok(()))]));
            let last: Vec<bool> = order.iter().map(|p| surface.complete_parts(vec![(*p, Err(refusal(*p)))])).collect();
            assert_eq!(last, [false, false, true]);
            assert!(!surface.complete_parts(vec![]), "nobody is told twice");
            assert!(surface.is_pending((0, 0)) && !surface.is_pending((0, 2)));
            assert_eq!(surface.collect().1.expect_err("stopped"), refusal((0, 1)));
        }
    }
}
