//! The fixed-point grid of the parametric plane: what makes the certificate exact.
//!
//! Before anything is proven, parameters are rounded to multiples of 2^-52 (vertices) and 2^-53 (mid-edge nodes).
//! Every such number with |u| <= 1 is a double, so what is proven is what is written; midpoints of edges are
//! exact; and the Bernstein coefficients of every jacobian are integers below 2^118, exact in `i128`.

/// Grid units per unit of length: 2^53.
pub const UNITS: f64 = 9_007_199_254_740_992.0;

/// Coordinates saturate here (|u| <= 2); a valid map never comes near.
const LIMIT: i64 = 1 << 54;

/// A point of the parametric plane, in units of 2^-53.
///
/// # Example
///
/// ```
/// use planish_core::grid::{GridPoint, orientation};
///
/// let (p, q) = (GridPoint::vertex([0.1, 0.7]), GridPoint::vertex([0.3, -0.2]));
/// // Not 0.1, but the nearest multiple of 2^-52; which a double holds, so that it is written as it is proven.
/// assert!((p.uv()[0] - 0.1).abs() < 1.2e-16);
/// assert_eq!(GridPoint::exact(p.uv()), Some(p));
/// // Midpoints are exact, and so is every decision: moved by one unit, the middle lies left of the edge.
/// let middle = p.midpoint(q);
/// assert_eq!(orientation(p, q, middle), 0);
/// assert!(orientation(p, q, GridPoint { x: middle.x + 1, ..middle }) > 0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub struct GridPoint {
    /// First coordinate, in units of 2^-53.
    pub x: i64,
    /// Second coordinate, in units of 2^-53.
    pub y: i64,
}

impl GridPoint {
    /// The nearest point on the grid of vertices (multiples of 2^-52). Coordinates beyond 2 saturate, and
    /// not-a-number becomes 0: rounding is total, and whether the result is valid is decided on the result.
    pub fn vertex(uv: [f64; 2]) -> Self {
        let [x, y] = uv.map(|c| ((c * (UNITS / 2.0)).round_ties_even() as i64).clamp(-LIMIT / 2, LIMIT / 2) * 2);
        Self { x, y }
    }

    /// The nearest point on the grid of mid-edge nodes (multiples of 2^-53); see [`GridPoint::vertex`].
    pub fn mid(uv: [f64; 2]) -> Self {
        let [x, y] = uv.map(|c| ((c * UNITS).round_ties_even() as i64).clamp(-LIMIT, LIMIT));
        Self { x, y }
    }

    /// The point with exactly these coordinates, if they lie on the grid of mid-edge nodes and within |u| <= 2.
    pub fn exact(uv: [f64; 2]) -> Option<Self> {
        let point = Self::mid(uv);
        (point.uv() == uv).then_some(point)
    }

    /// The coordinates as doubles: exact while |u| <= 1.
    pub fn uv(self) -> [f64; 2] {
        [self.x as f64 / UNITS, self.y as f64 / UNITS]
    }

    /// Whether this point lies on the coarser grid of vertices.
    pub fn is_vertex(self) -> bool {
        self.x % 2 == 0 && self.y % 2 == 0
    }

    /// The exact midpoint of two points on the grid of vertices.
    pub fn midpoint(self, other: Self) -> Self {
        debug_assert!(self.is_vertex() && other.is_vertex());
        Self { x: (self.x + other.x) / 2, y: (self.y + other.y) / 2 }
    }

    /// `self - origin`.
    pub fn from_origin(self, origin: Self) -> GridVector {
        GridVector { x: self.x - origin.x, y: self.y - origin.y }
    }
}

/// A vector of the parametric plane in grid units. Points saturate at 2^54, so that the vectors of a jacobian stay
/// below 2^59, and their products below 2^118.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridVector {
    /// First component.
    pub x: i64,
    /// Second component.
    pub y: i64,
}

impl GridVector {
    /// `self - other`.
    pub fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y }
    }

    /// The exact determinant `self x other`.
    pub fn cross(self, other: Self) -> i128 {
        i128::from(self.x) * i128::from(other.y) - i128::from(self.y) * i128::from(other.x)
    }
}

/// The middle Bezier point `2 m - (p + q) / 2` of the arc from `p` through `m` to `q`, relative to `origin`.
/// Exact when `p` and `q` lie on the grid of vertices.
///
/// ```
/// use planish_core::grid::{GridPoint, bezier_control};
///
/// let (p, q) = (GridPoint::vertex([0.0, 0.0]), GridPoint::vertex([1.0, 0.0]));
/// // On the chord, the middle node is the middle control point; above it, that is twice as high.
/// let straight = bezier_control(p, p.midpoint(q), q, p);
/// assert_eq!((straight.x, straight.y), (p.midpoint(q).x, 0));
/// let m = GridPoint::mid([0.5, 0.125]);
/// assert_eq!(bezier_control(p, m, q, p).y, 2 * m.y);
/// ```
pub fn bezier_control(p: GridPoint, m: GridPoint, q: GridPoint, origin: GridPoint) -> GridVector {
    let (p, m, q) = (p.from_origin(origin), m.from_origin(origin), q.from_origin(origin));
    GridVector { x: 2 * m.x - (p.x + q.x) / 2, y: 2 * m.y - (p.y + q.y) / 2 }
}

/// The exact orientation of the triangle `abc`: positive when it turns left. In grid units squared.
pub fn orientation(a: GridPoint, b: GridPoint, c: GridPoint) -> i128 {
    b.from_origin(a).cross(c.from_origin(a))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn grid_points_are_doubles(x in -1.0..1.0f64, y in -1.0..1.0f64) {
            for p in [GridPoint::vertex([x, y]), GridPoint::mid([x, y])] {
                prop_assert_eq!(GridPoint::exact(p.uv()), Some(p));
                prop_assert!((p.uv()[0] - x).abs() <= 1.2e-16 && (p.uv()[1] - y).abs() <= 1.2e-16);
            }
            prop_assert!(GridPoint::vertex([x, y]).is_vertex());
        }

        #[test]
        fn midpoints_are_exact(a in -1.0..1.0f64, b in -1.0..1.0f64) {
            let (p, q) = (GridPoint::vertex([a, b]), GridPoint::vertex([b, a]));
            let m = p.midpoint(q);
            prop_assert_eq!(2 * m.x, p.x + q.x);
            prop_assert_eq!(orientation(p, m, q), 0);
        }
    }

    #[test]
    fn rounding_is_total() {
        assert_eq!(GridPoint::vertex([f64::NAN, 1e300]), GridPoint { x: 0, y: LIMIT });
        assert_eq!(GridPoint::exact([f64::INFINITY, 0.0]), None);
        assert_eq!(GridPoint::exact([1e-17, 0.0]), None);
    }
}
