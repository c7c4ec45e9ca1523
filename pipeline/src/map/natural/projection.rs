//! The orthogonal projection of a chart.
//!
//! Where all normals lie within an angle a of one direction, the projection along it turns every triangle left, and no
//! conformal distortion is above 1 / cos a.

use super::{Natural, certified};
use crate::atlas::Chart;
use crate::evaluate::Plane;
use crate::measure::quantiles::{Weighted, quantiles};
use crate::vec3::{Vec3, cross, dot, norm, sub};

/// The projection of `chart` along the mean of its normals; none where that is not one-to-one, or the
/// conformal distortion of a hundredth of the area is above `most` (at least 1).
///
/// # Example
///
/// A plane, tilted or not, is projected as it is; a hill only if enough stretching is allowed.
///
/// ```
/// use planish_core::map::natural::projection;
/// use planish_core::{decompose, repair, shapes};
///
/// let one_chart = |soup| {
///     let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
///     decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0)
/// };
/// let plane = projection(&one_chart(shapes::flat_disk(3)), 1.01).expect("flat");
/// assert!((plane.distortion.conformal_p99 - 1.0).abs() < 1e-12);
/// let hill = one_chart(shapes::disk(6));
/// assert!(projection(&hill, 1.01).is_none());
/// assert!(projection(&hill, 1.5).expect("not so steep").distortion.conformal_p99 < 1.5);
/// ```
pub fn projection(chart: &Chart, most: f64) -> Option<Natural> {
    // Vertices, then the middles of edges. A projection is linear: the middle goes to the middle.
    let mut uv = projected(chart, most)?;
    for (_, sides) in chart.edges().iter() {
        let side = sides[0];
        let [from, to] = [chart.from(side), chart.from(side.next())].map(|v| uv[v.index()]);
        uv.push([0, 1].map(|k| 0.5 * (from[k] + to[k])));
    }
    certified(chart, &uv)
}

/// The uv of the vertices of `chart`, projected along the mean of its normals; none where the conformal distortion of a
/// hundredth of the area is above `most`.
pub(super) fn projected(chart: &Chart, most: f64) -> Option<Vec<[f64; 2]>> {
    let triangles = || (0..chart.triangles().len()).map(|f| chart.corners(f));
    let origin = *chart.points().first()?;
    let plane = Plane::facing(origin, triangles())?;
    let mut steepness: Vec<Weighted> = triangles().map(|t| steepness(t, plane.normal())).collect();
    let [p99] = quantiles(&mut steepness, [0.99]);
    (p99 <= most).then(|| chart.points().iter().map(|p| plane.coords(*p)).collect())
}

/// The area of a triangle over that of its projection along `normal`, which is the conformal distortion of that;
/// without bound where it turns right. The weight is twice the area.
fn steepness([a, b, c]: [Vec3; 3], normal: Vec3) -> Weighted {
    let doubled = cross(sub(b, a), sub(c, a));
    let area = norm(doubled);
    let projected = dot(doubled, normal);
    let value = if projected > 0.0 { area / projected } else { f64::INFINITY };
    Weighted { value, weight: area }
}
