//! Evaluate: from space to the plane and back, through a map that is linear on straight triangles.
//!
//! A [`TriangulatedMap`] holds a triangulation twice, in space and in the plane, as a mesher gets it. [`TriangulatedMap::to_plane`]
//! takes a point of space to the closest point of the triangulation and that to the plane, [`TriangulatedMap::to_space`] takes a
//! point of the plane to space. Both always answer with a triangle and weights that add up to 1, and tell how far the
//! point asked for was from it: on a seam or in a corner the answer is a side or a corner of a triangle there, whichever
//! way rounding falls.
//!
//! A [`CurvedMap`] does the latter for curved triangles as they are; meshers get them by their straight parts (see
//! [`mod@crate::subdivide`]).

mod bvh;
mod closest;
mod curved;
mod plane;

pub(crate) use bvh::larger;
use bvh::smaller;
pub use bvh::{Bvh, along_curve};
pub use closest::{OnSegment, OnTriangle, on_segment, on_triangle};
pub use curved::{CurvedMap, OnBoundary};
pub use plane::Plane;

use crate::vec3::{BoundingBox, Vec3};
use std::sync::OnceLock;

/// A triangulation in space and in the plane, searched by either.
///
/// ```
/// use planish_core::evaluate::TriangulatedMap;
///
/// // A square that rises towards its upper side, and its map: the view from above.
/// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
/// let uv = points.iter().map(|[x, y, _]| [*x, *y]).collect();
/// let map = TriangulatedMap::new(points, uv, vec![[0, 1, 2], [0, 2, 3]]);
/// let there = map.to_space([0.5, 0.25]).expect("it has triangles");
/// assert_eq!((there.triangle, map.point_of(&there)), (0, [0.5, 0.25, 0.25]));
/// let back = map.to_plane([0.5, 0.25, 0.25]).expect("it has triangles");
/// assert_eq!((map.uv_of(&back), back.distance), ([0.5, 0.25], 0.0));
/// // Outside there is an answer, too, and it tells how far off it is.
/// let outside = map.to_space([3.0, 0.5]).expect("it has triangles");
/// assert_eq!((map.uv_of(&outside), outside.distance), ([1.0, 0.5], 2.0));
/// ```
#[derive(Clone, Debug)]
pub struct TriangulatedMap {
    points: Vec<Vec3>,
    uv: Vec<[f64; 2]>,
    triangles: Vec<[u32; 3]>,
    in_space: Bvh,
    /// Made when it is first asked for.
    in_plane: OnceLock<Bvh>,
}

/// A point of a triangulation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Located {
    /// The triangle.
    pub triangle: u32,
    /// The weights of its corners: at least 0, their sum is 1.
    pub weights: [f64; 3],
    /// The distance to the point asked for, in the unit of where it was asked: space, or the plane.
    pub distance: f64,
}

impl TriangulatedMap {
    /// A map of `triangles` over nodes whose positions in space are `points`, and in the plane `uv`.
    ///
    /// # Panics
    /// Where there are not as many `uv` as `points`, or a triangle names a node that does not exist.
    pub fn new(points: Vec<Vec3>, uv: Vec<[f64; 2]>, triangles: Vec<[u32; 3]>) -> Self {
        assert_eq!(points.len(), uv.len(), "every node has a point and uv");
        let in_space = triangle_bvh(triangles.iter().map(|t| t.map(|n| points[n as usize])));
        Self { points, uv, triangles, in_space, in_plane: OnceLock::new() }
    }

    /// The positions of the nodes in space.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The positions of the nodes in the plane.
    pub fn uv(&self) -> &[[f64; 2]] {
        &self.uv
    }

    /// The triangles, by their nodes.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The point of the triangulation that is closest to `x` in space. `None` only where there is no triangle.
    pub fn to_plane(&self, x: Vec3) -> Option<Located> {
        nearest(&self.in_space, x, f64::INFINITY, |f| self.triangles[f as usize].map(|n| self.points[n as usize]))
    }

    /// The point of the triangulation that is closest to `uv` in the plane: the one there, where it is inside. `None`
    /// only where there is no triangle.
    pub fn to_space(&self, uv: [f64; 2]) -> Option<Located> {
        let corners = |f: u32| self.triangles[f as usize].map(|n| lifted(self.uv[n as usize]));
        let in_plane = self.in_plane.get_or_init(|| {
            let flat = |n: u32| lifted(self.uv[n as usize]);
            triangle_bvh(self.triangles.iter().map(|t| t.map(flat)))
        });
        nearest(in_plane, lifted(uv), f64::INFINITY, corners)
    }

    /// Where a point lies in the plane.
    pub fn uv_of(&self, located: &Located) -> [f64; 2] {
        let uv = self.triangles[located.triangle as usize].map(|n| self.uv[n as usize]);
        [0, 1].map(|k| (0..3).map(|i| located.weights[i] * uv[i][k]).sum())
    }

    /// Where a point lies in space.
    pub fn point_of(&self, located: &Located) -> Vec3 {
        let points = self.triangles[located.triangle as usize].map(|n| self.points[n as usize]);
        [0, 1, 2].map(|k| (0..3).map(|i| located.weights[i] * points[i][k]).sum())
    }
}

/// A point of the plane, in space.
fn lifted([u, v]: [f64; 2]) -> Vec3 {
    [u, v, 0.0]
}

/// A hierarchy of triangles by their corners.
pub fn triangle_bvh(corners: impl IntoIterator<Item = [Vec3; 3]>) -> Bvh {
    Bvh::new(corners.into_iter().map(box_around))
}

/// The box around a triangle.
#[inline]
pub(crate) fn box_around([a, b, c]: [Vec3; 3]) -> BoundingBox {
    BoundingBox {
        min: [0, 1, 2].map(|k| smaller(smaller(a[k], b[k]), c[k])),
        max: [0, 1, 2].map(|k| larger(larger(a[k], b[k]), c[k])),
    }
}

/// The point closest to `x` of triangles in a hierarchy, if it is nearer than `bound`; `corners` tells those of a triangle.
///
/// ```
/// use planish_core::evaluate::{nearest, triangle_bvh};
///
/// let triangles = [0.0, 5.0].map(|z| [[0.0, 0.0, z], [4.0, 0.0, z], [0.0, 4.0, z]]);
/// let tree = triangle_bvh(triangles);
/// let closest = |x, bound| nearest(&tree, x, bound, |t| triangles[t as usize]);
/// let found = closest([1.0, 1.0, 4.0], f64::INFINITY).expect("there are some");
/// assert_eq!((found.triangle, found.distance, found.weights), (1, 1.0, [0.5, 0.25, 0.25]));
/// assert_eq!(closest([1.0, 1.0, 2.0], 0.5), None, "none is so near");
/// ```
pub fn nearest(tree: &Bvh, x: Vec3, bound: f64, corners: impl Fn(u32) -> [Vec3; 3]) -> Option<Located> {
    let (triangle, _) = tree.nearest(x, bound * bound, |f| on_triangle(x, corners(f)).squared)?;
    let OnTriangle { weights, squared } = on_triangle(x, corners(triangle));
    Some(Located { triangle, weights, distance: squared.sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    /// A bumpy disk, mapped by leaving out the height.
    fn bumpy() -> TriangulatedMap {
        let soup = shapes::disk(9);
        let height = |p: &Vec3| 0.3 * (3.0 * p[0]).sin() * (2.0 * p[1]).cos();
        let points = soup.points().iter().map(|p| [p[0], p[1], height(p)]).collect();
        let uv = soup.points().iter().map(|p| [p[0], p[1]]).collect();
        TriangulatedMap::new(points, uv, soup.triangles().to_vec())
    }

    #[test]
    fn there_and_back_is_where_one_was() {
        let map = bumpy();
        for i in 0..400 {
            let (r, a) = (0.9 * f64::from(i) / 400.0, f64::from(i) * 0.7);
            let uv = [r * a.cos(), r * a.sin()];
            let x = map.point_of(&map.to_space(uv).expect("triangles"));
            let back = map.to_plane(x).expect("triangles");
            assert!(back.distance < 1e-15, "{back:?}");
            let found = map.uv_of(&back);
            assert!((0..2).all(|k| (found[k] - uv[k]).abs() < 1e-14), "{uv:?} {found:?}");
        }
    }

    #[test]
    fn corners_sides_and_points_outside_have_answers() {
        let map = bumpy();
        for (node, x) in map.points().iter().enumerate() {
            let found = map.to_plane(*x).expect("triangles");
            let (uv, expected) = (map.uv_of(&found), map.uv()[node]);
            assert!(found.distance < 1e-15 && (0..2).all(|k| (uv[k] - expected[k]).abs() < 1e-15), "{found:?}");
        }
        let outside = map.to_space([2.0, 0.0]).expect("triangles");
        assert!((outside.distance - 1.0).abs() < 1e-3 && outside.weights.iter().all(|w| *w >= 0.0));
        assert_eq!(TriangulatedMap::new(vec![], vec![], vec![]).to_plane([0.0; 3]), None);
    }
}
