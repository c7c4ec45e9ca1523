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
