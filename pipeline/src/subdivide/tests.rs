use super::*;
use crate::atlas::Chart;
use crate::certified::CertifiedChart;
use crate::certify::{PlanarMap, parts, prove};
use crate::grid::orientation;
use crate::mesh::TriangleSoup;
use crate::parametrize::parametrize_chart;
use crate::seams::tests::{labelled, sector};
use crate::vec3::distance;
use crate::{Order, shapes};

/// Whether the triangle of these nodes turns left.
fn turns_left(nodes: &[GridPoint], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|n| nodes[n as usize]);
    orientation(a, b, c) > 0
}

/// An atlas with one chart per label, and maps by straight triangles.
struct Sample {
    atlas: CertifiedAtlas,
    straight: Vec<Option<StraightMap>>,
}

impl Sample {
    fn new(soup: &TriangleSoup, label: impl Fn(Vec3) -> u32) -> Self {
        Self::with(soup, label, |chart| chart)
    }

    /// As [`Self::new`], with other maps of the charts.
    fn with(
        soup: &TriangleSoup,
        label: impl Fn(Vec3) -> u32,
        change: impl Fn(CertifiedChart) -> CertifiedChart,
    ) -> Self {
        let (mesh, atlas) = labelled(soup, label);
        let certified = |chart| change(parametrize_chart(chart, Order::Quadratic).expect("maps"));
        let charts: Vec<CertifiedChart> = atlas.into_charts().into_iter().map(certified).collect();
        let straight = vec![None; charts.len()];
        let size = Some(f64::MIN_POSITIVE);
        Self { atlas: CertifiedAtlas::gather(mesh, charts, size).expect("an atlas"), straight }
    }

    /// Whether all charts are so small that none of their triangles stays whole.
    fn is_small(&self) -> bool {
        self.atlas.charts().iter().all(|c| c.chart().triangles().len() < refine::FEW)
    }

    fn subdivide(&self) -> Result<LinearAtlas, Error> {
        let straight: Vec<Option<&StraightMap>> = self.straight.iter().map(Option::as_ref).collect();
        subdivide(&self.atlas, &straight)
    }

    /// Subdivides, and looks at all that is promised.
    fn verified(&self) -> LinearAtlas {
        let linear = self.subdivide().expect("subdivides");
        for (chart, c) in linear.charts().iter().zip(self.atlas.charts().iter().map(CertifiedChart::chart)) {
            assert!(chart.triangles().iter().all(|t| turns_left(chart.uv(), *t)), "every triangle turns left");
            assert!(chart.uv().iter().all(|p| GridPoint::exact(p.uv()) == Some(*p)), "places are doubles");
            assert_eq!(self.open_sides(chart), self.sides_of_curves(&linear, c), "boundaries are the curves");
        }
        self.verify_curves(&linear);
        linear
    }

    /// The sides of a chart's triangles that have no twin, as nodes of the atlas; twins run in opposite directions.
    fn open_sides(&self, chart: &LinearChart) -> Vec<(u32, u32)> {
        let sides = chart.triangles().iter().flat_map(|t| [0, 1, 2].map(|k| [t[k], t[(k + 1) % 3]]));
        let mut sides: Vec<(u32, u32)> =
            sides.map(|s| s.map(|n| chart.nodes()[n as usize])).map(|[a, b]| (a, b)).collect();
        sides.sort_unstable();
        assert!(sides.is_sorted_by(|a, b| a < b), "no side is there twice");
        let open = |s: &&(u32, u32)| sides.binary_search(&(s.1, s.0)).is_err();
        sides.iter().filter(open).copied().collect()
    }

    fn sides_of_curves(&self, linear: &LinearAtlas, chart: &Chart) -> Vec<(u32, u32)> {
        let mut sides = Vec::new();
        for passage in self.atlas.seams().loops(chart.id()).iter().flatten() {
            let along = linear.curves()[passage.curve.index()].windows(2).map(|w| (w[0], w[1]));
            sides.extend(along.map(|(a, b)| if passage.forward { (a, b) } else { (b, a) }));
        }
        sides.sort_unstable();
        sides
    }

    fn verify_curves(&self, linear: &LinearAtlas) {
        for (curve, nodes) in self.atlas.seams().curves().iter().zip(linear.curves()) {
            assert_eq!(curve.is_closed(), nodes[0] == nodes[nodes.len() - 1]);
            let points: Vec<Vec3> = nodes.iter().map(|n| linear.points()[*n as usize]).collect();
            let length: f64 = points.windows(2).map(|w| distance(w[0], w[1])).sum();
            assert!((length / curve.length() - 1.0).abs() < 1e-9, "nodes lie in order along the curve");
        }
    }
}

#[test]
fn charts_become_triangulations_that_share_their_seams() {
    let above = |p: Vec3| u32::from(p[2] > 0.0);
    let page = |p: Vec3| {
        let turn = p[1].atan2(p[0]) - 0.4 * p[0].hypot(p[1]);
        ((turn / std::f64::consts::TAU * 3.0).rem_euclid(3.0).round() as u32) % 3
    };
    let samples = [
        Sample::new(&shapes::sphere(10), above),
        Sample::new(&shapes::sphere(10), |p| sector(p, 3)),
        Sample::new(&shapes::ring_torus(16, 10), |p| sector(p, 2)),
        Sample::new(&shapes::book(3, 5), page),
        Sample::new(&shapes::disk_with_holes(13, 2), |_| 0),
        Sample::new(&shapes::bent_disk(24, 0.2, 0.2), |p| sector(p, 2)),
    ];
    for sample in samples {
        let linear = sample.verified();
        let triangles = sample.atlas.mesh().triangles().len();
        assert!(linear.triangle_count() >= triangles * if sample.is_small() { 4 } else { 1 });
        assert_eq!((linear.moved(), linear.linear_charts()), (0, &[][..]));
    }
}

#[test]
fn a_chart_that_needs_too_many_parts_is_handed_over_by_its_linear_map() {
    // Untangled against all odds: dozens of triangles are valid by a hair along whole sides.
    let sample = Sample::new(&shapes::bent_disk(12, 0.45, 1.0), |p| sector(p, 2));
    let linear = sample.verified();
    assert!(linear.linear_charts().contains(&ChartId(0)), "{:?}", linear.linear_charts());
    assert!(linear.triangle_count() < 8 * sample.atlas.mesh().triangles().len());
}

#[test]
fn a_chart_is_handed_over_by_its_projection_where_there_is_one() {
    let plate = shapes::disk_with_holes(13, 2);
    let flat = plate.points().iter().map(|[x, y, _]| [*x, *y, 0.5 * x]).collect();
    let flat = TriangleSoup::new(flat, plate.triangles().to_vec()).expect("sound");
    let mut sample = Sample::new(&flat, |p| u32::from(p[0] > 0.1));
    let charts = sample.atlas.charts();
    sample.straight = charts.iter().map(|c| crate::map::natural::projection(c.chart(), 4.0).map(|p| p.map)).collect();
    let linear = sample.verified();
    assert_eq!((linear.straight_charts().len(), linear.refined()), (sample.atlas.charts().len(), 0));
    for chart in linear.charts() {
        let scale = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|n| chart.uv()[n as usize]);
            let corners = t.map(|n| linear.points()[chart.nodes()[n as usize] as usize]);
            orientation(a, b, c) as f64 / crate::vec3::triangle_area(corners)
        };
        let first = scale(&chart.triangles()[0]);
        assert!(chart.triangles().iter().all(|t| (scale(t) / first - 1.0).abs() < 1e-9), "the plane as it is");
    }
}

#[test]
fn triangles_stay_whole_where_the_map_is_as_good_as_linear() {
    let sample = Sample::new(&shapes::sphere(40), |p| u32::from(p[2] > 0.0));
    let linear = sample.verified();
    let (triangles, parts) = (sample.atlas.mesh().triangles().len(), linear.triangle_count());
    assert!(parts < 2 * triangles, "{parts} of {triangles}");
    // The differential of a whole triangle is nearly that of the curved one, at every corner, in every direction.
    let mut whole = 0;
    for (chart, certified) in linear.charts().iter().zip(sample.atlas.charts()) {
        let map = certified.map().map();
        for (t, face) in chart.triangles().iter().zip(chart.faces()) {
            let cell = map.cells[*face as usize];
            if !cell[..3].iter().all(|n| t.contains(n)) {
                continue;
            }
            whole += 1;
            let nodes = cell.map(|n| map.nodes[n as usize].uv());
            let difference = differential_beside_linear(nodes);
            assert!(difference <= 8.0 / 32.0, "{difference}");
        }
    }
    assert!(whole > triangles / 2, "{whole} of {triangles}");
}

/// The largest Frobenius norm of D F L^-1 - 1 at the corners, F being the quadratic map with these nodes, and L the linear one
/// between its corners.
fn differential_beside_linear(nodes: [[f64; 2]; 6]) -> f64 {
    // Derivatives of the six shape functions by x and y, where the corners lie at (0, 0), (1, 0), (0, 1).
    let derivatives = |x: f64, y: f64| {
        let z = 1.0 - x - y;
        let by_x = [1.0 - 4.0 * z, 4.0 * x - 1.0, 0.0, 4.0 * (z - x), 4.0 * y, -4.0 * y];
        let by_y = [1.0 - 4.0 * z, 0.0, 4.0 * y - 1.0, -4.0 * x, 4.0 * x, 4.0 * (z - y)];
        [by_x, by_y]
    };
    let [a, b, c] = [0, 1, 2].map(|k| nodes[k]);
    let linear = [[b[0] - a[0], c[0] - a[0]], [b[1] - a[1], c[1] - a[1]]];
    let det = linear[0][0] * linear[1][1] - linear[0][1] * linear[1][0];
    let inverse = [[linear[1][1], -linear[0][1]], [-linear[1][0], linear[0][0]]].map(|row| row.map(|v| v / det));
    let at = |(x, y): (f64, f64)| {
        let by = derivatives(x, y);
        let d = [0, 1].map(|i| by.map(|w| nodes.iter().zip(w).map(|(n, w)| w * n[i]).sum::<f64>()));
        let mut sum = 0.0;
        for i in 0..2 {
            for j in 0..2 {
                let product = d[i][0] * inverse[0][j] + d[i][1] * inverse[1][j];
                sum += (product - f64::from(u8::from(i == j))).powi(2);
            }
        }
        sum.sqrt()
    };
    [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].into_iter().map(at).fold(0.0, f64::max)
}

/// A valid curved triangle whose straight part between its third corner and the middles beside it is inverted: the
/// chord to the middle of the second side passes on the other side of that of the third. In sixteenths.
const INVERTED: [[f64; 2]; 6] = [[-14.0, -1.0], [5.0, -1.0], [-7.0, 4.0], [1.0, -14.0], [-2.0, 15.0], [-8.0, 2.0]];

/// The map of a chart of one triangle with its nodes at [`INVERTED`].
fn inverted(chart: &Chart) -> CertifiedMap {
    let t = chart.triangles()[0].map(|v| v.0);
    let cells = vec![[t[0], t[1], t[2], 3, 4, 5]];
    let mut nodes = vec![GridPoint::default(); 6];
    let places = INVERTED.map(|p| GridPoint::vertex(p.map(|c| c / 16.0)));
    cells[0].iter().zip(places).for_each(|(n, p)| nodes[*n as usize] = p);
    prove(PlanarMap { cells, nodes, hole_centres: vec![] }).expect("valid")
}

/// Every side of a tetrahedron is a chart of its own, mapped like [`inverted`] where asked for.
fn tetrahedron(is_inverted: [bool; 4]) -> Sample {
    tetrahedron_with(|chart| {
        if !is_inverted[chart.id().index()] {
            return chart;
        }
        let (map, start) = (inverted(chart.chart()), chart.start().clone());
        chart.with_maps(map, start)
    })
}

/// Every side of a tetrahedron is a chart of its own, with another map.
fn tetrahedron_with(change: impl Fn(CertifiedChart) -> CertifiedChart) -> Sample {
    let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let triangles = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
    let number = |p: Vec3| {
        let zero = (0..3).find(|k| p[*k] == 0.0);
        zero.map_or(2, |k| [3, 1, 0][k])
    };
    let soup = TriangleSoup::new(points, triangles).expect("sound");
    Sample::with(&soup, number, change)
}

#[test]
fn inverted_parts_are_refined_in_all_charts_around() {
    let sound = tetrahedron([false; 4]).verified();
    assert_eq!((sound.refined(), sound.triangle_count()), (0, 16));
    let parts = quartered_inverted_parts(&tetrahedron([true, false, false, false]));
    assert_eq!(parts, 1, "the twin is broken where it should be");
    let one = tetrahedron([true, false, false, false]).verified();
    assert!(one.refined() > 1 && one.triangle_count() > 20, "neighbours take part: {}", one.refined());
    let all = tetrahedron([true; 4]).verified();
    assert_eq!(all.refined(), 4);
    assert_eq!(all.points().iter().flatten().filter(|c| !c.is_finite()).count(), 0);
}

/// The map of a chart of one straight triangle, as small as one around the origin can be on the grid, and as long as the
/// disk is wide: of neighbouring Fibonacci numbers F, F_(n+1) F_(n-1) - F_n^2 = 1 for even n.
fn hair(chart: &Chart) -> CertifiedMap {
    let t = chart.triangles()[0].map(|v| v.0);
    let cells = vec![[t[0], t[1], t[2], 3, 4, 5]];
    let mut fibonacci = [0.0, 1.0, 1.0];
    for _ in 0..74 {
        fibonacci = [fibonacci[1], fibonacci[2], fibonacci[1] + fibonacci[2]];
    }
    let [f74, f75, f76] = fibonacci.map(|f: f64| f * 2.0_f64.powi(-52));
    let corners = [[-f76, -f75], [f75, f74], [f74, f75 - f74]].map(GridPoint::vertex);
    let mut nodes = vec![GridPoint::default(); 6];
    for k in 0..3 {
        nodes[t[k] as usize] = corners[k];
        nodes[3 + k] = corners[k].midpoint(corners[(k + 1) % 3]);
    }
    prove(PlanarMap { cells, nodes, hole_centres: vec![] }).expect("valid")
}

#[test]
fn charts_too_thin_to_be_halved_make_their_neighbours_plainer() {
    let sample = tetrahedron_with(|chart| {
        if chart.id() == ChartId(0) {
            let (map, start) = (inverted(chart.chart()), chart.start().clone());
            return chart.with_maps(map, start);
        }
        let thin = hair(chart.chart());
        chart.with_maps(thin.clone(), thin)
    });
    let linear = sample.verified();
    assert!(linear.linear_charts().contains(&ChartId(0)), "{:?}", linear.linear_charts());
    assert_eq!(linear.refined(), 0, "nothing is halved any more");
}

/// How many parts of the first chart are inverted when every triangle is split into four.
fn quartered_inverted_parts(sample: &Sample) -> usize {
    let map = sample.atlas.charts()[0].map().map();
    map.cells.iter().flat_map(|c| parts(*c)).filter(|t| !turns_left(&map.nodes, *t)).count()
}

#[test]
fn refinement_that_may_not_go_deep_enough_names_the_triangle() {
    let sample = tetrahedron([false, true, false, false]);
    let charts = sample.atlas.charts();
    let maps: Vec<&PlanarMap> = charts.iter().map(|c| c.map().map()).collect();
    let mut nodes = Nodes::new(&sample.atlas);
    let found = refine::triangulate(0, &sample.atlas, &maps, &[false; 4], &mut nodes);
    assert_eq!(found.err(), Some(vec![Inverted { chart: ChartId(1), face: FaceId(0), depth: 1, halved: 0 }]));
}

#[test]
fn triangles_without_a_normal_get_one_and_others_stay() {
    let strip = Sample::new(&shapes::sliver_strip(12), |_| 0);
    assert!(flat_quartered_parts(&strip) > 0, "the twin is broken: the last triangles of the strip are exactly flat");
    let linear = strip.verified();
    assert!(linear.moved() > 0);
    let corners = |c: &LinearChart, t: [u32; 3]| t.map(|n| linear.points()[c.nodes()[n as usize] as usize]);
    for chart in linear.charts() {
        assert!(chart.triangles().iter().all(|t| crate::vec3::triangle_area(corners(chart, *t)) > 0.0));
    }
    let furthest =
        strip.atlas.mesh().points().iter().zip(linear.points()).map(|(p, q)| distance(*p, *q)).fold(0.0, f64::max);
    assert!(furthest <= 32.0 * 1e-12 * strip.atlas.mesh().bounding_box().diagonal(), "{furthest}");
    // The same strip with its last triangles lifted has nothing to move.
    let lifted: Vec<Vec3> =
        shapes::sliver_strip(12).points().iter().map(|p| [p[0], p[1], p[0].fract() * (1.0 + p[0])]).collect();
    let soup = TriangleSoup::new(lifted, shapes::sliver_strip(12).triangles().to_vec()).expect("sound");
    assert_eq!(Sample::new(&soup, |_| 0).verified().moved(), 0);
}

/// How many parts of the first chart have no area when every triangle is split into four.
fn flat_quartered_parts(sample: &Sample) -> usize {
    let (nodes, first) = (Nodes::new(&sample.atlas), &sample.atlas.charts()[0]);
    let of_chart = nodes.of_chart(sample.atlas.mesh(), first.chart());
    let points = nodes.positions(sample.atlas.mesh());
    let corners = |t: &[u32; 3]| t.map(|n| points[of_chart[n as usize] as usize]);
    let quarters: Vec<[u32; 3]> = first.map().map().cells.iter().flat_map(|c| parts(*c)).collect();
    quarters.iter().filter(|t| crate::vec3::triangle_area(corners(t)) == 0.0).count()
}

#[test]
fn triangles_too_small_for_normals_are_named() {
    let points = shapes::disk(3).points().iter().map(|p| p.map(|c| c * 1e-90)).collect();
    let soup = TriangleSoup::new(points, shapes::disk(3).triangles().to_vec()).expect("sound");
    assert!(matches!(Sample::new(&soup, |_| 0).subdivide(), Err(Error::NoNormal { chart: ChartId(0), .. })));
}

#[test]
fn a_moved_node_is_moved_far_from_the_origin_too() {
    let mut points = vec![[1e7, 1e7, 1e7], [1e7 + 1.0, 1e7, 1e7], [1e7 + 0.5, 1e7, 1e7]];
    let chart = LinearChart { nodes: vec![0, 1, 2], triangles: vec![[0, 1, 2]], faces: vec![0], ..Default::default() };
    assert_eq!(normals::separate(&mut points, &[chart], 1.0), Ok(1));
    assert!(crate::vec3::triangle_area([points[0], points[1], points[2]]) > 0.0);
}

#[test]
fn charts_that_touch_themselves_are_refused() {
    let cut = Sample::new(&crate::seams::tests::cut_cylinder(), |p| u32::from(p[0].hypot(p[1]) > 1.0));
    assert!(matches!(cut.subdivide(), Err(Error::MeetsItself { chart: ChartId(0), .. })));
    // A ring of squares with a slit that two corners close again: there the boundary passes twice.
    let squares = [[1, 0], [2, 0], [2, 1], [2, 2], [1, 2], [0, 2], [0, 1]];
    let at = |i: u32, j: u32| 4 * i + j;
    let triangles =
        |[i, j]: [u32; 2]| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    let points = (0..16).map(|k| [f64::from(k / 4), f64::from(k % 4), 0.1 * f64::from(k % 3)]).collect();
    let soup = TriangleSoup::new(points, squares.into_iter().flat_map(triangles).collect()).expect("sound");
    assert!(matches!(Sample::new(&soup, |_| 0).subdivide(), Err(Error::Pinched { chart: ChartId(0), .. })));
}
