//! How long the edges of a mesh are to be, place by place: what narrow places, spikes and the user ask for, as one field.

use super::narrow::{self, Places};
use super::{Sizes, Wanted};
use crate::formats::gmsh::Algorithms;
use planish_core::CertifiedAtlas;
use planish_core::measure::bends::bends;
use planish_core::measure::sizes::{SizeField, SizedPlace, SizedTriangle, TOLD_UP_TO};
use planish_core::measure::spikes::spikes;
use planish_core::mesh::SurfaceMesh;
use planish_core::subdivide::LinearAtlas;
use planish_core::topology::VertexId;
use planish_core::vec3::Vec3;
use std::f64::consts::PI;

/// An edge over a bend of curvature k with the deviation D is sqrt(6 D / k) long: the middle of an equilateral triangle on a
/// sphere is off by k l^2 / 6. Edges of a mesh are up to 1.4 times as long as they are asked to be, and curvature is a mean.
const TOO_LONG: f64 = 1.5;

/// Where elements are smaller than everywhere else.
#[derive(Default)]
pub(super) struct Varying {
    /// The sizes on triangles, as far as they are below the largest ones; empty where sizes do not vary.
    pub triangles: Vec<SizedTriangle>,
    /// The least size.
    pub least: Option<f64>,
    /// How many curves along narrow places have smaller elements.
    pub narrow_curves: usize,
    /// At how many narrow places there are.
    pub narrow_places: usize,
    /// At how many places in spikes and pits.
    pub spikes: usize,
    /// Where smaller elements are needed than may be, and how small: the first of these.
    pub held: Vec<SizedPlace>,
    /// How many such places there are.
    pub held_places: usize,
}

/// So many of the places are told where smaller elements are needed than may be.
const TOLD: usize = 8;

/// The sizes of a mesh that is wanted.
pub(super) fn varying(
    atlas: &CertifiedAtlas,
    linear: &LinearAtlas,
    algorithms: &Algorithms,
    wanted: &Wanted,
) -> Varying {
    let (mesh, charts, sizes) = (atlas.mesh(), atlas.charts(), &wanted.sizes);
    let Places { sized, curves, gaps } = narrow::places(mesh, charts, atlas.seams(), &algorithms.adapted, sizes.size);
    let thin = spikes(mesh, charts, linear.curvatures(), sizes.size);
    let mut found = Varying { narrow_curves: curves, narrow_places: gaps, spikes: thin.len(), ..Varying::default() };
    let mut places = sized;
    places.extend(thin.iter().map(|s| SizedPlace { at: s.centre, size: s.size, reach: s.radius }));
    places.extend(asked_for(atlas, sizes));
    hold(&mut places, sizes, &mut found);
    if places.is_empty() {
        return found;
    }
    found.least = places.iter().map(|place| place.size).reduce(f64::min);
    let field = SizeField::new(places, sizes.gradation);
    let surface = (0..mesh.triangles().len()).map(|face| asked_between(mesh, face, sizes));
    found.triangles = field.sampled(surface, TOLD_UP_TO * sizes.size);
    found
}

/// Holds sizes above the least one that may be, and keeps those below the size of all.
fn hold(places: &mut Vec<SizedPlace>, sizes: &Sizes, found: &mut Varying) {
    for place in places.iter_mut().filter(|place| place.size < sizes.min) {
        found.held_places += 1;
        if found.held.len() < TOLD {
            found.held.push(*place);
        }
        place.size = sizes.min;
    }
    places.retain(|place| place.size < sizes.size);
}

/// What the user asks for, at every vertex.
fn asked_for(atlas: &CertifiedAtlas, sizes: &Sizes) -> Vec<SizedPlace> {
    let mesh = atlas.mesh();
    let mut places = Vec::new();
    if sizes.per_turn.is_some() || sizes.deviation.is_some() {
        let bends = bends(mesh, atlas.charts(), atlas.seams());
        let place = |(at, k): (&Vec3, &f64)| SizedPlace { at: *at, size: size_at(*k, sizes), reach: 0.0 };
        places.extend(mesh.points().iter().zip(&bends).map(place));
    }
    for (v, at) in mesh.points().iter().enumerate() {
        places.extend(mesh.given_size(VertexId::at(v)).map(|size| SizedPlace { at: *at, size, reach: 0.0 }));
    }
    // What asks for no less than the size of all asks for nothing; numbers that are none are passed over.
    places.retain(|place| place.size > 0.0 && place.size < sizes.size);
    places
}

/// A triangle with the sizes that the input asks for at its corners, and in between.
fn asked_between(mesh: &SurfaceMesh, face: usize, sizes: &Sizes) -> SizedTriangle {
    let asked = mesh.triangles()[face].map(|v| mesh.given_size(v).map_or(f64::INFINITY, |size| size.max(sizes.min)));
    SizedTriangle { corners: mesh.corners(face), sizes: asked }
}

/// The length of edges over a bend of curvature `k`.
fn size_at(k: f64, sizes: &Sizes) -> f64 {
    let by_turn = sizes.per_turn.map_or(f64::INFINITY, |n| 2.0 * PI / (n * k));
    let by_deviation = sizes.deviation.map_or(f64::INFINITY, |d| (6.0 * d / k).sqrt() / TOO_LONG);
    by_turn.min(by_deviation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use planish_core::mesh::TriangleSoup;
    use planish_core::monitor::NoMonitor;
    use planish_core::parametrize;
    use planish_core::subdivide::subdivide;

    /// Squares along a side.
    const SIDE: u32 = 10;

    /// A flat square of side 1, whose points ask for sizes by their x.
    fn square(size: impl Fn(f64) -> f64) -> CertifiedAtlas {
        let all = (0..=SIDE).flat_map(|j| (0..=SIDE).map(move |i| [i, j]));
        let points: Vec<Vec3> =
            all.map(|[i, j]| [f64::from(i), f64::from(j), 0.0].map(|c| c / f64::from(SIDE))).collect();
        let corner = |i: u32, j: u32| j * (SIDE + 1) + i;
        let mut triangles = Vec::new();
        for (i, j) in (0..SIDE).flat_map(|i| (0..SIDE).map(move |j| (i, j))) {
            let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let sizes = points.iter().map(|p| size(p[0])).collect();
        let soup = TriangleSoup::new(points, triangles).expect("a soup").with_sizes(sizes);
        parametrize(&soup, &planish_core::Settings::default(), &NoMonitor).expect("an atlas")
    }

    /// What is found of a square whose mesh shall have edges of a size at most and one at least; and that at its vertices, by
    /// their x, the field is what is expected.
    fn found(atlas: &CertifiedAtlas, size: f64, min: f64, expected: impl Fn(f64) -> f64) -> Varying {
        let linear = subdivide(atlas, &vec![None; atlas.charts().len()]).expect("triangles");
        let sizes = Sizes { size, min, per_turn: None, deviation: None, gradation: 0.4 };
        let wanted = Wanted { sizes, labels: &[], features: None, order: 1 };
        let found = varying(atlas, &linear, &Algorithms { adapted: vec![], enlarged: 1.0 }, &wanted);
        let mesh = atlas.mesh();
        let of_input = (0..mesh.points().len()).filter(|v| mesh.input_vertex(VertexId::at(*v)).is_some());
        let vertices: Vec<Vec3> = of_input.map(|v| mesh.points()[v]).collect();
        let told = found.triangles.iter().flat_map(|t| t.corners.into_iter().zip(t.sizes));
        let told: Vec<(Vec3, f64)> = told.filter(|(x, _)| vertices.contains(x)).collect();
        assert!(told.len() > 100, "{}", told.len());
        for (x, size) in told {
            let expected = expected(x[0]);
            assert!((size - expected).abs() <= 1e-12 * expected, "{size} for {expected} at {x:?}");
        }
        found
    }

    /// The array: from 0.02 to 0.2.
    fn linear(x: f64) -> f64 {
        0.02 + 0.18 * x
    }

    #[test]
    fn sizes_at_vertices_are_those_of_the_array() {
        let atlas = square(linear);
        assert_eq!(atlas.mesh().default_size(), linear(1.0), "the largest of them is that of all");
        let free = found(&atlas, linear(1.0), 0.0, linear);
        assert_eq!((free.least, free.held_places), (Some(0.02), 0));
        let held = found(&atlas, linear(1.0), 0.05, |x| linear(x).max(0.05));
        let is_below = |v: &usize| atlas.mesh().given_size(VertexId::at(*v)).is_some_and(|size| size < 0.05);
        let below = (0..atlas.mesh().points().len()).filter(is_below).count();
        assert_eq!((held.least, held.held_places, held.held[0].size), (Some(0.05), below, 0.02));
    }

    /// Sizes grow as everywhere where nothing is asked for, and where more is than the gradation allows.
    #[test]
    fn where_nothing_is_asked_for_sizes_grow_with_the_distance() {
        let grown = |x: f64| 0.05 + 0.4 * (x - 0.5);
        let none = square(|x| if x < 0.55 { 0.05 } else { f64::NAN });
        found(&none, 0.2, 0.0, |x| if x < 0.55 { 0.05 } else { grown(x) });
        let steep = square(|x| if x < 0.55 { 0.05 } else { 0.2 });
        found(&steep, 0.2, 0.0, |x| if x < 0.55 { 0.05 } else { grown(x).min(0.2) });
    }
}
