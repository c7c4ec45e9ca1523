//! Jacobians of curved triangles: when is a quadratic triangle valid?
//!
//! The jacobian determinant of a 6-node triangle is a quadratic polynomial, det = l^T M l in barycentric
//! coordinates l. With Bezier points p_i and p_ij = 2 m_ij - (p_i + p_j) / 2 and the derivatives
//! a_i = 2 (p_i1 - p_i0), b_i = 2 (p_i2 - p_i0) at corner i, the entries of M are the Bernstein coefficients
//! M_ii = a_i x b_i and M_ij = (a_i x b_j + a_j x b_i) / 2. The triangle is valid (det > 0 on all of it) exactly
//! when M is strictly copositive (Hadeler 1983, doi 10.1016/0024-3795(83)90095-2), which a few signs decide.
//! Bounds by subdivision (Johnen, Remacle and Geuzaine 2013, doi 10.1016/j.jcp.2012.08.051) serve the reported
//! lower bound only: they never decide a double root.

use crate::grid::{GridPoint, GridVector, UNITS, bezier_control};
use num_bigint::BigInt;

/// How deep triangles are subdivided for the reported lower bound: integers of that depth still fit `i128`.
const DEPTH: u32 = 4;

/// What proves a triangle valid, or that it is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Validity {
    /// All six Bernstein coefficients are positive.
    ByBounds,
    /// The matrix of coefficients is strictly copositive.
    ByCopositivity,
    /// The determinant is zero or negative somewhere on the closed triangle.
    Invalid,
}

/// A lower bound of a determinant, and what it took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowerBound {
    /// The bound, rounded down; on the reference triangle of area 1/2.
    pub value: f64,
    /// How often triangles were subdivided.
    pub depth: u32,
}

/// The least and the largest value of a polynomial over a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The least value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
}

/// The Bernstein coefficients of a jacobian determinant, doubled, in grid units squared (2^-106): exact.
///
/// # Example
///
/// The middle of an edge may move along it, up to a quarter of the way to a vertex: there the triangle folds.
///
/// ```
/// use planish_core::fem::bernstein::{JacobianBezier, Validity};
/// use planish_core::grid::GridPoint;
///
/// let [a, b, c] = [[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]].map(GridPoint::vertex);
/// let with_middle = |x: f64| {
///     JacobianBezier::new([a, b, c, GridPoint::mid([x, 0.0]), b.midpoint(c), c.midpoint(a)])
/// };
/// assert_eq!(with_middle(0.25).validity(), Validity::ByBounds);
/// assert_eq!(with_middle(0.37).validity(), Validity::ByBounds);
/// assert_eq!(with_middle(0.375).validity(), Validity::Invalid);
/// // A straight triangle has twice its area everywhere.
/// assert_eq!(with_middle(0.25).coefficients(), [0.25; 6]);
/// assert!(with_middle(0.25).lower_bound().value <= 0.25);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JacobianBezier {
    /// At the corners: 2 M_00, 2 M_11, 2 M_22.
    pub corner: [i128; 3],
    /// At the edges: 2 M_01, 2 M_12, 2 M_20.
    pub edge: [i128; 3],
}

impl JacobianBezier {
    /// The coefficients of the triangle with these nodes (three vertices, then the middles of 01, 12, 20), whose
    /// vertices lie on the grid of vertices.
    pub fn new(nodes: [GridPoint; 6]) -> Self {
        let [p, q, r, m01, m12, m20] = nodes;
        // The six Bezier points, all relative to the first vertex.
        let corner = [p, q, r].map(|v| v.from_origin(p));
        let c01 = bezier_control(p, m01, q, p);
        let c12 = bezier_control(q, m12, r, p);
        let c20 = bezier_control(r, m20, p, p);
        // The derivatives at the corners, along xi and along eta.
        let a = [c01.minus(corner[0]), corner[1].minus(c01), c12.minus(c20)].map(twice);
        let b = [c20.minus(corner[0]), c12.minus(c01), corner[2].minus(c20)].map(twice);
        // Twice M_ii and M_ij: the latter might not be an integer.
        let corners = [0, 1, 2].map(|i| 2 * a[i].cross(b[i]));
        let mixed = |i: usize, j: usize| a[i].cross(b[j]) + a[j].cross(b[i]);
        Self { corner: corners, edge: [mixed(0, 1), mixed(1, 2), mixed(2, 0)] }
    }

    /// Decides exactly whether the determinant is positive on the closed triangle.
    ///
    /// # Example
    ///
    /// A negative coefficient proves nothing, and bounds by subdivision may not either: the exact test decides.
    ///
    /// ```
    /// use planish_core::fem::bernstein::{JacobianBezier, Validity};
    ///
    /// // In the middle of edge 01 the determinant is (d_0 + 2 e_01 + d_1) / 4 = 0 ...
    /// let touching = JacobianBezier { corner: [4, 4, 4], edge: [-4, 4, 4] };
    /// assert_eq!(touching.validity(), Validity::Invalid);
    /// // ... and here all of that edge is above zero, by a hair.
    /// let above = JacobianBezier { corner: [4, 5, 4], edge: [-4, 4, 4] };
    /// assert_eq!(above.validity(), Validity::ByCopositivity);
    /// ```
    pub fn validity(&self) -> Validity {
        if self.corner.iter().any(|c| *c <= 0) {
            return Validity::Invalid;
        }
        if self.edge.iter().all(|c| *c > 0) {
            return Validity::ByBounds;
        }
        if self.copositive() { Validity::ByCopositivity } else { Validity::Invalid }
    }

    /// Whether M is strictly copositive, its diagonal being positive.
    fn copositive(&self) -> bool {
        let d = self.corner.map(BigInt::from);
        let e = self.edge.map(BigInt::from);
        let zero = BigInt::from(0);
        // Edge k joins corners k and k + 1: a negative entry must not outweigh its diagonal.
        let fails_on_edge = |k: usize| e[k] < zero && &e[k] * &e[k] >= &d[k] * &d[(k + 1) % 3];
        if (0..3).any(fails_on_edge) {
            return false;
        }
        // The adjugate of M. The row and column of corner k hold the entries e[k] (with k + 1) and e[k + 2].
        let diagonal = |k: usize| &d[(k + 1) % 3] * &d[(k + 2) % 3] - &e[(k + 1) % 3] * &e[(k + 1) % 3];
        let mixed = |k: usize| &e[(k + 1) % 3] * &e[(k + 2) % 3] - &e[k] * &d[(k + 2) % 3];
        let det = &d[0] * diagonal(0) + &e[0] * mixed(0) + &e[2] * mixed(2);
        // Hadeler's criterion: where no edge fails, M does exactly if det M <= 0 and all of adj M is positive.
        let adjugate_is_positive = (0..3).all(|k| diagonal(k) > zero && mixed(k) > zero);
        det > zero || !adjugate_is_positive
    }

    /// A lower bound of the determinant over the triangle. Subdivides while a coefficient is not positive, to a fixed
    /// depth.
    pub fn lower_bound(&self) -> LowerBound {
        let mut pieces = vec![*self];
        let mut value = f64::INFINITY;
        let mut depth = 0;
        loop {
            // Quarters come multiplied by four.
            let scale = (4.0_f64).powi(-(depth as i32)) / (2.0 * UNITS * UNITS);
            let is_last = depth == DEPTH;
            let mut open = Vec::new();
            for piece in pieces {
                let least = piece.min_coefficient();
                if is_last || least > 0 {
                    value = value.min((least as f64).next_down() * scale);
                } else {
                    open.extend(piece.quarters());
                }
            }
            if open.is_empty() {
                return LowerBound { value, depth };
            }
            pieces = open;
            depth += 1;
        }
    }

    fn min_coefficient(&self) -> i128 {
        self.corner.iter().chain(&self.edge).fold(i128::MAX, |m, c| m.min(*c))
    }

    /// The coefficients on the four triangles between corners and edge middles, times four.
    fn quarters(&self) -> [Self; 4] {
        let (d, e) = (self.corner, self.edge);
        // On an edge: the value in the middle, times four, and the coefficients half-way to it, times four.
        let middle = [0, 1, 2].map(|k| d[k] + 2 * e[k] + d[(k + 1) % 3]);
        let near = |k: usize, end: usize| 2 * (d[end] + e[k]);
        // Between the middles of the two edges at corner k.
        let inner = [0, 1, 2].map(|k| d[k] + e[k] + e[(k + 2) % 3] + e[(k + 1) % 3]);
        let at_corner = |k: usize| Self {
            corner: [4 * d[k], middle[k], middle[(k + 2) % 3]],
            edge: [near(k, k), inner[k], near((k + 2) % 3, k)],
        };
        let centre = Self { corner: [middle[0], middle[1], middle[2]], edge: [inner[1], inner[2], inner[0]] };
        [at_corner(0), at_corner(1), at_corner(2), centre]
    }

    /// The coefficients as doubles, M_00, M_11, M_22, M_01, M_12, M_20, on the reference triangle of area 1/2.
    pub fn coefficients(&self) -> [f64; 6] {
        let [a, b, c] = self.corner;
        let [d, e, f] = self.edge;
        [a, b, c, d, e, f].map(|v| v as f64 / (2.0 * UNITS * UNITS))
    }
}

fn twice(v: GridVector) -> GridVector {
    GridVector { x: 2 * v.x, y: 2 * v.y }
}

/// The least and the largest value over the triangle of the quadratic polynomial with these Bernstein
/// coefficients (M_00, M_11, M_22, M_01, M_12, M_20), up to rounding.
///
/// # Example
///
/// Coefficients of edges are bounds, not values: one may be negative where the polynomial is not.
///
/// ```
/// use planish_core::fem::bernstein::range;
///
/// // On edge 01: (1-t)^2 - t (1-t) + t^2, with the least value 1/4 in the middle.
/// let found = range([1.0, 1.0, 1.0, -0.5, 1.0, 1.0]);
/// assert_eq!((found.min, found.max), (0.25, 1.0));
/// ```
pub fn range(c: [f64; 6]) -> Range {
    Range { min: minimum(c), max: -minimum(c.map(|v| -v)) }
}

fn minimum(c: [f64; 6]) -> f64 {
    let corners = c[0].min(c[1]).min(c[2]);
    let edges = [(0, 3, 1), (1, 4, 2), (2, 5, 0)].map(|(a, m, b)| min_on_edge(c[a], c[m], c[b]));
    let inside = min_inside(c).unwrap_or(f64::INFINITY);
    edges.into_iter().fold(corners.min(inside), f64::min)
}

/// The least value of (1-t)^2 a + 2 t (1-t) m + t^2 b for t in [0, 1].
fn min_on_edge(a: f64, m: f64, b: f64) -> f64 {
    let bend = (a - m) + (b - m);
    // Where the slope is zero.
    let t = (a - m) / bend;
    let is_least_between = bend > 0.0 && t > 0.0 && t < 1.0;
    if is_least_between { a + t * (m - a) } else { a.min(b) }
}

/// The value at the stationary point, if it lies inside and is a minimum: l ~ adj(M) e, value det M / sum.
fn min_inside(c: [f64; 6]) -> Option<f64> {
    // With x, y the coordinates of corners 1 and 2: value = c0 + 2 g.x + x^T H x.
    let g = [c[3] - c[0], c[5] - c[0]];
    let h = [c[0] - 2.0 * c[3] + c[1], c[0] - c[3] - c[5] + c[4], c[0] - 2.0 * c[5] + c[2]];
    let det = h[0] * h[2] - h[1] * h[1];
    let x = (h[1] * g[1] - h[2] * g[0]) / det;
    let y = (h[1] * g[0] - h[0] * g[1]) / det;
    let is_minimum = det > 0.0 && h[0] > 0.0;
    let is_inside = x > 0.0 && y > 0.0 && x + y < 1.0;
    // There H x = -g, so that half of the linear term is left.
    (is_minimum && is_inside).then(|| c[0] + g[0] * x + g[1] * y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use num_bigint::Sign;
    use proptest::prelude::*;

    /// The exact sign of the minimum over the triangle, found another way: by the values at corners and at the
    /// stationary points of edges and of the inside, all in rationals.
    fn positive_everywhere(det: &JacobianBezier) -> bool {
        let big = |v: i128| BigInt::from(v);
        let d = det.corner.map(big);
        let e = det.edge.map(big);
        let positive = |v: &BigInt| v.sign() == Sign::Plus;
        let zero = BigInt::from(0);
        for k in 0..3 {
            let (a, m, b) = (&d[k], &e[k], &d[(k + 1) % 3]);
            let bend = a - 2 * m + b;
            let t = a - m;
            // Value at t / bend is (a b - m^2) / bend.
            if !positive(a) || (positive(&bend) && t > zero && t < bend && a * b - m * m <= zero) {
                return false;
            }
        }
        let g = [&e[0] - &d[0], &e[2] - &d[0]];
        let h = [&d[0] - 2 * &e[0] + &d[1], &d[0] - &e[0] - &e[2] + &e[1], &d[0] - 2 * &e[2] + &d[2]];
        let hd = &h[0] * &h[2] - &h[1] * &h[1];
        let (x, y) = (&h[1] * &g[1] - &h[2] * &g[0], &h[1] * &g[0] - &h[0] * &g[1]);
        let inside = positive(&hd) && positive(&h[0]) && positive(&x) && positive(&y) && &x + &y < hd;
        !inside || positive(&(&d[0] * &hd + &g[0] * &x + &g[1] * &y))
    }

    fn coefficients(range: i128) -> impl Strategy<Value = JacobianBezier> {
        let one = move || -range..=range;
        let corner = move || 1..=range;
        ([corner(), corner(), corner()], [one(), one(), one()])
            .prop_map(|(corner, edge)| JacobianBezier { corner, edge })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60_000))]

        #[test]
        fn copositivity_agrees_with_the_exact_minimum(small in coefficients(12), large in coefficients(1 << 116)) {
            // Small numbers meet double roots and exact zeros often.
            for det in [small, large] {
                prop_assert_eq!(det.validity() != Validity::Invalid, positive_everywhere(&det), "{:?}", det);
            }
        }
    }

    proptest! {
        #[test]
        fn bounds_enclose_the_range(det in coefficients(1 << 110)) {
            let LowerBound { value: low, depth } = det.lower_bound();
            let Range { min: least, max: largest } = range(det.coefficients());
            let size = det.coefficients().iter().fold(0.0_f64, |m, c| m.max(c.abs()));
            prop_assert!(low <= least + 1e-12 * size && depth <= DEPTH);
            let plain = det.min_coefficient() as f64 / (2.0 * UNITS * UNITS);
            prop_assert!(low >= plain - 1e-15 * plain.abs());
            for i in 0..=10 {
                for j in 0..=10 - i {
                    let l = [f64::from(10 - i - j) / 10.0, f64::from(i) / 10.0, f64::from(j) / 10.0];
                    let c = det.coefficients();
                    let value = c[0] * l[0] * l[0] + c[1] * l[1] * l[1] + c[2] * l[2] * l[2]
                        + 2.0 * (c[3] * l[0] * l[1] + c[4] * l[1] * l[2] + c[5] * l[2] * l[0]);
                    prop_assert!(least <= value + 1e-12 * size && value <= largest + 1e-12 * size);
                }
            }
        }
    }

    /// A straight triangle on the grid, its mid-edge nodes exact.
    fn straight(p: [[f64; 2]; 3]) -> [GridPoint; 6] {
        let [a, b, c] = p.map(GridPoint::vertex);
        [a, b, c, a.midpoint(b), b.midpoint(c), c.midpoint(a)]
    }

    #[test]
    fn a_straight_triangle_has_twice_its_area_everywhere() {
        let det = JacobianBezier::new(straight([[0.0, 0.0], [0.5, 0.0], [0.0, 0.25]]));
        assert_eq!(det.coefficients(), [0.125; 6]);
        assert_eq!(range(det.coefficients()), Range { min: 0.125, max: 0.125 });
        assert_eq!(det.validity(), Validity::ByBounds);
        let flat = JacobianBezier::new(straight([[0.0, 0.0], [0.5, 0.5], [0.25, 0.25]]));
        assert_eq!(flat.validity(), Validity::Invalid);
    }

    #[test]
    fn one_unit_of_the_grid_decides() {
        let unit = 1.0 / UNITS;
        let valid = straight([[0.0, 0.0], [1.0, 0.0], [0.5, 2.0 * unit]]);
        assert_eq!(JacobianBezier::new(valid).validity(), Validity::ByBounds);
        let upside_down = straight([[0.0, 0.0], [1.0, 0.0], [0.5, -2.0 * unit]]);
        assert_eq!(JacobianBezier::new(upside_down).validity(), Validity::Invalid);
        // The middle of edge 01 a quarter towards corner 1 makes the jacobian vanish at corner 1, exactly.
        let mut nodes = straight([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]);
        nodes[3] = GridPoint::mid([0.375, 0.0]);
        assert_eq!(JacobianBezier::new(nodes).corner[1], 0);
        assert_eq!(JacobianBezier::new(nodes).validity(), Validity::Invalid);
        nodes[3] = GridPoint { x: nodes[3].x - 1, ..nodes[3] };
        assert_ne!(JacobianBezier::new(nodes).validity(), Validity::Invalid);
    }

    #[test]
    fn a_double_root_is_invalid_and_a_hair_above_it_valid() {
        // (l0 - l1)^2 + l2^2 + ... : zero in the middle of edge 01.
        let touching = JacobianBezier { corner: [4, 4, 4], edge: [-4, 4, 4] };
        assert_eq!(touching.validity(), Validity::Invalid);
        let above = JacobianBezier { corner: [4, 5, 4], edge: [-4, 4, 4] };
        assert_eq!(above.validity(), Validity::ByCopositivity);
        // (l0 + l1 - 2 l2)^2: zero on a line through the inside.
        let inside = JacobianBezier { corner: [1, 1, 4], edge: [1, -2, -2] };
        assert_eq!(inside.validity(), Validity::Invalid);
        let lifted = JacobianBezier { corner: [11, 11, 41], edge: [11, -19, -19] };
        assert_eq!(lifted.validity(), Validity::ByCopositivity);
    }

    #[test]
    fn quarters_carry_the_same_polynomial() {
        let det = JacobianBezier { corner: [7, -3, 11], edge: [2, 5, -9] };
        let quarters = det.quarters();
        let value = |d: &JacobianBezier, l: [i128; 3]| {
            let c = d.corner;
            let e = d.edge;
            c[0] * l[0] * l[0]
                + c[1] * l[1] * l[1]
                + c[2] * l[2] * l[2]
                + 2 * (e[0] * l[0] * l[1] + e[1] * l[1] * l[2] + e[2] * l[2] * l[0])
        };
        // The centres of the quarters, in sixths of the whole; values of quarters are scaled by 4 * 9.
        for (quarter, l) in quarters.iter().zip([[4, 1, 1], [1, 4, 1], [1, 1, 4], [2, 2, 2]]) {
            assert_eq!(value(quarter, [1, 1, 1]), value(&det, l), "{l:?}");
        }
    }
}
