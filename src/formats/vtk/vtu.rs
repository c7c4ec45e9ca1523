//! surface.vtu and param.vtu: written for ParaView, and read again by `planish check`.

use super::appended::{self, Array};
use super::carried::Carried;
use super::error::VtkError;
pub use super::read_back::{read, read_labels, read_shape};
use super::vtm::escape;
use crate::formats::layout::layout;
use crate::formats::{Fields, Label, label_index};
use planish_core::atlas::Chart;
use planish_core::measure::distortion::CellFields;
use planish_core::topology::{ChartId, EdgeId, VertexId};
use planish_core::vec3::midpoint;
use planish_core::{CertifiedAtlas, CertifiedChart};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::iter::repeat_n;
/// Why a file cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// The file is no VTU file, or a damaged one.
    #[error(transparent)]
    Damaged(#[from] VtkError),
    /// The file holds something else than planish writes.
    #[error(
        "{0}: missing, twice there, or of the wrong size or type; the file was not written by planish, or was damaged"
    )]
    Content(&'static str),
}

/// What planish reads back from a file.
#[derive(Debug, Default, PartialEq)]
pub struct Grid {
    /// Positions.
    pub points: Vec<[f64; 3]>,
    /// Nodes of the 6-node triangles.
    pub cells: Vec<[u32; 6]>,
    /// Parameters of the points.
    pub uv: Vec<[f64; 2]>,
    /// Input vertex of each point.
    pub vertex: Vec<i32>,
    /// Chart of each cell.
    pub chart: Vec<i32>,
    /// Input triangle of each cell.
    pub triangle: Vec<i32>,
    /// The fields of each cell.
    pub fields: Vec<CellFields>,
}

/// The surface in a file, without what is known of it.
#[derive(Debug, Default, PartialEq)]
pub struct Shape {
    /// Positions.
    pub points: Vec<[f64; 3]>,
    /// Nodes of the 6-node triangles.
    pub cells: Vec<[u32; 6]>,
    /// Chart of each cell.
    pub chart: Vec<i32>,
}

/// The bytes of surface.vtu. Cells have their label's tag, where there are labels, and the names of these are told beside. The
/// `fields` of the input, with an entry for each vertex after welding, stand behind planish's own.
pub fn surface(atlas: &CertifiedAtlas, labels: &[Label], fields: &Fields) -> Vec<u8> {
    let charts: Vec<_> = atlas.charts().iter().collect();
    encode(atlas, &charts, labels, fields, |certified, node, _| position(certified.chart(), node))
}

/// The same of one label alone, counted from 0.
pub fn part(atlas: &CertifiedAtlas, labels: &[Label], label: usize, fields: &Fields) -> Vec<u8> {
    let is_part = |c: &&CertifiedChart| label_index(atlas, c.id(), labels) == Some(label);
    let charts: Vec<_> = atlas.charts().iter().filter(is_part).collect();
    encode(atlas, &charts, labels, fields, |certified, node, _| position(certified.chart(), node))
}

/// The bytes of param.vtu: the same cells in the parametric plane, charts beside each other, each in its own size (see
/// [`layout`]).
pub fn param(atlas: &CertifiedAtlas, labels: &[Label]) -> Vec<u8> {
    let places = layout(atlas.charts());
    let charts: Vec<_> = atlas.charts().iter().collect();
    encode(atlas, &charts, labels, &Fields::default(), |certified, _, uv| places[certified.id().index()].of(uv))
}

/// The position of a node in space: that of a vertex, or the middle of a straight edge.
fn position(chart: &Chart, node: usize) -> [f64; 3] {
    let vertices = chart.points().len();
    if node < vertices {
        return chart.points()[node];
    }
    let h = chart.edges().sides(EdgeId::at(node - vertices))[0];
    let [from, to] = [h, h.next()].map(|h| chart.points()[chart.from(h).index()]);
    midpoint(from, to)
}

/// Writes charts as one piece; `place` gives the position of a node from its chart, its number there, and its uv.
fn encode(
    atlas: &CertifiedAtlas,
    charts: &[&CertifiedChart],
    labels: &[Label],
    fields: &Fields,
    place: impl Fn(&CertifiedChart, usize, [f64; 2]) -> [f64; 3],
) -> Vec<u8> {
    let mut cells: Vec<u32> = Vec::with_capacity(6 * charts.iter().map(|c| c.fields().len()).sum::<usize>());
    let mut count = 0;
    for certified in charts {
        let map = certified.map().map();
        cells.extend(map.cells.iter().flatten().map(|n| count as u32 + n));
        count += map.nodes.len();
    }
    let place = &place;
    let places = charts.iter().flat_map(|certified| {
        let nodes = certified.map().map().nodes.iter().enumerate();
        nodes.flat_map(move |(node, p)| place(certified, node, p.uv()))
    });
    let carried = Carried::new(fields, atlas.mesh());
    let (mut of_points, mut of_cells) = (point_fields(charts), cell_fields(atlas, charts, labels));
    of_points.extend(carried.of_points(charts));
    of_cells.extend(carried.of_cells(charts));
    let grid = appended::Grid {
        count,
        points: Array::doubles("Points", 3, places),
        cells,
        nodes_per_cell: 6,
        of_points,
        of_cells,
        field_data: names_of_labels(labels),
    };
    grid.into_bytes()
}

/// The field data that name labels: for each an array of its name, with its tag and dimension, as meshio tells groups of MSH
/// files. (Arrays of strings would name them better, but meshio refuses files that have any.)
pub(super) fn names_of_labels(labels: &[Label]) -> String {
    if labels.is_empty() {
        return String::new();
    }
    let mut arrays = String::new();
    let mut taken = BTreeSet::new();
    for Label { tag, name, group } in labels {
        let name = escape(if taken.insert(name) { name } else { group });
        // Writing to a string cannot fail.
        let _ = write!(
            arrays,
            "<DataArray type=\"Int32\" Name=\"{name}\" NumberOfTuples=\"2\" format=\"ascii\">{tag} 2</DataArray>"
        );
    }
    format!("<FieldData>{arrays}</FieldData>")
}

/// `uv` and `vertex` of every node.
fn point_fields(charts: &[&CertifiedChart]) -> Vec<Array> {
    let uv = charts.iter().flat_map(|certified| certified.map().map().nodes.iter().flat_map(|p| p.uv()));
    let vertex = charts.iter().flat_map(|certified| {
        let chart = certified.chart();
        let vertices = (0..chart.vertices().len()).map(VertexId::at);
        let middles = certified.map().map().nodes.len() - chart.vertices().len();
        vertices.map(|v| chart.input_vertex(v).map_or(-2, |w| w as i32)).chain(repeat_n(-1, middles))
    });
    vec![Array::doubles("uv", 2, uv), Array::integers("vertex", vertex)]
}

/// The fields of every triangle.
fn cell_fields(atlas: &CertifiedAtlas, charts: &[&CertifiedChart], labels: &[Label]) -> Vec<Array> {
    let colours = atlas.seams().colours();
    let all = || charts.iter().copied();
    let untangled: Vec<u8> = charts.iter().flat_map(|c| c.untangled().map(u8::from)).collect();
    let fields = || charts.iter().flat_map(|certified| certified.fields());
    let field = |name: &str, get: fn(&CellFields) -> f64| Array::field(name, fields().map(get));
    let mut arrays = vec![
        of_charts("chart", all(), |c| c.id().0 as i32),
        source_triangles(all()),
        field("det_min", |f| f.det_min),
        field("det_max", |f| f.det_max),
        field("jacobian_ratio", |f| f.jacobian_ratio),
        field("conformal_distortion", |f| f.conformal_distortion),
        field("area_scale", |f| f.area_scale),
        Array::bytes("untangled", &untangled),
        of_charts("colour", all(), |c| colours[c.id().index()] as i32),
    ];
    if !labels.is_empty() {
        arrays.push(of_charts("label", all(), |c| tag_of(atlas, c.id(), labels)));
    }
    arrays
}

/// What all triangles of a chart have, for each triangle.
pub(super) fn of_charts<'a>(
    name: &str,
    charts: impl Iterator<Item = &'a CertifiedChart>,
    value: impl Fn(&CertifiedChart) -> i32,
) -> Array {
    Array::integers(name, charts.flat_map(|c| repeat_n(value(c), c.chart().triangles().len())))
}

/// The triangle of the input that each triangle is part of.
pub(super) fn source_triangles<'a>(charts: impl Iterator<Item = &'a CertifiedChart>) -> Array {
    let of_chart = |certified: &'a CertifiedChart| {
        let chart = certified.chart();
        (0..chart.triangles().len()).map(|f| chart.source_triangle(f) as i32)
    };
    Array::integers("triangle", charts.flat_map(of_chart))
}

/// The tag of the label of a chart; -1 where there are no labels.
pub(super) fn tag_of(atlas: &CertifiedAtlas, chart: ChartId, labels: &[Label]) -> i32 {
    label_index(atlas, chart, labels).map_or(-1, |index| labels[index].tag)
}
