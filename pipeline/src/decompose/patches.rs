//! Cells on a large graph: seeds are chosen among patches of nodes, then every node goes to its nearest seed.
//!
//! Choosing the farthest node again and again costs several sweeps over the graph, and a heap of all nodes. Where
//! there are many nodes to a cell, seeds need not be the very farthest: it is enough to choose among patches of a few
//! nodes, at distances that are those of paths from patch to patch. The cells themselves are found by one sweep from
//! all seeds, and are as exact as if seeds had been chosen among nodes.

use super::voronoi::{Cells, Graph, nearest, seeds};
use crate::monitor::{Checkpoint, Interrupted};
use crate::topology::csr::Csr;

/// Patches to a cell. By experience: more place seeds more evenly, fewer are searched faster.
const SAMPLES: usize = 16;

const NONE: u32 = u32::MAX;

/// Cells of `graph`, numbered component by component: in a component of so many nodes `wanted` of them, or as many as
/// it has nodes.
pub(super) fn compact_cells<G: Graph>(
    graph: &G,
    wanted: impl Fn(usize) -> usize,
    checkpoint: &Checkpoint,
) -> Result<Cells, Interrupted> {
    let patches = Patches::new(graph, |size| size / (SAMPLES * wanted(size)).max(1));
    checkpoint.after(graph.len())?;
    let seeds = seeds(&patches, |part| wanted(part.iter().map(|p| patches.size(*p)).sum()));
    let nodes: Vec<usize> = seeds.iter().map(|p| patches.nodes.row(*p)[0] as usize).collect();
    checkpoint.after(graph.len())?;
    Ok(nearest(graph, &nodes))
}

/// Connected patches of nodes, and the graph of them.
struct Patches {
    /// The nodes of each patch, from its middle outwards.
    nodes: Csr<u32>,
    /// The patches beside each one, with the lengths of paths between their first nodes.
    beside: Csr<(u32, f64)>,
}

impl Patches {
    /// Patches of about `size(nodes)` nodes in a component of so many nodes, at least 1.
    fn new<G: Graph>(graph: &G, size: impl Fn(usize) -> usize) -> Self {
        let mut made = Self { nodes: Csr::with_capacity(graph.len()), beside: Csr::default() };
        let mut seen = vec![false; graph.len()];
        let mut patch_of = vec![NONE; graph.len()];
        let mut distance = vec![0.0; graph.len()];
        for start in 0..graph.len() {
            if !seen[start] {
                let component = component(graph, start, &mut seen);
                let size = size(component.len()).max(1);
                for node in component {
                    made.gather(graph, node, size, &mut patch_of, &mut distance);
                }
            }
        }
        made.link(graph, &patch_of, &distance);
        made
    }

    /// Makes a patch around `first`, unless it is in one: breadth first, up to `size` nodes.
    fn gather<G: Graph>(&mut self, graph: &G, first: u32, size: usize, patch_of: &mut [u32], distance: &mut [f64]) {
        if patch_of[first as usize] != NONE {
            return;
        }
        let patch = self.nodes.len() as u32;
        patch_of[first as usize] = patch;
        self.nodes.push(first);
        let mut next = 0;
        while let Some(node) = self.nodes.open_row().get(next).map(|n| *n as usize) {
            let nodes = &mut self.nodes;
            graph.each_neighbour(node, |other, step| {
                if patch_of[other] == NONE && nodes.open_row().len() < size {
                    (patch_of[other], distance[other]) = (patch, distance[node] + step);
                    nodes.push(other as u32);
                }
            });
            next += 1;
        }
        self.nodes.close_row();
    }

    fn link<G: Graph>(&mut self, graph: &G, patch_of: &[u32], distance: &[f64]) {
        for patch in 0..self.len() {
            // A patch has few neighbours.
            let mut beside: Vec<(u32, f64)> = Vec::new();
            for node in self.nodes.row(patch).iter().map(|n| *n as usize) {
                graph.each_neighbour(node, |other, step| {
                    let (to, length) = (patch_of[other], distance[node] + step + distance[other]);
                    if to == patch as u32 {
                        return;
                    }
                    match beside.iter_mut().find(|b| b.0 == to) {
                        Some(known) => known.1 = known.1.min(length),
                        None => beside.push((to, length)),
                    }
                });
            }
            self.beside.push_row(beside);
        }
    }

    fn size(&self, patch: usize) -> usize {
        self.nodes.row(patch).len()
    }
}

impl Graph for Patches {
    fn len(&self) -> usize {
        self.nodes.len()
    }

    fn each_neighbour(&self, node: usize, mut visit: impl FnMut(usize, f64)) {
        self.beside.row(node).iter().for_each(|(to, length)| visit(*to as usize, *length));
    }
}

/// The nodes that can be reached from `start`, breadth first.
fn component<G: Graph>(graph: &G, start: usize, seen: &mut [bool]) -> Vec<u32> {
    let mut nodes = vec![start as u32];
    seen[start] = true;
    let mut next = 0;
    while next < nodes.len() {
        graph.each_neighbour(nodes[next] as usize, |other, _| {
            if !std::mem::replace(&mut seen[other], true) {
                nodes.push(other as u32);
            }
        });
        next += 1;
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decompose::dual::Dual;
    use crate::decompose::voronoi::farthest_first;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::repair::{Settings, repair};
    use crate::shapes;

    fn check(soup: &TriangleSoup, wanted: usize) {
        let mesh = repair(soup, &Settings::default()).expect("a surface is left").mesh;
        let dual = Dual::new(&mesh, &NoMonitor);
        for cells in [
            compact_cells(&dual, |_| wanted, &dual.checkpoint).expect("nobody cancels"),
            farthest_first(&dual, |_| wanted),
        ] {
            let mut seen = vec![false; dual.len()];
            let mut found = vec![false; cells.len];
            for start in 0..dual.len() {
                if !seen[start] {
                    let cell = cells.labels[start] as usize;
                    assert!(!std::mem::replace(&mut found[cell], true), "cell {cell} is connected");
                    let mut stack = vec![start];
                    while let Some(node) = stack.pop() {
                        seen[node] = true;
                        let own = |other: &usize| cells.labels[*other] == cells.labels[node];
                        dual.each_neighbour(node, |n, _| stack.extend(Some(n).filter(|n| own(n) && !seen[*n])));
                    }
                }
            }
            assert!(found.iter().all(|f| *f), "no cell is empty");
            assert_eq!(cells.len, mesh.topology_summary().components * wanted);
        }
    }

    #[test]
    fn cells_are_connected_and_cover() {
        for wanted in [1, 2, 5, 33] {
            check(&shapes::sphere(20), wanted);
            check(&shapes::disk_with_holes(33, 5), wanted);
            check(&shapes::ring_torus(30, 20), wanted);
            check(&shapes::sliver_strip(40), wanted);
        }
        check(&shapes::bow_tie(), 1);
    }

    #[test]
    fn cells_of_one_size_on_an_even_plate() {
        let mesh = repair(&shapes::flat_disk(60), &Settings::default()).expect("a surface is left").mesh;
        let dual = Dual::new(&mesh, &NoMonitor);
        let cells = compact_cells(&dual, |_| 50, &dual.checkpoint).expect("nobody cancels");
        let mut sizes = vec![0; cells.len];
        cells.labels.iter().for_each(|c| sizes[*c as usize] += 1);
        let mean = mesh.triangles().len() / 50;
        assert!(sizes.iter().all(|s| (mean / 4..3 * mean).contains(s)), "{mean}: {sizes:?}");
    }
}
