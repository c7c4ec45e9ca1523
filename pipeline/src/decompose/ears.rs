//! Ears: triangles with two edges on the boundary of their chart.
//!
//! In a smooth convex domain such a triangle is nearly degenerate: its corner angle tends to pi. Seams avoid ears, as
//! the third edge is shorter than the two; where the surface itself ends in one, its *inner* edge is split in the
//! middle and joined to the ear's tip and to the vertex on the other side. The surface does not change.

use super::assemble::{assemble, with_outer};
use super::legality::Illegal;
use crate::atlas::{Atlas, Chart};
use crate::mesh::{MeshEditor, SurfaceMesh};
use crate::topology::{FaceId, HalfEdgeId};

/// A surface whose ears are split.
#[derive(Clone, Debug)]
pub struct WithoutEars {
    /// The surface, with one vertex more for every ear.
    pub mesh: SurfaceMesh,
    /// The same charts.
    pub atlas: Atlas,
    /// How many ears were split.
    pub split: usize,
}

/// Splits the ears of all charts of `atlas`; none where there are none to split. Ears that mollification alone keeps
/// from being degenerate stay, and those of charts that would get more than `max_triangles`.
///
/// # Errors
/// [`Illegal`]: a fault of planish.
///
/// ```
/// use planish_core::decompose::{Settings, decompose, split_ears};
/// use planish_core::{mesh::TriangleSoup, monitor::NoMonitor, repair};
///
/// // A square of two triangles, each of which has two edges on the boundary.
/// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
/// let soup = TriangleSoup::new(points, vec![[0, 1, 2], [0, 2, 3]])?;
/// let mesh = repair(&soup, &repair::Settings::default())?.mesh;
/// let atlas = decompose(&mesh, &Settings::default(), &NoMonitor)?;
/// let without = split_ears(&mesh, &atlas, usize::MAX)?.expect("there are ears");
/// // One vertex in the middle of the diagonal serves both.
/// assert_eq!((without.split, without.mesh.triangles().len()), (1, 4));
/// assert_eq!(without.mesh.area(), mesh.area());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn split_ears(mesh: &SurfaceMesh, atlas: &Atlas, max_triangles: usize) -> Result<Option<WithoutEars>, Illegal> {
    let mut work = Work::new(mesh, atlas, max_triangles);
    let mut mesh = mesh.clone();
    // A split ear is none any more, and its parts are none: every pass leaves fewer.
    let mut found = true;
    while found {
        let mut editor = MeshEditor::new(mesh);
        found = work.pass(&mut editor);
        mesh = editor.finish();
    }
    if work.split == 0 {
        return Ok(None);
    }
    let mut split = assemble(&mesh, &work.labels)?;
    let like = |(new, old): (Chart, &Chart)| with_outer(new, old.id, old.vertices[old.from(old.outer[0]).index()]);
    split.charts = split.charts.into_iter().zip(atlas.charts()).map(like).collect();
    split.feature_edges = atlas.feature_edges;
    Ok(Some(WithoutEars { mesh, atlas: split, split: work.split }))
}

/// An ear by the half-edge along which it is joined to its chart, and the other side of that.
#[derive(Clone, Copy)]
struct Ear {
    inner: HalfEdgeId,
    beyond: HalfEdgeId,
}

/// The charts while their ears are split.
struct Work {
    /// Per triangle its chart.
    labels: Vec<u32>,
    /// Per chart its triangles.
    sizes: Vec<usize>,
    max_triangles: usize,
    /// Per triangle, whether it is an ear that cannot be split.
    left_alone: Vec<bool>,
    split: usize,
}

impl Work {
    fn new(mesh: &SurfaceMesh, atlas: &Atlas, max_triangles: usize) -> Self {
        let faces = mesh.triangles().len();
        let mut labels = vec![0; faces];
        for chart in atlas.charts() {
            chart.faces().iter().for_each(|f| labels[f.index()] = chart.id().0);
        }
        let sizes = atlas.charts().iter().map(|c| c.triangles().len()).collect();
        Self { labels, sizes, max_triangles, left_alone: vec![false; faces], split: 0 }
    }

    /// Splits ears that share no triangle; whether there was one.
    ///
    /// Ears are looked for on the surface as it is being edited. A triangle beside one that was split just now may pass
    /// for an ear there, as the sides of that one are numbered anew: then an edge more is split than need be.
    fn pass(&mut self, editor: &mut MeshEditor) -> bool {
        let mut busy = vec![false; self.labels.len()];
        let mut found = false;
        for face in (0..busy.len()).map(FaceId::at) {
            let Some(ear) = self.ear(editor.unfinished(), face) else { continue };
            let beyond = ear.beyond.face();
            if busy[face.index()] || busy[beyond.index()] || self.left_alone[face.index()] {
                continue;
            }
            (busy[face.index()], busy[beyond.index()]) = (true, true);
            found = true;
            self.split(editor, ear);
        }
        found
    }

    /// The triangle as an ear: joined to its chart along one side only.
    fn ear(&self, mesh: &SurfaceMesh, face: FaceId) -> Option<Ear> {
        let inside = |inner: HalfEdgeId| {
            let beyond = mesh.edges().twin(inner).filter(|twin| self.is_same_chart(mesh, inner, *twin))?;
            Some(Ear { inner, beyond })
        };
        let mut all = face.sides().into_iter().filter_map(inside);
        all.next().filter(|_| all.next().is_none())
    }

    fn is_same_chart(&self, mesh: &SurfaceMesh, h: HalfEdgeId, t: HalfEdgeId) -> bool {
        let from = |h: HalfEdgeId| mesh.triangles()[h.face().index()][h.side()];
        self.labels[h.face().index()] == self.labels[t.face().index()] && from(h) != from(t)
    }

    /// Splits an ear, or leaves it alone for good, where its chart would be too large or a part would have no area.
    fn split(&mut self, editor: &mut MeshEditor, ear: Ear) {
        let face = ear.inner.face().index();
        let chart = self.labels[face];
        let size = self.sizes[chart as usize] + 2;
        if size > self.max_triangles || editor.split_edge([ear.inner, ear.beyond]).is_none() {
            self.left_alone[face] = true;
            return;
        }
        self.sizes[chart as usize] = size;
        self.split += 1;
        // Two more triangles, at the end.
        self.labels.extend([chart; 2]);
        self.left_alone.extend([false; 2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::TriangleSoup;
    use crate::monitor::NoMonitor;
    use crate::parametrize::parametrize_chart;
    use crate::{Order, decompose, repair};

    /// A square of n x n smaller ones, all cut along the same diagonal: two of its corners are ears.
    fn square(n: u32) -> TriangleSoup {
        let points = (0..=n).flat_map(|j| (0..=n).map(move |i| [f64::from(i), f64::from(j), 0.0])).collect();
        let quad = |i: u32, j: u32| {
            let a = j * (n + 1) + i;
            [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]
        };
        let triangles = (0..n).flat_map(|j| (0..n).flat_map(move |i| quad(i, j))).collect();
        TriangleSoup::new(points, triangles).expect("sound")
    }

    #[test]
    fn ears_are_split_and_the_surface_stays() {
        for (n, ears) in [(1, 1), (2, 2), (5, 2)] {
            let mesh = repair(&square(n), &Default::default()).expect("a surface").mesh;
            let atlas = decompose(&mesh, &Default::default(), &NoMonitor).expect("one chart");
            let done = split_ears(&mesh, &atlas, usize::MAX).expect("legal").expect("ears");
            assert_eq!((done.split, done.mesh.points().len()), (ears, mesh.points().len() + ears));
            done.mesh.assert_sound();
            assert!((done.mesh.area() / mesh.area() - 1.0).abs() < 1e-14);
            let shapes = (0..done.mesh.triangles().len()).map(|f| done.mesh.metric().shapes[f].area());
            let scale = mesh.metric().scale;
            assert!((shapes.sum::<f64>() / scale / scale / mesh.area() - 1.0).abs() < 1e-7, "mollified all the same");
            assert!(split_ears(&done.mesh, &done.atlas, usize::MAX).expect("legal").is_none(), "no ear is left");
            let chart = done.atlas.into_charts().remove(0);
            let done = parametrize_chart(chart, Order::Quadratic).expect("maps");
            assert!(done.map().certificate().det_lower_bound > 0.0);
        }
    }
}
