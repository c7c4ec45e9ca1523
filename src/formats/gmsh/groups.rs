//! Physical groups: the names under which elements are found again in every file that Gmsh writes.

use super::Binary;

/// A physical group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Group {
    /// 1 for curves, 2 for surfaces.
    pub dimension: i32,
    /// Its number; positive.
    pub tag: i32,
    /// Its name: without blanks and quotes.
    pub name: String,
    /// The curves or surfaces in it, counted from 0, ascending.
    pub entities: Vec<usize>,
}

/// The groups that an entity is in: their tags.
pub(super) fn tags_of(groups: &[Group], dimension: i32, entities: usize) -> Vec<Vec<i32>> {
    let mut tags = vec![Vec::new(); entities];
    for group in groups.iter().filter(|group| group.dimension == dimension) {
        for entity in &group.entities {
            tags[*entity].push(group.tag);
        }
    }
    tags
}

/// Appends `$PhysicalNames`, which comes before the entities, as text in binary files, too.
pub(super) fn names(out: &mut Binary, groups: &[Group]) {
    if groups.is_empty() {
        return;
    }
    let mut lines = vec![groups.len().to_string()];
    lines.extend(groups.iter().map(|group| format!("{} {} \"{}\"", group.dimension, group.tag, group.name)));
    out.section("PhysicalNames", |out| out.bytes.extend(lines.join("\n").bytes()));
}
