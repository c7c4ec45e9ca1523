//! Fields from the views of nodes and elements (`$NodeData`, `$ElementData`).
//!
//! Of several steps of time of a view the last one in the file is kept: that is where a computation has arrived. Sections of one
//! step belong together, as the parts of a mesh have one each. Nodes and triangles without a value have no number.

use super::MshError;
use super::nodes::Nodes;
use super::sections::fits;
use super::surface::Elements;
use super::values::{SectionError, Values};
use super::views::{Head, head, place};
use crate::formats::fields::{Fields, Keeping, On, Values as FieldValues};
use crate::formats::location::escape;
use crate::formats::{Notes, Source};
use std::collections::HashMap;

/// The name of the section of values at elements.
pub const OF_ELEMENTS: &str = "ElementData";

/// The step of what has no values yet.
const NEVER: u32 = u32::MAX;

/// The views of a file that are kept.
pub struct Kept<'n> {
    keeping: Keeping<'n>,
    views: Vec<View>,
    /// The views by what they are of, and their names.
    numbers: HashMap<(On, String), usize>,
}

/// A view.
struct View {
    on: On,
    name: String,
    components: usize,
    /// The step of time that counts, and how many came before it.
    step: i64,
    steps_before: u32,
    /// Whether it could be read so far.
    is_sound: bool,
    /// Per node or triangle its values of some step; no numbers where it has none.
    values: Vec<f64>,
    /// Per node or triangle, how many steps came before that of its values.
    of_step: Vec<u32>,
}

impl<'n> Kept<'n> {
    /// Nothing yet; none at all where none are wanted.
    pub fn new(source: &Source<'n>) -> Option<Self> {
        source.keeps_fields.then(|| Self {
            keeping: Keeping::new(source.limits, source.bytes.len()),
            views: Vec::new(),
            numbers: HashMap::new(),
        })
    }

    /// Reads a section of values at nodes, of which `values` hold no more.
    ///
    /// # Errors
    /// There are too many values. What else is wrong is told at the end.
    pub fn nodes<'a, V: Values<'a>>(&mut self, values: V, nodes: Option<&Nodes>) -> Result<(), MshError> {
        let count = nodes.map(|nodes| nodes.points.len());
        self.section(On::Points, values, count, |tag, each| {
            let node = nodes.and_then(|nodes| nodes.find(tag));
            let no_node = || SectionError::Value(format!("node {tag} has a value, and there is none of this tag"));
            each(node.ok_or_else(no_node)? as usize);
            Ok(())
        })
    }

    /// The same, of values at elements. Those of elements that are no triangles of the surface do not count.
    ///
    /// # Errors
    /// As [`Self::nodes`].
    pub fn elements<'a, V: Values<'a>>(&mut self, values: V, elements: Option<&Elements>) -> Result<(), MshError> {
        let count = elements.map(Elements::triangles);
        self.section(On::Cells, values, count, |tag, each| {
            // Tags may be the same for very many: where the first has its values, all have.
            elements.into_iter().flat_map(|elements| elements.of_tag(tag)).all(each);
            Ok(())
        })
    }

    /// Counts a section of a sort that is not kept.
    pub fn pass_over(&mut self) {
        self.keeping.pass_over(1);
    }

    /// Reads a section for so many entries, if these are known yet; `find` tells which of them have a tag, as long as these are
    /// new to the step.
    fn section<'a, V: Values<'a>>(
        &mut self,
        on: On,
        mut values: V,
        count: Option<usize>,
        find: impl Fn(u64, &mut dyn FnMut(usize) -> bool) -> Result<(), SectionError>,
    ) -> Result<(), MshError> {
        let section = if on == On::Points { super::views::SECTION } else { OF_ELEMENTS };
        let head = match head(&mut values) {
            Ok(head) => head,
            Err(fault) => {
                self.keeping.leave_out(on, "", place(fault, section, &values));
                return Ok(());
            }
        };
        let Some(count) = count else {
            self.keeping.leave_out(on, &head.name, "it stands before what it belongs to");
            return Ok(());
        };
        let Some(view) = self.view(on, &head, count)? else { return Ok(()) };
        let view = &mut self.views[view];
        view.begin_step(head.step);
        if let Err(fault) = view.read(&head, &mut values, section, find) {
            view.is_sound = false;
            self.keeping.leave_out(on, &head.name, place(fault, section, &values));
        }
        Ok(())
    }

    /// The view of a section, which may be the first one of it; none where it is not kept.
    fn view(&mut self, on: On, head: &Head, count: usize) -> Result<Option<usize>, MshError> {
        if let Some(known) = self.numbers.get(&(on, head.name.clone())).copied() {
            let view = &mut self.views[known];
            let is_alike = view.components as u64 == head.components;
            if view.is_sound && !is_alike {
                view.is_sound = false;
                self.keeping.leave_out(on, &head.name, "its sections differ in their numbers of components");
            }
            return Ok(Some(known).filter(|_| is_alike && self.views[known].is_sound));
        }
        let is_admitted = self.keeping.admits(on, &head.name, head.components, count as u64)?;
        let components = if is_admitted { head.components as usize } else { 0 };
        self.views.push(View {
            on,
            name: head.name.clone(),
            components,
            step: head.step,
            steps_before: 0,
            is_sound: is_admitted,
            values: vec![f64::NAN; components * count],
            of_step: vec![NEVER; if is_admitted { count } else { 0 }],
        });
        let number = self.views.len() - 1;
        self.numbers.insert((on, head.name.clone()), number);
        Ok(Some(number).filter(|_| is_admitted))
    }

    /// All that is kept.
    pub fn finish(mut self, elements: Option<&Elements>, notes: &mut Notes) -> Fields {
        for view in self.views.into_iter().filter(|view| view.is_sound) {
            if view.steps_before > 0 {
                let (name, step) = (escape(view.name.as_bytes()), view.step);
                self.keeping.remark(format_args!(
                    "the view {name} has several steps of time: the last one in the file, {step}, is kept"
                ));
            }
            let (on, name, components) = (view.on, view.name.clone(), view.components);
            self.keeping.add(on, &name, components, FieldValues::Floats(view.of_last_step()));
        }
        if let Some(elements) = elements.filter(|_| self.keeping.has_cells()) {
            self.keeping.set_cell(elements.cut());
        }
        self.keeping.finish(notes)
    }
}

impl View {
    /// Values of another step take the place of those before.
    fn begin_step(&mut self, step: i64) {
        if step != self.step {
            self.step = step;
            // As many as there are sections at most.
            self.steps_before = (self.steps_before + 1).min(NEVER - 1);
        }
    }

    /// The values of the step that counts.
    fn of_last_step(mut self) -> Vec<f64> {
        for (entry, step) in self.values.chunks_exact_mut(self.components).zip(&self.of_step) {
            if *step != self.steps_before {
                entry.fill(f64::NAN);
            }
        }
        self.values
    }

    /// Reads the values of a section, each entry behind its tag.
    fn read<'a, V: Values<'a>>(
        &mut self,
        head: &Head,
        values: &mut V,
        section: &'static str,
        find: impl Fn(u64, &mut dyn FnMut(usize) -> bool) -> Result<(), SectionError>,
    ) -> Result<(), SectionError> {
        let components = self.components;
        let bytes = V::INT.saturating_add(V::DOUBLE.saturating_mul(components as u64));
        fits(values, "values of a view", head.entries, bytes, u64::MAX)?;
        // Where there are entries, so many components fit in the file.
        let mut entry = vec![0.0; if head.entries > 0 { components } else { 0 }];
        for _ in 0..head.entries {
            let tag = values.natural()?;
            for number in &mut entry {
                *number = values.double()?;
            }
            find(tag, &mut |at| {
                let is_new = self.of_step[at] != self.steps_before;
                if is_new {
                    self.values[components * at..][..components].copy_from_slice(&entry);
                    self.of_step[at] = self.steps_before;
                }
                is_new
            })?;
        }
        super::views::expect_end(values, section)
    }
}
