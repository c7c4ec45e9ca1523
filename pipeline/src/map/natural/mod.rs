//! Maps by straight triangles whose boundary keeps, more or less, the shape that it has in space.
//!
//! A disk makes every corner of a boundary a singularity, and stretches what is long: conformal distortions of 100 to
//! 6,000 on the flat sides of CAD parts, and a mesher loses parts of such charts. Two maps do without a disk:
//!
//! - [`projection()`]: along the mean of the normals, for what is nearly a plane;
//! - [`conformal()`]: least squares conformal (Levy, Petitjean, Ray and Maillot 2002, *Least squares conformal maps*, doi
//!   10.1145/566654.566590; the energy as in Mullen, Tong, Alliez and Desbrun 2008, doi 10.1111/j.1467-8659.2008.01289.x), with
//!   a free boundary: what can be unrolled without stretching is. On the four parts of each triangle: coarse needles fold
//!   without them.
//!
//! Where neither is, a map may be unfolded inside the boundary of one ([`unfolded_start()`]), or the boundary is freed from the
//! disk and the map brought near an isometry ([`freed_start()`]).
//!
//! Neither of the first two is one-to-one by construction. What the certifier does not prove is no [`Natural`].

mod boundary_first;
mod clearance;
mod conformal;
mod dense;
mod descent;
mod elements;
mod freed;
mod laplace;
mod placement;
mod projection;
mod start;
mod unfolded;
mod upright;

use crate::atlas::Chart;
use crate::certify::{PlanarMap, StraightMap, parts, prove_straight};
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::measure::distortion::{Summary, singular_ratio};
use crate::measure::quantiles::{Weighted, extreme_ratio, quantiles};
use crate::monitor::{Interrupted, Monitor};
pub use conformal::{conformal, conformal_by_corners, spectral_conformal};
pub use projection::projection;
pub use start::{NaturalStart, NoNatural, freed_start, natural_start, unfolded_start};
pub(crate) use start::{boundary_first_start, start_through};

/// Maps are scaled into a disk of this radius: well within what the grid holds exactly.
const RADIUS: f64 = 0.984375;

/// A map with a boundary of its own that is proven to be one-to-one. What comes out of [`projection()`], [`conformal()`]
/// and [`natural`].
#[derive(Clone, Debug)]
pub struct Natural {
    /// The map.
    pub map: StraightMap,
    /// How much it stretches.
    pub distortion: Summary,
}

/// Charts are projected where a hundredth of their area at most is steeper than this, as the length along a slope over
/// that of its projection (76 degrees). By experience: smaller leaves more charts on the disk, larger lets projections
/// shrink steep parts further.
const STEEP: f64 = 4.0;

/// From this conformal distortion on a chart is unrolled, if it can be. It takes as long as a map. By experience:
/// smaller takes that time for more charts, larger leaves more of them stretched.
const UNEVEN: f64 = 5.0;

/// Charts with more triangles are not unrolled: a system as large would need memory that nobody gave to the hand-off.
const UNROLLED: usize = 20_000;

/// The largest area ratio of a natural map: meshers cut off what is shrunk, as are steep walls of less than a hundredth
/// of the area where a chart is projected (pins_instanced, at 303: 38 elements below gamma 0.1).
pub(crate) const EVEN: f64 = 100.0;

/// A natural map that stretches `chart` less than `on_disk`, the conformal distortion that its map on
/// the disk does not exceed on 99 % of the area; none where there is none, or that is not found by reasonable means.
///
/// # Errors
/// [`Interrupted`].
///
/// # Example
///
/// A plate with holes is stretched by a disk, and not at all by its own plane.
///
/// ```
/// use planish_core::map::natural::natural;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{BoundaryShape, Settings, decompose, parametrize, shapes};
///
/// let settings = Settings { decompose: decompose::Settings::of(BoundaryShape::Circle), ..Settings::default() };
/// let plate = parametrize(&shapes::disk_with_holes(13, 2), &settings, &NoMonitor)?;
/// let on_disk = plate.charts()[0].distortion().conformal_p99;
/// let own = natural(plate.charts()[0].chart(), on_disk, &NoMonitor)?.expect("it is nearly flat");
/// assert!(own.distortion.conformal_p99 < on_disk);
/// // What the disk does not stretch either is left on it.
/// assert!(natural(plate.charts()[0].chart(), 1.0, &NoMonitor)?.is_none());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn natural(chart: &Chart, on_disk: f64, monitor: &dyn Monitor) -> Result<Option<Natural>, Interrupted> {
    let is_even = |n: &Natural| n.distortion.area_ratio < EVEN;
    // The projection first: it takes no system, and the shape of the boundary is kept as it is.
    if let Some(projected) = projection(chart, on_disk.min(STEEP)).filter(is_even) {
        return Ok(Some(projected));
    }
    if on_disk <= UNEVEN || chart.triangles().len() > UNROLLED {
        return Ok(None);
    }
    let unrolled = match conformal(chart, monitor) {
        Ok(unrolled) => unrolled,
        Err(sparse::Error::Interrupted(interrupted)) => return Err(interrupted),
        // There is the map on the disk.
        Err(sparse::Error::Unsolvable(_)) => None,
    };
    Ok(unrolled.filter(|n| n.distortion.conformal_p99 < on_disk && is_even(n)))
}

/// The map with the nodes of a chart at `uv` (its vertices, then the middles of its edges), scaled to fit and
/// rounded to the grid; none where it is not one-to-one.
fn certified(chart: &Chart, uv: &[[f64; 2]]) -> Option<Natural> {
    let nodes = fitted(uv)?.into_iter().map(GridPoint::mid).collect();
    let map = PlanarMap { cells: chart.cells().collect(), nodes, hole_centres: vec![] };
    let map = prove_straight(map).ok()?;
    let distortion = summary(chart, map.map());
    Some(Natural { map, distortion })
}

/// Places moved and scaled into a disk of [`RADIUS`] around the origin; none where they all are one, or not finite.
fn fitted(uv: &[[f64; 2]]) -> Option<Vec<[f64; 2]>> {
    let around = Around::of(uv);
    around.scaled(uv, RADIUS / around.half_diagonal())
}

/// Places of the vertices of `chart`, whose triangles have the area `in_plane` there: turned so that their `outline`, some of them,
/// lies straight, moved and scaled so that it lies in that disk, and so that lengths there and in space differ by a power of
/// two, on the mean; none where they all are one, or not finite, or the triangles have no area.
fn fitted_to_size(
    chart: &Chart,
    in_plane: f64,
    mut outline: Vec<[f64; 2]>,
    mut uv: Vec<[f64; 2]>,
) -> Option<Vec<[f64; 2]>> {
    let in_space = chart.shapes().iter().map(|s| s.area()).sum::<f64>();
    let to_size = (in_space / in_plane).sqrt();
    if let Some(longer) = upright::longer_side(&outline) {
        upright::turn(&mut outline, longer);
        upright::turn(&mut uv, longer);
    }
    let around = Around::of(&outline);
    // The unit of the shapes is a power of two times that of the input.
    let halvings = (to_size * around.half_diagonal() / RADIUS).log2().ceil();
    around.scaled(&uv, to_size * (-halvings).exp2())
}

/// The box around places.
struct Around {
    min: [f64; 2],
    max: [f64; 2],
}

impl Around {
    fn of(uv: &[[f64; 2]]) -> Self {
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in uv {
            for k in 0..2 {
                min[k] = min[k].min(p[k]);
                max[k] = max[k].max(p[k]);
            }
        }
        Self { min, max }
    }

    fn half_diagonal(&self) -> f64 {
        0.5 * (self.max[0] - self.min[0]).hypot(self.max[1] - self.min[1])
    }

    /// Places moved to the origin and scaled; none where the scale is no number (infinite where all places are one, zero
    /// where one of them is infinite).
    fn scaled(&self, uv: &[[f64; 2]], scale: f64) -> Option<Vec<[f64; 2]>> {
        if !scale.is_finite() || scale <= 0.0 {
            return None;
        }
        let moved = |p: &[f64; 2]| [0, 1].map(|k| (p[k] - 0.5 * (self.min[k] + self.max[k])) * scale);
        Some(uv.iter().map(moved).collect())
    }
}

/// How much the parts of a chart's triangles are stretched. The area ratio is that of parts, not of stars.
fn summary(chart: &Chart, map: &PlanarMap) -> Summary {
    let (mut conformal, mut scales) = (Vec::new(), Vec::new());
    for (shape, cell) in chart.shapes().iter().zip(&map.cells) {
        let uv = cell.map(|n| map.nodes[n as usize].uv());
        let [a, b, c] = shape.in_plane();
        let flat = [a, b, c, middle(a, b), middle(b, c), middle(c, a)];
        let area_of_part = 0.25 * shape.area();
        for (from, to) in parts(flat).into_iter().zip(parts(uv)) {
            let stretch = Stretch::between(from, to);
            conformal.push(Weighted { value: stretch.conformal, weight: area_of_part });
            scales.push(Weighted { value: stretch.area, weight: area_of_part });
        }
    }
    let [conformal_median, conformal_p99] = quantiles(&mut conformal, [0.5, 0.99]);
    Summary { conformal_median, conformal_p99, area_ratio: extreme_ratio(&mut scales).clamp(1.0, f64::MAX) }
}

fn middle(p: [f64; 2], q: [f64; 2]) -> [f64; 2] {
    [0, 1].map(|k| 0.5 * (p[k] + q[k]))
}

/// How the linear map from one triangle of the plane to another stretches.
struct Stretch {
    /// The ratio of its singular values, at least 1.
    conformal: f64,
    /// The ratio of areas.
    area: f64,
}

impl Stretch {
    fn between(from: [[f64; 2]; 3], to: [[f64; 2]; 3]) -> Self {
        let [p, q] = sides_at_first(from);
        let [u, v] = sides_at_first(to);
        let doubled_area = p[0] * q[1] - p[1] * q[0];
        // The columns of the matrix that carries p to u and q to v: [u v] times the inverse of [p q].
        let x = [0, 1].map(|k| (u[k] * q[1] - v[k] * p[1]) / doubled_area);
        let y = [0, 1].map(|k| (v[k] * p[0] - u[k] * q[0]) / doubled_area);
        let det = x[0] * y[1] - x[1] * y[0];
        // No number comes out for a triangle without area: it counts as the worst.
        let conformal = bounded(singular_ratio(x, y, det));
        Self { conformal: conformal.max(1.0), area: bounded(det) }
    }
}

/// The sides of a triangle from its first corner.
fn sides_at_first([a, b, c]: [[f64; 2]; 3]) -> [[f64; 2]; 2] {
    [b, c].map(|p| [p[0] - a[0], p[1] - a[1]])
}

/// A quantity that is finite and positive but for rounding; the largest double where it is not.
fn bounded(x: f64) -> f64 {
    if x.is_finite() && x > 0.0 { x } else { f64::MAX }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::vec3::Vec3;
    use crate::{decompose, repair, shapes};

    fn charts(soup: &TriangleSoup) -> Vec<Chart> {
        let mesh = repair(soup, &Default::default()).expect("repairs").mesh;
        let no_features = decompose::Settings { feature_angle: None, ..Default::default() };
        decompose(&mesh, &no_features, &NoMonitor).expect("decomposes").into_charts()
    }

    fn moved(soup: &TriangleSoup, to: impl Fn(Vec3) -> Vec3) -> TriangleSoup {
        let points = soup.points().iter().map(|p| to(*p)).collect();
        TriangleSoup::new(points, soup.triangles().to_vec()).expect("sound")
    }

    #[test]
    fn a_plate_with_holes_is_projected_as_it_is_and_a_dome_as_far_as_it_is_flat() {
        let flat = moved(&shapes::disk_with_holes(13, 2), |[x, y, _]| [5.0 + 0.6 * x, y, -0.8 * x]);
        let plate = charts(&flat);
        let of_plate = projection(&plate[0], 1.1).expect("it is flat").distortion;
        assert!(
            (of_plate.conformal_p99 - 1.0).abs() < 1e-9 && (of_plate.area_ratio - 1.0).abs() < 1e-9,
            "{of_plate:?}"
        );
        let dome = charts(&shapes::disk(8));
        let steep = projection(&dome[0], 4.0).expect("hardly bent").distortion.conformal_p99;
        assert!(steep > 1.05, "{steep}");
        assert!(projection(&dome[0], 0.99 * steep).is_none(), "the bound holds");
    }

    #[test]
    fn a_bent_strip_is_unrolled_and_not_projected() {
        // A rectangle, 8 by 1, rolled over three quarters of a turn.
        let (n, m) = (32, 4);
        let at = |i: u32, j: u32| i * (m + 1) + j;
        let point = |k: u32| {
            let turn = 1.5 * std::f64::consts::PI * f64::from(k / (m + 1)) / f64::from(n);
            let radius = 8.0 / (1.5 * std::f64::consts::PI);
            [radius * turn.cos(), radius * turn.sin(), f64::from(k % (m + 1)) / f64::from(m)]
        };
        let points = (0..(n + 1) * (m + 1)).map(point).collect();
        let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
        let halves = |(i, j): (u32, u32)| {
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        };
        let soup = TriangleSoup::new(points, quads.flat_map(halves).collect()).expect("sound");
        let strip = charts(&soup);
        assert!(projection(&strip[0], f64::MAX).is_none(), "it turns back");
        let unrolled = conformal(&strip[0], &NoMonitor).expect("unrolled").expect("one-to-one").distortion;
        assert!((unrolled.conformal_p99 - 1.0).abs() < 1e-6 && unrolled.area_ratio < 1.0 + 1e-6, "{unrolled:?}");
    }

    #[test]
    fn what_covers_itself_when_unrolled_is_no_map() {
        // A ramp of two turns: flat, it lies on itself.
        let ramp = charts(&shapes::ramp(32, 64));
        assert_eq!(ramp.len(), 1);
        assert!(projection(&ramp[0], f64::MAX).is_none());
        assert!(conformal(&ramp[0], &NoMonitor).expect("solved").is_none());
    }

    #[test]
    fn a_hemisphere_is_mapped_conformally() {
        let halves = charts(&shapes::sphere(12));
        let of = conformal(&halves[0], &NoMonitor).expect("solved").expect("one-to-one").distortion;
        assert!(of.conformal_p99 < 1.6, "{of:?}");
    }
}
