//! Do the open edges of the mesh of a chart lie along the chart's curves, in order, and are the curves whole?
//!
//! The nodes of a curve are those of the boundary that lie on it, sorted by where they do. Every two that follow each other
//! must be joined by an edge of each chart beside the curve, begin and end of the curve must be nodes, and there may be no
//! other open edge. Charts that share a curve then share its nodes, one by one.

use super::Defect;
use super::open::sides_of_one;
use super::reference::{HandedOverAtlas, HandedOverChart, Mesh};
use crate::evaluate::{Bvh, OnSegment, on_segment};
use crate::topology::{ChartId, CurveId, VertexId};
use crate::vec3::{BoundingBox, Vec3, distance};
use std::collections::{BTreeMap, BTreeSet};

/// Where a node lies on a curve: the side of the polyline, and the share of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnCurve {
    /// The curve.
    pub curve: u32,
    /// The side of the polyline, from 0.
    pub side: u32,
    /// The share of that side, in [0, 1].
    pub share: f64,
}

impl OnCurve {
    fn parameter(&self) -> f64 {
        f64::from(self.side) + self.share
    }
}

/// An edge between two nodes, the lesser one first.
type Edge = [VertexId; 2];

/// The boundary of every chart's mesh, and where its nodes lie.
#[derive(Debug, Default)]
pub struct Boundaries {
    /// Per chart, the open edges of its mesh, in the direction of its triangles.
    pub open: Vec<Vec<[VertexId; 2]>>,
    /// Per chart, where the nodes of these edges lie on its curves.
    pub positions: Vec<BTreeMap<VertexId, OnCurve>>,
    /// What is wrong.
    pub defects: Vec<Defect>,
}

/// Looks at the boundaries of all charts. `triangles` are those of the mesh in each chart; nodes lie on a curve that is
/// nearer than `tolerance`.
pub fn boundaries(mesh: &Mesh, triangles: &[Vec<u32>], atlas: &HandedOverAtlas, tolerance: f64) -> Boundaries {
    let open = open_edges(mesh, triangles);
    let known = known_places(mesh, &open, &CurveSides::new(&atlas.curves), tolerance);
    let along = nodes_along(atlas, &open, &known);
    let mut found = Boundaries { open, ..Boundaries::default() };
    for (chart, open) in atlas.charts.iter().zip(&found.open) {
        found.positions.push(places_around(chart, open, &known));
    }
    let mut expected = Vec::with_capacity(atlas.curves.len());
    for ((k, curve), nodes) in (0..).zip(&atlas.curves).zip(&along) {
        expected.push(expected_on(mesh, k, curve, nodes, tolerance));
    }
    // Ends of curves first, each once, whatever the number of charts beside it.
    found.defects.extend(expected.iter().filter_map(|e| e.missing_end.clone()));
    for (c, chart) in atlas.charts.iter().enumerate() {
        let per_curve = chart.curves.iter().map(|k| (*k, &expected[*k as usize].edges[..]));
        found.defects.extend(compare(mesh, ChartId::at(c), &found.open[c], per_curve.collect()));
    }
    found
}

/// Per node of an open edge, its place on every curve that is near enough.
fn known_places(
    mesh: &Mesh,
    open: &[Vec<[VertexId; 2]>],
    curves: &CurveSides,
    tolerance: f64,
) -> BTreeMap<VertexId, Vec<OnCurve>> {
    let mut known = BTreeMap::new();
    for v in open.iter().flatten().flatten() {
        known.entry(*v).or_insert_with(|| curves.at(mesh.triangulation.points[v.index()], tolerance));
    }
    known
}

/// Where the nodes of a chart's open edges lie on its own curves. In a point where curves meet, the first one counts.
fn places_around(
    chart: &HandedOverChart,
    open: &[[VertexId; 2]],
    known: &BTreeMap<VertexId, Vec<OnCurve>>,
) -> BTreeMap<VertexId, OnCurve> {
    let mut positions = BTreeMap::new();
    for v in open.iter().flatten() {
        let mut on_own = known[v].iter().filter(|on| chart.curves.contains(&on.curve));
        if let Some(on) = on_own.next() {
            positions.insert(*v, *on);
        }
    }
    positions
}

/// Per chart, the sides of triangles that no other triangle of the chart has, as the triangles run.
fn open_edges(mesh: &Mesh, charts: &[Vec<u32>]) -> Vec<Vec<[VertexId; 2]>> {
    let corners = |t: &u32| mesh.triangulation.triangles[*t as usize].map(|v| v.0);
    let all = || (0..).zip(charts).flat_map(|(c, chart)| chart.iter().map(move |t| (c, corners(t))));
    let open = sides_of_one(mesh.triangulation.points.len(), charts.len(), all);
    open.into_iter().map(|sides| sides.into_iter().map(|side| side.map(VertexId)).collect()).collect()
}

fn ordered([a, b]: [VertexId; 2]) -> Edge {
    [a.min(b), a.max(b)]
}

/// Per curve, the nodes of open edges of charts beside it that lie on it.
fn nodes_along(
    atlas: &HandedOverAtlas,
    open: &[Vec<[VertexId; 2]>],
    known: &BTreeMap<VertexId, Vec<OnCurve>>,
) -> Vec<Vec<(OnCurve, VertexId)>> {
    let mut along: Vec<Vec<(OnCurve, VertexId)>> = vec![Vec::new(); atlas.curves.len()];
    for (chart, edges) in atlas.charts.iter().zip(open) {
        for v in edges.iter().flatten() {
            for on in known[v].iter().filter(|on| chart.curves.contains(&on.curve)) {
                along[on.curve as usize].push((*on, *v));
            }
        }
    }
    for nodes in &mut along {
        nodes.sort_by(|a, b| a.0.parameter().total_cmp(&b.0.parameter()).then(a.1.cmp(&b.1)));
        nodes.dedup_by_key(|n| n.1);
    }
    along
}

/// The edges that a mesh of a curve with these nodes must have.
struct Expected {
    edges: Vec<Edge>,
    missing_end: Option<Defect>,
}

/// The edges along curve `k`, of which these are the `nodes` in their order; and which of its ends is no node.
fn expected_on(mesh: &Mesh, k: u32, curve: &[Vec3], nodes: &[(OnCurve, VertexId)], tolerance: f64) -> Expected {
    let points = &mesh.triangulation.points;
    let is_closed = curve.first() == curve.last();
    let ends = [(curve.first(), nodes.first()), (curve.last(), nodes.last())];
    // Whether the first node lies at the begin, and the last one at the end.
    let are_nodes = ends.map(|(end, node)| {
        let both = end.zip(node);
        both.is_some_and(|(end, (_, v))| distance(*end, points[v.index()]) <= tolerance)
    });
    // A node at the begin of a closed curve may have been found at its end.
    let complete = if is_closed { are_nodes.contains(&true) } else { !are_nodes.contains(&false) };
    let first_absent = are_nodes.iter().position(|is_node| !is_node);
    let absent = first_absent.and_then(|e| ends[e].0.copied()).unwrap_or_default();
    let mut edges: Vec<Edge> = nodes.windows(2).map(|w| ordered([w[0].1, w[1].1])).collect();
    if let (true, [(_, first), .., (_, last)]) = (is_closed, nodes) {
        edges.push(ordered([*last, *first]));
    }
    let missing_end = (!complete).then_some(Defect::CurveEnd { curve: CurveId(k), at: absent });
    Expected { edges, missing_end }
}

/// What is missing among the open edges of a chart, curve by curve, and what is too much.
fn compare(mesh: &Mesh, chart: ChartId, open: &[[VertexId; 2]], curves: Vec<(u32, &[Edge])>) -> Vec<Defect> {
    let points = &mesh.triangulation.points;
    let middle = |[a, b]: &Edge| crate::vec3::midpoint(points[a.index()], points[b.index()]);
    let found: BTreeSet<Edge> = open.iter().map(|e| ordered(*e)).collect();
    let mut accounted: BTreeSet<Edge> = BTreeSet::new();
    let mut defects = Vec::new();
    for (curve, edges) in curves {
        let missing: Vec<&Edge> = edges.iter().filter(|e| !found.contains(*e)).collect();
        if edges.is_empty() || !missing.is_empty() {
            let at = missing.first().map_or([f64::NAN; 3], |e| middle(e));
            defects.push(Defect::CurveBroken { chart, curve: CurveId(curve), edges: missing.len(), at });
        }
        accounted.extend(edges.iter().copied());
    }
    let stray: Vec<&Edge> = found.iter().filter(|e| !accounted.contains(*e)).collect();
    if let Some(first) = stray.first() {
        defects.push(Defect::StrayBoundary { chart, edges: stray.len(), at: middle(first) });
    }
    defects
}

/// The sides of all curves, by where they are.
struct CurveSides<'a> {
    curves: &'a [Vec<Vec3>],
    /// Curve by curve, each side as its curve and its number there.
    sides: Vec<(u32, u32)>,
    tree: Bvh,
}

impl<'a> CurveSides<'a> {
    fn new(curves: &'a [Vec<Vec3>]) -> Self {
        let mut sides: Vec<(u32, u32)> = Vec::new();
        for (k, curve) in (0..).zip(curves) {
            let count = curve.len().saturating_sub(1) as u32;
            sides.extend((0..count).map(|i| (k, i)));
        }
        let ends = |(k, i): &(u32, u32)| [0, 1].map(|e| curves[*k as usize][*i as usize + e]);
        let nothing = BoundingBox { min: [0.0; 3], max: [0.0; 3] };
        let tree = Bvh::new(sides.iter().map(|s| BoundingBox::of(ends(s)).unwrap_or(nothing)));
        Self { curves, sides, tree }
    }

    /// Where a point lies on every curve nearer than `tolerance`: its closest place there.
    fn at(&self, x: Vec3, tolerance: f64) -> Vec<OnCurve> {
        let around = BoundingBox { min: x.map(|c| c - tolerance), max: x.map(|c| c + tolerance) };
        let mut best: BTreeMap<u32, (f64, OnCurve)> = BTreeMap::new();
        self.tree.overlapping(&around, |s| {
            let (curve, side) = self.sides[s as usize];
            let ends = [0, 1].map(|e| self.curves[curve as usize][side as usize + e]);
            let OnSegment { share, squared } = on_segment(x, ends);
            let found = (squared, OnCurve { curve, side, share });
            // Of equally near sides the first one: the order of visits does not matter.
            let is_better = |b: &(f64, OnCurve)| squared < b.0 || (squared == b.0 && side < b.1.side);
            if squared <= tolerance * tolerance && best.get(&curve).is_none_or(is_better) {
                best.insert(curve, found);
            }
        });
        best.into_values().map(|(_, on)| on).collect()
    }
}
