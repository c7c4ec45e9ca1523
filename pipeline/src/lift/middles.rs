//! Nodes in the middle of sides, on the surface.

use super::surface::ChartedSurface;
use super::{Lifted, PlanarPart};
use std::collections::BTreeMap;

/// The nodes in the middle of sides along curves, which the neighbour has, too.
pub(super) struct Middles<'a> {
    surface: &'a ChartedSurface,
    /// By the nodes at the ends of the side, the lesser first.
    on_curves: BTreeMap<[u32; 2], u32>,
}

impl<'a> Middles<'a> {
    pub fn new(surface: &'a ChartedSurface) -> Self {
        Self { surface, on_curves: BTreeMap::new() }
    }

    /// Adds the middles of the sides of a part, whose nodes have these numbers in the mesh: inside, the place in the middle of
    /// the plane; along a curve, the place of that which is nearest to it.
    pub fn add(&mut self, part: &PlanarPart, triangles: &[[u32; 3]], numbers: &[u32], lifted: &mut Lifted) {
        let sides = triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3]]));
        let mut by_ends: Vec<([u32; 2], usize)> = sides.map(|[a, b]| [a.min(b), a.max(b)]).zip(0..).collect();
        by_ends.sort_unstable();
        let mut middles = vec![0; 3 * triangles.len()];
        for same in by_ends.chunk_by(|x, y| x.0 == y.0) {
            let middle = self.middle(part, same[0].0, same.len() == 1, numbers, lifted);
            same.iter().for_each(|(_, side)| middles[*side] = middle);
        }
        lifted.middles.extend_from_slice(middles.as_chunks().0);
    }

    fn middle(
        &mut self,
        part: &PlanarPart,
        ends: [u32; 2],
        is_open: bool,
        numbers: &[u32],
        lifted: &mut Lifted,
    ) -> u32 {
        let chart = self.surface.chart(part.chart);
        let next = lifted.points.len() as u32;
        let [p, q] = ends.map(|n| part.uv[n as usize]);
        let uv = [0, 1].map(|k| 0.5 * p[k] + 0.5 * q[k]);
        if is_open {
            let [a, b] = ends.map(|n| numbers[n as usize]);
            let middle = *self.on_curves.entry([a.min(b), a.max(b)]).or_insert(next);
            if middle == next
                && let Some(found) = chart.map.to_boundary(uv)
            {
                lifted.push(chart.of_boundary(&found));
            }
            return middle;
        }
        if let Some(found) = chart.map.to_space(uv) {
            lifted.push(chart.placed(&found));
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use crate::lift::joining::on_open_edges;

    #[test]
    fn open_edges_are_those_of_one_triangle() {
        assert_eq!(on_open_edges(4, &[[0, 1, 2], [0, 2, 3]]), [true; 4]);
        let fan = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        assert_eq!(on_open_edges(5, &fan), [true, true, true, true, false]);
    }
}
