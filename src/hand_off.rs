//! The hand-off to Gmsh: `atlas.msh` and `remesh.geo`, with the edge length that the script asks for.

use crate::formats::gmsh;
use crate::report::HandOff;
use pipeline::CertifiedChart;
use pipeline::atlas::Chart;
use pipeline::id::{ChartId, FaceId};
use pipeline::mesh::SurfaceMesh;
use pipeline::seams::SeamNetwork;
use pipeline::subdivide::{self, LinearAtlas, subdivide};

/// Gmsh gets at least this many edges along the diagonal of the bounding box, unless another size is asked for.
const EDGES_PER_DIAGONAL: f64 = 50.0;

/// The files of a hand-off, and the account of it.
#[derive(Debug)]
pub struct HandedOff {
    /// Names and contents; none where the hand-off failed.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the report says.
    pub report: HandOff,
}

/// Hands charts with their certified maps to Gmsh, for triangles with edges of length `size` (by default
/// [`default_size`]). Warns where Gmsh would do badly; a hand-off that fails is told and leaves the maps as they are.
pub fn gmsh(
    mesh: &SurfaceMesh,
    charts: &[Chart],
    maps: &[CertifiedChart],
    network: &SeamNetwork,
    size: Option<f64>,
) -> HandedOff {
    let size = size.unwrap_or_else(|| default_size(mesh));
    let shortest_seam_distance = network.shortest_distance(mesh);
    let mut report = HandOff { size, shortest_seam_distance, ..HandOff::default() };
    report.warning = shortest_seam_distance.filter(|d| size > 0.5 * d).map(|d| too_coarse(size, d));
    let linear = match subdivide(mesh, charts, maps, network) {
        Ok(linear) => linear,
        Err(error) => {
            let failure = failure(&error, mesh, charts);
            tracing::warn!("no hand-off to Gmsh: {failure}");
            return HandedOff { files: vec![], report: HandOff { failure: Some(failure), ..report } };
        }
    };
    if let Some(warning) = &report.warning {
        tracing::warn!("hand-off to Gmsh: {warning}");
    }
    HandedOff { files: files(mesh, charts, &linear, network, size), report: counted(report, &linear) }
}

fn files(
    mesh: &SurfaceMesh,
    charts: &[Chart],
    linear: &LinearAtlas,
    network: &SeamNetwork,
    size: f64,
) -> Vec<(String, Vec<u8>)> {
    let script =
        gmsh::Script { size, area: mesh.area(), surfaces: linear.charts().len(), curves: linear.curves().len() };
    vec![
        (gmsh::ATLAS.to_owned(), gmsh::atlas(charts, linear, network)),
        (gmsh::REMESH.to_owned(), gmsh::remesh(&script)),
    ]
}

fn counted(report: HandOff, linear: &LinearAtlas) -> HandOff {
    HandOff {
        sub_triangles: linear.triangle_count(),
        refined: linear.refined(),
        linear_charts: linear.linear_charts().iter().map(|c| c.0).collect(),
        moved_vertices: linear.moved(),
        ..report
    }
}

/// The edge length of as many equilateral triangles of the same area, but at most a fiftieth of the diagonal of the
/// bounding box. In the unit of the input.
pub fn default_size(mesh: &SurfaceMesh) -> f64 {
    let coarsest = mesh.bounding_box().diagonal() / EDGES_PER_DIAGONAL;
    let share = mesh.area() / mesh.triangles().len() as f64;
    let edge = (share * 4.0 / 3.0_f64.sqrt()).sqrt();
    if edge > 0.0 { edge.min(coarsest) } else { coarsest }
}

/// What may go wrong, and what helps: an edge length only where it is one that `--size` takes.
fn too_coarse(size: f64, distance: f64) -> String {
    let fine = 0.499 * distance;
    let remedy = if fine.is_normal() {
        format!("give --size {fine:.4e} or less")
    } else {
        "no edge length helps where seams touch; see the warnings about the surface, and repair it there".to_owned()
    };
    format!(
        "the edge length {size:.4e} is more than half the shortest distance between two seams of a chart \
         ({distance:.4e}): triangles of neighbouring charts may come to lie on each other; {remedy}"
    )
}

/// Why there is no hand-off, with a triangle by its number in the input.
fn failure(error: &subdivide::Error, mesh: &SurfaceMesh, charts: &[Chart]) -> String {
    let source = |chart: &ChartId, face: &FaceId| {
        let faces = charts.get(chart.index()).map(Chart::faces);
        let face = faces.and_then(|f| f.get(face.index()));
        face.map_or(String::new(), |f| format!(" (triangle {} of the input)", mesh.source_triangle(f.index())))
    };
    let place = match error {
        subdivide::Error::Inverted(i) => source(&i.chart, &i.face),
        subdivide::Error::NoNormal { chart, face } => source(chart, face) + "; use a larger unit of length",
        subdivide::Error::MeetsItself { .. } | subdivide::Error::Pinched { .. } => String::new(),
    };
    format!("{error}{place}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Said;

    #[test]
    fn an_edge_length_is_advised_only_where_it_is_taken() {
        for distance in [3.7, 1e-9, 4.5e-308, 1e-320, 0.0] {
            let message = too_coarse(10.0, distance);
            let advised = message.split_once("--size ").and_then(|(_, rest)| rest.split(' ').next());
            let size: Option<f64> = advised.map(|a| a.parse().expect("a number"));
            assert!(size.is_none_or(|s| s < 0.5 * distance), "{message}");
            assert!(Said { size, ..Said::default() }.check().is_ok(), "{message}");
            assert_eq!(size.is_some(), distance > 1e-310, "{message}");
        }
    }
}
