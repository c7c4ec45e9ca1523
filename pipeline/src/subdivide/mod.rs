//! Subdivide: certified quadratic maps -> a linear triangulation that a mesher can remesh through.
//!
//! Charts that are nearly planes come with their projection, which is certified, too, and keeps the shape of their boundary.
//! Others are handed over by their quadratic map.
//!
//! A curved triangle whose map is as good as linear becomes one straight one, and any other four between its six nodes; in
//! space, mid-edge nodes lie in the middle of straight edges. A curved triangle can be valid although one of the straight ones is
//! not: there it is refined until all are positive, decided exactly on the numbers that are kept. Where that would take too many
//! parts (a curved triangle may be valid by a hair along a whole side) the chart is handed over by the map from which
//! its untangling started: it is certified too, and its triangles are straight. Where even its curved sides at the
//! boundary need too many, their chords take their place, and that map is certified anew: its parts are similar to its
//! triangles, so they turn left wherever these do, unless its neighbours have its boundary cut so small that the grid
//! is too coarse for it: then they get a plainer map, too. Nodes on seams are the same numbers in
//! all charts, and a curve is exactly the sides of the triangles along it: nothing cracks or overlaps.
//!
//! Meshers compute normals from the numbers as written and fail where one is exactly zero: in this copy, and only
//! here, such a triangle has one node moved by 1e-12 of the bounding box.
//!
//! A [`LinearAtlas`] can only be made from certified maps.

mod nodes;
mod normals;
mod refine;

use crate::certified::CertifiedAtlas;
use crate::certify::{BoundaryArgument, CertifiedMap, PlanarMap, StraightMap, polygons, prove};
use crate::grid::GridPoint;
use crate::measure::curvature::Principal;
use crate::seams::{Passage, SeamNetwork};
use crate::topology::{ChartId, CurveId, FaceId, VertexId};
use crate::vec3::Vec3;
use nodes::Nodes;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

/// The charts of a surface as linear triangulations that share the nodes on their seams.
#[derive(Clone, Debug)]
pub struct LinearAtlas {
    points: Vec<Vec3>,
    /// Per point.
    curvatures: Vec<Principal>,
    charts: Vec<LinearChart>,
    /// Per curve of the network, the points along it.
    curves: Vec<Vec<u32>>,
    /// The charts that are handed over by the straight map that was given for them.
    straight: Vec<ChartId>,
    /// The charts that are handed over by the map from which their untangling started, with arcs or with chords.
    linear: Vec<ChartId>,
    refined: usize,
    moved: usize,
}

/// One chart: a triangulation in space and in the plane.
#[derive(Clone, Debug, Default)]
pub struct LinearChart {
    /// Per node of the chart, the point of the atlas.
    nodes: Vec<u32>,
    /// Per node of the chart.
    uv: Vec<GridPoint>,
    /// By nodes of the chart.
    triangles: Vec<[u32; 3]>,
    /// Per triangle, the curved triangle of the chart that it is a part of.
    faces: Vec<u32>,
    /// A power of two.
    uv_scale: f64,
}

/// Why charts cannot be handed over as linear triangulations.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A chart lies on both sides of a curve: meshers cannot tell its two images in the plane apart.
    #[error("chart {chart} lies on both sides of curve {curve}")]
    MeetsItself {
        /// The chart.
        chart: ChartId,
        /// The curve.
        curve: CurveId,
    },
    /// The boundary of a chart passes a point twice: meshers cannot tell its two images in the plane apart.
    #[error("the boundary of chart {chart} passes twice through the place of vertex {vertex}")]
    Pinched {
        /// The chart.
        chart: ChartId,
        /// A vertex of the surface there.
        vertex: VertexId,
    },
    /// The boundary of a chart touches itself in the plane once its curves are halved as its neighbours need, and the new
    /// nodes are rounded.
    #[error("the boundary of chart {chart} touches itself in the plane where its curves are halved")]
    Touches {
        /// The chart.
        chart: ChartId,
    },
    /// Straight parts of a curved triangle stay inverted, in the quadratic and in the linear map.
    #[error(transparent)]
    Inverted(#[from] Inverted),
    /// A triangle has no normal in doubles, wherever its nodes move.
    #[error("triangle {face} of chart {chart} has no normal in double precision: its size is beyond it")]
    NoNormal {
        /// The chart.
        chart: ChartId,
        /// The triangle, numbered within the chart.
        face: FaceId,
    },
}

/// A triangle whose straight parts are inverted as far as it may be refined.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("triangle {face} of chart {chart} has inverted straight parts after {depth} halvings, {halved} in its chart")]
pub struct Inverted {
    /// The chart.
    pub chart: ChartId,
    /// The triangle, numbered within the chart.
    pub face: FaceId,
    /// How often it was halved.
    pub depth: u32,
    /// How many parts of edges were halved for the chart.
    pub halved: usize,
}

impl LinearAtlas {
    /// The positions of the nodes that charts share, and of others that none uses.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The largest and smallest principal curvature at each node.
    pub fn curvatures(&self) -> &[Principal] {
        &self.curvatures
    }

    /// The charts, in the order of their ids.
    pub fn charts(&self) -> &[LinearChart] {
        &self.charts
    }

    /// The nodes along each curve of the network, from begin to end.
    pub fn curves(&self) -> &[Vec<u32>] {
        &self.curves
    }

    /// The number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.charts.iter().map(|c| c.triangles.len()).sum()
    }

    /// The charts that are handed over by the map that was given for them, ascending.
    pub fn straight_charts(&self) -> &[ChartId] {
        &self.straight
    }

    /// The charts that are handed over by their linear map, ascending.
    pub fn linear_charts(&self) -> &[ChartId] {
        &self.linear
    }

    /// How many triangles were split into more than four.
    pub fn refined(&self) -> usize {
        self.refined
    }

    /// How many nodes were moved so that every triangle has a normal.
    pub fn moved(&self) -> usize {
        self.moved
    }
}

impl LinearChart {
    /// Per node of the chart, the node of the atlas.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Per node of the chart, its uv.
    pub fn uv(&self) -> &[GridPoint] {
        &self.uv
    }

    /// By how much the plane must grow for the chart to have its own size there: the
    /// [`uv_scale`](crate::measure::scale::uv_scale) of the map by which it is handed over.
    pub fn uv_scale(&self) -> f64 {
        self.uv_scale
    }

    /// Per triangle, the triangle of the certified chart that it is a part of.
    pub fn faces(&self) -> &[u32] {
        &self.faces
    }

    /// The triangles, by nodes of the chart, all turning left in the plane.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}

/// Turns the maps of an atlas into linear triangulations. Charts with a map in `straight` are handed over by that one, if it
/// can be.
///
/// # Errors
/// [`Error`]: this surface cannot be handed over in this form; the maps are none the worse.
///
/// # Panics
/// If `straight` has not one entry for every chart, or a map of another chart.
///
/// # Example
///
/// A torus in up to four straight triangles for each of its own, and the nodes on its seams shared by the charts beside them.
///
/// ```
/// use planish_core::grid::orientation;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{Settings, parametrize, shapes, subdivide};
///
/// let atlas = parametrize(&shapes::ring_torus(12, 8), &Settings::default(), &NoMonitor)?;
/// let linear = subdivide(&atlas, &vec![None; atlas.charts().len()])?;
/// let triangles = atlas.mesh().triangles().len();
/// assert!((triangles..=4 * triangles).contains(&linear.triangle_count()));
/// for chart in linear.charts() {
///     // In the plane every triangle turns left, exactly.
///     assert!(chart.triangles().iter().all(|t| {
///         let [a, b, c] = t.map(|n| chart.uv()[n as usize]);
///         orientation(a, b, c) > 0
///     }));
/// }
/// // The nodes of a curve are nodes of the charts on both of its sides.
/// for (curve, nodes) in atlas.seams().curves().iter().zip(linear.curves()) {
///     for side in curve.sides() {
///         let of_chart = linear.charts()[side.chart.index()].nodes();
///         assert!(nodes.iter().all(|n| of_chart.contains(n)));
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn subdivide(atlas: &CertifiedAtlas, straight: &[Option<&StraightMap>]) -> Result<LinearAtlas, Error> {
    let mesh = atlas.mesh();
    assert_eq!(straight.len(), atlas.charts().len(), "an entry for every chart");
    for (certified, straight) in atlas.charts().iter().zip(straight) {
        let is_of_chart = straight.is_none_or(|map| map.map().cells == certified.map().map().cells);
        assert!(is_of_chart, "the straight map of chart {} is that of another one", certified.id());
    }
    refuse_self_contact(atlas.seams(), atlas.charts().len())?;
    let Split { nodes, charts, by, refined } = split(atlas, straight)?;
    let mut straight = Vec::new();
    let mut linear = Vec::new();
    for (chart, by) in (0..).map(ChartId).zip(by) {
        match by {
            HandedOver::Straight => straight.push(chart),
            HandedOver::Certified => {}
            HandedOver::Start | HandedOver::Chords => linear.push(chart),
        }
    }
    let mut points = nodes.positions(mesh);
    let moved = normals::separate(&mut points, &charts, mesh.bounding_box().diagonal())?;
    let curves = atlas.seams().curves().iter().map(|c| nodes.along(c)).collect();
    Ok(LinearAtlas { curvatures: nodes.curvatures(mesh), points, charts, curves, straight, linear, refined, moved })
}

/// Charts whose triangles all turn left, and how they came about.
struct Split {
    nodes: Nodes,
    charts: Vec<LinearChart>,
    by: Vec<HandedOver>,
    refined: usize,
}

/// By which of its maps a chart is handed over, from the best to the plainest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum HandedOver {
    /// A map by straight triangles that was given for it.
    Straight,
    /// The certified map.
    Certified,
    /// The map from which untangling started: straight triangles, arcs along the boundary.
    Start,
    /// The same with chords instead of arcs.
    Chords,
}

/// A proven map of a chart.
enum Proven<'a> {
    Straight(&'a StraightMap),
    Quadratic(Cow<'a, CertifiedMap>),
}

impl Proven<'_> {
    /// Whether the polygon through the nodes of its boundary is simple by what was proven: not where loops of arcs were
    /// proven to be simple as they are bent.
    fn is_proven_as_polygon(&self) -> bool {
        match self {
            Self::Straight(_) => true,
            Self::Quadratic(map) => {
                map.certificate().boundary == BoundaryArgument::StarShaped || map.map().boundary_is_in_chords()
            }
        }
    }

    fn map(&self) -> &PlanarMap {
        match self {
            Self::Straight(map) => map.map(),
            Self::Quadratic(map) => map.map(),
        }
    }
}

/// Splits the triangles of all charts. A chart that needs too many parts gets a plainer map, and all begins again: at
/// most four times for each chart.
fn split(atlas: &CertifiedAtlas, straight: &[Option<&StraightMap>]) -> Result<Split, Error> {
    let (charts, network) = (atlas.charts(), atlas.seams());
    let certified = |c: usize| Proven::Quadratic(Cow::Borrowed(charts[c].map()));
    let started = |c: usize| Proven::Quadratic(Cow::Borrowed(charts[c].start()));
    let first = |c: usize| match straight[c] {
        Some(map) => (HandedOver::Straight, Proven::Straight(map)),
        None => (HandedOver::Certified, certified(c)),
    };
    let (mut by, mut chosen): (Vec<HandedOver>, Vec<Proven>) = (0..charts.len()).map(first).unzip();
    // The charts in which no triangle stays whole.
    let mut fine = vec![false; charts.len()];
    // It ends: in each turn a chart becomes fine, or gets a plainer map, and there are four kinds of them.
    loop {
        let mut nodes = Nodes::new(atlas);
        let current: Vec<&PlanarMap> = chosen.iter().map(Proven::map).collect();
        let failed = match refine::triangulate(refine::DEPTH, atlas, &current, &fine, &mut nodes) {
            Ok((split, refined)) => {
                // The polygon that was proven may have got more nodes, which are rounded.
                let touches = |c: &usize| {
                    let is_proven = chosen[*c].is_proven_as_polygon();
                    touches_itself(&split[*c], ChartId::at(*c), is_proven, network, &nodes)
                };
                let touching: Vec<usize> = (0..by.len()).filter(touches).collect();
                if touching.is_empty() {
                    return Ok(Split { nodes, charts: split, by, refined });
                }
                for chart in touching {
                    // Chords of whole edges may cross where those of halves do not.
                    if !std::mem::replace(&mut fine[chart], true) {
                        continue;
                    }
                    (by[chart], chosen[chart]) = match by[chart] {
                        HandedOver::Straight => (HandedOver::Certified, certified(chart)),
                        // Its neighbours may halve less when it is plainer itself.
                        HandedOver::Certified => (HandedOver::Start, started(chart)),
                        HandedOver::Start | HandedOver::Chords => {
                            return Err(Error::Touches { chart: ChartId::at(chart) });
                        }
                    };
                }
                continue;
            }
            Err(failed) => failed,
        };
        for (chart, inverted) in blamed(failed, &by, network, &nodes)? {
            let start = charts[chart].start();
            (by[chart], chosen[chart]) = match by[chart] {
                HandedOver::Straight => (HandedOver::Certified, certified(chart)),
                HandedOver::Certified => (HandedOver::Start, started(chart)),
                HandedOver::Start | HandedOver::Chords => {
                    let chords = with_chords(start).ok_or(inverted)?;
                    (HandedOver::Chords, Proven::Quadratic(Cow::Owned(chords)))
                }
            };
        }
    }
}

/// Whether the boundary of a chart crosses or touches itself in the plane. Where it `is_proven` that the polygon through
/// vertices and middles of edges does not, it is looked at only if there are other nodes than these: new ones are rounded to
/// the grid.
fn touches_itself(chart: &LinearChart, id: ChartId, is_proven: bool, network: &SeamNetwork, nodes: &Nodes) -> bool {
    let curve = |p: &Passage| &network.curves()[p.curve.index()];
    if is_proven && network.loops(id).iter().flatten().all(|p| nodes.is_in_halves(curve(p))) {
        return false;
    }
    let uv_of: BTreeMap<u32, GridPoint> = chart.nodes.iter().copied().zip(chart.uv.iter().copied()).collect();
    let mut polygons = Vec::new();
    for boundary_loop in network.loops(id) {
        let mut polygon = Vec::new();
        for passage in boundary_loop {
            let mut along = nodes.along(curve(passage));
            if !passage.forward {
                along.reverse();
            }
            // The next passage begins where this one ends.
            along.pop();
            polygon.extend(along.iter().map(|n| uv_of[n]));
        }
        polygons.push(polygon);
    }
    polygons::check(&polygons).is_some()
}

/// The charts that need a plainer map, so that those that `failed` come out right.
///
/// That is a chart itself, unless it has the plainest map already: its parts turn left then, all by themselves, and
/// only what its neighbours halved for their own sake has cut them so small that the grid is too coarse for them.
///
/// # Errors
/// A chart that failed, and no chart is left that could be plainer.
fn blamed(
    failed: Vec<Inverted>,
    by: &[HandedOver],
    network: &SeamNetwork,
    nodes: &Nodes,
) -> Result<BTreeMap<usize, Inverted>, Inverted> {
    let mut blamed = BTreeMap::new();
    // Found once, where it is asked for at all.
    let mut halved = None;
    for inverted in failed {
        let chart = inverted.chart.index();
        if by[chart] != HandedOver::Chords {
            blamed.insert(chart, inverted);
            continue;
        }
        let halved = halved.get_or_insert_with(|| beside_halved_curves(by.len(), network, nodes));
        let nearest = nearest(chart, halved, |c| by[c] != HandedOver::Chords);
        if nearest.is_empty() {
            return Err(inverted);
        }
        for chart in nearest {
            blamed.entry(chart).or_insert_with(|| inverted.clone());
        }
    }
    Ok(blamed)
}

/// Per chart, those on the other side of curves of which halves of edges were halved.
fn beside_halved_curves(charts: usize, network: &SeamNetwork, nodes: &Nodes) -> Vec<BTreeSet<usize>> {
    let mut beside = vec![BTreeSet::new(); charts];
    for curve in network.curves().iter().filter(|c| nodes.is_cut(c)) {
        for a in curve.sides() {
            for b in curve.sides() {
                beside[a.chart.index()].insert(b.chart.index());
            }
        }
    }
    beside
}

/// The charts that are `wanted` in the fewest steps from one to its neighbours that reach any.
fn nearest(from: usize, neighbours: &[BTreeSet<usize>], wanted: impl Fn(usize) -> bool) -> Vec<usize> {
    let mut seen = BTreeSet::from([from]);
    let mut ring = vec![from];
    while !ring.is_empty() {
        let next = ring.iter().flat_map(|c| &neighbours[*c]).copied();
        let next: BTreeSet<usize> = next.filter(|c| !seen.contains(c)).collect();
        let found: Vec<usize> = next.iter().copied().filter(|c| wanted(*c)).collect();
        if !found.is_empty() {
            return found;
        }
        seen.extend(&next);
        ring = next.into_iter().collect();
    }
    vec![]
}

/// A map with every mid-edge node in the middle of its edge, certified anew; none where it is not one-to-one.
fn with_chords(map: &CertifiedMap) -> Option<CertifiedMap> {
    let map = map.map();
    let mut nodes = map.nodes.clone();
    for [a, b, c, ab, bc, ca] in &map.cells {
        for (mid, ends) in [(ab, [a, b]), (bc, [b, c]), (ca, [c, a])] {
            let [from, to] = ends.map(|n| map.nodes[*n as usize]);
            nodes[*mid as usize] = from.midpoint(to);
        }
    }
    prove(PlanarMap { nodes, ..map.clone() }).ok()
}

/// Refuses charts whose boundary touches itself in space: a place on it has two images in the plane.
fn refuse_self_contact(network: &SeamNetwork, charts: usize) -> Result<(), Error> {
    for curve in network.curves() {
        if let Some(twice) = curve.sides().windows(2).find(|w| w[0].chart == w[1].chart) {
            return Err(Error::MeetsItself { chart: twice[0].chart, curve: curve.id() });
        }
    }
    for chart in (0..charts).map(ChartId::at) {
        let begin = |p: &Passage| network.curves()[p.curve.index()].ends()[usize::from(!p.forward)];
        let mut passed: Vec<usize> = network.loops(chart).iter().flatten().map(begin).collect();
        passed.sort_unstable();
        if let Some(twice) = passed.windows(2).find(|w| w[0] == w[1]) {
            return Err(Error::Pinched { chart, vertex: network.points()[twice[0]].vertex });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
