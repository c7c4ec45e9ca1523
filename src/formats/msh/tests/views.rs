//! Sizes at points, from the views of nodes.

use super::*;

/// What asks for nothing.
const NONE: f64 = f64::INFINITY;

fn sized(bytes: &[u8], view: &str) -> Result<Content, ReadError> {
    read(&Source { sizes: Some(view), keeps_fields: false, ..Source::alone(bytes, &Limits::default()) })
}

/// A section of a view, with so many values for each node.
struct View {
    name: &'static str,
    step: i64,
    components: usize,
    values: Vec<(u64, f64)>,
}

impl View {
    fn of(name: &'static str, values: &[(u64, f64)]) -> Self {
        Self { name, step: 0, components: 1, values: values.to_vec() }
    }

    /// As Gmsh writes it: the tags in front are text also in binary files.
    fn section(&self, encoding: Encoding) -> Vec<u8> {
        let mut file = File { bytes: Vec::new(), encoding };
        let head = ["$NodeData\n1\n", &format!("\"{}\"\n", self.name), "1\n0.5\n4\n"].concat();
        file.text(&format!("{head}{}\n{}\n{}\n0\n", self.step, self.components, self.values.len()));
        for (node, value) in &self.values {
            file.int(*node as i64);
            (0..self.components).for_each(|_| file.double(*value));
            file.line();
        }
        file.text("\n$EndNodeData\n");
        file.bytes
    }
}

/// A square of a triangle of six nodes and one of three, whose tags have no order; with views behind its elements.
fn with_views(version: &str, encoding: Encoding, views: &[View]) -> Vec<u8> {
    let mut mesh = square();
    mesh.nodes = vec![
        (40, [0.0; 3]),
        (11, [0.5, 0.0, 0.0]),
        (7, [1.0, 0.0, 0.0]),
        (12, [1.0, 0.5, 0.0]),
        (9, [1.0, 1.0, 0.0]),
        (13, [0.5, 0.5, 0.0]),
        (8, [0.0, 1.0, 0.0]),
        (99, [5.0; 3]),
    ];
    mesh.blocks = vec![(9, vec![vec![40, 7, 9, 11, 12, 13]]), (2, vec![vec![40, 9, 8]])];
    let mut bytes = mesh.file(version, encoding);
    bytes.push(b'\n');
    views.iter().for_each(|view| bytes.extend(view.section(encoding)));
    bytes
}

/// Values of all nodes but one, also of those in the middle of sides, which are left out.
fn views() -> Vec<View> {
    let values: Vec<(u64, f64)> = [8, 9, 7, 40, 11, 12].into_iter().map(|tag| (tag, tag as f64 / 8.0)).collect();
    let mut vector = View::of("velocity", &values);
    vector.components = 3;
    let mut later = View::of("edge length", &[(9, 77.0)]);
    later.step = 1;
    let other = View::of("other", &[(7, -1.0), (9, f64::NAN), (40, 2.0)]);
    vec![vector, other, View::of("edge length", &values), later]
}

#[test]
fn views_of_nodes_tell_sizes_in_all_versions() {
    for (version, encoding) in ALL {
        let bytes = with_views(version, encoding, &views());
        let plain = content(&bytes).unwrap_or_else(|e| panic!("{version} {encoding:?}: {e}"));
        let found = sized(&bytes, "edge length").unwrap_or_else(|e| panic!("{version} {encoding:?}: {e}"));
        assert_eq!((found.soup.points(), found.soup.triangles()), (plain.soup.points(), plain.soup.triangles()));
        // Nodes in the middle of sides are left out; no triangle has the last one.
        assert_eq!(found.soup.sizes(), [5.0, 0.875, 1.125, 1.0, NONE], "{version} {encoding:?}");
        let [remark] = &found.notes.remarks[..] else { panic!("{:?}", found.notes.remarks) };
        assert!(remark.contains("edge length has several steps of time"), "{remark}");
        let other = sized(&bytes, "other").expect("sizes");
        assert_eq!(other.soup.sizes(), [2.0, NONE, NONE, NONE, NONE], "{version} {encoding:?}");
        assert!(other.notes.remarks[0].starts_with("at 3 of the 4 corners"), "{:?}", other.notes.remarks);
        assert!(plain.soup.sizes().is_empty());
    }
}

/// Partitions have a section each.
#[test]
fn sections_of_one_step_belong_together() {
    for (version, encoding) in ALL {
        let parts = [View::of("h", &[(40, 1.0), (7, 2.0)]), View::of("h", &[(9, 3.0), (8, 4.0), (40, 5.0)])];
        let found = sized(&with_views(version, encoding, &parts), "h").expect("sizes");
        assert_eq!(found.soup.sizes(), [5.0, 2.0, 3.0, 4.0, NONE]);
        assert!(found.notes.remarks.is_empty());
    }
}

#[test]
fn views_that_are_not_there_or_tell_several_numbers_are_refused() {
    for (version, encoding) in ALL {
        let bytes = with_views(version, encoding, &views());
        for (view, told) in
            [("length", "there are other, edge length;"), ("velocity", "velocity has 3 numbers at every point")]
        {
            let refused = sized(&bytes, view).expect_err(view).reason();
            assert!(refused.code == Code::NoSizes && refused.message.contains(told), "{refused:?}");
        }
        let none = sized(&with_views(version, encoding, &[]), "h").expect_err("no view").reason();
        assert!(none.code == Code::NoSizes && none.message.contains("has no arrays of points"), "{none:?}");
    }
}

#[test]
fn damaged_views_are_refused_with_their_place_where_they_are_asked_for() {
    let text = |section: &str| {
        let mut bytes = with_views("4.1", Ascii, &[View::of("g", &[(7, 1.0)])]);
        bytes.extend(section.bytes());
        bytes
    };
    let cases = [
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n9 x\n$EndNodeData\n", "\"x\" is no number"),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n9 2\n8 3\n$EndNodeData\n", "goes on with \"8\""),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n$EndNodeData\n", "2 values of nodes are declared"),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n1\n70 1\n$EndNodeData\n", "node 70 has a value, and there is none"),
        (
            "$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n18446744073709551615\n7 1\n$EndNodeData\n",
            "values of nodes are declared",
        ),
        ("$NodeData\n1\n\"h\"\n1\n0\n2\n0\n1\n$EndNodeData\n", "2 whole numbers do not tell components"),
        ("$NodeData\n1\n\"h\n1\n0\n3\n0\n1\n1\n7 1\n$EndNodeData\n", "ends before all that it declares"),
        ("$NodeData\n18446744073709551615\n\"h\"\n$EndNodeData\n", "ends before all that it declares"),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n-1\n1\n7 1\n$EndNodeData\n", "\"-1\" is no number"),
    ];
    for (section, expected) in cases {
        let bytes = text(section);
        let refused = sized(&bytes, "h").expect_err(section);
        assert!(matches!(refused, ReadError::Msh(_)), "{section}: {refused:?}");
        let refused = refused.reason();
        assert!(refused.message.contains(expected) && refused.location.is_some(), "{section}: {refused:?}");
        assert!(sized(&bytes, "g").is_ok() && content(&bytes).is_ok(), "{section}");
    }
    let cut = text("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n");
    assert!(matches!(sized(&cut, "h"), Err(ReadError::Msh(MshError::Truncated { .. }))));
    let section = View::of("h", &[(7, 1.0)]).section(Ascii);
    let early = replaced(&square().file("4.1", Ascii), b"$Nodes\n", &[&section[..], b"$Nodes\n"].concat());
    let refused = sized(&early, "h").expect_err("before the nodes").reason();
    assert!(refused.message.contains("it stands before $Nodes"), "{refused:?}");
}

#[test]
fn mutated_files_do_no_harm() {
    let mut accepted = 0;
    for (version, encoding) in ALL {
        let file = with_views(version, encoding, &views());
        accepted += mutations(&file, 1_000).filter(|bytes| sized(bytes, "edge length").is_ok()).count();
    }
    assert!(accepted > 2_000, "{accepted}");
}
