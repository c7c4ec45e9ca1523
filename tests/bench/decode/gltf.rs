//! GLB.

use crate::Case;
use crate::surface::{Surface, put};

/// Parts of a surface whose points can be counted by 16 bits.
const PARTS: usize = 12;

pub const CASES: &[Case] = &[
    Case::new("GLB u32", "glb", |s| container(&json(s.points.len(), s.triangles.len(), 12, 1), &whole(s, false))),
    Case::new("GLB u32, normals interleaved", "glb", |s| {
        container(&json(s.points.len(), s.triangles.len(), 24, 1), &whole(s, true))
    }),
    Case::new("GLB u16, 12 parts", "glb", parts).with_points(|s| s.points.len() + s.points.len() / 59),
];

/// Points, with normals perhaps, and triangles.
fn whole(surface: &Surface, normals: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    for point in &surface.points {
        put(&mut bytes, false, point.map(|c| c as f32));
        if normals {
            put(&mut bytes, false, [0.0_f32, 0.0, 1.0]);
        }
    }
    put(&mut bytes, false, surface.triangles.iter().flatten().copied());
    bytes
}

/// A mesh of parts: of 59 rows of points and those of the next, each.
fn parts(surface: &Surface) -> Vec<u8> {
    let (points, triangles) = (surface.points.len() / PARTS, surface.triangles.len() / PARTS);
    let row = points / 59;
    let mut bytes = Vec::new();
    for part in 0..PARTS {
        let from = part * points;
        let corners = (from..from + points + row).map(|i| surface.points[i % surface.points.len()]);
        corners.for_each(|p| put(&mut bytes, false, p.map(|c| c as f32)));
        let local = |i: &u32| ((*i as usize + surface.points.len() - from) % surface.points.len()) as u16;
        let indices = surface.triangles[part * triangles..(part + 1) * triangles].iter().flatten().map(local);
        put(&mut bytes, false, indices);
    }
    container(&json_of_parts(points + row, triangles), &bytes)
}

/// The document of one mesh.
fn json(points: usize, triangles: usize, stride: usize, parts: usize) -> String {
    document(&[(0, points, stride)], &[(points * stride, 3 * triangles, 5125)], points * stride + 12 * triangles, parts)
}

fn json_of_parts(points: usize, triangles: usize) -> String {
    let size = 12 * points + 6 * triangles;
    let vectors: Vec<_> = (0..PARTS).map(|p| (p * size, points, 12)).collect();
    let indices: Vec<_> = (0..PARTS).map(|p| (p * size + 12 * points, 3 * triangles, 5123)).collect();
    document(&vectors, &indices, PARTS * size, PARTS)
}

/// A document: vectors by offset, count and stride; indices by offset, count and type.
fn document(
    vectors: &[(usize, usize, usize)],
    indices: &[(usize, usize, usize)],
    length: usize,
    parts: usize,
) -> String {
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    for (i, (offset, count, stride)) in vectors.iter().enumerate() {
        let bytes = count * stride;
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{bytes},\"byteStride\":{stride}}}"));
        accessors.push(format!(
            "{{\"bufferView\":{i},\"componentType\":5126,\"count\":{count},\"type\":\"VEC3\",\
             \"min\":[-9,-9,-9],\"max\":[9,9,9]}}"
        ));
    }
    for (i, (offset, count, kind)) in indices.iter().enumerate() {
        let bytes = count * if *kind == 5123 { 2 } else { 4 };
        views.push(format!("{{\"buffer\":0,\"byteOffset\":{offset},\"byteLength\":{bytes}}}"));
        let view = vectors.len() + i;
        accessors
            .push(format!("{{\"bufferView\":{view},\"componentType\":{kind},\"count\":{count},\"type\":\"SCALAR\"}}"));
    }
    let primitive = |i| format!("{{\"attributes\":{{\"POSITION\":{i}}},\"indices\":{}}}", parts + i);
    let primitives: Vec<String> = (0..parts).map(primitive).collect();
    format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{}]}}],\"buffers\":[{{\"byteLength\":{length}}}],\"bufferViews\":[{}],\
         \"accessors\":[{}]}}",
        primitives.join(","),
        views.join(","),
        accessors.join(",")
    )
}

/// A container of a document and its data.
fn container(json: &str, data: &[u8]) -> Vec<u8> {
    let json = format!("{json}{}", " ".repeat(json.len().next_multiple_of(4) - json.len()));
    let padding = data.len().next_multiple_of(4) - data.len();
    let total = 12 + 8 + json.len() + 8 + data.len() + padding;
    let mut bytes = b"glTF".to_vec();
    put(&mut bytes, false, [2, total as u32, json.len() as u32]);
    bytes.extend(b"JSON");
    bytes.extend(json.as_bytes());
    put(&mut bytes, false, [(data.len() + padding) as u32]);
    bytes.extend(b"BIN\0");
    bytes.extend(data);
    bytes.resize(total, 0);
    bytes
}
