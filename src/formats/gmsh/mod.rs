//! Gmsh: `atlas.msh`, through whose maps Gmsh remeshes, and `remesh.geo`, which tells it to.
//!
//! The encoders take a [`LinearAtlas`], which can only be made from certified maps.

mod binary;
mod geo;
mod groups;
mod made;
mod mesh;
mod pos;
mod read;

pub use geo::{Algorithms, Script, remesh};
pub use groups::Group;
pub use made::made;
pub use pos::{SizedTriangle, on_cubes, on_triangles};
pub use read::{AtlasError, read as read_atlas};

use binary::Binary;
use planish_core::CertifiedAtlas;
use planish_core::seams::SeamNetwork;
use planish_core::subdivide::{LinearAtlas, LinearChart};
use planish_core::topology::ChartId;
use planish_core::vec3::BoundingBox;

/// The bytes of `atlas.msh`: MSH 4.1, binary, little endian.
///
/// `$Entities` holds the boundary representation: a point for every end of a curve, its curves, a
/// surface per chart, and which physical groups these are in. `$Parametrizations` holds the curves as polylines and the charts as triangulations in space
/// and in the plane, there in their own size ([`LinearChart::uv_scale`]); see docs/gmsh.md for what Gmsh asks of it.
/// Tags are positions plus one.
pub fn atlas(atlas: &CertifiedAtlas, linear: &LinearAtlas, groups: &[Group]) -> Vec<u8> {
    let network = atlas.seams();
    let mut out = Binary::new();
    groups::names(&mut out, groups);
    out.section("Entities", |out| entities(out, linear, network, groups));
    mesh::write(&mut out, atlas.charts(), linear, network, groups);
    out.section("Parametrizations", |out| parametrizations(out, linear));
    out.bytes
}

/// The bytes of `atlas-enlarged.msh`: as [`atlas`], with all lengths multiplied by a power of two, and without the
/// triangles of the input.
pub fn enlarged(linear: &LinearAtlas, network: &SeamNetwork, groups: &[Group], factor: f64) -> Vec<u8> {
    let mut out = Binary { unit: factor, ..Binary::new() };
    groups::names(&mut out, groups);
    out.section("Entities", |out| entities(out, linear, network, groups));
    out.section("Parametrizations", |out| parametrizations(out, linear));
    out.bytes
}

fn entities(out: &mut Binary, linear: &LinearAtlas, network: &SeamNetwork, groups: &[Group]) {
    let curve_groups = groups::tags_of(groups, 1, network.curves().len());
    let surface_groups = groups::tags_of(groups, 2, linear.charts().len());
    for count in [network.points().len(), network.curves().len(), linear.charts().len(), 0] {
        out.size(count);
    }
    for (point, node) in point_nodes(linear, network).into_iter().enumerate() {
        out.tag(point);
        out.point(linear.points()[node as usize]);
        out.size(0);
    }
    for (curve, nodes) in network.curves().iter().zip(linear.curves()) {
        out.tag(curve.id().index());
        bounding_box(out, linear, nodes);
        physical_tags(out, &curve_groups[curve.id().index()]);
        // A closed curve names its only point twice: as its begin and as its end.
        out.size(2);
        let [begin, end] = curve.ends();
        out.signed_tag(begin, true);
        out.signed_tag(end, false);
    }
    for (index, chart) in linear.charts().iter().enumerate() {
        out.tag(index);
        bounding_box(out, linear, chart.nodes());
        physical_tags(out, &surface_groups[index]);
        let passages = network.loops(ChartId::at(index)).concat();
        out.size(passages.len());
        passages.iter().for_each(|p| out.signed_tag(p.curve.index(), p.forward));
    }
}

/// The node at each point of the network.
fn point_nodes(linear: &LinearAtlas, network: &SeamNetwork) -> Vec<u32> {
    let mut nodes = vec![0; network.points().len()];
    for (curve, along) in network.curves().iter().zip(linear.curves()) {
        let [begin, end] = curve.ends();
        (nodes[begin], nodes[end]) = (along[0], along[along.len() - 1]);
    }
    nodes
}

/// The physical groups of an entity.
fn physical_tags(out: &mut Binary, tags: &[i32]) {
    out.size(tags.len());
    tags.iter().for_each(|tag| out.int(*tag));
}

/// The box around some nodes.
fn bounding_box(out: &mut Binary, linear: &LinearAtlas, nodes: &[u32]) {
    let around = BoundingBox::of(nodes.iter().map(|n| linear.points()[*n as usize]));
    let around = around.unwrap_or(BoundingBox { min: [0.0; 3], max: [0.0; 3] });
    out.point(around.min);
    out.point(around.max);
}

fn parametrizations(out: &mut Binary, linear: &LinearAtlas) {
    out.size(linear.curves().len());
    out.size(linear.charts().len());
    for (index, nodes) in linear.curves().iter().enumerate() {
        out.tag(index);
        out.size(nodes.len());
        for (t, node) in nodes.iter().enumerate() {
            out.point(linear.points()[*node as usize]);
            out.doubles(&[t as f64]);
        }
    }
    for (index, chart) in linear.charts().iter().enumerate() {
        out.tag(index);
        surface(out, linear, chart);
    }
}

fn surface(out: &mut Binary, linear: &LinearAtlas, chart: &LinearChart) {
    out.size(chart.nodes().len());
    out.size(chart.triangles().len());
    // Powers of two: nothing is rounded.
    let scale = chart.uv_scale() * out.unit;
    for (node, uv) in chart.nodes().iter().zip(chart.uv()) {
        let [largest, smallest] = linear.curvatures()[*node as usize];
        out.point(linear.points()[*node as usize]);
        out.doubles(&uv.uv().map(|c| c * scale));
        out.curvature(largest);
        out.curvature(smallest);
    }
    chart.triangles().iter().flatten().for_each(|n| out.int(*n as i32));
}
