//! Steps: how finely 32-bit coordinates tell where a vertex is.
//!
//! STL holds numbers of 32 bits: 24 binary digits each. Far from the origin little of that
//! is left for the surface: at 5,000,000 (a northing in metres, say) coordinates lie in steps of 0.5. Whether
//! numbers were rounded is seen from them: all are 32-bit numbers, and some are odd multiples of the step, or finer. Those
//! that lie in wider steps (whole numbers, a grid) lost nothing.

use super::SurfaceMesh;
use crate::vec3::{Vec3, distance};

/// Edges below this many steps are short: the direction of one of four steps is known to 1 in 4 at best.
pub const FEW_STEPS: f64 = 4.0;

/// Steps are coarse where this share of the edges is short. A terrain in metres of a map decided it: half of its edges are; no
/// surface at hand that lies near the origin comes near it.
const MANY: f64 = 0.1;

/// The steps in which coordinates lie, and the edges that are short beside them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoordinateSteps {
    /// The step along x, y and z, in the unit of the input; 0 where nothing was rounded.
    pub step: Vec3,
    /// Edges shorter than [`FEW_STEPS`] of the largest step.
    pub short_edges: usize,
    /// All edges.
    pub edges: usize,
}

impl CoordinateSteps {
    /// The largest step.
    pub fn largest(&self) -> f64 {
        self.step.into_iter().fold(0.0, f64::max)
    }

    /// The axis of the largest step: 0, 1 or 2.
    pub fn axis(&self) -> usize {
        self.step.iter().position(|s| *s == self.largest()).unwrap_or_default()
    }
}

impl SurfaceMesh {
    /// The steps in which the coordinates lie, where these are so coarse that the directions of many edges are unknown.
    ///
    /// ```
    /// use planish_core::{mesh::TriangleSoup, repair, shapes};
    ///
    /// // Triangles about 1 m wide, in metres of a map, as STL holds them.
    /// let disk = shapes::disk(20);
    /// let on_map = |[x, y, z]: &[f64; 3]| [20.0 * x + 4e5, 20.0 * y + 5e6, 20.0 * z].map(|c| f64::from(c as f32));
    /// let soup = TriangleSoup::new(disk.points().iter().map(on_map).collect(), disk.triangles().to_vec())?;
    /// let coarse = repair(&soup, &repair::Settings::default())?.mesh.coarse_steps().expect("many edges are short");
    /// assert_eq!((coarse.largest(), coarse.axis()), (0.5, 1), "at 5,000,000 no number lies between 0 and 0.5");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn coarse_steps(&self) -> Option<CoordinateSteps> {
        let step = steps(self.points())?;
        let few = FEW_STEPS * step.into_iter().fold(0.0, f64::max);
        let is_short = |face: usize, side: usize| {
            let corners = self.corners(face);
            distance(corners[side], corners[(side + 1) % 3]) < few
        };
        let sides = self.edges().iter().map(|(_, sides)| sides[0]);
        let short_edges = sides.filter(|h| is_short(h.face().index(), h.side())).count();
        let edges = self.edges().len();
        (short_edges as f64 > MANY * edges as f64).then_some(CoordinateSteps { step, short_edges, edges })
    }
}

/// The steps along the axes; none where not all coordinates are 32-bit numbers, or no axis has rounded ones.
fn steps(points: &[Vec3]) -> Option<Vec3> {
    if points.iter().flatten().any(|c| f64::from(*c as f32) != *c) {
        return None;
    }
    let step = [0, 1, 2].map(|k| step(points, k));
    (step != [0.0; 3]).then_some(step)
}

/// The distance of neighbouring 32-bit numbers at the median of the coordinates along an axis, unless all are even multiples
/// of it. Not at the largest one: a single vertex far away rounds no other.
fn step(points: &[Vec3], axis: usize) -> f64 {
    let mut sizes: Vec<f32> = points.iter().map(|p| p[axis].abs() as f32).collect();
    let middle = sizes.len() / 2;
    if sizes.is_empty() {
        return 0.0;
    }
    let median = *sizes.select_nth_unstable_by(middle, f32::total_cmp).1;
    let step = f64::from(median.next_up()) - f64::from(median);
    // Odd multiples of the step, or finer numbers: even multiples of it would fit wider steps, too.
    let is_rounded = step.is_finite() && points.iter().any(|p| p[axis] % (2.0 * step) != 0.0);
    if is_rounded { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::{repair, shapes};

    /// A disk about 40 across, at a place, in 32 bits.
    fn disk_at(place: Vec3) -> SurfaceMesh {
        let disk = shapes::bent_disk(20, 0.2, 0.3);
        let rounded = |p: &Vec3| [0, 1, 2].map(|k| f64::from((20.0 * p[k] + place[k]) as f32));
        let points = disk.points().iter().map(rounded).collect();
        let soup = TriangleSoup::new(points, disk.triangles().to_vec()).expect("sound");
        repair(&soup, &Default::default()).expect("a surface").mesh
    }

    #[test]
    fn steps_are_those_of_the_coordinates_where_edges_are_short() {
        let far = disk_at([400_000.0, 5_000_000.0, 600.0]).coarse_steps().expect("coarse");
        assert_eq!((far.largest(), far.axis(), far.step[0]), (0.5, 1, 0.03125));
        assert!(far.short_edges > far.edges / 2);
        for near in [[0.0; 3], [4000.0, 5000.0, 600.0]] {
            assert_eq!(disk_at(near).coarse_steps(), None);
        }
    }

    #[test]
    fn what_was_not_rounded_is_no_matter() {
        let flat = |place: f64, pitch: f64| {
            let points: Vec<Vec3> =
                (0..16).map(|i| [place + pitch * f64::from(i % 4), place + pitch * f64::from(i / 4), 0.0]).collect();
            steps(&points)
        };
        assert_eq!(flat(5_000_000.0, 1.0), None, "whole numbers of 32 bits");
        assert_eq!(flat(5_000_000.0, 0.1), None, "doubles");
        assert_eq!(flat(5_000_000.0, 0.5), Some([0.5, 0.5, 0.0]));
        let mut peak: Vec<Vec3> = (0..9).map(|i| [f64::from(i), 0.5, 0.25]).collect();
        peak.push([1e20_f32.into(), 0.5, 0.25]);
        assert!(steps(&peak).is_none_or(|s| s.iter().all(|s| *s < 1e-6)), "one vertex far away");
    }
}
