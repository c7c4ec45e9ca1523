//! The scene: which meshes stand where.

use super::accessor::Accessors;
use super::buffers::Buffers;
use super::{GltfError, Source, broken};
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked;
use gltf::json::{Index, Node, Root};
use std::collections::BTreeMap;

/// A point of glTF takes at least this many bytes in memory here.
const POINT: u64 = 24;

/// All triangles of a scene.
#[derive(Default)]
pub(super) struct Scene {
    pub points: Vec<[f64; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub names: Vec<String>,
    /// Per primitive that gave triangles: its mesh, its material, and where its triangles end.
    pub parts: Vec<Part>,
    pub skipped: BTreeMap<&'static str, usize>,
}

/// The triangles of a primitive up to this one.
#[derive(Clone, Copy)]
pub(super) struct Part {
    pub mesh: usize,
    pub material: Option<usize>,
    pub end: usize,
}

/// An affine map: three columns and the image of the origin.
#[derive(Clone, Copy)]
struct Transform([[f64; 3]; 4]);

/// A node on the way through the scene that is still to be visited.
struct Waiting {
    node: Index<Node>,
    /// The map of all nodes above it, from the root on.
    above: Transform,
    /// How many nodes are above it.
    level: usize,
}

/// What is needed on the way through the nodes.
struct Walk<'a> {
    root: &'a Root,
    accessors: Accessors<'a>,
    most: u64,
    scene: Scene,
}

impl Scene {
    /// Reads the default scene; without scenes, all nodes that are nobody's children; without nodes, all meshes.
    pub fn read(root: &Root, buffers: &Buffers, source: &Source) -> Result<Self, GltfError> {
        let most = source.limits.elements.min(source.limits.unpacked(source.bytes.len()) / POINT);
        let accessors = Accessors { root, buffers, most };
        let mut walk = Walk { root, accessors, most, scene: Self::default() };
        let mut meshes: Vec<(usize, Transform)> = instances(root, source.limits.depth)?;
        if root.nodes.is_empty() {
            meshes = (0..root.meshes.len()).map(|mesh| (mesh, Transform::IDENTITY)).collect();
        }
        for (mesh, transform) in meshes {
            walk.mesh(mesh, &transform)?;
        }
        Ok(walk.scene)
    }
}

/// The meshes that nodes show, with their places. Every node is visited once: one with two parents, or above itself,
/// is an error (glTF 2.0, 3.5.2). So the walk ends.
fn instances(root: &Root, depth: usize) -> Result<Vec<(usize, Transform)>, GltfError> {
    // A stack: nodes are pushed in the opposite order, so that they are visited in that of the file.
    let mut waiting: Vec<Waiting> = Vec::new();
    for node in top_nodes(root)?.into_iter().rev() {
        waiting.push(Waiting { node, above: Transform::IDENTITY, level: 0 });
    }
    let mut visited = vec![false; root.nodes.len()];
    let mut found = Vec::new();
    while let Some(Waiting { node, above, level }) = waiting.pop() {
        let i = node.value();
        let fail = |problem: &str| broken(format!("nodes[{i}]"), problem);
        let node = root.nodes.get(i).ok_or_else(|| fail("there is none"))?;
        if std::mem::replace(&mut visited[i], true) {
            return Err(fail("it is the child of two nodes, or of itself"));
        }
        if level >= depth {
            let problem = format!("nodes are nested more than {depth} deep");
            return Err(GltfError::TooMuch { location: format!("nodes[{i}]"), problem });
        }
        let here = above.then(&Transform::of(node));
        found.extend(node.mesh.map(|mesh| (mesh.value(), here)));
        for child in node.children.iter().flatten().rev() {
            waiting.push(Waiting { node: *child, above: here, level: level + 1 });
        }
    }
    Ok(found)
}

/// The nodes at which the default scene begins: that of the document or its first one, or all roots where it has none.
fn top_nodes(root: &Root) -> Result<Vec<Index<Node>>, GltfError> {
    let first = if root.scenes.is_empty() { None } else { Some(0) };
    let Some(i) = root.scene.map(|scene| scene.value()).or(first) else { return Ok(roots(root)) };
    let scene = root.scenes.get(i).ok_or_else(|| broken(format!("scenes[{i}]"), "there is none"))?;
    Ok(scene.nodes.clone())
}

/// The nodes that are no children.
fn roots(root: &Root) -> Vec<Index<Node>> {
    let mut is_child = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(|n| n.children.iter().flatten()) {
        if let Some(seen) = is_child.get_mut(child.value()) {
            *seen = true;
        }
    }
    (0..root.nodes.len()).filter(|i| !is_child[*i]).map(|i| Index::new(i as u32)).collect()
}

impl Walk<'_> {
    /// Adds the primitives of a mesh.
    fn mesh(&mut self, mesh: usize, transform: &Transform) -> Result<(), GltfError> {
        let root = self.root;
        let found = root.meshes.get(mesh).ok_or_else(|| broken(format!("meshes[{mesh}]"), "there is none"))?;
        self.scene.names.extend(found.name.clone());
        for (i, primitive) in found.primitives.iter().enumerate() {
            self.primitive(primitive, transform, &format!("meshes[{mesh}].primitives[{i}]"))?;
            let material = primitive.material.map(|material| material.value());
            self.scene.parts.push(Part { mesh, material, end: self.scene.triangles.len() });
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive, transform: &Transform, location: &str) -> Result<(), GltfError> {
        let fail = |problem: &str| broken(location.to_owned(), problem);
        let Checked::Valid(mode) = primitive.mode else { return Err(fail("an unknown mode")) };
        if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            let kind = if mode == Mode::Points { "points primitive" } else { "lines primitive" };
            *self.scene.skipped.entry(kind).or_insert(0) += 1;
            return Ok(());
        }
        let Some(positions) = primitive.attributes.get(&Checked::Valid(Semantic::Positions)) else {
            // Such a primitive is not shown, and breaks nothing (glTF 2.0, 3.7.2.1).
            *self.scene.skipped.entry("primitive without positions").or_insert(0) += 1;
            return Ok(());
        };
        let mut points = self.accessors.positions(*positions)?;
        let corners = match primitive.indices {
            Some(indices) => self.accessors.indices(indices)?,
            None => (0..points.len() as u32).collect(),
        };
        if corners.iter().copied().max().is_some_and(|largest| largest as usize >= points.len()) {
            let corner = corners.iter().find(|c| **c as usize >= points.len()).copied().unwrap_or_default();
            return Err(fail(&format!("index {corner}, but there are {} positions", points.len())));
        }
        let base = self.scene.points.len();
        let total = (base + points.len()).max(self.scene.triangles.len() + corners.len());
        if total as u64 > self.most {
            let problem = format!("{total} points or triangles with all instances, more than {}", self.most);
            return Err(GltfError::TooMuch { location: location.to_owned(), problem });
        }
        for point in &mut points {
            *point = transform.of_point(*point);
        }
        if base == 0 {
            // Most files have one primitive: its points are not copied.
            self.scene.points = points;
        } else {
            self.scene.points.extend(points);
        }
        self.scene.triangles.reserve(corners.len() / 3);
        let base = base as u32;
        // A map that mirrors turns triangles over: exchanging two corners turns them back.
        let is_mirrored = transform.determinant() < 0.0;
        for_triangles(mode, &corners, |[a, b, c]| {
            let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
            self.scene.triangles.push([a, b, c].map(|v| base + v));
        });
        Ok(())
    }
}

/// Goes through the triangles of a list, a strip or a fan (glTF 2.0, 3.7.2.1).
fn for_triangles(mode: Mode, corners: &[u32], mut add: impl FnMut([u32; 3])) {
    let threes = corners.windows(3);
    match mode {
        Mode::TriangleStrip => {
            for (i, t) in threes.enumerate() {
                // Every other one would turn the other way.
                add([t[0], t[1 + i % 2], t[2 - i % 2]]);
            }
        }
        Mode::TriangleFan => {
            for t in threes {
                add([t[1], t[2], corners[0]]);
            }
        }
        // Corners that make no whole triangle are left out.
        _ => {
            for t in corners.as_chunks().0 {
                add(*t);
            }
        }
    }
}

impl Transform {
    const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]);

    /// That of a node: its matrix, or its scale, then its rotation, then its translation.
    fn of(node: &Node) -> Self {
        if let Some(m) = node.matrix {
            let column = |k: usize| [0, 1, 2].map(|i| f64::from(m[4 * k + i]));
            return Self([column(0), column(1), column(2), column(3)]);
        }
        // The matrix of a unit quaternion, by columns.
        let [x, y, z, w] = node.rotation.map_or([0.0, 0.0, 0.0, 1.0], |q| q.0.map(f64::from));
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)],
            [2.0 * (x * y - z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + x * w)],
            [2.0 * (x * z + y * w), 2.0 * (y * z - x * w), 1.0 - 2.0 * (x * x + y * y)],
        ];
        let scale = node.scale.map_or([1.0; 3], |s| s.map(f64::from));
        let column = |k: usize| rotation[k].map(|r| r * scale[k]);
        Self([column(0), column(1), column(2), node.translation.map_or([0.0; 3], |t| t.map(f64::from))])
    }

    /// First `inner`, then this one.
    fn then(&self, inner: &Self) -> Self {
        let [x, y, z, origin] = inner.0;
        Self([self.of_vector(x), self.of_vector(y), self.of_vector(z), self.of_point(origin)])
    }

    fn of_vector(&self, v: [f64; 3]) -> [f64; 3] {
        let m = &self.0;
        [0, 1, 2].map(|i| m[0][i] * v[0] + m[1][i] * v[1] + m[2][i] * v[2])
    }

    fn of_point(&self, p: [f64; 3]) -> [f64; 3] {
        let turned = self.of_vector(p);
        [0, 1, 2].map(|i| turned[i] + self.0[3][i])
    }

    fn determinant(&self) -> f64 {
        let [a, b, c, _] = self.0;
        planish_core::vec3::dot(planish_core::vec3::cross(a, b), c)
    }
}
