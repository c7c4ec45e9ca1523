//! Certify: the proof that a quadratic map is one-to-one.
//!
//! **Theorem.** Let F be continuous on a chart and quadratic on each triangle, with
//! (a) every edge in one or two triangles, the two traversing it in opposite directions with the same three nodes;
//! (b) det > 0 on every closed triangle;
//! (c) one boundary loop, the outer one, star-shaped about 0 and winding +1: for every arc with Bezier points
//!     (p0, c, p1) the signs of p0 x c, p0 x p1 and c x p1 are positive;
//! (d) every other loop, traversed with the chart on its left, star-shaped about a point c_k (the three products,
//!     relative to c_k, are negative) and winding -1.
//! Then F is one-to-one onto the region inside the outer loop minus the holes.
//!
//! *Why.* Off the image of the boundary the number N(q) of preimages of q equals its winding number W(q) = [q
//! inside the outer loop] - sum over k of [q inside hole k], as every preimage counts +1. So N <= 1, and holes
//! neither overlap nor leave the disk. Near any point the map has local degree at least 1; two points with the
//! same image would give N >= 2 nearby, or N >= 1 > W beside a loop: a contradiction.
//!
//! Everything is decided on integers, exactly, from the cells and the uv of the nodes alone: [`prove`] knows
//! nothing of how the map was made. Only it can make a [`CertifiedMap`].

mod arcs;
mod incidence;
pub(crate) mod polygons;
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
    /// Arcs of the outer loop.
    pub outer_arcs: usize,
    /// For each hole, in the order of the loops, its centre.
    pub hole_centres: Vec<GridPoint>,
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
/// // Without the last triangle the origin lies on the boundary, which does not run around it.
/// assert_eq!(refused(&|m| m.cells.truncate(2)), Error::OuterLoop { count: 0, loops: 1 });
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
    /// No loop, or more than one, is an outer one.
    #[error("{count} of {loops} boundary loops run around the origin star-shaped, winding once; exactly one must")]
    OuterLoop {
        /// How many do.
        count: usize,
        /// How many loops there are.
        loops: usize,
    },
    /// A loop cannot be seen from any of the given centres.
    #[error("the hole whose loop begins at node {node} is not star-shaped about any of the {centres} given centres")]
    Hole {
        /// The first node of its loop.
        node: u32,
        /// How many centres were given.
        centres: usize,
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
    // (c) Exactly one loop runs around the origin to the left.
    let origin = GridPoint::default();
    let around_origin: Vec<usize> = (0..arcs.len()).filter(|i| arcs::winds_once(&arcs[*i], origin, 1)).collect();
    let [outer] = around_origin[..] else {
        return Err(Error::OuterLoop { count: around_origin.len(), loops: loops.len() });
    };
    certificate.outer_arcs = arcs[outer].len();
    // (d) Any of the given centres will do for any hole: the theorem asks for one, not for a particular one.
    for (i, hole) in arcs.iter().enumerate() {
        if i == outer {
            continue;
        }
        let seen_from = map.hole_centres.iter().find(|c| arcs::winds_once(hole, **c, -1));
        let Some(centre) = seen_from else {
            return Err(Error::Hole { node: loops[i][0][0], centres: map.hole_centres.len() });
        };
        certificate.hole_centres.push(*centre);
    }
    Ok(CertifiedMap { map, certificate })
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
        outer_arcs: 0,
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
