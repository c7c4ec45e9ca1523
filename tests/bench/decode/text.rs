//! Text files, for information: what they take of memory.

use crate::Case;
use crate::surface::Surface;

pub const CASES: &[Case] = &[
    Case::new("OBJ", "obj", |s| obj(s, false)).packed(),
    Case::new("OBJ quads", "obj", |s| obj(s, true)).packed(),
    Case::new("OBJ short", "obj", obj_short).packed(),
    Case::new("STL text", "stl", stl_text).packed().with_points(|s| 3 * s.triangles.len()),
    Case::new("PLY text", "ply", ply_text).packed(),
    Case::new("OFF", "off", |s| off(s, false)).packed(),
    Case::new("OFF quads", "off", |s| off(s, true)).packed(),
    Case::new("MEDIT", "mesh", |s| medit(s, false)).packed(),
    Case::new("MEDIT quads", "mesh", |s| medit(s, true)).packed(),
];

/// Vertices with six decimals.
fn obj(surface: &Surface, quads: bool) -> Vec<u8> {
    let mut text = String::new();
    for [x, y, z] in &surface.points {
        text += &format!("v {x:.6} {y:.6} {z:.6}\n");
    }
    let line = |face: &[u32]| format!("f {}\n", words(face.iter().map(|c| c + 1)));
    if quads {
        surface.quads.iter().for_each(|q| text += &line(q));
    } else {
        surface.triangles.iter().for_each(|t| text += &line(t));
    }
    text.into_bytes()
}

/// Vertices with as few digits as can be, and faces that count back.
fn obj_short(surface: &Surface) -> Vec<u8> {
    let side = surface.points.len().isqrt();
    let mut text = String::new();
    for i in 0..surface.points.len() {
        text += &format!("v {} {} 0\n", i % side, i / side);
    }
    let count = surface.points.len() as u32;
    for triangle in &surface.triangles {
        text += &format!("f {}\n", words(triangle.iter().map(|c| i64::from(*c) - i64::from(count))));
    }
    text.into_bytes()
}

fn stl_text(surface: &Surface) -> Vec<u8> {
    let mut text = "solid\n".to_owned();
    for triangle in &surface.triangles {
        text += "facet normal 0 0 1\nouter loop\n";
        for corner in triangle {
            let [x, y, z] = surface.points[*corner as usize];
            text += &format!("vertex {x:e} {y:e} {z:e}\n");
        }
        text += "endloop\nendfacet\n";
    }
    (text + "endsolid\n").into_bytes()
}

fn ply_text(surface: &Surface) -> Vec<u8> {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        surface.points.len(),
        surface.triangles.len()
    );
    surface.points.iter().for_each(|[x, y, z]| text += &format!("{x:.6} {y:.6} {z:.6}\n"));
    surface.triangles.iter().for_each(|t| text += &format!("3 {}\n", words(t.iter())));
    text.into_bytes()
}

/// The faces of a surface, quads where they are asked for.
fn faces(surface: &Surface, quads: bool) -> Vec<&[u32]> {
    if quads {
        surface.quads.iter().map(|q| &q[..]).collect()
    } else {
        surface.triangles.iter().map(|t| &t[..]).collect()
    }
}

fn off(surface: &Surface, quads: bool) -> Vec<u8> {
    let faces = faces(surface, quads);
    let mut text = format!("OFF\n{} {} 0\n", surface.points.len(), faces.len());
    surface.points.iter().for_each(|[x, y, z]| text += &format!("{x:.6} {y:.6} {z:.6}\n"));
    faces.iter().for_each(|f| text += &format!("{} {}\n", f.len(), words(f.iter())));
    text.into_bytes()
}

fn medit(surface: &Surface, quads: bool) -> Vec<u8> {
    let faces = faces(surface, quads);
    let mut text = format!("MeshVersionFormatted 2\nDimension 3\nVertices\n{}\n", surface.points.len());
    surface.points.iter().for_each(|[x, y, z]| text += &format!("{x:.6} {y:.6} {z:.6} 0\n"));
    text += &format!("{}\n{}\n", if quads { "Quadrilaterals" } else { "Triangles" }, faces.len());
    faces.iter().for_each(|f| text += &format!("{} 0\n", words(f.iter().map(|c| c + 1))));
    (text + "End\n").into_bytes()
}

fn words(numbers: impl Iterator<Item = impl ToString>) -> String {
    numbers.map(|n| n.to_string()).collect::<Vec<_>>().join(" ")
}
