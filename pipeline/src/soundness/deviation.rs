//! How far mesh and surface are from each other, from both sides, everywhere: the chord error.
//!
//! Points of every element are compared with the surface, and points of the surface with the elements; curved elements are taken
//! as sixteen flat parts each, whose own chord error is a sixteenth of that of a flat element of the same bend. Between points
//! that are looked at the distance is at most theirs plus half of the way between them times the sine of the angle between both
//! surfaces: an estimate from below, which lies within some percent where elements follow the surface.

use super::distance::{Farthest, to_surface};
use super::reference::Triangulation;
use super::{Mesh, centroid};
use crate::evaluate::{Bvh, nearest, triangle_bvh};
use crate::topology::VertexId;
use crate::vec3::{Vec3, distance};

/// Points along a side of an element, and of a triangle of the surface that is larger than elements.
const ALONG: u32 = 4;

/// From this share of the limit on it is kept barely: of a sphere with facets half as long as elements six of 2,406 exceeded it,
/// and six others, after these alone had become smaller. Of facets as long as elements (max_planck_decimated, at a thousandth of the
/// diagonal) two elements were left after three times from 0.7 on, none from here.
pub const BARELY: f64 = 0.5;

/// An element from which the surface is too far away, or that is too far from it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TooFar {
    /// Its number in the mesh.
    pub triangle: u32,
    /// How far, in the unit of the surface.
    pub distance: f64,
    /// Its centroid.
    pub at: Vec3,
    /// The length of its longest side, between corners.
    pub longest: f64,
}

/// How far mesh and surface are from each other.
#[derive(Clone, Debug, PartialEq)]
pub struct Deviation {
    /// What may be.
    pub limit: f64,
    /// The point of the mesh that is farthest from the surface.
    pub mesh_to_surface: Farthest,
    /// The point of the surface that is farthest from the mesh.
    pub surface_to_mesh: Farthest,
    /// The elements at which more is found than may be, ascending.
    pub too_far: Vec<TooFar>,
    /// Those at which little less is found ([`BARELY`]), ascending: a mesh that is made anew may be too far off there.
    pub barely: Vec<TooFar>,
}

/// Looks at every element, and all of the surface.
pub(super) fn measure(mesh: &Mesh, surface: &Triangulation, limit: f64) -> Deviation {
    let parts = Parts::of(mesh);
    let (mut to, mut from) = (Farthest::default(), Farthest::default());
    let mut per_element = vec![0.0_f64; mesh.triangulation.triangles.len()];
    let tree = surface.bvh();
    for (element, corners) in parts.each() {
        for x in lattice(corners, if parts.are_whole { ALONG } else { 1 }) {
            let found = to_surface(x, surface, &tree);
            to.grow(found, x);
            per_element[element] = per_element[element].max(found);
        }
    }
    let tree = parts.bvh();
    let longest_element = mesh.triangulation.triangles.iter().map(|t| longest(mesh, t)).fold(0.0, f64::max);
    for t in 0..surface.triangles.len() {
        let corners = surface.corners(t);
        let side = (0..3).map(|k| distance(corners[k], corners[(k + 1) % 3])).fold(0.0, f64::max);
        // Triangles that are smaller than elements are looked at by their corners.
        let along = (f64::from(ALONG) * side / longest_element).ceil().clamp(1.0, 64.0) as u32;
        for x in lattice(corners, along) {
            let Some(found) = nearest(&tree, x, f64::INFINITY, |part| parts.corners(part as usize)) else { continue };
            from.grow(found.distance, x);
            let element = parts.element[found.triangle as usize] as usize;
            per_element[element] = per_element[element].max(found.distance);
        }
    }
    let found = (0..per_element.len()).map(|t| TooFar {
        triangle: t as u32,
        distance: per_element[t],
        at: centroid(mesh.triangulation.corners(t)),
        longest: longest(mesh, &mesh.triangulation.triangles[t]),
    });
    let near: Vec<TooFar> = found.filter(|element| element.distance > BARELY * limit).collect();
    let (too_far, barely) = near.into_iter().partition(|element| element.distance > limit);
    Deviation { limit, mesh_to_surface: to, surface_to_mesh: from, too_far, barely }
}

/// The length of the longest side.
fn longest(mesh: &Mesh, triangle: &[VertexId; 3]) -> f64 {
    let corner = |k: usize| mesh.triangulation.points[triangle[k % 3].index()];
    (0..3).map(|k| distance(corner(k), corner(k + 1))).fold(0.0, f64::max)
}

/// The flat parts of elements.
struct Parts {
    corners: Vec<[Vec3; 3]>,
    /// The element that each is part of.
    element: Vec<u32>,
    /// Whether each is a whole element.
    are_whole: bool,
}

impl Parts {
    fn of(mesh: &Mesh) -> Self {
        let are_whole = mesh.mids.iter().all(Option::is_none);
        let mut parts = Self { corners: Vec::new(), element: Vec::new(), are_whole };
        for (t, mids) in mesh.mids.iter().enumerate() {
            let corners = mesh.triangulation.corners(t);
            let steps = if mids.is_some() { ALONG } else { 1 };
            let point = |i: u32, j: u32| {
                let [v, w] = [i, j].map(|k| f64::from(k) / f64::from(steps));
                match mids {
                    Some(mids) => curved(corners, mids.map(|m| mesh.triangulation.points[m.index()]), v, w),
                    None => flat(corners, v, w),
                }
            };
            for (i, j) in (0..steps).flat_map(|i| (0..steps - i).map(move |j| (i, j))) {
                parts.corners.push([point(i, j), point(i + 1, j), point(i, j + 1)]);
                if i + j + 1 < steps {
                    parts.corners.push([point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
                }
            }
            parts.element.resize(parts.corners.len(), t as u32);
        }
        parts
    }

    fn each(&self) -> impl Iterator<Item = (usize, [Vec3; 3])> {
        self.element.iter().map(|element| *element as usize).zip(self.corners.iter().copied())
    }

    fn corners(&self, part: usize) -> [Vec3; 3] {
        self.corners[part]
    }

    fn bvh(&self) -> Bvh {
        triangle_bvh(self.corners.iter().copied())
    }
}

/// The point of a flat triangle at barycentric coordinates 1 - v - w, v, w.
fn flat(corners: [Vec3; 3], v: f64, w: f64) -> Vec3 {
    let u = 1.0 - v - w;
    [0, 1, 2].map(|k| u * corners[0][k] + v * corners[1][k] + w * corners[2][k])
}

/// The same of a triangle of six nodes, with those in the middle of the sides 01, 12, 20.
fn curved(corners: [Vec3; 3], mids: [Vec3; 3], v: f64, w: f64) -> Vec3 {
    let u = 1.0 - v - w;
    let at_corners = [u * (2.0 * u - 1.0), v * (2.0 * v - 1.0), w * (2.0 * w - 1.0)];
    let at_mids = [4.0 * u * v, 4.0 * v * w, 4.0 * w * u];
    [0, 1, 2].map(|k| (0..3).map(|i| at_corners[i] * corners[i][k] + at_mids[i] * mids[i][k]).sum())
}

/// The points that divide a triangle's sides into so many parts, and those of the lattice inside; with one part, its corners, the
/// middles of its sides, and its centre.
fn lattice(corners: [Vec3; 3], along: u32) -> Vec<Vec3> {
    if along == 1 {
        let inside = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0), (0.5, 0.5), (0.0, 0.5), (1.0 / 3.0, 1.0 / 3.0)];
        return inside.map(|(v, w)| flat(corners, v, w)).into();
    }
    let share = |k: u32| f64::from(k) / f64::from(along);
    let all = (0..=along).flat_map(|i| (0..=along - i).map(move |j| (i, j)));
    all.map(|(i, j)| flat(corners, share(i), share(j))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn mesh_of(n: u32, curved: bool) -> Mesh {
        let soup = shapes::sphere(n);
        let mut points = soup.points().to_vec();
        let triangles: Vec<[VertexId; 3]> = soup.triangles().iter().map(|t| t.map(VertexId)).collect();
        let mut mids = vec![None; triangles.len()];
        for (t, mids) in triangles.iter().zip(&mut mids).filter(|_| curved) {
            *mids = Some([0, 1, 2].map(|k| {
                let [p, q] = [t[k], t[(k + 1) % 3]].map(|v| soup.points()[v.index()]);
                let middle = crate::vec3::midpoint(p, q);
                let length = crate::vec3::norm(middle);
                points.push(middle.map(|c| c / length));
                VertexId::at(points.len() - 1)
            }));
        }
        Mesh { triangulation: Triangulation { points, triangles }, mids, charts: None }
    }

    /// Of a fine sphere, a coarse one is off by what its edges cut off: a quarter of it with half the edge, and far less where
    /// elements are curved. Both sides see it.
    #[test]
    fn the_chord_error_of_spheres_falls_with_the_square_of_edges() {
        let fine = mesh_of(48, false).triangulation;
        // More than the finer one of the two is off by anywhere.
        let of = |n: u32, curved: bool| measure(&mesh_of(n, curved), &fine, 0.05);
        let (coarse, half, curved) = (of(4, false), of(8, false), of(4, true));
        for deviation in [&coarse, &half] {
            let sides = [deviation.mesh_to_surface.distance, deviation.surface_to_mesh.distance];
            assert!((sides[0] / sides[1] - 1.0).abs() < 0.15, "{sides:?}");
        }
        let ratio = coarse.mesh_to_surface.distance / half.mesh_to_surface.distance;
        assert!((3.0..5.0).contains(&ratio), "{ratio}");
        assert!(curved.mesh_to_surface.distance < 0.15 * coarse.mesh_to_surface.distance, "{curved:?}");
        assert!(!coarse.too_far.is_empty() && half.too_far.is_empty(), "{coarse:?}");
        let worst = coarse.too_far.iter().map(|t| t.distance).fold(0.0, f64::max);
        let sides = coarse.mesh_to_surface.distance.max(coarse.surface_to_mesh.distance);
        assert_eq!(worst, sides);
        assert_eq!(measure(&mesh_of(4, false), &fine, sides).too_far, vec![], "what may be is not too far");
    }
}
