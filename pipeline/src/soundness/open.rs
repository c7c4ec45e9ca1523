//! The sides that only one triangle has.

use crate::topology::csr::Csr;

/// A side by its lower node: the group of the triangle, the upper node, and whether the side runs upward.
type Side = (u32, (u32, u32, bool));

/// Per group, the sides that one triangle of the group has and no other, as the triangle runs: in the order of their lower
/// nodes, then of their upper ones. `triangles` gives each triangle with its group, on nodes below `nodes`.
pub fn sides_of_one<I>(nodes: usize, groups: usize, triangles: impl Fn() -> I) -> Vec<Vec<[u32; 2]>>
where
    I: Iterator<Item = (u32, [u32; 3])>,
{
    let mut by_lower = Csr::sorted(nodes, || triangles().flat_map(sides));
    let mut open = vec![Vec::new(); groups];
    for lower in 0..nodes as u32 {
        let around = by_lower.row_mut(lower as usize);
        around.sort_unstable();
        for side in around.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).filter(|same| same.len() == 1) {
            let (group, upper, is_upward) = side[0];
            open[group as usize].push(if is_upward { [lower, upper] } else { [upper, lower] });
        }
    }
    open
}

fn sides((group, t): (u32, [u32; 3])) -> [Side; 3] {
    [0, 1, 2].map(|k| {
        let (from, to) = (t[k], t[(k + 1) % 3]);
        (from.min(to), (group, from.max(to), from < to))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_group_has_its_own() {
        // Two triangles of one group side by side, and one of another group beside them.
        let triangles = [(0, [0, 1, 2]), (0, [1, 3, 2]), (1, [1, 4, 3])];
        let open = sides_of_one(5, 3, || triangles.into_iter());
        assert_eq!(open[0], [[0, 1], [2, 0], [1, 3], [3, 2]]);
        assert_eq!(open[1], [[3, 1], [1, 4], [4, 3]]);
        assert!(open[2].is_empty());
    }
}
