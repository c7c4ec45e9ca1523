//! What people's files showed: sides that do not meet, coordinates too coarse, heights that are none, and faces of volumes.

use crate::support::{Out, planish};
use planish::outcome::{Code, Status};
use planish::report::{Doubt, Report};
use serde_json::Value;
use std::collections::BTreeSet;

type Triangle = [[f64; 3]; 3];

/// A binary STL file.
fn stl(triangles: &[Triangle]) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((triangles.len() as u32).to_le_bytes());
    for t in triangles {
        bytes.extend([0; 12]);
        t.iter().flatten().for_each(|c| bytes.extend((*c as f32).to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

/// A polygon as a fan about its first corner.
fn fan(polygon: &[[f64; 3]]) -> Vec<Triangle> {
    polygon[1..].windows(2).map(|w| [polygon[0], w[0], w[1]]).collect()
}

/// A unit cube whose top has a vertex more on each of its sides, moved outwards by `gap`.
fn cube_with_finer_top(gap: f64) -> Vec<Triangle> {
    let [low, high] = [0.0, 1.0].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [1.0, 1.0, z], [0.0, 1.0, z]]);
    let mut triangles = fan(&[low[0], low[3], low[2], low[1]]);
    (0..4).for_each(|k| triangles.extend(fan(&[low[k], low[(k + 1) % 4], high[(k + 1) % 4], high[k]])));
    let middles = [[0.5, -gap, 1.0], [1.0 + gap, 0.5, 1.0], [0.5, 1.0 + gap, 1.0], [-gap, 0.5, 1.0]];
    let mut top = vec![[0.5, 0.5, 1.0]];
    (0..4).for_each(|k| top.extend([high[k], middles[k]]));
    top.push(high[0]);
    triangles.extend(fan(&top));
    triangles
}

/// Heights over a grid of squares of 0.25, far from the origin; `height` has grid positions.
fn terrain(origin: [f64; 2], height: impl Fn(u32, u32) -> f64) -> Vec<Triangle> {
    let point = |i: u32, j: u32| [origin[0] + 0.25 * f64::from(i), origin[1] + 0.25 * f64::from(j), height(i, j)];
    let square = |i, j| fan(&[point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)]);
    (0..3600).flat_map(|k| square(k % 60, k / 60)).collect()
}

fn hills(i: u32, j: u32) -> f64 {
    600.0 + 40.0 * (f64::from(i) / 16.0).cos() * (f64::from(j) / 12.0).sin()
}

fn doubts(report: &Report) -> Vec<Doubt> {
    report.warnings.iter().map(|w| w.code).collect()
}

#[test]
fn a_cube_with_a_finer_top_is_closed() {
    let out = Out::new();
    let (ended, report) = out.run_bytes("cube.stl", &stl(&cube_with_finer_top(0.0)));
    assert_eq!((ended.code, report.status, doubts(&report)), (Some(0), Status::Certified, vec![]), "{}", ended.err);
    let (counts, repairs) = (report.surface.expect("counted").repaired.counts, report.repairs.expect("told"));
    assert_eq!((counts.components, counts.boundary_loops, counts.euler), (1, 0, 2));
    assert_eq!((repairs.t_junctions_closed, repairs.t_junctions_left, repairs.triangles_added), (4, 0, 4));
    let checked = crate::support::planish(["check".as_ref(), out.of("cube.stl").as_os_str()]);
    assert_eq!(checked.code, Some(0), "{}", checked.err);
    let (_, open) = out.run_bytes("open.stl", &stl(&cube_with_finer_top(1e-4)));
    assert_eq!(open.surface.expect("counted").repaired.counts.boundary_loops, 2);
}

#[test]
fn a_terrain_in_coarse_coordinates_is_told_and_stays_in_a_few_charts() {
    let out = Out::new();
    let (ended, far) = out.run_bytes("far.stl", &stl(&terrain([400_000.0, 5_000_000.0], hills)));
    assert_eq!((far.status, doubts(&far)), (Status::Certified, vec![Doubt::CoarseCoordinates]));
    assert!(far.charts.len() <= 3, "{} charts", far.charts.len());
    assert!(ended.err.contains("steps of 0.5 along y") && ended.err.contains("local origin"), "{}", ended.err);
    assert!(!ended.err.contains("--size 0"), "{}", ended.err);
    let (_, near) = out.run_bytes("near.stl", &stl(&terrain([0.0; 2], hills)));
    assert!(near.charts.len() <= 3 && doubts(&near).is_empty(), "{:?}", near.warnings);
}

#[test]
fn heights_of_no_data_are_named() {
    let out = Out::new();
    let no_data = |i: u32, j: u32| if (20..24).contains(&i) && (30..34).contains(&j) { -9999.0 } else { hills(i, j) };
    let (ended, report) = out.run_bytes("holes.stl", &stl(&terrain([0.0; 2], no_data)));
    assert!(doubts(&report).contains(&Doubt::ValueApart), "{:?}", report.warnings);
    assert!(ended.err.contains("z is -9999 at 16 vertices"), "{}", ended.err);
}

/// The faces of all tetrahedra in a grid of n cubes each way, six in each.
fn faces_of_tetrahedra(n: u32) -> Vec<Triangle> {
    let mut faces = BTreeSet::new();
    for cube in (0..n * n * n).map(|i| [i % n, i / n % n, i / n / n]) {
        for [x, y] in [[0, 1], [0, 2], [1, 0], [1, 2], [2, 0], [2, 1]] {
            let mut corners = [cube; 4];
            corners[1..].iter_mut().for_each(|c| c[x] += 1);
            corners[2..].iter_mut().for_each(|c| c[y] += 1);
            corners[3] = cube.map(|c| c + 1);
            let [a, b, c, d] = corners;
            faces.extend([[a, b, c], [a, b, d], [a, c, d], [b, c, d]]);
        }
    }
    faces.into_iter().map(|t| t.map(|p: [u32; 3]| p.map(f64::from))).collect()
}

#[test]
fn faces_of_all_tetrahedra_are_refused_at_once() {
    let faces = faces_of_tetrahedra(16);
    let (out, inputs) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let (ended, report) = out.run_bytes("tetrahedra.stl", &stl(&faces));
    let reason = report.reason.expect("refused");
    assert_eq!((ended.code, reason.code), (Some(1), Code::VolumeElements), "{}", reason.message);
    assert!(reason.message.contains("export the boundary") && report.surface.is_some());
    let path = inputs.path().join("tetrahedra.stl");
    std::fs::write(&path, stl(&faces)).expect("written");
    let told = planish(["info".as_ref(), path.as_os_str(), "--json".as_ref()]);
    let told: Value = serde_json::from_str(&told.out).expect("JSON");
    assert_eq!(told["reason"]["code"], "volume_elements");
    assert_eq!(told["surface"]["raw"]["nonmanifold_edges"], 30_928);
}

/// A terrain of 60 by 60 squares, and far from it the faces of all tetrahedra of a block.
pub fn terrain_beside_a_volume() -> (Vec<u8>, usize, usize) {
    let surface = terrain([0.0; 2], hills);
    let block = faces_of_tetrahedra(8);
    let far = |t: &Triangle| t.map(|[x, y, z]| [x - 500.0, y, z]);
    let all: Vec<Triangle> = surface.iter().copied().chain(block.iter().map(far)).collect();
    (stl(&all), surface.len(), block.len())
}

/// A file of these bytes.
fn inputs_with(folder: &tempfile::TempDir, bytes: &[u8]) -> std::path::PathBuf {
    let path = folder.path().join("mixed.stl");
    std::fs::write(&path, bytes).expect("written");
    path
}

#[test]
fn a_component_that_cannot_be_processed_is_refused_alone() {
    let (bytes, of_surface, of_block) = terrain_beside_a_volume();
    let (out, inputs) = (Out::new(), tempfile::tempdir().expect("a folder"));
    let (ended, report) = out.run_bytes("mixed.stl", &bytes);
    assert_eq!((ended.code, report.status, &report.reason), (Some(1), Status::Certified, &None), "{}", ended.err);
    let [refused] = &report.refused_components[..] else { panic!("{:?}", report.refused_components) };
    assert_eq!((refused.component, refused.triangles, refused.first_triangle as usize), (1, of_block, of_surface));
    assert_eq!(refused.reason.code, Code::VolumeElements);
    assert!(ended.err.contains("component 1 is refused") && ended.err.contains("export the boundary"), "{}", ended.err);
    let published: usize = report.charts.iter().map(|c| c.triangles).sum();
    assert!((of_surface..of_surface + 10).contains(&published), "the others, and halves of ears: {published}");
    // The result is proven again, and is no less than it says.
    let folder = out.of("mixed.stl");
    assert_eq!(planish(["check".as_ref(), folder.as_os_str()]).code, Some(0));
    let told = planish(["status".as_ref(), "--out".as_ref(), out.path().as_os_str(), "--json".as_ref()]);
    let told: Value = serde_json::from_str(&told.out).expect("JSON");
    assert_eq!((&told["refusals"][0]["name"], &told["results"]["certified"]), (&"mixed.stl".into(), &1.into()));
    let table = out.run(&[&inputs_with(&inputs, &bytes)], &[]).out;
    assert!(table.contains("certified, 1 component refused (up to date)"), "{table}");
    // A report that hides how much is missing is found out.
    let honest = std::fs::read_to_string(folder.join("report.json")).expect("text");
    let forged = honest.replacen(&format!("\"triangles\": {of_block}"), "\"triangles\": 1", 1);
    assert_ne!(forged, honest, "the twin is forged");
    std::fs::write(folder.join("report.json"), forged).expect("written");
    assert_eq!(planish(["check".as_ref(), folder.as_os_str()]).code, Some(1));
    std::fs::write(folder.join("report.json"), honest).expect("written");
    // Alone, the surface gets the same charts.
    let (_, alone) = out.run_bytes("alone.stl", &stl(&terrain([0.0; 2], hills)));
    let sizes = |r: &Report| r.charts.iter().map(|c| c.triangles).collect::<Vec<_>>();
    assert_eq!(sizes(&alone), sizes(&report));
    // It is told beforehand, too.
    let path = inputs_with(&inputs, &bytes);
    let told = planish(["info".as_ref(), path.as_os_str(), "--json".as_ref()]);
    assert_eq!(told.code, Some(1));
    let told: Value = serde_json::from_str(&told.out).expect("JSON");
    assert_eq!((&told["reason"], &told["refused_components"][0]["triangles"]), (&Value::Null, &of_block.into()));
    let for_people = planish(["info".as_ref(), path.as_os_str()]).out;
    assert!(for_people.contains(&format!("component 1 of {of_block} triangles")), "{for_people}");
}
