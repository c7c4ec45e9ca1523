//! The surface that all files hold.

use std::f64::consts::TAU;

/// A torus with waves: quads, and the two triangles of each.
pub struct Surface {
    pub points: Vec<[f64; 3]>,
    pub quads: Vec<[u32; 4]>,
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// The surface of `n` by `n` quads.
    pub fn new(n: u32) -> Self {
        let all = || (0..n).flat_map(move |i| (0..n).map(move |j| [i, j]));
        let number = |i: u32, j: u32| i % n * n + j % n;
        let quad = |[i, j]: [u32; 2]| [number(i, j), number(i + 1, j), number(i + 1, j + 1), number(i, j + 1)];
        let quads: Vec<[u32; 4]> = all().map(quad).collect();
        let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        let points = all().map(|place| point(place.map(|k| f64::from(k) / f64::from(n) * TAU))).collect();
        Self { points, quads, triangles }
    }
}

fn point([u, v]: [f64; 2]) -> [f64; 3] {
    let radius = 1.0 + 0.1 * (5.0 * u).sin() * (3.0 * v).cos();
    let out = 3.0 + radius * v.cos();
    [out * u.cos(), out * u.sin(), radius * v.sin()]
}

/// Numbers as they are stored.
pub trait Number: Copy {
    fn put(self, bytes: &mut Vec<u8>, big: bool);
}

macro_rules! numbers {
    ($($type:ty),*) => {
        $(impl Number for $type {
            fn put(self, bytes: &mut Vec<u8>, big: bool) {
                bytes.extend(if big { self.to_be_bytes() } else { self.to_le_bytes() });
            }
        })*
    };
}

numbers!(u8, u16, i32, u32, i64, u64, f32, f64);

/// Numbers, one after the other.
pub fn put<T: Number>(bytes: &mut Vec<u8>, big: bool, numbers: impl IntoIterator<Item = T>) {
    numbers.into_iter().for_each(|n| n.put(bytes, big));
}
