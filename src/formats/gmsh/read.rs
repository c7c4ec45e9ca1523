//! `atlas.msh` read again: the maps through which Gmsh meshed.
//!
//! Only what [`super::atlas`] writes is read: MSH 4.1, binary, little endian, its `$Entities` and `$Parametrizations`.

use planish_core::evaluate::TriangulatedMap;
use planish_core::soundness::{HandedOverAtlas, HandedOverChart};
use planish_core::vec3::Vec3;

/// Why a file is no atlas.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AtlasError {
    /// Another format than the one that planish writes.
    #[error("it does not begin as binary MSH 4.1 of planish does; run planish again")]
    Format,
    /// A section is missing.
    #[error("there is no section ${0}; run planish again")]
    NoSection(&'static str),
    /// A section ends too early, or names what is not there.
    #[error("byte {at}: section ${section} is damaged; run planish again")]
    Damaged {
        /// The section.
        section: &'static str,
        /// Where that shows.
        at: usize,
    },
}

const HEAD: &[u8] = b"$MeshFormat\n4.1 1 8\n\x01\0\0\0\n$EndMeshFormat\n";

/// Reads the curves and charts of an atlas.
///
/// # Errors
/// [`AtlasError`].
pub fn read(bytes: &[u8]) -> Result<HandedOverAtlas, AtlasError> {
    if !bytes.starts_with(HEAD) {
        return Err(AtlasError::Format);
    }
    let mut entities = match Section::find(bytes, "Entities", HEAD.len()) {
        Err(_) => Section::find_after(bytes, "Entities", HEAD.len() - 1)?,
        found => found?,
    };
    let bounding = entities.entities()?;
    Section::find_after(bytes, "Parametrizations", entities.at)?.charts(bounding)
}

/// A section of the file, as far as it was read.
struct Section<'a> {
    bytes: &'a [u8],
    at: usize,
    name: &'static str,
}

impl<'a> Section<'a> {
    /// The section that begins at `at`.
    fn find(bytes: &'a [u8], name: &'static str, at: usize) -> Result<Self, AtlasError> {
        let head = format!("${name}\n");
        let begins = bytes.get(at..).is_some_and(|rest| rest.starts_with(head.as_bytes()));
        if begins { Ok(Self { bytes, at: at + head.len(), name }) } else { Err(AtlasError::NoSection(name)) }
    }

    /// The first section of this name after `at`. Nodes and elements before it are numbers that spell no name.
    fn find_after(bytes: &'a [u8], name: &'static str, at: usize) -> Result<Self, AtlasError> {
        let head = format!("\n${name}\n");
        let rest = &bytes[at..];
        let mut begins = memchr::memchr_iter(b'$', rest)
            .filter_map(|i| i.checked_sub(1))
            .filter(|i| rest[*i..].starts_with(head.as_bytes()));
        let found = begins.next().ok_or(AtlasError::NoSection(name))?;
        Ok(Self { bytes, at: at + found + head.len(), name })
    }

    fn damaged(&self) -> AtlasError {
        AtlasError::Damaged { section: self.name, at: self.at }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], AtlasError> {
        let taken = self.bytes.get(self.at..).and_then(|rest| rest.first_chunk::<N>());
        let taken = *taken.ok_or_else(|| self.damaged())?;
        self.at += N;
        Ok(taken)
    }

    fn int(&mut self) -> Result<i32, AtlasError> {
        self.take().map(i32::from_le_bytes)
    }

    fn double(&mut self) -> Result<f64, AtlasError> {
        self.take().map(f64::from_le_bytes)
    }

    fn point(&mut self) -> Result<Vec3, AtlasError> {
        Ok([self.double()?, self.double()?, self.double()?])
    }

    fn skip(&mut self, bytes: usize) -> Result<(), AtlasError> {
        let after = self.at.checked_add(bytes).filter(|after| *after <= self.bytes.len());
        self.at = after.ok_or_else(|| self.damaged())?;
        Ok(())
    }

    /// A number of records of so many bytes each at least, all of which must be there.
    fn count(&mut self, size: usize) -> Result<usize, AtlasError> {
        let count = u64::from_le_bytes(self.take()?);
        let left = (self.bytes.len() - self.at) / size;
        usize::try_from(count).ok().filter(|c| *c <= left).ok_or_else(|| self.damaged())
    }

    /// Passes over the physical groups of an entity.
    fn physical_tags(&mut self) -> Result<(), AtlasError> {
        let tags = self.count(4)?;
        self.skip(4 * tags)
    }

    /// Per surface the curves that bound it.
    fn entities(&mut self) -> Result<Vec<Vec<u32>>, AtlasError> {
        let (points, curves, surfaces, _) = (self.count(1)?, self.count(1)?, self.count(1)?, self.count(1)?);
        for _ in 0..points {
            self.skip(4 + 24 + 8)?;
        }
        for _ in 0..curves {
            self.skip(4 + 48)?;
            self.physical_tags()?;
            let ends = self.count(4)?;
            self.skip(4 * ends)?;
        }
        let mut bounding = Vec::new();
        for _ in 0..surfaces {
            self.skip(4 + 48)?;
            self.physical_tags()?;
            let mut of_surface = Vec::new();
            for _ in 0..self.count(4)? {
                let tag = self.int()?.unsigned_abs();
                let curve = tag.checked_sub(1).filter(|c| (*c as usize) < curves);
                of_surface.push(curve.ok_or_else(|| self.damaged())?);
            }
            bounding.push(of_surface);
        }
        Ok(bounding)
    }

    fn charts(mut self, bounding: Vec<Vec<u32>>) -> Result<HandedOverAtlas, AtlasError> {
        let (curves, surfaces) = (self.count(1)?, self.count(1)?);
        if surfaces != bounding.len() {
            return Err(self.damaged());
        }
        let mut atlas = HandedOverAtlas::default();
        for _ in 0..curves {
            self.skip(4)?;
            let mut polyline = Vec::new();
            for _ in 0..self.count(32)? {
                polyline.push(self.point()?);
                self.skip(8)?;
            }
            atlas.curves.push(polyline);
        }
        for of_surface in bounding {
            let map = self.map()?;
            atlas.charts.push(HandedOverChart { map, curves: of_surface });
        }
        let is_known = |c: &u32| (*c as usize) < atlas.curves.len();
        let known = atlas.charts.iter().flat_map(|c| &c.curves).all(is_known);
        if known { Ok(atlas) } else { Err(self.damaged()) }
    }

    fn map(&mut self) -> Result<TriangulatedMap, AtlasError> {
        self.skip(4)?;
        let nodes = self.count(88)?;
        let triangles = self.count(12)?;
        let (mut points, mut uv) = (Vec::with_capacity(nodes), Vec::with_capacity(nodes));
        for _ in 0..nodes {
            points.push(self.point()?);
            uv.push([self.double()?, self.double()?]);
            self.skip(48)?;
        }
        if points.iter().flatten().chain(uv.iter().flatten()).any(|c| !c.is_finite()) {
            return Err(self.damaged());
        }
        let mut corners = Vec::with_capacity(triangles);
        for _ in 0..triangles {
            let corner = [self.int()?, self.int()?, self.int()?];
            if corner.iter().any(|n| !usize::try_from(*n).is_ok_and(|n| n < nodes)) {
                return Err(self.damaged());
            }
            corners.push(corner.map(|n| n as u32));
        }
        Ok(TriangulatedMap::new(points, uv, corners))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_cut_or_changed_is_told_and_never_panics() {
        assert_eq!(read(b"").err(), Some(AtlasError::Format));
        assert_eq!(read(HEAD).err(), Some(AtlasError::NoSection("Entities")));
        let mut whole = HEAD.to_vec();
        whole.extend(b"$Entities\n");
        whole.extend([0_u8; 32]);
        whole.extend(b"\n$EndEntities\n$Parametrizations\n");
        whole.extend([0_u8; 16]);
        whole.extend(b"\n$EndParametrizations\n");
        assert!(read(&whole).is_ok_and(|a| a.charts.is_empty() && a.curves.is_empty()));
        for end in 0..whole.len() - 22 {
            assert!(read(&whole[..end]).is_err(), "{end} bytes");
        }
        for (byte, value) in (HEAD.len()..whole.len()).flat_map(|b| [1_u8, 255].map(|v| (b, v))) {
            let mut changed = whole.clone();
            changed[byte] = value;
            let _told_or_read = read(&changed);
        }
    }
}
