//! Feature edges: where the surface has a crease, so that a seam belongs there.
//!
//! An edge may be a feature where its dihedral angle exceeds a threshold, and joins others down to a lower one
//! (hysteresis). Noise makes such edges, too: slivers have any normal. So the angle is measured again between the mean
//! normals of the triangles around, weighted by area, on either side: sides that meet around the ends of the edge
//! within a few triangles are the same side. Chains that are short all told are dropped, and patches that are small
//! all round, or narrow bevels, are given to the neighbour with which they share most, but for those that are flat between
//! sharp features, and chains around these: noise makes none of them. What separates nothing then is no feature. Where
//! coordinates lie in coarse steps ([`crate::mesh::SurfaceMesh::coarse_steps`]) the angles are those that rounding leaves
//! sure: the stairs that it makes of a slope are no features.

use super::Settings;
use super::dual::Dual;
use crate::mesh::SurfaceMesh;
use crate::monitor::{Interrupted, Monitor};
use crate::topology::partition::Partition;
use crate::topology::union_find::UnionFind;
use crate::topology::{FaceId, HalfEdgeId};
use crate::vec3::{Vec3, dot, norm};

/// The lower threshold, as a share of the upper one: 25 of 40 degrees. A crease that is less sharp in places stays whole. By
/// experience: higher leaves gaps in creases, lower joins noise to them.
const LOWER: f64 = 0.625;

/// The triangles that make up a side of an edge, by experience: fewer follow the normals of single slivers, more reach
/// around narrow faces to what lies behind them.
const SIDE: usize = 12;

/// The least length of connected features, as a share of the size of the surface (the square root of its area). By
/// experience: smaller takes noise for creases, larger overlooks short ones.
const MIN_LENGTH: f64 = 0.06;

/// The least outline of a patch between features, likewise, weighed by the sharpness of the features: 1 minus the cosine
/// of the dihedral angle, at most 1. A bolt hole is a patch, a dent in a scan that is as small is none.
const MIN_OUTLINE: f64 = 0.12;

/// What is between features and has a weighed outline below this is no face of its own, unless it is flat.
pub(super) fn min_outline(dual: &Dual) -> f64 {
    MIN_OUTLINE * dual.total_area().sqrt()
}

/// A patch that is narrower than this, likewise, is a bevel, and no face, if the features around it are blunt on average:
/// what follows would have to resolve it. By experience: in the tests a bevel of 0.14 is a face and one of 0.003 is none.
const MIN_WIDTH: f64 = 0.005;

/// Below this sharpness features are blunt: 60 degrees. A bevel turns a right angle into two of 45 degrees, while the edges
/// of a groove or of a thin wall, at 90, are not blunt.
const BLUNT: f64 = 0.5;

/// A patch is flat if its area vectors add up to its area but for this share: if its triangles lean by less than about 1e-4
/// radians. On menger_sponge3, coordinates of seven digits leave a thousandth of that.
const FLAT: f64 = 1e-8;

/// Faces that are kept however small they are have features around them that are that sharp on average: 66 degrees. Of
/// foot_bones, scanned bones of 160 triangles, eight facets of two to four triangles became charts with [`BLUNT`].
const SHARP: f64 = 0.6;

/// And at least this area for the square of their outline: they are no longer than twenty times their width. Of
/// cad_rear_case, wedges of four triangles, 100 times as long, became charts otherwise, with elements below gamma 0.1 in
/// their tips.
const COMPACT: f64 = 0.01;

/// The dual graph of a surface with its feature edges marked, and their number.
pub(super) fn with_features<'a>(
    mesh: &'a SurfaceMesh,
    settings: &Settings,
    monitor: &'a dyn Monitor,
) -> Result<(Dual<'a>, usize), Interrupted> {
    let mut dual = Dual::new(mesh, monitor);
    dual.checkpoint()?;
    let count = match settings.feature_angle {
        Some(angle) => mark_features(&mut dual, angle)?,
        None => 0,
    };
    Ok((dual, count))
}

/// The edges at which a surface is not smooth, for programs that round off all others: its features, as far as they are above a
/// dihedral angle of `angle` degrees, and sharp creases that are closed or join these. Each by the lesser of its half-edges,
/// ascending.
///
/// Noise makes creases, too, and ridges along them make bad elements (mmgs on max_planck: 60 below gamma 0.1 with all creases,
/// 18 with these). Edges of 35 degrees along tubes that join features at their ends do so, too (thingi_1514499_needles: 3,000).
///
/// ```
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// // A tube of 24 facets is smooth, one of 6 has a crease between each two.
/// let ridges = |around: u32| {
///     let mesh = repair(&shapes::tube(around, 4, 2.0), &Default::default())?.mesh;
///     Ok::<_, Box<dyn std::error::Error>>(decompose::ridges(&mesh, 40.0, &NoMonitor)?.len())
/// };
/// assert_eq!((ridges(24)?, ridges(6)?), (0, 6 * 4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Interrupted`].
pub fn ridges(mesh: &SurfaceMesh, angle: f64, monitor: &dyn Monitor) -> Result<Vec<HalfEdgeId>, Interrupted> {
    let mut dual = Dual::new(mesh, monitor);
    let sharp = angle.to_radians().cos();
    let creases = creases(&dual, sharp);
    mark_features(&mut dual, angle)?;
    let is_sharp = |h: HalfEdgeId, twin: HalfEdgeId| {
        is_bent(dual.area_vector(h.face().index()), dual.area_vector(twin.face().index()), sharp)
    };
    let mut ridges: Vec<HalfEdgeId> = Vec::new();
    for h in dual.half_edges().filter(|h| dual.is_feature(*h)) {
        ridges.extend(dual.twin(h).filter(|twin| h < *twin && is_sharp(h, *twin)).map(|_| h));
    }
    ridges.extend(continuing(&dual, &ridges, &creases));
    ridges.sort_unstable();
    Ok(ridges)
}

/// Chains of creases above [`SHARP`] that are closed, or end on features: around what is too small for a chart, a rib or a slot.
/// Those of noise run out, or branch.
fn continuing(dual: &Dual, features: &[HalfEdgeId], creases: &[Crease]) -> Vec<HalfEdgeId> {
    let ends = |h: HalfEdgeId| [dual.from(h), dual.to(h)];
    let mut of_features = vec![0_u32; dual.mesh.points().len()];
    features.iter().flat_map(|h| ends(*h)).for_each(|v| of_features[v] += 1);
    let others = creases.iter().filter(|crease| crease.sharpness > SHARP).map(|crease| crease.edge);
    let others: Vec<HalfEdgeId> = others.filter(|h| features.binary_search(h).is_err()).collect();
    let mut of_others = vec![0_u32; of_features.len()];
    others.iter().flat_map(|h| ends(*h)).for_each(|v| of_others[v] += 1);
    let mut chains = UnionFind::new(of_features.len());
    others.iter().for_each(|h| {
        chains.merge(dual.from(*h), dual.to(*h));
    });
    let mut runs_out = vec![false; of_features.len()];
    for v in (0..of_features.len()).filter(|v| of_others[*v] > 0) {
        let goes_on = of_others[v] == 2 || of_features[v] > 0;
        runs_out[chains.find(v)] |= !goes_on;
    }
    others.into_iter().filter(|h| !runs_out[chains.find(dual.from(*h))]).collect()
}

/// An edge that may be a feature.
struct Crease {
    /// The lesser one of its half-edges.
    edge: HalfEdgeId,
    /// 1 minus the cosine of the dihedral angle, at most 1.
    sharpness: f64,
}

/// Marks the feature edges of `dual`: dihedral angle above `angle` degrees. Returns their number.
fn mark_features(dual: &mut Dual, angle: f64) -> Result<usize, Interrupted> {
    let cos = |degrees: f64| degrees.to_radians().cos();
    let (sharp, blunt) = (cos(angle), cos(LOWER * angle));
    let creases = creases(dual, blunt);
    creases.iter().for_each(|crease| dual.set_sharpness(crease.edge, crease.sharpness));
    let is_around_face = around_flat_faces(dual, &creases);
    let (creases, short) = long_enough(dual, creases, &is_around_face, 1.0 - sharp);
    short.iter().for_each(|crease| dual.set_sharpness(crease.edge, 0.0));
    let features: Vec<HalfEdgeId> = creases.into_iter().map(|crease| crease.edge).collect();
    // Every time some patches are united with others, so that fewer are left.
    dual.checkpoint()?;
    while drop_small_patches(dual, &features) {
        dual.checkpoint()?;
    }
    let (patch_of, count) = patches(dual);
    drop_dangling(dual, &features, &patch_of);
    let of_patches = measured(dual, &patch_of, count);
    dual.is_kept = patch_of.iter().map(|patch| of_patches[*patch as usize].is_flat_face()).collect();
    Ok(dual.sharpness.iter().filter(|s| **s > 0.0).count())
}

/// The edges whose dihedral angle has a cosine below `blunt`, both between their two triangles and between the mean normals
/// of those around.
fn creases(dual: &Dual, blunt: f64) -> Vec<Crease> {
    let normals: Vec<Vec3> = (0..dual.mesh.triangles().len()).map(|f| dual.area_vector(f)).collect();
    let normal = |h: HalfEdgeId| normals[h.face().index()];
    let mut candidates: Vec<[HalfEdgeId; 2]> = Vec::new();
    let mut is_candidate = vec![false; dual.mesh.edges().len()];
    for h in dual.half_edges() {
        let Some(twin) = dual.twin(h).filter(|twin| h < *twin) else { continue };
        if is_bent(normal(h), normal(twin), blunt) {
            candidates.push([h, twin]);
            is_candidate[dual.mesh.edges().edge(h).index()] = true;
        }
    }
    let error = position_error(dual);
    let crease = |half_edges: [HalfEdgeId; 2]| {
        let sides = half_edges.map(|h| side(dual, &is_candidate, h));
        let sharpness = sharpness_between(dual, &sides, &normals, error);
        Crease { edge: half_edges[0], sharpness: sharpness.min(1.0) }
    };
    let measured = candidates.into_iter().map(crease);
    measured.filter(|crease| crease.sharpness > 1.0 - blunt).collect()
}

/// 1 minus the cosine of the angle between the mean normals of two sides of an edge, or of what is sure of it where vertices
/// may be off by `error`.
fn sharpness_between(dual: &Dual, sides: &[Vec<FaceId>; 2], normals: &[Vec3], error: f64) -> f64 {
    let [m, n] = [0, 1].map(|k| sum_of(normals, &sides[k]));
    let cos = dot(m, n) / (norm(m) * norm(n));
    if error == 0.0 {
        return 1.0 - cos;
    }
    let doubt = doubt(dual, &sides[0], m, error) + doubt(dual, &sides[1], n, error);
    let angle = cos.clamp(-1.0, 1.0).acos();
    1.0 - (angle - doubt).max(0.0).cos()
}

/// Unites each patch that is too small to be a face with the neighbour with which it shares most: the features between
/// them are none. Whether there was such a patch.
fn drop_small_patches(dual: &mut Dual, features: &[HalfEdgeId]) -> bool {
    let (patch_of, count) = patches(dual);
    let patch = |h: HalfEdgeId| patch_of[h.face().index()] as usize;
    let small = small_patches(dual, &patch_of, count);
    // Each feature, seen from either of its sides that is small.
    let mut borders: Vec<Border> = Vec::new();
    for h in features.iter().flat_map(|h| [Some(*h), dual.twin(*h)]).flatten() {
        let Some(twin) = dual.twin(h) else { continue };
        let border = Border { patch: patch(h), neighbour: patch(twin), length: dual.length(h) };
        if border.patch != border.neighbour && small[border.patch] {
            borders.push(border);
        }
    }
    // By lengths, too, so that sums do not depend on the numbering of the edges.
    borders.sort_unstable_by(|x, y| {
        let pairs = (x.patch, x.neighbour).cmp(&(y.patch, y.neighbour));
        pairs.then(x.length.total_cmp(&y.length))
    });
    let mut united = UnionFind::new(count);
    for of_patch in borders.chunk_by(|x, y| x.patch == y.patch) {
        united.merge(of_patch[0].patch, nearest_neighbour(of_patch));
    }
    for h in features {
        let Some(t) = dual.twin(*h).filter(|t| patch(*t) != patch(*h)) else { continue };
        if united.find(patch(t)) == united.find(patch(*h)) {
            dual.set_sharpness(*h, 0.0);
        }
    }
    !borders.is_empty()
}

/// A feature edge between a small patch and another one.
#[derive(Clone, Copy)]
struct Border {
    patch: usize,
    neighbour: usize,
    length: f64,
}

/// The neighbour with which a patch shares most, out of its borders, sorted by neighbours; of those that share as much, the
/// first one.
fn nearest_neighbour(borders: &[Border]) -> usize {
    let mut nearest = borders[0].neighbour;
    let mut most = f64::NEG_INFINITY;
    for shared in borders.chunk_by(|x, y| x.neighbour == y.neighbour) {
        let length: f64 = shared.iter().map(|border| border.length).sum();
        if length > most {
            (nearest, most) = (shared[0].neighbour, length);
        }
    }
    nearest
}

/// Per patch, whether its outline, weighed by its sharpness, is too short for a face, or whether it is a bevel.
fn small_patches(dual: &Dual, patch_of: &[u32], count: usize) -> Vec<bool> {
    let (least, width) = (min_outline(dual), MIN_WIDTH * dual.total_area().sqrt());
    let is_small = |p: &Patch| p.is_bevel(width) || (p.weighed < least && !p.is_flat_face());
    measured(dual, patch_of, count).iter().map(is_small).collect()
}

/// The patches between features.
fn measured(dual: &Dual, patch_of: &[u32], count: usize) -> Vec<Patch> {
    let mut all = vec![Patch::default(); count];
    for (f, patch) in patch_of.iter().enumerate() {
        let patch = &mut all[*patch as usize];
        patch.triangles += 1;
        patch.area += dual.area(f);
        let area_vector = dual.area_vector(f);
        patch.normal = [0, 1, 2].map(|k| patch.normal[k] + area_vector[k]);
    }
    let patches = Partition::new(dual, patch_of);
    for h in patches.boundary() {
        let patch = &mut all[patches.label(h) as usize];
        // Where the surface ends, the outline counts in full.
        let sharpness = if patches.is_seam(h) { dual.sharpness(h) } else { 1.0 };
        patch.outline += dual.length(h);
        patch.weighed += sharpness * dual.length(h);
    }
    all
}

/// What lies between features.
#[derive(Clone, Copy, Default)]
struct Patch {
    triangles: usize,
    area: f64,
    /// The sum of the area vectors, which are twice as long as areas are large.
    normal: Vec3,
    outline: f64,
    /// The outline, weighed by its sharpness.
    weighed: f64,
}

impl Patch {
    /// Whether it is narrower than `width`, and blunt all round.
    fn is_bevel(&self, width: f64) -> bool {
        // A long strip of width w and length l has the area w l and an outline of about 2 l.
        2.0 * self.area < width * self.outline && self.is_blunt()
    }

    /// Whether it is a face however small it is: noise makes no flat ones. Any triangle is flat, so it takes two.
    fn is_flat_face(&self) -> bool {
        let is_flat = self.triangles > 1 && norm(self.normal) >= (1.0 - FLAT) * 2.0 * self.area;
        let is_sharp = self.weighed > SHARP * self.outline;
        is_flat && is_sharp && self.area >= COMPACT * self.outline * self.outline
    }

    fn is_blunt(&self) -> bool {
        self.weighed < BLUNT * self.outline
    }
}

/// Features that separate nothing are none: a crease that runs out, or noise. The patches stay the same.
fn drop_dangling(dual: &mut Dual, features: &[HalfEdgeId], patch_of: &[u32]) {
    for h in features {
        if dual.twin(*h).is_some_and(|t| patch_of[t.face().index()] == patch_of[h.face().index()]) {
            dual.set_sharpness(*h, 0.0);
        }
    }
}

/// Per triangle the patch between features to which it belongs, and their number.
fn patches(dual: &Dual) -> (Vec<u32>, usize) {
    dual.united(|h, _| !dual.is_feature(h)).labels()
}

/// Whether two normals (of any length) differ by more than the angle with this cosine.
fn is_bent(m: Vec3, n: Vec3, cos: f64) -> bool {
    dot(m, n) < cos * norm(m) * norm(n)
}

/// How far off a vertex may be, where coordinates lie in coarse steps: half a step along every axis. In the unit of `dual`.
fn position_error(dual: &Dual) -> f64 {
    dual.mesh.coarse_steps().map_or(0.0, |steps| 0.5 * norm(steps.step) * dual.mesh.metric().scale)
}

/// By how much, in radians, the direction of the area vector of some triangles may be off where their vertices are. The
/// area vector is half the sum of p x dp around their outline: it changes by at most half the error times the outline.
fn doubt(dual: &Dual, faces: &[FaceId], area_vector: Vec3, error: f64) -> f64 {
    let sides = faces.iter().flat_map(|f| [0, 1, 2].map(|k| HalfEdgeId::side_of(*f, k)));
    let is_outer = |h: &HalfEdgeId| dual.twin(*h).is_none_or(|t| !faces.contains(&t.face()));
    let outline: f64 = sides.filter(is_outer).map(|h| dual.length(h)).sum();
    (0.5 * error * outline / norm(area_vector)).min(1.0).asin()
}

/// The triangles on the side of `h`: its own and the next few that can be reached without crossing a candidate.
fn side(dual: &Dual, candidate: &[bool], h: HalfEdgeId) -> Vec<FaceId> {
    let mut faces = vec![h.face()];
    let mut next = 0;
    while next < faces.len() && faces.len() < SIDE {
        let face = faces[next];
        next += 1;
        for e in (0..3).map(|k| HalfEdgeId::side_of(face, k)) {
            let Some(t) = dual.twin(e).filter(|_| !candidate[dual.mesh.edges().edge(e).index()]) else { continue };
            if !faces.contains(&t.face()) {
                faces.push(t.face());
            }
        }
    }
    faces
}

/// The sum of the area vectors of some triangles.
fn sum_of(normals: &[Vec3], faces: &[FaceId]) -> Vec3 {
    faces.iter().fold([0.0; 3], |sum, f| [0, 1, 2].map(|k| sum[k] + normals[f.index()][k]))
}

/// Per crease, all of which are marked, whether it goes around a flat face ([`Patch::is_flat_face`]).
fn around_flat_faces(dual: &Dual, creases: &[Crease]) -> Vec<bool> {
    let (patch_of, count) = patches(dual);
    let is_flat_face: Vec<bool> = measured(dual, &patch_of, count).iter().map(Patch::is_flat_face).collect();
    let is_of_face = |h: HalfEdgeId| is_flat_face[patch_of[h.face().index()] as usize];
    creases.iter().map(|c| is_of_face(c.edge) || dual.twin(c.edge).is_some_and(is_of_face)).collect()
}

/// Those of the creases whose connected ones above the sharpness `strong` are long enough together, or some of which go around flat
/// faces, and the others. (A plate with 6,000 square holes has holes whose edges are 4 % of its size.)
fn long_enough(dual: &Dual, creases: Vec<Crease>, is_around_face: &[bool], strong: f64) -> (Vec<Crease>, Vec<Crease>) {
    let mut chains = UnionFind::new(dual.mesh.points().len());
    for crease in &creases {
        chains.merge(dual.from(crease.edge), dual.to(crease.edge));
    }
    let mut lengths = vec![0.0; dual.mesh.points().len()];
    for (crease, is_around_face) in creases.iter().zip(is_around_face).filter(|(crease, _)| crease.sharpness > strong) {
        let length = if *is_around_face { f64::INFINITY } else { dual.length(crease.edge) };
        lengths[chains.find(dual.from(crease.edge))] += length;
    }
    let min_length = MIN_LENGTH * dual.total_area().sqrt();
    creases.into_iter().partition(|crease| lengths[chains.find(dual.from(crease.edge))] >= min_length)
}
