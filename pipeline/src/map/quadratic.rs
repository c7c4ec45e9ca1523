//! Quadratic map: the harmonic map by P2 finite elements.
//!
//! u and v solve two Laplace problems over the chart (holes closed by virtual fans, or open) by 6-node triangles, with the
//! nodes of the outer loop prescribed ([`super::harmonic`], for quadratic elements). The map minimises the Dirichlet energy among all quadratic maps with these boundary
//! values; it need not be valid, and typically a few triangles in a thousand are not.

use super::harmonic::{dirichlet_energy, harmonic_map, iterated_harmonic_map};
use crate::fem::bernstein::{self, JacobianBezier, Validity};
use crate::fem::element::P2;
use crate::fem::jacobian::CornerDerivatives;
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
    /// A quadratic map that was found otherwise: the `uv` of all nodes of the filled chart, and the `energy` that it has by
    /// whatever it minimises.
    ///
    /// # Panics
    /// If there are not as many uv as nodes.
    pub fn of(chart: &FilledChart, uv: Vec<[f64; 2]>, energy: f64) -> Self {
        assert_eq!(uv.len(), chart.node_count(), "the uv of every node");
        let nodes = to_grid(chart, &uv);
        let invalid = invalid_triangles(chart, &nodes);
        Self { uv, nodes, invalid, energy }
    }

    /// The uv of all nodes of the filled chart, as they were solved for. They may lie far outside the disk: there
    /// is no maximum principle for quadratic elements.
    pub fn uv(&self) -> &[[f64; 2]] {
        &self.uv
    }

    /// The uv of all nodes of the filled chart, on the grid.
    pub fn nodes(&self) -> &[GridPoint] {
        &self.nodes
    }

    /// The triangles of the chart whose jacobian is not positive everywhere, decided exactly; ascending, no fans.
    pub fn invalid(&self) -> &[FaceId] {
        &self.invalid
    }

    /// Its energy, that of the fans included: no map with this boundary has less.
    pub fn energy(&self) -> f64 {
        self.energy
    }
}

/// Charts of no more nodes are mapped by factorising their system. Larger ones come to the same map, up to 1e-11 of its energy, by
/// conjugate gradients, which take a third of the memory and as much time; where triangles are so poor that they would take longer
/// (st_helens_dem) the system is factorised all the same.
const FACTORISED: usize = 250_000;

/// Systems of more nodes are not factorised if conjugate gradients come to rest at all: factors take a kilobyte for each.
const TOO_LARGE: usize = 4_000_000;

/// Computes the harmonic map of `chart` with its outer loop on `boundary`.
///
/// # Errors
/// [`sparse::Error`]: the system cannot be factorised, or interrupted.
///
/// # Example
///
/// On a strongly bent disk the map has less energy than any other, and some invalid triangles.
///
/// ```
/// use planish_core::map::boundary::{Boundary, Mids};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::linear::linear_map;
/// use planish_core::map::quadratic::{energy, min_det, quadratic_map};
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::bent_disk(12, 0.45, 1.0), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// let boundary = Boundary::circle(&chart, Mids::Arc);
/// let harmonic = quadratic_map(&chart, &boundary, &NoMonitor)?;
/// assert!(!harmonic.invalid().is_empty() && min_det(&chart, &harmonic) < 0.0);
/// // The linear map does not fold, and has more energy.
/// let linear = linear_map(&chart, &boundary, &NoMonitor)?.degree_elevated(&chart, &boundary);
/// assert!(harmonic.energy() < energy(&chart, &linear));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn quadratic_map(
    chart: &FilledChart,
    boundary: &Boundary,
    monitor: &dyn Monitor,
) -> Result<QuadraticMap, sparse::Error> {
    let on_outer = |edge: usize, share: f64| {
        let at = if share == 0.0 { boundary.vertices() } else { boundary.mids() };
        at[edge].uv()
    };
    let iterated = match chart.node_count() {
        few if few <= FACTORISED => None,
        nodes => iterated_harmonic_map(chart, on_outer, nodes > TOO_LARGE, monitor)?,
    };
    let uv = match iterated {
        Some(uv) => uv,
        None => harmonic_map::<P2, 6>(chart, on_outer, monitor)?,
    };
    let nodes = to_grid(chart, &uv);
    Checkpoint::new(monitor).after(chart.triangles().len())?;
    let invalid = invalid_triangles(chart, &nodes);
    // Of the solution itself: the grid ends not far outside the disk, and what was cut off there is no lower bound.
    let energy = dirichlet_energy::<P2, 6>(chart, &uv);
    Ok(QuadraticMap { uv, nodes, invalid, energy })
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
    let of_chart = 0..chart.chart_triangles();
    let invalid = of_chart.filter(|f| det(chart, nodes, *f).validity() == Validity::Invalid);
    invalid.map(FaceId::at).collect()
}

/// The least jacobian of a harmonic map over all triangles of the chart, per unit of mollified area of the triangle in
/// space, in the unit of the shapes. Up to rounding: whether it is positive is decided by [`QuadraticMap::invalid`].
pub fn min_det(chart: &FilledChart, map: &QuadraticMap) -> f64 {
    let mut least = f64::INFINITY;
    for f in 0..chart.chart_triangles() {
        let dets = CornerDerivatives::new(&chart.nodes(f).map(|n| map.uv[n])).dets();
        // The determinant is taken on the reference triangle, of area 1/2.
        let doubled_area = 2.0 * chart.shapes()[f].area();
        least = least.min(bernstein::range(dets).min / doubled_area);
    }
    least
}

/// The Dirichlet energy of a map of the filled chart, fans included.
pub fn energy(chart: &FilledChart, nodes: &[GridPoint]) -> f64 {
    let uv: Vec<[f64; 2]> = nodes.iter().map(|p| p.uv()).collect();
    dirichlet_energy::<P2, 6>(chart, &uv)
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
