//! Are elements fine? Their shape, their size, and whether curved ones are valid.

use super::reference::{Mesh, Triangulation};
use crate::topology::VertexId;
use crate::vec3::{Vec3, cross, distance, dot, norm, sub};

/// A vertex of the surface where its angles add up to less than a right angle is a tip: no mesh has good elements there.
const TIP: f64 = std::f64::consts::FRAC_PI_2;

/// Nodes this close to a tip, relative to the diagonal of the surface, are at it. By experience: far above the rounding of
/// doubles, far below any edge.
const AT_TIP: f64 = 1e-9;

/// The ratio of twice the inscribed circle's radius to that of the circumscribed one: 1 for equilateral triangles, 0 for
/// those without an area (gamma of Gmsh).
///
/// ```
/// use planish_core::soundness::gamma;
///
/// let isosceles = |height| [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, height, 0.0]];
/// assert!((gamma(isosceles(0.75_f64.sqrt())) - 1.0).abs() < 1e-12);
/// assert!(gamma(isosceles(0.01)) < 0.001, "it falls with the square of the height");
/// assert_eq!(gamma(isosceles(0.0)), 0.0);
/// ```
pub fn gamma(p: [Vec3; 3]) -> f64 {
    let [a, b, c] = [0, 1, 2].map(|k| distance(p[k], p[(k + 1) % 3]));
    let doubled = norm(cross(sub(p[1], p[0]), sub(p[2], p[0])));
    // r = A / s and R = a b c / (4 A), with s half the perimeter: 2 r / R = 8 A^2 / (s a b c), and A is half of `doubled`.
    let product = 0.5 * (a + b + c) * a * b * c;
    if product > 0.0 { 2.0 * doubled * doubled / product } else { 0.0 }
}

/// What was found of the shapes of elements.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shapes {
    /// The least gamma.
    pub min: f64,
    /// The mean.
    pub mean: f64,
    /// Elements below the least one allowed, the worst first.
    pub below: Vec<(u32, f64)>,
    /// Elements below it that touch a tip of the surface.
    pub at_tips: usize,
}

/// Looks at the gamma of every element.
pub fn shapes(mesh: &Triangulation, surface: &Triangulation, min_gamma: f64) -> Shapes {
    let all: Vec<f64> = (0..mesh.triangles.len()).map(|t| gamma(mesh.corners(t))).collect();
    let bad: Vec<(u32, f64)> = (0..).zip(&all).filter(|(_, g)| **g < min_gamma).map(|(t, g)| (t, *g)).collect();
    let tips = if bad.is_empty() { vec![] } else { tips(surface) };
    let reach = AT_TIP * surface.diagonal();
    let at_tip = |v: &VertexId| tips.iter().any(|tip| distance(*tip, mesh.points[v.index()]) <= reach);
    let touches_tip = |(t, _): &(u32, f64)| mesh.triangles[*t as usize].iter().any(at_tip);
    let (excused, mut below): (Vec<_>, Vec<_>) = bad.into_iter().partition(touches_tip);
    below.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
    Shapes {
        min: all.iter().copied().fold(f64::INFINITY, f64::min),
        mean: all.iter().sum::<f64>() / all.len().max(1) as f64,
        below,
        at_tips: excused.len(),
    }
}

/// Where the angles of the surface add up to less than a right angle.
fn tips(surface: &Triangulation) -> Vec<Vec3> {
    let mut angles = vec![0.0; surface.points.len()];
    for (t, corners) in surface.triangles.iter().enumerate() {
        let p = surface.corners(t);
        for k in 0..3 {
            let (u, v) = (sub(p[(k + 1) % 3], p[k]), sub(p[(k + 2) % 3], p[k]));
            angles[corners[k].index()] += norm(cross(u, v)).atan2(dot(u, v));
        }
    }
    let is_tip = |(_, angle): &(&Vec3, &f64)| **angle > 0.0 && **angle < TIP;
    surface.points.iter().zip(&angles).filter(is_tip).map(|(p, _)| *p).collect()
}

/// The lengths of edges, relative to the size that was asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeLengths {
    /// The shortest.
    pub min: f64,
    /// The median.
    pub median: f64,
    /// The longest.
    pub max: f64,
    /// The share between half and twice the size.
    pub near_size: f64,
}

/// Measures every side of every element, those of two elements twice.
pub fn edge_lengths(mesh: &Triangulation, size: f64) -> EdgeLengths {
    let sides = |t: usize| {
        let p = mesh.corners(t);
        [0, 1, 2].map(|k| distance(p[k], p[(k + 1) % 3]) / size)
    };
    let mut all: Vec<f64> = (0..mesh.triangles.len()).flat_map(sides).collect();
    if all.is_empty() {
        return EdgeLengths::default();
    }
    let near = all.iter().filter(|l| (0.5..=2.0).contains(*l)).count();
    let middle = all.len() / 2;
    let (min, max) = all.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), l| (a.min(*l), b.max(*l)));
    let near_size = near as f64 / all.len() as f64;
    let median = *all.select_nth_unstable_by(middle, f64::total_cmp).1;
    EdgeLengths { min, median, max, near_size }
}

/// The 6-node elements that are not valid.
pub fn invalid_curved(mesh: &Mesh) -> Vec<u32> {
    let points = &mesh.triangulation.points;
    let is_invalid = |t: &u32| {
        mesh.mids[*t as usize].is_some_and(|mids| {
            let corners = mesh.triangulation.triangles[*t as usize];
            !is_valid(corners.map(|v| points[v.index()]), mids.map(|v| points[v.index()]))
        })
    };
    (0..mesh.mids.len() as u32).filter(is_invalid).collect()
}

/// Whether the element turns the way of its straight triangle everywhere: the determinant of its projection on the plane
/// of that triangle, a quadratic polynomial, is positive. Its six Bernstein coefficients are those of
/// [`crate::fem::bernstein`], here in doubles; halving (Johnen, Remacle and Geuzaine 2013, doi 10.1016/j.jcp.2012.08.051)
/// decides where they have both signs, at most [`HALVINGS`] times: what is then undecided is not called valid.
fn is_valid(corners: [Vec3; 3], mids: [Vec3; 3]) -> bool {
    let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    // Control points: mid nodes of the arcs doubled, less half of both ends.
    let control = |k: usize| {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        [0, 1, 2].map(|i| 2.0 * mids[k][i] - 0.5 * (p[i] + q[i]))
    };
    let [c01, c12, c20] = [control(0), control(1), control(2)];
    // The derivatives along the sides 01 and 02 at the corners, halved.
    let a = [sub(c01, corners[0]), sub(corners[1], c01), sub(c12, c20)];
    let b = [sub(c20, corners[0]), sub(c12, c01), sub(corners[2], c20)];
    let mixed = |i: usize, j: usize| 0.5 * (dot(cross(a[i], b[j]), normal) + dot(cross(a[j], b[i]), normal));
    is_positive([mixed(0, 0), mixed(1, 1), mixed(2, 2), mixed(0, 1), mixed(1, 2), mixed(2, 0)], HALVINGS)
}

/// How often the triangle is quartered for a bound: into 4,096 parts at worst. By experience: more decides more
/// of the elements that are nearly folded, and each costs four times as much.
const HALVINGS: u32 = 6;

/// Whether a quadratic form with coefficients at 00, 11, 22, 01, 12, 20 is positive on the triangle.
fn is_positive(c: [f64; 6], depth: u32) -> bool {
    if c[..3].iter().any(|v| v.is_nan() || *v <= 0.0) {
        return false;
    }
    if c[3..].iter().all(|v| *v > 0.0) {
        return true;
    }
    if depth == 0 {
        return false;
    }
    quartered(c).into_iter().all(|part| is_positive(part, depth - 1))
}

/// The coefficients on the four parts between corners and middles of sides (de Casteljau).
fn quartered([c00, c11, c22, c01, c12, c20]: [f64; 6]) -> [[f64; 6]; 4] {
    let half = |x: f64, y: f64| 0.5 * (x + y);
    let [m01, m12, m20] =
        [(c00, c01, c11), (c11, c12, c22), (c22, c20, c00)].map(|(p, c, q)| half(half(p, c), half(c, q)));
    let (a, b, c) = (
        half(half(c00, c01), half(c20, c12)),
        half(half(c11, c12), half(c01, c20)),
        half(half(c22, c20), half(c12, c01)),
    );
    [
        [c00, m01, m20, half(c00, c01), a, half(c00, c20)],
        [m01, c11, m12, half(c01, c11), half(c11, c12), b],
        [m20, m12, c22, c, half(c12, c22), half(c22, c20)],
        [m01, m12, m20, b, c, a],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const CORNERS: [Vec3; 3] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    const MIDS: [Vec3; 3] = [[0.5, 0.0, 0.0], [0.5, 0.5, 0.0], [0.0, 0.5, 0.0]];

    #[test]
    fn gamma_is_one_for_equilateral_triangles() {
        let third = std::f64::consts::TAU / 3.0;
        let equilateral = [0.0, third, 2.0 * third].map(|a: f64| [a.cos(), a.sin(), 7.0]);
        assert!((gamma(equilateral) - 1.0).abs() < 1e-12);
        // sin A + sin B + sin C and 4 sin A sin B sin C of a right isosceles triangle.
        assert!((gamma(CORNERS) - 2.0 / (1.0 + 2.0_f64.sqrt())).abs() < 1e-12);
        assert_eq!(gamma([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), 0.0);
    }

    #[test]
    fn straight_elements_are_valid_and_folded_ones_are_not() {
        assert!(is_valid(CORNERS, MIDS));
        let mut folded = MIDS;
        folded[1] = [0.2, 0.2, 0.0];
        assert!(!is_valid(CORNERS, folded));
        // Out of the plane, far: the normal turns, but not over.
        let mut bent = MIDS;
        bent[1] = [0.5, 0.5, 0.4];
        assert!(is_valid(CORNERS, bent));
    }

    proptest! {
        #[test]
        fn the_form_is_what_samples_say(c in prop::array::uniform6(-1.0..2.0f64)) {
            let value = |l: [f64; 3]| {
                let squares: f64 = (0..3).map(|i| l[i] * l[i] * c[i]).sum();
                squares + 2.0 * (l[0] * l[1] * c[3] + l[1] * l[2] * c[4] + l[2] * l[0] * c[5])
            };
            let n = 40;
            let lattice = (0..=n).flat_map(|i| (0..=n - i).map(move |j| [i, j, n - i - j].map(|k| f64::from(k) / f64::from(n))));
            let least = lattice.map(value).fold(f64::INFINITY, f64::min);
            if is_positive(c, HALVINGS) {
                prop_assert!(least > 0.0);
            } else {
                prop_assert!(least < 0.01, "least {least} of {c:?}");
            }
        }
    }

    #[test]
    fn tips_excuse_what_meets_there() {
        let soup = crate::shapes::finger(8, 4);
        let surface = Triangulation::welded(soup.points(), soup.triangles().iter().copied());
        let sliver = Triangulation::welded(&[[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.01, 0.0]], [[0, 1, 2]]);
        let found = shapes(&sliver, &surface, 0.1);
        assert_eq!((found.below.len(), found.at_tips), (1, 0));
        let needle = Triangulation::welded(
            &[[0.0; 3], [9.0, 0.1, 0.0], [9.0, -0.1, 0.0], [9.0, 0.0, 0.1]],
            [[0, 1, 2], [0, 2, 3], [0, 3, 1]],
        );
        let found = shapes(&needle, &needle, 0.1);
        assert_eq!((found.below.len(), found.at_tips), (0, 3));
    }
}
