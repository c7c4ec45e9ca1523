//! Points in a tree of boxes (k-d tree; Bentley 1975, doi:10.1145/361002.361007), to find those in a triangle.

use super::{Flat, turn};

/// Points with their numbers. The middle one of a range is the root of its tree, before it lies one branch, after it the
/// other.
#[derive(Default)]
pub(super) struct Tree {
    points: Vec<(Flat, u32)>,
    /// The low and the high corner of the box around the tree of each root.
    boxes: Vec<[Flat; 2]>,
}

/// The positions of a tree in the list.
type Branch = (usize, usize);

/// The branch before the root of a tree, the root, and the branch behind it.
fn halves((from, to): Branch) -> (Branch, usize, Branch) {
    let root = from + (to - from) / 2;
    ((from, root), root, (root + 1, to))
}

impl Tree {
    pub fn new(mut points: Vec<(Flat, u32)>) -> Self {
        let mut boxes = vec![[[0.0; 2]; 2]; points.len()];
        let mut waiting: Vec<Branch> = vec![(0, points.len())];
        while let Some(branch) = waiting.pop() {
            if branch.0 == branch.1 {
                continue;
            }
            let around = around(&points[branch.0..branch.1]);
            let (before, root, after) = halves(branch);
            // Across the longer side of the box; equal coordinates in the order of their numbers, so that the tree does not
            // depend on how the library selects.
            let [width, height] = [0, 1].map(|k| around[1][k] - around[0][k]);
            let k = usize::from(height > width);
            points[branch.0..branch.1]
                .select_nth_unstable_by(root - branch.0, |(p, i), (q, j)| p[k].total_cmp(&q[k]).then(i.cmp(j)));
            boxes[root] = around;
            waiting.extend([before, after]);
        }
        Self { points, boxes }
    }

    pub fn into_points(self) -> Vec<(Flat, u32)> {
        self.points
    }

    /// Whether a point that counts lies in a triangle that turns left, or on its edges; and how many roots were looked at
    /// for that, of which there may be `most`.
    pub fn find_in(&self, triangle: [Flat; 3], most: usize, counts: impl Fn(Flat, u32) -> bool) -> (bool, usize) {
        let [a, b, c] = triangle;
        let edges = [[a, b], [b, c], [c, a]];
        let mut looks = 0;
        let mut waiting: Vec<Branch> = vec![(0, self.points.len())];
        while let Some(branch) = waiting.pop() {
            let (before, root, after) = halves(branch);
            if branch.0 == branch.1 || edges.iter().any(|edge| is_right_of(self.boxes[root], *edge)) {
                continue;
            }
            looks += 1;
            let (point, number) = self.points[root];
            if edges.iter().all(|[p, q]| turn(*p, *q, point) >= 0.0) && counts(point, number) {
                return (true, looks);
            }
            if looks > most {
                break;
            }
            waiting.extend([before, after]);
        }
        (false, looks)
    }
}

/// The box around points.
fn around(points: &[(Flat, u32)]) -> [Flat; 2] {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for (point, _) in points {
        for k in 0..2 {
            low[k] = low[k].min(point[k]);
            high[k] = high[k].max(point[k]);
        }
    }
    [low, high]
}

/// Whether a box lies to the right of a line, in every digit: rounding keeps the order of numbers, so what is computed for
/// the leftmost corner of the box is no less than what is computed for any point in it.
fn is_right_of([low, high]: [Flat; 2], [p, q]: [Flat; 2]) -> bool {
    let x = if q[1] > p[1] { low[0] } else { high[0] };
    let y = if q[0] > p[0] { high[1] } else { low[1] };
    turn(p, q, [x, y]) < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_found_is_what_a_look_at_every_point_finds() {
        let number = |i: u32, prime: u32| f64::from(i.wrapping_mul(prime) % 1009) / 1009.0;
        for n in [0, 1, 2, 3, 50, 700] {
            let points: Vec<(Flat, u32)> = (0..n).map(|i| ([number(i, 7919), number(i, 104_729)], i)).collect();
            let tree = Tree::new(points.clone());
            let mut found = 0;
            for i in 0..500 {
                let corner = |k: u32| [number(3 * i + k, 611_953), number(3 * i + k, 15_485_863)];
                let triangle = [corner(0), corner(1), corner(2)];
                let [a, b, c] = triangle;
                let inside = |p: Flat| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
                let expected = points.iter().any(|(p, k)| inside(*p) && k % 3 > 0);
                assert_eq!(tree.find_in(triangle, usize::MAX, |_, k| k % 3 > 0).0, expected, "{n} points, {i}");
                found += usize::from(expected);
            }
            assert!(n < 50 || found > 20 && found < 480, "{found}");
        }
    }
}
