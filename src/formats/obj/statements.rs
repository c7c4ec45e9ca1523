//! The statements of an OBJ file that tell of vertices and faces, and of the names of parts. Nothing is copied.

use crate::formats::words::{comment, float};
use planish_core::mesh::TriangleSoup;
use std::io::{BufRead, Read, Result};

/// What a statement tells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The coordinates of a vertex.
    Vertex,
    /// The vertices of a face.
    Face,
    /// What the faces that follow are part of, by a name.
    Part(Part),
}

/// In which way a part has its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Group,
    Object,
    Material,
}

/// A vertex or face, or the name of a part.
#[derive(Clone, Copy)]
pub struct Statement<'a> {
    pub kind: Kind,
    /// Its (first) line in the file, from 1.
    pub line: usize,
    text: &'a [u8],
    ends_with: u8,
}

impl<'a> Statement<'a> {
    /// Its numbers: three coordinates, or the number of each vertex without those of its texture and normal.
    pub fn numbers(&self) -> impl Iterator<Item = &'a [u8]> + use<'a> {
        let (most, faces) = if self.kind == Kind::Vertex { (3, false) } else { (usize::MAX, true) };
        let numbers = words(self.text, self.ends_with).skip(1).take(most);
        numbers.map(move |word| if faces { word.split(|b| *b == b'/').next().unwrap_or_default() } else { word })
    }

    /// What follows its keyword: the name of a part.
    pub fn name(&self) -> String {
        let words: Vec<_> = words(self.text, self.ends_with).skip(1).map(String::from_utf8_lossy).collect();
        words.join(" ")
    }

    /// It without the end of the line.
    pub fn write(&self, line: &mut Vec<u8>) {
        line.push(if self.kind == Kind::Vertex { b'v' } else { b'f' });
        for number in self.numbers() {
            line.push(b' ');
            line.extend_from_slice(number);
        }
    }

    /// It as the library is to see it, where some coordinates of the file can be no corner's: they are replaced.
    fn write_sound(&self, line: &mut Vec<u8>) {
        let is_sound = |word: &[u8]| float(word).is_some_and(|c| as_shown(c) == c);
        if self.kind == Kind::Face || self.numbers().all(is_sound) {
            return self.write(line);
        }
        line.push(b'v');
        for number in self.numbers() {
            line.push(b' ');
            line.extend_from_slice(if is_sound(number) { number } else { b"0" });
        }
    }
}

/// A coordinate as the library is to see it: 0 where it can be no corner's.
pub fn as_shown(coordinate: f64) -> f64 {
    if TriangleSoup::may_hold(&[coordinate; 3]) { coordinate } else { 0.0 }
}

/// What a line says, without comment and blanks around; and whether the next one continues it.
fn content(line: &[u8]) -> (&[u8], bool) {
    let end = comment(line).unwrap_or(line.len());
    let line = line[..end].trim_ascii();
    line.strip_suffix(b"\\").map_or((line, false), |line| (line, true))
}

/// The words of some lines.
fn words(text: &[u8], ends_with: u8) -> impl Iterator<Item = &[u8]> {
    let of_line = |line| content(line).0.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
    text.split(move |b| *b == ends_with).flat_map(of_line)
}

/// The vertices, faces and names of parts of a file, in their order.
#[derive(Clone)]
pub struct Statements<'a> {
    rest: &'a [u8],
    line: usize,
    ends_with: u8,
}

impl<'a> Statements<'a> {
    /// The statements of a file. Lines end with a line feed, or all of them with a carriage return.
    pub fn new(file: &'a [u8]) -> Self {
        let ends_with = if file.contains(&b'\n') { b'\n' } else { b'\r' };
        Self { rest: file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file), line: 1, ends_with }
    }

    /// The next lines that belong together, and the number of the first.
    fn lines(&mut self) -> (usize, &'a [u8]) {
        let (all, first) = (self.rest, self.line);
        let mut length = 0;
        loop {
            let line = self.rest;
            let end = line.iter().position(|b| *b == self.ends_with).unwrap_or(line.len());
            length += end;
            self.rest = line.get(end + 1..).unwrap_or_default();
            self.line += 1;
            let (said, continued) = content(&line[..end]);
            if length == end && !continued {
                return (first, said);
            }
            if self.rest.is_empty() || !continued {
                return (first, &all[..length]);
            }
            length += 1;
        }
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        while !self.rest.is_empty() {
            let (line, text) = self.lines();
            let kind = match words(text, self.ends_with).next() {
                Some(b"v") => Kind::Vertex,
                // The old keyword "fo" means the same.
                Some(b"f" | b"fo") => Kind::Face,
                Some(b"g") => Kind::Part(Part::Group),
                Some(b"o") => Kind::Part(Part::Object),
                Some(b"usemtl") => Kind::Part(Part::Material),
                _ => continue,
            };
            return Some(Statement { kind, line, text, ends_with: self.ends_with });
        }
        None
    }
}

/// Statements as the library is to see them, one per line. They are made as they are read.
pub struct Plain<'a> {
    statements: Statements<'a>,
    line: Vec<u8>,
    at: usize,
    /// Whether all coordinates can be those of corners.
    is_sound: bool,
}

impl<'a> Plain<'a> {
    /// These statements, of which some have coordinates that can be no corner's.
    pub fn new(statements: Statements<'a>, has_bad: bool) -> Self {
        Self { statements, line: Vec::new(), at: 0, is_sound: !has_bad }
    }
}

impl BufRead for Plain<'_> {
    fn fill_buf(&mut self) -> Result<&[u8]> {
        if self.at == self.line.len() {
            self.line.clear();
            self.at = 0;
            let mut shown = self.statements.by_ref().filter(|s| matches!(s.kind, Kind::Vertex | Kind::Face));
            if let Some(statement) = shown.next() {
                if self.is_sound {
                    statement.write(&mut self.line);
                } else {
                    statement.write_sound(&mut self.line);
                }
                self.line.push(b'\n');
            }
        }
        Ok(&self.line[self.at..])
    }

    fn consume(&mut self, bytes: usize) {
        self.at += bytes;
    }
}

impl Read for Plain<'_> {
    fn read(&mut self, to: &mut [u8]) -> Result<usize> {
        let size = self.fill_buf()?.read(to)?;
        self.consume(size);
        Ok(size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statements_are_joined_and_stripped() {
        let file = "\u{feff}v 0 0 0 1 # one\ng a  b\n  f 1/2/3 \\\n 2//4 # \\\nvt 0 0\n\tfo 3 \\ # two\n\\\n4 \\";
        let mut plain = String::new();
        Plain::new(Statements::new(file.as_bytes()), false).read_to_string(&mut plain).expect("text");
        assert_eq!(plain, "v 0 0 0\nf 1 2\nf 3 4\n");
        let lines: Vec<usize> = Statements::new(file.as_bytes()).map(|s| s.line).collect();
        assert_eq!(lines, [1, 2, 3, 6]);
        let part = Statements::new(file.as_bytes()).nth(1).expect("the second");
        assert_eq!((part.kind, part.name().as_str()), (Kind::Part(Part::Group), "a b"));
        assert_eq!(Statements::new(b"v 1\rf 2\\\r3\r").map(|s| s.numbers().count()).collect::<Vec<_>>(), [1, 2]);
        assert_eq!(Statements::new(b"").count(), 0);
    }
}
