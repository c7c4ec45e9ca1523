//! The references of faces, which tell parts of the surface apart.

use crate::formats::labels::{self, LabelError, Labels};
use crate::formats::location::{Location, escape};
use crate::formats::numbered::{Numbered, whole};
use crate::formats::words::{float, integer};
use crate::formats::{Notes, ReadError};
use crate::settings::LabelSource;

/// What references are called where they are asked for.
const NAME: &str = "ref";

/// The references of the triangles so far.
pub struct References {
    source: LabelSource,
    labels: Labels,
    numbered: Numbered,
    /// The first one that is no whole number.
    broken: Option<Broken>,
}

/// A reference that is no whole number.
struct Broken {
    value: String,
    triangle: usize,
    line: usize,
}

impl References {
    /// None yet, of a file in which these labels count.
    pub fn new(source: &LabelSource) -> Self {
        Self { source: source.clone(), labels: Labels::new(source), numbered: Numbered::new(NAME), broken: None }
    }

    /// A face has this reference; with it there are so many triangles.
    pub fn add(&mut self, reference: &[u8], triangles: usize, line: usize) {
        if self.source == LabelSource::Ignored || self.broken.is_some() {
            return;
        }
        match integer(reference).or_else(|| whole(float(reference)?)) {
            Some(number) => {
                let label = self.numbered.label(number, &mut self.labels, |_| None);
                self.labels.fill(triangles, label);
            }
            None => {
                self.broken = Some(Broken { value: escape(reference), triangle: triangles.saturating_sub(1), line });
            }
        }
    }

    /// The labels of all triangles. Where all have the same reference, it names nothing, unless it is asked for.
    ///
    /// # Errors
    /// What is asked for is not there, or a reference is no whole number.
    pub fn labels(self, notes: &mut Notes) -> Result<Labels, ReadError> {
        let none = Labels::new(&self.source);
        let is_asked = labels::chosen([NAME].into_iter(), &self.source)?.is_some();
        match self.broken {
            Some(Broken { value, triangle, .. }) if is_asked => {
                Err(LabelError::NotWhole { asked: NAME.to_owned(), value, triangle }.into())
            }
            Some(Broken { value, line, .. }) => {
                notes.remark(format!(
                    "{}: the reference \"{value}\" of a face is no whole number: the parts of the surface have no names",
                    Location::Line(line)
                ));
                Ok(none)
            }
            None if is_asked || self.labels.distinct() > 1 => Ok(self.labels),
            None => Ok(none),
        }
    }
}
