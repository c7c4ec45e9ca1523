use super::*;
use crate::measure::curvature;
use crate::mesh::TriangleSoup;
use crate::monitor::NoMonitor;
use crate::{decompose, repair};
use std::f64::consts::{PI, TAU};

/// A disk of radius 4 whose middle, up to radius 1, is drawn out to a cone of half-angle `degrees`, in edges of about
/// `step`.
fn spiked_disk(degrees: f64, step: f64) -> TriangleSoup {
    let around = (TAU / step).round() as u32;
    let slope = 1.0 / degrees.to_radians().tan();
    let along_cone = (slope.hypot(1.0) / step).ceil();
    let along_disk = (3.0 / step).ceil();
    let radii = (1..=along_cone as u32).map(|k| f64::from(k) / along_cone);
    let radii = radii.chain((1..=along_disk as u32).map(|k| 1.0 + 3.0 * f64::from(k) / along_disk));
    let mut points = vec![[0.0, 0.0, slope]];
    for (k, radius) in radii.enumerate() {
        for j in 0..around {
            let angle = (f64::from(j) + 0.5 * (k % 2) as f64) * TAU / f64::from(around);
            points.push([radius * angle.cos(), radius * angle.sin(), slope * (1.0 - radius).max(0.0)]);
        }
    }
    let rings = (points.len() as u32 - 1) / around;
    let at = |k: u32, j: u32| 1 + k * around + j % around;
    let mut triangles: Vec<[u32; 3]> = (0..around).map(|j| [0, at(0, j), at(0, j + 1)]).collect();
    for (k, j) in (0..rings - 1).flat_map(|k| (0..around).map(move |j| (k, j))) {
        let (i, o) = ([at(k, j), at(k, j + 1)], [at(k + 1, j), at(k + 1, j + 1)]);
        triangles.extend(if k % 2 == 0 {
            [[i[0], o[0], i[1]], [i[1], o[0], o[1]]]
        } else {
            [[i[0], o[0], o[1]], [i[0], o[1], i[1]]]
        });
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

fn found(soup: &TriangleSoup, size: f64) -> Vec<Spike> {
    let mesh = repair(soup, &Default::default()).expect("repairs").mesh;
    let no_features = decompose::Settings { feature_angle: None, ..Default::default() };
    let atlas = decompose(&mesh, &no_features, &NoMonitor).expect("decomposes");
    let group: Vec<u32> = (0..mesh.points().len() as u32).collect();
    let curvatures = curvature::measure(&mesh, &group, group.len());
    let curvatures: Vec<Principal> = curvatures.iter().map(|c| c.principal(mesh.metric().scale)).collect();
    spikes(&mesh, atlas.charts(), &curvatures, size)
}

#[test]
fn sharp_cones_are_found_at_their_tips_and_blunt_ones_are_not() {
    for (degrees, size, step) in [(25.0, 0.4, 0.1), (25.0, 0.4, 0.05), (20.0, 0.2, 0.15)] {
        let spikes = found(&spiked_disk(degrees, step), size);
        let tip = [0.0, 0.0, 1.0 / f64::to_radians(degrees).tan()];
        assert!(!spikes.is_empty() && spikes.len() <= 24, "{degrees}: {}", spikes.len());
        assert!(spikes.iter().all(|s| distance(s.centre, tip) < s.radius), "{degrees}: {spikes:?}");
        assert!(spikes.iter().any(|s| s.size == size / 8.0), "a tip is sharp at every size");
    }
    for degrees in [42.0, 60.0, 89.0] {
        assert_eq!(found(&spiked_disk(degrees, 0.1), 0.4), vec![], "{degrees}");
    }
}

#[test]
fn a_spike_wide_enough_for_the_edges_is_none() {
    // The top is a disk of radius 0.25.
    let cone = spiked_disk(15.0, 0.1);
    let blunt = cone.points().iter().map(|p| [p[0], p[1], p[2].min(2.8)]).collect();
    let soup = TriangleSoup::new(blunt, cone.triangles().to_vec()).expect("sound");
    assert_eq!(found(&soup, 0.1), vec![]);
    let thin = found(&soup, 0.9);
    assert!(!thin.is_empty() && thin.iter().all(|s| s.size > 0.2), "{thin:?}");
}

#[test]
fn a_tip_of_needles_is_found_although_its_mean_curvature_is_small() {
    // A cone of 12 facets, a hundred edges long.
    let ring = (0..12).map(|j| f64::from(j) / 12.0 * TAU).map(|a| [a.cos(), a.sin(), 0.0]);
    let points = [[0.0, 0.0, 5.0]].into_iter().chain(ring).collect();
    let triangles = (0..12).map(|j| [0, 1 + j, 1 + (j + 1) % 12]).collect();
    let spikes = found(&TriangleSoup::new(points, triangles).expect("sound"), 0.05);
    assert_eq!(spikes.iter().map(|s| s.centre).collect::<Vec<_>>(), vec![[0.0, 0.0, 5.0]; 3]);
}

#[test]
fn areas_within_balls_are_those_of_circles() {
    let [a, b, c] = [[0.0, 0.0, 1.0], [10.0, 0.0, 1.0], [0.0, 10.0, 1.0]];
    let near = |area: f64, right: f64| assert!((area - right).abs() < 1e-12, "{area} is not {right}");
    near(area_within([a, b, c], a, 2.0), PI);
    near(area_within([a, b, c], [3.0, 3.0, 1.0], 1.0), PI);
    near(area_within([a, b, c], [3.0, 3.0, 1.6], 1.0), PI * 0.64);
    near(area_within([a, b, c], [5.0, 0.0, 1.0], 2.0), TAU);
    near(area_within([a, b, c], a, 20.0), 50.0);
    near(area_within([a, b, c], [-3.0, -3.0, 1.0], 2.0), 0.0);
    near(area_within([a, b, c], [0.0, 0.0, 4.0], 2.0), 0.0);
    near(area_within([a, b, b], a, 2.0), 0.0);
    // A corner and what is cut off beyond the longest side.
    let beyond = 2.0 * (7.5_f64 * 7.5 - 50.0).sqrt();
    let cap = 7.5 * 7.5 * (50.0_f64.sqrt() / 7.5).acos() - 0.5 * 50.0_f64.sqrt() * beyond;
    near(area_within([a, b, c], a, 7.5), PI / 4.0 * 7.5 * 7.5 - cap);
}

/// A disk whose middle is drawn out to a finger of the given length, with a round tip: `around` edges of about `step`.
fn fingered_disk(length: f64, radius: f64, step: f64) -> TriangleSoup {
    let around = (TAU * radius / step).round().max(8.0) as u32;
    let mut profile = Vec::new();
    for k in 1..=4 {
        let angle = f64::from(k) / 4.0 * PI / 2.0;
        profile.push([radius * angle.sin(), length + radius * angle.cos()]);
    }
    let rows = (length / step).ceil();
    profile.extend((1..=rows as u32).map(|k| [radius, length * (1.0 - f64::from(k) / rows)]));
    let out = (4.0 / step).ceil();
    profile.extend((1..=out as u32).map(|k| [radius + 4.0 * f64::from(k) / out, 0.0]));
    let mut points = vec![[0.0, 0.0, length + radius]];
    for [r, z] in &profile {
        for j in 0..around {
            let angle = f64::from(j) * TAU / f64::from(around);
            points.push([r * angle.cos(), r * angle.sin(), *z]);
        }
    }
    let at = |k: u32, j: u32| 1 + k * around + j % around;
    let mut triangles: Vec<[u32; 3]> = (0..around).map(|j| [0, at(0, j), at(0, j + 1)]).collect();
    for (k, j) in (0..profile.len() as u32 - 1).flat_map(|k| (0..around).map(move |j| (k, j))) {
        triangles.push([at(k, j), at(k + 1, j), at(k, j + 1)]);
        triangles.push([at(k, j + 1), at(k + 1, j), at(k + 1, j + 1)]);
    }
    TriangleSoup::new(points, triangles).expect("sound")
}

#[test]
fn fingers_are_found_as_far_as_a_mesh_would_leave_them_out() {
    let size = 0.4;
    // So many edges around, and so many long.
    for (around, length, is_found) in [(1.6, 4.0, true), (2.2, 4.0, true), (6.0, 4.0, false), (2.2, 0.2, false)] {
        let spikes = found(&fingered_disk(length * size, around * size / TAU, 0.1), size);
        assert_eq!(!spikes.is_empty(), is_found, "{around} around, {length} long: {spikes:?}");
    }
}
