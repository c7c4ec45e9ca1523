//! The scale of a map: by how much the plane must grow for a chart to have its own size there.
//!
//! Certified uv lie in [-1, 1]² on a grid, whatever the size of the surface. Times a power of two they are as large as the
//! chart, and not a bit of them is rounded.

use crate::atlas::Chart;
use crate::certify::PlanarMap;

/// The largest exponent: 2^-53, the step of the grid, times 2^-960 is still a normal number.
const LARGEST: f64 = 960.0;

/// The power of two next to the root of the area of a chart in space (mollified, in the unit of the input, squared) over
/// that of the corners of its triangles in the plane: times it, the map has the area of the chart within a factor of two.
/// Natural maps are made so that it has that area up to rounding.
///
/// ```
/// use planish_core::measure::scale::uv_scale;
/// use planish_core::mesh::TriangleSoup;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{Settings, parametrize, shapes};
///
/// let scale_of = |soup: &TriangleSoup| {
///     let atlas = parametrize(soup, &Settings::default(), &NoMonitor).expect("an atlas");
///     let certified = &atlas.charts()[0];
///     uv_scale(certified.chart(), certified.map().map())
/// };
/// let small = shapes::disk(6);
/// let points = small.points().iter().map(|p| p.map(|x| 64.0 * x)).collect();
/// let large = TriangleSoup::new(points, small.triangles().to_vec()).expect("a soup");
/// assert_eq!(scale_of(&small).log2().fract(), 0.0, "a power of two");
/// // The same in another unit has the same uv, and another scale.
/// assert_eq!(scale_of(&large), 64.0 * scale_of(&small));
/// ```
pub fn uv_scale(chart: &Chart, map: &PlanarMap) -> f64 {
    // In the unit of the shapes, in which squares of lengths neither vanish nor overflow.
    let in_space: f64 = chart.shapes().iter().map(|shape| shape.area()).sum();
    let in_plane = area_of_corners(map);
    let exponent = (0.5 * (in_space / in_plane).log2()).round() - chart.scale().log2();
    exponent.clamp(-LARGEST, LARGEST).exp2()
}

/// The area of the triangles between the corners in the plane.
fn area_of_corners(map: &PlanarMap) -> f64 {
    let doubled = |cell: &[u32; 6]| {
        let [a, b, c] = [0, 1, 2].map(|k| map.nodes[cell[k] as usize].uv());
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    0.5 * map.cells.iter().map(doubled).sum::<f64>()
}
