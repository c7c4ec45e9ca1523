//! Is every chart of a result what a chart must be? Decided from the published surface.vtu alone, by code that shares
//! nothing with the decomposition.
//!
//! Within a chart: connected through edges; every edge in one triangle or in two, which traverse it in opposite
//! directions and share its middle node; one fan of triangles around every vertex (so boundary loops are simple and
//! share no vertex); at least one loop, and vertices - edges + triangles = 2 - loops, which is genus 0. Between charts:
//! no node in common. In space: no two boundary edges of one chart coincide. Against the report: every triangle of the
//! surface is there, with its area, and the charts glued along their seams have the Euler number of the surface.

use crate::support::{Out, fixture};
use planish::formats::vtu::{self, Grid};
use planish::report::Report;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A point of the surface: a vertex of the input, or the position of a vertex that planish added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Place {
    Vertex(i32),
    Added([u64; 3]),
}

/// What is wrong with a chart, with the evidence: nodes and cells are those of the file.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Flaw {
    /// A node of two charts.
    NodeShared { node: u32, charts: BTreeSet<i32> },
    /// A chart of several parts.
    Apart { chart: i32, parts: usize },
    /// An edge of three or more triangles.
    Crowded { chart: i32, edge: [u32; 2], triangles: usize },
    /// An edge whose triangles traverse it in the same direction.
    Turned { chart: i32, edge: [u32; 2] },
    /// An edge whose triangles have different middle nodes.
    Cracked { chart: i32, edge: [u32; 2] },
    /// A vertex where several fans of triangles, so loops or sheets, touch.
    Pinched { chart: i32, node: u32, fans: usize },
    /// A chart without boundary.
    Closed { chart: i32 },
    /// A chart with handles (not told where a vertex is pinched).
    Handle { chart: i32, loops: usize, euler: i64 },
    /// Boundary edges of one chart at the same place.
    MeetsItself { chart: i32, edge: [Place; 2] },
    /// A corner that is marked as the middle of an edge.
    NoVertex { node: u32 },
}

/// Side `side` of cell `cell`, from its corner `side` to the next one.
#[derive(Clone, Copy, Debug)]
struct Side {
    cell: usize,
    side: usize,
}

impl Side {
    fn from(self, grid: &Grid) -> u32 {
        grid.cells[self.cell][self.side]
    }

    fn to(self, grid: &Grid) -> u32 {
        grid.cells[self.cell][(self.side + 1) % 3]
    }

    fn middle(self, grid: &Grid) -> u32 {
        grid.cells[self.cell][3 + self.side]
    }

    /// The number of its corner at `node`, among three per cell.
    fn corner(self, grid: &Grid, node: u32) -> usize {
        3 * self.cell + if self.from(grid) == node { self.side } else { (self.side + 1) % 3 }
    }
}

/// The sides of some cells, by edge.
type Edges = BTreeMap<[u32; 2], Vec<Side>>;

fn edges(grid: &Grid, cells: &[usize]) -> Edges {
    let mut edges = Edges::new();
    for side in cells.iter().flat_map(|&cell| (0..3).map(move |side| Side { cell, side })) {
        edges.entry(sorted(side.from(grid), side.to(grid))).or_default().push(side);
    }
    edges
}

fn sorted<T: Ord>(a: T, b: T) -> [T; 2] {
    if a <= b { [a, b] } else { [b, a] }
}

/// Sets of things that are joined pair by pair.
struct Sets(Vec<usize>);

impl Sets {
    fn new(things: usize) -> Self {
        Self((0..things).collect())
    }

    fn root(&mut self, mut thing: usize) -> usize {
        while self.0[thing] != thing {
            self.0[thing] = self.0[self.0[thing]];
            thing = self.0[thing];
        }
        thing
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a] = b;
    }

    /// In how many sets these things are.
    fn count(&mut self, things: impl IntoIterator<Item = usize>) -> usize {
        things.into_iter().map(|t| self.root(t)).collect::<BTreeSet<_>>().len()
    }
}

fn place(grid: &Grid, node: u32) -> Place {
    let node = node as usize;
    match grid.vertex[node] {
        // Zero and minus zero are one place.
        -2 => Place::Added(grid.points[node].map(|c| (c + 0.0).to_bits())),
        vertex => Place::Vertex(vertex),
    }
}

/// The cells of every chart.
fn charts(grid: &Grid) -> BTreeMap<i32, Vec<usize>> {
    let mut charts: BTreeMap<i32, Vec<usize>> = BTreeMap::new();
    grid.chart.iter().enumerate().for_each(|(cell, chart)| charts.entry(*chart).or_default().push(cell));
    charts
}

/// Everything that is wrong with the charts of a grid.
fn flaws(grid: &Grid) -> Vec<Flaw> {
    let mut found = shared_nodes(grid);
    for (chart, cells) in charts(grid) {
        found.extend(flaws_of(grid, chart, &cells));
    }
    found
}

fn shared_nodes(grid: &Grid) -> Vec<Flaw> {
    let mut owners = vec![BTreeSet::new(); grid.points.len()];
    for (cell, chart) in grid.cells.iter().zip(&grid.chart) {
        cell.iter().for_each(|n| _ = owners[*n as usize].insert(*chart));
    }
    let shared = (0..).zip(owners).filter(|(_, charts)| charts.len() > 1);
    shared.map(|(node, charts)| Flaw::NodeShared { node, charts }).collect()
}

fn flaws_of(grid: &Grid, chart: i32, cells: &[usize]) -> Vec<Flaw> {
    let edges = edges(grid, cells);
    let mut found: Vec<Flaw> = edges.iter().filter_map(|(e, sides)| flaw_of_edge(grid, chart, *e, sides)).collect();
    let parts = parts(cells, &edges);
    if parts != 1 {
        found.push(Flaw::Apart { chart, parts });
    }
    let pinches = pinches(grid, chart, cells, &edges);
    let (loops, euler) = (loops(grid, &edges), euler(grid, cells, &edges));
    if loops == 0 {
        found.push(Flaw::Closed { chart });
    } else if pinches.is_empty() && euler != 2 - loops as i64 {
        found.push(Flaw::Handle { chart, loops, euler });
    }
    found.extend(pinches);
    found.extend(own_seams(grid, chart, &edges));
    let corners: BTreeSet<u32> = cells.iter().flat_map(|c| &grid.cells[*c][..3]).copied().collect();
    let unmarked = corners.into_iter().filter(|n| grid.vertex[*n as usize] == -1);
    found.extend(unmarked.map(|node| Flaw::NoVertex { node }));
    found
}

fn flaw_of_edge(grid: &Grid, chart: i32, edge: [u32; 2], sides: &[Side]) -> Option<Flaw> {
    match *sides {
        [_] => None,
        [a, b] if a.from(grid) == b.from(grid) => Some(Flaw::Turned { chart, edge }),
        [a, b] if a.middle(grid) != b.middle(grid) => Some(Flaw::Cracked { chart, edge }),
        [_, _] => None,
        _ => Some(Flaw::Crowded { chart, edge, triangles: sides.len() }),
    }
}

/// How many parts the cells form, joined by edges.
fn parts(cells: &[usize], edges: &Edges) -> usize {
    let mut sets = Sets::new(1 + cells.last().copied().unwrap_or(0));
    for pair in edges.values().flat_map(|sides| sides.windows(2)) {
        sets.join(pair[0].cell, pair[1].cell);
    }
    sets.count(cells.iter().copied())
}

/// Vertices with more than one fan: corners are joined across edges.
fn pinches(grid: &Grid, chart: i32, cells: &[usize], edges: &Edges) -> Vec<Flaw> {
    let mut sets = Sets::new(3 * (1 + cells.last().copied().unwrap_or(0)));
    for (edge, sides) in edges {
        for pair in sides.windows(2) {
            edge.iter().for_each(|n| sets.join(pair[0].corner(grid, *n), pair[1].corner(grid, *n)));
        }
    }
    let mut corners: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (cell, k) in cells.iter().flat_map(|c| (0..3).map(move |k| (*c, k))) {
        corners.entry(grid.cells[cell][k]).or_default().push(3 * cell + k);
    }
    let fans = corners.into_iter().map(|(node, corners)| (node, sets.count(corners)));
    fans.filter(|(_, fans)| *fans > 1).map(|(node, fans)| Flaw::Pinched { chart, node, fans }).collect()
}

/// The boundary edges of a chart.
fn rim(edges: &Edges) -> impl Iterator<Item = Side> {
    edges.values().filter(|sides| sides.len() == 1).map(|sides| sides[0])
}

/// How many loops the boundary has: its parts, which are loops where no vertex is pinched.
fn loops(grid: &Grid, edges: &Edges) -> usize {
    let mut sets = Sets::new(grid.points.len());
    rim(edges).for_each(|s| sets.join(s.from(grid) as usize, s.to(grid) as usize));
    sets.count(rim(edges).map(|s| s.from(grid) as usize))
}

fn euler(grid: &Grid, cells: &[usize], edges: &Edges) -> i64 {
    let vertices: BTreeSet<u32> = cells.iter().flat_map(|c| &grid.cells[*c][..3]).copied().collect();
    vertices.len() as i64 - edges.len() as i64 + cells.len() as i64
}

/// Boundary edges that coincide in space with another one of the same chart.
fn own_seams(grid: &Grid, chart: i32, edges: &Edges) -> Vec<Flaw> {
    let mut seen = BTreeSet::new();
    let places = rim(edges).map(|s| sorted(place(grid, s.from(grid)), place(grid, s.to(grid))));
    places.filter(|edge| !seen.insert(*edge)).map(|edge| Flaw::MeetsItself { chart, edge }).collect()
}

/// What the report and the grid say differently about the whole surface.
fn differences(grid: &Grid, report: &Report) -> Vec<String> {
    let mut found = Vec::new();
    let mut compare = |what: String, here: f64, told: f64| {
        if (here - told).abs() > 1e-9 * told.abs() {
            found.push(format!("{what}: {here} in the file, {told} in the report"));
        }
    };
    let charts = charts(grid);
    compare("charts".to_owned(), charts.len() as f64, report.charts.len() as f64);
    for chart in &report.charts {
        let cells = charts.get(&(chart.id as i32)).map_or(&[][..], |c| c);
        compare(format!("triangles of chart {}", chart.id), cells.len() as f64, chart.triangles as f64);
        compare(format!("loops of chart {}", chart.id), loops(grid, &edges(grid, cells)) as f64, chart.loops as f64);
    }
    let surface = &report.surface.as_ref().expect("a surface").repaired;
    let sources: BTreeSet<i32> = grid.triangle.iter().copied().collect();
    if report.refused_components.is_empty() {
        // Triangles that were cut at T-junctions are there several times.
        let added = report.repairs.as_ref().map_or(0, |r| r.triangles_added);
        compare("input triangles".to_owned(), (sources.len() + added) as f64, surface.counts.triangles as f64);
        compare("area".to_owned(), area(grid), surface.area);
        // Sheets that repair took apart still share the numbers of their vertices.
        if report.repairs.as_ref().is_some_and(|r| r.split_vertices == 0) {
            compare("Euler number".to_owned(), glued_euler(grid, &charts) as f64, surface.counts.euler as f64);
        }
    } else if sources.len() >= surface.counts.triangles {
        found.push("components were refused, and yet all triangles are there".to_owned());
    }
    found
}

/// The Euler number of the charts glued along their seams.
fn glued_euler(grid: &Grid, charts: &BTreeMap<i32, Vec<usize>>) -> i64 {
    let (mut inner, mut seams, mut on_rim) = (0, BTreeSet::new(), BTreeSet::new());
    for edges in charts.values().map(|cells| edges(grid, cells)) {
        inner += edges.values().filter(|sides| sides.len() > 1).count();
        seams.extend(rim(&edges).map(|s| sorted(place(grid, s.from(grid)), place(grid, s.to(grid)))));
        on_rim.extend(rim(&edges).flat_map(|s| [s.from(grid), s.to(grid)]));
    }
    // Vertices that were added inside of two sheets may lie at the same place: what is inside a chart is its own.
    let corners: BTreeSet<u32> = grid.cells.iter().flat_map(|c| &c[..3]).copied().collect();
    let own = |n: &u32| Some(*n).filter(|n| !on_rim.contains(n));
    let vertices: BTreeSet<(Option<u32>, Place)> = corners.iter().map(|n| (own(n), place(grid, *n))).collect();
    vertices.len() as i64 - (inner + seams.len()) as i64 + grid.cells.len() as i64
}

/// The area of the straight triangles, summed where squares neither overflow nor vanish.
fn area(grid: &Grid) -> f64 {
    let size = grid.points.iter().flatten().fold(0.0, |m: f64, c| m.max(c.abs())).max(f64::MIN_POSITIVE);
    let corner = |n: u32| grid.points[n as usize].map(|c| c / size);
    let one = |cell: &[u32; 6]| {
        let [p, q, r] = [corner(cell[0]), corner(cell[1]), corner(cell[2])];
        let (a, b) = ([0, 1, 2].map(|k| q[k] - p[k]), [0, 1, 2].map(|k| r[k] - p[k]));
        let normal = [0, 1, 2].map(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]);
        normal.iter().map(|c| c * c).sum::<f64>().sqrt() / 2.0
    };
    grid.cells.iter().map(one).sum::<f64>() * size * size
}

/// Every chart of a certified result is legal, and together they are the surface.
pub fn assert_legal(folder: &Path) {
    let flaws = flaws_of_result(folder);
    assert!(flaws.is_empty(), "{}: {} flaws: {:?}", folder.display(), flaws.len(), &flaws[..flaws.len().min(5)]);
}

/// What is wrong with the charts of a certified result, which are the surface.
fn flaws_of_result(folder: &Path) -> Vec<Flaw> {
    let read =
        |name: &str| std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{}: {name}: {e}", folder.display()));
    let report: Report = serde_json::from_slice(&read("report.json")).expect("a report");
    let grid = vtu::read(&read("surface.vtu")).unwrap_or_else(|e| panic!("{}: {e}", folder.display()));
    let differences = differences(&grid, &report);
    assert!(differences.is_empty(), "{}: {differences:?}", folder.display());
    flaws(&grid)
}

/// A grid of triangles of one chart. Nodes are numbered like the points, middles after them.
fn made(points: Vec<[f64; 3]>, triangles: &[[u32; 3]]) -> Grid {
    let mut grid = Grid { vertex: (0..points.len() as i32).collect(), points, ..Grid::default() };
    let mut middles = BTreeMap::new();
    for t in triangles {
        let mids = [0, 1, 2].map(|k| {
            let edge = sorted(t[k], t[(k + 1) % 3]);
            *middles.entry(edge).or_insert_with(|| {
                let [p, q] = edge.map(|n| grid.points[n as usize]);
                grid.points.push([0, 1, 2].map(|k| (p[k] + q[k]) / 2.0));
                grid.vertex.push(-1);
                grid.points.len() as u32 - 1
            })
        });
        grid.cells.push([t[0], t[1], t[2], mids[0], mids[1], mids[2]]);
    }
    grid.chart = vec![0; triangles.len()];
    grid.triangle = (0..triangles.len() as i32).collect();
    grid
}

/// `rows` x `columns` squares of two triangles, node `i * across + j`; a square names its rows and columns modulo
/// `down` and `across`, so that sides can be joined.
fn squares(rows: u32, columns: u32, down: u32, across: u32) -> Grid {
    let points = (0..down * across).map(|n| [f64::from(n / across), f64::from(n % across), 0.0]).collect();
    let node = |i: u32, j: u32| (i % down) * across + j % across;
    let two = |(i, j)| {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        [[a, b, c], [a, c, d]]
    };
    let all: Vec<[u32; 3]> = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))).flat_map(two).collect();
    made(points, &all)
}

/// A sheet of 5 x 5 squares: cells 2 (5 i + j) and the next one are square (i, j).
fn sheet() -> Grid {
    squares(5, 5, 6, 6)
}

/// The same without some cells.
fn without(grid: &Grid, cells: &[usize]) -> Grid {
    let keep = |c: &usize| !cells.contains(c);
    let kept: Vec<usize> = (0..grid.cells.len()).filter(keep).collect();
    Grid {
        points: grid.points.clone(),
        vertex: grid.vertex.clone(),
        cells: kept.iter().map(|c| grid.cells[*c]).collect(),
        chart: kept.iter().map(|c| grid.chart[*c]).collect(),
        triangle: kept.iter().map(|c| grid.triangle[*c]).collect(),
        ..Grid::default()
    }
}

/// Two grids in one file, the second one with charts of its own.
fn beside(mut a: Grid, b: Grid) -> Grid {
    let (nodes, next) = (a.points.len() as u32, a.chart.iter().max().map_or(0, |c| c + 1));
    a.points.extend(b.points);
    a.vertex.extend(b.vertex);
    a.cells.extend(b.cells.iter().map(|c| c.map(|n| n + nodes)));
    a.chart.extend(b.chart.iter().map(|c| c + next));
    a.triangle.extend(b.triangle);
    a
}

/// Gives nodes the vertex and the position of others.
fn glued(mut grid: Grid, pairs: impl IntoIterator<Item = (usize, usize)>) -> Grid {
    for (node, to) in pairs {
        grid.vertex[node] = grid.vertex[to];
        grid.points[node] = grid.points[to];
    }
    grid
}

#[test]
fn disks_annuli_and_charts_side_by_side_are_legal() {
    let annulus = without(&sheet(), &[24, 25]);
    // Two halves of a tube, which share both seams.
    let (half, other) = (squares(3, 4, 4, 5), squares(3, 4, 4, 5));
    let nodes = half.points.len();
    let tube =
        glued(beside(half, other), (0..4).flat_map(|i| [(nodes + 5 * i, 5 * i + 4), (nodes + 5 * i + 4, 5 * i)]));
    for grid in [sheet(), annulus, squares(3, 4, 4, 4), tube] {
        assert_eq!(flaws(&grid), []);
    }
}

#[test]
fn triangles_that_touch_at_a_vertex_are_no_chart() {
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]];
    let grid = made(points, &[[0, 1, 2], [0, 3, 4]]);
    let found = flaws(&grid);
    assert!(found.contains(&Flaw::Apart { chart: 0, parts: 2 }), "{found:?}");
    assert!(found.contains(&Flaw::Pinched { chart: 0, node: 0, fans: 2 }), "{found:?}");
}

#[test]
fn loops_must_not_touch() {
    // Squares (1, 1) and (2, 2) have one vertex in common; triangle 11 has one vertex on the outer loop, triangle 12 none.
    let holes = without(&sheet(), &[12, 13, 24, 25]);
    assert_eq!(flaws(&holes), [Flaw::Pinched { chart: 0, node: 14, fans: 2 }]);
    assert_eq!(flaws(&without(&sheet(), &[12])), []);
    assert_eq!(flaws(&without(&sheet(), &[11])), [Flaw::Pinched { chart: 0, node: 6, fans: 2 }]);
}

#[test]
fn a_strip_closed_on_itself_meets_itself_along_a_seam() {
    let grid = glued(squares(3, 4, 4, 5), (0..4).map(|i| (5 * i + 4, 5 * i)));
    let found = flaws(&grid);
    assert_eq!(found.len(), 3, "{found:?}");
    let edge = [Place::Vertex(0), Place::Vertex(5)];
    assert!(found.contains(&Flaw::MeetsItself { chart: 0, edge }), "{found:?}");
}

#[test]
fn vertices_that_planish_added_are_known_by_their_position() {
    let mut grid = glued(squares(3, 4, 4, 5), (0..4).map(|i| (5 * i + 4, 5 * i)));
    for node in (0..4).flat_map(|i| [5 * i, 5 * i + 4]) {
        grid.vertex[node] = -2;
    }
    assert!(matches!(flaws(&grid)[..], [Flaw::MeetsItself { .. }, Flaw::MeetsItself { .. }, Flaw::MeetsItself { .. }]));
    grid.points[9][0] += 1e-15;
    assert!(matches!(flaws(&grid)[..], [Flaw::MeetsItself { .. }]), "two of the three edges end there");
}

#[test]
fn handles_and_closed_surfaces_are_no_charts() {
    let torus = squares(4, 4, 4, 4);
    assert_eq!(flaws(&torus), [Flaw::Closed { chart: 0 }]);
    assert_eq!(flaws(&without(&torus, &[7])), [Flaw::Handle { chart: 0, loops: 1, euler: -1 }]);
}

#[test]
fn edges_must_be_those_of_an_oriented_surface() {
    let mut turned = sheet();
    turned.cells[24] = [0, 2, 1, 5, 4, 3].map(|k| turned.cells[24][k]);
    let found = flaws(&turned);
    assert!(found.len() == 3 && found.iter().all(|f| matches!(f, Flaw::Turned { .. })), "{found:?}");

    let mut twice = sheet();
    twice.cells.push(twice.cells[24]);
    twice.chart.push(0);
    twice.triangle.push(24);
    assert!(flaws(&twice).iter().any(|f| matches!(f, Flaw::Crowded { triangles: 3, .. })));

    let mut cracked = sheet();
    cracked.points.push(cracked.points[cracked.cells[24][3] as usize]);
    cracked.vertex.push(-1);
    cracked.cells[24][3] = cracked.points.len() as u32 - 1;
    assert!(matches!(flaws(&cracked)[..], [Flaw::Cracked { .. }]), "{:?}", flaws(&cracked));

    let mut unmarked = sheet();
    unmarked.vertex[14] = -1;
    assert_eq!(flaws(&unmarked), [Flaw::NoVertex { node: 14 }]);
}

#[test]
fn charts_share_no_node() {
    let mut grid = sheet();
    grid.chart[0] = 1;
    let found = flaws(&grid);
    assert!(found.iter().any(|f| matches!(f, Flaw::NodeShared { node: 0, .. })), "{found:?}");
}

#[test]
fn a_triangle_that_is_missing_twice_there_or_in_another_chart_is_noticed() {
    let out = Out::new();
    assert_eq!(out.run(&[&fixture("disk_with_holes.stl")], &["-q"]).code, Some(0));
    let report = out.report("disk_with_holes.stl");
    let grid = vtu::read(&out.read("disk_with_holes.stl", "surface.vtu")).expect("readable");
    assert_eq!(differences(&grid, &report), [""; 0]);

    // A missing triangle at the rim leaves a legal chart.
    let at_rim = |c: &usize| edges(&grid, &[*c]).keys().any(|e| edges(&grid, &charts(&grid)[&0])[e].len() == 1);
    let gone = without(&grid, &[(0..grid.cells.len()).find(at_rim).expect("a triangle at the rim")]);
    let found = differences(&gone, &report);
    let told = |what: &str| found.iter().any(|d| d.starts_with(what));
    assert!(told("triangles of chart 0") && told("input triangles") && told("area"), "{found:?}");

    let mut renamed = without(&grid, &[]);
    renamed.triangle[0] = renamed.triangle[1];
    assert!(differences(&renamed, &report)[0].starts_with("input triangles"));

    let mut lies = report.clone();
    lies.charts[0].loops = 1;
    assert!(differences(&grid, &lies)[0].starts_with("loops of chart 0"));
    lies.surface.as_mut().expect("a surface").repaired.counts.euler += 2;
    assert!(differences(&grid, &lies)[1].starts_with("Euler number"));
}
