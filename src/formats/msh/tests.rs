use super::*;
use crate::formats::Limits;
use crate::formats::mutate::mutations;
use planish_core::mesh::SoupError;
use planish_core::vec3::Vec3;

fn content(bytes: &[u8]) -> Result<Content, ReadError> {
    read(&Source::alone(bytes, &Limits::default()))
}

/// How a file is written.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

use Encoding::{Ascii, Big, Little};

/// A mesh: nodes that lie on something of a dimension, with their tags, and elements of one type.
#[derive(Clone)]
struct Mesh {
    parametric: Option<i64>,
    nodes: Vec<(u64, Vec3)>,
    blocks: Vec<(i64, Vec<Vec<u64>>)>,
    /// Text of further sections before the nodes.
    more: &'static str,
    /// The surface of each block, and its physical groups; of none where nothing is told of entities.
    parts: Vec<(i64, Vec<i64>)>,
}

/// A file on its way.
struct File {
    bytes: Vec<u8>,
    encoding: Encoding,
}

impl File {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }

    fn value(&mut self, text: &str, mut bytes: Vec<u8>) {
        match self.encoding {
            Ascii => return self.text(&format!("{text} ")),
            Little => {}
            Big => bytes.reverse(),
        }
        self.bytes.extend(bytes);
    }

    fn int(&mut self, value: i64) {
        self.value(&value.to_string(), (value as i32).to_le_bytes().to_vec());
    }

    fn size(&mut self, value: u64) {
        self.value(&value.to_string(), value.to_le_bytes().to_vec());
    }

    fn double(&mut self, value: f64) {
        self.value(&value.to_string(), value.to_le_bytes().to_vec());
    }

    fn line(&mut self) {
        if self.encoding == Ascii {
            self.text("\n");
        }
    }

    fn point(&mut self, point: Vec3, parameters: i64) {
        point.into_iter().for_each(|c| self.double(c));
        (0..parameters).for_each(|p| self.double(p as f64));
    }
}

impl Mesh {
    fn file(&self, version: &str, encoding: Encoding) -> Vec<u8> {
        let mut file = File { bytes: Vec::new(), encoding };
        file.text(&format!("$MeshFormat\n{version} {} 8\n", i32::from(encoding != Ascii)));
        if encoding != Ascii {
            file.int(1);
            file.text("\n");
        }
        file.text("$EndMeshFormat\n");
        file.text(self.more);
        if version.starts_with('4') && !self.parts.is_empty() {
            self.entities(&mut file, version);
        }
        if ["4", "4.0"].contains(&version) {
            self.sections_4_0(&mut file)
        } else if version.starts_with('4') {
            self.sections_4(&mut file)
        } else {
            self.sections_2(&mut file)
        }
        file.bytes
    }

    /// A point, a curve and the surfaces; the others have physical groups, too.
    fn entities(&self, file: &mut File, version: &str) {
        let box_of_points = if version == "4.1" { 3 } else { 6 };
        file.text("$Entities\n");
        [1, 1, self.parts.len() as u64, 0].into_iter().for_each(|count| file.size(count));
        for (numbers, bounds, (tag, groups)) in [(box_of_points, false, (3, vec![71])), (6, true, (4, vec![72, 73]))] {
            self.entity(file, numbers, bounds, tag, &groups);
        }
        for (tag, groups) in &self.parts {
            self.entity(file, 6, true, *tag, groups);
        }
        file.text("\n$EndEntities\n");
    }

    fn entity(&self, file: &mut File, numbers: usize, has_bounds: bool, tag: i64, groups: &[i64]) {
        file.line();
        file.int(tag);
        (0..numbers).for_each(|number| file.double(number as f64));
        file.size(groups.len() as u64);
        groups.iter().for_each(|group| file.int(*group));
        if has_bounds {
            file.size(2);
            [4, -4].into_iter().for_each(|bound| file.int(bound));
        }
    }

    /// The physical group and the entity of a block.
    fn owner(&self, block: usize) -> [i64; 2] {
        self.parts.get(block).map_or([0, 9], |(entity, groups)| [groups.first().map_or(0, |g| g.abs()), *entity])
    }

    /// The entity of a block, from version 4 on.
    fn entity_of(&self, block: usize) -> i64 {
        self.parts.get(block).map_or(5, |part| part.0)
    }

    fn elements(&self) -> usize {
        self.blocks.iter().map(|b| b.1.len()).sum()
    }

    fn sections_2(&self, file: &mut File) {
        let name = if self.parametric.is_some() { "ParametricNodes" } else { "Nodes" };
        file.text(&format!("${name}\n{}\n", self.nodes.len()));
        for (tag, point) in &self.nodes {
            file.int(*tag as i64);
            file.point(*point, 0);
            if let Some(dimension) = self.parametric {
                file.int(dimension);
                file.int(77);
                (0..dimension % 3).for_each(|p| file.double(p as f64));
            }
            file.line();
        }
        file.text(&format!("\n$End{name}\n$Elements\n{}\n", self.elements()));
        let mut tag = 100;
        for (block, (number, elements)) in self.blocks.iter().enumerate() {
            if file.encoding != Ascii {
                [*number, elements.len() as i64, 2].into_iter().for_each(|i| file.int(i));
            }
            for nodes in elements {
                tag += 1;
                file.int(tag);
                if file.encoding == Ascii {
                    [*number, 2].into_iter().for_each(|i| file.int(i));
                }
                self.owner(block).into_iter().for_each(|i| file.int(i));
                nodes.iter().for_each(|n| file.int(*n as i64));
                file.line();
            }
        }
        file.text("\n$EndElements");
    }

    /// Nodes in two blocks.
    fn sections_4(&self, file: &mut File) {
        file.text("$Nodes\n");
        [2, self.nodes.len() as u64, 1, 9].into_iter().for_each(|i| file.size(i));
        let (first, second) = self.nodes.split_at(self.nodes.len().min(1));
        let dimension = self.parametric.unwrap_or(2);
        for block in [first, second] {
            file.line();
            [dimension, 5, i64::from(self.parametric.is_some())].into_iter().for_each(|i| file.int(i));
            file.size(block.len() as u64);
            file.line();
            block.iter().for_each(|n| file.size(n.0));
            block.iter().for_each(|n| file.point(n.1, self.parametric.unwrap_or(0)));
        }
        file.text("\n$EndNodes\n$Elements\n");
        [self.blocks.len() as u64, self.elements() as u64, 1, 9].into_iter().for_each(|i| file.size(i));
        let mut tag = 100;
        for (block, (number, elements)) in self.blocks.iter().enumerate() {
            file.line();
            [2, self.entity_of(block), *number].into_iter().for_each(|i| file.int(i));
            file.size(elements.len() as u64);
            for nodes in elements {
                tag += 1;
                file.line();
                file.size(tag);
                nodes.iter().for_each(|n| file.size(*n));
            }
        }
        file.text("\n$EndElements");
    }

    /// Tags are ints, each before the coordinates of its node.
    fn sections_4_0(&self, file: &mut File) {
        file.text("$Nodes\n");
        [2, self.nodes.len() as u64].into_iter().for_each(|i| file.size(i));
        let (first, second) = self.nodes.split_at(self.nodes.len().min(1));
        for block in [first, second] {
            file.line();
            let dimension = self.parametric.unwrap_or(2);
            [5, dimension, i64::from(self.parametric.is_some())].into_iter().for_each(|i| file.int(i));
            file.size(block.len() as u64);
            for (tag, point) in block {
                file.line();
                file.int(*tag as i64);
                file.point(*point, self.parametric.unwrap_or(0) % 3);
            }
        }
        file.text("\n$EndNodes\n$Elements\n");
        [self.blocks.len() as u64, self.elements() as u64].into_iter().for_each(|i| file.size(i));
        for (block, (number, elements)) in self.blocks.iter().enumerate() {
            file.line();
            [self.entity_of(block), 2, *number].into_iter().for_each(|i| file.int(i));
            file.size(elements.len() as u64);
            for (nodes, tag) in elements.iter().zip(101..) {
                file.line();
                file.int(tag);
                nodes.iter().for_each(|n| file.int(*n as i64));
            }
        }
        file.text("\n$EndElements");
    }
}

const ALL: [(&str, Encoding); 12] = [
    ("2", Ascii),
    ("2.0", Big),
    ("2.1", Ascii),
    ("2.2", Ascii),
    ("2.2", Little),
    ("2.2", Big),
    ("4", Ascii),
    ("4.0", Little),
    ("4.0", Big),
    ("4.1", Ascii),
    ("4.1", Little),
    ("4.1", Big),
];

/// What a mesh gives in all versions and encodings, which must be the same.
fn in_all_encodings(mesh: &Mesh) -> Content {
    let contents = ALL.map(|(version, encoding)| {
        content(&mesh.file(version, encoding)).unwrap_or_else(|e| panic!("{version} {encoding:?}: {e}"))
    });
    for (content, how) in contents.iter().zip(ALL) {
        let notes = Notes { format: contents[0].notes.format.clone(), ..content.notes.clone() };
        assert_eq!((&content.soup, &notes), (&contents[0].soup, &contents[0].notes), "{how:?}");
    }
    contents.into_iter().next().expect("some")
}

/// Two triangles of a square.
fn square() -> Mesh {
    let nodes = vec![(1, [0.0; 3]), (2, [1.0, 0.0, 0.0]), (3, [1.0, 1.0, 0.0]), (4, [0.0, 1.0, 0.0])];
    Mesh { parametric: None, nodes, blocks: vec![(2, vec![vec![1, 2, 3], vec![1, 3, 4]])], more: "", parts: vec![] }
}

fn error(bytes: &[u8]) -> MshError {
    match content(bytes) {
        Err(ReadError::Msh(e)) => e,
        other => panic!("{other:?}"),
    }
}

#[test]
fn triangles_are_read_from_all_versions() {
    let found = in_all_encodings(&square());
    assert_eq!(found.soup.points(), [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(found.soup.triangles(), [[0, 1, 2], [0, 2, 3]]);
    let formats = [("2.2", Ascii), ("4.1", Little), ("4.1", Big)]
        .map(|(version, encoding)| content(&square().file(version, encoding)).expect("read").notes.format);
    assert_eq!(formats, ["MSH 2.2, ASCII", "MSH 4.1, binary, little-endian", "MSH 4.1, binary, big-endian"]);
}

#[test]
fn tags_may_be_any_numbers() {
    for tags in [[1, 2, 3, 4], [4, 3, 2, 1], [10, 20, 30, 40], [7, 2_000_000_000, 1, 90]] {
        let mut mesh = square();
        mesh.nodes.iter_mut().zip(tags).for_each(|(node, tag)| node.0 = tag);
        let new = |n: &u64| tags[*n as usize - 1];
        mesh.blocks[0].1.iter_mut().for_each(|e| *e = e.iter().map(new).collect());
        assert_eq!(in_all_encodings(&mesh).soup, in_all_encodings(&square()).soup, "{tags:?}");
    }
    let huge = String::from_utf8(square().file("4.1", Ascii)).expect("text").replace("4 ", "18446744073709551615 ");
    let huge = huge.replacen("2 18446744073709551615 1 9", "2 4 1 9", 1);
    assert_eq!(content(huge.as_bytes()).map(|c| c.soup), Ok(in_all_encodings(&square()).soup), "{huge}");
}

#[test]
fn quads_and_elements_of_higher_order_are_taken_by_their_corners() {
    let mut mesh = square();
    let middle = |k: u64| [k as f64 / 10.0, 0.5, 0.25];
    // The nodes in the middle come first, so that the corners are renumbered.
    mesh.nodes = (11..=15).map(|k| (k, middle(k))).chain(mesh.nodes).chain([(99, [5.0; 3])]).collect();
    mesh.blocks = vec![
        (9, vec![vec![1, 2, 3, 11, 12, 13]]),
        (16, vec![vec![1, 2, 3, 4, 11, 12, 13, 14]]),
        (10, vec![vec![1, 2, 3, 4, 11, 12, 13, 14, 15]]),
        (3, vec![vec![4, 1, 2, 3]]),
    ];
    let found = in_all_encodings(&mesh);
    assert_eq!((found.notes.mid_nodes, found.notes.polygons, found.soup.points().len()), (5, 3, 5));
    assert_eq!(found.soup.points()[..4], *in_all_encodings(&square()).soup.points());
    assert_eq!(found.soup.triangles()[..3], [[0, 1, 2], [3, 0, 1], [3, 1, 2]]);
    assert_eq!(found.soup.triangles().len(), 7);
}

/// Unused ones, and nodes in the middle of edges; those of corners are told by their line, though nodes before are left out.
#[test]
fn coordinates_that_are_none_refuse_the_elements_that_have_them_at_corners_only() {
    let mut mesh = square();
    mesh.nodes.splice(0..0, [(11, [f64::NAN; 3]), (12, [f64::INFINITY; 3]), (13, [-1e300; 3])]);
    mesh.nodes.push((99, [f64::NAN; 3]));
    mesh.blocks = vec![(9, vec![vec![1, 2, 3, 11, 12, 13]]), (2, vec![vec![1, 3, 4]])];
    for (version, encoding) in ALL {
        let found = content(&mesh.file(version, encoding)).unwrap_or_else(|e| panic!("{version} {encoding:?}: {e}"));
        assert_eq!((found.soup.triangles(), found.soup.points().len()), (&[[0, 1, 2], [0, 2, 3]][..], 5));
        assert_eq!(found.soup.points()[..4], *in_all_encodings(&square()).soup.points());
    }
    mesh.nodes[4].1[1] = f64::NAN;
    let reason = content(&mesh.file("2.2", Ascii)).expect_err("a corner").reason();
    assert_eq!((reason.code, reason.location.as_deref()), (Code::NotFinite, Some("line 10")), "{reason:?}");
    assert!(reason.message.contains("1 corner is of this sort"), "{reason:?}");
}

#[test]
fn volumes_alone_are_refused_with_their_counts() {
    let mesh = Mesh { blocks: vec![(1, vec![vec![1, 2]]), (11, vec![vec![1; 10]; 11_000])], ..square() };
    for (version, encoding) in ALL {
        let error = content(&mesh.file(version, encoding)).expect_err("no surface");
        assert_eq!(error.notes().map(|notes| notes.skipped["tetrahedron"]), Some(11_000));
        let reason = error.reason();
        assert!(reason.code == Code::NoTriangles && reason.message.contains("only 1 line, 11,000 tetrahedra; their"));
    }
}

/// As PyMesh and fTetWild write: no line ends before the end of a section.
#[test]
fn binary_sections_may_end_without_a_line_break() {
    for version in ["2.2", "4.0", "4.1"] {
        let data = |end: &str| {
            let mut file = square().file(version, Little);
            for _ in 0..2 {
                file.extend(b"\n$NodeData\n1\n\"a\"\n1\n0.0\n3\n0\n1\n1\n");
                file.extend([[1, 0, 0, 0], *b"$End", [0; 4]].concat());
                file.extend(end.as_bytes());
            }
            file
        };
        let whole = data("$EndNodeData\n");
        let bare: Vec<u8> = ["\n$EndNodes", "\n$EndElements", "\n$EndMeshFormat"]
            .iter()
            .fold(whole, |file, end| replaced(&file, end.as_bytes(), end.trim_start().as_bytes()));
        assert_eq!(content(&bare).map(|c| c.soup), Ok(in_all_encodings(&square()).soup), "{version}");
        assert!(matches!(error(&data("$EndNodeDat\n")), MshError::Truncated { .. }), "{version}");
    }
}

fn replaced(file: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let at = file.windows(old.len()).position(|w| w == old).expect("it is there");
    [&file[..at], new, &file[at + old.len()..]].concat()
}

#[test]
fn other_elements_are_counted_by_kind() {
    let mut mesh = square();
    let two = mesh.blocks.remove(0);
    mesh.blocks = vec![
        (15, vec![vec![1], vec![2]]),
        (1, vec![vec![1, 2]]),
        (8, vec![vec![1, 2, 3]]),
        two,
        (4, vec![vec![1, 2, 3, 4]; 3]),
        (5, vec![vec![7; 8]]),
        (6, vec![vec![1; 6]]),
        (7, vec![vec![1; 5]]),
    ];
    let found = in_all_encodings(&mesh);
    let skipped: Vec<(&str, usize)> = found.notes.skipped.iter().map(|(k, n)| (k.as_str(), *n)).collect();
    let expected = [("hexahedron", 1), ("line", 2), ("point", 2), ("prism", 1), ("pyramid", 1), ("tetrahedron", 3)];
    assert_eq!((skipped, found.soup.triangles().len()), (expected.to_vec(), 2));
}

#[test]
fn parameters_of_nodes_are_passed_over() {
    for dimension in 0..=3 {
        let mesh = Mesh { parametric: Some(dimension), ..square() };
        assert_eq!(in_all_encodings(&mesh).soup, in_all_encodings(&square()).soup, "{dimension}");
    }
}

#[test]
fn names_are_kept_and_other_sections_passed_over() {
    let more = "$PhysicalNames\n2\n2 7 \"the side wall\"\n2 8 \"$EndNodes \"lid\"\"\n$EndPhysicalNames\n\
                a comment\n$Periodic\n$Nodes $EndPeriodicx \x01\x02 $Elements\n$EndPeriodic\n$Comments\n\n$EndComments\n";
    let found = in_all_encodings(&Mesh { more, ..square() });
    assert_eq!(found.notes.names, ["the side wall", "$EndNodes \"lid\""]);
    let mut after = square().file("4.1", Little);
    after.extend(b"\n$NodeData\n\xff\xfe$End\x00\x01\n$EndNodeData\n");
    assert!(content(&after).is_ok());
    let windows = String::from_utf8(Mesh { more, ..square() }.file("2.2", Ascii)).expect("text").replace('\n', "\r\n");
    assert_eq!(content(windows.as_bytes()), content(&Mesh { more, ..square() }.file("2.2", Ascii)));
}

#[test]
fn comments_may_come_first_and_versions_are_numbers() {
    let file = |encoding| square().file("2.2", encoding);
    for encoding in [Ascii, Little] {
        let comment = b"$Comments\n $MeshFormat of old\n$EndComments\n".to_vec();
        assert_eq!(content(&[comment, file(encoding)].concat()), content(&file(encoding)));
    }
    assert!(matches!(error(b"$Comments\n1 2\n"), MshError::Truncated { .. }));
    let text = String::from_utf8(file(Ascii)).expect("text");
    let late = error(format!("$Comments\n\n$EndComments\n{}", text.replace("2.2", "3.0")).as_bytes());
    assert_eq!(late.location().as_deref(), Some("line 5"));
    for version in ["2", "2.10", "2.1999999999999997"] {
        assert!(content(text.replace("2.2", version).as_bytes()).is_ok(), "{version}");
    }
    for version in ["2.3", "3", "4.01", "4.10001", "nan", "x"] {
        assert!(matches!(error(text.replace("2.2", version).as_bytes()), MshError::Version { .. }), "{version}");
    }
}

#[test]
fn broken_files_are_refused_with_code_and_place() {
    let two = String::from_utf8(square().file("2.2", Ascii)).expect("text");
    let four = String::from_utf8(square().file("4.1", Ascii)).expect("text");
    let nodes = "$Nodes\n4\n";
    let rows = [
        (two.replace("$Mesh", "Mesh"), Code::Malformed, Some("line 1"), "no MSH"),
        (two.replace("2.2", "1"), Code::UnsupportedFormat, Some("line 2"), "-format msh41"),
        (two.replace("2.2", "4.2"), Code::UnsupportedFormat, Some("line 2"), "4.2"),
        ("$NOD\n1\n1 0 0 0\n".to_owned(), Code::UnsupportedFormat, Some("line 1"), "version 1"),
        (two.replace("0 8", "2 8"), Code::Malformed, Some("line 2"), "neither 0"),
        (two.replace("0 8", "0 4"), Code::Malformed, Some("line 2"), "4 bytes"),
        (two.replace("0 8", "1 8"), Code::Malformed, Some("line 2"), "order of bytes"),
        (two.replace(nodes, "$Nodes\n5\n"), Code::CountMismatch, Some("line 11"), "section $Nodes ends"),
        (two.replace(nodes, "$Nodes\n3\n"), Code::CountMismatch, Some("line 9"), "goes on with \"4\""),
        (two.replace(nodes, "$Nodes\n4000000000\n"), Code::CountMismatch, Some("line 5"), "4000000000 nodes"),
        (two.replace(nodes, "$Nodes\n18446744073709551615\n"), Code::CountMismatch, Some("line 5"), "cut off"),
        (two.replace(nodes, "$Nodes\n-4\n"), Code::Malformed, Some("line 5"), "\"-4\""),
        (two.replace("2 1 0 0", "1 1 0 0"), Code::Malformed, Some("node 1"), "two nodes 1"),
        (two.replace("2 1 0 0", "-2 1 0 0"), Code::Malformed, Some("line 7"), "-2 is negative"),
        (two.replace("2 1 0 0", "2 1 nan 0"), Code::NotFinite, Some("line 7"), "NaN"),
        (two.replace("2 1 0 0", "2 1 0,5 0"), Code::Malformed, Some("line 7"), "decimal comma"),
        (four.replace("4 1 0 0", "4 1.0D+00 0 0"), Code::Malformed, Some("line 9"), "Fortran exponent"),
        (two.replace("2 1 0 0", "2 1 x 0"), Code::Malformed, Some("line 7"), "\"x\" is no number"),
        (two.replace("0 9 1 3 4", "0 9 1 3 5"), Code::Malformed, Some("line 15"), "element 102 names node 5"),
        (two.replace("102 2 2", "102 34 2"), Code::Malformed, Some("line 15"), "34 is no type"),
        (two.replace("102 2 2", "102 2 -2"), Code::Malformed, Some("line 15"), "-2 is negative"),
        (two.replace("$Elements\n2", "$Elements\n1"), Code::CountMismatch, Some("line 15"), "\"102\""),
        (two.replace("Nodes", "Knots"), Code::Malformed, None, "no section $Nodes before"),
        (two.replace("Elements", "Things"), Code::Malformed, None, "no section $Elements"),
        (two.clone() + "\n$Nodes\n0\n$EndNodes", Code::Malformed, Some("line 18"), "another section $Nodes"),
        (two.clone() + "\n$Elements\n0\n$EndElements", Code::Malformed, Some("line 18"), "another section $Elements"),
        (two.clone() + "\n$Periodic\n", Code::CountMismatch, Some("line 18"), "$Periodic"),
        (four.replace("2 4 1 9", "2 9 1 9"), Code::CountMismatch, Some("line 9"), "9 nodes"),
        (four.replace("2 4 1 9", "2 3 1 9"), Code::CountMismatch, Some("line 8"), "blocks hold 4"),
        (four.replace("2 4 1 9", "1 4 1 9"), Code::CountMismatch, Some("line 7"), "blocks hold 1"),
        (four.replace("1 2 1 9", "1 3 1 9"), Code::CountMismatch, Some("line 15"), "blocks hold 2"),
        (four.replace("1 2 1 9", "1 1 1 9"), Code::CountMismatch, Some("line 13"), "blocks hold 2"),
        (four.replace("2 5 0 3", "9 5 1 3"), Code::Malformed, Some("line 8"), "9 is no dimension"),
    ];
    for (text, code, location, word) in rows {
        let reason = content(text.as_bytes()).expect_err(&text).reason();
        assert_eq!((reason.code, reason.location.as_deref()), (code, location), "{reason:?}\n{text}");
        assert!(reason.message.contains(word), "{reason:?}");
    }
    let cloud = Mesh { blocks: Vec::new(), ..square() };
    let found = content(&cloud.file("4.1", Little));
    assert!(matches!(found, Err(ReadError::Soup { error: SoupError::NoTriangles { points: 4 }, .. })), "{found:?}");
}

#[test]
fn broken_binary_files_are_refused_with_their_byte() {
    let file = square().file("4.1", Big);
    let at = |needle: &[u8]| file.windows(needle.len()).position(|w| w == needle).expect("found");
    let with = |location: usize, new: &[u8]| {
        let mut bytes = file.clone();
        bytes[location..location + new.len()].copy_from_slice(new);
        error(&bytes)
    };
    let nodes = at(b"$Nodes\n") + 7;
    let many = with(nodes + 8, &u64::MAX.to_be_bytes());
    assert!(matches!(many, MshError::Count { what: "nodes", count: u64::MAX, needed: u64::MAX, .. }), "{many:?}");
    let point = nodes + 32 + 20 + 8;
    let mut nan = file.clone();
    nan[point..point + 8].copy_from_slice(&f64::NAN.to_be_bytes());
    let nan = content(&nan).expect_err("a corner").reason();
    assert_eq!((nan.code, nan.location), (Code::NotFinite, Some(format!("byte {point}"))), "{}", nan.message);
    let elements = at(b"$Elements\n") + 10;
    let block = with(elements + 32 + 12, &(1u64 << 63).to_be_bytes());
    assert!(matches!(block, MshError::Sum { what: "elements", count: 2, .. }), "{block:?}");
    let node = with(elements + 32 + 20 + 8, &7u64.to_be_bytes());
    let location = Location::Byte(elements + 32 + 20 + 8);
    assert_eq!(node, MshError::NoNode { element: 101, node: 7, location });
}

#[test]
fn a_file_cut_off_anywhere_is_refused() {
    for (version, encoding) in ALL {
        let more = "$PhysicalNames\n1\n2 7 \"a\"\n$EndPhysicalNames\n$Entities\n0 0 0 0\n$EndEntities\n";
        let file = Mesh { more, ..square() }.file(version, encoding);
        assert!(content(&file).is_ok());
        for end in 0..file.len() {
            let error = content(&file[..end]).expect_err("cut off");
            assert!(matches!(error, ReadError::Msh(_)), "{version} {encoding:?} {end}: {error:?}");
        }
    }
}

#[test]
fn limits_are_kept() {
    let limits = Limits { elements: 4, ..Limits::default() };
    let with = |mesh: &Mesh| read(&Source::alone(&mesh.file("2.2", Ascii), &limits));
    let of = |number, elements: usize| Mesh { blocks: vec![(number, vec![vec![1, 2, 3, 4]; elements])], ..square() };
    assert!(with(&of(3, 2)).is_ok());
    for mesh in [of(3, 3), of(4, 5)] {
        assert_eq!(with(&mesh).expect_err("too many").reason().code, Code::TooLarge);
    }
}

#[test]
fn mutated_files_do_no_harm() {
    let mut mesh = square();
    mesh.more = "$PhysicalNames\n1\n2 7 \"a\"\n$EndPhysicalNames\n";
    mesh.nodes.extend((11..=13).map(|k| (k, [0.5; 3])));
    mesh.blocks.extend([(15, vec![vec![1]]), (9, vec![vec![1, 2, 3, 11, 12, 13]]), (3, vec![vec![1, 2, 3, 4]])]);
    let mut accepted = 0;
    for parametric in [None, Some(2)] {
        for (version, encoding) in ALL {
            let file = Mesh { parametric, ..mesh.clone() }.file(version, encoding);
            accepted += mutations(&file, 5_000).filter(|bytes| content(bytes).is_ok()).count();
        }
    }
    assert!(accepted > 5_000, "{accepted}");
}

mod fields;
mod groups;
mod views;
