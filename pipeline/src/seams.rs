//! Seams: the curves along which charts meet, and the open boundary of the surface.
//!
//! A *segment* is an edge of the surface on the boundary of a chart; where repair gave several sheets vertices of
//! their own, their edges between the same two welded vertices are one segment. A *curve* is a maximal chain of
//! segments with the same charts beside them: one (open boundary), two (a seam), or more (sheets that meet). A
//! *corner* is a vertex in which other than two segments meet, or two with different charts beside them, or two
//! along which one chart runs twice, or where an edge of the shape itself (open boundary, sharp seams, sheets that meet)
//! turns sharply: a mesh keeps its points, and cuts off all other corners. A closed chain without a corner is one curve
//! with one point.
//!
//! Curves are numbered in the order in which the loops of the charts first meet them, and run as the first of these
//! charts does. The cost is that of sorting the segments.

mod distance;
mod gaps;
mod kinks;

pub(crate) use distance::segment_distance;

pub use gaps::Gap;

use crate::atlas::Chart;
use crate::mesh::SurfaceMesh;
use crate::topology::csr::Csr;
use crate::topology::loops::cut_at_corners;
use crate::topology::union_find::UnionFind;
use crate::topology::{ChartId, CurveId, HalfEdgeId, VertexId};
use crate::vec3::distance;

/// All curves of an atlas.
///
/// ```
/// use planish_core::decompose::assemble;
/// use planish_core::seams::SeamNetwork;
/// use planish_core::topology::ChartId;
/// use planish_core::{repair, shapes};
///
/// // A disk of radius 1, cut along its diameter.
/// let mesh = repair(&shapes::flat_disk(4), &repair::Settings::default())?.mesh;
/// let is_upper = |face: usize| mesh.corners(face).iter().map(|p| p[1]).sum::<f64>() > 0.0;
/// let labels: Vec<u32> = (0..mesh.triangles().len()).map(|f| u32::from(is_upper(f))).collect();
/// let atlas = assemble(&mesh, &labels)?;
/// let network = SeamNetwork::new(&mesh, atlas.charts(), 0.0);
/// assert_eq!((network.curves().len(), network.points().len()), (3, 2), "the seam, and half a circle on either side");
/// let seam = network.seams().next().expect("there is one");
/// assert!((seam.length() - 2.0).abs() < 1e-12 && seam.segments() == 8 && seam.sides().len() == 2);
/// assert_eq!(network.neighbours(ChartId(0)), [ChartId(1)]);
/// // The loop of a chart passes two curves: the seam, and its open boundary.
/// assert_eq!(network.loops(ChartId(0))[0].len(), 2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct SeamNetwork {
    curves: Vec<Curve>,
    points: Vec<CurvePoint>,
    loops: Vec<Vec<Vec<Passage>>>,
    neighbours: Vec<Vec<ChartId>>,
}

/// A curve: a polyline of edges of the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    id: CurveId,
    vertices: Vec<VertexId>,
    ends: [usize; 2],
    sides: Vec<CurveSide>,
    length: f64,
}

/// One of the charts along a curve.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CurveSide {
    /// The chart.
    pub chart: ChartId,
    /// Its half-edges, in the order of the curve.
    pub half_edges: Vec<HalfEdgeId>,
    /// Whether the half-edges run in the direction of the curve.
    pub forward: bool,
}

/// A point in which curves begin and end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurvePoint {
    /// A vertex of the surface there.
    pub vertex: VertexId,
    /// Whether curves meet, change or turn sharply there; if not, it is where one closed curve happens to begin.
    pub corner: bool,
}

/// A curve as a chart's loop passes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Passage {
    /// The curve.
    pub curve: CurveId,
    /// Whether the loop runs in the direction of the curve.
    pub forward: bool,
}

impl Curve {
    /// The number of this curve in its network.
    pub fn id(&self) -> CurveId {
        self.id
    }

    /// The vertices of the surface along the curve, from begin to end; those of the first side where several sheets
    /// meet. A closed curve has its first vertex again at the end (or a copy of it).
    pub fn vertices(&self) -> &[VertexId] {
        &self.vertices
    }

    /// The number of segments.
    pub fn segments(&self) -> usize {
        self.vertices.len() - 1
    }

    /// Begin and end, as positions in [`SeamNetwork::points`].
    pub fn ends(&self) -> [usize; 2] {
        self.ends
    }

    /// The charts beside the curve, ascending; one chart may be there twice. The first runs forward.
    pub fn sides(&self) -> &[CurveSide] {
        &self.sides
    }

    /// The length in the unit of the input.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// Whether the curve ends where it begins.
    pub fn is_closed(&self) -> bool {
        self.ends[0] == self.ends[1]
    }

    /// Whether the curve is open boundary of the surface: one chart lies beside it. If not, it is a seam.
    pub fn is_open(&self) -> bool {
        self.sides.len() == 1
    }
}

impl SeamNetwork {
    /// Finds the curves of `charts`, which are those of an atlas of `mesh`, in order. Corners at which an edge of the shape
    /// turns sharply are taken if they are no nearer than `spacing` (in the unit of the input) to others along the curve.
    ///
    /// # Panics
    /// If the number of a chart is not its position: [`crate::CertifiedAtlas::gather`] sees to it.
    pub fn new<C: AsRef<Chart>>(mesh: &SurfaceMesh, charts: &[C], spacing: f64) -> Self {
        let charts: &[&Chart] = &charts.iter().map(AsRef::as_ref).collect::<Vec<_>>();
        assert!(charts.iter().zip(0..).all(|(chart, id)| chart.id().0 == id), "charts are numbered in their order");
        let boundary = Boundary::new(mesh, charts);
        let mut corner = boundary.corners();
        kinks::mark(mesh, charts, &boundary, spacing, &mut corner);
        let mut network = Tracer::new(mesh, &boundary, &corner, charts.len()).trace();
        network.neighbours = network.find_neighbours(charts.len());
        network
    }

    /// The curves, in the order of their ids.
    pub fn curves(&self) -> &[Curve] {
        &self.curves
    }

    /// Where curves begin and end.
    pub fn points(&self) -> &[CurvePoint] {
        &self.points
    }

    /// The loops of a chart, the outer one first, each as the curves that it passes.
    pub fn loops(&self, chart: ChartId) -> &[Vec<Passage>] {
        &self.loops[chart.index()]
    }

    /// The charts that share a seam with `chart`, ascending.
    pub fn neighbours(&self, chart: ChartId) -> &[ChartId] {
        &self.neighbours[chart.index()]
    }

    /// Per chart a small number that differs from those of its neighbours: the least that none of those before it has.
    pub fn colours(&self) -> Vec<u32> {
        let mut colours: Vec<u32> = Vec::with_capacity(self.neighbours.len());
        for neighbours in &self.neighbours {
            let mut taken: Vec<u32> = neighbours.iter().filter_map(|c| colours.get(c.index()).copied()).collect();
            taken.sort_unstable();
            taken.dedup();
            // Sorted and without repetitions: the first number that is not at its own position is missing from it.
            colours.push(taken.iter().zip(0..).find(|(t, i)| **t != *i).map_or(taken.len() as u32, |(_, i)| i));
        }
        colours
    }

    /// The curves that are seams: two or more charts lie beside them.
    pub fn seams(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|c| !c.is_open())
    }

    /// The connected parts of the open boundary, each as its curves, in the order of their first ones.
    pub fn open_parts(&self) -> Vec<Vec<CurveId>> {
        let open: Vec<&Curve> = self.curves.iter().filter(|curve| curve.is_open()).collect();
        let mut joined = UnionFind::new(self.points.len());
        open.iter().for_each(|curve| {
            joined.merge(curve.ends[0], curve.ends[1]);
        });
        let mut part_of_point: Vec<Option<usize>> = vec![None; self.points.len()];
        let mut parts: Vec<Vec<CurveId>> = Vec::new();
        for curve in open {
            let part = *part_of_point[joined.find(curve.ends[0])].get_or_insert_with(|| {
                parts.push(Vec::new());
                parts.len() - 1
            });
            parts[part].push(curve.id);
        }
        parts
    }

    fn find_neighbours(&self, charts: usize) -> Vec<Vec<ChartId>> {
        let mut neighbours = vec![Vec::new(); charts];
        for curve in self.seams() {
            let beside = || curve.sides.iter().map(|s| s.chart);
            for chart in beside() {
                neighbours[chart.index()].extend(beside().filter(|other| *other != chart));
            }
        }
        for list in &mut neighbours {
            list.sort_unstable();
            list.dedup();
        }
        neighbours
    }
}

/// A boundary half-edge of a chart, between welded vertices.
#[derive(Clone, Copy)]
struct Step {
    chart: ChartId,
    half_edge: HalfEdgeId,
    ends: [VertexId; 2],
    from: u32,
    to: u32,
}

impl Step {
    fn key(&self) -> (u32, u32) {
        (self.from.min(self.to), self.from.max(self.to))
    }
}

/// The boundary half-edges of all charts, loop after loop, grouped into segments.
struct Boundary {
    steps: Vec<Step>,
    /// Per chart, its loops as ranges of `steps`.
    loops: Vec<Vec<std::ops::Range<usize>>>,
    /// The segment of each step.
    segment_of: Vec<u32>,
    /// The steps of each segment, ascending.
    by_segment: Csr<u32>,
    /// All welded vertices are below this.
    welded: usize,
}

impl Boundary {
    fn new(mesh: &SurfaceMesh, charts: &[&Chart]) -> Self {
        let mut steps = Vec::new();
        let mut loops = Vec::new();
        for chart in charts {
            let all = std::iter::once(chart.outer()).chain(chart.holes().iter().map(Vec::as_slice));
            let add = |boundary_loop: &[HalfEdgeId]| {
                let first = steps.len();
                steps.extend(boundary_loop.iter().map(|h| step(mesh, chart, *h)));
                first..steps.len()
            };
            loops.push(all.map(add).collect());
        }
        let (segment_of, by_segment) = segments(&steps);
        let welded = steps.iter().map(|s| s.key().1 as usize + 1).max().unwrap_or(0);
        Self { steps, loops, segment_of, by_segment, welded }
    }

    fn charts(&self, segment: u32) -> impl Iterator<Item = ChartId> {
        self.by_segment.row(segment as usize).iter().map(|s| self.steps[*s as usize].chart)
    }

    /// Per welded vertex, whether it is a corner.
    fn corners(&self) -> Vec<bool> {
        let ends = |(segment, steps): (u32, &[u32])| {
            let (low, high) = self.steps[steps[0] as usize].key();
            [(low, segment), (high, segment)]
        };
        let mut ends: Vec<(u32, u32)> = (0..).zip(self.by_segment.rows()).flat_map(ends).collect();
        ends.sort_unstable();
        let mut corner = vec![false; self.welded];
        for at in ends.chunk_by(|a, b| a.0 == b.0) {
            // Two segments meet, with the same charts beside both, and no chart is there twice.
            let runs_on = at.len() == 2 && self.charts(at[0].1).eq(self.charts(at[1].1)) && self.charts_once(at[0].1);
            corner[at[0].0 as usize] = !runs_on;
        }
        corner
    }

    /// Whether no chart lies twice beside a segment.
    fn charts_once(&self, segment: u32) -> bool {
        self.charts(segment).is_sorted_by(|a, b| a < b)
    }
}

fn step(mesh: &SurfaceMesh, chart: &Chart, h: HalfEdgeId) -> Step {
    let vertex = |h: HalfEdgeId| chart.vertices()[chart.from(h).index()];
    let ends = [vertex(h), vertex(h.next())];
    let [from, to] = ends.map(|v| mesh.welded_vertex(v));
    Step { chart: chart.id(), half_edge: h, ends, from, to }
}

/// Per step its segment, and per segment its steps.
fn segments(steps: &[Step]) -> (Vec<u32>, Csr<u32>) {
    let mut order: Vec<((u32, u32), u32)> = steps.iter().map(Step::key).zip(0..).collect();
    order.sort_unstable();
    let mut segment_of = vec![0; steps.len()];
    let mut by_segment = Csr::with_capacity(steps.len());
    for same in order.chunk_by(|a, b| a.0 == b.0) {
        same.iter().for_each(|(_, s)| segment_of[*s as usize] = by_segment.len() as u32);
        by_segment.push_row(same.iter().map(|(_, s)| *s));
    }
    (segment_of, by_segment)
}

/// Where a segment lies in its curve, and from which welded vertex it runs there.
#[derive(Clone, Copy)]
struct Placed {
    curve: CurveId,
    position: usize,
    from: u32,
}

/// Follows the loops of all charts and makes curves of the runs between corners.
struct Tracer<'a> {
    mesh: &'a SurfaceMesh,
    boundary: &'a Boundary,
    corner: &'a [bool],
    placed: Vec<Option<Placed>>,
    point_at: Vec<Option<usize>>,
    network: SeamNetwork,
}

impl<'a> Tracer<'a> {
    fn new(mesh: &'a SurfaceMesh, boundary: &'a Boundary, corner: &'a [bool], charts: usize) -> Self {
        let network = SeamNetwork { loops: vec![Vec::new(); charts], ..SeamNetwork::default() };
        let placed = vec![None; boundary.by_segment.len()];
        Self { mesh, boundary, corner, placed, point_at: vec![None; corner.len()], network }
    }

    fn trace(mut self) -> SeamNetwork {
        let boundary = self.boundary;
        for (chart, loops) in boundary.loops.iter().enumerate() {
            for boundary_loop in loops {
                let passages = self.runs(boundary_loop.clone()).iter().map(|run| self.pass(run)).collect();
                self.network.loops[chart].push(passages);
            }
        }
        self.network
    }

    /// A loop cut at its corners; whole where it has none.
    fn runs(&self, boundary_loop: std::ops::Range<usize>) -> Vec<Vec<usize>> {
        let steps: Vec<usize> = boundary_loop.collect();
        cut_at_corners(&steps, |s| self.corner[self.boundary.steps[*s].from as usize])
    }

    /// Adds a run of a loop to its curve, which is made where the run is the first one there.
    fn pass(&mut self, run: &[usize]) -> Passage {
        let first = self.boundary.steps[run[0]];
        let there = self.placed[self.boundary.segment_of[run[0]] as usize];
        let (curve, forward) = there.map_or_else(|| (self.begin(run), true), |p| (p.curve, p.from == first.from));
        let mut run = run.to_vec();
        if !forward {
            run.reverse();
        }
        // A loop without corners may begin anywhere along the curve.
        let position = self.placed[self.boundary.segment_of[run[0]] as usize].map_or(0, |p| p.position);
        let count = run.len();
        run.rotate_left((count - position) % count);
        let half_edges = run.iter().map(|s| self.boundary.steps[*s].half_edge).collect();
        self.network.curves[curve.index()].sides.push(CurveSide { chart: first.chart, half_edges, forward });
        Passage { curve, forward }
    }

    /// Makes a curve of a run.
    fn begin(&mut self, run: &[usize]) -> CurveId {
        let id = CurveId::at(self.network.curves.len());
        let ends = |s: &usize| self.boundary.steps[*s].ends;
        // Of every half-edge the begin, and of the last one the end, too.
        let last = run.iter().rev().take(1).map(|s| ends(s)[1]);
        let vertices: Vec<VertexId> = run.iter().map(|s| ends(s)[0]).chain(last).collect();
        for (position, s) in run.iter().enumerate() {
            let from = self.boundary.steps[*s].from;
            self.placed[self.boundary.segment_of[*s] as usize] = Some(Placed { curve: id, position, from });
        }
        let ends = [vertices[0], vertices[vertices.len() - 1]].map(|v| self.point(v));
        let length = self.length(&vertices);
        self.network.curves.push(Curve { id, vertices, ends, sides: vec![], length });
        id
    }

    fn point(&mut self, vertex: VertexId) -> usize {
        let welded = self.mesh.welded_vertex(vertex) as usize;
        let points = &mut self.network.points;
        *self.point_at[welded].get_or_insert_with(|| {
            points.push(CurvePoint { vertex, corner: self.corner[welded] });
            points.len() - 1
        })
    }

    /// The length of a polyline, measured where squares neither overflow nor underflow.
    fn length(&self, vertices: &[VertexId]) -> f64 {
        let scale = self.mesh.metric().scale;
        let place = |v: VertexId| self.mesh.points()[v.index()].map(|c| c * scale);
        vertices.windows(2).map(|w| distance(place(w[0]), place(w[1]))).sum::<f64>() / scale
    }
}

#[cfg(test)]
pub(crate) mod tests;
