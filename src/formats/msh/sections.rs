//! The sections of nodes and elements, of MSH 2, MSH 4.0 and MSH 4.1.

use super::MshError;
use super::groups::Owner;
use super::nodes::Nodes;
use super::plain::Layout;
use super::shapes::{Kind, Shape};
use super::surface::Surface;
use super::values::{SectionError, Values, number};
use crate::formats::finish::BadPoints;
use crate::formats::{Limits, TooMany};
use planish_core::vec3::Vec3;

/// Checks that so many records can be there, of so many bytes each at least.
pub fn fits<'a, V: Values<'a>>(
    values: &V,
    what: &'static str,
    count: u64,
    bytes: u64,
    most: u64,
) -> Result<(), MshError> {
    let needed = count.saturating_mul(bytes);
    let left = values.left();
    if needed > left {
        return Err(MshError::Count { what, count, needed, left, location: values.location() });
    }
    Ok(TooMany::check(what, count, most)?)
}

/// Nodes on their way.
struct Growing {
    points: Vec<Vec3>,
    tags: Vec<u64>,
    bad: BadPoints,
}

impl Growing {
    /// Room for so many, which were checked.
    fn new(count: u64) -> Self {
        let count = usize::try_from(count).unwrap_or(0);
        Self { points: Vec::with_capacity(count), tags: Vec::with_capacity(count), bad: BadPoints::default() }
    }

    /// Reads the coordinates of a node.
    fn point<'a, V: Values<'a>>(&mut self, values: &mut V) -> Result<(), SectionError> {
        let begin = values.location();
        let point = [values.double()?, values.double()?, values.double()?];
        self.bad.check(self.points.len(), &point, || values.location_since(begin));
        self.points.push(point);
        Ok(())
    }

    fn finish(self) -> Result<Nodes, SectionError> {
        Ok(Nodes::new(self.points, self.tags, self.bad)?)
    }
}

/// How many numbers follow the coordinates of a node that lies on something of this dimension, where its parameters
/// are told.
fn parameters(dimension: i64) -> Result<u64, SectionError> {
    match u64::try_from(dimension) {
        Ok(dimension) if dimension <= 3 => Ok(dimension),
        _ => Err(SectionError::Value(format!("{dimension} is no dimension (0 to 3)"))),
    }
}

/// `$Nodes` of MSH 2, or `$ParametricNodes`.
pub fn nodes_2<'a, V: Values<'a>>(values: &mut V, parametric: bool, limits: &Limits) -> Result<Nodes, SectionError> {
    let count: u64 = number(values.word())?;
    values.end_line();
    fits(values, "nodes", count, V::INT + 3 * V::DOUBLE, limits.elements)?;
    let mut nodes = Growing::new(count);
    for _ in 0..count {
        nodes.tags.push(values.natural()?);
        nodes.point(values)?;
        if parametric {
            let dimension = values.int()?;
            values.skip(1, V::INT)?;
            // In volumes there are none.
            let numbers = parameters(dimension)? % 3;
            values.skip(numbers, V::DOUBLE)?;
        }
    }
    nodes.finish()
}

/// `$Nodes` of MSH 4.1.
pub fn nodes_4_1<'a, V: Values<'a>>(values: &mut V, limits: &Limits) -> Result<Nodes, SectionError> {
    values.end_line();
    let (blocks, count) = (values.size()?, values.size()?);
    values.skip(2, V::SIZE)?;
    fits(values, "nodes", count, V::SIZE + 3 * V::DOUBLE, limits.elements)?;
    let mut nodes = Growing::new(count);
    for _ in 0..blocks {
        let (dimension, _, parametric) = (values.int()?, values.int()?, values.int()?);
        let numbers = if parametric == 0 { 0 } else { parameters(dimension)? };
        let block = values.size()?;
        within(values, "nodes", block, count - nodes.tags.len() as u64, count)?;
        // All tags of a block stand before the coordinates of the first of its nodes.
        let first = nodes.tags.len();
        for _ in 0..block {
            nodes.tags.push(values.size()?);
        }
        for _ in first..nodes.tags.len() {
            nodes.point(values)?;
            values.skip(numbers, V::DOUBLE)?;
        }
    }
    all(values, "nodes", nodes.tags.len() as u64, count)?;
    nodes.finish()
}

/// `$Nodes` of MSH 4.0: the tag of each node stands before its coordinates, and there are no parameters in volumes.
pub fn nodes_4_0<'a, V: Values<'a>>(values: &mut V, limits: &Limits) -> Result<Nodes, SectionError> {
    values.end_line();
    let (blocks, count) = (values.size()?, values.size()?);
    fits(values, "nodes", count, V::INT + 3 * V::DOUBLE, limits.elements)?;
    let mut nodes = Growing::new(count);
    for _ in 0..blocks {
        let (_, dimension, parametric) = (values.int()?, values.int()?, values.int()?);
        let numbers = if parametric == 0 { 0 } else { parameters(dimension)? % 3 };
        let block = values.size()?;
        within(values, "nodes", block, count - nodes.tags.len() as u64, count)?;
        for _ in 0..block {
            nodes.tags.push(values.natural()?);
            nodes.point(values)?;
            values.skip(numbers, V::DOUBLE)?;
        }
    }
    all(values, "nodes", nodes.tags.len() as u64, count)?;
    nodes.finish()
}

/// Checks that a block has no more records than are left of those declared for all.
fn within<'a, V: Values<'a>>(
    values: &V,
    what: &'static str,
    block: u64,
    left: u64,
    count: u64,
) -> Result<(), MshError> {
    if block <= left {
        return Ok(());
    }
    Err(MshError::Sum { what, count, found: (count - left).saturating_add(block), location: values.location() })
}

/// Checks that all declared records were there.
fn all<'a, V: Values<'a>>(values: &V, what: &'static str, found: u64, count: u64) -> Result<(), MshError> {
    if found == count { Ok(()) } else { Err(MshError::Sum { what, count, found, location: values.location() }) }
}

/// The shape of elements of the type with this number.
fn shape<'a, V: Values<'a>>(values: &V, number: i64) -> Result<Shape, MshError> {
    Shape::of(number).ok_or_else(|| MshError::NoType { number, location: values.location() })
}

/// `$Elements` of MSH 2.
pub fn elements_2<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface) -> Result<(), SectionError> {
    let count: u64 = number(values.word())?;
    values.end_line();
    fits(values, "elements", count, 2 * V::INT, surface.limits.elements)?;
    if V::BINARY { blocks_2(values, surface, count) } else { lines_2(values, surface, count) }
}

/// One element after the other: tag, type, number of further tags, these, nodes.
fn lines_2<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface, count: u64) -> Result<(), SectionError> {
    for _ in 0..count {
        let (element, number, tags) = (values.natural()?, values.int()?, values.natural()?);
        let shape = shape(values, number)?;
        tags_2(values, surface, tags)?;
        match shape.kind {
            Kind::Other(kind) => {
                surface.skip(kind, 1);
                values.skip(shape.nodes as u64, V::INT)?;
            }
            _ => surface.element(values, shape, element, V::natural)?,
        }
    }
    Ok(())
}

/// The further tags of an element: the first one is that of its physical group, the second one that of its entity.
fn tags_2<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface, tags: u64) -> Result<(), SectionError> {
    surface.owner = Owner::default();
    if tags > 0 {
        surface.owner.group = values.int()?.saturating_abs();
    }
    if tags > 1 {
        surface.owner.entity = values.int()?;
    }
    values.skip(tags.saturating_sub(2), V::INT)
}

/// Elements of one type together: type, how many, number of further tags; then of each its tag, these, nodes.
fn blocks_2<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface, count: u64) -> Result<(), SectionError> {
    let mut left = count;
    while left > 0 {
        let (number, block, tags) = (values.int()?, values.natural()?, values.natural()?);
        let shape = shape(values, number)?;
        within(values, "elements", block, left, count)?;
        left -= block;
        surface.owner = Owner::default();
        if let Kind::Other(kind) = shape.kind {
            surface.skip(kind, block);
            skip_records(values, block, 1 + tags + shape.nodes as u64, V::INT)?;
            continue;
        }
        let layout = Layout { shape, tags, size: V::INT };
        let plain = values.binary().map_or(0, |binary| surface.plain(binary, layout, block));
        for _ in plain..block {
            let element = values.natural()?;
            tags_2(values, surface, tags)?;
            surface.element(values, shape, element, V::natural)?;
        }
    }
    Ok(())
}

/// `$Elements` of MSH 4.1.
pub fn elements_4_1<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface) -> Result<(), SectionError> {
    values.end_line();
    let (blocks, count) = (values.size()?, values.size()?);
    values.skip(2, V::SIZE)?;
    let how = Blocks { size: V::SIZE, tag: V::size, has_dimension_first: true };
    elements_4(values, surface, [blocks, count], how)
}

/// `$Elements` of MSH 4.0: without the least and the largest tag, and the tag of an entity stands before its dimension.
pub fn elements_4_0<'a, V: Values<'a>>(values: &mut V, surface: &mut Surface) -> Result<(), SectionError> {
    values.end_line();
    let (blocks, count) = (values.size()?, values.size()?);
    let how = Blocks { size: V::INT, tag: V::natural, has_dimension_first: false };
    elements_4(values, surface, [blocks, count], how)
}

/// How blocks of elements are written.
struct Blocks<V> {
    /// Bytes of a tag.
    size: u64,
    /// What reads a tag.
    tag: fn(&mut V) -> Result<u64, SectionError>,
    /// Whether the dimension of the entity stands before its tag.
    has_dimension_first: bool,
}

/// Elements of MSH 4, in blocks.
fn elements_4<'a, V: Values<'a>>(
    values: &mut V,
    surface: &mut Surface,
    [blocks, count]: [u64; 2],
    Blocks { size, tag, has_dimension_first }: Blocks<V>,
) -> Result<(), SectionError> {
    fits(values, "elements", count, 2 * size, surface.limits.elements)?;
    let mut left = count;
    for _ in 0..blocks {
        let [first, second] = [values.int()?, values.int()?];
        surface.owner = Owner { group: 0, entity: if has_dimension_first { second } else { first } };
        let (number, block) = (values.int()?, values.size()?);
        let shape = shape(values, number)?;
        within(values, "elements", block, left, count)?;
        left -= block;
        if let Kind::Other(kind) = shape.kind {
            surface.skip(kind, block);
            skip_records(values, block, 1 + shape.nodes as u64, size)?;
            continue;
        }
        let layout = Layout { shape, tags: 0, size };
        let plain = values.binary().map_or(0, |binary| surface.plain(binary, layout, block));
        for _ in plain..block {
            let element = tag(values)?;
            surface.element(values, shape, element, tag)?;
        }
    }
    all(values, "elements", count - left, count)?;
    Ok(())
}

/// Passes over records of so many numbers each.
fn skip_records<'a, V: Values<'a>>(values: &mut V, count: u64, numbers: u64, bytes: u64) -> Result<(), SectionError> {
    values.skip(count.checked_mul(numbers).ok_or(SectionError::End)?, bytes)
}
