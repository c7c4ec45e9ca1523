//! How close seams come to each other, and to the open boundary, other than along themselves.
//!
//! A chart that narrows to a neck has an area ratio that grows exponentially with the length of the neck over its width.
//! So seams may only move by a share of the distance to the next one. Every vertex belongs to the nearest seam vertex;
//! where the domains of two of them meet that are far apart along the seams, the way across is a gap.

use super::network::Network;
use crate::monitor::Interrupted;
use crate::topology::dijkstra::ShortestPaths;

/// Two vertices of seams are far apart if the way along these is this many times the way across. A half circle is pi / 2 =
/// 1.6 times as long as the way across it: what is taken for a neck is deeper than that.
const FAR: f64 = 3.0;

/// The gaps between seams.
pub(super) struct Gaps {
    /// Per vertex on a seam the width of the narrowest gap beside it, infinite where there is none.
    pub clearance: Vec<f64>,
    /// Per edge, whether it crosses the middle of a gap: no seam may move along it.
    pub crossing: Vec<bool>,
}

pub(super) fn gaps(network: &Network) -> Result<Gaps, Interrupted> {
    let dual = network.dual;
    let positions = positions(network);
    let domains = domains(network, &positions)?;
    let mut clearance = vec![f64::INFINITY; positions.len()];
    let mut crossing = vec![false; dual.mesh.edges().len()];
    for h in dual.half_edges() {
        let (u, v) = (dual.from(h), dual.to(h));
        let (Some(a), Some(b)) = (domains.label(u), domains.label(v)) else { continue };
        let (Some(to_a), Some(to_b)) = (domains.distance(u), domains.distance(v)) else { continue };
        let gap = to_a + dual.length(h) + to_b;
        if a != b && along(&positions[a], &positions[b]) > FAR * gap {
            crossing[dual.mesh.edges().edge(h).index()] = true;
            for owner in [a, b] {
                clearance[owner] = clearance[owner].min(gap);
            }
        }
    }
    Ok(Gaps { clearance, crossing })
}

/// Where a vertex lies on the seams: the seam, the way to its begin and to its end, and whether it is closed.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SeamPosition {
    Inside,
    Open,
    Seam { curve: usize, from_begin: f64, to_end: f64, closed: bool },
}

fn positions(network: &Network) -> Vec<SeamPosition> {
    let dual = network.dual;
    let vertex = |v: usize| if network.is_open(v) { SeamPosition::Open } else { SeamPosition::Inside };
    let mut positions: Vec<SeamPosition> = (0..dual.mesh.points().len()).map(vertex).collect();
    for (curve, path) in network.curves().iter().enumerate() {
        let total: f64 = path.iter().map(|h| dual.length(*h)).sum();
        let closed = dual.is_closed(path);
        let mut from_begin = 0.0;
        for h in path {
            positions[dual.from(*h)] = SeamPosition::Seam { curve, from_begin, to_end: total - from_begin, closed };
            from_begin += dual.length(*h);
            if !closed {
                positions[dual.to(*h)] = SeamPosition::Seam { curve, from_begin, to_end: total - from_begin, closed };
            }
        }
    }
    positions
}

/// The way along the seams between two positions, or less.
fn along(a: &SeamPosition, b: &SeamPosition) -> f64 {
    let to_end = |p: &SeamPosition| match p {
        SeamPosition::Seam { from_begin, to_end, closed: false, .. } => from_begin.min(*to_end),
        SeamPosition::Seam { .. } => f64::INFINITY,
        SeamPosition::Open | SeamPosition::Inside => 0.0,
    };
    match (a, b) {
        (SeamPosition::Open, SeamPosition::Open) => 0.0,
        (
            SeamPosition::Seam { curve: c, from_begin: s, to_end, closed },
            SeamPosition::Seam { curve: d, from_begin: t, .. },
        ) if c == d => {
            let way = (s - t).abs();
            if *closed { way.min(s + to_end - way) } else { way }
        }
        _ => to_end(a) + to_end(b),
    }
}

/// Per vertex its distance from the nearest vertex on a seam or at the open boundary, and that vertex.
fn domains(network: &Network, positions: &[SeamPosition]) -> Result<ShortestPaths<usize>, Interrupted> {
    let dual = network.dual;
    let mut paths = ShortestPaths::new(positions.len(), usize::MAX);
    for v in (0..positions.len()).filter(|v| positions[*v] != SeamPosition::Inside) {
        paths.start(v, v);
    }
    while let Some(node) = paths.settle() {
        dual.checkpoint.after(1)?;
        network.each_out(node.index, |h| {
            paths.reach(dual.to(h), node.distance + dual.length(h), node.label);
        });
    }
    Ok(paths)
}
