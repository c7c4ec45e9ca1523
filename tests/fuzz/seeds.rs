//! Small files of every format, which mutations begin with.

use crate::interop::matrix;
use planish::formats::{Format, Kind, kind};
use serde_json::{Value, json};
use std::sync::LazyLock;

/// Points along a side of the surface that VTK, meshio and Gmsh write.
const SIDE: usize = 6;

static MATRIX: LazyLock<Vec<(String, Vec<u8>)>> = LazyLock::new(|| matrix::files(SIDE));

/// The seeds of a format, with their names.
pub fn of(format: Format) -> Vec<(String, Vec<u8>)> {
    let of_format = |(name, _): &&(String, Vec<u8>)| kind(name.as_ref()) == Kind::Mesh(format);
    let mut seeds: Vec<(String, Vec<u8>)> = MATRIX.iter().filter(of_format).cloned().collect();
    let own = match format {
        Format::Stl => vec![("solids.stl", SOLIDS.into())],
        Format::Obj => vec![("groups.obj", GROUPS.into()), ("polygons.obj", polygons())],
        Format::Gltf => gltf(),
        Format::Ply => vec![("strips.ply", STRIPS.into())],
        Format::Vtk => vec![("fields.vtk", FIELDS.into())],
        Format::Off => vec![("colours.off", COLOURS.into()), ("bare.off", BARE.into())],
        Format::Medit => vec![("sections.mesh", SECTIONS.into())],
        Format::Msh | Format::Vtu | Format::Vtp => vec![],
    };
    seeds.extend(own.into_iter().map(|(name, bytes)| (name.to_owned(), bytes)));
    seeds
}

const SOLIDS: &str = "solid one\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                      endfacet\nendsolid one\nSOLID two\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 1e-3\n\
                      VERTEX 1 0 .5\nVERTEX 0 1 -0\nENDLOOP\nENDFACET\nENDSOLID two\n";

const GROUPS: &str = "# a comment\nmtllib none.mtl\no thing\ng a b\nv 0 0 0 1\nv 1 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\n\
                      vt 0 0\nvn 0 0 1\nusemtl none\ns 1\nf 1/1/1 2//1 3/1\nf -4 -2 -1\ng second\nv 2 0 0\n\
                      f 2 5 \\\n 3\nl 1 2 3\np 1\nf 1 2 3 4\n";

const STRIPS: &str = "ply\nformat ascii 1.0\ncomment strips\nelement vertex 6\nproperty float x\nproperty double y\n\
                      property short z\nelement edge 1\nproperty int vertex1\nproperty int vertex2\nelement face 2\n\
                      property uchar red\nproperty list uchar int vertex_indices\nelement tristrips 1\n\
                      property list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n2 1 1\n\
                      0 1\n255 3 0 1 2\n0 4 0 1 2 3\n7 0 1 2 -1 1 4 5\n";

const FIELDS: &str = "# vtk DataFile Version 4.2\nfields\nASCII\nDATASET POLYDATA\nFIELD FieldData 1\nTIME 1 1 double\n\
                      0.5\nMETADATA\nINFORMATION 1\nNAME UNITS LOCATION vtk\nDATA s\n\nPOINTS 5 float\n0 0 0 1 0 0\n\
                      1 1 0 0 1 0\n2 0 0\nVERTICES 1 2\n1 0\nLINES 1 3\n2 0 1\nPOLYGONS 2 9\n4 0 1 2 3\n3 1 4 2\n\
                      TRIANGLE_STRIPS 1 5\n4 0 1 3 2\nCELL_DATA 5\nSCALARS a float 1\nLOOKUP_TABLE default\n\
                      1 2 3 4 5\nPOINT_DATA 5\nNORMALS n float\n0 0 1 0 0 1 0 0 1 0 0 1 0 0 1\n";

const COLOURS: &str = "STCNOFF # a comment\n6 5 0\n0 0 0 255 0 0 255 0 0 1 0 0\n1 0 0 1 1 1 1 0 0 1 1 0\n\
                       1 1 nan\n0 1 1e-3\n# another\n0 2 0\n1 2 .5\n3 0 1 3 0.5 0.5 0.5\n4 0 1 5 4 7\n2 0 1\n\
                       5 0 1 5 4 3 255 0 0\n3 3 5 4\n";

const BARE: &str = "OFF4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n3 0 2 3\n";

const SECTIONS: &str = "MeshVersionFormatted 2\nDimension\n3\nTriangles\n2\n1 2 3 7\n1 3 4 7\nVertices\n7\n0 0 0 1\n\
                        1 0 0 1\n1 1 0.5 1\n0 1 0 2\n.5 0 0 0\nnan 0 0 0\n0 .5 0 0\n# a comment\nCorners\n2\n1\n2\n\
                        Quadrilaterals\n1\n1 2 3 4 0\nTrianglesP2\n1\n1 2 4 5 6 7 0\nEdges\n1\n1 2 0\nNormals\n1\n\
                        0 0 1\nIdentifier \"a b\"\nTetrahedra\n1\n1 2 3 4 0\nEnd\n";

/// Polygons that are not convex, and one of very many corners.
fn polygons() -> Vec<u8> {
    let corners = 60;
    let corner = |i: usize| {
        let (angle, r) = (i as f64 * 0.1, [1.0, 0.5][i % 2]);
        format!("v {:.4} {:.4} 0\n", r * angle.cos(), r * angle.sin())
    };
    let mut text: String = (0..corners).map(corner).collect();
    let all: Vec<String> = (1..=corners).map(|i| i.to_string()).collect();
    text.push_str(&format!("f {}\nf 1 2 3 4 5\nf 9 7 5 3 1\n", all.join(" ")));
    text.into_bytes()
}

/// Eight points, then indices, then what sparse accessors change.
fn data() -> Vec<u8> {
    let point = |i: u32| [(i % 4) as f32, (i / 4) as f32, (i % 3) as f32 / 8.0];
    let mut bytes: Vec<u8> = (0..8).flat_map(point).flat_map(f32::to_le_bytes).collect();
    bytes.extend([0_u16, 1, 4, 1, 5, 4, 1, 2, 5, 2, 6, 5].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([0_u32, 4, 1, 5, 2, 6, 3, 7].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([1_u8, 3, 0, 0]);
    bytes.extend([[1.0_f32, 0.0, 0.5], [3.0, 0.0, 0.25]].iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// A document with primitives of all kinds, nodes above each other, and a sparse accessor.
fn document(buffer: Value) -> Value {
    json!({
        "asset": {"version": "2.0", "generator": "by hand"}, "scene": 0,
        "scenes": [{"name": "all", "nodes": [0, 3]}],
        "nodes": [
            {"name": "above", "children": [1, 2], "matrix": [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 1, 2, 3, 1]},
            {"mesh": 0, "translation": [1, 0, 0], "rotation": [0, 0, 0.6, 0.8]},
            {"mesh": 0, "scale": [1, -1, 1]},
            {"mesh": 1, "name": "strips"}
        ],
        "meshes": [
            {"name": "plain", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]},
            {"primitives": [
                {"attributes": {"POSITION": 0}, "indices": 2, "mode": 5},
                {"attributes": {"POSITION": 3}, "mode": 6},
                {"attributes": {"POSITION": 0}, "mode": 1}
            ]}
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3", "min": [0, 0, 0], "max": [3, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5125, "count": 8, "type": "SCALAR"},
            {"bufferView": 0, "componentType": 5126, "count": 6, "type": "VEC3", "min": [0, 0, 0], "max": [3, 1, 1],
             "sparse": {"count": 2, "indices": {"bufferView": 3, "componentType": 5121}, "values": {"bufferView": 4}}}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 96, "byteStride": 12, "target": 34962},
            {"buffer": 0, "byteOffset": 96, "byteLength": 24},
            {"buffer": 0, "byteOffset": 120, "byteLength": 32},
            {"buffer": 0, "byteOffset": 152, "byteLength": 4},
            {"buffer": 0, "byteOffset": 156, "byteLength": 24}
        ],
        "buffers": [buffer]
    })
}

fn gltf() -> Vec<(&'static str, Vec<u8>)> {
    use base64::Engine;
    let data = data();
    let uri = format!("data:application/octet-stream;base64,{}", base64::prelude::BASE64_STANDARD.encode(&data));
    let embedded = document(json!({"byteLength": data.len(), "uri": uri}));
    let mut text = document(json!({"byteLength": data.len()})).to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |n: usize| (n as u32).to_le_bytes();
    let (size, first, second) = (word(28 + text.len() + data.len()), word(text.len()), word(data.len()));
    let parts: [&[u8]; 9] = [b"glTF", &word(2), &size, &first, b"JSON", &text, &second, b"BIN\0", &data];
    let pretty = serde_json::to_vec_pretty(&embedded).expect("JSON");
    vec![("embedded.gltf", embedded.to_string().into_bytes()), ("pretty.gltf", pretty), ("all.glb", parts.concat())]
}
