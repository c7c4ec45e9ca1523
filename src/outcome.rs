//! How an input ended: certified, refused or failed, and why.

use crate::system::escape::printable;
use serde::{Deserialize, Serialize};

/// The state of an input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Status {
    /// Every chart has a proven map.
    Certified,
    /// The input cannot be processed.
    Refused,
    /// planish broke down.
    Failed,
}

impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Certified => "certified",
            Self::Refused => "refused",
            Self::Failed => "failed",
        })
    }
}

/// Why an input was refused or failed: a stable list that scripts may rely on (see docs/report.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Code {
    /// The file cannot be opened or read.
    Unreadable,
    /// The extension is none that planish knows.
    UnknownExtension,
    /// A mesh format that this version does not read.
    UnsupportedFormat,
    /// The file is none that holds a mesh.
    NotAMesh,
    /// The file has no bytes.
    EmptyFile,
    /// The file does not follow its format.
    Malformed,
    /// Declared counts and size disagree.
    CountMismatch,
    /// A coordinate is not a number, infinite, or above 1e100.
    NotFinite,
    /// The file names another one that is not there.
    MissingFile,
    /// The file names another one that planish does not open.
    ForeignFile,
    /// There is no triangle.
    NoTriangles,
    /// Every triangle has two equal vertices.
    OnlyDegenerate,
    /// Non-manifold edges cut the surface into thousands of sheets: faces of volume elements.
    VolumeElements,
    /// Nothing in the file has the name that `--label` asks for, or what has it labels no triangles.
    NoLabels,
    /// The file has no array of points that tells sizes as `--size-from` asks for.
    NoSizes,
    /// More elements than planish can number.
    TooLarge,
    /// The surface is not one disk: given by earlier versions only, and read in their reports.
    NeedsDecomposition,
    /// A single triangle cannot be mapped.
    NeedsSplit,
    /// It takes more memory than an input may.
    JobMemory,
    /// It takes more time than an input may.
    JobTime,
    /// planish died of it, again and again.
    Crashed,
    /// A fault of planish.
    Internal,
}

/// A refusal or failure, told.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reason {
    /// What kind of reason.
    pub code: Code,
    /// What is wrong and what to do.
    pub message: String,
    /// Where: line, byte, triangle or vertex.
    #[serde(rename = "where")]
    pub location: Option<String>,
}

impl Reason {
    /// A reason without a place.
    pub fn new(code: Code, message: impl ToString) -> Self {
        Self::at(code, message, None)
    }

    /// A reason with its place, where there is one. Both may quote the file.
    pub fn at(code: Code, message: impl ToString, location: Option<String>) -> Self {
        Self { code, message: printable(&message.to_string()), location: location.map(|location| printable(&location)) }
    }

    /// The state that this reason leads to.
    ///
    /// ```
    /// use planish::outcome::{Code, Reason, Status};
    ///
    /// // Of the input: another file, or another limit, helps.
    /// assert_eq!(Reason::new(Code::Malformed, "line 3: ...").status(), Status::Refused);
    /// assert_eq!(Reason::new(Code::JobTime, "it took more than 60 s").status(), Status::Refused);
    /// // Of planish.
    /// assert_eq!(Reason::new(Code::Internal, "a panic").status(), Status::Failed);
    /// assert_eq!(Code::NotAMesh.name(), "not_a_mesh");
    /// ```
    pub fn status(&self) -> Status {
        if matches!(self.code, Code::Internal | Code::Crashed) { Status::Failed } else { Status::Refused }
    }
}

/// Why work on a job stopped.
#[derive(Clone, Debug, PartialEq)]
pub enum Abort {
    /// It is refused, or failed.
    For(Reason),
    /// Nobody wants the result any more.
    Unwanted,
}

impl From<Reason> for Abort {
    fn from(reason: Reason) -> Self {
        Self::For(reason)
    }
}

impl Code {
    /// The code as it is written.
    pub fn name(self) -> String {
        serde_json::to_value(self).ok().and_then(|v| v.as_str().map(str::to_owned)).unwrap_or_default()
    }
}
