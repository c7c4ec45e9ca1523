//! Is a surface worth an atlas? Faces of volume elements are none: non-manifold edges cut them into sheets of one or two
//! triangles, each of which would be a chart.
//!
//! A file may hold such faces beside a surface. So each *component* (what is connected through edges, also those of three and
//! more triangles) is measured by its own sheets and triangles, and refused alone where it has too many. Only then all others
//! are counted together; where that is too much, those with the fewest triangles a sheet are refused, until it is not.

use super::{Error, Repaired, pinned_vertices};
use crate::mesh::{Sheets, SurfaceMesh};
use crate::topology::union_find::UnionFind;
use crate::topology::{FaceId, HalfEdgeId, VertexId};
use std::collections::{BTreeMap, BTreeSet};

/// Sheets that non-manifold edges may cut a surface into. Each is a chart at least: the 6480 of the faces of all tetrahedra
/// in a grid of 8 x 8 x 8 cubes take 8 seconds, and the cost grows with the square of their number.
pub(super) const MAX_SHEETS: usize = 10_000;

/// The same, for sheets of fewer than [`TINY_SHEET`] triangles on average: faces of volume elements have one or two, and
/// an atlas of them is of no use. A network of faults or a foam has more.
pub(super) const MAX_TINY_SHEETS: usize = 1_000;

/// See [`MAX_TINY_SHEETS`].
pub(super) const TINY_SHEET: usize = 4;

/// So many of the vertices at which sheets meet are named.
const NAMED: usize = 8;

/// A component of which no atlas is made, while others get one.
#[derive(Clone, Debug, PartialEq)]
pub struct RefusedComponent {
    /// Its number among the components (what is connected through edges, also those of three and more triangles), in the
    /// order of their first triangles.
    pub component: usize,
    /// Its triangles.
    pub triangles: usize,
    /// The position in the input of the first of them.
    pub first_triangle: u32,
    /// Why.
    pub error: Error,
}

/// A surface worth an atlas, and what was left out of it.
#[derive(Clone, Debug)]
pub struct Accepted {
    /// The surface.
    pub mesh: SurfaceMesh,
    /// The components that are not in it.
    pub refused: Vec<RefusedComponent>,
}

impl Repaired {
    /// The components of which no atlas can be made, in the order of their numbers.
    ///
    /// # Errors
    /// [`Error::VolumeElements`], where no other is left.
    pub fn refused(&self) -> Result<Vec<RefusedComponent>, Error> {
        Ok(self.selection()?.refused)
    }

    /// The surface without the components of which no atlas can be made.
    ///
    /// # Errors
    /// [`Error::VolumeElements`], where no other is left.
    ///
    /// ```
    /// use planish_core::{repair, repair::Error, shapes};
    ///
    /// let repaired = |pages| repair(&shapes::book(pages, 1), &repair::Settings::default());
    /// assert!(repaired(3)?.accepted()?.refused.is_empty(), "three sheets that meet in an edge are three charts");
    /// // As many sheets of two triangles as the faces of volume elements have.
    /// let refused = repaired(1100)?.accepted().expect_err("nobody wants so many charts");
    /// assert!(matches!(refused, Error::VolumeElements { sheets: 1099, triangles: 2200, .. }));
    /// # Ok::<(), Error>(())
    /// ```
    pub fn accepted(self) -> Result<Accepted, Error> {
        let Selection { kept, nonmanifold_edges, refused } = self.selection()?;
        let Some(kept) = kept else { return Ok(Accepted { mesh: self.mesh, refused }) };
        let mesh = self.mesh.restricted(&kept);
        let nonmanifold_vertices = pinned_vertices(mesh.welded(), mesh.triangles(), mesh.edges());
        Ok(Accepted { mesh: mesh.of_sheets(Sheets { nonmanifold_edges, nonmanifold_vertices }), refused })
    }

    fn selection(&self) -> Result<Selection, Error> {
        let summary = self.mesh.topology_summary();
        let all = Selection { kept: None, nonmanifold_edges: summary.nonmanifold_edges, refused: vec![] };
        // With as few parts none is cut into too many; nearly all surfaces end here.
        if summary.components <= MAX_TINY_SHEETS {
            return Ok(all);
        }
        let components = Components::new(&self.mesh);
        let refused = components.refused();
        if refused.is_empty() {
            return Ok(all);
        }
        if refused.len() == components.all.len() {
            let vertices = self.report.split_vertices.first.clone();
            let (triangles, nonmanifold_edges) = (summary.triangles, summary.nonmanifold_edges);
            let sheets = components.all.iter().map(Component::sheets_beyond).sum();
            return Err(Error::VolumeElements { sheets, triangles, nonmanifold_edges, vertices });
        }
        let is_kept = |f: &usize| !refused.contains_key(&components.of_face[*f]);
        let kept = (0..components.of_face.len()).filter(is_kept).map(FaceId::at).collect();
        let of_kept = components.all.iter().enumerate().filter(|(number, _)| !refused.contains_key(number));
        let nonmanifold_edges = of_kept.map(|(_, component)| component.nonmanifold_edges).sum();
        let refused = refused.iter().map(|(number, why)| components.refusal(*number, *why, &self.mesh)).collect();
        Ok(Selection { kept: Some(kept), nonmanifold_edges, refused })
    }
}

/// Which faces are worth an atlas (all, where none are named), and which components are not.
struct Selection {
    kept: Option<Vec<FaceId>>,
    /// Edges at which sheets of what is kept met.
    nonmanifold_edges: usize,
    refused: Vec<RefusedComponent>,
}

/// Whether nobody wants charts of so many sheets beyond one for each component.
fn are_too_many(sheets: usize, triangles: usize) -> bool {
    let are_tiny = triangles < TINY_SHEET * sheets;
    sheets > if are_tiny { MAX_TINY_SHEETS } else { MAX_SHEETS }
}

/// Why a component is refused.
#[derive(Clone, Copy)]
enum Why {
    /// It has too many sheets itself.
    Alone,
    /// With the others there are so many.
    Together { in_all: usize },
}

/// The components of a surface.
struct Components {
    /// Per face, the number of its component.
    of_face: Vec<usize>,
    all: Vec<Component>,
}

#[derive(Clone, Debug, Default)]
struct Component {
    sheets: usize,
    triangles: usize,
    first: Option<FaceId>,
    nonmanifold_edges: usize,
    /// The first welded vertices at which its sheets meet.
    vertices: BTreeSet<u32>,
}

impl Component {
    /// Its sheets beyond the one that every component has.
    fn sheets_beyond(&self) -> usize {
        self.sheets - 1
    }
}

impl Components {
    fn new(mesh: &SurfaceMesh) -> Self {
        let mut connected = UnionFind::new(mesh.triangles().len());
        for (_, sides) in mesh.edges().iter() {
            for pair in sides.windows(2) {
                connected.merge(pair[0].face().index(), pair[1].face().index());
            }
        }
        let (sheet_of, sheets) = connected.labels();
        // Repair gave each sheet that met others an edge of its own: they are the same between welded vertices.
        let met = met_edges(mesh);
        for sides in &met {
            for pair in sides.windows(2) {
                connected.merge(pair[0].face().index(), pair[1].face().index());
            }
        }
        let (component_of, count) = connected.labels();
        let of_face: Vec<usize> = component_of.iter().map(|c| *c as usize).collect();
        let mut all = vec![Component::default(); count];
        let mut seen = vec![false; sheets];
        for (face, &number) in of_face.iter().enumerate() {
            let component = &mut all[number];
            component.triangles += 1;
            component.first.get_or_insert(FaceId::at(face));
            component.sheets += usize::from(!std::mem::replace(&mut seen[sheet_of[face] as usize], true));
        }
        for sides in met.iter().filter(|sides| sides.len() > 2) {
            let component = &mut all[of_face[sides[0].face().index()]];
            component.nonmanifold_edges += 1;
            component.vertices.extend(welded_ends(mesh, sides[0]));
            while component.vertices.len() > NAMED {
                component.vertices.pop_last();
            }
        }
        Self { of_face, all }
    }

    /// The components that are refused, and why.
    fn refused(&self) -> BTreeMap<usize, Why> {
        let is_too_many = |c: &Component| are_too_many(c.sheets_beyond(), c.triangles);
        let alone = self.all.iter().enumerate().filter(|(_, component)| is_too_many(component));
        let mut refused: BTreeMap<usize, Why> = alone.map(|(number, _)| (number, Why::Alone)).collect();
        let mut left: Vec<usize> = (0..self.all.len()).filter(|number| !refused.contains_key(number)).collect();
        // Those whose sheets are smallest first; of such as are alike, the last one.
        let of_sheet = |c: &Component| c.triangles as f64 / c.sheets as f64;
        left.sort_by(|a, b| of_sheet(&self.all[*a]).total_cmp(&of_sheet(&self.all[*b])).then(b.cmp(a)));
        let mut sheets: usize = left.iter().map(|number| self.all[*number].sheets_beyond()).sum();
        let mut triangles: usize = left.iter().map(|number| self.all[*number].triangles).sum();
        // A component of one sheet adds nothing to the sum: to refuse it, however small it is, would not help.
        for number in left.into_iter().filter(|number| self.all[*number].sheets_beyond() > 0) {
            if !are_too_many(sheets, triangles) {
                break;
            }
            refused.insert(number, Why::Together { in_all: sheets });
            sheets -= self.all[number].sheets_beyond();
            triangles -= self.all[number].triangles;
        }
        refused
    }

    fn refusal(&self, number: usize, why: Why, mesh: &SurfaceMesh) -> RefusedComponent {
        let component = &self.all[number];
        let (sheets, triangles) = (component.sheets_beyond(), component.triangles);
        let vertices = component.vertices.iter().copied().collect();
        let error = match why {
            Why::Alone => {
                let nonmanifold_edges = component.nonmanifold_edges;
                Error::VolumeElements { sheets, triangles, nonmanifold_edges, vertices }
            }
            Why::Together { in_all } => Error::SheetsTogether { sheets, triangles, in_all, vertices },
        };
        let first_triangle = component.first.map_or(0, |f| mesh.source_triangle(f.index()));
        RefusedComponent { component: number, triangles, first_triangle, error }
    }
}

/// The welded vertices at both ends of a half-edge, ascending.
fn welded_ends(mesh: &SurfaceMesh, h: HalfEdgeId) -> [u32; 2] {
    let vertex = |h: HalfEdgeId| -> VertexId { mesh.triangles()[h.face().index()][h.side()] };
    let [a, b] = [h, h.next()].map(|h| mesh.welded_vertex(vertex(h)));
    [a.min(b), a.max(b)]
}

/// The open edges between the same two welded vertices, where there are several.
fn met_edges(mesh: &SurfaceMesh) -> Vec<Vec<HalfEdgeId>> {
    let open = mesh.edges().iter().filter(|(_, sides)| sides.len() == 1);
    let mut keyed: Vec<([u32; 2], HalfEdgeId)> =
        open.map(|(_, sides)| (welded_ends(mesh, sides[0]), sides[0])).collect();
    keyed.sort_unstable();
    let several = keyed.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() > 1);
    several.map(|same| same.iter().map(|(_, h)| *h).collect()).collect()
}
