//! A mesh that planish has made, as OBJ.

use crate::formats::made::MadeMesh;
use std::fmt::Write;

/// The bytes of the file: triangles by their corners, each named part a group.
pub fn made(mesh: &MadeMesh) -> Vec<u8> {
    let mut text = String::from("# mesh on a surface, written by planish\n");
    for [x, y, z] in &mesh.points {
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    let mut group = None;
    for (_, triangles) in mesh.by_chart() {
        for triangle in triangles {
            let name = mesh.part(triangle).map(|part| part.group.as_str());
            if name != group && !mesh.parts.is_empty() {
                let _ = writeln!(text, "g {}", name.unwrap_or("without_name"));
                group = name;
            }
            let [a, b, c] = mesh.triangles[triangle].map(|n| n + 1);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
    }
    text.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::made::tests::two;
    use crate::formats::{Format, read_alone};

    #[test]
    fn it_is_read_as_it_was_written() {
        let content = read_alone(Format::Obj, &made(&two())).expect("read");
        assert_eq!((content.soup.points(), content.soup.triangles()), (&two().points[..], &two().triangles[..]));
        assert!(content.notes.labels.iter().any(|label| label.name == "the_lid"));
    }
}
