//! Labels of triangles from the arrays of cells that they belong to.

use crate::formats::labels::{self, LabelError, Labels};
use crate::formats::numbered::Numbered;
use crate::formats::{LabelSource, Notes, ReadError};
use std::collections::HashMap;

/// Where cells stand in the order in which their arrays count them, whatever their order in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Rank {
    /// Vertices, or the cells of a grid.
    First,
    Lines,
    Polygons,
    Strips,
}

/// The cells of a piece, section by section in the order of the file.
#[derive(Clone, Debug, Default)]
pub(super) struct PieceCells {
    sections: Vec<SectionCells>,
    /// The triangles of the surface behind this piece.
    end: usize,
}

#[derive(Clone, Debug)]
struct SectionCells {
    rank: Rank,
    cells: usize,
    /// The triangles that the surface has before the first of these cells, and behind each; none where they give none.
    begin: usize,
    ends: Vec<u32>,
}

impl PieceCells {
    /// Cells that give no triangles.
    pub fn skip(&mut self, rank: Rank, cells: usize) {
        self.sections.push(SectionCells { rank, cells, begin: 0, ends: Vec::new() });
    }

    /// Cells, with the triangles that the surface has before the first of them, and behind each.
    pub fn add(&mut self, rank: Rank, begin: usize, ends: Vec<u32>) {
        self.end = ends.last().map_or(self.end, |end| *end as usize);
        self.sections.push(SectionCells { rank, cells: ends.len(), begin, ends });
    }

    /// How many cells there are. (Those that give no triangles are as many as the file says.)
    pub fn count(&self) -> u64 {
        self.sections.iter().fold(0, |count, section| count.saturating_add(section.cells as u64))
    }

    /// Per triangle that they give, the number of its cell.
    pub fn of_triangles(&self) -> impl Iterator<Item = usize> {
        self.numbered().flat_map(|(section, first)| {
            let begins = std::iter::once(section.begin).chain(section.ends.iter().map(|end| *end as usize));
            let cells = begins.zip(&section.ends).zip(first..);
            cells.flat_map(|((begin, end), cell)| std::iter::repeat_n(cell, *end as usize - begin))
        })
    }

    /// Each section, in the order of the file, and the number of its first cell.
    fn numbered(&self) -> impl Iterator<Item = (&SectionCells, usize)> {
        let mut order: Vec<usize> = (0..self.sections.len()).collect();
        order.sort_by_key(|section| self.sections[*section].rank);
        let mut first = vec![0; order.len()];
        let mut cells: usize = 0;
        for section in order {
            first[section] = cells;
            cells = cells.saturating_add(self.sections[section].cells);
        }
        self.sections.iter().zip(first)
    }
}

/// The values of an array of cells.
pub(super) enum Values {
    /// The label of each.
    Labels(Vec<u32>),
    /// Numbers that may be no whole ones.
    Floats(Vec<f64>),
}

/// The labels of a file, as its pieces come.
pub(super) struct CellLabels {
    labels: Labels,
    /// The array.
    numbered: Numbered,
    /// The names of numbers, where the file tells them.
    names: HashMap<i64, String>,
}

impl CellLabels {
    /// Labels by the values of an array, the numbers of which may have names.
    pub fn new(source: &LabelSource, array: &str, names: HashMap<i64, String>) -> Self {
        Self { labels: Labels::new(source), numbered: Numbered::new(array), names }
    }

    /// The label of a number.
    #[inline]
    pub fn number(&mut self, number: i128) -> u32 {
        match i64::try_from(number) {
            Ok(number) => {
                let names = &self.names;
                self.numbered.label(number, &mut self.labels, |number| names.get(&number).map(String::as_str))
            }
            Err(_) => self.labels.named(&format!("{}_{number}", self.numbered.array())),
        }
    }

    /// The label of a word.
    pub fn word(&mut self, word: &[u8]) -> u32 {
        self.labels.named(&String::from_utf8_lossy(word))
    }

    /// The triangles of a piece have the values of their cells; those of a piece without the array have none.
    ///
    /// # Errors
    /// A value is no whole number.
    pub fn piece(&mut self, cells: &PieceCells, values: Option<&Values>) -> Result<(), LabelError> {
        let Some(values) = values else {
            self.labels.fill_unnamed(cells.end);
            return Ok(());
        };
        for (section, first) in cells.numbered() {
            let mut begin = section.begin;
            for (cell, end) in (first..).zip(&section.ends) {
                let end = *end as usize;
                if end > begin {
                    let label = self.of_cell(values, cell, begin)?;
                    self.labels.fill(end, label);
                }
                begin = end;
            }
        }
        Ok(())
    }

    /// The label of a cell, whose first triangle has this number.
    fn of_cell(&mut self, values: &Values, cell: usize, triangle: usize) -> Result<u32, LabelError> {
        match values {
            Values::Labels(all) => Ok(all.get(cell).copied().unwrap_or_else(|| self.labels.named(""))),
            Values::Floats(all) => {
                let value = all.get(cell).copied().unwrap_or(f64::NAN);
                self.numbered.label_of_float(value, triangle, &mut self.labels)
            }
        }
    }

    /// All labels.
    pub fn finish(self) -> Labels {
        self.labels
    }
}

/// An array that could label cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate<'a> {
    pub name: &'a str,
    /// Whether it holds floating-point numbers: it is taken only where it is asked for.
    pub is_float: bool,
}

/// Which of these arrays labels triangles.
///
/// # Errors
/// What is asked for is not there.
pub(super) fn chosen<'a>(
    there: impl Iterator<Item = Candidate<'a>> + Clone,
    source: &LabelSource,
) -> Result<Option<&'a str>, LabelError> {
    let is_asked = |name: &str| matches!(source, LabelSource::Array(asked) if asked == name);
    let usable = there.filter(|array| !array.is_float || is_asked(array.name));
    labels::chosen(usable.map(|array| array.name), source)
}

/// What becomes of arrays that cannot be read: they are told, or refused where one is asked for.
///
/// # Errors
/// The refusal.
pub(super) fn damaged(error: ReadError, source: &LabelSource, notes: &mut Notes) -> Result<(), ReadError> {
    if matches!(source, LabelSource::Array(_)) {
        return Err(error);
    }
    notes.remark(format!("the arrays of cells could not be read, so parts of the surface may have no names: {error}"));
    Ok(())
}
