//! The physical groups of surfaces, and the entities, which label triangles.

use super::MshError;
use super::values::{SectionError, Values};
use super::{Version, told};
use crate::formats::labels::{self, Labels};
use crate::formats::numbered::Numbered;
use crate::formats::words::{Words, integer};
use crate::formats::{Notes, ReadError};
use crate::settings::LabelSource;
use std::collections::{HashMap, HashSet};

/// What labels are called where they are asked for.
const PHYSICAL: &str = "physical";
const ELEMENTARY: &str = "elementary";

/// The dimension of surfaces.
const SURFACE: i64 = 2;

/// Which group and entity the elements at hand belong to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Owner {
    /// The tag of the physical group, where elements tell it; 0 for none.
    pub group: i64,
    /// The tag of the entity.
    pub entity: i64,
}

/// The owners of triangles: those that follow each other have the same for the most part.
#[derive(Debug, Default)]
pub struct Owners(pub Vec<(Owner, usize)>);

impl Owners {
    /// All triangles from the last that has an owner up to `end` have this one.
    #[inline]
    pub fn add(&mut self, owner: Owner, end: usize) {
        match self.0.last_mut() {
            Some((last, last_end)) if *last == owner => *last_end = end,
            _ => self.0.push((owner, end)),
        }
    }
}

/// What a file tells of physical groups, beside its elements.
#[derive(Debug, Default)]
pub struct Groups {
    /// By surface, where entities tell it (from version 4 on), the first of its physical groups.
    of_surface: HashMap<i64, i64>,
    /// The surfaces that belong to several.
    in_several: HashSet<i64>,
    /// By the tag of a physical group of surfaces, its name.
    names: HashMap<i64, String>,
    /// Why the entities could not be read.
    damaged: Option<MshError>,
}

impl Groups {
    /// Reads `$PhysicalNames`: in each line one, between quotes, behind the dimension and tag of its group.
    pub fn names(&mut self, section: &[u8], notes: &mut Notes) {
        for line in section.split(|byte| *byte == b'\n') {
            let first = line.iter().position(|byte| *byte == b'"');
            let last = line.iter().rposition(|byte| *byte == b'"');
            // One alone is both.
            if let (Some(first), Some(last)) = (first, last)
                && first < last
            {
                let name = String::from_utf8_lossy(&line[first + 1..last]);
                notes.name(&name);
                self.name(&line[..first], &name);
            }
        }
    }

    /// The name of a group, behind these numbers.
    fn name(&mut self, numbers: &[u8], name: &str) {
        let mut words = Words::new(numbers, 1);
        let [dimension, tag] = [words.next(), words.next()].map(|word| integer(word?));
        if let Some(tag) = tag.filter(|_| dimension == Some(SURFACE)) {
            self.names.entry(tag).or_insert_with(|| name.to_owned());
        }
    }

    /// Reads `$Entities`, of which `values` hold no more. What is wrong with them matters at the end only.
    pub fn entities<'a, V: Values<'a>>(&mut self, mut values: V, version: Version) {
        if let Err(fault) = self.read_entities(&mut values, version) {
            // Nothing follows in what was given.
            let fault = if fault == SectionError::End { SectionError::Short } else { fault };
            self.damaged = Some(told(fault, "Entities".to_owned(), values.location()));
        }
    }

    fn read_entities<'a, V: Values<'a>>(&mut self, values: &mut V, version: Version) -> Result<(), SectionError> {
        values.end_line();
        let counts = [values.size()?, values.size()?, values.size()?, values.size()?];
        // Points of version 4.1 have a place, all else a box.
        let numbers = if version == Version::Four { 3 } else { 6 };
        for _ in 0..counts[0] {
            entity(values, numbers)?;
        }
        for _ in 0..counts[1] {
            entity(values, 6)?;
            tags(values)?;
        }
        for _ in 0..counts[2] {
            self.surface(values)?;
        }
        Ok(())
    }

    fn surface<'a, V: Values<'a>>(&mut self, values: &mut V) -> Result<(), SectionError> {
        let (surface, groups) = entity(values, 6)?;
        if let Some(first) = groups.first {
            // A negative tag turns the surface round.
            self.of_surface.insert(surface, first.saturating_abs());
        }
        if groups.count > 1 {
            self.in_several.insert(surface);
        }
        tags(values)?;
        Ok(())
    }

    /// The physical group of triangles; 0 for none.
    fn group(&self, owner: Owner) -> i64 {
        if owner.group != 0 { owner.group } else { self.of_surface.get(&owner.entity).copied().unwrap_or(0) }
    }

    /// The labels of triangles with these owners: their physical groups where they have any, or what is asked for.
    ///
    /// # Errors
    /// What is asked for is not there, or could not be read.
    pub fn labels(mut self, owners: &Owners, source: &LabelSource, notes: &mut Notes) -> Result<Labels, ReadError> {
        if let Some(damaged) = self.damaged.take() {
            if *source == LabelSource::Array(PHYSICAL.to_owned()) {
                return Err(damaged.into());
            }
            if *source == LabelSource::Usual {
                notes.remark(format!(
                    "the physical groups of surfaces could not be read, so they name no parts: {damaged}"
                ));
                return Ok(Labels::new(source));
            }
        }
        let has_groups = owners.0.iter().any(|(owner, _)| self.group(*owner) != 0);
        let has_entities = owners.0.iter().any(|(owner, _)| owner.entity != 0);
        let there = [(PHYSICAL, has_groups), (ELEMENTARY, has_entities)];
        let there = there.into_iter().filter(|(_, is_there)| *is_there).map(|(name, _)| name);
        let chosen = if *source == LabelSource::Usual { there.clone().next() } else { labels::chosen(there, source)? };
        match chosen {
            Some(PHYSICAL) => Ok(self.physical(owners, source, notes)),
            Some(ELEMENTARY) if *source != LabelSource::Usual => Ok(elementary(owners, source)),
            _ => Ok(Labels::new(source)),
        }
    }

    fn physical(&self, owners: &Owners, source: &LabelSource, notes: &mut Notes) -> Labels {
        let (mut labels, mut numbered) = (Labels::new(source), Numbered::new(PHYSICAL));
        let name = |group| self.names.get(&group).map(String::as_str).filter(|name| !name.trim().is_empty());
        for (owner, end) in &owners.0 {
            let label = match self.group(*owner) {
                0 => labels.named(""),
                group => numbered.label(group, &mut labels, name),
            };
            labels.fill(*end, label);
        }
        let several: HashSet<i64> = owners.0.iter().map(|(owner, _)| owner.entity).collect();
        let several = several.intersection(&self.in_several).count();
        if several > 0 {
            notes.remark(format!(
                "{several} of the surfaces belong to several physical groups: the first one of each names its triangles"
            ));
        }
        labels
    }
}

fn elementary(owners: &Owners, source: &LabelSource) -> Labels {
    let (mut labels, mut numbered) = (Labels::new(source), Numbered::new(ELEMENTARY));
    for (owner, end) in &owners.0 {
        let label = numbered.label(owner.entity, &mut labels, |_| None);
        labels.fill(*end, label);
    }
    labels
}

/// Tags after their number.
struct Tags {
    first: Option<i64>,
    count: u64,
}

fn tags<'a, V: Values<'a>>(values: &mut V) -> Result<Tags, SectionError> {
    let count = values.size()?;
    let first = if count > 0 { Some(values.int()?) } else { None };
    values.skip(count.saturating_sub(1), V::INT)?;
    Ok(Tags { first, count })
}

/// The tag of an entity, and those of its physical groups, which stand behind so many coordinates.
fn entity<'a, V: Values<'a>>(values: &mut V, coordinates: u64) -> Result<(i64, Tags), SectionError> {
    let tag = values.int()?;
    values.skip(coordinates, V::DOUBLE)?;
    Ok((tag, tags(values)?))
}
