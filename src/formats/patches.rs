//! A mesh with what its file tells of its elements.

use pipeline::mesh::{SoupError, TriangleSoup};
use pipeline::space::Vec3;

/// Triangles, each with the surface that it was made on, and the nodes in the middle of its sides. All corners and nodes in
/// the middle of sides exist, and there is a triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    mids: Vec<Option<[u32; 3]>>,
    surfaces: Option<Vec<i64>>,
}

impl Patches {
    /// Triangles; `mids` may be empty, where no triangle has six nodes.
    ///
    /// # Errors
    /// As [`TriangleSoup::new`].
    pub fn new(
        points: Vec<Vec3>,
        triangles: Vec<[u32; 3]>,
        mut mids: Vec<Option<[u32; 3]>>,
        surfaces: Option<Vec<i64>>,
    ) -> Result<Self, SoupError> {
        mids.resize(triangles.len(), None);
        // Whatever is a node of an element must be a point that can be.
        let of_mids = mids.iter().flatten().copied();
        let soup = TriangleSoup::new(points, triangles.iter().copied().chain(of_mids).collect())?;
        Ok(Self { points: soup.points().to_vec(), triangles, mids, surfaces })
    }

    /// The points, in the order of the file.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The corners of the triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Per triangle the nodes in the middle of its sides 01, 12, 20, where it has six nodes.
    pub fn mids(&self) -> &[Option<[u32; 3]>] {
        &self.mids
    }

    /// The tags of the surfaces that the triangles were made on, where the format tells them.
    pub fn surfaces(&self) -> Option<&[i64]> {
        self.surfaces.as_deref()
    }
}
