//! The point of a triangle or of a segment that is closest to another one.

use crate::vec3::{Vec3, cross, dot, sub};

/// A point of a triangle by its barycentric coordinates, which are at least 0 and add up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnTriangle {
    /// Weights of the corners.
    pub weights: [f64; 3],
    /// The squared distance to the point asked for.
    pub squared: f64,
}

/// The point of the triangle `p` closest to `x`. Triangles without an area are their sides.
///
/// Inside, weights are ratios of the areas that the foot of the perpendicular spans with the sides (Ericson 2005,
/// *Real-time collision detection*, 3.4); where one is negative, or there is no area, the sides decide.
///
/// ```
/// use planish_core::evaluate::on_triangle;
///
/// let triangle = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];
/// let above = on_triangle([1.0, 1.0, 3.0], triangle);
/// assert_eq!((above.weights, above.squared), ([0.5, 0.25, 0.25], 9.0));
/// let beside = on_triangle([1.0, -2.0, 0.0], triangle);
/// assert_eq!((beside.weights, beside.squared), ([0.75, 0.25, 0.0], 4.0));
/// ```
pub fn on_triangle(x: Vec3, p: [Vec3; 3]) -> OnTriangle {
    let normal = cross(sub(p[1], p[0]), sub(p[2], p[0]));
    let squared_normal = dot(normal, normal);
    if squared_normal > 0.0 {
        let share = |k: usize| {
            let (a, b) = (sub(p[(k + 1) % 3], x), sub(p[(k + 2) % 3], x));
            dot(cross(a, b), normal) / squared_normal
        };
        let weights = [share(0), share(1), share(2)];
        if weights.iter().all(|w| *w >= 0.0) {
            let height = dot(sub(x, p[0]), normal);
            let sum: f64 = weights.iter().sum();
            let squared = height * height / squared_normal;
            return OnTriangle { weights: weights.map(|w| w / sum), squared };
        }
    }
    let mut best = OnTriangle { weights: [1.0, 0.0, 0.0], squared: f64::INFINITY };
    for k in 0..3 {
        let OnSegment { share: t, squared } = on_segment(x, [p[k], p[(k + 1) % 3]]);
        if squared < best.squared {
            let mut weights = [0.0; 3];
            weights[k] = 1.0 - t;
            weights[(k + 1) % 3] = t;
            best = OnTriangle { weights, squared };
        }
    }
    best
}

/// A point of a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnSegment {
    /// Where it is, as a share of the segment from its begin: in [0, 1].
    pub share: f64,
    /// The squared distance to the point asked for.
    pub squared: f64,
}

/// The point of the segment `p` closest to `x`.
///
/// ```
/// use planish_core::evaluate::on_segment;
///
/// let segment = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0]];
/// let beside = on_segment([1.0, 3.0, 0.0], segment);
/// assert_eq!((beside.share, beside.squared), (0.25, 9.0));
/// assert_eq!(on_segment([9.0, 0.0, 0.0], segment).share, 1.0, "beyond its end");
/// ```
pub fn on_segment(x: Vec3, p: [Vec3; 2]) -> OnSegment {
    let along = sub(p[1], p[0]);
    let length = dot(along, along);
    let t = if length > 0.0 { (dot(sub(x, p[0]), along) / length).clamp(0.0, 1.0) } else { 0.0 };
    // From the nearer end: at an end, the distance is that to the end, to the bit.
    let gap = if t <= 0.5 {
        [0, 1, 2].map(|k| x[k] - (p[0][k] + t * along[k]))
    } else {
        [0, 1, 2].map(|k| x[k] - (p[1][k] - (1.0 - t) * along[k]))
    };
    OnSegment { share: t, squared: dot(gap, gap) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(p: [Vec3; 3], w: [f64; 3]) -> Vec3 {
        [0, 1, 2].map(|k| w[0] * p[0][k] + w[1] * p[1][k] + w[2] * p[2][k])
    }

    proptest! {
        #[test]
        fn no_other_point_is_closer(
            x in prop::array::uniform3(-2.0..2.0f64),
            p in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)),
            w in prop::array::uniform3(0.0..1.0f64),
        ) {
            let found = on_triangle(x, p);
            let y = at(p, found.weights);
            let gap = sub(x, y);
            prop_assert!((dot(gap, gap) - found.squared).abs() <= 1e-12 * (1.0 + found.squared));
            prop_assert!((found.weights.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            let sum: f64 = w.iter().sum::<f64>().max(1e-9);
            let other = sub(x, at(p, w.map(|c| c / sum)));
            prop_assert!(found.squared <= dot(other, other) + 1e-12);
        }
    }

    #[test]
    fn triangles_without_an_area_are_their_sides() {
        let line = [[0.0; 3], [1.0, 0.0, 0.0], [3.0, 0.0, 0.0]];
        let found = on_triangle([2.0, 1.0, 0.0], line);
        assert_eq!((at(line, found.weights), found.squared), ([2.0, 0.0, 0.0], 1.0));
        assert_eq!(on_triangle([0.0, 0.0, 2.0], [[0.0; 3]; 3]).squared, 4.0);
    }
}
