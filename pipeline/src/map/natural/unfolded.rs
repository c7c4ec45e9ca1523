//! Unfolds a P1 map inside a boundary that is given.
//!
//! From a map with folded triangles, by the energy of Garanzha and co-workers (2021, doi 10.1145/3450626.3459847),
//! which is finite there: its eps falls with the worst triangle. What is unfolded goes on down the symmetric Dirichlet
//! energy.

use super::descent::Descent;
use super::elements::Elements;
use crate::atlas::Chart;
use crate::fem::dofs::Dofs;
use crate::fem::isotropic::{Regularised, SymmetricDirichlet};
use crate::fem::sparse;
use crate::monitor::Monitor;

/// The largest number of steps for unfolding, and after that. By experience, on disks whose inner vertices are moved
/// about.
const STEPS: usize = 60;
const STEPS_AFTER: usize = 10;

/// The largest eps, the least, and the share of the worst determinant that it follows: about as patches are pulled over
/// when they are untangled.
const WIDEST: f64 = 1.0;
const NARROWEST: f64 = 1e-4;
const OF_WORST: f64 = 0.2;

/// The uv of the vertices of `chart` from `uv` on, those of the boundary where they are; none where triangles stay
/// folded.
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub(super) fn unfolded(
    chart: &Chart,
    uv: Vec<[f64; 2]>,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<[f64; 2]>>, sparse::Error> {
    let elements = Elements::of(chart);
    // Areas in the plane are brought to those in space.
    let to_size = elements.mean_det(&uv).recip().sqrt();
    if !to_size.is_finite() {
        return Ok(None);
    }
    let mut uv: Vec<[f64; 2]> = uv.iter().map(|p| p.map(|c| to_size * c)).collect();
    let mut is_free = vec![true; uv.len()];
    chart.boundary().for_each(|h| is_free[chart.from(h).index()] = false);
    let free: Vec<u32> = (0..uv.len() as u32).filter(|v| is_free[*v as usize]).collect();
    if free.is_empty() {
        return Ok(None);
    }
    let dofs = Dofs::new(uv.len(), free);
    let shares = elements.shares(uv.len());
    let descent = Descent { elements: &elements, dofs: &dofs, barrier: None, shares: &shares, monitor };
    for _ in 0..STEPS {
        let worst = elements.least_det(&uv);
        if worst > 0.0 {
            break;
        }
        let eps = (OF_WORST * worst.abs()).clamp(NARROWEST, WIDEST);
        if descent.step(Regularised { eps }, false, &mut uv)?.is_none() {
            break;
        }
    }
    if elements.least_det(&uv) <= 0.0 {
        return Ok(None);
    }
    for _ in 0..STEPS_AFTER {
        if descent.step(SymmetricDirichlet, true, &mut uv)?.is_none() {
            break;
        }
    }
    Ok(Some(uv.iter().map(|p| p.map(|c| c / to_size)).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::monitor::NoMonitor;
    use crate::{decompose, repair, shapes};

    #[test]
    fn what_is_folded_inside_a_boundary_is_unfolded_and_the_boundary_stays() {
        let mesh = repair(&shapes::flat_disk(6), &Default::default()).expect("a surface").mesh;
        let charts = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts();
        let chart = &charts[0];
        let rest: Vec<[f64; 2]> = chart.points().iter().map(|[x, y, _]| [*x, *y]).collect();
        let mut is_outside = vec![false; rest.len()];
        chart.boundary().for_each(|h| is_outside[chart.from(h).index()] = true);
        // Inside, every vertex is moved by up to two rings, and most triangles fold.
        let mut random = shapes::Random(3);
        let mut thrown = rest.clone();
        for (p, _) in thrown.iter_mut().zip(&is_outside).filter(|(_, is_outside)| !**is_outside) {
            *p = p.map(|c| (c + 0.3 * random.symmetric()).clamp(-0.7, 0.7));
        }
        let elements = Elements::of(chart);
        assert!(elements.least_det(&thrown) < 0.0);
        let uv = unfolded(chart, thrown, &NoMonitor).expect("solves").expect("unfolds");
        assert!(elements.least_det(&uv) > 0.0);
        for v in 0..rest.len() {
            let distance = (uv[v][0] - rest[v][0]).hypot(uv[v][1] - rest[v][1]);
            // Within one ring of where they were.
            assert!(distance < if is_outside[v] { 1e-12 } else { 1.0 / 6.0 }, "{v}: {distance}");
        }
    }
}
