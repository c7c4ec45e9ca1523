//! Where the edges of the shape itself turn sharply: the corners of a plate, or of a window in a wall.
//!
//! A mesher keeps the points in which curves end, and cuts off all other corners of a curve by chords. So the corners of
//! the shape must be points. The zigzag of a seam across a smooth surface is none, and neither is that of a boundary that
//! scanning or marching cubes left: it turns sharply from edge to edge, but not from four edges to the next four. And what
//! lies nearer together than a mesh can tell apart is one corner at most: more would ask for smaller elements.

use super::Boundary;
use crate::atlas::Chart;
use crate::mesh::SurfaceMesh;
use crate::vec3::{Vec3, cross, distance, dot, norm, sub};

/// An edge is sharp, and a curve turns sharply, from here on: the default of `feature-angle`.
const SHARP: f64 = 40.0;

/// Over so many edges to both sides a curve must turn sharply. A staircase of three edges and one does not.
const SCALES: [usize; 3] = [1, 2, 4];

/// Marks the vertices as corners in which edges of the shape turn sharply, the sharpest first, if there is no corner within
/// `spacing` along the curve yet. `corner` tells the others.
pub(super) fn mark(mesh: &SurfaceMesh, charts: &[&Chart], boundary: &Boundary, spacing: f64, corner: &mut [bool]) {
    let chains = Chains::new(mesh, boundary, corner);
    let is_shape: Vec<bool> = (0..boundary.by_segment.len()).map(|s| is_shape(mesh, charts, boundary, s)).collect();
    let of_shape = |v: &usize| chains.is_inner(*v) && chains.segments[*v].iter().all(|s| is_shape[*s as usize]);
    let kinks = (0..corner.len()).filter(of_shape).filter_map(|v| Some((chains.turn(v)?, v)));
    let mut kinks: Vec<(f64, usize)> = kinks.collect();
    kinks.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let spacing = spacing * mesh.metric().scale;
    // Loops that are shorter than the spacing are walked once.
    let mut is_short = vec![false; corner.len()];
    for (_, v) in kinks {
        if is_short[v] {
            continue;
        }
        let [before, after] = chains.segments[v].map(|s| chains.near(v, s, spacing, corner));
        corner[v] = before.is_none() && after.is_none();
        let whole_loop = before.filter(|passed| passed.last() == Some(&v));
        whole_loop.into_iter().flatten().for_each(|v| is_short[v] = true);
    }
}

/// Whether a segment is an edge of the shape: open boundary, an edge of several sheets, or a sharp edge between two charts.
fn is_shape(mesh: &SurfaceMesh, charts: &[&Chart], boundary: &Boundary, segment: usize) -> bool {
    let steps: Vec<_> = boundary.by_segment.row(segment).iter().map(|s| boundary.steps[*s as usize]).collect();
    let [a, b] = steps[..] else { return true };
    let normal = |step: &super::Step| {
        let face = charts[step.chart.index()].faces()[step.half_edge.face().index()];
        let [p, q, r] = mesh.corners(face.index()).map(|p| p.map(|c| c * mesh.metric().scale));
        cross(sub(q, p), sub(r, p))
    };
    let (m, n) = (normal(&a), normal(&b));
    // Both charts run along the edge in the same direction where their orientations differ.
    let sign = if a.from == b.from { -1.0 } else { 1.0 };
    sign * dot(m, n) < SHARP.to_radians().cos() * norm(m) * norm(n)
}

/// The segments at the vertices that are no corners, and what lies beyond these.
struct Chains {
    /// Per welded vertex its two segments, where it is inside a chain.
    segments: Vec<[u32; 2]>,
    /// Per segment its ends.
    ends: Vec<[u32; 2]>,
    /// Per welded vertex, where it is.
    points: Vec<Vec3>,
}

/// No segment.
const NONE: u32 = u32::MAX;

impl Chains {
    fn new(mesh: &SurfaceMesh, boundary: &Boundary, corner: &[bool]) -> Self {
        let mut segments = vec![[NONE; 2]; corner.len()];
        let mut points = vec![[0.0; 3]; corner.len()];
        let mut ends = Vec::with_capacity(boundary.by_segment.len());
        for (segment, steps) in (0..).zip(boundary.by_segment.rows()) {
            let step = boundary.steps[steps[0] as usize];
            ends.push([step.from, step.to]);
            for (welded, vertex) in [step.from, step.to].into_iter().zip(step.ends) {
                let welded = welded as usize;
                points[welded] = mesh.points()[vertex.index()].map(|c| c * mesh.metric().scale);
                let free = segments[welded].iter().position(|s| *s == NONE);
                if let Some(free) = free.filter(|_| !corner[welded]) {
                    segments[welded][free] = segment;
                }
            }
        }
        Self { segments, ends, points }
    }

    fn is_inner(&self, v: usize) -> bool {
        !self.segments[v].contains(&NONE)
    }

    /// The vertices after `v` along the chain that begins with `segment`. Ends: with the vertex that is not inside the
    /// chain, or with `v` itself.
    fn walk(&self, v: usize, segment: u32) -> impl Iterator<Item = usize> {
        let mut next = Some((v, segment));
        std::iter::from_fn(move || {
            let (from, segment) = next?;
            let [a, b] = self.ends[segment as usize].map(|v| v as usize);
            let at = if a == from { b } else { a };
            let [first, second] = self.segments[at];
            let goes_on = at != v && self.is_inner(at);
            next = goes_on.then_some((at, if first == segment { second } else { first }));
            Some(at)
        })
    }

    /// How the curve turns at `v`, as the largest cosine of the angles between the chords over [`SCALES`] edges to both
    /// sides; fewer where it is short. None: it does not turn sharply. A loop that is no longer than the edges tells
    /// nothing against it.
    fn turn(&self, v: usize) -> Option<f64> {
        let mut largest = -1.0_f64;
        for steps in SCALES {
            let ahead = self.segments[v].map(|s| self.walk(v, s).take(steps).last().unwrap_or(v));
            if ahead.contains(&v) {
                continue;
            }
            let [before, after] = ahead.map(|v| self.points[v]);
            let (come, go) = (sub(self.points[v], before), sub(after, self.points[v]));
            let lengths = norm(come) * norm(go);
            if lengths.is_nan() || lengths <= 0.0 {
                return None;
            }
            largest = largest.max(dot(come, go) / lengths);
        }
        (largest < SHARP.to_radians().cos()).then_some(largest)
    }

    /// The vertices from `v` to the first corner along the chain that begins with `segment`, or all around to `v` itself;
    /// none where that is not within `spacing`.
    fn near(&self, v: usize, segment: u32, spacing: f64, corner: &[bool]) -> Option<Vec<usize>> {
        let (mut at, mut length, mut passed) = (v, 0.0, Vec::new());
        for next in self.walk(v, segment) {
            length += distance(self.points[at], self.points[next]);
            if length >= spacing {
                return None;
            }
            passed.push(next);
            if corner[next] {
                break;
            }
            at = next;
        }
        Some(passed)
    }
}
