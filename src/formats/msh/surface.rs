//! The triangles of an MSH file, as its elements come.

pub use super::elements::Elements;
use super::groups::{Owner, Owners};
use super::nodes::Nodes;
use super::shapes::{Kind, Shape};
use super::values::{SectionError, Values};
use super::{Keep, MshError};
use crate::formats::finish;
use crate::formats::labels::Labels;
use crate::formats::location::Location;
use crate::formats::point_sizes::{self, PointSizes};
use crate::formats::{Content, Fields, Limits, Notes, Patches, ReadError, TooMany, polygon};
use crate::settings::LabelSource;
use std::collections::BTreeMap;

/// Nodes, and the triangles so far.
pub struct Surface<'n> {
    pub(super) nodes: Nodes,
    /// The nodes that lie in the middle of edges and faces; none where all elements have their corners only.
    mids: Vec<bool>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Elements that are no part of a surface.
    skipped: BTreeMap<&'static str, u64>,
    /// Quadrangles, and how many of them are doubtful.
    polygons: [usize; 2],
    /// The nodes of the element at hand.
    at_hand: Vec<u64>,
    /// What is kept of each triangle beside its corners, where that is asked for.
    kept: Option<Kept>,
    /// Which group and entity the elements at hand belong to.
    pub(super) owner: Owner,
    /// Those of all triangles, where they are asked for.
    owners: Option<Owners>,
    /// The elements of all triangles, where they are asked for.
    elements: Option<Elements>,
    pub limits: &'n Limits,
}

/// The new number of each node when those in the middle are left out, whose own is never asked for.
fn numbers_without(mids: &[bool]) -> Vec<u32> {
    let mut numbers = Vec::with_capacity(mids.len());
    let mut kept = 0;
    for is_mid in mids {
        numbers.push(kept);
        kept += u32::from(!*is_mid);
    }
    numbers
}

/// Leaves out what belongs to nodes in the middle.
fn without<T>(mids: &[bool], of_nodes: &mut Vec<T>) {
    let mut left_out = mids.iter();
    of_nodes.retain(|_| left_out.next() != Some(&true));
}

/// What meshes tell of a triangle beside its corners.
#[derive(Default)]
struct Kept {
    /// The nodes in the middle of the sides 01, 12, 20 of a triangle of six nodes.
    mids: Vec<Option<[u32; 3]>>,
    entities: Vec<i64>,
}

impl<'n> Surface<'n> {
    /// No triangles. Of those to come, so much is kept.
    pub(super) fn new(nodes: Nodes, limits: &'n Limits, keep: Keep, keeps_elements: bool) -> Self {
        let (mids, triangles, skipped, at_hand) = (Vec::new(), Vec::new(), BTreeMap::new(), Vec::new());
        let kept = (keep == Keep::Patches).then(Kept::default);
        let (owner, owners) = (Owner::default(), (keep == Keep::Owners).then(Owners::default));
        let elements = keeps_elements.then(Elements::default);
        Self { nodes, mids, triangles, skipped, polygons: [0; 2], at_hand, kept, owner, owners, elements, limits }
    }

    /// Whether elements must be looked at one by one.
    pub(super) fn keeps(&self) -> bool {
        self.kept.is_some()
    }

    /// Counts elements that are no part of a surface.
    pub fn skip(&mut self, kind: &'static str, count: u64) {
        let skipped = self.skipped.entry(kind).or_insert(0);
        *skipped = skipped.saturating_add(count);
        if let Some(elements) = &mut self.elements {
            elements.skip(count);
        }
    }

    /// No more elements come: those that are asked for can be found.
    pub fn sort_elements(&mut self) {
        if let Some(elements) = &mut self.elements {
            elements.sort();
        }
    }

    /// The elements of the triangles, where they are asked for.
    pub fn elements(&self) -> Option<&Elements> {
        self.elements.as_ref()
    }

    /// Reads the nodes of an element, by what reads a number.
    pub fn element<'a, V: Values<'a>>(
        &mut self,
        values: &mut V,
        shape: Shape,
        element: u64,
        number: impl Fn(&mut V) -> Result<u64, SectionError>,
    ) -> Result<(), SectionError> {
        let begin = values.location();
        self.at_hand.clear();
        for _ in 0..shape.nodes {
            self.at_hand.push(number(values)?);
        }
        Ok(self.add(shape, element, values.location_since(begin))?)
    }

    fn add(&mut self, shape: Shape, element: u64, location: Location) -> Result<(), MshError> {
        let mut corners = [0; 4];
        let count = if shape.kind == Kind::Quad { 4 } else { 3 };
        let mut mids = [0; 3];
        for i in 0..self.at_hand.len() {
            let node = self.at_hand[i];
            let found = self.nodes.find(node).ok_or(MshError::NoNode { element, node, location })?;
            if i < count {
                corners[i] = found;
            } else {
                self.mark(found);
                // Elements of higher order have more of them, which nobody asks for.
                if let Some(mid) = mids.get_mut(i - count) {
                    *mid = found;
                }
            }
        }
        self.face(element, &corners[..count]);
        if let Some(kept) = &mut self.kept {
            let is_quadratic = shape.kind == Kind::Triangle && shape.nodes == 6;
            kept.mids.resize(self.triangles.len(), is_quadratic.then_some(mids));
            kept.entities.resize(self.triangles.len(), self.owner.entity);
        }
        Ok(TooMany::check("triangles", self.triangles.len() as u64, self.limits.elements)?)
    }

    /// Marks a node as one in the middle of an edge or face.
    pub(super) fn mark(&mut self, node: u32) {
        if self.mids.is_empty() {
            self.mids = vec![false; self.nodes.points.len()];
        }
        self.mids[node as usize] = true;
    }

    /// Adds a face with these corners, that is the element of this tag.
    #[inline]
    pub(super) fn face(&mut self, element: u64, corners: &[u32]) {
        let is_doubtful = polygon::add(corners, &self.nodes.points, &mut self.triangles);
        self.polygons[0] += usize::from(corners.len() > 3);
        self.polygons[1] += usize::from(is_doubtful);
        if let Some(owners) = &mut self.owners {
            owners.add(self.owner, self.triangles.len());
        }
        if let Some(elements) = &mut self.elements {
            elements.add(element, self.triangles.len());
        }
    }

    /// The owners of the triangles; of none where they are not asked for.
    pub(super) fn owners(&self) -> &Owners {
        static NONE: Owners = Owners(Vec::new());
        self.owners.as_ref().unwrap_or(&NONE)
    }

    /// All triangles with all that was kept of them, and all nodes.
    pub fn finish_patches(self, mut notes: Notes) -> Result<Patches, ReadError> {
        let Self { nodes, mut triangles, kept, .. } = self;
        let Kept { mids, entities } = kept.unwrap_or_default();
        for (kind, count) in self.skipped {
            notes.skip(kind, usize::try_from(count).unwrap_or(usize::MAX));
        }
        // Nodes in the middle of sides must be points that can be, as corners must.
        triangles.extend(mids.iter().flatten());
        let Content { soup, .. } =
            finish::content(nodes.points, triangles, Labels::new(&LabelSource::Ignored), notes, &nodes.bad)?;
        Ok(Patches::new(&soup, mids, Some(entities)))
    }

    /// All triangles, and the nodes without those that lie in the middle of edges and faces only, with their sizes and
    /// fields.
    pub fn finish(
        self,
        labels: Labels,
        mut sizes: Option<PointSizes>,
        mut fields: Fields,
        mut notes: Notes,
    ) -> Result<Content, ReadError> {
        let Self { nodes, mut mids, mut triangles, .. } = self;
        for (kind, count) in self.skipped {
            notes.skip(kind, usize::try_from(count).unwrap_or(usize::MAX));
        }
        [notes.polygons, notes.polygons_doubtful] = self.polygons;
        let Nodes { mut points, mut bad, .. } = nodes;
        if !mids.is_empty() {
            // What is a corner anywhere stays.
            for corner in triangles.iter().flatten() {
                mids[*corner as usize] = false;
            }
            notes.mid_nodes = mids.iter().filter(|mid| **mid).count();
            let numbers = numbers_without(&mids);
            without(&mids, &mut points);
            if let Some(sizes) = &mut sizes {
                without(&mids, &mut sizes.values);
            }
            for field in &mut fields.points {
                let corners = (0..mids.len()).filter(|node| !mids[*node]);
                field.values = field.values.entries(field.components, corners);
            }
            for triangle in &mut triangles {
                *triangle = triangle.map(|node| numbers[node as usize]);
            }
            bad.0.retain(|(node, _)| !mids[*node]);
            for (node, _) in &mut bad.0 {
                *node = numbers[*node] as usize;
            }
        }
        let content = point_sizes::give(finish::content(points, triangles, labels, notes, &bad)?, sizes);
        Ok(Content { fields, ..content })
    }
}
