//! Accessors: how vectors and indices lie in the data.

use super::buffers::Buffers;
use super::{GltfError, broken};
use gltf::json::accessor::{ComponentType, Type, sparse};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, Root, buffer};

/// Reads accessors of one document.
pub(super) struct Accessors<'a> {
    pub root: &'a Root,
    pub buffers: &'a Buffers<'a>,
    /// Elements of one accessor, at most.
    pub most: u64,
}

/// How elements lie in a view.
struct Layout<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

impl<'a> Layout<'a> {
    /// Checks that `count` elements of `size` bytes are there.
    fn new(view: (&'a [u8], Option<usize>), offset: u64, count: usize, size: usize) -> Result<Self, String> {
        let (bytes, stride) = view;
        // Without a stride, elements are packed tightly.
        let stride = stride.unwrap_or(size);
        if stride < size {
            return Err(format!("a stride of {stride} bytes for elements of {size}"));
        }
        let rest = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
        let rest = rest.ok_or_else(|| format!("byte {offset} of {}", bytes.len()))?;
        match needed_bytes(count, stride, size) {
            Some(needed) if needed <= rest.len() => Ok(Self { bytes: rest, stride, count }),
            _ => Err(format!("{count} elements, {stride} bytes apart, in {} bytes", rest.len())),
        }
    }

    /// The elements, each with what follows up to the next one; the last one with less, perhaps.
    fn elements(&self) -> impl Iterator<Item = &'a [u8]> {
        self.bytes.chunks(self.stride).take(self.count)
    }

    /// Vectors of coordinates that are told as `decode` knows.
    fn vectors<const N: usize>(&self, decode: impl Fn([u8; N]) -> f64) -> Vec<[f64; 3]> {
        let vector = |bytes: &[u8]| {
            let parts = bytes.as_chunks().0;
            [parts[0], parts[1], parts[2]].map(&decode)
        };
        self.elements().map(vector).collect()
    }

    /// Indices of so many bytes.
    fn indices<const N: usize>(&self, decode: impl Fn([u8; N]) -> u32) -> Vec<u32> {
        self.elements().map(|bytes| decode(bytes.as_chunks().0[0])).collect()
    }
}

/// The bytes that `count` elements of `size` bytes take, a stride from each to the next; none where they are too many to be
/// told. The last one need not be filled up to the stride.
fn needed_bytes(count: usize, stride: usize, size: usize) -> Option<usize> {
    match count.checked_sub(1) {
        None => Some(0),
        Some(last) => last.checked_mul(stride)?.checked_add(size),
    }
}

impl Accessors<'_> {
    /// The vectors of an accessor.
    pub fn positions(&self, index: Index<Accessor>) -> Result<Vec<[f64; 3]>, GltfError> {
        let (accessor, count) = self.get(index)?;
        let fail = |problem: String| broken(location(index), problem);
        let kind = component(&accessor.component_type).ok_or_else(|| fail("an unknown component type".to_owned()))?;
        if accessor.type_ != Checked::Valid(Type::Vec3) {
            return Err(fail("positions must be VEC3".to_owned()));
        }
        let read = |view: Index<buffer::View>, offset: u64, count: usize| {
            let layout = Layout::new(self.buffers.view(view)?, offset, count, 3 * kind.size()).map_err(fail)?;
            vectors(&layout, kind, accessor.normalized).ok_or_else(|| fail("positions cannot be U32".to_owned()))
        };
        let mut vectors = match accessor.buffer_view {
            Some(view) => read(view, accessor.byte_offset.map_or(0, |o| o.0), count)?,
            None if accessor.sparse.is_none() => return Err(self.without_data(index)),
            // Zeros, of which some are replaced below.
            None => vec![[0.0; 3]; count],
        };
        if let Some(sparse) = &accessor.sparse {
            let places = self.sparse_places(sparse, count).map_err(|e| e.at(index))?;
            let values = read(sparse.values.buffer_view, sparse.values.byte_offset.0, places.len())?;
            for (place, value) in places.into_iter().zip(values) {
                vectors[place] = value;
            }
        }
        Ok(vectors)
    }

    /// The indices of an accessor.
    pub fn indices(&self, index: Index<Accessor>) -> Result<Vec<u32>, GltfError> {
        let (accessor, count) = self.get(index)?;
        let fail = |problem: String| broken(location(index), problem);
        let kind = component(&accessor.component_type).filter(|kind| is_index(*kind));
        let kind = kind.ok_or_else(|| fail("indices must be U8, U16 or U32".to_owned()))?;
        if accessor.type_ != Checked::Valid(Type::Scalar) || accessor.sparse.is_some() {
            return Err(fail("indices must be plain scalars".to_owned()));
        }
        let view = accessor.buffer_view.ok_or_else(|| self.without_data(index))?;
        let offset = accessor.byte_offset.map_or(0, |o| o.0);
        let layout = Layout::new(self.buffers.view(view)?, offset, count, kind.size()).map_err(fail)?;
        Ok(indices(&layout, kind))
    }

    /// An accessor and its number of elements.
    fn get(&self, index: Index<Accessor>) -> Result<(&Accessor, usize), GltfError> {
        let fail = |problem: &str| broken(location(index), problem);
        let accessor = self.root.accessors.get(index.value()).ok_or_else(|| fail("there is none"))?;
        let count = accessor.count.0;
        if count > self.most {
            let problem = format!("{count} elements, more than {}", self.most);
            return Err(GltfError::TooMuch { location: location(index), problem });
        }
        Ok((accessor, usize::try_from(count).map_err(|_| fail("too many elements"))?))
    }

    /// Without data of its own, an accessor's may be compressed: that has a name.
    fn without_data(&self, index: Index<Accessor>) -> GltfError {
        let compression = self.root.extensions_used.iter().find(|name| name.contains("compression"));
        match compression {
            Some(name) => GltfError::Extension(super::escape(name)),
            None => broken(location(index), "no data"),
        }
    }

    /// The places whose values a sparse accessor gives.
    fn sparse_places(&self, sparse: &sparse::Sparse, count: usize) -> Result<Vec<usize>, Sparse> {
        let given = match usize::try_from(sparse.count.0) {
            Ok(given) if given <= count => given,
            _ => return Err(Sparse::Broken("more sparse values than elements".to_owned())),
        };
        let kind = match sparse.indices.component_type {
            Checked::Valid(kind) if is_index(kind.0) => kind.0,
            _ => return Err(Sparse::Broken("an unknown type of sparse indices".to_owned())),
        };
        let view = self.buffers.view(sparse.indices.buffer_view).map_err(Sparse::View)?;
        let layout = Layout::new(view, sparse.indices.byte_offset.0, given, kind.size()).map_err(Sparse::Broken)?;
        let places: Vec<usize> = indices(&layout, kind).into_iter().map(|index| index as usize).collect();
        if let Some(place) = places.iter().find(|place| **place >= count) {
            return Err(Sparse::Broken(format!("sparse value {place} of {count}")));
        }
        Ok(places)
    }
}

/// What is wrong with a sparse accessor.
enum Sparse {
    Broken(String),
    View(GltfError),
}

impl Sparse {
    fn at(self, index: Index<Accessor>) -> GltfError {
        match self {
            Self::Broken(problem) => broken(location(index), problem),
            Self::View(error) => error,
        }
    }
}

fn location(index: Index<Accessor>) -> String {
    format!("accessors[{}]", index.value())
}

fn component(kind: &Checked<gltf::json::accessor::GenericComponentType>) -> Option<ComponentType> {
    if let Checked::Valid(kind) = kind { Some(kind.0) } else { None }
}

/// Vectors of coordinates of this type, if it is one of coordinates. Small integers that are normalised stand for
/// numbers up to one (glTF 2.0, 3.11).
fn vectors(layout: &Layout, kind: ComponentType, normalized: bool) -> Option<Vec<[f64; 3]>> {
    Some(match (kind, normalized) {
        (ComponentType::F32, _) => layout.vectors(|b| f64::from(f32::from_le_bytes(b))),
        (ComponentType::I8, false) => layout.vectors(|b| f64::from(i8::from_le_bytes(b))),
        (ComponentType::U8, false) => layout.vectors(|[b]| f64::from(b)),
        (ComponentType::I16, false) => layout.vectors(|b| f64::from(i16::from_le_bytes(b))),
        (ComponentType::U16, false) => layout.vectors(|b| f64::from(u16::from_le_bytes(b))),
        (ComponentType::I8, true) => layout.vectors(|b| (f64::from(i8::from_le_bytes(b)) / 127.0).max(-1.0)),
        (ComponentType::U8, true) => layout.vectors(|[b]| f64::from(b) / 255.0),
        (ComponentType::I16, true) => layout.vectors(|b| (f64::from(i16::from_le_bytes(b)) / 32767.0).max(-1.0)),
        (ComponentType::U16, true) => layout.vectors(|b| f64::from(u16::from_le_bytes(b)) / 65535.0),
        (ComponentType::U32, _) => return None,
    })
}

fn is_index(kind: ComponentType) -> bool {
    matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
}

/// Indices of this type, which is one of indices.
fn indices(layout: &Layout, kind: ComponentType) -> Vec<u32> {
    match kind {
        ComponentType::U8 => layout.indices(|[b]| u32::from(b)),
        ComponentType::U16 => layout.indices(|b| u32::from(u16::from_le_bytes(b))),
        _ => layout.indices(u32::from_le_bytes),
    }
}
