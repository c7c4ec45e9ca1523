//! `$Nodes` and `$Elements`: the input triangulation, so that the atlas shows in Gmsh before it is remeshed, and
//! other programs read it as a mesh. Gmsh replaces it when it remeshes.

use super::Binary;
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
pub fn write(out: &mut Binary, charts: &[CertifiedChart], linear: &LinearAtlas, network: &SeamNetwork) {
    let (blocks, number) = blocks(charts, linear, network);
    out.section("Nodes", |out| nodes(out, &blocks, linear));
    out.section("Elements", |out| elements(out, &blocks, &number));
}

/// The blocks of points, curves and surfaces, and the number of each node of the atlas, from 1 in their order.
fn blocks(charts: &[CertifiedChart], linear: &LinearAtlas, network: &SeamNetwork) -> (Vec<Block>, Vec<u64>) {
    let mut number = vec![0; linear.points().len()];
    let mut last = 0;
    let mut block = |dimension, entity, kind, elements: Vec<u32>| {
        let mut nodes = Vec::new();
        for n in &elements {
            if number[*n as usize] == 0 {
                last += 1;
                number[*n as usize] = last;
                nodes.push(*n);
            }
        }
        Block { dimension, entity, kind, nodes, elements }
    };
    let mut blocks = Vec::new();
    for (entity, node) in super::point_nodes(linear, network).into_iter().enumerate() {
        blocks.push(block(0, entity, POINT, vec![node]));
    }
    for curve in network.curves() {
        blocks.push(block(1, curve.id().index(), LINE, lines(curve, charts, linear)));
    }
    for (entity, (chart, l)) in charts.iter().zip(linear.charts()).enumerate() {
        let corners = chart.chart().triangles().iter().flatten().map(|v| l.nodes()[v.index()]);
        blocks.push(block(2, entity, TRIANGLE, corners.collect()));
    }
    (blocks, number)
}

/// The edges of the surface along a curve.
fn lines(curve: &Curve, charts: &[CertifiedChart], linear: &LinearAtlas) -> Vec<u32> {
    let side = &curve.sides()[0];
    let (chart, l) = (charts[side.chart.index()].chart(), &linear.charts()[side.chart.index()]);
    let node = |h| l.nodes()[chart.from(h).index()];
    side.half_edges.iter().flat_map(|h| [node(*h), node(h.next())]).collect()
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
        (1..=block.nodes.len()).for_each(|i| out.size(last + i));
        last += block.nodes.len();
        block.nodes.iter().for_each(|n| out.point(linear.points()[*n as usize]));
    }
}

fn elements(out: &mut Binary, blocks: &[Block], number: &[u64]) {
    let corners = |kind| match kind {
        POINT => 1,
        LINE => 2,
        _ => 3,
    };
    let total = blocks.iter().map(|b| b.elements.len() / corners(b.kind)).sum();
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
            element.iter().for_each(|n| out.size(number[*n as usize] as usize));
        }
    }
}

/// Number of blocks and of entries, least and largest tag.
fn header(out: &mut Binary, blocks: usize, total: usize) {
    [blocks, total, 1, total].into_iter().for_each(|n| out.size(n));
}
