//! The boundaries of charts while seams move: loops of half-edges that are linked to those before and behind them.
//!
//! A path that is laid anew changes a few half-edges of boundaries that may have thousands. What decides whether the charts are
//! still charts (their loops, the vertices that they visit twice) follows from these few: where all that is left of a
//! loop is one piece, its ends are known without a walk along it. Walking all of it took 200 s on mri_brain_iso, of 812,000
//! triangles, where charts have thousands of seams.

use super::dual::Dual;
use crate::topology::HalfEdgeId;
use crate::topology::partition::Partition;

/// No element.
const NONE: u32 = u32::MAX;

/// The boundaries of all charts.
#[derive(Clone)]
pub(super) struct Boundaries {
    /// Per half-edge its side; [`NONE`] inside of charts.
    side_of: Vec<u32>,
    sides: Slab<Side>,
    loops: Slab<Loop>,
    /// Per vertex one of the sides that begin there, or [`NONE`].
    at: Vec<u32>,
    charts: Vec<OfChart>,
}

/// A half-edge that bounds a chart.
#[derive(Clone, Copy)]
struct Side {
    half_edge: HalfEdgeId,
    label: u32,
    /// The sides before and behind it.
    prev: u32,
    next: u32,
    /// Its loop.
    in_loop: u32,
    /// Its place among those of its chart.
    place: u32,
    /// Another side that begins at the same vertex, or [`NONE`].
    beside: u32,
    /// Whether it will be none any more by the change that is being looked at.
    goes: bool,
}

/// A loop of a boundary.
#[derive(Clone, Copy, Default)]
struct Loop {
    length: u32,
    /// How many of its sides are seams.
    seams: u32,
}

/// The boundary of a chart.
#[derive(Clone, Default)]
struct OfChart {
    /// Its sides, in no order.
    sides: Vec<u32>,
    loops: usize,
    /// Loops with a seam.
    seam_loops: usize,
    /// How often a vertex is visited again.
    pinches: usize,
}

/// What the boundary of a chart becomes.
pub(super) struct Change {
    label: u32,
    gone: Vec<u32>,
    cycles: Vec<Cycle>,
    /// The loops of which sides go, and what is left of each.
    cut: Vec<Cut>,
    /// How many half-edges it has.
    pub length: usize,
    pub loops: usize,
    /// Loops with a seam.
    pub seam_loops: usize,
    /// How often a vertex is visited again.
    pub pinches: usize,
}

/// What is left of a loop of which sides go.
#[derive(Clone, Copy)]
struct Cut {
    of: u32,
    left: Loop,
    /// The first and the last side of the one piece that is left, if any is.
    piece: Option<[u32; 2]>,
}

/// A loop as it will be: pieces of old ones and new sides, one behind the other.
#[derive(Default)]
struct Cycle {
    items: Vec<Item>,
    made: Loop,
}

#[derive(Clone, Copy)]
enum Item {
    /// What is left of the loop at this place among those that are cut.
    Left(usize),
    New(HalfEdgeId),
}

/// Elements that are referred to by their places, which may be given away again.
#[derive(Clone)]
struct Slab<T> {
    all: Vec<T>,
    free: Vec<u32>,
}

impl<T> Slab<T> {
    fn new() -> Self {
        Self { all: Vec::new(), free: Vec::new() }
    }

    fn insert(&mut self, element: T) -> u32 {
        if let Some(place) = self.free.pop() {
            self.all[place as usize] = element;
            return place;
        }
        self.all.push(element);
        self.all.len() as u32 - 1
    }

    fn get(&self, place: u32) -> &T {
        &self.all[place as usize]
    }

    fn get_mut(&mut self, place: u32) -> &mut T {
        &mut self.all[place as usize]
    }
}

impl Boundaries {
    /// Those of charts with labels below `labels`.
    pub(super) fn new(dual: &Dual, partition: &Partition<Dual>, labels: usize) -> Self {
        let mut made = Self {
            side_of: vec![NONE; 3 * dual.mesh.triangles().len()],
            sides: Slab::new(),
            loops: Slab::new(),
            at: vec![NONE; dual.mesh.points().len()],
            charts: vec![OfChart::default(); labels],
        };
        let mut of_labels = vec![Vec::new(); labels];
        for h in partition.boundary() {
            of_labels[partition.label(h) as usize].push(h);
        }
        for (label, come) in (0..).zip(of_labels) {
            if let Some(change) = made.change_by(dual, partition, label, vec![], &come) {
                made.make(dual, change);
            }
        }
        made
    }

    /// The half-edges around a chart, ascending.
    pub(super) fn around(&self, label: u32) -> Vec<HalfEdgeId> {
        let sides = &self.charts[label as usize].sides;
        let mut all: Vec<_> = sides.iter().map(|side| self.sides.get(*side).half_edge).collect();
        all.sort_unstable();
        all
    }

    /// What becomes of the boundary of a chart, where `near` are all half-edges that may bound it or no more, ascending; none where
    /// these form no loops.
    pub(super) fn change(
        &mut self,
        dual: &Dual,
        partition: &Partition<Dual>,
        label: u32,
        near: &[HalfEdgeId],
    ) -> Option<Change> {
        let (mut gone, mut come) = (Vec::new(), Vec::new());
        for h in near {
            let side = self.side_of[h.index()];
            let was = side != NONE && self.sides.get(side).label == label;
            let is = partition.label(*h) == label && partition.is_boundary(*h);
            match (was, is) {
                (true, false) => gone.push(side),
                (false, true) => come.push(*h),
                _ => {}
            }
        }
        if let Some(change) = self.change_by(dual, partition, label, gone, &come) {
            return Some(change);
        }
        // All of it is taken anew: where no pieces are left there is nothing to decide.
        let around = self.around(label);
        let mut all: Vec<HalfEdgeId> = around.into_iter().chain(come).collect();
        all.sort_unstable();
        all.retain(|h| partition.label(*h) == label && partition.is_boundary(*h));
        let gone = self.charts[label as usize].sides.clone();
        self.change_by(dual, partition, label, gone, &all)
    }

    /// That by the sides `gone` and the half-edges `come`, ascending; none where more than one piece of a loop is left, or a new one
    /// begins in the middle of a piece.
    fn change_by(
        &mut self,
        dual: &Dual,
        partition: &Partition<Dual>,
        label: u32,
        gone: Vec<u32>,
        come: &[HalfEdgeId],
    ) -> Option<Change> {
        gone.iter().for_each(|side| self.sides.get_mut(*side).goes = true);
        let cut = self.cut(dual, &gone);
        let cycles = cut.as_ref().and_then(|cut| self.cycles(dual, partition, cut, come));
        gone.iter().for_each(|side| self.sides.get_mut(*side).goes = false);
        let (cut, cycles) = (cut?, cycles?);
        let of_chart = &self.charts[label as usize];
        let seam_loops = |loops: &mut dyn Iterator<Item = Loop>| loops.filter(|l| l.seams > 0).count();
        let before = seam_loops(&mut cut.iter().map(|cut| *self.loops.get(cut.of)));
        let after = seam_loops(&mut cycles.iter().map(|cycle| cycle.made));
        Some(Change {
            length: of_chart.sides.len() + come.len() - gone.len(),
            loops: of_chart.loops + cycles.len() - cut.len(),
            seam_loops: of_chart.seam_loops + after - before,
            pinches: self.pinches(dual, label, &gone, come),
            label,
            gone,
            cycles,
            cut,
        })
    }

    /// The loops of which sides go; none where more than one piece of one is left.
    fn cut(&self, dual: &Dual, gone: &[u32]) -> Option<Vec<Cut>> {
        let mut of: Vec<u32> = gone.iter().map(|side| self.sides.get(*side).in_loop).collect();
        of.sort_unstable();
        of.dedup();
        let mut cuts: Vec<Cut> = of.iter().map(|of| Cut { of: *of, left: *self.loops.get(*of), piece: None }).collect();
        let mut before = vec![None; cuts.len()];
        for id in gone {
            let side = self.sides.get(*id);
            let k = of.binary_search(&side.in_loop).ok()?;
            cuts[k].left.length -= 1;
            cuts[k].left.seams -= u32::from(dual.twin(side.half_edge).is_some());
            // A piece ends before a side that goes, and begins behind one.
            if !self.sides.get(side.prev).goes && before[k].replace(side.prev).is_some() {
                return None;
            }
            if !self.sides.get(side.next).goes {
                cuts[k].piece = Some([side.next; 2]);
            }
        }
        for (cut, last) in cuts.iter_mut().zip(before) {
            cut.piece = cut.piece.zip(last).map(|([first, _], last)| [first, last]);
        }
        Some(cuts)
    }

    /// The loops that pieces and new half-edges form.
    fn cycles(&self, dual: &Dual, partition: &Partition<Dual>, cut: &[Cut], come: &[HalfEdgeId]) -> Option<Vec<Cycle>> {
        let first = |k: usize| cut[k].piece.map(|[first, _]| self.sides.get(first).half_edge);
        let item_at = |h: HalfEdgeId| match come.binary_search(&h) {
            Ok(k) => Some(cut.len() + k),
            Err(_) => (0..cut.len()).find(|k| first(*k) == Some(h)),
        };
        let mut is_taken = vec![false; cut.len() + come.len()];
        let mut cycles = Vec::new();
        for start in 0..is_taken.len() {
            if is_taken[start] || (start < cut.len() && cut[start].piece.is_none()) {
                continue;
            }
            let mut cycle = Cycle::default();
            let mut item = start;
            // Each item is taken once.
            while !std::mem::replace(&mut is_taken[item], true) {
                let last = if item < cut.len() {
                    cycle.items.push(Item::Left(item));
                    cycle.made.length += cut[item].left.length;
                    cycle.made.seams += cut[item].left.seams;
                    self.sides.get(cut[item].piece?[1]).half_edge
                } else {
                    let h = come[item - cut.len()];
                    cycle.items.push(Item::New(h));
                    cycle.made.length += 1;
                    cycle.made.seams += u32::from(dual.twin(h).is_some());
                    h
                };
                item = item_at(partition.next(last))?;
            }
            if item != start {
                return None;
            }
            cycles.push(cycle);
        }
        Some(cycles)
    }

    /// How often the boundary visits a vertex again.
    fn pinches(&self, dual: &Dual, label: u32, gone: &[u32], come: &[HalfEdgeId]) -> usize {
        let from = |h: HalfEdgeId| dual.from(h);
        let goes = gone.iter().map(|side| (from(self.sides.get(*side).half_edge), -1));
        let mut changes: Vec<(usize, isize)> = goes.chain(come.iter().map(|h| (from(*h), 1))).collect();
        changes.sort_unstable();
        let mut pinches = self.charts[label as usize].pinches as isize;
        for at_vertex in changes.chunk_by(|a, b| a.0 == b.0) {
            let before =
                self.begin_at(at_vertex[0].0).filter(|side| self.sides.get(*side).label == label).count() as isize;
            let after = before + at_vertex.iter().map(|(_, by)| by).sum::<isize>();
            pinches += (after - 1).max(0) - (before - 1).max(0);
        }
        pinches as usize
    }

    /// The sides that begin at a vertex.
    fn begin_at(&self, vertex: usize) -> impl Iterator<Item = u32> {
        let first = Some(self.at[vertex]).filter(|side| *side != NONE);
        std::iter::successors(first, |side| Some(self.sides.get(*side).beside).filter(|side| *side != NONE))
    }

    /// Makes a change, which must be of the boundary as it is.
    pub(super) fn make(&mut self, dual: &Dual, change: Change) {
        let label = change.label;
        for side in change.gone {
            self.take_out(dual, side);
        }
        let mut is_kept = vec![false; change.cut.len()];
        for cycle in &change.cycles {
            // The loop of the first piece goes on.
            let pieces: Vec<usize> = cycle.items.iter().filter_map(Item::piece).collect();
            let in_loop = match pieces.first() {
                Some(k) => {
                    is_kept[*k] = true;
                    let in_loop = change.cut[*k].of;
                    *self.loops.get_mut(in_loop) = cycle.made;
                    in_loop
                }
                None => self.loops.insert(cycle.made),
            };
            for [first, last] in pieces.iter().skip(1).filter_map(|k| change.cut[*k].piece) {
                self.move_to_loop(first, last, in_loop);
            }
            self.link(dual, cycle, &change.cut, label, in_loop);
        }
        let ended = change.cut.iter().zip(is_kept).filter(|(_, is_kept)| !is_kept);
        self.loops.free.extend(ended.map(|(cut, _)| cut.of));
        let of_chart = &mut self.charts[label as usize];
        (of_chart.loops, of_chart.seam_loops) = (change.loops, change.seam_loops);
        of_chart.pinches = change.pinches;
    }

    /// The sides from `first` to `last` are of another loop from now on.
    fn move_to_loop(&mut self, first: u32, last: u32, in_loop: u32) {
        let mut at = first;
        loop {
            self.sides.get_mut(at).in_loop = in_loop;
            if at == last {
                return;
            }
            at = self.sides.get(at).next;
        }
    }

    /// Links what follows each other in a cycle.
    fn link(&mut self, dual: &Dual, cycle: &Cycle, cut: &[Cut], label: u32, in_loop: u32) {
        let mut ends: Vec<[u32; 2]> = Vec::with_capacity(cycle.items.len());
        for item in &cycle.items {
            match *item {
                Item::Left(k) => ends.extend(cut[k].piece),
                Item::New(h) => ends.push([self.put_in(dual, h, label, in_loop); 2]),
            }
        }
        for (k, [first, _]) in ends.iter().enumerate() {
            let [_, before] = ends[(k + ends.len() - 1) % ends.len()];
            self.sides.get_mut(before).next = *first;
            self.sides.get_mut(*first).prev = before;
        }
    }

    fn put_in(&mut self, dual: &Dual, half_edge: HalfEdgeId, label: u32, in_loop: u32) -> u32 {
        let vertex = dual.from(half_edge);
        let place = self.charts[label as usize].sides.len() as u32;
        let beside = self.at[vertex];
        let side = Side { half_edge, label, prev: NONE, next: NONE, in_loop, place, beside, goes: false };
        let side = self.sides.insert(side);
        self.charts[label as usize].sides.push(side);
        self.at[vertex] = side;
        self.side_of[half_edge.index()] = side;
        side
    }

    fn take_out(&mut self, dual: &Dual, side: u32) {
        let Side { half_edge, label, place, beside, .. } = *self.sides.get(side);
        let of_chart = &mut self.charts[label as usize].sides;
        of_chart.swap_remove(place as usize);
        if let Some(moved) = of_chart.get(place as usize) {
            self.sides.get_mut(*moved).place = place;
        }
        let vertex = dual.from(half_edge);
        let before = self.begin_at(vertex).find(|other| self.sides.get(*other).beside == side);
        match before {
            Some(before) => self.sides.get_mut(before).beside = beside,
            None => self.at[vertex] = beside,
        }
        // Its half-edge may bound another chart by now.
        if self.side_of[half_edge.index()] == side {
            self.side_of[half_edge.index()] = NONE;
        }
        self.sides.free.push(side);
    }
}

impl Item {
    fn piece(&self) -> Option<usize> {
        match self {
            Self::Left(k) => Some(*k),
            Self::New(_) => None,
        }
    }
}

#[cfg(test)]
impl Boundaries {
    /// The loops of a chart, each from its least half-edge on, ascending, with what is counted of them.
    pub(super) fn told(&self, label: u32) -> (Vec<Vec<HalfEdgeId>>, [usize; 3]) {
        let mut loops: Vec<Vec<HalfEdgeId>> = Vec::new();
        for h in self.around(label) {
            let first = self.side_of[h.index()];
            if loops.iter().flatten().any(|g| *g == h) {
                continue;
            }
            let mut sides = vec![first];
            while self.sides.get(sides[sides.len() - 1]).next != first {
                sides.push(self.sides.get(sides[sides.len() - 1]).next);
            }
            let all: Vec<&Side> = sides.iter().map(|side| self.sides.get(*side)).collect();
            assert!(all.iter().all(|side| side.label == label && side.in_loop == all[0].in_loop && !side.goes));
            assert!(sides.iter().zip(&all[1..]).all(|(side, next)| next.prev == *side), "linked both ways");
            assert_eq!(self.loops.get(all[0].in_loop).length as usize, sides.len());
            loops.push(all.iter().map(|side| side.half_edge).collect());
        }
        let of_chart = &self.charts[label as usize];
        (loops, [of_chart.loops, of_chart.seam_loops, of_chart.pinches])
    }
}
