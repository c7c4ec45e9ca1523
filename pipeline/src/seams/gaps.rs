//! Where the boundary of a chart comes close to itself.
//!
//! A mesher puts nodes along curves, and where two of them pass each other nearer than an edge is long, triangles lie across
//! that are all edge and no height. How wide a chart is on the whole says nothing of it: a hole may nearly touch the
//! outline of a broad plate.

use super::SeamNetwork;
use crate::mesh::SurfaceMesh;
use crate::topology::{ChartId, CurveId};
use crate::vec3::{Vec3, distance, dot, sub};
use std::collections::BTreeMap;

/// Around a corner is no other part, nor is what a wiggle comes back to: along the boundary that is further than so many times
/// the widest gap. With 1, there were gaps everywhere along seams of raw plates of marching cubes, which run in zigzag and
/// around slivers, and at sharp corners, where elements lean as the corner does, however small they are.
const FAR: f64 = 4.0;

/// Boundaries are looked at in pieces of this share of the widest gap that is asked for: a width is off by no more than that
/// of a piece that is bent, and places are known as exactly.
const PIECE: f64 = 0.125;

/// Pieces of a loop at most, about: they become longer where there would be more. Edges are then shorter than a
/// five-thousandth of the loop. Of generic_twin_7081 all loops together are a million edges long.
const MOST_PIECES: f64 = 2e4;

/// A place where the boundary of a chart comes close to another part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    /// The curve.
    pub curve: CurveId,
    /// A place on it.
    pub place: Vec3,
    /// How far it is from there to the other part, in the unit of the input.
    pub width: f64,
    /// How much of the curve it stands for, likewise.
    pub length: f64,
}

impl SeamNetwork {
    /// The places at which the boundary of a chart passes another part of the same boundary at less than `widest` (in the
    /// unit of the input), about an eighth of that apart, along its loops. Distances are those in space.
    ///
    /// # Example
    ///
    /// A strip is narrow all along, but for its ends: what lies around a corner is no other part.
    ///
    /// ```
    /// use planish_core::decompose::assemble;
    /// use planish_core::mesh::TriangleSoup;
    /// use planish_core::repair;
    /// use planish_core::seams::SeamNetwork;
    /// use planish_core::topology::ChartId;
    ///
    /// let points = vec![[0.0, 0.0, 0.0], [40.0, 0.0, 0.0], [40.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    /// let soup = TriangleSoup::new(points, vec![[0, 1, 2], [0, 2, 3]])?;
    /// let mesh = repair(&soup, &repair::Settings::default())?.mesh;
    /// let network = SeamNetwork::new(&mesh, assemble(&mesh, &[0, 0])?.charts(), 0.0);
    /// let gaps = network.gaps(&mesh, ChartId(0), 2.0);
    /// assert!(gaps.len() > 200 && gaps.iter().all(|gap| gap.place[0] > 2.5 && gap.place[0] < 37.5));
    /// let in_the_middle = gaps.iter().filter(|gap| (gap.place[0] - 20.0).abs() < 16.0);
    /// assert!(in_the_middle.clone().count() > 200 && in_the_middle.clone().all(|gap| (gap.width - 1.0).abs() < 1e-9));
    /// assert!(network.gaps(&mesh, ChartId(0), 0.9).is_empty());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn gaps(&self, mesh: &SurfaceMesh, chart: ChartId, widest: f64) -> Vec<Gap> {
        let pieces = self.pieces(mesh, chart, PIECE * widest);
        Near::new(&pieces, widest).gaps()
    }

    /// The boundary of a chart in pieces of about the length `step`.
    fn pieces(&self, mesh: &SurfaceMesh, chart: ChartId, step: f64) -> Vec<Piece> {
        let mut pieces = Vec::new();
        for passages in self.loops(chart) {
            let around: f64 = passages.iter().map(|p| self.curves[p.curve.index()].length()).sum();
            let mut turn = Turn { step: step.max(around / MOST_PIECES), around, at: 0.0, first: pieces.len() };
            for passage in passages {
                let curve = &self.curves[passage.curve.index()];
                let mut line: Vec<Vec3> = curve.vertices().iter().map(|v| mesh.points()[v.index()]).collect();
                if !passage.forward {
                    line.reverse();
                }
                turn.along(&line, passage.curve, &mut pieces);
            }
        }
        pieces
    }
}

/// A piece of a loop, nearly straight.
struct Piece {
    ends: [Vec3; 2],
    curve: CurveId,
    /// Where along the loop its middle is.
    at: f64,
    /// The length along the loop.
    length: f64,
    /// The position of the first piece of the loop, and the length of that.
    first: usize,
    around: f64,
}

/// A loop while it is cut into pieces.
struct Turn {
    step: f64,
    around: f64,
    /// How far along it is cut.
    at: f64,
    first: usize,
}

impl Turn {
    /// Cuts a polyline: long segments into equal parts, and short ones are joined until they are long enough.
    fn along(&mut self, line: &[Vec3], curve: CurveId, pieces: &mut Vec<Piece>) {
        let (mut begin, mut length) = (line[0], 0.0);
        for (k, segment) in line.windows(2).enumerate() {
            length += distance(segment[0], segment[1]);
            let is_last = k + 2 == line.len();
            if length < self.step && !is_last {
                continue;
            }
            let end = segment[1];
            // Finite: no loop is longer than so many steps.
            let parts = (length / self.step).ceil().clamp(1.0, MOST_PIECES);
            for part in 0..parts as usize {
                let at = |share: f64| [0, 1, 2].map(|k| begin[k] + share * (end[k] - begin[k]));
                let ends = [at(part as f64 / parts), at((part as f64 + 1.0) / parts)];
                let middle = self.at + (part as f64 + 0.5) / parts * length;
                let length = length / parts;
                pieces.push(Piece { ends, curve, at: middle, length, first: self.first, around: self.around });
            }
            self.at += length;
            (begin, length) = (end, 0.0);
        }
    }
}

impl Piece {
    fn middle(&self) -> Vec3 {
        [0, 1, 2].map(|k| 0.5 * (self.ends[0][k] + self.ends[1][k]))
    }

    /// How far it is along the loop to another place on it.
    fn between(&self, at: f64) -> f64 {
        let between = (self.at - at).abs();
        between.min(self.around - between)
    }

    /// How far a point is from the piece, and where on its loop that is.
    fn nearest(&self, p: Vec3) -> (f64, f64) {
        let along = sub(self.ends[1], self.ends[0]);
        let squared = dot(along, along);
        let t = if squared > 0.0 { (dot(sub(p, self.ends[0]), along) / squared).clamp(0.0, 1.0) } else { 0.5 };
        let foot = [0, 1, 2].map(|k| self.ends[0][k] + t * along[k]);
        (distance(foot, p), self.at + (t - 0.5) * self.length)
    }
}

/// The pieces of a chart, by the cells of a grid in which their middles lie.
struct Near<'a> {
    pieces: &'a [Piece],
    cells: BTreeMap<[i64; 3], Vec<u32>>,
    widest: f64,
    /// The side of a cell: no piece that is near enough has its middle further away.
    side: f64,
}

impl<'a> Near<'a> {
    fn new(pieces: &'a [Piece], widest: f64) -> Self {
        let longest = pieces.iter().map(|piece| piece.length).fold(0.0, f64::max);
        let mut near = Self { pieces, cells: BTreeMap::new(), widest, side: widest + 0.5 * longest };
        for (i, piece) in pieces.iter().enumerate() {
            near.cells.entry(near.cell(piece.middle())).or_default().push(i as u32);
        }
        near
    }

    fn cell(&self, p: Vec3) -> [i64; 3] {
        // Saturates: far away all lies in one cell, and is looked at all the same.
        p.map(|c| (c / self.side).floor() as i64)
    }

    fn gaps(&self) -> Vec<Gap> {
        let mut widths = vec![f64::INFINITY; self.pieces.len()];
        let mut around = Vec::new();
        for (cell, within) in &self.cells {
            self.gather(*cell, &mut around);
            for i in within {
                widths[*i as usize] = self.width(&self.pieces[*i as usize], &around);
            }
        }
        let mut gaps = Vec::new();
        for (piece, width) in self.pieces.iter().zip(widths) {
            if width < self.widest {
                gaps.push(Gap { curve: piece.curve, place: piece.middle(), width, length: piece.length });
            }
        }
        gaps
    }

    /// The pieces in a cell and those around it.
    fn gather(&self, [x, y, z]: [i64; 3], pieces: &mut Vec<u32>) {
        pieces.clear();
        for k in 0..27 {
            let beside = [x.saturating_add(k % 3 - 1), y.saturating_add(k / 3 % 3 - 1), z.saturating_add(k / 9 - 1)];
            pieces.extend(self.cells.get(&beside).into_iter().flatten());
        }
    }

    /// How far it is from the middle of a piece to another part of the boundary, out of these pieces; the widest gap where none
    /// is nearer.
    fn width(&self, piece: &Piece, around: &[u32]) -> f64 {
        let place = piece.middle();
        let mut least = self.widest;
        for other in around.iter().map(|i| &self.pieces[*i as usize]) {
            // Most of them follow on the same loop: not worth a closer look.
            if other.first == piece.first && piece.between(other.at) < FAR * self.widest {
                continue;
            }
            let (away, at) = other.nearest(place);
            if away < least && self.is_apart(piece, other, at) {
                least = away;
            }
        }
        least
    }

    /// Whether the place `at` on the loop of `other` is another part of the boundary (see [`FAR`]).
    fn is_apart(&self, piece: &Piece, other: &Piece, at: f64) -> bool {
        other.first != piece.first || piece.between(at) > FAR * self.widest + 0.5 * piece.length
    }
}
