use super::*;

fn areas(triangles: &[[u32; 3]], points: &[Vec3]) -> Vec<f64> {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| points[i as usize]);
        cross(sub(b, a), sub(c, a))[2] / 2.0
    };
    triangles.iter().map(area).collect()
}

fn triangulate(corners: &[u32], points: &[Vec3]) -> Vec<[u32; 3]> {
    let mut triangles = Vec::new();
    add(corners, points, &mut triangles);
    triangles
}

fn is_doubtful(points: &[Vec3]) -> bool {
    let corners: Vec<u32> = (0..points.len() as u32).collect();
    add(&corners, points, &mut Vec::new())
}

#[test]
fn a_concave_polygon_does_not_fold() {
    // An arrow head: fanning from corner 0 would fold.
    let points = [[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.5, 0.0, 0.0], [2.0, 1.0, 0.0]];
    for start in 0..4 {
        let corners: Vec<u32> = (0..4).map(|k| (start + k) % 4).collect();
        let areas = areas(&triangulate(&corners, &points), &points);
        assert!(areas.len() == 2 && areas.iter().all(|a| *a > 0.0), "start {start}");
        assert!((areas.iter().sum::<f64>() - 0.5).abs() < 1e-12, "start {start}");
    }
}

#[test]
fn degenerate_polygons_still_give_their_triangles() {
    let points = [[0.0; 3]; 5];
    assert_eq!(triangulate(&[0, 1, 2, 3, 4], &points).len(), 3);
    assert!(triangulate(&[0, 1], &points).is_empty());
    let odd = [[f64::NAN; 3], [f64::INFINITY; 3], [1e300; 3], [-1e300, 1e300, 0.0], [0.0; 3]];
    assert_eq!(triangulate(&[0, 1, 2, 3, 4, 2], &odd).len(), 4);
}

#[test]
fn quadrilaterals_are_judged_as_all_polygons_are() {
    let number = |k: u32| (f64::from(k) * 0.618_033_988_749).fract() * 4.0 - 2.0;
    let place = |k: u32| [0, 1, 2].map(|axis| number(3 * k + axis).round() / f64::from(1 + k % 3));
    let mut convex = 0;
    for quad in 0..5000 {
        let points = [0, 1, 2, 3].map(|k| place(4 * quad + k));
        let corners = [0, 1, 2, 3];
        let seen = is_seen_from_last(&corners, &points, normal(&corners, &points));
        assert_eq!(is_convex(points), seen, "{points:?}");
        convex += usize::from(seen);
    }
    assert!((500..4500).contains(&convex), "{convex} are convex");
    assert!(!is_convex([[f64::NAN; 3]; 4]) && !is_convex([[0.0; 3]; 4]));
}

#[test]
fn a_star_that_winds_twice_is_not_fanned() {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) * 0.8 * std::f64::consts::PI).sin_cos();
        [cos, sin, 0.0]
    };
    let points: Vec<Vec3> = (0..5).map(corner).collect();
    assert!(!is_seen_from_last(&[0, 1, 2, 3, 4], &points, [0.0, 0.0, 1.0]));
    assert!(is_doubtful(&points));
}

#[test]
fn doubts_are_told_where_there_are_any() {
    let bow = [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.5, 0.0]];
    assert!(is_doubtful(&bow));
    let flat = [[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.5, 0.0]];
    assert!(!is_doubtful(&flat) && !is_doubtful(&flat[..3]) && !is_doubtful(&[[0.0; 3]; 6]));
}

/// Polygons around the origin, by the radius at each of their corners.
fn around(n: u32, radius: impl Fn(u32) -> f64) -> Vec<Vec3> {
    let corner = |k: u32| {
        let (sin, cos) = (f64::from(k) / f64::from(n) * std::f64::consts::TAU).sin_cos();
        [radius(k) * cos, radius(k) * sin, 0.0]
    };
    (0..n).map(corner).collect()
}

fn comb(n: u32) -> Vec<Vec3> {
    let teeth = (0..n - 2).map(|k| [f64::from(n - k), if k % 2 == 0 { 1.0 } else { 1000.0 }, 0.0]);
    [[0.0; 3], [f64::from(n) + 1.0, 0.0, 0.0]].into_iter().chain(teeth).collect()
}

/// Teeth that all lie in each other's strip.
fn deep_comb(n: u32) -> Vec<Vec3> {
    comb(n).into_iter().map(|p| [p[0], p[1] * 1000.0 * f64::from(n), 0.0]).collect()
}

fn whole(points: &[Vec3]) -> bool {
    let corners: Vec<u32> = (0..points.len() as u32).collect();
    let areas = areas(&triangulate(&corners, points), points);
    let expected = normal(&corners, points)[2] / 2.0;
    let sum: f64 = areas.iter().sum();
    areas.len() + 2 == points.len()
        && areas.iter().all(|a| *a >= 0.0)
        && (sum - expected).abs() <= 1e-9 * expected.abs()
        && !is_doubtful(points)
}

#[test]
fn polygons_of_many_corners_are_covered_once() {
    for n in [5, 6, 7, 100, 2000] {
        assert!(whole(&around(n, |_| 2.0)), "disk of {n}");
        assert!(whole(&around(2 * n, |k| 2.0 + f64::from(k % 2))), "star of {n}");
        assert!(whole(&around(2 * n, |k| 2.0 + f64::from(k * k % 17))), "ragged, of {n}");
        assert!(whole(&comb(n)), "comb of {n}");
        assert!(whole(&deep_comb(n)), "deep comb of {n}");
    }
}

/// Looks per corner that a polygon takes, and whether it is doubtful.
fn looks(points: &[Vec3]) -> (usize, bool) {
    let corners: Vec<u32> = (0..points.len() as u32).collect();
    let ears = Ears::new(&corners, points, normal(&corners, points)).cut();
    ((LOOKS * points.len() - ears.looks) / points.len(), ears.is_doubtful)
}

fn noise(n: u32) -> Vec<Vec3> {
    (0..n).map(|k| [0.7123, 0.3791, 0.0].map(|s| (f64::from(k) * s).fract())).collect()
}

/// Those that do not cross themselves need few, however wild they are; others use them up.
#[test]
fn polygons_of_many_corners_take_few_looks_for_each() {
    let n = 20_000;
    let simple = [
        ("star", around(n, |k| 2.0 + f64::from(k % 2))),
        ("ragged", around(n, |k| 2.0 + f64::from(k.wrapping_mul(k) % 17))),
        ("comb", comb(n)),
        ("deep comb", deep_comb(n)),
    ];
    for (shape, points) in simple {
        let (looks, is_doubtful) = looks(&points);
        assert!(looks < LOOKS / 2 && !is_doubtful, "{shape}: {looks}");
    }
    let (crossing, is_doubtful) = looks(&noise(n));
    assert!(crossing <= LOOKS + 1 && is_doubtful, "{crossing}");
    assert!(!looks(&vec![[0.0; 3]; n as usize]).1, "nothing is there to fold");
}
