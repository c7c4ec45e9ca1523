//! Commands that follow a result, checked: `[[on_certified]]` and `[[on_refused]]` of planish.toml.

use super::RawCommand;
use super::template::{Template, TemplateError};

/// When commands run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Occasion {
    /// An input is certified.
    Certified,
    /// An input is refused, or failed.
    Refused,
}

/// As the tables of planish.toml are named.
impl std::fmt::Display for Occasion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Certified => "on_certified",
            Self::Refused => "on_refused",
        })
    }
}

/// A command, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Hook {
    configured: RawCommand,
    arguments: Vec<Template>,
}

/// Why a command is refused: wrong usage.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HookRefused {
    /// There is no program.
    #[error("command names no program; give a list of program and arguments, as in [\"gmsh\", \"{{remesh}}\", \"-2\"]")]
    Empty,
    /// An argument is wrong.
    #[error("command, part {part} ({text:?}): {error}")]
    Argument {
        /// Which, from 1; 1 is the program.
        part: usize,
        /// The argument.
        text: String,
        /// Why.
        error: TemplateError,
    },
    /// The program is looked for in a folder that depends on the result.
    #[error("command begins with the relative path {0:?}; give the full path, or a name alone to be found on the PATH")]
    RelativeProgram(String),
    /// The time limit is none.
    #[error("time-limit is {0}; it must be a positive number of seconds")]
    TimeLimit(f64),
}

impl Hook {
    /// Checks a command for this occasion.
    ///
    /// ```
    /// use planish::settings::{Hook, HookRefused, Occasion, RawCommand};
    ///
    /// let hook = |program: &str, time_limit: f64| {
    ///     let command = vec![program.to_owned(), "{remesh}".to_owned(), "-2".to_owned()];
    ///     Hook::new(RawCommand { command, time_limit }, Occasion::Certified)
    /// };
    /// assert!(hook("gmsh", 600.0).is_ok());
    /// assert_eq!(hook("gmsh", 0.0), Err(HookRefused::TimeLimit(0.0)));
    /// // Relative to which folder?
    /// assert_eq!(hook("bin/gmsh", 600.0), Err(HookRefused::RelativeProgram("bin/gmsh".to_owned())));
    /// ```
    ///
    /// # Errors
    /// [`HookRefused`] for what can never run.
    pub fn new(configured: RawCommand, occasion: Occasion) -> Result<Self, HookRefused> {
        let RawCommand { command, time_limit } = &configured;
        if !(*time_limit > 0.0 && time_limit.is_finite()) {
            return Err(HookRefused::TimeLimit(*time_limit));
        }
        let mut arguments = Vec::new();
        for (i, text) in command.iter().enumerate() {
            let argument = Template::parse(text, occasion);
            let refused = |error| HookRefused::Argument { part: i + 1, text: text.clone(), error };
            arguments.push(argument.map_err(refused)?);
        }
        match arguments.first() {
            Some(program) if program.is_relative_path() => Err(HookRefused::RelativeProgram(command[0].clone())),
            Some(program) if !program.is_empty() => Ok(Self { configured, arguments }),
            _ => Err(HookRefused::Empty),
        }
    }

    /// The command as it is configured.
    pub fn configured(&self) -> &RawCommand {
        &self.configured
    }

    /// Program and arguments, with their placeholders.
    pub fn arguments(&self) -> &[Template] {
        &self.arguments
    }
}
