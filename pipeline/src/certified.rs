//! Charts with their certified maps, and the atlas that they make.
//!
//! A [`CertifiedChart`] owns a chart, its certified map, how that was found, and how it distorts. A [`CertifiedAtlas`] owns the
//! surface, its certified charts, and the curves between them. They are what meshers, viewers and reports are made from.

use crate::atlas::Chart;
use crate::certify::CertifiedMap;
use crate::fem::sparse;
use crate::map::linear;
use crate::map::natural::NoNatural;
use crate::measure::distortion::{self, CellFields, Summary};
use crate::mesh::SurfaceMesh;
use crate::repair::RefusedComponent;
use crate::seams::SeamNetwork;
use crate::topology::{ChartId, FaceId};
use crate::untangle;

/// A chart with its certified map, the account of how that was found, and how much it distorts.
///
/// ```
/// use planish_core::monitor::NoMonitor;
/// use planish_core::{Settings, parametrize, shapes};
///
/// let atlas = parametrize(&shapes::disk(6), &Settings::default(), &NoMonitor)?;
/// let certified = &atlas.charts()[0];
/// // The nodes of the map: the vertices of the chart, then the middles of its edges.
/// let (chart, map) = (certified.chart(), certified.map().map());
/// assert_eq!(map.nodes.len(), chart.points().len() + chart.edges().len());
/// // Its boundary consists of chords: the middle of an edge lies in the middle, exactly.
/// let side = chart.outer()[0];
/// let [from, to] = [side, side.next()].map(|h| map.nodes[chart.from(h).index()]);
/// assert_eq!(map.nodes[chart.points().len() + chart.edges().edge(side).index()], from.midpoint(to));
/// # Ok::<(), planish_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CertifiedChart {
    chart: Chart,
    map: CertifiedMap,
    start: CertifiedMap,
    provenance: Provenance,
    fields: Vec<CellFields>,
    distortion: Summary,
}

/// Which boundary a map has in the plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BoundaryFound {
    /// That of a conformal map with a free boundary, in chords.
    Natural,
    /// Freed from the disk, so that the map is near an isometry, in chords.
    Freed {
        /// Why it is not the natural one.
        why_none: NoNatural,
    },
    /// The unit circle.
    Circle {
        /// Why it is not the natural one, where that was asked for.
        why_none: Option<NoNatural>,
    },
}

impl BoundaryFound {
    /// Whether the boundary is one of the chart's own, not the circle: it consists of chords, along holes, too.
    pub fn is_own(self) -> bool {
        match self {
            Self::Natural | Self::Freed { .. } => true,
            Self::Circle { .. } => false,
        }
    }
}

/// How a map was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// Its boundary.
    pub boundary: BoundaryFound,
    /// The linear map.
    pub linear: LinearSummary,
    /// The harmonic map, where it was asked for and could be computed.
    pub harmonic: Option<Harmonic>,
    /// What untangling did, where there was a harmonic map.
    pub untangle: Option<untangle::Report>,
    /// Why there is no harmonic map although it was asked for: the map is the linear one then, of degree elevated.
    pub unsolved: Option<sparse::Unsolvable>,
}

/// A linear map in numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinearSummary {
    /// Triangles that the harmonic map by linear elements folds.
    pub folded: usize,
    /// Edges with other than harmonic weights.
    pub edges_changed: usize,
    /// How the map was found.
    pub method: linear::Method,
}

/// The harmonic map in numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonic {
    /// Per triangle of the chart, whether it is invalid in the harmonic map.
    pub invalid: Vec<bool>,
    /// The least jacobian determinant, per unit of mollified area of the triangle in space, in the unit of the shapes.
    pub det_min: f64,
}

impl CertifiedChart {
    /// `map` and `start` are maps of `chart`, and `area_ratio` that of `map`.
    pub(crate) fn new(
        chart: Chart,
        map: CertifiedMap,
        start: CertifiedMap,
        provenance: Provenance,
        area_ratio: f64,
    ) -> Self {
        let fields = distortion::fields(&chart, &map);
        let distortion = distortion::summary(&chart, &fields, area_ratio);
        Self { chart, map, start, provenance, fields, distortion }
    }

    /// The chart.
    pub fn chart(&self) -> &Chart {
        &self.chart
    }

    /// The number of the chart in its atlas. Before it is gathered, parts of one chart have the number of that.
    pub fn id(&self) -> ChartId {
        self.chart.id()
    }

    /// The map. Nodes: the vertices of the chart, then its edges, in its numbering.
    pub fn map(&self) -> &CertifiedMap {
        &self.map
    }

    /// The map from which untangling started, of the same nodes: its triangles inside are straight.
    pub fn start(&self) -> &CertifiedMap {
        &self.start
    }

    /// How the map was found.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// How the map distorts each triangle.
    pub fn fields(&self) -> &[CellFields] {
        &self.fields
    }

    /// How much the map distorts the chart.
    pub fn distortion(&self) -> &Summary {
        &self.distortion
    }

    /// Per triangle, whether it was invalid in the harmonic map.
    pub fn untangled(&self) -> impl Iterator<Item = bool> {
        let invalid = self.provenance.harmonic.as_ref().map(|h| &h.invalid);
        (0..self.chart.triangles().len()).map(move |f| invalid.is_some_and(|invalid| invalid[f]))
    }

    #[cfg(test)]
    pub(crate) fn with_maps(self, map: CertifiedMap, start: CertifiedMap) -> Self {
        Self { map, start, ..self }
    }
}

impl AsRef<Chart> for CertifiedChart {
    fn as_ref(&self) -> &Chart {
        &self.chart
    }
}

/// A surface, its charts with their certified maps, and the curves between them.
///
/// Made by [`CertifiedAtlas::gather`] only: its charts are charts of its surface, no triangle belongs to two of them, and
/// the number of each is its position.
#[derive(Clone, Debug)]
pub struct CertifiedAtlas {
    mesh: SurfaceMesh,
    charts: Vec<CertifiedChart>,
    seams: SeamNetwork,
    refused: Vec<RefusedComponent>,
}

/// Why charts make no atlas of a surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum GatherError {
    /// A chart is no chart of this surface: a triangle has other vertices, or lies elsewhere.
    #[error("triangle {face} of part {part} is no triangle of this surface: the part was made from another one")]
    Foreign {
        /// The position of the chart among those given.
        part: usize,
        /// The triangle, as numbered in the surface that the chart is of.
        face: FaceId,
    },
    /// Two charts have a triangle in common.
    #[error("triangle {face} belongs to parts {first} and {second}: one part was given twice, or split in two ways")]
    Twice {
        /// The triangle of the surface.
        face: FaceId,
        /// The position of the first chart that has it among those given.
        first: usize,
        /// That of the second one.
        second: usize,
    },
    /// A triangle belongs to none.
    #[error("triangle {face} belongs to no part, as {count} of them do: a part is missing")]
    Missing {
        /// The first such triangle of the surface.
        face: FaceId,
        /// How many there are.
        count: usize,
    },
}

impl CertifiedAtlas {
    /// Puts the charts of `mesh` together and numbers them in this order; finds the curves between them, for a mesh with
    /// edges of length `size` (see [`crate::Settings::size`]).
    ///
    /// ```
    /// use planish_core::monitor::NoMonitor;
    /// use planish_core::{CertifiedAtlas, Plan, Settings, repair, shapes};
    ///
    /// let settings = Settings::default();
    /// let mesh = repair(&shapes::sphere(8), &settings.repair)?.accepted()?.mesh;
    /// let Plan { mesh, jobs, .. } = Plan::new(mesh, &settings, &NoMonitor)?;
    /// // Jobs know nothing of each other, nor of the surface: here they are done from the last to the first.
    /// let mut certified = Vec::new();
    /// for job in jobs.into_iter().rev() {
    ///     certified.push(job.run(&NoMonitor)?);
    /// }
    /// certified.reverse();
    /// let atlas = CertifiedAtlas::gather(mesh, certified.concat(), settings.size)?;
    /// assert!(atlas.charts().iter().zip(0..).all(|(chart, id)| chart.id().0 == id));
    /// # Ok::<(), planish_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`GatherError`]: together they do not hold every triangle of `mesh` once.
    pub fn gather(mesh: SurfaceMesh, charts: Vec<CertifiedChart>, size: Option<f64>) -> Result<Self, GatherError> {
        let owners = owners(&mesh, &charts)?;
        let mut without = owners.iter().enumerate().filter(|(_, owner)| owner.is_none());
        match without.next() {
            Some((face, _)) => Err(GatherError::Missing { face: FaceId::at(face), count: 1 + without.count() }),
            None => Ok(Self::new(mesh, charts, size)),
        }
    }

    fn new(mesh: SurfaceMesh, mut charts: Vec<CertifiedChart>, size: Option<f64>) -> Self {
        for (index, certified) in charts.iter_mut().enumerate() {
            certified.chart.id = ChartId::at(index);
        }
        let spacing = NARROW * size.unwrap_or_else(|| mesh.default_size());
        let seams = SeamNetwork::new(&mesh, &charts, spacing);
        Self { mesh, charts, seams, refused: vec![] }
    }

    /// The same, beside which these components were refused.
    pub(crate) fn beside(self, refused: Vec<RefusedComponent>) -> Self {
        Self { refused, ..self }
    }

    /// The components of the input that are not part of the surface, as they cannot be processed.
    pub fn refused(&self) -> &[RefusedComponent] {
        &self.refused
    }

    /// The surface.
    pub fn mesh(&self) -> &SurfaceMesh {
        &self.mesh
    }

    /// The charts, in the order of their ids.
    pub fn charts(&self) -> &[CertifiedChart] {
        &self.charts
    }

    /// The label of all triangles of a chart ([`crate::mesh::TriangleSoup::with_labels`]); none where the input has no labels.
    pub fn label(&self, chart: ChartId) -> Option<u32> {
        self.mesh.label(self.charts[chart.index()].chart().faces()[0].index())
    }

    /// The curves between charts, and along the open boundary.
    pub fn seams(&self) -> &SeamNetwork {
        &self.seams
    }

    /// The surface and its charts, for those who go on with them.
    pub fn into_parts(self) -> (SurfaceMesh, Vec<CertifiedChart>) {
        (self.mesh, self.charts)
    }
}

/// A place is narrow if it is narrower than this share of an edge. Corners of the shape that are nearer together are not
/// all kept, as they would make narrow places. By experience: lower leaves elements across that lean, higher makes small
/// ones where those of the size would do.
pub const NARROW: f64 = 0.75;

/// Per triangle of `mesh`, the position of the chart that it belongs to.
fn owners(mesh: &SurfaceMesh, charts: &[CertifiedChart]) -> Result<Vec<Option<usize>>, GatherError> {
    let mut owners = vec![None; mesh.triangles().len()];
    for (part, chart) in charts.iter().map(CertifiedChart::chart).enumerate() {
        for (local, &face) in chart.faces().iter().enumerate() {
            let corners = chart.triangles()[local].map(|v| chart.vertices()[v.index()]);
            let is_here = mesh.triangles().get(face.index()) == Some(&corners)
                && mesh.corners(face.index()) == chart.corners(local);
            if !is_here {
                return Err(GatherError::Foreign { part, face });
            }
            if let Some(first) = owners[face.index()].replace(part) {
                return Err(GatherError::Twice { face, first, second: part });
            }
        }
    }
    Ok(owners)
}
