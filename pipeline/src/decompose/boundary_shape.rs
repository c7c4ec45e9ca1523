//! The boundary for which charts are made.

/// Which boundary the map of a chart has in the plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BoundaryShape {
    /// That of a conformal map with a free boundary, where there is one that is simple and scales areas evenly (see
    /// [`crate::map::natural`]); else the circle.
    #[default]
    Natural,
    /// The unit circle, by arc length: what the paper does. Corners of the boundary are stretched, and what is long.
    Circle,
}

impl BoundaryShape {
    /// The default of [`super::Settings::max_area_ratio`].
    ///
    /// 3,000 for natural boundaries: with 1,000 face_bff falls into 5 charts instead of 3, and cad_rear_case into 76 instead of
    /// 51; with 10,000 Gmsh loses a sixth of a chart of lucy_100k, and takes 37 s instead of 6 for soccerball_g31. A disk has a
    /// larger ratio of its own: 1e6.
    pub fn max_area_ratio(self) -> f64 {
        match self {
            Self::Natural => 3e3,
            Self::Circle => 1e6,
        }
    }
}
