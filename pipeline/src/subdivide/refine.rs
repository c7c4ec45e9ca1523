//! Which triangles stay whole, which become four, and refinement where a straight part of one is not positive.
//!
//! A curved triangle stays one straight triangle where its map is as good as linear ([`BEND`]), and becomes four between its
//! six nodes elsewhere. From there on, *red-green* (Bank, Sherman and Weiser 1983, *Refinement algorithms and data structures
//! for regular local mesh refinement*): a part is split into four similar ones (red); where that leaves one node in the
//! middle of a neighbour's side, the neighbour is halved for the time being (green), and where it leaves more, or where a
//! half is not positive, the neighbour is split into four too. Halved edges and parts of edges belong to the surface, not to
//! a triangle, so that triangles in all charts around an edge see the same nodes.
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
use crate::measure::scale::uv_scale;
use crate::mesh::SurfaceMesh;
use crate::topology::{ChartId, FaceId, HalfEdgeId};
use std::collections::{BTreeMap, BTreeSet};

/// How often the four parts of a triangle may be split again. By experience: an edge is then of 512 parts, and a map that
/// needs more had better be replaced by a plainer one.
pub(super) const DEPTH: u32 = 8;

/// Barycentric coordinates are multiples of 2^-`BITS`: every node down to the halves of the deepest parts.
const BITS: u32 = DEPTH + 2;

/// The barycentric coordinate of a corner.
const ONE: i64 = 1 << BITS;

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

/// How far a middle of a side may be from the middle of its chord, relative to the least height of the straight triangle, for
/// the triangle to stay whole. The differential of the straight map then differs from that of the curved one by at most 8 times
/// as much in any direction: most at a corner, of the two sides there. By experience: surfaces of 100,000
/// triangles come to 1.0 to 1.7 for each, and of 42 meshes of Gmsh none is worse for it.
const BEND: f64 = 1.0 / 32.0;

/// Charts of fewer triangles are split into four everywhere: that costs next to nothing.
pub(super) const FEW: usize = 500;

/// Triangulates all charts by straight triangles that turn left; in those that are `fine` no triangle stays whole. Returns
/// the charts, and how many curved triangles were split into more than four.
///
/// # Errors
/// The charts that need more than `depth` (at most [`DEPTH`]) splits of a part, or too many of them.
pub(super) fn triangulate(
    depth: u32,
    atlas: &CertifiedAtlas,
    maps: &[&PlanarMap],
    fine: &[bool],
    nodes: &mut Nodes,
) -> Result<(Vec<LinearChart>, usize), Vec<Inverted>> {
    let mut refiner = Refiner::new(atlas, maps, nodes);
    refiner.deepest = depth.min(DEPTH) + 1;
    refiner.split_bent(fine);
    refiner.run();
    if !refiner.failed.is_empty() {
        return Err(refiner.failed.into_values().collect());
    }
    let built = (0..maps.len()).map(|chart| refiner.built(chart));
    let (charts, refined): (Vec<LinearChart>, Vec<usize>) = built.unzip();
    Ok((charts, refined.iter().sum()))
}

struct Refiner<'a> {
    mesh: &'a SurfaceMesh,
    charts: &'a [CertifiedChart],
    maps: &'a [&'a PlanarMap],
    nodes: &'a mut Nodes,
    /// Per chart, the node of the surface at each of its nodes.
    on_surface: Vec<Vec<u32>>,
    /// Triangles of the surface to be looked at again.
    queue: BTreeSet<u32>,
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
    fn new(atlas: &'a CertifiedAtlas, maps: &'a [&'a PlanarMap], nodes: &'a mut Nodes) -> Self {
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
        let of_chart = |(c, map): (&CertifiedChart, &&PlanarMap)| {
            let chart = c.chart();
            assert_eq!(map.nodes.len(), chart.vertices().len() + chart.edges().len(), "the map of this chart");
            nodes.of_chart(mesh, chart)
        };
        let on_surface = charts.iter().zip(maps).map(of_chart).collect();
        let halved = vec![0; charts.len()];
        let (queue, failed) = (BTreeSet::new(), BTreeMap::new());
        Self { mesh, charts, maps, nodes, on_surface, queue, owner, around, halved, failed, deepest: DEPTH + 1 }
    }

    /// Splits the edges of triangles that are too bent to stay whole, and all of those of charts that are `fine` or small.
    fn split_bent(&mut self, fine: &[bool]) {
        for (c, chart) in self.charts.iter().enumerate() {
            let (faces, map) = (chart.chart().faces(), self.maps[c]);
            let is_fine = fine[c] || faces.len() < FEW;
            for (face, cell) in faces.iter().zip(&map.cells) {
                let is_bent = if is_fine { [true; 3] } else { bent(cell.map(|n| map.nodes[n as usize].uv())) };
                for side in (0..3).filter(|k| is_bent[*k]) {
                    self.nodes.split(self.mesh, HalfEdgeId::side_of(*face, side));
                }
            }
        }
    }

    fn run(&mut self) {
        let all = 0..self.owner.len() as u32;
        let is_open = |face: &u32| {
            self.owner[*face as usize].0 != u32::MAX && {
                let whole = self.whole(*face);
                match self.middles(*face, &whole).iter().flatten().count() {
                    // The four parts of a triangle of which nothing is halved further.
                    3 => !self.red(*face, &whole).iter().all(|part| self.turns_left(*face, part)),
                    _ => !self.is_settled(*face, &whole),
                }
            }
        };
        self.queue = all.filter(is_open).collect();
        while let Some(face) = self.queue.pop_first() {
            let before = self.nodes.halved();
            self.settle(face, self.whole(face), 0);
            // What one part halved may be a side of another.
            if self.nodes.halved() > before {
                self.queue.insert(face);
            }
        }
    }

    /// A triangle of the surface as a part of itself.
    fn whole(&self, face: u32) -> Part {
        let (chart, local) = self.owner[face as usize];
        let cell = self.maps[chart as usize].cells[local as usize];
        // Nodes by their numbers in the atlas, not in the chart: both charts at a seam halve the same edges.
        [0, 1, 2].map(|k| {
            let mut at = [0; 3];
            at[k] = ONE;
            Corner { node: self.on_surface[chart as usize][cell[k] as usize], at }
        })
    }

    /// Splits a part, and its parts in turn, as far as it must be. At most [`DEPTH`] deep below the four parts of a triangle.
    /// Charts that failed rest.
    fn settle(&mut self, face: u32, part: Part, depth: u32) {
        let (chart, local) = self.owner[face as usize];
        let (id, halved) = (ChartId(chart), self.halved[chart as usize]);
        if self.failed.contains_key(&id) || self.is_settled(face, &part) {
            return;
        }
        if depth == self.deepest || halved > HALVED.max(self.charts[chart as usize].chart().triangles().len()) {
            self.failed.insert(id, Inverted { chart: id, face: FaceId(local), depth, halved });
            return;
        }
        for k in 0..3 {
            self.halve(face, part[k], part[(k + 1) % 3]);
        }
        for quarter in self.red(face, &part) {
            self.settle(face, quarter, depth + 1);
        }
    }

    /// Halves a side of a part, if it is not yet, and has the triangles beyond it looked at.
    fn halve(&mut self, face: u32, a: Corner, b: Corner) {
        if self.middle(face, a, b).is_some() {
            return;
        }
        match side_between(a, b) {
            Some(side) => self.nodes.split(self.mesh, HalfEdgeId::side_of(FaceId(face), side)),
            None => {
                self.nodes.halve(a.node, b.node);
                self.halved[self.owner[face as usize].0 as usize] += 1;
            }
        }
        self.wake(face, a, b);
    }

    /// Whether a part may stay as it is, or halved: all that comes of it turns left, and no node hangs.
    fn is_settled(&self, face: u32, part: &Part) -> bool {
        let middles = self.middles(face, part);
        match middles.iter().flatten().count() {
            0 => self.turns_left(face, part),
            1 => self
                .green(part, middles)
                .iter()
                .all(|half| self.turns_left(face, half) && self.middles(face, half).iter().all(Option::is_none)),
            _ => false,
        }
    }

    fn middles(&self, face: u32, part: &Part) -> [Option<Corner>; 3] {
        [0, 1, 2].map(|k| self.middle(face, part[k], part[(k + 1) % 3]))
    }

    /// The middle of a side of a part, where that is halved.
    fn middle(&self, face: u32, a: Corner, b: Corner) -> Option<Corner> {
        let node = match side_between(a, b) {
            Some(side) => self.nodes.split_at(self.mesh, HalfEdgeId::side_of(FaceId(face), side)),
            None => self.nodes.middle(a.node, b.node),
        };
        node.map(|node| Corner { node, at: [0, 1, 2].map(|i| (a.at[i] + b.at[i]) / 2) })
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
    fn red(&self, face: u32, part: &Part) -> Vec<Part> {
        let [Some(ab), Some(bc), Some(ca)] = self.middles(face, part) else { return vec![] };
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
        let cell = &map.cells[local as usize];
        match node_at(at) {
            Some(k) => map.nodes[cell[k] as usize],
            None => uv_at(cell.map(|n| map.nodes[n as usize]), at),
        }
    }

    /// A chart in its straight triangles, and how many of its curved ones came apart into more than four.
    fn built(&self, number: usize) -> (LinearChart, usize) {
        let (chart, map) = (self.charts[number].chart(), self.maps[number]);
        let (on_surface, vertices) = (&self.on_surface[number], chart.vertices().len());
        let mut built = LinearChart {
            nodes: on_surface[..vertices].to_vec(),
            uv: map.nodes[..vertices].to_vec(),
            triangles: Vec::with_capacity(map.cells.len()),
            faces: Vec::with_capacity(map.cells.len()),
            uv_scale: uv_scale(chart, map),
        };
        // Where middles of edges stand in the triangulation, and nodes between these.
        let mut middles = vec![u32::MAX; map.nodes.len()];
        let mut between: BTreeMap<u32, u32> = BTreeMap::new();
        let (mut leaves, mut refined) = (Vec::new(), 0);
        for (f, (FaceId(face), cell)) in (0..).zip(chart.faces().iter().zip(&map.cells)) {
            leaves.clear();
            self.leaves(*face, &self.whole(*face), &mut leaves);
            refined += usize::from(leaves.len() > 4);
            for part in &leaves {
                let mut add = |corner: &Corner| {
                    built.nodes.push(corner.node);
                    built.uv.push(self.uv_at(*face, corner.at));
                    built.nodes.len() as u32 - 1
                };
                let triangle = part.map(|corner| match node_at(corner.at) {
                    Some(k) if k < 3 => cell[k],
                    Some(k) => {
                        let middle = &mut middles[cell[k] as usize];
                        if *middle == u32::MAX {
                            *middle = add(&corner);
                        }
                        *middle
                    }
                    None => *between.entry(corner.node).or_insert_with(|| add(&corner)),
                });
                built.triangles.push(triangle);
                built.faces.push(f);
            }
        }
        (built, refined)
    }

    /// Appends the triangles that a part ends as. As deep as [`Self::settle`].
    fn leaves(&self, face: u32, part: &Part, leaves: &mut Vec<Part>) {
        let middles = self.middles(face, part);
        match middles.iter().flatten().count() {
            0 => leaves.push(*part),
            1 => leaves.extend(self.green(part, middles)),
            _ => self.red(face, part).iter().for_each(|quarter| self.leaves(face, quarter, leaves)),
        }
    }
}

/// The side of a triangle that two of its corners are the ends of; none where these are corners of parts.
fn side_between(a: Corner, b: Corner) -> Option<usize> {
    let [from, to] = [a, b].map(|corner| node_at(corner.at).filter(|node| *node < 3));
    match (from?, to?) {
        (0, 1) | (1, 0) => Some(0),
        (1, 2) | (2, 1) => Some(1),
        _ => Some(2),
    }
}

/// Which of its six nodes a place in a curved triangle is.
fn node_at(at: [i64; 3]) -> Option<usize> {
    const HALF: i64 = ONE / 2;
    match at {
        [ONE, 0, 0] => Some(0),
        [0, ONE, 0] => Some(1),
        [0, 0, ONE] => Some(2),
        [HALF, HALF, 0] => Some(3),
        [0, HALF, HALF] => Some(4),
        [HALF, 0, HALF] => Some(5),
        _ => None,
    }
}

/// Which sides of a curved triangle are too bent for it to stay whole.
fn bent(nodes: [[f64; 2]; 6]) -> [bool; 3] {
    let between = |i: usize, j: usize| [nodes[j][0] - nodes[i][0], nodes[j][1] - nodes[i][1]];
    let (e01, e02) = (between(0, 1), between(0, 2));
    let twice_area = e01[0] * e02[1] - e01[1] * e02[0];
    let longest = [e01, between(1, 2), e02].iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
    [(0, 1, 3), (1, 2, 4), (2, 0, 5)].map(|(i, j, middle)| {
        let off = [0, 1].map(|k| nodes[middle][k] - f64::midpoint(nodes[i][k], nodes[j][k]));
        // So that triangles without area, or turned over, are.
        let is_straight = off[0].hypot(off[1]) * longest <= BEND * twice_area;
        !is_straight
    })
}

/// The parts of a triangle with these corners and middles of the sides 01, 12, 20: those at the corners, then the inner one.
fn four_parts([a, b, c]: Part, [ab, bc, ca]: [Corner; 3]) -> [Part; 4] {
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// The uv of the point with barycentric coordinates `at` (in units of 2^-`BITS`) of a curved triangle: exact,
/// then rounded to a double that is a multiple of 2^-53.
fn uv_at(nodes: [GridPoint; 6], at: [i64; 3]) -> GridPoint {
    let one = i128::from(ONE);
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
