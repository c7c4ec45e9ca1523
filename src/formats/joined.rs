//! The vertices of a surface, each once: what charts, sheets and parts with labels have copies of is one here.

use planish_core::mesh::SurfaceMesh;
use planish_core::topology::VertexId;
use planish_core::vec3::Vec3;

/// The vertices of a surface, each once, in the order in which the file has them; those that were added come last.
pub struct JoinedVertices {
    points: Vec<Vec3>,
    /// Per vertex, a copy of it in the surface.
    copies: Vec<VertexId>,
    /// Per welded vertex, its number among these; [`NONE`] where no triangle has it.
    numbers: Vec<u32>,
}

/// No triangle has this vertex.
const NONE: u32 = u32::MAX;

impl JoinedVertices {
    /// The vertices that triangles of `mesh` have.
    pub fn of(mesh: &SurfaceMesh) -> Self {
        let mut first_copies: Vec<Option<VertexId>> = Vec::new();
        for vertex in mesh.triangles().iter().flatten() {
            let welded = mesh.welded_vertex(*vertex) as usize;
            first_copies.resize(first_copies.len().max(welded + 1), None);
            first_copies[welded].get_or_insert(*vertex);
        }
        let mut numbers = vec![NONE; first_copies.len()];
        let mut copies = Vec::new();
        for (welded, copy) in first_copies.into_iter().enumerate() {
            if let Some(copy) = copy {
                numbers[welded] = copies.len() as u32;
                copies.push(copy);
            }
        }
        let points = copies.iter().map(|v| mesh.points()[v.index()]).collect();
        Self { points, copies, numbers }
    }

    /// Where they are.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// A copy of each in the surface.
    pub fn copies(&self) -> &[VertexId] {
        &self.copies
    }

    /// The number of the one that has this number after welding ([`SurfaceMesh::welded_vertex`]), and is the corner of
    /// a triangle.
    pub fn number(&self, welded: u32) -> u32 {
        self.numbers[welded as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use planish_core::monitor::NoMonitor;
    use planish_core::{Settings, parametrize, shapes};

    #[test]
    fn copies_of_a_vertex_are_one_and_lie_at_one_place() {
        for soup in [shapes::ring_torus(24, 12), shapes::book(3, 4), shapes::cracked_patch(), shapes::sliver_strip(8)] {
            let atlas = parametrize(&soup, &Settings::default(), &NoMonitor).expect("an atlas");
            let mesh = atlas.mesh();
            let joined = JoinedVertices::of(mesh);
            let mut seen = vec![false; joined.points().len()];
            for vertex in mesh.triangles().iter().flatten() {
                let number = joined.number(mesh.welded_vertex(*vertex)) as usize;
                assert_eq!(joined.points()[number], mesh.points()[vertex.index()]);
                seen[number] = true;
            }
            assert!(seen.into_iter().all(|seen| seen));
            assert!(joined.points().len() < mesh.points().len() || mesh.topology_summary().nonmanifold_edges == 0);
        }
    }
}
