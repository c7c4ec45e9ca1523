//! The optimisation problem on a region of a chart: Dirichlet energy plus penalties, over the nodes that may move.

use super::penalty::{Bound, Penalty, Value};
use super::terms::{self, Form, Four};
use crate::fem::dofs::Dofs;
use crate::fem::element::{self, Element, P2};
use crate::fem::jacobian::{Corners, Six};
use crate::fem::sparse::{Analysis, Error, PRESCRIBED, Pattern};
use crate::map::closed::ClosedChart;
use crate::monitor::{Checkpoint, Interrupted};

/// The work of a triangle: as long as so many are looked at elsewhere.
const WORK_PER_CELL: usize = 4;

/// Places of nodes.
pub(super) type Places = Vec<[f64; 2]>;

/// A triangle of the region, with penalties on its six coefficients (none on virtual fans).
pub(super) struct Cell {
    pub face: u32,
    pub bounds: Option<[Bound; 6]>,
}

/// An arc of a hole's loop with its star centre, with penalties on its three products.
pub(super) struct ArcCell {
    pub nodes: [u32; 4],
    pub bounds: [Bound; 3],
}

/// The part of a chart in which nodes may move, and the penalties that hold there. Its nodes have numbers of their
/// own, so that a small region costs little, however large the chart is.
pub(super) struct Problem<'a> {
    chart: &'a ClosedChart,
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

/// Slope and curvature of the objective at a point.
pub(super) struct Model {
    pub gradient: Vec<f64>,
    pub hessian: Vec<f64>,
}

impl<'a> Problem<'a> {
    /// The problem on `cells` and `arcs`, of whose nodes those in `free` may move; nodes as numbered in the chart,
    /// star centres after all others.
    pub fn new(
        chart: &'a ClosedChart,
        cells: Vec<Cell>,
        mut arcs: Vec<ArcCell>,
        free: &[u32],
        checkpoint: &'a Checkpoint,
    ) -> Self {
        let six = |cell: &Cell| chart.nodes(cell.face as usize).map(|n| n as u32);
        let mut nodes: Vec<u32> = cells.iter().flat_map(six).chain(arcs.iter().flat_map(|a| a.nodes)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |n: u32| nodes.partition_point(|m| *m < n) as u32;
        let of_cell = cells.iter().map(|c| six(c).map(local)).collect();
        arcs.iter_mut().for_each(|a| a.nodes = a.nodes.map(local));
        let dofs = Dofs::new(nodes.len(), free.iter().map(|n| local(*n)).collect());
        Self { chart, checkpoint, cells, arcs, nodes, of_cell, dofs }
    }

    /// A safe point, after all triangles of the region were looked at.
    pub fn checkpoint(&self) -> Result<(), Interrupted> {
        self.checkpoint.after(WORK_PER_CELL * self.cells.len())
    }

    /// The nodes of the region, as numbered in the chart, ascending.
    pub fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// The places of the region's nodes, out of those of the whole chart.
    pub fn gather(&self, all: &[[f64; 2]]) -> Places {
        self.nodes.iter().map(|n| all[*n as usize]).collect()
    }

    /// The nodes that may move, in the numbering of the region.
    pub fn free(&self) -> &[u32] {
        self.dofs.free()
    }

    /// The nodes that may move, as numbered in the chart, each with its place in `x`.
    pub fn moved<'x>(&self, x: &'x Places) -> impl Iterator<Item = (usize, &'x [f64; 2])> {
        self.free().iter().map(|n| (self.nodes[*n as usize] as usize, &x[*n as usize]))
    }

    /// The number of scalar unknowns: two per free node.
    pub fn unknowns(&self) -> usize {
        2 * self.dofs.count()
    }

    /// The pattern of the Hessian: first the triangles, then the arcs (padded to the same size).
    pub fn pattern(&self) -> Pattern {
        let of_cells = self.of_cell.iter().map(|nodes| self.components(nodes));
        let of_arcs = self.arcs.iter().map(|arc| self.components(&arc.nodes));
        let elements: Vec<[u32; 12]> = of_cells.chain(of_arcs).collect();
        Pattern::new(self.unknowns(), &elements)
    }

    /// The scalar unknowns of up to six nodes, padded with [`PRESCRIBED`].
    fn components(&self, nodes: &[u32]) -> [u32; 12] {
        let component = |i: usize| nodes.get(i / 2).map_or(PRESCRIBED, |n| self.dofs.component(*n as usize, i % 2));
        std::array::from_fn(component)
    }

    /// The energy of the region plus all penalties.
    pub fn objective(&self, x: &Places, penalty: Penalty) -> f64 {
        let mut total = 0.0;
        for (i, cell) in self.cells.iter().enumerate() {
            let six = self.six(i, x);
            total += element::energy(&P2::stiffness(&self.chart.shapes()[cell.face as usize]), &six);
            if let Some(bounds) = &cell.bounds {
                let dets = Corners::new(&six).dets();
                total += (0..6).map(|k| penalty.at(dets[k], &bounds[k]).value).sum::<f64>();
            }
        }
        for arc in &self.arcs {
            let products = terms::arc_products(&four(arc, x));
            total += (0..3).map(|k| penalty.at(products[k], &arc.bounds[k]).value).sum::<f64>();
        }
        total
    }

    fn six(&self, cell: usize, x: &Places) -> Six {
        self.of_cell[cell].map(|n| x[n as usize])
    }

    /// Gradient and (positive) Hessian at `x`.
    pub fn model(&self, x: &Places, penalty: Penalty, pattern: &Pattern) -> Model {
        let mut model = Model { gradient: vec![0.0; self.unknowns()], hessian: pattern.zeros() };
        for (i, cell) in self.cells.iter().enumerate() {
            let six = self.six(i, x);
            let shape = &self.chart.shapes()[cell.face as usize];
            let stiffness = P2::stiffness(shape);
            let mut gradient = energy_gradient(&stiffness, &six);
            let mut form = Form::of_stiffness(stiffness);
            let mut outer = Vec::with_capacity(6);
            if let Some(bounds) = &cell.bounds {
                let corners = Corners::new(&six);
                let dets = corners.dets();
                let values: [Value; 6] = std::array::from_fn(|k| penalty.at(dets[k], &bounds[k]));
                form.add_curvature(shape, &values.map(|v| v.force));
                outer.extend((0..6).map(|k| (values[k], corners.gradient(k))));
            }
            let mut hessian = form.matrix();
            add_outer(&mut gradient, &mut hessian, &outer);
            pattern.add(&mut model.hessian, i, &hessian);
            self.scatter(&mut model.gradient, &self.of_cell[i], &gradient);
        }
        for (i, arc) in self.arcs.iter().enumerate() {
            let places = four(arc, x);
            let products = terms::arc_products(&places);
            let (mut gradient, mut hessian) = ([0.0; 12], [[0.0; 12]; 12]);
            let outer: Vec<_> = (0..3)
                .map(|k| (penalty.at(products[k], &arc.bounds[k]), padded(terms::arc_gradient(&places, k))))
                .collect();
            add_outer(&mut gradient, &mut hessian, &outer);
            pattern.add(&mut model.hessian, self.cells.len() + i, &hessian);
            self.scatter(&mut model.gradient, &arc.nodes, &gradient);
        }
        model
    }

    fn scatter(&self, gradient: &mut [f64], nodes: &[u32], element: &[f64; 12]) {
        for (i, n) in nodes.iter().enumerate() {
            if let Some(unknown) = self.dofs.unknown(*n as usize) {
                gradient[2 * unknown] += element[2 * i];
                gradient[2 * unknown + 1] += element[2 * i + 1];
            }
        }
    }

    /// The direction that belongs to a step of the unknowns: zero at nodes that may not move.
    pub fn direction(&self, step: &[f64]) -> Places {
        let mut direction = vec![[0.0; 2]; self.dofs.nodes()];
        for (i, n) in self.free().iter().enumerate() {
            direction[*n as usize] = [step[2 * i], step[2 * i + 1]];
        }
        direction
    }

    /// The largest t at which no penalised quantity of `x + t direction` has fallen to its floor yet.
    pub fn longest_step(&self, x: &Places, direction: &Places) -> f64 {
        let mut longest = f64::INFINITY;
        let mut meet = |c0: f64, c1: f64, c2: f64| longest = longest.min(terms::first_zero(c0, c1, c2));
        for (i, cell) in self.cells.iter().enumerate() {
            let Some(bounds) = &cell.bounds else { continue };
            let (at, along) = (Corners::new(&self.six(i, x)), Corners::new(&self.six(i, direction)));
            let (c0, c1, c2) = (at.dets(), at.mixed(&along), along.dets());
            (0..6).for_each(|k| meet(c0[k] - bounds[k].floor, c1[k], c2[k]));
        }
        for arc in &self.arcs {
            let (at, along) = (four(arc, x), four(arc, direction));
            let (c0, c1, c2) = (terms::arc_products(&at), terms::arc_mixed(&at, &along), terms::arc_products(&along));
            (0..3).for_each(|k| meet(c0[k] - arc.bounds[k].floor, c1[k], c2[k]));
        }
        longest
    }

    /// Calls `visit` with every penalised quantity and its bound.
    pub fn for_each_bound(&mut self, x: &Places, mut visit: impl FnMut(f64, &mut Bound)) {
        for i in 0..self.cells.len() {
            let dets = Corners::new(&self.six(i, x)).dets();
            if let Some(bounds) = &mut self.cells[i].bounds {
                (0..6).for_each(|k| visit(dets[k], &mut bounds[k]));
            }
        }
        for arc in &mut self.arcs {
            let products = terms::arc_products(&four(arc, x));
            (0..3).for_each(|k| visit(products[k], &mut arc.bounds[k]));
        }
    }

    /// Updates the dual variables of a barrier after the step from `from` to `to`, of which `direction` is the full
    /// length.
    pub fn update_duals(&mut self, from: &Places, direction: &Places, to: &Places) {
        for i in 0..self.cells.len() {
            if self.cells[i].bounds.is_none() {
                continue;
            }
            let [x, d, y] = [from, direction, to].map(|p| Corners::new(&self.six(i, p)));
            let (c, change, new) = (x.dets(), x.mixed(&d), y.dets());
            let bounds = self.cells[i].bounds.iter_mut().flatten();
            bounds.enumerate().for_each(|(k, b)| b.update_dual(c[k], change[k], new[k]));
        }
        for arc in &mut self.arcs {
            let [x, d, y] = [from, direction, to].map(|p| four(arc, p));
            let (c, change, new) = (terms::arc_products(&x), terms::arc_mixed(&x, &d), terms::arc_products(&y));
            arc.bounds.iter_mut().enumerate().for_each(|(k, b)| b.update_dual(c[k], change[k], new[k]));
        }
    }

    /// The least penalised quantity, relative to its scale.
    pub fn least(&mut self, x: &Places) -> f64 {
        let mut least = f64::INFINITY;
        self.for_each_bound(x, |c, bound| least = least.min((c - bound.floor) / bound.scale));
        least
    }

    /// Scales the weights of all penalties.
    pub fn scale_weights(&mut self, factor: f64) {
        let bounds = self.cells.iter_mut().filter_map(|c| c.bounds.as_mut()).flatten();
        bounds.chain(self.arcs.iter_mut().flat_map(|a| &mut a.bounds)).for_each(|b| b.weight *= factor);
    }
}

fn four(arc: &ArcCell, x: &Places) -> Four {
    arc.nodes.map(|n| x[n as usize])
}

fn padded(g: [f64; 8]) -> [f64; 12] {
    std::array::from_fn(|i| if i < 8 { g[i] } else { 0.0 })
}

/// The gradient of the Dirichlet energy of a triangle.
fn energy_gradient(stiffness: &[[f64; 6]; 6], x: &Six) -> [f64; 12] {
    let d = x.map(|p| [p[0] - x[0][0], p[1] - x[0][1]]);
    std::array::from_fn(|i| (0..6).map(|n| stiffness[i / 2][n] * d[n][i % 2]).sum())
}

/// Adds slopes and curvatures of penalties with these gradients.
fn add_outer(gradient: &mut [f64; 12], hessian: &mut [[f64; 12]; 12], terms: &[(Value, [f64; 12])]) {
    for (value, g) in terms {
        for i in 0..12 {
            gradient[i] -= value.push * g[i];
            for j in 0..=i {
                hessian[i][j] += value.bend * g[i] * g[j];
            }
        }
    }
}

/// Newton's step: minus the inverse Hessian times the gradient. Where rounding makes the Hessian singular its
/// diagonal is raised, a hundredfold at a time.
pub(super) fn newton_step(
    problem: &Problem,
    (pattern, analysis): (&Pattern, &Analysis),
    model: &mut Model,
) -> Result<Vec<f64>, Error> {
    let mut shift = 1e-12;
    loop {
        match analysis.factorise(&model.hessian, problem.checkpoint.monitor) {
            Ok(factor) => {
                let mut step: Vec<f64> = model.gradient.iter().map(|g| -g).collect();
                factor.solve(&mut step, 1);
                return Ok(step);
            }
            Err(Error::Singular { .. }) if shift < 1e-2 => {
                pattern.diagonal().for_each(|d| model.hessian[d] *= 1.0 + shift);
                shift *= 100.0;
            }
            Err(error) => return Err(error),
        }
    }
}
