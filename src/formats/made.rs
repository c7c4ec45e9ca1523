//! A mesh that planish has made on a surface, as encoders get it.

use super::fields::Field;
use super::labels::Label;
use planish_core::vec3::Vec3;
use std::path::Path;

/// Triangles on a surface, which know the chart and the named part that they lie in.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MadeMesh {
    /// Where its nodes are.
    pub points: Vec<Vec3>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle the nodes in the middle of its sides 01, 12 and 20; empty where it has none.
    pub middles: Vec<[u32; 3]>,
    /// Per triangle, the number of its chart.
    pub charts: Vec<u32>,
    /// The named parts; empty where there are none.
    pub parts: Vec<Label>,
    /// Per chart, the position of its part among these; none where it has no name.
    pub part_of_chart: Vec<Option<usize>>,
    /// Arrays with an entry for each node.
    pub of_points: Vec<Field>,
    /// Arrays with an entry for each triangle.
    pub of_cells: Vec<Field>,
}

impl MadeMesh {
    /// The part of a triangle.
    pub fn part(&self, triangle: usize) -> Option<&Label> {
        let part = (*self.part_of_chart.get(self.charts[triangle] as usize)?)?;
        self.parts.get(part)
    }

    /// The number of the part of a triangle; of its chart, from 1, where parts have no names.
    pub fn tag(&self, triangle: usize) -> i32 {
        match self.part(triangle) {
            Some(part) => part.tag,
            None if self.parts.is_empty() => self.charts[triangle] as i32 + 1,
            None => 0,
        }
    }

    /// The nodes of a triangle: corners, then those in the middle of its sides.
    pub fn nodes(&self, triangle: usize) -> impl Iterator<Item = u32> {
        let middles = self.middles.get(triangle).copied();
        self.triangles[triangle].into_iter().chain(middles.into_iter().flatten())
    }

    /// How many nodes a triangle has.
    pub fn nodes_per_triangle(&self) -> usize {
        if self.middles.is_empty() { 3 } else { 6 }
    }

    /// The numbers of the triangles of each chart that has any, ascending.
    pub fn by_chart(&self) -> Vec<(u32, Vec<usize>)> {
        let mut numbers: Vec<usize> = (0..self.triangles.len()).collect();
        numbers.sort_by_key(|triangle| self.charts[*triangle]);
        let of_chart = |same: &[usize]| (self.charts[same[0]], same.to_vec());
        numbers.chunk_by(|a, b| self.charts[*a] == self.charts[*b]).map(of_chart).collect()
    }
}

/// A format in which it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MadeFormat {
    /// MSH 4.1, binary.
    Msh,
    /// VTK XML.
    Vtu,
    /// STL, binary.
    Stl,
    /// MEDIT.
    Medit,
    /// OBJ.
    Obj,
}

impl MadeFormat {
    /// What the name of a file says; none where that is none of these.
    ///
    /// ```
    /// use planish::formats::MadeFormat;
    ///
    /// assert_eq!(MadeFormat::of("out/mesh.VTU".as_ref()), Some(MadeFormat::Vtu));
    /// assert_eq!(MadeFormat::of("mesh.ply".as_ref()), None);
    /// ```
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_string_lossy().to_lowercase().as_str() {
            "msh" => Some(Self::Msh),
            "vtu" => Some(Self::Vtu),
            "stl" => Some(Self::Stl),
            "mesh" => Some(Self::Medit),
            "obj" => Some(Self::Obj),
            _ => None,
        }
    }

    /// Whether triangles of six nodes can be told.
    pub fn has_middles(self) -> bool {
        matches!(self, Self::Msh | Self::Vtu)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Two triangles of two charts, the second of which is a part with a name.
    pub fn two() -> MadeMesh {
        MadeMesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.1]],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            charts: vec![0, 1],
            parts: vec![Label { tag: 7, name: "the lid".to_owned(), group: "the_lid".to_owned() }],
            part_of_chart: vec![None, Some(0)],
            ..MadeMesh::default()
        }
    }

    #[test]
    fn tags_are_those_of_parts_and_else_of_charts() {
        let mesh = two();
        assert_eq!((mesh.tag(0), mesh.tag(1)), (0, 7));
        let without = MadeMesh { parts: vec![], part_of_chart: vec![], ..mesh };
        assert_eq!((without.tag(0), without.tag(1), without.by_chart()), (1, 2, vec![(0, vec![0]), (1, vec![1])]));
    }
}
