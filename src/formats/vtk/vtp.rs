//! `seams.vtp`: the curves between charts as polylines, and corners as points, by `vtkio`.

use super::vtu::COMPRESSOR;
use planish_core::mesh::SurfaceMesh;
use planish_core::seams::{Curve, SeamNetwork};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, DataArray, DataSet, IOBuffer, PolyDataPiece, Version, VertexNumbers, Vtk,
};

/// `vtkio` cannot write the file.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct VtpError(String);

/// The bytes of `seams.vtp`: one polyline per curve, open boundary included, each with points of its own, and one
/// vertex cell per corner.
///
/// Points: `vertex`, the input vertex. Cells: `curve` (-1 for corners), `open` (1 where one chart lies beside it),
/// `sides` (how many do), `chart_a` and `chart_b` (the first two of them, -1 for none), `length`.
///
/// # Errors
/// [`VtpError`].
pub fn seams(mesh: &SurfaceMesh, network: &SeamNetwork) -> Result<Vec<u8>, VtpError> {
    let corners: Vec<_> = network.points().iter().filter(|p| p.corner).map(|p| p.vertex).collect();
    let of_curves = network.curves().iter().flat_map(Curve::vertices).copied();
    let vertices: Vec<_> = corners.iter().copied().chain(of_curves).collect();
    let points: Vec<f64> = vertices.iter().flat_map(|v| mesh.points()[v.index()]).collect();
    let numbers: Vec<i32> = vertices.iter().map(|v| mesh.input_vertex(*v).map_or(-2, |w| w as i32)).collect();
    let ones = vec![1; corners.len()];
    let lengths: Vec<usize> = network.curves().iter().map(|c| c.vertices().len()).collect();
    let piece = PolyDataPiece {
        points: points.into(),
        verts: (!corners.is_empty()).then(|| consecutive(0, &ones)),
        lines: Some(consecutive(corners.len(), &lengths)),
        data: Attributes { point: vec![array("vertex", numbers)], cell: cell_fields(network, corners.len()) },
        ..PolyDataPiece::default()
    };
    let vtk = Vtk {
        version: Version::new_xml(1, 0),
        byte_order: ByteOrder::LittleEndian,
        title: "planish seams".to_owned(),
        file_path: None,
        data: DataSet::inline(piece),
    };
    let library = |e: &dyn std::fmt::Display| VtpError(e.to_string());
    let mut bytes = Vec::new();
    let file = vtk.try_into_xml_format(COMPRESSOR, 1).map_err(|e| library(&e))?;
    file.write(&mut bytes).map_err(|e| library(&e))?;
    Ok(bytes)
}

/// Cells of the given numbers of points, which follow each other from point `first` on.
fn consecutive(first: usize, lengths: &[usize]) -> VertexNumbers {
    let count: usize = lengths.iter().sum();
    let ends = lengths.iter().scan(0, |end, length| {
        *end += *length as u64;
        Some(*end)
    });
    VertexNumbers::XML { connectivity: (first as u64..(first + count) as u64).collect(), offsets: ends.collect() }
}

fn array(name: &str, data: impl Into<IOBuffer>) -> Attribute {
    Attribute::DataArray(DataArray::new(name, 1).with_data(data))
}

/// The fields of the corners, then those of the curves: the order of the cells in PolyData.
fn cell_fields(network: &SeamNetwork, corners: usize) -> Vec<Attribute> {
    let whole = |name: &str, of: &dyn Fn(&Curve) -> i32, at_corner: i32| {
        let data: Vec<i32> = vec![at_corner; corners].into_iter().chain(network.curves().iter().map(of)).collect();
        array(name, data)
    };
    let beside = |c: &Curve, k: usize| c.sides().get(k).map_or(-1, |s| s.chart.0 as i32);
    let lengths: Vec<f64> = vec![0.0; corners].into_iter().chain(network.curves().iter().map(Curve::length)).collect();
    vec![
        whole("curve", &|c| c.id().0 as i32, -1),
        whole("open", &|c| i32::from(c.is_open()), 0),
        whole("sides", &|c| c.sides().len() as i32, 0),
        whole("chart_a", &|c| beside(c, 0), -1),
        whole("chart_b", &|c| beside(c, 1), -1),
        array("length", lengths),
    ]
}
