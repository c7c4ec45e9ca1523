//! Size fields: how long the edges of a mesh are to be, place by place.
//!
//! Sizes are asked for at places; away from one they grow with the distance, by the gradation g:
//!
//! h(x) = min over all places i of  s_i + g max(0, |x - x_i| - r_i)
//!
//! which is the largest field that is nowhere above what is asked for, and whose slope is at most g (the distance transform of
//! sampled functions; Persson 2006, *Mesh size functions for implicit geometry and PDE-based gradient limiting*, doi
//! 10.1007/s00366-006-0014-1, solves for it along a surface; here distances are those of space).
//!
//! Meshers take values on cells: [`SizeField::told`] halves a cube around a surface, and the cubes that meet it, until trilinear
//! interpolation tells the field (an octree; Yerry and Shephard 1983, doi 10.1109/MCG.1983.262997). How many cubes that takes
//! depends on the field, and not on the triangles of the surface: bisecting those made millions of a fan of needles as
//! long as the part (generic_twin_7081), each over the same places.

use crate::evaluate::Bvh;
use crate::vec3::{BoundingBox, Vec3, cross, distance, dot, sub};

/// Fields are told up to so many times the size that is asked for everywhere: a larger one may be given to a mesher later.
pub const TOLD_UP_TO: f64 = 4.0;

/// Interpolation tells a field well enough if it is off by less than this share of it. By experience: elements vary by more than
/// that around the size they are asked for.
const CLOSE: f64 = 0.1;

/// No place hides between the points that are looked at that asks for less than this share of the least that is found there.
const HIDDEN: f64 = 1.0 / 1.5;

/// Cubes are halved so often at most: from the length of a part to 1e-12 of it.
const MAX_HALVINGS: u32 = 40;

/// The cube around a surface begins so much before it, in its sides: facets of parts with flat sides would lie between cubes
/// else, in both of them.
const BEFORE: f64 = 0.0137;

/// A place at which edges of a length are asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizedPlace {
    /// Where.
    pub at: Vec3,
    /// The length, in the unit of the input; positive.
    pub size: f64,
    /// How far it holds before edges become longer, in the unit of the input.
    pub reach: f64,
}

impl SizedPlace {
    /// What this place asks for at a distance.
    fn asks(&self, distance: f64, gradation: f64) -> f64 {
        self.size + gradation * (distance - self.reach).max(0.0)
    }
}

/// A cube with the sizes at its corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizedCube {
    /// The corner with the least coordinates.
    pub low: Vec3,
    /// The length of its sides.
    pub side: f64,
    /// The sizes at its corners, along x first, then y, then z.
    pub sizes: [f64; 8],
}

impl SizedCube {
    /// A corner: the bits of its number tell where it is along x, y and z.
    pub fn corner(&self, number: usize) -> Vec3 {
        [0, 1, 2].map(|k| self.low[k] + if number >> k & 1 == 1 { self.side } else { 0.0 })
    }

    /// The size at a point in the cube, linear along each axis.
    fn interpolated(&self, x: Vec3) -> f64 {
        let along = [0, 1, 2].map(|k| ((x[k] - self.low[k]) / self.side).clamp(0.0, 1.0));
        let weight = |corner: usize| -> f64 {
            (0..3).map(|k| if corner >> k & 1 == 1 { along[k] } else { 1.0 - along[k] }).product()
        };
        (0..8).map(|corner| weight(corner) * self.sizes[corner]).sum()
    }

    /// How far a point is from the cube, and from its farthest corner.
    fn distances(&self, x: Vec3) -> (f64, f64) {
        let half = 0.5 * self.side;
        let (mut nearest, mut farthest) = (0.0, 0.0);
        for (x, low) in x.iter().zip(self.low) {
            let off = (x - low - half).abs();
            let outside = (off - half).max(0.0);
            nearest += outside * outside;
            farthest += (off + half) * (off + half);
        }
        (f64::sqrt(nearest), f64::sqrt(farthest))
    }
}

/// A field as cubes tell it.
#[derive(Clone, Debug)]
pub struct SizeTable {
    cubes: Vec<SizedCube>,
    around: Bvh,
    elsewhere: f64,
}

impl SizeTable {
    /// The sizes in these cubes, and `elsewhere`, which is the largest one everywhere.
    ///
    /// ```
    /// use planish_core::measure::sizes::{SizeTable, SizedCube};
    ///
    /// let cube = SizedCube { low: [0.0; 3], side: 2.0, sizes: [1.0, 3.0, 1.0, 3.0, 1.0, 3.0, 1.0, 3.0] };
    /// let table = SizeTable::new(vec![cube], 2.5);
    /// assert_eq!((table.at([0.5, 1.0, 1.0]), table.at([1.9, 1.0, 1.0]), table.at([9.0; 3])), (1.5, 2.5, 2.5));
    /// ```
    pub fn new(cubes: Vec<SizedCube>, elsewhere: f64) -> Self {
        let around = Bvh::new(cubes.iter().map(|cube| BoundingBox { min: cube.low, max: cube.corner(7) }));
        Self { cubes, around, elsewhere }
    }

    /// The size at a point: interpolated in its cube, the least where cubes meet.
    pub fn at(&self, x: Vec3) -> f64 {
        let mut least = self.elsewhere;
        self.around.overlapping(&BoundingBox { min: x, max: x }, |cube| {
            least = least.min(self.cubes[cube as usize].interpolated(x));
        });
        least
    }
}

/// The length of edges, place by place.
///
/// ```
/// use planish_core::measure::sizes::{SizeField, SizedPlace};
///
/// let places = [0.0, 10.0].map(|x| SizedPlace { at: [x, 0.0, 0.0], size: 1.0, reach: 1.0 });
/// let field = SizeField::new(places.to_vec(), 0.5);
/// assert_eq!(field.at([0.5, 0.0, 0.0]), 1.0, "within reach");
/// assert_eq!(field.at([5.0, 0.0, 0.0]), 1.0 + 0.5 * 4.0, "half-way, as far from both");
/// assert_eq!(SizeField::new(vec![], 0.5).at([0.0; 3]), f64::INFINITY, "nothing is asked for");
/// ```
#[derive(Clone, Debug)]
pub struct SizeField {
    places: Vec<SizedPlace>,
    gradation: f64,
}

impl SizeField {
    /// The field of these places; sizes grow by `gradation` times the distance, which is positive.
    pub fn new(places: Vec<SizedPlace>, gradation: f64) -> Self {
        Self { places, gradation }
    }

    /// The size at a point; infinite where nothing is asked for anywhere. All places are looked at.
    pub fn at(&self, x: Vec3) -> f64 {
        let asked = self.places.iter().map(|place| place.asks(distance(place.at, x), self.gradation));
        asked.fold(f64::INFINITY, f64::min)
    }

    /// The field on cubes that cover the triangles of a surface where it is below `most`, where sizes are cut off; none where that
    /// takes more than `at_most` cubes.
    ///
    /// It ends: sizes are positive, and sides become shorter than any of them.
    pub fn told(&self, surface: &[[Vec3; 3]], most: f64, at_most: usize) -> Option<Vec<SizedCube>> {
        let mut told = Vec::new();
        let mut waiting: Vec<Cell> = self.whole(surface, most).into_iter().collect();
        while let Some(cell) = waiting.pop() {
            if let Some(lattice) = self.needed_lattice(&cell, most) {
                waiting.extend((0..8).filter_map(|octant| self.octant(&cell, octant, &lattice, surface, most)));
            } else if cell.cube.sizes.iter().any(|size| *size < most) {
                if told.len() == at_most {
                    return None;
                }
                told.push(cell.cube);
            }
        }
        Some(told)
    }

    /// The cube around all of a surface; none where nothing is asked for.
    fn whole(&self, surface: &[[Vec3; 3]], most: f64) -> Option<Cell> {
        let around = BoundingBox::of(surface.iter().flatten().copied())?;
        let extent = (0..3).map(|k| around.max[k] - around.min[k]).fold(0.0, f64::max);
        let mut cube = SizedCube {
            low: around.min.map(|c| c - BEFORE * extent),
            side: (1.0 + 2.0 * BEFORE) * extent,
            sizes: [most; 8],
        };
        for corner in 0..8 {
            cube.sizes[corner] = self.at(cube.corner(corner)).min(most);
        }
        let all: Vec<Near> = (0..self.places.len() as u32).map(|place| Near { place, at_least: 0.0 }).collect();
        let places = self.near(&cube, &all, most);
        let faces = (0..surface.len() as u32).collect();
        (!places.is_empty()).then_some(Cell { cube, places, faces, halvings: 0 })
    }

    /// Those places that ask for the least at some point of a cube, or may do so, the least of what they may ask first. Of places that
    /// ask for the same one is enough: along a curve a thousand ask for one size within one cube (menger_sponge3). `places` are
    /// those of a cube around it.
    fn near(&self, cube: &SizedCube, places: &[Near], most: f64) -> Vec<Near> {
        // One of them asks for no more than this anywhere in the cube.
        let (mut least, mut one) = (most, None);
        let mut near = Vec::new();
        for Near { place, at_least } in places {
            // Neither does this one, nor those behind it.
            if *at_least >= least {
                break;
            }
            let found = &self.places[*place as usize];
            let (nearest, farthest) = cube.distances(found.at);
            let at_least = found.asks(nearest, self.gradation);
            if at_least < least {
                near.push(Near { place: *place, at_least });
                let at_most = found.asks(farthest, self.gradation);
                if at_most < least {
                    (least, one) = (at_most, Some(*place));
                }
            }
        }
        near.retain(|found| found.at_least < least || Some(found.place) == one);
        near.sort_by(|a, b| a.at_least.total_cmp(&b.at_least));
        near
    }

    /// The least that places near a point ask for there.
    fn least(&self, near: &[Near], x: Vec3) -> f64 {
        let mut least = f64::INFINITY;
        for Near { place, at_least } in near {
            if *at_least >= least {
                break;
            }
            let place = &self.places[*place as usize];
            least = least.min(place.asks(distance(place.at, x), self.gradation));
        }
        least
    }

    /// The field at the corners of a cube and in between: at 3 times 3 times 3 points, along x first.
    fn on_lattice(&self, cell: &Cell, most: f64) -> [f64; LATTICE] {
        let mut lattice = [most; LATTICE];
        for (number, value) in lattice.iter_mut().enumerate() {
            let steps = steps(number);
            *value = if steps.iter().all(|step| *step != 1) {
                cell.cube.sizes[corner_number(steps.map(|step| step / 2))]
            } else {
                let x = [0, 1, 2].map(|k| cell.cube.low[k] + 0.5 * steps[k] as f64 * cell.cube.side);
                self.least(&cell.places, x).min(most)
            };
        }
        lattice
    }

    /// The field on the lattice of a cube; none where the sizes at its corners tell the field in it.
    fn needed_lattice(&self, cell: &Cell, most: f64) -> Option<[f64; LATTICE]> {
        if cell.cube.side <= cell.least() || cell.halvings == MAX_HALVINGS {
            return None;
        }
        let lattice = self.on_lattice(cell, most);
        let found = lattice.iter().copied().fold(most, f64::min);
        let is_close = |(number, found): (usize, &f64)| (cell.told(number) - found).abs() <= CLOSE * found;
        let is_told = cell.least() >= HIDDEN * found && lattice.iter().enumerate().all(is_close);
        (!is_told).then_some(lattice)
    }

    /// An eighth of a cube, where the surface passes through it and places ask for less than `most` there.
    fn octant(
        &self,
        cell: &Cell,
        octant: usize,
        lattice: &[f64; LATTICE],
        surface: &[[Vec3; 3]],
        most: f64,
    ) -> Option<Cell> {
        let side = 0.5 * cell.cube.side;
        let from = [0, 1, 2].map(|k| octant >> k & 1);
        let low = [0, 1, 2].map(|k| cell.cube.low[k] + from[k] as f64 * side);
        let mut cube = SizedCube { low, side, sizes: [most; 8] };
        for corner in 0..8 {
            let [i, j, k] = [0, 1, 2].map(|k| from[k] + (corner >> k & 1));
            cube.sizes[corner] = lattice[i + 3 * j + 9 * k];
        }
        let faces: Vec<u32> = cell.faces.iter().copied().filter(|f| meets(&cube, &surface[*f as usize])).collect();
        if faces.is_empty() {
            return None;
        }
        let places = self.near(&cube, &cell.places, most);
        (!places.is_empty()).then_some(Cell { cube, places, faces, halvings: cell.halvings + 1 })
    }
}

/// Points at which a cube is looked at.
const LATTICE: usize = 27;

/// Where a point of the lattice is along x, y and z: 0, 1 or 2.
fn steps(number: usize) -> [usize; 3] {
    [number % 3, number / 3 % 3, number / 9]
}

/// The number of the corner that is there along x, y and z: 0 or 1.
fn corner_number([i, j, k]: [usize; 3]) -> usize {
    i + 2 * j + 4 * k
}

/// A place near a cube.
#[derive(Clone, Copy, Debug)]
struct Near {
    place: u32,
    /// It asks for no less in the cube.
    at_least: f64,
}

/// A cube that is looked at.
struct Cell {
    cube: SizedCube,
    /// The places that tell the field in it, the least of what they may ask first; at least one.
    places: Vec<Near>,
    /// The triangles that pass through it.
    faces: Vec<u32>,
    /// How often it was halved.
    halvings: u32,
}

impl Cell {
    /// No place asks for less in the cube.
    fn least(&self) -> f64 {
        self.places[0].at_least
    }

    /// What trilinear interpolation tells at a point of the lattice: the mean of the corners around it.
    fn told(&self, number: usize) -> f64 {
        let steps = steps(number);
        let is_around = |corner: &usize| (0..3).all(|k| steps[k] == 1 || steps[k] / 2 == corner >> k & 1);
        let (sum, count) =
            (0..8).filter(is_around).fold((0.0, 0.0), |(sum, count), c| (sum + self.cube.sizes[c], count + 1.0));
        sum / count
    }
}

/// Whether a triangle and a cube have points in common, but for what rounding leaves undecided: then no axis separates them, of
/// those across the sides of the cube, of the triangle, and pairs of both (Akenine-Moller 2001, *Fast 3D triangle-box overlap
/// testing*, doi 10.1080/10867651.2001.10487535).
fn meets(cube: &SizedCube, triangle: &[Vec3; 3]) -> bool {
    let half = 0.5 * cube.side;
    let centre = cube.low.map(|c| c + half);
    let corners = triangle.map(|corner| sub(corner, centre));
    // Most of an octree's cubes are told by these: a corner in the cube, or all corners beyond one of its sides.
    if corners.iter().any(|corner| corner.iter().all(|c| c.abs() <= half)) {
        return true;
    }
    let side = half * (1.0 + 1e-9);
    let is_beyond =
        |k: usize| corners.iter().all(|corner| corner[k] > side) || corners.iter().all(|corner| corner[k] < -side);
    if is_beyond(0) || is_beyond(1) || is_beyond(2) {
        return false;
    }
    let sides = [0, 1, 2].map(|k| sub(corners[(k + 1) % 3], corners[k]));
    let units = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let separates = |axis: Vec3| {
        let along = corners.map(|corner| dot(axis, corner));
        let reach = half * axis.iter().map(|c| c.abs()).sum::<f64>() * (1.0 + 1e-9);
        along.iter().all(|x| *x > reach) || along.iter().all(|x| *x < -reach)
    };
    let is_apart = separates(cross(sides[0], sides[1]))
        || units.into_iter().any(|unit| sides.into_iter().any(|side| separates(cross(unit, side))));
    !is_apart
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Places that differ in all they have, without order.
    fn places(count: u32) -> Vec<SizedPlace> {
        let place = |i: u32| SizedPlace {
            at: [i * 7 % 101, i * 29 % 97, i * 53 % 89].map(f64::from),
            size: 1.0 + f64::from(i * 31 % 17),
            reach: f64::from(i % 5),
        };
        (0..count).map(place).collect()
    }

    /// Points all over a triangle.
    fn over([a, b, c]: [Vec3; 3], steps: u32) -> Vec<Vec3> {
        let at = |i: u32, j: u32| {
            let [s, t] = [i, j].map(|n| f64::from(n) / f64::from(steps));
            [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]))
        };
        (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| at(i, j))).collect()
    }

    #[test]
    fn cubes_tell_the_least_of_all_places() {
        let surface = [[[-5.0, -5.0, 40.0], [110.0, 0.0, 20.0], [0.0, 100.0, 50.0]]];
        for count in [1, 9, 100, 1000] {
            let field = SizeField::new(places(count), 0.3);
            let cubes = field.told(&surface, 30.0, usize::MAX).expect("any number");
            let table = SizeTable::new(cubes, 30.0);
            for x in over(surface[0], 60) {
                let (found, told) = (field.at(x).min(30.0), table.at(x));
                assert!((told - found).abs() <= 0.25 * found, "{told} for {found} at {x:?}, {count} places");
            }
        }
    }

    /// On a facet a thousand times as long as elements are at its end, or in the middle of a side, cubes are small there alone; and
    /// a fan of a hundred needles over the same place takes no more than one of them.
    #[test]
    fn cubes_are_small_where_sizes_are_whatever_the_triangles() {
        let facet = [[0.0; 3], [1000.0, 0.0, 0.0], [0.0, 10.0, 0.0]];
        let rib = |k: u32| [1000.0, 0.01 * f64::from(k), 0.0];
        let needles: Vec<_> = (0..100).map(|k| [[0.0; 3], rib(k), rib(k + 1)]).collect();
        for at in [[0.0; 3], [437.0, 0.0, 0.0]] {
            let field = SizeField::new(vec![SizedPlace { at, size: 1.0, reach: 2.0 }], 0.4);
            let one = field.told(&[facet], 100.0, usize::MAX).expect("any number");
            let fan = field.told(&needles, 100.0, usize::MAX).expect("any number");
            assert!((10..1000).contains(&one.len()) && fan.len() <= one.len(), "{} and {}", one.len(), fan.len());
            let table = SizeTable::new(one.clone(), 100.0);
            for x in over(facet, 500) {
                let (found, told) = (field.at(x).min(100.0), table.at(x));
                assert!((told - found).abs() <= 0.25 * found, "{told} for {found} at {x:?}");
            }
            let least = one.iter().flat_map(|cube| cube.sizes).fold(f64::INFINITY, f64::min);
            assert!(least < 1.5, "{least}");
            assert!(field.told(&[facet], 100.0, one.len() - 1).is_none(), "one less is not enough");
        }
        assert_eq!(SizeField::new(vec![], 0.4).told(&[facet], 100.0, 0), Some(vec![]), "nothing is asked for");
        assert_eq!(SizeField::new(places(9), 0.4).told(&[], 100.0, 0), Some(vec![]), "there is no surface");
    }

    #[test]
    fn a_triangle_meets_the_cubes_that_it_passes_through() {
        let cube = SizedCube { low: [0.0; 3], side: 1.0, sizes: [1.0; 8] };
        let moved = |by: f64| [[-1.0, 0.5, 0.5], [2.0, 0.5, 0.5], [2.0, 0.6, 3.0]].map(|x| [x[0], x[1], x[2] + by]);
        assert!(meets(&cube, &moved(0.0)) && meets(&cube, &moved(0.5)), "through it, and along a side");
        assert!(!meets(&cube, &moved(0.51)), "above it");
        // Its box covers a corner of the cube, it does not.
        assert!(!meets(&cube, &[[2.3, -0.2, 0.5], [-0.2, 2.3, 0.5], [2.3, 2.3, 0.5]]));
        assert!(meets(&cube, &[[1.9, -0.2, 0.5], [-0.2, 1.9, 0.5], [1.9, 1.9, 0.5]]));
    }
}
