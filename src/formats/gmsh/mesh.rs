//! `$Nodes` and `$Elements`: the input triangulation, so that the atlas shows in Gmsh before it is remeshed, and
//! other programs read it as a mesh. Gmsh replaces it when it remeshes.
//!
//! Elements are those of entities that are in a group, as in the files of Gmsh: meshio 5.3 refuses files in which some are and
//! some are not.

use super::Binary;
use super::groups::{Group, tags_of};
use planish_core::CertifiedChart;
use planish_core::seams::{Curve, SeamNetwork};
use planish_core::subdivide::LinearAtlas;

/// Gmsh's numbers of element types: line, triangle, point.
const LINE: i32 = 1;
const TRIANGLE: i32 = 2;
const POINT: i32 = 15;

/// The nodes and elements of one entity.
struct Block {
    dimension: i32,
    entity: usize,
    kind: i32,
    /// The nodes that belong to the entity and to none of lower dimension.
    nodes: Vec<u32>,
    /// The nodes of the elements, one element after the other.
    elements: Vec<u32>,
}

/// Appends both sections.
pub fn write(
    out: &mut Binary,
    charts: &[CertifiedChart],
    linear: &LinearAtlas,
    network: &SeamNetwork,
    groups: &[Group],
) {
    let (mut blocks, number) = blocks(charts, linear, network);
    out.section("Nodes", |out| nodes(out, &blocks, linear));
    let of_curves = tags_of(groups, 1, network.curves().len());
    blocks.retain(|block| match block.dimension {
        0 => false,
        1 => !of_curves[block.entity].is_empty(),
        _ => true,
    });
    out.section("Elements", |out| elements(out, &blocks, &number));
}

/// The blocks of points, curves and surfaces, and the number of each node of the atlas, from 1 in their order.
fn blocks(charts: &[CertifiedChart], linear: &LinearAtlas, network: &SeamNetwork) -> (Vec<Block>, Vec<u64>) {
    let mut blocks = Vec::new();
    for (entity, node) in super::point_nodes(linear, network).into_iter().enumerate() {
        blocks.push(Block { dimension: 0, entity, kind: POINT, nodes: Vec::new(), elements: vec![node] });
    }
    for curve in network.curves() {
        let elements = lines(curve, charts, linear);
        blocks.push(Block { dimension: 1, entity: curve.id().index(), kind: LINE, nodes: Vec::new(), elements });
    }
    for (entity, (chart, linear)) in charts.iter().zip(linear.charts()).enumerate() {
        let corners = chart.chart().triangles().iter().flatten();
        let elements = corners.map(|vertex| linear.nodes()[vertex.index()]).collect();
        blocks.push(Block { dimension: 2, entity, kind: TRIANGLE, nodes: Vec::new(), elements });
    }
    let number = give_nodes(&mut blocks, linear.points().len());
    (blocks, number)
}

/// Gives each node to the first block that has it: blocks ascend in dimension, so that is the entity of the lowest one.
/// The number of each node, from 1 in the order in which they are given; 0 for those of no element.
fn give_nodes(blocks: &mut [Block], count: usize) -> Vec<u64> {
    let mut number = vec![0; count];
    let mut last = 0;
    for block in blocks {
        for node in &block.elements {
            if number[*node as usize] == 0 {
                last += 1;
                number[*node as usize] = last;
                block.nodes.push(*node);
            }
        }
    }
    number
}

/// The edges of the surface along a curve.
fn lines(curve: &Curve, charts: &[CertifiedChart], linear: &LinearAtlas) -> Vec<u32> {
    // All sides run along the same edges: any of them will do.
    let side = &curve.sides()[0];
    let chart = charts[side.chart.index()].chart();
    let nodes = linear.charts()[side.chart.index()].nodes();
    let mut lines = Vec::with_capacity(2 * side.half_edges.len());
    for half_edge in &side.half_edges {
        for end in [*half_edge, half_edge.next()] {
            lines.push(nodes[chart.from(end).index()]);
        }
    }
    lines
}

fn nodes(out: &mut Binary, blocks: &[Block], linear: &LinearAtlas) {
    let total = blocks.iter().map(|b| b.nodes.len()).sum();
    header(out, blocks.len(), total);
    let mut last = 0;
    for block in blocks {
        out.int(block.dimension);
        out.int(block.entity as i32 + 1);
        // Not parametric: other readers stumble over parameters, and remeshing does not use them.
        out.int(0);
        out.size(block.nodes.len());
        for _ in &block.nodes {
            last += 1;
            out.size(last);
        }
        for node in &block.nodes {
            out.point(linear.points()[*node as usize]);
        }
    }
}

fn elements(out: &mut Binary, blocks: &[Block], number: &[u64]) {
    let total = blocks.iter().map(|block| block.elements.len() / corners(block.kind)).sum();
    header(out, blocks.len(), total);
    let mut last = 0;
    for block in blocks {
        out.int(block.dimension);
        out.int(block.entity as i32 + 1);
        out.int(block.kind);
        out.size(block.elements.len() / corners(block.kind));
        for element in block.elements.chunks_exact(corners(block.kind)) {
            last += 1;
            out.size(last);
            for node in element {
                out.size(number[*node as usize] as usize);
            }
        }
    }
}

/// How many nodes an element of this kind has.
fn corners(kind: i32) -> usize {
    match kind {
        POINT => 1,
        LINE => 2,
        _ => 3,
    }
}

/// Number of blocks and of entries, least and largest tag.
pub(super) fn header(out: &mut Binary, blocks: usize, total: usize) {
    for number in [blocks, total, 1, total] {
        out.size(number);
    }
}
