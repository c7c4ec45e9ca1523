//! Parts of a surface that touch themselves: two vertices of a part are copies of one vertex of the input, at which repair
//! took sheets apart.
//!
//! Such a part cannot be handed to meshers, which find places in the plane by those in space. All contacts are parted on the
//! labels, before seams are straightened once: a brain from a scan (mri_brain_iso) has charts with many contacts, and took
//! half of its time for maps when each was parted for itself.

use super::complex::Complex;
use super::dual::Dual;
use super::merge::Limits;
use super::split::{grow, legal};
use super::voronoi::{Cells, bisect_until};
use crate::atlas::Chart;
use crate::monitor::Interrupted;
use crate::topology::{FaceId, Stars, VertexId};

/// Whether two vertices of a chart are copies of one vertex of the input.
pub(crate) fn touches_itself(chart: &Chart) -> bool {
    let welded = (0..chart.vertices().len()).map(|v| chart.welded_vertex(VertexId::at(v)));
    !Copies::of(welded).is_empty()
}

/// Labels of legal parts, cut so that none has triangles at two copies of one vertex.
///
/// # Errors
/// [`Interrupted`].
pub(super) fn without_contacts(dual: &Dual, parts: Cells, limits: &Limits) -> Result<Cells, Interrupted> {
    let vertices = dual.mesh.points().len();
    let copies = Copies::of((0..vertices).map(|v| dual.mesh.welded_vertex(VertexId::at(v))));
    if copies.is_empty() {
        return Ok(parts);
    }
    let mut contacts = Contacts::new(dual, parts);
    if !contacts.cut_all(copies)? {
        return Ok(contacts.parts);
    }
    // What is left on one side of a cut may meet itself at a vertex.
    bisect_until(dual, contacts.parts, |parts| legal(dual, &Complex::new(dual, parts), limits))
}

/// Vertices of which others are copies, each with the vertex of the input that it stands for: ascending by that.
struct Copies(Vec<(u32, VertexId)>);

impl Copies {
    /// Those among vertices that stand for these of the input.
    fn of(welded: impl Iterator<Item = u32>) -> Self {
        let mut all: Vec<_> = welded.zip((0..).map(VertexId)).collect();
        all.sort_unstable();
        let several = all.chunk_by(|a, b| a.0 == b.0).filter(|copies| copies.len() > 1);
        Self(several.flatten().copied().collect())
    }

    fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The first two copies of one vertex.
    fn first(&self) -> Option<[VertexId; 2]> {
        self.0.windows(2).find(|pair| pair[0].0 == pair[1].0).map(|pair| [pair[0].1, pair[1].1])
    }
}

/// Labels while contacts are cut.
struct Contacts<'a> {
    dual: &'a Dual<'a>,
    stars: Stars,
    parts: Cells,
}

impl<'a> Contacts<'a> {
    fn new(dual: &'a Dual<'a>, parts: Cells) -> Self {
        let stars = Stars::new(dual.mesh.triangles(), dual.mesh.points().len());
        Self { dual, stars, parts }
    }

    /// Cuts between copies until there are none in one part; whether there were any.
    ///
    /// Every cut leaves triangles on both of its sides, and a single triangle has no two copies: it ends.
    fn cut_all(&mut self, copies: Copies) -> Result<bool, Interrupted> {
        let before = self.parts.len;
        let mut waiting = self.by_part(&copies);
        while let Some((part, copies)) = waiting.pop() {
            let Some(ends) = copies.first() else { continue };
            let work = self.cut(part, ends);
            self.dual.checkpoint.after(work)?;
            waiting.extend([part, self.parts.len as u32 - 1].map(|part| (part, self.within(&copies, part))));
        }
        Ok(self.parts.len > before)
    }

    /// Per part the copies at which it has triangles.
    fn by_part(&self, copies: &Copies) -> Vec<(u32, Copies)> {
        let mut all = Vec::new();
        for copy in &copies.0 {
            let around = self.stars.around(copy.1.index());
            all.extend(around.iter().map(|f| (self.parts.labels[*f as usize], *copy)));
        }
        all.sort_unstable();
        all.dedup();
        let of_part = |all: &[(u32, (u32, VertexId))]| (all[0].0, Copies(all.iter().map(|(_, copy)| *copy).collect()));
        all.chunk_by(|a, b| a.0 == b.0).map(of_part).collect()
    }

    /// Those at which a part has triangles.
    fn within(&self, copies: &Copies, part: u32) -> Copies {
        Copies(copies.0.iter().copied().filter(|copy| !self.around(copy.1, part).is_empty()).collect())
    }

    /// The triangles of a part around a vertex.
    fn around(&self, vertex: VertexId, part: u32) -> Vec<FaceId> {
        let around = self.stars.around(vertex.index()).iter();
        around.map(|f| FaceId(*f)).filter(|f| self.parts.labels[f.index()] == part).collect()
    }

    /// Cuts a part in two, which are connected if it is: each triangle goes with the end that is fewer triangles away. Returns how
    /// many triangles it had.
    fn cut(&mut self, part: u32, ends: [VertexId; 2]) -> usize {
        // The first side has a label of its own while the part is visited.
        let (second, first) = (self.parts.len as u32, self.parts.len as u32 + 1);
        let [at_first, at_second] = ends.map(|end| self.around(end, part));
        at_first.iter().for_each(|f| self.parts.labels[f.index()] = first);
        at_second.iter().for_each(|f| self.parts.labels[f.index()] = second);
        let visited = grow(self.dual, &mut self.parts.labels, part, [at_first, at_second].concat());
        for face in &visited {
            let label = &mut self.parts.labels[face.index()];
            *label = if *label == first { part } else { *label };
        }
        self.parts.len += 1;
        visited.len()
    }
}
