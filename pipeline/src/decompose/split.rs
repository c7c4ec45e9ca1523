//! Splitting a chart that is too distorted, or that cannot be mapped.
//!
//! Where there is a map, its area scale shows where to cut: a protrusion is where the scale is small, and the ring around
//! the region below some scale is a short way across it. Otherwise the chart is cut into two parts of about the same
//! size. A chart is planar, so two connected parts of it are charts wherever neither touches itself.

use super::assemble::assemble;
use super::complex::Complex;
use super::contacts::{touches_itself, without_contacts};
use super::dual::Dual;
use super::features::with_features;
use super::merge::Limits;
use super::regions::Regions;
use super::voronoi::{Cells, bisect_until, farthest_first};
use super::{Error, Settings, cells, finish};
use crate::atlas::Chart;
use crate::mesh::{SurfaceMesh, vertices_of};
use crate::monitor::{Interrupted, Monitor};
use crate::topology::{FaceId, HalfEdgeId, VertexId};

/// Where to cut, as shares of the range of the logarithm of the area scale: the middle first, as it halves the decades of
/// distortion on both sides.
const LEVELS: [f64; 9] = [0.5, 0.45, 0.55, 0.4, 0.6, 0.35, 0.65, 0.3, 0.7];

/// How many protrusions are cut off at once, at most.
const MOST_CUTS: u32 = 32;

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
            Some(log_scale) => across_protrusions(dual, log_scale, limits)?,
            None => None,
        };
        by_scale.map_or_else(|| halves(dual, limits), Ok)
    };
    pieces(chart, cut, settings, monitor).map(Some)
}

/// Cuts `chart` into charts with the same id that do not touch themselves, but for what straight seams bring back; none where it does
/// not. A chart whose boundary passes twice through one place in space (copies of a vertex at which sheets touch) cannot be
/// handed to meshers, which find places in the plane by those in space.
///
/// # Errors
/// As [`split`].
pub fn separate(chart: &Chart, settings: &Settings, monitor: &dyn Monitor) -> Result<Option<Vec<Chart>>, Error> {
    if !touches_itself(chart) {
        return Ok(None);
    }
    let whole = Cells { labels: vec![0; chart.triangles().len()], len: 1 };
    let cut = |dual: &Dual, limits: &Limits| Ok(without_contacts(dual, whole, limits)?.labels);
    pieces(chart, cut, settings, monitor).map(Some)
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
    grow(dual, &mut labels, u32::MAX, front);
    labels
}

/// The chart of some triangles of `chart`, ascending, with the same id; none where they form none. `surface` is the chart as a
/// surface.
pub(crate) fn part_of(chart: &Chart, surface: &SurfaceMesh, faces: &[FaceId]) -> Option<Chart> {
    let part = surface.restricted(faces);
    let piece = assemble(&part, &vec![0; faces.len()]).ok()?.into_charts().pop()?;
    let vertices: Vec<VertexId> =
        vertices_of(&chart.triangles, faces).into_iter().map(|v| chart.vertices[v.index()]).collect();
    let faces: Vec<FaceId> = faces.iter().map(|f| chart.faces[f.index()]).collect();
    Some(piece.on_surface(chart.id, &vertices, &faces))
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
    let on_surface = |piece: Chart| piece.on_surface(chart.id, &chart.vertices, &chart.faces);
    Ok(pieces.into_charts().into_iter().map(on_surface).collect())
}

/// Gives triangles with the label `none` that of the nearest with another one, counted in triangles, as far as they are connected to
/// `front`, which have one already. Returns these and those that were given one.
pub(super) fn grow(dual: &Dual, labels: &mut [u32], none: u32, front: Vec<FaceId>) -> Vec<FaceId> {
    let mut visited = front;
    let mut next = 0;
    // Breadth first: each triangle enters once.
    while let Some(face) = visited.get(next).copied() {
        next += 1;
        for other in face.sides().into_iter().filter_map(|h| dual.twin(h).map(HalfEdgeId::face)) {
            if labels[other.index()] == none {
                labels[other.index()] = labels[face.index()];
                visited.push(other);
            }
        }
    }
    visited
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

/// Labels that cut off the region around the least area scale along the best level; where the scales of the rest still differ by more
/// than charts may, those of the next regions, too: a chart with many fingers (lucy_100k, eight at a ratio of 4e15) is mapped and
/// cut once, and not once for each of them. None where there is no legal cut.
///
/// Labels are 0 for the rest, which has the largest scale, then 1, 2, ... It ends after [`MOST_CUTS`].
fn across_protrusions(dual: &Dual, log_scale: &[f64], limits: &Limits) -> Result<Option<Vec<u32>>, Interrupted> {
    let mut labels = vec![0; log_scale.len()];
    for next in 1..=MOST_CUTS {
        let rest: Vec<usize> = (0..labels.len()).filter(|f| labels[*f] == 0).collect();
        let Some(range) = Range::of(rest.iter().map(|f| log_scale[*f])) else { break };
        if next > 1 && range.width() <= limits.largest_ratio.ln() {
            break;
        }
        let rest = Rest { dual, log_scale, labels: &labels, faces: &rest };
        let Some(cut) = rest.best_cut(next, range, limits)? else { break };
        labels = cut;
    }
    Ok(labels.iter().any(|label| *label > 0).then_some(labels))
}

/// Where area scales lie, but for the least and the largest 0.1 %, which single bad triangles decide.
#[derive(Clone, Copy)]
struct Range {
    low: f64,
    high: f64,
}

impl Range {
    /// That of some logarithms; none where there are none.
    fn of(log_scale: impl Iterator<Item = f64>) -> Option<Self> {
        let mut sorted: Vec<f64> = log_scale.collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let few = sorted.len() / 1000;
        Some(Self { low: *sorted.get(few)?, high: sorted[sorted.len() - 1 - few] })
    }

    fn width(self) -> f64 {
        self.high - self.low
    }

    fn at(self, share: f64) -> f64 {
        self.low + share * self.width()
    }
}

/// What is left of a chart: the triangles that have label 0.
struct Rest<'a> {
    dual: &'a Dual<'a>,
    log_scale: &'a [f64],
    labels: &'a [u32],
    faces: &'a [usize],
}

impl Rest<'_> {
    /// The labels with the best legal cut along a level, what it takes off labelled `next`.
    fn best_cut(&self, next: u32, range: Range, limits: &Limits) -> Result<Option<Vec<u32>>, Interrupted> {
        let Some(ends) = self.ends() else { return Ok(None) };
        let mut cuts = Vec::new();
        for level in LEVELS {
            let Some(is_cut) = self.below(range.at(level), ends) else { continue };
            cuts.push((self.cut_length(&is_cut) * (1.0 + OFF_CENTRE * (level - 0.5).abs()), is_cut));
        }
        // Of cuts that cost the same, the first one.
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, is_cut) in cuts {
            let labels = self.labels.iter().zip(&is_cut).map(|(label, is_cut)| if *is_cut { next } else { *label });
            let groups = Cells { labels: labels.collect(), len: next as usize + 1 };
            let legal = legal(self.dual, &Complex::new(self.dual, &groups), limits)?;
            if legal.iter().all(|l| *l) {
                return Ok(Some(groups.labels));
            }
        }
        Ok(None)
    }

    fn is_left(&self, face: usize) -> bool {
        self.labels[face] == 0
    }

    /// Where the scale is least and largest.
    fn ends(&self) -> Option<[usize; 2]> {
        let by_scale = |a: &usize, b: &usize| self.log_scale[*a].total_cmp(&self.log_scale[*b]);
        let least = self.faces.iter().copied().min_by(by_scale)?;
        let largest = self.faces.iter().copied().max_by(|a, b| by_scale(a, b).then(b.cmp(a)))?;
        Some([least, largest])
    }

    /// The connected region below `level` that holds the least scale, filled up so that what stays, which holds the largest, is
    /// connected, too; none where nothing is left.
    fn below(&self, level: f64, [least, largest]: [usize; 2]) -> Option<Vec<bool>> {
        let tip = connected(self.dual, least, |f| self.is_left(f) && self.log_scale[f] < level);
        if !tip[least] || tip[largest] {
            return None;
        }
        // What the tip cuts off from the largest scale belongs to it, too: both sides are connected.
        let stays = connected(self.dual, largest, |f| self.is_left(f) && !tip[f]);
        Some((0..self.labels.len()).map(|f| self.is_left(f) && !stays[f]).collect())
    }

    /// The length between what is cut off and what stays.
    fn cut_length(&self, is_cut: &[bool]) -> f64 {
        let cut = self.faces.iter().filter(|f| is_cut[**f]);
        let sides = cut.flat_map(|f| FaceId::at(*f).sides());
        let stays = |f: usize| self.is_left(f) && !is_cut[f];
        let is_between = |h: &HalfEdgeId| self.dual.twin(*h).is_some_and(|twin| stays(twin.face().index()));
        sides.filter(is_between).map(|h| self.dual.length(h)).sum()
    }
}

/// The triangles that are connected to `seed` through those that `admit` tells.
fn connected(dual: &Dual, seed: usize, admit: impl Fn(usize) -> bool) -> Vec<bool> {
    let mut is_connected = vec![false; dual.mesh.triangles().len()];
    is_connected[seed] = admit(seed);
    let mut front: Vec<FaceId> = if is_connected[seed] { vec![FaceId::at(seed)] } else { vec![] };
    // Each triangle enters once.
    while let Some(face) = front.pop() {
        for other in face.sides().into_iter().filter_map(|h| dual.twin(h).map(HalfEdgeId::face)) {
            if !is_connected[other.index()] && admit(other.index()) {
                is_connected[other.index()] = true;
                front.push(other);
            }
        }
    }
    is_connected
}
