//! From a soup of triangles to certified maps, and what there is to know of them.
//!
//! `cargo run --release -p planish-core --example map_a_soup`

use planish_core::mesh::{SoupError, TriangleSoup};
use planish_core::monitor::NoMonitor;
use planish_core::{Settings, parametrize};

/// A hilly square of `n` by `n` smaller ones, each of two triangles, as a digital elevation model gives it.
fn terrain(n: u32) -> Result<TriangleSoup, SoupError> {
    let height = |x: f64, y: f64| 0.3 * (5.0 * x).sin() * (4.0 * y).cos();
    let at = |k: u32| f64::from(k) / f64::from(n);
    let mut points = Vec::new();
    for j in 0..=n {
        for i in 0..=n {
            points.push([at(i), at(j), height(at(i), at(j))]);
        }
    }
    let mut triangles = Vec::new();
    for j in 0..n {
        for i in 0..n {
            // The corners of the square, counter-clockwise from the lower left one.
            let a = j * (n + 1) + i;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriangleSoup::new(points, triangles)
}

/// Maps the terrain and prints where some of its points go.
///
/// # Errors
/// None: the terrain is sound.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let atlas = parametrize(&terrain(24)?, &Settings::default(), &NoMonitor)?;
    for certified in atlas.charts() {
        let (chart, map) = (certified.chart(), certified.map());
        let proof = map.certificate();
        println!("chart {}: {} triangles, {} holes", certified.id(), chart.triangles().len(), chart.holes().len());
        println!("  proven valid: {} by bounds, {} exactly", proof.by_bounds, proof.by_exact);
        // Nodes are the vertices of the chart, then the middles of its edges.
        for v in 0..3 {
            println!("  {:?} is mapped to {:?}", chart.points()[v], map.map().nodes[v].uv());
        }
        assert_eq!(proof.by_bounds + proof.by_exact, chart.triangles().len());
    }
    for curve in atlas.seams().curves() {
        let what = if curve.is_open() { "open boundary" } else { "seam" };
        println!("curve {}: {what}, {:.3} long", curve.id(), curve.length());
    }
    assert_eq!(atlas.charts().len(), 1, "hills are no reason to cut");
    Ok(())
}
