//! `sizes.pos`: sizes on cubes around a surface, and on its triangles, as views of Gmsh's post-processing (version 1.4 of its
//! list-based format, binary, little endian), which fields of `remesh.geo` read.

use planish_core::measure::sizes::SizedCube;
use planish_core::vec3::Vec3;

/// Kinds of elements in a view, in the order of the format; each may have scalars, vectors and tensors.
const KINDS: usize = 15;

/// Of these, triangles with scalars are the third: after points and lines.
const TRIANGLES: usize = 2;

/// And hexahedra the sixth: after quadrangles and tetrahedra.
const HEXAHEDRA: usize = 5;

/// The corners of a cube, by their bits, in the order of a hexahedron: around its bottom, and around its top.
const AROUND: [usize; 8] = [0, 1, 3, 2, 4, 5, 7, 6];

/// A triangle with the sizes at its corners, in between which they are linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizedTriangle {
    /// Its corners.
    pub corners: [Vec3; 3],
    /// The sizes there.
    pub sizes: [f64; 3],
}

/// The bytes of a view of these cubes, with all lengths multiplied by `factor`.
pub fn on_cubes(cubes: &[SizedCube], factor: f64) -> Vec<u8> {
    let elements = cubes.iter().map(|cube| AROUND.map(|corner| (cube.corner(corner), cube.sizes[corner])));
    view("sizes", HEXAHEDRA, elements, factor)
}

/// The bytes of a view of these triangles, likewise.
pub fn on_triangles(triangles: &[SizedTriangle], factor: f64) -> Vec<u8> {
    let elements = triangles.iter().map(|of| [0, 1, 2].map(|k| (of.corners[k], of.sizes[k])));
    view("array", TRIANGLES, elements, factor)
}

/// A view with elements of one kind, by their corners and the sizes there.
fn view<const N: usize>(
    name: &str,
    kind: usize,
    elements: impl ExactSizeIterator<Item = [(Vec3, f64); N]>,
    factor: f64,
) -> Vec<u8> {
    let mut head = format!("$PostFormat\n1.4 1 8\n$EndPostFormat\n$View\n{name} 1\n");
    for other in 0..KINDS {
        let scalars = if other == kind { elements.len() } else { 0 };
        head.push_str(&format!("{scalars} 0 0\n"));
    }
    // No texts in the plane, nor in space.
    head.push_str("0 0 0 0\n");
    let mut bytes = head.into_bytes();
    bytes.reserve(32 * N * elements.len() + 32);
    // Readers compare this with their own 1 to know the order of bytes.
    bytes.extend(1_i32.to_le_bytes());
    // The time of the only step.
    bytes.extend(0.0_f64.to_le_bytes());
    for corners in elements {
        for axis in 0..3 {
            corners.iter().for_each(|(x, _)| bytes.extend((x[axis] * factor).to_le_bytes()));
        }
        corners.iter().for_each(|(_, size)| bytes.extend((size * factor).to_le_bytes()));
    }
    bytes.extend(b"\n$EndView\n");
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numbers of the one element of a view of this kind.
    fn numbers(bytes: &[u8], kind: usize, count: usize) -> Vec<f64> {
        let text = String::from_utf8_lossy(bytes);
        let lines: Vec<&str> = text.lines().skip(5).take(KINDS).collect();
        assert!((0..KINDS).all(|k| lines[k] == if k == kind { "1 0 0" } else { "0 0 0" }), "{lines:?}");
        assert!(text.ends_with("\n$EndView\n"));
        let data = &bytes[bytes.len() - 10 - 8 * count..bytes.len() - 10];
        data.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect()
    }

    #[test]
    fn a_triangle_is_its_coordinates_axis_by_axis_and_its_sizes() {
        let corners = [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]];
        let bytes = on_triangles(&[SizedTriangle { corners, sizes: [0.5, 1.0, 1.5] }], 2.0);
        let expected = [0.0, 6.0, 12.0, 2.0, 8.0, 14.0, 4.0, 10.0, 16.0, 1.0, 2.0, 3.0];
        assert_eq!(numbers(&bytes, 2, 12), expected);
    }

    #[test]
    fn a_cube_goes_around_its_bottom_and_its_top() {
        let sizes = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];
        let bytes = on_cubes(&[SizedCube { low: [10.0, 20.0, 30.0], side: 1.0, sizes }], 1.0);
        let x = [10.0, 11.0, 11.0, 10.0];
        let y = [20.0, 20.0, 21.0, 21.0];
        let expected = [x, x, y, y, [30.0; 4], [31.0; 4], [0.0, 1.0, 3.0, 2.0], [4.0, 5.0, 7.0, 6.0]].concat();
        assert_eq!(numbers(&bytes, 5, 32), expected);
    }
}
