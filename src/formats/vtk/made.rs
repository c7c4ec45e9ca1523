//! A mesh that planish has made, as `.vtu`.

use super::appended::{Array, Grid};
use super::vtu::names_of_labels;
use crate::formats::fields::{Field, Values};
use crate::formats::made::MadeMesh;

/// The bytes of the file. Cells: `chart`, and where parts have names `label`, the tag of each, whose names are told beside.
pub fn made(mesh: &MadeMesh) -> Vec<u8> {
    let mut of_cells = vec![Array::integers("chart", mesh.charts.iter().map(|chart| *chart as i32))];
    if !mesh.parts.is_empty() {
        of_cells.push(Array::integers("label", (0..mesh.triangles.len()).map(|t| mesh.tag(t))));
    }
    of_cells.extend(mesh.of_cells.iter().map(array));
    let grid = Grid {
        count: mesh.points.len(),
        points: Array::doubles("Points", 3, mesh.points.iter().flatten().copied()),
        cells: (0..mesh.triangles.len()).flat_map(|t| mesh.nodes(t)).collect(),
        nodes_per_cell: mesh.nodes_per_triangle(),
        of_points: mesh.of_points.iter().map(array).collect(),
        of_cells,
        field_data: names_of_labels(&mesh.parts),
    };
    grid.into_bytes()
}

fn array(field: &Field) -> Array {
    match &field.values {
        Values::Integers(values) => Array::whole(&field.name, field.components, values.iter().copied()),
        Values::Floats(values) => Array::doubles(&field.name, field.components, values.iter().copied()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::made::tests::two;
    use crate::formats::{Format, read_alone};

    #[test]
    fn it_is_read_as_it_was_written() {
        let mut mesh = two();
        let read = |mesh: &MadeMesh| read_alone(Format::Vtu, &made(mesh)).expect("read");
        let content = read(&mesh);
        assert_eq!((content.soup.points(), content.soup.triangles()), (&mesh.points[..], &mesh.triangles[..]));
        assert_eq!(content.notes.labels.len(), 2);
        mesh.middles = vec![[4, 5, 6], [6, 7, 8]];
        mesh.points.resize(9, [0.5; 3]);
        assert_eq!(read(&mesh).notes.mid_nodes, 5);
    }
}
