//! From the bytes of a file to a soup of triangles, by its name; and whether there is the memory for that surface.

use super::siblings::Folder;
use crate::formats::{self, Content, Fields, Kind, READ, Refusal, Source};
use crate::outcome::{Code, Reason};
use crate::settings::Settings;
use bytesize::ByteSize;
use planish_core::mesh::TriangleSoup;
use std::path::Path;

/// What an input takes per triangle from reading to writing, factors apart, whatever its format: 1250 to 1500 bytes were
/// measured for binary STL and PLY. No more than 430 of them are reached before the surface is cut into charts
/// (`cargo run --release --example decode -- --cut`), so that readers do not count.
pub const MEMORY_PER_TRIANGLE: u64 = 1500;

/// How often the values of arrays are in memory at most: as they are kept, and on all nodes of the surface, of which there are four
/// times as many as vertices, while an array is written.
const COPIES_OF_FIELDS: u64 = 5;

/// Decodes the bytes of the file at `path` by its extension; others may lie beside it in `folder`.
///
/// # Errors
/// The refusal, with the place and what to do.
pub fn decode(path: &Path, bytes: &[u8], settings: &Settings, folder: &Folder) -> Result<Content, Refusal> {
    let refuse = |code, message: String| Err(Reason::at(code, message, Some("file name".to_owned())).into());
    match formats::kind(path) {
        Kind::Mesh(format) => {
            let sizes = settings.size_from.as_deref();
            let (limits, labels) = (&settings.limits, &settings.labels);
            let source = Source { bytes, limits, beside: folder, labels, sizes, keeps_fields: true };
            formats::read_or_tell(format, &source)
        }
        Kind::OtherMesh(e) => refuse(
            Code::UnsupportedFormat,
            format!("this version does not read .{e}; convert the file to one of {READ}"),
        ),
        Kind::NoMesh => refuse(Code::NotAMesh, format!("a file of this name holds no mesh; name one of {READ}")),
        Kind::Unknown(e) if e.is_empty() => refuse(
            Code::UnknownExtension,
            format!("the file name has no extension; rename the file to end in one of {READ}, whichever it is"),
        ),
        Kind::Unknown(e) => refuse(
            Code::UnknownExtension,
            format!("the extension .{e} is not known; rename or convert the file to one of {READ}"),
        ),
    }
}

/// Whether there is the memory that a surface and its fields will take.
///
/// # Errors
/// The refusal of one that takes more than an input may, or than there is.
pub fn check_memory(soup: &TriangleSoup, fields: &Fields, settings: &Settings) -> Result<(), Reason> {
    let of_surface = MEMORY_PER_TRIANGLE.saturating_mul(soup.triangles().len() as u64);
    let needed = of_surface.saturating_add(fields.bytes().saturating_mul(COPIES_OF_FIELDS));
    let (limit, remedy) = match settings.job_memory {
        Some(limit) if limit <= settings.machine_memory => (limit, "raise job-memory"),
        _ => (settings.machine_memory, "give the machine, or its container, more memory"),
    };
    if needed <= limit {
        return Ok(());
    }
    let [needed, limit] = [needed, limit].map(ByteSize::b);
    let message =
        format!("it takes {needed} of memory or more, and there are {limit}: split or decimate it, or {remedy}");
    Err(Reason::new(Code::JobMemory, message))
}
