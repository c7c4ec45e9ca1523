//! Arguments with placeholders: `{folder}/remesh.geo` becomes a path when a command is to run.
//!
//! Paths are filled in as the system knows them: names that are no UTF-8 arrive unharmed. What is filled in is never
//! looked at again, so braces in names mean nothing.

use super::command::Occasion;
use std::path::Path;

/// What a placeholder stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Placeholder {
    /// The input file.
    Input,
    /// Its name.
    Name,
    /// The result folder.
    Folder,
    /// The report in it.
    Report,
    /// Why the input is refused or failed.
    Code,
    /// The surface, for ParaView.
    Surface,
    /// The same in the parametric plane.
    Param,
    /// The curves between charts.
    Seams,
    /// The atlas, for Gmsh.
    Atlas,
    /// The script that remeshes.
    Remesh,
}

/// All placeholders, by their names.
const PLACEHOLDERS: [(&str, Placeholder); 10] = [
    ("input", Placeholder::Input),
    ("name", Placeholder::Name),
    ("folder", Placeholder::Folder),
    ("report", Placeholder::Report),
    ("code", Placeholder::Code),
    ("surface", Placeholder::Surface),
    ("param", Placeholder::Param),
    ("seams", Placeholder::Seams),
    ("atlas", Placeholder::Atlas),
    ("remesh", Placeholder::Remesh),
];

impl Placeholder {
    /// Whether there is something for which it stands: an input that is not certified has no maps, and one that is has no
    /// reason.
    fn is_there(self, occasion: Occasion) -> bool {
        match self {
            Self::Input | Self::Name | Self::Folder | Self::Report => true,
            Self::Code => occasion == Occasion::Refused,
            Self::Surface | Self::Param | Self::Seams | Self::Atlas | Self::Remesh => occasion == Occasion::Certified,
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
    let there = PLACEHOLDERS.iter().filter(|(_, place)| place.is_there(*occasion));
    there.map(|(name, _)| format!("{{{name}}}")).collect::<Vec<_>>().join(" ")
}

/// A part of an argument.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Part {
    /// Text that stays as it is.
    Text(String),
    /// What depends on the result.
    Placeholder(Placeholder),
}

/// An argument, checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Template(Vec<Part>);

impl Template {
    /// Reads an argument as it stands in planish.toml.
    ///
    /// ```
    /// use planish::settings::{Occasion, Part, Placeholder, Template, TemplateError};
    ///
    /// let argument = Template::parse("-o={folder}/{{1}}.msh", Occasion::Certified).expect("a placeholder that is there");
    /// let [before, behind] = ["-o=", "/{1}.msh"].map(|text| Part::Text(text.to_owned()));
    /// assert_eq!(argument.parts(), [before, Part::Placeholder(Placeholder::Folder), behind]);
    ///
    /// let error = |text| Template::parse(text, Occasion::Certified).unwrap_err();
    /// assert_eq!(error("{size}"), TemplateError::Unknown("size".to_owned(), Occasion::Certified));
    /// // What is certified has no code of a refusal.
    /// assert_eq!(error("{code}"), TemplateError::Missing("code".to_owned(), Occasion::Certified));
    /// assert_eq!(error("a{folder"), TemplateError::Unbalanced(2));
    /// ```
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
            // The place of the brace, in characters from 1.
            let unbalanced = || TemplateError::Unbalanced(said[..said.len() - brace.len()].chars().count() + 1);
            let (name, after) = brace.strip_prefix('{').and_then(|b| b.split_once('}')).ok_or_else(unbalanced)?;
            if name.contains('{') {
                return Err(unbalanced());
            }
            parts.push(Part::Text(std::mem::take(&mut text)));
            parts.push(Part::Placeholder(placeholder(name, occasion)?));
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
            Some(Part::Placeholder(place)) => !place.is_path(),
            None => false,
        };
        // A name alone is looked for on the PATH: no path is relative to any folder without a separator.
        let has_separator = self.0.iter().any(|part| match part {
            Part::Text(text) => text.contains(std::path::is_separator),
            Part::Placeholder(placeholder) => placeholder.is_path(),
        });
        begins_elsewhere && has_separator
    }

    /// Its parts, in their order.
    pub fn parts(&self) -> &[Part] {
        &self.0
    }
}

fn placeholder(name: &str, occasion: Occasion) -> Result<Placeholder, TemplateError> {
    match PLACEHOLDERS.iter().find(|(n, _)| *n == name) {
        None => Err(TemplateError::Unknown(name.to_owned(), occasion)),
        Some((_, place)) if !place.is_there(occasion) => Err(TemplateError::Missing(name.to_owned(), occasion)),
        Some((_, place)) => Ok(*place),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        let wrong = |said: &str, occasion| Template::parse(said, occasion).expect_err(said).to_string();
        for name in ["surface", "param", "seams", "atlas", "remesh"] {
            let told = wrong(&format!("x{{{name}}}"), Occasion::Refused);
            assert!(told.contains("stands for nothing in [[on_refused]]; there are {input}"), "{name}: {told}");
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
