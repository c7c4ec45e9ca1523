//! What a caller may choose, for all stages.

pub use crate::decompose::BoundaryShape;
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The order of the elements.
    pub order: Order,
    /// How the surface is repaired.
    pub repair: repair::Settings,
    /// What charts must respect.
    pub decompose: decompose::Settings,
    /// How many times as many triangles a chart may get where its quadratic map is too poor; none: no triangle is bisected.
    pub refine: Option<u32>,
    /// The length of edges, in the unit of the input, of a mesh that is to be made through the atlas; none: that of the
    /// input (see [`crate::mesh::SurfaceMesh::default_size`]). It decides which corners of the shape are ends of curves:
    /// of those that are nearer together than three quarters of it, one. Maps do not depend on it. Finite, positive.
    pub size: Option<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        let ChartSettings { order, decompose, refine } = ChartSettings::default();
        Self { order, repair: repair::Settings::default(), decompose, refine, size: None }
    }
}

/// How many times as many triangles a chart may get, unless another number is asked for.
const REFINE: u32 = 4;

/// A setting is out of its range.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{name} is {value}, and must be {range}")]
pub struct OutOfRange {
    /// The setting.
    pub name: &'static str,
    /// What was given.
    pub value: f64,
    /// What may be given.
    pub range: &'static str,
}

/// Refuses a value that is not in its range; not-a-number is in none.
fn refuse_unless(is_in: bool, name: &'static str, value: f64, range: &'static str) -> Result<(), OutOfRange> {
    if is_in { Ok(()) } else { Err(OutOfRange { name, value, range }) }
}

impl Settings {
    /// Checks that every setting is in its range, as those who use them rely on it.
    ///
    /// ```
    /// let mut settings = planish_core::Settings::default();
    /// assert!(settings.check().is_ok());
    /// settings.repair.weld = f64::NAN;
    /// assert_eq!(settings.check().unwrap_err().to_string(), "weld is NaN, and must be from 0 to 0.01");
    /// ```
    ///
    /// # Errors
    /// [`OutOfRange`], for the first one that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        let weld = self.repair.weld;
        refuse_unless((0.0..=0.01).contains(&weld), "weld", weld, "from 0 to 0.01")?;
        if let Some(size) = self.size {
            refuse_unless(size.is_finite() && size > 0.0, "size", size, "finite and positive")?;
        }
        self.of_charts().check()
    }

    /// What the maps of charts depend on.
    pub fn of_charts(&self) -> ChartSettings {
        ChartSettings { order: self.order, decompose: self.decompose, refine: self.refine }
    }
}

/// What the map of a chart depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChartSettings {
    /// The order of the elements.
    pub order: Order,
    /// What charts must respect: one that does not is split.
    pub decompose: decompose::Settings,
    /// As in [`Settings`].
    pub refine: Option<u32>,
}

impl Default for ChartSettings {
    fn default() -> Self {
        Self { order: Order::default(), decompose: decompose::Settings::default(), refine: Some(REFINE) }
    }
}

impl ChartSettings {
    /// As [`Settings::check`].
    ///
    /// # Errors
    /// [`OutOfRange`].
    pub fn check(&self) -> Result<(), OutOfRange> {
        let decompose::Settings { max_area_ratio, max_triangles, feature_angle, .. } = self.decompose;
        refuse_unless(max_area_ratio >= 10.0, "max_area_ratio", max_area_ratio, "at least 10")?;
        refuse_unless(max_triangles >= 1, "max_triangles", max_triangles as f64, "at least 1")?;
        refuse_unless(self.refine != Some(0), "refine", 0.0, "at least 1, or off")?;
        let angle = feature_angle.unwrap_or(90.0);
        refuse_unless(angle > 0.0 && angle < 180.0, "feature_angle", angle, "between 0 and 180 degrees")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whatever_is_out_of_range_is_named() {
        let with = |change: fn(&mut Settings)| {
            let mut settings = Settings::default();
            change(&mut settings);
            settings.check().map_err(|refused| refused.name)
        };
        assert_eq!(with(|_| {}), Ok(()));
        assert_eq!(with(|s| s.decompose.max_area_ratio = f64::INFINITY), Ok(()));
        assert_eq!(with(|s| s.decompose.max_area_ratio = 0.0), Err("max_area_ratio"));
        assert_eq!(with(|s| s.decompose.max_area_ratio = f64::NAN), Err("max_area_ratio"));
        assert_eq!(with(|s| s.decompose.max_triangles = 0), Err("max_triangles"));
        assert_eq!(with(|s| s.decompose.feature_angle = Some(-10.0)), Err("feature_angle"));
        assert_eq!(with(|s| s.decompose.feature_angle = Some(f64::NAN)), Err("feature_angle"));
        assert_eq!(with(|s| s.repair.weld = 0.5), Err("weld"));
        assert_eq!(with(|s| s.size = Some(0.0)), Err("size"));
        assert_eq!(with(|s| s.size = Some(f64::INFINITY)), Err("size"));
    }
}
