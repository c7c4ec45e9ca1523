use super::super::{Format, Limits, SiblingFiles, read_alone};
use super::*;
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use planish_core::mesh::TriangleSoup;
use serde_json::{Value, json};
use std::cell::RefCell;

/// A unit square of four points, and indices of two triangles in U16 behind them.
fn data() -> Vec<u8> {
    let points: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let mut bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([0_u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes))
}

/// The square as a document with its data inside.
fn square() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"name": "square", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}
        ],
        "bufferViews": [
            {"buffer": 0, "byteLength": 48},
            {"buffer": 0, "byteOffset": 48, "byteLength": 12}
        ],
        "buffers": [{"byteLength": 60, "uri": data_uri(&data())}]
    })
}

/// The square, changed at a path as `/nodes/0/scale`.
fn changed(changes: &[(&str, Value)]) -> Value {
    let mut document = square();
    for (path, value) in changes {
        let (above, key) = path.rsplit_once('/').expect("a path");
        let object = document.pointer_mut(above).unwrap_or_else(|| panic!("{above}"));
        match object {
            Value::Array(all) if all.len() == key.parse::<usize>().expect("a number") => all.push(value.clone()),
            Value::Array(all) => all[key.parse::<usize>().expect("a number")] = value.clone(),
            other => other[key] = value.clone(),
        }
    }
    document
}

fn read(document: &Value) -> Result<Content, ReadError> {
    read_alone(Format::Gltf, document.to_string().as_bytes())
}

fn soup(document: &Value) -> TriangleSoup {
    read(document).unwrap_or_else(|e| panic!("{e}: {document}")).soup
}

fn error(document: &Value) -> GltfError {
    match read(document) {
        Err(ReadError::Gltf(error)) => error,
        other => panic!("{other:?}: {document}"),
    }
}

fn glb(document: &Value, binary: &[u8]) -> Vec<u8> {
    let mut json = document.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend(((12 + 8 + json.len() + 8 + binary.len()) as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json[..]), (b"BIN\0", binary)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

fn container() -> Vec<u8> {
    glb(&changed(&[("/buffers/0", json!({"byteLength": 60}))]), &data())
}

#[test]
fn documents_and_containers_hold_the_same() {
    let content = read(&square()).expect("a square");
    assert_eq!(content.soup.triangles(), [[0, 1, 2], [0, 2, 3]]);
    let Notes { format, units, names, .. } = content.notes;
    assert_eq!((&format[..], units.as_deref(), &names[..]), ("glTF 2.0, JSON", Some("m"), &["square".to_owned()][..]));
    let packed = read_alone(Format::Gltf, &container()).expect("a container");
    assert_eq!(packed.soup, content.soup);
    assert_eq!(packed.notes.format, "glTF 2.0, binary container");
}

#[test]
fn lists_strips_fans_and_unindexed_primitives_turn_the_same_way() {
    let indices = |mode: u32, indices: &[u8]| {
        let mut bytes = data();
        bytes.extend(indices);
        changed(&[
            ("/meshes/0/primitives/0/mode", mode.into()),
            ("/buffers/0", json!({"byteLength": bytes.len(), "uri": data_uri(&bytes)})),
            ("/bufferViews/1", json!({"buffer": 0, "byteOffset": 60, "byteLength": indices.len()})),
            ("/accessors/1", json!({"bufferView": 1, "componentType": 5121, "count": indices.len(), "type": "SCALAR"})),
        ])
    };
    let normal = |document: &Value| {
        let soup = soup(document);
        let area = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| soup.points()[i as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        (soup.triangles().len(), soup.triangles().iter().all(|t| area(t) > 0.5))
    };
    assert_eq!(normal(&indices(4, &[0, 1, 2, 0, 2, 3])), (2, true), "list");
    assert_eq!(normal(&indices(5, &[0, 1, 3, 2])), (2, true), "strip");
    assert_eq!(normal(&indices(6, &[0, 1, 2, 3])), (2, true), "fan");
    let mut plain = changed(&[("/meshes/0/primitives/0", json!({"attributes": {"POSITION": 0}}))]);
    plain["accessors"][0]["count"] = 3.into();
    assert_eq!(normal(&plain), (1, true), "without indices");
    let lines = json!([{"attributes": {"POSITION": 0}, "mode": 1}, {"attributes": {"POSITION": 0}, "indices": 1}]);
    let content = read(&changed(&[("/meshes/0/primitives", lines)])).expect("triangles beside lines");
    assert_eq!(content.notes.skipped["lines primitive"], 1);
}

#[test]
fn instances_stand_where_their_nodes_are_and_mirrors_keep_the_outside_out() {
    let nodes = json!([
        {"children": [1, 2], "translation": [10, 0, 0], "rotation": [0, 0, 0.707_106_77, 0.707_106_77]},
        {"mesh": 0, "scale": [2, 1, 1]},
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]}
    ]);
    let soup = soup(&changed(&[("/nodes", nodes)]));
    let close = |p: [f64; 3], q: [f64; 3]| (0..3).all(|k| (p[k] - q[k]).abs() < 1e-6);
    // (1, 0, 0) scaled to (2, 0, 0), turned by 90 degrees to (0, 2, 0), moved to (10, 2, 0).
    assert!(close(soup.points()[1], [10.0, 2.0, 0.0]), "{:?}", soup.points()[1]);
    assert!(close(soup.points()[5], [10.0, -1.0, 5.0]), "{:?}", soup.points()[5]);
    assert_eq!(soup.triangles(), [[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]]);
}

#[test]
fn sparse_and_quantised_positions_are_read() {
    let mut bytes = data();
    bytes.extend([2_u8, 0, 0, 0]);
    bytes.extend([7.0_f32, 8.0, 9.0].iter().flat_map(|x| x.to_le_bytes()));
    let sparse = json!({"count": 1, "indices": {"bufferView": 2, "componentType": 5121}, "values": {"bufferView": 3}});
    let mut document = changed(&[
        ("/buffers/0", json!({"byteLength": bytes.len(), "uri": data_uri(&bytes)})),
        ("/bufferViews/2", json!({"buffer": 0, "byteOffset": 60, "byteLength": 1})),
        ("/bufferViews/3", json!({"buffer": 0, "byteOffset": 64, "byteLength": 12})),
        ("/accessors/0/sparse", sparse),
    ]);
    assert_eq!(soup(&document).points()[1..3], [[1.0, 0.0, 0.0], [7.0, 8.0, 9.0]]);
    document["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
    assert_eq!(soup(&document).points()[1..3], [[0.0; 3], [7.0, 8.0, 9.0]], "zeros without a view");
    let quantised: Vec<u8> = [[0_i16, 0, 0], [32767, 0, 0], [32767, 32767, 0], [0, 32767, 0]]
        .iter()
        .flat_map(|p| [p[0], p[1], p[2], 0])
        .flat_map(i16::to_le_bytes)
        .chain(data()[48..].to_vec())
        .collect();
    let document = changed(&[
        ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
        ("/buffers/0", json!({"byteLength": quantised.len(), "uri": data_uri(&quantised)})),
        ("/bufferViews/0", json!({"buffer": 0, "byteLength": 32, "byteStride": 8})),
        ("/bufferViews/1", json!({"buffer": 0, "byteOffset": 32, "byteLength": 12})),
        (
            "/accessors/0",
            json!({"bufferView": 0, "componentType": 5122, "normalized": true, "count": 4, "type": "VEC3"}),
        ),
    ]);
    assert_eq!(soup(&document).points()[2], [1.0, 1.0, 0.0]);
}

/// Records what it is asked for.
#[derive(Default)]
struct Recorder(RefCell<Vec<String>>);

impl SiblingFiles for Recorder {
    fn read(&self, name: &str, _most: u64) -> Result<Vec<u8>, String> {
        self.0.borrow_mut().push(name.to_owned());
        Ok(data())
    }
}

#[test]
fn nothing_is_asked_for_but_plain_names() {
    let with_uri = |uri: &str| changed(&[("/buffers/0/uri", uri.into())]).to_string();
    let foreign = [
        "/etc/passwd",
        "file:///etc/passwd",
        "../secret.bin",
        "..%2fsecret.bin",
        "%2e%2e/secret.bin",
        "a/../b.bin",
        "sub/a.bin",
        "http://example.org/a.bin",
        "https://example.org/a.bin",
        "ftp:a.bin",
        "C:\\a.bin",
        "..\\a.bin",
        "//server/a.bin",
        ".hidden.bin",
        ".",
        "..",
        "",
        "%00.bin",
        "a%0a.bin",
        "%zz.bin",
        "%",
        "~/../a",
        "a.bin%00",
        "././a.bin",
        "./../a.bin",
        "./.hidden",
        "./",
    ];
    let limits = Limits::default();
    for uri in foreign {
        let asked = Recorder::default();
        let document = with_uri(uri);
        let source = Source { beside: &asked, ..Source::alone(document.as_bytes(), &limits) };
        let refused = super::super::read(Format::Gltf, &source).expect_err(uri);
        let ReadError::Gltf(GltfError::Uri { buffer: 0, .. }) = &refused else { panic!("{uri}: {refused}") };
        let reason = refused.reason();
        assert_eq!((reason.code, reason.location.as_deref()), (Code::ForeignFile, Some("buffers[0]")));
        assert!(asked.0.borrow().is_empty(), "{uri}");
    }
    let asked = Recorder::default();
    let plain = [
        ("a.bin", "a.bin"),
        ("my%20file.bin", "my file.bin"),
        ("caf\u{e9}.bin", "caf\u{e9}.bin"),
        ("./a%20b.bin", "a b.bin"),
    ];
    for (uri, name) in plain {
        let document = with_uri(uri);
        let source = Source { beside: &asked, ..Source::alone(document.as_bytes(), &limits) };
        super::super::read(Format::Gltf, &source).expect("beside");
        assert_eq!(asked.0.borrow().last().map(String::as_str), Some(name));
    }
    let document = with_uri("a.bin");
    let source = Source::alone(document.as_bytes(), &limits);
    let missing = super::super::read(Format::Gltf, &source).expect_err("not there").reason();
    assert_eq!(missing.code, Code::MissingFile);
}

#[test]
fn what_is_broken_is_named() {
    let cases = [
        ("/accessors/0/count", json!(5), "accessors[0]"),
        ("/accessors/0/count", json!(u64::MAX), "accessors[0]"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "accessors[0]"),
        ("/accessors/0/type", json!("VEC2"), "accessors[0]"),
        ("/accessors/0/componentType", json!(5125), "accessors[0]"),
        ("/accessors/1/componentType", json!(5126), "accessors[1]"),
        ("/bufferViews/1/byteOffset", json!(12), "meshes[0].primitives[0]"),
        ("/accessors/0/bufferView", json!(9), "bufferViews[9]"),
        ("/bufferViews/0/byteLength", json!(u64::MAX), "bufferViews[0]"),
        ("/bufferViews/0/buffer", json!(4), "bufferViews[0]"),
        ("/bufferViews/0/byteStride", json!(4), "accessors[0]"),
        ("/buffers/0/byteLength", json!(61), "buffers[0]"),
        ("/meshes/0/primitives/0/mode", json!(9), "meshes[0].primitives[0]"),
        ("/meshes/0/primitives/0/indices", json!(7), "accessors[7]"),
        ("/nodes/0/mesh", json!(3), "meshes[3]"),
        ("/nodes/0/children", json!([0]), "nodes[0]"),
        ("/nodes/0/children", json!([8]), "nodes[8]"),
        ("/scene", json!(2), "scenes[2]"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "extensionsRequired"),
        ("/extensionsRequired", json!(["EXT_meshopt_compression"]), "extensionsRequired"),
        ("/asset/version", json!("1.0"), "asset.version"),
    ];
    for (path, value, location) in cases {
        let found = error(&changed(&[(path, value)]));
        assert_eq!(found.location().as_deref(), Some(location), "{path}: {found}");
    }
    let mut fallback = changed(&[("/extensionsUsed", json!(["KHR_draco_mesh_compression"]))]);
    fallback["accessors"][0].as_object_mut().expect("an object").remove("bufferView");
    assert!(error(&fallback).to_string().contains("KHR_draco_mesh_compression"));
    assert!(matches!(
        read_alone(Format::Gltf, b"{\n\"asset\": 1}"),
        Err(ReadError::Gltf(GltfError::Json { line: 2, .. }))
    ));
}

#[test]
fn what_no_surface_needs_does_no_harm() {
    let rows = [
        ("/materials", json!([{"pbrMetallicRoughness": {"baseColorFactor": [1, 1, 1]}}, {"normalTexture": {}}])),
        ("/animations", json!([{"channels": [{"sampler": 0, "target": {"path": "pointer"}}], "samplers": []}])),
        ("/scenes/1", json!({"name": "nothing yet"})),
        ("/extras", json!([1, "a"])),
        ("/nodes/0/extras", json!(3)),
        ("/meshes/0/primitives/0/extras", json!("text")),
        ("/meshes/0/primitives/1", json!({"attributes": {"NORMAL": 0}})),
        ("/extensionsRequired", json!(["KHR_animation_pointer", "KHR_texture_basisu", "KHR_lights_punctual"])),
        ("/buffers/0/uri", format!("data:;BASE64,{}", BASE64_STANDARD.encode(data())).into()),
    ];
    let plain = soup(&square());
    for (path, value) in rows {
        assert_eq!(soup(&changed(&[(path, value)])), plain, "{path}");
    }
    let long = [data(), vec![0]].concat();
    let unpadded = data_uri(&long).trim_end_matches('=').to_owned();
    assert_eq!(soup(&changed(&[("/buffers/0/uri", unpadded.into())])), plain);
}

#[test]
fn primitives_without_positions_are_counted() {
    let content =
        read(&changed(&[("/meshes/0/primitives/1", json!({"attributes": {"NORMAL": 0}}))])).expect("a square");
    assert_eq!(content.notes.skipped["primitive without positions"], 1);
    assert!(matches!(read(&changed(&[("/meshes/0/primitives/0/attributes", json!({}))])), Err(ReadError::Soup { .. })));
}

#[test]
fn containers_may_be_filled_up_with_zeros() {
    let mut document = changed(&[("/buffers/0", json!({"byteLength": 60}))]);
    // A length that leaves room.
    document["asset"]["generator"] = "".into();
    while document.to_string().len() % 4 != 1 {
        document["asset"]["generator"] = format!("{}.", document["asset"]["generator"].as_str().expect("text")).into();
    }
    let mut bytes = glb(&document, &data());
    let end = 20 + document.to_string().len();
    bytes[end..end + 3].fill(0);
    assert_eq!(read_alone(Format::Gltf, &bytes).expect("a container").soup, soup(&square()));
}

#[test]
fn version_one_is_refused_by_name() {
    let document = json!({"asset": {"version": "1.0"}, "meshes": {"a": {}}, "accessors": {}, "nodes": {}});
    assert_eq!(error(&document), GltfError::Version("1.0".to_owned()));
}

#[test]
fn nodes_are_nested_so_deep_only() {
    let chain = |depth: usize| {
        let mut nodes: Vec<Value> = (1..depth).map(|below| json!({"children": [below]})).collect();
        nodes.push(json!({"mesh": 0}));
        changed(&[("/nodes", nodes.into())])
    };
    let most = Limits::default().depth;
    assert_eq!(soup(&chain(most)), soup(&square()));
    let found = error(&chain(most + 1));
    assert!(matches!(&found, GltfError::TooMuch { location, .. } if *location == format!("nodes[{most}]")), "{found}");
}

/// Two hundred nodes show a mesh each, the mesh of all points: far more than the file has.
#[test]
fn instances_do_not_take_memory_out_of_proportion() {
    let many: Vec<Value> = (0..200).map(|_| json!({"mesh": 0})).collect();
    let list: Vec<u32> = (0..200).collect();
    let document = changed(&[("/nodes", many.into()), ("/scenes/0/nodes", list.into())]).to_string();
    let read = |expansion| {
        let limits = Limits { elements: 500, expansion, ..Limits::default() };
        super::super::read(Format::Gltf, &Source::alone(document.as_bytes(), &limits))
    };
    assert!(matches!(read(100), Err(ReadError::Gltf(GltfError::TooMuch { .. }))));
    let zeros = changed(&[(
        "/accessors/0",
        json!({"componentType": 5126, "count": 200_000_000, "type": "VEC3",
        "sparse": {"count": 0, "indices": {"bufferView": 1, "componentType": 5123}, "values": {"bufferView": 0}}}),
    )]);
    assert!(matches!(error(&zeros), GltfError::TooMuch { .. }));
}

#[test]
fn a_file_that_is_cut_off_anywhere_is_an_error() {
    let whole = container();
    for end in 1..whole.len() {
        assert!(read_alone(Format::Gltf, &whole[..end]).is_err(), "cut at {end}");
    }
    let text = square().to_string();
    for end in 1..text.len() {
        assert!(read_alone(Format::Gltf, &text.as_bytes()[..end]).is_err(), "cut at {end}");
    }
    let deep = format!("{}{}", "[".repeat(200_000), "]".repeat(200_000));
    assert!(read_alone(Format::Gltf, deep.as_bytes()).is_err());
}

/// The names of all triangles.
fn names(document: &Value, labels: &LabelSource) -> Vec<String> {
    let (bytes, limits) = (document.to_string(), Limits::default());
    let source = Source { labels, ..Source::alone(bytes.as_bytes(), &limits) };
    let content = super::super::read(Format::Gltf, &source).expect("a square");
    content.soup.labels().iter().map(|label| content.notes.labels[*label as usize].name.clone()).collect()
}

#[test]
fn meshes_name_triangles_or_materials_do() {
    assert_eq!(names(&square(), &LabelSource::Usual), ["square"; 2]);
    let mut two = changed(&[("/nodes/1", json!({"mesh": 1})), ("/scenes/0/nodes", json!([0, 1]))]);
    let primitive = two["meshes"][0]["primitives"][0].clone();
    two["meshes"] = json!([two["meshes"][0], {"primitives": [primitive]}]);
    two["meshes"][1]["primitives"][0]["material"] = json!(0);
    two["materials"] = json!([{"name": "red paint"}]);
    assert_eq!(names(&two, &LabelSource::Usual), ["square", "square", "mesh_1", "mesh_1"]);
    let material = LabelSource::Array("material".to_owned());
    assert_eq!(names(&two, &material), ["unnamed", "unnamed", "red paint", "red paint"]);
    assert_eq!(names(&two, &LabelSource::Ignored), [""; 0]);
    // A single mesh without a name is no part of anything.
    let nameless = changed(&[("/meshes/0/name", Value::Null)]);
    assert_eq!(names(&nameless, &LabelSource::Usual), [""; 0]);
}
