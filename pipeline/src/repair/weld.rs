//! Merging bit-equal vertices.

use super::MeshBuilder;
use crate::mesh::TriangleSoup;
use crate::topology::VertexId;
use crate::vec3::{Vec3, bits_of};

/// Places of the table that are looked at per point, on average and at most. Where numbers scatter, 2.5 are needed for a new
/// point and 1.5 for a known one, as the table is at most half full (Knuth, theorem K): more than three times that is a crowd.
const LOOKS: usize = 8;

/// In tables: no point.
const NONE: u32 = u32::MAX;

/// Merges points with equal coordinates (0 and -0 are equal); returns the builder and how many points were merged
/// away. Vertices are numbered in the order of their first appearance among the points.
pub(super) fn weld(soup: &TriangleSoup) -> (MeshBuilder, usize) {
    let (number, points) = distinct(soup.points());
    let merged = number.len() - points.len();
    let triangles: Vec<_> = soup.triangles().iter().map(|t| t.map(|i| number[i as usize])).collect();
    let source = (0..triangles.len() as u32).collect();
    let sizes = least(soup.sizes(), &number, points.len());
    (MeshBuilder { points, triangles, source, labels: soup.labels().clone(), sizes, middles: vec![] }, merged)
}

/// The least of the sizes at points that became one, by the numbers of these; none where there are none.
pub(super) fn least(sizes: &[f64], number: &[VertexId], count: usize) -> Vec<f64> {
    let mut of_merged = vec![f64::INFINITY; if sizes.is_empty() { 0 } else { count }];
    for (size, vertex) in sizes.iter().zip(number) {
        let least = &mut of_merged[vertex.index()];
        *least = least.min(*size);
    }
    of_merged
}

/// Per vertex after welding ([`crate::mesh::SurfaceMesh::welded_vertex`]), the first of the points with its coordinates (0 and -0
/// are equal).
///
/// ```
/// use planish_core::repair::first_points;
///
/// assert_eq!(first_points(&[[0.0, 0.0, 1.0], [2.0, 0.0, 0.0], [-0.0, 0.0, 1.0], [3.0, 0.0, 0.0]]), [0, 1, 3]);
/// ```
pub fn first_points(points: &[Vec3]) -> Vec<u32> {
    let first = first_by_table(points).unwrap_or_else(|| first_by_order(points));
    (0..).zip(first).filter(|(point, first)| point == first).map(|(point, _)| point).collect()
}

/// Per point the number of the one that stands for all with equal coordinates (0 and -0 are equal), and these, in the order
/// of their first appearance.
pub(crate) fn distinct(points: &[Vec3]) -> (Vec<VertexId>, Vec<Vec3>) {
    let first = first_by_table(points).unwrap_or_else(|| first_by_order(points));
    let mut number = vec![VertexId(0); first.len()];
    let mut kept = Vec::new();
    for (i, &f) in first.iter().enumerate() {
        number[i] = if f as usize == i {
            kept.push(points[i].map(|c| c + 0.0));
            VertexId::at(kept.len() - 1)
        } else {
            number[f as usize]
        };
    }
    (number, kept)
}

/// For each point the first one that is equal, by a table in which a point lies at the first free place from that of its
/// coordinates on (Knuth, The Art of Computer Programming 3, 6.4, algorithm L). None where that takes too many looks,
/// as points may be chosen so that it does.
fn first_by_table(points: &[Vec3]) -> Option<Vec<u32>> {
    // At most half of the places are taken.
    let places = (2 * points.len()).max(2).next_power_of_two();
    let mut table = vec![NONE; places];
    let mut looks = LOOKS * points.len();
    let mut first = Vec::with_capacity(points.len());
    for (i, point) in points.iter().enumerate() {
        let point = bits_of(*point);
        // The high bits, as multiplication carries upwards: they depend on all of those below.
        let mut place = (scattered(point) >> (u64::BITS - places.ilog2())) as usize;
        loop {
            let found = &mut table[place];
            if *found == NONE {
                *found = i as u32;
            }
            if *found as usize == i || bits_of(points[*found as usize]) == point {
                first.push(*found);
                break;
            }
            looks = looks.checked_sub(1)?;
            place = (place + 1) % places;
        }
    }
    Some(first)
}

/// The same, by a sort.
fn first_by_order(points: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<([u64; 3], u32)> = points.iter().map(|p| bits_of(*p)).zip(0..).collect();
    order.sort_unstable();
    let mut first = vec![0_u32; order.len()];
    for equal in order.chunk_by(|a, b| a.0 == b.0) {
        equal.iter().for_each(|e| first[e.1 as usize] = equal[0].1);
    }
    first
}

/// A number that differs in its high bits for points that do not.
fn scattered(bits: [u64; 3]) -> u64 {
    bits.into_iter().fold(0, |scattered: u64, bits| {
        let product = (scattered ^ bits).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        product ^ product >> 32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_find_the_same() {
        let grid = |k: u32, side: u32| [f64::from(k % side), f64::from(k / side % 7), -f64::from(k % 2)];
        for (count, side) in [(0, 1), (1, 1), (2, 1), (1000, 10), (1000, 1000), (4096, 3)] {
            let points: Vec<Vec3> = (0..count).map(|k| grid(k, side)).collect();
            let by_order = first_by_order(&points);
            assert_eq!(first_by_table(&points), Some(by_order), "{count} points");
        }
        assert_eq!(first_by_table(&[[0.0, 1.0, 2.0], [-0.0, 1.0, 2.0]]), Some(vec![0, 0]));
    }

    #[test]
    fn points_that_crowd_in_the_table_are_sorted() {
        let crowd = (0..).map(|k| [f64::from(k), 0.0, 0.0]).filter(|p| scattered(bits_of(*p)) >> 52 == 0);
        let points: Vec<Vec3> = crowd.take(300).collect();
        assert_eq!(first_by_table(&points), None);
        assert_eq!(first_by_order(&points), (0..300).collect::<Vec<u32>>());
    }
}
