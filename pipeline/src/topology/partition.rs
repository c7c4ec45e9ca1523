//! A partition of a surface into parts: triangles with labels, and the boundaries between them.
//!
//! The cells of the search, charts while their seams move, and patches between features are such partitions. What they have
//! in common is here: which half-edges bound a part, what follows what around it, and its loops. Which vertices are corners
//! is for each of them to say, as they cut their boundaries for different ends.

use crate::topology::loops::{next_on_boundary, walk_loops};
use crate::topology::{HalfEdgeId, VisitStamps};

/// A surface as far as a walk over its triangles is concerned.
pub(crate) trait Twins {
    /// The half-edge on the other side, which runs the other way; none where the surface ends.
    fn twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId>;
}

/// Triangles with labels.
#[derive(Clone, Copy)]
pub(crate) struct Partition<'a, S> {
    surface: &'a S,
    labels: &'a [u32],
}

impl<'a, S: Twins> Partition<'a, S> {
    /// The parts of `surface` into which the labels of its triangles part it.
    pub(crate) fn new(surface: &'a S, labels: &'a [u32]) -> Self {
        Self { surface, labels }
    }

    /// The label of the triangle that `h` bounds.
    pub(crate) fn label(&self, h: HalfEdgeId) -> u32 {
        self.labels[h.face().index()]
    }

    /// Whether another part lies on the other side of `h`.
    pub(crate) fn is_seam(&self, h: HalfEdgeId) -> bool {
        self.surface.twin(h).is_some_and(|twin| self.label(twin) != self.label(h))
    }

    /// Whether the part of `h` ends there: at another part, or with the surface.
    pub(crate) fn is_boundary(&self, h: HalfEdgeId) -> bool {
        self.inner_twin(h).is_none()
    }

    /// The other side of `h`, where that belongs to the same part.
    fn inner_twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId> {
        self.surface.twin(h).filter(|twin| self.label(*twin) == self.label(h))
    }

    /// The boundary half-edge that follows the one given around its part.
    pub(crate) fn next(&self, h: HalfEdgeId) -> HalfEdgeId {
        next_on_boundary(h, HalfEdgeId::next, |side| self.inner_twin(side))
    }

    /// All boundary half-edges, ascending.
    pub(crate) fn boundary(&self) -> Vec<HalfEdgeId> {
        let all = (0..3 * self.labels.len()).map(HalfEdgeId::at);
        all.filter(|h| self.is_boundary(*h)).collect()
    }

    /// The loops that these boundary half-edges form, in the order of the first ones among them, with these first.
    pub(crate) fn loops(&self, boundary: &[HalfEdgeId]) -> Vec<Vec<HalfEdgeId>> {
        let mut loops: Vec<Vec<HalfEdgeId>> = Vec::new();
        let mut seen = VisitStamps::new(3 * self.labels.len());
        let starts = boundary.iter().copied();
        walk_loops(
            starts,
            &mut seen,
            HalfEdgeId::index,
            |h| self.next(h),
            |h, begins| match loops.last_mut() {
                Some(open) if !begins => open.push(h),
                _ => loops.push(vec![h]),
            },
        );
        loops
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::{EdgeTable, VertexId};

    impl Twins for EdgeTable {
        fn twin(&self, h: HalfEdgeId) -> Option<HalfEdgeId> {
            EdgeTable::twin(self, h)
        }
    }

    /// The half-edges from vertex to vertex along a loop.
    fn vertices(triangles: &[[VertexId; 3]], path: &[HalfEdgeId]) -> Vec<u32> {
        path.iter().map(|h| triangles[h.face().index()][h.side()].0).collect()
    }

    #[test]
    fn a_fan_is_parted_as_its_labels_tell() {
        // Six triangles around vertex 0.
        let triangles: Vec<[VertexId; 3]> = (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6].map(VertexId)).collect();
        let edges = EdgeTable::new(&triangles);
        let loops = |labels: &[u32]| {
            let partition = Partition::new(&edges, labels);
            let boundary = partition.boundary();
            let loops = partition.loops(&boundary);
            assert_eq!(loops.iter().map(Vec::len).sum::<usize>(), boundary.len(), "every half-edge is on one loop");
            loops.iter().map(|l| vertices(&triangles, l)).collect::<Vec<_>>()
        };
        assert_eq!(loops(&[7; 6]), [[1, 2, 3, 4, 5, 6]]);
        assert_eq!(loops(&[0, 0, 0, 1, 1, 1]), [[0, 1, 2, 3, 4], [0, 4, 5, 6, 1]]);
        // Triangles of one label that only touch in the middle have a loop each.
        assert_eq!(loops(&[0, 1, 1, 0, 1, 1]), [vec![0, 1, 2], vec![0, 2, 3, 4], vec![0, 4, 5], vec![0, 5, 6, 1]]);
    }

    #[test]
    fn a_seam_has_another_part_beyond_and_the_end_of_the_surface_has_none() {
        let triangles = [[0, 1, 2], [0, 2, 3], [3, 2, 4]].map(|t| t.map(VertexId));
        let edges = EdgeTable::new(&triangles);
        let partition = Partition::new(&edges, &[0, 1, 1]);
        let told = |h: u32| (partition.is_seam(HalfEdgeId(h)), partition.is_boundary(HalfEdgeId(h)));
        assert_eq!([told(2), told(3), told(0), told(4)], [(true, true), (true, true), (false, true), (false, false)]);
    }
}
