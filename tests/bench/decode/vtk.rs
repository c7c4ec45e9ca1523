//! Binary legacy files of VTK.

use crate::Case;
use crate::surface::{Surface, put};

pub const CASES: &[Case] = &[
    Case::new("VTK 5.1 polygons", "vtk", polygons_5),
    Case::new("VTK 5.1 grid", "vtk", grid_5),
    Case::new("VTK 3.0 polygons", "vtk", |s| polygons_3(s, false)),
    Case::new("VTK 3.0 polygons, quads", "vtk", |s| polygons_3(s, true)),
    Case::new("VTK 4.2 grid", "vtk", grid_4),
];

fn head(surface: &Surface, version: &str, dataset: &str) -> Vec<u8> {
    let points = surface.points.len();
    let head = format!("# vtk DataFile Version {version}\na\nBINARY\nDATASET {dataset}\nPOINTS {points} float\n");
    let mut bytes = head.into_bytes();
    put(&mut bytes, true, surface.points.iter().flatten().map(|c| *c as f32));
    bytes.push(b'\n');
    bytes
}

/// Cells of version 5: where each begins, and corners.
fn cells_5(bytes: &mut Vec<u8>, surface: &Surface, section: &str) {
    let count = surface.triangles.len();
    bytes.extend(format!("{section} {} {}\nOFFSETS vtktypeint64\n", count + 1, 3 * count).as_bytes());
    put(bytes, true, (0..=count as i64).map(|i| 3 * i));
    bytes.extend(b"\nCONNECTIVITY vtktypeint64\n");
    put(bytes, true, surface.triangles.iter().flatten().map(|c| i64::from(*c)));
    bytes.push(b'\n');
}

/// Cells of older versions: the number of corners before them.
fn cells_3(bytes: &mut Vec<u8>, faces: &[&[u32]], section: &str) {
    let size: usize = faces.iter().map(|f| f.len() + 1).sum();
    bytes.extend(format!("{section} {} {size}\n", faces.len()).as_bytes());
    for face in faces {
        put(bytes, true, [face.len() as i32]);
        put(bytes, true, face.iter().map(|c| *c as i32));
    }
    bytes.push(b'\n');
}

fn types(bytes: &mut Vec<u8>, surface: &Surface) {
    bytes.extend(format!("CELL_TYPES {}\n", surface.triangles.len()).as_bytes());
    put(bytes, true, surface.triangles.iter().map(|_| 5_i32));
}

fn polygons_5(surface: &Surface) -> Vec<u8> {
    let mut bytes = head(surface, "5.1", "POLYDATA");
    cells_5(&mut bytes, surface, "POLYGONS");
    bytes
}

fn grid_5(surface: &Surface) -> Vec<u8> {
    let mut bytes = head(surface, "5.1", "UNSTRUCTURED_GRID");
    cells_5(&mut bytes, surface, "CELLS");
    types(&mut bytes, surface);
    bytes
}

fn polygons_3(surface: &Surface, quads: bool) -> Vec<u8> {
    let mut bytes = head(surface, "3.0", "POLYDATA");
    let faces: Vec<&[u32]> = match quads {
        true => surface.quads.iter().map(|q| &q[..]).collect(),
        false => surface.triangles.iter().map(|t| &t[..]).collect(),
    };
    cells_3(&mut bytes, &faces, "POLYGONS");
    bytes
}

fn grid_4(surface: &Surface) -> Vec<u8> {
    let mut bytes = head(surface, "4.2", "UNSTRUCTURED_GRID");
    cells_3(&mut bytes, &surface.triangles.iter().map(|t| &t[..]).collect::<Vec<_>>(), "CELLS");
    types(&mut bytes, surface);
    bytes
}
