//! Decomposition: surface -> atlas of charts.
//!
//! A chart is connected, oriented, of genus 0, with at least one boundary loop; its loops are simple and share no
//! vertex. A surface that is one chart already (a disk, or a disk with holes) becomes an atlas of one. Any other
//! surface is refused with the numbers that say why.
//!
//! The longest loop becomes the outer one (the first, in a tie): all others are holes.

mod assemble;
mod legality;

use crate::atlas::Atlas;
use crate::mesh::{Census, SurfaceMesh};
pub use assemble::assemble;
pub use legality::Illegal;

/// Why a surface has no atlas.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// The surface is no disk and no disk with holes.
    #[error("{}", needs_decomposition(.0))]
    NeedsDecomposition(Box<Census>),
    /// A chart came out that is none: a fault of planish.
    #[error(transparent)]
    Illegal(#[from] Illegal),
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
    Ok(assemble(mesh, &vec![0; mesh.triangles().len()])?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::VertexId;
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
