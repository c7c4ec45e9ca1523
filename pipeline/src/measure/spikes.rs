//! Spikes and pits: where a surface is too thin for a mesh of a given edge length.
//!
//! A mesher sees a surface through its nodes. A spike (or a pit) of which an edge length goes around only a few times is
//! cut off: no node comes to lie in it. The measure of that is the area of the surface within a ball around a point, the
//! part of it that is connected to the point, beside the area of a disk of the same radius r. In the plane both are the
//! same; at the tip of a cone of half-angle a, it is sin a; on a tube of circumference w, 2 w / (pi r) where r is above w.
//!
//! The ball has a radius of two edges. Where the share is below 0.6, elements must be smaller, and where it is below 0.5 of a
//! ball of three edges: those see fingers that are wider. With half the edge length the same is asked again, three times at
//! most. Balls that reach beyond their chart are passed over: meshers put nodes on every seam, so that nothing is cut off
//! there.
//!
//! *It ends.* Each halving looks at each vertex once, and each look at the triangles within a ball; around a vertex that was
//! looked at, none is within an eighth of a radius, so that a triangle lies in a bounded number of balls (fewer than 300 where
//! the surface is flat), however many triangles an edge is long.

use crate::atlas::Chart;
use crate::evaluate::on_segment;
use crate::measure::curvature::Principal;
use crate::mesh::SurfaceMesh;
use crate::topology::{ChartId, FaceId, HalfEdgeId, VisitStamps};
use crate::vec3::{Vec3, cross, distance, dot, norm, sub, triangle_area};
use std::f64::consts::{PI, TAU};

/// Below this share of a disk a place is thin: a cone of half-angle 37 degrees. The nostrils of face_bff, which
/// Frontal-Delaunay and MeshAdapt leave out by 1.4 edges, have 0.5.
const THIN: f64 = 0.6;

/// How often the edge length is halved: each time is another look at what was found, and elements become four times as
/// many there.
const HALVINGS: u32 = 3;

/// The radius of the balls, in edges. By experience: smaller balls find thinner places only, larger ones reach beyond
/// their chart more often, and then tell nothing.
const REACH: f64 = 2.0;

/// Fingers are looked for in balls of so many edges, too: a tube of circumference w is above [`THIN`] in the smaller ones where
/// w is more than 1.9 edges. Lucy_100k has one of 2.2 edges, three edges long, that Gmsh left out.
const LONG_REACH: f64 = 3.0;

/// Below this share of a disk a ball of that radius holds a finger: of a tube that is fewer than 2.4 edges around.
const SLIM: f64 = 0.5;

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
///
/// # Example
///
/// A cone of twelve facets: its tip is sharp for elements of any size, so that all halvings find it.
///
/// ```
/// use planish_core::measure::{curvature::measure, spikes::spikes};
/// use planish_core::mesh::TriangleSoup;
/// use planish_core::{decompose, repair};
///
/// let on_ring = |j: u32| (f64::from(j) * std::f64::consts::TAU / 12.0).sin_cos();
/// let ring = (0..12).map(on_ring).map(|(sin, cos)| [cos, sin, 0.0]);
/// let points = std::iter::once([0.0, 0.0, 5.0]).chain(ring).collect();
/// let facets = (0..12).map(|j| [0, 1 + j, 1 + (j + 1) % 12]).collect();
/// let mesh = repair(&TriangleSoup::new(points, facets)?, &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &[0; 12])?;
/// let groups: Vec<u32> = (0..mesh.points().len() as u32).collect();
/// let curvatures = measure(&mesh, &groups, groups.len());
/// let curvatures: Vec<_> = curvatures.iter().map(|c| c.principal(mesh.metric().scale)).collect();
/// let found = spikes(&mesh, atlas.charts(), &curvatures, 0.05);
/// // From the widest to the thinnest, and how long edges should be there.
/// assert!(found.iter().all(|s| s.centre == [0.0, 0.0, 5.0]));
/// assert!(found.iter().map(|s| s.size).eq([0.05 / 2.0, 0.05 / 4.0, 0.05 / 8.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn spikes<C: AsRef<Chart>>(mesh: &SurfaceMesh, charts: &[C], curvatures: &[Principal], size: f64) -> Vec<Spike> {
    let mut search = Search::new(mesh, charts);
    let bends = bends(mesh, curvatures);
    let mut found = Vec::new();
    let mut wanted = vec![true; mesh.points().len()];
    for halved in 0..HALVINGS {
        let size = size * 0.5_f64.powi(halved as i32);
        let is_bent = |v: &usize| wanted[*v] && bends[*v] * size > BENT;
        let candidates: Vec<usize> = (0..wanted.len()).filter(is_bent).collect();
        search.within.fill(false);
        let mut thin = search.thin(&candidates, REACH * size, THIN);
        // What was found is found once.
        let others: Vec<usize> = candidates.into_iter().filter(|v| !search.within[*v]).collect();
        thin.extend(search.thin(&others, LONG_REACH * size, SLIM));
        if thin.is_empty() {
            break;
        }
        // With half the edge length only what was thin with the whole is looked at.
        wanted = search.within.clone();
        found.extend(thin.iter().map(|place| place.spike(mesh, size)));
    }
    found
}

/// How much the surface bends at each vertex: its larger curvature, without bound where its angles add up to little (see
/// [`BENT`]).
fn bends(mesh: &SurfaceMesh, curvatures: &[Principal]) -> Vec<f64> {
    let angles = angles(mesh);
    let mut bends = Vec::with_capacity(angles.len());
    for (angle, [largest, smallest]) in angles.iter().zip(curvatures) {
        let is_pointed = *angle < THIN * TAU;
        bends.push(if is_pointed { f64::INFINITY } else { norm(*largest).max(norm(*smallest)) });
    }
    bends
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
    /// Per triangle its chart, if it has one.
    chart: Vec<Option<ChartId>>,
    /// Per vertex a triangle beside it, if there is one.
    beside: Vec<Option<FaceId>>,
    /// The triangles that the walk has reached.
    seen: VisitStamps,
    /// The triangles of a walk, in the order in which they were reached.
    queue: Vec<FaceId>,
    /// Per vertex, whether it lies in the ball around a thin place.
    within: Vec<bool>,
}

impl<'a> Search<'a> {
    fn new<C: AsRef<Chart>>(mesh: &'a SurfaceMesh, charts: &[C]) -> Self {
        let mut chart = vec![None; mesh.triangles().len()];
        for (number, part) in charts.iter().map(AsRef::as_ref).enumerate() {
            for f in part.faces() {
                chart[f.index()] = Some(ChartId::at(number));
            }
        }
        let mut beside = vec![None; mesh.points().len()];
        for (face, t) in mesh.triangles().iter().enumerate() {
            for v in t {
                beside[v.index()] = Some(FaceId::at(face));
            }
        }
        let seen = VisitStamps::new(chart.len());
        let within = vec![false; beside.len()];
        Self { mesh, chart, beside, seen, queue: Vec::new(), within }
    }

    /// Those of `vertices` around which the surface within `radius` has a share of less than `most` of a disk. Of several
    /// within half of `radius`, the first. Marks what is `within` their balls.
    fn thin(&mut self, vertices: &[usize], radius: f64, most: f64) -> Vec<Thin> {
        let mut is_done = vec![false; self.beside.len()];
        let mut thin = Vec::new();
        for v in vertices.iter().copied() {
            let Some(beside) = self.beside[v].filter(|_| !is_done[v]) else { continue };
            let share = self.thin_share(v, beside, radius, most);
            let is_thin = share.is_some();
            // What is as near is not looked at again: so a triangle lies in a bounded number of balls.
            let done = radius * if is_thin { 0.5 } else { 0.125 };
            for face in &self.queue {
                for corner in self.mesh.triangles()[face.index()] {
                    let away = distance(self.mesh.points()[corner.index()], self.mesh.points()[v]);
                    is_done[corner.index()] |= away < done;
                    self.within[corner.index()] |= is_thin && away < radius;
                }
            }
            thin.extend(share.map(|share| Thin { vertex: v, share }));
        }
        thin
    }

    /// The area of the surface within `radius` of a vertex, which a triangle is `beside`, as a share of that of a disk; none
    /// unless it is all in one chart, and less than `most`. Leaves the triangles in `queue`.
    fn thin_share(&mut self, vertex: usize, beside: FaceId, radius: f64, most: f64) -> Option<f64> {
        let centre = self.mesh.points()[vertex];
        let disk = PI * radius * radius;
        let mut area = 0.0;
        self.seen.clear();
        self.queue.clear();
        self.reach(beside);
        let mut next = 0;
        while let Some(face) = self.queue.get(next).copied() {
            next += 1;
            let corners = self.mesh.corners(face.index());
            area += area_within(corners, centre, radius);
            if area >= most * disk {
                return None;
            }
            for h in face.sides() {
                let ends = [corners[h.side()], corners[h.next().side()]];
                let is_within = on_segment(centre, ends).squared < radius * radius;
                // The ball reaches beyond the chart.
                if is_within && !self.cross(h) {
                    return None;
                }
            }
        }
        Some(area / disk)
    }

    /// Queues a triangle, unless the walk has been there.
    fn reach(&mut self, face: FaceId) {
        if self.seen.visit(face.index()) {
            self.queue.push(face);
        }
    }

    /// Walks to the other side of an edge; not if it lies in another chart, or there is none.
    fn cross(&mut self, h: HalfEdgeId) -> bool {
        let chart = |h: HalfEdgeId| self.chart[h.face().index()];
        match self.mesh.edges().twin(h) {
            Some(twin) if chart(twin) == chart(h) => {
                self.reach(twin.face());
                true
            }
            _ => false,
        }
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
    // The ball cuts a disk out of the triangle's plane, around the foot of the perpendicular.
    let normal = normal.map(|c| c / doubled);
    let height = dot(sub(centre, corners[0]), normal);
    let squared = radius * radius - height * height;
    if squared <= 0.0 {
        return 0.0;
    }
    let foot = [0, 1, 2].map(|k| centre[k] - height * normal[k]);
    let [a, b, c] = corners.map(|p| sub(p, foot));
    let sectors = [[a, b], [b, c], [c, a]].map(|side| sector_within(side, normal, squared));
    sectors.iter().sum::<f64>().max(0.0)
}

/// The signed area of the part of the triangle between the origin and a segment that lies within a circle around the
/// origin, all in the plane with the given normal. `squared` is the square of the radius.
fn sector_within([a, b]: [Vec3; 2], normal: Vec3, squared: f64) -> f64 {
    let doubled = |p: Vec3, q: Vec3| dot(cross(p, q), normal);
    let sector = |p: Vec3, q: Vec3| 0.5 * squared * doubled(p, q).atan2(dot(p, q));
    // |a + t along|^2 = squared is a quadratic equation in t.
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
    // Up to where it enters and from where it leaves the circle, a sector; a triangle in between.
    let at = |t: f64| [0, 1, 2].map(|k| a[k] + t * along[k]);
    let (p, q) = (at(enters.max(0.0)), at(leaves.min(1.0)));
    sector(a, p) + 0.5 * doubled(p, q) + sector(q, b)
}

#[cfg(test)]
mod tests;
