//! Spikes and pits: where a surface is too thin for a mesh of a given edge length.
//!
//! A mesher sees a surface through its nodes. A spike (or a pit) of which an edge length goes around only a few times is
//! cut off: no node comes to lie in it. The measure of that is the area of the surface within a ball around a point, the
//! part of it that is connected to the point, beside the area of a disk of the same radius r. In the plane both are the
//! same; at the tip of a cone of half-angle a, it is sin a; on a tube of circumference w, 2 w / (pi r) where r is above w.
//!
//! The ball has a radius of two edges. Where the share is below 0.6, elements must be smaller; with half the edge
//! length the same is asked again, three times at most. Balls that reach beyond their chart are passed over: meshers
//! put nodes on every seam, so that nothing is cut off there.
//!
//! *It ends.* Each halving looks at each vertex once, and each look at the triangles within a ball; around a vertex that was
//! looked at, none is within an eighth of a radius, so that a triangle lies in a bounded number of balls (fewer than 300 where
//! the surface is flat), however many triangles an edge is long.

use crate::atlas::Chart;
use crate::evaluate::on_segment;
use crate::measure::curvature::Principal;
use crate::mesh::SurfaceMesh;
use crate::topology::{FaceId, HalfEdgeId, VisitStamps};
use crate::vec3::{Vec3, cross, distance, dot, norm, sub, triangle_area};
use std::f64::consts::{PI, TAU};

/// Below this share of a disk a place is thin: a cone of half-angle 37 degrees. The nostrils of face_bff, which
/// Frontal-Delaunay and MeshAdapt leave out by 1.4 edges, have 0.5.
const THIN: f64 = 0.6;

/// How often the edge length is halved.
const HALVINGS: u32 = 3;

/// The radius of the balls, in edges.
const REACH: f64 = 2.0;

/// A mesh follows a cone as far as so many edges go around it; but from further away than [`FURTHEST`] edges none is looked
/// after: a cone as sharp has no area to speak of.
const AROUND: f64 = 4.0;

/// See [`AROUND`].
const FURTHEST: f64 = 16.0;

/// Thin places are bent: on tubes that are thin the product of curvature and edge length is above 2. Elsewhere nothing is
/// looked for, but at vertices whose angles add up to little: the curvature around the tip of a cone is a mean, and small
/// where its facets are long.
const BENT: f64 = 1.0;

/// A place where a mesh must be finer, or cut something off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spike {
    /// The middle of it, a vertex of the surface.
    pub centre: Vec3,
    /// How far it reaches, in the unit of the input.
    pub radius: f64,
    /// The edge length there, in the unit of the input.
    pub size: f64,
}

/// The spikes and pits inside `charts` that a mesh with edges of length `size` would cut off, from the widest to the
/// thinnest. `curvatures` are those of the vertices of `mesh`, more may follow.
pub fn spikes<C: AsRef<Chart>>(mesh: &SurfaceMesh, charts: &[C], curvatures: &[Principal], size: f64) -> Vec<Spike> {
    let mut search = Search::new(mesh, charts);
    let bends: Vec<f64> = angles(mesh)
        .iter()
        .zip(curvatures)
        .map(|(a, [k, l])| if *a < THIN * TAU { f64::INFINITY } else { norm(*k).max(norm(*l)) })
        .collect();
    let mut found = Vec::new();
    let mut wanted = vec![true; mesh.points().len()];
    for halved in 0..HALVINGS {
        let size = size * 0.5_f64.powi(halved as i32);
        let candidates = (0..wanted.len()).filter(|v| wanted[*v] && bends[*v] * size > BENT);
        let thin = search.thin(&candidates.collect::<Vec<_>>(), REACH * size);
        if thin.is_empty() {
            break;
        }
        wanted = search.within.clone();
        found.extend(thin.iter().map(|place| place.spike(mesh, size)));
    }
    found
}

/// The sum of the angles around each vertex.
fn angles(mesh: &SurfaceMesh) -> Vec<f64> {
    let mut angles = vec![0.0; mesh.points().len()];
    for (face, t) in mesh.triangles().iter().enumerate() {
        let p = mesh.corners(face);
        for k in 0..3 {
            let [a, b] = [1, 2].map(|i| sub(p[(k + i) % 3], p[k]));
            angles[t[k].index()] += norm(cross(a, b)).atan2(dot(a, b));
        }
    }
    angles
}

/// A vertex around which the surface is thin.
struct Thin {
    vertex: usize,
    /// The area around it, beside that of a disk.
    share: f64,
}

impl Thin {
    /// Half of `size` as far as `size` is too long: until the circumference of a cone with this share of area is
    /// [`AROUND`] times as long.
    fn spike(&self, mesh: &SurfaceMesh, size: f64) -> Spike {
        let far = AROUND / (TAU * self.share);
        Spike { centre: mesh.points()[self.vertex], radius: size * far.clamp(REACH, FURTHEST), size: 0.5 * size }
    }
}

/// Walks over the triangles in balls around vertices.
struct Search<'a> {
    mesh: &'a SurfaceMesh,
    /// Per triangle its chart, none where it has none.
    chart: Vec<u32>,
    /// Per vertex a triangle beside it.
    beside: Vec<u32>,
    /// The triangles that the walk has reached.
    seen: VisitStamps,
    /// The triangles of a walk, in the order in which they were reached.
    queue: Vec<u32>,
    /// Per vertex, whether it lies in the ball around a thin place.
    within: Vec<bool>,
}

impl<'a> Search<'a> {
    fn new<C: AsRef<Chart>>(mesh: &'a SurfaceMesh, charts: &[C]) -> Self {
        let mut chart = vec![u32::MAX; mesh.triangles().len()];
        for (c, id) in charts.iter().zip(0..) {
            c.as_ref().faces().iter().for_each(|f| chart[f.index()] = id);
        }
        let mut beside = vec![u32::MAX; mesh.points().len()];
        for (t, face) in mesh.triangles().iter().zip(0..) {
            t.iter().for_each(|v| beside[v.index()] = face);
        }
        let (seen, within) = (VisitStamps::new(chart.len()), vec![false; beside.len()]);
        Self { mesh, chart, beside, seen, queue: Vec::new(), within }
    }

    /// Those of `vertices` around which the surface is thin. Of several within half of `radius`, the first.
    fn thin(&mut self, vertices: &[usize], radius: f64) -> Vec<Thin> {
        let mut is_done = vec![false; self.beside.len()];
        self.within.fill(false);
        let mut thin = Vec::new();
        for v in vertices.iter().copied() {
            if is_done[v] || self.beside[v] == u32::MAX {
                continue;
            }
            let share = self.thin_share(v, radius);
            let is_thin = share.is_some();
            let done = radius * if is_thin { 0.5 } else { 0.125 };
            for face in &self.queue {
                for corner in self.mesh.triangles()[*face as usize] {
                    let away = distance(self.mesh.points()[corner.index()], self.mesh.points()[v]);
                    is_done[corner.index()] |= away < done;
                    self.within[corner.index()] |= is_thin && away < radius;
                }
            }
            thin.extend(share.map(|share| Thin { vertex: v, share }));
        }
        thin
    }

    /// The area of the surface within `radius` of a vertex, beside that of a disk; none unless it is all in one chart, and
    /// thin. Leaves the triangles in `queue`.
    fn thin_share(&mut self, vertex: usize, radius: f64) -> Option<f64> {
        let centre = self.mesh.points()[vertex];
        let disk = PI * radius * radius;
        let mut area = 0.0;
        self.seen.clear();
        self.queue.clear();
        self.reach(self.beside[vertex]);
        let mut next = 0;
        while let Some(face) = self.queue.get(next).copied() {
            next += 1;
            let corners = self.mesh.corners(face as usize);
            area += area_within(corners, centre, radius);
            if area >= THIN * disk {
                return None;
            }
            for side in 0..3 {
                let ends = [corners[side], corners[(side + 1) % 3]];
                if on_segment(centre, ends).1 < radius * radius && !self.cross(face, side) {
                    return None;
                }
            }
        }
        Some(area / disk)
    }

    fn reach(&mut self, face: u32) {
        if self.seen.visit(face as usize) {
            self.queue.push(face);
        }
    }

    /// Walks to the other side of an edge; not if it lies in another chart, or there is none.
    fn cross(&mut self, face: u32, side: usize) -> bool {
        let twin = self.mesh.edges().twin(HalfEdgeId::side_of(FaceId(face), side));
        let same = |other: &u32| self.chart[*other as usize] == self.chart[face as usize];
        let other = twin.map(|t| t.face().0).filter(same);
        other.into_iter().for_each(|other| self.reach(other));
        other.is_some()
    }
}

/// The area of the part of a triangle within a ball.
fn area_within(corners: [Vec3; 3], centre: Vec3, radius: f64) -> f64 {
    if corners.iter().all(|p| distance(*p, centre) <= radius) {
        return triangle_area(corners);
    }
    let normal = cross(sub(corners[1], corners[0]), sub(corners[2], corners[0]));
    let doubled = norm(normal);
    if doubled == 0.0 {
        return 0.0;
    }
    let normal = normal.map(|c| c / doubled);
    let height = dot(sub(centre, corners[0]), normal);
    let squared = radius * radius - height * height;
    if squared <= 0.0 {
        return 0.0;
    }
    let foot = [0, 1, 2].map(|k| centre[k] - height * normal[k]);
    let [a, b, c] = corners.map(|p| sub(p, foot));
    [[a, b], [b, c], [c, a]].iter().map(|s| sector_within(*s, normal, squared)).sum::<f64>().max(0.0)
}

/// The signed area of the part of the triangle between the origin and a segment that lies within a circle around the
/// origin, all in the plane with the given normal. `squared` is the square of the radius.
fn sector_within([a, b]: [Vec3; 2], normal: Vec3, squared: f64) -> f64 {
    let doubled = |p: Vec3, q: Vec3| dot(cross(p, q), normal);
    let sector = |p: Vec3, q: Vec3| 0.5 * squared * doubled(p, q).atan2(dot(p, q));
    let along = sub(b, a);
    let (length, middle) = (dot(along, along), dot(a, along));
    let discriminant = middle * middle - length * (dot(a, a) - squared);
    if length == 0.0 {
        return 0.0;
    }
    if discriminant <= 0.0 {
        return sector(a, b);
    }
    let root = discriminant.sqrt();
    let (enters, leaves) = ((-middle - root) / length, (-middle + root) / length);
    if leaves <= 0.0 || enters >= 1.0 {
        return sector(a, b);
    }
    let at = |t: f64| [0, 1, 2].map(|k| a[k] + t * along[k]);
    let (p, q) = (at(enters.max(0.0)), at(leaves.min(1.0)));
    sector(a, p) + 0.5 * doubled(p, q) + sector(q, b)
}

#[cfg(test)]
mod tests;
