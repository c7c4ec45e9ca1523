//! Linear map: chart -> P1 map that does not fold.
//!
//! The harmonic map by linear elements (cotangent weights) may fold where an edge has opposite angles adding up to
//! more than pi: its weight is negative. Every triangle is tested exactly, on the numbers that are kept. If any is
//! folded, negative weights near folded triangles become positive; the set of changed edges only grows, and ends
//! at all negative edges, where the matrix is an M-matrix and the map a convex combination map, which cannot fold
//! inside a convex boundary (Tutte 1963, doi 10.1112/plms/s3-13.1.743; Floater 1997,
//! doi 10.1016/S0167-8396(96)00031-3). If rounding still folds something, mean value weights are tried, in a system
//! of their own. If that folds too, the chart is too distorted for doubles and must be split.
//!
//! Inside a boundary that is not convex, as natural ones are, there is no such theorem: there a map is what passes the test.
//!
//! Guarantees: in a [`LinearMap`] every triangle, those of virtual fans included, turns left, exactly.

use crate::fem::assembly::Assembly;
use crate::fem::bernstein::JacobianBezier;
use crate::fem::dofs::Dofs;
use crate::fem::sparse::{self, Analysis, Pattern, Unsolvable};
use crate::grid::{GridPoint, orientation};
use crate::map::boundary::Boundary;
use crate::map::filled::FilledChart;
use crate::map::weights;
use crate::monitor::{Interrupted, Monitor};
use crate::topology::{EdgeId, FaceId, HalfEdgeId};

/// After this many rounds of local changes, all negative edges are changed at once. By experience: each costs a
/// factorisation, and the fewer edges change, the closer the map stays to the harmonic one.
const LOCAL_ROUNDS: u32 = 6;

/// How a linear map was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Cotangent weights: the harmonic map.
    Harmonic,
    /// Cotangent weights, some negative ones raised.
    MMatrix,
    /// Mean value weights.
    MeanValue,
    /// Least squares conformal, with a free boundary.
    Conformal,
    /// Projected along the mean of the normals.
    Projection,
    /// Unfolded inside a natural boundary.
    Unfolded,
    /// Nearest to an isometry, with the boundary freed.
    Isometric,
}

/// A P1 map in which no triangle is folded.
#[derive(Clone, Debug)]
pub struct LinearMap {
    uv: Vec<GridPoint>,
    folded: usize,
    edges_changed: usize,
    method: Method,
}

/// Why there is no linear map.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// Every method folds a triangle in double precision.
    #[error(
        "the chart is too distorted for one map: {folded} triangles fold with positive weights too (first: {first}); \
         it must be split"
    )]
    Folded {
        /// How many triangles fold in the last method tried.
        folded: usize,
        /// The first of them, by its number in the chart.
        first: FaceId,
    },
    /// The system could not be solved.
    #[error("linear map: {0}")]
    Solver(#[from] sparse::Unsolvable),
    /// The map was not wanted any more.
    #[error(transparent)]
    Interrupted(#[from] Interrupted),
}

impl From<sparse::Error> for Error {
    fn from(error: sparse::Error) -> Self {
        match error {
            sparse::Error::Unsolvable(unsolvable) => Self::Solver(unsolvable),
            sparse::Error::Interrupted(interrupted) => Self::Interrupted(interrupted),
        }
    }
}

impl LinearMap {
    /// The map with the vertices at `uv`, however that was found.
    ///
    /// # Errors
    /// [`Error::Folded`].
    pub fn through(chart: &FilledChart, uv: Vec<GridPoint>, method: Method) -> Result<Self, Error> {
        let folds = folded(chart, &uv);
        match folds.first() {
            Some(first) => Err(Error::Folded { folded: folds.len(), first: *first }),
            None => Ok(Self { uv, folded: 0, edges_changed: 0, method }),
        }
    }

    /// The uv coordinates of the vertices, those of the fans' centres last.
    pub fn uv(&self) -> &[GridPoint] {
        &self.uv
    }

    /// How many triangles the harmonic map folds.
    pub fn folded(&self) -> usize {
        self.folded
    }

    /// How many edges have other than harmonic weights.
    pub fn edges_changed(&self) -> usize {
        self.edges_changed
    }

    /// How the map was found.
    pub fn method(&self) -> Method {
        self.method
    }

    /// The map as a quadratic one, over the nodes of the filled chart: mid-edge nodes in the middle of straight
    /// edges, those of the outer loop where the boundary has them.
    pub fn degree_elevated(&self, chart: &FilledChart, boundary: &Boundary) -> Vec<GridPoint> {
        let mut nodes = vec![GridPoint::default(); chart.node_count()];
        for (f, t) in chart.triangles().iter().enumerate() {
            for (k, v) in t.iter().enumerate() {
                let [a, b] = chart.ends(HalfEdgeId::at(3 * f + k)).map(|v| self.uv[v.index()]);
                nodes[chart.vertex_node(*v)] = self.uv[v.index()];
                nodes[chart.mid_node(HalfEdgeId::at(3 * f + k))] = a.midpoint(b);
            }
        }
        for (h, mid) in chart.outer().iter().zip(boundary.mids()) {
            nodes[chart.mid_node(*h)] = *mid;
        }
        nodes
    }
}

/// Maps `chart` with its outer loop on the vertices of `boundary`.
///
/// # Errors
/// [`Error::Folded`] when the chart must be split; [`Error::Solver`]; [`Error::Interrupted`].
///
/// # Example
///
/// The smallest surface whose harmonic map folds: three triangles around a vertex, and one edge with a negative weight.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::{Method, folded, harmonic_uv, linear_map};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::folding_three(), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// let boundary = Boundary::circle(&chart, Mids::Arc);
/// let harmonic = harmonic_uv(&chart, &boundary, &NoMonitor)?;
/// assert_eq!(folded(&chart, &harmonic).len(), 1);
/// let map = linear_map(&chart, &boundary, &NoMonitor)?;
/// assert!(folded(&chart, map.uv()).is_empty(), "this is what a linear map promises");
/// assert_eq!((map.method(), map.edges_changed()), (Method::MMatrix, 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn linear_map(chart: &FilledChart, boundary: &Boundary, monitor: &dyn Monitor) -> Result<LinearMap, Error> {
    let dofs = dofs(chart);
    let pattern = edge_pattern(chart, &dofs);
    let analysis = pattern.analyse_as_numbered()?;
    let system = System { chart, dofs: &dofs, prescribed: prescribed(chart, boundary), analysis, monitor };
    let harmonic = weights::harmonic(chart);
    let mut attempt = Attempt::by(&system, &harmonic)?;
    if attempt.folds.is_empty() {
        return Ok(LinearMap { uv: attempt.uv, folded: 0, edges_changed: 0, method: Method::Harmonic });
    }
    let folded_by_harmonic = attempt.folds.len();
    let mean_value = weights::mean_value(chart);
    let positive = weights::replacements(chart, &harmonic, &mean_value);
    let mut changed = vec![false; harmonic.len()];
    for round in 0..=LOCAL_ROUNDS {
        let everywhere = round == LOCAL_ROUNDS;
        if !grow(chart, &harmonic, &attempt.folds, everywhere, &mut changed) {
            // The same weights would fold the same triangles; the last round may still find edges elsewhere.
            continue;
        }
        let pick = |e: usize| if changed[e] { positive[e] } else { harmonic[e] };
        let weights: Vec<f64> = (0..harmonic.len()).map(pick).collect();
        attempt = Attempt::by(&system, &weights)?;
        if attempt.folds.is_empty() {
            let edges_changed = changed.iter().filter(|c| **c).count();
            let method = Method::MMatrix;
            return Ok(LinearMap { uv: attempt.uv, folded: folded_by_harmonic, edges_changed, method });
        }
    }
    // The matrix had every chance to be an M-matrix: what folds now folds by rounding.
    let map = mean_value_map(chart, boundary, monitor)?;
    Ok(LinearMap { folded: folded_by_harmonic, ..map })
}

/// What symmetric weights give.
struct Attempt {
    /// The uv of the vertices; none where the matrix is not positive definite in doubles.
    uv: Vec<GridPoint>,
    /// The triangles folded there; all of them where there are no uv.
    folds: Vec<FaceId>,
}

impl Attempt {
    fn by(system: &System, weights: &[f64]) -> Result<Self, Error> {
        match system.solve(weights) {
            Ok(uv) => Ok(Self { folds: folded(system.chart, &uv), uv }),
            // Negative weights may do that. It is no reason to give up: they change where triangles fold.
            Err(sparse::Error::Unsolvable(Unsolvable::Singular { .. })) => {
                let all = (0..system.chart.triangles().len()).map(FaceId::at);
                Ok(Self { uv: Vec::new(), folds: all.collect() })
            }
            Err(error) => Err(error.into()),
        }
    }
}

/// The map by mean value weights, which are always positive: it takes a general system, and several times as long as
/// [`linear_map`] usually does. [`LinearMap::folded`] is not asked of the harmonic map, and 0.
///
/// # Errors
/// As [`linear_map`].
pub fn mean_value_map(chart: &FilledChart, boundary: &Boundary, monitor: &dyn Monitor) -> Result<LinearMap, Error> {
    let uv = solve_mean_value(chart, boundary, &weights::mean_value(chart), monitor)?;
    let folds = folded(chart, &uv);
    match folds.first() {
        Some(first) => Err(Error::Folded { folded: folds.len(), first: *first }),
        None => Ok(LinearMap { uv, folded: 0, edges_changed: chart.edges().len(), method: Method::MeanValue }),
    }
}

/// The harmonic P1 map as it is, folded or not: per vertex its uv.
///
/// # Errors
/// [`Error::Solver`]; [`Error::Interrupted`].
pub fn harmonic_uv(chart: &FilledChart, boundary: &Boundary, monitor: &dyn Monitor) -> Result<Vec<GridPoint>, Error> {
    let dofs = dofs(chart);
    let pattern = edge_pattern(chart, &dofs);
    let analysis = pattern.analyse_as_numbered()?;
    let system = System { chart, dofs: &dofs, prescribed: prescribed(chart, boundary), analysis, monitor };
    Ok(system.solve(&weights::harmonic(chart))?)
}

/// The triangles that do not turn left, exactly.
pub fn folded(chart: &FilledChart, uv: &[GridPoint]) -> Vec<FaceId> {
    let mut folded = Vec::new();
    for (f, t) in chart.triangles().iter().enumerate() {
        let [a, b, c] = t.map(|v| uv[v.index()]);
        if orientation(a, b, c) <= 0 {
            folded.push(FaceId::at(f));
        }
    }
    folded
}

/// Marks the negative edges at the vertices of folded triangles (or all of them); whether that marked any more.
fn grow(chart: &FilledChart, harmonic: &[f64], folds: &[FaceId], everywhere: bool, changed: &mut [bool]) -> bool {
    let mut is_near = vec![everywhere; chart.vertex_count()];
    for f in folds {
        for v in chart.triangles()[f.index()] {
            is_near[v.index()] = true;
        }
    }
    let mut has_grown = false;
    for (e, sides) in chart.edges().iter() {
        // Edges of the outer loop join prescribed vertices: their weights change nothing.
        let is_negative = sides.len() == 2 && harmonic[e.index()] < 0.0;
        let touches = chart.ends(sides[0]).iter().any(|v| is_near[v.index()]);
        if is_negative && touches && !changed[e.index()] {
            changed[e.index()] = true;
            has_grown = true;
        }
    }
    has_grown
}

/// The unknowns of a linear map: vertices that are not on the outer loop, in the order of elimination.
fn dofs(chart: &FilledChart) -> Dofs {
    Dofs::new(chart.vertex_count(), chart.elimination().iter().map(|v| v.0).collect())
}

/// Per vertex where `boundary` has it; the origin inside.
fn prescribed(chart: &FilledChart, boundary: &Boundary) -> Vec<[f64; 2]> {
    let mut uv = vec![[0.0; 2]; chart.vertex_count()];
    for (h, point) in chart.outer().iter().zip(boundary.vertices()) {
        uv[chart.ends(*h)[0].index()] = point.uv();
    }
    uv
}

/// The pattern of one element per edge.
fn edge_pattern(chart: &FilledChart, dofs: &Dofs) -> Pattern {
    dofs.pattern((0..chart.edges().len()).map(|e| edge_ends(chart, e)))
}

/// The system for the uv coordinates of the vertices by one weight per edge, analysed once for all weights.
struct System<'a> {
    chart: &'a FilledChart,
    dofs: &'a Dofs,
    prescribed: Vec<[f64; 2]>,
    analysis: Analysis<'a>,
    monitor: &'a dyn Monitor,
}

impl System<'_> {
    fn solve(&self, weights: &[f64]) -> Result<Vec<GridPoint>, sparse::Error> {
        let mut system = Assembly::new(self.dofs, self.analysis.pattern(), self.prescribed.clone());
        for (e, w) in weights.iter().enumerate() {
            system.add(e, &edge_ends(self.chart, e), &[[*w, -w], [-w, *w]]);
        }
        Ok(on_grid(&system.solve(&self.analysis, self.monitor)?))
    }
}

fn on_grid(uv: &[[f64; 2]]) -> Vec<GridPoint> {
    uv.iter().map(|p| GridPoint::vertex(*p)).collect()
}

/// The vertices at both ends of an edge.
fn edge_ends(chart: &FilledChart, edge: usize) -> [usize; 2] {
    chart.ends(chart.edges().sides(EdgeId::at(edge))[0]).map(|v| v.index())
}

/// Solves for the uv coordinates of the vertices with weights that differ between the ends of an edge.
fn solve_mean_value(
    chart: &FilledChart,
    boundary: &Boundary,
    weights: &[[f64; 2]],
    monitor: &dyn Monitor,
) -> Result<Vec<GridPoint>, Error> {
    let dofs = dofs(chart);
    let mut uv = prescribed(chart, boundary);
    let mut entries = Vec::new();
    let mut rhs = vec![0.0; 2 * dofs.count()];
    let mut row_sums = vec![0.0; dofs.count()];
    for (e, sides) in chart.edges().iter() {
        let [a, b] = chart.ends(sides[0]).map(|v| v.index());
        let [weight_at_a, weight_at_b] = weights[e.index()];
        // Row by row: the sum of weight times (own value - neighbour's value) is zero.
        for (from, to, w) in [(a, b, weight_at_a), (b, a, weight_at_b)] {
            let Some(row) = dofs.unknown(from) else { continue };
            row_sums[row] += w;
            match dofs.unknown(to) {
                Some(column) => entries.push((row as u32, column as u32, -w)),
                None => dofs.add_prescribed(&mut rhs, row, to, w, &uv),
            }
        }
    }
    for (i, sum) in row_sums.iter().enumerate() {
        entries.push((i as u32, i as u32, *sum));
    }
    if dofs.count() > 0 {
        sparse::solve_general(dofs.count(), &entries, &mut rhs, 2, monitor)?;
        dofs.scatter(&rhs, &mut uv);
    }
    Ok(on_grid(&uv))
}

/// The least jacobian coefficient at which arcs are left alone, relative to that of the straight triangle. By experience:
/// smaller leaves corners that are nearly folded, larger flattens more of the circle.
const MARGIN: f64 = 0.01;

/// Moves mid-edge nodes of `boundary` where the degree-elevated map would come close to a folded corner: where a triangle
/// has two boundary edges (an ear), its corner angle on a smooth boundary tends to pi. The node goes half-way to
/// the chord, and if that is not enough, to the chord.
///
/// # Example
///
/// Two corners of this plate are triangles with two boundary edges each.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::{flatten_ear_arcs, linear_map};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::disk_with_holes(13, 2), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// let arcs = Boundary::circle(&chart, Mids::Arc);
/// let linear = linear_map(&chart, &arcs, &NoMonitor)?;
/// let mut boundary = arcs.clone();
/// flatten_ear_arcs(&chart, &linear, &mut boundary);
/// assert_eq!(boundary.vertices(), arcs.vertices());
/// let moved = boundary.mids().iter().zip(arcs.mids()).filter(|(new, old)| new != old).count();
/// assert_eq!(moved, 2 * 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn flatten_ear_arcs(chart: &FilledChart, linear: &LinearMap, boundary: &mut Boundary) {
    let mut nodes = linear.degree_elevated(chart, boundary);
    // The edges of one triangle are flattened together, so that no order of them decides.
    let outer = chart.outer();
    let face_of = |edge: usize| outer[edge].face().index();
    let mut edges: Vec<usize> = (0..outer.len()).collect();
    edges.sort_by_key(|edge| face_of(*edge));
    for ear in edges.chunk_by(|a, b| face_of(*a) == face_of(*b)) {
        let face = face_of(ear[0]);
        let [p, q, r] = chart.triangles()[face].map(|v| linear.uv[v.index()]);
        // All six coefficients of a straight triangle are twice its area; they come doubled.
        let straight = 2.0 * orientation(p, q, r) as f64;
        for all_the_way in [false, true] {
            let det = JacobianBezier::new(chart.nodes(face).map(|n| nodes[n]));
            let coefficients = det.corner.iter().chain(&det.edge);
            let least = coefficients.fold(f64::INFINITY, |least, c| least.min(*c as f64));
            if least > MARGIN * straight {
                break;
            }
            for edge in ear {
                boundary.flatten(*edge, all_the_way);
                nodes[chart.mid_node(outer[*edge])] = boundary.mids()[*edge];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fem::bernstein;
    use crate::map::boundary::Mids;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::{decompose, repair, shapes};

    fn filled(soup: &TriangleSoup) -> FilledChart {
        let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
        FilledChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0])
    }

    fn valid(chart: &FilledChart, nodes: &[GridPoint]) -> bool {
        let det = |f: usize| bernstein::JacobianBezier::new(chart.nodes(f).map(|n| nodes[n]));
        (0..chart.triangles().len()).all(|f| det(f).validity() != bernstein::Validity::Invalid)
    }

    #[test]
    fn every_disk_gets_a_map_that_raises_to_a_valid_quadratic_one() {
        let shapes = [
            shapes::disk(8),
            shapes::disk_with_holes(17, 3),
            shapes::bent_disk(12, 0.45, 1.0),
            shapes::folding_three(),
            shapes::folding_six(),
            shapes::sliver_strip(9),
            shapes::cracked_patch(),
            shapes::finger(12, 3),
        ];
        for (i, soup) in shapes.iter().enumerate() {
            let chart = filled(soup);
            let mut boundary = Boundary::circle(&chart, Mids::Arc);
            let linear = linear_map(&chart, &boundary, &NoMonitor).expect("maps");
            assert!(folded(&chart, linear.uv()).is_empty());
            flatten_ear_arcs(&chart, &linear, &mut boundary);
            assert!(valid(&chart, &linear.degree_elevated(&chart, &boundary)), "shape {i}");
            let mean_value = mean_value_map(&chart, &boundary, &NoMonitor).expect("maps");
            assert!(folded(&chart, mean_value.uv()).is_empty());
        }
    }

    #[test]
    fn the_m_matrix_unfolds_what_the_harmonic_map_folds() {
        for soup in [shapes::folding_three(), shapes::folding_six()] {
            let chart = filled(&soup);
            let boundary = Boundary::circle(&chart, Mids::Arc);
            assert_eq!(folded(&chart, &harmonic_uv(&chart, &boundary, &NoMonitor).expect("solves")).len(), 1);
            let map = linear_map(&chart, &boundary, &NoMonitor).expect("maps");
            assert_eq!((map.folded(), map.method()), (1, Method::MMatrix));
            assert!(map.edges_changed() > 0);
        }
    }

    #[test]
    fn a_map_beyond_double_precision_is_refused() {
        let chart = filled(&shapes::finger(12, 22));
        let boundary = Boundary::circle(&chart, Mids::Arc);
        let refused = linear_map(&chart, &boundary, &NoMonitor);
        assert!(matches!(refused, Err(Error::Folded { .. })), "area ratio e^88: {refused:?}");
    }
}
