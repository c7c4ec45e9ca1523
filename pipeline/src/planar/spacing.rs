//! Where the nodes along curves are: parted once, in space, so that all charts beside a curve have the same.

use super::metric::on_side;
use super::{Error, Sizing};
use crate::certified::CertifiedAtlas;
use crate::grid::GridPoint;
use crate::mesh::SurfaceMesh;
use crate::seams::{Curve, Passage};
use crate::topology::{ChartId, CurveId, HalfEdgeId};
use crate::vec3::{Vec3, distance};
use std::collections::BTreeSet;

/// A closed curve has so many chords at least.
const CHORDS_OF_LOOP: usize = 3;

/// Sizes are looked at so often along an edge of their length.
const LOOKS_PER_SIZE: f64 = 4.0;

/// And along a segment so often at most: one of a part as long as the whole, with edges of a millionth of that, has more than
/// can be meshed.
const LOOKS: f64 = 1e6;

/// Chords are no shorter than this share of a segment of their curve.
const SHORTEST: f64 = 1e-6;

/// A place on a curve: its segment, and where between the ends of that, from 0 up to but without 1.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct Position {
    pub segment: usize,
    pub t: f64,
}

/// The nodes of all curves.
pub(super) struct Chains {
    /// Per curve the nodes between its ends, from begin to end.
    inner: Vec<Vec<Position>>,
    /// Per curve the length up to each of its vertices.
    lengths: Vec<Vec<f64>>,
}

/// The polygon of a chart.
pub(super) struct Boundary {
    /// The loops, the outer one first: nodes, each with the chord that begins there.
    pub loops: Vec<Vec<BoundaryNode>>,
}

/// A node of a polygon.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoundaryNode {
    pub uv: GridPoint,
    /// Its number among the nodes of all curves.
    pub shared: u32,
    /// Where it is on the chart.
    pub on: HalfEdgeId,
    pub t: f64,
    /// The chord that begins there: its curve, and its number along that.
    pub chord: (CurveId, usize),
}

impl Chains {
    /// All curves, parted by the sizes along them.
    pub fn spaced(atlas: &CertifiedAtlas, sizing: &dyn Sizing) -> Self {
        let curves = atlas.seams().curves();
        let lengths = curves.iter().map(|curve| lengths(atlas.mesh(), curve)).collect();
        let inner = curves.iter().map(|curve| {
            if sizing.keeps(curve.id()) {
                (1..curve.segments()).map(|segment| Position { segment, t: 0.0 }).collect()
            } else {
                spaced(atlas.mesh(), curve, sizing)
            }
        });
        Self { inner: inner.collect(), lengths }
    }

    /// Halves some chords of a curve, as far as they are long enough. How many were.
    pub fn halve(&mut self, curve: CurveId, chords: &BTreeSet<usize>) -> usize {
        let lengths = &self.lengths[curve.index()];
        let end = Position { segment: lengths.len() - 1, t: 0.0 };
        let all = std::mem::take(&mut self.inner[curve.index()]);
        let mut halved = Vec::with_capacity(all.len() + chords.len());
        let mut from = Position { segment: 0, t: 0.0 };
        for (chord, to) in all.iter().copied().chain([end]).enumerate() {
            if chords.contains(&chord) {
                halved.extend(middle(lengths, from, to));
            }
            halved.push(to);
            from = to;
        }
        // The end is no node between the ends.
        halved.pop();
        let count = halved.len() - all.len();
        self.inner[curve.index()] = halved;
        count
    }

    /// The polygon of a chart.
    ///
    /// # Errors
    /// [`Error::MeetsItself`].
    pub fn boundary(&self, atlas: &CertifiedAtlas, chart: ChartId) -> Result<Boundary, Error> {
        let mut loops = Vec::new();
        for passages in atlas.seams().loops(chart) {
            let mut nodes = Vec::new();
            for passage in passages {
                self.pass(atlas, chart, *passage, &mut nodes)?;
            }
            loops.push(nodes);
        }
        Ok(Boundary { loops })
    }

    /// Adds the nodes of a curve in the direction of the passage, without the last.
    fn pass(
        &self,
        atlas: &CertifiedAtlas,
        chart: ChartId,
        Passage { curve, forward }: Passage,
        nodes: &mut Vec<BoundaryNode>,
    ) -> Result<(), Error> {
        let known = &atlas.seams().curves()[curve.index()];
        let mut beside = known.sides().iter().filter(|side| side.chart == chart);
        let (Some(side), None) = (beside.next(), beside.next()) else {
            return Err(Error::MeetsItself { chart, curve });
        };
        let certified = &atlas.charts()[chart.index()];
        let uv = &certified.map().map().nodes;
        let (inner, first) = (&self.inner[curve.index()], self.first_number(atlas, curve));
        let chords = inner.len() + 1;
        let [begin, end] = known.ends();
        for step in 0..chords {
            // Nodes along the curve count from its begin.
            let number = if forward { step } else { chords - step };
            let (position, shared) = match number {
                0 => (Position { segment: 0, t: 0.0 }, begin as u32),
                n if n == chords => (Position { segment: known.segments(), t: 0.0 }, end as u32),
                n => (inner[n - 1], first + n as u32 - 1),
            };
            let chord = (curve, if forward { step } else { chords - step - 1 });
            let (on, t) = on_chart(&side.half_edges, side.forward, position);
            let cell = cell_of(certified.chart(), on);
            let uv = if t == 0.0 { uv[cell[on.side()] as usize] } else { GridPoint::mid(arc_at(uv, cell, on, t)) };
            nodes.push(BoundaryNode { uv, shared, on, t, chord });
        }
        Ok(())
    }

    /// The number of the first node between the ends of a curve: those of its ends come before all.
    fn first_number(&self, atlas: &CertifiedAtlas, curve: CurveId) -> u32 {
        let before: usize = self.inner[..curve.index()].iter().map(Vec::len).sum();
        (atlas.seams().points().len() + before) as u32
    }
}

/// The nodes of a cell at a half-edge of its chart.
fn cell_of(chart: &crate::atlas::Chart, h: HalfEdgeId) -> [u32; 6] {
    let corners = chart.triangles()[h.face().index()];
    let middle =
        |side| (chart.vertices().len() + chart.edges().edge(HalfEdgeId::side_of(h.face(), side)).index()) as u32;
    [corners[0].0, corners[1].0, corners[2].0, middle(0), middle(1), middle(2)]
}

/// The point of a side of a cell.
fn arc_at(uv: &[GridPoint], cell: [u32; 6], h: HalfEdgeId, t: f64) -> [f64; 2] {
    let [_, xi, eta] = on_side(h, t);
    let l = [1.0 - xi - eta, xi, eta];
    let node = |n: u32| uv[n as usize].uv();
    let mut at = [0.0; 2];
    for k in 0..3 {
        let (corner, middle) = (node(cell[k]), node(cell[3 + k]));
        let (of_corner, of_middle) = (l[k] * (2.0 * l[k] - 1.0), 4.0 * l[k] * l[(k + 1) % 3]);
        (0..2).for_each(|i| at[i] += of_corner * corner[i] + of_middle * middle[i]);
    }
    at
}

/// A place of a curve, on a half-edge of the chart beside it whose direction the chart runs in.
fn on_chart(half_edges: &[HalfEdgeId], forward: bool, Position { segment, t }: Position) -> (HalfEdgeId, f64) {
    let last = half_edges.len() - 1;
    match (forward, t == 0.0) {
        // The end of the last half-edge is the begin of the one that follows it around the triangle, which may be inside: the
        // node is that corner.
        (true, true) if segment > last => (half_edges[last].next(), 0.0),
        (true, _) => (half_edges[segment], t),
        // Against the chart, a vertex of the curve is the begin of the half-edge before it along the curve.
        (false, true) if segment == 0 => (half_edges[0].next(), 0.0),
        (false, true) => (half_edges[segment - 1], 0.0),
        (false, false) => (half_edges[segment], 1.0 - t),
    }
}

/// The length of a curve up to each of its vertices.
fn lengths(mesh: &SurfaceMesh, curve: &Curve) -> Vec<f64> {
    let mut sum = 0.0;
    let mut lengths = vec![0.0];
    for ends in curve.vertices().windows(2) {
        let [from, to] = [ends[0], ends[1]].map(|v| mesh.points()[v.index()]);
        sum += distance(from, to);
        lengths.push(sum);
    }
    lengths
}

/// The middle between two places by length; none where they are too close.
fn middle(lengths: &[f64], from: Position, to: Position) -> Option<Position> {
    let end_segment = if to.t == 0.0 { to.segment - 1 } else { to.segment };
    if from.segment == end_segment {
        // Within one segment, which may have no length.
        let until = if to.t == 0.0 { 1.0 } else { to.t };
        let is_long = until - from.t > 2.0 * SHORTEST;
        return is_long.then_some(Position { segment: from.segment, t: 0.5 * (from.t + until) });
    }
    let length = |p: Position| {
        let begin = lengths[p.segment];
        begin + p.t * (lengths.get(p.segment + 1).copied().unwrap_or(begin) - begin)
    };
    let middle = 0.5 * (length(from) + length(to));
    // The vertex nearest to the middle, between both.
    let after = lengths.partition_point(|l| *l < middle);
    let is_between = |v: &usize| *v > from.segment && *v <= end_segment;
    let nearest = [after.saturating_sub(1), after, from.segment + 1].into_iter().filter(is_between);
    let nearest = nearest.min_by(|a, b| (lengths[*a] - middle).abs().total_cmp(&(lengths[*b] - middle).abs()))?;
    Some(Position { segment: nearest, t: 0.0 })
}

/// Places that part a curve into chords of the size, all of them of the same share of the sizes along it.
fn spaced(mesh: &SurfaceMesh, curve: &Curve, sizing: &dyn Sizing) -> Vec<Position> {
    // How many sizes long the curve is up to some places.
    let mut passed: Vec<(Position, f64)> = vec![(Position { segment: 0, t: 0.0 }, 0.0)];
    let mut sum = 0.0;
    for (segment, ends) in curve.vertices().windows(2).enumerate() {
        let [from, to] = [ends[0], ends[1]].map(|v| mesh.points()[v.index()]);
        let length = distance(from, to);
        let least = sizing.size_at(from).min(sizing.size_at(to));
        let looks = (LOOKS_PER_SIZE * length / least).ceil().clamp(1.0, LOOKS);
        for look in 1..=looks as usize {
            let t = look as f64 / looks;
            let at: Vec3 = [0, 1, 2].map(|k| from[k] + (t - 0.5 / looks) * (to[k] - from[k]));
            sum += length / looks / sizing.size_at(at);
            let position = if t < 1.0 { Position { segment, t } } else { Position { segment: segment + 1, t: 0.0 } };
            passed.push((position, sum));
        }
    }
    let fewest = if curve.is_closed() { CHORDS_OF_LOOP } else { 1 };
    let chords = (sum.round() as usize).max(fewest);
    let at = |wanted: f64| {
        let after = passed.partition_point(|(_, sum)| *sum < wanted).clamp(1, passed.len() - 1);
        let [(from, before), (to, behind)] = [passed[after - 1], passed[after]];
        let share = if behind > before { (wanted - before) / (behind - before) } else { 0.0 };
        between(from, to, share.clamp(0.0, 1.0))
    };
    let mut places: Vec<Position> = (1..chords).map(|k| at(sum * k as f64 / chords as f64)).collect();
    let end = Position { segment: curve.segments(), t: 0.0 };
    places.dedup();
    places.retain(|p| *p > Position { segment: 0, t: 0.0 } && *p < end);
    places
}

/// A place between two that follow each other within a segment. One that all but meets a vertex of the curve is that.
fn between(from: Position, to: Position, share: f64) -> Position {
    let until = if to.segment > from.segment { 1.0 } else { to.t };
    let t = from.t + share * (until - from.t);
    if t <= SHORTEST {
        Position { segment: from.segment, t: 0.0 }
    } else if t >= 1.0 - SHORTEST {
        Position { segment: from.segment + 1, t: 0.0 }
    } else {
        Position { segment: from.segment, t }
    }
}
