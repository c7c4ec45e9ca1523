//! Farthest-first cells of a graph: each node belongs to the nearest seed, seeds are as far apart as they can be.
//!
//! Seeds are chosen one after the other, each at the node farthest from those before (Gonzalez 1985, doi
//! 10.1016/0304-3975(85)90224-5; at most twice the best possible radius). Distances are geodesic along the graph, so
//! that cells follow the shape, not the triangulation. A new seed only visits what comes closer to it: with k seeds
//! on n evenly spread nodes about n log k visits.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

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
    pub of: Vec<u32>,
    pub count: usize,
}

/// A node at a distance; the greatest is the nearest one (for heaps), ties go to the least node.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct At {
    pub distance: f64,
    pub node: u32,
}

impl Eq for At {}

impl PartialOrd for At {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for At {
    fn cmp(&self, other: &Self) -> Ordering {
        other.distance.total_cmp(&self.distance).then(other.node.cmp(&self.node))
    }
}

/// The cells while seeds are added.
struct Growth<'a, G> {
    graph: &'a G,
    distance: Vec<f64>,
    of: Vec<u32>,
    heap: BinaryHeap<At>,
    /// Nodes in the order in which they were first reached.
    reached: Vec<usize>,
}

impl<G: Graph> Growth<'_, G> {
    /// Adds a seed; every node that comes closer changes to its cell. Ends because a node is visited only with a
    /// distance below its last one.
    fn seed(&mut self, node: usize, cell: u32) {
        if self.of[node] == u32::MAX {
            self.reached.push(node);
        }
        self.distance[node] = 0.0;
        self.of[node] = cell;
        self.heap.push(At { distance: 0.0, node: node as u32 });
        while let Some(At { distance, node }) = self.heap.pop() {
            if distance > self.distance[node as usize] || self.of[node as usize] != cell {
                continue;
            }
            let (distances, of, heap, reached) =
                (&mut self.distance, &mut self.of, &mut self.heap, &mut self.reached);
            self.graph.each_neighbour(node as usize, |other, step| {
                if distance + step < distances[other] {
                    if of[other] == u32::MAX {
                        reached.push(other);
                    }
                    distances[other] = distance + step;
                    of[other] = cell;
                    heap.push(At { distance: distance + step, node: other as u32 });
                }
            });
        }
    }
}

/// Cells of `graph`: in every connected component `seeds(node, size)` of them (`node` is one of its nodes), at least
/// one and at most `size`. Cells are numbered component by component.
pub(super) fn farthest_first<G: Graph>(graph: &G, seeds: impl Fn(usize, usize) -> usize) -> Cells {
    let n = graph.len();
    let mut growth =
        Growth { graph, distance: vec![f64::INFINITY; n], of: vec![u32::MAX; n], heap: BinaryHeap::new(), reached: Vec::new() };
    let mut count = 0;
    for start in 0..n {
        if growth.of[start] != u32::MAX {
            continue;
        }
        // A first sweep finds the component and its node farthest from where it was entered: a tip.
        growth.seed(start, count);
        let mut nodes = std::mem::take(&mut growth.reached);
        nodes.sort_unstable();
        let farthest = |d: &[f64]| nodes.iter().copied().max_by(|a, b| d[*a].total_cmp(&d[*b]).then(b.cmp(a)));
        let tip = farthest(&growth.distance).unwrap_or(start);
        nodes.iter().for_each(|i| growth.distance[*i] = f64::INFINITY);
        growth.seed(tip, count);
        count += 1;
        let mut far: BinaryHeap<Far> = nodes.iter().map(|i| Far(growth.distance[*i], *i as u32)).collect();
        let wanted = seeds(start, nodes.len()).clamp(1, nodes.len());
        let mut is_seed = std::collections::BTreeSet::from([tip]);
        let mut made = 1;
        while made < wanted
            && let Some(Far(distance, node)) = far.pop()
        {
            let now = growth.distance[node as usize];
            if now < distance {
                // Distances only shrink: each entry returns at most once per seed that changed it.
                far.push(Far(now, node));
            } else if is_seed.insert(node as usize) {
                growth.seed(node as usize, count);
                count += 1;
                made += 1;
            }
        }
    }
    Cells { of: growth.of, count: count as usize }
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
pub(super) fn bisect_until<G: Graph>(graph: &G, mut cells: Cells, mut fine: impl FnMut(&Cells) -> Vec<bool>) -> Cells {
    loop {
        let fine = fine(&cells);
        if fine.iter().all(|f| *f) {
            return cells;
        }
        let within = Within { graph, of: &cells.of };
        let halves = |node: usize, _: usize| if fine[cells.of[node] as usize] { 1 } else { 2 };
        cells = farthest_first(&within, halves);
    }
}
