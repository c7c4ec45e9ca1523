//! Names of files, and words out of them, as they may be shown. Anybody may have chosen them: what steers a terminal,
//! ends a line, turns the direction of writing or cannot be seen is told by its number.

use std::fmt::Write;
use std::path::Path;

/// A message is cut after this many characters: what a file says can be as long as the file.
const LONGEST: usize = 2000;

/// A path, on one line and never that of another file: bytes that are no UTF-8 are told as `\xff`.
///
/// ```
/// use planish::system::escape::escape;
///
/// assert_eq!(escape("parts/wing 3's.stl".as_ref()), "parts/wing 3's.stl");
/// // One line stays one line, and a terminal is not steered.
/// assert_eq!(escape("a\nb.stl".as_ref()), r"a\nb.stl");
/// assert_eq!(escape("\x1b[31m.stl".as_ref()), r"\u{1b}[31m.stl");
/// // Never the name of another file: this one has a backslash and the letter n.
/// assert_eq!(escape(r"a\nb.stl".as_ref()), r"a\\nb.stl");
/// ```
pub fn escape(path: &Path) -> String {
    let mut told = String::new();
    for chunk in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        told += &escaped(chunk.valid(), &['\'', '"']);
        for byte in chunk.invalid() {
            // Writing to a string cannot fail.
            let _ = write!(told, "\\x{byte:02x}");
        }
    }
    told
}

/// A message, on one line, cut where it is too long.
pub fn printable(message: &str) -> String {
    let kept = message.char_indices().nth(LONGEST).map_or(message, |(end, _)| &message[..end]);
    let more = if kept.len() < message.len() { " ..." } else { "" };
    escaped(kept, &PLAIN) + more
}

/// A text of several lines.
pub fn printable_lines(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(|line| escaped(line, &PLAIN)).collect();
    lines.join("\n")
}

/// JSON that says the same, without characters that are not to be seen. These can stand in its strings only.
///
/// ```
/// use planish::system::escape::printable_json;
///
/// // U+202E would turn the direction of writing: "gpj.stl" would be shown as "lts.jpg".
/// let json = "{\"name\": \"\u{202e}gpj.stl\"}";
/// assert_eq!(printable_json(json), r#"{"name": "\u202egpj.stl"}"#);
/// ```
pub fn printable_json(json: &str) -> String {
    let mut told = String::with_capacity(json.len());
    for c in json.chars() {
        if is_seen(c) {
            told.push(c);
            continue;
        }
        // JSON escapes units of UTF-16: characters above U+FFFF take two.
        for unit in c.encode_utf16(&mut [0; 2]) {
            let _ = write!(told, "\\u{unit:04x}");
        }
    }
    told
}

/// Whether a character may stand in JSON that is shown: it ends no line within a string, and needs no escape.
fn is_seen(c: char) -> bool {
    // The common ones, quickly. Line feeds stand between values only: in strings JSON has escaped them.
    if c == '\n' || c.is_ascii_graphic() {
        return true;
    }
    let mut buffer = [0; 4];
    let character = c.encode_utf8(&mut buffer);
    // An escape is longer than what it stands for.
    escaped(character, &PLAIN).len() == character.len()
}

/// What the standard library escapes although it can be seen. Messages quote what is escaped already.
const PLAIN: [char; 3] = ['\'', '"', '\\'];

/// A text with escapes for all that is not to be seen, and for quotes and backslashes but the `plain` ones.
fn escaped(text: &str, plain: &[char]) -> String {
    let mut told = String::with_capacity(text.len());
    // Each piece ends with a plain character, but for the last one, which need not.
    for piece in text.split_inclusive(plain) {
        let kept = piece.chars().next_back().filter(|c| plain.contains(c));
        let others = &piece[..piece.len() - kept.map_or(0, char::len_utf8)];
        told.extend(others.escape_debug());
        told.extend(kept);
    }
    told
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_seen_is_told_by_its_number() {
        let names = [
            ("it's \"a\" part é.stl", "it's \"a\" part é.stl"),
            ("e\u{301}.stl", "e\u{301}.stl"),
            ("a\n\r\t\u{1b}[2J\u{7f}\u{9b}31m.stl", r"a\n\r\t\u{1b}[2J\u{7f}\u{9b}31m.stl"),
            ("\u{202e}gpj\u{200b}\u{2028}", r"\u{202e}gpj\u{200b}\u{2028}"),
            (r"\x41", r"\\x41"),
        ];
        for (name, told) in names {
            assert_eq!(escape(name.as_ref()), told);
        }
        assert_eq!(printable("unexpected \"\\u{1b}\"\n\u{1b}"), r#"unexpected "\u{1b}"\n\u{1b}"#);
        assert_eq!(printable_lines("a\n b\u{1b}\t"), "a\n b\\u{1b}\\t");
        assert_eq!(printable(&"ü".repeat(9999)).chars().count(), LONGEST + 4);
    }

    #[cfg(unix)]
    #[test]
    fn names_that_differ_are_shown_differently() {
        use std::os::unix::ffi::OsStrExt;
        let told = |bytes: &[u8]| escape(std::ffi::OsStr::from_bytes(bytes).as_ref());
        assert_eq!(
            [told(b"a\xff.stl"), told(b"a\xfe.stl"), told(b"a\\xff.stl")],
            ["a\\xff.stl", "a\\xfe.stl", "a\\\\xff.stl"]
        );
    }

    #[test]
    fn json_says_the_same() {
        let value = serde_json::json!({"a\u{7f}é\u{9b}": ["\u{202e}", "\u{e0001}😀", "\"\\\n'"]});
        for json in [value.to_string(), format!("{value:#}")] {
            let told = printable_json(&json);
            assert!(told.contains("é") && told.contains("\\u009b") && told.contains("😀") && told.contains("\\u202e"));
            assert_eq!(serde_json::from_str::<serde_json::Value>(&told).expect("JSON"), value);
        }
        assert_eq!(printable_json("{\n  \"a b\": 1\n}"), "{\n  \"a b\": 1\n}");
    }
}
