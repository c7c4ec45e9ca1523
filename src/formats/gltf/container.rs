//! GLB: a header of twelve bytes, then chunks; the first holds the JSON, the second the first buffer.

use super::GltfError;

/// The first bytes of a container.
pub(super) const MAGIC: &[u8] = b"glTF";

/// The kind of the chunk with the document.
pub(super) const JSON: &[u8] = b"JSON";

/// The kind of the chunk with the data.
pub(super) const BINARY: &[u8] = b"BIN\0";

/// The parts of a file.
pub(super) struct Parts<'a> {
    /// The document.
    pub json: &'a [u8],
    /// The data that come with it.
    pub binary: Option<&'a [u8]>,
    /// Whether there is a container at all.
    pub is_container: bool,
}

/// Splits a file: a container by its chunks, anything else is JSON, whatever the file is called.
pub(super) fn split(bytes: &[u8]) -> Result<Parts<'_>, GltfError> {
    if !bytes.starts_with(MAGIC) {
        return Ok(Parts { json: bytes, binary: None, is_container: false });
    }
    let version = number(bytes, 4)?;
    if version != 2 {
        return Err(GltfError::Version(version.to_string()));
    }
    let declared = number(bytes, 8)? as usize;
    if declared > bytes.len() {
        let problem = format!("the header declares {declared} bytes, but there are {}", bytes.len());
        return Err(GltfError::Container { byte: 8, problem });
    }
    let bytes = &bytes[..declared];
    let (json, next) = chunk(bytes, 12, JSON)?
        .ok_or_else(|| GltfError::Container { byte: 12, problem: "the first chunk is no JSON".to_owned() })?;
    // Chunks of other kinds may come behind.
    let binary = if next < bytes.len() { chunk(bytes, next, BINARY)?.map(|(data, _)| data) } else { None };
    Ok(Parts { json, binary, is_container: true })
}

/// The chunk at `at` and where the next one begins, if it is of this kind.
fn chunk<'a>(bytes: &'a [u8], at: usize, kind: &[u8]) -> Result<Option<(&'a [u8], usize)>, GltfError> {
    let length = number(bytes, at)? as usize;
    // Behind the length and the kind, four bytes each.
    let data = bytes.get(at + 8..).and_then(|rest| rest.get(..length));
    let Some(data) = data else {
        let room = bytes.len().saturating_sub(at + 8);
        let problem = format!("a chunk declares {length} bytes, but {room} are left");
        return Err(GltfError::Container { byte: at, problem });
    };
    Ok((&bytes[at + 4..at + 8] == kind).then_some((data, at + 8 + length)))
}

/// The number of four bytes at `at`.
fn number(bytes: &[u8], at: usize) -> Result<u32, GltfError> {
    match bytes.get(at..).and_then(|rest| rest.first_chunk()) {
        Some(four) => Ok(u32::from_le_bytes(*four)),
        None => Err(GltfError::Container { byte: bytes.len(), problem: "the file ends in a header".to_owned() }),
    }
}
