//! How long the edges of a mesh are to be, place by place: what narrow places, spikes and the user ask for, as one field.

use super::narrow::{self, Places};
use super::{Sizes, Wanted};
use crate::formats::gmsh::SizedTriangle;
use planish_core::CertifiedAtlas;
use planish_core::measure::bends::bends;
use planish_core::measure::curvature::Principal;
use planish_core::measure::sizes::{SizeField, SizedCube, SizedPlace, TOLD_UP_TO};
use planish_core::measure::spikes::spikes;
use planish_core::mesh::SurfaceMesh;
use planish_core::topology::VertexId;
use planish_core::vec3::Vec3;
use std::f64::consts::PI;

/// An edge over a bend of curvature k with the deviation D is sqrt(6 D / k) long: the middle of an equilateral triangle on a
/// sphere is off by k l^2 / 6. Edges of a mesh are up to 1.4 times as long as they are asked to be, and curvature is a mean.
const TOO_LONG: f64 = 1.5;

/// Where elements are smaller than everywhere else.
#[derive(Clone, Default)]
pub(super) struct Varying {
    /// The sizes around the surface, as far as they are below the largest ones; empty where sizes do not vary.
    pub cubes: Vec<SizedCube>,
    /// What an array of the input asks for on the triangles of the surface; likewise.
    pub array: Vec<SizedTriangle>,
    /// The least size.
    pub least: Option<f64>,
    /// Narrow places and spikes ask for no less than this, as more would take too many elements; none where they need not be held.
    pub floor: Option<f64>,
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

/// Sizes of narrow places and spikes are told on so many cubes at most, or on one for so many triangles of the surface. What
/// takes more has millions of elements: of generic_twin_7081, needles as long as the part and a millionth as wide, two
/// million cubes.
const MOST_CUBES: usize = 500_000;
const TRIANGLES_PER_CUBE: usize = 2;

/// Where that is not enough, they ask for no less than the first of these shares of the size that is, and at last for nothing.
const FLOORS: [f64; 2] = [1.0 / 16.0, 1.0 / 4.0];

/// So many of the places are told where smaller elements are needed than may be.
const TOLD: usize = 8;

/// What a mesher does at seams.
#[derive(Clone, Copy)]
pub(super) enum Seams<'a> {
    /// It has nodes along them, so that narrow charts need small elements. Some charts, ascending, are made by Gmsh's MeshAdapt.
    Kept { adapted: &'a [usize] },
    /// It knows of none.
    Passed,
}

/// The sizes of a mesh that is wanted. `curvatures` are those of the vertices of the surface; more may follow.
pub(super) fn varying(atlas: &CertifiedAtlas, curvatures: &[Principal], seams: Seams, wanted: &Wanted) -> Varying {
    let (mesh, charts, sizes) = (atlas.mesh(), atlas.charts(), &wanted.sizes);
    let Places { sized, curves, gaps } = match seams {
        Seams::Kept { adapted } => narrow::places(mesh, charts, atlas.seams(), adapted, sizes.size),
        Seams::Passed => {
            let sized = narrow::short_loops(mesh, charts, atlas.seams(), sizes.size);
            Places { sized, ..Places::default() }
        }
    };
    let thin = spikes(mesh, charts, curvatures, sizes.size);
    let counts = Varying { narrow_curves: curves, narrow_places: gaps, spikes: thin.len(), ..Varying::default() };
    let mut needed = sized;
    needed.extend(thin.iter().map(|s| SizedPlace { at: s.centre, size: s.size, reach: s.radius }));
    let asked = asked_for(atlas, sizes);
    let surface: Vec<[Vec3; 3]> = (0..mesh.triangles().len()).map(|face| mesh.corners(face)).collect();
    let with_floor = |share: f64, at_most: usize| {
        let floor = share * sizes.size;
        let mut found = Varying { floor: (floor > sizes.min).then_some(floor), ..counts.clone() };
        let mut places = hold(&needed, floor.max(sizes.min), &mut found);
        places.extend(hold(&asked, sizes.min, &mut found));
        places.retain(|place| place.size < sizes.size);
        if places.is_empty() {
            return Some(found);
        }
        found.least = places.iter().map(|place| place.size).reduce(f64::min);
        found.cubes = SizeField::new(places, sizes.gradation).told(&surface, TOLD_UP_TO * sizes.size, at_most)?;
        found.array = (0..surface.len()).filter_map(|face| asked_between(mesh, face, sizes)).collect();
        Some(found)
    };
    let at_most = MOST_CUBES.max(surface.len() / TRIANGLES_PER_CUBE);
    let held = || {
        // Where the highest floor takes too many cubes, so do lower ones: each takes as long as half a million cubes.
        let highest = with_floor(FLOORS[1], at_most)?;
        Some(with_floor(FLOORS[0], at_most).unwrap_or(highest))
    };
    // What is asked for is told, however much it takes.
    with_floor(0.0, at_most).or_else(held).or_else(|| with_floor(1.0, usize::MAX)).unwrap_or_default()
}

/// The places with sizes held above the least one that may be.
fn hold(places: &[SizedPlace], least: f64, found: &mut Varying) -> Vec<SizedPlace> {
    let mut held = places.to_vec();
    for place in held.iter_mut().filter(|place| place.size < least) {
        found.held_places += 1;
        if found.held.len() < TOLD {
            found.held.push(*place);
        }
        place.size = least;
    }
    held
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

/// A triangle with the sizes that the input asks for at its corners, and in between; none where it does not at all of them.
fn asked_between(mesh: &SurfaceMesh, face: usize, sizes: &Sizes) -> Option<SizedTriangle> {
    let mut asked = [0.0; 3];
    for (size, v) in asked.iter_mut().zip(mesh.triangles()[face]) {
        *size = mesh.given_size(v).filter(|size| *size > 0.0)?.clamp(sizes.min, TOLD_UP_TO * sizes.size);
    }
    Some(SizedTriangle { corners: mesh.corners(face), sizes: asked })
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
    /// their x, the field is what is expected, as closely as cubes tell it.
    fn found(atlas: &CertifiedAtlas, size: f64, min: f64, expected: impl Fn(f64) -> f64) -> Varying {
        let linear = subdivide(atlas, &vec![None; atlas.charts().len()]).expect("triangles");
        let sizes = Sizes { size, min, per_turn: None, deviation: None, gradation: 0.4 };
        let wanted = Wanted { sizes, labels: &[], features: None, order: 1, ridges: None };
        let found = varying(atlas, linear.curvatures(), Seams::Kept { adapted: &[] }, &wanted);
        let mesh = atlas.mesh();
        let of_input = (0..mesh.points().len()).filter(|v| mesh.input_vertex(VertexId::at(*v)).is_some());
        let mut asked = 0;
        for x in of_input.map(|v| mesh.points()[v]) {
            let corners = found.array.iter().flat_map(|t| t.corners.into_iter().zip(t.sizes));
            let by_array = corners.filter(|(at, _)| *at == x).map(|(_, size)| size).reduce(f64::min);
            asked += usize::from(by_array.is_some());
            let told = by_array.unwrap_or(f64::INFINITY).min(on_cubes(&found.cubes, x));
            let expected = expected(x[0]);
            assert!((told - expected).abs() <= 0.15 * expected, "{told} for {expected} at {x:?}");
        }
        assert!(asked > 60, "{asked}");
        found
    }

    /// What is interpolated in the cube around a point.
    fn on_cubes(cubes: &[SizedCube], x: Vec3) -> f64 {
        let is_in = |cube: &&SizedCube| (0..3).all(|k| (0.0..=cube.side).contains(&(x[k] - cube.low[k])));
        let cube = cubes.iter().find(is_in).expect("cubes all around");
        let along = [0, 1, 2].map(|k| (x[k] - cube.low[k]) / cube.side);
        let share = |corner: usize, k: usize| if corner >> k & 1 == 1 { along[k] } else { 1.0 - along[k] };
        (0..8).map(|corner| (0..3).map(|k| share(corner, k)).product::<f64>() * cube.sizes[corner]).sum()
    }

    /// The array: from 0.02 to 0.2.
    fn linear(x: f64) -> f64 {
        0.02 + 0.18 * x
    }

    #[test]
    fn sizes_at_vertices_are_those_of_the_array() {
        let atlas = square(linear);
        let corners = |t: &SizedTriangle| t.corners.into_iter().zip(t.sizes).collect::<Vec<_>>();
        assert_eq!(atlas.mesh().default_size(), linear(1.0), "the largest of them is that of all");
        let free = found(&atlas, linear(1.0), 0.0, linear);
        assert_eq!((free.least, free.held_places), (Some(0.02), 0));
        assert!(free.array.iter().flat_map(corners).all(|(x, size)| (size - linear(x[0])).abs() <= 1e-12 * size));
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

    /// Places are held above a least size, each of them is counted, and the first are told.
    #[test]
    fn places_below_the_least_size_are_held_and_counted() {
        let place = |size: f64| SizedPlace { at: [size, 0.0, 0.0], size, reach: 0.0 };
        let places: Vec<SizedPlace> = (1..=20).map(|k| place(f64::from(k))).collect();
        let mut found = Varying::default();
        let held = hold(&places, 12.5, &mut found);
        assert!(held.iter().zip(&places).all(|(held, place)| held.size == place.size.max(12.5) && held.at == place.at));
        assert_eq!((found.held_places, found.held.len(), found.held[7].size), (12, TOLD, 8.0));
    }
}
