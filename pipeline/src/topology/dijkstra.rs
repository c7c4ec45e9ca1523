//! Shortest paths from one or more nodes of a graph (Dijkstra 1959, doi 10.1007/BF01386390), as a sweep that whoever asks
//! drives: it hands out nodes in the order of their distances, and is told of what can be reached from each.
//!
//! The graph is whatever the caller walks over: triangles, vertices, cells. So is the end of the sweep: whoever has found
//! what it looked for, or is interrupted, asks for no more nodes.
//!
//! The order is the same on every machine: of nodes at the same distance the least comes first.
//!
//! *It ends*: a node is handed out again only after its distance has fallen, and sums of lengths that are not negative have
//! a least one.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// A node on the front of a sweep. The greatest is the nearest one, as heaps give the greatest first; ties go to the least
/// node.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Waiting {
    distance: f64,
    node: u32,
}

impl Eq for Waiting {}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

/// What is known of a node that was reached.
#[derive(Clone, Copy, Debug)]
struct Reached<L> {
    sweep: u32,
    label: L,
    distance: f64,
}

/// A sweep over the nodes `0..len` of a graph, each with a label that it has from the node from which it was reached: the
/// source that is nearest, say, or the way back.
///
/// A sweep that starts anew takes constant time, so that short ones on a large graph cost what they visit.
pub(crate) struct ShortestPaths<L> {
    sweep: u32,
    known: Vec<Reached<L>>,
    front: BinaryHeap<Waiting>,
}

/// A node with its distance, which will not fall any more (as long as no sources are added).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Settled<L> {
    pub index: usize,
    pub distance: f64,
    pub label: L,
}

impl<L: Copy> ShortestPaths<L> {
    /// A sweep over so many nodes, none of which is reached; `any` label serves for these, and is never seen.
    pub(crate) fn new(len: usize, any: L) -> Self {
        let unreached = Reached { sweep: 0, label: any, distance: f64::INFINITY };
        Self { sweep: 1, known: vec![unreached; len], front: BinaryHeap::new() }
    }

    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.front.clear();
        self.sweep = self.sweep.checked_add(1).unwrap_or_else(|| {
            self.known.iter_mut().for_each(|known| known.sweep = 0);
            1
        });
    }

    /// Forgets a node that is not on the front any more.
    pub(crate) fn forget(&mut self, node: usize) {
        self.known[node].sweep = 0;
    }

    /// Makes a node a source, at distance 0, whatever is known of it.
    pub(crate) fn start(&mut self, node: usize, label: L) {
        self.record(node, 0.0, label);
        self.front.push(Waiting { distance: 0.0, node: node as u32 });
    }

    /// Reaches a node along a path of this length; whether there was none, or none as short.
    pub(crate) fn reach(&mut self, node: usize, distance: f64, label: L) -> bool {
        self.reach_towards(node, distance, label, 0.0)
    }

    /// As [`Self::reach`], on the way to a goal to which no path from the node is shorter than `ahead`.
    pub(crate) fn reach_towards(&mut self, node: usize, distance: f64, label: L, ahead: f64) -> bool {
        let is_shorter = self.distance(node).is_none_or(|known| distance < known);
        if is_shorter {
            self.record(node, distance, label);
            self.front.push(Waiting { distance: distance + ahead, node: node as u32 });
        }
        is_shorter
    }

    /// The nearest node of the front.
    pub(crate) fn settle(&mut self) -> Option<Settled<L>> {
        self.settle_towards(|_| 0.0)
    }

    /// As [`Self::settle`], where nodes were reached on the way to a goal: the one whose distance, with what is `ahead` of it
    /// at least, is least (A*: Hart, Nilsson and Raphael 1968, doi 10.1109/TSSC.1968.300136).
    pub(crate) fn settle_towards(&mut self, ahead: impl Fn(usize) -> f64) -> Option<Settled<L>> {
        while let Some(waiting) = self.front.pop() {
            let index = waiting.node as usize;
            let Reached { distance, label, .. } = self.known[index];
            // A node that was reached again on a shorter path waits once for each of them.
            if waiting.distance <= distance + ahead(index) {
                return Some(Settled { index, distance, label });
            }
        }
        None
    }

    /// The length of the shortest path to a node so far, if it was reached.
    pub(crate) fn distance(&self, node: usize) -> Option<f64> {
        let known = &self.known[node];
        (known.sweep == self.sweep).then_some(known.distance)
    }

    /// The label of a node, if it was reached.
    pub(crate) fn label(&self, node: usize) -> Option<L> {
        let known = &self.known[node];
        (known.sweep == self.sweep).then_some(known.label)
    }

    fn record(&mut self, node: usize, distance: f64, label: L) {
        self.known[node] = Reached { sweep: self.sweep, label, distance };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes::Random;

    /// A grid of `SIDE` x `SIDE` nodes with random steps along x and y.
    struct Grid {
        steps: Vec<[f64; 2]>,
    }

    const SIDE: usize = 12;

    impl Grid {
        fn new(random: &mut Random) -> Self {
            // Few lengths, so that many paths are as long as others; some of none.
            let mut step = || random.below(4) as f64;
            Self { steps: (0..SIDE * SIDE).map(|_| [step(), step()]).collect() }
        }

        fn neighbours(&self, node: usize) -> Vec<(usize, f64)> {
            let (x, y) = (node % SIDE, node / SIDE);
            let mut all = Vec::new();
            if x > 0 {
                all.push((node - 1, self.steps[node - 1][0]));
            }
            if x + 1 < SIDE {
                all.push((node + 1, self.steps[node][0]));
            }
            if y > 0 {
                all.push((node - SIDE, self.steps[node - SIDE][1]));
            }
            if y + 1 < SIDE {
                all.push((node + SIDE, self.steps[node][1]));
            }
            all
        }

        /// Bellman and Ford: as many rounds as there are nodes.
        fn distances(&self, sources: &[usize]) -> Vec<f64> {
            let mut distances = vec![f64::INFINITY; SIDE * SIDE];
            sources.iter().for_each(|s| distances[*s] = 0.0);
            for _ in 0..SIDE * SIDE {
                for node in 0..SIDE * SIDE {
                    for (other, step) in self.neighbours(node) {
                        distances[other] = distances[other].min(distances[node] + step);
                    }
                }
            }
            distances
        }

        fn sweep(&self, paths: &mut ShortestPaths<usize>) -> Vec<Settled<usize>> {
            let mut settled = Vec::new();
            while let Some(node) = paths.settle() {
                settled.push(node);
                for (other, step) in self.neighbours(node.index) {
                    paths.reach(other, node.distance + step, node.label);
                }
            }
            settled
        }
    }

    #[test]
    fn distances_are_the_shortest_and_come_in_order() {
        let mut random = Random(5);
        let mut paths = ShortestPaths::new(SIDE * SIDE, 0);
        for _ in 0..30 {
            let grid = Grid::new(&mut random);
            let sources = [random.below(SIDE * SIDE), random.below(SIDE * SIDE)];
            paths.clear();
            sources.iter().for_each(|s| paths.start(*s, *s));
            let settled = grid.sweep(&mut paths);
            let wanted = grid.distances(&sources);
            for (node, wanted) in wanted.iter().enumerate() {
                assert_eq!(paths.distance(node), Some(*wanted));
                let nearest = paths.label(node).expect("reached");
                assert_eq!(grid.distances(&[nearest])[node], *wanted, "the label is that of a nearest source");
            }
            assert!(settled.is_sorted_by(|a, b| a.distance <= b.distance));
        }
    }

    #[test]
    fn of_equally_near_nodes_the_least_comes_first() {
        let mut paths = ShortestPaths::new(5, ());
        for node in [4, 1, 3] {
            paths.reach(node, 2.0, ());
        }
        paths.reach(0, 3.0, ());
        assert!(!paths.reach(4, 2.0, ()), "no shorter");
        assert!(paths.reach(0, 2.0, ()), "shorter");
        let order: Vec<usize> = std::iter::from_fn(|| paths.settle()).map(|s| s.index).collect();
        assert_eq!(order, [0, 1, 3, 4]);
        assert_eq!((paths.distance(2), paths.label(2)), (None, None));
    }

    #[test]
    fn what_is_forgotten_was_never_reached() {
        let mut paths = ShortestPaths::new(2, 'x');
        paths.start(0, 'a');
        assert_eq!(paths.settle(), Some(Settled { index: 0, distance: 0.0, label: 'a' }));
        paths.forget(0);
        assert_eq!(paths.distance(0), None);
        assert!(paths.reach(0, 7.0, 'b'));
        paths.clear();
        assert_eq!((paths.settle(), paths.label(0)), (None, None));
        paths.sweep = u32::MAX;
        paths.start(1, 'c');
        paths.clear();
        assert_eq!(paths.distance(1), None);
    }

    #[test]
    fn a_goal_draws_the_sweep_and_does_not_change_its_result() {
        let mut random = Random(6);
        let mut paths = ShortestPaths::new(SIDE * SIDE, 0);
        for _ in 0..30 {
            let mut grid = Grid::new(&mut random);
            grid.steps.iter_mut().flatten().for_each(|s| *s += 1.0);
            let goal = random.below(SIDE * SIDE);
            // Steps of 1 at least: no path is shorter than the Manhattan distance.
            let ahead = |n: usize| ((n % SIDE).abs_diff(goal % SIDE) + (n / SIDE).abs_diff(goal / SIDE)) as f64;
            paths.clear();
            paths.start(0, 0);
            let mut visited = 0;
            while let Some(node) = paths.settle_towards(ahead) {
                visited += 1;
                if node.index == goal {
                    break;
                }
                for (other, step) in grid.neighbours(node.index) {
                    paths.reach_towards(other, node.distance + step, 0, ahead(other));
                }
            }
            let wanted = grid.distances(&[0]);
            assert_eq!(paths.distance(goal), Some(wanted[goal]));
            assert!(visited <= wanted.iter().filter(|d| **d <= wanted[goal]).count());
        }
    }
}
