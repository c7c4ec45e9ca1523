//! What the first bytes of a file say about its format, where that is beyond doubt: files are given wrong extensions.

use super::words::{Words, integer};
use super::{Format, off};

/// How far a word that decides is looked for.
const FAR: usize = 1024;

/// The format that these bytes are in, whatever the file is called; none where they do not say so.
pub(super) fn sniff(bytes: &[u8]) -> Option<Format> {
    let head = &bytes[..bytes.len().min(FAR)];
    let text = head.strip_prefix(MARK).unwrap_or(head).trim_ascii_start();
    // Binary STL may begin with anything, and the words of OBJ are short: these come last.
    match text {
        _ if text.starts_with(b"ply\n") || text.starts_with(b"ply\r") => Some(Format::Ply),
        _ if text.starts_with(b"# vtk DataFile") => Some(Format::Vtk),
        _ if text.starts_with(b"$MeshFormat") => Some(Format::Msh),
        _ if is_word(text, "MeshVersionFormatted") => Some(Format::Medit),
        _ if is_off(text) => Some(Format::Off),
        _ if text.starts_with(b"glTF") => Some(Format::Gltf),
        _ if text.starts_with(b"{") && has(text, "\"asset\"") => Some(Format::Gltf),
        _ if is_vtk_xml(text) && has(text, "UnstructuredGrid") => Some(Format::Vtu),
        _ if is_vtk_xml(text) && has(text, "PolyData") => Some(Format::Vtp),
        _ if is_text_stl(text) => Some(Format::Stl),
        _ if is_binary_stl(bytes) => Some(Format::Stl),
        _ if is_obj(text) => Some(Format::Obj),
        _ => None,
    }
}

/// The mark that some editors put before text in UTF-8.
pub(super) const MARK: &[u8] = b"\xef\xbb\xbf";

/// What to do with a mesh in another format.
const CONVERT: &str = "convert it to one of those that planish reads, by Gmsh, MeshLab or meshio";

/// What a file is that no reader reads, and what to do, where the first bytes say so.
pub(super) fn foreign(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let head = &bytes[..bytes.len().min(FAR)];
    let page = head.strip_prefix(MARK).unwrap_or(head).trim_ascii_start().to_ascii_lowercase();
    match head {
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] => Some(("text in UTF-16", "save it as plain text (ASCII or UTF-8)")),
        [0x1f, 0x8b, 8, ..] => Some(("compressed by gzip", "unpack it first")),
        [b'P', b'K', 3, 4, ..] => Some(("a zip archive", "unpack it first")),
        [b'(', b'0' | b'1', b' ', ..] => Some(("a mesh of ANSYS Fluent", CONVERT)),
        // The number 1, which tells the order of bytes; the version; the keyword of the dimension.
        [1, 0, 0, 0, 1..=4, 0, 0, 0, 3, 0, 0, 0, ..] | [0, 0, 0, 1, 0, 0, 0, 1..=4, 0, 0, 0, 3, ..] => {
            Some(("a binary mesh of MEDIT (.meshb)", "save it as text (.mesh)"))
        }
        _ if page.starts_with(b"iso-10303-21") => {
            Some(("a STEP file and no mesh", "mesh it first, with Gmsh for example"))
        }
        _ if page.starts_with(b"<!doctype html") || page.starts_with(b"<html") => {
            Some(("a web page and no mesh", "download the file itself again"))
        }
        _ => None,
    }
}

/// Whether a word stands anywhere in a text, in any case.
fn has(text: &[u8], word: &str) -> bool {
    text.windows(word.len()).any(|part| part.eq_ignore_ascii_case(word.as_bytes()))
}

/// Whether a text is XML of VTK, of whatever data set.
fn is_vtk_xml(text: &[u8]) -> bool {
    text.starts_with(b"<") && has(text, "<VTKFile")
}

/// Whether a text is STL. Binary files may begin with the word, too: they hold zeros.
fn is_text_stl(text: &[u8]) -> bool {
    is_word(text, "solid") && has(text, "facet") && has(text, "vertex") && !text.contains(&0)
}

/// Whether there are exactly as many bytes as the count of a binary STL file says.
fn is_binary_stl(bytes: &[u8]) -> bool {
    // A header of 80 bytes, the number of triangles, and 50 bytes for each.
    let Some(count) = bytes.get(80..84).and_then(|count| count.first_chunk()) else { return false };
    let count = u32::from_le_bytes(*count);
    count > 0 && bytes.len() as u64 == 84 + 50 * u64::from(count)
}

/// Whether a keyword of OFF is there, and numbers or the word BINARY after it.
fn is_off(text: &[u8]) -> bool {
    let mut words = Words::new(text, 1).without_comments();
    let is_keyword = words.next().is_some_and(off::is_keyword);
    let next = words.next().unwrap_or_default();
    is_keyword && (integer(next).is_some() || next == b"BINARY")
}

/// The statements with which OBJ files begin.
const STATEMENTS: [&[u8]; 10] = [b"v", b"vn", b"vt", b"o", b"g", b"s", b"f", b"mtllib", b"usemtl", b"mg"];

/// Whether all complete lines are statements of OBJ, and one of them is a vertex.
fn is_obj(head: &[u8]) -> bool {
    // The last line may have been cut off by the look at the head only.
    let Some(end) = head.iter().rposition(|byte| *byte == b'\n') else { return false };
    let mut has_vertex = false;
    for line in head[..end].split(|byte| *byte == b'\n') {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        // An empty line is as good as a comment.
        let statement = words.next().unwrap_or(b"#");
        if !statement.starts_with(b"#") && !STATEMENTS.contains(&statement) {
            return false;
        }
        has_vertex |= statement == b"v" && words.count() >= 3;
    }
    has_vertex
}

/// Whether a text begins with this word, in any case.
fn is_word(text: &[u8], word: &str) -> bool {
    let end = text.get(word.len()).is_none_or(u8::is_ascii_whitespace);
    end && text.get(..word.len()).is_some_and(|w| w.eq_ignore_ascii_case(word.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_beyond_doubt_is_recognised() {
        let binary = |count: u8, size: usize| {
            let mut bytes = vec![b' '; size];
            bytes.splice(80..84, [count, 0, 0, 0]);
            bytes
        };
        assert_eq!(
            [(2, 184), (2, 185), (0, 84)].map(|(n, size)| sniff(&binary(n, size))),
            [Some(Format::Stl), None, None]
        );
        let cases: [(&[u8], Option<Format>); 24] = [
            (b"ply\nformat ascii 1.0\n", Some(Format::Ply)),
            (b"# vtk DataFile Version 3.0\n", Some(Format::Vtk)),
            (b"$MeshFormat\n4.1 0 8\n", Some(Format::Msh)),
            (b"MeshVersionFormatted 2\n", Some(Format::Medit)),
            (b"OFF\n3 1 0\n", Some(Format::Off)),
            (b"STCNOFF # by hand\n\n3 1 0\n", Some(Format::Off)),
            (b"OFF BINARY\n\0\0", Some(Format::Off)),
            (b"off the record\n", None),
            (b"glTF\x02\0\0\0", Some(Format::Gltf)),
            (b" {\"asset\": {\"version\": \"2.0\"}}", Some(Format::Gltf)),
            (b"<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\">", Some(Format::Vtp)),
            (b"<VTKFile type=\"UnstructuredGrid\">", Some(Format::Vtu)),
            (b"SOLID a\n facet normal 0 0 1\n outer loop\n vertex 0 0 0", Some(Format::Stl)),
            (b"solid\0\0 facet vertex", None),
            (b"solids facet vertex", None),
            (b"v 0 0 0\nv 1 0 0\n", Some(Format::Obj)),
            (b"# by hand\r\n\r\nmtllib a.mtl\r\no a b\r\nv  0 0 0\r\nf", Some(Format::Obj)),
            (b"v 0 0 0", None),
            (b"v 0 0\nv 1 1\n", None),
            (b"v 0 0 0\nx 1 0 0\n", None),
            (b"plywood", None),
            (b"{\"a\": 1}", None),
            (b"<html>", None),
            (b"", None),
        ];
        for (bytes, format) in cases {
            assert_eq!(sniff(bytes), format, "{}", String::from_utf8_lossy(bytes));
        }
    }
}
