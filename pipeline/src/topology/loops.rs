//! Loops: closed walks along boundaries.

use crate::topology::{EdgeTable, HalfEdgeId, VertexId, VisitStamps};

/// Strings directed edges together to loops. `leave` takes an edge out of a node, if there is one left, and tells where it
/// ends: a walk from each of `starts` takes edges until it comes to a node that has none. Walks of no edge are no loops.
///
/// It ends, as every step takes an edge away.
///
/// # Errors
/// Where a walk ended, if that is not where it began: these edges do not form loops.
pub(crate) fn closed_loops<N: Copy + PartialEq, E>(
    starts: impl IntoIterator<Item = N>,
    mut leave: impl FnMut(N) -> Option<(E, N)>,
) -> Result<Vec<Vec<E>>, N> {
    let mut loops = Vec::new();
    for start in starts {
        let mut edges = Vec::new();
        let mut at = start;
        while let Some((edge, to)) = leave(at) {
            edges.push(edge);
            at = to;
        }
        if at != start {
            return Err(at);
        }
        if !edges.is_empty() {
            loops.push(edges);
        }
    }
    Ok(loops)
}

/// The boundary loops of oriented triangles, each from its least half-edge on, in the order of these. Vertices are below
/// `vertices`.
///
/// # Errors
/// A vertex that the boundary leaves more than once.
pub(crate) fn boundary_loops(
    triangles: &[[VertexId; 3]],
    edges: &EdgeTable,
    vertices: usize,
) -> Result<Vec<Vec<HalfEdgeId>>, VertexId> {
    let from = |h: HalfEdgeId| triangles[h.face().index()][h.side()];
    // Edges are numbered by their first half-edges: these ascend.
    let boundary = || edges.iter().filter(|(_, sides)| sides.len() == 1).map(|(_, sides)| sides[0]);
    let mut out: Vec<Option<HalfEdgeId>> = vec![None; vertices];
    for h in boundary() {
        if out[from(h).index()].replace(h).is_some() {
            return Err(from(h));
        }
    }
    closed_loops(boundary().map(from), |v| {
        let h = out[v.index()].take()?;
        Some((h, from(h.next())))
    })
}

/// The side of a part's boundary that follows `h`: turns around the end of `h` from one element of the part to the next,
/// until the part ends there, at the latest at `h` itself. `next` tells the side after one around its element (a triangle or
/// a cell), `inner_twin` the other side of one, where that belongs to the part, too.
pub(crate) fn next_on_boundary<H: Copy>(h: H, next: impl Fn(H) -> H, inner_twin: impl Fn(H) -> Option<H>) -> H {
    let mut side = next(h);
    while let Some(twin) = inner_twin(side) {
        side = next(twin);
    }
    side
}

/// Walks along loops, of which `next` tells what follows what, from those of `starts` that were not seen yet. `visit` is
/// told each element, and whether its loop begins with it. `index` is the place of an element among the stamps.
///
/// `next` must have one element before each, as on the boundary of a surface: then a walk closes where it began.
pub(crate) fn walk_loops<H: Copy>(
    starts: impl IntoIterator<Item = H>,
    seen: &mut VisitStamps,
    index: impl Fn(H) -> usize,
    next: impl Fn(H) -> H,
    mut visit: impl FnMut(H, bool),
) {
    for start in starts {
        let mut at = start;
        let mut begins = true;
        while seen.visit(index(at)) {
            visit(at, begins);
            begins = false;
            at = next(at);
        }
    }
}

/// A loop cut at its corners: the runs from each to the next, beginning with the first one. Whole where it has none.
pub(crate) fn cut_at_corners<T: Copy>(boundary_loop: &[T], begins_at_corner: impl Fn(&T) -> bool) -> Vec<Vec<T>> {
    let mut elements = boundary_loop.to_vec();
    let first = elements.iter().position(&begins_at_corner).unwrap_or(0);
    elements.rotate_left(first);
    elements.chunk_by(|_, next| !begins_at_corner(next)).map(<[T]>::to_vec).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn loops_of(triangles: &[[u32; 3]]) -> Result<Vec<Vec<HalfEdgeId>>, VertexId> {
        let triangles: Vec<_> = triangles.iter().map(|t| t.map(VertexId)).collect();
        boundary_loops(&triangles, &EdgeTable::new(&triangles), 7)
    }

    fn ids(half_edges: &[u32]) -> Vec<HalfEdgeId> {
        half_edges.iter().map(|h| HalfEdgeId(*h)).collect()
    }

    #[test]
    fn a_square_has_one_loop_and_two_triangles_apart_have_two() {
        assert_eq!(loops_of(&[[0, 1, 2], [0, 2, 3]]), Ok(vec![ids(&[0, 1, 4, 5])]));
        assert_eq!(loops_of(&[[0, 1, 2], [4, 5, 3]]), Ok(vec![ids(&[0, 1, 2]), ids(&[3, 4, 5])]));
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        assert_eq!(loops_of(&tetrahedron), Ok(vec![]));
    }

    #[test]
    fn a_boundary_that_meets_itself_is_named() {
        assert_eq!(loops_of(&[[0, 1, 2], [0, 3, 4]]), Err(VertexId(0)));
    }

    #[test]
    fn edges_that_run_out_are_no_loop() {
        let mut out = [Some(1), Some(2), None, Some(3)];
        assert_eq!(closed_loops([3, 0], |n: usize| out[n].take().map(|to| (n, to))), Err(2));
        let mut out = [Some(1), Some(2), Some(0), Some(3)];
        let found = closed_loops([1, 0, 3], |n: usize| out[n].take().map(|to| (n, to)));
        assert_eq!(found, Ok(vec![vec![1, 2, 0], vec![3]]));
    }

    #[test]
    fn loops_are_walked_once() {
        let next = [2, 1, 4, 0, 3];
        let mut walked = Vec::new();
        let mut seen = VisitStamps::new(5);
        walk_loops([3, 0, 1, 4], &mut seen, |i| i, |i: usize| next[i], |i, begins| walked.push((i, begins)));
        assert_eq!(walked, [(3, true), (0, false), (2, false), (4, false), (1, true)]);
    }

    #[test]
    fn runs_begin_at_corners() {
        let is_even = |n: &u32| n.is_multiple_of(2);
        assert_eq!(cut_at_corners(&[1, 3, 2, 5, 4, 6, 7], is_even), [vec![2, 5], vec![4], vec![6, 7, 1, 3]]);
        assert_eq!(cut_at_corners(&[1, 3, 5], is_even), [vec![1, 3, 5]]);
        assert_eq!(cut_at_corners(&[], is_even), Vec::<Vec<u32>>::new());
    }
}
