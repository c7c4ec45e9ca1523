//! The map of a chart that is nearest to an isometry, with its boundary free: for charts whose conformal map covers
//! itself.
//!
//! Minimises the symmetric Dirichlet energy of the P1 map,
//!
//! ```text
//! sum_T A_T (|J_T|_F^2 + |J_T^-1|_F^2),
//! ```
//!
//! and a barrier that keeps the loops apart (Smith and Schaefer 2015, *Bijective parameterization with free
//! boundaries*, doi 10.1145/2766947), by Newton steps with a positive Hessian. It begins at the linear map on the disk
//! and stays one-to-one: no step goes as far as a triangle loses its area, or leaves the loops other than simple and
//! rightly nested.

use super::clearance::{Barrier, Clearance};
use super::descent::Descent;
use super::elements::Elements;
use crate::atlas::Chart;
use crate::fem::dofs::Dofs;
use crate::fem::isotropic::SymmetricDirichlet;
use crate::fem::sparse;
use crate::monitor::Monitor;

/// The largest number of steps. By experience: charts of CAD parts are at rest after 6 to 20, the largest number was 33
/// (airplane_27_holes); generic_twin_7081, stretched by 3e5 on the disk, is far from that after 50.
const STEPS: usize = 50;

/// A step that gains no more than this share of the energy is the last one. By experience: there the energies of
/// soccerball_g31 fall in their fourth digit.
const AT_REST: f64 = 1e-4;

/// The uv of the vertices of `chart` when its boundary is freed, from `uv` on, a one-to-one P1 map; none where that
/// cannot be improved.
///
/// # Errors
/// The system cannot be solved, or interrupted.
pub(super) fn freed(
    chart: &Chart,
    mut uv: Vec<[f64; 2]>,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<[f64; 2]>>, sparse::Error> {
    let elements = Elements::of(chart);
    let scale = elements.best_scale(&uv);
    if !scale.is_finite() {
        return Ok(None);
    }
    uv.iter_mut().for_each(|p| *p = p.map(|c| scale * c));
    let dofs = Dofs::new(uv.len(), (0..uv.len() as u32).collect());
    let clearance = Clearance::of(chart);
    let shares = elements.shares(uv.len());
    for _ in 0..STEPS {
        // An isometry has the energy 4 per area.
        let share = (4.0 * elements.area() / elements.energy(SymmetricDirichlet, &uv)).sqrt();
        let barrier = Some(Barrier { clearance: &clearance, share });
        let descent = Descent { elements: &elements, dofs: &dofs, barrier, shares: &shares, monitor };
        match descent.step(SymmetricDirichlet, true, &mut uv)? {
            Some(step) if !step.is_less_than(AT_REST) => {}
            Some(_) | None => break,
        }
    }
    Ok(Some(uv))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::boundary::{Boundary, Mids};
    use crate::map::filled::FilledChart;
    use crate::map::linear::linear_map;
    use crate::map::natural::Stretch;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::{decompose, repair, shapes};

    fn chart_of(soup: &TriangleSoup) -> Chart {
        let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
        decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0)
    }

    fn on_disk(chart: &Chart) -> Vec<[f64; 2]> {
        let filled = FilledChart::new(chart);
        let map = linear_map(&filled, &Boundary::circle(&filled, Mids::Chord), &NoMonitor).expect("maps");
        map.uv()[..chart.vertices().len()].iter().map(|p| p.uv()).collect()
    }

    fn most_stretched(chart: &Chart, uv: &[[f64; 2]]) -> [f64; 2] {
        let mut most = [1.0_f64; 2];
        for (t, shape) in chart.triangles().iter().zip(chart.shapes()) {
            let stretch = Stretch::between(shape.in_plane(), t.map(|v| uv[v.index()]));
            most = [most[0].max(stretch.conformal), most[1].max(stretch.area).max(stretch.area.recip())];
        }
        most
    }

    #[test]
    fn a_flat_sheet_comes_out_as_it_is_with_holes_too() {
        let plate = shapes::disk_with_holes(13, 2);
        let flat = plate.points().iter().map(|[x, y, _]| [*x, *y, 0.0]).collect();
        let plate = TriangleSoup::new(flat, plate.triangles().to_vec()).expect("sound");
        for soup in [shapes::flat_disk(6), plate] {
            let chart = chart_of(&soup);
            let uv = freed(&chart, on_disk(&chart), &NoMonitor).expect("solves").expect("freed");
            let [conformal, area] = most_stretched(&chart, &uv);
            assert!(conformal < 1.01 && area < 1.01, "{conformal} {area}");
        }
    }

    #[test]
    fn the_energy_falls_and_the_boundary_of_what_would_cover_itself_stays_simple() {
        // Two turns of a ramp: as isometric as it can be, one lies on the other.
        let chart = chart_of(&shapes::ramp(24, 48));
        let mut uv = on_disk(&chart);
        let elements = Elements::of(&chart);
        let dofs = Dofs::new(uv.len(), (0..uv.len() as u32).collect());
        let (clearance, shares) = (Clearance::of(&chart), elements.shares(uv.len()));
        let kept = Descent {
            elements: &elements,
            dofs: &dofs,
            barrier: Some(Barrier { clearance: &clearance, share: 1.0 }),
            shares: &shares,
            monitor: &NoMonitor,
        };
        let loose = Descent { barrier: None, ..kept };
        let mut of_loose = uv.clone();
        let mut last = f64::INFINITY;
        for _ in 0..STEPS {
            let Some(step) = kept.step(SymmetricDirichlet, true, &mut uv).expect("solves") else { break };
            assert!(step.after < step.before && step.before <= last, "{step:?}");
            assert!(clearance.is_kept(&uv) && elements.least_det(&uv) > 0.0);
            last = step.after;
            loose.step(SymmetricDirichlet, true, &mut of_loose).expect("solves");
        }
        assert!(!clearance.is_kept(&of_loose), "nothing else keeps it from covering itself");
    }

    #[test]
    fn it_comes_out_the_same_every_time() {
        let chart = chart_of(&shapes::ramp(24, 40));
        let [first, second] = [0, 1].map(|_| freed(&chart, on_disk(&chart), &NoMonitor).expect("solves"));
        assert!(first.is_some() && first == second);
    }
}
