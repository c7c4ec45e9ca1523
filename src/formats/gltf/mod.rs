//! glTF 2.0: `.gltf` (JSON) and `.glb` (binary container).
//!
//! The library parses the JSON; what it describes is read here, as the document is not to be trusted: every index, offset
//! and count is checked against what is there, and **no file is opened** but plain names beside the document, through
//! [`SiblingFiles`](super::Beside). All primitives of the default scene are read, once for each node that shows their mesh,
//! in the place where the node has it: triangles, strips and fans; points and lines are counted. Lengths are metres by
//! the specification. Materials, animations, skins and morph targets mean nothing here.

mod accessor;
mod buffers;
mod container;
pub mod glb;
mod scene;
mod tidy;

use super::finish::{self, BadPoints};
use super::labels::{self, LabelError, Labels};
use super::{Content, LabelSource, Notes, ReadError, Source};
use crate::outcome::Code;
use buffers::Buffers;
use gltf::json::Root;
use scene::{Part, Scene};
use tidy::Document;

/// Why bytes are no glTF file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum GltfError {
    /// The binary container is damaged.
    #[error("byte {byte}: {problem}; the file was cut off or is no GLB: copy or export it again")]
    Container {
        /// Where.
        byte: usize,
        /// What is wrong.
        problem: String,
    },
    /// The JSON is none, or describes no glTF.
    #[error("{problem}; the document is damaged: export it again")]
    Json {
        /// Line of the JSON, from 1.
        line: usize,
        /// What is wrong, with line and column.
        problem: String,
    },
    /// Another version.
    #[error("this is glTF {0}; planish reads glTF 2.0: export it as that")]
    Version(String),
    /// The geometry is compressed, or otherwise told in a way that planish does not read.
    #[error("the document needs the extension {0}, which planish does not read; export it without it (uncompressed)")]
    Extension(String),
    /// A buffer lies where planish does not look.
    #[error(
        "buffers[{buffer}].uri is \"{uri}\": nothing is opened but files beside the document, by their plain names; put \
         the data beside it, or embed it (.glb)"
    )]
    Uri {
        /// Which buffer.
        buffer: usize,
        /// Its address, shortened.
        uri: String,
    },
    /// The file of a buffer is not there, or cannot be read.
    #[error("buffers[{buffer}] lies in another file: {problem}; put it beside the document, or embed it (.glb)")]
    Missing {
        /// Which buffer.
        buffer: usize,
        /// Why.
        problem: String,
    },
    /// Something is described that is not there, or makes no sense.
    #[error("{location}: {problem}; the document is damaged: export it again")]
    Broken {
        /// The place in the document, as `accessors[3]`.
        location: String,
        /// What is wrong.
        problem: String,
    },
    /// There is too much of something.
    #[error("{location}: {problem}; export the surface in parts")]
    TooMuch {
        /// The place in the document.
        location: String,
        /// Of what there is too much.
        problem: String,
    },
}

impl GltfError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Container { .. } | Self::Json { .. } | Self::Broken { .. } => Code::Malformed,
            Self::Version(_) | Self::Extension(_) => Code::UnsupportedFormat,
            Self::Uri { .. } => Code::ForeignFile,
            Self::Missing { .. } => Code::MissingFile,
            Self::TooMuch { .. } => Code::TooLarge,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        match self {
            Self::Container { byte, .. } => Some(format!("byte {byte}")),
            Self::Json { line, .. } => Some(format!("line {line}")),
            Self::Uri { buffer, .. } | Self::Missing { buffer, .. } => Some(format!("buffers[{buffer}]")),
            Self::Broken { location, .. } | Self::TooMuch { location, .. } => Some(location.clone()),
            Self::Version(_) => Some("asset.version".to_owned()),
            Self::Extension(_) => Some("extensionsRequired".to_owned()),
        }
    }
}

/// A part of the document that is broken.
fn broken(location: String, problem: impl ToString) -> GltfError {
    GltfError::Broken { location, problem: problem.to_string() }
}

/// Extensions that change nothing in the shape of the surface, or are read here.
const HARMLESS: [&str; 11] = [
    "ADOBE_materials_clearcoat_specular",
    "EXT_lights_image_based",
    "EXT_mesh_features",
    "EXT_structural_metadata",
    "KHR_animation_pointer",
    "KHR_lights_punctual",
    "KHR_mesh_quantization",
    "KHR_techniques_webgl",
    "KHR_texture_transform",
    "KHR_xmp",
    "KHR_xmp_json_ld",
];

/// Reads a glTF or GLB file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let parts = container::split(source.bytes)?;
    let (root, materials) = parse(parts.json)?;
    refuse_extensions(&root)?;
    let buffers = Buffers::load(&root, parts.binary, source)?;
    let scene = Scene::read(&root, &buffers, source)?;
    let mut notes = Notes::new(if parts.is_container { "glTF 2.0, binary container" } else { "glTF 2.0, JSON" });
    notes.units = Some("m".to_owned());
    scene.names.iter().for_each(|name| notes.name(name));
    scene.skipped.iter().for_each(|(kind, count)| notes.skip(kind, *count));
    let labels = labels(&root, &materials, &scene, source.labels)?;
    finish::content(scene.points, scene.triangles, labels, notes, &BadPoints::default())
}

/// The names of meshes, or of materials where these are asked for. Of several, those without a name are told by their number.
fn labels(
    root: &Root,
    materials: &[Option<String>],
    scene: &Scene,
    source: &LabelSource,
) -> Result<Labels, LabelError> {
    let by_material = labels::asked(["mesh", "material"].into_iter(), source)? == Some("material");
    let meshes: Vec<_> = root.meshes.iter().map(|mesh| mesh.name.clone()).collect();
    let (kind, names) = if by_material { ("material", materials) } else { ("mesh", &meshes[..]) };
    let number = |part: &Part| if by_material { part.material } else { Some(part.mesh) };
    let are_several = scene.parts.windows(2).any(|pair| number(&pair[0]) != number(&pair[1]));
    let mut labels = Labels::new(source);
    for part in &scene.parts {
        let number = number(part);
        let named = number.and_then(|i| names.get(i)?.clone());
        let by_number = number.filter(|_| are_several).map_or(String::new(), |i| format!("{kind}_{i}"));
        let label = labels.named(&named.unwrap_or(by_number));
        labels.fill(part.end, label);
    }
    Ok(labels)
}

/// The document, and the names of its materials.
fn parse(json: &[u8]) -> Result<(Root, Vec<Option<String>>), GltfError> {
    // Some containers are filled up with zeros instead of blanks.
    let end = json.iter().rposition(|b| *b != 0).map_or(0, |last| last + 1);
    let bare = json[..end].strip_prefix(b"\xef\xbb\xbf").unwrap_or(&json[..end]);
    let fail = |e: serde_json::Error| GltfError::Json { line: e.line(), problem: e.to_string() };
    let document = Document::new(bare).map_err(fail)?;
    match document.version() {
        Some(version) if version.split('.').next() != Some("2") => Err(GltfError::Version(escape(&version))),
        _ => Ok((Root::from_slice(&document.tidied()).map_err(fail)?, document.materials())),
    }
}

/// Refuses by name what the surface could not be read without.
fn refuse_extensions(root: &Root) -> Result<(), GltfError> {
    let is_about_materials = |name: &str| name.starts_with("KHR_materials_") || name.contains("texture");
    let foreign = |name: &&String| !HARMLESS.contains(&name.as_str()) && !is_about_materials(name);
    match root.extensions_required.iter().find(foreign) {
        Some(name) => Err(GltfError::Extension(escape(name))),
        None => Ok(()),
    }
}

/// Text of the document as it may be shown: short, on one line.
fn escape(text: &str) -> String {
    text.chars().take(80).collect::<String>().escape_debug().to_string()
}

#[cfg(test)]
mod tests;
