//! The words of a text file, without a copy of any.

use super::location::escape;

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

    /// Passes over so many bytes, which must end at a blank or the end, and behind a word.
    pub fn advance(&mut self, bytes: usize) {
        let (passed, rest) = self.rest.split_at(bytes);
        // A carriage return before a line feed ends no line of its own.
        let is_pair = |at: usize| passed[at] == b'\r' && passed.get(at + 1) == Some(&b'\n');
        self.line += memchr::memchr2_iter(b'\n', b'\r', passed).filter(|at| !is_pair(*at)).count();
        self.rest = rest;
    }

    /// Passes over the rest of the line.
    pub fn skip_line(&mut self) {
        let end = self.rest.iter().position(|b| [b'\n', b'\r'].contains(b)).unwrap_or(self.rest.len());
        self.rest = &self.rest[end..];
    }

    /// The same text, in which a line ends where `#` begins a comment.
    pub fn without_comments(self) -> Uncommented<'a> {
        Uncommented(self)
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

/// Where a comment begins in a line or word. (In `1.#QNAN` and `1.#IND` none does.)
pub(super) fn comment(text: &[u8]) -> Option<usize> {
    for (at, byte) in text.iter().enumerate() {
        if *byte == b'#' && !is_in_number(text, at) {
            return Some(at);
        }
    }
    None
}

/// Whether the `#` at a byte belongs to what Microsoft's libraries write for a number that is none.
fn is_in_number(text: &[u8], at: usize) -> bool {
    text[..at].ends_with(b"1.") && text.get(at + 1).is_some_and(|next| b"IQS".contains(next))
}

/// The words of a text with comments, which begin with `#` and end with their line.
#[derive(Clone, Copy)]
pub(super) struct Uncommented<'a>(Words<'a>);

impl<'a> Uncommented<'a> {
    /// The text that is left.
    pub fn rest(&self) -> &'a [u8] {
        self.0.rest
    }

    /// The line of the last word.
    pub fn line(&self) -> usize {
        self.0.line
    }

    /// Passes over the rest of the line.
    pub fn skip_line(&mut self) {
        self.0.skip_line();
    }

    /// The next word.
    #[inline]
    pub fn next(&mut self) -> Option<&'a [u8]> {
        loop {
            let word = self.0.next()?;
            let Some(end) = comment(word) else { return Some(word) };
            self.0.skip_line();
            if end > 0 {
                return Some(&word[..end]);
            }
        }
    }
}

/// The number that a word is. Those that Microsoft's libraries write for what is none are none.
#[inline]
pub(super) fn float(word: &[u8]) -> Option<f64> {
    let number = std::str::from_utf8(word).ok().and_then(|word| word.parse().ok());
    number.or_else(|| is_undefined(word).then_some(f64::NAN))
}

/// Whether a word is what Microsoft's libraries write for a number that is none, as in the normal of a triangle without
/// area: `-nan(ind)`, `-1.#IND`, `1.#QNAN00e+000`.
#[cold]
fn is_undefined(word: &[u8]) -> bool {
    let word = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word).to_ascii_lowercase();
    word.starts_with(b"nan(") || word.starts_with(b"1.#")
}

/// That a word is no number, and how it could become one.
pub(super) fn no_number(word: &[u8]) -> String {
    format!("\"{}\" is no number{}", escape(word), remedy(word))
}

/// What follows where it is told that a word is no number: how it could become one, if that is known.
pub(super) fn remedy(word: &[u8]) -> String {
    foreign_number(word).map_or(String::new(), |(what, remedy)| format!(", it {what}: {remedy}"))
}

/// In which way of writing a word is a number, which is no other than that of text files, and what to do.
pub(super) fn foreign_number(word: &[u8]) -> Option<(&'static str, &'static str)> {
    // Longer words are no numbers that anybody writes.
    let text = std::str::from_utf8(word).ok().filter(|text| text.len() < 64 && text.parse::<f64>().is_err())?;
    if text.contains(',') && is_number(&text.replacen(',', ".", 1)) {
        return Some(("has a decimal comma", "export with a point as decimal separator"));
    }
    // FORTRAN writes 1.0D+03, and 1.0+103 where the exponent has three digits.
    let with_letter = text.replacen(['D', 'd', 'Q', 'q'], "e", 1);
    if is_number(&with_letter) || with_exponent(text).is_some_and(|text| is_number(&text)) {
        return Some(("has a Fortran exponent", "export with exponents of E, as 1.0E+03"));
    }
    None
}

/// Whether a text is a number of digits. (`inf` and `nan` are numbers, too.)
fn is_number(text: &str) -> bool {
    text.bytes().any(|byte| byte.is_ascii_digit()) && text.parse::<f64>().is_ok()
}

/// A text with the letter of an exponent before the sign that follows a digit, if there is one: `1.0e+103` for `1.0+103`.
fn with_exponent(text: &str) -> Option<String> {
    let sign = text.rfind(['+', '-'])?;
    let follows_digit = sign > 0 && text.as_bytes()[sign - 1].is_ascii_digit();
    follows_digit.then(|| format!("{}e{}", &text[..sign], &text[sign..]))
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
    fn what_is_passed_over_has_lines() {
        let text = b"\n a b\r\nc\rd\n\n  e f";
        let mut words = Words::new(text, 7);
        words.advance(text.len() - 2);
        assert_eq!((words.line(), words.next(), words.next()), (12, Some(&b"f"[..]), None));
    }

    #[test]
    fn a_line_ends() {
        let mut words = Words::new(b"a b \r\n c", 1);
        assert_eq!([words.next(), words.next_in_line(), words.next_in_line()], [Some(&b"a"[..]), Some(b"b"), None]);
        assert_eq!((words.next(), words.line(), words.next_in_line()), (Some(&b"c"[..]), 2, None));
    }

    #[test]
    fn comments_end_with_their_line() {
        let mut words = Words::new(b"a#b c\n# d\r\n-1.#IND # f\rg", 1).without_comments();
        let mut found = Vec::new();
        while let Some(word) = words.next() {
            found.push((word, words.line()));
        }
        assert_eq!(found, [(&b"a"[..], 1), (b"-1.#IND", 3), (b"g", 4)]);
    }

    #[test]
    fn numbers_of_other_habits_are_told() {
        let told = |word: &str| foreign_number(word.as_bytes()).map(|(what, _)| what);
        for word in ["0,5", "-1,25e-3", "1,", ",5"] {
            assert_eq!(told(word), Some("has a decimal comma"), "{word}");
        }
        for word in ["1.0D+03", "-.5d0", "1.5+300", "-2.25-101", "1Q3"] {
            assert_eq!(told(word), Some("has a Fortran exponent"), "{word}");
        }
        for word in ["x", ",", "1,2,3", "d", "D5", "1-", "in,f", "0x10", "1.5", "\u{e9}+1"] {
            assert_eq!(told(word), None, "{word}");
        }
        assert!(float(b"-1.#IND").is_some_and(f64::is_nan) && float(b"nan(ind)").is_some_and(f64::is_nan));
        assert_eq!(
            no_number(b"0,5"),
            "\"0,5\" is no number, it has a decimal comma: export with a point as decimal separator"
        );
        assert_eq!(no_number(b"x"), "\"x\" is no number");
    }
}
