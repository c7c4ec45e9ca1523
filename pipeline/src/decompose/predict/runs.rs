//! The boundary of a union, as far as its cells are concerned.

use super::super::complex::Complex;
use crate::vec3::Vec3;

/// A run of half-arcs of one cell along a loop.
pub(super) struct Run {
    pub cell: u32,
    pub length: f64,
    pub middle: Vec3,
    /// Where its middle is, as a share of the loop.
    pub at: f64,
}

/// The runs of a loop.
pub(super) fn runs(complex: &Complex, boundary_loop: &[u32]) -> Vec<Run> {
    let arc = |a: &u32| &complex.arcs[*a as usize];
    let total: f64 = boundary_loop.iter().map(|a| arc(a).length).sum();
    let mut travelled = 0.0;
    let mut runs = Vec::new();
    for run in boundary_loop.chunk_by(|a, b| arc(a).cell == arc(b).cell) {
        let length: f64 = run.iter().map(|a| arc(a).length).sum();
        // The half-arc on which the first half of the length ends; rounding may leave none.
        let mut left = 0.5 * length;
        let half_way = run.iter().find(|a| {
            left -= arc(a).length;
            left <= 0.0
        });
        let at = (travelled + 0.5 * length) / total;
        travelled += length;
        let middle = arc(half_way.unwrap_or(&run[0])).middle;
        runs.push(Run { cell: arc(&run[0]).cell, length, middle, at });
    }
    runs
}
