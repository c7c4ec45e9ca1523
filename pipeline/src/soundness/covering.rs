//! Does the mesh of a chart cover it once? In the map that the mesher used.
//!
//! Every triangle must be positive in the plane, and the boundary of the mesh simple and rightly nested there: then the
//! mesh covers what the boundary encloses, once (see [`super::loops`]). Decided exactly, on places rounded to the grid.
//!
//! Nodes on curves are placed on the chart's boundary in the plane, by where they lie on the curve; all others where the
//! closest point of the chart is. A flat chart is its own map, whatever the other one does: Gmsh takes the plane of such
//! charts instead of the map that it is given.

use super::curves::{Boundaries, OnCurve};
use super::loops::{self, Wrong};
use super::reference::{HandedOverAtlas, HandedOverChart, Mesh};
use super::{Defect, SurfaceDistance};
use crate::evaluate::Plane;
use crate::grid::{GridPoint, orientation};
use crate::id::{ChartId, VertexId};
use crate::space::{Vec3, bits_of, unit_scale};
use std::collections::BTreeMap;

/// Looks at one chart with the given triangles of the mesh. `distance` learns how far its nodes are from it.
pub fn check(
    mesh: &Mesh,
    triangles: &[u32],
    atlas: &HandedOverAtlas,
    id: ChartId,
    boundaries: &Boundaries,
    distance: &mut SurfaceDistance,
) -> Vec<Defect> {
    let chart = &atlas.charts[id.index()];
    let places = &boundaries.places[id.index()];
    let plane = Plane::of(chart.map.points(), chart.map.triangles());
    let rim = if plane.is_some() { Rim::default() } else { Rim::of(chart) };
    let mut uv: BTreeMap<VertexId, [f64; 2]> = BTreeMap::new();
    for v in triangles.iter().flat_map(|t| mesh.triangulation.triangles[*t as usize]) {
        let x = mesh.triangulation.points[v.index()];
        uv.entry(v).or_insert_with(|| {
            let located = chart.map.to_plane(x);
            distance.note(v, located.map_or(f64::INFINITY, |l| l.distance));
            let on_rim = || rim.place(places.get(&v)?, &atlas.curves);
            match &plane {
                Some(plane) => plane.place(x),
                None => on_rim().or(located.map(|l| chart.map.uv_of(&l))).unwrap_or([f64::NAN; 2]),
            }
        });
    }
    let largest = uv.values().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    let scale = unit_scale(largest);
    let grid: BTreeMap<VertexId, GridPoint> =
        uv.into_iter().map(|(v, uv)| (v, GridPoint::mid(uv.map(|c| c * scale)))).collect();
    let turn = |t: &&u32| {
        let [a, b, c] = mesh.triangulation.triangles[**t as usize].map(|v| grid[&v]);
        orientation(a, b, c) <= 0
    };
    let folded: Vec<u32> = triangles.iter().filter(turn).copied().collect();
    let centre = |t: u32| super::centroid(mesh.triangulation.corners(t as usize));
    let mut defects = Vec::new();
    if let Some(first) = folded.first() {
        defects.push(Defect::Folded { chart: id, triangles: folded.len(), at: centre(*first) });
    }
    defects.extend(boundary_defect(mesh, id, &boundaries.open[id.index()], &grid));
    defects
}

/// What is wrong with the loops of a boundary in the plane.
fn boundary_defect(
    mesh: &Mesh,
    chart: ChartId,
    open: &[[VertexId; 2]],
    grid: &BTreeMap<VertexId, GridPoint>,
) -> Option<Defect> {
    let at = |v: VertexId| mesh.triangulation.points[v.index()];
    let loops = match chained(open) {
        Ok(loops) => loops,
        Err(v) => return Some(Defect::BoundaryPinched { chart, at: at(v) }),
    };
    let polygons: Vec<Vec<GridPoint>> = loops.iter().map(|l| l.iter().map(|v| grid[v]).collect()).collect();
    let place = |l: usize, i: usize| loops.get(l).and_then(|l| l.get(i)).map_or([f64::NAN; 3], |v| at(*v));
    loops::check(&polygons).map(|wrong| match wrong {
        Wrong::Crossing([(l, i), _]) => Defect::BoundaryCrosses { chart, at: place(l, i) },
        Wrong::Outer(l) | Wrong::Nesting(l) => Defect::BoundaryNested { chart, at: place(l, 0) },
    })
}

/// Directed edges as closed loops. Each edge is taken once, so the walk ends.
///
/// # Errors
/// A node that other than one edge leaves, or that none enters.
fn chained(open: &[[VertexId; 2]]) -> Result<Vec<Vec<VertexId>>, VertexId> {
    let mut next: BTreeMap<VertexId, VertexId> = BTreeMap::new();
    for [from, to] in open {
        if next.insert(*from, *to).is_some() {
            return Err(*from);
        }
    }
    let mut loops = Vec::new();
    for [start, _] in open {
        let mut turn = Vec::new();
        let mut at = *start;
        while let Some(to) = next.remove(&at) {
            turn.push(at);
            at = to;
        }
        if !turn.is_empty() {
            if at != *start {
                return Err(at);
            }
            loops.push(turn);
        }
    }
    Ok(loops)
}

/// The boundary of a chart in the plane, by its places in space.
#[derive(Default)]
struct Rim {
    uv: BTreeMap<[u64; 3], [f64; 2]>,
}

impl Rim {
    fn of(chart: &HandedOverChart) -> Self {
        let (map, mut count) = (&chart.map, BTreeMap::new());
        let sides = |t: &[u32; 3]| [0, 1, 2].map(|k| (t[k].min(t[(k + 1) % 3]), t[k].max(t[(k + 1) % 3])));
        let mut all: Vec<(u32, u32)> = map.triangles().iter().flat_map(sides).collect();
        all.sort_unstable();
        for open in all.chunk_by(|a, b| a == b).filter(|same| same.len() == 1) {
            for node in [open[0].0, open[0].1].map(|n| n as usize) {
                count.insert(bits_of(map.points()[node]), map.uv()[node]);
            }
        }
        Self { uv: count }
    }

    /// Where a node on a curve lies in the plane.
    fn place(&self, on: &OnCurve, curves: &[Vec<Vec3>]) -> Option<[f64; 2]> {
        let curve = &curves[on.curve as usize];
        let end = |e: usize| self.uv.get(&bits_of(*curve.get(on.side as usize + e)?)).copied();
        let (from, to) = (end(0)?, end(1)?);
        Some([0, 1].map(|k| (1.0 - on.share) * from[k] + on.share * to[k]))
    }
}
