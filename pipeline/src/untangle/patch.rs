//! The patch path: only a few rings around invalid triangles move.
//!
//! A patch begins between the harmonic map and the feasible start: like the start around the invalid triangles, and
//! more and more like the harmonic map towards the rim. Mostly that is valid already. Begun at the harmonic map itself,
//! triangles with all vertices on the outer loop come to rest while they are still inverted.

use super::bound::Bound;
use super::interior::{NEAREST, minimise};
use super::objective::Objective;
use super::problem::{Cell, Moved, Problem};
use super::region;
use super::{Stats, arc, arcs, centre_of_hole, uv_of};
use crate::fem::bernstein::{JacobianBezier, Validity};
use crate::fem::jacobian::CornerDerivatives;
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::filled::FilledChart;
use crate::map::quadratic::{QuadraticMap, det, invalid_triangles, node_to_grid};
use crate::monitor::{Checkpoint, Interrupted};
use crate::topology::{FaceId, HalfEdgeId, Stars, VertexId};

/// Rings around invalid triangles, one attempt after another. Where the rim of a small patch admits no valid map only a
/// larger one helps; each costs about twice the one before. Chosen by experience.
const RINGS: [usize; 3] = [4, 9, 20];

/// Patches with more triangles than this share of the chart are left to the feasible path: that costs little more then, and
/// cannot fail.
const MAX_SHARE: f64 = 0.5;

/// The share of its typical size that every coefficient keeps: what rounding to the grid may take.
const KEPT: f64 = 1e-3;

/// Why patches do not lead to a valid map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub(super) enum Stuck {
    /// A patch would be most of the chart.
    #[error("a patch is too large a share of the chart")]
    TooLarge,
    /// Some triangle stays inverted, or becomes so when it is rounded.
    #[error("a patch stays invalid")]
    Invalid,
    /// Nothing in the patch may move.
    #[error("no node of a patch may move")]
    Fixed,
    /// A system cannot be solved.
    #[error(transparent)]
    Unsolvable(#[from] sparse::Unsolvable),
    /// The result was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl From<sparse::Error> for Stuck {
    fn from(error: sparse::Error) -> Self {
        match error {
            sparse::Error::Unsolvable(unsolvable) => Self::Unsolvable(unsolvable),
            sparse::Error::Interrupted(interrupted) => Self::Interrupted(interrupted),
        }
    }
}

/// Untangles patch by patch, in growing ones.
///
/// # Errors
/// [`Stuck`].
pub(super) fn untangle<O: Objective>(
    chart: &FilledChart,
    objective: &O,
    start: &[GridPoint],
    harmonic: &QuadraticMap,
    stats: &mut Stats,
    checkpoint: &Checkpoint,
) -> Result<Vec<GridPoint>, Stuck> {
    let context = PatchContext::new(chart, objective, start, checkpoint);
    let mut nodes = harmonic.nodes().to_vec();
    let mut x = harmonic.uv().to_vec();
    for rings in RINGS {
        checkpoint.after(chart.triangles().len())?;
        let centres: Vec<_> = (0..chart.loops().len()).map(|k| centre_of_hole(chart, &nodes, k)).collect();
        let seeds = seeds(chart, &nodes, &centres);
        if seeds.is_empty() {
            return Ok(nodes);
        }
        // After all nodes the star centres, found anew: where there is none, the centre of the fan, to begin with.
        x.truncate(chart.node_count());
        for (k, centre) in centres.iter().enumerate() {
            x.push(centre.unwrap_or(nodes[chart.centre_node(k)]).uv());
        }
        let patches = region::patches(chart, &context.stars, &seeds, rings);
        let largest_allowed = MAX_SHARE * chart.chart_triangles() as f64;
        if patches.parts.iter().any(|faces| faces.len() as f64 > largest_allowed) {
            return Err(Stuck::TooLarge);
        }
        for faces in &patches.parts {
            checkpoint.after(faces.len())?;
            // How far a vertex begins towards the feasible start: all the way in the inner third of the rings, then
            // less and less up to the rim.
            let weight = |v: usize| 1.5 * (1.0 - f64::from(patches.distance[v]) / rings as f64);
            match context.solve(faces, &x, weight, stats) {
                Ok(moved) => {
                    for Moved { node, uv } in moved {
                        x[node] = uv;
                        // Star centres are found anew.
                        if node < nodes.len() {
                            nodes[node] = node_to_grid(chart, node, uv);
                        }
                    }
                }
                Err(Stuck::Interrupted(interrupted)) => return Err(interrupted.into()),
                // Its triangles are seeds again, with more rings around them.
                Err(_) => {}
            }
        }
    }
    let no_centre_is_missing = vec![Some(GridPoint::default()); chart.loops().len()];
    if seeds(chart, &nodes, &no_centre_is_missing).is_empty() { Ok(nodes) } else { Err(Stuck::Invalid) }
}

/// The triangles that must change: invalid ones, and those at arcs of holes that no point can see.
fn seeds(chart: &FilledChart, nodes: &[GridPoint], centres: &[Option<GridPoint>]) -> Vec<FaceId> {
    let mut seeds = invalid_triangles(chart, nodes);
    for (k, hole) in chart.loops().iter().enumerate() {
        if centres[k].is_some() {
            continue;
        }
        // Seen from the centre of its fan, for want of a better point.
        let centre = nodes[chart.centre_node(k)];
        let is_hidden = |h: HalfEdgeId| arc(chart, nodes, h).products(centre).iter().any(|p| *p >= 0);
        seeds.extend(hole.iter().filter(|h| is_hidden(**h)).map(|h| h.face()));
    }
    seeds.sort_unstable();
    seeds.dedup();
    seeds
}

/// What all patches of a chart share.
struct PatchContext<'a, O> {
    chart: &'a FilledChart,
    objective: &'a O,
    stars: Stars,
    /// Per triangle, a typical jacobian: its area in space times the area scale of the linear map around it.
    density: Vec<f64>,
    /// The degree-elevated linear map.
    start: Vec<[f64; 2]>,
    /// Per node, whether it lies on the outer loop.
    fixed: Vec<bool>,
    checkpoint: &'a Checkpoint<'a>,
}

impl<'a, O: Objective> PatchContext<'a, O> {
    fn new(chart: &'a FilledChart, objective: &'a O, start: &[GridPoint], checkpoint: &'a Checkpoint) -> Self {
        let stars = Stars::new(chart.triangles(), chart.vertex_count());
        // The mean of a jacobian is the mean of its coefficients.
        let mean_jacobian = |f: usize| det(chart, start, f).coefficients().iter().sum::<f64>() / 6.0;
        let plane: Vec<f64> = (0..chart.triangles().len()).map(mean_jacobian).collect();
        let space: Vec<f64> = chart.shapes().iter().map(|s| s.area()).collect();
        let mut density = Vec::with_capacity(plane.len());
        for (t, area) in chart.triangles().iter().zip(&space) {
            // Those at its corners, itself three times: one triangle that the linear map presses flat says nothing of what is
            // typical there.
            let around = || t.iter().flat_map(|v| stars.around(v.index())).map(|g| *g as usize);
            let in_plane: f64 = around().map(|g| plane[g]).sum();
            let in_space: f64 = around().map(|g| space[g]).sum();
            let area_scale = in_plane / in_space;
            density.push(area_scale * area);
        }
        let centres: Vec<GridPoint> = (0..chart.loops().len()).map(|k| start[chart.centre_node(k)]).collect();
        let start = uv_of(start, &centres);
        let fixed = chart.outer_nodes();
        Self { chart, objective, stars, density, start, fixed, checkpoint }
    }

    /// Untangles one patch of the map `x` (all nodes and star centres), begun between `x` and the feasible start by
    /// the `weight` of each vertex: the nodes that moved.
    fn solve(
        &self,
        faces: &[FaceId],
        x: &[[f64; 2]],
        weight: impl Fn(usize) -> f64,
        stats: &mut Stats,
    ) -> Result<Vec<Moved>, Stuck> {
        let mut problem = self.problem(faces);
        if problem.unknowns() == 0 {
            return Err(Stuck::Fixed);
        }
        let mut local = problem.gather(x);
        self.blend(&mut local, &problem, faces, weight);
        let mut spent = Stats::default();
        let relaxed = relax(&mut problem, &mut local, &mut spent);
        // Steps count whether they led to anything or not; accuracy only where they did.
        stats.iterations += spent.iterations;
        relaxed?;
        let mut moved: Vec<Moved> = problem.moved(&local).collect();
        moved.sort_unstable_by_key(|m| m.node);
        if !self.is_valid(faces, x, &moved) {
            return Err(Stuck::Invalid);
        }
        stats.decrement = stats.decrement.max(spent.decrement);
        Ok(moved)
    }

    /// Whether a patch of the map `x` is valid on the grid once the nodes `moved` (ascending) are where they are now.
    fn is_valid(&self, faces: &[FaceId], x: &[[f64; 2]], moved: &[Moved]) -> bool {
        let uv = |n: usize| moved.binary_search_by_key(&n, |m| m.node).map_or(x[n], |i| moved[i].uv);
        for f in faces {
            if f.index() >= self.chart.chart_triangles() {
                continue;
            }
            let nodes = self.chart.nodes(f.index()).map(|n| node_to_grid(self.chart, n, uv(n)));
            if JacobianBezier::new(nodes).validity() == Validity::Invalid {
                return false;
            }
        }
        true
    }

    /// Moves free nodes towards the feasible start, by a share that `weight` gives for each vertex (cut to 0 and 1)
    /// and that mid-edge nodes take from both ends.
    fn blend(&self, x: &mut [[f64; 2]], problem: &Problem<O>, faces: &[FaceId], weight: impl Fn(usize) -> f64) {
        let is_of_chart = |v: VertexId| v.index() < self.chart.chart_vertices();
        let share = |v: VertexId| if is_of_chart(v) { weight(v.index()).clamp(0.0, 1.0) } else { 0.0 };
        // Per node its share; nodes that triangles have in common come several times, with the same one.
        let mut shares: Vec<(usize, f64)> = Vec::with_capacity(6 * faces.len());
        for f in faces {
            let nodes = self.chart.nodes(f.index());
            let corner = self.chart.triangles()[f.index()].map(share);
            for k in 0..3 {
                shares.push((nodes[k], corner[k]));
                shares.push((nodes[3 + k], 0.5 * (corner[k] + corner[(k + 1) % 3])));
            }
        }
        // Centres of holes go as far as their loops do.
        for (k, hole) in self.chart.loops().iter().enumerate() {
            let of_loop: f64 = hole.iter().map(|h| share(self.chart.ends(*h)[0])).sum();
            let mean = of_loop / hole.len() as f64;
            shares.extend(
                [self.chart.centre_node(k), region::star_centre(self.chart, k) as usize].map(|node| (node, mean)),
            );
        }
        shares.sort_unstable_by_key(|s| s.0);
        for local in problem.free() {
            let n = problem.nodes()[*local as usize] as usize;
            let found = shares.binary_search_by_key(&n, |s| s.0);
            let share = found.map_or(0.0, |i| shares[i].1);
            let to = self.start[n];
            let p = &mut x[*local as usize];
            *p = [0, 1].map(|k| p[k] + share * (to[k] - p[k]));
        }
    }

    /// The problem on a patch: constraints on its triangles, and on the arcs of the holes that it moves.
    fn problem(&self, faces: &[FaceId]) -> Problem<'a, O> {
        // Such a hole must be seen as a whole, from a point that may move, too.
        let is_in_patch = |h: &HalfEdgeId| faces.binary_search(&h.face()).is_ok();
        let is_moved = |k: &usize| self.chart.loops()[*k].iter().any(is_in_patch);
        let holes: Vec<usize> = (0..self.chart.loops().len()).filter(is_moved).collect();
        let weight = |f: FaceId| self.objective.typical(self.density[f.index()]);
        let mut cells = Vec::with_capacity(faces.len());
        for &face in faces {
            let typical = Bound::new(self.density[face.index()], weight(face));
            let bounds = if holes.is_empty() {
                [Bound { floor: KEPT * typical.scale, ..typical }; 6]
            } else {
                // Holes are moved inside the valid maps, where the feasible start is to lie.
                let of_start = CornerDerivatives::new(&self.chart.nodes(face.index()).map(|n| self.start[n])).dets();
                of_start.map(|det| Bound { floor: KEPT * det.min(typical.scale), ..typical })
            };
            // Fans have energy, and may fold.
            let is_of_chart = face.index() < self.chart.chart_triangles();
            cells.push(Cell { face, bounds: is_of_chart.then_some(bounds) });
        }
        let mean = faces.iter().map(|f| weight(*f)).sum::<f64>() / faces.len() as f64;
        let unset = Bound::new(1.0, mean);
        let mut arcs = region::arc_cells(self.chart, &holes, unset);
        for arc in &mut arcs {
            // What is typical of an arc is what the feasible start has there.
            let scales = arcs::products(&arc.nodes.map(|n| self.start[n as usize]));
            for (bound, scale) in arc.bounds.iter_mut().zip(scales) {
                bound.scale = scale;
                bound.floor = KEPT * scale;
            }
        }
        let mut free = region::free_nodes(self.chart, &self.stars, &self.fixed, faces);
        free.extend(holes.iter().map(|k| region::star_centre(self.chart, *k)));
        Problem::new(self.chart, self.objective, cells, arcs, &free, self.checkpoint)
    }
}

/// Lets a patch come to rest.
fn relax<O: Objective>(problem: &mut Problem<O>, x: &mut [[f64; 2]], stats: &mut Stats) -> Result<(), Stuck> {
    let pattern = problem.pattern();
    problem.checkpoint()?;
    let analysis = pattern.analyse()?;
    stats.add(minimise(problem, &analysis, x, NEAREST)?);
    Ok(())
}
