//! Where elements must be smaller than asked for: along narrow charts and curves, in small charts, and where the boundary of a
//! chart passes close to itself.

use super::gmsh::area_of;
use crate::formats::gmsh::{self, Ball};
use planish_core::CertifiedChart;
use planish_core::atlas::Chart;
use planish_core::certified::NARROW;
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

/// So many places altogether, the narrowest: Gmsh asks every size field at every step, and spends as much time on these as on
/// the rest (truck_nonmanifold with 2,000: 46 s of CPU in place of 6).
const MOST_PLACES: usize = 400;

/// Where a place already has elements smaller than so many times what it needs, nothing is added.
const CLOSE: f64 = 1.5;

/// How far smaller elements reach around a place, in their sizes: an edge on either side of the middle one.
const REACH: f64 = 2.0;

/// Where elements are smaller, and how small.
pub(super) struct Places {
    /// Around curves, and in charts.
    pub narrow: Vec<gmsh::Narrow>,
    /// Around places on curves.
    pub balls: Vec<Ball>,
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
    let balls = balls(mesh, &extents, network, size, &mut wanted);
    Places { narrow: narrow(&extents, network, adapted, size, &wanted), balls }
}

/// Balls around the places where boundaries pass close to themselves, but where the sizes `wanted` along the curves see to
/// that; those are lowered where half of a curve is as narrow.
fn balls(mesh: &SurfaceMesh, extents: &[Extent], network: &SeamNetwork, size: f64, wanted: &mut [f64]) -> Vec<Ball> {
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
    spread(places, MOST_PLACES).into_iter().map(|place| place.ball(size)).collect()
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

impl Place {
    /// The ball around it, from which elements grow up to `size`.
    fn ball(self, size: f64) -> Ball {
        let thickness = (size - self.size) / gmsh::Narrow::GRADATION;
        Ball { centre: self.at, radius: REACH * self.size, thickness, size: self.size }
    }
}

/// Whether elements of the size that a curve gets are small enough.
fn is_enough(needed: f64, size: f64, wanted: f64, length: f64) -> bool {
    along(size, wanted, length) < CLOSE * needed
}

/// The size that elements along a curve get.
fn along(size: f64, wanted: f64, length: f64) -> f64 {
    match class_along(size, wanted, length) {
        Some(class) => size * 0.5_f64.powi(class as i32 + 1),
        None => size,
    }
}

/// The class of a curve: however narrow the place, no smaller than gives [`MOST_EDGES`].
fn class_along(size: f64, wanted: f64, length: f64) -> Option<usize> {
    size_class(size, wanted.max(length / MOST_EDGES))
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

/// The curves along narrow places and the small charts, by the size of elements there: half of `size`, a quarter, and so on.
fn narrow(
    extents: &[Extent],
    network: &SeamNetwork,
    adapted: &[usize],
    size: f64,
    wanted: &[f64],
) -> Vec<gmsh::Narrow> {
    let mut found = Vec::new();
    for halvings in 1..=gmsh::Narrow::HALVINGS {
        found.push(gmsh::Narrow { size: size * 0.5_f64.powi(halvings as i32), ..gmsh::Narrow::default() });
    }
    for (curve, wanted) in network.curves().iter().zip(wanted) {
        if let Some(class) = class_along(size, *wanted, curve.length()) {
            found[class].curves.push(curve.id().index());
            found[class].longest = found[class].longest.max(curve.length());
        }
    }
    for Extent { chart, area, perimeter } in extents.iter().copied() {
        // Larger ones have smaller elements along their curves only.
        if area > SMALL * size * size {
            continue;
        }
        let is_adapted = adapted.binary_search(&chart.index()).is_ok();
        let inside = if is_adapted { 0.5 * size } else { size };
        if let Some(class) = size_class(size, inside.min(perimeter / EDGES_PER_LOOP)) {
            found[class].surfaces.push(chart.index());
        }
    }
    found.retain(|n| !n.curves.is_empty() || !n.surfaces.is_empty());
    found
}

/// The class for elements of the `wanted` size: 0 for half of `size`, 1 for a quarter, and so on; none where `size` itself
/// will do.
fn size_class(size: f64, wanted: f64) -> Option<usize> {
    if wanted < NARROW * size {
        let halvings = (size / wanted).log2().round();
        Some(halvings.clamp(1.0, f64::from(gmsh::Narrow::HALVINGS)) as usize - 1)
    } else {
        None
    }
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
