//! The views of nodes (`$NodeData`), of which one tells sizes.
//!
//! A section begins, as text also in binary files, with its strings (the name of the view first), real numbers (the time) and
//! whole ones: the step of time, components, how many nodes, perhaps the partition. Then comes each node with its values.

use super::nodes::Nodes;
use super::sections::fits;
use super::values::{SectionError, Values, number};
use super::{MshError, told};
use crate::formats::location::escape;
use crate::formats::point_sizes::{self, PointSizes, SizeError};
use crate::formats::{Notes, ReadError};

/// The name of the section.
pub const SECTION: &str = "NodeData";

/// The views of a file, of which one is asked for.
#[derive(Debug, Default)]
pub struct Views {
    /// Its name; none where none is asked for.
    asked: Option<String>,
    /// The names of those that could be.
    there: Vec<String>,
    /// What was found of it.
    found: Option<View>,
    /// Why a section could not be read that may belong to it.
    damaged: Option<MshError>,
}

/// A view.
#[derive(Debug)]
struct View {
    components: u64,
    /// The step of time of its first section, which alone counts; and whether there are others.
    step: i64,
    has_other_steps: bool,
    /// Per node, its value; no number where it has none.
    values: Vec<f64>,
}

/// How a section begins.
pub(super) struct Head {
    pub name: String,
    pub step: i64,
    pub components: u64,
    /// How many nodes or elements have values.
    pub entries: u64,
}

impl Views {
    /// Nothing found yet of the view that is asked for.
    pub fn new(asked: Option<&str>) -> Self {
        Self { asked: asked.map(str::to_owned), ..Self::default() }
    }

    /// Whether any is asked for.
    pub fn are_wanted(&self) -> bool {
        self.asked.is_some()
    }

    /// Reads a section, of which `values` hold no more.
    ///
    /// # Errors
    /// What is wrong with it, where it belongs to the view that is asked for.
    pub fn read<'a, V: Values<'a>>(&mut self, mut values: V, nodes: Option<&Nodes>) -> Result<(), MshError> {
        let head = match head(&mut values) {
            Ok(head) => head,
            Err(fault) => {
                self.damaged.get_or_insert(place(fault, SECTION, &values));
                return Ok(());
            }
        };
        if head.components == 1 {
            self.there.push(head.name.clone());
        }
        if self.asked.as_ref() != Some(&head.name) {
            return Ok(());
        }
        self.view(&head, &mut values, nodes).map_err(|fault| place(fault, SECTION, &values))
    }

    /// Reads the values of a section of the view that is asked for.
    fn view<'a, V: Values<'a>>(
        &mut self,
        head: &Head,
        values: &mut V,
        nodes: Option<&Nodes>,
    ) -> Result<(), SectionError> {
        let nodes = nodes.ok_or_else(|| SectionError::Value("it stands before $Nodes".to_owned()))?;
        let view = self.found.get_or_insert_with(|| View {
            components: head.components,
            step: head.step,
            has_other_steps: false,
            values: vec![f64::NAN; nodes.points.len()],
        });
        if head.step != view.step {
            view.has_other_steps = true;
            return Ok(());
        }
        // What has several components is refused at the end.
        if view.components == 1 && head.components == 1 {
            node_values(head.entries, values, nodes, view)
        } else {
            Ok(())
        }
    }

    /// The sizes by the view that is asked for.
    ///
    /// # Errors
    /// It is not there, has several components, or could not be read.
    pub fn sizes(self, notes: &mut Notes) -> Result<Option<PointSizes>, ReadError> {
        let Some(array) = self.asked else { return Ok(None) };
        let Some(view) = self.found else {
            let missing = || SizeError::missing(self.there.iter().map(String::as_str), &array).into();
            return Err(self.damaged.map_or_else(missing, ReadError::from));
        };
        point_sizes::expect_one_component(&array, view.components)?;
        if view.has_other_steps {
            notes.remark(format!("the view {array} has several steps of time: the first one in the file tells sizes"));
        }
        Ok(Some(PointSizes { array, values: view.values }))
    }
}

/// What is wrong in a section, with its place. Nothing follows in what was given.
pub(super) fn place<'a>(fault: SectionError, section: &str, values: &impl Values<'a>) -> MshError {
    let fault = if fault == SectionError::End { SectionError::Short } else { fault };
    told(fault, section.to_owned(), values.location())
}

/// How a section begins, which is read.
pub(super) fn head<'a>(values: &mut impl Values<'a>) -> Result<Head, SectionError> {
    let strings: u64 = number(values.word())?;
    let mut name = None;
    for _ in 0..strings {
        let text = values.text().ok_or(SectionError::Short)?;
        name.get_or_insert_with(|| String::from_utf8_lossy(text).trim().to_owned());
    }
    let reals: u64 = number(values.word())?;
    for _ in 0..reals {
        values.word().ok_or(SectionError::Short)?;
    }
    let integers: u64 = number(values.word())?;
    if integers < 3 {
        return Err(SectionError::Value(format!("{integers} whole numbers do not tell components and nodes")));
    }
    let (step, components, entries) = (number(values.word())?, number(values.word())?, number(values.word())?);
    for _ in 3..integers {
        values.word().ok_or(SectionError::Short)?;
    }
    values.end_line();
    Ok(Head { name: name.unwrap_or_default(), step, components, entries })
}

/// The values of so many nodes, each behind its tag.
fn node_values<'a, V: Values<'a>>(
    count: u64,
    values: &mut V,
    nodes: &Nodes,
    view: &mut View,
) -> Result<(), SectionError> {
    fits(values, "values of nodes", count, V::INT + V::DOUBLE, u64::MAX)?;
    for _ in 0..count {
        let (tag, value) = (values.natural()?, values.double()?);
        let no_node = || SectionError::Value(format!("node {tag} has a value, and there is none of this tag"));
        view.values[nodes.find(tag).ok_or_else(no_node)? as usize] = value;
    }
    expect_end(values, SECTION)
}

/// Checks that nothing follows in a section.
pub(super) fn expect_end<'a>(values: &mut impl Values<'a>, section: &str) -> Result<(), SectionError> {
    match values.word() {
        None => Ok(()),
        Some(word) => {
            let (section, found) = (section.to_owned(), escape(word));
            Err(MshError::NoEnd { section, found, location: values.location() }.into())
        }
    }
}
