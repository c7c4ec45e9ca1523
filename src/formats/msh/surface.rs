//! The triangles of an MSH file, as its elements come.

use super::MshError;
use super::nodes::Nodes;
use super::shapes::{Kind, Shape};
use super::values::{Fault, Values};
use crate::formats::place::Place;
use crate::formats::{Limits, Notes, polygon};
use pipeline::mesh::{SoupError, TriangleSoup};
use std::collections::BTreeMap;

/// What a node is in the elements.
const CORNER: u8 = 1;
const MID: u8 = 2;

/// Nodes, and the triangles so far.
pub struct Surface<'n> {
    nodes: Nodes,
    /// What each node is.
    role: Vec<u8>,
    triangles: Vec<[u32; 3]>,
    /// Elements that are no part of a surface.
    skipped: BTreeMap<&'static str, u64>,
    /// Quadrangles, and how many of them are doubtful.
    polygons: [usize; 2],
    /// The nodes of the element at hand.
    at_hand: Vec<u64>,
    pub limits: &'n Limits,
}

impl<'n> Surface<'n> {
    /// No triangles.
    pub fn new(nodes: Nodes, limits: &'n Limits) -> Self {
        let role = vec![0; nodes.points.len()];
        let (triangles, skipped, at_hand) = (Vec::new(), BTreeMap::new(), Vec::new());
        Self { nodes, role, triangles, skipped, polygons: [0; 2], at_hand, limits }
    }

    /// Counts elements that are no part of a surface.
    pub fn skip(&mut self, kind: &'static str, count: u64) {
        let skipped = self.skipped.entry(kind).or_insert(0);
        *skipped = skipped.saturating_add(count);
    }

    /// Reads the nodes of an element, by what reads a number.
    pub fn element<'a, V: Values<'a>>(
        &mut self,
        values: &mut V,
        shape: Shape,
        element: u64,
        number: impl Fn(&mut V) -> Result<u64, Fault>,
    ) -> Result<(), Fault> {
        let begin = values.place();
        self.at_hand.clear();
        for _ in 0..shape.nodes {
            self.at_hand.push(number(values)?);
        }
        Ok(self.add(shape, element, values.place_since(begin))?)
    }

    fn add(&mut self, shape: Shape, element: u64, place: Place) -> Result<(), MshError> {
        let mut corners = [0; 4];
        let count = if shape.kind == Kind::Quad { 4 } else { 3 };
        for (i, node) in self.at_hand.iter().copied().enumerate() {
            let found = self.nodes.find(node).ok_or(MshError::NoNode { element, node, place })?;
            self.role[found as usize] |= if i < count { CORNER } else { MID };
            if i < count {
                corners[i] = found;
            }
        }
        let is_doubtful = polygon::add(&corners[..count], &self.nodes.points, &mut self.triangles);
        self.polygons[0] += usize::from(count > 3);
        self.polygons[1] += usize::from(is_doubtful);
        let (count, limit) = (self.triangles.len() as u64, self.limits.elements);
        if count > limit { Err(MshError::TooMany { what: "triangles", count, limit }) } else { Ok(()) }
    }

    /// All triangles, and the nodes without those that lie in the middle of edges and faces only.
    pub fn finish(self, notes: &mut Notes) -> Result<TriangleSoup, SoupError> {
        let Self { nodes, role, mut triangles, .. } = self;
        for (kind, count) in self.skipped {
            notes.skip(kind, usize::try_from(count).unwrap_or(usize::MAX));
        }
        [notes.polygons, notes.polygons_doubtful] = self.polygons;
        notes.mid_nodes = role.iter().filter(|r| **r == MID).count();
        let mut points = nodes.points;
        if notes.mid_nodes > 0 {
            let mut kept = 0;
            let number = |r: &u8| {
                kept += u32::from(*r != MID);
                // That of nodes in the middle is never asked for.
                kept.saturating_sub(1)
            };
            let numbers: Vec<u32> = role.iter().map(number).collect();
            let mut roles = role.iter();
            points.retain(|_| roles.next() != Some(&MID));
            triangles.iter_mut().for_each(|t| *t = t.map(|node| numbers[node as usize]));
        }
        TriangleSoup::new(points, triangles)
    }
}
