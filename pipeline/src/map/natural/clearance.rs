//! A barrier that keeps the loops of a boundary apart.
//!
//! Of each vertex v and each side s of the boundary that are not neighbours (Smith and Schaefer 2015, *Bijective
//! parameterization with free boundaries*, doi 10.1145/2766947, equation 6),
//!
//! ```text
//! h^2 max(0, r / |v - s| - 1)^2,    r = share min(REACH h, distance of v and s in space / 2),    h the mean side.
//! ```
//!
//! The second term of r is not theirs: sides that lie near each other on the surface do so in the plane, and a flat
//! sheet is at rest. Nor is the share: while a map is far from an isometry, lengths in space say little of those in the
//! plane. Loops that cross are not told from others by this: see [`Clearance::is_kept`].

use super::{Around, RADIUS};
use crate::atlas::Chart;
use crate::certify::polygons;
use crate::evaluate::Bvh;
use crate::fem::isotropic::Local;
use crate::grid::GridPoint;
use crate::topology::HalfEdgeId;
use crate::vec3::{BoundingBox, Vec3, norm};

/// How far the barrier reaches, as a share of the mean side. A quarter, as in the paper.
const REACH: f64 = 0.25;

/// The least reach of a pair, as a share of that: what touches in space is kept apart in the plane all the same.
const LEAST: f64 = 1e-2;

/// The loops of a chart.
pub(super) struct Clearance {
    /// Per loop the vertices in its order.
    loops: Vec<Vec<usize>>,
    /// The sides of all loops, by their ends.
    sides: Vec<[usize; 2]>,
    /// Per vertex, where it is in space, in the unit of the shapes.
    points: Vec<Vec3>,
    /// The mean side.
    mean: f64,
}

/// Loops that are kept apart, and how far the barrier reaches as a share (0 to 1) of how far it does at most.
#[derive(Clone, Copy)]
pub(super) struct Barrier<'a> {
    pub clearance: &'a Clearance,
    pub share: f64,
}

/// A vertex and a side that are nearer to each other than they should be.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// The vertex, and the ends of the side.
    pub vertices: [usize; 3],
    /// How far the barrier reaches here.
    reach: f64,
}

/// The foot of a perpendicular on a side: how far along, and the vector from there.
struct Foot<const N: usize> {
    along: f64,
    from: [f64; N],
}

impl Clearance {
    pub fn of(chart: &Chart) -> Self {
        let order = |l: &[HalfEdgeId]| l.iter().map(|h| chart.from(*h).index()).collect();
        let loops: Vec<Vec<usize>> = chart.loops().map(order).collect();
        let sides_of =
            |l: &Vec<usize>| -> Vec<[usize; 2]> { (0..l.len()).map(|i| [l[i], l[(i + 1) % l.len()]]).collect() };
        let sides: Vec<[usize; 2]> = loops.iter().flat_map(sides_of).collect();
        let length: f64 = chart.boundary().map(|h| chart.length(h)).sum();
        let points = chart.points().iter().map(|p| p.map(|c| c * chart.scale())).collect();
        Self { mean: length / sides.len() as f64, loops, sides, points }
    }

    /// What is near at `uv`, in an order that depends on nothing else, with the barrier reaching a `share` (0 to 1) as
    /// far as it does at most.
    pub fn near(&self, uv: &[[f64; 2]], share: f64) -> Vec<Near> {
        let half = 0.5 * share * REACH * self.mean;
        let mut near = Vec::new();
        let boxes = self.sides.iter().map(|ends| around(ends.map(|v| uv[v]), half));
        Bvh::new(boxes).pairs(|i, j| {
            for (s, t) in [(i, j), (j, i)] {
                // Every vertex of a boundary begins one side.
                let (v, ends) = (self.sides[s as usize][0], self.sides[t as usize]);
                near.extend(self.pair(uv, v, ends, share));
            }
        });
        near.sort_unstable_by_key(|n| n.vertices);
        near
    }

    fn pair(&self, uv: &[[f64; 2]], v: usize, [a, b]: [usize; 2], share: f64) -> Option<Near> {
        if v == a || v == b {
            return None;
        }
        let most = REACH * self.mean;
        let distance = length(foot(uv[v], [uv[a], uv[b]]).from);
        if distance >= share * most {
            return None;
        }
        let in_space = norm(foot(self.points[v], [self.points[a], self.points[b]]).from);
        let reach = share * (0.5 * in_space).clamp(LEAST * most, most);
        (distance < reach).then_some(Near { vertices: [v, a, b], reach })
    }

    /// The barrier of all that is `near`, at `uv`.
    pub fn energy(&self, near: &[Near], uv: &[[f64; 2]]) -> f64 {
        near.iter().map(|n| self.value(n, uv)).sum()
    }

    fn value(&self, near: &Near, uv: &[[f64; 2]]) -> f64 {
        let [v, a, b] = near.vertices.map(|v| uv[v]);
        let excess = (near.reach / length(foot(v, [a, b]).from) - 1.0).max(0.0);
        self.mean * self.mean * excess * excess
    }

    /// Gradient and Hessian of the barrier of what is `near`. The concave part, by which a direction turns, is dropped.
    pub fn local(&self, near: &Near, uv: &[[f64; 2]]) -> Local<6> {
        let [v, a, b] = near.vertices.map(|v| uv[v]);
        let foot = foot(v, [a, b]);
        let distance = length(foot.from);
        let ratio = near.reach / distance;
        let weight = self.mean * self.mean;
        let slope = -2.0 * weight * (ratio - 1.0) * ratio / distance;
        let curvature = 2.0 * weight * ratio * (3.0 * ratio - 2.0) / (distance * distance);
        let normal = foot.from.map(|c| c / distance);
        let shares = [1.0, foot.along - 1.0, -foot.along];
        let form: [f64; 6] = std::array::from_fn(|i| shares[i / 2] * normal[i % 2]);
        Local { gradient: form.map(|c| slope * c), hessian: form.map(|c| form.map(|d| curvature * c * d)) }
    }

    /// Whether the loops are simple and rightly nested, exactly, on the grid that they are rounded to.
    pub fn is_kept(&self, uv: &[[f64; 2]]) -> bool {
        let around = Around::of(uv);
        let Some(fitted) = around.scaled(uv, RADIUS / around.half_diagonal()) else { return false };
        let polygon = |l: &Vec<usize>| l.iter().map(|v| GridPoint::vertex(fitted[*v])).collect();
        let polygons: Vec<Vec<GridPoint>> = self.loops.iter().map(polygon).collect();
        polygons::check(&polygons).is_none()
    }
}

fn around([p, q]: [[f64; 2]; 2], slack: f64) -> BoundingBox {
    let [x, y] = [0, 1].map(|k| [p[k].min(q[k]) - slack, p[k].max(q[k]) + slack]);
    BoundingBox { min: [x[0], y[0], 0.0], max: [x[1], y[1], 0.0] }
}

/// The nearest point of a side.
fn foot<const N: usize>(p: [f64; N], [a, b]: [[f64; N]; 2]) -> Foot<N> {
    let minus = |p: [f64; N], q: [f64; N]| -> [f64; N] { std::array::from_fn(|k| p[k] - q[k]) };
    let times = |p: [f64; N], q: [f64; N]| -> f64 { (0..N).map(|k| p[k] * q[k]).sum() };
    let (side, to) = (minus(b, a), minus(p, a));
    let square = times(side, side);
    let along = if square > 0.0 { (times(to, side) / square).clamp(0.0, 1.0) } else { 0.0 };
    Foot { along, from: std::array::from_fn(|k| to[k] - along * side[k]) }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{decompose, repair, shapes};

    fn chart() -> Chart {
        let mesh = repair(&shapes::flat_disk(2), &Default::default()).expect("a surface").mesh;
        decompose::assemble(&mesh, &vec![0; mesh.triangles().len()]).expect("a disk").into_charts().remove(0)
    }

    fn places(chart: &Chart) -> Vec<[f64; 2]> {
        chart.points().iter().map(|[x, y, _]| [x * chart.scale(), y * chart.scale()]).collect()
    }

    #[test]
    fn a_flat_sheet_is_at_rest_and_where_a_vertex_comes_near_a_side_the_barrier_grows() {
        let chart = chart();
        let clearance = Clearance::of(&chart);
        let mut uv = places(&chart);
        assert!(clearance.near(&uv, 1.0).is_empty() && clearance.is_kept(&uv));
        // The first vertex of the loop, drawn across towards the opposite side.
        let l = &clearance.loops[0];
        let (v, [a, b]) = (l[0], [l[l.len() / 2], l[l.len() / 2 + 1]]);
        let from = uv[v];
        let mut last = 0.0;
        for gap in [0.2, 0.1, 0.01] {
            let to = [0, 1].map(|k| 0.5 * (uv[a][k] + uv[b][k]));
            let length = length([from[0] - to[0], from[1] - to[1]]);
            uv[v] = [0, 1].map(|k| to[k] + gap * clearance.mean * (from[k] - to[k]) / length);
            let energy = clearance.energy(&clearance.near(&uv, 1.0), &uv);
            assert!(energy > last && clearance.is_kept(&uv));
            last = energy;
        }
        // Beyond it the loop crosses itself.
        uv[v] = [0, 1].map(|k| 1.2 * 0.5 * (uv[a][k] + uv[b][k]));
        assert!(!clearance.is_kept(&uv));
    }

    #[test]
    fn the_gradient_of_the_barrier_is_its_derivative() {
        let chart = chart();
        let clearance = Clearance::of(&chart);
        let near = Near { vertices: [0, 1, 2], reach: 0.3 };
        for v in [[0.5, 0.1], [-0.1, 0.05], [1.05, -0.1]] {
            let mut uv = vec![[0.0; 2]; chart.vertices().len()];
            [uv[0], uv[1], uv[2]] = [v, [0.0, 0.0], [1.0, 0.1]];
            let local = clearance.local(&near, &uv);
            for i in 0..6 {
                let at = |by: f64| {
                    let mut moved = uv.clone();
                    moved[i / 2][i % 2] += by;
                    clearance.value(&near, &moved)
                };
                let slope = (at(1e-6) - at(-1e-6)) / 2e-6;
                assert!((slope - local.gradient[i]).abs() < 1e-5 * (1.0 + slope.abs()), "{slope}");
            }
        }
    }
}
