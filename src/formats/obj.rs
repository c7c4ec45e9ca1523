//! Wavefront OBJ, read by `tobj`.
//!
//! Only vertices and faces matter here, so only these reach the library: lines that are continued are joined,
//! comments, groups, materials, normals, texture coordinates, colours, points and lines are left out first. (With
//! groups the library would copy vertices; it takes lines of three and more points for faces, and refuses normals
//! and texture coordinates that nobody needs.) Polygons are cut into triangles; vertices keep the numbers they have in
//! the file.

use super::{Content, Notes, ReadError, polygon};
use crate::outcome::Code;
use pipeline::mesh::TriangleSoup;
use pipeline::space::Vec3;

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
    /// The library found an error that the search before it does not.
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
pub(super) fn read(bytes: &[u8]) -> Result<Content, ReadError> {
    // Names and comments may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let statements = statements(&text);
    let geometry = check(&statements)?;
    let plain: String = statements.iter().map(|s| format!("{}\n", s.words.join(" "))).collect();
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let loaded = tobj::load_obj_buf(&mut plain.as_bytes(), &tobj::LoadOptions::default(), no_materials);
    let (models, _) = loaded.map_err(|e| ObjError::Library { problem: e.to_string() })?;
    let mut notes = Notes::new("OBJ");
    names(&text).for_each(|name| notes.name(name));
    let mut triangles = Vec::new();
    for mesh in models.iter().map(|m| &m.mesh) {
        geometry.agrees_with(&mesh.positions)?;
        let mut rest = &mesh.indices[..];
        let triangles_only = mesh.face_arities.is_empty().then(|| vec![3; rest.len() / 3]);
        for size in triangles_only.as_ref().unwrap_or(&mesh.face_arities) {
            let (face, others) = rest.split_at((*size as usize).min(rest.len()));
            let corners: Vec<u32> = face.iter().map(|i| geometry.first_used[*i as usize]).collect();
            let is_doubtful = polygon::add(&corners, &geometry.points, &mut triangles);
            if face.len() > 3 {
                notes.polygon(is_doubtful);
            }
            rest = others;
        }
    }
    Ok(Content { soup: TriangleSoup::new(geometry.points, triangles)?, notes })
}

/// The names of objects and groups.
fn names(text: &str) -> impl Iterator<Item = &str> {
    let lines = text.split(['\n', '\r']).map(str::trim_start);
    lines.filter_map(|line| {
        line.split_once([' ', '\t']).filter(|(word, _)| ["o", "g"].contains(word)).map(|(_, name)| name)
    })
}

/// The vertices of a file in its own order, and in the order in which faces first use them, which is the library's.
struct Geometry {
    points: Vec<Vec3>,
    first_used: Vec<u32>,
}

impl Geometry {
    /// The library must have found the same vertices in that order: then its indices can be turned back into those
    /// of the file.
    fn agrees_with(&self, positions: &[f64]) -> Result<(), ObjError> {
        let expected = self.first_used.iter().flat_map(|v| self.points[*v as usize]);
        if positions.iter().copied().eq(expected) {
            return Ok(());
        }
        Err(ObjError::Library { problem: "vertices in an unexpected order".to_owned() })
    }
}

/// A vertex or face: its keyword and numbers, and its (first) line in the file, from 1.
struct Statement<'a> {
    words: Vec<&'a str>,
    line: usize,
}

/// The vertices (three coordinates each) and faces (vertex indices only) of a file, in their order.
fn statements(text: &str) -> Vec<Statement<'_>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let separator = if text.contains('\n') { '\n' } else { '\r' };
    let mut found = Vec::new();
    let (mut words, mut first): (Vec<&str>, usize) = (Vec::new(), 1);
    for (line, number) in text.split(separator).zip(1..) {
        let line = line.split('#').next().unwrap_or_default().trim();
        let continued = line.strip_suffix('\\');
        words.extend(continued.unwrap_or(line).split_whitespace());
        if continued.is_none() {
            found.extend(geometry(std::mem::take(&mut words)).map(|words| Statement { words, line: first }));
            first = number + 1;
        }
    }
    found.extend(geometry(words).map(|words| Statement { words, line: first }));
    found
}

/// What a statement says about vertices and faces, if anything.
fn geometry(mut words: Vec<&str>) -> Option<Vec<&str>> {
    match *words.first()? {
        "v" => words.truncate(4),
        // The old keyword "fo" means the same.
        "f" | "fo" => {
            words[0] = "f";
            words[1..].iter_mut().for_each(|w| *w = w.split('/').next().unwrap_or_default());
        }
        _ => return None,
    }
    Some(words)
}

/// Finds what the library would refuse without telling the line.
fn check(statements: &[Statement]) -> Result<Geometry, ObjError> {
    let vertices = statements.iter().filter(|s| s.words[0] == "v").count();
    let mut geometry = Geometry { points: Vec::with_capacity(vertices), first_used: Vec::new() };
    let mut used = vec![false; vertices];
    for statement in statements {
        let line = statement.line;
        let syntax = || ObjError::Syntax { line, text: shown(&statement.words.join(" ")) };
        let words = statement.words.get(1..).filter(|w| w.len() >= 3).ok_or_else(syntax)?;
        if statement.words[0] == "v" {
            let mut point = [0.0_f64; 3];
            for (c, word) in point.iter_mut().zip(words) {
                *c = word.parse().map_err(|_| syntax())?;
                if !c.is_finite() {
                    return Err(ObjError::NotFinite { line, value: shown(word) });
                }
            }
            geometry.points.push(point);
            continue;
        }
        for word in words {
            let index: i64 = word.parse().map_err(|_| syntax())?;
            // Negative indices count back from the vertices so far.
            let limit = if index < 0 { geometry.points.len() } else { vertices };
            if index == 0 || index.unsigned_abs() > limit as u64 {
                return Err(ObjError::OutOfRange { line, index, vertices: limit });
            }
            let back = index.unsigned_abs() as usize;
            let vertex = if index < 0 { limit - back } else { back - 1 };
            if !std::mem::replace(&mut used[vertex], true) {
                geometry.first_used.push(vertex as u32);
            }
        }
    }
    Ok(geometry)
}

fn shown(text: &str) -> String {
    text.trim().chars().take(60).collect::<String>().escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<TriangleSoup, ReadError> {
        super::read(bytes).map(|content| content.soup)
    }
    use pipeline::mesh::SoupError;

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
    fn what_exporters_write_besides_triangles_does_no_harm() {
        let plain = read(format!("{SQUARE}f 1 2 3\nf 1 3 4\n").as_bytes()).expect("triangles");
        let files = [
            format!("\u{feff}{}f 1 2 3\nf 1 3 4\n", SQUARE.trim_start_matches("# caf\u{e9}\n")),
            format!("{SQUARE}vt 0.5\nvn -1.#IND 0 0\nvt x\nf 1/1/1 2/9/9 3\nf 1/-9 3 4\n"),
            format!("{SQUARE}f 1 2 3 # one\nf 1 \\\n3 \\\n4\nl 1 3 4\np 1\nusemtl\n"),
            format!("{SQUARE}f 1 2 3\nf 1 3 4\n").replace('\n', "\r"),
            format!("f 1 2 3\ng late\nfo 1 3 4\n{SQUARE}"),
            format!("{SQUARE}f 1 2 3\nf 1 3 4\n").replace(" 0\n", " 0 0.5 0.5 0.5\n"),
        ];
        for (i, file) in files.iter().enumerate() {
            let soup = read(file.as_bytes()).unwrap_or_else(|e| panic!("file {i}: {e}"));
            assert_eq!(soup, plain, "file {i}");
        }
    }

    #[test]
    fn vertices_keep_their_place_in_the_file() {
        let soup = read(format!("v 9 9 9\n{SQUARE}f 5 3 4\nf -2 -1 2\n").as_bytes()).expect("two triangles");
        assert_eq!((soup.points().len(), soup.points()[0]), (5, [9.0; 3]));
        assert_eq!(soup.triangles(), [[4, 2, 3], [3, 4, 1]]);
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
        assert!(matches!(error(&format!("{SQUARE}f 1 2\n")), ObjError::Syntax { line: 6, .. }));
        assert!(matches!(
            error("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n"),
            ObjError::OutOfRange { line: 3, index: -3, .. }
        ));
        assert!(matches!(read(SQUARE.as_bytes()), Err(ReadError::Soup(SoupError::NoTriangles { .. }))));
    }
}
