//! A soup: triangles as a file gives them, with nothing promised but finite coordinates and indices in range.
//!
//! Files hold points that no triangle uses, and what such a point has for coordinates is no defect of the surface: it
//! refuses nothing, and stands somewhere else instead, see [`TriangleSoup::new`].

use crate::vec3::Vec3;
use std::sync::Arc;

/// Coordinates beyond this are refused: their squares would overflow.
const LARGEST: f64 = 1e100;

/// Points and triangles as read. Every coordinate is finite, every index in range, and there is a triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleSoup {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    labels: Arc<[u32]>,
    sizes: Vec<f64>,
}

/// Why points and triangles are no soup.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SoupError {
    /// There is no triangle.
    #[error(
        "the file holds no triangle ({points} points); {}",
        if *points > 0 {
            "a cloud of points must be made a surface first, with MeshLab for example; a surface must be exported as triangles"
        } else {
            "export the surface as triangles"
        }
    )]
    NoTriangles {
        /// How many points there were.
        points: usize,
    },
    /// Corners of triangles have coordinates that are no number, infinite, or too large to be squared.
    #[error(
        "{axis} of point {point} (from 0) is {value}, and triangle {triangle} has a corner there; in all {points} {} of this sort (no number, infinite, or above 1e100), in {triangles} {}; repair the exporting model, or delete these triangles",
        if *points == 1 { "corner is" } else { "corners are" },
        if *triangles == 1 { "triangle" } else { "triangles" }
    )]
    NotFinite {
        /// Position of the first of these points in the file, from 0.
        point: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
        /// The first triangle with this corner, from 0.
        triangle: usize,
        /// How many such points are corners.
        points: usize,
        /// How many triangles have such corners.
        triangles: usize,
    },
    /// A triangle names a point that does not exist.
    #[error("triangle {triangle} uses point {index}, but there are only {points} points")]
    IndexOutOfRange {
        /// Position of the triangle in the file, from 0.
        triangle: usize,
        /// The point it names, from 0.
        index: u32,
        /// How many points there are.
        points: usize,
    },
    /// There are more elements than 32-bit ids can name.
    #[error("{triangles} triangles and {points} points exceed the limit of {limit} triangles; split the file")]
    TooLarge {
        /// How many triangles there were.
        triangles: usize,
        /// How many points there were.
        points: usize,
        /// The largest number of triangles.
        limit: usize,
    },
}

impl TriangleSoup {
    /// The largest number of triangles: half-edges and nodes of all of them must fit 32-bit ids.
    pub const MAX_TRIANGLES: usize = 300_000_000;

    /// Checks that `points` and `triangles` are a soup. Points that no triangle uses may have any coordinates: where these
    /// are not finite or too large, the point is moved to a place where no other is.
    ///
    /// # Errors
    /// The first defect found, see [`SoupError`].
    ///
    /// ```
    /// use planish_core::mesh::{SoupError, TriangleSoup};
    ///
    /// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [f64::NAN; 3]];
    /// let soup = TriangleSoup::new(points.clone(), vec![[0, 1, 2]])?;
    /// assert_eq!(soup.points().len(), 4, "what no triangle uses keeps its number");
    ///
    /// let missing = TriangleSoup::new(points.clone(), vec![[0, 1, 4]]);
    /// assert_eq!(missing, Err(SoupError::IndexOutOfRange { triangle: 0, index: 4, points: 4 }));
    /// let refused = TriangleSoup::new(points, vec![[0, 1, 2], [0, 1, 3]]);
    /// assert!(matches!(refused, Err(SoupError::NotFinite { point: 3, axis: 'x', triangle: 1, .. })));
    /// # Ok::<(), SoupError>(())
    /// ```
    pub fn new(mut points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, SoupError> {
        let (count, limit) = (points.len(), Self::MAX_TRIANGLES);
        if triangles.len() > limit || count > 3 * limit {
            return Err(SoupError::TooLarge { triangles: triangles.len(), points: count, limit });
        }
        // One number is compared per triangle: the largest.
        if let Some(triangle) = triangles.iter().position(|[a, b, c]| *a.max(b).max(c) as usize >= count) {
            let index = triangles[triangle].into_iter().find(|i| *i as usize >= count).unwrap_or_default();
            return Err(SoupError::IndexOutOfRange { triangle, index, points: count });
        }
        if triangles.is_empty() {
            return Err(SoupError::NoTriangles { points: count });
        }
        if !points.iter().all(Self::may_hold) {
            refuse_corners(&points, &triangles)?;
            move_unsound(&mut points);
        }
        Ok(Self { points, triangles, labels: Arc::default(), sizes: Vec::new() })
    }

    /// The same soup, each triangle with a label, whatever that means to the caller. No chart crosses the border between two
    /// labels: it becomes a seam.
    ///
    /// ```
    /// use planish_core::monitor::NoMonitor;
    /// use planish_core::{Settings, parametrize, shapes};
    ///
    /// // A disk whose left half has another name than its right one.
    /// let soup = shapes::flat_disk(4);
    /// let middle = |t: &[u32; 3]| t.iter().map(|v| soup.points()[*v as usize][0]).sum::<f64>();
    /// let labels = soup.triangles().iter().map(|t| u32::from(middle(t) > 0.0)).collect();
    /// let atlas = parametrize(&soup.clone().with_labels(labels), &Settings::default(), &NoMonitor)?;
    /// assert_eq!(atlas.charts().len(), 2);
    /// assert_ne!(atlas.label(atlas.charts()[0].id()), atlas.label(atlas.charts()[1].id()));
    /// # Ok::<(), planish_core::Error>(())
    /// ```
    ///
    /// # Panics
    /// If there is not one label for every triangle.
    pub fn with_labels(self, labels: Vec<u32>) -> Self {
        assert_eq!(labels.len(), self.triangles.len(), "a label for every triangle");
        Self { labels: labels.into(), ..self }
    }

    /// The labels of the triangles; none at all where they have none.
    pub fn labels(&self) -> &Arc<[u32]> {
        &self.labels
    }

    /// The same soup, each point with the length of edges that a mesh shall have there, in the unit of the coordinates. What is
    /// no length ([`Self::is_size`]) asks for nothing. Surfaces tell it by [`SurfaceMesh::given_size`].
    ///
    /// ```
    /// use planish_core::topology::VertexId;
    /// use planish_core::{repair, shapes};
    ///
    /// let soup = shapes::flat_disk(4);
    /// let sizes = soup.points().iter().map(|[x, ..]| 0.1 * x).collect();
    /// let mesh = repair(&soup.with_sizes(sizes), &repair::Settings::default())?.mesh;
    /// for (v, [x, ..]) in mesh.points().iter().enumerate() {
    ///     assert_eq!(mesh.given_size(VertexId::at(v)), (*x > 0.0).then_some(0.1 * x));
    /// }
    /// # Ok::<(), repair::Error>(())
    /// ```
    ///
    /// # Panics
    /// If there is not one size for every point.
    ///
    /// [`SurfaceMesh::given_size`]: super::SurfaceMesh::given_size
    pub fn with_sizes(self, mut sizes: Vec<f64>) -> Self {
        assert_eq!(sizes.len(), self.points.len(), "a size for every point");
        for size in sizes.iter_mut().filter(|size| !Self::is_size(**size)) {
            *size = f64::INFINITY;
        }
        Self { sizes, ..self }
    }

    /// Whether a number is a length of edges: it is finite and positive, and none of those so small that they lose digits.
    pub fn is_size(size: f64) -> bool {
        size.is_normal() && size > 0.0
    }

    /// The sizes at the points, infinite where nothing is asked for; none at all where they have none.
    pub fn sizes(&self) -> &[f64] {
        &self.sizes
    }

    /// Whether a point may be the corner of a triangle: its coordinates are numbers that are not too large.
    #[inline]
    pub fn may_hold(point: &Vec3) -> bool {
        point.iter().fold(true, |sound, c| sound & is_sound(*c))
    }

    /// The points, in the order of the file.
    pub fn points(&self) -> &[Vec3] {
        &self.points
    }

    /// The triangles, as indices into the points, in the order of the file.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}

/// Whether a coordinate is a number that is not too large.
fn is_sound(c: f64) -> bool {
    c.abs() <= LARGEST
}

/// Refuses triangles with unsound corners, and counts all of them.
fn refuse_corners(points: &[Vec3], triangles: &[[u32; 3]]) -> Result<(), SoupError> {
    let is_unsound: Vec<bool> = points.iter().map(|p| !TriangleSoup::may_hold(p)).collect();
    // Per point the first triangle that has it for a corner, if it is unsound.
    let mut first: Vec<Option<u32>> = vec![None; points.len()];
    let mut refused = 0;
    for (triangle, corners) in (0..).zip(triangles) {
        let unsound = corners.map(|corner| corner as usize).into_iter().filter(|corner| is_unsound[*corner]);
        let mut is_refused = false;
        for corner in unsound {
            first[corner].get_or_insert(triangle);
            is_refused = true;
        }
        refused += usize::from(is_refused);
    }
    let Some((point, triangle)) = first.iter().enumerate().find_map(|(i, t)| Some((i, (*t)?))) else { return Ok(()) };
    let at = points[point].iter().position(|c| !is_sound(*c)).unwrap_or_default();
    Err(SoupError::NotFinite {
        point,
        axis: ['x', 'y', 'z'][at],
        value: points[point][at],
        triangle: triangle as usize,
        points: first.iter().flatten().count(),
        triangles: refused,
    })
}

/// Moves unsound points, none of which is a corner, each to a place of its own. Repair merges points that are equal: at the
/// origin, or at a corner, they would be counted as merged, and not as points without triangles, which they are. None is
/// left out, so that the others keep their numbers. Where they stand has no effect: what is measured of a surface
/// (bounding box, cracks) is measured at corners.
fn move_unsound(points: &mut [Vec3]) {
    for (k, point) in points.iter_mut().filter(|p| !TriangleSoup::may_hold(p)).enumerate() {
        *point = [LARGEST, LARGEST, k as f64];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square() -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
        (points, vec![[0, 1, 2], [0, 2, 3]])
    }

    #[test]
    fn a_sound_soup_is_accepted_and_its_broken_twins_are_not() {
        let (points, triangles) = square();
        assert!(TriangleSoup::new(points.clone(), triangles.clone()).is_ok());
        assert_eq!(TriangleSoup::new(points.clone(), vec![]), Err(SoupError::NoTriangles { points: 4 }));
        let mut broken = triangles.clone();
        broken[1][2] = 4;
        let error = SoupError::IndexOutOfRange { triangle: 1, index: 4, points: 4 };
        assert_eq!(TriangleSoup::new(points.clone(), broken), Err(error));
        for bad in [f64::NAN, f64::INFINITY, -1e101] {
            let mut broken = points.clone();
            broken[2][1] = bad;
            let found = TriangleSoup::new(broken.clone(), triangles.clone());
            let counts = "triangle 0 has a corner there; in all 1 corner is of this sort (no number, infinite, or above 1e100), in 2 triangles;";
            assert!(matches!(found, Err(SoupError::NotFinite { point: 2, axis: 'y', triangle: 0, .. })), "{found:?}");
            assert!(found.is_err_and(|e| e.to_string().contains(counts)));
            broken[3][0] = bad;
            let found = TriangleSoup::new(broken, vec![[0, 1, 3], [0, 1, 3]]);
            assert!(matches!(found, Err(SoupError::NotFinite { point: 3, points: 1, triangles: 2, .. })), "{found:?}");
        }
    }

    /// They are counted, wherever the corners are, and the numbers of the others stay.
    #[test]
    fn points_that_no_triangle_uses_may_have_any_coordinates() {
        for bad in [f64::NAN, f64::NEG_INFINITY, 1e300] {
            let (mut points, mut triangles) = square();
            points.insert(0, [bad; 3]);
            points.extend([[0.0, bad, 0.0], [bad; 3]]);
            triangles.iter_mut().flatten().for_each(|v| *v += 1);
            let soup = TriangleSoup::new(points, triangles.clone()).expect("no corner is broken");
            assert_eq!((soup.triangles(), soup.points()[1]), (&triangles[..], [0.0; 3]));
            assert!(soup.points().len() == 7 && soup.points().iter().flatten().all(|c| c.is_finite()));
            let repaired = crate::repair(&soup, &Default::default()).expect("a square");
            assert_eq!((repaired.report.unreferenced_points, repaired.report.welded), (3, 0));
            assert_eq!((repaired.mesh.points().len(), repaired.mesh.points()[0]), (4, [0.0; 3]));
        }
    }
}
