//! Typed indices. Every id is a `u32` newtype that prints with its letter: `v12`, `e3`, `f5`, `h7`, `c9`.

use std::fmt;

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $letter:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the element at `index`.
            ///
            /// # Panics
            /// If `index` does not fit `u32`; [`crate::mesh::TriangleSoup::new`] refuses such inputs.
            pub fn at(index: usize) -> Self {
                Self(u32::try_from(index).expect("element counts are checked to fit u32"))
            }

            /// The position of the element in its array.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, concat!($letter, "{}"), self.0)
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                fmt::Display::fmt(self, f)
            }
        }
    };
}

id!(
    /// A vertex of a surface.
    VertexId,
    "v"
);
id!(
    /// An undirected edge.
    EdgeId,
    "e"
);
id!(
    /// A triangle.
    FaceId,
    "f"
);
id!(
    /// A directed side of a triangle: `3 * face + side`, side 0 runs from corner 0 to corner 1.
    ///
    /// ```
    /// use planish_core::topology::{FaceId, HalfEdgeId};
    ///
    /// let h = HalfEdgeId::side_of(FaceId(5), 2);
    /// assert_eq!(h.to_string(), "h17");
    /// assert_eq!((h.face(), h.side()), (FaceId(5), 2));
    /// // Around the same triangle. What is beyond the edge, an `EdgeTable` tells.
    /// assert_eq!((h.next(), h.prev()), (HalfEdgeId(15), HalfEdgeId(16)));
    /// ```
    HalfEdgeId,
    "h"
);
id!(
    /// A chart of an atlas.
    ChartId,
    "c"
);
id!(
    /// A curve between charts, or of the open boundary.
    CurveId,
    "s"
);

impl FaceId {
    /// The three half-edges around this triangle, from corner 0 on.
    pub fn sides(self) -> [HalfEdgeId; 3] {
        [0, 1, 2].map(|side| HalfEdgeId::side_of(self, side))
    }
}

impl HalfEdgeId {
    /// Side `side` (0, 1 or 2) of `face`.
    pub fn side_of(face: FaceId, side: usize) -> Self {
        Self::at(3 * face.index() + side)
    }

    /// The triangle that this half-edge bounds.
    pub fn face(self) -> FaceId {
        FaceId(self.0 / 3)
    }

    /// Which side of its triangle this is: 0, 1 or 2.
    pub fn side(self) -> usize {
        (self.0 % 3) as usize
    }

    /// The next half-edge around the same triangle.
    pub fn next(self) -> Self {
        if self.0 % 3 == 2 { Self(self.0 - 2) } else { Self(self.0 + 1) }
    }

    /// The previous half-edge around the same triangle.
    pub fn prev(self) -> Self {
        if self.0.is_multiple_of(3) { Self(self.0 + 2) } else { Self(self.0 - 1) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_print_with_their_letter() {
        let shown = format!("{} {} {} {} {}", VertexId(12), EdgeId(3), FaceId(5), HalfEdgeId(7), ChartId(9));
        assert_eq!(shown, "v12 e3 f5 h7 c9");
        assert_eq!(CurveId(4).to_string(), "s4");
    }

    #[test]
    fn half_edges_walk_around_their_triangle() {
        for face in [FaceId(0), FaceId(41)] {
            for side in 0..3 {
                let h = HalfEdgeId::side_of(face, side);
                assert_eq!((h.face(), h.side()), (face, side));
                assert_eq!(face.sides()[side], h);
                assert_eq!(h.next().next().next(), h);
                assert_eq!(h.next().prev(), h);
            }
        }
    }
}
