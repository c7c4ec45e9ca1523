//! `surface.glb`: the surface with texture coordinates as binary glTF 2.0, for viewers, game engines and the web.
//!
//! glTF stores numbers of 32 bits. So that coordinates far from the origin keep their digits, they are stored relative
//! to the middle of the surface, rounded to 32 bits itself, which is the translation of every node: a stored coordinate
//! is off by at most 2^-24 of the distance to it, that is 2^-25 of the surface's extent and 2^-48 of its distance from
//! the origin. Readers that add the translation in 32 bits lose the digits there. Vertices are split along the borders
//! of charts, where texture coordinates differ.

use crate::formats::labels::Label;
use crate::formats::texture::{Part, UnitSquare, parts};
use crate::outcome::{Code, Reason};
use gltf::json::accessor::{Accessor, ComponentType, GenericComponentType, Type};
use gltf::json::buffer::{Buffer, Target, View};
use gltf::json::mesh::{Mesh, Mode, Primitive, Semantic};
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Asset, Index, Node, Root, Scene, Value};
use planish_core::CertifiedAtlas;
use planish_core::vec3::Vec3;
use std::collections::BTreeMap;

/// The name of the mesh where the input has no labels.
const UNLABELLED: &str = "surface";

/// Surfaces smaller than this lose digits, or vanish, in numbers of 32 bits.
const SMALLEST: f64 = 1e-30;

/// Coordinates larger than this are none in 32 bits, or only just.
const LARGEST: f64 = 1e38;

/// Why there can be no such file.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GlbError {
    /// Its numbers of 32 bits do not go so far.
    #[error(
        "glTF holds coordinates of 32 bits, and the surface has coordinates up to {farthest:e} and an extent of \
         {extent:e}, which are not between {SMALLEST:e} and {LARGEST:e}; scale the input, or leave glb out of --also"
    )]
    Range {
        /// The largest absolute coordinate.
        farthest: f64,
        /// The longest side of the box around the surface.
        extent: f64,
    },
    /// The container counts bytes by 32 bits.
    #[error(
        "a file of {bytes} bytes does not fit into binary glTF, which ends at 4 GiB; decimate the input, or leave \
         glb out of --also"
    )]
    TooLong {
        /// How many there would be.
        bytes: usize,
    },
    /// The library cannot write the document.
    #[error("the document of binary glTF cannot be written: {0}")]
    Library(String),
}

impl GlbError {
    /// The refusal that this error means.
    pub fn reason(&self) -> Reason {
        let code = match self {
            Self::Range { .. } | Self::TooLong { .. } => Code::TooLarge,
            Self::Library(_) => Code::Internal,
        };
        Reason::new(code, self)
    }
}

/// The bytes of `surface.glb`: a node and a mesh for each label, with its name; without labels, one of each.
///
/// # Errors
/// [`GlbError`]: the surface is too far away, too small, or has too many triangles.
pub fn surface(atlas: &CertifiedAtlas, labels: &[Label]) -> Result<Vec<u8>, GlbError> {
    let mut document = Document::new(middle(atlas)?);
    let square = UnitSquare::of(atlas.charts());
    for part in parts(atlas, labels) {
        document.add(&part, &square);
    }
    let (root, binary) = document.finish();
    let json = root.to_vec().map_err(|e| GlbError::Library(e.to_string()))?;
    container(json, binary)
}

/// The middle of the box around the surface, as 32 bits hold it.
fn middle(atlas: &CertifiedAtlas) -> Result<[f32; 3], GlbError> {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in atlas.charts().iter().flat_map(|certified| certified.chart().points()) {
        for k in 0..3 {
            min[k] = min[k].min(point[k]);
            max[k] = max[k].max(point[k]);
        }
    }
    let extent = (0..3).map(|k| max[k] - min[k]).fold(0.0, f64::max);
    let farthest = min.iter().chain(&max).map(|c| c.abs()).fold(0.0, f64::max);
    if !(extent >= SMALLEST && farthest <= LARGEST) {
        return Err(GlbError::Range { farthest, extent });
    }
    Ok([0, 1, 2].map(|k| (0.5 * min[k] + 0.5 * max[k]) as f32))
}

/// A document that grows, and the data that it describes.
struct Document {
    root: Root,
    binary: Vec<u8>,
    middle: [f32; 3],
    nodes: Vec<Index<Node>>,
}

impl Document {
    fn new(middle: [f32; 3]) -> Self {
        let asset = Asset { generator: Some("planish".to_owned()), ..Asset::default() };
        Self { root: Root { asset, ..Root::default() }, binary: Vec::new(), middle, nodes: Vec::new() }
    }

    /// Adds the charts with one label as a mesh and a node.
    fn add(&mut self, part: &Part, square: &UnitSquare) {
        let mut positions: Vec<[f32; 3]> = Vec::new();
        let mut coordinates: Vec<[f32; 2]> = Vec::new();
        let mut triangles: Vec<[u32; 3]> = Vec::new();
        for certified in &part.charts {
            let first = positions.len() as u32;
            positions.extend(certified.chart().points().iter().map(|p| self.relative(p)));
            // In glTF, v points down.
            coordinates.extend(square.coordinates(certified).map(|[u, v]| [u as f32, (1.0 - v) as f32]));
            triangles.extend(certified.chart().triangles().iter().map(|t| t.map(|v| first + v.0)));
        }
        let attributes = BTreeMap::from([
            (Checked::Valid(Semantic::Positions), self.positions(&positions)),
            (
                Checked::Valid(Semantic::TexCoords(0)),
                self.accessor(Type::Vec2, coordinates.len(), coordinates.as_flattened()),
            ),
        ]);
        let indices = self.indices(triangles.as_flattened());
        self.place(part.label.map_or(UNLABELLED, |label| &label.name), attributes, indices);
    }

    /// A point as it is stored.
    fn relative(&self, point: &Vec3) -> [f32; 3] {
        [0, 1, 2].map(|k| (point[k] - f64::from(self.middle[k])) as f32)
    }

    /// Positions tell their box.
    fn positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let of_all = |k: usize, choose: fn(f32, f32) -> f32| positions.iter().map(|p| p[k]).reduce(choose);
        let [min, max] = [f32::min as fn(f32, f32) -> f32, f32::max].map(|choose| [0, 1, 2].map(|k| of_all(k, choose)));
        let index = self.accessor(Type::Vec3, positions.len(), positions.as_flattened());
        let accessor = &mut self.root.accessors[index.value()];
        (accessor.min, accessor.max) = (Some(Value::from(min.to_vec())), Some(Value::from(max.to_vec())));
        index
    }

    /// Numbers that belong to vertices.
    fn accessor(&mut self, type_: Type, count: usize, numbers: &[f32]) -> Index<Accessor> {
        let view = self.view(Target::ArrayBuffer, numbers.iter().map(|number| number.to_le_bytes()));
        self.root.push(accessor(view, ComponentType::F32, type_, count))
    }

    /// The corners of triangles.
    fn indices(&mut self, corners: &[u32]) -> Index<Accessor> {
        let view = self.view(Target::ElementArrayBuffer, corners.iter().map(|corner| corner.to_le_bytes()));
        self.root.push(accessor(view, ComponentType::U32, Type::Scalar, corners.len()))
    }

    /// Adds data; all of them are numbers of four bytes, so that each begins where it must.
    fn view(&mut self, target: Target, numbers: impl Iterator<Item = [u8; 4]>) -> Index<View> {
        let begin = self.binary.len();
        self.binary.extend(numbers.flatten());
        self.root.push(View {
            buffer: Index::new(0),
            byte_length: USize64::from(self.binary.len() - begin),
            byte_offset: Some(USize64::from(begin)),
            byte_stride: None,
            name: None,
            target: Some(Checked::Valid(target)),
            extensions: None,
            extras: None,
        })
    }

    /// Adds a mesh of these data, and a node that shows it where it belongs.
    fn place(
        &mut self,
        name: &str,
        attributes: BTreeMap<Checked<Semantic>, Index<Accessor>>,
        indices: Index<Accessor>,
    ) {
        let primitive = Primitive {
            attributes,
            indices: Some(indices),
            material: None,
            mode: Checked::Valid(Mode::Triangles),
            targets: None,
            extensions: None,
            extras: None,
        };
        let name = Some(name.to_owned());
        let mesh =
            Mesh { name: name.clone(), primitives: vec![primitive], weights: None, extensions: None, extras: None };
        let mesh = Some(self.root.push(mesh));
        let node = Node { name, mesh, translation: Some(self.middle), ..Node::default() };
        self.nodes.push(self.root.push(node));
    }

    /// The whole document, and its data.
    fn finish(mut self) -> (Root, Vec<u8>) {
        let byte_length = USize64::from(self.binary.len());
        self.root.push(Buffer { byte_length, name: None, uri: None, extensions: None, extras: None });
        let scene = Scene { name: None, nodes: self.nodes, extensions: None, extras: None };
        self.root.scene = Some(self.root.push(scene));
        (self.root, self.binary)
    }
}

fn accessor(view: Index<View>, component: ComponentType, type_: Type, count: usize) -> Accessor {
    Accessor {
        buffer_view: Some(view),
        byte_offset: None,
        count: USize64::from(count),
        component_type: Checked::Valid(GenericComponentType(component)),
        type_: Checked::Valid(type_),
        min: None,
        max: None,
        name: None,
        normalized: false,
        sparse: None,
        extensions: None,
        extras: None,
    }
}

/// The file: a header of twelve bytes, and both parts as chunks, filled up to multiples of four bytes.
fn container(mut json: Vec<u8>, binary: Vec<u8>) -> Result<Vec<u8>, GlbError> {
    json.resize(json.len().next_multiple_of(4), b' ');
    let bytes = 12 + 8 + json.len() + 8 + binary.len();
    let length = u32::try_from(bytes).map_err(|_| GlbError::TooLong { bytes })?;
    let mut file = Vec::with_capacity(bytes);
    file.extend(super::container::MAGIC);
    file.extend(2_u32.to_le_bytes());
    file.extend(length.to_le_bytes());
    for (kind, data) in [(super::container::JSON, &json), (super::container::BINARY, &binary)] {
        // Shorter than the whole file, whose length fits.
        file.extend((data.len() as u32).to_le_bytes());
        file.extend(kind);
        file.extend(data);
    }
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::texture::tests::{atlas_of, doubled_area, labelled_cube};
    use crate::formats::{Format, read_alone};
    use planish_core::mesh::TriangleSoup;
    use planish_core::shapes;

    /// As the library reads it, with all of its checks.
    fn read(bytes: &[u8]) -> (gltf::Document, Vec<u8>) {
        let file = gltf::Gltf::from_slice(bytes).expect("valid glTF");
        (file.document, file.blob.expect("data"))
    }

    /// Positions, texture coordinates and corners of a mesh.
    type Data = (Vec<[f32; 3]>, Vec<[f32; 2]>, Vec<u32>);

    fn data(mesh: &gltf::Mesh, blob: &[u8]) -> Data {
        let primitive = mesh.primitives().next().expect("one");
        let reader = primitive.reader(|_| Some(blob));
        let coordinates = reader.read_tex_coords(0).expect("coordinates").into_f32().collect();
        let corners = reader.read_indices().expect("corners").into_u32().collect();
        (reader.read_positions().expect("positions").collect(), coordinates, corners)
    }

    #[test]
    fn every_corner_has_its_place_in_space_and_in_the_square() {
        let atlas = atlas_of(&shapes::ring_torus(24, 12));
        let (document, blob) = read(&surface(&atlas, &[]).expect("a file"));
        let node = document.nodes().next().expect("one");
        let mesh = node.mesh().expect("one");
        assert_eq!((document.nodes().count(), mesh.name(), node.name()), (1, Some("surface"), Some("surface")));
        let (positions, coordinates, corners) = data(&mesh, &blob);
        let square = UnitSquare::of(atlas.charts());
        let expected: Vec<[f64; 2]> = atlas.charts().iter().flat_map(|c| square.coordinates(c)).collect();
        assert_eq!(expected.len(), coordinates.len());
        for ([u, v], [s, t]) in expected.iter().zip(&coordinates) {
            assert_eq!([*s, *t], [*u as f32, (1.0 - v) as f32]);
        }
        let points = atlas.charts().iter().flat_map(|c| c.chart().points());
        let (translation, _, _) = node.transform().decomposed();
        for (point, stored) in points.zip(&positions) {
            assert!((0..3).all(|k| (point[k] - f64::from(translation[k]) - f64::from(stored[k])).abs() < 1e-7));
        }
        let up = |i: u32| {
            let [u, v] = coordinates[i as usize];
            [f64::from(u), 1.0 - f64::from(v)]
        };
        assert_eq!(corners.len(), 3 * atlas.mesh().triangles().len());
        assert!(corners.chunks(3).all(|t| doubled_area([up(t[0]), up(t[1]), up(t[2])]) > 0.0));
    }

    #[test]
    fn a_mesh_and_a_node_have_the_name_of_each_label() {
        let (atlas, labels) = labelled_cube();
        let bytes = surface(&atlas, &labels).expect("a file");
        let (document, _) = read(&bytes);
        let names: Vec<_> = document.nodes().map(|n| n.name().map(str::to_owned)).collect();
        let expected: Vec<_> = labels.iter().map(|label| Some(label.name.clone())).collect();
        assert_eq!(names, expected);
        assert!(document.nodes().all(|n| n.mesh().is_some_and(|mesh| mesh.name() == n.name())));
        let content = read_alone(Format::Gltf, &bytes).expect("planish reads it again");
        assert_eq!((content.soup.triangles().len(), content.notes.names.len()), (atlas.mesh().triangles().len(), 6));
    }

    /// A torus, made larger by a factor and moved.
    fn moved(factor: f64, by: f64) -> CertifiedAtlas {
        let soup = shapes::ring_torus(12, 6);
        let points = soup.points().iter().map(|p| p.map(|c| factor * c + by)).collect();
        atlas_of(&TriangleSoup::new(points, soup.triangles().to_vec()).expect("sound"))
    }

    #[test]
    fn coordinates_far_from_the_origin_keep_their_digits() {
        let atlas = moved(1.0, 4e6);
        let (document, blob) = read(&surface(&atlas, &[]).expect("a file"));
        let node = document.nodes().next().expect("one");
        let (translation, _, _) = node.transform().decomposed();
        let (positions, _, _) = data(&node.mesh().expect("one"), &blob);
        let points = atlas.charts().iter().flat_map(|c| c.chart().points());
        let error = |p: &Vec3, q: &[f32; 3]| {
            (0..3).map(|k| (p[k] - f64::from(translation[k]) - f64::from(q[k])).abs()).fold(0.0, f64::max)
        };
        let worst = points.zip(&positions).map(|(p, q)| error(p, q)).fold(0.0, f64::max);
        assert!(worst < 2e-7, "{worst}; without the translation it would be 0.25");
    }

    #[test]
    fn what_32_bits_cannot_hold_is_refused_with_what_helps() {
        for atlas in [moved(1e50, 0.0), moved(1e-40, 0.0)] {
            let error = surface(&atlas, &[]).expect_err("out of range");
            assert!(matches!(error, GlbError::Range { .. }) && error.to_string().contains("--also"), "{error}");
            assert_eq!(error.reason().code, Code::TooLarge);
        }
        assert!(surface(&moved(1e8, 0.0), &[]).is_ok() && surface(&moved(1e-8, 0.0), &[]).is_ok());
    }
}
