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
pub fn assemble(mesh: &SurfaceMesh, labels: &[u32]) -> Result<Atlas, Illegal> {
    let sets = by_label(labels);
    let mut places = Places::new(mesh, &sets);
    let charts = sets.into_iter().zip(0..).map(|(faces, id)| chart(mesh, ChartId(id), faces, &mut places));
    Ok(Atlas { charts: charts.collect::<Result<_, _>>()?, feature_edges: 0 })
}

/// Where faces and vertices are in their charts.
struct Places {
    /// Per face its chart and its place there.
    faces: Vec<(u32, u32)>,
    /// Per vertex its place in the chart where it was met last, and that chart.
    vertices: Vec<(u32, u32)>,
}

impl Places {
    fn new(mesh: &SurfaceMesh, sets: &[Vec<FaceId>]) -> Self {
        let mut faces = vec![(0, 0); mesh.triangles().len()];
        for (set, chart) in sets.iter().zip(0..) {
            set.iter().zip(0..).for_each(|(f, place)| faces[f.index()] = (chart, place));
        }
        Self { faces, vertices: vec![(u32::MAX, 0); mesh.points().len()] }
    }

    /// The vertices of a chart, ascending; from now on their places are those in it.
    fn enter(&mut self, mesh: &SurfaceMesh, chart: ChartId, faces: &[FaceId]) -> Vec<VertexId> {
        let mut vertices = Vec::new();
        for v in faces.iter().flat_map(|f| mesh.triangles()[f.index()]) {
            let place = &mut self.vertices[v.index()];
            if place.0 != chart.0 {
                place.0 = chart.0;
                vertices.push(v);
            }
        }
        vertices.sort_unstable();
        vertices.iter().zip(0..).for_each(|(v, place)| self.vertices[v.index()].1 = place);
        vertices
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
fn chart(mesh: &SurfaceMesh, id: ChartId, faces: Vec<FaceId>, places: &mut Places) -> Result<Chart, Illegal> {
    let vertices = places.enter(mesh, id, &faces);
    let local = |v: VertexId| VertexId(places.vertices[v.index()].1);
    let triangles: Vec<_> = faces.iter().map(|f| mesh.triangles()[f.index()].map(local)).collect();
    let inside = |f: FaceId| Some(places.faces[f.index()]).filter(|p| p.0 == id.0).map(|p| FaceId(p.1));
    let edges = mesh.edges().part(&faces, inside);
    let mut loops = legality::verify(id, &triangles, &edges, vertices.len())?;
    let shapes = faces.iter().map(|f| mesh.metric().shapes[f.index()]).collect();
    let flagged = faces.iter().map(|f| mesh.metric().flagged[f.index()]).collect();
    let scale = mesh.metric().scale;
    let patch = mesh.patch(&vertices, &faces);
    let (outer, holes) = (vec![], vec![]);
    let mut chart = Chart { id, vertices, faces, triangles, shapes, flagged, scale, edges, outer, holes, patch };
    let length = |l: &[HalfEdgeId]| l.iter().map(|h| chart.length(*h)).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(|l| length(l)).collect();
    let longest = (0..loops.len()).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
    chart.outer = loops.remove(longest);
    chart.holes = loops;
    Ok(chart)
}
