//! What untangling minimises.

use crate::fem::element::{self, P2, P2Nodes};
use crate::fem::geometry::FirstForm;
use crate::fem::isotropic::{BestScale, Part, Point, SymmetricDirichlet};
use crate::fem::quadrature::Rule;
use crate::fem::stiffness::Triangles;
use crate::topology::FaceId;

/// The scalar unknowns of a triangle: u and v at six nodes, u0, v0, u1, and so on.
pub(crate) const SCALARS: usize = 12;

/// Gradient and Hessian of an objective on one triangle, with respect to its scalar unknowns.
#[derive(Clone, Copy, Debug)]
pub struct LocalModel {
    /// The gradient.
    pub gradient: [f64; SCALARS],
    /// The Hessian, or a matrix in place of it that is no less. Only the lower triangle counts.
    pub hessian: [[f64; SCALARS]; SCALARS],
}

/// An objective: a sum over the triangles of a chart, each summand a smooth function, never negative, of the uv of
/// the triangle's six nodes. Newton's method and the barrier know nothing else of it.
///
/// # Example
///
/// The Dirichlet energy in which some triangles count more.
///
/// ```
/// use planish_core::fem::element::{Element, P1, P2, P2Nodes};
/// use planish_core::mesh::TriangleShape;
/// use planish_core::topology::FaceId;
/// use planish_core::untangle::{Dirichlet, LocalModel, Objective};
///
/// struct Weighted<'a>(Dirichlet<'a, [TriangleShape]>, &'a [f64]);
///
/// impl Objective for Weighted<'_> {
///     fn value(&self, face: FaceId, x: &P2Nodes) -> f64 {
///         self.1[face.index()] * self.0.value(face, x)
///     }
///     fn model(&self, face: FaceId, x: &P2Nodes) -> LocalModel {
///         let LocalModel { gradient, hessian } = self.0.model(face, x);
///         let scaled = |v: f64| self.1[face.index()] * v;
///         LocalModel { gradient: gradient.map(scaled), hessian: hessian.map(|row| row.map(scaled)) }
///     }
///     fn typical(&self, area: f64) -> f64 {
///         self.0.typical(area)
///     }
/// }
///
/// // A triangle that is not stretched has its area as energy.
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let nodes = P2::NODES.map(|l| P1::interpolate(&corners.map(|[x, y, _]| [x, y]), l));
/// let shapes = [TriangleShape::of(corners)];
/// let objective = Weighted(Dirichlet::new(&shapes[..]), &[3.0]);
/// assert!((objective.value(FaceId(0), &nodes) - 3.0 * 0.5).abs() < 1e-14);
/// ```
pub trait Objective {
    /// The summand of a triangle whose nodes lie at `x`.
    fn value(&self, face: FaceId, x: &P2Nodes) -> f64;

    /// Gradient and curvature of that summand. The Hessian may be indefinite: what is positive of it, together with that of the
    /// constraints, is taken.
    fn model(&self, face: FaceId, x: &P2Nodes) -> LocalModel;

    /// The order of magnitude of the summand of a triangle that covers `area` in the plane: the unit in which penalties
    /// are weighed against the objective.
    fn typical(&self, area: f64) -> f64;
}

/// The Dirichlet energy 1/2 int |grad u|^2 + |grad v|^2 over the surface, whose minimiser is harmonic.
#[derive(Debug)]
pub struct Dirichlet<'a, T: ?Sized> {
    triangles: &'a T,
}

impl<'a, T: Triangles + ?Sized> Dirichlet<'a, T> {
    /// Of maps of these triangles: a chart's (a [`FilledChart`](crate::map::filled::FilledChart), flat or curved), or
    /// flat ones of these shapes.
    pub fn new(triangles: &'a T) -> Self {
        Self { triangles }
    }

    fn stiffness(&self, face: FaceId) -> [[f64; 6]; 6] {
        self.triangles.stiffness::<P2, 6>(face.index())
    }
}

impl<T: Triangles + ?Sized> Objective for Dirichlet<'_, T> {
    fn value(&self, face: FaceId, x: &P2Nodes) -> f64 {
        element::energy(&self.stiffness(face), x)
    }

    fn model(&self, face: FaceId, x: &P2Nodes) -> LocalModel {
        let stiffness = self.stiffness(face);
        // Differences to the first node, so that small triangles lose no digits.
        let d = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
        // The energy is quadratic: its gradient is the matrix times the values.
        let slope = |i: usize| (0..6).map(|n| stiffness[i / 2][n] * d[n][i % 2]).sum();
        let mut hessian = [[0.0; SCALARS]; SCALARS];
        for m in 0..6 {
            for n in 0..=m {
                hessian[2 * m][2 * n] = stiffness[m][n];
                hessian[2 * m + 1][2 * n + 1] = stiffness[m][n];
            }
        }
        LocalModel { gradient: std::array::from_fn(slope), hessian }
    }

    /// Half the area: that of an area-preserving conformal map is the area.
    fn typical(&self, area: f64) -> f64 {
        0.5 * area
    }
}

/// How far a map is from an isometry, up to its scale: the symmetric Dirichlet energy
///
/// ```text
/// 1/4 int |J|_F^2 + |J^-1|_F^2 dA,    J relative to the scale
/// ```
///
/// over the surface (Smith and Schaefer 2015, *Bijective parameterization with free boundaries*, doi
/// 10.1145/2766947), in the unit of area of the plane. Isometries have the area of their image; all others have more, and maps
/// that fold at a point of the quadrature have no value: it is infinite.
///
/// # Example
///
/// ```
/// use planish_core::fem::element::{Element, P1, P2};
/// use planish_core::mesh::TriangleShape;
/// use planish_core::topology::FaceId;
/// use planish_core::untangle::{Isometric, Objective};
///
/// let shapes = [TriangleShape { lengths: [3.0, 5.0, 4.0] }];
/// let onto = |height: f64| {
///     let corners = [[0.0, 0.0], [1.5, 0.0], [0.0, height]];
///     P2::NODES.map(|l| P1::interpolate(&corners, l))
/// };
/// let objective = Isometric::near(&shapes[..], &[onto(2.0)]);
/// // Half as large in all directions is as good as an isometry; half as high again is not.
/// assert!((objective.value(FaceId(0), &onto(2.0)) - 1.5).abs() < 1e-14);
/// assert!(objective.value(FaceId(0), &onto(3.0)) > 1.7);
/// assert_eq!(objective.value(FaceId(0), &onto(-2.0)), f64::INFINITY);
/// ```
#[derive(Debug)]
pub struct Isometric<'a, T: ?Sized> {
    triangles: &'a T,
    /// Length in the plane per length in space that costs nothing.
    scale: f64,
}

/// The degree of the rule by which isometric energies are integrated. They are rational; with 6 instead of 4 the least energies of
/// freed charts differ by 2e-6 where they are near an isometry, and by 3e-3 at 3.7 times its energy (milk_truck).
const DEGREE: u32 = 4;

impl<'a, T: Triangles + ?Sized> Isometric<'a, T> {
    /// Of maps of these triangles whose scale is that of a map with these nodes, one-to-one: that scale for which its energy is
    /// least.
    pub fn near(triangles: &'a T, nodes: &[P2Nodes]) -> Self {
        let unscaled = Self { triangles, scale: 1.0 };
        let mut best = BestScale::default();
        for (f, x) in nodes.iter().enumerate() {
            unscaled.for_each_point(f, |point| best.add(&point, x));
        }
        Self { triangles, scale: best.factor().recip() }
    }

    /// The energy of an isometry of `area` in space: the least there is.
    pub fn of_isometry(&self, area: f64) -> f64 {
        self.scale * self.scale * area
    }

    fn for_each_point(&self, face: usize, mut visit: impl FnMut(Point<6>)) {
        let square = self.scale * self.scale;
        Rule::of_degree(DEGREE).for_each(|l, weight| {
            let FirstForm { e, f, g, area_element } = self.triangles.metric(face, l);
            let form = FirstForm { e: square * e, f: square * f, g: square * g, area_element: square * area_element };
            visit(Point::of::<P2>(&form, l, weight));
        });
    }
}

/// The energy of an isometry per area.
const OF_ISOMETRY: f64 = 4.0;

impl<T: Triangles + ?Sized> Objective for Isometric<'_, T> {
    fn value(&self, face: FaceId, x: &P2Nodes) -> f64 {
        let mut sum = 0.0;
        self.for_each_point(face.index(), |point| sum += point.value(SymmetricDirichlet, x));
        sum / OF_ISOMETRY
    }

    fn model(&self, face: FaceId, x: &P2Nodes) -> LocalModel {
        let mut model = LocalModel { gradient: [0.0; SCALARS], hessian: [[0.0; SCALARS]; SCALARS] };
        self.for_each_point(face.index(), |point| {
            let local = point.local::<SCALARS>(SymmetricDirichlet, x, Part::All);
            for i in 0..SCALARS {
                model.gradient[i] += local.gradient[i] / OF_ISOMETRY;
                (0..=i).for_each(|j| model.hessian[i][j] += local.hessian[i][j] / OF_ISOMETRY);
            }
        });
        model
    }

    fn typical(&self, area: f64) -> f64 {
        area
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::fem::jacobian::samples::{X, Y, moved};
    use crate::mesh::TriangleShape;

    /// That gradient and Hessian are the derivatives of the value at X along Y, and the Hessian is no smaller than the
    /// true one; the curvature along Y.
    pub(in super::super) fn check_derivatives(objective: &impl Objective) -> f64 {
        let face = FaceId(0);
        let model = objective.model(face, &X);
        let direction: Vec<f64> = Y.as_flattened().to_vec();
        let h = 1e-4;
        let [low, mid, high] = [-h, 0.0, h].map(|t| objective.value(face, &moved(t)));
        let slope: f64 = (0..SCALARS).map(|i| model.gradient[i] * direction[i]).sum();
        assert!((slope - (high - low) / (2.0 * h)).abs() < 1e-7 * slope.abs().max(1.0));
        let entry = |i: usize, j: usize| model.hessian[i.max(j)][i.min(j)];
        let row = |i: usize| (0..SCALARS).map(|j| direction[i] * entry(i, j) * direction[j]).sum::<f64>();
        let curvature: f64 = (0..SCALARS).map(row).sum();
        assert!(curvature >= (high - 2.0 * mid + low) / (h * h) - 1e-5);
        curvature
    }

    #[test]
    fn the_model_of_the_dirichlet_energy_holds_its_derivatives() {
        assert!(check_derivatives(&Dirichlet::new(&[TriangleShape { lengths: [1.0, 0.7, 0.9] }][..])) >= 0.0);
    }

    #[test]
    fn the_model_of_the_isometric_energy_holds_its_derivatives() {
        let shapes = [TriangleShape { lengths: [1.0, 0.7, 0.9] }];
        check_derivatives(&Isometric::near(&shapes[..], &[X]));
    }
}
