//! The data of a document, and views of them.

use super::{GltfError, Source, broken, escape};
use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use gltf::json::{Index, Root, buffer};
use std::borrow::Cow;

/// Some exporters leave out the padding at the end.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The data of all buffers.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    data: Vec<Cow<'a, [u8]>>,
}

impl<'a> Buffers<'a> {
    /// Loads all buffers: the one of the container, data in the document, files beside it.
    pub fn load(root: &'a Root, binary: Option<&'a [u8]>, source: &Source<'a>) -> Result<Self, GltfError> {
        let mut left = source.limits.file;
        let mut data = Vec::new();
        for (i, buffer) in root.buffers.iter().enumerate() {
            let bytes = match &buffer.uri {
                Some(uri) => Cow::Owned(fetch(uri, i, left, source)?),
                None if i == 0 => Cow::Borrowed(binary.unwrap_or_default()),
                None => Cow::Borrowed(&[][..]),
            };
            let declared = buffer.byte_length.0;
            if declared > bytes.len() as u64 {
                let problem = format!("{declared} bytes are declared, but there are {}", bytes.len());
                let is_beside = buffer.uri.as_ref().is_some_and(|uri| !uri.starts_with("data:"));
                if is_beside {
                    // It may not have been copied to its end yet.
                    return Err(GltfError::Missing { buffer: i, problem });
                }
                return Err(broken(format!("buffers[{i}]"), problem));
            }
            left = left.saturating_sub(bytes.len() as u64);
            data.push(bytes);
        }
        Ok(Self { root, data })
    }

    /// The bytes of a view, and the distance between its elements if it gives one.
    pub fn view(&self, view: Index<buffer::View>) -> Result<(&[u8], Option<usize>), GltfError> {
        let i = view.value();
        let fail = |problem: String| broken(format!("bufferViews[{i}]"), problem);
        let view = self.root.buffer_views.get(i).ok_or_else(|| fail("there is none".to_owned()))?;
        let data = self.data.get(view.buffer.value()).ok_or_else(|| fail("its buffer is not there".to_owned()))?;
        let from = view.byte_offset.map_or(0, |offset| offset.0);
        let length = view.byte_length.0;
        let Some(bytes) = part(data, from, length) else {
            return Err(fail(format!("bytes {from} and {length} more, of {}", data.len())));
        };
        // A stride of zero is none (glTF 2.0 has no such): elements are packed tightly.
        Ok((bytes, view.byte_stride.map(|stride| stride.0).filter(|stride| *stride > 0)))
    }
}

/// So many bytes from one on, if all of them are there.
fn part(data: &[u8], from: u64, length: u64) -> Option<&[u8]> {
    let rest = data.get(usize::try_from(from).ok()?..)?;
    rest.get(..usize::try_from(length).ok()?)
}

/// The bytes behind the address of a buffer.
fn fetch(uri: &str, buffer: usize, most: u64, source: &Source) -> Result<Vec<u8>, GltfError> {
    if let Some(data) = uri.strip_prefix("data:") {
        return embedded(data).ok_or_else(|| broken(format!("buffers[{buffer}].uri"), "no base64 data"));
    }
    let name = plain_name(uri).ok_or_else(|| GltfError::Uri { buffer, uri: escape(uri) })?;
    source.beside.read(&name, most).map_err(|problem| GltfError::Missing { buffer, problem })
}

/// What follows `data:`, if it is base64.
fn embedded(data: &str) -> Option<Vec<u8>> {
    let (kind, text) = data.split_once(',')?;
    if !kind.to_ascii_lowercase().ends_with(";base64") {
        return None;
    }
    BASE64.decode(text.trim()).ok()
}

/// The name of a file, if the address is nothing but that: no scheme, no folder but that of the document (`./`), nothing
/// hidden.
pub(super) fn plain_name(uri: &str) -> Option<String> {
    let decoded = percent_decoded(uri)?;
    let name = decoded.strip_prefix("./").unwrap_or(&decoded);
    let is_plain = !name.is_empty()
        && name.len() <= 255
        && !name.starts_with('.')
        && !name.contains(['/', '\\', ':', '\0'])
        && !name.chars().any(char::is_control);
    is_plain.then(|| name.to_owned())
}

/// `%20` is a blank.
fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, tail)) = rest.split_first() {
        rest = tail;
        if *first == b'%' {
            // Two digits: a sign, which the parser would take, is none.
            let digits = std::str::from_utf8(tail.get(..2)?).ok()?;
            if !digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
                return None;
            }
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &tail[2..];
        } else {
            bytes.push(*first);
        }
    }
    String::from_utf8(bytes).ok()
}
