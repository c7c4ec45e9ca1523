//! Refinement where a straight part of a curved triangle is not positive.
//!
//! *Red-green* (Bank, Sherman and Weiser 1983, *Refinement algorithms and data structures for regular local mesh
//! refinement*): a part is split into four similar ones (red); where that leaves one node in the middle of a
//! neighbour's side, the neighbour is halved for the time being (green), and where it leaves more, or where a half
//! is not positive, the neighbour is split into four too. Halved parts of edges belong to the surface, not to a
//! triangle, so that triangles in all charts around an edge see the same nodes.
//!
//! New nodes lie on the curved map. Their uv are computed in integers, exactly, from the nodes of the edge or
//! triangle, and rounded once to the grid: triangles on both sides of an edge get the same numbers. Every triangle
//! is decided exactly on these.
//!
//! *It ends.* Halved parts only become more, and are at most [`DEPTH`] deep. For a valid quadratic map F a similar
//! part of diameter h has the orientation det DF h^2 (1 + O(h)): deep enough, all parts and their halves are
//! positive, unless the rounding to 2^-53 is as large as they are. But it may take many: depth and number of halved
//! parts are bounded, and a chart that needs more is named with its triangle.

use super::nodes::{Nodes, on_surface};
use super::{Inverted, LinearChart};
use crate::certified::{CertifiedAtlas, CertifiedChart};
use crate::certify::PlanarMap;
use crate::grid::{GridPoint, orientation};
use crate::mesh::SurfaceMesh;
use crate::topology::{ChartId, FaceId, HalfEdgeId};
use std::collections::{BTreeMap, BTreeSet};

/// How often the four parts of a triangle may be split again. By experience: an edge is then of 512 parts, and a map that
/// needs more had better be replaced by a plainer one.
pub(super) const DEPTH: u32 = 8;

/// Barycentric coordinates are multiples of 2^-`BITS`: every node down to the halves of the deepest parts.
const BITS: u32 = DEPTH + 2;

/// How many parts of edges may be halved for a chart: as many as it has triangles, and in any case this many. A ring of 128
/// triangles of cad_box_multi needs 3,000, and has 39 bad elements by its linear map, none by its own; one of
/// pins_instanced needs 10,000, and its needles make Gmsh's elements worse than its linear map does.
const HALVED: usize = 4_000;

/// A corner of a part: the node, and where it lies in the curved triangle, in units of 2^-`BITS`.
#[derive(Clone, Copy)]
struct Corner {
    node: u32,
    at: [i64; 3],
}

type Part = [Corner; 3];

/// Refines `linear`, the quartered charts, until every triangle turns left. Returns how many curved triangles were
/// split into other than four.
///
/// # Errors
/// The charts that need more than `depth` (at most [`DEPTH`]) splits of a part, or too many of them.
pub(super) fn refine(
    depth: u32,
    atlas: &CertifiedAtlas,
    maps: &[&PlanarMap],
    nodes: &mut Nodes,
    linear: &mut [LinearChart],
) -> Result<usize, Vec<Inverted>> {
    let mut queue = BTreeSet::new();
    for (chart, l) in atlas.charts().iter().zip(linear.iter()) {
        let inverted = l.triangles.iter().zip(&l.faces).filter(|(t, _)| !l.turns_left(**t));
        queue.extend(inverted.map(|(_, f)| chart.chart().faces()[*f as usize].0));
    }
    if queue.is_empty() {
        return Ok(0);
    }
    let mut refiner = Refiner::new(atlas, maps, nodes, linear);
    refiner.deepest = depth.min(DEPTH);
    refiner.run(queue);
    if refiner.failed.is_empty() { Ok(refiner.replace()) } else { Err(refiner.failed.into_values().collect()) }
}

struct Refiner<'a> {
    mesh: &'a SurfaceMesh,
    charts: &'a [CertifiedChart],
    maps: &'a [&'a PlanarMap],
    nodes: &'a mut Nodes,
    linear: &'a mut [LinearChart],
    /// Triangles of the surface to be looked at again, and those that were looked at.
    queue: BTreeSet<u32>,
    walked: BTreeSet<u32>,
    /// Per triangle of the surface, its chart and its number there.
    owner: Vec<(u32, u32)>,
    /// The triangles around each mid-edge node of an edge between charts.
    around: BTreeMap<u32, Vec<u32>>,
    /// Per chart, the parts of edges halved for it.
    halved: Vec<usize>,
    failed: BTreeMap<ChartId, Inverted>,
    deepest: u32,
}

impl<'a> Refiner<'a> {
    fn new(
        atlas: &'a CertifiedAtlas,
        maps: &'a [&'a PlanarMap],
        nodes: &'a mut Nodes,
        linear: &'a mut [LinearChart],
    ) -> Self {
        let (mesh, charts) = (atlas.mesh(), atlas.charts());
        let mut owner = vec![(u32::MAX, 0); mesh.triangles().len()];
        let mut around: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (chart, c) in charts.iter().map(CertifiedChart::chart).zip(0..) {
            chart.faces().iter().zip(0..).for_each(|(face, f)| owner[face.index()] = (c, f));
            for h in chart.boundary() {
                let h = on_surface(chart, h);
                around.entry(nodes.at_middle(mesh, h)).or_default().push(h.face().0);
            }
        }
        let (queue, walked, failed) = (BTreeSet::new(), BTreeSet::new(), BTreeMap::new());
        let halved = vec![0; charts.len()];
        Self { mesh, charts, maps, nodes, linear, queue, walked, owner, around, halved, failed, deepest: DEPTH }
    }

    fn run(&mut self, inverted: BTreeSet<u32>) {
        self.queue = inverted;
        while let Some(face) = self.queue.pop_first() {
            self.walked.insert(face);
            let before = self.nodes.halved();
            for part in self.quarters(face) {
                self.settle(face, part, 0);
            }
            // What one part halved may be a side of another.
            if self.nodes.halved() > before {
                self.queue.insert(face);
            }
        }
    }

    /// The four parts of a triangle of the surface.
    fn quarters(&self, face: u32) -> [Part; 4] {
        let (chart, local) = self.owner[face as usize];
        let cell = self.maps[chart as usize].cells[local as usize];
        let nodes = &self.linear[chart as usize].nodes;
        // Nodes by their numbers in the atlas, not in the chart: both charts at a seam halve the same edges.
        let corner = |k: usize, at: [i64; 3]| Corner { node: nodes[cell[k] as usize], at };
        let one = 1 << BITS;
        let a = corner(0, [one, 0, 0]);
        let b = corner(1, [0, one, 0]);
        let c = corner(2, [0, 0, one]);
        let half = one / 2;
        let ab = corner(3, [half, half, 0]);
        let bc = corner(4, [0, half, half]);
        let ca = corner(5, [half, 0, half]);
        four_parts([a, b, c], [ab, bc, ca])
    }

    /// Splits a part, and its parts in turn, as far as it must be. At most [`DEPTH`] deep. Charts that failed rest.
    fn settle(&mut self, face: u32, part: Part, depth: u32) {
        let (chart, local) = self.owner[face as usize];
        let (id, halved) = (ChartId(chart), self.halved[chart as usize]);
        if self.failed.contains_key(&id) || self.is_settled(face, &part) {
            return;
        }
        if depth == self.deepest || halved > HALVED.max(self.charts[chart as usize].chart().triangles().len()) {
            self.failed.insert(id, Inverted { chart: id, face: FaceId(local), depth: 1 + depth, halved });
            return;
        }
        for k in 0..3 {
            let (a, b) = (part[k], part[(k + 1) % 3]);
            if self.nodes.middle(a.node, b.node).is_none() {
                self.nodes.halve(a.node, b.node);
                self.halved[chart as usize] += 1;
                self.wake(face, a, b);
            }
        }
        for quarter in self.red(&part) {
            self.settle(face, quarter, depth + 1);
        }
    }

    /// Whether a part may stay as it is, or halved: all that comes of it turns left, and no node hangs.
    fn is_settled(&self, face: u32, part: &Part) -> bool {
        let middles = self.middles(part);
        match middles.iter().flatten().count() {
            0 => self.turns_left(face, part),
            1 => self
                .green(part, middles)
                .iter()
                .all(|half| self.turns_left(face, half) && self.middles(half).iter().all(Option::is_none)),
            _ => false,
        }
    }

    fn middles(&self, part: &Part) -> [Option<Corner>; 3] {
        [0, 1, 2].map(|k| {
            let (a, b) = (part[k], part[(k + 1) % 3]);
            let at = [0, 1, 2].map(|i| (a.at[i] + b.at[i]) / 2);
            self.nodes.middle(a.node, b.node).map(|node| Corner { node, at })
        })
    }

    /// The two halves of a part of which one side is halved.
    fn green(&self, part: &Part, middles: [Option<Corner>; 3]) -> Vec<Part> {
        let halves = |k: usize, m: Corner| {
            let [a, b, c] = [part[k], part[(k + 1) % 3], part[(k + 2) % 3]];
            [[a, m, c], [m, b, c]]
        };
        (0..3).filter_map(|k| Some(halves(k, middles[k]?))).flatten().collect()
    }

    /// The four parts of a part of which all sides are halved; none where they are not.
    fn red(&self, part: &Part) -> Vec<Part> {
        let [Some(ab), Some(bc), Some(ca)] = self.middles(part) else { return vec![] };
        four_parts(*part, [ab, bc, ca]).to_vec()
    }

    /// Queues the other triangles at the edge that the part of an edge from `a` to `b` belongs to.
    fn wake(&mut self, face: u32, a: Corner, b: Corner) {
        // Both lie on the side across from a corner of which neither has a share; else the part lies inside the triangle.
        let Some(opposite) = (0..3).find(|i| a.at[*i] == 0 && b.at[*i] == 0) else { return };
        let h = HalfEdgeId::side_of(FaceId(face), (opposite + 1) % 3);
        let middle = self.nodes.at_middle(self.mesh, h);
        match self.around.get(&middle) {
            // At a seam there may be more than two sheets.
            Some(faces) => self.queue.extend(faces.iter().filter(|f| **f != face)),
            None => {
                let beyond = self.mesh.edges().twin(h);
                self.queue.extend(beyond.map(|twin| twin.face().0));
            }
        }
    }

    fn turns_left(&self, face: u32, part: &Part) -> bool {
        let [a, b, c] = part.map(|corner| self.uv_at(face, corner.at));
        orientation(a, b, c) > 0
    }

    fn uv_at(&self, face: u32, at: [i64; 3]) -> GridPoint {
        let (chart, local) = self.owner[face as usize];
        let map = self.maps[chart as usize];
        uv_at(map.cells[local as usize].map(|n| map.nodes[n as usize]), at)
    }

    /// Replaces the triangles of all curved triangles that were looked at. Returns how many of these there are.
    fn replace(self) -> usize {
        let mut per_chart: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for face in &self.walked {
            let (chart, local) = self.owner[*face as usize];
            per_chart.entry(chart).or_default().push(local);
        }
        for (chart, faces) in per_chart {
            let fresh = self.replaced(chart as usize, &faces);
            self.linear[chart as usize] = fresh;
        }
        self.walked.len()
    }

    /// A chart with the given triangles, ascending, refined.
    fn replaced(&self, chart: usize, faces: &[u32]) -> LinearChart {
        let (old, cells) = (&self.linear[chart], &self.maps[chart].cells);
        let kept = old.triangles.iter().zip(&old.faces).filter(|(_, f)| faces.binary_search(f).is_err());
        let (triangles, of) = kept.map(|(t, f)| (*t, *f)).unzip();
        let mut fresh =
            LinearChart { nodes: old.nodes.clone(), uv: old.uv.clone(), triangles, faces: of, uv_scale: old.uv_scale };
        let corners = faces.iter().flat_map(|f| cells[*f as usize]);
        let mut local: BTreeMap<u32, u32> = corners.map(|n| (old.nodes[n as usize], n)).collect();
        for f in faces {
            let face = self.charts[chart].chart().faces()[*f as usize].0;
            for part in self.quarters(face).iter().flat_map(|q| self.leaves(q)) {
                let triangle = part.map(|corner| {
                    *local.entry(corner.node).or_insert_with(|| {
                        fresh.nodes.push(corner.node);
                        fresh.uv.push(self.uv_at(face, corner.at));
                        fresh.nodes.len() as u32 - 1
                    })
                });
                fresh.triangles.push(triangle);
                fresh.faces.push(*f);
            }
        }
        fresh
    }

    /// The triangles that a part ends as. As deep as [`Self::settle`].
    fn leaves(&self, part: &Part) -> Vec<Part> {
        let middles = self.middles(part);
        match middles.iter().flatten().count() {
            0 => vec![*part],
            1 => self.green(part, middles),
            _ => self.red(part).iter().flat_map(|q| self.leaves(q)).collect(),
        }
    }
}

/// The parts of a triangle with these corners and middles of the sides 01, 12, 20: those at the corners, then the inner one.
fn four_parts([a, b, c]: Part, [ab, bc, ca]: [Corner; 3]) -> [Part; 4] {
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// The uv of the point with barycentric coordinates `at` (in units of 2^-`BITS`) of a curved triangle: exact,
/// then rounded to a double that is a multiple of 2^-53.
fn uv_at(nodes: [GridPoint; 6], at: [i64; 3]) -> GridPoint {
    let one = 1_i128 << BITS;
    let l = at.map(i128::from);
    let weights = [
        l[0] * (2 * l[0] - one),
        l[1] * (2 * l[1] - one),
        l[2] * (2 * l[2] - one),
        4 * l[0] * l[1],
        4 * l[1] * l[2],
        4 * l[2] * l[0],
    ];
    let sum = |coordinate: fn(&GridPoint) -> i64| {
        let exact: i128 = nodes.iter().zip(weights).map(|(n, w)| w * i128::from(coordinate(n))).sum();
        // Weights are below 2^(2 BITS + 2) and coordinates below 2^55: after the shift the sum fits again.
        ((exact + (1 << (2 * BITS - 1))) >> (2 * BITS)) as i64
    };
    let rounded = GridPoint { x: sum(|p| p.x), y: sum(|p| p.y) };
    // Beyond 1, doubles are coarser than the grid.
    GridPoint::mid(rounded.uv())
}
