//! `sizes.pos`: sizes on the triangles of a surface, as a view of Gmsh's post-processing (version 1.4 of its list-based format,
//! binary, little endian), which a field of `remesh.geo` reads.

use planish_core::measure::sizes::SizedTriangle;

/// Kinds of elements in a view, in the order of the format; each may have scalars, vectors and tensors.
const KINDS: usize = 15;

/// Of these, triangles with scalars are the third: after points and lines.
const TRIANGLES: usize = 2;

/// The bytes of a view of these triangles, with all lengths multiplied by `factor`.
pub fn sizes(triangles: &[SizedTriangle], factor: f64) -> Vec<u8> {
    let mut head = String::from("$PostFormat\n1.4 1 8\n$EndPostFormat\n$View\nsizes 1\n");
    for kind in 0..KINDS {
        let scalars = if kind == TRIANGLES { triangles.len() } else { 0 };
        head.push_str(&format!("{scalars} 0 0\n"));
    }
    // No texts in the plane, nor in space.
    head.push_str("0 0 0 0\n");
    let mut bytes = head.into_bytes();
    bytes.reserve(96 * triangles.len() + 32);
    // Readers compare this with their own 1 to know the order of bytes.
    bytes.extend(1_i32.to_le_bytes());
    // The time of the only step.
    bytes.extend(0.0_f64.to_le_bytes());
    for SizedTriangle { corners, sizes } in triangles {
        let along = |axis: usize| corners.map(|corner| corner[axis]);
        let numbers = [along(0), along(1), along(2), *sizes].into_iter().flatten();
        numbers.for_each(|number| bytes.extend((number * factor).to_le_bytes()));
    }
    bytes.extend(b"\n$EndView\n");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_its_coordinates_axis_by_axis_and_its_sizes() {
        let corners = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]];
        let bytes = sizes(&[SizedTriangle { corners, sizes: [0.5, 1.0, 1.5] }], 2.0);
        let text = String::from_utf8_lossy(&bytes);
        assert!(text.contains("sizes 1\n0 0 0\n0 0 0\n1 0 0\n0 0 0\n") && text.ends_with("\n$EndView\n"));
        let numbers = &bytes[bytes.len() - 10 - 96..bytes.len() - 10];
        let numbers: Vec<f64> = numbers.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
        assert_eq!(numbers, [0.0, 6.0, 12.0, 2.0, 8.0, 14.0, 4.0, 10.0, 16.0, 1.0, 2.0, 3.0]);
    }
}
