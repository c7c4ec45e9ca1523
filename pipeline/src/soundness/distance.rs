//! How far mesh and surface are from each other.

use super::reference::Triangulation;
use crate::evaluate::{Bvh, nearest};
use crate::topology::VertexId;
use crate::vec3::Vec3;

/// So many points of the surface are compared with the mesh at most. By experience: they lie about a hundredth of
/// the size of the surface (the root of its area) apart; more find smaller losses, and take longer.
const SAMPLES: f64 = 15_000.0;

/// A distance and where it was found.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Farthest {
    /// The distance.
    pub distance: f64,
    /// The point that is so far away.
    pub at: Vec3,
}

impl Farthest {
    pub(super) fn grow(&mut self, distance: f64, at: Vec3) {
        if distance > self.distance {
            *self = Self { distance, at };
        }
    }
}

/// How far the nodes of a mesh are from the surface: from every part of it that they belong to.
#[derive(Clone, Debug)]
pub struct SurfaceDistance {
    per_node: Vec<f64>,
}

impl SurfaceDistance {
    /// Nothing known of so many nodes.
    pub(super) fn new(nodes: usize) -> Self {
        Self { per_node: vec![0.0; nodes] }
    }

    pub(super) fn note(&mut self, node: VertexId, distance: f64) {
        let known = &mut self.per_node[node.index()];
        *known = known.max(distance);
    }

    /// Measures all nodes that are used.
    pub(super) fn measure(mesh: &Triangulation, surface: &Triangulation, tree: &Bvh) -> Self {
        let mut found = Self::new(mesh.points.len());
        let mut used = vec![false; mesh.points.len()];
        mesh.triangles.iter().flatten().for_each(|v| used[v.index()] = true);
        for v in (0..mesh.points.len()).filter(|v| used[*v]) {
            found.note(VertexId::at(v), to_surface(mesh.points[v], surface, tree));
        }
        found
    }

    /// The node that is farthest off, and how many are farther off than `limit`.
    pub(super) fn farthest(&self, points: &[Vec3], limit: f64) -> (Farthest, usize) {
        let mut far = Farthest::default();
        self.per_node.iter().zip(points).for_each(|(d, p)| far.grow(*d, *p));
        (far, self.per_node.iter().filter(|d| **d > limit).count())
    }
}

/// The distance of a point to a triangulation.
pub(super) fn to_surface(x: Vec3, surface: &Triangulation, tree: &Bvh) -> f64 {
    let corners = |t: u32| surface.corners(t as usize);
    nearest(tree, x, f64::INFINITY, corners).map_or(f64::INFINITY, |l| l.distance)
}

/// The point of the surface that is farthest from the mesh, and how many of the points looked at are farther than `limit`:
/// its vertices, as tips are what is lost first, and points on a lattice in every triangle, half of `size` apart where that
/// is not too many. `tree` has the triangles of the mesh.
pub(super) fn uncovered(
    surface: &Triangulation,
    mesh: &Triangulation,
    tree: &Bvh,
    size: f64,
    limit: f64,
) -> (Farthest, usize) {
    // Along each triangle, so many that together they are not too many.
    let wanted = |t: usize, spacing: f64| (surface.area_of(t).sqrt() / spacing).ceil().clamp(1.0, 200.0);
    let count = |spacing: f64| (0..surface.triangles.len()).map(|t| wanted(t, spacing).powi(2)).sum::<f64>();
    let dense = 0.5 * size;
    // The number of points falls with the square of the spacing.
    let excess = (count(dense) / SAMPLES).max(1.0).sqrt();
    let spacing = dense * excess;
    let stride = (surface.triangles.len() as f64 / SAMPLES).ceil().max(1.0) as usize;
    let (mut far, mut beyond) = (Farthest::default(), 0);
    let mut look = |x: Vec3| {
        let d = to_surface(x, mesh, tree);
        far.grow(d, x);
        beyond += usize::from(d > limit);
    };
    let mut used = vec![false; surface.points.len()];
    surface.triangles.iter().flatten().for_each(|v| used[v.index()] = true);
    let vertices = surface.points.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| *p);
    vertices.step_by(stride).for_each(&mut look);
    for t in (0..surface.triangles.len()).step_by(stride) {
        let corners = surface.corners(t);
        for weights in lattice(wanted(t, spacing) as u32) {
            let x = [0, 1, 2].map(|k| (0..3).map(|i| weights[i] * corners[i][k]).sum());
            look(x);
        }
    }
    (far, beyond)
}

/// The centres of the `n`^2 equal parts of a triangle.
fn lattice(n: u32) -> impl Iterator<Item = [f64; 3]> {
    let place = move |i: f64, j: f64| {
        let (u, v) = (i / f64::from(n), j / f64::from(n));
        [1.0 - u - v, u, v]
    };
    (0..n).flat_map(move |i| {
        (0..n - i).flat_map(move |j| {
            let (x, y) = (f64::from(i), f64::from(j));
            let upright = place(x + 1.0 / 3.0, y + 1.0 / 3.0);
            let inverted = (i + j + 1 < n).then(|| place(x + 2.0 / 3.0, y + 2.0 / 3.0));
            std::iter::once(upright).chain(inverted)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_has_the_centres_of_all_parts() {
        for n in 1..6 {
            let all: Vec<[f64; 3]> = lattice(n).collect();
            assert_eq!(all.len(), (n * n) as usize);
            assert!(all.iter().flatten().all(|w| *w > 0.0));
            let mean = all.iter().map(|w| w[1]).sum::<f64>() / f64::from(n * n);
            assert!((mean - 1.0 / 3.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_tip_of_a_needle_is_looked_at() {
        // A facet 100 times as long as wide: no point of a coarse lattice is near its tip.
        let needle = [[0.0; 3], [0.0, 1.0, 0.0], [100.0, 0.5, 0.0]];
        let blunt = [needle[0], needle[1], [90.0, 0.5, 0.0]];
        let [surface, mesh] = [needle, blunt].map(|p| Triangulation::welded(&p, [[0, 1, 2]]));
        let (far, beyond) = uncovered(&surface, &mesh, &mesh.bvh(), 5.0, 6.0);
        assert!(beyond > 0 && (far.distance - 10.0).abs() < 0.1, "{far:?}");
    }

    #[test]
    fn a_lost_corner_is_seen() {
        let soup = crate::shapes::flat_disk(8);
        let surface = Triangulation::welded(soup.points(), soup.triangles().iter().copied());
        let right = |t: &&[u32; 3]| t.iter().any(|i| soup.points()[*i as usize][0] <= 0.5);
        let part = Triangulation::welded(soup.points(), soup.triangles().iter().filter(right).copied());
        let (far, beyond) = uncovered(&surface, &part, &part.bvh(), 0.1, 0.2);
        assert!(far.at[0] > 0.5 && far.distance > 0.2 && beyond > 0, "{far:?}");
        assert_eq!(uncovered(&surface, &surface, &surface.bvh(), 0.1, 0.2).1, 0);
    }
}
