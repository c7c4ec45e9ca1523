//! Sizes: the lengths of edges that an array of a file asks for at its points, in the unit of the file.
//!
//! A reader gives a number for every point, as they stand in the file; what is no length asks for nothing there.

use super::Content;
use planish_core::mesh::TriangleSoup;
use std::collections::HashSet;

/// The array that was asked for is not there, or cannot tell sizes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SizeError {
    /// There is no such array.
    #[error(
        "there is no array of points called {asked} that could tell sizes: {}; correct --size-from, or leave it out",
        told(there)
    )]
    Missing {
        /// The array that was asked for.
        asked: String,
        /// The names that could have been.
        there: Vec<String>,
    },
    /// The array has several numbers at a point.
    #[error(
        "{asked} has {components} numbers at every point, and a size is one: it cannot tell sizes; name an array of one component \
         with --size-from"
    )]
    Components {
        /// The array that was asked for.
        asked: String,
        /// How many there are at a point.
        components: u64,
    },
}

/// The names of arrays, for people.
fn told(there: &[String]) -> String {
    match there {
        [] => "the file has no arrays of points (those of VTK and MSH files are read)".to_owned(),
        _ => format!("there are {}", there.join(", ")),
    }
}

impl SizeError {
    /// The refusal of a name that none of these arrays has. They may come more than once: in every piece of a file.
    pub(super) fn missing<'a>(there: impl Iterator<Item = &'a str>, asked: &str) -> Self {
        let mut met = HashSet::new();
        let there = there.filter(|array| met.insert(*array)).map(str::to_owned).collect();
        Self::Missing { asked: asked.to_owned(), there }
    }
}

/// Refuses an array of several components.
///
/// # Errors
/// [`SizeError::Components`].
pub(super) fn expect_one_component(asked: &str, components: u64) -> Result<(), SizeError> {
    if components == 1 { Ok(()) } else { Err(SizeError::Components { asked: asked.to_owned(), components }) }
}

/// The values of an array at points.
#[derive(Clone, Debug)]
pub(super) struct PointSizes {
    /// The name of the array.
    pub array: String,
    /// One for each point, in the order of the file.
    pub values: Vec<f64>,
}

/// What a file holds, with sizes where any are asked for. At how many corners they are no lengths is told.
pub(super) fn give(content: Content, sizes: Option<PointSizes>) -> Content {
    let Some(PointSizes { array, values }) = sizes else { return content };
    let Content { soup, fields, mut notes } = content;
    let mut is_corner = vec![false; values.len()];
    soup.triangles().iter().flatten().for_each(|corner| is_corner[*corner as usize] = true);
    let corners = is_corner.iter().filter(|is_corner| **is_corner).count();
    let is_none = |(value, is_corner): &(&f64, &bool)| **is_corner && !TriangleSoup::is_size(**value);
    let none = values.iter().zip(&is_corner).filter(is_none).count();
    if none > 0 {
        notes.remark(format!(
            "at {none} of the {corners} corners of triangles {array} is no positive number: there it asks for no length of edges"
        ));
    }
    Content { soup: soup.with_sizes(values), fields, notes }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::{Fields, Notes};

    #[test]
    fn values_that_are_no_lengths_ask_for_nothing_and_are_counted_at_corners() {
        let points = (0..7).map(|k| [f64::from(k), f64::from(k * k), 0.0]).collect();
        let soup = TriangleSoup::new(points, vec![[0, 1, 2], [1, 3, 4], [1, 4, 5]]).expect("a soup");
        let content = Content { soup, fields: Fields::default(), notes: Notes::new("a format") };
        let sizes = |values| PointSizes { array: "h".to_owned(), values };
        let values = vec![0.5, f64::NAN, 0.0, -1.0, f64::INFINITY, 1e300, f64::NAN];
        let found = give(content.clone(), Some(sizes(values)));
        let none = f64::INFINITY;
        assert_eq!(found.soup.sizes(), [0.5, none, none, none, none, 1e300, none]);
        let [remark] = &found.notes.remarks[..] else { panic!("{:?}", found.notes.remarks) };
        assert!(remark.starts_with("at 4 of the 6 corners of triangles h is no positive number"), "{remark}");
        assert!(give(content.clone(), Some(sizes(vec![1.0; 7]))).notes.remarks.is_empty());
        assert_eq!(give(content.clone(), None), content);
    }

    #[test]
    fn what_is_not_there_is_refused_with_what_is() {
        let told = |there: &[&str]| SizeError::missing(there.iter().copied(), "H").to_string();
        assert!(told(&["p", "h", "p"]).contains("called H that could tell sizes: there are p, h; correct --size-from"));
        assert!(told(&[]).contains("the file has no arrays of points"));
        assert_eq!(expect_one_component("h", 1), Ok(()));
        assert!(expect_one_component("v", 3).is_err_and(|e| e.to_string().contains("v has 3 numbers at every point")));
    }
}
