//! A hierarchy of bounding boxes: what lies near a point, or in a box, is found without looking at all.
//!
//! Items are boxes, sorted along a Z-curve through their centres (Morton 1966) and parted where the curve goes from one
//! half of a cell to the other (Lauterbach et al. 2009, *Fast BVH construction on GPUs*, doi
//! 10.1111/j.1467-8659.2009.01377.x), down to a few in a leaf. Building takes one sort, a query O(log n + found) on surfaces.
//! The hierarchy depends on the boxes and their order alone.

use crate::vec3::{BoundingBox, Vec3};

/// So many items are looked at one by one: below it, boxes cost more than they save. By experience.
const LEAF: usize = 4;

/// Cells along each axis, as a power of two: the numbers of all three fit 64 bits.
const BITS: u32 = 21;

/// So many times items are parted by cells, and then by their count: crowds in one corner do not make the hierarchy deep.
const BY_CELLS: usize = 31;

/// As deep as a hierarchy of 2^32 items can be.
const DEPTH: usize = BY_CELLS + 33;

/// Items by their boxes.
///
/// ```
/// use planish_core::evaluate::Bvh;
/// use planish_core::vec3::BoundingBox;
///
/// let boxes = [0.0, 1.0, 5.0].map(|x| BoundingBox { min: [x, 0.0, 0.0], max: [x + 2.0, 1.0, 1.0] });
/// let tree = Bvh::new(boxes);
/// let (mut pairs, mut right) = (vec![], vec![]);
/// tree.pairs(|i, j| pairs.push((i, j)));
/// assert_eq!(pairs, [(0, 1)]);
/// tree.overlapping(&BoundingBox { min: [6.0, 0.0, 0.0], max: [9.0, 1.0, 1.0] }, |i| right.push(i));
/// assert_eq!(right, [2]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// Those of a leaf beside each other.
    items: Vec<Item>,
}

/// An item by its box.
#[derive(Clone, Copy, Debug)]
struct Item {
    around: BoundingBox,
    number: u32,
}

/// A box around some items, and its two parts; a leaf has none.
#[derive(Clone, Copy, Debug)]
struct Node {
    around: BoundingBox,
    first: u32,
    end: u32,
    /// The second part; the first one is the next node. 0 in a leaf.
    second: u32,
}

impl Bvh {
    /// A hierarchy of `boxes`: item `i` is the `i`-th of them.
    pub fn new(boxes: impl IntoIterator<Item = BoundingBox>) -> Self {
        let boxes: Vec<BoundingBox> = boxes.into_iter().collect();
        let cells = sorted_cells(&boxes.iter().map(centre).collect::<Vec<_>>());
        let items = cells.iter().map(|(_, number)| Item { around: boxes[*number as usize], number: *number }).collect();
        let mut tree = Self { nodes: Vec::with_capacity(boxes.len()), items };
        if !cells.is_empty() {
            tree.build(&cells, 0, cells.len(), 0);
        }
        tree
    }

    /// Builds the part of `items[first..end]`, not empty; its node and its box.
    fn build(&mut self, cells: &[(u64, u32)], first: usize, end: usize, depth: usize) -> (u32, BoundingBox) {
        let at = self.nodes.len();
        let items = &self.items[first..end];
        let around = items[0].around;
        // Before its parts, so that the first of these is the next node. The box is not known yet.
        self.nodes.push(Node { around, first: first as u32, end: end as u32, second: 0 });
        let (around, second) = if items.len() > LEAF {
            let middle = first + parting(&cells[first..end], depth);
            let (_, before) = self.build(cells, first, middle, depth + 1);
            let (second, behind) = self.build(cells, middle, end, depth + 1);
            (joined(before, behind), second)
        } else {
            (items[1..].iter().fold(around, |all, item| joined(all, item.around)), 0)
        };
        let node = &mut self.nodes[at];
        (node.around, node.second) = (around, second);
        (at as u32, around)
    }

    /// The items of a node.
    fn items_of(&self, node: &Node) -> &[Item] {
        &self.items[node.first as usize..node.end as usize]
    }

    /// Calls `visit` with every item whose box meets `around`.
    pub fn overlapping(&self, around: &BoundingBox, mut visit: impl FnMut(u32)) {
        let mut open = Stack::default();
        let mut next = (!self.nodes.is_empty()).then_some(0_u32);
        while let Some(at) = next {
            let node = &self.nodes[at as usize];
            let meets = meet(&node.around, around);
            if meets && node.second > 0 {
                open.push(node.second);
                next = Some(at + 1);
                continue;
            }
            let items = if meets { self.items_of(node) } else { &[] };
            items.iter().filter(|item| meet(&item.around, around)).for_each(|item| visit(item.number));
            next = open.pop();
        }
    }

    /// The item with the least squared distance to `x`, if one is nearer than the root of `bound`; `distance` tells that of
    /// an item, which must be no less than that to its box. Of equal ones, the first that is met.
    pub fn nearest(&self, x: Vec3, bound: f64, mut distance: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut least = bound;
        let mut open = Stack::default();
        let mut next = self.nodes.first().map(|root| (gap(&root.around, x), 0_u32));
        while let Some((far, at)) = next {
            let node = &self.nodes[at as usize];
            if far < least && node.second > 0 {
                let (first, second) = (self.part(at + 1, x), self.part(node.second, x));
                let is_ordered = first.0 <= second.0;
                open.push(if is_ordered { second } else { first });
                next = Some(if is_ordered { first } else { second });
                continue;
            }
            let items = if far < least { self.items_of(node) } else { &[] };
            for item in items {
                if gap(&item.around, x) < least {
                    let found = distance(item.number);
                    if found < least {
                        least = found;
                        best = Some((item.number, found));
                    }
                }
            }
            next = open.pop();
        }
        best
    }

    /// A node, and how far it is from `x`.
    #[inline]
    fn part(&self, node: u32, x: Vec3) -> (f64, u32) {
        (gap(&self.nodes[node as usize].around, x), node)
    }

    /// Calls `visit` with every pair of items whose boxes meet, the lesser one first. The pairs come in no order that means
    /// anything, but always in the same one.
    pub fn pairs(&self, mut visit: impl FnMut(u32, u32)) {
        if !self.nodes.is_empty() {
            self.pairs_in(0, &mut |a, b| visit(a.min(b), a.max(b)));
        }
    }

    /// Pairs of the items of one node.
    fn pairs_in(&self, at: u32, visit: &mut impl FnMut(u32, u32)) {
        let node = &self.nodes[at as usize];
        if node.second > 0 {
            self.pairs_in(at + 1, visit);
            self.pairs_in(node.second, visit);
            self.pairs_between(at + 1, node.second, visit);
            return;
        }
        let items = self.items_of(node);
        for (i, a) in items.iter().enumerate() {
            let meeting = items[i + 1..].iter().filter(|b| meet(&a.around, &b.around));
            meeting.for_each(|b| visit(a.number, b.number));
        }
    }

    /// Pairs of the items of two nodes, none of which is part of the other.
    fn pairs_between(&self, a: u32, b: u32, visit: &mut impl FnMut(u32, u32)) {
        let [s, t] = [a, b].map(|at| &self.nodes[at as usize]);
        if !meet(&s.around, &t.around) {
            return;
        }
        let count = |node: &Node| if node.second > 0 { node.end - node.first } else { 0 };
        let (larger, smaller) = if count(s) >= count(t) { (a, b) } else { (b, a) };
        let second = self.nodes[larger as usize].second;
        if second > 0 {
            self.pairs_between(larger + 1, smaller, visit);
            self.pairs_between(second, smaller, visit);
            return;
        }
        for item in self.items_of(s).iter().filter(|item| meet(&item.around, &t.around)) {
            let meeting = self.items_of(t).iter().filter(|other| meet(&item.around, &other.around));
            meeting.for_each(|other| visit(item.number, other.number));
        }
    }
}

/// What is still to be looked at. Memory for it is not asked for query by query.
struct Stack<T> {
    places: [T; DEPTH],
    count: usize,
}

impl<T: Copy + Default> Default for Stack<T> {
    fn default() -> Self {
        Self { places: [T::default(); DEPTH], count: 0 }
    }
}

impl<T: Copy> Stack<T> {
    fn push(&mut self, value: T) {
        self.places[self.count] = value;
        self.count += 1;
    }

    fn pop(&mut self) -> Option<T> {
        self.count = self.count.checked_sub(1)?;
        Some(self.places[self.count])
    }
}

/// Where to part a run of more than one item, given by cells in ascending order: between the halves of the smallest cell
/// around them.
fn parting(cells: &[(u64, u32)], depth: usize) -> usize {
    let (first, last) = (cells[0].0, cells[cells.len() - 1].0);
    if first == last || depth >= BY_CELLS {
        return cells.len() / 2;
    }
    // The highest bit in which the first and the last cell differ parts the smallest cell around both.
    let highest = 1_u64 << (first ^ last).ilog2();
    cells.partition_point(|(cell, _)| cell & highest == 0)
}

#[inline]
fn centre(b: &BoundingBox) -> Vec3 {
    [0, 1, 2].map(|k| 0.5 * b.min[k] + 0.5 * b.max[k])
}

/// The numbers of points in the order of a Z-curve through them: those that follow each other are near each other.
pub fn along_curve(points: &[Vec3]) -> impl Iterator<Item = u32> {
    sorted_cells(points).into_iter().map(|(_, number)| number)
}

/// The cells of points, in the order of the Z-curve through them, each with the number of its point.
fn sorted_cells(points: &[Vec3]) -> Vec<(u64, u32)> {
    let Some(all) = BoundingBox::of(points.iter().copied()) else { return vec![] };
    let extent = (0..3).map(|k| all.max[k] - all.min[k]).fold(0.0, larger);
    let count = f64::from(1_u32 << BITS);
    // Cells are cubes, whatever the shape of the whole.
    let scale = if extent > 0.0 { count / extent } else { 0.0 };
    let along = |x: f64, from: f64| spread(((x - from) * scale).min(count - 1.0) as u64);
    let cell = |x: &Vec3| along(x[0], all.min[0]) | along(x[1], all.min[1]) << 1 | along(x[2], all.min[2]) << 2;
    let mut cells: Vec<(u64, u32)> = points.iter().map(cell).zip(0..).collect();
    cells.sort_unstable();
    cells
}

/// The bits of a number of [`BITS`] bits, two zeros between each two of them.
#[inline]
fn spread(x: u64) -> u64 {
    let steps = [
        (32, 0x001F_0000_0000_FFFF),
        (16, 0x001F_0000_FF00_00FF),
        (8, 0x100F_00F0_0F00_F00F),
        (4, 0x10C3_0C30_C30C_30C3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.iter().fold(x, |x, (shift, mask)| (x | x << shift) & mask)
}

/// The smallest box around two.
#[inline]
pub fn joined(a: BoundingBox, b: BoundingBox) -> BoundingBox {
    BoundingBox {
        min: [0, 1, 2].map(|k| smaller(a.min[k], b.min[k])),
        max: [0, 1, 2].map(|k| larger(a.max[k], b.max[k])),
    }
}

/// The smaller one of two numbers, as [`larger`].
#[inline]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger one of two numbers. Unlike [`f64::max`] it is one instruction: it need not tell what is no number.
#[inline]
pub(crate) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline]
fn meet(a: &BoundingBox, b: &BoundingBox) -> bool {
    // All sides at once: which one parts two boxes cannot be foreseen.
    let along = |k: usize| (a.min[k] <= b.max[k]) & (b.min[k] <= a.max[k]);
    along(0) & along(1) & along(2)
}

/// The squared distance of a point to a box.
#[inline]
fn gap(b: &BoundingBox, x: Vec3) -> f64 {
    let along = |k: usize| larger(larger(b.min[k] - x[k], x[k] - b.max[k]), 0.0);
    let [u, v, w] = [along(0), along(1), along(2)];
    u * u + v * v + w * w
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn boxes(seeds: &[([f64; 3], f64)]) -> Vec<BoundingBox> {
        seeds.iter().map(|(p, r)| BoundingBox { min: *p, max: p.map(|c| c + r) }).collect()
    }

    proptest! {
        #[test]
        fn queries_find_what_a_look_at_all_finds(
            seeds in prop::collection::vec((prop::array::uniform3(-1.0..1.0f64), 0.0..0.3f64), 1..60),
            x in prop::array::uniform3(-1.5..1.5f64),
        ) {
            let all = boxes(&seeds);
            let tree = Bvh::new(all.iter().copied());
            let (item, least) = tree.nearest(x, f64::INFINITY, |i| gap(&all[i as usize], x)).expect("there are some");
            prop_assert_eq!(least, all.iter().map(|b| gap(b, x)).fold(f64::INFINITY, f64::min));
            prop_assert_eq!(gap(&all[item as usize], x), least);
            let mut found = Vec::new();
            tree.pairs(|i, j| found.push((i, j)));
            found.sort_unstable();
            let count = all.len() as u32;
            let every = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
            let expected: Vec<_> = every.filter(|(i, j)| meet(&all[*i as usize], &all[*j as usize])).collect();
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn crowds_do_not_make_it_deep() {
        // Each item half as far from the corner as the one before, and many in one place.
        let halving = (0..3000).map(|i| [0.5_f64.powi(i), 0.0, 0.0]);
        let all: Vec<BoundingBox> = halving.chain([[0.3; 3]; 3000]).map(|p| BoundingBox { min: p, max: p }).collect();
        let tree = Bvh::new(all.iter().copied());
        let x = [0.3, 0.3, 0.25];
        let nearest = tree.nearest(x, f64::INFINITY, |i| gap(&all[i as usize], x));
        let least = all.iter().map(|b| gap(b, x)).fold(f64::INFINITY, f64::min);
        assert_eq!(nearest.map(|(_, squared)| squared), Some(least));
    }

    #[test]
    fn bits_are_spread_by_threes() {
        let slow = |x: u64| (0..BITS).fold(0, |all, k| all | (x >> k & 1) << (3 * k));
        for x in [0, 1, 2, 5, 0x15_5555, 0x1F_FFFF, 0x12_3456] {
            assert_eq!(spread(x), slow(x), "{x}");
        }
    }

    #[test]
    fn nothing_is_near_nothing() {
        assert_eq!(Bvh::new(vec![]).nearest([0.0; 3], f64::INFINITY, |_| 0.0), None);
        let one = boxes(&[([1.0, 0.0, 0.0], 0.5)]);
        assert_eq!(Bvh::new(one.iter().copied()).nearest([0.0; 3], 0.5, |i| gap(&one[i as usize], [0.0; 3])), None);
    }
}
