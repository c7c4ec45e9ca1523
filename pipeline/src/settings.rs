//! What a caller may choose, for all stages.

use crate::{decompose, repair};

/// The order of the finite elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Order {
    /// Linear: mid-edge nodes stay in the middle of straight edges.
    Linear,
    /// Quadratic: curved triangles.
    #[default]
    Quadratic,
}

/// What a caller may choose. The default is what is right for nearly every surface.
///
/// ```
/// use planish_core::{Order, Settings};
///
/// // Linear elements, and charts that stretch no area a thousand times more than another.
/// let mut settings = Settings { order: Order::Linear, ..Settings::default() };
/// settings.decompose.max_area_ratio = 1e3;
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Settings {
    /// The order of the elements.
    pub order: Order,
    /// How the surface is repaired.
    pub repair: repair::Settings,
    /// What charts must respect.
    pub decompose: decompose::Settings,
    /// The length of edges, in the unit of the input, of a mesh that is to be made through the atlas; none: that of the
    /// input (see [`crate::mesh::SurfaceMesh::default_size`]). It decides which corners of the shape are ends of curves:
    /// of those that are nearer together than three quarters of it, one. Maps do not depend on it. Finite, positive.
    pub size: Option<f64>,
}

impl Settings {
    /// What the maps of charts depend on.
    pub fn of_charts(&self) -> ChartSettings {
        ChartSettings { order: self.order, decompose: self.decompose }
    }
}

/// What the map of a chart depends on.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ChartSettings {
    /// The order of the elements.
    pub order: Order,
    /// What charts must respect: one that does not is split.
    pub decompose: decompose::Settings,
}
