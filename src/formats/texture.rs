//! Texture coordinates: the charts of an atlas in the unit square, as they lie in param.vtu, by straight triangles.
//!
//! OBJ and glTF know straight triangles only. The corners of a curved triangle that is valid may make a straight one
//! that is not (its arcs bulge far); the map from which untangling started has straight triangles, and the same
//! boundary. A chart in whose quadratic map a straight triangle would be turned over has the texture coordinates of
//! that one. So no texture coordinates fold, up to rounding.

use super::labels::{Label, label_index};
use super::layout::{Placement, layout};
use planish_core::certify::PlanarMap;
use planish_core::grid::orientation;
use planish_core::{CertifiedAtlas, CertifiedChart};
use std::collections::BTreeMap;

/// The charts of an atlas in the unit square: those of param.vtu, all made smaller by the same factor.
pub(super) struct UnitSquare {
    places: Vec<Placement>,
    min: [f64; 2],
    /// The longer side of the box around all.
    side: f64,
}

impl UnitSquare {
    /// The place of each chart.
    pub fn of(charts: &[CertifiedChart]) -> Self {
        let places = layout(charts);
        let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (certified, place) in charts.iter().zip(&places) {
            for [x, y, _] in corners(certified).map(|uv| place.of(uv)) {
                min = [min[0].min(x), min[1].min(y)];
                max = [max[0].max(x), max[1].max(y)];
            }
        }
        Self { places, min, side: (max[0] - min[0]).max(max[1] - min[1]) }
    }

    /// The texture coordinates of the vertices of a chart, in their order; v points up.
    pub fn coordinates(&self, certified: &CertifiedChart) -> impl Iterator<Item = [f64; 2]> {
        let place = self.places[certified.id().index()];
        // Differences and quotients are rounded to the nearest number, which never leads out of 0..1.
        corners(certified).map(move |uv| {
            let [x, y, _] = place.of(uv);
            [(x - self.min[0]) / self.side, (y - self.min[1]) / self.side]
        })
    }
}

/// The uv of the vertices of a chart, in their order, between which straight triangles do not fold.
fn corners(certified: &CertifiedChart) -> impl Iterator<Item = [f64; 2]> {
    let quadratic = certified.map().map();
    let map = if is_straight(quadratic) { quadratic } else { certified.start().map() };
    map.nodes[..certified.chart().vertices().len()].iter().map(|p| p.uv())
}

/// Whether the corners of every triangle turn left.
fn is_straight(map: &PlanarMap) -> bool {
    map.cells.iter().all(|cell| {
        let [a, b, c] = [0, 1, 2].map(|k| map.nodes[cell[k] as usize]);
        orientation(a, b, c) > 0
    })
}

/// The charts with one label.
pub(super) struct Part<'a> {
    /// None where the input has no labels.
    pub label: Option<&'a Label>,
    /// In their order.
    pub charts: Vec<&'a CertifiedChart>,
}

/// The charts of an atlas by their labels, in the order of these; all of them in one part where there are none.
pub(super) fn parts<'a>(atlas: &'a CertifiedAtlas, labels: &'a [Label]) -> Vec<Part<'a>> {
    let mut charts: BTreeMap<Option<usize>, Vec<&CertifiedChart>> = BTreeMap::new();
    for certified in atlas.charts() {
        charts.entry(label_index(atlas, certified.id(), labels)).or_default().push(certified);
    }
    charts.into_iter().map(|(index, charts)| Part { label: index.map(|i| &labels[i]), charts }).collect()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use planish_core::mesh::TriangleSoup;
    use planish_core::monitor::NoMonitor;
    use planish_core::{BoundaryShape, Settings, parametrize, shapes};

    /// The atlas of a soup.
    pub fn atlas_of(soup: &TriangleSoup) -> CertifiedAtlas {
        parametrize(soup, &Settings::default(), &NoMonitor).expect("an atlas")
    }

    /// A cube whose six sides have labels, and these.
    pub fn labelled_cube() -> (CertifiedAtlas, Vec<Label>) {
        let corner = |i: u32| [0, 1, 2].map(|k| f64::from(i >> k & 1));
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let halves = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]);
        let soup = TriangleSoup::new((0..8).map(corner).collect(), halves.collect()).expect("sound");
        let labels = (0..6).map(|i| Label { tag: 10 + i, name: format!("side {i}"), group: format!("side_{i}") });
        (atlas_of(&soup.with_labels((0..12).map(|i| i / 2).collect())), labels.collect())
    }

    /// Twice the area of a triangle that turns left.
    pub fn doubled_area([a, b, c]: [[f64; 2]; 3]) -> f64 {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    }

    /// The texture coordinates of each triangle of a chart.
    fn triangles(square: &UnitSquare, certified: &CertifiedChart) -> Vec<[[f64; 2]; 3]> {
        let uv: Vec<[f64; 2]> = square.coordinates(certified).collect();
        certified.chart().triangles().iter().map(|t| t.map(|v| uv[v.index()])).collect()
    }

    #[test]
    fn charts_fill_the_unit_square_and_none_of_their_triangles_is_turned_over() {
        let soups = [
            shapes::ring_torus(24, 12),
            shapes::book(3, 4),
            shapes::disk_with_holes(8, 2),
            shapes::sphere(8),
            shapes::folding_six(),
            shapes::finger(12, 22),
        ];
        for soup in soups {
            for boundary in [BoundaryShape::Natural, BoundaryShape::Circle] {
                let mut settings = Settings::default();
                settings.decompose.boundary = boundary;
                let atlas = parametrize(&soup, &settings, &NoMonitor).expect("an atlas");
                let square = UnitSquare::of(atlas.charts());
                let all: Vec<_> = atlas.charts().iter().flat_map(|c| triangles(&square, c)).collect();
                assert!(all.iter().all(|t| doubled_area(*t) > 0.0));
                let coordinates = || all.iter().flatten().flatten();
                assert!(coordinates().all(|c| (0.0..=1.0).contains(c)));
                assert_eq!(coordinates().copied().fold(0.0, f64::max), 1.0, "no room is left");
            }
        }
    }

    #[test]
    fn areas_of_charts_are_to_each_other_as_in_space() {
        let atlas = atlas_of(&shapes::tube(36, 4, 5.0));
        let square = UnitSquare::of(atlas.charts());
        let mut ratios = Vec::new();
        for certified in atlas.charts() {
            let in_square: f64 = triangles(&square, certified).into_iter().map(doubled_area).sum();
            let in_space: f64 = (0..certified.chart().triangles().len()).map(|f| certified.chart().area(f)).sum();
            ratios.push(in_square / in_space);
        }
        assert!(ratios.iter().all(|r| (r / ratios[0] - 1.0).abs() < 1e-6), "{ratios:?}");
    }

    #[test]
    fn parts_follow_labels_and_hold_every_chart_once() {
        let (atlas, labels) = labelled_cube();
        let found = parts(&atlas, &labels);
        let names: Vec<&str> = found.iter().filter_map(|p| p.label).map(|l| l.name.as_str()).collect();
        assert_eq!(names, ["side 0", "side 1", "side 2", "side 3", "side 4", "side 5"]);
        assert_eq!(found.iter().map(|p| p.charts.len()).sum::<usize>(), atlas.charts().len());
        let one = parts(&atlas, &[]);
        assert!(one.len() == 1 && one[0].label.is_none() && one[0].charts.len() == atlas.charts().len());
    }

    /// Three thin triangles around a vertex: the curved sides of the valid quadratic map bulge far there.
    #[test]
    fn charts_whose_straight_triangles_would_fold_have_the_coordinates_of_their_start() {
        let mut settings = Settings::default();
        settings.decompose.boundary = BoundaryShape::Circle;
        let atlas = parametrize(&shapes::floater_five(), &settings, &NoMonitor).expect("an atlas");
        let certified = &atlas.charts()[0];
        let [quadratic, start] = [certified.map(), certified.start()].map(|map| map.map());
        assert!(!is_straight(quadratic) && is_straight(start), "the test has lost its sense");
        let vertices = certified.chart().vertices().len();
        assert!(corners(certified).eq(start.nodes[..vertices].iter().map(|p| p.uv())));
        assert!(triangles(&UnitSquare::of(atlas.charts()), certified).into_iter().all(|t| doubled_area(t) > 0.0));
    }
}
