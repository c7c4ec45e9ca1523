//! How sharply a surface bends, for size fields: its curvature where it is smooth, and that of the curves that are its edges.
//!
//! Where charts meet at a sharp angle the surface has a crease: it bends there, and has no curvature. Seams elsewhere run anyhow,
//! and what lies on both sides is one. Open boundary and creases are curves of the shape, which bend themselves.

use super::curvature::{largest, unit_normal};
use crate::atlas::Chart;
use crate::mesh::SurfaceMesh;
use crate::seams::{Curve, CurveSide, SeamNetwork};
use crate::topology::HalfEdgeId;
use crate::vec3::{Vec3, cross, distance, dot, norm, sub};

/// Seams at which charts meet at more than this angle, in degrees, are creases. As the lower threshold of features.
const CREASE: f64 = 25.0;

/// Where a curve turns by more than this, in degrees, it has a corner, and no curvature.
const CORNER: f64 = 40.0;

/// Per segment of a curve, the cosine of the angle at which its two charts meet there, which is no number where a triangle has
/// no area; none where there are not two charts.
pub fn dihedral_cosines<C: AsRef<Chart>>(charts: &[C], curve: &Curve) -> Option<Vec<f64>> {
    let [first, second] = curve.sides() else { return None };
    // On an oriented surface the charts beside a curve pass it in opposite directions.
    let sign = if first.forward == second.forward { -1.0 } else { 1.0 };
    let normal = |side: &CurveSide, h: HalfEdgeId| {
        let [a, b, c] = charts[side.chart.index()].as_ref().corners(h.face().index());
        cross(sub(b, a), sub(c, a))
    };
    let cosine = |(g, h): (&HalfEdgeId, &HalfEdgeId)| {
        let normals = [normal(first, *g), normal(second, *h)];
        sign * dot(normals[0], normals[1]) / (norm(normals[0]) * norm(normals[1]))
    };
    Some(first.half_edges.iter().zip(&second.half_edges).map(cosine).collect())
}

/// The largest curvature at each vertex of `mesh`, by magnitude, in the inverse unit of the input: that of the surface beside
/// creases, and of the creases and ends of the surface themselves. `charts` are those of an atlas of `mesh`, `seams` their curves.
///
/// ```
/// use planish_core::decompose::assemble;
/// use planish_core::measure::bends::bends;
/// use planish_core::seams::SeamNetwork;
/// use planish_core::{repair, shapes};
///
/// // A flat disk of radius 1 bends nowhere, but at its rim.
/// let mesh = repair(&shapes::flat_disk(8), &repair::Settings::default())?.mesh;
/// let atlas = assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let seams = SeamNetwork::new(&mesh, atlas.charts(), 0.0);
/// for (bend, [x, y, _]) in bends(&mesh, atlas.charts(), &seams).iter().zip(mesh.points()) {
///     let expected = if x.hypot(*y) > 0.99 { 1.0 } else { 0.0 };
///     assert!((bend - expected).abs() < 0.01);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn bends<C: AsRef<Chart>>(mesh: &SurfaceMesh, charts: &[C], seams: &SeamNetwork) -> Vec<f64> {
    let sharp = CREASE.to_radians().cos();
    let mut chart_of = vec![0; mesh.triangles().len()];
    for chart in charts.iter().map(AsRef::as_ref) {
        chart.faces().iter().for_each(|face| chart_of[face.index()] = chart.id().0);
    }
    let normals: Vec<Vec3> = (0..mesh.triangles().len()).map(|face| unit_normal(mesh.corners(face))).collect();
    let is_crease = |g: HalfEdgeId, h: HalfEdgeId| {
        let [g, h] = [g, h].map(|h| h.face().index());
        chart_of[g] != chart_of[h] && dot(normals[g], normals[h]) < sharp
    };
    let mut bends = largest(mesh, is_crease);
    for curve in seams.curves() {
        // As creases do, what has no angle counts as sharp.
        let smooth = |cosines: &Vec<f64>| cosines.iter().filter(|cosine| **cosine >= sharp).count();
        let is_edge = dihedral_cosines(charts, curve).is_none_or(|cosines| 2 * smooth(&cosines) <= cosines.len());
        if is_edge {
            add_bends_of(mesh, curve, &mut bends);
        }
    }
    bends
}

/// Adds the curvature of a curve at its vertices.
fn add_bends_of(mesh: &SurfaceMesh, curve: &Curve, bends: &mut [f64]) {
    let vertices = curve.vertices();
    // A closed curve goes on where it began.
    let around = curve.is_closed().then_some([vertices[vertices.len() - 2], vertices[0], vertices[1]]);
    let triples = vertices.windows(3).map(|w| [w[0], w[1], w[2]]);
    for triple in triples.chain(around) {
        let bend = &mut bends[triple[1].index()];
        *bend = bend.max(bend_of(triple.map(|v| mesh.points()[v.index()])));
    }
}

/// The curvature of a polyline at its middle point: the angle by which it turns, over the mean length of its segments; 0 at
/// a corner.
fn bend_of([p, q, r]: [Vec3; 3]) -> f64 {
    let [along, on] = [sub(q, p), sub(r, q)];
    let angle = norm(cross(along, on)).atan2(dot(along, on));
    let length = 0.5 * (distance(p, q) + distance(q, r));
    if angle < CORNER.to_radians() && length > 0.0 { angle / length } else { 0.0 }
}
