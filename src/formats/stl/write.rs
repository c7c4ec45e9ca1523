//! Binary STL.

use crate::formats::made::MadeMesh;
use planish_core::vec3::{cross, norm, sub};

/// The bytes of the file: single precision, and neither parts nor nodes in the middle of sides, as the format has none.
pub fn made(mesh: &MadeMesh) -> Vec<u8> {
    let mut bytes = b"binary STL, written by planish".to_vec();
    bytes.resize(80, b' ');
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|n| mesh.points[n as usize]);
        let normal = cross(sub(b, a), sub(c, a));
        let length = norm(normal);
        let normal = if length > 0.0 { normal.map(|x| x / length) } else { [0.0; 3] };
        for x in [normal, a, b, c].into_iter().flatten() {
            bytes.extend((x as f32).to_le_bytes());
        }
        bytes.extend([0; 2]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::made::tests::two;
    use crate::formats::{Format, read_alone};

    #[test]
    fn it_is_read_as_it_was_written() {
        let soup = read_alone(Format::Stl, &made(&two())).expect("read").soup;
        assert_eq!((soup.triangles().len(), soup.points()[0]), (2, [0.0; 3]));
    }
}
