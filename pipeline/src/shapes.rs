//! Procedural surfaces, named by their topology or their defect: for tests, examples and the fixtures.
//!
//! None of them depends on anything but its arguments.

use crate::mesh::TriangleSoup;
use crate::vec3::Vec3;
use std::f64::consts::TAU;
use std::ops::Range;

/// The soup of `points` and `triangles`, which the makers below know to be sound.
fn soup(points: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> TriangleSoup {
    TriangleSoup::new(points, triangles).expect("procedural shapes are sound")
}

/// All pairs of an element of `outer` and one of `inner`; the second one runs faster.
fn pairs(outer: Range<u32>, inner: Range<u32>) -> impl Iterator<Item = (u32, u32)> {
    outer.flat_map(move |i| inner.clone().map(move |j| (i, j)))
}

/// The two triangles into which the diagonal from the first corner to the third one cuts a square.
pub(crate) fn halves([a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// Points of the unit disk on `rings` rings of 6, 12, 18, ... points around a centre, and the triangles between
/// them, all turning left.
fn ring_disk(rings: u32) -> (Vec<[f64; 2]>, Vec<[u32; 3]>) {
    let mut points = vec![[0.0; 2]];
    for i in 1..=rings {
        for j in 0..6 * i {
            let (r, angle) = (f64::from(i) / f64::from(rings), TAU * f64::from(j) / f64::from(6 * i));
            points.push([r * angle.cos(), r * angle.sin()]);
        }
    }
    let mut triangles = Vec::new();
    for i in 1..=rings {
        for (sector, k) in pairs(0..6, 0..i) {
            // A sector has i edges on this ring and i - 1 on the one inside it.
            let (outer, inner) = (sector * i + k, sector * (i - 1) + k);
            let [a, b] = [on_ring(i, outer), on_ring(i, outer + 1)];
            let c = on_ring(i - 1, inner);
            triangles.push([c, a, b]);
            if k + 1 < i {
                triangles.push([c, b, on_ring(i - 1, inner + 1)]);
            }
        }
    }
    (points, triangles)
}

/// The number of point `j` on ring `i` of a disk: the centre comes first, then ring after ring, the `k`-th of 6 `k` points.
fn on_ring(i: u32, j: u32) -> u32 {
    if i == 0 { 0 } else { 1 + 3 * i * (i - 1) + j % (6 * i) }
}

/// A gently curved disk: `rings` rings of triangles, 6 `rings`^2 in all.
pub fn disk(rings: u32) -> TriangleSoup {
    let (points, triangles) = ring_disk(rings);
    let lifted = points.iter().map(|[x, y]| [*x, *y, 0.3 * (2.0 * x).sin() * (1.5 * y).cos()]);
    soup(lifted.collect(), triangles)
}

/// A flat disk: `rings` rings of triangles in the plane z = 0.
pub fn flat_disk(rings: u32) -> TriangleSoup {
    let (points, triangles) = ring_disk(rings);
    soup(points.iter().map(|[x, y]| [*x, *y, 0.0]).collect(), triangles)
}

/// A tube of radius 1, open at both ends: `around` facets, in `rows` rows over its `height`.
pub fn tube(around: u32, rows: u32, height: f64) -> TriangleSoup {
    let point = |k: u32| {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(k % around) / f64::from(around)).sin_cos();
        [cos, sin, height * f64::from(k / around) / f64::from(rows)]
    };
    let quad = |k: u32| {
        let (row, a, b) = (k / around * around, k % around, (k + 1) % around);
        let [a, b, c, d] = [row + a, row + b, row + around + b, row + around + a];
        halves([a, b, c, d])
    };
    soup((0..around * (rows + 1)).map(point).collect(), (0..around * rows).flat_map(quad).collect())
}

/// A ramp around an axis, between the radii 1 and 2: `sectors` of them, `per_turn` to a turn. From one turn on it would
/// cover itself when laid out flat.
pub fn ramp(per_turn: u32, sectors: u32) -> TriangleSoup {
    let point = |k: u32| {
        let turn = std::f64::consts::TAU * f64::from(k / 2) / f64::from(per_turn);
        let radius = 1.0 + f64::from(k % 2);
        [radius * turn.cos(), radius * turn.sin(), 0.05 * turn]
    };
    let quad = |i: u32| [[2 * i, 2 * i + 1, 2 * i + 3], [2 * i, 2 * i + 3, 2 * i + 2]];
    soup((0..2 * (sectors + 1)).map(point).collect(), (0..sectors).flat_map(quad).collect())
}

/// A disk that is strongly bent out of the plane over irregular points: z = 2.5 sin(3x+1) cos(4y) + 0.75 sin 9x
/// sin 7y, times `height`. Its harmonic P2 map has many invalid triangles. `jitter` (0 to 0.5) moves points inside
/// by that share of the ring distance.
pub fn bent_disk(rings: u32, jitter: f64, height: f64) -> TriangleSoup {
    let (mut points, triangles) = ring_disk(rings);
    let mut random = Random(12345);
    let inside = points.len() - 6 * rings as usize;
    for p in points.iter_mut().take(inside) {
        *p = p.map(|c| c + jitter / f64::from(rings) * random.symmetric());
    }
    let bump =
        |x: f64, y: f64| 2.5 * (3.0 * x + 1.0).sin() * (4.0 * y).cos() + 0.75 * (9.0 * x).sin() * (7.0 * y).sin();
    soup(points.iter().map(|[x, y]| [*x, *y, height * bump(*x, *y)]).collect(), triangles)
}

/// A square plate of `n` x `n` squares with a row of `holes` square holes, gently curved. `n` is at least
/// 4 `holes` + 1, so that every hole keeps a rim.
pub fn disk_with_holes(n: u32, holes: u32) -> TriangleSoup {
    let in_hole = |i: u32, j: u32| {
        let (row, step) = (n / 2, n / holes.max(1));
        (0..holes).any(|k| (i.abs_diff(step * k + step / 2)) == 0 && j == row)
    };
    let at = |i: u32, j: u32| i * (n + 1) + j;
    let mut triangles = Vec::new();
    for (i, j) in pairs(0..n, 0..n).filter(|(i, j)| !in_hole(*i, *j)) {
        triangles.extend(halves([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    }
    let coordinate = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
    let point = |k: u32| (coordinate(k / (n + 1)), coordinate(k % (n + 1)));
    let points = (0..(n + 1) * (n + 1)).map(point).map(|(x, y)| [x, y, 0.4 * (3.0 * x).sin() * y.cos()]);
    soup(points.collect(), triangles)
}

/// F5: five points in the plane on which Floater's theory is tested. The harmonic map onto the corners of a square
/// folds (Floater 1998, *Parametric tilings and scattered data approximation*, section 5 gives such an example).
/// The corners 0 to 3 belong at (1,0), (0,1), (-1,0), (0,-1).
pub fn floater_five() -> TriangleSoup {
    let points = vec![[0.0, 0.0, 0.0], [11.0, 0.0, 0.0], [10.0, 2.0, 0.0], [2.0, 11.0, 0.0], [5.0, 7.0, 0.0]];
    soup(points, vec![[4, 3, 0], [4, 2, 3], [4, 1, 2], [4, 0, 1]])
}

/// T4: three triangles around a vertex in space: the smallest surface whose harmonic map folds.
pub fn folding_three() -> TriangleSoup {
    let points = vec![[0.0, 0.0, 0.0], [1.0, 5.0, 8.0], [-1.0, 1.0, 2.0], [1.0, -5.0, 5.0]];
    soup(points, vec![[0, 1, 2], [0, 2, 3], [0, 3, 1]])
}

/// P6: six triangles around a vertex in the plane: the triangle that P1 folds is not the one that P2 folds.
pub fn folding_six() -> TriangleSoup {
    let ring = [[8.0, 1.0], [6.0, 5.0], [2.0, 9.0], [1.0, 5.0], [-7.0, -3.0], [-1.0, -5.0]];
    let points = std::iter::once([0.0; 3]).chain(ring.map(|[x, y]| [x, y, 0.0])).collect();
    soup(points, (0..6).map(|k| [0, 1 + k, 1 + (k + 1) % 6]).collect())
}

/// Two triangles that share a vertex and nothing else.
pub fn bow_tie() -> TriangleSoup {
    let points = vec![[0.0; 3], [1.0, 0.5, 0.0], [1.0, -0.5, 0.0], [-1.0, 0.5, 0.0], [-1.0, -0.5, 0.0]];
    soup(points, vec![[0, 2, 1], [0, 3, 4]])
}

/// A Moebius strip of `n` (at least 3) squares.
pub fn moebius(n: u32) -> TriangleSoup {
    let point = |i: u32, side: f64| {
        let angle = TAU * f64::from(i) / f64::from(n);
        let (r, z) = (1.0 + 0.3 * side * (0.5 * angle).cos(), 0.3 * side * (0.5 * angle).sin());
        [r * angle.cos(), r * angle.sin(), z]
    };
    let points = (0..n).flat_map(|i| [point(i, -1.0), point(i, 1.0)]).collect();
    let mut triangles = Vec::new();
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        // After one turn the two sides of the strip have changed places.
        let (c, d) = if i + 1 == n { (1, 0) } else { (2 * i + 2, 2 * i + 3) };
        triangles.extend([[a, c, d], [a, d, b]]);
    }
    soup(points, triangles)
}

/// A strip of `n` squares whose triangles get thinner and thinner, the last ones exactly flat.
pub fn sliver_strip(n: u32) -> TriangleSoup {
    let height = |i: u32| if i + 2 >= n { 0.0 } else { 0.25_f64.powi(i as i32) };
    let mut points = Vec::new();
    for i in 0..=n {
        let x = f64::from(i);
        points.extend([[x, 0.0, 0.0], [x + 0.5, height(i), 0.0]]);
    }
    let mut triangles = Vec::new();
    for i in 0..n {
        let a = 2 * i;
        triangles.extend([[a, a + 2, a + 1], [a + 1, a + 2, a + 3]]);
    }
    soup(points, triangles)
}

/// A curved plate cut along its middle: the two sides of the cut differ by a few units in the last place of
/// single precision, as exporters leave them.
pub fn cracked_patch() -> TriangleSoup {
    let n = 8;
    let height = |x: f64, y: f64| 0.2 * (2.0 * x + y).sin();
    let mut points = Vec::new();
    let mut triangles = Vec::new();
    for half in 0..2 {
        let base = points.len() as u32;
        for (i, j) in pairs(0..n / 2 + 1, 0..n + 1) {
            let (x, y) = (f64::from(half * n / 2 + i) / f64::from(n), f64::from(j) / f64::from(n));
            let on_cut = half == 1 && i == 0;
            let gap = if on_cut { 2e-7 * (1.0 + f64::from(j % 3)) } else { 0.0 };
            points.push([x + gap, y, height(x, y) - gap]);
        }
        let at = |i: u32, j: u32| base + i * (n + 1) + j;
        for (i, j) in pairs(0..n / 2, 0..n) {
            triangles.extend(halves([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
        }
    }
    soup(points, triangles)
}

/// A sphere of `n` (at least 2) bands between the poles.
pub fn sphere(n: u32) -> TriangleSoup {
    let m = 2 * n;
    let mut points = vec![[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
    for (i, j) in pairs(1..n, 0..m) {
        let (polar, angle) = (0.5 * TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
        points.push([polar.sin() * angle.cos(), polar.sin() * angle.sin(), polar.cos()]);
    }
    let at = |i: u32, j: u32| 2 + (i - 1) * m + j % m;
    let mut triangles = Vec::new();
    for j in 0..m {
        triangles.extend([[0, at(1, j), at(1, j + 1)], [1, at(n - 1, j + 1), at(n - 1, j)]]);
        for i in 1..n - 1 {
            triangles.extend(halves([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
        }
    }
    soup(points, triangles)
}

/// A torus of `n` (at least 3) squares around the axis and `m` (at least 3) around the tube.
pub fn ring_torus(n: u32, m: u32) -> TriangleSoup {
    let point = |i: u32, j: u32| {
        let (around, tube) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
        let r = 1.0 + 0.4 * tube.cos();
        [r * around.cos(), r * around.sin(), 0.4 * tube.sin()]
    };
    let points = pairs(0..n, 0..m).map(|(i, j)| point(i, j)).collect();
    // Both ways around, the last row is followed by the first one.
    let at = |i: u32, j: u32| i % n * m + j % m;
    let mut triangles = Vec::new();
    for (i, j) in pairs(0..n, 0..m) {
        triangles.extend(halves([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]));
    }
    soup(points, triangles)
}

/// A book: `pages` (at least 3) bent rectangles of `n` x `n` squares that meet in a straight spine, which is not
/// manifold. Page k holds the triangles from 2 k n^2 on; every second page lies on its other face.
pub fn book(pages: u32, n: u32) -> TriangleSoup {
    let point = |page: u32, i: u32, j: u32| {
        let (out, along) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
        let angle = TAU * f64::from(page) / f64::from(pages) + 0.4 * out;
        [out * angle.cos(), out * angle.sin(), along + 0.1 * out * (3.0 * along).sin()]
    };
    // The spine comes first, then page after page.
    let mut points: Vec<Vec3> = (0..=n).map(|j| point(0, 0, j)).collect();
    let mut triangles = Vec::new();
    for page in 0..pages {
        let base = points.len() as u32;
        points.extend(pairs(1..n + 1, 0..n + 1).map(|(i, j)| point(page, i, j)));
        let at = |i: u32, j: u32| if i == 0 { j } else { base + (i - 1) * (n + 1) + j };
        for (i, j) in pairs(0..n, 0..n) {
            let mut square = halves([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
            if page % 2 == 1 {
                square.iter_mut().for_each(|t| t.swap(1, 2));
            }
            triangles.extend(square);
        }
    }
    soup(points, triangles)
}

/// A finger: a disk whose middle is drawn out to a closed tube of height `length` (in diameters of the tube).
/// Its map needs an area ratio of about e^(4 `length`).
pub fn finger(around: u32, length: u32) -> TriangleSoup {
    let mut points = vec![];
    let rings = around / 3 * length + 2;
    let ring = |k: u32| {
        let height = f64::from(k) / f64::from(around / 3);
        let radius = if k == 0 { 1.5 } else { 0.5 };
        (radius, 1.0 * (height - f64::from(u32::from(k > 0)) / f64::from(around / 3)))
    };
    for (k, j) in pairs(0..rings, 0..around) {
        let (radius, z) = ring(k);
        let angle = TAU * (f64::from(j) + 0.5 * f64::from(k % 2)) / f64::from(around);
        points.push([radius * angle.cos(), radius * angle.sin(), z]);
    }
    let tip = points.len() as u32;
    points.push([0.0, 0.0, ring(rings - 1).1 + 0.2]);
    let at = |k: u32, j: u32| k * around + j % around;
    let mut triangles = Vec::new();
    for (k, j) in pairs(0..rings - 1, 0..around) {
        let [a, b] = [at(k, j), at(k, j + 1)];
        let [d, c] = [at(k + 1, j), at(k + 1, j + 1)];
        // Every second ring is turned by half a step: the shorter diagonal changes.
        triangles.extend(if k % 2 == 0 { [[a, b, d], [b, c, d]] } else { halves([a, b, c, d]) });
    }
    triangles.extend((0..around).map(|j| [at(rings - 1, j), at(rings - 1, j + 1), tip]));
    soup(points, triangles)
}

/// The pseudo-random numbers of SplitMix64 (Steele, Lea and Flood 2014, doi 10.1145/2660193.2660195).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    /// A number between -1 and 1.
    pub(crate) fn symmetric(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// A number below `n`.
    #[cfg(test)]
    pub(crate) fn below(&mut self, n: usize) -> usize {
        ((0.5 + 0.5 * self.symmetric()) * n as f64) as usize % n
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::repair::{Settings, repair};

    #[test]
    fn shapes_have_the_topology_of_their_names() {
        let check = |soup: TriangleSoup, components, loops, genus, orientable| {
            let got = repair(&soup, &Settings::default()).expect("a surface is left");
            let c = got.mesh.topology_summary();
            assert_eq!((c.components, c.boundary_loops, c.genus, c.orientable), (components, loops, genus, orientable));
        };
        check(disk(4), 1, 1, Some(0), true);
        check(flat_disk(3), 1, 1, Some(0), true);
        check(tube(5, 2, 1.0), 1, 2, Some(0), true);
        check(bent_disk(10, 0.3, 1.0), 1, 1, Some(0), true);
        check(disk_with_holes(17, 3), 1, 4, Some(0), true);
        check(floater_five(), 1, 1, Some(0), true);
        check(folding_three(), 1, 1, Some(0), true);
        check(folding_six(), 1, 1, Some(0), true);
        check(bow_tie(), 2, 2, Some(0), true);
        check(ramp(8, 16), 1, 1, Some(0), true);
        check(moebius(9), 1, 1, None, false);
        check(sliver_strip(12), 1, 1, Some(0), true);
        check(cracked_patch(), 1, 1, Some(0), true);
        check(sphere(6), 1, 0, Some(0), true);
        check(ring_torus(7, 5), 1, 0, Some(1), true);
        check(finger(12, 2), 1, 1, Some(0), true);
        check(ring_torus(9, 6), 1, 0, Some(1), true);
        check(book(3, 4), 3, 3, Some(0), true);
    }
}
