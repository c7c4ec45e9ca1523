//! A soup: triangles as a file gives them, with nothing promised but finite coordinates and indices in range.

use crate::space::Vec3;

/// Coordinates beyond this are refused: their squares would overflow.
const LARGEST: f64 = 1e100;

/// Points and triangles as read. Every coordinate is finite, every index in range, and there is a triangle.
#[derive(Clone, Debug, PartialEq)]
pub struct TriangleSoup {
    points: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
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
    /// A coordinate is not a number, infinite, or too large to be squared.
    #[error("coordinate {axis} of point {point} is {value}; every coordinate must be finite and below 1e100")]
    NotFinite {
        /// Position of the point in the file, from 0.
        point: usize,
        /// `x`, `y` or `z`.
        axis: char,
        /// The value found.
        value: f64,
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

    /// Checks that `points` and `triangles` are a soup.
    ///
    /// # Errors
    /// The first defect found, see [`SoupError`].
    pub fn new(points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Result<Self, SoupError> {
        let (count, limit) = (points.len(), Self::MAX_TRIANGLES);
        if triangles.len() > limit || count > 3 * limit {
            return Err(SoupError::TooLarge { triangles: triangles.len(), points: count, limit });
        }
        if let Some(point) = points.iter().position(|p| !p.iter().fold(true, |sound, c| sound & is_sound(*c))) {
            return Err(not_finite(point, points[point]));
        }
        // One number is compared per triangle: the largest.
        if let Some(triangle) = triangles.iter().position(|[a, b, c]| *a.max(b).max(c) as usize >= count) {
            let index = triangles[triangle].into_iter().find(|i| *i as usize >= count).unwrap_or_default();
            return Err(SoupError::IndexOutOfRange { triangle, index, points: count });
        }
        if triangles.is_empty() {
            return Err(SoupError::NoTriangles { points: count });
        }
        Ok(Self { points, triangles })
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

/// What is wrong with a point.
fn not_finite(point: usize, p: Vec3) -> SoupError {
    let at = p.iter().position(|c| !is_sound(*c)).unwrap_or_default();
    SoupError::NotFinite { point, axis: ['x', 'y', 'z'][at], value: p[at] }
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
            broken[3][1] = bad;
            let found = TriangleSoup::new(broken, triangles.clone());
            assert!(matches!(found, Err(SoupError::NotFinite { point: 3, axis: 'y', .. })), "{found:?}");
        }
    }
}
