//! A mesh that planish has made, as MSH 4.1, binary.
//!
//! Every chart is a surface, and has a physical group: that of its named part, or one of its own where there are no names.
//! Files in which some elements are in a group and some are not are refused by meshio, so that charts without a name get one.

use super::Binary;
use super::groups::{Group, names};
use crate::formats::fields::Field;
use crate::formats::made::MadeMesh;
use planish_core::vec3::BoundingBox;

/// Gmsh's numbers of triangles of three and six nodes.
const TRIANGLE: [i32; 2] = [2, 9];

/// The bytes of the file.
pub fn made(mesh: &MadeMesh) -> Vec<u8> {
    let by_chart = mesh.by_chart();
    let groups = groups(mesh, &by_chart);
    let mut out = Binary::new();
    names(&mut out, &groups);
    out.section("Entities", |out| entities(out, mesh, &by_chart, &groups));
    let (blocks, number) = nodes_of(mesh, &by_chart);
    out.section("Nodes", |out| nodes(out, mesh, &blocks));
    out.section("Elements", |out| elements(out, mesh, &by_chart, &number));
    mesh.of_points.iter().for_each(|field| data(&mut out, "NodeData", field, &number));
    // Elements are numbered chart by chart.
    let mut tags = vec![0; mesh.triangles.len()];
    by_chart.iter().flat_map(|(_, triangles)| triangles).zip(1..).for_each(|(t, tag)| tags[*t] = tag);
    mesh.of_cells.iter().for_each(|field| data(&mut out, "ElementData", field, &tags));
    out.bytes
}

/// Appends an array. Views of Gmsh have 1, 3 or 9 components: others are filled with zeros.
fn data(out: &mut Binary, section: &str, field: &Field, tags: &[usize]) {
    let components = [1, 3, 9].into_iter().find(|c| *c >= field.components).unwrap_or(field.components);
    // Ascending: meshio takes no others.
    let mut entries: Vec<(usize, usize)> = tags.iter().copied().zip(0..).filter(|(tag, _)| *tag > 0).collect();
    entries.sort_unstable();
    let name = field.name.replace(['"', '\n'], "_");
    out.section(section, |out| {
        out.bytes.extend(format!("1\n\"{name}\"\n1\n0\n3\n0\n{components}\n{}\n", entries.len()).bytes());
        for (tag, entry) in entries {
            out.int(tag as i32);
            for component in 0..components {
                let is_there = component < field.components;
                out.doubles(&[if is_there { field.number(entry * field.components + component) } else { 0.0 }]);
            }
        }
    });
}

fn groups(mesh: &MadeMesh, by_chart: &[(u32, Vec<usize>)]) -> Vec<Group> {
    let group = |tag, name: String, entities| Group { dimension: 2, tag, name, entities };
    let charts = || by_chart.iter().map(|(chart, _)| *chart as usize);
    if mesh.parts.is_empty() {
        return charts().map(|chart| group(chart as i32 + 1, format!("chart_{chart}"), vec![chart])).collect();
    }
    let part_of = |chart: usize| mesh.part_of_chart.get(chart).copied().flatten();
    let mut groups = Vec::new();
    for (number, part) in mesh.parts.iter().enumerate() {
        let of_part = charts().filter(|chart| part_of(*chart) == Some(number)).collect();
        groups.push(group(part.tag, part.group.clone(), of_part));
    }
    let without: Vec<usize> = charts().filter(|chart| part_of(*chart).is_none()).collect();
    if !without.is_empty() {
        let last = mesh.parts.iter().map(|part| part.tag).max().unwrap_or(0);
        groups.push(group(last.saturating_add(1), "without_name".to_owned(), without));
    }
    groups.retain(|group| !group.entities.is_empty());
    groups
}

fn entities(out: &mut Binary, mesh: &MadeMesh, by_chart: &[(u32, Vec<usize>)], groups: &[Group]) {
    for count in [0, 0, by_chart.len(), 0] {
        out.size(count);
    }
    for (chart, triangles) in by_chart {
        out.tag(*chart as usize);
        let points = triangles.iter().flat_map(|t| mesh.triangles[*t]).map(|n| mesh.points[n as usize]);
        let around = BoundingBox::of(points).unwrap_or(BoundingBox { min: [0.0; 3], max: [0.0; 3] });
        out.point(around.min);
        out.point(around.max);
        let of_chart: Vec<i32> =
            groups.iter().filter(|g| g.entities.contains(&(*chart as usize))).map(|g| g.tag).collect();
        super::physical_tags(out, &of_chart);
        out.size(0);
    }
}

/// The nodes of each chart that none before it has, and the number of each node in the file, from 1.
fn nodes_of(mesh: &MadeMesh, by_chart: &[(u32, Vec<usize>)]) -> (Vec<(u32, Vec<u32>)>, Vec<usize>) {
    let mut number = vec![0; mesh.points.len()];
    let mut last = 0;
    let mut blocks = Vec::with_capacity(by_chart.len());
    for (chart, triangles) in by_chart {
        let mut nodes = Vec::new();
        for node in triangles.iter().flat_map(|t| mesh.nodes(*t)) {
            if number[node as usize] == 0 {
                last += 1;
                number[node as usize] = last;
                nodes.push(node);
            }
        }
        blocks.push((*chart, nodes));
    }
    (blocks, number)
}

fn nodes(out: &mut Binary, mesh: &MadeMesh, blocks: &[(u32, Vec<u32>)]) {
    let total = blocks.iter().map(|(_, nodes)| nodes.len()).sum();
    super::mesh::header(out, blocks.len(), total);
    let mut last = 0;
    for (chart, nodes) in blocks {
        out.int(2);
        out.tag(*chart as usize);
        out.int(0);
        out.size(nodes.len());
        for _ in nodes {
            last += 1;
            out.size(last);
        }
        nodes.iter().for_each(|node| out.point(mesh.points[*node as usize]));
    }
}

fn elements(out: &mut Binary, mesh: &MadeMesh, by_chart: &[(u32, Vec<usize>)], number: &[usize]) {
    super::mesh::header(out, by_chart.len(), mesh.triangles.len());
    let kind = TRIANGLE[usize::from(!mesh.middles.is_empty())];
    let mut last = 0;
    for (chart, triangles) in by_chart {
        out.int(2);
        out.tag(*chart as usize);
        out.int(kind);
        out.size(triangles.len());
        for triangle in triangles {
            last += 1;
            out.size(last);
            mesh.nodes(*triangle).for_each(|node| out.size(number[node as usize]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::made::tests::two;
    use crate::formats::{Format, read_alone, read_patches};
    use crate::formats::{Limits, Source};

    #[test]
    fn charts_are_surfaces_and_parts_groups() {
        let bytes = made(&two());
        let content = read_alone(Format::Msh, &bytes).expect("read");
        let labels: Vec<_> = content.notes.labels.iter().map(|l| (l.tag, l.name.as_str())).collect();
        assert_eq!(labels, [(8, "without_name"), (7, "the_lid")]);
        let patches = read_patches(Format::Msh, &Source::alone(&bytes, &Limits::default())).expect("read");
        assert_eq!(patches.surfaces(), Some(&[1, 2][..]));
        assert_eq!(patches.points(), two().points);
    }
}
