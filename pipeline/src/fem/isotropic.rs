//! Energies of maps of triangles that do not depend on directions: value, gradient, and Hessian at a point.
//!
//! In complex coordinates of the plane and of the triangle as it is in space, a linear map is f(w) = P w + N conj w.
//! With
//!
//! ```text
//! S = |P|^2 + |N|^2 = |J|_F^2 / 2,    d = |P|^2 - |N|^2 = det J,
//! ```
//!
//! the energy is the integral of F(S, d) over the surface, here with F linear in S. Its Hessian in (P, N) has a closed
//! form: the lengths |P| and |N| make a block of two by two, and the directions across them an eigenvalue each (Smith, De
//! Goes and Kim 2019, *Analytic eigensystems for isotropic distortion energies*, doi 10.1145/3241041, have the same for
//! singular values |P| + |N| and |P| - |N|). P1 maps have one such map in each triangle, others one at each point of a
//! quadrature rule.

use super::element::{Barycentric, Element};
use super::geometry::FirstForm;
use super::jacobian::cross;

/// The value of F(S, d) and its derivatives by S and d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Derivatives {
    pub value: f64,
    pub by_sum: f64,
    pub by_det: f64,
    pub by_sum_det: f64,
    pub by_det_det: f64,
}

/// An energy per area, F(S, d).
pub(crate) trait Density: Copy {
    /// F and its derivatives; a value that is not finite where the map is not allowed.
    fn at(&self, sum: f64, det: f64) -> Derivatives;
}

/// |J|_F^2 + |J^-1|_F^2 = 2 S (1 + 1 / d^2), infinite where d is not positive; 4 for isometries, and larger for all
/// others (Smith and Schaefer 2015, *Bijective parameterization with free boundaries*, doi 10.1145/2766947).
#[derive(Clone, Copy, Debug)]
pub(crate) struct SymmetricDirichlet;

impl Density for SymmetricDirichlet {
    fn at(&self, sum: f64, det: f64) -> Derivatives {
        let inverse = if det > 0.0 { det.recip() } else { f64::INFINITY };
        let square = inverse * inverse;
        Derivatives {
            value: 2.0 * sum * (1.0 + square),
            by_sum: 2.0 * (1.0 + square),
            by_det: -4.0 * sum * square * inverse,
            by_sum_det: -4.0 * square * inverse,
            by_det_det: 12.0 * sum * square * square,
        }
    }
}

/// (2 S + AREA (d^2 + 1)) / chi(d), chi(d) = (d + sqrt(d^2 + eps^2)) / 2: finite on triangles that are folded, and
/// steep there (Garanzha, Kaporin, Kudryavtseva, Protais, Ray and Sokolov 2021, *Foldover-free maps in 50 lines of
/// code*, doi 10.1145/3450626.3459847).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Regularised {
    /// Width of the transition, > 0.
    pub eps: f64,
}

/// How much areas count beside angles in [`Regularised`]. By experience, in that paper, too: small.
const AREA: f64 = 1.0 / 128.0;

impl Density for Regularised {
    fn at(&self, sum: f64, det: f64) -> Derivatives {
        let root = det.hypot(self.eps);
        // 1 / chi without cancellation on either side of zero.
        let inverse = if det > 0.0 { 2.0 / (det + root) } else { 2.0 * (root - det) / (self.eps * self.eps) };
        let first = -inverse / root;
        let second = 2.0 / (root * root * root);
        let (size, slope) = (2.0 * sum + AREA * (det * det + 1.0), 2.0 * AREA * det);
        Derivatives {
            value: size * inverse,
            by_sum: 2.0 * inverse,
            by_det: size * first + slope * inverse,
            by_sum_det: 2.0 * first,
            by_det_det: size * second + 2.0 * slope * first + 2.0 * AREA * inverse,
        }
    }
}

/// A complex number.
type Complex = [f64; 2];

fn times(a: Complex, b: Complex) -> Complex {
    [a[0] * b[0] - a[1] * b[1], a[0] * b[1] + a[1] * b[0]]
}

fn conj(a: Complex) -> Complex {
    [a[0], -a[1]]
}

fn square(a: Complex) -> f64 {
    a[0] * a[0] + a[1] * a[1]
}

/// A point of a triangle, with the share of the surface that it stands for, and the maps of an element with `N` nodes there.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<const N: usize> {
    area: f64,
    /// What a unit of area of the reference triangle's plane is on the surface.
    area_element: f64,
    /// The derivatives of the basis along xi and eta.
    gradients: [[f64; 2]; N],
    /// P is the sum of these times the images of the nodes, N that of their conjugates.
    beta: [Complex; N],
}

/// The gradient of the energy at a point, and its Hessian, by x and y of the nodes in turn: `M` = 2 `N` of them.
pub(crate) struct Local<const M: usize> {
    pub gradient: [f64; M],
    pub hessian: [[f64; M]; M],
}

/// What is wanted of a Hessian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// All of it.
    All,
    /// What is positive.
    Positive,
}

/// The complex derivatives of a map at a point.
#[derive(Clone, Copy)]
struct ComplexDerivatives {
    p: Complex,
    n: Complex,
}

impl<const N: usize> Point<N> {
    /// The point `l` of a triangle with this metric there, which stands for the share `weight` of it.
    pub fn of<E: Element<N>>(form: &FirstForm, l: Barycentric, weight: f64) -> Self {
        // In a plane whose first axis is along xi the tangents are (a, 0) and (b, c), a c the area element.
        let a = form.e.sqrt();
        let (b, c) = (form.f / a, form.area_element / a);
        let gradients = E::gradients(l);
        let beta = gradients.map(|[along_xi, along_eta]| {
            let by_x = along_xi / a;
            let by_y = (along_eta - b * by_x) / c;
            [0.5 * by_x, -0.5 * by_y]
        });
        // The reference triangle has the area 1/2.
        Self { area: 0.5 * weight * form.area_element, area_element: form.area_element, gradients, beta }
    }

    /// The area that it stands for.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// The determinant of the map with the nodes at `x`: area in the plane per area in space.
    pub fn det(&self, x: &[[f64; 2]; N]) -> f64 {
        let mut along = [[0.0; 2]; 2];
        for (p, gradient) in x.iter().zip(&self.gradients).skip(1) {
            for k in 0..2 {
                let from_first = p[k] - x[0][k];
                along[0][k] += gradient[0] * from_first;
                along[1][k] += gradient[1] * from_first;
            }
        }
        cross(along[0], along[1]) / self.area_element
    }

    /// S of the map with the nodes at `x`: half the sum of its squared singular values.
    pub fn sum(&self, x: &[[f64; 2]; N]) -> f64 {
        let at = self.derivatives(x);
        square(at.p) + square(at.n)
    }

    fn derivatives(&self, x: &[[f64; 2]; N]) -> ComplexDerivatives {
        let mut at = ComplexDerivatives { p: [0.0; 2], n: [0.0; 2] };
        for (p, beta) in x.iter().zip(&self.beta).skip(1) {
            let from_first = [0, 1].map(|k| p[k] - x[0][k]);
            let (of_p, of_n) = (times(from_first, *beta), times(from_first, conj(*beta)));
            for k in 0..2 {
                at.p[k] += of_p[k];
                at.n[k] += of_n[k];
            }
        }
        at
    }

    /// The energy of the map with the nodes at `x`.
    pub fn value(&self, density: impl Density, x: &[[f64; 2]; N]) -> f64 {
        self.area * density.at(self.sum(x), self.det(x)).value
    }

    /// Slope and curvature of that energy.
    pub fn local<const M: usize>(&self, density: impl Density, x: &[[f64; 2]; N], part: Part) -> Local<M> {
        let at = self.derivatives(x);
        let (s, t) = (square(at.p), square(at.n));
        let f = density.at(s + t, self.det(x));
        // Derivatives by s = |P|^2 and t = |N|^2.
        let [by_s, by_t] = [f.by_sum + f.by_det, f.by_sum - f.by_det];
        let by_ss = f.by_det_det + 2.0 * f.by_sum_det;
        let by_tt = f.by_det_det - 2.0 * f.by_sum_det;
        let by_st = -f.by_det_det;
        // Along P and N, and across them.
        let [along_p, across_p] = self.forms::<M>(direction_of(at.p, s), true);
        let [along_n, across_n] = self.forms::<M>(direction_of(at.n, t), false);
        let [p, n] = [s.sqrt(), t.sqrt()];
        let mut local = Local { gradient: [0.0; M], hessian: [[0.0; M]; M] };
        for i in 0..M {
            local.gradient[i] = 2.0 * self.area * (by_s * p * along_p[i] + by_t * n * along_n[i]);
        }
        let block = [2.0 * by_s + 4.0 * s * by_ss, 4.0 * p * n * by_st, 2.0 * by_t + 4.0 * t * by_tt];
        let across = [by_s, by_t].map(|by| 2.0 * by);
        let ([xx, xy, yy], across) = match part {
            Part::All => (block, across),
            Part::Positive => (positive(block), across.map(|by| by.max(0.0))),
        };
        for i in 0..M {
            for j in 0..M {
                let along = xx * along_p[i] * along_p[j]
                    + xy * (along_p[i] * along_n[j] + along_n[i] * along_p[j])
                    + yy * along_n[i] * along_n[j];
                let across = across[0] * across_p[i] * across_p[j] + across[1] * across_n[i] * across_n[j];
                local.hessian[i][j] = self.area * (along + across);
            }
        }
        local
    }

    /// The change of P (or else of N) along `direction` and across it, as forms of the changes of the nodes.
    fn forms<const M: usize>(&self, direction: Complex, is_p: bool) -> [[f64; M]; 2] {
        [direction, times([0.0, 1.0], direction)].map(|to| {
            let of_node = |k: usize| times(to, if is_p { conj(self.beta[k]) } else { self.beta[k] });
            std::array::from_fn(|i| of_node(i / 2)[i % 2])
        })
    }
}

/// Finds the factor by which a map is to be scaled for the least symmetric Dirichlet energy.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct BestScale {
    direct: f64,
    inverse: f64,
}

impl BestScale {
    /// Counts a point, where the map with the nodes at `x` is to turn left.
    pub fn add<const N: usize>(&mut self, point: &Point<N>, x: &[[f64; 2]; N]) {
        let (sum, det) = (point.sum(x), point.det(x));
        self.direct += point.area * sum;
        self.inverse += point.area * sum / (det * det);
    }

    /// The factor; it may be no number where the map did not turn left.
    pub fn factor(self) -> f64 {
        (self.inverse / self.direct).sqrt().sqrt()
    }
}

/// A complex number over its absolute value; any direction where that is zero.
fn direction_of(a: Complex, square: f64) -> Complex {
    let length = square.sqrt();
    if length > 0.0 { a.map(|c| c / length) } else { [1.0, 0.0] }
}

/// The symmetric matrix xx, xy, yy without what is negative in it.
fn positive([xx, xy, yy]: [f64; 3]) -> [f64; 3] {
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = (half * half + xy * xy).sqrt();
    if mean >= radius {
        return [xx, xy, yy];
    }
    let largest = mean + radius;
    if largest <= 0.0 {
        return [0.0; 3];
    }
    // The projector on the eigenvector of the larger eigenvalue, times that.
    let [cos, sin] = [half / radius, xy / radius];
    [0.5 * largest * (1.0 + cos), 0.5 * largest * sin, 0.5 * largest * (1.0 - cos)]
}

#[cfg(test)]
mod tests {
    use super::super::element::{P1, P2};
    use super::*;
    use crate::mesh::TriangleShape;
    use crate::shapes::Random;

    const L: Barycentric = [0.2, 0.5, 0.3];

    /// A triangle with sides 3, 4 and 5.
    fn point<E: Element<N>, const N: usize>() -> Point<N> {
        Point::of::<E>(&FirstForm::flat(&TriangleShape { lengths: [3.0, 5.0, 4.0] }), L, 1.0)
    }

    fn moved<const N: usize>(x: &[[f64; 2]; N], i: usize, by: f64) -> [[f64; 2]; N] {
        let mut x = *x;
        x[i / 2][i % 2] += by;
        x
    }

    /// The Hessian by differences of gradients.
    fn differences<const N: usize, const M: usize>(
        point: &Point<N>,
        density: impl Density,
        x: &[[f64; 2]; N],
    ) -> [[f64; M]; M] {
        let h = 1e-6;
        let gradient = |i: usize, by: f64| point.local::<M>(density, &moved(x, i, by), Part::All).gradient;
        std::array::from_fn(|i| {
            let (low, high) = (gradient(i, -h), gradient(i, h));
            std::array::from_fn(|j| (high[j] - low[j]) / (2.0 * h))
        })
    }

    fn check<E: Element<N>, const N: usize, const M: usize>(density: impl Density, corners: [[f64; 2]; 3]) {
        let (h, point) = (1e-6, point::<E, N>());
        let mut random = Random(7);
        // Straight, and then bent.
        let x = E::NODES.map(|l| P1::interpolate(&corners, l).map(|c| c + 0.05 * random.symmetric()));
        let local = point.local::<M>(density, &x, Part::Positive);
        let size = local.gradient.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
        for i in 0..M {
            let [low, high] = [-h, h].map(|by| point.value(density, &moved(&x, i, by)));
            let slope = (high - low) / (2.0 * h);
            assert!((slope - local.gradient[i]).abs() < 1e-6 * size, "{slope} {}", local.gradient[i]);
        }
        let whole = point.local::<M>(density, &x, Part::All).hessian;
        let exact = differences(&point, density, &x);
        for (a, b) in whole.iter().flatten().zip(exact.iter().flatten()) {
            assert!((a - b).abs() < 1e-5 * (size + b.abs()), "{a} {b}");
        }
        // The positive part is no less than the Hessian in any direction, and no less than zero.
        for _ in 0..200 {
            let y: [f64; M] = std::array::from_fn(|_| random.symmetric());
            let along =
                |m: &[[f64; M]; M]| -> f64 { (0..M * M).map(|ij| y[ij / M] * m[ij / M][ij % M] * y[ij % M]).sum() };
            let (projected, exact) = (along(&local.hessian), along(&exact));
            assert!(projected >= -1e-9 && projected - exact > -1e-4 * (1.0 + exact.abs()), "{projected} {exact}");
        }
    }

    #[test]
    fn gradients_and_hessians_are_derivatives_and_positive_parts_bound_second_ones_from_above() {
        let valid = [[0.1, 0.2], [2.0, 0.7], [-0.5, 1.5]];
        let folded = [[0.1, 0.2], [-0.5, 1.5], [2.0, 0.7]];
        check::<P1, 3, 6>(SymmetricDirichlet, valid);
        check::<P2, 6, 12>(SymmetricDirichlet, valid);
        for corners in [valid, folded] {
            check::<P1, 3, 6>(Regularised { eps: 0.3 }, corners);
            check::<P2, 6, 12>(Regularised { eps: 0.3 }, corners);
        }
    }

    #[test]
    fn an_isometry_is_the_least_of_the_symmetric_dirichlet_energy() {
        let corners = [[0.6, 0.8], [0.0, 0.0], [0.8, -0.6]].map(|p| p.map(|c| 5.0 * c));
        let shape = TriangleShape { lengths: [5.0, 5.0, 5.0 * 2.0_f64.sqrt()] };
        let point = Point::<6>::of::<P2>(&FirstForm::flat(&shape), L, 1.0);
        let x = P2::NODES.map(|l| P1::interpolate(&corners, l));
        assert!((point.det(&x) - 1.0).abs() < 1e-14 && (point.sum(&x) - 1.0).abs() < 1e-14);
        assert!((point.value(SymmetricDirichlet, &x) / point.area() - 4.0).abs() < 1e-13);
        let slope = point.local::<12>(SymmetricDirichlet, &x, Part::All).gradient;
        assert!(slope.iter().all(|g| g.abs() < 1e-12), "{slope:?}");
        // Twice as large is found to be.
        let twice = x.map(|p| p.map(|c| 2.0 * c));
        let mut scale = BestScale::default();
        scale.add(&point, &twice);
        assert!((scale.factor() - 0.5).abs() < 1e-14);
    }

    #[test]
    fn near_a_minimiser_nothing_is_projected_away() {
        let x = [[0.0, 0.0], [3.1, 0.0], [0.0, 4.2]];
        let shape = TriangleShape { lengths: [3.0, 5.0, 4.0] };
        let point = Point::<3>::of::<P1>(&FirstForm::flat(&shape), L, 1.0);
        let local = point.local::<6>(SymmetricDirichlet, &x, Part::Positive);
        let exact = differences::<3, 6>(&point, SymmetricDirichlet, &x);
        // But for the rotation, whose curvature is that of a compressed or stretched map.
        let mut largest: f64 = 0.0;
        for (p, e) in local.hessian.iter().flatten().zip(exact.iter().flatten()) {
            largest = largest.max((p - e).abs());
        }
        assert!(largest < 1e-3, "{largest}");
    }
}
