//! Energies of P1 maps of a chart that do not depend on directions ([`crate::fem::isotropic`]), one point a triangle.

use crate::atlas::Chart;
use crate::fem::element::P1;
use crate::fem::geometry::FirstForm;
use crate::fem::isotropic::{BestScale, Density, Local, Part, Point};
use crate::fem::jacobian::cross;
use crate::mesh::TriangleShape;

/// The triangles of a chart, as they are in space.
pub(super) struct Elements {
    points: Vec<Point<3>>,
    vertices: Vec<[usize; 3]>,
}

impl Elements {
    pub fn of(chart: &Chart) -> Self {
        let middle = [1.0 / 3.0; 3];
        let of_shape = |shape: &TriangleShape| Point::of::<P1>(&FirstForm::flat(shape), middle, 1.0);
        Self {
            points: chart.shapes().iter().map(of_shape).collect(),
            vertices: chart.triangles().iter().map(|t| t.map(|v| v.index())).collect(),
        }
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// The area in space.
    pub fn area(&self) -> f64 {
        self.points.iter().map(Point::area).sum()
    }

    /// The vertices of every triangle.
    pub fn vertices(&self) -> impl Iterator<Item = [usize; 3]> {
        self.vertices.iter().copied()
    }

    /// Per vertex, its share of the area; together they are 1.
    pub fn shares(&self, vertices: usize) -> Vec<f64> {
        let total = self.area();
        let mut shares = vec![0.0; vertices];
        for (point, vertices) in self.points.iter().zip(&self.vertices) {
            vertices.iter().for_each(|v| shares[*v] += point.area() / (3.0 * total));
        }
        shares
    }

    /// Every triangle with its corners in the plane.
    fn with_corners<'a>(&'a self, uv: &'a [[f64; 2]]) -> impl Iterator<Item = (&'a Point<3>, [[f64; 2]; 3])> + 'a {
        self.points.iter().zip(&self.vertices).map(|(point, vertices)| (point, vertices.map(|v| uv[v])))
    }

    /// The energy of the map with the vertices at `uv`.
    pub fn energy(&self, density: impl Density, uv: &[[f64; 2]]) -> f64 {
        self.with_corners(uv).map(|(point, x)| point.value(density, &x)).sum()
    }

    /// The least determinant.
    pub fn least_det(&self, uv: &[[f64; 2]]) -> f64 {
        self.with_corners(uv).map(|(point, x)| point.det(&x)).fold(f64::INFINITY, f64::min)
    }

    /// The area of the image over that in space, where folded triangles count as negative.
    pub fn mean_det(&self, uv: &[[f64; 2]]) -> f64 {
        let image: f64 = self.with_corners(uv).map(|(point, x)| point.area() * point.det(&x)).sum();
        image / self.area()
    }

    /// The factor by which a map whose triangles all turn left is to be scaled for the least symmetric Dirichlet
    /// energy.
    pub fn best_scale(&self, uv: &[[f64; 2]]) -> f64 {
        let mut scale = BestScale::default();
        self.with_corners(uv).for_each(|(point, x)| scale.add(point, &x));
        scale.factor()
    }

    /// The gradient and the positive part of the Hessian of every triangle at `uv`.
    pub fn locals<'a>(&'a self, density: impl Density + 'a, uv: &'a [[f64; 2]]) -> impl Iterator<Item = Local<6>> + 'a {
        self.with_corners(uv).map(move |(point, x)| point.local(density, &x, Part::Positive))
    }

    /// How far one can go from `uv` along `direction` before a triangle has lost its area; infinite where none does.
    pub fn largest_step(&self, uv: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
        let steps = self.vertices.iter().map(|vertices| {
            let [[a, b], [da, db]] = [uv, direction].map(|p| sides(vertices.map(|v| p[v])));
            first_root([cross(a, b), cross(a, db) + cross(da, b), cross(da, db)])
        });
        steps.fold(f64::INFINITY, f64::min)
    }
}

/// The sides from the first corner.
fn sides([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 2] {
    [b, c].map(|p| [p[0] - a[0], p[1] - a[1]])
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

#[cfg(test)]
mod tests {
    use super::*;

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
