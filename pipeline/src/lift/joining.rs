//! The nodes of meshes of planes, joined along the curves between charts.

use super::surface::{CLOSE, ChartedSurface, OnEdge};
use super::{Error, Lifted, Placed, PlanarPart};
use std::collections::BTreeMap;

/// How far a node of the boundary may be off that of its chart, in the plane, where charts have a radius of about 1. Text of 15
/// digits is off by 1e-15; single precision by 1e-7.
const OFF: f64 = 1e-6;

/// What is known of the nodes on boundaries.
pub(super) struct Joined<'a> {
    surface: &'a ChartedSurface,
    /// Per edge of the surface on the boundary of a chart, and per corner there: how many of the charts there have meshes.
    beside: BTreeMap<[u32; 2], u32>,
    /// The nodes on each edge, ascending, and those at each corner.
    on_edges: BTreeMap<[u32; 2], Vec<Node>>,
}

/// A node on an edge.
#[derive(Clone, Copy)]
struct Node {
    t: f64,
    /// Its number in the mesh.
    number: u32,
    /// The last chart that has it.
    chart: usize,
    /// How many charts have it.
    charts: u32,
}

impl<'a> Joined<'a> {
    /// No nodes yet, of the charts that have meshes.
    pub fn new(surface: &'a ChartedSurface, has_part: &[bool]) -> Self {
        let mut beside = BTreeMap::new();
        for chart in (0..surface.charts()).filter(|chart| has_part[*chart]) {
            let mut ends: Vec<[u32; 2]> = surface.chart(chart).boundary_ends().collect();
            // And the corners between these, each once.
            ends.extend(ends.clone().into_iter().flatten().map(|corner| [corner; 2]));
            ends.sort_unstable();
            ends.dedup();
            ends.into_iter().for_each(|ends| *beside.entry(ends).or_default() += 1);
        }
        Self { surface, beside, on_edges: BTreeMap::new() }
    }

    /// Adds the nodes of a part to the mesh. Per node of the part, its number there.
    ///
    /// # Errors
    /// [`Error::OffBoundary`].
    pub fn add(&mut self, part: &PlanarPart, triangles: &[[u32; 3]], lifted: &mut Lifted) -> Result<Vec<u32>, Error> {
        let chart = self.surface.chart(part.chart);
        let is_open = on_open_edges(part.uv.len(), triangles);
        let mut numbers = vec![u32::MAX; part.uv.len()];
        let mut off: Option<(usize, [f64; 2], f64)> = None;
        for (node, uv) in part.uv.iter().enumerate().filter(|(node, _)| is_open[*node]) {
            let Some(found) = chart.map.to_boundary(*uv) else { continue };
            if found.distance > OFF {
                let (nodes, uv, distance) = off.unwrap_or((0, *uv, found.distance));
                off = Some((nodes + 1, uv, distance));
                continue;
            }
            numbers[node] = self.number(part.chart, chart.on_edge(&found), || chart.of_boundary(&found), lifted);
        }
        if let Some((nodes, uv, distance)) = off {
            return Err(Error::OffBoundary { chart: part.chart, nodes, uv, distance });
        }
        self.add_inner(part, &mut numbers, lifted);
        Ok(numbers)
    }

    /// Adds the nodes that have no number yet.
    fn add_inner(&self, part: &PlanarPart, numbers: &mut [u32], lifted: &mut Lifted) {
        let chart = self.surface.chart(part.chart);
        for (node, uv) in part.uv.iter().enumerate() {
            if numbers[node] == u32::MAX
                && let Some(located) = chart.map.to_space(*uv)
            {
                numbers[node] = lifted.points.len() as u32;
                lifted.push(chart.placed(&located));
            }
        }
    }

    /// The number of the node at a place on an edge: the one that another chart has there, or a new one.
    fn number(&mut self, chart: usize, at: OnEdge, placed: impl FnOnce() -> Placed, lifted: &mut Lifted) -> u32 {
        let nodes = self.on_edges.entry(at.ends).or_default();
        let after = nodes.partition_point(|node| node.t < at.t);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten();
        // The same chart has a node once.
        let near = near.filter(|i| nodes.get(*i).is_some_and(|n| (n.t - at.t).abs() <= CLOSE && n.chart != chart));
        let nearest = near.min_by(|a, b| (nodes[*a].t - at.t).abs().total_cmp(&(nodes[*b].t - at.t).abs()));
        if let Some(node) = nearest.map(|i| &mut nodes[i]) {
            (node.chart, node.charts) = (chart, node.charts + 1);
            return node.number;
        }
        let number = lifted.points.len() as u32;
        nodes.insert(after, Node { t: at.t, number, chart, charts: 1 });
        lifted.push(placed());
        number
    }

    /// The mesh, whose parts fit together.
    ///
    /// # Errors
    /// [`Error::NotConforming`].
    pub fn finish(self, lifted: Lifted) -> Result<Lifted, Error> {
        let mut alone: Option<(usize, u32)> = None;
        let mut count = 0;
        for (ends, nodes) in &self.on_edges {
            let charts = self.beside.get(ends).copied().unwrap_or(0);
            // A chart that passes a corner twice has two nodes there.
            let at_corner = ends[0] == ends[1] && nodes.iter().map(|node| node.charts).sum::<u32>() >= charts;
            for node in nodes.iter().filter(|node| node.charts < charts && !at_corner) {
                count += 1;
                alone = Some(alone.filter(|(chart, _)| *chart <= node.chart).unwrap_or((node.chart, node.number)));
            }
        }
        match alone {
            Some((chart, node)) => Err(Error::NotConforming { chart, nodes: count, at: lifted.points[node as usize] }),
            None => Ok(lifted),
        }
    }
}

/// Per node, whether it is on an edge that only one triangle has.
pub(super) fn on_open_edges(nodes: usize, triangles: &[[u32; 3]]) -> Vec<bool> {
    let sides = triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3]]));
    let mut edges: Vec<[u32; 2]> = sides.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    edges.sort_unstable();
    let mut is_open = vec![false; nodes];
    for same in edges.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
        same[0].iter().for_each(|n| is_open[*n as usize] = true);
    }
    is_open
}
