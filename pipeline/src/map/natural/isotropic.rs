//! Energies of P1 maps of triangles that do not depend on directions: value, gradient, and a positive Hessian.
//!
//! In complex coordinates of the plane and of the triangle as it is in space, a linear map is f(w) = P w + N conj w.
//! With
//!
//! ```text
//! S = |P|^2 + |N|^2 = |J|_F^2 / 2,    d = |P|^2 - |N|^2 = det J,
//! ```
//!
//! the energy is sum_T A_T F(S, d), here with F linear in S. Its Hessian in (P, N) has a closed form: the lengths |P|
//! and |N| make a block of two by two, and the directions across them an eigenvalue each (Smith, De Goes and Kim 2019,
//! *Analytic eigensystems for isotropic distortion energies*, doi 10.1145/3241041, have the same for singular values
//! |P| + |N| and |P| - |N|). What is negative is set to zero.

use crate::atlas::Chart;
use crate::mesh::TriangleShape;
use crate::topology::VertexId;

/// The value of F(S, d) and its derivatives by S and d.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Derivatives {
    pub value: f64,
    pub by_sum: f64,
    pub by_det: f64,
    pub by_sum_det: f64,
    pub by_det_det: f64,
}

/// An energy per area, F(S, d).
pub(super) trait Density: Copy {
    /// F and its derivatives; a value that is not finite where the map is not allowed.
    fn at(&self, sum: f64, det: f64) -> Derivatives;
}

/// |J|_F^2 + |J^-1|_F^2 = 2 S (1 + 1 / d^2), infinite where d is not positive; 4 for isometries, and larger for all
/// others (Smith and Schaefer 2015, *Bijective parameterization with free boundaries*, doi 10.1145/2766947).
#[derive(Clone, Copy, Debug)]
pub(super) struct SymmetricDirichlet;

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
pub(super) struct Regularised {
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

/// A triangle as it is in space, and its vertices.
#[derive(Clone, Copy, Debug)]
struct Element {
    vertices: [usize; 3],
    area: f64,
    /// P is the sum of these times the images of the vertices, N that of their conjugates.
    beta: [Complex; 3],
}

/// The gradient of an element's energy, and the positive part of its Hessian, by x and y of its vertices in turn.
pub(super) struct Local {
    pub gradient: [f64; 6],
    pub hessian: [[f64; 6]; 6],
}

/// The triangles of a chart, as they are in space.
pub(super) struct Elements {
    elements: Vec<Element>,
}

impl Elements {
    pub fn of(chart: &Chart) -> Self {
        let of_face = |(t, shape): (&[VertexId; 3], &TriangleShape)| {
            let (w, area) = (shape.in_plane(), shape.area());
            let beta = [0, 1, 2].map(|k| {
                let (p, q) = (w[(k + 1) % 3], w[(k + 2) % 3]);
                // The gradient of the hat function of vertex k is ((p - q).y, (q - p).x) / (2 area).
                [p[1] - q[1], p[0] - q[0]].map(|c| 0.25 * c / area)
            });
            Element { vertices: t.map(|v| v.index()), area, beta }
        };
        Self { elements: chart.triangles().iter().zip(chart.shapes()).map(of_face).collect() }
    }

    pub fn len(&self) -> usize {
        self.elements.len()
    }

    /// The area in space.
    pub fn area(&self) -> f64 {
        self.elements.iter().map(|e| e.area).sum()
    }

    /// The vertices of every triangle.
    pub fn vertices(&self) -> impl Iterator<Item = [usize; 3]> {
        self.elements.iter().map(|e| e.vertices)
    }

    /// Per vertex, its share of the area; together they are 1.
    pub fn shares(&self, vertices: usize) -> Vec<f64> {
        let total = self.area();
        let mut shares = vec![0.0; vertices];
        for e in &self.elements {
            e.vertices.iter().for_each(|v| shares[*v] += e.area / (3.0 * total));
        }
        shares
    }

    /// The energy of the map with the vertices at `uv`.
    pub fn energy(&self, density: impl Density, uv: &[[f64; 2]]) -> f64 {
        self.elements.iter().map(|e| e.energy(density, uv)).sum()
    }

    /// The least determinant.
    pub fn least_det(&self, uv: &[[f64; 2]]) -> f64 {
        self.elements.iter().map(|e| e.det(uv)).fold(f64::INFINITY, f64::min)
    }

    /// The area of the image over that in space, where folded triangles count as negative.
    pub fn mean_det(&self, uv: &[[f64; 2]]) -> f64 {
        let image: f64 = self.elements.iter().map(|e| e.area * e.det(uv)).sum();
        image / self.area()
    }

    /// The factor by which a map whose triangles all turn left is to be scaled for the least symmetric Dirichlet
    /// energy.
    pub fn best_scale(&self, uv: &[[f64; 2]]) -> f64 {
        let (mut direct, mut inverse) = (0.0, 0.0);
        for e in &self.elements {
            let (sum, det) = (e.derivatives(uv).sum(), e.det(uv));
            direct += e.area * sum;
            inverse += e.area * sum / (det * det);
        }
        (inverse / direct).sqrt().sqrt()
    }

    /// The gradient and the Hessian of every triangle at `uv`.
    pub fn locals(&self, density: impl Density, uv: &[[f64; 2]]) -> impl Iterator<Item = Local> {
        self.elements.iter().map(move |e| e.local(density, uv))
    }

    /// How far one can go from `uv` along `direction` before a triangle has lost its area; infinite where none does.
    pub fn largest_step(&self, uv: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
        let steps = self.elements.iter().map(|e| {
            let [a, b] = e.sides(uv);
            let [da, db] = e.sides(direction);
            first_root([cross(a, b), cross(a, db) + cross(da, b), cross(da, db)])
        });
        steps.fold(f64::INFINITY, f64::min)
    }
}

/// The least positive root of c0 + c1 t + c2 t^2, where c0 is positive; infinite where there is none.
fn first_root([c0, c1, c2]: [f64; 3]) -> f64 {
    let discriminant = c1 * c1 - 4.0 * c2 * c0;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    // The sum of two numbers of one sign, so that nothing cancels.
    let sum = -c1 + discriminant.sqrt();
    if c1 <= 0.0 {
        let root = 2.0 * c0 / sum;
        return if root > 0.0 { root } else { f64::INFINITY };
    }
    // Only a parabola that opens downwards comes to zero again.
    if c2 < 0.0 { (-c1 - discriminant.sqrt()) / (2.0 * c2) } else { f64::INFINITY }
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

/// The complex derivatives of a linear map.
#[derive(Clone, Copy)]
struct ComplexDerivatives {
    p: Complex,
    n: Complex,
}

impl ComplexDerivatives {
    fn sum(self) -> f64 {
        square(self.p) + square(self.n)
    }
}

impl Element {
    /// The sides from the first vertex.
    fn sides(&self, uv: &[[f64; 2]]) -> [[f64; 2]; 2] {
        let [a, b, c] = self.vertices.map(|v| uv[v]);
        [b, c].map(|p| [p[0] - a[0], p[1] - a[1]])
    }

    fn det(&self, uv: &[[f64; 2]]) -> f64 {
        let [a, b] = self.sides(uv);
        0.5 * cross(a, b) / self.area
    }

    fn derivatives(&self, uv: &[[f64; 2]]) -> ComplexDerivatives {
        let [a, b] = self.sides(uv);
        let [_, of_a, of_b] = self.beta;
        let sum = |x: Complex, y: Complex| [x[0] + y[0], x[1] + y[1]];
        ComplexDerivatives {
            p: sum(times(a, of_a), times(b, of_b)),
            n: sum(times(a, conj(of_a)), times(b, conj(of_b))),
        }
    }

    fn energy(&self, density: impl Density, uv: &[[f64; 2]]) -> f64 {
        self.area * density.at(self.derivatives(uv).sum(), self.det(uv)).value
    }

    fn local(&self, density: impl Density, uv: &[[f64; 2]]) -> Local {
        let at = self.derivatives(uv);
        let (s, t) = (square(at.p), square(at.n));
        let f = density.at(s + t, self.det(uv));
        // Derivatives by s = |P|^2 and t = |N|^2.
        let [by_s, by_t] = [f.by_sum + f.by_det, f.by_sum - f.by_det];
        let by_ss = f.by_det_det + 2.0 * f.by_sum_det;
        let by_tt = f.by_det_det - 2.0 * f.by_sum_det;
        let by_st = -f.by_det_det;
        // Along P and N, and across them.
        let [along_p, across_p] = self.forms(direction_of(at.p, s), true);
        let [along_n, across_n] = self.forms(direction_of(at.n, t), false);
        let [p, n] = [s.sqrt(), t.sqrt()];
        let mut local = Local { gradient: [0.0; 6], hessian: [[0.0; 6]; 6] };
        for i in 0..6 {
            local.gradient[i] = 2.0 * self.area * (by_s * p * along_p[i] + by_t * n * along_n[i]);
        }
        let [xx, xy, yy] = positive([2.0 * by_s + 4.0 * s * by_ss, 4.0 * p * n * by_st, 2.0 * by_t + 4.0 * t * by_tt]);
        let across = [by_s, by_t].map(|by| (2.0 * by).max(0.0));
        for i in 0..6 {
            for j in 0..6 {
                let along = xx * along_p[i] * along_p[j]
                    + xy * (along_p[i] * along_n[j] + along_n[i] * along_p[j])
                    + yy * along_n[i] * along_n[j];
                let across = across[0] * across_p[i] * across_p[j] + across[1] * across_n[i] * across_n[j];
                local.hessian[i][j] = self.area * (along + across);
            }
        }
        local
    }

    /// The change of P (or else of N) along `direction` and across it, as forms of the changes of the vertices.
    fn forms(&self, direction: Complex, is_p: bool) -> [[f64; 6]; 2] {
        [direction, times([0.0, 1.0], direction)].map(|to| {
            let of_vertex = |k: usize| times(to, if is_p { conj(self.beta[k]) } else { self.beta[k] });
            std::array::from_fn(|i| of_vertex(i / 2)[i % 2])
        })
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
    let radius = half.hypot(xy);
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
    use super::*;

    fn element() -> Element {
        // A right triangle with sides 3 and 4.
        let w = [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]];
        let area = 6.0;
        let beta = [0, 1, 2].map(|k| {
            let (p, q): ([f64; 2], [f64; 2]) = (w[(k + 1) % 3], w[(k + 2) % 3]);
            [p[1] - q[1], p[0] - q[0]].map(|c| 0.25 * c / area)
        });
        Element { vertices: [0, 1, 2], area, beta }
    }

    fn moved(uv: &[[f64; 2]; 3], i: usize, by: f64) -> [[f64; 2]; 3] {
        let mut uv = *uv;
        uv[i / 2][i % 2] += by;
        uv
    }

    /// The Hessian by differences of gradients.
    fn differences(density: impl Density, uv: &[[f64; 2]; 3]) -> [[f64; 6]; 6] {
        let h = 1e-6;
        let gradient = |i: usize, by: f64| element().local(density, &moved(uv, i, by)).gradient;
        std::array::from_fn(|i| {
            let (low, high) = (gradient(i, -h), gradient(i, h));
            std::array::from_fn(|j| (high[j] - low[j]) / (2.0 * h))
        })
    }

    fn check(density: impl Density, uv: [[f64; 2]; 3]) {
        let (h, e) = (1e-6, element());
        let local = e.local(density, &uv);
        let size = local.gradient.iter().fold(1.0_f64, |m, g| m.max(g.abs()));
        for i in 0..6 {
            let [low, high] = [-h, h].map(|by| e.energy(density, &moved(&uv, i, by)));
            let slope = (high - low) / (2.0 * h);
            assert!((slope - local.gradient[i]).abs() < 1e-6 * size, "{slope} {}", local.gradient[i]);
        }
        // No less than the Hessian in any direction, and no less than zero.
        let exact = differences(density, &uv);
        let mut random = crate::shapes::Random(7);
        for _ in 0..200 {
            let x: [f64; 6] = std::array::from_fn(|_| random.symmetric());
            let along =
                |m: &[[f64; 6]; 6]| -> f64 { (0..36).map(|ij| x[ij / 6] * m[ij / 6][ij % 6] * x[ij % 6]).sum() };
            let (projected, exact) = (along(&local.hessian), along(&exact));
            assert!(projected >= -1e-9 && projected - exact > -1e-4 * (1.0 + exact.abs()), "{projected} {exact}");
        }
    }

    #[test]
    fn gradients_are_derivatives_and_hessians_bound_second_ones_from_above() {
        let valid = [[0.1, 0.2], [2.0, 0.7], [-0.5, 1.5]];
        let folded = [[0.1, 0.2], [-0.5, 1.5], [2.0, 0.7]];
        check(SymmetricDirichlet, valid);
        for uv in [valid, folded] {
            check(Regularised { eps: 0.3 }, uv);
        }
    }

    #[test]
    fn near_a_minimiser_nothing_is_projected_away() {
        let uv = [[0.0, 0.0], [3.1, 0.0], [0.0, 4.2]];
        let local = element().local(SymmetricDirichlet, &uv);
        let exact = differences(SymmetricDirichlet, &uv);
        // But for the rotation, whose curvature is that of a compressed or stretched map.
        let mut largest: f64 = 0.0;
        for (p, e) in local.hessian.iter().flatten().zip(exact.iter().flatten()) {
            largest = largest.max((p - e).abs());
        }
        assert!(largest < 1e-3, "{largest}");
    }

    #[test]
    fn a_triangle_keeps_its_area_up_to_the_largest_step() {
        for coefficients in [[1.0, -3.0, 2.0], [1.0, 3.0, -4.0], [2.0, -1.0, 0.0], [1.0, -2.0, 1.0]] {
            let root = first_root(coefficients);
            let [c0, c1, c2] = coefficients;
            assert!((c0 + c1 * root + c2 * root * root).abs() < 1e-12 && root > 0.0, "{root}");
        }
        for coefficients in [[1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [1.0, 5.0, 1.0], [1.0, -1.0, 1.0]] {
            assert_eq!(first_root(coefficients), f64::INFINITY);
        }
    }
}
