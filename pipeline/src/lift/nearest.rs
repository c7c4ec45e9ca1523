//! From space to the surface: the nearest place.

use super::surface::ChartedSurface;
use super::{OnSurface, Place};
use crate::evaluate::{Bvh, OnTriangle, on_triangle, triangle_bvh};
use crate::vec3::Vec3;

/// The triangles of a surface, searched by place.
#[derive(Clone, Debug)]
pub struct Nearest {
    /// Per triangle its corners, its cell, and its chart.
    triangles: Vec<([Vec3; 3], u32, usize)>,
    tree: Bvh,
}

impl Nearest {
    /// All triangles of a surface.
    pub fn new(surface: &ChartedSurface) -> Self {
        let mut triangles = Vec::new();
        for chart in 0..surface.charts() {
            let of_chart = surface.chart(chart);
            triangles.extend(of_chart.corners().zip(&of_chart.cells).map(|(corners, cell)| (corners, *cell, chart)));
        }
        let tree = triangle_bvh(triangles.iter().map(|(corners, ..)| *corners));
        Self { triangles, tree }
    }

    /// The place that is nearest to `x`, of one chart or of all; the chart, and how far it is (`off`). None where there is no
    /// triangle.
    ///
    /// ```
    /// use planish_core::lift::{ChartedSurface, Nearest};
    ///
    /// let space = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let uv = space.map(|[x, y, _]| [0.5 * x, 0.5 * y]);
    /// let surface = ChartedSurface::new(&space, &uv, &[[0, 1, 2, 3, 4, 5]], &[0])?;
    /// let (found, chart) = Nearest::new(&surface).to([0.5, 0.5, 3.0], None).expect("there is a triangle");
    /// assert_eq!((found.point, found.off, chart), ([0.5, 0.5, 0.0], 3.0, 0));
    /// assert_eq!(found.place.weights, [0.5, 0.25, 0.25]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn to(&self, x: Vec3, chart: Option<usize>) -> Option<(OnSurface, usize)> {
        let is_asked = |of: usize| chart.is_none_or(|chart| chart == of);
        let (triangle, _) = self.tree.nearest(x, f64::INFINITY, |t| {
            let (corners, _, of) = &self.triangles[t as usize];
            if is_asked(*of) { on_triangle(x, *corners).squared } else { f64::INFINITY }
        })?;
        let (corners, cell, chart) = &self.triangles[triangle as usize];
        let OnTriangle { weights, squared } = on_triangle(x, *corners);
        let point = [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
        Some((OnSurface { point, place: Place { cell: *cell, weights }, off: squared.sqrt() }, *chart))
    }
}
