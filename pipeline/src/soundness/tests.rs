use super::*;
use crate::certified::CertifiedAtlas;
use crate::parametrize::parametrize_chart;
use crate::seams::tests::{labelled, sector};
use crate::subdivide::subdivide;
use crate::topology::VertexId;
use crate::{Order, shapes};

/// A surface with its atlas as a mesher gets it, and the best of all meshes: the surface itself.
struct Sample {
    surface: Triangulation,
    charts: Vec<u32>,
    atlas: HandedOverAtlas,
    mesh: Mesh,
    size: f64,
}

impl Sample {
    fn new(soup: &crate::mesh::TriangleSoup, label: impl Fn(Vec3) -> u32) -> Self {
        let (mesh, atlas) = labelled(soup, label);
        let certified = |chart| parametrize_chart(chart, Order::Quadratic).expect("maps");
        let charts = atlas.into_charts().into_iter().map(certified).collect();
        let atlas = CertifiedAtlas::gather(mesh, charts, Some(f64::MIN_POSITIVE)).expect("an atlas");
        let (mesh, network) = (atlas.mesh(), atlas.seams());
        let linear = subdivide(&atlas, &vec![None; atlas.charts().len()]).expect("subdivides");
        let point = |n: &u32| linear.points()[*n as usize];
        let charts = linear.charts().iter().enumerate().map(|(c, l)| {
            let passages = network.loops(ChartId::at(c)).concat();
            let uv = l.uv().iter().map(|p| p.uv()).collect();
            HandedOverChart {
                map: crate::evaluate::TriangulatedMap::new(
                    l.nodes().iter().map(point).collect(),
                    uv,
                    l.triangles().to_vec(),
                ),
                curves: passages.iter().map(|p| p.curve.0).collect(),
            }
        });
        let handed_over = HandedOverAtlas {
            curves: linear.curves().iter().map(|c| c.iter().map(point).collect()).collect(),
            charts: charts.collect(),
        };
        let mut charts = vec![0; mesh.triangles().len()];
        for c in atlas.charts() {
            c.chart().faces().iter().for_each(|f| charts[f.index()] = c.id().0);
        }
        let triangles = mesh.triangles().iter().map(|t| t.map(|v| v.0));
        let surface = Triangulation::welded(mesh.points(), triangles);
        let size = (surface.area() / surface.triangles.len() as f64 * 2.3).sqrt();
        let mids = vec![None; surface.triangles.len()];
        let whole = Mesh { triangulation: surface.clone(), mids, charts: Some(charts.clone()) };
        Self { surface, charts, atlas: handed_over, mesh: whole, size }
    }

    /// A sphere of two halves, with a seam that lies in no plane.
    fn sphere() -> Self {
        Self::new(&shapes::sphere(8), |p| u32::from(p[2] > 0.3 * p[0] * p[0]))
    }

    fn settings(&self) -> Settings {
        Settings { size: self.size, min_gamma: 0.1, off_surface: 1e-6, deviation: None }
    }

    fn examined(&self, mesh: &Mesh) -> Findings {
        examine(mesh, &self.surface, &self.charts, Some(&self.atlas), &self.settings())
    }

    /// The defects of a mesh that was made from the right one.
    fn defects(&self, change: impl FnOnce(&mut Mesh)) -> Vec<Defect> {
        let mut mesh = self.mesh.clone();
        change(&mut mesh);
        self.examined(&mesh).defects
    }

    /// A vertex that no seam touches, and the triangles around it.
    fn inner_vertex(&self, chart: u32) -> (VertexId, Vec<usize>) {
        let around = |v: VertexId| {
            let has = |t: &usize| self.surface.triangles[*t].contains(&v);
            (0..self.surface.triangles.len()).filter(has).collect::<Vec<_>>()
        };
        let is_inner = |v: &VertexId| around(*v).iter().all(|t| self.charts[*t] == chart);
        let inner = (0..self.surface.points.len()).map(VertexId::at).find(is_inner).expect("there are some");
        (inner, around(inner))
    }
}

#[test]
fn surfaces_represent_themselves() {
    let samples = [
        Sample::sphere(),
        Sample::new(&shapes::ring_torus(24, 12), |p| sector(p, 4)),
        Sample::new(&shapes::disk(9), |_| 0),
        Sample::new(&shapes::flat_disk(9), |p| sector(p, 3)),
        Sample::new(&shapes::disk_with_holes(10, 3), |_| 0),
        Sample::new(&shapes::book(3, 4), |p| {
            let turn = p[1].atan2(p[0]) / std::f64::consts::TAU * 3.0;
            (turn.rem_euclid(3.0).round() as u32) % 3
        }),
    ];
    for (i, sample) in samples.iter().enumerate() {
        let found = sample.examined(&sample.mesh);
        assert_eq!(found.defects, [], "{i}");
        assert!(found.by_charts && (found.area_ratio - 1.0).abs() < 1e-12);
        assert!(found.mesh_to_surface.distance < 1e-12 && found.surface_to_mesh.distance < 1e-12, "{i}: {found:?}");
        let alone = Mesh { charts: None, ..sample.mesh.clone() };
        let found = sample.examined(&alone);
        assert!(!found.by_charts && found.is_faithful(), "{i}: {:?}", found.defects);
    }
}

#[test]
fn a_lost_triangle_is_found_with_and_without_charts() {
    let sample = Sample::sphere();
    let lose = |mesh: &mut Mesh| {
        let (_, around) = sample.inner_vertex(0);
        mesh.triangulation.triangles.remove(around[0]);
        mesh.mids.remove(around[0]);
        mesh.charts.iter_mut().for_each(|c| _ = c.remove(around[0]));
    };
    let defects = sample.defects(lose);
    assert!(
        defects.iter().any(|d| matches!(d, Defect::StrayBoundary { chart: ChartId(0), edges: 3, .. })),
        "{defects:?}"
    );
    assert!(defects.iter().any(|d| matches!(d, Defect::Topology { what: "Euler number", .. })), "{defects:?}");
    let alone = sample.defects(|mesh| {
        lose(mesh);
        mesh.charts = None;
    });
    assert!(alone.iter().all(|d| matches!(d, Defect::Topology { .. })) && !alone.is_empty(), "{alone:?}");
}

#[test]
fn a_node_beyond_its_neighbours_folds_the_mesh_although_it_lies_on_the_surface() {
    let sample = Sample::sphere();
    let defects = sample.defects(|mesh| {
        let (v, around) = sample.inner_vertex(0);
        // The far corner of a triangle beside the ring around the node.
        let ring: Vec<VertexId> = around.iter().flat_map(|t| sample.surface.triangles[*t]).collect();
        let beyond = |t: &[VertexId; 3]| t.iter().filter(|u| ring.contains(u)).count() == 2;
        let next = sample.surface.triangles.iter().find(|t| beyond(t)).expect("there is one");
        let corners = next.map(|u| sample.surface.points[u.index()]);
        mesh.triangulation.points[v.index()] = centroid(corners);
    });
    assert!(defects.iter().any(|d| matches!(d, Defect::Folded { .. })), "{defects:?}");
    assert!(!defects.iter().any(|d| matches!(d, Defect::OffSurface { .. } | Defect::Topology { .. })), "{defects:?}");
}

#[test]
fn a_chart_that_is_turned_inside_out_is_told_as_one_defect() {
    let sample = Sample::sphere();
    let turned = |which: fn(usize) -> bool| {
        sample.defects(|mesh| {
            let charts = mesh.charts.clone().expect("by charts");
            let of_first = charts.iter().enumerate().filter(|(_, c)| **c == charts[0]).map(|(t, _)| t);
            for (_, t) in of_first.enumerate().filter(|(k, _)| which(*k)) {
                mesh.triangulation.triangles[t].swap(1, 2);
            }
        })
    };
    let whole = turned(|_| true);
    assert!(whole.iter().any(|d| matches!(d, Defect::InsideOut { .. })), "{whole:?}");
    assert!(!whole.iter().any(|d| matches!(d, Defect::Folded { .. } | Defect::BoundaryNested { .. })), "{whole:?}");
    let all_but_one = turned(|k| k > 0);
    assert!(all_but_one.iter().any(|d| matches!(d, Defect::Folded { .. })), "{all_but_one:?}");
}

#[test]
fn a_node_off_the_surface_is_found() {
    let sample = Sample::sphere();
    let (v, _) = sample.inner_vertex(1);
    for charts in [true, false] {
        let defects = sample.defects(|mesh| {
            mesh.triangulation.points[v.index()][0] += 1e-4;
            mesh.charts = mesh.charts.take().filter(|_| charts);
        });
        assert!(matches!(defects[..], [Defect::OffSurface { nodes: 1, .. }]), "{defects:?}");
    }
}

#[test]
fn seams_that_do_not_match_are_found() {
    let sample = Sample::sphere();
    // The triangles of one chart get a copy of a node on the seam: in space all is as it was.
    let defects = sample.defects(|mesh| {
        let triangles = &mut mesh.triangulation.triangles;
        let in_chart = |t: usize, c: u32| sample.charts[t] == c;
        let has = |c: u32, v: VertexId| (0..triangles.len()).any(|t| in_chart(t, c) && triangles[t].contains(&v));
        let shared = (0..sample.surface.points.len()).map(VertexId::at).find(|v| has(0, *v) && has(1, *v));
        let shared = shared.expect("a seam");
        let copy = VertexId::at(mesh.triangulation.points.len());
        mesh.triangulation.points.push(sample.surface.points[shared.index()]);
        for t in (0..triangles.len()).filter(|t| in_chart(*t, 1)) {
            triangles[t] = triangles[t].map(|v| if v == shared { copy } else { v });
        }
    });
    let broken = |chart: u32| move |d: &Defect| matches!(d, Defect::CurveBroken { chart: c, .. } if c.0 == chart);
    assert!(defects.iter().any(broken(0)) && defects.iter().any(broken(1)), "{defects:?}");
}

#[test]
fn wrong_charts_copies_and_empty_charts_are_found() {
    let sample = Sample::sphere();
    let (_, around) = sample.inner_vertex(0);
    let moved = sample.defects(|mesh| mesh.charts.iter_mut().for_each(|c| c[around[0]] = 1));
    assert!(moved.iter().any(|d| matches!(d, Defect::StrayBoundary { chart: ChartId(0), .. })), "{moved:?}");
    let unknown = sample.defects(|mesh| mesh.charts.iter_mut().for_each(|c| c[around[0]] = 7));
    assert!(unknown.iter().any(|d| matches!(d, Defect::NoChart { label: 8, charts: 2, triangles: 1, .. })));
    let empty = sample.defects(|mesh| mesh.charts.iter_mut().for_each(|c| c.fill(0)));
    assert!(empty.contains(&Defect::Empty { chart: ChartId(1) }), "{empty:?}");
    let doubled = sample.defects(|mesh| {
        let [a, b, c] = mesh.triangulation.triangles[around[0]];
        mesh.triangulation.triangles.push([b, c, a]);
        mesh.mids.push(None);
        mesh.charts.iter_mut().for_each(|c| c.push(0));
    });
    assert!(doubled.iter().any(|d| matches!(d, Defect::Degenerate { triangles: 1, .. })), "{doubled:?}");
}

#[test]
fn what_passes_through_another_part_is_found() {
    // Two plates, one over the other: far enough for the surface, not for a mesh with a node that is pulled through.
    let soup = |gap: f64| {
        let plate = shapes::flat_disk(6);
        let lifted = |p: &Vec3| [p[0], p[1], p[2] + gap];
        let count = plate.points().len() as u32;
        let points: Vec<Vec3> = plate.points().iter().copied().chain(plate.points().iter().map(lifted)).collect();
        let above = plate.triangles().iter().map(|t| t.map(|i| i + count));
        crate::mesh::TriangleSoup::new(points, plate.triangles().iter().copied().chain(above).collect()).expect("sound")
    };
    let sample = Sample::new(&soup(0.01), |p| u32::from(p[2] > 0.005));
    assert_eq!(sample.examined(&sample.mesh).defects, []);
    let (v, _) = sample.inner_vertex(0);
    let defects = sample.defects(|mesh| {
        let push = [0.02, 0.01, 0.015];
        (0..3).for_each(|k| mesh.triangulation.points[v.index()][k] += push[k]);
    });
    assert!(defects.iter().any(|d| matches!(d, Defect::Crossing { .. })), "{defects:?}");
}

#[test]
fn elements_of_six_nodes_are_held_against_surface_and_validity() {
    let sample = Sample::new(&shapes::flat_disk(5), |_| 0);
    let curved = |mesh: &mut Mesh, push: Vec3| {
        let triangle = sample.inner_vertex(0).1[0];
        let corners = mesh.triangulation.triangles[triangle];
        let points = &mut mesh.triangulation.points;
        mesh.mids[triangle] = Some([0, 1, 2].map(|k| {
            let [p, q] = [k, (k + 1) % 3].map(|i| points[corners[i].index()]);
            let middle = crate::vec3::midpoint(p, q);
            points.push([0, 1, 2].map(|i| middle[i] + push[i]));
            VertexId::at(points.len() - 1)
        }));
    };
    assert_eq!(sample.defects(|mesh| curved(mesh, [0.0; 3])), []);
    let off = sample.defects(|mesh| curved(mesh, [0.0, 0.0, 0.01]));
    assert!(matches!(off[..], [Defect::OffSurface { nodes: 3, .. }]), "{off:?}");
    let inverted = sample.defects(|mesh| curved(mesh, [0.2, 0.0, 0.0]));
    assert!(inverted.iter().any(|d| matches!(d, Defect::Inverted { elements: 1, .. })), "{inverted:?}");
}

#[test]
fn bad_elements_are_counted_and_do_not_make_a_mesh_unfaithful() {
    let sample = Sample::sphere();
    let strict = Settings { min_gamma: 0.9, ..sample.settings() };
    let found = examine(&sample.mesh, &sample.surface, &sample.charts, Some(&sample.atlas), &strict);
    assert!(found.is_faithful() && !found.is_fine());
    assert!(found.bad.is_sorted_by(|a, b| a.gamma <= b.gamma) && found.bad[0].gamma == found.gamma_min);
    assert!(sample.examined(&sample.mesh).is_fine());
}
