//! Intrinsic geometry: edge lengths, made safe for triangles that are degenerate.
//!
//! The stiffness matrices of flat triangles need edge lengths only. Where a triangle inequality holds barely or
//! not at all, the same small number is added to every edge of the surface ("mollification", Sharp and Crane
//! 2020, doi 10.1111/cgf.14069, section 4.5), so that every triangle has a positive area.

use crate::vec3::{Vec3, distance, triangle_area};

/// The slack that every triangle inequality gets, relative to the mean edge length. A flat triangle as long as that gets a
/// height of the order of its root, 1e-4: far above rounding, and too little to be felt by triangles that are sound.
const SLACK: f64 = 1e-8;

/// A triangle whose mollified and true areas differ by more than this share is flagged: what depends on its area would be
/// wrong by as much.
const FLAG: f64 = 0.01;

/// A triangle by its edge lengths: edge 0 joins corners 0 and 1, edge 1 corners 1 and 2, edge 2 corners 2 and 0.
///
/// ```
/// use planish_core::mesh::TriangleShape;
///
/// let shape = TriangleShape::of([[0.0; 3], [3.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
/// assert_eq!((shape.lengths, shape.area()), ([3.0, 5.0, 4.0], 6.0));
/// assert_eq!(shape.slack(), 2.0, "3 + 4 is more than 5 by so much");
/// // No triangle has these lengths: it counts as one without an area.
/// let broken = TriangleShape { lengths: [1.0, 1.0, 3.0] };
/// assert_eq!((broken.slack(), broken.area()), (-1.0, 0.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleShape {
    /// Lengths of the edges 01, 12, 20.
    pub lengths: [f64; 3],
}

impl TriangleShape {
    /// The shape of the triangle `p`.
    pub fn of(p: [Vec3; 3]) -> Self {
        Self { lengths: [distance(p[0], p[1]), distance(p[1], p[2]), distance(p[2], p[0])] }
    }

    /// The longest of the edges 01, 12, 20: 0, 1 or 2; of those that are as long, the one that comes first.
    pub fn longest_side(&self) -> usize {
        (1..3).fold(0, |longest, k| if self.lengths[k] > self.lengths[longest] { k } else { longest })
    }

    /// The length of the longest edge.
    pub fn longest(&self) -> f64 {
        self.lengths[self.longest_side()]
    }

    /// By how much the worst triangle inequality holds (negative: it does not).
    pub fn slack(&self) -> f64 {
        let [a, b, c] = sorted(self.lengths);
        c - (a - b)
    }

    /// The area, by Kahan's stable form of Heron's formula (Kahan, *Miscalculating area and angles of a
    /// needle-like triangle*, 1986).
    pub fn area(&self) -> f64 {
        let [a, b, c] = sorted(self.lengths);
        let product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
        0.25 * product.max(0.0).sqrt()
    }

    /// Half the cotangents of the angles opposite the edges 01, 12, 20.
    pub fn half_cotangents(&self) -> [f64; 3] {
        let area = self.area();
        [0, 1, 2].map(|k| {
            let (a, b, c) = (self.lengths[k], self.lengths[(k + 1) % 3], self.lengths[(k + 2) % 3]);
            ((b - a) * (b + a) + c * c) / (8.0 * area)
        })
    }

    /// The angles at corners 0, 1, 2, in radians.
    pub fn angles(&self) -> [f64; 3] {
        let half = self.half_cotangents();
        // Edge k + 1 lies across from corner k.
        [0, 1, 2].map(|k| 1.0_f64.atan2(2.0 * half[(k + 1) % 3]))
    }

    /// The tangents of half the angles at corners 0, 1, 2.
    pub fn half_angle_tangents(&self) -> [f64; 3] {
        let [a, b, c] = self.lengths;
        // Twice the distances from the corners to the points where the incircle touches.
        let corner = [a + c - b, a + b - c, b + c - a];
        let radius = 4.0 * self.area() / (a + b + c);
        corner.map(|t| radius / t)
    }

    /// The two parts when `side` (0, 1, 2 for the edges 01, 12, 20) is halved and joined to the corner across: that at the
    /// begin of the side with the edges half side, median, third edge, and that at its end with half side, next edge, median.
    pub fn halves(&self, side: usize) -> [Self; 2] {
        let [pq, qr, rp] = [0, 1, 2].map(|k| self.lengths[(side + k) % 3]);
        // Apollonius: the median from the corner across.
        let median = (0.5 * (qr * qr + rp * rp) - 0.25 * pq * pq).max(0.0).sqrt();
        let half = 0.5 * pq;
        [Self { lengths: [half, median, rp] }, Self { lengths: [half, qr, median] }]
    }

    /// The corners in the plane: corner 0 at the origin, corner 1 on the positive x axis, corner 2 above it.
    pub fn in_plane(&self) -> [[f64; 2]; 3] {
        let [a, b, c] = self.lengths;
        let x = ((a - b) * (a + b) + c * c) / (2.0 * a);
        [[0.0; 2], [a, 0.0], [x, 2.0 * self.area() / a]]
    }
}

/// Lengths in descending order.
fn sorted(mut lengths: [f64; 3]) -> [f64; 3] {
    lengths.sort_unstable_by(|a, b| b.total_cmp(a));
    lengths
}

/// The intrinsic metric of a surface: one shape per triangle, every area positive.
///
/// ```
/// use planish_core::mesh::Metric;
///
/// let sound = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]];
/// let metric = Metric::new(&[sound, flat], 1.0);
/// // All six lengths grew by the same small number: the flat triangle has an area, the sound one keeps its own.
/// assert!(metric.mollified_by > 0.0 && metric.mollified_by < 1e-7);
/// assert!(metric.area(1) > 0.0 && (metric.area(0) - 0.5).abs() < 1e-7);
/// assert_eq!(metric.flagged, [false, true], "what depends on the second area is left out of statistics");
/// ```
#[derive(Clone, Debug)]
pub struct Metric {
    /// Mollified shapes, one per triangle, in the unit of `scale`.
    pub shapes: Vec<TriangleShape>,
    /// What was added to every length, in the same unit; 0 on sound triangulations.
    pub mollified_by: f64,
    /// Whether the true and the mollified area of a triangle differ by more than 1 %.
    pub flagged: Vec<bool>,
    /// Lengths are true lengths times this power of two.
    pub scale: f64,
}

impl Metric {
    /// Measures and mollifies the triangles with corners `corners`, after scaling by the power of two `scale`.
    pub fn new(corners: &[[Vec3; 3]], scale: f64) -> Self {
        let scaled: Vec<_> = corners.iter().map(|t| t.map(|p| p.map(|x| x * scale))).collect();
        let mut shapes: Vec<_> = scaled.iter().map(|t| TriangleShape::of(*t)).collect();
        let total: f64 = shapes.iter().flat_map(|s| s.lengths).sum();
        let margin = SLACK * total / (3 * shapes.len().max(1)) as f64;
        // The smallest number that gives the worst triangle its margin: it grows the sum of two sides twice, the third one once.
        let added = shapes.iter().map(|s| margin - s.slack()).fold(0.0, f64::max);
        if added > 0.0 {
            shapes.iter_mut().for_each(|s| s.lengths = s.lengths.map(|l| l + added));
        }
        let mut flagged = Vec::with_capacity(shapes.len());
        for (shape, corners) in shapes.iter().zip(&scaled) {
            let change = (shape.area() - triangle_area(*corners)).abs();
            flagged.push(change > FLAG * shape.area());
        }
        Self { shapes, mollified_by: added, flagged, scale }
    }

    /// The mollified area of a triangle in the unit of the input, squared.
    pub fn area(&self, face: usize) -> f64 {
        self.shapes[face].area() / self.scale / self.scale
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_right_triangle_has_its_textbook_numbers() {
        let shape = TriangleShape { lengths: [3.0, 5.0, 4.0] };
        assert_eq!(shape.area(), 6.0);
        let expected = [0.5 * 4.0 / 3.0, 0.0, 0.5 * 3.0 / 4.0];
        for (got, want) in shape.half_cotangents().into_iter().zip(expected) {
            assert!((got - want).abs() < 1e-15, "{got} {want}");
        }
        for (got, want) in shape.half_angle_tangents().into_iter().zip([1.0, 0.5, 1.0 / 3.0]) {
            assert!((got - want).abs() < 1e-15, "{got} {want}");
        }
        assert_eq!(shape.in_plane(), [[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]]);
    }

    #[test]
    fn degenerate_triangles_get_an_area_and_sound_ones_keep_theirs() {
        let sound = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let flat = [[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]];
        let metric = Metric::new(&[sound, flat], 1.0);
        assert!(metric.mollified_by > 0.0 && metric.shapes.iter().all(|s| s.area() > 0.0));
        assert_eq!(metric.flagged, [false, true]);
        assert_eq!(Metric::new(&[sound], 1.0).mollified_by, 0.0);
    }
}
