//! The optimisation problem on a region of a chart: an objective under constraints, over the nodes that may move.

use super::arcs;
use super::bound::{Bound, Change};
use super::curvature::{add_curvature, add_mixed, keep_positive};
use super::objective::{LocalModel, Objective, SCALARS};
use crate::fem::dofs::Dofs;
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

/// A triangle of the region, with constraints on its six coefficients (none on virtual fans).
pub(super) struct Cell {
    pub face: FaceId,
    pub bounds: Option<[Bound; 6]>,
}

/// An arc of a hole's loop with its star centre, with constraints on its three products.
pub(super) struct ArcCell {
    pub nodes: [u32; 4],
    pub bounds: [Bound; 3],
}

/// The part of a chart in which nodes may move, the objective, and the constraints that hold there. Its nodes have
/// numbers of their own, so that a small region costs little, however large the chart is.
pub(super) struct Problem<'a, O> {
    objective: &'a O,
    checkpoint: &'a Checkpoint<'a>,
    cells: Vec<RegionCell>,
    /// Per arc, its nodes in the numbering of the region.
    arcs: Vec<[u32; 4]>,
    /// The constraints: six of each triangle that has some, then three of each arc.
    bounds: Vec<Bound>,
    /// Whether slacks are what there is: no step leaves the maps that are valid.
    is_inside: bool,
    /// The nodes of the region in the numbering of the chart (star centres after all others), ascending.
    nodes: Vec<u32>,
    /// The nodes of the region that may move.
    dofs: Dofs,
}

/// A triangle, its nodes in the numbering of the region, and the first of its constraints.
struct RegionCell {
    face: FaceId,
    nodes: [u32; 6],
    first: Option<usize>,
}

/// Slope and curvature of objective and constraints at a point.
pub(super) struct Model {
    /// The gradient of the condensed system.
    pub gradient: Vec<f64>,
    /// That of the objective alone.
    pub energy_gradient: Vec<f64>,
    pub hessian: Vec<f64>,
}

/// Where a step leads: the changes of all slacks and multipliers, and the slope of the constraints' merit.
pub(super) struct Course {
    changes: Vec<Change>,
    /// Per constraint, its slack and multiplier where it begins.
    begin: Vec<[f64; 2]>,
    pub slope: f64,
}

impl Course {
    /// The largest share of the step, at most 1, that takes no more than the share `safe` of any slack, or of any multiplier.
    pub fn longest(&self, safe: f64, of: Of) -> f64 {
        let share = |(begin, change): (&[f64; 2], &Change)| {
            let (value, change) = match of {
                Of::Slacks => (begin[0], change.slack),
                Of::Multipliers => (begin[1], change.dual),
            };
            if change < 0.0 { -safe * value / change } else { 1.0 }
        };
        self.begin.iter().zip(&self.changes).map(share).fold(1.0, f64::min)
    }
}

/// Slacks, or multipliers.
#[derive(Clone, Copy)]
pub(super) enum Of {
    Slacks,
    Multipliers,
}

/// What decides how far a step goes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Merit {
    /// The objective over the region.
    pub energy: f64,
    /// What the distances of quantities from their slacks cost.
    pub distance: f64,
    /// Both, and the barrier.
    pub total: f64,
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
        arcs: Vec<ArcCell>,
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
        let mut bounds = Vec::with_capacity(6 * cells.len() + 3 * arcs.len());
        let mut of_region = Vec::with_capacity(cells.len());
        for cell in &cells {
            let first = cell.bounds.is_some().then_some(bounds.len());
            bounds.extend(cell.bounds.iter().flatten());
            of_region.push(RegionCell { face: cell.face, nodes: in_chart(cell).map(local), first });
        }
        bounds.extend(arcs.iter().flat_map(|arc| arc.bounds));
        let arcs = arcs.iter().map(|arc| arc.nodes.map(local)).collect();
        let dofs = Dofs::new(nodes.len(), free.iter().map(|n| local(*n)).collect());
        Self { objective, checkpoint, cells: of_region, arcs, bounds, is_inside: false, nodes, dofs }
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
        let of_cells = self.cells.iter().map(|cell| self.components(&cell.nodes));
        let of_arcs = self.arcs.iter().map(|arc| self.components(arc));
        let elements: Vec<[u32; SCALARS]> = of_cells.chain(of_arcs).collect();
        Pattern::new(self.unknowns(), &elements)
    }

    /// The scalar unknowns of up to six nodes, padded with [`PRESCRIBED`].
    fn components(&self, nodes: &[u32]) -> [u32; SCALARS] {
        let component = |i: usize| nodes.get(i / 2).map_or(PRESCRIBED, |n| self.dofs.component(*n as usize, i % 2));
        std::array::from_fn(component)
    }

    /// The objective over the region.
    fn energy(&self, x: &[[f64; 2]]) -> f64 {
        self.cells.iter().map(|cell| self.objective.value(cell.face, &at(x, &cell.nodes))).sum()
    }

    /// All quantities that are constrained, in the order of the constraints.
    pub fn quantities(&self, x: &[[f64; 2]]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.bounds.len());
        for cell in self.cells.iter().filter(|cell| cell.first.is_some()) {
            all.extend(CornerDerivatives::new(&at(x, &cell.nodes)).dets());
        }
        all.extend(self.arcs.iter().flat_map(|arc| arcs::products(&at(x, arc))));
        all
    }

    /// What is linear in t in the quantities of `x + t direction`.
    fn slopes(&self, x: &[[f64; 2]], direction: &[[f64; 2]]) -> Vec<f64> {
        let mut all = Vec::with_capacity(self.bounds.len());
        for cell in self.cells.iter().filter(|cell| cell.first.is_some()) {
            let [from, along] = [x, direction].map(|p| CornerDerivatives::new(&at(p, &cell.nodes)));
            all.extend(from.polarization(&along));
        }
        all.extend(self.arcs.iter().flat_map(|arc| arcs::polarization(&at(x, arc), &at(direction, arc))));
        all
    }

    /// Sets all slacks and multipliers for the map `x`. Where loops of holes are to be seen from a point, and are, no step is to
    /// leave the valid maps: small holes turn around it in a step, and never back. Where they are not yet, they have no choice.
    pub fn begin(&mut self, x: &[[f64; 2]]) {
        let quantities = self.quantities(x);
        let mut slacks = self.bounds.iter().zip(&quantities).map(|(bound, c)| c - bound.floor);
        self.is_inside = !self.arcs.is_empty() && slacks.all(|slack| slack > 0.0);
        for (bound, c) in self.bounds.iter_mut().zip(quantities) {
            if self.is_inside { bound.begin_with(c - bound.floor) } else { bound.begin(c) }
        }
    }

    /// Gradient and (positive) Hessian at `x`.
    pub fn model(&self, x: &[[f64; 2]], pattern: &Pattern) -> Model {
        let zeros = vec![0.0; self.unknowns()];
        let mut model = Model { gradient: zeros.clone(), energy_gradient: zeros, hessian: pattern.zeros() };
        for (i, cell) in self.cells.iter().enumerate() {
            let uv = at(x, &cell.nodes);
            let mut local = self.objective.model(cell.face, &uv);
            self.scatter(&mut model.energy_gradient, &cell.nodes, &local.gradient);
            if let Some(first) = cell.first {
                let corners = CornerDerivatives::new(&uv);
                let (dets, bounds) = (corners.dets(), &self.bounds[first..first + 6]);
                // Two parts: the curvature of the coefficients, and that of the constraints along their gradients.
                add_curvature(&mut local.hessian, &std::array::from_fn(|k| bounds[k].dual));
                for (k, bound) in bounds.iter().enumerate() {
                    add_outer(&mut local, bound, dets[k], &corners.gradient(k));
                }
            }
            keep_positive(&mut local.hessian);
            pattern.add(&mut model.hessian, i, &local.hessian);
            self.scatter(&mut model.gradient, &cell.nodes, &local.gradient);
        }
        let first_of_arcs = self.bounds.len() - 3 * self.arcs.len();
        for (i, arc) in self.arcs.iter().enumerate() {
            let uv = at(x, arc);
            let (products, bounds) = (arcs::products(&uv), &self.bounds[first_of_arcs + 3 * i..][..3]);
            let mut local = LocalModel { gradient: [0.0; SCALARS], hessian: [[0.0; SCALARS]; SCALARS] };
            add_mixed(&mut local.hessian, &arcs::mixed(&std::array::from_fn(|k| -bounds[k].dual)));
            for (k, bound) in bounds.iter().enumerate() {
                add_outer(&mut local, bound, products[k], &padded(arcs::gradient(&uv, k)));
            }
            keep_positive(&mut local.hessian);
            pattern.add(&mut model.hessian, self.cells.len() + i, &local.hessian);
            self.scatter(&mut model.gradient, arc, &local.gradient);
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

    /// Where a step leads from `x`, which has these quantities; what distances cost is raised where it must be.
    pub fn course(&mut self, x: &[[f64; 2]], quantities: &[f64], direction: &[[f64; 2]]) -> Course {
        let slopes = self.slopes(x, direction);
        let mut course = Course { changes: vec![], begin: vec![], slope: 0.0 };
        for (bound, (&c, slope)) in self.bounds.iter_mut().zip(quantities.iter().zip(slopes)) {
            let change = bound.change(c, slope);
            bound.raise_cost(&change);
            course.slope += bound.slope(c, &change);
            course.begin.push([bound.slack, bound.dual]);
            course.changes.push(change);
        }
        course
    }

    /// The constraints after these shares of the changes of slacks and multipliers, which brought the quantities to what is
    /// given; none where the map left the valid ones and must not.
    pub fn moved_bounds(&self, quantities: &[f64], course: &Course, share: f64, of_dual: f64) -> Option<Vec<Bound>> {
        let moved = |((bound, change), &c): ((&Bound, &Change), &f64)| {
            if self.is_inside {
                bound.moved_inside(c, change, of_dual)
            } else {
                Some(bound.moved(c, change, share, of_dual))
            }
        };
        self.bounds.iter().zip(&course.changes).zip(quantities).map(moved).collect()
    }

    /// Takes other slacks and multipliers over.
    pub fn set_bounds(&mut self, bounds: Vec<Bound>) {
        self.bounds = bounds;
    }

    /// The merit of `x`, which has these quantities, with the problem's own constraints.
    pub fn merit(&self, x: &[[f64; 2]], quantities: &[f64]) -> Merit {
        self.merit_with(&self.bounds, x, quantities)
    }

    /// The merit of `x`, which has these quantities, with these constraints.
    pub fn merit_with(&self, bounds: &[Bound], x: &[[f64; 2]], quantities: &[f64]) -> Merit {
        let (energy, mut distance, mut total) = (self.energy(x), 0.0, 0.0);
        for (bound, &c) in bounds.iter().zip(quantities) {
            distance += bound.cost * bound.residual(c).abs();
            total += bound.merit(c);
        }
        Merit { energy, distance, total: energy + total }
    }

    /// Calls `visit` with every constrained quantity and its constraint.
    pub fn for_each_bound(&mut self, x: &[[f64; 2]], mut visit: impl FnMut(f64, &mut Bound)) {
        let quantities = self.quantities(x);
        self.bounds.iter_mut().zip(quantities).for_each(|(bound, c)| visit(c, bound));
    }

    /// Scales the weights of all constraints.
    pub fn scale_weights(&mut self, factor: f64) {
        self.bounds.iter_mut().for_each(|bound| bound.weight *= factor);
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

/// The uv of some nodes.
fn at<const N: usize>(x: &[[f64; 2]], nodes: &[u32; N]) -> [[f64; 2]; N] {
    nodes.map(|n| x[n as usize])
}

fn padded(g: [f64; 8]) -> [f64; SCALARS] {
    std::array::from_fn(|i| if i < 8 { g[i] } else { 0.0 })
}

/// Adds slope and curvature of a constraint on the quantity `c` with this gradient.
fn add_outer(local: &mut LocalModel, bound: &Bound, c: f64, gradient: &[f64; SCALARS]) {
    let condensed = bound.condensed(c);
    for i in 0..SCALARS {
        local.gradient[i] -= condensed.pull * gradient[i];
        for j in 0..=i {
            local.hessian[i][j] += condensed.stiffness * gradient[i] * gradient[j];
        }
    }
}
