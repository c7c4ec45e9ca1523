//! The values that settings can have.

use super::Limits;
use bytesize::ByteSize;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The form of log messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Log {
    /// For people.
    #[default]
    Text,
    /// One JSON object per line.
    Json,
}

/// A mesher to which results are handed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportTarget {
    /// Gmsh: atlas.msh and remesh.geo.
    Gmsh,
    /// Mmg: surface.mesh for mmgs, and chart-NNN.mesh for mmg2d, in the folder mmg.
    Mmg,
}

/// The meshers to which results are handed: words with commas between them, or `none`.
///
/// ```
/// use planish::settings::{ExportTarget, ExportTargets};
///
/// let both: ExportTargets = "mmg,gmsh".parse()?;
/// assert!(both.has(ExportTarget::Gmsh) && both.has(ExportTarget::Mmg));
/// assert_eq!(both.to_string(), "gmsh,mmg", "in an order of their own");
/// assert_eq!("none".parse::<ExportTargets>()?.to_string(), "none");
/// assert_eq!("netgen".parse::<ExportTargets>(), Err("netgen is none of gmsh, mmg and none".to_owned()));
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(into = "String", try_from = "String")]
pub struct ExportTargets {
    gmsh: bool,
    mmg: bool,
}

impl ExportTargets {
    /// Whether this mesher is among them.
    pub fn has(self, target: ExportTarget) -> bool {
        match target {
            ExportTarget::Gmsh => self.gmsh,
            ExportTarget::Mmg => self.mmg,
        }
    }
}

impl Default for ExportTargets {
    fn default() -> Self {
        Self { gmsh: true, mmg: false }
    }
}

impl std::str::FromStr for ExportTargets {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut targets = Self { gmsh: false, mmg: false };
        if text == "none" {
            return Ok(targets);
        }
        for word in text.split(',') {
            match word {
                "gmsh" => targets.gmsh = true,
                "mmg" => targets.mmg = true,
                _ => return Err(format!("{word} is none of gmsh, mmg and none")),
            }
        }
        Ok(targets)
    }
}

impl std::fmt::Display for ExportTargets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match (self.gmsh, self.mmg) {
            (true, true) => "gmsh,mmg",
            (true, false) => "gmsh",
            (false, true) => "mmg",
            (false, false) => "none",
        })
    }
}

impl From<ExportTargets> for String {
    fn from(targets: ExportTargets) -> Self {
        targets.to_string()
    }
}

impl TryFrom<String> for ExportTargets {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// A file for other programs, beside those of every result.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Also {
    /// surface.obj: the surface with texture coordinates.
    Obj,
    /// surface.glb: the same for what reads glTF.
    Glb,
    /// welded.vtu: the surface with one node where charts meet, for solvers.
    Welded,
}

/// Which of these files are asked for: a list in planish.toml; on the command line words with commas between them, or `none`.
///
/// ```
/// use planish::settings::{Also, AlsoFiles};
///
/// assert_eq!("welded,obj".parse(), Ok(AlsoFiles(vec![Also::Welded, Also::Obj])));
/// assert_eq!("none".parse(), Ok(AlsoFiles(vec![])));
/// assert_eq!("obj,fbx".parse::<AlsoFiles>(), Err("fbx is none of obj, glb and welded".to_owned()));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(transparent)]
pub struct AlsoFiles(pub Vec<Also>);

impl AlsoFiles {
    /// Each once, in their order, whatever that is in what was said.
    pub(super) fn each_once(self) -> Vec<Also> {
        let mut files = self.0;
        files.sort_unstable();
        files.dedup();
        files
    }
}

impl std::str::FromStr for AlsoFiles {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let file = |word: &str| match word {
            "obj" => Ok(Also::Obj),
            "glb" => Ok(Also::Glb),
            "welded" => Ok(Also::Welded),
            _ => Err(format!("{word} is none of obj, glb and welded")),
        };
        if text == "none" { Ok(Self::default()) } else { text.split(',').map(file).collect::<Result<_, _>>().map(Self) }
    }
}

/// The boundary of charts in the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Boundary {
    /// The one that a chart has when it is laid out flat, where that is one-to-one and scales areas evenly; else the circle.
    #[default]
    Natural,
    /// The unit circle.
    Circle,
}

impl From<Boundary> for planish_core::BoundaryShape {
    fn from(boundary: Boundary) -> Self {
        match boundary {
            Boundary::Natural => Self::Natural,
            Boundary::Circle => Self::Circle,
        }
    }
}

/// What names parts of a surface, the borders of which become seams.
#[derive(Clone, Debug, PartialEq, Eq, Default)]
pub enum LabelSource {
    /// What files of the format usually have: solids, groups, materials, physical groups, arrays of usual names.
    #[default]
    Usual,
    /// An array, or another way to tell parts apart, by its name in the file.
    Array(String),
    /// Nothing.
    Ignored,
}

/// The dihedral angle of feature edges.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum FeatureAngle {
    /// In degrees.
    Degrees(f64),
    /// No features.
    Off(Off),
}

/// How far charts may be refined.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(untagged)]
pub enum Refine {
    /// To so many times as many triangles.
    Times(u32),
    /// Not at all.
    Off(Off),
}

impl Refine {
    pub(super) fn times(self) -> Option<u32> {
        if let Self::Times(times) = self { Some(times) } else { None }
    }
}

impl std::str::FromStr for Refine {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "off" {
            return Ok(Self::Off(Off::Off));
        }
        text.parse().map(Self::Times).map_err(|_| format!("{text} is neither a whole number nor off"))
    }
}

/// The word `off`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Off {
    /// The word.
    Off,
}

impl FeatureAngle {
    pub(super) fn degrees(self) -> Option<f64> {
        if let Self::Degrees(angle) = self { Some(angle) } else { None }
    }
}

impl std::str::FromStr for FeatureAngle {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "off" {
            return Ok(Self::Off(Off::Off));
        }
        text.parse().map(Self::Degrees).map_err(|_| format!("{text} is neither an angle in degrees nor off"))
    }
}

/// What becomes of inputs of `planish watch` that are certified, and on which all commands succeeded.
///
/// ```
/// use planish::settings::{Inputs, Refused};
///
/// assert_eq!("move:done".parse(), Ok(Inputs::Move("done".into())));
/// assert_eq!("move:".parse::<Inputs>(), Err("move: is none of keep, move:DIR and delete".to_owned()));
/// // What is refused may be moved, but is never deleted.
/// assert!("move:refused".parse::<Refused>().is_ok());
/// assert!("delete".parse::<Refused>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(try_from = "String")]
pub enum Inputs {
    /// They stay.
    #[default]
    Keep,
    /// They are moved to this folder.
    Move(PathBuf),
    /// They are deleted.
    Delete,
}

impl std::str::FromStr for Inputs {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.strip_prefix("move:")) {
            ("keep", _) => Ok(Self::Keep),
            ("delete", _) => Ok(Self::Delete),
            (_, Some(folder)) if !folder.is_empty() => Ok(Self::Move(folder.into())),
            _ => Err(format!("{text} is none of keep, move:DIR and delete")),
        }
    }
}

impl TryFrom<String> for Inputs {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// What becomes of inputs of `planish watch` that are refused or failed, once all commands on them have succeeded. They
/// are never deleted: nobody has what was in them.
#[derive(Clone, Debug, PartialEq, Eq, Default, Deserialize)]
#[serde(try_from = "String")]
pub struct Refused(pub(super) Inputs);

impl std::str::FromStr for Refused {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.parse() {
            Ok(Inputs::Delete) | Err(_) => Err(format!("{text} is none of keep and move:DIR")),
            Ok(inputs) => Ok(Self(inputs)),
        }
    }
}

impl TryFrom<String> for Refused {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
    }
}

/// A command that runs on a result: a table `[[on_certified]]` or `[[on_refused]]` of planish.toml (see docs/hooks.md).
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawCommand {
    /// Program and arguments, with placeholders such as `{folder}`.
    pub command: Vec<String>,
    /// Wall-clock seconds after which it is ended; ten minutes where nothing is said.
    #[serde(rename = "time-limit", default = "ten_minutes")]
    pub time_limit: f64,
}

fn ten_minutes() -> f64 {
    600.0
}

/// What is too much for one input: the table `[limits]` of planish.toml. Files may come from anyone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RawLimits {
    /// The size of a file, and of all that it takes along.
    pub file: Option<ByteSize>,
    /// Points, and triangles.
    pub elements: Option<u64>,
    /// What compressed data and repeated parts may become, per byte of the file.
    pub expansion: Option<u64>,
    /// Levels of nesting.
    pub depth: Option<usize>,
    /// The size of all files of a result together.
    pub result: Option<ByteSize>,
}

impl RawLimits {
    /// What was said, and the defaults where nothing was.
    pub(super) fn or_default(self) -> Limits {
        let usual = Limits::default();
        Limits {
            file: self.file.map_or(usual.file, |size| size.as_u64()),
            elements: self.elements.unwrap_or(usual.elements),
            expansion: self.expansion.unwrap_or(usual.expansion),
            depth: self.depth.unwrap_or(usual.depth),
            result: self.result.map_or(usual.result, |size| size.as_u64()),
        }
    }
}
