//! A hierarchy of bounding boxes: what lies near a point, or in a box, is found without looking at all.
//!
//! Items are boxes, halved at the median of their centres along the longest side, down to a few in a leaf. Building takes
//! O(n log² n), a query O(log n + found) on surfaces. The hierarchy depends on the boxes and their order alone.

use crate::space::{BoundingBox, Vec3};

/// So many items are looked at one by one: below it, boxes cost more than they save.
const LEAF: usize = 4;

/// As deep as a hierarchy of 2^32 items can be.
const DEPTH: usize = 33;

/// Items by their boxes.
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
        let items: Vec<Item> = boxes.into_iter().zip(0..).map(|(around, number)| Item { around, number }).collect();
        let mut tree = Self { nodes: Vec::with_capacity(items.len()), items };
        if !tree.items.is_empty() {
            tree.build(0, tree.items.len());
        }
        tree
    }

    /// Builds the part of `items[first..end]`, not empty; its node. As deep as the logarithm of the number of items.
    fn build(&mut self, first: usize, end: usize) -> u32 {
        let at = self.nodes.len();
        let items = &mut self.items[first..end];
        let around = items[1..].iter().fold(items[0].around, |all, item| joined(all, item.around));
        self.nodes.push(Node { around, first: first as u32, end: end as u32, second: 0 });
        if items.len() > LEAF {
            let axis = longest_axis(&around);
            let middle = items.len() / 2;
            let centre = |item: &Item| item.around.min[axis] + item.around.max[axis];
            let by_centre = |a: &Item, b: &Item| centre(a).total_cmp(&centre(b)).then(a.number.cmp(&b.number));
            items.select_nth_unstable_by(middle, by_centre);
            self.build(first, first + middle);
            self.nodes[at].second = self.build(first + middle, end);
        }
        at as u32
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
    /// an item. Of equal ones, the first that is met.
    pub fn nearest(&self, x: Vec3, bound: f64, mut distance: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut least = bound;
        let mut open = Stack::default();
        let mut next = self.nodes.first().map(|root| (gap(&root.around, x), 0_u32));
        while let Some((far, at)) = next {
            let node = &self.nodes[at as usize];
            if far < least && node.second > 0 {
                let parts = [at + 1, node.second].map(|part| (gap(&self.nodes[part as usize].around, x), part));
                let [near, far] = if parts[0].0 <= parts[1].0 { parts } else { [parts[1], parts[0]] };
                open.push(far);
                next = Some(near);
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

/// The smallest box around two.
pub fn joined(a: BoundingBox, b: BoundingBox) -> BoundingBox {
    BoundingBox { min: [0, 1, 2].map(|k| a.min[k].min(b.min[k])), max: [0, 1, 2].map(|k| a.max[k].max(b.max[k])) }
}

fn longest_axis(b: &BoundingBox) -> usize {
    let side = |k: usize| b.max[k] - b.min[k];
    (1..3).fold(0, |longest, k| if side(k) > side(longest) { k } else { longest })
}

fn meet(a: &BoundingBox, b: &BoundingBox) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

/// The squared distance of a point to a box.
fn gap(b: &BoundingBox, x: Vec3) -> f64 {
    let along = |k: usize| (b.min[k] - x[k]).max(x[k] - b.max[k]).max(0.0);
    (0..3).map(|k| along(k) * along(k)).sum()
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
    fn nothing_is_near_nothing() {
        assert_eq!(Bvh::new(vec![]).nearest([0.0; 3], f64::INFINITY, |_| 0.0), None);
        let one = boxes(&[([1.0, 0.0, 0.0], 0.5)]);
        assert_eq!(Bvh::new(one.iter().copied()).nearest([0.0; 3], 0.5, |i| gap(&one[i as usize], [0.0; 3])), None);
    }
}
