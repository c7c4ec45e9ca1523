//! The optimisation problem on a region of a chart: an objective plus penalties, over the nodes that may move.

use super::arcs::{self, ArcNodes};
use super::curvature::add_curvature;
use super::objective::{LocalModel, Objective, SCALARS};
use super::penalty::{Bound, Penalty, Value};
use crate::fem::dofs::Dofs;
use crate::fem::element::P2Nodes;
use crate::fem::jacobian::CornerDerivatives;
use crate::fem::sparse::{Analysis, Error, PRESCRIBED, Pattern, Unsolvable};
use crate::map::filled::FilledChart;
use crate::monitor::{Checkpoint, Interrupted};
use crate::topology::FaceId;

/// The work of a triangle: as long as so many are looked at elsewhere.
const WORK_PER_CELL: usize = 4;

/// Where rounding makes a Hessian singular its diagonal is raised by this share, then by a hundred times as much, and so
/// on, up to the largest. Between what rounding does and what would be felt; chosen by experience.
const FIRST_SHIFT: f64 = 1e-12;
const LAST_SHIFT: f64 = 1e-2;

/// A triangle of the region, with penalties on its six coefficients (none on virtual fans).
pub(super) struct Cell {
    pub face: FaceId,
    pub bounds: Option<[Bound; 6]>,
}

/// An arc of a hole's loop with its star centre, with penalties on its three products.
pub(super) struct ArcCell {
    pub nodes: [u32; 4],
    pub bounds: [Bound; 3],
}

/// The part of a chart in which nodes may move, the objective, and the penalties that hold there. Its nodes have
/// numbers of their own, so that a small region costs little, however large the chart is.
pub(super) struct Problem<'a, O> {
    chart: &'a FilledChart,
    objective: &'a O,
    checkpoint: &'a Checkpoint<'a>,
    pub cells: Vec<Cell>,
    pub arcs: Vec<ArcCell>,
    /// The nodes of the region in the numbering of the chart (star centres after all others), ascending.
    nodes: Vec<u32>,
    /// Per cell, its six nodes in the numbering of the region.
    of_cell: Vec<[u32; 6]>,
    /// The nodes of the region that may move.
    dofs: Dofs,
}

/// Slope and curvature of objective and penalties at a point.
pub(super) struct Model {
    pub gradient: Vec<f64>,
    pub hessian: Vec<f64>,
}

/// A node that moved, in the numbering of the chart, and where it is now.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moved {
    pub node: usize,
    pub uv: [f64; 2],
}

impl<'a, O: Objective> Problem<'a, O> {
    /// The problem on `cells` and `arcs`, of whose nodes those in `free` may move; nodes as numbered in the chart,
    /// star centres after all others.
    pub fn new(
        chart: &'a FilledChart,
        objective: &'a O,
        cells: Vec<Cell>,
        mut arcs: Vec<ArcCell>,
        free: &[u32],
        checkpoint: &'a Checkpoint,
    ) -> Self {
        let in_chart = |cell: &Cell| chart.nodes(cell.face.index()).map(|n| n as u32);
        let of_arcs = arcs.iter().flat_map(|a| a.nodes);
        let mut nodes: Vec<u32> = cells.iter().flat_map(in_chart).chain(of_arcs).collect();
        nodes.sort_unstable();
        nodes.dedup();
        // From the numbering of the chart to that of the region: the position among all nodes of the region.
        let local = |n: u32| nodes.partition_point(|m| *m < n) as u32;
        let of_cell = cells.iter().map(|c| in_chart(c).map(local)).collect();
        for arc in &mut arcs {
            arc.nodes = arc.nodes.map(local);
        }
        let dofs = Dofs::new(nodes.len(), free.iter().map(|n| local(*n)).collect());
        Self { chart, objective, checkpoint, cells, arcs, nodes, of_cell, dofs }
    }

    /// A safe point, after all triangles of the region were looked at.
    pub fn checkpoint(&self) -> Result<(), Interrupted> {
        self.checkpoint.after(WORK_PER_CELL * self.cells.len())
    }

    /// The nodes of the region, as numbered in the chart, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The uv of the region's nodes, out of those of the whole chart.
    pub fn gather(&self, all: &[[f64; 2]]) -> Vec<[f64; 2]> {
        self.nodes.iter().map(|n| all[*n as usize]).collect()
    }

    /// The nodes that may move, in the numbering of the region.
    pub fn free(&self) -> &[u32] {
        self.dofs.free()
    }

    /// The nodes that may move, as numbered in the chart, each with its uv in `x`.
    pub fn moved(&self, x: &[[f64; 2]]) -> impl Iterator<Item = Moved> {
        self.free().iter().map(|n| Moved { node: self.nodes[*n as usize] as usize, uv: x[*n as usize] })
    }

    /// The number of scalar unknowns: two per free node.
    pub fn unknowns(&self) -> usize {
        2 * self.dofs.count()
    }

    /// The pattern of the Hessian: first the triangles, then the arcs (padded to the same size).
    pub fn pattern(&self) -> Pattern {
        let of_cells = self.of_cell.iter().map(|nodes| self.components(nodes));
        let of_arcs = self.arcs.iter().map(|arc| self.components(&arc.nodes));
        let elements: Vec<[u32; SCALARS]> = of_cells.chain(of_arcs).collect();
        Pattern::new(self.unknowns(), &elements)
    }

    /// The scalar unknowns of up to six nodes, padded with [`PRESCRIBED`].
    fn components(&self, nodes: &[u32]) -> [u32; SCALARS] {
        let component = |i: usize| nodes.get(i / 2).map_or(PRESCRIBED, |n| self.dofs.component(*n as usize, i % 2));
        std::array::from_fn(component)
    }

    /// The objective over the region plus all penalties.
    pub fn value(&self, x: &[[f64; 2]], penalty: Penalty) -> f64 {
        let mut total = 0.0;
        for (i, cell) in self.cells.iter().enumerate() {
            let uv = self.cell_uv(i, x);
            total += self.objective.value(cell.face, &uv);
            if let Some(bounds) = &cell.bounds {
                let dets = CornerDerivatives::new(&uv).dets();
                total += (0..6).map(|k| penalty.at(dets[k], &bounds[k]).value).sum::<f64>();
            }
        }
        for arc in &self.arcs {
            let products = arcs::products(&arc_uv(arc, x));
            total += (0..3).map(|k| penalty.at(products[k], &arc.bounds[k]).value).sum::<f64>();
        }
        total
    }

    fn cell_uv(&self, cell: usize, x: &[[f64; 2]]) -> P2Nodes {
        self.of_cell[cell].map(|n| x[n as usize])
    }

    /// Gradient and (positive) Hessian at `x`.
    pub fn model(&self, x: &[[f64; 2]], penalty: Penalty, pattern: &Pattern) -> Model {
        let mut model = Model { gradient: vec![0.0; self.unknowns()], hessian: pattern.zeros() };
        for (i, cell) in self.cells.iter().enumerate() {
            let uv = self.cell_uv(i, x);
            let mut local = self.objective.model(cell.face, &uv);
            if let Some(bounds) = &cell.bounds {
                let corners = CornerDerivatives::new(&uv);
                let dets = corners.dets();
                let values: [Value; 6] = std::array::from_fn(|k| penalty.at(dets[k], &bounds[k]));
                let shape = &self.chart.shapes()[cell.face.index()];
                // Two parts: the curvature of the coefficients, and that of the penalty along their gradients.
                add_curvature(&mut local.hessian, shape, &values.map(|v| v.multiplier));
                for (k, value) in values.iter().enumerate() {
                    add_outer(&mut local, value, &corners.gradient(k));
                }
            }
            pattern.add(&mut model.hessian, i, &local.hessian);
            self.scatter(&mut model.gradient, &self.of_cell[i], &local.gradient);
        }
        for (i, arc) in self.arcs.iter().enumerate() {
            let uv = arc_uv(arc, x);
            let products = arcs::products(&uv);
            let mut local = LocalModel { gradient: [0.0; SCALARS], hessian: [[0.0; SCALARS]; SCALARS] };
            // The curvature of the products themselves is left out.
            for k in 0..3 {
                let value = penalty.at(products[k], &arc.bounds[k]);
                add_outer(&mut local, &value, &padded(arcs::gradient(&uv, k)));
            }
            pattern.add(&mut model.hessian, self.cells.len() + i, &local.hessian);
            self.scatter(&mut model.gradient, &arc.nodes, &local.gradient);
        }
        model
    }

    fn scatter(&self, gradient: &mut [f64], nodes: &[u32], element: &[f64; SCALARS]) {
        for (i, n) in nodes.iter().enumerate() {
            if let Some(unknown) = self.dofs.unknown(*n as usize) {
                gradient[2 * unknown] += element[2 * i];
                gradient[2 * unknown + 1] += element[2 * i + 1];
            }
        }
    }

    /// The direction that belongs to a step of the unknowns: zero at nodes that may not move.
    pub fn direction(&self, step: &[f64]) -> Vec<[f64; 2]> {
        let mut direction = vec![[0.0; 2]; self.dofs.nodes()];
        for (i, n) in self.free().iter().enumerate() {
            direction[*n as usize] = [step[2 * i], step[2 * i + 1]];
        }
        direction
    }

    /// The largest t at which no penalised quantity of `x + t direction` has fallen to its floor yet.
    pub fn longest_step(&self, x: &[[f64; 2]], direction: &[[f64; 2]]) -> f64 {
        // Every penalised quantity is quadratic in the nodes, and so is it along a line: c0 + c1 t + c2 t^2.
        let mut longest = f64::INFINITY;
        for (i, cell) in self.cells.iter().enumerate() {
            let Some(bounds) = &cell.bounds else { continue };
            let at = CornerDerivatives::new(&self.cell_uv(i, x));
            let along = CornerDerivatives::new(&self.cell_uv(i, direction));
            let (c0, c1, c2) = (at.dets(), at.polarization(&along), along.dets());
            for k in 0..6 {
                longest = longest.min(first_zero(c0[k] - bounds[k].floor, c1[k], c2[k]));
            }
        }
        for arc in &self.arcs {
            let at = arc_uv(arc, x);
            let along = arc_uv(arc, direction);
            let (c0, c1, c2) = (arcs::products(&at), arcs::polarization(&at, &along), arcs::products(&along));
            for k in 0..3 {
                longest = longest.min(first_zero(c0[k] - arc.bounds[k].floor, c1[k], c2[k]));
            }
        }
        longest
    }

    /// Calls `visit` with every penalised quantity and its bound.
    pub fn for_each_bound(&mut self, x: &[[f64; 2]], mut visit: impl FnMut(f64, &mut Bound)) {
        for i in 0..self.cells.len() {
            let dets = CornerDerivatives::new(&self.cell_uv(i, x)).dets();
            for (det, bound) in dets.iter().zip(self.cells[i].bounds.iter_mut().flatten()) {
                visit(*det, bound);
            }
        }
        for arc in &mut self.arcs {
            let products = arcs::products(&arc_uv(arc, x));
            for (product, bound) in products.iter().zip(&mut arc.bounds) {
                visit(*product, bound);
            }
        }
    }

    /// Updates the dual variables of a barrier after the step from `from` to `to`, of which `direction` is the full
    /// length.
    pub fn update_duals(&mut self, from: &[[f64; 2]], direction: &[[f64; 2]], to: &[[f64; 2]]) {
        for i in 0..self.cells.len() {
            if self.cells[i].bounds.is_none() {
                continue;
            }
            let [x, d, y] = [from, direction, to].map(|p| CornerDerivatives::new(&self.cell_uv(i, p)));
            let (old, change, new) = (x.dets(), x.polarization(&d), y.dets());
            for (k, bound) in self.cells[i].bounds.iter_mut().flatten().enumerate() {
                bound.update_dual(old[k], change[k], new[k]);
            }
        }
        for arc in &mut self.arcs {
            let [x, d, y] = [from, direction, to].map(|p| arc_uv(arc, p));
            let (old, change, new) = (arcs::products(&x), arcs::polarization(&x, &d), arcs::products(&y));
            for (k, bound) in arc.bounds.iter_mut().enumerate() {
                bound.update_dual(old[k], change[k], new[k]);
            }
        }
    }

    /// The least penalised quantity, relative to its scale.
    pub fn min_ratio(&mut self, x: &[[f64; 2]]) -> f64 {
        let mut least = f64::INFINITY;
        self.for_each_bound(x, |c, bound| least = least.min((c - bound.floor) / bound.scale));
        least
    }

    /// Scales the weights of all penalties.
    pub fn scale_weights(&mut self, factor: f64) {
        let of_cells = self.cells.iter_mut().filter_map(|c| c.bounds.as_mut()).flatten();
        let of_arcs = self.arcs.iter_mut().flat_map(|a| &mut a.bounds);
        for bound in of_cells.chain(of_arcs) {
            bound.weight *= factor;
        }
    }

    /// Newton's step: minus the inverse Hessian times the gradient. Where rounding makes the Hessian singular its
    /// diagonal is raised, a hundredfold at a time.
    ///
    /// # Errors
    /// Those of [`Analysis::factorise`].
    pub fn newton_step(&self, analysis: &Analysis, model: &mut Model) -> Result<Vec<f64>, Error> {
        let mut shift = FIRST_SHIFT;
        loop {
            match analysis.factorise(&model.hessian, self.checkpoint.monitor) {
                Ok(factor) => {
                    let mut step: Vec<f64> = model.gradient.iter().map(|g| -g).collect();
                    factor.solve(&mut step, 1);
                    return Ok(step);
                }
                Err(Error::Unsolvable(Unsolvable::Singular { .. })) if shift < LAST_SHIFT => {
                    analysis.pattern().diagonal().for_each(|d| model.hessian[d] *= 1.0 + shift);
                    shift *= 100.0;
                }
                Err(error) => return Err(error),
            }
        }
    }
}

fn arc_uv(arc: &ArcCell, x: &[[f64; 2]]) -> ArcNodes {
    arc.nodes.map(|n| x[n as usize])
}

fn padded(g: [f64; 8]) -> [f64; SCALARS] {
    std::array::from_fn(|i| if i < 8 { g[i] } else { 0.0 })
}

/// Adds slope and curvature of a penalty on a quantity with this gradient.
fn add_outer(local: &mut LocalModel, value: &Value, gradient: &[f64; SCALARS]) {
    for i in 0..SCALARS {
        local.gradient[i] -= value.neg_derivative * gradient[i];
        for j in 0..=i {
            local.hessian[i][j] += value.second_derivative * gradient[i] * gradient[j];
        }
    }
}

/// The least t > 0 at which c0 + c1 t + c2 t^2 falls to zero, where c0 > 0; infinity where it never does.
fn first_zero(c0: f64, c1: f64, c2: f64) -> f64 {
    let discriminant = c1 * c1 - 4.0 * c0 * c2;
    if c2 > 0.0 && (c1 >= 0.0 || discriminant < 0.0) {
        return f64::INFINITY;
    }
    // The form of the root that does not cancel where c1 < 0.
    let root = discriminant.max(0.0).sqrt();
    let t = if c1 <= 0.0 { 2.0 * c0 / (root - c1) } else { -(c1 + root) / (2.0 * c2) };
    // Negative where c2 = 0 < c1: what only grows never falls to zero.
    if t > 0.0 { t } else { f64::INFINITY }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_found_on_both_branches() {
        assert_eq!(first_zero(1.0, -1.0, 0.0), 1.0);
        assert_eq!(first_zero(2.0, -3.0, 1.0), 1.0);
        assert_eq!(first_zero(2.0, 1.0, -1.0), 2.0);
        assert_eq!(first_zero(1.0, -1.0, 1.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 1.0, 1.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 1.0, 0.0), f64::INFINITY);
        assert_eq!(first_zero(1.0, 0.0, -4.0), 0.5);
    }
}
