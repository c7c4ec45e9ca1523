//! The harmonic map onto the disk.
//!
//! The outer loop is prescribed on the unit circle by arc length, inner loops are closed by one node each, as by a fan.
//! Where a map is nearly conformal, its area scale is half the density of its Dirichlet energy.

use super::super::graph_laplacian::GraphLaplacian;
use super::CellUnion;
use std::f64::consts::TAU;

/// The area ratio of the map with this loop on the circle: that of energy densities. Infinite where there is none in doubles.
pub(super) fn area_ratio(union: &CellUnion, outer: usize) -> f64 {
    let mut system = System::new(union);
    for i in 0..union.loops.len() {
        if i == outer { system.prescribe(i) } else { system.close(i) }
    }
    let Some(uv) = system.solve() else { return f64::INFINITY };
    let energy = system.energies(&uv);
    union.ratio(|i, area| energy[i] / area)
}

/// The system of one map.
struct System<'a, 'b> {
    union: &'b CellUnion<'a>,
    /// Those of the cells, then those of the nodes that close inner loops.
    unknowns: usize,
    /// Pairs of unknowns, and their conductances, of nodes that close loops.
    spokes: Vec<([u32; 2], f64)>,
    /// Unknown, conductance, place on the circle.
    rim: Vec<(u32, f64, [f64; 2])>,
}

impl<'a, 'b> System<'a, 'b> {
    fn new(union: &'b CellUnion<'a>) -> Self {
        Self { union, unknowns: union.cells(), spokes: Vec::new(), rim: Vec::new() }
    }

    /// Holds a loop on the circle.
    fn prescribe(&mut self, outer: usize) {
        for run in &self.union.runs[outer] {
            let (sin, cos) = (TAU * run.at).sin_cos();
            self.rim.push((self.union.unknown(run.cell), run.length / self.union.reach(run), [cos, sin]));
        }
    }

    /// Closes an inner loop by a node in its middle.
    fn close(&mut self, inner: usize) {
        let radius = self.union.lengths[inner] / TAU;
        let centre = self.unknowns as u32;
        self.unknowns += 1;
        for run in &self.union.runs[inner] {
            let conductance = run.length / (self.union.reach(run) + radius);
            self.spokes.push(([self.union.unknown(run.cell), centre], conductance));
        }
    }

    fn links(&self) -> impl Iterator<Item = &([u32; 2], f64)> {
        self.union.links.iter().chain(&self.spokes)
    }

    fn solve(&self) -> Option<Vec<[f64; 2]>> {
        let mut laplacian = GraphLaplacian::new(self.union.cells(), self.unknowns - self.union.cells());
        self.links().for_each(|(pair, w)| laplacian.add_edge(*pair, *w));
        self.rim.iter().for_each(|(i, w, uv)| laplacian.add_dirichlet(*i, *w, *uv));
        laplacian.solve()
    }

    /// The energy of every unknown.
    fn energies(&self, uv: &[[f64; 2]]) -> Vec<f64> {
        let squared = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).powi(2) + (p[1] - q[1]).powi(2);
        let mut energy = vec![0.0; self.unknowns];
        for ([i, j], w) in self.links() {
            let half = 0.5 * w * squared(uv[*i as usize], uv[*j as usize]);
            energy[*i as usize] += half;
            energy[*j as usize] += half;
        }
        for (i, w, p) in &self.rim {
            energy[*i as usize] += w * squared(uv[*i as usize], *p);
        }
        energy
    }
}
