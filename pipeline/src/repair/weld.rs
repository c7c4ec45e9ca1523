//! Merging bit-equal vertices.

use super::Draft;
use crate::id::VertexId;
use crate::mesh::TriangleSoup;
use crate::space::Vec3;

/// Merges points with equal coordinates (0 and -0 are equal); returns the draft and how many points were merged
/// away. Vertices are numbered in the order of their first appearance among the points.
pub(super) fn weld(soup: &TriangleSoup) -> (Draft, usize) {
    let mut order: Vec<([u64; 3], u32)> = soup.points().iter().map(|p| bits(*p)).zip(0..).collect();
    order.sort_unstable();
    let mut first = vec![0_u32; order.len()];
    for equal in order.chunk_by(|a, b| a.0 == b.0) {
        equal.iter().for_each(|e| first[e.1 as usize] = equal[0].1);
    }
    let mut number = vec![VertexId(0); first.len()];
    let mut points = Vec::new();
    for (i, &f) in first.iter().enumerate() {
        number[i] = if f as usize == i {
            points.push(soup.points()[i].map(|c| c + 0.0));
            VertexId::at(points.len() - 1)
        } else {
            number[f as usize]
        };
    }
    let merged = first.len() - points.len();
    let triangles: Vec<_> = soup.triangles().iter().map(|t| t.map(|i| number[i as usize])).collect();
    let source = (0..triangles.len() as u32).collect();
    (Draft { points, triangles, source }, merged)
}

/// The bits of a point, with negative zero turned into zero.
fn bits(p: Vec3) -> [u64; 3] {
    p.map(|c| (c + 0.0).to_bits())
}
