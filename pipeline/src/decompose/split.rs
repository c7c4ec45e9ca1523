//! Splitting a chart that is too distorted, or that cannot be mapped.
//!
//! Where there is a map, its area scale shows where to cut: a protrusion is where the scale is small, and the ring around
//! the region below some scale is a short way across it. Otherwise the chart is cut into two parts of about the same
//! size. A chart is planar, so two connected parts of it are charts wherever neither touches itself.

use super::complex::Complex;
use super::dual::Dual;
use super::features::with_features;
use super::merge::Limits;
use super::regions::Regions;
use super::voronoi::{Cells, bisect_until, farthest_first};
use super::{Error, Settings, cells, finish};
use crate::atlas::Chart;
use crate::host::Host;
use crate::id::{FaceId, HalfEdgeId};
use crate::mesh::SurfaceMesh;
use crate::union_find::UnionFind;

/// Where to cut, as shares of the range of the logarithm of the area scale: the middle first.
const LEVELS: [f64; 9] = [0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7];

/// How much longer a cut in the middle may be than one away from it, per share of the range.
const OFF_CENTRE: f64 = 3.0;

/// Cuts `chart`, a part of `mesh`, into at least two charts with the same id; none where it is a single triangle.
/// `log_scale` is the logarithm of the area scale of each triangle, where the chart has a map.
///
/// # Errors
/// [`Error::Illegal`]: a fault of planish; [`Error::Cancelled`].
pub fn split(
    mesh: &SurfaceMesh,
    chart: &Chart,
    log_scale: Option<&[f64]>,
    settings: &Settings,
    host: &dyn Host,
) -> Result<Option<Vec<Chart>>, Error> {
    if chart.triangles().len() < 2 {
        return Ok(None);
    }
    let part = mesh.part(chart);
    let (dual, _) = with_features(&part, settings, host)?;
    let limits = Limits::new(settings);
    let by_scale = log_scale.and_then(|s| across_protrusion(&dual, s, &limits));
    let labels = by_scale.unwrap_or_else(|| halves(&dual, &limits));
    let (cells, _) = cells(&dual, &limits)?;
    let size = dual.total_area() / cells.count as f64;
    let pieces = finish(&dual, labels, limits, settings, &cells, |_| size.sqrt())?;
    dual.pace.end()?;
    let on_surface = |piece: &Chart| Chart {
        id: chart.id,
        vertices: piece.vertices.iter().map(|v| chart.vertices[v.index()]).collect(),
        faces: piece.faces.iter().map(|f| chart.faces[f.index()]).collect(),
        ..piece.clone()
    };
    Ok(Some(pieces.charts().iter().map(on_surface).collect()))
}

/// Two parts of about the same size; more where these are no charts.
fn halves(dual: &Dual, limits: &Limits) -> Vec<u32> {
    bisect_until(dual, farthest_first(dual, |_| 2), |groups| legal(dual, &Complex::new(dual, groups), limits)).of
}

/// Per cell, whether it may be a chart. A safe point: all may be where nobody waits for charts any more.
pub(super) fn legal(dual: &Dual, complex: &Complex, limits: &Limits) -> Vec<bool> {
    let count = complex.cells.len();
    if dual.visited_all().is_err() {
        return vec![true; count];
    }
    let mut regions = Regions::new(complex, (0..count as u32).collect(), count);
    let outlines: Vec<_> = (0..count as u32).map(|r| regions.outline_of(r)).collect();
    let shapes = regions.all.iter().zip(&outlines).map(|(region, outline)| regions.shape(region, outline));
    shapes.map(|shape| limits.allow(&shape)).collect()
}

/// The best legal cut along a level of the area scale.
fn across_protrusion(dual: &Dual, log_scale: &[f64], limits: &Limits) -> Option<Vec<u32>> {
    let mut sorted = log_scale.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[sorted.len() / 1000], sorted[sorted.len() - 1 - sorted.len() / 1000]);
    let cut = |level: f64| {
        let labels = below(dual, log_scale, low + level * (high - low))?;
        let groups = Cells { of: labels, count: 2 };
        let cost = cut_length(dual, &groups.of) * (1.0 + OFF_CENTRE * (level - 0.5).abs());
        legal(dual, &Complex::new(dual, &groups), limits).iter().all(|l| *l).then_some((cost, groups.of))
    };
    let cuts = LEVELS.iter().filter_map(|level| cut(*level));
    cuts.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, labels)| labels)
}

fn cut_length(dual: &Dual, labels: &[u32]) -> f64 {
    let label = |h: HalfEdgeId| labels[h.face().index()];
    let cut = |h: &HalfEdgeId| dual.across(*h).is_some_and(|t| label(t) != label(*h));
    dual.half_edges().filter(cut).map(|h| dual.length(h)).sum()
}

/// Label 1 for the connected region below `level` that holds the least scale, filled up so that the rest (label 0),
/// which holds the largest, is connected, too; none where nothing is left.
fn below(dual: &Dual, log_scale: &[f64], level: f64) -> Option<Vec<u32>> {
    let n = log_scale.len();
    let least = (0..n).min_by(|a, b| log_scale[*a].total_cmp(&log_scale[*b]))?;
    let largest = (0..n).max_by(|a, b| log_scale[*a].total_cmp(&log_scale[*b]).then(b.cmp(a)))?;
    let low: Vec<bool> = log_scale.iter().map(|s| *s < level).collect();
    let tip = connected(dual, least, |f| low[f]);
    let rest = connected(dual, largest, |f| !tip[f]);
    (tip[least] && !tip[largest]).then(|| rest.into_iter().map(|r| u32::from(!r)).collect())
}

/// The triangles among those that `admit` tells which are connected to `seed`.
fn connected(dual: &Dual, seed: usize, admit: impl Fn(usize) -> bool) -> Vec<bool> {
    let n = dual.mesh.triangles().len();
    let mut sets = UnionFind::new(n);
    for h in dual.half_edges().filter(|h| admit(h.face().index())) {
        if let Some(t) = dual.across(h).filter(|t| admit(t.face().index())) {
            sets.unite(h.face().index(), t.face().index());
        }
    }
    let root = sets.find(seed);
    (0..n).map(|f| admit(FaceId::at(f).index()) && sets.find(f) == root).collect()
}
