//! Ears: triangles with two edges on the boundary of their chart.
//!
//! In a smooth convex domain such a triangle is nearly degenerate: its corner angle tends to pi. Seams avoid ears, as
//! the third edge is shorter than the two; where the surface itself ends in one, its *inner* edge is split in the
//! middle and joined to the ear's tip and to the vertex on the other side. The surface does not change.

use super::assemble::assemble;
use super::legality::Illegal;
use crate::atlas::Atlas;
use crate::mesh::{SurfaceMesh, TriangleShape};
use crate::topology::EdgeTable;
use crate::topology::{FaceId, HalfEdgeId, VertexId};
use crate::vec3::midpoint;

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
pub fn split_ears(mesh: &SurfaceMesh, atlas: &Atlas, max_triangles: usize) -> Result<Option<WithoutEars>, Illegal> {
    let mut labels = vec![0; mesh.triangles().len()];
    for chart in atlas.charts() {
        chart.faces().iter().for_each(|f| labels[f.index()] = chart.id().0);
    }
    let sizes = atlas.charts().iter().map(|c| c.triangles().len()).collect();
    let left_alone = vec![false; mesh.triangles().len()];
    let fresh = mesh.welded.iter().max().map_or(0, |w| w + 1);
    let mut work = Work { mesh: mesh.clone(), fresh, labels, sizes, max_triangles, left_alone, split: 0 };
    // A split ear is none any more, and its parts are none: every pass leaves fewer.
    while work.pass() {}
    if work.split == 0 {
        return Ok(None);
    }
    let mut split = assemble(&work.mesh, &work.labels)?;
    for (new, old) in split.charts.iter_mut().zip(atlas.charts()) {
        let on_outer = old.vertices[old.from(old.outer[0]).index()];
        let is_outer = |l: &Vec<HalfEdgeId>| l.iter().any(|h| new.vertices[new.from(*h).index()] == on_outer);
        if let Some(hole) = new.holes.iter().position(is_outer) {
            std::mem::swap(&mut new.outer, &mut new.holes[hole]);
        }
    }
    split.feature_edges = atlas.feature_edges;
    Ok(Some(WithoutEars { mesh: work.mesh, atlas: split, split: work.split }))
}

/// A surface while its ears are split.
struct Work {
    mesh: SurfaceMesh,
    /// The number of the next vertex among the welded ones.
    fresh: u32,
    labels: Vec<u32>,
    /// Per chart its triangles.
    sizes: Vec<usize>,
    max_triangles: usize,
    left_alone: Vec<bool>,
    split: usize,
}

impl Work {
    /// Splits ears that share no triangle; whether there was one.
    fn pass(&mut self) -> bool {
        let mut busy = vec![false; self.labels.len()];
        let mut found = false;
        for face in (0..self.labels.len()).map(FaceId::at) {
            let Some((inner, beyond)) = self.ear(face) else { continue };
            if busy[face.index()] || busy[beyond.face().index()] || self.left_alone[face.index()] {
                continue;
            }
            (busy[face.index()], busy[beyond.face().index()]) = (true, true);
            found = true;
            self.left_alone[face.index()] = !self.halve_edge(inner, beyond);
        }
        if found {
            self.mesh.edges = EdgeTable::new(&self.mesh.triangles);
        }
        found
    }

    /// The half-edge along which an ear is joined to its chart, and its twin.
    fn ear(&self, face: FaceId) -> Option<(HalfEdgeId, HalfEdgeId)> {
        let inner = |h: HalfEdgeId| self.mesh.edges.twin(h).filter(|t| self.is_same_chart(h, *t)).map(|t| (h, t));
        let mut all = (0..3).filter_map(|k| inner(HalfEdgeId::side_of(face, k)));
        all.next().filter(|_| all.next().is_none())
    }

    fn is_same_chart(&self, h: HalfEdgeId, t: HalfEdgeId) -> bool {
        let from = |h: HalfEdgeId| self.mesh.triangles[h.face().index()][h.side()];
        self.labels[h.face().index()] == self.labels[t.face().index()] && from(h) != from(t)
    }

    /// Splits the edge along `h` and `t` in the middle, and the triangles at its sides; not where that gives a part
    /// without area.
    fn halve_edge(&mut self, h: HalfEdgeId, t: HalfEdgeId) -> bool {
        let middle = VertexId::at(self.mesh.points.len());
        let parts = [h, t].map(|side| self.halves(side, middle));
        let size = self.sizes[self.labels[h.face().index()] as usize] + 2;
        if size > self.max_triangles || parts.iter().flatten().any(|(_, shape)| shape.area() == 0.0) {
            return false;
        }
        self.sizes[self.labels[h.face().index()] as usize] = size;
        let [p, q] = [h, h.next()].map(|e| self.mesh.triangles[e.face().index()][e.side()].index());
        self.mesh.points.push(midpoint(self.mesh.points[p], self.mesh.points[q]));
        self.mesh.welded.push(self.fresh);
        self.fresh += 1;
        for (side, [first, second]) in [h, t].into_iter().zip(parts) {
            let face = side.face().index();
            (self.mesh.triangles[face], self.mesh.metric.shapes[face]) = first;
            self.mesh.triangles.push(second.0);
            self.mesh.metric.shapes.push(second.1);
            self.mesh.metric.flagged.push(self.mesh.metric.flagged[face]);
            self.mesh.source.push(self.mesh.source[face]);
            self.labels.push(self.labels[face]);
            self.left_alone.push(false);
        }
        self.split += 1;
        true
    }

    /// The two parts of the triangle at `h` when `middle` halves that side.
    fn halves(&self, h: HalfEdgeId, middle: VertexId) -> [([VertexId; 3], TriangleShape); 2] {
        let (t, l) = (self.mesh.triangles[h.face().index()], self.mesh.metric.shapes[h.face().index()].lengths);
        let k = h.side();
        let [p, q, r] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
        let [pq, qr, rp] = [l[k], l[(k + 1) % 3], l[(k + 2) % 3]];
        // Apollonius: the median from r.
        let median = (0.5 * (qr * qr + rp * rp) - 0.25 * pq * pq).max(0.0).sqrt();
        let half = 0.5 * pq;
        [
            ([p, middle, r], TriangleShape { lengths: [half, median, rp] }),
            ([middle, q, r], TriangleShape { lengths: [half, qr, median] }),
        ]
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
