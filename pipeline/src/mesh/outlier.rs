//! A coordinate far from all others: what stands for "no data" in grids of heights (-9999, -32768, 1e20).

use super::SurfaceMesh;
use crate::vec3::Vec3;

/// A value is apart if it is farther from the others than this many times their range. By experience: -9999 is found beside
/// heights from 0 to less than 1000; less would find it beside mountains, too, and take deep wells in a plain for it.
const FAR: f64 = 10.0;

/// Vertices that make a value several: a single one is a peak.
const SEVERAL: usize = 2;

/// A surface is one of heights if this share of its vertices lies over places of their own. Solids are not: a nail has a tip
/// far from its head, too.
const OWN_PLACES: f64 = 0.9;

/// A coordinate that is the same at several vertices and far from those of all others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ValueApart {
    /// Along which axis: 0, 1 or 2.
    pub axis: usize,
    /// The value, in the unit of the input.
    pub value: f64,
    /// How many vertices have it.
    pub vertices: usize,
    /// The least and the largest of the others.
    pub others: [f64; 2],
}

impl SurfaceMesh {
    /// The value that is apart from all others along an axis over which the surface has heights, if there is one.
    ///
    /// ```
    /// use planish_core::{mesh::TriangleSoup, repair, shapes};
    ///
    /// let terrain = shapes::disk(9);
    /// let mut points = terrain.points().to_vec();
    /// points[..3].iter_mut().for_each(|p| p[2] = -9999.0);
    /// let soup = TriangleSoup::new(points, terrain.triangles().to_vec())?;
    /// let mesh = repair(&soup, &repair::Settings::default())?.mesh;
    /// let no_data = mesh.value_apart().expect("nothing else is near -9999");
    /// assert_eq!((no_data.axis, no_data.value, no_data.vertices), (2, -9999.0, 3));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn value_apart(&self) -> Option<ValueApart> {
        (0..3).find_map(|axis| value_apart(self.points(), axis).filter(|_| has_heights(self.points(), axis)))
    }
}

fn value_apart(points: &[Vec3], axis: usize) -> Option<ValueApart> {
    let mut values: Vec<f64> = points.iter().map(|p| p[axis]).collect();
    values.sort_unstable_by(f64::total_cmp);
    let (least, largest) = (*values.first()?, *values.last()?);
    // Sorted, all that have the least value come first, and all that have the largest one come last.
    let below = values.partition_point(|v| *v <= least);
    let above = values.partition_point(|v| *v < largest);
    let apart = |value: f64, vertices: usize, others: &[f64]| {
        let others = [*others.first()?, *others.last()?];
        let gap = (others[0] - value).max(value - others[1]);
        let is_apart = vertices >= SEVERAL && gap > FAR * (others[1] - others[0]) && others[1] > others[0];
        is_apart.then_some(ValueApart { axis, value, vertices, others })
    };
    apart(least, below, &values[below..]).or_else(|| apart(largest, values.len() - above, &values[..above]))
}

/// Whether nearly all points lie over places of their own in the plane across the axis.
fn has_heights(points: &[Vec3], axis: usize) -> bool {
    let mut places: Vec<[u64; 2]> = points.iter().map(|p| [1, 2].map(|k| p[(axis + k) % 3].to_bits())).collect();
    places.sort_unstable();
    places.dedup();
    places.len() as f64 >= OWN_PLACES * points.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heights over a grid; some of them stand for no data.
    fn terrain(no_data: f64, holes: usize) -> Vec<Vec3> {
        let height = |i: usize| if i.is_multiple_of(7) && i / 7 < holes { no_data } else { 600.0 + (i as f64).sin() };
        (0..100).map(|i| [(i % 10) as f64, (i / 10) as f64, height(i)]).collect()
    }

    #[test]
    fn no_data_is_found_and_what_is_near_or_single_is_not() {
        for value in [-9999.0, -32768.0, 1e20] {
            let found = value_apart(&terrain(value, 5), 2).expect("apart");
            assert_eq!((found.value, found.vertices), (value, 5));
            assert!(found.others[0] > 598.0 && found.others[1] < 602.0);
        }
        assert_eq!(value_apart(&terrain(580.0, 5), 2), None, "ten times the range is 20");
        assert_eq!(value_apart(&terrain(-9999.0, 1), 2), None, "a peak");
        assert_eq!(value_apart(&terrain(-9999.0, 0), 2), None);
        assert_eq!(value_apart(&terrain(-9999.0, 5), 0), None);
    }

    #[test]
    fn a_nail_is_no_surface_of_heights() {
        let ring = |z: f64| (0..8).map(move |i| f64::from(i).sin_cos()).map(move |(s, c)| [c, s, z]);
        let nail: Vec<Vec3> = ring(0.0).chain(ring(0.1)).chain(ring(20.0)).collect();
        assert!(value_apart(&nail, 2).is_some() && !has_heights(&nail, 2));
        assert!(has_heights(&terrain(-9999.0, 5), 2));
    }
}
