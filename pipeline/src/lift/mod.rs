//! Lift: from the planes of charts to the surface.
//!
//! A [`ChartedSurface`] is an atlas as it is written: curved triangles in the plane of each chart, and their straight counterparts
//! in space. [`ChartedSurface::locate`] finds the triangle that a point of a chart's plane lies in, and its barycentric coordinates
//! there: its place on the surface, exact to rounding. [`lift`] does that with the nodes of meshes of the planes, and
//! joins them along the curves between charts.
//!
//! *Watertight and conforming.* A node on the boundary of a chart lies on one edge of the surface, at some share t of it; the
//! node of the neighbour's mesh that is the same lies on the same edge, at the same share. So nodes are joined by edge and share, not
//! by distance, and thin walls never grow together. A node that no neighbour has is an error: there would be a gap.

mod joining;
mod middles;
mod nearest;
mod project;
mod surface;

pub use nearest::Nearest;
pub use project::project;
pub use surface::{ChartedSurface, OnSurface, SurfaceError};

use crate::grid::{GridPoint, orientation};
use crate::vec3::Vec3;
use joining::Joined;
use middles::Middles;

/// A mesh of the plane of a chart.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlanarPart {
    /// The number of the chart.
    pub chart: usize,
    /// Where its nodes are.
    pub uv: Vec<[f64; 2]>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// A mesh on the surface.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lifted {
    /// Where its nodes are.
    pub points: Vec<Vec3>,
    /// Per node, its place on the surface.
    pub places: Vec<Place>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Per triangle the nodes in the middle of its sides 01, 12 and 20; empty where these were not asked for.
    pub middles: Vec<[u32; 3]>,
    /// Per triangle, the number of its chart.
    pub charts: Vec<u32>,
}

/// The elements of a mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Elements {
    /// Triangles of three nodes.
    #[default]
    Linear,
    /// Of six: those in the middle of sides lie on the surface, too.
    Quadratic,
}

/// A place on a surface: a cell of surface.vtu, and the weights of its corners, which add up to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The number of the cell in the surface.
    pub cell: u32,
    /// The weights.
    pub weights: [f64; 3],
}

/// Why meshes cannot be lifted, or joined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// There is no such chart.
    #[error("there is no chart {chart}: the atlas has {charts}, from 0")]
    NoChart {
        /// The number.
        chart: usize,
        /// How many there are.
        charts: usize,
    },
    /// Charts that are wanted have no mesh.
    #[error("{} of the charts have no mesh, chart {} is the first", .charts.len(), .charts[0])]
    Missing {
        /// The charts.
        charts: Vec<usize>,
    },
    /// A chart has two meshes.
    #[error("chart {chart} has two meshes: name one")]
    Twice {
        /// The chart.
        chart: usize,
    },
    /// Triangles of a plane that are turned, or have no area there.
    #[error("{triangles} of the triangles of chart {chart} are folded over in the plane, or have no area there; the first is near uv ({}, {})", .uv[0], .uv[1])]
    Folded {
        /// The chart.
        chart: usize,
        /// How many.
        triangles: usize,
        /// A corner of the first.
        uv: [f64; 2],
    },
    /// A node on the boundary of a mesh is not on that of the chart.
    #[error("{nodes} nodes on the boundary of the mesh of chart {chart} are not on that of the chart; the first is at uv ({}, {}), off by {distance:.3e}: have the mesher keep its boundary", .uv[0], .uv[1])]
    OffBoundary {
        /// The chart.
        chart: usize,
        /// How many.
        nodes: usize,
        /// The first one.
        uv: [f64; 2],
        /// How far off it is, in the plane.
        distance: f64,
    },
    /// Nodes on a seam that the neighbour has not.
    #[error("{nodes} nodes of chart {chart} on seams have no counterpart in its neighbours; the first is at ({}, {}, {}): have the mesher keep its boundary", .at[0], .at[1], .at[2])]
    NotConforming {
        /// The first such chart.
        chart: usize,
        /// How many, in all charts.
        nodes: usize,
        /// The first one.
        at: Vec3,
    },
}

/// The meshes of some charts on the surface, joined.
///
/// ```
/// use planish_core::lift::{ChartedSurface, Elements, PlanarPart, lift};
///
/// // A square of two triangles, folded along its diagonal, each of which is a chart.
/// let points = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0]];
/// let middle = |a: usize, b: usize| [0, 1, 2].map(|k| 0.5 * (points[a][k] + points[b][k]));
/// let nodes = |[a, b, c]: [usize; 3]| [points[a], points[b], points[c], middle(a, b), middle(b, c), middle(c, a)];
/// let corner = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];
/// let space = [nodes([0, 1, 2]), nodes([2, 3, 0])].concat();
/// let cells = vec![[0, 1, 2, 3, 4, 5], [6, 7, 8, 9, 10, 11]];
/// let surface = ChartedSurface::new(&space, &[corner, corner].concat(), &cells, &[0, 1])?;
///
/// // The planes are meshed by two triangles each, with a node in the middle of the diagonal.
/// let part = |chart| PlanarPart {
///     chart,
///     uv: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.5]],
///     triangles: vec![[0, 1, 3], [3, 1, 2]],
/// };
/// let lifted = lift(&surface, &[part(0), part(1)], Elements::Linear)?;
/// assert_eq!((lifted.points.len(), lifted.triangles.len()), (5, 4), "three nodes on the diagonal are shared");
/// assert!(lifted.points.contains(&[0.5, 0.5, 0.0]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error`].
pub fn lift(surface: &ChartedSurface, parts: &[PlanarPart], elements: Elements) -> Result<Lifted, Error> {
    let mut has_part = vec![false; surface.charts()];
    for part in parts {
        let charts = surface.charts();
        let known = has_part.get_mut(part.chart).ok_or(Error::NoChart { chart: part.chart, charts })?;
        if std::mem::replace(known, true) {
            return Err(Error::Twice { chart: part.chart });
        }
    }
    let mut parts: Vec<&PlanarPart> = parts.iter().collect();
    parts.sort_by_key(|part| part.chart);
    let mut joined = Joined::new(surface, &has_part);
    let mut middles = Middles::new(surface);
    let mut lifted = Lifted::default();
    for part in parts {
        let triangles = turned_left(part)?;
        let nodes = joined.add(part, &triangles, &mut lifted)?;
        lifted.triangles.extend(triangles.iter().map(|t| t.map(|n| nodes[n as usize])));
        if elements == Elements::Quadratic {
            middles.add(part, &triangles, &nodes, &mut lifted);
        }
        lifted.charts.extend(std::iter::repeat_n(part.chart as u32, triangles.len()));
    }
    joined.finish(lifted)
}

/// The triangles of a part, turning left: all of a mesh may turn right.
fn turned_left(part: &PlanarPart) -> Result<Vec<[u32; 3]>, Error> {
    let sign = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|n| GridPoint::mid(part.uv[n as usize]));
        orientation(a, b, c).signum()
    };
    let left = part.triangles.iter().filter(|t| sign(t) > 0).count();
    let wanted = if 2 * left >= part.triangles.len() { 1 } else { -1 };
    let mut folded = part.triangles.iter().filter(|t| sign(t) != wanted);
    if let Some(first) = folded.next() {
        let uv = part.uv[first[0] as usize];
        return Err(Error::Folded { chart: part.chart, triangles: 1 + folded.count(), uv });
    }
    let turned = |[a, b, c]: &[u32; 3]| if wanted > 0 { [*a, *b, *c] } else { [*a, *c, *b] };
    Ok(part.triangles.iter().map(turned).collect())
}

/// A place, and where it is.
struct Placed {
    point: Vec3,
    place: Place,
}

impl Lifted {
    fn push(&mut self, Placed { point, place }: Placed) {
        self.points.push(point);
        self.places.push(place);
    }
}
