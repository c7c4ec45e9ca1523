//! A hierarchy of bounding boxes: what lies near a point, or in a box, is found without looking at all.
//!
//! Items are boxes, halved at the median of their centres along the longest side, down to a few in a leaf. Building takes
//! O(n log² n), a query O(log n + found) on surfaces. The hierarchy depends on the boxes and their order alone.

use crate::space::{BoundingBox, Vec3};

/// So many items are looked at one by one: below it, boxes cost more than they save.
const LEAF: usize = 4;

/// Items by their boxes.
#[derive(Clone, Debug, Default)]
pub struct Bvh {
    nodes: Vec<Node>,
    /// The items, those of a leaf beside each other.
    order: Vec<u32>,
    boxes: Vec<BoundingBox>,
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
    pub fn new(boxes: Vec<BoundingBox>) -> Self {
        let order = (0..boxes.len() as u32).collect();
        let mut tree = Self { nodes: Vec::with_capacity(boxes.len()), order, boxes };
        if !tree.boxes.is_empty() {
            tree.build(0, tree.order.len());
        }
        tree
    }

    /// Builds the part of `order[first..end]`, not empty; its node. As deep as the logarithm of the number of items.
    fn build(&mut self, first: usize, end: usize) -> u32 {
        let at = self.nodes.len();
        let around = self.order[first..end].iter().map(|i| self.boxes[*i as usize]).reduce(joined);
        let around = around.unwrap_or(BoundingBox { min: [0.0; 3], max: [0.0; 3] });
        self.nodes.push(Node { around, first: first as u32, end: end as u32, second: 0 });
        if end - first > LEAF {
            let axis = longest_axis(&around);
            let boxes = &self.boxes;
            let centre = |i: &u32| boxes[*i as usize].min[axis] + boxes[*i as usize].max[axis];
            let middle = (end - first) / 2;
            let by_centre = |a: &u32, b: &u32| centre(a).total_cmp(&centre(b)).then(a.cmp(b));
            self.order[first..end].select_nth_unstable_by(middle, by_centre);
            self.build(first, first + middle);
            self.nodes[at].second = self.build(first + middle, end);
        }
        at as u32
    }

    /// Calls `visit` with every item whose box meets `around`.
    pub fn overlapping(&self, around: &BoundingBox, mut visit: impl FnMut(u32)) {
        let mut open = if self.nodes.is_empty() { vec![] } else { vec![0_u32] };
        while let Some(at) = open.pop() {
            let node = &self.nodes[at as usize];
            if !meet(&node.around, around) {
                continue;
            }
            if node.second > 0 {
                open.extend([node.second, at + 1]);
                continue;
            }
            let items = &self.order[node.first as usize..node.end as usize];
            items.iter().filter(|i| meet(&self.boxes[**i as usize], around)).for_each(|i| visit(*i));
        }
    }

    /// The item with the least squared distance to `x`, if one is nearer than the root of `bound`; `distance` tells that of
    /// an item. Of equal ones, the first that is met.
    pub fn nearest(&self, x: Vec3, bound: f64, mut distance: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        let mut best: Option<(u32, f64)> = None;
        let mut least = bound;
        let mut open = if self.nodes.is_empty() { vec![] } else { vec![(gap(&self.nodes[0].around, x), 0_u32)] };
        while let Some((far, at)) = open.pop() {
            if far >= least {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.second > 0 {
                let parts = [at + 1, node.second].map(|part| (gap(&self.nodes[part as usize].around, x), part));
                let [near, far] = if parts[0].0 <= parts[1].0 { parts } else { [parts[1], parts[0]] };
                open.extend([far, near]);
                continue;
            }
            for item in &self.order[node.first as usize..node.end as usize] {
                if gap(&self.boxes[*item as usize], x) < least {
                    let found = distance(*item);
                    if found < least {
                        least = found;
                        best = Some((*item, found));
                    }
                }
            }
        }
        best
    }

    /// Calls `visit` with every pair of items whose boxes meet, the lesser one first.
    pub fn pairs(&self, mut visit: impl FnMut(u32, u32)) {
        for i in 0..self.boxes.len() as u32 {
            self.overlapping(&self.boxes[i as usize], |j| {
                if j > i {
                    visit(i, j);
                }
            });
        }
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
            let tree = Bvh::new(all.clone());
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
        assert_eq!(Bvh::new(one.clone()).nearest([0.0; 3], 0.5, |i| gap(&one[i as usize], [0.0; 3])), None);
    }
}
