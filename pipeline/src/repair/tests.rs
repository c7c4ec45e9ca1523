use super::*;
use crate::shapes;

fn repaired(soup: &TriangleSoup) -> Repaired {
    let repaired = repair(soup, &Settings::default()).expect("a surface is left");
    repaired.mesh.assert_sound();
    repaired
}

/// Two triangles of a unit square, the second one moved by `gap`, as a soup with six points.
fn cracked_square(gap: Vec3) -> TriangleSoup {
    let moved = |p: Vec3| [p[0] + gap[0], p[1] + gap[1], p[2] + gap[2]];
    let points =
        vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], moved([0.0; 3]), moved([1.0, 1.0, 0.0]), [0.0, 1.0, 0.0]];
    TriangleSoup::new(points, vec![[0, 1, 2], [3, 4, 5]]).expect("sound")
}

#[test]
fn bit_equal_vertices_are_merged_whatever_the_sign_of_zero() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-0.0, 0.0, -0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let soup = TriangleSoup::new(points, vec![[0, 1, 2], [3, 4, 5]]).expect("sound");
    let got = repaired(&soup);
    assert_eq!((got.report.welded, got.raw.vertices, got.raw.boundary_loops), (2, 4, 1));
    assert!(got.mesh.topology_summary().is_one_chart());
}

#[test]
fn cracks_within_the_tolerance_are_closed_and_wider_ones_are_not() {
    let narrow = repaired(&cracked_square([3e-7, 0.0, 4e-7]));
    assert_eq!((narrow.raw.components, narrow.report.cracks_closed), (2, 1));
    assert!(narrow.mesh.topology_summary().is_one_chart());
    let wide = repaired(&cracked_square([3e-5, 0.0, 4e-5]));
    assert_eq!((wide.report.cracks_closed, wide.mesh.topology_summary().components), (0, 2));
    let off = repair(&cracked_square([3e-7, 0.0, 4e-7]), &Settings { weld: 0.0 }).expect("a surface is left");
    assert_eq!(off.report.cracks_closed, 0);
}

#[test]
fn the_walls_of_a_thin_gap_stay_apart() {
    let gap = 1e-7;
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, gap], [1.0, 0.0, gap], [0.0, 1.0, gap]];
    let soup = TriangleSoup::new(points, vec![[0, 1, 2], [3, 5, 4]]).expect("sound");
    let got = repaired(&soup);
    assert_eq!((got.report.cracks_closed, got.mesh.topology_summary().components), (0, 2));
}

#[test]
fn no_triangle_loses_a_side_to_welding() {
    // The second triangle is a needle thinner than the tolerance: all three of its vertices are near the edge.
    let points =
        vec![[0.0; 3], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.0, -1e-8, 0.0], [1.0, -1e-8, 0.0], [1.0, -3e-8, 0.0]];
    let soup = TriangleSoup::new(points, vec![[0, 1, 2], [4, 3, 5]]).expect("sound");
    let got = repaired(&soup);
    assert_eq!(got.mesh.triangles().len(), 2);
    assert!(got.mesh.triangles().iter().all(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
}

#[test]
fn copies_and_degenerate_triangles_go_and_are_named() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]];
    let soup = TriangleSoup::new(points, vec![[0, 1, 2], [1, 1, 2], [2, 1, 0], [1, 3, 2]]).expect("sound");
    let got = repaired(&soup);
    assert_eq!(got.report.degenerate_triangles, Sample { count: 1, first: vec![1] });
    assert_eq!(got.report.duplicate_triangles, Sample { count: 1, first: vec![2] });
    assert_eq!([0, 1].map(|f| got.mesh.source_triangle(f)), [0, 3]);
}

#[test]
fn the_majority_decides_the_orientation() {
    let mut soup = shapes::disk(5);
    let mut triangles = soup.triangles().to_vec();
    for t in triangles.iter_mut().skip(3).step_by(7) {
        t.swap(0, 1);
    }
    let turned = (3..triangles.len()).step_by(7).count();
    soup = TriangleSoup::new(soup.points().to_vec(), triangles).expect("sound");
    let got = repaired(&soup);
    assert_eq!((got.report.flipped_triangles.count, got.report.flipped_triangles.first[0]), (turned, 3));
    assert_eq!(got.mesh.topology_summary().inconsistent_edges, 0);
    assert!(got.raw.inconsistent_edges > 0);
}

#[test]
fn sheets_that_touch_get_their_own_vertices() {
    let got = repaired(&shapes::bow_tie());
    assert_eq!(got.report.split_vertices.count, 1);
    let summary = got.mesh.topology_summary();
    assert_eq!((summary.components, summary.nonmanifold_vertices), (2, 0));
}

#[test]
fn nothing_left_is_refused() {
    let soup = TriangleSoup::new(vec![[0.0; 3]; 3], vec![[0, 1, 2]]).expect("sound");
    assert_eq!(repair(&soup, &Settings::default()).map(|_| ()), Err(Error::OnlyDegenerate { triangles: 1 }));
}

#[test]
fn repair_does_not_depend_on_units() {
    for scale in [1e-8, 1.0, 1e8] {
        let soup = shapes::cracked_patch();
        let points = soup.points().iter().map(|p| p.map(|c| c * scale)).collect();
        let got = repaired(&TriangleSoup::new(points, soup.triangles().to_vec()).expect("sound"));
        assert!(got.report.cracks_closed > 0 && got.mesh.topology_summary().is_one_chart(), "scale {scale}");
    }
}

#[test]
fn sheets_are_split_along_non_manifold_edges_which_are_still_told() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
    let soup = TriangleSoup::new(points, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).expect("sound");
    let got = repaired(&soup);
    let summary = got.mesh.topology_summary();
    assert_eq!((summary.nonmanifold_edges, summary.components, got.report.split_vertices.count), (1, 3, 2));
    assert!(!summary.is_one_chart());
}

#[test]
fn a_vertex_pinned_to_the_inside_of_a_sheet_is_told() {
    // A disk and a triangle that stands on its middle.
    let disk = shapes::flat_disk(1);
    let mut points = disk.points().to_vec();
    points.extend([[0.1, 0.0, 1.0], [-0.1, 0.0, 1.0]]);
    let mut triangles = disk.triangles().to_vec();
    triangles.push([0, 7, 8]);
    let got = repaired(&TriangleSoup::new(points, triangles).expect("sound"));
    assert_eq!((got.mesh.topology_summary().nonmanifold_vertices, got.mesh.topology_summary().components), (1, 2));
    assert_eq!(
        repaired(&shapes::bow_tie()).mesh.topology_summary().nonmanifold_vertices,
        0,
        "both sheets at their boundary"
    );
}

#[test]
fn what_cannot_be_oriented_is_left_as_it_is() {
    let got = repaired(&shapes::moebius(9));
    assert_eq!((got.report.flipped_triangles.count, got.mesh.topology_summary().orientable), (0, false));
}

/// Sheets of n squares that meet in the line x = y = 0, each with its own noise.
fn sheets(directions: &[[f64; 2]], n: u32, noise: f64) -> TriangleSoup {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for (k, [x, y]) in directions.iter().enumerate() {
        let base = points.len() as u32;
        for i in 0..=n {
            let wobble = noise * f64::from((i * 7 + 3 * k as u32) % 5);
            points.push([wobble, -wobble, f64::from(i) / f64::from(n)]);
            points.push([*x, *y, f64::from(i) / f64::from(n)]);
        }
        for a in (0..n).map(|i| base + 2 * i) {
            triangles.extend([[a, a + 1, a + 3], [a, a + 3, a + 2]]);
        }
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn where_three_sheets_meet_noise_decides_nothing() {
    for noise in [0.0, 1e-8, 1e-7, 2e-7] {
        let got = repaired(&sheets(&[[1.0, 0.0], [-1.0, 0.2], [0.0, 1.0]], 8, noise));
        let summary = got.mesh.topology_summary();
        assert_eq!((summary.nonmanifold_edges, summary.components), (8, 3), "noise {noise}");
        assert!(!summary.is_one_chart());
    }
}

#[test]
fn two_sheets_become_one_and_walls_beside_them_stay() {
    let two = repaired(&sheets(&[[1.0, 0.0], [-1.0, 0.3]], 8, 2e-7));
    assert!(two.report.cracks_closed == 8 && two.mesh.topology_summary().is_one_chart());
    let folded = repaired(&sheets(&[[1.0, 0.0], [1.0, 0.01]], 8, 2e-7));
    assert_eq!((folded.report.cracks_closed, folded.mesh.topology_summary().components), (0, 2));
}

#[test]
fn chains_of_edges_shorter_than_the_tolerance_are_zipped_up() {
    // A unit square cut along its diagonal; in the middle of the cut three edges of 3e-7.
    let along = [0.0, 0.5, 0.5 + 3e-7, 0.5 + 6e-7, 1.0];
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for (side, gap) in [(0.0, 0.0), (1.0, 2e-7)] {
        let base = points.len() as u32;
        points.extend(along.map(|t| [t, t, gap]));
        points.push([1.0 - side, side, 0.0]);
        for i in (0..4).map(|i| base + i) {
            triangles.push(if side == 0.0 { [i, base + 5, i + 1] } else { [i, i + 1, base + 5] });
        }
    }
    let got = repaired(&TriangleSoup::new(points, triangles).expect("sound"));
    assert_eq!(
        (got.mesh.topology_summary().boundary_loops, got.mesh.topology_summary().components),
        (1, 1),
        "{:?}",
        got.report
    );
}

#[test]
fn a_vertex_with_many_open_edges_and_a_tiny_tolerance_cost_little() {
    let n = 40_000;
    let rim = (0..2 * n).map(|i| (f64::from(i) * 1e-3).sin_cos()).map(|(s, c)| [c, s, 1.0 + s * c]);
    let points = std::iter::once([0.0; 3]).chain(rim).collect();
    let fans = (0..n as u32).map(|i| [0, 2 * i + 1, 2 * i + 2]).collect();
    let soup = TriangleSoup::new(points, fans).expect("sound");
    for weld in [1e-6, 1e-20] {
        assert_eq!(repair(&soup, &Settings { weld }).expect("a surface").raw.triangles, n as usize);
    }
}

#[test]
fn the_area_of_huge_and_tiny_surfaces_is_finite() {
    for (scale, area) in [(1e99, 0.5e198), (1e-90, 0.5e-180)] {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x * scale, y * scale, 0.0]).to_vec();
        let got = repaired(&TriangleSoup::new(points, vec![[0, 1, 2]]).expect("sound"));
        assert!((got.mesh.area() / area - 1.0).abs() < 1e-12);
    }
}

/// A soup of polygons that are cut into fans about their first corner.
fn fans(polygons: &[Vec<Vec3>]) -> TriangleSoup {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for polygon in polygons {
        let base = points.len() as u32;
        points.extend(polygon);
        triangles.extend((1..polygon.len() as u32 - 1).map(|i| [base, base + i, base + i + 1]));
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

/// A unit square and beside it, beyond the edge x = 1, triangles with a vertex at each of the `heights` on that edge; each
/// vertex moved by `noise`.
fn square_and_fine_side(heights: &[f64], noise: f64) -> TriangleSoup {
    let mut side = vec![[2.0, 0.5, 0.0]];
    let wobble = |i: usize| noise * (((i * 7) % 5) as f64 / 2.0 - 1.0);
    side.extend(heights.iter().rev().enumerate().map(|(i, y)| [1.0 + wobble(i), *y, wobble(i + 3)]));
    fans(&[vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]], side])
}

#[test]
fn vertices_on_the_edge_of_another_side_split_it() {
    let heights = [0.0, 0.1, 0.35, 0.5, 0.75, 1.0];
    for (noise, weld) in [(0.0, 1e-6), (0.0, 0.0), (5e-7, 1e-6)] {
        let soup = square_and_fine_side(&heights, noise);
        let got = repair(&soup, &Settings { weld }).expect("a surface");
        assert_eq!((got.report.t_junctions_closed.count, got.report.t_junctions_left.count), (4, 0), "{noise} {weld}");
        let summary = got.mesh.topology_summary();
        assert!(summary.is_one_chart() && summary.boundary_loops == 1, "{summary:?}");
        assert_eq!((summary.triangles, got.report.triangles_added), (2 + 5 + 4, 4));
        assert!((got.mesh.area() - 1.5).abs() < 1e-5);
        let parts = (0..summary.triangles).filter(|f| got.mesh.source_triangle(*f) == 0).count();
        assert_eq!(parts, 5, "the first triangle has the edge x = 1");
    }
}

#[test]
fn vertices_beside_an_edge_farther_than_the_tolerance_leave_it() {
    for (noise, weld) in [(1e-4, 1e-6), (5e-7, 0.0)] {
        let got = repair(&square_and_fine_side(&[0.0, 0.3, 0.7, 1.0], noise), &Settings { weld }).expect("a surface");
        assert_eq!((got.report.t_junctions_closed.count, got.mesh.topology_summary().components), (0, 2));
    }
}

#[test]
fn both_sides_may_have_vertices_on_the_edges_of_the_other() {
    let left = vec![[0.0, 0.5, 0.0], [1.0, -0.2, 0.0], [1.0, 0.4, 0.0], [1.0, 0.8, 0.0]];
    let right = vec![[2.0, 0.5, 0.0], [1.0, 1.1, 0.0], [1.0, 0.6, 0.0], [1.0, 0.1, 0.0]];
    let got = repaired(&fans(&[left, right]));
    assert_eq!(got.report.t_junctions_closed.count, 4);
    assert!(got.mesh.topology_summary().is_one_chart(), "{:?}", got.mesh.topology_summary());
}

#[test]
fn a_triangle_is_split_on_all_of_its_sides() {
    let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mut polygons = vec![corners.to_vec()];
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let at = |t: f64| [0, 1, 2].map(|i| a[i] + t * (b[i] - a[i]));
        let tip = [1.5 * (a[0] + b[0]) - 0.5, 1.5 * (a[1] + b[1]) - 0.5, 0.0];
        polygons.push(vec![tip, b, at(0.75), at(0.5), at(0.25), a]);
    }
    let got = repaired(&fans(&polygons));
    assert_eq!((got.report.t_junctions_closed.count, got.report.t_junctions_left.count), (9, 0));
    assert!(got.mesh.topology_summary().is_one_chart() && got.mesh.topology_summary().boundary_loops == 1);
    assert_eq!(got.mesh.topology_summary().triangles, 12 + 10);
}

#[test]
fn three_sides_cut_differently_meet_in_non_manifold_edges() {
    let page = |x: f64, y: f64, heights: &[f64]| {
        let mut page = vec![[x, y, 0.5]];
        page.extend(heights.iter().map(|z| [0.0, 0.0, *z]));
        page
    };
    let pages =
        [page(1.0, 0.0, &[0.0, 1.0]), page(-1.0, 0.2, &[0.0, 0.25, 0.5, 1.0]), page(0.0, 1.0, &[0.0, 0.5, 0.75, 1.0])];
    let got = repaired(&fans(&pages));
    assert_eq!(
        (got.mesh.topology_summary().nonmanifold_edges, got.report.t_junctions_left.count),
        (4, 0),
        "{:?}",
        got.report
    );
    assert_eq!(got.report.t_junctions_closed.count, 3);
}

#[test]
fn walls_of_a_thin_gap_are_not_joined_at_t_junctions_but_told() {
    for gap in [0.0, 1e-7] {
        let upper = vec![[0.0, 0.0, gap], [1.0, 0.0, gap], [0.0, 1.0, gap]];
        let lower =
            vec![[0.1, 0.9, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.6, 0.0, 0.0], [1.0, 0.0, 0.0]];
        let got = repaired(&fans(&[upper, lower]));
        assert_eq!((got.report.t_junctions_closed.count, got.mesh.topology_summary().components), (0, 2), "gap {gap}");
        assert!(got.report.t_junctions_left.count >= 2, "{:?}", got.report);
    }
}

#[test]
fn a_corner_that_touches_an_edge_does_not_split_it() {
    let touching = vec![[1.0, 0.5, 0.0], [2.0, 0.0, 0.0], [2.0, 1.0, 0.0]];
    let got = repaired(&fans(&[vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]], touching]));
    assert_eq!((got.report.t_junctions_closed.count, got.report.t_junctions_left.count), (0, 1));
}

#[test]
fn many_vertices_on_one_edge_and_many_long_edges_over_a_rim_cost_little() {
    let n = 40_000;
    let heights: Vec<f64> = (0..=n).map(|i| f64::from(i) / f64::from(n)).collect();
    let got = repaired(&square_and_fine_side(&heights, 0.0));
    assert_eq!(got.report.t_junctions_closed.count, n as usize - 1);
    assert!(got.mesh.topology_summary().is_one_chart());
    // Many long edges along a fine rim and each other: nobody can tell which belong together.
    let mut polygons = vec![vec![[2.0, 0.5, 0.0]]];
    polygons[0].extend(heights.iter().map(|y| [1.0, *y, 0.0]));
    let beyond = |i: i32| 1e-4 * f64::from(i);
    polygons.extend((1..n).map(beyond).map(|d| vec![[0.0, 0.0, d], [1.0, -d, 0.0], [1.0, 1.0 + 3.0 * d, 0.0]]));
    assert!(repaired(&fans(&polygons)).mesh.topology_summary().triangles > 2 * n as usize - 2);
}

#[test]
fn a_fine_rim_between_two_walls_does_not_join_them() {
    let wall = |z: f64| vec![[0.0, 0.5, z], [1.0, 0.0, z], [1.0, 1.0, z]];
    let rim = vec![[2.0, 0.5, 0.0], [1.0, 1.0, 0.0], [1.0, 0.6, 0.0], [1.0, 0.3, 0.0], [1.0, 0.0, 0.0]];
    let got = repaired(&fans(&[wall(2e-7), wall(-2e-7), rim.clone()]));
    assert_eq!((got.report.t_junctions_closed.count, got.mesh.topology_summary().nonmanifold_edges), (0, 0));
    assert_eq!(got.report.t_junctions_left.count, 2);
    assert!(repaired(&fans(&[wall(2e-7), rim])).mesh.topology_summary().is_one_chart());
}

/// The faces of all tetrahedra in a grid of n cubes each way, six in each (Kuhn's).
fn faces_of_tetrahedra(n: u32) -> TriangleSoup {
    let side = n + 1;
    let point = |i: u32| [i % side, i / side % side, i / side / side].map(f64::from);
    let steps = [1, side, side * side];
    let mut faces = std::collections::BTreeSet::new();
    for cube in (0..n * n * n).map(|i| i % n + side * (i / n % n) + side * side * (i / n / n)) {
        for [x, y, z] in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let [a, b, c, d] = [0, steps[x], steps[x] + steps[y], steps[x] + steps[y] + steps[z]].map(|s| cube + s);
            faces.extend([[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
        }
    }
    TriangleSoup::new((0..side * side * side).map(point).collect(), faces.into_iter().collect()).expect("sound")
}

#[test]
fn faces_of_volume_elements_are_refused_and_a_few_sheets_are_not() {
    let refused = repaired(&faces_of_tetrahedra(16)).accepted();
    let Err(Error::VolumeElements { sheets, triangles, nonmanifold_edges, vertices }) = refused else {
        panic!("{refused:?}")
    };
    assert_eq!((triangles, nonmanifold_edges, vertices.len()), (50_688, 30_928, 8));
    assert!(sheets > 50_000);
    for few in [faces_of_tetrahedra(3), shapes::book(40, 20), shapes::sphere(8)] {
        let all = few.triangles().len();
        let accepted = repaired(&few).accepted().expect("few sheets");
        assert!(accepted.refused.is_empty() && accepted.mesh.triangles().len() >= all);
    }
}

/// Several soups beside each other, each moved along x.
fn side_by_side(soups: &[TriangleSoup]) -> TriangleSoup {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for (soup, shift) in soups.iter().zip(0_u32..) {
        let first = points.len() as u32;
        points.extend(soup.points().iter().map(|[x, y, z]| [x + 100.0 * f64::from(shift), *y, *z]));
        triangles.extend(soup.triangles().iter().map(|t| t.map(|v| v + first)));
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

/// Walls along the sides of n by n squares, each of `fine` by `fine` smaller ones: they meet in threes and fours, in sheets
/// of many triangles.
fn egg_crate(n: u32, fine: u32) -> TriangleSoup {
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    let mut wall = |from: [f64; 2], to: [f64; 2]| {
        let first = points.len() as u32;
        for i in 0..=fine {
            for j in 0..=fine {
                let t = f64::from(i) / f64::from(fine);
                let along = [0, 1].map(|k| from[k] + t * (to[k] - from[k]));
                points.push([along[0], along[1], f64::from(j) / f64::from(fine)]);
            }
        }
        for i in 0..fine {
            for j in 0..fine {
                let a = first + i * (fine + 1) + j;
                let [b, c, d] = [a + fine + 1, a + fine + 2, a + 1];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    };
    for i in 0..=n {
        for j in 0..n {
            let [x, y, z] = [i, j, j + 1].map(f64::from);
            wall([x, y], [x, z]);
            wall([y, x], [z, x]);
        }
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

/// The components that are refused, and which of them for the sum alone.
fn refused_of(soups: &[TriangleSoup]) -> (Vec<usize>, Vec<usize>) {
    let refused = repaired(&side_by_side(soups)).accepted().expect("some are left").refused;
    let together = refused.iter().filter(|r| matches!(r.error, Error::SheetsTogether { .. }));
    (refused.iter().map(|r| r.component).collect(), together.map(|r| r.component).collect())
}

#[test]
fn a_component_is_measured_by_itself_whatever_lies_beside_it() {
    // Of 1,200 sheets of eight triangles: alone it is accepted.
    let crate_of_walls = egg_crate(24, 2);
    assert!(repaired(&crate_of_walls).mesh.topology_summary().components > 1_100);
    assert!(repaired(&crate_of_walls).accepted().is_ok());
    let (block, small, plain) = (faces_of_tetrahedra(6), faces_of_tetrahedra(4), shapes::sphere(60));
    assert!(repaired(&block).accepted().is_err() && repaired(&small).accepted().is_ok());
    // The block is refused beside the walls, and beside a surface of so many triangles that its own do not count.
    assert_eq!(refused_of(&[crate_of_walls.clone(), block.clone()]), (vec![1], vec![]));
    assert_eq!(refused_of(&[plain, block.clone()]), (vec![1], vec![]));
    // Blocks that are few enough each are too many together: some of them go, and not what has large sheets.
    let blocks = [small.clone(), crate_of_walls, small.clone(), small.clone(), small];
    let (refused, together) = refused_of(&blocks);
    assert!(!refused.is_empty() && refused == together && !refused.contains(&1), "{refused:?}");
    // What is a single sheet has no part in that, and be it a single triangle, which no sheet is smaller than.
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let triangle = TriangleSoup::new(corners, vec![[0, 1, 2]]).expect("sound");
    let with_triangle: Vec<TriangleSoup> = std::iter::once(triangle).chain(blocks).collect();
    let as_before: Vec<usize> = refused.iter().map(|number| number + 1).collect();
    assert_eq!(refused_of(&with_triangle), (as_before.clone(), as_before));
}

#[test]
fn volume_elements_with_loose_corners_are_refused_all_the_same() {
    let block = faces_of_tetrahedra(6);
    // Every face has corners of its own, a little off: cracks are closed, and then they meet.
    let jitter = |k: usize| 1e-7 * ((k * 7919 % 13) as f64 - 6.0);
    let corners = block.triangles().iter().flatten().zip(0..);
    let points = corners.map(|(v, k)| block.points()[*v as usize].map(|c| c + jitter(k))).collect();
    let triangles = (0..block.triangles().len() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
    let loose = repaired(&TriangleSoup::new(points, triangles).expect("sound"));
    assert!(loose.report.cracks_closed > 1_000, "{:?}", loose.report);
    let sheets = loose.mesh.topology_summary().components;
    assert!(sheets > 1_000, "{sheets}: the test has lost its sense");
    assert!(loose.accepted().is_err());
}

#[test]
fn components_of_volume_elements_are_refused_alone() {
    let (sphere, volume, book) = (shapes::sphere(8), faces_of_tetrahedra(8), shapes::book(3, 4));
    let [of_sphere, of_volume] = [&sphere, &volume].map(|s| s.triangles().len());
    let mixed = repaired(&side_by_side(&[sphere, volume, book.clone()]));
    let census = mixed.mesh.topology_summary().clone();
    let Accepted { mesh, refused } = mixed.accepted().expect("a sphere and a book");
    let [RefusedComponent { component: 1, triangles, first_triangle, error }] = &refused[..] else {
        panic!("{refused:?}")
    };
    assert_eq!((*triangles, *first_triangle as usize), (of_volume, of_sphere));
    let Error::VolumeElements { sheets, nonmanifold_edges, vertices, .. } = error else { panic!("{error}") };
    assert!(*sheets > 1_000 && vertices.len() == 8, "{error}");
    let of_book = repaired(&book).mesh.topology_summary().clone();
    assert_eq!(nonmanifold_edges + of_book.nonmanifold_edges, census.nonmanifold_edges);
    // What is left is what it was.
    mesh.assert_sound();
    let met = |s: &TopologySummary| (s.nonmanifold_edges, s.nonmanifold_vertices);
    assert_eq!(met(mesh.topology_summary()), met(&of_book), "the sphere has none");
    assert_eq!(mesh.topology_summary().components, 1 + of_book.components);
    assert_eq!(mesh.triangles().len(), of_sphere + of_book.triangles);
    let last = mesh.triangles().len() - 1;
    assert_eq!(mesh.source_triangle(last) as usize, of_sphere + of_volume + of_book.triangles - 1);
    assert!(mesh.corners(last).iter().all(|p| p[0] > 150.0), "{:?}", mesh.corners(last));
}

#[test]
fn a_single_edge_on_which_another_sheet_stands_becomes_a_slit() {
    // A fan of six triangles around two inner vertices; a fin stands on the edge between these.
    let mut points: Vec<Vec3> = vec![[0.0; 3], [1.0, 0.0, 0.0]];
    let rim = [[-1.0, -1.0], [0.5, -1.0], [2.0, -1.0], [2.0, 1.0], [0.5, 1.0], [-1.0, 1.0]];
    points.extend(rim.map(|[x, y]| [x, y, 0.0]));
    points.push([0.5, 0.0, 1.0]);
    let sheet = [[0, 2, 3], [0, 3, 1], [1, 3, 4], [1, 4, 5], [1, 5, 6], [1, 6, 0], [0, 6, 7], [0, 7, 2]];
    let triangles: Vec<[u32; 3]> = sheet.into_iter().chain([[0, 1, 8]]).collect();
    let got = repaired(&TriangleSoup::new(points, triangles).expect("sound"));
    assert_eq!((got.report.slits_opened, got.report.triangles_added), (1, 3));
    // The slit is a hole of the sheet, along which the fin stands; all three have vertices of their own.
    let summary = got.mesh.topology_summary();
    assert_eq!((summary.components, summary.boundary_loops, summary.nonmanifold_edges), (2, 3, 2));
    let added: Vec<VertexId> =
        (0..got.mesh.points().len()).map(VertexId::at).filter(|v| got.mesh.input_vertex(*v).is_none()).collect();
    assert_eq!(added.len(), 3, "one for each side of the slit, one for the fin");
    assert!(added.iter().all(|v| got.mesh.points()[v.index()] == [0.5, 0.0, 0.0]));
    // Two edges or more need no help: the vertex between them is there already.
    let book = repaired(&crate::shapes::book(3, 4));
    assert_eq!(book.report.slits_opened, 0);
}
