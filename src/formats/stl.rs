//! STL, ASCII and binary.
//!
//! A file is binary when its size is that of its declared triangles (84 + 50 n bytes), whatever its header says:
//! some binary files begin with "solid". Otherwise it is ASCII when its first word is "solid", in any case and
//! after any blanks. ASCII files may hold several solids; all of them are read.

use super::ReadError;
use crate::outcome::Code;
use pipeline::mesh::TriangleSoup;

/// Bytes before the triangles of a binary file, and per triangle.
const HEADER: usize = 84;
const RECORD: usize = 50;

/// Why bytes are no STL file.
#[derive(Debug, PartialEq, Eq, thiserror::Error)]
pub enum StlError {
    /// Too short to hold a header, and not ASCII.
    #[error(
        "{size} bytes are too few for a binary STL (84 at least), and the file does not begin with \"solid\"; export it again"
    )]
    Short {
        /// Size of the file.
        size: usize,
    },
    /// The declared number of triangles does not fit the size of the file.
    #[error(
        "the header declares {declared} triangles ({needed} bytes), but the file has {size} bytes, room for {room}; it was cut off or is no STL: copy or export it again"
    )]
    Count {
        /// Triangles declared.
        declared: u32,
        /// Bytes they need.
        needed: u64,
        /// Bytes there are.
        size: usize,
        /// Whole triangles that fit.
        room: usize,
    },
    /// A coordinate of a binary file is not a number, or infinite.
    #[error("triangle {triangle} has the coordinate {value}; repair the exporting model")]
    BinaryNotFinite {
        /// The triangle, from 0.
        triangle: usize,
        /// Its first byte.
        byte: usize,
        /// The value, as text.
        value: String,
    },
    /// A coordinate of an ASCII file is not a number, or infinite.
    #[error("line {line} has the coordinate {value}; repair the exporting model")]
    AsciiNotFinite {
        /// The line, from 1.
        line: usize,
        /// The word found.
        value: String,
    },
    /// A line of an ASCII file makes no sense.
    #[error("line {line}: {problem}; correct it or export the file again, as binary STL if you can")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: String,
    },
    /// An ASCII file ends in the middle.
    #[error("the file ends at line {line} without \"endsolid\": it was cut off; copy or export it again")]
    Truncated {
        /// The last line.
        line: usize,
    },
}

impl StlError {
    pub(super) fn code(&self) -> Code {
        match self {
            Self::Count { .. } => Code::CountMismatch,
            Self::BinaryNotFinite { .. } | Self::AsciiNotFinite { .. } => Code::NotFinite,
            Self::Short { .. } | Self::Syntax { .. } | Self::Truncated { .. } => Code::Malformed,
        }
    }

    pub(super) fn place(&self) -> Option<String> {
        Some(match self {
            Self::Short { size } => format!("byte {size}"),
            Self::Count { .. } => "byte 80".to_owned(),
            Self::BinaryNotFinite { byte, .. } => format!("byte {byte}"),
            Self::AsciiNotFinite { line, .. } | Self::Syntax { line, .. } | Self::Truncated { line } => {
                format!("line {line}")
            }
        })
    }
}

/// Reads an STL file.
pub(super) fn read(bytes: &[u8]) -> Result<TriangleSoup, ReadError> {
    let declared = declared(bytes);
    let size_fits = declared.is_some_and(|n| needed(n) == bytes.len() as u64);
    let points = if size_fits {
        binary(&bytes[HEADER..])?
    } else if begins_with_solid(bytes) {
        ascii(bytes)?
    } else {
        return Err(mismatch(declared, bytes.len()).into());
    };
    let triangles = (0..points.len() as u32 / 3).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    Ok(TriangleSoup::new(points, triangles)?)
}

fn declared(bytes: &[u8]) -> Option<u32> {
    bytes.get(80..HEADER).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes)
}

fn needed(triangles: u32) -> u64 {
    HEADER as u64 + RECORD as u64 * u64::from(triangles)
}

fn mismatch(declared: Option<u32>, size: usize) -> StlError {
    match declared {
        None => StlError::Short { size },
        Some(declared) => StlError::Count { declared, needed: needed(declared), size, room: (size - HEADER) / RECORD },
    }
}

fn begins_with_solid(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"))
}

/// The corners of all triangles: three vectors of three little-endian floats after each normal.
fn binary(records: &[u8]) -> Result<Vec<[f64; 3]>, StlError> {
    let mut points = Vec::with_capacity(records.len() / RECORD * 3);
    for (triangle, record) in records.chunks_exact(RECORD).enumerate() {
        for corner in record[12..48].chunks_exact(12) {
            let coordinate =
                |k: usize| f32::from_le_bytes([corner[4 * k], corner[4 * k + 1], corner[4 * k + 2], corner[4 * k + 3]]);
            let point = [0, 1, 2].map(|k| f64::from(coordinate(k)));
            if let Some(value) = point.iter().find(|c| !c.is_finite()) {
                let byte = HEADER + RECORD * triangle;
                return Err(StlError::BinaryNotFinite { triangle, byte, value: value.to_string() });
            }
            points.push(point);
        }
    }
    Ok(points)
}

/// The corners of all triangles of all solids.
fn ascii(bytes: &[u8]) -> Result<Vec<[f64; 3]>, StlError> {
    let mut points: Vec<[f64; 3]> = Vec::new();
    let (mut line, mut in_solid) = (0, false);
    // Corners of the facet at hand; none outside of facets.
    let mut corners: Option<usize> = None;
    for text in bytes.split(|b| *b == b'\n') {
        line += 1;
        let mut words = text.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty());
        let Some(first) = words.next() else { continue };
        let problem = |problem: &str| StlError::Syntax { line, problem: problem.to_owned() };
        match (first.to_ascii_lowercase().as_slice(), corners) {
            (b"solid", None) => in_solid = true,
            (b"endsolid", None) => in_solid = false,
            (b"facet", None) if in_solid => corners = Some(0),
            (b"vertex", Some(n)) if n < 3 => {
                points.push(vertex(&mut words, line)?);
                corners = Some(n + 1);
            }
            (b"vertex", Some(_)) => return Err(problem("a facet has more than three vertices")),
            (b"outer" | b"endloop", Some(_)) => {}
            (b"endfacet", Some(3)) => corners = None,
            (b"endfacet", Some(n)) => return Err(problem(&format!("a facet ends after {n} vertices"))),
            _ => return Err(problem(&format!("unexpected \"{}\"", shown(first)))),
        }
    }
    if in_solid { Err(StlError::Truncated { line }) } else { Ok(points) }
}

/// The three numbers of a vertex line.
fn vertex<'a>(words: &mut impl Iterator<Item = &'a [u8]>, line: usize) -> Result<[f64; 3], StlError> {
    let mut point = [0.0; 3];
    for c in &mut point {
        let word = words.next().ok_or(StlError::Syntax { line, problem: "a vertex needs three numbers".to_owned() })?;
        let number = std::str::from_utf8(word).ok().and_then(|w| w.parse::<f64>().ok());
        *c = number.ok_or_else(|| StlError::Syntax { line, problem: format!("\"{}\" is no number", shown(word)) })?;
        if !c.is_finite() {
            return Err(StlError::AsciiNotFinite { line, value: shown(word) });
        }
    }
    match words.next() {
        Some(word) => Err(StlError::Syntax {
            line,
            problem: format!("\"{}\" follows the three numbers of a vertex", shown(word)),
        }),
        None => Ok(point),
    }
}

/// A word of the file as it may be shown: short, printable.
fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).escape_debug().to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facet(x: &str) -> String {
        format!("facet normal 0 0 1\nouter loop\nvertex {x} 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n")
    }

    fn binary_file(header: &[u8], declared: u32, triangles: &[[f32; 9]]) -> Vec<u8> {
        let mut bytes = vec![0; 80];
        bytes[..header.len()].copy_from_slice(header);
        bytes.extend(declared.to_le_bytes());
        for t in triangles {
            bytes.extend([0; 12]);
            t.iter().for_each(|c| bytes.extend(c.to_le_bytes()));
            bytes.extend([0; 2]);
        }
        bytes
    }

    const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

    fn error(bytes: &[u8]) -> StlError {
        match read(bytes) {
            Err(ReadError::Stl(e)) => e,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn all_solids_are_read_in_any_case_and_after_blanks() {
        let file =
            format!("  \n\tSOLID one\n{}ENDSOLID one\nsolid two\n{}endsolid", facet("0").to_uppercase(), facet("2"));
        let soup = read(file.as_bytes()).expect("two solids");
        assert_eq!((soup.triangles().len(), soup.points()[3]), (2, [2.0, 0.0, 0.0]));
        let windows = format!("solid\r\n{}endsolid\r\n", facet("0").replace('\n', "\r\n"));
        assert_eq!(read(windows.as_bytes()).expect("line ends").triangles().len(), 1);
    }

    #[test]
    fn binary_files_may_begin_with_solid() {
        for header in [&b""[..], b"solid but binary", b"solid\nfacet normal"] {
            let soup = read(&binary_file(header, 2, &[TRIANGLE; 2])).expect("binary");
            assert_eq!((soup.triangles().len(), soup.points()[1]), (2, [1.0, 0.0, 0.0]));
        }
    }

    #[test]
    fn count_and_size_must_agree() {
        let file = binary_file(b"", 3, &[TRIANGLE; 2]);
        assert_eq!(error(&file), StlError::Count { declared: 3, needed: 234, size: 184, room: 2 });
        assert!(matches!(error(&file[..100]), StlError::Count { room: 0, .. }));
        assert_eq!(error(b"abc"), StlError::Short { size: 3 });
    }

    #[test]
    fn broken_numbers_are_named_with_their_place() {
        let mut bad = TRIANGLE;
        bad[4] = f32::NAN;
        assert!(matches!(
            error(&binary_file(b"", 2, &[TRIANGLE, bad])),
            StlError::BinaryNotFinite { triangle: 1, byte: 134, .. }
        ));
        let ascii = |x| error(format!("solid\n{}endsolid", facet(x)).as_bytes());
        assert_eq!(ascii("inf"), StlError::AsciiNotFinite { line: 4, value: "inf".to_owned() });
        assert!(matches!(ascii("1,5"), StlError::Syntax { line: 4, .. }));
        assert!(matches!(ascii("1 2"), StlError::Syntax { line: 4, .. }));
    }

    #[test]
    fn cut_off_and_garbled_files_are_refused() {
        let whole = format!("solid\n{}endsolid", facet("0"));
        for end in 6..whole.len() - 8 {
            assert!(read(&whole.as_bytes()[..end]).is_err(), "cut at {end}");
        }
        assert!(matches!(error(b"solid\nvertex 0 0 0\nendsolid"), StlError::Syntax { line: 2, .. }));
        assert!(matches!(read(b"solid\nendsolid"), Err(ReadError::Soup(_))), "no triangles");
        assert!(matches!(read(&binary_file(b"", 0, &[])), Err(ReadError::Soup(_))), "no triangles");
    }
}
