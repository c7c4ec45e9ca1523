//! Points near a segment: a k-d tree (Bentley 1975, doi 10.1145/361002.361007).

use crate::vec3::{BoundingBox, Vec3, sub};

/// Points of a leaf, at most. By experience: smaller leaves take more boxes, larger ones more looks at points.
const LEAF: usize = 8;

/// Points in boxes within boxes.
pub(super) struct PointTree {
    /// The ids of the points, in the order of the leaves.
    ids: Vec<u32>,
    /// The box of each node, children `2 i + 1` and `2 i + 2` of node `i`; the halves of its points.
    boxes: Vec<Option<BoundingBox>>,
}

impl PointTree {
    /// The tree of the points with these ids. Every node halves its points, so that it is log2 of their number deep.
    pub(super) fn new(points: &[Vec3], mut ids: Vec<u32>) -> Self {
        let depth = (ids.len() / LEAF + 1).next_power_of_two().ilog2();
        // A complete binary tree, with 2^(depth + 1) - 1 nodes.
        let mut boxes = vec![None; (2 << depth) - 1];
        build(points, &mut ids, &mut boxes, 0);
        Self { ids, boxes }
    }

    /// Hands the ids of all points within `reach` of the segment, and perhaps of others near it, to `visit`, as long as
    /// there are `looks` left: one for each box and point.
    pub(super) fn near(&self, [a, b]: [Vec3; 2], reach: f64, looks: &mut usize, mut visit: impl FnMut(u32)) {
        let mut stack = vec![(0, 0, self.ids.len())];
        while let Some((node, start, end)) = stack.pop() {
            *looks = looks.saturating_sub(1);
            let meets = self.boxes[node].is_some_and(|cell| passes(&cell, a, b, reach));
            if *looks == 0 || !meets {
                continue;
            }
            if 2 * node + 1 < self.boxes.len() {
                let middle = usize::midpoint(start, end);
                stack.extend([(2 * node + 2, middle, end), (2 * node + 1, start, middle)]);
            } else {
                *looks = looks.saturating_sub(end - start);
                self.ids[start..end].iter().for_each(|id| visit(*id));
            }
        }
    }
}

/// Sorts the points of a node into its halves, along the longest side of its box.
fn build(points: &[Vec3], ids: &mut [u32], boxes: &mut [Option<BoundingBox>], node: usize) {
    let cell = BoundingBox::of(ids.iter().map(|i| points[*i as usize]));
    boxes[node] = cell;
    let Some(cell) = cell.filter(|_| 2 * node + 1 < boxes.len()) else { return };
    let extent = sub(cell.max, cell.min);
    let axis = (0..3).max_by(|i, j| extent[*i].total_cmp(&extent[*j])).unwrap_or_default();
    let middle = ids.len() / 2;
    let by_coordinate =
        |i: &u32, j: &u32| points[*i as usize][axis].total_cmp(&points[*j as usize][axis]).then(i.cmp(j));
    if middle > 0 {
        ids.select_nth_unstable_by(middle, by_coordinate);
    }
    let (low, high) = ids.split_at_mut(middle);
    build(points, low, boxes, 2 * node + 1);
    build(points, high, boxes, 2 * node + 2);
}

/// Whether the segment passes the box widened by `reach` on all sides (the slabs of Kay and Kajiya 1986, doi
/// 10.1145/15886.15916).
fn passes(cell: &BoundingBox, a: Vec3, b: Vec3, reach: f64) -> bool {
    // The part of the segment, as shares of it, that lies between the planes of all axes so far.
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for k in 0..3 {
        let (low, high, along) = (cell.min[k] - reach, cell.max[k] + reach, b[k] - a[k]);
        if along == 0.0 {
            if a[k] < low || a[k] > high {
                return false;
            }
            continue;
        }
        let (s, t) = ((low - a[k]) / along, (high - a[k]) / along);
        (from, to) = (from.max(s.min(t)), to.min(s.max(t)));
    }
    from <= to
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_points_near_a_segment_are_found_in_few_looks() {
        let points: Vec<Vec3> =
            (0..1000).map(|i| [f64::from(i * 7 % 10), f64::from(i / 10 % 10), f64::from(i / 100)]).collect();
        let tree = PointTree::new(&points, (0..1000).collect());
        let (mut found, mut looks) = (Vec::new(), 2000);
        tree.near([[-1.0, 3.0, 4.0], [20.0, 3.0, 4.0]], 0.1, &mut looks, |i| found.push(i));
        let mut on_line: Vec<u32> = found.into_iter().filter(|i| points[*i as usize][1..] == [3.0, 4.0]).collect();
        on_line.sort_unstable();
        assert_eq!(on_line, (430..440).collect::<Vec<u32>>());
        assert!(looks > 1700, "{looks}");
    }

    #[test]
    fn no_points_and_equal_points_are_no_harm() {
        let mut count = 0;
        PointTree::new(&[], vec![]).near([[0.0; 3]; 2], 1.0, &mut 100, |_| count += 1);
        assert_eq!(count, 0);
        PointTree::new(&[[1.0; 3]; 99], (0..99).collect()).near([[1.0; 3]; 2], 0.0, &mut 1000, |_| count += 1);
        assert_eq!(count, 99);
    }
}
