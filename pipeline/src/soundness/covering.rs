//! Does the mesh of a chart cover it once? In the map that the mesher used.
//!
//! Every triangle must be positive in the plane, and the boundary of the mesh simple and rightly nested there: then the
//! mesh covers what the boundary encloses, once (see [`crate::certify::polygons`]). Decided exactly, on places rounded to
//! the grid.
//!
//! Nodes on curves are placed on the chart's boundary in the plane, by where they lie on the curve; all others where the
//! closest point of the chart is. A flat chart is its own map, whatever the other one does: Gmsh takes the plane of such
//! charts instead of the map that it is given.

use super::curves::{Boundaries, OnCurve};
use super::open::sides_of_one;
use super::reference::{HandedOverAtlas, HandedOverChart, Mesh};
use super::{Defect, SurfaceDistance};
use crate::certify::polygons::{self, Wrong};
use crate::evaluate::{Plane, along_curve};
use crate::grid::{GridPoint, orientation};
use crate::topology::loops::closed_loops;
use crate::topology::{ChartId, VertexId};
use crate::vec3::{Vec3, bits_of, unit_scale};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Where the nodes of a mesh lie in the plane of the chart at hand, on the grid. One table serves all charts.
#[derive(Debug)]
pub struct InPlane {
    /// Per node, the last chart that has it.
    chart: Vec<Option<ChartId>>,
    grid: Vec<GridPoint>,
}

impl InPlane {
    /// Nothing known of so many nodes.
    pub fn new(nodes: usize) -> Self {
        Self { chart: vec![None; nodes], grid: vec![GridPoint::default(); nodes] }
    }

    /// The nodes of triangles of a chart, each of them once. What follows each other is near each other: what is looked at
    /// for one is at hand for the next.
    fn nodes(&mut self, mesh: &Mesh, triangles: &[u32], id: ChartId) -> Vec<VertexId> {
        let all = triangles.iter().flat_map(|t| mesh.triangulation.triangles[*t as usize]);
        let nodes: Vec<VertexId> = all.filter(|v| self.chart[v.index()].replace(id) != Some(id)).collect();
        let places: Vec<Vec3> = nodes.iter().map(|v| mesh.triangulation.points[v.index()]).collect();
        along_curve(&places).map(|i| nodes[i as usize]).collect()
    }

    /// Places nodes on the grid.
    fn place(&mut self, nodes: &[VertexId], uv: &[[f64; 2]]) {
        let largest = uv.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
        let scale = unit_scale(largest);
        for (v, uv) in nodes.iter().zip(uv) {
            self.grid[v.index()] = GridPoint::mid(uv.map(|c| c * scale));
        }
    }

    fn at(&self, v: VertexId) -> GridPoint {
        self.grid[v.index()]
    }
}

/// Looks at one chart with the given triangles of the mesh. `distance` learns how far its nodes are from it.
pub fn check(
    mesh: &Mesh,
    triangles: &[u32],
    atlas: &HandedOverAtlas,
    id: ChartId,
    boundaries: &Boundaries,
    in_plane: &mut InPlane,
    distance: &mut SurfaceDistance,
) -> Vec<Defect> {
    let chart = &atlas.charts[id.index()];
    let nodes = in_plane.nodes(mesh, triangles, id);
    let positions = &boundaries.positions[id.index()];
    let uv: Vec<[f64; 2]> = match Plane::of(chart.map.points(), chart.map.triangles()) {
        Some(plane) => in_flat_chart(mesh, &nodes, chart, &plane, distance),
        None => in_chart(mesh, &nodes, chart, |v, rim| rim.place(positions.get(&v)?, &atlas.curves), distance),
    };
    in_plane.place(&nodes, &uv);
    let turn = |t: &u32| {
        let [a, b, c] = mesh.triangulation.triangles[*t as usize].map(|v| in_plane.at(v));
        orientation(a, b, c)
    };
    let is_inside_out = !triangles.is_empty() && triangles.iter().all(|t| turn(t) < 0);
    let folded: Vec<u32> = triangles.iter().filter(|t| turn(t) <= 0).copied().collect();
    let mut defects = Vec::new();
    if let Some(first) = folded.first() {
        let (triangles, at) = (folded.len(), super::centroid(mesh.triangulation.corners(*first as usize)));
        defects.push(if is_inside_out {
            Defect::InsideOut { chart: id, triangles, at }
        } else {
            Defect::Folded { chart: id, triangles, at }
        });
    }
    let mut open = Cow::Borrowed(&boundaries.open[id.index()][..]);
    if is_inside_out {
        // The loops of a mesh that is turned run the other way round, and may be right otherwise.
        open.to_mut().iter_mut().for_each(|edge| edge.reverse());
    }
    defects.extend(boundary_defect(mesh, id, &open, in_plane));
    defects
}

/// Where nodes lie in the plane of a flat chart.
fn in_flat_chart(
    mesh: &Mesh,
    nodes: &[VertexId],
    chart: &HandedOverChart,
    plane: &Plane,
    distance: &mut SurfaceDistance,
) -> Vec<[f64; 2]> {
    let place = |v: &VertexId| {
        let x = mesh.triangulation.points[v.index()];
        distance.note(*v, chart.map.to_plane(x).map_or(f64::INFINITY, |l| l.distance));
        plane.coords(x)
    };
    nodes.iter().map(place).collect()
}

/// Where nodes lie in the map of a chart; `on_rim` places those on curves.
fn in_chart(
    mesh: &Mesh,
    nodes: &[VertexId],
    chart: &HandedOverChart,
    on_rim: impl Fn(VertexId, &Rim) -> Option<[f64; 2]>,
    distance: &mut SurfaceDistance,
) -> Vec<[f64; 2]> {
    let rim = Rim::of(chart);
    let place = |v: &VertexId| {
        let located = chart.map.to_plane(mesh.triangulation.points[v.index()]);
        distance.note(*v, located.map_or(f64::INFINITY, |l| l.distance));
        on_rim(*v, &rim).or(located.map(|l| chart.map.uv_of(&l))).unwrap_or([f64::NAN; 2])
    };
    nodes.iter().map(place).collect()
}

/// What is wrong with the loops of a boundary in the plane.
fn boundary_defect(mesh: &Mesh, chart: ChartId, open: &[[VertexId; 2]], in_plane: &InPlane) -> Option<Defect> {
    let at = |v: VertexId| mesh.triangulation.points[v.index()];
    let loops = match chained(open) {
        Ok(loops) => loops,
        Err(v) => return Some(Defect::BoundaryPinched { chart, at: at(v) }),
    };
    let polygons: Vec<Vec<GridPoint>> = loops.iter().map(|l| l.iter().map(|v| in_plane.at(*v)).collect()).collect();
    let place = |l: usize, i: usize| loops.get(l).and_then(|l| l.get(i)).map_or([f64::NAN; 3], |v| at(*v));
    polygons::check(&polygons).map(|wrong| match wrong {
        Wrong::Crossing([(l, i), _]) | Wrong::Undecided([(l, i), _]) => {
            Defect::BoundaryCrosses { chart, at: place(l, i) }
        }
        Wrong::Outer(l) | Wrong::Nesting(l) => Defect::BoundaryNested { chart, at: place(l, 0) },
    })
}

/// Directed edges as closed loops.
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
    closed_loops(open.iter().map(|[start, _]| *start), |from| {
        let to = next.remove(&from)?;
        Some((from, to))
    })
}

/// The boundary of a chart in the plane, by its places in space.
#[derive(Default)]
struct Rim {
    uv: BTreeMap<[u64; 3], [f64; 2]>,
}

impl Rim {
    fn of(chart: &HandedOverChart) -> Self {
        let map = &chart.map;
        let mut rim = Self::default();
        let place = |n: u32| (bits_of(map.points()[n as usize]), map.uv()[n as usize]);
        let triangles = || map.triangles().iter().map(|t| (0, *t));
        let open = sides_of_one(map.points().len(), 1, triangles).into_iter().flatten();
        // Of different nodes in one place, the last one counts.
        rim.uv.extend(open.flat_map(|[a, b]| [a.min(b), a.max(b)]).map(place));
        rim
    }

    /// Where a node on a curve lies in the plane.
    fn place(&self, on: &OnCurve, curves: &[Vec<Vec3>]) -> Option<[f64; 2]> {
        let curve = &curves[on.curve as usize];
        let end = |e: usize| self.uv.get(&bits_of(*curve.get(on.side as usize + e)?)).copied();
        let (from, to) = (end(0)?, end(1)?);
        Some([0, 1].map(|k| (1.0 - on.share) * from[k] + on.share * to[k]))
    }
}
