//! The stages by name, as progress and log messages tell them.

use serde::{Deserialize, Serialize};

/// The stages, as progress is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// Reading bytes and decoding them.
    Read,
    /// Repair and decomposition.
    Decompose,
    /// Bisecting triangles where the first maps are too poor.
    Refine,
    /// Linear and harmonic maps, the first ones too.
    Map,
    /// Untangling and proving.
    Untangle,
    /// Measuring, encoding, publishing.
    Write,
    /// Commands run on the result.
    Chain,
}

impl Stage {
    /// All stages, in their order.
    const ALL: [Self; 7] =
        [Self::Read, Self::Decompose, Self::Refine, Self::Map, Self::Untangle, Self::Write, Self::Chain];

    /// The stage of this name.
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|stage| stage.name() == name)
    }

    /// The name of the stage.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Decompose => "decompose",
            Self::Refine => "refine",
            Self::Map => "map",
            Self::Untangle => "untangle",
            Self::Write => "write",
            Self::Chain => "chain",
        }
    }
}
