//! Finite elements on triangles: basis functions, their derivatives, and the stiffness matrix of the Laplacian.
//!
//! An element is a type that implements [`Element`]; one file each. Coordinates on the reference triangle are
//! barycentric, `l = [l0, l1, l2]` with sum 1; derivatives are taken along xi = l1 and eta = l2.

#[cfg(test)]
pub(crate) mod cubic;
mod p1;
mod p2;

use crate::fem::geometry::FirstForm;
use crate::fem::quadrature::Rule;
use crate::fem::stiffness::stiffness_by_quadrature;
use crate::mesh::TriangleShape;
pub use p1::P1;
pub use p2::{P2, P2Nodes};

/// Barycentric coordinates: shares of the three corners, which sum to 1.
pub type Barycentric = [f64; 3];

/// A Lagrange element on triangles with `N` nodes.
///
/// # Example
///
/// A quadratic function is found again at any point from its values at the six nodes.
///
/// ```
/// use planish_core::fem::element::{Element, P2};
///
/// let f = |[_, xi, eta]: [f64; 3]| [xi * eta, 1.0 - xi * xi];
/// let values = P2::NODES.map(f);
/// let l = [0.2, 0.3, 0.5];
/// let [product, square] = P2::interpolate(&values, l);
/// assert!((product - 0.15).abs() < 1e-15 && (square - 0.91).abs() < 1e-15);
/// // Its derivative along xi.
/// let [along_xi, _] = P2::derivatives(&values, l);
/// assert!((along_xi[0] - 0.5).abs() < 1e-15 && (along_xi[1] + 0.6).abs() < 1e-15);
/// ```
pub trait Element<const N: usize> {
    /// Polynomials up to this degree are represented exactly.
    const ORDER: u32;

    /// The nodes: the three vertices first, then, from order 2 on, those of the edges 01, 12, 20 (as in VTK and Gmsh).
    const NODES: [Barycentric; N];

    /// The basis functions at `l`: function n is 1 at node n and 0 at all others.
    fn basis(l: Barycentric) -> [f64; N];

    /// The derivatives of the basis functions at `l`, along xi and eta.
    fn gradients(l: Barycentric) -> [[f64; 2]; N];

    /// The stiffness matrix of the Laplacian on a flat triangle. By quadrature, which is exact there; elements with a
    /// closed form use that.
    fn stiffness(shape: &TriangleShape) -> [[f64; N]; N] {
        let metric = FirstForm::flat(shape);
        stiffness_by_quadrature::<Self, N>(|_| metric, Rule::of_degree(2 * (Self::ORDER - 1)))
    }

    /// The function with these nodal values, at `l`.
    fn interpolate<const D: usize>(values: &[[f64; D]; N], l: Barycentric) -> [f64; D] {
        let mut sum = [0.0; D];
        for (value, weight) in values.iter().zip(Self::basis(l)) {
            for k in 0..D {
                sum[k] += weight * value[k];
            }
        }
        sum
    }

    /// The derivatives along xi and eta of the function with these nodal values, at `l`.
    fn derivatives<const D: usize>(values: &[[f64; D]; N], l: Barycentric) -> [[f64; D]; 2] {
        let mut along = [[0.0; D]; 2];
        for (value, gradient) in values.iter().zip(Self::gradients(l)) {
            for k in 0..D {
                along[0][k] += gradient[0] * value[k];
                along[1][k] += gradient[1] * value[k];
            }
        }
        along
    }
}

/// The Dirichlet energy 1/2 int |grad u|^2 + |grad v|^2 over a triangle with this stiffness matrix and these nodal
/// values (u, v). Works on differences to the first node, so that small triangles lose no digits.
///
/// # Example
///
/// The energy has no unit of length: it is the area of the image where the map is conformal, and more elsewhere.
///
/// ```
/// use planish_core::fem::element::{Element, P1, energy};
/// use planish_core::mesh::TriangleShape;
///
/// let k = P1::stiffness(&TriangleShape::of([[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]));
/// let onto = |height: f64| energy(&k, &[[0.0, 0.0], [1.0, 0.0], [0.0, height]]);
/// assert!((onto(1.0) - 0.5).abs() < 1e-15, "a quarter as large in both directions");
/// assert!((onto(3.0) - 2.5).abs() < 1e-15, "its area is 1.5");
/// ```
pub fn energy<const N: usize>(stiffness: &[[f64; N]; N], x: &[[f64; 2]; N]) -> f64 {
    let d = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    let product = |i: usize, j: usize| d[i][0] * d[j][0] + d[i][1] * d[j][1];
    // The first row has no part in it: the difference there is zero.
    let row = |i: usize| (0..N).map(|j| stiffness[i][j] * product(i, j)).sum::<f64>();
    0.5 * (1..N).map(row).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::cubic::Cubic;
    use super::*;

    const SAMPLES: [Barycentric; 4] = [[0.2, 0.3, 0.5], [0.7, 0.1, 0.2], [1.0 / 3.0; 3], [0.0, 0.45, 0.55]];
    const SHAPES: [[f64; 3]; 3] = [[3.0, 5.0, 4.0], [1.0, 1.0, 1.0], [1.0, 0.2, 0.9]];

    /// Runs a check, generic in the element and its number of nodes, for every element.
    macro_rules! for_every_element {
        ($check:ident) => {
            $check::<P1, 3>();
            $check::<P2, 6>();
        };
    }

    fn is_one_at_its_node_only<E: Element<N>, const N: usize>() {
        for (i, node) in E::NODES.into_iter().enumerate() {
            assert_eq!(node.iter().sum::<f64>(), 1.0);
            let values = E::basis(node);
            assert!((0..N).all(|j| values[j] == f64::from(u8::from(i == j))), "node {i}: {values:?}");
        }
    }

    fn sums_to_one<E: Element<N>, const N: usize>() {
        for l in SAMPLES {
            assert!((E::basis(l).iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for k in 0..2 {
                assert!(E::gradients(l).iter().map(|g| g[k]).sum::<f64>().abs() < 1e-14);
            }
        }
    }

    fn has_its_derivatives<E: Element<N>, const N: usize>() {
        let h = 1e-6;
        for l in SAMPLES {
            let at = |xi: f64, eta: f64| E::basis([l[0] - xi - eta, l[1] + xi, l[2] + eta]);
            let gradients = E::gradients(l);
            for n in 0..N {
                assert!((gradients[n][0] - (at(h, 0.0)[n] - at(-h, 0.0)[n]) / (2.0 * h)).abs() < 1e-9);
                assert!((gradients[n][1] - (at(0.0, h)[n] - at(0.0, -h)[n]) / (2.0 * h)).abs() < 1e-9);
            }
        }
    }

    fn represents_polynomials_of_its_order<E: Element<N>, const N: usize>() {
        for i in 0..=E::ORDER as i32 {
            for j in 0..=E::ORDER as i32 - i {
                let monomial = |l: Barycentric| [l[1].powi(i) * l[2].powi(j)];
                let nodal = E::NODES.map(monomial);
                for l in SAMPLES {
                    let [value] = E::interpolate(&nodal, l);
                    assert!((value - monomial(l)[0]).abs() < 1e-15, "xi^{i} eta^{j} at {l:?}");
                }
            }
        }
        // And of no higher one: its count of nodes is that of the monomials.
        assert_eq!(N, ((E::ORDER + 1) * (E::ORDER + 2) / 2) as usize);
    }

    fn has_the_stiffness_of_quadrature<E: Element<N>, const N: usize>() {
        for lengths in SHAPES {
            let shape = TriangleShape { lengths };
            let metric = FirstForm::flat(&shape);
            let exact = E::stiffness(&shape);
            // A rule of just the degree that is needed, and one that is far above it.
            for degree in [2 * (E::ORDER - 1), 8] {
                let numeric = stiffness_by_quadrature::<E, N>(|_| metric, Rule::of_degree(degree));
                for i in 0..N {
                    assert!(exact[i].iter().sum::<f64>().abs() < 1e-13, "constants have no energy");
                    assert!((0..N).all(|j| (exact[i][j] - numeric[i][j]).abs() < 1e-13), "{exact:?} {numeric:?}");
                }
            }
        }
    }

    fn gives_the_identity_its_area_as_energy<E: Element<N>, const N: usize>() {
        for lengths in SHAPES {
            let shape = TriangleShape { lengths };
            let corners = shape.in_plane();
            let identity = E::NODES.map(|l| P1::interpolate(&corners, l));
            assert!((energy(&E::stiffness(&shape), &identity) - shape.area()).abs() < 1e-13);
        }
    }

    #[test]
    fn every_basis_function_is_one_at_its_node_and_zero_at_all_others() {
        for_every_element!(is_one_at_its_node_only);
    }

    #[test]
    fn every_basis_sums_to_one() {
        for_every_element!(sums_to_one);
    }

    #[test]
    fn gradients_are_the_derivatives_of_the_basis() {
        for_every_element!(has_its_derivatives);
    }

    #[test]
    fn polynomials_are_exact_up_to_the_order() {
        for_every_element!(represents_polynomials_of_its_order);
    }

    #[test]
    fn closed_forms_of_the_stiffness_agree_with_quadrature() {
        for_every_element!(has_the_stiffness_of_quadrature);
    }

    #[test]
    fn the_identity_has_the_area_as_energy() {
        for_every_element!(gives_the_identity_its_area_as_energy);
    }

    #[test]
    fn an_element_of_order_three_is_an_addition() {
        has_its_derivatives::<Cubic, 10>();
        represents_polynomials_of_its_order::<Cubic, 10>();
        has_the_stiffness_of_quadrature::<Cubic, 10>();
        gives_the_identity_its_area_as_energy::<Cubic, 10>();
        sums_to_one::<Cubic, 10>();
    }
}
