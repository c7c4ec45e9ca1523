//! Writes meshes for Mmg: `.mesh` and `.sol`, as text.
//!
//! Nothing is written of second order: Mmg reads `TrianglesP2` as `Triangles`, without a word.

use std::fmt::Write;

/// A mesh in two or three dimensions. Lists of edges and vertices count from 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeditMesh<const N: usize> {
    /// The vertices, each with its reference.
    pub vertices: Vec<([f64; N], u32)>,
    /// The triangles, each with its reference.
    pub triangles: Vec<([u32; 3], i32)>,
    /// Edges, each with its reference.
    pub edges: Vec<([u32; 2], u32)>,
    /// Edges at which the surface is not smooth.
    pub ridges: Vec<u32>,
    /// Vertices at which it is not.
    pub corners: Vec<u32>,
    /// Edges that must stay.
    pub required_edges: Vec<u32>,
    /// Vertices that must.
    pub required_vertices: Vec<u32>,
}

impl<const N: usize> MeditMesh<N> {
    /// The bytes of the file. Numbers are the shortest that are read as what they are.
    pub fn into_bytes(self) -> Vec<u8> {
        let mut out = format!("MeshVersionFormatted 2\n\nDimension {N}\n");
        section(&mut out, "Vertices", &self.vertices, |out, (x, reference)| {
            numbers(out, x);
            let _ = writeln!(out, "{reference}");
        });
        section(&mut out, "Edges", &self.edges, |out, ([a, b], reference)| {
            let _ = writeln!(out, "{} {} {reference}", a + 1, b + 1);
        });
        section(&mut out, "Triangles", &self.triangles, |out, ([a, b, c], reference)| {
            let _ = writeln!(out, "{} {} {} {reference}", a + 1, b + 1, c + 1);
        });
        let lists = [
            ("Ridges", &self.ridges),
            ("Corners", &self.corners),
            ("RequiredEdges", &self.required_edges),
            ("RequiredVertices", &self.required_vertices),
        ];
        for (keyword, numbers) in lists {
            section(&mut out, keyword, numbers, |out, number| {
                let _ = writeln!(out, "{}", number + 1);
            });
        }
        out.push_str("\nEnd\n");
        out.into_bytes()
    }
}

/// The bytes of a `.sol` file: at each vertex a size, or the entries m11, m12 and m22 of a metric.
///
/// ```
/// use planish::formats::medit::{MeditMesh, solution};
///
/// let vertices = vec![([0.0, 0.0], 0), ([1.0, 0.0], 0), ([0.0, 0.5], 0)];
/// let mesh = MeditMesh { vertices, triangles: vec![([0, 1, 2], 7)], ..MeditMesh::default() };
/// let text = String::from_utf8(mesh.into_bytes())?;
/// assert!(text.contains("Dimension 2\n\nVertices\n3\n0.0 0.0 0\n") && text.ends_with("Triangles\n1\n1 2 3 7\n\nEnd\n"));
/// let sizes = String::from_utf8(solution(2, &[[0.5], [0.25], [1e-9]]))?;
/// assert!(sizes.ends_with("SolAtVertices\n3\n1 1\n0.5 \n0.25 \n1e-9 \n\nEnd\n"), "{sizes}");
/// # Ok::<(), std::string::FromUtf8Error>(())
/// ```
pub fn solution<const M: usize>(dimension: usize, values: &[[f64; M]]) -> Vec<u8> {
    let kind = if M == 1 { 1 } else { 3 };
    let mut out =
        format!("MeshVersionFormatted 2\n\nDimension {dimension}\n\nSolAtVertices\n{}\n1 {kind}\n", values.len());
    for value in values {
        numbers(&mut out, value);
        out.push('\n');
    }
    out.push_str("\nEnd\n");
    out.into_bytes()
}

fn section<T>(out: &mut String, keyword: &str, items: &[T], write: impl Fn(&mut String, &T)) {
    if items.is_empty() {
        return;
    }
    let _ = write!(out, "\n{keyword}\n{}\n", items.len());
    items.iter().for_each(|item| write(out, item));
}

fn numbers(out: &mut String, numbers: &[f64]) {
    for number in numbers {
        let _ = write!(out, "{number:?} ");
    }
}
