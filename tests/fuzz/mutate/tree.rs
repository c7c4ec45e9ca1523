//! Mutations of documents in JSON, alone or in a GLB file.

use super::{Random, head, packed};
use serde_json::{Map, Value, json};

/// Changes the document of a file, or the data that come with it. The file stays what it is; if it is no document, nothing
/// is done.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random) -> bool {
    let changed = if bytes.starts_with(b"glTF") { container(bytes, random) } else { document(bytes, random) };
    changed.map(|new| *bytes = new).is_some()
}

fn container(bytes: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    let end = head::chunk_end(bytes, 12).checked_sub(8)?;
    let mut json = bytes.get(20..end)?.to_vec();
    let mut binary = bytes.get(end + 8..).unwrap_or_default().to_vec();
    if random.below(3) == 0 {
        packed::change(&mut binary, random);
    } else {
        json = document(&json, random)?;
    }
    json.resize(json.len().next_multiple_of(4), b' ');
    let size = 28 + json.len() + binary.len();
    let word = |n: usize| (n as u32).to_le_bytes();
    let (head, first, second) = (word(size), word(json.len()), word(binary.len()));
    let parts: [&[u8]; 8] = [&bytes[..8], &head, &first, b"JSON", &json, &second, b"BIN\0", &binary];
    Some(parts.concat())
}

fn document(json: &[u8], random: &mut Random) -> Option<Vec<u8>> {
    if !json.trim_ascii_start().starts_with(b"{") {
        return None;
    }
    let mut value: Value = serde_json::from_slice(json).ok()?;
    change(&mut value, random);
    serde_json::to_vec(&value).ok()
}

/// Changes one place of a tree: goes down from its root, and stops at random.
fn change(root: &mut Value, random: &mut Random) {
    let mut place = root;
    while random.below(8) > 0 && entries(place) > 0 {
        let i = random.below(entries(place));
        place = entry_at(place, i);
    }
    match place {
        Value::Array(all) => array(all, random),
        Value::Object(all) => object(all, random),
        leaf => *leaf = other(leaf, random),
    }
}

fn entries(value: &Value) -> usize {
    value.as_array().map(Vec::len).or(value.as_object().map(Map::len)).unwrap_or_default()
}

fn entry_at(value: &mut Value, i: usize) -> &mut Value {
    match value {
        Value::Array(all) => &mut all[i],
        Value::Object(all) => all.values_mut().nth(i).expect("it has so many"),
        _ => unreachable!("there is nothing in it"),
    }
}

/// Removes an entry, or repeats one, or adds one.
fn array(all: &mut Vec<Value>, random: &mut Random) {
    let i = random.below(all.len());
    match random.below(4) {
        0 if i < all.len() => drop(all.remove(i)),
        1 if i < all.len() => {
            let again = all[i].clone();
            (0..=random.below(20)).for_each(|_| all.push(again.clone()));
        }
        2 => all.push(json!(random.below(8))),
        _ => all.reverse(),
    }
}

/// Removes an entry, or takes one from under another name, or adds one that glTF knows.
fn object(all: &mut Map<String, Value>, random: &mut Random) {
    let names: Vec<String> = all.keys().cloned().collect();
    let [a, b] = [(); 2].map(|()| names.get(random.below(names.len())).cloned().unwrap_or_default());
    match random.below(4) {
        0 => drop(all.remove(&a)),
        1 => {
            let value = all.get(&a).cloned().unwrap_or_default();
            all.insert(b, value);
        }
        _ => {
            let (name, value) = entry(random);
            all.insert(name.to_owned(), value);
        }
    }
}

const EXTENSIONS: [&str; 2] = ["KHR_draco_mesh_compression", "KHR_mesh_quantization"];

const ADDRESSES: [&str; 6] = ["/etc/passwd", "file:///etc/passwd", "../a.bin", "http://a/b", "a.bin", "data:,"];

const WORDS: [&str; 9] = ["SCALAR", "VEC2", "VEC3", "VEC4", "MAT4", "2.1", "1.0", "", "POSITION"];

/// Something that a document may say.
fn entry(random: &mut Random) -> (&'static str, Value) {
    let n = random.below(8);
    match random.below(14) {
        0 => ("mode", json!(n)),
        1 => ("children", json!([n, random.below(8)])),
        2 => ("byteOffset", json!(n)),
        3 => ("byteStride", json!(4 * n)),
        4 => ("matrix", json!([n, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1])),
        5 => ("scale", json!([1, n, -1])),
        6 => ("rotation", json!([0, 0, n, 1])),
        7 => ("normalized", json!(true)),
        8 => ("indices", json!(n)),
        9 => ("mesh", json!(n)),
        10 => ("count", json!(n)),
        11 => ("extensionsRequired", json!([EXTENSIONS[n % 2]])),
        12 => ("uri", json!(ADDRESSES[n % 6])),
        _ => ("bufferView", json!(n)),
    }
}

/// Another value in the place of one, mostly of the same type.
fn other(value: &Value, random: &mut Random) -> Value {
    match value {
        Value::Number(_) => number(random),
        // Data in a document are its longest texts.
        Value::String(text) if text.starts_with("data:") && random.below(8) > 0 => {
            let mut bytes = text.clone().into_bytes();
            packed::mutate(&mut bytes, random);
            String::from_utf8(bytes).map_or(Value::Null, Value::String)
        }
        Value::String(_) => json!(WORDS[random.below(9)]),
        Value::Bool(b) => json!(!b),
        _ => json!([number(random)]),
    }
}

fn number(random: &mut Random) -> Value {
    match random.below(12) {
        0 => json!(-1),
        1 => json!(u32::MAX),
        2 => json!(u64::MAX),
        3 => json!(1e300),
        4 => json!(0.5),
        5 => json!(5120 + random.below(7)),
        6 => json!(random.below(1000)),
        _ => json!(random.below(12)),
    }
}
