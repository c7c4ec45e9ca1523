//! A map by triangles of six nodes, from the plane to space: which curved triangle is a point of the plane in, and where?
//!
//! In a triangle the map to the plane is u(xi) = sum over its nodes N_i(xi) u_i, quadratic in xi. It is one-to-one with
//! positive jacobian (certified maps are), so that Newton's method from the centroid nearly always ends at the only xi of the
//! triangle, in three or four steps. Where it does not, the triangle is halved again and again: the Bezier points of a part
//! contain it (convex hull), so that parts whose box does not hold the point are left out.

use super::bvh::{larger, smaller};
use super::{Bvh, Located};
use crate::vec3::{BoundingBox, Vec3, sub};
use std::sync::OnceLock;

/// Barycentric coordinates above this are inside: rounding of doubles puts points on a side a little outside of both triangles.
const INSIDE: f64 = -1e-9;

/// Newton's method ends when a step is shorter than this, in barycentric coordinates, or after [`STEPS`].
const SHORT: f64 = 1e-13;
const STEPS: usize = 24;

/// And is given up where coordinates exceed this.
const FAR: f64 = 1e3;

/// So often a triangle is halved where Newton's method leads out of it: a part is then 1e-15 of it.
const HALVINGS: u32 = 50;

/// So many parts of it are looked at. By experience a hundred are enough: a point is in few boxes.
const PARTS: usize = 20_000;

/// A side is looked at in so many places before the nearest one is improved.
const PLACES: u32 = 8;

/// A chart: curved triangles in the plane, whose counterparts in space are straight.
///
/// ```
/// use planish_core::evaluate::CurvedMap;
///
/// // A triangle whose long side bulges in the plane; in space it is straight.
/// let points = vec![[0.0, 0.0, 5.0], [2.0, 0.0, 5.0], [0.0, 2.0, 5.0]];
/// let uv = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.7, 0.7], [0.0, 0.5]];
/// let map = CurvedMap::new(points, uv, vec![[0, 1, 2, 3, 4, 5]]);
/// let middle = map.to_space([0.7, 0.7]).expect("there is a triangle");
/// assert!(middle.distance < 1e-12 && (middle.weights[0]).abs() < 1e-12, "on the side that bulges");
/// let x = map.point_of(&middle);
/// assert!((x[0] - 1.0).abs() < 1e-12 && (x[1] - 1.0).abs() < 1e-12);
/// ```
#[derive(Clone, Debug)]
pub struct CurvedMap {
    /// Where corners lie in space; nodes in the middle of sides may be missing at the end.
    points: Vec<Vec3>,
    uv: Vec<[f64; 2]>,
    cells: Vec<[u32; 6]>,
    in_plane: Bvh,
    /// The sides that one triangle has.
    sides: Vec<(u32, u8)>,
    /// By their boxes, made when it is first asked for.
    boundary: OnceLock<Bvh>,
}

/// A point of the boundary of a chart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnBoundary {
    /// The triangle.
    pub cell: u32,
    /// Its side: from corner `side` to the next one.
    pub side: usize,
    /// Where on it, from 0 to 1.
    pub t: f64,
    /// How far it is from the point asked for, in the plane.
    pub distance: f64,
}

impl CurvedMap {
    /// A map of `cells` over nodes whose positions in the plane are `uv`; `points` are those of the corners in space.
    ///
    /// # Panics
    /// Where a triangle names a node that does not exist.
    pub fn new(points: Vec<Vec3>, uv: Vec<[f64; 2]>, cells: Vec<[u32; 6]>) -> Self {
        let in_plane = Bvh::new(cells.iter().map(|cell| Quadratic::of(cell.map(|n| uv[n as usize])).around(WHOLE)));
        let sides = boundary_sides(&cells, uv.len());
        Self { points, uv, cells, in_plane, sides, boundary: OnceLock::new() }
    }

    /// The curved triangles, by their nodes.
    pub fn cells(&self) -> &[[u32; 6]] {
        &self.cells
    }

    /// Where a corner lies in space.
    pub fn point(&self, node: u32) -> Vec3 {
        self.points[node as usize]
    }

    /// The sides that one triangle has: it, and the corner at which the side begins.
    pub fn boundary(&self) -> &[(u32, u8)] {
        &self.sides
    }

    /// The point of the chart at `uv`; where that is outside, the nearest one of the boundary. `None` only where there is no
    /// triangle.
    pub fn to_space(&self, uv: [f64; 2]) -> Option<Located> {
        let here = [uv[0], uv[1], 0.0];
        let mut best: Option<Candidate> = None;
        self.in_plane.overlapping(&BoundingBox { min: here, max: here }, |cell| {
            if best.is_none_or(|best| best.inside < 0.0)
                && let Some(xi) = self.quadratic(cell).newton(uv)
            {
                let inside = barycentric(xi).into_iter().fold(f64::INFINITY, smaller);
                if best.is_none_or(|best| inside > best.inside) {
                    best = Some(Candidate { cell, xi, inside });
                }
            }
        });
        match best {
            Some(Candidate { cell, xi, inside }) if inside >= INSIDE => Some(located(cell, xi, 0.0)),
            _ => self.by_halving(uv).or_else(|| self.at_boundary(uv)),
        }
    }

    /// Where a point lies in space.
    pub fn point_of(&self, located: &Located) -> Vec3 {
        let [a, b, c, ..] = self.cells[located.triangle as usize].map(|n| n as usize);
        let corners = [self.points[a], self.points[b], self.points[c]];
        [0, 1, 2].map(|k| (0..3).map(|i| located.weights[i] * corners[i][k]).sum())
    }

    /// Where the point of a triangle with these weights lies in the plane.
    pub fn uv_of(&self, cell: u32, [_, xi, eta]: [f64; 3]) -> [f64; 2] {
        self.quadratic(cell).at([xi, eta])
    }

    /// How space moves with the plane there: dx/du and dx/dv. Numbers that are none where the map is not positive.
    pub fn derivative(&self, cell: u32, [_, xi, eta]: [f64; 3]) -> [Vec3; 2] {
        let [along_xi, along_eta] = self.quadratic(cell).tangents([xi, eta]);
        let det = along_xi[0] * along_eta[1] - along_xi[1] * along_eta[0];
        let [a, b, c, ..] = self.cells[cell as usize].map(|n| n as usize);
        let [x_xi, x_eta] = [b, c].map(|n| sub(self.points[n], self.points[a]));
        // The rows of the inverse of du/dxi.
        let along = |to_xi: f64, to_eta: f64| [0, 1, 2].map(|k| x_xi[k] * to_xi + x_eta[k] * to_eta);
        [along(along_eta[1] / det, -along_xi[1] / det), along(-along_eta[0] / det, along_xi[0] / det)]
    }

    /// The nearest point of the boundary. `None` only where there is none.
    pub fn to_boundary(&self, uv: [f64; 2]) -> Option<OnBoundary> {
        let arc = |side: u32| {
            let (cell, begin) = self.sides[side as usize];
            self.arc(cell, usize::from(begin))
        };
        let boundary =
            self.boundary.get_or_init(|| Bvh::new((0..self.sides.len() as u32).map(|side| arc(side).around())));
        let (side, squared) = boundary.nearest([uv[0], uv[1], 0.0], f64::INFINITY, |side| arc(side).nearest(uv).1)?;
        let (cell, begin) = self.sides[side as usize];
        Some(OnBoundary { cell, side: usize::from(begin), t: arc(side).nearest(uv).0, distance: squared.sqrt() })
    }

    /// The same as a point of a triangle.
    fn at_boundary(&self, uv: [f64; 2]) -> Option<Located> {
        let OnBoundary { cell, side, t, distance } = self.to_boundary(uv)?;
        let mut weights = [0.0; 3];
        weights[side] = 1.0 - t;
        weights[(side + 1) % 3] = t;
        Some(Located { triangle: cell, weights, distance })
    }

    /// The point at `uv`, in a triangle that Newton's method leads out of.
    fn by_halving(&self, uv: [f64; 2]) -> Option<Located> {
        let here = [uv[0], uv[1], 0.0];
        let mut found = None;
        self.in_plane.overlapping(&BoundingBox { min: here, max: here }, |cell| {
            if found.is_none() {
                found = self.quadratic(cell).by_halving(uv).map(|xi| located(cell, xi, 0.0));
            }
        });
        found
    }

    fn quadratic(&self, cell: u32) -> Quadratic {
        Quadratic::of(self.cells[cell as usize].map(|n| self.uv[n as usize]))
    }

    fn arc(&self, cell: u32, side: usize) -> QuadraticArc {
        let cell = self.cells[cell as usize];
        QuadraticArc::of([cell[side], cell[3 + side], cell[(side + 1) % 3]].map(|n| self.uv[n as usize]))
    }
}

/// A triangle that may have the point: where in it, and how far inside.
#[derive(Clone, Copy)]
struct Candidate {
    cell: u32,
    xi: [f64; 2],
    inside: f64,
}

/// The sides that one triangle has: sides are known by the nodes in their middle.
fn boundary_sides(cells: &[[u32; 6]], nodes: usize) -> Vec<(u32, u8)> {
    let mut count = vec![0_u8; nodes];
    for middle in cells.iter().flat_map(|cell| &cell[3..]) {
        let count = &mut count[*middle as usize];
        *count = count.saturating_add(1);
    }
    let mut sides = Vec::new();
    for (number, cell) in (0..).zip(cells) {
        sides.extend((0..3).filter(|k| count[cell[3 + usize::from(*k)] as usize] == 1).map(|k| (number, k)));
    }
    sides
}

fn barycentric([xi, eta]: [f64; 2]) -> [f64; 3] {
    [1.0 - xi - eta, xi, eta]
}

/// A point of a triangle, with weights that are none below 0.
fn located(cell: u32, xi: [f64; 2], distance: f64) -> Located {
    let weights = barycentric(xi).map(|l| larger(l, 0.0));
    let sum: f64 = weights.iter().sum();
    Located { triangle: cell, weights: weights.map(|l| l / sum), distance }
}

/// The corners of the reference triangle.
const WHOLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

/// The map of a curved triangle: c0 + c1 xi + c2 eta + c3 xi^2 + c4 xi eta + c5 eta^2, per coordinate.
struct Quadratic([[f64; 2]; 6]);

impl Quadratic {
    /// By its nodes: corners, then the middles of 01, 12 and 20.
    fn of([a, b, c, ab, bc, ca]: [[f64; 2]; 6]) -> Self {
        let each = |formula: &dyn Fn(usize) -> f64| [formula(0), formula(1)];
        Self([
            a,
            each(&|k| 4.0 * (ab[k] - a[k]) - (b[k] - a[k])),
            each(&|k| 4.0 * (ca[k] - a[k]) - (c[k] - a[k])),
            each(&|k| 2.0 * ((b[k] - ab[k]) - (ab[k] - a[k]))),
            each(&|k| 4.0 * ((bc[k] - ca[k]) - (ab[k] - a[k]))),
            each(&|k| 2.0 * ((c[k] - ca[k]) - (ca[k] - a[k]))),
        ])
    }

    #[inline]
    fn at(&self, [xi, eta]: [f64; 2]) -> [f64; 2] {
        let c = &self.0;
        let along =
            |k: usize| c[0][k] + xi * (c[1][k] + xi * c[3][k] + eta * c[4][k]) + eta * (c[2][k] + eta * c[5][k]);
        [along(0), along(1)]
    }

    /// The derivatives along xi and along eta.
    #[inline]
    fn tangents(&self, [xi, eta]: [f64; 2]) -> [[f64; 2]; 2] {
        let c = &self.0;
        [
            [0, 1].map(|k| c[1][k] + 2.0 * xi * c[3][k] + eta * c[4][k]),
            [0, 1].map(|k| c[2][k] + 2.0 * eta * c[5][k] + xi * c[4][k]),
        ]
    }

    /// Where the map is `uv`, by Newton's method; none where it does not converge.
    #[inline]
    fn newton(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let [mut xi, mut eta] = [1.0 / 3.0; 2];
        for _ in 0..STEPS {
            let at = self.at([xi, eta]);
            let off = [uv[0] - at[0], uv[1] - at[1]];
            let [along_xi, along_eta] = self.tangents([xi, eta]);
            let det = along_xi[0] * along_eta[1] - along_xi[1] * along_eta[0];
            let step_xi = (off[0] * along_eta[1] - off[1] * along_eta[0]) / det;
            let step_eta = (along_xi[0] * off[1] - along_xi[1] * off[0]) / det;
            xi += step_xi;
            eta += step_eta;
            let length = larger(step_xi.abs(), step_eta.abs());
            if length < SHORT {
                return Some([xi, eta]);
            }
            // Far outside, or no number: the point is not in this triangle, or is found by halving.
            let far = xi.abs() + eta.abs();
            if far.is_nan() || far > FAR {
                return None;
            }
        }
        // Where the triangle is tiny on the grid, steps stay above the limit by rounding.
        Some([xi, eta])
    }

    /// Where the map is `uv`, by halving. It ends: parts become smaller, and no more than [`PARTS`] are looked at.
    fn by_halving(&self, uv: [f64; 2]) -> Option<[f64; 2]> {
        let mut waiting = vec![(WHOLE, 0)];
        for _ in 0..PARTS {
            let (part, halved) = waiting.pop()?;
            let around = self.around(part);
            if !(0..2).all(|k| around.min[k] <= uv[k] && uv[k] <= around.max[k]) {
                continue;
            }
            let [a, b, c] = part;
            if halved == HALVINGS {
                return Some([0, 1].map(|k| (a[k] + b[k] + c[k]) / 3.0));
            }
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            waiting.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]].map(|part| (part, halved + 1)));
        }
        None
    }

    /// A box around the image of a part of the reference triangle: that around its Bezier points.
    fn around(&self, [a, b, c]: [[f64; 2]; 3]) -> BoundingBox {
        let corners = [a, b, c].map(|xi| self.at(xi));
        let middles = [middle(a, b), middle(b, c), middle(c, a)].map(|xi| self.at(xi));
        let mut points = [[0.0; 3]; 6];
        for k in 0..3 {
            let [p, m, q] = [corners[k], middles[k], corners[(k + 1) % 3]];
            points[k] = [p[0], p[1], 0.0];
            let control = [0, 1].map(|i| 2.0 * m[i] - 0.5 * (p[i] + q[i]));
            points[3 + k] = [control[0], control[1], 0.0];
        }
        widened(points)
    }
}

/// The box around some points of the plane, and what rounding may put beyond.
fn widened<const N: usize>(points: [[f64; 3]; N]) -> BoundingBox {
    let along = |k: usize, which: fn(f64, f64) -> f64| points.iter().fold(points[0][k], |m, p| which(m, p[k]));
    let mut around = BoundingBox { min: [0.0; 3], max: [0.0; 3] };
    for k in 0..2 {
        let (min, max) = (along(k, smaller), along(k, larger));
        let slack = 4.0 * f64::EPSILON * larger(min.abs(), max.abs());
        (around.min[k], around.max[k]) = (min - slack, max + slack);
    }
    around
}

fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

/// A side: c0 + c1 t + c2 t^2.
struct QuadraticArc([[f64; 2]; 3]);

impl QuadraticArc {
    /// By its nodes, that in the middle second.
    fn of([a, m, b]: [[f64; 2]; 3]) -> Self {
        let each = |formula: &dyn Fn(usize) -> f64| [formula(0), formula(1)];
        Self([a, each(&|k| 4.0 * (m[k] - a[k]) - (b[k] - a[k])), each(&|k| 2.0 * ((b[k] - m[k]) - (m[k] - a[k])))])
    }

    fn at(&self, t: f64) -> [f64; 2] {
        let [a, b, c] = &self.0;
        [0, 1].map(|k| a[k] + t * (b[k] + t * c[k]))
    }

    fn around(&self) -> BoundingBox {
        let [p, m, q] = [0.0, 0.5, 1.0].map(|t| self.at(t));
        let control = [0, 1].map(|k| 2.0 * m[k] - 0.5 * (p[k] + q[k]));
        widened([p, control, q].map(|[u, v]| [u, v, 0.0]))
    }

    /// The nearest point, and its squared distance.
    fn nearest(&self, uv: [f64; 2]) -> (f64, f64) {
        let squared = |t: f64| {
            let at = self.at(t);
            (at[0] - uv[0]).powi(2) + (at[1] - uv[1]).powi(2)
        };
        let mut best = (0.0, squared(0.0));
        let improve = |t: f64, best: &mut (f64, f64)| {
            let found = squared(t);
            if found < best.1 {
                *best = (t, found);
            }
        };
        (1..=PLACES).for_each(|k| improve(f64::from(k) / f64::from(PLACES), &mut best));
        // Gauss and Newton: the curve is replaced by its tangent.
        for _ in 0..STEPS {
            let t = best.0;
            let (at, [_, b, c]) = (self.at(t), &self.0);
            let tangent = [0, 1].map(|k| b[k] + 2.0 * t * c[k]);
            let along = (0..2).map(|k| (uv[k] - at[k]) * tangent[k]).sum::<f64>();
            let step = along / (tangent[0] * tangent[0] + tangent[1] * tangent[1]);
            let before = best;
            improve((t + step).clamp(0.0, 1.0), &mut best);
            if best == before || (best.0 - t).abs() < SHORT {
                break;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::NoMonitor;
    use crate::{Settings, parametrize, shapes};
    use proptest::prelude::*;

    /// The charts of surfaces, as maps.
    fn maps() -> Vec<CurvedMap> {
        let mut maps = Vec::new();
        for soup in [shapes::disk(7), shapes::ring_torus(16, 8), shapes::disk_with_holes(8, 3)] {
            let atlas = parametrize(&soup, &Settings::default(), &NoMonitor).expect("an atlas");
            for certified in atlas.charts() {
                let uv = certified.map().map().nodes.iter().map(|n| n.uv()).collect();
                let chart = certified.chart();
                maps.push(CurvedMap::new(chart.points().to_vec(), uv, chart.cells().collect()));
            }
        }
        maps
    }

    #[test]
    fn points_of_curved_triangles_are_found_again() {
        for map in maps() {
            for cell in 0..map.cells().len() as u32 {
                for xi in [[0.2, 0.3], [0.0, 0.5], [0.01, 0.98], [1.0, 0.0]] {
                    let uv = map.quadratic(cell).at(xi);
                    let found = map.to_space(uv).expect("triangles");
                    let expected = map.point_of(&located(cell, xi, 0.0));
                    let x = map.point_of(&found);
                    assert!((0..3).all(|k| (x[k] - expected[k]).abs() < 1e-9), "{x:?} for {expected:?}, {found:?}");
                }
            }
        }
    }

    #[test]
    fn the_boundary_is_found_from_inside_and_outside() {
        for map in maps() {
            for &(cell, side) in map.boundary() {
                let arc = map.arc(cell, usize::from(side));
                let found = map.to_boundary(arc.at(0.3)).expect("a boundary");
                assert!(found.distance < 1e-12 && (found.t - 0.3).abs() < 1e-6, "{found:?}");
                assert_eq!((found.cell, found.side), (cell, usize::from(side)));
            }
            let outside = map.to_space([5.0, 5.0]).expect("triangles");
            assert!(outside.distance > 3.0 && outside.weights.contains(&0.0));
        }
        assert_eq!(CurvedMap::new(vec![], vec![], vec![]).to_space([0.0; 2]), None);
    }

    proptest! {
        /// Halving finds what Newton's method finds.
        #[test]
        fn both_ways_lead_to_one_place(a in 0.0..1.0f64, b in 0.0..1.0f64, bulge in -0.15..0.15f64) {
            let q = Quadratic::of([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, bulge], [0.5, 0.5 + bulge], [0.0, 0.5]]);
            let xi = if a + b < 1.0 { [a, b] } else { [1.0 - a, 1.0 - b] };
            let uv = q.at(xi);
            let (newton, halved) = (q.newton(uv).expect("converges"), q.by_halving(uv).expect("inside"));
            prop_assert!((0..2).all(|k| (newton[k] - xi[k]).abs() < 1e-9 && (halved[k] - xi[k]).abs() < 1e-9));
        }
    }
}
