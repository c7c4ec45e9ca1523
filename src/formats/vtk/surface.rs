//! The surface as it grows, piece by piece and cell by cell.

use super::cell::{self, Kind};
use super::cell_labels::{PieceCells, Rank};
use super::error::{Location, VtkError};
use crate::formats::finish::{self, BadPoints};
use crate::formats::labels::Labels;
use crate::formats::{Content, Limits, Notes, ReadError, polygon};
use planish_core::vec3::Vec3;

/// The types of cells.
#[derive(Clone, Copy)]
pub(super) enum Types<'a> {
    /// All have the same.
    All(u8),
    /// Each has its own.
    Each(&'a [u8]),
}

/// Cells of one section of a file: the corners of one after the other, and where each ends.
#[derive(Clone, Copy)]
pub(super) struct Cells<'a> {
    /// What the section is called.
    pub section: &'static str,
    pub types: Types<'a>,
    pub corners: &'a [u32],
    pub ends: &'a [u32],
}

impl Cells<'_> {
    fn rank(&self) -> Rank {
        match self.types {
            Types::All(cell::STRIP) => Rank::Strips,
            Types::All(_) => Rank::Polygons,
            Types::Each(_) => Rank::First,
        }
    }
}

/// Points and triangles so far.
pub(super) struct Surface<'a> {
    limits: &'a Limits,
    notes: Notes,
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    /// The first point of the piece at hand: cells count from there.
    base: usize,
    /// The points that lie on edges; none where there are no curved cells.
    mid_nodes: Vec<bool>,
    /// Cells that are left out, by type.
    skipped: [usize; 256],
    /// Corners of the cell at hand, counted from the first point of the file.
    scratch: Vec<u32>,
    /// The cells of the piece at hand, where their triangles are to be found.
    cells: Option<PieceCells>,
}

impl<'a> Surface<'a> {
    /// Nothing, of a file of this format. Triangles are told by cells afterwards, if `is_labelled` says so.
    pub fn new(limits: &'a Limits, format: String, is_labelled: bool) -> Self {
        Self {
            limits,
            notes: Notes::new(format),
            points: Vec::new(),
            triangles: Vec::new(),
            base: 0,
            mid_nodes: Vec::new(),
            skipped: [0; 256],
            scratch: Vec::new(),
            cells: is_labelled.then(PieceCells::default),
        }
    }

    /// How many points there are.
    pub fn points(&self) -> u64 {
        self.points.len() as u64
    }

    /// How many points there may be.
    pub fn room_for_points(&self) -> u64 {
        self.limits.elements.min(u64::from(u32::MAX) - 1).saturating_sub(self.points.len() as u64)
    }

    /// Begins a piece with these points. (Places are told when it comes to it: to count lines takes time.)
    pub fn add_points(&mut self, points: Vec<Vec3>, location: impl FnOnce() -> Location) -> Result<(), VtkError> {
        let declared = (self.points.len() + points.len()) as u64;
        if points.len() as u64 > self.room_for_points() {
            return Err(VtkError::TooLarge {
                location: location(),
                what: "points",
                declared,
                limit: self.limits.elements,
            });
        }
        self.base = self.points.len();
        // Most files have one piece: its points are not copied.
        if self.points.is_empty() {
            self.points = points;
        } else {
            self.points.extend(points);
        }
        Ok(())
    }

    /// Counts vertices or lines, which are left out.
    pub fn skip(&mut self, rank: Rank, count: usize) {
        self.notes.skip(if rank == Rank::Lines { "lines" } else { "vertices" }, count);
        if let Some(cells) = &mut self.cells {
            cells.skip(rank, count);
        }
    }

    /// The cells of the piece at hand, which is at its end; none where they are not asked for.
    pub fn take_cells(&mut self) -> Option<PieceCells> {
        self.cells.as_mut().map(std::mem::take)
    }

    /// What else there is to tell.
    pub fn notes(&mut self) -> &mut Notes {
        &mut self.notes
    }

    /// Adds the triangles of cells of the piece at hand.
    pub fn add_cells(&mut self, cells: &Cells, location: impl FnOnce() -> Location) -> Result<(), VtkError> {
        // About one triangle a cell, where they are triangles; what a strip gives is not known.
        if !matches!(cells.types, Types::All(cell::STRIP)) {
            self.triangles.reserve(cells.ends.len().min(cells.corners.len() / 3));
        }
        let begin = self.triangles.len();
        let mut triangles = Vec::with_capacity(if self.cells.is_some() { cells.ends.len() } else { 0 });
        let mut start = 0;
        for (cell, end) in cells.ends.iter().enumerate() {
            let Some(corners) = cells.corners.get(start..*end as usize) else {
                let (section, length) = (cells.section, cells.corners.len());
                return Err(VtkError::Offset { cell, section, end: *end, length });
            };
            let cell_type = match cells.types {
                Types::All(one) => one,
                Types::Each(types) => types[cell],
            };
            self.add(cell_type, corners).map_err(|problem| problem.at(cell, cells.section))?;
            if self.triangles.len() as u64 > self.limits.elements {
                let (declared, limit) = (self.triangles.len() as u64, self.limits.elements);
                return Err(VtkError::TooLarge { location: location(), what: "triangles", declared, limit });
            }
            if self.cells.is_some() {
                triangles.push(self.triangles.len() as u32);
            }
            start = *end as usize;
        }
        if let Some(piece) = &mut self.cells {
            piece.add(cells.rank(), begin, triangles);
        }
        Ok(())
    }

    /// Adds what a cell gives.
    fn add(&mut self, cell_type: u8, corners: &[u32]) -> Result<(), BadCell> {
        let (kind, least, most) = cell::kind(cell_type);
        if !(least..=most).contains(&corners.len()) {
            return Err(BadCell::Corners { kind: cell::name(cell_type), corners: corners.len() });
        }
        match (kind, corners) {
            (Kind::Polygon, [a, b, c]) => self.triangle([*a, *b, *c]),
            (Kind::Polygon, [_, _, _, ..]) => self.polygon(corners),
            // The corners of a pixel run row by row, not around it.
            (Kind::Pixel, [a, b, c, d]) => self.polygon(&[*a, *b, *d, *c]),
            (Kind::Strip, [_, _, _, ..]) => self.strip(corners),
            (Kind::Curved { corners: count }, _) => self.curved(&corners[..count], &corners[count..]),
            _ => {
                self.skipped[usize::from(cell_type)] += 1;
                Ok(())
            }
        }
    }

    /// A point of the piece at hand, counted from the first of the file.
    fn point(&self, index: u32) -> Result<u32, BadCell> {
        let points = self.points.len() - self.base;
        // The points of all pieces are fewer than 2^32.
        if (index as usize) < points { Ok(index + self.base as u32) } else { Err(BadCell::Index { index, points }) }
    }

    fn triangle(&mut self, [a, b, c]: [u32; 3]) -> Result<(), BadCell> {
        let triangle = [self.point(a)?, self.point(b)?, self.point(c)?];
        self.triangles.push(triangle);
        Ok(())
    }

    fn polygon(&mut self, corners: &[u32]) -> Result<(), BadCell> {
        let mut all = std::mem::take(&mut self.scratch);
        all.clear();
        for corner in corners {
            all.push(self.point(*corner)?);
        }
        let is_doubtful = polygon::add(&all, &self.points, &mut self.triangles);
        self.notes.polygon(is_doubtful);
        self.scratch = all;
        Ok(())
    }

    fn strip(&mut self, corners: &[u32]) -> Result<(), BadCell> {
        for (i, three) in corners.windows(3).enumerate() {
            // Every other triangle runs the other way round.
            let (b, c) = if i % 2 == 0 { (1, 2) } else { (2, 1) };
            self.triangle([three[0], three[b], three[c]])?;
        }
        Ok(())
    }

    fn curved(&mut self, corners: &[u32], others: &[u32]) -> Result<(), BadCell> {
        self.mid_nodes.resize(self.points.len(), false);
        for other in others {
            let point = self.point(*other)?;
            self.mid_nodes[point as usize] = true;
        }
        match corners {
            [a, b, c] => self.triangle([*a, *b, *c]),
            _ => self.polygon(corners),
        }
    }

    /// The surface with its labels, if there is any.
    pub fn finish(mut self, labels: Labels) -> Result<Content, ReadError> {
        for (cell_type, count) in (0..=255).zip(self.skipped) {
            self.notes.skip(cell::name(cell_type), count);
        }
        self.notes.mid_nodes = self.mid_nodes.iter().filter(|mid| **mid).count();
        finish::content(self.points, self.triangles, labels, self.notes, &BadPoints::default())
    }
}

/// What is wrong with a cell.
enum BadCell {
    Index { index: u32, points: usize },
    Corners { kind: &'static str, corners: usize },
}

impl BadCell {
    fn at(self, cell: usize, section: &'static str) -> VtkError {
        match self {
            Self::Index { index, points } => VtkError::OutOfRange { cell, section, index, points },
            Self::Corners { kind, corners } => VtkError::Corners { cell, section, kind, corners },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::LabelSource;

    const SQUARE: [Vec3; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];

    fn add(cell_type: u8, corners: &[u32]) -> Result<Content, ReadError> {
        let limits = Limits::default();
        let mut surface = Surface::new(&limits, "VTK".to_owned(), false);
        // A piece of its own comes first: cells count from the second.
        for _ in 0..2 {
            surface.add_points([SQUARE, SQUARE, SQUARE].concat(), || Location::Line(1))?;
        }
        let (types, ends) = (Types::All(cell_type), [corners.len() as u32]);
        surface.add_cells(&Cells { section: "CELLS", types, corners, ends: &ends }, || Location::Line(2))?;
        surface.finish(Labels::new(&LabelSource::Ignored))
    }

    fn triangles(cell_type: u8, corners: &[u32]) -> Vec<[u32; 3]> {
        let content = add(cell_type, corners).expect("a surface");
        content.soup.triangles().iter().map(|t| t.map(|v| v - 12)).collect()
    }

    #[test]
    fn every_cell_of_a_surface_gives_its_triangles() {
        assert_eq!(triangles(5, &[0, 1, 2]), [[0, 1, 2]]);
        assert_eq!(triangles(6, &[0, 1, 2, 3]), [[0, 1, 2], [1, 3, 2]]);
        assert_eq!(triangles(9, &[0, 1, 3, 2]), triangles(8, &[0, 1, 2, 3]));
        assert_eq!(triangles(7, &[0, 1, 3, 2]), triangles(9, &[0, 1, 3, 2]));
        for (cell_type, points) in [(22, 6), (34, 7), (69, 3), (69, 10), (76, 6)] {
            let corners: Vec<u32> = (0..points).collect();
            assert_eq!(triangles(cell_type, &corners), [[0, 1, 2]], "{}", cell::name(cell_type));
            let notes = add(cell_type, &corners).expect("a surface").notes;
            assert_eq!((notes.mid_nodes, notes.polygons), (points as usize - 3, 0));
        }
        for (cell_type, points) in [(23, 8), (28, 9), (30, 6), (70, 9)] {
            let corners: Vec<u32> = [0, 1, 3, 2].into_iter().chain(4..points).collect();
            assert_eq!(triangles(cell_type, &corners), triangles(9, &[0, 1, 3, 2]));
        }
    }

    #[test]
    fn other_cells_are_counted_by_their_names() {
        let told = [
            (10, 4, "tetrahedron; their"),
            (27, 13, "quadratic pyramid; their"),
            (42, 12, "polyhedron; their"),
            (3, 2, "line; points"),
            (7, 2, "polygon;"),
            (6, 2, "triangle strip;"),
            (200, 1, "cells of unknown type;"),
            (0, 0, "empty cell;"),
        ];
        for (cell_type, corners, told) in told {
            let error = add(cell_type, &vec![0; corners]).expect_err("no surface");
            assert_eq!(error.notes().map(|notes| notes.skipped[cell::name(cell_type)]), Some(1));
            let text = error.reason().message;
            assert!(text.contains(&format!("only 1 {told}")), "{text}");
        }
    }

    #[test]
    fn broken_cells_are_named() {
        let wrong = |cell_type, corners: &[u32]| add(cell_type, corners).expect_err("broken").reason().message;
        assert!(wrong(5, &[0, 1, 12]).contains("cell 0 of CELLS uses point 12, but there are only 12 points"));
        assert!(wrong(7, &[0, 1, 2, u32::MAX]).contains("uses point 4294967295"));
        assert!(wrong(5, &[0, 1]).contains("is a VTK_TRIANGLE of 2 points"));
        assert!(wrong(22, &[0, 1, 2, 3, 4, 99]).contains("uses point 99"));
        assert!(wrong(69, &[0]).contains("VTK_LAGRANGE_TRIANGLE of 1 points"));
    }

    #[test]
    fn offsets_must_rise_and_end_in_range() {
        let limits = Limits { elements: 5, ..Limits::default() };
        for ends in [&[3, 2, 6][..], &[3, 7], &[7]] {
            let mut surface = Surface::new(&limits, "VTK".to_owned(), false);
            surface.add_points(SQUARE.to_vec(), || Location::Line(1)).expect("few");
            let cells = Cells { section: "Polys", types: Types::All(7), corners: &[0, 1, 2, 2, 1, 3], ends };
            assert!(
                matches!(surface.add_cells(&cells, || Location::Line(2)), Err(VtkError::Offset { .. })),
                "{ends:?}"
            );
        }
    }

    #[test]
    fn limits_hold_for_all_pieces_together() {
        let limits = Limits { elements: 5, ..Limits::default() };
        let mut surface = Surface::new(&limits, "VTK".to_owned(), false);
        surface.add_points(SQUARE.to_vec(), || Location::Line(1)).expect("few");
        let corners: Vec<u32> = [0, 1, 2].repeat(6);
        let cells = Cells { section: "Polys", types: Types::All(7), corners: &corners, ends: &[3, 6, 9, 12, 15, 18] };
        let error = surface.add_cells(&cells, || Location::Line(2)).expect_err("too many");
        assert_eq!(error, VtkError::TooLarge { location: Location::Line(2), what: "triangles", declared: 6, limit: 5 });
        assert!(matches!(surface.add_points(SQUARE.to_vec(), || Location::Line(1)), Err(VtkError::TooLarge { .. })));
    }
}
