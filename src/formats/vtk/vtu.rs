//! surface.vtu and param.vtu: written for ParaView by `vtkio`, and read again by `planish check`.

use super::error::VtkError;
use super::layout::layout;
pub use super::read_back::{read, read_shape};
use planish_core::atlas::Chart;
use planish_core::measure::distortion::CellFields;
use planish_core::topology::{EdgeId, VertexId};
use planish_core::vec3::midpoint;
use planish_core::{CertifiedAtlas, CertifiedChart};
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

/// The bytes of surface.vtu.
///
/// # Errors
/// [`VtuError::Library`].
pub fn surface(atlas: &CertifiedAtlas) -> Result<Vec<u8>, VtuError> {
    encode(atlas, "planish surface", |certified, node, _| position(certified.chart(), node))
}

/// The bytes of param.vtu: the same cells in the parametric plane, charts beside each other, each in its own size (see
/// [`layout`]).
///
/// # Errors
/// [`VtuError::Library`].
pub fn param(atlas: &CertifiedAtlas) -> Result<Vec<u8>, VtuError> {
    let places = layout(atlas.charts());
    encode(atlas, "planish parametric plane", |certified, _, uv| places[certified.id().index()].of(uv))
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

/// Writes all charts as one piece; `place` gives the position of a node from its chart, its number there, and its uv.
fn encode(
    atlas: &CertifiedAtlas,
    title: &str,
    place: impl Fn(&CertifiedChart, usize, [f64; 2]) -> [f64; 3],
) -> Result<Vec<u8>, VtuError> {
    let mut points: Vec<f64> = Vec::new();
    let mut connectivity: Vec<u64> = Vec::new();
    for certified in atlas.charts() {
        let base = points.len() as u64 / 3;
        let map = certified.map().map();
        for (node, p) in map.nodes.iter().enumerate() {
            points.extend(place(certified, node, p.uv()));
        }
        connectivity.extend(map.cells.iter().flatten().map(|n| base + u64::from(*n)));
    }
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
            data: Attributes { point: point_fields(atlas), cell: cell_fields(atlas) },
        }),
    };
    let library = |e: &dyn std::fmt::Display| VtuError::Library(e.to_string());
    let mut bytes = Vec::new();
    let file = vtk.try_into_xml_format(COMPRESSOR, 1).map_err(|e| library(&e))?;
    file.write(&mut bytes).map_err(|e| library(&e))?;
    Ok(bytes)
}

fn array(name: &str, components: u32, data: impl Into<IOBuffer>) -> Attribute {
    Attribute::DataArray(DataArray::new(name, components).with_data(data))
}

/// `uv` and `vertex` of every node.
fn point_fields(atlas: &CertifiedAtlas) -> Vec<Attribute> {
    let mut uv: Vec<f64> = Vec::new();
    let mut vertex: Vec<i32> = Vec::new();
    for certified in atlas.charts() {
        let (chart, nodes) = (certified.chart(), &certified.map().map().nodes);
        uv.extend(nodes.iter().flat_map(|p| p.uv()));
        let vertices = (0..chart.vertices().len()).map(VertexId::at);
        vertex.extend(vertices.map(|v| chart.input_vertex(v).map_or(-2, |w| w as i32)));
        vertex.resize(uv.len() / 2, -1);
    }
    vec![array("uv", 2, uv), array("vertex", 1, vertex)]
}

/// The fields of every triangle.
fn cell_fields(atlas: &CertifiedAtlas) -> Vec<Attribute> {
    let mut chart: Vec<i32> = Vec::new();
    let mut triangle: Vec<i32> = Vec::new();
    let mut untangled: Vec<u8> = Vec::new();
    let mut colour: Vec<i32> = Vec::new();
    for (certified, chart_colour) in atlas.charts().iter().zip(atlas.seams().colours()) {
        let cells = 0..certified.fields().len();
        triangle.extend(cells.map(|f| certified.chart().source_triangle(f) as i32));
        chart.resize(triangle.len(), certified.id().0 as i32);
        colour.resize(triangle.len(), chart_colour as i32);
        untangled.extend(certified.untangled().map(u8::from));
    }
    let fields = || atlas.charts().iter().flat_map(CertifiedChart::fields);
    let field = |name: &str, get: fn(&CellFields) -> f64| array(name, 1, fields().map(get).collect::<Vec<f64>>());
    vec![
        array("chart", 1, chart),
        array("triangle", 1, triangle),
        field("det_min", |f| f.det_min),
        field("det_max", |f| f.det_max),
        field("jacobian_ratio", |f| f.jacobian_ratio),
        field("conformal_distortion", |f| f.conformal_distortion),
        field("area_scale", |f| f.area_scale),
        array("untangled", 1, untangled),
        array("colour", 1, colour),
    ]
}
