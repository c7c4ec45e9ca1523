//! Types of cells, by VTK's numbers.

/// What a cell gives to a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// A polygon of its points, in order.
    Polygon,
    /// A quadrilateral whose third and fourth points are swapped.
    Pixel,
    /// Each point from the third on makes a triangle with the two before it.
    Strip,
    /// The first points are its corners, the others lie on its edges and inside.
    Curved {
        /// How many corners.
        corners: usize,
    },
    /// Nothing.
    Other,
}

/// What cells of a type are, and the least and largest number of their points.
pub(super) fn kind(cell_type: u8) -> (Kind, usize, usize) {
    let curved = |corners, points| (Kind::Curved { corners }, points, points);
    // Lagrange and Bezier cells are of any order.
    let any_order = |corners| (Kind::Curved { corners }, corners, usize::MAX);
    match cell_type {
        TRIANGLE => (Kind::Polygon, 3, 3),
        STRIP => (Kind::Strip, 0, usize::MAX),
        POLYGON => (Kind::Polygon, 0, usize::MAX),
        8 => (Kind::Pixel, 4, 4),
        9 => (Kind::Polygon, 4, 4),
        22 => curved(3, 6),
        23 => curved(4, 8),
        28 => curved(4, 9),
        30 => curved(4, 6),
        34 => curved(3, 7),
        69 | 76 => any_order(3),
        70 | 77 => any_order(4),
        _ => (Kind::Other, 0, usize::MAX),
    }
}

pub(super) const TRIANGLE: u8 = 5;
pub(super) const STRIP: u8 = 6;
pub(super) const POLYGON: u8 = 7;
pub(super) const QUADRATIC_TRIANGLE: u8 = 22;

/// VTK's name of a type.
pub(super) fn name(cell_type: u8) -> &'static str {
    NAMES.iter().find(|(number, _)| *number == cell_type).map_or("cells of unknown type", |(_, name)| name)
}

const NAMES: [(u8, &str); 64] = [
    (0, "VTK_EMPTY_CELL"),
    (1, "VTK_VERTEX"),
    (2, "VTK_POLY_VERTEX"),
    (3, "VTK_LINE"),
    (4, "VTK_POLY_LINE"),
    (5, "VTK_TRIANGLE"),
    (6, "VTK_TRIANGLE_STRIP"),
    (7, "VTK_POLYGON"),
    (8, "VTK_PIXEL"),
    (9, "VTK_QUAD"),
    (10, "VTK_TETRA"),
    (11, "VTK_VOXEL"),
    (12, "VTK_HEXAHEDRON"),
    (13, "VTK_WEDGE"),
    (14, "VTK_PYRAMID"),
    (15, "VTK_PENTAGONAL_PRISM"),
    (16, "VTK_HEXAGONAL_PRISM"),
    (21, "VTK_QUADRATIC_EDGE"),
    (22, "VTK_QUADRATIC_TRIANGLE"),
    (23, "VTK_QUADRATIC_QUAD"),
    (24, "VTK_QUADRATIC_TETRA"),
    (25, "VTK_QUADRATIC_HEXAHEDRON"),
    (26, "VTK_QUADRATIC_WEDGE"),
    (27, "VTK_QUADRATIC_PYRAMID"),
    (28, "VTK_BIQUADRATIC_QUAD"),
    (29, "VTK_TRIQUADRATIC_HEXAHEDRON"),
    (30, "VTK_QUADRATIC_LINEAR_QUAD"),
    (31, "VTK_QUADRATIC_LINEAR_WEDGE"),
    (32, "VTK_BIQUADRATIC_QUADRATIC_WEDGE"),
    (33, "VTK_BIQUADRATIC_QUADRATIC_HEXAHEDRON"),
    (34, "VTK_BIQUADRATIC_TRIANGLE"),
    (35, "VTK_CUBIC_LINE"),
    (36, "VTK_QUADRATIC_POLYGON"),
    (37, "VTK_TRIQUADRATIC_PYRAMID"),
    (41, "VTK_CONVEX_POINT_SET"),
    (42, "VTK_POLYHEDRON"),
    (51, "VTK_PARAMETRIC_CURVE"),
    (52, "VTK_PARAMETRIC_SURFACE"),
    (53, "VTK_PARAMETRIC_TRI_SURFACE"),
    (54, "VTK_PARAMETRIC_QUAD_SURFACE"),
    (55, "VTK_PARAMETRIC_TETRA_REGION"),
    (56, "VTK_PARAMETRIC_HEX_REGION"),
    (60, "VTK_HIGHER_ORDER_EDGE"),
    (61, "VTK_HIGHER_ORDER_TRIANGLE"),
    (62, "VTK_HIGHER_ORDER_QUAD"),
    (63, "VTK_HIGHER_ORDER_POLYGON"),
    (64, "VTK_HIGHER_ORDER_TETRAHEDRON"),
    (65, "VTK_HIGHER_ORDER_WEDGE"),
    (66, "VTK_HIGHER_ORDER_PYRAMID"),
    (67, "VTK_HIGHER_ORDER_HEXAHEDRON"),
    (68, "VTK_LAGRANGE_CURVE"),
    (69, "VTK_LAGRANGE_TRIANGLE"),
    (70, "VTK_LAGRANGE_QUADRILATERAL"),
    (71, "VTK_LAGRANGE_TETRAHEDRON"),
    (72, "VTK_LAGRANGE_HEXAHEDRON"),
    (73, "VTK_LAGRANGE_WEDGE"),
    (74, "VTK_LAGRANGE_PYRAMID"),
    (75, "VTK_BEZIER_CURVE"),
    (76, "VTK_BEZIER_TRIANGLE"),
    (77, "VTK_BEZIER_QUADRILATERAL"),
    (78, "VTK_BEZIER_TETRAHEDRON"),
    (79, "VTK_BEZIER_HEXAHEDRON"),
    (80, "VTK_BEZIER_WEDGE"),
    (81, "VTK_BEZIER_PYRAMID"),
];
