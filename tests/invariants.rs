//! What must not depend on how a surface is given: every fixture, scaled, turned and shuffled.

use crate::fixtures::{ALL, generate};
use planish::formats::{self, Kind};
use planish_core::mesh::TriangleSoup;
use planish_core::monitor::NoMonitor;
use planish_core::{CertifiedChart, ChartJob, ChartSettings, decompose, repair};

/// The largest area ratio: enough for the bent disk to stay whole, so that its energies can be compared.
const MAX_AREA_RATIO: f64 = 1e7;

/// The certified charts of a soup. Ears of charts are not split: which of the edges beside one is halved depends on the order
/// of the triangles, and energies are compared of the same elements.
fn charts(soup: &TriangleSoup) -> Vec<CertifiedChart> {
    let decompose =
        decompose::Settings { max_area_ratio: MAX_AREA_RATIO, feature_angle: None, ..decompose::Settings::default() };
    let settings = ChartSettings { decompose, ..ChartSettings::default() };
    let mesh = repair(soup, &Default::default()).expect("a surface").mesh;
    let atlas = decompose::decompose(&mesh, &decompose, &NoMonitor).expect("an atlas");
    let mut all = Vec::new();
    for chart in atlas.into_charts() {
        all.extend(ChartJob::new(chart, settings).run(&NoMonitor).expect("maps"));
    }
    for certified in &all {
        let ratio = certified.distortion().area_ratio;
        assert!(ratio <= MAX_AREA_RATIO || certified.chart().triangles().len() == 1, "{ratio}");
    }
    all
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
fn charts_and_energies_stay() {
    let turn = |p: [f64; 3]| {
        [0.36 * p[0] + 0.48 * p[1] - 0.8 * p[2], -0.8 * p[0] + 0.6 * p[1], 0.48 * p[0] + 0.64 * p[1] + 0.6 * p[2]]
    };
    for (name, content) in generate::all() {
        let Kind::Mesh(format) = formats::kind(name.as_ref()) else { panic!("a mesh") };
        let soup = formats::read_alone(format, &content).expect("readable").soup;
        let copies = [
            ("scaled down", moved(&soup, |p| p.map(|c| c * 1e-8))),
            ("scaled up", moved(&soup, |p| p.map(|c| c * 1e8))),
            ("turned", moved(&soup, turn)),
            ("shuffled", shuffled(&soup)),
        ];
        let allowed = ALL.iter().find(|f| f.0 == name).map(|f| f.4.clone()).expect("a fixture");
        let reference = charts(&soup);
        for (how, copy) in copies {
            let got = charts(&copy);
            assert!(allowed.contains(&got.len()), "{name} {how}: {} charts", got.len());
            // Where there is a choice of charts, ties are decided by numbers.
            let ([got], [reference]) = (&got[..], &reference[..]) else { continue };
            // Natural maps are scaled to what is in the unit of the input a power of two.
            let energies = |c: &CertifiedChart| {
                let report = c.provenance().untangle.clone().expect("quadratic");
                let scales = c.fields().iter().enumerate().map(|(f, of)| of.area_scale * c.chart().area(f));
                let area: f64 = scales.sum();
                (report.energy_unconstrained / area, report.energy / area)
            };
            let ((harmonic, energy), (h, e)) = (energies(got), energies(reference));
            assert!((harmonic / h - 1.0).abs() < 1e-6, "{name} {how}: harmonic {harmonic}, {h}");
            // Minimisers of a problem that is not convex may differ, but not by much.
            assert!((energy / e - 1.0).abs() < 1e-2, "{name} {how}: {energy}, {e}");
            assert_eq!(got.map().certificate().hole_centres.len(), reference.map().certificate().hole_centres.len());
        }
    }
}
