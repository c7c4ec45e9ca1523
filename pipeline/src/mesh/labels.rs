//! Borders between labels: the surface is cut open along them, so that no chart can cross one.
//!
//! Each part of one label gets vertices of its own, as the sheets do that meet at an edge of three triangles: what follows then
//! knows a border as open boundary, which nothing moves, and the curves between charts join the sides again by their welded
//! vertices ([`crate::seams`]). The counts of the surface stay those of the whole: a border is no end of the surface.

use super::SurfaceMesh;
use crate::topology::{EdgeTable, HalfEdgeId, VertexFans};

impl SurfaceMesh {
    /// The same surface, cut open between triangles of different labels; its counts stay those of the whole.
    pub(crate) fn cut_between_labels(self) -> Self {
        let are_alike = |g: HalfEdgeId, h: HalfEdgeId| self.label(g.face().index()) == self.label(h.face().index());
        let is_border = |sides: &[HalfEdgeId]| matches!(*sides, [g, h] if !are_alike(g, h));
        if !self.edges.iter().any(|(_, sides)| is_border(sides)) {
            return self;
        }
        let joins = |sides: &[HalfEdgeId]| sides.len() == 2 && !is_border(sides);
        let fans = VertexFans::across(&self.triangles, &self.edges, joins);
        // Copies of a vertex follow each other, so that the vertices of the input stay in front of those that were added.
        let (triangles, copied) = fans.numbered(&self.triangles);
        let added_from = copied.partition_point(|v| v.index() < self.added_from);
        Self {
            points: copied.iter().map(|v| self.points[v.index()]).collect(),
            welded: copied.iter().map(|v| self.welded[v.index()]).collect(),
            sizes: copied.iter().filter_map(|v| self.sizes.get(v.index()).copied()).collect(),
            added_from,
            middles: copied[added_from..].iter().filter_map(|v| self.middle_of(*v)).collect(),
            edges: EdgeTable::new(&triangles),
            triangles,
            ..self
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::topology::TopologySummary;
    use crate::{repair, shapes};

    /// A sphere of three labels, that meet in the poles: three parts with vertices of their own, and the counts of a sphere.
    #[test]
    fn every_part_of_a_label_gets_vertices_of_its_own() {
        let soup = shapes::sphere(8);
        let sector = |t: &[u32; 3]| {
            let [x, y] = [0, 1].map(|k| t.iter().map(|v| soup.points()[*v as usize][k]).sum::<f64>());
            (y.atan2(x) / std::f64::consts::TAU * 3.0 + 1.5).floor() as u32 % 3
        };
        let labels: Vec<u32> = soup.triangles().iter().map(sector).collect();
        let whole = repair(&soup.clone().with_labels(labels.clone()), &Default::default()).expect("a surface").mesh;
        let cut = whole.clone().cut_between_labels();
        let parts = TopologySummary::new(cut.triangles(), cut.edges());
        assert_eq!((parts.components, parts.boundary_loops), (3, 3));
        assert_eq!(cut.topology_summary(), whole.topology_summary());
        for face in 0..cut.triangles().len() {
            assert_eq!(cut.label(face), Some(labels[face]));
            assert_eq!(cut.corners(face), whole.corners(face));
            let welded = |mesh: &crate::mesh::SurfaceMesh| mesh.triangles()[face].map(|v| mesh.welded_vertex(v));
            assert_eq!(welded(&cut), welded(&whole));
        }
        // Without a border nothing changes.
        let one = repair(&soup.with_labels(vec![7; labels.len()]), &Default::default()).expect("a surface").mesh;
        assert_eq!(one.clone().cut_between_labels().points().len(), one.points().len());
    }
}
