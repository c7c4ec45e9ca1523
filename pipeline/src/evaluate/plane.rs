//! The plane of a flat triangulation, which is a map of it as good as any other.

use crate::grid::{GridPoint, orientation};
use crate::vec3::{Vec3, cross, dot, norm, sub, unit_scale};

/// A triangulation is flat where no node is further from its plane than this, relative to its extent. By experience: far
/// above the rounding of doubles, and below that of single precision, whose planes are only nearly so.
const FLAT: f64 = 1e-9;

/// A plane with two directions at right angles in it.
///
/// ```
/// use planish_core::evaluate::Plane;
/// use planish_core::shapes;
///
/// let flat = shapes::flat_disk(6);
/// let plane = Plane::of(flat.points(), flat.triangles()).expect("all its nodes lie in one plane");
/// assert_eq!(plane.normal(), [0.0, 0.0, 1.0]);
/// // Distances are those of space; the height above the plane does not count.
/// let [u, v] = plane.coords([3.0, 4.0, 7.0]);
/// assert!((u.hypot(v) - 5.0).abs() < 1e-12);
/// let bent = shapes::disk(6);
/// assert_eq!(Plane::of(bent.points(), bent.triangles()), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    origin: Vec3,
    normal: Vec3,
    axes: [Vec3; 2],
}

impl Plane {
    /// The plane of a flat triangulation; none where it is not flat, or some triangle does not turn left there. Its normal
    /// is that of the sum of the areas.
    ///
    /// # Panics
    /// Where a triangle names a point that does not exist.
    pub fn of(points: &[Vec3], triangles: &[[u32; 3]]) -> Option<Self> {
        let corners = |t: &[u32; 3]| t.map(|n| points[n as usize]);
        let origin = corners(triangles.first()?)[0];
        let plane = Self::facing(origin, triangles.iter().map(corners))?;
        let normal = plane.normal;
        let used = || triangles.iter().flat_map(corners);
        let extent = used().map(|p| norm(sub(p, origin))).fold(0.0_f64, f64::max);
        if used().any(|p| dot(sub(p, origin), normal).abs() > FLAT * extent) {
            return None;
        }
        let scale = unit_scale(extent);
        let turns_left = |t: &[u32; 3]| {
            let [a, b, c] = corners(t).map(|p| GridPoint::mid(plane.coords(p).map(|x| x * scale)));
            orientation(a, b, c) > 0
        };
        triangles.iter().all(turns_left).then_some(plane)
    }

    /// The plane through a point whose normal is that of the sum of the areas of some triangles; none where that has no
    /// direction.
    pub fn facing(origin: Vec3, triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Option<Self> {
        let mut sum = [0.0; 3];
        for [a, b, c] in triangles {
            let n = cross(sub(b, a), sub(c, a));
            (0..3).for_each(|k| sum[k] += n[k]);
        }
        let length = norm(sum);
        if !length.is_finite() || length <= 0.0 {
            return None;
        }
        let normal = sum.map(|c| c / length);
        Some(Self { origin, normal, axes: axes(normal) })
    }

    /// The unit normal.
    pub fn normal(&self) -> Vec3 {
        self.normal
    }

    /// Where a point lies in the plane, in the unit of space.
    pub fn coords(&self, x: Vec3) -> [f64; 2] {
        self.axes.map(|axis| dot(sub(x, self.origin), axis))
    }
}

/// Two directions at right angles to a unit normal and each other, which turn left around it.
fn axes(normal: Vec3) -> [Vec3; 2] {
    // The axis that is closest to the plane: the vector product with it cannot vanish.
    let least = (1..3).fold(0, |best, k| if normal[k].abs() < normal[best].abs() { k } else { best });
    let mut direction = [0.0; 3];
    direction[least] = 1.0;
    let first = cross(direction, normal);
    let first = first.map(|c| c / norm(first));
    [first, cross(normal, first)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;

    #[test]
    fn flat_disks_have_planes_and_others_have_none() {
        let flat = shapes::flat_disk(6);
        let turned: Vec<Vec3> = flat.points().iter().map(|[x, y, _]| [3.0 + 0.6 * x, *y, 0.8 * x]).collect();
        let plane = Plane::of(&turned, flat.triangles()).expect("it is flat");
        let [a, b] = [turned[3], turned[9]].map(|p| plane.coords(p));
        assert!(((a[0] - b[0]).hypot(a[1] - b[1]) - norm(sub(turned[3], turned[9]))).abs() < 1e-12);
        let bump = shapes::disk(6);
        assert_eq!(Plane::of(bump.points(), bump.triangles()), None);
        let mut folded = flat.triangles().to_vec();
        folded[0].swap(0, 1);
        assert_eq!(Plane::of(flat.points(), &folded), None);
        assert_eq!(Plane::of(&[], &[]), None);
    }
}
