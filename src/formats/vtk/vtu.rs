//! surface.vtu and param.vtu: written for ParaView by `vtkio`, and read again by `planish check`.

use super::error::VtkError;
pub use super::read_back::{read, read_shape};
use planish_core::atlas::Chart;
use planish_core::certify::CertifiedMap;
use planish_core::measure::distortion::CellFields;
use planish_core::mesh::SurfaceMesh;
use planish_core::vec3::midpoint;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, UnstructuredGridPiece, Version,
    VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

/// What every reader can unpack: meshio does not know LZ4.
pub(super) const COMPRESSOR: Compressor = Compressor::ZLib;

/// A chart with everything that its part of the files shows.
pub struct ChartView<'a> {
    /// The surface it belongs to.
    pub mesh: &'a SurfaceMesh,
    /// The chart.
    pub chart: &'a Chart,
    /// Its map.
    pub map: &'a CertifiedMap,
    /// The fields of its triangles.
    pub fields: &'a [CellFields],
    /// Per triangle, whether it was invalid and was repaired.
    pub untangled: &'a [bool],
    /// A small number that differs from that of every neighbour.
    pub colour: u32,
}

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

/// The shift of chart `index` of `count` in param.vtu: unit disks in a square grid.
pub fn shift(index: usize, count: usize) -> [f64; 2] {
    let columns = (count as f64).sqrt().ceil().max(1.0) as usize;
    [2.25 * (index % columns) as f64, -2.25 * (index / columns) as f64]
}

/// The bytes of surface.vtu.
///
/// # Errors
/// [`VtuError::Library`].
pub fn surface(views: &[ChartView]) -> Result<Vec<u8>, VtuError> {
    encode(views, "planish surface", |view, _, node, _| position(view, node))
}

/// The bytes of param.vtu: the same cells in the parametric plane, charts side by side.
///
/// # Errors
/// [`VtuError::Library`].
pub fn param(views: &[ChartView]) -> Result<Vec<u8>, VtuError> {
    encode(views, "planish parametric plane", |_, index, _, uv| {
        let [x, y] = shift(index, views.len());
        [uv[0] + x, uv[1] + y, 0.0]
    })
}

/// The position of a node in space: that of a vertex, or the middle of a straight edge.
fn position(view: &ChartView, node: usize) -> [f64; 3] {
    let location = |v: planish_core::topology::VertexId| view.mesh.points()[view.chart.vertices()[v.index()].index()];
    let vertices = view.chart.vertices().len();
    if node < vertices {
        return view.mesh.points()[view.chart.vertices()[node].index()];
    }
    let h = view.chart.edges().sides(planish_core::topology::EdgeId::at(node - vertices))[0];
    midpoint(location(view.chart.from(h)), location(view.chart.from(h.next())))
}

/// Writes all charts as one piece; `location` gives the position of a node from view, index of the chart, node, uv.
fn encode(
    views: &[ChartView],
    title: &str,
    location: impl Fn(&ChartView, usize, usize, [f64; 2]) -> [f64; 3],
) -> Result<Vec<u8>, VtuError> {
    let mut points: Vec<f64> = Vec::new();
    let mut connectivity: Vec<u64> = Vec::new();
    for (index, view) in views.iter().enumerate() {
        let base = points.len() as u64 / 3;
        for (node, p) in view.map.map().nodes.iter().enumerate() {
            points.extend(location(view, index, node, p.uv()));
        }
        connectivity.extend(view.map.map().cells.iter().flatten().map(|n| base + u64::from(*n)));
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
            data: Attributes { point: point_fields(views), cell: cell_fields(views) },
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
fn point_fields(views: &[ChartView]) -> Vec<Attribute> {
    let nodes = |v: &ChartView| v.map.map().nodes.clone();
    let uv: Vec<f64> = views.iter().flat_map(nodes).flat_map(|p| p.uv()).collect();
    let mut vertex: Vec<i32> = Vec::new();
    for view in views {
        let welded = |v: &planish_core::topology::VertexId| view.mesh.input_vertex(*v).map_or(-2, |w| w as i32);
        vertex.extend(view.chart.vertices().iter().map(welded));
        vertex.resize(vertex.len() + view.map.map().nodes.len() - view.chart.vertices().len(), -1);
    }
    vec![array("uv", 2, uv), array("vertex", 1, vertex)]
}

/// The fields of every triangle.
fn cell_fields(views: &[ChartView]) -> Vec<Attribute> {
    let chart: Vec<i32> = views.iter().zip(0..).flat_map(|(v, i)| vec![i; v.fields.len()]).collect();
    let colour: Vec<i32> = views.iter().flat_map(|v| vec![v.colour as i32; v.fields.len()]).collect();
    let source = |v: &ChartView| -> Vec<i32> {
        v.chart.faces().iter().map(|f| v.mesh.source_triangle(f.index()) as i32).collect()
    };
    let triangle: Vec<i32> = views.iter().flat_map(source).collect();
    let untangled: Vec<u8> = views.iter().flat_map(|v| v.untangled).map(|u| u8::from(*u)).collect();
    let field = |name: &str, get: fn(&CellFields) -> f64| {
        array(name, 1, views.iter().flat_map(|v| v.fields).map(get).collect::<Vec<f64>>())
    };
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
