//! The star of a vertex: the triangles around it.

use crate::topology::VertexId;
use crate::topology::csr::Csr;

/// Per vertex, the triangles around it, ascending.
///
/// ```
/// use planish_core::topology::{Stars, VertexId};
///
/// let triangles = [[0, 1, 2], [0, 2, 3]].map(|t| t.map(VertexId));
/// let stars = Stars::new(&triangles, 5);
/// assert_eq!(stars.around(2), [0, 1]);
/// assert!(stars.around(4).is_empty(), "no triangle has it for a corner");
/// ```
#[derive(Clone, Debug)]
pub struct Stars {
    faces: Csr<u32>,
}

impl Stars {
    /// The stars of `vertices` vertices in `triangles`.
    pub fn new(triangles: &[[VertexId; 3]], vertices: usize) -> Self {
        let corners = || (0_u32..).zip(triangles).flat_map(|(face, t)| t.map(|v| (v.0, face)));
        Self { faces: Csr::sorted(vertices, corners) }
    }

    /// The triangles around a vertex.
    pub fn around(&self, vertex: usize) -> &[u32] {
        self.faces.row(vertex)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_corner_is_in_the_star_of_its_vertex() {
        let triangles = [[0, 1, 2], [2, 1, 3], [0, 2, 4]].map(|t| t.map(VertexId));
        let stars = Stars::new(&triangles, 6);
        let all: Vec<&[u32]> = (0..6).map(|v| stars.around(v)).collect();
        assert_eq!(all, [&[0, 2][..], &[0, 1], &[0, 1, 2], &[1], &[2], &[]]);
    }
}
