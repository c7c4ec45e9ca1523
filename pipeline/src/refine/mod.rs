//! Refinement: enough triangles for quadratic maps.
//!
//! A triangle as long as the part cannot follow a map that is not quadratic along it. The harmonic map of a ring of 36
//! facets, five radii high, is invalid on all of them where the wall is one row of triangles, and conformal within a quarter
//! where it is four. So a first map of each chart tells where the quadratic space is too poor: where halving an edge would
//! save much of the energy that the map has there ([`shares_saved`]). These triangles are bisected, without a change of the
//! surface ([`Refined`]), and charts are mapped anew.

pub(crate) mod bisect;
mod jump;

use crate::map::filled::FilledChart;
use crate::topology::{FaceId, HalfEdgeId};
use jump::{Side, jump};

/// Triangles are bisected where halving an edge saves more than this share of the energy of the map there. By experience: of scans
/// and terrains one triangle in two hundred saves a thousandth; of long facets whose map is invalid nine in ten save a
/// thousandth, and seven in ten three times as much (cad_fixture_vtk). With 3e-3, rings of four facets a row kept maps of 3 to
/// 6 where those of eight have 1.3.
pub(crate) const POOR: f64 = 5e-4;

/// Per triangle of a chart (fans left out), the share of the energy, its own and that of its neighbour, that halving its longest
/// edge would save; `uv` are those of all nodes of the harmonic map.
pub(crate) fn shares_saved(chart: &FilledChart, uv: &[[f64; 2]]) -> Vec<f64> {
    let side = |h: &HalfEdgeId| {
        let face = h.face().index();
        Side { shape: chart.shapes()[face], nodes: chart.nodes(face).map(|n| uv[n]), side: h.side() }
    };
    let is_of_chart = |h: &&HalfEdgeId| h.face().index() < chart.chart_triangles();
    let share = |face: usize| {
        let edge = chart.edges().edge(HalfEdgeId::side_of(FaceId::at(face), chart.shapes()[face].longest_side()));
        let sides: Vec<Side> = chart.edges().sides(edge).iter().filter(is_of_chart).map(side).collect();
        let found = jump(&sides);
        if found.energy > 0.0 { found.saved / found.energy } else { 0.0 }
    };
    (0..chart.chart_triangles()).map(share).collect()
}
