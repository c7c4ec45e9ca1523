//! Binary MSH.

use crate::Case;
use crate::surface::{Surface, put};

pub const CASES: &[Case] = &[
    Case::new("MSH 2.2", "msh", |s| two(s, dense)),
    Case::new("MSH 2.2, shuffled tags", "msh", |s| two(s, shuffled)),
    Case::new("MSH 2.2, sparse tags", "msh", |s| two(s, |i| 1000 * (i as u64) % (1 << 30) + 7)),
    Case::new("MSH 4.1", "msh", |s| four(s, dense, false)),
    Case::new("MSH 4.1, quads", "msh", |s| four(s, dense, true)),
    Case::new("MSH 4.1, shuffled tags", "msh", |s| four(s, shuffled, false)),
    Case::new("MSH 4.1, sparse rising tags", "msh", |s| four(s, |i| 1000 * i as u64 + 7, false)),
    Case::new("MSH 4.1, sparse random tags", "msh", |s| four(s, random, false)),
    Case::new("MSH 4.1, sparse random, quads", "msh", |s| four(s, random, true)),
];

fn dense(i: usize) -> u64 {
    i as u64 + 1
}

/// The numbers up to 2^19, in no order.
fn shuffled(i: usize) -> u64 {
    (i as u64).wrapping_mul(0x9E37_79B9) % (1 << 19) + 1
}

/// Numbers of 62 bits, in no order.
fn random(i: usize) -> u64 {
    (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) % (1 << 62)
}

/// Version 2.2.
fn two(surface: &Surface, tag: fn(usize) -> u64) -> Vec<u8> {
    let mut bytes = b"$MeshFormat\n2.2 1 8\n".to_vec();
    put(&mut bytes, false, [1_i32]);
    bytes.extend(format!("\n$EndMeshFormat\n$Nodes\n{}\n", surface.points.len()).as_bytes());
    for (i, point) in surface.points.iter().enumerate() {
        put(&mut bytes, false, [tag(i) as i32]);
        put(&mut bytes, false, *point);
    }
    bytes.extend(format!("\n$EndNodes\n$Elements\n{}\n", surface.triangles.len()).as_bytes());
    put(&mut bytes, false, [2, surface.triangles.len() as i32, 2]);
    for (i, triangle) in surface.triangles.iter().enumerate() {
        put(&mut bytes, false, [i as i32 + 1, 1, 1]);
        put(&mut bytes, false, triangle.map(|c| tag(c as usize) as i32));
    }
    bytes.extend(b"\n$EndElements\n");
    bytes
}

/// Version 4.1.
fn four(surface: &Surface, tag: fn(usize) -> u64, quads: bool) -> Vec<u8> {
    let mut bytes = b"$MeshFormat\n4.1 1 8\n".to_vec();
    put(&mut bytes, false, [1_i32]);
    bytes.extend(b"\n$EndMeshFormat\n$Nodes\n");
    let nodes = surface.points.len();
    put(&mut bytes, false, [1, nodes as u64, 1, u64::MAX >> 1]);
    put(&mut bytes, false, [2_i32, 1, 0]);
    put(&mut bytes, false, [nodes as u64]);
    put(&mut bytes, false, (0..nodes).map(tag));
    put(&mut bytes, false, surface.points.iter().flatten().copied());
    bytes.extend(b"\n$EndNodes\n$Elements\n");
    let faces: Vec<&[u32]> = match quads {
        true => surface.quads.iter().map(|q| &q[..]).collect(),
        false => surface.triangles.iter().map(|t| &t[..]).collect(),
    };
    put(&mut bytes, false, [1, faces.len() as u64, 1, faces.len() as u64]);
    put(&mut bytes, false, [2_i32, 1, if quads { 3 } else { 2 }]);
    put(&mut bytes, false, [faces.len() as u64]);
    for (i, face) in faces.iter().enumerate() {
        put(&mut bytes, false, [i as u64 + 1]);
        put(&mut bytes, false, face.iter().map(|c| tag(*c as usize)));
    }
    bytes.extend(b"\n$EndElements\n");
    bytes
}
