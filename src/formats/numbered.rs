//! Labels by the numbers of one array or group, of very many triangles.

use super::labels::{LabelError, Labels};
use std::collections::HashMap;

/// The labels of numbers that were met, so that each is named once.
#[derive(Clone, Debug)]
pub(super) struct Numbered {
    /// The array, or what else holds the numbers.
    array: String,
    known: HashMap<i64, u32>,
    /// The last one: triangles of one part mostly follow each other.
    last: Option<(i64, u32)>,
}

impl Numbered {
    /// Numbers of an array.
    pub fn new(array: &str) -> Self {
        Self { array: array.to_owned(), known: HashMap::new(), last: None }
    }

    /// The array.
    pub fn array(&self) -> &str {
        &self.array
    }

    /// The label of a number, which has a name or none.
    #[inline]
    pub fn label<'n>(&mut self, number: i64, labels: &mut Labels, name: impl FnOnce(i64) -> Option<&'n str>) -> u32 {
        if let Some((_, label)) = self.last.filter(|(last, _)| *last == number) {
            return label;
        }
        let label = *self.known.entry(number).or_insert_with(|| labels.numbered(&self.array, number, name(number)));
        self.last = Some((number, label));
        label
    }

    /// The label of a number of whatever type, which must be a whole one.
    ///
    /// # Errors
    /// [`LabelError::NotWhole`], with the number of the triangle.
    pub fn label_of_float(&mut self, value: f64, triangle: usize, labels: &mut Labels) -> Result<u32, LabelError> {
        let not_whole = || LabelError::NotWhole { asked: self.array.clone(), value: value.to_string(), triangle };
        let number = whole(value).ok_or_else(not_whole)?;
        Ok(self.label(number, labels, |_| None))
    }
}

/// The whole number that a float is. Above 2^53 floats do not tell whole numbers apart.
pub(super) fn whole(value: f64) -> Option<i64> {
    let fits = value.fract() == 0.0 && value.abs() < 9e15;
    fits.then_some(value as i64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::LabelSource;

    #[test]
    fn a_number_has_one_label() {
        let mut labels = Labels::new(&LabelSource::Usual);
        let mut numbered = Numbered::new("part");
        let found = [7, 7, -1, 7].map(|number| numbered.label(number, &mut labels, |_| None));
        assert_eq!(found, [0, 0, 1, 0]);
        assert_eq!(labels.numbered("part", -1, None), 1);
        assert_eq!(numbered.label_of_float(-1.0, 3, &mut labels), Ok(1));
        for value in [0.5, f64::NAN, 1e300, f64::INFINITY] {
            let error = numbered.label_of_float(value, 3, &mut labels).expect_err("no whole number");
            assert!(error.to_string().contains("part holds") && error.to_string().contains("triangle 3"), "{error}");
        }
    }
}
