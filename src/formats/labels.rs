//! Labels: the names that a file gives to parts of its surface, and which of them count.
//!
//! A reader tells the label of its triangles as it finds them; at the end only labels that triangles have are left, in the order
//! of their first triangles, each with a tag (the number that meshes carry) and a name that every mesher takes.

use super::Notes;
use crate::settings::LabelSource;
use planish_core::CertifiedAtlas;
use planish_core::mesh::TriangleSoup;
use planish_core::topology::ChartId;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};

/// A file has at most so many labels, unless they are asked for by name: where there are more, they number triangles or
/// patches of a texture, and every one would be a chart at least.
const MOST: usize = 1_000;

/// Characters of the name of a group, at most: CGNS cuts longer names off, so that two could become one.
const GROUP: usize = 32;

/// The name of triangles that have none, beside others that have.
const UNNAMED: &str = "unnamed";

/// A part of the surface that has a name in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Label {
    /// The number that meshes carry: that of the file, where all of its numbers are positive and differ; else 1, 2, 3, ...
    pub tag: i32,
    /// The name in the file; of a number, with the name of the array that holds it.
    pub name: String,
    /// The name of the physical group in files for meshers: at most 32 letters, digits and signs, none of them blank, unlike
    /// that of any other.
    pub group: String,
}

/// A label as a reader finds it: its name, and its number where it has one.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
struct Found {
    name: String,
    number: Option<i64>,
}

/// Labels of triangles, as a reader finds them.
#[derive(Clone, Debug)]
pub(super) struct Labels {
    source: LabelSource,
    found: Vec<Found>,
    index: HashMap<Found, u32>,
    /// Per triangle so far, its label among those found.
    of_triangle: Vec<u32>,
}

/// What was asked for is not there, or cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LabelError {
    /// There is no such array.
    #[error(
        "there is nothing called {asked} that could label triangles: {}; correct --label, or leave it out",
        if there.is_empty() { "the file has no arrays of that sort".to_owned() } else { format!("there are {}", there.join(", ")) }
    )]
    Missing {
        /// The array that was asked for.
        asked: String,
        /// The names that could have been.
        there: Vec<String>,
    },
    /// The array holds numbers that are no labels.
    #[error(
        "{asked} holds {value} for triangle {triangle}, which is no whole number: it is no array of labels; name another one with --label"
    )]
    NotWhole {
        /// The array that was asked for.
        asked: String,
        /// The value.
        value: String,
        /// The triangle, from 0.
        triangle: usize,
    },
}

impl Labels {
    /// No labels yet, of a file in which these count.
    pub fn new(source: &LabelSource) -> Self {
        Self { source: source.clone(), found: Vec::new(), index: HashMap::new(), of_triangle: Vec::new() }
    }

    /// The label with a name; the empty name is that of triangles without one.
    pub fn named(&mut self, name: &str) -> u32 {
        self.label(Found { name: name.trim().to_owned(), number: None })
    }

    /// The label with a number in an array, or in a group, that has a name there or none.
    pub fn numbered(&mut self, array: &str, number: i64, name: Option<&str>) -> u32 {
        let name = name.map_or_else(|| format!("{array}_{number}"), |name| name.trim().to_owned());
        self.label(Found { name, number: Some(number) })
    }

    fn label(&mut self, found: Found) -> u32 {
        if let Some(known) = self.index.get(&found) {
            return *known;
        }
        let label = self.found.len() as u32;
        self.index.insert(found.clone(), label);
        self.found.push(found);
        label
    }

    /// All triangles from the last that has a label up to `triangles` have this one.
    pub fn fill(&mut self, triangles: usize, label: u32) {
        self.of_triangle.resize(triangles.max(self.of_triangle.len()), label);
    }

    /// The same, where nothing may be known of the triangles.
    pub fn fill_unnamed(&mut self, triangles: usize) {
        if triangles > self.of_triangle.len() {
            let label = self.named("");
            self.fill(triangles, label);
        }
    }

    /// Whether any triangle has a label with a name.
    pub fn are_there(&self) -> bool {
        self.found.iter().any(|found| !found.name.is_empty())
    }

    /// How many labels triangles have.
    pub fn distinct(&self) -> usize {
        self.of_triangle.iter().collect::<BTreeSet<_>>().len()
    }

    /// Gives a soup its labels, and tells which there are.
    pub fn apply(mut self, soup: TriangleSoup, notes: &mut Notes) -> TriangleSoup {
        if self.source == LabelSource::Ignored || !self.are_there() {
            return soup;
        }
        self.fill_unnamed(soup.triangles().len());
        // Numbered anew in the order of first triangles, without those that no triangle has.
        let mut number = vec![u32::MAX; self.found.len()];
        let mut used = Vec::new();
        for label in &self.of_triangle {
            let number = &mut number[*label as usize];
            if *number == u32::MAX {
                *number = used.len() as u32;
                used.push(self.found[*label as usize].clone());
            }
        }
        if used.iter().all(|found| found.name.is_empty()) {
            return soup;
        }
        if used.len() > MOST && self.source == LabelSource::Usual {
            notes.remark(format!(
                "the file gives {} names to parts of its surface, more than {MOST}: they are left out; ask for them with \
                 --label, where each shall be a chart of its own",
                used.len()
            ));
            return soup;
        }
        notes.labels = finished(&used);
        soup.with_labels(self.of_triangle.iter().map(|label| number[*label as usize]).collect())
    }
}

/// The labels with their tags and groups.
fn finished(used: &[Found]) -> Vec<Label> {
    let mut labels = Vec::with_capacity(used.len());
    let mut groups = BTreeSet::new();
    for (found, tag) in used.iter().zip(tags(used)) {
        let name = if found.name.is_empty() { UNNAMED.to_owned() } else { found.name.clone() };
        let group = unlike(&group_name(&name), &groups);
        // Some formats do not tell capital letters from small ones.
        groups.insert(group.to_lowercase());
        labels.push(Label { tag, name, group });
    }
    labels
}

/// The numbers of the file, where all are tags; else 1, 2, 3, ...
fn tags(used: &[Found]) -> Vec<i32> {
    let of_file: Vec<i32> =
        used.iter().filter_map(|f| i32::try_from(f.number?).ok()).filter(|number| *number > 0).collect();
    let differ = of_file.iter().collect::<BTreeSet<_>>().len() == used.len();
    if differ { of_file } else { (1..).take(used.len()).collect() }
}

/// A name as every mesher takes it: without blanks, at which Netgen cuts names, without commas and equals signs, at which Abaqus
/// does, and without other signs that mean something in one format or another.
fn group_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_-.".contains(c);
    let plain: String = name.chars().map(|c| if is_plain(c) { c } else { '_' }).take(GROUP).collect();
    // Names of sets begin with a letter in Abaqus.
    let begins = plain.starts_with(|c: char| c.is_ascii_alphabetic());
    if begins { plain } else { format!("g_{plain}").chars().take(GROUP).collect() }
}

/// The name, with a number behind it where there is one like it already.
fn unlike(name: &str, groups: &BTreeSet<String>) -> String {
    let with = |k: usize| {
        let suffix = if k == 1 { String::new() } else { format!("_{k}") };
        let begin: String = name.chars().take(GROUP - suffix.len()).collect();
        begin + &suffix
    };
    // Of one more than there are groups, one is new.
    let mut candidates = (1..=groups.len() + 1).map(with);
    candidates.find(|name| !groups.contains(&name.to_lowercase())).unwrap_or_else(|| name.to_owned())
}

/// Arrays whose numbers or words are taken for labels where none is asked for, the first of them that a file has; capital and
/// small letters count alike. Those of VTK's and ParaView's filters, vmtk, SimVascular, Gmsh, MEDIT (as meshio writes it), and
/// what people call them.
pub(super) const USUAL_ARRAYS: [&str; 30] = [
    "label",
    "labels",
    "name",
    "names",
    "group",
    "groups",
    "groupids",
    "modelfaceid",
    "cellentityids",
    "gmsh:physical",
    "medit:ref",
    "cell_tags",
    "celltags",
    "patch",
    "patch_id",
    "patchid",
    "boundary",
    "boundary_id",
    "boundaryid",
    "zone",
    "zone_id",
    "region",
    "regions",
    "region_id",
    "regionid",
    "material",
    "materials",
    "material_id",
    "materialid",
    "materialids",
];

/// Which of a file's arrays labels triangles: the one that is asked for, or the first with a usual name.
///
/// # Errors
/// [`LabelError::Missing`] where one is asked for that is not there.
pub(super) fn chosen<'a>(
    there: impl Iterator<Item = &'a str> + Clone,
    source: &LabelSource,
) -> Result<Option<&'a str>, LabelError> {
    if *source != LabelSource::Usual {
        return asked(there, source);
    }
    let mut usual = USUAL_ARRAYS.iter();
    Ok(usual.find_map(|name| there.clone().find(|array| array.eq_ignore_ascii_case(name))))
}

/// The one of these that is asked for; none where none is.
///
/// # Errors
/// [`LabelError::Missing`] where it is not there.
pub(super) fn asked<'a>(
    there: impl Iterator<Item = &'a str> + Clone,
    source: &LabelSource,
) -> Result<Option<&'a str>, LabelError> {
    let LabelSource::Array(asked) = source else { return Ok(None) };
    match there.clone().find(|array| array == asked) {
        Some(array) => Ok(Some(array)),
        None => Err(LabelError::Missing { asked: asked.clone(), there: there.map(str::to_owned).collect() }),
    }
}

/// The position of the label of a chart in the list; none where there are no labels.
pub fn label_index(atlas: &CertifiedAtlas, chart: ChartId, labels: &[Label]) -> Option<usize> {
    atlas.label(chart).map(|label| label as usize).filter(|label| *label < labels.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn soup(triangles: usize) -> TriangleSoup {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        TriangleSoup::new(points, vec![[0, 1, 2]; triangles]).expect("sound")
    }

    fn applied(labels: Labels, triangles: usize, source: &LabelSource) -> (Vec<u32>, Vec<Label>, usize) {
        let mut notes = Notes::default();
        let soup = Labels { source: source.clone(), ..labels }.apply(soup(triangles), &mut notes);
        (soup.labels().to_vec(), notes.labels, notes.remarks.len())
    }

    #[test]
    fn labels_that_triangles_have_are_left_with_tags_and_names_of_groups() {
        let mut labels = Labels::new(&LabelSource::Usual);
        let unused = labels.named("unused");
        let wall = labels.named(" heated wall ");
        assert_eq!(unused + 1, wall);
        labels.fill(2, wall);
        let other = labels.named("Heated_Wall");
        labels.fill(3, other);
        let (of_triangle, found, remarks) = applied(labels.clone(), 4, &LabelSource::Usual);
        assert_eq!((of_triangle, remarks), (vec![0, 0, 1, 2], 0));
        let label = |tag, name: &str, group: &str| Label { tag, name: name.to_owned(), group: group.to_owned() };
        let expected = [
            label(1, "heated wall", "heated_wall"),
            label(2, "Heated_Wall", "Heated_Wall_2"),
            label(3, UNNAMED, UNNAMED),
        ];
        assert_eq!(found, expected);
        assert_eq!(applied(labels, 4, &LabelSource::Ignored), (vec![], vec![], 0));
        assert_eq!(applied(Labels::new(&LabelSource::Usual), 4, &LabelSource::Usual), (vec![], vec![], 0));
    }

    #[test]
    fn numbers_of_the_file_are_tags_where_all_can_be() {
        let with = |numbers: &[i64]| {
            let mut labels = Labels::new(&LabelSource::Usual);
            for (i, number) in numbers.iter().enumerate() {
                let label = labels.numbered("part", *number, None);
                labels.fill(i + 1, label);
            }
            let found = applied(labels, numbers.len(), &LabelSource::Usual).1;
            found.into_iter().map(|label| (label.tag, label.name)).collect::<Vec<_>>()
        };
        assert_eq!(with(&[30, 7]), [(30, "part_30".to_owned()), (7, "part_7".to_owned())]);
        assert_eq!(with(&[0, 7]), [(1, "part_0".to_owned()), (2, "part_7".to_owned())]);
        assert_eq!(with(&[1 << 40, 7])[0].0, 1);
    }

    #[test]
    fn names_that_number_triangles_are_left_out_unless_they_are_asked_for() {
        let mut labels = Labels::new(&LabelSource::Usual);
        for i in 0..=MOST {
            let label = labels.numbered("id", i as i64 + 1, None);
            labels.fill(i + 1, label);
        }
        let (of_triangle, found, remarks) = applied(labels.clone(), MOST + 1, &LabelSource::Usual);
        assert_eq!((of_triangle.len(), found.len(), remarks), (0, 0, 1));
        assert_eq!(applied(labels, MOST + 1, &LabelSource::Array("id".to_owned())).1.len(), MOST + 1);
    }

    #[test]
    fn groups_are_told_apart_by_what_every_format_keeps() {
        let long = "a".repeat(40);
        let names = ["3 mm", &long, &format!("{long}b"), "a,b=c", "é", ""];
        let mut labels = Labels::new(&LabelSource::Usual);
        for (i, name) in names.into_iter().enumerate() {
            let label = labels.named(name);
            labels.fill(i + 1, label);
        }
        let groups: Vec<String> =
            applied(labels, names.len(), &LabelSource::Usual).1.into_iter().map(|label| label.group).collect();
        let cut = "a".repeat(30) + "_2";
        assert_eq!(groups, ["g_3_mm", &"a".repeat(32), &cut, "a_b_c", "g__", "unnamed"]);
    }

    #[test]
    fn arrays_are_taken_by_their_usual_names_or_the_one_asked_for() {
        let there = || ["Normals", "RegionId", "Label"].into_iter();
        assert_eq!(chosen(there(), &LabelSource::Usual), Ok(Some("Label")));
        assert_eq!(chosen(["Normals"].into_iter(), &LabelSource::Usual), Ok(None));
        assert_eq!(chosen(there(), &LabelSource::Ignored), Ok(None));
        assert_eq!(chosen(there(), &LabelSource::Array("Normals".to_owned())), Ok(Some("Normals")));
        let missing = chosen(there(), &LabelSource::Array("label".to_owned())).expect_err("another name");
        assert!(
            missing.to_string().contains("nothing called label") && missing.to_string().contains("RegionId, Label")
        );
    }
}
