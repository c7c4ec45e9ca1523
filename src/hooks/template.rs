//! Arguments with placeholders: `{folder}/remesh.geo` becomes a path when a command is to run.
//!
//! Paths are filled in as the system knows them: names that are no UTF-8 arrive unharmed. What is filled in is never
//! looked at again, so braces in names mean nothing.

use super::{Occasion, Target};
use crate::formats::gmsh;
use crate::report;
use std::ffi::OsString;
use std::path::Path;

/// What a placeholder stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// The input file.
    Input,
    /// Its name.
    Name,
    /// The result folder.
    Folder,
    /// Why the input is refused or failed.
    Code,
    /// A file of the result.
    File(&'static str),
}

/// All placeholders.
const PLACES: [(&str, Place); 10] = [
    ("input", Place::Input),
    ("name", Place::Name),
    ("folder", Place::Folder),
    ("report", Place::File(report::FILE)),
    ("code", Place::Code),
    ("surface", Place::File("surface.vtu")),
    ("param", Place::File("param.vtu")),
    ("seams", Place::File("seams.vtp")),
    ("atlas", Place::File(gmsh::ATLAS)),
    ("remesh", Place::File(gmsh::REMESH)),
];

impl Place {
    /// Whether there is something for which it stands.
    fn is_there(self, occasion: Occasion) -> bool {
        match (self, occasion) {
            (Self::Input | Self::Name | Self::Folder, _) => true,
            (Self::Code, occasion) => occasion == Occasion::Refused,
            (Self::File(file), occasion) => occasion == Occasion::Certified || file == report::FILE,
        }
    }

    /// Whether it stands for an absolute path.
    fn is_path(self) -> bool {
        !matches!(self, Self::Name | Self::Code)
    }
}

/// Why an argument is refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TemplateError {
    /// A placeholder that does not exist.
    #[error("{{{0}}} is no placeholder; there are {list}, and {{{{ and }}}} for the braces themselves", list = all(.1))]
    Unknown(String, Occasion),
    /// A placeholder for something that such a result does not have.
    #[error("{{{0}}} stands for nothing in [[{1}]]; there are {list}", list = all(.1))]
    Missing(String, Occasion),
    /// A brace without its partner.
    #[error("the brace at character {0} has no partner; write {{{{ or }}}} for a brace itself")]
    Unbalanced(usize),
    /// The character that no argument of a program can hold.
    #[error("it holds the character 0, which no argument of a program can; take it out")]
    Zero,
}

/// The names of all placeholders that there are, for people.
fn all(occasion: &Occasion) -> String {
    let there = PLACES.iter().filter(|(_, place)| place.is_there(*occasion));
    there.map(|(name, _)| format!("{{{name}}}")).collect::<Vec<_>>().join(" ")
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Part {
    Text(String),
    Place(Place),
}

/// An argument, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template(Vec<Part>);

impl Template {
    /// Reads an argument as it stands in planish.toml.
    ///
    /// # Errors
    /// [`TemplateError`] for what is no placeholder.
    pub fn parse(said: &str, occasion: Occasion) -> Result<Self, TemplateError> {
        if said.contains('\0') {
            return Err(TemplateError::Zero);
        }
        let (mut parts, mut text, mut rest) = (Vec::new(), String::new(), said);
        while let Some(at) = rest.find(['{', '}']) {
            let (before, brace) = rest.split_at(at);
            text += before;
            if let Some(after) = brace.strip_prefix("{{").or(brace.strip_prefix("}}")) {
                text.push_str(&brace[..1]);
                rest = after;
                continue;
            }
            let unbalanced = || TemplateError::Unbalanced(said[..said.len() - brace.len()].chars().count() + 1);
            let (name, after) = brace.strip_prefix('{').and_then(|b| b.split_once('}')).ok_or_else(unbalanced)?;
            if name.contains('{') {
                return Err(unbalanced());
            }
            parts.extend([Part::Text(std::mem::take(&mut text)), Part::Place(place(name, occasion)?)]);
            rest = after;
        }
        parts.push(Part::Text(text + rest));
        parts.retain(|p| *p != Part::Text(String::new()));
        Ok(Self(parts))
    }

    /// Whether nothing is said.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether it names a file by a path that depends on the folder in which it is looked for.
    pub fn is_relative_path(&self) -> bool {
        let begins_elsewhere = match self.0.first() {
            Some(Part::Text(text)) => !Path::new(text).is_absolute(),
            Some(Part::Place(place)) => !place.is_path(),
            None => false,
        };
        let separated = |p: &Part| matches!(p, Part::Text(t) if t.contains(std::path::is_separator));
        let whole_path = |p: &Part| matches!(p, Part::Place(place) if place.is_path());
        begins_elsewhere && self.0.iter().any(|p| separated(p) || whole_path(p))
    }

    /// The argument for one result.
    pub fn fill(&self, target: &Target) -> OsString {
        let mut filled = OsString::new();
        for part in &self.0 {
            match part {
                Part::Text(text) => filled.push(text),
                Part::Place(place) => filled.push(value(*place, target)),
            }
        }
        filled
    }
}

fn place(name: &str, occasion: Occasion) -> Result<Place, TemplateError> {
    match PLACES.iter().find(|(n, _)| *n == name) {
        None => Err(TemplateError::Unknown(name.to_owned(), occasion)),
        Some((_, place)) if !place.is_there(occasion) => Err(TemplateError::Missing(name.to_owned(), occasion)),
        Some((_, place)) => Ok(*place),
    }
}

fn value(place: Place, target: &Target) -> OsString {
    match place {
        Place::Input => target.input().into(),
        Place::Name => target.input().file_name().unwrap_or_default().to_owned(),
        Place::Folder => target.folder().into(),
        Place::Code => target.code().into(),
        Place::File(file) => target.folder().join(file).into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(said: &str, input: &Path, folder: &Path) -> OsString {
        filled_where(Occasion::Certified, said, input, folder)
    }

    fn filled_where(occasion: Occasion, said: &str, input: &Path, folder: &Path) -> OsString {
        let target = Target::new(input, folder).expect("paths").with_code("malformed".to_owned());
        Template::parse(said, occasion).expect("valid").fill(&target)
    }

    #[test]
    fn placeholders_become_paths() {
        let table = [
            ("{input}", "/in/a {b}.stl"),
            ("{name}", "a {b}.stl"),
            ("{folder}", "/out/a {b}.stl"),
            ("{report}", "/out/a {b}.stl/report.json"),
            ("{surface}", "/out/a {b}.stl/surface.vtu"),
            ("{param}", "/out/a {b}.stl/param.vtu"),
            ("{seams}", "/out/a {b}.stl/seams.vtp"),
            ("{atlas}", "/out/a {b}.stl/atlas.msh"),
            ("{remesh}", "/out/a {b}.stl/remesh.geo"),
            ("-o={folder}/{name}.msh", "-o=/out/a {b}.stl/a {b}.stl.msh"),
            ("{{name}}", "{name}"),
            ("{{{name}}}", "{a {b}.stl}"),
            ("$HOME; `x` ü", "$HOME; `x` ü"),
            ("", ""),
        ];
        for (said, expected) in table {
            assert_eq!(filled(said, "/in/a {b}.stl".as_ref(), "/out/a {b}.stl".as_ref()), expected, "{said}");
        }
        assert_eq!(PLACES.iter().filter(|(n, _)| table.iter().any(|(s, _)| *s == format!("{{{n}}}"))).count(), 9);
    }

    #[test]
    fn names_that_are_no_utf8_pass_unharmed() {
        use std::os::unix::ffi::{OsStrExt, OsStringExt};
        let name = OsString::from_vec(b"/in/\xff\xfe.stl".to_vec());
        let found = filled("x{name}y{input}", name.as_ref(), "/out".as_ref());
        assert_eq!(found.as_bytes(), b"x\xff\xfe.stly/in/\xff\xfe.stl");
    }

    #[test]
    fn what_is_no_placeholder_is_told_with_its_place() {
        let wrong = |said: &str| Template::parse(said, Occasion::Certified).expect_err(said);
        for name in ["nam", "", "Name"] {
            let unknown = TemplateError::Unknown(name.to_owned(), Occasion::Certified);
            assert_eq!(wrong(&format!("{{{name}}}")), unknown);
        }
        for (said, at) in [("ü{name", 2), ("a}b", 2), ("{na{name}", 1), ("{name}}", 7), ("{{{", 3), ("}}}", 3)] {
            assert_eq!(wrong(said), TemplateError::Unbalanced(at), "{said}");
        }
        assert_eq!(wrong("a\0"), TemplateError::Zero);
        let told = wrong("{nam}").to_string();
        assert!(told.starts_with("{nam} is no placeholder; there are {input} {name} {folder}"), "{told}");
        assert!(told.ends_with("{remesh}, and {{ and }} for the braces themselves"), "{told}");
    }

    #[test]
    fn refused_inputs_have_a_code_and_no_files_but_the_report() {
        let filled = |said| filled_where(Occasion::Refused, said, "/in/a.stl".as_ref(), "/out/a.stl".as_ref());
        assert_eq!(filled("{code} {name} {input}"), "malformed a.stl /in/a.stl");
        assert_eq!(filled("{folder} {report}"), "/out/a.stl /out/a.stl/report.json");
        let wrong = |said: &str, occasion| Template::parse(said, occasion).expect_err(said).to_string();
        for (name, place) in PLACES.iter().filter(|(_, place)| matches!(place, Place::File(f) if *f != report::FILE)) {
            let told = wrong(&format!("x{{{name}}}"), Occasion::Refused);
            assert!(told.contains("stands for nothing in [[on_refused]]; there are {input}"), "{place:?}: {told}");
            assert!(told.ends_with("{input} {name} {folder} {report} {code}"), "{told}");
        }
        let told = wrong("{code}", Occasion::Certified);
        assert!(told.starts_with("{code} stands for nothing in [[on_certified]]; there are {input}"), "{told}");
    }

    #[test]
    fn relative_paths_are_told_from_names_and_full_paths() {
        let relative = |said: &str| Template::parse(said, Occasion::Refused).expect("valid").is_relative_path();
        assert!(["./a.sh", "bin/a", "{name}/a", "{code}/a", "x{folder}"].iter().all(|s| relative(s)));
        assert!(!["gmsh", "/usr/bin/gmsh", "{folder}/a.sh", "{input}", ""].iter().any(|s| relative(s)));
    }
}
