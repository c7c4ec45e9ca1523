//! The sections of a MEDIT file: what their records are.

/// What the records of a section give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Vertices,
    /// So many corners come first; the other nodes lie on edges and inside.
    Faces(usize),
    /// Elements that are no part of a surface.
    Other(&'static str),
}

/// A section: what its records give, and how many nodes each names before its reference.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Section {
    pub kind: Kind,
    pub nodes: u64,
}

const SECTIONS: [(&str, Kind, u64); 16] = [
    ("Vertices", Kind::Vertices, 0),
    ("Triangles", Kind::Faces(3), 3),
    ("TrianglesP2", Kind::Faces(3), 6),
    ("Quadrilaterals", Kind::Faces(4), 4),
    ("QuadrilateralsQ2", Kind::Faces(4), 9),
    ("Edges", Kind::Other("edge"), 2),
    ("EdgesP2", Kind::Other("edge"), 3),
    ("Tetrahedra", Kind::Other("tetrahedron"), 4),
    ("TetrahedraP2", Kind::Other("tetrahedron"), 10),
    ("Hexahedra", Kind::Other("hexahedron"), 8),
    // As older programs spell it.
    ("Hexaedra", Kind::Other("hexahedron"), 8),
    ("HexahedraQ2", Kind::Other("hexahedron"), 27),
    ("Prisms", Kind::Other("prism"), 6),
    ("PrismsP2", Kind::Other("prism"), 18),
    ("Pyramids", Kind::Other("pyramid"), 5),
    ("PyramidsP2", Kind::Other("pyramid"), 14),
];

impl Section {
    /// The section of a keyword; none where its records are of no use here.
    pub fn of(keyword: &[u8]) -> Option<Self> {
        let found = SECTIONS.iter().find(|(name, ..)| keyword.eq_ignore_ascii_case(name.as_bytes()));
        found.map(|(_, kind, nodes)| Self { kind: *kind, nodes: *nodes })
    }
}
