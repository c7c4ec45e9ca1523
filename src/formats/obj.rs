//! Wavefront OBJ, read by `tobj`: groups become one soup (which repair welds again), polygons are cut into
//! triangles, materials, normals and texture coordinates are not needed.

use super::{ReadError, polygon};
use crate::outcome::Code;
use pipeline::mesh::{SoupError, TriangleSoup};

/// Why bytes are no OBJ file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjError {
    /// A coordinate is not a number, or infinite.
    #[error("line {line} has the coordinate {value}; repair the exporting model")]
    NotFinite {
        /// The line, from 1.
        line: usize,
        /// The word found.
        value: String,
    },
    /// A face names a vertex that does not exist.
    #[error(
        "line {line}: a face uses vertex {index}, but the file has {vertices}; the file was cut off or its numbering is wrong: export it again"
    )]
    OutOfRange {
        /// The line, from 1.
        line: usize,
        /// The index found.
        index: i64,
        /// Vertices in the file.
        vertices: usize,
    },
    /// A line makes no sense.
    #[error("line {line}: \"{text}\" is no valid OBJ statement; correct it or export the file again")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// The line's text, shortened.
        text: String,
    },
    /// The library found an error that the line by line search does not.
    #[error("the file cannot be read as OBJ ({problem}); export it again")]
    Library {
        /// The library's words.
        problem: String,
    },
}

impl ObjError {
    pub(super) fn code(&self) -> Code {
        if matches!(self, Self::NotFinite { .. }) { Code::NotFinite } else { Code::Malformed }
    }

    pub(super) fn place(&self) -> Option<String> {
        match self {
            Self::NotFinite { line, .. } | Self::OutOfRange { line, .. } | Self::Syntax { line, .. } => {
                Some(format!("line {line}"))
            }
            Self::Library { .. } => None,
        }
    }
}

/// Reads an OBJ file.
pub(super) fn read(bytes: &[u8]) -> Result<TriangleSoup, ReadError> {
    // Names and comments may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let options = tobj::LoadOptions { ignore_points: true, ignore_lines: true, ..Default::default() };
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let loaded = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials);
    let (models, _) = loaded.map_err(|e| locate(&text, &e))?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for mesh in models.iter().map(|m| &m.mesh) {
        let base = points.len() as u32;
        points.extend(mesh.positions.chunks_exact(3).map(|p| [p[0], p[1], p[2]]));
        let mut rest = &mesh.indices[..];
        let sizes = mesh.face_arities.iter().map(|a| *a as usize).chain(std::iter::repeat(3));
        for size in sizes.take(if mesh.face_arities.is_empty() { rest.len() / 3 } else { mesh.face_arities.len() }) {
            let (face, others) = rest.split_at(size.min(rest.len()));
            let corners: Vec<u32> = face.iter().map(|i| base + i).collect();
            triangles.extend(polygon::triangulate(&corners, &points));
            rest = others;
        }
    }
    match TriangleSoup::new(points, triangles) {
        Err(error @ SoupError::NotFinite { .. }) => Err(first_bad_number(&text).map_or(error.into(), ReadError::Obj)),
        other => Ok(other?),
    }
}

/// Finds the line that `tobj`, which tells none, stumbled over.
fn locate(text: &str, error: &tobj::LoadError) -> ObjError {
    let vertices = text.lines().filter(|l| l.split_whitespace().next() == Some("v")).count();
    let bad_face = || text.lines().zip(1..).find_map(|(text, line)| bad_face(text, line, vertices));
    first_bad_number(text).or_else(bad_face).unwrap_or(ObjError::Library { problem: error.to_string() })
}

/// The first vertex line whose coordinates are no finite numbers.
fn first_bad_number(text: &str) -> Option<ObjError> {
    text.lines().zip(1..).find_map(|(text, line)| {
        let mut words = text.split_whitespace();
        let coordinates: Vec<&str> = (words.next() == Some("v")).then(|| words.take(3).collect())?;
        let syntax = || ObjError::Syntax { line, text: shown(text) };
        if coordinates.len() < 3 {
            return Some(syntax());
        }
        coordinates.iter().find_map(|word| match word.parse::<f64>() {
            Ok(number) if number.is_finite() => None,
            Ok(_) => Some(ObjError::NotFinite { line, value: shown(word) }),
            Err(_) => Some(syntax()),
        })
    })
}

/// A face line whose indices are no numbers or out of range.
fn bad_face(text: &str, line: usize, vertices: usize) -> Option<ObjError> {
    let mut words = text.split_whitespace();
    if words.next() != Some("f") {
        return None;
    }
    words.find_map(|word| match word.split('/').next().unwrap_or_default().parse::<i64>() {
        Ok(index) if index != 0 && index.unsigned_abs() as usize <= vertices => None,
        Ok(index) => Some(ObjError::OutOfRange { line, index, vertices }),
        Err(_) => Some(ObjError::Syntax { line, text: shown(text) }),
    })
}

fn shown(text: &str) -> String {
    text.trim().chars().take(60).collect::<String>().escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "# caf\u{e9}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

    fn error(text: &str) -> ObjError {
        match read(text.as_bytes()) {
            Err(ReadError::Obj(e)) => e,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn faces_of_all_sorts_are_read() {
        let soup = read(format!("{SQUARE}f 1 2 3\nf 1/1 3/1 4/1\n").as_bytes()).expect("triangles");
        assert_eq!(soup.triangles().len(), 2);
        let quad = read(format!("{SQUARE}f -4 -3 -2 -1\n").as_bytes()).expect("a quad");
        assert_eq!(quad.triangles().len(), 2);
        let mixed = read(format!("{SQUARE}f 1 2 3 4\nf 1 2 3\nl 1 2\n").as_bytes()).expect("mixed");
        assert_eq!(mixed.triangles().len(), 3);
        let latin1 = [b"# caf\xe9\n".as_slice(), SQUARE.as_bytes(), b"f 1 2 3\n"].concat();
        assert!(read(&latin1).is_ok());
    }

    #[test]
    fn groups_are_joined() {
        let soup = read(format!("{SQUARE}mtllib a.mtl\ng one\nusemtl b\nf 1 2 3\ng two\nf 1 3 4\n").as_bytes());
        let soup = soup.expect("two groups");
        assert_eq!(soup.triangles().len(), 2);
        let mesh = pipeline::repair(&soup, &Default::default()).expect("a surface").mesh;
        assert_eq!((mesh.census().vertices, mesh.census().components), (4, 1), "welded again");
    }

    #[test]
    fn errors_name_the_line() {
        let out = error(&format!("{SQUARE}f 1 2 9\n"));
        assert_eq!(out, ObjError::OutOfRange { line: 6, index: 9, vertices: 4 });
        assert_eq!(
            error("v 0 nan 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            ObjError::NotFinite { line: 1, value: "nan".to_owned() }
        );
        assert!(matches!(error("v 0 0 0\nv 1 x 0\nv 0 1 0\nf 1 2 3\n"), ObjError::Syntax { line: 2, .. }));
        assert!(matches!(error(&format!("{SQUARE}f 1 2 z\n")), ObjError::Syntax { line: 6, .. }));
        assert!(matches!(read(SQUARE.as_bytes()), Err(ReadError::Soup(SoupError::NoTriangles { .. }))));
    }
}
