//! Where elements must be smaller than asked for: along narrow charts and curves, in small charts, and where the boundary of a
//! chart passes close to itself.

use super::gmsh::area_of;
use planish_core::CertifiedChart;
use planish_core::atlas::Chart;
use planish_core::certified::NARROW;
use planish_core::measure::sizes::SizedPlace;
use planish_core::mesh::SurfaceMesh;
use planish_core::seams::{Curve, Gap, Passage, SeamNetwork};
use planish_core::topology::ChartId;
use planish_core::vec3::{Vec3, distance};
use std::collections::BTreeMap;

/// Every loop of a chart gets at least so many edges: an octagon has 0.90 of the area of its circle, a hexagon 0.83.
const EDGES_PER_LOOP: f64 = 8.0;

/// A chart is so many elements wide at least, unless it is as wide as an edge is long. By experience: more makes
/// many elements in strips that one row would fill.
const ELEMENTS_ACROSS: f64 = 1.5;

/// The same for charts that share two curves without a common end, as the two sides of a thin strip do: an edge across such a
/// chart, from curve to curve, may be one of the other chart, too (two of truck_nonmanifold).
const ACROSS_SHEETS: f64 = 3.0;

/// Charts of less than so many squares of the size get elements small enough for their whole boundary, inside, too, and half
/// of the size where MeshAdapt makes them: it measures edges at their middles, and cuts off what sticks out (a third of a
/// chart of lucy_100k of 21 squares).
const SMALL: f64 = 60.0;

/// And every curve along a narrow place at most about so many: a chart as long as the part and a thousandth as wide would
/// have as many elements as all others together.
const MOST_EDGES: f64 = 200.0;

/// Elements are no smaller than this share of the size where a boundary passes close to itself. Of cad_fixture_vtk 18 elements
/// below gamma 0.1 are left without any of this, 4 with a sixteenth, none with this.
const LEAST: f64 = 1.0 / 32.0;

/// So many places of a curve, the narrowest, get smaller elements around them. More would make all of a seam fine that runs in
/// zigzag, as on raw marching cubes (plate_genus9: edges of a quarter of the size, in the median).
const PLACES_PER_CURVE: usize = 8;

/// So many places altogether, the narrowest. The bound is from when each was a field of Gmsh's, which asks all of them at every step
/// (truck_nonmanifold with 2,000: 46 s of CPU in place of 6); as one field, more would cost little, but what they do to elements
/// was not looked at.
const MOST_PLACES: usize = 400;

/// Where a place already has elements smaller than so many times what it needs, nothing is added.
const CLOSE: f64 = 1.5;

/// How far smaller elements reach around a place, in their sizes: an edge on either side of the middle one.
const REACH: f64 = 2.0;

/// The sizes of narrow places: the size halved so often at most, to a thousandth. By experience: elements of less could
/// outnumber all others.
const HALVINGS: u32 = 10;

/// Where elements are smaller, and how small.
#[derive(Default)]
pub(super) struct Places {
    /// The places.
    pub sized: Vec<SizedPlace>,
    /// How many curves they run along.
    pub curves: usize,
    /// How many of the places are where a boundary passes close to itself.
    pub gaps: usize,
}

/// The places that are narrower than elements of the size, or small. `adapted` are the charts that MeshAdapt makes, ascending.
pub(super) fn places(
    mesh: &SurfaceMesh,
    charts: &[CertifiedChart],
    network: &SeamNetwork,
    adapted: &[usize],
    size: f64,
) -> Places {
    let extents: Vec<Extent> = charts.iter().map(|chart| Extent::of(chart.chart(), network)).collect();
    let mut wanted = wanted_sizes(&extents, network);
    let mut sized = gaps(mesh, &extents, network, size, &mut wanted);
    let mut places = Places { gaps: sized.len(), ..Places::default() };
    for (curve, wanted) in network.curves().iter().zip(&wanted) {
        if let Some(halvings) = halvings_along(size, *wanted, curve.length()) {
            places.curves += 1;
            sized.extend(along_curve(mesh, curve, halved(size, halvings)));
        }
    }
    for (extent, chart) in extents.iter().zip(charts) {
        if let Some(halvings) = halvings_inside(extent, adapted, size) {
            sized.extend(over_chart(chart.chart(), halved(size, halvings)));
        }
    }
    Places { sized, ..places }
}

/// Handles and holes around which fewer edges go than this may close, where a mesher knows of no seams: mmgs gave four triangles to 88
/// edges of cad_imu, and to 5 with this.
const EDGES_AROUND: f64 = 6.0;

/// Places along the loops of charts that are too short for edges of the size.
pub(super) fn short_loops(
    mesh: &SurfaceMesh,
    charts: &[CertifiedChart],
    network: &SeamNetwork,
    size: f64,
) -> Vec<SizedPlace> {
    let mut wanted = vec![f64::INFINITY; network.curves().len()];
    for turn in charts.iter().flat_map(|chart| network.loops(chart.chart().id())) {
        let needed = length_of(turn, network) / EDGES_AROUND;
        for passage in turn {
            let known = &mut wanted[passage.curve.index()];
            *known = known.min(needed);
        }
    }
    let mut places = Vec::new();
    for (curve, wanted) in network.curves().iter().zip(wanted) {
        if let Some(halvings) = halvings(size, wanted) {
            places.extend(along_curve(mesh, curve, halved(size, halvings)));
        }
    }
    places
}

/// The size, halved so often.
fn halved(size: f64, halvings: u32) -> f64 {
    size * 0.5_f64.powi(halvings as i32)
}

/// Places along a curve, no farther apart than the size that they ask for.
fn along_curve(mesh: &SurfaceMesh, curve: &Curve, size: f64) -> Vec<SizedPlace> {
    let mut places = Vec::new();
    for ends in curve.vertices().windows(2) {
        let [from, to] = [ends[0], ends[1]].map(|v| mesh.points()[v.index()]);
        let steps = (distance(from, to) / size).ceil().max(1.0) as u32;
        for step in 0..=steps {
            let t = f64::from(step) / f64::from(steps);
            let at = [0, 1, 2].map(|k| from[k] + t * (to[k] - from[k]));
            places.push(SizedPlace { at, size, reach: size });
        }
    }
    // Of segments that are shorter than that, the last place is far enough for many.
    let mut last: Option<Vec3> = None;
    places.retain(|place| {
        let is_far = last.is_none_or(|last| distance(last, place.at) >= 0.5 * size);
        last = if is_far { Some(place.at) } else { last };
        is_far
    });
    places
}

/// Places all over a chart, no farther apart than the size that they ask for; a small chart, so that they are not many. Triangles
/// may be needles, of which a row along the longest side is enough.
fn over_chart(chart: &Chart, size: f64) -> Vec<SizedPlace> {
    let mut places = Vec::new();
    for face in 0..chart.triangles().len() {
        let corners = chart.corners(face);
        let lengths = [0, 1, 2].map(|k| distance(corners[k], corners[(k + 1) % 3]));
        let longest = (1..3).fold(0, |best, k| if lengths[k] > lengths[best] { k } else { best });
        let [a, b, c] = [0, 1, 2].map(|k| corners[(longest + k) % 3]);
        let steps = |length: f64| (length / size).ceil().clamp(1.0, MOST_EDGES) as u32;
        let height = 2.0 * chart.area(face) / lengths[longest];
        let (along, across) = (steps(lengths[longest]), steps(height));
        for (i, j) in (0..=along).flat_map(|i| (0..=across).map(move |j| (i, j))) {
            let t = f64::from(j) / f64::from(across);
            let s = f64::from(i) / f64::from(along) * (1.0 - t);
            let at = [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
            places.push(SizedPlace { at, size, reach: size });
        }
    }
    places
}

/// The places where boundaries pass close to themselves, but where the sizes `wanted` along the curves see to that; those are
/// lowered where half of a curve is as narrow.
fn gaps(
    mesh: &SurfaceMesh,
    extents: &[Extent],
    network: &SeamNetwork,
    size: f64,
    wanted: &mut [f64],
) -> Vec<SizedPlace> {
    let needed = |width: f64| width.max(LEAST * size);
    let mut of_curves: BTreeMap<usize, Vec<Place>> = BTreeMap::new();
    // Charts that are as narrow all over have elements as small along all of their curves already.
    let wide = extents.iter().filter(|extent| extent.width() > ELEMENTS_ACROSS * LEAST * size);
    for chart in wide.map(|extent| extent.chart) {
        let mut gaps = network.gaps(mesh, chart, NARROW * size);
        gaps.sort_by_key(|gap| gap.curve);
        for gaps in gaps.chunk_by(|a, b| a.curve == b.curve) {
            let curve = gaps[0].curve.index();
            if let Some(width) = narrower_half(gaps, network.curves()[curve].length()) {
                wanted[curve] = wanted[curve].min(needed(width));
            }
            let places = gaps.iter().map(|gap| Place { at: gap.place, size: needed(gap.width) }).collect();
            // Only so many are kept of each chart: along all of a seam there may be millions.
            of_curves.entry(curve).or_default().extend(spread(places, PLACES_PER_CURVE));
        }
    }
    let mut places = Vec::new();
    for (curve, mut of_curve) in of_curves {
        let length = network.curves()[curve].length();
        of_curve.retain(|place| !is_enough(place.size, size, wanted[curve], length));
        // The charts on both sides have found places.
        places.extend(spread(of_curve, PLACES_PER_CURVE));
    }
    // Curves meet, and pass each other.
    let sized = |place: Place| SizedPlace { at: place.at, size: place.size, reach: REACH * place.size };
    spread(places, MOST_PLACES).into_iter().map(sized).collect()
}

/// The least width that half of the length of a curve does not exceed; none where less of it is narrow.
fn narrower_half(gaps: &[Gap], length: f64) -> Option<f64> {
    let mut sorted: Vec<&Gap> = gaps.iter().collect();
    sorted.sort_by(|a, b| a.width.total_cmp(&b.width));
    let mut passed = 0.0;
    for gap in sorted {
        passed += gap.length;
        if passed >= 0.5 * length {
            return Some(gap.width);
        }
    }
    None
}

/// A place and the size of elements there.
#[derive(Clone, Copy)]
struct Place {
    at: Vec3,
    size: f64,
}

/// Whether elements of the size that a curve gets are small enough.
fn is_enough(needed: f64, size: f64, wanted: f64, length: f64) -> bool {
    along(size, wanted, length) < CLOSE * needed
}

/// The size that elements along a curve get.
fn along(size: f64, wanted: f64, length: f64) -> f64 {
    halvings_along(size, wanted, length).map_or(size, |halvings| halved(size, halvings))
}

/// How often the size is halved along a curve: however narrow the place, no more often than gives [`MOST_EDGES`].
fn halvings_along(size: f64, wanted: f64, length: f64) -> Option<u32> {
    halvings(size, wanted.max(length / MOST_EDGES))
}

/// The narrowest places, none in the ball of another; so many at most.
fn spread(mut places: Vec<Place>, most: usize) -> Vec<Place> {
    // By place, too, so that nothing depends on the numbering.
    places.sort_by(|p, q| {
        let by_place = || p.at.iter().zip(q.at).map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne());
        p.size.total_cmp(&q.size).then_with(|| by_place().unwrap_or(std::cmp::Ordering::Equal))
    });
    let mut apart: Vec<Place> = Vec::new();
    for place in places {
        if apart.len() == most {
            break;
        }
        if apart.iter().all(|kept| distance(kept.at, place.at) >= REACH * kept.size) {
            apart.push(place);
        }
    }
    apart
}

/// How often the size is halved all over a chart; none where it is not, as larger ones have smaller elements along their curves
/// only.
fn halvings_inside(extent: &Extent, adapted: &[usize], size: f64) -> Option<u32> {
    if extent.area > SMALL * size * size {
        return None;
    }
    let is_adapted = adapted.binary_search(&extent.chart.index()).is_ok();
    let inside = if is_adapted { 0.5 * size } else { size };
    halvings(size, inside.min(extent.perimeter / EDGES_PER_LOOP))
}

/// How often `size` is halved for elements of the `wanted` one; none where it is not.
fn halvings(size: f64, wanted: f64) -> Option<u32> {
    let halvings = (size / wanted).log2().round().clamp(1.0, f64::from(HALVINGS));
    (wanted < NARROW * size).then_some(halvings as u32)
}

/// The length of a loop.
fn length_of(turn: &[Passage], network: &SeamNetwork) -> f64 {
    turn.iter().map(|p| network.curves()[p.curve.index()].length()).sum()
}

/// How large a chart is, in the unit of the input.
#[derive(Clone, Copy)]
struct Extent {
    chart: ChartId,
    area: f64,
    perimeter: f64,
}

impl Extent {
    fn of(chart: &Chart, network: &SeamNetwork) -> Self {
        let loops = network.loops(chart.id());
        Self {
            chart: chart.id(),
            area: area_of(chart),
            perimeter: loops.iter().map(|turn| length_of(turn, network)).sum(),
        }
    }

    /// The width of a strip of any length, the radius of a disk.
    fn width(&self) -> f64 {
        2.0 * self.area / self.perimeter
    }
}

/// The largest size of elements along each curve that its charts can do with.
///
/// Loops need a few edges each: Gmsh leaves charts with two nodes on their boundary out, and two charts with the same three
/// nodes become the same triangle. A chart needs elements as small as it is wide, and a curve one edge.
fn wanted_sizes(extents: &[Extent], network: &SeamNetwork) -> Vec<f64> {
    let mut wanted: Vec<f64> = network.curves().iter().map(Curve::length).collect();
    let sheets = sheets(extents.len(), network);
    for extent in extents {
        let across = if sheets[extent.chart.index()] { ACROSS_SHEETS } else { ELEMENTS_ACROSS };
        let width = extent.width() / across;
        for turn in network.loops(extent.chart) {
            let size = width.min(length_of(turn, network) / EDGES_PER_LOOP);
            for passage in turn {
                let known = &mut wanted[passage.curve.index()];
                *known = known.min(size);
            }
        }
    }
    wanted
}

/// Per chart, whether it shares two curves without a common end with another.
fn sheets(charts: usize, network: &SeamNetwork) -> Vec<bool> {
    // The ends of the curves that each pair of charts has been found to share.
    let mut shared: BTreeMap<[usize; 2], Vec<[usize; 2]>> = BTreeMap::new();
    let mut are_sheets = vec![false; charts];
    for curve in network.curves() {
        for [a, b] in pairs_beside(curve) {
            let others = shared.entry([a, b]).or_default();
            if others.iter().any(|other| are_disjoint(*other, curve.ends())) {
                are_sheets[a] = true;
                are_sheets[b] = true;
            }
            others.push(curve.ends());
        }
    }
    are_sheets
}

/// The pairs of charts that meet along a curve, each with the smaller number first. A curve may have more than two sides.
fn pairs_beside(curve: &Curve) -> Vec<[usize; 2]> {
    let mut pairs = Vec::new();
    for first in curve.sides() {
        for second in curve.sides() {
            let pair = [first.chart.index(), second.chart.index()];
            if pair[0] < pair[1] {
                pairs.push(pair);
            }
        }
    }
    pairs
}

/// Whether two curves with these ends have no end in common.
fn are_disjoint(ends: [usize; 2], others: [usize; 2]) -> bool {
    ends.iter().all(|end| !others.contains(end))
}
