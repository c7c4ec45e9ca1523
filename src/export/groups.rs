//! Which charts and curves have names in the files of a mesher.
//!
//! Surfaces have the name of their label; where there are no labels, each chart has a group of its own, as only what is in a
//! group is saved by Gmsh, and as some formats tell surfaces apart by groups alone. Curves have groups where they mean
//! something to the user: at the open boundary, and along features that were asked for. Mere seams have none: MFEM would take
//! them for the boundary of a closed surface, CalculiX for trusses.

use super::Wanted;
use crate::formats::gmsh::Group;
use crate::formats::{Label, label_index};
use planish_core::CertifiedAtlas;
use planish_core::measure::bends::dihedral_cosines;
use planish_core::seams::Curve;
use planish_core::topology::CurveId;
use planish_core::vec3::distance;
use std::collections::BTreeSet;

/// A surface with more ends than this has one group for all of them: as many groups as a sieve has holes help nobody.
const MOST_ENDS: usize = 100;

/// The groups of an atlas.
pub(super) fn groups(atlas: &CertifiedAtlas, wanted: &Wanted) -> Vec<Group> {
    let mut groups = if wanted.labels.is_empty() { of_charts(atlas) } else { of_labels(atlas, wanted) };
    let mut last = groups.iter().map(|group| group.tag).max().unwrap_or(0);
    let mut taken: BTreeSet<String> = groups.iter().map(|group| group.name.to_lowercase()).collect();
    let mut of_curves = of_ends(atlas);
    of_curves.extend(wanted.features.map(|angle| ("features".to_owned(), features(atlas, angle))));
    for (name, entities) in of_curves.into_iter().filter(|(_, entities)| !entities.is_empty()) {
        // No number may be used twice, whatever the dimension: some formats know one list of groups only.
        let Some(tag) = i32::checked_add(last, 1) else { break };
        last = tag;
        let free = (0..).map(|k| "open_".repeat(k) + &name).find(|name| !taken.contains(name)).unwrap_or_default();
        taken.insert(free.clone());
        groups.push(Group { dimension: 1, tag, name: free, entities });
    }
    groups
}

fn of_charts(atlas: &CertifiedAtlas) -> Vec<Group> {
    let group = |c: usize| Group { dimension: 2, tag: c as i32 + 1, name: format!("chart_{c}"), entities: vec![c] };
    (0..atlas.charts().len()).map(group).collect()
}

fn of_labels(atlas: &CertifiedAtlas, wanted: &Wanted) -> Vec<Group> {
    let group = |label: &Label| Group { dimension: 2, tag: label.tag, name: label.group.clone(), entities: Vec::new() };
    let mut groups: Vec<Group> = wanted.labels.iter().map(group).collect();
    for (index, chart) in atlas.charts().iter().enumerate() {
        if let Some(label) = label_index(atlas, chart.id(), wanted.labels) {
            groups[label].entities.push(index);
        }
    }
    groups
}

/// The open boundary: a group for each of its connected parts, in the order of their first curves, or one for all.
fn of_ends(atlas: &CertifiedAtlas) -> Vec<(String, Vec<usize>)> {
    let parts = atlas.seams().open_parts();
    let curves = |part: &[CurveId]| part.iter().map(|curve| curve.index()).collect::<Vec<usize>>();
    if parts.len() > MOST_ENDS || parts.len() == 1 {
        let mut all = curves(&parts.concat());
        all.sort_unstable();
        return vec![("boundary".to_owned(), all)];
    }
    parts.iter().enumerate().map(|(i, part)| (format!("boundary_{i}"), curves(part))).collect()
}

/// The seams that run along features for half of their length at least.
fn features(atlas: &CertifiedAtlas, angle: f64) -> Vec<usize> {
    let is_feature = |curve: &&Curve| sharp_length(atlas, curve, angle) >= 0.5 * curve.length();
    atlas.seams().seams().filter(is_feature).map(|curve| curve.id().index()).collect()
}

/// The length of the segments of a seam at which its two charts meet at more than an angle.
fn sharp_length(atlas: &CertifiedAtlas, curve: &Curve, angle: f64) -> f64 {
    let cosines = dihedral_cosines(atlas.charts(), curve).unwrap_or_default();
    let segments = curve.vertices().windows(2).map(|ends| [ends[0], ends[1]].map(|v| atlas.mesh().points()[v.index()]));
    let sharp = segments.zip(cosines).filter(|(_, cosine)| *cosine < angle.to_radians().cos());
    sharp.map(|([from, to], _)| distance(from, to)).sum()
}
