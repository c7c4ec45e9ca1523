//! Is a map that somebody else made one-to-one? The certifier asks nothing but the numbers.
//!
//! `cargo run --release -p planish-core --example prove_a_foreign_map`

use planish_core::certify::{Error, PlanarMap, prove};
use planish_core::grid::GridPoint;

/// A fan of `n` curved triangles around the origin, their outer edges on the unit circle.
fn fan(n: u32) -> PlanarMap {
    let at = |turn: f64, radius: f64| {
        let (sin, cos) = (std::f64::consts::TAU * turn / f64::from(n)).sin_cos();
        [0.9 * radius * cos, 0.9 * radius * sin]
    };
    // The middle, then of each triangle: its first vertex on the circle, the middle of its arc, the middle of its spoke.
    // Vertices lie on a grid in which the middles of edges are exact.
    let mut nodes = vec![GridPoint::vertex([0.0; 2])];
    for k in 0..n {
        let turn = f64::from(k);
        let vertex = GridPoint::vertex(at(turn, 1.0));
        nodes.extend([vertex, GridPoint::mid(at(turn + 0.5, 1.0)), nodes[0].midpoint(vertex)]);
    }
    let cell = |k: u32| {
        let (first, second) = (1 + 3 * k, 1 + 3 * ((k + 1) % n));
        // Three vertices, then the middles of the edges 01, 12, 20.
        [0, first, second, first + 2, first + 1, second + 2]
    };
    PlanarMap { cells: (0..n).map(cell).collect(), nodes, hole_centres: vec![] }
}

/// Proves a map, and shows what is said of two that are none.
///
/// # Errors
/// None: the first map is one-to-one.
pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let proven = prove(fan(8))?;
    let proof = proven.certificate();
    println!("one-to-one: {} triangles, jacobian above {:.3}", proven.map().cells.len(), proof.det_lower_bound);
    assert!(proof.det_lower_bound > 0.0);

    // The middle of a spoke, moved over to the next one but one: a triangle folds.
    let mut folded = fan(8);
    folded.nodes[3] = GridPoint::mid([0.0, 0.45]);
    match prove(folded) {
        Err(error @ Error::InvalidTriangles { .. }) => println!("not one-to-one: {error}"),
        other => return Err(format!("it must be found folded: {other:?}").into()),
    }

    // A fan that goes around twice: every triangle is valid, and yet each point has two originals.
    let mut twice = fan(8);
    let turn = |k: u32| std::f64::consts::TAU * 2.0 * f64::from(k) / 8.0;
    for k in 0..8 {
        let on_circle = |angle: f64| [0.9 * angle.cos(), 0.9 * angle.sin()];
        let vertex = GridPoint::vertex(on_circle(turn(k)));
        let arc = GridPoint::mid(on_circle(turn(k) + 0.5 * turn(1)));
        let first = 1 + 3 * k as usize;
        twice.nodes.splice(first..first + 3, [vertex, arc, GridPoint::default().midpoint(vertex)]);
    }
    match prove(twice) {
        Err(error) => println!("not one-to-one: {error}"),
        Ok(_) => return Err("it goes around twice".into()),
    }
    Ok(())
}
