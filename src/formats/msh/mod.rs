//! MSH, the format of Gmsh: versions 2.0 to 2.2, 4.0 and 4.1, ASCII and binary, in either order of bytes.
//!
//! The triangles and quads of all entities together are the surface. Elements of higher order are taken by their
//! corners: the nodes in the middle of edges and faces are left out and counted. Points, lines and elements of volumes
//! are counted by kind. Physical groups of surfaces are labels, and their names are told; views of nodes and elements are
//! fields, and one of nodes tells sizes, if it is asked for; all other sections are passed over.

mod elements;
mod fields;
mod groups;
mod nodes;
mod plain;
mod sections;
mod shapes;
mod sparse;
mod surface;
mod values;
mod views;

use super::location::{Location, escape};
use super::words::{Words, float};
use super::{Content, Limits, Notes, Patches, ReadError, Source, TooMany};
use crate::outcome::Code;
use crate::settings::LabelSource;
use fields::Kept;
use groups::Groups;
use memchr::memmem;
use nodes::Nodes;
use surface::Surface;
use values::{Binary, SectionError, Text, Values};
use views::Views;

/// Why bytes are no MSH file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum MshError {
    /// The first section is another.
    #[error("the file begins with \"{begins}\", not with \"$MeshFormat\": it is no MSH file; save it again with Gmsh")]
    NotMsh {
        /// What it begins with.
        begins: String,
    },
    /// A version that is not read.
    #[error(
        "this is version {version} of MSH, and planish reads 2.0 to 2.2, 4.0 and 4.1: convert the file with \"gmsh FILE -save -save_all -format msh41 -o NEW.msh\""
    )]
    Version {
        /// The version found.
        version: String,
        /// The line that tells it.
        line: usize,
    },
    /// A format line that makes no sense.
    #[error("line {line}: {problem}; save the file again with Gmsh")]
    Format {
        /// The line.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// There are fewer bytes than the declared records take.
    #[error(
        "{location}: {count} {what} are declared ({needed} bytes at least), but only {left} bytes follow; the file was cut off or the number is wrong: copy or save it again"
    )]
    Count {
        /// Nodes or elements.
        what: &'static str,
        /// How many are declared.
        count: u64,
        /// Bytes they need at least.
        needed: u64,
        /// Bytes there are.
        left: u64,
        /// Where they are declared.
        location: Location,
    },
    /// The blocks of a section hold more or fewer records than it declares.
    #[error("{location}: {count} {what} are declared, but the blocks hold {found}; save the file again with Gmsh")]
    Sum {
        /// Nodes or elements.
        what: &'static str,
        /// How many are declared.
        count: u64,
        /// How many there are, so far at least.
        found: u64,
        /// Where that shows.
        location: Location,
    },
    /// There are more than may be.
    #[error(transparent)]
    TooMany(#[from] TooMany),
    /// The file ends in the middle of a section.
    #[error(
        "{location}: the file ends in section ${section}; it was cut off or a number in it is wrong: copy or save it again"
    )]
    Truncated {
        /// The section.
        section: String,
        /// Where the file ends.
        location: Location,
    },
    /// A section ends in the middle.
    #[error(
        "{location}: section ${section} ends before all that it declares is there; correct its numbers or save the file again with Gmsh"
    )]
    Short {
        /// The section.
        section: String,
        /// Where it ends.
        location: Location,
    },
    /// A value is not what it should be.
    #[error("{location}: {problem}, in section ${section}; correct it or save the file again with Gmsh")]
    Value {
        /// The section.
        section: String,
        /// What is wrong.
        problem: String,
        /// Where.
        location: Location,
    },
    /// A section goes on behind its declared records.
    #[error(
        "{location}: section ${section} goes on with \"{found}\" behind all that it declares; correct its numbers or save the file again with Gmsh"
    )]
    NoEnd {
        /// The section.
        section: String,
        /// What there is in the place of its end.
        found: String,
        /// Where.
        location: Location,
    },
    /// A section is missing, or comes too late.
    #[error("there is no section ${section}{}; save the file again with Gmsh", if *late { " before $Elements" } else { "" })]
    NoSection {
        /// The section.
        section: &'static str,
        /// Whether elements come without it.
        late: bool,
    },
    /// There are two sections where there may be one.
    #[error("{location}: there is another section ${section}; split the file, one mesh in each")]
    SecondSection {
        /// The section.
        section: String,
        /// Where it begins.
        location: Location,
    },
    /// Two nodes have the same tag.
    #[error("there are two nodes {node}; renumber the mesh, or save it again with Gmsh")]
    SameNode {
        /// The tag.
        node: u64,
    },
    /// An element of a type that is not known.
    #[error("{location}: {number} is no type of elements that planish knows; save the mesh without them")]
    NoType {
        /// The number of the type.
        number: i64,
        /// Where.
        location: Location,
    },
    /// An element names a node that does not exist.
    #[error(
        "{location}: element {element} names node {node}, and there is none of this tag; save the file again with Gmsh"
    )]
    NoNode {
        /// The tag of the element.
        element: u64,
        /// The tag of the node.
        node: u64,
        /// Where the nodes of the element are.
        location: Location,
    },
}

impl MshError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Count { .. } | Self::Sum { .. } | Self::Truncated { .. } => Code::CountMismatch,
            Self::Short { .. } | Self::NoEnd { .. } => Code::CountMismatch,
            Self::TooMany(_) => Code::TooLarge,
            Self::Version { .. } => Code::UnsupportedFormat,
            _ => Code::Malformed,
        }
    }

    pub(super) fn location(&self) -> Option<String> {
        match self {
            Self::NotMsh { .. } => Some(Location::Line(1).to_string()),
            Self::Version { line, .. } | Self::Format { line, .. } => Some(Location::Line(*line).to_string()),
            Self::TooMany(_) | Self::NoSection { .. } => None,
            Self::SameNode { node } => Some(format!("node {node}")),
            Self::Count { location, .. }
            | Self::Sum { location, .. }
            | Self::Truncated { location, .. }
            | Self::Short { location, .. }
            | Self::Value { location, .. }
            | Self::NoEnd { location, .. }
            | Self::SecondSection { location, .. }
            | Self::NoType { location, .. }
            | Self::NoNode { location, .. } => Some(location.to_string()),
        }
    }
}

/// The versions that are read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    Two,
    /// 4.0, in which tags are ints.
    FourZero,
    Four,
}

/// Reads an MSH file.
pub(super) fn read(source: &Source) -> Result<Content, ReadError> {
    let keep = if *source.labels == LabelSource::Ignored { Keep::Corners } else { Keep::Owners };
    let Mesh { surface, groups, views, kept, mut notes } =
        mesh(source, keep, Views::new(source.sizes), Kept::new(source))?;
    let labels = groups.labels(surface.owners(), source.labels, &mut notes)?;
    let sizes = views.sizes(&mut notes)?;
    let fields = kept.map(|kept| kept.finish(surface.elements(), &mut notes)).unwrap_or_default();
    surface.finish(labels, sizes, fields, notes)
}

/// Reads an MSH file with the entities of its triangles, and the nodes in the middle of their sides.
pub(super) fn read_patches(source: &Source) -> Result<Patches, ReadError> {
    let Mesh { surface, notes, .. } = mesh(source, Keep::Patches, Views::default(), None)?;
    surface.finish_patches(notes)
}

/// What is kept of triangles beside their corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Keep {
    /// Nothing.
    #[default]
    Corners,
    /// Their entities and physical groups.
    Owners,
    /// Their entities, and the nodes in the middle of their sides.
    Patches,
}

/// What an MSH file holds.
struct Mesh<'n> {
    surface: Surface<'n>,
    groups: Groups,
    views: Views,
    kept: Option<Kept<'n>>,
    notes: Notes,
}

/// Reads the triangles of an MSH file.
fn mesh<'n>(source: &Source<'n>, keep: Keep, views: Views, kept: Option<Kept<'n>>) -> Result<Mesh<'n>, ReadError> {
    let mut words = Words::new(source.bytes, 1);
    let mut begins = words.next().unwrap_or_default();
    while begins == b"$Comments" {
        let mut text = Text(words);
        let fail = || MshError::Truncated { section: "Comments".to_owned(), location: Location::Line(words.line()) };
        text.until_end(b"Comments").ok_or_else(fail)?;
        words = text.0;
        begins = words.next().unwrap_or_default();
    }
    // Version 1 has no section for the format.
    if begins == b"$NOD" {
        return Err(MshError::Version { version: "1".to_owned(), line: words.line() }.into());
    }
    if begins != b"$MeshFormat" {
        return Err(MshError::NotMsh { begins: escape(begins) }.into());
    }
    let [name, encoding, size] = [words.next(), words.next(), words.next()].map(Option::unwrap_or_default);
    let line = words.line();
    let version = version(name, line)?;
    if size != b"8" {
        return Err(format_error(line, format!("numbers of {} bytes are not read, only of 8", escape(size))).into());
    }
    let name = escape(name);
    // Tags of elements are kept only where something asks for them.
    let keeps_elements = kept.is_some() && memmem::find(source.bytes, b"$ElementData").is_some();
    let found = Found { keep, views, kept, keeps_elements, ..Found::default() };
    match encoding {
        b"0" => body(Text(words), version, source.limits, found, Notes::new(format!("MSH {name}, ASCII"))),
        b"1" => {
            let (values, order) = binary(source.bytes, words)?;
            body(values, version, source.limits, found, Notes::new(format!("MSH {name}, binary, {order}")))
        }
        other => Err(format_error(line, format!("\"{}\" is neither 0 (ASCII) nor 1 (binary)", escape(other))).into()),
    }
}

fn format_error(line: usize, problem: String) -> MshError {
    MshError::Format { line, problem }
}

fn version(name: &[u8], line: usize) -> Result<Version, MshError> {
    match float(name) {
        Some(number) if (2.0..=2.2).contains(&number) => Ok(Version::Two),
        Some(4.0) => Ok(Version::FourZero),
        Some(4.1) => Ok(Version::Four),
        _ => Err(MshError::Version { version: escape(name), line }),
    }
}

/// The binary values after the format, and the order of their bytes, which the number 1 tells.
fn binary<'a>(file: &'a [u8], words: Words<'a>) -> Result<(Binary<'a>, &'static str), MshError> {
    let mut values = Binary { file, at: file.len() - words.rest().len(), big: false };
    values.end_line();
    match values.int() {
        Ok(1) => Ok((values, "little-endian")),
        Ok(0x0100_0000) => Ok((Binary { big: true, ..values }, "big-endian")),
        _ => Err(format_error(words.line(), "the number 1 does not follow, which tells the order of bytes".to_owned())),
    }
}

/// What was read so far.
#[derive(Default)]
struct Found<'n> {
    nodes: Option<Nodes>,
    surface: Option<Surface<'n>>,
    groups: Groups,
    views: Views,
    /// Fields; none where they are not wanted.
    kept: Option<Kept<'n>>,
    keep: Keep,
    keeps_elements: bool,
}

/// Reads all sections, from the end of the format on.
fn body<'a, 'n, V: Values<'a>>(
    mut values: V,
    version: Version,
    limits: &'n Limits,
    mut found: Found<'n>,
    mut notes: Notes,
) -> Result<Mesh<'n>, ReadError> {
    end_section(&mut values, b"MeshFormat")?;
    // Whatever stands between sections is a comment.
    while let Some(word) = values.word() {
        if let Some(name) = word.strip_prefix(b"$") {
            let section = escape(name);
            found
                .section(name, &mut values, version, limits, &mut notes)
                .map_err(|fault| told(fault, section, values.location()))?;
        }
    }
    match found.surface {
        Some(surface) => Ok(Mesh { surface, groups: found.groups, views: found.views, kept: found.kept, notes }),
        None => {
            let section = if found.nodes.is_some() { "Elements" } else { "Nodes" };
            Err(MshError::NoSection { section, late: false }.into())
        }
    }
}

/// What is wrong in a section, with its place.
fn told(fault: SectionError, section: String, location: Location) -> MshError {
    match fault {
        SectionError::End => MshError::Truncated { section, location },
        SectionError::Short => MshError::Short { section, location },
        SectionError::Value(problem) => MshError::Value { section, problem, location },
        SectionError::Told(error) => *error,
    }
}

impl<'n> Found<'n> {
    /// Reads a section, whose name was read.
    fn section<'a, V: Values<'a>>(
        &mut self,
        name: &[u8],
        values: &mut V,
        version: Version,
        limits: &'n Limits,
        notes: &mut Notes,
    ) -> Result<(), SectionError> {
        match (name, version) {
            // Once there is a surface, it has taken the nodes.
            (b"Nodes" | b"ParametricNodes", _) if self.nodes.is_some() || self.surface.is_some() => {
                return Err(second(name, values));
            }
            (b"Nodes", Version::Four) => self.nodes = Some(sections::nodes_4_1(values, limits)?),
            (b"Nodes", Version::FourZero) => self.nodes = Some(sections::nodes_4_0(values, limits)?),
            (b"Nodes", Version::Two) => self.nodes = Some(sections::nodes_2(values, false, limits)?),
            (b"ParametricNodes", Version::Two) => self.nodes = Some(sections::nodes_2(values, true, limits)?),
            (b"Elements", _) if self.surface.is_some() => return Err(second(name, values)),
            (b"Elements", _) => {
                let nodes = self.nodes.take().ok_or(MshError::NoSection { section: "Nodes", late: true })?;
                let surface = self.surface.insert(Surface::new(nodes, limits, self.keep, self.keeps_elements));
                match version {
                    Version::Two => sections::elements_2(values, surface)?,
                    Version::FourZero => sections::elements_4_0(values, surface)?,
                    Version::Four => sections::elements_4_1(values, surface)?,
                }
                surface.sort_elements();
            }
            (b"PhysicalNames", _) => {
                let section = values.until_end(name).ok_or(SectionError::End)?;
                self.groups.names(section, notes);
                return Ok(());
            }
            (b"Entities", Version::FourZero | Version::Four) if self.keep == Keep::Owners => {
                let section = values.section(name).ok_or(SectionError::End)?;
                self.groups.entities(section, version);
                return Ok(());
            }
            (b"NodeData", _) if self.views.are_wanted() || self.kept.is_some() => {
                let section = values.section(name).ok_or(SectionError::End)?;
                let nodes = self.surface.as_ref().map(|surface| &surface.nodes).or(self.nodes.as_ref());
                if let Some(kept) = &mut self.kept {
                    kept.nodes(section.clone(), nodes)?;
                }
                if self.views.are_wanted() {
                    self.views.read(section, nodes)?;
                }
                return Ok(());
            }
            (b"ElementData", _) if self.kept.is_some() => {
                let section = values.section(name).ok_or(SectionError::End)?;
                if let Some(kept) = &mut self.kept {
                    kept.elements(section, self.surface.as_ref().and_then(Surface::elements))?;
                }
                return Ok(());
            }
            _ => {
                values.until_end(name).ok_or(SectionError::End)?;
                if let (b"ElementNodeData", Some(kept)) = (name, &mut self.kept) {
                    kept.pass_over();
                }
                return Ok(());
            }
        }
        Ok(end_section(values, name)?)
    }
}

fn second<'a>(name: &[u8], values: &impl Values<'a>) -> SectionError {
    MshError::SecondSection { section: escape(name), location: values.location() }.into()
}

/// Passes over the end of a section.
fn end_section<'a>(values: &mut impl Values<'a>, name: &[u8]) -> Result<(), MshError> {
    let section = escape(name);
    match values.word() {
        Some(word) if word.strip_prefix(b"$End") == Some(name) => Ok(()),
        Some(word) => Err(MshError::NoEnd { section, found: escape(word), location: values.location() }),
        None => Err(MshError::Truncated { section, location: values.location() }),
    }
}

#[cfg(test)]
mod tests;
