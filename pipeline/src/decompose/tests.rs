use super::*;
use crate::mesh::TriangleSoup;
use crate::monitor::NoMonitor;
use crate::parametrize::parametrize_chart;
use crate::topology::VertexId;
use crate::{ChartJob, ChartSettings, Order, repair, shapes};

fn surface(soup: &TriangleSoup) -> SurfaceMesh {
    repair(soup, &Default::default()).expect("a surface is left").mesh
}

fn smooth() -> Settings {
    Settings { feature_angle: None, ..Settings::default() }
}

fn atlas(soup: &TriangleSoup, settings: &Settings) -> Atlas {
    let mesh = surface(soup);
    let atlas = decompose(&mesh, settings, &NoMonitor).expect("an atlas");
    let mut faces: Vec<_> = atlas.charts().iter().flat_map(|c| c.faces().iter().copied()).collect();
    faces.sort_unstable();
    assert_eq!(
        faces,
        (0..mesh.triangles().len()).map(crate::topology::FaceId::at).collect::<Vec<_>>(),
        "every triangle once"
    );
    atlas
}

/// A cube of n x n squares per side.
fn cube(n: u32) -> TriangleSoup {
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for side in 0..6_usize {
        let (axis, top) = (side / 2, side % 2 == 1);
        let first = points.len() as u32;
        for (i, j) in (0..=n).flat_map(|j| (0..=n).map(move |i| (i, j))) {
            let mut p = [0.0; 3];
            p[axis] = if top { 1.0 } else { 0.0 };
            p[(axis + 1) % 3] = f64::from(i) / f64::from(n);
            p[(axis + 2) % 3] = f64::from(j) / f64::from(n);
            points.push(p);
        }
        for (i, j) in (0..n).flat_map(|j| (0..n).map(move |i| (i, j))) {
            let a = first + j * (n + 1) + i;
            let [b, c, d] = [a + 1, a + n + 2, a + n + 1];
            triangles.extend(if top { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] });
        }
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_disk_with_holes_is_one_legal_chart() {
    let atlas = atlas(&shapes::disk_with_holes(17, 3), &Settings::default());
    let chart = &atlas.charts()[0];
    assert_eq!((atlas.charts().len(), chart.holes().len(), chart.outer().len()), (1, 3, 68));
    let mut on_loops: Vec<VertexId> =
        chart.holes().iter().flatten().chain(chart.outer()).map(|h| chart.from(*h)).collect();
    let all = on_loops.len();
    on_loops.sort_unstable();
    on_loops.dedup();
    assert_eq!(on_loops.len(), all, "loops are simple and share no vertex");
    let chi = chart.vertices().len() as i64 - chart.edges().len() as i64 + chart.triangles().len() as i64;
    assert_eq!((2 - 4 - chi) / 2, 0, "genus 0");
    for l in chart.holes().iter().chain([&chart.outer().to_vec()]) {
        for (i, h) in l.iter().enumerate() {
            let next = l[(i + 1) % l.len()];
            assert_eq!(chart.triangles()[h.face().index()][h.next().side()], chart.from(next));
        }
    }
}

#[test]
fn closed_surfaces_need_two_charts_and_a_moebius_strip_as_many() {
    for (soup, most) in [
        (shapes::sphere(5), 2),
        (shapes::sphere(20), 2),
        (cube(8), 2),
        (shapes::ring_torus(24, 12), 3),
        (shapes::moebius(7), 2),
        (shapes::bow_tie(), 2),
    ] {
        let charts = atlas(&soup, &smooth()).charts().len();
        assert!((2..=most).contains(&charts), "{charts} charts, at most {most}");
    }
}

#[test]
fn features_part_the_sides_of_a_cube_but_noise_parts_nothing() {
    let box_of_six = atlas(&cube(8), &Settings::default());
    assert_eq!((box_of_six.charts().len(), box_of_six.feature_edges()), (6, 12 * 8));
    // An angle above that of the edges finds none.
    let blunt = Settings { feature_angle: Some(100.0), ..Settings::default() };
    assert_eq!(atlas(&cube(8), &blunt).charts().len(), 2);
    // Vertices pulled out of a fine disk make steep triangles, but separate nothing of any size.
    let mut points = shapes::disk(60).points().to_vec();
    points.iter_mut().step_by(37).for_each(|p| p[2] += 0.025);
    let spiky = TriangleSoup::new(points, shapes::disk(60).triangles().to_vec()).expect("sound");
    let whole = atlas(&spiky, &Settings::default());
    assert_eq!((whole.charts().len(), whole.feature_edges()), (1, 0));
}

#[test]
fn limits_are_kept() {
    let torus = shapes::ring_torus(24, 12);
    let strict = Settings { strict_disks: true, ..smooth() };
    assert!(atlas(&torus, &strict).charts().iter().all(|c| c.holes().is_empty()), "disks only");
    let holes = Settings { strict_disks: true, ..smooth() };
    assert_eq!(
        atlas(&shapes::disk_with_holes(17, 3), &holes).charts()[0].holes().len(),
        3,
        "those of the surface stay"
    );
    for most in [1, 50, 200] {
        let small = Settings { max_triangles: most, ..smooth() };
        let sizes: Vec<usize> = atlas(&torus, &small).charts().iter().map(|c| c.triangles().len()).collect();
        assert!(sizes.iter().all(|s| *s <= most), "{sizes:?}");
        assert!(most > 1 || sizes.len() == 24 * 12 * 2);
    }
}

#[test]
fn what_stretches_too_much_is_split_until_it_does_not() {
    // A finger 22 times as long as wide: as one chart its area ratio is about e^88.
    let mesh = surface(&shapes::finger(12, 22));
    for max_area_ratio in [1e6, 1e3] {
        let settings = Settings { max_area_ratio, ..smooth() };
        let whole = assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk");
        let chart = whole.into_charts().remove(0);
        let settings = ChartSettings { decompose: settings, ..ChartSettings::default() };
        let parts = ChartJob::new(chart, settings).map(&NoMonitor).expect("maps");
        assert!(parts.len() > 2, "{}", parts.len());
        let triangles = parts.iter().map(|p| p.chart().triangles().len());
        assert_eq!(triangles.sum::<usize>(), mesh.triangles().len());
        for done in parts.into_iter().flat_map(|part| part.untangle(&NoMonitor).expect("maps")) {
            let ratio = done.distortion().area_ratio;
            assert!(ratio <= max_area_ratio, "{ratio} > {max_area_ratio}");
        }
    }
}

#[test]
fn prediction_agrees_with_the_map_within_a_decade() {
    // Fingers are tubes: e^(4 L/D).
    for length in [1, 2, 3] {
        let mesh = surface(&shapes::finger(16, length));
        let dual = Dual::new(&mesh, &NoMonitor);
        let limits = Limits::new(&smooth());
        let (cells, _) = cells(&dual, &limits).expect("nobody cancels");
        let network = network::Network::new(&dual, vec![0; mesh.triangles().len()], limits);
        let predicted =
            evaluate::evaluate(&network, &cells, &[true]).expect("nobody interrupts")[0].expect("a chart").ratio;
        let chart = assemble(&mesh, &network.labels).expect("a disk").into_charts().remove(0);
        let measured = parametrize_chart(chart, Order::Linear).expect("maps").distortion().area_ratio;
        assert!((predicted / measured).log10().abs() < 1.0, "length {length}: {predicted:.1e}, {measured:.1e}");
    }
}

#[test]
fn illegal_charts_are_named() {
    let sphere = surface(&shapes::sphere(5));
    let labels = vec![0; sphere.triangles().len()];
    assert!(matches!(assemble(&sphere, &labels), Err(Illegal::Topology { loops: 0, euler: 2, .. })));
    let torus = surface(&shapes::ring_torus(12, 6));
    let mut labels = vec![0; torus.triangles().len()];
    labels[0] = 1;
    assert!(matches!(assemble(&torus, &labels), Err(Illegal::Topology { loops: 1, euler: -1, .. })));
    let disk = surface(&shapes::disk(6));
    let far = disk.triangles().len() - 1;
    let mut labels = vec![0; far + 1];
    (labels[0], labels[far]) = (1, 1);
    assert!(matches!(assemble(&disk, &labels), Err(Illegal::Apart { parts: 2, .. })));
    // Two triangles that share a vertex only, and the rest around them.
    let around: Vec<usize> = (0..=far).filter(|f| disk.triangles()[*f].contains(&disk.triangles()[0][0])).collect();
    let apart = around
        .iter()
        .copied()
        .find(|f| disk.triangles()[*f].iter().filter(|v| disk.triangles()[0].contains(v)).count() == 1);
    let mut labels = vec![1; far + 1];
    (labels[0], labels[apart.expect("one across")]) = (0, 0);
    assert!(assemble(&disk, &labels).is_err());
}

/// A tube, open at both ends, `length` times as long as wide.
fn tube(around: u32, length: u32) -> TriangleSoup {
    shapes::tube(around, around * length / 3, 2.0 * f64::from(length))
}

fn seam_length(mesh: &SurfaceMesh, atlas: &Atlas) -> f64 {
    let network = crate::seams::SeamNetwork::new(mesh, atlas.charts(), 0.0);
    network.seams().map(crate::seams::Curve::length).sum()
}

#[test]
fn a_long_tube_is_cut_along_straight_lines() {
    // As one chart its area ratio would be e^40. Two strips have two seams, as long as the tube.
    let mesh = surface(&tube(24, 10));
    // Those that are unrolled may be as crooked as they like, those on disks are straight to keep their ratio.
    for (boundary, longest) in [(BoundaryShape::Circle, 1.05), (BoundaryShape::Natural, 1.07)] {
        let settings = Settings { feature_angle: None, ..Settings::of(boundary) };
        let atlas = decompose(&mesh, &settings, &NoMonitor).expect("an atlas");
        assert_eq!(atlas.charts().len(), 2);
        let length = seam_length(&mesh, &atlas);
        assert!((39.9..longest * 40.0).contains(&length), "{length}");
    }
}

#[test]
fn fingers_are_pulled_straight() {
    // Two combs that reach into each other in a disk of diameter 2.
    let mesh = surface(&shapes::flat_disk(40));
    let dual = Dual::new(&mesh, &NoMonitor);
    let limits = Limits::new(&smooth());
    let (cells, _) = cells(&dual, &limits).expect("nobody cancels");
    let place = |f: usize| dual.centroid(f).map(|x| x / mesh.metric().scale);
    let comb = |[x, y, _]: [f64; 3]| u32::from(x > 0.7 * (9.0 * y).sin() * (1.0 - y * y));
    let labels: Vec<u32> = (0..mesh.triangles().len()).map(|f| comb(place(f))).collect();
    let crooked = seam_length(&mesh, &assemble(&mesh, &labels).expect("two disks"));
    let size = (dual.total_area() / cells.len as f64).sqrt();
    let atlas = finish(&dual, labels, limits, &smooth(), &cells, |_| size).expect("two disks");
    let straight = seam_length(&mesh, &atlas);
    assert!(crooked > 5.0 && straight < 2.2, "{crooked} becomes {straight}");
}

#[test]
fn a_sphere_falls_into_parts_of_some_size() {
    // The shortest loops on a sphere are points: what is left is a chart that is closed all but for a pinhole.
    let atlas = atlas(&shapes::sphere(24), &smooth());
    let shares = atlas.charts().iter().map(|c| c.triangles().len() as f64 / (4.0 * 24.0 * 23.0));
    assert!(atlas.charts().len() == 2 && shares.clone().all(|s| s > 0.1), "{:?}", shares.collect::<Vec<_>>());
}

#[test]
fn a_crease_that_runs_out_is_no_feature() {
    let creased = |to: f64| {
        let disk = shapes::flat_disk(30);
        let crease = |p: &[f64; 3]| [p[0], p[1], 2.0 * (p[0] - to).max(0.0) * p[1].abs()];
        TriangleSoup::new(disk.points().iter().map(crease).collect(), disk.triangles().to_vec()).expect("sound")
    };
    let (ends, parts) = (atlas(&creased(0.0), &Settings::default()), atlas(&creased(-3.0), &Settings::default()));
    assert_eq!((ends.charts().len(), ends.feature_edges()), (1, 0));
    assert_eq!((parts.charts().len(), parts.feature_edges()), (2, 60));
}

/// A tube of which the cross-section is a figure of eight: four sheets meet along a line.
pub(super) fn figure_eight(around: u32, length: u32) -> TriangleSoup {
    let point = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k % around) / f64::from(around)).sin_cos();
        [sin, sin * cos, 0.2 * f64::from(k / around)]
    };
    // Half way around it comes back to where it began.
    let vertex = |row: u32, k: u32| row * around + if k % around == around / 2 { 0 } else { k % around };
    let quad = |k: u32| {
        let (row, k) = (k / around, k % around);
        let [a, b, c, d] = [vertex(row, k), vertex(row, k + 1), vertex(row + 1, k + 1), vertex(row + 1, k)];
        [[a, b, c], [a, c, d]]
    };
    let points = (0..around * (length + 1)).map(point).collect();
    TriangleSoup::new(points, (0..around * length).flat_map(quad).collect()).expect("sound")
}

#[test]
fn no_chart_meets_itself_where_sheets_were_taken_apart() {
    let mesh = surface(&figure_eight(24, 12));
    assert_eq!(mesh.topology_summary().nonmanifold_edges, 12);
    let atlas = decompose(&mesh, &smooth(), &NoMonitor).expect("an atlas");
    assert!(atlas.charts().len() <= 4, "{}", atlas.charts().len());
    for chart in atlas.charts() {
        let welded = |v: VertexId| mesh.welded_vertex(chart.vertices()[v.index()]);
        let rim = chart.holes().iter().flatten().chain(chart.outer());
        let mut places: Vec<_> = rim.map(|h| [welded(chart.from(*h)), welded(chart.from(h.next()))]).collect();
        places.iter_mut().for_each(|p| p.sort_unstable());
        let all = places.len();
        places.sort_unstable();
        places.dedup();
        assert_eq!(places.len(), all, "chart {} meets itself", chart.id());
    }
}

/// A sheet of 8 by 4 `n` squares, folded in the middle: its upper half touches the lower one at `n / 2` points.
fn folded(n: u32) -> TriangleSoup {
    let point = |i: u32, j: u32| {
        let x = i.min(4 * n - i);
        let touches = j == 4 && x % 4 == 2;
        [f64::from(x), f64::from(j), if i > 2 * n && !touches { 0.5 } else { 0.0 }]
    };
    let points = (0..=4 * n).flat_map(|i| (0..=8).map(move |j| (i, j))).map(|(i, j)| point(i, j)).collect();
    let quad = |(i, j): (u32, u32)| shapes::halves([9 * i + j, 9 * i + j + 9, 9 * i + j + 10, 9 * i + j + 1]);
    let triangles = (0..4 * n).flat_map(|i| (0..8).map(move |j| (i, j))).flat_map(quad).collect();
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_chart_that_touches_itself_at_many_points_is_cut_once() {
    let mesh = surface(&folded(12));
    assert_eq!(mesh.topology_summary().nonmanifold_vertices, 6);
    let atlas = decompose(&mesh, &smooth(), &NoMonitor).expect("an atlas");
    assert_eq!(atlas.charts().len(), 2);
    assert!(!atlas.charts().iter().any(touches_itself));
    // One chart that is cut when it is mapped.
    let whole = assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0);
    assert!(touches_itself(&whole));
    let parts = separate(&whole, &smooth(), &NoMonitor).expect("charts").expect("it touches itself");
    assert_eq!(parts.len(), 2);
    assert!(!parts.iter().any(touches_itself));
    assert!(separate(&parts[0], &smooth(), &NoMonitor).expect("charts").is_none());
}

/// Two square faces at a right angle with a bevel of this width between them.
fn bevelled(width: f64) -> TriangleSoup {
    let n = 20;
    let bevel = width / 2.0_f64.sqrt();
    let point = |i: u32, j: u32| {
        let (x, along) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        // Across the bevel lies the step from row n to row n + 1.
        let below = (f64::from(j) - f64::from(n + 1)) / f64::from(n);
        if j <= n { [x, along, 0.0] } else { [x, 1.0 + bevel, -bevel - below] }
    };
    let points = (0..=2 * n + 1).flat_map(|j| (0..=n).map(move |i| (i, j))).map(|(i, j)| point(i, j)).collect();
    let quad = |(i, j): (u32, u32)| {
        let a = j * (n + 1) + i;
        shapes::halves([a, a + 1, a + n + 2, a + n + 1])
    };
    let triangles = (0..2 * n + 1).flat_map(|j| (0..n).map(move |i| (i, j))).flat_map(quad).collect();
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn a_bevel_is_a_face_unless_it_is_narrow() {
    let charts = |width: f64| atlas(&bevelled(width), &Settings::default()).charts().len();
    assert_eq!((charts(0.2), charts(0.004)), (3, 2));
}

/// A square plate with a small cube on it, of a 60th of its width where all squares are as large, and less where those `in_middle`
/// are this share of it; the corners of its top are moved by `uneven` of that, so that none of its sides is flat.
fn with_small_cube(in_middle: f64, uneven: f64) -> TriangleSoup {
    let n = 60_u32;
    let along = |i: u32| {
        let from_middle = (f64::from(i) - 0.5) / f64::from(n) - 0.5;
        from_middle * (in_middle + 2.0 * (1.0 - in_middle) * from_middle.abs())
    };
    let at = |i: u32, j: u32| [along(i), along(j), 0.0];
    let mut points: Vec<[f64; 3]> = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let cell = |(i, j): (u32, u32)| {
        let a = j * (n + 1) + i;
        [a, a + 1, a + n + 2, a + n + 1]
    };
    let (middle, side) = ((n / 2, n / 2), along(n / 2 + 1) - along(n / 2));
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).filter(|cell| *cell != middle);
    let mut triangles: Vec<[u32; 3]> = cells.flat_map(|c| shapes::halves(cell(c))).collect();
    let foot = cell(middle);
    let top = [0, 1, 2, 3].map(|k| points.len() as u32 + k);
    for (k, f) in foot.into_iter().enumerate() {
        let [x, y, _] = points[f as usize];
        let moved = [[1.0, 0.5, 0.2], [-0.3, 1.0, 0.8], [0.6, -1.0, 0.1], [-1.0, -0.4, 0.9]][k];
        let [dx, dy, dz] = moved.map(|c: f64| c * uneven * side);
        points.push([x + dx, y + dy, side + dz]);
    }
    triangles.extend(shapes::halves(top));
    for k in 0..4 {
        let next = (k + 1) % 4;
        triangles.extend(shapes::halves([foot[k], foot[next], top[next], top[k]]));
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn small_faces_are_kept_where_they_are_flat() {
    let charts = |in_middle, uneven| atlas(&with_small_cube(in_middle, uneven), &Settings::default()).charts().len();
    assert_eq!((charts(1.0, 0.0), charts(1.0, 0.1)), (6, 1));
    // Edges of 4 % of the width all told.
    assert_eq!((charts(0.2, 0.0), charts(0.2, 0.1)), (6, 1));
}

/// Two soups as one.
fn beside(a: &TriangleSoup, b: &TriangleSoup) -> TriangleSoup {
    let renumbered = b.triangles().iter().map(|t| t.map(|v| v + a.points().len() as u32));
    let triangles = a.triangles().iter().copied().chain(renumbered).collect();
    TriangleSoup::new([a.points(), b.points()].concat(), triangles).expect("sound")
}

#[test]
fn a_component_is_decomposed_as_if_it_were_alone() {
    let (torus, tube) = (shapes::ring_torus(30, 16), tube(24, 80));
    let moved = tube.points().iter().map(|p| [p[0] + 100.0, p[1], p[2]]).collect();
    let tube = TriangleSoup::new(moved, tube.triangles().to_vec()).expect("sound");
    // Per chart its triangles, where `before` others come first.
    let faces = |soup: &TriangleSoup, before: usize| -> Vec<Vec<usize>> {
        let faces = |chart: &Chart| chart.faces().iter().map(|f| f.index() + before).collect();
        atlas(soup, &smooth()).charts().iter().map(faces).collect()
    };
    let alone = [faces(&torus, 0), faces(&tube, torus.triangles().len())].concat();
    let together = beside(&torus, &tube);
    assert_eq!(faces(&together, 0), alone);
    // They are numbered in the order of their first triangles, and hold the vertices of the surface.
    let (mesh, atlas) = (surface(&together), atlas(&together, &smooth()));
    for (chart, id) in atlas.charts().iter().zip(0..) {
        assert_eq!(chart.id(), ChartId(id));
        for (t, face) in chart.triangles().iter().zip(chart.faces()) {
            assert_eq!(t.map(|v| chart.vertices()[v.index()]), mesh.triangles()[face.index()]);
        }
    }
}
