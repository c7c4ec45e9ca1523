//! From labels to charts: every set of equally labelled triangles becomes a chart, if it can be one.

use super::legality::{self, Illegal};
use crate::atlas::{Atlas, Chart};
use crate::mesh::SurfaceMesh;
use crate::topology::{ChartId, FaceId, HalfEdgeId, VertexId};

/// The atlas in which the triangles of equal label form a chart. Charts are numbered in the order of their first
/// triangles, whatever the labels.
///
/// # Errors
/// [`Illegal`], for the first chart that is no disk with or without holes.
///
/// ```
/// use planish_core::decompose::{Illegal, assemble};
/// use planish_core::{repair, shapes};
///
/// let mesh = repair(&shapes::sphere(8), &repair::Settings::default())?.mesh;
/// let is_north = |face: usize| mesh.corners(face).iter().map(|p| p[2]).sum::<f64>() > 0.0;
/// let labels: Vec<u32> = (0..mesh.triangles().len()).map(|f| u32::from(is_north(f))).collect();
/// assert_eq!(assemble(&mesh, &labels)?.charts().len(), 2);
/// // The whole sphere has no boundary: it is no chart.
/// let whole = assemble(&mesh, &vec![0; labels.len()]);
/// assert!(matches!(whole, Err(Illegal::Topology { loops: 0, euler: 2, .. })));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Panics
/// If there is not one label for every triangle.
pub fn assemble(mesh: &SurfaceMesh, labels: &[u32]) -> Result<Atlas, Illegal> {
    assert_eq!(labels.len(), mesh.triangles().len(), "a label for every triangle");
    let sets = by_label(labels);
    let mut positions = ChartPositions::new(mesh, &sets);
    let charts = sets.into_iter().zip(0..).map(|(faces, id)| chart(mesh, ChartId(id), faces, &mut positions));
    Ok(Atlas { charts: charts.collect::<Result<_, _>>()?, feature_edges: 0 })
}

/// The chart, numbered `id`, with that loop as the outer one on which the vertex `on_outer` of the surface lies: of loops that
/// are as long, rounding would choose.
pub(crate) fn with_outer(mut chart: Chart, id: ChartId, on_outer: VertexId) -> Chart {
    let is_outer = |l: &Vec<HalfEdgeId>| l.iter().any(|h| chart.vertices[chart.from(*h).index()] == on_outer);
    if let Some(hole) = chart.holes.iter().position(is_outer) {
        std::mem::swap(&mut chart.outer, &mut chart.holes[hole]);
    }
    chart.id = id;
    chart
}

/// What a face or a vertex of the surface is in a chart.
#[derive(Clone, Copy)]
struct Local {
    chart: u32,
    /// Its number in the chart.
    number: u32,
}

/// Where faces and vertices are in their charts. One table serves all charts: nothing is allocated chart by chart.
struct ChartPositions {
    /// Per face, where it is.
    faces: Vec<Local>,
    /// Per vertex, where it is in the chart that was entered last among those that have it.
    vertices: Vec<Local>,
}

impl ChartPositions {
    fn new(mesh: &SurfaceMesh, sets: &[Vec<FaceId>]) -> Self {
        let mut faces = vec![Local { chart: 0, number: 0 }; mesh.triangles().len()];
        for (set, chart) in sets.iter().zip(0..) {
            for (face, number) in set.iter().zip(0..) {
                faces[face.index()] = Local { chart, number };
            }
        }
        let nowhere = Local { chart: u32::MAX, number: 0 };
        Self { faces, vertices: vec![nowhere; mesh.points().len()] }
    }

    /// The vertices of a chart, ascending; from now on their positions are those in it.
    fn enter(&mut self, mesh: &SurfaceMesh, chart: ChartId, faces: &[FaceId]) -> Vec<VertexId> {
        let mut vertices = Vec::new();
        for v in faces.iter().flat_map(|f| mesh.triangles()[f.index()]) {
            let position = &mut self.vertices[v.index()];
            if position.chart != chart.0 {
                position.chart = chart.0;
                vertices.push(v);
            }
        }
        vertices.sort_unstable();
        for (v, number) in vertices.iter().zip(0..) {
            self.vertices[v.index()].number = number;
        }
        vertices
    }

    /// The face as one of a chart; none where it belongs to another one.
    fn face_in(&self, chart: ChartId, face: FaceId) -> Option<FaceId> {
        let local = self.faces[face.index()];
        (local.chart == chart.0).then_some(FaceId(local.number))
    }
}

/// The faces of each label, ascending; labels in the order of their first faces.
fn by_label(labels: &[u32]) -> Vec<Vec<FaceId>> {
    let highest = labels.iter().max().map_or(0, |l| *l as usize + 1);
    let mut number = vec![u32::MAX; highest];
    let mut sets: Vec<Vec<FaceId>> = Vec::new();
    for (face, label) in labels.iter().enumerate() {
        let slot = &mut number[*label as usize];
        if *slot == u32::MAX {
            *slot = sets.len() as u32;
            sets.push(Vec::new());
        }
        sets[*slot as usize].push(FaceId::at(face));
    }
    sets
}

/// The chart of `faces`, ascending.
///
/// # Errors
/// [`Illegal`] where they form none.
fn chart(
    mesh: &SurfaceMesh,
    id: ChartId,
    faces: Vec<FaceId>,
    positions: &mut ChartPositions,
) -> Result<Chart, Illegal> {
    let vertices = positions.enter(mesh, id, &faces);
    let local = |v: VertexId| VertexId(positions.vertices[v.index()].number);
    let triangles: Vec<_> = faces.iter().map(|f| mesh.triangles()[f.index()].map(local)).collect();
    let edges = mesh.edges().part(&faces, |face| positions.face_in(id, face));
    let mut loops = legality::verify(id, &triangles, &edges, vertices.len())?;
    let metric = mesh.metric();
    let shapes = faces.iter().map(|f| metric.shapes[f.index()]).collect();
    let flagged = faces.iter().map(|f| metric.flagged[f.index()]).collect();
    let scale = metric.scale;
    let patch = mesh.patch(&vertices, &faces);
    let (outer, holes) = (vec![], vec![]);
    let mut chart = Chart { id, vertices, faces, triangles, shapes, flagged, scale, edges, outer, holes, patch };
    // A chart has at least one loop.
    chart.outer = loops.remove(longest(&chart, &loops));
    chart.holes = loops;
    Ok(chart)
}

/// Which of the loops is the longest; of those that are as long, the first one.
fn longest(chart: &Chart, loops: &[Vec<HalfEdgeId>]) -> usize {
    let mut longest = 0;
    let mut most = 0.0;
    for (i, boundary_loop) in loops.iter().enumerate() {
        let length: f64 = boundary_loop.iter().map(|h| chart.length(*h)).sum();
        if length > most {
            (longest, most) = (i, length);
        }
    }
    longest
}
