//! How much a map distorts: the fields of its triangles, and what they add up to.
//!
//! `cargo run --release -p planish-core --example measure_a_map`

use planish_core::monitor::NoMonitor;
use planish_core::{BoundaryShape, Order, Settings, decompose, parametrize, shapes};
use std::f64::consts::PI;

/// Maps a hill to the disk by linear and by quadratic elements, and prints how both distort it.
///
/// # Errors
/// None: the surface is sound.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    for order in [Order::Linear, Order::Quadratic] {
        let settings =
            Settings { order, decompose: decompose::Settings::of(BoundaryShape::Circle), ..Settings::default() };
        let atlas = parametrize(&shapes::disk(12), &settings, &NoMonitor)?;
        let certified = &atlas.charts()[0];
        let summary = certified.distortion();
        println!("{order:?} elements:");
        println!("  half of the area is stretched no more than {:.4} in one direction", summary.conformal_median);
        println!(
            "  99 % no more than {:.4}; largest over least area scale: {:.2}",
            summary.conformal_p99, summary.area_ratio
        );

        // Area scales are areas in the plane per area in space, so they add up to the area of the image.
        let in_plane = |(f, fields): (usize, &planish_core::measure::distortion::CellFields)| {
            fields.area_scale * certified.chart().area(f)
        };
        let image: f64 = certified.fields().iter().enumerate().map(in_plane).sum();
        println!("  the image has {:.6} of the area of the unit disk", image / PI);
        // Arcs of parabolas follow a circle better than chords do.
        let missing = if order == Order::Linear { 1e-2 } else { 1e-3 };
        assert!((1.0 - missing..1.0).contains(&(image / PI)), "{}", image / PI);

        if let Some(report) = &certified.provenance().untangle {
            let excess = report.energy / report.energy_unconstrained - 1.0;
            println!("  Dirichlet energy {:.6}, {excess:.1e} above that of the harmonic map", report.energy);
        }
    }
    Ok(())
}
