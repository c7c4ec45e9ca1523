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
/// conformal distortion of a hundredth of the area is above `most`.
pub fn projection(chart: &Chart, most: f64) -> Option<Natural> {
    let triangles = || (0..chart.triangles().len()).map(|f| chart.corners(f));
    let origin = *chart.points().first()?;
    let plane = Plane::facing(origin, triangles())?;
    let steepness = |[a, b, c]: [Vec3; 3]| {
        let doubled = cross(sub(b, a), sub(c, a));
        let (area, projected) = (norm(doubled), dot(doubled, plane.normal()));
        Weighted { value: if projected > 0.0 { area / projected } else { f64::INFINITY }, weight: area }
    };
    let mut steepness: Vec<Weighted> = triangles().map(steepness).collect();
    let [p99] = quantiles(&mut steepness, [0.99]);
    if p99 > most {
        return None;
    }
    let mut uv: Vec<[f64; 2]> = chart.points().iter().map(|p| plane.place(*p)).collect();
    for (_, sides) in chart.edges().iter() {
        let [h, t] = [sides[0], sides[0].next()];
        let ends = [chart.from(h), chart.from(t)].map(|v| uv[v.index()]);
        uv.push([0, 1].map(|k| 0.5 * (ends[0][k] + ends[1][k])));
    }
    certified(chart, &uv)
}
