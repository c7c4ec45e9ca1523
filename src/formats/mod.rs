//! File formats: which there are, and reading a soup of triangles from the bytes of a file.

mod content;
pub mod fields;
mod finish;
mod gltf;
pub mod gmsh;
mod joined;
mod labels;
pub mod layout;
mod location;
pub mod made;
pub mod medit;
mod msh;
#[cfg(test)]
#[path = "../../tests/fuzz/mutate/mod.rs"]
mod mutate;
mod numbered;
mod obj;
mod off;
mod patches;
mod ply;
mod point_sizes;
mod polygon;
mod scalar;
mod sniff;
mod stl;
mod texture;
mod value_error;
mod vtk;
mod words;

use crate::outcome::{Code, Reason};
pub use crate::settings::{LabelSource, Limits};
pub use content::{Content, NoSiblings, Notes, SiblingFiles, Source, TooMany};
pub use fields::{Field, Fields, Values};
pub use gltf::glb;
pub use joined::JoinedVertices;
pub use labels::{Label, LabelError, label_index};
use location::Location;
pub use made::{MadeFormat, MadeMesh};
pub use obj::surface as surface_obj;
pub use patches::Patches;
use planish_core::mesh::SoupError;
pub use point_sizes::SizeError;
use std::path::Path;
pub use vtk::{vtm, vtp, vtu, welded};

/// A format that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Stereolithography, ASCII or binary.
    Stl,
    /// Wavefront OBJ.
    Obj,
    /// glTF 2.0, JSON or binary container.
    Gltf,
    /// VTK legacy.
    Vtk,
    /// VTK XML, an unstructured grid.
    Vtu,
    /// VTK XML, polygons.
    Vtp,
    /// Polygon File Format, ASCII or binary.
    Ply,
    /// MSH of Gmsh, ASCII or binary.
    Msh,
    /// Object File Format of Geomview.
    Off,
    /// The text format of MEDIT (`.mesh`).
    Medit,
}

impl Format {
    /// The bytes that a file takes per triangle in the densest of the layouts that are usual: of a large closed surface,
    /// with single precision coordinates. Measured by `cargo run --release --example decode`. Strips and instances take
    /// less still.
    pub fn bytes_per_triangle(self) -> u64 {
        match self {
            // Records of one size in binary files. Text takes five times as much.
            Self::Stl => 50,
            // Quads in text of six decimals: 30. Triangles: 37.
            Self::Obj | Self::Off => 30,
            // Binary quads: 14.5. Binary triangles: 19. Text: 37.
            Self::Ply => 14,
            // Indices of 16 bits: 12. Of 32 bits: 18.
            Self::Gltf => 12,
            // Quads of version 3: 16. Triangles: 22. Those of version 5: 38.
            Self::Vtk => 16,
            // Compressed by zlib: 9. Raw quads: 26. Raw triangles: 38.
            Self::Vtu | Self::Vtp => 9,
            // Binary quads of version 2: 28, of version 4: 36. Triangles: 38 and 48.
            Self::Msh => 28,
            // Quads in text of six decimals, each line with a reference: 34.
            Self::Medit => 34,
        }
    }

    /// Whether arrays of points are read, which may tell sizes.
    fn has_point_arrays(self) -> bool {
        matches!(self, Self::Vtk | Self::Vtu | Self::Vtp | Self::Msh)
    }
}

/// What the name of a file says about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A mesh that planish reads.
    Mesh(Format),
    /// A mesh in a format that this version does not read.
    OtherMesh(String),
    /// Something that lies beside meshes: materials, pictures, hidden and temporary files.
    NoMesh,
    /// An extension that planish does not know, or none.
    Unknown(String),
}

/// Extensions of meshes in formats that this version does not read.
const OTHER_MESHES: [&str; 1] = ["meshb"];

/// The extensions that planish reads, as people are told.
pub const READ: &str = ".stl .obj .ply .gltf .glb .vtk .vtu .vtp .msh .off .mesh";

/// Extensions of what lies beside meshes, or only names them.
const NO_MESHES: [&str; 16] = [
    "mtl",
    "bin",
    "png",
    "jpg",
    "jpeg",
    "bmp",
    "tga",
    "txt",
    "md",
    "json",
    "tmp",
    "part",
    "crdownload",
    "vtm",
    "pvtu",
    "pvtp",
];

/// Tells the kind of a file by its name.
///
/// ```
/// use planish::formats::{Format, Kind, kind};
///
/// assert_eq!(kind("scans/Part.STL".as_ref()), Kind::Mesh(Format::Stl));
/// // A mesh that planish does not read is refused, with a remedy; what lies beside meshes is passed over.
/// assert_eq!(kind("part.meshb".as_ref()), Kind::OtherMesh("meshb".to_owned()));
/// assert_eq!(kind("part.mtl".as_ref()), Kind::NoMesh);
/// assert_eq!(kind(".part.stl.part".as_ref()), Kind::NoMesh);
/// assert_eq!(kind("part.xyz".as_ref()), Kind::Unknown("xyz".to_owned()));
/// ```
pub fn kind(path: &Path) -> Kind {
    let name = path.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
    match extension.as_str() {
        _ if name.starts_with('.') || name.ends_with('~') => Kind::NoMesh,
        "stl" => Kind::Mesh(Format::Stl),
        "obj" => Kind::Mesh(Format::Obj),
        "gltf" | "glb" => Kind::Mesh(Format::Gltf),
        "vtk" => Kind::Mesh(Format::Vtk),
        "vtu" => Kind::Mesh(Format::Vtu),
        "vtp" => Kind::Mesh(Format::Vtp),
        "ply" => Kind::Mesh(Format::Ply),
        "msh" => Kind::Mesh(Format::Msh),
        "off" => Kind::Mesh(Format::Off),
        "mesh" => Kind::Mesh(Format::Medit),
        e if OTHER_MESHES.contains(&e) => Kind::OtherMesh(extension),
        e if NO_MESHES.contains(&e) => Kind::NoMesh,
        _ => Kind::Unknown(extension),
    }
}

/// Why the bytes of a file are no soup.
#[derive(Debug, PartialEq, thiserror::Error)]
pub enum ReadError {
    /// There are no bytes.
    #[error("the file is empty (0 bytes); export it again")]
    Empty,
    /// Nothing that any reader reads.
    #[error("the file is {what}; {remedy}")]
    Foreign {
        /// What it is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Not an STL file.
    #[error(transparent)]
    Stl(#[from] stl::StlError),
    /// Not an OBJ file.
    #[error(transparent)]
    Obj(#[from] obj::ObjError),
    /// Not a glTF file.
    #[error(transparent)]
    Gltf(#[from] gltf::GltfError),
    /// Not a VTK file, or none with a surface.
    #[error(transparent)]
    Vtk(#[from] vtk::VtkError),
    /// Not a PLY file.
    #[error(transparent)]
    Ply(#[from] ply::PlyError),
    /// Not an MSH file.
    #[error(transparent)]
    Msh(#[from] msh::MshError),
    /// Not an OFF file.
    #[error(transparent)]
    Off(#[from] off::OffError),
    /// Not a file of MEDIT.
    #[error(transparent)]
    Medit(#[from] medit::MeditError),
    /// What shall name parts of the surface is not there.
    #[error(transparent)]
    Label(#[from] LabelError),
    /// What shall tell sizes is not there, or cannot.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// There are elements, but none of a surface.
    #[error("the file holds no surface, only {found}; {remedy}")]
    NoSurface {
        /// What there is.
        found: String,
        /// What to do.
        remedy: &'static str,
        /// What else there is to tell.
        notes: Box<Notes>,
    },
    /// What was read makes no sense.
    #[error("{}{error}", location.map(|p| format!("{p}: ")).unwrap_or_default())]
    Soup {
        /// Why.
        error: SoupError,
        /// The line or byte, where there is one.
        location: Option<Location>,
        /// What else there is to tell.
        notes: Box<Notes>,
    },
}

impl ReadError {
    /// The refusal that this error means.
    pub fn reason(&self) -> Reason {
        let (code, location) = match self {
            Self::Empty => (Code::EmptyFile, Some("byte 0".to_owned())),
            Self::Foreign { .. } => (Code::UnsupportedFormat, Some("byte 0".to_owned())),
            Self::Stl(e) => (e.code(), e.location()),
            Self::Obj(e) => (e.code(), e.location()),
            Self::Gltf(e) => (e.code(), e.location()),
            Self::Vtk(e) => (e.code(), e.location()),
            Self::Ply(e) => (e.code(), e.location()),
            Self::Msh(e) => (e.code(), e.location()),
            Self::Off(e) => (e.code(), e.location()),
            Self::Medit(e) => (e.code(), e.location()),
            Self::Label(_) => (Code::NoLabels, None),
            Self::Size(_) => (Code::NoSizes, None),
            Self::NoSurface { .. } => (Code::NoTriangles, None),
            Self::Soup { error, location, .. } => {
                let (code, element) = soup_reason(error);
                (code, location.map(|p| p.to_string()).or(element))
            }
        };
        Reason::at(code, self, location)
    }

    /// What the file holds beside a surface, where it could be read to its end.
    pub fn notes(&self) -> Option<&Notes> {
        match self {
            Self::NoSurface { notes, .. } | Self::Soup { notes, .. } => Some(notes),
            _ => None,
        }
    }
}

/// A refusal, with what could be read all the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Why.
    pub reason: Reason,
    /// What the file holds, where it could be read to its end.
    pub notes: Option<Box<Notes>>,
}

impl From<Reason> for Refusal {
    fn from(reason: Reason) -> Self {
        Self { reason, notes: None }
    }
}

impl From<Refusal> for Reason {
    fn from(refusal: Refusal) -> Self {
        refusal.reason
    }
}

fn soup_reason(error: &SoupError) -> (Code, Option<String>) {
    match error {
        SoupError::NoTriangles { .. } => (Code::NoTriangles, None),
        SoupError::NotFinite { point, .. } => (Code::NotFinite, Some(format!("point {point}"))),
        SoupError::IndexOutOfRange { triangle, .. } => (Code::Malformed, Some(format!("triangle {triangle}"))),
        SoupError::TooLarge { .. } => (Code::TooLarge, None),
    }
}

impl std::fmt::Display for Format {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Stl => "STL",
            Self::Obj => "OBJ",
            Self::Gltf => "glTF",
            Self::Vtk => "VTK",
            Self::Vtu => "VTU",
            Self::Vtp => "VTP",
            Self::Ply => "PLY",
            Self::Msh => "MSH",
            Self::Off => "OFF",
            Self::Medit => "MEDIT",
        })
    }
}

/// As [`read`]; the refusal begins with the format that the file was taken for.
///
/// # Errors
/// The refusal.
pub fn read_or_tell(format: Format, source: &Source) -> Result<Content, Refusal> {
    read(format, source).map_err(|error| {
        let mut reason = error.reason();
        // Those are in no format.
        if !matches!(error, ReadError::Empty | ReadError::Foreign { .. }) {
            let format = sniff::sniff(source.bytes).unwrap_or(format);
            let begins_with_location =
                reason.location.as_ref().is_some_and(|location| reason.message.starts_with(location));
            let separator = if begins_with_location { "," } else { ":" };
            reason.message = format!("{format}{separator} {}", reason.message);
        }
        Refusal { reason, notes: error.notes().cloned().map(Box::new) }
    })
}

/// Reads the bytes of a file, which its name says to be in this format; where the bytes say otherwise beyond doubt, they
/// are believed.
///
/// ```
/// use planish::formats::{Format, read_alone};
/// use planish::outcome::Code;
///
/// // An OBJ file whose name ends in .stl.
/// let content = read_alone(Format::Stl, b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").expect("a triangle");
/// assert_eq!(content.soup.triangles(), [[0, 1, 2]]);
/// assert_eq!(content.notes.format, "OBJ");
///
/// let reason = read_alone(Format::Obj, b"v 0 0 0\nv 1 0 0\nf 1 2 3\n").expect_err("no third point").reason();
/// assert_eq!((reason.code, reason.location.as_deref()), (Code::Malformed, Some("line 3")));
/// ```
///
/// # Errors
/// [`ReadError`], with the place and what to do.
pub fn read(format: Format, source: &Source) -> Result<Content, ReadError> {
    let bytes = source.bytes;
    if bytes.is_empty() {
        return Err(ReadError::Empty);
    }
    let sniffed = sniff::sniff(bytes);
    if let Some((what, remedy)) = sniff::foreign(bytes).filter(|_| sniffed.is_none()) {
        return Err(ReadError::Foreign { what, remedy });
    }
    // Editors put a mark before text. The other readers pass over it themselves: binary STL files may begin with anything.
    let unmarked = Source { bytes: bytes.strip_prefix(sniff::MARK).unwrap_or(bytes), ..*source };
    let format = sniffed.unwrap_or(format);
    if let Some(asked) = source.sizes.filter(|_| !format.has_point_arrays()) {
        return Err(SizeError::missing([].into_iter(), asked).into());
    }
    match format {
        Format::Stl => stl::read(source),
        Format::Obj => obj::read(source),
        Format::Gltf => gltf::read(source),
        Format::Vtk | Format::Vtu | Format::Vtp => vtk::read(&unmarked),
        Format::Ply => ply::read(&unmarked),
        Format::Msh => msh::read(&unmarked),
        Format::Off => off::read(&unmarked),
        Format::Medit => medit::read(&unmarked),
    }
}

/// Reads a mesh with what its file tells of its elements: in MSH files the entities and the nodes in the middle of sides,
/// elsewhere the corners of triangles only.
///
/// # Errors
/// As [`read`].
pub fn read_patches(format: Format, source: &Source) -> Result<Patches, ReadError> {
    if sniff::sniff(source.bytes).unwrap_or(format) == Format::Msh && !source.bytes.is_empty() {
        let bytes = source.bytes.strip_prefix(sniff::MARK).unwrap_or(source.bytes);
        return msh::read_patches(&Source { bytes, ..*source });
    }
    let soup = read(format, &Source { keeps_fields: false, ..*source })?.soup;
    let triangles = soup.triangles().len();
    Ok(Patches::new(&soup, vec![None; triangles], None))
}

/// The bytes of a mesh that planish has made.
pub fn encode_made(format: MadeFormat, mesh: &MadeMesh) -> Vec<u8> {
    match format {
        MadeFormat::Msh => gmsh::made(mesh),
        MadeFormat::Vtu => vtk::made(mesh),
        MadeFormat::Stl => stl::made(mesh),
        MadeFormat::Medit => medit::made(mesh),
        MadeFormat::Obj => obj::made(mesh),
    }
}

/// As [`read`], with the usual limits and nothing beside the file.
///
/// # Errors
/// As [`read`].
pub fn read_alone(format: Format, bytes: &[u8]) -> Result<Content, ReadError> {
    read(format, &Source::alone(bytes, &Limits::default()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_kinds() {
        assert_eq!(kind(Path::new("a/Part.STL")), Kind::Mesh(Format::Stl));
        assert_eq!(kind(Path::new("scan.obj")), Kind::Mesh(Format::Obj));
        assert_eq!(kind(Path::new("scan.ply")), Kind::Mesh(Format::Ply));
        assert_eq!(kind(Path::new("Part.Msh")), Kind::Mesh(Format::Msh));
        assert_eq!(kind(Path::new("scan.OFF")), Kind::Mesh(Format::Off));
        assert_eq!(kind(Path::new("part.mesh")), Kind::Mesh(Format::Medit));
        assert_eq!(kind(Path::new("part.meshb")), Kind::OtherMesh("meshb".to_owned()));
        for (name, format) in [("a.vtk", Format::Vtk), ("a.vtu", Format::Vtu), ("a.VTP", Format::Vtp)] {
            assert_eq!(kind(Path::new(name)), Kind::Mesh(format));
        }
        for beside in ["scan.mtl", ".scan.stl", "scan.stl.part", "scan.obj~", "a.png"] {
            assert_eq!(kind(Path::new(beside)), Kind::NoMesh, "{beside}");
        }
        assert_eq!(kind(Path::new("scan.xyz")), Kind::Unknown("xyz".to_owned()));
        assert_eq!(kind(Path::new("scan")), Kind::Unknown(String::new()));
    }

    #[test]
    fn a_mark_before_text_does_no_harm() {
        let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                   element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
        let msh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
                   $Elements\n1\n1 2 0 1 2 3\n$EndElements\n";
        let vtk = "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n\
                   POLYGONS 1 4\n3 0 1 2\n";
        for (format, text) in [(Format::Ply, ply), (Format::Msh, msh), (Format::Vtk, vtk)] {
            let marked = read_alone(format, format!("\u{feff}{text}").as_bytes()).expect("marked");
            assert_eq!(marked, read_alone(format, text.as_bytes()).expect("plain"), "{format}");
        }
    }

    /// A triangle and a fourth point in every format, with another word in the place of `@` (the first corner's x) or `#`
    /// (the fourth point's).
    fn triangle(at: &str, hash: &str) -> Vec<(Format, Vec<u8>)> {
        let points = "@ 0 0\n1 0 0\n0 1 0\n# 0 0\n";
        let lines = |begin: &str, end: &str| -> String {
            points.lines().zip(1..).map(|(p, i)| format!("{}{p}{end}\n", begin.replace('N', &i.to_string()))).collect()
        };
        let xml = |kind: &str, cells: &str| {
            format!(
                "<VTKFile type=\"{kind}\"><{kind}><Piece NumberOfPoints=\"4\" {cells}<Points><DataArray type=\"Float64\" \
                 NumberOfComponents=\"3\" format=\"ascii\">{points}</DataArray></Points></Piece></{kind}></VTKFile>"
            )
        };
        let ids = |name: &str, ids: &str| {
            format!("<DataArray type=\"Int32\" Name=\"{name}\" format=\"ascii\">{ids}</DataArray>")
        };
        let list = ids("connectivity", "0 1 2") + &ids("offsets", "3");
        let list_with_types = list.clone() + &ids("types", "5");
        let texts = [
            (Format::Obj, lines("v ", "") + "f 1 2 3\n"),
            (
                Format::Ply,
                "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
                 element face 1\nproperty list int int vertex_index\nend_header\n"
                    .to_owned()
                    + points
                    + "3 0 1 2\n",
            ),
            (Format::Off, format!("OFF 4 1 0\n{points}3 0 1 2\n")),
            (
                Format::Medit,
                format!("MeshVersionFormatted 2\nDimension 3\nVertices 4\n{}Triangles 1\n1 2 3 0\n", lines("", " 0")),
            ),
            (
                Format::Vtk,
                format!(
                    "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n{points}POLYGONS 1 4\n3 0 1 2\n"
                ),
            ),
            (Format::Vtp, xml("PolyData", &format!("NumberOfPolys=\"1\"><Polys>{list}</Polys>"))),
            (Format::Vtu, xml("UnstructuredGrid", &format!("NumberOfCells=\"1\"><Cells>{list_with_types}</Cells>"))),
            (
                Format::Msh,
                format!(
                    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{}$EndNodes\n$Elements\n1\n1 2 0 1 2 3\n$EndElements\n",
                    lines("N ", "")
                ),
            ),
            (
                Format::Msh,
                format!(
                    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n2 1 0 4\n1\n2\n3\n4\n{points}$EndNodes\n\
                     $Elements\n1 1 1 1\n2 1 2 1\n1 1 2 3\n$EndElements\n"
                ),
            ),
        ];
        let word = |text: String| {
            let text = if text.starts_with("# vtk") { text.replacen("# vtk", "\u{1} vtk", 1) } else { text };
            text.replace('@', at).replace('#', hash).replace('\u{1}', "#").into_bytes()
        };
        texts.into_iter().map(|(format, text)| (format, word(text))).collect()
    }

    /// Also with a document of glTF, which is no text.
    #[test]
    fn points_that_no_triangle_uses_refuse_no_file_of_any_format() {
        let document = |at: f32, hash: f32| {
            let data = [at, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, hash, 0.0, 0.0].map(f32::to_le_bytes).concat();
            let data = [data, vec![0, 1, 2, 0]].concat();
            let uri = format!("data:;base64,{}", base64::Engine::encode(&base64::prelude::BASE64_STANDARD, data));
            let document = serde_json::json!({
                "asset": {"version": "2.0"}, "buffers": [{"byteLength": 52, "uri": uri}],
                "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
                "accessors": [
                    {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
                    {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}
                ],
                "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 4}]
            });
            (Format::Gltf, document.to_string().into_bytes())
        };
        let with = |at: &str, hash: &str| {
            let number = |word: &str| word.parse().unwrap_or(f32::NAN);
            let mut files = triangle(at, hash);
            files.push(document(number(at), number(hash)));
            files
        };
        for bad in ["nan", "-inf", "1e999", "-nan(ind)"] {
            for (format, bytes) in with("0", bad) {
                let soup = read_alone(format, &bytes).unwrap_or_else(|e| panic!("{format}, {bad}: {e}")).soup;
                assert_eq!((soup.points().len(), soup.points()[1]), (4, [1.0, 0.0, 0.0]), "{format}");
                let repaired = planish_core::repair(&soup, &Default::default()).expect("a triangle");
                assert_eq!(repaired.report.unreferenced_points, 1, "{format}");
            }
            for (format, bytes) in with(bad, "0") {
                let reason = read_alone(format, &bytes).expect_err(bad).reason();
                assert_eq!(reason.code, Code::NotFinite, "{format}: {}", reason.message);
                assert!(reason.message.contains("1 corner is of this sort"), "{format}: {}", reason.message);
            }
        }
    }

    #[test]
    fn numbers_of_other_habits_are_refused_by_name_in_every_text() {
        let facet = "solid\nfacet normal 0 0 1\nouter loop\nvertex @ 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid";
        for (word, told) in [("0,5", "decimal comma"), ("5.0D-01", "Fortran exponent"), ("1.5+100", "Fortran exponent")]
        {
            let mut files = triangle(word, "0");
            files.push((Format::Stl, facet.replace('@', word).into_bytes()));
            for (format, bytes) in files {
                let reason = read_alone(format, &bytes).expect_err(word).reason();
                assert!(reason.message.contains(told) && reason.message.contains(word), "{format}: {}", reason.message);
                assert!(reason.code == Code::Malformed && reason.location.is_some(), "{format}: {reason:?}");
            }
        }
    }

    #[test]
    fn what_no_reader_reads_is_told_by_name() {
        let utf16: Vec<u8> = "\u{feff}v 0 0 0\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        let rows: [(&[u8], &str); 9] = [
            (&utf16, "UTF-16"),
            (b"\xfe\xff\0v\0 ", "UTF-16"),
            (b"\x1f\x8b\x08\0\0", "gzip"),
            (b"PK\x03\x04\x14\0", "zip"),
            (b"\n<!DOCTYPE html>\n<html>", "web page"),
            (b"(0 \"GAMBIT to Fluent File\")\n", "Fluent"),
            (b"\x01\0\0\0\x02\0\0\0\x03\0\0\0", "MEDIT"),
            (b"\0\0\0\x01\0\0\0\x04\0\0\0\x03", "MEDIT"),
            (b"ISO-10303-21;\n", "STEP"),
        ];
        for (bytes, what) in rows {
            for format in [Format::Stl, Format::Obj, Format::Ply, Format::Gltf, Format::Vtu, Format::Msh] {
                let reason = read_alone(format, bytes).expect_err(what).reason();
                assert!(reason.message.contains(what), "{}", reason.message);
                assert_eq!((reason.code, reason.location.as_deref()), (Code::UnsupportedFormat, Some("byte 0")));
            }
        }
    }

    #[test]
    fn an_empty_file_is_refused_with_its_place() {
        let reason = read_alone(Format::Stl, b"").expect_err("empty").reason();
        assert_eq!((reason.code, reason.location.as_deref()), (Code::EmptyFile, Some("byte 0")));
    }
}
