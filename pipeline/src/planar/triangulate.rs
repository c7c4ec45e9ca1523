//! The triangulation inside the polygon of a chart: the only file that names `spade`.

use super::lattice::{self, Node};
use super::metric::{Field, Metric, on_side};
use super::spacing::{Boundary, BoundaryNode};
use super::{Error, PlaneMesh, PolygonSide};
use crate::evaluate::{Bvh, on_segment};
use crate::grid::GridPoint;
use crate::topology::{ChartId, VertexId};
use crate::vec3::{BoundingBox, Vec3};
use spade::{ConstrainedDelaunayTriangulation, HasPosition, Point2, Triangulation};

/// Nodes inside are no nearer to a chord than this share of its length: they would make needles, which a mesher has to undo.
const CLEAR: f64 = 0.25;

/// A node of the triangulation, by its number.
struct Numbered {
    at: Point2<f64>,
    number: u32,
}

impl HasPosition for Numbered {
    type Scalar = f64;

    fn position(&self) -> Point2<f64> {
        self.at
    }
}

/// The mesh of the plane of a chart with this polygon, which is simple and rightly nested.
///
/// # Errors
/// [`Error::Untriangulated`].
pub(super) fn plane_mesh(chart: ChartId, boundary: Boundary, field: &Field) -> Result<PlaneMesh, Error> {
    let sides = sides(&boundary);
    let of_boundary: Vec<BoundaryNode> = boundary.loops.into_iter().flatten().collect();
    let mut nodes: Vec<Node> = of_boundary.iter().map(|n| node_of_boundary(n, field)).collect();
    let inner = clear_of(lattice::nodes(field), &sides, &nodes);
    nodes.extend(inner);
    let found = triangles(&nodes, &sides).ok_or(Error::Untriangulated { chart })?;
    let (triangles, used) = compacted(found, of_boundary.len(), nodes.len());
    let kept = || used.iter().map(|n| nodes[*n as usize]);
    Ok(PlaneMesh {
        chart,
        uv: kept().map(|n| n.uv).collect(),
        metric: kept().map(|n| n.metric).collect(),
        triangles,
        sides,
        shared: of_boundary.iter().map(|n| n.shared).collect(),
    })
}

/// The sides of all loops, whose nodes are numbered one after another.
fn sides(boundary: &Boundary) -> Vec<PolygonSide> {
    let mut sides = Vec::new();
    for nodes in &boundary.loops {
        let (first, count) = (sides.len(), nodes.len());
        for (i, node) in nodes.iter().enumerate() {
            let ends = [first + i, first + (i + 1) % count].map(|n| n as u32);
            sides.push(PolygonSide { ends, curve: node.chord.0 });
        }
    }
    sides
}

fn node_of_boundary(node: &BoundaryNode, field: &Field) -> Node {
    let chart = field.certified.chart();
    let metric: Metric = if node.t == 0.0 {
        let corner: VertexId = chart.from(node.on);
        field.at_vertex(corner)
    } else {
        field.inside(node.on.face().0, on_side(node.on, node.t))
    };
    Node { uv: node.uv.uv(), metric }
}

/// Those of the nodes inside that are no nearer to a chord than is good, on the grid.
fn clear_of(inner: Vec<Node>, sides: &[PolygonSide], boundary: &[Node]) -> Vec<Node> {
    let chord = |side: u32| sides[side as usize].ends.map(|n| in_space(boundary[n as usize].uv));
    let chords = Bvh::new((0..sides.len() as u32).map(|side| {
        let [a, b] = chord(side);
        BoundingBox { min: [0, 1, 2].map(|k| a[k].min(b[k])), max: [0, 1, 2].map(|k| a[k].max(b[k])) }
    }));
    let is_clear = |node: &Node| {
        let x = in_space(node.uv);
        let nearest = chords.nearest(x, f64::INFINITY, |side| on_segment(x, chord(side)).squared);
        nearest.is_none_or(|(side, squared)| {
            let [a, b] = chord(side);
            let length = (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>();
            squared > CLEAR * CLEAR * length
        })
    };
    let on_grid = |node: Node| Node { uv: GridPoint::mid(node.uv).uv(), ..node };
    let mut kept: Vec<Node> = inner.into_iter().map(on_grid).filter(is_clear).collect();
    // Maps may be so shrunk that nodes come to lie on each other.
    kept.sort_by(|a, b| a.uv[0].total_cmp(&b.uv[0]).then(a.uv[1].total_cmp(&b.uv[1])));
    kept.dedup_by(|a, b| a.uv == b.uv);
    kept
}

fn in_space([u, v]: [f64; 2]) -> Vec3 {
    [u, v, 0.0]
}

/// The triangles inside the polygon, by nodes; none where rounding keeps it from being triangulated.
fn triangles(nodes: &[Node], sides: &[PolygonSide]) -> Option<Vec<[u32; 3]>> {
    let numbered = |(n, number): (&Node, u32)| Numbered { at: Point2::new(n.uv[0], n.uv[1]), number };
    let vertices: Vec<Numbered> = nodes.iter().zip(0..).map(numbered).collect();
    let constraints = sides.iter().map(|side| side.ends.map(|n| n as usize)).collect();
    let mut conflicts = 0;
    let all =
        ConstrainedDelaunayTriangulation::<Numbered>::try_bulk_load_cdt(vertices, constraints, |_| conflicts += 1);
    let all = all.ok().filter(|all| conflicts == 0 && all.num_vertices() == nodes.len())?;
    let is_inside = inside(&all);
    let mut triangles = Vec::new();
    for face in all.inner_faces().filter(|face| is_inside[face.fix().index()]) {
        triangles.push(face.vertices().map(|v| v.data().number));
    }
    Some(triangles)
}

/// Per face whether it is inside the polygon: an odd number of sides lies between it and the outside.
fn inside(all: &ConstrainedDelaunayTriangulation<Numbered>) -> Vec<bool> {
    // Per face the faces around it, and whether a side lies between.
    let mut beside: Vec<Vec<(usize, bool)>> = vec![Vec::new(); all.num_all_faces()];
    for edge in all.directed_edges() {
        beside[edge.face().fix().index()].push((edge.rev().face().fix().index(), edge.is_constraint_edge()));
    }
    let mut is_inside: Vec<Option<bool>> = vec![None; all.num_all_faces()];
    let outer = all.outer_face().fix().index();
    is_inside[outer] = Some(false);
    let mut waiting = vec![outer];
    while let Some(face) = waiting.pop() {
        let here = is_inside[face] == Some(true);
        for &(next, is_side) in &beside[face] {
            if is_inside[next].is_none() {
                is_inside[next] = Some(here != is_side);
                waiting.push(next);
            }
        }
    }
    is_inside.into_iter().map(|inside| inside == Some(true)).collect()
}

/// The triangles over the nodes that they have, numbered in their order after those of the boundary; and these nodes.
fn compacted(triangles: Vec<[u32; 3]>, boundary: usize, nodes: usize) -> (Vec<[u32; 3]>, Vec<u32>) {
    let mut is_used = vec![false; nodes];
    is_used[..boundary].fill(true);
    triangles.iter().flatten().for_each(|n| is_used[*n as usize] = true);
    let used: Vec<u32> = (0..nodes as u32).filter(|n| is_used[*n as usize]).collect();
    let mut number = vec![0; nodes];
    used.iter().zip(0..).for_each(|(node, new)| number[*node as usize] = new);
    (triangles.into_iter().map(|t| t.map(|n| number[n as usize])).collect(), used)
}
