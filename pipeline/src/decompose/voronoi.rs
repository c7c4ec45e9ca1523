//! Farthest-first cells of a graph: each node belongs to the nearest seed, seeds are as far apart as they can be.
//!
//! Seeds are chosen one after the other, each at the node farthest from those before (Gonzalez 1985, doi
//! 10.1016/0304-3975(85)90224-5; at most twice the best possible radius). Distances are geodesic along the graph, so
//! that cells follow the shape, not the triangulation. A new seed only visits what comes closer to it: with k seeds
//! on n evenly spread nodes about n log k visits.

use crate::monitor::Interrupted;
use crate::topology::dijkstra::ShortestPaths;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::collections::binary_heap::PeekMut;

const NO_CELL: u32 = u32::MAX;

/// Nodes `0..len` and what they are joined to.
pub(super) trait Graph {
    fn len(&self) -> usize;
    /// Tells the neighbours of `node` with their distances, which are not negative.
    fn each_neighbour(&self, node: usize, visit: impl FnMut(usize, f64));
}

/// A partition of a graph into connected cells.
#[derive(Clone, Debug)]
pub(super) struct Cells {
    /// Per node its cell.
    pub labels: Vec<u32>,
    /// The number of cells.
    pub len: usize,
}

/// The cells while seeds are added.
struct Growth<'a, G> {
    graph: &'a G,
    /// Every node has the cell of the seed that is nearest for a label.
    paths: ShortestPaths<u32>,
    /// Nodes in the order in which they were first reached.
    reached: Vec<usize>,
    /// Seeds in the order of their cells.
    seeds: Vec<usize>,
}

impl<'a, G: Graph> Growth<'a, G> {
    fn new(graph: &'a G) -> Self {
        let paths = ShortestPaths::new(graph.len(), NO_CELL);
        Self { graph, paths, reached: Vec::new(), seeds: Vec::new() }
    }

    /// Adds a seed; every node that comes closer changes to its cell.
    fn seed(&mut self, node: usize, cell: u32) {
        if self.paths.label(node).is_none() {
            self.reached.push(node);
        }
        self.paths.start(node, cell);
        while let Some(node) = self.paths.settle() {
            let (paths, reached) = (&mut self.paths, &mut self.reached);
            self.graph.each_neighbour(node.index, |other, step| {
                let is_new = paths.label(other).is_none();
                if paths.reach(other, node.distance + step, cell) && is_new {
                    reached.push(other);
                }
            });
        }
    }

    /// The distance of a node from the nearest seed.
    fn distance(&self, node: usize) -> f64 {
        self.paths.distance(node).unwrap_or(f64::INFINITY)
    }

    /// Cuts the connected component of `start`, which has no cells yet, into cells numbered from `first` on:
    /// `wanted(nodes)` of them, at least one and at most as many as there are nodes. Returns the next number.
    fn component(&mut self, start: usize, first: u32, wanted: impl Fn(&[usize]) -> usize) -> u32 {
        // A first sweep finds the component and its node farthest from where it was entered: a tip.
        self.seed(start, first);
        let mut nodes = std::mem::take(&mut self.reached);
        nodes.sort_unstable();
        let by_distance = |a: &usize, b: &usize| self.distance(*a).total_cmp(&self.distance(*b)).then(b.cmp(a));
        let tip = nodes.iter().copied().max_by(by_distance).unwrap_or(start);
        nodes.iter().for_each(|node| self.paths.forget(*node));
        self.seed(tip, first);
        self.seeds.push(tip);
        self.reached.clear();
        let others = nodes.iter().filter(|i| **i != tip);
        let mut far: BinaryHeap<Far> = others.map(|i| Far(self.distance(*i), *i as u32)).collect();
        let mut next = first + 1;
        let end = first + wanted(&nodes).clamp(1, nodes.len()) as u32;
        while next < end
            && let Some(mut farthest) = far.peek_mut()
        {
            let node = farthest.1 as usize;
            let distance = self.distance(node);
            if distance < farthest.0 {
                // Distances only shrink: each entry comes up at most once per seed that changed it.
                farthest.0 = distance;
                continue;
            }
            PeekMut::pop(farthest);
            self.seed(node, next);
            self.seeds.push(node);
            next += 1;
        }
        next
    }

    /// Cuts all components without cells.
    fn all(&mut self, wanted: impl Fn(&[usize]) -> usize) -> usize {
        let mut count = 0;
        for start in 0..self.graph.len() {
            if self.paths.label(start).is_none() {
                count = self.component(start, count, &wanted);
            }
        }
        count as usize
    }
}

/// Cells of `graph`: in every connected component `wanted(nodes)` of them (the nodes ascend), at least one and at most
/// as many as there are nodes. Cells are numbered component by component.
pub(super) fn farthest_first<G: Graph>(graph: &G, wanted: impl Fn(&[usize]) -> usize) -> Cells {
    let mut growth = Growth::new(graph);
    let count = growth.all(wanted);
    Cells { labels: labels(&growth.paths, graph.len()), len: count }
}

/// The seeds of [`farthest_first`], in the order of their cells.
pub(super) fn seeds<G: Graph>(graph: &G, wanted: impl Fn(&[usize]) -> usize) -> Vec<usize> {
    let mut growth = Growth::new(graph);
    growth.all(wanted);
    growth.seeds
}

/// The cells of these seeds, one or more in each component: every node belongs to the nearest one.
pub(super) fn nearest<G: Graph>(graph: &G, seeds: &[usize]) -> Cells {
    let mut paths = ShortestPaths::new(graph.len(), NO_CELL);
    for (seed, cell) in seeds.iter().zip(0..) {
        paths.start(*seed, cell);
    }
    while let Some(node) = paths.settle() {
        graph.each_neighbour(node.index, |other, step| {
            paths.reach(other, node.distance + step, node.label);
        });
    }
    Cells { labels: labels(&paths, graph.len()), len: seeds.len() }
}

/// Per node its cell.
fn labels(paths: &ShortestPaths<u32>, nodes: usize) -> Vec<u32> {
    (0..nodes).map(|node| paths.label(node).unwrap_or(NO_CELL)).collect()
}

/// A node by its distance; the greatest is the farthest one, ties go to the least node.
#[derive(PartialEq)]
struct Far(f64, u32);

impl Eq for Far {}

impl PartialOrd for Far {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Far {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0).then(other.1.cmp(&self.1))
    }
}

/// A graph without the links between different cells.
struct Within<'a, G> {
    graph: &'a G,
    of: &'a [u32],
}

impl<G: Graph> Graph for Within<'_, G> {
    fn len(&self) -> usize {
        self.graph.len()
    }

    fn each_neighbour(&self, node: usize, mut visit: impl FnMut(usize, f64)) {
        self.graph.each_neighbour(node, |other, step| {
            if self.of[other] == self.of[node] {
                visit(other, step);
            }
        });
    }
}

/// Bisects cells until `fine` tells that all are, which it must for single nodes: then it ends, as every round makes
/// the others smaller.
///
/// # Errors
/// That of `fine`.
pub(super) fn bisect_until<G: Graph>(
    graph: &G,
    mut cells: Cells,
    mut fine: impl FnMut(&Cells) -> Result<Vec<bool>, Interrupted>,
) -> Result<Cells, Interrupted> {
    loop {
        let fine = fine(&cells)?;
        let coarse: Vec<usize> = (0..cells.labels.len()).filter(|i| !fine[cells.labels[*i] as usize]).collect();
        if coarse.is_empty() {
            return Ok(cells);
        }
        let within = Within { graph, of: &cells.labels };
        let mut growth = Growth::new(&within);
        let mut count = cells.len as u32;
        for node in coarse {
            if growth.paths.label(node).is_none() {
                count = growth.component(node, count, |_| 2);
            }
        }
        let halved = cells.labels.iter().enumerate().map(|(node, cell)| growth.paths.label(node).unwrap_or(*cell));
        cells = Cells::renumbered(halved.collect());
    }
}

impl Cells {
    /// The cells of these labels, numbered in the order of their first nodes.
    pub(super) fn renumbered(mut labels: Vec<u32>) -> Self {
        let highest = labels.iter().max().map_or(0, |m| *m as usize + 1);
        let mut number = vec![NO_CELL; highest];
        let mut count = 0;
        for cell in &mut labels {
            let new = &mut number[*cell as usize];
            if *new == NO_CELL {
                *new = count;
                count += 1;
            }
            *cell = *new;
        }
        Self { labels, len: count as usize }
    }
}
