//! Binary elements with which nothing is wrong: they are read without looking at each number for what it could be.
//!
//! Whatever is not plain is left to [`Surface::element`], which tells what it is.

use super::nodes::Nodes;
use super::shapes::{Kind, Shape};
use super::surface::Surface;
use super::values::Binary;

/// How the elements of a block lie in the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub shape: Shape,
    /// Numbers before the nodes of an element.
    pub before: u64,
    /// Bytes of a number: 4 or 8.
    pub size: u64,
}

impl Surface<'_> {
    /// Adds as many elements as are plain, of at most so many; how many they are.
    pub fn plain(&mut self, binary: &mut Binary, layout: Layout, most: u64) -> u64 {
        let triangles = if layout.shape.kind == Kind::Quad { 2 } else { 1 };
        let most = most.min(self.limits.elements.saturating_sub(self.triangles.len() as u64) / triangles);
        match (layout.size, layout.shape.kind) {
            (4, Kind::Triangle) => self.records::<4, 3>(binary, layout, most),
            (4, Kind::Quad) => self.records::<4, 4>(binary, layout, most),
            (8, Kind::Triangle) => self.records::<8, 3>(binary, layout, most),
            (8, Kind::Quad) => self.records::<8, 4>(binary, layout, most),
            _ => 0,
        }
    }

    /// The same, for elements of `C` corners, and numbers of `N` bytes.
    fn records<const N: usize, const C: usize>(&mut self, binary: &mut Binary, layout: Layout, most: u64) -> u64 {
        let Some(before) = layout.before.checked_mul(layout.size).and_then(|b| usize::try_from(b).ok()) else {
            return 0;
        };
        let Some(size) = before.checked_add(N * layout.shape.nodes) else { return 0 };
        let most = usize::try_from(most).unwrap_or(usize::MAX);
        let records = binary.file[binary.at..].chunks_exact(size).take(most);
        let big = binary.big;
        let mut found = 0;
        for record in records {
            let (corners, others) = record[before..].as_chunks::<N>().0.split_at(C);
            // The first number is the tag of the element.
            let tag = record.first_chunk::<N>().map_or(u64::MAX, |tag| number(*tag, big));
            if N == size_of::<i32>() && tag > i32::MAX as u64 {
                break;
            }
            let Some(corners) = corners_of::<N, C>(&self.nodes, corners, big) else { break };
            if !others.iter().all(|node| self.mid(number(*node, big))) {
                break;
            }
            self.face(&corners);
            found += 1;
        }
        binary.at += found * size;
        found as u64
    }

    /// Marks a node as one in the middle of an edge or face; whether there is one.
    fn mid(&mut self, tag: u64) -> bool {
        self.nodes.find(tag).map(|node| self.mark(node)).is_some()
    }
}

/// The positions of all corners, if there are such nodes.
#[inline]
fn corners_of<const N: usize, const C: usize>(nodes: &Nodes, bytes: &[[u8; N]], big: bool) -> Option<[u32; C]> {
    let mut corners = [0; C];
    for (corner, bytes) in corners.iter_mut().zip(bytes) {
        *corner = nodes.find(number(*bytes, big))?;
    }
    Some(corners)
}

/// A number of `N` bytes. A negative int becomes one that is too large for a tag among ints.
#[inline]
fn number<const N: usize>(mut bytes: [u8; N], big: bool) -> u64 {
    if big {
        bytes.reverse();
    }
    let mut wide = [0; 8];
    wide[..N].copy_from_slice(&bytes);
    u64::from_le_bytes(wide)
}
