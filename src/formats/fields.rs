//! Fields: the arrays of numbers that a file has at its points and cells, which go with the surface into surface.vtu.
//!
//! Readers find them (`Keeping`), and whoever writes a surface carries them to its nodes. Whole numbers are names more often
//! than quantities (parts, flags, colours): they stay whole, and no number is made that the file does not have.

use super::location::escape;
use super::{Limits, Notes, TooMany};
use planish_core::mesh::TriangleSoup;
use planish_core::repair::first_points;
use std::collections::BTreeSet;

/// Arrays that are kept of a file, at most: each is told in the report.
const MOST: usize = 1_000;

/// Remarks on arrays, at most.
const TOLD: usize = 10;

/// Characters of a name that are kept, at most.
const NAME: usize = 200;

/// What planish calls its own arrays in surface.vtu. Fields of these names get another.
pub(super) const OWN: [&str; 13] = [
    "uv",
    "vertex",
    "chart",
    "triangle",
    "det_min",
    "det_max",
    "jacobian_ratio",
    "conformal_distortion",
    "area_scale",
    "untangled",
    "colour",
    "label",
    "cell",
];

/// What stands before the name of a field that is called like an array of planish.
const PREFIX: &str = "input_";

/// Arrays that hide cells and points wherever they are shown: there is nothing to hide on the surface.
const HIDING: [&str; 2] = ["vtkGhostType", "vtkGhostLevels"];

/// How arrays are counted that hold no numbers, or hide what is there.
const PASSED_OVER: &str = "arrays without values to keep";

/// The fields of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fields {
    /// An entry for each point of the soup; after [`Self::by_vertex`] one for each vertex.
    pub points: Vec<Field>,
    /// An entry for each triangle of the soup: those of a cell that was cut have one each.
    pub cells: Vec<Field>,
    /// Per triangle of the soup, the number of its cell in the file, from 0, where there are fields of cells and a cell was cut
    /// into several triangles; else nothing.
    pub cell: Vec<i64>,
}

/// An array.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its name in surface.vtu: unlike that of any other there.
    pub name: String,
    /// Its name in the file, where that is another.
    pub input_name: Option<String>,
    /// How many numbers make an entry, at least one.
    pub components: usize,
    /// The entries, one after the other.
    pub values: Values,
}

/// The numbers of an array.
#[derive(Clone, Debug, PartialEq)]
pub enum Values {
    /// Whole ones.
    Integers(Vec<i64>),
    /// Any, also such that are none.
    Floats(Vec<f64>),
}

impl Values {
    /// How many numbers there are.
    pub fn len(&self) -> usize {
        match self {
            Self::Integers(values) => values.len(),
            Self::Floats(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether they are whole.
    pub fn are_integers(&self) -> bool {
        matches!(self, Self::Integers(_))
    }

    /// These, followed by others: whole ones only where all are.
    pub(super) fn followed_by(self, others: Self) -> Self {
        match (self, others) {
            (values, others) if others.is_empty() => values,
            (values, others) if values.is_empty() => others,
            (Self::Integers(mut values), Self::Integers(others)) => {
                values.extend(others);
                Self::Integers(values)
            }
            (values, others) => {
                let mut values = values.into_floats();
                values.extend(others.into_floats());
                Self::Floats(values)
            }
        }
    }

    fn into_floats(self) -> Vec<f64> {
        match self {
            Self::Integers(values) => values.into_iter().map(|value| value as f64).collect(),
            Self::Floats(values) => values,
        }
    }

    /// The entries with these numbers, of so many components. There may be an entry of each.
    pub(super) fn entries(&self, components: usize, numbers: impl Iterator<Item = usize>) -> Self {
        match self {
            Self::Integers(values) => Self::Integers(entries(values, components, numbers)),
            Self::Floats(values) => Self::Floats(entries(values, components, numbers)),
        }
    }
}

fn entries<T: Copy>(values: &[T], components: usize, numbers: impl Iterator<Item = usize>) -> Vec<T> {
    numbers.flat_map(|number| &values[components * number..components * (number + 1)]).copied().collect()
}

impl Field {
    /// A field that planish makes itself.
    pub fn new(name: impl Into<String>, components: usize, values: Values) -> Self {
        Self { name: name.into(), input_name: None, components, values }
    }

    /// One of its numbers, as a double.
    pub fn number(&self, at: usize) -> f64 {
        match &self.values {
            Values::Integers(values) => values[at] as f64,
            Values::Floats(values) => values[at],
        }
    }
}

impl Fields {
    /// Whether there are none.
    pub fn are_none(&self) -> bool {
        self.points.is_empty() && self.cells.is_empty()
    }

    /// Bytes that the values take.
    pub fn bytes(&self) -> u64 {
        let fields = self.points.iter().chain(&self.cells).map(|field| field.values.len());
        8 * (fields.sum::<usize>() + self.cell.len()) as u64
    }

    /// The same with an entry for each vertex of the surface after welding, in their order, instead of each point of `soup`: that
    /// of the first point of those that became one.
    pub fn by_vertex(mut self, soup: &TriangleSoup) -> Self {
        if self.points.is_empty() {
            return self;
        }
        let first = first_points(soup.points());
        if first.len() < soup.points().len() {
            for field in &mut self.points {
                field.values = field.values.entries(field.components, first.iter().map(|point| *point as usize));
            }
        }
        self
    }
}

/// What an array has entries for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum On {
    Points,
    Cells,
}

/// The fields of a file as they are found, and what is to be told of those that are not kept.
pub(super) struct Keeping<'n> {
    limits: &'n Limits,
    /// Bytes that the values of further arrays may take.
    room: u64,
    /// Values that were admitted.
    values: u64,
    /// The arrays that were.
    admitted: BTreeSet<(On, String)>,
    fields: Fields,
    /// What is told of arrays, one by one, and of how many nothing is told.
    left_out: Vec<String>,
    untold: usize,
    passed_over: usize,
}

impl<'n> Keeping<'n> {
    /// Nothing yet, of a file of so many bytes.
    pub fn new(limits: &'n Limits, file: usize) -> Self {
        Self {
            limits,
            room: limits.unpacked(file),
            values: 0,
            admitted: BTreeSet::new(),
            fields: Fields::default(),
            left_out: Vec::new(),
            untold: 0,
            passed_over: 0,
        }
    }

    /// Whether an array is to be kept, of so many components and entries: before any memory is taken for it. Of several of one
    /// name the first one counts.
    ///
    /// # Errors
    /// All arrays together have too many values.
    pub fn admits(&mut self, on: On, name: &str, components: u64, entries: u64) -> Result<bool, TooMany> {
        if HIDING.contains(&name) || components == 0 {
            self.passed_over += 1;
            return Ok(false);
        }
        if self.admitted.len() == MOST {
            self.leave_out(on, name, format!("there are {MOST} others"));
            return Ok(false);
        }
        if self.admitted.contains(&(on, name.to_owned())) {
            self.leave_out(on, name, "another one before it has the same name");
            return Ok(false);
        }
        // One entry is in memory at least while it is read.
        let values = components.saturating_mul(entries.max(1));
        self.values = self.values.saturating_add(values);
        TooMany::check("values of arrays", self.values, self.limits.elements)?;
        let Some(room) = self.room.checked_sub(values.saturating_mul(8)) else {
            self.values -= values;
            let most = self.limits.expansion;
            self.leave_out(
                on,
                name,
                format!("the values of arrays become more than {most} times as large as the file"),
            );
            return Ok(false);
        };
        self.room = room;
        self.admitted.insert((on, name.to_owned()));
        Ok(true)
    }

    /// Keeps an array that was admitted.
    pub fn add(&mut self, on: On, name: &str, components: usize, values: Values) {
        let field = Field { name: name.to_owned(), input_name: None, components, values };
        self.of(on).push(field);
    }

    /// Tells that an array is not kept, and why.
    pub fn leave_out(&mut self, on: On, name: &str, why: impl std::fmt::Display) {
        let what = match on {
            On::Points => "points",
            On::Cells => "cells",
        };
        self.remark(format_args!("the array \"{}\" of {what} is not kept: {why}", escape(name.as_bytes())));
    }

    /// Tells something else of arrays.
    pub fn remark(&mut self, remark: impl std::fmt::Display) {
        // There may be very many.
        match self.left_out.len() < TOLD {
            true => self.left_out.push(remark.to_string()),
            false => self.untold += 1,
        }
    }

    /// Counts arrays that hold no numbers.
    pub fn pass_over(&mut self, arrays: usize) {
        self.passed_over += arrays;
    }

    /// Whether there are fields of cells.
    pub fn has_cells(&self) -> bool {
        !self.fields.cells.is_empty()
    }

    /// Tells which triangles were one cell.
    pub fn set_cell(&mut self, cell: Vec<i64>) {
        self.fields.cell = cell;
    }

    fn of(&mut self, on: On) -> &mut Vec<Field> {
        match on {
            On::Points => &mut self.fields.points,
            On::Cells => &mut self.fields.cells,
        }
    }

    /// All fields, each with the name that it has in surface.vtu. What is not kept is told.
    pub fn finish(mut self, notes: &mut Notes) -> Fields {
        notes.skip(PASSED_OVER, self.passed_over);
        self.left_out.into_iter().for_each(|remark| notes.remark(remark));
        if self.untold > 0 {
            notes.remark(format!("of {} more arrays something is to be told of this sort", self.untold));
        }
        name(&mut self.fields.points);
        name(&mut self.fields.cells);
        self.fields
    }
}

/// Gives fields names that are unlike those of planish's own arrays, and of each other.
fn name(fields: &mut [Field]) {
    let mut taken = BTreeSet::new();
    let mut to_rename = Vec::new();
    for (i, field) in fields.iter_mut().enumerate() {
        let name = plain(&field.name);
        field.input_name = (name != field.name).then(|| std::mem::replace(&mut field.name, name.clone()));
        if OWN.contains(&name.as_str()) || !taken.insert(name) {
            to_rename.push(i);
        }
    }
    // Those that have names of their own keep them: others give way.
    for i in to_rename {
        let field = &mut fields[i];
        let mut name = format!("{PREFIX}{}", field.name);
        while OWN.contains(&name.as_str()) || !taken.insert(name.clone()) {
            name.insert_str(0, PREFIX);
        }
        let before = std::mem::replace(&mut field.name, name);
        field.input_name.get_or_insert(before);
    }
}

/// A name as XML can hold it, without control characters, and not too long.
fn plain(name: &str) -> String {
    let is_plain = |c: char| !c.is_control() && !matches!(c, '\u{fffe}' | '\u{ffff}');
    let plain: String = name.chars().take(NAME).map(|c| if is_plain(c) { c } else { '_' }).collect();
    if plain.is_empty() { "array".to_owned() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(names: &[&str]) -> Vec<(String, Option<String>)> {
        let limits = Limits::default();
        let mut keeping = Keeping::new(&limits, 0);
        for name in names {
            keeping.add(On::Cells, name, 1, Values::Integers(vec![0]));
        }
        let fields = keeping.finish(&mut Notes::default()).cells;
        fields.into_iter().map(|field| (field.name, field.input_name)).collect()
    }

    #[test]
    fn fields_give_way_to_arrays_of_planish_and_to_each_other() {
        let own = |name: &str| (name.to_owned(), None);
        let other = |name: &str, input: &str| (name.to_owned(), Some(input.to_owned()));
        assert_eq!(kept(&["uv", "pressure", "UV"]), [other("input_uv", "uv"), own("pressure"), own("UV")]);
        // Who has a name of its own keeps it, wherever it stands.
        assert_eq!(
            kept(&["chart", "input_chart", "a\tb", "a_b", ""]),
            [
                other("input_input_chart", "chart"),
                own("input_chart"),
                other("a_b", "a\tb"),
                other("input_a_b", "a_b"),
                other("array", "")
            ]
        );
        assert_eq!(kept(&["x".repeat(300).as_str()])[0].0.len(), NAME);
    }

    #[test]
    fn too_many_values_are_refused_and_what_is_far_larger_than_the_file_is_left_out() {
        let limits = Limits { elements: 30_000_000, ..Limits::default() };
        let mut keeping = Keeping::new(&limits, 0);
        assert_eq!(keeping.admits(On::Points, "v", 3, 1000), Ok(true));
        for (name, components) in [("vtkGhostType", 1), ("none", 0)] {
            assert_eq!(keeping.admits(On::Cells, name, components, 10), Ok(false));
        }
        assert_eq!(keeping.admits(On::Points, "large", 1, 14_000_000), Ok(false));
        let refused = keeping.admits(On::Points, "too large", u64::MAX, 2).expect_err("too many");
        assert!(refused.to_string().starts_with("18446744073709551615 values of arrays exceed the limit of 30000000"));
        let mut notes = Notes::default();
        keeping.finish(&mut notes);
        assert_eq!(notes.skipped[PASSED_OVER], 2);
        assert_eq!(
            notes.remarks,
            [
                "the array \"large\" of points is not kept: the values of arrays become more than 100 times as large as the file"
            ]
        );
    }

    #[test]
    fn only_so_many_arrays_are_kept_and_told() {
        let limits = Limits::default();
        let mut keeping = Keeping::new(&limits, 0);
        for i in 0..MOST + 15 {
            assert_eq!(keeping.admits(On::Points, &i.to_string(), 1, 3), Ok(i < MOST));
        }
        let mut notes = Notes::default();
        keeping.finish(&mut notes);
        assert_eq!(
            (notes.remarks.len(), notes.remarks[TOLD].as_str()),
            (TOLD + 1, "of 5 more arrays something is to be told of this sort")
        );
    }

    #[test]
    fn whole_numbers_stay_whole_among_themselves() {
        let whole = || Values::Integers(vec![1, i64::MAX]);
        let float = || Values::Floats(vec![0.5]);
        assert_eq!(whole().followed_by(Values::Integers(vec![2])), Values::Integers(vec![1, i64::MAX, 2]));
        assert_eq!(whole().followed_by(float()), Values::Floats(vec![1.0, i64::MAX as f64, 0.5]));
        assert_eq!(Values::Floats(vec![]).followed_by(whole()), whole());
        assert_eq!(whole().followed_by(Values::Floats(vec![])), whole());
        assert_eq!(Values::Integers(vec![1, 2, 3, 4]).entries(2, [1, 0, 1].into_iter()), {
            Values::Integers(vec![3, 4, 1, 2, 3, 4])
        });
    }

    #[test]
    fn points_that_become_one_have_the_values_of_the_first() {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [-0.0; 3], [0.0, 1.0, 0.0]];
        let soup = TriangleSoup::new(points, vec![[0, 1, 3], [2, 1, 3]]).expect("a soup");
        let values = Values::Floats([1.0, f64::NAN, 7.0, 3.0].iter().flat_map(|v| [*v, -v]).collect());
        let field = Field { name: "p".to_owned(), input_name: None, components: 2, values };
        let fields = Fields { points: vec![field], ..Fields::default() }.by_vertex(&soup);
        let Values::Floats(found) = &fields.points[0].values else { panic!("floats") };
        assert!(found[..2] == [1.0, -1.0] && found[2].is_nan() && found[4..] == [3.0, -3.0] && found.len() == 6);
    }
}
