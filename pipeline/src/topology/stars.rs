//! The star of a vertex: the triangles around it.

use crate::topology::VertexId;

/// Per vertex, the triangles around it, ascending.
#[derive(Clone, Debug)]
pub struct Stars {
    starts: Vec<u32>,
    faces: Vec<u32>,
}

impl Stars {
    /// The stars of `vertices` vertices in `triangles`.
    pub fn new(triangles: &[[VertexId; 3]], vertices: usize) -> Self {
        let mut starts = vec![0_u32; vertices + 1];
        triangles.iter().flatten().for_each(|v| starts[v.index() + 1] += 1);
        (0..vertices).for_each(|v| starts[v + 1] += starts[v]);
        let mut next = starts.clone();
        let mut faces = vec![0; starts[vertices] as usize];
        for (f, t) in triangles.iter().enumerate() {
            for v in t {
                faces[next[v.index()] as usize] = f as u32;
                next[v.index()] += 1;
            }
        }
        Self { starts, faces }
    }

    /// The triangles around a vertex.
    pub fn around(&self, vertex: usize) -> &[u32] {
        &self.faces[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
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
