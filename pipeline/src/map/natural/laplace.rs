//! Discrete harmonic functions on a chart, with one factorisation for all of them.
//!
//! The Laplacian A is the P1 stiffness matrix of the chart's triangles; the vertices of all loops are prescribed.

use crate::atlas::Chart;
use crate::fem::dofs::Dofs;
use crate::fem::element::{Element, P1};
use crate::fem::sparse::{Factor, Pattern};

/// The Laplacian of a chart.
pub(super) struct Laplacian {
    triangles: Vec<[usize; 3]>,
    stiffness: Vec<[[f64; 3]; 3]>,
    dofs: Dofs,
    pattern: Pattern,
}

impl Laplacian {
    /// `inside` are the vertices that are free, in the order in which they are eliminated.
    pub(super) fn new(chart: &Chart, inside: Vec<u32>) -> Self {
        let triangles: Vec<[usize; 3]> = chart.triangles().iter().map(|t| t.map(|v| v.index())).collect();
        let stiffness = chart.shapes().iter().map(P1::stiffness).collect();
        let dofs = Dofs::new(chart.vertices().len(), inside);
        let pattern = dofs.pattern(triangles.iter().copied());
        Self { triangles, stiffness, dofs, pattern }
    }

    /// The pattern of the matrix between free vertices.
    pub(super) fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// That matrix.
    pub(super) fn matrix(&self) -> Vec<f64> {
        let mut matrix = self.pattern.zeros();
        for (f, stiffness) in self.stiffness.iter().enumerate() {
            self.pattern.add(&mut matrix, f, stiffness);
        }
        matrix
    }

    /// A times a function, given at all vertices.
    pub(super) fn apply(&self, function: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; function.len()];
        for (nodes, stiffness) in self.triangles.iter().zip(&self.stiffness) {
            for i in 0..3 {
                product[nodes[i]] += (0..3).map(|j| stiffness[i][j] * function[nodes[j]]).sum::<f64>();
            }
        }
        product
    }

    /// The function u with (A u)_i = `load`_i inside and the given values on the loops (those inside do not count). `factor` is
    /// that of the matrix.
    pub(super) fn solve(&self, factor: &Option<Factor>, load: &[f64], mut values: Vec<f64>) -> Vec<f64> {
        for v in self.dofs.free() {
            values[*v as usize] = 0.0;
        }
        // No vertex is free in a chart without one inside.
        let Some(factor) = factor else { return values };
        let of_prescribed = self.apply(&values);
        let mut rhs: Vec<f64> =
            self.dofs.free().iter().map(|v| load[*v as usize] - of_prescribed[*v as usize]).collect();
        factor.solve(&mut rhs, 1);
        for (v, value) in self.dofs.free().iter().zip(rhs) {
            values[*v as usize] = value;
        }
        values
    }

    /// Whether no vertex is free.
    pub(super) fn is_rigid(&self) -> bool {
        self.dofs.count() == 0
    }
}
