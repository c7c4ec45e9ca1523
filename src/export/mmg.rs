//! The hand-off to Mmg: the surface for mmgs, and the planes of the charts for mmg2d.
//!
//! mmgs knows of no charts. It gets the repaired surface, welded, with a reference per label, sizes at vertices, and ridges: it
//! rounds off all that it is not told of. (Its own detection of ridges takes slivers of scans for some: with the creases of
//! planish and without its own, elements below gamma 0.1 went from 49 to 18 on max_planck, and from 458 to 90 on cad_rear_case.)
//!
//! mmg2d gets each chart by itself ([`planish_core::planar`]), with the nodes of its boundary required, so that neighbours fit
//! together when they are lifted.

use super::Wanted;
use super::sizes::{Seams, Varying, varying};
use crate::formats::medit::{MeditMesh, solution};
use crate::formats::{JoinedVertices, label_index};
use crate::report::{MmgReport, Reference};
use crate::result_files;
use planish_core::CertifiedAtlas;
use planish_core::decompose;
use planish_core::measure::bends::dihedral_cosines;
use planish_core::measure::curvature;
use planish_core::measure::sizes::SizeTable;
use planish_core::monitor::{Interrupted, Monitor};
use planish_core::planar::{self, PlaneMesh, Sizing, plane_meshes};
use planish_core::topology::{ChartId, CurveId, VertexId};
use planish_core::vec3::{Vec3, dot, norm, sub};
use std::collections::BTreeSet;

/// How far mmgs may be from the surface that it makes of the ridges and normals, in edges, where no distance is asked for. With
/// a tenth it makes up to three times the elements where creases are many; with more, arcs of small radius become polygons.
const HAUSDORFF: f64 = 0.3;

/// The reference of all triangles where there are no labels; where there are, those without one have 0.
const ONE: i32 = 1;

/// The reference of edges along creases.
const CREASE: u32 = 1;

/// The files of a hand-off, and the account of it.
#[derive(Debug)]
pub struct MmgExport {
    /// Names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the report says.
    pub report: MmgReport,
}

/// Hands an atlas to Mmg, for a mesh as it is wanted.
///
/// # Errors
/// [`Interrupted`].
pub fn mmg(atlas: &CertifiedAtlas, wanted: &Wanted, monitor: &dyn Monitor) -> Result<MmgExport, Interrupted> {
    let curvatures = curvature::at_vertices(atlas.mesh());
    let of_surface = varying(atlas, &curvatures, Seams::Passed, wanted);
    let (mesh, sizes) = surface(atlas, wanted, &of_surface, monitor)?;
    let mut report = MmgReport {
        size: wanted.sizes.size,
        hausdorff: wanted.sizes.deviation.unwrap_or(HAUSDORFF * wanted.sizes.size),
        least_size: of_surface.least,
        detects_ridges: wanted.ridges.is_none(),
        ridges: mesh.ridges.len(),
        corners: mesh.corners.len(),
        references: references(wanted),
        charts: 0,
        failure: None,
    };
    let mut files = vec![
        (result_files::MMG_SURFACE.to_owned(), mesh.into_bytes()),
        (result_files::MMG_SURFACE_SIZES.to_owned(), solution(3, &sizes)),
    ];
    let of_charts = varying(atlas, &curvatures, Seams::Kept { adapted: &[] }, wanted);
    let lengths = Lengths { table: SizeTable::new(of_charts.cubes, wanted.sizes.size) };
    let charts: Vec<ChartId> = (0..atlas.charts().len()).map(ChartId::at).collect();
    match plane_meshes(atlas, &charts, &lengths, monitor) {
        Ok(meshes) => {
            report.charts = meshes.len();
            meshes.into_iter().for_each(|mesh| files.extend(chart_files(mesh)));
        }
        Err(planar::Error::Interrupted(interrupted)) => return Err(interrupted),
        Err(error) => {
            tracing::warn!("no hand-off of charts to mmg2d: {error}");
            report.failure = Some(error.to_string());
        }
    }
    Ok(MmgExport { files, report })
}

/// The lengths of edges.
struct Lengths {
    table: SizeTable,
}

impl Sizing for Lengths {
    fn size_at(&self, x: Vec3) -> f64 {
        self.table.at(x)
    }

    fn keeps(&self, _curve: CurveId) -> bool {
        false
    }
}

/// The references of labels, by name.
fn references(wanted: &Wanted) -> Vec<Reference> {
    let reference = |label: &crate::formats::Label| Reference { reference: label.tag, name: label.name.clone() };
    wanted.labels.iter().map(reference).collect()
}

/// The surface for mmgs, and a size at each of its vertices.
fn surface(
    atlas: &CertifiedAtlas,
    wanted: &Wanted,
    varying: &Varying,
    monitor: &dyn Monitor,
) -> Result<(MeditMesh<3>, Vec<[f64; 1]>), Interrupted> {
    let mesh = atlas.mesh();
    let vertices = JoinedVertices::of(mesh);
    let number = |v: VertexId| vertices.number(mesh.welded_vertex(v));
    let mut triangles = vec![([0; 3], ONE); mesh.triangles().len()];
    for certified in atlas.charts() {
        let label = label_index(atlas, certified.id(), wanted.labels);
        let without = if wanted.labels.is_empty() { ONE } else { 0 };
        let reference = label.map_or(without, |label| wanted.labels[label].tag);
        for face in certified.chart().faces() {
            triangles[face.index()] = (mesh.triangles()[face.index()].map(number), reference);
        }
    }
    let ridges = match wanted.ridges {
        Some(angle) => ridges(atlas, angle, &number, monitor)?,
        None => BTreeSet::new(),
    };
    let open = open_edges(atlas, &number);
    let corners = match wanted.ridges {
        Some(angle) => corners(vertices.points(), ridges.iter().chain(&open), angle),
        None => vec![],
    };
    let edges: Vec<([u32; 2], u32)> = ridges.into_iter().map(|ends| (ends, CREASE)).collect();
    let table = SizeTable::new(varying.cubes.clone(), wanted.sizes.size);
    let size = |(v, x): (&VertexId, &Vec3)| {
        let given = mesh.given_size(*v).map_or(f64::INFINITY, |size| size.max(wanted.sizes.min));
        [table.at(*x).min(given)]
    };
    let sizes = vertices.copies().iter().zip(vertices.points()).map(size).collect();
    let mesh = MeditMesh {
        vertices: vertices.points().iter().map(|x| (*x, 0)).collect(),
        triangles,
        ridges: (0..edges.len() as u32).collect(),
        edges,
        corners,
        ..MeditMesh::default()
    };
    Ok((mesh, sizes))
}

/// The edges that are creases, between vertices by number, the lesser first.
fn ridges(
    atlas: &CertifiedAtlas,
    angle: f64,
    number: &dyn Fn(VertexId) -> u32,
    monitor: &dyn Monitor,
) -> Result<BTreeSet<[u32; 2]>, Interrupted> {
    let mesh = atlas.mesh();
    let mut ridges = BTreeSet::new();
    for h in decompose::ridges(mesh, angle, monitor)? {
        let corners = mesh.triangles()[h.face().index()];
        ridges.insert(sorted([corners[h.side()], corners[(h.side() + 1) % 3]].map(number)));
    }
    // Where parts have labels the surface is cut open: what is sharp there shows between charts.
    let blunt = angle.to_radians().cos();
    for curve in atlas.seams().seams() {
        let cosines = dihedral_cosines(atlas.charts(), curve).unwrap_or_default();
        for (ends, _) in curve.vertices().windows(2).zip(cosines).filter(|(_, cosine)| *cosine < blunt) {
            ridges.insert(sorted([ends[0], ends[1]].map(number)));
        }
    }
    Ok(ridges)
}

/// The edges of the open boundary.
fn open_edges(atlas: &CertifiedAtlas, number: &dyn Fn(VertexId) -> u32) -> Vec<[u32; 2]> {
    let open = atlas.seams().curves().iter().filter(|curve| curve.is_open());
    open.flat_map(|curve| curve.vertices().windows(2)).map(|ends| sorted([ends[0], ends[1]].map(number))).collect()
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The vertices at which ridges end, meet, or turn by more than an angle: mmgs finds none of them unless it looks for ridges
/// itself.
fn corners<'a>(points: &[Vec3], ridges: impl Iterator<Item = &'a [u32; 2]>, angle: f64) -> Vec<u32> {
    let mut ends: Vec<(u32, u32)> = ridges.flat_map(|[a, b]| [(*a, *b), (*b, *a)]).collect();
    ends.sort_unstable();
    ends.dedup();
    let blunt = angle.to_radians().cos();
    let mut corners = Vec::new();
    for at in ends.chunk_by(|x, y| x.0 == y.0) {
        let here = points[at[0].0 as usize];
        let runs_on = match at {
            [(_, before), (_, behind)] => {
                let [from, to] = [sub(here, points[*before as usize]), sub(points[*behind as usize], here)];
                dot(from, to) >= blunt * norm(from) * norm(to)
            }
            _ => false,
        };
        if !runs_on {
            corners.push(at[0].0);
        }
    }
    corners
}

/// The files of a chart.
fn chart_files(mesh: PlaneMesh) -> [(String, Vec<u8>); 2] {
    let [name, metric_name] = result_files::mmg_chart(mesh.chart.index());
    let metric: Vec<[f64; 3]> = mesh.metric.iter().map(|m| [m.uu, m.uv, m.vv]).collect();
    // References of nodes on curves are their numbers among all, from 1: a chart's neighbours have the same.
    let reference = |node: usize| mesh.shared.get(node).map_or(0, |shared| shared + 1);
    let plane = MeditMesh {
        vertices: mesh.uv.iter().enumerate().map(|(node, uv)| (*uv, reference(node))).collect(),
        triangles: mesh.triangles.iter().map(|t| (*t, mesh.chart.index() as i32 + 1)).collect(),
        edges: mesh.sides.iter().map(|side| (side.ends, side.curve.index() as u32 + 1)).collect(),
        required_edges: (0..mesh.sides.len() as u32).collect(),
        required_vertices: (0..mesh.shared.len() as u32).collect(),
        ..MeditMesh::default()
    };
    [(name, plane.into_bytes()), (metric_name, solution(2, &metric))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_where_ridges_end_meet_or_turn() {
        let points =
            [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [2.0, 0.1, 0.0], [2.0, 1.0, 0.0], [2.0, 2.0, 0.0], [3.0, 1.0, 0.0]];
        let ridges = [[0, 1], [1, 2], [2, 3], [3, 4], [3, 5]];
        assert_eq!(corners(&points, ridges.iter(), 40.0), [0, 2, 3, 4, 5], "1 runs on");
    }
}
