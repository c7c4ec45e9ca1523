//! The binary form of MSH 4.1: little endian, `size_t` of eight bytes, `int` of four.

use planish_core::vec3::Vec3;

/// A file as it grows.
pub struct Binary {
    pub bytes: Vec<u8>,
    /// By how much lengths are multiplied: a power of two, so that nothing is rounded.
    pub unit: f64,
}

impl Binary {
    /// A file with its `$MeshFormat`.
    pub fn new() -> Self {
        let mut file = Self { bytes: b"$MeshFormat\n4.1 1 8\n".to_vec(), unit: 1.0 };
        // Readers compare this with their own 1 to know the order of bytes.
        file.int(1);
        file.bytes.extend(b"\n$EndMeshFormat\n");
        file
    }

    /// Appends a section.
    pub fn section(&mut self, name: &str, content: impl FnOnce(&mut Self)) {
        self.bytes.extend(format!("${name}\n").bytes());
        content(self);
        self.bytes.extend(format!("\n$End{name}\n").bytes());
    }

    /// Appends an `int`.
    pub fn int(&mut self, value: i32) {
        self.bytes.extend(value.to_le_bytes());
    }

    /// Appends a `size_t`.
    pub fn size(&mut self, value: usize) {
        self.bytes.extend((value as u64).to_le_bytes());
    }

    /// Appends doubles.
    pub fn doubles(&mut self, values: &[f64]) {
        values.iter().for_each(|v| self.bytes.extend(v.to_le_bytes()));
    }

    /// Appends a point of space.
    pub fn point(&mut self, point: Vec3) {
        self.doubles(&point.map(|c| c * self.unit));
    }

    /// Appends a curvature times its direction.
    pub fn curvature(&mut self, curvature: Vec3) {
        self.doubles(&curvature.map(|c| c / self.unit));
    }

    /// Appends the tag of the entity at `index`. Tags begin with 1.
    pub fn tag(&mut self, index: usize) {
        self.signed_tag(index, true);
    }

    /// Appends a tag, negative for one that is traversed backwards.
    pub fn signed_tag(&mut self, index: usize, forward: bool) {
        let tag = index as i32 + 1;
        self.int(if forward { tag } else { -tag });
    }
}
