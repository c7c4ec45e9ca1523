//! Wavefront OBJ, read by `tobj`.
//!
//! Only vertices and faces are for the library, so only these reach it, as it asks for them: lines that are continued
//! are joined, comments, groups (which are labels), materials, normals, texture coordinates, colours, points and lines are left out first. (With
//! groups the library would copy vertices; it takes lines of three and more points for faces, and refuses normals
//! and texture coordinates that nobody needs.) Polygons are cut into triangles; vertices keep the numbers they have in
//! the file.

mod made;
mod parts;
mod statements;
pub mod surface;

pub use made::made;

use super::finish::{self, BadPoints};
use super::location::{Location, escape};
use super::words::{float, foreign_number, integer, no_number};
use super::{Content, Limits, Notes, ReadError, Source, TooMany, polygon};
use crate::outcome::Code;
use parts::Parts;
use planish_core::vec3::Vec3;
use statements::{Kind, Plain, Statement, Statements, as_shown};

/// Why bytes are no OBJ file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum ObjError {
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
    /// A coordinate is written in another way.
    #[error("line {line}: {problem}")]
    Number {
        /// The line, from 1.
        line: usize,
        /// What is wrong, and what to do.
        problem: String,
    },
    /// There are more than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// The library found an error that the search before it does not.
    #[error("the file cannot be read as OBJ ({problem}); export it again")]
    Library {
        /// The library's words.
        problem: String,
    },
}

impl ObjError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::TooMany(_) => Code::TooLarge,
            _ => Code::Malformed,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        match self {
            Self::Number { line, .. } | Self::OutOfRange { line, .. } | Self::Syntax { line, .. } => {
                Some(format!("line {line}"))
            }
            Self::TooMany(_) | Self::Library { .. } => None,
        }
    }
}

/// Reads an OBJ file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let statements = Statements::new(source.bytes);
    let (geometry, parts) = check(&statements, source.limits)?;
    let mut labels = parts.labels(source.labels)?;
    let no_materials = |_: &std::path::Path| Ok((Vec::new(), Default::default()));
    let loaded = tobj::load_obj_buf(
        &mut Plain::new(statements, !geometry.bad.0.is_empty()),
        &tobj::LoadOptions::default(),
        no_materials,
    );
    let (models, _) = loaded.map_err(|e| ObjError::Library { problem: e.to_string() })?;
    let mut notes = Notes::new("OBJ");
    parts.names().for_each(|name| notes.name(name));
    let mut triangles = Vec::with_capacity(geometry.triangles);
    for mesh in models.into_iter().map(|m| m.mesh) {
        geometry.agrees_with(&mesh.positions)?;
        geometry.cut(&mesh, &mut triangles, &mut notes, |triangles| labels.face(triangles));
    }
    finish::content(geometry.points, triangles, labels.all, notes, &geometry.bad)
}

/// The vertices of a file in its own order, and in the order in which faces first use them, which is the library's.
struct Geometry {
    points: Vec<Vec3>,
    bad: BadPoints,
    first_used: Vec<u32>,
    /// How many triangles the faces give.
    triangles: usize,
}

impl Geometry {
    /// The library must have found the same vertices in that order: then its indices can be turned back into those
    /// of the file. (It is not shown coordinates that can be no corner's.)
    fn agrees_with(&self, positions: &[f64]) -> Result<(), ObjError> {
        let expected = self.first_used.iter().flat_map(|v| self.points[*v as usize].map(as_shown));
        if positions.iter().copied().eq(expected) {
            return Ok(());
        }
        Err(ObjError::Library { problem: "vertices in an unexpected order".to_owned() })
    }

    /// Cuts the faces that the library found into triangles; after each, `face_ends` is told how many there are.
    fn cut(
        &self,
        mesh: &tobj::Mesh,
        triangles: &mut Vec<[u32; 3]>,
        notes: &mut Notes,
        mut face_ends: impl FnMut(usize),
    ) {
        let mut corners = Vec::new();
        let mut rest = &mesh.indices[..];
        let mut sizes = mesh.face_arities.iter();
        while !rest.is_empty() {
            // Where all are triangles, no sizes are told.
            let size = sizes.next().map_or(3, |size| *size as usize);
            let (face, others) = rest.split_at(size.clamp(1, rest.len()));
            corners.clear();
            corners.extend(face.iter().map(|i| self.first_used[*i as usize]));
            let is_doubtful = polygon::add(&corners, &self.points, triangles);
            if face.len() > 3 {
                notes.polygon(is_doubtful);
            }
            face_ends(triangles.len());
            rest = others;
        }
    }

    /// Looks at the vertices of a face.
    fn face(&mut self, statement: &Statement, used: &mut [bool]) -> Result<(), ObjError> {
        let mut corners = 0;
        for word in statement.numbers() {
            let index = integer(word).ok_or_else(|| syntax(statement))?;
            // Negative indices count back from the vertices so far.
            let limit = if index < 0 { self.points.len() } else { used.len() };
            if index == 0 || index.unsigned_abs() > limit as u64 {
                return Err(ObjError::OutOfRange { line: statement.line, index, vertices: limit });
            }
            let back = index.unsigned_abs() as usize;
            let vertex = if index < 0 { limit - back } else { back - 1 };
            if !std::mem::replace(&mut used[vertex], true) {
                self.first_used.push(vertex as u32);
            }
            corners += 1;
        }
        if corners < 3 {
            return Err(syntax(statement));
        }
        self.triangles += corners - 2;
        Ok(())
    }
}

/// Finds what the library would refuse without telling the line, and what is too much.
fn check(statements: &Statements, limits: &Limits) -> Result<(Geometry, Parts), ObjError> {
    let vertices = statements.clone().filter(|s| s.kind == Kind::Vertex).count();
    TooMany::check("vertices", vertices as u64, limits.elements)?;
    let (points, bad) = (Vec::with_capacity(vertices), BadPoints::default());
    let mut geometry = Geometry { points, bad, first_used: Vec::new(), triangles: 0 };
    let mut used = vec![false; vertices];
    let mut parts = Parts::default();
    for statement in statements.clone() {
        match statement.kind {
            Kind::Vertex => {
                let point = point(&statement)?;
                geometry.bad.check(geometry.points.len(), &point, || Location::Line(statement.line));
                geometry.points.push(point);
            }
            Kind::Face => {
                geometry.face(&statement, &mut used)?;
                parts.face();
                TooMany::check("triangles", geometry.triangles as u64, limits.elements)?;
            }
            Kind::Part(part) => parts.begin(part, statement.name()),
        }
    }
    Ok((geometry, parts))
}

fn syntax(statement: &Statement) -> ObjError {
    let mut text = Vec::new();
    statement.write(&mut text);
    ObjError::Syntax { line: statement.line, text: escape(&text) }
}

/// The coordinates of a vertex.
fn point(statement: &Statement) -> Result<Vec3, ObjError> {
    let (mut point, mut numbers) = ([0.0; 3], statement.numbers());
    for c in &mut point {
        let word = numbers.next().ok_or_else(|| syntax(statement))?;
        *c = float(word).ok_or_else(|| match foreign_number(word) {
            Some(_) => ObjError::Number { line: statement.line, problem: no_number(word) },
            None => syntax(statement),
        })?;
    }
    Ok(point)
}

#[cfg(test)]
mod tests {
    use super::*;

    use planish_core::mesh::{SoupError, TriangleSoup};

    fn read(bytes: &[u8]) -> Result<TriangleSoup, ReadError> {
        limited(bytes, &Limits::default())
    }

    fn limited(bytes: &[u8], limits: &Limits) -> Result<TriangleSoup, ReadError> {
        super::read(&Source::alone(bytes, limits)).map(|content| content.soup)
    }

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
            assert_eq!((soup.points(), soup.triangles()), (plain.points(), plain.triangles()), "file {i}");
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
        let mesh = planish_core::repair(&soup, &Default::default()).expect("a surface").mesh;
        assert_eq!((mesh.topology_summary().vertices, mesh.topology_summary().components), (4, 1), "welded again");
    }

    #[test]
    fn too_many_vertices_or_triangles_are_refused_by_the_name_of_the_setting() {
        let limits = Limits { elements: 4, ..Limits::default() };
        assert!(limited(format!("{SQUARE}f 1 2 3 4\nf 4 3 2 1\n").as_bytes(), &limits).is_ok());
        let files = [
            (format!("{SQUARE}v 5 5 5\nf 1 2 3\n"), "5 vertices"),
            (format!("{SQUARE}{}", "f 1 2 3\n".repeat(5)), "5 triangles"),
            (format!("{SQUARE}{}", "f 1 2 3 4\n".repeat(3)), "6 triangles"),
        ];
        for (file, what) in files {
            let reason = limited(file.as_bytes(), &limits).expect_err(what).reason();
            assert!(reason.code == Code::TooLarge && reason.message.contains(what), "{reason:?}");
            assert!(reason.message.contains("`elements` in the table [limits] of planish.toml"), "{reason:?}");
        }
    }

    #[test]
    fn coordinates_that_are_none_refuse_the_faces_that_use_them_only() {
        for bad in ["nan", "-inf", "1e999", "1e200", "-nan(ind)", "1.#QNAN"] {
            let file = format!("v {bad} {bad} 0\n{SQUARE}v 0 {bad} 0\nf 2 3 4 5\nf 2 3 4\n");
            let soup = read(file.as_bytes()).unwrap_or_else(|e| panic!("{bad}: {e}"));
            assert_eq!((soup.triangles().len(), soup.points()[2], soup.points().len()), (3, [1.0, 0.0, 0.0], 6));
            let used = read(format!("{file}f 2 3 -1\nf 2 3 4 5 6\n").as_bytes()).expect_err(bad).reason();
            assert_eq!((used.code, used.location.as_deref()), (Code::NotFinite, Some("line 7")), "{}", used.message);
            assert!(used.message.contains("1 corner is of this sort") && used.message.starts_with("line 7: y of"));
        }
    }

    #[test]
    fn errors_name_the_line() {
        let out = error(&format!("{SQUARE}f 1 2 9\n"));
        assert_eq!(out, ObjError::OutOfRange { line: 6, index: 9, vertices: 4 });
        let comma = error("v 0 0 0\nv 1 0,5 0\nv 0 1 0\nf 1 2 3\n");
        assert!(comma.to_string().contains("line 2: \"0,5\" is no number, it has a decimal comma"), "{comma}");
        let fortran = error("v 0 0 1.0D+00\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        assert!(
            fortran.to_string().contains("line 1: \"1.0D+00\" is no number, it has a Fortran exponent"),
            "{fortran}"
        );
        assert!(matches!(error("v 0 0 0\nv 1 x 0\nv 0 1 0\nf 1 2 3\n"), ObjError::Syntax { line: 2, .. }));
        assert!(matches!(error(&format!("{SQUARE}f 1 2 z\n")), ObjError::Syntax { line: 6, .. }));
        assert!(matches!(error(&format!("{SQUARE}f 1 2\n")), ObjError::Syntax { line: 6, .. }));
        assert!(matches!(
            error("v 0 0 0\nv 1 0 0\nf -1 -2 -3\nv 0 1 0\n"),
            ObjError::OutOfRange { line: 3, index: -3, .. }
        ));
        assert!(matches!(read(SQUARE.as_bytes()), Err(ReadError::Soup { error: SoupError::NoTriangles { .. }, .. })));
    }
}
