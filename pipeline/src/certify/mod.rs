//! Certify: the proof that a quadratic map is one-to-one.
//!
//! **Theorem.** Let F be continuous on a chart and quadratic on each triangle, with
//! (a) every edge in one or two triangles, the two traversing it in opposite directions with the same three nodes;
//! (b) det > 0 on every closed triangle;
//! (c) one boundary loop, the outer one, star-shaped about 0 and winding +1: for every arc with Bezier points
//!     (p0, c, p1) the signs of p0 x c, p0 x p1 and c x p1 are positive;
//! (d) every other loop, traversed with the chart on its left, star-shaped about a point c_k (the three products,
//!     relative to c_k, are negative) and winding -1;
//! or, in place of (c) and (d),
//! (e) loops that are simple and disjoint, of which exactly one turns left: the outer one.
//! Then F is one-to-one onto the region inside the outer loop minus the holes.
//!
//! *Why.* Off the image of the boundary the number N(q) of preimages of q equals its winding number W(q) = [q
//! inside the outer loop] - sum over k of [q inside hole k], as every preimage counts +1. So N <= 1, and holes
//! neither overlap nor leave the outer loop. Near any point the map has local degree at least 1; two points with the
//! same image would give N >= 2 nearby, or N >= 1 > W beside a loop: a contradiction. (c) and (d) are the cheap test; (e)
//! asks for no shape (`curves.rs` has how it is decided): simple loops have winding numbers of +1 and -1 about what they
//! enclose, and as W = N is nowhere negative, holes lie inside the outer loop, and none inside another.
//!
//! Everything is decided on integers, exactly, from the cells and the uv of the nodes alone: [`prove`] knows
//! nothing of how the map was made. Only it can make a [`CertifiedMap`].

mod arcs;
mod curves;
mod incidence;
pub(crate) mod polygons;
mod sides;
mod star;
mod straight;

use crate::fem::bernstein::{JacobianBezier, Validity};
use crate::grid::GridPoint;
use crate::topology::FaceId;
pub use arcs::Arc;
pub use incidence::IncidenceError;
pub use polygons::Wrong;
pub use star::star_centre;
pub use straight::{StraightError, StraightMap, parts, prove_straight};

/// A quadratic map as it is written: cells of six nodes (vertices, then the middles of 01, 12, 20), the uv of
/// the nodes, and a point in each hole from which the whole loop can be seen.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanarMap {
    /// The nodes of each triangle.
    pub cells: Vec<[u32; 6]>,
    /// The uv of each node.
    pub nodes: Vec<GridPoint>,
    /// One point per hole, in any order.
    pub hole_centres: Vec<GridPoint>,
}

impl PlanarMap {
    /// Whether the middle of every edge that one cell has lies in the middle of its ends, exactly: the boundary consists of
    /// chords, as natural ones do. Vertices lie on the grid of vertices.
    pub fn boundary_is_in_chords(&self) -> bool {
        // An edge is known by its middle.
        let mut cells_at = vec![0_u8; self.nodes.len()];
        for mid in self.cells.iter().flat_map(|cell| &cell[3..]) {
            let count = &mut cells_at[*mid as usize];
            *count = count.saturating_add(1);
        }
        let is_inside_or_chord = |from: u32, mid: u32, to: u32| {
            let [p, m, q] = [from, mid, to].map(|n| self.nodes[n as usize]);
            cells_at[mid as usize] > 1 || p.midpoint(q) == m
        };
        self.cells.iter().all(|cell| (0..3).all(|k| is_inside_or_chord(cell[k], cell[3 + k], cell[(k + 1) % 3])))
    }
}

/// What was proven, and how.
#[derive(Clone, Debug, PartialEq)]
pub struct Certificate {
    /// Triangles proven by the signs of their Bernstein coefficients.
    pub by_bounds: usize,
    /// Triangles proven by strict copositivity.
    pub by_exact: usize,
    /// The depth of subdivision behind the bounds: how often the triangle that took most was quartered.
    pub depth: u32,
    /// A lower bound of the jacobian determinant (on the reference triangle of area 1/2) over all triangles.
    pub det_lower_bound: f64,
    /// How the boundary was proven.
    pub boundary: BoundaryArgument,
    /// Arcs of the outer loop.
    pub outer_arcs: usize,
    /// How many other loops there are.
    pub holes: usize,
    /// For each hole, in the order of the loops, its centre, where the loops are star-shaped; else none.
    pub hole_centres: Vec<GridPoint>,
}

/// Why the loops of a boundary are those of a disk with holes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoundaryArgument {
    /// Each is star-shaped about a point: premises (c) and (d) of the theorem.
    StarShaped,
    /// They are simple, disjoint, and one turns left: premise (e).
    Simple,
}

/// A map that is proven to be one-to-one. Made by [`prove`] only.
#[derive(Clone, Debug)]
pub struct CertifiedMap {
    map: PlanarMap,
    certificate: Certificate,
}

impl CertifiedMap {
    /// The map.
    pub fn map(&self) -> &PlanarMap {
        &self.map
    }

    /// The proof in numbers.
    pub fn certificate(&self) -> &Certificate {
        &self.certificate
    }
}

/// Why a map is not proven.
///
/// # Example
///
/// Three triangles around the origin, and what is said of twins that are each wrong in one way.
///
/// ```
/// use planish_core::certify::{Error, IncidenceError, PlanarMap, prove};
/// use planish_core::grid::GridPoint;
///
/// let [a, b, c] = [[0.5, 0.0], [-0.5, 0.5], [-0.5, -0.5]].map(GridPoint::vertex);
/// let o = GridPoint::default();
/// let [ab, bc, ca] = [a.midpoint(b), b.midpoint(c), c.midpoint(a)];
/// let nodes = vec![a, b, c, o, ab, bc, ca, a.midpoint(o), b.midpoint(o), c.midpoint(o)];
/// let cells = vec![[0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [2, 0, 3, 6, 7, 9]];
/// let map = PlanarMap { cells, nodes, hole_centres: vec![] };
/// assert!(prove(map.clone()).is_ok());
///
/// let refused = |change: &dyn Fn(&mut PlanarMap)| {
///     let mut twin = map.clone();
///     change(&mut twin);
///     prove(twin).expect_err("no proof")
/// };
/// // Vertices lie on multiples of 2^-52, two units of the grid: otherwise midpoints would be rounded.
/// assert_eq!(refused(&|m| m.nodes[3].x += 1), Error::OffGrid { node: 3 });
/// // A second copy of all three, over the first one: each is one-to-one, together they are not.
/// let doubled = refused(&|m| {
///     m.nodes.extend(m.nodes.clone());
///     m.cells.extend(m.cells.clone().iter().map(|cell| cell.map(|node| node + 10)));
/// });
/// assert!(matches!(doubled, Error::Boundary { .. }));
/// // A triangle that is there twice.
/// let twice = refused(&|m| m.cells.push(m.cells[0]));
/// assert!(matches!(twice, Error::Incidence(IncidenceError::Edge { from: 0, to: 1, .. })));
/// ```
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The cells are no surface with boundary.
    #[error(transparent)]
    Incidence(#[from] IncidenceError),
    /// A node is too far away, or no double.
    #[error("node {node} lies beyond 2, or its coordinates are no doubles")]
    Inexact {
        /// The node.
        node: u32,
    },
    /// The centre of a hole is too far away, or no double.
    #[error("the centre of hole {hole} lies beyond 2, or its coordinates are no doubles")]
    InexactCentre {
        /// Its position among the given centres.
        hole: usize,
    },
    /// A vertex is off the grid on which midpoints are exact.
    #[error("vertex node {node} is no multiple of 2^-52")]
    OffGrid {
        /// The node.
        node: u32,
    },
    /// The jacobian of some triangles is not positive everywhere.
    #[error("{count} triangles are invalid: their jacobian is not positive everywhere (first: {first})")]
    InvalidTriangles {
        /// How many.
        count: usize,
        /// The first of them.
        first: FaceId,
        /// All of them.
        all: Vec<FaceId>,
    },
    /// The loops of the boundary are not those of a disk with holes, or it is not decided whether they are: neither
    /// star-shaped about the origin and the given centres, nor simple, disjoint and one of them turning left.
    #[error("the boundary is not shown to be that of a disk with holes: {wrong} (its loop begins at node {node})")]
    Boundary {
        /// What is wrong. Loops are numbered by their least nodes.
        wrong: Wrong,
        /// The first node of the loop.
        node: u32,
    },
}

/// Proves that `map` is one-to-one.
///
/// # Errors
/// The first part of the theorem's premises that fails, with its evidence.
///
/// # Example
///
/// A square of two triangles from elsewhere, its boundary straight and around the origin.
///
/// ```
/// use planish_core::certify::{Error, PlanarMap, prove};
/// use planish_core::grid::GridPoint;
///
/// let [a, b, c, d] = [[0.5, 0.0], [0.0, 0.5], [-0.5, 0.0], [0.0, -0.5]].map(GridPoint::vertex);
/// let middles = [a.midpoint(b), b.midpoint(c), c.midpoint(a), c.midpoint(d), d.midpoint(a)];
/// let nodes = [vec![a, b, c, d], middles.to_vec()].concat();
/// // Vertices, then the middles of the edges 01, 12, 20.
/// let cells = vec![[0, 1, 2, 4, 5, 6], [0, 2, 3, 6, 7, 8]];
/// let map = PlanarMap { cells, nodes, hole_centres: vec![] };
/// let proven = prove(map.clone())?;
/// assert_eq!(proven.certificate().outer_arcs, 4);
///
/// // The diagonal bent beyond a corner: one triangle folds.
/// let mut folded = map;
/// folded.nodes[6] = GridPoint::mid([0.0, 0.4]);
/// assert!(matches!(prove(folded), Err(Error::InvalidTriangles { count: 1, .. })));
/// # Ok::<(), Error>(())
/// ```
pub fn prove(map: PlanarMap) -> Result<CertifiedMap, Error> {
    let loops = incidence::boundary_loops(&map.cells, map.nodes.len())?;
    refuse_inexact(&map)?;
    let vertices = map.cells.iter().flat_map(|c| &c[..3]);
    if let Some(node) = vertices.copied().find(|n| !map.nodes[*n as usize].is_vertex()) {
        return Err(Error::OffGrid { node });
    }
    let mut certificate = prove_triangles(&map)?;
    let arcs: Vec<Vec<Arc>> = loops.iter().map(|l| arcs_of(l, &map.nodes)).collect();
    let loops_are = star_shaped(&arcs, &map.hole_centres).map_or_else(|| simple(&arcs), Ok);
    let boundary = loops_are.map_err(|wrong| Error::Boundary { wrong, node: loops[wrong.first_loop()][0][0] })?;
    certificate.boundary = boundary.argument;
    certificate.outer_arcs = arcs[boundary.outer].len();
    certificate.holes = arcs.len() - 1;
    certificate.hole_centres = boundary.hole_centres;
    Ok(CertifiedMap { map, certificate })
}

/// A boundary that is that of a disk with holes.
struct ProvenBoundary {
    argument: BoundaryArgument,
    /// The number of the outer loop.
    outer: usize,
    hole_centres: Vec<GridPoint>,
}

/// Premises (c) and (d), if they hold: exactly one loop runs around the origin to the left, and every other can be seen
/// from one of the `centres`. (Any will do for any hole: the theorem asks for one, not for a particular one.)
fn star_shaped(arcs: &[Vec<Arc>], centres: &[GridPoint]) -> Option<ProvenBoundary> {
    let origin = GridPoint::default();
    let around_origin: Vec<usize> = (0..arcs.len()).filter(|i| arcs::winds_once(&arcs[*i], origin, 1)).collect();
    let [outer] = around_origin[..] else { return None };
    let mut hole_centres = Vec::with_capacity(arcs.len() - 1);
    for hole in (0..arcs.len()).filter(|i| *i != outer) {
        hole_centres.push(*centres.iter().find(|c| arcs::winds_once(&arcs[hole], **c, -1))?);
    }
    Some(ProvenBoundary { argument: BoundaryArgument::StarShaped, outer, hole_centres })
}

/// Premise (e).
fn simple(arcs: &[Vec<Arc>]) -> Result<ProvenBoundary, Wrong> {
    let outer = curves::outer_of(arcs)?;
    Ok(ProvenBoundary { argument: BoundaryArgument::Simple, outer, hole_centres: vec![] })
}

fn arcs_of(boundary_loop: &[incidence::ArcNodeIds], nodes: &[GridPoint]) -> Vec<Arc> {
    boundary_loop.iter().map(|arc| arcs::arc_of(arc, nodes)).collect()
}

/// Everything is proven of the doubles that are written: every point must be one. This also bounds the integers.
fn refuse_inexact(map: &PlanarMap) -> Result<(), Error> {
    let exact = |p: &GridPoint| GridPoint::exact(p.uv()) == Some(*p);
    if let Some(node) = map.cells.iter().flatten().copied().find(|n| !exact(&map.nodes[*n as usize])) {
        return Err(Error::Inexact { node });
    }
    match map.hole_centres.iter().position(|c| !exact(c)) {
        Some(hole) => Err(Error::InexactCentre { hole }),
        None => Ok(()),
    }
}

/// Premise (b): the certificate as far as triangles go. All of them are looked at, so that the error names all that fail.
fn prove_triangles(map: &PlanarMap) -> Result<Certificate, Error> {
    let mut certificate = Certificate {
        by_bounds: 0,
        by_exact: 0,
        depth: 0,
        det_lower_bound: f64::INFINITY,
        boundary: BoundaryArgument::Simple,
        outer_arcs: 0,
        holes: 0,
        hole_centres: vec![],
    };
    let mut invalid = Vec::new();
    for (f, cell) in map.cells.iter().enumerate() {
        let det = JacobianBezier::new(cell.map(|n| map.nodes[n as usize]));
        match det.validity() {
            Validity::ByBounds => certificate.by_bounds += 1,
            Validity::ByCopositivity => certificate.by_exact += 1,
            Validity::Invalid => invalid.push(FaceId::at(f)),
        }
        let bound = det.lower_bound();
        certificate.depth = certificate.depth.max(bound.depth);
        // A valid triangle has a positive determinant even where the bound of that depth is not.
        certificate.det_lower_bound = certificate.det_lower_bound.min(bound.value.max(0.0));
    }
    match invalid.first() {
        Some(first) => Err(Error::InvalidTriangles { count: invalid.len(), first: *first, all: invalid }),
        None => Ok(certificate),
    }
}

#[cfg(test)]
mod tests;
