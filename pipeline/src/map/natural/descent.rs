//! Newton steps down an energy of a P1 map, with a positive Hessian, and a line search.

use super::clearance::{Barrier, Near};
use super::elements::Elements;
use crate::fem::dofs::Dofs;
use crate::fem::isotropic::{Density, Local};
use crate::fem::sparse::{self, Pattern, Unsolvable};
use crate::monitor::{Checkpoint, Monitor};

/// The share of the way to where the first triangle loses its area that a step may go. By experience.
const SHORT_OF: f64 = 0.9;

/// The share of the promised decrease that a step must keep (Armijo; Nocedal and Wright 2006, section 3.1).
const SUFFICIENT: f64 = 1e-4;

/// How often a step is halved.
const HALVINGS: u32 = 30;

/// Vertices are held where they are by springs as strong as this together, in the unit of energy per area: moves and
/// turns of the whole cost no energy. By experience: far below what holds the parts of a chart together, far above
/// rounding.
const HOLD: f64 = 1e-4;

/// Where rounding makes the matrix singular its diagonal is raised by this share, then by a hundred times as much, and
/// so on, up to the largest. As in untangling.
const FIRST_SHIFT: f64 = 1e-12;
const LAST_SHIFT: f64 = 1e-2;

/// An energy of P1 maps, and which vertices are free.
pub(super) struct Descent<'a> {
    pub elements: &'a Elements,
    pub dofs: &'a Dofs,
    /// What keeps the boundary from itself, where that is free.
    pub barrier: Option<Barrier<'a>>,
    /// Per vertex, its share of the area.
    pub shares: &'a [f64],
    pub monitor: &'a dyn Monitor,
}

/// Slope and curvature.
struct Model {
    gradient: Vec<f64>,
    hessian: Vec<f64>,
}

/// A step that was made: the energies before and after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub before: f64,
    pub after: f64,
}

impl Step {
    /// Whether it gained less than `share` of the energy.
    pub fn is_less_than(&self, share: f64) -> bool {
        self.before - self.after <= share * self.before
    }
}

impl Descent<'_> {
    /// The energy at `uv`.
    pub fn energy(&self, density: impl Density, uv: &[[f64; 2]]) -> f64 {
        let barrier = self.barrier.map_or(0.0, |b| b.clearance.energy(&b.clearance.near(uv, b.share), uv));
        self.elements.energy(density, uv) + barrier
    }

    /// Makes a step from `uv`; none where there is no way down. `is_bounded`: whether no triangle may lose its area.
    ///
    /// # Errors
    /// The system cannot be solved, or interrupted.
    pub fn step(
        &self,
        density: impl Density,
        is_bounded: bool,
        uv: &mut Vec<[f64; 2]>,
    ) -> Result<Option<Step>, sparse::Error> {
        let near = self.barrier.map(|b| b.clearance.near(uv, b.share)).unwrap_or_default();
        let unknowns = self.unknowns(&near);
        let pattern = Pattern::new(2 * self.dofs.count(), &unknowns);
        let model = self.model(density, uv, &near, &pattern, &unknowns);
        let change = self.newton(&model, &pattern)?;
        Checkpoint::new(self.monitor).end()?;
        let slope: f64 = model.gradient.iter().zip(&change).map(|(g, c)| g * c).sum();
        // Not less than zero, or no number.
        if !(slope.is_finite() && slope < 0.0) {
            return Ok(None);
        }
        let direction = self.at_vertices(&change, uv.len());
        let most = if is_bounded { SHORT_OF * self.elements.largest_step(uv, &direction) } else { 1.0 };
        let before = self.energy(density, uv);
        let mut length = most.min(1.0);
        for _ in 0..HALVINGS {
            let there: Vec<[f64; 2]> =
                uv.iter().zip(&direction).map(|(p, d)| [0, 1].map(|k| p[k] + length * d[k])).collect();
            let after = self.energy(density, &there);
            if after <= before + SUFFICIENT * length * slope && self.barrier.is_none_or(|b| b.clearance.is_kept(&there))
            {
                *uv = there;
                return Ok(Some(Step { before, after }));
            }
            length *= 0.5;
        }
        Ok(None)
    }

    /// Per triangle, and then per pair that is near, its scalar unknowns.
    fn unknowns(&self, near: &[Near]) -> Vec<[u32; 6]> {
        let all = self.elements.vertices().chain(near.iter().map(|n| n.vertices));
        all.map(|vertices| std::array::from_fn(|i| self.dofs.component(vertices[i / 2], i % 2))).collect()
    }

    fn model(
        &self,
        density: impl Density,
        uv: &[[f64; 2]],
        near: &[Near],
        pattern: &Pattern,
        unknowns: &[[u32; 6]],
    ) -> Model {
        let mut model = Model { gradient: vec![0.0; 2 * self.dofs.count()], hessian: pattern.zeros() };
        for (i, local) in self.elements.locals(density, uv).enumerate() {
            model.add(pattern, i, &unknowns[i], &local);
        }
        if let Some(Barrier { clearance, .. }) = self.barrier {
            for (i, near) in (self.elements.len()..).zip(near) {
                model.add(pattern, i, &unknowns[i], &clearance.local(near, uv));
            }
        }
        model
    }

    /// Where the quadratic model is least, as a change of the unknowns.
    fn newton(&self, model: &Model, pattern: &Pattern) -> Result<Vec<f64>, sparse::Error> {
        let analysis = pattern.analyse()?;
        let mut shift = 0.0;
        loop {
            let mut matrix = model.hessian.clone();
            for (scalar, at) in pattern.diagonal().enumerate() {
                matrix[at] += shift * matrix[at] + HOLD * self.shares[self.dofs.free()[scalar / 2] as usize];
            }
            match analysis.factorise(&matrix, self.monitor) {
                Ok(factor) => {
                    let mut change: Vec<f64> = model.gradient.iter().map(|g| -g).collect();
                    factor.solve(&mut change, 1);
                    return Ok(change);
                }
                Err(sparse::Error::Unsolvable(Unsolvable::Singular { .. })) if shift < LAST_SHIFT => {
                    shift = FIRST_SHIFT.max(100.0 * shift);
                }
                Err(error) => return Err(error),
            }
        }
    }

    fn at_vertices(&self, change: &[f64], vertices: usize) -> Vec<[f64; 2]> {
        let of_vertex = |v: usize| match self.dofs.unknown(v) {
            Some(unknown) => [change[2 * unknown], change[2 * unknown + 1]],
            None => [0.0; 2],
        };
        (0..vertices).map(of_vertex).collect()
    }
}

impl Model {
    /// Adds the contribution of an element, by its number in `pattern` and its unknowns.
    fn add(&mut self, pattern: &Pattern, number: usize, unknowns: &[u32; 6], local: &Local<6>) {
        pattern.add(&mut self.hessian, number, &local.hessian);
        for (unknown, slope) in unknowns.iter().zip(local.gradient) {
            // What is prescribed has no entry.
            if let Some(entry) = self.gradient.get_mut(*unknown as usize) {
                *entry += slope;
            }
        }
    }
}
