//! Convergence: halving the mesh must divide the error as theory says.

use planish_core::fem::element::{self, Element, P1, P2};
use planish_core::fem::quadrature::Rule;
use planish_core::map::boundary::Boundary;
use planish_core::map::filled::FilledChart;
use planish_core::map::linear::harmonic_uv;
use planish_core::map::quadratic::quadratic_map;
use planish_core::monitor::NoMonitor;
use planish_core::vec3::{Vec3, midpoint, triangle_area};
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
