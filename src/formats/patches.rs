//! A mesh with what its file tells of its elements.

use planish_core::mesh::TriangleSoup;
use planish_core::vec3::Vec3;

/// Triangles, each with the surface that it was made on, and the nodes in the middle of its sides.
#[derive(Clone, Debug, PartialEq)]
pub struct Patches {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    mids: Vec<Option<[u32; 3]>>,
    surfaces: Option<Vec<i64>>,
}

impl Patches {
    /// The first triangles of `soup`, as many as there are `mids`. What follows in the soup are those nodes: all of them are
    /// points that can be.
    pub fn new(soup: &TriangleSoup, mids: Vec<Option<[u32; 3]>>, surfaces: Option<Vec<i64>>) -> Self {
        let triangles = soup.triangles()[..mids.len()].to_vec();
        Self { points: soup.points().to_vec(), triangles, mids, surfaces }
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
