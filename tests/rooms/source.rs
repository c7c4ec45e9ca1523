//! As much of the language as tells which paths a file names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The words and signs of a file, without comments, texts and the bodies of test modules.
pub struct Source {
    tokens: Vec<String>,
    /// Modules in files of their own that only tests see.
    test_modules: Vec<String>,
}

impl Source {
    /// The source of a file.
    pub fn new(text: &str) -> Self {
        let mut source = Self { tokens: tokens(text), test_modules: Vec::new() };
        source.drop_tests();
        source
    }

    /// Takes out what stands behind `#[cfg(test)]`.
    fn drop_tests(&mut self) {
        let marker = ["#", "[", "cfg", "(", "test", ")", "]"];
        while let Some(at) = self.tokens.windows(marker.len()).position(|window| window == marker) {
            let rest = &self.tokens[at..];
            let end = rest.iter().position(|token| token == ";" || token == "{").unwrap_or(rest.len() - 1);
            if rest[end] == ";" {
                let name = rest[..end].iter().rposition(|token| token == "mod").map(|m| rest[m + 1].clone());
                self.test_modules.extend(name);
                self.tokens.drain(at..=at + end);
            } else {
                let length = end + block(&rest[end..]);
                self.tokens.drain(at..at + length);
            }
        }
    }

    /// The files and folders of the modules of this file, `path`, that only tests see.
    pub fn test_files(&self, path: &Path) -> Vec<PathBuf> {
        let folder = match path.file_stem().and_then(|stem| stem.to_str()) {
            Some("mod" | "lib" | "main") => path.parent().map(Path::to_owned).unwrap_or_default(),
            _ => path.with_extension(""),
        };
        let both = |name: &String| [folder.join(name), folder.join(format!("{name}.rs"))];
        self.test_modules.iter().flat_map(both).collect()
    }

    /// Whether a path begins with this name.
    pub fn names(&self, name: &str) -> bool {
        let is_begin = |at: usize| at == 0 || self.tokens[at - 1] != "::";
        (0..self.tokens.len()).any(|at| self.tokens[at] == name && is_begin(at) && self.next_is(at + 1, "::"))
    }

    /// Whether a path like `std::fs` is named, be it in a group.
    pub fn holds_path(&self, path: &str) -> bool {
        match path.split_once("::") {
            Some((first, second)) => self.paths_of(first).iter().any(|name| name == second),
            None => self.names(path),
        }
    }

    /// The names that come next behind this one, in paths and in groups of them: `*`, too.
    pub fn paths_of(&self, first: &str) -> Vec<String> {
        let is_begin = |at: usize| at == 0 || self.tokens[at - 1] != "::";
        let starts = (0..self.tokens.len()).filter(|at| self.tokens[*at] == first && is_begin(*at));
        starts.flat_map(|at| self.heads(at + 1)).collect()
    }

    /// The names that stand behind enough `super` in this file, `path`, to lead to the root of the crate.
    pub fn paths_out_of(&self, path: &Path) -> Vec<String> {
        let last = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let depth = path.components().count() - usize::from(["mod", "lib", "main"].contains(&last));
        let mut found = Vec::new();
        let mut at = 0;
        while at < self.tokens.len() {
            let mut count = 0;
            while self.tokens[at..].starts_with(&["super".to_owned(), "::".to_owned()]) {
                (at, count) = (at + 2, count + 1);
            }
            if count > 0 && count >= depth {
                // The last two colons are before what follows.
                found.extend(self.heads(at - 1));
            }
            at += 1;
        }
        found
    }

    /// What the crate's root makes its own by `pub use`, and from which room.
    pub fn exports(&self) -> BTreeMap<String, String> {
        let mut exports = BTreeMap::new();
        let marker = ["pub", "use"];
        for at in (0..self.tokens.len()).filter(|at| self.tokens[*at..].starts_with(&marker.map(str::to_owned))) {
            let end = self.tokens[at..].iter().position(|token| token == ";").map_or(self.tokens.len(), |end| at + end);
            let Some(room) = self.tokens.get(at + 2) else { continue };
            let names = self.tokens[at + 3..end].iter().filter(|token| is_word(token));
            exports.extend(names.map(|name| (name.clone(), room.clone())));
        }
        exports
    }

    fn next_is(&self, at: usize, token: &str) -> bool {
        self.tokens.get(at).is_some_and(|found| found == token)
    }

    /// The first names of what follows two colons at this place.
    fn heads(&self, at: usize) -> Vec<String> {
        if !self.next_is(at, "::") {
            return Vec::new();
        }
        match self.tokens.get(at + 1).map(String::as_str) {
            Some("{") => self.heads_of_group(at + 1),
            Some(name) => vec![name.to_owned()],
            None => Vec::new(),
        }
    }

    /// The first names in a group: those at its beginning, and behind its own commas.
    fn heads_of_group(&self, open: usize) -> Vec<String> {
        let group = &self.tokens[open..open + block(&self.tokens[open..])];
        let (mut depth, mut heads) = (0, Vec::new());
        for pair in group.windows(2) {
            depth += usize::from(pair[0] == "{");
            depth -= usize::from(pair[0] == "}");
            let is_head = depth == 1 && (pair[0] == "," || pair[0] == "{");
            if is_head && (is_word(&pair[1]) || pair[1] == "*") {
                heads.push(pair[1].clone());
            }
        }
        heads
    }
}

/// The number of tokens from an opening brace to its partner.
fn block(tokens: &[String]) -> usize {
    let mut depth = 0;
    for (at, token) in tokens.iter().enumerate() {
        depth += i32::from(token == "{") - i32::from(token == "}");
        if depth == 0 {
            return at + 1;
        }
    }
    tokens.len()
}

fn is_word(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphanumeric() || c == '_')
}

/// Words, `::`, and every other sign by itself; no comments, texts or characters.
fn tokens(text: &str) -> Vec<String> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = if first.is_whitespace() {
            first.len_utf8()
        } else if let Some(length) = passed_over(rest) {
            length
        } else {
            let length = token(rest, first);
            tokens.push(rest[..length].to_owned());
            length
        };
        rest = &rest[length..];
    }
    tokens
}

fn token(rest: &str, first: char) -> usize {
    if is_word(rest) {
        return rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(rest.len());
    }
    if rest.starts_with("::") { 2 } else { first.len_utf8() }
}

/// The length of the comment, text or character that begins here.
fn passed_over(rest: &str) -> Option<usize> {
    if rest.starts_with("//") {
        return Some(rest.find('\n').unwrap_or(rest.len()));
    }
    if rest.starts_with("/*") {
        return Some(rest.find("*/").map_or(rest.len(), |end| end + 2));
    }
    let plain = rest.strip_prefix('b').unwrap_or(rest);
    let prefix = rest.len() - plain.len();
    let length = if plain.starts_with("r\"") || plain.starts_with("r#\"") || plain.starts_with("r##\"") {
        raw(plain)
    } else if plain.starts_with('"') {
        quoted(plain, '"')
    } else {
        character(plain)?
    };
    Some(prefix + length)
}

/// The length of a raw text.
fn raw(rest: &str) -> usize {
    let hashes = rest[1..].chars().take_while(|c| *c == '#').count();
    let end = format!("\"{}", "#".repeat(hashes));
    let open = 1 + end.len();
    rest[open..].find(&end).map_or(rest.len(), |at| open + at + end.len())
}

/// The length of a text between these marks, with escapes.
fn quoted(rest: &str, mark: char) -> usize {
    let mut is_escaped = false;
    for (at, c) in rest.char_indices().skip(1) {
        if c == mark && !is_escaped {
            return at + 1;
        }
        is_escaped = c == '\\' && !is_escaped;
    }
    rest.len()
}

/// The length of a character; none: it is the name of a lifetime, or something else.
fn character(rest: &str) -> Option<usize> {
    let inside = rest.strip_prefix('\'')?;
    let mut chars = inside.chars();
    let first = chars.next()?;
    if first == '\\' {
        return Some(quoted(rest, '\''));
    }
    (chars.next() == Some('\'')).then(|| 2 + first.len_utf8())
}
