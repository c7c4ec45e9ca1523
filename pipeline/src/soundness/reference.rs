//! What a mesh is held against: the certified surface, and the maps that the mesher used. And the mesh.

use crate::evaluate::{Bvh, TriangulatedMap, triangle_bvh};
use crate::repair::weld::distinct;
use crate::topology::VertexId;
use crate::vec3::{BoundingBox, Vec3, triangle_area};

/// A triangulated surface or mesh whose points are all different.
#[derive(Clone, Debug, Default)]
pub struct Triangulation {
    /// Positions.
    pub points: Vec<Vec3>,
    /// Corners of the triangles.
    pub triangles: Vec<[VertexId; 3]>,
}

impl Triangulation {
    /// The triangulation with bit-equal points (the sign of zero does not count) made one; points that no triangle uses
    /// stay.
    ///
    /// # Panics
    /// Where a triangle names a point that does not exist.
    ///
    /// ```
    /// use planish_core::soundness::Triangulation;
    ///
    /// // Two triangles as STL has them: each with corners of its own.
    /// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]].into_iter();
    /// let points: Vec<_> = points.chain([[0.0, 1.0, 0.0], [1.0, -0.0, 0.0], [1.0, 1.0, 0.0]]).collect();
    /// let square = Triangulation::welded(&points, [[0, 1, 2], [3, 4, 5]]);
    /// assert_eq!((square.points.len(), square.area()), (4, 1.0));
    /// ```
    pub fn welded(points: &[Vec3], triangles: impl IntoIterator<Item = [u32; 3]>) -> Self {
        let (number, kept) = distinct(points);
        let triangles = triangles.into_iter().map(|t| t.map(|i| number[i as usize])).collect();
        Self { points: kept, triangles }
    }

    /// The corners of a triangle in space.
    #[inline]
    pub fn corners(&self, triangle: usize) -> [Vec3; 3] {
        let [a, b, c] = self.triangles[triangle];
        [self.points[a.index()], self.points[b.index()], self.points[c.index()]]
    }

    /// The area of a triangle.
    pub fn area_of(&self, triangle: usize) -> f64 {
        triangle_area(self.corners(triangle))
    }

    /// The area of all triangles.
    pub fn area(&self) -> f64 {
        (0..self.triangles.len()).map(|t| self.area_of(t)).sum()
    }

    /// The diagonal of the bounding box.
    pub fn diagonal(&self) -> f64 {
        BoundingBox::of(self.points.iter().copied()).map_or(0.0, |b| b.diagonal())
    }

    /// The triangles, by where they are.
    pub fn bvh(&self) -> Bvh {
        triangle_bvh((0..self.triangles.len()).map(|t| self.corners(t)))
    }
}

/// The charts as the mesher got them.
#[derive(Clone, Debug, Default)]
pub struct HandedOverAtlas {
    /// The curves, as polylines from begin to end; a closed one ends where it begins.
    pub curves: Vec<Vec<Vec3>>,
    /// The charts.
    pub charts: Vec<HandedOverChart>,
}

/// A chart as the mesher got it.
#[derive(Clone, Debug)]
pub struct HandedOverChart {
    /// The triangulation in space and in the plane.
    pub map: TriangulatedMap,
    /// The curves that bound it, by their positions in the atlas.
    pub curves: Vec<u32>,
}

/// A mesh to be judged.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// The nodes, and the corners of the triangles.
    pub triangulation: Triangulation,
    /// Per triangle the nodes in the middle of its sides 01, 12, 20, where it has six nodes.
    pub mids: Vec<Option<[VertexId; 3]>>,
    /// Per triangle the chart that it was made in; none where the file does not tell.
    pub charts: Option<Vec<u32>>,
}
