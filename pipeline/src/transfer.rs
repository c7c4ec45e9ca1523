//! Transfer: which parts of a surface the elements of a mesh of it stand for.
//!
//! Elements are chords of the surface: where it bends they are not on it, and what lies between them is not clear from their
//! positions alone. So a triangle of the surface is parted in its own plane: elements nearby are projected onto it along its normal,
//! the nearest first, and each takes what it covers of what the others have left. What none covers (slivers between chord and arc)
//! goes to the element that is nearest to it. The shares of a triangle add up to its area, so that a quantity per area is
//! conserved: an overlay of two triangulations (Farrell and Maddison 2011, doi 10.1016/j.cma.2010.07.015, call its use Galerkin
//! projection onto piecewise constants; here the meshes need not cover the same surface).

use crate::evaluate::{Bvh, box_around, on_triangle, triangle_bvh};
use crate::vec3::{BoundingBox, Vec3, cross, dot, norm, sub, triangle_area};

/// Elements within so many times the distance between a triangle and the mesh may cover it. By experience: the middle of a
/// chord is farther off than its ends, where the distance is measured.
const REACH: f64 = 2.0;

/// Pieces of less than this share of a triangle are left out: what they had goes to the others in proportion.
const NOTHING: f64 = 1e-13;

/// A piece of a triangle of the surface, and the element that stands for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// The triangle.
    pub triangle: u32,
    /// The element.
    pub element: u32,
    /// The area, in the unit of the surface, squared.
    pub area: f64,
}

/// Triangles, and the charts in which they lie, where that is known.
#[derive(Clone, Copy, Debug)]
pub struct Charted<'a> {
    /// The corners.
    pub corners: &'a [[Vec3; 3]],
    /// One for each; empty where they are not known.
    pub charts: &'a [u32],
}

/// The shares of all triangles of a surface, in their order. Where both know their charts, elements stand for triangles of their
/// own chart alone. Triangles without area have no shares.
///
/// ```
/// use planish_core::transfer::{Charted, shares};
///
/// // A square of two triangles, and a mesh of it with the other diagonal.
/// let [a, b, c, d] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let (surface, mesh) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
/// let found = shares(Charted { corners: &surface, charts: &[] }, Charted { corners: &mesh, charts: &[] });
/// assert_eq!(found.len(), 4, "every triangle has a half in both elements");
/// assert!(found.iter().all(|share| (share.area - 0.25).abs() < 1e-15));
/// ```
pub fn shares(surface: Charted, mesh: Charted) -> Vec<Share> {
    let search = Search { mesh, surface, tree: triangle_bvh(mesh.corners.iter().copied()) };
    let faces = Faces::of(&search);
    let mut found = Vec::new();
    for triangle in 0..surface.corners.len() as u32 {
        search.part(triangle, &faces, &mut found);
    }
    found
}

struct Search<'a> {
    surface: Charted<'a>,
    mesh: Charted<'a>,
    tree: Bvh,
}

/// Per element, its normal, and whether that is on the same side as that of the surface: meshes of surfaces that have no sides
/// may be turned anywhere.
struct Faces {
    normals: Vec<Vec3>,
}

impl Faces {
    fn of(search: &Search) -> Self {
        let surface = triangle_bvh(search.surface.corners.iter().copied());
        let normal = |corners: &[Vec3; 3]| cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
        let facing = |(element, corners): (usize, &[Vec3; 3])| {
            let n = normal(corners);
            let centroid = centroid(corners);
            let distance = |t: u32| {
                let is_near = search.may_cover(t, element as u32);
                if is_near { on_triangle(centroid, search.surface.corners[t as usize]).squared } else { f64::INFINITY }
            };
            let nearest = surface.nearest(centroid, f64::INFINITY, distance);
            let is_turned = nearest.is_some_and(|(t, _)| dot(normal(&search.surface.corners[t as usize]), n) < 0.0);
            if is_turned { n.map(|c| -c) } else { n }
        };
        Self { normals: search.mesh.corners.iter().enumerate().map(facing).collect() }
    }
}

impl Search<'_> {
    /// Whether the charts of a triangle and an element do not speak against it.
    fn may_cover(&self, triangle: u32, element: u32) -> bool {
        let (t, e) = (self.surface.charts.get(triangle as usize), self.mesh.charts.get(element as usize));
        t.is_none() || e.is_none() || t == e
    }

    /// The element that is nearest to a point of a triangle, and its squared distance: of the same chart, where it has any.
    fn nearest(&self, triangle: u32, x: Vec3) -> Option<(u32, f64)> {
        let distance = |e: u32| on_triangle(x, self.mesh.corners[e as usize]).squared;
        let of_chart = |e: u32| if self.may_cover(triangle, e) { distance(e) } else { f64::INFINITY };
        let nearest = self.tree.nearest(x, f64::INFINITY, of_chart);
        nearest.or_else(|| self.tree.nearest(x, f64::INFINITY, distance))
    }

    /// Parts a triangle among elements.
    fn part(&self, triangle: u32, faces: &Faces, found: &mut Vec<Share>) {
        let corners = self.surface.corners[triangle as usize];
        let area = triangle_area(corners);
        let Some(plane) = Frame::of(corners).filter(|_| area > 0.0) else { return };
        let first = found.len();
        let middle = centroid(&corners);
        let off = corners.into_iter().chain([middle]).filter_map(|x| self.nearest(triangle, x));
        let off = off.fold(0.0, |m: f64, (_, squared)| m.max(squared)).sqrt();
        let mut left = vec![corners.map(|x| plane.project(x)).to_vec()];
        for element in self.around(triangle, faces, &plane, REACH * off) {
            let cutter = Cutter::of(self.mesh.corners[element as usize].map(|x| plane.project(x)));
            let taken = cutter.take(&mut left, NOTHING * area);
            if taken > 0.0 {
                found.push(Share { triangle, element, area: taken });
            }
            if left.is_empty() {
                break;
            }
        }
        for piece in &left {
            let at = plane.lift(mean(piece));
            let Some((element, _)) = self.nearest(triangle, at) else { continue };
            let area = 0.5 * doubled_area(piece);
            match found[first..].iter_mut().find(|share| share.element == element) {
                Some(share) => share.area += area,
                None => found.push(Share { triangle, element, area }),
            }
        }
        // Rounding, and what was left out.
        let sum: f64 = found[first..].iter().map(|share| share.area).sum();
        found[first..].iter_mut().for_each(|share| share.area *= area / sum);
    }

    /// The elements that may cover a triangle, the nearest first.
    fn around(&self, triangle: u32, faces: &Faces, plane: &Frame, reach: f64) -> Vec<u32> {
        let corners = self.surface.corners[triangle as usize];
        let around = box_around(corners);
        // As far as rounding of its coordinates goes.
        let slack = reach + 1e-12 * (0..3).map(|k| around.max[k].abs().max(around.min[k].abs())).fold(0.0, f64::max);
        let around = BoundingBox { min: around.min.map(|c| c - slack), max: around.max.map(|c| c + slack) };
        let middle = centroid(&corners);
        let mut near: Vec<(f64, u32)> = Vec::new();
        self.tree.overlapping(&around, |e| {
            if self.may_cover(triangle, e) && dot(faces.normals[e as usize], plane.normal) > 0.0 {
                near.push((on_triangle(middle, self.mesh.corners[e as usize]).squared, e));
            }
        });
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        near.into_iter().map(|(_, element)| element).collect()
    }
}

fn centroid(corners: &[Vec3; 3]) -> Vec3 {
    [0, 1, 2].map(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0)
}

/// A point of the plane of a triangle.
type Point = [f64; 2];

/// The plane of a triangle.
struct Frame {
    origin: Vec3,
    axes: [Vec3; 2],
    normal: Vec3,
}

impl Frame {
    /// None where it has no direction.
    fn of([a, b, c]: [Vec3; 3]) -> Option<Self> {
        let (along, normal) = (sub(b, a), cross(sub(b, a), sub(c, a)));
        let (length, height) = (norm(along), norm(normal));
        let is_some = length > 0.0 && height > 0.0;
        let (first, normal) = (along.map(|x| x / length), normal.map(|x| x / height));
        is_some.then(|| Self { origin: a, axes: [first, cross(normal, first)], normal })
    }

    fn project(&self, x: Vec3) -> Point {
        self.axes.map(|axis| dot(sub(x, self.origin), axis))
    }

    fn lift(&self, [u, v]: Point) -> Vec3 {
        [0, 1, 2].map(|k| self.origin[k] + u * self.axes[0][k] + v * self.axes[1][k])
    }
}

/// A triangle that turns left, by its sides.
struct Cutter([Point; 3]);

impl Cutter {
    fn of([a, b, c]: [Point; 3]) -> Self {
        if doubled_area(&[a, b, c]) < 0.0 { Self([a, c, b]) } else { Self([a, b, c]) }
    }

    /// Takes what lies inside from some convex pieces, which turn left; its area. Pieces of less than `nothing` vanish.
    fn take(&self, pieces: &mut Vec<Vec<Point>>, nothing: f64) -> f64 {
        let mut taken = 0.0;
        let mut left = Vec::with_capacity(pieces.len());
        for piece in pieces.drain(..) {
            if !self.may_meet(&piece) {
                left.push(piece);
                continue;
            }
            let mut inside = piece;
            for k in 0..3 {
                let [from, to] = [self.0[k], self.0[(k + 1) % 3]];
                let (here, beyond) = parted(&inside, from, to);
                if doubled_area(&beyond) > 2.0 * nothing {
                    left.push(beyond);
                }
                inside = here;
                if inside.is_empty() {
                    break;
                }
            }
            taken += (doubled_area(&inside) / 2.0).max(0.0);
        }
        *pieces = left;
        if taken > nothing { taken } else { 0.0 }
    }

    /// Whether a piece is not wholly beyond one of the sides.
    fn may_meet(&self, piece: &[Point]) -> bool {
        (0..3).all(|k| piece.iter().any(|p| side(self.0[k], self.0[(k + 1) % 3], *p) > 0.0))
    }
}

/// On which side of a line a point is: positive on the left.
fn side(from: Point, to: Point, p: Point) -> f64 {
    (to[0] - from[0]) * (p[1] - from[1]) - (to[1] - from[1]) * (p[0] - from[0])
}

/// The parts of a convex polygon on the left and on the right of a line (Sutherland and Hodgman 1974, doi
/// 10.1145/360767.360802).
fn parted(polygon: &[Point], from: Point, to: Point) -> (Vec<Point>, Vec<Point>) {
    let (mut left, mut right) = (Vec::with_capacity(polygon.len() + 1), Vec::with_capacity(polygon.len() + 1));
    for (i, p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (here, there) = (side(from, to, *p), side(from, to, q));
        if here >= 0.0 {
            left.push(*p);
        }
        if here <= 0.0 {
            right.push(*p);
        }
        if here * there < 0.0 {
            let t = here / (here - there);
            let crossing = [0, 1].map(|k| p[k] + t * (q[k] - p[k]));
            left.push(crossing);
            right.push(crossing);
        }
    }
    (left, right)
}

/// Twice the area of a polygon, positive where it turns left.
fn doubled_area(polygon: &[Point]) -> f64 {
    let Some(origin) = polygon.first() else { return 0.0 };
    polygon.windows(2).map(|pair| side(*origin, pair[0], pair[1])).sum()
}

fn mean(polygon: &[Point]) -> Point {
    [0, 1].map(|k| polygon.iter().map(|p| p[k]).sum::<f64>() / polygon.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    fn corners(soup: &crate::mesh::TriangleSoup) -> Vec<[Vec3; 3]> {
        soup.triangles().iter().map(|t| t.map(|n| soup.points()[n as usize])).collect()
    }

    fn of(corners: &[[Vec3; 3]]) -> Charted<'_> {
        Charted { corners, charts: &[] }
    }

    /// Whatever the mesh: coarser, finer, elsewhere.
    #[test]
    fn every_area_is_assigned_wholly() {
        let surface = corners(&shapes::sphere(12));
        for rings in [3, 12, 30] {
            let mesh = corners(&shapes::sphere(rings));
            let found = shares(of(&surface), of(&mesh));
            let mut areas = vec![0.0; surface.len()];
            found.iter().for_each(|share| areas[share.triangle as usize] += share.area);
            for (area, corners) in areas.iter().zip(&surface) {
                assert!((area - triangle_area(*corners)).abs() <= 1e-12 * area, "{area}");
            }
            // And every element has about its own: it is no larger than what it stands for, and little smaller.
            let mut of_elements = vec![0.0; mesh.len()];
            found.iter().for_each(|share| of_elements[share.element as usize] += share.area);
            let is_fair = |(area, corners): (&f64, &[Vec3; 3])| (0.4..2.5).contains(&(area / triangle_area(*corners)));
            assert!(of_elements.iter().zip(&mesh).all(is_fair), "{rings}");
        }
    }

    /// Elements of the other side of a thin wall cover nothing of this one.
    #[test]
    fn thin_walls_have_two_sides() {
        let square = |z: f64, turned: bool| {
            let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| [x, y, z]);
            if turned { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] }
        };
        let surface = [square(0.0, true), square(1e-3, false)].concat();
        let found = shares(of(&surface), of(&surface));
        assert!(found.iter().all(|share| share.triangle == share.element), "{found:?}");
        // Where the mesh is off by more than the wall is thick, normals tell.
        let moved: Vec<[Vec3; 3]> = surface.iter().map(|t| t.map(|[x, y, z]| [x, y, z + 4e-4])).collect();
        assert!(shares(of(&surface), of(&moved)).iter().all(|share| share.triangle == share.element));
    }

    #[test]
    fn charts_keep_elements_apart() {
        let surface = corners(&shapes::flat_disk(4));
        let charts: Vec<u32> = (0..surface.len() as u32).map(|t| t % 2).collect();
        let both = Charted { corners: &surface, charts: &charts };
        let found = shares(both, both);
        assert!(found.iter().all(|share| share.triangle == share.element));
    }
}
