//! Stiffness matrices: by quadrature, which is the general path, for any element and for triangles that are curved in
//! space; and of the triangles of a surface, whichever these are.

use super::element::{Barycentric, Element};
use super::geometry::FirstForm;
use super::quadrature::Rule;
use crate::mesh::TriangleShape;

/// The stiffness matrix int grad phi_i . grad phi_j dA of the Laplacian on a triangle in space, whose first
/// fundamental form at barycentric coordinates is `metric`, by `rule`.
///
/// Exact on flat triangles from the degree 2 (order - 1) of the rule on. On curved ones the integrand is rational,
/// and the error falls with the degree and with the size of the triangle. Not finite where the metric is degenerate
/// at a point of the rule.
///
/// # Example
///
/// ```
/// use planish_core::fem::element::{Element, P2};
/// use planish_core::fem::geometry::FirstForm;
/// use planish_core::fem::quadrature::Rule;
/// use planish_core::fem::stiffness::stiffness_by_quadrature;
///
/// // A triangle of the unit sphere, through six points.
/// let corners = [[1.0, 0.0, 0.0], [0.8, 0.6, 0.0], [0.8, 0.0, 0.6]];
/// let nodes = P2::NODES.map(|l| {
///     let p: [f64; 3] = [0, 1, 2].map(|k| (0..3).map(|i| l[i] * corners[i][k]).sum());
///     let r = p.iter().map(|c| c * c).sum::<f64>().sqrt();
///     p.map(|c| c / r)
/// });
/// let metric = |l| FirstForm::of_nodes::<P2, 6>(&nodes, l);
/// let k = stiffness_by_quadrature::<P2, 6>(metric, Rule::of_degree(6));
/// assert!(k[0][0] > 0.0 && k.iter().all(|row| row.iter().sum::<f64>().abs() < 1e-13));
/// ```
pub fn stiffness_by_quadrature<E: Element<N> + ?Sized, const N: usize>(
    metric: impl Fn(Barycentric) -> FirstForm,
    rule: &Rule,
) -> [[f64; N]; N] {
    let mut k = [[0.0; N]; N];
    rule.for_each(|l, weight| {
        let form = metric(l);
        let gradients = E::gradients(l);
        for i in 0..N {
            for j in 0..=i {
                k[i][j] += 0.5 * weight * form.gradient_product(gradients[i], gradients[j]);
            }
        }
    });
    for i in 0..N {
        for j in 0..i {
            k[j][i] = k[i][j];
        }
    }
    k
}

/// Triangles of a surface in space, as energies see them: flat ones, curved ones, or both.
pub trait Triangles {
    /// The stiffness matrix of element `E` on a triangle.
    fn stiffness<E: Element<N>, const N: usize>(&self, face: usize) -> [[f64; N]; N];

    /// The first fundamental form of a triangle at `l`.
    fn metric(&self, face: usize, l: Barycentric) -> FirstForm;
}

/// Flat triangles.
impl Triangles for [TriangleShape] {
    fn stiffness<E: Element<N>, const N: usize>(&self, face: usize) -> [[f64; N]; N] {
        E::stiffness(&self[face])
    }

    fn metric(&self, face: usize, _: Barycentric) -> FirstForm {
        FirstForm::flat(&self[face])
    }
}

#[cfg(test)]
mod tests {
    use super::super::element::{P2, energy};
    use super::*;
    use crate::vec3::Vec3;

    /// A curved triangle of size `h` on the unit cylinder, its nodes in the plane of angle and height.
    fn on_cylinder(h: f64) -> ([[f64; 2]; 6], [Vec3; 6]) {
        let corners = [[0.3, 0.1], [0.3 + h, 0.1 + 0.2 * h], [0.3 + 0.3 * h, 0.1 + 0.9 * h]];
        let unrolled = P2::NODES.map(|l| [0, 1].map(|k| (0..3).map(|i| l[i] * corners[i][k]).sum()));
        (unrolled, unrolled.map(|[angle, z]: [f64; 2]| [angle.cos(), angle.sin(), z]))
    }

    #[test]
    fn unrolling_a_cylinder_has_the_area_as_energy_up_to_the_order_of_the_triangle() {
        // A cylinder is developable: unrolling it is an isometry, the energy of which is the area. The triangle through
        // six points of the cylinder is off by a cubic term; the relative error of the energy falls with h^4, and
        // faster than the square of the size at any rate.
        let error = |h: f64| {
            let (unrolled, nodes) = on_cylinder(h);
            let metric = |l| FirstForm::of_nodes::<P2, 6>(&nodes, l);
            let k = stiffness_by_quadrature::<P2, 6>(metric, Rule::of_degree(8));
            let area = 0.5 * h * h * (0.9 - 0.2 * 0.3);
            (energy(&k, &unrolled) / area - 1.0).abs()
        };
        let [coarse, fine] = [error(0.4), error(0.2)];
        assert!(fine < 1e-4 && (coarse / fine).log2() > 2.9, "{coarse} {fine}");
    }

    #[test]
    fn rules_of_rising_degree_converge_to_one_matrix_on_a_curved_triangle() {
        let (_, nodes) = on_cylinder(0.8);
        let by = |degree| {
            stiffness_by_quadrature::<P2, 6>(|l| FirstForm::of_nodes::<P2, 6>(&nodes, l), Rule::of_degree(degree))
        };
        let reference = by(8);
        let distance = |degree| {
            let k = by(degree);
            (0..36).map(|i| (k[i / 6][i % 6] - reference[i / 6][i % 6]).abs()).fold(0.0, f64::max)
        };
        let [low, middle, high] = [2, 4, 6].map(distance);
        assert!(high < middle && middle < low && high < 1e-5, "{low} {middle} {high}");
    }

    #[test]
    fn the_stereographic_projection_of_a_sphere_has_the_area_of_its_image_as_energy() {
        // It is conformal, so that energy and area in the plane agree: to third order and better where the metric is
        // that of the exact sphere, not of a polyhedron.
        let lift = |[u, v]: [f64; 2]| {
            let s = 1.0 + u * u + v * v;
            [2.0 * u / s, 2.0 * v / s, (s - 2.0) / s]
        };
        let error = |h: f64| {
            let corners = [[0.2, 0.1], [0.2 + h, 0.1], [0.2, 0.1 + h]];
            let uv = P2::NODES.map(|l| [0, 1].map(|k| (0..3).map(|i| l[i] * corners[i][k]).sum()));
            let nodes: [Vec3; 6] = uv.map(lift);
            let k = stiffness_by_quadrature::<P2, 6>(|l| FirstForm::of_nodes::<P2, 6>(&nodes, l), Rule::of_degree(6));
            (energy(&k, &uv) / (0.5 * h * h) - 1.0).abs()
        };
        let [coarse, fine] = [error(0.2), error(0.1)];
        assert!(fine < 1e-4 && (coarse / fine).log2() > 2.9, "{coarse} {fine}");
    }
}
