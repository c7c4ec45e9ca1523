//! Maps are free up to rotations: they are turned so that they lie straight, which shows and packs them best.

/// How many pairs of sides and corners of a hull are looked at: with more, sides are passed over. A hull of 2,000 corners is
/// looked at as a whole.
const PAIRS: usize = 4_000_000;

/// The direction of the longer side of the smallest rectangle around points; none where they have none. (One side of such a
/// rectangle lies on a side of the convex hull: Freeman and Shapira 1975, *Determining the minimum-area encasing rectangle for an
/// arbitrary closed curve*, doi 10.1145/360881.360919.)
pub(super) fn longer_side(points: &[[f64; 2]]) -> Option<[f64; 2]> {
    let hull = convex_hull(points);
    let step = (hull.len() * hull.len()).div_ceil(PAIRS).max(1);
    let mut best: Option<(f64, [f64; 2])> = None;
    for i in (0..hull.len()).step_by(step) {
        let (p, q) = (hull[i], hull[(i + 1) % hull.len()]);
        let side = [q[0] - p[0], q[1] - p[1]];
        let length = side[0].hypot(side[1]);
        // Corners of a hull that are one but for rounding have no direction.
        if !(length.is_finite() && length > 0.0) {
            continue;
        }
        let direction = side.map(|c| c / length);
        let [width, height] = extent(&hull, direction);
        if best.is_none_or(|(least, _)| width * height < least) {
            let longer = if width >= height { direction } else { [-direction[1], direction[0]] };
            best = Some((width * height, longer));
        }
    }
    best.map(|(_, longer)| longer)
}

/// Turns points so that a direction lies along u.
pub(super) fn turn(points: &mut [[f64; 2]], [cos, sin]: [f64; 2]) {
    for p in points {
        *p = [cos * p[0] + sin * p[1], cos * p[1] - sin * p[0]];
    }
}

/// How far points reach along a direction, and across.
fn extent(points: &[[f64; 2]], [x, y]: [f64; 2]) -> [f64; 2] {
    let (mut min, mut max) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for p in points {
        let along = [x * p[0] + y * p[1], x * p[1] - y * p[0]];
        for k in 0..2 {
            min[k] = min[k].min(along[k]);
            max[k] = max[k].max(along[k]);
        }
    }
    [0, 1].map(|k| max[k] - min[k])
}

/// The corners of the convex hull, turning left (Andrew 1979, *Another efficient algorithm for convex hulls in two
/// dimensions*, doi 10.1016/0020-0190(79)90072-3). To rounding.
fn convex_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let mut hull = half_of_hull(sorted.iter());
    let mut upper = half_of_hull(sorted.iter().rev());
    // Each half ends where the other begins.
    hull.pop();
    upper.pop();
    hull.extend(upper);
    hull
}

fn half_of_hull<'a>(sorted: impl Iterator<Item = &'a [f64; 2]>) -> Vec<[f64; 2]> {
    let mut half: Vec<[f64; 2]> = Vec::new();
    for &r in sorted {
        while let [.., p, q] = half[..] {
            let turn = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
            if turn > 0.0 {
                break;
            }
            half.pop();
        }
        half.push(r);
    }
    half
}

#[cfg(test)]
mod tests {
    use super::*;

    fn upright(points: &mut [[f64; 2]]) {
        if let Some(longer) = longer_side(points) {
            turn(points, longer);
        }
    }

    #[test]
    fn a_turned_rectangle_is_laid_straight_with_its_longer_side_along_u() {
        for turn in [0.0_f64, 0.3, 1.5, 2.9, -1.0] {
            let (sin, cos) = turn.sin_cos();
            let mut points: Vec<[f64; 2]> = [[0.0, 0.0], [1.0, 0.0], [1.0, 3.0], [0.0, 3.0], [0.4, 1.0]]
                .map(|[x, y]| [cos * x - sin * y, sin * x + cos * y])
                .to_vec();
            upright(&mut points);
            let [width, height] = extent(&points, [1.0, 0.0]);
            assert!((width - 3.0).abs() < 1e-14 && (height - 1.0).abs() < 1e-14, "{turn}: {width} {height}");
            // Turned, not mirrored.
            let [a, b, d] = [points[0], points[1], points[3]];
            assert!((b[0] - a[0]) * (d[1] - a[1]) - (b[1] - a[1]) * (d[0] - a[0]) > 2.9);
        }
    }

    #[test]
    fn points_without_a_rectangle_stay() {
        for mut points in [vec![], vec![[1.0, 2.0]; 3], vec![[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]]] {
            let before = points.len();
            upright(&mut points);
            assert_eq!(points.len(), before);
        }
    }
}
