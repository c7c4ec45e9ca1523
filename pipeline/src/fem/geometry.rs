//! The geometry of a triangle in space, as its stiffness matrix sees it: the first fundamental form.

use super::element::{Barycentric, Element};
use crate::mesh::TriangleShape;
use crate::vec3::{Vec3, cross, dot, norm};

/// The first fundamental form of a map x(xi, eta) from the reference triangle to space, at one point: all that the
/// Laplacian of a surface depends on.
///
/// # Example
///
/// The area of an eighth of the unit sphere, as a flat triangle and as one through six points.
///
/// ```
/// use planish_core::fem::element::{Element, P1, P2};
/// use planish_core::fem::geometry::FirstForm;
/// use planish_core::fem::quadrature::Rule;
/// use planish_core::vec3::norm;
///
/// let corners = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// let on_sphere = |p: [f64; 3]| p.map(|c| c / norm(p));
/// let nodes = P2::NODES.map(|l| on_sphere(P1::interpolate(&corners, l)));
/// // The reference triangle has the area 1/2.
/// let flat = 0.5 * FirstForm::of_nodes::<P1, 3>(&corners, [1.0 / 3.0; 3]).area_element;
/// let curved = 0.5 * Rule::of_degree(8).mean(|l| FirstForm::of_nodes::<P2, 6>(&nodes, l).area_element);
/// let exact = std::f64::consts::PI / 2.0;
/// assert!((flat / exact - 1.0).abs() > 0.4 && (curved / exact - 1.0).abs() < 0.1);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstForm {
    /// x_xi . x_xi
    pub e: f64,
    /// x_xi . x_eta
    pub f: f64,
    /// x_eta . x_eta
    pub g: f64,
    /// |x_xi x x_eta|, the area of the surface over that of the reference triangle's plane. It is the root of e g - f f, and
    /// is kept apart because that loses half of the digits on slivers.
    pub area_element: f64,
}

impl FirstForm {
    /// Of a flat triangle: the same at every point.
    pub fn flat(shape: &TriangleShape) -> Self {
        let [_, [length, _], [x, y]] = shape.in_plane();
        Self { e: length * length, f: length * x, g: x * x + y * y, area_element: length * y }
    }

    /// Of a surface with these derivatives along xi and eta.
    pub fn of_tangents([along_xi, along_eta]: [Vec3; 2]) -> Self {
        Self {
            e: dot(along_xi, along_xi),
            f: dot(along_xi, along_eta),
            g: dot(along_eta, along_eta),
            area_element: norm(cross(along_xi, along_eta)),
        }
    }

    /// Of the curved triangle whose nodes lie at `x` in space, at `l`.
    pub fn of_nodes<E: Element<N>, const N: usize>(x: &[Vec3; N], l: Barycentric) -> Self {
        Self::of_tangents(E::derivatives(x, l))
    }

    /// The product of two gradients, given by their derivatives along xi and eta, times the area element: what is
    /// integrated over the reference triangle. Not finite where the triangle is degenerate.
    pub fn gradient_product(&self, p: [f64; 2], q: [f64; 2]) -> f64 {
        (self.g * p[0] * q[0] - self.f * (p[0] * q[1] + p[1] * q[0]) + self.e * p[1] * q[1]) / self.area_element
    }
}

#[cfg(test)]
mod tests {
    use super::super::element::{P1, P2};
    use super::*;

    #[test]
    fn a_flat_triangle_has_the_same_form_by_lengths_and_by_nodes_of_any_element() {
        let corners: [Vec3; 3] = [[1.0, 0.0, 2.0], [3.0, 1.0, 2.5], [0.5, 2.0, 1.0]];
        let shape = TriangleShape::of(corners);
        let by_lengths = FirstForm::flat(&shape);
        let nodes = P2::NODES.map(|l| P1::interpolate(&corners, l));
        for l in [[0.2, 0.3, 0.5], [1.0, 0.0, 0.0]] {
            for form in [FirstForm::of_nodes::<P1, 3>(&corners, l), FirstForm::of_nodes::<P2, 6>(&nodes, l)] {
                let off = [form.e - by_lengths.e, form.f - by_lengths.f, form.g - by_lengths.g];
                assert!(off.iter().all(|d| d.abs() < 1e-13), "{form:?} {by_lengths:?}");
                assert!((form.area_element - 2.0 * shape.area()).abs() < 1e-13);
            }
        }
    }

    #[test]
    fn slivers_keep_their_digits() {
        for height in [1e-3, 1e-6, 1e-9] {
            let form = FirstForm::of_tangents([[1.0, 0.0, 0.0], [0.3, height, 0.0]]);
            assert!((form.area_element / height - 1.0).abs() < 1e-15, "{height}: {form:?}");
            // The gradient of a function that grows by 1 across the height.
            let steep = form.gradient_product([0.0, 1.0], [0.0, 1.0]);
            assert!((steep * height - 1.0).abs() < 1e-15, "{height}: {steep}");
        }
        // The root of the determinant, which is the same without rounding, has no digit left here.
        let form = FirstForm::of_tangents([[1.0, 0.0, 0.0], [0.3, 1e-9, 0.0]]);
        let root = (form.e * form.g - form.f * form.f).max(0.0).sqrt();
        assert!((root / 1e-9 - 1.0).abs() > 0.1, "{root}");
    }

    #[test]
    fn a_stretched_gradient_shrinks() {
        // x = 2 xi, y = eta: grad xi = (1/2, 0), and the area element is 2.
        let form = FirstForm { e: 4.0, f: 0.0, g: 1.0, area_element: 2.0 };
        assert_eq!(form.gradient_product([1.0, 0.0], [1.0, 0.0]), 0.5);
        assert_eq!(form.gradient_product([0.0, 1.0], [0.0, 1.0]), 2.0);
        assert_eq!(form.gradient_product([1.0, 0.0], [0.0, 1.0]), 0.0);
    }
}
