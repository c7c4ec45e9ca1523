//! What a surface may suffer from although it is certified: told to people, and in report.json.

use planish_core::mesh::{CoordinateSteps, FEW_STEPS, ValueApart};
use planish_core::repair::{Repaired, Sample};
use serde::{Deserialize, Serialize};

/// A share of the triangles above this is nearly all.
const NEARLY_ALL: f64 = 0.9;

/// What kind of warning: a stable list that scripts may rely on (see docs/report.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Doubt {
    /// Boundary vertices lie on boundary edges.
    TJunctions,
    /// Coordinates lie in steps beside which edges are short.
    CoarseCoordinates,
    /// Nearly all triangles were mollified.
    Mollified,
    /// A coordinate is far from all others at several vertices.
    ValueApart,
}

/// A warning, told.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Warning {
    /// What kind.
    pub code: Doubt,
    /// What may be wrong, where, and what to do.
    pub message: String,
}

impl Warning {
    fn new(code: Doubt, message: String) -> Self {
        Self { code, message }
    }
}

/// What is doubtful about a repaired surface.
pub fn warnings(found: &Repaired) -> Vec<Warning> {
    let left = Some(&found.report.t_junctions_left).filter(|left| left.count > 0);
    let value = found.mesh.value_apart();
    let triangles = found.mesh.triangles().len();
    let mollified = found.report.mollified_triangles.count;
    let nearly_all = mollified as f64 > NEARLY_ALL * triangles as f64;
    let found = [
        left.map(|left| Warning::new(Doubt::TJunctions, t_junctions(left))),
        found.mesh.coarse_steps().map(|steps| Warning::new(Doubt::CoarseCoordinates, coarse_coordinates(&steps))),
        value.map(|value| Warning::new(Doubt::ValueApart, value_apart(&value))),
        nearly_all.then(|| Warning::new(Doubt::Mollified, all_mollified(mollified, triangles))),
    ];
    found.into_iter().flatten().collect()
}

fn axis(k: usize) -> char {
    ['x', 'y', 'z'][k % 3]
}

fn t_junctions(left: &Sample) -> String {
    format!(
        "{} boundary vertices (after welding: {}) lie on boundary edges and stay open: sides that face each other (walls of \
         a thin gap), or that only touch there; if the surface should be closed there, unite the solids before the export, \
         or cut both sides at the same vertices",
        left.count,
        listed(left)
    )
}

/// The first ids of what was found.
fn listed(found: &Sample) -> String {
    let ids: Vec<String> = found.first.iter().map(ToString::to_string).collect();
    ids.join(", ") + if found.count > found.first.len() { ", ..." } else { "" }
}

fn coarse_coordinates(steps: &CoordinateSteps) -> String {
    format!(
        "coordinates lie in steps of {} along {} (numbers of 32 bits, far from the origin), and {} of {} edges are shorter than \
         {FEW_STEPS} steps: their directions are rounded away; export relative to a local origin, or in double precision \
         (OBJ, PLY, VTK or MSH)",
        steps.largest(),
        axis(steps.axis()),
        steps.short_edges,
        steps.edges
    )
}

fn value_apart(found: &ValueApart) -> String {
    let ValueApart { axis: k, value, vertices, others: [least, largest] } = *found;
    format!(
        "{} is {} at {vertices} vertices and from {} to {} at all others: if {} stands for \"no data\", leave out the \
         triangles at these vertices, or give them heights",
        axis(k),
        plain(value),
        plain(least),
        plain(largest),
        plain(value)
    )
}

/// A coordinate as people write it: with the digits of 32 bits where it has no more.
fn plain(value: f64) -> String {
    let is_usual = value == 0.0 || (1e-3..1e7).contains(&value.abs());
    match (value as f32, is_usual) {
        (short, true) if f64::from(short) == value => short.to_string(),
        (short, false) if f64::from(short) == value => format!("{short:e}"),
        (_, true) => value.to_string(),
        (_, false) => format!("{value:e}"),
    }
}

fn all_mollified(mollified: usize, triangles: usize) -> String {
    format!(
        "{mollified} of {triangles} triangles are so thin or small beside the others that their areas cannot be told and were \
         made up: look for vertices far from all others, and check the unit and precision of the export"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use planish_core::mesh::TriangleSoup;
    use planish_core::{repair, shapes};

    /// A terrain of heights, moved by `origin`, in 32 bits, with holes of this value.
    fn terrain(origin: [f64; 3], hole: Option<f64>) -> Vec<Doubt> {
        let flat = shapes::flat_disk(12);
        let height = |i: usize, [x, y]: [f64; 2]| hole.filter(|_| i % 50 == 7).unwrap_or(x.sin() + y * x);
        let point = |(i, p): (usize, &[f64; 3])| [10.0 * p[0], 10.0 * p[1], height(i, [p[0], p[1]])];
        let moved = |p: [f64; 3]| [0, 1, 2].map(|k| f64::from((p[k] + origin[k]) as f32));
        let points = flat.points().iter().enumerate().map(point).map(moved).collect();
        let soup = TriangleSoup::new(points, flat.triangles().to_vec()).expect("sound");
        codes(&soup)
    }

    fn codes(soup: &TriangleSoup) -> Vec<Doubt> {
        warnings(&repair(soup, &Default::default()).expect("a surface")).iter().map(|w| w.code).collect()
    }

    #[test]
    fn what_is_doubtful_is_told_and_its_sound_twin_is_not() {
        assert_eq!(terrain([0.0; 3], None), []);
        assert_eq!(terrain([0.0; 3], Some(-9999.0)), [Doubt::ValueApart]);
        assert_eq!(terrain([0.0; 3], Some(1e20)), [Doubt::ValueApart, Doubt::Mollified]);
        assert_eq!(terrain([400_000.0, 5_000_000.0, 0.0], None), [Doubt::CoarseCoordinates]);
    }

    #[test]
    fn vertices_on_edges_that_stay_open_are_told() {
        let touching = |x: f64| {
            let points =
                vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [x, 0.5, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
            TriangleSoup::new(points, vec![[0, 1, 2], [3, 4, 5]]).expect("sound")
        };
        assert_eq!(codes(&touching(1.0)), [Doubt::TJunctions]);
        assert_eq!(codes(&touching(1.1)), []);
    }

    #[test]
    fn messages_name_the_value_and_the_step() {
        let value = ValueApart { axis: 2, value: -32768.0, vertices: 37, others: [557.5, 644.75] };
        assert!(value_apart(&value).starts_with("z is -32768 at 37 vertices and from 557.5 to 644.75 at all others"));
        assert_eq!([f64::from(1e20_f32), 1e20, 0.1, 0.0].map(plain), ["1e20", "1e20", "0.1", "0"]);
        let steps = CoordinateSteps { step: [0.0, 0.5, 0.0], short_edges: 7, edges: 9 };
        assert!(coarse_coordinates(&steps).starts_with("coordinates lie in steps of 0.5 along y"));
    }
}
