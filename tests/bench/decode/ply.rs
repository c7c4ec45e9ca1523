//! Binary PLY.

use crate::Case;
use crate::surface::{Number, Surface, put};

pub const CASES: &[Case] = &[
    Case::new("PLY little-endian", "ply", |s| Layout::default().encode(s)),
    Case::new("PLY big-endian", "ply", |s| Layout { big: true, ..Layout::default() }.encode(s)),
    Case::new("PLY doubles", "ply", |s| Layout { double: true, ..Layout::default() }.encode(s)),
    Case::new("PLY doubles big-endian", "ply", |s| Layout { double: true, big: true, ..Layout::default() }.encode(s)),
    Case::new("PLY normals, colours", "ply", |s| Layout { extra: true, ..Layout::default() }.encode(s)),
    Case::new("PLY quads", "ply", |s| Layout { quads: true, ..Layout::default() }.encode(s)),
    Case::new("PLY quads big-endian", "ply", |s| Layout { quads: true, big: true, ..Layout::default() }.encode(s)),
    Case::new("PLY quads, normals, colours", "ply", |s| {
        Layout { quads: true, extra: true, ..Layout::default() }.encode(s)
    }),
    Case::new("PLY quads, triangles by turns", "ply", |s| {
        Layout { quads: true, mixed: true, ..Layout::default() }.encode(s)
    }),
    Case::new("PLY list int int", "ply", |s| Layout { long_counts: true, ..Layout::default() }.encode(s)),
    Case::new("PLY list int int, quads", "ply", |s| {
        Layout { long_counts: true, quads: true, ..Layout::default() }.encode(s)
    }),
];

/// How a file is laid out.
#[derive(Clone, Copy, Default)]
struct Layout {
    big: bool,
    double: bool,
    /// Normals and colours of points, flags of faces.
    extra: bool,
    quads: bool,
    /// Every other quad as two triangles.
    mixed: bool,
    /// Numbers of corners of four bytes.
    long_counts: bool,
}

impl Layout {
    fn encode(self, surface: &Surface) -> Vec<u8> {
        let faces = self.faces(surface);
        let mut bytes = self.header(surface.points.len(), faces.len()).into_bytes();
        surface.points.iter().for_each(|p| self.point(&mut bytes, *p));
        faces.iter().for_each(|f| self.face(&mut bytes, f));
        bytes
    }

    fn faces(self, surface: &Surface) -> Vec<&[u32]> {
        match (self.quads, self.mixed) {
            (false, _) => surface.triangles.iter().map(|t| &t[..]).collect(),
            (true, false) => surface.quads.iter().map(|q| &q[..]).collect(),
            (true, true) => {
                let pairs = surface.triangles.chunks_exact(2).zip(&surface.quads).enumerate();
                pairs.flat_map(|(i, (t, q))| if i % 2 == 0 { vec![&t[0][..], &t[1]] } else { vec![&q[..]] }).collect()
            }
        }
    }

    fn header(self, points: usize, faces: usize) -> String {
        let order = if self.big { "big" } else { "little" };
        let real = if self.double { "double" } else { "float" };
        let count = if self.long_counts { "int" } else { "uchar" };
        let mut header = format!("ply\nformat binary_{order}_endian 1.0\nelement vertex {points}\n");
        ["x", "y", "z"].iter().for_each(|c| header += &format!("property {real} {c}\n"));
        if self.extra {
            ["nx", "ny", "nz"].iter().for_each(|c| header += &format!("property float {c}\n"));
            ["red", "green", "blue"].iter().for_each(|c| header += &format!("property uchar {c}\n"));
        }
        header += &format!("element face {faces}\nproperty list {count} int vertex_indices\n");
        header + if self.extra { "property int flags\nend_header\n" } else { "end_header\n" }
    }

    fn point(self, bytes: &mut Vec<u8>, point: [f64; 3]) {
        if self.double {
            put(bytes, self.big, point);
        } else {
            put(bytes, self.big, point.map(|c| c as f32));
        }
        if self.extra {
            put(bytes, self.big, [0.0_f32, 0.0, 1.0]);
            bytes.extend([200, 100, 50]);
        }
    }

    fn face(self, bytes: &mut Vec<u8>, corners: &[u32]) {
        if self.long_counts {
            (corners.len() as i32).put(bytes, self.big);
        } else {
            bytes.push(corners.len() as u8);
        }
        put(bytes, self.big, corners.iter().map(|c| *c as i32));
        if self.extra {
            0_i32.put(bytes, self.big);
        }
    }
}
