//! What is too much for one input.

use planish_core::mesh::TriangleSoup;
use serde::{Deserialize, Serialize};

/// What is too much for one input. Files may come from anyone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Limits {
    /// Bytes of the file, and of all that it takes along.
    pub file: u64,
    /// Points, and triangles.
    pub elements: u64,
    /// Bytes that compressed data and repeated parts may become, all together, per byte of the file.
    pub expansion: u64,
    /// Levels of nested nodes, groups, elements.
    pub depth: usize,
    /// Bytes of the files of its result together.
    pub result: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file: 2 << 30,
            elements: TriangleSoup::MAX_TRIANGLES as u64,
            expansion: 100,
            depth: 256,
            result: 16 << 30,
        }
    }
}

/// Files smaller than this are taken to be this large where what comes out of them is compared with their size.
const SMALL: u64 = 1 << 20;

impl Limits {
    /// How many bytes may come out of a file of this size.
    ///
    /// ```
    /// use planish::settings::Limits;
    ///
    /// let limits = Limits { expansion: 100, ..Limits::default() };
    /// assert_eq!(limits.unpacked(10 << 20), 1000 << 20);
    /// // Files below 1 MiB may become as much as one of 1 MiB.
    /// assert_eq!(limits.unpacked(300), 100 << 20);
    /// ```
    pub fn unpacked(&self, file: usize) -> u64 {
        SMALL.max(file as u64).saturating_mul(self.expansion)
    }
}
