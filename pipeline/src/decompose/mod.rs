//! Decomposition: surface -> atlas of charts.
//!
//! A chart is connected, oriented, of genus 0, with at least one boundary loop; its loops are simple and share no
//! vertex. A surface that is one chart already (a disk, or a disk with holes) becomes an atlas of one. Any other
//! surface is refused with the numbers that say why.
//!
//! The longest loop becomes the outer one (the first, in a tie): all others are holes.

mod assemble;
mod complex;
mod dual;
mod judge;
mod lay;
mod ldl;
mod legality;
mod merge;
mod network;
mod patches;
mod predict;
mod regions;
mod search;
mod shortest;
mod straighten;
mod voronoi;

use crate::atlas::Atlas;
use crate::id::HalfEdgeId;
use crate::mesh::{Census, SurfaceMesh};
pub use assemble::assemble;
use complex::Complex;
use dual::Dual;
use judge::{Verdict, choose_outer, judge};
pub use legality::Illegal;
use merge::Limits;
use network::Network;
use patches::compact_cells;
use predict::CellGraph;
use regions::Regions;
use search::Search;
use straighten::straighten;
use voronoi::{Cells, bisect_until};

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

/// What charts must respect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The largest area ratio of a chart (see [`crate::distortion::Summary::area_ratio`]). At least 10; default 1e6.
    pub max_area_ratio: f64,
    /// The largest number of triangles of a chart; default none.
    pub max_triangles: usize,
    /// Whether all inner loops of a chart must be holes of the surface.
    pub strict_disks: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self { max_area_ratio: 1e6, max_triangles: usize::MAX, strict_disks: false }
    }
}

/// Cuts `mesh` into charts.
///
/// # Errors
/// [`Error`].
pub fn decompose(mesh: &SurfaceMesh, settings: &Settings) -> Result<Atlas, Error> {
    let dual = Dual::new(mesh);
    let limits = Limits {
        area_ratio: settings.max_area_ratio.powf(MARGIN),
        triangles: settings.max_triangles,
        strict_disks: settings.strict_disks,
    };
    let (cells, complex) = cells(&dual, &limits);
    let graph = CellGraph::new(&complex);
    let charts = Search { complex: &complex, graph: &graph, limits }.run();
    let labels: Vec<u32> = cells.of.iter().map(|c| charts.of[*c as usize]).collect();
    let breadth = |h: HalfEdgeId| graph.area(cells.of[h.face().index()]).sqrt();
    let (network, verdicts) = straightened(Network::new(&dual, labels, limits), &cells, breadth, settings);
    let mut atlas = assemble(mesh, &network.labels)?;
    choose_outer(&mut atlas, &verdicts);
    Ok(atlas)
}

/// The network with straight seams, and what is foretold of its charts. Step by step: the last one that was good is
/// kept, and there is none after one that gained little.
fn straightened<'a>(
    mut network: Network<'a>,
    cells: &Cells,
    breadth: impl Fn(HalfEdgeId) -> f64,
    settings: &Settings,
) -> (Network<'a>, Vec<Option<Verdict>>) {
    let mut verdicts = judge(&network, cells);
    for band in BANDS {
        let mut straight = network.begun_anew();
        let more = straight.seams().next().is_some() && straighten(&mut straight, |h| band * breadth(h));
        let found = if straight.labels == network.labels { break } else { judge(&straight, cells) };
        let fits = |v: &Option<Verdict>| v.is_none_or(|v| v.ratio <= settings.max_area_ratio);
        if !straight.is_sound() || !found.iter().all(fits) {
            break;
        }
        (network, verdicts) = (straight, found);
        if !more {
            break;
        }
    }
    (network, verdicts)
}

/// Legal cells of about the same size, and their complex.
fn cells(dual: &Dual, limits: &Limits) -> (Cells, Complex) {
    let cells = compact_cells(dual, |size| (size / 8).min(CELLS));
    let mut complex = Complex::default();
    let cells = bisect_until(dual, cells, |cells| {
        complex = Complex::new(dual, cells);
        let alone = (0..cells.count as u32).collect();
        let mut regions = Regions::new(&complex, alone, cells.count);
        let outlines: Vec<_> = (0..cells.count as u32).map(|r| regions.outline_of(r)).collect();
        let shapes = regions.all.iter().zip(&outlines).map(|(region, outline)| regions.shape(region, outline));
        shapes.map(|shape| limits.allow(&shape)).collect()
    });
    (cells, complex)
}

/// Charts grow up to this share of the decades of the largest area ratio: the prediction is not exact, and straight
/// seams change it.
const MARGIN: f64 = 0.85;

/// How far seams may be straightened, in sizes of a cell: shortest loops would slide off at the end of a tube, and
/// seams along a tube come together. So the area ratio is foretold again after every step, and the last good one kept.
const BANDS: [f64; 3] = [1.0, 1.5, 2.0];

/// Cells per component, at most.
const CELLS: usize = 800;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::id::VertexId;
    use crate::repair::{Settings, repair};
    use crate::{mesh::TriangleSoup, shapes};

    fn atlas(soup: &TriangleSoup) -> Result<Atlas, Error> {
        decompose(&repair(soup, &Settings::default()).expect("a surface is left").mesh, &Default::default())
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
