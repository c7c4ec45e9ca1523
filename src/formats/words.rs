//! The words of a text file, without a copy of any.

/// What is left of a text, and the number of its line. Lines end with a line feed, a carriage return, or both.
#[derive(Clone, Copy)]
pub(super) struct Words<'a> {
    rest: &'a [u8],
    line: usize,
}

impl<'a> Words<'a> {
    /// A text that begins in a line, counted from 1.
    pub fn new(text: &'a [u8], line: usize) -> Self {
        Self { rest: text, line }
    }

    /// The text that is left.
    pub fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// The line of the last word.
    pub fn line(&self) -> usize {
        self.line
    }

    /// The next word.
    #[inline]
    pub fn next(&mut self) -> Option<&'a [u8]> {
        let mut at = 0;
        while let Some(byte) = self.rest.get(at).filter(|b| b.is_ascii_whitespace()) {
            let pair = *byte == b'\r' && self.rest.get(at + 1) == Some(&b'\n');
            self.line += usize::from(*byte == b'\n' || (*byte == b'\r' && !pair));
            at += 1;
        }
        let text = &self.rest[at..];
        let end = text.iter().position(u8::is_ascii_whitespace).unwrap_or(text.len());
        let (word, rest) = text.split_at(end);
        self.rest = rest;
        (!word.is_empty()).then_some(word)
    }

    /// Passes over so many bytes, which must end at a blank or the end.
    pub fn advance(&mut self, bytes: usize) {
        let end = self.rest.len() - bytes;
        while self.rest.len() > end && self.next().is_some() {}
    }

    /// The next word, if the line goes on.
    #[inline]
    pub fn next_in_line(&mut self) -> Option<&'a [u8]> {
        let mut ahead = *self;
        let word = ahead.next().filter(|_| ahead.line == self.line)?;
        *self = ahead;
        Some(word)
    }
}

/// The number that a word is.
#[inline]
pub(super) fn float(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The whole number that a word is.
#[inline]
pub(super) fn integer(word: &[u8]) -> Option<i64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_know_their_lines() {
        let mut words = Words::new(b"\n a b\r\nc\rd\n\n  e", 7);
        let mut found = Vec::new();
        while let Some(word) = words.next() {
            found.push((String::from_utf8_lossy(word).into_owned(), words.line()));
        }
        let expected = [("a", 8), ("b", 8), ("c", 9), ("d", 10), ("e", 12)];
        assert_eq!(found, expected.map(|(word, line)| (word.to_owned(), line)));
    }

    #[test]
    fn a_line_ends() {
        let mut words = Words::new(b"a b \r\n c", 1);
        assert_eq!([words.next(), words.next_in_line(), words.next_in_line()], [Some(&b"a"[..]), Some(b"b"), None]);
        assert_eq!((words.next(), words.line(), words.next_in_line()), (Some(&b"c"[..]), 2, None));
    }
}
