//! Splitting a chart that is too distorted, or that cannot be mapped.
//!
//! Where there is a map, its area scale shows where to cut: a protrusion is where the scale is small, and the ring around
//! the region below some scale is a short way across it. Otherwise the chart is cut into two parts of about the same
//! size. A chart is planar, so two connected parts of it are charts wherever neither touches itself.

use super::assemble::assemble;
use super::complex::Complex;
use super::dual::Dual;
use super::features::with_features;
use super::merge::Limits;
use super::regions::Regions;
use super::voronoi::{Cells, bisect_until, farthest_first};
use super::{Error, Settings, cells, finish};
use crate::atlas::Chart;
use crate::monitor::{Interrupted, Monitor};
use crate::topology::partition::Partition;
use crate::topology::{FaceId, HalfEdgeId, VertexId};

/// Where to cut, as shares of the range of the logarithm of the area scale: the middle first, as it halves the decades of
/// distortion on both sides.
const LEVELS: [f64; 9] = [0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7];

/// How much longer a cut in the middle may be than one away from it, per share of the range. By experience: larger cuts
/// nearer to the middle, smaller where the way across is shorter.
const OFF_CENTRE: f64 = 3.0;

/// Cuts `chart` into at least two charts with the same id; none where it is a single triangle.
/// `log_scale` is the logarithm of the area scale of each triangle, where the chart has a map.
///
/// # Errors
/// [`Error::Illegal`]: a fault of planish; [`Error::Interrupted`].
///
/// ```
/// use planish_core::decompose::{Settings, decompose, split};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{repair, shapes};
///
/// let mesh = repair(&shapes::disk(6), &repair::Settings::default())?.mesh;
/// let atlas = decompose(&mesh, &Settings::default(), &NoMonitor)?;
/// let chart = &atlas.charts()[0];
/// let parts = split(chart, None, &Settings::default(), &NoMonitor)?.expect("it has more than one triangle");
/// assert!(parts.len() >= 2 && parts.iter().all(|part| part.id() == chart.id()));
/// assert_eq!(parts.iter().map(|part| part.triangles().len()).sum::<usize>(), chart.triangles().len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn split(
    chart: &Chart,
    log_scale: Option<&[f64]>,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<Chart>>, Error> {
    if chart.triangles().len() < 2 {
        return Ok(None);
    }
    let cut = |dual: &Dual, limits: &Limits| {
        let by_scale = match log_scale {
            Some(log_scale) => across_protrusion(dual, log_scale, limits)?,
            None => None,
        };
        by_scale.map_or_else(|| halves(dual, limits), Ok)
    };
    pieces(chart, cut, settings, monitor).map(Some)
}

/// Cuts `chart` between two of its vertices, numbered within the chart, into at least two charts with the same id. No
/// triangle may have both as corners.
///
/// A chart whose boundary passes twice through one place in space (copies of a vertex at which sheets touch) cannot be
/// handed to meshers, which find places in the plane by those in space.
///
/// # Errors
/// As [`split`].
pub fn separate(
    chart: &Chart,
    ends: [VertexId; 2],
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<Chart>, Error> {
    let cut = |dual: &Dual, limits: &Limits| {
        let sides = Cells { labels: nearer_end(dual, ends), len: 2 };
        bisected(dual, sides, limits)
    };
    pieces(chart, cut, settings, monitor)
}

/// Cuts `chart` into at least two charts with the same id, between the triangles on one side and
/// those on the other; `is_left` tells the side of each. Of each side the largest connected part keeps it.
///
/// # Errors
/// As [`split`].
pub fn halve(chart: &Chart, is_left: &[bool], settings: &Settings, monitor: &dyn Monitor) -> Result<Vec<Chart>, Error> {
    let cut = |dual: &Dual, limits: &Limits| {
        let sides = Cells { labels: largest_parts(dual, is_left), len: 2 };
        bisected(dual, sides, limits)
    };
    pieces(chart, cut, settings, monitor)
}

/// Per triangle 0 or 1, the side of the largest connected part of one side that is the fewest triangles away.
fn largest_parts(dual: &Dual, is_left: &[bool]) -> Vec<u32> {
    let count = is_left.len();
    let side = |h: HalfEdgeId| is_left[h.face().index()];
    let mut parts = dual.united(|h, twin| side(h) == side(twin));
    // Per triangle the least one of its part, which stands for that.
    let roots: Vec<usize> = (0..count).map(|f| parts.find(f)).collect();
    let mut sizes = vec![0; count];
    for root in &roots {
        sizes[*root] += 1;
    }
    // Of parts of the same size, the one with the least triangle.
    let largest = |side: bool| {
        let of_side = roots.iter().copied().filter(|root| is_left[*root] == side);
        of_side.max_by_key(|root| (sizes[*root], count - root))
    };
    let kept = [largest(false), largest(true)];
    let mut labels = vec![u32::MAX; count];
    for (face, root) in roots.iter().enumerate() {
        if let Some(side) = kept.iter().position(|kept| *kept == Some(*root)) {
            labels[face] = side as u32;
        }
    }
    let front = (0..count).filter(|f| labels[*f] != u32::MAX).map(FaceId::at).collect();
    grow(dual, labels, front)
}

/// Two vertices of a chart that are copies of one vertex of the input, if there are any.
pub fn contact(chart: &Chart) -> Option<[VertexId; 2]> {
    let welded = |v: u32| (chart.welded_vertex(VertexId(v)), v);
    let mut copies: Vec<(u32, u32)> = (0..chart.vertices().len() as u32).map(welded).collect();
    copies.sort_unstable();
    let twice = copies.windows(2).find(|w| w[0].0 == w[1].0)?;
    Some([VertexId(twice[0].1), VertexId(twice[1].1)])
}

/// The chart of some triangles of `chart`, ascending, with the same id; none where they form none.
pub(crate) fn part_of(chart: &Chart, faces: &[FaceId]) -> Option<Chart> {
    let surface = chart.to_surface().restricted(faces);
    let piece = assemble(&surface, &vec![0; faces.len()]).ok()?.into_charts().pop()?;
    let mut vertices: Vec<VertexId> = faces.iter().flat_map(|f| chart.triangles[f.index()]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    Some(Chart {
        id: chart.id,
        vertices: vertices.iter().map(|v| chart.vertices[v.index()]).collect(),
        faces: faces.iter().map(|f| chart.faces[f.index()]).collect(),
        ..piece
    })
}

/// The charts into which `cut` labels the triangles of `chart`, with straightened seams.
fn pieces(
    chart: &Chart,
    cut: impl FnOnce(&Dual, &Limits) -> Result<Vec<u32>, Interrupted>,
    settings: &Settings,
    monitor: &dyn Monitor,
) -> Result<Vec<Chart>, Error> {
    let part = chart.to_surface();
    let (dual, _) = with_features(&part, settings, monitor)?;
    let limits = Limits::new(settings);
    let labels = cut(&dual, &limits)?;
    let (cells, _) = cells(&dual, &limits)?;
    let size = dual.total_area() / cells.len as f64;
    let pieces = finish(&dual, labels, limits, settings, &cells, |_| size.sqrt())?;
    dual.checkpoint.end()?;
    let on_surface = |piece: &Chart| Chart {
        id: chart.id,
        vertices: piece.vertices.iter().map(|v| chart.vertices[v.index()]).collect(),
        faces: piece.faces.iter().map(|f| chart.faces[f.index()]).collect(),
        ..piece.clone()
    };
    Ok(pieces.charts().iter().map(on_surface).collect())
}

/// Per triangle, which of two vertices is fewer triangles away: 0 or 1. Both parts are connected, as every triangle but
/// those at the vertices has a neighbour in its part that is nearer.
fn nearer_end(dual: &Dual, ends: [VertexId; 2]) -> Vec<u32> {
    let triangles = dual.mesh.triangles();
    let mut labels = vec![u32::MAX; triangles.len()];
    let mut front: Vec<FaceId> = Vec::new();
    for (label, end) in (0..).zip(ends) {
        for f in (0..triangles.len()).filter(|f| triangles[*f].contains(&end)) {
            labels[f] = label;
            front.push(FaceId::at(f));
        }
    }
    grow(dual, labels, front)
}

/// Gives triangles without a label that of the nearest triangle with one, counted in triangles; `front` are those with one.
fn grow(dual: &Dual, mut labels: Vec<u32>, mut front: Vec<FaceId>) -> Vec<u32> {
    // Breadth first: each triangle enters once.
    while !front.is_empty() {
        let mut next = Vec::new();
        for face in front {
            for h in (0..3).map(|k| HalfEdgeId::side_of(face, k)) {
                let Some(other) = dual.twin(h).map(HalfEdgeId::face) else { continue };
                if labels[other.index()] == u32::MAX {
                    labels[other.index()] = labels[face.index()];
                    next.push(other);
                }
            }
        }
        front = next;
    }
    labels
}

/// Two parts of about the same size; more where these are no charts.
fn halves(dual: &Dual, limits: &Limits) -> Result<Vec<u32>, Interrupted> {
    bisected(dual, farthest_first(dual, |_| 2), limits)
}

/// The labels of cells that are bisected until all are charts.
fn bisected(dual: &Dual, cells: Cells, limits: &Limits) -> Result<Vec<u32>, Interrupted> {
    let cells = bisect_until(dual, cells, |groups| legal(dual, &Complex::new(dual, groups), limits))?;
    Ok(cells.labels)
}

/// Per cell, whether it may be a chart. A safe point.
pub(super) fn legal(dual: &Dual, complex: &Complex, limits: &Limits) -> Result<Vec<bool>, Interrupted> {
    dual.checkpoint()?;
    // Every cell as a region of its own.
    let count = complex.cells.len() as u32;
    let mut regions = Regions::new(complex, (0..count).collect(), complex.cells.len());
    let mut legal = Vec::with_capacity(complex.cells.len());
    for cell in 0..count {
        let outline = regions.outline_of(cell);
        let shape = regions.shape(&regions.all[cell as usize], &outline);
        legal.push(limits.allow(&shape));
    }
    Ok(legal)
}

/// The best legal cut along a level of the area scale.
fn across_protrusion(dual: &Dual, log_scale: &[f64], limits: &Limits) -> Result<Option<Vec<u32>>, Interrupted> {
    let mut sorted = log_scale.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    // Without the least and the largest 0.1 %, which single bad triangles decide.
    let few = sorted.len() / 1000;
    let (low, high) = (sorted[few], sorted[sorted.len() - 1 - few]);
    let mut best: Option<(f64, Vec<u32>)> = None;
    for level in LEVELS {
        let Some(labels) = below(dual, log_scale, low + level * (high - low)) else { continue };
        let groups = Cells { labels, len: 2 };
        let cost = cut_length(dual, &groups.labels) * (1.0 + OFF_CENTRE * (level - 0.5).abs());
        let legal = legal(dual, &Complex::new(dual, &groups), limits)?;
        let is_legal = legal.iter().all(|l| *l);
        // Of cuts that cost the same, the first one.
        if is_legal && best.as_ref().is_none_or(|b| cost.total_cmp(&b.0).is_lt()) {
            best = Some((cost, groups.labels));
        }
    }
    Ok(best.map(|(_, labels)| labels))
}

fn cut_length(dual: &Dual, labels: &[u32]) -> f64 {
    let parts = Partition::new(dual, labels);
    dual.half_edges().filter(|h| parts.is_seam(*h)).map(|h| dual.length(h)).sum()
}

/// Label 1 for the connected region below `level` that holds the least scale, filled up so that the rest (label 0),
/// which holds the largest, is connected, too; none where nothing is left.
fn below(dual: &Dual, log_scale: &[f64], level: f64) -> Option<Vec<u32>> {
    let n = log_scale.len();
    let least = (0..n).min_by(|a, b| log_scale[*a].total_cmp(&log_scale[*b]))?;
    let largest = (0..n).max_by(|a, b| log_scale[*a].total_cmp(&log_scale[*b]).then(b.cmp(a)))?;
    let low: Vec<bool> = log_scale.iter().map(|s| *s < level).collect();
    let tip = connected(dual, least, |f| low[f]);
    // What the tip cuts off from the largest scale belongs to it, too: both sides are connected.
    let rest = connected(dual, largest, |f| !tip[f]);
    if !tip[least] || tip[largest] {
        return None;
    }
    Some(rest.into_iter().map(|is_rest| u32::from(!is_rest)).collect())
}

/// The triangles among those that `admit` tells which are connected to `seed`.
fn connected(dual: &Dual, seed: usize, admit: impl Fn(usize) -> bool) -> Vec<bool> {
    let admits = |h: HalfEdgeId| admit(h.face().index());
    let mut sets = dual.united(|h, twin| admits(h) && admits(twin));
    let root = sets.find(seed);
    (0..dual.mesh.triangles().len()).map(|f| admit(f) && sets.find(f) == root).collect()
}
