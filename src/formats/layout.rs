//! Where charts lie in param.vtu: beside each other, each in its own size.

use planish_core::CertifiedChart;
use planish_core::measure::scale::uv_scale;

/// The place of a chart: its uv, times `scale`, moved by `shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The power of two with which the chart has its own size ([`uv_scale`]).
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

/// The gap between charts, as a share of the mean side of their boxes.
const GAP: f64 = 0.1;

/// Packs the charts of an atlas in rows, the highest first (next fit by decreasing height: Coffman, Garey, Johnson and Tarjan
/// 1980, *Performance bounds for level-oriented two-dimensional packing algorithms*, doi 10.1137/0209062): for any number
/// of charts at most about twice the area of their boxes.
pub fn layout(charts: &[CertifiedChart]) -> Vec<Placement> {
    let boxes: Vec<ScaledBox> = charts.iter().map(ScaledBox::of).collect();
    let mean = (boxes.iter().map(ScaledBox::area).sum::<f64>() / boxes.len() as f64).sqrt();
    let gap = GAP * mean;
    let area: f64 = boxes.iter().map(|b| (b.size[0] + gap) * (b.size[1] + gap)).sum();
    let widest = boxes.iter().map(|b| b.size[0]).fold(0.0, f64::max);
    let width = area.sqrt().max(widest);
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|a, b| boxes[*b].size[1].total_cmp(&boxes[*a].size[1]).then(a.cmp(b)));
    let mut places = vec![Placement { scale: 1.0, shift: [0.0; 2] }; boxes.len()];
    // Where the next chart of the row lies, and how high the row is: as its first chart.
    let (mut corner, mut height) = ([0.0; 2], 0.0);
    for i in order {
        let b = &boxes[i];
        if corner[0] > 0.0 && corner[0] + b.size[0] > width {
            corner = [0.0, corner[1] + height + gap];
            height = 0.0;
        }
        height = b.size[1].max(height);
        places[i] = Placement { scale: b.scale, shift: [0, 1].map(|k| corner[k] - b.min[k]) };
        corner[0] += b.size[0] + gap;
    }
    places
}

/// A chart in its own size.
struct ScaledBox {
    scale: f64,
    min: [f64; 2],
    size: [f64; 2],
}

impl ScaledBox {
    fn of(certified: &CertifiedChart) -> Self {
        let scale = uv_scale(certified.chart(), certified.map().map());
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
