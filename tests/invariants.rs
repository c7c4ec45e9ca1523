//! What must not depend on how a surface is given: every fixture, scaled, turned and shuffled.

use crate::fixtures::{ALL, generate};
use pipeline::mesh::TriangleSoup;
use pipeline::{CertifiedChart, Order, decompose, finish_chart, map_chart, repair};
use planish::formats::{self, Kind};

/// The certified chart of a soup, if it is one chart.
fn chart(soup: &TriangleSoup) -> Option<CertifiedChart> {
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let atlas = decompose(&mesh, &Default::default()).ok()?;
    Some(finish_chart(map_chart(&atlas.charts()[0], Order::Quadratic).expect("maps")))
}

fn moved(soup: &TriangleSoup, f: impl Fn([f64; 3]) -> [f64; 3]) -> TriangleSoup {
    TriangleSoup::new(soup.points().iter().map(|p| f(*p)).collect(), soup.triangles().to_vec()).expect("sound")
}

/// Triangles in another order, each beginning at another corner.
fn shuffled(soup: &TriangleSoup) -> TriangleSoup {
    let n = soup.triangles().len();
    let step = (0..).map(|k| n / 2 + 1 + k).find(|s| gcd(*s, n) == 1).unwrap_or(1);
    let turned = |i: usize| {
        let [a, b, c] = soup.triangles()[i * step % n];
        if i.is_multiple_of(2) { [b, c, a] } else { [c, a, b] }
    };
    TriangleSoup::new(soup.points().to_vec(), (0..n).map(turned).collect()).expect("sound")
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[test]
fn certified_stays_certified_and_energies_stay() {
    let turn = |p: [f64; 3]| {
        [0.36 * p[0] + 0.48 * p[1] - 0.8 * p[2], -0.8 * p[0] + 0.6 * p[1], 0.48 * p[0] + 0.64 * p[1] + 0.6 * p[2]]
    };
    for (name, content) in generate::all() {
        let Kind::Mesh(format) = formats::kind(name.as_ref()) else { panic!("a mesh") };
        let soup = formats::read(format, &content).expect("readable");
        let expected = ALL.iter().find(|f| f.0 == name).is_some_and(|f| f.4);
        let copies = [
            ("scaled down", moved(&soup, |p| p.map(|c| c * 1e-8))),
            ("scaled up", moved(&soup, |p| p.map(|c| c * 1e8))),
            ("turned", moved(&soup, turn)),
            ("shuffled", shuffled(&soup)),
        ];
        let reference = chart(&soup);
        assert_eq!(reference.is_some(), expected, "{name}");
        for (how, copy) in copies {
            let got = chart(&copy);
            assert_eq!(got.is_some(), expected, "{name} {how}");
            let (Some(got), Some(reference)) = (got, &reference) else { continue };
            let energies = |c: &CertifiedChart| {
                let report = c.untangle.clone().expect("quadratic");
                (report.energy_harmonic, report.energy)
            };
            let ((harmonic, energy), (h, e)) = (energies(&got), energies(reference));
            assert!((harmonic / h - 1.0).abs() < 1e-6, "{name} {how}: harmonic {harmonic}, {h}");
            // Minimisers of a problem that is not convex may differ, but not by much.
            assert!((energy / e - 1.0).abs() < 1e-2, "{name} {how}: {energy}, {e}");
            assert_eq!(
                got.certified.certificate().hole_centres.len(),
                reference.certified.certificate().hole_centres.len()
            );
        }
    }
}
