//! `seams.vtp`: the curves between charts as polylines, and corners as points, by `vtkio`.

use super::vtu::tag_of;
use crate::formats::Label;
use planish_core::CertifiedAtlas;
use planish_core::mesh::SurfaceMesh;
use planish_core::seams::Curve;
use planish_core::topology::VertexId;
use vtkio::model::{
    Attribute, Attributes, ByteOrder, DataArray, DataSet, IOBuffer, PolyDataPiece, Version, VertexNumbers, Vtk,
};
use vtkio::xml::Compressor;

/// What every reader can unpack: meshio does not know LZ4.
const COMPRESSOR: Compressor = Compressor::ZLib;

/// `vtkio` cannot write the file.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct VtpError(String);

/// The bytes of `seams.vtp`: one polyline per curve, open boundary included, each with points of its own, and one
/// vertex cell per corner.
///
/// Points: `vertex`, the input vertex. Cells: `curve` (-1 for corners), `open` (1 where one chart lies beside it),
/// `sides` (how many do), `chart_a` and `chart_b` (the first two of them, -1 for none), `length`; where there are labels,
/// `label_a` and `label_b`, the tags of those of these charts.
///
/// # Errors
/// [`VtpError`].
pub fn seams(atlas: &CertifiedAtlas, labels: &[Label]) -> Result<Vec<u8>, VtpError> {
    let (mesh, network) = (atlas.mesh(), atlas.seams());
    // The corners, each once; then the vertices of one curve after the other, shared by none.
    let mut vertices: Vec<VertexId> = network.points().iter().filter(|p| p.corner).map(|p| p.vertex).collect();
    let corners = vertices.len();
    let mut lengths = Vec::new();
    for curve in network.curves() {
        vertices.extend(curve.vertices());
        lengths.push(curve.vertices().len());
    }
    let points: Vec<f64> = vertices.iter().flat_map(|v| mesh.points()[v.index()]).collect();
    let numbers: Vec<i32> = vertices.iter().map(|v| input_number(mesh, *v)).collect();
    let piece = PolyDataPiece {
        points: points.into(),
        verts: (corners > 0).then(|| consecutive(0, &vec![1; corners])),
        lines: Some(consecutive(corners, &lengths)),
        data: Attributes { point: vec![array("vertex", numbers)], cell: cell_fields(atlas, corners, labels) },
        ..PolyDataPiece::default()
    };
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        byte_order: ByteOrder::LittleEndian,
        title: "planish seams".to_owned(),
        file_path: None,
        data: DataSet::inline(piece),
    };
    let mut bytes = Vec::new();
    let file = vtk.try_into_xml_format(COMPRESSOR, 1).map_err(|e| VtpError(e.to_string()))?;
    file.write(&mut bytes).map_err(|e| VtpError(e.to_string()))?;
    sign_indices(&mut bytes);
    Ok(bytes)
}

/// Calls the indices of a file signed, as VTK does and writes them: of unsigned ones meshio makes floating-point numbers, with
/// which numpy takes no points. (`vtkio` writes unsigned ones; the bits are the same.)
fn sign_indices(bytes: &mut Vec<u8>) {
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

/// The number of a vertex in the input; -2 for one that was made.
fn input_number(mesh: &SurfaceMesh, vertex: VertexId) -> i32 {
    mesh.input_vertex(vertex).map_or(-2, |number| number as i32)
}

/// Cells of the given numbers of points, which follow each other from point `first` on.
fn consecutive(first: usize, lengths: &[usize]) -> VertexNumbers {
    let mut offsets = Vec::with_capacity(lengths.len());
    let mut end = 0;
    for length in lengths {
        end += *length as u64;
        offsets.push(end);
    }
    let first = first as u64;
    VertexNumbers::XML { connectivity: (first..first + end).collect(), offsets }
}

fn array(name: &str, data: impl Into<IOBuffer>) -> Attribute {
    Attribute::DataArray(DataArray::new(name, 1).with_data(data))
}

/// The fields of the corners, then those of the curves: the order of the cells in PolyData.
fn cell_fields(atlas: &CertifiedAtlas, corners: usize, labels: &[Label]) -> Vec<Attribute> {
    let curves = atlas.seams().curves();
    let mut arrays = vec![
        array("curve", column(-1, corners, curves, |c| c.id().0 as i32)),
        array("open", column(0, corners, curves, |c| i32::from(c.is_open()))),
        array("sides", column(0, corners, curves, |c| c.sides().len() as i32)),
        array("chart_a", column(-1, corners, curves, |c| chart_beside(c, 0))),
        array("chart_b", column(-1, corners, curves, |c| chart_beside(c, 1))),
        array("length", column(0.0, corners, curves, Curve::length)),
    ];
    if !labels.is_empty() {
        let beside = |c: &Curve, side: usize| c.sides().get(side).map_or(-1, |side| tag_of(atlas, side.chart, labels));
        arrays.push(array("label_a", column(-1, corners, curves, |c| beside(c, 0))));
        arrays.push(array("label_b", column(-1, corners, curves, |c| beside(c, 1))));
    }
    arrays
}

/// A field: the same value at every corner, then one value per curve.
fn column<T: Clone>(at_corner: T, corners: usize, curves: &[Curve], of_curve: impl Fn(&Curve) -> T) -> Vec<T> {
    let mut values = vec![at_corner; corners];
    values.extend(curves.iter().map(of_curve));
    values
}

/// The chart on a side of a curve; -1 where it has no such side.
fn chart_beside(curve: &Curve, side: usize) -> i32 {
    curve.sides().get(side).map_or(-1, |side| side.chart.0 as i32)
}
