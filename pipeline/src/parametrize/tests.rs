use super::*;
use crate::atlas::Chart;
use crate::certified::{BoundaryFound, CertifiedChart};
use crate::certify::BoundaryArgument;
use crate::map::boundary::{Boundary, Mids};
use crate::map::filled::FilledChart;
use crate::map::linear::{Method, flatten_ear_arcs, linear_map};
use crate::map::natural::{self, NoNatural};
use crate::map::quadratic::quadratic_map;
use crate::monitor::NoMonitor;
use crate::settings::{BoundaryShape, ChartSettings, Order};
use crate::vec3::Vec3;
use crate::{repair, shapes, untangle};

/// A surface as one chart.
fn whole(soup: &TriangleSoup) -> Chart {
    let mesh = repair(soup, &Default::default()).expect("repairs").mesh;
    decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("one chart").into_charts().remove(0)
}

/// The job to map a chart to the disk, without features.
fn job(chart: Chart, max_area_ratio: f64) -> ChartJob {
    let on_disk = decompose::Settings::of(BoundaryShape::Circle);
    let decompose = decompose::Settings { feature_angle: None, max_area_ratio, ..on_disk };
    ChartJob::new(chart, ChartSettings { decompose, ..ChartSettings::default() })
}

/// The parts into which one chart of all falls before it is untangled.
fn parts(soup: &TriangleSoup) -> Vec<Chart> {
    let mapped = job(whole(soup), 1e6).map(&NoMonitor).expect("maps");
    mapped.iter().map(|m| m.chart().clone()).collect()
}

#[test]
fn a_tube_of_long_facets_becomes_strips_that_unroll_and_a_fine_one_stays_whole() {
    let strips = parts(&shapes::tube(36, 1, 200.0));
    assert!(strips.len() >= 2, "{}", strips.len());
    for strip in &strips {
        assert!(strip.holes().is_empty());
        let natural = natural::natural(strip, f64::MAX, &NoMonitor).expect("no one interrupts").expect("it unrolls");
        assert!(natural.distortion.conformal_p99 < 4.0, "{:?}", natural.distortion);
    }
    let whole = parts(&shapes::tube(36, 6, 3.0));
    assert_eq!(whole.len(), 1, "nothing stretches there");
}

/// Four walls of two facets each, and a lid: its corners keep it from being unrolled in one part.
fn open_box(height: f64) -> TriangleSoup {
    let corner = |k: u32| [f64::from(k & 1), f64::from(k >> 1 & 1), height * f64::from(k >> 2)];
    let quads: [[u32; 4]; 5] = [[0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6], [4, 5, 7, 6]];
    let halves = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
    TriangleSoup::new((0..8).map(corner).collect(), halves.collect()).expect("sound")
}

#[test]
fn a_tall_box_falls_into_parts_that_unroll_and_a_low_one_stays_whole() {
    let walls = parts(&open_box(100.0));
    assert!((2..=3).contains(&walls.len()), "{}", walls.len());
    let unrolls = |part| natural::natural(part, f64::MAX, &NoMonitor).expect("no one interrupts").is_some();
    assert!(walls.iter().all(unrolls));
    let whole = parts(&open_box(12.0));
    assert_eq!(whole.len(), 1, "it stretches, but no more than others");
}

#[test]
fn what_untangling_stretches_too_much_is_split() {
    let largest = 5e5;
    let disk = whole(&shapes::bent_disk(32, 0.45, 1.0));
    let triangles = disk.triangles().len();
    let mapped = job(disk, largest).map(&NoMonitor).expect("maps");
    let [mapped] = &mapped[..] else { panic!("{} parts", mapped.len()) };
    let ratio = |done: &CertifiedChart| done.distortion().area_ratio;
    let as_it_is = parametrize_chart(mapped.chart().clone(), Order::Quadratic).expect("maps");
    assert!(ratio(&as_it_is) > largest, "neither linear nor harmonic map foretell it");
    let finished = mapped.clone().untangle(&NoMonitor).expect("maps");
    assert!(finished.len() > 1 && finished.iter().all(|f| ratio(f) <= largest));
    assert_eq!(finished.iter().map(|f| f.chart().triangles().len()).sum::<usize>(), triangles);
}

#[test]
fn jobs_need_neither_each_other_nor_the_surface() {
    let soup = shapes::sphere(12);
    let settings = Settings::default();
    let atlas = parametrize(&soup, &settings, &NoMonitor).expect("an atlas");
    let plan = Plan::new(repair(&soup, &settings.repair).expect("a surface").mesh, &settings, &NoMonitor);
    let Plan { mesh, jobs, .. } = plan.expect("charts");
    let size = settings.size;
    drop(soup);
    // The last one first; their results in the order of the jobs.
    let mut done: Vec<Vec<CertifiedChart>> =
        jobs.into_iter().rev().map(|job| job.run(&NoMonitor).expect("maps")).collect();
    done.reverse();
    let gathered = CertifiedAtlas::gather(mesh, done.concat(), size).expect("an atlas");
    let maps = |atlas: &CertifiedAtlas| atlas.charts().iter().map(|c| c.map().map().clone()).collect::<Vec<_>>();
    assert!(maps(&gathered) == maps(&atlas) && gathered.charts().len() >= 2);
    assert_eq!(gathered.seams().curves(), atlas.seams().curves());
    let ids = gathered.charts().iter().map(|c| c.id().index());
    assert!(ids.eq(0..gathered.charts().len()));
}

#[test]
fn charts_that_do_not_hold_every_triangle_once_are_no_atlas() {
    let atlas = parametrize(&shapes::sphere(6), &Settings::default(), &NoMonitor).expect("an atlas");
    let (mesh, charts) = (atlas.mesh(), atlas.charts());
    let gather = |charts: &[CertifiedChart]| CertifiedAtlas::gather(mesh.clone(), charts.to_vec(), None).map(|_| ());
    assert_eq!(gather(charts), Ok(()));
    let triangles = |c: usize| charts[c].chart().triangles().len();
    let missing = gather(&charts[1..]).expect_err("one is missing");
    assert!(matches!(missing, GatherError::Missing { count, .. } if count == triangles(0)), "{missing}");
    let twice = gather(&[charts, &charts[..1]].concat()).expect_err("one is there twice");
    assert!(matches!(twice, GatherError::Twice { first: 0, second, .. } if second == charts.len()), "{twice}");
    let other = parametrize(&shapes::sphere(9), &Settings::default(), &NoMonitor).expect("an atlas");
    let foreign = gather(&[&charts[..1], &other.charts()[1..]].concat()).expect_err("of another surface");
    assert!(matches!(foreign, GatherError::Foreign { part: 1, .. }), "{foreign}");
    // Of a surface with the same triangles that lies elsewhere.
    let soup = shapes::sphere(6);
    let flattened = soup.points().iter().map(|[x, y, z]| [*x, *y, 0.5 * z]).collect();
    let flattened = TriangleSoup::new(flattened, soup.triangles().to_vec()).expect("sound");
    let flattened = repair(&flattened, &Default::default()).expect("a surface").mesh;
    let moved = CertifiedAtlas::gather(flattened, charts.to_vec(), None).expect_err("of another surface");
    assert!(matches!(moved, GatherError::Foreign { .. }), "{moved}");
}

#[test]
fn the_reason_why_there_is_no_atlas_is_kept() {
    let flat = TriangleSoup::new(vec![[0.0; 3], [1.0, 0.0, 0.0]], vec![[0, 1, 1]]).expect("sound");
    let error = parametrize(&flat, &Settings::default(), &NoMonitor).expect_err("nothing is left");
    assert!(matches!(error, Error::Repair(repair::Error::OnlyDegenerate { .. })), "{error}");
    let mut settings = Settings::default();
    settings.decompose.max_triangles = 0;
    let error = parametrize(&shapes::sphere(4), &settings, &NoMonitor).expect_err("no chart has no triangle");
    assert!(matches!(error, Error::Setting(_)), "{error}");
}

/// What comes of a surface as one chart, whose natural boundary is asked for.
fn naturally(soup: &TriangleSoup) -> Vec<CertifiedChart> {
    let mut job = job(whole(soup), 1e6);
    job.settings.decompose.boundary = BoundaryShape::Natural;
    job.run(&NoMonitor).expect("maps")
}

/// A plate with two holes in the plane, each of its points moved.
fn plate(to: impl Fn(Vec3) -> Vec3) -> TriangleSoup {
    let flat = shapes::disk_with_holes(13, 2);
    let points = flat.points().iter().map(|[x, y, _]| to([*x, *y, 0.0])).collect();
    TriangleSoup::new(points, flat.triangles().to_vec()).expect("sound")
}

#[test]
fn what_can_be_laid_out_flat_is_not_stretched() {
    let tube = shapes::tube(48, 4, 3.0);
    let half = tube.triangles().iter().filter(|t| t.iter().all(|v| v % 48 <= 24)).copied().collect();
    let half_cylinder = TriangleSoup::new(tube.points().to_vec(), half).expect("sound");
    let flat = plate(|[x, y, _]| [5.0 + 0.6 * x, y, -0.8 * x]);
    // Rolled over a third of a turn.
    let bent = plate(|[x, y, _]| [x.sin(), y, x.cos()]);
    for (soup, holes) in [(half_cylinder, 0), (flat, 2), (bent, 2)] {
        let charts = naturally(&soup);
        let [chart] = &charts[..] else { panic!("{} charts", charts.len()) };
        let (distortion, proof) = (chart.distortion(), chart.map().certificate());
        assert!(distortion.conformal_p99 < 1.1 && distortion.area_ratio < 1.1, "{distortion:?}");
        // The cheap argument is tried first; it needs a centre for each hole, and nobody gives one.
        let argument = if holes == 0 { BoundaryArgument::StarShaped } else { BoundaryArgument::Simple };
        assert_eq!((proof.boundary, proof.holes), (argument, holes));
        let provenance = chart.provenance();
        assert_eq!((provenance.boundary, provenance.linear.method), (BoundaryFound::Natural, Method::Harmonic));
    }
}

#[test]
fn a_ramp_of_two_turns_that_would_cover_itself_is_bent_open() {
    let charts = naturally(&shapes::ramp(24, 48));
    let [chart] = &charts[..] else { panic!("{} charts", charts.len()) };
    assert_eq!(chart.provenance().boundary, BoundaryFound::Freed { why_none: NoNatural::Crossing });
    assert_eq!(chart.provenance().linear.method, Method::Isometric);
    assert_eq!(chart.map().certificate().boundary, BoundaryArgument::Simple);
    let on_disk = job(whole(&shapes::ramp(24, 48)), 1e6).run(&NoMonitor).expect("maps");
    assert!(chart.distortion().conformal_p99 < on_disk[0].distortion().conformal_p99);
    // Less than a turn of it lies beside itself.
    let short = naturally(&shapes::ramp(24, 20));
    assert!(short.len() == 1 && short[0].provenance().boundary == BoundaryFound::Natural);
}

#[test]
fn on_the_circle_linear_and_harmonic_map_are_those_of_the_paper_bit_by_bit() {
    for soup in [shapes::disk(9), shapes::disk_with_holes(13, 2), shapes::finger(12, 2)] {
        let [certified] = &job(whole(&soup), 1e6).run(&NoMonitor).expect("maps")[..] else { panic!("one chart") };
        assert_eq!(certified.provenance().boundary, BoundaryFound::Circle { why_none: None });
        let filled = FilledChart::new(certified.chart());
        let mut boundary = Boundary::circle(&filled, Mids::Arc);
        let linear = linear_map(&filled, &boundary, &NoMonitor).expect("does not fold");
        flatten_ear_arcs(&filled, &linear, &mut boundary);
        let start = linear.degree_elevated(&filled, &boundary);
        assert_eq!(certified.start().map().nodes, start[..filled.chart_nodes()]);
        let harmonic = quadratic_map(&filled, &boundary, &NoMonitor).expect("solves");
        assert!(harmonic.invalid().is_empty());
        assert_eq!(certified.map().map().nodes, harmonic.nodes()[..filled.chart_nodes()]);
    }
}

#[test]
fn where_the_harmonic_map_folds_inside_the_natural_boundary_another_linear_one_is_found() {
    let charts = naturally(&shapes::bent_disk(30, 0.45, 0.2));
    let linear = &charts[0].provenance().linear;
    assert_eq!((charts.len(), charts[0].provenance().boundary), (1, BoundaryFound::Natural));
    assert!(linear.method == Method::MMatrix && linear.folded > 0, "{linear:?}");
    // What is published is no such map: it is untangled from there, with the boundary that it has.
    let [start, map] = [charts[0].start(), charts[0].map()].map(|m| m.map());
    let chart = charts[0].chart();
    assert!(chart.outer().iter().all(|h| {
        let vertex = chart.from(*h).index();
        start.nodes[vertex] == map.nodes[vertex]
    }));
    assert_ne!(start, map);
}

/// A round plate with a round boss on it, the wall of which is one row of facets as long as it is high.
fn boss(around: u32, height: f64) -> TriangleSoup {
    let rings = [[4.0, 0.0], [3.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, height], [0.5, height]];
    let mut points = Vec::new();
    for [radius, z] in rings {
        for j in 0..around {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(j) / f64::from(around)).sin_cos();
            points.push([radius * cos, radius * sin, z]);
        }
    }
    let tip = points.len() as u32;
    points.push([0.0, 0.0, height]);
    let at = |ring: u32, j: u32| ring * around + j % around;
    let mut triangles = Vec::new();
    for j in 0..around {
        for ring in 0..rings.len() as u32 - 1 {
            triangles.push([at(ring, j), at(ring, j + 1), at(ring + 1, j)]);
            triangles.push([at(ring, j + 1), at(ring + 1, j + 1), at(ring + 1, j)]);
        }
        triangles.push([at(rings.len() as u32 - 1, j), at(rings.len() as u32 - 1, j + 1), tip]);
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_wall_of_long_facets_is_no_worse_than_the_map_that_untangling_starts_from() {
    for height in [1.0, 1.5, 2.0, 3.0] {
        let charts = naturally(&boss(48, height));
        let [chart] = &charts[..] else { panic!("{} charts", charts.len()) };
        assert_eq!(chart.provenance().boundary, BoundaryFound::Natural);
        let p99 = chart.distortion().conformal_p99;
        assert!(p99 < 4.0, "height {height}: {p99}");
        // On the low one the harmonic map is valid. On the others what untangling makes of it is 71 to 178, and what is nearest to
        // an isometry is wanted.
        let report = chart.provenance().untangle.as_ref().expect("quadratic");
        let expected = if height == 1.0 { untangle::Method::Harmonic } else { untangle::Method::Isometric };
        assert_eq!(report.method, expected, "height {height}");
        assert!(report.from_isometry.is_none_or(|from| 1.0 < from.least && from.least < from.start), "{report:?}");
    }
}

/// The wall of a cylinder as CAD exports it, one row of facets, closed by a cone at one end.
fn cup(around: u32, height: f64) -> TriangleSoup {
    let circle = |z: f64| {
        (0..around).map(move |k| {
            let angle = std::f64::consts::TAU * f64::from(k) / f64::from(around);
            [angle.cos(), angle.sin(), z]
        })
    };
    let points: Vec<Vec3> = circle(0.0).chain(circle(height)).chain([[0.0, 0.0, height + 0.7]]).collect();
    let wall = (0..around).flat_map(|k| {
        let next = (k + 1) % around;
        [[k, next, around + next], [k, around + next, around + k], [around + k, around + next, 2 * around]]
    });
    TriangleSoup::new(points, wall.collect()).expect("sound")
}

#[test]
fn a_row_of_long_facets_is_refined_and_what_comes_of_it_is_the_same_surface() {
    let soup = cup(36, 2.5);
    let run = |refine: Option<u32>| {
        let decompose = decompose::Settings { feature_angle: None, ..decompose::Settings::default() };
        parametrize(&soup, &Settings { refine, decompose, ..Settings::default() }, &NoMonitor).expect("maps")
    };
    let invalid = |atlas: &CertifiedAtlas| -> usize {
        let of_chart = |c: &CertifiedChart| {
            c.provenance().harmonic.as_ref().map_or(0, |h| h.invalid.iter().filter(|i| **i).count())
        };
        atlas.charts().iter().map(of_chart).sum()
    };
    let worst =
        |atlas: &CertifiedAtlas| atlas.charts().iter().map(|c| c.distortion().conformal_p99).fold(1.0, f64::max);
    let (coarse, fine) = (run(None), run(Some(4)));
    assert_eq!((coarse.mesh().triangles().len(), fine.mesh().default_size()), (108, coarse.mesh().default_size()));
    // What stands in for the harmonic map before is stretched as little; that is no longer needed.
    assert!(invalid(&coarse) > 36 && invalid(&fine) == 0 && worst(&fine) < 3.5);
    let harmonic = |c: &CertifiedChart| c.provenance().untangle.as_ref().map(|u| u.method);
    assert!(fine.charts().iter().all(|c| harmonic(c) == Some(untangle::Method::Harmonic)));
    assert!((200..=4 * 108).contains(&fine.mesh().triangles().len()));
    // Each triangle of the input is found again: its parts have its area, and its corners, and no other vertex of the input.
    let mesh = fine.mesh();
    for (triangle, corners) in soup.triangles().iter().enumerate() {
        let parts: Vec<usize> =
            (0..mesh.triangles().len()).filter(|f| mesh.source_triangle(*f) as usize == triangle).collect();
        let mut found: Vec<u32> =
            parts.iter().flat_map(|f| mesh.triangles()[*f]).filter_map(|v| mesh.input_vertex(v)).collect();
        found.sort_unstable();
        found.dedup();
        let mut expected = corners.to_vec();
        expected.sort_unstable();
        assert_eq!(found, expected);
        let area: f64 = parts.iter().map(|f| crate::vec3::triangle_area(mesh.corners(*f))).sum();
        let whole = crate::vec3::triangle_area(corners.map(|v| soup.points()[v as usize]));
        assert!((area / whole - 1.0).abs() < 1e-12);
    }
}
