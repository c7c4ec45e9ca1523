//! The harmonic map by finite elements of any order, on triangles that are flat or curved in space.

use super::elimination;
use super::filled::FilledChart;
use super::nodes::Nodes;
use crate::fem::assembly::Assembly;
use crate::fem::dofs::Dofs;
use crate::fem::element::{self, Element, P2};
use crate::fem::laplace;
use crate::fem::sparse;
use crate::fem::stiffness::Triangles;
use crate::fem::two_level::{Prolongation, TwoLevel};
use crate::monitor::{Checkpoint, Monitor};

/// The values (u, v) at all nodes of element `E` (see [`Nodes`]) of the harmonic map of a filled chart. `on_outer` tells
/// the place of a point on the outer loop, given the number of its edge in [`FilledChart::outer`] and its share of the way
/// along, in [0, 1).
///
/// u and v solve the Laplace problem of the surface: one factorisation, two right-hand sides. The map need not be valid.
///
/// # Errors
/// [`sparse::Error`]: the system cannot be factorised (a curved triangle may be degenerate), or interrupted.
///
/// # Example
///
/// Linear and quadratic elements in one line each. On a flat disk the identity is harmonic, and both find it.
///
/// ```
/// use planish_core::fem::element::{P1, P2};
/// use planish_core::map::filled::FilledChart;
/// use planish_core::map::harmonic::harmonic_map;
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{decompose, repair, shapes};
///
/// let mesh = repair(&shapes::flat_disk(3), &Default::default())?.mesh;
/// let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()])?;
/// let chart = FilledChart::new(&atlas.charts()[0]);
/// let points = atlas.charts()[0].points();
/// let on_outer = |edge: usize, share: f64| {
///     let [a, b] = chart.ends(chart.outer()[edge]).map(|v| points[v.index()]);
///     [0, 1].map(|k| (1.0 - share) * a[k] + share * b[k])
/// };
/// let linear = harmonic_map::<P1, 3>(&chart, on_outer, &NoMonitor)?;
/// let quadratic = harmonic_map::<P2, 6>(&chart, on_outer, &NoMonitor)?;
/// for (v, [x, y, _]) in points.iter().enumerate() {
///     for [found_x, found_y] in [linear[v], quadratic[v]] {
///         assert!((found_x - x).hypot(found_y - y) < 1e-14);
///     }
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn harmonic_map<E: Element<N>, const N: usize>(
    chart: &FilledChart,
    on_outer: impl Fn(usize, f64) -> [f64; 2],
    monitor: &dyn Monitor,
) -> Result<Vec<[f64; 2]>, sparse::Error> {
    let nodes = Nodes::<E, N>::on(chart);
    let dofs = elimination::dofs_inside(&nodes, chart);
    let prescribed = prescribed(&nodes, chart, on_outer);
    let stiffness = |face: usize| chart.stiffness::<E, N>(face);
    let faces = chart.triangles().len();
    laplace::harmonic(&dofs, faces, |f| nodes.of(f), stiffness, prescribed, &Checkpoint::new(monitor))
}

/// Per node its place on the outer loop; nothing for those inside.
fn prescribed<E: Element<N>, const N: usize>(
    nodes: &Nodes<E, N>,
    chart: &FilledChart,
    on_outer: impl Fn(usize, f64) -> [f64; 2],
) -> Vec<[f64; 2]> {
    let mut prescribed = vec![[0.0; 2]; nodes.count()];
    for i in 0..chart.outer().len() {
        nodes.on_outer(i).for_each(|(node, share)| prescribed[node] = on_outer(i, share));
    }
    prescribed
}

/// As [`harmonic_map`] of quadratic elements, by conjugate gradients ([`TwoLevel`]): with a third of the memory. None where a
/// factor is sooner there, unless they are the `last_resort`, and where they do not come to rest.
///
/// # Errors
/// As [`harmonic_map`].
pub(crate) fn iterated_harmonic_map(
    chart: &FilledChart,
    on_outer: impl Fn(usize, f64) -> [f64; 2],
    last_resort: bool,
    monitor: &dyn Monitor,
) -> Result<Option<Vec<[f64; 2]>>, sparse::Error> {
    let checkpoint = Checkpoint::new(monitor);
    let nodes = chart.quadratic_nodes();
    let is_outer = nodes.is_outer();
    // As they are numbered: what is near in the mesh is near in memory.
    let fine = Dofs::new(nodes.count(), (0..nodes.count() as u32).filter(|n| !is_outer[*n as usize]).collect());
    // In the order in which they are eliminated.
    let vertices = chart.elimination().iter().map(|v| nodes.at_vertex(*v) as u32);
    let coarse = Dofs::new(nodes.count(), vertices.collect());
    let faces = 0..chart.triangles().len();
    let corners = |f: usize| {
        let [a, b, c, ..] = nodes.of(f);
        [a, b, c]
    };
    checkpoint.after(faces.len())?;
    let pattern = fine.pattern(faces.clone().map(|f| nodes.of(f)));
    let coarse_pattern = coarse.pattern(faces.clone().map(corners));
    let mut system = Assembly::new(&fine, &pattern, prescribed(&nodes, chart, on_outer));
    let mut linear = coarse_pattern.zeros();
    for f in faces.clone() {
        let matrix = chart.stiffness::<P2, 6>(f);
        system.add(f, &nodes.of(f), &matrix);
        coarse_pattern.add(&mut linear, f, &Prolongation::galerkin(&matrix));
    }
    checkpoint.after(faces.len())?;
    let analysis = coarse_pattern.analyse_as_numbered()?;
    let factor = match analysis.factorise(&linear, monitor) {
        Ok(factor) => factor,
        Err(sparse::Error::Unsolvable(_)) => return Ok(None),
        Err(interrupted) => return Err(interrupted),
    };
    let prolongation = Prolongation::new(&fine, &coarse, faces.map(|f| nodes.of(f)));
    let (matrix, rhs) = system.system();
    let levels = TwoLevel { pattern: &pattern, matrix, coarse: &factor, prolongation: &prolongation, last_resort };
    let solution = levels.solve(rhs, &checkpoint)?;
    Ok(solution.map(|solution| system.with_solution(&solution)))
}

/// The Dirichlet energy of the map with these values at the nodes of element `E`, that on the fans included.
pub fn dirichlet_energy<E: Element<N>, const N: usize>(chart: &FilledChart, uv: &[[f64; 2]]) -> f64 {
    let nodes = Nodes::<E, N>::on(chart);
    let of_face = |f: usize| element::energy(&chart.stiffness::<E, N>(f), &nodes.of(f).map(|n| uv[n]));
    (0..chart.triangles().len()).map(of_face).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atlas::Chart;
    use crate::fem::element::P1;
    use crate::fem::element::cubic::Cubic;
    use crate::fem::quadrature::Rule;
    use crate::monitor::NoMonitor;
    use crate::topology::VertexId;
    use crate::vec3::Vec3;
    use crate::{decompose, repair, shapes};

    fn flat_disk(rings: u32) -> Chart {
        let mesh = repair(&shapes::flat_disk(rings), &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
        atlas.into_charts().swap_remove(0)
    }

    fn in_plane(chart: &Chart, v: VertexId) -> [f64; 2] {
        let [x, y, _] = chart.points()[v.index()];
        [x, y]
    }

    /// The place of a point on the outer loop of a flat chart.
    fn on_chord(chart: &Chart, edge: usize, share: f64) -> [f64; 2] {
        let h = chart.outer()[edge];
        let [a, b] = [h, h.next()].map(|h| in_plane(chart, chart.from(h)));
        [0, 1].map(|k| (1.0 - share) * a[k] + share * b[k])
    }

    /// The error in the mean square over a flat disk of the harmonic functions Re z^5 and Im z^5.
    fn error_on_flat_disk<E: Element<N>, const N: usize>(rings: u32) -> f64 {
        let chart = flat_disk(rings);
        let exact = |[x, y]: [f64; 2]| {
            let (r, angle) = (x.hypot(y), y.atan2(x));
            [r.powi(5) * (5.0 * angle).cos(), r.powi(5) * (5.0 * angle).sin()]
        };
        let filled = FilledChart::new(&chart);
        let on_outer = |edge: usize, share: f64| exact(on_chord(&chart, edge, share));
        let uv = harmonic_map::<E, N>(&filled, on_outer, &NoMonitor).expect("solves");
        let nodes = Nodes::<E, N>::on(&filled);
        let square_on = |f: usize| {
            let corners = chart.triangles()[f].map(|v| in_plane(&chart, v));
            let values = nodes.of(f).map(|n| uv[n]);
            let square = |l| {
                let [found, wanted] = [E::interpolate(&values, l), exact(P1::interpolate(&corners, l))];
                (found[0] - wanted[0]).powi(2) + (found[1] - wanted[1]).powi(2)
            };
            chart.area(f) * Rule::of_degree(8).mean(square)
        };
        (0..chart.triangles().len()).map(square_on).sum::<f64>().sqrt()
    }

    fn converges_by_one_more_than_its_order<E: Element<N>, const N: usize>() {
        let [coarse, fine] = [6, 12].map(error_on_flat_disk::<E, N>);
        let slope = (coarse / fine).log2();
        assert!((slope - f64::from(E::ORDER + 1)).abs() < 0.2, "order {}: {coarse} {fine}: {slope}", E::ORDER);
    }

    #[test]
    fn each_element_converges_by_one_more_than_its_order() {
        converges_by_one_more_than_its_order::<P1, 3>();
        converges_by_one_more_than_its_order::<P2, 6>();
        converges_by_one_more_than_its_order::<Cubic, 10>();
    }

    /// The distance, in the mean square over the vertices, of the P2 harmonic map of half of the unit sphere to the projection from its pole, which is
    /// conformal, hence harmonic: by flat triangles, and by curved ones through points of the sphere.
    fn errors_on_half_sphere(rings: u32) -> [f64; 2] {
        let lift = |[x, y]: [f64; 2]| -> Vec3 {
            let s = 1.0 + x * x + y * y;
            [2.0 * x / s, 2.0 * y / s, (s - 2.0) / s]
        };
        let flat = flat_disk(rings);
        // The triangulation of the disk, lifted to the sphere.
        let points = flat.points().iter().map(|[x, y, _]| lift([*x, *y])).collect();
        let triangles = flat.triangles().iter().map(|t| t.map(|v| v.0)).collect();
        let soup = crate::mesh::TriangleSoup::new(points, triangles).expect("sound");
        let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
        let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
        let chart = &atlas.charts()[0];
        let project = |[x, y, z]: Vec3| [x / (1.0 - z), y / (1.0 - z)];
        let at = |v: VertexId| project(chart.points()[v.index()]);
        let curved: Vec<[Vec3; 6]> = (chart.triangles().iter())
            .map(|t| P2::NODES.map(|l| lift(P1::interpolate(&t.map(at), l)).map(|c| c * chart.scale())))
            .collect();
        let by_flat = FilledChart::new(chart);
        let by_curved = FilledChart::new(chart).with_curved_triangles(curved);
        [by_flat, by_curved].map(|filled| {
            let on_outer = |edge: usize, share: f64| {
                let [a, b] = filled.ends(filled.outer()[edge]).map(at);
                [0, 1].map(|k| (1.0 - share) * a[k] + share * b[k])
            };
            let uv = harmonic_map::<P2, 6>(&filled, on_outer, &NoMonitor).expect("solves");
            let count = chart.vertices().len();
            let square = |v: usize| {
                let [x, y] = at(VertexId::at(v));
                (uv[v][0] - x).powi(2) + (uv[v][1] - y).powi(2)
            };
            ((0..count).map(square).sum::<f64>() / count as f64).sqrt()
        })
    }

    #[test]
    fn curved_triangles_are_an_addition_and_worth_an_order() {
        let [[flat, curved], [fine_flat, fine_curved]] = [10, 20].map(errors_on_half_sphere);
        let [of_flat, of_curved] = [flat / fine_flat, curved / fine_curved].map(f64::log2);
        assert!(of_flat < 2.2 && of_curved > 2.7, "{of_flat} {of_curved}");
        assert!(fine_curved < 0.1 * fine_flat, "{fine_curved} {fine_flat}");
    }

    /// The solution of either solver, on good and on bad triangles, with holes, whatever the size.
    #[test]
    fn conjugate_gradients_come_to_the_solution_of_the_factorised_system() {
        let soups = [
            shapes::disk(3),
            shapes::disk(40),
            shapes::bent_disk(24, 0.45, 1.0),
            shapes::disk_with_holes(21, 3),
            shapes::sliver_strip(6),
        ];
        for soup in soups {
            let mesh = repair(&soup, &Default::default()).expect("a surface").mesh;
            let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
            let filled = FilledChart::new(&atlas.charts()[0]);
            let count = filled.outer().len() as f64;
            let on_outer = |edge: usize, share: f64| {
                let turn = std::f64::consts::TAU * (edge as f64 + share) / count;
                [turn.cos(), turn.sin()]
            };
            let exact = harmonic_map::<P2, 6>(&filled, on_outer, &NoMonitor).expect("solves");
            let found =
                iterated_harmonic_map(&filled, on_outer, true, &NoMonitor).expect("solves").expect("comes to rest");
            let off = exact.iter().zip(&found).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1])).fold(0.0, f64::max);
            assert!(off < 1e-9, "{off:.1e} of {} triangles", soup.triangles().len());
        }
    }
}
