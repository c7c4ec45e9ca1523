//! The complex of cells: what the search needs of a partition of the triangles, at the size of the cells.
//!
//! The boundary of a cell is cut at corners into arcs. An arc is known by its two sides, half-arcs, each with the cell
//! on its left, as an edge is by its half-edges. Corners are the vertices where other than two boundary edges of cells
//! meet, where such edges reach the end of the surface, and one vertex of every boundary loop that has no other. So a
//! boundary can visit a vertex twice only at a corner, and all that decides whether a union of cells is a chart is
//! found without looking at a triangle: its loops by walking along half-arcs, and its Euler number as
//! the sum over the cells, minus the arcs, plus the corners that come to lie inside.

use super::dual::Dual;
use super::voronoi::Cells;
use crate::topology::loops::cut_at_corners;
use crate::topology::partition::Partition;
use crate::topology::{FaceId, HalfEdgeId};
use crate::vec3::Vec3;
use std::f64::consts::{PI, TAU};

/// No arc, no cell, no corner.
pub(super) const NONE: u32 = u32::MAX;

/// One side of an arc, with its cell on the left.
#[derive(Clone, Debug)]
pub(super) struct HalfArc {
    pub cell: u32,
    /// The corner at which it begins.
    pub from: u32,
    /// The half-arc after it around its cell.
    pub next: u32,
    /// The other side, or [`NONE`] where the surface ends.
    pub twin: u32,
    /// The cells that lie beyond without being joined (see [`Dual::coincident_faces`]), ascending.
    pub coincident_cells: Vec<u32>,
    pub length: f64,
    /// The angle of its cell at the corner where it begins, in radians.
    pub angle: f64,
    /// By how much it turns to the left between its ends: pi less the angle of its cell, summed up over the vertices there.
    pub turning: f64,
    /// The length that is a feature, and that weighed by its sharpness.
    pub feature: f64,
    pub sharp: f64,
    /// A point about half way.
    pub middle: Vec3,
    pub first: HalfEdgeId,
    last: HalfEdgeId,
}

/// What is known of a cell.
#[derive(Clone, Debug, Default)]
pub(super) struct Cell {
    pub faces: usize,
    /// Whether features keep it apart from what is beyond them: see [`Dual::is_kept`].
    pub is_kept: bool,
    /// The Euler number of the cell, opened where it only touches itself.
    pub euler: i64,
    pub area: f64,
    /// The sum of the area vectors.
    pub normal: Vec3,
    pub centroid: Vec3,
    /// The sum of the angle defects of the vertices inside.
    pub curvature: f64,
}

/// What is known of a corner.
#[derive(Clone, Copy, Debug)]
pub(super) struct Corner {
    /// The half-arcs that begin there.
    pub arcs: u32,
    /// A full turn less the angles of their cells: the angle defect, where the corner lies inside the surface.
    pub curvature: f64,
}

/// Cells and the arcs between them.
#[derive(Clone, Debug, Default)]
pub(super) struct Complex {
    pub cells: Vec<Cell>,
    /// In the order of their cells, then of their first half-edges.
    pub arcs: Vec<HalfArc>,
    pub corners: Vec<Corner>,
}

impl Complex {
    pub(super) fn new(dual: &Dual, cells: &Cells) -> Self {
        let tracer = Tracer::new(dual, cells);
        let arcs = tracer.arcs();
        let mut made = Self { cells: vec![Cell::default(); cells.len], arcs, corners: Vec::new() };
        made.measure(dual, cells, &tracer);
        made.number_corners(dual);
        made
    }

    /// Sums up triangles. With I inner vertices, B boundary half-edges and F triangles the Euler number of an opened
    /// cell is I + (B - F)/2.
    fn measure(&mut self, dual: &Dual, cells: &Cells, tracer: &Tracer) {
        let mut doubled = vec![0_i64; cells.len];
        let mut counted = vec![false; dual.mesh.points().len()];
        tracer.boundary.iter().for_each(|h| counted[dual.from(*h)] = true);
        let at_boundary = counted.clone();
        tracer.boundary.iter().for_each(|h| doubled[tracer.cells.label(*h) as usize] += 1);
        for (f, t) in dual.mesh.triangles().iter().enumerate() {
            let (area, normal, centroid) = (dual.area(f), dual.area_vector(f), dual.centroid(f));
            let fresh = t.iter().filter(|v| !std::mem::replace(&mut counted[v.index()], true)).count();
            doubled[cells.labels[f] as usize] += 2 * fresh as i64 - 1;
            let cell = &mut self.cells[cells.labels[f] as usize];
            let inside = (0..3).filter(|k| !at_boundary[t[*k].index()]);
            cell.curvature += TAU * fresh as f64;
            inside.for_each(|k| cell.curvature -= dual.angle(HalfEdgeId::side_of(FaceId::at(f), k)));
            cell.faces += 1;
            cell.is_kept |= dual.is_kept[f];
            cell.area += area;
            (0..3).for_each(|k| cell.normal[k] += normal[k]);
            (0..3).for_each(|k| cell.centroid[k] += area * centroid[k]);
        }
        for (cell, doubled) in self.cells.iter_mut().zip(doubled) {
            cell.euler = doubled / 2;
            cell.centroid = cell.centroid.map(|x| x / cell.area);
        }
    }

    /// Replaces vertices by numbers of corners, and sums up the angles there.
    fn number_corners(&mut self, dual: &Dual) {
        let mut number = vec![NONE; dual.mesh.points().len()];
        for arc in &mut self.arcs {
            let number = &mut number[arc.from as usize];
            if *number == NONE {
                *number = self.corners.len() as u32;
                self.corners.push(Corner { arcs: 0, curvature: TAU });
            }
            arc.from = *number;
            let corner = &mut self.corners[arc.from as usize];
            corner.arcs += 1;
            corner.curvature -= arc.angle;
        }
    }
}

/// Finds the arcs.
struct Tracer<'a> {
    dual: &'a Dual<'a>,
    cells: Partition<'a, Dual<'a>>,
    of: &'a [u32],
    /// The half-edges around cells, ascending.
    boundary: Vec<HalfEdgeId>,
    /// The loops that they form.
    loops: Vec<Vec<HalfEdgeId>>,
    /// Per vertex, whether it is a corner.
    corner: Vec<bool>,
}

impl<'a> Tracer<'a> {
    fn new(dual: &'a Dual<'a>, cells: &'a Cells) -> Self {
        let of = &cells.labels[..];
        let cells = Partition::new(dual, of);
        let boundary = cells.boundary();
        let loops = cells.loops(&boundary);
        let mut made = Self { dual, cells, of, boundary, loops, corner: vec![false; dual.mesh.points().len()] };
        made.mark_corners();
        made
    }

    fn coincident_cells(&self, h: HalfEdgeId) -> Vec<u32> {
        let mut cells: Vec<u32> = self.dual.coincident_faces(h).iter().map(|f| self.of[f.index()]).collect();
        cells.sort_unstable();
        cells.dedup();
        cells
    }

    fn mark_corners(&mut self) {
        let vertices = self.corner.len();
        let (mut out, mut open) = (vec![0_u32; vertices], vec![false; vertices]);
        for h in &self.boundary {
            out[self.dual.from(*h)] += 1;
            if self.dual.twin(*h).is_none() {
                (open[self.dual.from(*h)], open[self.dual.to(*h)]) = (true, true);
            }
        }
        // Counted by half-edges, not by edges as in [`super::network`]: where triangles disagree about the orientation,
        // an edge is an end of the surface to both, and its half-edges begin at the same vertex.
        for v in (0..vertices).filter(|v| out[*v] > 0) {
            self.corner[v] = out[v] != if open[v] { 1 } else { 2 };
        }
        for boundary_loop in &self.loops {
            let follower = boundary_loop.iter().cycle().skip(1);
            for (h, next) in boundary_loop.iter().zip(follower) {
                if self.dual.twin(*h).is_none() && self.coincident_cells(*h) != self.coincident_cells(*next) {
                    self.corner[self.dual.from(*next)] = true;
                }
            }
        }
        for boundary_loop in &self.loops {
            if !boundary_loop.iter().any(|h| self.corner[self.dual.from(*h)]) {
                self.corner[self.dual.from(boundary_loop[0])] = true;
            }
        }
    }

    /// All half-arcs, their corners given as vertices.
    fn arcs(&self) -> Vec<HalfArc> {
        let begins_at_corner = |h: &HalfEdgeId| self.corner[self.dual.from(*h)];
        let runs = self.loops.iter().flat_map(|l| cut_at_corners(l, begins_at_corner));
        let mut runs: Vec<Vec<HalfEdgeId>> = runs.collect();
        runs.sort_unstable_by_key(|run| (self.cells.label(run[0]), run[0]));
        let mut number = vec![NONE; self.of.len() * 3];
        runs.iter().zip(0..).for_each(|(run, i)| number[run[0].index()] = i);
        let mut arcs: Vec<HalfArc> = runs.iter().map(|run| self.arc(run)).collect();
        for a in 0..arcs.len() {
            let last = arcs[a].last;
            let next = number[self.cells.next(last).index()];
            arcs[next as usize].angle = self.angle_after(last);
            arcs[a].next = next;
            arcs[a].twin = self.dual.twin(last).map_or(NONE, |t| number[t.index()]);
        }
        arcs
    }

    /// The angle of the cell of `h`, a half-edge of its boundary, where `h` ends. Ends as another one begins there.
    fn angle_after(&self, h: HalfEdgeId) -> f64 {
        let mut side = h.next();
        let mut angle = self.dual.angle(side);
        while !self.cells.is_boundary(side) {
            let Some(twin) = self.dual.twin(side) else { break };
            side = twin.next();
            angle += self.dual.angle(side);
        }
        angle
    }

    /// The half-arc along a run of half-edges, from one corner to the next.
    fn arc(&self, run: &[HalfEdgeId]) -> HalfArc {
        let (first, last) = (run[0], run[run.len() - 1]);
        let length = |h: &HalfEdgeId| self.dual.length(*h);
        HalfArc {
            cell: self.cells.label(first),
            from: self.dual.from(first) as u32,
            next: NONE,
            twin: NONE,
            coincident_cells: self.coincident_cells(first),
            length: run.iter().map(length).sum(),
            angle: 0.0,
            turning: run[..run.len() - 1].iter().map(|h| PI - self.angle_after(*h)).sum(),
            feature: run.iter().filter(|h| self.dual.is_feature(**h)).map(length).sum(),
            sharp: run.iter().map(|h| length(h) * self.dual.sharpness(*h)).sum(),
            middle: self.dual.middle(run[run.len() / 2]),
            first,
            last,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decompose::legality;
    use crate::decompose::patches::compact_cells;
    use crate::decompose::regions::Regions;
    use crate::mesh::{SurfaceMesh, TriangleSoup};
    use crate::monitor::NoMonitor;
    use crate::repair::{Settings, repair};
    use crate::shapes::{self, Random};
    use crate::topology::{ChartId, VertexId};
    use crate::topology::{EdgeTable, TopologySummary, VertexFans};

    fn surface(soup: &TriangleSoup) -> SurfaceMesh {
        repair(soup, &Settings::default()).expect("a surface is left").mesh
    }

    /// Compares what a region is said to be with what its triangles tell. Cells may be illegal themselves.
    fn compare(dual: &Dual, cells: &Cells, regions: &mut Regions, region: u32) {
        let (outline, known) = (regions.outline_of(region), regions.all[region as usize].clone());
        let shape = regions.shape(&known, &outline);
        let own = |f: &usize| known.cells.contains(&cells.labels[*f]);
        let faces: Vec<FaceId> = (0..cells.labels.len()).filter(own).map(FaceId::at).collect();
        let mut vertices: Vec<VertexId> = faces.iter().flat_map(|f| dual.mesh.triangles()[f.index()]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let local = |v: VertexId| VertexId::at(vertices.partition_point(|u| *u < v));
        let triangles: Vec<_> = faces.iter().map(|f| dual.mesh.triangles()[f.index()].map(local)).collect();
        let edges = EdgeTable::new(&triangles);
        let legal = legality::verify(ChartId(0), &triangles, &edges, vertices.len()).is_ok();
        assert_eq!((shape.faces, shape.is_chart()), (faces.len(), legal), "{shape:?}");
        let summary = TopologySummary::new(&triangles, &edges);
        let at_rim = |h: &HalfEdgeId| dual.twin(*h).is_none_or(|t| !own(&t.face().index()));
        let rim: f64 = dual.half_edges().filter(|h| own(&h.face().index()) && at_rim(h)).map(|h| dual.length(h)).sum();
        assert!((known.length - rim).abs() < 1e-9 * (1.0 + rim));
        if summary.orientable {
            let opened = VertexFans::new(&triangles, &edges).count;
            let euler = opened as i64 - edges.len() as i64 + triangles.len() as i64;
            assert_eq!((shape.euler, shape.loops), (euler, summary.boundary_loops));
            assert_eq!(shape.pinches > 0, opened > vertices.len());
        }
    }

    #[test]
    fn random_unions_are_what_their_triangles_are() {
        let soups = [shapes::sphere(8), shapes::disk_with_holes(17, 3), shapes::ring_torus(14, 9), shapes::moebius(20)];
        let meshes: Vec<SurfaceMesh> = soups.iter().chain([&shapes::finger(12, 2)]).map(surface).collect();
        for (mesh, count) in meshes.iter().flat_map(|m| [3, 7, 25, 60].map(|count| (m, count))) {
            let dual = Dual::new(mesh, &NoMonitor);
            let cells = compact_cells(&dual, |_| count, &dual.checkpoint).expect("nobody cancels");
            let complex = Complex::new(&dual, &cells);
            let mut random = Random(count as u64);
            let mut regions = Regions::new(&complex, (0..cells.len as u32).collect(), cells.len);
            (0..cells.len as u32).for_each(|r| compare(&dual, &cells, &mut regions, r));
            // Every union leaves one region less.
            while let Some(a) = some_with_neighbours(&regions, &mut random) {
                let beside: Vec<u32> = regions.neighbours(a).into_iter().filter(|b| *b != a).collect();
                let b = beside[random.below(beside.len())];
                let union = regions.union(a, b).expect("neighbours");
                regions.merge(a, b, union);
                compare(&dual, &cells, &mut regions, a);
                let anew = Regions::new(&complex, regions.of_cell.clone(), regions.all.len());
                assert_eq!(regions.all[a as usize].euler, anew.all[a as usize].euler);
            }
        }
    }

    fn some_with_neighbours(regions: &Regions, random: &mut Random) -> Option<u32> {
        let apart = |r: &u32| regions.neighbours(*r).iter().any(|b| b != r);
        let all: Vec<u32> = (0..regions.all.len() as u32).filter(apart).collect();
        (!all.is_empty()).then(|| all[random.below(all.len())])
    }

    #[test]
    fn half_arcs_are_two_sides_of_arcs_and_go_round_their_cells() {
        for soup in [shapes::sphere(8), shapes::disk_with_holes(17, 3), shapes::ring_torus(14, 9)] {
            let mesh = surface(&soup);
            let dual = Dual::new(&mesh, &NoMonitor);
            for count in [1, 2, 9, 40] {
                let complex =
                    Complex::new(&dual, &compact_cells(&dual, |_| count, &dual.checkpoint).expect("nobody cancels"));
                for (a, arc) in complex.arcs.iter().enumerate() {
                    assert_eq!(complex.arcs[arc.next as usize].cell, arc.cell);
                    let Some(twin) = complex.arcs.get(arc.twin as usize) else { continue };
                    assert_eq!(twin.twin as usize, a);
                    assert_eq!(twin.from, complex.arcs[arc.next as usize].from);
                    assert!((twin.length - arc.length).abs() < 1e-12 && twin.cell != arc.cell);
                }
            }
        }
    }
}
