//! The header of a PLY file: which elements there are, and what each of them holds.

use super::PlyError;
use super::binary::size_without_lists;
use crate::formats::location::escape;
pub use crate::formats::scalar::Scalar;
use crate::formats::words::Words;

/// Bytes of a header, elements, and properties of each, at most: far above what programs write, and little enough that
/// looking for equal names, each among all others, takes no time.
const HEADER: usize = 1 << 20;
const ELEMENTS: usize = 100;
const PROPERTIES: usize = 1000;

/// How values are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    Ascii,
    Little,
    Big,
}

impl Scalar {
    fn named(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            // Not in the specification; trimesh writes them for attributes.
            b"long" | b"int64" => Self::I64,
            b"ulong" | b"uint64" => Self::U64,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }
}

/// A value, or a list of values after their number.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Property {
    pub name: String,
    pub scalar: Scalar,
    /// The type of the number, for lists.
    pub count: Option<Scalar>,
}

/// Records of one kind.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Element {
    pub name: String,
    pub count: u64,
    pub properties: Vec<Property>,
    /// The line that declares it.
    pub line: usize,
}

impl Element {
    /// The position of a property.
    pub fn property(&self, names: &[&str]) -> Option<usize> {
        self.properties.iter().position(|p| names.contains(&p.name.as_str()))
    }

    /// Bytes of each record of a binary file, where there are no lists.
    pub fn stride(&self) -> Option<usize> {
        size_without_lists(&self.properties)
    }

    /// Bytes that all records take at least.
    pub fn needed(&self, encoding: Encoding) -> u64 {
        let mut record = 0;
        for property in &self.properties {
            record += match encoding {
                // A digit and a blank.
                Encoding::Ascii => 2,
                // A list may be empty: then there is its length alone.
                Encoding::Little | Encoding::Big => property.count.unwrap_or(property.scalar).size(),
            };
        }
        self.count.saturating_mul(record as u64)
    }
}

/// The header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    pub encoding: Encoding,
    pub elements: Vec<Element>,
    /// Where the values begin.
    pub end: usize,
    pub lines: usize,
}

impl Header {
    /// Reads the header.
    pub fn read(bytes: &[u8]) -> Result<Self, PlyError> {
        let mut lines = Lines::new(bytes);
        if lines.next().map(<[u8]>::trim_ascii) != Some(b"ply") {
            return Err(PlyError::NotPly { begins: escape(bytes) });
        }
        let (mut encoding, mut elements) = (None, Vec::new());
        while let Some(text) = lines.next() {
            let line = lines.number;
            let done = statement(text, line, &mut encoding, &mut elements);
            let problem = match (done, encoding) {
                (Ok(false), _) => continue,
                (Ok(true), Some(encoding)) => {
                    return Ok(Self { encoding, elements, end: lines.end, lines: line });
                }
                (Ok(true), None) => "the header ends without a format".to_owned(),
                (Err(problem), _) => problem,
            };
            return Err(PlyError::Header { line, problem });
        }
        Err(PlyError::HeaderEnds { line: lines.number, most: HEADER })
    }
}

/// Reads a line of the header; whether it is the last one.
fn statement(
    text: &[u8],
    line: usize,
    encoding: &mut Option<Encoding>,
    elements: &mut Vec<Element>,
) -> Result<bool, String> {
    let mut words = Words::new(text, line);
    match words.next().unwrap_or_default() {
        b"end_header" => return Ok(true),
        b"" | b"comment" | b"obj_info" => {}
        b"format" => *encoding = Some(format(&mut words)?),
        b"element" => {
            let element = element(&mut words, line)?;
            if elements.iter().any(|e| e.name == element.name) {
                return Err(format!("there are two elements {}", element.name));
            }
            elements.push(element);
        }
        b"property" => {
            let element = elements.last_mut().ok_or("there is a property before any element")?;
            let property = property(&mut words)?;
            if element.property(&[&property.name]).is_some() {
                return Err(format!("element {} has two properties {}", element.name, property.name));
            }
            element.properties.push(property);
        }
        other => return Err(format!("\"{}\" is no keyword of PLY headers", escape(other))),
    }
    if elements.len() > ELEMENTS || elements.iter().any(|e| e.properties.len() > PROPERTIES) {
        return Err(format!("there are more than {ELEMENTS} elements, or {PROPERTIES} properties of one"));
    }
    Ok(false)
}

fn format(words: &mut Words) -> Result<Encoding, String> {
    let (kind, version) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    if version != b"1.0" {
        return Err(format!("this is version \"{}\" of PLY, and planish reads version 1.0", escape(version)));
    }
    match kind {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::Little),
        b"binary_big_endian" => Ok(Encoding::Big),
        other => {
            Err(format!("\"{}\" is none of the formats ascii, binary_little_endian, binary_big_endian", escape(other)))
        }
    }
}

fn element(words: &mut Words, line: usize) -> Result<Element, String> {
    let name = escape(words.next().ok_or("an element has no name")?);
    let count = words.next().unwrap_or_default();
    let number = std::str::from_utf8(count).ok().and_then(|c| c.parse().ok());
    let count = number.ok_or_else(|| format!("element {name} has the count \"{}\"", escape(count)))?;
    Ok(Element { name, count, properties: Vec::new(), line })
}

fn property(words: &mut Words) -> Result<Property, String> {
    let mut word = || words.next().unwrap_or_default();
    let scalar = |word| Scalar::named(word).ok_or_else(|| format!("\"{}\" is no type of PLY files", escape(word)));
    let (count, kind) = match word() {
        b"list" => (Some(scalar(word())?), word()),
        kind => (None, kind),
    };
    if count.is_some_and(Scalar::is_float) {
        return Err("the length of a list is no whole number".to_owned());
    }
    let (scalar, name) = (scalar(kind)?, escape(word()));
    if name.is_empty() {
        return Err("a property has no name".to_owned());
    }
    Ok(Property { name, scalar, count })
}

/// The lines of a header. They end as the first one does: with a carriage return alone, or with a line feed.
struct Lines<'a> {
    bytes: &'a [u8],
    /// Whether the file goes on behind them.
    cut: bool,
    ends_with: u8,
    /// Where the next line begins, and the number of the last one.
    end: usize,
    number: usize,
}

impl<'a> Lines<'a> {
    fn new(bytes: &'a [u8]) -> Self {
        let (cut, bytes) = (bytes.len() > HEADER, &bytes[..bytes.len().min(HEADER)]);
        let first = bytes.iter().position(|b| [b'\n', b'\r'].contains(b)).unwrap_or(0);
        let pair = bytes.get(first + 1) == Some(&b'\n');
        let ends_with = if bytes.get(first) == Some(&b'\r') && !pair { b'\r' } else { b'\n' };
        Self { bytes, cut, ends_with, end: 0, number: 0 }
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    /// The next line, if it ends; the last one of a file that holds no values need not.
    fn next(&mut self) -> Option<&'a [u8]> {
        let rest = &self.bytes[self.end..];
        let end = rest.iter().position(|b| *b == self.ends_with);
        let length = end.or((!self.cut && !rest.is_empty()).then_some(rest.len()))?;
        self.end += (length + 1).min(rest.len());
        self.number += 1;
        Some(&rest[..length])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "ply\nformat ascii 1.0\n";

    #[test]
    fn all_types_and_lists_are_known() {
        let names = "char int8 uchar uint8 short int16 ushort uint16 int int32 uint uint32 long int64 ulong uint64 float float32 double float64";
        let lines: String =
            names.split(' ').map(|n| format!("property {n} a{n}\nproperty list uchar {n} b{n}\n")).collect();
        let text = format!("{HEAD}comment\nobj_info  x\nelement thing 3\n{lines}end_header\n1 2 3");
        let header = Header::read(text.as_bytes()).expect("a header");
        let [element] = &header.elements[..] else { panic!("{header:?}") };
        let sizes: Vec<usize> = element.properties.iter().map(|p| p.scalar.size()).step_by(2).collect();
        assert_eq!(sizes, [1, 1, 1, 1, 2, 2, 2, 2, 4, 4, 4, 4, 8, 8, 8, 8, 4, 4, 8, 8]);
        assert_eq!((element.count, element.line, element.stride(), header.lines), (3, 5, None, 46));
        assert_eq!(element.needed(Encoding::Little), 3 * (84 + 20));
        assert_eq!(&text[header.end..], "1 2 3");
    }

    #[test]
    fn lines_end_in_three_ways() {
        for end in ["\n", "\r\n", "\r"] {
            let text = format!("{HEAD}element vertex 1\nproperty float x\nend_header\n").replace('\n', end) + "\n\r";
            let header = Header::read(text.as_bytes()).unwrap_or_else(|e| panic!("{end:?}: {e}"));
            assert_eq!(&text[header.end..], "\n\r", "{end:?}");
            assert_eq!((header.elements.len(), header.elements[0].stride()), (1, Some(4)));
        }
    }

    #[test]
    fn broken_headers_are_refused_with_their_line() {
        let rows = [
            ("element\n", 3, "no name"),
            ("element vertex\n", 3, "count"),
            ("element vertex -1\n", 3, "-1"),
            ("element a 1\nelement a 1\n", 4, "two elements"),
            ("property float x\n", 3, "before any element"),
            ("element a 1\nproperty float\n", 4, "no name"),
            ("element a 1\nproperty half x\n", 4, "half"),
            ("element a 1\nproperty list float int x\n", 4, "length"),
            ("element a 1\nproperty list uchar int\n", 4, "no name"),
            ("element a 1\nproperty int x\nproperty int x\n", 5, "two properties"),
            ("format ascii 2.0\n", 3, "2.0"),
            ("format text 1.0\n", 3, "text"),
            ("nonsense\n", 3, "nonsense"),
        ];
        for (text, expected, word) in rows {
            match Header::read(format!("{HEAD}{text}end_header\n").as_bytes()) {
                Err(PlyError::Header { line, problem }) => {
                    assert!(line == expected && problem.contains(word), "{text}: {line}: {problem}");
                }
                other => panic!("{text}: {other:?}"),
            }
        }
        let formatless = Header::read(b"ply\nend_header\n");
        assert!(matches!(formatless, Err(PlyError::Header { line: 2, .. })), "{formatless:?}");
    }

    #[test]
    fn headers_without_end_and_other_files_are_refused() {
        assert!(matches!(Header::read(b"solid"), Err(PlyError::NotPly { .. })));
        assert!(matches!(Header::read(HEAD.as_bytes()), Err(PlyError::HeaderEnds { line: 2, .. })));
        let endless = format!("{HEAD}comment {}", "x".repeat(2 * HEADER));
        assert!(matches!(Header::read(endless.as_bytes()), Err(PlyError::HeaderEnds { line: 2, .. })));
        let long = format!("{HEAD}{}", "comment\n".repeat(HEADER));
        assert!(matches!(Header::read(long.as_bytes()), Err(PlyError::HeaderEnds { .. })));
        let many = format!("{HEAD}{}", "element a 1\n".repeat(3)).replace("a 1\nelement", "b 1\nelement");
        assert!(matches!(Header::read(many.as_bytes()), Err(PlyError::Header { line: 4, .. })));
        let crowd: String = (0..=ELEMENTS).map(|i| format!("element e{i} 0\n")).collect();
        let crowd = Header::read(format!("{HEAD}{crowd}").as_bytes());
        assert!(matches!(crowd, Err(PlyError::Header { line: 103, .. })), "{crowd:?}");
    }
}
