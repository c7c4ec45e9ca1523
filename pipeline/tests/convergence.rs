//! Convergence: halving the mesh must divide the error as theory says.

use planish_core::fem::assembly::Assembly;
use planish_core::fem::dofs::Dofs;
use planish_core::fem::element::{self, Element, P1, P2};
use planish_core::fem::geometry::FirstForm;
use planish_core::fem::quadrature::Rule;
use planish_core::fem::stiffness::stiffness_by_quadrature;
use planish_core::map::boundary::Boundary;
use planish_core::map::filled::FilledChart;
use planish_core::map::linear::harmonic_uv;
use planish_core::map::quadratic::quadratic_map;
use planish_core::monitor::NoMonitor;
use planish_core::vec3::{Vec3, midpoint, norm, triangle_area};
use planish_core::{decompose, repair, shapes};

/// Real and imaginary part of e^z / 4, which are harmonic.
fn exact(p: Vec3) -> [f64; 2] {
    let scale = 0.25 * p[0].exp();
    [scale * p[1].cos(), scale * p[1].sin()]
}

/// The L2 errors of the linear and the quadratic harmonic map on a flat disk with `rings` rings.
fn errors(rings: u32) -> [f64; 2] {
    let mesh = repair(&shapes::flat_disk(rings), &Default::default()).expect("a surface").mesh;
    let chart =
        FilledChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0]);
    let place = |v: planish_core::topology::VertexId| mesh.points()[v.index()];
    let ends = |h: &planish_core::topology::HalfEdgeId| chart.ends(*h).map(place);
    let vertices: Vec<_> = chart.outer().iter().map(|h| exact(ends(h)[0])).collect();
    let mids: Vec<_> = chart.outer().iter().map(|h| exact(midpoint(ends(h)[0], ends(h)[1]))).collect();
    let boundary = Boundary::through(&chart, &vertices, &mids).expect("one per node");
    let linear = harmonic_uv(&chart, &boundary, &NoMonitor).expect("solves");
    let quadratic = quadratic_map(&chart, &boundary, &NoMonitor).expect("solves");
    let mut squares = [0.0; 2];
    for (f, t) in chart.triangles().iter().enumerate() {
        let corners = t.map(place);
        let linear_uv = t.map(|v| linear[v.index()].uv());
        let quadratic_uv = chart.nodes(f).map(|n| quadratic.nodes()[n].uv());
        Rule::of_degree(5).for_each(|l, weight| {
            let wanted = exact(P1::interpolate(&corners, l));
            let found = [P1::interpolate(&linear_uv, l), P2::interpolate(&quadratic_uv, l)];
            for (square, got) in squares.iter_mut().zip(found) {
                let off = [0, 1].map(|k| got[k] - wanted[k]);
                *square += weight * triangle_area(corners) * (off[0] * off[0] + off[1] * off[1]);
            }
        });
    }
    squares.map(f64::sqrt)
}

#[test]
fn linear_elements_are_of_order_2_and_quadratic_ones_of_order_3() {
    let [coarse, fine] = [errors(16), errors(32)];
    let orders = [0, 1].map(|k| (coarse[k] / fine[k]).log2());
    assert!((orders[0] - 2.0).abs() < 0.1 && (orders[1] - 3.0).abs() < 0.1, "{orders:?} {coarse:?} {fine:?}");
}

/// The energy of e^z / 4 over a triangle, by its exact gradient, against that of its quadratic interpolant.
#[test]
fn the_energy_of_the_interpolant_converges() {
    let p: [Vec3; 3] = [[0.1, 0.2, 0.0], [0.13, 0.2, 0.0], [0.1, 0.24, 0.0]];
    let shape = planish_core::mesh::TriangleShape::of(p);
    let nodes = [p[0], p[1], p[2], midpoint(p[0], p[1]), midpoint(p[1], p[2]), midpoint(p[2], p[0])].map(exact);
    let discrete = element::energy(&P2::stiffness(&shape), &nodes);
    let density = |l: [f64; 3]| {
        let [x, ..] = P1::interpolate(&p, l);
        (0.25 * x.exp()).powi(2)
    };
    let continuous = triangle_area(p) * Rule::of_degree(5).mean(density);
    assert!((discrete / continuous - 1.0).abs() < 1e-6, "{discrete} {continuous}");
}

/// The point of the unit sphere whose stereographic projection from the north pole is `uv`.
fn on_sphere([u, v]: [f64; 2]) -> Vec3 {
    let s = 1.0 + u * u + v * v;
    [2.0 * u / s, 2.0 * v / s, (s - 2.0) / s]
}

/// The stereographic projection from the north pole of the point of the unit sphere that is nearest to `x`.
fn stereographic(x: Vec3) -> [f64; 2] {
    let r = norm(x);
    [x[0] / (r - x[2]), x[1] / (r - x[2])]
}

/// A hemisphere of `6 rings^2` triangles through nodes of the sphere: its chart, and where the exact map has its nodes.
fn hemisphere(rings: u32) -> (FilledChart, Vec<[f64; 2]>) {
    let mesh = repair(&shapes::flat_disk(rings), &Default::default()).expect("a surface").mesh;
    let atlas = decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart");
    let chart = FilledChart::new(&atlas.charts()[0]);
    let mut uv = vec![[0.0; 2]; chart.node_count()];
    for (f, t) in chart.triangles().iter().enumerate() {
        let corners = t.map(|v| mesh.points()[v.index()]);
        for (node, l) in chart.nodes(f).into_iter().zip(P2::NODES) {
            let [u, v, _] = P1::interpolate(&corners, l);
            uv[node] = [u, v];
        }
    }
    for h in chart.outer() {
        let mid = &mut uv[chart.mid_node(*h)];
        let r = mid[0].hypot(mid[1]);
        *mid = mid.map(|c| c / r);
    }
    (chart, uv)
}

/// The L2 errors of the harmonic map of a hemisphere to the disk by quadratic elements, on triangles that are flat in
/// space and on curved ones.
fn errors_on_hemisphere(rings: u32) -> [f64; 2] {
    let (chart, exact) = hemisphere(rings);
    let is_outer = chart.outer_nodes();
    let free = (0..chart.node_count() as u32).filter(|n| !is_outer[*n as usize]).collect();
    let dofs = Dofs::new(chart.node_count(), free);
    let faces = 0..chart.triangles().len();
    let pattern = dofs.pattern(faces.clone().map(|f| chart.nodes(f)));
    let analysis = pattern.analyse().expect("small");
    [false, true].map(|is_curved| {
        let geometry = |f: usize| {
            let nodes = chart.nodes(f).map(|n| on_sphere(exact[n]));
            let [a, b, c, ..] = nodes;
            if is_curved { nodes } else { P2::NODES.map(|l| P1::interpolate(&[a, b, c], l)) }
        };
        let mut system = Assembly::new(&dofs, &pattern, exact.clone());
        for f in faces.clone() {
            let x = geometry(f);
            let metric = |l| FirstForm::of_nodes::<P2, 6>(&x, l);
            system.add(f, &chart.nodes(f), &stiffness_by_quadrature::<P2, 6>(metric, Rule::of_degree(6)));
        }
        let found = system.solve(&analysis, &NoMonitor).expect("positive definite");
        let mut square = 0.0;
        for f in faces.clone() {
            let (x, uv) = (geometry(f), chart.nodes(f).map(|n| found[n]));
            Rule::of_degree(6).for_each(|l, weight| {
                let area = 0.5 * FirstForm::of_nodes::<P2, 6>(&x, l).area_element;
                let (got, wanted) = (P2::interpolate(&uv, l), stereographic(P2::interpolate(&x, l)));
                square += weight * area * ((got[0] - wanted[0]).powi(2) + (got[1] - wanted[1]).powi(2));
            });
        }
        square.sqrt()
    })
}

/// The harmonic map of a hemisphere to the disk is the stereographic projection. Flat triangles hold quadratic elements
/// back: their order falls towards that of the surface that they make, 2, as meshes get finer (2.8 from 8 to 16 rings).
#[test]
fn on_a_hemisphere_quadratic_elements_are_of_order_3_on_curved_triangles_only() {
    let [coarse, fine] = [errors_on_hemisphere(24), errors_on_hemisphere(48)];
    let orders = [0, 1].map(|k| (coarse[k] / fine[k]).log2());
    assert!(orders[0] < 2.5 && orders[1] > 2.9, "{orders:?} {coarse:?} {fine:?}");
}
