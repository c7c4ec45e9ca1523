//! Labels of triangles: physical groups, and entities.

use super::*;

/// Three surfaces: one of a group with a name, one of none, and one of two groups, turned round. One block has quads, one
/// has elements of higher order, and volumes stand between.
fn parts() -> Mesh {
    let mut mesh = square();
    mesh.nodes.extend((11..=13).map(|k| (k, [0.5; 3])));
    mesh.blocks = vec![
        (2, vec![vec![1, 2, 3]]),
        (3, vec![vec![1, 2, 3, 4]]),
        (9, vec![vec![1, 3, 4, 11, 12, 13]]),
        (4, vec![vec![1, 2, 3, 4]]),
        (2, vec![vec![2, 3, 4]; 2]),
    ];
    let surfaces = [(21, vec![7]), (22, vec![]), (23, vec![-9, 7]), (24, vec![5]), (21, vec![7])];
    mesh.parts = surfaces.into_iter().collect();
    mesh.more = "$PhysicalNames\n3\n1 7 \"no surface\"\n2 7 \"side wall\"\n2 9 \"\"\n$EndPhysicalNames\n";
    mesh
}

fn labelled(bytes: &[u8], source: &LabelSource) -> Result<Content, ReadError> {
    read(&Source { labels: source, ..Source::alone(bytes, &Limits::default()) })
}

fn asked(name: &str) -> LabelSource {
    LabelSource::Array(name.to_owned())
}

/// The tags and names of the labels of the triangles, one after the other.
fn of_triangles(content: &Content) -> Vec<(i32, &str)> {
    let labels = content.soup.labels().iter().map(|label| &content.notes.labels[*label as usize]);
    labels.map(|label| (label.tag, label.name.as_str())).collect()
}

#[test]
fn triangles_have_the_physical_groups_of_their_surfaces() {
    for (version, encoding) in ALL {
        let file = parts().file(version, encoding);
        let found = labelled(&file, &LabelSource::Usual).expect("labels");
        let (wall, none, third) = ((1, "side wall"), (2, "unnamed"), (3, "physical_9"));
        assert_eq!(of_triangles(&found), [wall, none, none, third, wall, wall], "{version} {encoding:?}");
        assert_eq!(labelled(&file, &asked("physical")), Ok(found.clone()), "{version} {encoding:?}");
        // From version 4 on a surface tells of all its groups.
        assert_eq!(found.notes.remarks.len(), usize::from(version.starts_with('4')), "{:?}", found.notes.remarks);
        let entities = labelled(&file, &asked("elementary")).expect("entities");
        let [one, two, three] = [21, 22, 23].map(|tag| (tag, format!("elementary_{tag}")));
        let expected = [&one, &two, &two, &three, &one, &one].map(|(tag, name)| (*tag, name.as_str()));
        assert_eq!(of_triangles(&entities), expected, "{version} {encoding:?}");
        let ignored = labelled(&file, &LabelSource::Ignored).expect("read");
        assert!(ignored.soup.labels().is_empty() && ignored.soup.triangles() == found.soup.triangles());
    }
}

#[test]
fn groups_that_no_triangle_has_label_nothing_and_are_refused_where_they_are_asked_for() {
    let mut mesh = parts();
    mesh.parts.iter_mut().for_each(|part| part.1.clear());
    for (version, encoding) in ALL {
        let file = mesh.file(version, encoding);
        let usual = labelled(&file, &LabelSource::Usual).expect("read");
        assert!(usual.soup.labels().is_empty() && usual.notes.remarks.is_empty());
        for name in ["physical", "side wall"] {
            let refused = labelled(&file, &asked(name)).expect_err("no group").reason();
            assert_eq!(refused.code, Code::NoLabels);
            assert!(refused.message.contains("there are elementary;"), "{refused:?}");
        }
    }
}

#[test]
fn entities_that_are_damaged_or_missing_change_no_triangle() {
    for (version, encoding) in ALL.into_iter().filter(|(version, _)| version.starts_with('4')) {
        let whole = parts().file(version, encoding);
        let place = |word: &[u8]| whole.windows(word.len()).position(|w| w == word).expect("it is there");
        let (begin, end) = (place(b"$Entities\n") + 10, place(b"\n$EndEntities"));
        let soup = labelled(&whole, &LabelSource::Ignored).expect("read").soup;
        for cut in begin..=end {
            let damaged = [&whole[..cut], &whole[end..]].concat();
            let found = labelled(&damaged, &LabelSource::Usual).expect("read");
            assert_eq!((found.soup.points(), found.soup.triangles()), (soup.points(), soup.triangles()));
            // A digit less is another number; whatever it is, it is read or told.
            let is_told = found.notes.remarks.iter().any(|remark| remark.contains("section $Entities"));
            // (The end of the line could be a byte of the last number.)
            assert!(is_told == (cut + 1 < end) || encoding == Ascii, "{version} {encoding:?}, {cut}");
            let refused = labelled(&damaged, &asked("physical"));
            let is_refused = matches!(refused, Err(ReadError::Msh(_)));
            assert_eq!(is_refused, is_told, "{version} {encoding:?}, {cut}: {refused:?}");
            assert!(labelled(&damaged, &asked("elementary")).is_ok());
        }
        let without = [&whole[..begin - 10], &whole[end + 13..]].concat();
        assert!(labelled(&without, &LabelSource::Usual).expect("read").soup.labels().is_empty());
        assert!(matches!(labelled(&without, &asked("physical")), Err(ReadError::Label(_))));
    }
    let lies = String::from_utf8(parts().file("4.1", Ascii)).expect("text");
    for lie in ["18446744073709551615 1 5 0", "1 1 18446744073709551615 0", "1 x 5 0", "-1 1 5 0"] {
        let file = lies.replacen("1 1 5 0", lie, 1);
        let remarks = labelled(file.as_bytes(), &LabelSource::Usual).expect("read").notes.remarks;
        assert!(remarks[0].contains("the physical groups of surfaces could not be read"), "{remarks:?}");
    }
}

#[test]
fn entities_may_come_last_and_partitions_have_no_groups() {
    for encoding in [Ascii, Little, Big] {
        let whole = parts().file("4.1", encoding);
        let place = |word: &[u8]| whole.windows(word.len()).position(|w| w == word).expect("it is there");
        let (begin, end) = (place(b"$PhysicalNames\n"), place(b"$Nodes\n"));
        let last = [&whole[..begin], &whole[end..], b"\n", &whole[begin..end]].concat();
        assert_eq!(labelled(&last, &LabelSource::Usual), labelled(&whole, &LabelSource::Usual));
        let partitioned =
            replaced(&whole, b"$Nodes\n", b"$PartitionedEntities\n\x00\xff 1\n$EndPartitionedEntities\n$Nodes\n");
        assert_eq!(labelled(&partitioned, &LabelSource::Usual), labelled(&whole, &LabelSource::Usual));
    }
}

/// Elements of version 2 may have any number of further tags.
#[test]
fn elements_without_tags_have_no_group() {
    let text = String::from_utf8(parts().file("2.2", Ascii)).expect("text");
    let text = text.replace("101 2 2 7 21 ", "101 2 0 ").replace("102 3 2 0 22 ", "102 3 1 7 ");
    let text = text.replace("103 9 2 9 23 ", "103 9 4 9 23 1 1 ");
    let found = labelled(text.as_bytes(), &LabelSource::Usual).expect("labels");
    let names: Vec<&str> = of_triangles(&found).into_iter().map(|label| label.1).collect();
    assert_eq!(names, ["unnamed", "side wall", "side wall", "physical_9", "side wall", "side wall"]);
}

#[test]
fn mutated_files_do_no_harm() {
    let mut accepted = 0;
    for (version, encoding) in ALL {
        let file = parts().file(version, encoding);
        for name in ["physical", "elementary"] {
            accepted += mutations(&file, 1_000).filter(|bytes| labelled(bytes, &asked(name)).is_ok()).count();
        }
        accepted += mutations(&file, 1_000).filter(|bytes| labelled(bytes, &LabelSource::Usual).is_ok()).count();
    }
    assert!(accepted > 5_000, "{accepted}");
}
