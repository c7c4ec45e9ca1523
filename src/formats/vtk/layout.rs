//! Where charts lie in param.vtu: beside each other, each in its own size.

use etagere::{AtlasAllocator, size2};
use planish_core::CertifiedChart;

/// The place of a chart: its uv, times `scale`, moved by `shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The power of two with which the chart has, within a factor of two, the area that it has in space. The uv of natural
    /// maps are made so that it has that area exactly, up to rounding.
    pub scale: f64,
    /// In the unit of the input.
    pub shift: [f64; 2],
}

impl Placement {
    /// The place of a point of the chart.
    pub fn of(&self, uv: [f64; 2]) -> [f64; 3] {
        let [x, y] = [0, 1].map(|k| uv[k] * self.scale + self.shift[k]);
        [x, y, 0.0]
    }
}

/// The side of the square that is packed, in units of its own: positions are multiples of its share of the square.
const SIDE: i32 = 16_384;

/// The gap between charts, as a share of the mean side of their boxes.
const GAP: f64 = 0.1;

/// How often the square is tried in a larger size, and by how much. After all of them it has 300 times the side of a square
/// of the charts' area, and a strip of any length that is cut into charts lies in it.
const TRIES: i32 = 60;
const GROWTH: f64 = 1.1;

/// Packs the charts of an atlas, the highest first, in rows.
pub fn layout(charts: &[CertifiedChart]) -> Vec<Placement> {
    let boxes: Vec<ScaledBox> = charts.iter().map(ScaledBox::of).collect();
    let mean = boxes.iter().map(ScaledBox::area).sum::<f64>().sqrt() / (boxes.len() as f64).sqrt();
    let gap = GAP * mean;
    let area: f64 = boxes.iter().map(|b| (b.size[0] + gap) * (b.size[1] + gap)).sum();
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|a, b| boxes[*b].size[1].total_cmp(&boxes[*a].size[1]).then(a.cmp(b)));
    let packed = (0..TRIES).find_map(|k| packed(&boxes, &order, gap, area.sqrt() * GROWTH.powi(k)));
    let corners = packed.unwrap_or_else(|| in_a_row(&boxes, gap));
    let place =
        |(b, corner): (&ScaledBox, [f64; 2])| Placement { scale: b.scale, shift: [0, 1].map(|k| corner[k] - b.min[k]) };
    boxes.iter().zip(corners).map(place).collect()
}

/// A chart in its own size.
struct ScaledBox {
    scale: f64,
    min: [f64; 2],
    size: [f64; 2],
}

impl ScaledBox {
    fn of(certified: &CertifiedChart) -> Self {
        let scale = uv_scale(certified);
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for p in certified.map().map().nodes.iter().map(|n| n.uv()) {
            for k in 0..2 {
                min[k] = min[k].min(scale * p[k]);
                max[k] = max[k].max(scale * p[k]);
            }
        }
        Self { scale, min, size: [0, 1].map(|k| max[k] - min[k]) }
    }

    fn area(&self) -> f64 {
        self.size[0] * self.size[1]
    }
}

/// The power of two next to the root of a chart's area in space over that in the plane.
fn uv_scale(certified: &CertifiedChart) -> f64 {
    let chart = certified.chart();
    let in_space: f64 = (0..chart.triangles().len()).map(|f| chart.area(f)).sum();
    let map = certified.map().map();
    let doubled = |cell: &[u32; 6]| {
        let [a, b, c] = [0, 1, 2].map(|k| map.nodes[cell[k] as usize].uv());
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    };
    let in_plane = 0.5 * map.cells.iter().map(doubled).sum::<f64>();
    // Finite for any surface: sizes beyond doubles were refused.
    (0.5 * (in_space / in_plane).log2()).round().clamp(-1000.0, 1000.0).exp2()
}

/// The lower left corners of all boxes in a square with this side; none where they do not fit.
fn packed(boxes: &[ScaledBox], order: &[usize], gap: f64, side: f64) -> Option<Vec<[f64; 2]>> {
    let unit = side / f64::from(SIDE);
    let mut square = AtlasAllocator::new(size2(SIDE, SIDE));
    let mut corners = vec![[0.0; 2]; boxes.len()];
    for &i in order {
        let [width, height] = boxes[i].size.map(|s| ((s + gap) / unit).ceil());
        if width > f64::from(SIDE) || height > f64::from(SIDE) {
            return None;
        }
        let place = square.allocate(size2(width as i32, height as i32))?.rectangle.min;
        corners[i] = [place.x, place.y].map(|c| f64::from(c) * unit);
    }
    Some(corners)
}

/// One beside the other, where nothing else was found.
fn in_a_row(boxes: &[ScaledBox], gap: f64) -> Vec<[f64; 2]> {
    let mut x = 0.0;
    let mut corners = Vec::with_capacity(boxes.len());
    for b in boxes {
        corners.push([x, 0.0]);
        x += b.size[0] + gap;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use planish_core::monitor::NoMonitor;
    use planish_core::{Settings, parametrize, shapes};

    #[test]
    fn charts_lie_apart_in_their_own_size() {
        for soup in [shapes::sphere(6), shapes::ring_torus(24, 12), shapes::tube(36, 1, 5.0), shapes::book(3, 4)] {
            let atlas = parametrize(&soup, &Settings::default(), &NoMonitor).expect("an atlas");
            let places = layout(atlas.charts());
            let boxes: Vec<ScaledBox> = atlas.charts().iter().map(ScaledBox::of).collect();
            for (i, (place, b)) in places.iter().zip(&boxes).enumerate() {
                assert_eq!(place.scale.log2().fract(), 0.0, "a power of two");
                let low = |j: usize, k: usize| boxes[j].min[k] + places[j].shift[k];
                let is_before = |a: usize, b: usize, k: usize| low(a, k) + boxes[a].size[k] < low(b, k);
                let is_apart = |j: usize| (0..2).any(|k| is_before(i, j, k) || is_before(j, i, k));
                assert!((0..i).all(is_apart), "chart {i} of {}", boxes.len());
                assert!(b.area() > 0.0);
            }
            // Not spread out: no more than a few times the area of the charts.
            let far = |i: usize, k: usize| boxes[i].min[k] + places[i].shift[k] + boxes[i].size[k];
            let extent = [0, 1].map(|k| (0..places.len()).map(|i| far(i, k)).fold(0.0, f64::max));
            assert!(extent[0] * extent[1] < 4.0 * boxes.iter().map(ScaledBox::area).sum::<f64>());
        }
    }

    #[test]
    fn natural_maps_of_what_is_developable_have_true_lengths() {
        let atlas = parametrize(&shapes::tube(36, 1, 5.0), &Settings::default(), &NoMonitor).expect("an atlas");
        for (certified, place) in atlas.charts().iter().zip(layout(atlas.charts())) {
            let (chart, map) = (certified.chart(), certified.map().map());
            for (_, sides) in chart.edges().iter() {
                let ends = [sides[0], sides[0].next()].map(|h| chart.from(h).index());
                let [p, q] = ends.map(|v| place.of(map.nodes[v].uv()));
                let length = chart.length(sides[0]) / chart.scale();
                assert!(((p[0] - q[0]).hypot(p[1] - q[1]) / length - 1.0).abs() < 1e-6);
            }
        }
    }
}
