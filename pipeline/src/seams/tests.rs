use super::*;
use crate::atlas::Atlas;
use crate::decompose::assemble;
use crate::mesh::TriangleSoup;
use crate::vec3::Vec3;
use crate::{repair, shapes};

/// The atlas of a soup in which each triangle is labelled by its centre.
pub(crate) fn labelled(soup: &TriangleSoup, label: impl Fn(Vec3) -> u32) -> (SurfaceMesh, Atlas) {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let centre = |f: usize| {
        let [a, b, c] = mesh.corners(f);
        [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
    };
    let labels: Vec<u32> = (0..mesh.triangles().len()).map(|f| label(centre(f))).collect();
    let atlas = assemble(&mesh, &labels).expect("legal");
    (mesh, atlas)
}

pub(crate) fn sector(p: Vec3, count: u32) -> u32 {
    let turns = (p[1].atan2(p[0]) / std::f64::consts::TAU).rem_euclid(1.0);
    (turns * f64::from(count)) as u32
}

/// What holds in every network.
fn verify(mesh: &SurfaceMesh, atlas: &Atlas) -> SeamNetwork {
    let network = SeamNetwork::new(mesh, atlas.charts(), 0.0);
    let mut seen: Vec<(ChartId, HalfEdgeId)> = Vec::new();
    for (curve, id) in network.curves().iter().zip(0..) {
        assert_eq!((curve.id(), curve.sides()[0].forward), (CurveId(id), true));
        assert!(curve.sides().is_sorted_by_key(|s| s.chart), "{curve:?}");
        for side in curve.sides() {
            assert_eq!(side.half_edges.len(), curve.segments());
            seen.extend(side.half_edges.iter().map(|h| (side.chart, *h)));
            verify_side(mesh, &atlas.charts()[side.chart.index()], curve, side);
        }
        let [begin, end] = curve.ends().map(|p| mesh.welded_vertex(network.points()[p].vertex));
        let ends = [curve.vertices()[0], curve.vertices()[curve.segments()]].map(|v| mesh.welded_vertex(v));
        assert_eq!([begin, end], ends);
    }
    let loops = |c: &Chart| std::iter::once(c.outer().to_vec()).chain(c.holes().to_vec()).collect::<Vec<_>>();
    let mut all: Vec<(ChartId, HalfEdgeId)> =
        atlas.charts().iter().flat_map(|c| loops(c).concat().into_iter().map(|h| (c.id(), h))).collect();
    all.sort_unstable();
    seen.sort_unstable();
    assert_eq!(seen, all, "every boundary half-edge lies on one side of one curve");
    atlas.charts().iter().for_each(|c| verify_loops(c, &loops(c), &network));
    network
}

/// The half-edges of a side run along the curve, in its direction or against it.
fn verify_side(mesh: &SurfaceMesh, chart: &Chart, curve: &Curve, side: &CurveSide) {
    let welded = |h: HalfEdgeId| mesh.welded_vertex(chart.vertices()[chart.from(h).index()]);
    for (h, w) in side.half_edges.iter().zip(curve.vertices().windows(2)) {
        let ends = [welded(*h), welded(h.next())];
        let along = [w[0], w[1]].map(|v| mesh.welded_vertex(v));
        assert_eq!(if side.forward { ends } else { [ends[1], ends[0]] }, along);
    }
}

/// The passages of a loop, put together, are the loop.
fn verify_loops(chart: &Chart, loops: &[Vec<HalfEdgeId>], network: &SeamNetwork) {
    assert_eq!(network.loops(chart.id()).len(), loops.len());
    for (boundary_loop, passages) in loops.iter().zip(network.loops(chart.id())) {
        let mut walked = Vec::new();
        for (i, p) in passages.iter().enumerate() {
            let curve = &network.curves()[p.curve.index()];
            let next = passages[(i + 1) % passages.len()];
            let (end, begin) = (usize::from(p.forward), usize::from(!next.forward));
            assert_eq!(curve.ends()[end], network.curves()[next.curve.index()].ends()[begin], "a closed loop");
            let beside = |s: &&CurveSide| (s.chart, s.forward) == (chart.id(), p.forward);
            let mut half_edges = curve.sides().iter().find(beside).expect("beside").half_edges.clone();
            if !p.forward {
                half_edges.reverse();
            }
            walked.extend(half_edges);
        }
        let start = walked.iter().position(|h| *h == boundary_loop[0]).expect("on the loop");
        walked.rotate_left(start);
        assert_eq!(&walked, boundary_loop);
    }
}

fn corners(network: &SeamNetwork) -> usize {
    network.points().iter().filter(|p| p.corner).count()
}

#[test]
fn two_halves_of_a_sphere_share_one_closed_curve() {
    let (mesh, atlas) = labelled(&shapes::sphere(12), |p| u32::from(p[2] > 0.0));
    let network = verify(&mesh, &atlas);
    let [curve] = network.curves() else { panic!("one curve") };
    assert!(curve.is_closed() && !curve.is_open());
    assert_eq!((curve.segments(), network.points().len(), corners(&network)), (24, 1, 0));
    let polygon = 48.0 * (std::f64::consts::PI / 24.0).sin();
    assert!((curve.length() - polygon).abs() < 1e-12, "{}", curve.length());
    assert_eq!(network.neighbours(ChartId(0)), [ChartId(1)]);
}

#[test]
fn three_sectors_meet_in_two_corners() {
    let (mesh, atlas) = labelled(&shapes::sphere(12), |p| sector(p, 3));
    let network = verify(&mesh, &atlas);
    assert_eq!((network.curves().len(), corners(&network)), (3, 2));
    assert!(network.curves().iter().all(|c| !c.is_closed() && c.sides().len() == 2 && c.segments() == 12));
    assert_eq!(network.neighbours(ChartId(1)), [ChartId(0), ChartId(2)]);
}

#[test]
fn a_torus_of_two_annuli_has_two_closed_seams() {
    let (mesh, atlas) = labelled(&shapes::ring_torus(24, 12), |p| sector(p, 2));
    let network = verify(&mesh, &atlas);
    assert_eq!((network.curves().len(), network.points().len(), corners(&network)), (2, 2, 0));
    let loops = network.loops(ChartId(1));
    assert_eq!(loops.iter().map(Vec::len).collect::<Vec<_>>(), [1, 1]);
    assert!(loops.concat().iter().all(|p| !p.forward), "the other chart runs against the curves");
}

#[test]
fn a_disk_with_holes_has_open_curves_only() {
    let (mesh, atlas) = labelled(&shapes::disk_with_holes(17, 3), |_| 0);
    let network = verify(&mesh, &atlas);
    // A square with three square holes.
    assert_eq!((network.curves().len(), network.seams().count(), corners(&network)), (16, 0, 16));
    assert!(network.curves().iter().all(|c| c.is_open() && !c.is_closed()));
    assert!(network.neighbours(ChartId(0)).is_empty());
}

#[test]
fn pages_of_a_book_share_their_spine() {
    let (mesh, atlas) = labelled(&shapes::book(3, 6), |p| {
        let turn = p[1].atan2(p[0]) - 0.4 * p[0].hypot(p[1]);
        ((turn / std::f64::consts::TAU * 3.0).rem_euclid(3.0).round() as u32) % 3
    });
    let network = verify(&mesh, &atlas);
    let spine: Vec<&Curve> = network.seams().collect();
    assert_eq!((spine.len(), spine[0].sides().len(), spine[0].segments()), (1, 3, 6));
    // Every page has two corners more.
    assert_eq!((network.curves().len(), corners(&network)), (1 + 3 * 3, 2 + 3 * 2));
    assert_eq!(network.neighbours(ChartId(0)), [ChartId(1), ChartId(2)]);
    let directions: Vec<bool> = spine[0].sides().iter().map(|s| s.forward).collect();
    assert_eq!(directions, [true, false, true], "every second page lies on its other face");
}

#[test]
fn a_cut_disk_has_corners_where_the_seam_meets_the_boundary() {
    let (mesh, atlas) = labelled(&shapes::disk(6), |p| sector(p, 2));
    let network = verify(&mesh, &atlas);
    assert_eq!((network.curves().len(), network.seams().count(), corners(&network)), (3, 1, 2));
}

/// A cylinder with a fin along one ruling, where repair cuts it open: its chart is a rectangle whose ends lie on each
/// other.
pub(crate) fn cut_cylinder() -> TriangleSoup {
    let n = 8;
    let point = |i: u32, j: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(n);
        [angle.cos(), angle.sin(), f64::from(j)]
    };
    let mut points: Vec<Vec3> = (0..n).flat_map(|i| (0..3).map(move |j| point(i, j))).collect();
    points.extend([[2.0, 0.0, 0.0], [2.0, 0.0, 1.0], [2.0, 0.0, 2.0]]);
    let (at, fin) = (|i: u32, j: u32| 3 * (i % n) + j, 3 * n);
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..2).map(move |j| (i, j))) {
        triangles.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
    }
    for j in 0..2 {
        triangles.extend([[at(0, j), fin + j, fin + j + 1], [at(0, j), fin + j + 1, at(0, j + 1)]]);
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_chart_along_itself_is_seen_on_both_sides() {
    let (mesh, atlas) = labelled(&cut_cylinder(), |p| u32::from(p[0].hypot(p[1]) > 1.0));
    let network = verify(&mesh, &atlas);
    let along: Vec<_> = network.seams().collect();
    assert_eq!(along.len(), 2, "no chain runs on where a chart passes twice");
    assert!(along.iter().all(|c| c.sides().len() == 3 && c.sides()[0].chart == c.sides()[1].chart));
}

/// A flat strip of `n` squares of which the upper boundary is moved by `up`.
fn strip(n: u32, up: impl Fn(u32) -> f64) -> TriangleSoup {
    let point = |k: u32| [f64::from(k / 2), if k.is_multiple_of(2) { 0.0 } else { 3.0 + up(k / 2) }, 0.0];
    let square = |i: u32| [[2 * i, 2 * i + 2, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 1]];
    TriangleSoup::new((0..=2 * n + 1).map(point).collect(), (0..n).flat_map(square).collect()).expect("sound")
}

fn corners_of(soup: &TriangleSoup, label: impl Fn(Vec3) -> u32) -> usize {
    let (mesh, atlas) = labelled(soup, label);
    verify(&mesh, &atlas).points().iter().filter(|p| p.corner).count()
}

#[test]
fn corners_of_the_shape_are_points_and_zigzags_are_not() {
    assert_eq!(corners_of(&strip(20, |_| 0.0), |_| 0), 4, "a rectangle");
    assert_eq!(corners_of(&strip(1, |_| 0.0), |_| 0), 4, "of two triangles, too");
    // Beside a corner a zigzag may seem to turn with it.
    assert!(corners_of(&strip(20, |i| f64::from(i % 2)), |_| 0) <= 6, "a zigzag");
    assert_eq!(corners_of(&strip(20, |i| if i < 10 { f64::from(i) } else { f64::from(20 - i) }), |_| 0), 5, "a gable");
    assert_eq!(corners_of(&shapes::flat_disk(12), |_| 0), 0, "a circle");
    let (mesh, atlas) = labelled(&strip(20, |_| 0.0), |_| 0);
    let corners_apart = |spacing| corners(&SeamNetwork::new(&mesh, atlas.charts(), spacing));
    assert_eq!([2.9, 3.1, 19.9, 50.0].map(corners_apart), [4, 2, 2, 0], "3 by 20");
}

#[test]
fn corners_of_sharp_seams_are_points_and_those_of_smooth_ones_are_not() {
    // A square inside a plate, as a chart of its own: in its plane, and lifted out of it, so that its edges are sharp.
    let plate = |height: f64| {
        let n = 12_u32;
        let at = |i: u32, j: u32| j * (n + 1) + i;
        let point = |k: u32| {
            let (i, j) = (k % (n + 1), k / (n + 1));
            let top = (5..=7).contains(&i) && (5..=7).contains(&j);
            [f64::from(i), f64::from(j), if top { height } else { 0.0 }]
        };
        let square = |k: u32| {
            let (i, j) = (k % n, k / n);
            [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]
        };
        TriangleSoup::new((0..(n + 1) * (n + 1)).map(point).collect(), (0..n * n).flat_map(square).collect())
            .expect("sound")
    };
    let is_inner = |p: Vec3| u32::from((5.0..7.0).contains(&p[0]) && (5.0..7.0).contains(&p[1]));
    assert_eq!(corners_of(&plate(0.0), is_inner), 4, "of the plate");
    assert_eq!(corners_of(&plate(2.0), is_inner), 8, "and of the block upon it");
}
