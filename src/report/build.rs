//! From the core's numbers to the report's.

use super::{
    Boundary, BoundaryShape, Certificate, ChartBoundary, ChartReport, Counts, Distortion, FieldOwner, FieldReport,
    LabelReport, Linear, Quadratic, RepairedSurface, Repairs, Seam, Seams, Surface, Untangle,
};
use crate::formats::fields::{Field, Fields};
use crate::formats::layout::{Placement, layout};
use crate::formats::{Label, label_index};
use planish_core::atlas::Chart;
use planish_core::certified::BoundaryFound;
use planish_core::certify::{BoundaryArgument, CertifiedMap, PlanarMap};
use planish_core::map::linear;
use planish_core::map::natural::NoNatural;
use planish_core::repair::{self, Repaired};
use planish_core::seams::{Curve, SeamNetwork};
use planish_core::topology::TopologySummary;
use planish_core::untangle;
use planish_core::{CertifiedAtlas, CertifiedChart};

/// The surface before and after repair.
pub fn surface(repaired: &Repaired) -> Surface {
    let bbox = repaired.mesh.bounding_box();
    Surface {
        raw: counts(&repaired.raw),
        repaired: RepairedSurface {
            counts: counts(repaired.mesh.topology_summary()),
            area: repaired.mesh.area(),
            bbox: [bbox.min, bbox.max],
        },
    }
}

fn counts(c: &TopologySummary) -> Counts {
    Counts {
        vertices: c.vertices,
        triangles: c.triangles,
        components: c.components,
        boundary_loops: c.boundary_loops,
        euler: c.euler,
        genus: c.genus,
        orientable: c.orientable,
        nonmanifold_edges: c.nonmanifold_edges,
        nonmanifold_vertices: c.nonmanifold_vertices,
        inconsistent_edges: c.inconsistent_edges,
    }
}

/// The parts of the surface that have names, with their areas.
pub fn labels(atlas: &CertifiedAtlas, labels: &[Label]) -> Vec<LabelReport> {
    let report = |label: &Label| LabelReport { label: label.clone(), charts: 0, triangles: 0, area: 0.0 };
    let mut reports: Vec<LabelReport> = labels.iter().map(report).collect();
    for chart in atlas.charts() {
        let Some(index) = label_index(atlas, chart.id(), labels) else { continue };
        let report = &mut reports[index];
        report.charts += 1;
        report.triangles += chart.chart().triangles().len();
        report.area += chart.chart().true_area();
    }
    reports
}

/// The fields of the input in surface.vtu.
pub fn fields(fields: &Fields) -> Vec<FieldReport> {
    let report = |field: &Field, on| FieldReport {
        name: field.name.clone(),
        input_name: field.input_name.clone(),
        on,
        components: field.components,
        integer: field.values.are_integers(),
    };
    let points = fields.points.iter().map(|field| report(field, FieldOwner::Points));
    points.chain(fields.cells.iter().map(|field| report(field, FieldOwner::Cells))).collect()
}

/// What repair did.
pub fn repairs(report: &repair::Report) -> Repairs {
    let named = [
        ("t_junctions_closed", &report.t_junctions_closed),
        ("t_junctions_left", &report.t_junctions_left),
        ("duplicate_triangles", &report.duplicate_triangles),
        ("degenerate_triangles", &report.degenerate_triangles),
        ("flipped_triangles", &report.flipped_triangles),
        ("needles_collapsed", &report.needles_collapsed),
        ("caps_flipped", &report.caps_flipped),
        ("split_vertices", &report.split_vertices),
        ("mollified_triangles", &report.mollified_triangles),
    ];
    let first = named.iter().filter(|(_, f)| f.count > 0).map(|(n, f)| ((*n).to_owned(), f.first.clone())).collect();
    Repairs {
        welded: report.welded,
        unreferenced_points: report.unreferenced_points,
        t_junctions_closed: report.t_junctions_closed.count,
        t_junctions_left: report.t_junctions_left.count,
        triangles_added: report.triangles_added,
        slits_opened: report.slits_opened,
        cracks_closed: report.cracks_closed,
        duplicate_triangles: report.duplicate_triangles.count,
        degenerate_triangles: report.degenerate_triangles.count,
        flipped_triangles: report.flipped_triangles.count,
        needles_collapsed: report.needles_collapsed.count,
        caps_flipped: report.caps_flipped.count,
        slivers_moved_by: report.slivers_moved_by,
        split_vertices: report.split_vertices.count,
        mollified_triangles: report.mollified_triangles.count,
        mollified_by: report.mollified_by,
        first,
    }
}

/// The curves between charts.
pub fn seams(network: &SeamNetwork) -> Seams {
    let list: Vec<Seam> = network.seams().map(seam).collect();
    let lengths = || list.iter().map(|s| s.length);
    let mut ends: Vec<usize> = network.seams().flat_map(Curve::ends).collect();
    ends.sort_unstable();
    ends.dedup();
    Seams {
        curves: list.len(),
        corners: ends.iter().filter(|p| network.points()[**p].corner).count(),
        length_total: lengths().sum(),
        length_max: lengths().fold(0.0, f64::max),
        list,
    }
}

fn seam(curve: &Curve) -> Seam {
    Seam {
        id: curve.id().0,
        charts: curve.sides().iter().map(|s| s.chart.0).collect(),
        length: curve.length(),
        edges: curve.segments(),
        closed: curve.is_closed(),
    }
}

/// The seams that the loops of a chart pass, ascending.
fn seams_of(chart: &Chart, network: &SeamNetwork) -> Vec<u32> {
    let passed = network.loops(chart.id()).iter().flatten().map(|p| p.curve);
    let mut seams: Vec<u32> = passed.filter(|c| !network.curves()[c.index()].is_open()).map(|c| c.0).collect();
    seams.sort_unstable();
    seams.dedup();
    seams
}

/// The charts of an atlas.
pub fn charts(atlas: &CertifiedAtlas) -> Vec<ChartReport> {
    let colours = atlas.seams().colours();
    let places = layout(atlas.charts());
    let look = colours.into_iter().zip(places);
    atlas.charts().iter().zip(look).map(|(c, (colour, place))| chart(c, colour, place, atlas.seams())).collect()
}

fn chart(certified: &CertifiedChart, colour: u32, place: Placement, network: &SeamNetwork) -> ChartReport {
    let chart = certified.chart();
    let provenance = certified.provenance();
    let unit = chart.scale() * chart.scale();
    let det_min = certified.fields().iter().map(|f| f.det_min).fold(f64::MAX, f64::min);
    let summary = certified.distortion();
    ChartReport {
        id: chart.id().0,
        triangles: chart.triangles().len(),
        loops: 1 + chart.holes().len(),
        colour,
        seams: seams_of(chart, network),
        neighbours: network.neighbours(chart.id()).iter().map(|c| c.0).collect(),
        boundary: chart_boundary(provenance.boundary),
        linear: Linear {
            folded: provenance.linear.folded,
            edges_changed: provenance.linear.edges_changed,
            method: linear_method(provenance.linear.method).to_owned(),
        },
        quadratic: provenance.harmonic.as_ref().map(|h| Quadratic {
            invalid: h.invalid.iter().filter(|i| **i).count(),
            det_min: (h.det_min * unit).clamp(f64::MIN, f64::MAX),
        }),
        untangle: provenance.untangle.as_ref().map(|u| untangling(u, det_min)),
        certificate: certificate(certified.map()),
        distortion: Distortion {
            conformal_median: summary.conformal_median,
            conformal_p99: summary.conformal_p99,
            area_ratio: summary.area_ratio,
        },
        uv_scale: place.scale,
        shift: place.shift,
    }
}

/// The proof of a map.
pub fn certificate(map: &CertifiedMap) -> Certificate {
    let proof = map.certificate();
    Certificate {
        proven: true,
        by_bounds: proof.by_bounds,
        by_exact: proof.by_exact,
        depth: proof.depth,
        det_lower_bound: proof.det_lower_bound,
        boundary: Boundary {
            argument: boundary_argument(proof.boundary).to_owned(),
            outer_arcs: proof.outer_arcs,
            holes: proof.holes,
        },
        hole_centres: proof.hole_centres.iter().map(|c| c.uv()).collect(),
        checksum: chart_checksum(map.map()),
    }
}

fn untangling(report: &untangle::Report, det_min: f64) -> Untangle {
    let method = match report.method {
        untangle::Method::Harmonic => "none",
        untangle::Method::Patch => "patch",
        untangle::Method::Feasible => "feasible",
        untangle::Method::Isometric => "isometric",
        untangle::Method::Start => "start",
    };
    Untangle {
        method: method.to_owned(),
        iterations: report.iterations,
        nodes_moved: report.nodes_moved,
        energy_harmonic: report.energy_unconstrained,
        energy_start: report.energy_start,
        energy: report.energy,
        energy_excess: (report.energy - report.energy_unconstrained) / report.energy_unconstrained,
        gradient_norm: report.gradient_norm,
        from_isometry: report.from_isometry.map(|from| super::FromIsometry { start: from.start, least: from.least }),
        det_min,
    }
}

fn chart_boundary(found: BoundaryFound) -> ChartBoundary {
    let (shape, why_none) = match found {
        BoundaryFound::Natural => (BoundaryShape::Natural, None),
        BoundaryFound::Freed { why_none } => (BoundaryShape::Freed, Some(why_none)),
        BoundaryFound::Circle { why_none } => (BoundaryShape::Circle, why_none),
    };
    let code = |why: &NoNatural| match why {
        NoNatural::Folded { .. } => "folded",
        NoNatural::Crossing => "crossing",
        NoNatural::Uneven { .. } => "uneven",
        NoNatural::Stretched { .. } => "stretched",
        NoNatural::Unsolvable => "unsolvable",
    };
    ChartBoundary {
        shape,
        reason: why_none.as_ref().map(|why| code(why).to_owned()),
        message: why_none.map(|why| why.to_string()),
    }
}

fn boundary_argument(argument: BoundaryArgument) -> &'static str {
    match argument {
        BoundaryArgument::StarShaped => "star_shaped",
        BoundaryArgument::Simple => "simple",
    }
}

fn linear_method(method: linear::Method) -> &'static str {
    match method {
        linear::Method::Harmonic => "harmonic",
        linear::Method::MMatrix => "m_matrix",
        linear::Method::MeanValue => "mean_value",
        linear::Method::Conformal => "conformal",
        linear::Method::Projection => "projection",
        linear::Method::Unfolded => "unfolded",
        linear::Method::Isometric => "isometric",
    }
}

/// The checksum of a chart: blake3 over, little-endian, the number of cells (u32), the number of nodes (u32), the
/// nodes of all cells (u32, numbered within the chart in the order of the file), the uv of all nodes (f64).
pub fn chart_checksum(map: &PlanarMap) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(map.cells.len() as u32).to_le_bytes());
    hasher.update(&(map.nodes.len() as u32).to_le_bytes());
    let cells: Vec<u8> = map.cells.iter().flatten().flat_map(|n| n.to_le_bytes()).collect();
    let nodes: Vec<u8> = map.nodes.iter().flat_map(|p| p.uv()).flat_map(f64::to_le_bytes).collect();
    hasher.update(&cells);
    hasher.update(&nodes);
    hasher.finalize().to_hex().to_string()
}
