//! The small exact examples: triangulations whose harmonic map folds. Expected values were found in rational
//! arithmetic, apart from this program.

use planish_core::certify::{PlanarMap, prove};
use planish_core::fem::bernstein;
use planish_core::grid::GridPoint;
use planish_core::map::boundary::{Boundary, Mids};
use planish_core::map::filled::FilledChart;
use planish_core::map::linear::{self, Method, folded, harmonic_uv, linear_map, mean_value_map};
use planish_core::map::quadratic::{QuadraticMap, quadratic_map};
use planish_core::mesh::TriangleSoup;
use planish_core::monitor::NoMonitor;
use planish_core::untangle::{Dirichlet, untangle};
use planish_core::vec3::{Vec3, distance};
use planish_core::{decompose, repair, shapes};
use std::f64::consts::TAU;

const TOLERANCE: f64 = 1e-8;

/// An example: its chart, and the places of its boundary vertices by vertex.
struct Example {
    chart: FilledChart,
    places: Vec<[f64; 2]>,
}

fn filled(soup: &TriangleSoup) -> FilledChart {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    FilledChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0])
}

/// F5 with its boundary on the corners of a square.
fn f5() -> Example {
    let places = vec![[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]];
    Example { chart: filled(&shapes::floater_five()), places }
}

/// Vertex 0 in the middle, the others around it, on the circle by chord length from vertex 1 on.
fn star(soup: &TriangleSoup) -> Example {
    let ring = &soup.points()[1..];
    let chord = |i: usize| distance(ring[i], ring[(i + 1) % ring.len()]);
    let total: f64 = (0..ring.len()).map(chord).sum();
    let on_circle = |i: usize| {
        let angle = TAU * (0..i).map(chord).sum::<f64>() / total;
        [angle.cos(), angle.sin()]
    };
    let unused: [f64; 2] = [0.0; 2];
    let places = std::iter::once(unused).chain((0..ring.len()).map(on_circle)).collect();
    Example { chart: filled(soup), places }
}

impl Example {
    fn boundary(&self, mids: Mids) -> Boundary {
        let points: Vec<[f64; 2]> =
            self.chart.outer().iter().map(|h| self.places[self.chart.ends(*h)[0].index()]).collect();
        Boundary::prescribed(&self.chart, &points, mids).expect("one point per vertex")
    }

    /// The triangle with these vertices.
    fn face(&self, vertices: [u32; 3]) -> usize {
        let sorted = |mut t: [u32; 3]| {
            t.sort_unstable();
            t
        };
        let same = |t: &[planish_core::topology::VertexId; 3]| sorted(t.map(|v| v.0)) == sorted(vertices);
        self.chart.triangles().iter().position(same).expect("a triangle of the example")
    }

    fn doubled_area(&self, places: &[GridPoint], vertices: [u32; 3]) -> f64 {
        let t = self.chart.triangles()[self.face(vertices)].map(|v| places[v.index()].uv());
        (t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0])
    }

    fn min_det(&self, map: &[GridPoint], vertices: [u32; 3]) -> f64 {
        let nodes = self.chart.nodes(self.face(vertices)).map(|n| map[n]);
        bernstein::range(bernstein::JacobianBezier::new(nodes).coefficients()).min
    }

    fn quadratic(&self, mids: Mids) -> QuadraticMap {
        quadratic_map(&self.chart, &self.boundary(mids), &NoMonitor).expect("solves")
    }

    /// The harmonic linear map folds, both repaired ones do not, and the quadratic one ends certified.
    fn passes_all_states(&self) {
        let boundary = self.boundary(Mids::Chord);
        assert_eq!(folded(&self.chart, &harmonic_uv(&self.chart, &boundary, &NoMonitor).expect("solves")).len(), 1);
        let m_matrix = linear_map(&self.chart, &boundary, &NoMonitor).expect("maps");
        assert_eq!((m_matrix.method(), m_matrix.folded()), (Method::MMatrix, 1));
        for mids in [Mids::Chord, Mids::Arc] {
            let mut boundary = self.boundary(mids);
            linear::flatten_ear_arcs(&self.chart, &m_matrix, &mut boundary);
            assert_eq!(boundary, self.boundary(mids), "these examples have no ears");
            let start = m_matrix.degree_elevated(&self.chart, &boundary);
            let harmonic = self.quadratic(mids);
            assert!(!harmonic.invalid().is_empty());
            let got = untangle(&self.chart, &Dirichlet::new(self.chart.shapes()), &start, &harmonic, &NoMonitor)
                .expect("ends");
            assert!(got.report.energy < got.report.energy_start && got.report.energy > got.report.energy_unconstrained);
            let cells = (0..self.chart.triangles().len()).map(|f| self.chart.nodes(f).map(|n| n as u32)).collect();
            let proven = prove(PlanarMap { cells, nodes: got.nodes, hole_centres: got.hole_centres });
            assert!(proven.is_ok(), "{proven:?}");
        }
    }
}

fn close(got: f64, want: f64) {
    assert!((got - want).abs() < TOLERANCE, "got {got}, want {want}");
}

fn close2(got: GridPoint, want: [f64; 2]) {
    close(got.uv()[0], want[0]);
    close(got.uv()[1], want[1]);
}

#[test]
fn f5_in_every_state() {
    let example = f5();
    let boundary = example.boundary(Mids::Chord);
    let cotangent = harmonic_uv(&example.chart, &boundary, &NoMonitor).expect("solves");
    close2(cotangent[4], [-85.0 / 207.0, -128.0 / 207.0]);
    close(example.doubled_area(&cotangent, [4, 2, 3]), -2.0 / 69.0);
    let mean_value = mean_value_map(&example.chart, &boundary, &NoMonitor).expect("maps");
    close2(mean_value.uv()[4], [-0.321944758, -0.553011927]);
    let chords = example.quadratic(Mids::Chord);
    close(example.min_det(chords.nodes(), [4, 2, 3]), -0.049704693);
    close(example.min_det(chords.nodes(), [4, 1, 2]), -0.625447349);
    close(example.min_det(example.quadratic(Mids::Arc).nodes(), [4, 1, 2]), -0.315548120);
    example.passes_all_states();
}

#[test]
fn t4_in_every_state() {
    let example = star(&shapes::folding_three());
    let boundary = example.boundary(Mids::Chord);
    let cotangent = harmonic_uv(&example.chart, &boundary, &NoMonitor).expect("solves");
    close2(cotangent[0], [-0.478019341, 0.824687131]);
    close(example.doubled_area(&cotangent, [0, 2, 3]), -0.17014829);
    close2(mean_value_map(&example.chart, &boundary, &NoMonitor).expect("maps").uv()[0], [-0.281751830, 0.398289848]);
    close(example.min_det(example.quadratic(Mids::Chord).nodes(), [0, 2, 3]), -0.041042086);
    close(example.min_det(example.quadratic(Mids::Arc).nodes(), [0, 2, 3]), -0.071451738);
    example.passes_all_states();
}

#[test]
fn p6_in_every_state() {
    let example = star(&shapes::folding_six());
    let boundary = example.boundary(Mids::Chord);
    let cotangent = harmonic_uv(&example.chart, &boundary, &NoMonitor).expect("solves");
    close2(cotangent[0], [-0.805064845, 0.403552024]);
    // Vertices 1 to 6 are the ring (8,1) (6,5) (2,9) (1,5) (-7,-3) (-1,-5).
    close(example.doubled_area(&cotangent, [0, 4, 5]), -0.29409754);
    close2(mean_value_map(&example.chart, &boundary, &NoMonitor).expect("maps").uv()[0], [-0.128596522, -0.106231255]);
    close(example.min_det(example.quadratic(Mids::Chord).nodes(), [0, 3, 4]), -0.212699827);
    let arcs = example.quadratic(Mids::Arc);
    close(example.min_det(arcs.nodes(), [0, 2, 3]), -0.017853576);
    close(example.min_det(arcs.nodes(), [0, 3, 4]), -0.062498685);
    example.passes_all_states();
}

/// Copies of a surface that must get the same map, up to a rotation of the disk.
#[test]
fn maps_do_not_depend_on_unit_place_or_numbering() {
    let soup = shapes::disk_with_holes(13, 2);
    let turned = |p: Vec3| [0.6 * p[0] - 0.8 * p[1] + 3.0, 0.8 * p[0] + 0.6 * p[1], p[2] - 7.0];
    let scaled = |s: f64| move |p: Vec3| p.map(|c| c * s);
    let n = soup.points().len() as u32;
    let reversed = TriangleSoup::new(
        soup.points().iter().rev().copied().collect(),
        soup.triangles().iter().rev().map(|t| t.map(|i| n - 1 - i)).collect(),
    );
    let moved = |f: &dyn Fn(Vec3) -> Vec3| {
        TriangleSoup::new(soup.points().iter().map(|p| f(*p)).collect(), soup.triangles().to_vec()).expect("sound")
    };
    let reference = radii(&soup);
    for (i, copy) in
        [moved(&turned), moved(&scaled(1e-8)), moved(&scaled(1e8)), reversed.expect("sound")].iter().enumerate()
    {
        let mut got = radii(copy);
        if i == 3 {
            got.reverse();
        }
        let off = got.iter().zip(&reference).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9, "copy {i}: {off}");
    }
}

/// The distances of the vertices from the centre of the disk, in the order of the soup's points (holes leave a
/// few points without triangles: -1).
fn radii(soup: &TriangleSoup) -> Vec<f64> {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let chart =
        FilledChart::new(&decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").charts()[0]);
    let map = quadratic_map(&chart, &Boundary::circle(&chart, Mids::Arc), &NoMonitor).expect("solves");
    let mut radii = vec![-1.0; soup.points().len()];
    for v in 0..mesh.points().len() {
        let [x, y] = map.nodes()[v].uv();
        radii[mesh.welded_vertex(planish_core::topology::VertexId::at(v)) as usize] = x.hypot(y);
    }
    radii
}
