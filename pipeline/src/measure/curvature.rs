//! Curvature of a triangulated surface, for size fields: a tensor per vertex.
//!
//! The curvature measure of an edge with dihedral angle b and length l is b l t t^T, where t is the unit vector
//! across the edge in the tangent plane (the normal cycle of Cohen-Steiner and Morvan 2003, doi
//! 10.1145/777792.777839, in the variant whose eigenvectors are the directions of curvature). Half of it goes to
//! each end; the tensor of a vertex is the measure of the cells of its star over their (mollified) area. Open and
//! non-manifold edges measure nothing. All numbers are finite.

use crate::mesh::SurfaceMesh;
use crate::topology::{EdgeTable, HalfEdgeId, VertexFans, VertexId};
use crate::vec3::{Vec3, cross, dot, norm, sub};

/// Curvatures are cut off here, per diagonal of the bounding box: no mesher resolves radii below.
const LARGEST: f64 = 1e9;

/// A symmetric tensor: entries xx, yy, zz, xy, yz, zx.
type Tensor = [f64; 6];

/// Tensor and normal at a point of the surface, in the unit of the metric.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Curvature {
    tensor: Tensor,
    normal: Vec3,
}

/// Largest and smallest principal curvature (by magnitude), each as unit direction times curvature.
pub type Principal = [Vec3; 2];

impl Curvature {
    /// Half-way between two points.
    pub fn between(&self, other: &Self) -> Self {
        let tensor = std::array::from_fn(|k| 0.5 * (self.tensor[k] + other.tensor[k]));
        // Its length does not count.
        let normal = [0, 1, 2].map(|k| self.normal[k] + other.normal[k]);
        Self { tensor, normal }
    }

    /// The principal curvatures within the tangent plane, for a surface whose lengths are multiplied by `scale`.
    pub fn principal(&self, scale: f64) -> Principal {
        let [e, f] = frame(self.normal);
        // The matrix (a b, b c) in the tangent plane has the eigenvalues mean + radius and mean - radius.
        let (a, b, c) = (self.along(e, e), self.along(e, f), self.along(f, f));
        let mean = 0.5 * (a + c);
        let half = 0.5 * (a - c);
        let radius = (half * half + b * b).sqrt();
        // The eigenvector of mean + radius, by the row of the matrix that does not cancel.
        let v = if half >= 0.0 { [half + radius, b] } else { [b, radius - half] };
        let length = (v[0] * v[0] + v[1] * v[1]).sqrt();
        // Where all directions have the same curvature, any will do.
        let v = if length > 0.0 { v.map(|x| x / length) } else { [1.0, 0.0] };
        let in_space = |v: [f64; 2], k: f64| {
            let k = (k.clamp(-LARGEST, LARGEST) * scale).clamp(f64::MIN, f64::MAX);
            [0, 1, 2].map(|i| k * (v[0] * e[i] + v[1] * f[i]))
        };
        let first = in_space(v, mean + radius);
        let second = in_space([-v[1], v[0]], mean - radius);
        // The larger by magnitude comes first.
        if mean >= 0.0 { [first, second] } else { [second, first] }
    }

    /// p^T tensor q.
    fn along(&self, p: Vec3, q: Vec3) -> f64 {
        let [xx, yy, zz, xy, yz, zx] = self.tensor;
        p[0] * (xx * q[0] + xy * q[1] + zx * q[2])
            + p[1] * (xy * q[0] + yy * q[1] + yz * q[2])
            + p[2] * (zx * q[0] + yz * q[1] + zz * q[2])
    }
}

/// Two unit vectors that make a right-handed frame with the direction of `normal` (Duff and co-workers 2017,
/// *Building an orthonormal basis, revisited*); those of the z axis where there is none.
fn frame(normal: Vec3) -> [Vec3; 2] {
    let length = norm(normal);
    let [x, y, z] = if length > 0.0 { normal.map(|c| c / length) } else { [0.0, 0.0, 1.0] };
    let sign = 1.0_f64.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// A curvature measure and the area that it belongs to.
#[derive(Clone, Copy, Default)]
struct Measure {
    tensor: Tensor,
    area: f64,
}

impl Measure {
    fn add(&mut self, tensor: Tensor, area: f64) {
        (0..6).for_each(|k| self.tensor[k] += tensor[k]);
        self.area += area;
    }
}

/// What the triangles around a vertex add up to.
#[derive(Clone, Copy, Default)]
struct Star {
    measure: Measure,
    /// The sum of normals, weighted by area.
    normal: Vec3,
}

impl Star {
    fn curvature(self) -> Curvature {
        let Measure { tensor, area } = self.measure;
        let mean = |x: f64| if area > 0.0 { (x / area).clamp(-LARGEST, LARGEST) } else { 0.0 };
        Curvature { tensor: tensor.map(mean), normal: self.normal }
    }
}

/// The triangles of a surface, in the unit of its metric, with vertices that are numbered in some way.
struct Faces<'a> {
    triangles: &'a [[VertexId; 3]],
    edges: &'a EdgeTable,
    /// The corners of each triangle.
    corners: Vec<[Vec3; 3]>,
    normals: Vec<Vec3>,
    areas: Vec<f64>,
}

impl<'a> Faces<'a> {
    /// The triangles of `mesh`, whose vertices are numbered as in `triangles`, and whose edges are `edges`.
    fn new(mesh: &SurfaceMesh, triangles: &'a [[VertexId; 3]], edges: &'a EdgeTable) -> Self {
        let scale = mesh.metric().scale;
        let scaled = |face: usize| mesh.corners(face).map(|p| p.map(|c| c * scale));
        let corners: Vec<[Vec3; 3]> = (0..triangles.len()).map(scaled).collect();
        let normals = corners.iter().map(|p| unit_normal(*p)).collect();
        let areas = mesh.metric().shapes.iter().map(|s| s.area()).collect();
        Self { triangles, edges, corners, normals, areas }
    }

    /// Per vertex, the measure and the area of its cell: half of each edge, a third of each triangle.
    fn cells(&self, vertices: usize) -> Vec<Measure> {
        let mut cells = vec![Measure::default(); vertices];
        for (t, area) in self.triangles.iter().zip(&self.areas) {
            for v in t {
                cells[v.index()].area += area / 3.0;
            }
        }
        for (_, sides) in self.edges.iter() {
            // Only edges between two triangles have a dihedral angle.
            let [g, h] = *sides else { continue };
            let t = self.triangles[g.face().index()];
            let ends = [t[g.side()], t[(g.side() + 1) % 3]];
            let corners = self.corners[g.face().index()];
            let along = sub(corners[(g.side() + 1) % 3], corners[g.side()]);
            let [left, right] = [g, h].map(|h| self.normals[h.face().index()]);
            let half = edge_measure(along, left, right).map(|x| 0.5 * x);
            for v in ends {
                cells[v.index()].add(half, 0.0);
            }
        }
        cells
    }

    /// The curvature at every vertex: the measure of the cells of its star.
    fn curvatures(&self, vertices: usize) -> Vec<Curvature> {
        let cells = self.cells(vertices);
        let mut stars = vec![Star::default(); vertices];
        for (face, corners) in self.triangles.iter().enumerate() {
            // The cells of the triangle's corners, added to the star of each of them.
            let mut around = Measure::default();
            for c in corners {
                around.add(cells[c.index()].tensor, cells[c.index()].area);
            }
            for c in corners {
                let star = &mut stars[c.index()];
                star.measure.add(around.tensor, around.area);
                for k in 0..3 {
                    star.normal[k] += self.areas[face] * self.normals[face][k];
                }
            }
        }
        stars.into_iter().map(Star::curvature).collect()
    }
}

/// The curvature at each group of vertices of `mesh` that `group` gives the same number below `groups`: copies of
/// one vertex in several sheets share theirs.
///
/// # Example
///
/// A tube of radius 2 bends by a half around, and not along.
///
/// ```
/// use planish_core::measure::curvature::measure;
/// use planish_core::mesh::TriangleSoup;
/// use planish_core::vec3::norm;
/// use planish_core::{repair, shapes};
///
/// let tube = shapes::tube(48, 4, 1.0);
/// let doubled = tube.points().iter().map(|p| p.map(|c| 2.0 * c)).collect();
/// let mesh = repair(&TriangleSoup::new(doubled, tube.triangles().to_vec())?, &Default::default())?.mesh;
/// // Every vertex is a group of its own.
/// let groups: Vec<u32> = (0..mesh.points().len() as u32).collect();
/// let curvatures = measure(&mesh, &groups, groups.len());
/// // Measured in the unit of the metric; the scale of that leads back to the unit of the input.
/// let half_way_up = 2 * 48;
/// let [largest, smallest] = curvatures[half_way_up].principal(mesh.metric().scale);
/// assert!((norm(largest) - 0.5).abs() < 0.01 && norm(smallest) < 0.01);
/// // Each is a direction, too: around means across the axis.
/// assert!(largest[2].abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn measure(mesh: &SurfaceMesh, group: &[u32], groups: usize) -> Vec<Curvature> {
    let grouped: Vec<[VertexId; 3]> = mesh.triangles().iter().map(|t| t.map(|v| VertexId(group[v.index()]))).collect();
    Faces::new(mesh, &grouped, mesh.edges()).curvatures(groups)
}

/// The principal curvatures at every vertex of `mesh`, in the inverse unit of the input. Copies of a vertex, in sheets and at
/// borders of labels, count as one: the first of them has its curvatures, and the others have none.
pub fn at_vertices(mesh: &SurfaceMesh) -> Vec<Principal> {
    let count = mesh.points().len();
    let welded = |v: usize| mesh.welded_vertex(VertexId::at(v)) as usize;
    let mut first = vec![u32::MAX; (0..count).map(welded).max().map_or(0, |w| w + 1)];
    for v in (0..count).rev() {
        first[welded(v)] = v as u32;
    }
    let groups: Vec<u32> = (0..count).map(|v| first[welded(v)]).collect();
    measure(mesh, &groups, count).iter().map(|c| c.principal(mesh.metric().scale)).collect()
}

/// The largest curvature at each vertex of `mesh`, by magnitude, in the inverse unit of the input, where the surface is smooth:
/// creases part it, and the sides of one have curvatures of their own, the larger of which counts. Sheets and labels that meet
/// in two triangles along an edge do not part it. `is_crease` tells creases by their half-edges.
///
/// ```
/// use planish_core::measure::curvature::largest;
/// use planish_core::{repair, shapes};
///
/// // A square duct has flat sides, and four edges that bend by 90 degrees.
/// let mesh = repair(&shapes::tube(4, 6, 3.0), &repair::Settings::default())?.mesh;
/// assert!(largest(&mesh, |_, _| true).iter().all(|k| *k == 0.0));
/// assert!(largest(&mesh, |_, _| false).iter().all(|k| *k > 0.1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn largest(mesh: &SurfaceMesh, is_crease: impl Fn(HalfEdgeId, HalfEdgeId) -> bool) -> Vec<f64> {
    let welded: Vec<[VertexId; 3]> =
        mesh.triangles().iter().map(|t| t.map(|v| VertexId(mesh.welded_vertex(v)))).collect();
    let edges = EdgeTable::new(&welded);
    let joins = |sides: &[HalfEdgeId]| matches!(*sides, [g, h] if !is_crease(g, h));
    let fans = VertexFans::across(&welded, &edges, joins);
    // Every smooth part of a star is a vertex of its own: edges between such are open.
    let corner = |face: usize| [0, 1, 2].map(|k| VertexId(fans.of_corner[3 * face + k]));
    let parted: Vec<[VertexId; 3]> = (0..welded.len()).map(corner).collect();
    let edges = EdgeTable::new(&parted);
    let curvatures = Faces::new(mesh, &parted, &edges).curvatures(fans.count);
    let mut of_welded = vec![0.0_f64; mesh.welded().iter().max().map_or(0, |last| *last as usize + 1)];
    for (triangle, corners) in welded.iter().zip(&parted) {
        for (v, fan) in triangle.iter().zip(corners) {
            let [first, _] = curvatures[fan.index()].principal(mesh.metric().scale);
            of_welded[v.index()] = of_welded[v.index()].max(norm(first));
        }
    }
    mesh.welded().iter().map(|w| of_welded[*w as usize]).collect()
}

/// b l t t^T for an edge between triangles with the given normals.
fn edge_measure(along: Vec3, left: Vec3, right: Vec3) -> Tensor {
    let across = cross([0, 1, 2].map(|k| left[k] + right[k]), along);
    let (length, width) = (norm(along), norm(across));
    if length == 0.0 || width == 0.0 {
        return Tensor::default();
    }
    let bend = dot(cross(left, right), along) / length;
    let weight = bend.atan2(dot(left, right)) * length;
    let [x, y, z] = across.map(|c| c / width);
    [x * x, y * y, z * z, x * y, y * z, z * x].map(|c| weight * c)
}

/// The unit normal of a triangle; zero where it has none.
pub(super) fn unit_normal(p: [Vec3; 3]) -> Vec3 {
    let n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    let length = norm(n);
    if length > 0.0 { n.map(|c| c / length) } else { [0.0; 3] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::{repair, shapes};

    fn measured(soup: &TriangleSoup) -> (SurfaceMesh, Vec<Principal>) {
        let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
        let group: Vec<u32> = (0..mesh.points().len() as u32).collect();
        let scale = mesh.metric().scale;
        let all = measure(&mesh, &group, group.len()).iter().map(|c| c.principal(scale)).collect();
        (mesh, all)
    }

    #[test]
    fn a_sphere_has_one_over_its_radius_in_every_direction() {
        for scale in [1.0, 1e-8, 1e8] {
            let sphere = shapes::sphere(40);
            let points = sphere.points().iter().map(|p| p.map(|c| c * 5.0 * scale)).collect();
            let soup = TriangleSoup::new(points, sphere.triangles().to_vec()).expect("sound");
            let (mesh, all) = measured(&soup);
            for (p, [max, min]) in mesh.points().iter().zip(&all) {
                let (max, min) = (norm(*max) * 5.0 * scale, norm(*min) * 5.0 * scale);
                assert!(max < 1.25 && min > 0.75 && min <= max, "{max} {min} at {p:?}");
            }
        }
    }

    #[test]
    fn a_tube_bends_around_and_not_along() {
        let (n, m) = (48, 48);
        let point = |i: u32, j: u32| {
            let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
            [2.0 * angle.cos(), 2.0 * angle.sin(), 0.2 * f64::from(j)]
        };
        let points = (0..n).flat_map(|i| (0..=m).map(move |j| point(i, j))).collect();
        let at = |i: u32, j: u32| (i % n) * (m + 1) + j;
        let squares = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let halves = squares.flat_map(|(i, j)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        });
        let (mesh, all) = measured(&TriangleSoup::new(points, halves.collect()).expect("sound"));
        for (p, [max, min]) in mesh.points().iter().zip(&all).filter(|(p, _)| p[2] > 1.0 && p[2] < 8.0) {
            assert!((norm(*max) - 0.5).abs() < 0.01 && norm(*min) < 0.01, "{max:?} {min:?}");
            let around = (p[0] * max[1] - p[1] * max[0]).abs() / (norm(*max) * 2.0);
            assert!(around > 0.999, "{max:?} at {p:?}");
        }
    }

    #[test]
    fn slivers_and_flat_triangles_keep_everything_finite() {
        for soup in [shapes::sliver_strip(12), shapes::folding_three(), shapes::book(3, 3)] {
            let (_, all) = measured(&soup);
            assert!(all.iter().flatten().flatten().all(|c| c.is_finite()));
        }
        assert!(Curvature::default().principal(1.0) == [[0.0; 3]; 2]);
    }
}
