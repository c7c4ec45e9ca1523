//! The element types of Gmsh: what they are, and how many nodes they have. The corners come first.

/// What an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Triangle,
    Quad,
    /// No part of a surface.
    Other(&'static str),
}

/// A type of elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    pub kind: Kind,
    pub nodes: usize,
}

/// Types, with the number of their nodes: of all orders, with and without nodes inside.
type Types = &'static [(i64, usize)];

const TRIANGLES: Types = &[
    (2, 3),
    (9, 6),
    (20, 9),
    (21, 10),
    (22, 12),
    (23, 15),
    (24, 15),
    (25, 21),
    (42, 28),
    (43, 36),
    (44, 45),
    (45, 55),
    (46, 66),
    (52, 18),
    (53, 21),
    (54, 24),
    (55, 27),
    (56, 30),
];

const QUADS: Types = &[
    (3, 4),
    (10, 9),
    (16, 8),
    (36, 16),
    (37, 25),
    (38, 36),
    (39, 12),
    (40, 16),
    (41, 20),
    (47, 49),
    (48, 64),
    (49, 81),
    (50, 100),
    (51, 121),
    (57, 24),
    (58, 28),
    (59, 32),
    (60, 36),
    (61, 40),
];

const LINES: Types = &[(1, 2), (8, 3), (26, 4), (27, 5), (28, 6), (62, 7), (63, 8), (64, 9), (65, 10), (66, 11)];

const TETRAHEDRA: Types = &[
    (4, 4),
    (11, 10),
    (29, 20),
    (30, 35),
    (31, 56),
    (32, 22),
    (33, 28),
    (71, 84),
    (72, 120),
    (73, 165),
    (74, 220),
    (75, 286),
    (79, 34),
    (80, 40),
    (81, 46),
    (82, 52),
    (83, 58),
    (137, 16),
];

const HEXAHEDRA: Types = &[
    (5, 8),
    (12, 27),
    (17, 20),
    (92, 64),
    (93, 125),
    (94, 216),
    (95, 343),
    (96, 512),
    (97, 729),
    (98, 1000),
    (99, 32),
    (100, 44),
    (101, 56),
    (102, 68),
    (103, 80),
    (104, 92),
    (105, 104),
];

const PRISMS: Types = &[
    (6, 6),
    (13, 18),
    (18, 15),
    (90, 40),
    (91, 75),
    (106, 126),
    (107, 196),
    (108, 288),
    (109, 405),
    (110, 550),
    (111, 24),
    (112, 33),
    (113, 42),
    (114, 51),
    (115, 60),
    (116, 69),
    (117, 78),
];

const PYRAMIDS: Types = &[
    (7, 5),
    (14, 14),
    (19, 13),
    (118, 30),
    (119, 55),
    (120, 91),
    (121, 140),
    (122, 204),
    (123, 285),
    (124, 385),
    (125, 21),
    (126, 29),
    (127, 37),
    (128, 45),
    (129, 53),
    (130, 61),
    (131, 69),
];

const ALL: [(Kind, Types); 8] = [
    (Kind::Triangle, TRIANGLES),
    (Kind::Quad, QUADS),
    (Kind::Other("point"), &[(15, 1)]),
    (Kind::Other("line"), LINES),
    (Kind::Other("tetrahedron"), TETRAHEDRA),
    (Kind::Other("hexahedron"), HEXAHEDRA),
    (Kind::Other("prism"), PRISMS),
    (Kind::Other("pyramid"), PYRAMIDS),
];

impl Shape {
    /// The shape of a type.
    pub fn of(number: i64) -> Option<Self> {
        ALL.iter().find_map(|(kind, types)| {
            let found = types.iter().find(|(n, _)| *n == number);
            found.map(|(_, nodes)| Self { kind: *kind, nodes: *nodes })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_type_is_named_once() {
        let mut numbers: Vec<i64> = ALL.iter().flat_map(|(_, types)| types.iter().map(|t| t.0)).collect();
        let count = numbers.len();
        numbers.sort_unstable();
        numbers.dedup();
        assert_eq!((numbers.len(), count), (117, 117));
        assert_eq!(Shape::of(9), Some(Shape { kind: Kind::Triangle, nodes: 6 }));
        assert_eq!([0, -1, 34, 35, 84, 133, 1 << 40].map(Shape::of), [None; 7]);
    }

    #[test]
    fn prisms_of_all_orders_have_the_nodes_of_a_triangle_times_a_line() {
        for (order, number) in [(3, 90), (4, 91), (5, 106), (6, 107), (7, 108), (8, 109), (9, 110)] {
            let nodes = (order + 1) * (order + 1) * (order + 2) / 2;
            assert_eq!(Shape::of(number).map(|s| s.nodes), Some(nodes), "{number}");
        }
    }
}
