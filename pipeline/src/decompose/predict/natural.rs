//! The conformal map into the plane that keeps the lengths of the outer loop.
//!
//! As in boundary first flattening (Sawhney and Crane 2017, doi 10.1145/3132705, section 4), the logarithm a of its scale
//! solves a Poisson problem: with the Laplacian A of the graph and the curvatures K of the cells A a = -K, a = 0 along the outer
//! loop. Along an inner loop a is a constant, such that the loop turns by a full turn in the plane: the node that closes it on
//! the disk has the load -(2 pi + k) here, where k is by how much the loop turns on the surface. So a cylinder of length L and
//! radius R gets the area ratio e^(2 L / R) of a ring.
//!
//! By how much the outer loop turns in the plane at each of its cells tells its shape there, and whether the map covers itself.

use super::super::graph_laplacian::GraphLaplacian;
use super::{CellUnion, PredictedMap};
use std::f64::consts::{PI, TAU};

/// The map that keeps the lengths of a loop.
pub(super) struct NaturalMap {
    outer: usize,
    /// Per cell, the logarithm of the scale of lengths.
    log_scales: Vec<f64>,
    pub area_ratio: f64,
}

impl NaturalMap {
    /// None where there is none in doubles.
    pub fn new(union: &CellUnion, outer: usize) -> Option<Self> {
        let log_scales = log_scales(union, outer)?;
        let area_ratio = union.ratio(|i, _| (2.0 * log_scales[i]).exp());
        Some(Self { outer, log_scales, area_ratio })
    }

    /// Whether it hardly covers itself.
    pub fn lies_flat(&self, union: &CellUnion) -> bool {
        overlap(&laid_out(union, self.outer, &self.log_scales)) <= OVERLAP
    }

    pub fn predicted(&self) -> PredictedMap {
        PredictedMap { area_ratio: self.area_ratio, outer: self.outer }
    }
}

/// Per cell, the logarithm of the scale of lengths.
fn log_scales(union: &CellUnion, outer: usize) -> Option<Vec<f64>> {
    let holes = union.loops.len() - 1;
    let mut laplacian = GraphLaplacian::new(union.cells(), holes);
    union.links.iter().for_each(|(pair, w)| laplacian.add_edge(*pair, *w));
    for (i, curvature) in curvatures(union).into_iter().enumerate() {
        laplacian.add_load(i as u32, [-curvature, 0.0]);
    }
    let mut node = union.cells() as u32;
    for (l, runs) in union.runs.iter().enumerate() {
        for run in runs {
            let (cell, conductance) = (union.unknown(run.cell), run.length / union.reach(run));
            if l == outer {
                laplacian.add_dirichlet(cell, conductance, [0.0; 2]);
            } else {
                laplacian.add_edge([cell, node], conductance);
            }
        }
        if l != outer {
            laplacian.add_load(node, [-(TAU + turning(union, &union.loops[l])), 0.0]);
            node += 1;
        }
    }
    Some(laplacian.solve()?.into_iter().map(|a| a[0]).collect())
}

/// Per cell its curvature: the angle defects inside, and its share of those at the ends and between the ends of its arcs, as
/// far as these lie inside the union.
fn curvatures(union: &CellUnion) -> Vec<f64> {
    let complex = union.complex;
    let mut at_boundary: Vec<u32> = union.loops.iter().flatten().map(|a| complex.arcs[*a as usize].from).collect();
    at_boundary.sort_unstable();
    let of_cell = |cell: &u32| {
        let mut curvature = complex.cells[*cell as usize].curvature;
        for a in union.graph.arcs(*cell) {
            let Some(twin) = union.inner_twin(a) else { continue };
            let (arc, beyond) = (&complex.arcs[a as usize], &complex.arcs[twin as usize]);
            // Where the boundary between two cells is crooked and the surface is flat, both turn by the same, and to either side.
            curvature += 0.5 * (arc.turning + beyond.turning);
            if at_boundary.binary_search(&arc.from).is_err() {
                let corner = complex.corners[arc.from as usize];
                curvature += corner.curvature / f64::from(corner.arcs);
            }
        }
        curvature
    };
    union.dofs.free().iter().map(of_cell).collect()
}

/// By how much a loop turns to the left on the surface.
fn turning(union: &CellUnion, boundary_loop: &[u32]) -> f64 {
    let mut before = boundary_loop[boundary_loop.len() - 1];
    let mut sum = 0.0;
    for arc in boundary_loop {
        sum += turning_at(union, before, *arc) + union.complex.arcs[*arc as usize].turning;
        before = *arc;
    }
    sum
}

/// By how much the boundary turns at the corner between two half-arcs of it.
fn turning_at(union: &CellUnion, arriving: u32, leaving: u32) -> f64 {
    let arcs = &union.complex.arcs;
    let mut side = arcs[arriving as usize].next;
    let mut angle = arcs[side as usize].angle;
    // Around the corner, cell by cell: ends at the boundary.
    while side != leaving {
        let Some(twin) = union.inner_twin(side) else { break };
        side = arcs[twin as usize].next;
        angle += arcs[side as usize].angle;
    }
    PI - angle
}

/// Half-arcs are laid out in so many pieces. Crooked ones are rounded off by this.
const PIECES: usize = 4;

/// The outer loop in the plane: its length kept, turned by the derivative of the logarithmic scale across it.
fn laid_out(union: &CellUnion, outer: usize, scales: &[f64]) -> Vec<[f64; 2]> {
    let arcs = &union.complex.arcs;
    let boundary_loop = &union.loops[outer];
    // Per unit of length, along each run.
    let mut bends = union.runs[outer].iter().map(|run| -scales[union.unknown(run.cell) as usize] / union.reach(run));
    let mut before = boundary_loop[boundary_loop.len() - 1];
    let mut bend = 0.0;
    let (mut at, mut direction) = ([0.0; 2], 0.0_f64);
    let mut outline = Vec::with_capacity(PIECES * boundary_loop.len());
    for (i, a) in boundary_loop.iter().enumerate() {
        let arc = &arcs[*a as usize];
        if i == 0 || arcs[before as usize].cell != arc.cell {
            bend = bends.next().unwrap_or(0.0);
        }
        direction += turning_at(union, before, *a);
        let (step, turn) = (arc.length / PIECES as f64, (arc.turning + bend * arc.length) / PIECES as f64);
        for _ in 0..PIECES {
            direction += 0.5 * turn;
            outline.push(at);
            at = [at[0] + step * direction.cos(), at[1] + step * direction.sin()];
            direction += 0.5 * turn;
        }
        before = *a;
    }
    closed(outline, at)
}

/// The outline moved so that it ends where it began: what is missing is distributed evenly.
fn closed(mut outline: Vec<[f64; 2]>, end: [f64; 2]) -> Vec<[f64; 2]> {
    let count = outline.len() as f64;
    for (i, p) in outline.iter_mut().enumerate() {
        let share = i as f64 / count;
        *p = [p[0] - share * end[0], p[1] - share * end[1]];
    }
    outline
}

/// The largest share of the plane inside an outline that may be covered more than once. By experience.
const OVERLAP: f64 = 0.05;

/// Lines on which that is looked at.
const LINES: usize = 48;

/// The share of the plane inside an outline that it surrounds more than once, or the wrong way round: on some lines across it.
fn overlap(outline: &[[f64; 2]]) -> f64 {
    let (low, high) = outline.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
    let step = (high - low) / LINES as f64;
    let height = |line: usize| low + step * (line as f64 + 0.5);
    // The first line above a height, or just below it as rounding has it.
    let first = |y: f64| (((y - low) / step - 1.0).floor().max(0.0) as usize).min(LINES);
    // Where the outline crosses each line, and in which direction.
    let mut crossings: [Vec<(f64, i32)>; LINES] = [const { Vec::new() }; LINES];
    let following = outline.iter().cycle().skip(1);
    for (p, q) in outline.iter().zip(following) {
        let direction = if q[1] > p[1] { -1 } else { 1 };
        for line in first(p[1].min(q[1]))..LINES {
            let y = height(line);
            if y > p[1].max(q[1]) {
                break;
            }
            if (p[1] <= y) != (q[1] <= y) {
                let x = p[0] + (q[0] - p[0]) * (y - p[1]) / (q[1] - p[1]);
                crossings[line].push((x, direction));
            }
        }
    }
    let (mut inside, mut wrong) = (0.0, 0.0);
    for crossings in &mut crossings {
        crossings.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            let width = pair[1].0 - pair[0].0;
            inside += if winding == 0 { 0.0 } else { width };
            wrong += if winding == 0 || winding == 1 { 0.0 } else { width };
        }
    }
    if inside > 0.0 { wrong / inside } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::super::super::BoundaryShape;
    use super::super::super::complex::Complex;
    use super::super::super::dual::Dual;
    use super::super::super::patches::compact_cells;
    use super::super::super::regions::Regions;
    use super::super::{CellGraph, predict};
    use super::overlap;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::{repair, shapes};

    /// The area ratio that is predicted of the whole of a surface, by cells of so many triangles.
    fn ratio(soup: &TriangleSoup, boundary: BoundaryShape, triangles: usize) -> f64 {
        let mesh = repair(soup, &Default::default()).expect("repairs").mesh;
        let dual = Dual::new(&mesh, &NoMonitor);
        let cells = compact_cells(&dual, |size| size / triangles, &dual.checkpoint).expect("nobody cancels");
        let complex = Complex::new(&dual, &cells);
        let graph = CellGraph::new(&complex, boundary);
        let mut regions = Regions::new(&complex, vec![0; cells.len], 1);
        let outline = regions.outline_of(0);
        predict(&complex, &graph, &regions.all[0].cells, &outline.loops).area_ratio
    }

    #[test]
    fn cylinders_become_rings_of_the_ratio_that_theory_tells() {
        for height in [1.0_f64, 2.0, 3.0] {
            let rows = (8.0 * height) as u32;
            let found = ratio(&shapes::tube(48, rows, height), BoundaryShape::Natural, 8);
            // Boundaries between cells are jagged, so that more flows across than through a straight cut, and the cells at either
            // end have their centroids inside: the decades come out a third too few.
            let share = 0.5 * found.ln() / height;
            assert!((0.6..1.05).contains(&share), "height {height}: {found:.3}, {share:.3} of its decades");
        }
    }

    #[test]
    fn what_is_flat_keeps_its_areas_whatever_its_outline_and_holes() {
        let plate = shapes::disk_with_holes(17, 3);
        let flat = plate.points().iter().map(|[x, y, _]| [*x, *y, 0.0]).collect();
        let plate = TriangleSoup::new(flat, plate.triangles().to_vec()).expect("sound");
        for soup in [shapes::flat_disk(12), plate] {
            let found = ratio(&soup, BoundaryShape::Natural, 8);
            assert!(found < 1.1, "{found}");
        }
    }

    #[test]
    fn a_ramp_that_would_cover_itself_is_judged_by_its_disk() {
        let of = |boundary| ratio(&shapes::ramp(24, 96), boundary, 8);
        assert_eq!(of(BoundaryShape::Natural), of(BoundaryShape::Circle));
        // One of half a turn is unrolled, and scales nothing.
        let half = shapes::tube(48, 16, 2.0);
        let is_front = |t: &[u32; 3]| t.iter().all(|v| half.points()[*v as usize][1] >= -1e-9);
        let front = half.triangles().iter().copied().filter(is_front).collect();
        let wall = TriangleSoup::new(half.points().to_vec(), front).expect("sound");
        let [natural, disk] = [BoundaryShape::Natural, BoundaryShape::Circle].map(|b| ratio(&wall, b, 8));
        assert!(natural < 1.1 && disk > 1.5, "{natural} {disk}");
    }

    #[test]
    fn the_share_that_is_covered_twice_is_measured() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(overlap(&square), 0.0);
        // Twice around: everything.
        assert_eq!(overlap(&[square, square].concat()), 1.0);
        // An eight: one half runs the wrong way round.
        let eight = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]];
        assert!((overlap(&eight) - 0.5).abs() < 0.05, "{}", overlap(&eight));
    }
}
