//! Binary elements with which nothing is wrong: they are read without looking at each number for what it could be.
//!
//! Whatever is not plain is left to [`Surface::element`], which tells what it is.

use super::groups::Owner;
use super::nodes::NONE;
use super::shapes::{Kind, Shape};
use super::surface::Surface;
use super::values::Binary;

/// Elements whose nodes are looked up together.
const BATCH: usize = 256;

/// How the elements of a block lie in the bytes.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    pub shape: Shape,
    /// Further tags of an element, between its own and its nodes: of its physical group, and of its entity.
    pub tags: u64,
    /// Bytes of a number: 4 or 8.
    pub size: u64,
}

impl Surface<'_> {
    /// Adds as many elements as are plain, of at most so many; how many they are.
    pub fn plain(&mut self, binary: &mut Binary, layout: Layout, most: u64) -> u64 {
        if self.keeps() {
            return 0;
        }
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
        let nodes = layout.shape.nodes;
        let before = layout.tags.checked_add(1).and_then(|numbers| numbers.checked_mul(layout.size));
        let before = before.and_then(|bytes| usize::try_from(bytes).ok());
        let Some((before, size)) = before.and_then(|before| Some((before, before.checked_add(N * nodes)?))) else {
            return 0;
        };
        let most = usize::try_from(most).unwrap_or(usize::MAX).min((binary.file.len() - binary.at) / size);
        let (mut tags, mut found, big) = (Vec::new(), Vec::new(), binary.big);
        let mut done = 0;
        for batch in binary.file[binary.at..][..most * size].chunks(BATCH * size) {
            tags.clear();
            for record in batch.chunks_exact(size).take_while(|record| has_tag::<N>(record, big)) {
                tags.extend(record[before..].as_chunks::<N>().0.iter().map(|node| number(*node, big)));
            }
            self.nodes.find_all(&tags, &mut found);
            let whole = found.chunks_exact(nodes).take_while(|nodes| !nodes.contains(&NONE));
            let records = batch.chunks_exact(size).zip(whole);
            let added = records.map(|(record, nodes)| self.record::<N, C>(record, layout.tags, big, nodes)).count();
            done += added;
            if added * size < batch.len() {
                break;
            }
        }
        binary.at += done * size;
        done as u64
    }

    /// Adds an element of `C` corners, with these nodes, from its record, which has so many further tags.
    #[inline]
    fn record<const N: usize, const C: usize>(&mut self, record: &[u8], tags: u64, big: bool, nodes: &[u32]) {
        if tags > 0 {
            // Ints: only elements of version 2 have such tags.
            let tag = |at: u64| if at <= tags { int(record, at as usize, big) } else { 0 };
            self.owner = Owner { group: tag(1).saturating_abs(), entity: tag(2) };
        }
        let element = record.first_chunk::<N>().map_or(0, |tag| number(*tag, big));
        let (corners, others) = nodes.split_at(C);
        others.iter().for_each(|mid| self.mark(*mid));
        if let Some(corners) = corners.first_chunk::<C>() {
            self.face(element, corners);
        }
    }
}

/// The int at a position among those of a record; 0 where there is none.
#[inline]
fn int(record: &[u8], at: usize, big: bool) -> i64 {
    let bytes = record.as_chunks().0.get(at).copied().unwrap_or_default();
    i64::from(if big { i32::from_be_bytes(bytes) } else { i32::from_le_bytes(bytes) })
}

/// Whether an element has a tag that it may have, which is the first of its numbers: none is negative.
fn has_tag<const N: usize>(record: &[u8], big: bool) -> bool {
    let tag = record.first_chunk::<N>().map_or(u64::MAX, |tag| number(*tag, big));
    N > size_of::<i32>() || tag <= i32::MAX as u64
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
