//! The numbers that no remeshing may change.

use super::Defect;
use crate::topology::EdgeTable;
use crate::topology::VertexId;
use crate::topology::union_find::UnionFind;

/// Numbers of a triangulation that are those of every other one of the same surface.
///
/// ```
/// use planish_core::soundness::Invariants;
/// use planish_core::topology::{EdgeTable, VertexId};
///
/// let of = |triangles: &[[u32; 3]]| {
///     let triangles: Vec<_> = triangles.iter().map(|t| t.map(VertexId)).collect();
///     Invariants::of(&triangles, &EdgeTable::new(&triangles))
/// };
/// // A square by two triangles, and by four around a node in its middle.
/// let coarse = of(&[[0, 1, 2], [0, 2, 3]]);
/// assert_eq!(coarse, of(&[[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]));
/// assert_eq!((coarse.euler, coarse.components, coarse.open_loops), (1, 1, 1));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Invariants {
    /// Vertices that are used - edges + triangles.
    pub euler: i64,
    /// Parts that share no vertex.
    pub components: usize,
    /// Parts of the open boundary that share no vertex.
    pub open_loops: usize,
    /// Parts of the curves along which three or more triangles meet, that share no vertex.
    pub nonmanifold_curves: usize,
}

impl Invariants {
    /// Counts.
    pub fn of(triangles: &[[VertexId; 3]], edges: &EdgeTable) -> Self {
        let vertices = triangles.iter().flatten().map(|v| v.index() + 1).max().unwrap_or(0);
        let ends: Vec<[VertexId; 2]> = edges
            .iter()
            .map(|(_, sides)| {
                let t = triangles[sides[0].face().index()];
                [t[sides[0].side()], t[(sides[0].side() + 1) % 3]]
            })
            .collect();
        let parts = |admit: &dyn Fn(usize) -> bool| {
            let mut sets = UnionFind::new(vertices);
            let mut used = vec![false; vertices];
            let chosen = ends.iter().zip(edges.iter()).filter(|(_, (_, sides))| admit(sides.len()));
            for (&[a, b], _) in chosen {
                sets.merge(a.index(), b.index());
                (used[a.index()], used[b.index()]) = (true, true);
            }
            let roots = (0..vertices).filter(|v| used[*v] && sets.find(*v) == *v).count();
            (roots, used.iter().filter(|u| **u).count())
        };
        let (components, used) = parts(&|_| true);
        Self {
            euler: used as i64 - edges.len() as i64 + triangles.len() as i64,
            components,
            open_loops: parts(&|sides| sides == 1).0,
            nonmanifold_curves: parts(&|sides| sides > 2).0,
        }
    }

    /// What differs in a mesh.
    pub fn compared(&self, mesh: &Self) -> Vec<Defect> {
        let rows = [
            ("Euler number", self.euler, mesh.euler),
            ("number of components", self.components as i64, mesh.components as i64),
            ("number of open loops", self.open_loops as i64, mesh.open_loops as i64),
            ("number of non-manifold curves", self.nonmanifold_curves as i64, mesh.nonmanifold_curves as i64),
        ];
        let differs = rows.into_iter().filter(|(_, expected, found)| expected != found);
        differs.map(|(what, expected, found)| Defect::Topology { what, expected, found }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn invariants(triangles: &[[u32; 3]]) -> Invariants {
        let triangles: Vec<_> = triangles.iter().map(|t| t.map(VertexId)).collect();
        Invariants::of(&triangles, &EdgeTable::new(&triangles))
    }

    #[test]
    fn finer_triangles_have_the_same_numbers_and_a_hole_has_not() {
        let book = invariants(&[[0, 1, 2], [1, 0, 3], [0, 1, 4]]);
        let finer = invariants(&[[0, 5, 2], [5, 1, 2], [5, 0, 3], [1, 5, 3], [0, 1, 4]]);
        assert_eq!((book.euler, book.components, book.open_loops, book.nonmanifold_curves), (1, 1, 1, 1));
        assert_ne!(book, finer, "the third page does not know the new node");
        let conforming = invariants(&[[0, 5, 2], [5, 1, 2], [5, 0, 3], [1, 5, 3], [0, 5, 4], [5, 1, 4]]);
        assert_eq!(book, conforming);
        let tetrahedron = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let (closed, open) = (invariants(&tetrahedron), invariants(&tetrahedron[1..]));
        let names: Vec<String> = closed.compared(&open).iter().map(ToString::to_string).collect();
        assert_eq!(
            names,
            ["the Euler number is 1, that of the surface 2", "the number of open loops is 1, that of the surface 0"]
        );
    }
}
