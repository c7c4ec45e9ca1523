//! What readers are given, and what they give.

use super::fields::Fields;
use super::labels::Label;
use crate::settings::{LabelSource, Limits};
use planish_core::mesh::TriangleSoup;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names that are kept, at most.
const NAMES: usize = 100;

/// Characters of a name that are kept, at most.
const NAME: usize = 200;

/// What a reader is given: the bytes of a file, and what it may ask for. No reader touches the disk.
#[derive(Clone, Copy)]
pub struct Source<'a> {
    /// The file.
    pub bytes: &'a [u8],
    /// What is too much.
    pub limits: &'a Limits,
    /// The files beside it.
    pub beside: &'a dyn SiblingFiles,
    /// What names parts of the surface.
    pub labels: &'a LabelSource,
    /// The array of points that tells sizes, where one is asked for.
    pub sizes: Option<&'a str>,
    /// Whether arrays of points and cells are kept.
    pub keeps_fields: bool,
}

impl<'a> Source<'a> {
    /// A file with nothing beside it, whose parts have the names that are usual, and of which all is kept.
    pub fn alone(bytes: &'a [u8], limits: &'a Limits) -> Self {
        Self { bytes, limits, beside: &NoSiblings, labels: &LabelSource::Usual, sizes: None, keeps_fields: true }
    }
}

/// Gives the bytes of a file that lies beside the one that is read.
pub trait SiblingFiles {
    /// The bytes of the file `name`, which is a plain name (no folder, no scheme), of at most `most` bytes.
    ///
    /// # Errors
    /// Why there are none, for people.
    fn read(&self, name: &str, most: u64) -> Result<Vec<u8>, String>;
}

/// Nothing lies beside the file.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoSiblings;

impl SiblingFiles for NoSiblings {
    fn read(&self, name: &str, _most: u64) -> Result<Vec<u8>, String> {
        Err(format!("there is no file {name} beside it"))
    }
}

/// There are more elements than may be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{count} {what} exceed the limit of {limit}; split the file, or raise `elements` in the table [limits] of planish.toml"
)]
pub struct TooMany {
    /// What there is too much of.
    pub what: String,
    /// How many there are, so far at least.
    pub count: u64,
    /// How many may be.
    pub limit: u64,
}

impl TooMany {
    /// Refuses more than `limit`.
    ///
    /// ```
    /// use planish::formats::TooMany;
    ///
    /// assert_eq!(TooMany::check("points", 1000, 1000), Ok(()));
    /// let error = TooMany::check("points", 1001, 1000).unwrap_err();
    /// assert!(error.to_string().starts_with("1001 points exceed the limit of 1000; split the file"));
    /// ```
    ///
    /// # Errors
    /// This one.
    pub fn check(what: &str, count: u64, limit: u64) -> Result<(), Self> {
        if count <= limit { Ok(()) } else { Err(Self { what: what.to_owned(), count, limit }) }
    }
}

/// What a file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Content {
    /// Its triangles.
    pub soup: TriangleSoup,
    /// What it tells at its points and cells.
    pub fields: Fields,
    /// What else there is to tell.
    pub notes: Notes,
}

/// What a file holds beside its triangles, for the report.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Notes {
    /// Format, version and encoding, as `PLY, binary, big-endian`.
    pub format: String,
    /// The unit of length, where the file tells one.
    pub units: Option<String>,
    /// Names of solids, objects, groups, in the order of the file; the first 100 of them.
    pub names: Vec<String>,
    /// The labels of triangles, in the order of their first triangles: the soup's labels are positions in this list.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub labels: Vec<Label>,
    /// Faces with more than three corners, which were cut into triangles.
    pub polygons: usize,
    /// How many of these cross themselves, or are too intricate to be cut with care: their triangles may fold.
    #[serde(default)]
    pub polygons_doubtful: usize,
    /// Nodes in the middle of edges, which were left out: edges are taken to be straight.
    pub mid_nodes: usize,
    /// What is no surface and was left out: how many elements of each kind.
    pub skipped: BTreeMap<String, usize>,
    /// What is not as it should be, but was read all the same: sentences for people.
    #[serde(default)]
    pub remarks: Vec<String>,
}

impl Notes {
    /// Nothing but the format.
    pub fn new(format: impl Into<String>) -> Self {
        Self { format: format.into(), ..Self::default() }
    }

    /// Adds a name, if it is one and new.
    pub fn name(&mut self, name: &str) {
        let name: String = name.trim().chars().take(NAME).collect();
        if !name.is_empty() && self.names.len() < NAMES && !self.names.contains(&name) {
            self.names.push(name);
        }
    }

    /// Counts a face that was cut into triangles, which may fold where this is doubtful.
    pub fn polygon(&mut self, is_doubtful: bool) {
        self.polygons += 1;
        self.polygons_doubtful += usize::from(is_doubtful);
    }

    /// Tells of something that is not as it should be.
    pub fn remark(&mut self, remark: String) {
        self.remarks.push(remark);
    }

    /// Counts elements that are left out.
    pub fn skip(&mut self, kind: &str, count: usize) {
        if count > 0 {
            *self.skipped.entry(kind.to_owned()).or_insert(0) += count;
        }
    }
}
