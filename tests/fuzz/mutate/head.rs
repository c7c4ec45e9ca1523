//! Where the head of a file ends: what a reader must understand before it comes to the data.

/// The first byte of `bytes` behind its head; a file in JSON is nothing but head. Where there is no head that makes sense,
/// all of it may be one.
pub fn end(bytes: &[u8]) -> usize {
    let behind = |mark: &[u8]| find(bytes, mark).map_or(bytes.len(), |at| at + mark.len());
    let end_of_line = |from: usize| line_end(bytes, from);
    match bytes {
        _ if bytes.starts_with(b"ply") => end_of_line(behind(b"end_header")),
        _ if bytes.starts_with(b"# vtk") => end_of_line(behind(b"DATASET")),
        _ if bytes.starts_with(b"$MeshFormat") => end_of_line(behind(b"$EndMeshFormat")),
        _ if bytes.starts_with(b"MeshVersionFormatted") => end_of_line(end_of_line(0)),
        _ if bytes.starts_with(b"OFF") || bytes.starts_with(b"STCNOFF") => end_of_line(0),
        _ if bytes.starts_with(b"<") => find(bytes, b"<Piece").map_or(bytes.len(), |at| tag_end(bytes, at)),
        _ if bytes.starts_with(b"glTF") => chunk_end(bytes, 12),
        _ if bytes.starts_with(b"{") => bytes.len(),
        _ if is_binary_stl(bytes) => 84,
        _ if bytes.starts_with(b"solid") => end_of_line(0),
        // OBJ has none.
        _ => 0,
    }
}

fn find(bytes: &[u8], mark: &[u8]) -> Option<usize> {
    bytes.windows(mark.len()).position(|w| w == mark)
}

fn line_end(bytes: &[u8], from: usize) -> usize {
    let rest = bytes.get(from..).unwrap_or_default();
    rest.iter().position(|b| *b == b'\n').map_or(bytes.len(), |at| from + at + 1)
}

fn tag_end(bytes: &[u8], from: usize) -> usize {
    bytes[from..].iter().position(|b| *b == b'>').map_or(bytes.len(), |at| from + at + 1)
}

/// Where the chunk of a GLB file ends that begins at `at`, with the head of the next one.
pub fn chunk_end(bytes: &[u8], at: usize) -> usize {
    let length = bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    (at + 16).saturating_add(length as usize).min(bytes.len())
}

/// Whether a file has the size that it declares in the way of STL.
pub fn is_binary_stl(bytes: &[u8]) -> bool {
    let count = bytes.get(80..84).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    count.is_some_and(|count| 84 + 50 * u64::from(count) == bytes.len() as u64)
}

#[test]
fn heads_end_where_data_begin() {
    let rest = |bytes: &'static [u8]| &bytes[end(bytes)..];
    assert_eq!(rest(b"ply\nformat ascii 1.0\nend_header\n1 2"), b"1 2");
    assert_eq!(rest(b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS"), b"POINTS");
    assert_eq!(rest(b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes"), b"$Nodes");
    assert_eq!(rest(b"MeshVersionFormatted 2\nDimension 3\nVertices"), b"Vertices");
    assert_eq!(rest(b"OFF 4 2 0\n0 0 0"), b"0 0 0");
    assert_eq!(rest(b"<VTKFile>\n<Piece NumberOfPoints=\"1\">\n</Piece>"), b"\n</Piece>");
    assert_eq!(rest(b"glTF\x02\0\0\0\x22\0\0\0\x04\0\0\0JSON{  }\x02\0\0\0BIN\0ab"), b"ab");
    assert_eq!(rest(b"solid a\nfacet"), b"facet");
    assert_eq!(rest(b"v 0 0 0"), b"v 0 0 0");
    assert_eq!(rest(b"{\"a\": 1}"), b"");
    assert_eq!(end(&[0; 84]), 84);
}
