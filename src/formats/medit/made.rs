//! A mesh that planish has made, as `.mesh`.

use super::MeditMesh;
use crate::formats::made::MadeMesh;

/// The bytes of the file: triangles by their corners, whose references are the numbers of their parts, or charts.
pub fn made(mesh: &MadeMesh) -> Vec<u8> {
    let triangles = mesh.triangles.iter().enumerate().map(|(t, corners)| (*corners, mesh.tag(t))).collect();
    let vertices = mesh.points.iter().map(|x| (*x, 0)).collect();
    MeditMesh { vertices, triangles, ..MeditMesh::default() }.into_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::made::tests::two;
    use crate::formats::{Format, read_alone};

    #[test]
    fn it_is_read_as_it_was_written() {
        let content = read_alone(Format::Medit, &made(&two())).expect("read");
        assert_eq!((content.soup.points(), content.soup.triangles()), (&two().points[..], &two().triangles[..]));
        assert_eq!(
            content.notes.labels.iter().map(|label| label.name.as_str()).collect::<Vec<_>>(),
            ["ref_0", "ref_7"]
        );
    }
}
