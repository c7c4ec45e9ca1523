//! Triangles whose normal in space, computed in doubles, is exactly zero: one of their nodes moves.

use super::{Error, LinearChart};
use crate::topology::{ChartId, FaceId};
use crate::vec3::{Vec3, cross, dot, sub};

/// How far a node moves, relative to the diagonal of the bounding box: thousands of units in the last place of a double, and
/// far below what single precision keeps.
const STEP: f64 = 1e-12;

/// How often all triangles are looked at. By experience: a triangle waits for a later round only while its neighbours move.
const ROUNDS: u32 = 16;

/// Moves nodes, the same for all charts, until every triangle has a normal. Returns how many nodes moved.
///
/// In each round every triangle without a normal moves the node opposite its longest side, along the axis that is
/// most perpendicular to that side, unless one of its nodes has moved in this round. Later rounds move further.
///
/// # Errors
/// [`Error::NoNormal`], after a fixed number of rounds.
pub(super) fn separate(points: &mut [Vec3], charts: &[LinearChart], diagonal: f64) -> Result<usize, Error> {
    let mut found = flat(points, charts);
    let mut moved_in = vec![0; if found.is_empty() { 0 } else { points.len() }];
    for round in 1..=ROUNDS {
        if found.is_empty() {
            break;
        }
        let step = f64::from(round) * STEP * diagonal;
        for (_, triangle) in found {
            if triangle.iter().all(|n| moved_in[*n as usize] != round) {
                let node = shift(points, triangle, step);
                moved_in[node as usize] = round;
            }
        }
        found = flat(points, charts);
    }
    match found.first() {
        Some(((chart, face), _)) => Err(Error::NoNormal { chart: *chart, face: *face }),
        None => Ok(moved_in.iter().filter(|round| **round > 0).count()),
    }
}

/// A triangle by its chart and number there, and its nodes.
type Named = ((ChartId, FaceId), [u32; 3]);

/// The triangles without a normal.
fn flat(points: &[Vec3], charts: &[LinearChart]) -> Vec<Named> {
    let mut found = Vec::new();
    for (chart, c) in (0..).map(ChartId).zip(charts) {
        for (t, f) in c.triangles.iter().zip(&c.faces) {
            let nodes = t.map(|n| c.nodes[n as usize]);
            if !has_normal(nodes.map(|n| points[n as usize])) {
                found.push(((chart, FaceId(*f)), nodes));
            }
        }
    }
    found
}

/// Whether the normal has a length, from whichever corner it is computed.
fn has_normal(p: [Vec3; 3]) -> bool {
    (0..3).all(|k| {
        let n = cross(sub(p[(k + 1) % 3], p[k]), sub(p[(k + 2) % 3], p[k]));
        let squared = dot(n, n);
        squared > 0.0 && squared.is_finite()
    })
}

/// Moves the node opposite the longest side; which one.
fn shift(points: &mut [Vec3], triangle: [u32; 3], step: f64) -> u32 {
    let p = triangle.map(|n| points[n as usize]);
    let side = |k: usize| sub(p[(k + 2) % 3], p[(k + 1) % 3]);
    let opposite = (1..3).fold(0, |best, k| if dot(side(k), side(k)) > dot(side(best), side(best)) { k } else { best });
    let along = side(opposite).map(f64::abs);
    let axis = (1..3).fold(0, |best, k| if along[k] < along[best] { k } else { best });
    let node = triangle[opposite];
    let coordinate = &mut points[node as usize][axis];
    // Far from the origin, a step below the resolution of doubles would be none.
    let resolution = coordinate.abs().next_up() - coordinate.abs();
    *coordinate += step.max(4.0 * resolution);
    node
}
