//! surface.vtu and param.vtu: written for ParaView by `vtkio`, and read again by `planish check`.

use super::error::VtkError;
pub use super::read_back::{read, read_shape};
use super::vtm::escape;
use crate::formats::layout::layout;
use crate::formats::{Label, label_index};
use planish_core::atlas::Chart;
use planish_core::measure::distortion::CellFields;
use planish_core::topology::{ChartId, EdgeId, VertexId};
use planish_core::vec3::midpoint;
use planish_core::{CertifiedAtlas, CertifiedChart};
use std::collections::BTreeSet;
use std::fmt::Write;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

/// What every reader can unpack: meshio does not know LZ4.
pub(super) const COMPRESSOR: Compressor = Compressor::ZLib;

/// Why a file cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// `vtkio` says why.
    #[error("{0}")]
    Library(String),
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

/// The bytes of surface.vtu. Cells have their label's tag, where there are labels, and the names of these are told beside.
///
/// # Errors
/// [`VtuError::Library`].
pub fn surface(atlas: &CertifiedAtlas, labels: &[Label]) -> Result<Vec<u8>, VtuError> {
    let charts: Vec<_> = atlas.charts().iter().collect();
    encode(atlas, &charts, labels, "planish surface", |certified, node, _| position(certified.chart(), node))
}

/// The same of one label alone, counted from 0.
///
/// # Errors
/// [`VtuError::Library`].
pub fn part(atlas: &CertifiedAtlas, labels: &[Label], label: usize) -> Result<Vec<u8>, VtuError> {
    let is_part = |c: &&CertifiedChart| label_index(atlas, c.id(), labels) == Some(label);
    let charts: Vec<_> = atlas.charts().iter().filter(is_part).collect();
    encode(atlas, &charts, labels, "planish surface", |certified, node, _| position(certified.chart(), node))
}

/// The bytes of param.vtu: the same cells in the parametric plane, charts beside each other, each in its own size (see
/// [`layout`]).
///
/// # Errors
/// [`VtuError::Library`].
pub fn param(atlas: &CertifiedAtlas, labels: &[Label]) -> Result<Vec<u8>, VtuError> {
    let places = layout(atlas.charts());
    let charts: Vec<_> = atlas.charts().iter().collect();
    encode(atlas, &charts, labels, "planish parametric plane", |certified, _, uv| places[certified.id().index()].of(uv))
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
    title: &str,
    place: impl Fn(&CertifiedChart, usize, [f64; 2]) -> [f64; 3],
) -> Result<Vec<u8>, VtuError> {
    let mut points: Vec<f64> = Vec::new();
    let mut connectivity: Vec<u64> = Vec::new();
    for certified in charts {
        let base = points.len() as u64 / 3;
        let map = certified.map().map();
        for (node, p) in map.nodes.iter().enumerate() {
            points.extend(place(certified, node, p.uv()));
        }
        connectivity.extend(map.cells.iter().flatten().map(|n| base + u64::from(*n)));
    }
    let data = Attributes { point: point_fields(charts), cell: cell_fields(atlas, charts, labels) };
    write(title, labels, points, connectivity, data)
}

/// The bytes of a file with these triangles of six nodes, and the names of labels.
pub(super) fn write(
    title: &str,
    labels: &[Label],
    points: Vec<f64>,
    connectivity: Vec<u64>,
    data: Attributes,
) -> Result<Vec<u8>, VtuError> {
    let cells = connectivity.len() / 6;
    let offsets = (1..=cells as u64).map(|i| 6 * i).collect();
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        byte_order: ByteOrder::LittleEndian,
        title: title.to_owned(),
        file_path: None,
        data: DataSet::inline(UnstructuredGridPiece {
            points: points.into(),
            cells: Cells {
                cell_verts: VertexNumbers::XML { connectivity, offsets },
                types: vec![CellType::QuadraticTriangle; cells],
            },
            data,
        }),
    };
    let library = |e: &dyn std::fmt::Display| VtuError::Library(e.to_string());
    let mut bytes = Vec::new();
    let file = vtk.try_into_xml_format(COMPRESSOR, 1).map_err(|e| library(&e))?;
    file.write(&mut bytes).map_err(|e| library(&e))?;
    sign_indices(&mut bytes);
    if !labels.is_empty() {
        add_field_data(&mut bytes, &names_of_labels(labels))?;
    }
    Ok(bytes)
}

/// Calls the indices of a file signed, as VTK does and writes them: of unsigned ones meshio makes floating-point numbers, with
/// which numpy takes no points. (`vtkio` writes unsigned ones; the bits are the same.)
pub(super) fn sign_indices(bytes: &mut Vec<u8>) {
    for name in ["connectivity", "offsets"] {
        let unsigned = format!("type=\"UInt64\" Name=\"{name}\"");
        let signed = format!("type=\"Int64\" Name=\"{name}\"");
        let found: Vec<usize> = memchr::memmem::find_iter(bytes, unsigned.as_bytes()).collect();
        // From the last on, so that the others stay where they are.
        for at in found.into_iter().rev() {
            bytes.splice(at..at + unsigned.len(), signed.bytes());
        }
    }
}

/// The field data that name labels: for each an array of its name, with its tag and dimension, as meshio tells groups of MSH
/// files. (Arrays of strings would name them better, but meshio refuses files that have any; `vtkio` writes no field data.)
fn names_of_labels(labels: &[Label]) -> String {
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

/// Puts field data in front of the first piece.
fn add_field_data(bytes: &mut Vec<u8>, field_data: &str) -> Result<(), VtuError> {
    let at = memchr::memmem::find(bytes, b"<Piece").ok_or(VtuError::Content("Piece"))?;
    bytes.splice(at..at, field_data.bytes());
    Ok(())
}

pub(super) fn array(name: &str, components: u32, data: impl Into<IOBuffer>) -> Attribute {
    Attribute::DataArray(DataArray::new(name, components).with_data(data))
}

/// `uv` and `vertex` of every node.
fn point_fields(charts: &[&CertifiedChart]) -> Vec<Attribute> {
    let mut uv: Vec<f64> = Vec::new();
    let mut vertex: Vec<i32> = Vec::new();
    for certified in charts {
        let (chart, nodes) = (certified.chart(), &certified.map().map().nodes);
        uv.extend(nodes.iter().flat_map(|p| p.uv()));
        let vertices = (0..chart.vertices().len()).map(VertexId::at);
        vertex.extend(vertices.map(|v| chart.input_vertex(v).map_or(-2, |w| w as i32)));
        vertex.resize(uv.len() / 2, -1);
    }
    vec![array("uv", 2, uv), array("vertex", 1, vertex)]
}

/// The fields of every triangle.
fn cell_fields(atlas: &CertifiedAtlas, charts: &[&CertifiedChart], labels: &[Label]) -> Vec<Attribute> {
    let mut chart: Vec<i32> = Vec::new();
    let mut triangle: Vec<i32> = Vec::new();
    let mut untangled: Vec<u8> = Vec::new();
    let mut colour: Vec<i32> = Vec::new();
    let mut label: Vec<i32> = Vec::new();
    let colours = atlas.seams().colours();
    for certified in charts {
        let cells = 0..certified.fields().len();
        triangle.extend(cells.map(|f| certified.chart().source_triangle(f) as i32));
        chart.resize(triangle.len(), certified.id().0 as i32);
        colour.resize(triangle.len(), colours[certified.id().index()] as i32);
        label.resize(triangle.len(), tag_of(atlas, certified.id(), labels));
        untangled.extend(certified.untangled().map(u8::from));
    }
    let fields = || charts.iter().flat_map(|certified| certified.fields());
    let field = |name: &str, get: fn(&CellFields) -> f64| array(name, 1, fields().map(get).collect::<Vec<f64>>());
    let mut arrays = vec![
        array("chart", 1, chart),
        array("triangle", 1, triangle),
        field("det_min", |f| f.det_min),
        field("det_max", |f| f.det_max),
        field("jacobian_ratio", |f| f.jacobian_ratio),
        field("conformal_distortion", |f| f.conformal_distortion),
        field("area_scale", |f| f.area_scale),
        array("untangled", 1, untangled),
        array("colour", 1, colour),
    ];
    if !labels.is_empty() {
        arrays.push(array("label", 1, label));
    }
    arrays
}

/// The tag of the label of a chart; -1 where there are no labels.
pub(super) fn tag_of(atlas: &CertifiedAtlas, chart: ChartId, labels: &[Label]) -> i32 {
    label_index(atlas, chart, labels).map_or(-1, |index| labels[index].tag)
}
