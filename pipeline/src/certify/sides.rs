//! What polygons and loops of arcs have in common: their sides, how these follow each other, and the search for two that
//! must not meet.

use super::polygons::Wrong;
use crate::evaluate::Bvh;
use crate::vec3::BoundingBox;

/// A side: its loop, and its position there.
pub(crate) type Side = (usize, usize);

/// The sides of all loops, one after another.
pub(super) fn sides_of<T>(loops: &[Vec<T>]) -> Vec<Side> {
    loops.iter().enumerate().flat_map(|(number, sides)| (0..sides.len()).map(move |i| (number, i))).collect()
}

/// How two sides follow each other; both ways in a loop of two.
#[derive(Clone, Copy, Default)]
pub(super) struct Joint {
    /// The second begins where the first ends.
    pub forward: bool,
    /// The first begins where the second ends.
    pub backward: bool,
}

impl Joint {
    /// Between two sides of loops.
    pub fn between<T>(loops: &[Vec<T>], s: Side, t: Side) -> Self {
        if s.0 != t.0 {
            return Self::default();
        }
        let count = loops[s.0].len();
        Self { forward: (s.1 + 1) % count == t.1, backward: (t.1 + 1) % count == s.1 }
    }
}

/// What `look` finds at the first pair, by number, of items whose boxes meet; nothing where it finds nothing at any. It is
/// given the pair, and how many pairs there were before that.
pub(super) fn first_found<V>(
    boxes: impl IntoIterator<Item = BoundingBox>,
    look: impl Fn([u32; 2], usize) -> Option<V>,
) -> Option<V> {
    // The tree tells pairs in an order of its own: the first by number is kept, and only those before it are looked at.
    let mut first: Option<([u32; 2], V)> = None;
    let mut before = 0;
    Bvh::new(boxes).pairs(|a, b| {
        let is_earlier = first.as_ref().is_none_or(|(pair, _)| [a, b] < *pair);
        if is_earlier && let Some(found) = look([a, b], before) {
            first = Some(([a, b], found));
        }
        before += 1;
    });
    first.map(|(_, found)| found)
}

/// The only one of `count` loops that turns left.
///
/// # Errors
/// [`Wrong::Outer`]: the second that does; where none does, the first loop.
pub(super) fn only_left(count: usize, turns_left: impl Fn(usize) -> bool) -> Result<usize, Wrong> {
    let left: Vec<usize> = (0..count).filter(|i| turns_left(*i)).collect();
    match left[..] {
        [outer] => Ok(outer),
        _ => Err(Wrong::Outer(left.get(1).copied().unwrap_or(0))),
    }
}
