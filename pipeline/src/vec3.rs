//! Vectors of three-dimensional space, as plain arrays.

/// A point or vector of space.
pub type Vec3 = [f64; 3];

/// `a - b`.
pub fn sub(a: Vec3, b: Vec3) -> Vec3 {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The midpoint of `a` and `b`.
pub fn midpoint(a: Vec3, b: Vec3) -> Vec3 {
    [0.5 * a[0] + 0.5 * b[0], 0.5 * a[1] + 0.5 * b[1], 0.5 * a[2] + 0.5 * b[2]]
}

/// The scalar product.
pub fn dot(a: Vec3, b: Vec3) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
pub fn cross(a: Vec3, b: Vec3) -> Vec3 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The Euclidean length.
pub fn norm(a: Vec3) -> f64 {
    dot(a, a).sqrt()
}

/// The Euclidean distance of two points.
pub fn distance(a: Vec3, b: Vec3) -> f64 {
    norm(sub(a, b))
}

/// The area of the triangle `p`.
pub fn triangle_area(p: [Vec3; 3]) -> f64 {
    0.5 * norm(cross(sub(p[1], p[0]), sub(p[2], p[0])))
}

/// The bits of a point, with negative zero turned into zero: equal where the coordinates are.
pub(crate) fn bits_of(p: Vec3) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}

/// An axis-aligned box.
///
/// ```
/// use planish_core::vec3::BoundingBox;
///
/// let around = BoundingBox::of([[0.0, 4.0, 1.0], [3.0, 0.0, 1.0]]).expect("there are points");
/// assert_eq!((around.min, around.max), ([0.0, 0.0, 1.0], [3.0, 4.0, 1.0]));
/// assert_eq!(around.diagonal(), 5.0);
/// assert_eq!(BoundingBox::of([]), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingBox {
    /// Least coordinates.
    pub min: Vec3,
    /// Largest coordinates.
    pub max: Vec3,
}

impl BoundingBox {
    /// The smallest box around `points`; `None` when there are none.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Option<Self> {
        let mut points = points.into_iter();
        let first = points.next()?;
        let grow = |mut b: Self, p: Vec3| {
            for k in 0..3 {
                b.min[k] = b.min[k].min(p[k]);
                b.max[k] = b.max[k].max(p[k]);
            }
            b
        };
        Some(points.fold(Self { min: first, max: first }, grow))
    }

    /// The length of the diagonal, scaled so that it neither overflows nor underflows.
    pub fn diagonal(&self) -> f64 {
        let half = [0, 1, 2].map(|k| 0.5 * self.max[k] - 0.5 * self.min[k]);
        let largest = half.iter().fold(0.0_f64, |m, x| m.max(*x));
        if largest == 0.0 { 0.0 } else { 2.0 * largest * norm(half.map(|x| x / largest)) }
    }
}

/// The power of two that brings `length` into `[0.5, 1)`: multiplying by it is exact, so that results do not
/// depend on the unit of the input. It is 1 for a length of zero.
///
/// ```
/// use planish_core::vec3::unit_scale;
///
/// assert_eq!(unit_scale(5.0), 0.125, "5 / 8 lies between 0.5 and 1");
/// assert_eq!(unit_scale(0.3), 2.0);
/// // No digit is lost on the way there and back.
/// let length = 1.0 / 3.0e7;
/// assert_eq!(length * unit_scale(length) / unit_scale(length), length);
/// ```
pub fn unit_scale(length: f64) -> f64 {
    if length <= 0.0 || !length.is_finite() {
        return 1.0;
    }
    let exponent = length.log2().floor() + 1.0;
    2.0_f64.powi(-(exponent.clamp(-1000.0, 1000.0) as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_scale_is_a_power_of_two() {
        for length in [1.0, 0.3, 5.7e8, 4.2e-12, 1e300, 1e-300] {
            let scaled = length * unit_scale(length);
            assert!((0.49..=1.0).contains(&scaled), "{length} -> {scaled}");
            assert_eq!(unit_scale(length).log2().fract(), 0.0);
        }
        assert_eq!(unit_scale(0.0), 1.0);
    }

    #[test]
    fn a_diagonal_does_not_overflow() {
        let b = BoundingBox { min: [-1e308; 3], max: [1e308; 3] };
        assert!(b.diagonal().is_infinite() || b.diagonal() > 1e308);
        let tiny = BoundingBox { min: [0.0; 3], max: [3e-200, 4e-200, 0.0] };
        assert!((tiny.diagonal() / 5e-200 - 1.0).abs() < 1e-15);
    }
}
