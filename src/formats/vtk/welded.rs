//! `welded.vtu`: the surface with one node where charts meet, for solvers and other programs that need a closed mesh.
//!
//! In surface.vtu every chart has nodes of its own, as uv differ on the two sides of a seam: a closed surface is open
//! there. Here nodes are those of the surface, and belong to all triangles around them, sheets of a surface that is no
//! manifold included.

use super::appended::{Array, Grid};
use super::vtu::{names_of_labels, of_charts, source_triangles, tag_of};
use crate::formats::joined::JoinedVertices;
use crate::formats::labels::Label;
use planish_core::CertifiedAtlas;
use planish_core::atlas::Chart;
use planish_core::mesh::SurfaceMesh;
use planish_core::vec3::{Vec3, midpoint};
use std::collections::HashMap;

/// The bytes of `welded.vtu`: a triangle of six nodes for each of surface.vtu, in the same order.
///
/// Points: `vertex`, the input vertex, -1 for nodes in the middle of edges, -2 for vertices that were added. Cells:
/// `chart`,
/// `triangle`, the input triangle, and where there are labels `label`, the tag of each.
pub fn surface(atlas: &CertifiedAtlas, labels: &[Label]) -> Vec<u8> {
    let mut nodes = Nodes::of(atlas.mesh());
    let mut cells = Vec::with_capacity(atlas.mesh().triangles().len());
    for certified in atlas.charts() {
        let faces = 0..certified.chart().triangles().len();
        cells.extend(faces.map(|face| nodes.of_triangle(certified.chart(), face)));
    }
    let grid = Grid {
        count: nodes.points.len(),
        points: Array::doubles("Points", 3, nodes.points.iter().flatten().copied()),
        cells: cells.into_flattened(),
        nodes_per_cell: 6,
        of_points: vec![Array::integers("vertex", nodes.input.iter().copied())],
        of_cells: cell_fields(atlas, labels),
        field_data: names_of_labels(labels),
    };
    grid.into_bytes()
}

/// The nodes of the surface: its vertices, then the middles of its edges as triangles come upon them.
struct Nodes {
    vertices: JoinedVertices,
    points: Vec<Vec3>,
    /// The input vertex of each.
    input: Vec<i32>,
    /// By the ends of an edge, the smaller first.
    middles: HashMap<[u32; 2], u32>,
}

impl Nodes {
    fn of(mesh: &SurfaceMesh) -> Self {
        let vertices = JoinedVertices::of(mesh);
        let number = |v| mesh.input_vertex(v).map_or(-2, |number| number as i32);
        let input = vertices.copies().iter().map(|v| number(*v)).collect();
        Self { points: vertices.points().to_vec(), input, vertices, middles: HashMap::new() }
    }

    /// The corners, then the middles of the edges 01, 12 and 20.
    fn of_triangle(&mut self, chart: &Chart, face: usize) -> [u32; 6] {
        let [a, b, c] = chart.triangles()[face].map(|v| self.vertices.number(chart.welded_vertex(v)));
        [a, b, c, self.middle(a, b), self.middle(b, c), self.middle(c, a)]
    }

    /// The node in the middle of an edge. Edges are straight, so that what has the same ends has the same middle.
    fn middle(&mut self, from: u32, to: u32) -> u32 {
        let next = self.points.len() as u32;
        let node = *self.middles.entry([from.min(to), from.max(to)]).or_insert(next);
        if node == next {
            self.points.push(midpoint(self.points[from as usize], self.points[to as usize]));
            self.input.push(-1);
        }
        node
    }
}

fn cell_fields(atlas: &CertifiedAtlas, labels: &[Label]) -> Vec<Array> {
    let charts = || atlas.charts().iter();
    let mut fields = vec![of_charts("chart", charts(), |c| c.id().0 as i32), source_triangles(charts())];
    if !labels.is_empty() {
        fields.push(of_charts("label", charts(), |c| tag_of(atlas, c.id(), labels)));
    }
    fields
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::texture::tests::{atlas_of, labelled_cube};
    use crate::formats::vtu::{Shape, read_shape};
    use crate::formats::{Content, Format, LabelSource, Limits, ReadError, Source, read_alone};
    use planish_core::shapes;
    use std::collections::BTreeMap;

    /// Reads a file with its array `label`, which must be there.
    fn read_labelled(bytes: &[u8]) -> Result<Content, ReadError> {
        let limits = Limits::default();
        let source = Source { labels: &LabelSource::Array("label".to_owned()), ..Source::alone(bytes, &limits) };
        crate::formats::read(Format::Vtu, &source)
    }

    /// How many triangles each edge has, with its middle.
    fn sides(cells: &[[u32; 6]]) -> BTreeMap<([u32; 2], u32), usize> {
        let mut sides = BTreeMap::new();
        for cell in cells {
            for k in 0..3 {
                let (a, b) = (cell[k], cell[(k + 1) % 3]);
                *sides.entry(([a.min(b), a.max(b)], cell[3 + k])).or_default() += 1;
            }
        }
        sides
    }

    #[test]
    fn a_torus_is_closed_and_its_nodes_are_those_of_the_surface() {
        let soup = shapes::ring_torus(24, 12);
        let atlas = atlas_of(&soup);
        let bytes = surface(&atlas, &[]);
        let Shape { points, cells, .. } = read_shape(&bytes).expect("read");
        let sides = sides(&cells);
        assert!(atlas.charts().len() > 1 && read_labelled(&bytes).is_err(), "there are no labels");
        assert!(sides.values().all(|triangles| *triangles == 2), "closed");
        assert_eq!(points.len(), atlas.mesh().points().len() + sides.len());
        for ([a, b], middle) in sides.keys() {
            assert_eq!(points[*middle as usize], midpoint(points[*a as usize], points[*b as usize]));
        }
        // Cell by cell the triangles of surface.vtu, node by node.
        let open = read_shape(&crate::formats::vtu::surface(&atlas, &[], &Default::default())).expect("read");
        assert_eq!(cells.len(), open.cells.len());
        for (cell, apart) in cells.iter().zip(&open.cells) {
            assert!((0..6).all(|k| points[cell[k] as usize] == open.points[apart[k] as usize]));
        }
        assert_eq!(
            read_alone(Format::Vtu, &bytes).expect("planish reads it again").soup.triangles().len(),
            cells.len()
        );
    }

    #[test]
    fn sheets_share_the_edges_where_they_meet() {
        let cells = read_shape(&surface(&atlas_of(&shapes::book(3, 4)), &[])).expect("read").cells;
        assert_eq!(sides(&cells).values().filter(|triangles| **triangles == 3).count(), 4, "three pages at the spine");
    }

    #[test]
    fn parts_with_labels_share_nodes_and_tell_their_tags() {
        let (atlas, labels) = labelled_cube();
        let bytes = surface(&atlas, &labels);
        let cells = read_shape(&bytes).expect("read").cells;
        assert!(sides(&cells).values().all(|triangles| *triangles == 2));
        let content = read_labelled(&bytes).expect("a field");
        assert_eq!(content.soup.labels().len(), cells.len());
        let tags: Vec<i32> = content.notes.labels.iter().map(|l| l.tag).collect();
        assert_eq!(tags, [10, 11, 12, 13, 14, 15]);
    }
}
