//! surface.vtu and param.vtu, by `vtkio`: written for ParaView, read again by `planish check`.

use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use pipeline::atlas::Chart;
use pipeline::certify::CertifiedMap;
use pipeline::distortion::CellFields;
use pipeline::mesh::SurfaceMesh;
use pipeline::space::midpoint;
use std::panic::{AssertUnwindSafe, catch_unwind};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, IOBuffer, Piece, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

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
    let place = |v: pipeline::id::VertexId| view.mesh.points()[view.chart.vertices()[v.index()].index()];
    let vertices = view.chart.vertices().len();
    if node < vertices {
        return view.mesh.points()[view.chart.vertices()[node].index()];
    }
    let h = view.chart.edges().sides(pipeline::id::EdgeId::at(node - vertices))[0];
    midpoint(place(view.chart.from(h)), place(view.chart.from(h.next())))
}

/// Writes all charts as one piece; `place` gives the position of a node from view, index of the chart, node, uv.
fn encode(
    views: &[ChartView],
    title: &str,
    place: impl Fn(&ChartView, usize, usize, [f64; 2]) -> [f64; 3],
) -> Result<Vec<u8>, VtuError> {
    let mut points: Vec<f64> = Vec::new();
    let mut connectivity: Vec<u64> = Vec::new();
    for (index, view) in views.iter().enumerate() {
        let base = points.len() as u64 / 3;
        for (node, p) in view.map.map().nodes.iter().enumerate() {
            points.extend(place(view, index, node, p.uv()));
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
    let file = vtk.try_into_xml_format(Compressor::LZ4, 1).map_err(|e| library(&e))?;
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
        let welded = |v: &pipeline::id::VertexId| view.mesh.input_vertex(*v).map_or(-2, |w| w as i32);
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

/// How every file of planish's begins.
const HEAD: &str = "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\" \
                    compressor=\"vtkLZ4DataCompressor\">";

/// Reads a file that planish wrote.
///
/// # Errors
/// [`VtuError`]; `vtkio` panics on some damaged files, which becomes an error here too.
pub fn read(bytes: &[u8]) -> Result<Grid, VtuError> {
    if !bytes.starts_with(HEAD.as_bytes()) || !sizes_are_plausible(bytes) {
        return Err(VtuError::Content("the header"));
    }
    let parsed = catch_unwind(AssertUnwindSafe(|| Vtk::parse_xml(bytes)));
    let vtk = parsed.map_err(|_| VtuError::Library("the file is damaged".to_owned()))?;
    let vtk = vtk.map_err(|e| VtuError::Library(e.to_string()))?;
    let DataSet::UnstructuredGrid { pieces, .. } = vtk.data else { return Err(VtuError::Content("UnstructuredGrid")) };
    let [Piece::Inline(piece)] = &pieces[..] else { return Err(VtuError::Content("Piece")) };
    grid(piece)
}

/// Whether the sizes that compressed arrays declare can be true: LZ4 packs at most 255 bytes into one. `vtkio`
/// takes the memory before it looks.
fn sizes_are_plausible(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let arrays = text.split("<DataArray ").skip(1).filter_map(|a| a.split_once('>')).map(|(_, data)| data);
    arrays.into_iter().all(|data| {
        let header = data.get(..32).and_then(|h| BASE64_STANDARD.decode(h).ok());
        let numbers = header.map(|h| {
            h.chunks_exact(8)
                .map(|n| u64::from_le_bytes([n[0], n[1], n[2], n[3], n[4], n[5], n[6], n[7]]))
                .collect::<Vec<_>>()
        });
        let Some([blocks, block, last]) = numbers.as_deref() else { return false };
        let limit = 256 * bytes.len() as u64;
        *blocks <= limit && *last <= *block && blocks.checked_mul(*block).is_some_and(|total| total <= limit)
    })
}

fn grid(piece: &UnstructuredGridPiece) -> Result<Grid, VtuError> {
    let (of_points, of_cells) = (&piece.data.point[..], &piece.data.cell[..]);
    let points = doubles(&piece.points).ok_or(VtuError::Content("Points"))?;
    let points: Vec<[f64; 3]> = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    let cells = cells(&piece.cells, points.len()).ok_or(VtuError::Content("Cells"))?;
    let (n, m) = (points.len(), cells.len());
    let uv = named(of_points, "uv").and_then(doubles).filter(|d| d.len() == 2 * n).ok_or(VtuError::Content("uv"))?;
    let whole = |attributes, name: &'static str, length: usize| {
        let data = named(attributes, name).and_then(|d| if let IOBuffer::I32(v) = d { Some(v) } else { None });
        data.filter(|d| d.len() == length).cloned().ok_or(VtuError::Content(name))
    };
    let field = |name: &'static str| {
        named(of_cells, name).and_then(doubles).filter(|d| d.len() == m).ok_or(VtuError::Content(name))
    };
    let all = [
        field("det_min")?,
        field("det_max")?,
        field("jacobian_ratio")?,
        field("conformal_distortion")?,
        field("area_scale")?,
    ];
    let fields = (0..m).map(|i| CellFields {
        det_min: all[0][i],
        det_max: all[1][i],
        jacobian_ratio: all[2][i],
        conformal_distortion: all[3][i],
        area_scale: all[4][i],
    });
    Ok(Grid {
        uv: uv.chunks_exact(2).map(|p| [p[0], p[1]]).collect(),
        vertex: whole(of_points, "vertex", n)?,
        chart: whole(of_cells, "chart", m)?,
        triangle: whole(of_cells, "triangle", m)?,
        fields: fields.collect(),
        points,
        cells,
    })
}

/// The data of the only array of this name.
fn named<'a>(attributes: &'a [Attribute], name: &str) -> Option<&'a IOBuffer> {
    let mut all = attributes.iter().filter_map(|a| match a {
        Attribute::DataArray(d) if d.name == name => Some(&d.data),
        _ => None,
    });
    all.next().filter(|_| all.next().is_none())
}

fn doubles(buffer: &IOBuffer) -> Option<&Vec<f64>> {
    if let IOBuffer::F64(v) = buffer { Some(v) } else { None }
}

/// The nodes of the cells, if all of them are 6-node triangles of existing points.
fn cells(cells: &Cells, points: usize) -> Option<Vec<[u32; 6]>> {
    let VertexNumbers::XML { connectivity, offsets } = &cells.cell_verts else { return None };
    let sixes = offsets.iter().zip(1..).all(|(o, i)| *o == 6 * i);
    let right = sixes && connectivity.len() == 6 * offsets.len() && cells.types.len() == offsets.len();
    let in_range = connectivity.iter().all(|n| (*n as usize) < points);
    let quadratic = cells.types.iter().all(|t| *t == CellType::QuadraticTriangle);
    let six = |c: &[u64]| [c[0] as u32, c[1] as u32, c[2] as u32, c[3] as u32, c[4] as u32, c[5] as u32];
    (right && in_range && quadratic).then(|| connectivity.chunks_exact(6).map(six).collect())
}
