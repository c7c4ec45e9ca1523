//! Binary STL.

use crate::Case;
use crate::surface::{Surface, put};

pub const CASES: &[Case] = &[Case::new("STL", "stl", encode).with_points(|s| 3 * s.triangles.len())];

fn encode(surface: &Surface) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    put(&mut bytes, false, [surface.triangles.len() as u32]);
    for triangle in &surface.triangles {
        put(&mut bytes, false, [0.0_f32; 3]);
        for corner in triangle {
            put(&mut bytes, false, surface.points[*corner as usize].map(|c| c as f32));
        }
        bytes.extend([0; 2]);
    }
    bytes
}
