//! Edge weights of linear maps: each vertex inside becomes the weighted mean of its neighbours.

use crate::map::filled::FilledChart;
use crate::topology::{EdgeId, HalfEdgeId};

/// How far a negative weight is raised, relative to the mean value weight of the edge. Raising to zero is not enough: on
/// [`folding_three`](crate::shapes::folding_three) it leaves a triangle of area zero. Larger is further from the
/// harmonic map.
const RAISED_TO: f64 = 0.1;

/// The harmonic weight of every edge: half the sum of the cotangents of the opposite angles (Pinkall and Polthier
/// 1993, doi 10.1080/10586458.1993.10504266). Negative where these add up to more than pi.
pub(crate) fn harmonic(chart: &FilledChart) -> Vec<f64> {
    let mut weights = vec![0.0; chart.edges().len()];
    for (f, shape) in chart.shapes().iter().enumerate() {
        for (k, half) in shape.half_cotangents().into_iter().enumerate() {
            weights[chart.edges().edge(HalfEdgeId::at(3 * f + k)).index()] += half;
        }
    }
    weights
}

/// Per edge, its mean value weight as seen from both ends, in the order of the edge's first half-edge (Floater
/// 2003, doi 10.1016/S0167-8396(02)00002-5): (tan(a/2) + tan(b/2)) / length. Always positive inside.
pub(crate) fn mean_value(chart: &FilledChart) -> Vec<[f64; 2]> {
    let mut weights = vec![[0.0; 2]; chart.edges().len()];
    for (f, shape) in chart.shapes().iter().enumerate() {
        let tangents = shape.half_angle_tangents();
        for k in 0..3 {
            let h = HalfEdgeId::at(3 * f + k);
            let e = chart.edges().edge(h);
            let first = chart.ends(chart.edges().sides(e)[0])[0];
            // Which end of the edge the side begins at, corner k of the triangle; it ends at corner k + 1.
            let begin = usize::from(chart.ends(h)[0] != first);
            weights[e.index()][begin] += tangents[k] / shape.lengths[k];
            weights[e.index()][1 - begin] += tangents[(k + 1) % 3] / shape.lengths[k];
        }
    }
    weights
}

/// The positive weights that replace negative harmonic ones: a tenth of the mean value weight, scaled so that
/// both kinds of weights have the same sum around a vertex, and averaged over both ends (which keeps the matrix
/// symmetric; the convex combination theorem asks for positive weights only).
pub(crate) fn replacements(chart: &FilledChart, harmonic: &[f64], mean_value: &[[f64; 2]]) -> Vec<f64> {
    let ends = |e: usize| chart.ends(chart.edges().sides(EdgeId::at(e))[0]).map(|v| v.index());
    // Per vertex, the sums of both kinds of weights over its edges.
    let mut harmonic_sums = vec![0.0_f64; chart.vertex_count()];
    let mut mean_value_sums = vec![0.0_f64; chart.vertex_count()];
    for e in 0..harmonic.len() {
        for (v, weight) in ends(e).into_iter().zip(mean_value[e]) {
            harmonic_sums[v] += harmonic[e].abs();
            mean_value_sums[v] += weight;
        }
    }
    let mut positive = Vec::with_capacity(harmonic.len());
    for e in 0..harmonic.len() {
        let [a, b] = ends(e).map(|v| harmonic_sums[v] / mean_value_sums[v]);
        positive.push(RAISED_TO * 0.5 * (a * mean_value[e][0] + b * mean_value[e][1]));
    }
    positive
}
