//! `surface.obj`: the surface with texture coordinates, for programs that paint, render or bake.

use crate::formats::joined::JoinedVertices;
use crate::formats::labels::Label;
use crate::formats::texture::{Part, UnitSquare, parts};
use planish_core::topology::VertexId;
use planish_core::{CertifiedAtlas, CertifiedChart};
use std::fmt::Write;

/// The bytes of `surface.obj`.
///
/// Every vertex of the surface is there once (`v`), so that a closed surface stays closed; its texture coordinates
/// (`vt`, v points up) belong to the corners of triangles (`f v/vt v/vt v/vt`), as they differ on the two sides of a
/// seam. The triangles of each label make a group (`g`); without labels there is none. Numbers are the shortest that
/// are read as the same double.
pub fn surface(atlas: &CertifiedAtlas, labels: &[Label]) -> Vec<u8> {
    let square = UnitSquare::of(atlas.charts());
    let vertices = JoinedVertices::of(atlas.mesh());
    let mut text = String::from("# surface with texture coordinates, written by planish\n");
    for [x, y, z] in vertices.points() {
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    for [u, v] in atlas.charts().iter().flat_map(|certified| square.coordinates(certified)) {
        let _ = writeln!(text, "vt {u:?} {v:?}");
    }
    let first_coordinates = first_coordinates(atlas);
    for Part { label, charts } in parts(atlas, labels) {
        if let Some(label) = label {
            let _ = writeln!(text, "g {}", label.group);
        }
        for certified in charts {
            faces(&mut text, certified, &vertices, first_coordinates[certified.id().index()]);
        }
    }
    text.into_bytes()
}

/// Per chart, how many texture coordinates come before its own.
fn first_coordinates(atlas: &CertifiedAtlas) -> Vec<usize> {
    let mut before = 0;
    let mut first = Vec::with_capacity(atlas.charts().len());
    for certified in atlas.charts() {
        first.push(before);
        before += certified.chart().vertices().len();
    }
    first
}

/// The triangles of a chart; OBJ counts from 1.
fn faces(text: &mut String, certified: &CertifiedChart, vertices: &JoinedVertices, first_coordinate: usize) {
    let chart = certified.chart();
    for triangle in chart.triangles() {
        let corner = |v: VertexId| (1 + vertices.number(chart.welded_vertex(v)), 1 + first_coordinate + v.index());
        let [(a, s), (b, t), (c, u)] = triangle.map(corner);
        let _ = writeln!(text, "f {a}/{s} {b}/{t} {c}/{u}");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::texture::tests::{atlas_of, labelled_cube};
    use crate::formats::{Format, read_alone};
    use planish_core::shapes;
    use std::collections::BTreeMap;

    /// The numbers of all lines that begin with this word.
    fn rows<const N: usize>(text: &str, word: &str) -> Vec<[f64; N]> {
        let rows = text.lines().filter_map(|line| line.strip_prefix(word)?.strip_prefix(' '));
        let numbers = |row: &str| row.split(' ').map(|w| w.parse().expect("a number")).collect::<Vec<f64>>();
        rows.map(|row| numbers(row).try_into().expect("so many")).collect()
    }

    /// Vertex and texture coordinate of each corner, from 0.
    fn corners(text: &str) -> Vec<[[usize; 2]; 3]> {
        let faces = text.lines().filter_map(|line| line.strip_prefix("f "));
        let index = |word: &str| word.parse::<usize>().expect("a number") - 1;
        let corner = |word: &str| word.split_once('/').map(|(v, vt)| [index(v), index(vt)]).expect("both");
        faces.map(|face| face.split(' ').map(corner).collect::<Vec<_>>().try_into().expect("a triangle")).collect()
    }

    #[test]
    fn every_corner_has_its_place_in_space_and_in_the_square() {
        let atlas = atlas_of(&shapes::ring_torus(24, 12));
        let text = String::from_utf8(surface(&atlas, &[])).expect("UTF-8");
        let (points, coordinates, faces) = (rows::<3>(&text, "v"), rows::<2>(&text, "vt"), corners(&text));
        let square = UnitSquare::of(atlas.charts());
        let mut faces_left = faces.iter();
        for certified in atlas.charts() {
            let uv: Vec<[f64; 2]> = square.coordinates(certified).collect();
            for triangle in certified.chart().triangles() {
                for (v, [point, coordinate]) in triangle.iter().zip(faces_left.next().expect("a face")) {
                    assert_eq!(points[*point], certified.chart().points()[v.index()]);
                    assert_eq!(coordinates[*coordinate], uv[v.index()]);
                }
            }
        }
        assert!(faces_left.next().is_none() && atlas.charts().len() > 1 && !text.contains("\ng "));
        // A torus: as many triangles as there are, and every edge on two of them, once in each direction.
        let mut sides: BTreeMap<[usize; 2], i32> = BTreeMap::new();
        for [[a, _], [b, _], [c, _]] in &faces {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                *sides.entry([*p.min(q), *p.max(q)]).or_default() += if p < q { 1 } else { -1 };
            }
        }
        assert!(sides.values().all(|sum| *sum == 0));
        assert_eq!(points.len() as i64 - sides.len() as i64 + faces.len() as i64, 0, "Euler's number of a torus");
    }

    #[test]
    fn groups_have_the_names_of_labels_each_once() {
        let (atlas, labels) = labelled_cube();
        let text = String::from_utf8(surface(&atlas, &labels)).expect("UTF-8");
        let groups: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("g ")).collect();
        assert_eq!(groups, ["side_0", "side_1", "side_2", "side_3", "side_4", "side_5"]);
        // Euler's formula of a closed surface of triangles: sides share their corners.
        assert_eq!(rows::<3>(&text, "v").len(), 2 + corners(&text).len() / 2);
    }

    #[test]
    fn planish_reads_the_surface_again() {
        let soup = shapes::ring_torus(24, 12);
        let atlas = atlas_of(&soup);
        let read = read_alone(Format::Obj, &surface(&atlas, &[])).expect("an OBJ file").soup;
        assert_eq!(
            (read.points().len(), read.triangles().len()),
            (soup.points().len(), atlas.mesh().triangles().len())
        );
    }
}
