//! What follows the header of a PLY file: points, and faces and strips as triangles.

use super::PlyError;
use super::binary::Plain;
use super::face_labels::{FaceLabels, Place, SURFACE};
use super::header::{Element, Header, Property};
use super::values::Values;
use crate::formats::finish::BadPoints;
use crate::formats::location::escape;
use crate::formats::value_error::ValueError;
use crate::formats::{Limits, Notes, TooMany, polygon};
use planish_core::vec3::Vec3;

/// Names of the list of corners.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// In strips: the next corner begins another one.
const RESTART: u32 = u32::MAX;

/// Points and triangles.
pub struct Body<'h> {
    limits: &'h Limits,
    notes: &'h mut Notes,
    pub points: Vec<Vec3>,
    pub triangles: Vec<[u32; 3]>,
    pub bad: BadPoints,
    pub labels: FaceLabels,
}

/// What counts in the records of faces or strips.
#[derive(Clone, Copy)]
struct Columns {
    /// The list of corners.
    list: usize,
    /// The label.
    label: Option<usize>,
}

impl<'h> Body<'h> {
    /// Reads all elements. Those that name points wait until there are some.
    pub fn read<'a>(
        header: &Header,
        mut values: impl Values<'a>,
        limits: &'h Limits,
        notes: &'h mut Notes,
        labels: FaceLabels,
    ) -> Result<Self, PlyError> {
        let (points, triangles, bad) = (Vec::new(), Vec::new(), BadPoints::default());
        let mut body = Self { limits, notes, points, triangles, bad, labels };
        body.check(header, values.rest().len())?;
        let mut waiting = Vec::new();
        let mut has_points = false;
        for element in &header.elements {
            match element.name.as_str() {
                "vertex" => {
                    (body.points, body.bad) = read_points(element, &mut values)?;
                    has_points = true;
                }
                name if SURFACE.contains(&name) && has_points => body.surface(element, &mut values)?,
                name if SURFACE.contains(&name) => {
                    waiting.push((element, values));
                    skip(element, &mut values)?;
                }
                name => {
                    body.notes.skip(name, usize::try_from(element.count).unwrap_or(usize::MAX));
                    skip(element, &mut values)?;
                }
            }
        }
        end(values)?;
        for (element, mut values) in waiting {
            body.surface(element, &mut values)?;
        }
        Ok(body)
    }

    /// Whether the declared counts fit the bytes and the limits.
    fn check(&self, header: &Header, size: usize) -> Result<(), PlyError> {
        if !header.elements.iter().any(|e| e.name == "vertex") {
            return Err(PlyError::NoElement);
        }
        let mut left = size as u64;
        for element in &header.elements {
            let needed = element.needed(header.encoding);
            // The last value of a text needs no blank after it: one byte may be missing.
            if needed > left.saturating_add(1) {
                let (name, count, line) = (element.name.clone(), element.count, element.line);
                return Err(PlyError::Count { element: name, count, needed, left, line });
            }
            left = left.saturating_sub(needed);
            TooMany::check(&format!("{} elements", element.name), element.count, self.limits.elements)?;
        }
        Ok(())
    }

    /// Reads faces or strips.
    fn surface<'a>(&mut self, element: &Element, values: &mut impl Values<'a>) -> Result<(), PlyError> {
        let list = element.property(&CORNERS).filter(|at| element.properties[*at].count.is_some());
        let Some(list) = list else {
            if element.count == 0 {
                return Ok(());
            }
            let (element, line) = (element.name.clone(), element.line);
            return Err(PlyError::NoProperty { element, property: "list vertex_indices", line });
        };
        let strips = element.name == "tristrips";
        let columns = Columns { list, label: self.labels.position(element) };
        let plain = Plain::new(element, list, self.points.len()).filter(|_| !strips);
        let place = columns.label.map(|label| Place::new(element, list, label));
        let mut corners = Vec::new();
        let mut number = 0;
        while number < element.count {
            // As many as are plain, quickly; then the next one with care, which tells what is wrong with it; and so on.
            if let Some((binary, plain)) = values.binary().zip(plain) {
                // Each gives two triangles at most.
                let room = self.limits.elements.saturating_sub(self.triangles.len() as u64) / 2;
                let most = room.min(element.count - number);
                number += binary.faces(plain, most, place, |corners, label| self.labelled_face(corners, label));
                if number == element.count {
                    break;
                }
            }
            let label = self.record(element, columns, values, &mut corners);
            let label = label.map_err(|bad| told(bad, element, number, values))?;
            if strips {
                self.strip(&corners, label)
            } else {
                self.labelled_face(&corners, label)
            }
            self.few_enough()?;
            number += 1;
        }
        self.labels.unnamed(self.triangles.len());
        Ok(())
    }

    fn few_enough(&self) -> Result<(), PlyError> {
        Ok(TooMany::check("triangles", self.triangles.len() as u64, self.limits.elements)?)
    }

    /// Reads a record: the corners that it lists, and the value of its label.
    fn record<'a>(
        &self,
        element: &Element,
        columns: Columns,
        values: &mut impl Values<'a>,
        corners: &mut Vec<u32>,
    ) -> Result<Option<f64>, ValueError> {
        corners.clear();
        let mut label = None;
        for (p, property) in element.properties.iter().enumerate() {
            if Some(p) == columns.label {
                label = Some(label_value(values.float(property.scalar))?);
                continue;
            }
            let length = length(property, values)?;
            if p != columns.list {
                values.skip(property.scalar, length)?;
                continue;
            }
            for _ in 0..length {
                corners.push(self.corner(values.integer(property.scalar)?, element)?);
            }
        }
        values.end_record()?;
        Ok(label)
    }

    fn corner(&self, index: i64, element: &Element) -> Result<u32, ValueError> {
        let restart = index == -1 && element.name == "tristrips";
        let found = u32::try_from(index).ok().filter(|i| (*i as usize) < self.points.len());
        let points = self.points.len();
        found.or(restart.then_some(RESTART)).ok_or_else(|| {
            ValueError::Value(format!("vertex {index} is named, but there are {points} (counted from 0)"))
        })
    }

    #[inline]
    fn labelled_face(&mut self, corners: &[u32], label: Option<f64>) {
        let begin = self.triangles.len();
        self.face(corners);
        if let Some(label) = label {
            self.labels.add(label, begin, self.triangles.len());
        }
    }

    #[inline]
    fn face(&mut self, corners: &[u32]) {
        match corners {
            [] | [_] | [_, _] => self.notes.skip("face with fewer than three corners", 1),
            [a, b, c] => self.triangles.push([*a, *b, *c]),
            _ => {
                let is_doubtful = polygon::add(corners, &self.points, &mut self.triangles);
                self.notes.polygon(is_doubtful);
            }
        }
    }

    /// Every other triangle of a strip has its first two corners exchanged. Triangles that name a corner twice only
    /// lead the strip on.
    fn strip(&mut self, corners: &[u32], label: Option<f64>) {
        let begin = self.triangles.len();
        for strip in corners.split(|c| *c == RESTART) {
            for (i, corner) in strip.windows(3).enumerate() {
                let [a, b, c] = [corner[i % 2], corner[1 - i % 2], corner[2]];
                if a != b && b != c && c != a {
                    self.triangles.push([a, b, c]);
                }
            }
        }
        if let Some(label) = label {
            self.labels.add(label, begin, self.triangles.len());
        }
    }
}

/// A label. What is no number refuses no file by itself: it is told at the end.
fn label_value(value: Result<f64, ValueError>) -> Result<f64, ValueError> {
    match value {
        Err(ValueError::Value(_)) => Ok(f64::NAN),
        other => other,
    }
}

/// What is wrong with a value, with its place.
fn told<'a>(bad: ValueError, element: &Element, number: u64, values: &impl Values<'a>) -> PlyError {
    let (element, count, location) = (element.name.clone(), element.count, values.location());
    match bad {
        ValueError::End => PlyError::Truncated { element, number, count, location },
        ValueError::Value(problem) => PlyError::Value { element, number, problem, location },
    }
}

/// How many values a property has here, all of which have room in what is left.
fn length<'a>(property: &Property, values: &mut impl Values<'a>) -> Result<u64, ValueError> {
    let Some(count) = property.count else { return Ok(1) };
    let length = values.integer(count)?;
    u64::try_from(length).map_err(|_| ValueError::Value(format!("a list has the length {length}")))
}

/// Passes over all records of an element.
fn skip<'a>(element: &Element, values: &mut impl Values<'a>) -> Result<(), PlyError> {
    let passed = values.binary().and_then(|binary| binary.table(element)).is_some();
    if passed || element.properties.is_empty() {
        return Ok(());
    }
    for number in 0..element.count {
        skip_record(element, values).map_err(|bad| told(bad, element, number, values))?;
    }
    Ok(())
}

fn skip_record<'a>(element: &Element, values: &mut impl Values<'a>) -> Result<(), ValueError> {
    for property in &element.properties {
        let length = length(property, values)?;
        values.skip(property.scalar, length)?;
    }
    values.end_record()
}

/// The positions of x, y and z.
fn axes(element: &Element) -> Result<[usize; 3], PlyError> {
    let mut axes = [0; 3];
    for (axis, property) in axes.iter_mut().zip(["x", "y", "z"]) {
        let scalar = element.property(&[property]).filter(|p| element.properties[*p].count.is_none());
        let error = || PlyError::NoProperty { element: element.name.clone(), property, line: element.line };
        *axis = scalar.ok_or_else(error)?;
    }
    Ok(axes)
}

/// Reads all points, and finds those that can be no corners.
fn read_points<'a>(element: &Element, values: &mut impl Values<'a>) -> Result<(Vec<Vec3>, BadPoints), PlyError> {
    let axes = axes(element)?;
    let mut bad = BadPoints::default();
    if let Some(table) = values.binary().and_then(|binary| binary.table(element)) {
        let offset = |axis: usize| element.properties[..axis].iter().map(|p| p.scalar.size()).sum();
        let points = table.vectors(axes.map(|a| (offset(a), element.properties[a].scalar)));
        for (number, point) in points.iter().enumerate() {
            bad.check(number, point, || table.location(number));
        }
        return Ok((points, bad));
    }
    // Each point takes at least three bytes, which were counted.
    let mut points = Vec::with_capacity(usize::try_from(element.count).unwrap_or(0));
    for number in 0..element.count {
        let location = values.location();
        let point = read_point(element, axes, values).map_err(|bad| told(bad, element, number, values))?;
        bad.check(points.len(), &point, || if values.binary().is_some() { location } else { values.location() });
        points.push(point);
    }
    Ok((points, bad))
}

fn read_point<'a>(element: &Element, axes: [usize; 3], values: &mut impl Values<'a>) -> Result<Vec3, ValueError> {
    let mut point = [0.0; 3];
    for (p, property) in element.properties.iter().enumerate() {
        match axes.iter().position(|a| *a == p) {
            Some(axis) => point[axis] = values.float(property.scalar)?,
            None => {
                let length = length(property, values)?;
                values.skip(property.scalar, length)?;
            }
        }
    }
    values.end_record()?;
    Ok(point)
}

/// Nothing but blanks may follow the last record.
fn end<'a>(values: impl Values<'a>) -> Result<(), PlyError> {
    let rest = values.rest().trim_ascii();
    if rest.is_empty() {
        return Ok(());
    }
    Err(PlyError::Trailing { bytes: rest.len(), begins: escape(rest), location: values.location() })
}
