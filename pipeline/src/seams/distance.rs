//! How close different seams of a chart come to each other.

use super::{Curve, SeamNetwork};
use crate::mesh::SurfaceMesh;
use crate::topology::ChartId;
use crate::vec3::{BoundingBox, Vec3, dot, sub};

impl SeamNetwork {
    /// The shortest distance in space between two seams beside one chart that share no end, in the unit of the
    /// input; `None` where there are no two. Seams that meet in a corner are not compared: they come as close as
    /// one likes.
    ///
    /// A search of pairs of sets of seams, and then of polylines, halved again and again, for the closest pair of segments (branch
    /// and bound on boxes around their halves): a plate with n holes has n^2 pairs of seams, of which it looks at a few for each.
    pub fn shortest_distance(&self, mesh: &SurfaceMesh) -> Option<f64> {
        let scale = mesh.metric().scale;
        let place = |v: &crate::topology::VertexId| mesh.points()[v.index()].map(|c| c * scale);
        let polyline = |c: &Curve| Polyline::new(c.vertices().iter().map(place).collect());
        let polylines: Vec<Polyline> = self.curves().iter().map(polyline).collect();
        let mut squared = f64::INFINITY;
        for chart in (0..self.loops.len()).map(ChartId::at) {
            let seams = Seams::new(self.seams_beside(chart), &polylines);
            seams.each_near_pair(&mut squared, |i, j, squared| {
                if !self.share_an_end(i, j) {
                    closest(&polylines[i], &polylines[j], squared);
                }
            });
        }
        squared.is_finite().then(|| squared.sqrt() / scale)
    }

    /// The seams that a chart's loops pass, by their positions among the curves, ascending.
    fn seams_beside(&self, chart: ChartId) -> Vec<usize> {
        let passages = self.loops(chart).iter().flatten();
        let mut seams: Vec<usize> = passages.map(|passage| passage.curve.index()).collect();
        seams.retain(|c| !self.curves[*c].is_open());
        seams.sort_unstable();
        seams.dedup();
        seams
    }

    /// Whether two curves begin or end in the same point.
    fn share_an_end(&self, i: usize, j: usize) -> bool {
        let ends = self.curves[j].ends;
        self.curves[i].ends.iter().any(|end| ends.contains(end))
    }
}

/// The seams beside a chart, in an order in which halves lie on either side of the axis along which all of them spread most, and so
/// on in the halves.
struct Seams {
    /// Their positions among the curves.
    order: Vec<usize>,
    halves: Halves,
}

impl Seams {
    fn new(mut order: Vec<usize>, polylines: &[Polyline]) -> Self {
        halve_along_widest(&mut order, polylines);
        let halves = Halves::new(order.len(), |k| polylines[order[k]].halves.boxes[0]);
        Self { order, halves }
    }

    /// Visits pairs of seams whose boxes are closer than `squared`, which the visits lower; the nearer ones first.
    fn each_near_pair(&self, squared: &mut f64, mut visit: impl FnMut(usize, usize, &mut f64)) {
        each_near_pair(&self.halves, &self.halves, squared, |k, l, squared| {
            visit(self.order[k], self.order[l], squared)
        });
    }
}

/// As deep as the logarithm of the number of seams.
fn halve_along_widest(order: &mut [usize], polylines: &[Polyline]) {
    if order.len() < 2 {
        return;
    }
    let of = |i: &usize| polylines[*i].halves.boxes[0];
    let around = BoundingBox::of(order.iter().flat_map(|i| [of(i).min, of(i).max])).unwrap_or(EMPTY);
    let width = |k: usize| around.max[k] - around.min[k];
    let axis = (1..3).fold(0, |best, k| if width(k) > width(best) { k } else { best });
    let centre = |i: &usize| of(i).min[axis] + of(i).max[axis];
    order.sort_unstable_by(|a, b| centre(a).total_cmp(&centre(b)).then(a.cmp(b)));
    let (first, second) = order.split_at_mut(order.len() / 2);
    halve_along_widest(first, polylines);
    halve_along_widest(second, polylines);
}

/// A polyline with boxes around its segments.
struct Polyline {
    points: Vec<Vec3>,
    halves: Halves,
}

impl Polyline {
    fn new(points: Vec<Vec3>) -> Self {
        let of_segment = |k: usize| BoundingBox::of([points[k], points[k + 1]]).unwrap_or(EMPTY);
        let halves = Halves::new(points.len() - 1, of_segment);
        Self { points, halves }
    }
}

/// Boxes around things in a row, their halves, the halves of these and so on.
struct Halves {
    count: usize,
    /// The box around `first..end`, by the position that [`Range`] gives it.
    boxes: Vec<BoundingBox>,
}

/// Things in a row, and the position of their box: that of the halves of box `i` is `2 i + 1` and `2 i + 2`.
#[derive(Clone, Copy)]
struct Range {
    first: usize,
    end: usize,
    at: usize,
}

impl Range {
    fn halves(self) -> [Self; 2] {
        let middle = self.first.midpoint(self.end);
        [Self { end: middle, at: 2 * self.at + 1, ..self }, Self { first: middle, at: 2 * self.at + 2, ..self }]
    }

    fn len(self) -> usize {
        self.end - self.first
    }
}

impl Halves {
    /// Those of so many things, around each of which is a box.
    fn new(count: usize, of: impl Fn(usize) -> BoundingBox) -> Self {
        // Halves of n things are numbered below 4 n.
        let mut halves = Self { count, boxes: vec![EMPTY; 4 * count] };
        if count > 0 {
            halves.fill(halves.whole(), &of);
        }
        halves
    }

    fn whole(&self) -> Range {
        Range { first: 0, end: self.count, at: 0 }
    }

    /// As deep as the logarithm of their number.
    fn fill(&mut self, range: Range, of: &impl Fn(usize) -> BoundingBox) -> BoundingBox {
        self.boxes[range.at] = if range.len() > 1 {
            let [a, b] = range.halves().map(|half| self.fill(half, of));
            BoundingBox::of([a.min, a.max, b.min, b.max]).unwrap_or(EMPTY)
        } else {
            of(range.first)
        };
        self.boxes[range.at]
    }
}

/// Visits pairs, of one thing each, whose boxes are closer than `squared`, which the visits lower; the nearer ones first. Of a
/// set with itself, each pair of different things once. Every step halves one of two ranges, or both, so the stack is never
/// longer than twice the number of halvings.
fn each_near_pair(a: &Halves, b: &Halves, squared: &mut f64, mut visit: impl FnMut(usize, usize, &mut f64)) {
    let is_same = |r: Range, s: Range| std::ptr::eq(a, b) && r.at == s.at;
    let distance = |(r, s): &(Range, Range)| gap(&a.boxes[r.at], &b.boxes[s.at]);
    let mut open = if a.count > 0 && b.count > 0 { vec![(a.whole(), b.whole())] } else { vec![] };
    while let Some((r, s)) = open.pop() {
        if distance(&(r, s)) >= *squared {
            continue;
        }
        match (r.len(), s.len()) {
            (1, 1) if is_same(r, s) => {}
            (1, 1) => visit(r.first, s.first, squared),
            _ if is_same(r, s) => {
                let [first, second] = r.halves();
                open.extend([(first, second), (first, first), (second, second)]);
            }
            (n, m) => {
                let mut next = if n >= m { r.halves().map(|h| (h, s)) } else { s.halves().map(|h| (r, h)) };
                // The nearer half is looked at first.
                if distance(&next[0]) < distance(&next[1]) {
                    next.swap(0, 1);
                }
                open.extend(next);
            }
        }
    }
}

/// Lowers `squared` to the squared distance of two polylines, if that is less.
fn closest(a: &Polyline, b: &Polyline, squared: &mut f64) {
    each_near_pair(&a.halves, &b.halves, squared, |i, j, squared| {
        let (p, q) = (&a.points[i..], &b.points[j..]);
        *squared = squared.min(segment_distance([p[0], p[1]], [q[0], q[1]]));
    });
}

/// A box around nothing.
const EMPTY: BoundingBox = BoundingBox { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };

/// The squared distance of two boxes.
fn gap(a: &BoundingBox, b: &BoundingBox) -> f64 {
    let along = |k: usize| (a.min[k] - b.max[k]).max(b.min[k] - a.max[k]).max(0.0);
    (0..3).map(|k| along(k) * along(k)).sum()
}

/// The squared distance of two segments (Ericson 2005, *Real-time collision detection*, section 5.1.9).
pub(crate) fn segment_distance(p: [Vec3; 2], q: [Vec3; 2]) -> f64 {
    // The points p0 + s d and q0 + t e, with s and t in [0, 1], are r + s d - t e apart.
    let d = sub(p[1], p[0]);
    let e = sub(q[1], q[0]);
    let r = sub(p[0], q[0]);
    let (dd, ee, de) = (dot(d, d), dot(e, e), dot(d, e));
    let (dr, er) = (dot(d, r), dot(e, r));
    // Of segments that are parallel, or points, b is 0: then any place will do to begin with.
    let ratio = |a: f64, b: f64| if b > 0.0 { (a / b).clamp(0.0, 1.0) } else { 0.0 };
    // Closest to the other line, then t for that s, then s for that t, as t may have been held at an end.
    let s = ratio(de * er - dr * ee, dd * ee - de * de);
    let t = ratio(de * s + er, ee);
    let s = ratio(de * t - dr, dd);
    let gap = [0, 1, 2].map(|k| r[k] + s * d[k] - t * e[k]);
    dot(gap, gap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seams::tests::{labelled, sector};
    use crate::shapes;

    #[test]
    fn bands_of_a_tube_are_as_far_apart_as_their_seams() {
        // Circles in the planes through the axis of the torus: closest where its tube is innermost, at 0.6.
        let (mesh, atlas) = labelled(&shapes::ring_torus(24, 12), |p| sector(p, 4));
        let network = SeamNetwork::new(&mesh, atlas.charts(), 0.0);
        let expected = 0.6 * 2.0_f64.sqrt();
        assert!((network.shortest_distance(&mesh).expect("seams") - expected).abs() < 1e-12);
        // Brute force over all pairs of segments agrees.
        let places: Vec<Vec<Vec3>> =
            network.curves().iter().map(|c| c.vertices().iter().map(|v| mesh.points()[v.index()]).collect()).collect();
        let mut least = f64::INFINITY;
        for (i, j) in comparable_pairs(&network) {
            for (p, q) in places[i].windows(2).flat_map(|p| places[j].windows(2).map(move |q| (p, q))) {
                least = least.min(segment_distance([p[0], p[1]], [q[0], q[1]]).sqrt());
            }
        }
        assert!((least - expected).abs() < 1e-12);
    }

    /// All pairs of seams beside a chart that share no end.
    fn comparable_pairs(network: &SeamNetwork) -> Vec<(usize, usize)> {
        let mut pairs = Vec::new();
        for chart in (0..network.loops.len()).map(ChartId::at) {
            let seams = network.seams_beside(chart);
            let all = seams.iter().enumerate().flat_map(|(k, i)| seams[k + 1..].iter().map(move |j| (*i, *j)));
            pairs.extend(all.filter(|(i, j)| !network.share_an_end(*i, *j)));
        }
        pairs
    }

    /// Of hundreds of seams beside a chart, a few for each are looked at, and the closest pair is among them.
    #[test]
    fn near_pairs_of_many_seams_are_few_and_the_closest_is_among_them() {
        let mut random = shapes::Random(5);
        let place = |k: usize| [(k % 20) as f64, (k / 20) as f64, 0.0];
        let mut line = |k: usize| {
            let off: Vec<f64> = (0..6).map(|_| 0.3 * random.symmetric()).collect();
            let [x, y, z] = place(k);
            Polyline::new(vec![[x + off[0], y + off[1], z + off[2]], [x + off[3], y + off[4], z + off[5]]])
        };
        let lines: Vec<Polyline> = (0..400).map(&mut line).collect();
        let (mut squared, mut looks) = (f64::INFINITY, 0);
        Seams::new((0..400).collect(), &lines).each_near_pair(&mut squared, |i, j, squared| {
            assert_ne!(i, j);
            looks += 1;
            closest(&lines[i], &lines[j], squared);
        });
        let mut least = f64::INFINITY;
        for (i, a) in lines.iter().enumerate() {
            lines[i + 1..].iter().for_each(|b| closest(a, b, &mut least));
        }
        assert!(squared == least && looks < 4 * 400, "{squared} {least} {looks}");
    }

    #[test]
    fn one_seam_and_seams_that_meet_have_no_distance() {
        for (soup, count) in [(shapes::sphere(8), 3), (shapes::disk(5), 2), (shapes::disk(5), 1)] {
            let (mesh, atlas) = labelled(&soup, |p| sector(p, count));
            assert_eq!(SeamNetwork::new(&mesh, atlas.charts(), 0.0).shortest_distance(&mesh), None);
        }
    }

    #[test]
    fn segments_cross_run_side_by_side_and_end() {
        let x = [[0.0; 3], [2.0, 0.0, 0.0]];
        assert_eq!(segment_distance(x, [[1.0, -1.0, 1.0], [1.0, 1.0, 1.0]]), 1.0);
        assert_eq!(segment_distance(x, [[0.5, 3.0, 0.0], [9.0, 3.0, 0.0]]), 9.0);
        assert_eq!(segment_distance(x, [[4.0, 0.0, 0.0], [5.0, 7.0, 0.0]]), 4.0);
        assert_eq!(segment_distance(x, [[1.0, 2.0, 0.0]; 2]), 4.0);
    }
}
