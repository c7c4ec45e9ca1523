//! An atlas as it is written: charts by their curved triangles.

use super::{Place, Placed};
use crate::evaluate::{CurvedMap, Located, OnBoundary};
use crate::vec3::Vec3;

/// The charts of a surface, in the plane and in space.
#[derive(Clone, Debug)]
pub struct ChartedSurface {
    charts: Vec<ChartMap>,
}

/// A point of a surface, found by its uv.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnSurface {
    /// Where it is.
    pub point: Vec3,
    /// The same, on the surface.
    pub place: Place,
    /// How far its uv are from those asked for: 0, unless these are outside of the chart.
    pub off: f64,
}

/// One chart.
#[derive(Clone, Debug)]
pub(super) struct ChartMap {
    pub map: CurvedMap,
    /// Per triangle of the chart, its number in the surface.
    pub cells: Vec<u32>,
    /// Per node of the chart that is a corner, its number among all, where those at the same place are one.
    corners: Vec<u32>,
}

/// A place on an edge of the surface, between corners a and b, the lesser number first; a corner where both are the same.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub(super) struct OnEdge {
    pub ends: [u32; 2],
    /// Where between them, from 0 to 1.
    pub t: f64,
}

/// Nodes nearer to the end of an edge than this share of it are that.
pub(super) const CLOSE: f64 = 1e-5;

/// What is no charted surface.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SurfaceError {
    /// There are not as many of these as there should be.
    #[error("there are {found} {what} for {expected}")]
    Count {
        /// What.
        what: &'static str,
        /// How many.
        found: usize,
        /// How many there should be.
        expected: usize,
    },
    /// A cell names a point that does not exist.
    #[error("cell {cell} names point {point}, and there are {points}")]
    NoPoint {
        /// The cell.
        cell: usize,
        /// The point.
        point: u32,
        /// How many there are.
        points: usize,
    },
    /// A chart without cells: numbers go from 0 without gaps.
    #[error("chart {chart} has no cells, and there are charts of higher numbers")]
    Empty {
        /// The chart.
        chart: usize,
    },
}

impl ChartedSurface {
    /// A surface by the `points` and the `uv` of its nodes, its `cells` of six nodes each, and the chart of each cell. Charts
    /// share no nodes; where they meet, corners lie at the same place, to the bit.
    ///
    /// # Errors
    /// [`SurfaceError`].
    pub fn new(points: &[Vec3], uv: &[[f64; 2]], cells: &[[u32; 6]], charts: &[u32]) -> Result<Self, SurfaceError> {
        let expect = |what, found: usize, expected: usize| {
            if found == expected { Ok(()) } else { Err(SurfaceError::Count { what, found, expected }) }
        };
        expect("uv", uv.len(), points.len())?;
        expect("charts", charts.len(), cells.len())?;
        for (cell, nodes) in cells.iter().enumerate() {
            if let Some(point) = nodes.iter().find(|n| **n as usize >= points.len()) {
                return Err(SurfaceError::NoPoint { cell, point: *point, points: points.len() });
            }
        }
        let mut by_chart: Vec<Vec<u32>> = Vec::new();
        for (cell, chart) in (0..).zip(charts) {
            // No more charts than cells: what is above is a gap.
            let chart = (*chart as usize).min(cells.len());
            by_chart.resize(by_chart.len().max(chart + 1), Vec::new());
            by_chart[chart].push(cell);
        }
        if let Some(chart) = by_chart.iter().position(Vec::is_empty) {
            return Err(SurfaceError::Empty { chart });
        }
        let joined = joined_corners(points, cells);
        let charts = by_chart.into_iter().map(|numbers| ChartMap::new(points, uv, cells, numbers, &joined)).collect();
        Ok(Self { charts })
    }

    /// How many charts there are.
    pub fn charts(&self) -> usize {
        self.charts.len()
    }

    /// The place of a point of the plane of a chart; where it is outside, the nearest one of its boundary. None where
    /// there is no such chart.
    pub fn locate(&self, chart: usize, uv: [f64; 2]) -> Option<OnSurface> {
        let chart = self.charts.get(chart)?;
        let located = chart.map.to_space(uv)?;
        let Placed { point, place } = chart.placed(&located);
        Some(OnSurface { point, place, off: located.distance })
    }

    pub(super) fn chart(&self, chart: usize) -> &ChartMap {
        &self.charts[chart]
    }
}

impl ChartMap {
    fn new(points: &[Vec3], uv: &[[f64; 2]], cells: &[[u32; 6]], numbers: Vec<u32>, joined: &[u32]) -> Self {
        let mut nodes: Vec<u32> = numbers.iter().flat_map(|cell| cells[*cell as usize]).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: u32| nodes.partition_point(|n| *n < node) as u32;
        let of_chart = numbers.iter().map(|cell| cells[*cell as usize].map(local)).collect();
        let map = CurvedMap::new(
            nodes.iter().map(|n| points[*n as usize]).collect(),
            nodes.iter().map(|n| uv[*n as usize]).collect(),
            of_chart,
        );
        Self { map, cells: numbers, corners: nodes.iter().map(|n| joined[*n as usize]).collect() }
    }

    /// A place on the boundary, as one on an edge of the surface that other charts know, too.
    pub fn on_edge(&self, OnBoundary { cell, side, t, .. }: &OnBoundary) -> OnEdge {
        let nodes = self.map.cells()[*cell as usize];
        let [a, b] = [nodes[*side], nodes[(side + 1) % 3]].map(|n| self.corners[n as usize]);
        let (ends, t) = if a <= b { ([a, b], *t) } else { ([b, a], 1.0 - t) };
        match t {
            t if t <= CLOSE => OnEdge { ends: [ends[0]; 2], t: 0.0 },
            t if t >= 1.0 - CLOSE => OnEdge { ends: [ends[1]; 2], t: 0.0 },
            t => OnEdge { ends, t },
        }
    }

    /// The ends of all sides of the boundary.
    pub fn boundary_ends(&self) -> impl Iterator<Item = [u32; 2]> {
        self.map.boundary().iter().map(|(cell, side)| {
            let (nodes, side) = (self.map.cells()[*cell as usize], usize::from(*side));
            let [a, b] = [nodes[side], nodes[(side + 1) % 3]].map(|n| self.corners[n as usize]);
            [a.min(b), a.max(b)]
        })
    }

    /// The corners of its triangles, in space.
    pub fn corners(&self) -> impl Iterator<Item = [Vec3; 3]> {
        self.map.cells().iter().map(|[a, b, c, ..]| [a, b, c].map(|n| self.map.point(*n)))
    }

    /// A point of the chart, as one of the surface.
    pub fn placed(&self, located: &Located) -> Placed {
        let place = Place { cell: self.cells[located.triangle as usize], weights: located.weights };
        Placed { point: self.map.point_of(located), place }
    }

    /// A point of its boundary, likewise.
    pub fn of_boundary(&self, OnBoundary { cell, side, t, distance }: &OnBoundary) -> Placed {
        let mut weights = [0.0; 3];
        weights[*side] = 1.0 - t;
        weights[(side + 1) % 3] = *t;
        self.placed(&Located { triangle: *cell, weights, distance: *distance })
    }
}

/// Per node, a number that is the same for all corners at its place.
fn joined_corners(points: &[Vec3], cells: &[[u32; 6]]) -> Vec<u32> {
    let mut is_corner = vec![false; points.len()];
    cells.iter().for_each(|cell| cell[..3].iter().for_each(|n| is_corner[*n as usize] = true));
    // Adding 0 makes -0 and 0 one.
    let key = |n: u32| points[n as usize].map(|c| (c + 0.0).to_bits());
    let mut corners: Vec<u32> = (0..points.len() as u32).filter(|n| is_corner[*n as usize]).collect();
    corners.sort_unstable_by_key(|n| (key(*n), *n));
    let mut joined = vec![u32::MAX; points.len()];
    for same in corners.chunk_by(|a, b| key(*a) == key(*b)) {
        same.iter().for_each(|n| joined[*n as usize] = same[0]);
    }
    joined
}
