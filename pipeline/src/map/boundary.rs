//! Where the outer loop goes in the plane.
//!
//! The loop is laid on the unit circle by arc length (edges no shorter than 1e-4 of the mean, so that no two
//! vertices coincide), or on points that the caller prescribes. Mid-edge nodes lie on the arc, or on the chord.
//! The boundary is chosen once: the harmonic map, the feasible start and the result share it.

use crate::grid::GridPoint;
use crate::map::filled::FilledChart;
use crate::topology::{HalfEdgeId, VertexId};
use std::f64::consts::TAU;

/// The shortest edge, relative to the mean, as far as its arc is concerned. By experience: small enough that shares are
/// those of lengths on any mesh but the worst, large enough that arcs are long against the grid.
const SHORTEST: f64 = 1e-4;

/// The longest arc, as a share of the circle: below one half, so that every arc is seen from the centre.
const LONGEST: f64 = 0.45;

/// Where mid-edge nodes of the outer loop lie.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mids {
    /// In the middle of the arc of the unit circle.
    Arc,
    /// In the middle of the straight edge.
    Chord,
}

/// The outer loop in the plane, in the order of [`FilledChart::outer`].
#[derive(Clone, Debug, PartialEq)]
pub struct Boundary {
    /// Per half-edge of the loop, the uv of the vertex it begins at.
    vertices: Vec<GridPoint>,
    /// Per half-edge of the loop, the uv of its mid-edge node.
    mids: Vec<GridPoint>,
}

/// Why prescribed points are no boundary.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// Their number differs from that of the loop's vertices.
    #[error("{given} boundary points were prescribed, but the outer loop has {needed} vertices")]
    Count {
        /// Points given.
        given: usize,
        /// Vertices of the loop.
        needed: usize,
    },
}

impl Boundary {
    /// The loop on the unit circle, by arc length, counter-clockwise from (1, 0).
    ///
    /// # Example
    ///
    /// The loop of this disk is a hexagon: each of its sides takes a sixth of the circle.
    ///
    /// ```
    /// use planish_core::map::boundary::{Boundary, Mids};
    /// use planish_core::map::filled::FilledChart;
    /// use planish_core::{decompose, repair, shapes};
    ///
    /// let mesh = repair(&shapes::flat_disk(1), &Default::default())?.mesh;
    /// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
    /// let chart = FilledChart::new(&atlas.charts()[0]);
    /// let on_arcs = Boundary::circle(&chart, Mids::Arc);
    /// assert_eq!(on_arcs.vertices()[0].uv(), [1.0, 0.0]);
    /// let radius = |[u, v]: [f64; 2]| u.hypot(v);
    /// assert!((radius(on_arcs.mids()[0].uv()) - 1.0).abs() < 1e-14);
    /// let on_chords = Boundary::circle(&chart, Mids::Chord);
    /// assert!((radius(on_chords.mids()[0].uv()) - 0.75_f64.sqrt()).abs() < 1e-14);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn circle(chart: &FilledChart, mids: Mids) -> Self {
        let outer = chart.outer();
        let length = |h: &HalfEdgeId| chart.shapes()[h.face().index()].lengths[h.side()];
        let lengths: Vec<f64> = outer.iter().map(length).collect();
        let shares = arc_shares(&lengths);
        let mut vertices = Vec::with_capacity(outer.len());
        let mut middle = Vec::with_capacity(outer.len());
        let mut travelled = 0.0;
        for share in shares {
            vertices.push(GridPoint::vertex(on_circle(travelled)));
            middle.push(GridPoint::mid(on_circle(travelled + 0.5 * share)));
            travelled += share;
        }
        Self { vertices, mids: middle }.with_mids(mids)
    }

    /// The loop on prescribed points, in the order of [`FilledChart::outer`]; arcs are those of the unit circle, so that
    /// [`Mids::Arc`] makes sense for points on it only.
    ///
    /// # Errors
    /// [`Error::Count`].
    ///
    /// # Example
    ///
    /// ```
    /// use planish_core::map::boundary::{Boundary, Error, Mids};
    /// use planish_core::map::filled::FilledChart;
    /// use planish_core::{decompose, repair, shapes};
    ///
    /// let mesh = repair(&shapes::floater_five(), &Default::default())?.mesh;
    /// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
    /// let chart = FilledChart::new(&atlas.charts()[0]);
    /// let square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    /// let boundary = Boundary::prescribed(&chart, &square, Mids::Chord)?;
    /// assert_eq!(boundary.mids()[0].uv(), [0.5, 0.5]);
    /// let too_few = Boundary::prescribed(&chart, &square[..3], Mids::Chord);
    /// assert_eq!(too_few, Err(Error::Count { given: 3, needed: 4 }));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn prescribed(chart: &FilledChart, points: &[[f64; 2]], mids: Mids) -> Result<Self, Error> {
        let mut middle = Vec::with_capacity(points.len());
        for (i, p) in points.iter().enumerate() {
            let q = points[(i + 1) % points.len()];
            // The middle of the arc lies in the direction of the middle of the chord.
            let sum = [p[0] + q[0], p[1] + q[1]];
            let length = sum[0].hypot(sum[1]);
            middle.push(sum.map(|c| c / length));
        }
        Ok(Self::through(chart, points, &middle)?.with_mids(mids))
    }

    /// The loop on prescribed uv of its vertices and of its mid-edge nodes, both in the order of
    /// [`FilledChart::outer`].
    ///
    /// # Errors
    /// [`Error::Count`].
    pub fn through(chart: &FilledChart, vertices: &[[f64; 2]], mids: &[[f64; 2]]) -> Result<Self, Error> {
        let needed = chart.outer().len();
        if let Some(given) = [vertices.len(), mids.len()].into_iter().find(|n| *n != needed) {
            return Err(Error::Count { given, needed });
        }
        let vertices = vertices.iter().map(|p| GridPoint::vertex(*p)).collect();
        Ok(Self { vertices, mids: mids.iter().map(|p| GridPoint::mid(*p)).collect() })
    }

    /// The loops with their vertices where `place` has them, mid-edge nodes in the middle of chords, exactly.
    pub(crate) fn chords(chart: &FilledChart, place: impl Fn(VertexId) -> GridPoint) -> Self {
        let ends = || chart.outer().iter().map(|h| chart.ends(*h).map(&place));
        Self {
            vertices: ends().map(|[from, _]| from).collect(),
            mids: ends().map(|[from, to]| from.midpoint(to)).collect(),
        }
    }

    /// The uv of the loop's vertices.
    pub fn vertices(&self) -> &[GridPoint] {
        &self.vertices
    }

    /// The uv of the loop's mid-edge nodes.
    pub fn mids(&self) -> &[GridPoint] {
        &self.mids
    }

    /// The middle of the straight edge `i`.
    fn chord(&self, i: usize) -> GridPoint {
        self.vertices[i].midpoint(self.vertices[(i + 1) % self.vertices.len()])
    }

    fn with_mids(mut self, mids: Mids) -> Self {
        if mids == Mids::Chord {
            self.mids = (0..self.mids.len()).map(|i| self.chord(i)).collect();
        }
        self
    }

    /// Moves the mid-edge node of edge `i` from the arc towards the chord: to the chord (`all_the_way`), or
    /// half-way there.
    pub(crate) fn flatten(&mut self, i: usize, all_the_way: bool) {
        let on_arc = self.mids[i];
        let on_chord = self.chord(i);
        // Rounded to the grid of mid-edge nodes, on which any integer is a point.
        let half_way = GridPoint { x: (on_arc.x + on_chord.x) / 2, y: (on_arc.y + on_chord.y) / 2 };
        self.mids[i] = if all_the_way { on_chord } else { half_way };
    }
}

/// Per edge, its share of the circle, as a fraction of the whole turn: by length, none below [`SHORTEST`] of the
/// mean, none above [`LONGEST`] of the turn.
fn arc_shares(lengths: &[f64]) -> Vec<f64> {
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let lengthened: Vec<f64> = lengths.iter().map(|l| l.max(SHORTEST * mean)).collect();
    let total: f64 = lengthened.iter().sum();
    let mut shares: Vec<f64> = lengthened.iter().map(|l| l / total).collect();
    // At most two edges can be too long; giving what they lose to the others makes at most one more too long.
    for _ in 0..3 {
        let is_long = |share: &f64| *share >= LONGEST;
        let excess: f64 = shares.iter().filter(|s| is_long(s)).map(|s| s - LONGEST).sum();
        let rest: f64 = shares.iter().filter(|s| !is_long(s)).sum();
        if excess > 0.0 {
            for share in &mut shares {
                *share = if is_long(share) { LONGEST } else { *share * (1.0 + excess / rest) };
            }
        }
    }
    shares
}

/// The point of the unit circle at a fraction of the whole turn.
fn on_circle(turn: f64) -> [f64; 2] {
    let (sin, cos) = (TAU * turn).sin_cos();
    [cos, sin]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arcs_are_neither_too_short_nor_too_long() {
        for lengths in [
            vec![1.0, 1.0, 1e-9],
            vec![3.0, 4.0, 5.0],
            vec![1.0, 0.5, 0.5],
            vec![1.0, 1e-12, 1e-12, 1.0],
            vec![10.0, 9.0, 1.0],
        ] {
            let shares = arc_shares(&lengths);
            assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{shares:?}");
            assert!(shares.iter().all(|s| *s > 1e-5 && *s <= LONGEST + 1e-15), "{shares:?}");
        }
        assert_eq!(arc_shares(&[3.0, 4.0, 5.0]), [0.25, 4.0 / 12.0, 5.0 / 12.0]);
    }
}
