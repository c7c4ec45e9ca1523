//! Quadratic map: the harmonic map by P2 finite elements.
//!
//! u and v solve two Laplace problems over the chart (holes closed by virtual fans) by 6-node triangles, with the
//! nodes of the outer loop prescribed: one factorisation, two right-hand sides. Triangles are flat in space, their
//! metric is constant. The map minimises the Dirichlet energy among all quadratic maps with these boundary
//! values; it need not be valid, and typically a few triangles in a thousand are not.

use super::elimination;
use crate::fem::bernstein::{self, JacobianBezier, Validity};
use crate::fem::dofs::Dofs;
use crate::fem::element::{self, Element, P2};
use crate::fem::jacobian::CornerDerivatives;
use crate::fem::laplace;
use crate::fem::sparse;
use crate::grid::GridPoint;
use crate::map::boundary::Boundary;
use crate::map::filled::FilledChart;
use crate::monitor::{Checkpoint, Monitor};
use crate::topology::FaceId;

/// The harmonic map by quadratic elements, valid or not.
#[derive(Clone, Debug)]
pub struct QuadraticMap {
    uv: Vec<[f64; 2]>,
    nodes: Vec<GridPoint>,
    invalid: Vec<FaceId>,
    energy: f64,
}

impl QuadraticMap {
    /// The uv of all nodes of the filled chart, as they were solved for. They may lie far outside the disk: there
    /// is no maximum principle for quadratic elements.
    pub fn uv(&self) -> &[[f64; 2]] {
        &self.uv
    }

    /// The uv of all nodes of the filled chart, on the grid.
    pub fn nodes(&self) -> &[GridPoint] {
        &self.nodes
    }

    /// The triangles of the chart whose jacobian is not positive everywhere.
    pub fn invalid(&self) -> &[FaceId] {
        &self.invalid
    }

    /// The Dirichlet energy, that of the fans included: no map with this boundary has less.
    pub fn energy(&self) -> f64 {
        self.energy
    }
}

/// Computes the harmonic map of `chart` with its outer loop on `boundary`.
///
/// # Errors
/// [`sparse::Error`]: the system cannot be factorised, or interrupted.
pub fn quadratic_map(
    chart: &FilledChart,
    boundary: &Boundary,
    monitor: &dyn Monitor,
) -> Result<QuadraticMap, sparse::Error> {
    let checkpoint = Checkpoint::new(monitor);
    let (dofs, prescribed) = prescribe(chart, boundary);
    let stiffness = |face: usize| P2::stiffness(&chart.shapes()[face]);
    let faces = chart.triangles().len();
    let uv = laplace::harmonic(&dofs, faces, |f| chart.nodes(f), stiffness, prescribed, &checkpoint)?;
    let nodes = to_grid(chart, &uv);
    checkpoint.after(faces)?;
    let invalid = invalid_triangles(chart, &nodes);
    // Of the solution itself: the grid ends not far outside the disk, and what was cut off there is no lower bound.
    let energy = energy_of(chart, &uv);
    Ok(QuadraticMap { uv, nodes, invalid, energy })
}

/// The unknowns, in the order of elimination: all nodes that are not on the outer loop. And the values of the others.
fn prescribe(chart: &FilledChart, boundary: &Boundary) -> (Dofs, Vec<[f64; 2]>) {
    let mut uv = vec![[0.0; 2]; chart.node_count()];
    for (i, h) in chart.outer().iter().enumerate() {
        uv[chart.vertex_node(chart.ends(*h)[0])] = boundary.vertices()[i].uv();
        uv[chart.mid_node(*h)] = boundary.mids()[i].uv();
    }
    (elimination::dofs_inside(chart), uv)
}

/// Rounds the nodes of a filled chart to the grid: vertices to that of vertices, all others to that of mid-edge
/// nodes.
pub(crate) fn to_grid(chart: &FilledChart, uv: &[[f64; 2]]) -> Vec<GridPoint> {
    uv.iter().enumerate().map(|(n, p)| node_to_grid(chart, n, *p)).collect()
}

/// Rounds one node of a filled chart to its grid.
pub(crate) fn node_to_grid(chart: &FilledChart, node: usize, uv: [f64; 2]) -> GridPoint {
    let centres = chart.chart_nodes()..chart.chart_nodes() + chart.loops().len();
    let is_vertex = node < chart.chart_vertices() || centres.contains(&node);
    if is_vertex { GridPoint::vertex(uv) } else { GridPoint::mid(uv) }
}

/// The jacobian coefficients of a triangle.
pub(crate) fn det(chart: &FilledChart, nodes: &[GridPoint], face: usize) -> JacobianBezier {
    JacobianBezier::new(chart.nodes(face).map(|n| nodes[n]))
}

/// The triangles of the chart (not the fans) that are invalid, exactly.
pub(crate) fn invalid_triangles(chart: &FilledChart, nodes: &[GridPoint]) -> Vec<FaceId> {
    let own = 0..chart.chart_triangles();
    own.filter(|f| det(chart, nodes, *f).validity() == Validity::Invalid).map(FaceId::at).collect()
}

/// The least jacobian of a harmonic map over all triangles of the chart, per unit of mollified area of the triangle in
/// space, in the unit of the shapes.
pub fn min_det(chart: &FilledChart, map: &QuadraticMap) -> f64 {
    let relative = |f: usize| {
        let dets = CornerDerivatives::new(&chart.nodes(f).map(|n| map.uv[n])).dets();
        bernstein::range(dets).min / (2.0 * chart.shapes()[f].area())
    };
    (0..chart.chart_triangles()).map(relative).fold(f64::INFINITY, f64::min)
}

/// The Dirichlet energy of a map of the filled chart, fans included.
pub fn energy(chart: &FilledChart, nodes: &[GridPoint]) -> f64 {
    energy_of(chart, &nodes.iter().map(|p| p.uv()).collect::<Vec<_>>())
}

fn energy_of(chart: &FilledChart, uv: &[[f64; 2]]) -> f64 {
    let of_face = |f: usize| element::energy(&P2::stiffness(&chart.shapes()[f]), &chart.nodes(f).map(|n| uv[n]));
    (0..chart.triangles().len()).map(of_face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::boundary::Mids;
    use crate::map::linear;
    use crate::monitor::NoMonitor;
    use crate::{decompose, repair, shapes};

    #[test]
    fn the_map_has_no_more_energy_than_the_degree_elevated_linear_one() {
        let mesh = repair(&shapes::disk_with_holes(13, 2), &Default::default()).expect("a surface").mesh;
        let chart = FilledChart::new(
            &decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0],
        );
        let boundary = Boundary::circle(&chart, Mids::Arc);
        let start = linear::linear_map(&chart, &boundary, &NoMonitor).expect("maps").degree_elevated(&chart, &boundary);
        let map = quadratic_map(&chart, &boundary, &NoMonitor).expect("solves");
        assert!(map.energy() < energy(&chart, &start));
        // Moving any node raises the energy: the map is the minimiser.
        for node in [20, chart.chart_vertices() + 100, chart.chart_nodes(), chart.node_count() - 1] {
            let mut moved = map.nodes().to_vec();
            moved[node].x += 1 << 40;
            assert!(energy(&chart, &moved) > map.energy());
        }
    }

    #[test]
    fn a_flat_round_disk_is_mapped_to_itself() {
        let mesh = repair(&shapes::flat_disk(6), &Default::default()).expect("a surface").mesh;
        let chart = FilledChart::new(
            &decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0],
        );
        let boundary = Boundary::circle(&chart, Mids::Chord);
        let map = quadratic_map(&chart, &boundary, &NoMonitor).expect("solves");
        assert!(map.invalid().is_empty());
        // The start of the loop may be turned: distances from the centre are kept.
        for (v, p) in mesh.points().iter().enumerate() {
            let [x, y] = map.nodes()[v].uv();
            assert!((x.hypot(y) - p[0].hypot(p[1])).abs() < 1e-13);
        }
    }
}
