//! A mesh in space, brought to the surface.

use super::nearest::Nearest;
use super::{Elements, Lifted, OnSurface, Placed};
use crate::vec3::{Vec3, midpoint};

/// A mesh with its nodes moved to the nearest places of a surface, of the chart of their triangles where `charts` tells that; nodes in
/// the middle of sides go to the place that is nearest to the middle. And how far the farthest of its nodes was off.
///
/// A triangle for which no chart is told belongs to that of the place nearest to its centroid.
pub fn project(
    nearest: &Nearest,
    points: &[Vec3],
    triangles: &[[u32; 3]],
    charts: Option<&[usize]>,
    elements: Elements,
) -> (Lifted, f64) {
    let chart_of = |t: usize| charts.map(|charts| charts[t]);
    let mut chart_of_node = vec![None; points.len()];
    for (t, triangle) in triangles.iter().enumerate() {
        triangle.iter().for_each(|n| chart_of_node[*n as usize] = chart_of(t));
    }
    let mut lifted = Lifted::default();
    let mut farthest = 0.0_f64;
    for (x, chart) in points.iter().zip(chart_of_node) {
        // A chart that does not exist has no nearest place: then any chart's will do.
        let Some((found, _)) = nearest.to(*x, chart).or_else(|| nearest.to(*x, None)) else { continue };
        farthest = farthest.max(found.off);
        lifted.push(placed(found));
    }
    for (t, triangle) in triangles.iter().enumerate() {
        let centroid = [0, 1, 2].map(|k| triangle.iter().map(|n| lifted.points[*n as usize][k]).sum::<f64>() / 3.0);
        let chart = nearest.to(centroid, chart_of(t)).or_else(|| nearest.to(centroid, None));
        lifted.charts.push(chart.map_or(0, |(_, chart)| chart as u32));
    }
    lifted.triangles = triangles.to_vec();
    if elements == Elements::Quadratic {
        add_middles(nearest, &mut lifted);
    }
    (lifted, farthest)
}

fn placed(found: OnSurface) -> Placed {
    Placed { point: found.point, place: found.place }
}

fn add_middles(nearest: &Nearest, lifted: &mut Lifted) {
    let sides = lifted.triangles.iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3]]));
    let mut by_ends: Vec<([u32; 2], usize)> = sides.map(|[a, b]| [a.min(b), a.max(b)]).zip(0..).collect();
    by_ends.sort_unstable();
    let mut middles = vec![0; 3 * lifted.triangles.len()];
    for same in by_ends.chunk_by(|x, y| x.0 == y.0) {
        let next = lifted.points.len() as u32;
        let [p, q] = same[0].0.map(|n| lifted.points[n as usize]);
        // Between two charts either will do: both have the seam.
        let is_inner = same.iter().all(|(_, side)| lifted.charts[side / 3] == lifted.charts[same[0].1 / 3]);
        let chart = is_inner.then(|| lifted.charts[same[0].1 / 3] as usize);
        if let Some((found, _)) = nearest.to(midpoint(p, q), chart) {
            lifted.push(placed(found));
        }
        same.iter().for_each(|(_, side)| middles[*side] = next);
    }
    lifted.middles = middles.as_chunks().0.to_vec();
}
