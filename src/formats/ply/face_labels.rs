//! The property of faces that labels their triangles.

use super::header::{Element, Header, Property, Scalar};
use crate::formats::Notes;
use crate::formats::labels::{self, LabelError, Labels};
use crate::formats::numbered::Numbered;
use crate::settings::LabelSource;

/// Elements whose records give triangles.
pub const SURFACE: [&str; 2] = ["face", "tristrips"];

/// The labels of the triangles so far.
pub struct FaceLabels {
    source: LabelSource,
    /// The property that was chosen, if there is one.
    property: Option<String>,
    numbered: Numbered,
    labels: Labels,
    /// The first triangle whose value is no whole number.
    not_whole: Option<LabelError>,
}

impl FaceLabels {
    /// Chooses the property, of those that faces or strips have.
    ///
    /// # Errors
    /// What is asked for is not there.
    pub fn new(header: &Header, source: &LabelSource) -> Result<Self, LabelError> {
        let all = properties(header).filter(|property| property.count.is_none());
        // Measured values name no parts, unless they are asked for.
        let is_asked = |property: &&Property| *source == LabelSource::Array(property.name.clone());
        let usable = all.filter(|property| !property.scalar.is_float() || is_asked(property));
        let property = labels::chosen(usable.map(|property| property.name.as_str()), source)?.map(str::to_owned);
        let numbered = Numbered::new(property.as_deref().unwrap_or_default());
        Ok(Self { source: source.clone(), property, numbered, labels: Labels::new(source), not_whole: None })
    }

    /// The position of the property in records of an element.
    pub fn position(&self, element: &Element) -> Option<usize> {
        let at = element.property(&[self.property.as_deref()?])?;
        element.properties[at].count.is_none().then_some(at)
    }

    /// The triangles up to this number have no label, where others do.
    pub fn unnamed(&mut self, triangles: usize) {
        if self.property.is_some() {
            self.labels.fill_unnamed(triangles);
        }
    }

    /// The triangles from `begin` to `end` have this value.
    #[inline]
    pub fn add(&mut self, value: f64, begin: usize, end: usize) {
        if begin == end {
            return;
        }
        match self.numbered.label_of_float(value, begin, &mut self.labels) {
            Ok(label) => self.labels.fill(end, label),
            Err(error) => self.not_whole = self.not_whole.take().or(Some(error)),
        }
    }

    /// All labels; none where a value is no whole number, which is told, or refused where the property was asked for.
    ///
    /// # Errors
    /// A value is no whole number.
    pub fn finish(self, notes: &mut Notes) -> Result<Labels, LabelError> {
        match self.not_whole {
            None => Ok(self.labels),
            Some(error) if matches!(self.source, LabelSource::Array(_)) => Err(error),
            Some(error) => {
                notes.remark(format!("the parts of the surface have no names: {error}"));
                Ok(Labels::new(&self.source))
            }
        }
    }
}

/// All properties of faces and strips.
fn properties(header: &Header) -> impl Iterator<Item = &Property> + Clone {
    header.elements.iter().filter(|element| SURFACE.contains(&element.name.as_str())).flat_map(|e| &e.properties)
}

/// Where the label of a plain face stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// Whether it stands behind the list of corners, else before.
    pub is_behind: bool,
    /// Bytes of the record between its begin, or the end of the list, and the label.
    pub offset: usize,
    pub scalar: Scalar,
}

impl Place {
    /// The place of a property of an element whose list of corners is at `list`, and which has no other.
    pub fn new(element: &Element, list: usize, property: usize) -> Self {
        let is_behind = property > list;
        let first = if is_behind { list + 1 } else { 0 };
        let offset = element.properties[first..property].iter().map(|p| p.scalar.size()).sum();
        Self { is_behind, offset, scalar: element.properties[property].scalar }
    }
}
