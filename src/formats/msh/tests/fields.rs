//! Fields, from the views of nodes and elements.

use super::*;
use crate::formats::fields::{Field, Fields, Values};

/// A section of a view.
struct View<'a> {
    section: &'a str,
    name: &'a str,
    step: i64,
    values: Vec<(u64, Vec<f64>)>,
}

impl View<'_> {
    fn of<'a>(section: &'a str, name: &'a str, values: &[(u64, &[f64])]) -> View<'a> {
        View { section, name, step: 0, values: values.iter().map(|(tag, values)| (*tag, values.to_vec())).collect() }
    }

    fn write(&self, encoding: Encoding) -> Vec<u8> {
        let mut file = File { bytes: Vec::new(), encoding };
        let components = self.values.first().map_or(1, |(_, values)| values.len());
        let (section, name, step) = (self.section, self.name, self.step);
        file.text(&format!("${section}\n1\n\"{name}\"\n1\n0.5\n3\n{step}\n{components}\n{}\n", self.values.len()));
        for (tag, values) in &self.values {
            file.int(*tag as i64);
            values.iter().for_each(|value| file.double(*value));
            file.line();
        }
        file.text(&format!("\n$End{section}\n"));
        file.bytes
    }
}

/// A line, a triangle of six nodes, and a quadrilateral, whose element tags are 101 to 103 in this order.
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
        (5, [-1.0, 0.0, 0.0]),
    ];
    let elements: [(i64, &[u64]); 3] = [(1, &[40, 7]), (9, &[40, 7, 9, 11, 12, 13]), (3, &[40, 9, 8, 5])];
    mesh.blocks = elements.iter().map(|(kind, nodes)| (*kind, vec![nodes.to_vec()])).collect();
    let mut bytes = mesh.file(version, encoding);
    bytes.push(b'\n');
    views.iter().for_each(|view| bytes.extend(view.write(encoding)));
    bytes
}

fn kept(bytes: &[u8]) -> (Fields, Vec<String>) {
    let content = content(bytes).expect("a surface");
    (content.fields, content.notes.remarks)
}

fn assert_floats(field: &Field, name: &str, expected: &[f64]) {
    let Values::Floats(values) = &field.values else { panic!("{field:?}") };
    let are_alike = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
    assert_eq!(field.name, name);
    assert!(values.len() == expected.len() && values.iter().zip(expected).all(are_alike), "{values:?} {expected:?}");
}

const NONE: f64 = f64::NAN;

/// Nodes in the middle of sides are left out. In version 4.0 of the tests all tags of elements are the same.
#[test]
fn views_of_nodes_and_elements_are_kept_in_all_versions() {
    let is_apart = |version: &str| !version.starts_with("4.0") && version != "4";
    for (version, encoding) in ALL.into_iter().filter(|(version, _)| is_apart(version)) {
        let views = [
            View::of("NodeData", "v", &[(8, &[1.0, 2.0, 3.0]), (11, &[9.0; 3]), (40, &[4.0, NONE, 6.0])]),
            View::of("ElementData", "stress", &[(103, &[0.5]), (101, &[7.0])]),
            View::of("NodeData", "chart", &[(7, &[1.0])]),
            View::of("ElementNodeData", "x", &[(103, &[0.5])]),
            View::of("ElementData", "stress", &[(102, &[1.5])]),
        ];
        let bytes = with_views(version, encoding, &views);
        let (found, remarks) = kept(&bytes);
        assert!(
            remarks.is_empty() && found.points.len() == 2 && found.cells.len() == 1,
            "{version} {encoding:?}: {remarks:?}"
        );
        let vector: Vec<f64> =
            [[4.0, NONE, 6.0], [NONE; 3], [NONE; 3], [1.0, 2.0, 3.0], [NONE; 3]].into_iter().flatten().collect();
        assert_eq!(found.points[0].components, 3);
        assert_floats(&found.points[0], "v", &vector);
        assert_floats(&found.points[1], "input_chart", &[NONE, 1.0, NONE, NONE, NONE]);
        assert_floats(&found.cells[0], "stress", &[1.5, 0.5, 0.5]);
        assert_eq!(found.cell, [1, 2, 2], "{version} {encoding:?}");
        let skipped = content(&bytes).expect("a surface").notes.skipped;
        assert_eq!(skipped["arrays without values to keep"], 1);
    }
}

/// Also where sections of the steps take turns.
#[test]
fn of_several_steps_the_last_one_is_kept() {
    for (version, encoding) in ALL {
        let mut views = [
            View::of("NodeData", "v", &[(8, &[1.0]), (40, &[2.0])]),
            View::of("NodeData", "v", &[(40, &[3.0])]),
            View::of("NodeData", "v", &[(7, &[4.0])]),
            View::of("ElementData", "v", &[(101, &[4.0])]),
        ];
        views[1].step = 5;
        views[2].step = 5;
        let (found, remarks) = kept(&with_views(version, encoding, &views));
        assert_floats(&found.points[0], "v", &[3.0, 4.0, NONE, NONE, NONE]);
        assert_eq!(remarks, ["the view v has several steps of time: the last one in the file, 5, is kept"]);
        assert_eq!(found.cells.len(), 1);
    }
}

#[test]
fn what_is_wrong_with_a_view_is_told_and_the_others_are_kept() {
    let good = View::of("NodeData", "good", &[(7, &[1.0])]);
    let text = |bad: &str| [with_views("4.1", Ascii, std::slice::from_ref(&good)), bad.as_bytes().to_vec()].concat();
    let cases = [
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n9 x\n$EndNodeData\n", "\"x\" is no number"),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n9 2\n8 3\n$EndNodeData\n", "goes on with \"8\""),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n2\n7 1\n$EndNodeData\n", "2 values of a view are declared"),
        ("$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n1\n70 1\n$EndNodeData\n", "node 70 has a value, and there is none"),
        ("$ElementData\n1\n\"h\"\n1\n0\n3\n0\n3\n1\n101 1\n$EndElementData\n", "in section $ElementData"),
        ("$NodeData\n1\n\"h\"\n1\n0\n2\n0\n1\n$EndNodeData\n", "2 whole numbers do not tell components"),
        ("$NodeData\n18446744073709551615\n\"h\"\n$EndNodeData\n", "ends before all that it declares"),
        (
            "$NodeData\n1\n\"h\"\n1\n0\n3\n0\n1\n1\n7 1\n$EndNodeData\n$NodeData\n1\n\"h\"\n1\n0\n3\n0\n3\n0\n$EndNodeData\n",
            "the array \"h\" of points is not kept: its sections differ in their numbers of components",
        ),
    ];
    for (bad, told) in cases {
        let (found, remarks) = kept(&text(bad));
        assert!(remarks.len() == 1 && (remarks[0].contains(told) || bad.contains("ElementData")), "{bad}: {remarks:?}");
        assert_eq!((found.points.len(), found.cells.len()), (1, 0));
        assert_floats(&found.points[0], "good", &[NONE, 1.0, NONE, NONE, NONE]);
    }
    let early = |section: &str, before: &[u8]| {
        let view = View::of(section, "h", &[(7, &[1.0])]).write(Ascii);
        kept(&replaced(&square().file("4.1", Ascii), before, &[&view[..], before].concat()))
    };
    for (section, before) in [("NodeData", &b"$Nodes\n"[..]), ("ElementData", b"$Elements\n")] {
        let (found, remarks) = early(section, before);
        assert!(found.are_none() && remarks[0].contains("it stands before what it belongs to"), "{remarks:?}");
    }
    // Without nodes there is nothing to keep, however many components are declared.
    let empty = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$NodeData\n1\n\"h\"\n1\n0\n3\n0\n200000000\n0\n$EndNodeData\n$Elements\n0\n$EndElements\n";
    assert!(content(empty.as_bytes()).is_err());
    let many = "$NodeData\n1\n\"h\"\n1\n0\n3\n0\n18446744073709551615\n0\n$EndNodeData\n";
    let refused = content(&text(many)).expect_err("too many").reason();
    assert!(refused.code == Code::TooLarge && refused.message.contains("values of arrays exceed"), "{refused:?}");
}

/// Very many elements of one tag, and values for it as often.
#[test]
fn tags_that_are_the_same_take_no_time() {
    const MANY: usize = 60_000;
    let elements = "1 2 2 0 0 1 2 3\n".repeat(MANY);
    let values = "1 0.5\n".repeat(MANY);
    let text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n\
         $Elements\n{MANY}\n{elements}$EndElements\n$ElementData\n1\n\"e\"\n1\n0\n3\n0\n1\n{MANY}\n{values}$EndElementData\n"
    );
    let begun = std::time::Instant::now();
    let (found, _) = kept(text.as_bytes());
    assert_floats(&found.cells[0], "e", &[0.5; MANY]);
    assert!(begun.elapsed().as_secs() < 10, "{:?}", begun.elapsed());
}

#[test]
fn mutated_files_do_no_harm() {
    let mut fields = 0;
    for (version, encoding) in ALL {
        let views = [
            View::of("NodeData", "v", &[(8, &[1.0, 2.0, 3.0]), (11, &[9.0; 3]), (40, &[4.0, 5.0, 6.0])]),
            View::of("ElementData", "e", &[(101, &[0.5]), (102, &[7.0])]),
        ];
        for bytes in mutations(&with_views(version, encoding, &views), 1_000) {
            fields += content(&bytes).map_or(0, |content| content.fields.points.len() + content.fields.cells.len());
        }
    }
    assert!(fields > 2_000, "{fields}");
}
