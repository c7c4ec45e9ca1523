//! Decomposition: surface -> atlas of charts.
//!
//! A chart is connected, oriented, of genus 0, with at least one boundary loop; its loops are simple and share no
//! vertex. A surface that is one chart already (a disk, or a disk with holes) becomes an atlas of one. Any other
//! surface is refused with the numbers that say why.
//!
//! The longest loop becomes the outer one (the first, in a tie): all others are holes.

use crate::atlas::{Atlas, Chart};
use crate::id::{ChartId, FaceId, HalfEdgeId, VertexId};
use crate::mesh::{Census, EdgeTable, SurfaceMesh};

/// Why a surface has no atlas.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The surface is no disk and no disk with holes.
    #[error("{}", needs_decomposition(.0))]
    NeedsDecomposition(Box<Census>),
}

fn needs_decomposition(c: &Census) -> String {
    let genus = c.genus.map_or("no genus".to_owned(), |g| format!("genus {g}"));
    let kind = if c.orientable { "orientable" } else { "not orientable" };
    format!(
        "the surface is not one disk (with or without holes): {} components, {genus}, {} boundary loops, {kind}, \
         {} non-manifold edges, {} non-manifold vertices; cut it into such pieces, one file each",
        c.components, c.boundary_loops, c.nonmanifold_edges, c.nonmanifold_vertices
    )
}

/// Cuts `mesh` into charts.
///
/// # Errors
/// [`Error::NeedsDecomposition`] where one chart cannot carry the surface.
pub fn decompose(mesh: &SurfaceMesh) -> Result<Atlas, Error> {
    if !mesh.census().is_one_chart() {
        return Err(Error::NeedsDecomposition(Box::new(mesh.census().clone())));
    }
    let faces = (0..mesh.triangles().len()).map(FaceId::at).collect();
    Ok(Atlas { charts: vec![chart(mesh, ChartId(0), faces)] })
}

/// The chart of `faces`, ascending, which form a legal chart.
fn chart(mesh: &SurfaceMesh, id: ChartId, faces: Vec<FaceId>) -> Chart {
    let mut vertices: Vec<VertexId> = faces.iter().flat_map(|f| mesh.triangles()[f.index()]).collect();
    vertices.sort_unstable();
    vertices.dedup();
    let local = |v: VertexId| VertexId::at(vertices.partition_point(|u| *u < v));
    let triangles: Vec<_> = faces.iter().map(|f| mesh.triangles()[f.index()].map(local)).collect();
    let edges = EdgeTable::new(&triangles);
    let shapes = faces.iter().map(|f| mesh.metric().shapes[f.index()]).collect();
    let flagged = faces.iter().map(|f| mesh.metric().flagged[f.index()]).collect();
    let mut loops = boundary_loops(&triangles, &edges, vertices.len());
    let scale = mesh.metric().scale;
    let mut chart =
        Chart { id, vertices, faces, triangles, shapes, flagged, scale, edges, outer: vec![], holes: vec![] };
    let length = |l: &[HalfEdgeId]| l.iter().map(|h| chart.length(*h)).sum::<f64>();
    let lengths: Vec<f64> = loops.iter().map(|l| length(l)).collect();
    let longest = (0..loops.len()).fold(0, |best, i| if lengths[i] > lengths[best] { i } else { best });
    chart.outer = loops.remove(longest);
    chart.holes = loops;
    chart
}

/// The boundary loops, each from its least half-edge on, in the order of these. Every boundary vertex has one
/// boundary half-edge out and one in, so following them returns to the start.
fn boundary_loops(triangles: &[[VertexId; 3]], edges: &EdgeTable, vertices: usize) -> Vec<Vec<HalfEdgeId>> {
    let from = |h: HalfEdgeId| triangles[h.face().index()][h.side()];
    let to = |h: HalfEdgeId| triangles[h.face().index()][h.next().side()];
    let boundary: Vec<HalfEdgeId> =
        (0..3 * triangles.len()).map(HalfEdgeId::at).filter(|h| edges.is_boundary(*h)).collect();
    let mut out: Vec<Option<HalfEdgeId>> = vec![None; vertices];
    boundary.iter().for_each(|h| out[from(*h).index()] = Some(*h));
    let mut loops = Vec::new();
    for start in boundary {
        let mut turn = Vec::new();
        let mut at = from(start);
        // Taking the half-edge away ends the walk: each is visited once.
        while let Some(h) = out[at.index()].take() {
            turn.push(h);
            at = to(h);
        }
        if !turn.is_empty() {
            loops.push(turn);
        }
    }
    loops
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::{Settings, repair};
    use crate::{mesh::TriangleSoup, shapes};

    fn atlas(soup: &TriangleSoup) -> Result<Atlas, Error> {
        decompose(&repair(soup, &Settings::default()).expect("a surface is left").mesh)
    }

    #[test]
    fn a_disk_with_holes_is_one_legal_chart() {
        let atlas = atlas(&shapes::disk_with_holes(17, 3)).expect("one chart");
        let chart = &atlas.charts()[0];
        assert_eq!((atlas.charts().len(), chart.holes().len(), chart.outer().len()), (1, 3, 68));
        let mut on_loops: Vec<VertexId> =
            chart.holes().iter().flatten().chain(chart.outer()).map(|h| chart.from(*h)).collect();
        let all = on_loops.len();
        on_loops.sort_unstable();
        on_loops.dedup();
        assert_eq!(on_loops.len(), all, "loops are simple and share no vertex");
        let chi = chart.vertices().len() as i64 - chart.edges().len() as i64 + chart.triangles().len() as i64;
        assert_eq!((2 - 4 - chi) / 2, 0, "genus 0");
        for l in chart.holes().iter().chain([&chart.outer().to_vec()]) {
            for (i, h) in l.iter().enumerate() {
                let next = l[(i + 1) % l.len()];
                assert_eq!(chart.triangles()[h.face().index()][h.next().side()], chart.from(next));
            }
        }
    }

    #[test]
    fn what_needs_several_charts_is_refused_with_its_numbers() {
        for soup in [shapes::sphere(5), shapes::bow_tie(), shapes::moebius(7)] {
            let Err(Error::NeedsDecomposition(census)) = atlas(&soup) else { panic!("not one chart") };
            assert!(!census.is_one_chart());
        }
        let message = atlas(&shapes::sphere(5)).expect_err("closed").to_string();
        assert!(message.contains("1 components, genus 0, 0 boundary loops"), "{message}");
    }
}
